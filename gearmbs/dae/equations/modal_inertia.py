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

from dataclasses import dataclass

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import dot3
from gearmbs.dae.equations.entries import put
from gearmbs.dae.equations.rotation import KIN_A, KIN_ADOT, KIN_AXES, KIN_H, KIN_W


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

        What is summed over modes l stands in one row for each, the other mode last, so that the sums are of whole rows.
        Where most integrals vanish by symmetry, those that do not are listed as well: their places in the present
        state, the modes l, their values; first those of J2 and C1_lk, then those of C1_kl.
        """
        n = self.modes
        rows, columns = np.array(SYMMETRIC).T
        first = np.moveaxis(self.j1[:, rows, columns], 0, 1)
        second = np.moveaxis(self.j2[:, :, rows, columns], 1, 2).reshape(n, -1)
        coupling = np.moveaxis(self.c1, 1, 2).reshape(n, -1)
        turned = np.moveaxis(self.c1, (0, 1, 2), (2, 0, 1)).reshape(n, -1)
        parts = (self.mass, self.stiffness, self.damping)
        apart = all(np.array_equal(part, np.diag(np.diag(part))) for part in parts)
        rows = np.hstack([second, coupling])
        lists = [_listed(rows, 0), _listed(turned, 9 * n)]
        if sum(len(part) for part in lists) > LISTED * (rows.size + turned.size):
            lists = [np.empty((0, 2))] * 2
        head = [float(apart), *(float(len(part)) for part in lists)]
        pairs = STIFF * (self.stiffness.astype(bool) | self.j2.any(axis=(2, 3)))
        pairs += TURNED * (self.damping.astype(bool) | self.c1.any(axis=2)) + SPUN * self.c1.any(axis=2).T
        pairs += HEAVY * self.mass.astype(bool)
        pieces: tuple = (inertia, head, first, self.c0.T, rows, turned, *parts, pairs, *lists)
        return np.concatenate([np.ravel(piece) for piece in pieces])


def _listed(rows: np.ndarray, first: int) -> np.ndarray:
    """Return place and row, packed, and value of each entry that is not zero; the places begin with ``first``."""
    l, k = np.nonzero(rows)
    return np.column_stack([first + k + ROW_OF_ENTRY * l, rows[l, k]])


LISTED = 0.25
"""Share of integrals that do not vanish up to which they are taken one by one."""

ROW_OF_ENTRY = 1 << 24
"""Factor of the row in the number that says where an entry belongs: more than all places."""
WHOLE_ROW, LAST_PLACE = np.uint64(ROW_OF_ENTRY), np.uint64(ROW_OF_ENTRY - 1)

STIFF, TURNED, SPUN, HEAVY = 1, 2, 4, 8
"""What two modes have in common: entries of p_f by q_f, p_f by v_f, v_f by q_f, and v_f by v_f."""

HEAD = 12
"""Numbers before the integrals: J0, whether M, K and D are diagonal, the lengths of both lists."""

SYMMETRIC = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Entries of a symmetric matrix in the order in which they are stored."""

PRESENT = 12
"""Numbers a mode that a body's present state takes: dJ/dq_k (6), H_k (3), sum_l C1_kl v_l (3)."""


def present_size(modes: int) -> int:
    """Return how many numbers the present state of a body takes."""
    return PRESENT * modes


@njit(cache=True, error_model="numpy", forceinline=True)
def integrals(modal, at, n):
    """Return the table of a body with n modal coordinates as views.

    Returns
    -------
    j0 : ndarray, shape (HEAD,)
        J0, 1 if M, K and D are diagonal, and the lengths of the lists.
    first : ndarray, shape (9 n,)
        J1 (entries of `SYMMETRIC`, then modes) and C0.
    second : ndarray, shape (n, 9 n)
        J2 and C1_lk, a row for each l.
    turned : ndarray, shape (n, 3 n)
        C1_kl, a row for each l.
    mass, stiffness, damping : ndarray, shape (n, n)
    pairs : ndarray, shape (n, n)
        What modes have in common, a sum of `STIFF` and the others.
    """
    first = at + HEAD
    second = first + 9 * n
    turned = second + 9 * n * n
    m = turned + 3 * n * n
    return (
        vector_at(modal, at, HEAD),
        vector_at(modal, first, 9 * n),
        matrix_at(modal, second, n, 9 * n),
        matrix_at(modal, turned, n, 3 * n),
        matrix_at(modal, m, n, n),
        matrix_at(modal, m + n * n, n, n),
        matrix_at(modal, m + 2 * n * n, n, n),
        matrix_at(modal, m + 3 * n * n, n, n),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def present(partial, at, n):
    """Return dJ/dq (6, n), H (3, n) and sum_l C1_kl v_l (3, n) of a body at present as views."""
    return matrix_at(partial, at, 6, n), matrix_at(partial, at + 6 * n, 3, n), matrix_at(partial, at + 9 * n, 3, n)


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


@njit(cache=True, error_model="numpy", forceinline=True)
def add_listed(y, q, v, listed, turns, entries, state):
    """Add what the integrals that are listed one by one give to the present state of a body.

    Parameters
    ----------
    y
        Unknowns.
    q, v : int
        Places of the modal coordinates and velocities.
    listed, turns : int
        Numbers of entries to be multiplied by the coordinates, then by the velocities.
    entries : ndarray, shape (listed + turns, 2)
        See `ModalInertia.table`.
    state : ndarray
        Of `present`, as one vector.
    """
    for e in range(listed):
        where = np.uint64(int(entries[e, 0]))
        state[where & LAST_PLACE] += y[np.uint64(q) + where // WHOLE_ROW] * entries[e, 1]
    for e in range(listed, listed + turns):
        where = np.uint64(int(entries[e, 0]))
        state[where & LAST_PLACE] += y[np.uint64(v) + where // WHOLE_ROW] * entries[e, 1]


@njit(cache=True, error_model="numpy")
def update_inertia(y, at, modal, partial, body_row):
    """Write J(q) to the body's row and dJ/dq, H and sum_l C1_kl v_l to its place in ``partial``."""
    n, q, v, place = at[T.AT_MODES], at[T.AT_QF], at[T.AT_VF], at[T.AT_PARTIAL]
    j0, first, second, turned, _, _, _, _ = integrals(modal, at[T.AT_MODAL], n)
    both, gyro = vector_at(partial, place, 9 * n), vector_at(partial, place + 9 * n, 3 * n)
    for k in range(9 * n):
        both[k] = first[k]
    for k in range(3 * n):
        gyro[k] = 0.0
    listed, turns = int(j0[10]), int(j0[11])
    if listed + turns > 0:
        entries = matrix_at(modal, at[T.AT_MODAL] + HEAD + 9 * n + 16 * n * n, listed + turns, 2)
        add_listed(y, q, v, listed, turns, entries, vector_at(partial, place, 12 * n))
    else:
        for l in range(n):
            amount, rate = y[q + l], y[v + l]
            row, other = second[l], turned[l]
            for k in range(9 * n):
                both[k] += amount * row[k]
            for k in range(3 * n):
                gyro[k] += rate * other[k]
    add_inertia_change(vector_at(y, q, n), matrix_at(first, 0, 6, n), matrix_at(both, 0, 6, n), j0, body_row)


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


@njit(cache=True, error_model="numpy")
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
def row_product(matrix, apart, k, y, i):
    """Return row k of a matrix, which may be diagonal, times ``y[i:i+n]``."""
    if apart:
        return matrix[k, k] * y[i + k]
    total = 0.0
    for l in range(matrix.shape[0]):
        total += matrix[k, l] * y[i + l]
    return total


@njit(cache=True, error_model="numpy")
def set_modal_momenta(y, at, modal, partial, kin_row):
    """Write p_f = dT/dv_f to y."""
    n = at[T.AT_MODES]
    j0, _, _, _, mass, _, _, _ = integrals(modal, at[T.AT_MODAL], n)
    _, h, _ = present(partial, at[T.AT_PARTIAL], n)
    wx, wy, wz = spin_in_body(kin_row)
    for k in range(n):
        turning = h[0, k] * wx + h[1, k] * wy + h[2, k] * wz
        y[at[T.AT_PF] + k] = turning + row_product(mass, j0[9] > 0.0, k, y, at[T.AT_VF])


@njit(cache=True, error_model="numpy")
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
    j0, _, _, _, mass, stiffness, damping, _ = integrals(modal, at[T.AT_MODAL], n)
    change, h, gyro = present(partial, at[T.AT_PARTIAL], n)
    apart = j0[9] > 0.0
    wx, wy, wz = spin_in_body(kin_row)
    for k in range(n):
        inertial = 0.5 * (change[0, k] * wx * wx + change[3, k] * wy * wy + change[5, k] * wz * wz)
        inertial += change[1, k] * wx * wy + change[2, k] * wx * wz + change[4, k] * wy * wz
        inertial += wx * gyro[0, k] + wy * gyro[1, k] + wz * gyro[2, k]
        force = row_product(stiffness, apart, k, y, qf) + row_product(damping, apart, k, y, vf) - inertial
        momentum = wx * h[0, k] + wy * h[1, k] + wz * h[2, k] + row_product(mass, apart, k, y, vf)
        out[pf + k] = yp[pf + k] + force
        out[vf + k] = y[pf + k] - momentum
        out[qf + k] = y[vf + k] - yp[qf + k]


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
    j0, _, second, _, mass, stiffness, damping, _ = integrals(modal, at[T.AT_MODAL], n)
    change, h, gyro = present(partial, at[T.AT_PARTIAL], n)
    apart = j0[9] > 0.0
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


@njit(cache=True, error_model="numpy")
def modal_body_entries(mode, cj, y, at, modal, partial, kin_row, slot, vals, k):
    """Hand over the entries of a body's modal inertia, stiffness and damping; return the number of the next entry.

    Entries whose integrals are all zero, and stay so, are left out.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`.
    cj : float
        Factor of y'.
    at, modal, partial, kin_row
        The body's places, the table of all integrals, the present state, its row of the kinematics table.
    """
    n, p, e, th = at[T.AT_MODES], at[T.AT_P], at[T.AT_EPS], at[T.AT_THETA]
    pf, vf, qf = at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    change, h, gyro = present(partial, at[T.AT_PARTIAL], n)
    s = np.empty(30)
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
        k = pair_entries(mode, i, at, modal, s, slot, vals, k)
    return k


@njit(cache=True, error_model="numpy")
def pair_entries(mode, i, at, modal, s, slot, vals, k):
    """Hand over the entries of mode i with all modes; return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`.
    i : int
        Mode.
    at, modal : ndarray
        The body's places, the table of all integrals.
    s : ndarray
        Angular velocity in body components in ``s[0:3]``.
    """
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    _, _, second, turned, mass, stiffness, damping, pairs = integrals(modal, at[T.AT_MODAL], n)
    x, y, z = s[0], s[1], s[2]
    for l in range(n):
        common = int(pairs[i, l])
        if common == 0:
            continue
        row, other = second[l], turned[l]
        if common & STIFF:
            centrifugal = 0.5 * (row[i] * x * x + row[3 * n + i] * y * y + row[5 * n + i] * z * z)
            centrifugal += row[n + i] * x * y + row[2 * n + i] * x * z + row[4 * n + i] * y * z
            k = put(mode, slot, vals, k, pf + i, qf + l, stiffness[i, l] - centrifugal)
        if common & TURNED:
            gyro = x * other[i] + y * other[n + i] + z * other[2 * n + i]
            k = put(mode, slot, vals, k, pf + i, vf + l, damping[i, l] - gyro)
        if common & SPUN:
            mixed = x * row[6 * n + i] + y * row[7 * n + i] + z * row[8 * n + i]
            k = put(mode, slot, vals, k, vf + i, qf + l, -mixed)
        if common & HEAVY:
            k = put(mode, slot, vals, k, vf + i, vf + l, -mass[i, l])
    return k
