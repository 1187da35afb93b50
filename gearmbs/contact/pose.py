"""Relative pose of two wheels in six numbers, and the maps between them and motions and forces in space.

The mean frame M has its z axis half-way between the two wheel axes and its x axis from wheel 1 to wheel 2. In it
the pose is ``x = (a, h, p, q, phi1, phi2)``: centre distance and axial offset, tilt ``(p, q)`` (axis 1 is
``(p, q, w)``, axis 2 ``(-p, -q, w)``; p is inclination, q skew), and the spin of each wheel counted from the line
of centres. Derivation in ``docs/theory/contact.md``.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel

X, XD, V, M = L.W_X, L.W_XD, L.W_V, L.W_M
XDX, WX, W, G, MU, Q = L.W_XDX, L.W_WX, L.W_W, L.W_G, L.W_MU, L.Q_


@kernel
def relative_pose(R1, A1, R2, A2, wk):
    """Fill pose numbers and mean frame (columns are its axes); False when they are undefined."""
    zx = A1[0, 2] + A2[0, 2]
    zy = A1[1, 2] + A2[1, 2]
    zz = A1[2, 2] + A2[2, 2]
    norm = np.sqrt(zx * zx + zy * zy + zz * zz)
    if not norm > 1.0:
        return False
    zx /= norm
    zy /= norm
    zz /= norm
    dx = R2[0] - R1[0]
    dy = R2[1] - R1[1]
    dz = R2[2] - R1[2]
    h = dx * zx + dy * zy + dz * zz
    ex = dx - h * zx
    ey = dy - h * zy
    ez = dz - h * zz
    a = np.sqrt(ex * ex + ey * ey + ez * ez)
    if not a > 0.0:
        return False
    ex /= a
    ey /= a
    ez /= a
    fx = zy * ez - zz * ey
    fy = zz * ex - zx * ez
    fz = zx * ey - zy * ex
    wk[M + 0] = ex
    wk[M + 3] = ey
    wk[M + 6] = ez
    wk[M + 1] = fx
    wk[M + 4] = fy
    wk[M + 7] = fz
    wk[M + 2] = zx
    wk[M + 5] = zy
    wk[M + 8] = zz
    ux = 0.5 * (A1[0, 2] - A2[0, 2])
    uy = 0.5 * (A1[1, 2] - A2[1, 2])
    uz = 0.5 * (A1[2, 2] - A2[2, 2])
    p = ux * ex + uy * ey + uz * ez
    q = ux * fx + uy * fy + uz * fz
    w = np.sqrt(1.0 - p * p - q * q)
    wk[X + 0] = a
    wk[X + 1] = h
    wk[X + 2] = p
    wk[X + 3] = q
    for k in range(2):
        A = A1 if k == 0 else A2
        sign = 1.0 if k == 0 else -1.0
        vx = A[0, 0] * ex + A[1, 0] * ey + A[2, 0] * ez
        vy = A[0, 0] * fx + A[1, 0] * fy + A[2, 0] * fz
        vz = A[0, 0] * zx + A[1, 0] * zy + A[2, 0] * zz
        back = (p * vx + q * vy) / (1.0 + w) + sign * vz
        wk[X + 4 + k] = np.arctan2(sign * (vy - q * back), sign * (vx - p * back))
    return True


@kernel
def pose_rates(wk):
    """Fill the rates of the pose under the relative twist of wheel 1, and their derivatives by a, h, p, q."""
    a, h, p, q = wk[X], wk[X + 1], wk[X + 2], wk[X + 3]
    w = np.sqrt(1.0 - p * p - q * q)
    ry, ox, oy, oz = wk[V + 1], wk[V + 3], wk[V + 4], wk[V + 5]
    i2w = 0.5 / w
    wp = -p / w
    wq = -q / w
    mx = 0.5 * oy - oz * q * i2w
    my = -0.5 * ox + oz * p * i2w
    d2 = -0.5 / (w * w)
    mx_p = -oz * q * d2 * wp
    mx_q = -oz * (i2w + q * d2 * wq)
    my_p = oz * (i2w + p * d2 * wp)
    my_q = oz * p * d2 * wq
    mz = -(ry + h * my) / a
    mz_a = -mz / a
    mz_h = -my / a
    mz_p = -h * my_p / a
    mz_q = -h * my_q / a
    lam = p * my - q * mx
    lam_p = my + p * my_p - q * mx_p
    lam_q = -mx + p * my_q - q * mx_q
    i1w = 1.0 / (1.0 + w)
    g1 = (1.0 + 2.0 * w) * i1w
    g1_w = i1w * i1w
    wk[XD + 0] = -wk[V] - h * mx
    wk[XD + 1] = -wk[V + 2] + a * mx
    wk[XD + 2] = w * mx + q * mz
    wk[XD + 3] = w * my - p * mz
    wk[XD + 4] = p * ox + q * oy + w * oz + lam * g1 - mz
    wk[XD + 5] = -lam * i1w - mz
    wk[XDX + 0] = 0.0
    wk[XDX + 1] = -mx
    wk[XDX + 2] = -h * mx_p
    wk[XDX + 3] = -h * mx_q
    wk[XDX + 4] = mx
    wk[XDX + 5] = 0.0
    wk[XDX + 6] = a * mx_p
    wk[XDX + 7] = a * mx_q
    wk[XDX + 8] = q * mz_a
    wk[XDX + 9] = q * mz_h
    wk[XDX + 10] = wp * mx + w * mx_p + q * mz_p
    wk[XDX + 11] = wq * mx + w * mx_q + mz + q * mz_q
    wk[XDX + 12] = -p * mz_a
    wk[XDX + 13] = -p * mz_h
    wk[XDX + 14] = wp * my + w * my_p - mz - p * mz_p
    wk[XDX + 15] = wq * my + w * my_q - p * mz_q
    wk[XDX + 16] = -mz_a
    wk[XDX + 17] = -mz_h
    wk[XDX + 18] = ox + wp * oz + lam_p * g1 + lam * g1_w * wp - mz_p
    wk[XDX + 19] = oy + wq * oz + lam_q * g1 + lam * g1_w * wq - mz_q
    wk[XDX + 20] = -mz_a
    wk[XDX + 21] = -mz_h
    wk[XDX + 22] = -lam_p * i1w + lam * g1_w * wp - mz_p
    wk[XDX + 23] = -lam_q * i1w + lam * g1_w * wq - mz_q


@kernel
def pose_wrench(wk, want):
    """Fill the wrench on wheel 1 in M that does the work of the generalised force, and its derivatives."""
    a, h, p, q = wk[X], wk[X + 1], wk[X + 2], wk[X + 3]
    w = np.sqrt(1.0 - p * p - q * q)
    Qa, Qh, Qp, Qq, Q1, Q2 = wk[Q], wk[Q + 1], wk[Q + 2], wk[Q + 3], wk[Q + 4], wk[Q + 5]
    i1w = 1.0 / (1.0 + w)
    Mz = q * Qp - p * Qq - Q1 - Q2
    Lam = (Q1 * (1.0 + 2.0 * w) - Q2) * i1w
    Cx = -h * Qa + a * Qh + w * Qp - q * Lam
    Cy = w * Qq + p * Lam - h * Mz / a
    i2w = 0.5 / w
    mixed = p * Cy - q * Cx
    wk[W + 0] = -Qa
    wk[W + 1] = -Mz / a
    wk[W + 2] = -Qh
    wk[W + 3] = -0.5 * Cy + p * Q1
    wk[W + 4] = 0.5 * Cx + q * Q1
    wk[W + 5] = mixed * i2w + w * Q1
    if want == 0:
        return
    wx = (0.0, 0.0, -p / w, -q / w)
    Mx = (0.0, 0.0, -Qq, Qp)
    for k in range(4):
        Lk = (2.0 * Q1 - Lam) * i1w * wx[k]
        Cxk = wx[k] * Qp - q * Lk
        Cyk = wx[k] * Qq + p * Lk - h * Mx[k] / a
        pk = 0.0
        qk = 0.0
        if k == 0:
            Cxk += Qh
            Cyk += h * Mz / (a * a)
        elif k == 1:
            Cxk -= Qa
            Cyk -= Mz / a
        elif k == 2:
            Cyk += Lam
            pk = 1.0
        else:
            Cxk -= Lam
            qk = 1.0
        wk[WX + 0 + k] = 0.0
        wk[WX + 4 + k] = -Mx[k] / a + (Mz / (a * a) if k == 0 else 0.0)
        wk[WX + 8 + k] = 0.0
        wk[WX + 12 + k] = -0.5 * Cyk + pk * Q1
        wk[WX + 16 + k] = 0.5 * Cxk + qk * Q1
        wk[WX + 20 + k] = (p * Cyk - q * Cxk + pk * Cy - qk * Cx) * i2w - mixed * i2w / w * wx[k] + wx[k] * Q1


@kernel
def pose_columns(wk):
    """Fill the derivative of the pose by the variation of wheel 1 in M (6, 6), and the turn of M (3, 6)."""
    a, h, p, q = wk[X], wk[X + 1], wk[X + 2], wk[X + 3]
    w = np.sqrt(1.0 - p * p - q * q)
    i1w = 1.0 / (1.0 + w)
    g1 = (1.0 + 2.0 * w) * i1w
    for k in range(6):
        mx = 0.0
        my = 0.0
        if k == 3:
            my = -0.5
        elif k == 4:
            mx = 0.5
        elif k == 5:
            mx = -0.5 * q / w
            my = 0.5 * p / w
        mz = -((1.0 if k == 1 else 0.0) + h * my) / a
        lam = p * my - q * mx
        wk[G + 0 + k] = -(1.0 if k == 0 else 0.0) - h * mx
        wk[G + 6 + k] = -(1.0 if k == 2 else 0.0) + a * mx
        wk[G + 12 + k] = w * mx + q * mz
        wk[G + 18 + k] = w * my - p * mz
        wk[G + 24 + k] = lam * g1 - mz
        wk[G + 30 + k] = -lam * i1w - mz
        wk[MU + 0 + k] = -my
        wk[MU + 6 + k] = mx
        wk[MU + 12 + k] = mz
    wk[G + 27] += p
    wk[G + 28] += q
    wk[G + 29] += w
