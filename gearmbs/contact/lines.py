"""Distance of two lines, each parallel to one wheel's axis: tip corners against arcs and planes of the mate."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel

PLANE = 1.0  # radius, m, of the cylinder that stands for a plane


@kernel
def line_offset(side, vx, vy, zeta):
    """Offset in the section of two lines whose places in their wheels' own planes differ by ``v``; see below."""
    p, q = side.x[L.P], side.x[L.Q]
    along = (p * vx + q * vy) * side.m - 2.0 * zeta * side.i_w
    return side.x[L.A] + vx + p * along, vy + q * along


@kernel
def line_distance(side, vx, vy, tx, ty, cx, cy, zeta):
    """Fill the offset in the section of a tip line from a root line, with derivatives by (a, p, q, tip, root angle).

    Second derivatives by the angles are ``-v_t`` and ``-v_c`` where ``v = v_t - v_c``; they follow from ``t`` and
    ``c`` turned by a right angle.

    Parameters
    ----------
    side : record
        Out: its ``lines``.
    vx, vy : float
        Difference of the two lines' places in their wheels' own planes.
    tx, ty, cx, cy : float
        Its derivatives by the tip wheel's and the root wheel's angle.
    zeta : float
        Place of the section along the mean axis.
    """
    a, p, q = side.x[L.A], side.x[L.P], side.x[L.Q]
    iw, iw3, iw5 = side.i_w, side.i_w3, side.i_w5
    m, mw, mww = side.m, side.m_w, side.m_ww
    d, d_x, d_xx = side.lines.d, side.lines.d_x, side.lines.d_xx
    kap = p * vx + q * vy
    for axis in range(2):
        u = p if axis == 0 else q
        v = vx if axis == 0 else vy
        d[axis] = (a if axis == 0 else 0.0) + v + u * (kap * m - 2.0 * zeta * iw)
    for i in range(5):
        mi = -mw * iw * (p if i == 1 else (q if i == 2 else 0.0))
        wi = iw3 * (p if i == 1 else (q if i == 2 else 0.0))
        vix = tx if i == 3 else (cx if i == 4 else 0.0)
        viy = ty if i == 3 else (cy if i == 4 else 0.0)
        ki = p * vix + q * viy + (vx if i == 1 else (vy if i == 2 else 0.0))
        si = mi * kap + m * ki - 2.0 * zeta * wi
        for axis in range(2):
            u = p if axis == 0 else q
            ei = 1.0 if i == axis + 1 else 0.0
            first = (1.0 if i == 0 and axis == 0 else 0.0) + (vix if axis == 0 else viy)
            d_x[i, axis] = first + u * si + ei * (kap * m - 2.0 * zeta * iw)
        for j in range(5):
            mj = -mw * iw * (p if j == 1 else (q if j == 2 else 0.0))
            wj = iw3 * (p if j == 1 else (q if j == 2 else 0.0))
            vjx = tx if j == 3 else (cx if j == 4 else 0.0)
            vjy = ty if j == 3 else (cy if j == 4 else 0.0)
            kj = p * vjx + q * vjy + (vx if j == 1 else (vy if j == 2 else 0.0))
            sj = mj * kap + m * kj - 2.0 * zeta * wj
            pij = (p if i == 1 else q) * (p if j == 1 else q) if 1 <= i <= 2 and 1 <= j <= 2 else 0.0
            same = 1.0 if i == j and 1 <= i <= 2 else 0.0
            mij = mww * pij * iw * iw - mw * (same * iw + pij * iw3)
            wij = same * iw3 + 3.0 * pij * iw5
            # a place on a circle turned by its angle: the second derivative is the first, turned by a right angle
            vijx = -viy if i == j and i >= 3 else 0.0
            vijy = vix if i == j and i >= 3 else 0.0
            kij = p * vijx + q * vijy
            if i == 1:
                kij += vjx
            elif i == 2:
                kij += vjy
            if j == 1:
                kij += vix
            elif j == 2:
                kij += viy
            sij = mij * kap + mi * kj + mj * ki + m * kij - 2.0 * zeta * wij
            for axis in range(2):
                u = p if axis == 0 else q
                ei = 1.0 if i == axis + 1 else 0.0
                ej = 1.0 if j == axis + 1 else 0.0
                d_xx[i, j, axis] = u * sij + ei * sj + ej * si + (vijx if axis == 0 else vijy)


@kernel
def distance_gap(side, strip, k, tip, sign, offset, want):
    """Fill section ``k`` with ``sign (distance - offset)`` of the two lines of `line_distance`, measured in space."""
    p, q = side.x[L.P], side.x[L.Q]
    d, d_x, d_xx = side.lines.d, side.lines.d_x, side.lines.d_xx
    dx, dy = d[0], d[1]
    lean = p * dx + q * dy
    dist = np.sqrt(dx * dx + dy * dy - lean * lean)
    strip.gap[k] = sign * (dist - offset)
    clear_slopes(strip, k)
    for i in range(5):
        xi = pose_place(i, tip)
        dix, diy = d_x[i, 0], d_x[i, 1]
        li = p * dix + q * diy + (dx if i == 1 else (dy if i == 2 else 0.0))
        gi_ = (dx * dix + dy * diy - lean * li) / dist
        strip.grad[xi, k] = sign * gi_
        if want == 0:
            continue
        for j in range(5):
            xj = pose_place(j, tip)
            if xj < xi:
                continue
            djx, djy = d_x[j, 0], d_x[j, 1]
            lj = p * djx + q * djy + (dx if j == 1 else (dy if j == 2 else 0.0))
            gj = (dx * djx + dy * djy - lean * lj) / dist
            dijx, dijy = d_xx[i, j, 0], d_xx[i, j, 1]
            lij = p * dijx + q * dijy
            if i == 1:
                lij += djx
            elif i == 2:
                lij += djy
            if j == 1:
                lij += dix
            elif j == 2:
                lij += diy
            value = dix * djx + diy * djy + dx * dijx + dy * dijy - li * lj - lean * lij - gi_ * gj
            strip.hess[xi, xj, k] = sign * value / dist


@kernel
def clear_slopes(strip, k):
    """Set the gap's derivatives in section ``k`` to nothing."""
    for i in range(6):
        strip.grad[i, k] = 0.0
        for j in range(i, 6):
            strip.hess[i, j, k] = 0.0


@kernel
def pose_place(i, tip):
    """Place in the pose numbers of derivative ``i``: a, p, q, angle of the tip wheel, angle of the root wheel."""
    if i == 0:
        return 0
    if i < 3:
        return i + 1
    return 5 - tip if i == 3 else 4 + tip


@kernel
def corner_on_plane(side, corner, strip, k, first, eta, at, away, want):
    """Gap of the corner at work to a plane along the axis of its mate, in section ``k``.

    Parameters
    ----------
    side, corner, strip : record
    k : int
        Section.
    first : bool
        Whether the corner is wheel 1's.
    eta : float
        Angle of the plane from the line of centres.
    at, away : float
        The plane stands ``away`` from the axis, towards the free side; a wide cylinder that touches it at the radius
        ``at`` takes its place.
    want : int
        Nonzero to fill second derivatives.
    """
    r, se, ce = corner.radius[k], corner.sin[k], corner.cos[k]
    sb, cb = np.sin(eta), np.cos(eta)
    x = at * cb + (PLANE - away) * sb
    y = at * sb - (PLANE - away) * cb
    line_distance(side, -r * ce - x, -r * se - y, r * se, -r * ce, y, -x, strip.zeta[k])
    distance_gap(side, strip, k, 1 if first else 0, 1.0, PLANE + corner.rounding[k], want)
