"""The one way in for data of any shape: arrays, tables, files, simulated records, signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.files.simulated import holds_ring, read_any, record_signal, ring_signal
from gearmbs.signals.signal.given import contradictions, given_rate, given_speed, is_curve, with_speed
from gearmbs.signals.signal.record import without_gaps
from gearmbs.signals.signal.signal import as_signal, make_signal, with_metadata
from gearmbs.signals.signal.units import Given, check_units

Units = str | Sequence[str] | Mapping[str, str]


def to_signal(
    data: Any,
    *,
    rate: Given | None = None,
    units: Units | None = None,
    channels: Sequence[str] | None = None,
    speed: Any = None,
    teeth: int | Sequence[int] | None = None,
    gaps: str | None = None,
) -> xr.DataArray:
    """Make a signal of data of any shape.

    Parameters
    ----------
    data : array_like, DataFrame, Series, DataArray, Dataset, mapping or path
        Samples (n,), (n, channels) or (channels, n): the longer side is time; a mapping of names to samples; a table,
        whose time column or index gives the rate (`record_of_frame`); a signal or simulated record; or a file.
    rate : float or str, optional
        Sampling rate: Hz, or text such as "12.8 kHz".
    units : str, sequence or mapping, optional
        Units of the channels, as `make_signal`; checked.
    channels : sequence of str, optional
        Names of the columns of an array; of anything else, the channels to keep.
    speed : optional
        rad/s, text, or a curve as for `speed_curve`, which becomes the coordinate `speed` (rad/s) over time.
    teeth : int or sequence of int, optional
    gaps : {"refuse", "interpolate", "longest"}, optional
        What to do with samples that are missing or not finite.

    Returns
    -------
    xarray.DataArray
        Dimensions (time, channel).

    Raises
    ------
    MissingMetadataError
        If no rate can be had.
    SignalError
        If the data cannot be read as samples.

    Examples
    --------
    >>> signal = to_signal([[0.0, 1.0], [0.5, 2.0], [1.0, 3.0]], rate="2 kHz", units="g", channels=["a", "b"])
    >>> signal.sizes["time"], signal.attrs["sampling_rate"], signal.attrs["units"]
    (3, 2000.0, 'g')
    """
    hertz = given_rate(rate)
    check_units(units)
    known: dict[str, Any] = {"teeth": teeth, "speed": given_speed(speed)}
    if isinstance(data, (str, Path)):
        signal = read_any(data, rate=hertz, units=units, channels=channels, gaps=gaps, **known)
    elif isinstance(data, (xr.DataArray, xr.Dataset)):
        signal = _of_xarray(data, hertz, units, channels, known)
    elif hasattr(data, "columns") or (hasattr(data, "to_frame") and hasattr(data, "index")):
        signal = _of_frame(data, hertz, units, channels, gaps, known)
    else:
        signal = _of_array(data, hertz, units, channels, gaps, known)
    return with_speed(signal, speed) if is_curve(speed) else signal


def _of_xarray(
    data: xr.DataArray | xr.Dataset, rate: float | None, units: Any, channels: Sequence[str] | None, known: dict
) -> xr.DataArray:
    if isinstance(data, xr.Dataset) and "acceleration" in data and "operation_speed" in data.attrs:
        signal = record_signal(data)
    elif isinstance(data, xr.Dataset) and holds_ring(data):
        signal = ring_signal(data)
    elif isinstance(data, xr.DataArray) and data.dims == ("time", "channel") and "units" in data.coords:
        own = data.attrs.get("sampling_rate")
        if rate is not None and own is not None and abs(rate / own - 1.0) > 1e-3:
            raise SignalError(f"rate: the signal's is {own:g} Hz, the call says {rate:g} Hz; leave rate out")
        signal = data if own is not None else as_signal(data, rate)
    else:
        signal = as_signal(data, rate)
    signal = signal if channels is None else _picked(signal, channels)
    changes = {key: value for key, value in {"units": units, **known}.items() if value is not None}
    own = signal.attrs
    said = contradictions(own.get("teeth"), own.get("speed"), known["teeth"], known["speed"], "the signal")
    if said:
        changes["notes"] = [*own.get("notes", ()), *said]
    return with_metadata(signal, **changes) if changes else signal


def _of_frame(
    data: Any, rate: float | None, units: Any, channels: Sequence[str] | None, gaps: str | None, known: dict
) -> xr.DataArray:
    from gearmbs.signals.files.frames import record_of_frame
    from gearmbs.signals.signal.record import signal_from

    frame = data if hasattr(data, "columns") else data.to_frame(name="ch1" if data.name is None else data.name)
    record = record_of_frame(frame, Path("table"), rate, channels, gaps)
    return signal_from(record, Path("table"), rate=rate, units=units, channels=channels, gaps=gaps, **known)


def _of_array(
    data: Any, rate: float | None, units: Any, channels: Sequence[str] | None, gaps: str | None, known: dict
) -> xr.DataArray:
    attrs: dict[str, Any] = {}
    if isinstance(data, Mapping):
        picked = {str(k): v for k, v in data.items() if channels is None or str(k) in channels}
        if channels is not None and set(channels) - set(picked):
            raise SignalError(
                f"channels: there is no {sorted(set(channels) - set(picked))}, only {list(map(str, data))}"
            )
        names: Sequence[str] | None = list(picked)
        try:
            sizes = {np.shape(column) for column in picked.values()}
            values = (
                np.stack([np.asarray(c, dtype=float) for c in picked.values()], axis=1) if len(sizes) == 1 else None
            )
        except (TypeError, ValueError):
            values = None
        if values is None or values.ndim != 2:
            shapes = ", ".join(f"{key} {np.shape(value)}" for key, value in picked.items()) or "nothing"
            raise SignalError(f"data: every channel must be one column of numbers of the same length, got {shapes}")
    else:
        names = channels
        try:
            if np.iscomplexobj(data):
                raise SignalError("data: the samples are complex; give real ones, such as their real part or magnitude")
            values = np.asarray(data, dtype=float)
        except SignalError:
            raise
        except (TypeError, ValueError):
            raise SignalError(
                f"data: {type(data).__name__} is no array of numbers; give samples, a DataFrame, a signal or a file"
            ) from None
        values = values[:, None] if values.ndim == 1 else values
        if values.ndim == 2 and values.shape[1] > values.shape[0] and (names is None or len(names) == values.shape[0]):
            values = values.T
    if values.ndim != 2 or 0 in values.shape:
        raise SignalError(f"data: must have shape (samples,) or (samples, channels) and hold some, got {values.shape}")
    if rate is None:
        raise MissingMetadataError(
            "rate",
            "an array of samples",
            "pass rate=... in Hz, or text such as '12.8 kHz'; where that is no setting, pass to_signal(data, rate=...)",
        )
    values, first, notes = without_gaps(values, gaps, rate)
    if notes:
        attrs["notes"] = notes
    return make_signal(values, rate, units=units, channels=names, t0=first / rate, attrs=attrs, **known)


def _picked(signal: xr.DataArray, channels: Sequence[str]) -> xr.DataArray:
    names = [str(c) for c in signal["channel"].values]
    missing = [c for c in channels if c not in names]
    if missing:
        raise SignalError(f"channels: there is no {missing}, only {names}")
    return signal.isel(channel=[names.index(c) for c in channels])
