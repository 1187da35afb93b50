"""The meshes of planets with a ring whose rim bends, as one force element.

The rim deforms in its plane by the modes of a thin ring of mid-line radius R that does not stretch, with amplitudes q:

    radially w = sum_j phi_j q_j,  tangentially sum_j phi_j'/n^2 q_j,  section turned by psi = -sum_j kappa_j phi_j' q_j

with phi_j = cos(n theta) or sin(n theta), n = 2, 3 .., kappa_j = (n^2 - 1)/(n^2 R), a prime for the derivative by the
angle.
A planet meshes with the piece of rim at its own angle theta in the ring's axes. That piece moves as a rigid wheel,

    by d = w e_r + w' e_t at the ring's centre and by psi about its axis,

so that the contact of undeformed teeth applies, and the load moves with the planet. With the piece's force F and moment
M the amplitudes feel Q_j = F . d_j + M_z psi_j. As the piece depends on where the planet is, the planet feels
S = F . d_theta + M_z psi_theta along theta, so that all forces are derivatives of one energy. What turning of the ring
would add to the inertia of its modes is left out: it has to be at rest or slow.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact.kernel import contact_at
from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG, FRAME_A, FRAME_COLUMNS, FRAME_P, FRAME_V, FRAME_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, vector_at

MESHES, MODES, PLACES = 1, 2, 3
"""In the integers, after the address of the contact: planets, modes, then four numbers a planet: where its pair's
integers begin, how many there are, and the same of its reals."""
WAVES, PHASE, MASS, UNIT = 0, 1, 2, 3
"""In the reals: rows of a table, one column a mode; then stiffness and damping matrices, and R. The unit is the largest
radial displacement by one unit of a state."""
ROWS = 4

ANGLE, RATE = 0, 1
"""In the piece's numbers: theta, theta'."""
TANGENT, ARM, SHIFT, DRIFT = 2, 5, 8, 11
"""Gradient of theta by the planet's place, planet's place from the ring's centre, A d, A d_theta; global."""
TURN, TURN_RATE, TURN_SLOPE = 14, 15, 16
"""psi, its rate at a place of the rim, psi_theta."""
RADIAL, ALONG = 17, 20
"""e_r and e_t, global."""
W0, W_RATE = 23, 27
"""w and its first three derivatives by theta; those of its rate at a place of the rim."""
PSI = 31
"""-psi by -kappa phi', its derivatives by theta: psi, psi_theta, psi_thetatheta; those of the rate."""
PSI_RATE = 34
FORCE, MOMENT, PUSH = 37, 40, 43
"""On the piece, about its centre; S."""
POSE = 44
"""The piece's frame, 18 numbers."""
PIECE = 62
CONTACT = 8
"""Diagnostics of a pair: energy, damping power, friction power, `DEPTHS` others, normal force."""
DEPTHS = 4
"""Penetrations of drive and coast flanks, and how many pairs touch on either."""


@njit(cache=True, error_model="numpy", forceinline=True)
def cross(a, i, b, j, out, k):
    """Write the cross product of ``a[i:i+3]`` and ``b[j:j+3]`` to ``out[k:k+3]``."""
    x = a[i + 1] * b[j + 2] - a[i + 2] * b[j + 1]
    y = a[i + 2] * b[j] - a[i] * b[j + 2]
    out[k + 2] = a[i] * b[j + 1] - a[i + 1] * b[j]
    out[k], out[k + 1] = x, y


@njit(cache=True, error_model="numpy", forceinline=True)
def dot(a, i, b, j):
    """Return the product of ``a[i:i+3]`` and ``b[j:j+3]``."""
    return a[i] * b[j] + a[i + 1] * b[j + 1] + a[i + 2] * b[j + 2]


@njit(cache=True, error_model="numpy")
def shapes(theta, table, out):
    """Write phi and its first four derivatives at an angle to ``out``, shape (modes, 5)."""
    for j in range(table.shape[1]):
        n = table[WAVES, j]
        angle = n * theta - 0.5 * np.pi * table[PHASE, j]
        c, s = table[UNIT, j] * np.cos(angle), table[UNIT, j] * np.sin(angle)
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4] = c, -n * s, -n * n * c, n**3 * s, n**4 * c


@njit(cache=True, error_model="numpy")
def locate(planet, ring, states, table, radius, phi, p):
    """Write where and how the piece of rim at a planet moves to ``p``, places as named above.

    Parameters
    ----------
    planet, ring : ndarray, shape (18,)
        Frames.
    states : ndarray
        Amplitudes, then their rates.
    table : ndarray, shape (ROWS, modes)
    radius : float
    phi : ndarray, shape (modes, 5)
        Written: the shapes at the planet.
    p : ndarray, shape (PIECE,)
    """
    m = table.shape[1]
    a = FRAME_A
    for c in range(3):
        p[ARM + c] = planet[FRAME_P + c] - ring[FRAME_P + c]
    x = ring[a] * p[ARM] + ring[a + 3] * p[ARM + 1] + ring[a + 6] * p[ARM + 2]
    y = ring[a + 1] * p[ARM] + ring[a + 4] * p[ARM + 1] + ring[a + 7] * p[ARM + 2]
    far = np.sqrt(x * x + y * y)
    p[ANGLE] = np.arctan2(y, x)
    c_, s_ = x / far, y / far
    for c in range(3):
        p[RADIAL + c] = c_ * ring[a + 3 * c] + s_ * ring[a + 3 * c + 1]
        p[ALONG + c] = -s_ * ring[a + 3 * c] + c_ * ring[a + 3 * c + 1]
        p[TANGENT + c] = p[ALONG + c] / far
    s = vector_at(p, FORCE, 6)
    cross(ring, FRAME_W, p, ARM, s, 0)
    for c in range(3):
        s[c] = planet[FRAME_V + c] - ring[FRAME_V + c] - s[c]
    p[RATE] = dot(p, TANGENT, s, 0)
    shapes(p[ANGLE], table, phi)
    for k in range(W0, PSI_RATE + 3):
        p[k] = 0.0
    for j in range(m):
        q, v = states[j], states[m + j]
        kappa = (1.0 - 1.0 / table[WAVES, j] ** 2) / radius
        for k in range(4):
            p[W0 + k] += phi[j, k] * q
            p[W_RATE + k] += phi[j, k] * v
        for k in range(3):
            p[PSI + k] -= kappa * phi[j, 1 + k] * q
            p[PSI_RATE + k] -= kappa * phi[j, 1 + k] * v
    for c in range(3):
        p[SHIFT + c] = p[W0] * p[RADIAL + c] + p[W0 + 1] * p[ALONG + c]
        p[DRIFT + c] = (p[W0] + p[W0 + 2]) * p[ALONG + c]
    p[TURN], p[TURN_RATE], p[TURN_SLOPE] = p[PSI], p[PSI_RATE] + p[PSI + 1] * p[RATE], p[PSI + 1]
    c_, s_ = np.cos(p[TURN]), np.sin(p[TURN])
    cross(ring, FRAME_W, p, SHIFT, s, 0)
    for c in range(3):
        p[POSE + FRAME_P + c] = ring[FRAME_P + c] + p[SHIFT + c]
        i = a + 3 * c
        p[POSE + i] = c_ * ring[i] + s_ * ring[i + 1]
        p[POSE + i + 1] = -s_ * ring[i] + c_ * ring[i + 1]
        p[POSE + i + 2] = ring[i + 2]
        rate = p[W_RATE] * p[RADIAL + c] + p[W_RATE + 1] * p[ALONG + c] + p[RATE] * p[DRIFT + c]
        p[POSE + FRAME_V + c] = ring[FRAME_V + c] + s[c] + rate
        p[POSE + FRAME_W + c] = ring[FRAME_W + c] + ring[i + 2] * p[TURN_RATE]


@njit(cache=True, error_model="numpy")
def hand_on(planet, ring, wrench, states, table, radius, phi, p, out, forces):
    """Write the planet's wrench with the force along its path to ``out``, and add those on the modes to ``forces``.

    Parameters
    ----------
    planet, ring : ndarray, shape (18,)
    wrench : ndarray, shape (6,)
        Of the contact, on the planet.
    states, table, radius, phi
        As of `locate`.
    p : ndarray, shape (PIECE,)
        Of `locate`; the piece's force and moment, and S, are written.
    out, forces : ndarray
        Wrench, 6 numbers; generalised forces Q, one a mode.
    """
    m = table.shape[1]
    s = np.empty(6)
    for c in range(3):
        p[FORCE + c] = -wrench[c]
        s[c] = planet[FRAME_P + c] - p[POSE + c]
    cross(s, 0, wrench, 0, s, 3)
    for c in range(3):
        p[MOMENT + c] = -wrench[3 + c] - s[3 + c]
    axial = ring[FRAME_A + 2] * p[MOMENT] + ring[FRAME_A + 5] * p[MOMENT + 1] + ring[FRAME_A + 8] * p[MOMENT + 2]
    radial, along = dot(p, FORCE, p, RADIAL), dot(p, FORCE, p, ALONG)
    for j in range(m):
        kappa = (1.0 - 1.0 / table[WAVES, j] ** 2) / radius
        forces[j] += radial * phi[j, 0] + along * phi[j, 1] - axial * kappa * phi[j, 1]
    p[PUSH] = along * (p[W0] + p[W0 + 2]) + axial * p[PSI + 1]
    for c in range(3):
        out[c] = wrench[c] + p[PUSH] * p[TANGENT + c]
        out[3 + c] = wrench[3 + c]


@njit(cache=True, error_model="numpy")
def vary_piece(planet, ring, states, table, radius, phi, p, dx, s):
    """Write the changes of where and how the piece moves to ``s[0:68]``; return that of theta.

    Parameters
    ----------
    planet, ring, states, table, radius, phi, p
        As of `locate`, which has been called.
    dx : ndarray
        Variations of planet and ring, twelve each, then of the states.
    s : ndarray
        Written: the ring's axis in ``s[0:3]``, changes of e_r, e_t and theta's gradient in ``s[12:21]``, of w and psi,
        their derivatives and rates in ``s[30:44]``, the piece's variations in ``s[44:56]``, the axis's in ``s[59:62]``.
    """
    m = table.shape[1]
    a = FRAME_A
    z = vector_at(s, 0, 3)
    for c in range(3):
        z[c] = ring[a + 3 * c + 2]
    # s[3:6] dr - dpi x r in space, then e_r, e_t, tangent changes
    cross(dx, 15, p, ARM, s, 6)
    for c in range(3):
        s[9 + c] = dx[c] - dx[12 + c]
        s[3 + c] = s[9 + c] - s[6 + c]
    d_angle = dot(p, TANGENT, s, 3)
    far = 1.0 / np.sqrt(dot(p, TANGENT, p, TANGENT))
    d_far = dot(p, RADIAL, s, 3)
    # changes of e_r, e_t (12, 15) and of the tangent (18)
    cross(dx, 15, p, RADIAL, s, 12)
    cross(dx, 15, p, ALONG, s, 15)
    for c in range(3):
        s[12 + c] += d_angle * p[ALONG + c]
        s[15 + c] -= d_angle * p[RADIAL + c]
        s[18 + c] = s[15 + c] / far - p[TANGENT + c] * d_far / far
    # theta': velocities of the planet against the ring in s[21:24]
    cross(ring, FRAME_W, p, ARM, s, 21)
    cross(dx, 21, p, ARM, s, 24)
    cross(ring, FRAME_W, s, 9, s, 27)
    for c in range(3):
        s[21 + c] = planet[FRAME_V + c] - ring[FRAME_V + c] - s[21 + c]
        s[24 + c] = dx[6 + c] - dx[18 + c] - s[24 + c] - s[27 + c]
    d_rate = dot(s, 18, s, 21) + dot(p, TANGENT, s, 24)
    # changes of w.., its rates, psi.., its rates in s[30:44]
    for k in range(4):
        s[30 + k] = 0.0
        s[34 + k] = 0.0
    for k in range(3):
        s[38 + k] = 0.0
        s[41 + k] = 0.0
    for j in range(m):
        kappa = (1.0 - 1.0 / table[WAVES, j] ** 2) / radius
        dq, dv = dx[24 + j], dx[24 + m + j]
        for k in range(4):
            s[30 + k] += phi[j, k] * dq + phi[j, k + 1] * d_angle * states[j]
            s[34 + k] += phi[j, k] * dv + phi[j, k + 1] * d_angle * states[m + j]
        for k in range(3):
            s[38 + k] -= kappa * (phi[j, 1 + k] * dq + phi[j, 2 + k] * d_angle * states[j])
            s[41 + k] -= kappa * (phi[j, 1 + k] * dv + phi[j, 2 + k] * d_angle * states[m + j])
    # the piece's variations in s[44:56]; changes of A d in s[56:59]
    drift, d_drift = p[W0] + p[W0 + 2], s[30] + s[32]
    turning = s[41] + s[39] * p[RATE] + p[PSI + 1] * d_rate
    cross(dx, 15, z, 0, s, 59)
    cross(dx, 21, p, SHIFT, s, 62)
    for c in range(3):
        s[56 + c] = s[30] * p[RADIAL + c] + p[W0] * s[12 + c] + s[31] * p[ALONG + c] + p[W0 + 1] * s[15 + c]
    cross(ring, FRAME_W, s, 56, s, 65)
    for c in range(3):
        s[44 + c] = dx[12 + c] + s[56 + c]
        s[47 + c] = dx[15 + c] + z[c] * s[38]
        rate = s[34] * p[RADIAL + c] + p[W_RATE] * s[12 + c] + s[35] * p[ALONG + c] + p[W_RATE + 1] * s[15 + c]
        rate += d_rate * p[DRIFT + c] + p[RATE] * (d_drift * p[ALONG + c] + drift * s[15 + c])
        s[50 + c] = dx[18 + c] + s[62 + c] + s[65 + c] + rate
        s[53 + c] = dx[21 + c] + s[59 + c] * p[TURN_RATE] + z[c] * turning
    return d_angle


@njit(cache=True, error_model="numpy")
def vary(planet, ring, wrench, jac, states, table, radius, phi, p, dx, s, out, forces):
    """Write the changes of what `hand_on` gives with those of the frames and states.

    Parameters
    ----------
    planet, ring, wrench, states, table, radius, phi, p
        As of `hand_on`, which has been called.
    jac : ndarray, shape (6, 24)
        Derivatives of the contact's wrench.
    dx : ndarray
        Variations of planet and ring, twelve each, then of the states.
    s : ndarray
        Scratch, 90 places.
    out, forces : ndarray
        As of `hand_on`, written: changes.
    """
    d_angle = vary_piece(planet, ring, states, table, radius, phi, p, dx, s)
    z = vector_at(s, 0, 3)
    drift, d_drift = p[W0] + p[W0 + 2], s[30] + s[32]
    # the contact's wrench in s[68:74]
    for r in range(6):
        total = 0.0
        for k in range(12):
            total += jac[r, k] * dx[k] + jac[r, 12 + k] * s[44 + k]
        s[68 + r] = total
    # the piece's force and moment in s[74:80]
    for c in range(3):
        s[80 + c] = planet[FRAME_P + c] - p[POSE + c]
        s[83 + c] = dx[c] - s[44 + c]
    cross(s, 80, s, 68, s, 86)
    cross(s, 83, wrench, 0, s, 80)
    for c in range(3):
        s[74 + c] = -s[68 + c]
        s[77 + c] = -s[71 + c] - s[86 + c] - s[80 + c]
    axial = dot(z, 0, p, MOMENT)
    d_axial = dot(z, 0, s, 77) + dot(s, 59, p, MOMENT)
    radial, along = dot(p, FORCE, p, RADIAL), dot(p, FORCE, p, ALONG)
    d_radial = dot(s, 74, p, RADIAL) + dot(p, FORCE, s, 12)
    d_along = dot(s, 74, p, ALONG) + dot(p, FORCE, s, 15)
    for j in range(table.shape[1]):
        kappa = (1.0 - 1.0 / table[WAVES, j] ** 2) / radius
        pushed = d_radial * phi[j, 0] + (d_along - d_axial * kappa) * phi[j, 1]
        forces[j] = pushed + d_angle * (radial * phi[j, 1] + (along - axial * kappa) * phi[j, 2])
    d_push = d_along * drift + along * d_drift + d_axial * p[PSI + 1] + axial * s[39]
    for c in range(3):
        out[c] = s[68 + c] + d_push * p[TANGENT + c] + p[PUSH] * s[18 + c]
        out[3 + c] = s[71 + c]


@njit(cache=True, error_model="numpy")
def react(arm, darm, wrench, dwrench, out):
    """Subtract from ``out`` the change of a planet's wrench carried over to the ring's centre, six numbers.

    Parameters
    ----------
    arm, darm : ndarray, shape (3,)
        From the ring's centre to the planet, and its change.
    wrench, dwrench : ndarray, shape (6,)
        On the planet, and its change.
    out : ndarray, shape (6,)
    """
    s = np.empty(6)
    cross(arm, 0, dwrench, 0, s, 0)
    cross(darm, 0, wrench, 0, s, 3)
    for c in range(3):
        out[c] -= dwrench[c]
        out[3 + c] -= dwrench[3 + c] + s[c] + s[3 + c]


@njit(cache=True, error_model="numpy")
def mesh_columns(k, n, planet, ring, contact, own, acting, states, table, radius, phi, p, dx, s, change, jac):
    """Add the derivatives of the mesh of planet k of n to ``jac``.

    Parameters
    ----------
    k, n : int
    planet, ring, contact, own, states, table, radius, phi, p
        As of `vary`; ``contact`` is the contact's wrench, ``own`` its derivatives.
    acting : ndarray, shape (6,)
        On the planet.
    dx, s, change : ndarray
        Scratch: variations; 90 places; changes of wrench and forces on the modes.
    jac : ndarray
        As of every element.
    """
    m = table.shape[1]
    last, pushed, arm = 6 * (n + 1 if n > 1 else 1), vector_at(change, 6, m), vector_at(p, ARM, 3)
    for c in range(24 + 2 * m):
        for q in range(24 + 2 * m):
            dx[q] = 0.0
        dx[c] = 1.0
        vary(planet, ring, contact, own, states, table, radius, phi, p, dx, s, change, pushed)
        column = 12 * k + c if c < 12 else 12 * (n - 1) + c
        for r in range(6):
            jac[6 * k + r, column] += change[r]
        for j in range(m):
            jac[last + m + j, column] += pushed[j] / table[MASS, j]
        if n > 1:
            for q in range(3):
                s[q] = dx[q] - dx[12 + q]
                s[3 + q] = 0.0
                s[6 + q] = 0.0
            react(arm, vector_at(s, 0, 3), acting, change, vector_at(s, 3, 6))
            for r in range(6):
                jac[6 * n + r, column] += s[3 + r]


@njit(cache=True, error_model="numpy")
def rim_rates(last, column, states, forces, table, stiffness, damping, want, rates, jac, diagnostics):
    """Write the rates of the rim's states, their derivatives by the states, its energy and the power it loses.

    Parameters
    ----------
    last, column : int
        Row and column of ``jac`` where the states begin.
    states, forces : ndarray
        Amplitudes and their rates; forces of all meshes on the modes.
    table, stiffness, damping
        Of the modes.
    want, rates, jac, diagnostics
        As of every element.
    """
    m = table.shape[1]
    energy, lost = 0.0, 0.0
    for j in range(m):
        total = forces[j]
        for l in range(m):
            total -= stiffness[j, l] * states[l] + damping[j, l] * states[m + l]
            energy += 0.5 * states[j] * stiffness[j, l] * states[l]
            lost += states[m + j] * damping[j, l] * states[m + l]
        energy += 0.5 * table[MASS, j] * states[m + j] ** 2
        rates[j], rates[m + j] = states[m + j], total / table[MASS, j]
    diagnostics[0] += energy
    diagnostics[1] += lost
    if want & DERIVATIVES:
        for j in range(m):
            jac[last + j, column + m + j] += 1.0
            for l in range(m):
                jac[last + m + j, column + l] -= stiffness[j, l] / table[MASS, j]
                jac[last + m + j, column + m + l] -= damping[j, l] / table[MASS, j]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def ring_meshes(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Evaluate all meshes with the ring; the frames are those of the planets, then the ring's.

    Parameters
    ----------
    ints, reals : ndarray
        Address of `gear_contact`, sizes, the rim's modes, and the tables of the pairs; see the constants above.
    t, inputs
        Not used.
    frames, states, want, wrench, rates, jac
        As of every element; the states are amplitudes, m, then their rates.
    work : ndarray
        Scratch.
    diagnostics : ndarray
        Energy of contacts and rim, damping power of both, friction power, the normal force of each mesh, then its
        `DEPTHS` others of each.
    """
    n, m = ints[MESHES], ints[MODES]
    table = matrix_at(reals, 0, ROWS, m)
    stiffness, damping = matrix_at(reals, ROWS * m, m, m), matrix_at(reals, ROWS * m + m * m, m, m)
    radius = reals[ROWS * m + 2 * m * m]
    ring = vector_at(frames, n * FRAME_COLUMNS, FRAME_COLUMNS)
    p, phi, forces = vector_at(work, 0, PIECE), matrix_at(work, PIECE, m, 5), vector_at(work, PIECE + 5 * m, m)
    at = PIECE + 6 * m
    told, change = vector_at(work, at, CONTACT), vector_at(work, at + CONTACT, 6 + m)
    dx, scratch = vector_at(work, at + CONTACT + 6 + m, 24 + 2 * m), vector_at(work, at + CONTACT + 30 + 3 * m, 90)
    own = matrix_at(work, at + CONTACT + 120 + 3 * m, 6, 24)
    at += CONTACT + 264 + 3 * m
    contact, room = vector_at(work, at, 6), vector_at(work, at + 6, work.size - at - 6)
    for j in range(m):
        forces[j] = 0.0
    for k in range(n):
        planet = vector_at(frames, k * FRAME_COLUMNS, FRAME_COLUMNS)
        locate(planet, ring, states, table, radius, phi, p)
        i = PLACES + 4 * k
        for c in range(6):
            contact[c] = 0.0
        for c in range(CONTACT):
            told[c] = 0.0
        if want & DERIVATIVES:
            for r in range(6):
                for c in range(24):
                    own[r, c] = 0.0
        contact_at(ints[0])(
            vector_at(ints, ints[i], ints[i + 1]), vector_at(reals, ints[i + 2], ints[i + 3]),
            vector_at(planet, FRAME_P, 3), matrix_at(planet, FRAME_A, 3, 3),
            vector_at(planet, FRAME_V, 3), vector_at(planet, FRAME_W, 3),
            vector_at(p, POSE + FRAME_P, 3), matrix_at(p, POSE + FRAME_A, 3, 3),
            vector_at(p, POSE + FRAME_V, 3), vector_at(p, POSE + FRAME_W, 3),
            contact, own, told, want & DERIVATIVES, room,
        )  # fmt: skip
        acting = vector_at(wrench, 6 * k, 6)
        hand_on(planet, ring, contact, states, table, radius, phi, p, acting, forces)
        arm = vector_at(p, ARM, 3)
        for c in range(3):
            diagnostics[c] += told[c]
            scratch[c] = 0.0
        diagnostics[3 + k] = told[7]
        for c in range(DEPTHS):
            diagnostics[3 + n + DEPTHS * k + c] = told[3 + c]
        if n > 1:
            react(arm, vector_at(scratch, 0, 3), acting, acting, vector_at(wrench, 6 * n, 6))
        if want & DERIVATIVES:
            mesh_columns(
                k, n, planet, ring, contact, own, acting, states, table, radius, phi, p, dx, scratch, change, jac
            )
    last, column = 6 * (n + 1 if n > 1 else 1), 12 * (n + 1)
    rim_rates(last, column, states, forces, table, stiffness, damping, want, rates, jac, diagnostics)
