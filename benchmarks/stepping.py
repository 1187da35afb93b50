"""What it costs to step a simulation: points 0.1 ms apart against one run with them as outputs, inputs set at each of
them, and states in and out.

``OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m benchmarks.stepping``: smallest processor times of interleaved
repetitions.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import gearmbs as gm
from benchmarks.markdown import number, table
from benchmarks.timing import seconds_per_call
from gearmbs.mechanism import Mechanism
from gearmbs.studies.presets.bench import bench_train
from gearmbs.studies.run.simulation import case_mechanism

RATE = 1e4
"""Communication points a second."""
REPEATS = 15
STATES = 200
SWING = 20.0
"""Of the inputs, Hz."""


def _stepped(m: Mechanism, times: np.ndarray, records: bool, options: dict[str, Any]) -> None:
    sim = gm.Simulator(m, float(times[-1]), records=records, **options)
    for t in times[1:].tolist():
        sim.advance(t)


def stepping_costs(m: Mechanism, span: float, **options: Any) -> dict[str, float]:
    """Return processor seconds of one run with outputs, of one without, and of steps with and without records."""
    times = np.linspace(0.0, span, round(span * RATE) + 1)
    kinds: dict[str, Callable[[], Any]] = {
        "one run": partial(m.simulate, span, t_eval=times, **options),
        "no outputs": partial(m.simulate, span, t_eval=times[[0, -1]], **options),
        "stepped": partial(_stepped, m, times, True, options),
        "no records": partial(_stepped, m, times, False, options),
    }
    return _least(kinds)


def input_costs(m: Mechanism, body: str, torque: float, span: float, **options: Any) -> dict[str, float]:
    """Return processor seconds of one run, and of steps with a further torque set at each, held or led.

    It swings at 20 Hz by half of ``torque`` (N m), and by a hundredth.
    """
    m.torque("swing", m.bodies[body], m.input("swing", "N m"))
    times = np.linspace(0.0, span, round(span * RATE) + 1)
    swing = torque * np.sin(2.0 * np.pi * SWING * times)

    def steered(part: float, hold: int) -> None:
        sim, values = gm.Simulator(m, span, **options), (part * swing).tolist()
        for k, t in enumerate(times[1:].tolist()):
            sim.set("swing", values[k + hold], hold)
            sim.advance(t)

    kinds: dict[str, Callable[[], Any]] = {
        "one run": partial(m.simulate, span, t_eval=times, **options),
        "held, 50 %": partial(steered, 0.5, 0),
        "held, 1 %": partial(steered, 0.01, 0),
        "led, 50 %": partial(steered, 0.5, 1),
    }
    return _least(kinds)


def _least(kinds: dict[str, Callable[[], Any]]) -> dict[str, float]:
    """Return the smallest processor times of interleaved repetitions, s."""
    best = dict.fromkeys(kinds, np.inf)
    for _ in range(REPEATS):
        for name, call in kinds.items():
            begin = time.process_time()
            call()
            best[name] = min(best[name], time.process_time() - begin)
    return best


def state_costs(m: Mechanism, at: float, **options: Any) -> dict[str, float]:
    """Return processor seconds in which a state is taken and put back."""
    sim = gm.Simulator(m, 2.0 * at, **options)
    sim.advance(at)
    state = sim.state()

    def take(n: int) -> None:
        for _ in range(n):
            sim.state()

    def put(n: int) -> None:
        for _ in range(n):
            sim.restore(state)

    return {"state": seconds_per_call(take, STATES), "restore": seconds_per_call(put, STATES)}


def main() -> None:
    """Measure the healthy pair and the bench's drivetrain, and print two tables."""
    models: dict[str, tuple[Mechanism, float, dict[str, Any]]] = {
        "healthy pair": (case_mechanism(gm.Case()), 0.1, {"tol": 1e-7, "rate_scale": 3000.0}),
        "drivetrain": (bench_train().build(), 0.05, {"tol": 1e-6, "rate_scale": 3000.0}),
    }
    rows = []
    for name, (m, span, options) in models.items():
        costs, states = stepping_costs(m, span, **options), state_costs(m, 0.2 * span, **options)
        one = costs["one run"]
        ratios = [number(costs[kind] / one, 3) for kind in ("no outputs", "stepped", "no records")]
        between = one / (span * RATE)
        taken = [number(took / between, 2) for took in states.values()]
        rows.append([name, number(1e3 * one, 3), *ratios, *(number(1e6 * took, 3) for took in states.values()), *taken])
    heads = ["model", "one run, ms", "no outputs", "stepped", "no records", "state, us", "restore, us"]
    heads += ["state / 0.1 ms of the run", "restore / 0.1 ms of the run"]
    print(table(heads, rows))
    rows, heads = [], ["model", "one run, ms"]
    for name, (m, span, options) in models.items():
        costs = input_costs(m, {"healthy pair": "shaft 2"}.get(name, list(m.bodies)[-1]), 100.0, span, **options)
        one = costs.pop("one run")
        heads[2:] = list(costs)
        rows.append([name, number(1e3 * one, 3), *(number(cost / one, 3) for cost in costs.values())])
    print(table(heads, rows))


if __name__ == "__main__":
    main()
