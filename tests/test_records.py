"""What tests read from ``tests/records`` is still what the library makes."""

import numpy as np
import pytest

from tests.identify.levels import CASES, run_stored, with_friction
from tests.make_records import FOLDER, RECORDS, read


def test_records_are_small_and_each_is_made_by_a_function():
    sizes = {path.name: path.stat().st_size for path in FOLDER.iterdir()}
    assert sizes.keys() == RECORDS.keys()
    assert max(sizes.values()) < 300_000
    assert sum(sizes.values()) < 3_000_000


@pytest.mark.slow
@pytest.mark.parametrize("name", RECORDS)
def test_the_library_still_makes_the_record(name):
    made, stored = RECORDS[name](), read(name)
    assert made.sizes == stored.sizes
    for variable in stored.data_vars:
        # rounding decides where an integrator's steps lie, and in which cycle an amplitude jumps
        values = stored[variable].values
        close = np.isclose(
            made[variable].transpose(*stored[variable].dims), values, rtol=0.01, atol=0.01 * values.std()
        )
        assert close.mean() > 0.98, variable


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_levels_between_those_that_are_stored_are_interpolated(name):
    from gearmbs.studies import run_case

    case = with_friction(CASES[name], 0.1)
    found = run_case(case, False, variables=["gmf_rms"])["gmf_rms"].sel(way=["orders"])
    np.testing.assert_allclose(run_stored(case)["gmf_rms"].transpose(*found.dims), found, rtol=0.01)
