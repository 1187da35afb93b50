"""What messages of failing integrations recommend fits who reads them: equations, a mechanism, or a case."""

import numpy as np
import pytest

from gearmbs.dae.integrators import messages
from gearmbs.dae.result import Status
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.solve.simulate import ADVICE as MODELLER
from gearmbs.studies import Case, simulate_case
from gearmbs.studies.run.simulation import ADVICE as CASE

SHORT = {"run_up": 0.02, "settling": 0.0, "duration": 0.02}


def swing():
    mechanism = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = mechanism.body("rod", mass=1.0, inertia=(0.1, 0.1, 0.01), position=(0.5, 0, 0))
    mechanism.revolute("pin", rod, mechanism.ground, at=(0, 0, 0), axis=(0, 1, 0))
    return mechanism


def test_a_mechanism_is_not_told_of_jacobians_or_options_it_does_not_have():
    """A smallest step far too large: the run fails at once, with the modeller's advice."""
    solution = swing().simulate(1.0, min_step=0.2, first_step=0.2, tol=1e-10)
    assert solution.status in (Status.STEP_TOO_SMALL, Status.NEWTON_FAILURE)
    assert MODELLER[solution.status] in solution.message
    assert "HMIN" not in solution.message


def test_a_case_is_told_of_its_own_settings():
    solution = simulate_case(Case(operation=SHORT), min_step=1e-3, first_step=1e-3)
    assert solution.status in (Status.STEP_TOO_SMALL, Status.NEWTON_FAILURE)
    assert CASE[solution.status] in solution.message
    assert "solver.integrator" in solution.message


def test_ida_gives_up_a_stuck_run():
    """Five steps allowed where some hundred are needed between two outputs 10 ms apart."""
    case = Case(operation=SHORT, solver={"integrator": "IDA", "output_rate": 100.0, "signal_rate": 100.0})
    solution = simulate_case(case, max_steps=5)
    assert solution.status is Status.SOLVER_FAILURE
    assert CASE[Status.SOLVER_FAILURE] in solution.message
    assert solution.t.size >= 1


@pytest.mark.parametrize("advice", [MODELLER, CASE])
def test_every_failure_has_its_advice(advice):
    problem = swing().compile(0.0).problem()
    problem.advice = advice
    texts = {
        Status.NOT_FINITE: messages.not_finite(problem, 0.1, 3),
        Status.STEP_TOO_SMALL: messages.step_too_small(problem, 0.1, 1e-9, 2, 7.0),
        Status.NEWTON_FAILURE: messages.newton(problem, 0.1, 1e-9, 2),
        Status.TOO_MANY_REJECTIONS: messages.too_many_rejections(problem, 0.1, 1e-9, 2),
    }
    for status, text in texts.items():
        assert text.endswith(advice[status])
        assert messages.ADVICE[status] not in text
    problem.advice = {}
    assert messages.newton(problem, 0.1, 1e-9, 2).endswith(messages.ADVICE[Status.NEWTON_FAILURE])
    assert np.isfinite(problem.y0).all()
