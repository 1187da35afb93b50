"""Andrews' squeezing mechanism: seven bodies, seven angles, three closed loops.

References
----------
.. [1] F. Mazzia, C. Magherini, "Test Set for Initial Value Problem Solvers", release 2.4, University of Bari (2008).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.problems.lagrange import TERMS_SIG, LagrangeSystem

M1, M2, M3, M4, M5, M6, M7 = 0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498
I1, I2, I3, I4, I5, I6, I7 = 2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5
XA, YA, XB, YB, XC, YC = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072
D, DA, E, EA, RR, RA, L0 = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092, 0.07785
SS, SA, SB, SC, SD = 0.035, 0.01874, 0.01043, 0.018, 0.02
TA, TB, U, UA, UB, ZF, ZT, FA = 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421
C0, TORQUE = 4530.0, 0.033

BETA, THETA, GAMMA, PHI, DELTA, OMEGA, EPSILON = range(7)

# arms of the moving masses on the rods E4 and F6
E4 = E - EA
F6 = ZF - FA

# offsets of the blocks for 7 coordinates and 6 constraints
FORCE, G, JAC = 49, 56, 62
INERTIA_Q, FORCE_Q, FORCE_V, HESS = 110, 159, 208, 257


@njit("void(float64[::1], int64, int64, float64)", cache=True, nogil=True, error_model="numpy")
def _put_symmetric(b, i, j, value):
    b[7 * i + j] = value
    b[7 * j + i] = value


@njit("void(float64[::1], int64, int64, int64, float64)", cache=True, nogil=True, error_model="numpy")
def _put_hess(b, k, i, j, value):
    b[HESS + 49 * k + 7 * i + j] = value
    b[HESS + 49 * k + 7 * j + i] = value


@njit("void(float64[::1], float64[::1], float64[::1])", cache=True, nogil=True, error_model="numpy")
def _derivatives(y, yp, b):
    """Write d(M v')/dq and the derivatives of the gyroscopic forces, all through Theta, Phi and Omega."""
    st, ct = np.sin(y[THETA]), np.cos(y[THETA])
    sp, cp = np.sin(y[PHI]), np.cos(y[PHI])
    so, co = np.sin(y[OMEGA]), np.cos(y[OMEGA])
    v, a = y[7:], yp[7:]
    k_theta = M2 * DA * RR
    k_phi = M4 * ZT * E4
    k_omega = M6 * U * F6
    b[INERTIA_Q + 7 * BETA + THETA] = k_theta * st * (2.0 * a[BETA] + a[THETA])
    b[INERTIA_Q + 7 * THETA + THETA] = k_theta * st * a[BETA]
    b[INERTIA_Q + 7 * PHI + PHI] = k_phi * cp * a[DELTA]
    b[INERTIA_Q + 7 * DELTA + PHI] = k_phi * cp * (2.0 * a[DELTA] + a[PHI])
    b[INERTIA_Q + 7 * OMEGA + OMEGA] = -k_omega * co * a[EPSILON]
    b[INERTIA_Q + 7 * EPSILON + OMEGA] = -k_omega * co * (2.0 * a[EPSILON] + a[OMEGA])

    b[FORCE_Q + 7 * BETA + THETA] = -k_theta * v[THETA] * (v[THETA] + 2.0 * v[BETA]) * ct
    b[FORCE_Q + 7 * THETA + THETA] = k_theta * v[BETA] ** 2 * ct
    b[FORCE_Q + 7 * PHI + PHI] = -k_phi * v[DELTA] ** 2 * sp
    b[FORCE_Q + 7 * DELTA + PHI] = k_phi * v[PHI] * (v[PHI] + 2.0 * v[DELTA]) * sp
    b[FORCE_Q + 7 * OMEGA + OMEGA] = k_omega * v[EPSILON] ** 2 * so
    b[FORCE_Q + 7 * EPSILON + OMEGA] = -k_omega * v[OMEGA] * (v[OMEGA] + 2.0 * v[EPSILON]) * so

    b[FORCE_V + 7 * BETA + BETA] = -2.0 * k_theta * v[THETA] * st
    b[FORCE_V + 7 * BETA + THETA] = -2.0 * k_theta * (v[THETA] + v[BETA]) * st
    b[FORCE_V + 7 * THETA + BETA] = 2.0 * k_theta * v[BETA] * st
    b[FORCE_V + 7 * PHI + DELTA] = 2.0 * k_phi * v[DELTA] * cp
    b[FORCE_V + 7 * DELTA + PHI] = -2.0 * k_phi * (v[PHI] + v[DELTA]) * cp
    b[FORCE_V + 7 * DELTA + DELTA] = -2.0 * k_phi * v[PHI] * cp
    b[FORCE_V + 7 * OMEGA + EPSILON] = -2.0 * k_omega * v[EPSILON] * co
    b[FORCE_V + 7 * EPSILON + OMEGA] = 2.0 * k_omega * (v[OMEGA] + v[EPSILON]) * co
    b[FORCE_V + 7 * EPSILON + EPSILON] = 2.0 * k_omega * v[OMEGA] * co


@njit(TERMS_SIG, cache=True, nogil=True, error_model="numpy")
def andrews_terms(t, y, yp, want, p, b):
    """Terms of the squeezer; q = (beta, Theta, gamma, Phi, delta, Omega, epsilon). No parameters."""
    sb, cb = np.sin(y[BETA]), np.cos(y[BETA])
    st, ct = np.sin(y[THETA]), np.cos(y[THETA])
    sg, cg = np.sin(y[GAMMA]), np.cos(y[GAMMA])
    sp, cp = np.sin(y[PHI]), np.cos(y[PHI])
    sd, cd = np.sin(y[DELTA]), np.cos(y[DELTA])
    so, co = np.sin(y[OMEGA]), np.cos(y[OMEGA])
    se, ce = np.sin(y[EPSILON]), np.cos(y[EPSILON])
    sbt, cbt = np.sin(y[BETA] + y[THETA]), np.cos(y[BETA] + y[THETA])
    spd, cpd = np.sin(y[PHI] + y[DELTA]), np.cos(y[PHI] + y[DELTA])
    soe, coe = np.sin(y[OMEGA] + y[EPSILON]), np.cos(y[OMEGA] + y[EPSILON])
    v_beta, v_theta = y[7 + BETA], y[7 + THETA]
    v_phi, v_delta, v_omega, v_eps = y[7 + PHI], y[7 + DELTA], y[7 + OMEGA], y[7 + EPSILON]

    k_theta = M2 * DA * RR
    k_phi = M4 * ZT * E4
    k_omega = M6 * U * F6
    b[0] = M1 * RA**2 + M2 * (RR**2 + DA**2) - 2.0 * k_theta * ct + I1 + I2
    _put_symmetric(b, BETA, THETA, M2 * DA**2 - k_theta * ct + I2)
    b[8] = M2 * DA**2 + I2
    b[16] = M3 * (SA**2 + SB**2) + I3
    b[24] = M4 * E4**2 + I4
    _put_symmetric(b, PHI, DELTA, M4 * E4**2 + k_phi * sp + I4)
    b[32] = M4 * (ZT**2 + E4**2) + 2.0 * k_phi * sp + M5 * (TA**2 + TB**2) + I4 + I5
    b[40] = M6 * F6**2 + I6
    _put_symmetric(b, OMEGA, EPSILON, M6 * F6**2 - k_omega * so + I6)
    b[48] = M6 * (F6**2 + U**2) - 2.0 * k_omega * so + M7 * (UA**2 + UB**2) + I6 + I7

    # spring from C to the point D of the body with angle gamma
    dx = SD * cg + SC * sg + XB - XC
    dy = SD * sg - SC * cg + YB - YC
    dx_g = SC * cg - SD * sg
    dy_g = SD * cg + SC * sg
    length = np.sqrt(dx * dx + dy * dy)
    along = dx * dx_g + dy * dy_g
    b[FORCE + BETA] = TORQUE - k_theta * v_theta * (v_theta + 2.0 * v_beta) * st
    b[FORCE + THETA] = k_theta * v_beta**2 * st
    b[FORCE + GAMMA] = -C0 * (1.0 - L0 / length) * along
    b[FORCE + PHI] = k_phi * v_delta**2 * cp
    b[FORCE + DELTA] = -k_phi * v_phi * (v_phi + 2.0 * v_delta) * cp
    b[FORCE + OMEGA] = -k_omega * v_eps**2 * co
    b[FORCE + EPSILON] = k_omega * v_omega * (v_omega + 2.0 * v_eps) * co

    # each loop: tip of the rod on the disc minus the tip of its own chain
    for loop in range(3):
        r = 7 * 2 * loop
        x0 = XB if loop == 0 else XA
        y0 = YB if loop == 0 else YA
        b[G + 2 * loop] = RR * cb - D * cbt - x0
        b[G + 2 * loop + 1] = RR * sb - D * sbt - y0
        b[JAC + r + BETA] = -RR * sb + D * sbt
        b[JAC + r + THETA] = D * sbt
        b[JAC + r + 7 + BETA] = RR * cb - D * cbt
        b[JAC + r + 7 + THETA] = -D * cbt
    b[G + 0] -= SS * sg
    b[G + 1] += SS * cg
    b[JAC + GAMMA] = -SS * cg
    b[JAC + 7 + GAMMA] = -SS * sg
    b[G + 2] -= E * spd + ZT * cd
    b[G + 3] += E * cpd - ZT * sd
    b[JAC + 14 + PHI] = -E * cpd
    b[JAC + 14 + DELTA] = -E * cpd + ZT * sd
    b[JAC + 21 + PHI] = -E * spd
    b[JAC + 21 + DELTA] = -E * spd - ZT * cd
    b[G + 4] -= ZF * coe + U * se
    b[G + 5] += U * ce - ZF * soe
    b[JAC + 28 + OMEGA] = ZF * soe
    b[JAC + 28 + EPSILON] = ZF * soe - U * ce
    b[JAC + 35 + OMEGA] = -ZF * coe
    b[JAC + 35 + EPSILON] = -ZF * coe - U * se

    if want:
        _derivatives(y, yp, b)
        slope = dx_g * dx_g + dy_g * dy_g + dx * (-SD * cg - SC * sg) + dy * (SC * cg - SD * sg)
        b[FORCE_Q + 8 * GAMMA] = -C0 * ((1.0 - L0 / length) * slope + L0 * along * along / length**3)
        for loop in range(3):
            _put_hess(b, 2 * loop, BETA, BETA, -RR * cb + D * cbt)
            _put_hess(b, 2 * loop, BETA, THETA, D * cbt)
            _put_hess(b, 2 * loop, THETA, THETA, D * cbt)
            _put_hess(b, 2 * loop + 1, BETA, BETA, -RR * sb + D * sbt)
            _put_hess(b, 2 * loop + 1, BETA, THETA, D * sbt)
            _put_hess(b, 2 * loop + 1, THETA, THETA, D * sbt)
        _put_hess(b, 0, GAMMA, GAMMA, SS * sg)
        _put_hess(b, 1, GAMMA, GAMMA, -SS * cg)
        _put_hess(b, 2, PHI, PHI, E * spd)
        _put_hess(b, 2, PHI, DELTA, E * spd)
        _put_hess(b, 2, DELTA, DELTA, E * spd + ZT * cd)
        _put_hess(b, 3, PHI, PHI, -E * cpd)
        _put_hess(b, 3, PHI, DELTA, -E * cpd)
        _put_hess(b, 3, DELTA, DELTA, -E * cpd + ZT * sd)
        _put_hess(b, 4, OMEGA, OMEGA, ZF * coe)
        _put_hess(b, 4, OMEGA, EPSILON, ZF * coe)
        _put_hess(b, 4, EPSILON, EPSILON, ZF * coe + U * se)
        _put_hess(b, 5, OMEGA, OMEGA, ZF * soe)
        _put_hess(b, 5, OMEGA, EPSILON, ZF * soe)
        _put_hess(b, 5, EPSILON, EPSILON, ZF * soe - U * ce)


def andrews() -> LagrangeSystem:
    """Return the squeezer at rest in the test set's initial position."""
    q0 = np.array(
        [
            -0.0617138900142764496,
            0.0,
            0.455279819163070380256,
            0.222668390165885884675,
            0.487364979543842550226,
            -0.222668390165885884675,
            1.23054744454982119250,
        ]
    )
    rates = np.array([1e3, 1e3, 1e2, 1e2, 1e2, 1e2, 1e2])
    return LagrangeSystem(andrews_terms, 7, 6, np.zeros(1), q0, np.zeros(7), np.ones(7), rates, 100.0)
