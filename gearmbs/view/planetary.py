"""Faulty teeth of a planetary set: the energy over a turn of each part."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearmbs.signals import PlanetaryReport
from gearmbs.view.figure_style import BLUE, GREY, VERMILLION, label, look, new_figure


def planetary_plot(report: PlanetaryReport, channel: str | None = None, *, title: str | None = None) -> Figure:
    """Draw the energy over a turn of sun, planet and ring, tooth by tooth; the parts that are named stand out.

    Parameters
    ----------
    report : PlanetaryReport
        From `gearmbs.signals.diagnose_planetary`.
    channel : str, optional
        Default the first.
    title : str, optional

    Raises
    ------
    ValueError
        If there is no such channel.
    """
    names = list(dict.fromkeys(f.channel for f in report.findings))
    if channel is not None and channel not in names:
        raise ValueError(f"channel: there is no {channel!r}; choose one of {', '.join(names)}")
    kept = [f for f in report.findings if f.channel == (channel or names[0])]
    with look():
        figure = new_figure(7.0, 2.0 * len(kept))
        axes = figure.subplots(len(kept), 1)
        for ax, finding in zip(np.ravel(axes), kept):
            teeth = np.arange(finding.profile.size) * _teeth(report, finding.part) / finding.profile.size
            colour = BLUE if finding.grade == "none" else VERMILLION
            ax.bar(teeth, finding.profile, width=0.9 * (teeth[1] - teeth[0]), align="edge", color=colour)
            ax.axhline(1.0, color=GREY, linewidth=0.8)
            ax.set_title(f"{finding.part}: {finding.found:.2f} Hz, {finding.grade}", loc="left")
            ax.set_ylabel("energy by mean")
        np.ravel(axes)[-1].set_xlabel(label("tooth of the part, from where the record begins", ""))
        figure.suptitle(title or report.source)
    return figure


def _teeth(report: PlanetaryReport, part: str) -> int:
    return dict(zip(("sun", "planet", "ring"), report.lines.teeth))[part]
