"""A spectrum, the lines it can be expected to hold by what they come from, and the names of its strongest lines."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.signals.report_parts import name_lines, strongest_lines
from gearmbs.view.figure_style import BLACK, GREEN, GREY, ORANGE, PURPLE, VERMILLION, look, new_figure
from gearmbs.view.signals import spectrum_plot

KINDS = {"mesh": VERMILLION, "sidebands": VERMILLION, "shaft": GREEN, "bearing": PURPLE, "load": ORANGE}
"""Colours by the first word of what lines come from."""

ROW = 0.2
"""Height of a row of ticks, inches."""


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
            colour = KINDS.get(part.split()[0], GREY)
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
    found = name_lines(strongest_lines(spectrum, frequency.size), flat, 1.5 * float(frequency[1] - frequency[0]))
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
