"""By how much two convex solids overlap along a direction, and the direction in which they overlap least.

In the frame of solid b, with the supports of both, two solids overlap along the unit vector n from b to a by

    o(n) = n . (y_b - y_a),   y_b outermost of b along n,   y_a outermost of a along -n.

The depth D is the least overlap: moved by D along n the two touch. On the unit sphere, with U the directions at right
angles to n and S = h_ww of both, the slope of o is U^T (y_b - y_a) and its second derivative U^T (S_a + S_b) U - o.

The supports are those of `gearmbs.mechanism.contacts.overlaps`, with rounded edges, but for a box as solid b. Its o has
a kink where a component of n vanishes. n stays there while y_a is between the sides of the box across this axis: a face
has two such components, an edge one, a corner none.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.mechanism.contacts.fields import BALL, BOX, ELLIPSOID, FRUSTUM
from gearmbs.mechanism.contacts.meshes import dot

# Support functions: how far solids reach in a direction, the point that does, and how it moves with the direction.
#
# Of a solid with the support function h(w), of degree one, the outermost point is y = dh/dw and moves by h_ww dw, at
# right angles to w. Edges and flat faces are rounded by EDGE: |w_k| becomes the square root of w_k^2 + EDGE^2 |w|^2, so
# that the point moves smoothly from one end of a face to the other within about EDGE radians. The sizes are those of a
# solid that is smaller by as much as this adds to its faces (`reduced`), so that the faces stay where they were.


EDGE = 1e-4
"""Radians of tilt within which a face's resultant moves from its middle to its edge: below it, tilts of real faces
under load are of the order of penetration over length."""


def reduced(kind: int, sizes: np.ndarray) -> np.ndarray:
    """Return the sizes of a shape whose rounded solid has the faces of the given one.

    Parameters
    ----------
    kind : int
    sizes : ndarray, shape (4,)
        As in the tables; the last, shift of the centre along z, m, is written for a frustum.
    """
    out = np.array(sizes, dtype=float)
    if kind == BOX:
        matrix = np.full((3, 3), EDGE) + (np.sqrt(1.0 + EDGE**2) - EDGE) * np.eye(3)
        out[:3] = np.linalg.solve(matrix, out[:3])
    elif kind == FRUSTUM:
        bottom, top, half = sizes[:3]
        out[:2] = np.maximum(out[:2] - EDGE * half, 0.0)
        out[2] = half - 0.5 * EDGE * (bottom + top)
        out[3] = 0.5 * EDGE * (bottom - top)
    elif kind not in (BALL, ELLIPSOID):
        out[1] = sizes[1] - EDGE * sizes[0]
        out[0] = sizes[0] * (1.0 + EDGE)
    return out


@njit(cache=True, error_model="numpy")
def add_root(d0, d1, d2, factor, w, point, hess):
    """Add factor sqrt(w D w), D diagonal: its gradient to ``point`` and its Hessian to ``hess``."""
    g = (d0 * w[0], d1 * w[1], d2 * w[2])
    d = (d0, d1, d2)
    # h = sqrt(w D w): h_w = D w / h, h_ww = (D - h_w h_w^T) / h
    root = np.sqrt(max(g[0] * w[0] + g[1] * w[1] + g[2] * w[2], 1e-300))
    for q in range(3):
        point[q] += factor * g[q] / root
        for p in range(3):
            hess[3 * q + p] += factor * ((d[q] if q == p else 0.0) - g[q] * g[p] / root**2) / root


@njit(cache=True, error_model="numpy")
def support(kind, sizes, w, point, hess):
    """Write the outermost point in the direction w, a unit vector of the shape's frame, and dpoint/dw (9)."""
    square = EDGE * EDGE
    for q in range(3):
        point[q] = 0.0
    for q in range(9):
        hess[q] = 0.0
    if kind == BALL:
        add_root(1.0, 1.0, 1.0, sizes[0], w, point, hess)
    elif kind == ELLIPSOID:
        add_root(sizes[0] ** 2, sizes[1] ** 2, sizes[2] ** 2, 1.0, w, point, hess)
    elif kind == BOX:
        # a box reaches sum_k size_k |w_k|, each |w_k| rounded
        add_root(1.0 + square, square, square, sizes[0], w, point, hess)
        add_root(square, 1.0 + square, square, sizes[1], w, point, hess)
        add_root(square, square, 1.0 + square, sizes[2], w, point, hess)
    elif kind == FRUSTUM:
        _frustum(sizes, w, point, hess)
    else:
        # a torus: its circle's radial reach, and the tube's in any direction
        add_root(1.0 + square, 1.0 + square, square, sizes[0], w, point, hess)
        add_root(1.0, 1.0, 1.0, sizes[1], w, point, hess)


@njit(cache=True, error_model="numpy")
def _frustum(sizes, w, point, hess):
    """The larger of the reaches of both rims, smoothly: half their sum and half the root of their difference squared.

    With s the rounded radial part of w: difference G = 2 half w_z + (top - bottom) s, c = 2 EDGE half |w|, root
    m = sqrt(G^2 + c^2).
    """
    bottom, top, half = sizes[0], sizes[1], sizes[2]
    square = EDGE * EDGE
    s = np.zeros(3)
    ss = np.zeros(9)
    add_root(1.0 + square, 1.0 + square, square, 1.0, w, s, ss)
    reach = s[0] * w[0] + s[1] * w[1] + s[2] * w[2]
    difference = 2.0 * half * w[2] + (top - bottom) * reach
    c = 4.0 * square * half * half
    root = np.sqrt(difference**2 + c * (w[0] ** 2 + w[1] ** 2 + w[2] ** 2))
    g = np.empty(3)
    m = np.empty(3)
    for q in range(3):
        # gradients of the difference and of the root
        g[q] = (top - bottom) * s[q] + (2.0 * half if q == 2 else 0.0)
        m[q] = (difference * g[q] + c * w[q]) / root
    for q in range(3):
        point[q] = 0.5 * ((bottom + top) * s[q] + m[q])
        for p in range(3):
            # m m_ww = g g^T + G G_ww + c - m_w m_w^T
            second = g[q] * g[p] + difference * (top - bottom) * ss[3 * q + p] + (c if q == p else 0.0) - m[q] * m[p]
            hess[3 * q + p] = 0.5 * ((bottom + top) * ss[3 * q + p] + second / root)
    point[2] += sizes[3]


MOVE, Y_A, S_A, Y_B, S_B, BASIS, FREE, SIDE = 0, 12, 15, 24, 27, 36, 42, 45
"""Work: axes and centre of a in b's frame, outermost points and how they move with n, directions n may take, which
components of n may differ from zero (1, 0), and to which side."""
LOCAL = 48
"""Scratch of `overlap`: direction, point and second derivative in a's frame."""
TRIAL = 63
WAY = 66
WORK = 69
SEARCHES = 80
"""Steps at most; about ten are usual."""
WIDEST = 0.3
"""Largest change of n along one direction in a step, rad."""
RESOLVED = 1e-14
"""Part of the solids' size to which slopes of o vanish."""


@njit(cache=True, error_model="numpy")
def place_in(pose_a, pose_b, work):
    """Write the axes and the centre of solid a in the frame of b."""
    for r in range(3):
        work[MOVE + 9 + r] = 0.0
        for q in range(3):
            work[MOVE + 9 + r] += pose_b[3 * q + r] * (pose_a[9 + q] - pose_b[9 + q])
        for c in range(3):
            work[MOVE + 3 * r + c] = 0.0
            for q in range(3):
                work[MOVE + 3 * r + c] += pose_b[3 * q + r] * pose_a[3 * q + c]


@njit(cache=True, error_model="numpy")
def overlap(kind_a, sizes_a, kind_b, sizes_b, n, work):
    """Return o(n); write the outermost points of both and how they move with n."""
    move, w, y, hess = (
        work[MOVE : MOVE + 12],
        work[LOCAL : LOCAL + 3],
        work[LOCAL + 3 : LOCAL + 6],
        work[LOCAL + 6 : TRIAL],
    )
    for c in range(3):
        # the direction -n in a's frame; back in b's, y = R y_a + centre and S = R S_a R^T
        w[c] = -(move[c] * n[0] + move[3 + c] * n[1] + move[6 + c] * n[2])
    support(kind_a, sizes_a, w, y, hess)
    for r in range(3):
        work[Y_A + r] = move[9 + r] + move[3 * r] * y[0] + move[3 * r + 1] * y[1] + move[3 * r + 2] * y[2]
    for r in range(3):
        b0 = move[3 * r] * hess[0] + move[3 * r + 1] * hess[3] + move[3 * r + 2] * hess[6]
        b1 = move[3 * r] * hess[1] + move[3 * r + 1] * hess[4] + move[3 * r + 2] * hess[7]
        b2 = move[3 * r] * hess[2] + move[3 * r + 1] * hess[5] + move[3 * r + 2] * hess[8]
        for c in range(3):
            work[S_A + 3 * r + c] = b0 * move[3 * c] + b1 * move[3 * c + 1] + b2 * move[3 * c + 2]
    if kind_b == BOX:
        for q in range(3):
            # the corner of the box on the side of n; where a component of n vanishes, the middle of its side
            work[Y_B + q] = work[SIDE + q] * sizes_b[q]
        for q in range(9):
            work[S_B + q] = 0.0
    else:
        support(kind_b, sizes_b, n, work[Y_B : Y_B + 3], work[S_B : S_B + 9])
    return (
        n[0] * (work[Y_B] - work[Y_A]) + n[1] * (work[Y_B + 1] - work[Y_A + 1]) + n[2] * (work[Y_B + 2] - work[Y_A + 2])
    )


@njit(cache=True, error_model="numpy")
def set_free(kind_b, n, work):
    """Make n a unit vector and note which of its components may differ from zero."""
    size = np.sqrt(dot(n, n))
    for q in range(3):
        n[q] /= size
        work[FREE + q] = 0.0 if kind_b == BOX and n[q] == 0.0 else 1.0
        work[SIDE + q] = np.sign(n[q]) if kind_b == BOX else 0.0


@njit(cache=True, error_model="numpy")
def directions(n, work):
    """Write unit vectors at right angles to n along which it may turn; return how many (0 to 2)."""
    u, v = work[BASIS : BASIS + 3], work[BASIS + 3 : BASIS + 6]
    free = work[FREE] + work[FREE + 1] + work[FREE + 2]
    if free < 1.5:
        return 0
    if free < 2.5:
        i = 0 if work[FREE] > 0.0 else 1
        k = 2 if work[FREE + 2] > 0.0 else 1
        u[0] = u[1] = u[2] = 0.0
        # n turns in the plane of its two free components
        u[i], u[k] = -n[k], n[i]
        return 1
    k = 0
    for q in range(1, 3):
        if abs(n[q]) < abs(n[k]):
            k = q
    for q in range(3):
        u[q] = (1.0 if q == k else 0.0) - n[k] * n[q]
    size = np.sqrt(dot(u, u))
    for q in range(3):
        u[q] /= size
    for q in range(3):
        v[q] = n[(q + 1) % 3] * u[(q + 2) % 3] - n[(q + 2) % 3] * u[(q + 1) % 3]
    return 2


@njit(cache=True, error_model="numpy", forceinline=True)
def bent(work, a, b):
    """Return b^T (S_a + S_b) a."""
    total = 0.0
    for q in range(3):
        for p in range(3):
            total += b[q] * (work[S_A + 3 * q + p] + work[S_B + 3 * q + p]) * a[p]
    return total


@njit(cache=True, error_model="numpy")
def newton_step(n, o, many, widest, work, out):
    """Write the way to turn n, in the frame of b; return the slope of o and what o is expected to fall by.

    Along the principal directions of the second derivative, by Newton's method where it is positive and down the slope
    where it is not, and by no more than ``widest``.
    """
    u, v = work[BASIS : BASIS + 3], work[BASIS + 3 : BASIS + 6]
    gu = gv = sine = 0.0
    cosine = 1.0
    for q in range(3):
        gu += u[q] * (work[Y_B + q] - work[Y_A + q])
        gv += v[q] * (work[Y_B + q] - work[Y_A + q]) if many == 2 else 0.0
    # second derivatives of o on the sphere: U^T (S_a + S_b) U - o
    huu = bent(work, u, u) - o
    low = high = huu
    if many == 2:
        huv, hvv = bent(work, u, v), bent(work, v, v) - o
        # principal directions of a symmetric 2 x 2 matrix
        angle = 0.5 * np.arctan2(2.0 * huv, huu - hvv)
        cosine, sine = np.cos(angle), np.sin(angle)
        high = cosine * cosine * huu + 2.0 * cosine * sine * huv + sine * sine * hvv
        low = sine * sine * huu - 2.0 * cosine * sine * huv + cosine * cosine * hvv
    one, other = cosine * gu + sine * gv, -sine * gu + cosine * gv
    # Newton's step -g / h, down the slope where h is negative, and no longer than ``widest``
    first = -one / max(abs(high), max(abs(one) / widest, 1e-300))
    second = -other / max(abs(low), max(abs(other) / widest, 1e-300)) if many == 2 else 0.0
    for q in range(3):
        out[q] = (cosine * first - sine * second) * u[q]
        if many == 2:
            out[q] += (sine * first + cosine * second) * v[q]
    for q in range(3):
        if work[FREE + q] > 0.0 and n[q] == 0.0 and out[q] * work[SIDE + q] < 0.0:
            # a component that was let go has one side only, down the slope
            part = widest / np.sqrt(gu * gu + gv * gv)
            for p in range(3):
                out[p] = -part * (gu * u[p] + (gv * v[p] if many == 2 else 0.0))
            return np.sqrt(gu * gu + gv * gv), widest * np.sqrt(gu * gu + gv * gv)
    return np.sqrt(gu * gu + gv * gv), -(one * first + other * second)


@njit(cache=True, error_model="numpy")
def turn_by(n, way, kind_b, work, out):
    """Write n turned along ``way``, to where a component of n against a box vanishes at most; return which, or -1."""
    # the part of the way at which the first component vanishes
    part, at = 1.0, -1
    if kind_b == BOX:
        for q in range(3):
            if work[FREE + q] > 0.0 and (n[q] + way[q]) * work[SIDE + q] < 0.0 and n[q] / -way[q] < part:
                part, at = n[q] / -way[q], q
    for q in range(3):
        out[q] = 0.0 if q == at else n[q] + part * way[q]
    size = np.sqrt(dot(out, out))
    for q in range(3):
        out[q] /= size
    return at


@njit(cache=True, error_model="numpy")
def release(sizes_b, size, work):
    """Let the component of n go across whose sides of a box the outermost point of a is farthest; return if any."""
    most, at = RESOLVED * size, -1
    for q in range(3):
        beyond = abs(work[Y_A + q]) - sizes_b[q]
        if work[FREE + q] == 0.0 and beyond > most:
            most, at = beyond, q
    if at >= 0:
        work[FREE + at] = 1.0
        work[SIDE + at] = np.sign(work[Y_A + at])
    return at >= 0


@njit(cache=True, error_model="numpy")
def least_overlap(kind_a, sizes_a, kind_b, sizes_b, n, work):
    """Turn n to where the overlap is least nearby; return it, or what is not positive once the solids are apart.

    Parameters
    ----------
    kind_a, sizes_a, kind_b, sizes_b : int, ndarray
        Of both solids, as in `gearmbs.mechanism.contacts.overlaps`; of a box b its half lengths.
    n : ndarray, shape (3,)
        In and out: unit vector from b to a, in b's frame, as `set_free` leaves it.
    work : ndarray, shape (WORK,)
        With the place of a; out: the points and directions of n.
    """
    trial, way = work[TRIAL : TRIAL + 3], work[WAY : WAY + 3]
    widest = WIDEST
    o = overlap(kind_a, sizes_a, kind_b, sizes_b, n, work)
    size = np.sqrt(dot(work[Y_B : Y_B + 3], work[Y_B : Y_B + 3])) + abs(o)
    for _ in range(SEARCHES):
        if o <= 0.0:
            return o
        many = directions(n, work)
        slope, fall = newton_step(n, o, many, widest, work, way) if many > 0 else (0.0, 0.0)
        if slope <= RESOLVED * size:
            if kind_b == BOX and release(sizes_b, size, work):
                widest = WIDEST
                continue
            return o
        at = turn_by(n, way, kind_b, work, trial)
        side = work[SIDE + max(at, 0)]
        if at >= 0:
            work[SIDE + at] = 0.0
        there = overlap(kind_a, sizes_a, kind_b, sizes_b, trial, work)
        better = there < o
        if not better and fall < 1e-12 * size:
            # the fall drowns in rounding: the slope decides
            total = 0.0
            for k in range(many):
                s = 0.0
                for q in range(3):
                    s += work[BASIS + 3 * k + q] * (work[Y_B + q] - work[Y_A + q])
                total += s * s
            better = np.sqrt(total) < slope
            if not better:
                if at >= 0:
                    work[SIDE + at] = side
                return overlap(kind_a, sizes_a, kind_b, sizes_b, n, work)
        if better:
            for q in range(3):
                n[q] = trial[q]
            if at >= 0:
                work[FREE + at] = 0.0
            o = there
            widest = min(2.0 * widest, WIDEST)
            continue
        if at >= 0:
            work[SIDE + at] = side
        widest = 0.25 * min(widest, np.sqrt(dot(way, way)))
        o = overlap(kind_a, sizes_a, kind_b, sizes_b, n, work)
    return o
