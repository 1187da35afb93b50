"""The industrial gearbox: kinematics, forces in closed form, modes, Campbell diagram, run-up, command line."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.drivetrain import DrivetrainError, RunSettings, SpeedDrive, TorqueLoad, Wheel
from gearmbs.gears import GearSpec
from gearmbs.signals.analysis.campbell import critical_speeds
from gearmbs.studies import GearboxSettings, gearbox_choices, industrial_gearbox, run_gearbox, train_modes, train_report
from gearmbs.studies.trains import run_train
from tests.drivetrain.support import stage
from tests.says import says
from tests.studies.presets import agrees_with_its_file


@pytest.fixture(scope="module")
def study():
    return run_gearbox(duration=0.3, run_up=1.0)


def test_kinematics():
    train = industrial_gearbox()
    assert train.kinematics.ratio("high", "low") == pytest.approx((88 / 22) * (82 / 23), rel=1e-15)
    assert train.kinematics.mesh_frequency("low stage") == pytest.approx(1793 / 60 / 4 * 23)
    assert train.power.on_driven("low stage") == pytest.approx(750e3 / abs(train.speeds["low"]))
    assert all("published" in choice.why or choice.chosen for choice in gearbox_choices())
    spur = industrial_gearbox(GearboxSettings(helix_angle=0.0))
    assert spur.pairs["high stage"].overlap_ratio == 0.0
    with pytest.raises(ValueError, match="motor is 'steam'"):
        industrial_gearbox(GearboxSettings(motor="steam"))


def test_the_file_is_the_gearbox():
    agrees_with_its_file("gearbox", industrial_gearbox())


def test_nothing_is_counted_twice():
    """The moving mass of a shaft with its wheels: the shaft, and of each wheel what is outside of its bore."""
    train = industrial_gearbox()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        train.build()
    for wheel in train.wheels:
        ((_, radius),) = next(shaft.cylinders for shaft in train.shafts if shaft.name == wheel.shaft)
        assert wheel.gear.bore_radius == pytest.approx(radius)
        solid = replace(wheel.gear, bore_radius=0.0)
        share = (radius / wheel.gear.pitch_radius) ** 2
        assert wheel.gear.mass == pytest.approx((1.0 - share) * solid.mass, rel=1e-9)


@pytest.mark.slow
def test_forces_of_helical_stages(study):
    """Each mesh pushes along the axis with F_t tan(beta); on the lay shaft the two oppose; bearings carry the rest."""
    train, record = study.train, study.steady
    axial = {}
    for mesh in train.meshes:
        driver, driven = train.wheels_of(mesh)
        force = float(record["normal_force"].sel(mesh=mesh.name).mean())
        # friction makes the normal force some per cent larger than torque over base radius
        exact = train.power.on_driven(mesh.name) / driven.gear.base_radius / np.cos(driver.gear.base_helix_angle)
        assert force == pytest.approx(exact, rel=0.03)
        axial[mesh.name] = force * np.sin(driver.gear.base_helix_angle)
    z = record["bearing_force"].sel(xyz="z").mean("time")
    carried = {
        shaft: float(z.sel(bearing=f"{shaft} a") + z.sel(bearing=f"{shaft} b")) for shaft in ("high", "lay", "low")
    }
    assert carried["high"] == pytest.approx(axial["high stage"], rel=0.01)
    assert carried["lay"] == pytest.approx(axial["low stage"] - axial["high stage"], rel=0.01)
    assert carried["low"] == pytest.approx(-axial["low stage"], rel=0.01)
    assert record["measured"].sel(sensor="housing at low b").std() > 0.5


def test_modes_of_a_helical_pair_are_those_of_its_chain():
    """A whole overlap ratio keeps the length of contact: one torsional mode, of the stiffness in closed form."""
    width = np.pi * 3e-3 / np.sin(np.deg2rad(20.0))
    made = [
        Wheel(name=n, shaft=s, gear=GearSpec(z, "3 mm", face_width=width, helix_angle="20 deg", hand=hand, name=n))
        for n, s, z, hand in (("pinion", "in", 20, "right"), ("gear", "out", 60, "left"))
    ]
    # hardly any load: deflection prolongs the contact
    train = stage(wheels=made, loads=[TorqueLoad(name="brake", shaft="out", torque=0.1)]).changed(
        "mesh", settings={"contact": {"kind": "linear", "stiffness": 4e8}, "slices": 80}
    )
    pair = train.pairs["mesh"]
    assert pair.overlap_ratio == pytest.approx(1.0)
    modes = train_modes(train)
    gear = made[1].gear
    inertia = gear.inertia[2] + train.part("out").body()[2]
    k = 4e8 * pair.contact_ratio * np.cos(gear.base_helix_angle)
    exact = gear.base_radius * np.sqrt(k / inertia) / (2 * np.pi)
    assert modes.frequencies == pytest.approx([exact], rel=0.02)
    assert train.torsional().frequencies() == pytest.approx([exact], rel=1e-9)


@pytest.mark.slow
def test_modes_and_critical_speeds(study):
    """The first order of the mesh crosses a mode where its frequency says; what damps is bearings, mounts, teeth."""
    found = critical_speeds(study.campbell())
    row = found[found.order == "1 x high stage"].iloc[-1]
    assert row.speed_rpm * 22 / 60 == pytest.approx(row.frequency_hz)
    below = study.modes.frequencies < 1500.0
    assert np.all(study.modes.damping_ratios[below] > 0.005)
    assert np.all(study.modes.damping_ratios[below] < 0.1)
    # the walls' own modes are among them
    assert np.abs(study.modes.frequencies - 310.0).min() < 60.0


@pytest.mark.slow
def test_run_up(study):
    """Speeds follow the curve; at its end the levels are those of the steady state."""
    record = study.run_up
    tracks = record["mesh_track"]
    assert "mesh_rms" not in record
    assert float(tracks.track_speed[0]) < 0.3 * 187.8
    assert float(tracks.track_speed[-1]) == pytest.approx(1793 * np.pi / 30, rel=2e-3)
    assert float(tracks.track_frequency.sel(mesh="high stage")[-1]) == pytest.approx(657.43, rel=2e-3)
    for signal in ("lay b y", "housing at lay b"):
        steady = float(study.steady["mesh_rms"].sel(mesh="high stage", harmonic=1, signal=signal))
        assert np.nanmean(tracks.sel(mesh="high stage", harmonic=1, signal=signal)[-6:]) == pytest.approx(
            steady, rel=0.25
        )
    text = train_report(study.train, record)
    assert "along the run-up" in text


@pytest.mark.slow
def test_report_and_figures(study, tmp_path):
    text = study.report()
    for words in ("## Modes under load", "## Critical speeds", "# Run-up", "| hands | one hand on the lay shaft |"):
        assert words in text
    assert all(path.exists() for path in study.save(tmp_path))
    with pytest.raises(ValueError, match="leave curve out"):
        run_gearbox(GearboxSettings(motor="induction"))


@pytest.mark.slow
def test_a_train_follows_a_curve_from_a_file(tmp_path):
    """A coast-down of one stage, from a file: levels along it instead of one at a mean speed."""
    text = """
run_up = "10 ms"
running = true
[shafts.in]
[shafts.out]
[wheels.pinion]
shaft = "in"
teeth = 20
module = "3 mm"
[wheels.gear]
shaft = "out"
teeth = 60
module = "3 mm"
[meshes.mesh]
driver = "pinion"
driven = "gear"
backlash = "0.1 mm"
[bearings.a]
shaft = "in"
[bearings.b]
shaft = "out"
[drives.motor]
shaft = "in"
speed = "1500 rpm"
curve = [["20 ms", "1500 rpm"], ["0.3 s", "600 rpm"]]
[loads.brake]
shaft = "out"
torque = "100 N m"
[run]
settling = "10 ms"
duration = "0.29 s"
tolerance = 1e-6
"""
    path = tmp_path / "down.toml"
    path.write_text(text)
    result = CliRunner().invoke(app, ["run", str(path)])
    assert result.exit_code == 0, result.output
    assert "## Mesh harmonics along the run-up" in path.with_suffix(".md").read_text()


@pytest.mark.parametrize(("curve", "words"), [
    ([("0 s", "100 rpm")], says("drive 'd'", "curve", "(0.0,)", "give two")),
    ([("0 s", "100 rpm"), ("1 s", "2000 rpm")], says("speed", "give the fastest")),
    ([("0 s", "-100 rpm"), ("1 s", "1500 rpm")], says("speed", "give the fastest")),
    (3.0, "give points"),
])  # fmt: skip
def test_wrong_curves(curve, words):
    with pytest.raises(DrivetrainError, match=words):
        SpeedDrive(name="d", shaft="in", speed="1500 rpm", curve=curve)


def test_speed_of_a_train_that_runs_along_a_curve():
    train = stage(
        drives=[SpeedDrive(name="d", shaft="in", speed=100.0, curve=[(0.0, 40.0), (0.1, 100.0)])], running=True
    )
    assert train.start_share == 0.4
    record = run_train(train, RunSettings(settling=0.0, duration=0.2, tolerance=1e-6))
    assert float(record.speed.sel(shaft="in")[-1]) == pytest.approx(100.0, rel=1e-6)
