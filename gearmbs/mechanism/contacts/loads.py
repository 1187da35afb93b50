"""What acts at points of contact: normal laws, Coulomb friction, and the wrench with its derivatives.

With n from J to I, depth d, u the velocity of I's against J's material point, d' = -n . u, u_t = u + d' n, v = |u_t|:

    IMPACT     f = k d^e + c STEP(d, 0, 0, d_max, 1) d', not negative
    POISSON    f = p d s(d'),  s = STEP(d', -v_0, r^2, v_0, 1)
    friction   F = f n - f m(v) u_t,  m(v) = mu(v) / v

mu(v) rises by STEP from -mu_s at -v_s to mu_s at v_s, and goes over to mu_d at v_d. Two solids have one load, of the
law at the level D, which their points share by dD/dd. A spring that presses with p and expands with r^2 p gives back
r^2 of its energy and r of the impulse: r is the coefficient of restitution.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.loads.forces import FRAME_P, FRAME_V, FRAME_W, friction_over_speed, impact, stored_energy
from gearmbs.dae.equations.loads.time_functions import smooth_step
from gearmbs.kernels.jit import njit
from gearmbs.mechanism.contacts import meshes as pt
from gearmbs.mechanism.contacts.meshes import dot, turned

IMPACT, POISSON = 0, 1
LAW, STIFFNESS, EXPONENT, DAMPING, FULL_DEPTH, PENALTY, RESTITUTION, REVERSAL = 0, 1, 2, 3, 4, 5, 6, 7
MU_STATIC, MU_DYNAMIC, STICTION, FRICTION = 8, 9, 10, 11
"""Coefficients, and the speeds at which they are reached, m/s."""
LAW_REALS = 12
NORM = 300
"""q of the level of two solids: D lies near the largest depth; twice as many vertices add 2^(1/q) - 1, 0.23 %."""


@njit(cache=True, error_model="numpy")
def rise(x, width):
    """Return STEP(x, 0, 0, width, 1) and its slope."""
    _, value, slope, _ = smooth_step(x / width, 0)
    return value, slope / width


@njit(cache=True, error_model="numpy")
def normal_force(law, depth, rate):
    """Return the force, its slopes by depth and rate, the energy stored and the power dissipated."""
    if law[LAW] == POISSON:
        back = law[RESTITUTION] ** 2
        s, slope = rise(rate + law[REVERSAL], 2.0 * law[REVERSAL])
        gain, slope = back + (1.0 - back) * s, (1.0 - back) * slope
        p = law[PENALTY]
        return (
            p * depth * gain,
            p * gain,
            p * depth * slope,
            0.5 * p * back * depth**2,
            p * depth * (gain - back) * rate,
        )
    elastic = law[STIFFNESS] * depth ** law[EXPONENT]
    stiffness = law[EXPONENT] * elastic / depth
    force, by_depth, by_rate = impact(elastic, stiffness, law[DAMPING], law[FULL_DEPTH], depth, rate)
    return force, by_depth, by_rate, stored_energy(elastic, law[EXPONENT], depth), (force - elastic) * rate


@njit(cache=True, error_model="numpy")
def friction_factor(law, speed):
    """Return m = mu(v)/v and (dm/dv)/v."""
    return friction_over_speed(law[MU_STATIC], law[MU_DYNAMIC], law[STICTION], law[FRICTION], speed)


@njit(cache=True, error_model="numpy", forceinline=True)
def _d_depth(row, c):
    """Return the derivative of a point's depth by one of the twelve variations of bodies I and J."""
    return row[pt.D_DEPTH + (c + 6 * int(row[pt.SWAPPED])) % 12]


@njit(cache=True, error_model="numpy")
def share_out(rows, count, derivatives):
    """Write shares g = dD/dd of the points of a pair in one load at the level D.

    D^q = sum(w d^q), so that the loads g f(D) are the gradient of one potential, however patches join or part. A single
    point of weight 1 bears all of it at its own depth.

    Parameters
    ----------
    rows : ndarray, shape (points, COLUMNS)
        All in contact.
    count : int
    derivatives : bool
    """
    most, total = 0.0, 0.0
    for k in range(count):
        most = max(most, rows[k, pt.DEPTH])
    for k in range(count):
        total += rows[k, pt.WEIGHT] * (rows[k, pt.DEPTH] / most) ** NORM
    level = most * total ** (1.0 / NORM)
    for k in range(count):
        rows[k, pt.LEVEL] = level
        rows[k, pt.SHARE] = rows[k, pt.WEIGHT] * (rows[k, pt.DEPTH] / level) ** (NORM - 1)
    if not derivatives:
        return
    for c in range(12):
        slope = 0.0
        for k in range(count):
            slope += rows[k, pt.SHARE] * _d_depth(rows[k], c)
        for k in range(count):
            row = rows[k]
            row[pt.D_LEVEL + c] = slope
            row[pt.D_SHARE + c] = (NORM - 1) * row[pt.SHARE] * (_d_depth(row, c) / row[pt.DEPTH] - slope / level)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_cross(a, b, out):
    """Add a x b."""
    out[0] += a[1] * b[2] - a[2] * b[1]
    out[1] += a[2] * b[0] - a[0] * b[2]
    out[2] += a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def slip(frames, place, out, work):
    """Write the velocity of I's material point at ``place`` against that of J's."""
    arm, spin = work[0:3], work[3:6]
    for q in range(3):
        out[q] = frames[0, FRAME_V + q] - frames[1, FRAME_V + q]
    for k in range(2):
        for q in range(3):
            arm[q] = place[q] - frames[k, FRAME_P + q]
            spin[q] = frames[k, FRAME_W + q] if k == 0 else -frames[k, FRAME_W + q]
        add_cross(spin, arm, out)


@njit(cache=True, error_model="numpy")
def press(row, law, frames, wrench, diagnostics, jac, derivatives, work):
    """Add the load of one point of contact to the wrench on I's body about marker I.

    Parameters
    ----------
    row : ndarray, shape (COLUMNS,)
        The point.
    law : ndarray, shape (LAW_REALS,)
    frames : ndarray, shape (2, 18)
        Of markers I and J.
    wrench, diagnostics : ndarray, shape (1, 6), (6,)
        Added to.
    jac : ndarray, shape (6, 24)
        Added to, if ``derivatives``.
    derivatives : bool
    work : ndarray, shape (36,)
        Scratch.
    """
    share, depth, level = row[pt.SHARE] * row[pt.GAIN], row[pt.DEPTH], row[pt.LEVEL]
    place, n, u, arm, force = row[0:3], work[6:9], work[9:12], work[12:15], work[15:18]
    sign = -1.0 if row[pt.SWAPPED] != 0.0 else 1.0
    for q in range(3):
        n[q] = sign * row[pt.NORMAL + q]
        arm[q] = place[q] - frames[0, FRAME_P + q]
    slip(frames, place, u, work)
    rate = -dot(n, u)
    for q in range(3):
        u[q] += rate * n[q]
    speed = np.sqrt(dot(u, u))
    f, f_depth, f_rate, stored, lost = normal_force(law, level, rate)
    m, m_square = friction_factor(law, speed)
    for q in range(3):
        force[q] = share * f * (n[q] - m * u[q])
        wrench[0, q] += force[q]
    add_cross(arm, force, wrench[0, 3:6])
    # shares of a norm weighed with depths sum to the level
    diagnostics[0] += row[pt.SHARE] * (depth / level) * stored
    diagnostics[1] += share * lost
    diagnostics[2] += share * f * m * speed**2
    diagnostics[4] = max(diagnostics[4], depth)
    diagnostics[5] += share * f
    if not derivatives:
        return
    dp, dn, du, df, moment = work[18:21], work[21:24], work[24:27], work[27:30], work[30:33]
    for c in range(24):
        body, part = c // 12, c % 12
        d_level = d_share = 0.0
        dp[0] = dp[1] = dp[2] = dn[0] = dn[1] = dn[2] = du[0] = du[1] = du[2] = 0.0
        if part < 6:
            column = (part + 6 * body + (6 if sign < 0.0 else 0)) % 12
            d_level = row[pt.D_LEVEL + part + 6 * body]
            d_share = row[pt.GAIN] * row[pt.D_SHARE + part + 6 * body] + row[pt.SHARE] * row[pt.D_GAIN + column]
            for q in range(3):
                dp[q] = row[pt.D_PLACE + 12 * q + column]
                dn[q] = sign * row[pt.D_NORMAL + 12 * q + column]
            _slip_by_place(frames, dp, du, body, part, work)
        elif part < 9:
            du[part - 6] = 1.0 if body == 0 else -1.0
        else:
            for q in range(3):
                moment[q] = place[q] - frames[body, FRAME_P + q]
            turned(part - 9, moment, du)
            if body == 1:
                for q in range(3):
                    du[q] = -du[q]
        # u in full is u_t - rate n
        d_rate = -dot(n, du) - dot(u, dn) + rate * dot(n, dn)
        for q in range(3):
            du[q] += d_rate * n[q] + rate * dn[q]
        d_force = d_share * f + share * (f_depth * d_level + f_rate * d_rate)
        d_m = m_square * dot(u, du)
        for q in range(3):
            df[q] = d_force * (n[q] - m * u[q]) + share * f * (dn[q] - d_m * u[q] - m * du[q])
            jac[q, c] += df[q]
        if c < 3:
            dp[c] -= 1.0
        moment[0] = moment[1] = moment[2] = 0.0
        add_cross(dp, force, moment)
        add_cross(arm, df, moment)
        for q in range(3):
            jac[3 + q, c] += moment[q]


@njit(cache=True, error_model="numpy", forceinline=True)
def _slip_by_place(frames, dp, du, body, part, work):
    """Write the change of the slip with the place of the point and the origin of a marker."""
    arm, spin = work[0:3], work[3:6]
    for k in range(2):
        for q in range(3):
            arm[q] = dp[q]
            spin[q] = frames[k, FRAME_W + q] if k == 0 else -frames[k, FRAME_W + q]
        if k == body and part < 3:
            arm[part] -= 1.0
        add_cross(spin, arm, du)
