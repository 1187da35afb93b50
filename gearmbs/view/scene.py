"""A scene, solids that move, and the ways to show it: a shaded figure, a page to turn and play, a plotly figure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from gearmbs.files import whole_file
from gearmbs.progress import waiting
from gearmbs.view.figures.style import DPI, ENDINGS, VERMILLION, look, new_figure, png_bytes, unit_text, write_film
from gearmbs.view.mesh import Mesh, corner_normals, feature_edges, feature_ends
from gearmbs.view.pages import Page, packed, rounded
from gearmbs.view.render import Camera, render

if TYPE_CHECKING:
    import plotly.graph_objects

AZIMUTH, ELEVATION = 38.0, 22.0
UP = (0.0, 1.0, 0.0)

STEPS = 65535
"""Steps of the grid that points of pages are on, in each direction: what two bytes hold."""
BORDER = 1.0
"""Height of heading and legend, inches."""
ARROW = 0.22
"""Length of the arrow of the largest force, in sizes of the scene."""


LIGHT = {"ambient": 0.55, "diffuse": 0.75, "specular": 0.15, "roughness": 0.6}


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


class StillKeywords(TypedDict, total=False):
    """Keywords of `Scene.still`, for type checkers."""

    instant: int
    azimuth: float
    elevation: float
    width: float
    height: float | None
    dpi: float
    title: str | None


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

    @property
    def force_scale(self) -> float:
        """Length of the arrow of a force, m/N."""
        sizes = (float(np.linalg.norm(f[:, 1], axis=1).max(initial=0.0)) for f in self.forces)
        return ARROW * self.size / (max(sizes, default=0.0) or 1.0)

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

    def save(self, path: str | Path, **options: Unpack[StillKeywords]) -> Path:
        """Write the scene: ``.html`` to turn and play, ``.png`` of one instant, ``.gif``, ``.mp4`` (by ffmpeg) of all.

        Parameters
        ----------
        path : path
        **options
            Of `still`, for pictures and films: the direction of view.
        """
        ending = Path(path).suffix.lower()
        if ending in ENDINGS:
            return write_film(path, self._pictures(110 if ending == ".mp4" else 70, {**options}), len(self))
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
        points = np.concatenate([self.corners(0), *(ends.reshape(-1, 3) for _, _, ends in self.lines)])
        low, high = points.min(axis=0), points.max(axis=0)
        scale = np.array([1.0, self.force_scale])[:, None]
        data = {
            "parts": [_part(part) for part in self.parts],
            "lines": [{"colour": to_rgb(colour), "ends": rounded(ends)} for _, colour, ends in self.lines],
            "forces": [[rounded(row * scale) for row in rows] for rows in self.forces],
            "values": rounded(self.value, 9),
            "label": self.label,
            "unit": unit_text(self.unit),
            "up": list(self.up),
            "centre": rounded(0.5 * (low + high)),
            "hull": [rounded(p) for p in _hull(points - 0.5 * (low + high))],
            "span": float(np.linalg.norm(high - low)),
            "azimuth": AZIMUTH,
            "elevation": ELEVATION,
        }
        note = f"{len(self)} instants" if len(self) > 1 else ""
        return Page(self.title, note, ("player.js", "viewer3d.js"), data)

    def save_html(self, path: str | Path) -> Path:
        """Write the page; it opens in any browser without a network."""
        return self.page().save(path)

    @waiting("preparing the figure")
    def plotly(self, frames: int = 24) -> plotly.graph_objects.Figure:
        """Return a plotly figure (needs the extra ``view``), animated over at most so many instants."""
        return plotly_figure(self, frames)

    def _repr_html_(self) -> str:
        return self.page()._repr_html_()

    def _arrows(self, ax, camera: Camera, instant: int, columns: int, rows: int) -> None:
        if not self.forces or len(self.forces[instant]) == 0:
            return
        scale = self.force_scale
        for start, force in self.forces[instant]:
            ends = camera.project(np.stack([start, start + scale * force]), columns, rows)
            style = {"arrowstyle": "-|>", "color": VERMILLION, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
            ax.annotate("", ends[1, :2], ends[0, :2], arrowprops=style, zorder=5)


# What the page shows, for its script over WebGL.


def _hull(points: np.ndarray) -> np.ndarray:
    """Return points on the outside, enough to see how far a scene reaches from any direction."""
    k = np.arange(60)
    z = 1.0 - 2.0 * (k + 0.5) / k.size
    turn = np.pi * (3.0 - np.sqrt(5.0)) * k
    ways = np.column_stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z])
    return points[np.unique(np.argmax(points @ ways.T, axis=0))]


def _part(part: Part) -> dict:
    """Return a part with one vertex for each point and normal.

    Points are on a grid of 65535 steps a direction, so that one of a wheel of 200 mm is within 2 um of its place, and
    what counts points has as few bytes as they need.
    """
    normals = np.rint(corner_normals(part.mesh).reshape(-1, 3) * 127.0).astype(np.int8)
    owners = part.mesh.triangles.reshape(-1, 1)
    rows, index = np.unique(np.hstack([owners, normals.astype(np.int64)]), axis=0, return_inverse=True)
    counting = "<u2" if len(rows) <= STEPS else "<u4"
    low = part.mesh.vertices.min(axis=0)
    step = np.maximum(np.ptp(part.mesh.vertices, axis=0) / STEPS, np.finfo(float).tiny)
    poses = np.concatenate([part.axes.reshape(-1, 9), part.origins], axis=1)
    where = np.empty(len(part.mesh.vertices), dtype=np.int64)
    where[rows[:, 0]] = np.arange(len(rows))
    bending = {}
    if part.deflection is not None and len(part.deflection.shapes):
        bend = part.deflection.reduced()
        bending = {"shapes": packed(bend.shapes[:, rows[:, 0]]), "coordinates": packed(bend.coordinates)}
    return {
        "name": part.name,
        "colour": [round(c, 4) for c in to_rgb(part.colour)],
        "opacity": part.opacity,
        "points": packed(np.rint((part.mesh.vertices[rows[:, 0]] - low) / step), "<u2"),
        "low": rounded(low, 12),
        "step": rounded(step, 12),
        "normals": packed(rows[:, 1:], "i1"),
        "bytes": int(counting[-1]),
        "index": packed(index.reshape(-1), counting),
        "ends": packed(where[feature_ends(part.mesh)], counting),
        "poses": packed(poses),
        **bending,
    }


# A scene as a plotly figure, for notebooks that use plotly (extra ``view``).


def plotly_figure(scene: Scene, frames: int = 24) -> plotly.graph_objects.Figure:
    """Return a plotly figure of a scene, animated over at most ``frames`` of its instants.

    Raises
    ------
    ImportError
        If plotly is not installed; the message says how to get it.
    """
    try:
        import plotly.graph_objects as go
    except ImportError as error:
        raise ImportError("plotly is not installed; pip install 'gearmbs[view]', or use Scene.page()") from error
    if frames < 1:
        raise ValueError(f"frames is {frames}; give 1 or more")
    chosen = np.unique(np.linspace(0, len(scene) - 1, min(frames, len(scene))).round().astype(int))
    fixed = [_line(go, name, colour, ends) for name, colour, ends in scene.lines]
    figure = go.Figure(data=[*_moving(go, scene, int(chosen[0])), *fixed])
    every = np.concatenate([scene.corners(int(k)) for k in chosen] + [e.reshape(-1, 3) for _, _, e in scene.lines])
    spans = np.ptp(every, axis=0)
    axes = {
        f"{a}axis": {"visible": False, "range": [float(every[:, i].min()), float(every[:, i].max())]}
        for i, a in enumerate("xyz")
    }
    x, y, z = scene.up
    figure.update_layout(
        title=scene.title,
        height=620,
        scene={
            **axes,
            "aspectmode": "manual",
            "aspectratio": {a: float(s / spans.max()) + 1e-3 for a, s in zip("xyz", spans)},
            "camera": {"up": {"x": x, "y": y, "z": z}, "eye": {"x": 0.7, "y": 0.4, "z": 0.9}},
        },
        margin={"l": 10, "r": 30, "t": 80, "b": 40},
        legend={"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom"},
    )
    if chosen.size > 1:
        moving = list(range(len(figure.data) - len(fixed)))
        figure.frames = [
            go.Frame(data=_moving(go, scene, int(k)), traces=moving, name=f"{scene.value[k]:.5g}") for k in chosen
        ]
        _controls(figure, scene)
    return figure


def _moving(go: Any, scene: Scene, instant: int) -> list:
    traces = []
    for part in scene.parts:
        mesh = part.placed(instant)
        x, y, z = mesh.vertices.T
        i, j, k = mesh.triangles.T
        shape = {"x": x, "y": y, "z": z, "i": i, "j": j, "k": k, "flatshading": True, "lighting": LIGHT}
        shape["opacity"] = part.opacity
        traces.append(go.Mesh3d(**shape, color=part.colour, name=part.name, showlegend=True, hoverinfo="name"))
        traces.append(_line(go, part.name, "#222222", feature_edges(mesh), legend=False))
    if scene.forces:
        rows = scene.forces[instant]
        ends = np.stack([rows[:, 0], rows[:, 0] + scene.force_scale * rows[:, 1]], axis=1)
        traces.append(_line(go, "force on driven", VERMILLION, ends, width=6))
    return traces


def _line(go: Any, name: str, colour: str, ends: np.ndarray, width: float = 2.0, legend: bool = True) -> Any:
    """Return separate strokes as one trace; rows of NaN part them."""
    broken = np.concatenate([ends, np.full((len(ends), 1, 3), np.nan)], axis=1).reshape(-1, 3)
    x, y, z = broken.T
    style = {"color": colour, "width": width}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", line=style, name=name, showlegend=legend, hoverinfo="name")


def _controls(figure: Any, scene: Scene) -> None:
    timing = {"frame": {"duration": 60, "redraw": True}, "transition": {"duration": 0}, "fromcurrent": True}
    pause = {"frame": {"duration": 0, "redraw": False}, "mode": "immediate", "transition": {"duration": 0}}
    steps = [
        {"label": f.name, "method": "animate", "args": [[f.name], {**pause, "frame": {"duration": 0, "redraw": True}}]}
        for f in figure.frames
    ]
    shown = {"prefix": f"{scene.label} ", "suffix": f" {scene.unit}"}
    figure.update_layout(
        updatemenus=[
            {
                "type": "buttons",
                "direction": "left",
                "x": 0.0,
                "y": 0.0,
                "buttons": [
                    {"label": "Play", "method": "animate", "args": [None, timing]},
                    {"label": "Pause", "method": "animate", "args": [[None], pause]},
                ],
            }
        ],
        sliders=[{"steps": steps, "currentvalue": shown, "x": 0.15, "len": 0.85}],
    )
