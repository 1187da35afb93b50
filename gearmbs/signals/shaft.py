"""The angle of a shaft from whatever is known of it: a phase, a tacho, a speed in any shape, or the signal's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from .errors import MissingMetadataError, SignalError
from .phase import phase_from_speed, phase_from_tacho
from .speed_curve import unit_factor

REMEDY = "pass speed='1500 rpm', a curve over time, speed_channel=..., tacho=... or phase=..."


def shaft_phase(
    signal: xr.DataArray,
    speed: Any = None,
    *,
    phase: xr.DataArray | None = None,
    tacho: str | None = None,
    pulses_per_rev: float = 1.0,
    speed_channel: str | None = None,
    needed_for: str = "order tracking",
) -> xr.DataArray:
    """Angle of the shaft over time, from the one thing that is known of it.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    speed : optional
        As for `speed_curve`. A DataArray in rad is taken as the angle.
    phase : xarray.DataArray, optional
        The angle itself, rad.
    tacho : str, optional
        Channel with pulses, `pulses_per_rev` of them a revolution (`phase_from_tacho`).
    speed_channel : str, optional
        Channel that holds the speed, in its own unit (rpm, Hz, rad/s).
    needed_for : str
        Completes the message where nothing is known.

    Returns
    -------
    xarray.DataArray
        rad, dimension (time,). Without any of these it comes from the signal's coordinate `angle` (rad) or `speed`
        (rad/s) over time, or from its attribute `speed`.

    Raises
    ------
    MissingMetadataError
        If nothing is known of the speed.
    SignalError
        If more than one is given, or what is given cannot be read.
    """
    given = {"speed": speed, "phase": phase, "tacho": tacho, "speed_channel": speed_channel}
    named = [name for name, value in given.items() if value is not None]
    if len(named) > 1:
        raise SignalError(f"{' and '.join(named)}: give one of them, not {len(named)}")
    if isinstance(speed, xr.DataArray) and str(speed.attrs.get("units")) == "rad":
        phase = speed
    if phase is not None:
        return _given_angle(phase)
    if tacho is not None:
        return phase_from_tacho(signal, tacho, pulses_per_rev=pulses_per_rev)
    if speed_channel is not None:
        return phase_from_speed(signal, speed_of_channel(signal, speed_channel))
    if speed is None:
        own = signal.coords.get("angle")
        if own is not None and own.dims == ("time",):
            return _given_angle(own.reset_coords(drop=True))
        own = signal.coords.get("speed")
        if own is not None and own.dims == ("time",):
            speed = own.reset_coords(drop=True)
        else:
            speed = signal.attrs.get("speed")
    if speed is None:
        raise MissingMetadataError("speed", needed_for, REMEDY)
    return phase_from_speed(signal, speed)


def speed_of_channel(signal: xr.DataArray, channel: str) -> xr.DataArray:
    """The speed (rad/s) that a channel of the record holds, negative noise at rest cut off at zero.

    Raises
    ------
    SignalError
        If there is no such channel, or its unit is not one of rotation.
    """
    names = [str(c) for c in signal["channel"].values]
    if channel not in names:
        raise SignalError(f"speed_channel: there is no {channel!r}, only {names}")
    at = names.index(channel)
    unit = str(signal["units"].values[at]) if "units" in signal.coords else "unknown"
    if unit == "unknown" and "rpm" in channel.lower():
        unit = "rpm"
    try:
        factor = unit_factor(unit)
    except SignalError:
        raise SignalError(
            f"speed_channel: {channel!r} is in {unit!r}; say its unit, rpm, Hz or rad/s, with "
            f"units={{{channel!r}: 'rpm'}} (on the command line: --units '{channel}=rpm')"
        ) from None
    values = factor * np.asarray(signal.values[:, at], dtype=float)
    values = -values if values.mean() < 0.0 else values
    return xr.DataArray(
        np.maximum(values, 0.0), dims=("time",), coords={"time": signal["time"].values}, attrs={"units": "rad/s"}
    )


def _given_angle(phase: Any) -> xr.DataArray:
    if not isinstance(phase, xr.DataArray) or phase.dims != ("time",):
        raise SignalError("phase: give the angle in rad as a DataArray of dimension time")
    values = np.asarray(phase.values, dtype=float)
    if not np.isfinite(values).all():
        raise SignalError("phase: holds angles that are not finite; cut or fill them first")
    return phase.copy(data=-values) if values[-1] < values[0] else phase
