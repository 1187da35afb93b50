"""A single wheel seen along its axis, with its circles."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.gears import GearSpec
from gearmbs.units import shown
from gearmbs.view.figure_style import BLUE, GREEN, GREY, VERMILLION, drawn_on, legend_below, look
from gearmbs.view.outline import gear_outline

MM = 1e3


def wheel_plot(gear: GearSpec, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Draw a wheel across its axis, with its bore and its pitch, base and root circles.

    Parameters
    ----------
    gear : GearSpec
    title : str, optional
    ax : matplotlib axes, optional

    Examples
    --------
    >>> figure = wheel_plot(GearSpec(20, "2 mm"))
    >>> figure.axes[0].get_title(loc="left")
    'gear: 20 teeth, module 2 mm, face 20 mm'
    """
    with look():
        figure, ax = drawn_on(ax, 5.2, 5.6)
        turn = np.linspace(0.0, 2.0 * np.pi, 361)
        outline = gear_outline(gear) * MM
        body, empty = "#DCE8F3", "white"
        if gear.internal:
            rim = gear.outer_radius * MM
            ax.fill(rim * np.cos(turn), rim * np.sin(turn), facecolor=body, edgecolor=BLUE, linewidth=1.1)
        inside = empty if gear.internal else body
        ax.fill(*np.vstack([outline, outline[:1]]).T, facecolor=inside, edgecolor=BLUE, linewidth=1.1)
        circles = (
            ("pitch circle", gear.pitch_radius, VERMILLION, (0, (8, 3, 2, 3))),
            ("base circle", gear.base_radius, GREEN, (0, (4, 3))),
            ("root circle", gear.root_radius, GREY, (0, (1, 2))),
        )
        for name, radius, colour, dashes in circles:
            label = f"{name}, {2 * radius * MM:.4g} mm"
            ax.plot(radius * MM * np.cos(turn), radius * MM * np.sin(turn), color=colour, linestyle=dashes, label=label)
        if gear.bore_radius:
            bore = gear.bore_radius * MM
            ax.fill(bore * np.cos(turn), bore * np.sin(turn), facecolor="white", edgecolor=BLUE, linewidth=1.1)
        ax.set_aspect("equal")
        ax.set_xlabel("mm")
        ax.set_ylabel("mm")
        helix = f", helix {shown(gear.helix_angle, 'deg', '.4g')}" if gear.helix_angle else ""
        sizes = f"module {shown(gear.module, 'mm', '.4g')}, face {shown(gear.face_width, 'mm', '.4g')}{helix}"
        ax.set_title(title or f"{gear.name}: {abs(gear.teeth)} teeth, {sizes}")
        legend_below(ax, 2)
    return figure
