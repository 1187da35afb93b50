"""Couplings and clutches between shafts in line: rigid ones, elastic ones, and shafts that only twist."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from gearmbs.dae.equations.loads.forces import Diagnostic
from gearmbs.drivetrain.part import Attached, Part, require
from gearmbs.drivetrain.torque_element import ACCOUNTS, ShaftTorque
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity
from gearmbs.wording import warn

TWIST = Diagnostic("twist", "rad")

Stiffness = Annotated[Quantity, Measure("N*m/rad", above=0)]
Angle = Annotated[Quantity, Measure("angle", 0)]
PositiveAngle = Annotated[Quantity, Measure("angle", above=0)]
Length = Annotated[Quantity, Measure("length", above=0)]
Damping = Annotated[Quantity, Measure("time", 0)]


@dataclass(frozen=True, kw_only=True)
class Coupling(Part, ABC):
    """What all couplings share.

    Parameters
    ----------
    first, second : str
        Shafts; the twist is the angle of the second against the first.
    stations : sequence of 2 floats, optional
        Where it is on either, m; default: right end of the first, left end of the second. The shafts lie so that both
        places meet.
    """

    title: ClassVar[str] = "coupling"
    kind: ClassVar[str] = "coupling"

    first: str
    second: str
    stations: Annotated[tuple[Quantity, Quantity] | None, Measure("length", several=2)] = None

    @property
    def tangent(self) -> float:
        """Torsional stiffness at small twist, N m/rad; infinite for rigid couplings."""
        return math.inf

    @property
    def tangent_damping(self) -> float:
        """Torsional damping at small twist, N m s/rad."""
        return 0.0

    @property
    def tilt(self) -> np.ndarray:
        """How the second axis is turned against the first, in its axes that do not turn, shape (3, 3)."""
        return np.eye(3)

    @property
    def shift(self) -> np.ndarray:
        """How far the place on the second shaft is from that on the first, in the same axes, m, shape (3,)."""
        return np.zeros(3)

    def follows(self, angle: float, *, forward: bool = True) -> tuple[float, float]:
        """Return how the other shaft stands where one is at an angle, rad, and how fast it turns a rad/s of that one.

        Parameters
        ----------
        angle : float
            Of the first shaft, or of the second one if not ``forward``, about its axis.
        """
        return angle, 1.0

    def holds(self, role: str) -> np.ndarray:
        """Return what it holds of the second shaft against the first, rows over (x, y, z, tilt x, tilt y).

        Parameters
        ----------
        role : str
            As of `add`.
        """
        return np.zeros((0, 5))

    @abstractmethod
    def add(self, at: Attached, role: str = "") -> None:
        """Add the coupling to a mechanism: I on the second shaft, J on the first.

        Parameters
        ----------
        at : Attached
        role : str
            Of joints, which of the motions of a shaft without bearings they hold.
        """


def is_rigid(part: Part) -> bool:
    """Return whether a part is a coupling that does not twist."""
    return isinstance(part, Coupling) and math.isinf(part.tangent)


@dataclass(frozen=True, kw_only=True)
class RigidCoupling(Coupling):
    """A fixed joint."""

    kind: ClassVar[str] = "rigid"

    def holds(self, role: str) -> np.ndarray:
        return np.eye(5)

    def add(self, at: Attached, role: str = "") -> None:
        at.mechanism.fixed(self.name, at.i, at.j)


@dataclass(frozen=True, kw_only=True)
class ElasticClutch(Coupling):
    """An elastic clutch: T = k_1 d + k_3 d^3, a second stage, damping, and a dead band in which it is silent.

    The equations are those of `gearmbs.drivetrain.torque_element`.

    Parameters
    ----------
    stiffness, cubic : float or str
        k_1, N m/rad; k_3, N m/rad^3.
    damping : float or str
        N m s/rad; or give
    relative_damping, damping_frequency : float, float or str
        Relative damping psi, the part of the largest stored energy that a cycle loses, and the frequency it was
        measured at (Hz): c = psi k_1 / (2 pi omega).
    dead_band : float or str
        Whole free angle b, rad. Beyond it a side that has let go never pulls.
    depth : float or str
        Angle behind the dead band at which the damping is fully on, rad.
    second_stiffness, second_stage, transition : float or str
        Stiffness of a second stage, twist at which it begins, and over which it comes in.
    free_angle : float or str
        Twist without load, rad; default: as the shafts are at the start.
    """

    kind: ClassVar[str] = "clutch"

    stiffness: Stiffness
    cubic: Annotated[Quantity, Measure("N*m/rad^3", 0)] = 0.0
    damping: Annotated[Quantity, Measure("N*m*s/rad", 0)] = None
    relative_damping: Annotated[Quantity, Measure(low=0, high=6.3, remedy="it is between 0 and 2 pi")] = None
    damping_frequency: Annotated[Quantity, Measure("frequency", above=0)] = None
    dead_band: Angle = 0.0
    depth: PositiveAngle = 1e-4
    second_stiffness: Stiffness = None
    second_stage: Angle = 0.0
    transition: PositiveAngle = 1e-3
    free_angle: Annotated[Quantity, Measure("angle")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.relative_damping is None:
            return
        require(self.damping is None, f"{self.label}: give damping or relative_damping, not both")
        require(
            self.damping_frequency is not None,
            f"{self.label}: relative_damping needs damping_frequency, at which it was measured (Hz)",
        )

    @property
    def tangent(self) -> float:
        return self.stiffness

    @property
    def tangent_damping(self) -> float:
        if self.relative_damping is not None:
            return self.relative_damping * self.stiffness / (4.0 * math.pi**2 * self.damping_frequency)
        return self.damping or 0.0

    def add(self, at: Attached, role: str = "") -> None:
        more = 0.0 if self.second_stiffness is None else self.second_stiffness - self.stiffness
        parameters = (
            self.free_angle, self.stiffness, self.cubic, self.tangent_damping, 0.5 * self.dead_band, self.depth, more,
            self.second_stage, self.transition,
        )  # fmt: skip
        at.mechanism.add(
            ShaftTorque(
                self.name, at.i, at.j, "clutch", parameters, counts_angle=True, own_diagnostics=(*ACCOUNTS, TWIST),
                what="clutch",
            )
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class TorsionalShaft(Coupling):
    """A massless shaft that twists: k = G I_p / l of a solid or hollow circle, or a stiffness given.

    Parameters
    ----------
    stiffness : float or str, optional
        N m/rad; or give
    length, diameter, bore : float or str
        m.
    shear_modulus : float or str
        Pa.
    damping_time : float or str
        Damping over stiffness, s: the damping ratio of a mode of f Hz that the shaft alone holds is pi f times it.
    damping_ratio : float or str, optional
        Former name of ``damping_time``, which is no ratio.
    """

    kind: ClassVar[str] = "shaft"

    stiffness: Stiffness = None
    length: Length = None
    diameter: Length = None
    bore: Annotated[Quantity, Measure("length", 0)] = 0.0
    shear_modulus: Annotated[Quantity, Measure("pressure", above=0)] = 8.02e10
    damping_time: Damping = 0.0
    damping_ratio: Damping = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.damping_ratio is not None:
            require(
                not self.damping_time,
                f"{self.label}: damping_ratio is the former name of damping_time; give damping_time alone",
            )
            warn(
                f"{self.label}: damping_ratio is deprecated, for it is damping over stiffness in seconds "
                f"({self.damping_ratio:g} s) and no ratio: write damping_time; of a mode of f Hz the ratio is pi f "
                "times that",
                FutureWarning,
            )
            object.__setattr__(self, "damping_time", self.damping_ratio)
            object.__setattr__(self, "damping_ratio", None)
        sized = self.length is not None and self.diameter is not None
        require((self.stiffness is None) == sized, f"{self.label}: give stiffness, or length and diameter")

    @property
    def tangent(self) -> float:
        if self.stiffness is not None:
            return self.stiffness
        return self.shear_modulus * math.pi * (self.diameter**4 - self.bore**4) / (32.0 * self.length)

    @property
    def tangent_damping(self) -> float:
        return self.damping_time * self.tangent

    def add(self, at: Attached, role: str = "") -> None:
        parameters = (0.0, self.tangent, 0.0, self.tangent_damping, 0.0, 1.0, 0.0, 0.0, 1.0)
        at.mechanism.add(
            ShaftTorque(
                self.name, at.i, at.j, "clutch", parameters, counts_angle=True, own_diagnostics=(*ACCOUNTS, TWIST),
                what="torsional shaft",
            )
        )  # fmt: skip
