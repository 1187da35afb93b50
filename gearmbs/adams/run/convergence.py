"""Whether a motion depends on the ERROR asked for: it is solved again at a hundredth, and places of parts compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.adams.builders.scopes import AdamsModel
from gearmbs.dae.problem import ModelError
from gearmbs.dae.result import Status
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.contacts.element import SolidContact

TIGHTER = 0.01
"""Part of its error at which an analysis is solved again: the second solution's own error is then small beside the
change that is looked at."""
TIGHTEST = 1e-11
"""Least error asked for: what is smaller may be rounding."""
TELLING = 1e-9
"""Error up to which a second run that does not reach the end says nothing of the first."""
LONGER = 20
"""Steps of the second run, in those of the first, after which it is given up."""
APART = 0.01
"""Distance of two runs, of the largest displacement of a part, that is remarked."""
STILL = 1e-6
"""Largest displacement, of the largest coordinate, up to which nothing moves."""
CHEAP = 2_000_000
"""Work of a second run that is not asked for, at most: about a second or two."""
EXPECTED = 3
"""Steps of the second run, in those of the first, that are expected of it: 100^(1/4) for an error of fourth order."""


@dataclass(frozen=True)
class Doubt:
    """What a smaller error changes.

    Attributes
    ----------
    since : float
        When places begin to differ, s; if the second run did not reach the end, when it stopped.
    tol : float
        Error of the first run.
    part : str
        Which is farthest from its other place, at any time.
    apart, at_end, moved : float
        By how much, also at the end, and the largest displacement of any part, m.
    stopped : str
        Why the second run did not reach the end, "" if it did.
    """

    since: float
    tol: float
    part: str = ""
    apart: float = 0.0
    at_end: float = 0.0
    moved: float = 0.0
    stopped: str = ""

    def remark(self, time: float, length: float, unit: str) -> str:
        """Return a sentence, with the deck's units of time and length, in SI, and the latter's name."""
        again = f"at a hundredth of ERROR = {self.tol:g}"
        if self.stopped:
            return (
                f"{again} the run ends at TIME = {self.since / time:.4g}: {self.stopped} What follows here may not be "
                "the motion of the model"
            )
        return (
            f"{again} the motion is another from TIME = {self.since / time:.4g} on: {self.part} is up to "
            f"{self.apart / length:.3g} {unit} elsewhere, {self.at_end / length:.3g} at the end, where parts move by "
            f"{self.moved / length:.3g} at most; it amplifies small differences, or ERROR is too large: ask for a "
            "smaller one"
        )


def work_of_a_step(model: AdamsModel, solution: Solution) -> int:
    """Return the work of a step: unknowns and, of pairs of faceted solids, triangles."""
    contacts = [f for f in model.mechanism.elements.values() if isinstance(f, SolidContact)]
    return solution.problem.n + sum(contact.triangles() for contact in contacts)


def doubt(
    model: AdamsModel,
    solution: Solution,
    options: dict[str, Any],
    again: Callable[[dict[str, Any]], Solution],
    asked: bool | None,
) -> Doubt | None:
    """Solve an analysis again at a hundredth of its error; return what that changes, None if little or not looked at.

    Parameters
    ----------
    model : AdamsModel
    solution : Solution
    options : dict
        Of the integrator.
    again : callable
        Solves the analysis with other options.
    asked : bool or None
        Whether to look at it; None: if that is expected to cost little, and no longer than it does. What decides are
        counts of steps, unknowns and triangles, so that a model is treated alike on every machine.
    """
    if asked is False or not solution.success or solution.t.size < 2:
        return None
    tol = max(TIGHTER * options["tol"], TIGHTEST)
    if tol >= options["tol"]:
        return None
    steps = LONGER * (solution.stats.steps + 100)
    if asked is None:
        affordable = CHEAP // work_of_a_step(model, solution)
        if EXPECTED * solution.stats.steps > affordable:
            return None
        steps = min(steps, affordable)
    try:
        second = again({**options, "tol": tol, "max_steps": steps})
    except (ModelError, ArithmeticError) as error:
        return Doubt(float(solution.t[0]), options["tol"], stopped=f"{error}.")
    if second.status in (Status.TOO_MANY_STEPS, Status.INTERRUPTED) or (not second.success and tol < TELLING):
        return None
    if not second.success:
        return Doubt(float(second.t[-1]), options["tol"], stopped=second.message.partition(". ")[0].rstrip(".") + ".")
    names = [name for name in model.mechanism.bodies if name in model.sources]
    if not names:
        return None
    one, other = (np.stack([s.com_position(name) for name in names], axis=1) for s in (solution, second))
    moved = max(float(np.linalg.norm(one - one[0], axis=2).max()), STILL * float(np.abs(one).max()))
    apart = np.linalg.norm(one - other, axis=2)
    off = np.flatnonzero(apart.max(axis=1) > APART * moved)
    if off.size == 0:
        return None
    farthest = int(np.argmax(apart.max(axis=0)))
    label, own = model.sources[names[farthest]].label(), apart[:, farthest]
    return Doubt(float(solution.t[off[0]]), options["tol"], label, float(own.max()), float(own[-1]), moved)
