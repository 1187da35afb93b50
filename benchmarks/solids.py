"""What contacts of solids cost: the kernel of each kind of pair, and balls that fall into a box.

    python -m benchmarks.solids --balls 4 8 16

Times are of the processor; each is the median of several turns, in which all are measured one after the other.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.markdown import number, table

CALLS = 2000
"""Of a kernel in one turn."""
SPAN = 0.3
"""Simulated time of the balls, s."""
RADIUS = 0.02


def pairs() -> dict[str, tuple[Any, Any, tuple[float, float, float]]]:
    """Return pairs of solids and where the first is when it touches the second."""
    from gearmbs.mechanism.contacts import Box, Cylinder, Ellipsoid, HalfSpace, Mesh, Sphere

    return {
        "ball, plane": (Sphere(0.1), HalfSpace(), (0.0, 0.0, 0.099)),
        "two balls": (Sphere(0.1), Sphere(0.1), (0.0, 0.0, 0.199)),
        "ball, box": (Sphere(0.1), Box((1, 1, 1)), (0.0, 0.0, 0.599)),
        "ellipsoid, plane": (Ellipsoid((0.3, 0.2, 0.1)), HalfSpace(), (0.0, 0.0, 0.099)),
        "box, plane": (Box((0.2, 0.2, 0.2)), HalfSpace(), (0.0, 0.0, 0.099)),
        "two boxes": (Box((0.2, 0.2, 0.2)), Box((1, 1, 1)), (0.0, 0.0, 0.599)),
        "cylinder, box": (Cylinder(0.1, 0.2), Box((1, 1, 1)), (0.0, 0.0, 0.599)),
        "cylinder, box, apart": (Cylinder(0.1, 0.2), Box((1, 1, 1)), (0.0, 0.0, 0.9)),
        "mesh, mesh": (Mesh(*Box((0.2, 0.2, 0.2)).facets()), Mesh(*Box((1, 1, 1)).facets()), (0.0, 0.0, 0.599)),
    }


def kernel_call(a: Any, b: Any, place: tuple[float, float, float]) -> Callable[[int], None]:
    """Return what calls the kernel of a pair, without or with derivatives (0, 1)."""
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.contacts import Coulomb, Impact, SolidContact

    m = Mechanism("pair")
    markers = m.body("body", 1.0, (1, 1, 1)).marker(), m.ground.marker()
    made = SolidContact("c", *markers, (a,), (b,), Impact(1e6), Coulomb(0.5, 0.3, 0.1, 1.0)).compiled()
    tables = np.array(made.integers, dtype=np.int64), np.array(made.reals, dtype=float)
    frames = np.zeros((2, 18))
    frames[:, 3:12] = np.eye(3).ravel()
    frames[0, :3] = place
    none, work = np.zeros(0), np.zeros(made.scratch)
    wrench, jac, told = np.zeros((1, 6)), np.zeros((6, 24)), np.zeros(6)

    def call(want: int) -> None:
        made.kernel(*tables, 0.0, frames, none, none, want, work, wrench, none, jac, told)

    return call


def pit(count: int) -> Any:
    """Return balls above the floor of a box with four walls, every ball against every other and the box."""
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.contacts import Coulomb, HalfSpace, Impact, Sphere

    rng = np.random.default_rng(1)
    m = Mechanism("pit", gravity=(0, 0, -9.81))
    wide = 2.5 * RADIUS * max(2.0, count ** (1 / 3))
    law, friction = Impact(1e5, 1.5, 20.0, 1e-4), Coulomb(0.3, 0.25, 1e-2, 2e-2)
    walls = [HalfSpace()]
    for turn in range(4):
        c, s = np.cos(turn * np.pi / 2), np.sin(turn * np.pi / 2)
        inward = np.array([[-s, 0.0, c], [c, 0.0, s], [0.0, 1.0, 0.0]])
        walls.append(HalfSpace(offset=-0.5 * wide * inward[:, 2], axes=inward))
    room, balls = m.ground.marker(), []
    per_layer = int(wide / (2.2 * RADIUS)) ** 2
    for k in range(count):
        layer, place = divmod(k, per_layer)
        row, column = divmod(place, int(np.sqrt(per_layer)))
        xy = -0.5 * wide + (np.array([row, column]) + 0.5) * wide / np.sqrt(per_layer)
        at = (*(xy + 1e-3 * rng.uniform(-1, 1, 2)), (1.5 + 2.3 * layer) * RADIUS)
        ball = m.body(f"ball {k}", 0.1, (1.6e-5,) * 3, position=at)
        balls.append(ball.marker())
        m.contact(f"room {k}", balls[k], Sphere(RADIUS), room, walls, law, friction)
        for j in range(k):
            m.contact(f"balls {j}, {k}", balls[k], Sphere(RADIUS), balls[j], Sphere(RADIUS), law, friction)
    return m


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--balls", type=int, nargs="*", default=[4, 8, 16])
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()
    calls = {name: kernel_call(*pair) for name, pair in pairs().items()}
    times: dict[tuple[str, int], list[float]] = {}
    for _ in range(given.repeats):
        for name, call in calls.items():
            for want in (0, 1):
                began = time.process_time()
                for _ in range(CALLS):
                    call(want)
                times.setdefault((name, want), []).append((time.process_time() - began) / CALLS)
    rows = [[name, *(number(1e6 * float(np.median(times[name, want]))) for want in (0, 1))] for name in calls]
    print(table(["pair, us a call from Python", "force", "with derivatives"], rows))
    rows = []
    for count in given.balls:
        m = pit(count)
        began = time.process_time()
        s = m.simulate(SPAN, every_step=True, tol=1e-6, corrector="modified")
        spent = time.process_time() - began
        contacts = count + count * (count - 1) // 2
        rows.append(
            [str(count), str(contacts), str(s.stats.steps), number(spent), number(1e6 * spent / s.stats.steps),
             number(s.energy_balance().attrs["relative_imbalance"])]
        )  # fmt: skip
    print(table(["balls", "contacts", "steps", "s", "us a step", "imbalance of energy"], rows))


if __name__ == "__main__":
    main()
