"""Gear and bearing parts of a record: what repeats exactly is of shafts and gears, what does not is of bearings.

Three ways to part them:

* `remove_average` takes the time-synchronous average of a shaft out: what is locked to its angle goes.
* `discrete_random` (Antoni and Randall) takes out all that is predictable over a delay longer than the bearing's
  memory; no angle is needed.
* `edit_cepstrum` and `prewhiten` level lines in the spectrum: families of lines, or all of them with every resonance.

References
----------
.. [1] J. Antoni, R. B. Randall, Unsupervised noise cancellation for vibration signals, part II: a novel
   frequency-domain algorithm, Mechanical Systems and Signal Processing 18 (2004) 103-117.
.. [2] R. B. Randall, N. Sawalhi, M. Coats, A comparison of methods for separation of deterministic and random signals,
   International Journal of Condition Monitoring 1 (2011) 11-19.
.. [3] P. Borghesani et al., Application of cepstrum pre-whitening for the diagnosis of bearing faults under variable
   speed conditions, Mechanical Systems and Signal Processing 36 (2013) 370-384.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Unpack

import numpy as np
import scipy.fft
import scipy.signal as ss
import xarray as xr

from gearmbs.progress import waiting
from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.angular import time_synchronous_average
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import like, rate_of
from gearmbs.signals.signal.units import Given

FLOOR = 1e-12
"""Least magnitude of a line, of the largest, whose logarithm is taken."""


@takes_data()
@waiting("parting lines and noise")
def remove_average(
    signal: Any, phase: xr.DataArray, **_data: Unpack[DataKeywords]
) -> tuple[xr.DataArray, xr.DataArray]:
    """Part a record into what repeats with every turn of a shaft and the rest.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    phase : xarray.DataArray
        Angle of the shaft, rad, of dimension (time,).

    Returns
    -------
    repeating, rest : xarray.DataArray
        Of the times at which the angle is known; their sum is the record there.
    """
    average = time_synchronous_average(signal, phase)
    begin, end = float(phase["time"].values[0]), float(phase["time"].values[-1])
    kept = signal.sel(time=slice(begin, end))
    angle = np.interp(kept["time"].values, phase["time"].values, phase.values)
    per_turn = int(average.attrs["samples_per_rev"])
    turns = average.sizes["angle"] // per_turn
    at = np.mod(angle, 2.0 * np.pi * turns) * per_turn / (2.0 * np.pi)
    first = float(average["angle"].values[0]) * per_turn / (2.0 * np.pi)
    repeating = np.empty_like(kept.values)
    for c in range(kept.sizes["channel"]):
        repeating[:, c] = _periodic(average.values[:, c], at - first)
    return like(kept, repeating), like(kept, kept.values - repeating)


def _periodic(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return a periodic sequence between its samples, by a cubic spline."""
    from scipy.interpolate import CubicSpline

    n = values.size
    spline = CubicSpline(np.arange(n + 1), np.append(values, values[0]), bc_type="periodic")
    return spline(np.mod(at, n))


@takes_data(delay="time")
@waiting("parting lines and noise")
def discrete_random(
    signal: Any,
    *,
    delay: Given | None = None,
    segment: int | None = None,
    **_data: Unpack[DataKeywords],
) -> tuple[xr.DataArray, xr.DataArray]:
    """Part a record into what can be predicted from its past and what cannot.

    The filter H = S_(past, present)/S_(past, past) by averages over segments, the past being ``delay`` earlier, keeps
    lines and rejects what forgets itself within the delay.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    delay : float or str, optional
        s or text; longer than the memory of what is random, some turns of the shaft. Default: one segment.
    segment : int, optional
        Samples of the filter: its resolution, rate/segment, has to part neighbouring lines. Default: a power of two, a
        32nd of the record at most.

    Returns
    -------
    discrete, random : xarray.DataArray
        Their sum is the record.
    """
    rate, n = rate_of(signal), signal.sizes["time"]
    length = 1 << int(np.log2(max(n // 32, 1))) if segment is None else int(segment)
    shift = length if delay is None else round(float(delay) * rate)
    if not 16 <= length <= n // 4:
        raise SignalError(f"segment: must lie between 16 and a quarter of the record ({n // 4} samples), got {length}")
    if not 0 < shift <= n // 4:
        raise SignalError(f"delay: must lie between 0 and a quarter of the record ({n / rate / 4:g} s), got {delay!r}")
    window = ss.get_window("hann", length)
    starts = range(0, n - length - shift + 1, length // 4)
    discrete = np.empty_like(signal.values)
    for c in range(signal.sizes["channel"]):
        column = signal.values[:, c] - signal.values[:, c].mean()
        cross, own = np.zeros(2 * length // 2 + 1, dtype=complex), np.zeros(2 * length // 2 + 1)
        for start in starts:
            past = scipy.fft.rfft(column[start : start + length] * window, 2 * length)
            now = scipy.fft.rfft(column[start + shift : start + shift + length] * window, 2 * length)
            cross += np.conj(past) * now
            own += np.abs(past) ** 2
        gain = np.abs(cross) / np.maximum(own, FLOOR * own.max())
        # without a phase the filter is symmetric: what it keeps stays in its place
        taps = np.fft.fftshift(scipy.fft.irfft(gain, 2 * length))[length // 2 : 3 * length // 2 + 1]
        taps *= ss.get_window("hann", taps.size, fftbins=False)
        discrete[:, c] = ss.oaconvolve(column, taps, mode="same") + signal.values[:, c].mean()
    return like(signal, discrete), like(signal, signal.values - discrete)


@takes_data()
@waiting("parting lines and noise")
def prewhiten(signal: Any, **_data: Unpack[DataKeywords]) -> xr.DataArray:
    """Give all lines of the spectrum the same magnitude and keep their phases.

    This is editing of the cepstrum to zero everywhere: lines of shafts and gears and every resonance are levelled, and
    bursts stand out. The result has the RMS of the record, its mean removed.
    """
    columns = []
    for column in signal.values.T:
        line = scipy.fft.rfft(column - column.mean())
        size = np.abs(line)
        if size.max() == 0.0:
            raise SignalError("signal: a channel that is zero cannot be prewhitened; leave it out with channels=...")
        flat = scipy.fft.irfft(line / np.maximum(size, FLOOR * size.max()), column.size)
        columns.append(flat * (np.std(column) / np.std(flat)))
    return like(signal, np.stack(columns, axis=1))


@takes_data(width="frequency")
@waiting("parting lines and noise")
def level_lines(signal: Any, width: Given, most: float = 10.0, **_data: Unpack[DataKeywords]) -> xr.DataArray:
    """Flatten a spectrum over neighbourhoods, and cut its lines to a multiple of what is round them.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    width : float or str
        Of a neighbourhood, Hz or text.
    most : float
        Magnitude of a line by the median of its neighbourhood, at most. With 1 this is nearly `prewhiten`; blows at
        perfectly even times, as simulated ones are, need more to be seen.
    """
    rate, n, width = rate_of(signal), signal.sizes["time"], float(width)
    if not (rate / n < width < rate / 2 and most >= 1.0):
        raise SignalError(
            f"width: must lie between {rate / n:.3g} and {rate / 2:g} Hz, most be 1 or more, got {width!r}, {most!r}"
        )
    columns = []
    for column in signal.values.T:
        line = scipy.fft.rfft(column - column.mean())
        size = np.abs(line)
        if size.max() == 0.0:
            raise SignalError("signal: a channel that is zero has no lines; leave it out with channels=...")
        edges = np.linspace(0, size.size, max(round(rate / 2 / width), 2) + 1).astype(int)
        medians = [max(float(np.median(size[a:b])), FLOOR * size.max()) for a, b in pairwise(edges)]
        around = np.interp(np.arange(size.size), 0.5 * (edges[1:] + edges[:-1]), medians)
        gain = np.minimum(1.0, most * around / np.maximum(size, FLOOR * size.max())) / around
        flat = scipy.fft.irfft(line * gain, n)
        columns.append(flat * (np.std(column) / np.std(flat)))
    return like(signal, np.stack(columns, axis=1))


@takes_data(frequencies="frequency", keep_below="time")
@waiting("parting lines and noise")
def edit_cepstrum(
    signal: Any,
    frequencies: Given | Sequence[Given],
    *,
    width: float = 0.02,
    keep_below: Given | None = None,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Level families of equally spaced lines: notches in the real cepstrum at multiples of 1/f.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    frequencies : float, str or sequence of these
        Spacings of the families, Hz or texts: shafts and mesh frequencies.
    width : float
        Half width of a notch as a share of its quefrency, at least one sample.
    keep_below : float or str, optional
        Quefrency below which nothing is edited, s or text; default half the shortest spacing's.

    Returns
    -------
    xarray.DataArray
        The record with the magnitudes of its spectrum edited, phases kept.
    """
    spacings = np.atleast_1d(np.asarray(frequencies, dtype=float))
    rate, n = rate_of(signal), signal.sizes["time"]
    if not (spacings.size and np.all(np.isfinite(spacings)) and np.all(spacings > 2.0 * rate / n)):
        raise SignalError(
            f"frequencies: must be above two lines of the record ({2.0 * rate / n:.3g} Hz), got {frequencies!r}"
        )
    low = 0.5 / spacings.max() if keep_below is None else float(keep_below)
    lifter = np.ones(n // 2 + 1)
    for spacing in spacings:
        for k in range(1, int(spacing * n / rate / 2.0) + 1):
            at = k * rate / spacing
            half = max(1.0, width * rate / spacing)
            first, last = int(np.ceil(at - half)), int(np.floor(at + half)) + 1
            if first / rate > low:
                lifter[first:last] = 0.0
    both = np.concatenate([lifter, lifter[1 : n - lifter.size + 1][::-1]])
    columns = []
    for column in signal.values.T:
        line = scipy.fft.rfft(column - column.mean())
        size = np.abs(line)
        if size.max() == 0.0:
            raise SignalError("signal: a channel is zero, its cepstrum does not exist; leave it out with channels=...")
        log = np.log(np.maximum(size, FLOOR * size.max()))
        cepstrum = scipy.fft.irfft(log, n) * both
        edited = np.exp(scipy.fft.rfft(cepstrum).real)
        columns.append(scipy.fft.irfft(line / np.maximum(size, FLOOR * size.max()) * edited, n))
    return like(signal, np.stack(columns, axis=1))
