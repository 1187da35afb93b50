"""From equal steps of time to equal steps of shaft angle: order tracking, order spectra, time-synchronous averages."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
import scipy.fft
import xarray as xr

from .errors import SignalError
from .interpolation import interpolate
from .signal import common_unit, rate_of, units_of
from .spectra import periodograms, spectral_unit

Progress = Callable[[float, str], None]
BLOCK_SAMPLES = 1 << 17
TURN = 2.0 * math.pi


def angular_resample(signal: xr.DataArray, phase: xr.DataArray, *, samples_per_rev: int | None = None) -> xr.DataArray:
    """Order tracking: resample to equal steps of the shaft's angle.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    phase : xarray.DataArray
        Shaft angle in rad, increasing, dimension (time,), covering all or part of the record
        (`phase_from_tacho`, `phase_from_line`, `phase_from_speed`).
    samples_per_rev : int, optional
        Default: the smallest power of two that samples nowhere coarser than the record does.

    Returns
    -------
    xarray.DataArray
        Dimensions (angle, channel), angle in revolutions, whole steps from the phase's first full step;
        attribute `samples_per_rev`.

    Raises
    ------
    SignalError
        If the phase does not increase, or does not overlap the record.
    """
    clock = _Clock(signal, phase, samples_per_rev)
    positions = clock.positions(clock.first, clock.last + 1)
    values = np.stack([interpolate(column, positions) for column in signal.values.T], axis=1)
    angle = np.arange(clock.first, clock.last + 1) / clock.per_rev
    return _angular(signal, values, angle, clock.per_rev, {"mean_speed": clock.mean_speed})


def time_synchronous_average(
    signal: xr.DataArray,
    phase: xr.DataArray,
    *,
    samples_per_rev: int | None = None,
    revolutions: int = 1,
    progress: Progress | None = None,
) -> xr.DataArray:
    """Average over shaft revolutions: what does not turn with the shaft fades as 1 / sqrt(averages).

    Parameters
    ----------
    signal, phase, samples_per_rev
        As for `angular_resample`.
    revolutions : int
        Length of the average in revolutions (more than one for a hunting tooth).
    progress : callable, optional
        Called as progress(fraction, "averaging").

    Returns
    -------
    xarray.DataArray
        Dimensions (angle, channel), angle in revolutions from 0; attributes `averages` and `samples_per_rev`.

    Raises
    ------
    SignalError
        If not even one average fits.
    """
    if revolutions < 1:
        raise SignalError(f"revolutions: must be at least 1, got {revolutions!r}")
    clock = _Clock(signal, phase, samples_per_rev)
    length = clock.per_rev * revolutions
    count = (clock.last + 1 - clock.first) // length
    if count < 1:
        raise SignalError(
            f"signal: the record holds {(clock.last + 1 - clock.first) / clock.per_rev:.2f} revolutions, "
            f"{revolutions} are needed for one average"
        )
    total = np.zeros((length, signal.sizes["channel"]))
    per_block = max(1, BLOCK_SAMPLES // length)
    for start in range(0, count, per_block):
        turns = min(per_block, count - start)
        begin = clock.first + start * length
        positions = clock.positions(begin, begin + turns * length)
        for channel, column in enumerate(signal.values.T):
            total[:, channel] += interpolate(column, positions).reshape(turns, length).sum(axis=0)
        if progress is not None:
            progress((start + turns) / count, "averaging")
    # Angles keep their origin: the first sample of the average is the same angle of the shaft in every record.
    shift = clock.first % length
    average = np.roll(total / count, shift, axis=0)
    extra = {"averages": count, "mean_speed": clock.mean_speed}
    return _angular(signal, average, np.arange(length) / clock.per_rev, clock.per_rev, extra)


def order_spectrum(
    angular: xr.DataArray,
    *,
    scaling: Literal["amplitude", "rms", "power", "density"] = "amplitude",
    window: str | tuple = "hann",
    segment: float | None = None,
    overlap: float = 0.5,
) -> xr.DataArray:
    """Spectrum over orders (multiples of the shaft's speed) of a signal in equal steps of angle.

    Parameters
    ----------
    angular : xarray.DataArray
        Dimensions (angle, channel), from `angular_resample` or `time_synchronous_average`.
    scaling, window, overlap
        As for `spectrum`; "density" is per order.
    segment : float, optional
        Revolutions per segment; default the whole record.

    Returns
    -------
    xarray.DataArray
        Dimensions (order, channel).
    """
    per_rev = angular.attrs["samples_per_rev"]
    length = angular.sizes["angle"] if segment is None else round(segment * per_rev)
    lines, details = periodograms(angular.values, float(per_rev), length, window, overlap, True, scaling)
    units = [spectral_unit(u, scaling, "order") for u in units_of(angular)]
    orders = scipy.fft.rfftfreq(details["length"], 1.0 / per_rev)
    return xr.DataArray(
        lines,
        dims=("order", "channel"),
        coords={
            "order": orders,
            "channel": angular["channel"].values,
            "units": ("channel", np.asarray(units, dtype=str)),
        },
        attrs={"units": units[0] if len(set(units)) == 1 else "mixed", "scaling": scaling, "window": str(window)},
    )


def samples_per_revolution(rate: float, slowest: float) -> int:
    """The smallest power of two of at least rate / slowest samples (`slowest` in Hz)."""
    return 1 << max(3, math.ceil(math.log2(rate / slowest)))


class _Clock:
    """Where in the record (fractional samples) each step of angle falls."""

    def __init__(self, signal: xr.DataArray, phase: xr.DataArray, per_rev: int | None) -> None:
        rate = rate_of(signal)
        start = float(signal["time"].values[0])
        at = (phase["time"].values - start) * rate
        last = signal.sizes["time"] - 1
        inside = slice(int(np.searchsorted(at, -1e-6)), int(np.searchsorted(at, last + 1e-6, side="right")))
        self.at = np.clip(at[inside], 0.0, last, out=at[inside])
        self.turns = np.asarray(phase.values[inside], dtype=float) / TURN
        if self.at.size < 2:
            raise SignalError("phase: does not overlap the record; both need the same time axis in s")
        steps = np.diff(self.turns)
        if not np.all(steps > 0.0):
            raise SignalError(
                "phase: must increase from sample to sample; give the angle of a shaft that keeps turning"
            )
        self.mean_speed = float((self.turns[-1] - self.turns[0]) / (self.at[-1] - self.at[0]) * rate * TURN)
        if per_rev is None:
            per_rev = samples_per_revolution(rate, float((steps / np.diff(self.at)).min()) * rate)
        if per_rev < 4:
            raise SignalError(f"samples_per_rev: must be at least 4, got {per_rev!r}")
        self.per_rev = int(per_rev)
        self.first = math.ceil(self.turns[0] * self.per_rev - 1e-9)
        self.last = math.floor(self.turns[-1] * self.per_rev + 1e-9)

    def positions(self, begin: int, end: int) -> np.ndarray:
        angles = np.arange(begin, end) / self.per_rev
        # Only the stretch that is needed: the whole record's tables would be copied each time.
        low = max(0, int(np.searchsorted(self.turns, angles[0])) - 1)
        high = int(np.searchsorted(self.turns, angles[-1])) + 1
        return np.interp(angles, self.turns[low:high], self.at[low:high])


def _angular(
    signal: xr.DataArray, values: np.ndarray, angle: np.ndarray, per_rev: int, extra: dict[str, float]
) -> xr.DataArray:
    kept = {k: v for k, v in signal.attrs.items() if k not in ("sampling_rate", "units")}
    return xr.DataArray(
        values,
        dims=("angle", "channel"),
        coords={
            "angle": ("angle", angle, {"units": "rev"}),
            "channel": signal["channel"].values,
            "units": ("channel", np.asarray(units_of(signal), dtype=str)),
        },
        attrs={**kept, "units": common_unit(signal), "samples_per_rev": per_rev, **extra},
    )
