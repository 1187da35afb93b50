"""Signals and what is read from them: time histories, spectra with mesh lines, order spectra."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.view.figure_style import BLUE, VERMILLION, drawn_on, label, look, new_figure, scaling_name

MAX_POINTS = 20_000
"""More points than this in a line are drawn as the envelope of minima and maxima."""

KINDS = {"m/s^2": "acceleration", "m/s": "velocity", "m": "displacement", "N": "force", "N m": "torque", "V": "voltage"}


def time_plot(
    signal: xr.DataArray,
    *,
    start: float | None = None,
    stop: float | None = None,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw a signal against time, one panel a channel.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimension time (s), optionally channel; units in ``attrs["units"]`` or a ``units`` coordinate of the channels.
    start, stop : float, optional
        Part to show, s.
    title : str, optional
    ax : matplotlib axes, optional
        For a signal of one channel.

    Raises
    ------
    ValueError
        If there is no time dimension, nothing between start and stop, or ``ax`` with several channels.
    """
    columns = _columns(signal, "time")
    t = np.asarray(signal["time"].values, dtype=float)
    inside = (t >= (-np.inf if start is None else start)) & (t < (np.inf if stop is None else stop))
    if not inside.any():
        raise ValueError(
            f"start, stop: no sample between {start} and {stop} s; the signal spans {t[0]:g} to {t[-1]:g} s"
        )
    with look():
        figure, panels = _panels(len(columns), ax, 1.9)
        for panel, (name, unit, values) in zip(panels, columns):
            panel.plot(*thinned(t[inside], values[inside]), color=BLUE, linewidth=0.9)
            panel.set_ylabel(label(quantity(signal, unit), unit))
            _name(panel, name, len(columns))
            panel.margins(x=0)
        panels[-1].set_xlabel("time, s")
        _title(figure, panels, title)
    return figure


def spectrum_plot(
    spectrum: xr.DataArray,
    *,
    gmf: float | None = None,
    harmonics: int = 3,
    sideband: float | None = None,
    maximum: float | None = None,
    log: bool = True,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw a spectrum against frequency with the mesh lines marked, one panel a channel.

    Parameters
    ----------
    spectrum : xarray.DataArray
        Dimension frequency (Hz), optionally channel, as `gearmbs.signals.spectrum` returns.
    gmf : float, optional
        Gear mesh frequency, Hz; its first ``harmonics`` multiples are marked.
    sideband : float, optional
        Shaft frequency, Hz: the first sidebands of each multiple are marked too.
    maximum : float, optional
        Highest frequency shown, Hz.
    log : bool
        Logarithmic amplitude, over at most 120 dB.

    Raises
    ------
    ValueError
        If there is no frequency dimension, or ``gmf`` is not positive.
    """
    if gmf is not None and not gmf > 0.0:
        raise ValueError(f"gmf is {gmf} Hz; give a positive frequency")
    return _lines(spectrum, "frequency", "frequency, Hz", gmf, "GMF", harmonics, sideband, maximum, log, title, ax)


def order_plot(
    spectrum: xr.DataArray,
    *,
    teeth: int | None = None,
    harmonics: int = 3,
    sideband: float | None = 1.0,
    maximum: float | None = None,
    log: bool = True,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw an order spectrum with the mesh orders marked, one panel a channel.

    Parameters
    ----------
    spectrum : xarray.DataArray
        Dimension order (multiples of the shaft's speed), optionally channel; `gearmbs.signals.order_spectrum` makes it.
    teeth : int, optional
        Teeth on that shaft: the mesh order.
    sideband : float, optional
        Distance of the marked sidebands, orders.
    harmonics, maximum, log, title, ax
        As for `spectrum_plot`, in orders.
    """
    if teeth is not None and not teeth > 0:
        raise ValueError(f"teeth is {teeth}; give the tooth count of the wheel on that shaft")
    mesh = None if teeth is None else float(teeth)
    return _lines(
        spectrum, "order", "order of the shaft's speed", mesh, "mesh", harmonics, sideband, maximum, log, title, ax
    )


def quantity(signal: xr.DataArray, unit: str, default: str = "value") -> str:
    """Return what a signal is in words: what it says itself (attribute ``quantity``), or what its unit means."""
    own = signal.attrs.get("quantity") if unit == "m/s^2" else None
    return str(own) if own else KINDS.get(unit, default)


def thinned(x: np.ndarray, y: np.ndarray, points: int = MAX_POINTS) -> tuple[np.ndarray, np.ndarray]:
    """Return a line of at most about ``points`` points that shows the same extremes."""
    if x.size <= points:
        return x, y
    size = int(np.ceil(2 * x.size / points))
    count = x.size // size
    blocks = y[: count * size].reshape(count, size)
    rest = slice(count * size, None)
    pair = np.stack([blocks.min(axis=1), blocks.max(axis=1)], axis=1).ravel()
    at = np.repeat(x[: count * size : size], 2)
    return np.concatenate([at, x[rest]]), np.concatenate([pair, y[rest]])


def _lines(spectrum, dim, xlabel, mesh, mesh_name, harmonics, sideband, maximum, log, title, ax) -> Figure:
    columns = _columns(spectrum, dim)
    x = np.asarray(spectrum[dim].values, dtype=float)
    top = float(x[-1]) if maximum is None else float(maximum)
    shown = x <= top
    if shown.sum() < 2:
        raise ValueError(f"maximum is {maximum}; the {dim} axis spans {x[0]:g} to {x[-1]:g}")
    scaling = scaling_name(spectrum.attrs.get("scaling"))
    with look():
        figure, panels = _panels(len(columns), ax, 2.5)
        for panel, (name, unit, values) in zip(panels, columns):
            panel.plot(*thinned(x[shown], values[shown]), color=BLUE, linewidth=0.9)
            panel.set_ylabel(label(scaling, unit))
            _name(panel, name, len(columns))
            panel.set_xlim(0.0, top)
            peak = float(np.nanmax(values[shown], initial=0.0))
            if log and peak > 0.0:
                panel.set_yscale("log")
                least = values[shown][values[shown] > 0.0].min()
                panel.set_ylim(max(0.5 * least, 1e-6 * peak), 4.0 * peak)
            if mesh is not None:
                _mark(panel, mesh, mesh_name, harmonics, sideband, top)
        panels[-1].set_xlabel(xlabel)
        _title(figure, panels, title)
    return figure


def _mark(ax: Axes, mesh: float, name: str, harmonics: int, sideband: float | None, top: float) -> None:
    """Mark the mesh lines at the top edge, and their sidebands by short ticks."""
    for k in range(1, harmonics + 1):
        if k * mesh > top:
            break
        ax.axvline(k * mesh, color=VERMILLION, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0.5)
        ax.annotate(
            f"{k}× {name}",
            (k * mesh, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(3, -2),
            textcoords="offset points",
            va="top",
            fontsize=8,
            color=VERMILLION,
        )
        if sideband:
            sides = [s for s in (k * mesh - sideband, k * mesh + sideband) if 0.0 < s < top]
            ax.vlines(sides, 0.0, 0.06, transform=ax.get_xaxis_transform(), color=VERMILLION, linewidth=0.8)


def _columns(data: xr.DataArray, dim: str) -> list[tuple[str, str, np.ndarray]]:
    """Return name, unit and values of each channel."""
    if not isinstance(data, xr.DataArray) or dim not in data.dims:
        found = data.dims if isinstance(data, xr.DataArray) else type(data).__name__
        raise ValueError(f"data: needs a DataArray with a {dim!r} dimension, got {found}")
    others = [str(d) for d in data.dims if d != dim]
    if len(others) > 1:
        raise ValueError(f"data: dimensions {others} beside {dim!r}; select until at most one is left")
    if data.sizes[dim] < 2:
        raise ValueError(f"data: only {data.sizes[dim]} value(s) along {dim!r}; at least 2 make a line")
    values = np.asarray(data.transpose(dim, ...).values, dtype=float).reshape(data.sizes[dim], -1)
    names = [str(v) for v in data[others[0]].values] if others else [""]
    units = [str(data.attrs.get("units", ""))] * len(names)
    if others and "units" in data.coords and data["units"].dims == (others[0],):
        units = [str(u) for u in data["units"].values]
    return [(name, unit, values[:, k]) for k, (name, unit) in enumerate(zip(names, units))]


def _panels(count: int, ax: Axes | None, height: float) -> tuple[Figure, list[Axes]]:
    if ax is not None:
        if count > 1:
            raise ValueError(f"ax: one panel for {count} channels; select a channel or leave ax away")
        figure, panel = drawn_on(ax)
        return figure, [panel]
    figure = new_figure(7.2, 0.9 + height * count if count > 1 else 3.2)
    return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])


def _name(ax: Axes, name: str, count: int) -> None:
    if name and count > 1:
        ax.set_title(name.replace("_", " "), fontsize=10)


def _title(figure: Figure, panels: list[Axes], title: str | None) -> None:
    if title and len(panels) == 1:
        panels[0].set_title(title, wrap=True)
    elif title:
        figure.suptitle(title)
