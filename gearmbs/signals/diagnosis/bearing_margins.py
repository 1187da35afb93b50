"""Margins of a verdict on bearings: speeds that may be off, and motions that sound bearings make.

**Speed.** Where the shaft's own line is not found, a record is judged at speeds all over the tolerance of the told one,
and else at those that the width of its lines leaves. A part is named if no other leads at any of them, and if it is at
half of them at least; otherwise it is uncertain, and so is a part that would be named beside the middle speed only.
A told speed may also be wrong. So the shaft's line is looked for within 6 %, too, and the record is judged where it
stands. Without one, a part whose lines are clear at a speed beyond the tolerance is told, but not accused.
A sampling rate told wrongly by a factor moves all lines by it. So where no part is named, a part whose lines are clear
at a plain multiple of the told speed, and at no other, is told in the same way.

**Level.** The stiffness of a sound bearing changes as elements pass through the load (varying compliance), and waves of
its rings do the same. Where nothing hides them, as in a calculation or on a quiet rig, the lines of that motion are as
clear as those of a defect. But the motion is smooth. Its lines die away, while blows reach far above their own rate:
from twenty times the line on, the modulated part of the acceleration of a housing along the load is 1e-5 to 8e-3 m/s^2
RMS with sound bearings and 0.7 to 45 m/s^2 with spalls of 0.3 to 1.5 mm (deep groove ball bearings 6205 and 6208 on a
rig of 3 kg at 600 to 3600 rpm and 200 to 2500 N; docs/howto/bearings.md). The limit lies between them and above what
accelerometers resolve, some 3e-3 m/s^2. Across the load and under heavy ones a sound bearing makes up to 0.17 m/s^2
(6305, 6308, 300 to 1800 rpm, a fifth of C), where the slow motion meets a mode of the housing; but then its own line
and the next four are there as well: the modulated part is 0.3 to 3.1 times these, with spalls 20 to 800 times along the
load, and in public recordings of outer races 2.7 times and more, all of them above 1.8 m/s^2. Only lines that stand
alone count, the first of them and two more at least, and none for more than the first: a mesh, the mains or an order
of the shaft at one of these places is no stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.fft

from gearmbs.signals.diagnosis.bearing_judgement import (
    CLEAR,
    CLEAR_CHANCE,
    PARENTS,
    SHIFTED,
    SIGNS,
    SPEED_SHARE,
    UNCERTAIN,
    EnvelopeSpectrum,
    Judged,
)
from gearmbs.signals.diagnosis.bearing_report import CAGE
from gearmbs.signals.diagnosis.bearing_speed import TOLERANCE, ShaftSpeed, far_shaft, find_shaft, tried_speeds

CARRIERS = 20.0
"""Carriers above so many times a line show blows; below, smooth motions have lines, too."""
LEAST_LEVEL = 0.03
"""m/s^2 RMS of the part of the carriers that a line modulates, from which it accuses."""
STIFFNESS, OF_OWN, OWN_LINES = 0.5, 4.0, 5
"""m/s^2 RMS below which lines of an outer race accuse only from so many times the RMS of the first of its lines in the
record itself on: those are what the stiffness that varies makes."""
LEAST_OWN, FALL = 3, 3.0
"""Of these lines the first and so many in all must stand alone, and the first counts for so many times the next at
most. Where stiffness made them (6205, 6208, 6305, 6308, 300 to 1800 rpm), all five stood, and the first was 1.1 to 1.5
times the highest of the others."""
STANDS, BESIDE = 4.0, 30
"""Medians of the lines beside it from which a line of an envelope stands: of noise alone the largest of three is as
high, sqrt(log2(3/p)), with the probability p of 5e-5; and how many lines to either side these are."""
LEAST_AGREEMENT = 0.5
"""Share of the speeds at which a part must be named."""
SHIFTS = (-0.03, 0.03, -0.05, 0.05)
"""Shares by which a told speed is tried to be wrong: with the windows of slip about them they reach to 6.5 % without a
gap, as far as a shaft's own line is looked for."""


RATES = (2.0, 0.5, 4.0, 0.25)
"""Factors by which a sampling rate is told wrongly: that of another channel, of a filter's band, or a file that was
decimated (records at 12 and 48 kHz stand beside each other). Those of sound cards, 44.1 and 48 kHz, are left out: they
would put public recordings in doubt whose rate is right (CWRU, inner races of 0.028 in)."""


Verdicts = tuple[tuple[Judged, ...], ...]
"""By channel, of each part in the same order."""


@dataclass(frozen=True)
class Answer:
    """What a record says of a told speed."""

    speed: ShaftSpeed
    judged: Verdicts

    @property
    def leading(self) -> Judged | None:
        """The part that is named first."""
        return leading(self.judged)


def leading(judged: Verdicts) -> Judged | None:
    """Return the part that is named first: clear before signs, a cage last, then by chance."""
    named = [one for channel in judged for one in channel if one.grade in (CLEAR, SIGNS)]
    order = sorted(named, key=lambda j: (j.grade != CLEAR, j.part == CAGE, j.evidence.log_chance))
    return order[0] if order else None


@dataclass(frozen=True)
class Weighed:
    """What a record says of a told speed and of those beside it.

    Attributes
    ----------
    answers : list of Answer
        To speeds told within the tolerance, rising.
    verdicts : tuple of tuple of Judged
    remark : str or None
        What is wrong with the told speed.
    """

    answers: list[Answer]
    verdicts: Verdicts
    remark: str | None = None

    @property
    def speed(self) -> ShaftSpeed:
        """The told speed and the one that is used."""
        return self.answers[len(self.answers) // 2].speed


def weigh(
    spectra: Sequence[EnvelopeSpectrum],
    told: float,
    tolerance: float,
    others: Sequence[float],
    judge_at: Callable[[float], Iterator[Sequence[Judged]]],
    timed: bool = False,
    curve: bool = False,
) -> Weighed:
    """Judge a record at the told speed, at those within its tolerance, and where its shaft's own line stands.

    Parameters
    ----------
    spectra : sequence of EnvelopeSpectrum
        Of the record and of its envelope, in which the shaft's own line is looked for.
    told, tolerance
        Hz, and the share by which it may be off; 0 if it is exact.
    others : sequence of float
        Ratios of the machine's other shafts.
    judge_at : callable
        Returns what is judged at a speed in Hz, by channel.
    timed : bool
        Whether the angle of the shaft is known, whatever the sampling rate is.
    curve : bool
        Whether that angle is only that of a speed told over time, which a family of the shaft's orders may confirm.
    """
    answers = answers_at(tried_speeds(spectra, told, tolerance), judge_at, SPEED_SHARE)
    near = Weighed(answers, verdicts_of(answers))
    if curve and not find_shaft(spectra, told).found:
        return replace(near, verdicts=_shifted(near, told, TOLERANCE, judge_at, SHIFTS))
    if timed:
        return near
    if near.speed.found or tolerance <= 0.0:
        return replace(near, verdicts=_shifted(near, told, tolerance, judge_at, ()))
    far = far_shaft(spectra, told, tolerance, others)
    if not far.found:
        return replace(near, verdicts=_shifted(near, told, tolerance, judge_at, SHIFTS))
    (there,) = answers_at([far], judge_at, SPEED_SHARE)
    own, other = leading(near.verdicts), leading(there.judged)
    lines = f"CHECK THE SPEED: lines such as a shaft's own stand at {60 * far.turns:.1f} rpm"
    # lines that are whole multiples of the shaft that was found are its own, whatever they were taken for
    share = SPEED_SHARE + far.doubt / far.turns
    if own is None or _in_step(own, far.turns, share):
        beside = f"{100 * -far.deviation:+.1f} % beside these, and all is judged there"
        return Weighed(
            [replace(there, speed=replace(far, told=answer.speed.told)) for answer in answers],
            there.judged,
            f"{lines}; the told {60 * told:.1f} rpm are {beside}.",
        )
    same = other is None or (own.lines, own.part) == (other.lines, other.part)
    verdicts = tuple(
        tuple(one if same and not _in_step(one, far.turns, share) else _doubted(one) for one in channel)
        for channel in near.verdicts
    )
    return Weighed(answers, verdicts, f"{lines}, and none at the told {60 * told:.1f} rpm, at which all is judged.")


def _doubted(judged: Judged) -> Judged:
    """Return a part as uncertain if it is named."""
    return replace(judged, grade=UNCERTAIN, beside=False) if judged.grade in (CLEAR, SIGNS) else judged


def _shifted(
    near: Weighed,
    told: float,
    tolerance: float,
    judge_at: Callable[[float], Iterator[Sequence[Judged]]],
    shifts: Sequence[float],
) -> Verdicts:
    """Return the verdicts, with the part whose lines are clear at a speed beyond the tolerance if none is named.

    A cage, whose lines are never called clear, counts where they are no noise, after all other parts. It says nothing
    of the sampling rate: at multiples of its turns many things stand.
    """
    if any(one.grade in (CLEAR, SIGNS, UNCERTAIN) for channel in near.verdicts for one in channel):
        return near.verdicts

    def found_at(speed: float, cages: bool) -> list[tuple[Judged, int, int]]:
        return [
            (one, c, p)
            for c, channel in enumerate(judge_at(speed))
            for p, one in enumerate(channel)
            if (one.grade == CLEAR and (cages or one.part != CAGE))
            or (cages and one.part == CAGE and one.grade == SIGNS and one.evidence.log_chance <= CLEAR_CHANCE)
            if not _in_step(one, told, tolerance)
        ]

    found = [each for shift in shifts for each in found_at(told * (1.0 + shift), True)]
    found = found or [each for factor in RATES for each in found_at(told * factor, False)]
    if not found:
        return near.verdicts
    one, c, p = min(found, key=lambda each: (each[0].part == CAGE, each[0].evidence.log_chance))
    kinematic = one.lines.orders[one.part] * one.lines.ratio * told
    shown = replace(one, grade=SHIFTED, evidence=replace(one.evidence, kinematic=kinematic))
    channels = [list(channel) for channel in near.verdicts]
    channels[c][p] = shown
    return tuple(map(tuple, channels))


def _in_step(judged: Judged, told: float, tolerance: float) -> bool:
    """Return whether lines are in step with a shaft's told turns.

    Those of blades are at whole multiples; where a cage's would be, those of looseness are at multiples of a half to a
    sixth.
    """
    turns = judged.evidence.found / (told * judged.lines.ratio)
    parts = np.arange(1, PARENTS + 1) if judged.part == CAGE else np.ones(1)
    return bool((np.abs(parts * turns - np.round(parts * turns)) <= tolerance * parts * turns).any())


def answers_at(
    speeds: Sequence[ShaftSpeed], judge_at: Callable[[float], Iterator[Sequence[Judged]]], same: float
) -> list[Answer]:
    """Return the answer to each told speed.

    Parameters
    ----------
    speeds : sequence of ShaftSpeed
        Speeds that are the same within a share are judged once. One that was found is judged at what it may be off,
        too, and what does not stand there is uncertain.
    judge_at : callable
        Returns what is judged at a speed in Hz, by channel.
    same : float
    """
    known: list[Answer] = []
    answers = []
    for speed in speeds:
        like = next((a for a in known if abs(a.speed.turns / speed.turns - 1.0) <= same), None)
        if like is None:
            beside = (-speed.doubt, 0.0, speed.doubt) if speed.found else (0.0,)
            verdicts = [tuple(tuple(judged) for judged in judge_at(speed.turns + off)) for off in beside]
            like = Answer(speed, agreed(verdicts))
            known.append(like)
        answers.append(replace(like, speed=speed))
    return answers


def verdicts_of(answers: Sequence[Answer]) -> Verdicts:
    """Return what stands of the told speed in the middle, and, unless it was found, of those beside it."""
    middle = answers[len(answers) // 2]
    return middle.judged if middle.speed.found else agreed([answer.judged for answer in answers])


def agreed(verdicts: Sequence[Verdicts]) -> Verdicts:
    """Return what stands at the middle one of rising speeds and at those beside it.

    A part is named if it is at half of the speeds, if no other is named first at any of them, and if its lines are in
    step with the shaft at none. Further parts beside a leader are named by their own share.
    """
    middle = verdicts[len(verdicts) // 2]
    first = [found for found in map(leading, verdicts) if found is not None]
    leaders = {(one.lines, one.part) for one in first}

    def graded(c: int, p: int, own: Judged) -> Judged:
        named = [v[c][p] for v in verdicts if v[c][p].grade in (CLEAR, SIGNS)]
        if not named:
            return own
        often = len(named) >= LEAST_AGREEMENT * len(verdicts)
        in_step = any(v[c][p].fraction is not None for v in verdicts)
        if own.grade in (CLEAR, SIGNS) and often and not in_step and (len(leaders) == 1 or own.part == CAGE):
            clear = sum(one.grade == CLEAR for one in named) >= LEAST_AGREEMENT * len(verdicts)
            return replace(own, grade=CLEAR if clear and own.grade == CLEAR else SIGNS)
        shown = own if own.grade in (CLEAR, SIGNS) else min(named, key=lambda one: one.evidence.log_chance)
        return replace(shown, grade=UNCERTAIN, beside=False, fraction=None)

    return tuple(tuple(graded(c, p, own) for p, own in enumerate(channel)) for c, channel in enumerate(middle))


def carriers_from(line: float, top: float) -> float:
    """Return from which frequency carriers of a line are looked at, below a top, Hz."""
    return min(CARRIERS * line, 0.5 * top)


def own_level(values: np.ndarray, rate: float, line: float, turns: Sequence[float] = ()) -> float:
    """Return the RMS of what the stiffness that varies may make of a line and the next four in a record itself.

    Parameters
    ----------
    values : ndarray, shape (n,)
    rate, line : float
        Hz.
    turns : sequence of float
        Of the machine's shafts, Hz.

    Returns
    -------
    float
        In the units of the record; 0 unless the first line and two more stand alone, see `own_lines`. None counts for
        more than the first, and the first for no more than three times the next, as it is where stiffness makes them:
        what stands higher is a mesh, the mains or another shaft at the same place.
    """
    heights = own_lines(values, rate, line, turns)
    if heights[0] == 0.0 or np.count_nonzero(heights) < LEAST_OWN:
        return 0.0
    first = min(float(heights[0]), FALL * float(heights[1:].max()))
    return math.sqrt(0.5 * float(np.sum(np.minimum(heights, first) ** 2)))


def own_lines(values: np.ndarray, rate: float, line: float, turns: Sequence[float] = ()) -> np.ndarray:
    """Return the amplitudes of a line and the next four in a record itself, 0 of those that do not stand alone.

    A line stands alone if it is higher than the lines of noise beside it, if its top lies within a line of the
    spectrum of its place, which the flank of another's does not, and if it is no nearer to whole turns of a shaft.

    Parameters
    ----------
    values : ndarray, shape (n,)
    rate, line : float
        Hz.
    turns : sequence of float
        Hz.
    """
    n = values.size
    window = np.hanning(n)
    height = 2.0 * np.abs(scipy.fft.rfft((values - values.mean()) * window)) / window.sum()
    found = np.zeros(OWN_LINES)
    for k in range(OWN_LINES):
        place = (k + 1) * line * n / rate
        low = max(round(place) - 1, 1)
        near = height[low : low + 3]
        if low + 3 >= height.size:
            break
        top = low + int(np.argmax(near))
        a, b, c = height[top - 1 : top + 2]
        beside = height[max(2, top - BESIDE) : top + BESIDE + 1]
        if b < max(a, c) or b < STANDS * float(np.median(beside)):
            continue
        # two lines of a Hann window give the place between them, shifted by (2 r - 1) / (r + 1) with their ratio r
        side, step = (c, 1.0) if c > a else (a, -1.0)
        at = top + step * max((2.0 * side - b) / (side + b), 0.0)
        steps = [turn * n / rate for turn in turns]
        if all(abs(at - place) <= abs(at - step * round(at / step)) for step in steps):
            found[k] = b
    return found


def modulated_level(
    values: np.ndarray,
    rate: float,
    line: float,
    bands: Callable[..., Iterator[tuple[np.ndarray, float]]],
    top: float,
    *,
    standing: bool = False,
) -> float:
    """Return the RMS of the part of a record, far above a line, that the line modulates.

    Parameters
    ----------
    values : ndarray, shape (n,)
    rate : float
        Hz.
    line : float
        Hz.
    bands : callable
        Called as bands(values, (low, high)), it yields squared envelopes in bands beside each other.
    top : float
        Hz, up to which the record is looked at. Carriers count from its middle at the latest.
    standing : bool
        Whether only bands count in whose envelope the line stands in the lines beside it.

    Returns
    -------
    float
        In the units of the record. Noise adds to it, so that it is an upper limit.
    """
    n = values.size
    window = np.hanning(n) * math.sqrt(8.0 / 3.0)
    total = 0.0
    for square, _ in bands((values - values.mean()) * window, (carriers_from(line, top), top)):
        spectrum = np.abs(scipy.fft.rfft(square))
        place = round(line * n / rate)
        height = float(spectrum[place - 1 : place + 2].max(initial=0.0))
        if standing and height < STANDS * float(np.median(spectrum[max(2, place - BESIDE) : place + BESIDE + 1])):
            continue
        depth = 2.0 * height / float(spectrum[0])
        # bands come with the spectrum's scale: two samples a line, one side of the spectrum
        power = 2.0 * float(spectrum[0]) * square.size / n**2
        total += power * min(depth, 1.0)
    return math.sqrt(total)
