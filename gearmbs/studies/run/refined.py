"""Runs that are made finer until they are as accurate as asked: the loop that cases, drivetrains and sets share.

Each run has a twin whose errors are larger, and what the two differ by tells those of the run itself. If these are more
than asked, the next run is so much finer, and the run before may be its twin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np

from gearmbs.dae.methods import INTEGRATORS

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism import Mechanism

COARSER = 10.0
"""Tolerance of the twin over that of the run: a decade."""

ATTEMPTS = 3
"""Runs at most, each at a tolerance of a tenth or less of the one before, which is its twin."""

AIMED = 0.5
"""Part of what is asked that the next run aims at, and that errors may have which a finer run mends if others stay."""

LEFT_TO_TWIN = 0.25
"""Part of the settling of a train or a set behind which its twin starts: what a flywheel behind a soft clutch does
otherwise in the twin takes as long to come about as what it does behind a run-up to die out."""

LEAST_PART = 1e-3
"""Of its tolerance, to which a run is made finer at once."""


class Judgement(Protocol):
    """What the difference of a run and its twin tells.

    Attributes
    ----------
    worst : float
        Largest error, as a part of what it is judged by.
    mendable : float
        What a finer run has in it, as such a part.
    """

    @property
    def worst(self) -> float: ...

    @property
    def mendable(self) -> float: ...


class Settings(Protocol):
    """To what a run is made."""

    @property
    def tolerance(self) -> float: ...


P = TypeVar("P", bound=Settings)
R = TypeVar("R")
J = TypeVar("J", bound=Judgement)


@dataclass(frozen=True)
class Made(Generic[P, R]):
    """A run: to what it was made, and what came of it."""

    settings: P
    result: R


@dataclass(frozen=True)
class Behind:
    """A run that its twin starts from where it has settled: both go on along one motion, each to its own accuracy.

    Attributes
    ----------
    mechanism : Mechanism
    solution : Solution
        With a state that was kept, if its integrator keeps any.
    slices : object
        Of the faces: what is equal for equal ones.
    """

    mechanism: Mechanism
    solution: Solution
    slices: Any = None

    def start(self, slices: Any = None) -> dict[str, Any]:
        """Return the keywords by which a twin with some slices of the faces is simulated; none if it begins at rest."""
        kept = self.solution.result.kept
        if kept is None:
            return {}
        state = self.solution.state_at(kept.t)
        if slices == self.slices:
            return {"mechanism": self.mechanism, "initial": state, "assembled": self.solution}
        return {"initial": state}


def keeping(integrator: str, time: float) -> dict[str, Any]:
    """Return the keywords by which a run keeps its state at a time, s, for a `Behind`, if its integrator does."""
    return {"keep_at": time} if INTEGRATORS[integrator].can("keep_at") else {}


@dataclass(frozen=True)
class Refined(Generic[P, R, J]):
    """The last run, its twin, and what they tell."""

    fine: Made[P, R]
    twin: Made[P, R]
    judged: J


def refined(
    first: P,
    run: Callable[[P], R],
    twin_of: Callable[[Made[P, R], Made[P, R] | None], Made[P, R]],
    judge: Callable[[Made[P, R], Made[P, R]], J],
    finer: Callable[[P, float], P],
    wanted: float,
    least: float,
) -> Refined[P, R, J]:
    """Return the first run that is as accurate as asked, or the last.

    Parameters
    ----------
    first : object
        To what the first run is made.
    run : callable
    twin_of : callable
        ``twin_of(fine, before)`` returns the twin of a run; ``before`` is the run before it, if there was one.
    judge : callable
        ``judge(fine, twin)``.
    finer : callable
        ``finer(settings, part)`` returns those of a run at so small a part of the tolerance.
    wanted : float
        As a part of what errors are judged by.
    least : float
        Tolerance below which no run is made.
    """
    fine = Made(first, run(first))
    twin = twin_of(fine, None)
    for attempt in range(ATTEMPTS):
        judged = judge(fine, twin)
        # a finer run does not mend what it has no part in
        enough = judged.worst <= wanted or judged.mendable <= AIMED * wanted
        if enough or attempt == ATTEMPTS - 1 or fine.settings.tolerance <= least:
            break
        part = float(np.clip(AIMED * wanted / judged.mendable, LEAST_PART, 1.0 / COARSER))
        settings = finer(fine.settings, part)
        before, fine = fine, Made(settings, run(settings))
        twin = twin_of(fine, before)
    return Refined(fine, twin, judged)
