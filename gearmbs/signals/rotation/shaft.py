"""The angle of a shaft from whatever is known of it: a phase, a tacho, a speed in any shape, or the signal's own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.rotation.phase import phase_from_line, phase_from_speed, phase_from_tacho
from gearmbs.signals.rotation.rate import MISCOUNTED, other_rate, other_teeth
from gearmbs.signals.rotation.speed import (
    MIN_QUALITY,
    MIN_SCORE_DB,
    SAME_COMB,
    SIDEBANDS,
    Comb,
    SpeedEstimate,
    find_comb,
    followed_comb,
    line_near,
    own_lines_missing,
    prominence,
)
from gearmbs.signals.rotation.sweep import remark_sweep, remark_wander
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
OTHER_COMB = 0.03
"""Relative difference of speeds up to which two combs mean one: a little more than `SPEED_TOLERANCE`, within which the
given one is looked for."""
LINES_OFF = 2.0
"""Lines of the whole record's spectrum by which a mesh line may be off: there a Hann window leaves nothing of it."""
SIDEBAND_TURNS = 0.5
"""Turns of the shaft beside the expected mesh frequency from which a line is nearer to one of its sidebands."""
STRONGER_DB = 3.0
"""By which another comb must be higher to count as stronger: scores of one record scatter by less."""
SHARED_HARMONIC = 2
"""Combs of which one has lines in common with the other's harmonics up to this one are not told apart."""
USUAL_RPM = (20.0, 12_000.0)
USUAL_RATE = (100.0, 2e6)
SHAFT_HARMONICS = 5
FOLLOWED_TURNS = 30.0
"""Revolutions that the filter of `phase_from_line` with its default width takes, 26, and some more to follow."""


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


class Known(NamedTuple):
    """What the caller knows of the shaft; fields as the settings of `analyse`."""

    speed: Any = None
    phase: xr.DataArray | None = None
    tacho: str | None = None
    pulses_per_rev: float = 1.0
    speed_channel: str | None = None
    speed_range: tuple[float, float] | None = None


def known_shaft(signal: xr.DataArray, known: Known) -> tuple[Shaft | float | None, xr.DataArray]:
    """The shaft where its angle is known, or a constant speed in rad/s, or None; and the channels left to analyse.

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
        phase = shaft_phase(
            signal,
            known.speed,
            phase=known.phase,
            tacho=known.tacho,
            pulses_per_rev=known.pulses_per_rev,
            speed_channel=known.speed_channel,
        )
    except MissingMetadataError:
        return None, signal
    rest = [c for c in signal["channel"].values.tolist() if c != helper]
    if not rest:
        word = "tacho" if known.tacho else "speed_channel"
        raise SignalError(f"{word}: {helper!r} is the only channel, nothing is left to analyse")
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


def mesh_shaft(
    signal: xr.DataArray, counts: Sequence[int], known: Known, notes: list[str]
) -> tuple[Shaft, xr.DataArray]:
    """The shaft of a pair whose tooth counts are known, found from the mesh line where nothing else is known.

    Raises
    ------
    SignalError
        If nothing is known of the speed and no mesh line stands out.
    """
    teeth = tuple(counts)
    found, signal = known_shaft(signal, known)
    if isinstance(found, float):
        notes += getattr(known.speed, "attrs", {}).get("notes", ())
        shaft = _near_speed(signal, teeth, found, notes)
    elif found is not None:
        shaft = found
        notes += shaft.phase.attrs.get("notes", ())
        if shaft.range is None:
            compare_with_mesh(signal, teeth, shaft, notes)
    else:
        estimate = followed_comb(signal, teeth, known.speed_range)
        if estimate.doubt:
            notes.append(estimate.doubt)
        if estimate.phase is None:
            notes.append(_why_constant(signal, estimate.speed, "The mesh line is too weak to follow in phase"))
        phase = phase_from_speed(signal, estimate.speed) if estimate.phase is None else estimate.phase
        shaft = Shaft(phase, estimate.speed, "estimated from the mesh line", estimate)
    remark_plausibility(signal, shaft.speed, found is None, notes)
    if (found is None or isinstance(found, float)) and (shaft.estimate is None or shaft.estimate.phase is None):
        notes += remark_sweep(signal, shaft.speed, teeth)
    if shaft.phase.attrs.get("origin") == "line":
        notes += remark_wander(signal, shaft.speed, teeth[0])
    return shaft, signal


def compare_with_mesh(signal: xr.DataArray, counts: tuple[int, ...], shaft: Shaft, notes: list[str]) -> None:
    """Say so where the mesh line contradicts a speed from a channel, a tacho, a curve or an angle.

    Where the speed varies the signal is that over the angle, sampled as at the mean speed.
    """
    found = _estimate(signal, counts, (shaft.speed * (1.0 - SPEED_TOLERANCE), shaft.speed * (1.0 + SPEED_TOLERANCE)))
    hint = " Or the tacho has another number of pulses a turn (pulses_per_rev=, --pulses)." if shaft.tacho else None
    if _remark_other(signal, counts, shaft.speed, found, notes, hint):
        return
    gmf = shaft.speed * counts[0] / math.tau
    if _turns(signal, shaft.speed) >= FOLLOWED_TURNS and line_near(signal, gmf, SPEED_TOLERANCE) is None:
        notes.append(_nothing_near(counts[0], shaft.speed, False) + f" It is used as it is, {shaft.origin}.")
    elif found is not None and found.phase is not None:
        told = f"{shaft.speed * 30 / math.pi:.2f} rpm {shaft.origin}"
        notes += _remark_off(found, shaft.speed, gmf, told, shaft.range is not None)


def _remark_off(found: SpeedEstimate, speed: float, gmf: float, told: str, varying: bool) -> list[str]:
    """Say so where the mesh line is off the speed (rad/s) by which angles are taken."""
    off, rpm = found.speed / speed - 1.0, found.speed * 30 / math.pi
    if abs(off) * gmf <= LINES_OFF * found.resolution:
        return []
    mean, alone = ("on average ", "") if varying else ("", f", or give speed='{rpm:.2f} rpm' alone")
    return [
        f"CHECK THE SPEED: the mesh line is {mean}at {rpm:.2f} rpm, {100 * off:+.2f} % off the {told}, by which orders "
        f"and averages are taken. Calibrate it{alone}."
    ]


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


def _near_speed(signal: xr.DataArray, counts: tuple[int, ...], nominal: float, notes: list[str]) -> Shaft:
    """Return the angle by the mesh line near a given speed, or at that speed where none stands out, which is told."""
    around = (nominal * (1.0 - SPEED_TOLERANCE), nominal * (1.0 + SPEED_TOLERANCE))
    found = _estimate(signal, counts, around)
    if found is not None and (beside := _turns_beside(found, counts[0], nominal)):
        found = _not_a_sideband(signal, counts, nominal, found, beside, notes)
    doubted = _remark_other(signal, counts, nominal, found, notes)
    sure = found is not None and not doubted
    gmf = nominal * counts[0] / math.tau
    line = gmf if sure else line_near(signal, gmf, SPEED_TOLERANCE)
    if line is None and _turns(signal, nominal) >= FOLLOWED_TURNS:
        notes.append(_nothing_near(counts[0], nominal, doubted) + " It is taken as constant.")
        return Shaft(phase_from_speed(signal, nominal), nominal, "as given")
    if found is not None and found.phase is not None:
        words = f"from the mesh line, {100 * (found.speed / nominal - 1):+.3f} % off the given speed"
        return Shaft(found.phase, found.speed, words, found)
    phase = None
    if line is not None:
        with suppress(SignalError):
            phase = phase_from_line(signal, line, counts[0])
    if phase is not None and phase.attrs["quality"] >= MIN_QUALITY:
        followed = float(phase.attrs["mean_speed"])
        if abs(followed / nominal - 1) < SPEED_TOLERANCE:
            return Shaft(phase, followed, "from the given speed, followed by the mesh line")
    notes.append(_why_constant(signal, nominal, "No mesh line could be followed near the given speed"))
    if found is not None and not doubted and _turns(signal, nominal) < FOLLOWED_TURNS:
        line, turn = line_near(signal, gmf, SPEED_TOLERANCE), nominal / math.tau
        # whole turns from the mesh stand its sidebands, of planetary sets higher than itself
        sideband = abs((found.gmf - gmf + 0.5 * turn) % turn - 0.5 * turn) <= found.resolution
        if line is not None and abs(line - found.gmf) <= found.resolution and not sideband:
            notes += _remark_off(found, nominal, gmf, f"{nominal * 30 / math.pi:.2f} rpm given", False)
    return Shaft(phase_from_speed(signal, nominal), nominal, "as given")


def _turns_beside(found: SpeedEstimate, count: int, nominal: float) -> float:
    """Return by how many turns of the shaft a line is beside the mesh frequency of the given speed; 0 below a half."""
    turns = (found.gmf - nominal * count / math.tau) / (nominal / math.tau)
    return turns if abs(turns) > SIDEBAND_TURNS else 0.0


def _not_a_sideband(
    signal: xr.DataArray,
    counts: tuple[int, ...],
    nominal: float,
    found: SpeedEstimate,
    beside: float,
    notes: list[str],
) -> SpeedEstimate | None:
    """Return the line by which the speed is taken, where the highest stands turns of the shaft beside the expected one.

    Whole turns beside the mesh frequency stand its sidebands, of planetary sets higher than itself, if it is there at
    all: a line exactly there confirms the given speed more than it speaks against it. Elsewhere it may be either.
    """
    whole = round(beside)
    told = f"{nominal * 30 / math.pi:.2f} rpm"
    exact = abs(beside - whole) * nominal / math.tau <= LINES_OFF * found.resolution
    miscounted = abs(whole) <= MISCOUNTED
    kind = f"{abs(beside):.3g} turns of the shaft {'above' if beside > 0 else 'below'} that of the given {told}"
    if not exact:
        notes.append(
            f"The highest line near the mesh frequency is {kind}, and the speed is taken by it. If it "
            "is a sideband, as planetary sets have, pass planetary= or a tacho."
        )
        return found
    notes.append(
        f"The highest line near the mesh frequency is {kind}: a sideband, as planetary sets have (planetary=). The "
        f"given speed is kept; if {found.speed * 30 / math.pi:.2f} rpm is right, give that"
        + (f"; if the wheel has {counts[0] + whole} teeth, not {counts[0]}, it is the mesh." if miscounted else ".")
    )
    half = SIDEBAND_TURNS / counts[0]
    return _estimate(signal, counts, (nominal * (1.0 - half), nominal * (1.0 + half)))


def _nothing_near(count: int, nominal: float, doubted: bool) -> str:
    """Say that the record does not confirm a speed, and ask for it unless it was `doubted` before."""
    return (
        f"{'No' if doubted else 'CHECK THE SPEED: no'} mesh line was found within {100 * SPEED_TOLERANCE:g} % "
        f"of the given speed ({nominal * 30 / math.pi:.1f} rpm, {nominal * count / math.tau:.2f} Hz with {count} teeth)"
        ", none that stands out from the noise and other lines. Is it the speed of the wheel with these teeth, in its "
        "right unit?"
    )


def _turns(signal: xr.DataArray, speed: float) -> float:
    return signal.sizes["time"] / rate_of(signal) * speed / math.tau


def _why_constant(signal: xr.DataArray, speed: float, otherwise: str) -> str:
    """Say why the speed is taken as constant: short records have nothing to follow it by, whatever their lines."""
    turns = _turns(signal, speed)
    if turns < FOLLOWED_TURNS:
        return (
            f"The speed is taken as constant: a record of {turns:.3g} revolutions is too short to follow the mesh line "
            f"in phase, which takes {FOLLOWED_TURNS:g}."
        )
    return f"{otherwise}; the speed is taken as constant."


def _estimate(
    signal: xr.DataArray, counts: tuple[int, ...], around: tuple[float, float] | None
) -> SpeedEstimate | None:
    try:
        return followed_comb(signal, counts, around)
    except SignalError:
        return None


def _remark_other(
    signal: xr.DataArray,
    counts: tuple[int, ...],
    nominal: float,
    found: SpeedEstimate | None,
    notes: list[str],
    hint: str | None = None,
) -> bool:
    """Say so where the record, left to itself, shows another mesh frequency more clearly than near the given speed.

    Returns
    -------
    bool
        Whether the given speed is in doubt.
    """
    try:
        blind = find_comb(signal, counts, speed_range=None)
    except SignalError:
        return False
    # a sideband within the tolerance may have been taken for a mesh line that lies just beyond it
    apart = nominal if found is None else found.speed
    if abs(blind.speed / apart - 1.0) < (OTHER_COMB if found is None else SAME_COMB):
        return False
    ratio = blind.speed / nominal
    here = "no mesh line" if found is None else f"only a comb of {found.score:.0f} dB"
    if found is not None and blind.score >= found.score + STRONGER_DB and not _related(blind, found):
        notes.append(
            f"Near the given speed there is a mesh line at {found.gmf:.2f} Hz ({found.score:.0f} dB), but one of "
            f"{blind.score:.0f} dB at {blind.gmf:.2f} Hz is stronger: another stage of the gearbox, or, with "
            f"{counts[0]} teeth, {blind.speed * 30 / math.pi:.1f} rpm."
        )
        return False
    if found is not None and blind.score < found.score + STRONGER_DB:
        # half the speed has every line of the whole one among its own, and nearly its score
        whole = round(ratio)
        if (
            whole < 2
            or abs(ratio / whole - 1.0) > SPEED_TOLERANCE
            or not own_lines_missing(signal, found.gmf, blind.gmf)
        ):
            return False
        here = "hardly a line at the mesh frequency itself"
    notes.append(
        f"CHECK THE SPEED: near the given {nominal * 30 / math.pi:.1f} rpm there is {here}, but the record shows one "
        f"of {blind.score:.0f} dB at {blind.gmf:.2f} Hz, which with {counts[0]} teeth is "
        f"{blind.speed * 30 / math.pi:.1f} rpm ({ratio:.3f} times the given speed)."
        f"{other_teeth(ratio, counts[0])}{other_rate(signal, ratio) if hint is None else hint}"
    )
    return True


def _related(blind: Comb, found: SpeedEstimate) -> bool:
    """Whether the lines of a comb may be harmonics, part orders or sidebands of another one's mesh line.

    Combs at two to three, say, share every other line, which makes a comb where there is none.
    """
    ratio = max(blind.gmf / found.gmf, found.gmf / blind.gmf)
    if any(abs(k * ratio / round(k * ratio) - 1.0) < SPEED_TOLERANCE for k in range(1, SHARED_HARMONIC + 1)):
        return True
    apart = abs(blind.gmf - found.gmf)
    turns = (blind.speed / math.tau, found.speed / math.tau)
    return any(abs(apart - k * shaft) < SPEED_TOLERANCE * shaft * k for shaft in turns for k in range(1, SIDEBANDS + 1))


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
    span = SPEED_TOLERANCE * shaft
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
    if math.sqrt(total[best] / present) < MIN_SCORE_DB or best in (0, candidates.size - 1):
        return None
    coarse = float(candidates[np.isclose(total, total[best])].mean())
    refined, orders = _from_peaks(power.max(axis=1), height, coarse, width)
    return (refined * math.tau, orders) if orders else None


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
        if height[i] < MIN_SCORE_DB:
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
    at = np.linspace(0, phase.size - 1, min(201, phase.size)).astype(int)
    speeds = np.diff(phase.values[at]) / np.diff(phase["time"].values[at])
    low, high = float(speeds.min()), float(speeds.max())
    return (low, high) if max(high - mean, mean - low) > VARYING * mean else None
