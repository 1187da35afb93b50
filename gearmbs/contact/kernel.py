"""Contact of a gear pair: wrench on the wheels and its exact derivatives from poses and velocities."""

from __future__ import annotations

import numpy as np
from numba import njit, types

from gearmbs.contact import layout as L
from gearmbs.contact.flanks import side_contacts
from gearmbs.contact.pose import pose_columns, pose_rates, pose_wrench, relative_pose
from gearmbs.contact.sums import mirror

VEC = types.float64[::1]
MAT = types.float64[:, ::1]
GEAR_CONTACT_SIG = types.void(
    types.int64[::1], VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, types.int64, VEC
)
Q_, H_, B_, F_, FX_, FV_, FR_ = L.Q_, L.H_, L.B_, L.F_, L.FX_, L.FV_, L.FR_


@njit(cache=True)
def relative_twist(M, R1, v1, w1, R2, v2, w2, V):
    """Twist of wheel 1 relative to wheel 2 at R1, in the mean frame."""
    dx = R1[0] - R2[0]
    dy = R1[1] - R2[1]
    dz = R1[2] - R2[2]
    vx = v1[0] - v2[0] - (w2[1] * dz - w2[2] * dy)
    vy = v1[1] - v2[1] - (w2[2] * dx - w2[0] * dz)
    vz = v1[2] - v2[2] - (w2[0] * dy - w2[1] * dx)
    ox = w1[0] - w2[0]
    oy = w1[1] - w2[1]
    oz = w1[2] - w2[2]
    for k in range(3):
        V[k] = M[0, k] * vx + M[1, k] * vy + M[2, k] * vz
        V[3 + k] = M[0, k] * ox + M[1, k] * oy + M[2, k] * oz


@njit(cache=True)
def chain(x, xd_x, W_x, G, mu, w2m, V, W, sums, KX, KV, J):
    """Derivatives of the wrench on wheel 1 by its own variations, all in the mean frame: ``J`` (6, 12)."""
    # KX = dW/dx, KV = dW/dV with the wrench W = G^T Q + F
    for i in range(6):
        for j in range(6):
            hb = sums[H_ + 6 * i + j]
            fb = sums[FX_ + 6 * i + j]
            if j < 4:
                for k in range(6):
                    hb += sums[B_ + 6 * i + k] * xd_x[k, j]
                    fb += sums[FR_ + 6 * i + k] * xd_x[k, j]
            J[i, j] = hb
            KX[i, j] = fb + (W_x[i, j] if j < 4 else 0.0)
            bg = 0.0
            fg = sums[FV_ + 6 * i + j]
            for k in range(6):
                bg += sums[B_ + 6 * i + k] * G[k, j]
                fg += sums[FR_ + 6 * i + k] * G[k, j]
            J[i, 6 + j] = bg
            KV[i, j] = fg
    for i in range(6):
        for j in range(6):
            kx = KX[i, j]
            kv = KV[i, j]
            for k in range(6):
                kx += G[k, i] * J[k, j]
                kv += G[k, i] * J[k, 6 + j]
            KX[i, j] = kx
            KV[i, j] = kv
    for j in range(6):
        ux, uy, uz = mu[0, j], mu[1, j], mu[2, j]
        # the relative twist seen from the turning mean frame
        d0 = -(uy * V[2] - uz * V[1])
        d1 = -(uz * V[0] - ux * V[2])
        d2 = -(ux * V[1] - uy * V[0])
        d3 = -(uy * V[5] - uz * V[4])
        d4 = -(uz * V[3] - ux * V[5])
        d5 = -(ux * V[4] - uy * V[3])
        if j == 0:
            d1 -= w2m[2]
            d2 += w2m[1]
        elif j == 1:
            d0 += w2m[2]
            d2 -= w2m[0]
        elif j == 2:
            d0 -= w2m[1]
            d1 += w2m[0]
        for i in range(6):
            total = KV[i, 0] * d0 + KV[i, 1] * d1 + KV[i, 2] * d2 + KV[i, 3] * d3 + KV[i, 4] * d4 + KV[i, 5] * d5
            for k in range(6):
                total += KX[i, k] * G[k, j]
            J[i, j] = total
        for b in range(0, 6, 3):
            J[b, j] += uy * W[b + 2] - uz * W[b + 1]
            J[b + 1, j] += uz * W[b] - ux * W[b + 2]
            J[b + 2, j] += ux * W[b + 1] - uy * W[b]
    for i in range(6):
        for j in range(6):
            J[i, 6 + j] = KV[i, j]


@njit(cache=True)
def spread(M, J, R1, v1, w1, R2, v2, w2, wrench, jac):
    """Turn ``J`` into global components and complete the columns of wheel 2 from the invariance under motions."""
    for b in range(0, 6, 3):
        for c in range(0, 12, 3):
            for k in range(3):
                m0 = J[b, c] * M[k, 0] + J[b, c + 1] * M[k, 1] + J[b, c + 2] * M[k, 2]
                m1 = J[b + 1, c] * M[k, 0] + J[b + 1, c + 1] * M[k, 1] + J[b + 1, c + 2] * M[k, 2]
                m2 = J[b + 2, c] * M[k, 0] + J[b + 2, c + 1] * M[k, 1] + J[b + 2, c + 2] * M[k, 2]
                jac[b, c + k] = M[0, 0] * m0 + M[0, 1] * m1 + M[0, 2] * m2
                jac[b + 1, c + k] = M[1, 0] * m0 + M[1, 1] * m1 + M[1, 2] * m2
                jac[b + 2, c + k] = M[2, 0] * m0 + M[2, 1] * m1 + M[2, 2] * m2
    D = (R2[0] - R1[0], R2[1] - R1[1], R2[2] - R1[2])
    for i in range(6):
        for k in range(3):
            jac[i, 12 + k] = -jac[i, k]
            jac[i, 18 + k] = -jac[i, 6 + k]
        for k in range(3):
            k1 = (k + 1) % 3
            k2 = (k + 2) % 3
            jac[i, 21 + k] = -jac[i, 9 + k] - jac[i, 6 + k1] * D[k2] + jac[i, 6 + k2] * D[k1]
    for i in range(6):
        for k in range(3):
            k1 = (k + 1) % 3
            k2 = (k + 2) % 3
            total = -jac[i, 3 + k]
            total -= -jac[i, 12 + k1] * D[k2] + jac[i, 12 + k2] * D[k1]
            total -= -jac[i, 6 + k1] * v1[k2] + jac[i, 6 + k2] * v1[k1]
            total -= -jac[i, 9 + k1] * w1[k2] + jac[i, 9 + k2] * w1[k1]
            total -= -jac[i, 18 + k1] * v2[k2] + jac[i, 18 + k2] * v2[k1]
            total -= -jac[i, 21 + k1] * w2[k2] + jac[i, 21 + k2] * w2[k1]
            jac[i, 15 + k] = total
    for b in range(0, 6, 3):
        for k in range(3):
            k1 = (k + 1) % 3
            k2 = (k + 2) % 3
            jac[b + k1, 15 + k] -= wrench[b + k2]
            jac[b + k2, 15 + k] += wrench[b + k1]


@njit(GEAR_CONTACT_SIG, cache=True, nogil=True)
def gear_contact(gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, wrench, jac, diag, want_jac, work):
    """Wrench of the contact of two wheels, its derivatives and diagnostics.

    Parameters
    ----------
    gi, gr : ndarray
        Packed tables of the pair, from ``GearPair.contact_tables``.
    R1, R2, v1, v2, w1, w2 : ndarray, shape (3,)
        Positions and velocities of the wheels' origins (mid-face, on the axis) and their angular velocities; global.
    A1, A2 : ndarray, shape (3, 3)
        Orientations; columns are the wheel's axes: z its axis, x through the middle of tooth 0.
    wrench : ndarray, shape (6,)
        Out: force on wheel 1, N, and torque on wheel 1 about R1, N m; global components.
    jac : ndarray, shape (6, 24)
        Out, when ``want_jac`` is not 0: derivatives by the spatial variations ``[dR, dpi, dv, dw]`` of wheel 1,
        then of wheel 2.
    diag : ndarray, shape (8,)
        Out: elastic energy J, damping power W, friction power W, largest penetration m on drive and on back
        flanks, tooth pairs touching on drive and on back flanks, sum of normal forces N.
    work : ndarray
        Scratch of at least the length that ``contact_tables`` returned.

    Notes
    -----
    Memory-free: the result is a function of the arguments alone. No contact is found when the axes are more than
    120 degrees apart or the base circles overlap.
    """
    for i in range(6):
        wrench[i] = 0.0
    for i in range(8):
        diag[i] = 0.0
    if want_jac != 0:
        for i in range(6):
            for j in range(24):
                jac[i, j] = 0.0
    x = work[L.W_X : L.W_X + 6]
    M = work[L.W_FRAME : L.W_FRAME + 9].reshape((3, 3))
    if not relative_pose(R1, A1, R2, A2, x, M):
        return
    xd = work[L.W_XD : L.W_XD + 6]
    V = work[L.W_V : L.W_V + 6]
    xd_x = work[L.W_XDX : L.W_XDX + 24].reshape((6, 4))
    relative_twist(M, R1, v1, w1, R2, v2, w2, V)
    pose_rates(x, V, xd, xd_x)
    sums = work[L.W_SUMS : L.W_SUMS + L.SUMS]
    for i in range(L.SUMS):
        sums[i] = 0.0
    slices = gi[L.N_SLICES]
    sup = work[L.W_SUP : L.W_SUP + 30]
    limits = work[L.W_LIMIT : L.W_LIMIT + 172]
    nodes = work[L.W_NODES : L.W_NODES + 2 * L.NODE * (slices + 1)]
    sel = work[L.W_NODES + 2 * L.NODE * (slices + 1) : L.W_NODES + (2 * L.NODE + 1) * (slices + 1)]
    side_contacts(gi, gr, 1, x, xd, V, sums, diag, want_jac, nodes, sel, sup, limits)
    mx = work[L.W_MX : L.W_MX + 6]
    mxd = work[L.W_MXD : L.W_MXD + 6]
    mV = work[L.W_MV : L.W_MV + 6]
    for i in range(6):
        s = -1.0 if i > 2 else 1.0
        mx[i] = s * x[i]
        mxd[i] = s * xd[i]
        mV[i] = -V[i] if i % 2 == 1 else V[i]
    mirror(sums)
    side_contacts(gi, gr, -1, mx, mxd, mV, sums, diag, want_jac, nodes, sel, sup, limits)
    mirror(sums)
    if diag[7] == 0.0 and diag[0] == 0.0:
        return
    W = work[L.W_W : L.W_W + 6]
    W_x = work[L.W_WX : L.W_WX + 24].reshape((6, 4))
    pose_wrench(x, sums, W, W_x, want_jac)
    for i in range(6):
        W[i] += sums[F_ + i]
    for b in range(0, 6, 3):
        for k in range(3):
            wrench[b + k] = M[k, 0] * W[b] + M[k, 1] * W[b + 1] + M[k, 2] * W[b + 2]
    if want_jac == 0:
        return
    G = work[L.W_G : L.W_G + 36].reshape((6, 6))
    mu = work[L.W_MU : L.W_MU + 18].reshape((3, 6))
    pose_columns(x, G, mu)
    KX = work[L.W_KX : L.W_KX + 36].reshape((6, 6))
    KV = work[L.W_KV : L.W_KV + 36].reshape((6, 6))
    J = work[L.W_J : L.W_J + 72].reshape((6, 12))
    w2m = mx
    for k in range(3):
        w2m[k] = M[0, k] * w2[0] + M[1, k] * w2[1] + M[2, k] * w2[2]
    chain(x, xd_x, W_x, G, mu, w2m, V, W, sums, KX, KV, J)
    spread(M, J, R1, v1, w1, R2, v2, w2, wrench, jac)
