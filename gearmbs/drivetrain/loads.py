"""What a drivetrain works against: torques, displacement pumps, brakes, fans, drag, tables."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from gearmbs.dae.equations.expressions.splines import SplineData, cubic_slopes
from gearmbs.dae.equations.loads.forces import DISSIPATED, Diagnostic
from gearmbs.drivetrain.part import Attached, Part, errors_named, fixed_value, over_time, require
from gearmbs.drivetrain.torque_element import LOST, OWN, ShaftTorque, mean_of_curve, on_curve, slopes
from gearmbs.mechanism.parts.elements import State
from gearmbs.mechanism.parts.functions import TimeFunction, as_function, constant, step
from gearmbs.mechanism.parts.inputs import Input
from gearmbs.schema.quantities import Measure, OneOf, OverTime
from gearmbs.units import Quantity
from gearmbs.wording import warn

Resistance = Annotated[Quantity, Measure("torque", 0)]
Viscous = Annotated[Quantity, Measure("N*m*s/rad", 0)]
Smoothing = Annotated[Quantity, Measure("angular speed", above=0)]


@dataclass(frozen=True, kw_only=True)
class Load(Part, ABC):
    """What all loads share.

    Parameters
    ----------
    shaft : str
    station : float or str, optional
        Along the shaft, m; default: its right end.
    on : str, optional
        Housing or shaft that takes the reaction; default the ground.
    """

    title: ClassVar[str] = "load"
    kind: ClassVar[str] = "load"

    shaft: str
    station: Annotated[Quantity, Measure("length")] = None
    on: str | None = None

    @abstractmethod
    def nominal(self, speed: float) -> float:
        """Return the torque that resists at the operating speed (rad/s, not negative), N m."""

    @abstractmethod
    def add(self, at: Attached) -> None:
        """Add the load to a mechanism."""


@dataclass(frozen=True, kw_only=True)
class TorqueLoad(Load):
    """A torque against the sense of rotation.

    Parameters
    ----------
    torque : float, str or TimeFunction
        N m; a number is switched on over the run-up, an expression of TIME is taken as it is.
    """

    kind: ClassVar[str] = "torque"
    torque: Annotated[Any, OverTime("torque")]

    def nominal(self, speed: float) -> float:
        return fixed_value(self.torque, "torque") or 0.0

    def add(self, at: Attached) -> None:
        torque = over_time(self.torque, "torque", self.label, at)
        parameters = (at.sense, 0.0, 2.0, 0.0, 1.0, -1.0, -1.0, 0.0, 0.0)
        at.mechanism.add(ShaftTorque(self.name, at.i, at.j, "table", parameters, times=(torque,), what="load"))


def gear_pump_ripple(teeth: int, pressure_angle: Quantity = "20 deg", addendum: float = 1.0) -> tuple[float, float]:
    """Return the non-uniformity of an external gear pump of two equal wheels, and the parabola's part of the mean.

    With u along the line of action from the pitch point, one pair delivering at a time (relief at half a base pitch),
    the delivery is proportional to r_a^2 - r_p^2 - u^2 for |u| <= p_b/2.

    Returns
    -------
    nonuniformity : float
        (max - min)/mean = h^2/(Q - h^2/3), h = p_b/2, Q = r_a^2 - r_p^2.
    factor : float
        The harmonics of the mean are a_k = factor (-1)^(k+1)/k^2.

    References
    ----------
    N. D. Manring, S. B. Kasaragadda, The theoretical flow ripple of an external gear pump, ASME J. Dyn. Syst. Meas.
    Control 125 (2003) 396-404.

    Examples
    --------
    >>> nonuniformity, factor = gear_pump_ripple(10)
    >>> round(nonuniformity, 4)
    0.2121
    """
    from gearmbs.units import to_si

    alpha = to_si(pressure_angle, "angle", "pressure_angle")
    # in modules
    room = (0.5 * teeth + addendum) ** 2 - (0.5 * teeth) ** 2
    half = 0.5 * math.pi * math.cos(alpha)
    mean = room - half**2 / 3.0
    require(mean > 0.0, f"pump: {teeth} teeth with addendum {addendum:g} deliver nothing; give a larger addendum")
    return half**2 / mean, 4.0 * half**2 / (math.pi**2 * mean)


@dataclass(frozen=True, kw_only=True)
class Pump(Load):
    """A displacement pump: T = (V_g dp / 2 pi) / eta [1 + ripple] + T_0 + c w.

    Parameters
    ----------
    displacement : float or str
        V_g a revolution, m^3 or text such as "157.1 cm^3".
    pressure : float, str or TimeFunction
        Pressure difference dp, Pa or "5 MPa"; a number is switched on over the run-up.
    efficiency : float
        Hydraulic-mechanical.
    idle, viscous : float or str
        T_0 (N m) and c (N m s/rad).
    teeth : int
        Displacement cycles a turn, Z; 0: no ripple.
    ripple : sequence of float, optional
        a_1, a_2, ... of the mean; default: `harmonics` of the ideal external gear pump of ``teeth``.
    harmonics : int
    lag : float or str
        Time constant with which the pressure follows, s; the state ``name.pressure`` is in MPa.
    start : float or str
        Angle at which the ripple's cosines begin, rad.
    """

    kind: ClassVar[str] = "pump"

    displacement: Annotated[Quantity, Measure("m^3", above=0)]
    pressure: Annotated[Any, OverTime("pressure")]
    efficiency: Annotated[Quantity, Measure(above=0, high=1)] = 1.0
    idle: Resistance = 0.0
    viscous: Viscous = 0.0
    teeth: Annotated[int, Measure(low=0, whole=True)] = 0
    ripple: Annotated[Sequence[float] | None, Measure(several=0)] = None
    harmonics: Annotated[int, Measure(low=0, whole=True)] = 4
    lag: Annotated[Quantity, Measure("time", 0)] = 0.0
    start: Annotated[Quantity, Measure("angle")] = 0.0
    smoothing: Annotated[Quantity, Measure()] = 1.0

    @property
    def per_pressure(self) -> float:
        """Displacement a radian, V_g / 2 pi, m^3."""
        return self.displacement / (2.0 * math.pi)

    @property
    def factors(self) -> tuple[float, ...]:
        """Harmonics a_k of the ripple, of the mean."""
        if self.ripple is not None:
            return tuple(self.ripple)
        if not self.teeth:
            return ()
        _, factor = gear_pump_ripple(self.teeth)
        return tuple(factor * (-1) ** (k + 1) / k**2 for k in range(1, self.harmonics + 1))

    def torque(self, pressure: float, speed: float) -> float:
        """Return the mean torque at a pressure difference (Pa) and speed (rad/s), N m."""
        return self.per_pressure * pressure / self.efficiency + self.idle + self.viscous * speed

    def nominal(self, speed: float) -> float:
        return self.torque(fixed_value(self.pressure, "pressure") or 0.0, speed)

    def add(self, at: Attached) -> None:
        pressure = over_time(self.pressure, "pressure", self.label, at)
        states = (State(f"{self.name}.pressure"),) if self.lag > 0.0 else ()
        parameters = (
            at.sense, self.per_pressure, self.idle, self.viscous, self.smoothing, float(self.teeth), self.start,
            self.lag, self.efficiency, *self.factors,
        )  # fmt: skip
        at.mechanism.add(
            ShaftTorque(
                self.name, at.i, at.j, "pump", parameters, times=(pressure,), counts_angle=bool(self.factors),
                own_states=states, own_diagnostics=(Diagnostic("flow", "m^3/s"),), first_diagnostic=OWN, what="pump",
            )
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Brake(Load):
    """A dry brake: T = T_b f(t) tanh(w/w_0).

    Parameters
    ----------
    torque : float or str
        T_b, N m.
    share : float, str or TimeFunction
        f(t); a number is switched on over the run-up.
    smoothing : float or str
        w_0, rad/s.
    """

    kind: ClassVar[str] = "brake"

    torque: Resistance
    share: Annotated[Any, OverTime("dimensionless")] = 1.0
    smoothing: Smoothing = 0.1

    def nominal(self, speed: float) -> float:
        share = fixed_value(self.share, "dimensionless")
        return self.torque * (1.0 if share is None else share) * math.tanh(speed / self.smoothing)

    def add(self, at: Attached) -> None:
        share = over_time(self.share, "dimensionless", self.label, at)
        _resist(self.name, at, share, self.torque, 0.0, 0.0, self.smoothing)


@dataclass(frozen=True, kw_only=True)
class Fan(Load):
    """A fan or a ship's propeller: T = T_n (w/w_n)^2.

    Parameters
    ----------
    torque, at_speed : float or str
        T_n (N m) and w_n (rad/s).
    """

    kind: ClassVar[str] = "fan"

    torque: Annotated[Quantity, Measure("torque", above=0)]
    at_speed: Smoothing

    def nominal(self, speed: float) -> float:
        return self.torque * (speed / self.at_speed) ** 2

    def add(self, at: Attached) -> None:
        _resist(self.name, at, constant(1.0), 0.0, 0.0, self.torque / self.at_speed**2, 1.0)


@dataclass(frozen=True, kw_only=True)
class Drag(Load):
    """Drag of bearings, seals and oil: T = T_0 tanh(w/w_0) + c w, against the shaft or housing it is ``on``.

    Parameters
    ----------
    torque, viscous : float or str
        T_0 (N m), c (N m s/rad).
    smoothing : float or str
        w_0, rad/s.
    """

    kind: ClassVar[str] = "drag"

    torque: Resistance = 0.0
    viscous: Viscous = 0.0
    smoothing: Smoothing = 0.1

    def nominal(self, speed: float) -> float:
        return self.torque * math.tanh(speed / self.smoothing) + self.viscous * speed

    def add(self, at: Attached) -> None:
        _resist(self.name, at, constant(1.0), self.torque, self.viscous, 0.0, self.smoothing)


def _resist(
    name: str, at: Attached, share: TimeFunction, dry: float, viscous: float, square: float, smoothing: float
) -> None:
    own_diagnostics = (Diagnostic("damping_power", "W", DISSIPATED),)
    parameters = (dry, viscous, square, smoothing)
    at.mechanism.add(
        ShaftTorque(
            name, at.i, at.j, "resistance", parameters, times=(share,), own_diagnostics=own_diagnostics,
            first_diagnostic=LOST, what="load",
        )
    )  # fmt: skip


TURN = 2.0 * math.pi
RPM = 30.0 / math.pi
"""Revolutions per minute in a rad/s."""
PLACES = {"speed": "angular speed", "angle": "angle", "time": "time"}
"""Abscissas that a table of torques may have, with their dimensions."""

FAR = 0.4
"""Part of the range of a table's torques by which a curve may leave it: that through three points of a cosine, one at
its top, leaves theirs by a third, rightly."""


@dataclass(frozen=True, kw_only=True)
class TableLoad(Load):
    """A load by points over speed, angle or time.

    Parameters
    ----------
    over : {"speed", "angle", "time"}
        Speed: a monotone cubic, beyond its ends its tangents; angle: the periodic spline over one turn; time: ADAMS's
        CUBSPL. At the operating point the torque is that of the curve at the speed, or its mean over the table. Over
        speed and angle it comes on over the run-up, as numbers do; over time it is taken as it is, as expressions are.
    places : sequence of float or str
        rad/s, rad or s; increasing.
    torques : sequence of float or str
        Torques that resist, N m.
    """

    kind: ClassVar[str] = "table"

    over: Annotated[str, OneOf(PLACES)]
    places: Any
    torques: Annotated[Sequence[Quantity], Measure("torque", several=-2)]

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "places", self.read("places", self.places, Measure(PLACES[self.over], several=-2)))
        least = 4 if self.over == "time" else 2
        require(
            len(self.places) == len(self.torques) >= least,
            f"{self.label}: {len(self.places)} places and {len(self.torques)} torques; give as many of both, "
            f"{least} or more",
        )

    def nominal(self, speed: float) -> float:
        return on_curve(self._curve(), speed) if self.over == "speed" else mean_of_curve(self._curve())

    def doubts(self, speed: float) -> list[str]:
        """Return what is to be said of the curve through the points, at an operating speed (rad/s, not negative)."""
        x, y, _ = points = self._curve()
        found = []
        if self.over == "speed" and not x[0] <= speed <= x[-1]:
            end = x[-1] if speed > x[-1] else x[0]
            found.append(
                f"{self.label}: its table ends at {end * RPM:.5g} rpm, and its shaft turns at {speed * RPM:.5g} rpm, "
                f"where the tangent has come to {on_curve(points, speed):.5g} N m; give points up to that speed"
            )
        low, high = float(y.min()), float(y.max())
        along = np.array([on_curve(points, v) for v in np.interp(np.arange(0.0, x.size - 1.0, 0.05), range(x.size), x)])
        furthest = along[np.argmax(np.maximum(low - along, along - high))]
        if max(low - furthest, furthest - high) > FAR * (high - low):
            found.append(
                f"{self.label}: the curve through its torques from {low:.5g} to {high:.5g} N m reaches {furthest:.5g} "
                f"N m between them, and has a mean of {mean_of_curve(points):.5g} N m; give more points beside those "
                f"where the torque changes quickly over the {self.over}"
            )
        return found

    def _curve(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places, torques and slopes of the curve that a run has."""
        if self.over == "time":
            with errors_named(self.label):
                SplineData(tuple(self.places), tuple(self.torques))
            x, y = np.array(self.places, dtype=float), np.array(self.torques, dtype=float)
            return x, y, cubic_slopes(x, y)
        return slopes(self.label, self.places, self.torques, TURN if self.over == "angle" else 0.0)

    def add(self, at: Attached) -> None:
        if self.over == "time":
            at.mechanism.spline(f"{self.name}.table", self.places, self.torques)
            torque = as_function(f"CUBSPL(TIME, 0, '{self.name}.table', 0)", "torque", self.label)
            parameters: Any = (at.sense, 0.0, 2.0, 0.0, 1.0, -1.0, -1.0, 0.0, 0.0)
            times = (torque,)
        else:
            x, y, m = self._curve()
            parameters = np.concatenate([[at.sense, TURN if self.over == "angle" else 0.0, x.size], x, -y, -m])
            times = (step(0.0, 0.0, at.run_up, 1.0),)
        at.mechanism.add(
            ShaftTorque(
                self.name, at.i, at.j, "table", parameters, times=times, counts_angle=self.over == "angle",
                what="load",
            )
        )  # fmt: skip


LOADS: dict[str, type[Load]] = {kind.kind: kind for kind in (TorqueLoad, Pump, Brake, Fan, Drag, TableLoad)}
"""Loads by their ``kind``."""


def warn_of_drift(drives: Sequence[Any], loads: Sequence[Any], run_up: float) -> None:
    """Warn of torques of a running drivetrain that balance each other and do not begin together.

    A number comes on over the run-up, an input acts from the start. Nothing is said where a drive holds the speed.

    Warns
    -----
    UserWarning
        With a torque of either kind and the remedy.
    """
    if any(drive.kind != "torque" for drive in drives):
        return
    parts = [part for part in (*drives, *loads) if part.kind == "torque"]
    inputs = [part for part in parts if isinstance(part.torque, Input) and part.torque.start != 0.0]
    numbers = [part for part in parts if fixed_value(part.torque, "torque")]
    if not (inputs and numbers):
        return
    early, late = inputs[0], numbers[0]
    size = fixed_value(late.torque, "torque")
    warn(
        f"{late.label}: its torque of {size:.5g} N m comes on over run_up = {run_up:g} s, that of {early.label}, "
        f"the input {early.torque.name!r} of {early.torque.start:.5g} N m, acts from the start: the running train "
        f"drifts from its speed; let both be inputs, torque=make_input({late.name!r}, 'N m', {size:g}), or both numbers"
    )
