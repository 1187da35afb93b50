"""Figures without global state: colours everyone can tell apart, one look for all plots, whole files only."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.files import whole_file

BLUE, ORANGE, GREEN, VERMILLION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, YELLOW, BLACK = "#56B4E9", "#CC79A7", "#F0E442", "#222222"
GREY = "#8A8F98"
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION, BLACK, YELLOW)
"""Palette of Okabe and Ito, distinguishable under the common forms of colour blindness."""

DPI = 200

LOOK: Any = {
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.labelsize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#DADDE2",
    "grid.linewidth": 0.7,
    "axes.edgecolor": "#555555",
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "lines.linewidth": 1.3,
    "svg.hashsalt": "gearmbs",
    "svg.fonttype": "path",
}

LEGEND_LETTERS, LEGEND_HANDLE = 84, 8
"""Letters that fit side by side under axes of the usual width, and the space taken by the line before each name."""

UNITS = {
    "m/s^2": "m/s²",
    "m s^-2": "m/s²",
    "m/s": "m/s",
    "N m": "N m",
    "um": "µm",
    "dimensionless": "",
    "1": "",
    "mixed": "",
    "unknown": "unknown unit",
}


class Picture(Figure):
    """A matplotlib figure that shows itself in notebooks without any backend being chosen."""

    def _repr_png_(self) -> bytes:
        return png_bytes(self, dpi=110)


@contextmanager
def look() -> Iterator[None]:
    """Apply the common look while a figure is made, and nothing of it afterwards."""
    with matplotlib.rc_context(LOOK):
        yield


def new_figure(width: float = 6.4, height: float = 4.0) -> Picture:
    """Return an empty figure, size in inches, that lays itself out."""
    return Picture(figsize=(width, height), layout="constrained")


def drawn_on(ax: Axes | None, width: float = 6.4, height: float = 4.0) -> tuple[Figure, Axes]:
    """Return the figure and axes to draw on: the caller's, or new ones."""
    if ax is None:
        figure = new_figure(width, height)
        return figure, figure.subplots()
    owner = ax.get_figure(root=True)
    if owner is None:
        raise ValueError("ax: these axes belong to no figure; make them with Figure.subplots()")
    return owner, ax


def unit_text(unit: object) -> str:
    """Return a unit as it is written in a label."""
    text = str(unit or "").strip()
    return UNITS.get(text, text.replace("^2", "²").replace("^3", "³"))


def label(quantity: str, unit: object = "") -> str:
    """Return an axis label, quantity and unit."""
    text = unit_text(unit)
    return f"{quantity}, {text}" if text else quantity


SCALINGS = {"amplitude": "peak amplitude", "rms": "RMS", "power": "mean square", "density": "power density"}


def scaling_name(scaling: object) -> str:
    """Return what the values of a spectrum are, by its attribute ``scaling``: of a sine its peak, its RMS and so on."""
    return SCALINGS.get(str(scaling or "amplitude"), str(scaling))


def legend_below(ax: Axes, columns: int = 3) -> None:
    """Put the legend under the axes where it hides no data."""
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        longest = max(len(str(text)) for text in labels) + LEGEND_HANDLE
        fitting = max(1, min(columns, LEGEND_LETTERS // longest))
        ax.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=fitting)


def png_bytes(figure: Figure, dpi: float = DPI) -> bytes:
    """Return a figure as a PNG image."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def save_figure(figure: Figure, stem: str | Path, *, dpi: float = DPI) -> list[Path]:
    """Write a figure as PNG and SVG; a file appears under its name only when it is whole.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    stem : path
        Path without the ending.
    dpi : float
        Resolution of the PNG, dots per inch.

    Returns
    -------
    list of Path
        The PNG and the SVG.
    """
    paths = [Path(f"{stem}.png"), Path(f"{stem}.svg")]
    with look():
        with whole_file(paths[0]) as part:
            figure.savefig(part, format="png", dpi=dpi)
        with whole_file(paths[1]) as part:
            figure.savefig(part, format="svg", metadata={"Date": None})
    return paths


# Bar charts of the mesh harmonics: the paper's Figures 5 and 7, and experiment beside model.


STATE_COLOURS = {"healthy": BLUE, "misaligned": ORANGE, "distance": GREEN}
HATCHES = ("", "///", "...", "xxx", "\\\\\\", "++")
GROUP = 0.8
"""Width of a group of bars; groups stand 1 apart."""


def gmf_bars(
    table: xr.DataArray,
    *,
    title: str | None = None,
    ax: Axes | None = None,
    unit: str | None = None,
    values: bool = True,
    log: bool = False,
) -> Figure:
    """Draw the RMS of the gear mesh harmonics of several states, as the paper's Figures 5 and 7 do.

    Parameters
    ----------
    table : xarray.DataArray, dims (state, harmonic)
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

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If dimensions are missing or a value is negative or not finite.
    """
    table = checked_table(table, "table", ("state", "harmonic"))
    with look():
        figure, ax = drawn_on(ax, 6.4, 4.2)
        states = [str(s) for s in table.state.values]
        bars(ax, table, "state", [state_colour(s, k) for k, s in enumerate(states)], state_labels(table), values, log)
        harmonic_axis(ax, table)
        ax.set_ylabel(label(rms_name(table), unit or table.attrs.get("units", "")))
        if title:
            ax.set_title(title, wrap=True)
        legend_below(ax)
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
    ax: Axes, table: xr.DataArray, dim: str, colours: list[str], labels: list[str], values: bool, log: bool
) -> None:
    """Draw one bar for each ``dim`` in each group along the other dimension; missing values are left out."""
    data = np.asarray(table.transpose(dim, ...).values, dtype=float)
    count, groups = data.shape
    width = GROUP / count
    top = np.nanmax(data) if np.isfinite(data).any() else 1.0
    for k in range(count):
        at = np.arange(groups) + (k - 0.5 * (count - 1)) * width
        drawn = ax.bar(at, data[k], width, label=labels[k], color=colours[k], edgecolor="white", linewidth=0.8)
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


def state_colour(state: str, index: int) -> str:
    """Return the colour of a state, the same in every figure."""
    return STATE_COLOURS.get(state, COLOURS[index % len(COLOURS)])


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
