"""Near resonance: jumps of the multibody pair and of the classical model, and the load from which teeth part."""

from dataclasses import replace

import numba
import numpy as np
import pytest

from gearmbs.gears.transmission import loaded_transmission_error
from gearmbs.studies.presets.resonance import (
    DIRECTIONS,
    MODELS,
    ResonanceSettings,
    ResonanceStudy,
    jump_frequency,
    lowest_lag,
    resonance_train,
    run_resonance,
    separation_load,
    separation_loads,
    sweep_resonance,
)
from gearmbs.studies.trains import load_train
from tests.make_records import read
from tests.says import says
from tests.studies.presets import agrees_with_its_file

WINDOW = 20


@numba.njit
def classical(mass, film, stiffness, error, load, backlash, ends, cycles):
    """RMS of every mesh cycle of m x'' + c x' + k g(x - e) = F, the frequency changing cycle by cycle."""
    per = 400
    n = stiffness.size
    x, v = load / stiffness.mean(), 0.0
    out = np.empty(cycles)
    for cycle in range(cycles):
        h = 1.0 / (per * (ends[0] + (ends[1] - ends[0]) * cycle / cycles))
        total = square = 0.0
        for i in range(per):
            place = i * n / per
            j = int(place)
            part = place - j
            k = stiffness[j] * (1.0 - part) + stiffness[(j + 1) % n] * part
            gap = x - (error[j] * (1.0 - part) + error[(j + 1) % n] * part)
            g = gap if gap > 0.0 else min(gap + backlash, 0.0)
            v = (v + h * (load - k * g) / mass) / (1.0 + h * film / mass)
            x += h * v
            total += x
            square += x * x
        out[cycle] = np.sqrt(max(square / per - (total / per) ** 2, 0.0))
    return out


def classical_jump(settings, direction, cycles=8000, settling=400):
    """Jump of the model above, Hz, with the stiffness that the statics of the pair give."""
    pair = settings.pair
    rest = loaded_transmission_error(pair, torque=settings.torque, points=400)
    r = pair.driven.base_radius
    mass, load = pair.driven.inertia[2] / r**2, settings.torque / r
    natural = np.sqrt(rest.stiffness.mean() / mass)
    ends = np.array(settings.span if direction == "up" else settings.span[::-1]) * natural / (2 * np.pi)
    film = 2 * settings.damping_ratio * mass * natural
    rms = classical(
        mass, film, rest.stiffness, rest.error - load / rest.stiffness, load, settings.backlash, ends, cycles
    )
    frequency = ends[0] + (ends[1] - ends[0]) * np.arange(cycles) / cycles
    a, f = (q[settling:].reshape(-1, WINDOW).mean(axis=1) for q in (rms, frequency))
    k = np.argmax(np.abs(np.diff(np.log(a))))
    return 0.5 * (f[k] + f[k + 1])


@pytest.fixture(scope="module")
def study():
    sweeps = read("resonance.nc")
    return ResonanceStudy(
        ResonanceSettings(), {(m, d): sweeps.sel(model=m, direction=d) for m in MODELS for d in DIRECTIONS}
    )


@pytest.mark.slow
def test_jumps_of_both_models(study):
    """Jump frequencies up and down within 2 % of a model of one degree of freedom without the package's code."""
    jumps = study.jumps()
    for direction in DIRECTIONS:
        independent = classical_jump(study.settings, direction)
        assert jumps["multibody"][direction] == pytest.approx(independent, rel=0.02)
        assert jumps["one degree"][direction] == pytest.approx(independent, rel=0.005)
    # the jumps are jumps, and lie apart: hysteresis
    for direction in DIRECTIONS:
        rms = study.sweeps["multibody", direction]["rms"].values
        assert np.abs(np.diff(np.log(rms))).max() > 0.2
        assert study.sweeps["multibody", direction]["lowest"].min() < -0.5 * study.settings.force / 4e8
    assert jumps["multibody"]["up"] > 1.02 * jumps["multibody"]["down"]


def test_amplitudes_outside_of_the_hysteresis_do_not_depend_on_the_direction(study):
    up, down = (study.sweeps["multibody", d] for d in DIRECTIONS)
    for ratio in (0.72, 0.82):
        f = ratio * study.settings.frequency
        there = [
            np.interp(f, *(s[n].values[:: 1 if s is up else -1] for n in ("frequency", "rms"))) for s in (up, down)
        ]
        assert there[0] == pytest.approx(there[1], rel=0.03)


@pytest.mark.slow
def test_slower_sweeps_jump_at_the_same_place(study):
    slow = replace(study.settings, cycles=8000)
    for direction in DIRECTIONS:
        found = jump_frequency(sweep_resonance(slow, direction, "one degree"))
        assert found == pytest.approx(study.jumps()["one degree"][direction], rel=3e-3)


@pytest.mark.slow
def test_no_separation_below_a_load():
    """With a contact ratio of two only the deflection excites: teeth stay together below the load that is told."""
    settings = ResonanceSettings(addendum=1.157, damping_ratio=0.03, cycles=2000)
    assert settings.pair.contact_ratio == pytest.approx(2.0, abs=1e-3)
    found = separation_load(settings, (5.0, 200.0))
    assert found.parted_above
    assert "teeth part above" in str(found)
    own = separation_load(settings, (0.6 * found.torque, 1.5 * found.torque), steps=4, model="multibody")
    assert own.parted_above
    # the deflection excites more than a stiffness that is a function of the phase alone says
    assert 0.75 * found.torque < own.torque < 1.05 * found.torque
    assert lowest_lag(settings, 0.95 * own.torque, "multibody") > 0.0
    assert lowest_lag(settings, 1.05 * own.torque, "multibody") < 0.0
    assert separation_load(settings, (5.0, 10.0)) is None


@pytest.mark.slow
def test_loads_of_both_models_are_printed():
    settings = ResonanceSettings(addendum=1.157, damping_ratio=0.03, cycles=400)
    found = separation_loads(settings)
    assert list(found) == ["one degree", "multibody"]
    text = ResonanceStudy(settings, {}, {**found, "other": None}).thresholds_text()
    assert f"Multibody: teeth part above {found['multibody'].torque:.4g} N m, none below." in text
    assert "Other: no load from 1 to 1000 N m" in text


@pytest.mark.slow
def test_report_and_figure(study, tmp_path):
    text = study.report()
    assert "| up |" in text
    assert "contact ratio 1.514" in text
    assert len(study.figure().axes) == 2
    assert all(path.exists() for path in study.save(tmp_path))


@pytest.mark.parametrize(("changes", "words"), [
    ({"torque": "-3 N m"}, says("torque", "-3 N m")),
    ({"span": (1.0, 0.5)}, "span is"),
    ({"damping_ratio": 0.0}, "damping_ratio is 0"),
    ({"cycles": 10}, says("cycles", "10", "give 300")),
])  # fmt: skip
def test_wrong_settings(changes, words):
    with pytest.raises(ValueError, match=words):
        ResonanceSettings(**changes)


@pytest.mark.slow
def test_both_directions_side_by_side(monkeypatch):
    monkeypatch.setattr("gearmbs.studies.presets.resonance.separation_loads", lambda settings: {})
    settings, told = ResonanceSettings(cycles=300), {}
    found = run_resonance(settings, progress=lambda name, fraction: told.update({name: fraction}))
    assert list(found.sweeps) == [(model, direction) for direction in DIRECTIONS for model in MODELS]
    assert told == {"up": 1.0, "down": 1.0}
    assert found.sweeps["multibody", "down"].equals(sweep_resonance(settings, "down"))
    assert found.sweeps["one degree", "up"].equals(sweep_resonance(settings, "up", "one degree"))


def test_no_jump_where_amplitudes_only_slope():
    quiet = sweep_resonance(ResonanceSettings(span=(0.4, 0.45), cycles=1000), "up", "one degree")
    assert np.isnan(jump_frequency(quiet))


def test_the_file_is_the_rig_before_its_sweep():
    train = resonance_train().changed("drive", function=None)
    assert train.run_up == pytest.approx(load_train("resonance").train.run_up)
    agrees_with_its_file("resonance", replace(train, run_up=load_train("resonance").train.run_up))


def test_wrong_model():
    with pytest.raises(ValueError, match="model is 'guess'"):
        sweep_resonance(model="guess")
    with pytest.raises(ValueError, match="direction is 'left'"):
        sweep_resonance(direction="left")
