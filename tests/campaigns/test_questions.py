"""What is asked of results, against analytic answers."""

from __future__ import annotations

import warnings

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats
from scipy.io import loadmat
from scipy.stats import qmc
from typer.testing import CliRunner

from gearmbs.campaigns import (
    Campaign,
    CampaignError,
    CampaignWarning,
    Choice,
    Factor,
    FunctionSubject,
    condition_map,
    fit_chaos,
    fit_surface,
    main_effects,
    make_plan,
    morris_effects,
    sobol_indices,
    total_bounds,
)
from gearmbs.campaigns.plans.designs import factorial, morris, plackett_burman, saltelli, sequence
from gearmbs.cli import app
from tests.campaigns.models import PI, PLACES, adding
from tests.campaigns.support import function, ranges, small
from tests.says import says

NAMES = ["x1", "x2", "x3"]
FIRST, TOTAL = (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437)
"""Ishigami's function with a = 7 and b = 0.1."""


def _values(u):
    x = PI * (2.0 * u - 1.0)
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_sobol_indices_of_ishigami():
    found = sobol_indices(_values(saltelli(8192, 3, 0)), NAMES)
    np.testing.assert_allclose(found.first, FIRST, atol=0.01)
    np.testing.assert_allclose(found.total, TOTAL, atol=0.01)
    assert found.variance == pytest.approx(13.845, rel=0.01)


def test_sobol_estimators_on_fixed_numbers():
    """The estimators written out for each factor, with the normalisation of a well-known library."""
    n, d = 64, 3
    y = _values(saltelli(n, d, 1)).reshape(n, d + 2)
    z = (y - y.mean()) / y.std()
    found = sobol_indices(y.ravel(), NAMES)
    for k in range(d):
        variance = np.var(np.concatenate([z[:, 0], z[:, -1]]))
        assert found.first[k] == pytest.approx(np.mean(z[:, -1] * (z[:, k + 1] - z[:, 0])) / variance, rel=1e-12)
        assert found.total[k] == pytest.approx(np.mean((z[:, 0] - z[:, k + 1]) ** 2) / 2 / variance, rel=1e-12)


@pytest.mark.slow
def test_confidence_covers_the_spread_over_seeds():
    found = [sobol_indices(_values(qmc_free(256, seed)), NAMES, seed=seed) for seed in range(40)]
    inside = [np.abs(f.total - TOTAL) <= f.total_confidence for f in found]
    assert np.mean(inside) > 0.88


def qmc_free(n, seed):
    """A Saltelli design of independent points, whose spread is that of random sampling."""
    generator = np.random.default_rng(seed)
    a, b = generator.random((2, n, 3))
    rows = [a, *(np.where(np.arange(3) == k, b, a) for k in range(3)), b]
    return np.stack(rows, axis=1).reshape(-1, 3)


@pytest.mark.slow
def test_control_variates_narrow_the_intervals_around_the_same_truth():
    """Over independent designs: a fraction of the width, no bias, and intervals that cover."""
    truth = np.array([FIRST, TOTAL])
    errors, inside, widths = [], [], []
    for seed in range(30):
        points = qmc_free(128, seed)
        y = _values(points)
        plain, found = (sobol_indices(y, NAMES, points=given, seed=seed) for given in (None, points))
        half = np.array([found.first_confidence, found.total_confidence])
        errors.append(np.array([found.first, found.total]) - truth)
        inside.append(np.abs(errors[-1]) <= half)
        widths.append(half.max() / max(plain.first_confidence.max(), plain.total_confidence.max()))
    assert found.explained > 0.9
    assert np.median(widths) < 0.35
    assert np.mean(inside) > 0.88
    # four standard errors of the mean
    assert (np.abs(np.mean(errors, axis=0)) < 4.0 * np.std(errors, axis=0) / np.sqrt(len(errors))).all()


def test_control_variates_that_follow_nothing_do_no_harm():
    points = saltelli(128, 3, 0)
    y = np.sign(np.sin(97.0 * points @ [1.0, 3.0, 7.0]))
    plain, found = (sobol_indices(y, NAMES, points=given) for given in (None, points))
    assert found.explained < 0.1
    np.testing.assert_allclose(found.total, plain.total, atol=0.1)
    np.testing.assert_allclose(found.total_confidence, plain.total_confidence, rtol=0.2)


def test_control_variates_need_some_points():
    """With too few to fit anything the plain estimate stands."""
    points = saltelli(4, 3, 0)
    plain, found = (sobol_indices(_values(points), NAMES, points=given) for given in (None, points))
    np.testing.assert_array_equal(found.total, plain.total)
    assert found.explained == 0.0


def test_points_without_results_are_left_out_as_blocks():
    y = _values(saltelli(1024, 3, 0))
    y[7] = np.nan
    found = sobol_indices(y, NAMES)
    assert (found.base_points, found.left_out) == (1023, 1)
    np.testing.assert_allclose(found.total, TOTAL, atol=0.05)


def test_morris_of_a_linear_function_is_exact():
    points = morris(20, 3, 0)
    table = morris_effects(points @ [1.0, -3.0, 0.0], points, NAMES)
    assert list(table.index) == ["x2", "x1", "x3"]
    np.testing.assert_allclose(table.mu, [-3.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(table.sigma, 0.0, atol=1e-12)


def test_the_confidence_of_elementary_effects_is_that_of_their_mean():
    """Student's interval of the absolute values; of one trajectory there is none, of a linear function it is zero."""
    points = morris(5, 3, 0)
    y = points[:, 0] ** 2 + points[:, 1]
    size = [abs(np.diff(y[4 * k : 4 * k + 4])) for k in range(5)]
    moved = [np.abs(np.diff(points[4 * k : 4 * k + 4], axis=0)).argmax(axis=1) for k in range(5)]
    effects = np.array([(s * 1.5)[list(m).index(0)] for s, m in zip(size, moved)])
    half = stats.t.ppf(0.975, 4) * stats.sem(effects)
    table = morris_effects(y, points, NAMES)
    np.testing.assert_allclose(table.loc["x1", ["mu_star", "confidence"]], [effects.mean(), half], rtol=1e-12)
    np.testing.assert_allclose(table.confidence["x2"], 0.0, atol=1e-12)
    assert morris_effects(y[:4], points[:4], NAMES)[["sigma", "confidence"]].isna().all(axis=None)


@pytest.mark.parametrize(
    ("factor", "effect"),
    [
        (Factor("x1", values=[0, 10]), 10.0),
        (Factor("x1", values=[0.0, 1.0]), 1.0),
        (Factor("x1", values=[0, 1, 2]), 2.0),
        (Factor("x1", values=[1, 10, 100]), 99.0),
        (Factor("x1", 1, 3, whole=True), 2.0),
        (Factor("x1", 1.0, 3.0), 2.0),
    ],
)
def test_morris_effects_are_those_of_the_steps_that_values_made(factor, effect):
    """Of a linear function the change over the range, whatever values stand for the coordinates."""
    plan = make_plan(function(), [factor, Factor("x2", 0.0, 2.0)], "morris", n=40)
    points = plan.points()
    columns = plan.columns(points)
    table = morris_effects(columns["x1"] + 2.0 * columns["x2"], points, ["x1", "x2"], places=plan.places(points))
    np.testing.assert_allclose(table.mu_star[["x1", "x2"]], [effect, 4.0], rtol=1e-12)
    np.testing.assert_allclose(table.sigma, 0.0, atol=1e-12)


def test_morris_effects_of_what_has_no_order_are_those_of_an_exchange():
    """Of two alternatives the change; the range of an option counts where that is chosen."""
    choice = Choice("x1", {"low": 0.0, "one": {"kind": "a", "size": (2, 5)}}, name="which")
    plan = make_plan(function(), [choice, Factor("x2", values=["a", "b"])], "morris", n=60)
    points = plan.points()
    columns = plan.columns(points)
    y = np.nan_to_num(columns["which.size"]) + 7.0 * (columns["x2"] == "b")
    table = morris_effects(y, points, ["which", "size", "x2"], places=plan.places(points))
    assert table.mu_star["x2"] == pytest.approx(7.0, rel=1e-12)
    assert 2.0 <= table.mu_star["which"] <= 5.0
    # 3 where the option is chosen, else nothing
    chosen = table.mu_star["size"] / 3.0
    assert chosen * 60 == pytest.approx(round(chosen * 60), abs=1e-9)


def test_main_effects_and_interactions():
    runs = factorial(3)
    y = 1.0 + 2.0 * runs[:, 0] - 0.5 * runs[:, 1] * runs[:, 2]
    table = main_effects(runs, y, NAMES)
    assert table.effect["x1"] == pytest.approx(4.0)
    assert table.effect["x2 x x3"] == pytest.approx(-1.0)
    assert table.effect.drop(["x1", "x2 x x3"]).abs().max() < 1e-12
    # without one corner the effects are mixed with each other
    with pytest.raises(CampaignError, match=says("1 of 8", "factorial")):
        main_effects(runs, np.where(np.arange(8) == 3, np.nan, y), NAMES)


@pytest.mark.slow
def test_results_that_are_missing_are_told(tmp_path):
    """With all of them nothing is said."""
    campaign = small(tmp_path / "c", "picky", design="one at a time")
    campaign.run(workers=0)
    count = campaign.status().failed
    assert count > 0
    with pytest.warns(CampaignWarning, match=says("y", f"{count} of {campaign.folder.case_count}")):
        campaign.sensitivity("y")
    whole = small(tmp_path / "d", design="one at a time")
    whole.run(workers=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        whole.sensitivity("y")


@pytest.mark.slow
def test_points_that_constraints_left_out_are_no_design(tmp_path):
    """The results of the others would be taken for those of other points."""
    factors = [Factor(name, -1.0, 1.0, levels=3) for name in ("x1", "x2")]
    for design in ("one at a time", "factorial", "grid", "sobol"):
        plan = make_plan(function(), factors, design, n=16 * (design == "sobol"), constraints=["x1 + x2 < 1"], unit=16)
        campaign = Campaign(tmp_path / design, plan)
        campaign.run(workers=0)
        with pytest.raises(CampaignError, match=says("constraints", "design")):
            campaign.sensitivity("y")


def test_response_surface_tells_its_own_error():
    u = qmc.Sobol(2, rng=np.random.default_rng(0)).random(64)
    exact = fit_surface(u, 1 + u[:, 0] - u[:, 0] * u[:, 1], ["a", "b"])
    assert exact.q_squared == pytest.approx(1.0)
    assert exact.predict(np.array([[0.25, 0.5]]))[0] == pytest.approx(1.125)
    rough = fit_surface(u, np.sin(12 * u[:, 0]), ["a", "b"])
    v = np.random.default_rng(1).random((2000, 2))
    real = np.sqrt(np.mean((rough.predict(v) - np.sin(12 * v[:, 0])) ** 2))
    assert rough.error == pytest.approx(real, rel=0.25)
    with pytest.raises(CampaignError, match="do not determine"):
        fit_surface(u[:4], u[:4, 0], ["a", "b"])


@pytest.mark.slow
def test_from_campaign_to_report(tmp_path):
    campaign = Campaign(tmp_path / "c", make_plan(function(), ranges(), "saltelli", n=256, unit=512))
    campaign.run(workers=0)
    found = campaign.sensitivity("y")
    np.testing.assert_allclose(found.total, TOTAL, atol=0.05)
    assert found.total_confidence.max() < 0.05
    page = campaign.report(tmp_path / "report.html").read_text()
    assert "Sobol' indices" in page
    assert "data:image/png;base64" in page
    with pytest.raises(CampaignError, match="result 'z' is unknown"):
        campaign.sensitivity("z")


@pytest.mark.slow
def test_condition_map(tmp_path):
    campaign = small(tmp_path / "c", n=512, unit=256, keep=["numbers"])
    campaign.run(workers=0)
    share, counts, _, edges = condition_map(campaign, "x2 > 0", "x1", "x2", bins=4)
    assert counts.sum() == 512
    np.testing.assert_allclose(share[:2], 0.0)
    np.testing.assert_allclose(share[2:], 1.0)
    assert abs(edges[2]) < 0.05
    picture = tmp_path / "map.png"
    command = ["campaign", "map", str(campaign.path), "x2 > 0", "--across", "x1", "--along", "x2", "-o", str(picture)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    assert picture.read_bytes().startswith(b"\x89PNG")
    found = campaign.sensitivity("y")
    assert found.q_squared > 0.9
    np.testing.assert_allclose(found.indices, [FIRST, TOTAL], atol=0.05)
    assert campaign.response_surface("y").q_squared < 0.9
    page = campaign.report(tmp_path / "r.html").read_text()
    assert "indices from the points at hand" in page
    assert "Response surface of degree 2" in page


@pytest.mark.slow
def test_exports(tmp_path):
    campaign = small(tmp_path / "c", n=16)
    campaign.run(workers=0)
    table = campaign.table
    (csv,) = campaign.export(tmp_path / "t.csv", "csv")
    np.testing.assert_allclose(pd.read_csv(csv).y, table.y)
    (nc,) = campaign.export(tmp_path / "t.nc", "netcdf")
    with xr.open_dataset(nc) as data:
        np.testing.assert_array_equal(data.y, table.y)
        assert data.wave.shape == (16, 1, 50)
    (mat,) = campaign.export(tmp_path / "t.mat", "matlab")
    np.testing.assert_array_equal(loadmat(mat)["y"].ravel(), table.y)
    (file,) = campaign.export(tmp_path / "hf", "parquet")
    rows = pd.read_parquet(file)
    np.testing.assert_array_equal(rows["signal.wave"][3], campaign.open().wave.values[3, 0])
    *files, card = campaign.export(tmp_path / "shared", "hf", split_by="point", test=0.25)
    parts = {path.name.split("-")[0]: set(pd.read_parquet(path).point) for path in files}
    assert {name: len(points) for name, points in parts.items()} == {"train": 12, "test": 4}
    assert not parts["train"] & parts["test"]
    front = card.read_text().split("---")[1]
    assert front.count("split:") == 2
    assert "  - split: test\n    path: data/test-*.parquet" in front
    with pytest.raises(CampaignError, match="no such column"):
        campaign.export(tmp_path / "y", "hf", split_by="specimen")
    with pytest.raises(CampaignError, match="choose one of csv"):
        campaign.export(tmp_path / "x", "xml")


def test_chaos_of_a_polynomial_is_exact():
    """x + 2 y z with z of two values: the parts of the variance are known."""
    u = np.random.default_rng(2).random((300, 3))
    x, y, z = 2 * u[:, 0] - 1, 2 * u[:, 1] - 1, np.where(u[:, 2] < 0.5, -1.0, 1.0)
    found = fit_chaos(u, x + 2 * y * z, ["x", "y", "z"], levels=(0, 0, 2))
    np.testing.assert_allclose(found.indices, [[0.2, 0, 0], [0.2, 0.8, 0.8]], atol=1e-12)
    assert found.interaction("y", "z") == pytest.approx(0.8)
    assert found.q_squared == pytest.approx(1.0)
    np.testing.assert_allclose(found.predict(u), x + 2 * y * z, atol=1e-12)
    with pytest.raises(CampaignError, match=says("polynomial chaos", "depends", "factors")):
        fit_chaos(u, np.ones(300), ["x", "y", "z"])
    with pytest.raises(CampaignError, match="draw more points"):
        fit_chaos(u[:3], x[:3], ["x", "y", "z"])


@pytest.mark.slow
def test_a_sum_that_explains_little_says_so():
    """Its intervals are not those of the result; one that explains it all has nothing to say."""
    points = sequence("random", 64, 3, 1)
    with pytest.warns(CampaignWarning, match=says("polynomial chaos", "%", "saltelli")):
        found = fit_chaos(points, _values(points), NAMES)
    assert found.q_squared < 0.9
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit_chaos(points, points @ [1.0, 2.0, 3.0], NAMES)


@pytest.mark.slow
def test_one_factor_studies(tmp_path):
    factors = [Factor(name, -1.0, 1.0, levels=5) for name in ("x1", "x2")]
    campaign = Campaign(tmp_path / "c", make_plan(function(), factors, "one at a time", unit=16))
    campaign.run(workers=0)
    table = campaign.sensitivity("y")
    assert list(table.index.get_level_values(0)) == ["x1"] * 5 + ["x2"] * 5
    at = np.linspace(-1.0, 1.0, 5)
    np.testing.assert_allclose(table.result["x1"], np.sin(at), atol=1e-12)
    np.testing.assert_allclose(table.sensitivity["x1"].iloc[2], np.sin(0.5) / 0.5)
    np.testing.assert_allclose(table.change["x2"], 7 * np.sin(at) ** 2, atol=1e-12)
    assert "One factor after the other" in campaign.report(tmp_path / "r.html", ["y"]).read_text()


@pytest.mark.slow
def test_bounds_hold_the_truth_however_bad_the_surrogate():
    """Ishigami's total indices, from points as they are, and with noise that no surrogate explains."""
    pytest.importorskip("sklearn")
    u = sequence("sobol", 256, 3, 5)
    y, truth = _values(u), np.array(TOTAL)
    found = total_bounds(u, y, NAMES)
    assert found.q_squared > 0.8
    assert (found.low <= truth).all()
    assert (truth <= found.high).all()
    assert (found.sure_low <= found.low).all()
    assert (found.sure_high >= found.high).all()
    # noise as of a further factor of half the variance: all indices are half, and 0.5 more may be anyone's
    noisy = total_bounds(u, y + y.std() * np.random.default_rng(1).standard_normal(256), NAMES)
    assert noisy.q_squared < 0.6
    assert (noisy.sure_low <= 0.5 * truth).all()
    assert (0.5 * truth <= noisy.sure_high).all()
    assert list(found.table().index) == NAMES
    with pytest.raises(CampaignError, match="draw more points"):
        total_bounds(u, np.ones(256), NAMES)


def _additive(u):
    return u[:, 0] + 0.5 * u[:, 1] + 0.05 * u[:, 2]


def _with_noise(u):
    """Ishigami's function and noise of RMS 0.7 of its own."""
    return _values(u) + 2.6 * np.random.default_rng(int(1e6 * u[0, 0])).standard_normal(len(u))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "truth"),
    [
        (_values, TOTAL),
        (_additive, np.array([1.0, 0.25, 0.0025]) / 1.2525),
        (_with_noise, np.array(TOTAL) * 13.845 / (13.845 + 2.6**2)),
    ],
)
def test_bounds_of_random_points_are_in_order_and_hold(function, truth, monkeypatch):
    """Independent random points, whose moments agree with no integral."""
    pytest.importorskip("sklearn")
    from sklearn.gaussian_process.kernels import Matern, WhiteKernel

    # the bounds hold for any surrogate; the kernel's likeliest lengths are what takes the time
    monkeypatch.setattr("gearmbs.campaigns.sobol_bounds._lengths", lambda x, y: Matern(1.0, nu=1.5) + WhiteKernel(0.01))
    held = []
    for seed in range(4):
        u = np.random.default_rng(seed).random((80, 3))
        found = total_bounds(u, function(u), NAMES)
        assert (found.sure_low >= 0.0).all()
        assert (found.sure_low <= found.low).all()
        assert (found.low <= found.high).all()
        assert (found.high <= found.sure_high).all()
        assert (found.sure_high <= 1.0).all()
        held += list((found.sure_low <= truth) & (truth <= found.sure_high))
    assert np.mean(held) >= 0.95 - 1.0 / len(held)


@pytest.mark.slow
def test_bounds_of_noise_are_all_there_is(monkeypatch):
    pytest.importorskip("sklearn")
    from sklearn.gaussian_process.kernels import Matern, WhiteKernel

    monkeypatch.setattr("gearmbs.campaigns.sobol_bounds._lengths", lambda x, y: Matern(1.0, nu=1.5) + WhiteKernel(0.01))
    u = np.random.default_rng(2).random((60, 3))
    with pytest.warns(UserWarning, match=says("60", "0", "1", "explains nothing")):
        found = total_bounds(u, np.random.default_rng(5).standard_normal(60), NAMES)
    assert found.sure_low.tolist() == found.low.tolist() == [0.0] * 3
    assert found.sure_high.tolist() == found.high.tolist() == [1.0] * 3


@pytest.mark.slow
def test_bounds_of_a_few_levels():
    """Two values of a factor: y = x1 + 3 x2, whose parts are 1/12 and 9/4 of 28/12 ... in closed form."""
    pytest.importorskip("sklearn")
    u = sequence("sobol", 128, 2, 3)
    y = u[:, 0] + 3.0 * (u[:, 1] >= 0.5)
    truth = np.array([1.0 / 12.0, 9.0 / 4.0]) / (1.0 / 12.0 + 9.0 / 4.0)
    found = total_bounds(u, y, ["a", "b"], levels=[0, 2])
    assert (found.sure_low <= truth).all()
    assert (truth <= found.sure_high).all()
    assert found.low[1] > 0.9


def named(x: float) -> dict[str, float]:
    """Return results whose names differ in what MATLAB does not take, and beyond what it takes."""
    long = "a" * 70
    return {"a.b": x, "a_b": 2.0 * x, f"{long}.1": 3.0 * x, f"{long}.2": 4.0 * x, "weg_ä": 5.0 * x}


@pytest.mark.slow
def test_columns_that_matlab_would_name_alike_are_told_apart(tmp_path):
    subject = FunctionSubject(named, {"x": 0.0})
    campaign = Campaign(tmp_path / "c", make_plan(subject, [Factor("x", 1.0, 2.0)], n=2))
    campaign.run(workers=0)
    with pytest.warns(CampaignWarning) as told:
        (mat,) = campaign.export(tmp_path / "t.mat", "matlab")
    assert len(told) == 2
    assert "a_b_2" in str(told[0].message)
    found, x = loadmat(mat), campaign.table["x"]
    long = "a" * 63
    # what MATLAB takes as it is stays
    for name, times in (("a_b", 2.0), ("a_b_2", 1.0), (long, 3.0), (f"{long[:61]}_2", 4.0), ("weg__", 5.0)):
        np.testing.assert_allclose(found[name].ravel(), times * x)


def test_columns_whose_names_matlab_tells_apart_keep_them(tmp_path):
    campaign = small(tmp_path / "c", n=2)
    campaign.run(workers=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", CampaignWarning)
        (mat,) = campaign.export(tmp_path / "t.mat", "matlab")
    assert {"y", "x1", "wave"} <= set(loadmat(mat))


@pytest.mark.slow
def test_a_fraction_names_what_it_cannot_tell(tmp_path):
    """With C = AB the effect of each is that of the product of the others besides."""
    factors = [Factor(name, -1.0, 1.0) for name in PLACES]
    for options, told in (({"generators": ["C=AB"]}, True), ({}, False)):
        plan = make_plan(function(), factors, "factorial", options=options)
        campaign = Campaign(tmp_path / f"c{told}", plan)
        campaign.run(workers=0)
        table = campaign.sensitivity("y")
        assert ("aliases" in table) == told
        if told:
            assert table.aliases["x3"] == "x1 x x2"
            assert table.aliases["x1 x x2"] == "x3"
            assert table.effect["x3"] == table.effect["x1 x x2"]


@pytest.mark.parametrize("count", [3, 5])
def test_screening_designs_name_what_their_effects_hold(count):
    """Of four runs whole interactions, of eight whole ones or none, of twelve thirds: each as it is found."""
    coded = plackett_burman(count) if count == 3 else plackett_burman(11)[:, :count]
    names = list("abcde")[:count]
    held = main_effects(coded, coded[:, 0] * coded[:, 1], names, interactions=False)
    effect = held.effect / 2.0  # that of the interaction itself, from -1 to 1, is 2
    assert set(effect.abs().round(12)) - {0.0} == ({1.0} if count == 3 else {round(1 / 3, 12)})
    for name in names:
        size = "" if count == 3 else f"{abs(effect[name]):.2g} "
        sign = "-" if effect[name] < 0 else ""
        assert (f"{sign}{size}a x b" in held.aliases[name].split(", ")) == (abs(effect[name]) > 1e-9)
    plain = main_effects(factorial(3), factorial(3)[:, 0], NAMES)
    assert "aliases" not in plain


@pytest.mark.slow
def test_a_fraction_has_a_report(tmp_path):
    factors = [Factor(name, -1.0, 1.0) for name in PLACES]
    campaign = Campaign(tmp_path / "c", make_plan(function(), factors, "factorial", options={"generators": ["C=AB"]}))
    campaign.run(workers=0)
    assert "<td>x1 x x2</td>" in campaign.report(tmp_path / "r.html", "y").read_text()


@pytest.mark.parametrize("design", ["sobol", "grid"])
@pytest.mark.slow
def test_a_surface_of_a_few_values_goes_by_them(tmp_path, design):
    """Of two alternatives the second is 1; three have no order, and are refused."""
    subject = FunctionSubject(adding, {"a": 1.0, "b": 2.0})
    n = {"n": 32} if design == "sobol" else {}
    factors = [Factor("a", values=(1.0, 2.0, 10.0)), Factor("b", 1.0, 3.0)]
    campaign = Campaign(tmp_path / "c", make_plan(subject, factors, design, **n))
    campaign.run(workers=0)
    surface = campaign.response_surface("s", 1)
    assert surface.q_squared == pytest.approx(1.0)
    np.testing.assert_allclose(surface.coefficients, [5.5 + 3.0 + 2.0, 4.5, 1.0])
    for options in ({"none": 4.0, "one": 9.0}, {"none": 4.0, "one": 9.0, "two": 7.0}):
        campaign = Campaign(
            tmp_path / f"{len(options)}", make_plan(subject, [Choice("a", options), factors[1]], design, **n)
        )
        campaign.run(workers=0)
        if len(options) == 2:
            np.testing.assert_allclose(campaign.response_surface("s", 1).coefficients, [6.5 + 3.0 + 2.0, 2.5, 1.0])
        else:
            with pytest.raises(CampaignError, match=says("a", "3", "order", "sensitivity")):
                campaign.response_surface("s", 1)


@pytest.mark.slow
def test_a_surface_of_whole_numbers_goes_by_their_values(tmp_path):
    factors = [Factor("a", 1, 6, whole=True), Factor("b", 1.0, 3.0)]
    plan = make_plan(FunctionSubject(adding, {"a": 1.0, "b": 2.0}), factors, n=32)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    surface = campaign.response_surface("s", 1)
    assert surface.r_squared == pytest.approx(1.0)
    np.testing.assert_allclose(surface.coefficients, [3.0 + 3.5 + 2.0, 2.5, 1.0])


@pytest.mark.slow
def test_points_that_constraints_leave_are_fitted_in_the_unit_cube(tmp_path):
    """As the messages say; columns in SI, of which the indices would be of other ranges, are refused."""
    factors = [Factor("a", 1.0, 5.0), Factor("b", 100.0, 300.0)]
    subject = FunctionSubject(adding, {"a": 1.0, "b": 2.0})
    campaign = Campaign(tmp_path / "c", make_plan(subject, factors, n=64, constraints=["a * b < 1200"]))
    campaign.run(workers=0)
    table = campaign.table
    assert 32 < len(table) < 64
    for ask in (lambda: campaign.sensitivity("s"), lambda: campaign.response_surface("s")):
        with pytest.raises(CampaignError, match=says("constraints", "plan.points()[table['point']]")):
            ask()
    u = campaign.plan.points()[table["point"]]
    np.testing.assert_allclose(fit_surface(u, table["s"], ["a", "b"], 1).coefficients, [203.0 + 3.0, 2.0, 100.0])
    variances = np.array([4.0, 200.0]) ** 2 / 12.0
    found = fit_chaos(u, table["s"], ["a", "b"], degree=1)
    np.testing.assert_allclose(found.indices, [variances / variances.sum()] * 2, rtol=1e-9)
    columns = table[["a", "b"]].to_numpy()
    for ask in (fit_surface, fit_chaos, total_bounds):
        with pytest.raises(CampaignError, match=says("a", "unit cube", "low")):
            ask(columns, table["s"], ["a", "b"])
        with pytest.raises(CampaignError, match=says("3 names", "2")):
            ask(u, table["s"], NAMES)


def test_points_of_another_design_are_refused():
    """In another order, of another code, or of values that are not asked for."""
    points = saltelli(16, 3, 0)
    moved = points.reshape(16, 5, 3).transpose(1, 0, 2).reshape(-1, 3)
    sobol_indices(_values(points), NAMES, points=points)
    with pytest.raises(CampaignError, match=says("Saltelli", "fit_chaos")):
        sobol_indices(_values(moved), NAMES, points=moved)
    with pytest.raises(CampaignError, match=says("79", "3 names")):
        sobol_indices(_values(points)[1:], NAMES)
    points = morris(4, 3, 0)
    for wrong in (points[::-1].reshape(4, 4, 3)[:, [0, 2, 1, 3]].reshape(-1, 3), saltelli(4, 3, 0)[:16]):
        with pytest.raises(CampaignError, match=says("Morris", "once")):
            morris_effects(_values(wrong), wrong, NAMES)
    assert len(morris_effects(_values(points[::-1]), points[::-1], NAMES)) == 3
    coded = factorial(3)
    for wrong in (0.5 * (coded + 1.0), coded[:, :2]):
        with pytest.raises(CampaignError, match=says("effects", "-1")):
            main_effects(wrong, coded[:, 0], NAMES)
    with pytest.raises(CampaignError, match=says("50", "determine", "leave out")):
        fit_chaos(np.full((50, 2), 0.3), np.arange(50.0), NAMES[:2])


@pytest.mark.parametrize("values", [(1, 2, 10), (10, 1)])
def test_the_high_end_of_numbers_is_the_larger(tmp_path, values):
    subject = FunctionSubject(adding, {"a": 1.0, "b": 2.0})
    factors = [Factor("a", values=values), Factor("b", 1.0, 3.0)]
    campaign = Campaign(tmp_path / "c", make_plan(subject, factors, "factorial"))
    campaign.run(workers=0)
    np.testing.assert_allclose(campaign.sensitivity("s").effect[["a", "b"]], [9.0, 2.0])
