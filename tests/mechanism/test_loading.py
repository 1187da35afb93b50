"""A mechanism loads the kernels of the force elements and expressions that it has, and no others."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

PENDULUM = """
import json, sys
from gearmbs.mechanism import Mechanism
m = Mechanism("pendulum", gravity=(0, 0, -9.81))
rod = m.body("rod", 1.0, (0.1, 0.1, 0.01), position=(0.5, 0, 0))
m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
{more}
solution = m.simulate(0.1)
assert solution.success
solution.to_dataset()
solution.joint_angle("pin")
print(json.dumps(sorted(name for name in sys.modules if name.startswith("gearmbs."))))
"""


def loaded(more: str = "") -> set[str]:
    """Return the modules of the package that a process has after simulating a pendulum."""
    run = subprocess.run([sys.executable, "-c", PENDULUM.format(more=more)], capture_output=True, text=True, check=True)
    return set(json.loads(run.stdout.splitlines()[-1]))


def families(names: set[str]) -> set[str]:
    """Return the modules with kernels of force elements, contacts and expressions."""
    evaluated = {"gearmbs.dae.equations.expressions.evaluate", "gearmbs.dae.equations.expressions.spline_value"}
    return {n for n in names if n.endswith("_kernel") or n.startswith(("gearmbs.contact", "gearmbs.gears"))} | (
        names & evaluated
    )


@pytest.mark.slow
def test_a_pendulum_loads_no_kernel_of_a_force():
    assert families(loaded()) == set()


@pytest.mark.slow
def test_a_mechanism_loads_what_it_has():
    spring = 'm.spring_damper("s", rod.marker(), m.ground.marker(), stiffness=10.0)'
    assert families(loaded(spring)) == {"gearmbs.mechanism.forces.spring_kernel"}
    load = 'm.load("l", rod.marker(), m.ground.marker(name="base"), fx="TIME")'
    assert families(loaded(load)) == {
        "gearmbs.dae.equations.expressions.evaluate",
        "gearmbs.dae.equations.expressions.spline_value",
    }
