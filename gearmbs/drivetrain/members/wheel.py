"""Wheels whose body deforms between their teeth and their shaft: by a thin web and rim, or a model.

Such a wheel is a body of its own, fixed to its shaft at its bore. Its teeth stand on its rim, which moves against the
bore as its outer face does on average: it turns, shifts and tilts. That a rim becomes oval under the teeth in mesh is
in its modes, but not felt by the teeth.

The frame of a wheel has its origin on the axis at mid-face, z along the axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
import scipy.sparse as sp

from gearmbs.drivetrain.members.sources import ALL, MODES, ROUND, body_source
from gearmbs.drivetrain.part import errors_named
from gearmbs.drivetrain.shaft import DAMPING, damping_of
from gearmbs.flexible import (
    ElasticMaterial,
    FiniteElementModel,
    Interface,
    ModalModel,
    Seat,
    reduce_model,
    solid_model,
)
from gearmbs.flexible.modal_model import shapes_at
from gearmbs.flexible.solid import revolved_mesh
from gearmbs.gears.geometry import MM
from gearmbs.schema.described import Described, chosen, make
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity

if TYPE_CHECKING:
    from gearmbs.gears.spec import GearSpec

BORE, RIM = "bore", "rim"
"""Names of the seats at which a wheel is on its shaft, and at which its teeth are."""

AROUND = 24
"""Elements round about: with 48 the frequencies of a wheel on its web are 0.1 % lower at most."""

NEAR = 1e-6
"""Distance from a face, by its radius, up to which a node is on it."""

OPEN = 0.25 * 2.0 * math.pi * (1.0 + 1e-6)
"""Largest angle between neighbours on a face, rad: four nodes go round, and those of a disc that stands across the axis
leave almost half a turn open on both sides."""

IN_SHAFT = "shaft"
"""What ``body`` says of a wheel that is cut from its shaft, whose mass is the shaft's."""

Length = Annotated[Quantity, Measure("length", above=0)]
Sizes = Measure("length", above=0, several=2)


def _need(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


@dataclass(frozen=True, kw_only=True)
class FlexibleWheel(Described):
    """How the body of a wheel deforms. Give ``hub``, ``rim`` and ``web``, or a ``model``.

    Parameters
    ----------
    hub, rim : float or str, optional
        Diameters of the hub and inside the rim, m; between them the wheel is as thick as its web. Bore, root circle
        and face width are those of the wheel. With a model ``rim`` is the diameter outside of which nodes are those of
        the teeth; default: the root circle, less what a mesh rounds of it.
    web : float or str, optional
        Its thickness, in the middle of the face, m.
    around : int
        Elements round about.
    model : FiniteElementModel, ModalModel or mapping, optional
        Of `gearmbs.flexible`; or a table with ``program``, ``files`` and keywords of its reader, as of a housing. Mass
        and inertia of the wheel follow from it. A body with modes has seats called "bore" and "rim".
    bore : sequence of 2 floats, optional
        Of finite elements: diameter and width within whose cylinder nodes are those of the bore, m; default: the
        wheel's bore and face width.
    at : float or str
        Place of the model's origin along the axis, from mid-face, m.
    faces : {"average", "rigid"}
        How nodes follow the bore, see `gearmbs.flexible.Interface`; those of the rim are followed on average.
    modes : int or "all", optional
        Shapes beside the static ones of bore and rim; default 20 of finite elements, all of a body with modes.
    damping : float, sequence or bands
        See `gearmbs.flexible.damping_ratios`.

    Raises
    ------
    ValueError
    """

    error: ClassVar[type[ValueError]] = ValueError
    section: ClassVar[str] = "body"

    hub: Length = None
    rim: Length = None
    web: Length = None
    around: Annotated[int, Measure(low=8, whole=True, remedy="give a whole number from 8 up")] = AROUND
    model: Any = None
    bore: Any = None
    at: Annotated[Quantity, Measure("length")] = 0.0
    faces: str = "rigid"
    modes: Any = None
    damping: Any = DAMPING

    def __post_init__(self) -> None:
        super().__post_init__()
        told = [name for name in ("hub", "web") if getattr(self, name) is not None]
        if self.model is None:
            missing = [name for name in ("hub", "rim", "web") if getattr(self, name) is None]
            _need(not missing, f"body: {' and '.join(missing)} missing; give hub, rim and web of the wheel, or a model")
            _need(self.bore is None, f"body: bore is {self.bore!r}; without a model it is the wheel's bore_radius")
            assert self.hub is not None
            assert self.rim is not None
            _need(
                self.hub < self.rim,
                f"body: hub is {MM * self.hub:.6g} mm and rim {MM * self.rim:.6g} mm; both are diameters, the rim's "
                "the larger one",
            )
        else:
            _need(not told, f"body: {', '.join(told)} beside model; give one of them")
            with errors_named("body: model"):
                object.__setattr__(self, "model", body_source(self.model))
            own = ("around", "bore", "rim", "faces") if isinstance(self.model, ModalModel) else ("around",)
            usual = {one.name: one.default for one in fields(self)}
            idle = [name for name in own if getattr(self, name) != usual[name]]
            _need(not idle, f"body: {', '.join(idle)} beside model, which has its own; leave it out")
        counted = isinstance(self.modes, int) and not isinstance(self.modes, bool) and self.modes >= 1
        _need(
            counted or self.modes in (None, ALL),
            f"body: modes is {self.modes!r}; give a whole number from 1 up, or '{ALL}'",
        )
        chosen(("average", "rigid"), self.faces, "body: ", ValueError, "faces")
        with errors_named("body: damping"):
            damping_of(self.damping)

    @classmethod
    def of(cls, given: Any) -> FlexibleWheel:
        """Return the body that is given, or that a table of its fields describes."""
        if isinstance(given, FlexibleWheel):
            return given
        _need(
            isinstance(given, Mapping),
            f"body is {given!r}; give a table, a FlexibleWheel, or '{IN_SHAFT}' of a wheel cut from its shaft",
        )
        return make(cls, given, "body", ValueError)

    def check(self, gear: GearSpec) -> None:
        """Refuse a body that is none of a wheel.

        Raises
        ------
        ValueError
        """
        _need(not gear.internal, "body is given, and the wheel is internal; its rim is rim_thickness: leave body out")
        if self.model is not None:
            return
        assert self.hub is not None
        assert self.rim is not None
        assert self.web is not None
        _need(gear.bore_radius > 0.0, "body needs the wheel's bore; give bore_radius, that of the shaft there")
        sizes = (2.0 * gear.bore_radius, self.hub, self.rim, 2.0 * gear.root_radius)
        _need(
            all(a < b for a, b in pairwise(sizes)),
            "body: bore, hub, rim and root circle are {:.5g}, {:.5g}, {:.5g} and {:.5g} mm in diameter; they "
            "must rise".format(*(MM * d for d in sizes)),
        )
        _need(
            self.web < gear.face_width,
            f"body: web is {MM * self.web:.5g} mm and the face width {MM * gear.face_width:.5g} mm; a web is thinner "
            "than the face is wide: leave body out of a wheel without one",
        )

    def weight(self, gear: GearSpec) -> tuple[float, tuple[float, float, float]]:
        """Return mass (kg) and moments of inertia about x, y and z through mid-face (kg m^2)."""
        if self.model is not None:
            found = self.model.properties if isinstance(self.model, ModalModel) else self.model.mass_properties()
            away = np.asarray(found.com, dtype=float) + [0.0, 0.0, self.at]
            moments = np.diag(found.inertia) + found.mass * (away @ away - away**2)
            return float(found.mass), (float(moments[0]), float(moments[1]), float(moments[2]))
        assert self.hub is not None
        assert self.rim is not None
        assert self.web is not None
        # teeth on the root circle, of the same moment of inertia, weigh a little more
        ring = _ring(2.0 * gear.root_radius, 2.0 * gear.pitch_radius, gear.face_width, gear.material.density)
        full = (gear.mass - ring[0] + ring[3] / gear.root_radius**2, *gear.inertia)
        # what is cut out on both sides of the web: a ring as wide as the face, less one as wide as the web
        wide, thin = (_ring(self.hub, self.rim, width, gear.material.density) for width in (gear.face_width, self.web))
        left = [f - w + t for f, w, t in zip(full, wide, thin)]
        return left[0], (left[1], left[2], left[3])

    def body(self, name: str, gear: GearSpec) -> ModalModel:
        """Return the wheel as a body with modes, whose seats are its bore and its rim."""
        if isinstance(self.model, ModalModel):
            moved = self.model if self.at == 0.0 else self.model.placed(np.eye(3), np.array([0.0, 0.0, self.at]))
            lacking = [seat for seat in (BORE, RIM) if seat not in moved.seats]
            _need(
                not lacking,
                f"body: its model has no seat {' and '.join(map(repr, lacking))}; its seats are "
                f"{', '.join(moved.seats) or 'none'}: call them '{BORE}' and '{RIM}'",
            )
            seats = {key: self._on_axis(moved, key) for key in (BORE, RIM)}
            found = replace(moved, seats=seats, name=name)
            return found.slowest(self.modes) if isinstance(self.modes, int) else found
        model, faces = self._of_dimensions(name, gear) if self.model is None else self._of_model(gear)
        if self.modes == ALL:
            return reduce_model(model, faces, max_frequency=np.inf, name=name)
        # most of its inertia is in the rim, which teeth turn
        return reduce_model(model, faces, modes=self.modes or MODES, name=name, relief=True)

    def _on_axis(self, model: ModalModel, seat: str) -> Seat:
        """Return a seat at mid-face on the axis, with a rigid arm from where it is."""
        own = model.seats[seat]
        moved, turned = (own.moved, own.turned) if own.turns else shapes_at(model, own.position)
        return Seat(np.zeros(3), moved - np.cross(turned, own.position), turned)

    def _of_dimensions(self, name: str, gear: GearSpec) -> tuple[FiniteElementModel, list[Interface]]:
        """Return the finite elements of hub, web and rim, with their seats.

        Teeth are masses on the root circle that have their moment of inertia: they do not stiffen the rim.
        """
        assert self.hub is not None
        assert self.rim is not None
        assert self.web is not None
        bore, root, wide, thin = gear.bore_radius, gear.root_radius, gear.face_width, self.web
        radii = np.array([bore, 0.5 * self.hub, 0.25 * (self.hub + self.rim), 0.5 * self.rim, root])
        # prisms of the areas of their circles, so that masses are right, and moments to the fourth power of the angle
        around = self.around
        radii = radii * math.sqrt(2.0 * math.pi / (around * math.sin(2.0 * math.pi / around)))
        inside, outside = radii[1], radii[3]
        mesh = revolved_mesh(
            radii, np.array([-wide, -thin, thin, wide]) / 2, around,
            lambda r, z: abs(z) < thin / 2 or not inside < r < outside,
        )  # fmt: skip
        material = ElasticMaterial(gear.material.youngs_modulus, gear.material.poisson_ratio, gear.material.density)
        model = solid_model(mesh, material, name=name)
        across, flat = np.hypot(*model.positions[:, :2].T), math.cos(math.pi / around)
        on_bore, on_rim = (
            (across <= r * (1.0 + NEAR)) & (across >= r * flat * (1.0 - NEAR)) for r in (radii[0], radii[-1])
        )
        teeth = _ring(2.0 * root, 2.0 * gear.pitch_radius, wide, gear.material.density)[3]
        shares = np.where(on_rim, teeth / np.sum(across[on_rim] ** 2), 0.0)[model.dofs[:, 0]]
        model = replace(model, mass=model.mass + sp.diags_array(shares, format="csc"))
        return model, [_seat(model, BORE, on_bore, self.faces), _seat(model, RIM, on_rim, "average")]

    def _of_model(self, gear: GearSpec) -> tuple[FiniteElementModel, list[Interface]]:
        """Return the given finite elements, with the nodes of bore and teeth."""
        model = self.model if self.at == 0.0 else self.model.placed(np.eye(3), np.array([0.0, 0.0, self.at]))
        diameter, width = (
            (2.0 * gear.bore_radius, gear.face_width) if self.bore is None else self.read("bore", self.bore, Sizes)
        )
        across, along = np.hypot(*model.positions[:, :2].T), np.abs(model.positions[:, 2])
        on_bore = (across <= 0.5 * ROUND * diameter) & (along <= 0.5 * ROUND * width)
        outside = 2.0 * gear.root_radius / ROUND if self.rim is None else self.rim
        on_rim = (across >= 0.5 * outside) & (along <= 0.5 * ROUND * gear.face_width)
        for label, inside, told in ((BORE, on_bore, f"bore = ({MM * diameter:.4g} mm, {MM * width:.4g} mm)"),
                                    (RIM, on_rim, f"rim = {MM * outside:.4g} mm")):  # fmt: skip
            _need(
                int(inside.sum()) >= 3,
                f"body: {int(inside.sum())} nodes of its model are those of the {label}, {told}; its nodes are "
                f"{MM * across.min():.4g} to {MM * across.max():.4g} mm off the axis, z: check at, or give {label}",
            )
            gap = _widest_gap(model.positions[inside])
            _need(
                gap <= OPEN,
                f"body: nodes of its model that are those of the {label}, {told}, do not go round the axis, z: for "
                f"{math.degrees(gap):.4g} deg there are none; give a model whose axis is z, or {label}",
            )
        return model, [_seat(model, BORE, on_bore, self.faces), _seat(model, RIM, on_rim, "average")]


def _widest_gap(positions: np.ndarray) -> float:
    """Return the largest angle about z between neighbours of some nodes, rad."""
    angles = np.sort(np.arctan2(positions[:, 1], positions[:, 0]))
    return float(np.diff(angles, append=angles[0] + 2.0 * math.pi).max())


def _ring(inner: float, outer: float, width: float, density: float) -> tuple[float, float, float, float]:
    """Return mass and moments about x, y and z of a ring by its diameters, m."""
    mass = density * 0.25 * math.pi * (outer**2 - inner**2) * width
    squares = 0.25 * (inner**2 + outer**2)
    across = mass * (3.0 * squares + width**2) / 12.0
    return mass, across, across, 0.5 * mass * squares


def _seat(model: FiniteElementModel, name: str, inside: np.ndarray, kind: str) -> Interface:
    return Interface(name, [int(k) for k in model.ids[inside]], kind, at=(0.0, 0.0, 0.0))


def seat_of_wheel(wheel: str) -> str:
    """Return the name of the joint that fixes a wheel to its shaft."""
    return f"{wheel} seat"
