"""Virtual encoders: from a simulated shaft to the pulses that a disc with errors and a counter would give."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy.interpolate
import xarray as xr
from numpy.typing import ArrayLike

from gearmbs.signals.encoders.pulses import TURN, PulseTrain, pulse_train
from gearmbs.signals.errors import SignalError
from gearmbs.units import Quantity, to_si

INVERSIONS = 4
"""Newton steps to the time of an angle, from a straight line: the speed varies by a percent, and errors square."""


def mark_errors(lines: int, error: float, seed: int) -> np.ndarray:
    """Return errors of the marks of a disc, rad: independent, of an RMS that is a share of the pitch."""
    return float(error) * TURN / lines * np.random.default_rng(seed).standard_normal(lines)


def encoder(
    angle: xr.DataArray,
    lines: int,
    *,
    marks: ArrayLike | None = None,
    mounted: Quantity = 0.0,
    clock: Quantity = 0.0,
    jitter: Quantity = 0.0,
    lacking: Sequence[int] = (),
    index: bool = False,
    lost: Sequence[int] = (),
    doubled: Sequence[int] = (),
    seed: int = 0,
    name: str = "encoder",
    tooth_at_zero: Sequence[float] | None = None,
) -> PulseTrain:
    """Pulses of an encoder, tacho or reflectors on a shaft, as a counter notes them.

    Parameters
    ----------
    angle : xarray.DataArray
        Of the shaft, rad, dimension (time,), turning one way (`shaft_angles`, or an angle of a solution). Between its
        samples it is a quintic spline.
    lines : int
        Marks of a turn.
    marks : array_like of shape (lines,), optional
        Errors of the marks, rad (`mark_errors`).
    mounted : float or str
        Angle of the shaft as mark 0 passes, rad.
    clock : float or str
        Step of the counter's clock, s: times are cut to whole steps.
    jitter : float or str
        RMS of the random error of each time, s.
    lacking : sequence of int
        Marks that the disc does not have.
    index : bool
        Whether there is a pulse once a turn, half a pitch before mark 0.
    lost, doubled : sequence of int
        Pulses, by their place in the record, that are not noted, and noted once more a fifth of a pitch later.
    seed : int
        Of the jitter.
    name, tooth_at_zero
        As for `pulse_train`.

    Returns
    -------
    PulseTrain
        As `pulse_train` makes it of the times.

    Raises
    ------
    SignalError
        If the angle turns back or covers too little.
    """
    tick, spread = to_si(clock, "time", "clock"), to_si(jitter, "time", "jitter")
    start = to_si(mounted, "angle", "mounted")
    errors = np.zeros(lines) if marks is None else np.asarray(marks, dtype=float)
    if errors.shape != (lines,):
        raise SignalError(f"marks: {errors.size} errors for {lines} lines; give one for each")
    if tooth_at_zero is None and "teeth_in_mesh" in angle.attrs:
        count, number, step = angle.attrs["teeth_in_mesh"]
        tooth_at_zero = ((number + step * count * start / TURN) % count, step)
    values, at = np.asarray(angle.values, dtype=float), np.asarray(angle["time"].values, dtype=float)
    values = values if values[-1] > values[0] else -values
    if np.any(np.diff(values) <= 0.0):
        raise SignalError("angle: the shaft turns back or rests; cut the record to where it turns one way")
    course = scipy.interpolate.make_interp_spline(at, values, k=5)
    first, last = (math.floor((v - start) / TURN * lines) for v in (values[0], values[-1]))
    numbers = np.arange(first + 2, last - 1)
    numbers = numbers[~np.isin(numbers % lines, lacking)]
    times = _times_of(course, start + TURN / lines * numbers + errors[numbers % lines], at, values)
    pitch = float(np.median(np.diff(times)))
    extra = times[list(doubled)] + 0.2 * pitch
    kept = np.delete(np.arange(times.size), list(lost))
    noted = np.concatenate((times[kept], extra)) + spread * np.random.default_rng(seed).standard_normal(
        kept.size + extra.size
    )
    once = None
    if index:
        turns = np.arange(
            math.ceil((values[0] - start) / TURN + 0.1), math.floor((values[-1] - start) / TURN - 0.1) + 1
        )
        once = _noted(_times_of(course, start + TURN * turns - 0.5 * TURN / lines, at, values), tick)
    return pulse_train(_noted(np.sort(noted), tick), lines, index=once, name=name, tooth_at_zero=tooth_at_zero)


def _times_of(course: scipy.interpolate.BSpline, wanted: np.ndarray, at: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return when a rising angle has the wanted values, s."""
    times = np.interp(wanted, values, at)
    rate = course.derivative()
    for _ in range(INVERSIONS):
        times -= (course(times) - wanted) / rate(times)
    return times


def _noted(times: np.ndarray, tick: float) -> np.ndarray:
    """Return times cut to whole steps of a clock."""
    return np.floor(times / tick) * tick if tick else times


def shaft_angles(record: xr.Dataset, *shafts: str) -> tuple[xr.DataArray, ...]:
    """Return angles of the shafts of a simulated record, for `encoder`.

    Parameters
    ----------
    record : xarray.Dataset
        Of a case (`gearmbs.run_case`): driver and driven shaft, which stand to each other as its transmission error
        says. Of a drivetrain or a planetary set: the shafts or members that are named, from their speeds.
    *shafts : str
        Names, of a drivetrain or a planetary set.

    Returns
    -------
    tuple of xarray.DataArray
        rad, dimension (time,), zero at the start of the record; of a case with the attribute ``teeth_in_mesh``: count
        of teeth, the one in mesh at angle 0, and the step of the numbers.

    Raises
    ------
    SignalError
        If the record has no such shafts.
    """
    dim = next((str(d) for d in record["speed"].dims if d != "time"), "") if "speed" in record.data_vars else ""
    at = np.asarray(record["time"].values, dtype=float)
    if dim:
        names = [str(n) for n in record[dim].values]
        stray = [n for n in shafts if n not in names]
        if stray or not shafts:
            raise SignalError(f"shafts: {stray or 'none'} given; the record has {', '.join(names)}")
        speeds = [np.abs(record["speed"].sel({dim: n}).values) for n in shafts]
        turned = [scipy.interpolate.make_interp_spline(at, v, k=5).antiderivative()(at) for v in speeds]
        return tuple(_angle(at, v - v[0], {}) for v in turned)
    if "transmission_error" not in record or "operation_speed" not in record.attrs:
        raise SignalError(
            "record: not that of a case, a drivetrain or a planetary set; give angles to `encoder` itself"
        )
    told = record.attrs
    teeth = [int(z) for z in told["gears_teeth"]]
    radius = 0.5 * float(told["gears_module"]) * teeth[0] * math.cos(float(told["gears_pressure_angle"]))
    known = [float(v) for v in np.ravel(record["acceleration"].attrs.get("teeth_in_mesh", ()))]
    since = known[0] if known else at[0]
    if "angle" in record.coords:
        signal_time = record["signal_time"].values
        driver = scipy.interpolate.make_interp_spline(signal_time, record["angle"].values, k=5)(at)
    else:
        driver = float(told["operation_speed"]) * (at - since)
    driven = (driver - record["transmission_error"].values / radius) * teeth[0] / teeth[1]
    numbers = [(z, *known[k : k + 2]) for z, k in zip(teeth, (1, 3))] if known else [None, None]
    return tuple(_angle(at, v, {} if n is None else {"teeth_in_mesh": n}) for v, n in zip((driver, driven), numbers))


def _angle(at: np.ndarray, values: np.ndarray, attrs: dict) -> xr.DataArray:
    return xr.DataArray(
        values, dims=("time",), coords={"time": ("time", at, {"units": "s"})}, name="angle",
        attrs={"units": "rad", **attrs},
    )  # fmt: skip
