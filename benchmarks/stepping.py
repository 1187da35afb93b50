"""What it costs to step a simulation: points 0.1 ms apart against one run with them as outputs, inputs set at each of
them, and states in and out; and what integrators do for it.

``OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m benchmarks.stepping``: medians of processor times over
interleaved repetitions, and of their ratios to one run's in the same repetition; their order changes, for a run finds
caches as the one before has left them.
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
from gearmbs.dae.result import SolverStats
from gearmbs.gears import GearSpec, PlanetarySet, planetary_mechanism
from gearmbs.mechanism import Mechanism
from gearmbs.studies.presets.bench import bench_train
from gearmbs.studies.run.simulation import case_mechanism

RATE = 1e4
"""Communication points a second."""
REPEATS = 21
STATES = 200
SWING = 20.0
"""Of the inputs, Hz."""


TRAIN = {"tol": 1e-6, "rate_scale": 3000.0}
COUNTS = ("steps", "error_rejections", "newton_rejections", "residuals", "jacobians", "factorizations", "solves")
KINDS = {"held, 50 %": (0.5, 0), "held, 1 %": (0.01, 0), "held, 1e-6": (1e-6, 0), "led, 50 %": (0.5, 1)}
"""Parts of the torque by which inputs swing, and how they are held."""


def planets() -> Mechanism:
    """Return a planetary set of four planets whose meshes are forces given by equations."""
    wheels = GearSpec(28, "2 mm"), GearSpec(36, "2 mm"), GearSpec.ring(100, "2 mm")
    gears = PlanetarySet(*wheels, planets=4, ideal=(1e8, 1e8))
    return planetary_mechanism(gears, speeds={"sun": 50.0}, torques={"carrier": -20.0}, run_up=0.01)


def _stepped(m: Mechanism, times: np.ndarray, records: bool, options: dict[str, Any]) -> None:
    sim = gm.Simulator(m, float(times[-1]), records=records, **options)
    for t in times[1:].tolist():
        sim.advance(t)


def stepping_costs(m: Mechanism, span: float, **options: Any) -> dict[str, np.ndarray]:
    """Return processor seconds of one run with outputs, of one without, and of steps with and without records."""
    times = np.linspace(0.0, span, round(span * RATE) + 1)
    kinds: dict[str, Callable[[], Any]] = {
        "one run": partial(m.simulate, span, t_eval=times, **options),
        "no outputs": partial(m.simulate, span, t_eval=times[[0, -1]], **options),
        "stepped": partial(_stepped, m, times, True, options),
        "no records": partial(_stepped, m, times, False, options),
    }
    return _taken(kinds)


def input_costs(
    m: Mechanism, body: str, torque: float, span: float, **options: Any
) -> tuple[dict[str, np.ndarray], dict[str, SolverStats]]:
    """Return processor seconds of one run, and of steps with a further torque set at each, held or led.

    It swings at 20 Hz by half of ``torque`` (N m), by a hundredth, and by so little that nothing is to be resolved.
    With them come the statistics of each.
    """
    m.torque("swing", m.bodies[body], m.input("swing", "N m"))
    times = np.linspace(0.0, span, round(span * RATE) + 1)
    swing = torque * np.sin(2.0 * np.pi * SWING * times)
    stats: dict[str, SolverStats] = {}

    def steered(kind: str) -> None:
        part, hold = KINDS[kind]
        sim, values = gm.Simulator(m, span, **options), (part * swing).tolist()
        for k, t in enumerate(times[1:].tolist()):
            sim.set("swing", values[k + hold], hold)
            sim.advance(t)
        if kind not in stats:
            stats[kind] = sim.solution().stats

    stats["one run"] = m.simulate(span, t_eval=times, **options).stats
    kinds: dict[str, Callable[[], Any]] = {"one run": partial(m.simulate, span, t_eval=times, **options)}
    return _taken(kinds | {kind: partial(steered, kind) for kind in KINDS}), stats


def _taken(kinds: dict[str, Callable[[], Any]]) -> dict[str, np.ndarray]:
    """Return the processor times of interleaved repetitions, s, after one that finds kernels and layouts."""
    taken, order = {name: np.empty(REPEATS) for name in kinds}, np.random.default_rng(0)
    for run in kinds.values():
        run()
    for j in range(REPEATS):
        for k in order.permutation(len(kinds)):
            name = list(kinds)[k]
            begin = time.process_time()
            kinds[name]()
            taken[name][j] = time.process_time() - begin
    return taken


def _ratio(cost: np.ndarray, one: np.ndarray) -> str:
    return number(float(np.median(cost / one)), 3)


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
    """Measure the healthy pair, the bench's drivetrain and a planetary set, and print three tables."""
    models: dict[str, tuple[Mechanism, str, float, float, dict[str, Any]]] = {
        "healthy pair": (case_mechanism(gm.Case()), "shaft 2", 100.0, 0.1, {"tol": 1e-7, "rate_scale": 3000.0}),
        "drivetrain": ((train := bench_train().build()), list(train.bodies)[-1], 100.0, 0.05, TRAIN),
        "planetary set": (planets(), "carrier", 20.0, 0.05, {"tol": 1e-5}),
    }
    rows = []
    for name, (m, _, _, span, options) in models.items():
        costs, states = stepping_costs(m, span, **options), state_costs(m, 0.2 * span, **options)
        ratios = [_ratio(costs[kind], costs["one run"]) for kind in ("no outputs", "stepped", "no records")]
        one = float(np.median(costs["one run"]))
        between = one / (span * RATE)
        taken = [number(took / between, 2) for took in states.values()]
        rows.append([name, number(1e3 * one, 3), *ratios, *(number(1e6 * took, 3) for took in states.values()), *taken])
    heads = ["model", "one run, ms", "no outputs", "stepped", "no records", "state, us", "restore, us"]
    heads += ["state / 0.1 ms of the run", "restore / 0.1 ms of the run"]
    print(table(heads, rows))
    rows, counted, heads = [], [], ["model", "one run, ms", *KINDS]
    for name, (m, body, torque, span, options) in models.items():
        costs, stats = input_costs(m, body, torque, span, **options)
        one = costs.pop("one run")
        rows.append([name, number(1e3 * float(np.median(one)), 3), *(_ratio(cost, one) for cost in costs.values())])
        counted += [[name, kind, *(str(getattr(done, count)) for count in COUNTS)] for kind, done in stats.items()]
    print(table(heads, rows))
    print(table(["model", "run", *COUNTS], counted))


if __name__ == "__main__":
    main()
