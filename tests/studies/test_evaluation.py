"""A record of some variables holds the same numbers as that of all."""

from __future__ import annotations

import pytest

from gearmbs.studies import Case, CaseError, run_case
from gearmbs.studies.run.record import VARIABLES

SHORT = {"duration": 0.06, "run_up": 0.02, "settling": 0.02}


@pytest.fixture(scope="module")
def case():
    return Case(operation=SHORT)


@pytest.fixture(scope="module")
def full(case):
    return run_case(case)


@pytest.mark.parametrize("wanted", [[n] for n in VARIABLES] + [["force_2", "gmf_rms"], ["acceleration", "pairs_back"]])
def test_variables_that_are_asked_for(case, full, wanted):
    some = run_case(case, variables=wanted)
    assert set(some.data_vars) == set(wanted) & set(full.data_vars)
    for name in some.data_vars:
        assert some[name].identical(full[name])


def test_unknown_variables(case):
    with pytest.raises(CaseError, match="'force' is unknown"):
        run_case(case, variables=["force"])
