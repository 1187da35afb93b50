"""Factors of tables mean what the base's texts and plain numbers mean to the part, whatever units texts are in."""

import math
from pathlib import Path

import numpy as np
import pytest

from gearmbs.campaigns import BearingSubject, CampaignError, DrivetrainSubject, Factor, PlanetarySubject, make_plan
from gearmbs.campaigns.datasets import GEARBOXES, Gearbox, data_set_plan
from tests.campaigns.test_tables import SET, STAGE
from tests.says import says


def with_entry(tables, path, value):
    """Return tables with another value of an entry."""
    first, _, rest = path.partition(".")
    return tables | {first: with_entry(tables.get(first, {}), rest, value) if rest else value}


def simulated(plan):
    """Return what is simulated at each point."""
    columns = plan.columns(plan.points())
    rows = [{name: column[k].item() for name, column in columns.items()} for k in range(len(columns["point"]))]
    return [plan.subject.check(plan.data(row), "case") for row in rows]


COUPLED = STAGE | {
    "shafts": {**STAGE["shafts"], "motor": {"length": "50 mm", "inertia": 0.01}},
    "drives": {"drive": {"shaft": "motor", "speed": "25 Hz"}},
    "bearings": STAGE["bearings"] | {"m": {"shaft": "motor"}},
    "couplings": {
        "c": {"first": "motor", "second": "in", "stiffness": "5 N m/deg", "relative_damping": 0.1,
              "damping_frequency": "3600 rpm"}
    },
}  # fmt: skip


@pytest.mark.parametrize("base", ["25 Hz", "1500 rpm", "0.025 kHz", "9000 deg/s", "25 rps", "1500 turn/min"])
@pytest.mark.parametrize(("low", "high"), [("20 Hz", "25 Hz"), ("1200 rpm", "1500 rpm")])
def test_a_drives_speed(base, low, high):
    stage = with_entry(STAGE, "drives.motor.speed", base)
    plan = make_plan(DrivetrainSubject(stage), [Factor("drives.motor.speed", low, high)], "grid")
    assert plan.unit_of("drives.motor.speed") == "rad/s"
    speeds = [case.train.speeds["in"] for case in simulated(plan)]
    np.testing.assert_allclose(speeds, [20.0 * math.tau, 25.0 * math.tau])
    rows = make_plan(DrivetrainSubject(stage), [], "list", options={"rows": [{"drives.motor.speed": low}]})
    np.testing.assert_allclose(simulated(rows)[0].train.speeds["in"], 20.0 * math.tau)


@pytest.mark.parametrize(("base", "values", "expected"), [
    ("3600 rpm", ("60 Hz", "3000 rpm"), (60.0, 50.0)),
    ("60 Hz", ("60 Hz", "3000 rpm"), (60.0, 50.0)),
])  # fmt: skip
def test_a_frequency_in_turns_a_minute(base, values, expected):
    """The near twin: fields that take plain numbers in Hz."""
    tables = with_entry(COUPLED, "couplings.c.damping_frequency", base)
    plan = make_plan(DrivetrainSubject(tables), [Factor("couplings.c.damping_frequency", values=values)], "grid")
    assert plan.unit_of("couplings.c.damping_frequency") == "Hz"
    np.testing.assert_allclose([case.train.couplings[0].damping_frequency for case in simulated(plan)], expected)


@pytest.mark.parametrize(("path", "base", "ends", "unit", "read", "expected"), [
    ("meshes.mesh.backlash", "0.004 inch", ("0.1 mm", "4 thou"), "m",
     lambda case: case.train.pairs["mesh"].backlash, (1e-4, 1.016e-4)),
    ("loads.brake.torque", "8 kgf m", ("80 N m", "9 kgf m"), "N m",
     lambda case: case.train.loads[0].torque, (80.0, 88.259850)),
    ("couplings.c.stiffness", "5 N m/deg", ("286 N m/rad", "6 N m/deg"), "N m/rad",
     lambda case: case.train.couplings[0].stiffness, (286.0, 343.774677)),
    ("run.rate", "0.0128 MHz", ("10 kHz", "12800 Hz"), "Hz", lambda case: case.run.rate, (1e4, 12800.0)),
    ("wheels.pinion.angle", "20 deg", ("19 deg", "0.35 rad"), "rad",
     lambda case: case.train.wheels[0].angle, (math.radians(19.0), 0.35)),
])  # fmt: skip
def test_units_of_other_kinds(path, base, ends, unit, read, expected):
    plan = make_plan(DrivetrainSubject(with_entry(COUPLED, path, base)), [Factor(path, *ends)], "grid")
    assert plan.unit_of(path) == unit
    np.testing.assert_allclose([read(case) for case in simulated(plan)], expected)


def test_a_planetary_sets_speed():
    tables = with_entry(SET, "operation.speeds.sun", "10 Hz")
    plan = make_plan(PlanetarySubject(tables), [Factor("operation.speeds.sun", "5 Hz", "600 rpm")], "grid")
    np.testing.assert_allclose([run.speeds["sun"] for run, _ in simulated(plan)], [5.0 * math.tau, 10.0 * math.tau])


@pytest.mark.parametrize(("path", "base", "ends", "unit", "expected"), [
    ("rig.speed", "30 Hz", ("1800 rpm", "40 Hz"), "rad/s", (30.0 * math.tau, 40.0 * math.tau)),
    ("rig.mount_frequency", "9000 rpm", ("100 Hz", "9000 rpm"), "Hz", (100.0, 150.0)),
    ("rig.slow_speed", "0.1 Hz", ("6 rpm", "0.2 Hz"), "rad/s", (0.1 * math.tau, 0.2 * math.tau)),
])  # fmt: skip
def test_a_bearing_rig(path, base, ends, unit, expected):
    tables = with_entry({"bearing": "6205", "rig": {"speed": "30 Hz"}}, path, base)
    plan = make_plan(BearingSubject(tables), [Factor(path, *ends)], "grid")
    assert plan.unit_of(path) == unit
    np.testing.assert_allclose([case.rig[path.partition(".")[2]] for case in simulated(plan)], expected)


def test_what_a_base_does_not_tell_is_refused():
    tables = with_entry(STAGE, "wheels.pinion.teeth", 0)
    with pytest.raises(CampaignError, match=says("drives.motor.speed", "25 Hz", "rad/s", "plain number", "teeth")):
        make_plan(
            DrivetrainSubject(with_entry(tables, "drives.motor.speed", "25 Hz")),
            [Factor("drives.motor.speed", "20 Hz", "25 Hz"), Factor("wheels.pinion.teeth", values=[20])],
            "grid",
        )
    factors = [Factor("drives.motor.speed", 100.0, 150.0), Factor("wheels.pinion.teeth", values=[20])]
    plan = make_plan(DrivetrainSubject(with_entry(tables, "drives.motor.speed", 150.0)), factors, "grid")
    np.testing.assert_allclose([case.train.speeds["in"] for case in simulated(plan)], [100.0, 150.0])


@pytest.mark.parametrize(("old", "new"), [
    ('speed = "1785 rpm"', 'speed = "29.75 Hz"'),
    ("stiffness = 5.876e+07", 'stiffness = "5.876e7 N/m"'),
])  # fmt: skip
@pytest.mark.slow
def test_the_file_of_a_data_set_in_other_units(tmp_path, old, new):
    text = GEARBOXES["two stages"].file.read_text()
    assert old in text
    plans = []
    for name, content in (("a", text), ("b", text.replace(old, new))):
        Path(tmp_path / f"{name}.toml").write_text(content)
        box = Gearbox("mine", tmp_path / f"{name}.toml", "stage 1", "drive", "brake", ("900 rpm", "1200 rpm"),
                      ("10 N m", "40 N m"))  # fmt: skip
        plans.append(data_set_plan(48, gearbox=box, specimens=2, duration=0.5))
    mine, other = (plan.columns(plan.points()) for plan in plans)
    for name, column in mine.items():
        np.testing.assert_array_equal(column, other[name])
    first, again = (simulated(plan)[1].train for plan in plans)
    assert first.speeds == again.speeds
    assert first.housings[0].modes == again.housings[0].modes
