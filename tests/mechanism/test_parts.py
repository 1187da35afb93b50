"""A solution taken piece by piece says the same as the whole of it."""

import numpy as np
import pytest

from gearmbs.mechanism import Mechanism, polynomial
from gearmbs.mechanism.solve.analyses import quasi_static


@pytest.fixture(scope="module")
def tumbler():
    """A free body about its intermediate axis, whose Euler reference changes on the way, and a driven crank."""
    m = Mechanism("tumbler", gravity=(0, 0, -9.81))
    m.body("t", 1.0, (1.0, 2.0, 3.0), angular_velocity=(1e-3, 10.0, 0.0))
    crank = m.body("crank", 2.0, (0.1, 0.2, 0.3), position=(0.5, 0, 0))
    axle = m.revolute("axle", crank, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.rotation("motor", axle, polynomial([0.0, 20.0]))
    solution = m.simulate(2.0, rate=200, tol=1e-8)
    assert len(solution.result.epochs) > 1
    return solution


def series(solution) -> np.ndarray:
    """Return something of everything a solution holds, side by side."""
    force, moment = solution.reaction("axle")
    return np.column_stack(
        [
            solution.t,
            solution.com_position("crank"),
            solution.orientation("t").reshape(-1, 9),
            solution.com_acceleration("crank"),
            solution.angular_acceleration("t"),
            force,
            moment,
            solution.multipliers,
            solution.kinetic_energy,
        ]
    )


@pytest.mark.parametrize("size", [1, 7, 64, 1000])
def test_parts_are_the_whole(tumbler, size):
    """The projection starts afresh with each part, which changes nothing but rounding."""
    together = np.concatenate([series(part) for part in tumbler.parts(size=size)])
    assert sum(len(part) for part in tumbler.parts(size=size)) == len(tumbler)
    np.testing.assert_allclose(together, series(tumbler), rtol=1e-9, atol=1e-9)


def test_chosen_output_times(tumbler):
    rows = np.flatnonzero(np.arange(len(tumbler)) % 3 == 1)
    together = np.concatenate([series(part) for part in tumbler.parts(rows, size=16)])
    np.testing.assert_allclose(together, series(tumbler)[rows], rtol=1e-9, atol=1e-9)


def test_parts_before_anything_was_evaluated(tumbler):
    """Nothing is evaluated until it is asked for, and the parts leave no records of the whole behind."""
    m = tumbler.system.mechanism
    fresh = m.simulate(0.2, rate=200, tol=1e-8)
    assert "_records" not in fresh.__dict__
    together = np.concatenate([series(part) for part in fresh.parts(size=9)])
    assert "_records" not in fresh.__dict__
    np.testing.assert_allclose(together, series(fresh), rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_parts_of_equilibria():
    """Of equilibria the parts hold the static reactions and not those of a motion."""
    m = Mechanism("hanging", gravity=(0, 0, -9.81))
    block = m.body("block", 2.0, (0.1, 0.1, 0.1))
    guide = m.translational("guide", block, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.translation("lift", guide, polynomial([0.0, 1.0]))
    solution = quasi_static(m, np.linspace(0.0, 1.0, 5))
    parts = [part.com_velocity("block").copy() for part in solution.parts(size=2)]
    np.testing.assert_array_equal(np.concatenate(parts), solution.com_velocity("block"))
    assert np.all(solution.com_velocity("block") == 0.0)
