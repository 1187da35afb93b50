"""Sums over the rolling elements: generalised forces on the local coordinates and their derivatives.

Local coordinates q, in the axes of J: displacement d (3), components of the inner ring's axis along x and y (2), cage
angle psi seen from J, angle theta of the inner ring, spins beta of elements with a profile. What one contact does is
stated in `gearmbs.bearings.definitions`; here is asked what touches, and

    h = h_o(theta_j) + h_i(theta_j - theta) + h_b(beta_j) - oversize,    theta_j = psi + place.
"""

from __future__ import annotations

import numpy as np

from gearmbs.bearings import definitions
from gearmbs.bearings import derived as D
from gearmbs.bearings import layout as B
from gearmbs.bearings.laws_kernel import (
    ball_centre,
    ball_law_at_speed,
    ball_potential,
    hertz_energy,
    positive_part,
    roller_law_at_speed,
)
from gearmbs.bearings.layout import place_of, profile_curvature, profile_slope, profile_value
from gearmbs.dae.equations.loads.forces import DERIVATIVES, DIAGNOSTICS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at

in_plane, groove_centres, ball_approach, roller_approach = (
    njit(cache=True, error_model="numpy")(getattr(definitions, law))
    for law in ("in_plane", "groove_centres", "ball_approach", "roller_approach")
)


@njit(cache=True, error_model="numpy")
def element_sums(ints, reals, states, want, work):
    """Write the generalised forces and the sums over all elements, and their derivatives if wanted.

    ``work`` holds the local coordinates and rates, see `gearmbs.bearings.layout`.
    """
    ints, reals, states, work = uncounted(ints), uncounted(reals), uncounted(states), uncounted(work)
    n = B.BETA + ints[B.SPINS]
    forces = vector_at(work, B.S_LOCAL, n + 1)
    stiff = matrix_at(work, B.S_LOCAL + n + 1, n + 1, n)
    damp = matrix_at(work, B.S_LOCAL + (n + 1) * (n + 1), n + 1, n)
    by_load = vector_at(work, B.S_LOCAL + (n + 1) * (2 * n + 1), n + 1)
    for k in range((n + 1) * (2 * n + 2) if want & DERIVATIVES else n + 1):
        work[B.S_LOCAL + k] = 0.0
    for k in range(B.SUMS):
        work[B.S_SUMS + k] = 0.0
    work[B.S_RATES + 5] = work[B.S_CAGE] * work[B.S_W + 2]
    work[B.S_RATES + 6] = work[B.S_THETA_RATE]
    work[B.S_RATES + 7] = reals[B.SPIN] * work[B.S_W + 2]
    load = 0.0
    if ints[B.CENTRIFUGAL]:
        cage = work[B.S_SPIN] + work[B.S_CAGE] * work[B.S_W + 2]
        load = reals[B.MASS_RADIUS] * cage * cage
    # most bearings: then the coordinates in the plane of an element are three
    plain = ints[B.OUTER_NODES] + ints[B.INNER_NODES] + ints[B.SPIN_NODES] + ints[B.CENTRIFUGAL] == 0
    motion, sums = vector_at(work, B.S_MOTION, B.MOTION), vector_at(work, B.S_PLANE_SUMS, B.PLANE_SUMS)
    cosine, sine = np.cos(states[0]), np.sin(states[0])
    for j in range(ints[B.ELEMENTS]):
        at = ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j
        c = cosine * reals[at + B.ELEMENT_COSINE] - sine * reals[at + B.ELEMENT_SINE]
        s = sine * reals[at + B.ELEMENT_COSINE] + cosine * reals[at + B.ELEMENT_SINE]
        put_in_plane(work, c, s)
        if plain:
            if paths_of(ints, reals, states, want, work, j, c, s, True, 0.0):
                D.plain_element_forces(motion, c, s, sums, forces, n)
                if want & DERIVATIVES:
                    D.plain_element_slopes(motion, c, s, sums, stiff, damp, n)
            continue
        if paths_of(ints, reals, states, want, work, j, c, s, False, load):
            spin = ints[B.INTEGERS + 2 * ints[B.PATHS] + j]
            # an element without a spin adds zeros to what the inner ring's angle feels
            spin = B.BETA + spin if spin >= 0 else B.THETA
            D.element_forces(motion, c, s, sums, forces, n, spin)
            if want & DERIVATIVES:
                D.element_slopes(motion, c, s, sums, stiff, damp, n, spin, by_load)
    work[B.S_SUMS] = forces[n]


@njit(cache=True, error_model="numpy", forceinline=True)
def put_in_plane(work, c, s):
    """Write u, w and phi of an element in the direction (c, s)."""
    at, tilt = B.S_PLANE, B.S_TILT
    work[at], work[at + 1], work[at + 2] = in_plane(work[0], work[1], work[2], work[tilt], work[tilt + 1], c, s)


@njit(cache=True, error_model="numpy", forceinline=True)
def paths_of(ints, reals, states, want, work, j, c, s, plain, load):
    """Write the sums over the paths of an element, in its plane; return whether any presses.

    Parameters
    ----------
    ints, reals, states, want, work
        As in `element_sums`.
    j : int
        Element; its displacements are at ``S_PLANE``, the rates are put there when it touches.
    c, s : float
        Cosine and sine of its angle.
    plain : bool
        Whether there are neither profiles nor centrifugal load.
    load : float
        Centrifugal load of an element, N.
    """
    motion, plane = vector_at(work, B.S_MOTION, B.MOTION), vector_at(work, B.S_PLANE, B.PLANE)
    sums = vector_at(work, B.S_PLANE_SUMS, B.PLANE_SUMS)
    law, profile = vector_at(work, B.S_LAW, B.LAW), vector_at(work, B.S_PROFILE, 6)
    chi, presses = reals[B.DAMPING], False
    # an element of a row has so many paths; what presses on it so far
    own, pressed = ints[B.PATHS] // ints[B.ROWS], 0.0
    for path in range(ints[B.PATHS]):
        if path % own == 0:
            pressed = 0.0
        p = ints[B.AT_PATHS] + B.PATH_COLUMNS * path
        radius, height = reals[p + B.PATH_RADIUS], reals[p + B.PATH_HEIGHT]
        h = -reals[ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j + B.ELEMENT_OVERSIZE]
        if not plain:
            h += missing(ints, reals, reals, states, want, work, j, path, profile)
        delta, energy = touch(ints, reals, want, work, path, h, load)
        if want & DIAGNOSTICS:
            work[B.S_SUMS + 1] += energy
        if law[0] <= 0.0:
            continue
        if plain:
            D.plain_element_rates(motion, c, s, plane)
            rate = D.plain_contact_rate(plane, law, radius, height)
        else:
            D.element_rates(motion, c, s, plane)
            rate = D.contact_rate(plane, law, profile, radius, height)
        factor = 1.0 + chi * rate
        if factor <= 0.0:
            # it parts faster than the surfaces follow: nothing is given back
            work[B.S_SUMS + 2] -= law[0] * rate
            continue
        if not presses:
            presses = True
            for k in range(B.PLANE_FORCES):
                sums[k] = 0.0
            if want & DERIVATIVES:
                for k in range(B.PLANE_FORCES, B.PLAIN_SUMS if plain else B.PLANE_SUMS):
                    sums[k] = 0.0
        if plain:
            D.plain_contact_forces(plane, law, radius, height, chi, sums)
            if want & DERIVATIVES:
                D.plain_contact_slopes(plane, law, radius, height, chi, sums)
        else:
            D.contact_forces(plane, law, profile, radius, height, chi, sums)
            if want & DERIVATIVES:
                D.contact_slopes(plane, law, profile, radius, height, chi, sums)
        if want & DIAGNOSTICS:
            work[B.S_SUMS + 2] += law[0] * chi * rate * rate
            if pressed == 0.0:
                work[B.S_SUMS + 4] += 1.0
            # slices of a roller share its load along one normal; of a ball's two lines the one with more is told
            force = law[0] * factor
            pressed = pressed + force if ints[B.KIND] == B.ROLLER else max(pressed, force)
            work[B.S_SUMS + 3] = max(work[B.S_SUMS + 3], pressed)
            work[B.S_SUMS + 5] = max(work[B.S_SUMS + 5], delta)
    return presses


@njit(cache=True, error_model="numpy", forceinline=True)
def touch(ints, reals, want, work, path, h, load):
    """Write the law of a path's contact; return its deflection and, if wanted, energy.

    Parameters
    ----------
    ints, reals, want, work
        As in `element_sums`; the element's displacements are at ``S_PLANE``.
    path : int
    h, load : float
        Missing material, m, and centrifugal load, N.
    """
    p = ints[B.AT_PATHS] + B.PATH_COLUMNS * path
    u, w, phi = work[B.S_PLANE], work[B.S_PLANE + 1], work[B.S_PLANE + 2]
    radius, height, share = reals[p + B.PATH_RADIUS], reals[p + B.PATH_HEIGHT], reals[p + B.PATH_SHARE]
    stiffness, width, law = share * reals[B.STIFFNESS], reals[B.SMOOTH], vector_at(work, B.S_LAW, B.LAW)
    law[0] = 0.0
    if ints[B.KIND] == B.BALL:
        x, y = groove_centres(u, w, phi, reals[p + B.PATH_RADIAL], reals[p + B.PATH_AXIAL], radius, height)
        if ints[B.CENTRIFUGAL]:
            return shared_centre(ints, reals, want, work, path, x, y, u, phi, h, load, law)
        reach = reals[B.DISTANCE] + h - width
        if reach > 0.0 and x * x + y * y <= reach * reach:
            # most balls do not touch, and need no root
            return -width, 0.0
        delta = ball_approach(x, y, reals[B.DISTANCE]) - h
        if delta > -width:
            part, part_slope = positive_part(delta, width)
            D.ball_contact(x, y, stiffness, part, part_slope, law)
    else:
        nx, ny = reals[p + B.PATH_RADIAL], reals[p + B.PATH_AXIAL]
        x, y = groove_centres(u, w, phi, 0.0, 0.0, radius, height)
        delta = roller_approach(x, y, nx, ny, reals[p + B.PATH_GAP]) - h
        if ints[B.CENTRIFUGAL]:
            return roller_law_at_speed(reals, share, nx, ny, delta, load, law)
        if delta > -width:
            part, part_slope = positive_part(delta, width)
            D.roller_contact(nx, ny, stiffness, reals[B.EXPONENT], part, part_slope, law)
    energy = 0.0
    if want & DIAGNOSTICS:
        energy = hertz_energy(stiffness, reals[B.EXPONENT], delta, width, reals[B.SMOOTH_WORK])
    return delta, energy


@njit(cache=True, error_model="numpy", forceinline=True)
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


@njit(cache=True, error_model="numpy", forceinline=True)
def missing(ints, reals, profiles, states, want, work, j, path, out):
    """Return the missing material at an element's path; write the slopes and curvatures of the three profiles.

    Parameters
    ----------
    ints, reals, states, want, work, j
        As in `paths_of`.
    profiles : ndarray
        Where the profiles are: ``reals``, or a change of it.
    path : int
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
        total += profile_value(profiles, first, interval, part)
        out[k] = profile_slope(profiles, first, nodes, interval, part)
        if want & DERIVATIVES:
            out[3 + k] = profile_curvature(profiles, first, nodes, interval, part)
    return total
