"""What a planetary set costs beside a gear pair: processor seconds of both, one after the other in one process."""

from __future__ import annotations

import math
import statistics
import sys
import time

from gearmbs.gears import ContactLaw, planetary, planetary_mechanism
from gearmbs.mechanism import Mechanism
from gearmbs.studies import paper_cases
from gearmbs.studies.simulation import case_mechanism

SPAN = 0.4
"""Simulated seconds."""
MESH_FREQUENCY = 170.0
"""Of the set, Hz."""
REPEATS = 5


def models() -> dict[str, tuple[Mechanism, float]]:
    """Return the mechanisms with the tolerances their front doors run them at."""
    healthy = next(iter(paper_cases()))
    # the law of the paper's pair, beside which they are timed
    law = ContactLaw.impact()
    gears = planetary((24, 30, 84), "1.5 mm", 3, backlash_sun="0.05 mm", backlash_ring="0.05 mm", contact=law)
    carrier = 2 * math.pi * MESH_FREQUENCY / gears.ring.teeth
    planets = planetary_mechanism(gears, speeds={"carrier": carrier}, torques={"sun": "-11 N m"}, run_up=0.02)
    pair = case_mechanism(healthy)
    return {
        "healthy pair, 1000 rpm": (pair, healthy.solver.used_tolerance),
        "three planets": (planets, 1e-6),
        "three planets, tolerance of the pair": (planets, healthy.solver.used_tolerance),
    }


def main() -> None:
    """Print seconds and ratios to the pair: ``python -m benchmarks.planetary [repeats]``."""
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else REPEATS
    seconds: dict[str, list[float]] = {name: [] for name in models()}
    for turn in range(repeats + 1):
        for name, (mechanism, tolerance) in models().items():
            begin = time.process_time()
            solution = mechanism.simulate(SPAN, rate=1000, tol=tolerance)
            if not solution.success:
                raise RuntimeError(f"{name}: {solution.message}")
            if turn > 0:
                # the first one loads kernels
                seconds[name].append(time.process_time() - begin)
    pair = next(iter(seconds.values()))
    for name, taken in seconds.items():
        ratio = statistics.median(b / a for a, b in zip(pair, taken, strict=True))
        print(f"{name}: {statistics.median(taken):.3f} s for {SPAN} s, {ratio:.2f} of the pair", flush=True)


if __name__ == "__main__":
    main()
