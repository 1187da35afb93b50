"""As many points as a control program takes, and states after longer times: bit for bit what one run gives."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.studies.run.simulation import case_mechanism
from tests.mechanism.test_stepping import PAIR, flexible_pair, planets, rolling_train


def pair():
    """The pair of the paper."""
    return case_mechanism(gm.Case()), PAIR


MODELS = [pair, planets, rolling_train, flexible_pair]


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_two_thousand_points_are_outputs_of_one_run(model):
    """One each 0.1 ms."""
    m, options = model()
    times = np.linspace(0.0, 0.2, 2001)
    sim = gm.Simulator(m, 0.2, **options)
    for t in times[1:].tolist():
        sim.advance(t)
    found, one = sim.solution(), m.simulate(0.2, t_eval=times, **options)
    np.testing.assert_array_equal(found.result.y, one.result.y)
    np.testing.assert_array_equal(found.result.yp, one.result.yp)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_restored_after_a_second(model, tmp_path):
    """Gone on from in place, and by a run from a file."""
    m, options = model()
    end, times = 1.2, np.linspace(0.0, 1.2, 61)
    whole = m.simulate(end, t_eval=times, **options)
    sim = gm.Simulator(m, end, **options)
    for t in times[1:51].tolist():
        sim.advance(t)
    state = sim.state()
    path = state.save(tmp_path / "state.npz")
    sim.advance(end)
    sim.restore(state)
    for t in times[51:].tolist():
        sim.advance(t)
    np.testing.assert_array_equal(sim.solution().result.y, whole.result.y)
    run = m.simulate(end, t_eval=times[50:], initial=gm.State.load(path), **options)
    np.testing.assert_array_equal(run.result.y, whole.result.y[50:])
