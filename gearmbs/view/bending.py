"""Bodies that deform as parts of a scene: their surfaces, bent by modal coordinates and a factor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gearmbs.mechanism import Mechanism, ModalBody
from gearmbs.view.mesh import Mesh
from gearmbs.view.scene_data import Deflection

SHOWN = 0.1
"""Largest deflection drawn by default, as a part of the body's size."""


@dataclass(frozen=True)
class Bending:
    """Meshes and deflections of bodies by name, and what the title of a scene says of them."""

    parts: dict[str, tuple[Mesh, Deflection]] = field(default_factory=dict)
    remark: str = ""


def bodies_bent(mechanism: Mechanism, coordinates: Mapping[str, np.ndarray], factor: float | None) -> Bending:
    """Return what is drawn of the modal bodies of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    coordinates : mapping of body name to ndarray, shape (instants, n)
        Modal coordinates.
    factor : float, optional
        Deflections are drawn that many times as large; default such that the largest is a tenth of its body's size. All
        bodies have the same, so that what touches keeps touching as far as it can.

    Raises
    ------
    ValueError
        If the factor is not a finite number from 0 on.
    """
    if factor is not None and not (np.isfinite(factor) and factor >= 0.0):
        raise ValueError(f"factor is {factor}; give a finite number, 1 for deflections as they are, or None")
    found: dict[str, tuple[Mesh, Deflection]] = {}
    largest = 0.0
    for name, q in coordinates.items():
        body = mechanism.bodies[name]
        assert isinstance(body, ModalBody)
        surface = body.surface() if body.surface is not None else None
        if surface is None:
            continue
        bend = Deflection(surface.moved - body.mean[:, None], np.asarray(q, dtype=float))
        found[name] = (Mesh(surface.vertices, surface.triangles), bend)
        size = float(np.ptp(surface.vertices, axis=0).max())
        least = bend.reduced()
        far = max((float(np.linalg.norm(least.at(k), axis=1).max()) for k in range(len(q))), default=0.0)
        largest = max(largest, far / size)
    if not found or largest == 0.0:
        return Bending(found)
    times = SHOWN / largest if factor is None else factor
    scaled = {n: (mesh, Deflection(b.shapes, times * b.coordinates)) for n, (mesh, b) in found.items()}
    return Bending(scaled, "" if times == 1.0 else f", deflections {times:.3g} times")
