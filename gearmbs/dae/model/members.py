"""Members: bodies that are integrated as one, as tables, and their motions and loads from those of the composite.

Members of a group do not move against each other: the motion of each follows from that of its group. What a fixed joint
inside the group transmits follows from the equations of Newton and Euler of the members beyond it, whose accelerations
and other loads are known: per joint no equation is left to be solved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import ROW_RECORD
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.kinematics import update_functions, update_markers
from gearmbs.dae.equations.residual import S_GRADIENT, S_GRADIENT_T, S_TERM
from gearmbs.dae.equations.rotation import KIN_A, KIN_R, KIN_V, KIN_W, POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model.evaluator import Evaluator, new_records
from gearmbs.dae.model.records import RECORDS_TYPE, Records
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types, void
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at

if TYPE_CHECKING:
    from gearmbs.dae.problem import DAEProblem

_IVEC = int64[::1]

EDGE_CHILD, EDGE_PARENT, EDGE_I, EDGE_J, EDGE_CHILD_HAS_I = range(5)
EDGE_AXES = 5
"""Axes of the three rows that keep the orientation: 3 * axis of I + axis of J."""
EDGE_ROWS = 8
"""Six rows in the order of the joint: coincident x, y, z, then the orientation."""
EDGE_COLUMNS = 14
"""Columns of a fixed joint inside a group; members count from 0, -1 is the ground."""

TURN_I, TURN_J, TURN_SIDE, TURN_ROOT = range(4)
"""Columns of an axis: markers I and J; 1 where I's body turns and -1 where J's does; 1, or -1 where I starts half a
turn off what the motion says."""
TURN_ROWS = 4
"""Six rows: coincident x, y, z, the two that keep the axis, and that of the motion or -1."""
TURN_COLUMNS = 10
"""Columns of the revolute joint on the ground in which a group turns about a fixed axis, where that is all it can
do."""

PLACE_R, PLACE_A = 0, 3
PLACE_MASS, PLACE_INERTIA = 12, 13
PLACE_COLUMNS = 22
"""Columns of a member: its centre of mass and axes in the frame of its group, mass, inertia in its own axes."""

PART = 512
"""Output times evaluated at a time, whose records fit the processor's cache."""

_VEC = float64[::1]


class Members(NamedTuple):
    """What bodies integrated as one are made of.

    Attributes
    ----------
    group : ndarray of int, shape (members,)
        Body of the integrated model that each body of the whole one belongs to; 0 is the ground.
    place : ndarray, shape (members, PLACE_COLUMNS)
        Where it is in it, and its inertia.
    of_marker : ndarray of int, shape (markers,)
        Member on which each marker of the integrated model lies, -1 for the ground itself.
    row : ndarray of int, shape (rows,)
        Number among all rows of each row of the integrated model.
    edge : ndarray of int, shape (joints, EDGE_COLUMNS)
        Fixed joints inside groups, outermost first.
    turn : ndarray of int, shape (groups, TURN_COLUMNS)
        Joints of the groups where each is integrated by its angle alone, see `gearmbs.dae.equations.fixed_axes`; else
        no rows.
    """

    group: np.ndarray
    place: np.ndarray
    of_marker: np.ndarray
    row: np.ndarray
    edge: np.ndarray
    turn: np.ndarray


MEMBERS_TYPE = types.NamedTuple((_IVEC, float64[:, ::1], _IVEC, _IVEC, int64[:, ::1], int64[:, ::1]), Members)

AXES_SIG = void(int64, int64, _VEC, float64[:, ::1], _IVEC, _VEC, _VEC, MEMBERS_TYPE, RECORDS_TYPE)
"""Signature of `gearmbs.dae.model.fixed_axes.evaluate_axes`, whose module those load who call it."""


def no_turns() -> np.ndarray:
    """Return the table of axes of groups that are integrated by all six coordinates."""
    return np.zeros((0, TURN_COLUMNS), dtype=np.int64)


@njit(cache=True, error_model="numpy", forceinline=True)
def _turned(kin_row, r, r_at, out, at):
    """Write A r of a body's matrix A."""
    for c in range(3):
        out[at + c] = terms.dot3(kin_row, KIN_A + 3 * c, r, r_at)


@njit(cache=True, error_model="numpy", forceinline=True)
def _take_pose(pose, tab):
    """Fill the kinematics table from a record of poses."""
    for b in range(tab.kin.shape[0]):
        kin = tab.kin[b]
        for c in range(9):
            kin[KIN_A + c] = 1.0 if c % 4 == 0 else 0.0
        for c in range(3):
            kin[KIN_R + c] = kin[KIN_V + c] = kin[KIN_W + c] = 0.0
        if b == 0:
            continue
        p = POSE_COLUMNS * (b - 1)
        for c in range(9):
            kin[KIN_A + c] = pose[p + POSE_A + c]
        for c in range(3):
            kin[KIN_R + c] = pose[p + POSE_R + c]
            kin[KIN_V + c] = pose[p + POSE_V + c]
            kin[KIN_W + c] = pose[p + POSE_W + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def move_member(m, members, tab, solution, pose, acceleration, wrench, s):
    """Write the pose and accelerations of a member, and the wrench about the global origin that moves it.

    Parameters
    ----------
    m : int
        Member.
    members : Members
    tab : Tables
        Of the integrated model, kinematics up to date.
    solution : ndarray
        Accelerations a, alpha of each group first, m/s^2 and rad/s^2.
    pose, acceleration : ndarray
        Rows of the members' records, written: 18 and 6 places a member.
    wrench : ndarray, shape (members, 6)
        Row m is written: mass times (a - g) and the moment, N and N m, global components.
    s : ndarray
        Scratch, 24 places: acceleration of the group in s[0:6], arm in s[6:9].
    """
    b = members.group[m]
    kin, place = tab.kin[b], members.place[m]
    for c in range(6):
        s[c] = solution[6 * (b - 1) + c] if b > 0 else 0.0
    _turned(kin, place, PLACE_R, s, 6)
    p = POSE_COLUMNS * m
    for c in range(3):
        pose[p + POSE_R + c] = kin[KIN_R + c] + s[6 + c]
        pose[p + POSE_W + c] = kin[KIN_W + c]
        for d in range(3):
            total = 0.0
            for e in range(3):
                total += kin[KIN_A + 3 * c + e] * place[PLACE_A + 3 * e + d]
            pose[p + POSE_A + 3 * c + d] = total
    # v = v_g + w x r, a = a_g + alpha x r + w x (w x r)
    terms.cross3(kin, KIN_W, s, 6, s, 9)
    terms.cross3(kin, KIN_W, s, 9, s, 12)
    terms.cross3(s, 3, s, 6, s, 15)
    for c in range(3):
        pose[p + POSE_V + c] = kin[KIN_V + c] + s[9 + c]
        acceleration[6 * m + c] = s[c] + s[15 + c] + s[12 + c]
        acceleration[6 * m + 3 + c] = s[3 + c]
    # force m (a - g); moment J alpha + w x J w about the centre of mass, moved to the origin
    mass = place[PLACE_MASS]
    for c in range(3):
        wrench[m, c] = mass * (acceleration[6 * m + c] - tab.gravity[c])
        s[9 + c] = s[12 + c] = 0.0
        for d in range(3):
            s[9 + c] += pose[p + POSE_A + 3 * d + c] * s[3 + d]
            s[12 + c] += pose[p + POSE_A + 3 * d + c] * kin[KIN_W + d]
    for c in range(3):
        s[15 + c] = terms.dot3(place, PLACE_INERTIA + 3 * c, s, 9)
        s[18 + c] = terms.dot3(place, PLACE_INERTIA + 3 * c, s, 12)
    terms.cross3(s, 12, s, 18, s, 21)
    for c in range(3):
        s[15 + c] += s[21 + c]
    terms.cross3(pose, p + POSE_R, wrench[m], 0, s, 18)
    for c in range(3):
        wrench[m, 3 + c] = terms.dot3(pose, p + POSE_A + 3 * c, s, 15) + s[18 + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def _deduct(m, factor, force, f_at, moment, m_at, point, wrench, s):
    """Subtract a load on a member, a force at a point and a moment, from the wrench that moves it.

    Parameters
    ----------
    m : int
        Member; nothing is done for -1, the ground.
    factor : float
        Of the load.
    force, f_at : ndarray, int
        Force, N, global components, from ``force[f_at]`` on.
    moment, m_at : ndarray, int
        Moment about the point, N m, likewise.
    point : ndarray, shape (3,)
        Where the force acts, m, global.
    wrench : ndarray, shape (members, 6)
        Force, and moment about the global origin, of each member; row m is changed.
    s : ndarray
        Scratch, 3 places.
    """
    if m < 0:
        return
    terms.cross3(point, 0, force, f_at, s, 0)
    for c in range(3):
        wrench[m, c] -= factor * force[f_at + c]
        wrench[m, 3 + c] -= factor * (moment[m_at + c] + s[c])


@njit(cache=True, error_model="numpy", forceinline=True)
def deduct_loads(loads, members, tab, wrench, s):
    """Take what the force elements exert away from the wrenches; J's body feels the opposite at I's point."""
    for f in range(tab.force.shape[0]):
        row = tab.force[f]
        if row[T.FORCE_KIND] == T.REACTION:
            continue
        i, j = row[T.FORCE_I], row[T.FORCE_J]
        body = tab.kin[tab.marker_body[i]]
        for c in range(3):
            s[3 + c] = body[KIN_R + c] + tab.frame[i, T.MK_ARM + c]
        point = vector_at(s, 3, 3)
        _deduct(members.of_marker[i], 1.0, loads[f], 0, loads[f], 3, point, wrench, s)
        _deduct(members.of_marker[j], -1.0, loads[f], 0, loads[f], 3, point, wrench, s)


@njit(cache=True, error_model="numpy", forceinline=True)
def _deduct_rows(multipliers, members, tab, wrench, s):
    """Take what the constraints of the integrated model exert away from the wrenches."""
    g = vector_at(tab.scratch, S_GRADIENT, 12)
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    work = vector_at(tab.scratch, S_TERM, 100)
    for r in range(members.row.size):
        for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
            factor = -multipliers[r] * tab.coef[j]
            kind = tab.term[j, T.TERM_TYPE]
            if kind == terms.DOT1:
                axes = tab.term[j, T.TERM_AXES]
                i_axes, j_axes = tab.frame[tab.term[j, T.TERM_I]], tab.frame[tab.term[j, T.TERM_J]]
                terms.cross3(i_axes, T.MK_AXES + 3 * (axes // 3), j_axes, T.MK_AXES + 3 * (axes % 3), s, 0)
            elif kind != terms.POINT:
                terms.gradient(j, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, work, g, gt)
            for side in range(2):
                marker = tab.term[j, T.TERM_I + side]
                m = members.of_marker[marker]
                if m < 0:
                    continue
                body = tab.kin[tab.marker_body[marker]]
                signed = factor if side == 0 else -factor
                if kind == terms.POINT:
                    c = tab.term[j, T.TERM_AXES]
                    c1, c2 = c + 1 if c < 2 else 0, c - 1 if c > 0 else 2
                    wrench[m, c] -= signed
                    wrench[m, 3 + c1] -= signed * (body[KIN_R + c2] + tab.frame[marker, T.MK_ARM + c2])
                    wrench[m, 3 + c2] += signed * (body[KIN_R + c1] + tab.frame[marker, T.MK_ARM + c1])
                elif kind == terms.DOT1:
                    for c in range(3):
                        wrench[m, 3 + c] -= signed * s[c]
                else:
                    com = vector_at(s, 3, 3)
                    for c in range(3):
                        com[c] = body[KIN_R + c]
                    _deduct(m, factor, g, 6 * side, g, 6 * side + 3, com, wrench, s)


@njit(cache=True, error_model="numpy", forceinline=True)
def internal_reactions(members, tab, wrench, multipliers, phi, force, moment, s):
    """Write what the fixed joints transmit, from the outermost members inwards.

    Parameters
    ----------
    members : Members
    tab : Tables
        Of the integrated model, markers up to date.
    wrench : ndarray, shape (members, 6)
        Force, and moment about the global origin, that moves each member, less the loads of force elements and of
        other constraints; what a joint transmits is added to its parent's.
    multipliers : ndarray, shape (rows,)
        Those of fixed joints are written.
    phi : ndarray, shape (3 rows,)
        Set to zero in the rows of fixed joints.
    force, moment : ndarray, shape (rows, 3)
        Reactions on I's body at marker I, N and N m, global components.
    s : ndarray
        Scratch, 12 places.
    """
    for e in range(members.edge.shape[0]):
        edge = members.edge[e]
        child, parent = edge[EDGE_CHILD], edge[EDGE_PARENT]
        sign = 1.0 if edge[EDGE_CHILD_HAS_I] == 1 else -1.0
        i, j = edge[EDGE_I], edge[EDGE_J]
        body = tab.kin[tab.marker_body[i]]
        for c in range(3):
            s[c] = body[KIN_R + c] + tab.frame[i, T.MK_ARM + c]
        terms.cross3(s, 0, wrench[child], 0, s, 3)
        for c in range(3):
            # moment on I's body about marker I
            s[6 + c] = sign * (wrench[child, 3 + c] - s[3 + c])
        for c in range(6):
            row = edge[EDGE_ROWS + c]
            for d in range(ROW_RECORD):
                phi[ROW_RECORD * row + d] = 0.0
            for d in range(3):
                force[row, d] = moment[row, d] = 0.0
        for c in range(3):
            row = edge[EDGE_ROWS + c]
            force[row, c] = sign * wrench[child, c]
            multipliers[row] = -force[row, c]
            row, axes = edge[EDGE_ROWS + 3 + c], edge[EDGE_AXES + c]
            terms.cross3(tab.frame[i], T.MK_AXES + 3 * (axes // 3), tab.frame[j], T.MK_AXES + 3 * (axes % 3), s, 9)
            # the three axes are at right angles to each other
            multipliers[row] = -terms.dot3(s, 6, s, 9)
            for d in range(3):
                moment[row, d] = -multipliers[row] * s[9 + d]
        if parent >= 0:
            for c in range(6):
                wrench[parent, c] += wrench[child, c]


@njit(cache=True, error_model="numpy", nogil=True)
def _expand(first, count, t, idata, rdata, work, members, narrow, wide, wrench, s):
    """Do what `expand` promises, in arrays that its caller keeps alive.

    Parameters
    ----------
    first, count, t, idata, rdata, work, members, narrow, wide
        As of `expand`.
    wrench, s : ndarray, shapes (members, 6) and (24,)
        Scratch.
    """
    idata, t = uncounted(idata), uncounted(t)
    tab = T.unpack(idata, rdata, work)
    n = members.group.size
    base = 6 * n
    wrench, s = matrix_at(wrench, 0, n, 6), uncounted(s)
    rows, elements, told = members.row.size, narrow.loads.shape[1], narrow.loads.shape[2]
    size, poses = narrow.solution.shape[1], narrow.pose.shape[1]
    groups = size - rows
    wide_rows, wide_size, wide_poses = wide.force.shape[1], wide.solution.shape[1], wide.pose.shape[1]
    for k in range(count):
        to = first + k
        solution = vector_at(narrow.solution, size * k, size)
        phi = vector_at(narrow.phi, ROW_RECORD * rows * k, ROW_RECORD * rows)
        loads = matrix_at(narrow.loads, elements * told * k, elements, told)
        pose = vector_at(wide.pose, wide_poses * to, wide_poses)
        result = vector_at(wide.solution, wide_size * to, wide_size)
        wide_phi = vector_at(wide.phi, ROW_RECORD * wide_rows * to, ROW_RECORD * wide_rows)
        force = matrix_at(wide.force, 3 * wide_rows * to, wide_rows, 3)
        moment = matrix_at(wide.moment, 3 * wide_rows * to, wide_rows, 3)
        _take_pose(vector_at(narrow.pose, poses * k, poses), tab)
        update_markers(tab.marker_body, tab.marker, tab.kin, tab.frame)
        update_functions(t[k], tab)
        for m in range(n):
            move_member(m, members, tab, solution, pose, result, wrench, s)
        deduct_loads(loads, members, tab, wrench, s)
        _deduct_rows(vector_at(solution, groups, rows), members, tab, wrench, s)
        internal_reactions(members, tab, wrench, vector_at(result, base, wide_rows), wide_phi, force, moment, s)
        wide.strayed[to] = narrow.strayed[k]
        for f in range(elements):
            for c in range(told):
                wide.loads[to, f, c] = loads[f, c]
        for r in range(rows):
            row = members.row[r]
            result[base + row] = solution[groups + r]
            for c in range(ROW_RECORD):
                wide_phi[ROW_RECORD * row + c] = phi[ROW_RECORD * r + c]
            for c in range(3):
                force[row, c] = narrow.force[k, r, c]
                moment[row, c] = narrow.moment[k, r, c]


@njit(
    void(int64, int64, _VEC, _IVEC, _VEC, _VEC, MEMBERS_TYPE, RECORDS_TYPE, RECORDS_TYPE),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def expand(first, count, t, idata, rdata, work, members, narrow, wide):
    """Write the records of all bodies and joints from those of the integrated model.

    Parameters
    ----------
    first, count : int
        Row of ``wide`` that belongs to row 0 of ``narrow``, and the number of rows.
    t : ndarray, shape (count,)
        Output times.
    idata, rdata, work : ndarray
        Tables of the integrated model.
    members : Members
    narrow, wide : Records
        Of the integrated model, and of the whole one.
    """
    n = members.group.size
    _expand(first, count, t, idata, rdata, work, members, narrow, wide, np.zeros((n, 6)), np.zeros(24))


class MemberEvaluator(Evaluator):
    """Evaluator of the whole mechanism's records on the unknowns of one in which bodies are integrated as one."""

    def __init__(self, problem: DAEProblem, members: Members) -> None:
        super().__init__(problem)
        self.members = members
        sizes = (int(problem.idata[k]) for k in (T.H_BODIES, T.H_ROWS, T.H_FORCES, T.H_DIAGNOSTICS))
        bodies, rows, elements, diagnostics = sizes
        self.narrow = new_records(PART, bodies - 1, rows, elements, diagnostics)

    def _evaluate_rows(self, first: int, last: int, t: np.ndarray, y: np.ndarray, table: np.ndarray, records) -> int:
        """Evaluate rows one after the other, and expand them."""
        while first < last:
            stop = min(first + PART, last)
            done = super()._evaluate_rows(0, stop - first, t[first:stop], y[first:stop], table, self.narrow)
            times = t[first : first + done]
            expand(first, done, times, table, self.rdata, self.work, self.members, self.narrow, records)
            first += done
            if first < stop:
                break
        return first

    def _evaluate_singular(self, row: int, t: np.ndarray, y: np.ndarray, table: np.ndarray, records: Records) -> None:
        super()._evaluate_singular(0, t, y, table, self.narrow)
        expand(row, 1, t, table, self.rdata, self.work, self.members, self.narrow, records)
