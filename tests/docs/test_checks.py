"""The numbers of the validation page agree with what they are held against."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest

from tests.docs.support import DOCS


@pytest.fixture(scope="module")
def scripts():
    """Put the scripts of the documentation on the path."""
    sys.path.insert(0, str(DOCS / "scripts"))
    yield
    sys.path.remove(str(DOCS / "scripts"))


@pytest.mark.parametrize(("group", "bound"), [("geometry", 1e-12), ("statics", 5e-4), ("mechanics", 1e-6)])
def test_rows_agree(scripts, group, bound):
    import checks

    for what, expected, found, _ in getattr(checks, group)():
        assert found == pytest.approx(expected, rel=bound, abs=1e-9), what


def test_sensitivity_data_are_those_of_the_grid(scripts):
    import sensitivity

    data = sensitivity.load()
    points = {tuple(point.values()) for point in sensitivity.grid()}
    assert set(data[list(sensitivity.SETTINGS)].drop_duplicates().itertuples(index=False, name=None)) == points
    assert len(data) == len(points) * 8 * 4
    assert np.isfinite(data[["h1", "h2", "h3"]].to_numpy()).all()


def test_claim_ratios_of_a_made_up_table(scripts):
    """One point: the second harmonic rises threefold in the skew plane, everything doubles with the load."""
    import sensitivity

    base = dict.fromkeys(("h1", "h2", "h3"), 1.0)
    states = {
        "healthy": base,
        "skew": base | {"h2": 3.0},
        "inclination": base | {"h2": 0.5},
        "distance": base | {"h3": 0.8},
    }
    rows = [
        {**sensitivity.PRESET, "state": state, "load": load, "component": "line_of_action"}
        | {h: factor * value for h, value in levels.items()}
        for state, levels in states.items()
        for load, factor in (("low", 1.0), ("high", 2.0))
    ]
    ratios = sensitivity.claim_ratios(pd.DataFrame(rows))
    np.testing.assert_allclose(ratios.to_numpy()[0], [3.0, 0.5, 0.8, 2.0, 2.0])


def test_maps_show_themselves_in_a_notebook(scripts):
    """Figures carry their picture with them, also where nothing has set up matplotlib."""
    import sensitivity

    figure = sensitivity.claim_maps(sensitivity.claim_ratios(sensitivity.load()), "speed_rpm", "speed, rpm")
    assert figure._repr_png_().startswith(b"\x89PNG")


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
@pytest.mark.parametrize("changes", [{}, {"depth_mm": 1.0}, {"speed_rpm": 3000}])
def test_sensitivity_data_are_those_of_this_code(scripts, changes):
    """Points simulated again: the preset, the least damped contact, the highest speed."""
    import sensitivity

    point = sensitivity.PRESET | changes
    settings = list(sensitivity.SETTINGS)
    stored = sensitivity.load()
    stored = stored[(stored[settings] == pd.Series(point)[settings]).all(axis=1)]
    again = pd.DataFrame(sensitivity.simulate_point(point, workers=1))
    keys = ["state", "load", "component"]
    one, two = (t.set_index(keys).sort_index()[["h1", "h2", "h3"]].astype(float) for t in (stored, again))
    assert len(one) == 32
    # against the largest harmonic: small ones may be differences of large ones
    scale = one.max(axis=1).to_numpy()[:, None]
    np.testing.assert_allclose(two.to_numpy() / scale, one.to_numpy() / scale, atol=0.02)
