"""Gaps of all tooth pairs in reach, section by section: for placement, pictures and checks (not for time loops)."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.deviations import add_deviations, pair_stiffness_factor, roll_under_corner
from gearmbs.contact.pair import pair_corners, pair_kinds, set_pair
from gearmbs.contact.places import contact_points, end_roll, helical_points, limit_value, roll_difference
from gearmbs.contact.pose import relative_pose
from gearmbs.contact.records import CONTRACT, kernel, options_at, pair_at, scratch_at
from gearmbs.contact.search import face_pair, facing_teeth, open_side, set_twist, teeth_in_reach
from gearmbs.contact.sections import (
    flank_normals,
    flank_sections,
    helical_flanks,
    helical_normals,
)
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64

_VEC, _MATRIX = float64[::1], float64[:, ::1]

GAP_COLUMNS: tuple[str, ...] = (
    "side",
    "tooth_1",
    "tooth_2",
    "section",
    "gap",
    "kind",
    "roll_1",
    "roll_2",
    "normal",
    "tangent",
    "alpha",
    "stiffness",
)
SIDE, TOOTH_1, TOOTH_2, SECTION, GAP, KIND, ROLL_1, ROLL_2, NORMAL, TANGENT, ALPHA, STIFFNESS = range(len(GAP_COLUMNS))


# a signature, for Python calls it: kernels without one are compiled at the first call only
@njit(
    int64(int64[::1], _VEC, _VEC, _MATRIX, _VEC, _MATRIX, _VEC, _MATRIX, _VEC),
    cache=True,
    error_model="numpy",
    fastmath=CONTRACT,
)
def pair_gaps(gi, gr, R1, A1, R2, A2, sections, rows, work):
    """Gap of every tooth pair on the path of contact or in reach of a tip corner, both sides, in sections of the face.

    Parameters
    ----------
    gi, gr, work : ndarray
        As for ``gear_contact``.
    R1, A1, R2, A2 : ndarray
        Poses of the wheels.
    sections : ndarray
        Positions along the mean axis from mid-way between the wheels, m; if empty, the ends of the common face.
    rows : ndarray, shape (n, 12)
        Out, columns as in ``GAP_COLUMNS``: side (+1, -1), tooth numbers, section, gap m, kind (0 flank on flank, 1 or 2
        the wheel whose corner bears), lengths of roll on both wheels m, contact point from the centre of wheel 1 along
        normal and tangent m, operating angle of the normal rad (mirrored for side -1), stiffness factor
        of the pair. The gap is infinite in sections where a corner has no foot on the mate's flank.

    Returns
    -------
    int
        Number of rows filled.
    """
    scratch = scratch_at(work)
    options, wheels, side = options_at(gi), pair_at(gr), scratch.side
    if not relative_pose(R1, A1, R2, A2, wheels.wheel_2.base_radius < 0.0, scratch.motion):
        return 0
    count = 0
    for sign in (1, -1):
        for i in range(6):
            side.x[i] = -scratch.motion.x[i] if sign == -1 and i > 2 else scratch.motion.x[i]
        set_twist(wheels, side, float(sign))
        if not open_side(wheels, side):
            return 0
        facing_teeth(options, wheels, side)
        first, last = teeth_in_reach(wheels, side, np.inf, 0.0)
        for i in range(first, last + 1):
            set_pair(options, scratch, sign, i)
            count = pair_rows(options, wheels, scratch, sign, i, sections, rows, count)
    return count


@kernel
def pair_rows(options, wheels, scratch, sign, i, sections, rows, count):
    """Fill the rows of one tooth pair.

    Parameters
    ----------
    options, wheels, scratch : record
        Tables and scratch; the pair at work is set.
    sign, i : int
        Side, and tooth of wheel 1.
    sections, rows
        As for `pair_gaps`.
    count : int
        Rows filled before.

    Returns
    -------
    int
        Rows filled.
    """
    side, pair = scratch.side, scratch.pair
    strip, loads = scratch.middle, scratch.loads
    if options.compliances != 0:
        pair_stiffness_factor(options, wheels, side, pair, scratch.lookup_1)
    sig = roll_difference(side, wheels, pair.f_1, pair.f_2)
    mate = int(side.facing) - i
    if side.base_2 < 0.0:
        mate = -mate
    ends = sections.size == 0
    for j in range(2 if ends else sections.size):
        if count >= rows.shape[0]:
            return count
        end = -1.0 if j == 0 else 1.0
        zeta = limit_value(side, wheels, end, end_roll(side, wheels, end, sig)) if ends else sections[j]
        section_of_pair(options, wheels, scratch, zeta)
        start = pair.f_1 + wheels.wheel_1.half_angle
        if side.twist_1 != 0.0:
            helical_points(side, scratch.corner_1, strip, loads, 1, start, strip.kind[0] == 1.0, 0)
        else:
            contact_points(side, scratch.corner_1, strip, loads, 1, start, strip.kind[0] == 1.0, 0)
        rows[count, SIDE] = sign
        rows[count, TOOTH_1] = (sign * i) % options.teeth[0]
        rows[count, TOOTH_2] = (sign * mate) % options.teeth[1]
        rows[count, SECTION] = zeta
        rows[count, GAP] = strip.gap[0]
        rows[count, KIND] = strip.kind[0]
        rows[count, ROLL_1] = strip.roll_1[0]
        rows[count, ROLL_2] = strip.roll_2[0]
        rows[count, NORMAL] = loads.normal[0]
        rows[count, TANGENT] = loads.tangent[0]
        rows[count, ALPHA] = strip.alpha[0]
        rows[count, STIFFNESS] = pair.stiffness_factor
        count += 1
    return count


@kernel
def section_of_pair(options, wheels, scratch, zeta):
    """Fill the first section of ``scratch.middle`` with the gap of the pair at work, its deviations included."""
    side, pair = scratch.side, scratch.pair
    strip = scratch.middle
    strip.zeta[0] = zeta
    strip.alpha[0], strip.sin[0], strip.cos[0] = side.alpha_0, side.sin_0, side.cos_0
    if side.twist_1 != 0.0:
        face_pair(wheels, side, pair)
        helical_normals(side, strip, 1)
        helical_flanks(side, strip, 1, 0)
    else:
        flank_normals(side, strip, 1)
        flank_sections(side, strip, 1, 0)
    pair_kinds(options, wheels, scratch, strip, 1, 0, 0)
    strip.roll_1[0] += pair.shift
    strip.roll_2[0] -= pair.shift
    kind = int(scratch.loads.kind[0])
    if kind != L.FLANKS:
        pair_corners(wheels, scratch, strip, strip, 1, kind, True, 0)
        corner = scratch.corner_2 if kind == L.CORNER_2 else scratch.corner_1
        roll_under_corner(side, corner, strip, 0, scratch.lookup_1, kind % 2, 0)
        # a foot beyond the mate's tip is none
        if scratch.lookup_1.roll - corner.mate_tip[0] > wheels.edge:
            strip.gap[0] = np.inf
            return
    if options.flanks != 0:
        add_deviations(options, wheels, scratch, strip, 0, 0)
