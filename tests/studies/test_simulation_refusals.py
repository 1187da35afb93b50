"""What `run_case` says about settings that belong to the case."""

import pytest

from gearmbs.studies import Case, CaseError, run_case


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"lump": True}, r"lump: is a setting of the case's solver; .*case.changed\(solver=\{'lump': True\}\)"),
        ({"speed": 100.0}, r"speed: is a setting of the case's operation; .*operation=\{'speed': 100.0\}"),
        ({"color": "red"}, r"color: run_case takes a case, progress, mechanism and variables"),
    ],
)
def test_settings_of_the_case_are_refused_by_their_place(settings, message):
    with pytest.raises(CaseError, match=message):
        run_case(Case(), **settings)
