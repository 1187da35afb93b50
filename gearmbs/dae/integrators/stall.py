"""Find runs that go on without getting anywhere."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

WINDOW = 50_000
"""Steps that are looked at together."""
HOPELESS = 1e10
"""Steps to the end of the span, at the rate of the last window, from which on a run that does not speed up is ended.

The smallest models take a day for so many, and what is kept of each, 24 bytes, comes to 240 GB.
"""
REFUSED_WINDOW = 2_000
"""Steps looked at together where many are refused: some ten periods of a vibration, some hundred contacts."""
REFUSED = 0.04
"""Refused steps, as part of those accepted, from which on they count as many. A solution with continuous derivatives
has one in a thousand, a mechanism with contacts 6 %, a sliding motion on a jump 13 to 16 %."""
WINDOWS = 6
"""Such windows in a row, of which the second half has to go no more than twice as far as the first: 12 000 steps, 0.1 s
of a small compiled problem and 2 s of one in plain Python."""
LONG = 1e6
"""Steps to the end, at their rate, from which on the steps themselves are looked at."""
LOOK = 64
"""Steps that are looked at one by one."""
TOLERANCES_A_STEP = 10.0
"""Tolerances that an unknown on a jump of its rate may move by in a step. Implicit Euler across a jump J has the error
h J/2, less than a tolerance, so that it moves by about two; a solution that is resolved moves by hundreds."""
TURNS = LOOK // 8
"""Changes of sign of its rate, less the mean one, among these steps: a smooth solution in steps that follow it has a
dozen steps between two."""


class Chatter(NamedTuple):
    """An unknown that stays where its rate jumps.

    Attributes
    ----------
    unknown : int
    place : float
        Where it stays.
    low, high : float
        Between which its rate jumps.
    """

    unknown: int
    place: float
    low: float
    high: float


@dataclass
class StallWatch:
    """Progress over windows of steps.

    A start, a jump or an impact may take many small steps, but they grow again. Where the equations have no solution
    beyond some time, as where friction jams a joint, they do not: the integrator creeps towards that time for ever.
    Where a rate jumps and the solution stays on the jump, steps cross it by turns, refused and small, for ever.

    Attributes
    ----------
    steps : int
        Accepted steps at the start of the present window.
    t : float
        Time at the start of the present window.
    progress : float
        What the last whole window went; 0 before there is one.
    """

    steps: int
    t: float
    progress: float = 0.0
    _marks: deque[tuple[int, int, float]] = field(default_factory=lambda: deque(maxlen=WINDOWS + 1))
    _seen: list[tuple[float, np.ndarray, np.ndarray]] = field(default_factory=list)
    looking: bool = False

    def steps_needed(self, steps: int, t: float, t_end: float) -> float:
        """Return the steps from ``t`` to the end if the run is stalled, else 0.

        Stalled means that two whole windows have passed, that the second went no more than twice as far as the first,
        and that at this rate the end is more than `HOPELESS` steps away.
        """
        if steps - self.steps < WINDOW:
            return 0.0
        progress = t - self.t
        needed = (t_end - t) * (steps - self.steps) / progress if progress > 0.0 else float("inf")
        stalled = 0.0 < self.progress and progress <= 2.0 * self.progress and needed > HOPELESS
        self.steps, self.t, self.progress = steps, t, progress
        return needed if stalled else 0.0

    def watch_refused(self, steps: int, refused: int, t: float, t_end: float) -> None:
        """Decide whether the next steps are worth a look, from those accepted and those refused or begun afresh."""
        marks = self._marks
        if not marks:
            marks.append((steps, refused, t))
        last_steps, last_refused, _ = marks[-1]
        if self.looking or steps - last_steps < REFUSED_WINDOW:
            return
        if refused - last_refused < REFUSED * (steps - last_steps):
            marks.clear()
        marks.append((steps, refused, t))
        if len(marks) <= WINDOWS:
            return
        (s0, _, t0), (s1, _, t1), (s2, _, t2) = marks[0], marks[WINDOWS // 2], marks[-1]
        slow = t2 - t1 <= 2.0 * (t1 - t0) * (s2 - s1) / (s1 - s0)
        self.looking = slow and (t_end - t2) * (s2 - s0) > LONG * (t2 - t0)

    def look(self, t: float, y: np.ndarray, yp: np.ndarray, weight: np.ndarray) -> Chatter | None:
        """Look at one more step; after `LOOK` return the unknown that stays on a jump of its rate, None without one.

        Parameters
        ----------
        t : float
            End of a step.
        y, yp : ndarray, shape (n,)
            Unknowns and rates there.
        weight : ndarray, shape (n,)
            Reciprocal tolerances of the unknowns under error control, 0 of others.
        """
        self._seen.append((t, y.copy(), yp.copy()))
        if len(self._seen) <= LOOK:
            return None
        times, places, rates = (np.array(rows) for rows in zip(*self._seen, strict=True))
        self._seen.clear()
        self._marks.clear()
        self.looking = False
        mean = (places[-1] - places[0]) / (times[-1] - times[0])
        way = np.abs(np.diff(places, axis=0) - np.diff(times)[:, None] * mean).sum(axis=0) * weight
        turns = np.count_nonzero(np.diff(np.sign(rates - mean), axis=0), axis=0)
        # less than a tolerance in all the steps is rest, not chatter
        moved = np.where((way >= 1.0) & (way <= TOLERANCES_A_STEP * LOOK) & (turns >= TURNS), way, 0.0)
        worst = int(np.argmax(moved))
        if moved[worst] == 0.0:
            return None
        low, high = float(rates[:, worst].min()), float(rates[:, worst].max())
        return Chatter(worst, float(places[:, worst].mean()), low, high)
