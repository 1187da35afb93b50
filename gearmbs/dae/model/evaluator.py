"""Accelerations, multipliers, loads and reactions at all output times, in one compiled pass."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearmbs.dae.equations import accelerations as index1
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import (
    ROW_PHI,
    ROW_RATE,
    ROW_RECORD,
    joint_loads,
    loads_of_rows,
    pose_record,
    poses,
)
from gearmbs.dae.equations.bodies.body import body_from_pose
from gearmbs.dae.equations.kinematics import track, turns_are_counted, update_tables
from gearmbs.dae.equations.loads.reactions import renew_reactions
from gearmbs.dae.equations.residual import update
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, best_reference
from gearmbs.dae.equations.unknowns import COUNT, I3, NUMBERS, PLACES, compressed
from gearmbs.dae.linalg.entry_lists import FEWEST_ENTRIES, LEAVING_PLANS
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, LUPlan, SingularMatrixError, analyse
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, GROWTH_LIMIT, LUFactors, factor, new_factors, solve, solve_pair
from gearmbs.dae.model.columns import Columns
from gearmbs.dae.model.records import (
    FARTHEST,
    RECORDS_TYPE,
    Records,
    allow_rounding,
    are_satisfied,
    displace,
    largest_violation,
)
from gearmbs.dae.problem import ModelError
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at

if TYPE_CHECKING:
    from gearmbs.dae.model.model import Configuration, Model
    from gearmbs.dae.problem import DAEProblem

_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]


GENERIC_TURNS = (0.1, 0.02, 0.3, 0.0)
"""Rotations, rad, off the position at which pivots are chosen, tried in turn: at special positions entries vanish by
accident and the pivots would not serve their neighbours."""
FIXED_TURNS = (0.0, *GENERIC_TURNS)
"""The same where pivots are those of one row alone: they are chosen for its very matrix first."""

SINGULAR = 1e-8
"""Relative singular value of the index-1 matrix below which a direction counts as undetermined."""

LOOKED_AT = 32
"""Entries of a matrix that are compared before the result is looked at: the processor compares several at once."""

REACTION_PASSES = 30
"""Most corrections of loads that depend on reactions, such as joint friction, to the multipliers of one output."""


@njit(cache=True, error_model="numpy", forceinline=True)
def unchanged(vals, before, allowed):
    """Whether no entry differs from another matrix's by more than allowed: most matrices that change do so early on."""
    same, first = True, 0
    while same and first < vals.size:
        for p in range(first, min(first + LOOKED_AT, vals.size)):
            same &= abs(vals[p] - before[p]) <= allowed[p]
        first += LOOKED_AT
    return same


@njit(cache=True, error_model="numpy", forceinline=True)
def project(t, at, phi, plan, factors, pair, idata, tab):
    """Move y to the nearest position and velocity, in the metric of the masses, that satisfy the constraints.

    Brings the tables up to date with it; returns the largest |Phi| before.

    Parameters
    ----------
    t : float
        Time, s.
    at : ndarray, shape (unknowns,)
        y, changed in place; conjugate momenta are left alone.
    phi : ndarray, shape (3 rows,)
        Violations at y, as `saddle` writes them.
    plan, factors : LUPlan, LUFactors
        The factored saddle-point matrix.
    pair : ndarray, shape (4, coordinates + rows)
        Scratch of `solve_pair`; left in its first two rows: displacements and changes of velocity, then multipliers.
    idata, tab : ndarray of int, Tables
        Integer tables, for their header, and the views of all.
    """
    rows = idata[T.H_ROWS]
    base = pair.shape[1] - rows
    strayed = 0.0
    for c in range(base):
        pair[0, c] = pair[1, c] = 0.0
    for r in range(rows):
        off, rate = phi[ROW_RECORD * r + ROW_PHI], phi[ROW_RECORD * r + ROW_RATE]
        strayed = max(strayed, abs(off))
        pair[0, base + r] = 0.0 if abs(off) > FARTHEST else -off
        pair[1, base + r] = -rate
    solve_pair(plan, factors, pair)
    displace(at, pair[0], pair[1], idata, tab)
    update_tables(t, at, tab, True)
    return strayed


@njit(cache=True, error_model="numpy", forceinline=True)
def write_row(k, t, at, multipliers, forces, moments, pose, idata, tab):
    """Write reactions and pose of one row of the records.

    Parameters
    ----------
    k : int
        Row.
    t : float
        Its time, s.
    at, multipliers : ndarray
        Its unknowns, with which the tables are up to date, and its multipliers.
    forces, moments : ndarray
        All rows of reactions one after the other, written.
    pose : ndarray
        Its poses, written.
    idata, tab : ndarray of int, Tables
    """
    rows = idata[T.H_ROWS]
    force, moment = matrix_at(forces, 3 * rows * k, rows, 3), matrix_at(moments, 3 * rows * k, rows, 3)
    loads_of_rows(multipliers, t, at, idata, tab, force, moment)
    poses(at, tab.at, tab.code, tab.kin, pose)


@njit(cache=True, error_model="numpy", nogil=True)
def _evaluate(
    first, last, t, y, slots, idata, rdata, work, vals, plan, factors, records, growth, rhs, pair, at, factored, allowed
):  # fmt: skip
    """Do what `evaluate_rows` promises, in arrays that its caller keeps alive.

    Parameters
    ----------
    first, last, t, y, slots, idata, rdata, work, vals, plan, factors, records, growth
        As of `evaluate_rows`.
    rhs, pair, at : ndarray, shapes (n,), (4, n) and (unknowns,)
        Right-hand side, pairs of right-hand sides and solutions, the unknowns of one row.
    factored, allowed : ndarray, shape (nnz,)
        The matrix that was factored last, and by how much its entries may differ from another's.
    """
    rows = records.force.shape[1]
    size = records.solution.shape[1]
    base = size - rows
    idata, slots, vals, t = uncounted(idata), uncounted(slots), uncounted(vals), uncounted(t)
    rhs, at, factored, allowed = uncounted(rhs), uncounted(at), uncounted(factored), uncounted(allowed)
    pair = matrix_at(pair, 0, 4, size)
    elements, columns, width = records.loads.shape[1], records.loads.shape[2], records.pose.shape[1]
    forces, moments = uncounted(records.force), uncounted(records.moment)
    tab = T.unpack(idata, rdata, work)
    only_assemble = last < first or idata[T.H_MODE] != NUMBERS
    if not only_assemble:
        allow_rounding(plan, allowed)
    # a call that is handed all tables costs a tenth of a microsecond
    counts_turns, has_reactions = turns_are_counted(tab), index1.has_reactions(tab)
    trusted = not only_assemble
    for k in range(first, first + 1 if only_assemble else last):
        for c in range(at.size):
            at[c] = y[k, c]
        phi = vector_at(records.phi, ROW_RECORD * rows * k, ROW_RECORD * rows)
        loads = matrix_at(records.loads, elements * columns * k, elements, columns)
        solution = vector_at(records.solution, size * k, size)
        update_tables(t[k], at, tab, True)
        if counts_turns and not only_assemble:
            track(t[k], at, tab, True)
        # steps of an integrator that keeps both positions and velocities on the constraints need no projection
        projected = rows == 0 or only_assemble or trusted
        passes = 0
        while True:
            if idata[T.H_MODE] == NUMBERS:
                vals[:] = 0.0
            count = index1.saddle(t[k], at, slots, vals, rhs, phi, loads, idata, tab, projected)
            if only_assemble:
                solution[:] = rhs
                if idata[T.H_MODE] == COUNT:
                    vals[0] = count
                return last
            if passes == 0 and projected == trusted:
                records.strayed[k] = largest_violation(phi)
                if are_satisfied(phi, tab) != trusted:
                    trusted = projected = not trusted
                    continue
            if passes == 0 and not unchanged(vals, factored, allowed):
                if not factor(plan, factors, vals) <= growth:
                    return k
                for p in range(vals.size):
                    factored[p] = vals[p]
            if not projected:
                # with its own factors: with those of the row before it would end up somewhere else
                records.strayed[k] = project(t[k], at, phi, plan, factors, pair, idata, tab)
                projected = True
                continue
            solve(plan, factors, rhs, solution)
            # loads that depend on reactions change the right-hand side only
            passes += 1
            if not has_reactions or passes > REACTION_PASSES:
                break
            if renew_reactions(at, vector_at(solution, base, rows), idata, tab) <= 1e-12:
                break
        pose = vector_at(records.pose, width * k, width)
        write_row(k, t[k], at, vector_at(solution, base, rows), forces, moments, pose, idata, tab)
    return last


@njit(
    int64(int64, int64, _VEC, _MAT, _IVEC, _IVEC, _VEC, _VEC, _VEC, PLAN_TYPE, FACTORS_TYPE, RECORDS_TYPE, float64),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def evaluate_rows(first, last, t, y, slots, idata, rdata, work, vals, plan, factors, records, growth):
    """Evaluate output rows from ``first``; return the row where new pivots are needed, or ``last``.

    Each row of y is first projected onto the constraints, from which the integrator and its interpolant drift within
    the tolerance; y itself is not changed.

    Parameters
    ----------
    first, last : int
        Rows ``first`` to ``last - 1``; if ``last`` is less than ``first``, row ``first`` is assembled but not solved.
    t : ndarray, shape (m,)
        Output times, s.
    y : ndarray, shape (m, unknowns)
    slots : ndarray of int
        Place of each entry of the matrix among its values.
    idata, rdata, work : ndarray
        Tables of the model. In the modes COUNT and PLACES of the header the entries are only counted or located.
    vals : ndarray, shape (nnz,)
        Values of the matrix in CSC order; in the mode COUNT the number of entries, in PLACES their rows and columns.
    plan, factors : LUPlan, LUFactors
        Of the saddle-point matrix; the factors are overwritten.
    records : Records
        Written.
    growth : float
        Largest growth from `factor` with which the pivots are kept.
    """
    size = records.solution.shape[1]
    rhs, pair, at = np.zeros(size), np.zeros((4, size)), np.zeros(y.shape[1])
    factored, allowed = np.full(vals.size, np.inf), np.zeros(vals.size)
    return _evaluate(
        first, last, t, y, slots, idata, rdata, work, vals, plan, factors, records, growth, rhs, pair, at, factored,
        allowed,
    )  # fmt: skip


@cache
def _no_factors() -> tuple[LUPlan, LUFactors]:
    """Return a plan and factors of the types that `evaluate_rows` takes, for when it factors nothing."""
    plan = analyse(np.array([0, 1]), np.array([0]), np.ones(1), np.ones(1))
    return plan, new_factors(plan)


def pattern(idata, rdata, work_size: int, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (indptr, indices, slots) of the saddle-point matrix in CSC form, the same at any t and y."""
    n = int(idata[T.H_COORDINATES] + idata[T.H_ROWS])
    slots = np.zeros(1, dtype=np.int64)
    ask = idata.copy()
    count = np.zeros(1)
    for mode in (COUNT, PLACES):
        ask[T.H_MODE] = mode
        places = count if mode == COUNT else np.zeros(2 * int(count[0]))
        assemble(np.array([t]), y[None, :], slots, ask, rdata.copy(), work_size, places)
    return compressed(places.reshape(-1, 2).astype(np.int64), n)


def new_records(m: int, bodies: int, rows: int, elements: int, diagnostics: int, modes: int = 0) -> Records:
    """Return empty records for m output times; ``diagnostics`` is the most that an element has."""
    return Records(
        np.zeros((m, POSE_COLUMNS * bodies + 2 * modes)),
        np.zeros((m, 6 * bodies + modes + rows)),
        np.zeros((m, max(elements, 1), index1.FORCE_RECORD + diagnostics)),
        np.zeros((m, 3 * rows)),
        np.zeros((m, rows, 3)),
        np.zeros((m, rows, 3)),
        np.zeros(m),
    )


def assemble(t, y, slots, idata, rdata, work_size, vals) -> Records:
    """Assemble the index-1 system at ``t[0], y[0]`` into ``vals`` and the right-hand side in ``solution``."""
    bodies, rows, elements = int(idata[T.H_BODIES]) - 1, int(idata[T.H_ROWS]), int(idata[T.H_FORCES])
    modes = int(idata[T.H_LAMBDA] - idata[T.H_QF])
    records = new_records(1, bodies, rows, elements, int(idata[T.H_DIAGNOSTICS]), modes)
    work = np.zeros(work_size)
    evaluate_rows(0, -1, t, y, slots, idata, rdata, work, vals, *_no_factors(), records, GROWTH_LIMIT)
    return records


# The acceleration system of a model at a configuration: masses, constraints, loads, and the unknowns y behind them.


POSE_PLACES = 6
"""Spatial displacements of a body, after which the modal coordinates come."""


class Assembled(NamedTuple):
    """The acceleration system of a model at a configuration, with the unknowns and tables it was made from."""

    matrix: Columns
    rhs: np.ndarray
    phi: np.ndarray
    loads: np.ndarray
    y: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray
    work: np.ndarray

    @property
    def codes(self) -> np.ndarray:
        """Euler reference of each body, the ground first."""
        first = int(self.idata[T.H_I_CODE])
        return self.idata[first : first + int(self.idata[T.H_BODIES])]


@njit(
    "void(float64[:, ::1], float64[::1], float64[::1], int64[::1], float64[::1], float64[::1], float64[::1])",
    cache=True,
    error_model="numpy",
)
def unknowns_from_pose(pose, q_f, v_f, idata, rdata, work, y):
    """Fill positions, velocities and momenta of y from a configuration.

    The Euler reference of each body becomes the one that is farther from its singularity.
    """
    tab = T.unpack(idata, rdata, work)
    for b in range(1, idata[T.H_BODIES]):
        row, at = pose[b - 1], tab.at[b]
        first = at[T.AT_V_MODES] - POSE_PLACES * pose.shape[0]
        for m in range(at[T.AT_MODES]):
            y[at[T.AT_QF] + m] = q_f[first + m]
            y[at[T.AT_VF] + m] = v_f[first + m]
        tab.code[b] = best_reference(row, POSE_A)
        body_from_pose(b, row, y, at, tab.code[b], tab.body[b], tab.modal, tab.partial, tab.kin, tab.scratch)


class Assembler:
    """Assembles the acceleration system of one model; its tables and its pattern are made once."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self._pattern: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    @cached_property
    def _tables(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Tables of integers and numbers, and the size of the work array."""
        return self.model.pack(I3)

    def at(self, configuration: Configuration, t: float, inner: np.ndarray | None, states: np.ndarray) -> Assembled:
        """Assemble at a configuration; ``inner`` holds loads and states, F to z of y; default: no loads, ``states``."""
        idata, rdata, size = self._tables
        idata, rdata, work = idata.copy(), rdata.copy(), np.zeros(size)
        y = np.zeros(int(idata[T.H_UNKNOWNS]))
        y[int(idata[T.H_Z]) : int(idata[T.H_Z]) + states.size] = states
        if inner is not None:
            y[int(idata[T.H_F]) :] = inner
        unknowns_from_pose(
            np.ascontiguousarray(configuration.pose), configuration.q_f, configuration.v_f, idata, rdata, work, y
        )
        if self._pattern is None:
            self._pattern = pattern(idata, rdata, size, t, y)
        indptr, indices, slots = self._pattern
        n = indptr.size - 1
        vals = np.zeros(indices.size)
        records = assemble(np.array([t]), y[None, :], slots, idata, rdata, size, vals)
        matrix = Columns(vals, indices, indptr, (n, n))
        return Assembled(matrix, records.solution[0], records.phi[0], records.loads[0], y, idata, rdata, work)

    def constraints(
        self, configuration: Configuration, t: float, states: np.ndarray
    ) -> tuple[Columns, np.ndarray, np.ndarray]:
        """Return Phi_q in spatial displacements and modal coordinates, Phi, and Phi_q v + Phi_t."""
        found = self.at(configuration, t, None, states)
        base = int(found.idata[T.H_COORDINATES])
        return found.matrix.below(base, base), found.phi[0::3].copy(), found.phi[1::3].copy()

    def constraint_jacobians(
        self, configurations: Sequence[Configuration], times: np.ndarray, states: np.ndarray
    ) -> list[Columns]:
        """Return Phi_q at each of some configurations."""
        places = zip(configurations, times.tolist(), strict=True)
        matrices = [self.at(configuration, t, None, states).matrix for configuration, t in places]
        base = int(self._tables[0][T.H_COORDINATES])
        return [matrix.below(base, base) for matrix in matrices]


class Evaluator:
    """Fills records piece by piece: what is found for one piece (pattern, pivots, counted turns) serves the next.

    Pieces are to be handed over in the order of time. Of a problem with a `home` each row is evaluated by itself, with
    the pivots that are chosen there, or if they do not serve with some of its own: neither pieces nor rows that were
    looked at before make a difference then, to the last digit.
    """

    def __init__(self, problem: DAEProblem) -> None:
        self.home = problem.home
        self._at_home: tuple[LUPlan | None, LUFactors | None, float] | None = None
        self.pattern = pattern(problem.idata, problem.rdata, problem.work_size, problem.t0, problem.y0)
        self.rdata = problem.rdata.copy()
        self.work = np.zeros(problem.work_size)
        self.vals = np.zeros(self.pattern[1].size)
        self.plan: LUPlan | None = None
        self.factors: LUFactors | None = None
        self.growth = GROWTH_LIMIT
        self.counted = np.zeros(self.vals.size, dtype=bool)
        self.plans = 0

    def fill(self, t: np.ndarray, y: np.ndarray, epochs, records: Records) -> None:
        """Fill ``records`` for all rows of ``y``; ``epochs`` names the integer tables valid from each row on.

        At a singular position, where constraints are dependent, the smallest accelerations and multipliers are taken.
        """
        y = np.ascontiguousarray(y)
        bounds = [row for row, _ in epochs] + [t.size]
        for (first, table), last in zip(epochs, bounds[1:]):
            table = np.ascontiguousarray(table)
            attempt = 0
            while first < last:
                if self.home is not None and self.plan is None and attempt == 0:
                    self._go_home()
                elif self.plan is None or attempt > 0:
                    place = t[first : first + 1], y[first : first + 1]
                    turns = GENERIC_TURNS if self.home is None else FIXED_TURNS
                    if attempt > len(turns):
                        self._evaluate_singular(first, *place, table, records)
                        first, attempt, self.plan = first + 1, 0, None
                        continue
                    if attempt > 1 or self.home is not None or not self._choose_sparsely(*place, table):
                        self._choose_pivots(*place, table, turns[max(attempt, 1) - 1])
                stop = last if self.home is None else first + 1
                done = self._evaluate_rows(first, stop, t, y, table, records)
                if self.home is not None and attempt > 0 and done > first:
                    # these pivots were those of this row
                    self.plan = None
                attempt = attempt + 1 if done == first else 1 if done < stop else 0
                first = done

    def _evaluate_rows(self, first: int, last: int, t: np.ndarray, y: np.ndarray, table: np.ndarray, records) -> int:
        """Evaluate rows one after the other."""
        return evaluate_rows(
            first, last, t, y, self.pattern[2], table, self.rdata, self.work, self.vals, self.plan, self.factors,
            records, self.growth,
        )  # fmt: skip

    def _evaluate_singular(self, row: int, t: np.ndarray, y: np.ndarray, table: np.ndarray, records: Records) -> None:
        """Evaluate a row at a singular position; ``t`` and ``y`` hold it alone."""
        _least_squares_row(row, t, y, self.pattern, table, self.rdata, self.work.size, records)

    def _choose_sparsely(self, t: np.ndarray, y: np.ndarray, table: np.ndarray) -> bool:
        """Choose pivots at one row, if there entries can be left out that have been negligible so far."""
        self.plans += 1
        if self.vals.size < FEWEST_ENTRIES or self.plans > LEAVING_PLANS:
            return False
        self._choose_pivots(t, y, table, 0.0, self.counted)
        assert self.plan is not None
        return self.plan.left_src.size > 0

    def _choose_pivots(
        self, t: np.ndarray, y: np.ndarray, table: np.ndarray, turn: float, counted: np.ndarray | None = None
    ) -> None:
        """Choose pivots near one row, every angle turned off it so that no entry is zero by accident."""
        self.vals[:] = 0.0
        assemble(t, _turned(y, table, turn), self.pattern[2], table, self.rdata, self.work.size, self.vals)
        self._choose(self.vals, float(t[0]), counted)

    def _go_home(self) -> None:
        """Take the pivots of all outputs."""
        if self._at_home is None:
            self._choose(self.matrix_at_home())
            self._at_home = self.plan, self.factors, self.growth
        self.plan, self.factors, self.growth = self._at_home

    def matrix_at_home(self) -> np.ndarray:
        """Return the values of the matrix that the pivots of all outputs are chosen for."""
        assert self.home is not None
        t, y, table, rdata = self.home
        vals = np.zeros(self.vals.size)
        assemble(np.array([t]), y[None, :], self.pattern[2], table, rdata.copy(), self.work.size, vals)
        return vals

    def _choose(self, vals: np.ndarray, t: float = 0.0, counted: np.ndarray | None = None) -> None:
        """Choose pivots for values of the matrix at a time."""
        indptr, indices, _ = self.pattern
        try:
            self.plan = analyse(indptr, indices, vals, np.ones(indptr.size - 1), counted=counted, with_tail=False)
        except SingularMatrixError as error:
            raise ModelError(
                f"the equations are singular to rounding at t = {t:.6g} s: look for masses and moments of inertia "
                "that differ by too many orders of magnitude"
            ) from error
        self.factors = new_factors(self.plan)
        # an ill-scaled mechanism may grow with the best of pivots
        self.growth = max(GROWTH_LIMIT, 100.0 * factor(self.plan, self.factors, vals))


def _least_squares_row(k: int, t, y, matrix_pattern, idata, rdata, work_size, records: Records) -> None:
    """Fill row k of the records at a singular position by least squares."""
    indptr, indices, slots = matrix_pattern
    vals, n = np.zeros(indices.size), indptr.size - 1
    one = assemble(t, y, slots, idata, rdata, work_size, vals)
    matrix = Columns(vals, indices, indptr, (n, n)).toarray()
    # rows and columns to one size first, or masses and constraints would be told apart by their units
    scale = 1.0 / np.sqrt(np.maximum(np.abs(matrix).max(axis=1), 1e-300))
    scaled = scale[:, None] * matrix * scale
    records.solution[k] = scale * np.linalg.lstsq(scaled, scale * one.solution[0], rcond=SINGULAR)[0]
    records.loads[k], records.phi[k] = one.loads[0], one.phi[0]
    work = np.zeros(work_size)
    update(t[0], y[0], y[0], idata, rdata, work)
    pose_record(y[0], idata, rdata, work, records.pose[k])
    rows = records.force.shape[1]
    multipliers = np.zeros((2, max(rows, 1)))
    multipliers[0, :rows] = records.solution[k, n - rows :]
    multipliers[1, 0] = t[0]
    joint_loads(y[0], idata, rdata, work, multipliers, records.force[k], records.moment[k])


def _turned(y: np.ndarray, idata: np.ndarray, angle: float) -> np.ndarray:
    """Return a copy of y with every Euler angle turned differently, so that no entry is zero by accident."""
    y = y.copy()
    angles = slice(int(idata[T.H_THETA]), int(idata[T.H_QF]))
    y[0, angles] += angle * np.sin(1.0 + np.arange(angles.stop - angles.start))
    return y
