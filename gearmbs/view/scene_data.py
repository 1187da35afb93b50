"""Solids that move: what a 3-D view shows, whichever way it is shown."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearmbs.view.mesh import Mesh

AZIMUTH, ELEVATION = 38.0, 22.0
UP = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Part:
    """A rigid solid and where it is.

    Attributes
    ----------
    name : str
    mesh : Mesh
        In the part's own frame.
    colour : str
        As matplotlib understands it.
    origins, axes : ndarray, shape (n, 3) and (n, 3, 3)
        Frame at each instant, global, m.
    """

    name: str
    mesh: Mesh
    colour: str
    origins: np.ndarray
    axes: np.ndarray


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

    def __len__(self) -> int:
        return self.value.size

    def corners(self, instant: int = 0) -> np.ndarray:
        """Return all vertices at an instant, global, shape (n, 3), m."""
        return np.concatenate([p.mesh.placed(p.origins[instant], p.axes[instant]).vertices for p in self.parts])

    @property
    def size(self) -> float:
        """Largest extent at the start, m."""
        points = self.corners(0)
        return float(np.ptp(points, axis=0).max())
