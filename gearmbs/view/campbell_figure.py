"""The Campbell diagram as a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.signals import campbell
from gearmbs.signals.any_data import in_si
from gearmbs.view.figure_style import COLOURS, GREY, VERMILLION, drawn_on, legend_below, look
from gearmbs.view.speed_maps import RANGE_DB, RPM, by_speed, draw_map, mark_operating, one_channel, tag, upto


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
    with look():
        figure, panel = drawn_on(ax, 7.2, 4.6)
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
        legend_below(panel, 3)
        if title:
            panel.set_title(title, wrap=True)
    return figure
