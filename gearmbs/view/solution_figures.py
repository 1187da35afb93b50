"""The solution of a mechanism at a glance: how far bodies move, how fast they turn, what joints and forces carry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from gearmbs.view.figure_style import COLOURS, look, new_figure
from gearmbs.view.signals import thinned

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution

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
