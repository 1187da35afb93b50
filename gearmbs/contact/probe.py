"""Gaps of all tooth pairs in reach, section by section: for placement, pictures and checks (not for time loops)."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.deviations import add_deviations, pair_softness, set_corner, tip_string, tooth_record
from gearmbs.contact.face import LIMIT, face_limit
from gearmbs.contact.flanks import corner_section, flank_pitch, open_side, set_normal
from gearmbs.contact.jit import kernel
from gearmbs.contact.node import contact_point, flank_normal, section_gap
from gearmbs.contact.pose import relative_pose

COLUMNS = (
    "side",
    "tooth_1",
    "tooth_2",
    "station",
    "gap",
    "kind",
    "string_1",
    "string_2",
    "normal",
    "tangent",
    "alpha",
    "stiffness",
)


@kernel
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
    rows : ndarray, shape (n, 12)
        Out, columns as in ``COLUMNS``: side (+1, -1), tooth numbers, station, gap m, kind (0 flank on flank, 1 or 2
        the wheel whose corner bears), string lengths on both wheels m, contact point from the centre of wheel 1 along
        normal and tangent m, operating angle of the normal rad (mirrored for side -1), stiffness factor
        of the pair.

    Returns
    -------
    int
        Number of rows filled.
    """
    if not relative_pose(R1, A1, R2, A2, work):
        return 0
    rb1 = gr[L.RB]
    rb2 = gr[L.WHEEL + L.RB]
    pitch = gr[L.PITCH]
    o = L.W_NODES
    count = 0
    teeth = gi[L.O_TOOTH] != 0
    for side in (1, -1):
        for i in range(6):
            work[L.S_X + i] = -work[L.W_X + i] if side == -1 and i > 2 else work[L.W_X + i]
        if not open_side(gr, work):
            return 0
        length = work[L.S_LENGTH]
        alpha0 = work[L.S_A0]
        tip1 = gr[L.S_TIP]
        tip2 = gr[L.WHEEL + L.S_TIP]
        base1 = rb1 * (work[L.S_X + 4] + gr[L.PSI])
        n = int(flank_pitch(gr, work))
        first = int(np.ceil((length - tip2 - base1 - rb1 * alpha0) / pitch)) - 1
        last = int(np.floor((tip1 - base1 - rb1 * alpha0) / pitch)) + 1
        for i in range(first, last + 1):
            f1 = work[L.S_X + 4] + i * 2.0 * np.pi / gi[L.Z1]
            f2 = work[L.S_X + 5] + (n - i) * 2.0 * np.pi / gi[L.Z2]
            record1 = tooth_record(gi, 0, side, i) if teeth else 0
            record2 = tooth_record(gi, 1, side, n - i) if teeth else 0
            soft = 1.0
            if gi[L.O_COMPLIANCE] != 0:
                pair_softness(gi, gr, work, record1, record2, f1, f2, 0)
                soft = work[L.P_SOFT]
            ends = stations.size == 0
            if ends:
                face_limit(-1.0, gr, work, f1, f2, L.W_LIMIT, 0)
                face_limit(1.0, gr, work, f1, f2, L.W_LIMIT + LIMIT, 0)
            for j in range(2 if ends else stations.size):
                if count >= rows.shape[0]:
                    return count
                zeta = work[L.W_LIMIT + j * LIMIT] if ends else stations[j]
                set_normal(work, alpha0, work[L.S_A0 + 1], work[L.S_A0 + 2])
                flank_normal(work, base1 + i * pitch + rb2 * (f2 + gr[L.WHEEL + L.PSI]), rb1 + rb2, zeta)
                section_gap(gr, work, 0, f1, f2, zeta, o, 0)
                tip1 = tip_string(gi, gr, 0, record1, zeta)
                tip2 = tip_string(gi, gr, 1, record2, zeta)
                kind = 0
                if work[o + L.N_S1] - tip1 > work[o + L.N_S2] - tip2:
                    if work[o + L.N_S1] > tip1:
                        kind = 1
                elif work[o + L.N_S2] > tip2:
                    kind = 2
                if kind != 0:
                    set_corner(gr, work, kind - 1, f1 if kind == 1 else f2, tip1 if kind == 1 else tip2)
                    corner_section(gr, work, kind, f1, f2, zeta, False, o, 0)
                if teeth:
                    add_deviations(gi, gr, work, record1, record2, kind, f1, f2, zeta, o, 0)
                contact_point(gr, work, kind, f1, zeta, o, 0)
                rows[count, 0] = side
                rows[count, 1] = (side * i) % gi[L.Z1]
                rows[count, 2] = (side * (n - i)) % gi[L.Z2]
                rows[count, 3] = zeta
                rows[count, 4] = work[o + L.N_GAP]
                rows[count, 5] = kind
                rows[count, 6] = work[o + L.N_S1]
                rows[count, 7] = work[o + L.N_S2]
                rows[count, 8] = work[o + L.N_PN]
                rows[count, 9] = work[o + L.N_PT]
                rows[count, 10] = work[o + L.N_ALPHA]
                rows[count, 11] = soft
                count += 1
    return count
