"""How a point of a modal body moves by one unit of each mode: at a seat, a node, or a section of a beam."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.seats import REACH

if TYPE_CHECKING:
    from gearmbs.flexible.modal_model import ModalModel


def shapes_at(model: ModalModel, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and rotations at a point by one unit of each mode, each (n, 3).

    A seat there comes first; then the nodes: of a beam the section there, else the nearest, with its own rotation
    or that of its neighbours.

    Raises
    ------
    FlexibleError
        If no node is near, or seats are there that move differently.
    """
    point = np.asarray(point, dtype=float)
    here = {
        key: seat
        for key, seat in model.seats.items()
        if seat.turns and np.linalg.norm(seat.position - point) <= REACH * model.size
    }
    if here:
        first, *others = here.values()
        if any(not np.array_equal(first.moved, s.moved) or not np.array_equal(first.turned, s.turned) for s in others):
            raise FlexibleError(
                f"{model.name}: the seats {', '.join(here)} are at one place and move differently; "
                "make the marker by its seat's name: seat_marker(body, name)"
            )
        return first.moved, first.turned
    if model.line:
        return _on_line(model, point)
    distance = np.linalg.norm(model.positions - point, axis=1)
    k = int(np.argmin(distance))
    if distance[k] > REACH * model.size:
        raise FlexibleError(
            f"{model.name}: there is no node at {np.array2string(point, precision=6)} m; the nearest, "
            f"{model.ids[k]}, is {distance[k]:.4g} m away. Put the marker on a node, place(number), or "
            f"reduce with an interface there"
        )
    if model.turned is not None:
        return model.moved[:, k], model.turned[:, k]
    return model.moved[:, k], _fitted(model, k)


def _fitted(model: ModalModel, k: int) -> np.ndarray:
    """Return the rotation of the nearest neighbours of a node by least squares."""
    near = np.argsort(np.linalg.norm(model.positions - model.positions[k], axis=1))[: min(9, len(model.ids))]
    arm = model.positions[near] - model.positions[k]
    if np.linalg.matrix_rank(arm, tol=1e-6 * max(model.size, 1e-300)) < 2:
        return np.zeros((model.modes, 3))
    moved = model.moved[:, near] - model.moved[:, k : k + 1]
    rows = np.zeros((arm.shape[0], 3, 3))
    for c in range(3):
        rows[:, :, c] = np.cross(np.eye(3)[c], arm)
    solved, *_ = np.linalg.lstsq(rows.reshape(-1, 3), moved.reshape(model.modes, -1).T, rcond=None)
    return solved.T


def _on_line(model: ModalModel, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the motion of a point that turns with its section of a beam."""
    moved, turned = section_motion(model, point[2])
    return moved + np.cross(turned, np.array([point[0], point[1], 0.0])), turned


def section_motion(model: ModalModel, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement of the middle, and rotation, of the section of a beam at z, by each mode, each (n, 3).

    Raises
    ------
    FlexibleError
        Off the shaft.
    """
    z = model.positions[:, 2]
    if not z[0] - REACH * model.size <= at <= z[-1] + REACH * model.size:
        raise FlexibleError(
            f"{model.name}: z = {at:.6g} m is off the shaft, which reaches from {z[0]:.6g} to {z[-1]:.6g} m"
        )
    k = int(np.clip(np.searchsorted(z, at) - 1, 0, z.size - 2))
    length = z[k + 1] - z[k]
    x = np.clip((at - z[k]) / length, 0.0, 1.0)
    a, b = model.moved[:, k], model.moved[:, k + 1]
    assert model.turned is not None
    ta, tb = model.turned[:, k], model.turned[:, k + 1]
    moved, turned = (1 - x) * a + x * b, (1 - x) * ta + x * tb
    h = [1 - 3 * x**2 + 2 * x**3, x - 2 * x**2 + x**3, 3 * x**2 - 2 * x**3, x**3 - x**2]
    g = [6 * x * (x - 1), 1 - 4 * x + 3 * x**2, -6 * x * (x - 1), 3 * x**2 - 2 * x]
    moved, turned = moved.copy(), turned.copy()
    for plane, axis, sign in ((0, 1, 1.0), (1, 0, -1.0)):
        ends = (a[:, plane], sign * length * ta[:, axis], b[:, plane], sign * length * tb[:, axis])
        moved[:, plane] = sum(w * e for w, e in zip(h, ends))
        # slopes with shear differ from rotations: keep the nodes' rotations, the field's change between
        turned[:, axis] = sign / length * sum(w * e for w, e in zip(g, ends))
    return moved, turned
