"""Spectral correlation and coherence of records whose power rises and falls with hidden periods.

Blows of a bearing excite some band of frequencies f again and again: the power there has lines at cyclic frequencies
alpha, the rate of the blows and its multiples, even where neither the spectrum nor the envelope of any one band shows
them. The spectral correlation S(alpha, f) is the density of that power over both; the coherence divides it by the power
at f and f - alpha, so that it lies between 0 and 1 whatever the path from the bearing to the sensor does.

References
----------
.. [1] J. Antoni, G. Xin, N. Hamzaoui, Fast computation of the spectral correlation, Mechanical Systems and Signal
   Processing 92 (2017) 248-277.
"""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
import scipy.fft
import scipy.signal as ss
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import rate_of
from gearmbs.signals.signal.units import Given

OVERSAMPLED = 2.0
"""Blocks follow each other so densely that cyclic frequencies up to the highest and a line beyond are no aliases."""
FEWEST_BLOCKS = 16


@takes_data(highest="frequency")
def spectral_correlation(
    signal: Any, highest: Given, *, segment: int = 256, channel: str | None = None, **_data: Unpack[DataKeywords]
) -> xr.Dataset:
    """Return the spectral correlation and coherence of one channel by the fast algorithm of Antoni et al.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    highest : float or str
        Highest cyclic frequency, Hz: a few times the rate of blows.
    segment : int
        Samples of a block; the resolution over f is the rate by this, that over alpha one by the record's length: a
        line midway between two cyclic frequencies has 64 % of its height there, so that heights are to be read of
        records cut to whole periods.
    channel : str, optional
        Default: the first.

    Returns
    -------
    xarray.Dataset
        Over ``cyclic`` (Hz, from 0 on) and ``frequency`` (Hz): ``correlation`` (complex, units squared by Hz, one-sided
        over f) and ``coherence`` (its amount by the power at f and f - alpha); over ``cyclic``: ``envelope``, the mean
        of the squared coherence over all f, the enhanced envelope spectrum.

    Raises
    ------
    SignalError
        If the record is too short, or the highest cyclic frequency is none of it.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(100000) / 10000.0
    >>> noise = np.random.default_rng(0).standard_normal(t.size)
    >>> found = spectral_correlation((1 + 0.8 * np.cos(2 * np.pi * 40 * t)) * noise, "100 Hz", rate=10000)
    >>> lines = found["envelope"].where(found["cyclic"] > 1.0)
    >>> round(float(lines.idxmax()), 1)
    40.0
    """
    highest = float(highest)
    rate, names = rate_of(signal), [str(name) for name in signal["channel"].values]
    name = names[0] if channel is None else channel
    if name not in names:
        raise SignalError(f"channel: there is no {name!r}, only {names}")
    resolution = rate / segment
    if not 0.0 < highest <= rate / 4.0:
        raise SignalError(f"highest: must lie between 0 and a quarter of the rate, {rate / 4:g} Hz, got {highest:g}")
    shift = int(rate / (OVERSAMPLED * (highest + resolution)))
    values = signal.values[:, names.index(name)].astype(float)
    count = 0 if shift < 1 else (values.size - segment) // shift + 1
    if count < FEWEST_BLOCKS:
        raise SignalError(
            f"signal: its {values.size} samples make {max(count, 0)} blocks of {segment}; {FEWEST_BLOCKS} are needed: "
            "give a longer record or shorter segments"
        )
    window = ss.windows.hann(segment, sym=False)
    blocks = np.lib.stride_tricks.sliding_window_view(values - values.mean(), segment)[::shift][:count]
    # the phase of each block refers to the middle of its window
    lines = scipy.fft.rfft(blocks * window, axis=1) * (-1.0) ** np.arange(segment // 2 + 1)
    cyclic = np.arange(int(highest * count * shift / rate) + 1) * rate / (count * shift)

    def kernel(offset: np.ndarray) -> np.ndarray:
        """Return the transform of the squared window at frequencies, Hz, about its middle."""
        at = (np.arange(segment) - segment // 2) / rate
        return np.cos(2.0 * np.pi * np.outer(offset, at)) @ window**2

    total = np.zeros((cyclic.size, lines.shape[1]), dtype=complex)
    weights = np.zeros(cyclic.size)
    for p in range(int(np.ceil(highest / resolution)) + 1):
        # products of each line with the p-th below it; below zero the record is its own conjugate
        below = np.concatenate((np.conj(lines[:, p:0:-1]), lines[:, : lines.shape[1] - p]), axis=1)
        total += scipy.fft.fft(lines * np.conj(below), axis=0)[: cyclic.size]
        weights += kernel(cyclic - p * resolution)
    density = 2.0 * total / (count * rate) / weights[:, None]
    return _with_coherence(density, cyclic, np.arange(lines.shape[1]) * resolution)


def _with_coherence(density: np.ndarray, cyclic: np.ndarray, frequency: np.ndarray) -> xr.Dataset:
    """Return a spectral correlation with what follows from it."""
    power = np.abs(density[0])
    shifted = np.interp(np.abs(frequency[None, :] - cyclic[:, None]), frequency, power)
    coherence = np.abs(density) / np.sqrt(np.maximum(power[None, :] * shifted, 1e-300))
    return xr.Dataset(
        {
            "correlation": (("cyclic", "frequency"), density),
            "coherence": (("cyclic", "frequency"), coherence),
            "envelope": ("cyclic", np.mean(coherence**2, axis=1)),
        },
        {
            "cyclic": ("cyclic", cyclic, {"units": "Hz"}),
            "frequency": ("frequency", frequency, {"units": "Hz"}),
        },
    )
