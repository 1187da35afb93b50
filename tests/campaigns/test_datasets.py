"""Data sets: layers, splits, files, and what a leak is worth."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import scipy.signal as ss

from gearmbs.campaigns import Campaign, CampaignError
from gearmbs.campaigns.codes import code_counts
from gearmbs.campaigns.datasets import (
    GEARBOXES,
    Noise,
    SensorLayers,
    against_reference,
    artefact_leaks,
    classifier,
    data_set_plan,
    feature_table,
    features,
    from_recordings_to_recordings,
    from_simulation_to_recordings,
    identify_noise,
    identify_path,
    leak_and_no_leak,
    macro_auroc,
    one_state_a_group,
    random_split,
    read_data_set,
    recording_features,
    score,
    shared_groups,
    split_by_group,
    withhold,
    write_data_set,
)
from gearmbs.campaigns.datasets.baseline import NAMES
from gearmbs.campaigns.datasets.layers import STOP
from gearmbs.campaigns.datasets.make import _individuals
from gearmbs.signals import ModalPath, Mode, accelerometer, make_signal
from tests.campaigns.support import ringing
from tests.says import says

RATE, DURATION = 12800.0, 0.25
COUNT = 3200


def simulated(layers, wave):
    """Return a wave (a function of the time, s) with the margins of a record that begins at time zero."""
    before, after = layers.margins(DURATION, RATE)
    return wave((np.arange(before + COUNT + after) - before) / RATE)


def test_layers_are_the_same_for_the_same_seed_and_specimen():
    layers = SensorLayers(modes=4, seed=3)
    clean = simulated(layers, lambda t: np.sin(2 * np.pi * 480 * t))

    def stored(specimen, record):
        return layers.noisy(layers.heard(clean, RATE, DURATION, specimen, record), 1.0, specimen, record)

    np.testing.assert_array_equal(stored(1, 7), stored(1, 7))
    assert not np.array_equal(stored(1, 7), stored(1, 8))
    assert layers.path(1) == layers.path(1)
    assert layers.path(1) != layers.path(2)


def test_sensors_share_the_housing_and_the_drift_but_not_the_noise():
    layers = SensorLayers(modes=4, seed=3)
    here, there = layers.path(1, 0), layers.path(1, 1)
    assert [m.frequency for m in here.modes] == [m.frequency for m in there.modes]
    assert [m.mass for m in here.modes] != [m.mass for m in there.modes]
    quiet = np.zeros(COUNT)
    rest = [layers.noisy(quiet, 1.0, 1, 7, sensor) for sensor in (0, 1)]
    assert abs(np.corrcoef(rest)[0, 1]) < 0.06
    assert np.std(rest[0]) == pytest.approx(layers.noise_of(1, 0).level, rel=0.05)


@pytest.mark.parametrize("frequency", [1000.0, 3000.0, 5000.0])
@pytest.mark.parametrize("wander", [0.0, 0.002, 0.01])
def test_drift_is_that_of_a_machine_whose_speed_changes(frequency, wander):
    """A tone at the places of the drifting machine; straight lines between samples are wrong by 0.21 and 0.54 at 3 and
    5 kHz."""
    layers = SensorLayers(wander=wander, seed=1)
    clean = simulated(layers, lambda t: np.sin(2 * np.pi * frequency * t))
    heard = layers.heard(clean, RATE, DURATION, specimen=0, record=5)
    exact = np.sin(2 * np.pi * frequency * layers.times(RATE, DURATION, record=5))
    assert np.std(heard - exact) < 1e-3 * np.std(exact)


def test_drift_has_the_spread_asked_for():
    layers = SensorLayers(wander=0.004)
    speeds = [np.gradient(layers.times(RATE, DURATION, record)) * RATE - 1.0 for record in range(300)]
    assert np.sqrt(np.mean(np.square(speeds))) == pytest.approx(0.004, rel=0.1)


def test_the_path_is_linear_and_has_no_edges():
    """A stretch out of a long signal behind the path is the same whatever is cut out before filtering."""
    layers = SensorLayers(modes=6, wander=0.0, seed=1)
    n, start = 60000, 30000
    spectrum = np.fft.rfft(np.random.default_rng(0).standard_normal(n))
    frequency = np.fft.rfftfreq(n, 1.0 / RATE)
    spectrum[frequency > 4800.0] = 0.0
    path = layers.path(3)
    gain = path.accelerance(frequency)
    scale = np.sqrt(np.mean(np.abs(path.accelerance(np.linspace(0.0, 0.5 * RATE, 2049))) ** 2))
    whole = np.fft.irfft(spectrum * gain / scale, n)[start : start + COUNT]
    before, after = layers.margins(DURATION, RATE)
    clean = np.fft.irfft(spectrum, n)[start - before : start + COUNT + after]
    heard = layers.heard(clean, RATE, DURATION, specimen=3, record=0)
    for stretch in (slice(None), slice(0, 128), slice(-128, None)):
        assert np.std((heard - whole)[stretch]) < 1e-4 * np.std(whole)


def test_above_the_band_is_noise_alone():
    layers = SensorLayers(seed=2)
    clean = np.random.default_rng(0).standard_normal(simulated(layers, np.zeros_like).size)
    heard = layers.heard(clean, RATE, DURATION, 0, 0) * np.blackman(COUNT)
    power = np.abs(np.fft.rfft(heard)) ** 2
    above = np.fft.rfftfreq(COUNT) > STOP
    assert power[above].mean() < 1e-9 * power[~above].mean()


def test_converter():
    x = np.random.default_rng(0).standard_normal(6400)
    y, clipped = SensorLayers(bits=8).converted(x, full_scale=0.5)
    assert np.abs(y).max() <= 0.5
    assert clipped == np.count_nonzero(np.rint(256 * x) != np.rint(256 * y))
    np.testing.assert_allclose(256 * y, np.round(256 * y), atol=1e-9)
    assert SensorLayers().converted(x, full_scale=10.0)[1] == 0


def test_margins_and_what_is_too_short():
    layers = SensorLayers(modes=3)
    before, after = layers.margins(DURATION, RATE)
    assert layers.longest(before + COUNT + after, RATE) == DURATION
    assert layers.longest(before + COUNT + after - 1, RATE) < DURATION
    with pytest.raises(CampaignError, match=says("3200", "too few", "simulate")):
        layers.heard(np.zeros(COUNT), RATE, DURATION, 0, 0)
    with pytest.raises(CampaignError, match=says("200 samples", "longer records")):
        layers.longest(200, RATE)


def test_noise_of_a_recording_comes_back():
    """Lines, and noise that is ten times stronger in the upper half of the band."""
    generator = np.random.default_rng(0)
    given = Noise((0.0, 0.25, 0.2501, 0.5), (1.0, 1.0, 10.0, 10.0), 0.5)
    t = np.arange(1 << 15) / RATE
    lines = np.sqrt(2.0) * np.sin(2 * np.pi * 950.0 * t)
    x = lines + 0.5 * given.drawn(t.size, generator)
    (found,) = identify_noise(make_signal(x[:, None], RATE, units="m/s^2"))
    # of a short recording the filter of the lines keeps some noise about them
    assert found.level == pytest.approx(0.5, rel=0.15)
    frequency, density = np.array(found.frequency), np.array(found.density)
    ratio = (
        density[(frequency > 0.3) & (frequency < 0.45)].mean() / density[(frequency > 0.1) & (frequency < 0.2)].mean()
    )
    assert ratio == pytest.approx(10.0, rel=0.15)
    again = SensorLayers(noises=(found,)).noisy(np.zeros(COUNT), 2.0, 0, 0)
    assert np.std(again) == pytest.approx(2.0 * found.level, rel=0.05)


def test_the_path_of_a_recording_comes_back():
    """Resonances that random vibration shows beside lines of gears, and a data set's sensors behind them."""
    true = ModalPath((Mode(820.0, 0.03, 1.0), Mode(2100.0, 0.02, -2.0), Mode(3900.0, 0.02, 1.5)))
    generator = np.random.default_rng(1)
    force = make_signal(generator.standard_normal((1 << 16, 1)), RATE, units="N")
    heard = accelerometer(force, true, settle="keep").values[:, 0]
    t = np.arange(heard.size) / RATE
    heard = heard + np.std(heard) * np.sin(2 * np.pi * 640.0 * t)
    (path,) = identify_path(make_signal(heard[:, None], RATE, units="m/s^2"), modes=3)
    found = sorted(path.modes, key=lambda mode: mode.frequency)
    for one, mode in zip(found, true.modes, strict=True):
        assert one.frequency == pytest.approx(mode.frequency, rel=0.02)
        assert one.damping == pytest.approx(mode.damping, rel=0.4)
    # one gain apart, the peaks are as high
    peaks = np.array([m.frequency for m in true.modes])
    level = 20 * np.log10(np.abs(path.accelerance(peaks)) / np.abs(true.accelerance(peaks)))
    assert np.ptp(level) < 3.0
    layers = SensorLayers(paths=(path,), seed=1)
    assert layers.path(3, 1) is path
    before, after = layers.margins(DURATION, RATE)
    assert before > SensorLayers().margins(DURATION, RATE)[0]
    clean = generator.standard_normal(before + COUNT + after)
    assert layers.heard(clean, RATE, DURATION, 0, 0).shape == (COUNT,)


@pytest.mark.parametrize("identify", [identify_noise, identify_path])
def test_recordings_that_tell_nothing_are_refused(identify):
    x = np.random.default_rng(0).standard_normal(1 << 13)
    with pytest.raises(CampaignError, match=says("recording", "sensor", "still")):
        identify({"sensor": np.full(1 << 13, 0.1)}, rate=RATE)
    with pytest.raises(CampaignError, match=says("recording", "4000", "4096")):
        identify(x[:4000], rate=RATE)
    identify(ss.lfilter([1.0], [1.0, -1.2, 0.9], x), rate=RATE)


def test_a_path_has_modes_that_stand_out():
    x = np.random.default_rng(0).standard_normal(1 << 15)
    with pytest.raises(CampaignError, match=says("resonance", "ch1", "structure")):
        identify_path(x, rate=RATE)
    (path,) = identify_path(ss.lfilter([1.0], [1.0, -1.2, 0.9], x), modes=5, rate=RATE)
    (mode,) = path.modes
    assert mode.frequency == pytest.approx(RATE / (2.0 * np.pi) * np.arccos(0.6 / np.sqrt(0.9)), rel=0.01)
    with pytest.raises(CampaignError, match=says("modes", "0", "whole")):
        identify_path(x, modes=0, rate=RATE)


def test_noise_of_a_faster_recording_has_the_frequencies_it_had():
    """A band up to 3 kHz heard at 51.2 kHz reaches 3 of 6.4 kHz at the data set's rate, not 0.4 of them."""
    x = np.random.default_rng(0).standard_normal(1 << 16)
    x = ss.sosfiltfilt(ss.butter(8, 3000.0, fs=4 * RATE, output="sos"), x)
    (found,) = identify_noise(x, data_rate=RATE, rate=4 * RATE)
    density = np.interp(np.array([1000.0, 2700.0, 3500.0]) / RATE, found.frequency, found.density)
    assert density[1] == pytest.approx(density[0], rel=0.2)
    assert density[2] < 0.1 * density[0]
    with pytest.raises(CampaignError, match=says("recording", "12800", "faster")):
        identify_noise(x, data_rate="12.8 kHz", rate=6400.0)


def test_a_reference_takes_out_what_a_sensor_makes_of_every_state():
    generator = np.random.default_rng(2)
    sensor, faulty = np.repeat(["a", "b"], 40), np.tile(np.repeat([False, True], 20), 2)
    reference = np.tile(np.arange(20) < 10, 4) & ~faulty
    own = np.where(sensor == "a", 5.0, -5.0)[:, None] * np.array([1.0, 2.0])
    x = own + faulty[:, None] * np.array([1.0, 0.0]) + 0.01 * generator.standard_normal((80, 2))
    found = against_reference(x, sensor, reference)
    np.testing.assert_allclose(found[faulty].mean(axis=0), [1.0, 0.0], atol=0.02)
    np.testing.assert_allclose(found[~faulty & ~reference], 0.0, atol=0.06)
    with pytest.raises(CampaignError, match=says("reference", "b", "healthy")):
        against_reference(x, sensor, reference & (sensor == "a"))
    np.testing.assert_array_equal(against_reference(x, sensor, reference.astype(int)), found)
    with pytest.raises(CampaignError, match=says("reference", "80 rows")):
        against_reference(x, sensor, np.flatnonzero(reference))


@pytest.mark.parametrize("part", [np.nan, -0.1, 1.0])
def test_parts_that_are_none(part):
    with pytest.raises(CampaignError, match=says("split", "test", "parts")):
        split_by_group(np.arange(10), test=part)
    with pytest.raises(CampaignError, match=says("duration", "length")):
        data_set_plan(96, specimens=4, duration=min(part, 0.0))
    assert set(split_by_group(np.arange(10), test=0.0, validation=0.0)) == {"train"}


def test_no_specimen_is_in_two_splits():
    groups = np.repeat(np.arange(50), 7)
    split = split_by_group(groups, test=0.2, validation=0.1, seed=1)
    assert set(shared_groups(split, groups).values()) == {0}
    assert {n: int((split == n).sum()) for n in set(split)} == {"train": 245, "validation": 35, "test": 70}
    severity = np.random.default_rng(0).random(groups.size)
    held = withhold(split, severity, 0.4, 0.6)
    assert ((severity[held == "train"] < 0.4) | (severity[held == "train"] > 0.6)).all()
    np.testing.assert_array_equal(held == "test", split == "test")
    np.testing.assert_array_equal(withhold(list(split), severity, 0.4, 0.6), held)
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
    with pytest.raises(CampaignError, match=says("24", "4 sensors", "ask for 144")):
        data_set_plan(24, specimens=6)


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


def made_rows(count=40, each=6, clean=lambda state, x: x):
    """Return rows of a data set of white signals, whose states a fault of its making may tell."""
    generator = np.random.default_rng(0)
    states = np.tile(["a", "b"], count * each // 2)
    signals = [clean(state, generator.standard_normal(800)) for state in states]
    rows = pd.DataFrame(
        {
            "specimen": np.repeat(np.arange(count), each),
            "point": np.repeat(np.arange(count * each // 2), 2),
            "state": states,
            "operation.speed": np.repeat(generator.uniform(100.0, 200.0, count * each // 2), 2),
            "clipped.sensor_1": [int(np.sum(np.abs(x) >= 3.0)) for x in signals],
        }
    )
    rows["signal.sensor_1"], rows["tacho"] = signals, [np.arange(3)] * len(rows)
    rows["teeth"], rows["sampling_rate"] = [[20, 40]] * len(rows), RATE
    rows["speed"] = [np.full(len(x), speed) for x, speed in zip(signals, rows["operation.speed"])]
    return rows.iloc[generator.permutation(len(rows))].reset_index(drop=True)


def test_rows_in_another_order_are_the_same_rows():
    """They keep their former numbers, and their own speeds and teeth; what is longer than a record is refused."""
    rows = made_rows(4, 2)
    speed = [np.full(800, value) for value in np.linspace(50.0, 300.0, len(rows))]
    rows = rows.assign(speed=speed, sampling_rate=RATE, severity=0.5, teeth=[[20 + k, 40] for k in range(len(rows))])
    moved = rows.sample(frac=1.0, random_state=1)
    assert list(moved.index) != list(rows.index)
    plain, found = (feature_table(given, window=0.05) for given in (rows, moved))
    np.testing.assert_array_equal(found[0], plain[0][moved.index])
    np.testing.assert_array_equal(found[1], moved["state"])
    part = feature_table(rows[rows["state"] == "b"], window=0.05)
    np.testing.assert_array_equal(part[0], plain[0][plain[1] == "b"])
    with pytest.raises(CampaignError, match=says("window", "0.2 s", "shorter")):
        feature_table(rows, window=0.2)
    with pytest.raises(CampaignError, match=says("window", "0.2 s", "shorter")):
        recording_features(make_signal(np.ones((800, 1)), RATE, units="m/s^2"), shaft=20.0, teeth=20, window=0.2)


def spoilt(state, x):
    """Return a signal that goes on from its end to its beginning, and of one state is clipped and sounds too high."""
    spectrum = np.fft.rfft(x)
    spectrum[40:] = 0.0
    x = 10.0 * np.fft.irfft(spectrum, x.size)
    return np.clip(x, -2.9, 2.9) if state == "a" else np.clip(x, -3.0, 3.0) + 0.1 * (-1.0) ** np.arange(x.size)


@pytest.mark.slow
def test_artefacts_tell_nothing_where_there_are_none():
    found = artefact_leaks(made_rows(), folds=3, permutations=5)
    assert list(found) == ["clipping", "above the band", "metadata", "edges"]
    # of 240 rows the AUROC scatters by 0.04
    assert all(abs(one.auroc - 0.5) < 0.1 for one in found.values()), found
    assert all(one.chance_low <= 0.5 <= one.chance_high < 0.65 for one in found.values()), found


@pytest.mark.slow
def test_artefacts_are_found():
    rows = made_rows(clean=spoilt)
    rows = rows.assign(point=rows["point"] + 1000 * (rows["state"] == "b"))
    # rows of a data set in another order are the same rows
    found = artefact_leaks(rows.sample(frac=1.0, random_state=1), folds=3, permutations=5)
    assert all(one.low > 0.6 for one in found.values()), found
    assert all(one.auroc > one.chance_high for one in found.values()), found


@pytest.mark.slow
def test_records_that_begin_at_one_phase_have_edges_as_within():
    """One speed, one phase: a tone of the mesh with noise, whose record holds 40.37 of its periods."""
    rows = made_rows(20, 4)
    generator = np.random.default_rng(3)
    n = len(rows["signal.sensor_1"][0])
    tone = np.sin(2.0 * np.pi * 40.37 * np.arange(n) / n)
    rows["signal.sensor_1"] = [tone + 0.05 * generator.standard_normal(n) for _ in range(len(rows))]
    turns = 40.37 / (n / RATE) / 20.0
    rows["speed"] = [np.full(n, 2.0 * np.pi * turns)] * len(rows)
    found = artefact_leaks(rows, folds=3, permutations=5)["edges"]
    # where the end meets the beginning the phase jumps: within, two stretches are as far apart
    assert found.auroc <= max(found.chance_high, 0.65), found


@pytest.mark.slow
def test_from_recordings_to_others():
    generator = np.random.default_rng(0)
    labels, groups = np.repeat(["broken", "healthy"], 40), np.repeat([0, 1, 2, 3], 20)
    x = generator.standard_normal((80, len(NAMES)))
    x[:, 2] += 4.0 * (labels == "broken")
    assert from_recordings_to_recordings(x, labels, groups).auroc > 0.9
    with pytest.raises(CampaignError, match=says("broken", "one only")):
        from_recordings_to_recordings(x[20:], labels[20:], groups[20:])


@pytest.mark.slow
def test_plans_of_all_gearboxes_have_margins_and_all_specimens():
    layers = SensorLayers()
    for name in GEARBOXES:
        plan = data_set_plan(48, gearbox=name, specimens=2, duration=DURATION, layers=layers)
        columns = plan.columns(plan.points())
        assert np.unique(columns["specimen"]).tolist() == [0, 1]
        samples = round(plan.subject.tables["run"]["duration"] * RATE)
        assert layers.longest(samples, RATE) == DURATION
        thing = plan.subject.check(plan.data({key: values[1] for key, values in columns.items()}), "case")
        assert len(thing.train.sensors) == 5
    with pytest.raises(CampaignError, match=says("gearbox", "three stages")):
        data_set_plan(48, gearbox="three stages", specimens=2)
    wrong = replace(GEARBOXES["one stage"], mesh="stage 9")
    with pytest.raises(CampaignError, match=says("one stage", "stage 9")):
        data_set_plan(48, gearbox=wrong, specimens=2)


@pytest.mark.slow
def test_gearboxes_of_one_file_have_their_own_names_and_the_same_individuals():
    """Dealt out apart, one individual would be in training under the one name and in the test under the other."""

    def drawn(seed=0, **other):
        plan = data_set_plan(48, gearbox=replace(GEARBOXES["one stage"], **other), specimens=2, seed=seed)
        return plan.subject.base()["name"], _individuals(SimpleNamespace(plan=plan))

    one, slow, others = drawn(), drawn(name="slow", speed=("500 rpm", "700 rpm")), drawn(seed=1)
    assert (one[0], slow[0]) == ("one stage", "slow")
    assert one[1] == slow[1] != others[1]
    two = data_set_plan(48, gearbox="two stages", specimens=2)
    assert _individuals(SimpleNamespace(plan=two)) != one[1]


@pytest.mark.slow
def test_gearboxes_of_a_data_set_share_no_noise_and_no_drift(tmp_path):
    """Campaigns under one name, whose records of one number are of one state: noise they shared would tell."""
    both = [ringing(tmp_path / name, torque) for name, torque in (("a", 20.0), ("b", 21.0))]
    paths = write_data_set(both, tmp_path / "data", test=0.5, validation=0.0)
    rows = read_data_set(tmp_path / "data").sort_values(["point", "state"])
    # their individuals are the same ones
    assert rows["specimen"].nunique() == 6
    second = rows.duplicated(["point", "state"])
    first, second = rows[~second], rows[second]
    assert list(first["state"]) == list(second["state"])
    assert set(first["id"]).isdisjoint(second["id"])
    noise = [np.stack(part["signal.sensor_1"]) - np.stack(part["clean.sensor_1"]) for part in (first, second)]
    for mine, other in zip(*noise, strict=True):
        assert abs(np.corrcoef(mine, other)[0, 1]) < 0.1
    for name in ("clean.sensor_1", "speed", "tacho"):
        assert not any(np.array_equal(a, b) for a, b in zip(first[name], second[name], strict=True))
    # the same campaign at the same place has the same
    write_data_set(both, tmp_path / "again", test=0.5, validation=0.0)
    assert read_data_set(tmp_path / "again").equals(read_data_set(tmp_path / "data"))
    # points are withheld with all their states, by the severity of the faulty one
    write_data_set(both[0], tmp_path / "small", test=0.5, validation=0.0, withheld=(0.0, 0.5))
    small = read_data_set(tmp_path / "small")
    assert small.groupby("point")["split"].nunique().eq(1).all()
    for name, inside in (("withheld", True), ("train", False)):
        part = small[small.split == name]
        assert part.state.value_counts().nunique() == 1
        assert ((part.severity <= 0.5) | (part.state == "healthy")).all() == inside
        assert (part.severity[part.state == "faulty"] <= 0.5).eq(inside).all()
    # what computed it is told, and both plans are there
    names = {path.name for path in paths}
    assert {"plan-pair.json", "plan-pair-2.json"} <= names
    (digest,) = code_counts(both[0].folder)
    assert f"code-{digest}.json" in names
    card = (tmp_path / "data" / "README.md").read_text()
    assert f"* pair: `{digest}`, 1 of 1 units (" in card
    assert "no bearing fault" in card


def test_a_campaign_is_in_a_data_set_once(tmp_path):
    """By whatever path it is given, and not as a copy either."""
    (tmp_path / "link").symlink_to(tmp_path)
    one = ringing(tmp_path / "c")
    for other in (one, Campaign(tmp_path / "c"), Campaign(tmp_path / "link" / "c")):
        with pytest.raises(CampaignError, match=says("data set", str(tmp_path / "c"), "once")):
            write_data_set([one, other], tmp_path / "data")
    shutil.copytree(tmp_path / "c", tmp_path / "copy")
    with pytest.raises(CampaignError, match=says(str(tmp_path / "copy"), "case of id", "copy")):
        write_data_set([one, Campaign(tmp_path / "copy")], tmp_path / "data")
    for none in ([], [one, None]):
        with pytest.raises(CampaignError, match=says("campaigns", "give a Campaign")):
            write_data_set(none, tmp_path / "data")
    assert not (tmp_path / "data").exists()


def test_bearings_with_defects_are_sources_in_all_states():
    plan = data_set_plan(96, gearbox="one stage", specimens=4, duration=0.1, bearing_defects=True)
    columns = plan.columns(plan.points())
    found = columns["source.input a"].reshape(-1, 6)
    assert (found == found[:, :1]).all()
    assert set(found.ravel()) == {"sound", "outer spall", "inner spall", "element spall"}
    row = next({k: v[i] for k, v in columns.items()} for i in range(24) if found.ravel()[i] == "inner spall")
    train = plan.subject.check(plan.data(row), "case").train
    (defect,) = train.part("input a").settings["defects"]
    assert defect["part"] == "inner"
    assert defect["width"] == row["source.input a.width"]
    with pytest.raises(CampaignError, match=says("two stages", "bearing_defects", "one stage")):
        data_set_plan(96, gearbox="two stages", specimens=4, bearing_defects=True)


@pytest.mark.slow
def test_from_plan_to_files(tmp_path):
    box = replace(GEARBOXES["one stage"], name="bench 1/2")
    plan = data_set_plan(48, gearbox=box, specimens=2, duration=0.1, bearing_defects=True, unit=6)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    assert campaign.failed().empty, campaign.failed().message.tolist()
    paths = write_data_set(campaign, tmp_path / "data", test=0.5, validation=0.0)
    assert "plan-bench-1-2.json" in {path.name for path in paths}
    rows = read_data_set(tmp_path / "data")
    assert rows.gearbox.unique().tolist() == ["bench 1/2"]
    assert sorted(rows.state.unique()) == ["broken", "chipped", "cracked", "healthy", "pitted", "worn"]
    assert rows.loc[rows.state == "healthy", "severity"].eq(0).all()
    for name in ("signal.sensor_1", "clean.sensor_4", "speed"):
        assert np.isfinite(np.stack(rows[name])).all()
        assert len(rows[name].iloc[0]) == 1280
    assert (rows.filter(like="clipped.") == 0).all(axis=None)
    # batches of tensors are made of columns of one length
    assert all(rows[name].map(np.size).nunique() == 1 for name in rows.columns.drop("tacho"))
    # pulses are as far apart as the speed says
    for row in rows.itertuples():
        turns = 0.5 / np.pi * np.interp(row.tacho, np.arange(1280) / RATE, np.cumsum(row.speed) / RATE)
        np.testing.assert_allclose(np.diff(turns), 1.0, atol=2e-3)
    card = (tmp_path / "data" / "README.md").read_text()
    assert card.startswith("---\nlicense: cc0-1.0")
    assert "specimens in two splits: 0" in card
    assert "no bearing fault" not in card
    assert rows["source.input a"].isin(["sound", "outer spall", "inner spall", "element spall"]).all()
    assert "* signals: 48" in card
    x, labels, owners, sizes = feature_table(rows, window=0.05)
    assert len(x) == len(labels) == len(owners) == len(sizes) == 12 * 4 * 2
    tree = json.loads((tmp_path / "data" / "croissant.json").read_text())
    assert {f["name"] for f in tree["recordSet"][0]["field"]} == set(rows.columns) - {"split"}
    # a set of loose files is in none of them: readers would look inside
    assert "containedIn" not in tree["distribution"][-1]
    named = {item["@id"] for item in tree["distribution"][:-1]}
    assert named == {f"data/{p.name}" for p in paths if p.suffix == ".parquet"}
