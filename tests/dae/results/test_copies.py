"""Copies of solutions, and what stands in for one in another process."""

import copy
import pickle

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError
from tests.says import says


@pytest.mark.parametrize("options", [{}, {"dense_output": True}])
def test_a_deep_copy_has_numbers_of_its_own(options, tmp_path):
    m = Mechanism("thrown")
    m.body("stone", mass=1.0, inertia=(1.0, 1.0, 1.0), velocity=(2.0, 0.0, 0.0))
    solution = m.simulate(1.0, t_eval=[0.0, 0.5, 1.0], **options)
    for other in (copy.deepcopy(solution), copy.deepcopy([solution])[0]):
        np.testing.assert_array_equal(other.com_position("stone"), solution.com_position("stone"))
        other.t[:] = other.com_position("stone")[:] = other.result.y[:] = 7.0
    np.testing.assert_allclose(copy.copy(solution).com_position("stone")[:, 0], [0.0, 1.0, 2.0], atol=1e-9)
    np.testing.assert_array_equal(solution.t, [0.0, 0.5, 1.0])
    assert solution.result.y.max() < 7.0


def test_a_solution_is_not_pickled_but_what_it_tells_is(tmp_path):
    m = Mechanism("thrown")
    m.body("stone", mass=1.0, inertia=(1.0, 1.0, 1.0), velocity=(2.0, 0.0, 0.0))
    solution = m.simulate(1.0, rate=2.0)
    with pytest.raises(ModelError, match=says("to_dataset", "save", "state_at")):
        pickle.dumps(solution)
    told = pickle.loads(pickle.dumps(solution.to_dataset()))
    assert told.identical(solution.to_dataset())
    state = pickle.loads(pickle.dumps(solution.state_at(0.5)))
    gone_on = m.simulate(1.0, t_eval=[0.5, 1.0], initial=state)
    np.testing.assert_allclose(gone_on.com_position("stone")[-1], solution.com_position("stone")[-1], atol=1e-9)
    assert gm.save(solution, tmp_path / "run.nc").exists()
