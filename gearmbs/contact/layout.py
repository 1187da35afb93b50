"""What stands where: the tables of a gear pair and the kernel's scratch, described field by field.

A gear pair comes as two flat tables (``gi`` int64, ``gr`` float64), so that one compiled kernel serves every pair.
Both begin with a header, described here as a record with named fields; behind it stand the tooth flanks that deviate
from perfect ones. The scratch array holds what the kernel computes on the way: one record `SCRATCH` and, behind it,
strips of the face.

A strip is up to `LANES` neighbouring sections of the face, the nodes of up to ``LANES - 1`` slices. Each of its numbers
is a row with one place (lane) a section, so that loops over the sections run side by side in the processor's vector
registers. Neighbouring strips share a section.
"""

from __future__ import annotations

import numpy as np

LANES = 8
"""Sections worked on side by side; one vector register of AVX-512, two of AVX, four of NEON."""

CACHE_LINE = 64
"""Bytes; every record of the scratch starts on a multiple of it."""

REAL, INTEGER = np.float64, np.int64


def record(*fields: str | tuple, kind: type = REAL) -> np.dtype:
    """Return a record of 8-byte numbers that stand one after another; its size is whole cache lines.

    Parameters
    ----------
    *fields : str, tuple or dtype
        Name of a number, or name and shape of an array: ``("grad", 6)``; name and dtype of a record within.
    kind : type
        `REAL`, or `INTEGER`.
    """
    names, formats, offsets, end = [], [], [], 0
    for field in fields:
        name, *shape = (field,) if isinstance(field, str) else field
        form = shape[0] if shape and isinstance(shape[0], np.dtype) else np.dtype((kind, tuple(shape)))
        names.append(name)
        formats.append(form)
        offsets.append(end)
        end += form.itemsize
    size = -(-end // CACHE_LINE) * CACHE_LINE
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


def lanes(*fields: str | tuple) -> np.dtype:
    """Return a record of rows: each field has a last axis of one place a section of a strip."""
    return record(*[(*((field,) if isinstance(field, str) else field), LANES) for field in fields])


def place(table: np.dtype, name: str) -> int:
    """Return where a field stands in its flat table, in numbers."""
    return table.fields[name][1] // 8  # type: ignore[index]


# --- the tables of a pair -----------------------------------------------------------------------------
OPTIONS = record(
    ("teeth", 2),
    "slices",  # along the face; 1: a single plane at mid-face, no end effects
    "law",  # one of law_kinds.LAW_*
    "friction",  # one of FRICTION_*
    "drive",  # +1: wheel 1 drives turning positive about its z axis, -1: negative
    "load",  # one of LOAD_*
    "root",  # 1: tips also meet the mate's root
    "profile_places",  # of a deviation shape along the profile
    "face_places",  # and along the face
    "compliance_places",  # of a compliance curve
    "flanks",  # where the records of the tooth flanks begin in gi, 0: all teeth perfect
    "offsets",  # where in gr: one constant deviation a tooth flank
    "shapes",  # deviation shapes
    "tips",  # lengths of roll at the tip over the face, for broken and chipped teeth
    "compliances",  # relative compliances along the profile, 0: constant stiffness
    kind=INTEGER,
)
FLANK_SHAPE, FLANK_TIP, FLANK_COMPLIANCE, FLANK = range(4)
"""A tooth flank's numbers of its shape, tip and compliance (-1: none), and how many numbers that makes."""

WHEEL = record(
    "base_radius",  # m; radii, lengths of roll and angles of an internal wheel are negative
    "half_angle",  # of the tooth at the base circle, rad
    "tip_roll",  # length of roll where the involute ends at the tip, m
    "corner_radius",  # of the centre of the tip rounding (the tip corner itself when sharp), m
    "corner_angle",  # its half angle, rad
    "tip_rounding",  # radius, m
    "tip_radius",
    "root_radius",
    "face_width",
    "form_roll",  # length of roll where the involute begins, m
    "fillet_radius",  # of the root arc, m
    "fillet_centre_radius",
    "fillet_angle",  # half angle of the arc's centre from the tooth's middle, rad
    "shape_start",  # length of roll of the first place of a deviation shape, m
    "shape_spacing",  # of its places, m
    "twist",  # tangent of the base helix angle, positive for an external left hand and an internal right hand
)
PAIR = record(
    ("wheel_1", WHEEL),
    ("wheel_2", WHEEL),
    "pitch",  # base pitch, m
    "stiffness",  # per unit face width, N/m^(1+e)
    "exponent",
    "damping",  # per unit face width, N s/m^2, or a factor on the elastic force, see law_kinds.LAW_KINDS
    "damping_depth",  # penetration of full damping, m
    "static_friction",
    "dynamic_friction",
    "static_speed",
    "dynamic_speed",
    "width",  # face width that a single section stands for, m
    "end_blend",  # rounding of the face ends in the overlap, m
    "added_material",  # most material added to a flank pair by deviations, m
    "face_low",  # the slices' range along the mean axis, m
    "face_high",
    "axial_shift",  # nominal axial offset of wheel 2, m
    "compliance_start",  # first place of the pair's compliance curve on wheel 1's length of roll, m
    "compliance_spacing",
    "secant",  # of the base helix angle: normal force over its part in the transverse section
    # reach of tip corners beyond the path of contact, see `search.teeth_in_reach`
    "centre_distance",  # that of the drawing, m; the next five are for it
    "corner_share",  # of the flatter parabola of a corner's gap at the path's ends that bounds the gap from below
    "corner_bound",  # least ratio of a corner's gap to x^2 at x beyond the path of contact, 1/m
    "corner_reach",  # how far beyond the path a corner has a foot on the mate's involute, m
    "passing_gap",  # least gap with which a corner leaves the mate's tip, m
    "passing_slope",  # how much that falls at most with a change of the centre distance
    "edge",  # radius by which the mate's flank falls away behind its tip, m
)
PARALLEL = record(
    "distance",  # of the two fixed axes, m
    "offset",  # of the contact's plane along the axis, from the middle of wheel 1, m
    "length",  # of the line of action, m
    "alpha",  # operating angle, its sine and cosine
    "sin",
    "cos",
    ("slack", 2),  # gap of the flanks of tooth 0 and one pair of the mate where nothing has turned; either side
    ("roll", 2),  # and the length of roll there on wheel 1
    "per_pitch",  # 1 / base pitch, 1/m
    "curve",  # lower bound of the corner gap's growth beyond the path of contact, 1/m
    "shallow",  # depth up to which it bounds how far corners reach, m
    ("sense", 2),  # 1 or -1: how a wheel's own axis points
    ("frame", 3, 3),  # columns: along the line of centres, across it, along the axes
)
"""What two wheels on fixed parallel axes have all the time; see `gearmbs.contact.parallel.kernel`."""
SLICES, FRICTION, LAW = place(OPTIONS, "slices"), place(OPTIONS, "friction"), place(OPTIONS, "law")

FRICTION_NONE, FRICTION_ADAMS, FRICTION_SMOOTH = range(3)
LOAD_SLICES, LOAD_ADAMS = range(2)

# --- results ------------------------------------------------------------------------------------------
TOTALS = record(
    "energy",  # elastic, J
    "damping_power",  # W
    "friction_power",
    "depth_drive",  # largest penetration on the drive flanks, m
    "depth_coast",  # and on the coast flanks
    "pairs_drive",  # tooth pairs touching
    "pairs_coast",
    "normal_force",  # sum over all tooth pairs, N
)
DIAGNOSTICS = len(TOTALS.names or ())
"""How many diagnostics there are."""

# --- kinds of contact and of what bounds the touching part of a slice -----------------------------------------
FLANKS, CORNER_1, CORNER_2 = range(3)
"""Flank on flank; tip corner of wheel 1, of wheel 2, on the mate's flank."""
AT_NODE, AT_FACE_END, AT_TOUCH_END = range(3)

# --- the pose: centre distance, axial offset, tilt (inclination, skew), spin angles -------------------------
A, H, P, Q, F1, F2 = range(6)

# --- Gauss's three-point rule over a length of one --------------------------------------------------------
POINTS = (0.1127016653792583, 0.5, 0.8872983346207417)
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)

# --- scratch -----------------------------------------------------------------------------------------------
PADDED = 8
"""Columns of 6 x 6 matrices: two spare ones make a row one vector, and lines of the cache."""

MOTION = record(
    ("x", 6),  # pose
    ("xd", 6),  # its rates
    ("twist", 6),  # of wheel 1 relative to wheel 2, in the mean frame
    ("frame", 3, 3),  # mean frame; columns are its axes
    ("wrench", 6),  # on wheel 1, in the mean frame
    ("xd_x", 6, PADDED),  # d xd / dx
    ("wrench_x", 6, PADDED),  # derivative of the wrench by the pose at fixed generalised force
    ("columns", 6, PADDED),  # d x by the variation of wheel 1 in the mean frame
    ("turn", 3, PADDED),  # how the mean frame turns with that variation
    ("twist_turn", 6, PADDED),  # and how the twist changes with it
    ("by_x", 6, PADDED),  # derivative of the wrench by the pose
    ("by_twist", 6, PADDED),  # and by the twist
    ("by_xd", 6, PADDED),  # and by the pose's rates
    ("jac", 6, PADDED),  # derivative of the wrench by displacements of wheel 1
)
SIDE = record(
    ("x", 6),  # pose, rates and twist as seen on the side of the teeth at work
    ("xd", 6),
    ("twist", 6),
    "w",  # cosine of half the angle between the axes
    "i_w",  # 1 / w, its third and fifth power
    "i_w3",
    "i_w5",
    "i_1w",  # 1 / (1 + w)
    "m",  # 1 / (w (1 + w)) with two derivatives by w
    "m_w",
    "m_ww",
    "gentle",  # 1: the axes lean so little that the turn of the normal is a short series, else 0
    "base_1",  # base radii, their sum and difference
    "base_2",
    "base_sum",
    "base_difference",
    "alpha_0",  # operating angle of parallel axes, its sine and cosine
    "sin_0",
    "cos_0",
    "length",  # of the line of action, m
    "roll_sum",  # sum of base radius times (spin + half angle), tooth 0 of wheel 1 and the tooth facing it
    "start_1",  # spin plus half angle of tooth 0 of wheel 1, and of the tooth facing it
    "start_2",
    "turn_2",  # angle between neighbouring teeth of wheel 2, rad; negative for an internal one
    "twist_1",  # tangents of the base helix angles as seen on the side of the teeth at work
    "twist_2",
    "lean",  # cosine of the base helix angle, by which contact lines lean, and its sine as seen on that side
    "across",
    "pitch_mismatch_bound",  # how much gaps of helical flanks may differ between tooth pairs under a tilt, m
    "reference",  # number of the tooth of wheel 1 whose flanks the sections of the face describe
    "facing",  # number of the tooth of wheel 2 that faces tooth 0 of wheel 1
    "first",  # nodes of the face that may touch
    "last",
    "low",  # where the slices begin, m; 0 for a single plane
    "step",  # width of a slice, m
    "slices",  # along the face
    "overhang",  # how far the common face may reach beyond the slices, m
    "curve",  # lower bound of the corner gap's growth beyond the path of contact, 1/m; 0: none
    "sign",  # +1 or -1, for the tables that name flanks
)
TOOTH_PAIR = record(
    "f_1",  # angles of the two teeth from the line of centres
    "f_2",
    "flank_1",  # their places among all tooth flanks of the pair of wheels
    "flank_2",
    "shift",  # length of roll on wheel 1 beyond that of tooth 0
    "first",  # nodes that may touch
    "last",
    "low",  # where the common face ends, in slices from the first of the face
    "high",
    "roll",  # length of roll on wheel 1 where the flanks meet, axes taken as parallel
    "corner_bears",  # 1: the corner of wheel 1 bears in some section
    "stiffness_factor",  # along the path of contact; its gradient and Hessian
    ("stiffness_factor_x", 6),
    ("stiffness_factor_xx", 6, 6),
    ("moved", 6),  # derivative of the elastic energy by the pose as the centroid moves along the face
)
LIMIT = record(("grad", 6), ("hess", 6, 6))
SUMS = record(
    ("q", 6),  # generalised normal force
    ("f", 6),  # friction wrench on wheel 1
    ("q_x", 6, PADDED),  # derivative of q by the pose
    ("q_xd", 6, PADDED),  # and by the pose's rates
    ("f_x", 6, PADDED),
    ("f_twist", 6, PADDED),
    ("f_xd", 6, PADDED),  # through the damping in the normal force
)
LOOKUP = record("roll", ("grad", 6), ("hess", 6, 6))
"""Where the contact stands on a profile."""
CORNER = lanes("roll", "radius", "rounding", "sin", "cos", "mate_tip")
"""The tip corner of a wheel at work: length of roll, radius, rounding, sine and cosine of its polar angle; and the
length of roll at which its mate's flank ends."""
LOADS = lanes(
    "kind",  # of contact in the tooth pair at work
    # of the slice from this node to the next
    "low",  # the part that touches and lies on both faces, as fractions
    "high",
    "depth",  # its largest penetration
    "clip_low",  # 1: the touch ends there
    "clip_high",
    "energy",
    "power",
    "k_ll",  # minus derivatives of the forces on the left and right node by the gaps at the left and right node
    "k_lr",
    "k_rl",
    "k_rr",
    "r_ll",  # and by the rates of the gaps
    "r_lr",
    "r_rr",
    "left_low",  # derivatives of the forces left and right by the bounds
    "right_low",
    "left_high",
    "right_high",
    "force_left",  # its share on either node
    "force_right",
    "elastic_left",
    "elastic_right",
    ("x_left", 6),  # their derivatives by the pose; rows ..._left above ..._right: read from one lane before
    ("x_right", 6),
    ("v_left", 6),  # and by the pose's rates
    ("v_right", 6),
    # of the node
    "force",
    "elastic",
    ("force_x", 6),
    ("force_xd", 6),
    # friction
    "normal",  # contact point along normal and tangent, from the centre of wheel 1
    "tangent",
    ("normal_x", 6),
    ("tangent_x", 6),
    "v_profile",  # sliding velocity
    "v_axial",
    "ratio",  # friction coefficient over speed, and the derivative of that by the speed over the speed
    "ratio_slope",
    ("sliding", 6),  # derivative of the wrench by the normal force
    ("moved", 6, 6),  # derivatives of the wrench by the pose, or by the twist
)
STRIP = lanes(
    "zeta",  # place of the section along the mean axis
    "alpha",  # operating angle of the contact normal, its sine and cosine
    "sin",
    "cos",
    "gap",
    "rate",  # of the gap
    "roll_1",  # length of roll at the contact
    "roll_2",
    "turn",  # of the normal seen from the wheels' own planes
    "kind",  # FLANKS, CORNER_1 or CORNER_2
    "step",  # of Newton's method
    "good",  # 1: a corner bears on its mate's involute, 0: on its continuation
    ("grad", 6),  # d gap / dx
    ("rate_x", 6),  # d rate / dx
    ("alpha_x", 6),
    ("hess", 6, 6),  # d2 gap / dx2, upper triangle
)
VALUE_ROWS = place(STRIP, "rate_x") // LANES
"""Rows of a strip that stand before the derivatives of second order."""

SCRATCH = record(
    ("motion", MOTION),
    ("side", SIDE),
    ("pair", TOOTH_PAIR),
    ("sums", SUMS),
    ("totals", TOTALS),
    ("low", LIMIT),  # limits of the common face
    ("high", LIMIT),
    ("lookup_1", LOOKUP),
    ("lookup_2", LOOKUP),
    ("corner_1", CORNER),
    ("corner_2", CORNER),
    ("loads", LOADS),
    ("middle", STRIP),  # mid-face
    ("corners", STRIP),  # sections in which a corner bears
    ("divided", STRIP),  # flank on flank in slices that are divided
)


def strip_count(n_slices: int) -> int:
    """Return the number of strips that so many slices need."""
    return max(1, -(-n_slices // (LANES - 1)))


def work_size(n_slices: int) -> int:
    """Length of the scratch array the kernel needs for so many slices."""
    strips = 2 * strip_count(n_slices)
    return (CACHE_LINE + SCRATCH.itemsize + strips * STRIP.itemsize) // 8
