"""Cases of the gear pair in campaigns: what is kept is what a single run gives."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import Campaign, CampaignError, DeckSubject, Factor, content_key, load_plan, make_plan
from gearmbs.campaigns.figures import varied_results
from gearmbs.campaigns.subjects.pair import record_numbers
from gearmbs.studies import Case, run_case
from tests.says import says

BASE = Case(operation={"duration": 0.08, "run_up": 0.02, "settling": 0.02})
KEEP = ["harmonics", "contact", "indicators", "signal:line_of_action"]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    plan = make_plan(BASE, [Factor("operation.torque", 80.0, 120.0)], "grid", keep=KEEP, unit=2)
    campaign = Campaign(tmp_path_factory.mktemp("pair") / "c", plan)
    campaign.run(workers=0)
    return campaign


@pytest.mark.slow
def test_what_is_kept(campaign):
    table, data = campaign.table, campaign.open()
    assert list(table.status) == ["done"] * 2
    case = campaign.case(1)
    assert case.operation.torque == 120.0
    record = run_case(case)
    for way in ("band", "orders"):
        for harmonic in (1, 2, 3):
            expected = float(record["gmf_rms"].sel(way=way, component="line_of_action", harmonic=harmonic))
            assert table[f"{way}.line_of_action.{harmonic}"][1] == expected
    signal = record["acceleration"].sel(component="line_of_action").values.astype(np.float32)
    np.testing.assert_array_equal(data.acceleration.sel(case=1).values[0], signal)
    assert data.acceleration.attrs["units"] == "m/s^2"
    assert table["force.mean"][1] / table["force.mean"][0] == pytest.approx(1.5, rel=0.02)


STORED = {"orders.line_of_centres.1": 64.972, "orders.line_of_action.1": 29.238, "orders.line_of_action.2": 33.594}
"""At a tolerance of 1e-9."""


def test_results_are_those_of_before(campaign):
    """An edit that moves them is one of the physics, and the numbers here are to be explained anew."""
    for name, value in STORED.items():
        assert campaign.table[name][1] == pytest.approx(value, rel=0.01)


@pytest.mark.slow
def test_rows_tell_whether_their_records_repeat_themselves(tmp_path):
    plan = make_plan(factors=[Factor("operation.torque", 80.0, 120.0)], design="grid", unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    table = campaign.read(where="record.at_limit < 1")
    assert len(table) == 2
    assert (table["record.deviation"] <= 1e-3).all()
    assert (table["record.apart"] == 0.0).all()
    # they are no results to look for effects in
    assert not any(name.startswith("record.") for name in varied_results(campaign, 20))


def test_records_that_do_not_repeat_themselves_are_told():
    about = {"record_status": "at the limit", "record_apart": 0.25, "record_deviation": np.nan}
    # where nothing could be watched there is no deviation, and no result that is no number
    assert record_numbers(xr.Dataset(attrs=about)) == {"record.at_limit": 1.0, "record.apart": 0.25}
    assert record_numbers(xr.Dataset(attrs=about | {"record_deviation": 0.5}))["record.deviation"] == 0.5
    assert record_numbers(xr.Dataset()) == {}


def test_rates_that_differ_are_named(tmp_path):
    plan = make_plan(BASE, [Factor("operation.speed", "1000 rpm", "3000 rpm")], n=2, keep=KEEP)
    with pytest.raises(CampaignError, match=says("12800", "25600 Hz", "sampling rates")):
        Campaign(tmp_path / "c", plan)


def test_unknown_things_to_keep_are_named():
    with pytest.raises(CampaignError, match="a pair keeps harmonics"):
        make_plan(BASE, [Factor("operation.torque", 80.0, 120.0)], n=2, keep=["everything"])


DECK = """a mass on a spring
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS=${mass}, CM=2, IP=1,1,1, QG=1,0,0
MARKER/2, PART=2
MARKER/3, PART=1
JOINT/1, TRANSLATIONAL, I=2, J=4
MARKER/4, PART=1, REULER=1.5707963267948966, 1.5707963267948966, 0
MARKER/5, PART=2, REULER=1.5707963267948966, 1.5707963267948966, 0
SPRINGDAMPER/1, TRANSLATIONAL, I=2, J=1, K=100, LENGTH=0.5
REQUEST/1, F2=DX(2,1)
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
END
"""


@pytest.mark.slow
def test_a_deck_with_parameters(tmp_path):
    """The mass turns round half a period after its start, on the other side of the relaxed spring."""
    deck = DECK.replace("I=2, J=4", "I=5, J=4")
    subject = DeckSubject(deck, {"mass": 1.0}, end=1.0, steps=200)
    plan = make_plan(subject, [Factor("mass", 1.0, 4.0)], "grid", unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    status = campaign.run(workers=0)
    assert status.failed == 0, campaign.failed().message.tolist()
    np.testing.assert_allclose(campaign.table["request_1.F2.min"], 0.0, atol=2e-3)
    last = 0.5 + 0.5 * np.cos(np.sqrt(100.0 / np.array([1.0, 4.0])))
    np.testing.assert_allclose(campaign.table["request_1.F2.last"], last, atol=2e-3)
    with pytest.raises(CampaignError, match="the places mass"):
        DeckSubject(deck, {}, end=1.0)


def test_a_request_that_is_zero_is_a_result(tmp_path):
    """Of a mass without a spring the speed is 0; what a request does not ask for is no result."""
    deck = DECK.replace("${mass}", "1").replace("K=100", "K=${k}").replace("I=2, J=4", "I=5, J=4")
    assert "REQUEST/1, F2=" in deck
    request = "REQUEST/2, VELOCITY, I=2, J=1\nREQUEST/3, DISPLACEMENT, I=2, J=1\nREQUEST/1, F2="
    subject = DeckSubject(deck.replace("REQUEST/1, F2=", request), {"k": 100.0}, end=0.1, steps=5)
    plan = make_plan(subject, [Factor("k", values=[0.0, 100.0])], "grid", unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    assert campaign.run(workers=0).failed == 0, campaign.failed().message.tolist()
    table = campaign.table
    assert table["request_2.VX.rms"][0] == table["request_2.VX.max"][0] == 0.0
    assert table["request_2.VX.rms"][1] > 0.1
    assert campaign.read(["k"], "request_2.VX.rms < 0.1")["k"].tolist() == [0.0]
    columns = {name.rpartition(".")[0] for name in table if name.startswith("request_")}
    velocities = {"VM", "VX", "VY", "VZ", "WM", "WX", "WY", "WZ"}
    places = {"DM", "DX", "DY", "DZ", "PSI", "THETA", "PHI"}
    assert columns == {"request_1.F2", *(f"request_2.{n}" for n in velocities), *(f"request_3.{n}" for n in places)}


def test_impossible_values_of_a_deck_come_before_any_case(tmp_path):
    plan = make_plan(DeckSubject(DECK, {"mass": 1.0}, end=1.0), [Factor("mass", -1.0, 4.0)], "grid", unit=2)
    with pytest.raises(CampaignError, match=says("2", "mass = -1", "0", "MASS = -1.0")):
        Campaign(tmp_path / "c", plan)


@pytest.mark.slow
def test_a_deck_in_a_plans_file(tmp_path):
    """The deck, its script and its routines stand beside the plan; what is not supported is left out."""
    deck = DECK.replace("I=2, J=4", "I=5, J=4").replace(
        "SPRINGDAMPER/1, TRANSLATIONAL, I=2, J=1, K=100, LENGTH=0.5",
        "SFORCE/1, TRANSLATIONAL, I=2, J=1, FUNCTION=USER(100)\nTIRE/1, J=1",
    )
    (tmp_path / "m.adm").write_text(deck)
    (tmp_path / "m.acf").write_text("a\nb\nsimulate/dynamics, end=1, steps=10\n")
    (tmp_path / "own.py").write_text(
        "def sfosub(call):\n    return -call.parameters[0]*(call.sysfnc('DM', 2, 1)-0.5)\n"
    )
    text = (
        'design = "grid"\nunit = 2\n[subject]\nkind = "deck"\nfile = "m.adm"\nscript = "m.acf"\nroutines = "own.py"\n'
        "skip_unsupported = true\nparameters = { mass = 2.0 }\n[[factor]]\npath = 'mass'\nlow = 1.0\nhigh = 4.0\n"
    )
    (tmp_path / "p.toml").write_text(text)
    plan = load_plan(tmp_path / "p.toml")
    campaign = Campaign(tmp_path / "c", plan)
    assert campaign.run(workers=0).failed == 0, campaign.failed().message.tolist()
    last = 0.5 + 0.5 * np.cos(np.sqrt(100.0 / np.array([1.0, 4.0])))
    np.testing.assert_allclose(campaign.table["request_1.F2.last"], last, atol=1e-5)
    subject = plan.subject
    again = DeckSubject.from_settings(subject.settings())
    thing = subject.check({"mass": 2.0}, "c")
    before = subject.canonical(thing)
    assert again.canonical(thing) == before
    (tmp_path / "own.py").write_text("def sfosub(call):\n    return 0.0\n")
    assert DeckSubject.from_settings(subject.settings()).canonical(thing) != before
    assert subject.canonical(thing) != before
    (tmp_path / "p.toml").write_text(text.replace("[[factor]]", "[[factors]]"))
    with pytest.raises(CampaignError, match=r"write \[\[factor\]\] above each"):
        load_plan(tmp_path / "p.toml")


def test_files_that_a_deck_names_count(tmp_path):
    """Another matrix, or other commands in a file of them, are another case; files that are as they were are none."""
    matrix = "MATRIX/1, FILE=m.mat, NAME=A\nUNITS"
    subject = DeckSubject(
        DECK.replace("UNITS", matrix),
        {"mass": 1.0},
        script="a\nb\nFILE/COMMAND=more\n",
        name=str(tmp_path / "m.adm"),
        skip_unsupported=True,
    )

    def key():
        return content_key("deck", subject.canonical(subject.check({"mass": 2.0}, "c")))

    (tmp_path / "m.mat").write_text("one")
    (tmp_path / "more.acf").write_text("a\nsimulate/dynamics, end=1, steps=10\n")
    first = key()
    files = subject.files()
    (tmp_path / "m.mat").write_text("another")
    second = key()
    # whoever asks once more sees them as they are now
    assert subject.files() != files
    (tmp_path / "more.acf").write_text("a\nsimulate/dynamics, end=2, steps=10\n")
    assert len({first, second, key()}) == 3
    (tmp_path / "m.mat").write_text("one")
    (tmp_path / "more.acf").write_text("a\nsimulate/dynamics, end=1, steps=10\n")
    assert key() == first
    assert subject.files() == files


@pytest.mark.slow
def test_files_that_changed_after_cases_were_done_are_refused(tmp_path):
    """Cases before and behind an edit of what a script reads are of two models; put back, or done again, they run."""
    commands = tmp_path / "more.acf"
    short, long = (f"a\nsimulate/dynamics, end={end}, steps=10\n" for end in ("0.1", "0.2"))
    commands.write_text(short)
    subject = DeckSubject(
        DECK, {"mass": 1.0}, script="a\nb\nFILE/COMMAND=more\n", name=str(tmp_path / "m.adm"), skip_unsupported=True
    )
    campaign = Campaign(tmp_path / "c", make_plan(subject, [Factor("mass", 1.0, 2.0)], "sobol", n=2, unit=1))
    campaign.run(workers=0)
    first = campaign.folder.ledger(0).stat().st_mtime_ns
    commands.write_text(long)
    campaign.extend(4)
    with pytest.raises(CampaignError, match=says("FILE/COMMAND", "--other-code", "again")):
        campaign.run(workers=0)
    assert len(campaign.folder.done()) == 2
    commands.write_text(short)
    campaign.run(workers=0)
    assert len(campaign.folder.done()) == 4
    commands.write_text(long)
    campaign.extend(6)
    assert campaign.run(workers=0, other_code="mix").codes == 2
    assert [line for line in campaign.check() if "2 of 6 units" in line and "FILE/COMMAND" in line]
    commands.write_text(short)
    campaign.run(workers=0, other_code="again")
    status = campaign.status()
    assert (status.done, status.codes) == (6, 1)
    assert campaign.folder.ledger(0).stat().st_mtime_ns == first


OWN = "from stiffness import K\n\n\ndef sfosub(call):\n    return -K * (call.sysfnc('DM', 2, 1) - 0.5)\n"


@pytest.mark.slow
def test_routines_that_are_edited_under_a_run_are_refused(tmp_path, monkeypatch):
    """What they import counts as they do: a unit during which it was edited is none, one before and one after are.

    Python takes compiled files for those of a source of the same second and length: what is edited here is longer.
    """
    (tmp_path / "own.py").write_text(OWN)
    beside = tmp_path / "stiffness.py"
    beside.write_text("K = 100.0\n")
    deck = DECK.replace("I=2, J=4", "I=5, J=4").replace(
        "SPRINGDAMPER/1, TRANSLATIONAL, I=2, J=1, K=100, LENGTH=0.5",
        "SFORCE/1, TRANSLATIONAL, I=2, J=1, FUNCTION=USER(1)",
    )
    subject = DeckSubject(deck, {"mass": 1.0}, end=0.5, steps=5, routines=tmp_path / "own.py")
    plan = make_plan(subject, [Factor("mass", 1.0, 4.0)], "grid", options={"levels": 6}, unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    run, count = DeckSubject.run, iter(range(100))

    def edited(self, *given):
        found = run(self, *given)
        if next(count) == 2:
            beside.write_text("K = 250.50\n")
        return found

    with monkeypatch.context() as patched:
        patched.setattr(DeckSubject, "run", edited)
        with pytest.raises(CampaignError, match=says("stiffness.py", "another content", "--other-code")):
            campaign.run(workers=0)
    assert len(campaign.folder.done()) == 1
    beside.write_text("K = 100.0\n")
    assert campaign.run(workers=0).codes == 1
    last = 0.5 + 0.5 * np.cos(np.sqrt(100.0 / campaign.table["mass"]) * 0.5)
    np.testing.assert_allclose(campaign.table["request_1.F2.last"], last, atol=1e-5)
    beside.write_text("K = 250.50\n")
    assert campaign.run(workers=0, other_code="again").codes == 1
    last = 0.5 + 0.5 * np.cos(np.sqrt(250.5 / campaign.table["mass"]) * 0.5)
    np.testing.assert_allclose(campaign.table["request_1.F2.last"], last, atol=1e-5)


@pytest.mark.slow
def test_variables_of_a_deck_as_factors(tmp_path):
    """A constant VARIABLE, by its id and by its name, and a place in the script."""
    deck = DECK.replace("I=2, J=4", "I=5, J=4").replace("${mass}", "2").replace(
        "SPRINGDAMPER/1, TRANSLATIONAL, I=2, J=1, K=100, LENGTH=0.5",
        "VARIABLE/7, FUNCTION=100\n! adams_view_name='rest'\nVARIABLE/8, FUNCTION=0.5\nVARIABLE/9, FUNCTION=2*TIME\n"
        "SFORCE/1, TRANSLATIONAL, I=2, J=1, FUNCTION=-VARVAL(7)*(DM(2,1)-VARVAL(8))",
    )  # fmt: skip
    script = "a\nb\nsimulate/dynamics, end=${end}, steps=200\n"
    subject = DeckSubject(deck, {"VARIABLE/7": 100.0, "rest": 0.55, "end": 1.0}, script=script)
    factors = [Factor("VARIABLE/7", 50.0, 200.0), Factor("rest", 0.55, 0.6), Factor("end", 0.5, 1.0)]
    campaign = Campaign(tmp_path / "c", make_plan(subject, factors, "grid", options={"levels": 2}, unit=2))
    assert campaign.run(workers=0).failed == 0, campaign.failed().message.tolist()
    table = campaign.table
    stiffness, rest, end = (table[name].to_numpy() for name in ("VARIABLE/7", "rest", "end"))
    exact = rest + (1.0 - rest) * np.cos(np.sqrt(stiffness / 2.0) * end)
    np.testing.assert_allclose(table["request_1.F2.last"], exact, atol=1e-6)
    again = DeckSubject.from_settings(subject.settings())
    assert again.settings() == subject.settings()
    for name in ("VARIABLE/9", "VARIABLE/10", "other"):
        with pytest.raises(CampaignError, match="VARIABLEs whose FUNCTION is a number"):
            DeckSubject(deck, {name: 1.0}, end=1.0)
    with pytest.raises(CampaignError, match=says("end", "script", "analysis", "either")):
        DeckSubject(deck, {"rest": 1.0})
