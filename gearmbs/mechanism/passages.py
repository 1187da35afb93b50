"""Positions passed in a run in which constraints depend on each other: a remark, since what follows is doubtful."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.dae.results.solution import Solution

MOST_ROWS = 150
"""Constraint rows up to which it is looked for: the work grows with their third power."""
SAMPLES = 200
"""Outputs that are looked at, at most."""
NEAR = 0.01
"""Smallest singular value of the constraints, of its initial one, below which a position counts as singular."""
BETWEEN = 0.2
"""The same, at one of two outputs between which it may have passed zero."""
ALIKE = 0.9
"""Cosine from which singular vectors of two outputs are the same one, but for its sign."""


def singular_passage(solution: Solution) -> tuple[float, str] | None:
    """Return when a run passed a position in which constraints depend on each other, s, and which; None without one.

    There the Jacobian of the constraints, in spatial displacements, loses rank: its smallest singular value falls to
    zero. If that is between two outputs, it shows by a sign: of a value that passes zero one singular vector is turned
    over and the other is not; and where all motion is prescribed, the determinant changes its sign.
    """
    system = solution.system
    names = system.row_names
    if not names or len(names) > MOST_ROWS or solution.t.size < 2:
        return None
    scale = 1.0 / np.sqrt(system.coordinate_weights())
    bodies = [
        np.concatenate([part.reshape(solution.t.size, -1) for part in parts], axis=1)
        for parts in (
            (solution.com_position(n), solution.orientation(n), solution.com_velocity(n), solution.angular_velocity(n))
            for n in system.body_names
        )
    ]
    poses = np.stack(bodies, axis=1)
    if poses.shape[1] * 6 != scale.size:
        # bodies with modes have coordinates of their own
        return None
    first = sign = 0.0
    before: tuple[float, float, np.ndarray, np.ndarray] | None = None
    for k in np.unique(np.linspace(0, solution.t.size - 1, SAMPLES).astype(int)):
        jacobian = system.constraint_jacobian(poses[k], float(solution.t[k]))[0].toarray() * scale
        left, values, right = np.linalg.svd(jacobian, full_matrices=False)
        here = (float(solution.t[k]), float(values[-1]), left[:, -1], right[-1])
        now = float(np.linalg.slogdet(jacobian)[0]) if jacobian.shape[0] == jacobian.shape[1] else 0.0
        if before is None:
            first, sign = here[1], now
        if here[1] < NEAR * first or now * sign < 0.0:
            return here[0], _largest_rows(here[2], names)
        if before is not None and min(before[1], here[1]) < BETWEEN * first and _turned_over(before, here):
            share = before[1] / (before[1] + here[1])
            return before[0] + share * (here[0] - before[0]), _largest_rows(here[2], names)
        before = here
    return None


def _turned_over(
    before: tuple[float, float, np.ndarray, np.ndarray], here: tuple[float, float, np.ndarray, np.ndarray]
) -> bool:
    """Return whether the product u v^T of the smallest singular value has changed its sign, and nothing but that."""
    left, right = float(before[2] @ here[2]), float(before[3] @ here[3])
    return min(abs(left), abs(right)) > ALIKE and left * right < 0.0


def _largest_rows(weights: np.ndarray, names: Sequence[str]) -> str:
    """Return the names of the three rows of the largest weights."""
    return ", ".join(names[row] for row in np.argsort(-np.abs(weights))[:3])
