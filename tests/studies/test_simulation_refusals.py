"""What `run_case` says about settings that belong to the case."""

import pytest

from gearmbs.studies import Case, CaseError, run_case
from tests.says import says


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"lump": True}, says("case.changed", "solver=", "'lump'", "True")),
        ({"speed": 100.0}, says("operation=", "'speed'", "100.0")),
        ({"color": "red"}, says("color", "run_case", "case")),
    ],
)
def test_settings_of_the_case_are_refused_by_their_place(settings, message):
    with pytest.raises(CaseError, match=message):
        run_case(Case(), **settings)
