"""The unknowns of a system at one instant, with its residual and exact Jacobians there."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from gearmbs.dae.equations import accelerations
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import KIN_AXES, POSE_COLUMNS
from gearmbs.dae.model.model import Configuration
from gearmbs.dae.problem import AssemblyError, ModelError
from gearmbs.dae.result import DAEResult, SolverStats, Status
from gearmbs.dae.results.solution import Solution

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

SETTLE_PASSES = 50

ROUNDING = 2e-13
"""Rounding errors of coefficients, of the sum of the terms they are made of; times the root of their number."""


class Instant:
    """Unknowns y of a system at a fixed time, with the tables they belong to.

    Parameters
    ----------
    system : System
        Made consistent if it is not yet.
    formulation : {"I3", "SI2"}
    """

    def __init__(self, system: System, formulation: str = "I3") -> None:
        self.system = system
        self.problem = system.problem(formulation)
        self.t = system.t0
        self.idata = self.problem.idata.copy()
        self.rdata = self.problem.rdata.copy()
        self.work = np.zeros(self.problem.work_size)
        self.at = system.model.layouts[int(self.idata[T.H_FORMULATION])]
        self.y = self.problem.y0.copy()
        self.differential = system.model.differential_states
        self.released = False
        """Whether it is an instant of a motion, in which what is not in balance accelerates."""

    def block(self, first: str, end: str) -> np.ndarray:
        """Return the indices from the start of one block of y to the start of another."""
        return np.arange(self.at[first], self.at[end])

    def residual(self, y: np.ndarray) -> np.ndarray:
        """Return G(t, y, 0)."""
        out = np.zeros(y.size)
        self.problem.residual(self.t, y, np.zeros(y.size), out, self.idata, self.rdata, self.work)
        return out

    def matrix(self, y: np.ndarray, cj: float = 0.0) -> csc_array:
        """Return dG/dy + cj dG/dy' at y' = 0."""
        vals = np.zeros(self.problem.indices.size)
        self.problem.jacobian(self.t, y, np.zeros(y.size), cj, vals, self.idata, self.rdata, self.work)
        return csc_array((vals, self.problem.indices, self.problem.indptr), shape=(y.size, y.size))

    def settle(self, y: np.ndarray) -> np.ndarray:
        """Put applied loads and algebraic states at the values their definitions give; return y.

        Implicit states, which stand in their own definitions, keep the values that Newton's method gave them.
        """
        places = self.block("F", "mu")
        explicit = np.ones(places.size, dtype=bool)
        explicit[places.size - self.differential.size :] = ~self.system.model.controlled_states
        places = places[explicit]
        for _ in range(SETTLE_PASSES if places.size else 0):
            correction = self.residual(y)[places]
            y[places] -= correction
            if not np.abs(correction).max() > 1e-14 * (1.0 + np.abs(y[places]).max()):
                break
        return y

    def stop(self, y: np.ndarray) -> np.ndarray:
        """Set all velocities and momenta to zero; return y."""
        y[: self.at["R"]] = 0.0
        return y

    def hook(self) -> None:
        """Move to the other Euler reference where due and count full turns, at the present y."""
        history = self.y[None, :].copy()
        if self.problem.hook is None:
            return
        self.problem.hook(self.t, history, 1, self.idata, self.rdata, self.work)
        self.y = history[0]

    def pose(self) -> np.ndarray:
        """Return R, A (row-major), v, omega of each moving body, shape (bodies, 18)."""
        return self.configuration().pose

    def configuration(self) -> Configuration:
        """Return the positions and velocities of y."""
        counts = self.system.model.counts
        out = np.zeros(POSE_COLUMNS * counts.bodies + 2 * sum(counts.modes))
        accelerations.pose_record(self.y, self.idata, self.rdata, self.work, out)
        return Configuration.of(out, counts.bodies)

    def axes(self) -> np.ndarray:
        """Return the axes of the Euler angles, shape (bodies, 3, 3): row k turns with angle k, zero without angles."""
        self.pose()
        kin = T.kinematics_in(self.idata, self.work)
        return kin[1 : len(self.system.model.bodies), KIN_AXES : KIN_AXES + 9].reshape(-1, 3, 3).copy()

    def spatial(self, coordinates: np.ndarray) -> np.ndarray:
        """Turn changes of (R, theta, q_f), a column each, into displacements and rotations, shape (k, bodies, 6)."""
        bodies, first = len(self.system.body_names), self.at["R"]
        angle, mode = self.at["theta"] - first, self.at["q_f"] - first
        moved = coordinates[:angle].reshape(bodies, 3, coordinates.shape[1])
        angles, turning = np.zeros_like(moved), self.system.model.counts.turning
        angles[turning] = coordinates[angle:mode].reshape(turning.size, 3, coordinates.shape[1])
        turned = np.einsum("bmc,bmk->bck", self.axes(), angles)
        return np.moveaxis(np.concatenate([moved, turned], axis=1), 2, 0)

    def mass_matrix(self, matrix: csc_array) -> csc_array:
        """Return the mass matrix of (R, theta, q_f) from the Jacobian of G."""
        from scipy.sparse import block_diag, diags_array

        masses = np.repeat(self.system.model.bodies[1:, T.BODY_MASS], 3)
        eps = self.block("eps", "R")
        return csc_array(block_diag([diags_array(masses), -matrix[eps][:, eps]], format="csc"))


# Kinematic analysis: positions, velocities and accelerations of a mechanism without degrees of freedom.
#
# At each time Phi(q, t) = 0 is solved by Newton's method from the position before, moved on by its velocity; then
# Phi_q v + Phi_t = 0; accelerations and reactions follow from the index-1 system. Nothing is integrated.


LARGEST_TURN = 0.2
"""Angle, rad, by which a body may turn in a step: Newton's method from the prediction then stays with its assembly."""
MAX_ITERATIONS = 30
MAX_HALVINGS = 40
TOLERANCE = 1e-13
"""Part of the mechanism's length to which positions are solved: a few hundred units of the last digit."""


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
    angles = walk.instant.problem.counted
    counted = None if angles is None else np.zeros((t_eval.size, len(angles.places)))
    for k, t in enumerate(t_eval):
        walk.to(float(t))
        if not np.array_equal(walk.instant.idata, epochs[-1][1]):
            epochs.append((k, walk.instant.idata.copy()))
        y[k] = walk.instant.y
        if angles is not None and counted is not None:
            counted[k] = walk.instant.rdata[angles.places]
        yp[k, walk.q] = walk.instant.y[walk.v]
    result = DAEResult(
        t=t_eval,
        y=y,
        yp=yp,
        status=Status.SUCCESS,
        message="positions, velocities and accelerations were solved at every time",
        stats=SolverStats(steps=walk.steps, residuals=walk.iterations, jacobians=walk.iterations),
        epochs=epochs,
        counted=counted,
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
            turn = np.abs(step[self.angles - self.q[0]]).max(initial=0.0)
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
