"""Housings of a drivetrain: rigid, with modes by their numbers, or of finite elements; and what they stand on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from gearmbs.drivetrain.members.sources import ALL, axes_of, body_source
from gearmbs.drivetrain.part import DrivetrainError, Part, errors_named, require
from gearmbs.drivetrain.shaft import DAMPING, damping_of
from gearmbs.schema.described import chosen
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity

Mass = Annotated[Quantity, Measure("mass", above=0)]
Three = tuple[Quantity, Quantity, Quantity]


@dataclass(frozen=True, kw_only=True)
class Mount(Part):
    """An elastic mount between a housing and the ground.

    Parameters
    ----------
    at : sequence of 3 floats
        Place in global components, m.
    stiffness, damping : sequence of 3 floats
        Along the global axes, N/m and N s/m.
    radius : float or str, optional
        Of the foot, m: the nodes of a finite-element housing so near to the place carry it.
    """

    title: ClassVar[str] = "mount"

    at: Annotated[Three, Measure("length", several=3)]
    stiffness: Annotated[Three, Measure("stiffness", 0, several=3)]
    damping: Annotated[Three, Measure("damping", 0, several=3)] = (0.0, 0.0, 0.0)
    radius: Annotated[Quantity, Measure("length", above=0)] = None


@dataclass(frozen=True, kw_only=True)
class HousingMode(Part):
    """A structural mode of a housing by its modal mass and stiffness, and how the bearing seats move in it.

    Parameters
    ----------
    mass, stiffness : float or str
        Modal mass (kg) and stiffness (N/m) for a displacement of one metre at shape 1.
    damping_ratio : float
        Of critical damping.
    shape : mapping of str to 3 floats
        Displacement of bearing seats and sensors, by name, in global components at the start; others stay.
    """

    title: ClassVar[str] = "mode"

    mass: Mass
    stiffness: Annotated[Quantity, Measure("stiffness", above=0)]
    shape: Mapping[str, Any]
    damping_ratio: float = 0.02

    @property
    def frequency(self) -> float:
        """Natural frequency with the housing held, Hz."""
        return math.sqrt(self.stiffness / self.mass) / (2.0 * math.pi)


@dataclass(frozen=True, kw_only=True)
class Housing(Part):
    """A housing on mounts: rigid, with structural modes by their numbers, or a finite-element model.

    A finite-element housing carries each bearing by its nodes within the bearing's outer ring, found by the place,
    the outside diameter and the width of the bearing; each mount by those within its radius.

    Parameters
    ----------
    mass : float or str, optional
        kg; needed without ``model``.
    inertia : sequence of 3 floats, optional
        About the centre of mass in global axes, kg m^2; likewise.
    at : sequence of 3 floats
        Centre of mass in global components, m; with ``model`` the origin of its nodes' frame.
    mounts : sequence of Mount
        None: fixed to the ground, which a finite-element housing is not.
    modes : sequence of HousingMode, or int or "all"
        By their numbers; with ``model`` how many of its shapes between bearings and mounts are kept beside the static
        ones (default 20), or of a body with modes how many of these (default all).
    model : FiniteElementModel, ModalModel or mapping, optional
        Of `gearmbs.flexible`; or a table with ``program``, one of
        `gearmbs.drivetrain.members.sources.PROGRAMS`, ``files``, and the keywords of its
        reader, as ``length = "mm"``.
    axes : sequence of 3 by 3 floats, optional
        Columns: the axes of the nodes' frame in global components; default: the same.
    seats : mapping of str, optional
        By bearing: outside diameter and width of what it sits in, m, instead of those of ``rolling``. By bearing or
        mount: name of the seat, or number of the node, of a ``model`` with modes, else the one nearest to it.
    faces : {"average", "rigid"}
        How nodes follow their seat, see `gearmbs.flexible.Interface`.
    damping : float, sequence or bands
        Of the modes of a ``model``, see `gearmbs.flexible.damping_ratios`.

    Raises
    ------
    DrivetrainError
    """

    title: ClassVar[str] = "housing"

    mass: Mass = None
    inertia: Annotated[Three | None, Measure("inertia", above=0, several=3)] = None
    at: Annotated[Three, Measure("length", several=3)] = (0.0, 0.0, 0.0)
    mounts: tuple[Mount, ...] = ()
    modes: Any = ()
    model: Any = None
    axes: Any = None
    seats: Mapping[str, Any] = field(default_factory=dict)  # type: ignore[assignment]
    faces: str = "average"
    damping: Any = DAMPING
    told: Any = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.model, Mapping):
            # for a file
            object.__setattr__(self, "told", dict(self.model))
        if self.model is None:
            for name in ("mass", "inertia"):
                require(getattr(self, name) is not None, f"{self.label}: {name} is missing; give it, or a model")
            typed = isinstance(self.modes, tuple | list) and all(isinstance(mode, HousingMode) for mode in self.modes)
            require(
                typed, f"{self.label}: modes is {self.modes!r}; give HousingMode objects, or a model beside a number"
            )
            object.__setattr__(self, "modes", tuple(self.modes))
            return
        for name in ("mass", "inertia"):
            require(getattr(self, name) is None, f"{self.label}: {name} follows from model; leave it out")
        require(
            bool(self.mounts),
            f"{self.label}: mounts is empty; give the mounts on which a housing of finite elements stands",
        )
        counted = isinstance(self.modes, int) and not isinstance(self.modes, bool) and self.modes >= 1
        require(
            counted or self.modes in ((), ALL),
            f"{self.label}: modes is {self.modes!r} beside model; give a whole number from 1 up, or '{ALL}'",
        )
        chosen(("average", "rigid"), self.faces, f"{self.label}: ", DrivetrainError, "faces")
        with errors_named(f"{self.label}: damping"):
            damping_of(self.damping)
        object.__setattr__(self, "axes", axes_of(self.axes, self.label))
        with errors_named(f"{self.label}: model"):
            object.__setattr__(self, "model", body_source(self.model))

    @property
    def turned(self) -> np.ndarray:
        """Axes of the body's frame in global components, as columns."""
        return np.eye(3) if self.axes is None else np.array(self.axes)
