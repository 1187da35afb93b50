"""What is given wrongly is refused in one line, before anything is simulated."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from gearmbs.identify import CaseProblem, Free, IdentifyError, fit, harmonic_table
from gearmbs.identify.measured import load_problem
from gearmbs.signals import make_signal
from gearmbs.studies import Case
from tests.says import says

ROWS = [("a", c, k, 10.0, 0.02) for c in ("line_of_action", "line_of_centres") for k in (1, 2, 3)]
TABLE = pd.DataFrame(ROWS, columns=["case", "channel", "harmonic", "value", "sigma"])
DEPTH = ("contact.depth",)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"measured": "x.csv"}, "measured is a str; give a DataFrame"),
        ({"measured": TABLE.head(0)}, "the table has no rows"),
        ({"measured": TABLE.rename(columns={"value": "rms"})}, "columns value are missing"),
        ({"measured": TABLE.assign(value="a")}, "measured: column value"),
        ({"measured": TABLE.assign(harmonic=1.5)}, "harmonic must be a whole number"),
        ({"measured": TABLE.assign(harmonic=7)}, "harmonic 7; cases give the first 3"),
        ({"cases": {}}, "give a Case, or cases by"),
        ({"way": "peaks"}, "way is 'peaks'; choose one of band, orders"),
        ({"derivatives_by": "hand"}, "derivatives_by is 'hand'; choose one of steady, differences"),
        ({"free": []}, "free: give a parameter"),
        ({"free": [*DEPTH, *DEPTH]}, "free: contact.depth more than once"),
        ({"free": ["fault.plane"]}, "is 'skew', which is no number"),
        ({"free": ["gears.teeth"]}, "which is no number"),
        ({"free": [Free("contact.depth", "1 N")]}, "'1 N' is in N where a quantity in m is expected"),
        ({"free": [Free("contact.depth", 1e-4, 1e-3, 1e-2)]}, "start = 0.0001 is not between low"),
        (
            {"free": [Free("friction.dynamic", 0.05, also={"friction.statc": 2})]},
            "friction.statc: a case has no such",
        ),
        ({"measured": TABLE.assign(case=np.nan)}, "case is missing in a row"),
    ],
)
def test_bad_problems(settings, words):
    given = {"measured": TABLE, "cases": Case(), "free": DEPTH, **settings}
    with pytest.raises(IdentifyError) as error:
        CaseProblem(given.pop("measured"), given.pop("cases"), given.pop("free"), **given)
    assert words in str(error.value)


@pytest.mark.parametrize("column", ["value", "sigma"])
def test_rows_that_weigh_nothing_are_left_out_not_given(column):
    with pytest.raises(IdentifyError, match=says("finite", "sigma")):
        CaseProblem(TABLE.assign(**{column: [1.0] * 5 + [np.inf]}), Case(), DEPTH)


X = np.linspace(0.0, 1.0, 12)
LINE = [Free("a", 1.0), Free("b", 1.0)]


def line(p):
    return p[0] + p[1] * X


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"sigma": [0.1] * 11 + [np.inf]}, ("sigma", "finite")),
        ({"sigma": [0.1] * 3}, ("sigma", "shape")),
        ({"measured": 1j * X}, ("complex",)),
        ({"model": lambda p: line(p) + 0j}, ("complex",)),
        ({"measured": X.reshape(3, 4)}, ("shape", "ravel")),
        ({"free": [LINE[0], LINE[0]]}, ("a", "twice")),
    ],
)
def test_what_least_squares_cannot_weigh(settings, words):
    given = {"model": line, "measured": 2.0 + 3.0 * X, "free": LINE, **settings}
    with pytest.raises(IdentifyError, match=says(*words)):
        fit(**given)
    np.testing.assert_allclose(fit(line, 2.0 + 3.0 * X, LINE, sigma=[0.1] * 12).values, [2.0, 3.0])


def test_profiles_there_are_none_of():
    noisy = 2.0 + 3.0 * X + 0.01 * np.cos(37.0 * X)
    with pytest.raises(IdentifyError, match=says("loss", "huber")):
        fit(line, noisy, LINE, sigma=0.01, loss="huber").profile_interval("a")
    with pytest.raises(IdentifyError, match=says("a", "profile", "inf")):
        fit(lambda p: p[0] * p[1] * X, 3.0 * X, LINE, sigma=0.01).profile("a")
    low, high = fit(line, noisy, LINE, sigma=0.01).profile_interval("a")
    assert low < 2.0 < high


def test_amounts_are_told_by_their_share_as_logarithms_are(monkeypatch):
    def predictions(self, points):
        return [np.log(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])) * (p[0] / 1e-4) for p in points]

    monkeypatch.setattr(CaseProblem, "predictions", predictions)
    free = [Free("contact.depth", 1e-4, log=log) for log in (True, False)]
    tables = [CaseProblem(TABLE, Case(), one, derivatives_by="differences").identifiability().table() for one in free]
    np.testing.assert_allclose(tables[0]["together"], tables[1]["together"], rtol=1e-3)


def test_one_case_and_one_parameter_will_do():
    problem = CaseProblem(TABLE, Case(), "contact.depth")
    assert list(problem.cases) == ["a"]
    assert [f.name for f in problem.free] == ["contact.depth"]
    # a search that has lost its way has no values there, and simulates nothing
    assert np.isnan(problem.predictions([np.array([np.nan])])[0]).all()
    assert problem.simulations == 0


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"measured": [1.0, np.nan, 2.0]}, "every measured value must be finite"),
        ({"model": lambda p: np.ones(4)}, "the model returned shape (4,) for (3,) values"),
        ({"free": []}, "free is empty"),
        ({"loss": "l1"}, "loss is 'l1'; choose one of linear"),
        ({"starts": 0}, "starts = 0; give a whole number"),
    ],
)
def test_bad_fits(settings, words):
    given = {"model": lambda p: p[0] * np.ones(3), "measured": [1.0, 1.1, 2.0], "free": [Free("a", 1.0)], **settings}
    with pytest.raises(IdentifyError) as error:
        fit(given.pop("model"), given.pop("measured"), given.pop("free"), **given)
    assert words in str(error.value)


def test_noise_known_up_to_a_factor():
    """A model with more scatter than was said: the report says so, and the factor may be estimated instead."""
    x = np.linspace(0.0, 1.0, 40)
    y = 2.0 * np.exp(-0.5 * x) + 0.05 * np.random.default_rng(4).standard_normal(40)
    free = [Free("a", 1.0), Free("b", -1.0, log=False)]

    def model(p):
        return p[0] * np.exp(p[1] * x)

    told, scaled = (fit(model, y, free, sigma=0.01, absolute_sigma=known) for known in (True, False))
    np.testing.assert_allclose(told.values, scaled.values, rtol=1e-9)
    np.testing.assert_allclose(scaled.errors, told.errors * np.sqrt(told.chi_square), rtol=1e-6)
    assert "larger than the noise that was given explains" in told.report()
    assert "larger than the noise" not in fit(model, y, free, sigma=0.05).report()
    assert "larger than the noise" not in scaled.report()
    with pytest.raises(IdentifyError, match="level = 95"):
        told.interval("a", 95)


def test_numbers_as_names_of_cases():
    """A column of numbers is what a table of cases 1 and 2 is read as."""
    problem = CaseProblem(TABLE.assign(case=1), {1: Case()}, DEPTH)
    assert list(problem.cases) == ["1"]
    assert set(problem.table["case"]) == {"1"}
    for factor in (np.nan, "2"):
        with pytest.raises(IdentifyError, match=says("also", "friction.static")):
            Free("friction.dynamic", 0.05, also={"friction.static": factor})


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"sections": 0}, "sections = 0"),
        ({"sections": 2.5}, "sections = 2.5"),
        ({"harmonics": 0}, "harmonics = 0"),
        ({"way": "foo"}, "way 'foo'"),
        ({"floor": np.nan}, "floor = nan"),
        ({"floor": -1.0}, "floor = -1"),
        ({"channels": ["zz"]}, "channel 'zz'"),
        ({"channels": "a"}, "channel 'a'"),
    ],
)
def test_bad_settings_of_tables(settings, words):
    rate = 12800.0
    x = np.sin(2 * np.pi * 500.0 * np.arange(1 << 14) / rate)
    signal = make_signal({"a1": x, "a2": x}, rate, units="m/s^2").assign_attrs(speed=40 * np.pi, teeth=25)
    with pytest.raises(IdentifyError, match=re.escape(words)):
        harmonic_table({"a": signal}, **settings)
    table = harmonic_table({"a": signal}, channels="a1", sections=2, harmonics=1)
    assert table["channel"].tolist() == ["a1"]
    assert table["value"][0] == pytest.approx(np.sqrt(0.5), rel=1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("starts = 2.7", "starts = 2.7"),
        ("workers = 0", "workers = 0"),
        ("case = 3", "case = 3"),
        ('channels = ["a"]', "channels = ['a']"),
        ("[case]\na = 3", "case = "),
    ],
)
def test_files_whose_sections_are_none(tmp_path, text, words):
    TABLE.drop(columns="case").to_csv(tmp_path / "a.csv", index=False)
    file, rest = tmp_path / "fit.toml", '[recording]\na = "a.csv"\n[[free]]\npath = "contact.depth"\n'
    file.write_text(f"{text}\n{rest}")
    with pytest.raises(IdentifyError, match=re.escape(words)):
        load_problem(file)
    for wrong in ("free = ['contact.depth']\n[recording]\na = 'a.csv'\n", rest.replace('"a.csv"', "5")):
        file.write_text(wrong)
        with pytest.raises(IdentifyError, match="page on identification"):
            load_problem(file)
    file.write_text(f"starts = 3\n{rest}")
    assert load_problem(file)[1]["starts"] == 3


def test_bad_recordings(tmp_path):
    with pytest.raises(IdentifyError, match=says("give recordings")):
        harmonic_table(np.zeros(100))
    with pytest.raises(IdentifyError, match=says("time and channels")):
        harmonic_table({"a": np.zeros(100)})
    TABLE.drop(columns="case").to_csv(tmp_path / "a.csv", index=False)
    file = tmp_path / "fit.toml"
    for text, words in (
        ("[[free]]\nstart = 1\n", "path is missing"),
        ('[[free]]\npath = "contact.depth"\nsart = 1\n', "unknown key 'sart'"),
        (
            '[case.b.operation]\ntorque = 1\n[[free]]\npath = "contact.depth"\n',
            says("case.b", "recording"),
        ),
    ):
        file.write_text('[recording]\na = "a.csv"\n' + text)
        with pytest.raises(IdentifyError, match=words):
            load_problem(file)
