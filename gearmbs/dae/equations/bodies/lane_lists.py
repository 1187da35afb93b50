"""Sums over modes of what each gives to all others, in lanes of eight of these: lists of the lanes that do not vanish.

Modes of a family, such as the bending modes in one plane of a shaft, have something in common with the same others.
Gathered in lanes they leave out more than neighbours in frequency do, a half to two thirds of a shaft with 112 modes.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, all_lanes, lanes_at

ROUNDING = 1e-9
"""Share of its bound up to which an integral of shapes is rounding. Of a shaft with 102 modes, the stiffest 7000 times
as stiff as the softest, those that vanish by symmetry come out up to 3e-10 of it, all others above 1.5e-5."""


def lanes_of(modes: int) -> int:
    """Return how many lanes the numbers of so many modes take."""
    return -(-modes // LANES)


def padded(rows: np.ndarray) -> np.ndarray:
    """Return numbers of all modes, the last axis, filled up to whole lanes."""
    last = rows.shape[-1]
    return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, LANES * lanes_of(last) - last)])


def without_rounding(integrals: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return integrals of modes k and l, shape (n, n, 3), with zeros where nothing but rounding is.

    ``mass`` is the matrix of their masses, shape (n, n), kg; their bound is the root of M_kk M_ll.
    """
    size = np.sqrt(np.maximum(np.diag(mass), 0.0))
    return np.where(np.abs(integrals) > ROUNDING * np.outer(size, size)[..., None], integrals, 0.0)


def in_lanes(rows: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return where modes are gathered; for each lanes how many modes l add to them, these modes, and what they add.

    ``rows`` has shape (n, PRESENT, n): l, number a mode, the other mode.
    """
    order = _alike(np.moveaxis(rows.astype(bool), 2, 0).reshape(rows.shape[2], -1))
    return np.argsort(order), _listed(rows[:, :, order])


def _listed(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the lists of `in_lanes`, modes in the order given."""
    blocks = padded(rows).reshape(rows.shape[0], -1, LANES)
    taken = blocks.any(axis=2).T
    place, mode = np.nonzero(taken)
    return taken.sum(axis=1), mode, blocks[mode, place].ravel()


def _alike(taken: np.ndarray) -> np.ndarray:
    """Return an order in which modes stand beside those with which they share most of what they take part in."""
    parts = taken.astype(float)
    shared = parts @ parts.T
    sizes = np.diag(shared)
    shared /= np.maximum(sizes[:, None] + sizes - shared, 1.0)
    order = [int(np.argmax(sizes))]
    left = np.ones(len(taken), dtype=bool)
    for _ in range(len(taken) - 1):
        left[order[-1]] = False
        order.append(int(np.argmax(np.where(left, shared[order[-LANES:]].sum(axis=0), -1.0))))
    return np.array(order)


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def listed_sum(modes, blocks, e, count, values):
    """Return the sum of ``count`` lanes from the e-th one on times the values of their modes; four advance together."""
    one, two, three, four = all_lanes(0.0), all_lanes(0.0), all_lanes(0.0), all_lanes(0.0)
    last = e + count
    while e + 4 <= last:
        one = one + lanes_at(blocks, e) * values[int(modes[e])]
        two = two + lanes_at(blocks, e + 1) * values[int(modes[e + 1])]
        three = three + lanes_at(blocks, e + 2) * values[int(modes[e + 2])]
        four = four + lanes_at(blocks, e + 3) * values[int(modes[e + 3])]
        e += 4
    while e < last:
        one = one + lanes_at(blocks, e) * values[int(modes[e])]
        e += 1
    return (one + two) + (three + four)
