"""A solution handed on piece by piece while the integration goes, so that a long run needs no memory for its steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.model.system import System
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult, Status

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members
from gearmbs.dae.results.solution import CONFLICT_SAMPLES, PART_SIZE, Solution
from gearmbs.dae.results.watched import Steps, Watch

WATCHED_PART_SIZE = 8192
"""Steps of a part that is read instead of evaluated."""
AXIS_PART_SIZE = 1024
"""The same where nothing has to be prepared for a part, since all bodies turn about fixed axes."""


class Stream:
    """Consumer of an integrator's steps that hands them on as solutions.

    Parameters
    ----------
    system : System
    problem : DAEProblem
    t_end : float
        End of the run, s.
    consumer : callable
        Called as ``consumer(part)`` with a `Solution` of some accepted steps, in the order of time. It is valid until
        the next call: parts share their memory. Forces and accelerations are evaluated when first asked for.

    members : Members, optional
        Of bodies that are integrated as one.
    watch : Watch, optional
        Of ``problem``: what is read of the steps themselves, the same methods return then.

    Attributes
    ----------
    part_size : int
        About how many steps a part has.
    conflict : str or None
        The first violation found of a constraint row removed as redundant.
    """

    def __init__(
        self,
        system: System,
        problem: DAEProblem,
        t_end: float,
        consumer: Callable[[Solution], None],
        members: Members | None = None,
        watch: Watch | None = None,
    ) -> None:
        nothing = np.empty((0, problem.n))
        result = DAEResult(np.empty(0), nothing, nothing, Status.SUCCESS, "")
        self.whole = Solution(system, problem, result, members)
        self.part_size = PART_SIZE if members is None or not len(members.turn) else AXIS_PART_SIZE
        self.whole.share(2 * self.part_size)
        if watch is not None and watch.readers:
            self.part_size = WATCHED_PART_SIZE
        self.consumer = consumer
        self.watch = watch
        self.conflict: str | None = None
        self.interval = (t_end - problem.t0) / CONFLICT_SAMPLES
        self.next_look = problem.t0

    def __call__(self, t: np.ndarray, y: np.ndarray, idata: np.ndarray) -> None:
        """Hand on accepted steps, whose watched numbers stand behind the unknowns, and the table valid for them."""
        n = self.whole.problem.n
        # in equal parts: a small rest would cost as much beside its evaluation as a full part
        size = -(-t.size // max(1, round(t.size / self.part_size)))
        for k in range(0, t.size, size):
            rows = y[k : k + size]
            part = self.whole.over(t[k : k + size], rows[:, :n], [(0, idata)])
            if self.watch is not None:
                part.at_steps = self.watch.read(Steps(rows[:, :n], rows[:, n:], idata))
            if self.conflict is None and part.t[-1] >= self.next_look:
                self.next_look = float(part.t[-1]) + self.interval
                self.conflict = part.find_conflict(np.array([part.t.size - 1]))
            self.consumer(part)

    def close(self, solution: Solution) -> Solution:
        """Give what was found on the way to the solution that the run ended with, and return it."""
        solution.note_conflict(self.conflict)
        return solution
