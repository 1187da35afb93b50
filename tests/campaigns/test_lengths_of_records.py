"""What is kept may change how long a case of the gear pair is simulated: then it is another case."""

import pytest

from gearmbs.campaigns import Campaign, Factor, content_key, make_plan
from gearmbs.campaigns.subjects.pair import PairSubject
from gearmbs.campaigns.work import CaseRunner
from gearmbs.studies import Case

PERIODIC = [["harmonics"], ["contact"], ["harmonics", "contact"]]
FULL = [["harmonics", "contact", "signal:line_of_action"], ["indicators"], ["harmonics", "record"]]


def prepared(path, base, keep):
    """Return what is simulated for the first case of a campaign, and its key."""
    made = Campaign(path, make_plan(base, [Factor("operation.torque", 50.0, 60.0)], "grid", keep=keep))
    thing, result = CaseRunner(made.folder, "code").prepare(made.folder.cases(0)[0])
    return thing, result.key


def test_records_as_long_as_their_motion_takes_are_other_cases_than_those_of_one_length(tmp_path):
    periodic = [prepared(tmp_path / f"p{k}", Case(), keep) for k, keep in enumerate(PERIODIC)]
    full = [prepared(tmp_path / f"f{k}", Case(), keep) for k, keep in enumerate(FULL)]
    assert {case.operation.duration for case, _ in periodic} == {"auto"}
    assert {case.operation.duration for case, _ in full} == {Case().operation.longest}
    own = Case(operation={"torque": 50.0}).as_one_of_many()
    assert {key for _, key in periodic} == {content_key("pair", PairSubject().canonical(own), "code")}
    given = prepared(tmp_path / "g", Case(operation={"duration": Case().operation.longest}), FULL[0])
    assert {key for _, key in full} == {given[1]}


@pytest.mark.parametrize("operation", [{"duration": "0.2 s"}, {"speed": [(0.0, "600 rpm"), (1.0, "1200 rpm")]}])
def test_cases_of_a_length_of_their_own_are_the_same_whatever_is_kept(tmp_path, operation):
    base = Case(operation=operation)
    found = {prepared(tmp_path / f"{k}", base, keep)[1] for k, keep in enumerate([*PERIODIC, *FULL])}
    assert len(found) == 1
