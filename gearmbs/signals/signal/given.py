"""What callers say about a signal, in numbers or texts: its rate and its speed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.labels import HERTZ, RPM_UNITS, THOUSANDS, name_and_unit
from gearmbs.signals.signal.signal import SHAFT, STEADY, check_teeth, with_metadata
from gearmbs.signals.signal.times import in_seconds
from gearmbs.signals.signal.units import scaled
from gearmbs.units import to_si
from gearmbs.wording import warn

# A known speed in any shape: number, text, points, curve, function; and its values over a record.


FORMS = (
    "give a number in rad/s, text such as '1500 rpm', points [(t, speed), ...], (times, speeds), "
    "a DataArray or Series over time, or a function of t"
)


@dataclass(frozen=True)
class SpeedCurve:
    """Speed of a shaft over time, linear between its points.

    Attributes
    ----------
    times : ndarray of shape (n,)
        Increasing, s. A single point is a constant speed.
    values : ndarray of shape (n,)
        rad/s, none below zero; zero is standstill.
    """

    times: np.ndarray
    values: np.ndarray

    @property
    def constant(self) -> float | None:
        """The speed in rad/s if it does not change, else None."""
        mean = float(np.mean(self.values))
        return mean if np.abs(self.values - mean).max() <= STEADY * mean else None

    def at(self, times: np.ndarray) -> np.ndarray:
        """Speed (rad/s) at times in s; the ends hold."""
        return np.interp(times, self.times, self.values)

    def angle(self, times: np.ndarray) -> np.ndarray:
        """Angle (rad) at times in s: the exact integral of the speed, zero at the first of them."""
        if self.times.size == 1:
            return self.values[0] * (times - times[0])
        steps = np.diff(self.times)
        turned = np.concatenate(([0.0], np.cumsum(0.5 * steps * (self.values[1:] + self.values[:-1]))))
        k = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, steps.size - 1)
        s = np.clip(times, self.times[0], self.times[-1]) - self.times[k]
        slope = (self.values[k + 1] - self.values[k]) / steps[k]
        angle = turned[k] + s * (self.values[k] + 0.5 * slope * s)
        angle += self.values[0] * np.minimum(times - self.times[0], 0.0)
        angle += self.values[-1] * np.maximum(times - self.times[-1], 0.0)
        return angle - angle[0]


def speed_curve(speed: Any, *, span: tuple[float, float] | None = None) -> SpeedCurve:
    """Read a speed in any shape.

    Parameters
    ----------
    speed : float, str, sequence, array_like, DataArray, Series, callable or SpeedCurve
        A number in rad/s; text with a unit ("1500 rpm", "25 Hz"); points ``[(t, speed), ...]`` whose entries are
        numbers in s and rad/s or texts with units; a pair of arrays ``(times, speeds)``; a DataArray of dimension time
        or a pandas Series over s, or over what the coordinate's ``attrs["units"]`` or the index's name says, as
        "t [ms]", in the unit that ``attrs["units"]`` names (rad/s if it names none); a function of t in s that returns
        rad/s, for which `span` is needed. A shaft that turns the other way all the time may be given with negative
        speeds.
    span : (float, float), optional
        First and last time of interest, s.

    Returns
    -------
    SpeedCurve

    Raises
    ------
    SignalError
        If the speed cannot be read, changes its direction, or is zero throughout.

    Examples
    --------
    >>> speed_curve("1500 rpm").constant == speed_curve(50 * math.pi).constant
    True
    >>> speed_curve([("0 s", "0 rpm"), ("10 s", "3000 rpm")]).at(np.array([5.0])).round(2).tolist()
    [157.08]
    """
    if isinstance(speed, SpeedCurve):
        return speed
    if isinstance(speed, (Real, str)) or (hasattr(speed, "magnitude") and hasattr(speed, "to")):
        value = _quantity(speed, "angular speed", "speed")
        if not (math.isfinite(value) and value > 0.0):
            raise SignalError(f"speed: must be positive, got {speed!r}")
        return SpeedCurve(np.zeros(1), np.array([value]))
    if callable(speed):
        times, values = _sampled(speed, span)
    elif isinstance(speed, xr.DataArray):
        times, values = _of_array(speed)
    elif hasattr(speed, "index") and hasattr(speed, "to_numpy"):
        times, values = _of_series(speed)
    else:
        times, values = _of_points(speed)
    return _checked(np.asarray(times, dtype=float), np.asarray(values, dtype=float))


def is_curve(speed: Any) -> bool:
    """True for a speed that is neither a number nor text."""
    return speed is not None and not isinstance(speed, (Real, str, Path))


def _quantity(value: Any, dimension: str, name: str) -> float:
    try:
        return to_si(value, dimension, name)
    except TypeError as error:
        raise SignalError(f"{name}: {value!r} is no speed; {FORMS}") from error
    except ValueError as error:
        raise SignalError(str(error)) from error


def _sampled(function: Callable[[float], float], span: tuple[float, float] | None) -> tuple[np.ndarray, np.ndarray]:
    if span is None:
        raise SignalError("speed: a function of t needs a record whose times it is evaluated at")
    times = np.linspace(span[0], span[1], 2001)
    try:
        return times, np.array([_quantity(function(float(t)), "angular speed", "speed(t)") for t in times])
    except (TypeError, ArithmeticError) as error:
        raise SignalError(f"speed: the function fails ({error}); it takes t in s and returns rad/s") from error


def _of_array(speed: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    speed = speed.squeeze(drop=True)
    if speed.dims != ("time",) or "time" not in speed.coords:
        raise SignalError(f"speed: a DataArray needs the one dimension time with its times in s, got {speed.dims}")
    unit = speed.attrs.get("units") or "rad/s"
    times = in_seconds(speed["time"].values, str(speed["time"].attrs.get("units", "")))
    return times, unit_factor(str(unit)) * np.asarray(speed.values, dtype=float)


def _of_series(speed: Any) -> tuple[np.ndarray, np.ndarray]:
    values = np.asarray(speed.to_numpy())
    if values.ndim != 1:
        if values.ndim == 2 and values.shape[1] == 2:
            return values[:, 0], values[:, 1]
        raise SignalError(f"speed: a table of shape {values.shape} is no speed over time; {FORMS}")
    name, unit = name_and_unit(str(getattr(speed.index, "name", "")))
    times = in_seconds(np.asarray(speed.index), unit, name)
    return times, unit_factor(str(speed.attrs.get("units") or "rad/s")) * values.astype(float)


def _of_points(speed: Any) -> tuple[np.ndarray, np.ndarray]:
    if not isinstance(speed, (Sequence, np.ndarray)) or len(speed) == 0:
        raise SignalError(f"speed: {type(speed).__name__} is no speed; {FORMS}")
    pair = len(speed) == 2 and all(np.ndim(part) == 1 and len(part) != 2 for part in speed)
    try:
        points = list(zip(*speed, strict=True)) if pair else list(speed)
        if any(len(point) != 2 for point in points):
            raise TypeError
    except (TypeError, ValueError):
        raise SignalError(f"speed: {str(speed)[:60]} is no list of points; {FORMS}") from None
    times = [_quantity(t, "time", "speed, a time") for t, _ in points]
    return np.array(times), np.array([_quantity(v, "angular speed", "speed") for _, v in points])


def unit_factor(unit: str) -> float:
    """Factor from a unit of rotation to rad/s: rpm, Hz, rad/s, deg/s, 1/min, 0.1 rpm ..."""
    clean = unit.strip()
    parts = None if clean.lower() in THOUSANDS else scaled(clean)
    if parts is not None:
        return parts[0] * unit_factor(parts[1])
    if clean.lower() in THOUSANDS:
        return 1000.0 * _quantity("1 rpm", "angular speed", "speed")
    text = "rpm" if clean.lower() in RPM_UNITS else "Hz" if clean.lower() in HERTZ else clean
    return _quantity(f"1 {text}", "angular speed", "speed")


def _checked(times: np.ndarray, values: np.ndarray) -> SpeedCurve:
    if times.ndim != 1 or times.shape != values.shape or not times.size:
        raise SignalError(f"speed: {times.size} times and {values.size} speeds; a curve needs one speed for each time")
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise SignalError("speed: the curve holds values that are not finite; cut or fill them first")
    if np.any(np.diff(times) <= 0.0):
        at = int(np.argmax(np.diff(times) <= 0.0)) + 1
        raise SignalError(
            f"speed: the curve's times must increase, they do not at point {at + 1} (t = {times[at]:g} s)"
        )
    if values.max() <= 0.0:
        values = -values
    if values.min() < 0.0:
        at = int(np.argmax(values < 0.0))
        raise SignalError(
            f"speed: the shaft turns back at t = {times[at]:g} s ({values[at]:g} rad/s); "
            "cut the record where it rests and take the parts one by one"
        )
    if not values.max() > 0.0:
        raise SignalError("speed: is zero throughout; a shaft at rest has no orders")
    return SpeedCurve(times, np.abs(values))


SPEED_AGREES = 0.02
"""Part by which a speed that is given may differ from that of the record: a nominal speed, beside the one at load."""


def contradictions(
    own_teeth: Any, own_speed: Any, teeth: int | Sequence[int] | None, speed: float | None, source: str
) -> list[str]:
    """Say, and warn, where tooth counts or a speed (rad/s) that are given contradict those of a record itself.

    Returns
    -------
    list of str
        One sentence for each; what is given is used all the same.
    """
    said = []
    if own_teeth is not None and teeth is not None:
        own, given = check_teeth(own_teeth), check_teeth(teeth)
        if any(a != b for a, b in zip(own, given)):
            listed = [", ".join(map(str, counts)) for counts in (given, own)]
            said.append(
                f"CHECK THE TEETH: teeth={listed[0]} is given, but {source} itself says {listed[1]}; the given ones "
                "are used."
            )
    if own_speed is not None and speed is not None and abs(abs(speed) - abs(own_speed)) > SPEED_AGREES * abs(own_speed):
        rpm = [value * 30.0 / math.pi for value in (speed, own_speed)]
        said.append(
            f"CHECK THE SPEED: speed={rpm[0]:.6g} rpm is given, but {source} itself says {rpm[1]:.6g} rpm; the given "
            "one is used."
        )
    for words in said:
        warn(words, UserWarning)
    return said


def given_rate(rate: float | str | None) -> float | None:
    """A sampling rate in Hz from a number or text ("12.8 kHz"); SignalError for what is neither."""
    if rate is None:
        return None
    try:
        value = float(rate)
    except (TypeError, ValueError):
        try:
            value = to_si(rate, "frequency", "rate")
        except (TypeError, ValueError) as error:
            raise SignalError(str(error)) from None
    if not (np.isfinite(value) and value > 0.0):
        raise SignalError(f"rate: must be a positive number of Hz, got {rate!r}")
    return value


def given_speed(speed: Any) -> float | None:
    """A constant speed in rad/s from a number or text; None for none, and for a curve, which `with_speed` takes."""
    return None if speed is None or is_curve(speed) else float(speed_curve(speed).values[0])


def with_speed(signal: xr.DataArray, speed: Any) -> xr.DataArray:
    """The signal with a known speed: a number or text as attribute, a curve as coordinate `speed` over time."""
    times = np.asarray(signal["time"].values, dtype=float)
    curve = speed_curve(speed, span=(float(times[0]), float(times[-1])))
    if curve.constant is not None:
        return with_metadata(signal, speed=curve.constant)
    # the signal's own angle would contradict
    result = signal.drop_vars([name for name in SHAFT if name in signal.coords])
    result = result.assign_coords(speed=("time", curve.at(times), {"units": "rad/s"}))
    result.attrs = {k: v for k, v in signal.attrs.items() if k != "speed"}
    return result
