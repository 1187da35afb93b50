"""Integrals over a body of its shapes, and the table in which the kernels read them.

What the present state of a body is summed from, and the state itself, stands in lanes, with modes side by side that
have much in common; see `gearmbs.dae.equations.bodies.lane_lists`.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.lane_lists import in_lanes, lanes_of, listed_sum, padded, without_rounding
from gearmbs.dae.equations.constraints.terms import dot3
from gearmbs.dae.equations.rotation import KIN_A, KIN_H, KIN_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.kernels.pointers import IVEC, VEC
from gearmbs.kernels.structs import matrix_at, vector_at

APART = 9
"""Behind J0 in the head of the table: 1 if M, K and D are diagonal."""
LISTED = 10
"""How many lanes are listed."""
PAIRED = 11
"""How many entries two modes, or a mode and itself, have: of p_f by q_f, p_f by v_f, v_f by q_f, and v_f by v_f."""
HEAD = 15
"""Numbers before the integrals."""

SYMMETRIC = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Entries of a symmetric matrix in the order in which they are stored."""
SQUARES = [k for k, (row, column) in enumerate(SYMMETRIC) if row == column]
"""Which of them are on the diagonal. Of J2 these are summed as second moments, 1/2 tr J2 - J2_xx and so on: of two
modes that bend in one plane J2 has three, of which one moment vanishes and another is that of the rotary inertia."""

PRESENT = 12
"""Numbers a mode that a body's present state takes: dJ/dq_k (6), H_k (3), sum_l C1_kl v_l (3)."""
PASSING = 2
"""Numbers a mode that come and go beside it: q_k and v_k, later what turning adds to the force and the momentum."""
SUMS = 6
"""Lanes of sums over modes behind them."""


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
        summed = np.concatenate([second, turned], axis=1)
        squares = np.diagonal(self.j2, axis1=2, axis2=3)
        moments = without_rounding(0.5 * squares.sum(axis=2, keepdims=True) - squares, self.mass)
        summed[:, SQUARES] = moments.swapaxes(1, 2)
        places, lists = in_lanes(summed)
        head = np.zeros(HEAD)
        head[:APART] = np.ravel(inertia)
        head[APART], head[LISTED] = apart, len(lists[1])
        head[PAIRED:] = [len(modes) for modes, _ in pairs]
        gathered = np.empty_like(first)
        gathered[:, places] = first
        diagonals = [padded(np.diag(part)) for part in parts]
        pieces: tuple = (
            head,
            padded(gathered),
            second,
            turned,
            *parts,
            *diagonals,
            *lists,
            places,
            *itertools.chain(*pairs),
        )
        return np.concatenate([np.ravel(piece) for piece in pieces])


def present_size(modes: int) -> int:
    """Return how many numbers the present state of a body takes, with what comes and goes beside it."""
    return LANES * ((PRESENT + PASSING) * lanes_of(modes) + SUMS)


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
        J1 (entries of `SYMMETRIC`, then modes) and C0; modes as in the state.
    counts : ndarray, shape (PRESENT stride / LANES,)
        For each lanes of the state how many modes l add to them.
    modes : ndarray
        These modes, one after the other.
    blocks : ndarray
        What their coordinates, in the last quarter of the state their velocities, are multiplied by.
    places : ndarray, shape (n,)
        Where the modes stand in these lanes.
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
        vector_at(modal, modes + (1 + LANES) * listed, n),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def places_in(modal, at, n):
    """Return where the modes stand in a body's present state, as a view; see `moving`."""
    wide = stride(n)
    modes = at + HEAD + 12 * wide + 15 * n * n + PRESENT * (wide // LANES)
    return vector_at(modal, modes + (1 + LANES) * int(modal[at + LISTED]), n)


@njit(cache=True, error_model="numpy", forceinline=True)
def diagonals(modal, at, n):
    """Return the diagonals of M, K and D, in lanes, as views."""
    wide = stride(n)
    first = at + HEAD + 9 * wide + 15 * n * n
    return vector_at(modal, first, wide), vector_at(modal, first + wide, wide), vector_at(modal, first + 2 * wide, wide)


@njit(cache=True, error_model="numpy", forceinline=True)
def present(partial, at, n):
    """Return dJ/dq (6, n), H (3, n) and sum_l C1_kl v_l (3, n) of a body at present as views.

    Modes stand as `places_in` says, filled up to lanes.
    """
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


@njit(cache=True, error_model="numpy", forceinline=True)
def passing(partial, at, n):
    """Return the rows of `PASSING` and the room for lanes of sums, as views."""
    wide = stride(n)
    rows = at + PRESENT * wide
    sums = vector_at(partial, rows + PASSING * wide, SUMS * LANES)
    return vector_at(partial, rows, wide), vector_at(partial, rows + wide, wide), sums


@njit(cache=True, error_model="numpy", forceinline=True)
def lanes_total(sums, m):
    """Return the sum of what stands in lanes ``m``."""
    total = 0.0
    for k in range(LANES * m, LANES * (m + 1)):
        total += sums[k]
    return total


@njit(types.void(VEC, IVEC, VEC, VEC, VEC), cache=True, late=True, error_model="numpy", fastmath={"contract"})
def update_inertia(y, at, modal, partial, body_row):
    """Write J(q) to the body's row and dJ/dq, H and sum_l C1_kl v_l to its place in ``partial``, and q and v behind."""
    n, place = at[T.AT_MODES], at[T.AT_PARTIAL]
    wide = stride(n)
    head, first, counts, modes, blocks, places = moving(modal, at[T.AT_MODAL], n)
    state = vector_at(partial, place, PRESENT * wide)
    q_f, v_f, sums = passing(partial, place, n)
    amounts, rates = vector_at(y, at[T.AT_QF], n), vector_at(y, at[T.AT_VF], n)
    for k in range(n, wide):
        q_f[k] = v_f[k] = 0.0
    for k in range(n):
        j = int(places[k])
        q_f[j], v_f[j] = amounts[k], rates[k]
    lanes, e = wide // LANES, 0
    for b in range(counts.size):
        count = int(counts[b])
        put_lanes(state, b, listed_sum(modes, blocks, e, count, amounts if b < 9 * lanes else rates))
        e += count
    add_inertia_change(q_f, first, state, head, sums, body_row)


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def add_inertia_change(q_f, first, state, j0, sums, body_row):
    """Complete dJ/dq and H, and write J(q) = J0 + 1/2 sum_k q_k (J1_k + dJ/dq_k) to a body's row.

    Parameters
    ----------
    q_f : ndarray
        Modal coordinates as they stand in the state.
    first, state
        As of `moving`; sums over the modes l in the state, of J2 as second moments, see `SQUARES`.
    j0, sums, body_row : ndarray
        J0; `SUMS` lanes, written; the body's row.
    """
    xx, xy, xz = all_lanes(0.0), all_lanes(0.0), all_lanes(0.0)
    yy, yz, zz = all_lanes(0.0), all_lanes(0.0), all_lanes(0.0)
    lanes = q_f.size // LANES
    for g in range(lanes):
        # J(q) = J0 + sum_k q_k (J1_k + dJ/dq_k) / 2, dJ/dq_k = J1_k + sum_l J2_kl q_l
        moved = 0.5 * lanes_at(q_f, g)
        along_x, along_y, along_z = lanes_at(state, g), lanes_at(state, 3 * lanes + g), lanes_at(state, 5 * lanes + g)
        # second moments to moments of inertia: J_xx is the sum of those along y and z
        put_lanes(state, g, along_y + along_z)
        put_lanes(state, 3 * lanes + g, along_x + along_z)
        put_lanes(state, 5 * lanes + g, along_x + along_y)
        xx = xx + moved * complete(first, state, g)
        xy = xy + moved * complete(first, state, lanes + g)
        xz = xz + moved * complete(first, state, 2 * lanes + g)
        yy = yy + moved * complete(first, state, 3 * lanes + g)
        yz = yz + moved * complete(first, state, 4 * lanes + g)
        zz = zz + moved * complete(first, state, 5 * lanes + g)
        for m in range(6, 9):
            complete(first, state, m * lanes + g)
    put_lanes(sums, 0, xx)
    put_lanes(sums, 1, xy)
    put_lanes(sums, 2, xz)
    put_lanes(sums, 3, yy)
    put_lanes(sums, 4, yz)
    put_lanes(sums, 5, zz)
    i = T.BODY_INERTIA
    body_row[i], body_row[i + 4] = j0[0] + lanes_total(sums, 0), j0[4] + lanes_total(sums, 3)
    body_row[i + 8] = j0[8] + lanes_total(sums, 5)
    body_row[i + 1] = body_row[i + 3] = j0[1] + lanes_total(sums, 1)
    body_row[i + 2] = body_row[i + 6] = j0[2] + lanes_total(sums, 2)
    body_row[i + 5] = body_row[i + 7] = j0[5] + lanes_total(sums, 4)


@njit(cache=True, error_model="numpy", forceinline=True)
def complete(first, state, b):
    """Add what does not depend on the modes l to lanes of the state; return twice the one and once the other."""
    constant = lanes_at(first, b)
    total = constant + lanes_at(state, b)
    put_lanes(state, b, total)
    return constant + total


@njit(cache=True, error_model="numpy", forceinline=True)
def inertia_change(change, k, w, i, out, j):
    """Write dJ/dq_k w to ``out[j:j+3]``, body components, w in ``w[i:i+3]``; ``change`` as of `present`."""
    x, y, z = w[i], w[i + 1], w[i + 2]
    # symmetric, by its entries xx, xy, xz, yy, yz, zz
    out[j] = change[0, k] * x + change[1, k] * y + change[2, k] * z
    out[j + 1] = change[1, k] * x + change[3, k] * y + change[4, k] * z
    out[j + 2] = change[2, k] * x + change[4, k] * y + change[5, k] * z


@njit(types.void(VEC, IVEC, VEC, VEC), cache=True, late=True, error_model="numpy")
def add_momentum(y, at, partial, kin_row):
    """Add sum_k H_k v_k to the angular momentum h of the body's row."""
    n = at[T.AT_MODES]
    wide = stride(n)
    h = vector_at(partial, at[T.AT_PARTIAL] + 6 * wide, 3 * wide)
    _, v_f, sums = passing(partial, at[T.AT_PARTIAL], n)
    lanes = wide // LANES
    for m in range(3):
        total = all_lanes(0.0)
        for g in range(lanes):
            # h gains sum_k H_k v_k, in body components, turned by A below
            total = total + lanes_at(h, m * lanes + g) * lanes_at(v_f, g)
        put_lanes(sums, m, total)
    x, y_, z = lanes_total(sums, 0), lanes_total(sums, 1), lanes_total(sums, 2)
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
    places = places_in(modal, at[T.AT_MODAL], n)
    wx, wy, wz = spin_in_body(kin_row)
    for k in range(n):
        j = int(places[k])
        turning = h[0, j] * wx + h[1, j] * wy + h[2, j] * wz
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
    inertial, turning, _ = passing(partial, at[T.AT_PARTIAL], n)
    set_turning_terms(partial, at[T.AT_PARTIAL], n, spin_in_body(kin_row), inertial, turning)
    places = places_in(modal, at[T.AT_MODAL], n)
    if has_diagonals(modal, at):
        diagonal_rows(y, yp, at, modal, places, inertial, turning, out)
        return
    _, _, mass, stiffness, damping = integrals(modal, at[T.AT_MODAL], n)
    for k in range(n):
        j = int(places[k])
        force = row_product(stiffness, False, k, y, qf) + row_product(damping, False, k, y, vf) - inertial[j]
        out[pf + k] = yp[pf + k] + force
        out[vf + k] = y[pf + k] - turning[j] - row_product(mass, False, k, y, vf)
        out[qf + k] = y[vf + k] - yp[qf + k]


@njit(cache=True, error_model="numpy", forceinline=True)
def set_turning_terms(partial, at, n, spin, inertial, turning):
    """Write 1/2 w . dJ/dq_k w + w . sum_l C1_kl v_l and w . H_k of all modes as they stand in the state."""
    row = stride(n) // LANES
    state = vector_at(partial, at, PRESENT * row * LANES)
    wx, wy, wz = spin
    for g in range(row):
        squares = lanes_at(state, g) * (wx * wx) + lanes_at(state, 3 * row + g) * (wy * wy)
        squares = squares + lanes_at(state, 5 * row + g) * (wz * wz)
        products = lanes_at(state, row + g) * (wx * wy) + lanes_at(state, 2 * row + g) * (wx * wz)
        products = products + lanes_at(state, 4 * row + g) * (wy * wz)
        gyro = lanes_at(state, 9 * row + g) * wx + lanes_at(state, 10 * row + g) * wy
        gyro = gyro + lanes_at(state, 11 * row + g) * wz
        put_lanes(inertial, g, 0.5 * squares + products + gyro)
        momentum = lanes_at(state, 6 * row + g) * wx + lanes_at(state, 7 * row + g) * wy
        put_lanes(turning, g, momentum + lanes_at(state, 8 * row + g) * wz)


@njit(cache=True, error_model="numpy", forceinline=True)
def diagonal_rows(y, yp, at, modal, places, inertial, turning, out):
    """Write the rows of `modal_residual` if M, K and D are diagonal.

    Parameters
    ----------
    y, yp, at, modal, out
        As of `modal_residual`.
    places, inertial, turning : ndarray
        Of `places_in` and `set_turning_terms`.
    """
    n, pf, vf, qf = at[T.AT_MODES], at[T.AT_PF], at[T.AT_VF], at[T.AT_QF]
    mass, stiffness, damping = diagonals(modal, at[T.AT_MODAL], n)
    for k in range(n):
        j, rate = int(places[k]), y[vf + k]
        out[pf + k] = yp[pf + k] + stiffness[k] * y[qf + k] + damping[k] * rate - inertial[j]
        out[vf + k] = y[pf + k] - turning[j] - mass[k] * rate
        out[qf + k] = rate - yp[qf + k]


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
    places, apart = places_in(modal, at[T.AT_MODAL], n), has_diagonals(modal, at)
    s = np.zeros(12)
    to_body(kin_row, kin_row, KIN_W, s, 0)
    for k in range(n):
        j = int(places[k])
        inertia_change(change, j, s, 0, s, 3)
        total = 0.5 * dot3(s, 0, s, 3)
        for c in range(3):
            total += s[c] * gyro[c, j]
            s[9 + c] -= y[vf + k] * (s[3 + c] + gyro[c, j])
            s[6 + c] = h[c, j]
        for l in range(n):
            mass_out[k, l] = mass[k, l]
            for c in range(3):
                total -= s[c] * second[l, (6 + c) * n + k] * y[vf + l]
        rhs_modes[k] = total - row_product(stiffness, apart, k, y, qf) - row_product(damping, apart, k, y, vf)
        to_global(kin_row, s, 6, s, 3)
        for c in range(3):
            coupling_out[k, c] = s[3 + c]
    to_global(kin_row, s, 9, rhs_rotation, 0)
