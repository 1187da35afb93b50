"""Integrals over a body of its shapes, and the table in which the kernels read them.

What the present state of a body is summed from stands in lanes, neighbouring modes side by side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES
from gearmbs.dae.compiled.views import matrix_at, vector_at

STIFF, TURNED, SPUN, HEAVY = 1, 2, 4, 8
"""What two modes have in common: entries of p_f by q_f, p_f by v_f, v_f by q_f, and v_f by v_f."""

APART = 9
"""Behind J0 in the head of the table: 1 if M, K and D are diagonal."""
LISTED = 10
"""How many lanes are listed."""
HEAD = 12
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
        pairs = STIFF * (self.stiffness.astype(bool) | self.j2.any(axis=(2, 3)))
        pairs += TURNED * (self.damping.astype(bool) | self.c1.any(axis=2)) + SPUN * self.c1.any(axis=2).T
        pairs += HEAVY * self.mass.astype(bool)
        lists = _in_lanes(np.concatenate([second, turned], axis=1))
        head = np.zeros(HEAD)
        head[:APART] = np.ravel(inertia)
        head[APART], head[LISTED] = apart, len(lists[1])
        diagonals = [_padded(np.diag(part)) for part in parts]
        pieces: tuple = (head, _padded(first), second, turned, *parts, pairs, *diagonals, *lists)
        return np.concatenate([np.ravel(piece) for piece in pieces])


def lanes_of(modes: int) -> int:
    """Return how many lanes the numbers of so many modes take."""
    return -(-modes // LANES)


def _padded(rows: np.ndarray) -> np.ndarray:
    """Return numbers of all modes, the last axis, filled up to whole lanes."""
    last = rows.shape[-1]
    return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, LANES * lanes_of(last) - last)])


def _in_lanes(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return for each lanes of the present state how many modes l add to them, these modes, and what they add.

    ``rows`` has shape (n, PRESENT, n): l, number a mode, the other mode.
    """
    blocks = _padded(rows).reshape(rows.shape[0], -1, LANES)
    taken = blocks.any(axis=2).T
    place, mode = np.nonzero(taken)
    return taken.sum(axis=1), mode, blocks[mode, place].ravel()


def present_size(modes: int) -> int:
    """Return how many numbers the present state of a body takes."""
    return PRESENT * LANES * lanes_of(modes)


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
    pairs : ndarray, shape (n, n)
        What modes have in common, a sum of `STIFF` and the others.
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
        matrix_at(modal, m + 3 * n * n, n, n),
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
    """
    wide = stride(n)
    head = vector_at(modal, at, HEAD)
    counts = at + HEAD + 9 * wide + 16 * n * n + 3 * wide
    modes = counts + PRESENT * (wide // LANES)
    listed = int(head[LISTED])
    return (
        head,
        vector_at(modal, at + HEAD, 9 * wide),
        vector_at(modal, counts, PRESENT * (wide // LANES)),
        vector_at(modal, modes, listed),
        vector_at(modal, modes + listed, LANES * listed),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def diagonals(modal, at, n):
    """Return the diagonals of M, K and D, in lanes, as views."""
    wide = stride(n)
    first = at + HEAD + 9 * wide + 16 * n * n
    return vector_at(modal, first, wide), vector_at(modal, first + wide, wide), vector_at(modal, first + 2 * wide, wide)


@njit(cache=True, error_model="numpy", forceinline=True)
def present(partial, at, n):
    """Return dJ/dq (6, n), H (3, n) and sum_l C1_kl v_l (3, n) of a body at present as views, n filled up to lanes."""
    wide = stride(n)
    h = at + 6 * wide
    return matrix_at(partial, at, 6, wide), matrix_at(partial, h, 3, wide), matrix_at(partial, h + 3 * wide, 3, wide)
