"""Named places of a modal body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

REACH = 1e-4
"""How far a marker may be from a node, as a share of the body's size."""


@dataclass(frozen=True, eq=False)
class Seat:
    """A named place of a modal body.

    Attributes
    ----------
    position : ndarray, shape (3,)
        m, in the frame of the nodes.
    moved, turned : ndarray, shape (n, 3)
        Displacement and rotation by one unit of each mode.
    turns : bool
        Whether its rotation is known.
    flexibility : ndarray, shape (6, 6), optional
        Displacement and rotation by unit forces and torques there, of the finite elements free in space, m/N and rad/(N
        m); NaN in directions that the seat lacks.
    """

    position: np.ndarray
    moved: np.ndarray
    turned: np.ndarray
    turns: bool = True
    flexibility: np.ndarray | None = None
