"""How points of faceted solids, vertices and the deepest ones of edges, move with both bodies."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.mechanism.contacts import points as pt
from gearmbs.mechanism.contacts.edges import VANISHED
from gearmbs.mechanism.contacts.points import dot, relative, to_global, to_local, turned
from gearmbs.mechanism.contacts.smooth_pairs import by_distance


@njit(cache=True, error_model="numpy")
def moved_with(rows, count, pose_a, pose_b, origins, work):
    """Write how points of faceted solids move with both bodies.

    Parameters
    ----------
    rows : ndarray, shape (points, COLUMNS)
    count : int
    pose_a, pose_b : ndarray, shape (12,)
        Of the solids of the bodies of markers I and J, if a row is not swapped.
    origins : ndarray, shape (2, 3)
        Of the markers.
    work : ndarray, shape (27,)
    """
    x, normal, hess = work[12:15], work[15:18], work[18:27]
    for k in range(count):
        row = rows[k]
        for q in range(3):
            x[q], normal[q] = row[pt.VERTEX_PLACE + q], row[pt.NORMAL + q]
        for q in range(9):
            hess[q] = row[pt.HESSIAN + q]
        swapped = int(row[pt.SWAPPED])
        pose, own, other = pose_b if swapped == 0 else pose_a, origins[swapped], origins[1 - swapped]
        by_distance(row, x, 0.0, -row[pt.DEPTH], hess, normal, pose, own, other, True, work)
        if dot(row[pt.ALONG : pt.ALONG + 3], row[pt.ALONG : pt.ALONG + 3]) > 0.0:
            _slide(row, x, hess, pose, own, other, work)


@njit(cache=True, error_model="numpy")
def _towards(c, along, normal, pose, work):
    """Return n . de by a variation: a turn of the edge's own body, less that of the other."""
    if c % 6 < 3:
        return 0.0
    here, turn = work[3:6], work[6:9]
    to_global(pose, along, here)
    turned(c % 6 - 3, here, turn)
    to_local(pose, turn, here)
    return dot(normal, here) if c < 6 else -dot(normal, here)


@njit(cache=True, error_model="numpy")
def _slide(row, place, hess, pose, origin_a, origin_b, work):
    """Add to the derivatives of a deepest point that it slides along its edge e by ds, and that g changes.

    Where g is smooth, g . e = 0 stays, so that e . H (rel + e ds) + g . de = 0 and dg = H (rel + e ds). Where two faces
    with the gradients g_a and g_b meet, it stays on both: with m = g_b - g_a, m . (rel + e ds) = 0 and
    dg = -m (g . de) / (m . e).

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        As `by_distance` wrote it for a point of the edge, with a zero Hessian where faces meet.
    place, hess : ndarray
        Its global coordinates, m, and the Hessian (9) of the distance in the other solid's frame.
    pose : ndarray, shape (12,)
        Of the other solid.
    origin_a, origin_b : ndarray
        Origins of the markers.
    work : ndarray, shape (27,)
    """
    rel, local, turn, change, normal = work[0:3], work[3:6], work[6:9], work[9:12], work[15:18]
    along, bent = row[pt.ALONG : pt.ALONG + 3], row[pt.BENT : pt.BENT + 3]
    gain, depth = row[pt.GAIN], row[pt.DEPTH]
    smooth = gain > 1.0 - VANISHED
    to_local(pose, row[pt.NORMAL : pt.NORMAL + 3], normal)
    if smooth:
        for k in range(3):
            bent[k] = hess[3 * k] * along[0] + hess[3 * k + 1] * along[1] + hess[3 * k + 2] * along[2]
    curvature = dot(along, bent)
    for c in range(12):
        relative(c, place, origin_a, origin_b, rel)
        to_local(pose, rel, local)
        way = -dot(bent, local)
        turns = gain * _towards(c, along, normal, pose, work)
        if smooth:
            way -= turns
        way = way / curvature if curvature > 0.0 else 0.0
        for k in range(3):
            change[k] = bent[k] * way if smooth else -bent[k] * turns / curvature
        grown = dot(normal, change)
        sink = row[pt.D_DEPTH + c]
        row[pt.D_DEPTH + c], row[pt.D_GAIN + c] = gain * sink, grown
        for k in range(3):
            change[k] = (change[k] - grown * normal[k]) / gain
        to_global(pose, change, turn)
        to_global(pose, along, local)
        for k in range(3):
            row[pt.D_NORMAL + 12 * k + c] += turn[k]
            slid = way * local[k] + 0.5 * depth * turn[k] + 0.5 * (gain - 1.0) * sink * row[pt.NORMAL + k]
            row[pt.D_PLACE + 12 * k + c] += slid
