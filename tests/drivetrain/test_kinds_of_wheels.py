"""Trains with internal wheels and with rolling bearings at the seats of their shafts."""

import numpy as np
import pytest

from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    GearMesh,
    IdealBearing,
    RollingContactBearing,
    Shaft,
    SpeedDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.gears import GearSpec
from tests.drivetrain.support import stage
from tests.says import says

QUIET = {"backlash": "0.1 mm", "contact": {"kind": "linear", "stiffness": 3e8, "damping": 2e3, "depth": "2 um"},
         "friction": False}  # fmt: skip


def test_internal_wheel():
    """Both wheels of an internal pair turn the same way; the mesh carries torque over base radius."""
    wheels = [
        Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm", name="pinion")),
        Wheel(name="ring", shaft="out", gear=GearSpec(70, "3 mm", internal=True, name="ring")),
    ]
    train = Drivetrain(
        "internal",
        shafts=[Shaft(name="in", length=0.1), Shaft(name="out", length=0.1, position=None)],
        wheels=wheels,
        meshes=[GearMesh(name="mesh", driver="pinion", driven="ring", settings=QUIET)],
        bearings=[IdealBearing(name="a", shaft="in"), IdealBearing(name="b", shaft="out")],
        drives=[SpeedDrive(name="motor", shaft="in", speed="600 rpm")],
        loads=[TorqueLoad(name="brake", shaft="out", torque="200 N m")],
        running=True,
        run_up=0.01,
    )
    assert train.kinematics.ratio("in", "out") == pytest.approx(70 / 20)
    apart = train.layout.seats["out"].origin - train.layout.seats["in"].origin
    assert np.hypot(*apart[:2]) == pytest.approx(0.075)
    solution = train.build().simulate(0.06, rate=20000, tol=1e-7, rate_scale=train.rate_scale)
    assert solution.success, solution.message
    late = solution.t > 0.03
    force = solution.contact("mesh")["normal_force"][late].mean()
    assert force == pytest.approx(200.0 / wheels[1].gear.base_radius, rel=0.01)
    assert solution.angular_velocity("out")[late, 2].mean() == pytest.approx(20 * np.pi * 20 / 70, rel=2e-3)


def test_rolling_bearings_at_the_seats():
    """Two ball bearings carry the mesh force by the lever rule, and pass their balls at the kinematic table's rate."""
    bearings = [IdealBearing(name="a", shaft="in")]
    for name, station in (("left", 0.02), ("right", 0.08)):
        bearings.append(RollingContactBearing(name=name, shaft="out", station=station, rolling="6206", settings={}))
    train = stage(
        wheels=[
            Wheel(name="pinion", shaft="in", station=0.035, gear=GearSpec(20, "3 mm", name="pinion")),
            Wheel(name="gear", shaft="out", station=0.035, gear=GearSpec(60, "3 mm", name="gear")),
        ],
        bearings=bearings,
        run_up=0.01,
        running=True,
    ).changed("mesh", settings=QUIET)
    solution = train.build().simulate(0.08, rate=20000, tol=1e-7, rate_scale=train.rate_scale)
    assert solution.success, solution.message
    late = solution.t > 0.04
    force = 300.0 / train.pairs["mesh"].geometry.driven.base_radius
    for name, share in (("left", 0.75), ("right", 0.25)):
        carried = np.linalg.norm(solution.load(name)[0][late].mean(axis=0))
        assert carried == pytest.approx(share * force, rel=0.03)
    table = train.kinematics
    assert table.bearing_frequencies("left")["BPFO"] < 9 * table.shaft_frequency("out") / 2


def test_helical_wheels_from_a_file(tmp_path):
    """A file gives a helix as a wheel's drawing does; both hands are needed."""
    path = tmp_path / "helical.toml"
    wheel = "[wheels.{name}]\nshaft = '{shaft}'\nteeth = {z}\nmodule = '3 mm'\nface_width = '40 mm'\n" + (
        "helix_angle = '15 deg'\nhand = '{hand}'\n"
    )
    rest = """
[shafts.in]
[shafts.out]
[meshes.mesh]
driver = "p"
driven = "g"
backlash = "0.1 mm"
[bearings.a]
shaft = "in"
[bearings.b]
shaft = "out"
[drives.motor]
shaft = "in"
speed = "1500 rpm"
[loads.brake]
shaft = "out"
torque = "100 N m"
"""
    text = wheel.format(name="p", shaft="in", z=20, hand="right") + wheel.format(
        name="g", shaft="out", z=60, hand="left"
    )
    path.write_text(text + rest)
    pair = Drivetrain.from_file(path).pairs["mesh"]
    assert pair.overlap_ratio == pytest.approx(0.04 * np.sin(np.deg2rad(15)) / (np.pi * 3e-3))
    path.write_text(text.replace("left", "right") + rest)
    with pytest.raises(DrivetrainError, match=says("mesh 'mesh'", "p", "g", "right-handed", "opposite")):
        Drivetrain.from_file(path)
