"""What is given wrongly is refused in one line, before anything is simulated."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from gearmbs.identify import CaseProblem, Free, IdentifyError, fit, harmonic_table
from gearmbs.identify.measured import load_problem
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
    ],
)
def test_bad_problems(settings, words):
    given = {"measured": TABLE, "cases": Case(), "free": DEPTH, **settings}
    with pytest.raises(IdentifyError) as error:
        CaseProblem(given.pop("measured"), given.pop("cases"), given.pop("free"), **given)
    assert words in str(error.value)


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
