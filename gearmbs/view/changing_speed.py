"""Figures of records whose speed changes: spectrogram, waterfall, order map, tracked orders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import find_peaks

from gearmbs.progress import waiting
from gearmbs.signals import order_map, order_track, spectrogram, waterfall
from gearmbs.view.figure_style import COLOURS, drawn_on, label, legend_below, look, scaling_name
from gearmbs.view.speed_maps import (
    RANGE_DB,
    RPM,
    by_speed,
    draw_map,
    mark_orders,
    mark_top,
    one_channel,
    put_title,
    repeated,
    stack_lines,
    tag,
    upto,
)

STRONGEST, LEAST_SHARE, LOWEST_ORDER = 4, 0.1, 0.5
"""So many orders are marked where none are given, down to 20 dB below the strongest, from half a turn on."""


def spectrogram_plot(
    data: Any,
    *,
    channel: str | None = None,
    orders: Sequence[float] = (),
    decibels: float = RANGE_DB,
    maximum: float | str | None = None,
    title: str | None = None,
    ax: Axes | None = None,
    **settings: Any,
) -> Figure:
    """Draw the spectrum over time as a map.

    Parameters
    ----------
    data : xarray.DataArray
        A spectrogram (`gearmbs.signals.spectrogram`), or anything it can be made of: a signal, a simulated record.
    channel : str, optional
        Channel to draw; default the first.
    orders : sequence of float
        Multiples of the shaft's frequency to mark, where the speed is known.
    decibels : float
        Range of the colours below the largest value.
    maximum : float or str, optional
        Highest frequency shown, Hz or text.
    title : str, optional
    ax : matplotlib axes, optional
    **settings
        For `gearmbs.signals.spectrogram` where `data` is a signal.

    Raises
    ------
    ValueError
        If there is no such channel, or orders are wanted and the speed is not known.
    """
    if not (isinstance(data, xr.DataArray) and {"time", "frequency"} <= set(data.dims)):
        data = spectrogram(data, maximum=maximum, **settings)
    table = one_channel(upto(data, "frequency", maximum), channel)
    with look():
        figure, panel = drawn_on(ax, 7.2, 4.0)
        draw_map(figure, panel, table, "time", "frequency", decibels)
        panel.set_xlabel("time, s")
        panel.set_ylabel("frequency, Hz")
        if len(orders):
            if "speed" not in table.coords:
                raise ValueError("orders: the speed is not known; pass speed=...")
            mark_orders(panel, table["time"].values, table["speed"].values / math.tau, orders, table)
        put_title(panel, title, data, table)
    return figure


def order_map_plot(
    data: Any,
    *,
    over: str = "time",
    channel: str | None = None,
    marked: Sequence[float] = (),
    decibels: float = RANGE_DB,
    maximum: float | None = None,
    title: str | None = None,
    ax: Axes | None = None,
    **settings: Any,
) -> Figure:
    """Draw the order spectrum over time or speed as a map; orders of the shaft stand upright.

    Parameters
    ----------
    data : xarray.DataArray
        An order map (`gearmbs.signals.order_map`), or a signal or simulated record to make it of.
    over : {"time", "speed"}
        What the vertical axis shows. "speed" is for a run-up or coast-down.
    marked : sequence of float
        Orders to mark at the top edge.
    channel, decibels, title, ax
        As for `spectrogram_plot`.
    maximum : float, optional
        Highest order shown.
    **settings
        For `gearmbs.signals.order_map`.
    """
    if not (isinstance(data, xr.DataArray) and {"time", "order"} <= set(data.dims)):
        data = order_map(data, maximum=maximum, **settings)
    if over not in ("time", "speed"):
        raise ValueError(f"over: must be 'time' or 'speed', got {over!r}")
    table = one_channel(upto(data, "order", maximum), channel)
    if over == "speed":
        table = by_speed(table)
    with look():
        figure, panel = drawn_on(ax, 7.2, 4.0)
        draw_map(figure, panel, table, "order", over, decibels)
        panel.set_xlabel("order of the shaft's speed")
        panel.set_ylabel("time, s" if over == "time" else "speed, rpm")
        for order in marked:
            mark_top(panel, order, f"{order:g}×")
        put_title(panel, title, data, table)
    return figure


def waterfall_plot(
    data: Any,
    *,
    channel: str | None = None,
    orders: Sequence[float] = (),
    style: str = "lines",
    decibels: float | None = None,
    maximum: float | str | None = None,
    title: str | None = None,
    ax: Axes | None = None,
    **settings: Any,
) -> Figure:
    """Draw spectra against speed, one above the other, or as a map.

    Parameters
    ----------
    data : DataArray, Dataset, sequence or mapping
        A waterfall (`gearmbs.signals.waterfall`), or what it is made of: one record whose speed changes, several
        records of constant speed, or a mapping of speed to record.
    channel : str, optional
        Channel to draw; default the first.
    orders : sequence of float
        Multiples of the shaft's frequency to mark.
    style : {"lines", "map"}
        One line for each speed, or colours.
    decibels : float, optional
        Range of the map's colours (default 60), or of lines drawn in dB (default: linear).
    maximum : float or str, optional
        Highest frequency shown, Hz or text.
    title : str, optional
    ax : matplotlib axes, optional
    **settings
        For `gearmbs.signals.waterfall`.

    Raises
    ------
    ValueError
        If there is no such channel or style.
    """
    if style not in ("lines", "map"):
        raise ValueError(f"style: must be 'lines' or 'map', got {style!r}")
    if not (isinstance(data, xr.DataArray) and {"speed", "frequency"} <= set(data.dims)):
        data = waterfall(data, maximum=maximum, **settings)
    table = one_channel(upto(data, "frequency", maximum), channel)
    with look():
        figure, panel = drawn_on(ax, 7.2, 5.0)
        if style == "map":
            draw_map(figure, panel, by_speed(table), "frequency", "speed", decibels or RANGE_DB)
        else:
            stack_lines(panel, table, decibels)
        speeds = table["speed"].values * RPM
        for order, colour in zip(orders, repeated(COLOURS[3:6])):
            x = order * speeds / 60.0
            shown = x <= panel.get_xlim()[1]
            panel.plot(x[shown], speeds[shown], color=colour, linewidth=1.0, linestyle=(0, (4, 3)), zorder=4)
            if shown.any():
                tag(panel, float(x[shown][-1]), float(speeds[shown][-1]), f"{order:g}×", colour)
        panel.set_xlabel("frequency, Hz")
        panel.set_ylabel("speed, rpm")
        put_title(panel, title, data, table)
    return figure


def order_track_plot(
    data: Any,
    *,
    over: str = "speed",
    channel: str | None = None,
    log: bool = False,
    title: str | None = None,
    ax: Axes | None = None,
    **settings: Any,
) -> Figure:
    """Draw the amplitudes of tracked orders over speed or time, a line for each order.

    Parameters
    ----------
    data : xarray.DataArray
        Tracked orders (`gearmbs.signals.order_track`), or a signal or simulated record, with `orders` among `settings`.
    over : {"speed", "time"}
    channel, title, ax
        As for `spectrogram_plot`.
    log : bool
        Logarithmic amplitude.
    **settings
        For `gearmbs.signals.order_track`.
    """
    if over not in ("time", "speed"):
        raise ValueError(f"over: must be 'time' or 'speed', got {over!r}")
    if not (isinstance(data, xr.DataArray) and {"time", "order"} <= set(data.dims)):
        data = order_track(data, **settings)
    table = one_channel(data, channel)
    x = table["time"].values if over == "time" else table["speed"].values * RPM
    with look():
        figure, panel = drawn_on(ax, 7.2, 3.6)
        for k, colour in zip(range(table.sizes["order"]), repeated(COLOURS)):
            order = float(table["order"].values[k])
            panel.plot(x, table.isel(order=k).values, color=colour, label=f"order {order:g}")
        if log:
            panel.set_yscale("log")
        else:
            panel.set_ylim(bottom=0.0)
        panel.margins(x=0)
        panel.set_xlabel("time, s" if over == "time" else "speed, rpm")
        panel.set_ylabel(label(scaling_name(table.attrs.get("scaling")), table.attrs["units"]))
        legend_below(panel, 5)
        put_title(panel, title, data, table)
    return figure


@waiting("drawing figures")
def changing_speed_figures(
    signal: Any, *, orders: Sequence[float] | None = None, title: str | None = None, **shaft: Any
) -> dict[str, Figure]:
    """Return the figures of a record whose speed changes, of its first channel.

    Parameters
    ----------
    signal : xarray.DataArray
        Measured or simulated.
    orders : sequence of float, optional
        Multiples of the shaft's frequency to mark and to follow; default the strongest of the record.
    title : str, optional
    **shaft
        ``speed``, ``phase``, ``tacho`` or ``speed_channel``, as for `gearmbs.signals.order_track`; default what the
        signal knows.

    Returns
    -------
    dict of str to Figure
        "spectrogram", "order map", "waterfall" and "orders".
    """
    mapped = order_map(signal, **shaft)
    orders = strongest_orders(mapped) if orders is None else orders
    highest = 1.5 * max(orders)
    over_time = spectrogram(signal, **shaft)
    # what the orders reach, at the highest speed
    top = min(highest * float(over_time["speed"].max()) / math.tau, float(over_time["frequency"][-1]))
    tracked = order_track(signal, orders=orders, **shaft)
    limit = min(highest, float(mapped["order"][-1]))
    spectra = waterfall(signal, maximum=top, **shaft)
    return {
        "spectrogram": spectrogram_plot(over_time, orders=orders, maximum=top, title=title),
        "order map": order_map_plot(mapped, marked=[k for k in orders if k <= limit], maximum=limit, title=title),
        "waterfall": waterfall_plot(spectra, orders=orders, maximum=top, title=title),
        "orders": order_track_plot(tracked, over="time", title=title),
    }


def strongest_orders(mapped: xr.DataArray, count: int = STRONGEST) -> list[float]:
    """Return the highest peaks of an order map's mean over time, of its first channel, in their order."""
    level = one_channel(mapped, None).mean("time").values
    peaks, _ = find_peaks(level)
    # the first lines hold what the removed mean leaves
    peaks = peaks[mapped["order"].values[peaks] >= LOWEST_ORDER]
    peaks = peaks[level[peaks] >= LEAST_SHARE * level[peaks].max(initial=0.0)]
    best = peaks[np.argsort(level[peaks])[::-1][:count]] if peaks.size else [int(np.argmax(level))]
    return sorted(float(mapped["order"].values[k]) for k in best)
