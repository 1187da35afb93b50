"""Pendulum, slider crank, car axis and heavy top: terms of their Lagrange equations.

References
----------
.. [1] F. Mazzia, C. Magherini, "Test Set for Initial Value Problem Solvers", release 2.4, University of Bari (2008):
       car axis.
.. [2] R. Serban, SUNDIALS documentation, example of a slider crank in stabilised index-2 form for IDA.
.. [3] O. Bruels, A. Cardona, "On the use of Lie group time integrators in multibody dynamics",
       J. Comput. Nonlinear Dyn. 5 (2010) 031002: heavy top.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.problems.lagrange import TERMS_SIG, LagrangeSystem

GRAVITY = 9.81


@njit(TERMS_SIG, cache=True, nogil=True, error_model="numpy")
def pendulum_terms(t, y, yp, want, p, b):
    """Point mass 1 kg on a rod of 1 m; q = (x, y), g = (x^2 + y^2 - 1)/2. p = (gravity,)."""
    # blocks: mass 0, force 4, g 6, jac 7, g_t 9, inertia_q 10, force_q 14, force_v 18, hess 22, jac_t 26
    b[0] = b[3] = 1.0
    b[5] = -p[0]
    b[6] = 0.5 * (y[0] * y[0] + y[1] * y[1] - 1.0)
    b[7] = y[0]
    b[8] = y[1]
    if want:
        b[22] = b[25] = 1.0


@njit(TERMS_SIG, cache=True, nogil=True, error_model="numpy")
def slider_crank_terms(t, y, yp, want, p, b):
    """Crank angle q, slider x, rod angle r; spring-damper between the midpoints, force on the slider.

    p = (a half the crank, J1, m2, J2, k, c, l0, F). g1 = x - cos r - a cos q, g2 = -sin r - a sin q.
    """
    a, k, c, l0, load = p[0], p[4], p[5], p[6], p[7]
    q, x, r = y[0], y[1], y[2]
    w = (y[3], y[4], y[5])
    sq, cq, sr, cr = np.sin(q), np.cos(q), np.sin(r), np.cos(r)
    srq, crq = np.sin(r - q), np.cos(r - q)
    # squared length of the spring, its gradient and Hessian
    square = x * x - x * (cr + a * cq) + 0.25 * (1.0 + a * a) + 0.5 * a * crq
    grad = (a * x * sq + 0.5 * a * srq, 2.0 * x - cr - a * cq, x * sr - 0.5 * a * srq)
    length = np.sqrt(square)
    rate = (grad[0] * w[0] + grad[1] * w[1] + grad[2] * w[2]) / (2.0 * length)
    f = (k * (length - l0) + c * rate) / (2.0 * length)
    # blocks: mass 0, force 9, g 12, jac 14, g_t 20, inertia_q 22, force_q 31, force_v 40, hess 49, jac_t 67
    b[0], b[4], b[8] = p[1], p[2], p[3]
    b[9] = -f * grad[0]
    b[10] = -f * grad[1] + load
    b[11] = -f * grad[2] - load * sr
    b[12] = x - cr - a * cq
    b[13] = -sr - a * sq
    b[14], b[15], b[16] = a * sq, 1.0, sr
    b[17], b[19] = -a * cq, -cr
    if want:
        hqq = a * x * cq - 0.5 * a * crq
        hqx = a * sq
        hqr = 0.5 * a * crq
        hxr = sr
        hrr = x * cr - 0.5 * a * crq
        hess = ((hqq, hqx, hqr), (hqx, 2.0, hxr), (hqr, hxr, hrr))
        for j in range(3):
            length_j = grad[j] / (2.0 * length)
            turned = hess[j][0] * w[0] + hess[j][1] * w[1] + hess[j][2] * w[2]
            rate_j = turned / (2.0 * length) - rate / length * length_j
            f_j = (k * length_j + c * rate_j) / (2.0 * length) - f / length * length_j
            f_w = c * length_j / (2.0 * length)
            for i in range(3):
                b[31 + 3 * i + j] = -f_j * grad[i] - f * hess[i][j]
                b[40 + 3 * i + j] = -f_w * grad[i]
        b[31 + 8] -= load * cr
        b[49 + 0], b[49 + 8] = a * cq, cr
        b[58 + 0], b[58 + 8] = a * sq, sr


@njit(TERMS_SIG, cache=True, nogil=True, error_model="numpy")
def car_axis_terms(t, y, yp, want, p, b):
    """Two masses on springs over a moving base; q = (xl, yl, xr, yr). p = (eps, M, L, L0, r, omega, g)."""
    mass = 0.5 * p[1] * p[0] * p[0]
    length, free, r, omega = p[2], p[3], p[4], p[5]
    yb = r * np.sin(omega * t)
    yb_t = r * omega * np.cos(omega * t)
    xb = np.sqrt(length * length - yb * yb)
    xb_t = -yb * yb_t / xb
    # blocks: mass 0, force 16, g 20, jac 22, g_t 30, inertia_q 32, force_q 48, force_v 64, hess 80, jac_t 112
    for side in range(2):
        i = 2 * side
        dx = y[i] - side * xb
        dy = y[i + 1] - side * yb
        spring = np.sqrt(dx * dx + dy * dy)
        b[5 * i], b[5 * (i + 1)] = mass, mass
        b[16 + i] = (free - spring) * dx / spring
        b[17 + i] = (free - spring) * dy / spring - mass * p[6]
        if want:
            cube = free / (spring * spring * spring)
            b[48 + 5 * i] = cube * dy * dy - 1.0
            b[48 + 5 * i + 1] = -cube * dx * dy
            b[52 + 5 * i] = -cube * dx * dy
            b[52 + 5 * i + 1] = cube * dx * dx - 1.0
    ex = y[0] - y[2]
    ey = y[1] - y[3]
    b[20] = -(xb * y[0] + yb * y[1])
    b[21] = -(ex * ex + ey * ey - length * length)
    b[22], b[23] = -xb, -yb
    b[26], b[27], b[28], b[29] = -2.0 * ex, -2.0 * ey, 2.0 * ex, 2.0 * ey
    b[30] = -(xb_t * y[0] + yb_t * y[1])
    if want:
        for i in range(4):
            b[96 + 5 * i] = -2.0
        for i in range(2):
            b[96 + 4 * i + i + 2] = 2.0
            b[96 + 4 * (i + 2) + i] = 2.0
        b[112], b[113] = -xb_t, -yb_t


@njit(TERMS_SIG, cache=True, nogil=True, error_model="numpy")
def heavy_top_terms(t, y, yp, want, p, b):
    """Top on a fixed point in natural coordinates q = (r, d1, d2, d3): the centre and the body's axes in space.

    p = (m, E1, E2, E3, g): E are the second moments of mass along the axes. Constraints: the six products of the
    axes and r - d2 = 0, the centre one metre along the second axis.
    """
    # blocks: mass 0, force 144, g 156, jac 165, g_t 273, inertia_q 282, force_q 426, force_v 570, hess 714, jac_t 2010
    for i in range(12):
        b[13 * i] = p[i // 3]
    b[146] = -p[0] * p[4]
    k = 0
    for m in range(3):
        for l in range(m, 3):
            dot = 0.0
            for c in range(3):
                dm = y[3 + 3 * m + c]
                dl = y[3 + 3 * l + c]
                dot += dm * dl
                if l == m:
                    b[165 + 12 * k + 3 + 3 * m + c] = dm
                else:
                    b[165 + 12 * k + 3 + 3 * m + c] = dl
                    b[165 + 12 * k + 3 + 3 * l + c] = dm
                if want:
                    b[714 + 144 * k + 12 * (3 + 3 * m + c) + 3 + 3 * l + c] = 1.0
                    b[714 + 144 * k + 12 * (3 + 3 * l + c) + 3 + 3 * m + c] = 1.0
            b[156 + k] = 0.5 * (dot - 1.0) if l == m else dot
            k += 1
    for c in range(3):
        b[156 + 6 + c] = y[c] - y[6 + c]
        b[165 + 12 * (6 + c) + c] = 1.0
        b[165 + 12 * (6 + c) + 6 + c] = -1.0


def pendulum() -> LagrangeSystem:
    """Return the pendulum released at the height of its pivot."""
    return LagrangeSystem(
        pendulum_terms, 2, 1, np.array([GRAVITY]), np.array([1.0, 0.0]), np.zeros(2),
        np.ones(2), np.full(2, np.sqrt(2.0 * GRAVITY)), 3.0 * GRAVITY,
    )  # fmt: skip


def slider_crank() -> LagrangeSystem:
    """Return the slider crank with a = 1/2, J1 = m2 = k = c = l0 = F = 1, J2 = 2, at rest with the crank upright."""
    r = np.arcsin(-0.5)
    return LagrangeSystem(
        slider_crank_terms, 3, 2, np.array([0.5, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0]),
        np.array([0.5 * np.pi, np.cos(r), r]), np.zeros(3), np.ones(3), np.ones(3), 1.0,
    )  # fmt: skip


def car_axis() -> LagrangeSystem:
    """Return the car axis with the test set's parameters."""
    return LagrangeSystem(
        car_axis_terms, 4, 2, np.array([0.01, 10.0, 1.0, 0.5, 0.1, 10.0, 1.0]),
        np.array([0.0, 0.5, 1.0, 0.5]), np.array([-0.5, 0.0, -0.5, 0.0]), np.ones(4), np.ones(4), 1e-3,
    )  # fmt: skip


def heavy_top() -> LagrangeSystem:
    """Return the heavy top: 15 kg, J = (0.234375, 0.46875, 0.234375), Omega = (0, 150, -4.61538) in body axes."""
    inertia = np.array([0.234375, 0.46875, 0.234375])
    moments = 0.5 * inertia.sum() - inertia
    omega = np.array([0.0, 150.0, -4.61538])
    axes = np.eye(3)
    rates = np.cross(omega, axes)
    spin = np.linalg.norm(omega)
    return LagrangeSystem(
        heavy_top_terms, 12, 9, np.array([15.0, *moments, GRAVITY]),
        np.concatenate((axes[1], axes.ravel())), np.concatenate((rates[1], rates.ravel())), np.ones(12),
        np.full(12, spin), 1e4,
    )  # fmt: skip
