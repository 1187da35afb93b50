"""How shafts stand at the start where they are told to, and what rigid couplings join."""

import numpy as np
import pytest

from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    ElasticClutch,
    GearMesh,
    IdealBearing,
    RigidCoupling,
    Shaft,
    SpeedDrive,
    TorqueDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.drivetrain.static.rest import _turned
from gearmbs.gears import GearSpec
from tests.drivetrain.support import stage
from tests.says import says

PLACES = (0.01, 0.04, 0.07)


def off(train, mesh):
    """Return by which part of a pitch the driven wheel of a mesh is away from where its drive flank touches."""
    layout, pair = train.layout, train.pairs[mesh]
    driver, driven = (
        layout.angles[wheel.shaft] + layout.wheels[wheel.name] - layout.directions[mesh]
        for wheel in train.wheels_of(mesh)
    )
    parts = (pair.driven_angle(driver) - driven) * pair.driven.teeth / (2.0 * np.pi)
    return parts - np.round(parts)


@pytest.mark.parametrize("driver", [0.0, 0.3])
def test_a_shaft_that_a_mesh_turns_stands_as_it_is_told(driver):
    plain = stage().changed("in", angle=driver)
    assert plain.layout.wheels["gear"] == 0.0
    told = plain.changed("out", angle=0.4)
    assert told.layout.angles["out"] == 0.4
    assert off(told, "mesh") == pytest.approx(0.0, abs=1e-12)
    # the wheel is turned on its shaft by what is left of whole pitches
    assert 0.0 < abs(told.layout.wheels["gear"]) <= np.pi / 60
    body = told.build().bodies["out"]
    np.testing.assert_allclose(body.orientation[:, 0], [np.cos(0.4), np.sin(0.4), 0.0], atol=1e-15)


def test_a_shaft_and_its_wheel_may_both_be_told_where_their_teeth_fit():
    told = stage().changed("out", angle=0.4)
    fits = told.layout.wheels["gear"]
    both = told.changed("gear", angle=fits).changed("pinion", angle=0.0)
    assert both.layout.wheels["gear"] == fits
    with pytest.raises(DrivetrainError, match=says("'mesh'", "leave out", "wheel 'gear'")):
        _ = both.changed("gear", angle=fits + np.pi / 60).layout


def line(coupling, **angles):
    """Two shafts in line, each with a bearing of its own, and a pair behind them."""
    train = Drivetrain(
        "line",
        shafts=[Shaft(name=name, length=0.1) for name in ("motor", "in", "out")],
        wheels=[
            Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm", bore_radius="15 mm")),
            Wheel(name="gear", shaft="out", gear=GearSpec(60, "3 mm", bore_radius="15 mm")),
        ],
        meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", settings={"backlash": "0.1 mm"})],
        couplings=[coupling],
        bearings=[IdealBearing(name=f"at {name}", shaft=name) for name in ("motor", "in", "out")],
        drives=[SpeedDrive(name="drive", shaft="motor", speed="1500 rpm")],
        loads=[TorqueLoad(name="brake", shaft="out", torque="300 N m")],
    )
    for name, angle in angles.items():
        train = train.changed(name, angle=angle)
    return train


CLUTCH = ElasticClutch(name="clutch", first="motor", second="in", stiffness=3000.0)


def test_shafts_in_line_stand_as_they_are_told():
    assert line(CLUTCH, motor=0.2).layout.angles["in"] == 0.2
    told = line(CLUTCH, motor=0.2, **{"in": -0.5})
    assert (told.layout.angles["motor"], told.layout.angles["in"]) == (0.2, -0.5)
    assert off(told, "mesh") == pytest.approx(0.0, abs=1e-12)
    assert told.layout.wheels["gear"] == 0.0


def test_a_train_that_has_turned_has_all_flanks_at_work_again():
    told = line(CLUTCH, motor=0.2, out=0.1, **{"in": -0.5})
    settled = told.changed("gear", angle=told.layout.wheels["gear"]).changed("pinion", angle=0.0)
    for time in (0.001, 0.0123):
        turned = _turned(settled, time)
        assert off(turned, "mesh") == pytest.approx(0.0, abs=1e-9)
        gone = turned.layout.angles["in"] - told.layout.angles["in"]
        assert gone == pytest.approx(told.speeds["in"] * time, rel=1e-12)


def test_shafts_in_a_rigid_coupling_are_one_inertia_of_the_torsional_chain():
    joint = RigidCoupling(name="flange", first="motor", second="in")
    joined, soft = line(joint), line(CLUTCH)
    model, chain = joined.torsional(), soft.torsional()
    assert model.names == ("motor", "out")
    assert model.joined == {"in": "motor"}
    np.testing.assert_allclose(model.inertias, [chain.inertias[0] + chain.inertias[1], chain.inertias[2]], rtol=1e-14)
    # held at the drive, the gear alone moves on the mesh
    mesh = joined.mesh_springs["mesh"]
    alone = np.sqrt(mesh.stiffness * mesh.levers[1] ** 2 / model.inertias[1]) / (2.0 * np.pi)
    np.testing.assert_allclose(model.frequencies(), [alone], rtol=1e-12)
    assert joined.mesh_dynamics["mesh"].frequency == pytest.approx(alone, rel=1e-12)
    moved = {name: model.response(np.array(PLACES), {name: 1.0}) for name in ("motor", "in")}
    np.testing.assert_array_equal(moved["motor"], moved["in"])


def test_the_chain_of_a_rigid_coupling_is_the_limit_of_stiff_ones():
    free = {"drives": [TorqueDrive(name="drive", shaft="motor", speed="1500 rpm", torque="100 N m")]}
    rigid = Drivetrain("rigid", **{**vars_of(line(RigidCoupling(name="c", first="motor", second="in"))), **free})
    stiff = ElasticClutch(name="c", first="motor", second="in", stiffness=1e12)
    near = Drivetrain("stiff", **{**vars_of(line(stiff)), **free})
    found, limit = rigid.torsional().frequencies(), near.torsional().frequencies()
    np.testing.assert_allclose(found, limit[: found.size], rtol=1e-6, atol=1e-3)
    assert rigid.mesh_dynamics["mesh"].mass > near.mesh_dynamics["mesh"].mass


def test_a_chain_that_a_drive_holds_whole_has_no_frequencies():
    joint = RigidCoupling(name="flange", first="motor", second="in")
    train = line(joint)
    held = Drivetrain(
        "held", shafts=train.shafts[:2], couplings=[joint], bearings=train.bearings[:2], drives=train.drives
    )
    chain = held.torsional()
    assert chain.frequencies().size == chain.damping_ratios().size == 0
    assert "1 inertias" in repr(chain)


def vars_of(train):
    """Return the parts of a drivetrain, by group."""
    groups = ("shafts", "wheels", "meshes", "couplings", "bearings", "loads")
    return {group: getattr(train, group) for group in groups}
