"""Data sets: layers, splits, files, and what a leak is worth."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from gearmbs.campaigns import Campaign, CampaignError
from gearmbs.campaigns.datasets import (
    SensorLayers,
    classifier,
    data_set_plan,
    feature_table,
    features,
    from_simulation_to_recordings,
    leak_and_no_leak,
    macro_auroc,
    one_state_a_group,
    random_split,
    recording_features,
    score,
    shared_groups,
    split_by_group,
    withhold,
    write_data_set,
)
from gearmbs.campaigns.datasets.baseline import NAMES
from gearmbs.signals import make_signal
from tests.says import says

RATE = 12800.0


def test_layers_are_the_same_for_the_same_seed_and_specimen():
    x = np.sin(2 * np.pi * 480 * np.arange(6400) / RATE)
    layers = SensorLayers(seed=3)
    one = layers.measured(x, RATE, specimen=1, record=7, full_scale=10.0)
    np.testing.assert_array_equal(one, layers.measured(x, RATE, specimen=1, record=7, full_scale=10.0))
    assert not np.array_equal(one, layers.measured(x, RATE, specimen=1, record=8, full_scale=10.0))
    assert layers.path(1) == layers.path(1)
    assert layers.path(1) != layers.path(2)


def test_sensors_share_the_housing_and_the_drift_but_not_the_noise():
    layers = SensorLayers(seed=3, noise=(0.0, 0.0), bits=24)
    x = np.sin(2 * np.pi * 480 * np.arange(6400) / RATE)
    here, there = layers.path(1, 0), layers.path(1, 1)
    assert [m.frequency for m in here.modes] == [m.frequency for m in there.modes]
    assert [m.mass for m in here.modes] != [m.mass for m in there.modes]
    # a tone stays a tone behind any path: the drift that both sensors hear is the same
    one, two = (layers.measured(x, RATE, 1, 7, 100.0, sensor) for sensor in (0, 1))
    assert not np.array_equal(one, two)
    noisy = SensorLayers(seed=3, noise=(0.1, 0.1))
    rest = [noisy.measured(x, RATE, 1, 7, 100.0, k) - layers.measured(x, RATE, 1, 7, 100.0, k) for k in (0, 1)]
    assert abs(np.corrcoef(rest)[0, 1]) < 0.05


def test_the_path_is_the_modal_sum():
    """A tone behind the path has the path's gain at its frequency, over the path's mean gain."""
    layers, frequency = SensorLayers(), np.fft.rfftfreq(12800, 1.0 / RATE)
    x = np.sin(2 * np.pi * 1000 * np.arange(12800) / RATE)
    y = layers.through(x, RATE, specimen=5)
    gains = np.abs(layers.path(5).accelerance(frequency))
    assert np.std(y) / np.std(x) == pytest.approx(gains[1000] / np.sqrt(np.mean(gains**2)), rel=1e-9)


def test_converter_and_drift():
    x = np.random.default_rng(0).standard_normal(6400)
    layers = SensorLayers(bits=8, noise=(0.0, 0.0), wander=0.0)
    y = layers.measured(x, RATE, 0, 0, full_scale=0.5)
    assert np.abs(y).max() <= 0.5
    np.testing.assert_allclose(y / (1.0 / 256), np.round(y / (1.0 / 256)), atol=1e-9)
    t = np.arange(12800) / RATE
    drifted = SensorLayers(wander=0.01)._wandering(np.sin(2 * np.pi * 480 * t), np.random.default_rng(1))
    line = np.abs(np.fft.rfft(drifted))
    assert 470 < line.argmax() < 490
    assert line.max() < 0.9 * 6400


def test_no_specimen_is_in_two_splits():
    groups = np.repeat(np.arange(50), 7)
    split = split_by_group(groups, test=0.2, validation=0.1, seed=1)
    assert set(shared_groups(split, groups).values()) == {0}
    assert {n: int((split == n).sum()) for n in set(split)} == {"train": 245, "validation": 35, "test": 70}
    severity = np.random.default_rng(0).random(groups.size)
    held = withhold(split, severity, 0.4, 0.6)
    assert ((severity[held == "train"] < 0.4) | (severity[held == "train"] > 0.6)).all()
    np.testing.assert_array_equal(held == "test", split == "test")
    assert shared_groups(random_split(groups.size), groups)[("test", "train")] >= 40
    with pytest.raises(CampaignError, match=says("split", "2 groups", "0.5")):
        split_by_group(np.array([1, 1, 2]), test=0.5, validation=0.5)


def test_macro_auroc():
    labels = np.array(["a", "a", "b", "b"])
    p = np.array([[0.9, 0.1], [0.4, 0.6], [0.5, 0.5], [0.2, 0.8]])
    assert macro_auroc(labels, p, np.array(["a", "b"])) == pytest.approx(0.75)
    assert macro_auroc(labels, 0 * p, np.array(["a", "b"])) == pytest.approx(0.5)


def test_each_specimen_keeps_one_state():
    groups = np.repeat(np.arange(12), 6)
    labels = np.tile(["a", "b", "c"], 24)
    kept = one_state_a_group(labels, groups)
    assert kept.sum() == 24
    assert all(np.unique(labels[kept & (groups == g)]).size == 1 for g in range(12))
    assert sorted(np.unique(labels[kept], return_counts=True)[1]) == [8, 8, 8]


@pytest.mark.slow
def test_a_leak_looks_like_skill():
    """Labels that belong to specimens by chance: nothing can be learned, and the random split seems to."""
    generator = np.random.default_rng(0)
    groups = np.repeat(np.arange(40), 12)
    own = generator.standard_normal((40, 6))[groups]
    labels = np.array(["x", "y"])[generator.integers(0, 2, 40)][groups]
    found = leak_and_no_leak(own + 0.1 * generator.standard_normal(own.shape), labels, groups)
    assert found["random windows"].auroc > 0.95
    assert found["by specimen"].low < 0.5 < found["by specimen"].high
    assert "chance" in str(found["by specimen"])


@pytest.mark.slow
def test_one_specimen_gives_no_interval():
    x, labels = np.arange(40.0)[:, None], np.repeat(["a", "b"], 20)
    found = score(classifier().fit(x, labels), x, labels, np.zeros(40, dtype=int))
    assert found.auroc == 1.0
    assert np.isnan([found.low, found.high]).all()


def test_too_few_signals_are_refused_before_anything_runs():
    with pytest.raises(CampaignError, match=says("24", "2", "ask for 72")):
        data_set_plan(24, specimens=6, sensors=2)


def test_features_do_not_know_the_gain():
    x = np.random.default_rng(0).standard_normal(3200)
    np.testing.assert_allclose(features(x, RATE, 16.7, 29), features(7.0 * x + 3.0, RATE, 16.7, 29), rtol=1e-9)


@pytest.mark.slow
def test_a_classifier_on_recordings():
    """Simulated windows whose second feature tells the states, and recordings where it does as well."""
    generator = np.random.default_rng(0)
    labels = np.repeat(["broken", "healthy", "worn"], 60)
    x = generator.standard_normal((180, len(NAMES)))
    x[:, 1] += 4.0 * (labels == "broken")
    real_labels, groups = np.repeat(["broken", "healthy"], 40), np.repeat(np.arange(8), 10)
    real = generator.standard_normal((80, len(NAMES)))
    real[:, 1] += 4.0 * (real_labels == "broken")
    found, alone = from_simulation_to_recordings(x, labels, real, real_labels, groups)
    assert found.auroc > 0.9
    assert found.groups == 8
    assert alone[NAMES[1]] > 0.85
    assert max(abs(v - 0.5) for n, v in alone.items() if n != NAMES[1]) < 0.25
    # down here where it is up there, and down in both
    real[:, 1] -= 8.0 * (real_labels == "broken")
    assert from_simulation_to_recordings(x, labels, real, real_labels, groups)[1][NAMES[1]] < 0.15
    x[:, 1] -= 8.0 * (labels == "broken")
    assert from_simulation_to_recordings(x, labels, real, real_labels, groups)[1][NAMES[1]] > 0.85
    with pytest.raises(CampaignError, match=says("recordings", "'broken'", "states or more")):
        from_simulation_to_recordings(x, labels, real, np.full(80, "broken"), groups)


def test_windows_of_a_recording():
    signal = make_signal(np.random.default_rng(0).standard_normal((3200, 2)), RATE, units="m/s^2")
    found = recording_features(signal, shaft=16.7, teeth=29, window=0.1)
    assert found.shape == (4, len(NAMES))
    np.testing.assert_array_equal(found[2], features(signal.values[:1280, 1], RATE, 16.7, 29))


@pytest.mark.slow
def test_from_plan_to_files(tmp_path):
    campaign = Campaign(tmp_path / "c", data_set_plan(12, specimens=2, duration=0.1, unit=6))
    campaign.run(workers=0)
    assert campaign.failed().empty, campaign.failed().message.tolist()
    paths = write_data_set(campaign, tmp_path / "data", test=0.5, validation=0.0)
    rows = pd.concat([pd.read_parquet(p) for p in paths if p.suffix == ".parquet"])
    assert len(rows) == 12
    assert sorted(rows.state.unique()) == ["broken", "chipped", "cracked", "healthy", "pitted", "worn"]
    assert rows.loc[rows.state == "healthy", "severity"].eq(0).all()
    for name in ("signal.line_of_action", "signal.sensor_1", "signal.sensor_4"):
        assert np.isfinite(np.stack(rows[name])).all()
        assert len(rows[name].iloc[0]) == 1280
    card = (tmp_path / "data" / "README.md").read_text()
    assert card.startswith("---\nlicense: cc0-1.0")
    assert "specimens in two splits: 0" in card
    assert "* signals: 48" in card
    x, labels, owners, sizes = feature_table(campaign, SensorLayers(), window=0.05)
    assert len(x) == len(labels) == len(owners) == len(sizes) == 12 * 4 * 2
    tree = json.loads((tmp_path / "data" / "croissant.json").read_text())
    assert {f["name"] for f in tree["recordSet"][0]["field"]} == set(rows.columns)
    # a set of loose files is in none of them: readers would look inside
    assert "containedIn" not in tree["distribution"][-1]
    named = {item["@id"] for item in tree["distribution"][:-1]}
    assert named == {f"data/{p.name}" for p in paths if p.suffix == ".parquet"}
