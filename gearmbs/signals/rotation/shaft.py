"""The angle of a shaft from whatever is known of it: a phase, a tacho, a speed in any shape, or the signal's own."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.rotation.phase import phase_from_speed, phase_from_tacho
from gearmbs.signals.rotation.speed import (
    MIN_SCORE_DB,
    SpeedEstimate,
    prominence,
)
from gearmbs.signals.signal.given import is_curve, speed_curve, unit_factor
from gearmbs.signals.signal.labels import unit_of_rotation
from gearmbs.signals.signal.signal import rate_of
from gearmbs.signals.spectra import periodograms

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

    Returns
    -------
    xarray.DataArray
        Dimension (time,); attribute `notes`, where its sign was turned or values of the other sign were cut off.

    Raises
    ------
    SignalError
        If there is no such channel, its unit is not one of rotation, or the shaft turns back.
    """
    names = [str(c) for c in signal["channel"].values]
    if channel not in names:
        raise SignalError(f"speed_channel: there is no {channel!r}, only {names}")
    at = names.index(channel)
    unit = str(signal["units"].values[at]) if "units" in signal.coords else "unknown"
    if unit == "unknown" and "rpm" in channel.lower():
        unit = "rpm"
    try:
        factor = unit_factor(unit_of_rotation(channel, unit) or unit)
    except SignalError:
        raise SignalError(
            f"speed_channel: {channel!r} is in {unit!r}; say its unit, rpm, Hz or rad/s, with "
            f"units={{{channel!r}: 'rpm'}} (on the command line: --units '{channel}=rpm')"
        ) from None
    values = factor * np.asarray(signal.values[:, at], dtype=float)
    notes = []
    if values.mean() < 0.0:
        values = -values
        notes.append(f"The speed in {channel!r} is negative; its amount is taken, of a shaft that turns the other way.")
    back = values < -AT_REST * float(values.max())
    count = int(back.sum())
    if count > MOST_BACK * values.size:
        first = float(signal["time"].values[int(np.argmax(back))])
        raise SignalError(
            f"speed_channel: {channel!r} changes its sign, {100 * count / values.size:.3g} % of it have the other one, "
            f"the first at {first:g} s; cut the record where the shaft turns back, or give the amounts if only signs "
            "are wrong"
        )
    if count:
        notes.append(f"The speed in {channel!r} has the other sign in {count} samples, which are taken as rest.")
    return xr.DataArray(
        np.maximum(values, 0.0), dims=("time",), coords={"time": signal["time"].values},
        attrs={"units": "rad/s", **({"notes": notes} if notes else {})},
    )  # fmt: skip


def _given_angle(phase: Any) -> xr.DataArray:
    if not isinstance(phase, xr.DataArray) or phase.dims != ("time",):
        raise SignalError("phase: give the angle in rad as a DataArray of dimension time")
    values = np.asarray(phase.values, dtype=float)
    if not np.isfinite(values).all():
        raise SignalError("phase: holds angles that are not finite; cut or fill them first")
    return phase.copy(data=-values) if values[-1] < values[0] else phase


AT_REST = 0.02
"""Part of the highest speed up to which one of the other sign is noise at rest: offsets of converters are within it."""
MOST_BACK = 0.01
"""Share of samples of the other sign that are glitches: of more the shaft turns back, or signs are wrong."""


# The shaft of an analysis: its angle from tacho, known speed or mesh line, and remarks where a speed looks wrong.


SPEED_TOLERANCE = 0.02
"""How far from its nominal speed a drive is looked for, as a part of it."""
SAME_SHAFT = 0.5
"""Lines of the spectrum by which either of two orders of one shaft may seem to be off."""
VARYING = 0.02
"""A speed that strays more than this part from its mean is followed in angle, not in frequency."""
USUAL_RPM = (20.0, 12_000.0)
USUAL_RATE = (100.0, 2e6)
SHAFT_HARMONICS = 5


class Shaft(NamedTuple):
    """Angle of the reference shaft over time, its mean speed (rad/s) and where they are from."""

    phase: xr.DataArray
    speed: float
    origin: str
    estimate: SpeedEstimate | None = None
    range: tuple[float, float] | None = None
    """Lowest and highest speed, rad/s, where it varies."""

    @property
    def tacho(self) -> bool:
        """Whether the angle is that of a tacho, which moves with the lines if the sampling rate is wrong."""
        return self.origin.startswith("from the tacho")

    @property
    def integrated(self) -> bool:
        """Whether the angle is the integral of a speed, which adds up what that is off."""
        return self.origin.startswith(("from the channel", "from the given speed curve"))


class Known(NamedTuple):
    """What the caller knows of the shaft; fields as the settings of `analyse`."""

    speed: Any = None
    phase: xr.DataArray | None = None
    tacho: str | None = None
    pulses_per_rev: float = 1.0
    speed_channel: str | None = None
    speed_range: tuple[float, float] | None = None


def known_shaft(
    signal: xr.DataArray, known: Known, *, smooth: bool = False
) -> tuple[Shaft | float | None, xr.DataArray]:
    """The shaft where its angle is known, or a constant speed in rad/s, or None; and the channels left to analyse.

    Edges of a tacho are smoothed on request.

    Raises
    ------
    SignalError
        If what is given contradicts itself, or nothing is left to analyse.
    """
    helper = known.tacho or known.speed_channel
    nominal = _nominal(signal, known)
    if nominal is not None:
        return nominal, signal
    try:
        phase = (
            phase_from_tacho(signal, known.tacho, pulses_per_rev=known.pulses_per_rev, smooth=True)
            if smooth
            else shaft_phase(
                signal,
                known.speed,
                phase=known.phase,
                tacho=known.tacho,
                pulses_per_rev=known.pulses_per_rev,
                speed_channel=known.speed_channel,
            )
        )
    except MissingMetadataError:
        return None, signal
    rest = [c for c in signal["channel"].values.tolist() if c != helper]
    if not rest:
        word = "tacho" if known.tacho else "speed_channel"
        alone = (
            "; its torsional vibration is that of torsional_vibration(pulses_of_channel(signal, lines)), see "
            "docs/howto/transmission_error.md"
        ) * (known.tacho is not None)
        raise SignalError(f"{word}: {helper!r} is the only channel, nothing is left to analyse{alone}")
    times = phase["time"].values
    mean = float(phase.values[-1] - phase.values[0]) / float(times[-1] - times[0])
    origin = (
        f"from the tacho {known.tacho!r}"
        if known.tacho
        else f"from the channel {known.speed_channel!r}"
        if known.speed_channel
        else "from the given angle"
        if known.phase is not None
        else "from the given speed curve"
    )
    return Shaft(phase, mean, origin, None, _range(phase, mean)), signal.sel(channel=rest) if helper else signal


def _nominal(signal: xr.DataArray, known: Known) -> float | None:
    """The constant speed that is known and all that is, in rad/s."""
    others = [known.phase, known.tacho, known.speed_channel]
    given = known.speed
    if any(other is not None for other in others):
        return None
    if given is None:
        coordinates = any(n in signal.coords and signal.coords[n].dims == ("time",) for n in ("speed", "angle"))
        given = None if coordinates else signal.attrs.get("speed")
    if given is None or (isinstance(given, xr.DataArray) and given.attrs.get("units") == "rad"):
        return None
    if is_curve(given):
        times = signal["time"].values
        return speed_curve(given, span=(float(times[0]), float(times[-1]))).constant
    return float(speed_curve(given).values[0])


def remark_plausibility(signal: xr.DataArray, speed: float | None, estimated: bool, notes: list[str]) -> None:
    """Say clearly where a sampling rate or a speed is outside what machines and instruments have."""
    rate = rate_of(signal)
    if not USUAL_RATE[0] <= rate <= USUAL_RATE[1]:
        notes.append(f"CHECK THE RATE: {rate:g} Hz is unusual for vibration; every frequency here scales with it.")
    if speed is None:
        return
    rpm = speed * 30.0 / math.pi
    if not USUAL_RPM[0] * (1.0 - 1e-6) <= rpm <= USUAL_RPM[1] * (1.0 + 1e-6):
        cause = "the sampling rate, the tooth count or the mesh line may be wrong" if estimated else "check its unit"
        notes.append(
            f"CHECK THE SPEED: {rpm:.0f} rpm is outside {USUAL_RPM[0]:g} to {USUAL_RPM[1]:g} rpm; {cause}. "
            f"(Sampling rate {rate:g} Hz.)"
        )


def refined_speed(signal: xr.DataArray, nominal: float) -> tuple[float, list[int]] | None:
    """The speed (rad/s) within 2 % of a nominal one at which lines of the shaft's first orders stand out, or None.

    Returns
    -------
    (float, list of int) or None
        The speed, and at which orders lines say so: one is enough to take orders by, a family it is not.
    """
    rate, n = rate_of(signal), signal.sizes["time"]
    power, _ = periodograms(signal.values, rate, n, "hann", 0.0, True, "power")
    height = prominence(power).max(axis=1)
    width = rate / n
    shaft = nominal / math.tau
    # at the ends of the reach a line is spread over those beside it
    reach = SPEED_TOLERANCE * shaft + 0.5 * width
    span = SPEED_TOLERANCE * shaft + width
    if shaft < 8.0 * width:
        return None
    candidates = np.linspace(
        shaft - span, shaft + span, max(9, 2 * math.ceil(8.0 * SHAFT_HARMONICS * span / width) + 1)
    )
    total = np.zeros_like(candidates)
    present = 0
    for k in range(1, SHAFT_HARMONICS + 1):
        if k * (shaft + span) < rate / 2:
            total += np.interp(k * candidates / width, np.arange(height.size), height) ** 2
            present += 1
    if not present:
        return None
    best = int(np.argmax(total))
    if math.sqrt(total[best] / present) < MIN_SCORE_DB:
        return None
    coarse = float(candidates[np.isclose(total, total[best])].mean())
    refined, orders = _from_peaks(power.max(axis=1), height, coarse, width)
    return (refined * math.tau, orders) if orders and abs(refined - shaft) <= reach else None


def _from_peaks(power: np.ndarray, height: np.ndarray, shaft: float, width: float) -> tuple[float, list[int]]:
    """Shaft frequency (Hz) from the peaks beside its first multiples, higher ones counting more, and which stand.

    The surest of them, whose variance is the least, k^2 times its power by the noise, says which others are the
    shaft's: of noise one in some dozens of lines is as high as the least that counts.
    """
    peaks = {}
    for k in range(1, SHAFT_HARMONICS + 1):
        middle = round(k * shaft / width)
        if middle + 3 >= power.size or middle < 3:
            continue
        i = middle - 2 + int(np.argmax(power[middle - 2 : middle + 3]))
        if height[i] < MIN_SCORE_DB or power[i] < max(power[i - 1], power[i + 1]):
            continue
        a, b, c = np.log(np.maximum(power[i - 1 : i + 2], 1e-300))
        curve = a - 2.0 * b + c
        shift = float(np.clip(0.5 * (a - c) / curve, -0.5, 0.5)) if curve < 0.0 else 0.0
        peaks[k] = (i + shift) * width, k * 10.0 ** (0.05 * height[i])
    if not peaks:
        return shaft, []
    surest = max(peaks, key=lambda k: peaks[k][1])
    sure = peaks[surest][0] / surest
    orders = [k for k, (at, _) in peaks.items() if abs(at / k - sure) <= SAME_SHAFT * width * (1.0 / k + 1.0 / surest)]
    return sum(peaks[k][0] for k in orders) / sum(orders), orders


def _range(phase: xr.DataArray, mean: float) -> tuple[float, float] | None:
    """Lowest and highest speed (rad/s), over stretches of 1/200 of the record, if it varies."""
    low, high = _slowest_fastest(phase)
    return (low, high) if strays(phase, mean) > VARYING else None


def strays(phase: xr.DataArray, mean: float) -> float:
    """Part of its mean by which a speed strays from it, over stretches of 1/200 of the record."""
    low, high = _slowest_fastest(phase)
    return max(high - mean, mean - low) / mean


def _slowest_fastest(phase: xr.DataArray) -> tuple[float, float]:
    at = np.linspace(0, phase.size - 1, min(201, phase.size)).astype(int)
    speeds = np.diff(phase.values[at]) / np.diff(phase["time"].values[at])
    return float(speeds.min()), float(speeds.max())
