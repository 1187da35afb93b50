"""Integrals over a body of its shapes, and the table in which the kernels read them.

What the present state of a body is summed from stands in lanes, neighbouring modes side by side.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numba import types

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.lane_lists import in_lanes, lanes_of, listed_sum, padded
from gearmbs.dae.equations.constraints.terms import dot3
from gearmbs.dae.equations.rotation import KIN_A, KIN_ADOT, KIN_AXES, KIN_H, KIN_W
from gearmbs.dae.equations.unknowns import put
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, lanes_at, put_lanes
from gearmbs.kernels.pointers import F8, I8, IVEC, VEC
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at

APART = 9
"""Behind J0 in the head of the table: 1 if M, K and D are diagonal."""
LISTED = 10
"""How many lanes are listed."""
GATHERED = 11
"""1 if these lanes are of modes that have much in common instead of neighbours."""
PAIRED = 12
"""How many entries two modes, or a mode and itself, have: of p_f by q_f, p_f by v_f, v_f by q_f, and v_f by v_f."""
HEAD = 16
"""Numbers before the integrals."""

SYMMETRIC = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Entries of a symmetric matrix in the order in which they are stored."""

PRESENT = 12
"""Numbers a mode that a body's present state takes: dJ/dq_k (6), H_k (3), sum_l C1_kl v_l (3)."""


@dataclass(frozen=True, eq=False)
class ModalInertia:
    """Integrals over a body of its n shapes phi_k, about the centre of mass, in body components.

    The shapes have no net displacement: sum phi_k dm = 0.

    Attributes
    ----------
    mass, stiffness, damping : ndarray, shape (n, n)
        M = sum phi_k . phi_l dm, K and D.
    c0 : ndarray, shape (n, 3)
        sum s x phi_k dm.
    c1 : ndarray, shape (n, n, 3)
        sum phi_k x phi_l dm, with what the turning of the parts' own inertia adds; antisymmetric without that.
    j1 : ndarray, shape (n, 3, 3)
        First derivatives of the inertia by the modal coordinates.
    j2 : ndarray, shape (n, n, 3, 3)
        Second derivatives.
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    c0: np.ndarray
    c1: np.ndarray
    j1: np.ndarray
    j2: np.ndarray

    @property
    def modes(self) -> int:
        """Number of modal coordinates."""
        return self.mass.shape[0]

    def kinetic_energy(self, w: np.ndarray, q_f: np.ndarray, v_f: np.ndarray) -> np.ndarray:
        """Return what the kinetic energy has beyond that of the undeformed rigid body, shape (m,), J.

        ``w`` is the angular velocity in body components, shape (m, 3); q_f and v_f have shape (m, n).
        """
        change = np.einsum("tk,kij->tij", q_f, self.j1) + 0.5 * np.einsum("tk,tl,klij->tij", q_f, q_f, self.j2)
        couplings = self.c0 + np.einsum("tl,lkc->tkc", q_f, self.c1)
        turning = 0.5 * np.einsum("ti,tij,tj->t", w, change, w) + np.einsum("ti,tki,tk->t", w, couplings, v_f)
        return turning + 0.5 * np.einsum("tk,kl,tl->t", v_f, self.mass, v_f)

    def strain_energy(self, q_f: np.ndarray) -> np.ndarray:
        """Return the strain energy over time, shape (m,), J."""
        return 0.5 * np.einsum("tk,kl,tl->t", q_f, self.stiffness, q_f)

    def damping_power(self, v_f: np.ndarray) -> np.ndarray:
        """Return the power dissipated by the damping of the modes, shape (m,), W."""
        return np.einsum("tk,kl,tl->t", v_f, self.damping, v_f)

    def table(self, inertia: np.ndarray) -> np.ndarray:
        """Return the numbers as the kernels read them, see `integrals`; ``inertia`` is that of the undeformed body.

        What is summed over modes l stands in one row for each, the other mode last, so that the sums are of whole rows;
        and once more by whole lanes, see `moving`, without those that vanish by symmetry.
        """
        rows, columns = np.array(SYMMETRIC).T
        first = np.vstack([np.moveaxis(self.j1[:, rows, columns], 0, 1), self.c0.T])
        second = np.concatenate([np.moveaxis(self.j2[:, :, rows, columns], 1, 2), np.moveaxis(self.c1, 1, 2)], axis=1)
        turned = np.moveaxis(self.c1, (0, 1, 2), (2, 0, 1))
        parts = (self.mass, self.stiffness, self.damping)
        apart = all(np.array_equal(part, np.diag(np.diag(part))) for part in parts)
        turning = self.c1.any(axis=2)
        entries = (
            self.stiffness.astype(bool) | self.j2.any(axis=(2, 3)), self.damping.astype(bool) | turning, turning.T,
            self.mass.astype(bool),
        )  # fmt: skip
        # mode l, then mode k of each: of one l after the other, whose integrals stand in a row
        pairs = [np.nonzero(between.T) for between in entries]
        order, lists = in_lanes(np.concatenate([second, turned], axis=1))
        head = np.zeros(HEAD)
        head[:APART] = np.ravel(inertia)
        head[APART], head[LISTED], head[GATHERED] = apart, len(lists[1]), len(order) > 0
        head[PAIRED:] = [len(modes) for modes, _ in pairs]
        diagonals = [padded(np.diag(part)) for part in parts]
        pieces: tuple = (
            head,
            padded(first),
            second,
            turned,
            *parts,
            *diagonals,
            *lists,
            order,
            *itertools.chain(*pairs),
        )
        return np.concatenate([np.ravel(piece) for piece in pieces])


def present_size(modes: int) -> int:
    """Return how many numbers the present state of a body takes, with room for one of its rows."""
    return (PRESENT + 1) * LANES * lanes_of(modes)


@njit(cache=True, error_model="numpy", forceinline=True)
def stride(n):
    """Return how far apart the numbers of n modes are that stand in whole lanes."""
    return (n + LANES - 1) // LANES * LANES


@njit(cache=True, error_model="numpy", forceinline=True)
def integrals(modal, at, n):
    """Return the table of a body with n modal coordinates as views.

    Returns
    -------
    second : ndarray, shape (n, 9 n)
        J2 (entries of `SYMMETRIC`, then modes) and C1_lk, a row for each l.
    turned : ndarray, shape (n, 3 n)
        C1_kl, a row for each l.
    mass, stiffness, damping : ndarray, shape (n, n)
    """
    second = at + HEAD + 9 * stride(n)
    turned = second + 9 * n * n
    m = turned + 3 * n * n
    return (
        matrix_at(modal, second, n, 9 * n),
        matrix_at(modal, turned, n, 3 * n),
        matrix_at(modal, m, n, n),
        matrix_at(modal, m + n * n, n, n),
        matrix_at(modal, m + 2 * n * n, n, n),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def moving(modal, at, n):
    """Return what the present state of a body is made of as views, modes in lanes.

    Returns
    -------
    head : ndarray, shape (HEAD,)
        J0, 1 if M, K and D are diagonal, and how many lanes are listed.
    first : ndarray, shape (9 stride,)
        J1 (entries of `SYMMETRIC`, then modes) and C0.
    counts : ndarray, shape (PRESENT stride / LANES,)
        For each lanes of the state how many modes l add to them.
    modes : ndarray
        These modes, one after the other.
    blocks : ndarray
        What their coordinates, in the last quarter of the state their velocities, are multiplied by.
    places : ndarray, shape (n,)
        Where the modes stand in these lanes; see `GATHERED`.
    """
    wide = stride(n)
    head = vector_at(modal, at, HEAD)
    counts = at + HEAD + 9 * wide + 15 * n * n + 3 * wide
    modes = counts + PRESENT * (wide // LANES)
    listed = int(head[LISTED])
    return (
        head,
        vector_at(modal, at + HEAD, 9 * wide),
        vector_at(modal, counts, PRESENT * (wide // LANES)),
        vector_at(modal, modes, listed),
        vector_at(modal, modes + listed, LANES * listed),
        vector_at(modal, modes + (1 + LANES) * listed, n if head[GATHERED] > 0.0 else 0),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def diagonals(modal, at, n):
    """Return the diagonals of M, K and D, in lanes, as views."""
    wide = stride(n)
    first = at + HEAD + 9 * wide + 15 * n * n
    return vector_at(modal, first, wide), vector_at(modal, first + wide, wide), vector_at(modal, first + 2 * wide, wide)


@njit(cache=True, error_model="numpy", forceinline=True)
def present(partial, at, n):
    """Return dJ/dq (6, n), H (3, n) and sum_l C1_kl v_l (3, n) of a body at present as views, n filled up to lanes."""
    wide = stride(n)
    h = at + 6 * wide
    return matrix_at(partial, at, 6, wide), matrix_at(partial, h, 3, wide), matrix_at(partial, h + 3 * wide, 3, wide)


# Inertia, stiffness and damping of a body with modal coordinates: kinetic energy, momenta and their derivatives.
#
# In body components, with w the angular velocity, q the modal coordinates and v their rates,
#
#     T = 1/2 m u . u + 1/2 w . J(q) w + w . sum_k H_k(q) v_k + 1/2 v . M v
#     J(q) = J0 + sum_k J1_k q_k + 1/2 sum_kl J2_kl q_k q_l,      H_k(q) = C0_k + sum_l C1_lk q_l
#
# so that h = J w + sum_k H_k v_k and p_f = dT/dv. The shapes have no net displacement (the sum of their displacements
# times mass vanishes), so that R is the centre of mass of the deformed body and no term couples u with the others; the
# elastic and damping forces are -K q and -D v. The Lagrangian is that of a cloud of particles whose displacements are
# linear in q if all integrals are given; leaving some out gives another Lagrangian, not another balance of energy.


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


@njit(types.void(VEC, IVEC, VEC, VEC, VEC), cache=True, late=True, error_model="numpy", fastmath={"contract"})
def update_inertia(y, at, modal, partial, body_row):
    """Write J(q) to the body's row and dJ/dq, H and sum_l C1_kl v_l to its place in ``partial``."""
    n, place = at[T.AT_MODES], at[T.AT_PARTIAL]
    wide = stride(n)
    head, first, counts, modes, blocks, places = moving(modal, at[T.AT_MODAL], n)
    state = vector_at(partial, place, PRESENT * wide)
    row = vector_at(partial, place + PRESENT * wide, wide)
    amounts, rates = vector_at(y, at[T.AT_QF], n), vector_at(y, at[T.AT_VF], n)
    lanes, e = wide // LANES, 0
    for b in range(counts.size):
        count, inner = int(counts[b]), b < 9 * lanes
        total = listed_sum(modes, blocks, e, count, amounts if inner else rates)
        e += count
        if places.size == 0:
            put_lanes(state, b, lanes_at(first, b) + total if inner else total)
            continue
        put_lanes(row, b % lanes, total)
        if b % lanes == lanes - 1:
            own = LANES * (b + 1) - wide
            for k in range(n):
                state[own + k] = row[int(places[k])]
            for g in range(b + 1 - lanes, b + 1 if inner else 0):
                put_lanes(state, g, lanes_at(first, g) + lanes_at(state, g))
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
    _, _, mass, _, _ = integrals(modal, at[T.AT_MODAL], n)
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
    _, _, mass, stiffness, damping = integrals(modal, at[T.AT_MODAL], n)
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
    second, _, mass, stiffness, damping = integrals(modal, at[T.AT_MODAL], n)
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


# Newton-matrix entries of a body with modal coordinates: inertia, stiffness and damping of its modes.


@njit(I8(I8, F8, VEC, IVEC, VEC, VEC, VEC, VEC, IVEC, VEC, I8), cache=True, late=True, error_model="numpy")
def modal_body_entries(mode, cj, y, at, modal, partial, kin_row, s, slot, vals, k):
    """Hand over the entries of a body's modal inertia, stiffness and damping; return the number of the next entry.

    Entries whose integrals are all zero, and stay so, are left out.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`.
    cj : float
        Factor of y'.
    at, modal, partial, kin_row
        The body's places, the table of all integrals, the present state, its row of the kinematics table.
    s : ndarray
        Scratch, 30 places.
    """
    slot, vals, s = uncounted(slot), uncounted(vals), uncounted(s)
    at, modal, partial, kin_row = uncounted(at), uncounted(modal), uncounted(partial), uncounted(kin_row)
    n, p, e, th = at[T.AT_MODES], at[T.AT_P], at[T.AT_EPS], at[T.AT_THETA]
    pf, vf, qf = at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    change, h, gyro = present(partial, at[T.AT_PARTIAL], n)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for c in range(3):
        to_body(kin_row, kin_row, KIN_AXES + 3 * c, s, 12 + 3 * c)
        to_body(kin_row, kin_row, KIN_ADOT + 3 * c, s, 21 + 3 * c)
    for i in range(n):
        inertia_change(change, i, s, 0, s, 3)
        for c in range(3):
            s[3 + c] += gyro[c, i]
            s[6 + c] = h[c, i]
        k = put(mode, slot, vals, k, pf + i, pf + i, cj)
        k = put(mode, slot, vals, k, vf + i, pf + i, 1.0)
        k = put(mode, slot, vals, k, qf + i, vf + i, 1.0)
        k = put(mode, slot, vals, k, qf + i, qf + i, -cj)
        for c in range(3):
            axis, rate = 12 + 3 * c, 21 + 3 * c
            # dh/dq_i in s[3:6], dh/dv_i = H_i in s[6:9]
            along, about = dot3(s, axis, s, 3), dot3(s, axis, s, 6)
            along_rate, about_rate = dot3(s, rate, s, 3), dot3(s, rate, s, 6)
            k = put(mode, slot, vals, k, p + c, qf + i, -along_rate)
            k = put(mode, slot, vals, k, p + c, vf + i, -about_rate)
            k = put(mode, slot, vals, k, e + c, qf + i, -along)
            k = put(mode, slot, vals, k, e + c, vf + i, -about)
            k = put(mode, slot, vals, k, pf + i, e + c, -along)
            k = put(mode, slot, vals, k, pf + i, th + c, -along_rate)
            k = put(mode, slot, vals, k, vf + i, e + c, -about)
            k = put(mode, slot, vals, k, vf + i, th + c, -about_rate)
    return pair_entries(mode, at, modal, s, slot, vals, k)


@njit(cache=True, error_model="numpy", forceinline=True)
def listed_pairs(modal, at, n, kind):
    """Return the entries of a kind, see `PAIRED`, between two modes: mode l and mode k of each."""
    head, lanes = vector_at(modal, at, HEAD), stride(n) // LANES
    first = at + HEAD + 12 * LANES * lanes + 15 * n * n + PRESENT * lanes + (1 + LANES) * int(head[LISTED])
    first += n if head[GATHERED] > 0.0 else 0
    for before in range(kind):
        first += 2 * int(head[PAIRED + before])
    count = int(head[PAIRED + kind])
    return vector_at(modal, first, count), vector_at(modal, first + count, count)


@njit(cache=True, error_model="numpy", forceinline=True)
def pair_entries(mode, at, modal, s, slot, vals, k):
    """Hand over the entries between modes, kind by kind and without a look at those that vanish; return as `put` does.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`.
    at, modal : ndarray
        The body's places, the table of all integrals.
    s : ndarray
        Angular velocity in body components in ``s[0:3]``.
    """
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    place = at[T.AT_MODAL]
    second, turned, mass, stiffness, damping = integrals(modal, place, n)
    x, y, z = s[0], s[1], s[2]
    apart = has_diagonals(modal, at)
    by, of = listed_pairs(modal, place, n, 0)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        centrifugal = 0.5 * (second[l, i] * x * x + second[l, 3 * n + i] * y * y + second[l, 5 * n + i] * z * z)
        centrifugal += second[l, n + i] * x * y + second[l, 2 * n + i] * x * z + second[l, 4 * n + i] * y * z
        own = stiffness[i, l] if i == l or not apart else 0.0
        k = put(mode, slot, vals, k, pf + i, qf + l, own - centrifugal)
    by, of = listed_pairs(modal, place, n, 1)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        gyro = x * turned[l, i] + y * turned[l, n + i] + z * turned[l, 2 * n + i]
        own = damping[i, l] if i == l or not apart else 0.0
        k = put(mode, slot, vals, k, pf + i, vf + l, own - gyro)
    by, of = listed_pairs(modal, place, n, 2)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        mixed = x * second[l, 6 * n + i] + y * second[l, 7 * n + i] + z * second[l, 8 * n + i]
        k = put(mode, slot, vals, k, vf + i, qf + l, -mixed)
    by, of = listed_pairs(modal, place, n, 3)
    for e in range(by.size):
        l, i = int(by[e]), int(of[e])
        k = put(mode, slot, vals, k, vf + i, vf + l, -mass[i, l])
    return k
