"""How a rig is driven and loaded over time: at a constant speed and torque, or along curves."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from gearmbs.mechanism import TimeFunction, polyline, polyline_integral, ramp, step
from gearmbs.units import to_si


def drive_angle(speed: Any, run_up: float, start: float, sense: int = 1) -> TimeFunction:
    """Return the driver's angle over time, rad; see `gearmbs.studies.run.rig.gear_rig`."""
    if not _is_curve(speed):
        return _constant(
            sense * to_si(speed.item() if isinstance(speed, np.ndarray) else speed, "angular speed", "speed"), run_up
        )
    return polyline_integral(*_after_run_up(speed, "angular speed", "speed", run_up, start, sense), soft_start=True)


@lru_cache(maxsize=64)
def _constant(speed: float, run_up: float) -> TimeFunction:
    """Return the angle of a constant speed, which one run asks for several times."""
    return ramp(speed, over=run_up)


def load_torque(torque: Any, run_up: float, start: float, sense: int = 1) -> TimeFunction:
    """Return the load torque over time, N m; see `gearmbs.studies.run.rig.gear_rig`."""
    if not _is_curve(torque):
        return step(0.0, 0.0, run_up, sense * to_si(torque, "torque", "torque"))
    return polyline(*_after_run_up(torque, "torque", "torque", run_up, start, sense), soft_start=True)


def _is_curve(value: Any) -> bool:
    return isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, str) and np.ndim(value) > 0


def _after_run_up(
    points: Any, dimension: str, field: str, run_up: float, start: float, sense: int
) -> tuple[list[float], list[float]]:
    """Return times and values of a curve that begins at ``start``, with the way from rest to its first value."""
    try:
        pairs = [(to_si(t, "time", field), sense * to_si(value, dimension, field)) for t, value in points]
    except (TypeError, ValueError) as error:
        raise ValueError(f"{field}: give a value or points [(time, value), ...]; {error}") from None
    times, values = [0.0, run_up], [0.0, pairs[0][1]]
    for t, value in pairs:
        if start + t > times[-1]:
            times.append(start + t)
            values.append(value)
    return times, values
