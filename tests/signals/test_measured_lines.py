"""The mesh line of measured records, from a small extract of them: their strongest lines in noise.

`measured_lines.csv` holds sixty lines of each record; noise stands for the rest, with the rest's RMS. The records
themselves are analysed in `test_analysis.py` where their folder is at hand.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import analyse, make_signal

LINES = pd.read_csv(Path(__file__).parent / "measured_lines.csv", comment="#").groupby("record")
RATE, TEETH, DURATION = 12800.0, 32, 6.9
RECORDS = {"h30hz0": (952.15, 5.946), "h30hz90": (948.05, 8.244), "b30hz0": (952.1, 3.554), "b30hz90": (948.0, 5.255)}
"""Mesh frequency, Hz, found in the whole record, and the record's RMS."""


def rebuilt(record: str, rms: float) -> np.ndarray:
    lines = LINES.get_group(record)
    rng = np.random.default_rng(1)
    t = np.arange(round(DURATION * RATE)) / RATE
    x = np.zeros_like(t)
    for f, a, phase in zip(lines.frequency, lines.amplitude, rng.uniform(0.0, 2.0 * np.pi, len(lines))):
        x += a * np.cos(2.0 * np.pi * f * t + phase)
    return x + np.sqrt(rms**2 - np.mean(x**2)) * rng.standard_normal(t.size)


@pytest.mark.parametrize("record", list(RECORDS))
def test_mesh_frequency_without_a_known_speed(record):
    gmf, rms = RECORDS[record]
    report = analyse(make_signal(rebuilt(record, rms), RATE, teeth=TEETH))
    # the speed wandered by 0.1 % during the records, which spreads each line over several of these
    assert report.gmf == pytest.approx(gmf, abs=1.0)
