"""Sums over the rolling elements: generalised forces on the local coordinates and their derivatives.

Local coordinates q, in the axes of J: displacement d (3), components of the inner ring's axis along x and y (2), cage
angle psi seen from J, angle theta of the inner ring, spins beta of elements with a profile. With
e_r = (cos theta_j, sin theta_j), theta_j = psi + place, and the levers R, z of a path,

    u_r = d . e_r,    phi = a . e_r,    X = A_r + u_r + z phi,    Y = A_z + d_z - R phi,
    h = h_o(theta_j) + h_i(theta_j - theta) + h_b(beta_j) - oversize,

f = Q (1 + chi delta') where that is positive, and the generalised force is -f ddelta/dq.
"""

from __future__ import annotations

import numpy as np

from gearmbs.bearings import layout as B
from gearmbs.bearings.laws_kernel import (
    ball_centre,
    ball_law,
    ball_law_at_speed,
    ball_potential,
    hertz_energy,
    positive_part,
    roller_law,
    roller_law_at_speed,
    write_ball_law,
)
from gearmbs.bearings.layout import place_of, profile_curvature, profile_slope, profile_value
from gearmbs.dae.equations.loads.forces import DERIVATIVES, DIAGNOSTICS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, vector_at


@njit(cache=True, error_model="numpy")
def element_sums(ints, reals, states, want, work):
    """Write the generalised forces and the sums over all elements, and their derivatives if wanted.

    ``work`` holds the local coordinates and rates, see `gearmbs.bearings.layout`.
    """
    n = B.BETA + ints[B.SPINS]
    forces = vector_at(work, B.S_LOCAL, n)
    for k in range(n):
        forces[k] = 0.0
    for k in range(B.SUMS):
        work[B.S_SUMS + k] = 0.0
    if want & DERIVATIVES:
        # K, D, the columns of F, and of the sum of normal forces
        for k in range(n, n + 2 * n * n + 3 * n):
            work[B.S_LOCAL + k] = 0.0
        work[B.S_LOCAL + (12 + 2 * n) * n + 6] = 0.0
    psi = states[0]
    cosine, sine = np.cos(psi), np.sin(psi)
    spin = work[B.S_W + 2]
    load = 0.0
    if ints[B.CENTRIFUGAL]:
        cage = work[B.S_SPIN] + work[B.S_CAGE] * spin
        load = reals[B.MASS_RADIUS] * cage * cage
    if is_plain(ints):
        # most bearings
        plain_balls(ints, reals, cosine, sine, want, work)
        return
    for j in range(ints[B.ELEMENTS]):
        at = ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j
        c = cosine * reals[at + B.ELEMENT_COSINE] - sine * reals[at + B.ELEMENT_SINE]
        s = sine * reals[at + B.ELEMENT_COSINE] + cosine * reals[at + B.ELEMENT_SINE]
        for path in range(ints[B.PATHS]):
            one_path(ints, reals, states, want, work, j, path, c, s, load)


@njit(cache=True, error_model="numpy")
def is_plain(ints):
    """Return whether elements are balls with one path, without profiles and centrifugal load."""
    plain = ints[B.KIND] == B.BALL and ints[B.PATHS] == 1 and not ints[B.CENTRIFUGAL]
    return plain and ints[B.OUTER_NODES] + ints[B.INNER_NODES] + ints[B.SPIN_NODES] == 0


@njit(cache=True, error_model="numpy")
def plain_balls(ints, reals, cosine, sine, want, work):
    """Write the forces of plain balls and their sums: what `one_path` adds, with all sums in registers.

    Parameters
    ----------
    ints, reals, want, work
        As in `element_sums`.
    cosine, sine : float
        Of the cage's angle.
    """
    p, at = ints[B.AT_PATHS], ints[B.AT_ELEMENTS]
    radius, height = reals[p + B.PATH_RADIUS], reals[p + B.PATH_HEIGHT]
    stiffness, chi = reals[B.STIFFNESS], reals[B.DAMPING]
    radial, axial, distance = reals[p + B.PATH_RADIAL], reals[p + B.PATH_AXIAL] + work[2], reals[B.DISTANCE]
    width = reals[B.SMOOTH]
    d0, d1, a0, a1 = work[0], work[1], work[B.S_TILT], work[B.S_TILT + 1]
    v0, v1, v2 = work[B.S_V], work[B.S_V + 1], work[B.S_V + 2]
    rate0, rate1 = work[B.S_TILT + 2], work[B.S_TILT + 3]
    turn = work[B.S_CAGE] * work[B.S_W + 2]
    law, profile = vector_at(work, B.S_LAW, B.LAW), vector_at(work, B.S_LOCAL + B.BETA * (12 + 2 * B.BETA), 8)
    for k in range(8):
        profile[k] = 0.0
    f0 = f1 = f2 = f3 = f4 = by_cage = normal = 0.0
    energy = damping = largest = loaded = deepest = 0.0
    for _ in range(ints[B.ELEMENTS]):
        own_c, own_s = reals[at + B.ELEMENT_COSINE], reals[at + B.ELEMENT_SINE]
        reach = distance - reals[at + B.ELEMENT_OVERSIZE] - width
        at += B.ELEMENT_COLUMNS
        c, s = cosine * own_c - sine * own_s, sine * own_c + cosine * own_s
        phi = a0 * c + a1 * s
        x, y = radial + d0 * c + d1 * s + height * phi, axial - radius * phi
        square = x * x + y * y
        if square <= reach * reach:
            continue
        length = np.sqrt(square)
        delta, nx, ny = length - reach - width, x / length, y / length
        part, part_slope = delta, 1.0
        if width > 0.0:
            part, part_slope = positive_part(delta, width)
        lever = nx * height - ny * radius
        along = nx * (d1 * c - d0 * s) + lever * (a1 * c - a0 * s)
        rate = nx * (v0 * c + v1 * s) + ny * v2 + lever * (rate0 * c + rate1 * s) + along * turn
        root = stiffness * np.sqrt(part)
        elastic = root * part
        factor = 1.0 + chi * rate
        if want & DIAGNOSTICS:
            energy += hertz_energy(stiffness, 1.5, delta, width, reals[B.SMOOTH_WORK])
        if factor <= 0.0:
            # it parts faster than the surfaces follow: nothing is given back
            damping -= elastic * rate
            continue
        f = elastic * factor
        across, turning = f * nx, f * lever
        f0, f1, f2 = f0 - across * c, f1 - across * s, f2 - f * ny
        f3, f4, by_cage, normal = f3 - turning * c, f4 - turning * s, by_cage - f * along, normal + f
        damping += elastic * chi * rate * rate
        loaded += 1.0
        largest, deepest = max(largest, f), max(deepest, delta)
        if want & DERIVATIVES:
            write_ball_law(elastic, 1.5 * root * part_slope, nx, ny, length, law)
            path_slopes(ints, reals, work, c, s, 0, -1, f, factor)
    work[B.S_LOCAL], work[B.S_LOCAL + 1], work[B.S_LOCAL + 2] = f0, f1, f2
    work[B.S_LOCAL + 3], work[B.S_LOCAL + 4], work[B.S_LOCAL + B.PSI] = f3, f4, by_cage
    work[B.S_SUMS] = normal
    if want & DIAGNOSTICS:
        work[B.S_SUMS + 1], work[B.S_SUMS + 2], work[B.S_SUMS + 3] = energy, damping, largest
        work[B.S_SUMS + 4], work[B.S_SUMS + 5] = loaded, deepest


@njit(cache=True, error_model="numpy")
def one_path(ints, reals, states, want, work, j, path, c, s, load):
    """Add one contact path of one element.

    Parameters
    ----------
    ints, reals, states, want, work
        As in `element_sums`.
    j, path : int
        Element and its path.
    c, s : float
        Cosine and sine of the element's angle.
    load : float
        Centrifugal load of an element, N.
    """
    p = ints[B.AT_PATHS] + B.PATH_COLUMNS * path
    radius, height, share = reals[p + B.PATH_RADIUS], reals[p + B.PATH_HEIGHT], reals[p + B.PATH_SHARE]
    u_r, u_t = work[0] * c + work[1] * s, work[1] * c - work[0] * s
    a0, a1 = work[B.S_TILT], work[B.S_TILT + 1]
    phi, phi_t = a0 * c + a1 * s, a1 * c - a0 * s
    lift = u_r + height * phi
    axial = work[2] - radius * phi
    profile = vector_at(work, B.S_LOCAL + (B.BETA + ints[B.SPINS]) * (12 + 2 * (B.BETA + ints[B.SPINS])), 8)
    h = (
        missing(ints, reals, states, want, work, j, path, profile)
        - reals[ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j + B.ELEMENT_OVERSIZE]
    )
    law = vector_at(work, B.S_LAW, B.LAW)
    energy = 0.0
    if ints[B.KIND] == B.BALL:
        x, y = reals[p + B.PATH_RADIAL] + lift, reals[p + B.PATH_AXIAL] + axial
        if ints[B.CENTRIFUGAL]:
            delta, energy = shared_centre(ints, reals, want, work, path, x, y, u_r, phi, h, load, law)
        else:
            delta = ball_law(
                share * reals[B.STIFFNESS], reals[B.EXPONENT], reals[B.DISTANCE], reals[B.SMOOTH], x, y, h, law
            )
    else:
        nx, ny = reals[p + B.PATH_RADIAL], reals[p + B.PATH_AXIAL]
        delta = nx * lift + ny * axial - reals[p + B.PATH_GAP] - h
        if ints[B.CENTRIFUGAL]:
            delta, energy = roller_law_at_speed(reals, share, nx, ny, delta, load, law)
        else:
            roller_law(share * reals[B.STIFFNESS], reals[B.EXPONENT], reals[B.SMOOTH], nx, ny, delta, law)
    if want & DIAGNOSTICS:
        if not ints[B.CENTRIFUGAL]:
            energy = hertz_energy(
                share * reals[B.STIFFNESS], reals[B.EXPONENT], delta, reals[B.SMOOTH], reals[B.SMOOTH_WORK]
            )
        work[B.S_SUMS + 1] += energy
    if law[0] <= 0.0:
        return
    nx, ny = law[1], law[2]
    lever = nx * height - ny * radius
    psi_rate = work[B.S_CAGE] * work[B.S_W + 2]
    along = nx * u_t + lever * phi_t - profile[0] - profile[1]
    rate = nx * (work[B.S_V] * c + work[B.S_V + 1] * s) + ny * work[B.S_V + 2]
    rate += lever * (work[B.S_TILT + 2] * c + work[B.S_TILT + 3] * s) + along * psi_rate
    rate += profile[1] * work[B.S_THETA_RATE] - profile[2] * reals[B.SPIN] * work[B.S_W + 2]
    factor = 1.0 + reals[B.DAMPING] * rate
    if factor <= 0.0:
        # it parts faster than the surfaces follow: nothing is given back
        if want & DIAGNOSTICS:
            work[B.S_SUMS + 2] -= law[0] * rate
        return
    f = law[0] * factor
    forces = B.S_LOCAL
    work[forces] -= f * nx * c
    work[forces + 1] -= f * nx * s
    work[forces + 2] -= f * ny
    work[forces + 3] -= f * lever * c
    work[forces + 4] -= f * lever * s
    work[forces + B.PSI] -= f * along
    work[forces + B.THETA] -= f * profile[1]
    spin = ints[B.INTEGERS + 2 * ints[B.PATHS] + j]
    if spin >= 0:
        work[forces + B.BETA + spin] += f * profile[2]
    work[B.S_SUMS] += f
    if want & DIAGNOSTICS:
        work[B.S_SUMS + 2] += law[0] * reals[B.DAMPING] * rate * rate
        work[B.S_SUMS + 3] = max(work[B.S_SUMS + 3], f)
        work[B.S_SUMS + 4] += 1.0 / ints[B.PATHS]
        work[B.S_SUMS + 5] = max(work[B.S_SUMS + 5], delta)
    if want & DERIVATIVES:
        path_slopes(ints, reals, work, c, s, path, spin, f, factor)


@njit(cache=True, error_model="numpy")
def shared_centre(ints, reals, want, work, path, x, y, u_r, phi, h, load, law):
    """Write a path's contact of a ball with centrifugal load; return its deflection and, with the first path, energy.

    The centre of a four-point bearing's ball is found with the first path and kept in the scratch for the second.

    Parameters
    ----------
    ints, reals, want, work
        As in `element_sums`.
    path : int
    x, y : float
        From the groove centre of the outer to that of the inner ring, m.
    u_r, phi : float
        Radial displacement and tilt of the inner ring at the ball.
    h, load : float
        Missing material, m, and centrifugal load, N.
    law : ndarray
        See `ball_law_at_speed`.
    """
    p = ints[B.AT_PATHS] + B.PATH_COLUMNS * path
    other = ints[B.AT_PATHS] + B.PATH_COLUMNS * (ints[B.PATHS] - 1 - path)
    height = reals[other + B.PATH_HEIGHT]
    other_x = reals[other + B.PATH_RADIAL] + u_r + height * phi
    other_y = reals[other + B.PATH_AXIAL] + work[2] - reals[other + B.PATH_RADIUS] * phi
    energy, apart = 0.0, reals[B.OUTER_APART]
    vz = work[B.S_CENTRE + 1] - apart
    if path == 0:
        vr, vz = ball_centre(reals, x, y, other_x, other_y, h, load)
        work[B.S_CENTRE], work[B.S_CENTRE + 1] = vr, vz
        if want & DIAGNOSTICS:
            energy = ball_potential(reals, x, y, other_x, other_y, h, load, vr, vz)
    else:
        apart = -apart
    twist = height - reals[p + B.PATH_HEIGHT]
    delta = ball_law_at_speed(reals, x, y, other_x, other_y, apart, twist, h, work[B.S_CENTRE], vz, law)
    return delta, energy


@njit(cache=True, error_model="numpy")
def missing(ints, reals, states, want, work, j, path, out):
    """Return the missing material at an element's path; write the slopes and curvatures of the three profiles.

    Parameters
    ----------
    ints, reals, states, want, work, j, path
        As in `one_path`.
    out : ndarray, shape (6,)
        Slopes of the outer ring's, the inner ring's and the element's profile, then their curvatures.
    """
    for k in range(6):
        out[k] = 0.0
    total = 0.0
    outer, inner = ints[B.INTEGERS + path], ints[B.INTEGERS + ints[B.PATHS] + path]
    place = states[0] + reals[ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j + B.ELEMENT_PLACE]
    for k in range(3):
        if k == 0:
            row, nodes, at, angle = outer, ints[B.OUTER_NODES], ints[B.AT_OUTER], place
        elif k == 1:
            row, nodes, at, angle = inner, ints[B.INNER_NODES], ints[B.AT_INNER], place - work[B.S_THETA]
        else:
            row, nodes, at = ints[B.INTEGERS + 2 * ints[B.PATHS] + j], ints[B.SPIN_NODES], ints[B.AT_SPIN]
            angle = states[1 + row] if row >= 0 else 0.0
        if nodes == 0 or row < 0:
            continue
        first = at + row * (nodes + 3)
        interval, part = place_of(nodes, angle)
        total += profile_value(reals, first, interval, part)
        out[k] = profile_slope(reals, first, nodes, interval, part)
        if want & DERIVATIVES:
            out[3 + k] = profile_curvature(reals, first, nodes, interval, part)
    return total


@njit(cache=True, error_model="numpy")
def path_slopes(ints, reals, work, c, s, path, spin, f, factor):
    """Add the derivatives of the generalised forces of one path.

    Parameters
    ----------
    ints, reals, work
        As in `element_sums`; the contact is at ``S_LAW``.
    c, s : float
        Cosine and sine of the element's angle.
    path, spin : int
        The element's path and its spin or -1.
    f, factor : float
        Force, and 1 + chi delta'.
    """
    n = B.BETA + ints[B.SPINS]
    base = B.S_LOCAL
    stiff = matrix_at(work, base + n, n, n)
    damp = matrix_at(work, base + n + n * n, n, n)
    by_load = vector_at(work, base + n + 2 * n * n, n)
    sum_q = vector_at(work, base + 2 * n + 2 * n * n, n)
    sum_v = vector_at(work, base + 3 * n + 2 * n * n, n)
    at = base + 4 * n + 2 * n * n
    gx, gy, gh = vector_at(work, at, n), vector_at(work, at + n, n), vector_at(work, at + 2 * n, n)
    g, turned, slope = vector_at(work, at + 3 * n, n), vector_at(work, at + 4 * n, n), vector_at(work, at + 5 * n, n)
    rates, bent = vector_at(work, at + 6 * n, n), vector_at(work, at + 7 * n, n)
    profile = vector_at(work, at + 8 * n, 8)
    p = ints[B.AT_PATHS] + B.PATH_COLUMNS * path
    radius, height = reals[p + B.PATH_RADIUS], reals[p + B.PATH_HEIGHT]
    law = vector_at(work, B.S_LAW, B.LAW)
    nx, ny = law[1], law[2]
    u_r, u_t = work[0] * c + work[1] * s, work[1] * c - work[0] * s
    a0, a1 = work[B.S_TILT], work[B.S_TILT + 1]
    phi, phi_t = a0 * c + a1 * s, a1 * c - a0 * s
    lever = nx * height - ny * radius
    for k in range(n):
        gx[k] = gy[k] = gh[k] = rates[k] = bent[k] = 0.0
    gx[0], gx[1], gx[3], gx[4], gx[B.PSI] = c, s, height * c, height * s, u_t + height * phi_t
    gy[2], gy[3], gy[4], gy[B.PSI] = 1.0, -radius * c, -radius * s, -radius * phi_t
    gh[B.PSI], gh[B.THETA] = profile[0] + profile[1], -profile[1]
    for k in range(3):
        rates[k] = work[B.S_V + k]
    rates[3], rates[4] = work[B.S_TILT + 2], work[B.S_TILT + 3]
    rates[B.PSI], rates[B.THETA] = work[B.S_CAGE] * work[B.S_W + 2], work[B.S_THETA_RATE]
    if spin >= 0:
        gh[B.BETA + spin] = profile[2]
        rates[B.BETA + spin] = reals[B.SPIN] * work[B.S_W + 2]
    sweep = 0.0
    for k in range(n):
        g[k] = nx * gx[k] + ny * gy[k] - gh[k]
        turned[k] = nx * gy[k] - ny * gx[k]
        sweep += turned[k] * rates[k]
    # second derivatives of delta at a fixed normal
    h0, h1, h3, h4 = -s * nx, c * nx, -s * lever, c * lever
    h55 = -u_r * nx - phi * lever - profile[3] - profile[4]
    p_rate = rates[B.PSI]
    bent[0], bent[1], bent[3], bent[4] = h0 * p_rate, h1 * p_rate, h3 * p_rate, h4 * p_rate
    bent[B.PSI] = h0 * rates[0] + h1 * rates[1] + h3 * rates[3] + h4 * rates[4] + h55 * p_rate
    bent[B.PSI] += profile[4] * rates[B.THETA]
    bent[B.THETA] = profile[4] * (p_rate - rates[B.THETA])
    if spin >= 0:
        bent[B.BETA + spin] = -profile[5] * rates[B.BETA + spin]
    chi = law[0] * reals[B.DAMPING]
    for k in range(n):
        tilt = c if k == 3 else (s if k == 4 else (phi_t if k == B.PSI else 0.0))
        push = law[3] * gx[k] + law[4] * gy[k] + law[5] * gh[k] + law[11] * tilt
        veer = law[7] * gx[k] + law[8] * gy[k] + law[9] * gh[k] + law[12] * tilt
        slope[k] = factor * push + chi * (sweep * veer + bent[k])
        sum_q[k] += slope[k]
        sum_v[k] += chi * g[k]
        # f T x d(alpha)
        for m in range(n):
            stiff[m, k] -= g[m] * slope[k] + f * turned[m] * veer
            damp[m, k] -= chi * g[m] * g[k]
        by_load[k] -= g[k] * (factor * law[6] + chi * sweep * law[10]) + f * turned[k] * law[10]
    # sum of the forces by the centrifugal load
    profile[6] += factor * law[6] + chi * sweep * law[10]
    stiff[0, B.PSI] -= f * h0
    stiff[B.PSI, 0] -= f * h0
    stiff[1, B.PSI] -= f * h1
    stiff[B.PSI, 1] -= f * h1
    stiff[3, B.PSI] -= f * h3
    stiff[B.PSI, 3] -= f * h3
    stiff[4, B.PSI] -= f * h4
    stiff[B.PSI, 4] -= f * h4
    stiff[B.PSI, B.PSI] -= f * h55
    stiff[B.PSI, B.THETA] -= f * profile[4]
    stiff[B.THETA, B.PSI] -= f * profile[4]
    stiff[B.THETA, B.THETA] += f * profile[4]
    if spin >= 0:
        stiff[B.BETA + spin, B.BETA + spin] += f * profile[5]
