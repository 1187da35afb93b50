"""Relative pose of two wheels in six numbers, and the maps between them and motions and forces in space.

The mean frame M has its z axis half-way between the two wheel axes and its x axis from wheel 1 to wheel 2. In it
the pose is ``x = (a, h, p, q, phi1, phi2)``: centre distance and axial offset, tilt ``(p, q)`` (axis 1 is
``(p, q, w)``, axis 2 ``(-p, -q, w)``; p is inclination, q skew), and the spin of each wheel counted from the line
of centres. Derivation in ``docs/theory/contact.md``.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact.records import kernel


@kernel
def relative_pose(R1, A1, R2, A2, internal, motion):
    """Fill pose numbers and mean frame (columns are its axes); False when they are undefined.

    With an internal wheel 2 the line of centres points from it to wheel 1, on to where the teeth mesh: the centre
    distance is negative, and both spins are counted from that direction.
    """
    zx = A1[0, 2] + A2[0, 2]
    zy = A1[1, 2] + A2[1, 2]
    zz = A1[2, 2] + A2[2, 2]
    norm = np.sqrt(zx * zx + zy * zy + zz * zz)
    if not norm > 1.0:
        return False
    inverse = 1.0 / norm
    zx *= inverse
    zy *= inverse
    zz *= inverse
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
    if internal:
        a = -a
    inverse = 1.0 / a
    ex *= inverse
    ey *= inverse
    ez *= inverse
    fx = zy * ez - zz * ey
    fy = zz * ex - zx * ez
    fz = zx * ey - zy * ex
    frame = motion.frame
    frame[0, 0], frame[1, 0], frame[2, 0] = ex, ey, ez
    frame[0, 1], frame[1, 1], frame[2, 1] = fx, fy, fz
    frame[0, 2], frame[1, 2], frame[2, 2] = zx, zy, zz
    ux = 0.5 * (A1[0, 2] - A2[0, 2])
    uy = 0.5 * (A1[1, 2] - A2[1, 2])
    uz = 0.5 * (A1[2, 2] - A2[2, 2])
    p = ux * ex + uy * ey + uz * ez
    q = ux * fx + uy * fy + uz * fz
    w = np.sqrt(1.0 - p * p - q * q)
    i1w = 1.0 / (1.0 + w)
    x = motion.x
    x[0], x[1], x[2], x[3] = a, h, p, q
    for k in range(2):
        A = A1 if k == 0 else A2
        sign = 1.0 if k == 0 else -1.0
        vx = A[0, 0] * ex + A[1, 0] * ey + A[2, 0] * ez
        vy = A[0, 0] * fx + A[1, 0] * fy + A[2, 0] * fz
        vz = A[0, 0] * zx + A[1, 0] * zy + A[2, 0] * zz
        back = (p * vx + q * vy) * i1w + sign * vz
        facing = 1.0 if internal else sign
        x[4 + k] = np.arctan2(facing * (vy - q * back), facing * (vx - p * back))
    return True


@kernel
def pose_rates(motion):
    """Fill the rates of the pose under the relative twist of wheel 1."""
    x = motion.x
    a, h, p, q = x[0], x[1], x[2], x[3]
    w = np.sqrt(1.0 - p * p - q * q)
    twist, xd = motion.twist, motion.xd
    ox, oy, oz = twist[3], twist[4], twist[5]
    i2w = 0.5 / w
    mx = 0.5 * oy - oz * q * i2w
    my = -0.5 * ox + oz * p * i2w
    mz = -(twist[1] + h * my) / a
    lam = p * my - q * mx
    i1w = 1.0 / (1.0 + w)
    xd[0] = -twist[0] - h * mx
    xd[1] = -twist[2] + a * mx
    xd[2] = w * mx + q * mz
    xd[3] = w * my - p * mz
    xd[4] = p * ox + q * oy + w * oz + lam * (1.0 + 2.0 * w) * i1w - mz
    xd[5] = -lam * i1w - mz


@kernel
def pose_rate_slopes(motion):
    """Fill the derivatives of the rates of the pose by a, h, p, q."""
    x = motion.x
    a, h, p, q = x[0], x[1], x[2], x[3]
    w = np.sqrt(1.0 - p * p - q * q)
    twist, xd_x = motion.twist, motion.xd_x
    ry, ox, oy, oz = twist[1], twist[3], twist[4], twist[5]
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
    for i in range(6):
        xd_x[i, 4] = xd_x[i, 5] = 0.0
    xd_x[0, 0] = 0.0
    xd_x[0, 1] = -mx
    xd_x[0, 2] = -h * mx_p
    xd_x[0, 3] = -h * mx_q
    xd_x[1, 0] = mx
    xd_x[1, 1] = 0.0
    xd_x[1, 2] = a * mx_p
    xd_x[1, 3] = a * mx_q
    xd_x[2, 0] = q * mz_a
    xd_x[2, 1] = q * mz_h
    xd_x[2, 2] = wp * mx + w * mx_p + q * mz_p
    xd_x[2, 3] = wq * mx + w * mx_q + mz + q * mz_q
    xd_x[3, 0] = -p * mz_a
    xd_x[3, 1] = -p * mz_h
    xd_x[3, 2] = wp * my + w * my_p - mz - p * mz_p
    xd_x[3, 3] = wq * my + w * my_q - p * mz_q
    xd_x[4, 0] = -mz_a
    xd_x[4, 1] = -mz_h
    xd_x[4, 2] = ox + wp * oz + lam_p * g1 + lam * g1_w * wp - mz_p
    xd_x[4, 3] = oy + wq * oz + lam_q * g1 + lam * g1_w * wq - mz_q
    xd_x[5, 0] = -mz_a
    xd_x[5, 1] = -mz_h
    xd_x[5, 2] = -lam_p * i1w + lam * g1_w * wp - mz_p
    xd_x[5, 3] = -lam_q * i1w + lam * g1_w * wq - mz_q


@kernel
def pose_wrench(motion, generalised, want):
    """Fill the wrench on wheel 1 in M that does the work of the generalised force, and its derivatives."""
    x = motion.x
    a, h, p, q = x[0], x[1], x[2], x[3]
    w = np.sqrt(1.0 - p * p - q * q)
    Qa, Qh, Qp, Qq, Q1, Q2 = (
        generalised[0], generalised[1], generalised[2], generalised[3], generalised[4], generalised[5],
    )  # fmt: skip
    wrench, wrench_x = motion.wrench, motion.wrench_x
    i1w = 1.0 / (1.0 + w)
    Mz = q * Qp - p * Qq - Q1 - Q2
    Lam = (Q1 * (1.0 + 2.0 * w) - Q2) * i1w
    Cx = -h * Qa + a * Qh + w * Qp - q * Lam
    Cy = w * Qq + p * Lam - h * Mz / a
    i2w = 0.5 / w
    mixed = p * Cy - q * Cx
    wrench[0] = -Qa
    wrench[1] = -Mz / a
    wrench[2] = -Qh
    wrench[3] = -0.5 * Cy + p * Q1
    wrench[4] = 0.5 * Cx + q * Q1
    wrench[5] = mixed * i2w + w * Q1
    if want == 0:
        return
    for i in range(6):
        wrench_x[i, 4] = wrench_x[i, 5] = 0.0
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
        wrench_x[0, k] = 0.0
        wrench_x[1, k] = -Mx[k] / a + (Mz / (a * a) if k == 0 else 0.0)
        wrench_x[2, k] = 0.0
        wrench_x[3, k] = -0.5 * Cyk + pk * Q1
        wrench_x[4, k] = 0.5 * Cxk + qk * Q1
        wrench_x[5, k] = (p * Cyk - q * Cxk + pk * Cy - qk * Cx) * i2w - mixed * i2w / w * wx[k] + wx[k] * Q1


@kernel
def pose_columns(motion):
    """Fill the derivative of the pose by the variation of wheel 1 in M (6, 6), and the turn of M (3, 6)."""
    x = motion.x
    a, h, p, q = x[0], x[1], x[2], x[3]
    w = np.sqrt(1.0 - p * p - q * q)
    i1w = 1.0 / (1.0 + w)
    g1 = (1.0 + 2.0 * w) * i1w
    columns, turn = motion.columns, motion.turn
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
        columns[0, k] = -(1.0 if k == 0 else 0.0) - h * mx
        columns[1, k] = -(1.0 if k == 2 else 0.0) + a * mx
        columns[2, k] = w * mx + q * mz
        columns[3, k] = w * my - p * mz
        columns[4, k] = lam * g1 - mz
        columns[5, k] = -lam * i1w - mz
        turn[0, k] = -my
        turn[1, k] = mx
        turn[2, k] = mz
    columns[4, 3] += p
    columns[4, 4] += q
    columns[4, 5] += w
