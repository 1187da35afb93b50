"""One revolution of a shaft: the time-synchronous averages of several states above each other."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gearmbs.view.bars import state_colour
from gearmbs.view.figure_style import GREY, drawn_on, label, look, new_figure
from gearmbs.view.signals import quantity

SHAFT_ORDERS = 6
"""Up to this order a strong line is the shaft's own, of unbalance, misalignment or a coupling."""
MESH_SHARE, NO_SHARE = 0.3, 0.01
"""Parts of the power of a line that is certainly the mesh, and of those that are certainly none."""
MOST_TICKS = 60
"""More teeth than this are not marked one by one."""


def average_plot(
    averages: xr.DataArray | Mapping[str, xr.DataArray],
    *,
    teeth: int | None = None,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw time-synchronous averages over a revolution, one panel for each state, all with the same axes.

    A local fault shows as a disturbance at one place of the revolution, which a healthy pair does not have.

    Parameters
    ----------
    averages : xarray.DataArray or mapping of name to xarray.DataArray
        Dimension angle (revolutions), optionally channel of length one, as
        `gearmbs.signals.time_synchronous_average` makes them and an `AnalysisReport` holds them.
    teeth : int, optional
        Teeth of the wheel on that shaft: the axis counts them. Default: revolutions. Of averages that know the numbers
        of the teeth (``tooth_numbers``, those of simulated pairs) it is the tooth on the line of centres, and runs
        from the highest to the lowest number where they pass in this order; of others pitches from where the angle
        begins, which the label says.
    title : str, optional
    ax : matplotlib axes, optional
        For a single average.

    Warns
    -----
    UserWarning
        Where `teeth` are none of those that an average knows, or its mesh has another number of periods.

    Raises
    ------
    ValueError
        If there is no average, no angle, more than one channel, or `teeth` is no whole number.
    """
    named = averages if isinstance(averages, Mapping) else {"": averages}
    if not named:
        raise ValueError("averages: empty; give at least one average")
    curves = {str(name): _curve(str(name), average) for name, average in named.items()}
    if teeth is not None:
        if isinstance(teeth, bool) or int(teeth) != teeth or teeth < 1:
            raise ValueError(f"teeth: must be a whole number of teeth, got {teeth!r}")
        for name, average in named.items():
            if doubt := _doubt(average, curves[str(name)][:2], teeth):
                warnings.warn(f"teeth={teeth}: {doubt}{f' ({name})' if name else ''}", UserWarning, stacklevel=2)
    if ax is not None and len(curves) > 1:
        raise ValueError(f"ax: one panel for {len(curves)} averages; give one or leave ax away")
    with look():
        if ax is not None:
            figure, panel = drawn_on(ax)
            panels = [panel]
        else:
            figure = new_figure(7.2, 1.0 + 1.7 * len(curves))
            panels = list(figure.subplots(len(curves), 1, sharex=True, sharey=True, squeeze=False)[:, 0])
        numbers = _numbers(named.values(), teeth)
        for k, (panel, (name, (angle, values, unit))) in enumerate(zip(panels, curves.items())):
            x = angle * (teeth or 1)
            if numbers is not None:
                x = (numbers[k][1] + numbers[k][2] * x) % numbers[k][0]
                x, values = (column[np.argsort(x)] for column in (x, values))
            panel.plot(x, values, color=state_colour(name, k), linewidth=0.9)
            panel.set_ylabel(label(quantity(list(named.values())[k], unit, "average"), unit))
            if name:
                panel.set_title(name, fontsize=10)
            panel.margins(x=0)
            if teeth is not None:
                panel.xaxis.set_major_locator(MaxNLocator(integer=True))
            if teeth is not None and teeth * angle[-1] <= MOST_TICKS:
                panel.set_xticks(np.arange(0, round(teeth * angle[-1]) + 1), minor=True)
                panel.grid(visible=True, axis="x", which="minor", color=GREY, alpha=0.25, linewidth=0.5)
        panels[-1].set_xlabel(_axis(named.values(), teeth, numbers))
        if numbers is not None and numbers[0][2] < 0:
            panels[-1].invert_xaxis()
        if title and len(panels) == 1:
            panels[0].set_title(title, wrap=True)
        elif title:
            figure.suptitle(title)
    return figure


def _doubt(average: xr.DataArray, curve: tuple[np.ndarray, np.ndarray], teeth: int) -> str | None:
    """Say why an average is not of a wheel with so many teeth; None if nothing speaks against it."""
    known = average.attrs.get("teeth")
    if known is not None and teeth not in np.ravel(known):
        return f"the average is of a pair with {', '.join(str(z) for z in np.ravel(known))} teeth"
    angle, values = curve
    power = np.abs(np.fft.rfft(values)) ** 2
    total = float(power[1:].sum())
    if angle[-1] >= 1.0 or total == 0.0:
        return None
    strongest = 1 + int(np.argmax(power[1:]))
    own = float(power[teeth::teeth].sum())
    if strongest > SHAFT_ORDERS and power[strongest] > MESH_SHARE * total and own < NO_SHARE * total:
        return f"its strongest line has {strongest} periods a revolution, and there is none of {teeth} or a multiple"
    return None


def _numbers(averages: Iterable[xr.DataArray], teeth: int | None) -> list[tuple[int, float, int, str]] | None:
    """Return tooth count, number at angle 0 and step of each average, if all know them of this wheel, alike."""
    found = [average.attrs.get("tooth_numbers") for average in averages]
    single = all(float(average["angle"].values[-1]) < 1.0 for average in averages)
    known = single and all(one is not None and one[0] == teeth for one in found)
    return found if known and len({one[2:] for one in found}) == 1 else None  # type: ignore[return-value, index]


def _axis(
    averages: Iterable[xr.DataArray], teeth: int | None, numbers: list[tuple[int, float, int, str]] | None
) -> str:
    """Return the label of the axis: what it counts, and from where."""
    if numbers is not None:
        return f"tooth of the {numbers[0][3]} in mesh, 0 to {numbers[0][0] - 1}"
    origins = sorted({str(average.attrs.get("angle_origin", "angle 0")) for average in averages})
    where = f"from {origins[0]}" if len(origins) == 1 else "each from its own start"
    return f"revolution, {where}" if teeth is None else f"pitches {where}, {teeth} teeth"


def _curve(name: str, average: xr.DataArray) -> tuple[np.ndarray, np.ndarray, str]:
    """Return angle in revolutions, values without their mean, and unit."""
    if not isinstance(average, xr.DataArray) or "angle" not in average.dims:
        found = average.dims if isinstance(average, xr.DataArray) else type(average).__name__
        raise ValueError(f"averages: {name or 'it'} needs a DataArray with the dimension 'angle', got {found}")
    if average.size != average.sizes["angle"]:
        names = [str(c) for c in average["channel"].values] if "channel" in average.coords else average.dims
        raise ValueError(f"averages: {name or 'it'} has several channels {names}; select one, average[:, [0]]")
    values = np.asarray(average.values, dtype=float).ravel()
    unit = str(average.attrs.get("units", ""))
    if "units" in average.coords and average.coords["units"].size == 1:
        unit = str(np.ravel(average.coords["units"].values)[0])
    return np.asarray(average["angle"].values, dtype=float), values - values.mean(), unit
