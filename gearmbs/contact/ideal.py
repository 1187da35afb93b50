"""An ideal mesh: one spring with a damper along the line of action instead of the contacts of single teeth.

The gap ``g`` is that of endless flanks on flanks at mid-face, exact for any pose, to which the transmission error
``e(u)`` adds; ``u`` is the phase of the mesh, the length of roll on wheel 1 over the base pitch. Per side of the teeth,
with the deflection ``d = -(g + e) cos(beta_b)`` along the normal,

    U = k(u) d^2 / 2,        Q = -dU/dx + c d' cos(beta_b) d(g + e)/dx.

With backlash d counts where it is positive, and the damping grows with it as STEP up to full damping at a depth.
Without, the drive side alone carries both signs: a linear mesh for modes and for comparison with lumped models.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.deviations import roll_of_flanks
from gearmbs.contact.kernel import relative_twist, slopes_of_sums, wheel_frame, wrench_of_sums
from gearmbs.contact.law_kinds import LAW_IMPACT
from gearmbs.contact.laws import normal_law
from gearmbs.contact.loads import clear_sums, mirror
from gearmbs.contact.pose import pose_rates, relative_pose
from gearmbs.contact.records import kernel, options_at, pair_at, scratch_at
from gearmbs.contact.search import facing_teeth, middle_section, open_side, set_twist
from gearmbs.contact.sections import gap_rates
from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import vector_at

STIFFNESS, DAMPING, DEPTH, COSINE, BACKLASH, PLACES, TABLES = range(7)
"""Places of the element's own reals behind the pair's table: N/m, N s/m, m, cosine of the base helix angle, 1 with
backlash, points of the tables, and the tables themselves: relative stiffness and transmission error over one mesh."""

ENERGY, POWER, DEFLECTION, FORCE = range(4)
"""Places of the diagnostics."""


@kernel
def periodic_cubic(reals, start, n, u):
    """Value and first two derivatives by ``u`` of a curve of period 1 given at ``n`` points: Catmull-Rom."""
    place = (u - np.floor(u)) * n
    k = int(place) % n
    t = place - np.floor(place)
    y0, y1 = reals[start + (k - 1) % n], reals[start + k]
    y2, y3 = reals[start + (k + 1) % n], reals[start + (k + 2) % n]
    m1, m2, d = 0.5 * (y2 - y0), 0.5 * (y3 - y1), y2 - y1
    c2, c3 = 3.0 * d - 2.0 * m1 - m2, m1 + m2 - 2.0 * d
    value = y1 + t * (m1 + t * (c2 + t * c3))
    return value, (m1 + t * (2.0 * c2 + 3.0 * t * c3)) * n, (2.0 * c2 + 6.0 * t * c3) * n * n


@kernel
def side_spring(options, wheels, own, scratch, diagnostics, sign, want):
    """Add the spring of one side of the teeth to the sums; the side's pose is set.

    Parameters
    ----------
    options, wheels : record
        Tables of the pair.
    own : ndarray
        The element's own reals.
    scratch : record
    diagnostics : ndarray
        Out.
    sign : float
        +1, or -1 for the side seen in a mirror.
    want : int
        Nonzero to add derivatives.
    """
    side, strip, sums, lookup = scratch.side, scratch.middle, scratch.sums, scratch.lookup_1
    if not open_side(wheels, side):
        return
    facing_teeth(options, wheels, side)
    f_1, f_2 = side.start_1 - wheels.wheel_1.half_angle, side.start_2 - wheels.wheel_2.half_angle
    to_pitch_point(options, wheels, side, strip, want)
    gap_rates(side, strip, 1, want)
    cosine, linear = own[COSINE], own[BACKLASH] == 0.0
    roll_of_flanks(side, wheels, lookup, 0, f_1, f_2, 0.0)
    pitch, n = wheels.pitch, int(own[PLACES])
    # the drive flanks' table holds for both sides, each in its own sense
    phase = sign * lookup.roll / pitch
    share, share_u, share_uu = periodic_cubic(own, TABLES, n, phase)
    error, error_u, error_uu = periodic_cubic(own, TABLES + n, n, phase)
    # a wheel that lags opens one side and closes the other
    error, error_u, error_uu = sign * error, sign * error_u, sign * error_uu
    per = sign / pitch
    depth = -(strip.gap[0] + error) * cosine
    rate = -strip.rate[0]
    for i in range(6):
        rate -= error_u * per * lookup.grad[i] * side.xd[i]
    rate *= cosine
    if not linear and depth <= 0.0:
        return
    k, c = own[STIFFNESS] * share, own[DAMPING]
    if linear:
        force, by_depth, by_rate, elastic = k * depth + c * rate, k, c, k * depth
    else:
        force, by_depth, by_rate, _, elastic = normal_law(LAW_IMPACT, k, 1.0, c, own[DEPTH], depth, rate)
    energy = 0.5 * own[STIFFNESS] * depth * depth  # per relative stiffness
    diagnostics[ENERGY] += energy * share
    diagnostics[POWER] += (force - elastic) * rate
    diagnostics[FORCE] += force
    if linear:
        diagnostics[DEFLECTION] = depth
    elif depth > abs(diagnostics[DEFLECTION]):
        # negative on the coast flank
        diagnostics[DEFLECTION] = sign * depth
    add_spring(sums, strip, lookup, (cosine, per), (error_u, error_uu), (force, by_depth, by_rate), want)
    add_parametric(own, sums, strip, lookup, (cosine, per), (error_u, share_u, share_uu), depth, want)
    if want != 0:
        for i in range(6):
            along = strip.grad[i, 0] + error_u * per * lookup.grad[i]
            # the stiffness in the force changes with the phase
            for j in range(6):
                by_phase = own[STIFFNESS] * depth * share_u * per * lookup.grad[j]
                sums.q_x[i, j] += cosine * along * by_phase
            # the rate changes with the pose through the slope of the error
            moved = 0.0
            for j in range(6):
                moved += lookup.hess[i, j] * side.xd[j] * error_u * per
                moved += lookup.grad[i] * lookup.grad[j] * side.xd[j] * error_uu * per * per
            for m in range(6):
                other = strip.grad[m, 0] + error_u * per * lookup.grad[m]
                sums.q_x[m, i] -= cosine * cosine * by_rate * other * moved


@kernel
def by_turns(hess, j, turn_1, turn_2):
    """Derivative of the gap's gradient by turns of both wheels at once."""
    return hess[min(j, L.F1), max(j, L.F1), 0] * turn_1 + hess[min(j, L.F2), max(j, L.F2), 0] * turn_2


@kernel
def to_pitch_point(options, wheels, side, strip, want):
    """Fill the gap at mid-face, of helical flanks that touch each other in the pitch point.

    The gap of parallel axes is that of all teeth; tilted axes, or the moment of a force along a leaning normal, tell
    them apart. The pair is ``i`` pitches past the facing one, ``r_1 (F_1 + i t_1 + alpha) = r_1 tan alpha``, a real
    number that follows the pose x: with y = x + i(x) e and e = (t_1, -t_2) along the turns of the wheels,
    ``dg/dx = dG/dy + (dG/dy . e) di/dx``, so that the spring keeps its energy.

    Parameters
    ----------
    options, wheels, side, strip : record
    want : int
        Nonzero for second derivatives.
    """
    helical = side.twist_1 != 0.0
    a, sum_of_bases, length, alpha = side.x[L.A], side.base_sum, side.length, side.alpha_0
    per = side.base_1 / wheels.pitch
    slope = length / sum_of_bases  # tan alpha
    turn_1, turn_2 = 2.0 * np.pi / options.teeth[0], -side.turn_2
    if helical:
        i = per * (slope - alpha - side.start_1)
        side.start_1 += i * turn_1
        side.start_2 += i * turn_2
    middle_section(options, wheels, side, strip, want)
    if not helical:
        return
    # di/dF_1, di/da, d2i/da2, of cos alpha = (r_1 + r_2)/a
    alpha_a = sum_of_bases / (a * length)
    alpha_aa = -sum_of_bases * (length + a * a / length) / (a * length) ** 2
    i_f, i_a = -per, per * slope * slope * alpha_a
    i_aa = per * slope * (2.0 * (1.0 + slope * slope) * alpha_a * alpha_a + slope * alpha_aa)
    grad, hess = strip.grad, strip.hess
    along = grad[L.F1, 0] * turn_1 + grad[L.F2, 0] * turn_2
    grad[L.F1, 0] += along * i_f
    grad[L.A, 0] += along * i_a
    if want == 0:
        return
    turned = (
        by_turns(hess, 0, turn_1, turn_2), by_turns(hess, 1, turn_1, turn_2), by_turns(hess, 2, turn_1, turn_2),
        by_turns(hess, 3, turn_1, turn_2), by_turns(hess, 4, turn_1, turn_2), by_turns(hess, 5, turn_1, turn_2),
    )  # fmt: skip
    both = turned[L.F1] * turn_1 + turned[L.F2] * turn_2
    for j in range(6):
        i_j = i_f if j == L.F1 else i_a if j == L.A else 0.0
        for k in range(j, 6):
            i_k = i_f if k == L.F1 else i_a if k == L.A else 0.0
            hess[j, k, 0] += turned[j] * i_k + turned[k] * i_j + both * i_j * i_k
    hess[L.A, L.A, 0] += along * i_aa


@kernel
def add_spring(sums, strip, lookup, scales, error, law, want):
    """Add a force along the gradient of gap and error, with its derivatives.

    Parameters
    ----------
    sums, strip, lookup : record
    scales : tuple of float
        Cosine of the base helix angle, phase by length of roll.
    error : tuple of float
        First and second derivative of the transmission error by the phase.
    law : tuple of float
        Force, and its derivatives by deflection and rate.
    want : int
        Nonzero to add derivatives.
    """
    cosine, per = scales
    error_u, error_uu = error
    force, by_depth, by_rate = law
    for i in range(6):
        gi = strip.grad[i, 0] + error_u * per * lookup.grad[i]
        sums.q[i] += cosine * force * gi
        if want == 0:
            continue
        for j in range(6):
            gj = strip.grad[j, 0] + error_u * per * lookup.grad[j]
            bent = strip.hess[min(i, j), max(i, j), 0] + error_u * per * lookup.hess[i, j]
            bent += error_uu * per * per * lookup.grad[i] * lookup.grad[j]
            sums.q_x[i, j] += cosine * (force * bent - cosine * gi * (by_depth * gj + by_rate * strip.rate_x[j, 0]))
            sums.q_xd[i, j] -= cosine * cosine * by_rate * gi * gj


@kernel
def add_parametric(own, sums, strip, lookup, scales, table, depth, want):
    """Add the force of a stiffness that varies with the phase, -U dln(k)/dx, with its derivatives.

    Parameters
    ----------
    own : ndarray
        The element's own reals.
    sums, strip, lookup, scales
        As in `add_spring`.
    table : tuple of float
        Slope of the transmission error by the phase, first and second derivative of the relative stiffness.
    depth : float
        Deflection, m.
    want : int
        Nonzero to add derivatives.
    """
    cosine, per = scales
    error_u, share_u, share_uu = table
    k = own[STIFFNESS]
    for i in range(6):
        sums.q[i] -= 0.5 * k * depth * depth * share_u * per * lookup.grad[i]
        if want == 0:
            continue
        for j in range(6):
            gj = strip.grad[j, 0] + error_u * per * lookup.grad[j]
            sums.q_x[i, j] += cosine * k * depth * share_u * per * lookup.grad[i] * gj
            bent = share_uu * per * per * lookup.grad[i] * lookup.grad[j] + share_u * per * lookup.hess[i, j]
            sums.q_x[i, j] -= 0.5 * k * depth * depth * bent


@kernel
def both_springs(options, wheels, own, scratch, diagnostics, want):
    """Sum up the springs of both sides of the teeth; that of the drive alone for a mesh without backlash."""
    motion, side, sums = scratch.motion, scratch.side, scratch.sums
    pose_rates(motion)
    clear_sums(sums, want)
    for turn in range(2):
        sign = 1.0 if turn == 0 else -1.0
        if own[BACKLASH] == 0.0 and sign != options.drive:
            continue
        for i in range(6):
            mirrored = sign if i > 2 else 1.0
            side.x[i], side.xd[i] = mirrored * motion.x[i], mirrored * motion.xd[i]
        set_twist(wheels, side, sign)
        if sign < 0.0:
            mirror(sums, want)
        side_spring(options, wheels, own, scratch, diagnostics, sign * options.drive, want)
        if sign < 0.0:
            mirror(sums, want)


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def ideal_mesh(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Wrench of an ideal mesh; ``ints`` begins with the number of reals of the pair's table, which comes next.

    Parameters
    ----------
    ints, reals : ndarray
        Length of the pair's real table and its integers; the pair's reals and the element's own.
    t, states, inputs, rates
        Not used.
    frames : ndarray
        Poses and velocities of the two wheels.
    want : int
        Flags; derivatives are filled if `DERIVATIVES` is among them.
    work : ndarray
        Scratch.
    wrench, jac, diagnostics : ndarray
        Out; see `gearmbs.dae.equations.loads.forces`.
    """
    behind = ints[0]
    own = vector_at(reals, behind, reals.size - behind)
    options, wheels, scratch = options_at(vector_at(ints, 1, ints.size - 1)), pair_at(reals), scratch_at(work)
    motion, sums = scratch.motion, scratch.sums
    R1, A1, v1, w1 = wheel_frame(frames, 0)
    R2, A2, v2, w2 = wheel_frame(frames, 1)
    if not relative_pose(R1, A1, R2, A2, wheels.wheel_2.base_radius < 0.0, motion):
        return
    relative_twist(R1, v1, w1, R2, v2, w2, motion)
    derivatives = want & DERIVATIVES
    both_springs(options, wheels, own, scratch, diagnostics, derivatives)
    total = vector_at(wrench, 0, 6)
    wrench_of_sums(motion, sums, derivatives, total)
    if derivatives != 0:
        slopes_of_sums(motion, sums, (R1, v1, w1), (R2, v2, w2), total, jac)
