"""Points at which two solids touch, as rows of a table, and how such a point moves with its bodies.

Of a point on the surface of body a that lies below the surface of body b there is kept where it is, the normal n from
b to a, the depth, and the derivatives of the three by [dP_a, dpi_a, dP_b, dpi_b]. A material point x of a body about
the origin P moves by dP + dpi x (x - P).
"""

from __future__ import annotations

from gearmbs._jit import njit

PLACE = 0
NORMAL = 3
DEPTH = 6
WEIGHT = 7
"""In the level of the pair: those of a plane face, or around the overlap of two boxes, sum to 1."""
POOL = 8
"""Number of the patch to which the point belongs; negative: not in contact."""
SWAPPED = 9
"""0: body a is that of marker I; 1: that of marker J."""
D_PLACE = 10
"""Derivatives, rows of 12 columns."""
D_NORMAL = D_PLACE + 36
D_DEPTH = D_NORMAL + 36
SHARE = D_DEPTH + 12
LEVEL = SHARE + 1
"""Depth at which the law of the load is taken, m."""
D_SHARE = LEVEL + 1
"""Derivatives of the share, then of the level, by the variations of bodies I and J, whichever is a."""
D_LEVEL = D_SHARE + 12
VERTEX = D_LEVEL + 12
"""Of a vertex: its number, where it is, and the Hessian (9) of its distance in the frame of the other solid."""
VERTEX_PLACE = VERTEX + 1
HESSIAN = VERTEX_PLACE + 3
GAIN = HESSIAN + 9
"""Length of the gradient of the depth, by which the point bears less than its share where edges cross; else 1."""
D_GAIN = GAIN + 1
ALONG = D_GAIN + 12
"""Of the deepest point of an edge: the edge, zero of other points, and by what the gradient changes along it, in the
other solid's frame; then the plane faces that meet at the edge."""
BENT = ALONG + 3
FACES = BENT + 3
COLUMNS = FACES + 2


@njit(cache=True, error_model="numpy", forceinline=True)
def moved(column, x, origin, out):
    """Write the derivative of a material point x by variation ``column`` (0 to 5) of its body."""
    out[0] = out[1] = out[2] = 0.0
    if column < 3:
        out[column] = 1.0
        return
    k = column - 3
    k1, k2 = (k + 1) % 3, (k + 2) % 3
    out[k1] = -(x[k2] - origin[k2])
    out[k2] = x[k1] - origin[k1]


@njit(cache=True, error_model="numpy", forceinline=True)
def relative(column, x, origin_a, origin_b, out):
    """Write by how much a point x of body a moves against that of body b, for one of the twelve variations."""
    if column < 6:
        moved(column, x, origin_a, out)
        return
    moved(column - 6, x, origin_b, out)
    for q in range(3):
        out[q] = -out[q]


@njit(cache=True, error_model="numpy", forceinline=True)
def turned(k, v, out):
    """Write e_k x v, the derivative of a body's direction v by dpi_k."""
    k1, k2 = (k + 1) % 3, (k + 2) % 3
    out[k] = 0.0
    out[k1] = -v[k2]
    out[k2] = v[k1]


@njit(cache=True, error_model="numpy", forceinline=True)
def dot(a, b):
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def to_global(pose, v, out):
    """Write the global components of a direction of a shape's frame; ``pose`` is axes (9), origin (3)."""
    for q in range(3):
        out[q] = pose[3 * q] * v[0] + pose[3 * q + 1] * v[1] + pose[3 * q + 2] * v[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def to_local(pose, v, out):
    """Write a global direction's components in a shape's frame."""
    for q in range(3):
        out[q] = pose[q] * v[0] + pose[3 + q] * v[1] + pose[6 + q] * v[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def local_point(pose, x, out):
    """Write a global point's coordinates in a shape's frame."""
    d0, d1, d2 = x[0] - pose[9], x[1] - pose[10], x[2] - pose[11]
    for q in range(3):
        out[q] = pose[q] * d0 + pose[3 + q] * d1 + pose[6 + q] * d2
