"""All tooth pairs of one side of the teeth: which are in reach, how they touch, and what force that gives."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.cells import cell_force, end_force, plane_force
from gearmbs.contact.centroid import centroid_force
from gearmbs.contact.deviations import add_deviations, pair_softness, set_corner, tip_string, tooth_record
from gearmbs.contact.face import LIMIT, face_limit
from gearmbs.contact.jit import kernel
from gearmbs.contact.lines import corner_on_plane, line_offset
from gearmbs.contact.node import contact_point, corner_normal, corner_start, flank_normal, section_gap, turn_normal
from gearmbs.contact.sums import add_friction, add_normal, mirror

RB, PSI, S_TIP, WHEEL = L.RB, L.PSI, L.S_TIP, L.WHEEL
NODE, N_GAP, N_GRAD, N_HESS, N_RATE, N_DRATE = L.NODE, L.N_GAP, L.N_GRAD, L.N_HESS, L.N_RATE, L.N_DRATE
N_FORCE, N_FX, N_S1, N_S2, N_KIND, N_ELASTIC = L.N_FORCE, L.N_FX, L.N_S1, L.N_S2, L.N_KIND, L.N_ELASTIC
PITCH, FRICTION, N_SLICES = L.PITCH, L.FRICTION, L.N_SLICES
ZETA_LO, ZETA_HI, GAP_MARGIN = L.ZETA_LO, L.ZETA_HI, L.GAP_MARGIN
S_A, S_H, S_P, S_Q, S_F1, S_F2, S_XD = L.S_X, L.S_X + 1, L.S_X + 2, L.S_X + 3, L.S_X + 4, L.S_X + 5, L.S_XD
S_W, S_A0, S_LENGTH, S_ALPHA, S_SIN, S_COS = L.S_W, L.S_A0, L.S_LENGTH, L.S_ALPHA, L.S_SIN, L.S_COS
S_SLOPE, S_CURVE, S_OVERHANG = L.S_SLOPE, L.S_CURVE, L.S_OVERHANG
NODES, LO, HI = L.W_NODES, L.W_LIMIT, L.W_LIMIT + LIMIT
TWO_PI = 2.0 * np.pi
NEAR_BASE = 0.01  # string over base radius below which an involute is too curved to bear on
CORNER_SLACK = 0.45  # share of the corner gap's parabola taken as its lower bound
STEEPEST = 3.0  # how much steeper the corner gap may grow than that bound


@kernel
def gap_rate(wk, o, want):
    """Rate of the gap under the pose rates, and its derivative by the pose."""
    rate = 0.0
    for i in range(6):
        rate += wk[o + N_GRAD + i] * wk[S_XD + i]
    wk[o + N_RATE] = rate
    if want != 0:
        for i in range(6):
            total = 0.0
            row = o + N_HESS + 6 * i
            for j in range(6):
                total += wk[row + j] * wk[S_XD + j]
            wk[o + N_DRATE + i] = total


@kernel
def set_normal(wk, alpha, sa, ca):
    wk[S_ALPHA] = alpha
    wk[S_SIN] = sa
    wk[S_COS] = ca


@kernel
def corner_section(gr, wk, kind, f1, f2, zeta, near, o, want):
    """Gap of the corner at work, the tip of wheel ``kind``, on the mate's flank.

    Close to its base circle and inside it the mate's flank goes on as its tangent plane. ``near`` tells that the
    running normal is already close; else it starts from parallel axes. Returns whether the running normal is the gap's.
    """
    mate = WHEEL if kind == 1 else 0
    rb = gr[mate + RB]
    start = (f2 if kind == 1 else f1) + gr[mate + PSI]
    r = wk[L.C_R]
    X, Y = line_offset(wk, -r * wk[L.C_COS], -r * wk[L.C_SIN], zeta)
    lean = wk[S_P] * X + wk[S_Q] * Y
    string2 = X * X + Y * Y - lean * lean - rb * rb
    if string2 > NEAR_BASE * NEAR_BASE * rb * rb:
        if not near:
            corner_start(wk, X, Y, rb)
        if corner_normal(wk, rb * start, rb, zeta):
            section_gap(gr, wk, kind, f1, f2, zeta, o, want)
            return True
    turned = start - NEAR_BASE
    corner_on_plane(wk, 2 - kind, turned, rb, NEAR_BASE * rb, zeta, o, want)
    wk[o + N_KIND] = kind
    wk[o + L.N_ALPHA] = -turned
    wk[o + L.N_SIN] = -np.sin(turned)
    wk[o + L.N_COS] = np.cos(turned)
    wk[o + N_S1] = wk[L.C_STRING] if kind == 1 else 0.0
    wk[o + N_S2] = wk[L.C_STRING] if kind == 2 else 0.0
    for i in range(6):
        wk[o + L.N_DALPHA + i] = 0.0
    wk[o + L.N_DALPHA + (5 if kind == 1 else 4)] = -1.0
    return False


@kernel
def clear_node(wk, o, want):
    """Set a node's force and its derivatives to nothing."""
    wk[o + N_FORCE] = 0.0
    wk[o + N_ELASTIC] = 0.0
    if want != 0:
        for i in range(12):
            wk[o + N_FX + i] = 0.0


@kernel
def copy_record(wk, source, target):
    for i in range(L.NODE):
        wk[target + i] = wk[source + i]


@kernel
def station(gi, gr, j, step):
    """Place of a node along the mean axis."""
    return 0.0 if gi[N_SLICES] == 1 else gr[ZETA_LO] + j * step


@kernel
def flank_pitch(gr, wk):
    """Index n of the tooth of wheel 2 facing tooth 0 of wheel 1: their sum is what the nominal gap depends on."""
    Rb = gr[RB] + gr[WHEEL + RB]
    base1 = gr[RB] * (wk[S_F1] + gr[PSI])
    base2 = gr[WHEEL + RB] * (wk[S_F2] + gr[WHEEL + PSI])
    return np.floor((wk[S_LENGTH] - Rb * wk[S_A0] - base1 - base2) / gr[PITCH] + 0.5)


@kernel
def open_side(gr, wk):
    """Set up what a side's pose implies; False when the base circles meet."""
    a, p, q = wk[S_A], wk[S_P], wk[S_Q]
    Rb = gr[RB] + gr[WHEEL + RB]
    if a <= Rb * 1.0001:
        return False
    length = np.sqrt(a * a - Rb * Rb)
    w = np.sqrt(1.0 - p * p - q * q)
    iw = 1.0 / w
    one = 1.0 / (1.0 + w)
    m = iw * one
    wk[S_W] = w
    wk[L.S_IW] = iw
    wk[L.S_IW3] = iw * iw * iw
    wk[L.S_IW5] = iw * iw * iw * iw * iw
    wk[L.S_ONE] = one
    wk[L.S_M] = m
    wk[L.S_MW] = -(1.0 + 2.0 * w) * m * m
    wk[L.S_MWW] = 2.0 * m * m * ((1.0 + 2.0 * w) ** 2 * m - 1.0)
    wk[S_LENGTH] = length
    wk[S_A0] = np.arctan2(length, Rb)
    wk[S_A0 + 1] = length / a
    wk[S_A0 + 2] = Rb / a
    return True


@kernel
def side_contacts(gi, gr, wk, side, diag, want):
    """Add every contact of one side of the teeth, seen so that wheel 1's counter-clockwise flanks press.

    Parameters
    ----------
    side : int
        +1 or -1, for the tables that name teeth and flanks; the pose at ``S_X`` is already mirrored for -1.

    Returns
    -------
    bool
        Whether the sums were mirrored to match, which is done for -1 once something may touch.
    """
    if not open_side(gr, wk):
        return False
    p, q, w, length, alpha0 = wk[S_P], wk[S_Q], wk[S_W], wk[S_LENGTH], wk[S_A0]
    rb1 = gr[RB]
    rb2 = gr[WHEEL + RB]
    Rb = rb1 + rb2
    pitch = gr[PITCH]
    n = flank_pitch(gr, wk)
    base1 = rb1 * (wk[S_F1] + gr[PSI])
    total = base1 + rb2 * (wk[S_F2] + gr[WHEEL + PSI]) + n * pitch
    step2 = TWO_PI / gi[L.Z2]
    slices = gi[N_SLICES]
    margin = gr[GAP_MARGIN]
    f1 = wk[S_F1]
    f2 = wk[S_F2] + n * step2

    # the gap over the face is convex: its tangent at the middle bounds the touching part
    middle = 0.0 if slices == 1 else 0.5 * (gr[ZETA_LO] + gr[ZETA_HI])
    set_normal(wk, alpha0, wk[S_A0 + 1], wk[S_A0 + 2])
    tilted = p != 0.0 or q != 0.0
    if tilted:
        flank_normal(wk, total, Rb, middle)
    alpha, sa, ca = wk[S_ALPHA], wk[S_SIN], wk[S_COS]
    ja = 0
    jb = 0
    step = 0.0
    turn = 2.0 * (q * sa - p * ca) / (w * length)
    if slices == 1:
        section_gap(gr, wk, 0, f1, f2, middle, NODES, want)
        deepest = margin - wk[NODES + N_GAP]
        if deepest <= 0.0:
            return False
        gap_rate(wk, NODES, want)
        wander = 0.0
    else:
        section_gap(gr, wk, 0, f1, f2, middle, NODES, 0)
        deepest = margin - wk[NODES + N_GAP]
        slope = 2.0 * (p * sa + q * ca) / w
        jb = slices
        step = (gr[ZETA_HI] - gr[ZETA_LO]) / slices
        # where a leaning or shifted wheel's end face goes beyond the slices, gaps are extrapolated
        overhang = abs(p) * wk[S_A] + abs(q) * max(rb1, rb2) + 0.5 * abs(wk[S_H] - gr[L.AXIAL_SHIFT])
        wk[S_OVERHANG] = overhang + gr[L.EDGE_BLEND]
        reach = 0.5 * (gr[ZETA_HI] - gr[ZETA_LO]) + wk[S_OVERHANG]
        if deepest + abs(slope) * reach <= 0.0:
            return False
        if deepest - abs(slope) * reach < 0.0:
            edge = (middle - deepest / slope - gr[ZETA_LO]) / step
            if slope > 0.0:
                ja = min(max(0, int(np.floor(edge))), slices - 1)
            else:
                jb = max(min(slices, int(np.floor(edge)) + 1), 1)
        deepest = 0.0
        before = middle
        for j in range(ja, jb + 1):
            zeta = gr[ZETA_LO] + j * step
            o = NODES + j * NODE
            if tilted:
                turn_normal(wk, wk[S_SLOPE] * (zeta - before))
                before = zeta
                flank_normal(wk, total, Rb, zeta)
            section_gap(gr, wk, 0, f1, f2, zeta, o, want)
            gap_rate(wk, o, want)
            deepest = max(deepest, margin - wk[o + N_GAP])
        if ja == 0:
            deepest = max(deepest, margin - beyond_end(wk, NODES, NODE, step))
        if jb == slices:
            deepest = max(deepest, margin - beyond_end(wk, NODES + slices * NODE, -NODE, step))
        if deepest <= 0.0:
            return False
        wander = max(rb1, rb2) * abs(turn) * (gr[ZETA_HI] - gr[ZETA_LO])

    if side < 0:
        mirror(wk)

    # how far beyond the path of contact a corner may still bear, from the parabola of the corner gap
    tip1 = gr[S_TIP]
    tip2 = gr[WHEEL + S_TIP]
    curve = CORNER_SLACK * min(
        length * tip1 / (2.0 * (length - tip1) * rb1 * rb1) if length > tip1 else 1e9,
        length * tip2 / (2.0 * (length - tip2) * rb2 * rb2) if length > tip2 else 1e9,
    )
    wk[S_CURVE] = curve
    beyond = min(pitch, np.sqrt(max(deepest, 0.0) / curve) + wander)
    first = np.ceil((length - tip2 - beyond - base1 - rb1 * alpha0) / pitch)
    last = np.floor((tip1 + beyond - base1 - rb1 * alpha0) / pitch)
    step1 = TWO_PI / gi[L.Z1]
    for i in range(int(first), int(last) + 1):
        f1 = wk[S_F1] + i * step1
        f2 = wk[S_F2] + (n - i) * step2
        depth = pair_contact(gi, gr, wk, side, i, int(n) - i, f1, f2, ja, jb, step, alpha, sa, ca, diag, want)
        if depth > 0.0:
            drive = side == gi[L.DRIVE]
            k = 3 if drive else 4
            diag[k] = max(diag[k], depth)
            diag[k + 2] += 1.0
    return side < 0


@kernel
def beyond_end(wk, o, inward, step):
    """Lower bound of the flanks' gap from an end node outwards; ``inward`` leads to the record next to it."""
    return wk[o + N_GAP] - max(0.0, wk[o + inward + N_GAP] - wk[o + N_GAP]) * wk[S_OVERHANG] / step


@kernel
def path_excess(gr, wk, o, shift):
    """How far beyond the path of contact a pair stands in a section, and the parabola its gap grows by at least."""
    x = max(wk[o + N_S1] + shift - gr[S_TIP], wk[o + N_S2] - shift - gr[WHEEL + S_TIP])
    return wk[S_CURVE] * x * x if x > 0.0 else 0.0


@kernel
def touching_range(gi, gr, wk, shift, ja, jb, step):
    """Nodes that may touch, and one more on either side: the gap is at least that of the flanks plus a parabola."""
    margin = gr[GAP_MARGIN]
    first = jb + 1
    last = ja - 1
    for j in range(ja, jb + 1):
        o = NODES + j * NODE
        if wk[o + N_GAP] + path_excess(gr, wk, o, shift) < margin:
            first = min(first, j)
            last = j
    slices = gi[N_SLICES]
    if slices > 1:
        share = STEEPEST * wk[S_OVERHANG] / step
        for end in range(2):
            if (ja > 0) if end == 0 else (jb < slices):
                continue
            o = NODES + (0 if end == 0 else slices * NODE)
            inward = NODE if end == 0 else -NODE
            grown = path_excess(gr, wk, o + inward, shift) - path_excess(gr, wk, o, shift)
            if beyond_end(wk, o, inward, step) - max(0.0, grown) * share < margin:
                first = min(first, 0 if end == 0 else slices)
                last = max(last, 0 if end == 0 else slices)
    return max(first - 1, ja), min(last + 1, jb)


@kernel
def pair_sections(gi, gr, wk, side, i1, i2, f1, f2, ja, jb, step, alpha, sa, ca, want):
    """Choose and fill the node records of one tooth pair; returns whether any of them has a negative gap."""
    slices = gi[N_SLICES]
    own = NODES + (slices + 1) * NODE
    sel = NODES + 2 * (slices + 1) * NODE
    teeth = gi[L.O_TOOTH] != 0
    record1 = tooth_record(gi, 0, side, i1) if teeth else 0
    record2 = tooth_record(gi, 1, side, i2) if teeth else 0
    tip1 = gr[S_TIP]
    tip2 = gr[WHEEL + S_TIP]
    shift = gr[RB] * (f1 - wk[S_F1])
    touching = False
    last_kind = 0
    last_string = 0.0
    for j in range(ja, jb + 1):
        o = NODES + j * NODE
        s1 = wk[o + N_S1] + shift
        s2 = wk[o + N_S2] - shift
        zeta = station(gi, gr, j, step)
        if teeth:
            tip1 = tip_string(gi, gr, 0, record1, zeta)
            tip2 = tip_string(gi, gr, 1, record2, zeta)
        kind = 0
        if s1 - tip1 > s2 - tip2:
            if s1 > tip1:
                kind = 1
        elif s2 > tip2:
            kind = 2
        if kind != 0:
            o = own + j * NODE
            string = tip1 if kind == 1 else tip2
            near = kind == last_kind and string == last_string
            if kind != last_kind or string != last_string:
                set_corner(gr, wk, kind - 1, f1 if kind == 1 else f2, string)
            if near:
                turn_normal(wk, wk[S_SLOPE] * step)
            else:
                set_normal(wk, alpha, sa, ca)
            if not corner_section(gr, wk, kind, f1, f2, zeta, near, o, want):
                string = 0.0
            last_string = string
        last_kind = kind
        if teeth:
            if kind == 0:
                copy_record(wk, o, own + j * NODE)
                o = own + j * NODE
                wk[o + N_S1] = s1
                wk[o + N_S2] = s2
            add_deviations(gi, gr, wk, record1, record2, kind, f1, f2, zeta, o, want)
        if kind != 0 or teeth:
            gap_rate(wk, o, want)
        wk[sel + j] = o
        clear_node(wk, o, want)
        if wk[o + N_GAP] < 0.0:
            touching = True
    return touching


@kernel
def pair_contact(gi, gr, wk, side, i1, i2, f1, f2, ja, jb, step, alpha, sa, ca, diag, want):
    """Add the contact of one tooth pair over the nodes ``ja``..``jb``; returns its largest penetration."""
    slices = gi[N_SLICES]
    ja, jb = touching_range(gi, gr, wk, gr[RB] * (f1 - wk[S_F1]), ja, jb, step)
    if jb < ja:
        return 0.0
    touching = pair_sections(gi, gr, wk, side, i1, i2, f1, f2, ja, jb, step, alpha, sa, ca, want)
    if not touching and (slices == 1 or (ja > 0 and jb < slices)):
        return 0.0
    soft = 1.0
    varying = gi[L.O_COMPLIANCE] != 0
    if varying:
        record1 = tooth_record(gi, 0, side, i1) if gi[L.O_TOOTH] != 0 else 0
        record2 = tooth_record(gi, 1, side, i2) if gi[L.O_TOOTH] != 0 else 0
        pair_softness(gi, gr, wk, record1, record2, f1, f2, want)
        soft = wk[L.P_SOFT]
    sel = NODES + 2 * (slices + 1) * NODE
    energy = diag[0]
    if slices == 1:
        depth = plane_force(gi, gr, wk, int(wk[sel]), soft, diag, want)
    else:
        face_limit(-1.0, gr, wk, f1, f2, LO, want)
        face_limit(1.0, gr, wk, f1, f2, HI, want)
        if gi[L.LOAD] == L.LOAD_ADAMS:
            depth = centroid_force(gi, gr, wk, sel, ja, jb, step, soft, diag, want)
        else:
            depth = face_forces(gi, gr, wk, sel, ja, jb, step, soft, diag, want)
    if depth <= 0.0:
        return 0.0
    if varying:
        add_softness(gi, wk, sel, ja, jb, diag[0] - energy, want)
    for j in range(ja, jb + 1):
        o = int(wk[sel + j])
        if wk[o + N_FORCE] != 0.0:
            diag[7] += wk[o + N_FORCE]
            add_normal(wk, o, want)
            if gi[FRICTION] != 0:
                zeta = station(gi, gr, j, step)
                kind = int(wk[o + N_KIND])
                if kind == 1:
                    set_corner(gr, wk, 0, f1, wk[o + N_S1])
                contact_point(gr, wk, kind, f1, zeta, o, want)
                add_friction(gi, gr, wk, o, zeta + 0.5 * wk[S_H], diag, want)
    return depth


@kernel
def add_softness(gi, wk, sel, ja, jb, energy, want):
    """Complete the derivatives of nodal forces, and add the force of a stiffness that varies along the path."""
    ratio = energy / wk[L.P_SOFT]
    for i in range(6):
        wk[L.Q_ + i] -= ratio * wk[L.P_SOFT_X + i]
    if want == 0:
        return
    for i in range(36):
        wk[L.H_ + i] -= ratio * wk[L.P_SOFT_XX + i]
    if gi[L.LOAD] == L.LOAD_ADAMS and gi[N_SLICES] > 1:
        for i in range(6):
            for k in range(6):
                wk[L.H_ + 6 * i + k] -= wk[L.P_MOVED + k] / wk[L.P_SOFT] * wk[L.P_SOFT_X + i]
    for j in range(ja, jb + 1):
        o = int(wk[sel + j])
        force = wk[o + N_FORCE] / wk[L.P_SOFT]
        elastic = wk[o + N_ELASTIC] / wk[L.P_SOFT]
        for k in range(6):
            wk[o + N_FX + k] += force * wk[L.P_SOFT_X + k]
            for i in range(6):
                wk[L.H_ + 6 * i + k] += elastic * wk[o + N_GRAD + k] * wk[L.P_SOFT_X + i]


@kernel
def face_forces(gi, gr, wk, sel, ja, jb, step, soft, diag, want):
    """Integrate the pressure of a pair over the slices ``ja``..``jb``; returns the largest penetration."""
    slices = gi[N_SLICES]
    lo = (wk[LO] - gr[ZETA_LO]) / step
    hi = (wk[HI] - gr[ZETA_LO]) / step
    depth = 0.0
    for j in range(ja, jb):
        ua = lo - j
        ub = hi - j
        if (ua >= 1.0 and j < slices - 1) or (ub <= 0.0 and j > 0):
            continue
        lo_moves = ua > 0.0 or j == 0
        hi_moves = ub < 1.0 or j == slices - 1
        if not lo_moves:
            ua = 0.0
        if not hi_moves:
            ub = 1.0
        if ub <= ua:
            continue
        o0 = int(wk[sel + j])
        o1 = int(wk[sel + j + 1])
        if wk[o0 + N_GAP] >= 0.0 and wk[o1 + N_GAP] >= 0.0 and ua >= 0.0 and ub <= 1.0:
            continue
        depth = max(depth, cell_force(gi, gr, wk, o0, o1, step, ua, ub, lo_moves, hi_moves, soft, diag, want))
        if lo_moves:
            end_force(gi, gr, wk, o0, o1, step, ua, -1.0, LO, soft, want)
        if hi_moves:
            end_force(gi, gr, wk, o0, o1, step, ub, 1.0, HI, soft, want)
    return depth
