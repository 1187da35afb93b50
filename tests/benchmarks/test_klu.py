"""The matrices that KLU is given are those that the package factors."""

import numpy as np
import pytest

from benchmarks.klu import places
from gearmbs.dae.linalg.lu_plan import analyse
from tests.dae.linalg.test_dense_tail import bordered, pattern


@pytest.mark.parametrize("with_tail", [False, True])
def test_entries_of_a_plan_are_found_in_its_matrix(with_tail):
    a = bordered(40, 50, 1)
    indptr, indices, vals = pattern(a)
    plan = analyse(indptr, indices, vals, np.ones(90), with_tail=with_tail)
    assert (plan.tail < 90) == with_tail
    source = np.concatenate([plan.a_src, plan.tail_src])
    rows, columns = places(plan)
    np.testing.assert_array_equal(rows, indices[source])
    np.testing.assert_array_equal(columns, np.repeat(np.arange(90), np.diff(indptr))[source])
    assert len(source) == len(indices)
