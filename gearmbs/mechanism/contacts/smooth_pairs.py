"""Where solids touch at one point: a ball and any solid by its distance, a convex solid and a plane by its support."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.mechanism.contacts import points as pt
from gearmbs.mechanism.contacts.fields import distance
from gearmbs.mechanism.contacts.points import dot, local_point, moved, relative, to_global, to_local, turned
from gearmbs.mechanism.contacts.supports import support


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
    depth = radius - phi
    row[pt.DEPTH] = depth
    for q in range(3):
        row[pt.NORMAL + q] = normal[q]
        row[pt.PLACE + q] = centre[q] - (radius - 0.5 * depth) * normal[q]
    if not derivatives:
        return
    rel, turn, local, bent = work[0:3], work[3:6], work[6:9], work[9:12]
    for c in range(12):
        relative(c, centre, origin_a, origin_b, rel)
        to_local(pose, rel, local)
        for q in range(3):
            turn[q] = hess[3 * q] * local[0] + hess[3 * q + 1] * local[1] + hess[3 * q + 2] * local[2]
        to_global(pose, turn, bent)
        if c >= 9:
            turned(c - 9, normal, turn)
            for q in range(3):
                bent[q] += turn[q]
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
        place[q] = -normal[q]
    to_local(pose_a, place, w)
    support(kind, sizes, w, y, hess)
    to_global(pose_a, y, place)
    depth = 0.0
    for q in range(3):
        place[q] += pose_a[9 + q]
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
