"""The figure of a transmission error from pulses: over the angle, by mesh harmonic with intervals, tooth by tooth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from gearmbs.progress import waiting
from gearmbs.view.figures.style import BLUE, GREY, ORANGE, VERMILLION, label, look, new_figure

if TYPE_CHECKING:
    from gearmbs.signals.encoders.result import MeasuredTransmissionError

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
        axes.set(xlabel="mesh harmonic", ylabel=label("amplitude", "µm"), xticks=table["harmonic"])
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
