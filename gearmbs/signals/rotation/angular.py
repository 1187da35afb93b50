"""From equal steps of time to equal steps of shaft angle: order tracking, order spectra, time-synchronous averages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Literal, Unpack

import numpy as np
import scipy.fft
import scipy.ndimage
import scipy.signal as ss
import xarray as xr

from gearmbs.progress import staged, waiting
from gearmbs.signals.errors import SignalError
from gearmbs.signals.filters import apply_zero_phase, decimation_taps, kaiser_taps
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import check_teeth, common_unit, rate_of, require, units_of
from gearmbs.signals.spectra import periodograms, spectral_unit

# Values of a sampled record between its samples: doubled in rate by a FIR filter, then quintic B-splines.
#
# The spline's relative error at frequency f is about (f / (2 rate - f))^6 on the doubled rate: 3e-5 at a quarter, 2e-4
# at
# 0.4 of the sampling rate. Work proceeds in blocks, so scratch memory does not grow with the record.


BLOCK = 1 << 16
MARGIN = 96
DEGREE = 5
DOUBLING = kaiser_taps(0.5, 0.1, 2.0, "lowpass", 100.0)


def interpolate(column: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Values at increasing fractional sample `positions`, 0 <= position <= n - 1.

    Parameters
    ----------
    column : ndarray of shape (n,)
    positions : ndarray of shape (m,), increasing

    Returns
    -------
    ndarray of shape (m,)
    """
    n = column.size
    out = np.empty(positions.size)
    start = 0
    while start < positions.size:
        first = int(positions[start])
        stop = int(np.searchsorted(positions, first + BLOCK, side="left"))
        stop = max(stop, start + 1)
        last = int(np.ceil(positions[stop - 1]))
        low, high = first - MARGIN, last + MARGIN + 1
        piece = column[max(low, 0) : min(high, n)]
        before, after = min(max(-low, 0), piece.size - 1), min(max(high - n, 0), piece.size - 1)
        piece = np.concatenate((2 * piece[0] - piece[before:0:-1], piece, 2 * piece[-1] - piece[-2 : -after - 2 : -1]))
        fine = ss.resample_poly(piece, 2, 1, window=DOUBLING, padtype="line")
        origin = max(low, 0) - before
        at = 2.0 * (positions[start:stop] - origin)
        out[start:stop] = scipy.ndimage.map_coordinates(fine, at[None, :], order=DEGREE, mode="mirror")
        start = stop
    return out


Progress = Callable[[float, str], None]
BLOCK_SAMPLES = 1 << 17
SLOWEST_PART = 0.25
"""Below this part of the mean speed the default samples a revolution no longer keep all that was recorded."""
FINEST = 10
"""Steps of angle are divided by two so many times at most to keep aliases out near standstill."""
BLOCK_STEPS = 64
TURN = 2.0 * math.pi


@takes_data()
@waiting("resampling in angle")
def angular_resample(
    signal: Any, phase: xr.DataArray, *, samples_per_rev: int | None = None, **_data: Unpack[DataKeywords]
) -> xr.DataArray:
    """Order tracking: resample to equal steps of the shaft's angle.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    phase : xarray.DataArray
        Shaft angle in rad, dimension (time,), covering all or part of the record (`phase_from_tacho`,
        `phase_from_line`, `phase_from_speed`). It may rest, as before a run-up, but not turn back.
    samples_per_rev : int, optional
        Default: the smallest power of two that samples nowhere coarser than the record does, at speeds from a quarter
        of the mean speed (without rests) up. Where the shaft turns so slowly that the record holds more orders than
        half of this number, they are filtered out before sampling (flat to 0.4 samples_per_rev, 100 dB down at 0.5).

    Returns
    -------
    xarray.DataArray
        Dimensions (angle, channel), angle in revolutions, whole steps from the phase's first full step;
        attribute `samples_per_rev`.

    Raises
    ------
    SignalError
        If the phase turns back or does not turn, or does not overlap the record.
    """
    clock = _Clock(signal, phase, samples_per_rev)
    values = clock.sampled(signal.values, clock.first, clock.last + 1)
    angle = np.arange(clock.first, clock.last + 1) / clock.per_rev
    return _angular(signal, values, angle, clock.per_rev, {"mean_speed": clock.mean_speed})


@takes_data()
@staged("averaging")
def time_synchronous_average(
    signal: Any,
    phase: xr.DataArray,
    *,
    samples_per_rev: int | None = None,
    revolutions: int = 1,
    progress: Progress | None = None,
    **_data: Unpack[DataKeywords],
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
        Dimensions (angle, channel), angle in revolutions from 0; attributes `averages`, `samples_per_rev` and
        `angle_origin`, from where the angle counts. Where the signal says which teeth are in mesh (``teeth_in_mesh``,
        as simulated ones do) and the phase is that of one of its two wheels, ``tooth_numbers`` are that wheel's teeth,
        the number in mesh at angle 0, its step a pitch, and the wheel.

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
        block = clock.sampled(signal.values, begin, begin + turns * length)
        total += block.reshape(turns, length, -1).sum(axis=0)
        if progress is not None:
            progress((start + turns) / count, "averaging")
    # Angles keep their origin: the first sample of the average is the same angle of the shaft in every record.
    shift = clock.first % length
    average = np.roll(total / count, shift, axis=0)
    extra = {"averages": count, "mean_speed": clock.mean_speed, "angle_origin": _origin(phase)}
    extra |= _tooth_numbers(signal, phase, clock.mean_speed)
    return _angular(signal, average, np.arange(length) / clock.per_rev, clock.per_rev, extra)


ORIGINS = {
    "constant speed": "the record's first sample", "speed curve": "the record's first sample",
    "tacho": "the tacho's pulse", "line": "where the mesh line turns positive",
}  # fmt: skip
"""From where an angle counts, by how the phase was found."""
SAME_SPEED = 1e-2
"""Relative difference of a phase's mean speed from a wheel's: speeds of wheels with other teeth differ by more."""


def _origin(phase: xr.DataArray) -> str:
    """Return from where the angles of a phase count, in words."""
    return ORIGINS.get(str(phase.attrs.get("origin")), "zero of the angle that was given")


def _tooth_numbers(signal: xr.DataArray, phase: xr.DataArray, mean_speed: float) -> dict[str, Any]:
    """Return the teeth of the wheel that a phase belongs to, the number in mesh at its angle zero, and the step.

    ``teeth_in_mesh`` holds a time, and of driver and driven wheel the number at that time and its step for each pitch.
    The driver's angle since then is the signal's coordinate ``angle``, or its speed times the time.
    """
    known, teeth = signal.attrs.get("teeth_in_mesh"), signal.attrs.get("teeth")
    if known is None or teeth is None or len(teeth) != 2:
        return {}
    since, own = phase["time"].values[0], signal.coords.get("angle")
    at = np.asarray(signal["time"].values, dtype=float)
    if own is not None and own.dims == ("time",):
        driver = float(np.interp(since, at, own.values))
        speed = abs(float(own.values[-1] - own.values[0])) / (at[-1] - at[0])
    elif signal.attrs.get("speed") is not None:
        speed = float(signal.attrs["speed"])
        driver = speed * (float(since) - known[0])
    else:
        return {}
    ratios = (1.0, teeth[0] / teeth[1])
    wheel = phase.attrs.get("wheel")
    if wheel is None:
        wheel = next(
            (k + 1 for k, r in enumerate(ratios) if abs(mean_speed - r * speed) < SAME_SPEED * r * speed), None
        )
    if wheel is None:
        return {}
    count, number, step = teeth[wheel - 1], known[2 * wheel - 1], known[2 * wheel]
    turned = (ratios[wheel - 1] * driver - float(phase.values[0])) / TURN
    name = ("driver", "driven wheel")[wheel - 1]
    return {"tooth_numbers": (int(count), float((number + step * count * turned) % count), int(step), name)}


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
        if np.any(steps < 0.0) or not self.turns[-1] > self.turns[0]:
            where = (
                f"falls at t = {start + self.at[int(np.argmin(steps))] / rate:g} s" if steps.min() < 0.0 else "rests"
            )
            raise SignalError(
                f"phase: must increase from sample to sample, or rest for a while, but it {where}; "
                "give the angle of a shaft that keeps turning one way"
            )
        self.mean_speed = float((self.turns[-1] - self.turns[0]) / (self.at[-1] - self.at[0]) * rate * TURN)
        if per_rev is None:
            speeds = steps / np.maximum(np.diff(self.at), 1e-9) * rate
            moving = speeds[speeds > 0.0]
            slowest = max(float(moving.min()), SLOWEST_PART * float(moving.mean()))
            per_rev = samples_per_revolution(rate, slowest)
        if per_rev < 4:
            raise SignalError(f"samples_per_rev: must be at least 4, got {per_rev!r}")
        self.per_rev = int(per_rev)
        self.first = math.ceil(self.turns[0] * self.per_rev - 1e-9)
        self.last = math.floor(self.turns[-1] * self.per_rev + 1e-9)

    def positions(self, begin: int, end: int, finer: int = 1) -> np.ndarray:
        """Where steps `begin` to `end` (not included) of 1 / (per_rev finer) revolution fall in the record."""
        angles = np.arange(begin, end) / (self.per_rev * finer)
        # Only the stretch that is needed: the whole record's tables would be copied each time.
        low = max(0, int(np.searchsorted(self.turns, angles[0])) - 1)
        high = int(np.searchsorted(self.turns, angles[-1], side="right")) + 1
        return np.interp(angles, self.turns[low:high], self.at[low:high])

    def times(self, angles: np.ndarray) -> np.ndarray:
        """Where angles in revolutions fall in the record (fractional samples)."""
        return np.interp(angles, self.turns, self.at)

    def sampled(self, values: np.ndarray, begin: int, end: int) -> np.ndarray:
        """Samples at steps `begin` to `end` (not included) of angle, shape (end - begin, channels).

        Where a step of angle takes longer than a sample, steps are halved until it does not, and the finer ones
        filtered and thinned out: a stretch of the record that was sampled too coarsely would show aliases.
        """
        positions = self.positions(begin, end)
        halvings = _halvings(positions)
        out = np.empty((positions.size, values.shape[1]))
        edges = np.flatnonzero(np.diff(halvings)) + 1
        for low, high in zip(np.r_[0, edges], np.r_[edges, positions.size]):
            m = int(halvings[low])
            if m == 0:
                for channel, column in enumerate(values.T):
                    out[low:high, channel] = interpolate(column, positions[low:high])
                continue
            taps = decimation_taps(1 << m, float(1 << m))
            half = taps.size // 2
            fine = self.positions((begin + low << m) - half, (begin + high - 1 << m) + half + 1, 1 << m)
            source = np.stack([interpolate(column, fine) for column in values.T], axis=1)
            out[low:high] = apply_zero_phase(source, taps, "trim", 1 << m)[0]
        return out


def _halvings(positions: np.ndarray) -> np.ndarray:
    """How often each step of angle must be halved to be no longer than a sample, equal over blocks of steps."""
    if positions.size < 2:
        return np.zeros(positions.size, dtype=int)
    steps = np.diff(positions)
    longest = np.maximum(np.append(steps, steps[-1]), np.insert(steps, 0, steps[0]))
    if longest.max() <= 1.0 + 1e-6:
        return np.zeros(positions.size, dtype=int)
    needed = np.clip(np.ceil(np.log2(np.maximum(longest, 1.0)) - 1e-6), 0, FINEST).astype(int)
    blocks = -(-positions.size // BLOCK_STEPS)
    padded = np.pad(needed, (0, blocks * BLOCK_STEPS - needed.size)).reshape(blocks, BLOCK_STEPS)
    return np.repeat(padded.max(axis=1), BLOCK_STEPS)[: positions.size]


def _angular(
    signal: xr.DataArray, values: np.ndarray, angle: np.ndarray, per_rev: int, extra: dict[str, Any]
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


# Parts of a time-synchronous average: regular, residual and difference signal.
#
# With z teeth, orders counted in revolutions of the average's shaft:
#
# * regular: shaft orders 1 and 2, mesh orders k z, and their first sidebands k z +- 1
# * residual: the average less its mean, shaft orders 1 and 2 and mesh orders (first sidebands stay)
# * difference: the average less its mean and the regular part
#
# so residual - difference = the first sidebands. Removal is exact: the average covers whole revolutions, each order is
# one bin of its discrete Fourier transform.
#
# References
# ----------
# .. [1] M. Lebold et al., Review of vibration analysis methods for gearbox diagnostics and prognostics, 54th MFPT
# (2000).


SHAFT_ORDERS = (1, 2)


def regular_signal(
    average: xr.DataArray, teeth: int | Sequence[int] | None = None, *, sidebands: int = 1
) -> xr.DataArray:
    """The regular part: shaft orders, mesh harmonics and `sidebands` sidebands on either side of each.

    Parameters
    ----------
    average : xarray.DataArray
        Dimensions (angle, channel), whole revolutions (`time_synchronous_average`).
    teeth : int or sequence, optional
        Tooth count of the wheel on this shaft (the first counts); default the signal's.
    sidebands : int
        How many sidebands belong to the regular part.

    Returns
    -------
    xarray.DataArray
        Dimensions (angle, channel), mean free.
    """
    return _part(average, teeth, sidebands, keep=True)


def difference_signal(
    average: xr.DataArray, teeth: int | Sequence[int] | None = None, *, sidebands: int = 1
) -> xr.DataArray:
    """The average less its mean and its regular part; see `regular_signal` for the parameters."""
    return _part(average, teeth, sidebands, keep=False)


def residual_signal(average: xr.DataArray, teeth: int | Sequence[int] | None = None) -> xr.DataArray:
    """The average less its mean, shaft orders 1 and 2 and mesh harmonics; see `regular_signal` for the parameters."""
    return _part(average, teeth, 0, keep=False)


def regular_orders(teeth: int, highest: float, sidebands: int) -> list[int]:
    """Whole orders of the regular part up to `highest`."""
    orders = set(SHAFT_ORDERS)
    for mesh in range(teeth, int(highest) + teeth + 1, teeth):
        orders.update(range(mesh - sidebands, mesh + sidebands + 1))
    return sorted(k for k in orders if 0 < k <= highest)


def tooth_count(average: xr.DataArray, teeth: int | Sequence[int] | None) -> int:
    """Tooth count of the wheel on the average's shaft, from the call or the signal; error asking for it by name."""
    return require(average, "teeth", teeth, needed_for="separating the mesh from the rest")[0]


def whole_revolutions(average: xr.DataArray) -> int:
    """Revolutions the average covers; SignalError if it is no average or not whole."""
    per_rev = average.attrs.get("samples_per_rev")
    if per_rev is None or "angle" not in average.dims:
        raise SignalError("average: must come from time_synchronous_average (dimensions angle, channel)")
    turns, rest = divmod(average.sizes["angle"], int(per_rev))
    if rest or turns < 1:
        raise SignalError(f"average: covers {average.sizes['angle'] / per_rev:g} revolutions, must be a whole number")
    return turns


def remove_orders(average: xr.DataArray, orders: Iterable[float], *, keep: bool = False) -> xr.DataArray:
    """The average without its mean and the given orders, or (`keep`) only those orders.

    Raises
    ------
    SignalError
        If an order is not one of the average's bins.
    """
    turns = whole_revolutions(average)
    bins = [round(order * turns) for order in orders]
    for order, index in zip(orders, bins):
        if abs(order * turns - index) > 1e-9 * max(1.0, abs(order)):
            raise SignalError(f"orders: {order!r} is not a multiple of 1 / {turns} revolution, average over more turns")
    line = scipy.fft.rfft(average.values, axis=0)
    mask = np.zeros(line.shape[0], dtype=bool)
    mask[[b for b in bins if b < mask.size]] = True
    line[~mask if keep else mask] = 0.0
    line[0] = 0.0
    return average.copy(data=scipy.fft.irfft(line, average.sizes["angle"], axis=0))


def _part(average: xr.DataArray, teeth: int | Sequence[int] | None, sidebands: int, keep: bool) -> xr.DataArray:
    if sidebands < 0:
        raise SignalError(f"sidebands: must not be negative, got {sidebands!r}")
    count = check_teeth(tooth_count(average, teeth))[0]
    if 2 * sidebands + 1 > count:
        raise SignalError(f"sidebands: {sidebands} on either side overlap between the harmonics of {count} teeth")
    whole_revolutions(average)
    return remove_orders(average, regular_orders(count, average.attrs["samples_per_rev"] / 2, sidebands), keep=keep)
