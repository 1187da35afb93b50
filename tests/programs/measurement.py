"""A recording: its spectrum, mesh harmonics, and those of a bearing."""

from pathlib import Path

import numpy as np

import gearmbs as gm
from gearmbs.signals import order_map, series, trend
from gearmbs.view import order_map_plot


def main(folder: Path) -> float:
    """Return the RMS of the first mesh harmonic, in the signal's unit."""
    t = np.arange(0, 2.0, 1 / 12_800)
    values = np.sin(2 * np.pi * 480 * t) + 0.2 * np.random.default_rng(1).standard_normal(t.size)
    np.savetxt(folder / "record.csv", np.column_stack([t, values]), delimiter=",", header="time [s],a [m/s^2]")
    signal = gm.read_signal(folder / "record.csv")
    report = gm.analyse(signal, teeth=24, speed="1200 rpm", half_width=0.2, lines=3)
    gm.save(report, folder / "report.html")
    figure = report.plot(signal=signal, title="stage")
    figure.savefig(folder / "report.png")
    orders = order_map(signal, "1200 rpm", revolutions=8.0, scaling="rms")
    order_map_plot(orders, marked=(24,)).savefig(folder / "orders.png")
    trend(folder / "record.csv", "1 s", teeth=24, speed="1200 rpm", units="m/s^2").to_netcdf(folder / "trend.nc")
    series([folder / "record.csv"], teeth=24, speed="1200 rpm", harmonics=2).to_csv(folder / "series.csv")
    return float(report.harmonics["band"].sel(harmonic=1).max())
