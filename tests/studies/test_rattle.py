"""Rattle: the threshold in every model that knows backlash, and the agreement of all four below it."""

from dataclasses import replace

import numpy as np
import pytest

from gearmbs.studies.presets.backlash import BacklashOscillator
from gearmbs.studies.presets.rattle import MODELS, RattleSettings, rattle, rattle_map, rattle_table, rattle_train
from tests.studies.presets import agrees_with_its_file


def test_one_description_for_all():
    settings = RattleSettings()
    train = rattle_train(settings)
    assert settings.threshold == 500.0
    assert train.speeds["loose"] == pytest.approx(-20 / 25)
    chain = train.torsional()
    assert chain.inertias[chain.names.index("loose")] == pytest.approx(1e-3)
    assert train.part("l1").gear.teeth + train.part("l2").gear.teeth == train.part("g1").gear.teeth + 27


def test_the_file_is_the_transmission():
    agrees_with_its_file("rattle", rattle_train())


@pytest.mark.parametrize("model", ["equivalent", "torsional", pytest.param("multibody", marks=pytest.mark.slow)])
@pytest.mark.slow
def test_coast_flanks_are_hit_from_the_threshold_on(model):
    """J alpha + T_D >= 0 keeps the wheel on its flank: no hit at 0.99 of T_D/J, hits at 1.01."""
    below, above = (rattle(model, RattleSettings(level=level), cycles=1) for level in (0.99, 1.01))
    assert below.coast_hits == 0.0
    assert above.coast_hits >= 1.0


@pytest.mark.parametrize("speed", [0.0, 5.0, 50.0])
def test_nothing_hits_where_nothing_fluctuates(speed):
    """The start is the state that runs: no shock of loads or speeds that come on, whatever is counted from when."""
    found = rattle("multibody", RattleSettings(level=0.0, frequency=100.0, speed=speed), cycles=4, settling=0)
    assert (found.drive_hits, found.coast_hits) == (0.0, 0.0)
    # the twin that fluctuates above the threshold does rattle
    loud = rattle("multibody", RattleSettings(level=3.0, frequency=100.0, speed=speed), cycles=4, settling=0)
    assert loud.drive_hits > 0.0


def test_models_agree_below_the_threshold():
    table = rattle_table(RattleSettings(frequency=20.0), [0.5], MODELS)
    np.testing.assert_allclose(table.amplitude.values, 1.0, rtol=1e-2)
    # near the natural frequency of the mesh, too, where the flank's own give counts
    settings = RattleSettings(stiffness=2e5, frequency=40.0, damping=20.0, depth=1e-4)
    settings = replace(settings, level=0.05)
    models = ("equivalent", "torsional", "frequency")
    fast = [rattle(m, settings, cycles=4, settling=40).amplitude / (0.05 * settings.threshold) for m in models]
    assert fast[2] > 1.05
    np.testing.assert_allclose(fast, fast[2], rtol=1e-2)


def test_map_begins_at_one():
    found = rattle_map(RattleSettings(backlash=1e-4, stiffness=1e7, damping=1e3), [0.8, 3.0], [5.0, 10.0], cycles=5)
    assert np.all(found.sel(level=0.8) == 0.0)
    assert np.all(found.sel(level=3.0) > 0.0)


def test_free_flight_of_the_oscillator():
    """Thrown from the flank with backlash it flies a parabola under its drag: time and speed of return are known."""
    one = BacklashOscillator(1.0, 1e8, 1.0, load=10.0)
    rows, _ = one.run((1.0, 1.0), 0.25, np.array([-1e-9, -1.0, 0.0]), samples=40000)
    flown = rows[: np.argmax(rows[:, 1] > 0.0)]
    assert flown[-1, 0] / (2 * np.pi) == pytest.approx(0.2, abs=1e-4)
    assert flown[:, 1].min() == pytest.approx(-0.05, rel=1e-6)


def test_wrong_settings():
    with pytest.raises(ValueError, match="model is 'guess'"):
        rattle("guess")
    with pytest.raises(ValueError, match="inertia is 1e-06"):
        rattle_train(replace(RattleSettings(), inertia=1e-6))
