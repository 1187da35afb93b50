"""Equivalent stresses of bodies that deform: over the surface of a solid, along a shaft."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.flexible import ModalModel, StressModes
from gearmbs.view.figure_style import BLUE, drawn_on, label, look, new_figure

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
