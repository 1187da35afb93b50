"""What single teeth do differently: material missing from a flank, a shorter tip, a softer tooth.

A deviation is the thickness of material removed along the normal (negative: added), so it adds to the gap. It is
looked up where the contact stands on the profile, with the derivatives of that place by the pose.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel

S_X, S_LENGTH, P_DEV = L.S_X, L.S_LENGTH, L.P_DEV
P_DEV_2 = L.W_LIMIT  # the other wheel's lookup, in the limits' records, free between calls
SHORTEST = 0.01  # string over base radius where the lookup ends towards the base circle
N_GAP, N_GRAD, N_HESS = L.N_GAP, L.N_GRAD, L.N_HESS
P_SOFT, P_SOFT_X, P_SOFT_XX = L.P_SOFT, L.P_SOFT_X, L.P_SOFT_XX
RB, PSI, WHEEL = L.RB, L.PSI, L.WHEEL


@kernel
def tooth_record(gi, wheel, side, tooth):
    """Index of a tooth flank among all tooth flanks of the pair; wheel 0 or 1, side +1 or -1, tooth any integer."""
    z = gi[L.Z1 + wheel]
    index = (side * tooth) % z
    if side < 0:
        index += z
    if wheel == 1:
        index += 2 * gi[L.Z1]
    return index


@kernel
def contact_string(gr, wk, wheel, kind, f1, f2, zeta, o, V, want):
    """String length of the contact on one wheel, with gradient and Hessian by the pose, into ``wk[V:]``.

    The place is half-way between the surfaces. Flank on flank it is that of parallel axes moved by the tilt to first
    order; under a corner it is where the corner stands, less half the gap of perfect profiles in the record at
    ``wk[o:]``. Both agree where the one takes over from the other.
    """
    for i in range(1, 43 if want != 0 else 7):
        wk[V + i] = 0.0
    a = wk[S_X]
    rb1 = gr[RB]
    rb2 = gr[WHEEL + RB]
    G = V + 1
    T = V + 7
    if kind == 0:
        Rb = rb1 + rb2
        l = wk[S_LENGTH]
        alpha = wk[L.S_A0]
        sign = 1.0 if wheel == 0 else -1.0
        own = rb1 if wheel == 0 else rb2
        p, q = wk[S_X + 2], wk[S_X + 3]
        diff = 0.5 * sign * (rb1 * (f1 + gr[PSI]) - rb2 * (f2 + gr[WHEEL + PSI]) + (rb1 - rb2) * alpha)
        k1 = Rb / (a * l)
        turn = 2.0 * zeta * own
        wk[V] = diff + 0.5 * l + turn * (q / a - p * k1)
        k1_a = -Rb * (1.0 / (a * a * l) + 1.0 / l**3)
        slope = 0.5 * sign * (rb1 - rb2)
        wk[G] = slope * k1 + 0.5 * a / l + turn * (-q / (a * a) - p * k1_a)
        wk[G + 2] = -turn * k1
        wk[G + 3] = turn / a
        wk[G + 4] = 0.5 * sign * rb1
        wk[G + 5] = -0.5 * sign * rb2
        if want != 0:
            k1_aa = Rb * (2.0 / (a**3 * l) + 1.0 / (a * l**3) + 3.0 * a / l**5)
            wk[T] = slope * k1_a - 0.5 * Rb * Rb / l**3 + turn * (2.0 * q / a**3 - p * k1_aa)
            wk[T + 2] = -turn * k1_a
            wk[T + 12] = wk[T + 2]
            wk[T + 3] = -turn / (a * a)
            wk[T + 18] = wk[T + 3]
        return
    half = 0.5 if kind == wheel + 1 else -0.5
    wk[V] = half * wk[o + N_GAP]
    for i in range(6):
        wk[G + i] = half * wk[o + N_GRAD + i]
        if want != 0:
            for j in range(6):
                wk[T + 6 * i + j] = half * wk[o + N_HESS + 6 * i + j]
    if kind == wheel + 1:
        wk[V] += wk[L.C_STRING]
        return
    mate = rb1 if wheel == 0 else rb2
    f = 5 if wheel == 0 else 4
    r = wk[L.C_R]
    se, ce = wk[L.C_SIN], wk[L.C_COS]
    Px = a - r * ce - 2.0 * wk[S_X + 2] * zeta
    Py = -r * se - 2.0 * wk[S_X + 3] * zeta
    s2 = Px * Px + Py * Py - mate * mate
    if s2 < SHORTEST * SHORTEST * mate * mate:
        wk[V] += SHORTEST * mate - wk[L.C_ROUND]
        return
    s = np.sqrt(s2)
    wk[V] += s - wk[L.C_ROUND]
    i_s = 1.0 / s
    for i in range(6):
        dx = 1.0 if i == 0 else (-2.0 * zeta if i == 2 else (r * se if i == f else 0.0))
        dy = -2.0 * zeta if i == 3 else (-r * ce if i == f else 0.0)
        by_i = (Px * dx + Py * dy) * i_s
        wk[G + i] += by_i
        if want == 0:
            continue
        for j in range(6):
            ex = 1.0 if j == 0 else (-2.0 * zeta if j == 2 else (r * se if j == f else 0.0))
            ey = -2.0 * zeta if j == 3 else (-r * ce if j == f else 0.0)
            value = dx * ex + dy * ey - by_i * (Px * ex + Py * ey) * i_s
            if i == f and j == f:
                value += r * (Px * ce + Py * se)
            wk[T + 6 * i + j] += value * i_s


@kernel
def cubic(gr, o, n, u):
    """Value and first two derivatives, per station, of the curve ``gr[o:o+n]`` at ``u`` stations: Catmull-Rom.

    Beyond its ends the curve keeps its end value.
    """
    if u <= 0.0:
        return gr[o], 0.0, 0.0
    if u >= n - 1.0:
        return gr[o + n - 1], 0.0, 0.0
    k = int(u)
    t = u - k
    y1 = gr[o + k]
    y2 = gr[o + k + 1]
    m1 = 0.0 if k == 0 else 0.5 * (y2 - gr[o + k - 1])
    m2 = 0.0 if k == n - 2 else 0.5 * (gr[o + k + 2] - y1)
    d = y2 - y1
    c2 = 3.0 * d - 2.0 * m1 - m2
    c3 = m1 + m2 - 2.0 * d
    return y1 + t * (m1 + t * (c2 + t * c3)), m1 + t * (2.0 * c2 + 3.0 * t * c3), 2.0 * c2 + 6.0 * t * c3


@kernel
def shape_value(gi, gr, wheel, shape, s, z):
    """A deviation shape at string length ``s`` and face position ``z`` (from -1 to 1): value, slopes, curvatures.

    Returns
    -------
    value, by s, by z, by s twice, by s and z : float
        Linear in z between stations and beyond the ends.
    """
    ns = gi[L.SHAPE_S]
    nz = gi[L.SHAPE_Z]
    ds = gr[wheel * WHEEL + L.SHAPE_DS]
    u = (s - gr[wheel * WHEEL + L.SHAPE_S0]) / ds
    v = 0.5 * (z + 1.0) * (nz - 1)
    k = min(max(int(v), 0), nz - 2)
    t = v - k
    o = gi[L.O_SHAPE] + (shape * nz + k) * ns
    y0, d0, c0 = cubic(gr, o, ns, u)
    y1, d1, c1 = cubic(gr, o + ns, ns, u)
    dz = 0.5 * (nz - 1)
    return (
        y0 + t * (y1 - y0),
        (d0 + t * (d1 - d0)) / ds,
        (y1 - y0) * dz,
        (c0 + t * (c1 - c0)) / (ds * ds),
        (d1 - d0) * dz / ds,
    )


@kernel
def add_deviations(gi, gr, wk, record1, record2, kind, f1, f2, zeta, o, want):
    """Add both wheels' deviations to the gap in the node record at ``wk[o:]`` and to its derivatives."""
    # both places on the profiles follow from the gap of perfect ones, so they are found before it changes
    for wheel in range(2):
        if tooth_shape(gi, record1 if wheel == 0 else record2) >= 0:
            contact_string(gr, wk, wheel, kind, f1, f2, zeta, o, P_DEV if wheel == 0 else P_DEV_2, want)
    for wheel in range(2):
        record = record1 if wheel == 0 else record2
        wk[o + N_GAP] += gr[gi[L.O_OFFSET] + record]
        shape = tooth_shape(gi, record)
        if shape >= 0:
            add_shape(gi, gr, wk, wheel, shape, zeta, o, P_DEV if wheel == 0 else P_DEV_2, want)


@kernel
def tooth_shape(gi, record):
    """Number of a tooth flank's deviation shape, -1 for a perfect one."""
    return gi[gi[L.O_TOOTH] + L.TOOTH * record]


@kernel
def add_shape(gi, gr, wk, wheel, shape, zeta, o, V, want):
    """Add a deviation shape at the place in ``wk[V:]`` to the gap in the node record at ``wk[o:]``."""
    sign = 1.0 if wheel == 0 else -1.0
    scale = 2.0 / gr[wheel * WHEEL + L.FACE]
    z = (zeta + sign * 0.5 * wk[S_X + 1]) * scale
    value, by_s, by_z, by_ss, by_sz = shape_value(gi, gr, wheel, shape, wk[V], z)
    z_h = 0.5 * sign * scale
    wk[o + N_GAP] += value
    G = V + 1
    for i in range(6):
        wk[o + N_GRAD + i] += by_s * wk[G + i]
    wk[o + N_GRAD + 1] += by_z * z_h
    if want == 0:
        return
    for i in range(6):
        for j in range(6):
            wk[o + N_HESS + 6 * i + j] += by_ss * wk[G + i] * wk[G + j] + by_s * wk[V + 7 + 6 * i + j]
        mixed = by_sz * z_h * wk[G + i]
        wk[o + N_HESS + 6 * i + 1] += mixed
        wk[o + N_HESS + 6 + i] += mixed


@kernel
def tip_string(gi, gr, wheel, record, zeta):
    """String length where a tooth's flank ends at a station: its own if broken or chipped there, else the wheel's.

    Stations count from the wheels' axial places in the drawing; axial vibration does not move them.
    """
    whole = gr[wheel * WHEEL + L.S_TIP]
    if gi[L.O_TOOTH] == 0:
        return whole
    tip = gi[gi[L.O_TOOTH] + L.TOOTH * record + 1]
    if tip < 0:
        return whole
    nz = gi[L.SHAPE_Z]
    sign = 1.0 if wheel == 0 else -1.0
    z = (zeta + sign * 0.5 * gr[L.AXIAL_SHIFT]) * 2.0 / gr[wheel * WHEEL + L.FACE]
    v = min(max(0.5 * (z + 1.0) * (nz - 1), 0.0), nz - 1.0)
    k = min(int(v), nz - 2)
    o = gi[L.O_TIP] + tip * nz + k
    return gr[o] + (v - k) * (gr[o + 1] - gr[o])


@kernel
def set_corner(gr, wk, wheel, f, string):
    """Make the tip corner of a tooth the one at work: at the wheel's own tip, or sharp at a shorter ``string``."""
    base = wheel * WHEEL
    if string >= gr[base + L.S_TIP]:
        psi = gr[base + L.PSI_CORNER]
        wk[L.C_R] = gr[base + L.R_CORNER]
        wk[L.C_ROUND] = gr[base + L.R_ROUND]
        wk[L.C_STRING] = gr[base + L.S_TIP]
    else:
        rb = gr[base + RB]
        tan = string / rb
        psi = gr[base + PSI] - tan + np.arctan(tan)
        wk[L.C_R] = np.sqrt(rb * rb + string * string)
        wk[L.C_ROUND] = 0.0
        wk[L.C_STRING] = string
    wk[L.C_PSI] = psi
    wk[L.C_SIN] = np.sin(f + psi)
    wk[L.C_COS] = np.cos(f + psi)


@kernel
def pair_softness(gi, gr, wk, record1, record2, f1, f2, want):
    """Stiffness factor of a tooth pair from relative compliances along its profiles, with derivatives.

    The factor is one over the sum of the pair's own curve and of what each of the two teeth adds to it, looked up
    where parallel flanks would touch.
    """
    n = gi[L.N_COMPLIANCE]
    base = gi[L.O_COMPLIANCE]
    contact_string(gr, wk, 0, 0, f1, f2, 0.0, 0, P_DEV, want)
    ds = gr[L.COMPLIANCE_DS]
    u = (wk[P_DEV] - gr[L.COMPLIANCE_S0]) / ds
    total, slope, curve = cubic(gr, base, n, u)
    for k in range(2):
        record = record1 if k == 0 else record2
        if gi[L.O_TOOTH] != 0:
            number = gi[gi[L.O_TOOTH] + L.TOOTH * record + 2]
            if number >= 0:
                value, d1, d2 = cubic(gr, base + (1 + number) * n, n, u)
                total += value
                slope += d1
                curve += d2
    slope /= ds
    curve /= ds * ds
    m = 1.0 / total
    wk[P_SOFT] = m
    m1 = -slope * m * m
    m2 = (2.0 * slope * slope * m - curve) * m * m
    for i in range(6):
        wk[P_SOFT_X + i] = m1 * wk[P_DEV + 1 + i]
    if want != 0:
        for i in range(6):
            for j in range(6):
                outer = wk[P_DEV + 1 + i] * wk[P_DEV + 1 + j]
                wk[P_SOFT_XX + 6 * i + j] = m2 * outer + m1 * wk[P_DEV + 7 + 6 * i + j]
