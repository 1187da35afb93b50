"""Spectra with stated units: amplitude, RMS, power and power spectral density, averaged over segments."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, Unpack

import numpy as np
import scipy.fft
import scipy.signal as ss
import xarray as xr

from gearmbs.progress import staged, waiting
from gearmbs.signals.errors import SignalError
from gearmbs.signals.filters import bandpass
from gearmbs.signals.rotation.phase import analytic
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import like, rate_of, units_of
from gearmbs.signals.signal.units import Given

Scaling = Literal["amplitude", "rms", "power", "density"]
Progress = Callable[[float, str], None]
SCALINGS = ("amplitude", "rms", "power", "density")


@takes_data(segment="time")
def spectrum(
    signal: Any,
    *,
    scaling: Scaling = "amplitude",
    window: str | tuple = "hann",
    segment: Given | None = None,
    overlap: float = 0.5,
    detrend: bool = True,
    progress: Progress | None = None,
    **_data: Unpack[DataKeywords],
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
    segment : int, float or str, optional
        Samples (int), seconds (float) or text with a unit, per segment; default the whole record (one segment).
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


# Cepstra: families of equally spaced lines (harmonics, sidebands) become single peaks at their spacing's inverse.


FLOOR = 1e-12
"""Part of a segment's largest power below which logarithms are cut off: 120 dB, as in a recorder of 20 bits."""


@takes_data(segment="time")
@waiting("cepstrum")
def power_cepstrum(
    signal: Any,
    *,
    segment: Given | None = None,
    window: str | tuple = "boxcar",
    overlap: float = 0.5,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Power cepstrum, the inverse Fourier transform of ln |X|^2, averaged over segments.

    An echo, x(t) + a x(t - T), shows as a peak of height a at the quefrency T (and -a^2/2 at 2 T, ...). A family of
    sidebands f apart shows at 1 / f. Lines weaker than 1e-12 of the strongest power are lifted to that floor.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    segment : int, float or str, optional
        Samples (int), seconds (float) or text with a unit, per segment; default the whole record.
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


# Envelopes, spectral kurtosis and the kurtogram: where in the spectrum something knocks.
#
# References
# ----------
# .. [1] J. Antoni, The spectral kurtosis: a useful tool for characterising non-stationary signals, Mechanical Systems
# and    Signal Processing 20 (2006) 282-307.
# .. [2] J. Antoni, Fast computation of the kurtogram for the detection of transient faults, Mechanical Systems and
# Signal    Processing 21 (2007) 108-124.


BLOCK = 1 << 17


@takes_data(band="frequency", transition="frequency")
@waiting("envelope")
def envelope(
    signal: Any,
    band: tuple[Given, Given] | None = None,
    *,
    transition: Given | None = None,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Magnitude of the analytic signal, after a zero-phase band-pass if a band is given.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    band : pair of float or str, optional
        Pass band, Hz or texts.
    transition : float or str, optional
        Width of the transitions, Hz or text; default a tenth of the band, at most what fits below and above it.

    Returns
    -------
    xarray.DataArray
        Same units; A |m(t)| for A m(t) cos(2 pi f t) with m slow and f in the band.
    """
    if band is not None:
        low, high = (float(f) for f in band)
        room = min(low, rate_of(signal) / 2 - high)
        if not (high > low and room > 0.0):
            raise SignalError(f"band: must lie inside 0 to {rate_of(signal) / 2:g} Hz, got {band}")
        width = min(0.1 * (high - low), 1.9 * room) if transition is None else transition
        signal = bandpass(signal, low, high, transition=width)
    columns = [np.abs(analytic(column - column.mean())) for column in signal.values.T]
    return like(signal, np.stack(columns, axis=1))


@takes_data(band="frequency", segment="time")
@waiting("envelope spectrum")
def envelope_spectrum(
    signal: Any,
    band: tuple[Given, Given] | None = None,
    *,
    scaling: Scaling = "amplitude",
    segment: Given | None = None,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Spectrum of the envelope, mean removed: modulation frequencies with their amplitudes (see `spectrum`)."""
    return spectrum(envelope(signal, band), scaling=scaling, segment=segment)


@takes_data()
@waiting("spectral kurtosis")
def spectral_kurtosis(
    signal: Any, *, segment: int = 256, overlap: float = 0.75, **_data: Unpack[DataKeywords]
) -> xr.DataArray:
    """Spectral kurtosis from the short-time Fourier transform X(t, f).

    SK(f) = <|X|^4> / <|X|^2>^2 - 2: zero for stationary Gaussian noise, -1 for a steady tone, large where the energy
    comes in bursts. Bins closer than a window's main lobe to zero and half the rate are NaN, where X is not circular.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    segment : int
        Window length in samples: shorter than the time between bursts, longer than a burst's decay.
    overlap : float
        Fraction of overlap.

    Returns
    -------
    xarray.DataArray
        Dimensions (frequency, channel).
    """
    n = signal.sizes["time"]
    if not 8 <= segment <= n // 4:
        raise SignalError(
            f"segment: must lie between 8 and a quarter of the record ({n // 4} samples), got {segment!r}"
        )
    if not 0.0 <= overlap < 1.0:
        raise SignalError(f"overlap: must lie in [0, 1), got {overlap!r}")
    step = max(1, round(segment * (1.0 - overlap)))
    weights = ss.get_window("hann", segment)
    starts = np.arange(0, n - segment + 1, step)
    second = np.zeros((segment // 2 + 1, signal.sizes["channel"]))
    fourth = np.zeros_like(second)
    per_block = max(1, BLOCK // segment)
    for channel, column in enumerate(signal.values.T):
        frames = np.lib.stride_tricks.sliding_window_view(column - column.mean(), segment)
        for begin in range(0, starts.size, per_block):
            line = scipy.fft.rfft(frames[starts[begin : begin + per_block]] * weights, axis=1)
            power = line.real**2 + line.imag**2
            second[:, channel] += power.sum(axis=0)
            fourth[:, channel] += (power**2).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        kurtosis = fourth * starts.size / second**2 - 2.0
    kurtosis[:2] = np.nan
    kurtosis[-2:] = np.nan
    frequency = scipy.fft.rfftfreq(segment, 1.0 / rate_of(signal))
    return xr.DataArray(
        kurtosis,
        dims=("frequency", "channel"),
        coords={"frequency": ("frequency", frequency, {"units": "Hz"}), "channel": signal["channel"].values},
        attrs={"units": "1", "long_name": "spectral kurtosis", "segment": segment},
    )


@takes_data()
@staged("kurtogram")
def kurtogram(
    signal: Any, *, levels: int = 7, progress: Progress | None = None, **_data: Unpack[DataKeywords]
) -> xr.Dataset:
    """Kurtosis of the complex envelope in bands that halve, and are split in three, level by level.

    Level 0 is the whole band; the next ones have 2, 3, 4, 6, 8, 12, ... bands. Each band's complex envelope is cut out
    of the record's discrete Fourier transform, in blocks of 2^17 samples, and K = <|c|^4> / <|c|^2>^2 - 2 taken over
    it: zero for Gaussian noise, -1 for a tone, large for repeated transients in that band.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    levels : int
        Halvings; the narrowest bands are rate / 2 / 2^levels wide.
    progress : callable, optional
        Called as progress(fraction, "kurtogram").

    Returns
    -------
    xarray.Dataset
        `kurtosis` of dimensions (band, channel) with coordinates `centre`, `bandwidth` (Hz) and `bands` (how many the
        level has); `best_centre`, `best_bandwidth`, `best_kurtosis` of dimension (channel,).
    """
    rate = rate_of(signal)
    n = signal.sizes["time"]
    block = min(n, BLOCK)
    if levels < 1 or block // 2 < 16 << levels:
        raise SignalError(f"levels: must be at least 1 and leave 16 bins a band, {levels!r} do not with {n} samples")
    counts = [1] + [c for level in range(1, levels + 1) for c in ((1 << level), 3 << (level - 1))][: 2 * levels - 1]
    starts = range(0, n - block + 1, block)
    edges = [(count, i / count, (i + 1) / count) for count in counts for i in range(count)]
    second = np.zeros((len(edges), signal.sizes["channel"]))
    fourth = np.zeros_like(second)
    half = block // 2
    for channel, column in enumerate(signal.values.T):
        mean = column.mean()
        for at, start in enumerate(starts):
            line = scipy.fft.rfft(column[start : start + block] - mean)
            for row, (_, low, high) in enumerate(edges):
                piece = line[max(1, round(low * half)) : max(2, round(high * half))]
                cut = scipy.fft.ifft(piece)
                power = cut.real**2 + cut.imag**2
                second[row, channel] += power.mean()
                fourth[row, channel] += power @ power / power.size
            if progress is not None:
                progress((channel + (at + 1) / len(starts)) / signal.sizes["channel"], "kurtogram")
    with np.errstate(divide="ignore", invalid="ignore"):
        kurtosis = fourth * len(starts) / second**2 - 2.0
    best = np.nanargmax(np.where(np.isfinite(kurtosis), kurtosis, -np.inf), axis=0)
    centre = np.array([0.5 * (low + high) * rate / 2 for _, low, high in edges])
    width = np.array([(high - low) * rate / 2 for _, low, high in edges])
    return xr.Dataset(
        {
            "kurtosis": (("band", "channel"), kurtosis, {"units": "1"}),
            "best_centre": ("channel", centre[best], {"units": "Hz"}),
            "best_bandwidth": ("channel", width[best], {"units": "Hz"}),
            "best_kurtosis": ("channel", kurtosis[best, np.arange(kurtosis.shape[1])], {"units": "1"}),
        },
        coords={
            "centre": ("band", centre, {"units": "Hz"}),
            "bandwidth": ("band", width, {"units": "Hz"}),
            "bands": ("band", np.array([count for count, _, _ in edges])),
            "channel": signal["channel"].values,
        },
        attrs={"blocks": len(starts), "block_samples": block},
    )
