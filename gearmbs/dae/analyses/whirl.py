"""How the modes of a body that is alike about an axis turn with it, for the whirl of flexible bodies.

Turned about the axis a by the angle phi, a deformation with the modal coordinates q is one with exp(phi G) q, where the
generator G is antisymmetric and links modes of equal frequency: by 1 the two planes in which a shaft bends, by n those
of n waves round about. It follows from the integrals of the shapes, which turn as tensors of the body do:

    J1(G q) = [a~, J1(q)],   J2(G q, p) + J2(q, G p) = [a~, J2(q, p)],   C1(G q, p) + C1(q, G p) = a x C1(q, p),

C1 without its symmetric part, which is a total derivative and depends on the order of small rotations. The coordinates
r = exp(Omega t G) q of a body that spins do not turn with it: as displacements of a shaft in axes at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.dae.equations.modal_integrals import ModalInertia

EQUAL = 1e-6
"""Relative distance of squared frequencies, and of damping, of modes that may turn into each other."""

ALIKE = 1e-5
"""Largest part of the integrals that may change when a body is turned that counts as alike all round."""


@dataclass(frozen=True, eq=False)
class Generator:
    """How modal coordinates turn about an axis.

    Attributes
    ----------
    matrix : ndarray, shape (n, n)
        G; the smallest one where the integrals do not tell.
    known : bool
        False if there are pairs of equal frequency of which they do not tell, as of three waves and more.
    gyroscopic : bool
        False if there are pairs that turn, and the body's coupling leaves their gyroscopic terms out.
    """

    matrix: np.ndarray
    known: bool
    gyroscopic: bool


def generator(modal: ModalInertia, axis: np.ndarray) -> Generator | None:
    """Return the generator of a body's modes about an axis, None if the body is not alike about it.

    Parameters
    ----------
    modal : ModalInertia
    axis : ndarray, shape (3,)
        Of length 1, in body components.
    """
    pairs = _pairs(modal)
    length = np.sqrt(np.diag(modal.mass))
    tensors = [
        (modal.j1 / length[:, None, None], 1, _commuted),
        (modal.j2 / np.multiply.outer(length, length)[:, :, None, None], 2, _commuted),
        (0.5 * (modal.c1 - np.swapaxes(modal.c1, 0, 1)) / np.multiply.outer(length, length)[:, :, None], 2, _crossed),
    ]
    columns: list[list[np.ndarray]] = [[] for _ in pairs]
    wanted = []
    for values, modes, turned in tensors:
        size = max(float(np.abs(values).max(initial=0.0)), 1e-300)
        wanted.append(turned(axis, values / size).ravel())
        for column, (k, m) in zip(columns, pairs):
            column.append(_changed(values / size, k, m, modes).ravel())
    target = np.concatenate(wanted)
    matrix = np.zeros((modal.modes, modal.modes))
    if not pairs:
        return Generator(matrix, True, True) if np.abs(target).max(initial=0.0) <= ALIKE else None
    system = np.column_stack([np.concatenate(column) for column in columns])
    left, sizes, right = np.linalg.svd(system, full_matrices=False)
    rank = int(np.sum(sizes > ALIKE * max(1.0, sizes[0])))
    speeds = right[:rank].T @ ((left.T @ target)[:rank] / sizes[:rank])
    # integrals may tell how two pairs turn against each other, and not how either does
    known = bool(np.allclose(np.square(right[:rank]).sum(axis=0), 1.0, atol=ALIKE))
    if np.abs(system @ speeds - target).max() > ALIKE:
        return None
    for speed, (k, m) in zip(speeds, pairs):
        matrix[k, m], matrix[m, k] = -speed * length[m] / length[k], speed * length[k] / length[m]
    for form in (modal.mass, modal.stiffness, modal.damping):
        if np.abs(form @ matrix + matrix.T @ form).max() > ALIKE * np.abs(form).max():
            return None
    return Generator(matrix, known, bool(modal.c1.any()) or not matrix.any())


def _pairs(modal: ModalInertia) -> list[tuple[int, int]]:
    """Return the pairs of modes that have the same frequency and damping."""
    mass = np.diag(modal.mass)
    stiffness, damping = np.diag(modal.stiffness) / mass, np.diag(modal.damping) / mass
    return [
        (k, m)
        for k in range(modal.modes)
        for m in range(k + 1, modal.modes)
        if abs(stiffness[k] - stiffness[m]) <= EQUAL * stiffness[m]
        and abs(damping[k] - damping[m]) <= EQUAL * np.sqrt(stiffness[m]) + EQUAL * damping[m]
    ]


def _changed(values: np.ndarray, k: int, m: int, modes: int) -> np.ndarray:
    """Return the rate of integrals while mode k becomes m and m becomes -k, at one radian a unit of time."""
    out = np.zeros_like(values)
    out[k] += values[m]
    out[m] -= values[k]
    if modes == 2:
        out[:, k] += values[:, m]
        out[:, m] -= values[:, k]
    return out


def _commuted(axis: np.ndarray, values: np.ndarray) -> np.ndarray:
    turn = np.cross(axis, np.eye(3)).T
    return turn @ values - values @ turn


def _crossed(axis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.cross(axis, values)
