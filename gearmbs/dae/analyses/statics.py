"""Static equilibrium: the pose at which the I3 residual vanishes with all velocities and rates zero.

With u = p = eps = 0 and y' = 0 what is left of eq. (5)-(8) are the balances of forces, the constraints and the
definitions of the loads, in the unknowns R, theta, lambda, F, N (and states). Each iteration solves

    [K + sigma M   Phi_q^T] [dq     ]     [force residual]
    [Phi_q               0] [dlambda] = - [Phi           ]

with the exact Jacobian: for large sigma a step of a motion without inertia down the forces, which finds stable
positions from afar, for sigma = 0 Newton's method. sigma follows how well the linear model predicted the last step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gearmbs._lazy import former_name
from gearmbs.dae.analyses.eigenvalues import free_motions
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.linearisation import reduce
from gearmbs.dae.analyses.relaxation import DENSE_LIMIT, LARGEST_TURN, ROUNDING_STEP, Relaxation, describe
from gearmbs.dae.equations import accelerations
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.kinematics import AXES
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V
from gearmbs.dae.model.evaluator import Records
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import DAEProblem, ModelError, SingularModelError
from gearmbs.dae.result import DAEResult, SolverStats, Status
from gearmbs.dae.results.solution import Solution

# Equilibria of what is slender, reached from the given position by releasing its unbalanced forces step by step.
#
# A chain of beams is far stiffer against stretching than against bending. A step that turns its elements stretches them
# by the square of the turn, and the forces of this exceed the load long before the step is too long, so that no rule
# that wants the forces to fall lets Newton's method take it; left alone it puts the stretch right with its next step.
# Hence the unbalanced forces r0 of the start are held against the mechanism and released in parts,
#
#     r(x) = (1 - s) r0,    s from 0 to 1,
#
# with Newton's iterations in each part, whatever the forces do on the way. In a mechanism that is free of forces where
# it stands these are steps of its load.


SHORTER = (1e-2, 1e-4)
"""First steps, in lengths of the mechanism, of those who fell through what bears them: a solid is thinner than the
ground it stands on is wide, and a body that touches it without any depth is not borne until it has some."""
FIRST_SHARES = (1.0, 1.0 / 16.0)
"""Shares of the forces first released: again with the smaller one where the larger led to an unstable position."""
SMALLEST_SHARE = 1.0 / 1024.0
MOST_ITERATIONS = 30
"""Newton's iterations in one part; more hardly ever end well."""
FEW_ITERATIONS = 8
"""Iterations below which the next part is twice as large."""
ROUGHLY = 1e-6
"""Largest unbalanced force, of the typical one, with which a part ends that is not the last."""


def equilibrium(relaxation: Relaxation, max_iterations: int) -> tuple[int, float]:
    """Bring a mechanism to rest, by relaxation or, where that fails, by steps; return iterations and residual.

    Parameters
    ----------
    relaxation : Relaxation
        Its instant is left at the equilibrium.
    max_iterations : int
        Of relaxation; steps may take five times as many.

    Raises
    ------
    SingularModelError, ModelError
        Of the relaxation, if there is no equilibrium by either way.
    """
    before = _saved(relaxation.instant)
    try:
        return relaxation.run(max_iterations)
    except SingularModelError:
        # who fell past what would have borne him finds it by shorter steps
        for first in SHORTER:
            _put_back(relaxation.instant, before)
            try:
                return relaxation.run(max_iterations, first)
            except ModelError:
                pass
        raise
    except ModelError as failure:
        _put_back(relaxation.instant, before)
        found = _release(relaxation, 5 * max_iterations)
        if found is None:
            raise failure from None
        return max_iterations + found[0], found[1]


def _release(relaxation: Relaxation, max_iterations: int) -> tuple[int, float] | None:
    """Seek an equilibrium from the present position; return iterations and residual, None if there is no way.

    An unstable one, as loads beyond buckling have, is taken if small parts lead there, too.

    Parameters
    ----------
    relaxation : Relaxation
        Its instant is left at the equilibrium, or where it was.
    max_iterations : int
        Of all parts together, for each of `FIRST_SHARES`.
    """
    before, found = _saved(relaxation.instant), None
    for share in FIRST_SHARES:
        _put_back(relaxation.instant, before)
        found = _follow(relaxation, share, max_iterations)
        if found is None or _stable(relaxation):
            break
    if found is None:
        _put_back(relaxation.instant, before)
    return found


def _follow(relaxation: Relaxation, share: float, max_iterations: int) -> tuple[int, float] | None:
    """Release the forces in parts, ``share`` of them first."""
    instant, released, total = relaxation.instant, 0.0, 0
    while True:
        before = _saved(instant)
        last = released + share >= 1.0
        # what is left of r0 is the present rest, whichever angles the bodies are described by now
        held = np.zeros(relaxation.rows.size)
        if not last:
            held[: relaxation.coordinates] = (1.0 - share / (1.0 - released)) * relaxation.rest(instant.y)[
                : relaxation.coordinates
            ]
        found = _iterate(relaxation, held, relaxation.tol if last else max(ROUGHLY, relaxation.tol))
        total += MOST_ITERATIONS if found is None else found[0]
        if found is None:
            _put_back(instant, before)
            share *= 0.25
            if share < SMALLEST_SHARE or total > max_iterations:
                return None
            continue
        if last:
            return total, found[1]
        if total > max_iterations:
            return None
        released += share
        if found[0] <= FEW_ITERATIONS:
            share *= 2.0


def _iterate(relaxation: Relaxation, held: np.ndarray, tol: float) -> tuple[int, float] | None:
    """Solve for the position in which the forces are ``held``; return iterations and residual, None if that fails."""
    instant, polished, size = relaxation.instant, False, np.inf
    for iteration in range(1, MOST_ITERATIONS + 1):
        rest, stiffness, mass = relaxation.parts(instant.y)
        rest = rest - held
        size = float(np.abs(rest / relaxation.sizes).max(initial=0.0))
        if not np.isfinite(size):
            return None
        if polished:
            instant.hook()
            return (iteration, size) if size <= ROUGHLY else None
        step = relaxation.solve(stiffness, mass, relaxation.first_sigma(rest, stiffness, mass)[1], rest)
        if step is None:
            return None
        n = relaxation.coordinates
        turned = float(np.abs(step[relaxation.angles : relaxation.modes]).max(initial=0.0)) / LARGEST_TURN
        moved = float(np.abs(step[: relaxation.angles]).max(initial=0.0)) / relaxation.length
        least = float(np.abs(step[:n]).max(initial=0.0)) <= ROUNDING_STEP * max(relaxation.length, 1.0)
        polished = size <= tol or (least and size <= ROUGHLY)
        y = instant.y.copy()
        y[relaxation.columns] += step / max(1.0, turned, moved)
        instant.y = instant.settle(y)
    return None


def _stable(relaxation: Relaxation) -> bool:
    """Return whether small displacements are resisted; taken for granted of what is too large to tell."""
    if relaxation.coordinates > DENSE_LIMIT:
        return True
    return free_motions(reduce(relaxation.instant))[0]


def _saved(instant: Instant) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return instant.y.copy(), instant.idata.copy(), instant.rdata.copy()


def _put_back(instant: Instant, kept: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    instant.y = kept[0].copy()
    instant.idata[:], instant.rdata[:] = kept[1], kept[2]


# A mechanism at rest at one or several times, as a solution: reactions and loads are those of the equilibrium.


@dataclass(frozen=True)
class Snapshot:
    """The unknowns y at one time with their tables."""

    system: System
    problem: DAEProblem
    t: float
    y: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray

    @classmethod
    def of(cls, instant: Instant) -> Snapshot:
        """Return a copy of an instant's present state."""
        copies = (instant.y.copy(), instant.idata.copy(), instant.rdata.copy())
        return cls(instant.system, instant.problem, instant.t, *copies)

    def instant(self) -> Instant:
        """Return the time and the unknowns as they were, with the turns counted on the way there."""
        instant = Instant(self.system, "I3")
        instant.t, instant.y = self.t, self.y.copy()
        instant.idata, instant.rdata = self.idata.copy(), self.rdata.copy()
        return instant

    @staticmethod
    def result(message: str, iterations: int, rows: Sequence[Snapshot]) -> DAEResult:
        """Return snapshots as what an integrator would have stored."""
        y, counted = np.array([row.y for row in rows]), rows[0].problem.counted
        return DAEResult(
            t=np.array([row.t for row in rows]),
            y=y,
            yp=np.zeros_like(y),
            status=Status.SUCCESS,
            message=message,
            stats=SolverStats(steps=iterations),
            epochs=[(k, row.idata) for k, row in enumerate(rows)],
            counted=np.array([row.rdata[counted.places] for row in rows]) if counted is not None else None,
            t_last=rows[-1].t,
        )


class EquilibriumSolution(Solution):
    """Equilibria over time: nothing moves, whatever the rates of motions and constraints.

    Make one with :meth:`of`.
    """

    def __init__(self, rows: Sequence[Snapshot], result: DAEResult) -> None:
        self._rows = rows
        super().__init__(rows[0].system, rows[0].problem, result)
        # at once, for a part of it is none
        self._records = self._evaluate()

    @classmethod
    def of(cls, rows: Sequence[Snapshot], message: str, iterations: int) -> EquilibriumSolution:
        """Return the solution of snapshots of equilibria."""
        return cls(rows, Snapshot.result(message, iterations, rows))

    def instant(self, row: int = 0) -> Instant:
        """Return one of the equilibria with its unknowns and counted turns."""
        return self._rows[row].instant()

    def counted(self, row: int = 0) -> dict[tuple[str, int, int], float]:
        """Return all counted angles at one time, rad, by function and markers I and J."""
        snapshot, model = self._rows[row], self.system.model
        first = int(snapshot.idata[T.H_R_EXTRA])
        found: dict[tuple[str, int, int], float] = {}
        for tape, where in zip(model.tapes, model.tape_rows):
            at = first + int(where[T.TAPE_REFERENCE]) + tape.n_angles
            found.update(zip(tape.angles, snapshot.rdata[at : at + tape.n_angles].tolist()))
        for axis, i, j, at in model.angles:
            found[AXES[axis], i, j] = float(snapshot.rdata[first + at + 1])
        return found

    def _evaluate(self) -> Records:
        """Take multipliers and loads from the unknowns; the diagnostics of contacts as in a motion."""
        records = super()._evaluate()
        records.by_body[:, :, 12:18] = 0.0
        records.accelerations[:] = 0.0
        rows = len(self.system.row_names)
        multipliers = np.zeros((2, max(rows, 1)))
        for k, row in enumerate(self._rows):
            y, idata = row.y, row.idata
            out, work = np.zeros(y.size), np.zeros(row.problem.work_size)
            row.problem.residual(row.t, y, np.zeros(y.size), out, idata, row.rdata, work)
            lam = int(idata[T.H_LAMBDA])
            multipliers[0, :rows] = y[lam : lam + rows]
            multipliers[1, 0] = row.t
            records.multipliers[k] = y[lam : lam + rows]
            records.phi[k] = 0.0
            records.by_row[k, :, 0] = out[lam : lam + rows]
            accelerations.joint_loads(y, idata, row.rdata, work, multipliers, records.force[k], records.moment[k])
            table = idata[int(idata[T.H_I_FORCE]) : int(idata[T.H_I_FUNCTION])].reshape(-1, T.FORCE_COLUMNS)
            for f, force in enumerate(table):
                for column, first in ((T.FORCE_F, 0), (T.FORCE_N, 3)):
                    at = int(force[column])
                    records.loads[k, f, first : first + 3] = y[at : at + 3] if at >= 0 else 0.0
        return records


@dataclass(repr=False)
class StaticResult:
    """A position of equilibrium.

    Attributes
    ----------
    t : float
        Time at which functions of time were frozen, s.
    body_names : list of str
    pose : ndarray, shape (bodies, 18)
        R (m), A (row-major), and zero velocities.
    multipliers : ndarray, shape (rows,)
    reactions : dict of str to (ndarray, ndarray)
        Force (N) and moment about marker I (N m) of each joint on I's body, global components.
    loads : dict of str to (ndarray, ndarray)
        Force (N) and torque (N m) of each force element on I's body.
    iterations : int
    residual : float
        Largest unbalanced force or torque relative to the typical one, or constraint violation.
    neutral : list of str
        Bodies free to move away from the equilibrium without any resistance.
    stable : bool or None
        Whether all small displacements are resisted or neutral; None when the system is too large to tell cheaply.
    solution : Solution
        The equilibrium as a solution with one output time.
    """

    t: float
    body_names: list[str]
    pose: np.ndarray
    multipliers: np.ndarray
    reactions: dict[str, tuple[np.ndarray, np.ndarray]]
    loads: dict[str, tuple[np.ndarray, np.ndarray]]
    iterations: int
    residual: float
    neutral: list[str] = field(default_factory=list)
    stable: bool | None = None
    solution: EquilibriumSolution = field(repr=False, default=None)  # type: ignore[assignment]

    def com_position(self, body: str) -> np.ndarray:
        """Return the position of the centre of mass of a body, shape (3,), m, global."""
        return self.pose[self._index(body), POSE_R:POSE_A]

    position = former_name("position", com_position, "it is the centre of mass; write com_position")

    def marker_position(self, marker: Any) -> np.ndarray:
        """Return the origin of a marker, shape (3,), m, global; by marker or name, or of a body's own frame."""
        return self.solution.marker_position(marker)[0]

    def orientation(self, body: str) -> np.ndarray:
        """Return the rotation matrix of a body, shape (3, 3)."""
        return self.pose[self._index(body), POSE_A:POSE_V].reshape(3, 3)

    def table(self) -> str:
        """Return the equilibrium as text: how good and stable it is, where the bodies are, what joints carry."""

        def shown(value: float) -> float:
            return 0.0 if abs(value) < 1e-12 else value

        lines = [repr(self), f"{'body':<24} {'x/m':>12} {'y/m':>12} {'z/m':>12}"]
        for name, row in zip(self.body_names, self.pose):
            lines.append(f"{name:<24} " + " ".join(f"{shown(value):>12.6g}" for value in row[0:3]))
        for title, table in (("joint", self.reactions), ("load", self.loads)):
            if table:
                lines.append(f"{title:<24} {'force/N':>12} {'moment/N m':>12}")
            for name, (force, moment) in table.items():
                sizes = (shown(float(np.linalg.norm(part))) for part in (force, moment))
                lines.append(f"{name:<24} " + " ".join(f"{size:>12.6g}" for size in sizes))
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        count = f"{len(self.body_names)} {'body' if len(self.body_names) == 1 else 'bodies'}"
        known = {True: "stable", False: "unstable", None: "stability not examined"}[self.stable]
        neutral = f", free to move: {', '.join(self.neutral)}" if self.neutral else ""
        return (
            f"StaticResult({count} at t = {self.t:g} s, {known}{neutral}; "
            f"{self.iterations} iterations, residual {self.residual:.1e})"
        )

    def _index(self, body: str) -> int:
        if body not in self.body_names:
            raise KeyError(f"body {body!r}; the bodies are {', '.join(self.body_names)}")
        return self.body_names.index(body)


def static_equilibrium(system: System, *, tol: float = 1e-10, max_iterations: int = 200) -> StaticResult:
    """Find the equilibrium reached from a system's initial pose, functions of time frozen at ``system.t0``.

    Parameters
    ----------
    system : System
        Its pose is made consistent, and left at the equilibrium with zero velocities.
    tol : float
        Largest unbalanced force relative to the weight of the heaviest body or the largest load.
    max_iterations : int

    Raises
    ------
    SingularModelError
        If a body is free to move and its loads do not balance: it is named.
    ModelError
        If the iteration does not converge; the body with the largest unbalanced force is named.
    """
    if not tol > 0.0 or max_iterations < 1:
        raise ModelError(f"tol = {tol}, max_iterations = {max_iterations}; both must be positive")
    if system.report is None:
        system.initialise()
    system.configuration = system.configuration.at_rest()
    instant = Instant(system, "I3")
    instant.y = instant.settle(instant.stop(instant.y))
    iterations, size = equilibrium(Relaxation(instant, tol), max_iterations)
    system.configuration = instant.configuration()
    system.state_start = instant.y[instant.block("z", "mu")].copy()
    return _result(instant, iterations, size)


def _result(instant: Instant, iterations: int, size: float) -> StaticResult:
    system = instant.system
    solution = EquilibriumSolution.of(
        [Snapshot.of(instant)], f"static equilibrium found in {iterations} iterations", iterations
    )
    joints = system.model.rows_of_joint
    reactions = {joint: (solution.reaction(joint)[0][0], solution.reaction(joint)[1][0]) for joint in joints}
    loads = {name: (solution.load(name)[0][0], solution.load(name)[1][0]) for name in system.force_names}
    neutral: list[str] = []
    stable = None
    if system.model.counts.coordinates <= DENSE_LIMIT:
        stable, motion = free_motions(reduce(instant))
        shapes = instant.spatial(motion)
        neutral = list(dict.fromkeys(describe(s, system.body_names, system.length)[0] for s in shapes))
    return StaticResult(
        instant.t,
        system.body_names,
        instant.pose(),
        solution.multipliers[0].copy(),
        reactions,
        loads,
        iterations,
        size,
        neutral,
        stable,
        solution,
    )


# Sequences of static equilibria, each followed from the one before.


SMALLEST_STEP = 1e-4
"""Part of the span of a sequence of equilibria below which a step of time is not halved any more."""


def initial_conditions(system: System) -> Solution:
    """Return a system's consistent start, with accelerations and reactions, as a solution of one time."""
    snapshot = Snapshot.of(Instant(system, "SI2"))
    message = "positions, velocities and accelerations are consistent"
    return Solution(system, snapshot.problem, snapshot.result(message, 0, [snapshot]))


def quasi_static(system: System, times: np.ndarray, *, tol: float = 1e-10, max_iterations: int = 200) -> Solution:
    """Follow the equilibrium over a sequence of times, each reached from the one before.

    Newton's method follows it; where one step of time leads too far it is halved, and where the equilibrium ends the
    next one is sought as from afar.

    Parameters
    ----------
    system : System
        Compiled for the first time.
    times : ndarray, shape (m,)
        Increasing times at which functions of time are frozen, s.
    tol, max_iterations
        As in :func:`static_equilibrium`, for each time.

    Raises
    ------
    ModelError, SingularModelError
        As :func:`static_equilibrium`; the time is named.
    """
    if times.size == 0 or not np.all(np.diff(times) > 0.0):
        raise ModelError("times: give increasing times")
    instant = static_equilibrium(system, tol=tol, max_iterations=max_iterations).solution.instant()
    rows, total = [], 0
    for target in times:
        step = float(target) - instant.t
        while True:
            kept = instant.t, instant.y.copy(), instant.idata.copy(), instant.rdata.copy()
            last = instant.t + step >= float(target) - 1e-12 * abs(step)
            instant.t = float(target) if last else instant.t + step
            iterations = Relaxation(instant, tol).newton()
            if iterations is None:
                instant.t, instant.y, instant.idata, instant.rdata = kept
                step *= 0.5
                if abs(step) >= SMALLEST_STEP * float(times[-1] - times[0]) and step != 0.0:
                    continue
                # no equilibrium nearby: let it fall to the next one
                instant.t = float(target)
                try:
                    iterations, _ = equilibrium(Relaxation(instant, tol), max_iterations)
                except ModelError as error:
                    raise type(error)(f"at t = {instant.t:.6g} s: {error}") from error
                last = True
            total += iterations
            if last:
                break
        rows.append(Snapshot.of(instant))
    return EquilibriumSolution.of(rows, f"{times.size} static equilibria found in {total} iterations", total)
