"""What following a run with its forward sensitivities costs beside the run: the paper's healthy pair.

    python -m benchmarks.sensitivities

Processor time a step of the run, the least of three, for one parameter and for five.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from math import pi
from typing import Any

from benchmarks.markdown import table
from gearmbs.mechanism import Mechanism, forward_sensitivities
from gearmbs.mechanism.solve import sensitivities
from gearmbs.studies import Case, case_mechanism

SPEED = 1000.0 * pi / 30.0
CASE = Case(operation={"speed": SPEED, "torque": 100.0, "run_up": 0.02, "settling": 0.0, "duration": 0.05})
VALUES = {"torque": 100.0, "stiffness": 2.37e9, "damping": 3e5, "density": 7850.0, "speed": SPEED}
"""In SI; stiffness in N/m^1.3."""
SPAN = 0.4
"""Simulated seconds, some 27 000 steps."""


def pair(torque: float, stiffness: float, damping: float, density: float, speed: float) -> Mechanism:
    """Return the pair with these numbers."""
    return case_mechanism(
        CASE.changed(
            operation={"torque": torque, "speed": speed},
            contact={"stiffness": stiffness, "damping": damping},
            shafts={"density": density},
        )
    )


def main() -> None:
    rows = []
    for lump in (False, True):
        settings = {"rate": 2000, "tol": 1e-7, "rate_scale": SPEED * CASE.gears.teeth[0], "lump": lump}
        run, steps = least(lambda settings=settings: pair(**VALUES).simulate(SPAN, **settings).result.stats.steps)
        followed = []
        for count in (1, 5):
            chosen = dict(list(VALUES.items())[:count])

            def build(**values: float) -> Mechanism:
                return pair(**VALUES | values)

            with timed(sensitivities, "follow") as spent:
                for _ in range(3):
                    forward_sensitivities(build, chosen, SPAN, **settings)
            followed.append(min(spent))
        each = (followed[1] - followed[0]) / 4
        numbers = [1e6 * t / steps for t in (run, followed[0] - each, each)]
        rows.append(
            [
                "lumped" if lump else "all bodies",
                *(f"{t:.1f}" for t in numbers),
                f"{(run + followed[0] + 9 * each) / run:.1f}",
            ]
        )
    print(table(["pair", "run, us a step", "following, us", "a parameter, us", "ten parameters, runs"], rows))


def least(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the least processor time of three, s, and what the last returned."""
    times, found = [], None
    for _ in range(3):
        begin = time.process_time()
        found = work()
        times.append(time.process_time() - begin)
    return min(times), found


class timed:
    """While it is entered, the processor times of calls of a function of a module, s."""

    def __init__(self, module: Any, name: str) -> None:
        self.module, self.name, self.function = module, name, getattr(module, name)
        self.spent: list[float] = []

    def __enter__(self) -> list[float]:
        def call(*args: Any, **options: Any) -> Any:
            begin = time.process_time()
            try:
                return self.function(*args, **options)
            finally:
                self.spent.append(time.process_time() - begin)

        setattr(self.module, self.name, call)
        return self.spent

    def __exit__(self, *_: object) -> None:
        setattr(self.module, self.name, self.function)


if __name__ == "__main__":
    main()
