"""What callers say about a signal, in numbers or texts: its rate and its speed."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.units import to_si

from .errors import SignalError
from .signal import check_teeth, with_metadata
from .speed_curve import is_curve, speed_curve

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
        warnings.warn(words, UserWarning, stacklevel=4)
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
    # what the signal says of its own angle would contradict
    signal = signal.drop_vars([name for name in ("speed", "angle") if name in signal.coords])
    if curve.constant is not None:
        return with_metadata(signal, speed=curve.constant)
    result = signal.assign_coords(speed=("time", curve.at(times), {"units": "rad/s"}))
    result.attrs = {k: v for k, v in signal.attrs.items() if k != "speed"}
    return result
