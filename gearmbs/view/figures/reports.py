"""The figures that go with the analysis of a record, of a bearing or planetary set, and with a comparison."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Unpack

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.progress import waiting
from gearmbs.signals import (
    AnalysisReport,
    BearingReport,
    ComparisonReport,
    PlanetaryReport,
    VibrationReport,
    shaft_phase,
    spectrum,
)
from gearmbs.view.figures.charts import comparison_bars
from gearmbs.view.figures.records import average_plot, spectrum_plot
from gearmbs.view.figures.style import (
    BLUE,
    COLOURS,
    GREY,
    VERMILLION,
    drawing,
    label,
    legend_below,
    look,
    new_figure,
)
from gearmbs.view.figures.variable_speed import changing_speed_figures

if TYPE_CHECKING:
    from gearmbs.signals.rotation.keywords import SpeedKeywords

ENVELOPE_TOP, ENVELOPE_ORDERS, LEAKED = 1000.0, 20.0, 2
SEGMENT = 2.0
"""Length of the averaged spectra's segments, s."""


@waiting("drawing figures")
def analysis_figures(
    report: AnalysisReport | VibrationReport, signal: xr.DataArray | None = None, **shaft: Unpack[SpeedKeywords]
) -> dict[str, Figure]:
    """Return the figures of an analysed record.

    Parameters
    ----------
    report : AnalysisReport or VibrationReport
        From `gearmbs.signals.analyse`.
    signal : xarray.DataArray, optional
        The record it was made of, dimensions (time, channel); channels that the report left out are left out. Not
        needed for a report without teeth.
    **shaft
        How the speed is known if it changes and the signal does not say it: ``speed``, ``phase``, ``tacho`` or
        ``speed_channel``, as for `gearmbs.signals.order_track`.

    Returns
    -------
    dict of str to Figure
        "spectrum" with the mesh lines and their first sidebands, and "average" over one revolution if there is one; of
        a report without teeth "spectrum" and, if there is one, "envelope". Where the speed changes, and the record is
        given, instead of the spectrum those of `gearmbs.view.changing_speed_figures`.

    Raises
    ------
    ValueError
        If the signal is needed and not given.
    """
    if isinstance(report, VibrationReport):
        figures = _vibration_figures(report)
        if report.speed_range is not None and signal is not None:
            kept = signal.sel(channel=report.levels["channel"].values)
            changing = changing_speed_figures(kept, title=report.source, phase=shaft_phase(signal, **shaft))
            figures = changing | {name: figures[name] for name in figures if name != "spectrum"}
        return figures
    if signal is None:
        raise ValueError("signal: the figures of a report with teeth need the record it was made of")
    turns = report.speed / (2.0 * math.pi)
    kept = signal.sel(channel=report.harmonics["channel"].values)
    if report.speed_range is not None:
        meshes = [float(h) * report.gmf / turns for h in report.harmonics["harmonic"].values]
        figures = changing_speed_figures(kept, orders=meshes, title=report.source, phase=shaft_phase(signal, **shaft))
        return figures if report.average is None else figures | {"average": _average(report)}
    lines = spectrum(kept, segment=SEGMENT)
    count = report.harmonics.sizes["harmonic"]
    figures = {
        "spectrum": spectrum_plot(
            lines,
            gmf=report.gmf,
            harmonics=count,
            sideband=turns,
            maximum=min((count + 0.6) * report.gmf, float(lines["frequency"][-1])),
            title=f"{report.source}: GMF {report.gmf:.2f} Hz",
        )
    }
    if report.average is not None:
        figures["average"] = _average(report)
    return figures


def _average(report: AnalysisReport) -> Figure:
    """The average over a revolution, a panel a channel."""
    average = report.average
    assert average is not None
    names = [str(c) for c in average["channel"].values]
    return average_plot(
        {name: average[:, [i]] for i, name in enumerate(names)},
        teeth=None if report.indicators is None else int(report.indicators.attrs["teeth"]),
        title=f"{report.source}: average over {average.attrs.get('averages', 1)} revolutions",
    )


@waiting("drawing figures")
def report_plot(
    report: AnalysisReport | VibrationReport | ComparisonReport,
    signal: xr.DataArray | None = None,
    *,
    title: str | None = None,
    **shaft: Unpack[SpeedKeywords],
) -> Figure:
    """Draw the one figure that says most about a report.

    Parameters
    ----------
    report : AnalysisReport, VibrationReport or ComparisonReport
    signal : xarray.DataArray, optional
        The record that an `AnalysisReport` was made of: its spectrum is drawn then, else the average over a revolution,
        or the levels of the mesh harmonics. Where the speed changes its order map is.
    title : str, optional
    **shaft
        As of `analysis_figures`, with the signal.
    """
    if isinstance(report, ComparisonReport):
        figure = next(iter(comparison_figures(report).values()))
    elif isinstance(report, VibrationReport) or signal is not None:
        figures = analysis_figures(report, signal, **shaft)
        # of a record whose speed changes there is no spectrum but an order map
        whole = figures["spectrum"] if "spectrum" in figures else figures["order map"]
        figure = figures.get("envelope", whole) if signal is None else whole
    elif report.average is not None:
        figure = _average(report)
    else:
        figure = _levels(report)
    if title is not None and len(figure.axes) == 1:
        figure.axes[0].set_title(title, loc="left", wrap=True)
    elif title is not None:
        figure.suptitle(title)
    return figure


def _levels(report: AnalysisReport) -> Figure:
    """The RMS of the mesh harmonics of each channel as bars."""
    bands = report.harmonics["band"]
    names = [str(c) for c in bands["channel"].values]
    with look():
        figure = new_figure(6.4, 3.6)
        ax = figure.subplots()
        places = np.arange(bands.sizes["harmonic"])
        for k, (name, colour) in enumerate(zip(names, COLOURS)):
            width = 0.8 / min(len(names), len(COLOURS))
            values = bands.sel(channel=name).values
            ax.bar(places - 0.4 + (k + 0.5) * width, values, width, color=colour, label=name.replace("_", " "))
        ax.set_xticks(places, [f"{int(h)} × GMF" for h in bands["harmonic"].values])
        ax.set_ylabel(label("RMS", bands.attrs.get("units", "")))
        ax.set_title(f"{report.source}: mesh harmonics, GMF {report.gmf:.2f} Hz")
        if len(names) > 1:
            legend_below(ax)
    return figure


def _vibration_figures(report: VibrationReport) -> dict[str, Figure]:
    """The spectrum, and the envelope's spectrum up to some multiples of the shaft's speed or 1 kHz."""
    top = float(report.spectrum["frequency"][-1])
    figures = {"spectrum": spectrum_plot(report.spectrum, maximum=top, title=f"{report.source}: spectrum")}
    if report.envelope is not None:
        shaft = None if report.speed is None or report.speed_range is not None else report.speed / math.tau
        end = min(ENVELOPE_TOP if shaft is None else ENVELOPE_ORDERS * shaft, float(report.envelope["frequency"][-1]))
        # the mean, which is not part of the modulation, leaks into the first lines
        kept = report.envelope.isel(frequency=slice(LEAKED, None))
        figures["envelope"] = spectrum_plot(
            kept, maximum=end, log=False, title=f"{report.source}: envelope of the most impulsive band"
        )
    return figures


@waiting("drawing figures")
def comparison_figures(report: ComparisonReport) -> dict[str, Figure]:
    """Return the bars of a comparison: "bars", or "bars CHANNEL" for each channel where there are several."""
    data = report.data
    if data["experiment"].sizes.get("channel", 1) == 1:
        return {"bars": comparison_bars(data)}
    names = [str(c) for c in data["channel"].values]
    return {f"bars {name}": comparison_bars(data.isel(channel=[i]), title=name) for i, name in enumerate(names)}


# What a diagnosis of rolling bearings saw, as a figure: the envelope's spectrum with the bearings' lines.


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
    with drawing(ax, 7.2, 3.4, legend=4) as (figure, panel):
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
    return figure


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
