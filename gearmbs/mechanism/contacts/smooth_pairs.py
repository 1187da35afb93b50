"""Where solids touch at one point: a ball and any solid by its distance, a convex solid and a plane by its support."""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.mechanism.contacts import meshes as pt
from gearmbs.mechanism.contacts import overlaps as ov
from gearmbs.mechanism.contacts.fields import BOX, ELLIPSOID, FRUSTUM, distance
from gearmbs.mechanism.contacts.meshes import dot, local_point, moved, relative, to_global, to_local, turned
from gearmbs.mechanism.contacts.overlaps import support


@njit(cache=True, error_model="numpy")
def by_distance(row, centre, radius, phi, hess, normal, pose, origin_a, origin_b, derivatives, work):
    """Write the contact of a ball of body a, or of a vertex (radius 0), with a solid of body b.

    The point lies on the ball's surface, half the depth back along the normal.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        Out: the point.
    centre, radius : ndarray, float
        Of the ball, global components, m.
    phi, hess, normal : float, ndarray
        Distance of the centre from the solid, its Hessian (9) in the solid's frame, its gradient, global.
    pose : ndarray, shape (12,)
        The solid's axes and origin.
    origin_a, origin_b : ndarray
        Origins of the markers.
    derivatives : bool
    work : ndarray, shape (12,)
        Scratch.
    """
    # the ball touches where its centre is less than its radius from the solid
    depth = radius - phi
    row[pt.DEPTH] = depth
    for q in range(3):
        row[pt.NORMAL + q] = normal[q]
        row[pt.PLACE + q] = centre[q] - (radius - 0.5 * depth) * normal[q]
    if not derivatives:
        return
    rel, turn, local, bent = work[0:3], work[3:6], work[6:9], work[9:12]
    for c in range(12):
        # variation c of the centre against the solid, in whose frame the normal, the gradient of phi, changes by the
        # Hessian
        relative(c, centre, origin_a, origin_b, rel)
        to_local(pose, rel, local)
        for q in range(3):
            turn[q] = hess[3 * q] * local[0] + hess[3 * q + 1] * local[1] + hess[3 * q + 2] * local[2]
        to_global(pose, turn, bent)
        if c >= 9:
            # a turn of the solid turns the normal with it
            turned(c - 9, normal, turn)
            for q in range(3):
                bent[q] += turn[q]
        # d depth = -n . d(centre - solid): to first order the normal's own change does not count
        sink = -dot(normal, rel)
        row[pt.D_DEPTH + c], row[pt.D_GAIN + c] = sink, 0.0
        if c >= 6:
            rel[0] = rel[1] = rel[2] = 0.0
        for q in range(3):
            row[pt.D_NORMAL + 12 * q + c] = bent[q]
            row[pt.D_PLACE + 12 * q + c] = rel[q] - (radius - 0.5 * depth) * bent[q] + 0.5 * sink * normal[q]


@njit(cache=True, error_model="numpy")
def ball_and_solid(row, pose_a, radius, kind, sizes, pose_b, origin_a, origin_b, derivatives, work):
    """Write the contact of a ball of body a with an analytic solid of body b.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        Out: the point.
    pose_a, pose_b : ndarray, shape (12,)
        Axes and origin of the ball, of the solid.
    radius : float
        m.
    kind, sizes : int, ndarray
        Of the solid, as in `fields`.
    origin_a, origin_b : ndarray
        Origins of the markers.
    derivatives : bool
    work : ndarray, shape (30,)
        Scratch.
    """
    local, grad, normal, hess = work[12:15], work[15:18], work[18:21], work[21:30]
    local_point(pose_b, pose_a[9:12], local)
    phi = distance(kind, sizes, local, grad, hess)
    row[pt.GAIN] = 1.0
    to_global(pose_b, grad, normal)
    by_distance(
        row, pose_a[9:12], radius, phi, hess, normal, pose_b, origin_a, origin_b, derivatives and phi < radius, work
    )


@njit(cache=True, error_model="numpy")
def convex_and_plane(row, kind, sizes, pose_a, pose_b, origin_a, origin_b, derivatives, work):
    """Write the contact of a convex solid of body a with the half-space below a plane of body b.

    With w = -n in the solid's frame, its outermost point y moves by h_ww dw, and dw = (dpi_a - dpi_b) x n there.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        Out: the point.
    kind, sizes : int, ndarray
        Of the solid, as in `supports`.
    pose_a, pose_b : ndarray, shape (12,)
        Axes and origin of the solid, of the plane.
    origin_a, origin_b : ndarray
        Origins of the markers.
    derivatives : bool
    work : ndarray, shape (30,)
        Scratch.
    """
    normal, w, y, place, hess = work[12:15], work[0:3], work[15:18], work[18:21], work[21:30]
    for q in range(3):
        normal[q] = pose_b[3 * q + 2]
        # the outermost point against the plane: that of the support function at w = -n
        place[q] = -normal[q]
    to_local(pose_a, place, w)
    support(kind, sizes, w, y, hess)
    to_global(pose_a, y, place)
    depth = 0.0
    for q in range(3):
        place[q] += pose_a[9 + q]
        # depth = -n . (P - plane)
        depth -= normal[q] * (place[q] - pose_b[9 + q])
    row[pt.DEPTH], row[pt.GAIN] = depth, 1.0
    for q in range(3):
        row[pt.NORMAL + q] = normal[q]
        row[pt.PLACE + q] = place[q] + 0.5 * depth * normal[q]
    if not derivatives or depth <= 0.0:
        return
    rel, turn, local, bent = work[0:3], work[3:6], work[6:9], work[9:12]
    for c in range(12):
        relative(c, place, origin_a, origin_b, rel)
        sink = -dot(normal, rel)
        row[pt.D_DEPTH + c], row[pt.D_GAIN + c] = sink, 0.0
        turn[0] = turn[1] = turn[2] = 0.0
        bent[0] = bent[1] = bent[2] = 0.0
        if c % 6 >= 3:
            turned(c % 6 - 3, normal, turn)
            sign = 1.0 if c < 6 else -1.0
            to_local(pose_a, turn, local)
            for q in range(3):
                bent[q] = sign * (hess[3 * q] * local[0] + hess[3 * q + 1] * local[1] + hess[3 * q + 2] * local[2])
            to_global(pose_a, bent, local)
            for q in range(3):
                bent[q] = local[q]
        if c < 6:
            moved(c, place, origin_a, rel)
            turn[0] = turn[1] = turn[2] = 0.0
        else:
            rel[0] = rel[1] = rel[2] = 0.0
        for q in range(3):
            row[pt.D_NORMAL + 12 * q + c] = turn[q]
            row[pt.D_PLACE + 12 * q + c] = rel[q] + bent[q] + 0.5 * (depth * turn[q] + sink * normal[q])


# Where a cylinder, frustum or ellipsoid touches a box or another of them: where they overlap least.
#
# If that is along the normal of a face of a box, the pair is that of the solid and the half-space below the face. Else,
# with the points y_a and y_b = y_a + D n of both surfaces, n keeps U^T (y_b - y_a) = 0 as the bodies move: by the
# motion rel of a's material point and the turn w of a against b, in b's frame,
#
#     dn = U q,   (U^T (S_a + S_b) U - D) q = U^T (rel + S_a (w x n)),   dy_a = rel + S_a (w x n - dn).
#
# The components of n in b's frame that vanish at an edge of a box stay zero, and n turns with b.


STARTS = 10
"""Directions to start from."""
LEAST = 1e-9
"""Length of a direction to start from, also of a component, that is taken for zero."""
TRIED = 2
"""Directions that are tried: those along which the solids overlap least."""
NORMAL, BEST, CANDIDATES = ov.WORK, ov.WORK + 3, ov.WORK + 6
PLANE = CANDIDATES + 4 * STARTS
MOTION = PLANE + 12
SCRATCH = MOTION + 30


@njit(cache=True, error_model="numpy")
def _add(starts, count, x, y, z, centre):
    """Write a direction, turned towards the centre of solid a; return how many there are."""
    size = np.sqrt(x * x + y * y + z * z)
    if size < LEAST:
        return count
    if x * centre[0] + y * centre[1] + z * centre[2] < 0.0:
        size = -size
    for q, along in enumerate((x, y, z)):
        starts[4 * count + q] = along / size if abs(along / size) > LEAST else 0.0
    return count + 1


@njit(cache=True, error_model="numpy")
def directions_to_try(kind_a, sizes_a, kind_b, sizes_b, work):
    """Write normals of faces and flanks and what is at right angles to two axes, in b's frame; return how many.

    Parameters
    ----------
    kind_a, sizes_a, kind_b, sizes_b : int, ndarray
        Of both solids.
    work : ndarray, shape (SCRATCH,)
    """
    starts, centre = work[CANDIDATES:PLANE], work[ov.MOVE + 9 : ov.MOVE + 12]
    a = (work[ov.MOVE + 2], work[ov.MOVE + 5], work[ov.MOVE + 8])
    count = 0
    if kind_b == BOX:
        count = _add(starts, count, 1.0, 0.0, 0.0, centre)
        count = _add(starts, count, 0.0, 1.0, 0.0, centre)
        count = _add(starts, count, 0.0, 0.0, 1.0, centre)
    elif kind_b == FRUSTUM:
        count = _add(starts, count, 0.0, 0.0, 1.0, centre)
        count = _add(starts, count, centre[0], centre[1], 0.0, centre)
    else:
        count = _add(
            starts, count, centre[0] / sizes_b[0] ** 2, centre[1] / sizes_b[1] ** 2, centre[2] / sizes_b[2] ** 2, centre
        )
    if kind_a == FRUSTUM:
        along = a[0] * centre[0] + a[1] * centre[1] + a[2] * centre[2]
        count = _add(starts, count, a[0], a[1], a[2], centre)
        count = _add(
            starts, count, centre[0] - along * a[0], centre[1] - along * a[1], centre[2] - along * a[2], centre
        )
        if kind_b == BOX:
            count = _add(starts, count, 0.0, a[2], -a[1], centre)
            count = _add(starts, count, -a[2], 0.0, a[0], centre)
        if kind_b != ELLIPSOID:
            count = _add(starts, count, a[1], -a[0], 0.0, centre)
    else:
        w = work[NORMAL:BEST]
        for c in range(3):
            w[c] = work[ov.MOVE + c] * centre[0] + work[ov.MOVE + 3 + c] * centre[1] + work[ov.MOVE + 6 + c] * centre[2]
            w[c] /= sizes_a[c] ** 2
        m = work[ov.MOVE : ov.MOVE + 9]
        count = _add(starts, count, dot(m[0:3], w), dot(m[3:6], w), dot(m[6:9], w), centre)
    return _add(starts, count, centre[0], centre[1], centre[2], centre)


@njit(cache=True, error_model="numpy")
def least_of_all(kind_a, sizes_a, pose_a, kind_b, sizes_b, pose_b, work):
    """Return the least overlap of two solids, with its direction in ``work``, or 0 if they are apart.

    Parameters
    ----------
    kind_a, sizes_a, pose_a, kind_b, sizes_b, pose_b : int, ndarray
        Of both solids, as in `convex_pair`.
    work : ndarray, shape (SCRATCH,)
    """
    starts, n, best = work[CANDIDATES:PLANE], work[NORMAL:BEST], work[BEST:CANDIDATES]
    ov.place_in(pose_a, pose_b, work)
    count = directions_to_try(kind_a, sizes_a, kind_b, sizes_b, work)
    for k in range(count):
        for q in range(3):
            n[q] = starts[4 * k + q]
        ov.set_free(kind_b, n, work)
        starts[4 * k + 3] = ov.overlap(kind_a, sizes_a, kind_b, sizes_b, n, work)
        if starts[4 * k + 3] <= 0.0:
            return 0.0
    least = np.inf
    for _ in range(TRIED):
        k = 0
        for m in range(count):
            if starts[4 * m + 3] < starts[4 * k + 3]:
                k = m
        for q in range(3):
            n[q] = starts[4 * k + q]
        starts[4 * k + 3] = np.inf
        ov.set_free(kind_b, n, work)
        o = ov.least_overlap(kind_a, sizes_a, kind_b, sizes_b, n, work)
        if o <= 0.0:
            return 0.0
        if o < least:
            least = o
            for q in range(3):
                best[q] = n[q]
    for q in range(3):
        n[q] = best[q]
    ov.set_free(kind_b, n, work)
    return ov.overlap(kind_a, sizes_a, kind_b, sizes_b, n, work)


@njit(cache=True, error_model="numpy")
def convex_pair(row, kind_a, sizes_a, pose_a, kind_b, sizes_b, pose_b, origin_a, origin_b, derivatives, work):
    """Write the contact of a convex solid of body a with a convex solid of body b.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        Out: the point.
    kind_a, sizes_a, pose_a : int, ndarray
        Of the first solid, as in `gearmbs.mechanism.contacts.overlaps`, with axes and centre.
    kind_b, sizes_b, pose_b : int, ndarray
        Of the second; of a box its half lengths.
    origin_a, origin_b : ndarray
        Origins of the markers.
    derivatives : bool
    work : ndarray, shape (SCRATCH,)
    """
    depth = least_of_all(kind_a, sizes_a, pose_a, kind_b, sizes_b, pose_b, work)
    row[pt.DEPTH], row[pt.GAIN] = depth, 1.0
    if depth <= 0.0:
        return
    n, plane = work[NORMAL:BEST], work[PLANE:MOTION]
    if kind_b == BOX and work[ov.FREE] + work[ov.FREE + 1] + work[ov.FREE + 2] < 1.5:
        face_of(pose_b, sizes_b, n, plane)
        convex_and_plane(row, kind_a, sizes_a, pose_a, plane, origin_a, origin_b, derivatives, work[MOTION:SCRATCH])
        return
    place, normal = work[PLANE : PLANE + 3], work[PLANE + 3 : PLANE + 6]
    to_global(pose_b, n, normal)
    to_global(pose_b, work[ov.Y_A : ov.Y_A + 3], place)
    for q in range(3):
        place[q] += pose_b[9 + q]
        row[pt.NORMAL + q] = normal[q]
        row[pt.PLACE + q] = place[q] + 0.5 * depth * normal[q]
    if derivatives:
        _moves(row, depth, pose_b, origin_a, origin_b, work)


@njit(cache=True, error_model="numpy")
def face_of(pose, half, n, plane):
    """Write axes, the third along n, and the middle of the face of a box with the normal n in its frame."""
    k = 0 if n[0] != 0.0 else (1 if n[1] != 0.0 else 2)
    for q in range(3):
        plane[9 + q] = pose[9 + q] + n[k] * half[k] * pose[3 * q + k]
        plane[3 * q + 2] = n[k] * pose[3 * q + k]
        plane[3 * q] = pose[3 * q + (k + 1) % 3]
        plane[3 * q + 1] = n[k] * pose[3 * q + (k + 2) % 3]


@njit(cache=True, error_model="numpy")
def _moves(row, depth, pose_b, origin_a, origin_b, work):
    """Write the derivatives of the point of contact of two solids whose n turns as they move."""
    n, place, normal = work[NORMAL:BEST], work[PLANE : PLANE + 3], work[PLANE + 3 : PLANE + 6]
    u, v, s_a = work[ov.BASIS : ov.BASIS + 3], work[ov.BASIS + 3 : ov.BASIS + 6], work[ov.S_A : ov.S_A + 9]
    rel, turn = work[MOTION : MOTION + 3], work[MOTION + 3 : MOTION + 6]
    local, dn = work[MOTION + 6 : MOTION + 9], work[MOTION + 9 : MOTION + 12]
    many = ov.directions(n, work)
    huu = ov.bent(work, u, u) - depth
    huv = ov.bent(work, u, v) if many == 2 else 0.0
    hvv = ov.bent(work, v, v) - depth if many == 2 else 1.0
    det = huu * hvv - huv * huv
    for c in range(12):
        relative(c, place, origin_a, origin_b, rel)
        sink = -dot(normal, rel)
        row[pt.D_DEPTH + c], row[pt.D_GAIN + c] = sink, 0.0
        to_local(pose_b, rel, local)
        turn[0] = turn[1] = turn[2] = 0.0
        if c % 6 >= 3:
            turned(c % 6 - 3, normal, dn)
            to_local(pose_b, dn, turn)
            if c >= 6:
                for q in range(3):
                    turn[q] = -turn[q]
        for q in range(3):
            local[q] += dot(s_a[3 * q : 3 * q + 3], turn)
        one, other = dot(u, local), dot(v, local) if many == 2 else 0.0
        first, second = (hvv * one - huv * other) / det, (huu * other - huv * one) / det
        for q in range(3):
            dn[q] = first * u[q] + (second * v[q] if many == 2 else 0.0)
            turn[q] -= dn[q]
        for q in range(3):
            local[q] = dot(s_a[3 * q : 3 * q + 3], turn)
        to_global(pose_b, dn, turn)
        to_global(pose_b, local, dn)
        if c < 6:
            moved(c, place, origin_a, rel)
        else:
            rel[0] = rel[1] = rel[2] = 0.0
        if c >= 9:
            turned(c - 9, normal, local)
            for q in range(3):
                turn[q] += local[q]
        for q in range(3):
            row[pt.D_NORMAL + 12 * q + c] = turn[q]
            row[pt.D_PLACE + 12 * q + c] = rel[q] + dn[q] + 0.5 * (depth * turn[q] + sink * normal[q])
