"""Which teeth and which part of the face may touch, on one side of the teeth."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.places import level, level_flanks
from gearmbs.contact.records import kernel, strip_at
from gearmbs.contact.sections import (
    GENTLE,
    flank_normals,
    flank_sections,
    gap_rates,
    helical_flanks,
    helical_normals,
    set_sections,
)

# a parabola falls less from one step to the next the nearer it is to its foot, so that 1 would do where the contact
# moves evenly along the profile; it need not
STEEPEST = 3.0  # how much faster `path_excess` may fall beyond an end of the face than between its last two nodes
# the least gap over alpha bends by g_za^2 / g_aa along the face, with g_za = 2 tilt / w at most and g_aa the line of
# action's length: reach^2 / 2 of it is how far it leaves its tangent, of which twice as much is allowed for
BENDING = 4.0  # bound of the gap's bending along the face of an internal pair, as a multiple of the tilt squared
SAME_PITCH = 1e-13  # tilt times the tangent of the base helix below which all pairs of helical flanks have one gap
PITCHES_APART = 2.5  # bound of how normal pitches of tilted helical wheels differ, as a multiple of that product
STEEPEST_HELICAL = 0.03  # square of the sine of half the angle between helical wheels' axes, beyond it no contact
UNBOUNDED = 1e9  # curvature of a corner gap, 1/m, where the tip reaches beyond the line of action


@kernel
def open_side(wheels, side):
    """Fill what the pose implies, the same for both sides of the teeth; False where no contact is looked for.

    That is when the base circles meet, or helical wheels' axes are more than 20 degrees apart.

    With an internal wheel 2 its base radius, the centre distance and the length of the line of action are negative;
    all that follows holds for both.
    """
    a, p, q = side.x[L.A], side.x[L.P], side.x[L.Q]
    rb1, rb2 = wheels.wheel_1.base_radius, wheels.wheel_2.base_radius
    Rb = rb1 + rb2
    # the line of action's length is divided by, and at least 1.4 % of the centre distance here
    if abs(a) <= abs(Rb) * 1.0001:
        return False
    if p * p + q * q > STEEPEST_HELICAL and wheels.wheel_1.twist != 0.0:
        return False
    length = np.copysign(np.sqrt(a * a - Rb * Rb), a)
    tilt_squared = p * p + q * q
    w = np.sqrt(1.0 - tilt_squared)
    i_w = 1.0 / w
    one = 1.0 / (1.0 + w)
    m = i_w * one
    side.w = w
    side.i_w = i_w
    side.i_w3 = i_w * i_w * i_w
    side.i_w5 = i_w * i_w * i_w * i_w * i_w
    side.i_1w = one
    side.m = m
    side.m_w = -(1.0 + 2.0 * w) * m * m
    side.m_ww = 2.0 * m * m * ((1.0 + 2.0 * w) * (1.0 + 2.0 * w) * m - 1.0)
    side.gentle = 1.0 if 0.5 * tilt_squared * m < GENTLE else 0.0
    side.base_1, side.base_2, side.base_sum, side.base_difference = rb1, rb2, Rb, rb1 - rb2
    side.length = length
    side.alpha_0 = np.arctan2(abs(length), abs(Rb))
    side.sin_0 = length / a
    side.cos_0 = Rb / a
    tilt_of_helix = abs(wheels.wheel_1.twist) * np.sqrt(tilt_squared)
    side.pitch_mismatch_bound = 0.0
    if tilt_of_helix > SAME_PITCH:
        side.pitch_mismatch_bound = (
            PITCHES_APART * tilt_of_helix * (abs(length) + 2.0 * wheels.pitch + wheels.face_high - wheels.face_low)
        )
    return True


@kernel
def face_pair(wheels, side, pair):
    """Count angles from the pair at work instead of from tooth 0, for flanks whose gap differs from pair to pair."""
    side.start_1 = pair.f_1 + wheels.wheel_1.half_angle
    side.start_2 = pair.f_2 + wheels.wheel_2.half_angle
    pair.shift = 0.0


@kernel
def set_twist(wheels, side, sign):
    """Fill the wheels' helices as seen on a side, which is a mirror image for ``sign`` -1."""
    side.twist_1 = sign * wheels.wheel_1.twist
    side.twist_2 = sign * wheels.wheel_2.twist
    side.lean = 1.0 / np.sqrt(1.0 + side.twist_1 * side.twist_1)
    side.across = side.lean * side.twist_1


@kernel
def facing_teeth(options, wheels, side):
    """Find the tooth of wheel 2 facing tooth 0 of wheel 1: the sum of their turns is what the gap depends on."""
    pitch = wheels.pitch
    half_1, half_2 = wheels.wheel_1.half_angle, wheels.wheel_2.half_angle
    base_1 = side.base_1 * (side.x[L.F1] + half_1)
    base_2 = side.base_2 * (side.x[L.F2] + half_2)
    slack = side.length - side.base_sum * side.alpha_0 - base_1 - base_2 + side.twist_1 * side.x[L.H]
    n = np.floor(slack / pitch + 0.5)
    turn = 2.0 * np.pi / options.teeth[1]
    side.turn_2 = turn if side.base_2 > 0.0 else -turn
    side.facing = n
    side.roll_sum = base_1 + base_2 + n * pitch
    side.start_1 = side.x[L.F1] + half_1
    side.start_2 = side.x[L.F2] + n * side.turn_2 + half_2
    side.reference = 0.0
    if side.pitch_mismatch_bound != 0.0:
        # where gaps differ from pair to pair, they are bounded from the pair in the middle of the path of contact
        middle = 0.5 * (side.length - wheels.wheel_2.tip_roll + wheels.wheel_1.tip_roll)
        i = np.floor((middle - side.base_1 * (side.start_1 + side.alpha_0)) / pitch + 0.5)
        side.reference = i
        side.start_1 += i * (2.0 * np.pi / options.teeth[0])
        side.start_2 -= i * side.turn_2


@kernel
def middle_section(options, wheels, side, strip, want):
    """Fill the gap of flank on flank at mid-face; ``want`` as for `flank_sections`."""
    single = options.slices == 1
    strip.zeta[0] = 0.0 if single else 0.5 * (wheels.face_low + wheels.face_high)
    strip.alpha[0], strip.sin[0], strip.cos[0] = side.alpha_0, side.sin_0, side.cos_0
    strip.step[0] = 0.0
    if single and level(side, strip, 1, want):
        level_flanks(side, strip)
        return
    if side.twist_1 != 0.0:
        helical_normals(side, strip, 1)
        helical_flanks(side, strip, 1, want)
        return
    if side.x[L.P] != 0.0 or side.x[L.Q] != 0.0:
        flank_normals(side, strip, 1)
    flank_sections(side, strip, 1, want)


@kernel
def reach_of_face(options, wheels, side, middle):
    """Fill the nodes ``side.first`` to ``side.last`` that may touch; False if none can.

    The gap over the face is convex: its tangent in the middle bounds the touching part. That of an internal pair is
    concave, by as much as its curvature allows.
    """
    x, slices = side.x, options.slices
    p, q = x[L.P], x[L.Q]
    low, high = wheels.face_low, wheels.face_high
    deepest = wheels.added_material - middle.gap[0] + side.pitch_mismatch_bound
    slope = 2.0 * (p * middle.sin[0] + q * middle.cos[0]) / side.w
    if side.twist_1 != 0.0:
        c = 1.0 + side.twist_1 * side.twist_1
        slope *= c * side.w * side.w / (1.0 - c * (p * p + q * q))
    side.low = low
    side.step = (high - low) / slices
    side.slices = float(slices)
    # where a leaning or shifted wheel's end face goes beyond the slices, gaps are extrapolated
    shift = 0.5 * abs(x[L.H] - wheels.axial_shift)
    side.overhang = abs(p * x[L.A]) + abs(q) * max(side.base_1, abs(side.base_2)) + shift + wheels.end_blend
    reach = 0.5 * (high - low) + side.overhang
    if x[L.A] < 0.0:
        deepest += BENDING * (p * p + q * q) * reach * reach / abs(side.length)
    if deepest + abs(slope) * reach <= 0.0:
        return False
    first, last = 0, slices
    if deepest - abs(slope) * reach < 0.0:
        edge = int(np.floor((middle.zeta[0] - deepest / slope - low) / side.step))
        if slope > 0.0:
            first = min(max(0, edge), slices - 1)
        else:
            last = max(min(slices, edge + 1), 1)
    side.first, side.last = float(first), float(last)
    return True


@kernel
def strips_between(first, last):
    """Return how many strips cover the nodes ``first`` to ``last``."""
    return max(1, -(-int(last - first) // (L.LANES - 1)))


@kernel
def beyond_end(side, end_gap, next_gap):
    """Lower bound of the flanks' gap from an end node outwards."""
    return end_gap - max(0.0, next_gap - end_gap) * side.overhang / side.step


@kernel
def flank_strips(scratch, slices, want):
    """Fill the strips of the face with flank-on-flank sections; return the least gap, end faces included.

    Where the slices begin or end, the face may reach beyond them: there the gap is bounded by its slope.
    """
    side, middle = scratch.side, scratch.middle
    first, last = side.first, side.last
    count = strips_between(first, last)
    least = np.inf
    for k in range(count):
        strip = strip_at(scratch, k)
        node = first + k * (L.LANES - 1)
        nodes = min(last - node + 1.0, float(L.LANES))
        set_sections(strip, L.LANES, side, node, nodes, middle)
        if side.twist_1 != 0.0:
            helical_normals(side, strip, L.LANES)
            helical_flanks(side, strip, L.LANES, want)
        else:
            flank_normals(side, strip, L.LANES)
            flank_sections(side, strip, L.LANES, want)
        gap_rates(side, strip, L.LANES, want)
        for j in range(int(nodes)):
            least = min(least, strip.gap[j])
        if k == 0 and first == 0.0:
            least = min(least, beyond_end(side, strip.gap[0], strip.gap[1]))
        end = int(nodes) - 1
        if k == count - 1 and last == slices:
            least = min(least, beyond_end(side, strip.gap[end], strip.gap[end - 1]))
    return least


@kernel
def corner_growth(length, tip, rb):
    """Return L T / (2 (L - T) r_b^2), the factor of x^2 in a corner's gap at x beyond the path of contact, 1/m."""
    # beyond the line of action's end there is no bound; an internal wheel's tip meets its own end from the other side
    if (length - tip) * length * tip <= 0.0:
        return UNBOUNDED
    return length * tip / (2.0 * (length - tip) * rb * rb)


@kernel
def teeth_in_reach(wheels, side, depth, wander):
    """First and last tooth of wheel 1 that may bear, counted from tooth 0.

    A corner bears beyond the path of contact while it has a foot on the mate's involute and its gap is below ``depth``.
    The gap grows at first, from a parabola on, and is never less than the one with which the corner passes the mate's
    tip: up to that depth the parabola bounds the reach, beyond it the foot does. ``wander`` is how far the contact
    moves along the profile over the face. See "How far a corner reaches" in the theory of contact: of the formula there
    ``wheels.passing_gap`` is G_t, ``wheels.corner_share`` the part of the parabola that kappa is, and
    ``wheels.corner_reach`` how far there are feet, places of the corner on the mate's involute.
    """
    tip_1, tip_2, length = wheels.wheel_1.tip_roll, wheels.wheel_2.tip_roll, side.length
    rb1, rb2, pitch = side.base_1, side.base_2, wheels.pitch
    curve = 0.0
    beyond = wheels.corner_reach
    if depth < wheels.passing_gap - wheels.passing_slope * abs(side.x[L.A] - wheels.centre_distance):
        curve = wheels.corner_share * min(corner_growth(length, tip_1, rb1), corner_growth(length, tip_2, rb2))
        beyond = min(beyond, np.sqrt(max(depth, 0.0) / curve) + wander)
    side.curve = curve
    # a helix moves the contact along the profile from one end of the face to the other
    beyond += abs(side.twist_1) * (wheels.face_high - wheels.face_low + abs(side.x[L.H]))
    at = rb1 * side.start_1 + rb1 * side.alpha_0
    first = np.ceil((length - tip_2 - beyond - at) / pitch)
    last = np.floor((tip_1 + beyond - at) / pitch)
    i = int(side.reference)
    return int(first) + i, int(last) + i


@kernel
def path_excess(wheels, side, strip, j, shift):
    """Return how much the gap of a pair in section ``j`` grows at least for standing beyond the path of contact.

    ``side.curve`` is what the last `teeth_in_reach` has found.
    """
    over_1 = strip.roll_1[j] + shift - wheels.wheel_1.tip_roll
    over_2 = strip.roll_2[j] - shift - wheels.wheel_2.tip_roll
    x = max(max(over_1, over_2), 0.0)
    return side.curve * x * x


@kernel
def pair_reach(wheels, scratch, slices):
    """Fill the nodes of a tooth pair that may touch, and one more on either side; False if none can.

    The gap is at least that of the flanks plus a parabola.
    """
    side, pair = scratch.side, scratch.pair
    margin, shift = wheels.added_material, pair.shift
    low, high = int(side.first), int(side.last)
    first, last = high + 1, low - 1
    count = strips_between(low, high)
    for k in range(count):
        strip = strip_at(scratch, k)
        start = low + k * (L.LANES - 1)
        nodes = min(high - start + 1, L.LANES)
        for j in range(nodes):
            if strip.gap[j] + path_excess(wheels, side, strip, j, shift) < margin:
                first = min(first, start + j)
                last = max(last, start + j)
        if k == 0 and low == 0 and end_in_reach(wheels, side, strip, 0, 1, shift, margin):
            first = 0
            last = max(last, 0)
        at_end = k == count - 1 and high == slices
        if at_end and end_in_reach(wheels, side, strip, nodes - 1, nodes - 2, shift, margin):
            first = min(first, slices)
            last = slices
    pair.first, pair.last = float(max(first - 1, low)), float(min(last + 1, high))
    return pair.last >= pair.first


@kernel
def end_in_reach(wheels, side, strip, end, inward, shift, margin):
    """Whether a pair may touch where the face goes on beyond its end node.

    Parameters
    ----------
    wheels, side, strip : record
    end, inward : int
        The section at the end, and the one next to it.
    shift : float
        Length of roll on wheel 1 beyond that of the strip's tooth.
    margin : float
        Gap below which teeth may touch.
    """
    excess = path_excess(wheels, side, strip, end, shift)
    grown = path_excess(wheels, side, strip, inward, shift) - excess
    share = STEEPEST * side.overhang / side.step
    bound = beyond_end(side, strip.gap[end], strip.gap[inward]) + excess - max(0.0, grown) * share
    return bound < margin


@kernel
def strip_in_reach(wheels, side, pair, strip, node, nodes, bent):
    """Whether a tooth pair may touch in the first ``nodes`` sections of a strip that begins at ``node``.

    ``bent`` is how much smaller gaps may be than those of the strip.
    """
    shift, margin = pair.shift, wheels.added_material + bent
    if node == 0.0 and end_in_reach(wheels, side, strip, 0, 1, shift, margin):
        return True
    if node + nodes - 1.0 == side.slices and end_in_reach(wheels, side, strip, nodes - 1, nodes - 2, shift, margin):
        return True
    for j in range(nodes):
        if strip.gap[j] + path_excess(wheels, side, strip, j, shift) < margin:
            return True
    return False
