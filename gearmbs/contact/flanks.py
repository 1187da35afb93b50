"""All tooth pairs of one side of the teeth: which are in reach, how they touch, and what force that gives."""

from __future__ import annotations

import numpy as np
from numba import njit

from gearmbs.contact import layout as L
from gearmbs.contact.cells import cell_force, end_force, plane_force
from gearmbs.contact.face import LIMIT, face_limit
from gearmbs.contact.node import contact_point, corner_normal, corner_start, flank_normal, section_gap
from gearmbs.contact.sums import add_friction, add_normal

RB, PSI, S_TIP, WHEEL = L.RB, L.PSI, L.S_TIP, L.WHEEL
R_CORNER, PSI_CORNER, R_ROUND = L.R_CORNER, L.PSI_CORNER, L.R_ROUND
NODE, N_GAP, N_GRAD, N_HESS, N_RATE, N_DRATE = L.NODE, L.N_GAP, L.N_GRAD, L.N_HESS, L.N_RATE, L.N_DRATE
N_FORCE, N_FX, N_FV, N_S1, N_S2, N_ALPHA = L.N_FORCE, L.N_FX, L.N_FV, L.N_S1, L.N_S2, L.N_ALPHA
PITCH, FRICTION, N_SLICES = L.PITCH, L.FRICTION, L.N_SLICES
ZETA_LO, ZETA_HI, GAP_MARGIN = L.ZETA_LO, L.ZETA_HI, L.GAP_MARGIN
TWO_PI = 2.0 * np.pi
NO_CONTACT = 1.0  # a gap, m, for profiles that cannot meet


@njit(cache=True)
def gap_rate(nodes, o, xd, want):
    """Rate of the gap under the pose rates ``xd``, and its derivative by the pose."""
    rate = 0.0
    for i in range(6):
        rate += nodes[o + N_GRAD + i] * xd[i]
    nodes[o + N_RATE] = rate
    if want != 0:
        for i in range(6):
            total = 0.0
            row = o + N_HESS + 6 * i
            for j in range(6):
                total += nodes[row + j] * xd[j]
            nodes[o + N_DRATE + i] = total


@njit(cache=True)
def corner_section(gr, kind, x, w, f1, f2, zeta, alpha, nodes, o, sup, want):
    """Gap of the tip corner of wheel ``kind`` on the mate's flank; the record at ``nodes[o:]`` is filled."""
    if kind == 1:
        mate = WHEEL
        own = 0
        f = f1
        g = f2
    else:
        mate = 0
        own = WHEEL
        f = f2
        g = f1
    eta = f + gr[own + PSI_CORNER]
    se = np.sin(eta)
    ce = np.cos(eta)
    rb = gr[mate + RB]
    start = corner_start(x[0], rb, se, ce, gr[own + R_CORNER])
    if start != start:
        nodes[o + N_GAP] = NO_CONTACT
        nodes[o + L.N_KIND] = kind
        for i in range(o + N_GRAD, o + L.N_DALPHA):
            nodes[i] = 0.0
        return
    s0 = rb * (g + gr[mate + PSI])
    alpha = corner_normal(x[0], x[2], x[3], w, s0, rb, se, ce, gr[own + R_CORNER], gr[own + R_ROUND], zeta, start)
    section_gap(gr, kind, x, w, f1, f2, zeta, alpha, nodes, o, sup, want)


@njit(cache=True)
def clear_force(nodes, o, want):
    nodes[o + N_FORCE] = 0.0
    if want != 0:
        for i in range(12):
            nodes[o + N_FX + i] = 0.0


@njit(cache=True)
def side_contacts(gi, gr, side, x, xd, V, sums, diag, want, nodes, sel, sup, limits):
    """Add every contact of one side of the teeth, seen so that wheel 1's counter-clockwise flanks press.

    Parameters
    ----------
    side : int
        +1 or -1, for the tables that name teeth and flanks; pose and twist are already mirrored for -1.
    x, xd, V : ndarray, shape (6,)
        Pose numbers, their rates, relative twist in the mean frame.
    sums, diag : ndarray
        Accumulators.
    nodes, sel, sup, limits : ndarray
        Scratch.
    """
    a, p, q = x[0], x[2], x[3]
    w = np.sqrt(1.0 - p * p - q * q)
    rb1 = gr[RB]
    rb2 = gr[WHEEL + RB]
    Rb = rb1 + rb2
    if a <= Rb * 1.0001:
        return
    length = np.sqrt(a * a - Rb * Rb)
    alpha0 = np.arctan2(length, Rb)
    pitch = gr[PITCH]
    base1 = rb1 * (x[4] + gr[PSI])
    base2 = rb2 * (x[5] + gr[WHEEL + PSI])
    n = np.floor((length - Rb * alpha0 - base1 - base2) / pitch + 0.5)
    total = base1 + base2 + n * pitch
    step1 = TWO_PI / gi[L.Z1]
    step2 = TWO_PI / gi[L.Z2]
    slices = gi[N_SLICES]
    margin = gr[GAP_MARGIN]
    f2_n = x[5] + n * step2

    # the gap over the face is convex: its tangent at the middle bounds the touching part
    middle = 0.0 if slices == 1 else 0.5 * (gr[ZETA_LO] + gr[ZETA_HI])
    alpha = flank_normal(a, p, q, w, total, Rb, middle, alpha0)
    section_gap(gr, 0, x, w, x[4], f2_n, middle, alpha, nodes, 0, sup, want if slices == 1 else 0)
    deepest = margin - nodes[N_GAP]
    sa = nodes[L.N_SIN]
    ca = nodes[L.N_COS]
    slope = 2.0 * (p * sa + q * ca) / w
    ja = 0
    jb = 0
    step = 0.0
    if slices == 1:
        if deepest <= 0.0:
            return
        gap_rate(nodes, 0, xd, want)
    else:
        jb = slices
        step = (gr[ZETA_HI] - gr[ZETA_LO]) / slices
        reach = 0.5 * (gr[ZETA_HI] - gr[ZETA_LO]) + step
        if deepest + abs(slope) * reach <= 0.0:
            return
        if deepest - abs(slope) * reach < 0.0:
            edge = -deepest / slope + middle
            if slope > 0.0:
                ja = max(0, int(np.floor((edge - gr[ZETA_LO]) / step)))
            else:
                jb = min(slices, int(np.floor((edge - gr[ZETA_LO]) / step)) + 1)
        ja = min(ja, slices - 1)
        jb = max(jb, 1)
        turn = 2.0 * (p * ca - q * sa) / (w * -length)
        deepest = 0.0
        for j in range(ja, jb + 1):
            zeta = gr[ZETA_LO] + j * step
            at = flank_normal(a, p, q, w, total, Rb, zeta, alpha + turn * (zeta - middle))
            section_gap(gr, 0, x, w, x[4], f2_n, zeta, at, nodes, j * NODE, sup, want)
            gap_rate(nodes, j * NODE, xd, want)
            deepest = max(deepest, margin - nodes[j * NODE + N_GAP])
        if deepest <= 0.0 and ja > 0 and jb < slices:
            return

    tip1 = gr[S_TIP]
    tip2 = gr[WHEEL + S_TIP]
    # how far beyond the path of contact a corner may still bear, from the parabola of the corner gap
    curve = min(
        length * tip1 / (2.0 * (length - tip1) * rb2 * rb2) if length > tip1 else 1e9,
        length * tip2 / (2.0 * (length - tip2) * rb1 * rb1) if length > tip2 else 1e9,
    )
    beyond = min(
        pitch, np.sqrt(max(deepest, 1e-9) / (0.3 * curve)) + abs(turn_over_face(p, q, w, length, gr, slices, Rb))
    )
    first = np.ceil((length - tip2 - beyond - base1 - rb1 * alpha0) / pitch)
    last = np.floor((tip1 + beyond - base1 - rb1 * alpha0) / pitch)
    for i in range(int(first), int(last) + 1):
        f1 = x[4] + i * step1
        f2 = x[5] + (n - i) * step2
        depth = pair_contact(
            gi, gr, side, i, x, xd, V, w, f1, f2, ja, jb, step, alpha, sums, diag, want, nodes, sel, sup, limits
        )
        if depth > 0.0:
            if side == gi[L.DRIVE]:
                diag[3] = max(diag[3], depth)
                diag[5] += 1.0
            else:
                diag[4] = max(diag[4], depth)
                diag[6] += 1.0


@njit(cache=True)
def turn_over_face(p, q, w, length, gr, slices, Rb):
    """Bound on how far tilt moves the contact along the profile between mid-face and an end of the face."""
    if slices == 1:
        return 0.0
    return Rb * np.sqrt(p * p + q * q) / w * 2.0 * (gr[ZETA_HI] - gr[ZETA_LO]) / length


@njit(cache=True)
def pair_contact(
    gi, gr, side, tooth, x, xd, V, w, f1, f2, ja, jb, step, alpha, sums, diag, want, nodes, sel, sup, limits
):
    """Add the contact of one tooth pair over the nodes ``ja``..``jb``; returns its largest penetration."""
    slices = gi[N_SLICES]
    tip1 = gr[S_TIP]
    tip2 = gr[WHEEL + S_TIP]
    own = (slices + 1) * NODE
    friction = gi[FRICTION] != 0
    touching = False
    shift1 = gr[RB] * (f1 - x[4])
    for j in range(ja, jb + 1):
        o = j * NODE
        s1 = nodes[o + N_S1] + shift1
        s2 = nodes[o + N_S2] - shift1
        kind = 0
        if s1 - tip1 > s2 - tip2:
            if s1 > tip1:
                kind = 1
        elif s2 > tip2:
            kind = 2
        if kind != 0:
            o += own
            zeta = gr[ZETA_LO] + j * step if slices > 1 else 0.0
            corner_section(gr, kind, x, w, f1, f2, zeta, alpha, nodes, o, sup, want)
            gap_rate(nodes, o, xd, want)
        sel[j] = o
        clear_force(nodes, o, want)
        if nodes[o + N_GAP] < 0.0:
            touching = True
    if not touching and slices == 1:
        return 0.0
    depth = 0.0
    if slices == 1:
        depth = plane_force(gi, gr, nodes, int(sel[0]), 1.0, diag, want)
    else:
        depth = face_forces(gi, gr, x, w, f1, f2, ja, jb, step, sums, diag, want, nodes, sel, limits)
    if depth <= 0.0:
        return 0.0
    for j in range(ja, jb + 1):
        o = int(sel[j])
        if nodes[o + N_FORCE] > 0.0:
            diag[7] += nodes[o + N_FORCE]
            add_normal(nodes, o, sums, want)
            if friction:
                zeta = gr[ZETA_LO] + j * step if slices > 1 else 0.0
                contact_point(gr, int(nodes[o + L.N_KIND]), x, w, f1, zeta, nodes, o, sup, want)
                add_friction(gi, gr, nodes, o, zeta + 0.5 * x[1], V, sums, diag, want)
    return depth


@njit(cache=True)
def face_forces(gi, gr, x, w, f1, f2, ja, jb, step, sums, diag, want, nodes, sel, limits):
    """Integrate the pressure of a pair over the slices ``ja``..``jb``; returns the largest penetration."""
    slices = gi[N_SLICES]
    z0 = gr[ZETA_LO]
    face_limit(-1.0, gr, x, w, f1, f2, limits, 0, want)
    face_limit(1.0, gr, x, w, f1, f2, limits, LIMIT, want)
    lo = limits[0]
    hi = limits[LIMIT]
    depth = 0.0
    for j in range(ja, jb):
        o0 = int(sel[j])
        o1 = int(sel[j + 1])
        ua = (lo - z0) / step - j
        ub = (hi - z0) / step - j
        lo_moves = (ua > 0.0 or j == 0) and ua < 1.0
        hi_moves = (ub < 1.0 or j == slices - 1) and ub > 0.0
        if (ua >= 1.0 and j < slices - 1) or (ub <= 0.0 and j > 0):
            continue
        if not lo_moves:
            ua = 0.0
        if not hi_moves:
            ub = 1.0
        if ub <= ua:
            continue
        depth = max(
            depth,
            cell_force(gi, gr, nodes, o0, o1, step, ua, ub, lo_moves, hi_moves, limits, 1.0, diag, want),
        )
        if lo_moves:
            end_force(gi, gr, nodes, o0, o1, step, ua, -1.0, limits, 0, 1.0, sums, want)
        if hi_moves:
            end_force(gi, gr, nodes, o0, o1, step, ub, 1.0, limits, LIMIT, 1.0, sums, want)
    return depth
