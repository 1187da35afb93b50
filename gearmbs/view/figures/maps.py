"""Maps over two parameters, as of a sensitivity study: every cell a run, every axis named."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.figure import Figure

from gearmbs.view.figures.style import drawn_on, label, look, new_figure

SEQUENTIAL, DIVERGING = "cividis", "PuOr_r"
SHOWN_UNITS = {"m": ("mm", 1e3), "rad": ("°", 180.0 / np.pi), "rad/s": ("rpm", 30.0 / np.pi), "N/m": ("N/µm", 1e-6)}


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
