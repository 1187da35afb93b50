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
        """Return the numbers as the kernels read them, see `integrals`; ``inertia`` is that of the undeformed body."""
        parts = (inertia, self.j1, self.j2, self.c0, self.c1, self.mass, self.stiffness, self.damping)
        return np.concatenate([np.ravel(part) for part in parts])


@njit(cache=True, error_model="numpy", forceinline=True)
def integrals(modal, at, n):
    """Return the views J0, J1, J2, C0, C1, M, K, D of the table of a body with n modal coordinates."""
    j1 = at + 9
    j2 = j1 + 9 * n
    c0 = j2 + 9 * n * n
    c1 = c0 + 3 * n
    m = c1 + 3 * n * n
    return (
        vector_at(modal, at, 9),
        matrix_at(modal, j1, n, 9),
        matrix_at(modal, j2, n * n, 9),
        matrix_at(modal, c0, n, 3),
        matrix_at(modal, c1, n * n, 3),
        matrix_at(modal, m, n, n),
        matrix_at(modal, m + n * n, n, n),
        matrix_at(modal, m + 2 * n * n, n, n),
    )


@njit(cache=True, error_model="numpy")
def to_body(kin_row, v, i, out, k):
    """Write the body components of the global vector ``v[i:i+3]`` to ``out[k:k+3]``."""
    x, y, z = v[i], v[i + 1], v[i + 2]
    for c in range(3):
        out[k + c] = kin_row[KIN_A + c] * x + kin_row[KIN_A + 3 + c] * y + kin_row[KIN_A + 6 + c] * z


@njit(cache=True, error_model="numpy")
def to_global(kin_row, v, i, out, k):
    """Write the global components of the vector ``v[i:i+3]`` given in body components to ``out[k:k+3]``."""
    x, y, z = v[i], v[i + 1], v[i + 2]
    for c in range(3):
        a = KIN_A + 3 * c
        out[k + c] = kin_row[a] * x + kin_row[a + 1] * y + kin_row[a + 2] * z


@njit(cache=True, error_model="numpy")
def update_inertia(y, at, modal, body_row):
    """Write J(q) to the body's row."""
    n, q = at[T.AT_MODES], at[T.AT_QF]
    j0, j1, j2, _, _, _, _, _ = integrals(modal, at[T.AT_MODAL], n)
    for c in range(9):
        total = j0[c]
        for k in range(n):
            total += y[q + k] * j1[k, c]
            for l in range(n):
                total += 0.5 * y[q + k] * y[q + l] * j2[n * k + l, c]
        body_row[T.BODY_INERTIA + c] = total


@njit(cache=True, error_model="numpy")
def coupling(y, at, modal, k, out, i):
    """Write H_k(q) to ``out[i:i+3]``, body components."""
    n, q = at[T.AT_MODES], at[T.AT_QF]
    _, _, _, c0, c1, _, _, _ = integrals(modal, at[T.AT_MODAL], n)
    for c in range(3):
        out[i + c] = c0[k, c]
        for l in range(n):
            out[i + c] += y[q + l] * c1[n * l + k, c]


@njit(cache=True, error_model="numpy")
def inertia_change(y, at, modal, k, w, i, out, j):
    """Write dJ/dq_k w to ``out[j:j+3]``, body components, w in ``w[i:i+3]``.

    Parameters
    ----------
    y
        Unknowns.
    at, modal : ndarray
        The body's places, the table of all integrals.
    k : int
        Mode.
    w, i : ndarray, int
        The vector and its place.
    out, j : ndarray, int
        Where to write.
    """
    n, q = at[T.AT_MODES], at[T.AT_QF]
    _, j1, j2, _, _, _, _, _ = integrals(modal, at[T.AT_MODAL], n)
    for r in range(3):
        total = 0.0
        for c in range(3):
            entry = j1[k, 3 * r + c]
            for l in range(n):
                entry += y[q + l] * j2[n * k + l, 3 * r + c]
            total += entry * w[i + c]
        out[j + r] = total


@njit(cache=True, error_model="numpy")
def gyroscopic(y, at, modal, k, out, i):
    """Write sum_l C1_kl v_l, the derivative of sum_l H_l v_l by q_k, to ``out[i:i+3]``, body components."""
    n, v = at[T.AT_MODES], at[T.AT_VF]
    _, _, _, _, c1, _, _, _ = integrals(modal, at[T.AT_MODAL], n)
    for c in range(3):
        out[i + c] = 0.0
        for l in range(n):
            out[i + c] += y[v + l] * c1[n * k + l, c]


@njit(cache=True, error_model="numpy")
def add_momentum(y, at, modal, kin_row):
    """Add sum_k H_k v_k to the angular momentum h of the body's row."""
    s = np.empty(6)
    for k in range(at[T.AT_MODES]):
        coupling(y, at, modal, k, s, 0)
        to_global(kin_row, s, 0, s, 3)
        for c in range(3):
            kin_row[KIN_H + c] += s[3 + c] * y[at[T.AT_VF] + k]


@njit(cache=True, error_model="numpy")
def set_modal_momenta(y, at, modal, kin_row):
    """Write p_f = dT/dv_f to y."""
    n = at[T.AT_MODES]
    _, _, _, _, _, mass, _, _ = integrals(modal, at[T.AT_MODAL], n)
    s = np.empty(6)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for k in range(n):
        coupling(y, at, modal, k, s, 3)
        total = dot3(s, 3, s, 0)
        for l in range(n):
            total += mass[k, l] * y[at[T.AT_VF] + l]
        y[at[T.AT_PF] + k] = total


@njit(cache=True, error_model="numpy")
def modal_residual(y, yp, at, modal, kin_row, out):
    """Write the rows p_f' - L_qf, p_f - L_vf and v_f - q_f' of a body; loads and constraints are added elsewhere."""
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    _, _, _, _, _, mass, stiffness, damping = integrals(modal, at[T.AT_MODAL], n)
    s = np.empty(9)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for k in range(n):
        inertia_change(y, at, modal, k, s, 0, s, 3)
        gyroscopic(y, at, modal, k, s, 6)
        force = -0.5 * dot3(s, 0, s, 3) - dot3(s, 0, s, 6)
        coupling(y, at, modal, k, s, 3)
        momentum = dot3(s, 0, s, 3)
        for l in range(n):
            force += stiffness[k, l] * y[qf + l] + damping[k, l] * y[vf + l]
            momentum += mass[k, l] * y[vf + l]
        out[pf + k] = yp[pf + k] + force
        out[vf + k] = y[pf + k] - momentum
        out[qf + k] = y[vf + k] - yp[qf + k]


@njit(cache=True, error_model="numpy")
def modal_acceleration_terms(y, at, modal, kin_row, mass_out, coupling_out, rhs_modes, rhs_rotation):
    """Write what a body adds to the acceleration system.

    Parameters
    ----------
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
    _, _, _, _, c1, mass, stiffness, damping = integrals(modal, at[T.AT_MODAL], n)
    s = np.empty(12)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for c in range(3):
        s[9 + c] = 0.0
    for k in range(n):
        inertia_change(y, at, modal, k, s, 0, s, 3)
        gyroscopic(y, at, modal, k, s, 6)
        total = 0.5 * dot3(s, 0, s, 3) + dot3(s, 0, s, 6)
        for c in range(3):
            s[9 + c] -= y[vf + k] * (s[3 + c] + s[6 + c])
        for l in range(n):
            total -= stiffness[k, l] * y[qf + l] + (damping[k, l] + dot3(s, 0, c1[n * l + k], 0)) * y[vf + l]
            mass_out[k, l] = mass[k, l]
        rhs_modes[k] = total
        coupling(y, at, modal, k, s, 3)
        to_global(kin_row, s, 3, s, 6)
        for c in range(3):
            coupling_out[k, c] = s[6 + c]
    to_global(kin_row, s, 9, rhs_rotation, 0)


@njit(cache=True, error_model="numpy")
def modal_body_entries(mode, cj, y, at, modal, kin_row, slot, vals, k):
    """Hand over the entries of a body's modal inertia, stiffness and damping; return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`.
    cj : float
        Factor of y'.
    at, modal, kin_row
        The body's places, the table of all integrals, its row of the kinematics table.
    """
    n, p, e, th = at[T.AT_MODES], at[T.AT_P], at[T.AT_EPS], at[T.AT_THETA]
    pf, vf, qf = at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    _, _, j2, _, c1, mass, stiffness, damping = integrals(modal, at[T.AT_MODAL], n)
    s = np.empty(30)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for c in range(3):
        to_body(kin_row, kin_row, KIN_AXES + 3 * c, s, 12 + 3 * c)
        to_body(kin_row, kin_row, KIN_ADOT + 3 * c, s, 21 + 3 * c)
    for i in range(n):
        inertia_change(y, at, modal, i, s, 0, s, 3)
        gyroscopic(y, at, modal, i, s, 6)
        for c in range(3):
            s[3 + c] += s[6 + c]
        coupling(y, at, modal, i, s, 6)
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
        for l in range(n):
            centrifugal = 0.0
            for r in range(3):
                for c in range(3):
                    centrifugal += 0.5 * s[r] * j2[n * i + l, 3 * r + c] * s[c]
            k = put(mode, slot, vals, k, pf + i, qf + l, stiffness[i, l] - centrifugal)
            k = put(mode, slot, vals, k, pf + i, vf + l, damping[i, l] - dot3(s, 0, c1[n * i + l], 0))
            k = put(mode, slot, vals, k, vf + i, qf + l, -dot3(s, 0, c1[n * l + i], 0))
            k = put(mode, slot, vals, k, vf + i, vf + l, -mass[i, l])
    return k
