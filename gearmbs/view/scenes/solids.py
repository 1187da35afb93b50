"""Solids that move: what a 3-D view shows, whichever way it is shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gearmbs.mechanism import Mechanism, ModalBody
from gearmbs.view.geometry.mesh import Mesh

AZIMUTH, ELEVATION = 38.0, 22.0
UP = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Deflection:
    """How a solid bends: the sum of shapes times coordinates.

    Attributes
    ----------
    shapes : ndarray, shape (n, vertices, 3)
        In the part's own frame, m.
    coordinates : ndarray, shape (instants, n)
    """

    shapes: np.ndarray
    coordinates: np.ndarray

    def at(self, instant: int) -> np.ndarray:
        """Return the displacements of the vertices at an instant, shape (vertices, 3), m."""
        return np.tensordot(self.coordinates[instant], self.shapes, axes=1)

    def reduced(self, accuracy: float = 1e-3) -> Deflection:
        """Return nearly the same by fewer shapes, as far off as a share of the largest displacement at most."""
        sizes = np.maximum(np.linalg.norm(self.shapes, axis=2).max(axis=1), 1e-300)
        left, values, right = np.linalg.svd(self.coordinates * sizes, full_matrices=False)
        if not values.size or values[0] == 0.0:
            return Deflection(self.shapes[:0], self.coordinates[:, :0])
        # what is left out is no larger than the sum of its singular values
        kept = int(np.sum(np.cumsum(values[::-1])[::-1] > accuracy * np.abs(self.coordinates * sizes).max()))
        shapes = np.tensordot(right[:kept] / sizes, self.shapes, axes=1)
        return Deflection(shapes, left[:, :kept] * values[:kept])


@dataclass(frozen=True)
class Part:
    """A solid and where it is.

    Attributes
    ----------
    name : str
    mesh : Mesh
        In the part's own frame.
    colour : str
        As matplotlib understands it.
    origins, axes : ndarray, shape (n, 3) and (n, 3, 3)
        Frame at each instant, global, m.
    deflection : Deflection, optional
        Of a solid that bends.
    opacity : float
        Above 0 to 1; a housing is seen through.
    """

    name: str
    mesh: Mesh
    colour: str
    origins: np.ndarray
    axes: np.ndarray
    deflection: Deflection | None = None
    opacity: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.opacity <= 1.0:
            raise ValueError(f"opacity of part {self.name!r} is {self.opacity}; give above 0 to 1")

    def placed(self, instant: int) -> Mesh:
        """Return the mesh where it is at an instant, global, m."""
        mesh = self.mesh
        if self.deflection is not None:
            mesh = Mesh(mesh.vertices + self.deflection.at(instant), mesh.triangles)
        return mesh.placed(self.origins[instant], self.axes[instant])


@dataclass
class SceneData:
    """Parts, forces and lines over n instants.

    Attributes
    ----------
    parts : list of Part
    title : str
    label, unit : str
        What ``value`` counts.
    value : ndarray, shape (n,)
    forces : list of ndarray, shape (k, 2, 3)
        At each instant, points of attack and force vectors, N; may be empty.
    lines : list of (str, str, ndarray)
        Name, colour and end points (n_lines, 2, 3) of lines that stand still, m, such as axes.
    up : tuple of float
        Direction drawn upwards.
    """

    parts: list[Part]
    title: str = "view"
    label: str = ""
    unit: str = ""
    value: np.ndarray = field(default_factory=lambda: np.zeros(1))
    forces: list[np.ndarray] = field(default_factory=list)
    lines: list[tuple[str, str, np.ndarray]] = field(default_factory=list)
    up: tuple[float, float, float] = UP

    def __post_init__(self) -> None:
        if not self.parts:
            raise ValueError("parts: a scene needs at least one part; the mechanism has no body to draw")
        for part in self.parts:
            if len(part.origins) != self.value.size or len(part.axes) != self.value.size:
                raise ValueError(f"part {part.name!r} has {len(part.origins)} poses for {self.value.size} instants")
            bend = part.deflection
            if bend is not None and (
                len(bend.coordinates) != self.value.size or bend.shapes.shape[1] != len(part.mesh.vertices)
            ):
                raise ValueError(
                    f"part {part.name!r} has deflections of {bend.shapes.shape[1]} vertices at {len(bend.coordinates)} "
                    f"instants; it has {len(part.mesh.vertices)} vertices and {self.value.size} instants"
                )

    def __len__(self) -> int:
        return self.value.size

    def corners(self, instant: int = 0) -> np.ndarray:
        """Return all vertices at an instant, global, shape (n, 3), m."""
        return np.concatenate([part.placed(instant).vertices for part in self.parts])

    @property
    def size(self) -> float:
        """Largest extent at the start, m."""
        points = self.corners(0)
        return float(np.ptp(points, axis=0).max())


# Bodies that deform as parts of a scene: their surfaces, bent by modal coordinates and a factor.


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
