"""Kinematic analysis: positions, velocities and accelerations of a mechanism without degrees of freedom.

At each time Phi(q, t) = 0 is solved by Newton's method from the position before, moved on by its velocity; then
Phi_q v + Phi_t = 0; accelerations and reactions follow from the index-1 system. Nothing is integrated.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from gearmbs.dae.analyses.instant import Instant
from gearmbs.dae.errors import AssemblyError, ModelError
from gearmbs.dae.result import DAEResult, SolverStats, Status
from gearmbs.dae.results.solution import Solution

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

LARGEST_TURN = 0.2
MAX_ITERATIONS = 30
MAX_HALVINGS = 40
TOLERANCE = 1e-13


def kinematic(system: System, t_eval: np.ndarray) -> Solution:
    """Solve positions and velocities at each time.

    Parameters
    ----------
    system : System
        Compiled for the first time of ``t_eval``.
    t_eval : ndarray, shape (m,)
        Increasing times, s.

    Raises
    ------
    ModelError
        If the mechanism has degrees of freedom or states with a rate.
    AssemblyError
        If the mechanism locks or cannot be closed at some time; the time and the constraint are named.
    """
    t_eval = np.asarray(t_eval, dtype=float)
    if t_eval.ndim != 1 or t_eval.size == 0 or not np.all(np.diff(t_eval) > 0.0):
        raise ModelError("t_eval: give increasing times")
    if system.report is None:
        system.initialise()
    if system.report is not None and system.report.degrees_of_freedom > 0:
        raise ModelError(
            f"a kinematic analysis needs zero degrees of freedom; the model has {system.report.degrees_of_freedom}: "
            "prescribe as many motions, or run a dynamic analysis"
        )
    walk = _Walk(Instant(system, "SI2"))
    y = np.zeros((t_eval.size, walk.instant.y.size))
    yp = np.zeros_like(y)
    epochs = [(0, walk.instant.idata.copy())]
    for k, t in enumerate(t_eval):
        walk.to(float(t))
        if not np.array_equal(walk.instant.idata, epochs[-1][1]):
            epochs.append((k, walk.instant.idata.copy()))
        y[k] = walk.instant.y
        yp[k, walk.q] = walk.instant.y[walk.v]
    result = DAEResult(
        t=t_eval,
        y=y,
        yp=yp,
        status=Status.SUCCESS,
        message="positions, velocities and accelerations were solved at every time",
        stats=SolverStats(steps=walk.steps, residuals=walk.iterations, jacobians=walk.iterations),
        epochs=epochs,
        t_last=float(t_eval[-1]),
    )
    return Solution(system, replace(walk.instant.problem), result)


class _Walk:
    """The present position and the way to the next."""

    def __init__(self, instant: Instant) -> None:
        if instant.differential.any():
            raise ModelError("a kinematic analysis cannot integrate differential states; run a dynamic analysis")
        self.instant = instant
        self.q = instant.block("R", "lambda")
        self.v = np.concatenate([instant.block("u", "p"), instant.block("eps", "R")])
        self.rows = instant.block("lambda", "F")
        self.rates = instant.block("mu", "n")
        self.angles = instant.block("theta", "lambda")
        self.length = instant.system.length
        self.steps = self.iterations = 0

    def to(self, t: float) -> None:
        """Move to a time, in as many steps as rotations demand."""
        h = t - self.instant.t
        halvings = 0
        while self.instant.t < t or h == 0.0:
            spin = np.abs(self.instant.y[self.instant.block("eps", "R")]).max(initial=0.0)
            rest = t - self.instant.t
            h = min(h, rest, LARGEST_TURN / spin if spin > 0.0 else rest)
            last = h == rest
            kept = self.instant.t, self.instant.y.copy()
            self.instant.t = t if last else self.instant.t + h
            self.instant.y[self.q] += h * self.instant.y[self.v]
            failure = self._close()
            turned = np.abs(self.instant.y[self.angles] - kept[1][self.angles]).max(initial=0.0)
            if (failure is None and turned <= 3.0 * LARGEST_TURN) or (failure is None and h == 0.0):
                self._velocity()
                self.instant.hook()
                self.steps += 1
                if last:
                    break
                h, halvings = 2.0 * h, 0
                continue
            self.instant.t, self.instant.y = kept
            halvings += 1
            if halvings > MAX_HALVINGS or h == 0.0:
                raise AssemblyError(failure or f"the mechanism jumps at t = {t:.6g} s: it is at a position of change")
            h *= 0.5
        self.instant.settle(self.instant.y)

    def _factor(self, rows: np.ndarray, columns: np.ndarray):
        matrix = self.instant.matrix(self.instant.y)
        try:
            return splu(csc_array(matrix[rows][:, columns]))
        except RuntimeError:
            return None

    def _close(self) -> str | None:
        """Solve the positions; return what prevents it."""
        last = np.inf
        for _ in range(MAX_ITERATIONS):
            phi = self.instant.residual(self.instant.y)[self.rows]
            size = float(np.abs(phi).max(initial=0.0))
            name = self.instant.system.row_names[int(np.argmax(np.abs(phi)))] if phi.size else ""
            where = f"at t = {self.instant.t:.6g} s"
            if not np.isfinite(size):
                return f"{name}: its value is not finite {where}"
            if size <= TOLERANCE * self.length or (size <= 1e-10 * self.length and size >= 0.5 * last):
                return None
            solver = self._factor(self.rows, self.q)
            if solver is None:
                return f"the mechanism locks {where}: its constraints are dependent there, {name} among them"
            step = solver.solve(phi)
            turn = np.abs(step[step.size // 2 :]).max(initial=0.0)
            self.instant.y[self.q] -= step * min(1.0, 0.5 / max(turn, 1e-300))
            self.iterations += 1
            last = size
        return f"the mechanism cannot be closed {where}: {name} is left violated by {size:.3g}; check the motions"

    def _velocity(self) -> None:
        """Solve the velocities and set the momenta that belong to them."""
        instant = self.instant
        instant.stop(instant.y)
        solver = self._factor(self.rates, self.v)
        if solver is None:
            raise AssemblyError(f"the mechanism locks at t = {instant.t:.6g} s: its velocities are not determined")
        instant.y[self.v] = solver.solve(-instant.residual(instant.y)[self.rates])
        eps = instant.block("eps", "R")
        instant.y[instant.block("p", "eps")] -= instant.residual(instant.y)[eps]
