"""What cannot be told is named."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from gearmbs.identify import (
    CaseProblem,
    Free,
    Identifiability,
    IdentifyError,
    harmonic_table,
    identify,
    rank_experiments,
)
from gearmbs.signals import make_signal
from gearmbs.studies import Case
from tests.identify.levels import CASES, SHORT, run_stored
from tests.says import says

COMPONENTS = ("line_of_action", "line_of_centres")


def test_a_planted_combination_is_named():
    """Only the product of the first two acts; the fourth does nothing."""
    generator = np.random.default_rng(0)
    act, other = generator.standard_normal((2, 20)) * 50.0
    matrix = np.array([act, act, other, np.zeros(20)]).T
    found = Identifiability(["mass", "gain", "speed", "colour"], matrix, np.zeros(4))
    directions = found.undetermined()
    assert [set(parts) for _, parts in directions] == [{"colour"}, {"mass", "gain"}] or [
        set(parts) for _, parts in directions
    ] == [{"mass", "gain"}, {"colour"}]
    text = "\n".join(found.remarks())
    assert "mass and gain can be told only as a combination" in text or "gain and mass" in text
    assert "colour has hardly any influence" in text
    assert "speed" not in text


def test_what_would_tell_them_apart_comes_first():
    matrix = np.array([[10.0, 10.0], [20.0, 20.0]])
    now = Identifiability(["a", "b"], matrix, np.zeros(2))
    ranked = now.worth({"the same again": matrix, "another": np.array([[10.0, -10.0]])})
    assert list(ranked.measurement) == ["another", "the same again"]
    assert ranked.gain[0] > 1e6


@pytest.fixture(scope="module")
def measured():
    """Two loads of the healthy pair, without noise."""
    cases = {"low": CASES["100 N m"], "high": CASES["200 N m"]}
    rows = []
    for name, case in cases.items():
        levels = run_stored(case)["gmf_rms"].sel(way="orders")
        for component in COMPONENTS:
            for k in (1, 2, 3):
                rows.append((name, component, k, float(levels.sel(component=component, harmonic=k)), 0.02))
    return pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"]), cases


@pytest.mark.slow
def test_backlash_of_a_healthy_pair_cannot_be_told(measured):
    table, cases = measured
    with pytest.raises(IdentifyError, match=says("fault.backlash")):
        identify(table, cases, ["friction.dynamic", "fault.backlash"], way="orders")


@pytest.mark.slow
@pytest.mark.parametrize("run", [run_stored, pytest.param(None, marks=pytest.mark.slow, id="simulated")])
def test_friction_is_found_again(measured, run, monkeypatch):
    """From numbers with a gain of three that the fit does not know."""
    if run is not None:
        monkeypatch.setattr("gearmbs.studies.run.simulation.plain_record", run)
    table, cases = measured
    table = table.assign(value=3.0 * table["value"])
    free = [Free("friction.dynamic", 0.035, 0.01, 0.2, also={"friction.static": 2.0})]
    problem = CaseProblem(table, cases, free, gains="one", way="orders")
    found = problem.fit()
    assert found["friction.dynamic"] == pytest.approx(0.05, rel=0.005)
    assert found.freedom == 12 - 1 - 1
    assert problem.simulations < 40


def test_wrong_tables_are_named(measured):
    table, cases = measured
    with pytest.raises(IdentifyError, match=says("measured", "given for high")):
        CaseProblem(table, {"low": cases["low"]}, ["contact.depth"])
    with pytest.raises(IdentifyError, match=says("component", "force")):
        CaseProblem(table.assign(channel="a1"), cases, ["contact.depth"])
    with pytest.raises(IdentifyError, match="no such field"):
        CaseProblem(table, cases, ["contact.deepness"])
    with pytest.raises(IdentifyError, match="columns value are missing"):
        CaseProblem(table.drop(columns="value"), cases, ["contact.depth"])


def test_tables_of_recordings():
    """A tone of known level in noise, cut into sections."""
    rate, gmf = 12800.0, 480.0
    t = np.arange(int(4 * rate)) / rate
    x = 2.0 * np.sin(2 * np.pi * gmf * t) + 0.5 * np.sin(4 * np.pi * gmf * t) + 5.0
    x = x + 0.05 * np.random.default_rng(0).standard_normal(t.size)
    table = harmonic_table({"one": make_signal({"a1": x}, rate, units="m/s^2")}, gmf=gmf, harmonics=2)
    assert list(table.channel) == ["a1", "a1"]
    np.testing.assert_allclose(table["value"], [2.0 / np.sqrt(2), 0.5 / np.sqrt(2)], rtol=0.01)
    assert (table.sigma >= 0.02).all()


def test_a_parameter_of_one_case_and_gains_of_lines():
    cases = {name: Case(operation={"torque": torque}) for name, torque in (("low", 50.0), ("high", 100.0))}
    rows = [(case, a, k, 1.0 + k, 0.02) for case in cases for a in ("a1", "a2") for k in (1, 2, 3)]
    table = pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"])
    free = [Free("high:operation.torque", "100 N m"), "contact.depth"]
    settings = {"gains": "line", "channels": {"a1": "line_of_action", "a2": "line_of_action"}}
    problem = CaseProblem(table, cases, free, **settings)
    assert problem.case("high", [80.0, 1e-4]).operation.torque == 80.0
    assert problem.case("low", [80.0, 1e-4]).operation.torque == 50.0
    assert problem._own("low", [80.0, 2e-4]) == (100.0, 2e-4)
    # whatever path lies between force and sensor, only changes from case to case are left
    gain = np.random.default_rng(0).uniform(0.1, 10.0, (2, 3))
    place = {"a1": 0, "a2": 1}
    table["value"] *= [gain[place[a], k - 1] for _, a, k, *_ in rows]
    again = CaseProblem(table, cases, free, **settings)
    np.testing.assert_allclose(again.measured, problem.measured, atol=1e-12)
    assert problem.lost == 6
    with pytest.raises(IdentifyError, match="there is no case 'middle'"):
        CaseProblem(table, cases, ["middle:operation.torque"], **settings)


@pytest.mark.slow
def test_the_experiment_that_would_tell():
    """Backlash does not show in a healthy pair, and does where both flanks are in contact."""
    cases = {"healthy": Case(operation=SHORT)}
    rows = [("healthy", c, k, 1.0, 0.02) for c in COMPONENTS for k in (1, 2, 3)]
    table = pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"])
    problem = CaseProblem(table, cases, ["friction.dynamic", "fault.backlash"], way="orders")
    candidates = {"torque x 2": {"operation.torque": 2.0}, "misaligned": {"fault.misalignment": "0.5 deg"}}
    ranked = rank_experiments(problem, candidates)
    assert ranked.index[0] == "misaligned"
    assert ranked.gain.iloc[0] > 10 * ranked.gain.iloc[1]
    assert ranked.worst.iloc[0] < 0.3 < ranked.worst.iloc[1]
    with pytest.raises(IdentifyError, match=r"no field 'operation\.heat'"):
        rank_experiments(problem, {"x": {"operation.heat": 2.0}})


@pytest.mark.slow
def test_what_is_unknown_of_a_case_is_unknown_of_experiments_with_it():
    cases = {name: Case(operation={**SHORT, "torque": torque}) for name, torque in (("low", 50.0), ("high", 100.0))}
    rows = [(case, c, k, 1.0, 0.02) for case in cases for c in COMPONENTS for k in (1, 2, 3)]
    table = pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"])
    free = [Free(f"{name}:operation.torque", torque) for name, torque in (("low", 50.0), ("high", 100.0))]
    problem = CaseProblem(table, cases, free, gains="line", way="orders")
    candidates = {"again": {}, "torque x 2": {"operation.torque": 2.0}, "weighed": {"operation.torque": "50 N m"}}
    ranked = rank_experiments(problem, candidates)
    # the same once more is worth at most as much as every value measured twice
    assert 1.0 - 1e-9 <= ranked.gain["again"] <= 2.0**0.5 + 1e-9
    assert ranked.index[0] == "weighed"
    joint = problem.with_case("more", problem.cases["low"].changed(operation={"torque": 100.0}), like="low")
    assert joint.case("more", [60.0, 100.0]).operation.torque == 120.0
