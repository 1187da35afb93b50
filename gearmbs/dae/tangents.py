"""Forward sensitivities: the variational equations along a run that is known.

The solution of G(t, y, y', p) = 0 depends on a parameter p by s = dy/dp, with

    dG/dy s + dG/dy' s' + dG/dp = 0,

a linear DAE. It is solved behind the run, step by step along its own points ("staggered direct"), by the same
variable-coefficient BDF and with the exact Jacobian of the problem,

    (dG/dy + gamma dG/dy') s = -(dG/dy' s'_past + dG/dp),   s' = gamma s + s'_past,

one factorisation a step for all parameters. On the right stands the rate at which the residual changes with the rates
along s'_past, in which it is linear, and with the parameter: one difference in both. So no law needs a
derivative by its parameters: it suffices that the problem can be made at p + d and at p - d.

References
----------
.. [1] M. Caracotsios, W. E. Stewart, "Sensitivity analysis of initial value problems with mixed ODEs and algebraic
       equations", Computers & Chemical Engineering 9 (1985) 359-365.
.. [2] T. Maly, L. R. Petzold, "Numerical methods and software for sensitivity analysis of differential-algebraic
       systems", Applied Numerical Mathematics 20 (1996) 57-79.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import float64, int64

from gearmbs.dae.integrators.bdf import HISTORY, error_constant
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, SingularMatrixError, analyse
from gearmbs.dae.linalg.several import SIDES, solve_sides
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, GROWTH_LIMIT, factor, new_factors, solve
from gearmbs.dae.problem import EPS, HISTORY_CHANGED, DAEProblem, ModelError
from gearmbs.dae.result import DAEResult, lagrange_weights
from gearmbs.dae.tangent_jumps import look_for_jumps
from gearmbs.dae.tangent_points import AFRESH, END_OF_STEP, SHORT, points_of, shorter
from gearmbs.dae.tangent_track import TRACK_TYPE, Track, size_of_move, slot_of
from gearmbs.kernels.bound import unbound
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import FUNCTIONS_TYPE, bind, direct, no_events, no_hook

BY = 1e-8
"""Part of a parameter's own scale, and of the rates along the past, by which the residual is moved: where it is not
linear in both together this leaves 1e-8, and the rounding 1e-16/1e-8, of the terms."""
NOTHING, ROUGH = 1e2 * EPS / BY, 1e-2
"""Part of an unknown's largest value, or typical magnitude, up to which its sensitivity may be rounding: the residual
is rounded to EPS of its terms, which are moved by `BY`, and steps add up to some of it. It is if it is rough, too:
local errors are more than that part of it."""
DIVIDED_ORDER = 3
"""Order of the formula within steps that a first division has not made short enough: there second derivatives jump."""
SHORTEST = 1e-3
"""Part of a step of the run below which none is divided further: equations that jump there are as wrong in any step."""
TOGETHER = 3
"""Steps that are looked at for jumps at once."""
FEW = 2
"""Parameters up to which solving for one after the other is faster than for `SIDES` at once."""
CHUNK = 2048
"""Points at a time: their unknowns are laid out for the compiled loop."""
NO_SOLUTION = (
    "sensitivities at t = {:.6g} s: the linearised equations have no unique solution there, as at a singular position; "
    "end the run before it"
)
JUMPS = (
    "parameter {!r}: at t = {:.6g} s the equations jump, at a time that depends on it, and its derivatives with them, "
    "which is not followed; let what jumps take a width (STEP), or a time that does not depend on the parameter"
)
JUMP_COUNTS = 1e-3
"""Part of the largest sensitivity of an unknown by which a jump that is not followed may falsify it: what the steps
leave of it is as much."""
SCRATCH = (
    "plus", "minus", "yp_moved", "rate", "found", "most_rate", "between", "first_seen", "seen_between", "last_seen"
)  # fmt: skip
"""Members of a track that start as zeros, one of each unknown."""
_VEC, _MAT, _IVEC = float64[::1], float64[:, ::1], int64[::1]


@njit(cache=True, nogil=True, error_model="numpy")
def _foretell(functions, tr, k, past, p, side, y, yp, idata, rdata, work):
    """Write what the past says of a parameter's sensitivities to their row, and the right-hand side of their equations.

    Parameters
    ----------
    functions, tr, k, y, yp, idata, rdata, work
        As of `_step`, with the residual itself in ``minus``, and in ``value`` the weights with which ``past`` points
        foretell the next.
    past : int
    p, side : int
        The parameter, and the row of ``sides`` that takes its right-hand side.
    """
    n, count = tr.scale.shape[0], tr.parameters
    s, slope, foretold, plus = tr.s, tr.slope, tr.rate, tr.sides[side]
    row = slot_of(tr, 1) * count + p
    for i in range(n):
        foretold[i] = slope[1] * s[row, i]
    for j in range(2, k + 1):
        row = slot_of(tr, j) * count + p
        for i in range(n):
            foretold[i] += slope[j] * s[row, i]
    # what the polynomial through the past says tells the error
    new = slot_of(tr, 0) * count + p
    for i in range(n):
        s[new, i] = 0.0
    for j in range(past):
        w, row = tr.value[j], slot_of(tr, j + 1) * count + p
        for i in range(n):
            s[new, i] += w * s[row, i]
    by = BY
    if tr.nonlinear_rates:
        by = min(BY, size_of_move(tr, s, new))
    first, last = tr.first[p], tr.first[p + 1]
    for q in range(first, last):
        tr.kept[q] = rdata[tr.place[q]]
        rdata[tr.place[q]] += by * tr.weight[q]
    for i in range(n):
        tr.yp_moved[i] = yp[i] + by * foretold[i]
    functions.residual(tr.looked, y, tr.yp_moved, plus, idata, rdata, work)
    for q in range(first, last):
        rdata[tr.place[q]] = tr.kept[q]
    for i in range(n):
        plus[i] = (tr.minus[i] - plus[i]) / by


@njit(cache=True, nogil=True, error_model="numpy")
def _step(functions, tr, plan, factors, t, k, y, yp, may_be_refused, idata, rdata, work):
    """Find the sensitivities at ``t`` by the order-k formula.

    The history has been moved back by one point: what is sought stands in the newest slot.

    Parameters
    ----------
    functions, tr, plan, factors
        As of `follow_run`.
    t : float
        Where the equations are looked at.
    k : int
    y, yp : ndarray, shape (n,)
        The run there.
    may_be_refused : bool
        Whether a local error that is not allowed refuses the step.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.

    Returns
    -------
    served : bool
        Whether the pivots do, and the local error is allowed: ``tr.over`` is more than 1 if it is not.
    """
    n, count = tr.scale.shape[0], tr.parameters
    times, s, nodes = tr.times, tr.s, tr.nodes
    nodes[0] = t
    for j in range(k):
        nodes[j + 1] = times[j + 1]
    # slopes of the polynomial through the new point and k past ones; the new point's own is gamma
    lagrange_weights(t, nodes, k + 1, tr.value, tr.slope)
    slope = tr.slope
    gamma = slope[0]
    tr.gamma, tr.looked, tr.over = gamma, t, 0.0
    functions.jacobian(t, y, yp, gamma, tr.vals, idata, rdata, work)
    growth = factor(plan, factors, tr.vals)
    if not growth <= tr.growth_limit:
        return False
    functions.residual(t, y, yp, tr.minus, idata, rdata, work)
    past = min(k + 1, tr.n_past)
    for j in range(past):
        nodes[j] = times[j + 1]
    for j in range(past):
        w = 1.0
        for m in range(past):
            if m != j:
                w *= (t - nodes[m]) / (nodes[j] - nodes[m])
        tr.value[j] = w
    # of the first steps behind a start, of which as many past points tell as the formula takes, nothing is known
    told = error_constant(t, nodes, k) if past > k else 0.0
    for begin in range(0, count, SIDES):
        end = min(begin + SIDES, count)
        for p in range(begin, end):
            _foretell(functions, tr, k, past, p, p - begin, y, yp, idata, rdata, work)
        if end - begin > FEW:
            for side in range(end - begin, SIDES):
                for i in range(n):
                    tr.sides[side, i] = 0.0
            solve_sides(plan, factors, tr.sides, tr.solved)
        else:
            for side in range(end - begin):
                solve(plan, factors, tr.sides[side], tr.sides[side])
        for p in range(begin, end):
            found, new = tr.sides[p - begin], slot_of(tr, 0) * count + p
            most = 0.0
            for i in range(n):
                tr.local[p, i] = told * abs(found[i] - s[new, i])
                most = max(most, tr.tested[i] * tr.local[p, i])
                s[new, i] = found[i]
            tr.over = max(tr.over, most / tr.allowed[p])
    if tr.over > 1.0 and may_be_refused:
        return False
    for p in range(count):
        new = slot_of(tr, 0) * count + p
        for i in range(n):
            tr.error[p, i] = max(tr.error[p, i], tr.local[p, i])
            tr.largest[p, i] = max(tr.largest[p, i], abs(s[new, i]))
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _write_outputs(tr, k, outputs, s_out, sp_out):
    """Write sensitivities and their rates at the outputs up to the newest point, on its polynomial."""
    count, n = tr.parameters, tr.scale.shape[0]
    while tr.seen < outputs.shape[0] and outputs[tr.seen] <= tr.times[0]:
        m = tr.seen
        lagrange_weights(outputs[m], tr.times, k + 1, tr.value, tr.slope)
        for p in range(count):
            for i in range(n):
                v, d = 0.0, 0.0
                for j in range(k + 1):
                    row = slot_of(tr, j) * count + p
                    v += tr.value[j] * tr.s[row, i]
                    d += tr.slope[j] * tr.s[row, i]
                s_out[m * count + p, i] = v
                sp_out[m * count + p, i] = d
        tr.seen = m + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _change_coordinates(functions, tr, t, rdata, work):
    """Rewrite sensitivities as the hook has rewritten the points that they belong to.

    The hook decides by the first row: it is handed the old points, each with those moved along its sensitivities.
    """
    n, count, past = tr.scale.shape[0], tr.parameters, tr.n_past
    width = 1 + 2 * count
    for j in range(past):
        for i in range(n):
            tr.rows[j * width, i] = tr.before[j, i]
        for p in range(count):
            row = slot_of(tr, j) * count + p
            by = size_of_move(tr, tr.s, row)
            for i in range(n):
                tr.rows[j * width + 1 + 2 * p, i] = tr.before[j, i] + by * tr.s[row, i]
                tr.rows[j * width + 2 + 2 * p, i] = tr.before[j, i] - by * tr.s[row, i]
    for i in range(tr.old.shape[0]):
        tr.table[i] = tr.old[i]
    # what it counts in the table of numbers is counted already
    numbers = rdata.copy()
    functions.hook(t, tr.rows, past * width, tr.table, numbers, work)
    for j in range(past):
        for p in range(count):
            by = size_of_move(tr, tr.s, slot_of(tr, j) * count + p)
            for i in range(n):
                moved = tr.rows[j * width + 1 + 2 * p, i] - tr.rows[j * width + 2 + 2 * p, i]
                tr.rows[j * width + 1 + 2 * p, i] = moved / (2.0 * by)
    for j in range(past):
        for p in range(count):
            row = slot_of(tr, j) * count + p
            for i in range(n):
                tr.s[row, i] = tr.rows[j * width + 1 + 2 * p, i]


@njit(
    int64(
        FUNCTIONS_TYPE, TRACK_TYPE, PLAN_TYPE, FACTORS_TYPE, int64, _VEC, _VEC, _IVEC, _IVEC, _MAT, _MAT,
        _VEC, _MAT, _MAT, _IVEC, _VEC, _VEC,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)  # fmt: skip
def follow_run(
    bound, tr, plan, factors, start, times, looked, orders, flags, y, yp, outputs, s_out, sp_out, idata, rdata, work
):
    """Follow a run from point ``start`` on; return the number of points, or the first that needs new pivots.

    Parameters
    ----------
    bound, tr, plan, factors
        Functions of the problem, the `Track`, plan and numbers of the factorisation.
    start : int
    times, looked : ndarray, shape (m,)
        Times of the points, and where the equations are looked at: before a jump.
    orders, flags : ndarray of int64, shape (m,)
        Orders of the formula at most; `END_OF_STEP` and `AFRESH`.
    y, yp : ndarray, shape (m, n)
        The run there.
    outputs, s_out, sp_out : ndarray
        Output times, and sensitivities and their rates there, all parameters of one output after another.
    idata, rdata, work : ndarray
        Tables of the problem as the run has left them at the point before, and scratch.
    """
    functions = unbound(bound)
    n, count = tr.scale.shape[0], tr.parameters
    for m in range(start, times.shape[0]):
        afresh = flags[m] & AFRESH != 0
        if afresh:
            tr.n_past = 1
        past = min(tr.n_past, HISTORY - 1)
        for j in range(past, 0, -1):
            tr.times[j] = tr.times[j - 1]
            for i in range(n):
                tr.y[j, i] = tr.y[j - 1, i]
        tr.newest = slot_of(tr, HISTORY - 1)
        k = min(orders[m], past)
        may_be_refused = flags[m] & SHORT == 0
        if not _step(functions, tr, plan, factors, looked[m], k, y[m], yp[m], may_be_refused, idata, rdata, work):
            for j in range(past):
                tr.times[j] = tr.times[j + 1]
                for i in range(n):
                    tr.y[j, i] = tr.y[j + 1, i]
            tr.newest = slot_of(tr, 1)
            return m
        tr.times[0] = times[m]
        for i in range(n):
            tr.y[0, i] = y[m, i]
        if afresh:
            # algebraic unknowns may jump where a run starts afresh, and be impulses in a start that was repaired
            for i in range(n):
                if tr.differential[i] == 0.0:
                    tr.y[1, i] = tr.y[0, i]
                    for p in range(count):
                        tr.s[slot_of(tr, 1) * count + p, i] = tr.s[slot_of(tr, 0) * count + p, i]
        if tr.jumps:
            tr.unseen += 1
            # as many steps at once as the next polynomial would not go through, and none across a restart
            following = m + 1
            goes_on = following < times.shape[0] and flags[following] & AFRESH == 0
            if tr.unseen == TOGETHER or not goes_on or orders[following] <= tr.unseen:
                look_for_jumps(functions, tr, plan, factors, k, tr.unseen, yp[m], idata, rdata, work)
                tr.unseen = 0
        tr.n_past = min(past + 1, HISTORY)
        _write_outputs(tr, k, outputs, s_out, sp_out)
        if tr.has_hook and flags[m] & END_OF_STEP != 0:
            for j in range(tr.n_past):
                for i in range(n):
                    tr.before[j, i] = tr.y[j, i]
            if functions.hook(times[m], tr.y, tr.n_past, idata, rdata, work) == HISTORY_CHANGED:
                _change_coordinates(functions, tr, times[m], rdata, work)
                for i in range(idata.shape[0]):
                    tr.old[i] = idata[i]
    return times.shape[0]


@dataclass
class Direction:
    """How a problem depends on a parameter: its start and its table of numbers, by one of the parameter.

    Attributes
    ----------
    name : str
    start : ndarray, shape (n,)
        Sensitivities of the initial values.
    places : ndarray of int64, shape (q,)
        Places in ``rdata``.
    weights : ndarray, shape (q,)
    """

    name: str
    start: np.ndarray
    places: np.ndarray
    weights: np.ndarray


@dataclass
class Followed:
    """Sensitivities of a run at its outputs.

    Attributes
    ----------
    s, sp : ndarray, shape (p, m, n)
        Of the unknowns and of their rates.
    error : ndarray, shape (p,)
        Largest local error of a step in any unknown under error control, as part of the largest value, both as parts of
        the unknown's typical magnitude; 0 where no such unknown depends on the parameter by more than rounding.
    """

    s: np.ndarray
    sp: np.ndarray
    error: np.ndarray


def follow(
    problem: DAEProblem,
    result: DAEResult,
    directions: list[Direction],
    longest: float = np.inf,
    jumps: bool = True,
    local_error: float | None = None,
) -> Followed:
    """Return the sensitivities of a run at its outputs.

    Parameters
    ----------
    problem : DAEProblem
        As it was integrated.
    result : DAEResult
        With ``sol``: the run has to be known between its outputs (``dense_output``).
    directions : list of Direction
        The parameters.
    longest : float
        Longest step that the run was allowed, s.
    jumps : bool
        Whether jumps are looked for, which takes as long as all the rest with few directions. Without, what they add
        is missing in silence: for matrices whose worth shows by itself, as Newton's.
    local_error : float, optional
        Local error of a step that is allowed, as in `Followed`: where it is larger at the steps of the run these are
        divided. Default: whatever they leave.

    Raises
    ------
    ModelError
        If the equations for the sensitivities have no unique solution; if these jump, which is not followed.
    """
    assert result.sol is not None
    points = points_of(result.sol, longest)
    first = _Following(problem, result, directions, jumps)
    followed = first.through(*points)
    for p, direction in enumerate(directions):
        # what does not change has its rounding beside it
        least = BY * (first.tr.largest[p] / first.tr.scale).max() * first.tr.scale
        if (first.tr.lost[p] > JUMP_COUNTS * np.maximum(first.tr.largest[p], least)).any():
            raise ModelError(JUMPS.format(direction.name, first.tr.lost_at[p]))
    if local_error is None or not (followed.error > local_error).any():
        return followed
    again = _Following(problem, result, directions, False)
    again.tr.allowed[:] = np.where(followed.error > 0.0, local_error * first.most, np.inf)
    return again.through(*points)


class _Following:
    """Where the compiled loop along a run stands, and what it is handed."""

    def __init__(self, problem: DAEProblem, result: DAEResult, directions: list[Direction], jumps: bool) -> None:
        assert result.sol is not None
        self.problem, self.run = problem, result.sol.polynomials()
        self.tr = _track(problem, directions, jumps)
        self.tr.times[0], self.tr.y[0] = self.run.t_min, problem.y0
        for p, direction in enumerate(directions):
            self.tr.s[p] = direction.start
        self.outputs = np.ascontiguousarray(result.t)
        self.found = tuple(np.zeros((self.outputs.size * len(directions), problem.n)) for _ in range(2))
        hook = problem.hook if problem.hook is not None else no_hook
        self.bound = bind(problem.residual, problem.jacobian, hook, no_events)
        self.tables = problem.idata.copy(), problem.rdata.copy(), np.zeros(problem.work_size)
        self.plan: Any = None
        self.factors: Any = None

    @property
    def most(self) -> np.ndarray:
        """Largest sensitivity of unknowns under error control, as part of their typical magnitudes, by parameter."""
        return (self.tr.largest * self.tr.tested).max(axis=1, initial=0.0)

    def through(self, times: np.ndarray, orders: np.ndarray, flags: np.ndarray) -> Followed:
        """Follow the run through all points, as of `points_of`."""
        # where the run starts afresh the equations may have jumped already
        before_jump = np.append(flags[1:] & AFRESH != 0, False)
        looked = np.where(before_jump, np.nextafter(times, -np.inf), times)
        largest = self.tr.scale.copy()
        for begin in range(0, times.size, CHUNK):
            points = [np.ascontiguousarray(a[begin : begin + CHUNK]) for a in (times, looked, orders, flags)]
            y, yp = self.run.evaluate(points[0])
            largest = np.maximum(largest, np.abs(y).max(axis=0))
            at = 0
            while at < y.shape[0]:
                at = self.advance(at, points, y, yp)
                if at < y.shape[0] and self.tr.over > 1.0:
                    self.divide(*(a[at] for a in points))
                    at += 1
        most = self.most
        error = (self.tr.error * self.tr.tested).max(axis=1, initial=0.0) / np.where(most > 0.0, most, 1.0)
        depends = ((self.tr.largest > NOTHING * largest) & (self.tr.tested > 0.0)).any(axis=1)
        error[~depends & (error > ROUGH)] = 0.0
        shape = (self.outputs.size, self.tr.parameters, self.problem.n)
        s, sp = (one.reshape(shape).swapaxes(0, 1) for one in self.found)
        return Followed(s, sp, error)

    def advance(self, at: int, points: list[np.ndarray], y: np.ndarray, yp: np.ndarray) -> int:
        """Follow the run from one of some points on; return how many are done, fewer where a step is too long."""
        while at < y.shape[0]:
            fresh = self.plan is None
            if fresh:
                self.plan, self.factors = _plan_at(self.problem, self.tr, points, at, y, yp, *self.tables)
            known = self.bound, self.tr, self.plan, self.factors
            reached = direct(follow_run)(*known, at, *points, y, yp, self.outputs, *self.found, *self.tables)
            if reached < y.shape[0]:
                if self.tr.over > 1.0:
                    return reached
                if reached == at and fresh:
                    raise ModelError(NO_SOLUTION.format(points[0][at]))
                self.plan = None
            at = reached
        return at

    def divide(self, end: float, looked: float, order: int, flag: int) -> None:
        """Follow the run to the end of a step that is too long, in shorter ones."""
        t = float(self.tr.times[0])
        whole = end - t
        h, order, flag = whole, int(order), int(flag)
        while t < end:
            h = min(shorter(h, self.tr.over, order), end - t)
            # what is left over is no step of its own
            last = end - t < (1.0 + SHORTEST) * h
            to = end if last else t + h
            short = SHORT if to - t <= SHORTEST * whole else 0
            flags = flag & AFRESH | (flag & END_OF_STEP if last else 0) | short
            points = [np.array([to]), np.array([looked if last else to]), np.array([order]), np.array([flags])]
            if self.advance(0, points, *self.run.evaluate(points[0])):
                t, flag = to, flag & END_OF_STEP
            else:
                order = min(order, DIVIDED_ORDER)


def _plan_at(problem, tr, args, at, y, yp, idata, rdata, work):
    """Return plan and factors with pivots chosen at a point."""
    times, looked, orders = args[0], args[1], args[2]
    past = 1 if args[3][at] & AFRESH else int(tr.n_past)
    gamma = sum(1.0 / (times[at] - tr.times[j]) for j in range(min(int(orders[at]), past, HISTORY - 1)))
    vals = np.zeros(len(problem.indices))
    problem.jacobian(looked[at], y[at], yp[at], gamma, vals, idata, rdata, work)
    indptr, indices = (np.asarray(a, dtype=np.int64) for a in (problem.indptr, problem.indices))
    try:
        plan = analyse(indptr, indices, vals, np.asarray(problem.scale, dtype=float))
    except SingularMatrixError:
        raise ModelError(NO_SOLUTION.format(times[at])) from None
    factors = new_factors(plan)
    growth = direct(factor)(plan, factors, vals)
    tr.growth_limit = max(GROWTH_LIMIT, 100.0 * growth)
    return plan, factors


def _track(problem: DAEProblem, directions: list[Direction], jumps: bool) -> Track:
    """Return the track of a run before its first point."""
    n, count = problem.n, len(directions)
    first = np.cumsum([0, *(d.places.size for d in directions)]).astype(np.int64)
    numbers = int(first[-1])
    return Track(
        parameters=count,
        n_past=1,
        newest=0,
        has_hook=problem.hook is not None,
        nonlinear_rates=problem.nonlinear_rates,
        jumps=jumps,
        unseen=0,
        growth_limit=GROWTH_LIMIT,
        gamma=0.0,
        looked=0.0,
        over=0.0,
        times=np.zeros(HISTORY),
        y=np.zeros((HISTORY, n)),
        s=np.zeros((HISTORY * count, n)),
        place=np.concatenate([d.places for d in directions] or [np.zeros(0)]).astype(np.int64),
        weight=np.concatenate([d.weights for d in directions] or [np.zeros(0)]).astype(float),
        first=first,
        scale=np.asarray(problem.scale, dtype=float).copy(),
        differential=np.asarray(problem.goes_on, dtype=float),
        vals=np.zeros(len(problem.indices)),
        kept=np.zeros(max(1, numbers)),
        before=np.zeros((HISTORY, n)),
        rows=np.zeros((HISTORY * (1 + 2 * count), n)),
        old=problem.idata.astype(np.int64),
        table=np.zeros(len(problem.idata), dtype=np.int64),
        error=np.zeros((count, n)),
        largest=np.zeros((count, n)),
        local=np.zeros((count, n)),
        tested=np.asarray(problem.error_mask, dtype=float) / np.asarray(problem.scale, dtype=float),
        allowed=np.full(count, np.inf),
        watched=np.asarray(problem.error_mask & problem.differential, dtype=float),
        lost=np.zeros((count, n)),
        lost_at=np.zeros(count),
        sides=np.zeros((SIDES, n)),
        solved=np.zeros(n * SIDES),
        **{name: np.zeros(n) for name in SCRATCH},
        **{name: np.zeros(HISTORY + 1) for name in ("value", "slope", "nodes")},
    )
