"""Records of bodies that turn about fixed axes, of eight outputs side by side, from their angles alone.

Nothing is solved for: where loads are known, so are the angular accelerations, and what the joint of a group transmits
is all that moves it,

    W = sum over its members of m (a - g), and of moments, less the loads on them;

n . W is zero of a free group, and what the motion exerts of a driven one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import float64, int64, void

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.dae.compiled.views import matrix_at, uncounted, vector_at
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import ROW_PARTIAL, ROW_RECORD, apply_loads
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.euler_switch import track, turns_are_counted
from gearmbs.dae.equations.fixed_axes import (
    AXIS_FUNCTION,
    AXIS_OMEGA,
    TURN_AXIS,
    TURN_INERTIA,
    TURN_MASS,
    TURN_POINT,
    TURN_SENSE,
    axes_in,
    update_axes,
)
from gearmbs.dae.equations.lane_system import (
    LaneTables,
    cross,
    new_lane_tables,
    take_bodies,
    three,
    update_lane_markers,
)
from gearmbs.dae.equations.rotation import KIN_R, KIN_W
from gearmbs.dae.model.lane_members import (
    S_FIRST,
    S_MOMENT,
    S_SECOND,
    MemberLanes,
    deduct_loads,
    internal_reactions,
    marker_place,
    move_member,
    new_member_lanes,
    put_three,
)
from gearmbs.dae.model.member_tables import (
    MEMBERS_TYPE,
    TURN_I,
    TURN_J,
    TURN_ROOT,
    TURN_ROWS,
    TURN_SIDE,
    Members,
)
from gearmbs.dae.model.records import RECORDS_TYPE, Records
from gearmbs.dae.model.side_by_side import deal

if TYPE_CHECKING:
    from gearmbs.dae.problem import DAEProblem

_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]


@njit(cache=True, error_model="numpy", forceinline=True)
def accelerate(k, lane, axes, turns, tab, lanes, s):
    """Write a and alpha of body k + 1 of one output, from the loads on it in ``lanes.own``."""
    turn, body, own, first = turns[k], tab.kin[k + 1], lanes.own, 6 * k
    for c in range(3):
        s[c] = body[KIN_R + c] - turn[TURN_POINT + c]
        s[3 + c] = own[first + c] + turn[TURN_MASS] * tab.gravity[c]
    if axes[k, AXIS_OMEGA] >= 0:
        cross3(s, 0, s, 3, s, 6)
        moment = dot3(turn, TURN_AXIS, s, 6) + dot3(turn, TURN_AXIS, own, first + 3)
        alpha = moment / turn[TURN_INERTIA]
    else:
        alpha = turn[TURN_SENSE] * tab.fval[axes[k, AXIS_FUNCTION], 2]
    # a = alpha n x rho + w x (w x rho)
    cross3(turn, TURN_AXIS, s, 0, s, 3)
    cross3(body, KIN_W, s, 0, s, 6)
    cross3(body, KIN_W, s, 6, s, 6)
    for c in range(3):
        lanes.solution[LANES * (first + c) + lane] = alpha * s[3 + c] + s[6 + c]
        lanes.solution[LANES * (first + 3 + c) + lane] = alpha * turn[TURN_AXIS + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def take_axes(lane, t, y, counts_turns, loads, idata, tab, axes, markers, turns, lanes, wide, s):
    """Bring the tables up to date with one output, evaluate its loads and accelerations, and take them into lanes.

    Parameters
    ----------
    lane : int
    t, y : float, ndarray
        Time, s, and unknowns.
    counts_turns : bool
        Whether angles are counted from one output to the next.
    loads : ndarray
        Row of the records, written.
    idata, tab : ndarray of int, Tables
    axes, markers, turns : ndarray
        Of `gearmbs.dae.equations.fixed_axes`.
    lanes, wide : LaneTables, MemberLanes
    s : ndarray
        Scratch, nine places.
    """
    update_axes(t, y, axes, markers, turns, tab)
    if counts_turns:
        track(t, y, tab, False)
    own, told = lanes.own, wide.loads
    for c in range(own.size):
        own[c] = 0.0
    apply_loads(t, y, own, loads, idata, tab)
    for q in range(told.size // LANES):
        told[LANES * q + lane] = loads[q // 6, q % 6]
    for k in range(axes.shape[0]):
        accelerate(k, lane, axes, turns, tab, lanes, s)
    take_bodies(lane, tab, lanes)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_wrench(m, factor, s, wrench):
    """Add a multiple of the force and moment in ``s`` from ``S_FIRST`` on to the wrench of member m, if it is one."""
    if m >= 0:
        for c in range(6):
            put_lanes(wrench, 6 * m + c, lanes_at(wrench, 6 * m + c) + factor * lanes_at(s, S_FIRST + c))


@njit(cache=True, error_model="numpy", forceinline=True)
def joint_reaction(k, function, members, tab, lanes, wide):
    """Write what the joint of group k + 1, and its motion, transmit; the wrenches of members are less it then.

    ``function`` is that of the motion, or -1. The scratch has W in `S_FIRST` and `S_SECOND`, then moments.
    """
    s, wrench, frame, turn = wide.scratch, wide.wrench, lanes.frame, members.turn[k]
    zero = all_lanes(0.0)
    for c in range(6):
        total = zero
        for m in range(members.group.size):
            if members.group[m] == k + 1:
                total = total + lanes_at(wrench, 6 * m + c)
        put_lanes(s, S_FIRST + c, total)
    i, j, side = turn[TURN_I], turn[TURN_J], 1.0 * turn[TURN_SIDE]
    add_wrench(members.of_marker[i], -side, s, wrench)
    add_wrench(members.of_marker[j], side, s, wrench)
    # moment on I's body about marker I
    marker_place(i, tab, lanes, s, S_MOMENT)
    x, y, z = cross(s, S_MOMENT, s, S_FIRST)
    put_three(
        s, S_MOMENT,
        (side * (lanes_at(s, S_SECOND) - x), side * (lanes_at(s, S_SECOND + 1) - y),
         side * (lanes_at(s, S_SECOND + 2) - z)),
    )  # fmt: skip
    base = 6 * members.group.size
    at_i, at_j = T.MK_COLUMNS * i + T.MK_AXES, T.MK_COLUMNS * j + T.MK_AXES
    for c in range(3):
        row, force = turn[TURN_ROWS + c], side * lanes_at(s, S_FIRST + c)
        for d in range(3):
            put_lanes(wide.force, 3 * row + d, force if d == c else zero)
            put_lanes(wide.moment, 3 * row + d, zero)
        put_lanes(wide.solution, base + row, -force)
    for c in range(3):
        row = turn[TURN_ROWS + 3 + c]
        if row < 0:
            continue
        if c < 2:
            # z_I normal to x_J, y_J
            axis = cross(frame, at_i + 6, frame, at_j + 3 * c)
        else:
            root = 1.0 * turn[TURN_ROOT]
            x, y, z = three(frame, at_j + 6)
            axis = (root * x, root * y, root * z)
            rate = lanes_at(lanes.function, T.FUNCTION_VALUES * function + 1)
            put_lanes(wide.phi, ROW_RECORD * row + ROW_PARTIAL, -root * rate)
        along = lanes_at(s, S_MOMENT) * axis[0] + lanes_at(s, S_MOMENT + 1) * axis[1]
        along = along + lanes_at(s, S_MOMENT + 2) * axis[2]
        put_lanes(wide.solution, base + row, -along)
        for d in range(3):
            put_lanes(wide.force, 3 * row + d, zero)
            put_lanes(wide.moment, 3 * row + d, along * axis[d])


@njit(cache=True, error_model="numpy", forceinline=True)
def write_axes(first, count, members, wide, records):
    """Write what is in lanes to ``count`` rows of the records from ``first`` on.

    Of ``phi``, which begins with zeros, only the rates of motions are anything else.
    """
    rows, phi, columns = records.force.shape[1], uncounted(records.phi), records.phi.shape[1]
    deal(wide.pose, uncounted(records.pose), count, records.pose.shape[1], first)
    deal(wide.solution, uncounted(records.solution), count, records.solution.shape[1], first)
    for a in range(members.turn.shape[0]):
        row = members.turn[a, TURN_ROWS + 5]
        if row >= 0:
            c = ROW_RECORD * row + ROW_PARTIAL
            for lane in range(count):
                phi[columns * (first + lane) + c] = wide.phi[LANES * c + lane]
    deal(wide.force, uncounted(records.force), count, 3 * rows, first)
    deal(wide.moment, uncounted(records.moment), count, 3 * rows, first)
    for lane in range(count):
        records.strayed[first + lane] = 0.0


@njit(
    void(int64, int64, _VEC, _MAT, _IVEC, _VEC, _VEC, LaneTables.numba_type, MEMBERS_TYPE, MemberLanes.numba_type,
         RECORDS_TYPE),
    cache=True,
    error_model="numpy",
    nogil=True,
)  # fmt: skip
def evaluate_axes(first, last, t, y, idata, rdata, work, lanes, members, wide, records):
    """Evaluate output rows ``first`` to ``last - 1``.

    Parameters
    ----------
    first, last : int
    t : ndarray, shape (m,)
        Output times, s.
    y : ndarray, shape (m, unknowns)
    idata, rdata, work : ndarray
        Tables of `gearmbs.dae.equations.fixed_axes`.
    lanes, wide : LaneTables, MemberLanes
        Overwritten.
    members : Members
    records : Records
        Written.
    """
    idata, t, rdata, work = uncounted(idata), uncounted(t), uncounted(rdata), uncounted(work)
    tab = T.unpack(idata, rdata, work)
    axes, markers, _, turns = axes_in(idata, rdata)
    all_y, all_loads, n = matrix_at(y, 0, y.shape[0], y.shape[1]), uncounted(records.loads), y.shape[1]
    elements, columns = records.loads.shape[1], records.loads.shape[2]
    counts_turns, s = turns_are_counted(tab), vector_at(tab.scratch, 0, 9)
    k = first
    while k < last:
        count = min(LANES, last - k)
        for lane in range(LANES):
            row = k + min(lane, count - 1)
            at = vector_at(all_y, n * row, n)
            loads = matrix_at(all_loads, elements * columns * row, elements, columns)
            take_axes(lane, t[row], at, counts_turns, loads, idata, tab, axes, markers, turns, lanes, wide, s)
        update_lane_markers(tab.marker_body, tab.marker, lanes)
        for m in range(members.group.size):
            move_member(m, members, tab, lanes, wide)
        deduct_loads(members, tab, lanes, wide)
        for a in range(axes.shape[0]):
            joint_reaction(a, axes[a, AXIS_FUNCTION], members, tab, lanes, wide)
        internal_reactions(members, tab, lanes, wide)
        write_axes(k, count, members, wide, records)
        k += count


class AxisEvaluator:
    """Fills the records of all bodies and joints from the unknowns of groups that turn about fixed axes."""

    def __init__(self, problem: DAEProblem, members: Members) -> None:
        self.members = members
        self.rdata = problem.rdata.copy()
        self.work = np.zeros(problem.work_size)
        self.lanes = new_lane_tables(problem.idata, 0)
        self.wide = new_member_lanes(members, int(problem.idata[T.H_FORCES]))

    def fill(self, t: np.ndarray, y: np.ndarray, epochs, records: Records) -> None:
        """Fill ``records`` for all rows of ``y``; ``epochs`` names the integer tables valid from each row on."""
        y = np.ascontiguousarray(y)
        bounds = [row for row, _ in epochs] + [t.size]
        for (first, table), last in zip(epochs, bounds[1:]):
            evaluate_axes(
                first, last, t, y, np.ascontiguousarray(table), self.rdata, self.work, self.lanes, self.members,
                self.wide, records,
            )  # fmt: skip
