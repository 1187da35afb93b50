"""Signals and what is read from them: time histories, spectra with lines, order spectra, transmission errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gearmbs.progress import waiting
from gearmbs.signals.analysis.report import name_lines, strongest_lines
from gearmbs.view.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    drawn_on,
    label,
    look,
    new_figure,
    scaling_name,
    state_colour,
)
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.signals.encoders.result import MeasuredTransmissionError

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


# A spectrum, the lines it can be expected to hold by what they come from, and the names of its strongest lines.


LINE_COLOURS = {"mesh": VERMILLION, "sidebands": VERMILLION, "shaft": GREEN, "bearing": PURPLE, "load": ORANGE}
"""Colours by the first word of what lines come from."""

ROW = 0.2
"""Height of a row of ticks, inches."""


LOCKED = ("mesh ", "sidebands ", "shaft ")
"""Beginnings of what lines are of that turn with the shafts."""


def named_lines_plot(
    spectrum: xr.DataArray,
    known: Mapping[str, Mapping[str, float]],
    *,
    count: int = 10,
    maximum: float | None = None,
    title: str | None = None,
) -> Figure:
    """Draw a spectrum, below it the lines it can be expected to hold, and name the strongest that are among them.

    Parameters
    ----------
    spectrum : xarray.DataArray
        Dimensions frequency (Hz) and channel, with one channel.
    known : mapping of str to mapping of str to float
        Frequencies (Hz) by name, by what they come from; `gearmbs.drivetrain.KinematicTable.lines_by_part` gives it.
        One row of ticks each; lines of "mesh ..." are drawn through the spectrum, too.
    count : int
        Lines named at most.
    maximum : float, optional
        Highest frequency shown, Hz.
    title : str, optional

    Raises
    ------
    ValueError
        If the spectrum has several channels, or nothing is known.
    """
    if spectrum.sizes.get("channel") != 1:
        raise ValueError(f"spectrum: {spectrum.sizes.get('channel', 'no')} channels; select one, sel(channel=[...])")
    top = float(spectrum["frequency"][-1]) if maximum is None else float(maximum)
    # lines below the resolution are not to be seen
    least = float(spectrum["frequency"][1])
    rows = {part: [at for at in lines.values() if least <= at <= top] for part, lines in known.items()}
    rows = {part: places for part, places in rows.items() if places}
    if not rows:
        raise ValueError(f"known: no line between {least:g} and {top:g} Hz")
    with look():
        figure = new_figure(9.6, 3.9 + ROW * len(rows))
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3.3, ROW * len(rows) + 0.1))
        spectrum_plot(spectrum, maximum=top, title=title, ax=upper)
        upper.set_xlabel("")
        for k, (part, places) in enumerate(rows.items()):
            colour = LINE_COLOURS.get(part.split()[0], GREY)
            lower.vlines(places, k - 0.35, k + 0.35, color=colour, linewidth=1.2)
            if part.startswith("mesh "):
                upper.vlines(places, 0.0, 1.0, transform=upper.get_xaxis_transform(), color=colour, linewidth=0.8,
                             linestyle=(0, (4, 3)), zorder=0.5)  # fmt: skip
        lower.set_yticks(range(len(rows)), list(rows), fontsize=8)
        lower.set_ylim(len(rows) - 0.4, -0.6)
        lower.set_xlabel("frequency, Hz")
        _name_strongest(upper, spectrum.sel(frequency=slice(None, top)), known, count)
    return figure


def _name_strongest(ax: Axes, spectrum: xr.DataArray, known: Mapping[str, Mapping[str, float]], count: int) -> None:
    """Number the strongest known lines at their peaks, and list their names beside the axes."""
    frequency = spectrum["frequency"].values
    flat = {name: at for lines in known.values() for name, at in lines.items() if at > 0.0}
    # what is locked to the rotation is where it is said to be; bearings, which slip, have many lines that fall upon it
    locked = {name for part, lines in known.items() if part.startswith(LOCKED) for name in lines}
    within = 1.5 * float(frequency[1] - frequency[0])
    found = name_lines(strongest_lines(spectrum, frequency.size), flat, within, locked)
    chosen = found[found.of != ""].drop_duplicates("of").head(count).sort_values("frequency")
    at, height, offset, texts = -np.inf, 0.0, 0.0, []
    for number, line in enumerate(chosen.itertuples(), start=1):
        # numbers of neighbours stand above each other
        beside = line.frequency - at < 0.018 * frequency[-1] and 0.5 * height < line.rms < 2.0 * height
        at, height, offset = line.frequency, line.rms, offset + 9.0 if beside else 0.0
        ax.plot([line.frequency], [line.rms], "o", color=BLACK, markersize=3)
        ax.annotate(f"{number}", (line.frequency, line.rms), xytext=(0.0, 3.0 + offset), textcoords="offset points",
                    ha="center", va="bottom", fontsize=8, color=BLACK,
                    bbox={"boxstyle": "square,pad=0.05", "facecolor": "white", "edgecolor": "none"})  # fmt: skip
        texts.append(f"{number:>2}  {line.frequency:.4g} Hz  {line.of}")
    ax.annotate("\n".join(texts), (1.01, 1.0), xycoords="axes fraction", va="top", fontsize=8, linespacing=1.4)


# One revolution of a shaft: the time-synchronous averages of several states above each other.


SHAFT_ORDERS = 6
"""Up to this order a strong line is the shaft's own, of unbalance, misalignment or a coupling."""
MESH_SHARE, NO_SHARE = 0.3, 0.01
"""Parts of the power of a line that is certainly the mesh, and of those that are certainly none."""
MOST_TICKS = 60
"""More teeth than this are not marked one by one."""


def average_plot(
    averages: xr.DataArray | Mapping[str, xr.DataArray] | None,
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
    if averages is None:
        raise ValueError("averages: None, so the report has none; its `missing` says why")
    named = averages if isinstance(averages, Mapping) else {"": averages}
    if not named:
        raise ValueError("averages: empty; give at least one average")
    curves = {str(name): _curve(str(name), average) for name, average in named.items()}
    if teeth is not None:
        if isinstance(teeth, bool) or int(teeth) != teeth or teeth < 1:
            raise ValueError(f"teeth: must be a whole number of teeth, got {teeth!r}")
        for name, average in named.items():
            if doubt := _doubt(average, curves[str(name)][:2], teeth):
                warn(f"teeth={teeth}: {doubt}{f' ({name})' if name else ''}", UserWarning)
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


MICRO = 1e6
"""Micrometres of a metre."""
MOST_HARMONICS = 12


@waiting("drawing figures")
def measured_error_plot(
    error: MeasuredTransmissionError, load: str | None = None, *, title: str | None = None
) -> Figure:
    """Draw a transmission error from pulses.

    Above what recurs with each turn of the shafts; below the mesh harmonics with their intervals, open where only the
    marks' level is known, and, with the teeth known, the errors tooth by tooth.

    Parameters
    ----------
    error : MeasuredTransmissionError
        From `gearmbs.signals.transmission_error_from_pulses`.
    load : str, optional
        Default: the first.
    title : str, optional
    """
    with look():
        shafts = ("driver", "driven") if error.teeth is not None else ()
        figure = new_figure(9.0, 3.2 * (2 + bool(shafts)))
        grid = figure.add_gridspec(2 + bool(shafts), 2)
        for column, shaft in enumerate(("driver", "driven")):
            axes = figure.add_subplot(grid[0, column])
            angle, values = error.curve(load, shaft)
            axes.plot(angle, MICRO * values, color=(BLUE, ORANGE)[column], linewidth=0.9)
            axes.set(
                xlabel=f"turns of the {shaft} from mark 0", ylabel=label("transmission error", "µm"), xlim=(0.0, 1.0)
            )
            axes.set_title(f"Recurring with the {shaft}")
        axes = figure.add_subplot(grid[1, :])
        table = error.harmonics(load).head(MOST_HARMONICS)
        for sure, colour, words in ((True, BLUE, "marks known"), (False, GREY, "marks within their level")):
            some = table[table["calibrated"] == sure]
            if len(some):
                reach = MICRO * np.abs(some[["low", "high"]].to_numpy().T - some["amplitude"].to_numpy())
                axes.bar(some["harmonic"], MICRO * some["amplitude"], color=colour, label=words, width=0.6)
                axes.errorbar(
                    some["harmonic"], MICRO * some["amplitude"], yerr=reach, fmt="none", ecolor="#222222", capsize=4.0
                )
        axes.set(xlabel="mesh harmonic", ylabel=label("peak amplitude", "µm"), xticks=table["harmonic"])
        axes.set_title(f"Mesh harmonics with intervals of {100 * error.probability:g} %")
        axes.legend(loc="upper right")
        for column, shaft in enumerate(shafts):
            axes = figure.add_subplot(grid[2, column])
            teeth = error.tooth_errors(shaft, load)
            within = MICRO * float(teeth["within"].iloc[0])
            colours = [VERMILLION if out else (BLUE, ORANGE)[column] for out in teeth["stands_out"]]
            axes.axhspan(-within, within, color="#DADDE2", label=f"known to ±{within:.2g} µm")
            axes.bar(teeth["tooth"], MICRO * teeth["error"], color=colours)
            known = error.tooth_at_zero[column] is not None
            axes.set(
                xlabel=f"tooth of the {shaft}" if known else f"tooth of the {shaft}, from the one at mark 0",
                ylabel=label("error", "µm"),
            )
            axes.set_title("Tooth by tooth")
            axes.legend(loc="best")
        words = f"Transmission error from {error.source}{f' ({load})' if len(error.loads) > 1 else ''}"
        figure.suptitle(title or words, x=0.01, ha="left")
    return figure
