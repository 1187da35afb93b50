"""What a planetary set costs beside a gear pair: processor seconds of both, one after the other in one process.

Compared are the two front doors, `run_case` and `run_planetary`, with all they evaluate, and the integration alone of
both mechanisms by `Mechanism.simulate`, which takes its rate scale from their meshes as `run_case` does.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable

from gearmbs.gears import ContactLaw, planetary, planetary_mechanism
from gearmbs.mechanism import Mechanism
from gearmbs.studies import paper_cases, run_case
from gearmbs.studies.planetary import PlanetaryRun, run_planetary
from gearmbs.studies.run.simulation import case_mechanism

SPAN = 0.4
"""Simulated seconds of a mechanism, and of a record after the settling."""
MESH_FREQUENCY = 170.0
"""Of the set, Hz."""
REPEATS = 5


def jobs() -> dict[str, tuple[Callable[[], object], float]]:
    """Return what is run, by name, and the seconds that it simulates; the pair comes before its planets."""
    healthy = next(iter(paper_cases())).changed(operation={"duration": SPAN})
    # the law of the paper's pair, beside which they are timed
    law = ContactLaw.impact()
    gears = planetary((24, 30, 84), "1.5 mm", 3, backlash_sun="0.05 mm", backlash_ring="0.05 mm", contact=law)
    drive = {
        "speeds": {"carrier": 2 * math.pi * MESH_FREQUENCY / gears.ring.teeth}, "torques": {"sun": "-11 N m"},
    }  # fmt: skip
    run = PlanetaryRun(gears, **drive, duration=SPAN)
    planets = planetary_mechanism(gears, **drive, run_up=run.run_up)
    tight = healthy.solver.used_tolerance
    operation = healthy.operation
    return {
        "pair, run_case": (lambda: run_case(healthy, False), operation.run_up + operation.settling + SPAN),
        "three planets, run_planetary": (lambda: run_planetary(run), run.run_up + run.settling + SPAN),
        "pair, simulate": (lambda: simulated(case_mechanism(healthy), tight), SPAN),
        "three planets, simulate": (lambda: simulated(planets, run.used_tolerance), SPAN),
        "three planets, simulate, tolerance of the pair": (lambda: simulated(planets, tight), SPAN),
    }


def simulated(mechanism: Mechanism, tolerance: float) -> None:
    """Integrate a mechanism.

    Raises
    ------
    RuntimeError
        If it stops early.
    """
    solution = mechanism.simulate(SPAN, rate=1000, tol=tolerance)
    if not solution.success:
        raise RuntimeError(solution.message)


def main() -> None:
    """Print seconds a simulated second, and ratios to the pair: ``python -m benchmarks.planetary [repeats]``."""
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else REPEATS
    work = jobs()
    seconds: dict[str, list[float]] = {name: [] for name in work}
    for turn in range(repeats + 1):
        for name, (job, span) in work.items():
            begin = time.process_time()
            job()
            if turn > 0:
                # the first one loads kernels
                seconds[name].append((time.process_time() - begin) / span)
    for name, taken in seconds.items():
        pair = seconds["pair, run_case" if "run_" in name else "pair, simulate"]
        ratio = statistics.median(b / a for a, b in zip(pair, taken, strict=True))
        print(f"{name}: {statistics.median(taken):.3f} s a second, {ratio:.2f} of the pair", flush=True)


if __name__ == "__main__":
    main()
