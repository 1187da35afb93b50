"""Bodies that deform: deflected shapes, films of modes and of solutions, strain energy by mode, Campbell diagrams."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.dae.results.solution import Solution
from gearmbs.flexible import Campbell, ModalModel
from gearmbs.view.figure_style import COLOURS, drawn_on, label, legend_below, look, new_figure, png_bytes
from gearmbs.view.film import RATE, write_film
from gearmbs.view.speed_maps import mark_operating

SHOWN = 0.1
"""Share of a body's size that the largest deflection of a picture has where no factor is given."""
DASHES = {"forward": "-", "backward": (0, (6, 2)), "planar": (0, (1, 1))}
PICTURES = 24
"""Of one cycle of a mode."""


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
    with look():
        figure, panel = drawn_on(ax)
        for rank, k in enumerate(order[:shown]):
            text = f"mode {k + 1}, {model.frequencies[k]:.4g} Hz"
            panel.plot(solution.t, energy[:, k], color=COLOURS[rank % len(COLOURS)], label=text)
        if order.size > shown:
            panel.plot(solution.t, energy[:, order[shown:]].sum(axis=1), color="0.6", label="all others")
        panel.set_xlabel(label("time", "s"))
        panel.set_ylabel(label("strain energy", "J"))
        legend_below(panel)
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
    with look():
        figure, panel = drawn_on(ax)
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
        legend_below(panel)
    return figure
