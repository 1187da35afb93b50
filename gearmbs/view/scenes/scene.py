"""A scene and the ways to show it: a shaded figure, a page to turn and play, a plotly figure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from gearmbs.files import whole_file
from gearmbs.progress import waiting
from gearmbs.view.figures.animation import ENDINGS, write_film
from gearmbs.view.figures.style import DPI, VERMILLION, look, new_figure, png_bytes
from gearmbs.view.geometry.mesh import Mesh, corner_normals
from gearmbs.view.scenes.pages import Page, scene_page
from gearmbs.view.scenes.plotly_scene import plotly_figure
from gearmbs.view.scenes.render import Camera, render
from gearmbs.view.scenes.solids import AZIMUTH, ELEVATION, Deflection, Part, SceneData

BORDER = 1.0
"""Height of heading and legend, inches."""


@dataclass
class Scene(SceneData):
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
        solids = [part.placed(instant) for part in self.parts]
        image = self._picture(solids, camera, columns, rows)
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
                ax.plot([], [], color=part.colour, alpha=part.opacity, linewidth=7, label=part.name)
            count = len(self.parts) + len(self.lines)
            figure.legend(loc="outside lower center", ncols=min(count, 4), handlelength=1.4)
        return figure

    def _picture(self, solids: list[Mesh], camera: Camera, columns: int, rows: int) -> np.ndarray:
        """Return the picture: the parts that hide what is behind them, and over it each that is seen through.

        What stands before a part that is seen through is the same in the pictures with it and without it.
        """

        def drawn(chosen: list[int]) -> np.ndarray:
            return render(
                [solids[k].corners for k in chosen], [corner_normals(solids[k]) for k in chosen],
                [to_rgb(self.parts[k].colour) for k in chosen], camera, columns, rows,
            )  # fmt: skip

        hiding = [k for k, part in enumerate(self.parts) if part.opacity == 1.0]
        image = drawn(hiding)
        for k, part in enumerate(self.parts):
            if part.opacity < 1.0:
                both, opacity = drawn([*hiding, k]), part.opacity
                opaque = opacity * both[..., 3:] + (1.0 - opacity) * image[..., 3:]
                colour = opacity * both[..., 3:] * both[..., :3] + (1.0 - opacity) * image[..., 3:] * image[..., :3]
                image = np.concatenate([colour / np.maximum(opaque, 1e-9), opaque], axis=2)
        return image

    def save(self, path: str | Path, **options: Any) -> Path:
        """Write the scene: ``.html`` to turn and play, ``.png`` of one instant, ``.gif``, ``.mp4`` (by ffmpeg) of all.

        Parameters
        ----------
        path : path
        **options
            Of `still`, for pictures and films: the direction of view.
        """
        ending = Path(path).suffix.lower()
        if ending in ENDINGS:
            return write_film(path, self._pictures(110 if ending == ".mp4" else 70, options), len(self))
        if ending == ".png":
            with waiting(f"saving {Path(path).name}"), whole_file(path) as part:
                self.still(**options).savefig(part, dpi=DPI)
            return Path(path)
        return self.page().save(path)

    def _pictures(self, dpi: float, options: dict[str, Any]) -> Iterator[bytes]:
        """Yield each instant as a PNG image, all of one size."""
        options.setdefault("height", float(self.still(**options).get_figheight()))
        for k in range(len(self)):
            yield png_bytes(self.still(instant=k, **options), dpi=dpi)

    @waiting("preparing the page")
    def page(self) -> Page:
        """Return the scene as a page to turn, zoom and play, which stands alone as an HTML file."""
        return scene_page(self)

    def save_html(self, path: str | Path) -> Path:
        """Write the page; it opens in any browser without a network."""
        return self.page().save(path)

    @waiting("preparing the figure")
    def plotly(self, frames: int = 24) -> Any:
        """Return a plotly figure (needs the extra ``view``), animated over at most so many instants."""
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


__all__ = ["Deflection", "Part", "Scene"]
