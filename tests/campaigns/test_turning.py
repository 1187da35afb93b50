"""Speed and tacho of data sets: of the driver's shaft, whichever way it turns, from where the specimen has its mark."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gearmbs.campaigns import CampaignError, Choice, DrivetrainSubject, Factor, Specimens, make_plan
from gearmbs.campaigns.datasets import GEARBOXES, SensorLayers, data_set_plan, features
from gearmbs.campaigns.datasets.gearboxes import point_seed
from gearmbs.campaigns.datasets.measuring import _turning
from gearmbs.campaigns.datasets.source import Rotation, rotation_of, sensor_ratio
from gearmbs.campaigns.subjects.pair import PairSubject
from gearmbs.studies import Case
from tests.says import says

RATE, DURATION = 12800.0, 0.25
COUNT = 3200
ONE, TWO = GEARBOXES["one stage"], GEARBOXES["two stages"]


def turning(rotation, layers=None, speed=None, specimen=3):
    """Return speed and pulses of a record."""
    return _turning(speed, rotation, RATE, layers or SensorLayers(), DURATION, specimen, 5)


def at_speed(nominal, angle=None, begin=0.0, ratio=1.0):
    return Rotation(nominal, 1.0, nominal, (20, 40), ratio, begin, angle)


def edited(tmp_path, box, *changes, **fields):
    """Return a gearbox of a file with some texts replaced."""
    text = box.file.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "box.toml").write_text(text)
    return replace(box, file=tmp_path / "box.toml", name="mine", **fields)


def planned(box, **settings):
    return data_set_plan(24, gearbox=box, specimens=1, duration=0.1, **settings)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("sensor", [False, True])
def test_a_pulse_a_turn_either_way(sense, sensor):
    """Pulses of a shaft that turned backwards were none, and features constant."""
    layers = SensorLayers(wander=0.0)
    size = sum(layers.margins(DURATION, RATE)) + COUNT
    given = np.full(size, -2.5 * sense * 100.0) if sensor else None
    # a sensor at another shaft, which turns the other way and 2.5 times as fast
    w, pulses = turning(at_speed(sense * 100.0, ratio=-0.4), layers, given)
    np.testing.assert_allclose(w, sense * 100.0, rtol=1e-6)
    # a sensor's signal is interpolated by a kernel that is right within 1e-6
    np.testing.assert_allclose(np.diff(pulses), 2.0 * np.pi / 100.0, rtol=1e-5 if sensor else 1e-9)
    assert pulses.size in (3, 4)


def test_a_shaft_that_turns_back_passes_its_mark_twice():
    swing = at_speed(0.0, lambda t: 20.0 * np.sin(10.0 * t))
    _, pulses = turning(swing, SensorLayers(wander=0.0))
    mark = np.random.default_rng([0, 6, 3]).random()
    before = SensorLayers(wander=0.0).margins(DURATION, RATE)[0] / RATE
    turns = mark + 20.0 * np.sin(10.0 * (before + pulses)) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)
    assert len(set(np.round(turns))) < pulses.size


def test_features_of_a_shaft_that_turns_backwards():
    x = np.random.default_rng(0).standard_normal(COUNT)
    np.testing.assert_array_equal(features(x, RATE, -16.7, 29), features(x, RATE, 16.7, 29))
    with pytest.raises(CampaignError, match=says("features", "shaft", "give")):
        features(x, RATE, 0.0, 29)


def test_the_mark_of_a_pair_is_where_the_specimen_has_it():
    """At any speed, after a run-up from rest that is half as far as at full speed."""
    mark = np.random.default_rng([0, 6, 3]).random()
    layers = SensorLayers(wander=0.0)
    before = layers.margins(DURATION, RATE)[0] / RATE
    for speed in (60.0, 110.0, 153.5):
        case = Case(operation={"speed": speed, "run_up": 0.03, "settling": 0.02, "duration": 0.5})
        plan = SimpleNamespace(subject=PairSubject(case), factors=())
        rotation = rotation_of(plan, case, "", None, "pair")
        assert (rotation.speed, rotation.torque, rotation.teeth) == (speed, 100.0, case.gears.teeth)
        _, pulses = turning(rotation, layers)
        turns = mark + speed * (0.5 * 0.03 + 0.02 + before + pulses) / (2.0 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)


def test_a_pair_whose_speed_changes():
    case = Case(operation={"speed": [[0.0, 60.0], [0.5, 120.0]], "run_up": 0.03, "settling": 0.02})
    rotation = rotation_of(SimpleNamespace(subject=PairSubject(case), factors=()), case, "", None, "pair")
    assert np.isnan(rotation.speed)
    w, pulses = turning(rotation, SensorLayers(wander=0.0))
    assert w[-1] - w[0] == pytest.approx(30.0, rel=0.02)
    assert np.all(np.diff(np.diff(pulses)) < 0.0)


def rotation(box, **fields):
    """Return how the driver of a gearbox turns at the file's speed."""
    plan = SimpleNamespace(subject=DrivetrainSubject(box.tables), factors=())
    thing = plan.subject.check(plan.subject.base(), "mine")
    return rotation_of(plan, thing, box.mesh, box.speed_sensor, "mine"), thing.train


@pytest.mark.slow
def test_a_run_up_from_rest_counts_as_it_is(tmp_path):
    """The driver is prescribed; of one that runs already it is the nominal speed."""
    rest = edited(tmp_path, TWO, ("running = true", "running = false"), ('run_up = "20 ms"', 'run_up = "60 ms"'))
    found, train = rotation(rest)
    w = train.speeds["input"]
    assert found.turned(np.array([0.01]))[0] == pytest.approx(w * (0.5 * 0.06 + 0.03 + 0.01), rel=1e-9)
    found, train = rotation(TWO)
    assert found.turned(np.array([0.01]))[0] == pytest.approx(w * (0.02 + 0.03 + 0.01), rel=1e-9)


def test_a_sensor_at_another_shaft(tmp_path):
    """It is brought to the driver's by the teeth, or refused where nothing ties the two."""
    at_input = replace(TWO, mesh="stage 2")
    found, train = rotation(at_input)
    assert (found.ratio, found.teeth) == (pytest.approx(-32 / 80), (48, 64))
    assert found.nominal == pytest.approx(-0.4 * found.speed)
    assert found.turned(np.array([1.0]))[0] == pytest.approx(found.nominal * 1.05, rel=1e-9)
    assert rotation(TWO)[0].ratio == 1.0
    assert sensor_ratio(train, "input", "output") == pytest.approx(80 / 32 * 64 / 48)
    planned(at_input)
    shaft = ("[wheels.z1]", 'fan = { length = "100 mm", inertia = 0.001, position = [0.5, 0.0, 0.0] }\n\n[wheels.z1]')
    bearing = ("[housings.housing]", '"fan bearing" = { shaft = "fan", on = "ground" }\n\n[housings.housing]')
    motor = ('motor = { length = "150 mm"', 'motor = { position = [0.0, 0.0, 0.0], length = "150 mm"')
    untied = edited(
        tmp_path, TWO, shaft, motor, bearing, ('kind = "speed", shaft = "input"', 'kind = "speed", shaft = "fan"')
    )
    with pytest.raises(CampaignError, match=says("mine", "speed", "'fan'", "'input'", "stage 1", "put")):
        planned(untied)


def test_a_motor_from_rest_is_refused(tmp_path):
    rest = edited(tmp_path, ONE, ("running = true", "running = false"))
    with pytest.raises(CampaignError, match=says("mine", "from rest", "running = true", "'speed'")):
        planned(rest)
    planned(edited(tmp_path, ONE))


def test_files_that_leave_things_out(tmp_path):
    """The face width has a default; without sensors there is nothing to be heard."""
    text = ONE.file.read_text()
    width = planned(edited(tmp_path, ONE, ('face_width = "22 mm"\n', ""))).factors[2].options["chipped"]["length"]
    assert width == pytest.approx([0.1 * x for x in (width[0] * 10.0, width[0] * 50.0)])
    sensors = text[text.index("[sensors]") : text.index("[run]")]
    with pytest.raises(CampaignError, match=says("mine", "accelerometers", "[sensors]", "give")):
        planned(edited(tmp_path, ONE, (sensors, "")))
    speed = next(line for line in sensors.splitlines() if line.startswith("speed"))
    with pytest.raises(CampaignError, match=says("mine", "accelerometers", "[sensors]", "give")):
        planned(edited(tmp_path, ONE, (sensors, f"[sensors]\n{speed}\n\n")))
    with pytest.raises(CampaignError, match=says("mine", "speed sensors", "give")):
        planned(edited(tmp_path, ONE, (speed, "")))


def test_what_a_drivetrain_asks_of_drive_and_load():
    """Of those that are varied, under whatever names, else as the file has it."""
    subject = DrivetrainSubject(TWO.tables)
    state = Choice("meshes.stage 1.faults", {"healthy": [], "worn": {"kind": "wear"}}, crossed=True, name="state")
    speed = Factor("drives.drive.speed", "1000 rpm", "1500 rpm")
    plan = make_plan(subject, [speed, state, Specimens(2)], "sobol", n=2, keep=["signal:sensor 1"])
    row = {name: values[0] for name, values in plan.columns(plan.points()).items()}
    thing = subject.check(plan.data(row), "mine")
    found = rotation_of(plan, thing, "stage 1", None, "mine")
    assert (found.speed, found.torque) == (pytest.approx(row["drives.drive.speed"]), 10.0)


@pytest.mark.slow
def test_lengths_in_text_and_seeds_of_their_own():
    """Points of one number had equal ranks in all gearboxes of one seed."""
    said, number = (planned(ONE, seed=4).subject.base(), data_set_plan(24, gearbox=ONE, specimens=1, duration="100 ms"))
    assert number.subject.base()["run"] == said["run"]
    for wrong in ("100 mm", "soon", 0.0, None):
        with pytest.raises(CampaignError, match=says("duration", repr(wrong), "length of a record")):
            data_set_plan(24, gearbox=ONE, specimens=1, duration=wrong)
    for name in ("signals", "specimens", "seed"):
        with pytest.raises(CampaignError, match=says(name, "1.5", "whole")):
            data_set_plan(**{"signals": 24, "specimens": 1, name: 1.5})
    with pytest.raises(CampaignError, match=says("layers", "3", "SensorLayers")):
        planned(ONE, layers=3)
    one, two = (planned(box, seed=4).points() for box in (ONE, TWO))
    np.testing.assert_array_equal(one, planned(ONE, seed=4).points())
    assert np.abs(one[:, :3] - two[:, :3]).min() > 1e-3
    assert len({point_seed(name, seed) for name in ("a", "b") for seed in (0, 1)}) == 4
