"""How a bearing's wrench and rates change with its parameters: derivatives along a change of its reals.

A setting, as the stiffness or the clearance, stands in several reals of the tables, and these in the forces of all
elements. With dp along a setting, forces and coordinates q change by

    dG = G_p dp + K q_p dp + D q'_p dp;

q and q' depend on parameters where rings are misaligned, and by the speeds of cage and elements.
"""

from __future__ import annotations

import numpy as np

from gearmbs.bearings import derived as D
from gearmbs.bearings import layout as B
from gearmbs.bearings.elements_kernel import element_sums, groove_centres, missing, put_in_plane, touch
from gearmbs.bearings.kernel import cage_rate, measure
from gearmbs.bearings.layout import place_of, profile_value
from gearmbs.dae.equations.loads.forces import DERIVATIVES, FRAME_A
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, vector_at

CHANGES = 11


@njit("void(i8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1])", cache=True, error_model="numpy")
def bearing_force_changed(ints, reals, changed, frames, states, work, out):
    """Write the derivatives of the wrench on the inner ring and of the rates along a change of the reals.

    Parameters
    ----------
    ints, reals, frames, states, work
        As of `gearmbs.bearings.kernel.bearing_force`; without centrifugal load.
    changed : ndarray
        Derivatives of ``reals`` by a parameter.
    out : ndarray, shape (6 + states,)
        F, N and the rates by the parameter, global components.
    """
    measure(ints, reals, frames, work)
    cage_rate(ints, reals, states[0], work)
    element_sums(ints, reals, states, DERIVATIVES, work)
    n, spins = B.BETA + ints[B.SPINS], ints[B.SPINS]
    forces = vector_at(work, B.S_LOCAL, n + 1)
    stiff = matrix_at(work, B.S_LOCAL + n + 1, n + 1, n)
    damp = matrix_at(work, B.S_LOCAL + (n + 1) * (n + 1), n + 1, n)
    at = B.variations(n)
    moved, moved_rates = vector_at(work, at, n), vector_at(work, at + n, n)
    grown = vector_at(work, at + 2 * n, n + 1)
    axis = vector_at(work, at + 3 * n + 1, 3)
    cage, spin = cage_changed(ints, reals, changed, states[0], work), changed[B.SPIN]
    place_changed(reals, changed, frames, work, axis)
    a, speed, total = B.S_A, work[B.S_W + 2], work[B.S_SUMS]
    for k in range(n):
        moved[k] = moved_rates[k] = 0.0
    for k in range(2):
        moved[3 + k] = axis[k] - changed[B.OUTER_TILT + k]
    # a' = w x a
    moved_rates[3] = work[B.S_W + 1] * axis[2] - speed * axis[1]
    moved_rates[4] = speed * axis[0] - work[B.S_W] * axis[2]
    moved_rates[B.PSI] = cage * speed
    for k in range(spins):
        moved_rates[B.BETA + k] = spin * speed
    for r in range(n + 1):
        grown[r] = 0.0
        for k in range(n):
            grown[r] += stiff[r, k] * moved[k] + damp[r, k] * moved_rates[k]
    elements_changed(ints, reals, changed, states, work, vector_at(work, at + 3 * n + 4, CHANGES + 6), grown)
    torque = D.friction_torque_changed(
        reals[B.ROLLING], reals[B.VISCOUS], reals[B.SLOW], total, speed,
        changed[B.ROLLING], changed[B.VISCOUS], changed[B.SLOW],
    )  # fmt: skip
    torque += D.friction_torque(reals[B.ROLLING], reals[B.VISCOUS], reals[B.SLOW], total, speed)[1] * grown[n]
    # N = a x G_a + G_theta g + (kappa_c G_psi + kappa_b sum G_beta + T) z
    torque += cage * forces[B.PSI] + work[B.S_CAGE] * grown[B.PSI]
    for k in range(spins):
        torque += spin * forces[B.BETA + k] + reals[B.SPIN] * grown[B.BETA + k]
        out[7 + k] = spin * speed
    out[6] = cage * speed
    turn = grown[B.THETA]
    nx = turn * work[B.S_TURN] - work[a + 2] * grown[4] - axis[2] * forces[4]
    ny = turn * work[B.S_TURN + 1] + work[a + 2] * grown[3] + axis[2] * forces[3]
    nz = turn * work[B.S_TURN + 2] + work[a] * grown[4] - work[a + 1] * grown[3] + torque
    nz += axis[0] * forces[4] - axis[1] * forces[3]
    for c in range(3):
        e0, e1, e2 = frames[1, FRAME_A + 3 * c], frames[1, FRAME_A + 3 * c + 1], frames[1, FRAME_A + 3 * c + 2]
        out[c] = e0 * grown[0] + e1 * grown[1] + e2 * grown[2]
        out[3 + c] = e0 * nx + e1 * ny + e2 * nz


@njit(cache=True, error_model="numpy")
def cage_changed(ints, reals, changed, psi, work):
    """Return the change of kappa_c, kappa (1 - s(psi))."""
    nodes = ints[B.SLIP_NODES]
    if nodes == 0:
        return changed[B.CAGE]
    interval, part = place_of(nodes, psi / reals[B.SLIP_TURNS])
    slip = profile_value(changed, ints[B.AT_SLIP], interval, part)
    return changed[B.CAGE] * (work[B.S_CAGE] / reals[B.CAGE]) - reals[B.CAGE] * slip


@njit(cache=True, error_model="numpy")
def place_changed(reals, changed, frames, work, axis):
    """Write the change of the inner ring's axis in the axes of J."""
    for k in range(3):
        axis[k] = 0.0
        for c in range(3):
            row = frames[0, FRAME_A + 3 * c] * changed[B.INNER_AXIS]
            row += frames[0, FRAME_A + 3 * c + 1] * changed[B.INNER_AXIS + 1]
            row += frames[0, FRAME_A + 3 * c + 2] * changed[B.INNER_AXIS + 2]
            axis[k] += frames[1, FRAME_A + 3 * c + k] * row


@njit(cache=True, error_model="numpy")
def elements_changed(ints, reals, changed, states, work, scratch, grown):
    """Add the changes of the generalised forces of all elements at given q and q'.

    Parameters
    ----------
    ints, reals, changed, states, work
        As in `bearing_force_changed`; the coordinates are at ``S_MOTION``.
    scratch : ndarray
        Of a path: changes of its parameters, and of its profiles.
    grown : ndarray, shape (n + 1,)
    """
    n = B.BETA + ints[B.SPINS]
    motion, plane = vector_at(work, B.S_MOTION, B.MOTION), vector_at(work, B.S_PLANE, B.PLANE)
    law, profile = vector_at(work, B.S_LAW, B.LAW), vector_at(work, B.S_PROFILE, 6)
    sums, changes = vector_at(work, B.S_PLANE_SUMS, B.PLANE_SUMS), vector_at(scratch, 0, CHANGES)
    profile_changed = vector_at(scratch, CHANGES, 6)
    cosine, sine, chi = np.cos(states[0]), np.sin(states[0]), reals[B.DAMPING]
    for j in range(ints[B.ELEMENTS]):
        at = ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j
        c = cosine * reals[at + B.ELEMENT_COSINE] - sine * reals[at + B.ELEMENT_SINE]
        s = sine * reals[at + B.ELEMENT_COSINE] + cosine * reals[at + B.ELEMENT_SINE]
        put_in_plane(work, c, s)
        D.element_rates(motion, c, s, plane)
        for k in range(B.PLANE_FORCES):
            sums[k] = 0.0
        for path in range(ints[B.PATHS]):
            p = ints[B.AT_PATHS] + B.PATH_COLUMNS * path
            radius, height = reals[p + B.PATH_RADIUS], reals[p + B.PATH_HEIGHT]
            h = missing(ints, reals, reals, states, 0, work, j, path, profile) - reals[at + B.ELEMENT_OVERSIZE]
            delta = touch(ints, reals, 0, work, path, h, 0.0)[0]
            if law[0] <= 0.0 or 1.0 + chi * D.contact_rate(plane, law, profile, radius, height) <= 0.0:
                continue
            h = missing(ints, reals, changed, states, 0, work, j, path, profile_changed)
            path_changed(reals, changed, work, ints[B.KIND], p, delta, changes)
            changes[5] += h - changed[at + B.ELEMENT_OVERSIZE]
            for k in range(3):
                changes[8 + k] = profile_changed[k]
            D.contact_changed(plane, law, profile, radius, height, chi, changes, sums)
        spin = ints[B.INTEGERS + 2 * ints[B.PATHS] + j]
        D.element_forces(motion, c, s, sums, grown, n, B.BETA + spin if spin >= 0 else B.THETA)


@njit(cache=True, error_model="numpy")
def path_changed(reals, changed, work, kind, p, delta, changes):
    """Write the changes of the parameters of a path that presses, but for its profiles; see `definitions.CHANGES`.

    Parameters
    ----------
    reals, changed, work
        As in `bearing_force_changed`.
    kind, p : int
        Kind of the elements, place of the path among the reals.
    delta : float
        Deflection, m.
    changes : ndarray
        Out.
    """
    for k in range(4):
        changes[k] = changed[p + k]
    changes[4] = changed[B.DAMPING]
    if kind == B.BALL:
        changes[5], changes[7] = changed[B.DISTANCE], 0.0
    else:
        # its place is that of the normal
        changes[0] = changes[1] = 0.0
        plane = vector_at(work, B.S_PLANE, 3)
        radius, height = reals[p + B.PATH_RADIUS], reals[p + B.PATH_HEIGHT]
        x, y = groove_centres(plane[0], plane[1], plane[2], 0.0, 0.0, radius, height)
        approach, changes[7] = D.roller_changed(
            x, y, reals[p + B.PATH_RADIAL], reals[p + B.PATH_AXIAL], reals[p + B.PATH_GAP],
            changed[p + B.PATH_RADIAL], changed[p + B.PATH_AXIAL], changed[p + B.PATH_GAP],
        )  # fmt: skip
        changes[5] = -approach
    share, width = reals[p + B.PATH_SHARE], reals[B.SMOOTH]
    part, by_width = delta, 0.0
    if delta < width:
        part, by_width = D.smooth_part(delta, width)[0], D.smooth_part_by_width(delta, width)
    changes[6] = D.hertz_changed(
        share * reals[B.STIFFNESS], reals[B.EXPONENT], part,
        share * changed[B.STIFFNESS] + changed[p + B.PATH_SHARE] * reals[B.STIFFNESS], by_width * changed[B.SMOOTH],
    )  # fmt: skip
