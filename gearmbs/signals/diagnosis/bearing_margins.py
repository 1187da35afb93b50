"""Margins of a verdict on bearings: speeds that may be off, and motions that sound bearings make.

**Speed.** Where the shaft's own line is not found, a record is judged at speeds all over the tolerance of the told one,
and else at those that the width of its lines leaves. A part is named if no other leads at any of them, and if it is at
half of them at least; otherwise it is uncertain, and so is a part that would be named beside the middle speed only.

**Level.** The stiffness of a sound bearing changes as elements pass through the load (varying compliance), and waves of
its rings do the same. Where nothing hides them, as in a calculation or on a quiet rig, the lines of that motion are as
clear as those of a defect. But the motion is smooth. Its lines die away, while blows reach far above their own rate:
from twenty times the line on, the modulated part of the acceleration of a housing is 1e-5 to 8e-3 m/s^2 RMS with sound
bearings and 0.7 to 45 m/s^2 with spalls of 0.3 to 1.5 mm (deep groove ball bearings 6205 and 6208 on a rig of 3 kg at
600 to 3600 rpm and 200 to 2500 N; docs/howto/bearings.md). The limit lies between them and above what accelerometers
resolve, some 3e-3 m/s^2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.fft

from gearmbs.signals.diagnosis.bearing_judgement import CLEAR, SIGNS, UNCERTAIN, Judged
from gearmbs.signals.diagnosis.bearing_report import CAGE
from gearmbs.signals.diagnosis.bearing_speed import ShaftSpeed

CARRIERS = 20.0
"""Carriers above so many times a line show blows; below, smooth motions have lines, too."""
LEAST_LEVEL = 0.03
"""m/s^2 RMS of the part of the carriers that a line modulates, from which it accuses."""
LEAST_AGREEMENT = 0.5
"""Share of the speeds at which a part must be named."""


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


def modulated_level(
    values: np.ndarray, rate: float, line: float, bands: Callable[..., Iterator[tuple[np.ndarray, float]]], top: float
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

    Returns
    -------
    float
        In the units of the record. Noise adds to it, so that it is an upper limit.
    """
    n = values.size
    window = np.hanning(n) * math.sqrt(8.0 / 3.0)
    total = 0.0
    for square, _ in bands((values - values.mean()) * window, (min(CARRIERS * line, 0.5 * top), top)):
        spectrum = np.abs(scipy.fft.rfft(square))
        place = round(line * n / rate)
        depth = 2.0 * float(spectrum[place - 1 : place + 2].max(initial=0.0)) / float(spectrum[0])
        # bands come with the spectrum's scale: two samples a line, one side of the spectrum
        power = 2.0 * float(spectrum[0]) * square.size / n**2
        total += power * min(depth, 1.0)
    return math.sqrt(total)
