"""Tips in the mate's root: tip corners on the root arcs and the root circle, tip land on the root circle.

Only used when the tip clearance is small. These contacts push, and damp, but carry no friction.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.cells import plane_force
from gearmbs.contact.deviations import set_corner
from gearmbs.contact.face import LIMIT, face_limit
from gearmbs.contact.flanks import TWO_PI, clear_node, face_forces, flank_pitch, gap_rate, open_side, station
from gearmbs.contact.jit import kernel
from gearmbs.contact.sums import add_normal

S_X, S_W = L.S_X, L.S_W
WHEEL, NODE, N_GAP, N_GRAD, N_HESS = L.WHEEL, L.NODE, L.N_GAP, L.N_GRAD, L.N_HESS
NODES, LO, HI = L.W_NODES, L.W_LIMIT, L.W_LIMIT + LIMIT
FAR = 1.0  # a gap, m, for parts that do not face each other
# scratch inside the limits' records, free between calls: the difference d of two lines and its derivatives
D_ = L.W_LIMIT  # 2
D1 = D_ + 2  # 5 x 2: by a, p, q, tip angle, root angle
D2 = D1 + 10  # 5 x 5 x 2


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
def corner_in_root(gr, wk, tip, f_tip, f_root, zeta, o, want):
    """Gap of a tip corner of wheel ``2 - tip`` to the root arc or root circle of its mate; far if it faces neither."""
    own = WHEEL * (1 - tip)
    mate = WHEEL * tip
    set_corner(gr, wk, 1 - tip, f_tip, gr[own + L.S_TIP])
    r = wk[L.C_R]
    se, ce = wk[L.C_SIN], wk[L.C_COS]
    eta = f_root + gr[mate + L.PSI_FILLET]
    sc, cc = np.sin(eta), np.cos(eta)
    rc = gr[mate + L.R_FILLET_CENTRE]
    fillet = gr[mate + L.R_FILLET]
    # where the corner stands, seen from the centre of the root arc, without tilt
    dx = wk[S_X] - r * ce - rc * cc
    dy = -r * se - rc * sc
    outward = dx * cc + dy * sc
    to_tooth = dx * sc - dy * cc
    wk[o + N_GAP] = FAR
    if to_tooth < 0.0:
        # only the corner next to the line of centres; a land across it meets the circle there itself
        if -to_tooth > gr[L.PITCH] or se > 0.0:
            return
        line_distance(wk, -r * ce, -r * se, r * se, -r * ce, 0.0, 0.0, zeta)
        distance_gap(wk, tip, 1.0, gr[mate + L.R_ROOT] + wk[L.C_ROUND], o, want)
    elif outward < 0.0 and to_tooth < 2.0 * fillet:
        line_distance(wk, -r * ce - rc * cc, -r * se - rc * sc, r * se, -r * ce, rc * sc, -rc * cc, zeta)
        distance_gap(wk, tip, -1.0, fillet - wk[L.C_ROUND], o, want)


@kernel
def land_on_root(gr, wk, tip, f_tip, f_root, zeta, o, want):
    """Gap of the tip circle of wheel ``2 - tip`` to the mate's root circle where both reach the line of centres."""
    own = WHEEL * (1 - tip)
    mate = WHEEL * tip
    wk[o + N_GAP] = FAR
    if abs(f_tip) > gr[own + L.PSI_CORNER] or f_root + gr[mate + L.PSI_FILLET] > 0.0:
        return
    if f_root + gr[L.PITCH] / gr[mate + L.RB] - gr[mate + L.PSI_FILLET] < 0.0:
        return
    line_distance(wk, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, zeta)
    distance_gap(wk, tip, 1.0, gr[own + L.R_TIP] + gr[mate + L.R_ROOT], o, want)


@kernel
def root_contacts(gi, gr, wk, side, diag, want):
    """Add the contacts of all tips near the line of centres with the mate's root, on one side of the teeth."""
    if not open_side(gr, wk):
        return
    slices = gi[L.N_SLICES]
    n = flank_pitch(gr, wk)
    step = 0.0 if slices == 1 else (gr[L.ZETA_HI] - gr[L.ZETA_LO]) / slices
    own = NODES + (slices + 1) * NODE
    sel = NODES + 2 * (slices + 1) * NODE
    for tip in range(2):
        pitch_tip = TWO_PI / gi[L.Z1 + 1 - tip]
        pitch_root = TWO_PI / gi[L.Z1 + tip]
        middle = -np.floor(wk[S_X + 5 - tip] / pitch_tip + 0.5)
        for k in range(-1, 2):
            f_tip = wk[S_X + 5 - tip] + (middle + k) * pitch_tip
            f_root = wk[S_X + 4 + tip] + (n - middle - k) * pitch_root
            for land in range(2 if side == 1 and k == 0 else 1):
                touching = False
                for j in range(slices + 1 if slices > 1 else 1):
                    o = own + j * NODE
                    zeta = station(gi, gr, j, step)
                    if land == 0:
                        corner_in_root(gr, wk, tip, f_tip, f_root, zeta, o, want)
                    else:
                        land_on_root(gr, wk, tip, f_tip, f_root, zeta, o, want)
                    if wk[o + N_GAP] >= FAR:
                        for i in range(o + N_GRAD, o + N_HESS + 36):
                            wk[i] = 0.0
                    gap_rate(wk, o, want)
                    clear_node(wk, o, want)
                    wk[sel + j] = o
                    touching = touching or wk[o + N_GAP] < 0.0
                if not touching:
                    continue
                f1 = f_root if tip == 0 else f_tip
                f2 = f_tip if tip == 0 else f_root
                if slices == 1:
                    depth = plane_force(gi, gr, wk, own, 1.0, diag, want)
                else:
                    face_limit(-1.0, gr, wk, f1, f2, LO, want)
                    face_limit(1.0, gr, wk, f1, f2, HI, want)
                    depth = face_forces(gi, gr, wk, sel, 0, slices, step, 1.0, diag, want)
                if depth > 0.0:
                    for j in range(slices + 1 if slices > 1 else 1):
                        o = own + j * NODE
                        diag[7] += wk[o + L.N_FORCE]
                        add_normal(wk, o, want)
                    k_diag = 3 if side == gi[L.DRIVE] else 4
                    diag[k_diag] = max(diag[k_diag], depth)
                    diag[k_diag + 2] += 1.0
