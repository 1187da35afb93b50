"""Drivetrains written as files: what is read again is the same drivetrain, and runs to the same numbers."""

from __future__ import annotations

import tomllib
import warnings
from dataclasses import replace

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.bearings import Bearing, Spall
from gearmbs.drivetrain import (
    Accelerometer,
    Drivetrain,
    DrivetrainError,
    ElasticBearing,
    ElasticClutch,
    ElementBearing,
    Fan,
    GearMesh,
    Housing,
    HousingMode,
    IdealBearing,
    Mount,
    PlanetaryStage,
    RollingContactBearing,
    RunSettings,
    Shaft,
    SpeedDrive,
    TorqueDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.drivetrain.description import Description, make_description, read_description
from gearmbs.gears import ContactLaw, FlankFriction, GearSpec, IdealMesh, Material, planetary
from gearmbs.gears.faults import BrokenTooth
from gearmbs.mechanism import expression
from gearmbs.studies import load_train, run_train
from gearmbs.studies.case.tooth_faults import tooth_fault
from gearmbs.studies.presets.files import FOLDER
from gearmbs.studies.train_files import train_toml
from tests.says import says

HELICAL = {"helix_angle": "12 deg", "face_width": "25 mm"}
FAULTS = (BrokenTooth(tooth=2, lost=0.4), BrokenTooth(wheel="driven", tooth=0, lost=0.1))


def box(**changes) -> Drivetrain:
    """Return a drivetrain with parts of every group, given in numbers, texts, tables and objects."""
    parts = {
        "shafts": [
            Shaft(
                name="in",
                sections=[
                    {"length": "50 mm", "diameter": "30 mm"},
                    {"length": "60 mm", "diameter": "40 mm", "end_diameter": "35 mm", "bore": "8 mm"},
                    (0.05, 0.015),
                ],
            ),
            Shaft(name="out", length="0.4 m", radius="20 mm"),
            Shaft(name="low speed"),
            Shaft(name="fan", length="0.1 m", inertia=2.0),
        ],
        "wheels": [
            Wheel(
                name="z1",
                shaft="in",
                gear=GearSpec(21, "3 mm", hand="left", material=Material(density="7800 kg/m^3"), **HELICAL),
            ),
            Wheel(name="z2", shaft="out", station="80 mm", gear=GearSpec(43, "3 mm", **HELICAL), angle="3 deg"),
        ],
        "meshes": [
            GearMesh(
                name="stage 1",
                driver="z1",
                driven="z2",
                direction="20 deg",
                settings={
                    "backlash": "0.1 mm",
                    "contact": ContactLaw.linear("3e8 N/m", damping=2000.0),
                    "friction": FlankFriction(0.05),
                    "faults": FAULTS,
                },
            )
        ],
        "bearings": [
            RollingContactBearing(
                name="a",
                shaft="in",
                station="10 mm",
                rolling="6206/C3",
                settings={"defects": (Spall(part="outer", depth="20 um", width="2 mm"),)},
            ),
            RollingContactBearing(
                name="b",
                shaft="in",
                station="150 mm",
                rolling=Bearing(
                    kind="cylindrical roller",
                    elements=13,
                    element_diameter="9 mm",
                    pitch_diameter="46 mm",
                    roller_length="9 mm",
                ),
            ),
            IdealBearing(name="c", shaft="out", station="20 mm"),
            ElasticBearing(name="d", shaft="out", station="250 mm", stiffness=(1e8, 1e8, 1e7)),
            IdealBearing(name="e", shaft="low speed"),
            IdealBearing(name="f", shaft="fan"),
        ],
        "couplings": [ElasticClutch(name="clutch", first="low speed", second="fan", stiffness=2e4)],
        "housings": [
            Housing(
                name="box",
                mass="80 kg",
                inertia=(2.0, 2.5, 3.0),
                mounts=(Mount(name="box foot 1", at=(0.0, -0.2, 0.0), stiffness=(5e7, 5e7, 5e7)),),
                modes=(HousingMode(name="wall", mass=8.0, stiffness=4e7, shape={"a": (0.0, 0.6, 0.8)}),),
            )
        ],
        "drives": [SpeedDrive(name="motor", shaft="in", speed="1500 rpm")],
        "loads": [Fan(name="air", shaft="fan", torque="200 N m", at_speed="30 rad/s")],
        "sensors": [Accelerometer(name="on the box", bearing="a", direction=(0.0, 1.0, 0.0))],
        "planetary_stages": [
            PlanetaryStage(
                name="low stage",
                gears=planetary(
                    (24, 30, 84),
                    "2 mm",
                    3,
                    stiffness="iso",
                    pin_errors={1: ("10 um", "-3 um")},
                    faults=(("sun", BrokenTooth(tooth=1, lost=0.2)),),
                ),
                sun="out",
                carrier="low speed",
                ring="ground",
                sun_station="350 mm",
                pins={"radial": "5e8 N/m"},
            )
        ],
    }
    return Drivetrain("two stages", run_up=0.02, **{**parts, **changes})


def again(thing: Drivetrain | Description) -> Description:
    return make_description(tomllib.loads(train_toml(thing)), "again", tooth_fault)


@pytest.mark.parametrize(
    "name",
    ["bench", "crank_slider", "gearbox", "rattle", "resonance", pytest.param("nrel_5mw", marks=pytest.mark.slow)],
)
def test_files_of_the_package_come_back_equal(name):
    told = read_description(FOLDER / f"{name}.toml", tooth_fault)
    assert again(told) == told


@pytest.mark.slow
def test_a_drivetrain_of_every_kind_of_part_runs_to_the_same_numbers(tmp_path):
    train = box()
    path = gm.save(Description(train, RunSettings(duration="25 ms", settling="5 ms")), tmp_path / "box.toml")
    read = load_train(path)
    assert read.run == RunSettings(duration="25 ms", settling="5 ms")
    assert read.train.pairs == train.pairs
    assert train_toml(read) == path.read_text(encoding="utf-8")
    one, two = (run_train(t, read.run) for t in (train, read.train))
    assert list(one.data_vars) == list(two.data_vars)
    for column in one.data_vars:
        assert np.array_equal(one[column], two[column], equal_nan=True), column


def test_quantities_keep_their_units_and_what_follows_is_left_out():
    text = train_toml(box())
    tables = tomllib.loads(text)
    assert tables["wheels"]["z1"] == {
        "shaft": "in", "teeth": 21, "module": "3 mm", "face_width": "25 mm", "helix_angle": "12 deg", "hand": "left",
        "density": "7800 kg/m^3",
    }  # fmt: skip
    assert tables["bearings"]["a"]["rolling"] == "6206/C3"
    assert tables["meshes"]["stage 1"]["faults"][0]["lost"] == 0.4
    assert tables["housings"]["box"]["mounts"] == {"foot 1": {"at": [0.0, -0.2, 0.0], "stiffness": [5e7, 5e7, 5e7]}}
    assert tables["planetary_stages"]["low stage"]["teeth"] == [24, 30, 84]
    assert "angles" not in tables["planetary_stages"]["low stage"]


def test_expressions_of_time_are_texts():
    varying = TorqueLoad(name="air", shaft="fan", torque=expression("30*(1+0.1*SIN(20*TIME))"))
    read = again(box(loads=[varying])).train.part("air")
    assert str(read.torque) == "30*(1+0.1*SIN(20*TIME))"


def _as_function(name, i, j):
    raise AssertionError("never built")


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"meshes": [GearMesh(name="stage 1", driver="z1", driven="z2", pair=IdealMesh)]}, ("stage 1", "pair")),
        (
            {"bearings": [*box().bearings, ElementBearing(name="own", shaft="fan", element=_as_function)]},
            ("own", "element"),
        ),
    ],
)
def test_what_no_file_can_hold_is_refused_with_its_part(changes, names):
    with pytest.raises(DrivetrainError, match=says(*names)):
        train_toml(box(**changes))


def test_wheels_of_a_set_that_differ_are_written_unless_in_material():
    stage = box().part("low stage")
    gears = stage.gears
    planet = gears.planet
    bored, narrow = replace(planet, bore_radius="5 mm"), replace(planet, face_width=0.9 * planet.face_width)
    other = replace(planet, material=Material(density="7700 kg/m^3"))
    for one, fits in ((planet, True), (bored, True), (narrow, True), (other, False)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            train = box(planetary_stages=[replace(stage, gears=replace(gears, planet=one))])
        if fits:
            read = again(train).train.part("low stage").gears
            assert replace(read, name=gears.name) == replace(gears, planet=one)
        else:
            with pytest.raises(DrivetrainError, match=says("low stage", "gears")):
                train_toml(train)


def test_torque_drives_that_depend_on_time_come_back():
    drive = TorqueDrive(name="motor", shaft="in", speed="1500 rpm", torque="20 N m")
    assert again(box(drives=[drive])).train.part("motor") == drive
