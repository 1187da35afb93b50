"""The figures that go with an analysis and with a comparison."""

from __future__ import annotations

import math

import xarray as xr
from matplotlib.figure import Figure

from gearmbs.signals import AnalysisReport, ComparisonReport, spectrum
from gearmbs.view.bars import comparison_bars
from gearmbs.view.revolution import average_plot
from gearmbs.view.signals import spectrum_plot

SEGMENT = 2.0
"""Length of the averaged spectra's segments, s."""


def analysis_figures(report: AnalysisReport, signal: xr.DataArray) -> dict[str, Figure]:
    """Return the figures of an analysed record.

    Parameters
    ----------
    report : AnalysisReport
        From `gearmbs.signals.analyse`.
    signal : xarray.DataArray
        The record it was made of, dimensions (time, channel); channels that the report left out are left out.

    Returns
    -------
    dict of str to Figure
        "spectrum" with the mesh lines and their first sidebands, and "average" over one revolution if there is one.
    """
    shaft = report.speed / (2.0 * math.pi)
    kept = signal.sel(channel=report.harmonics["channel"].values)
    lines = spectrum(kept, segment=SEGMENT)
    count = report.harmonics.sizes["harmonic"]
    figures = {
        "spectrum": spectrum_plot(
            lines,
            gmf=report.gmf,
            harmonics=count,
            sideband=shaft,
            maximum=min((count + 0.6) * report.gmf, float(lines["frequency"][-1])),
            title=f"{report.source}: GMF {report.gmf:.2f} Hz",
        )
    }
    if report.average is not None:
        names = [str(c) for c in report.average["channel"].values]
        own = None if report.indicators is None else int(report.indicators.attrs["teeth"])
        figures["average"] = average_plot(
            {name: report.average[:, [i]] for i, name in enumerate(names)},
            teeth=own,
            title=f"{report.source}: average over {report.average.attrs.get('averages', 1)} revolutions",
        )
    return figures


def comparison_figures(report: ComparisonReport) -> dict[str, Figure]:
    """Return the bars of a comparison: "bars", or "bars CHANNEL" for each channel where there are several."""
    data = report.data
    if data["experiment"].sizes.get("channel", 1) == 1:
        return {"bars": comparison_bars(data)}
    names = [str(c) for c in data["channel"].values]
    return {f"bars {name}": comparison_bars(data.isel(channel=[i]), title=name) for i, name in enumerate(names)}
