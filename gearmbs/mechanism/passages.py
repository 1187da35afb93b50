"""Positions passed in a run in which constraints depend on each other: a remark, since what follows is doubtful."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.results.solution import Solution

MOST_ROWS = 150
"""Constraint rows up to which it is looked for: the work grows with their third power."""
SAMPLES = 200
"""Outputs that are looked at, at most."""
NEAR = 0.01
"""Smallest singular value of the constraints, of its initial one, below which a position counts as singular."""


def singular_passage(solution: Solution) -> tuple[float, str] | None:
    """Return when a run passed a position in which constraints depend on each other, s, and which; None without one.

    There the Jacobian of the constraints, in spatial displacements, loses rank: its smallest singular value falls; and
    where all motion is prescribed, its determinant changes sign, which shows between outputs, too.
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
    for k in np.unique(np.linspace(0, solution.t.size - 1, SAMPLES).astype(int)):
        jacobian = system.constraint_jacobian(poses[k], float(solution.t[k]))[0].toarray() * scale
        left, values, _ = np.linalg.svd(jacobian)
        now = float(np.linalg.slogdet(jacobian)[0]) if jacobian.shape[0] == jacobian.shape[1] else 0.0
        if first == 0.0:
            first, sign = float(values[-1]), now
        if values[-1] < NEAR * first or now * sign < 0.0:
            rows = np.argsort(-np.abs(left[:, -1]))[:3]
            return float(solution.t[k]), ", ".join(names[r] for r in rows)
    return None
