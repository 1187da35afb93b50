"""The kernel of contact between solids: which points touch, and what acts there.

Integers: the number of pairs, then `PAIR` for each: family, whether the first solid is J's, and both solids. A solid is
its kind, its place in the reals (axes, origin, sizes; of a faceted one the last size is the radius of a ball about it),
number of vertices, their place (coordinates, weights, boxes of blocks of vertices, of triangles, and of these boxes),
number of triangles, their place in the integers, number of edges, their place there. Reals begin with the law.
"""

from __future__ import annotations

from gearmbs.dae.equations.loads.forces import DERIVATIVES, DIAGNOSTICS, FORCE_SIG, FRAME_A, FRAME_P
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, vector_at
from gearmbs.mechanism.contacts import meshes as pt
from gearmbs.mechanism.contacts.boxes import SCRATCH, box_on_plane, two_boxes
from gearmbs.mechanism.contacts.edges import EDGE, edges_below, label_edges, moved_with
from gearmbs.mechanism.contacts.facets import (
    BEARING,
    join_patches,
    label_patches,
    patches_in,
    vertices_below,
    without_idle,
)
from gearmbs.mechanism.contacts.fields import BOX, HALF_SPACE, MESH, distance
from gearmbs.mechanism.contacts.loads import LAW_REALS, press, share_out
from gearmbs.mechanism.contacts.meshes import BLOCK, local_point
from gearmbs.mechanism.contacts.smooth_pairs import ball_and_solid, convex_and_plane, convex_pair

BALL_SOLID, CONVEX_PLANE, BOXES, FACETS, CONVEX = 0, 1, 2, 3, 4
"""Families of pairs."""
SOLID = 8
PAIR = 2 + 2 * SOLID
SOLID_REALS = 16
POSES = 24
"""Scratch: poses of both solids, then origins of both markers, then that of the geometry, then the points."""
GEOMETRY = POSES + 6
ROWS = GEOMETRY + SCRATCH


@njit(cache=True, error_model="numpy")
def pose_of(frame, solid, out):
    """Write a solid's global axes and origin from its marker's frame and its own in it."""
    for r in range(3):
        out[9 + r] = frame[FRAME_P + r]
        for c in range(3):
            out[9 + r] += frame[FRAME_A + 3 * r + c] * solid[9 + c]
            total = 0.0
            for q in range(3):
                total += frame[FRAME_A + 3 * r + q] * solid[3 * q + c]
            out[3 * r + c] = total


@njit(cache=True, error_model="numpy")
def far_from(kind, sizes, pose, centre, reach, work):
    """Return whether a ball of radius ``reach`` about a global point is apart from a solid, or the box about a mesh."""
    local, grad, hess = work[0:3], work[3:6], work[6:15]
    local_point(pose, centre, local)
    return distance(BOX if kind == MESH else kind, sizes, local, grad, hess) > reach


@njit(cache=True, error_model="numpy")
def points_of(ints, reals, at, frames, rows, derivatives, labelled, work):
    """Write the points at which one pair touches; return how many rows may hold one.

    Parameters
    ----------
    ints, reals : ndarray
        Tables of the element.
    at : int
        Where the pair stands in ``ints``.
    frames : ndarray, shape (2, 18)
    rows : ndarray, shape (points, COLUMNS)
        Out.
    derivatives : bool
    labelled : bool
        Whether to tell patches of faceted solids apart; else only points that bear a load are written.
    work : ndarray
    """
    family, first = ints[at], ints[at + 1]
    second = 1 - first
    a, b = at + 2, at + 2 + SOLID
    pose_a, pose_b = vector_at(work, 0, 12), vector_at(work, 12, 12)
    solid_a, solid_b = vector_at(reals, ints[a + 1], SOLID_REALS), vector_at(reals, ints[b + 1], SOLID_REALS)
    pose_of(frames[first], solid_a, pose_a)
    pose_of(frames[second], solid_b, pose_b)
    origins = matrix_at(work, POSES, 2, 3)
    for q in range(3):
        origins[0, q] = frames[0, FRAME_P + q]
        origins[1, q] = frames[1, FRAME_P + q]
    scratch = vector_at(work, GEOMETRY, SCRATCH)
    sizes_a, sizes_b = solid_a[12:16], solid_b[12:16]
    if family == BOXES and ints[b] == HALF_SPACE:
        return box_on_plane(rows, pose_a, sizes_a, pose_b, first, origins, derivatives, scratch)
    if family == BOXES:
        return two_boxes(rows, pose_a, sizes_a, pose_b, sizes_b, origins, derivatives, scratch)
    if family == FACETS:
        if far_from(ints[b], sizes_b, pose_b, pose_a[9:12], sizes_a[3], scratch):
            return 0
        if far_from(ints[a], sizes_a, pose_a, pose_b[9:12], sizes_b[3], scratch):
            return 0
        of_a, of_b = faceted(ints, reals, a, sizes_a, pose_a), faceted(ints, reals, b, sizes_b, pose_b)
        bearing = 0.0 if labelled else BEARING
        middle = vertices_below(rows, 0, 0, 0, of_a, of_b, bearing, scratch)
        vertices = vertices_below(rows, middle, ints[a + 2], 1, of_b, of_a, bearing, scratch)
        edges_a = vector_at(ints, ints[a + 7], EDGE * ints[a + 6])
        edges_b = vector_at(ints, ints[b + 7], EDGE * ints[b + 6])
        own = edges_below(rows, vertices, 0, edges_a, of_a, of_b, bearing, scratch)
        count = edges_below(rows, own, 1, edges_b, of_b, of_a, bearing, scratch)
        if labelled:
            label_patches(rows, 0, middle, 0, of_a[5])
            label_patches(rows, middle, vertices, ints[a + 2], of_b[5])
            label_edges(rows, 0, middle, vertices, own, 0, edges_a)
            label_edges(rows, middle, vertices, own, count, ints[a + 2], edges_b)
            join_patches(rows, count)
        else:
            count = without_idle(rows, count)
        if derivatives:
            moved_with(rows, count, pose_a, pose_b, origins, scratch)
        return count
    row = rows[0]
    row[pt.WEIGHT], row[pt.POOL], row[pt.SWAPPED] = 1.0, 0.0, first
    if family == BALL_SOLID:
        ball_and_solid(
            row, pose_a, sizes_a[0], ints[b], sizes_b, pose_b, origins[first], origins[second], derivatives, scratch
        )
    elif family == CONVEX:
        convex_pair(
            row,
            ints[a],
            sizes_a,
            pose_a,
            ints[b],
            sizes_b,
            pose_b,
            origins[first],
            origins[second],
            derivatives,
            scratch,
        )
    else:
        convex_and_plane(row, ints[a], sizes_a, pose_a, pose_b, origins[first], origins[second], derivatives, scratch)
    return 1 if row[pt.DEPTH] > 0.0 else 0


@njit(cache=True, error_model="numpy", forceinline=True)
def faceted(ints, reals, at, sizes, pose):
    """Return a solid's tables: kind, sizes, pose, vertices, weights, triangles, boxes of vertices, triangles, boxes."""
    vertices, triangles = ints[at + 2], ints[at + 4]
    blocks, boxes = (vertices + BLOCK - 1) // BLOCK, (triangles + BLOCK - 1) // BLOCK
    weights = ints[at + 3] + 3 * vertices
    of_vertices = weights + vertices
    of_triangles = of_vertices + 6 * blocks
    of_boxes = of_triangles + 6 * boxes
    return (
        ints[at], sizes, pose, vector_at(reals, ints[at + 3], 3 * vertices), vector_at(reals, weights, vertices),
        vector_at(ints, ints[at + 5], 3 * triangles), vector_at(reals, of_vertices, 6 * blocks),
        vector_at(reals, of_triangles, 6 * boxes), vector_at(reals, of_boxes, 6 * ((boxes + BLOCK - 1) // BLOCK)),
    )  # fmt: skip


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def contact_of_solids(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the wrench of all pairs on I's body; see `gearmbs.dae.equations.loads.forces`.

    Diagnostics: energy stored, powers lost by damping and friction, patches, largest depth, sum of normal forces.
    """
    law = vector_at(reals, 0, LAW_REALS)
    derivatives, told = (want & DERIVATIVES) != 0, (want & DIAGNOSTICS) != 0
    rows = matrix_at(work, ROWS, (work.size - ROWS) // pt.COLUMNS, pt.COLUMNS)
    for pair in range(ints[0]):
        count = points_of(ints, reals, 1 + PAIR * pair, frames, rows, derivatives, told, work)
        share_out(rows, count, derivatives)
        if told:
            diagnostics[3] += patches_in(rows, count)
        for k in range(count):
            press(rows[k], law, frames, wrench, diagnostics, jac, derivatives, vector_at(work, GEOMETRY, 36))
