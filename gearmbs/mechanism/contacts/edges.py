"""Where edges of faceted solids pass below the surface of another solid while no vertex does, as of crossed bars.

Along an edge the distance phi from the other solid is least where its slope changes sign. Where it does so smoothly,
the gradient g there is at right angles to the edge; where two faces of the other solid meet, so is the mean of both
gradients that the slopes weigh:

    g = (s_b g_a - s_a g_b) / (s_b - s_a),   s = g . e,   s_a < 0 <= s_b.

By the envelope theorem phi changes by g . (motion of the edge's point there against the other solid) in both cases:
the load along g, |g| f(D), is the gradient of the potential of `gearmbs.mechanism.contacts.loads`, too. An edge that
lies flat has no such place; `NODES` points along it then bear the load, which moves smoothly from one to the next.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.mechanism.contacts import meshes as pt
from gearmbs.mechanism.contacts.facets import (
    LESS,
    brought,
    from_solid,
    half_lengths,
    largest_depth,
    row_of,
    seen_from,
    within,
)
from gearmbs.mechanism.contacts.fields import HALF_SPACE
from gearmbs.mechanism.contacts.loads import NORM
from gearmbs.mechanism.contacts.meshes import dot, relative, to_global, to_local, turned
from gearmbs.mechanism.contacts.smooth_pairs import by_distance

NODES = 8
"""Points along an edge that lies flat: the load moves by an eighth of the overlap from one to the next."""
ON_EDGE = 1e-3
"""Weight of all of them: a face that lies flat bears 1e-5 more with the nodes of its edges than by its vertices."""
DEEPEST = 1e-6
"""Weight of the deepest point, which jumps along an edge that lies flat: by a thousandth of the load at most. Alone it
bears DEEPEST^(1/q), 0.95, of that of a vertex."""
HALVINGS = 40
RESOLVED = 1e-12
"""Interval at which a search ends, m, if not by so many halvings before."""
SAME = 1e-15
"""Distances, m, that are the same but for rounding."""
STEEP = 0.03
"""Slope of the distance along an edge from which on it does not lie flat, and its nodes count for nothing."""
VANISHED = 1e-6
"""|g| below which an edge is in the middle of a plate and pushed to neither side."""
ROOM = 512
"""Points of edges at a time."""
EDGE = 4
"""Integers of an edge: both vertices, both plane faces of the mesh."""


@njit(cache=True, error_model="numpy", forceinline=True)
def cut_by_box(p, q, half):
    """Return between which parts of its length a segment is within a box; the first is larger if nowhere."""
    low, high = 0.0, 1.0
    for k in range(3):
        along = q[k] - p[k]
        if abs(along) < 1e-300:
            if abs(p[k]) > half[k]:
                return 1.0, 0.0
            continue
        one, other = (-half[k] - p[k]) / along, (half[k] - p[k]) / along
        low, high = max(low, min(one, other)), min(high, max(one, other))
    return low, high


@njit(cache=True, error_model="numpy")
def on_segment(p, q, part, solid, x, grad, hess, work):
    """Write a point of a segment; return its distance from a solid and the distance's slope over the segment's length.

    Parameters
    ----------
    p, q : ndarray
        Ends, in the solid's frame, m.
    part : float
        From 0 to 1.
    solid : tuple
    x, grad, hess : ndarray
        Out: the point, gradient and Hessian (9) of the distance.
    work : ndarray, shape (14,)
    """
    for k in range(3):
        x[k] = p[k] + part * (q[k] - p[k])
    phi = from_solid(solid, x, grad, hess, work)
    return phi, grad[0] * (q[0] - p[0]) + grad[1] * (q[1] - p[1]) + grad[2] * (q[2] - p[2])


@njit(cache=True, error_model="numpy")
def deepest(p, q, low, high, length, floor, solid, x, grad, hess, work):
    """Write the deepest point of a segment, with g as gradient; return its distance and whether it is no end.

    Where it cannot be deeper than ``floor``, the distance is 1 and nothing is written.

    Parameters
    ----------
    p, q : ndarray
        Ends, in the solid's frame, m.
    low, high : float
        Parts of the segment between which to look.
    length : float
        Of the segment, m.
    floor : float
        Depth from which on points count, m.
    solid : tuple
    x, grad, hess : ndarray
        Out.
    work : ndarray, shape (20,)
        Out: the gradients before and after the point.
    """
    before, after, rest = work[0:3], work[3:6], work[6:20]
    phi_high, slope_high = on_segment(p, q, high, solid, x, grad, hess, rest)
    for k in range(3):
        after[k] = grad[k]
    phi_low, slope_low = on_segment(p, q, low, solid, x, grad, hess, rest)
    # no distance changes by more than the way
    if phi_low + phi_high + 2.0 * floor > (high - low) * length:
        return 1.0, False
    if slope_low >= 0.0 or slope_high <= 0.0:
        return min(phi_low, phi_high), False
    for k in range(3):
        before[k] = grad[k]
    for attempt in range(HALVINGS):
        middle, bent = 0.5 * (low + high), -np.inf
        if attempt % 2 == 0:
            # where both tangents meet: between two plane faces the very place
            middle = low + (phi_high - phi_low - slope_high * (high - low)) / (slope_low - slope_high)
            middle = min(max(middle, low), high)
            bent = phi_low + slope_low * (middle - low)
        phi, slope = on_segment(p, q, middle, solid, x, grad, hess, rest)
        if abs(phi - bent) < SAME:
            high = middle
            break
        side = before if slope < 0.0 else after
        for k in range(3):
            side[k] = grad[k]
        if slope < 0.0:
            low, slope_low, phi_low = middle, slope, phi
        else:
            high, slope_high, phi_high = middle, slope, phi
        if phi_low + phi_high + 2.0 * floor > (high - low) * length:
            return 1.0, False
        if (high - low) * length < RESOLVED:
            break
    phi, _ = on_segment(p, q, high, solid, x, grad, hess, rest)
    share = slope_high / (slope_high - slope_low)
    for k in range(3):
        grad[k] = after[k] + share * (before[k] - after[k])
    return phi, True


@njit(cache=True, error_model="numpy", forceinline=True)
def beside(p, q, move):
    """Return whether the box about a segment is beside that of the other solid, both in the frame of the segment."""
    for k in range(3):
        if max(p[k], q[k]) < move[12 + k] or min(p[k], q[k]) > move[15 + k]:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _clear(p, q, low, high, length, floor, solid, anchor, x, grad, hess, work):
    """Return whether part of a segment is less than ``floor`` below a surface, by its middle or a point farther off.

    Parameters
    ----------
    p, q : ndarray
        Ends, in the solid's frame, m.
    low, high, length, floor : float
        As of `deepest`.
    solid : tuple
    anchor : ndarray, shape (4,)
        In and out: a point and how far it is outside.
    x, grad, hess, work : ndarray
        As of `on_segment`.
    """
    middle, reach = 0.5 * (low + high), 0.5 * (high - low) * length
    for k in range(3):
        x[k] = p[k] + middle * (q[k] - p[k])
    if within(x, anchor, reach - floor):
        return True
    phi, _ = on_segment(p, q, middle, solid, x, grad, hess, work)
    if phi > 0.0:
        for k in range(3):
            anchor[k] = x[k]
        anchor[3] = phi
    return (phi + floor) * LESS > reach


@njit(cache=True, error_model="numpy")
def edges_below(rows, count, swapped, edges, solid_a, solid_b, bearing, work):
    """Write points of edges of solid a that lie below the surface of solid b; return how many rows there are then.

    Parameters
    ----------
    rows : ndarray, shape (points, COLUMNS)
        Out, from row ``count`` on.
    count, swapped : int
    edges : ndarray of int, shape (EDGE edges,)
    solid_a, solid_b : tuple
    bearing : float
        As of `gearmbs.mechanism.contacts.facets.vertices_below`.
    work : ndarray, shape (80,)
    """
    if solid_b[0] == HALF_SPACE:
        return count
    places, half, move = solid_a[3], work[0:3], work[3:21]
    half_lengths(solid_b[0], solid_b[1], half)
    seen_from(solid_a[2], solid_b[2], half, move)
    p, q, along, x, grad, hess = work[21:24], work[24:27], work[27:30], work[30:33], work[33:36], work[36:45]
    before, after, anchor = work[45:48], work[48:51], work[65:69]
    anchor[3] = 0.0
    floor = bearing * largest_depth(rows, count)
    for e in range(0, edges.size, EDGE):
        one, other = places[3 * edges[e] : 3 * edges[e] + 3], places[3 * edges[e + 1] : 3 * edges[e + 1] + 3]
        if beside(one, other, move):
            continue
        brought(move, one, p)
        brought(move, other, q)
        low, high = cut_by_box(p, q, half)
        if low >= high:
            continue
        for k in range(3):
            along[k] = q[k] - p[k]
        length = np.sqrt(dot(along, along))
        if _clear(p, q, low, high, length, floor, solid_b, anchor, x, grad, hess, work[45:59]):
            continue
        phi, is_within = deepest(p, q, low, high, length, floor, solid_b, x, grad, hess, work[45:65])
        if phi >= 0.0:
            continue
        between, least = (high - low) * length / NODES, -np.inf
        for k in range(-1, NODES):
            gain, weight = 1.0, 0.0
            if k >= 0:
                least -= between
                if k > 0 and least > -floor:
                    # too near the node before to be so deep
                    continue
                part = low + (high - low) * (k + 0.5) / NODES
                phi, slope = on_segment(p, q, part, solid_b, x, grad, hess, work[45:59])
                least = phi
                weight = _lies_flat(along, hess, slope / length, (high - low) * length, phi)
            elif is_within:
                gain = np.sqrt(dot(grad, grad))
                weight = DEEPEST if gain > VANISHED else 0.0
            if weight == 0.0 or -phi < floor or count == rows.shape[0]:
                continue
            floor = max(floor, -bearing * phi)
            row = rows[count]
            row[pt.POOL], row[pt.WEIGHT], row[pt.SWAPPED] = rows.shape[0] + count, weight, swapped
            row[pt.FACES], row[pt.FACES + 1], row[pt.VERTEX] = edges[e + 2], edges[e + 3], e
            count += 1
            _put(row, x, phi, grad, gain, hess, solid_b[2])
            for c in range(3):
                row[pt.ALONG + c] = along[c] if k < 0 else 0.0
                row[pt.BENT + c] = after[c] - before[c]
    return count


@njit(cache=True, error_model="numpy")
def _put(row, x, phi, grad, gain, hess, pose):
    """Write place, normal, depth and Hessian of a point of an edge; no Hessian where two faces meet.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
    x, grad, hess : ndarray
        The point, g, and the Hessian (9), in the other solid's frame.
    phi, gain : float
        Distance, m, and |g|.
    pose : ndarray, shape (12,)
        Of the other solid.
    """
    smooth = gain > 1.0 - VANISHED
    place, normal = row[pt.VERTEX_PLACE : pt.VERTEX_PLACE + 3], row[pt.NORMAL : pt.NORMAL + 3]
    to_global(pose, x, place)
    to_global(pose, grad, normal)
    row[pt.DEPTH], row[pt.GAIN] = -phi, gain
    for c in range(3):
        place[c] += pose[9 + c]
        normal[c] /= gain
        row[pt.PLACE + c] = place[c] - 0.5 * phi * normal[c]
    for c in range(9):
        row[pt.HESSIAN + c] = hess[c] if smooth else 0.0


@njit(cache=True, error_model="numpy")
def _lies_flat(along, hess, slope, overlap, phi):
    """Return the weight of a node: nothing where the edge is steep, or the other solid curved along it.

    It is curved if half of the overlap falls away by more than the part 1/q of the depth over which a load spreads.
    """
    if abs(slope) >= STEEP or phi >= 0.0:
        return 0.0
    bent = 0.0
    for k in range(3):
        for m in range(3):
            bent += along[k] * hess[3 * k + m] * along[m]
    curved = NORM * bent / dot(along, along) * overlap**2 / (-8.0 * phi)
    return ON_EDGE / NODES * (1.0 - (slope / STEEP) ** 2) ** 2 / (1.0 + curved**2)


@njit(cache=True, error_model="numpy")
def label_edges(rows, first, end, start, count, offset, edges):
    """Give points of edges the patch of their vertices, or of edges of the same plane face, or one for each edge.

    Parameters
    ----------
    rows : ndarray, shape (points, COLUMNS)
    first, end, start, count : int
        Rows of the solid's vertices, from ``first`` to ``end``, and of its edges.
    offset : int
        What its numbers of vertices begin with.
    edges : ndarray of int, shape (EDGE edges,)
    """
    for k in range(start, count):
        e, found = int(rows[k, pt.VERTEX]), False
        for side in range(2):
            at = row_of(rows, first, end, offset + edges[e + side])
            if at >= 0 and not found:
                rows[k, pt.POOL], found = rows[at, pt.POOL], True
        for m in range(start, k):
            for side in range(4):
                if not found and rows[m, pt.FACES + side // 2] == rows[k, pt.FACES + side % 2]:
                    rows[k, pt.POOL], found = rows[m, pt.POOL], True


# How points of faceted solids, vertices and the deepest ones of edges, move with both bodies.


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
