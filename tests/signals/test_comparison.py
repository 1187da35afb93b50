"""Experiment against model: scaling, agreement, distance, and what the report says."""

import math

import numpy as np
import pytest

from gearmbs.signals import (
    SignalError,
    compare,
    compare_files,
    level_distance,
    make_signal,
    ordinal_agreement,
    remove_mean,
    write_signal,
)
from gearmbs.signals.analysis.comparison_report import state_meant
from tests.says import says

RATE, GMF, TEETH = 12800.0, 480.0, 29
OMEGA = 2 * math.pi * GMF / TEETH
BASE = {"healthy": (1.0, 0.5, 0.25), "misaligned": (1.1, 1.5, 0.3), "distance": (2.0, 1.0, 0.75)}


def tone(amplitudes, factor=1.0, seconds=1.0, mean=0.0):
    t = np.arange(round(seconds * RATE)) / RATE
    x = mean + factor * sum(a * np.cos(2 * np.pi * k * GMF * t + k) for k, a in enumerate(amplitudes, 1))
    return make_signal({"acc": x}, RATE, units="m/s^2", speed=OMEGA, teeth=TEETH)


def cases(factor=1.0, states=BASE, mean=0.0):
    return {
        "low": {s: tone(a, factor, mean=mean) for s, a in states.items()},
        "high": {s: tone(a, 3 * factor, mean=mean) for s, a in states.items()},
    }


@pytest.mark.slow
def test_a_model_that_is_the_experiment_times_a_factor_agrees_perfectly():
    report = compare(cases(), cases(0.02, mean=55.0))
    np.testing.assert_allclose(report.data["model"], report.data["experiment"], rtol=1e-6)
    np.testing.assert_allclose(report.data["factor"], 50.0, rtol=1e-6)
    found = report.agreement()
    assert (found["ordinal"] == 1.0).all()
    assert (found["ordinal_load"] == 1.0).all()
    assert found["same_direction"].all()
    assert float(found["distance"].max()) < 1e-4
    assert report.data["experiment"].sel(load="low", state="misaligned", harmonic=2).item() == pytest.approx(
        1.5 / math.sqrt(2), rel=1e-4
    )


@pytest.mark.parametrize("high", [1500.0, 2400.0, 6000.0])
def test_a_model_is_scaled_by_what_it_has_in_the_band_of_the_experiment(high):
    """The experiment is the model's own acceleration, as a displacement: the factor is 1, whatever lies beyond."""
    t = np.arange(round(2.0 * RATE)) / RATE
    heights = {"healthy": (1.0, 0.5, 0.25, 0.4, 0.3, 0.9), "misaligned": (1.1, 1.5, 0.3, 0.4, 0.3, 0.9)}
    lines = {s: enumerate(h, 1) for s, h in heights.items()}
    model, place = {}, {}
    for state, each in lines.items():
        parts = [(a, 2 * np.pi * k * GMF) for k, a in each]
        known = {"units": "m/s^2", "speed": OMEGA, "teeth": TEETH}
        model[state] = make_signal({"a": sum(a * np.cos(w * t) for a, w in parts)}, RATE, **known)
        moved = {"y": sum(-a / w**2 * np.cos(w * t) for a, w in parts)}
        place[state] = make_signal(moved, RATE, **{**known, "units": "m"})
    harmonics = min(3, int(high / GMF))
    report = compare(place, model, quantity="acceleration", band=(100.0, high), harmonics=harmonics)
    assert float(report.data["factor"].sel(state="healthy").item()) == pytest.approx(1.0, rel=2e-3)
    np.testing.assert_allclose(report.data["model"], report.data["experiment"], rtol=5e-3)


@pytest.mark.slow
def test_scaling_scopes():
    model = {
        "low": {s: tone(a, 0.5 if s == "healthy" else 1.0) for s, a in BASE.items()},
        "high": {s: tone(a, 1.0) for s, a in BASE.items()},
    }
    low_fault = {"load": "low", "state": "misaligned"}
    by_load = compare(cases(), model, scope="load").data["factor"]
    assert by_load.sel(low_fault).item() == pytest.approx(2.0, rel=1e-4)  # the healthy case's factor is kept
    assert by_load.sel(load="high", state="healthy").item() == pytest.approx(3.0, rel=1e-4)
    everywhere = compare(cases(), model, scope="all").data["factor"]
    np.testing.assert_allclose(everywhere, 2.0, rtol=1e-4)
    each = compare(cases(), model, scope="each").data["factor"]
    assert each.sel(low_fault).item() == pytest.approx(1.0, rel=1e-4)


@pytest.mark.slow
def test_disagreement_is_counted():
    # the model turns misalignment's second harmonic down instead of up: pairs (h, m) and (m, d) flip, (h, d) stays
    model_states = {**BASE, "misaligned": (1.1, 0.1, 0.3)}
    report = compare(cases(), cases(states=model_states))
    found = report.agreement()
    assert found["ordinal"].sel(load="low", harmonic=2).item() == pytest.approx(1 / 3)
    assert not found["same_direction"].sel(load="low", state="misaligned", harmonic=2).item()
    assert found["same_direction"].sel(load="low", state="distance", harmonic=2).item()
    text = report.to_markdown()
    # 1.1 is +0.8 dB, 0.5 to 1.5 is +9.5 dB, 0.5 to 0.1 is -14.0 dB
    assert "1 x GMF stays (+0.8 dB, in the model +0.8 dB); 2 x GMF rises (+9.5 dB, in the model -14.0 dB)" in text
    assert "Agreement of model and experiment" in text


@pytest.mark.slow
def test_expectations_of_the_paper():
    table = compare(cases()).expectations()
    assert table["as_expected"].all()
    assert len(table) == 2 * (1 + 3)
    reverse = {"low": {"healthy": tone((1, 1, 1)), "misaligned": tone((1, 0.5, 1))}}
    report = compare(reverse)
    assert not report.expectations()["as_expected"].any()
    # half the amplitude is -6.0 dB
    assert report.summary() == [
        "misaligned: at load low 2 x GMF falls on acc (-6.0 dB).",
        "misaligned: expected is that 2 x GMF rises, which 0 of 1 values do: not as expected.",
    ]
    assert "## In short\n\n- misaligned: at load low" in report.to_markdown()


@pytest.mark.slow
def test_summary_says_what_repeats_at_every_load():
    """x 2 is +6.0 dB at both loads, x 0.5 then x 2 does not repeat; 1.2 is +1.6 dB, within 3 dB."""
    states = {
        "low": {"healthy": tone((1, 1, 1)), "broken": tone((2, 0.5, 1))},
        "high": {"healthy": tone((1, 1, 1)), "broken": tone((2, 2, 1.2))},
    }
    report = compare(states, scope="each")
    found, verdict = report.summary()
    assert found == "broken: at every load 1 x GMF rises on acc (+6.0, +6.0 dB)."
    assert "1 x GMF, 2 x GMF and 3 x GMF stay within 3 dB, which 2 of 6 values do: not as expected" in verdict
    with_model = compare(states, states)
    assert with_model.summary()[0] == "broken: at every load 1 x GMF rises (+6.0, +6.0 dB)."


@pytest.mark.slow
def test_channels_that_contradict_each_other_are_named():
    def two(a, b):
        return make_signal({"a": tone(a).values[:, 0], "b": tone(b).values[:, 0]}, RATE, speed=OMEGA, teeth=TEETH)

    report = compare({"one": {"healthy": two((1, 1, 1), (1, 1, 1)), "broken": two((1, 1, 3), (1, 1, 0.3))}})
    assert len(report.cautions()) == 1
    assert "3 x GMF moves by -10.5 dB on one channel and by +9.5 dB on another" in report.cautions()[0]
    assert "rises on 1 and falls on 1 of 2 channels" in report.to_markdown()


@pytest.mark.slow
def test_cases_of_one_side_only_are_left_out_and_named():
    experiment = cases()
    experiment["odd"] = experiment["low"]
    model = cases()
    del model["high"]["distance"]
    report = compare(experiment, model)
    assert report.data["load"].values.tolist() == ["low", "high"]
    assert "load 'odd' of the experiment" in report.left_out
    assert "state 'distance' at load 'high' of the experiment" in report.left_out
    assert math.isnan(report.data["experiment"].sel(load="high", state="distance", harmonic=1).item())
    assert np.isfinite(report.agreement()["distance"]).all()
    assert "Left out" in report.to_markdown()


@pytest.mark.slow
def test_tables_have_bars_side_by_side():
    tables = compare(cases(), cases(2.0)).tables()
    assert tables["harmonics"].columns.tolist()[-2:] == ["experiment", "model"]
    assert len(tables["harmonics"]) == 2 * 3 * 3
    assert {"changes", "expectations", "agreement", "distance"} <= set(tables)


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ([1, 2, 3], [10, 20, 30], 1.0),
        ([1, 2, 3], [3, 2, 1], 0.0),
        ([1, 2, 3], [1, 3, 2], 2 / 3),
        ([1, 1.001, 3], [1, 2, 3], (0.5 + 1 + 1) / 3),
    ],
)
def test_ordinal_agreement(a, b, expected):
    assert ordinal_agreement(np.array(a), np.array(b)) == pytest.approx(expected)


def test_level_distance():
    # factors of 10 up and down are 20 dB each
    assert level_distance(np.array([1.0, 1.0]), np.array([10.0, 0.1])) == pytest.approx(20.0)
    assert level_distance(np.array([2.0]), np.array([2.0])) == 0.0


@pytest.mark.slow
def test_compare_files(tmp_path):
    paths = {"low": {}}
    for state, amplitudes in BASE.items():
        paths["low"][state] = write_signal(tone(amplitudes), tmp_path / f"{state}.nc")
    report = compare_files(paths, paths)
    assert float(report.agreement()["distance"].max()) == 0.0


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (
            lambda: compare({"low": {"misaligned": tone((1, 1, 1))}}),
            says("'healthy'", "reference="),
        ),
        (lambda: compare(cases(), {"other": cases()["low"]}), "none in common"),
        (lambda: compare(cases(), scope="both"), "scope"),
        (lambda: compare(cases(), way="both"), says("way", "'band'", "'orders'", "'both'")),
        (lambda: compare(cases(), channel="nope"), "has no 'nope'"),
    ],
)
def test_bad_calls_name_the_field(call, match):
    with pytest.raises(SignalError, match=match):
        call()


def test_mean_is_removed_from_each_channel():
    both = make_signal({"acc": [1.0, 2.0, 6.0], "force": [-4.0, 0.0, 1.0]}, RATE, units="m/s^2")
    less = remove_mean(both)
    np.testing.assert_allclose(less.sel(channel="acc"), [-2.0, -1.0, 3.0])
    np.testing.assert_allclose(less.sel(channel="force"), [-3.0, 1.0, 2.0])
    assert less.attrs == both.attrs


def test_units_must_agree():
    force = {"low": {"healthy": tone((1, 1, 1)).assign_coords(units=("channel", ["N"])).assign_attrs(units="N")}}
    with pytest.raises(SignalError, match=says("'m/s^2'", "'N'", "experiment")):
        compare({"low": {"healthy": tone((1, 1, 1))}}, force)


@pytest.mark.parametrize(("factor", "told"), [(1000.0, True), (0.01, True), (10.0, False)])
@pytest.mark.slow
def test_records_that_differ_as_by_a_unit_are_told(factor, told):
    report = compare({"healthy": tone(BASE["healthy"]), "misaligned": tone(BASE["misaligned"], factor)})
    assert report.summary()[0].startswith("CHECK THE UNITS") == told


@pytest.mark.parametrize(("faster", "told"), [(1.25, True), (1.02, False)])
@pytest.mark.slow
def test_records_of_other_speeds_are_told(faster, told):
    worn = make_signal(
        tone((1.1, 1.5, 0.3)).values, faster * RATE, channels=["acc"], units="m/s^2", speed=faster * OMEGA, teeth=TEETH
    )
    notes = compare({"healthy": tone(BASE["healthy"]), "worn": worn}).notes
    assert any(note.startswith("CHECK THE SPEED: worn at load all") for note in notes) == told


def motion(amplitudes, seed=0, seconds=1.2, rate=6400.0, names=("x",)):
    """Displacements of some channels with noise: mesh lines in the first one only."""
    t = np.arange(round(seconds * rate)) / rate
    rng = np.random.default_rng(seed)
    noise = 0.02 * rng.standard_normal((t.size, len(names)))
    noise[:, 0] += sum(a * np.cos(2 * np.pi * k * GMF * t + k) for k, a in enumerate(amplitudes, 1))
    return make_signal(1e-6 * noise, rate, channels=names, units="m", speed=OMEGA, teeth=TEETH)


def test_harmonics_beyond_the_band_of_a_conversion_are_left_out_by_name():
    """What would be told of them is the noise that its taper leaves: twice the mesh at 960 Hz rises by 9.5 dB."""
    states = {"healthy": motion((1.0, 0.5)), "misaligned": motion((1.0, 1.5), seed=1)}
    report = compare({"low": states}, quantity="acceleration", band=("100 Hz", "700 Hz"), harmonics=2)
    assert report.data["harmonic"].values.tolist() == [1]
    assert any("2 x GMF (960 Hz)" in note for note in report.notes)
    assert not any("not as expected" in line for line in report.summary())
    assert any("misaligned" in line and "cannot be told" in line for line in report.summary())
    wide = compare({"low": states}, quantity="acceleration", band=("100 Hz", "1.2 kHz"), harmonics=2)
    assert float(wide.changes().sel(load="low", harmonic=2).squeeze()) == pytest.approx(9.54, abs=0.5)
    with pytest.raises(SignalError, match=says("band", "1 x GMF", "700", "--band")):
        compare({"low": states}, quantity="acceleration", band=("600 Hz", "700 Hz"), harmonics=2)


def test_channels_without_a_mesh_line_do_not_count():
    """Across the motion a camera has the noise of its tracking, which neither rises nor falls."""
    states = {
        "healthy": motion((1.0, 0.5, 0.2), names=("x", "y")),
        "wider": motion((2.0, 1.0, 0.4), 1, names=("x", "y")),
    }
    report = compare({"low": states})
    assert report.data.attrs["silent"] == ["y"]
    assert any("'y'" in note and "does not count" in note for note in report.notes)
    assert any("3 of 3 values do: as expected" in line for line in report.summary())
    none = compare({"low": {state: one.sel(channel=["y"]) for state, one in states.items()}})
    assert any(note.startswith("CHECK THE SPEED") for note in none.notes)


@pytest.mark.parametrize("name", ["wider", "Widened", "centre distance", "+3 mm distance", "distance"])
def test_states_are_known_by_what_they_are_called(name):
    assert state_meant(name) == "distance"
    assert state_meant("worn") is state_meant("healthy") is None
