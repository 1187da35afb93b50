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
from gearmbs.contact.ring import derived as D
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

ARM, SHAPE_SUMS, POSE, PARTS = 0, 3, 15, 33
"""In a planet's numbers: its place from the ring's centre, the rim's shape there (`definitions.SHAPE`), the frame of
the piece, and the parts F_r, F_t and M_z of what acts on it."""
PIECE = 36
SUMS = 12
SLOPES = 13 * (24 + SUMS) + 9 * (30 + SUMS)
"""Numbers of the derivatives that `definitions` gives: of theta and the piece, of what is handed on."""
SCRATCH = 34 + SLOPES
CONTACT = 8
"""Diagnostics of a pair: energy, damping power, friction power, `DEPTHS` others, normal force."""
DEPTHS = 4
"""Penetrations of drive and coast flanks, and how many pairs touch on either."""


@njit(cache=True, error_model="numpy")
def shapes(theta, table, out):
    """Write phi and its first three derivatives at an angle to ``out``, shape (modes, 4)."""
    for j in range(table.shape[1]):
        n = table[WAVES, j]
        angle = n * theta - 0.5 * np.pi * table[PHASE, j]
        c, s = table[UNIT, j] * np.cos(angle), table[UNIT, j] * np.sin(angle)
        out[j, 0], out[j, 1], out[j, 2], out[j, 3] = c, -n * s, -n * n * c, n**3 * s


@njit(cache=True, error_model="numpy", forceinline=True)
def per_turn(j, table, radius):
    """Return kappa_j."""
    return (1.0 - 1.0 / table[WAVES, j] ** 2) / radius


@njit(cache=True, error_model="numpy")
def sum_up(states, table, radius, phi, out):
    """Write the sums over the modes, `definitions.SHAPE`, of amplitudes and their rates, or of changes of both."""
    m = table.shape[1]
    for k in range(SUMS):
        out[k] = 0.0
    for j in range(m):
        q, v, kappa = states[j], states[m + j], per_turn(j, table, radius)
        for k in range(4):
            out[k] += phi[j, k] * q
        for k in range(3):
            out[4 + k] += phi[j, k] * v
            out[7 + k] -= kappa * phi[j, 1 + k] * q
        for k in range(2):
            out[10 + k] -= kappa * phi[j, 1 + k] * v


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
    phi : ndarray, shape (modes, 4)
        Written: the shapes at the planet.
    p : ndarray, shape (PIECE,)
    """
    for c in range(3):
        p[ARM + c] = planet[FRAME_P + c] - ring[FRAME_P + c]
    shapes(D.place(planet, ring), table, phi)
    shape = vector_at(p, SHAPE_SUMS, SUMS)
    sum_up(states, table, radius, phi, shape)
    D.piece(planet, ring, shape, vector_at(p, POSE, FRAME_COLUMNS))


@njit(cache=True, error_model="numpy")
def hand_on(planet, ring, wrench, table, radius, phi, p, out, forces):
    """Write the planet's wrench with the force along its path to ``out``, and add those on the modes to ``forces``.

    Parameters
    ----------
    planet, ring : ndarray, shape (18,)
    wrench : ndarray, shape (6,)
        Of the contact, on the planet.
    table, radius, phi
        As of `locate`.
    p : ndarray, shape (PIECE,)
        Of `locate`; the parts of what acts on the piece are written.
    out, forces : ndarray
        Wrench, 6 numbers; generalised forces Q, one a mode.
    """
    radial, along, axial = D.handed_on(planet, ring, vector_at(p, SHAPE_SUMS, SUMS), wrench, out)
    p[PARTS], p[PARTS + 1], p[PARTS + 2] = radial, along, axial
    for j in range(table.shape[1]):
        forces[j] += radial * phi[j, 0] + (along - axial * per_turn(j, table, radius)) * phi[j, 1]


@njit(cache=True, error_model="numpy")
def vary(c, own, table, radius, phi, p, dx, s, out, forces):
    """Write the changes of what `hand_on` gives with those of the frames and states.

    Parameters
    ----------
    c : int
        Which variation it is.
    own : ndarray, shape (6, 24)
        Derivatives of the contact's wrench.
    table, radius, phi, p
        As of `hand_on`, which has been called.
    dx : ndarray
        Variations of planet and ring, twelve each, then of the states: 1 at c, else 0.
    s : ndarray
        Scratch, of which the last `SLOPES` are the derivatives of `definitions`.
    out, forces : ndarray
        As of `hand_on`, written: changes.
    """
    piece, handed = slopes_in(s)
    d_shape, moved = vector_at(s, 0, SUMS), vector_at(s, SUMS, 22)
    if c < 24:
        # of theta and the piece, of what is handed on at the same load
        for k in range(13):
            moved[k] = piece[k, c]
        for k in range(9):
            moved[13 + k] = handed[k, c]
    else:
        sum_up(vector_at(dx, 24, dx.size - 24), table, radius, phi, d_shape)
        for k in range(22):
            moved[k] = 0.0
        for q in range(SUMS):
            if d_shape[q] != 0.0:
                for k in range(13):
                    moved[k] += piece[k, 24 + q] * d_shape[q]
                for k in range(9):
                    moved[13 + k] += handed[k, 24 + q] * d_shape[q]
    for r in range(6):
        load = own[r, c] if c < 12 else 0.0
        for k in range(12):
            load += own[r, 12 + k] * moved[1 + k]
        for k in range(9):
            moved[13 + k] += handed[k, 24 + SUMS + r] * load
    for r in range(6):
        out[r] = moved[13 + r]
    for j in range(table.shape[1]):
        kappa = per_turn(j, table, radius)
        # Q_j by F_r, F_t and M_z, and by theta at which the shapes are taken
        forces[j] = moved[19] * phi[j, 0] + (moved[20] - moved[21] * kappa) * phi[j, 1]
        forces[j] += moved[0] * (p[PARTS] * phi[j, 1] + (p[PARTS + 1] - p[PARTS + 2] * kappa) * phi[j, 2])


@njit(cache=True, error_model="numpy", forceinline=True)
def slopes_in(s):
    """Return the derivatives of theta and the piece, and of what is handed on, in the scratch."""
    first = s.size - SLOPES
    return matrix_at(s, first, 13, 24 + SUMS), matrix_at(s, first + 13 * (24 + SUMS), 9, 30 + SUMS)


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
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        out[c] -= dwrench[c]
        out[3 + c] -= dwrench[3 + c] + arm[c1] * dwrench[c2] - arm[c2] * dwrench[c1]
        out[3 + c] -= darm[c1] * wrench[c2] - darm[c2] * wrench[c1]


@njit(cache=True, error_model="numpy")
def mesh_columns(k, n, planet, ring, contact, own, acting, table, radius, phi, p, dx, s, change, jac):
    """Add the derivatives of the mesh of planet k of n to ``jac``.

    Parameters
    ----------
    k, n : int
    planet, ring, contact, own, table, radius, phi, p
        As of `hand_on` and `vary`; ``contact`` is the contact's wrench, ``own`` its derivatives.
    acting : ndarray, shape (6,)
        On the planet.
    dx, s, change : ndarray
        Scratch: variations; `SCRATCH` places; changes of wrench and forces on the modes.
    jac : ndarray
        As of every element.
    """
    m = table.shape[1]
    last, pushed, arm = 6 * (n + 1 if n > 1 else 1), vector_at(change, 6, m), vector_at(p, ARM, 3)
    piece, handed = slopes_in(s)
    piece[:] = 0.0
    handed[:] = 0.0
    D.slopes(planet, ring, vector_at(p, SHAPE_SUMS, SUMS), contact, piece, handed)
    for c in range(24 + 2 * m):
        for q in range(24 + 2 * m):
            dx[q] = 0.0
        dx[c] = 1.0
        vary(c, own, table, radius, phi, p, dx, s, change, pushed)
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
    p, phi, forces = vector_at(work, 0, PIECE), matrix_at(work, PIECE, m, 4), vector_at(work, PIECE + 4 * m, m)
    at = PIECE + 5 * m
    told, change = vector_at(work, at, CONTACT), vector_at(work, at + CONTACT, 6 + m)
    dx, scratch = vector_at(work, at + CONTACT + 6 + m, 24 + 2 * m), vector_at(work, at + CONTACT + 30 + 3 * m, SCRATCH)
    own = matrix_at(work, at + CONTACT + 30 + SCRATCH + 3 * m, 6, 24)
    at += CONTACT + 174 + SCRATCH + 3 * m
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
        hand_on(planet, ring, contact, table, radius, phi, p, acting, forces)
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
            mesh_columns(k, n, planet, ring, contact, own, acting, table, radius, phi, p, dx, scratch, change, jac)
    last, column = 6 * (n + 1 if n > 1 else 1), 12 * (n + 1)
    rim_rates(last, column, states, forces, table, stiffness, damping, want, rates, jac, diagnostics)
