"""Contact of two perfect external spur wheels that turn about fixed parallel axes: from two angles to a wrench.

The laws are those of `gearmbs.contact.parallel.definitions`; derivation in ``docs/theory/contact.md``. All tooth pairs
of a side have one gap of their flanks, one approach and one pressure: the transmission error of the side, and a side
whose gap is open is done with one comparison. Only tip corners beyond the path of contact are looked at one by one.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.corners import PLANE
from gearmbs.contact.laws import elastic_pressure, friction_law, pressure
from gearmbs.contact.parallel import derived as D
from gearmbs.contact.places import level_normal
from gearmbs.contact.records import inlined, kernel, options_at, pair_at
from gearmbs.contact.search import corner_growth
from gearmbs.contact.sections import NEAR_BASE
from gearmbs.dae.equations.loads.forces import (
    DERIVATIVES,
    FRAME_A,
    FRAME_P,
    TURNING_SIG,
)
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import vector_at
from gearmbs.kernels.views import header

PARALLEL = 1e-12
"""Tilt of two axes, and distance of a wheel's middle from its axis, m, that are rounding."""
DRAWN = 1e-6
"""Part of the centre distance by which it may be off for the drawing's bound of corner gaps, which it moves as much."""
DEEP = 0.98
"""Part of that bound, which is for flanks that touch: at depths up to 0.6 mm gaps are above 0.998 of it."""
CONTACT, SUMS = 17, 15
"""Numbers of a contact with its derivatives, and of the sums: planar wrench, its derivatives by angles and rates."""
parallel_at = header(L.PARALLEL)


@inlined
def corner_at(wheels, own, first, roll_1, roll_2, contact, want):
    """Write the contact of the tip corner of wheel 1, or of wheel 2, at lengths of roll of endless flanks."""
    wheel, mate = (wheels.wheel_1, wheels.wheel_2) if first else (wheels.wheel_2, wheels.wheel_1)
    roll, roll_mate = (roll_1, roll_2) if first else (roll_2, roll_1)
    a, base, radius, rounding = own.distance, mate.base_radius, wheel.corner_radius, wheel.tip_rounding
    eta = roll / wheel.base_radius - own.alpha - wheel.half_angle + wheel.corner_angle
    start = roll_mate / base - own.alpha
    se, ce = np.sin(eta), np.cos(eta)
    bears, turn, sa, ca = level_normal(a - radius * ce, -radius * se, base, own.sin, own.cos)
    if not bears:
        turned = start - NEAR_BASE
        st, ct, beside = np.sin(turned), np.cos(turned), PLANE - NEAR_BASE * base
        if first:
            D.plane_1(a, st, ct, base, beside, NEAR_BASE, PLANE, se, ce, radius, rounding, contact)
            if want != 0:
                D.plane_1_slopes(a, st, ct, base, beside, NEAR_BASE, PLANE, se, ce, radius, rounding, contact)
            return
        D.plane_2(a, st, ct, base, beside, NEAR_BASE, PLANE, se, ce, radius, rounding, contact)
        if want != 0:
            D.plane_2_slopes(a, st, ct, base, beside, NEAR_BASE, PLANE, se, ce, radius, rounding, contact)
        return
    alpha, tip, bend = own.alpha + turn, mate.tip_roll, 0.0
    foot = base * (start + alpha)
    gap = a * sa - (radius * (sa * ce + ca * se) + rounding) - foot
    if foot + 0.5 * gap > tip:
        bend = 1.0 / (wheels.edge + rounding + mate.tip_rounding)
    if first:
        D.corner_1(a, alpha, sa, ca, start, base, tip, bend, se, ce, radius, rounding, contact)
        if want != 0:
            D.corner_1_slopes(a, alpha, sa, ca, start, base, tip, bend, se, ce, radius, rounding, contact)
        return
    D.corner_2(a, alpha, sa, ca, start, base, tip, bend, se, ce, radius, rounding, contact)
    if want != 0:
        D.corner_2_slopes(a, alpha, sa, ca, start, base, tip, bend, se, ce, radius, rounding, contact)


@inlined
def flanks_at(wheels, own, gap, place, contact):
    """Write the contact of flanks at a place along the normal."""
    rb1, rb2 = wheels.wheel_1.base_radius, wheels.wheel_2.base_radius
    contact[0], contact[1], contact[2], contact[3], contact[4], contact[5] = gap, own.sin, -rb1, -rb2, own.sin, own.cos
    contact[6] = place
    for k in range(7, 15):
        contact[k] = 0.0
    contact[15], contact[16] = 0.5 * rb1, -0.5 * rb2


@inlined
def press(options, wheels, depth, approach):
    """Return the law of a contact over the face: force, its slopes by depth and rate, energy, elastic part."""
    e, elastic = wheels.exponent, elastic_pressure(wheels.stiffness, wheels.exponent, depth)
    p, p_d, p_r, energy, _ = pressure(options.law, elastic, e, wheels.damping, wheels.damping_depth, depth, approach)
    b = wheels.width
    return b * p, b * p_d, b * p_r, b * energy, b * elastic


@inlined
def tell(options, diagnostics, sign, depth, approach, law, count):
    """Add to the diagnostics what some touching pairs press."""
    force, _, _, energy, elastic = law
    diagnostics[0] += count * energy
    diagnostics[1] += count * ((force - elastic) * approach)
    at = 0 if sign == options.drive else 1
    diagnostics[3 + at] = max(diagnostics[3 + at], depth)
    diagnostics[5 + at] += count
    diagnostics[7] += count * force


@inlined
def friction_at(options, wheels, speed):
    """Return the friction coefficient over the sliding speed, and what `friction_law` says of its slope."""
    return friction_law(
        options.friction, wheels.static_friction, wheels.dynamic_friction, wheels.static_speed, wheels.dynamic_speed,
        abs(speed),
    )  # fmt: skip


@inlined
def add_slopes(own, law, ratio, ratio_slope, rates, contact, sums):
    """Add the derivatives of the wrench of a contact to the sums."""
    force, stiffness, damping, _, _ = law
    rate_1, rate_2 = rates
    D.contact_slopes(own.distance, force, stiffness, damping, ratio, ratio_slope, rate_1, rate_2, contact, sums)


@inlined
def add_corner(options, wheels, own, sign, rates, contact, sums, diagnostics, want):
    """Add the wrench of a tip corner and its friction to the sums, and what it presses to the diagnostics."""
    (rate_1, rate_2), depth = rates, -contact[0]
    away, speed = D.contact_rates(own.distance, rate_1, rate_2, contact)
    law = press(options, wheels, depth, -away)
    tell(options, diagnostics, sign, depth, -away, law, 1.0)
    ratio = ratio_slope = 0.0
    if options.friction != L.FRICTION_NONE:
        ratio, ratio_slope = friction_at(options, wheels, speed)
        diagnostics[2] += ratio * law[0] * speed * speed
    D.contact_wrench(own.distance, law[0], ratio, rate_1, rate_2, contact, sums)
    if want != 0:
        add_slopes(own, law, ratio, ratio_slope, rates, contact, sums)


@kernel
def side_forces(options, wheels, own, sign, roll, gap, rates, contact, sums, diagnostics, want):
    """Add the contacts of one side of the teeth, seen so that wheel 1's counter-clockwise flanks press.

    Parameters
    ----------
    options, wheels, own : record
        Tables of the pair, and of its axes.
    sign : int
        +1 or -1, for the diagnostics of the drive and of the coast flanks.
    roll, gap : float
        Length of roll on wheel 1 of some tooth where flanks touch, m, and the gap of all of them, negative.
    rates : tuple of float
        Angular velocities of the wheels as seen on this side.
    contact, sums, diagnostics : ndarray
        Scratch; sums to add to.
    want : int
        Nonzero to add derivatives.
    """
    rb1, rb2 = wheels.wheel_1.base_radius, wheels.wheel_2.base_radius
    tip_1, tip_2, pitch = wheels.wheel_1.tip_roll, wheels.wheel_2.tip_roll, wheels.pitch
    depth, approach, whole = -gap, rb1 * rates[0] + rb2 * rates[1], own.length - gap
    beyond, curve = wheels.corner_reach, 0.0
    if depth < own.shallow:
        curve = own.curve
        beyond = min(beyond, np.sqrt(depth / curve))
    law = press(options, wheels, depth, approach)
    first = int(np.ceil((own.length - tip_2 - beyond - roll) * own.per_pitch))
    last = int(np.floor((tip_1 + beyond - roll) * own.per_pitch))
    pairs = friction = moment = 0.0
    for i in range(first, last + 1):
        roll_1 = roll + i * pitch
        roll_2 = whole - roll_1
        over_1, over_2 = roll_1 - tip_1, roll_2 - tip_2
        over = max(over_1, over_2)
        if over > 0.0:
            if gap + curve * over * over < 0.0:
                corner_at(wheels, own, over_1 > over_2, roll_1, roll_2, contact, want)
                if contact[0] < 0.0:
                    add_corner(options, wheels, own, sign, rates, contact, sums, diagnostics, want)
            continue
        # flanks differ in their places along the normal alone, and with these in their friction
        pairs += 1.0
        place, ratio, ratio_slope = roll_1 + 0.5 * gap, 0.0, 0.0
        if options.friction != L.FRICTION_NONE:
            speed = D.flank_sliding(own.distance, own.sin, place, rates[0], rates[1])
            ratio, ratio_slope = friction_at(options, wheels, speed)
            pull = ratio * law[0] * speed
            friction -= pull
            moment -= pull * place
            diagnostics[2] += pull * speed
        if want != 0:
            flanks_at(wheels, own, gap, place, contact)
            add_slopes(own, law, ratio, ratio_slope, rates, contact, sums)
    if pairs > 0.0:
        tell(options, diagnostics, sign, depth, approach, law, pairs)
        D.flank_wrench(own.distance, own.sin, own.cos, rb1, rb2, pairs * law[0], friction, moment, sums)


@njit(TURNING_SIG, cache=True, nogil=True, error_model="numpy")
def parallel_contact(ints, reals, own, turns, want, work, wrench, slopes, diagnostics):
    """Write the wrench on wheel 1; see `gearmbs.dae.equations.loads.forces`.

    Parameters
    ----------
    ints, reals : ndarray
        Address of `gear_contact`, then the pair's tables.
    own : ndarray
        The record `layout.PARALLEL`.
    turns : ndarray, shape (4,)
        Angles by which the wheels have turned about their axes, then their angular velocities.
    want : int
        Flags; derivatives are filled if `DERIVATIVES` is among them.
    work : ndarray
        Scratch.
    wrench, slopes, diagnostics : ndarray
        Out.
    """
    options, wheels, fixed = options_at(vector_at(ints, 1, ints.size - 1)), pair_at(reals), parallel_at(own)
    contact, sums = vector_at(work, 0, CONTACT), vector_at(work, CONTACT, SUMS)
    derivatives = want & DERIVATIVES
    sense_1, sense_2 = fixed.sense[0], fixed.sense[1]
    pitch = wheels.pitch
    turned_1 = wheels.wheel_1.base_radius * sense_1 * turns[0]
    turned = turned_1 + wheels.wheel_2.base_radius * sense_2 * turns[1]
    rate_1, rate_2 = sense_1 * turns[2], sense_2 * turns[3]
    for k in range(SUMS):
        sums[k] = 0.0
    slack = fixed.slack[1] + turned
    gap = slack - pitch * np.floor(slack * fixed.per_pitch + 0.5)
    if gap < 0.0:
        roll = fixed.roll[1] - turned_1
        side_forces(
            options, wheels, fixed, -1, roll, gap, (-rate_1, -rate_2), contact, sums, diagnostics, derivatives
        )  # fmt: skip
        # the other flanks are the same problem seen in a mirror: but for the force along the line of centres the wrench
        # changes its sign, and so do the angles
        sums[1], sums[2] = -sums[1], -sums[2]
        for k in range(3, 7):
            sums[k] = -sums[k]
    slack = fixed.slack[0] - turned
    gap = slack - pitch * np.floor(slack * fixed.per_pitch + 0.5)
    if gap < 0.0:
        roll = fixed.roll[0] + turned_1
        side_forces(options, wheels, fixed, 1, roll, gap, (rate_1, rate_2), contact, sums, diagnostics, derivatives)
    frame, h = fixed.frame, fixed.offset
    for c in range(3):
        x, y, z = frame[c, 0], frame[c, 1], frame[c, 2]
        wrench[c] = x * sums[0] + y * sums[1]
        wrench[3 + c] = z * sums[2] + h * (y * sums[0] - x * sums[1])
        if derivatives != 0:
            for k in range(4):
                sense = sense_1 if k % 2 == 0 else sense_2
                along, across = sense * sums[3 + k], sense * sums[7 + k]
                slopes[c, k] = x * along + y * across
                slopes[3 + c, k] = z * sense * sums[11 + k] + h * (y * along - x * across)


def parallel_axes(gi: np.ndarray, gr: np.ndarray, frames: np.ndarray, axes: np.ndarray) -> np.ndarray | None:
    """Return the record of two wheels on fixed axes for `parallel_contact`, or None if it is not for them.

    Parameters
    ----------
    gi, gr : ndarray
        Tables of the pair.
    frames : ndarray, shape (2, 18)
        Frames of the wheels where nothing has turned.
    axes : ndarray, shape (2, 2, 3)
        A point and the direction of either axis.
    """
    options, wheels = gi[: L.OPTIONS.itemsize // 8].view(L.OPTIONS)[0], gr[: L.PAIR.itemsize // 8].view(L.PAIR)[0]
    one, two = wheels["wheel_1"], wheels["wheel_2"]
    if options["slices"] != 1 or options["flanks"] or options["compliances"] or options["root"]:
        return None
    if one["twist"] != 0.0 or two["base_radius"] < 0.0 or wheels["added_material"] != 0.0:
        return None
    places = frames[:, FRAME_P : FRAME_P + 3]
    turned = frames[:, FRAME_A : FRAME_A + 9].reshape(2, 3, 3)
    z = turned[0, :, 2]
    off = [np.cross(axes[:, 1], places - axes[:, 0]), np.cross(axes[:, 1], turned[:, :, 2]), turned[1, :, 2] - z]
    if max(np.abs(part).max() for part in off) > PARALLEL:
        return None
    between = places[1] - places[0]
    h = float(z @ between)
    a = float(np.linalg.norm(between - h * z))
    base = float(one["base_radius"] + two["base_radius"])
    if a <= 1.0001 * base:
        return None
    x = (between - h * z) / a
    y = np.cross(z, x)
    spins = [float(np.arctan2(s * (t[:, 0] @ y), s * (t[:, 0] @ x))) for s, t in zip((1.0, -1.0), turned)]
    length, alpha = np.sqrt(a * a - base * base), np.arctan2(np.sqrt(a * a - base * base), base)
    table = np.zeros(1, L.PARALLEL)
    own = table[0]
    own["distance"], own["offset"], own["length"], own["alpha"] = a, 0.5 * h, length, alpha
    own["sin"], own["cos"] = length / a, base / a
    for side, sign in enumerate((1.0, -1.0)):
        starts = [sign * spin + wheel["half_angle"] for spin, wheel in zip(spins, (one, two))]
        slack = length - base * alpha - one["base_radius"] * starts[0] - two["base_radius"] * starts[1]
        own["slack"][side], own["roll"][side] = slack, one["base_radius"] * (starts[0] + alpha)
    own["curve"], own["per_pitch"] = DEEP * wheels["corner_bound"], 1.0 / wheels["pitch"]
    if abs(a - wheels["centre_distance"]) > DRAWN * a:
        growth = [corner_growth.py_func(length, w["tip_roll"], w["base_radius"]) for w in (one, two)]
        own["curve"] = wheels["corner_share"] * min(growth)
    own["shallow"] = wheels["passing_gap"] - wheels["passing_slope"] * abs(a - wheels["centre_distance"])
    own["sense"] = [np.sign(n @ z) for n in axes[:, 1]]
    own["frame"] = np.column_stack([x, y, z])
    return table.view(np.float64)
