"""What turns a drivetrain: prescribed speed, torque, induction motors, motors by curve, speed control."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np

from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.loads.forces import Diagnostic
from gearmbs.drivetrain.part import Attached, DrivetrainError, Part, fixed_value, over_time, require, share_of
from gearmbs.drivetrain.torque_element import OWN, ShaftTorque, on_curve, slopes
from gearmbs.mechanism.parts.elements import State
from gearmbs.mechanism.parts.functions import TimeFunction, as_function, constant, polyline_integral, ramp, step
from gearmbs.mechanism.parts.inputs import Input
from gearmbs.mechanism.parts.joints import Joint, Prescribed, Row, Term
from gearmbs.schema.quantities import Measure, OverTime
from gearmbs.units import Quantity

SLIP = (Diagnostic("slip", "1"),)

EVEN = "give an even number of 2 or more"
Power = Annotated[Quantity, Measure("power", above=0)]
Positive = Annotated[Quantity, Measure(above=0)]


@dataclass(frozen=True, kw_only=True)
class Drive(Part, ABC):
    """What all drives share.

    Parameters
    ----------
    shaft : str
    speed : float or str
        Operating speed, rad/s or text such as "1450 rpm"; negative about -z. The speeds of all other shafts follow.
    station : float or str, optional
        Along the shaft, m; default: its left end.
    on : str, optional
        Housing or shaft that takes the reaction; default the ground.
    """

    title: ClassVar[str] = "drive"
    kind: ClassVar[str] = "drive"

    shaft: str
    speed: Annotated[Quantity, Measure("angular speed")]
    station: Annotated[Quantity, Measure("length")] = None
    on: str | None = None

    @abstractmethod
    def add(self, at: Attached) -> None:
        """Add the drive to a mechanism."""

    def damping(self) -> float:
        """Return the drive's torsional damping at the operating point, -dT/dw, N m s/rad."""
        return 0.0

    def largest_torque(self) -> float | None:
        """Return the largest torque about the sense of rotation, N m; None where there is none, or it is not known."""
        return None

    def starting_torque(self) -> float | None:
        """Return the torque at standstill, N m; None where it is not known or the same as the largest."""
        return None


@dataclass(frozen=True, kw_only=True)
class SpeedDrive(Drive):
    """A prescribed rotation, which reaches ``speed`` after the run-up.

    Parameters
    ----------
    function : TimeFunction or str, optional
        The rotation itself, rad, in place of the run-up and the speed.
    curve : sequence of (time, speed), optional
        A run-up or coast-down: points from the end of the drivetrain's ``run_up`` on, joined by straight lines, see
        `gearmbs.mechanism.polyline`; none faster than ``speed``, all in its sense. Before the first point its speed is
        held, or reached from rest.
    reference : TimeFunction or str, optional
        The speed over the time of the simulation, rad/s with the sign of ``speed``, in place of the run-up: an input
        (`gearmbs.mechanism.make_input`) may jump while a simulation goes on, or have a controller.
    """

    kind: ClassVar[str] = "speed"
    function: Any = None
    curve: Any = None
    reference: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.reference is not None:
            require(self.function is None and self.curve is None,
                    f"{self.label}: give one of reference, function and curve")  # fmt: skip
        if self.curve is None:
            return
        require(self.function is None, f"{self.label}: give function or curve, not both")
        try:
            points = tuple((t, w) for t, w in self.curve)
        except (TypeError, ValueError):
            raise DrivetrainError(f"{self.label}: curve is {self.curve!r}; give points (time, speed)") from None
        times = self.read("curve", [t for t, _ in points], Measure("time", several=-1))
        speeds = self.read("curve", [w for _, w in points], Measure("angular speed", several=-1))
        require(
            len(points) > 1 and times[0] >= 0.0 and all(b > a for a, b in pairwise(times)),
            f"{self.label}: curve has times {times} s; give two or more, increasing, the first not negative",
        )
        for w in speeds:
            require(w * self.speed >= 0.0 and abs(w) <= abs(self.speed) * (1.0 + 1e-9),
                    f"{self.label}: curve goes to {w:.6g} rad/s, but speed is {self.speed:.6g} rad/s; give the "
                    "fastest speed as speed")  # fmt: skip
        object.__setattr__(self, "curve", tuple(zip(times, speeds, strict=True)))

    @property
    def start_share(self) -> float:
        """Speed at the start of a train that runs already, over the operating speed."""
        return 1.0 if self.curve is None else self.curve[0][1] / self.speed

    def turned(self, speed: float, run_up: float, running: bool) -> TimeFunction:
        """Return the prescribed rotation, rad from the start, over the time of the simulation.

        Parameters
        ----------
        speed : float
            Operating speed of the shaft about z, rad/s, with its sign.
        run_up : float
            Of the drivetrain, s.
        running : bool
            Whether its shafts turn at their operating speeds from the start.
        """
        if self.curve is not None:
            first = self.curve[0][1]
            later = [(run_up + t, w) for t, w in self.curve if t > 0.0]
            times = [0.0, run_up, *(t for t, _ in later)]
            speeds = [first if running else 0.0, first, *(w for _, w in later)]
            return polyline_integral(times, speeds, soft_start=True)
        if self.function is not None:
            return as_function(self.function, "rad", self.label)
        if self.reference is not None:
            return as_function(self.reference, "rad/s", self.label).integral(0.0)
        return ramp(speed, over=0.0 if running else run_up)

    def add(self, at: Attached) -> None:
        turned = self.turned(at.speed, at.run_up, at.running)
        row = Row("angle", (Term(terms.ROTATION, at.i, at.j),), None, turned)
        given = None
        if self.reference is not None:
            wanted = as_function(self.reference, "rad/s", self.label)
            if isinstance(wanted, Input):
                at.mechanism.inputs.setdefault(wanted.name, wanted)
            given = Prescribed("velocity", wanted, 0.0, 0.0)
        at.mechanism.joints[self.name] = Joint(self.name, "rotation", at.i, at.j, [row], given)


@dataclass(frozen=True, kw_only=True)
class TorqueDrive(Drive):
    """A torque over time about the sense of rotation; ``speed`` is where the shafts start, or are expected.

    Parameters
    ----------
    torque : float, str or TimeFunction
        N m; a number is switched on over the run-up.
    """

    kind: ClassVar[str] = "torque"
    torque: Annotated[Any, OverTime("torque")] = 0.0

    def largest_torque(self) -> float | None:
        return fixed_value(self.torque, "torque")

    def add(self, at: Attached) -> None:
        torque = over_time(self.torque, "torque", self.label, at)
        parameters = (at.sense, 0.0, 2.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0)
        at.mechanism.add(ShaftTorque(self.name, at.i, at.j, "table", parameters, times=(torque,), what="torque"))


@dataclass(frozen=True, kw_only=True)
class InductionMotor(Drive):
    """An induction motor by Kloss's formula, from its name plate.

    With the rated slip s_n = 1 - w_n/w_s and l = T_b/T_n the breakdown slip is s_b = s_n (l + sqrt(l^2 - 1)), and
    T = 2 T_b / (s/s_b + s_b/s).

    Parameters
    ----------
    power : float or str
        Rated, W.
    poles : int
    frequency : float or str
        Of the supply, Hz.
    breakdown : float
        Breakdown torque over rated torque, l > 1.
    lag : bool or float or str
        Electrical lag of the torque: False; True for 1/(s_b w_e), with w_e = 2 pi times the supply's frequency; or s.
    speed : float or str
        Rated.
    """

    kind: ClassVar[str] = "induction motor"

    power: Power
    poles: Annotated[int, Measure(low=2, whole=True, remedy=EVEN)] = 4
    frequency: Annotated[Quantity, Measure("frequency", above=0)] = 50.0
    breakdown: Annotated[Quantity, Measure(above=1, remedy="give more than 1 (rated torques)")] = 2.5
    lag: Any = False

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.poles % 2 == 0, f"{self.label}: poles is {self.poles}; {EVEN}")
        require(
            0.0 < self.rated_slip < 1.0,
            f"{self.label}: speed is {abs(self.speed) * 30 / math.pi:.6g} rpm; the synchronous speed is "
            f"{self.synchronous * 30 / math.pi:.6g} rpm, and a motor turns a little slower",
        )

    @property
    def synchronous(self) -> float:
        """Synchronous speed w_s, rad/s."""
        return 4.0 * math.pi * self.frequency / self.poles

    @property
    def rated_slip(self) -> float:
        """s_n."""
        return 1.0 - abs(self.speed) / self.synchronous

    @property
    def rated_torque(self) -> float:
        """T_n = P/w_n, N m."""
        return self.power / abs(self.speed)

    @property
    def breakdown_torque(self) -> float:
        """T_b, N m."""
        return self.breakdown * self.rated_torque

    @property
    def breakdown_slip(self) -> float:
        """s_b."""
        return self.rated_slip * (self.breakdown + math.sqrt(self.breakdown**2 - 1.0))

    @property
    def lag_time(self) -> float:
        """Time constant of the electrical lag, s; 0 without."""
        if self.lag is True:
            return 1.0 / (self.breakdown_slip * 2.0 * math.pi * self.frequency)
        return 0.0 if self.lag is False else self.read("lag", self.lag, Measure("time"))

    def torque(self, speed: float) -> float:
        """Return Kloss's torque at a speed (rad/s), N m."""
        s = 1.0 - speed / self.synchronous
        return 2.0 * self.breakdown_torque * s * self.breakdown_slip / (s**2 + self.breakdown_slip**2)

    def damping(self) -> float:
        s, sb = self.rated_slip, self.breakdown_slip
        return 2.0 * self.breakdown_torque * sb * (sb**2 - s**2) / (s**2 + sb**2) ** 2 / self.synchronous

    def largest_torque(self) -> float | None:
        return self.breakdown_torque

    def starting_torque(self) -> float | None:
        return self.torque(0.0)

    def _law(self) -> tuple[str, tuple[float, ...]]:
        return "kloss", (self.breakdown_torque, self.breakdown_slip)

    def add(self, at: Attached) -> None:
        law, numbers = self._law()
        lag = self.lag_time
        start = self.torque(abs(at.speed)) if at.running else 0.0
        states = (State(f"{self.name}.torque", start=start),) if lag > 0.0 else ()
        on = share_of(at)
        at.mechanism.add(
            ShaftTorque(
                self.name, at.i, at.j, law, (at.sense, self.synchronous, lag, *numbers), times=(on,),
                own_states=states, own_diagnostics=SLIP, first_diagnostic=OWN, what="motor",
            )
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class CircuitMotor(InductionMotor):
    """An induction motor by its equivalent circuit, T = n p U^2 R_2 s / (w_e [(R_1 s + R_2)^2 + X^2 s^2]).

    With a magnetising reactance, stator and supply are replaced by their Thevenin equivalent. ``power`` and
    ``breakdown`` have no meaning here.

    Parameters
    ----------
    voltage : float
        Of a phase, V (RMS).
    phases : int
    stator_resistance, rotor_resistance, stator_reactance, rotor_reactance : float
        R_1, R_2, X_1, X_2 at the supply's frequency, referred to the stator, ohm.
    magnetising_reactance : float, optional
        X_m, ohm; default: none.
    """

    kind: ClassVar[str] = "circuit motor"

    power: Power = 1.0
    voltage: Positive = 230.0
    phases: int = 3
    stator_resistance: float = 0.0
    rotor_resistance: Positive = 1.0
    stator_reactance: float = 0.0
    rotor_reactance: Positive = 1.0
    magnetising_reactance: float | None = None

    @property
    def equivalent(self) -> tuple[float, float, float, float]:
        """A (V^2 s/rad), R_1, R_2 and X of the circuit as the rotor sees it."""
        supply, source = complex(self.voltage), complex(self.stator_resistance, self.stator_reactance)
        if self.magnetising_reactance is not None:
            branch = 1j * self.magnetising_reactance
            supply, source = supply * branch / (source + branch), source * branch / (source + branch)
        gain = self.phases * 0.5 * self.poles * abs(supply) ** 2 / (2.0 * math.pi * self.frequency)
        return gain, source.real, self.rotor_resistance, source.imag + self.rotor_reactance

    @property
    def breakdown_slip(self) -> float:
        _, r1, r2, x = self.equivalent
        return r2 / math.hypot(r1, x)

    @property
    def breakdown_torque(self) -> float:
        return self.torque(self.synchronous * (1.0 - self.breakdown_slip))

    @property
    def rated_torque(self) -> float:
        return self.torque(abs(self.speed))

    def torque(self, speed: float) -> float:
        """Return the circuit's torque at a speed (rad/s), N m."""
        gain, r1, r2, x = self.equivalent
        s = 1.0 - speed / self.synchronous
        return gain * r2 * s / ((r1 * s + r2) ** 2 + (x * s) ** 2)

    def damping(self) -> float:
        gain, r1, r2, x = self.equivalent
        s = self.rated_slip
        size = (r1 * s + r2) ** 2 + (x * s) ** 2
        return gain * r2 * (r2**2 - (r1**2 + x**2) * s**2) / size**2 / self.synchronous

    def _law(self) -> tuple[str, tuple[float, ...]]:
        return "circuit", self.equivalent


@dataclass(frozen=True, kw_only=True)
class CurveMotor(Drive):
    """A motor by its torque over speed: a monotone cubic through points.

    Parameters
    ----------
    speeds, torques : sequence of float or str
        Increasing speeds (rad/s) about the sense of rotation, and torques (N m). Beyond its ends the curve goes on
        along its tangents.
    """

    kind: ClassVar[str] = "curve"

    speeds: Annotated[Sequence[Quantity], Measure("angular speed", several=-2)]
    torques: Annotated[Sequence[Quantity], Measure("torque", several=-2)]

    def largest_torque(self) -> float | None:
        return max(self.torques)

    def starting_torque(self) -> float | None:
        # beyond its first point the curve is a tangent
        points = slopes(self.label, self.speeds, self.torques)
        return on_curve(points, 0.0) if self.speeds[0] <= 0.0 else None

    def add(self, at: Attached) -> None:
        on = share_of(at)
        points = slopes(self.label, self.speeds, self.torques)
        parameters = np.concatenate([[at.sense, 0.0, len(points[0])], *points])
        at.mechanism.add(ShaftTorque(self.name, at.i, at.j, "table", parameters, times=(on,), what="motor"))


@dataclass(frozen=True, kw_only=True)
class ControlledDrive(Drive):
    """A drive whose controller holds a speed: proportional and integral, with a largest torque.

    Parameters
    ----------
    proportional, integral : float
        k_p, N m s/rad; k_i, N m/rad.
    largest : float or str
        N m.
    reference : TimeFunction or str, optional
        Speed asked for over time, rad/s about the sense of rotation; default: ``speed`` after the run-up.
    """

    kind: ClassVar[str] = "controlled"

    proportional: Annotated[Quantity, Measure("N*m*s/rad", above=0)]
    integral: Annotated[Quantity, Measure("N*m/rad", above=0)]
    largest: Annotated[Quantity, Measure("torque", above=0)]
    reference: Any = None

    def damping(self) -> float:
        return self.proportional

    def largest_torque(self) -> float | None:
        return self.largest

    def add(self, at: Attached) -> None:
        size = abs(at.speed)
        if self.reference is not None:
            wanted = as_function(self.reference, "angular speed", self.label)
        else:
            wanted = constant(size) if at.running else step(0.0, 0.0, at.run_up, size)
        at.mechanism.add(
            ShaftTorque(
                self.name, at.i, at.j, "controller",
                (at.sense, self.proportional, self.integral, self.largest), times=(wanted,),
                own_states=(State(f"{self.name}.integral"),), own_diagnostics=(Diagnostic("speed_error", "rad/s"),),
                first_diagnostic=OWN, what="motor",
            )
        )  # fmt: skip


DRIVES: dict[str, type[Drive]] = {
    kind.kind: kind for kind in (SpeedDrive, TorqueDrive, InductionMotor, CircuitMotor, CurveMotor, ControlledDrive)
}
"""Drives by their ``kind``."""
