"""Distance of two lines, each parallel to one wheel's axis: tip corners against arcs and planes of the mate."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel

S_X = L.S_X
N_GAP, N_GRAD, N_HESS = L.N_GAP, L.N_GRAD, L.N_HESS
PLANE = 1.0  # radius, m, of the cylinder that stands for a plane
# scratch inside the limits' records, free between calls: the difference d of two lines and its derivatives
D_ = L.W_LIMIT  # 2
D1 = D_ + 2  # 5 x 2: by a, p, q, tip angle, root angle
D2 = D1 + 10  # 5 x 5 x 2


@kernel
def line_offset(wk, vx, vy, zeta):
    """Offset in the section of two lines whose places in their wheels' own planes differ by ``v``; see below."""
    p, q = wk[S_X + 2], wk[S_X + 3]
    along = (p * vx + q * vy) * wk[L.S_M] - 2.0 * zeta * wk[L.S_IW]
    return wk[S_X] + vx + p * along, vy + q * along


@kernel
def line_distance(wk, vx, vy, tx, ty, cx, cy, zeta):
    """Fill the offset in the section of a tip line from a root line, with derivatives by (a, p, q, tip, root angle).

    ``v`` is the difference of the two lines' places in their wheels' own planes; ``t`` and ``c`` are its derivatives
    by the tip wheel's and the root wheel's angle. Second derivatives by the angles are ``-v_t`` and ``-v_c`` where
    ``v = v_t - v_c``; they follow from ``t`` and ``c`` turned by a right angle.
    """
    a, p, q = wk[S_X], wk[S_X + 2], wk[S_X + 3]
    iw, iw3, iw5 = wk[L.S_IW], wk[L.S_IW3], wk[L.S_IW5]
    m, mw, mww = wk[L.S_M], wk[L.S_MW], wk[L.S_MWW]
    kap = p * vx + q * vy
    for axis in range(2):
        u = p if axis == 0 else q
        v = vx if axis == 0 else vy
        wk[D_ + axis] = (a if axis == 0 else 0.0) + v + u * (kap * m - 2.0 * zeta * iw)
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
            wk[D1 + 2 * i + axis] = first + u * si + ei * (kap * m - 2.0 * zeta * iw)
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
                wk[D2 + 10 * i + 2 * j + axis] = u * sij + ei * sj + ej * si + (vijx if axis == 0 else vijy)


@kernel
def distance_gap(wk, tip, sign, offset, o, want):
    """Fill a node record with ``sign (distance - offset)``, the distance of the two parallel-to-root lines in space."""
    p, q = wk[S_X + 2], wk[S_X + 3]
    dx, dy = wk[D_], wk[D_ + 1]
    lean = p * dx + q * dy
    dist = np.sqrt(dx * dx + dy * dy - lean * lean)
    wk[o + N_GAP] = sign * (dist - offset)
    for i in range(o + N_GRAD, o + N_HESS + 36):
        wk[i] = 0.0
    for i in range(5):
        xi = pose_slot(i, tip)
        dix, diy = wk[D1 + 2 * i], wk[D1 + 2 * i + 1]
        li = p * dix + q * diy + (dx if i == 1 else (dy if i == 2 else 0.0))
        gi_ = (dx * dix + dy * diy - lean * li) / dist
        wk[o + N_GRAD + xi] = sign * gi_
        if want == 0:
            continue
        for j in range(5):
            xj = pose_slot(j, tip)
            djx, djy = wk[D1 + 2 * j], wk[D1 + 2 * j + 1]
            lj = p * djx + q * djy + (dx if j == 1 else (dy if j == 2 else 0.0))
            gj = (dx * djx + dy * djy - lean * lj) / dist
            dijx, dijy = wk[D2 + 10 * i + 2 * j], wk[D2 + 10 * i + 2 * j + 1]
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
            wk[o + N_HESS + 6 * xi + xj] = sign * value / dist


@kernel
def pose_slot(i, tip):
    """Place in the pose numbers of derivative ``i``: a, p, q, angle of the tip wheel, angle of the root wheel."""
    if i == 0:
        return 0
    if i < 3:
        return i + 1
    return 5 - tip if i == 3 else 4 + tip


@kernel
def corner_on_plane(wk, tip, eta, at, away, zeta, o, want):
    """Gap of the corner at work to a plane along the axis of its mate, at the angle ``eta`` from the line of centres.

    ``tip`` is 1 when the corner is wheel 1's and 0 when it is wheel 2's. The plane stands ``away`` from the axis,
    towards the free side; a wide cylinder that touches it at the radius ``at`` takes its place.
    """
    r, se, ce = wk[L.C_R], wk[L.C_SIN], wk[L.C_COS]
    sb, cb = np.sin(eta), np.cos(eta)
    x = at * cb + (PLANE - away) * sb
    y = at * sb - (PLANE - away) * cb
    line_distance(wk, -r * ce - x, -r * se - y, r * se, -r * ce, y, -x, zeta)
    distance_gap(wk, tip, 1.0, PLANE + wk[L.C_ROUND], o, want)
