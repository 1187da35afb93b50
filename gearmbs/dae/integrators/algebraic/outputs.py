"""What of a problem is solved for at the outputs of a run, and what is said of the rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gearmbs.dae.integrators.algebraic.between import settle_output
from gearmbs.dae.integrators.algebraic.part import MAX_POINTS, AlgebraicPart, new_part, nothing
from gearmbs.dae.integrators.algebraic.structure import (
    MOST_RANKED,
    MOST_TOGETHER,
    Graph,
    Structure,
    chosen,
    dependences,
    has_hidden_constraints,
    structure,
)
from gearmbs.dae.integrators.messages import list_names
from gearmbs.dae.problem import DAEProblem
from gearmbs.kernels.placed import bind
from gearmbs.kernels.pointers import direct, no_events, no_hook

CLOSER, NEARER = 0.25, 0.75
"""Part of the step over which an output at the start is solved for once more, and part of the distance to a value given
there that is left where it is the limit: 1/2 of t^1.5, while smooth constraints lead to one value over both."""


class AlgebraicOutputs:
    """What is solved for at outputs of a problem in a run between two ``ends``, and what is not.

    Attributes
    ----------
    part : AlgebraicPart
    left : ndarray of int
        Algebraic unknowns outside error control that the equations do not determine at an instant.
    coupled : ndarray of int
        Those that depend on too many others.
    """

    def __init__(self, problem: DAEProblem, atol: np.ndarray, rtol: float, ends: tuple[float, float]) -> None:
        self.problem = problem
        wanted, solved, taken = chosen(problem)
        self.left = np.empty(0, dtype=np.int64)
        self.coupled = self.left
        # scratch of polynomials is not shared between threads
        self.part = nothing().with_members(value=np.zeros(MAX_POINTS), slope=np.zeros(MAX_POINTS))
        if not wanted.any():
            return
        by_y, by_rate = dependences(problem)
        differential = np.asarray(problem.differential, dtype=bool)
        pattern = np.asarray(problem.indptr), np.asarray(problem.indices)
        found = structure(Graph(by_y, by_rate, wanted, solved, differential, taken, *pattern))
        self.left, self.coupled = found.left, found.coupled
        if len(found.rows):
            self.part = self._made(found, atol, rtol)
            self.part.t_start, self.part.t_end = ends

    def _made(self, found: Structure, atol: np.ndarray, rtol: float) -> AlgebraicPart:
        """Return the compiled loop's part of it."""
        problem = self.problem
        sizes = len(found.rows), problem.n, len(problem.indices), len(found.entries), len(problem.rdata)
        part = new_part(*sizes)
        part.rtol = rtol
        part.any_lifted, part.any_rates = bool(found.lifted.any()), bool(found.rates.any())
        part.rows[:], part.cols[:], part.lifted[:], part.rates[:] = found.rows, found.cols, found.lifted, found.rates
        part.atol[:] = atol
        part.entry_row[:], part.entry_col[:], part.entry_at[:], part.entry_kind[:] = found.entries.T
        return part

    @property
    def is_needed(self) -> bool:
        """Whether there is anything to solve for."""
        return self.part.count > 0

    @property
    def is_constrained(self) -> bool:
        """Whether there are unknowns of index two or more, or what stands for them without error control."""
        problem = self.problem
        of_mechanism = problem.solved_at_outputs is not None
        integrated = bool((problem.differential & ~np.asarray(problem.error_mask, dtype=bool)).any())
        if of_mechanism or integrated or bool(self.part.any_lifted) or len(self.left) or len(self.coupled):
            return True
        return problem.n > MOST_RANKED or has_hidden_constraints(problem)

    @property
    def functions(self) -> Any:
        """The functions of the problem, bound together for compiled code."""
        problem = self.problem
        return bind(problem.residual, problem.jacobian, problem.hook or no_hook, no_events)

    def settle_start(
        self,
        t: float,
        y: np.ndarray,
        yp: np.ndarray,
        h: float,
        idata: np.ndarray,
        stops: Sequence[float] | np.ndarray,
    ) -> None:
        """Settle the output at the start in place, in a step of about ``h``; what cannot be stays as it was given.

        The run may have passed some of the breakpoints ``stops`` by then. A value given that differences over shorter
        steps approach stays: a constraint has no smooth rate there, as t^1.5 at 0.
        """
        part = self.part
        kept, part.noting = (part.failures, part.t_first, part.t_last), False
        rdata = self.problem.rdata
        part.t_first, part.t_last = t, stops[0] if len(stops) else part.t_end
        given, closer = (y.copy(), yp.copy()), (y.copy(), yp.copy())
        self.settle_after(t, y, yp, h, t, y, idata, rdata)
        if part.any_lifted:
            failures = part.failures
            self.settle_after(t, *closer, CLOSER * h, t, closer[0], idata, rdata)
            if part.failures == failures:
                limit = np.abs(closer[0] - given[0]) < NEARER * np.abs(y - given[0])
                y[limit], yp[limit] = given[0][limit], given[1][limit]
        part.failures, part.t_first, part.t_last = kept
        part.noting = True

    def settle_after(
        self,
        t: float,
        y: np.ndarray,
        yp: np.ndarray,
        h: float,
        t_old: float,
        y_old: np.ndarray,
        idata: np.ndarray,
        rdata: np.ndarray,
    ) -> None:
        """Settle one output in place, with the tables valid there; see `settle_output`."""
        tables = idata, rdata.copy(), np.zeros(self.problem.work_size)
        direct(settle_output)(self.functions, self.part, t, y, yp, h, t_old, y_old, *tables)

    def remark(self) -> str:
        """Say which unknowns are known at the steps alone, and where they could not be solved for."""
        problem, part = self.problem, self.part
        parts = []
        of_mechanism = problem.solved_at_outputs is not None
        remedy = "" if of_mechanism else " State a problem of index one or two, or put it under error_mask."
        for unknowns, why in (
            (self.left, f"no equation and no derivative of one determines it at an instant.{remedy}"),
            (self.coupled, f"it depends on more than {MOST_TOGETHER} others. Put it under error_mask."),
        ):
            if len(unknowns):
                names = list_names(problem, unknowns)
                parts.append(f"Between the steps {names} is interpolated without control of the error: {why}")
        if part.failures:
            algebraic = np.unique(part.cols[part.rates == 0])
            parts.append(
                f"At {part.failures} instants, the first t = {part.first_failure:.9g}, "
                f"{list_names(problem, algebraic)} could not be solved for, and the interpolated values stand there."
            )
        return " ".join(parts)
