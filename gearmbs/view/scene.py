"""Solids that move: what a 3-D view shows, whichever way it is shown."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from gearmbs.view.figure_style import VERMILLION, look, new_figure
from gearmbs.view.mesh import Mesh
from gearmbs.view.render import Camera, render
from gearmbs.view.shading import corner_normals

if TYPE_CHECKING:
    from gearmbs.view.page import Page

AZIMUTH, ELEVATION = 38.0, 22.0
UP = (0.0, 1.0, 0.0)
BORDER = 1.0
"""Height of heading and legend, inches."""


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
class Scene:
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

    def still(
        self,
        *,
        instant: int = 0,
        azimuth: float = AZIMUTH,
        elevation: float = ELEVATION,
        width: float = 8.0,
        height: float | None = None,
        dpi: float = 160.0,
        title: str | None = None,
    ) -> Figure:
        """Draw one instant as a figure, shaded, by software alone.

        Parameters
        ----------
        instant : int
        azimuth, elevation : float
            Where the viewer is, degrees: about the direction that points up, and above the plane across it.
        width, height : float
            Inches; default height such that the scene fills the picture.
        dpi : float
            Resolution of the picture inside the figure.
        title : str, optional
            Default the scene's.
        """
        if not -len(self) <= instant < len(self):
            raise ValueError(f"instant is {instant}; the scene has {len(self)} of them")
        camera = Camera(azimuth, elevation, self.up)
        points = np.concatenate([self.corners(instant), *(ends.reshape(-1, 3) for _, _, ends in self.lines)])
        if height is None:
            height = BORDER + min(max(width * camera.aspect(points), 0.3 * width), 1.2 * width)
        columns, rows = round(width * dpi), round((height - BORDER) * dpi)
        camera.frame(points, columns, rows)
        solids = [p.mesh.placed(p.origins[instant], p.axes[instant]) for p in self.parts]
        image = render(
            [m.corners for m in solids],
            [corner_normals(m) for m in solids],
            [to_rgb(p.colour) for p in self.parts],
            camera,
            columns,
            rows,
        )
        with look():
            figure = new_figure(width, height)
            ax = figure.subplots()
            ax.axis("off")
            for name, colour, ends in self.lines:
                seen = camera.project(ends, columns, rows)
                for k, (start, stop) in enumerate(seen):
                    line = ax.plot([start[0], stop[0]], [start[1], stop[1]], color=colour, linewidth=1.1, zorder=1)
                    line[0].set_linestyle((0, (8, 3, 2, 3)))
                    line[0].set_label("_" if k else name)
            ax.imshow(image, interpolation="antialiased", zorder=2)
            self._arrows(ax, camera, instant, columns, rows)
            ax.set_xlim(0, columns)
            ax.set_ylim(rows, 0)
            heading = self.title if title is None else title
            if len(self) > 1 and title is None:
                heading += f", {self.label} {self.value[instant]:.5g} {self.unit}"
            figure.suptitle(heading, x=0.01, ha="left", fontsize=11)
            for part in self.parts:
                ax.plot([], [], color=part.colour, linewidth=7, label=part.name)
            count = len(self.parts) + len(self.lines)
            figure.legend(loc="outside lower center", ncols=min(count, 4), handlelength=1.4)
        return figure

    def page(self) -> Page:
        """Return the scene as a page to turn, zoom and play, which stands alone as an HTML file."""
        from gearmbs.view.viewer import scene_page

        return scene_page(self)

    def save_html(self, path: str | Path) -> Path:
        """Write the page; it opens in any browser without a network."""
        return self.page().save(path)

    def plotly(self, frames: int = 24) -> Any:
        """Return a plotly figure (needs the extra ``view``), animated over at most so many instants."""
        from gearmbs.view.plotly_scene import plotly_figure

        return plotly_figure(self, frames)

    def _repr_html_(self) -> str:
        return self.page()._repr_html_()

    def _arrows(self, ax, camera: Camera, instant: int, columns: int, rows: int) -> None:
        if not self.forces or len(self.forces[instant]) == 0:
            return
        largest = max(float(np.linalg.norm(f[:, 1], axis=1).max(initial=0.0)) for f in self.forces) or 1.0
        scale = 0.22 * self.size / largest
        for start, force in self.forces[instant]:
            ends = camera.project(np.stack([start, start + scale * force]), columns, rows)
            style = {"arrowstyle": "-|>", "color": VERMILLION, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
            ax.annotate("", ends[1, :2], ends[0, :2], arrowprops=style, zorder=5)
