"""The mesh line of measured records, from a small extract of them: their strongest lines in noise.

`measured_lines.csv` holds sixty lines of each record; noise stands for the rest, with the rest's RMS. `LEVELS` are
those of the mesh harmonics, which tones of the same levels stand for. The records themselves are analysed in
`test_analysis.py` where their folder is at hand.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from gearmbs.signals import analyse, compare, make_signal

LINES = pd.read_csv(Path(__file__).parent / "measured_lines.csv", comment="#").groupby("record")
RATE, TEETH, DURATION = 12800.0, 32, 6.9
RECORDS = {"h30hz0": (952.15, 5.946), "h30hz90": (948.05, 8.244), "b30hz0": (952.1, 3.554), "b30hz90": (948.0, 5.255)}
"""Mesh frequency, Hz, found in the whole record, and the record's RMS."""

LEVELS = {
    "h30hz0": [[0.9906, 1.4623, 1.7865, 0.9940], [2.1907, 0.6981, 1.1461, 1.9074], [2.3865, 0.6373, 0.9238, 1.0633]],
    "h30hz90": [[1.7964, 2.2211, 2.3424, 1.5910], [3.1569, 0.9845, 1.8110, 3.5892], [3.4102, 1.0907, 1.5877, 1.8189]],
    "b30hz0": [[2.1982, 1.8284, 1.9051, 0.9122], [0.6118, 0.9989, 1.1940, 1.9489], [0.3070, 2.7643, 1.1911, 1.1555]],
    "b30hz90": [[3.1793, 2.5322, 2.1965, 1.5498], [1.2603, 1.7365, 1.7888, 3.5220], [0.4286, 1.3165, 2.0577, 2.0281]],
}
"""RMS of the first three mesh harmonics, in bands of a quarter of the mesh frequency, of channels a1 to a4."""


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


@pytest.mark.slow
def test_what_the_broken_tooth_does_by_the_measured_levels():
    """As of the records: of harmonics 1 to 3 stay within 3 dB on 3, 2 and 2 of 4 channels, under load on 3, 2 and 3."""
    t = np.arange(round(2.0 * RATE)) / RATE

    def toned(record: str):
        gmf, _ = RECORDS[record]
        tones = np.sqrt(2.0) * np.cos(2.0 * np.pi * gmf * np.arange(1, 4) * t[:, None])
        return make_signal(tones @ np.array(LEVELS[record]), RATE, teeth=TEETH, channels=["a1", "a2", "a3", "a4"])

    states = {"healthy": "h", "broken": "b"}
    report = compare({f"{load} %": {s: toned(f"{x}30hz{load}") for s, x in states.items()} for load in (0, 90)})
    found = report.data["experiment"].transpose("load", "state", "harmonic", "channel").values
    levels = np.array(list(LEVELS.values()))
    np.testing.assert_allclose(found.reshape(4, 3, 4)[[0, 2, 1, 3]], levels, rtol=1e-3)
    assert (found[1, 0] > found[0, 0]).all()
    change = 20.0 * np.log10(levels[2:] / levels[:2])
    np.testing.assert_allclose(
        report.changes().sel(state="broken").transpose("load", "harmonic", "channel"), change, atol=0.01
    )
    assert report.expectations()["met"][:6].tolist() == [3, 3, 2, 2, 2, 3]
