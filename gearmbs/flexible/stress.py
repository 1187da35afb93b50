"""Stresses of bodies that deform: linear in the modal coordinates, by stress modes.

A shape u_k of a body has the stresses S_k; the body that is deformed by sum_k q_k u_k has sum_k q_k S_k. Six numbers
describe a stress: xx, yy, zz, xy, yz, zx, in the frame of the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from gearmbs.flexible.errors import FlexibleError

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")


class StressRecovery(Protocol):
    """How stresses follow from displacements and rotations of the nodes, each (n, N, 3)."""

    def __call__(self, moved: np.ndarray, turned: np.ndarray | None) -> StressModes:
        """Return the stresses of n shapes."""


class Peak(NamedTuple):
    """The largest equivalent stress of a body over time.

    Attributes
    ----------
    stress : float
        Pa.
    instant, place : int
        When, as a row of the coordinates, and where, as a row of the positions.
    position : ndarray, shape (3,)
        m.
    """

    stress: float
    instant: int
    place: int
    position: np.ndarray


@dataclass(frozen=True, eq=False)
class StressModes:
    """Stresses by one unit of each modal coordinate.

    Parameters
    ----------
    positions : ndarray, shape (P, 3)
        m, in the frame of the nodes.
    values : ndarray, shape (n, P, 6)
        xx, yy, zz, xy, yz, zx, Pa.

    Raises
    ------
    FlexibleError
        If sizes do not fit each other or a number is not finite.
    """

    positions: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", np.asarray(self.positions, dtype=float))
        object.__setattr__(self, "values", np.asarray(self.values, dtype=float))
        if self.values.ndim != 3 or self.values.shape[1:] != (len(self.positions), len(COMPONENTS)):
            raise FlexibleError(
                f"StressModes: values have shape {self.values.shape} for {len(self.positions)} places; give (modes, "
                f"places, {len(COMPONENTS)}): {', '.join(COMPONENTS)}"
            )
        if not np.all(np.isfinite(self.values)):
            raise FlexibleError("StressModes: values have entries that are not finite")

    def __repr__(self) -> str:
        return f"StressModes({len(self.values)} modes, {len(self.positions)} places)"

    def at(self, coordinates: npt.ArrayLike) -> np.ndarray:
        """Return the stresses for modal coordinates of shape (..., n), shape (..., P, 6), Pa.

        Raises
        ------
        FlexibleError
            For another number of coordinates.
        """
        q = np.asarray(coordinates, dtype=float)
        if q.ndim == 0 or q.shape[-1] != len(self.values):
            raise FlexibleError(f"coordinates have shape {q.shape}; there are stresses of {len(self.values)} modes")
        return np.tensordot(q, self.values, axes=1)

    def von_mises(self, coordinates: npt.ArrayLike) -> np.ndarray:
        """Return the equivalent stress by von Mises, shape (..., P), Pa; arguments as of `at`."""
        xx, yy, zz, xy, yz, zx = np.moveaxis(self.at(coordinates), -1, 0)
        normal = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
        return np.sqrt(normal + 3.0 * (xy**2 + yz**2 + zx**2))

    def principal(self, coordinates: npt.ArrayLike) -> np.ndarray:
        """Return the principal stresses, the largest first, shape (..., P, 3), Pa; arguments as of `at`."""
        xx, yy, zz, xy, yz, zx = np.moveaxis(self.at(coordinates), -1, 0)
        rows = (np.stack(row, axis=-1) for row in ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz)))
        return np.linalg.eigvalsh(np.stack(list(rows), axis=-2))[..., ::-1]

    def peak(self, coordinates: npt.ArrayLike) -> Peak:
        """Return the largest equivalent stress over instants, coordinates of shape (m, n), and where it is."""
        rows = np.atleast_2d(np.asarray(coordinates, dtype=float))
        if not rows.size:
            raise FlexibleError("peak: the coordinates have no instants")
        best, when = np.array([-1.0]), 0
        for k, q in enumerate(rows):  # one by one: a long run of a large mesh would not fit into memory
            here = self.von_mises(q)
            if here.max() > best.max():
                best, when = here, k
        place = int(np.argmax(best))
        return Peak(float(best[place]), when, place, self.positions[place])
