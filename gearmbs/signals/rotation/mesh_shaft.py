"""The shaft of a pair by its mesh line, and speeds that are told held against it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.angular import angular_resample
from gearmbs.signals.rotation.phase import phase_from_line, phase_from_speed
from gearmbs.signals.rotation.rate import MISCOUNTED, other_rate, other_teeth
from gearmbs.signals.rotation.shaft import SPEED_TOLERANCE, Known, Shaft, known_shaft, remark_plausibility, strays
from gearmbs.signals.rotation.speed import (
    HARMONICS,
    MIN_QUALITY,
    SAME_COMB,
    SIDEBANDS,
    Comb,
    SpeedEstimate,
    find_comb,
    followed_comb,
    line_near,
    own_lines_missing,
)
from gearmbs.signals.rotation.spread import remark_spread
from gearmbs.signals.rotation.sweep import remark_sweep, remark_wander
from gearmbs.signals.signal.signal import make_signal, rate_of, units_of

OTHER_COMB = 0.03
"""Relative difference of speeds up to which two combs mean one: a little more than `SPEED_TOLERANCE`, within which the
given one is looked for."""
SCATTERED, UNSURE = 0.1, 0.2
"""Radians of the mesh by which edges of a tacho may scatter, half a percent of the line, 4 % of its third harmonic; and
that may be left of it, 2 % of the line."""
SWINGS, BESIDE_MESH, FLOOR_FROM = 0.05, 0.75, 2.5
"""Part of the mesh line that what stands beside it may take before that is told; turns of the shaft to either side
where this is looked for, short of the sidebands of whole turns; and those up to which the noise is taken."""
LEAST_OFF = 0.05
"""The same from which an angle is calibrated: sinc of it is 0.4 % of the line."""
MEASURED = 5e-3
"""Share by which a measured speed may be off to be calibrated: displays and converters are within it, and lines of
other machines seldom."""
NEVER_FADES = 0.3
"""Quality (`phase_from_line`) of a line by which a speed is calibrated: two that beat fade, and neither is followed."""
TOLD_APART, BOTH = 4.0, 0.25
"""Lines of the spectrum from which two lines are told apart, where a Hann window lets through 0.3 %, and the part of
the one from which the other stands, too."""
BLOCKS, SMOOTHED = 512, 25
"""Parts of a record by which lines beside each other are told, and how many of these are averaged."""
NEAR_LINE, LEAST_APART = 0.4, 0.5
"""Lines of the spectrum by which that of two that was found may be off: the other pulls it; and those below which two
are one."""
FOLLOWED = 0.1
"""Turns of the shaft by which the mesh line may wander to be followed; `phase_from_line` follows it by 0.15."""
LINES_OFF = 2.0
"""Lines of the whole record's spectrum by which a mesh line may be off: there a Hann window leaves nothing of it."""
SIDEBAND_TURNS = 0.5
"""Turns of the shaft beside the expected mesh frequency from which a line is nearer to one of its sidebands."""
STRONGER_DB = 3.0
"""By which another comb must be higher to count as stronger: scores of one record scatter by less."""
SHARED_HARMONIC = 2
"""Combs of which one has lines in common with the other's harmonics up to this one are not told apart."""
FOLLOWED_TURNS = 30.0
"""Revolutions that the filter of `phase_from_line` with its default width takes, 26, and some more to follow."""


def mesh_shaft(
    signal: xr.DataArray, counts: Sequence[int], known: Known, notes: list[str]
) -> tuple[Shaft, xr.DataArray]:
    """The shaft of a pair whose tooth counts are known, found from the mesh line where nothing else is known.

    Raises
    ------
    SignalError
        If nothing is known of the speed and no mesh line stands out.
    """
    teeth, whole = tuple(counts), signal
    found, signal = known_shaft(signal, known)
    if isinstance(found, float):
        notes += getattr(known.speed, "attrs", {}).get("notes", ())
        shaft = _near_speed(signal, teeth, found, notes)
    elif found is not None:
        notes += found.phase.attrs.get("notes", ())
        if found.tacho and float(found.phase.attrs["scatter"]) * teeth[0] > SCATTERED:
            found = _of_scattered_edges(whole, signal, teeth[0], known, found, notes)
        shaft = _calibrated(signal, teeth, found, notes) if found.integrated else found
        if found.integrated and _turns(signal, shaft.speed) >= FOLLOWED_TURNS:
            over = _over_angle(signal, shaft, teeth[0])
            notes += remark_spread(over, shaft.speed, teeth[0], shaft.origin)
        if found.range is None and not found.integrated:
            notes += _unlike_mesh(signal, teeth, shaft)
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


def _of_scattered_edges(
    whole: xr.DataArray, signal: xr.DataArray, teeth: int, known: Known, shaft: Shaft, notes: list[str]
) -> Shaft:
    """Return the shaft by a tacho's smoothed edges, where the mesh stands out more by these, and say so.

    The mesh line says whether edges scatter or the shaft does: over the right angle it is the larger.
    """
    scatter = float(shaft.phase.attrs["scatter"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        other, _ = known_shaft(whole, known, smooth=True)
    assert isinstance(other, Shaft)
    if _mesh_power(signal, other, teeth) <= _mesh_power(signal, shaft, teeth):
        return shaft
    left = float(other.phase.attrs["scatter"]) * teeth
    kept = math.exp(-0.5 * left**2)
    unsure = left > UNSURE
    if (lost := _lost_beside(signal, other, teeth)) > max(SWINGS, 1.0 - kept):
        notes.append(
            f"CHECK THE SPEED: the edges of the tacho {known.tacho!r} scatter by {scatter / math.tau * 100:.2g} % of a "
            f"turn ({math.degrees(scatter * teeth):.0f} deg of the mesh); over the smoothest course through them the "
            f"mesh line is still about {100 * lost:.2g} % lower than together with what stands within {BESIDE_MESH:g} "
            "turns beside it, and its harmonics more: the shaft swings between the pulses, which they do not show. "
            "Look at the levels in bands, take more pulses a turn, or the speed alone (speed=), near which the mesh "
            "line is then followed."
        )
        return other
    notes.append(
        f"{'CHECK THE SPEED: ' if unsure else ''}The edges of the tacho {known.tacho!r} scatter by "
        f"{scatter / math.tau * 100:.2g} % of a turn ({math.degrees(scatter * teeth):.0f} deg of the mesh), which is "
        f"not the speed: the smoothest course through them is taken. What it leaves takes about {100 * (1 - kept):.2g} "
        "% from the line at the mesh"
        + (
            ", more from its harmonics: look at the levels in bands, or take a steeper edge, more pulses a turn, or "
            "the speed alone (speed=), near which the mesh line is then followed."
            if unsure
            else "."
        )
    )
    return other


def _mesh_power(signal: xr.DataArray, shaft: Shaft, teeth: int) -> float:
    """Return the power of the first mesh harmonics over an angle, as a share of each channel's."""
    times, values = signal["time"].values, signal.values
    first, last = np.searchsorted(times, shaft.phase["time"].values[[0, -1]])
    part = values[first : last + 1] - values[first : last + 1].mean(axis=0)
    angle = shaft.phase.values[: len(part)]
    part = part[: angle.size]
    weight = np.hanning(angle.size)[:, None] * part
    lines = [np.abs(np.exp(-1j * teeth * k * angle) @ weight) ** 2 for k in range(1, HARMONICS + 1)]
    return float(np.sum(np.sum(lines, axis=0) / np.maximum(np.sum(part**2, axis=0), 1e-300)))


def _lost_beside(signal: xr.DataArray, shaft: Shaft, teeth: int) -> float:
    """Return the share by which a mesh line over an angle is lower than with what stands close beside it, above noise.

    Of the channel in which the mesh is the largest part. An angle that does not follow the shaft spreads the line so.
    """
    over = _over_angle(signal, shaft, teeth)
    values = over.values - over.values.mean(axis=0)
    power = np.abs(np.fft.rfft(np.hanning(len(values))[:, None] * values, axis=0)) ** 2
    step = rate_of(over) / len(values) / (shaft.speed / math.tau)
    away = np.abs(np.arange(len(power)) * step - teeth)
    line = power[away <= LINES_OFF * step].sum(axis=0)
    best = int(np.argmax(line / np.maximum(power.sum(axis=0), 1e-300)))
    near, floor = (away > LINES_OFF * step) & (away < BESIDE_MESH), (away >= BESIDE_MESH) & (away < FLOOR_FROM)
    if not near.any() or line[best] == 0.0:
        return 0.0
    noise = float(np.median(power[floor, best])) / math.log(2.0)
    beside = max(float(power[near, best].sum()) - noise * np.count_nonzero(near), 0.0)
    return 1.0 - math.sqrt(float(line[best]) / (float(line[best]) + beside))


def _unlike_mesh(signal: xr.DataArray, counts: tuple[int, ...], shaft: Shaft) -> list[str]:
    """Say so where the mesh line contradicts a speed, of a tacho only if it does so over its angle, too.

    A shaft that swings spreads its mesh over time into sidebands higher than itself.
    """
    notes: list[str] = []
    compare_with_mesh(signal, counts, shaft, notes)
    if not notes or not shaft.tacho:
        return notes
    over: list[str] = []
    found = compare_with_mesh(_over_angle(signal, shaft, counts[0]), counts, shaft, over)
    return notes if over or found is None else []


def compare_with_mesh(
    signal: xr.DataArray, counts: tuple[int, ...], shaft: Shaft, notes: list[str]
) -> SpeedEstimate | None:
    """Say so where the mesh line contradicts a speed from a channel, a tacho, a curve or an angle; return the line.

    Where the speed varies the signal is that over the angle, sampled as at the mean speed.
    """
    found = _estimate(signal, counts, (shaft.speed * (1.0 - SPEED_TOLERANCE), shaft.speed * (1.0 + SPEED_TOLERANCE)))
    hint = " Or the tacho has another number of pulses a turn (pulses_per_rev=, --pulses)." if shaft.tacho else None
    if _remark_other(signal, counts, shaft.speed, found, notes, hint):
        return None
    gmf = shaft.speed * counts[0] / math.tau
    if _turns(signal, shaft.speed) >= FOLLOWED_TURNS and line_near(signal, gmf, SPEED_TOLERANCE) is None:
        notes.append(_nothing_near(counts[0], shaft.speed, False) + f" It is used as it is, {shaft.origin}.")
        return None
    if found is None or found.phase is None:
        return None
    if not shaft.integrated:
        told = f"{shaft.speed * 30 / math.pi:.2f} rpm {shaft.origin}"
        notes += _remark_off(found, shaft.speed, gmf, told, shaft.range is not None)
    return found


def _calibrated(signal: xr.DataArray, counts: tuple[int, ...], shaft: Shaft, notes: list[str]) -> Shaft:
    """Return the angle of a speed over time, calibrated by the mesh line: it adds up what the speed is off.

    Where the speed varies by more than a line can be followed by, the line is looked for in angle.
    """
    phase, teeth = shaft.phase, counts[0]
    steady = strays(phase, shaft.speed) < FOLLOWED / teeth
    over = signal if steady else _over_angle(signal, shaft, teeth)
    found = compare_with_mesh(over, counts, shaft, notes)
    if found is None or found.phase is None:
        return shaft
    times = found.phase["time"].values[[0, -1]]
    told = shaft.speed * float(times[1] - times[0])
    if steady:
        told = float(np.diff(np.interp(times, phase["time"].values, phase.values))[0])
    off = float(found.phase.values[-1] - found.phase.values[0]) / told - 1.0
    lines = abs(off) * shaft.speed * teeth / math.tau / found.resolution
    if lines < LEAST_OFF:
        return shaft
    gmf, own = shaft.speed * teeth / math.tau, f"{shaft.speed * 30 / math.pi:.2f} rpm {shaft.origin}"
    fades = float(found.phase.attrs["quality"]) < NEVER_FADES
    if fades or abs(off) > MEASURED or _turns_beside(found, teeth, shaft.speed):
        notes += _remark_off(found, shaft.speed, gmf, own, shaft.range is not None)
        return shaft
    if _stands_beside(_over_angle(signal, shaft, teeth) if steady else over, gmf, off, lines):
        notes.append(
            f"CHECK THE SPEED: lines stand at the mesh of {own} and {100.0 * off:+.2f} % off it, one of which is "
            "something else's. The speed is used as it is."
        )
        return shaft
    check = "CHECK THE SPEED: " if lines > LINES_OFF else ""
    notes.append(
        f"{check}By the mesh line the speed {shaft.origin} is {-100.0 * off:+.3f} % off, on average: it is calibrated "
        "by this line, which orders and averages would have lost."
    )
    low_high = None if shaft.range is None else (shaft.range[0] * (1.0 + off), shaft.range[1] * (1.0 + off))
    same = (phase * (1.0 + off)).assign_attrs(phase.attrs)
    return shaft._replace(phase=same, speed=shaft.speed * (1.0 + off), range=low_high)


def _stands_beside(over: xr.DataArray, gmf: float, off: float, lines: float) -> bool:
    """Return whether a line stands at a mesh frequency (Hz) beside that which is a share off it, in any channel.

    Those that a window does not tell apart, so many lines of the spectrum from each other, are fitted together: of two
    the sum beats, of one that wanders it does not.
    """
    if lines < TOLD_APART:
        return any(_two_lines(x, math.tau * gmf / rate_of(over), off, lines) for x in over.values.T)
    angle = math.tau * gmf / rate_of(over) * np.arange(over.sizes["time"])
    window = np.hanning(angle.size)
    turning, moved = np.exp(-1j * angle), np.exp(-1j * (1.0 + off) * angle)
    return any(abs((window * x) @ turning) > BOTH * abs((window * x) @ moved) for x in over.values.T)


def _two_lines(values: np.ndarray, told: float, off: float, lines: float) -> bool:
    """Return whether two lines beat, one at an angle a sample (rad), the other a share off it.

    Means over blocks of the record, turned back by the told line, hold both as slow turns; that of the other line is
    found where least is left.
    """
    count = min(BLOCKS, values.size // 2)
    size = values.size // count
    turned = (values[: count * size] - values.mean()) * np.exp(-1j * told * np.arange(count * size))
    slow = turned.reshape(count, size).mean(axis=1)
    turn = math.tau * np.arange(count) / count
    best = (math.inf, np.zeros(2, dtype=complex))
    for beside in math.copysign(1.0, off) * (lines + NEAR_LINE * np.linspace(-1.0, 1.0, 13)):
        if abs(beside) < LEAST_APART:
            continue
        terms = np.stack([np.ones(count), np.exp(1j * beside * turn)], axis=1)
        found, *_ = np.linalg.lstsq(terms, slow, rcond=None)
        left = float(np.sum(np.abs(slow - terms @ found) ** 2))
        best = min(best, (left, found), key=lambda one: one[0])
    here, there = np.abs(best[1])
    if here <= BOTH * there:
        return False
    # one line that wanders has another line's part there, too, but an even height
    smooth = np.abs(np.convolve(slow, np.hanning(SMOOTHED + 2)[1:-1] / (0.5 * (SMOOTHED + 1)), "valid"))
    return float(np.ptp(np.percentile(smooth, [5.0, 95.0]))) > BOTH * float(smooth.mean())


def _over_angle(signal: xr.DataArray, shaft: Shaft, teeth: int) -> xr.DataArray:
    """Return a record over the angle, as if the shaft turned at its mean speed."""
    per_rev = 1 << math.ceil(math.log2(2.5 * teeth * (HARMONICS + 1)))
    angular = angular_resample(signal, shaft.phase, samples_per_rev=per_rev)
    names = [str(c) for c in angular["channel"].values]
    return make_signal(angular.values, per_rev * shaft.speed / math.tau, channels=names, units=units_of(signal))


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
