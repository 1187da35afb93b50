"""A recording: its spectrum, mesh harmonics, and those of a bearing."""

from pathlib import Path

import numpy as np

import gearmbs as gm


def main(folder: Path) -> float:
    """Return the RMS of the first mesh harmonic, in the signal's unit."""
    t = np.arange(0, 2.0, 1 / 12_800)
    values = np.sin(2 * np.pi * 480 * t) + 0.2 * np.random.default_rng(1).standard_normal(t.size)
    np.savetxt(folder / "record.csv", np.column_stack([t, values]), delimiter=",", header="time [s],a [m/s^2]")
    signal = gm.read_signal(folder / "record.csv")
    report = gm.analyse(signal, teeth=24, speed="1200 rpm")
    gm.save(report, folder / "report.html")
    return float(report.harmonics["band"].sel(harmonic=1).max())
