"""What figures over time, speed, frequency and order share: maps in decibels, stacked lines, marks of orders."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from gearmbs.signals.any_data import in_si
from gearmbs.view.figure_style import BLACK, COLOURS, VERMILLION, label, scaling_name

RPM = 30.0 / math.pi
RANGE_DB = 60.0
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
    given = [] if speeds is None else [speeds] if isinstance(speeds, str) or np.ndim(speeds) == 0 else list(speeds)
    for k, speed in enumerate(given):
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
