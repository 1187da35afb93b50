"""Spectra with stated units: amplitude, RMS, power and power spectral density, averaged over segments."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import scipy.fft
import scipy.signal as ss
import xarray as xr

from .any_data import takes_data
from .errors import SignalError
from .signal import rate_of, units_of

Scaling = Literal["amplitude", "rms", "power", "density"]
Progress = Callable[[float, str], None]
SCALINGS = ("amplitude", "rms", "power", "density")


@takes_data(segment="time")
def spectrum(
    signal: xr.DataArray,
    *,
    scaling: Scaling = "amplitude",
    window: str | tuple = "hann",
    segment: int | float | None = None,
    overlap: float = 0.5,
    detrend: bool = True,
    progress: Progress | None = None,
) -> xr.DataArray:
    """One-sided spectrum by averaged periodograms (Welch), segment by segment.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), units U, or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    scaling : {"amplitude", "rms", "power", "density"}
        "amplitude": a sine A sin(2 pi f t) on a line gives A, in U; "rms": A / sqrt(2), in U; "power": A^2 / 2, in U^2;
        "density": power spectral density in U^2/Hz, whose integral over frequency is the mean square.
        The first three divide by the window's coherent gain, the last by its noise power.
    window : str or tuple
        As for `scipy.signal.get_window`.
    segment : int or float, optional
        Samples (int) or seconds (float) per segment; default the whole record (one segment).
    overlap : float
        Fraction of overlap of successive segments, 0 <= overlap < 1.
    detrend : bool
        Remove each segment's mean.
    progress : callable, optional
        Called as progress(fraction, "spectrum").

    Returns
    -------
    xarray.DataArray
        Dimensions (frequency, channel).

    Raises
    ------
    SignalError
        If a parameter is out of range.

    References
    ----------
    .. [1] P. D. Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans. Audio
       Electroacoust. 15 (1967) 70-73.
    .. [2] G. Heinzel, A. Ruediger, R. Schilling, Spectrum and spectral density estimation by the DFT, 2002.
    """
    rate = rate_of(signal)
    n = signal.sizes["time"]
    length = n if segment is None else (round(segment * rate) if isinstance(segment, float) else int(segment))
    result, details = periodograms(signal.values, rate, length, window, overlap, detrend, scaling, progress)
    units = [spectral_unit(u, scaling, "Hz") for u in units_of(signal)]
    return xr.DataArray(
        result,
        dims=("frequency", "channel"),
        coords={
            "frequency": ("frequency", scipy.fft.rfftfreq(details["length"], 1.0 / rate), {"units": "Hz"}),
            "channel": signal["channel"].values,
            "units": ("channel", np.asarray(units, dtype=str)),
        },
        attrs={
            "units": units[0] if len(set(units)) == 1 else "mixed",
            "scaling": scaling,
            "window": str(window),
            "segments": details["segments"],
            "resolution": rate / details["length"],
            "noise_bandwidth": details["noise_bandwidth"],
        },
    )


def periodograms(
    values: np.ndarray,
    rate: float,
    length: int,
    window: str | tuple,
    overlap: float,
    detrend: bool,
    scaling: str,
    progress: Progress | None = None,
) -> tuple[np.ndarray, dict[str, Any]]:
    """Averaged one-sided periodograms of `values` (n, channels), `rate` samples per unit of the axis; see `spectrum`.

    Returns
    -------
    lines : ndarray of shape (length // 2 + 1, channels)
    details : dict
        `length`, `segments`, `noise_bandwidth`.
    """
    n, channels = values.shape
    if length < 2:
        raise SignalError(f"segment: must hold at least 2 samples, got {length!r}")
    length = min(length, n)
    if not 0.0 <= overlap < 1.0:
        raise SignalError(f"overlap: must lie in [0, 1), got {overlap!r}")
    if scaling not in SCALINGS:
        raise SignalError(f"scaling: must be one of {', '.join(SCALINGS)}, got {scaling!r}")
    step = max(1, length - round(overlap * length))
    weights = ss.get_window(window, length)
    starts = range(0, n - length + 1, step)
    total = np.zeros((length // 2 + 1, channels))
    for done, start in enumerate(starts):
        for channel in range(channels):
            piece = values[start : start + length, channel]
            line = scipy.fft.rfft((piece - piece.mean() if detrend else piece) * weights)
            total[:, channel] += line.real**2 + line.imag**2
        if progress is not None:
            progress((done + 1) / len(starts), "spectrum")
    two_sided = total / len(starts)
    last = -1 if length % 2 == 0 else None
    two_sided[1:last] *= 2.0
    power = two_sided / weights.sum() ** 2
    if scaling == "density":
        result = two_sided / (rate * (weights**2).sum())
    elif scaling == "power":
        result = power
    elif scaling == "rms":
        result = np.sqrt(power)
    else:
        result = np.sqrt(2.0 * power)
        # The lines at zero and at half the rate have no mirror image: their amplitude is their RMS.
        result[0] /= math.sqrt(2.0)
        if last is not None:
            result[-1] /= math.sqrt(2.0)
    bandwidth = rate * float((weights**2).sum() / weights.sum() ** 2)
    return result, {"length": length, "segments": len(starts), "noise_bandwidth": bandwidth}


def spectral_unit(unit: str, scaling: str, axis: str = "Hz") -> str:
    """Unit of a spectrum over `axis` of a signal in `unit`."""
    if scaling in ("amplitude", "rms"):
        return unit
    squared = f"({unit})^2"
    return squared if scaling == "power" else f"{squared}/{axis}"
