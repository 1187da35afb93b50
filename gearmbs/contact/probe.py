"""Gaps of all tooth pairs in reach, section by section: for placement, pictures and checks (not for time loops)."""

from __future__ import annotations

import numpy as np
from numba import njit

from gearmbs.contact import layout as L
from gearmbs.contact.face import LIMIT, face_limit
from gearmbs.contact.flanks import corner_section
from gearmbs.contact.node import contact_point, flank_normal, section_gap
from gearmbs.contact.pose import relative_pose

COLUMNS = ("side", "tooth_1", "tooth_2", "station", "gap", "kind", "string_1", "string_2", "normal", "tangent", "alpha")


@njit(cache=True)
def pair_gaps(gi, gr, R1, A1, R2, A2, stations, rows, work):
    """Gap of every tooth pair within one pitch of the path of contact, both sides, at stations along the face.

    Parameters
    ----------
    gi, gr, work : ndarray
        As for ``gear_contact``.
    R1, A1, R2, A2 : ndarray
        Poses of the wheels.
    stations : ndarray
        Positions along the mean axis from mid-way between the wheels, m; if empty, the ends of the common face.
    rows : ndarray, shape (n, 11)
        Out, columns as in ``COLUMNS``: side (+1, -1), tooth numbers, station, gap m, kind (0 flank on flank, 1 or 2
        the wheel whose corner bears), string lengths on both wheels m, contact point from the centre of wheel 1 along
        normal and tangent m, operating angle of the normal rad (mirrored for side -1).

    Returns
    -------
    int
        Number of rows filled.
    """
    x = np.zeros(6)
    M = np.zeros((3, 3))
    if not relative_pose(R1, A1, R2, A2, x, M):
        return 0
    rb1 = gr[L.RB]
    rb2 = gr[L.WHEEL + L.RB]
    Rb = rb1 + rb2
    a = x[0]
    if a <= Rb * 1.0001:
        return 0
    length = np.sqrt(a * a - Rb * Rb)
    alpha0 = np.arctan2(length, Rb)
    pitch = gr[L.PITCH]
    sup = work[L.W_SUP : L.W_SUP + 30]
    limits = work[L.W_LIMIT : L.W_LIMIT + 4 * LIMIT]
    rec = work[L.W_NODES : L.W_NODES + L.NODE]
    tip1 = gr[L.S_TIP]
    tip2 = gr[L.WHEEL + L.S_TIP]
    z1 = gi[L.Z1]
    z2 = gi[L.Z2]
    count = 0
    for side in (1, -1):
        if side == -1:
            for i in range(3, 6):
                x[i] = -x[i]
        p, q = x[2], x[3]
        w = np.sqrt(1.0 - p * p - q * q)
        base1 = rb1 * (x[4] + gr[L.PSI])
        base2 = rb2 * (x[5] + gr[L.WHEEL + L.PSI])
        n = int(np.floor((length - Rb * alpha0 - base1 - base2) / pitch + 0.5))
        first = int(np.ceil((length - tip2 - base1 - rb1 * alpha0) / pitch)) - 1
        last = int(np.floor((tip1 - base1 - rb1 * alpha0) / pitch)) + 1
        for i in range(first, last + 1):
            f1 = x[4] + i * 2.0 * np.pi / z1
            f2 = x[5] + (n - i) * 2.0 * np.pi / z2
            ends = stations.size == 0
            if ends:
                face_limit(-1.0, gr, x, w, f1, f2, limits, 0, 0)
                face_limit(1.0, gr, x, w, f1, f2, limits, LIMIT, 0)
            for j in range(2 if ends else stations.size):
                zeta = limits[j * LIMIT] if ends else stations[j]
                total = rb1 * (f1 + gr[L.PSI]) + rb2 * (f2 + gr[L.WHEEL + L.PSI])
                alpha = flank_normal(a, p, q, w, total, Rb, zeta, alpha0)
                section_gap(gr, 0, x, w, f1, f2, zeta, alpha, rec, 0, sup, 0)
                kind = 0
                if rec[L.N_S1] - tip1 > rec[L.N_S2] - tip2:
                    if rec[L.N_S1] > tip1:
                        kind = 1
                elif rec[L.N_S2] > tip2:
                    kind = 2
                if kind != 0:
                    corner_section(gr, kind, x, w, f1, f2, zeta, alpha, rec, 0, sup, 0)
                if count >= rows.shape[0]:
                    return count
                contact_point(gr, kind, x, w, f1, zeta, rec, 0, sup, 0)
                rows[count, 0] = side
                rows[count, 1] = (side * i) % z1
                rows[count, 2] = (side * (n - i)) % z2
                rows[count, 3] = zeta
                rows[count, 4] = rec[L.N_GAP]
                rows[count, 5] = kind
                rows[count, 6] = rec[L.N_S1]
                rows[count, 7] = rec[L.N_S2]
                rows[count, 8] = rec[L.N_PN]
                rows[count, 9] = rec[L.N_PT]
                rows[count, 10] = rec[L.N_ALPHA]
                count += 1
    return count
