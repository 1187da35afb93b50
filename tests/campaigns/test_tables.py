"""Drivetrains and planetary sets in campaigns."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gearmbs.campaigns import (
    BearingSubject,
    Campaign,
    CampaignError,
    DrivetrainSubject,
    Factor,
    PlanetarySubject,
    choose,
    content_key,
    make_plan,
)
from tests.says import says

STAGE = {
    "name": "stage",
    "running": True,
    "shafts": {"in": {"length": "100 mm"}, "out": {"length": "100 mm"}},
    "wheels": {
        "pinion": {"shaft": "in", "teeth": 20, "module": "3 mm"},
        "gear": {"shaft": "out", "teeth": 40, "module": "3 mm"},
    },
    "meshes": {"mesh": {"driver": "pinion", "driven": "gear", "backlash": "0.1 mm"}},
    "bearings": {"a": {"shaft": "in"}, "b": {"shaft": "out"}},
    "drives": {"motor": {"shaft": "in", "speed": "1500 rpm"}},
    "loads": {"brake": {"shaft": "out", "torque": "80 N m"}},
    "sensors": {"turn": {"shaft": "out"}},
    "run": {"settling": "10 ms", "duration": "20 ms"},
}
SET = {
    "planetary": {"teeth": [24, 30, 84], "module": "1.5 mm", "planets": 3, "backlash_sun": "0.05 mm"},
    # damped enough to settle within 5 ms
    "contact": {"law": "impact"},
    "operation": {
        "speeds": {"sun": "600 rpm"},
        "torques": {"carrier": "20 N m"},
        "run_up": "5 ms",
        "settling": "5 ms",
        "duration": "10 ms",
    },
}


@pytest.mark.slow
def test_a_drivetrain(tmp_path):
    factors = [
        Factor("loads.brake.torque", "80 N m", "120 N m"),
        choose("meshes.mesh.faults", crossed=True, healthy=(), broken={"kind": "broken tooth", "lost": (0.2, 0.8)}),
    ]
    plan = make_plan(DrivetrainSubject(STAGE), factors, "grid", keep=["harmonics", "forces", "signal:turn"], unit=4)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    assert campaign.failed().empty, campaign.failed().message.tolist()
    table = campaign.table
    healthy = table[table["meshes.mesh.faults"] == "healthy"].drop_duplicates("loads.brake.torque")
    ratio = healthy["mesh.normal_force.mean"].to_numpy()
    assert ratio[1] / ratio[0] == pytest.approx(1.5, rel=0.02)
    assert (table["force of mesh.mesh.1"] > 0.0).all()
    assert np.isfinite(campaign.open().turn.values[:, 0, :-2]).all()
    # ranges of options are at their middle in a grid: each torque once healthy, once broken
    assert table["id"].nunique() == len(table) == 4


def test_equal_drivetrains_have_equal_keys():
    def key(**changes):
        tables = json.loads(json.dumps(STAGE))
        for path, value in changes.items():
            *sections, name = path.split("__")
            place = tables
            for section in sections:
                place = place[section]
            place[name] = value
        subject = DrivetrainSubject(tables)
        return content_key("drivetrain", subject.canonical(subject.check(subject.base(), "x")))

    same = key()
    assert "0x" not in json.dumps(same)
    assert key(name="other", meshes__mesh__backlash=1e-4, drives__motor__speed="157.0796326794897 rad/s") == same
    assert key(run__tolerance=1e-7, meshes__mesh__centre_distance_error=0.0) == same
    assert key(meshes__mesh__backlash="0.11 mm") != same


@pytest.mark.slow
def test_a_planetary_set(tmp_path):
    factors = [Factor("operation.torques.carrier", "20 N m", "40 N m")]
    plan = make_plan(PlanetarySubject(SET), factors, "grid", keep=["forces", "signal:ring_sensor"], unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    assert campaign.failed().empty, campaign.failed().message.tolist()
    table = campaign.table
    loads = sum(table[f"sun-planet {k}.force.mean"].to_numpy() for k in (1, 2, 3))
    assert loads[1] / loads[0] == pytest.approx(2.0, rel=0.05)
    subject = plan.subject
    keys = [
        content_key("planetary", subject.canonical(subject.check({**SET, "operation": {**SET["operation"], **o}}, "x")))
        for o in ({}, {"duration": 0.01, "torques": {"carrier": 20.0}}, {"duration": "11 ms"})
    ]
    assert keys[0] == keys[1] != keys[2]


def test_bearings_with_and_without_a_spall(tmp_path):
    tables = {
        "bearing": "6205",
        "rig": {"speed": "1800 rpm", "radial_load": "500 N"},
        "run": {"settling": "10 ms", "duration": "20 ms", "tolerance": 1e-5},
    }
    spall = {"kind": "spall", "part": "outer", "width": ("2 mm", "3 mm")}
    factors = [choose("defects", crossed=True, healthy=(), spalled=spall)]
    plan = make_plan(BearingSubject(tables), factors, "sobol", n=1, keep=["levels", "signal:x"], unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    assert campaign.failed().empty, campaign.failed().message.tolist()
    table = campaign.table.set_index("defects")
    assert 2e-3 <= table["defects.width"]["spalled"] <= 3e-3
    assert table["rms.x"]["spalled"] > 1.5 * table["rms.x"]["healthy"]
    subject = plan.subject
    keys = [
        content_key("bearing", subject.canonical(subject.check({**tables, **other}, "x")))
        for other in ({}, {"rig": {"speed": "30 Hz", "radial_load": 500.0, "axial_load": 0.0}}, {"bearing": "6206"})
    ]
    assert keys[0] == keys[1] != keys[2]
    with pytest.raises(ValueError, match="kind 'hole' is unknown"):
        subject.check({**tables, "defects": [{"kind": "hole"}]}, "x")


def test_wrong_paths_and_signals_are_named():
    for path in ("wheels.gear.teeth.0", "wheels.gear.teeth.0.x"):
        with pytest.raises(CampaignError, match=says(path, "wheels.gear.teeth", "'0'", "table")):
            make_plan(DrivetrainSubject(STAGE), [Factor(path, 1.0, 2.0)], n=4)
    with pytest.raises(CampaignError, match=says("file", "'load'")):
        make_plan(DrivetrainSubject(STAGE), [Factor("load.brake.torque", 1.0, 2.0)], n=4)
    plan = make_plan(DrivetrainSubject(STAGE), [Factor("loads.brake.torque", 1.0, 2.0)], n=4, keep=["signal:tacho"])
    with pytest.raises(CampaignError, match=says("signal 'tacho'", "choose")):
        plan.check()
    with pytest.raises(CampaignError, match="No such file"):
        DrivetrainSubject.from_file("nowhere.toml")
