"""Figures of records whose speed changes: spectrogram, waterfall, order map, tracked orders."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from scipy.signal import find_peaks

from gearmbs.progress import waiting
from gearmbs.signals import order_map, order_track, spectrogram, waterfall
from gearmbs.signals.signal.arguments import in_si
from gearmbs.view.figures.style import BLACK, COLOURS, VERMILLION, drawing, label, scaling_name

if TYPE_CHECKING:
    from gearmbs.signals.rotation.keywords import SpeedKeywords
    from gearmbs.signals.rotation.order_tracking import OrderMapKeywords, OrderTrackKeywords
    from gearmbs.signals.time_frequency import SpectrogramKeywords, WaterfallKeywords

# What figures over time, speed, frequency and order share: maps in decibels, stacked lines, marks of orders.


RPM = 30.0 / math.pi
RANGE_DB = 60.0
"""Decibels below the largest level that maps show: what is fainter is noise as a rule."""
COLOUR_MAP = "magma"
MAX_CELLS = 700
"""Maps are drawn with at most this many cells along an axis; each shows the largest value that falls into it."""
MAX_LINES = 60


def upto(data: xr.DataArray, dim: str, maximum: float | str | None) -> xr.DataArray:
    if maximum is None:
        return data
    top = in_si(maximum, "frequency", "maximum") if dim == "frequency" else maximum
    kept = np.flatnonzero(data[dim].values <= top)
    if kept.size < 2:
        raise ValueError(
            f"maximum: {maximum!r} leaves nothing of the {dim} axis, which begins at {data[dim].values[0]:g}"
        )
    return data.isel({dim: kept})


def one_channel(data: xr.DataArray, channel: str | None) -> xr.DataArray:
    """One channel of a map, dimensions as they are without it."""
    if "channel" not in data.dims:
        return data
    names = [str(c) for c in data["channel"].values]
    if channel is not None and channel not in names:
        raise ValueError(f"channel: there is no {channel!r}, only {names}")
    return data.isel(channel=0 if channel is None else names.index(channel))


def by_speed(table: xr.DataArray) -> xr.DataArray:
    """A map along increasing speed, each speed once."""
    other = next(str(d) for d in table.dims if d not in ("time", "speed"))
    speeds = np.asarray(table["speed"].values, dtype=float)
    values = table.transpose(..., other).values
    good = np.isfinite(speeds)
    order = np.argsort(speeds[good], kind="stable")
    unique, first = np.unique(speeds[good][order], return_index=True)
    rows = np.maximum.reduceat(values[good][order], first, axis=0)
    kept = {"channel": table["channel"]} if "channel" in table.coords else {}
    coords = {"speed": unique, other: table[other].values, **kept}
    return xr.DataArray(rows, dims=("speed", other), coords=coords, attrs=table.attrs)


def draw_map(figure: Figure, panel: Axes, table: xr.DataArray, x: str, y: str, decibels: float) -> None:
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
    unit, name = str(table.attrs.get("units", "")), scaling_name(table.attrs.get("scaling"))
    bar = figure.colorbar(
        mesh, ax=panel, pad=0.02, label=f"{name}, dB re {top:.3g} {label('', unit).lstrip(', ')}".rstrip()
    )
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


def stack_lines(panel: Axes, table: xr.DataArray, decibels: float | None) -> None:
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
    top, unit = float(rows.max()), str(table.attrs.get("units", ""))
    if decibels is not None:
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
    # a bar as tall as the highest line says how high lines are
    means = label(scaling_name(table.attrs.get("scaling")), f"{top:.3g} {label('', unit).lstrip(', ')}".strip())
    low = float(speeds[-1]) + 0.02 * height
    panel.plot([1.012] * 2, [low, low + height], transform=panel.get_yaxis_transform(), color=BLACK, linewidth=2.0,
               clip_on=False, solid_capstyle="butt")  # fmt: skip
    panel.annotate(f"{means}" + (f"; {decibels:g} dB" if decibels is not None else ""), (1.02, low + 0.5 * height),
                   xycoords=panel.get_yaxis_transform(), rotation=90, va="top", fontsize=7.5,
                   annotation_clip=False)  # fmt: skip
    panel.grid(axis="y", visible=False)
    panel.set_xlim(float(x[0]), float(x[-1]))
    panel.set_ylim(float(speeds[0]) - 0.02 * span, float(speeds[-1]) + 1.05 * height)


def mark_orders(
    panel: Axes, times: np.ndarray, shaft: np.ndarray, orders: Sequence[float], table: xr.DataArray
) -> None:
    top = float(table["frequency"].values[-1])
    for order in orders:
        y = order * shaft
        shown = np.where(y <= top, y, np.nan)
        panel.plot(times, shown, color="white", linewidth=0.8, linestyle=(0, (4, 3)))
        last = np.flatnonzero(np.isfinite(shown))
        if last.size:
            tag(panel, float(times[last[-1]]), float(shown[last[-1]]), f"{order:g}×", "white", inside=True)


def mark_top(panel: Axes, x: float, text: str) -> None:
    panel.annotate(
        text, (x, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2), textcoords="offset points", ha="center",
        va="bottom", fontsize=8, color=VERMILLION,
    )  # fmt: skip
    panel.plot(
        [x, x], [1.0, 0.985], transform=panel.get_xaxis_transform(), color=VERMILLION, linewidth=1.2, clip_on=False
    )


def mark_operating(panel: Axes, speeds: Any) -> None:
    """Mark operating speeds, rad/s or texts, by upright lines over a panel whose speeds are in rpm."""
    marked_speeds = (
        [] if speeds is None else [speeds] if isinstance(speeds, str) or np.ndim(speeds) == 0 else list(speeds)
    )
    for k, speed in enumerate(marked_speeds):
        panel.axvline(
            abs(in_si(speed, "angular speed", "operating")) * RPM, color=BLACK, linewidth=1.1,
            linestyle=(0, (1, 1.5)), label=None if k else "operating speed",
        )  # fmt: skip


def tag(panel: Axes, x: float, y: float, text: str, colour: str, inside: bool = False) -> None:
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


def put_title(panel: Axes, title: str | None, data: xr.DataArray, table: xr.DataArray) -> None:
    """Put the title over a panel; of data with several channels it says which one is drawn."""
    if data.sizes.get("channel", 1) > 1 and "channel" in table.coords:
        name = str(table["channel"].values).replace("_", " ")
        title = f"{title}: {name}" if title else name
    if title:
        panel.set_title(title, wrap=True, pad=14 if panel.texts else 6)


def repeated(colours: Sequence[str]) -> Iterator[str]:
    while True:
        yield from colours


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
    **settings: Unpack[SpectrogramKeywords],
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
    with drawing(ax, 7.2, 4.0) as (figure, panel):
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
    **settings: Unpack[OrderMapKeywords],
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
    with drawing(ax, 7.2, 4.0) as (figure, panel):
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
    **settings: Unpack[WaterfallKeywords],
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
    with drawing(ax, 7.2, 5.0) as (figure, panel):
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
    **settings: Unpack[OrderTrackKeywords],
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
    with drawing(ax, 7.2, 3.6, legend=5) as (figure, panel):
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
        put_title(panel, title, data, table)
    return figure


@waiting("drawing figures")
def changing_speed_figures(
    signal: Any, *, orders: Sequence[float] | None = None, title: str | None = None, **shaft: Unpack[SpeedKeywords]
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
