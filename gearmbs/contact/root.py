"""Tips in the mate's root: tip corners on the root arcs and the root circle, tip land on the root circle.

Only used when the tip clearance is small. These contacts push, and damp, but carry no friction.

A tip meets the root circle with its land while that crosses the line of centres, else with its nearer corner. Where a
corner stands over a root arc, the arc's force replaces that of the circle beneath it and that of the flank's extension
behind it: both are taken away again. Arc and circle agree at one end of the arc, arc and flank at the other, so forces
do not jump.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.cells import plane_force
from gearmbs.contact.deviations import set_corner
from gearmbs.contact.face import LIMIT, face_limit
from gearmbs.contact.flanks import TWO_PI, clear_node, face_forces, flank_pitch, gap_rate, open_side, station
from gearmbs.contact.jit import kernel
from gearmbs.contact.lines import corner_on_plane, distance_gap, line_distance, line_offset
from gearmbs.contact.sums import add_normal

S_X = L.S_X
WHEEL, NODE, N_GAP, N_GRAD, N_HESS = L.WHEEL, L.NODE, L.N_GAP, L.N_GRAD, L.N_HESS
NODES, LO, HI = L.W_NODES, L.W_LIMIT, L.W_LIMIT + LIMIT
FAR = 1.0  # a gap, m, for parts that do not face each other
ON_CIRCLE, ON_ARC, ON_FLANK, UNDER_ARC = range(4)
BEFORE = L.W_J  # 42: generalised force and its derivatives before a part that is taken away


@kernel
def over_arc(gr, wk, mate, f_root, zeta):
    """Whether the corner at work stands over the root arc of its mate's tooth in a section."""
    r = wk[L.C_R]
    psi = gr[mate + L.PSI_FILLET]
    sc, cc = np.sin(f_root + psi), np.cos(f_root + psi)
    rc = gr[mate + L.R_FILLET_CENTRE]
    dx, dy = line_offset(wk, -r * wk[L.C_COS] - rc * cc, -r * wk[L.C_SIN] - rc * sc, zeta)
    if dx * sc - dy * cc < 0.0:
        return False
    end = f_root + psi - np.arcsin(gr[mate + L.R_FILLET] / rc)
    return dx * np.cos(end) + dy * np.sin(end) < 0.0


@kernel
def root_gap(gr, wk, part, tip, f_tip, f_root, zeta, o, want):
    """Gap of one part of a tip's contact with the mate's root in a section; far where the part is not in play.

    The tip is that of wheel ``2 - tip``.
    """
    own = WHEEL * (1 - tip)
    mate = WHEEL * tip
    r = wk[L.C_R]
    se, ce = wk[L.C_SIN], wk[L.C_COS]
    wk[o + N_GAP] = FAR
    if part == ON_CIRCLE:
        dx, dy = line_offset(wk, 0.0, 0.0, zeta)
        off = f_tip - np.arctan2(dy, dx)
        psi = gr[own + L.PSI_CORNER]
        if abs(off) <= psi:
            line_distance(wk, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, zeta)
            distance_gap(wk, tip, 1.0, gr[own + L.R_TIP] + gr[mate + L.R_ROOT], o, want)
            return
        nearer = f_tip - psi if off > 0.0 else f_tip + psi
        se, ce = np.sin(nearer), np.cos(nearer)
    elif not over_arc(gr, wk, mate, f_root, zeta):
        return
    if part == ON_ARC:
        eta = f_root + gr[mate + L.PSI_FILLET]
        rs, rc = gr[mate + L.R_FILLET_CENTRE] * np.sin(eta), gr[mate + L.R_FILLET_CENTRE] * np.cos(eta)
        line_distance(wk, -r * ce - rc, -r * se - rs, r * se, -r * ce, rs, -rc, zeta)
        distance_gap(wk, tip, -1.0, gr[mate + L.R_FILLET] - wk[L.C_ROUND], o, want)
    elif part == ON_FLANK:
        rf, rc = gr[mate + L.R_FILLET], gr[mate + L.R_FILLET_CENTRE]
        end = f_root + gr[mate + L.PSI_FILLET] - np.arcsin(rf / rc)
        corner_on_plane(wk, tip, end, np.sqrt(rc * rc - rf * rf), 0.0, zeta, o, want)
    else:
        line_distance(wk, -r * ce, -r * se, r * se, -r * ce, 0.0, 0.0, zeta)
        distance_gap(wk, tip, 1.0, gr[mate + L.R_ROOT] + wk[L.C_ROUND], o, want)


@kernel
def root_part(gi, gr, wk, part, tip, f_tip, f_root, diag, want):
    """Add one part of a tip's contact with the mate's root, or take it away; returns its largest penetration."""
    slices = gi[L.N_SLICES]
    step = 0.0 if slices == 1 else (gr[L.ZETA_HI] - gr[L.ZETA_LO]) / slices
    own = NODES + (slices + 1) * NODE
    sel = NODES + 2 * (slices + 1) * NODE
    nodes = slices + 1 if slices > 1 else 1
    touching = False
    for j in range(nodes):
        o = own + j * NODE
        root_gap(gr, wk, part, tip, f_tip, f_root, station(gi, gr, j, step), o, want)
        if wk[o + N_GAP] >= FAR:
            for i in range(o + N_GRAD, o + N_HESS + 36):
                wk[i] = 0.0
        gap_rate(wk, o, want)
        clear_node(wk, o, want)
        wk[sel + j] = o
        touching = touching or wk[o + N_GAP] < 0.0
    if not touching:
        return 0.0
    away = part == ON_FLANK or part == UNDER_ARC
    energy = diag[0]
    power = diag[1]
    if away:
        for i in range(42):
            wk[BEFORE + i] = wk[L.Q_ + i]
    if slices == 1:
        depth = plane_force(gi, gr, wk, own, 1.0, diag, want)
    else:
        f1 = f_root if tip == 0 else f_tip
        f2 = f_tip if tip == 0 else f_root
        face_limit(-1.0, gr, wk, f1, f2, LO, want)
        face_limit(1.0, gr, wk, f1, f2, HI, want)
        depth = face_forces(gi, gr, wk, sel, 0, slices, step, 1.0, diag, want)
    if away:
        diag[0] = 2.0 * energy - diag[0]
        diag[1] = 2.0 * power - diag[1]
        for i in range(42):
            wk[L.Q_ + i] = 2.0 * wk[BEFORE + i] - wk[L.Q_ + i]
    for j in range(nodes):
        o = own + j * NODE
        if away:
            wk[o + L.N_FORCE] = -wk[o + L.N_FORCE]
            for i in range(12):
                wk[o + L.N_FX + i] = -wk[o + L.N_FX + i]
        diag[7] += wk[o + L.N_FORCE]
        add_normal(wk, o, want)
    return 0.0 if away else depth


@kernel
def root_contacts(gi, gr, wk, side, diag, want):
    """Add the contacts of all tips near the line of centres with the mate's root, on one side of the teeth."""
    if not open_side(gr, wk):
        return
    n = flank_pitch(gr, wk)
    for tip in range(2):
        pitch_tip = TWO_PI / gi[L.Z1 + 1 - tip]
        pitch_root = TWO_PI / gi[L.Z1 + tip]
        middle = -np.floor(wk[S_X + 5 - tip] / pitch_tip + 0.5)
        for k in range(-2, 3):
            f_tip = wk[S_X + 5 - tip] + (middle + k) * pitch_tip
            f_root = wk[S_X + 4 + tip] + (n - middle - k) * pitch_root
            set_corner(gr, wk, 1 - tip, f_tip, gr[WHEEL * (1 - tip) + L.S_TIP])
            depth = 0.0
            # the circle knows no sides and counts on that of the drive
            for part in range(ON_CIRCLE if side == gi[L.DRIVE] else ON_ARC, UNDER_ARC + 1):
                depth = max(depth, root_part(gi, gr, wk, part, tip, f_tip, f_root, diag, want))
            if depth > 0.0:
                place = 3 if side == gi[L.DRIVE] else 4
                diag[place] = max(diag[place], depth)
                diag[place + 2] += 1.0
