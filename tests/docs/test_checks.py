"""The numbers of the validation page agree with what they are held against."""

from __future__ import annotations

import json
import sys

import numpy as np
import pandas as pd
import pytest

from gearmbs.campaigns import load_plan
from gearmbs.campaigns.subjects.pair import ratios
from gearmbs.files import python_scalar
from tests.docs.support import DOCS


@pytest.fixture(scope="module")
def scripts():
    """Put the scripts of the documentation on the path."""
    sys.path.insert(0, str(DOCS / "scripts"))
    yield
    sys.path.remove(str(DOCS / "scripts"))


@pytest.mark.parametrize(("group", "bound"), [("geometry", 1e-12), ("statics", 5e-4), ("mechanics", 1e-6)])
@pytest.mark.slow
def test_rows_agree(scripts, group, bound):
    import checks

    for what, expected, found, _ in getattr(checks, group)():
        assert found == pytest.approx(expected, rel=bound, abs=1e-9), what


def test_data_of_the_claims_are_those_of_the_plan(scripts):
    import claims

    data = claims.load()
    plan = load_plan(claims.PLAN)
    columns = plan.columns(claims.points(data))
    for name in claims.SETTINGS:
        if columns[name].dtype.kind == "f":
            np.testing.assert_allclose(data[name], columns[name], rtol=3e-4, atol=1e-9)
        else:
            assert list(data[name]) == list(columns[name])
    # all of the sequence up to some point, so that the points fill the space evenly
    assert list(data["index"]) == list(range(len(data)))
    assert claims.facts()["done"] == len(data) + claims.facts()["failed"]
    assert np.isfinite(data[[c for c in data if "." in c]].to_numpy()).all()


def test_claims_of_a_made_up_table(scripts):
    """Of four points the first claim holds at three, the second at two, the third at one."""
    import claims

    ratios = {"misaligned": [2.0, 2.0, 2.0, 0.5], "distance": [3.0, 3.0, 0.5, 0.5], "load": [1.6, 1.4, 1.6, 1.0]}
    data = pd.DataFrame({f"{name}.resultant": values for name, values in ratios.items()})
    verdicts = claims.held(data, "resultant")
    assert verdicts.sum().to_dict() == {"misaligned": 3, "distance": 2, "load": 2, "all": 1}


@pytest.mark.slow
def test_figures_show_themselves_in_a_notebook(scripts):
    """Figures carry their picture with them, also where nothing has set up matplotlib."""
    import claims

    assert claims.maps(claims.load())._repr_png_().startswith(b"\x89PNG")


@pytest.mark.slow
def test_speed_search_is_right_or_refuses(scripts):
    """On records it was not adjusted on; an answer that is wrong is worse than none."""
    import speed_search

    share = speed_search.table(speed_search.outcomes(20, first_seed=5000))
    assert share.loc["easy", "right"] == 100.0
    assert share.loc["usual", "right"] >= 80.0
    assert share.loc["usual", ["multiple", "wrong"]].sum() == 0.0
    assert share.loc["hard", ["multiple", "wrong"]].sum() <= 5.0


@pytest.mark.slow
@pytest.mark.parametrize("point", [0, 5])
def test_data_of_the_claims_are_those_of_this_code(scripts, point):
    """Points simulated again."""
    import claims

    data, plan = claims.load(), load_plan(claims.PLAN)
    row = {name: python_scalar(values[0]) for name, values in plan.columns(plan.points()[point : point + 1]).items()}
    thing = plan.subject.check(plan.data(row), "point")
    again = ratios(plan.subject.run(thing, lambda _: None, plan.keep))
    for name in [c for c in data if "." in c]:
        assert again[name] == pytest.approx(float(data[name][point]), rel=0.02), name


def test_a_kept_table_is_shown_while_its_code_is_what_it_was(scripts, tmp_path, monkeypatch):
    import kept

    script = tmp_path / "made_by.py"
    script.write_text("FACTOR = 2\n")
    made = []

    def make():
        made.append(1)
        return pd.DataFrame({"outcome": ["right", "refused"], "found": [1.5, None]})

    monkeypatch.setattr(kept, "ROOT", tmp_path)
    monkeypatch.setattr(kept, "TABLES", {"own": kept.Kept(make, ("made_by.py",))})
    monkeypatch.setattr(kept, "place", lambda name: tmp_path / f"{name}.json")
    first = kept.kept("own")
    kept.keep("own")
    assert len(made) == 2
    pd.testing.assert_frame_equal(kept.kept("own"), first)
    script.write_text('"""Words."""\n# more of them\nFACTOR = 2\n')
    kept.kept("own")
    assert len(made) == 2
    script.write_text("FACTOR = 3\n")
    kept.kept("own")
    assert len(made) == 3


def test_what_is_kept_has_the_rows_of_the_page(scripts):
    import kept
    import speed_search

    found = json.loads(kept.place("speed_search").read_text(encoding="utf-8"))
    table = pd.DataFrame(found["table"]["data"], columns=found["table"]["columns"])
    assert table.groupby("difficulty").size().to_dict() == dict.fromkeys(speed_search.DIFFICULTIES, 40)
