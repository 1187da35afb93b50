"""Cepstra: families of equally spaced lines (harmonics, sidebands) become single peaks at their spacing's inverse."""

from __future__ import annotations

import numpy as np
import scipy.fft
import scipy.signal as ss
import xarray as xr

from gearmbs.progress import waiting

from .any_data import takes_data
from .errors import SignalError
from .signal import rate_of

FLOOR = 1e-12


@takes_data(segment="time")
@waiting("cepstrum")
def power_cepstrum(
    signal: xr.DataArray, *, segment: int | float | None = None, window: str | tuple = "boxcar", overlap: float = 0.5
) -> xr.DataArray:
    """Power cepstrum, the inverse Fourier transform of ln |X|^2, averaged over segments.

    An echo, x(t) + a x(t - T), shows as a peak of height a at the quefrency T (and -a^2/2 at 2 T, ...). A family of
    sidebands f apart shows at 1 / f. Lines weaker than 1e-12 of the strongest power are lifted to that floor.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    segment : int or float, optional
        Samples (int) or seconds (float) per segment; default the whole record.
    window : str or tuple
        As for `scipy.signal.get_window`.
    overlap : float
        Fraction of overlap of successive segments.

    Returns
    -------
    xarray.DataArray
        Dimensions (quefrency, channel), quefrency in s up to half a segment, dimensionless values.

    References
    ----------
    .. [1] R. B. Randall, A history of cepstrum analysis and its application to mechanical problems, Mechanical
       Systems and Signal Processing 97 (2017) 3-19.
    """
    rate = rate_of(signal)
    n = signal.sizes["time"]
    length = n if segment is None else (round(segment * rate) if isinstance(segment, float) else int(segment))
    if not 8 <= length:
        raise SignalError(f"segment: must hold at least 8 samples, got {length}")
    if not 0.0 <= overlap < 1.0:
        raise SignalError(f"overlap: must lie in [0, 1), got {overlap!r}")
    length = min(length, n)
    weights = ss.get_window(window, length)
    step = max(1, length - round(overlap * length))
    starts = range(0, n - length + 1, step)
    total = np.zeros((length // 2 + 1, signal.sizes["channel"]))
    for start in starts:
        for channel in range(signal.sizes["channel"]):
            line = scipy.fft.rfft(signal.values[start : start + length, channel] * weights)
            power = line.real**2 + line.imag**2
            top = float(power.max())
            if top == 0.0:
                raise SignalError(
                    f"signal: channel {str(signal['channel'].values[channel])!r} is zero from sample {start} on, "
                    "its logarithm does not exist"
                )
            log = np.log(np.maximum(power, FLOOR * top))
            total[:, channel] += scipy.fft.irfft(log, length)[: length // 2 + 1]
    quefrency = np.arange(length // 2 + 1) / rate
    return xr.DataArray(
        total / len(starts),
        dims=("quefrency", "channel"),
        coords={"quefrency": ("quefrency", quefrency, {"units": "s"}), "channel": signal["channel"].values},
        attrs={"units": "1", "long_name": "power cepstrum", "segments": len(starts)},
    )
