"""What modes cost: the paper's pair on flexible shafts against rigid ones, and a housing of 100 modes.

    python -m benchmarks.flexible --modes 1 4 16 --repeats 5

Processor times; all variants in turn in one process, medians of ratios to the rigid pair of `gear_rig`. At the defaults
the pair on shafts that deform is integrated to 3e-8, the rigid one to 1e-7; ``--tol`` takes one tolerance for both.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.markdown import number, table
from gearmbs.flexible import Interface, block_mesh, nodes_where, reduce_model, solid_model
from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism
from gearmbs.studies import flexible_rig, gear_rig
from gearmbs.studies.run.rig import SHAFTS

DURATION = 0.2
HOUSING_MODES = 100
HOUSING_DURATION = 0.02


def seconds_of(mechanism: Mechanism, duration: float, rate: float, tol: float | None = None) -> tuple[float, int]:
    """Return the processor time of a simulation and its steps."""
    begin = time.process_time()
    solution = mechanism.simulate(duration, rate=rate, tol=tol)
    if not solution.success:
        raise RuntimeError(solution.message)
    return time.process_time() - begin, solution.stats.steps


def pairs(modes: list[int], repeats: int, tol: float | None = None) -> list[dict]:
    """Time the rigid pair and those on shafts with so many modes each beside their static ones."""
    pair = GearPair.paper()

    def rig(count: int) -> Mechanism:
        if count == 0:
            return gear_rig(pair, speed="1000 rpm", torque="100 N m")
        return flexible_rig(pair, speed="1000 rpm", torque="100 N m", modes=count)

    found: dict[int, list[tuple[float, int]]] = {count: [] for count in (0, *modes)}
    for count in found:
        seconds_of(rig(count), 0.002, 12_800)
    for _ in range(repeats):
        for count, runs in found.items():
            runs.append(seconds_of(rig(count), DURATION, 12_800, tol))
    rigid, rigid_steps = np.array([seconds for seconds, _ in found[0]]), found[0][0][1]
    bodies = {count: len(rig(count).bodies[SHAFTS[0]].start) if count else 0 for count in found}
    return [
        {
            "modes": count,
            "all modes": bodies[count],
            "seconds": float(np.median([s for s, _ in runs])),
            "times": float(np.median(np.array([s for s, _ in runs]) / rigid)),
            "steps": runs[0][1],
            "times the steps": runs[0][1] / rigid_steps,
        }
        for count, runs in found.items()
    ]


def housing() -> Mechanism:
    """Return a plate of 100 modes on four feet, pushed in the middle."""
    plate = solid_model(block_mesh(("400 mm", "300 mm", "30 mm"), (8, 6, 1)), name="housing")

    def near(x0: float, y0: float, reach: float, height: float):
        return nodes_where(
            plate, lambda x, y, z: (abs(x - x0) < reach) & (abs(y - y0) < reach) & (abs(z - height) < 1e-9)
        )

    corners = ((0, 0), (0.4, 0), (0, 0.3), (0.4, 0.3))
    feet = [Interface(f"foot {k + 1}", near(x, y, 0.03, 0.0)) for k, (x, y) in enumerate(corners)]
    seat = Interface("seat", near(0.2, 0.15, 0.06, 0.03), "average")
    model = reduce_model(plate, [*feet, seat], modes=HOUSING_MODES - 24)
    m = Mechanism("housing")
    body = model.add_to(m, "housing", damping=0.02)
    for foot in feet:
        place = model.place(foot.name)
        m.bushing(foot.name, body.marker(place), m.ground.marker(place), stiffness=(1e8,) * 3)
    place = model.place("seat")
    m.load("push", body.marker(place, name="seat"), m.ground.marker(place), rm=m.ground.marker(),
           fz="1000*SIN(2*PI*500*TIME)")  # fmt: skip
    return m


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, nargs="+", default=[1, 4, 16], help="of each shaft, beside 12 static ones")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--tol", type=float, help="of all; default: that of each")
    given = parser.parse_args()
    rows = pairs(given.modes, given.repeats, given.tol)
    lines = [
        [
            str(row["modes"]) if row["modes"] else "rigid", str(row["all modes"]), number(row["seconds"]),
            number(row["times"]), str(row["steps"]), number(row["times the steps"]),
            number(1e6 * row["seconds"] / row["steps"]), number(row["times"] / row["times the steps"]),
        ]
        for row in rows
    ]  # fmt: skip
    header = ("modes", "with static ones", "s", "times the rigid pair", "steps", "times its steps", "us a step",
              "times its step")  # fmt: skip
    print(table(header, lines))
    plate = housing()
    seconds_of(plate, 1e-4, 20_000)
    seconds, steps = seconds_of(plate, HOUSING_DURATION, 20_000)
    print(f"housing of {HOUSING_MODES} modes: {number(seconds)} s for {HOUSING_DURATION} s, {steps} steps")


if __name__ == "__main__":
    main()
