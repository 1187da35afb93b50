"""STEP and IMPACT, eq. (10) and (11), are the same in contacts, functions of time and the function language."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.contact.laws import LAW_HUNT_CROSSLEY, friction_law, normal_law
from gearmbs.contact.layout import FRICTION_ADAMS
from gearmbs.dae.equations.loads.time_functions import smooth_step
from gearmbs.mechanism import Mechanism, step

IMPACT = 0
"""Any law that is not Hunt and Crossley's."""
assert IMPACT != LAW_HUNT_CROSSLEY


@pytest.fixture(scope="module")
def evaluate():
    """Return what evaluates an expression of TIME on the times of a body that flies."""
    m = Mechanism("flight")
    m.body("b", 1.0, (1, 1, 1), velocity=(1.0, 0, 0)).marker(name="m")
    solution = m.simulate(2.0, rate=200)
    return lambda text: (solution.t, solution.evaluate(text))


def cubic(x: float) -> float:
    """Eq. (11)."""
    x = min(max(x, 0.0), 1.0)
    return (3.0 - 2.0 * x) * x**2


def test_step_is_one_function(evaluate):
    t, language = evaluate("STEP(TIME, 0.5, -1, 1.5, 3)")
    expected = np.array([-1 + 4 * cubic(x - 0.5) for x in t])
    np.testing.assert_allclose(language, expected, atol=1e-14)
    motion = step(0.5, -1.0, 1.5, 3.0)
    np.testing.assert_allclose([motion(x) for x in t], expected, atol=1e-14)
    np.testing.assert_allclose([-1 + 4 * smooth_step(x - 0.5, 0)[1] for x in t], expected, atol=1e-14)
    # the friction coefficient over the sliding speed falls by the same step
    speeds = np.linspace(0.51, 1.49, 20)
    found = [friction_law(FRICTION_ADAMS, 3.0, 1.0, 0.5, 1.5, v)[0] * v for v in speeds]
    np.testing.assert_allclose(found, [3 - 2 * cubic(v - 0.5) for v in speeds], atol=1e-14)


@pytest.mark.parametrize("rate", [-2000.0, -1.0, 0.0, 2.0])
def test_impact_is_one_law(evaluate, rate):
    """F = max(0, K p^e + C p' S(p/d)) for p > 0: the kernel of the contact and IMPACT of the function language."""
    k, e, c, d = 500.0, 1.3, 4.0, 0.4
    t, language = evaluate(f"IMPACT(1 - TIME, {-rate!r}, 1, {k}, {e}, {c}, {d}) + 0*TIME")
    # IMPACT(q, q', q1, ...) has p = q1 - q = t and p' = -q'
    expected = [max(0.0, k * p**e + c * rate * cubic(p / d)) if p > 0 else 0.0 for p in t]
    kernel = [normal_law(IMPACT, k, e, c, d, p, rate)[0] for p in t]
    np.testing.assert_allclose(kernel, expected, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(language, kernel, rtol=1e-13, atol=1e-12)
