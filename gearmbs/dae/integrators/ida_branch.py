"""Whether the equations go on where IDA stops, and how a piece of a run begins behind a breakpoint."""

from __future__ import annotations

import numpy as np
import scipy

from gearmbs.dae.integrators.branches import SAME_EQUATION, UNFORESEEN
from gearmbs.dae.integrators.corrector import ROUNDED_TERMS
from gearmbs.dae.integrators.initial_state import LARGE_GAMMA, LARGEST_PENCIL
from gearmbs.dae.integrators.messages import branch_ends, index_changes, no_solution, solution_ends
from gearmbs.dae.integrators.options import BESIDE
from gearmbs.dae.problem import EPS, DAEProblem

SHORTEST = 1e-12
"""Part of the span that the step across such a place takes."""
FIRST_OF_PIECE = 1e-3
"""Part of the way to the next breakpoint that is tried first as the first step behind one: IDA's own largest."""
FIRST_ERROR = 0.1
"""Error of that step, in tolerances: IDA's test allows one."""
FIRST_SHRINK = 1e-3
"""Least ratio of a step tried to the one before, whose error tells nothing where it is far longer than the motions."""
FIRST_TRIALS = 12
STANDSTILL = 1e-6
"""Part of the span within which stops count as at one place."""
TRIES_AT_A_JUMP = 3
JUMP_ITERATIONS = 50
"""From one solution of z^p = a to one a thousandfold larger, Newton's method takes p ln 1000 of them, and some."""


class IdaBranch:
    """Whether the equations have a solution beyond a time at which IDA stops, on the branch that it followed.

    Parameters
    ----------
    problem : DAEProblem
    idata, rdata, work : ndarray
        Tables and scratch of the run.
    atol, rtol : ndarray, float
        Tolerances.
    start : float
        Start of the run.
    """

    def __init__(self, problem: DAEProblem, idata, rdata, work, atol, rtol: float, start: float) -> None:
        self.problem, self.work = problem, work
        self.idata, self.rdata, self.atol, self.rtol = idata, rdata, atol, rtol
        self.own = problem.index_one
        self.start = self.t_known = self.passed = start
        self.tries = 0
        self.sign = 0.0

    def _residual(self, t: float, y: np.ndarray, yp: np.ndarray) -> np.ndarray:
        out = np.empty(self.problem.n)
        self.problem.residual(t, y, yp, out, self.idata, self.rdata, self.work)
        return out

    def _matrix(self, t: float, y: np.ndarray, yp: np.ndarray, gamma: float) -> scipy.sparse.csc_array:
        problem = self.problem
        vals = np.empty(problem.indices.size)
        problem.jacobian(t, y, yp, gamma, vals, self.idata, self.rdata, self.work)
        return scipy.sparse.csc_array((vals, problem.indices, problem.indptr), shape=(problem.n,) * 2)

    def _pencil(self, t: float, y: np.ndarray, yp: np.ndarray, gamma: float) -> float:
        """Return the sign of det(dG/dy + gamma dG/dy'), 0 for large or singular matrices."""
        if self.problem.n > LARGEST_PENCIL or self.own is None:
            return 0.0
        matrix = self._matrix(t, y, yp, gamma).toarray()
        size = np.abs(matrix).max(axis=1)
        if not (np.isfinite(size).all() and (size > 0.0).all()):
            return 0.0
        return float(np.linalg.slogdet(matrix / size[:, None])[0])

    def know(self, t: float, y: np.ndarray, yp: np.ndarray, end: float) -> None:
        """Note the sign of the pencil's determinant early in the run."""
        self.gamma = LARGE_GAMMA / (end - self.start)
        self.sign, self.t_known = self._pencil(t, np.array(y), np.array(yp), self.gamma), t

    def index_changed(self, t: float, y: np.ndarray, yp: np.ndarray) -> bool:
        """Return whether a singular pencil lies between the start of the run and ``t``, see `branches`."""
        if self.sign == 0.0:
            return False
        sign = self._pencil(t, np.array(y), np.array(yp), self.gamma)
        return sign not in (0.0, self.sign)

    def pass_jump(
        self, t: float, y: np.ndarray, yp: np.ndarray, end: float
    ) -> tuple[float, np.ndarray, np.ndarray] | str:
        """Take the shortest step of implicit Euler; return where it leads, or why it leads nowhere.

        Newton's method with a matrix of its own for each iterate. Unknowns of index one may jump, if their equations
        do: see `gearmbs.dae.integrators.branches.stays_on_branch`.
        """
        self.tries = self.tries + 1 if t - self.passed <= STANDSTILL * (end - self.start) else 0
        self.passed = t
        if self.tries >= TRIES_AT_A_JUMP:
            return ""
        h = self._shortest(t, end)
        found = self._step(t, y, y + np.where(self.problem.differential, h * yp, 0.0), h)
        if isinstance(found, str):
            return found
        return index_changes(t, t) if self.index_changed(t + h, *found) else (t + h, *found)

    def _shortest(self, t: float, end: float) -> float:
        """Return the size of the step across a jump."""
        return max(SHORTEST * (end - self.start), BESIDE * abs(t))

    def start_afresh(
        self, t: float, y: np.ndarray, yp: np.ndarray, stop: float, end: float
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return unknowns and rates with which to go on behind a breakpoint, and the size of the first step.

        Implicit Euler gives (y - y_0)/h = y'_0 + h y'' + ... and algebraic unknowns z_0 + h z' + ...: steps of h and
        h/2 give all of them and, from y'', the size with an error of `FIRST_ERROR` tolerances. Where such a step leads
        nowhere all is left as it was, and the size zero: IDA chooses.
        """
        moving = self.problem.goes_on
        weight = 1.0 / (self.atol + self.rtol * np.abs(y))
        h, least, most = FIRST_OF_PIECE * (stop - t), self._shortest(t, end), 0.25 * (stop - t)
        if self.problem.hook_interval is not None:
            h = max(2.0 * least, min(h, self.problem.hook_interval(t, y, yp)))
        best = y, yp, 0.0
        # rates before the breakpoint say nothing of longer steps: angles would be found full turns away
        foreseen, speed, at = y, np.where(moving, yp, 0.0), 0.0
        for _ in range(FIRST_TRIALS):
            if not 2.0 * least <= h <= most:
                break
            whole, half = (self._step(t, y, foreseen + (part - at) * speed, part) for part in (h, 0.5 * h))
            if isinstance(whole, str) or isinstance(half, str):
                h *= FIRST_SHRINK
                continue
            far, near = ((new[0] - y) / part for new, part in ((whole, h), (half, 0.5 * h)))
            bend = (far - near) / (0.5 * h)
            error = float(np.max(np.abs(bend) * weight * moving)) * 0.5 * h**2
            if not np.isfinite(error):
                break
            slope = (whole[0] - half[0]) / (0.5 * h)
            foreseen, speed, at = whole[0], np.where(moving, slope, 0.0), h
            if error <= 1.0:
                best = np.where(moving, y, 2.0 * half[0] - whole[0]), np.where(moving, 2.0 * near - far, slope), h
                if error >= FIRST_ERROR / 10.0:
                    break
            elif best[2] > 0.0:
                break
            h = min(h * min(max(np.sqrt(FIRST_ERROR / max(error, 1e-30)), FIRST_SHRINK), 1.0 / FIRST_SHRINK), most)
        return best

    def _step(self, t: float, y: np.ndarray, new: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray] | str:
        """Take a step of implicit Euler, ``new`` foreseen; return unknowns and rates at its end, or why not."""
        # takes longer to load than many a run, which does not need it
        from scipy.sparse.linalg import splu

        problem, own = self.problem, self.own
        gamma, after = 1.0 / h, t + h
        moving = problem.differential
        weight = 1.0 / (self.atol + self.rtol * np.abs(y))
        rates = np.where(moving, gamma * (new - y), 0.0)
        held, row, violation = False, -1, 0.0
        with np.errstate(all="ignore"):
            for _ in range(JUMP_ITERATIONS):
                res = self._residual(after, new, rates)
                matrix = self._matrix(after, new, rates, gamma)
                allowed = abs(matrix) @ (1.0 / weight + ROUNDED_TERMS * EPS * np.abs(new))
                ratio = np.where(res == 0.0, 0.0, np.abs(res) / allowed)
                row = int(np.argmax(np.where(np.isnan(ratio), np.inf, ratio)))
                violation = float(ratio[row])
                if not (np.isfinite(res).all() and np.isfinite(matrix.data).all()):
                    return ""
                try:
                    step = splu(matrix).solve(res)
                except RuntimeError:
                    break
                held = violation <= 1.0 and float(np.max(np.abs(step) * weight)) <= 1.0
                if not np.isfinite(step).all():
                    break
                new = new - step
                rates = np.where(moving, gamma * (new - y), 0.0)
                if held:
                    break
        if not held:
            return solution_ends(problem, row, violation) or no_solution(problem, row)
        if own is None:
            return new, rates
        d = np.where(own, y - new, 0.0)
        if float(np.max(np.abs(d) * weight)) > UNFORESEEN:
            secant = splu(matrix).solve(self._residual(after, np.where(own, y, new), rates))
            size = 1.0 / (np.abs(y) + np.abs(new) + 1.0 / weight)
            if not (secant * size) @ (d * size) >= SAME_EQUATION * float((d * size) @ (d * size)):
                worst = int(np.argmax(np.abs(d) * weight))
                return branch_ends(problem, worst, float(y[worst]), float(new[worst]))
        return new, rates
