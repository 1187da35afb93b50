"""Bodies that deform: deflected shapes, films of modes and of solutions, strain energy by mode, Campbell diagrams."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.dae.results.solution import Solution
from gearmbs.flexible import Campbell, ModalModel, StressModes
from gearmbs.signals import campbell
from gearmbs.signals.signal.arguments import in_si
from gearmbs.view.figures.records import thinned
from gearmbs.view.figures.style import (
    BLUE,
    COLOURS,
    GREY,
    RATE,
    VERMILLION,
    drawing,
    drawn_on,
    label,
    look,
    new_figure,
    png_bytes,
    write_film,
)
from gearmbs.view.figures.variable_speed import (
    RANGE_DB,
    RPM,
    by_speed,
    draw_map,
    mark_operating,
    one_channel,
    tag,
    upto,
)

SHOWN = 0.1
"""Share of a body's size that the largest deflection of a picture has where no factor is given."""
DASHES = {"forward": "-", "backward": (0, (6, 2)), "planar": (0, (1, 1))}
PICTURES = 24
"""Pictures of one cycle of a mode."""


def fitting_factor(model: ModalModel, coordinates: npt.ArrayLike) -> float:
    """Return the factor that makes the largest deflection a tenth of the body's size; one where nothing moves.

    ``coordinates`` has shape (n,), or (m, n) for several times.
    """
    rows = np.atleast_2d(np.asarray(coordinates, dtype=float))
    largest = max(np.linalg.norm(model.displaced(q) - model.positions, axis=1).max() for q in rows)
    return SHOWN * model.size / largest if largest > 0.0 else 1.0


def deformed_plot(
    model: ModalModel,
    coordinates: npt.ArrayLike,
    *,
    factor: float | None = None,
    title: str | None = None,
    limits: np.ndarray | None = None,
) -> Figure:
    """Draw a body deflected by modal coordinates, and undeformed in grey.

    Parameters
    ----------
    model : ModalModel
    coordinates : array_like, shape (n,)
        Modal coordinates.
    factor : float, optional
        By which deflections are drawn larger; see `fitting_factor`.
    title : str, optional
    limits : ndarray, shape (2, 3), optional
        Least and largest coordinates shown, m.
    """
    q = np.asarray(coordinates, dtype=float)
    factor = fitting_factor(model, q) if factor is None else factor
    with look():
        figure = new_figure(6.4, 4.8)
        axes = figure.add_subplot(projection="3d")
        _draw(axes, model, model.positions, None)
        place = model.displaced(q, factor)
        _draw(axes, model, place, np.linalg.norm(model.displaced(q) - model.positions, axis=1))
        low, high = (place.min(axis=0), place.max(axis=0)) if limits is None else limits
        middle, half = (low + high) / 2, max(float(np.max(high - low)) / 2, 1e-12)
        for k, name in enumerate("xyz"):
            getattr(axes, f"set_{name}lim")(middle[k] - half, middle[k] + half)
            getattr(axes, f"set_{name}label")(label(name, "m"))
        axes.set_title(f"{model.name}, deflections {factor:.3g} times" if title is None else title)
    return figure


def _draw(axes, model: ModalModel, place: np.ndarray, moved: np.ndarray | None) -> None:
    """Draw the nodes of a body: a line, faces, or points; coloured by ``moved``, m, or in grey."""
    from matplotlib import colormaps
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    share = None if moved is None or moved.max() == 0.0 else moved / moved.max()
    if model.line:
        axes.plot(*place.T, color="0.75" if moved is None else COLOURS[0], linewidth=1.0 if moved is None else 2.5)
    elif model.faces is not None:
        tint = "0.9" if share is None else colormaps["viridis"](share[model.faces].mean(axis=1))
        alpha = 0.15 if moved is None else 1.0
        axes.add_collection3d(
            Poly3DCollection(place[model.faces], facecolors=tint, edgecolors="0.4", linewidths=0.2, alpha=alpha)
        )
    else:
        axes.scatter(*place.T, s=4, c="0.8" if share is None else share)


@dataclass(frozen=True, eq=False)
class BodyAnimation:
    """Pictures of a body that deforms, to be saved.

    Attributes
    ----------
    model : ModalModel
    coordinates : ndarray, shape (pictures, n)
        Modal coordinates.
    titles : sequence of str
        One a picture.
    factor : float
        By which deflections are drawn larger.
    """

    model: ModalModel
    coordinates: np.ndarray
    titles: Sequence[str]
    factor: float

    def pictures(self) -> Iterator[bytes]:
        """Yield the pictures as PNG."""
        places = [self.model.displaced(q, self.factor) for q in self.coordinates]
        limits = np.array([np.min(places, axis=(0, 1)), np.max(places, axis=(0, 1))])
        for q, title in zip(self.coordinates, self.titles):
            figure = deformed_plot(self.model, q, factor=self.factor, title=title, limits=limits)
            yield png_bytes(figure, dpi=90)

    def save(self, path: str | Path, rate: int = RATE) -> Path:
        """Write a film (``.mp4``, needs ffmpeg) or a moving picture (``.gif``) of ``rate`` pictures a second.

        Raises
        ------
        ValueError
            For another ending.
        """
        return write_film(path, self.pictures(), len(self.coordinates), rate)


def mode_animation(model: ModalModel, mode: int, *, factor: float | None = None) -> BodyAnimation:
    """Return one cycle of a mode, counted from 1, deflected by ``factor`` times its shape; see `fitting_factor`.

    Raises
    ------
    ValueError
        For a mode that there is not.
    """
    if not 1 <= mode <= model.modes:
        raise ValueError(f"mode is {mode}; '{model.name}' has modes 1 to {model.modes}")
    phase = 2 * np.pi * np.arange(PICTURES) / PICTURES
    unit = np.eye(model.modes)[mode - 1]
    title = f"{model.name}, mode {mode}: {model.frequencies[mode - 1]:.4g} Hz"
    scale = fitting_factor(model, unit) if factor is None else factor
    return BodyAnimation(model, np.cos(phase)[:, None] * unit, [title] * PICTURES, scale)


def deformation_animation(
    model: ModalModel, solution: Solution, body: str, *, factor: float | None = None, every: int = 1
) -> BodyAnimation:
    """Return how a body of a solution deforms in its own axes, a picture for each time or each ``every``-th."""
    q = solution.modal_coordinates(body)[::every]
    titles = [f"{body}, t = {t:.5g} s" for t in solution.t[::every]]
    return BodyAnimation(model, q, titles, fitting_factor(model, q) if factor is None else factor)


def modal_energy_plot(
    model: ModalModel, solution: Solution, body: str, *, shown: int = 6, ax: Axes | None = None
) -> Figure:
    """Draw the strain energy of a body by mode over time: of the ``shown`` modes with most of it, and of the rest."""
    energy = model.strain_energies(solution.modal_coordinates(body))
    order = np.argsort(energy.mean(axis=0))[::-1]
    with drawing(ax, legend=3) as (figure, panel):
        for rank, k in enumerate(order[:shown]):
            text = f"mode {k + 1}, {model.frequencies[k]:.4g} Hz"
            panel.plot(solution.t, energy[:, k], color=COLOURS[rank % len(COLOURS)], label=text)
        if order.size > shown:
            panel.plot(solution.t, energy[:, order[shown:]].sum(axis=1), color="0.6", label="all others")
        panel.set_xlabel(label("time", "s"))
        panel.set_ylabel(label("strain energy", "J"))
    return figure


def whirl_plot(
    diagram: Campbell, *, orders: Sequence[float] = (1.0,), operating: Any = None, ax: Axes | None = None
) -> Figure:
    """Draw the natural frequencies of a rotor over its speed, and lines of orders.

    Parameters
    ----------
    diagram : Campbell
        Of `Rotor.campbell`.
    orders : sequence of float
        Times the speed.
    operating : float, str or sequence, optional
        Operating speeds to mark, rad/s or text.
    ax : matplotlib axes, optional
    """
    speed, frequency = diagram.speeds * 30 / np.pi, diagram.frequencies / (2 * np.pi)
    # a pair that is equal at rest begins the curves into which it splits
    ways = np.where(diagram.directions == "planar", np.roll(diagram.directions, -1, axis=0), diagram.directions)
    ways[-1] = diagram.directions[-1]
    with drawing(ax, legend=3) as (figure, panel):
        for kind, dash in DASHES.items():
            kept = np.where(ways == kind, frequency, np.nan)
            if np.all(np.isnan(kept)):
                continue
            for k in range(frequency.shape[1]):
                panel.plot(
                    speed, kept[:, k], linestyle=dash, marker=".", markersize=3, color=COLOURS[k % len(COLOURS)],
                    label=kind if k == 0 else None,
                )  # fmt: skip
        top = 1.05 * float(np.nanmax(frequency))
        for order in orders:
            panel.plot(speed, order * speed / 60, color="0.6", linewidth=0.8)
        mark_operating(panel, operating)
        panel.set_ylim(0.0, top)
        panel.set_xlabel(label("speed", "rpm"))
        panel.set_ylabel(label("natural frequency", "Hz"))
    return figure


# Equivalent stresses of bodies that deform: over the surface of a solid, along a shaft.


PASCAL = 1e-6
"""Stresses are drawn in MPa."""


def stress_plot(
    model: ModalModel,
    coordinates: npt.ArrayLike,
    *,
    stresses: StressModes | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the equivalent stress by von Mises of a deformed body.

    Along a shaft the largest at each section, of other bodies that of their surface.

    Parameters
    ----------
    model : ModalModel
    coordinates : array_like, shape (n,)
        Modal coordinates, as a row of :meth:`Solution.modal_coordinates`.
    stresses : StressModes, optional
        Default: those of the model's own elements.
    ax : matplotlib axes, optional
        To draw a shaft in.

    Raises
    ------
    FlexibleError
        If the stresses are not known.
    ValueError
        If the body is no shaft and has no surface.
    """
    found = model.stress_modes() if stresses is None else stresses
    equivalent = found.von_mises(np.asarray(coordinates, dtype=float)) * PASCAL
    with look():
        if model.line:
            return _along(model, found, equivalent, ax)
        return _over_surface(model, found, equivalent)


def _along(model: ModalModel, found: StressModes, equivalent: np.ndarray, ax: Axes | None) -> Figure:
    figure, panel = drawn_on(ax)
    # both sides of a station are there: neighbouring rows of the same section belong together
    z = found.positions[:, 2]
    starts = np.flatnonzero(np.r_[True, np.diff(z) != 0.0])
    radius = np.hypot(*found.positions[:, :2].T)
    starts = np.union1d(starts, 1 + np.flatnonzero(np.abs(np.diff(radius)) > 1e-9 * radius.max()))
    panel.plot(z[starts], np.maximum.reduceat(equivalent, starts), color=BLUE)
    panel.set_xlabel(label("z", "m"))
    panel.set_ylabel(label("equivalent stress", "MPa"))
    panel.set_ylim(bottom=0.0)
    panel.set_title(f"{model.name}: largest {equivalent.max():.4g} MPa")
    return figure


def _over_surface(model: ModalModel, found: StressModes, equivalent: np.ndarray) -> Figure:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    from scipy.spatial import KDTree

    surface = model.surface()
    if surface is None:
        raise ValueError(f"{model.name}: nothing is known of its surface; give the model its facets (faces)")
    here = equivalent[KDTree(found.positions).query(surface.vertices)[1]]
    norm = Normalize(0.0, float(equivalent.max()) or 1.0)
    figure = new_figure(6.8, 4.8)
    axes = figure.add_subplot(projection="3d")
    tint = colormaps["viridis"](norm(here[surface.triangles].mean(axis=1)))
    axes.add_collection3d(Poly3DCollection(surface.vertices[surface.triangles], facecolors=tint))
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    middle, half = (low + high) / 2, float(np.max(high - low)) / 2
    for k, name in enumerate("xyz"):
        getattr(axes, f"set_{name}lim")(middle[k] - half, middle[k] + half)
        getattr(axes, f"set_{name}label")(label(name, "m"))
    figure.colorbar(ScalarMappable(norm, "viridis"), ax=axes, label=label("equivalent stress", "MPa"), shrink=0.7)
    axes.set_title(f"{model.name}: largest {equivalent.max():.4g} MPa")
    return figure


# The Campbell diagram as a figure.


def campbell_plot(
    diagram: Any,
    *,
    speeds: Sequence[Any] | None = None,
    orders: Sequence[float] | Mapping[str, float] = (1.0,),
    measured: xr.DataArray | None = None,
    channel: str | None = None,
    maximum: float | str | None = None,
    operating: Any = None,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw natural frequencies against speed, the excitation orders, and the critical speeds where they meet.

    Parameters
    ----------
    diagram : Dataset, or modes
        From `gearmbs.signals.campbell`; or modes, with `speeds` and `orders` as there.
    measured : xarray.DataArray, optional
        A waterfall to lay beneath, measured or simulated: what is excited shows as bright spots on the lines.
    channel : str, optional
        Its channel; default the first.
    maximum : float or str, optional
        Highest frequency shown, Hz or text; default a tenth above the highest mode.
    operating : float, str or sequence, optional
        Operating speeds to mark, rad/s or text; default the diagram's attribute ``operating_speed``, rad/s, if it has
        one.
    title : str, optional
    ax : matplotlib axes, optional

    Raises
    ------
    ValueError
        If modes are given without speeds.
    """
    if not (isinstance(diagram, xr.Dataset) and "excitation" in diagram):
        if speeds is None:
            raise ValueError("speeds: give the speeds of the diagram, or what campbell(modes, speeds, orders) returns")
        diagram = campbell(diagram, speeds, orders)
    rpm = diagram["speed"].values * RPM
    operating = diagram.attrs.get("operating_speed") if operating is None else operating
    highest = in_si(maximum, "frequency", "maximum")
    top = 1.1 * float(np.nanmax(diagram["frequency"].values)) if highest is None else float(highest)
    with drawing(ax, 7.2, 4.6, title=title, legend=3) as (figure, panel):
        if measured is not None:
            table = one_channel(upto(measured, "frequency", top), channel)
            draw_map(figure, panel, by_speed(table), "speed", "frequency", RANGE_DB)
        for j in range(diagram.sizes["mode"]):
            values = diagram["frequency"].values[:, j]
            panel.plot(rpm, values, color=COLOURS[0], linewidth=1.4, label="natural frequencies" if j == 0 else None)
        for k, name in enumerate(diagram["order_name"].values):
            x, y = rpm, diagram["excitation"].values[:, k]
            panel.plot(x, y, color=GREY, linewidth=0.9, linestyle=(0, (5, 3)), label="orders" if k == 0 else None)
            inside = np.flatnonzero(y <= top)
            if inside.size:
                end = min(rpm[-1], float(np.interp(top, y, x))) if y[-1] > y[0] else rpm[-1]
                tag(panel, end, float(np.interp(end, x, y)), str(name), "#555555")
        shown = diagram["critical_frequency"].values <= top
        panel.plot(
            diagram["critical_speed"].values[shown] * RPM,
            diagram["critical_frequency"].values[shown],
            "o",
            color=VERMILLION,
            markersize=4.5,
            markeredgecolor="white",
            zorder=5,
            label="critical speeds",
        )
        mark_operating(panel, operating)
        panel.set_xlim(float(rpm[0]), float(rpm[-1]))
        panel.set_ylim(0.0, top)
        panel.set_xlabel("speed, rpm")
        panel.set_ylabel("frequency, Hz")
    return figure


# The solution of a mechanism at a glance: how far bodies move, how fast they turn, what joints and forces carry.


MOST = 7
"""Lines of a panel at most: those with the largest values."""

NOTHING = 1e-9
"""Values below this part of their unit are not drawn."""


def solution_plot(solution: Solution, *, title: str | None = None) -> Figure:
    """Draw what a solution holds over time; panels in which nothing happens are left out.

    Displacement of each centre of mass from its start, angular speed of each body, force of each joint and of each
    force element; of many the seven largest.

    Parameters
    ----------
    solution : Solution
    title : str, optional
    """
    panels = [panel for panel in _panels(solution) if panel[1]]
    with look():
        figure = new_figure(7.6, 0.9 + 1.9 * max(len(panels), 1))
        axes = figure.subplots(max(len(panels), 1), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (label, lines) in zip(axes, panels, strict=False):
            for (name, values), colour in zip(lines, COLOURS, strict=False):
                ax.plot(*thinned(solution.t, values), color=colour, linewidth=1.1, label=name)
            ax.set_ylabel(label)
            ax.margins(x=0)
            ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        if not panels:
            axes[0].annotate("nothing moves", (0.5, 0.5), xycoords="axes fraction", ha="center")
        axes[-1].set_xlabel("time, s")
        mechanism = getattr(solution.system, "mechanism", None)
        name = mechanism.name if mechanism is not None else "mechanism"
        state = "" if solution.success else f" ({solution.status.name.replace('_', ' ').lower()})"
        figure.suptitle(title or f"{name}{state}", x=0.01, ha="left", fontsize=11)
    return figure


def _panels(solution: Solution) -> list[tuple[str, list[tuple[str, np.ndarray]]]]:
    """Return label and lines of each panel."""
    names = list(solution.system.body_names)
    joints = list(dict.fromkeys(name.rsplit(": ", 1)[0] for name in solution.system.row_names))
    places = {name: solution.com_position(name) for name in names}
    return [
        ("displacement, m", _largest({n: np.linalg.norm(p - p[0], axis=1) for n, p in places.items()})),
        ("angular speed, rad/s", _largest({n: np.linalg.norm(solution.angular_velocity(n), axis=1) for n in names})),
        ("joint force, N", _largest({n: np.linalg.norm(solution.reaction(n)[0], axis=1) for n in joints})),
        (
            "force, N",
            _largest({n: np.linalg.norm(solution.load(n)[0], axis=1) for n in solution.system.force_names}),
        ),
    ]


def _largest(lines: dict[str, np.ndarray]) -> list[tuple[str, np.ndarray]]:
    """Return the largest of some lines, in their own order, without those that are zero."""
    size = {name: float(np.max(np.abs(values), initial=0.0)) for name, values in lines.items()}
    kept = sorted((name for name in lines if size[name] > NOTHING), key=lambda name: -size[name])[:MOST]
    return [(name, values) for name, values in lines.items() if name in kept]
