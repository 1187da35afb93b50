"""The steady motion of cases beside a record of one second: cost, and the worst mesh harmonic.

``python -m benchmarks.steady``
"""

from __future__ import annotations

import statistics
import time

import numpy as np

import gearmbs as gm

ROUNDS = 5
STATES = {
    "healthy": {},
    "misaligned": {"fault": {"misalignment": "1 deg"}},
    "+3 mm": {"fault": {"centre_distance_error": "3 mm"}},
    "3000 rpm": {"operation": {"speed": "3000 rpm"}},
    "1 N s/mm": {"contact": {"damping": "1 N s/mm"}},
}


def cost(function, case) -> tuple[float, object]:
    """Return processor time, s, and what a call for the harmonics of a case returns."""
    begin = time.process_time()
    found = function(case, variables=["gmf_rms"])
    return time.process_time() - begin, found


def main() -> None:
    """Print a row for each state."""
    print("| state | steady, ms | 1 s record, ms | ratio | worst harmonic | largest multiplier | periods |")
    print("|---|---|---|---|---|---|---|")
    for name, sections in STATES.items():
        operation = {"speed": "1000 rpm", "torque": 20.0} | sections.get("operation", {})
        case = gm.Case(name=name, **(sections | {"operation": operation}))
        long = case.changed(operation={"duration": 1.0})
        gm.steady(case, variables=["gmf_rms"])
        quick, slow = [], []
        for _ in range(ROUNDS):
            quick.append(cost(gm.steady, case))
            slow.append(cost(gm.run_case, long)[0])
        motion = quick[-1][1]
        exact = gm.run_case(long.changed(solver={"tolerance": 1e-9, "lump": True}), variables=["gmf_rms"])
        off = motion.record["gmf_rms"].sel(way="orders") / exact["gmf_rms"].sel(way="orders") - 1.0
        mine, theirs = statistics.median(t for t, _ in quick), statistics.median(slow)
        print(
            f"| {name} | {1e3 * mine:.1f} | {1e3 * theirs:.0f} | {theirs / mine:.1f} | {np.abs(off).values.max():.1e} "
            f"| {abs(motion.orbit.largest):.3g} | {motion.periods} |"
        )


if __name__ == "__main__":
    main()
