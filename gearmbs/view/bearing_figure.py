"""What a diagnosis of rolling bearings saw, as a figure: the envelope's spectrum with the bearings' lines."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.signals import BearingReport
from gearmbs.view.figure_style import COLOURS, GREY, VERMILLION, drawn_on, legend_below, look

SHOWN = 3
"""Harmonics marked of every part."""


def bearing_plot(
    report: BearingReport, *, channel: str | None = None, title: str | None = None, ax: Axes | None = None
) -> Figure:
    """Draw the spectrum of the squared envelope with the lines of the bearings' parts.

    Parameters
    ----------
    report : BearingReport
        From `gearmbs.signals.diagnose_bearing`.
    channel : str, optional
        Default that of the strongest finding, or the first.
    title : str, optional
    ax : matplotlib axes, optional

    Returns
    -------
    Figure
        Broken lines are kinematic, drawn through where the part is named, and then at the frequency found.

    Raises
    ------
    ValueError
        If there is no such channel.
    """
    names = list(report.spectra)
    if channel is None:
        channel = report.accused[0].channel if report.accused else names[0]
    if channel not in names:
        raise ValueError(f"channel: there is no {channel!r}, only {names}")
    spectrum = report.spectra[channel]
    top = float(spectrum["frequency"].iloc[-1])
    named = {(f.bearing, f.part): f.found for f in report.accused if f.channel == channel}
    with look():
        figure, panel = drawn_on(ax, 7.2, 3.4)
        panel.plot(spectrum["frequency"], spectrum["power"], color=GREY, linewidth=0.8)
        for number, lines in enumerate(report.bearings):
            for k, (part, order) in enumerate(lines.orders.items()):
                found = named.get((lines.name, part))
                place = order * lines.ratio * report.shaft if found is None else found
                colour = VERMILLION if found is not None else COLOURS[k % len(COLOURS)]
                style = "-" if found is not None else [":", "--", "-."][number % 3]
                text = part if len(report.bearings) == 1 else f"{part}, {lines.name}"
                for harmonic in range(1, SHOWN + 1):
                    if harmonic * place <= top:
                        panel.axvline(
                            harmonic * place, color=colour, linestyle=style, linewidth=1.0, zorder=0,
                            label=text if harmonic == 1 else None,
                        )  # fmt: skip
        panel.set_xlim(0.0, top)
        panel.set_ylim(bottom=0.0)
        panel.set_xlabel("frequency, Hz")
        panel.set_ylabel("power by its neighbourhood")
        panel.set_title(title or f"{report.source}, {channel}: squared envelope", wrap=True)
        legend_below(panel, 4)
    return figure
