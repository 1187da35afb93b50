"""Where two boxes touch: by the axis along which they overlap least.

If that is the normal of a face, the face of the other box that looks against it is cut by the sides of the first; the
corners of what remains are the points of contact (a polygon of up to eight). If it is the product of two edges, they
touch at one point. A corner of the polygon is a vertex of the cut face, which moves with it; or lies on one of its
edges with direction d where a side with normal m cuts it, and moves by -d (m . rel)/(m . d) against it; or lies below a
corner of the cutting face and moves along its normal n by n (k . rel)/(k . n), with k the normal of the cut face. Here
rel is the motion of the cut body's material point against the other's.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at
from gearmbs.mechanism.contacts import meshes as pt
from gearmbs.mechanism.contacts.meshes import dot, moved, relative, turned

MOST = 8
"""Points of contact of two boxes."""
EDGES_WORSE = 0.95
"""Two edges count only if they overlap by less than this part of the faces' overlap: else rounding would decide."""
VERTEX, ON_EDGE, CORNER = 0, 1, 2
"""Kinds of corners of the cut face: see above."""
X, ALONG, NEXT, KIND, SIDE, NEXT_SIDE = 0, 3, 6, 9, 10, 11
"""Record of a corner: place, direction of the edge it lies on, direction of the edge to the next, kind, side that
made it, side that made the edge to the next (-1: none, it is one of the face's own)."""
CORNER_COLUMNS = 12
CORNERS = 12
LEAST = 1e-12
"""Added to the weights, m, so that those of a polygon that is a point do not vanish."""
SCRATCH = 24 + 2 * CORNERS * CORNER_COLUMNS


@njit(cache=True, error_model="numpy")
def axis_of(pose, k, out):
    """Write the k-th axis of a pose."""
    for q in range(3):
        out[q] = pose[3 * q + k]


@njit(cache=True, error_model="numpy")
def reach(pose, half, direction):
    """Return how far a box extends along a direction from its centre."""
    total = 0.0
    for k in range(3):
        along = pose[k] * direction[0] + pose[3 + k] * direction[1] + pose[6 + k] * direction[2]
        total += half[k] * abs(along)
    return total


@njit(cache=True, error_model="numpy")
def two_boxes(rows, pose_i, half_i, pose_j, half_j, origins, derivatives, work):
    """Write the points at which two boxes touch; return how many.

    Parameters
    ----------
    rows : ndarray, shape (at least MOST, COLUMNS)
        Out.
    pose_i, pose_j : ndarray, shape (12,)
        Axes and centres of the boxes.
    half_i, half_j : ndarray
        Half lengths.
    origins : ndarray, shape (2, 3)
        Origins of both markers.
    derivatives : bool
    work : ndarray, shape (SCRATCH,)
    """
    apart, axis, e, f = work[0:3], work[3:6], work[6:9], work[9:12]
    for q in range(3):
        apart[q] = pose_i[9 + q] - pose_j[9 + q]
    best, which = -np.inf, 0
    for k in range(6):
        axis_of(pose_i if k < 3 else pose_j, k % 3, axis)
        gap = abs(dot(apart, axis)) - reach(pose_i, half_i, axis) - reach(pose_j, half_j, axis)
        if gap > best:
            best, which = gap, k
    if best >= 0.0:
        return 0
    faces = best
    for k in range(9):
        axis_of(pose_i, k // 3, e)
        axis_of(pose_j, k % 3, f)
        _cross(e, f, axis)
        length = np.sqrt(dot(axis, axis))
        if length < 1e-6:
            continue
        for q in range(3):
            axis[q] /= length
        gap = abs(dot(apart, axis)) - reach(pose_i, half_i, axis) - reach(pose_j, half_j, axis)
        if gap >= 0.0:
            return 0
        if gap > best and gap > EDGES_WORSE * faces:
            best, which = gap, 6 + k
    if which >= 6:
        return _edges(rows, pose_i, half_i, pose_j, half_j, which - 6, origins, derivatives, work)
    swapped = 0 if which >= 3 else 1
    k, n = which % 3, work[12:15]
    axis_of(pose_i if swapped else pose_j, k, n)
    if (dot(apart, n) < 0.0) != (swapped == 1):
        for q in range(3):
            n[q] = -n[q]
    if swapped == 0:
        return _faces(rows, pose_i, half_i, pose_j, half_j, k, 0, origins, derivatives, work)
    return _faces(rows, pose_j, half_j, pose_i, half_i, k, 1, origins, derivatives, work)


@njit(cache=True, error_model="numpy")
def box_on_plane(rows, pose_a, half_a, pose_b, swapped, origins, derivatives, work):
    """Write the points at which a box touches the half-space below a plane: a face without sides; return how many.

    Parameters
    ----------
    rows : ndarray, shape (at least MOST, COLUMNS)
        Out.
    pose_a, half_a : ndarray
        Axes and centre of the box, half lengths.
    pose_b : ndarray, shape (12,)
        Axes and origin of the plane.
    swapped : int
        1 if the box is that of marker J.
    origins : ndarray, shape (2, 3)
    derivatives : bool
    work : ndarray, shape (SCRATCH,)
    """
    endless = work[3:6]
    endless[0] = endless[1] = np.inf
    endless[2] = 0.0
    axis_of(pose_b, 2, work[12:15])
    return _faces(rows, pose_a, half_a, pose_b, endless, 2, swapped, origins, derivatives, work)


@njit(cache=True, error_model="numpy", forceinline=True)
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def _faces(rows, pose_a, half_a, pose_b, half_b, k, swapped, origins, derivatives, work):
    """Cut the face of box a that looks against the face of box b with the normal n in ``work[12:15]``.

    Parameters
    ----------
    rows, pose_a, half_a, pose_b, half_b, origins, derivatives, work
        As in `two_boxes`.
    k : int
        Axis of box b along n.
    swapped : int
        1 if box a is that of marker J.
    """
    n, face, centre = work[12:15], work[15:18], work[18:21]
    most, cut = 0.0, 0
    for c in range(3):
        axis_of(pose_a, c, face)
        if abs(dot(face, n)) > most:
            most, cut = abs(dot(face, n)), c
    axis_of(pose_a, cut, face)
    if dot(face, n) > 0.0:
        for q in range(3):
            face[q] = -face[q]
    u, w = (cut + 1) % 3, (cut + 2) % 3
    for q in range(3):
        centre[q] = pose_a[9 + q] + half_a[cut] * face[q]
    polygon = matrix_at(work, 24, CORNERS, CORNER_COLUMNS)
    other = matrix_at(work, 24 + CORNERS * CORNER_COLUMNS, CORNERS, CORNER_COLUMNS)
    for c in range(4):
        su = -1.0 if c == 0 or c == 3 else 1.0
        sw = -1.0 if c < 2 else 1.0
        for q in range(3):
            polygon[c, X + q] = centre[q] + su * half_a[u] * pose_a[3 * q + u] + sw * half_a[w] * pose_a[3 * q + w]
            polygon[c, NEXT + q] = pose_a[3 * q + (u if c % 2 == 0 else w)]
        polygon[c, KIND], polygon[c, SIDE], polygon[c, NEXT_SIDE] = VERTEX, 0.0, -1.0
    count = 4
    side = work[21:24]
    for s in range(4):
        _side(pose_b, k, s, side)
        limit = dot(side, pose_b[9:12]) + half_b[(k + 1 + s // 2) % 3]
        count = _clip(count, polygon, other, s, side, limit)
        polygon, other = other, polygon
    level, around = dot(n, pose_b[9:12]) + half_b[k], 0.0
    for c in range(count):
        around += _length(polygon[c], polygon[(c + 1) % count]) + LEAST
    found = 0
    for c in range(count):
        corner = polygon[c]
        depth = level - dot(n, corner)
        if depth <= 0.0 or found >= MOST:
            continue
        row = rows[found]
        found += 1
        row[pt.DEPTH], row[pt.POOL], row[pt.SWAPPED], row[pt.GAIN] = depth, 0.0, swapped, 1.0
        before = polygon[c - 1 if c > 0 else count - 1]
        beside = _length(corner, polygon[(c + 1) % count]) + _length(corner, before)
        row[pt.WEIGHT] = (0.5 * beside + LEAST) / around
        for q in range(3):
            row[pt.NORMAL + q] = n[q]
            row[pt.PLACE + q] = corner[q] + 0.5 * depth * n[q]
        if derivatives:
            _side(pose_b, k, int(corner[SIDE]), side)
            _corner_moves(row, corner, side, n, face, origins[swapped], origins[1 - swapped], work)
    return found


@njit(cache=True, error_model="numpy")
def _clip(count, polygon, out, number, side, limit):
    """Cut a polygon at a side of the other box, ``number``; return how many corners remain."""
    kept = 0
    for c in range(count):
        here, there = polygon[c], polygon[(c + 1) % count]
        a, b = dot(side, here) - limit, dot(side, there) - limit
        if a <= 0.0 and kept < CORNERS:
            for q in range(CORNER_COLUMNS):
                out[kept, q] = here[q]
            kept += 1
        if (a <= 0.0) == (b <= 0.0) or kept >= CORNERS:
            continue
        part = a / (a - b)
        corner = out[kept]
        kept += 1
        for q in range(3):
            corner[X + q] = here[X + q] + part * (there[X + q] - here[X + q])
            corner[ALONG + q] = corner[NEXT + q] = here[NEXT + q]
        corner[KIND] = ON_EDGE if here[NEXT_SIDE] < 0.0 else CORNER
        corner[SIDE] = number
        # the polygon goes on along the edge it came in by, or along the cut
        corner[NEXT_SIDE] = number if a <= 0.0 else here[NEXT_SIDE]
    return kept


@njit(cache=True, error_model="numpy")
def _corner_moves(row, corner, side, n, face, origin_a, origin_b, work):
    """Write the derivatives of a corner of the cut face, below face n of the other box.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        Out.
    corner : ndarray, shape (CORNER_COLUMNS,)
    side : ndarray
        Normal of the side that made it.
    n, face : ndarray
        Normals of the cutting face and of the cut one.
    origin_a, origin_b : ndarray
        Origins of the markers of the cut and of the cutting box.
    work : ndarray
        Scratch; its first twelve entries are used.
    """
    rel, own, turn = work[0:3], work[3:6], work[6:9]
    depth = row[pt.DEPTH]
    for c in range(12):
        relative(c, corner, origin_a, origin_b, rel)
        if c < 6:
            moved(c, corner, origin_a, own)
        else:
            own[0] = own[1] = own[2] = 0.0
        if corner[KIND] == ON_EDGE:
            slide = dot(side, rel) / dot(side, corner[ALONG : ALONG + 3])
            for q in range(3):
                own[q] -= slide * corner[ALONG + q]
        elif corner[KIND] == CORNER:
            # it moves with the cutting box, own - rel, and along n
            rise = dot(face, rel) / dot(face, n)
            for q in range(3):
                own[q] += rise * n[q] - rel[q]
        turn[0] = turn[1] = turn[2] = 0.0
        if c >= 9:
            turned(c - 9, n, turn)
        if c >= 6:
            moved(c - 6, corner, origin_b, rel)
        else:
            rel[0] = rel[1] = rel[2] = 0.0
        sink = dot(n, rel) - dot(n, own)
        row[pt.D_DEPTH + c], row[pt.D_GAIN + c] = sink, 0.0
        for q in range(3):
            row[pt.D_NORMAL + 12 * q + c] = turn[q]
            row[pt.D_PLACE + 12 * q + c] = own[q] + 0.5 * (depth * turn[q] + sink * n[q])


@njit(cache=True, error_model="numpy")
def _edges(rows, pose_i, half_i, pose_j, half_j, pair, origins, derivatives, work):
    """Write the point at which two edges cross; see `two_boxes` for the other arguments.

    With e and f along the edges, n = e x f / |e x f| from J to I and the nearest points x = y - depth n, those move on
    along their edges by what keeps them nearest.

    Parameters
    ----------
    rows, pose_i, half_i, pose_j, half_j, origins, derivatives, work
        As in `two_boxes`.
    pair : int
        Three times the axis of I's edge and that of J's.
    """
    e, f, n, x, y, apart = work[6:9], work[9:12], work[12:15], work[15:18], work[18:21], work[21:24]
    axis_of(pose_i, pair // 3, e)
    axis_of(pose_j, pair % 3, f)
    _cross(e, f, n)
    length = np.sqrt(dot(n, n))
    for q in range(3):
        apart[q] = pose_i[9 + q] - pose_j[9 + q]
    if dot(apart, n) < 0.0:
        length = -length
    for q in range(3):
        n[q] /= length
        x[q], y[q] = pose_i[9 + q], pose_j[9 + q]
    for k in range(3):
        if k != pair // 3:
            axis_of(pose_i, k, apart)
            sign = -1.0 if dot(apart, n) > 0.0 else 1.0
            for q in range(3):
                x[q] += sign * half_i[k] * apart[q]
        if k != pair % 3:
            axis_of(pose_j, k, apart)
            sign = 1.0 if dot(apart, n) > 0.0 else -1.0
            for q in range(3):
                y[q] += sign * half_j[k] * apart[q]
    # nearest points of the lines x + s e and y + t f
    ef = dot(e, f)
    for q in range(3):
        apart[q] = x[q] - y[q]
    s = (ef * dot(f, apart) - dot(e, apart)) / (1.0 - ef * ef)
    t = (dot(f, apart) - ef * dot(e, apart)) / (1.0 - ef * ef)
    depth = -dot(n, apart)
    row = rows[0]
    row[pt.DEPTH], row[pt.WEIGHT], row[pt.POOL], row[pt.SWAPPED], row[pt.GAIN] = depth, 1.0, 0.0, 0.0, 1.0
    for q in range(3):
        x[q] += s * e[q]
        y[q] += t * f[q]
        row[pt.NORMAL + q] = n[q]
        row[pt.PLACE + q] = 0.5 * (x[q] + y[q])
    if depth <= 0.0:
        return 0
    if derivatives:
        _edge_moves(row, e, f, n, x, y, origins, length, work)
    return 1


@njit(cache=True, error_model="numpy")
def _edge_moves(row, e, f, n, x, y, origins, length, work):
    """Write the derivatives of the crossing of two edges.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        Out.
    e, f, n : ndarray
        Directions of the edges of I and J and the normal.
    x, y : ndarray
        Nearest points on them.
    origins : ndarray, shape (2, 3)
    length : float
        |e x f|, negative where n is -e x f / |e x f|.
    work : ndarray
        Scratch.
    """
    rel, turn, along, rest, dn = work[0:3], work[3:6], work[24:27], work[27:30], work[30:33]
    depth = row[pt.DEPTH]
    for c in range(12):
        relative(c, x, origins[0], origins[1], rel)
        if c >= 6:
            # y is that point of J
            moved(c - 6, y, origins[1], turn)
            for q in range(3):
                rel[q] = -turn[q]
        sink = -dot(n, rel)
        dn[0] = dn[1] = dn[2] = 0.0
        if c % 6 >= 3:
            turned(c % 6 - 3, e if c < 6 else f, turn)
            if c < 6:
                _cross(turn, f, dn)
            else:
                _cross(e, turn, dn)
            for q in range(3):
                dn[q] /= length
            out = dot(n, dn)
            for q in range(3):
                dn[q] -= out * n[q]
        # x - y = -depth n stays: e ds - f dt = -(rel + sink n + depth dn)
        for q in range(3):
            rest[q] = -(rel[q] + sink * n[q] + depth * dn[q])
        _cross(f, n, along)
        ds = dot(rest, along) / dot(e, along)
        _cross(e, n, along)
        dt = -dot(rest, along) / dot(f, along)
        row[pt.D_DEPTH + c], row[pt.D_GAIN + c] = sink, 0.0
        for q in range(3):
            row[pt.D_NORMAL + 12 * q + c] = dn[q]
            own = rel[q] if c < 6 else -rel[q]
            row[pt.D_PLACE + 12 * q + c] = 0.5 * (own + ds * e[q] + dt * f[q])


@njit(cache=True, error_model="numpy", forceinline=True)
def _length(a, b):
    return np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@njit(cache=True, error_model="numpy", forceinline=True)
def _side(pose, k, s, out):
    """Write the outward normal of the s-th side around axis k."""
    axis_of(pose, (k + 1 + s // 2) % 3, out)
    if s % 2:
        for q in range(3):
            out[q] = -out[q]
