"""Spectra along time and along speed: spectrogram, and waterfall of one record or of a whole sweep."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np
import scipy.fft
import scipy.signal as ss
import xarray as xr

from gearmbs.progress import waiting
from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.rotation.keywords import ShaftAndDataKeywords, ShaftKeywords
from gearmbs.signals.rotation.shaft import REMEDY, shaft_phase
from gearmbs.signals.signal.arguments import as_given, in_si, takes_data
from gearmbs.signals.signal.given import STEADY, speed_curve
from gearmbs.signals.signal.signal import common_unit, rate_of
from gearmbs.signals.spectra import SCALINGS, spectral_unit, spectrum

if TYPE_CHECKING:
    from gearmbs.signals.signal.inputs import Given, Units

Scaling = Literal["amplitude", "rms", "power", "density"]
SLICES = 200
"""So many windows a spectrogram has by default, about."""


class SpectrogramKeywords(ShaftAndDataKeywords, total=False):
    """Keywords of `spectrogram` but for the highest frequency, for type checkers."""

    segment: float | str | None
    overlap: float
    scaling: Scaling
    window: str | tuple
    speed: Any


class WaterfallKeywords(ShaftAndDataKeywords, total=False):
    """Keywords of `waterfall` but for the highest frequency, for type checkers."""

    speed: Any
    segment: float | str | None
    steps: int | None
    scaling: Scaling


class SweepWaterfallKeywords(WaterfallKeywords, total=False):
    """All keywords of `waterfall`."""

    maximum: float | str | None


@takes_data(segment="time", maximum="frequency")
def spectrogram(
    signal: Any,
    *,
    segment: float | str | None = None,
    overlap: float = 0.75,
    scaling: Scaling = "amplitude",
    window: str | tuple = "hann",
    maximum: float | str | None = None,
    speed: Any = None,
    **shaft: Unpack[ShaftAndDataKeywords],
) -> xr.DataArray:
    """Short-time Fourier transform: how the spectrum changes over time.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    segment : float or str, optional
        Length of a window, s or text; default what gives some 200 of them, with 64 samples or more.
    overlap : float
        Fraction of overlap, 0 <= overlap < 1.
    scaling, window
        As for `spectrum`.
    maximum : float or str, optional
        Highest frequency kept, Hz or text.
    speed, **shaft : optional
        As for `order_track`; adds the coordinate `speed`. Without it the signal's own is used, if it has one.

    Returns
    -------
    xarray.DataArray
        Dimensions (time, frequency, channel), time the middle of each window.

    Raises
    ------
    SignalError
        If the window does not fit, or the speed that is given cannot be read.
    """
    rate, n = rate_of(signal), signal.sizes["time"]
    if scaling not in SCALINGS:
        raise SignalError(f"scaling: must be one of {', '.join(SCALINGS)}, got {scaling!r}")
    if not 0.0 <= overlap < 1.0:
        raise SignalError(f"overlap: must lie in [0, 1), got {overlap!r}")
    if segment is None:
        length = min(n, max(64, 1 << round(math.log2(max(2.0, n / (SLICES * (1.0 - overlap)))))))
    else:
        length = round(float(segment) * rate)
    if not 8 <= length <= n:
        raise SignalError(f"segment: {length / rate:g} s do not fit; give 8 samples to {n / rate:g} s")
    step = max(1, round(length * (1.0 - overlap)))
    starts = np.arange(0, n - length + 1, step)
    frequency = scipy.fft.rfftfreq(length, 1.0 / rate)
    shown = frequency <= (math.inf if maximum is None else float(maximum))
    if shown.sum() < 2:
        raise SignalError(f"maximum: {maximum!r} Hz leaves no lines; they lie {frequency[1]:g} Hz apart")
    weights = ss.get_window(window, length)
    out = np.empty((starts.size, int(shown.sum()), signal.sizes["channel"]))
    with waiting("spectrogram") as tell:
        for i, start in enumerate(starts):
            piece = signal.values[start : start + length]
            line = scipy.fft.rfft((piece - piece.mean(axis=0)) * weights[:, None], axis=0)
            out[i] = _scaled(line.real**2 + line.imag**2, weights, rate, scaling)[shown]
            tell((i + 1) / starts.size)
    times = signal["time"].values[0] + (starts + 0.5 * (length - 1)) / rate
    result = xr.DataArray(
        out,
        dims=("time", "frequency", "channel"),
        coords={
            "time": ("time", times, {"units": "s"}),
            "frequency": ("frequency", frequency[shown], {"units": "Hz"}),
            "channel": signal["channel"].values,
        },
        attrs={
            "units": spectral_unit(common_unit(signal), scaling, "Hz"),
            "scaling": scaling,
            "window": str(window),
            "segment": length / rate,
            "source": str(signal.attrs.get("source", signal.name or "signal")),
        },
    )
    try:
        known: Mapping[str, Any] = shaft
        phase = shaft_phase(signal, speed, **known)
    except MissingMetadataError:
        return result
    own = phase["time"].values
    values = np.interp(times, own, np.gradient(phase.values, own), left=np.nan, right=np.nan)
    return result.assign_coords(speed=("time", values, {"units": "rad/s", "long_name": "speed"}))


@waiting("waterfall")
def waterfall(
    signals: Any,
    speed: Any = None,
    *,
    segment: float | str | None = None,
    steps: int | None = None,
    scaling: Scaling = "amplitude",
    maximum: float | str | None = None,
    rate: Given | None = None,
    units: Units | None = None,
    channels: Sequence[str] | None = None,
    gaps: str | None = None,
    **shaft: Unpack[ShaftKeywords],
) -> xr.DataArray:
    """Spectra against speed: of one run-up, or of records taken each at its own speed.

    Parameters
    ----------
    signals : DataArray, Dataset, sequence or mapping
        One record whose speed changes; or several, each at a constant speed: a sequence of signals or simulated records
        that know their speeds, or a mapping of speed (rad/s, or text such as "1500 rpm") to record.
    speed : optional
        Of one record: in any shape that `speed_curve` reads. Of several: a speed for each.
    segment : float or str, optional
        Length of the spectra's windows, s or text. Default: the whole record for records of constant speed of one
        length, a fiftieth of the record for a run-up.
    steps : int, optional
        Of one record: the number of spectra, each the mean over an equal interval of speed. Default: as the windows
        come, in the order of time.
    scaling : str
        As for `spectrum`.
    maximum : float or str, optional
        Highest frequency kept, Hz or text.
    rate, units, channels, gaps : optional
        As for `to_signal`, where records are arrays, tables or files.
    **shaft
        As for `order_track`, for one record.

    Returns
    -------
    xarray.DataArray
        Dimensions (speed, frequency, channel), speed in rad/s, increasing; `time` (s) along speed for one record
        without `steps`.

    Raises
    ------
    MissingMetadataError
        If a speed is not known.
    SignalError
        If channels differ, a window does not fit, or all is at one speed.
    """
    if isinstance(signals, Mapping) and not isinstance(signals, xr.Dataset) and (speed is None or rate is None):
        if speed is not None:
            raise SignalError("speed: the mapping names the speeds already; leave speed out")
        speed, signals = list(signals), list(signals.values())
    length: float | None = in_si(segment, "time", "segment")
    top: float | None = in_si(maximum, "frequency", "maximum")
    given: dict[str, Any] = {"rate": rate, "units": units, "channels": channels, "gaps": gaps}
    samples = isinstance(signals, str) or (isinstance(signals, Sequence) and all(np.isscalar(v) for v in signals[:2]))
    if isinstance(signals, Sequence) and (not samples or not signals):
        return _of_sweep([as_given(record, given) for record in signals], speed, length, scaling, top)
    signal = as_given(signals, given)
    duration = signal.sizes["time"] / rate_of(signal)
    short = max(duration / 50.0, 64 / rate_of(signal)) if length is None else float(length)
    slices = spectrogram(signal, segment=short, overlap=0.5, scaling=scaling, maximum=top, speed=speed, **shaft)
    if "speed" not in slices.coords:
        raise MissingMetadataError("speed", "a waterfall", REMEDY)
    slices = slices.isel(time=np.flatnonzero(np.isfinite(slices["speed"].values)))
    _check_spread(slices["speed"].values)
    if steps is not None:
        return _binned(slices, int(steps))
    order = np.argsort(slices["speed"].values, kind="stable")
    return slices.isel(time=order).swap_dims(time="speed")


def _check_spread(speeds: np.ndarray) -> None:
    """Refuse spectra all at one speed, which no axis of speed tells apart."""
    if speeds.size and np.ptp(speeds) <= STEADY * np.abs(speeds).max():
        raise SignalError(
            f"speed: stays at {speeds.mean() * 30.0 / np.pi:.6g} rpm; a waterfall needs a run-up, or several records "
            "at different speeds; of one speed draw a spectrogram, or `gearmbs analyse --figures`"
        )


def _of_sweep(
    signals: list[xr.DataArray], speeds: Any, segment: float | None, scaling: Scaling, maximum: float | None
) -> xr.DataArray:
    if not signals:
        raise SignalError("signals: is empty; give at least one record")
    if speeds is None:
        speeds = [signal.attrs.get("speed") for signal in signals]
    if len(speeds) != len(signals):
        raise SignalError(f"speed: {len(speeds)} speeds for {len(signals)} records")
    missing = [i + 1 for i, speed in enumerate(speeds) if speed is None]
    if missing:
        raise MissingMetadataError("speed", f"record {missing[0]} of a waterfall", "pass speed=[...], one for each")
    mean = [float(np.mean(speed_curve(speed, span=(0.0, 1.0)).values)) for speed in speeds]
    if len(mean) > 1:
        _check_spread(np.asarray(mean))
    shortest = min(signal.sizes["time"] / rate_of(signal) for signal in signals)
    length = shortest if segment is None else float(segment)
    lines = [spectrum(signal, scaling=scaling, segment=length) for signal in signals]
    first = lines[0]
    for i, line in enumerate(lines):
        if line["channel"].values.tolist() != first["channel"].values.tolist():
            raise SignalError(
                f"channels: record {i + 1} has {line['channel'].values.tolist()}, "
                f"the first has {first['channel'].values.tolist()}"
            )
    top = min(float(line["frequency"].values[-1]) for line in lines)
    top = top if maximum is None else min(top, float(maximum))
    axis = first["frequency"].values[first["frequency"].values <= top + 1e-9]
    if axis.size < 2:
        raise SignalError(f"maximum: {maximum!r} Hz leaves no lines; they lie {first.attrs['resolution']:g} Hz apart")
    rows = []
    for line in lines:
        own = line["frequency"].values
        if own.size >= axis.size and np.allclose(own[: axis.size], axis, rtol=1e-9):
            rows.append(line.values[: axis.size])
        else:
            rows.append(np.stack([np.interp(axis, own, column) for column in line.values.T], axis=1))
    order = np.argsort(mean, kind="stable")
    return xr.DataArray(
        np.stack(rows)[order],
        dims=("speed", "frequency", "channel"),
        coords={
            "speed": ("speed", np.asarray(mean)[order], {"units": "rad/s", "long_name": "speed"}),
            "frequency": ("frequency", axis, {"units": "Hz"}),
            "channel": first["channel"].values,
        },
        attrs={
            "units": first.attrs["units"],
            "scaling": scaling,
            "segment": length,
            "source": f"{len(signals)} records",
        },
    )


def _binned(slices: xr.DataArray, steps: int) -> xr.DataArray:
    """Mean spectra over equal intervals of speed; intervals that no window falls into are left out."""
    speeds = slices["speed"].values
    if steps < 1:
        raise SignalError(f"steps: must be at least 1, got {steps!r}")
    edges = np.linspace(speeds.min(), speeds.max(), steps + 1)
    place = np.clip(np.searchsorted(edges, speeds, side="right") - 1, 0, steps - 1)
    kept = [k for k in range(steps) if np.any(place == k)]
    rows = np.stack([np.sqrt((slices.values[place == k] ** 2).mean(axis=0)) for k in kept])
    if slices.attrs["scaling"] in ("power", "density"):
        rows = np.stack([slices.values[place == k].mean(axis=0) for k in kept])
    middles = np.array([float(speeds[place == k].mean()) for k in kept])
    return xr.DataArray(
        rows,
        dims=("speed", "frequency", "channel"),
        coords={
            "speed": ("speed", middles, {"units": "rad/s", "long_name": "speed"}),
            "frequency": slices["frequency"],
            "channel": slices["channel"].values,
        },
        attrs=slices.attrs,
    )


def _scaled(power: np.ndarray, weights: np.ndarray, rate: float, scaling: str) -> np.ndarray:
    """One-sided lines from |X|^2 along axis 0, as `spectrum` scales them."""
    power = power.copy()
    power[1 : (-1 if weights.size % 2 == 0 else None)] *= 2.0
    if scaling == "density":
        return power / (rate * (weights**2).sum())
    power /= weights.sum() ** 2
    if scaling == "power":
        return power
    return np.sqrt(power * (2.0 if scaling == "amplitude" else 1.0))
