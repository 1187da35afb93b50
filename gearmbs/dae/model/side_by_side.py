"""Records of eight neighbouring outputs side by side: what `gearmbs.dae.model.evaluator` does of one after the other.

All outputs of a model share the pattern of their matrices, the order of operations and the pivots. Only the bodies'
motion, the applied loads and terms of rare kinds are evaluated one after the other. `is_possible` tells of which models
this holds.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints.projection import EPS, ROUNDED_POSITION, ROUNDED_RATE, displace
from gearmbs.dae.equations.kinematics.rotation import POSE_COLUMNS
from gearmbs.dae.equations.kinematics.update import (
    track,
    turns_are_counted,
    update_bodies,
    update_functions,
    update_marker,
)
from gearmbs.dae.equations.outputs.accelerations import ROW_PHI, ROW_RATE, ROW_RECORD, apply_loads, poses
from gearmbs.dae.equations.outputs.lanes import (
    LaneTables,
    lane_reactions,
    lane_saddle,
    new_lane_tables,
    take_bodies,
    take_terms,
)
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, LUPlan
from gearmbs.dae.linalg.sparse_lu import LaneFactors, factor_lanes, new_lane_factors, solve_lanes
from gearmbs.dae.model.lane_members import (
    MEMBERS_TYPE,
    MemberLanes,
    Members,
    expand_lanes,
    new_member_lanes,
    no_members,
)
from gearmbs.dae.model.records import FARTHEST, RECORDS_TYPE, allow_rounding
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, all_lanes, deal_eight, lanes_at, larger, magnitude, put_lanes
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector, matrix_at, uncounted, vector_at

LOOKED_AT = 32
"""Entries of a matrix that are compared before the result is looked at."""

FEW_ASTRAY = LANES // 4
"""Outputs off the constraints up to which the loads of the next ones are evaluated at once: this takes three times as
long as finding out first who has to be moved."""

_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]


class Bench(Struct):
    """What evaluating eight outputs needs beside their tables.

    Attributes
    ----------
    factored, allowed : ndarray
        The matrices factored last, in lanes, and by how much an entry may differ from one's and count as unchanged.
    growth, violation, strayed : ndarray, shape (LANES,)
        Of each output: growth of its factors, largest violation over what is rounding, largest \\|Phi\\|.
    moves, turns : ndarray
        Displacements and changes of velocity of a projection, in lanes.
    one_move, one_turn : ndarray
        The same of one output.
    winding : ndarray, shape (1 + LANES, .)
        Counted angles before the outputs, then at each.
    markers : ndarray of int
        Markers that loads and terms of rare kinds look at.
    pose : ndarray
        Room for the poses of bodies that are made of others, which nobody asks for.
    """

    factored: Vector
    allowed: Vector
    growth: Vector
    violation: Vector
    strayed: Vector
    moves: Vector
    turns: Vector
    one_move: Vector
    one_turn: Vector
    winding: Matrix
    markers: IntVector
    pose: Vector


def is_possible(idata: np.ndarray) -> bool:
    """Whether a model's outputs can be evaluated side by side.

    Its bodies are rigid, its constraints are terms and not expressions, no load depends on reactions, and angles are
    counted by constraints only.
    """
    rows = T.rows_in(idata, int(idata[T.H_I_ROW]), int(idata[T.H_ROWS]), T.ROW_COLUMNS)
    tapes = T.rows_in(idata, int(idata[T.H_I_TAPE]), int(idata[T.H_TAPES]), T.TAPE_COLUMNS)
    at = T.rows_in(idata, int(idata[T.H_I_AT]), int(idata[T.H_FRAMES]), T.AT_COLUMNS)
    return bool(
        len(rows) > 0
        and idata[T.H_FRAMES] == idata[T.H_BODIES]
        and (at[:, T.AT_MODES] <= 0).all()
        and (rows[:, T.ROW_TAPE] < 0).all()
        and (T.forces_in(idata)[:, T.FORCE_KIND] != T.REACTION).all()
        and idata[T.H_ANGLES] == 0
        and (tapes[:, T.TAPE_REFERENCE_SIZE] == 0).all()
    )


def _watched_markers(idata: np.ndarray, lanes: LaneTables) -> np.ndarray:
    """Return the markers that loads and terms of rare kinds look at."""
    count = int(idata[T.H_MARKERS])
    forces = T.forces_in(idata)
    if (forces[:, T.FORCE_KIND] != T.COMPILED).any():
        return np.arange(count)
    term = T.rows_in(idata, int(idata[T.H_I_TERM]), int(idata[T.H_TERMS]), T.TERM_COLUMNS)[lanes.terms]
    extra = idata[int(idata[T.H_I_EXTRA]) :]
    seen = [extra[row[T.FORCE_SEES] + 1 :][: extra[row[T.FORCE_SEES]]] for row in forces]
    ends = [forces[:, [T.FORCE_I, T.FORCE_J]].ravel(), term[:, [T.TERM_I, T.TERM_J]].ravel()]
    return np.unique(np.concatenate([*seen, *ends])).astype(np.int64)


class SideBySide:
    """Tables, factors and scratch to evaluate outputs of one model side by side with one plan."""

    def __init__(self, idata: np.ndarray, plan: LUPlan, nnz: int, members: Members | None = None) -> None:
        terms = int(idata[T.H_TERMS])
        self.plan = plan
        self.lanes = new_lane_tables(idata, nnz)
        self.factors = new_lane_factors(plan)
        self.members = no_members() if members is None else members
        self.wide = new_member_lanes(self.members, int(idata[T.H_FORCES]))
        n = self.lanes.rhs.size
        self.bench = Bench(
            factored=np.full(LANES * nnz, np.inf),
            allowed=np.zeros(nnz),
            growth=np.zeros(LANES),
            violation=np.zeros(LANES),
            strayed=np.zeros(LANES),
            moves=np.zeros(n),
            turns=np.zeros(n),
            one_move=np.zeros(n // LANES),
            one_turn=np.zeros(n // LANES),
            winding=np.zeros((1 + LANES, 1 + 2 * terms)),
            markers=_watched_markers(idata, self.lanes),
            pose=np.zeros(POSE_COLUMNS * (int(idata[T.H_BODIES]) - 1)),
        )

    def evaluate(self, first, last, t, y, slots, idata, rdata, work, records, growth) -> int:
        """Evaluate output rows from ``first``; see `evaluate_side_by_side`."""
        return evaluate_side_by_side(
            first, last, t, y, slots, idata, rdata, work, self.plan, self.factors, self.lanes, self.bench, self.members,
            self.wide, records, growth,
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def find_violations(idata, rdata, work, lanes, bench):
    """Write largest violations; return how many outputs are off the constraints by more than rounding."""
    tab = T.unpack(idata, rdata, work)
    violation, strayed, phi = all_lanes(0.0), all_lanes(0.0), lanes.phi
    for r in range(tab.row.shape[0] - 1):
        off, rounded = magnitude(lanes_at(phi, ROW_RECORD * r + ROW_PHI)), all_lanes(ROUNDED_POSITION)
        function = tab.row[r, T.ROW_FUNCTION]
        if function >= 0:
            rounded = rounded + EPS * magnitude(lanes_at(lanes.function, T.FUNCTION_VALUES * function))
        rate = magnitude(lanes_at(phi, ROW_RECORD * r + ROW_RATE))
        strayed = larger(strayed, off)
        violation = larger(violation, larger(off / rounded, rate / ROUNDED_RATE))
    put_lanes(bench.violation, 0, violation)
    put_lanes(bench.strayed, 0, strayed)
    astray = 0
    for lane in range(LANES):
        if not bench.violation[lane] <= 1.0:
            astray += 1
    return astray


@njit(cache=True, error_model="numpy")
def renew_factors(plan, factors, lanes, bench, limit):
    """Factor the matrices if one has changed; return the first output whose pivots do not fit, or LANES."""
    vals, factored, allowed, growth = lanes.vals, bench.factored, bench.allowed, bench.growth
    unchanged, p = True, 0
    while unchanged and p < allowed.size:
        # most matrices that change do so early on
        most, stop = all_lanes(0.0), min(p + LOOKED_AT, allowed.size)
        while p < stop:
            most = larger(most, magnitude(lanes_at(vals, p) - lanes_at(factored, p)) - allowed[p])
            p += 1
        put_lanes(growth, 0, most)
        for lane in range(LANES):
            unchanged &= growth[lane] <= 0.0
    if unchanged:
        return LANES
    known = LANES * p
    factor_lanes(plan, factors, vals, growth)
    for lane in range(LANES):
        if not growth[lane] <= limit:
            factored[:] = np.inf
            return lane
    # what changes early on will do so again: the other entries are not kept, unless they had to be looked at
    for q in range(known):
        factored[q] = vals[q]
    if known < factored.size:
        factored[known] = np.inf
    return LANES


@njit(cache=True, error_model="numpy")
def find_moves(base, plan, factors, lanes, bench):
    """Solve for the displacements and changes of velocity that bring the outputs back onto the constraints."""
    moves, turns, phi = bench.moves, bench.turns, lanes.phi
    for c in range(base):
        put_lanes(moves, c, all_lanes(0.0))
        put_lanes(turns, c, all_lanes(0.0))
    for r in range(phi.size // (LANES * ROW_RECORD)):
        put_lanes(turns, base + r, -lanes_at(phi, ROW_RECORD * r + ROW_RATE))
        for lane in range(LANES):
            off = phi[LANES * (ROW_RECORD * r + ROW_PHI) + lane]
            moves[LANES * (base + r) + lane] = 0.0 if abs(off) > FARTHEST else -off
    solve_lanes(plan, factors, moves, moves)
    solve_lanes(plan, factors, turns, turns)


@njit(cache=True, error_model="numpy")
def move_onto_constraints(idata, rdata, work, lanes, bench):
    """Displace the outputs that violate the constraints."""
    tab = T.unpack(idata, rdata, work)
    moves, turns, move, turn = bench.moves, bench.turns, bench.one_move, bench.one_turn
    for lane in range(LANES):
        if bench.violation[lane] <= 1.0:
            continue
        for c in range(move.size):
            move[c], turn[c] = moves[LANES * c + lane], turns[LANES * c + lane]
        at = vector_at(lanes.y, lanes.y.shape[1] * lane, lanes.y.shape[1])
        update_bodies(at, tab.at, tab.code, tab.body, tab.modal, tab.kin, tab.partial, tab.scratch, False)
        displace(at, move, turn, idata, tab)


@njit(cache=True, error_model="numpy", forceinline=True)
def take_output(lane, t, again, counts_turns, loads, pose, idata, tab, lanes, bench, wide):
    """Bring the tables up to date with one output, and take from them what the lanes need.

    Parameters
    ----------
    lane : int
    t : float
        Time, s.
    again, counts_turns : bool
        Whether angles have been counted at this output before, and whether there are any to count.
    loads, pose : ndarray
        Rows of the records, written; without room in them while the unknowns are not final.
    idata, tab : ndarray of int, Tables
    lanes, bench, wide : LaneTables, Bench, MemberLanes
    """
    at = vector_at(lanes.y, lanes.y.shape[1] * lane, lanes.y.shape[1])
    update_bodies(at, tab.at, tab.code, tab.body, tab.modal, tab.kin, tab.partial, tab.scratch, False)
    markers = bench.markers
    for q in range(markers.size):
        update_marker(markers[q], tab.marker_body, tab.marker, tab.kin, tab.frame)
    update_functions(t, tab)
    if counts_turns:
        if again:
            for j in range(tab.reference.size):
                tab.reference[j] = bench.winding[1 + lane, 1 + j]
        else:
            track(t, at, tab, False)
            for j in range(tab.winding.size):
                bench.winding[1 + lane, j] = tab.winding[j]
    take_bodies(lane, tab, lanes)
    take_terms(lane, tab, lanes)
    if pose.size > 0:
        own, applied = lanes.own, lanes.applied
        for c in range(own.size):
            own[c] = 0.0
        apply_loads(t, at, own, loads, idata, tab)
        for c in range(own.size):
            applied[LANES * c + lane] = own[c]
        told = wide.loads
        for q in range(told.size // LANES):
            told[LANES * q + lane] = loads[q // 6, q % 6]
        poses(at, tab.at, tab.code, tab.kin, pose)


@njit(cache=True, error_model="numpy")
def deal(lanes, out, count, columns, first):
    """Write the first ``count`` lanes of a table to rows of a record with so many columns, from row ``first`` on."""
    together = columns - columns % LANES if count == LANES else 0
    for c in range(0, together, LANES):
        deal_eight(lanes, c, out, columns * first + c, columns)
    for lane in range(count):
        row = vector_at(out, columns * (first + lane), columns)
        for c in range(together, columns):
            row[c] = lanes[LANES * c + lane]


@njit(cache=True, error_model="numpy")
def write_outputs(first, count, lanes, bench, records):
    """Write what is in lanes to ``count`` rows of the records from ``first`` on."""
    rows = records.force.shape[1]
    deal(lanes.solution, uncounted(records.solution), count, records.solution.shape[1], first)
    deal(lanes.phi, uncounted(records.phi), count, records.phi.shape[1], first)
    deal(lanes.force, uncounted(records.force), count, 3 * rows, first)
    deal(lanes.moment, uncounted(records.moment), count, 3 * rows, first)
    for lane in range(count):
        records.strayed[first + lane] = bench.strayed[lane]


@njit(cache=True, error_model="numpy")
def write_members(first, count, wide, bench, records):
    """As `write_outputs`, of all bodies and joints."""
    rows = records.force.shape[1]
    deal(wide.pose, uncounted(records.pose), count, records.pose.shape[1], first)
    deal(wide.solution, uncounted(records.solution), count, records.solution.shape[1], first)
    deal(wide.phi, uncounted(records.phi), count, records.phi.shape[1], first)
    deal(wide.force, uncounted(records.force), count, 3 * rows, first)
    deal(wide.moment, uncounted(records.moment), count, 3 * rows, first)
    for lane in range(count):
        records.strayed[first + lane] = bench.strayed[lane]


@njit(
    int64(
        int64, int64, _VEC, _MAT, _IVEC, _IVEC, _VEC, _VEC, PLAN_TYPE, LaneFactors.numba_type, LaneTables.numba_type,
        Bench.numba_type, MEMBERS_TYPE, MemberLanes.numba_type, RECORDS_TYPE, float64,
    ),
    cache=True,
    error_model="numpy",
    nogil=True,
)  # fmt: skip
def evaluate_side_by_side(
    first, last, t, y, slots, idata, rdata, work, plan, factors, lanes, bench, members, wide, records, growth
):  # fmt: skip
    """Evaluate output rows from ``first``; return the row where new pivots are needed, or ``last``.

    Parameters
    ----------
    first, last, t, y, slots, idata, rdata, work, plan, records, growth
        As of `gearmbs.dae.model.evaluator.evaluate_rows`.
    factors, lanes, bench, wide : LaneFactors, LaneTables, Bench, MemberLanes
        Overwritten.
    members : Members
        What the bodies are made of; the records are about all of these then.
    """
    idata, slots, t, rdata, work = uncounted(idata), uncounted(slots), uncounted(t), uncounted(rdata), uncounted(work)
    tab = T.unpack(idata, rdata, work)
    base, trusted, counts_turns = idata[T.H_COORDINATES], True, turns_are_counted(tab)
    # what is handed to inlined functions as it came would be counted for each
    all_loads, all_poses = uncounted(records.loads), uncounted(records.pose)
    elements, columns, width = records.loads.shape[1], records.loads.shape[2], records.pose.shape[1]
    known = matrix_at(y, 0, y.shape[0], y.shape[1])
    allow_rounding(plan, bench.allowed)
    k = first
    while k < last:
        count = min(LANES, last - k)
        for j in range(tab.winding.size):
            bench.winding[0, j] = tab.winding[j]
        for lane in range(LANES):
            row = k + min(lane, count - 1)
            for c in range(y.shape[1]):
                lanes.y[lane, c] = known[row, c]
        failed, astray = LANES, 0
        # steps of an integrator that keeps both positions and velocities on the constraints need no projection
        for stage in range(2):
            if stage == 1 and astray == 0 and trusted:
                break
            if stage == 1 and astray > 0:
                failed = renew_factors(plan, factors, lanes, bench, growth)
                if failed < LANES:
                    break
                find_moves(base, plan, factors, lanes, bench)
                move_onto_constraints(idata, rdata, work, lanes, bench)
            for lane in range(LANES):
                if stage == 1 and trusted and bench.violation[lane] <= 1.0:
                    # it has not been moved
                    continue
                row = k + min(lane, count - 1)
                final = stage == 1 or trusted
                pose = vector_at(bench.pose, 0, bench.pose.size if final else 0)
                if members.group.size == 0:
                    pose = vector_at(all_poses, width * row, width if final else 0)
                loads = matrix_at(all_loads, elements * columns * row, elements, columns)
                take_output(lane, t[row], stage == 1, counts_turns, loads, pose, idata, tab, lanes, bench, wide)
            lane_saddle(slots, idata, rdata, work, lanes)
            if stage == 0:
                astray = find_violations(idata, rdata, work, lanes, bench)
        trusted = astray <= FEW_ASTRAY
        if failed == LANES:
            failed = renew_factors(plan, factors, lanes, bench, growth)
        if failed < LANES:
            for j in range(tab.winding.size):
                tab.winding[j] = bench.winding[0, j]
            if failed == 0:
                return k
            last = k + failed
            continue
        for c in range(base):
            put_lanes(lanes.rhs, c, lanes_at(lanes.rhs, c) + lanes_at(lanes.applied, c))
        solve_lanes(plan, factors, lanes.rhs, lanes.solution)
        lane_reactions(idata, rdata, work, lanes)
        if members.group.size > 0:
            expand_lanes(idata, rdata, work, members, lanes, wide)
            write_members(k, count, wide, bench, records)
        else:
            write_outputs(k, count, lanes, bench, records)
        k += count
    return last
