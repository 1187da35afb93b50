"""Contact of a gear pair: wrench on the wheels and its exact derivatives from poses and velocities."""

from __future__ import annotations

from numba import types

from gearmbs._jit import njit
from gearmbs.contact import layout as L
from gearmbs.contact.flanks import side_contacts
from gearmbs.contact.jit import kernel
from gearmbs.contact.pose import pose_columns, pose_rates, pose_wrench, relative_pose
from gearmbs.contact.root import root_contacts
from gearmbs.contact.sums import mirror

VEC = types.float64[::1]
MAT = types.float64[:, ::1]
GEAR_CONTACT_SIG = types.void(
    types.int64[::1], VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, types.int64, VEC
)
H_, B_, F_, FX_, FV_, FR_ = L.H_, L.B_, L.F_, L.FX_, L.FV_, L.FR_
M, V, W, G, MU, XDX, WX, KX, KV, J = (
    L.W_M,
    L.W_V,
    L.W_W,
    L.W_G,
    L.W_MU,
    L.W_XDX,
    L.W_WX,
    L.W_KX,
    L.W_KV,
    L.W_J,
)
W2 = L.S_X  # angular velocity of wheel 2 in M, once the sides are done


@kernel
def relative_twist(R1, v1, w1, R2, v2, w2, wk):
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
        wk[V + k] = wk[M + k] * vx + wk[M + 3 + k] * vy + wk[M + 6 + k] * vz
        wk[V + 3 + k] = wk[M + k] * ox + wk[M + 3 + k] * oy + wk[M + 6 + k] * oz


@kernel
def wrench_slopes(wk):
    """Derivatives of the wrench W = G^T Q + F by the pose numbers (KX) and the relative twist (KV), (6, 6) each."""
    # J holds dQ/dx and dQ/dV, row by row, on the way
    for i in range(6):
        b = B_ + 6 * i
        f = FR_ + 6 * i
        for j in range(6):
            qx = wk[H_ + 6 * i + j]
            kx = wk[FX_ + 6 * i + j]
            qv = 0.0
            kv = wk[FV_ + 6 * i + j]
            if j < 4:
                kx += wk[WX + 4 * i + j]
                for k in range(6):
                    qx += wk[b + k] * wk[XDX + 4 * k + j]
                    kx += wk[f + k] * wk[XDX + 4 * k + j]
            for k in range(6):
                qv += wk[b + k] * wk[G + 6 * k + j]
                kv += wk[f + k] * wk[G + 6 * k + j]
            wk[J + 12 * i + j] = qx
            wk[J + 12 * i + 6 + j] = qv
            wk[KX + 6 * i + j] = kx
            wk[KV + 6 * i + j] = kv
    for i in range(6):
        for j in range(6):
            kx = wk[KX + 6 * i + j]
            kv = wk[KV + 6 * i + j]
            for k in range(6):
                kx += wk[G + 6 * k + i] * wk[J + 12 * k + j]
                kv += wk[G + 6 * k + i] * wk[J + 12 * k + 6 + j]
            wk[KX + 6 * i + j] = kx
            wk[KV + 6 * i + j] = kv


@kernel
def own_columns(wk):
    """Derivatives of the wrench by the variations of wheel 1, all in the mean frame: ``J`` (6, 12)."""
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += wk[KX + 6 * i + k] * wk[G + 6 * k + j]
            wk[J + 12 * i + j] = total
            wk[J + 12 * i + 6 + j] = wk[KV + 6 * i + j]
    for j in range(6):
        ux, uy, uz = wk[MU + j], wk[MU + 6 + j], wk[MU + 12 + j]
        # the relative twist seen from the turning mean frame
        d0 = uz * wk[V + 1] - uy * wk[V + 2]
        d1 = ux * wk[V + 2] - uz * wk[V]
        d2 = uy * wk[V] - ux * wk[V + 1]
        d3 = uz * wk[V + 4] - uy * wk[V + 5]
        d4 = ux * wk[V + 5] - uz * wk[V + 3]
        d5 = uy * wk[V + 3] - ux * wk[V + 4]
        if j == 0:
            d1 -= wk[W2 + 2]
            d2 += wk[W2 + 1]
        elif j == 1:
            d0 += wk[W2 + 2]
            d2 -= wk[W2]
        elif j == 2:
            d0 -= wk[W2 + 1]
            d1 += wk[W2]
        for i in range(6):
            r = KV + 6 * i
            wk[J + 12 * i + j] += (
                wk[r] * d0 + wk[r + 1] * d1 + wk[r + 2] * d2 + wk[r + 3] * d3 + wk[r + 4] * d4 + wk[r + 5] * d5
            )
        for b in range(0, 6, 3):
            wk[J + 12 * b + j] += uy * wk[W + b + 2] - uz * wk[W + b + 1]
            wk[J + 12 * b + 12 + j] += uz * wk[W + b] - ux * wk[W + b + 2]
            wk[J + 12 * b + 24 + j] += ux * wk[W + b + 1] - uy * wk[W + b]


@kernel
def spread(wk, R1, v1, w1, R2, v2, w2, wrench, jac):
    """Turn ``J`` into global components and complete the columns of wheel 2 from the invariance under motions."""
    for b in range(0, 6, 3):
        for c in range(0, 12, 3):
            o = J + 12 * b + c
            for k in range(3):
                mx, my, mz = wk[M + 3 * k], wk[M + 3 * k + 1], wk[M + 3 * k + 2]
                m0 = wk[o] * mx + wk[o + 1] * my + wk[o + 2] * mz
                m1 = wk[o + 12] * mx + wk[o + 13] * my + wk[o + 14] * mz
                m2 = wk[o + 24] * mx + wk[o + 25] * my + wk[o + 26] * mz
                jac[b, c + k] = wk[M] * m0 + wk[M + 1] * m1 + wk[M + 2] * m2
                jac[b + 1, c + k] = wk[M + 3] * m0 + wk[M + 4] * m1 + wk[M + 5] * m2
                jac[b + 2, c + k] = wk[M + 6] * m0 + wk[M + 7] * m1 + wk[M + 8] * m2
    dx, dy, dz = R2[0] - R1[0], R2[1] - R1[1], R2[2] - R1[2]
    ax, ay, az = v1[0] - v2[0], v1[1] - v2[1], v1[2] - v2[2]
    bx, by, bz = w1[0] - w2[0], w1[1] - w2[1], w1[2] - w2[2]
    for i in range(6):
        rx, ry, rz = jac[i, 0], jac[i, 1], jac[i, 2]
        px, py, pz = jac[i, 6], jac[i, 7], jac[i, 8]
        ox, oy, oz = jac[i, 9], jac[i, 10], jac[i, 11]
        jac[i, 12] = -rx
        jac[i, 13] = -ry
        jac[i, 14] = -rz
        # J_R2 = -J_R1 as for dv; the moment of dw2 about R1 joins J_w2
        jac[i, 18] = -px
        jac[i, 19] = -py
        jac[i, 20] = -pz
        jac[i, 21] = -ox + dy * pz - dz * py
        jac[i, 22] = -oy + dz * px - dx * pz
        jac[i, 23] = -oz + dx * py - dy * px
        jac[i, 15] = -jac[i, 3] + dy * rz - dz * ry
        jac[i, 16] = -jac[i, 4] + dz * rx - dx * rz
        jac[i, 17] = -jac[i, 5] + dx * ry - dy * rx
        # minus J_v (dpi x (v1 - v2)) and so on, J_w2 (dpi x w2) expanded
        qx, qy, qz = jac[i, 21] + ox, jac[i, 22] + oy, jac[i, 23] + oz
        jac[i, 15] -= ay * pz - az * py + by * oz - bz * oy + w2[1] * qz - w2[2] * qy
        jac[i, 16] -= az * px - ax * pz + bz * ox - bx * oz + w2[2] * qx - w2[0] * qz
        jac[i, 17] -= ax * py - ay * px + bx * oy - by * ox + w2[0] * qy - w2[1] * qx
    for b in range(0, 6, 3):
        fx, fy, fz = wrench[b], wrench[b + 1], wrench[b + 2]
        jac[b + 1, 15] -= fz
        jac[b + 2, 15] += fy
        jac[b + 2, 16] -= fx
        jac[b, 16] += fz
        jac[b, 17] -= fy
        jac[b + 1, 17] += fx


@njit(GEAR_CONTACT_SIG, cache=True, nogil=True, error_model="numpy")
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
    if not relative_pose(R1, A1, R2, A2, work):
        return
    relative_twist(R1, v1, w1, R2, v2, w2, work)
    pose_rates(work)
    for i in range(L.SUMS):
        work[L.W_SUMS + i] = 0.0
    for i in range(18):
        work[L.S_X + i] = work[L.W_X + i]
    side_contacts(gi, gr, work, 1, diag, want_jac)
    if gi[L.ROOT] != 0:
        root_contacts(gi, gr, work, 1, diag, want_jac)
    for i in range(6):
        sign = -1.0 if i > 2 else 1.0
        work[L.S_X + i] = sign * work[L.W_X + i]
        work[L.S_XD + i] = sign * work[L.W_XD + i]
        work[L.S_V + i] = -work[V + i] if i % 2 == 1 else work[V + i]
    turned = side_contacts(gi, gr, work, -1, diag, want_jac)
    if gi[L.ROOT] != 0:
        if not turned:
            mirror(work)
        turned = True
        root_contacts(gi, gr, work, -1, diag, want_jac)
    if not diag[0] > 0.0:
        return
    if turned:
        mirror(work)
    pose_wrench(work, want_jac)
    for i in range(6):
        work[W + i] += work[F_ + i]
    for b in range(0, 6, 3):
        for k in range(3):
            row = M + 3 * k
            wrench[b + k] = work[row] * work[W + b] + work[row + 1] * work[W + b + 1] + work[row + 2] * work[W + b + 2]
    if want_jac == 0:
        return
    pose_columns(work)
    for k in range(3):
        work[W2 + k] = work[M + k] * w2[0] + work[M + 3 + k] * w2[1] + work[M + 6 + k] * w2[2]
    wrench_slopes(work)
    own_columns(work)
    spread(work, R1, v1, w1, R2, v2, w2, wrench, jac)
