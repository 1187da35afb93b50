"""The simplest solid that has a rigid body's mass and moments of inertia."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.view.mesh import Mesh, ball, box, cylinder, joined, rod

if TYPE_CHECKING:
    from gearmbs.mechanism.parts import Body

SAME = 1e-6
"""Relative difference of two moments of a body that is taken for round."""
THIN = 0.12
"""Root of the least size drawn of a body, as a share of its largest."""


def body_mesh(body: Body, reach: float = 0.0) -> Mesh | None:
    """Return the cylinder (or ball, or box) that has a body's mass and moments, in the body's frame.

    A body with two equal principal moments becomes a cylinder along the third, any other a box; None without mass or
    moments. Rods of a part ``reach`` of the size of the mechanism lead to its markers.
    """
    pieces: list[Mesh] = []
    moments, axes = np.linalg.eigh(body.inertia)
    if body.mass > 0.0 and moments[-1] > 0.0:
        pieces.append(_equivalent(body.mass, moments, axes).placed(body.com, np.eye(3)))
    hub = body.com if body.mass > 0.0 or not body.markers else body.markers[0].position
    if reach > 0.0:
        for marker in body.markers:
            if np.linalg.norm(marker.position - hub) > 4.0 * reach:
                pieces.append(rod(hub, marker.position, reach))
        if not pieces:
            pieces.append(ball(2.0 * reach).placed(hub, np.eye(3)))
    return joined(pieces) if pieces else None


def _equivalent(mass: float, moments: np.ndarray, axes: np.ndarray) -> Mesh:
    for k in range(3):
        one, two = moments[(k + 1) % 3], moments[(k + 2) % 3]
        if abs(one - two) > SAME * moments[-1]:
            continue
        # a solid cylinder: I_z = m r^2 / 2, I_x = m (3 r^2 + l^2) / 12
        square = 2.0 * moments[k] / mass
        length = 12.0 * 0.5 * (one + two) / mass - 3.0 * square
        if length <= 0.0:
            continue
        length = math.sqrt(length)
        radius = max(math.sqrt(square), 0.5 * THIN * THIN * length)
        frame = np.column_stack([axes[:, (k + 1) % 3], axes[:, (k + 2) % 3], axes[:, k]])
        frame[:, 0] *= np.linalg.det(frame)
        return cylinder(radius, length, 72).placed(np.zeros(3), frame)
    total = moments.sum()
    edges = np.sqrt(np.maximum(6.0 * (total - 2.0 * moments) / mass, 0.0))
    edges = np.maximum(edges, THIN * THIN * edges.max())
    frame = axes * np.array([1.0, 1.0, np.linalg.det(axes)])
    return box(*edges).placed(np.zeros(3), frame)
