"""Forward sensitivities: the variational equations along a run that is known.

The solution of G(t, y, y', p) = 0 depends on a parameter p by s = dy/dp, with

    dG/dy s + dG/dy' s' + dG/dp = 0,

a linear DAE. It is solved behind the run, step by step along its own points ("staggered direct"), by the same
variable-coefficient BDF and with the exact Jacobian of the problem,

    (dG/dy + gamma dG/dy') s = -(dG/dy' s'_past + dG/dp),   s' = gamma s + s'_past,

one factorisation a step for all parameters. On the right stands the rate at which the residual changes with the
parameter, one difference. So no law needs a derivative by its parameters: it suffices that the problem can be made at
p + d and at p - d. The compiled loop stands in `gearmbs.dae.tangent_steps`.

References
----------
.. [1] M. Caracotsios, W. E. Stewart, "Sensitivity analysis of initial value problems with mixed ODEs and algebraic
       equations", Computers & Chemical Engineering 9 (1985) 359-365.
.. [2] T. Maly, L. R. Petzold, "Numerical methods and software for sensitivity analysis of differential-algebraic
       systems", Applied Numerical Mathematics 20 (1996) 57-79.
"""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.linalg.lu_plan import SingularMatrixError, analyse
from gearmbs.dae.linalg.several import has_lanes
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, factor, new_factors
from gearmbs.dae.problem import EPS, DAEProblem, ModelError
from gearmbs.dae.result import DAEResult
from gearmbs.dae.tangent_changes import carried_on, halts, narrowed, through_changes, together, unresolved
from gearmbs.dae.tangent_jumps import DEEP
from gearmbs.dae.tangent_points import AFRESH, END_OF_STEP, JUMP, SHORT, points_of, shorter
from gearmbs.dae.tangent_steps import follow_run
from gearmbs.dae.tangent_track import BY, Track
from gearmbs.kernels.lanes import LANES
from gearmbs.kernels.pointers import bind, direct, no_events, no_hook
from gearmbs.kernels.structs import LINE

NOTHING, ROUGH = 1e2 * EPS / BY, 1e-2
"""Part of an unknown's largest value, or typical magnitude, up to which its sensitivity may be rounding: the residual
is rounded to EPS of its terms, which are moved by `BY`, and steps add up to some of it. It is if it is rough, too:
local errors are more than that part of it."""
DIVIDED_ORDER = 3
"""Order of the formula within steps that a first division has not made short enough: there second derivatives jump."""
SHORTEST = 1e-3
"""Part of a step of the run below which none is divided further: equations that jump there are as wrong in any step."""
AGAIN, SMALLER = 4, 0.5
"""How often a run is followed at most for a local error as part of the largest value, and the part of that of the time
before from which on this has been found."""
CHUNK = 2048
"""Points at a time: their unknowns are laid out for the compiled loop."""
EIGHT = 8
"""Bytes of a number."""
LEADING = 1e6
"""Leading coefficient, 1/s, with which the matrix is looked at for dG/dy'."""
NO_SOLUTION = (
    "sensitivities at t = {:.6g} s: the linearised equations have no unique solution there, as at a singular position; "
    "end the run before it"
)
JUMPS = (
    "parameter {!r}: at t = {:.6g} s the equations jump, or change as if they did, at a time that depends on it, "
    "and its derivatives with them. This is not followed where they only just come to it, or again and again; let what "
    "jumps take a larger width (STEP), or a time that does not depend on the parameter"
)
JUMP_COUNTS = 1e-3
"""Part of the largest sensitivity of an unknown by which a jump that is not followed may falsify it: what the steps
leave of it is as much."""
MANY = 1024
"""Jumps and narrow changes that are gone through in points of their own, fewer than that."""
SCRATCH = (
    "plus", "minus", "other", "terms", "row_scale", "yp_moved", "between", "found", "most_rate", "first_seen",
    "seen_between", "last_seen",
)  # fmt: skip
"""Members of a track that start as zeros, one of each unknown."""


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
        Whether jumps, and changes that are narrow beside the run's steps, are looked for and crossed, which takes as
        long as all the rest with few directions. Without, what they add
        is missing in silence: for matrices whose worth shows by itself, as Newton's.
    local_error : float, optional
        Local error of a step that is allowed, as in `Followed`: where it is larger at the steps of the run these are
        divided. Default: whatever they leave.

    Raises
    ------
    ModelError
        If the equations for the sensitivities have no unique solution; if they jump and the run only just comes to
        that, or does so again and again.
    """
    assert result.sol is not None
    whole = points = points_of(result.sol, longest)
    changes = np.zeros((0, 3))
    alike: tuple[_Following, Followed] | None = None
    for attempt in range(AGAIN):
        first = _Following(problem, result, directions, jumps)
        followed = first.through(*points)
        missing = first.missing(directions)
        if alike is not None and not first.tr.lost_at.any():
            # all that was crossed comes at times of its own
            first, followed, points = *alike, whole
            break
        places = first.tr.changes[: first.tr.changed]
        if jumps and attempt == 0:
            ends = whole[0][whole[2] & END_OF_STEP != 0]
            places = np.concatenate([places, halts(first.run.t_min, ends)])
        before, changes = len(changes), together(changes, unresolved(first.narrowed(places), first.run.t_min, whole[0]))
        if not missing and len(changes) == before:
            break
        # too many, as of what rattles at a jump, or none that was not gone through
        if attempt == AGAIN - 1 or not before < len(changes) < MANY:
            raise ModelError(missing)
        points = through_changes(first.run.t_min, *whole, changes)
        all_jump = np.count_nonzero(points[2] & JUMP) == len(changes)
        alike = (first, followed) if attempt == 0 and not missing and all_jump else None
    if local_error is None or not (followed.error > local_error).any():
        return followed
    found, most = followed, first.most
    for _ in range(AGAIN):
        again = _Following(problem, result, directions, False)
        again.tr.allowed[:] = np.where(followed.error > 0.0, local_error * most, np.inf)
        again.tr.limited = True
        found = again.through(*points)
        # steps that are too long may have made them larger than they are
        if (again.most > SMALLER * most).all():
            break
        most = again.most
    return found


class _Following:
    """Where the compiled loop along a run stands, and what it is handed."""

    def __init__(self, problem: DAEProblem, result: DAEResult, directions: list[Direction], jumps: bool) -> None:
        assert result.sol is not None
        self.problem, self.run = problem, result.sol.polynomials()
        self.tr = _track(problem, directions, jumps)
        self.tr.times[0], self.tr.y[0], self.tr.before[0] = self.run.t_min, problem.y0, problem.y0
        for p, direction in enumerate(directions):
            self.tr.s[: self.tr.sides.size].reshape(-1, problem.n, LANES)[p // LANES, :, p % LANES] = direction.start
        self.outputs = np.ascontiguousarray(result.t)
        self.found = tuple(np.zeros((self.outputs.size * len(directions), problem.n)) for _ in range(2))
        hook = problem.hook if problem.hook is not None else no_hook
        alone = problem.alone.residual if problem.alone is not None else problem.residual
        self.bound = tuple(bind(one, problem.jacobian, hook, no_events) for one in (problem.residual, alone))
        self.tables = problem.idata.copy(), problem.rdata.copy(), np.zeros(problem.work_size)
        self.counted = np.zeros(len(problem.indices), dtype=bool)
        self.plan: Any = None
        self.factors: Any = None

    def missing(self, directions: list[Direction]) -> str:
        """Return what is said of a jump that is not in the sensitivities and counts; empty where none is."""
        for p, (direction, largest) in enumerate(zip(directions, self.each(self.tr.largest), strict=True)):
            # what does not change has its rounding beside it
            least = BY * (largest / self.tr.scale).max() * self.tr.scale
            if (self.tr.lost[p] > JUMP_COUNTS * np.maximum(largest, least)).any():
                return JUMPS.format(direction.name, self.tr.lost_at[p])
        return ""

    def narrowed(self, places: np.ndarray) -> np.ndarray:
        """Return when the jumps and narrow changes begin and end that are at some places, as `narrowed` does."""

        problem, goes_on = self.problem, self.tr.differential > 0.0

        def residual(t: float, end: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
            out, t = np.zeros(problem.n), min(max(t, self.run.t_min), float(self.outputs[-1]))
            # others jump with the equations, and in the run change over a step
            y = np.where(goes_on, self.run.evaluate(np.array([t]))[0], end[0])[0]
            problem.residual(t, y, end[1][0], out, *self.tables)
            return out * self.tr.row_scale

        ends = [self.run.evaluate(np.array([high])) for high in places[:, 1]]
        every = [narrowed(lambda t, end=end: residual(t, end), *one) for one, end in zip(places, ends, strict=True)]
        return np.array([one for one in every if one is not None]).reshape(-1, 3)

    @property
    def most(self) -> np.ndarray:
        """Largest sensitivity of unknowns under error control, as part of their typical magnitudes, by parameter."""
        return (self.each(self.tr.largest) * self.tr.tested).max(axis=1, initial=0.0)

    def each(self, lanes: np.ndarray) -> np.ndarray:
        """Return a table in lanes by parameter, shape (p, n)."""
        groups = lanes.reshape(-1, self.problem.n, LANES)
        return groups.swapaxes(1, 2).reshape(-1, self.problem.n)[: self.tr.parameters]

    def through(self, times: np.ndarray, orders: np.ndarray, flags: np.ndarray) -> Followed:
        """Follow the run through all points, as of `points_of`."""
        # where the run starts afresh the equations may have jumped already
        before_jump = np.append(flags[1:] & AFRESH != 0, False)
        looked = np.where(before_jump, np.nextafter(times, -np.inf), times)
        largest = self.tr.scale.copy()
        for begin in range(0, times.size, CHUNK):
            points = [np.ascontiguousarray(a[begin : begin + CHUNK]) for a in (times, looked, orders, flags)]
            y, yp = self.run.evaluate(points[0])
            for jump in np.flatnonzero(flags & JUMP):
                places, *there = carried_on(self.run.evaluate, times, flags, int(jump))
                inside = (places >= begin) & (places < begin + CHUNK)
                y[places[inside] - begin], yp[places[inside] - begin] = (one[inside] for one in there)
            largest = np.maximum(largest, np.abs(y).max(axis=0))
            at = 0
            while at < y.shape[0]:
                at = self.advance(at, points, y, yp)
                if at < y.shape[0] and self.tr.over > 1.0:
                    self.divide(*(a[at] for a in points))
                    at += 1
        most = self.most
        error = (self.each(self.tr.error) * self.tr.tested).max(axis=1, initial=0.0) / np.where(most > 0.0, most, 1.0)
        depends = ((self.each(self.tr.largest) > NOTHING * largest) & (self.tr.tested > 0.0)).any(axis=1)
        error[~depends & (error > ROUGH)] = 0.0
        shape = (self.outputs.size, self.tr.parameters, self.problem.n)
        s, sp = (one.reshape(shape).swapaxes(0, 1) for one in self.found)
        return Followed(s, sp, error)

    def advance(self, at: int, points: list[np.ndarray], y: np.ndarray, yp: np.ndarray) -> int:
        """Follow the run from one of some points on; return how many are done, fewer where a step is too long."""
        while at < y.shape[0]:
            fresh = self.plan is None
            if fresh:
                self.plan, self.factors = self.plan_at(points, at, y, yp)
            known = *self.bound, self.tr, self.plan, self.factors
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

    def plan_at(self, points: list[np.ndarray], at: int, y: np.ndarray, yp: np.ndarray) -> tuple[Any, Any]:
        """Return plan and factors with pivots chosen at a point."""
        problem, tr = self.problem, self.tr
        times, looked, orders, flags = points
        past = 1 if flags[at] & AFRESH else int(tr.n_past)
        gamma = sum(1.0 / (times[at] - tr.times[j]) for j in range(min(int(orders[at]), past, HISTORY - 1)))
        vals = np.zeros(len(problem.indices))
        problem.jacobian(looked[at], y[at], yp[at], gamma, vals, *self.tables)
        indptr, indices = (np.asarray(a, dtype=np.int64) for a in (problem.indptr, problem.indices))
        try:
            plan = analyse(indptr, indices, vals, np.asarray(problem.scale, dtype=float), counted=self.counted)
        except SingularMatrixError:
            raise ModelError(NO_SOLUTION.format(times[at])) from None
        factors = new_factors(plan)
        tr.by_lanes = has_lanes(plan)
        tr.row_scale[plan.row_from] = plan.row_scale
        growth = direct(factor)(plan, factors, vals)
        tr.growth_limit = max(GROWTH_LIMIT, 100.0 * growth)
        return plan, factors


def _track(problem: DAEProblem, directions: list[Direction], jumps: bool) -> Track:
    """Return the track of a run before its first point."""
    n, count = problem.n, len(directions)
    of_lanes = -(-count // LANES) * n * LANES
    owners = [_owners(problem, direction) for direction in directions]
    every = np.arange(n, dtype=np.int64)
    equations = [_joined([rows for _, rows in each]) if each else every for each in owners]
    rows, columns, slopes = _slopes(problem)
    return Track(
        parameters=count,
        points=0,
        n_past=1,
        newest=0,
        has_hook=problem.hook is not None,
        nonlinear_rates=problem.nonlinear_rates,
        constant_slopes=problem.constant_slopes,
        by_lanes=False,
        limited=False,
        jumps=jumps,
        unseen=0,
        changed=0,
        known=0,
        owner_place=problem.alone.place if problem.alone is not None else 0,
        owner_rest=problem.alone.rest if problem.alone is not None else 0,
        owner_sums=problem.alone.sums if problem.alone is not None else 0,
        growth_limit=GROWTH_LIMIT,
        gamma=0.0,
        looked=0.0,
        over=0.0,
        times=np.zeros(HISTORY),
        y=np.zeros((HISTORY, n)),
        before=np.zeros((HISTORY, n)),
        s=_on_line(HISTORY * of_lanes),
        place=_joined([d.places for d in directions]),
        weight=np.concatenate([np.zeros(0), *(d.weights for d in directions)]),
        first=_firsts([d.places for d in directions]),
        owner=_joined([np.array([element for element, _ in each], dtype=np.int64) for each in owners]),
        equation=_joined(equations),
        first_owner=_firsts(owners),
        first_equation=_firsts(equations),
        two_sided=np.zeros(count, dtype=np.int64),
        scale=np.asarray(problem.scale, dtype=float).copy(),
        differential=np.asarray(problem.goes_on, dtype=float),
        slope_row=rows,
        slope_col=columns,
        slope_value=slopes,
        indptr=np.asarray(problem.indptr).astype(np.int64),
        indices=np.asarray(problem.indices).astype(np.int64),
        vals=np.zeros(len(problem.indices)),
        rate=_on_line(n * LANES),
        solved=_on_line(n * LANES),
        kept=np.zeros(max(1, sum(d.places.size for d in directions))),
        rows=np.zeros((HISTORY * (1 + 2 * count), n)),
        old=problem.idata.astype(np.int64),
        table=np.zeros(len(problem.idata), dtype=np.int64),
        **{name: _on_line(of_lanes) for name in ("sides", "error", "largest")},
        tested=np.asarray(problem.error_mask, dtype=float) / np.asarray(problem.scale, dtype=float),
        allowed=np.full(count, np.inf),
        watched=np.asarray(problem.error_mask & problem.differential, dtype=float),
        left=np.zeros((HISTORY, n)),
        rates=np.zeros((HISTORY, n)),
        stack=np.zeros((3 * DEEP if jumps else 0, n)),
        looked_at=np.zeros((5, n)),
        lost=np.zeros((count, n)),
        lost_at=np.zeros(count),
        changes=np.zeros((MANY, 2)),
        **{name: np.zeros(n) for name in SCRATCH},
        **{name: np.zeros(HISTORY + 1) for name in ("value", "slope", "nodes")},
    )


def _on_line(size: int) -> np.ndarray:
    """Return zeros that begin on a line of the processor's cache, so that lanes are on one each."""
    room = np.zeros(size + LINE // EIGHT)
    first = -room.ctypes.data % LINE // EIGHT
    return room[first : first + size]


def _joined(lists: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.zeros(0, dtype=np.int64), *lists]).astype(np.int64)


def _firsts(lists: Sequence[Sized]) -> np.ndarray:
    """Return where each of some lists begins, one after the other, and the end of the last."""
    return np.cumsum([0, *map(len, lists)]).astype(np.int64)


def _owners(problem: DAEProblem, direction: Direction) -> list[tuple[int, np.ndarray]]:
    """Return the elements whose equations alone the numbers of a parameter enter, none if they enter others, too."""
    if problem.alone is None or not problem.constant_slopes or not direction.places.size:
        return []
    return problem.alone.owners(direction.places) or []


def _slopes(problem: DAEProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows, columns and values of the entries of dG/dy', none where they are not constant."""
    values = np.zeros((2, len(problem.indices)))
    if problem.constant_slopes:
        for out, leading in zip(values, (0.0, LEADING), strict=True):
            tables = problem.idata.copy(), problem.rdata.copy(), np.zeros(problem.work_size)
            problem.jacobian(problem.t0, problem.y0, problem.yp0, leading, out, *tables)
    slopes = (values[1] - values[0]) / LEADING
    there = np.flatnonzero(slopes)
    columns = np.repeat(np.arange(problem.n), np.diff(problem.indptr))
    rows = np.asarray(problem.indices)
    return rows[there].astype(np.int64), columns[there].astype(np.int64), slopes[there]
