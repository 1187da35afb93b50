"""Signed distances from solids, with gradient and Hessian: negative inside.

Of a solid of revolution, with s the distance from z, e_r the radial and e_f the circumferential direction, a distance
in the plane (s, z) with the gradient (g_s, g_z) and the curvature k along t = -g_z e_r + g_s e_z is one in space with

    grad = g_s e_r + g_z e_z,    Hessian = k t t^T + (g_s / s) e_f e_f^T.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.mechanism.contacts.meshes import dot

BALL, BOX, FRUSTUM, TORUS, ELLIPSOID, HALF_SPACE, MESH = 0, 1, 2, 3, 4, 5, 6
"""Kinds of shapes. A cylinder is a frustum with equal radii."""

TINY = 1e-300
"""In place of zero in a divisor, near the smallest normal double: at a centre or on an axis, where a direction is
arbitrary."""
ITERATIONS = 100
"""Bisections for the point of an ellipsoid next to another: down to the last digit."""


@njit(cache=True, error_model="numpy")
def revolved(x, g_s, g_z, curvature, grad, hess):
    """Write gradient and Hessian of a solid of revolution from those in its plane (s, z)."""
    s = np.sqrt(x[0] * x[0] + x[1] * x[1])
    cosine, sine = (x[0] / s, x[1] / s) if s > 0.0 else (1.0, 0.0)
    grad[0], grad[1], grad[2] = g_s * cosine, g_s * sine, g_z
    around = g_s / s if s > 0.0 else 0.0
    t0, t1, t2 = -g_z * cosine, -g_z * sine, g_s
    hess[0] = curvature * t0 * t0 + around * sine * sine
    hess[4] = curvature * t1 * t1 + around * cosine * cosine
    hess[8] = curvature * t2 * t2
    hess[1] = hess[3] = curvature * t0 * t1 - around * sine * cosine
    hess[2] = hess[6] = curvature * t0 * t2
    hess[5] = hess[7] = curvature * t1 * t2


@njit(cache=True, error_model="numpy")
def ball(x, radius, grad, hess):
    """Return the distance from a ball about the origin."""
    r = np.sqrt(dot(x, x))
    inverse = 1.0 / r if r > 0.0 else 0.0
    for q in range(3):
        grad[q] = x[q] * inverse if r > 0.0 else (1.0 if q == 2 else 0.0)
    for q in range(3):
        for p in range(3):
            hess[3 * q + p] = ((1.0 if q == p else 0.0) - grad[q] * grad[p]) * inverse
    return r - radius


@njit(cache=True, error_model="numpy")
def box(x, half, grad, hess):
    """Return the distance from a box with half lengths ``half`` about the origin."""
    far, axis, outside = -np.inf, 0, 0.0
    for q in range(3):
        beyond = abs(x[q]) - half[q]
        if beyond > far:
            far, axis = beyond, q
        outside += max(beyond, 0.0) ** 2
    for q in range(9):
        hess[q] = 0.0
    grad[0] = grad[1] = grad[2] = 0.0
    if far <= 0.0:
        grad[axis] = 1.0 if x[axis] >= 0.0 else -1.0
        return far
    phi = np.sqrt(outside)
    for q in range(3):
        beyond = max(abs(x[q]) - half[q], 0.0)
        grad[q] = (beyond if x[q] >= 0.0 else -beyond) / phi
    for q in range(3):
        for p in range(3):
            if abs(x[q]) > half[q] and abs(x[p]) > half[p]:
                hess[3 * q + p] = ((1.0 if q == p else 0.0) - grad[q] * grad[p]) / phi
    return phi


@njit(cache=True, error_model="numpy")
def frustum(x, bottom, top, half, grad, hess):
    """Return the distance from a frustum about z with radii ``bottom`` at z = -half and ``top`` at z = half."""
    s, z = np.sqrt(x[0] * x[0] + x[1] * x[1]), x[2]
    slope = top - bottom
    side = np.sqrt(4.0 * half * half + slope * slope)
    n_s, n_z = 2.0 * half / side, -slope / side
    flank = (s - bottom) * n_s + (z + half) * n_z
    if flank <= 0.0 and abs(z) <= half:
        if flank >= abs(z) - half:
            revolved(x, n_s, n_z, 0.0, grad, hess)
            return flank
        revolved(x, 0.0, 1.0 if z >= 0.0 else -1.0, 0.0, grad, hess)
        return abs(z) - half
    # the nearest point of the flank, then of both ends
    along = min(max(((s - bottom) * slope + (z + half) * 2.0 * half) / side, 0.0), side)
    p_s, p_z = bottom + slope * along / side, -half + 2.0 * half * along / side
    corner = along == 0.0 or along == side
    best = (s - p_s) ** 2 + (z - p_z) ** 2
    for end in range(2):
        edge = bottom if end == 0 else top
        level = -half if end == 0 else half
        inside = min(s, edge)
        square = (s - inside) ** 2 + (z - level) ** 2
        if square < best:
            best, p_s, p_z, corner = square, inside, level, s >= edge
    phi = np.sqrt(best)
    if phi < TINY:
        revolved(x, n_s, n_z, 0.0, grad, hess)
        return 0.0
    revolved(x, (s - p_s) / phi, (z - p_z) / phi, 1.0 / phi if corner else 0.0, grad, hess)
    return phi


@njit(cache=True, error_model="numpy")
def torus(x, radius, tube, grad, hess):
    """Return the distance from a torus about z."""
    s = np.sqrt(x[0] * x[0] + x[1] * x[1])
    r = max(np.sqrt((s - radius) ** 2 + x[2] ** 2), TINY)
    revolved(x, (s - radius) / r, x[2] / r, 1.0 / r, grad, hess)
    return r - tube


@njit(cache=True, error_model="numpy")
def ellipsoid(x, axes, grad, hess):
    """Return the distance from an ellipsoid with semi-axes ``axes``.

    The nearest point is y = a^2 x / (a^2 + t) with the largest t for which it lies on the surface; its normal's shape
    operator S gives the Hessian S (1 + phi S)^-1.
    """
    least = min(axes[0], min(axes[1], axes[2])) ** 2
    low, reach = -least, 0.0
    for q in range(3):
        reach = max(reach, axes[q] * abs(x[q]))
    high = 2.0 * reach + least
    for _ in range(ITERATIONS):
        t = 0.5 * (low + high)
        total = 0.0
        for q in range(3):
            total += (axes[q] * x[q] / (axes[q] ** 2 + t)) ** 2
        if total > 1.0:
            low = t
        else:
            high = t
    t = 0.5 * (low + high)
    size = 0.0
    for q in range(3):
        grad[q] = x[q] / max(axes[q] ** 2 + t, TINY)
        size += grad[q] ** 2
    size = np.sqrt(size)
    if size == 0.0:
        # the centre of a ball
        grad[2] = size = 1.0
    for q in range(3):
        grad[q] /= size
    phi = 0.0
    for q in range(3):
        phi += grad[q] * (x[q] - axes[q] ** 2 * x[q] / max(axes[q] ** 2 + t, TINY))
    # S = P diag(1/a^2) P / |diag(1/a^2) y|, in a basis of the tangent plane
    scale = 1.0 / size
    k = 0 if abs(grad[0]) < 0.7 else 1
    t1 = (grad[0] * -grad[k], grad[1] * -grad[k], grad[2] * -grad[k])
    u = np.empty(3)
    w = np.empty(3)
    for q in range(3):
        u[q] = t1[q] + (1.0 if q == k else 0.0)
    length = np.sqrt(dot(u, u))
    for q in range(3):
        u[q] /= length
    for q in range(3):
        q1, q2 = (q + 1) % 3, (q + 2) % 3
        w[q] = grad[q1] * u[q2] - grad[q2] * u[q1]
    a = b = c = 0.0
    for q in range(3):
        a += scale * u[q] ** 2 / axes[q] ** 2
        b += scale * u[q] * w[q] / axes[q] ** 2
        c += scale * w[q] ** 2 / axes[q] ** 2
    # (1 + phi S)^-1 S of two by two
    m00, m01, m11 = 1.0 + phi * a, phi * b, 1.0 + phi * c
    det = m00 * m11 - m01 * m01
    h00, h01, h11 = (m11 * a - m01 * b) / det, (m11 * b - m01 * c) / det, (m00 * c - m01 * b) / det
    for q in range(3):
        for p in range(3):
            hess[3 * q + p] = u[q] * (h00 * u[p] + h01 * w[p]) + w[q] * (h01 * u[p] + h11 * w[p])
    return phi


@njit(cache=True, error_model="numpy")
def distance(kind, sizes, x, grad, hess):
    """Return the signed distance of x from an analytic solid, in its frame; write gradient and Hessian (9)."""
    if kind == BALL:
        return ball(x, sizes[0], grad, hess)
    if kind == BOX:
        return box(x, sizes, grad, hess)
    if kind == FRUSTUM:
        return frustum(x, sizes[0], sizes[1], sizes[2], grad, hess)
    if kind == TORUS:
        return torus(x, sizes[0], sizes[1], grad, hess)
    if kind == ELLIPSOID:
        return ellipsoid(x, sizes, grad, hess)
    for q in range(9):
        hess[q] = 0.0
    grad[0] = grad[1] = 0.0
    grad[2] = 1.0
    return x[2]
