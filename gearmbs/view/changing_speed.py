"""Figures of records whose speed changes: spectrogram, waterfall, order map, tracked orders, Campbell diagram."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from gearmbs.signals import campbell, order_map, order_track, spectrogram, waterfall
from gearmbs.signals.any_data import in_si
from gearmbs.view.figure_style import COLOURS, GREY, VERMILLION, drawn_on, label, legend_below, look

RPM = 30.0 / math.pi
RANGE_DB = 60.0
COLOUR_MAP = "magma"
MAX_CELLS = 700
"""Maps are drawn with at most this many cells along an axis; each shows the largest value that falls into it."""
MAX_LINES = 60


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
    table = _channel(_upto(data, "frequency", maximum), channel)
    with look():
        figure, panel = drawn_on(ax, 7.2, 4.0)
        _map(figure, panel, table, "time", "frequency", decibels)
        panel.set_xlabel("time, s")
        panel.set_ylabel("frequency, Hz")
        if len(orders):
            if "speed" not in table.coords:
                raise ValueError("orders: the speed is not known; pass speed=...")
            _mark_orders(panel, table["time"].values, table["speed"].values / math.tau, orders, table)
        _title(panel, title, data)
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
    table = _channel(_upto(data, "order", maximum), channel)
    if over == "speed":
        table = _by_speed(table)
    with look():
        figure, panel = drawn_on(ax, 7.2, 4.0)
        _map(figure, panel, table, "order", over, decibels)
        panel.set_xlabel("order of the shaft's speed")
        panel.set_ylabel("time, s" if over == "time" else "speed, rpm")
        for order in marked:
            _mark_top(panel, order, f"{order:g}×")
        _title(panel, title, data)
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
    table = _channel(_upto(data, "frequency", maximum), channel)
    with look():
        figure, panel = drawn_on(ax, 7.2, 5.0)
        if style == "map":
            _map(figure, panel, _by_speed(table), "frequency", "speed", decibels or RANGE_DB)
        else:
            _stack(panel, table, decibels)
        speeds = table["speed"].values * RPM
        for order, colour in zip(orders, _repeated(COLOURS[3:6])):
            x = order * speeds / 60.0
            shown = x <= panel.get_xlim()[1]
            panel.plot(x[shown], speeds[shown], color=colour, linewidth=1.0, linestyle=(0, (4, 3)), zorder=4)
            if shown.any():
                _tag(panel, float(x[shown][-1]), float(speeds[shown][-1]), f"{order:g}×", colour)
        panel.set_xlabel("frequency, Hz")
        panel.set_ylabel("speed, rpm")
        _title(panel, title, data)
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
    table = _channel(data, channel)
    x = table["time"].values if over == "time" else table["speed"].values * RPM
    with look():
        figure, panel = drawn_on(ax, 7.2, 3.6)
        for k, colour in zip(range(table.sizes["order"]), _repeated(COLOURS)):
            order = float(table["order"].values[k])
            panel.plot(x, table.isel(order=k).values, color=colour, label=f"order {order:g}")
        if log:
            panel.set_yscale("log")
        else:
            panel.set_ylim(bottom=0.0)
        panel.margins(x=0)
        panel.set_xlabel("time, s" if over == "time" else "speed, rpm")
        panel.set_ylabel(
            label(str(table.attrs.get("scaling", "amplitude")).replace("rms", "RMS"), table.attrs["units"])
        )
        legend_below(panel, 5)
        _title(panel, title, data)
    return figure


def campbell_plot(
    diagram: Any,
    *,
    speeds: Sequence[Any] | None = None,
    orders: Sequence[float] | Mapping[str, float] = (1.0,),
    measured: xr.DataArray | None = None,
    channel: str | None = None,
    maximum: float | str | None = None,
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
    highest = in_si(maximum, "frequency", "maximum")
    top = 1.1 * float(np.nanmax(diagram["frequency"].values)) if highest is None else float(highest)
    with look():
        figure, panel = drawn_on(ax, 7.2, 4.6)
        if measured is not None:
            table = _channel(_upto(measured, "frequency", top), channel)
            _map(figure, panel, _by_speed(table), "speed", "frequency", RANGE_DB)
        for j in range(diagram.sizes["mode"]):
            values = diagram["frequency"].values[:, j]
            panel.plot(rpm, values, color=COLOURS[0], linewidth=1.4, label="natural frequencies" if j == 0 else None)
        for k, name in enumerate(diagram["order_name"].values):
            x, y = rpm, diagram["excitation"].values[:, k]
            panel.plot(x, y, color=GREY, linewidth=0.9, linestyle=(0, (5, 3)), label="orders" if k == 0 else None)
            inside = np.flatnonzero(y <= top)
            if inside.size:
                end = min(rpm[-1], float(np.interp(top, y, x))) if y[-1] > y[0] else rpm[-1]
                _tag(panel, end, float(np.interp(end, x, y)), str(name), "#555555")
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
        panel.set_xlim(float(rpm[0]), float(rpm[-1]))
        panel.set_ylim(0.0, top)
        panel.set_xlabel("speed, rpm")
        panel.set_ylabel("frequency, Hz")
        legend_below(panel, 3)
        if title:
            panel.set_title(title, wrap=True)
    return figure


def _upto(data: xr.DataArray, dim: str, maximum: float | str | None) -> xr.DataArray:
    if maximum is None:
        return data
    top = in_si(maximum, "frequency", "maximum") if dim == "frequency" else maximum
    kept = np.flatnonzero(data[dim].values <= top)
    if kept.size < 2:
        raise ValueError(
            f"maximum: {maximum!r} leaves nothing of the {dim} axis, which begins at {data[dim].values[0]:g}"
        )
    return data.isel({dim: kept})


def _channel(data: xr.DataArray, channel: str | None) -> xr.DataArray:
    """One channel of a map, dimensions as they are without it."""
    if "channel" not in data.dims:
        return data
    names = [str(c) for c in data["channel"].values]
    if channel is not None and channel not in names:
        raise ValueError(f"channel: there is no {channel!r}, only {names}")
    return data.isel(channel=0 if channel is None else names.index(channel))


def _by_speed(table: xr.DataArray) -> xr.DataArray:
    """A map along increasing speed, each speed once."""
    other = next(str(d) for d in table.dims if d not in ("time", "speed"))
    speeds = np.asarray(table["speed"].values, dtype=float)
    values = table.transpose(..., other).values
    good = np.isfinite(speeds)
    order = np.argsort(speeds[good], kind="stable")
    unique, first = np.unique(speeds[good][order], return_index=True)
    rows = np.maximum.reduceat(values[good][order], first, axis=0)
    return xr.DataArray(rows, dims=("speed", other), coords={"speed": unique, other: table[other]}, attrs=table.attrs)


def _map(figure: Figure, panel: Axes, table: xr.DataArray, x: str, y: str, decibels: float) -> None:
    """Draw a table as a map in dB below its largest value."""
    scale = {"speed": RPM}
    across = _edges(np.asarray(table[x].values, dtype=float) * scale.get(x, 1.0))
    upward = _edges(np.asarray(table[y].values, dtype=float) * scale.get(y, 1.0))
    values = np.asarray(table.transpose(y, x).values, dtype=float)
    values, across, upward = _coarser(values, across, upward)
    top = float(np.nanmax(values)) if np.isfinite(values).any() else 0.0
    factor = 10.0 if table.attrs.get("scaling") in ("power", "density") else 20.0
    with np.errstate(divide="ignore", invalid="ignore"):
        level = factor * np.log10(values / top) if top > 0.0 else np.full(values.shape, -decibels)
    level = np.clip(np.nan_to_num(level, nan=-decibels, neginf=-decibels), -decibels, 0.0)
    mesh = panel.pcolormesh(
        across, upward, level, cmap=COLOUR_MAP, vmin=-decibels, vmax=0.0, shading="flat", rasterized=True
    )
    panel.grid(False)
    unit = str(table.attrs.get("units", ""))
    bar = figure.colorbar(mesh, ax=panel, pad=0.02, label=f"dB re {top:.3g} {label('', unit).lstrip(', ')}".rstrip())
    bar.outline.set_visible(False)  # type: ignore[operator]
    panel.set_xlim(across[0], across[-1])
    panel.set_ylim(upward[0], upward[-1])


def _edges(centres: np.ndarray) -> np.ndarray:
    """Edges of cells around increasing centres."""
    if centres.size == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    inner = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate(([1.5 * centres[0] - 0.5 * centres[1]], inner, [1.5 * centres[-1] - 0.5 * centres[-2]]))


def _coarser(values: np.ndarray, across: np.ndarray, upward: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A map of at most MAX_CELLS cells along each axis, every one with the largest value inside it."""
    for axis in (0, 1):
        edges = upward if axis == 0 else across
        size = -(-(edges.size - 1) // MAX_CELLS)
        if size > 1:
            starts = np.arange(0, edges.size - 1, size)
            values = np.maximum.reduceat(values, starts, axis=axis)
            edges = np.append(edges[starts], edges[-1])
        if axis == 0:
            upward = edges
        else:
            across = edges
    return values, across, upward


def _stack(panel: Axes, table: xr.DataArray, decibels: float | None) -> None:
    """One line for each speed, its zero at that speed, the highest line as tall as a few steps of speed."""
    table = table.transpose("speed", "frequency")
    size = -(-table.sizes["speed"] // MAX_LINES)
    if size > 1:
        starts = np.arange(0, table.sizes["speed"], size)
        rows = np.maximum.reduceat(table.values, starts, axis=0)
        speeds = np.array([part.mean() for part in np.split(table["speed"].values, starts[1:])]) * RPM
    else:
        rows, speeds = table.values, table["speed"].values * RPM
    x = table["frequency"].values
    if decibels is not None:
        top = float(rows.max())
        factor = 10.0 if table.attrs.get("scaling") in ("power", "density") else 20.0
        with np.errstate(divide="ignore"):
            rows = np.clip(factor * np.log10(rows / top), -decibels, 0.0) + decibels
    span = float(speeds[-1] - speeds[0]) or 1.0
    step = span / max(1, len(speeds) - 1)
    height = max(4.0 * step, 0.12 * span)
    rows = rows * (height / (float(rows.max()) or 1.0))
    for zorder, (speed, row) in enumerate(zip(speeds[::-1], rows[::-1])):
        panel.fill_between(x, speed, speed + row, color="white", linewidth=0, zorder=1.0 + 1e-3 * zorder)
        line = LineCollection([np.column_stack([x, speed + row])], colors=[COLOURS[0]], linewidths=0.8)
        line.set_zorder(1.0 + 1e-3 * (zorder + 0.5))
        panel.add_collection(line)
    panel.grid(axis="y", visible=False)
    panel.set_xlim(float(x[0]), float(x[-1]))
    panel.set_ylim(float(speeds[0]) - 0.02 * span, float(speeds[-1]) + 1.05 * height)


def _mark_orders(
    panel: Axes, times: np.ndarray, shaft: np.ndarray, orders: Sequence[float], table: xr.DataArray
) -> None:
    top = float(table["frequency"].values[-1])
    for order in orders:
        y = order * shaft
        shown = np.where(y <= top, y, np.nan)
        panel.plot(times, shown, color="white", linewidth=0.8, linestyle=(0, (4, 3)))
        last = np.flatnonzero(np.isfinite(shown))
        if last.size:
            _tag(panel, float(times[last[-1]]), float(shown[last[-1]]), f"{order:g}×", "white", inside=True)


def _mark_top(panel: Axes, x: float, text: str) -> None:
    panel.annotate(
        text, (x, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2), textcoords="offset points", ha="center",
        va="bottom", fontsize=8, color=VERMILLION,
    )  # fmt: skip
    panel.plot(
        [x, x], [1.0, 0.985], transform=panel.get_xaxis_transform(), color=VERMILLION, linewidth=1.2, clip_on=False
    )


def _tag(panel: Axes, x: float, y: float, text: str, colour: str, inside: bool = False) -> None:
    offset, align = ((-4, -9), "right") if inside else ((3, 2), "left")
    panel.annotate(
        text,
        (x, y),
        xytext=offset,
        textcoords="offset points",
        ha=align,
        fontsize=8,
        color=colour,
        annotation_clip=False,
    )


def _title(panel: Axes, title: str | None, data: xr.DataArray) -> None:
    if title:
        panel.set_title(title, wrap=True, pad=14 if panel.texts else 6)


def _repeated(colours: Sequence[str]):
    while True:
        yield from colours
