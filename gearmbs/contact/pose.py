"""Relative pose of two wheels in six numbers, and the maps between them and motions and forces in space.

The mean frame M has its z axis half-way between the two wheel axes and its x axis from wheel 1 to wheel 2. In it
the pose is ``x = (a, h, p, q, phi1, phi2)``: centre distance and axial offset, tilt ``(p, q)`` (axis 1 is
``(p, q, w)``, axis 2 ``(-p, -q, w)``; p is inclination, q skew), and the spin of each wheel counted from the line
of centres. Derivation in ``docs/theory/contact.md``; rates and forces are one formula of
`gearmbs.contact.formulas.definitions`.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact.formulas import derived as D
from gearmbs.contact.records import inlined, kernel


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


@inlined
def cosine_of_tilt(motion):
    """Return w, the cosine of the angle between an axis and the mean one."""
    p, q = motion.x[2], motion.x[3]
    return np.sqrt(1.0 - p * p - q * q)


@kernel
def pose_rates(motion):
    """Fill the rates of the pose under the relative twist of wheel 1."""
    D.pose_rates(motion.x, cosine_of_tilt(motion), motion.twist, motion.xd)


@kernel
def pose_rate_slopes(motion):
    """Fill the derivatives of the rates of the pose by a, h, p, q."""
    xd_x = motion.xd_x
    D.pose_rate_slopes(motion.x, cosine_of_tilt(motion), motion.twist, xd_x)
    for i in range(6):
        xd_x[i, 4] = xd_x[i, 5] = 0.0


@kernel
def pose_wrench(motion, generalised, want):
    """Fill the wrench on wheel 1 in M that does the work of the generalised force, and its derivatives."""
    w, wrench_x = cosine_of_tilt(motion), motion.wrench_x
    D.pose_wrench(motion.x, w, generalised, motion.wrench)
    if want == 0:
        return
    D.pose_wrench_slopes(motion.x, w, generalised, wrench_x)
    for i in range(6):
        wrench_x[i, 4] = wrench_x[i, 5] = 0.0


@kernel
def pose_columns(motion):
    """Fill the derivative of the pose by the variation of wheel 1 in M (6, 6), and the turn of M (3, 6)."""
    D.pose_columns(motion.x, cosine_of_tilt(motion), motion.columns, motion.turn)
