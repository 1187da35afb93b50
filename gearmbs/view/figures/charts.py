"""Charts of tables: mesh harmonics by state as bars, as the paper's Figures 5 and 7, and maps over two parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.figure import Figure

from gearmbs.view.figures.style import (
    drawing,
    drawn_on,
    label,
    look,
    new_figure,
    state_colour,
)

HATCHES = ("", "///", "...", "xxx", "\\\\\\", "++")
GROUP = 0.8
"""Width of a group of bars; groups stand 1 apart."""

SEQUENTIAL, DIVERGING = "cividis", "PuOr_r"
SHOWN_UNITS = {"m": ("mm", 1e3), "rad": ("°", 180.0 / np.pi), "rad/s": ("rpm", 30.0 / np.pi), "N/m": ("N/µm", 1e-6)}


def gmf_bars(
    table: xr.DataArray,
    *,
    title: str | None = None,
    ax: Axes | None = None,
    unit: str | None = None,
    values: bool = True,
    log: bool = False,
    errors: xr.DataArray | None = None,
) -> Figure:
    """Draw the RMS of the gear mesh harmonics of several states, as the paper's Figures 5 and 7 do.

    Parameters
    ----------
    table : xarray.DataArray, dims (state, harmonic) or (harmonic,)
        RMS; the unit is taken from ``attrs["units"]``. Coordinates ``fault_misalignment`` (rad) and
        ``fault_centre_distance_error`` (m) along ``state``, if there, are written into the legend.
    title : str, optional
    ax : matplotlib axes, optional
        Where to draw; default a new figure.
    unit : str, optional
        Instead of the table's own.
    values : bool
        Write the number over each bar.
    log : bool
        Logarithmic RMS axis.
    errors : xarray.DataArray, with the table's dims, optional
        Numerical errors of the RMS, such as ``gmf_rms_error`` of records that were simulated to an accuracy; drawn as
        bars about each height.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If dimensions are missing or a value is negative or not finite.
    """
    if getattr(table, "dims", None) == ("harmonic",):
        table = table.expand_dims(state=["record"])
        errors = None if errors is None else errors.expand_dims(state=["record"])
    table = checked_table(table, "table", ("state", "harmonic"))
    errors = None if errors is None else checked_table(errors, "errors", ("state", "harmonic"))
    if errors is not None and errors.shape != table.shape:
        raise ValueError(f"errors: has shape {errors.shape}, the table {table.shape}; give one for each level")
    with drawing(ax, 6.4, 4.2, title=title, legend=3) as (figure, ax):
        states = [str(s) for s in table.state.values]
        colours = [state_colour(s, k) for k, s in enumerate(states)]
        bars(ax, table, "state", colours, state_labels(table), values, log, errors)
        harmonic_axis(ax, table)
        ax.set_ylabel(label(rms_name(table), unit or table.attrs.get("units", "")))
    return figure


def comparison_bars(
    data: xr.Dataset | Any, *, title: str | None = None, unit: str | None = None, log: bool = False
) -> Figure:
    """Draw experiment and model side by side: a row of panels for each load, experiment left, model right.

    Parameters
    ----------
    data : xarray.Dataset or ComparisonReport
        Variables ``experiment`` and ``model``, dims (load, state, harmonic), as `gearmbs.signals.compare` returns.
        Without ``model`` only the experiment is drawn.
    title : str, optional
    unit : str, optional
    log : bool
        Logarithmic RMS axis.

    Raises
    ------
    ValueError
        If ``experiment`` or a dimension is missing, or there is more than one channel.
    """
    tables: xr.Dataset = data if isinstance(data, xr.Dataset) else data.data
    if "experiment" not in tables:
        raise ValueError(f"data: no variable 'experiment', only {list(tables.data_vars)}; pass the result of compare()")
    sides = [side for side in ("experiment", "model") if side in tables]
    first = tables["experiment"]
    if "channel" in first.dims:
        if first.sizes["channel"] > 1:
            names = ", ".join(str(c) for c in first.channel.values)
            raise ValueError(f"data: several channels ({names}); select one, e.g. report.data.isel(channel=0)")
        tables = tables.isel(channel=0)
    checked = {side: checked_table(tables[side], side, ("load", "state", "harmonic")) for side in sides}
    loads = checked["experiment"]["load"].values
    with look():
        figure = new_figure(4.6 * len(sides) + 0.6, 2.9 * len(loads) + 0.7)
        axes = figure.subplots(len(loads), len(sides), squeeze=False, sharey="row")
        for row, load in enumerate(loads):
            for column, side in enumerate(sides):
                ax, table = axes[row][column], checked[side].sel(load=load)
                colours = [state_colour(str(s), k) for k, s in enumerate(table.state.values)]
                bars(ax, table, "state", colours, state_labels(table), True, log)
                harmonic_axis(ax, table)
                ax.set_title(f"{side}, {load} load" if "load" not in str(load) else f"{side}, {load}")
                if not log:
                    ax.set_ylim(0.0, 1.12 * max(1e-300, *(float(t.sel(load=load).max()) for t in checked.values())))
                if column == 0:
                    own = unit or tables.attrs.get("units") or checked[side].attrs.get("units", "")
                    ax.set_ylabel(label("RMS", own))
        handles, names = axes[0][0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside lower center", ncols=4)
        if title:
            figure.suptitle(title)
    return figure


def checked_table(table: xr.DataArray, name: str, dims: tuple[str, ...]) -> xr.DataArray:
    """Return the table with its dimensions in order, or say what is wrong with it."""
    if not isinstance(table, xr.DataArray):
        raise ValueError(f"{name}: a {type(table).__name__}; give an xarray.DataArray with dims {dims}")
    if set(table.dims) != set(dims):
        raise ValueError(f"{name}: dims are {tuple(table.dims)}, needed are {dims}; select the others away with .sel()")
    if table.size == 0:
        raise ValueError(f"{name}: empty, shape {table.shape}")
    table = table.transpose(*dims)
    bad = ~(np.nan_to_num(np.asarray(table.values, dtype=float), nan=0.0, posinf=-1.0) >= 0.0)
    if bad.any():
        where = {d: table[d].values[i].item() for d, i in zip(dims, np.argwhere(bad)[0])}
        raise ValueError(f"{name}: {float(table.values[bad][0])} at {where}; an RMS is finite and not negative")
    return table


def bars(
    ax: Axes,
    table: xr.DataArray,
    dim: str,
    colours: list[str],
    labels: list[str],
    values: bool,
    log: bool,
    errors: xr.DataArray | None = None,
) -> None:
    """Draw one bar for each ``dim`` in each group along the other dimension; missing values are left out."""
    data = np.asarray(table.transpose(dim, ...).values, dtype=float)
    count, groups = data.shape
    width = GROUP / count
    top = np.nanmax(data) if np.isfinite(data).any() else 1.0
    for k in range(count):
        at = np.arange(groups) + (k - 0.5 * (count - 1)) * width
        drawn = ax.bar(at, data[k], width, label=labels[k], color=colours[k], edgecolor="white", linewidth=0.8)
        if errors is not None:
            size = np.asarray(errors.transpose(dim, ...).values, dtype=float)[k]
            ax.errorbar(at, data[k], size, fmt="none", ecolor="black", elinewidth=1.0, capsize=3.0)
        for patch in drawn:
            patch.set_hatch(HATCHES[k % len(HATCHES)])
        if values:
            texts = [f"{v:.3g}" if np.isfinite(v) else "" for v in data[k]]
            ax.bar_label(drawn, texts, padding=2, fontsize=max(5.5, min(8.5, 10.5 - 0.8 * count)))
        for x in at[~np.isfinite(data[k])]:
            ax.text(x, 0.02, "no data", rotation=90, ha="center", fontsize=8, transform=ax.get_xaxis_transform())
    if log:
        ax.set_yscale("log")
        if top > 0:
            ax.set_ylim(top=1.6 * top)
    else:
        ax.set_ylim(0.0, 1.12 * top if top > 0 else 1.0)
    ax.grid(visible=False, axis="x")


def harmonic_axis(ax: Axes, table: xr.DataArray) -> None:
    """Name the groups after the harmonics and, when known, their frequencies."""
    names = [f"{h}× GMF" for h in table.harmonic.values]
    if "frequency" in table.coords and table.frequency.dims == ("harmonic",):
        names = [f"{n}\n{f:.0f} Hz" for n, f in zip(names, table.frequency.values)]
    ax.set_xticks(np.arange(table.sizes["harmonic"]), names)
    ax.tick_params(axis="x", length=0)


def state_labels(table: xr.DataArray) -> list[str]:
    """Return legend texts of the states, with the size of the fault where the table knows it."""
    out = []
    for k, state in enumerate(table.state.values):
        text = str(state)
        for name, unit, factor, form in (
            ("fault_misalignment", "°", 180.0 / np.pi, "{:.3g}"),
            ("fault_centre_distance_error", " mm", 1e3, "{:+.3g}"),
        ):
            if name in table.coords and table[name].dims == ("state",) and float(table[name][k]) != 0.0:
                text += " " + form.format(float(table[name][k]) * factor) + unit
        out.append(text)
    return out


def rms_name(table: xr.DataArray) -> str:
    """Return what the RMS is of, as far as the table says."""
    kind = {"m/s^2": "RMS of acceleration", "m/s": "RMS of velocity", "m": "RMS of displacement", "N": "RMS of force"}
    name = kind.get(str(table.attrs.get("units", "")), "RMS")
    return f"{name}, scaled" if "scaled" in str(table.attrs.get("long_name", "")) else name


def sensitivity_map(
    table: xr.DataArray,
    *,
    x: str | None = None,
    y: str | None = None,
    centre: float | None = None,
    log: bool = False,
    values: bool = True,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw a quantity over two parameters as a heat map; a third dimension gives a panel for each of its values.

    Cells are of equal size whatever the spacing of the parameters; ticks carry their values. Lengths, angles and
    speeds in SI are written in mm, degrees and rpm.

    Parameters
    ----------
    table : xarray.DataArray
        Two or three dimensions with coordinates; ``attrs["units"]`` and ``attrs["long_name"]`` of table and
        coordinates go into the labels. NaN cells (failed runs) are left white and marked.
    x, y : str, optional
        Dimensions along the axes; default the last and the one before.
    centre : float, optional
        Value that means "no change" (1 for ratios, 0 for dB): colours part there.
    log : bool
        Logarithmic colours, for positive quantities over decades.
    values : bool
        Write the number into each cell.
    title : str, optional
    ax : matplotlib axes, optional
        For a table of two dimensions.

    Raises
    ------
    ValueError
        If the dimensions do not fit, or ``log`` meets values that are not positive.
    """
    table, x, y, panel = _arranged(table, x, y)
    blocks = [table] if panel is None else [table.isel({panel: k}) for k in range(table.sizes[panel])]
    if ax is not None and len(blocks) > 1:
        raise ValueError(f"ax: one panel for {len(blocks)} values of {panel!r}; select one or leave ax away")
    norm = _norm(np.asarray(table.values, dtype=float), centre, log)
    wide, high = 0.62 * table.sizes[x] + 1.6, 0.5 * table.sizes[y] + 1.5
    with look():
        if ax is not None:
            figure, single = drawn_on(ax)
            axes = [single]
        else:
            columns = min(3, len(blocks))
            rows = -(-len(blocks) // columns)
            figure = new_figure(max(4.6, columns * wide + 1.0), max(3.2, rows * high + 0.4))
            grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
            for empty in grid[len(blocks) :]:
                empty.set_visible(False)
            axes = list(grid[: len(blocks)])
        mesh = None
        for k, (one, block) in enumerate(zip(axes, blocks)):
            mesh = _cells(one, block, x, y, norm, SEQUENTIAL if centre is None else DIVERGING, values)
            if panel is not None:
                one.set_title(_panel_title(block, panel), fontsize=10)
            if ax is None and k % min(3, len(blocks)) == 0:
                one.set_ylabel(_axis_label(table, y))
            elif ax is not None:
                one.set_ylabel(_axis_label(table, y))
            if k >= len(blocks) - min(3, len(blocks)):
                one.set_xlabel(_axis_label(table, x))
                one.tick_params(labelbottom=True)
        assert mesh is not None
        name = str(table.attrs.get("long_name") or table.name or "value").replace("_", " ")
        bar = figure.colorbar(mesh, ax=axes, label=label(name, table.attrs.get("units", "")), pad=0.02)
        bar.outline.set_visible(False)  # type: ignore[operator]
        if title and len(axes) == 1:
            axes[0].set_title(title, wrap=True)
        elif title:
            figure.suptitle(title)
    return figure


def _arranged(table: xr.DataArray, x: str | None, y: str | None) -> tuple[xr.DataArray, str, str, str | None]:
    if not isinstance(table, xr.DataArray) or table.ndim not in (2, 3) or table.size == 0:
        found = f"dims {table.dims}" if isinstance(table, xr.DataArray) else f"a {type(table).__name__}"
        raise ValueError(f"table: {found}; give a DataArray of two or three dimensions with values")
    dims = [str(d) for d in table.dims]
    for name, value in (("x", x), ("y", y)):
        if value is not None and value not in dims:
            raise ValueError(f"{name}: {value!r} is no dimension of the table; it has {', '.join(dims)}")
    if x is None:
        x = [d for d in dims if d != y][-1]
    if y is None:
        y = [d for d in dims if d != x][-1]
    if x == y:
        raise ValueError(f"x and y are both {x!r}; choose two dimensions")
    rest = [d for d in dims if d not in (x, y)]
    return table.transpose(*rest, y, x), x, y, rest[0] if rest else None


def _norm(values: np.ndarray, centre: float | None, log: bool) -> Normalize:
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        raise ValueError("table: no finite value to draw")
    low, high = float(finite.min()), float(finite.max())
    if log:
        if low <= 0.0:
            raise ValueError(f"log: the smallest value is {low:g}; logarithmic colours need positive ones")
        if centre is not None:
            reach = max(abs(np.log(high / centre)), abs(np.log(low / centre)), 1e-3)
            return LogNorm(centre * np.exp(-reach), centre * np.exp(reach))
        return LogNorm(low, high if high > low else 1.01 * low)
    if centre is not None:
        reach = max(high - centre, centre - low, 1e-12)
        return TwoSlopeNorm(centre, centre - reach, centre + reach)
    return Normalize(low, high if high > low else low + 1.0)


def _cells(ax: Axes, block: xr.DataArray, x: str, y: str, norm: Normalize, colours: str, values: bool):
    data = np.ma.masked_invalid(np.asarray(block.values, dtype=float))
    mesh = ax.pcolormesh(data, cmap=colours, norm=norm, edgecolors="white", linewidth=0.6)
    ax.set_xticks(np.arange(data.shape[1]) + 0.5, _ticks(block, x))
    ax.set_yticks(np.arange(data.shape[0]) + 0.5, _ticks(block, y))
    ax.tick_params(length=0)
    ax.grid(visible=False)
    for side in ("left", "bottom"):
        ax.spines[side].set_visible(False)
    for j, i in np.ndindex(*data.shape):
        missing = bool(np.ma.getmaskarray(data)[j, i])
        if not (values or missing):
            continue
        text, colour = ("no\nresult", "#666666") if missing else (f"{data[j, i]:.3g}", "black")
        if not missing:
            red, green, blue, _ = mesh.cmap(norm(data[j, i]))
            colour = "white" if 0.299 * red + 0.587 * green + 0.114 * blue < 0.5 else "black"
        ax.text(i + 0.5, j + 0.5, text, ha="center", va="center", fontsize=7.5, color=colour)
    return mesh


def _ticks(block: xr.DataArray, dim: str) -> list[str]:
    values = block[dim].values
    if values.dtype.kind not in "fiu":
        return [str(v).replace("_", " ") for v in values]
    factor = SHOWN_UNITS.get(str(block[dim].attrs.get("units", "")), ("", 1.0))[1]
    return [f"{v * factor:.4g}" for v in values.astype(float)]


def _axis_label(table: xr.DataArray, dim: str) -> str:
    attrs = table[dim].attrs
    unit = str(attrs.get("units", ""))
    return label(str(attrs.get("long_name", dim)).replace("_", " "), SHOWN_UNITS.get(unit, (unit, 1.0))[0])


def _panel_title(block: xr.DataArray, panel: str) -> str:
    value = block[panel].values.item()
    unit = str(block[panel].attrs.get("units", ""))
    shown, factor = SHOWN_UNITS.get(unit, (unit, 1.0))
    text = f"{value * factor:.4g} {shown}".strip() if isinstance(value, (int, float)) else str(value).replace("_", " ")
    return f"{panel.replace('_', ' ')}: {text}"
