"""How often intervals of encoders without known marks cover the truth: a table of docs/theory/angle_measurement.md.

    python -m benchmarks.encoder_draws --write docs/data/encoder_draws.txt

Takes some minutes of one core. Of each gearbox the exact pulses are made once; marks are errors of some microradians,
over which the speed is constant, so that each draw moves the pulses by its marks' errors over the speed there.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import gearmbs as gm
from benchmarks.instruments import COUNTER, LINES, MARKS, boxes
from benchmarks.long_records import Steady
from benchmarks.markdown import table
from gearmbs import signals

DRAWS = 200
"""Of each gearbox."""
SECONDS = 1.0
"""Of each record: marks do not average out, so that longer ones have the same intervals."""
HARMONICS = 4
PROBABILITY = 0.95
LEVELS: tuple[tuple[str, dict[str, Any]], ...] = (("the record", {}), ("what is told", {"mark_error": MARKS}))


def covered(steady: Steady, draws: int = DRAWS, seconds: float = SECONDS) -> np.ndarray:
    """Return whether intervals hold the true first mesh harmonics: shape (draws, 2, harmonics), levels as `LEVELS`.

    Of both discs errors are drawn; that of the driver lacks mark 0.
    """
    exact = steady.exact(HARMONICS)
    plain = [steady.plain(shaft, seconds) for shaft in (0, 1)]
    slope = [np.gradient(train.times, train.numbers) * LINES / (2.0 * np.pi) for train in plain]
    inside = np.zeros((draws, len(LEVELS), HARMONICS), dtype=bool)
    for draw in range(draws):
        trains = []
        for shaft, train in enumerate(plain):
            marks = signals.mark_errors(LINES, MARKS, 2 * draw + shaft)
            rng = np.random.default_rng((draw, shaft))
            times = train.times + slope[shaft] * marks[train.numbers % LINES]
            times = times + gm.units.to_si(COUNTER["jitter"], "time") * rng.standard_normal(times.size)
            tick = gm.units.to_si(COUNTER["clock"], "time")
            trains.append(signals.PulseTrain(np.floor(times / tick) * tick, train.numbers, LINES, True, train.name))
        for k, (_, known) in enumerate(LEVELS):
            settings = {"base_radius": steady.radius, "probability": PROBABILITY, **steady.gearing, **known}
            run = signals.CoupledRun(*trains)
            found = gm.transmission_error_from_pulses(run, **settings).harmonics()[:HARMONICS]
            inside[draw, k] = (found["low"] <= exact) & (exact <= found["high"])
    return inside


def page() -> str:
    """Return the table."""
    rows = []
    for box in boxes():
        inside = covered(Steady.of_box(box))
        for k, (name, _) in enumerate(LEVELS):
            rows.append([box.name, name, ", ".join(map(str, inside[:, k].sum(axis=0)))])
            print(rows[-1], flush=True)
    head = ["", "level of the marks by", f"of {DRAWS} intervals of harmonics 1 to {HARMONICS} hold the truth"]
    return table(head, rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    given = parser.parse_args()
    text = page()
    print(text)
    if given.write is not None:
        given.write.write_text(text, encoding="utf-8")
