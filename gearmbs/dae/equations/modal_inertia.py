"""Inertia, stiffness and damping of a body with modal coordinates: kinetic energy, momenta and their derivatives.

In body components, with w the angular velocity, q the modal coordinates and v their rates,

    T = 1/2 m u . u + 1/2 w . J(q) w + w . sum_k H_k(q) v_k + 1/2 v . M v
    J(q) = J0 + sum_k J1_k q_k + 1/2 sum_kl J2_kl q_k q_l,      H_k(q) = C0_k + sum_l C1_lk q_l

so that h = J w + sum_k H_k v_k and p_f = dT/dv. The shapes have no net displacement (the sum of their displacements
times mass vanishes), so that R is the centre of mass of the deformed body and no term couples u with the others; the
elastic and damping forces are -K q and -D v. The Lagrangian is that of a cloud of particles whose displacements are
linear in q if all integrals are given; leaving some out gives another Lagrangian, not another balance of energy.
"""

from __future__ import annotations

import numpy as np
from numba import types

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.dae.compiled.pointers import IVEC, VEC
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import dot3
from gearmbs.dae.equations.modal_integrals import APART, PRESENT, diagonals, integrals, moving, present, stride
from gearmbs.dae.equations.rotation import KIN_A, KIN_H, KIN_W


@njit(cache=True, error_model="numpy")
def to_body(kin_row, v, i, out, k):
    """Write the body components of the global vector ``v[i:i+3]`` to ``out[k:k+3]``."""
    x, y, z = v[i], v[i + 1], v[i + 2]
    for c in range(3):
        out[k + c] = kin_row[KIN_A + c] * x + kin_row[KIN_A + 3 + c] * y + kin_row[KIN_A + 6 + c] * z


@njit(cache=True, error_model="numpy", forceinline=True)
def spin_in_body(kin_row):
    """Return the body components of the angular velocity."""
    x, y, z = kin_row[KIN_W], kin_row[KIN_W + 1], kin_row[KIN_W + 2]
    return (
        kin_row[KIN_A] * x + kin_row[KIN_A + 3] * y + kin_row[KIN_A + 6] * z,
        kin_row[KIN_A + 1] * x + kin_row[KIN_A + 4] * y + kin_row[KIN_A + 7] * z,
        kin_row[KIN_A + 2] * x + kin_row[KIN_A + 5] * y + kin_row[KIN_A + 8] * z,
    )


@njit(cache=True, error_model="numpy")
def to_global(kin_row, v, i, out, k):
    """Write the global components of the vector ``v[i:i+3]`` given in body components to ``out[k:k+3]``."""
    x, y, z = v[i], v[i + 1], v[i + 2]
    for c in range(3):
        a = KIN_A + 3 * c
        out[k + c] = kin_row[a] * x + kin_row[a + 1] * y + kin_row[a + 2] * z


@njit(types.void(VEC, IVEC, VEC, VEC, VEC), cache=True, late=True, error_model="numpy")
def update_inertia(y, at, modal, partial, body_row):
    """Write J(q) to the body's row and dJ/dq, H and sum_l C1_kl v_l to its place in ``partial``."""
    n, place = at[T.AT_MODES], at[T.AT_PARTIAL]
    wide = stride(n)
    head, first, counts, modes, blocks = moving(modal, at[T.AT_MODAL], n)
    state = vector_at(partial, place, PRESENT * wide)
    amounts, rates = vector_at(y, at[T.AT_QF], n), vector_at(y, at[T.AT_VF], n)
    e = 0
    for place in range(first.size // LANES):
        total = lanes_at(first, place)
        for _ in range(int(counts[place])):
            total = total + lanes_at(blocks, e) * amounts[int(modes[e])]
            e += 1
        put_lanes(state, place, total)
    for place in range(first.size // LANES, counts.size):
        total = all_lanes(0.0)
        for _ in range(int(counts[place])):
            total = total + lanes_at(blocks, e) * rates[int(modes[e])]
            e += 1
        put_lanes(state, place, total)
    add_inertia_change(amounts, matrix_at(first, 0, 6, wide), matrix_at(state, 0, 6, wide), head, body_row)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_inertia_change(q_f, j1, change, j0, body_row):
    """Write J(q) = J0 + 1/2 sum_k q_k (J1_k + dJ/dq_k) to a body's row; all six sums advance together."""
    xx = xy = xz = yy = yz = zz = 0.0
    for k in range(q_f.size):
        amount = 0.5 * q_f[k]
        xx += amount * (j1[0, k] + change[0, k])
        xy += amount * (j1[1, k] + change[1, k])
        xz += amount * (j1[2, k] + change[2, k])
        yy += amount * (j1[3, k] + change[3, k])
        yz += amount * (j1[4, k] + change[4, k])
        zz += amount * (j1[5, k] + change[5, k])
    i = T.BODY_INERTIA
    body_row[i], body_row[i + 4], body_row[i + 8] = j0[0] + xx, j0[4] + yy, j0[8] + zz
    body_row[i + 1] = body_row[i + 3] = j0[1] + xy
    body_row[i + 2] = body_row[i + 6] = j0[2] + xz
    body_row[i + 5] = body_row[i + 7] = j0[5] + yz


@njit(cache=True, error_model="numpy", forceinline=True)
def inertia_change(change, k, w, i, out, j):
    """Write dJ/dq_k w to ``out[j:j+3]``, body components, w in ``w[i:i+3]``; ``change`` as of `present`."""
    x, y, z = w[i], w[i + 1], w[i + 2]
    out[j] = change[0, k] * x + change[1, k] * y + change[2, k] * z
    out[j + 1] = change[1, k] * x + change[3, k] * y + change[4, k] * z
    out[j + 2] = change[2, k] * x + change[4, k] * y + change[5, k] * z


@njit(types.void(VEC, IVEC, VEC, VEC), cache=True, late=True, error_model="numpy")
def add_momentum(y, at, partial, kin_row):
    """Add sum_k H_k v_k to the angular momentum h of the body's row."""
    n, v = at[T.AT_MODES], at[T.AT_VF]
    _, h, _ = present(partial, at[T.AT_PARTIAL], n)
    x = y_ = z = 0.0
    for k in range(n):
        rate = y[v + k]
        x += h[0, k] * rate
        y_ += h[1, k] * rate
        z += h[2, k] * rate
    for c in range(3):
        a = KIN_A + 3 * c
        kin_row[KIN_H + c] += kin_row[a] * x + kin_row[a + 1] * y_ + kin_row[a + 2] * z


@njit(cache=True, error_model="numpy", forceinline=True)
def has_diagonals(modal, at):
    """Return whether M, K and D of a body are diagonal."""
    return modal[at[T.AT_MODAL] + APART] > 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def row_product(matrix, apart, k, y, i):
    """Return row k of a matrix, which may be diagonal, times ``y[i:i+n]``."""
    if apart:
        return matrix[k, k] * y[i + k]
    total = 0.0
    for l in range(matrix.shape[0]):
        total += matrix[k, l] * y[i + l]
    return total


@njit(types.void(VEC, IVEC, VEC, VEC, VEC), cache=True, late=True, error_model="numpy")
def set_modal_momenta(y, at, modal, partial, kin_row):
    """Write p_f = dT/dv_f to y."""
    n = at[T.AT_MODES]
    _, _, mass, _, _, _ = integrals(modal, at[T.AT_MODAL], n)
    apart = has_diagonals(modal, at)
    _, h, _ = present(partial, at[T.AT_PARTIAL], n)
    wx, wy, wz = spin_in_body(kin_row)
    for k in range(n):
        turning = h[0, k] * wx + h[1, k] * wy + h[2, k] * wz
        y[at[T.AT_PF] + k] = turning + row_product(mass, apart, k, y, at[T.AT_VF])


@njit(types.void(VEC, VEC, IVEC, VEC, VEC, VEC, VEC), cache=True, late=True, error_model="numpy")
def modal_residual(y, yp, at, modal, partial, kin_row, out):
    """Write the rows p_f' - L_qf, p_f - L_vf and v_f - q_f' of a body; loads and constraints are added elsewhere.

    Parameters
    ----------
    y, yp
        Unknowns and their rates.
    at, modal, partial : ndarray
        The body's places, the table of all integrals, the present state of `present`.
    kin_row, out : ndarray
        The body's row of the kinematics table; the residual.
    """
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    _, _, mass, stiffness, damping, _ = integrals(modal, at[T.AT_MODAL], n)
    change, h, gyro = present(partial, at[T.AT_PARTIAL], n)
    apart = has_diagonals(modal, at)
    spin = spin_in_body(kin_row)
    first = diagonal_rows(y, yp, at, modal, partial, spin, out) if apart else 0
    for k in range(first, n):
        tensor = change[0, k], change[1, k], change[2, k], change[3, k], change[4, k], change[5, k]
        inertial = inertial_force(tensor, (gyro[0, k], gyro[1, k], gyro[2, k]), spin)
        force = row_product(stiffness, apart, k, y, qf) + row_product(damping, apart, k, y, vf) - inertial
        momentum = spin[0] * h[0, k] + spin[1] * h[1, k] + spin[2] * h[2, k] + row_product(mass, apart, k, y, vf)
        out[pf + k] = yp[pf + k] + force
        out[vf + k] = y[pf + k] - momentum
        out[qf + k] = y[vf + k] - yp[qf + k]


@njit(cache=True, error_model="numpy", forceinline=True)
def inertial_force(change, gyro, spin):
    """Return 1/2 w . dJ/dq_k w + w . sum_l C1_kl v_l of one mode, or of as many as lanes have.

    Parameters
    ----------
    change, gyro : tuple
        dJ/dq_k, entries of `SYMMETRIC`, and sum_l C1_kl v_l.
    spin : tuple of float
        w.
    """
    wx, wy, wz = spin
    inertial = 0.5 * (change[0] * wx * wx + change[3] * wy * wy + change[5] * wz * wz)
    inertial = inertial + (change[1] * wx * wy + change[2] * wx * wz + change[4] * wy * wz)
    return inertial + (wx * gyro[0] + wy * gyro[1] + wz * gyro[2])


@njit(cache=True, error_model="numpy", forceinline=True)
def diagonal_rows(y, yp, at, modal, partial, spin, out):
    """Write the rows of `modal_residual` for modes that fill lanes, if M, K and D are diagonal; return their number.

    Parameters
    ----------
    y, yp, at, modal, partial, out
        As of `modal_residual`.
    spin : tuple of float
        Angular velocity in body components.
    """
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    mass, stiffness, damping = diagonals(modal, at[T.AT_MODAL], n)
    momenta, rates, amounts = vector_at(y, pf, n), vector_at(y, vf, n), vector_at(y, qf, n)
    momenta_rates, amounts_rates = vector_at(yp, pf, n), vector_at(yp, qf, n)
    forces, momenta_rows, rates_rows = vector_at(out, pf, n), vector_at(out, vf, n), vector_at(out, qf, n)
    row = stride(n) // LANES
    state = vector_at(partial, at[T.AT_PARTIAL], PRESENT * row * LANES)
    wx, wy, wz = spin
    for g in range(n // LANES):
        tensor = (
            lanes_at(state, g), lanes_at(state, row + g), lanes_at(state, 2 * row + g), lanes_at(state, 3 * row + g),
            lanes_at(state, 4 * row + g), lanes_at(state, 5 * row + g),
        )  # fmt: skip
        gyro = lanes_at(state, 9 * row + g), lanes_at(state, 10 * row + g), lanes_at(state, 11 * row + g)
        rate = lanes_at(rates, g)
        force = lanes_at(stiffness, g) * lanes_at(amounts, g) + lanes_at(damping, g) * rate
        force = force - inertial_force(tensor, gyro, spin)
        momentum = wx * lanes_at(state, 6 * row + g) + wy * lanes_at(state, 7 * row + g)
        momentum = momentum + wz * lanes_at(state, 8 * row + g) + lanes_at(mass, g) * rate
        put_lanes(forces, g, lanes_at(momenta_rates, g) + force)
        put_lanes(momenta_rows, g, lanes_at(momenta, g) - momentum)
        put_lanes(rates_rows, g, rate - lanes_at(amounts_rates, g))
    return n // LANES * LANES


@njit(cache=True, error_model="numpy")
def modal_acceleration_terms(y, at, modal, partial, kin_row, mass_out, coupling_out, rhs_modes, rhs_rotation):
    """Write what a body adds to the acceleration system.

    Parameters
    ----------
    y
        Unknowns.
    at, modal, partial, kin_row
        As of `modal_residual`.
    mass_out : ndarray, shape (n, n)
        Modal mass.
    coupling_out : ndarray, shape (n, 3)
        H_k in global components, between angular and modal accelerations.
    rhs_modes : ndarray, shape (n,)
        1/2 w . dJ/dq_k w + w . sum_l (C1_kl - C1_lk) v_l - (K q + D v)_k.
    rhs_rotation : ndarray, shape (3,)
        -sum_k v_k (dJ/dq_k w + sum_l C1_kl v_l), global components.
    """
    n, vf, qf = at[T.AT_MODES], at[T.AT_VF], at[T.AT_QF]
    second, _, mass, stiffness, damping, _ = integrals(modal, at[T.AT_MODAL], n)
    change, h, gyro = present(partial, at[T.AT_PARTIAL], n)
    apart = has_diagonals(modal, at)
    s = np.zeros(12)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for k in range(n):
        inertia_change(change, k, s, 0, s, 3)
        total = 0.5 * dot3(s, 0, s, 3)
        for c in range(3):
            total += s[c] * gyro[c, k]
            s[9 + c] -= y[vf + k] * (s[3 + c] + gyro[c, k])
            s[6 + c] = h[c, k]
        for l in range(n):
            mass_out[k, l] = mass[k, l]
            for c in range(3):
                total -= s[c] * second[l, (6 + c) * n + k] * y[vf + l]
        rhs_modes[k] = total - row_product(stiffness, apart, k, y, qf) - row_product(damping, apart, k, y, vf)
        to_global(kin_row, s, 6, s, 3)
        for c in range(3):
            coupling_out[k, c] = s[3 + c]
    to_global(kin_row, s, 9, rhs_rotation, 0)
