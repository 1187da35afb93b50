"""The signal type: an `xarray.DataArray` with dimensions (time, channel) and agreed metadata.

Coordinates: `time` in s (uniform), `channel` (names) and `units` (one text per channel); where the speed varies,
`speed` (rad/s) or `angle` (rad) over time.
Attributes: `sampling_rate` in Hz, and where known `speed` in rad/s (of the wheel whose tooth count comes
first), `teeth` (tuple of int), `units` (the common unit of all channels, or "mixed") and anything else.

A signal that is made of another one, by `like`, keeps all of this but the samples; `speed` and `angle` are those at
its own times.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from gearmbs._lazy import spare_duck_arrays
from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.signal.times import in_seconds, seconds_of

if TYPE_CHECKING:
    import xarray as xr

UNKNOWN_UNITS = "unknown"
MIXED_UNITS = "mixed"
SHAFT = {"speed": "rad/s", "angle": "rad"}
"""Coordinates over time that tell how the shaft turns, with their units."""
ROUNDED_TIMES = 0.01
"""Relative difference up to which the mean rate of rounded times is the rate that is given."""
STEADY = 1e-3
"""A speed over time that strays less than this part from its mean is a constant one."""
CLOCK_TOLERANCE = 0.05
"""Part of a sample by which times may deviate from an even clock."""
REMEDIES = {
    "rate": "pass rate=... in Hz",
    "speed": "pass speed=... in rad/s, or estimate it with estimate_speed(signal, teeth=...)",
    "teeth": "pass teeth=..., the tooth counts of the pair, the wheel that turns at `speed` first",
    "units": "pass units=..., for example 'm/s^2'",
}


def make_signal(
    data: ArrayLike | Mapping[str, ArrayLike],
    rate: float | None,
    *,
    units: str | Sequence[str] | Mapping[str, str] | None = None,
    channels: Sequence[str] | None = None,
    t0: float = 0.0,
    speed: float | None = None,
    teeth: int | Sequence[int] | None = None,
    name: str | None = None,
    attrs: Mapping[str, Any] | None = None,
) -> xr.DataArray:
    """Build a signal from samples and what is known about them.

    Parameters
    ----------
    data : array_like of shape (n,) or (n, channels), or mapping of name to array of shape (n,)
        The samples; stored as float64.
    rate : float
        Sampling rate in Hz.
    units : str, sequence or mapping of str, optional
        Unit of all channels, of each channel, or by channel name. Default: "unknown".
    channels : sequence of str, optional
        Channel names; default "ch1", "ch2", ... or the keys of `data`.
    t0 : float
        Time of the first sample in s.
    speed : float, optional
        Speed in rad/s of the wheel whose tooth count comes first.
    teeth : int or sequence of int, optional
        Tooth counts of the pair.
    name : str, optional
        Name of the array.
    attrs : mapping, optional
        Further attributes to keep.

    Returns
    -------
    xarray.DataArray
        Dimensions (time, channel).

    Raises
    ------
    MissingMetadataError
        If `rate` is None.
    SignalError
        If the shapes do not agree, there are no samples, a sample is not finite, or a value is out of range.

    Examples
    --------
    >>> signal = make_signal({"laser": [0.0, 0.1, 0.0, -0.1]}, 12800.0, units="m/s", speed=104.72, teeth=29)
    >>> signal.dims, signal.attrs["units"], round(mesh_frequency(signal), 1)
    (('time', 'channel'), 'm/s', 483.3)
    """
    import xarray as xr

    spare_duck_arrays()

    values, channels = _columns(data, channels)
    names = [f"ch{i + 1}" for i in range(values.shape[1])] if channels is None else [str(c) for c in channels]
    if len(names) != values.shape[1] or len(set(names)) != len(names):
        raise SignalError(f"channels: need {values.shape[1]} different names, got {names}")
    rate = check_rate(rate)
    all_attrs: dict[str, Any] = {**(attrs or {}), "sampling_rate": rate}
    if speed is not None:
        all_attrs["speed"] = check_speed(speed)
    if teeth is not None:
        all_attrs["teeth"] = check_teeth(teeth)
    unit_list = _unit_list(units, names)
    all_attrs["units"] = _common(unit_list)
    return xr.DataArray(
        values,
        dims=("time", "channel"),
        coords={
            "time": ("time", t0 + np.arange(values.shape[0]) / rate, {"units": "s"}),
            "channel": np.asarray(names, dtype=str),
            "units": ("channel", np.asarray(unit_list, dtype=str)),
        },
        name=name,
        attrs=all_attrs,
    )


def _real(data: ArrayLike) -> np.ndarray:
    if np.iscomplexobj(data):
        raise SignalError("data: holds complex numbers; give their real parts or magnitudes")
    return np.asarray(data, dtype=float)


def _columns(
    data: ArrayLike | Mapping[str, ArrayLike], channels: Sequence[str] | None
) -> tuple[np.ndarray, Sequence[str] | None]:
    """Return the samples by columns, and the channels' names as far as they are known."""
    if isinstance(data, Mapping):
        channels = [str(key) for key in data] if channels is None else channels
        columns = [_real(column) for column in data.values()]
        if not columns:
            raise SignalError("data: has no channels")
        if len({column.shape for column in columns}) != 1 or columns[0].ndim != 1:
            shapes = ", ".join(f"{key} {np.shape(value)}" for key, value in data.items())
            raise SignalError(f"data: every channel must be one column of the same length, got {shapes}")
        values = np.stack(columns, axis=1)
    else:
        values = _real(data)
        if values.ndim == 1:
            values = values[:, None]
    if values.ndim != 2 or 0 in values.shape:
        raise SignalError(f"data: must have shape (samples, channels) and be non-empty, got {values.shape}")
    check_finite(values)
    return values, channels


def check_finite(values: np.ndarray) -> None:
    """Refuse samples, (n, channels), that are not finite.

    Raises
    ------
    SignalError
        It tells the first one.
    """
    bad = ~np.isfinite(values)
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        raise SignalError(
            f"data: {int(bad.sum())} samples are not finite, the first at row {row}, channel {column}; "
            "cut or repair the record first"
        )


def as_signal(signal: xr.DataArray | xr.Dataset, rate: float | None = None) -> xr.DataArray:
    """Bring a DataArray or a Dataset with a time dimension to the agreed form.

    A Dataset contributes each of its 1-D (time) variables as a channel, with the variable's `units`. The rate comes
    from `rate`, the attribute `sampling_rate`, or a uniform `time` coordinate: of dates, or of numbers in s
    or in the unit of time that its attribute `units` names.

    Raises
    ------
    MissingMetadataError
        If no rate can be had.
    SignalError
        If there is no time dimension or the time coordinate is not uniform.
    """
    import xarray as xr

    if isinstance(signal, xr.Dataset):
        variables = {str(k): v for k, v in signal.data_vars.items() if v.dims == ("time",)}
        if not variables:
            raise SignalError(f"signal: no variable has exactly the dimension 'time', got {dict(signal.sizes)}")
        stacked = np.stack([np.asarray(v.values, dtype=float) for v in variables.values()], axis=1)
        coords = {"time": signal.time} if "time" in signal.coords else {}
        units = [str(v.attrs.get("units", UNKNOWN_UNITS)) for v in variables.values()]
        array = xr.DataArray(
            stacked,
            dims=("time", "channel"),
            coords={**coords, "channel": list(variables), "units": ("channel", units)},
            attrs=signal.attrs,
        )
    else:
        array = signal
    if "time" not in array.dims or array.ndim > 2:
        raise SignalError(f"signal: must have dimensions (time, channel) or (time,), got {array.dims}")
    if array.ndim == 1:
        label = array.coords["channel"].item() if "channel" in array.coords else (array.name or "ch1")
        single = str(array.coords["units"].item()) if "units" in array.coords else None
        data: Any = array.values[:, None]
        names = [str(label)]
        unit_list: Any = [single or str(array.attrs.get("units", UNKNOWN_UNITS))]
    else:
        other = next(d for d in array.dims if d != "time")
        array = array.transpose("time", other)
        data = array.values
        names = [str(c) for c in array[other].values]
        unit_list = [str(u) for u in array["units"].values] if "units" in array.coords else None
        if unit_list is None:
            unit_list = array.attrs.get("units", UNKNOWN_UNITS)
    t0 = 0.0
    found = rate if rate is not None else array.attrs.get("sampling_rate")
    if "time" in array.coords:
        unit = str(array["time"].attrs.get("units", ""))
        if seconds_of(unit) is None:
            raise SignalError(
                f"time: its unit {unit!r} is none of time; set attrs['units'] of the coordinate, as to 's'"
            )
        times = in_seconds(array["time"].values, unit)
        t0 = float(times[0]) if times.size else 0.0
        span = float(times[-1] - times[0]) if times.size > 1 else 0.0
        if found is None and times.size > 1:
            found = uniform_rate(times)
        elif span > 0.0 and abs((times.size - 1) / span / check_rate(found) - 1.0) > ROUNDED_TIMES:
            said = "the attribute sampling_rate" if rate is None else "the call"
            raise SignalError(
                f"rate: the times have a rate of {(times.size - 1) / span:g} Hz, {said} says {check_rate(found):g} Hz; "
                "leave that out, or drop the coordinate time"
            )
    attrs = {k: v for k, v in array.attrs.items() if k not in ("sampling_rate", "speed", "teeth", "units")}
    result = make_signal(
        data,
        found,
        units=unit_list,
        channels=names,
        t0=t0,
        speed=array.attrs.get("speed"),
        teeth=array.attrs.get("teeth"),
        name=None if array.name is None else str(array.name),
        attrs=attrs,
    )
    return result.assign_coords({name: ("time", own.values, own.attrs) for name, own in shaft_coords(signal).items()})


def shaft_coords(signal: xr.DataArray | xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the coordinates of `SHAFT` that a signal has over time."""
    return {name: signal.coords[name] for name in SHAFT if name in signal.coords and signal[name].dims == ("time",)}


def uniform_rate(times: np.ndarray) -> float:
    """Sampling rate in Hz of uniform times in s; SignalError if they are not uniform to a twentieth of a step."""
    step = (times[-1] - times[0]) / (times.size - 1)
    if not step > 0.0:
        raise SignalError(f"time: must increase, got {times[0]!r} s to {times[-1]!r} s")
    # Times written with few digits are rounded to their last place, which is not an uneven clock.
    resolution = np.spacing(np.abs(times).max()) * 8
    deviation = np.abs(times - (times[0] + step * np.arange(times.size))).max()
    if deviation > CLOCK_TOLERANCE * step + resolution:
        raise SignalError(
            f"time: is not uniform, it strays {deviation / step:.3g} steps from a constant rate; "
            "pass rate=... if the times of a file are only rounded, resample the record otherwise"
        )
    return nice_rate(1.0 / step, step, times.size)


def nice_rate(rate: float, step: float, count: int) -> float:
    """The roundest rate whose clock agrees with `rate` to a twentieth of a sample over the record."""
    for digits in range(0, 7):
        candidate = round(rate, digits)
        if candidate > 0 and abs(1.0 / candidate - step) * count < CLOCK_TOLERANCE * step:
            return candidate
    return rate


def rate_of(signal: xr.DataArray) -> float:
    """Sampling rate in Hz."""
    rate = signal.attrs.get("sampling_rate")
    if rate is None and "time" in signal.coords and signal.sizes["time"] > 1:
        rate = uniform_rate(np.asarray(signal["time"].values, dtype=float))
    return check_rate(rate)


def units_of(signal: xr.DataArray) -> list[str]:
    """Unit of each channel (a list of one for a single channel)."""
    if "units" in signal.coords:
        return [str(u) for u in np.atleast_1d(signal.coords["units"].values)]
    count = signal.sizes.get("channel", 1)
    return [str(signal.attrs.get("units", UNKNOWN_UNITS))] * count


def common_unit(signal: xr.DataArray) -> str:
    """The unit all channels share, or "mixed"."""
    return _common(units_of(signal))


@overload
def require(signal: xr.DataArray, name: Literal["teeth"], value: Any = None, *, needed_for: str) -> tuple[int, ...]: ...


@overload
def require(signal: xr.DataArray, name: Literal["speed", "rate"], value: Any = None, *, needed_for: str) -> float: ...


def require(signal: xr.DataArray, name: str, value: Any = None, *, needed_for: str) -> float | tuple[int, ...]:
    """The metadata `name`, from `value` if given, else from the signal, else an error asking for it by name.

    Parameters
    ----------
    signal : xarray.DataArray
        The signal.
    name : {"speed", "teeth", "rate"}
        What is wanted.
    value : optional
        What the caller passed; wins over the signal's.
    needed_for : str
        Completes the message.

    Raises
    ------
    MissingMetadataError
    SignalError
        If a speed is wanted and the signal's varies over time.
    """
    if value is None and name == "speed":
        value = _one_speed(signal, needed_for)
    elif value is None:
        value = signal.attrs.get("sampling_rate" if name == "rate" else name)
    if value is None:
        raise MissingMetadataError(name, needed_for, REMEDIES[name])
    if name == "teeth":
        return check_teeth(value)
    return check_speed(value) if name == "speed" else check_rate(value)


def _one_speed(signal: xr.DataArray, needed_for: str) -> float | None:
    """Return the constant speed of a signal (rad/s), None without any; SignalError if it varies."""
    turning = shaft_coords(signal)
    if not turning or signal.sizes["time"] < 2:
        return signal.attrs.get("speed")
    own, times = next(iter(turning.values())).values, signal["time"].values
    speeds = own if "speed" in turning else np.abs(np.diff(own) / np.diff(times))
    mean = float(np.mean(speeds))
    if np.abs(speeds - mean).max(initial=0.0) <= STEADY * mean:
        return mean
    low, high = (float(bound) * 30.0 / math.pi for bound in (speeds.min(), speeds.max()))
    raise SignalError(
        f"speed: {needed_for} needs a constant one, that of the signal varies from {low:.5g} to {high:.5g} rpm; pass "
        "speed=... of the part that is meant, or use analyse or order_track, which follow it"
    )


def mesh_frequency(signal: xr.DataArray, speed: float | None = None, teeth: int | Sequence[int] | None = None) -> float:
    """Gear mesh frequency in Hz, z1 omega1 / (2 pi), from the signal's metadata or from what is passed."""
    omega = require(signal, "speed", speed, needed_for="the gear mesh frequency")
    return require(signal, "teeth", teeth, needed_for="the gear mesh frequency")[0] * omega / (2.0 * math.pi)


# attributes have names and values of the user's own
def with_metadata(signal: xr.DataArray, **changes: Any) -> xr.DataArray:
    """A copy that shares the samples, with `speed`, `teeth`, `units` or other attributes set."""
    result = signal.copy(deep=False)
    result.attrs = dict(signal.attrs)
    for key, value in changes.items():
        if key == "units":
            unit_list = _unit_list(value, [str(c) for c in np.atleast_1d(signal["channel"].values)])
            result = result.assign_coords(units=("channel", np.asarray(unit_list, dtype=str)))
            result.attrs["units"] = _common(unit_list)
        elif key == "speed":
            # what the signal says of its own turning would contradict
            result = result.drop_vars([name for name in SHAFT if name in result.coords])
            result.attrs["speed"] = check_speed(value)
        elif key == "teeth":
            result.attrs["teeth"] = check_teeth(value)
        elif key in ("rate", "sampling_rate"):
            raise SignalError("sampling_rate: cannot be relabelled; build the signal anew with make_signal(..., rate)")
        else:
            result.attrs[key] = value
    return result


def like(
    signal: xr.DataArray,
    values: np.ndarray,
    *,
    t0: float | None = None,
    rate: float | None = None,
    channels: Sequence[str] | None = None,
    **changes: Any,
) -> xr.DataArray:
    """A signal with new samples and all else of `signal`, with `changes` as for `with_metadata`.

    Parameters
    ----------
    values : ndarray of shape (n, channels)
    t0, rate : float, optional
        Start in s and rate in Hz where they differ from those of `signal`: its `speed` and `angle` over time are then
        those at the new times.
    channels : sequence of str, optional
        Names of the channels where they are others; their `units` are to be among the changes.
    """
    import xarray as xr

    rate = rate_of(signal) if rate is None else check_rate(rate)
    old = np.asarray(signal["time"].values, dtype=float)
    times = (float(old[0]) if t0 is None else t0) + np.arange(values.shape[0]) / rate
    units = units_of(signal) if channels is None else _unit_list(None, channels)
    result = xr.DataArray(
        values,
        dims=("time", "channel"),
        coords={
            "time": ("time", times, {"units": "s"}),
            "channel": signal["channel"].values if channels is None else np.asarray(channels, dtype=str),
            "units": ("channel", np.asarray(units, dtype=str)),
            **{name: ("time", _at(times, old, own.values), own.attrs) for name, own in shaft_coords(signal).items()},
        },
        name=signal.name,
        attrs={**signal.attrs, "sampling_rate": rate},
    )
    return with_metadata(result, **changes) if changes else result


def _at(times: np.ndarray, old: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values over the times `old` at others, of which few lie beyond the last: there they go straight on."""
    found = np.interp(times, old, values)
    beyond = times > old[-1]
    if old.size > 1 and beyond.any():
        found[beyond] = values[-1] + (times[beyond] - old[-1]) * (values[-1] - values[-2]) / (old[-1] - old[-2])
    return found


def trim(signal: xr.DataArray, start: float | None = None, stop: float | None = None) -> xr.DataArray:
    """The samples with start <= time < stop (s); SignalError if none are left."""
    times = signal["time"].values
    half = 0.5 / rate_of(signal)
    first = 0 if start is None else int(np.searchsorted(times, start - half))
    last = times.size if stop is None else int(np.searchsorted(times, stop - half))
    if last <= first:
        raise SignalError(f"trim: no samples in [{start}, {stop}) s, the record spans {times[0]:g} to {times[-1]:g} s")
    return signal.isel(time=slice(first, last))


def check_rate(rate: Any) -> float:
    """`rate` as a positive finite float, or an error that names it."""
    if rate is None:
        raise MissingMetadataError("rate", "a signal", REMEDIES["rate"])
    value = _number("rate", rate)
    if not (math.isfinite(value) and value > 0.0):
        raise SignalError(f"rate: must be a positive number of Hz, got {rate!r}")
    return value


def _number(field: str, value: Any) -> float:
    """`value` as a float, or an error that names its field."""
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise SignalError(f"{field}: give a number, got {value!r}") from None


def check_speed(speed: Any) -> float:
    """`speed` as a positive finite float (rad/s), or an error that names it."""
    value = _number("speed", speed)
    if not (math.isfinite(value) and value > 0.0):
        raise SignalError(f"speed: must be a positive number of rad/s, got {speed!r}")
    return value


def check_teeth(teeth: Any) -> tuple[int, ...]:
    """`teeth` as a tuple of positive ints, or an error that names it."""
    counts: Iterable[Any] = np.atleast_1d(teeth).ravel()
    result = []
    for count in counts:
        if (
            isinstance(count, bool | np.bool_)
            or not math.isfinite(float(count))
            or float(count) % 1
            or float(count) < 1
        ):
            raise SignalError(f"teeth: must be positive whole numbers, got {teeth!r}")
        result.append(int(count))
    if not result:
        raise SignalError("teeth: is empty; give the tooth count of at least one wheel")
    return tuple(result)


def _unit_list(units: str | Sequence[str] | Mapping[str, str] | None, names: Sequence[str]) -> list[str]:
    if units is None:
        return [UNKNOWN_UNITS] * len(names)
    if isinstance(units, str):
        return [units] * len(names)
    if isinstance(units, Mapping):
        stray = set(units) - set(names)
        if stray:
            raise SignalError(f"units: no channel is named {sorted(stray)}; the channels are {list(names)}")
        return [str(units.get(name, UNKNOWN_UNITS)) for name in names]
    result = [str(u) for u in units]
    if len(result) != len(names):
        raise SignalError(f"units: need one or {len(names)}, got {len(result)}")
    return result


def _common(units: Sequence[str]) -> str:
    return units[0] if len(set(units)) == 1 else MIXED_UNITS
