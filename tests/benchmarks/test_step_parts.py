"""Parts of a step are timed on a run under way, by the functions that the run itself calls."""

import pytest

from benchmarks.problems.reference import reference_problems
from benchmarks.step_parts import part_costs, warm
from gearmbs.dae.integrators.options import Options


@pytest.mark.slow
def test_each_part_of_a_step_takes_some_time():
    pendulum = reference_problems()["pendulum"].make("SI2")
    costs = part_costs(warm(pendulum, Options(tol=1e-5), 2.0))
    assert {"residual", "Jacobian", "factorisation", "substitution", "next step"} <= set(costs)
    assert all(seconds > 0.0 for seconds in costs.values())
