"""Motions and loads of bodies integrated as one, of eight outputs side by side; see `gearmbs.dae.model.members`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import float64, int64, types

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.kinematics.rotation import (
    KIN_A,
    KIN_R,
    KIN_V,
    KIN_W,
    POSE_A,
    POSE_COLUMNS,
    POSE_R,
    POSE_V,
    POSE_W,
)
from gearmbs.dae.equations.outputs.accelerations import ROW_RECORD
from gearmbs.dae.equations.outputs.lanes import BODY_COLUMNS, TERM_VALUES, cross, dot, three
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.kernels.structs import Struct, Vector

# What bodies integrated as one are made of, as tables; see `gearmbs.dae.model.members`.


_IVEC = int64[::1]

EDGE_CHILD, EDGE_PARENT, EDGE_I, EDGE_J, EDGE_CHILD_HAS_I = range(5)
EDGE_AXES = 5
"""Of the three rows that keep the orientation: 3 * axis of I + axis of J."""
EDGE_ROWS = 8
"""Six rows in the order of the joint: coincident x, y, z, then the orientation."""
EDGE_COLUMNS = 14
"""Of a fixed joint inside a group; members count from 0, -1 is the ground."""

TURN_I, TURN_J, TURN_SIDE, TURN_ROOT = range(4)
"""Of an axis: markers I and J; 1 where I's body turns and -1 where J's does; 1, or -1 where I starts half a turn off
what the motion says."""
TURN_ROWS = 4
"""Six rows: coincident x, y, z, the two that keep the axis, and that of the motion or -1."""
TURN_COLUMNS = 10
"""Of the revolute joint on the ground in which a group turns about a fixed axis, where that is all it can do."""

PLACE_R, PLACE_A = 0, 3
PLACE_MASS, PLACE_INERTIA = 12, 13
PLACE_COLUMNS = 22
"""Of a member: its centre of mass and axes in the frame of its group, mass, inertia in its own axes."""


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


def no_turns() -> np.ndarray:
    """Return the table of axes of groups that are integrated by all six coordinates."""
    return np.zeros((0, TURN_COLUMNS), dtype=np.int64)


def no_members() -> Members:
    """Return the tables of a model whose bodies are all integrated by themselves."""
    nobody, numbers = np.zeros(0, dtype=np.int64), np.zeros((0, PLACE_COLUMNS))
    return Members(nobody, numbers, nobody, nobody, np.zeros((0, EDGE_COLUMNS), dtype=np.int64), no_turns())


S_ACCELERATION, S_ARM = 0, 6
"""Places of the scratch: acceleration of the group, arm of a member, three vectors, two moments."""
S_FIRST, S_SECOND, S_MOMENT, S_MOMENTUM = 9, 12, 15, 18
SCRATCH = 21


class MemberLanes(Struct):
    """What is evaluated of all bodies and joints, in lanes.

    Attributes
    ----------
    pose, solution, phi, force, moment : ndarray
        As of `gearmbs.dae.model.records.Records`, of eight outputs.
    wrench : ndarray
        Of each member force, and moment about the global origin, that move it.
    loads : ndarray
        F and N of each force element.
    scratch : ndarray
    """

    pose: Vector
    solution: Vector
    phi: Vector
    force: Vector
    moment: Vector
    wrench: Vector
    loads: Vector
    scratch: Vector


def new_member_lanes(members: Members, elements: int) -> MemberLanes:
    """Return empty tables; without members they take no room."""
    n = members.group.size
    rows = members.row.size + 6 * len(members.edge)
    sizes = {
        "pose": POSE_COLUMNS * n, "solution": 6 * n + rows, "phi": ROW_RECORD * rows, "force": 3 * rows,
        "moment": 3 * rows, "wrench": 6 * n, "loads": 6 * elements, "scratch": SCRATCH,
    }  # fmt: skip
    return MemberLanes(**{name: np.zeros(LANES * size if n else 0) for name, size in sizes.items()})


@njit(cache=True, error_model="numpy", forceinline=True)
def put_three(out, at, vector):
    """Write the three components of a vector."""
    put_lanes(out, at, vector[0])
    put_lanes(out, at + 1, vector[1])
    put_lanes(out, at + 2, vector[2])


@njit(cache=True, error_model="numpy", forceinline=True)
def move_member(m, members, tab, lanes, wide):
    """Write pose and accelerations of member m, and the wrench about the global origin that moves it."""
    b, place = members.group[m], members.place
    body, pose, s, wrench = lanes.body, wide.pose, wide.scratch, wide.wrench
    first, p = b * BODY_COLUMNS, POSE_COLUMNS * m
    for c in range(6):
        put_lanes(s, S_ACCELERATION + c, lanes_at(lanes.solution, 6 * (b - 1) + c) if b > 0 else all_lanes(0.0))
    for c in range(3):
        x, y, z = three(body, first + KIN_A + 3 * c)
        arm = x * place[m, PLACE_R] + y * place[m, PLACE_R + 1] + z * place[m, PLACE_R + 2]
        put_lanes(s, S_ARM + c, arm)
        put_lanes(pose, p + POSE_R + c, lanes_at(body, first + KIN_R + c) + arm)
        put_lanes(pose, p + POSE_W + c, lanes_at(body, first + KIN_W + c))
        for d in range(3):
            q = PLACE_A + d
            axis = x * place[m, q] + y * place[m, q + 3] + z * place[m, q + 6]
            put_lanes(pose, p + POSE_A + 3 * c + d, axis)
    # v = v_g + w x r, a = a_g + alpha x r + w x (w x r)
    put_three(s, S_FIRST, cross(body, first + KIN_W, s, S_ARM))
    put_three(s, S_SECOND, cross(body, first + KIN_W, s, S_FIRST))
    put_three(s, S_MOMENT, cross(s, S_ACCELERATION + 3, s, S_ARM))
    mass = place[m, PLACE_MASS]
    for c in range(3):
        put_lanes(pose, p + POSE_V + c, lanes_at(body, first + KIN_V + c) + lanes_at(s, S_FIRST + c))
        a = lanes_at(s, S_ACCELERATION + c) + lanes_at(s, S_MOMENT + c) + lanes_at(s, S_SECOND + c)
        put_lanes(wide.solution, 6 * m + c, a)
        put_lanes(wide.solution, 6 * m + 3 + c, lanes_at(s, S_ACCELERATION + 3 + c))
        put_lanes(wrench, 6 * m + c, mass * (a - tab.gravity[c]))
    # J alpha + w x J w about the centre of mass, in the member's axes, moved to the origin
    for c in range(3):
        x, y, z = (lanes_at(pose, p + POSE_A + c), lanes_at(pose, p + POSE_A + 3 + c),
                   lanes_at(pose, p + POSE_A + 6 + c))  # fmt: skip
        a0, a1, a2 = three(s, S_ACCELERATION + 3)
        w0, w1, w2 = three(body, first + KIN_W)
        put_lanes(s, S_FIRST + c, x * a0 + y * a1 + z * a2)
        put_lanes(s, S_SECOND + c, x * w0 + y * w1 + z * w2)
    for c in range(3):
        q = PLACE_INERTIA + 3 * c
        a0, a1, a2 = three(s, S_FIRST)
        w0, w1, w2 = three(s, S_SECOND)
        put_lanes(s, S_MOMENT + c, a0 * place[m, q] + a1 * place[m, q + 1] + a2 * place[m, q + 2])
        put_lanes(s, S_MOMENTUM + c, w0 * place[m, q] + w1 * place[m, q + 1] + w2 * place[m, q + 2])
    put_three(s, S_FIRST, cross(s, S_SECOND, s, S_MOMENTUM))
    for c in range(3):
        put_lanes(s, S_MOMENT + c, lanes_at(s, S_MOMENT + c) + lanes_at(s, S_FIRST + c))
    put_three(s, S_FIRST, cross(pose, p + POSE_R, wrench, 6 * m))
    for c in range(3):
        moment = dot(pose, p + POSE_A + 3 * c, s, S_MOMENT) + lanes_at(s, S_FIRST + c)
        put_lanes(wrench, 6 * m + 3 + c, moment)


@njit(cache=True, error_model="numpy", forceinline=True)
def deduct(m, factor, force, f_at, moment, m_at, s, point, wrench):
    """Subtract a load on a member, a force at a point and a moment, from the wrench that moves it.

    Parameters
    ----------
    m : int
        Member; nothing is done for -1, the ground.
    factor : float or lanes
        Of the load.
    force, f_at, moment, m_at : ndarray, int, ndarray, int
        Force and moment about the point, in lanes from these places on.
    s, point : ndarray, int
        Where the force acts, in lanes from this place on.
    wrench : ndarray
        In lanes; six places from ``6 m`` on are changed.
    """
    if m < 0:
        return
    x, y, z = cross(s, point, force, f_at)
    for c in range(3):
        arm = x if c == 0 else y if c == 1 else z
        put_lanes(wrench, 6 * m + c, lanes_at(wrench, 6 * m + c) - factor * lanes_at(force, f_at + c))
        turn = lanes_at(moment, m_at + c) + arm
        put_lanes(wrench, 6 * m + 3 + c, lanes_at(wrench, 6 * m + 3 + c) - factor * turn)


@njit(cache=True, error_model="numpy", forceinline=True)
def marker_place(marker, tab, lanes, out, at):
    """Write the origin of a marker."""
    first, arm = tab.marker_body[marker] * BODY_COLUMNS + KIN_R, T.MK_COLUMNS * marker + T.MK_ARM
    for c in range(3):
        put_lanes(out, at + c, lanes_at(lanes.body, first + c) + lanes_at(lanes.frame, arm + c))


@njit(cache=True, error_model="numpy", forceinline=True)
def deduct_loads(members, tab, lanes, wide):
    """Take what the force elements exert away from the wrenches; J's body feels the opposite at I's point."""
    for f in range(tab.force.shape[0]):
        i, j = tab.force[f, T.FORCE_I], tab.force[f, T.FORCE_J]
        marker_place(i, tab, lanes, wide.scratch, S_FIRST)
        loads, at = wide.loads, 6 * f
        deduct(members.of_marker[i], 1.0, loads, at, loads, at + 3, wide.scratch, S_FIRST, wide.wrench)
        deduct(members.of_marker[j], -1.0, loads, at, loads, at + 3, wide.scratch, S_FIRST, wide.wrench)


@njit(cache=True, error_model="numpy", forceinline=True)
def deduct_rows(base, members, tab, lanes, wide):
    """Take what the constraints of the integrated model exert away from the wrenches; ``base`` is that of its rows."""
    frame, other, wrench, s = lanes.frame, lanes.other, wide.wrench, wide.scratch
    others = np.int64(0)
    for r in range(members.row.size):
        for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
            factor = -tab.coef[j] * lanes_at(lanes.solution, base + r)
            kind, axes = tab.term[j, T.TERM_TYPE], tab.term[j, T.TERM_AXES]
            place = TERM_VALUES * others
            others += 1 if kind != terms.POINT and kind != terms.DOT1 else 0
            if kind == terms.DOT1:
                at_i = T.MK_COLUMNS * tab.term[j, T.TERM_I] + T.MK_AXES + 3 * (axes // 3)
                at_j = T.MK_COLUMNS * tab.term[j, T.TERM_J] + T.MK_AXES + 3 * (axes % 3)
                put_three(s, S_FIRST, cross(frame, at_i, frame, at_j))
            for side in range(2):
                marker = tab.term[j, T.TERM_I + side]
                m = members.of_marker[marker]
                if m < 0:
                    continue
                signed = factor if side == 0 else -factor
                if kind == terms.POINT:
                    c1, c2 = axes + 1 if axes < 2 else 0, axes - 1 if axes > 0 else 2
                    marker_place(marker, tab, lanes, s, S_FIRST)
                    force, first, second = 6 * m + axes, 6 * m + 3 + c1, 6 * m + 3 + c2
                    put_lanes(wrench, force, lanes_at(wrench, force) - signed)
                    put_lanes(wrench, first, lanes_at(wrench, first) - signed * lanes_at(s, S_FIRST + c2))
                    put_lanes(wrench, second, lanes_at(wrench, second) + signed * lanes_at(s, S_FIRST + c1))
                elif kind == terms.DOT1:
                    for c in range(3):
                        turn = 6 * m + 3 + c
                        put_lanes(wrench, turn, lanes_at(wrench, turn) - signed * lanes_at(s, S_FIRST + c))
                else:
                    com, g = tab.marker_body[marker] * BODY_COLUMNS + KIN_R, place + 6 * side
                    deduct(m, factor, other, g, other, g + 3, lanes.body, com, wrench)


@njit(cache=True, error_model="numpy", forceinline=True)
def internal_reactions(members, tab, lanes, wide):
    """Write what the fixed joints inside transmit, from the outermost members inwards."""
    s, wrench, frame, base = wide.scratch, wide.wrench, lanes.frame, 6 * members.group.size
    zero = all_lanes(0.0)
    for e in range(members.edge.shape[0]):
        edge = members.edge[e]
        child, parent = edge[EDGE_CHILD], edge[EDGE_PARENT]
        sign = 1.0 if edge[EDGE_CHILD_HAS_I] == 1 else -1.0
        i, j = edge[EDGE_I], edge[EDGE_J]
        marker_place(i, tab, lanes, s, S_FIRST)
        put_three(s, S_SECOND, cross(s, S_FIRST, wrench, 6 * child))
        for c in range(3):
            # moment on I's body about marker I
            put_lanes(s, S_MOMENT + c, sign * (lanes_at(wrench, 6 * child + 3 + c) - lanes_at(s, S_SECOND + c)))
        for c in range(3):
            row = edge[EDGE_ROWS + c]
            force = sign * lanes_at(wrench, 6 * child + c)
            for d in range(3):
                put_lanes(wide.force, 3 * row + d, force if d == c else zero)
                put_lanes(wide.moment, 3 * row + d, zero)
            put_lanes(wide.solution, base + row, -force)
            row, axes = edge[EDGE_ROWS + 3 + c], edge[EDGE_AXES + c]
            at_i, at_j = T.MK_COLUMNS * i + T.MK_AXES + 3 * (axes // 3), T.MK_COLUMNS * j + T.MK_AXES + 3 * (axes % 3)
            put_three(s, S_SECOND, cross(frame, at_i, frame, at_j))
            # the three axes are at right angles to each other
            along = dot(s, S_MOMENT, s, S_SECOND)
            put_lanes(wide.solution, base + row, -along)
            for d in range(3):
                put_lanes(wide.force, 3 * row + d, zero)
                put_lanes(wide.moment, 3 * row + d, along * lanes_at(s, S_SECOND + d))
        if parent >= 0:
            for c in range(6):
                total = lanes_at(wrench, 6 * parent + c) + lanes_at(wrench, 6 * child + c)
                put_lanes(wrench, 6 * parent + c, total)


@njit(cache=True, error_model="numpy")
def expand_lanes(idata, rdata, work, members, lanes, wide):
    """Write what is evaluated of all bodies and joints from what is known of the integrated ones.

    The rows of joints inside keep the zeros that ``phi`` begins with: they are never violated.
    """
    tab = T.unpack(idata, rdata, work)
    base, n = idata[T.H_COORDINATES], members.group.size
    for m in range(n):
        move_member(m, members, tab, lanes, wide)
    deduct_loads(members, tab, lanes, wide)
    deduct_rows(base, members, tab, lanes, wide)
    internal_reactions(members, tab, lanes, wide)
    for r in range(members.row.size):
        row = members.row[r]
        put_lanes(wide.solution, 6 * n + row, lanes_at(lanes.solution, base + r))
        for c in range(3):
            put_lanes(wide.phi, ROW_RECORD * row + c, lanes_at(lanes.phi, ROW_RECORD * r + c))
            put_lanes(wide.force, 3 * row + c, lanes_at(lanes.force, 3 * r + c))
            put_lanes(wide.moment, 3 * row + c, lanes_at(lanes.moment, 3 * r + c))
