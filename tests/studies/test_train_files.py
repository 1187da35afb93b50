"""Drivetrains written as files: what is read again is the same drivetrain, and runs to the same numbers."""

from __future__ import annotations

import tomllib
import warnings
from dataclasses import replace

import numpy as np
import pint
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
from gearmbs.gears import ContactLaw, FlankFriction, GearSpec, IdealMesh, Material, PlanetarySet, planetary
from gearmbs.gears.faults import BrokenTooth
from gearmbs.mechanism import expression
from gearmbs.studies import load_train, run_train
from gearmbs.studies.case.tooth_faults import tooth_fault
from gearmbs.studies.presets.files import FOLDER
from gearmbs.studies.train_files import train_toml
from gearmbs.units import to_si
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
    [
        "bench",
        "crank_slider",
        "gearbox",
        "grc_750kw",
        "rattle",
        "resonance",
        pytest.param("nrel_5mw", marks=pytest.mark.slow),
    ],
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


@pytest.mark.slow
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


@pytest.mark.parametrize("names", [("foot", "box foot"), ("foot",), ("box foot", "foot", "box box foot")])
def test_mounts_and_modes_keep_their_names(names):
    at = [(0.1 * k, -0.2, 0.0) for k in range(len(names))]
    mounts = tuple(Mount(name=n, at=a, stiffness=(5e7, 5e7, 5e7)) for n, a in zip(names, at))
    modes = tuple(
        HousingMode(name=f"{n} mode", mass=8.0, stiffness=4e7 + k, shape={"a": [0.0, 0.6, 0.8]})
        for k, n in enumerate(names)
    )
    housing = replace(box().part("box"), mounts=mounts, modes=modes)
    assert again(box(housings=[housing])).train.part("box") == housing


class Propeller(Fan):
    """A load of one's own, of which a file knows nothing."""


def test_classes_of_ones_own_are_refused():
    load = Propeller(name="air", shaft="fan", torque="200 N m", at_speed="30 rad/s")
    with pytest.raises(DrivetrainError, match=says("air", "kind", "Python")):
        train_toml(box(loads=[load]))


def test_texts_that_a_field_would_read_otherwise_become_numbers():
    """25 Hz are 25 as a frequency, and 157 rad/s as a speed."""
    drive = SpeedDrive(name="motor", shaft="in", speed=to_si("25 Hz", "frequency"))
    text = train_toml(box(drives=[drive]))
    assert "speed = 25.0" in text
    assert make_description(tomllib.loads(text), "again", tooth_fault).train.part("motor").speed == 25.0


@pytest.mark.parametrize(
    "law", [ContactLaw.hunt_crossley(factor="1 s/m"), ContactLaw.impact("3e5 N/mm^1.3", damping="2 N*s/mm")]
)
def test_laws_of_contact_come_back(law):
    mesh = GearMesh(name="stage 1", driver="z1", driven="z2", settings={"contact": law})
    read = again(box(meshes=[mesh])).train
    assert read.pairs["stage 1"].contact == law


def test_quantities_of_pint_become_texts():
    mesh = GearMesh(name="stage 1", driver="z1", driven="z2", settings={"backlash": pint.Quantity(0.1, "mm")})
    train = box(meshes=[mesh])
    assert again(train).train.pairs["stage 1"].backlash == train.pairs["stage 1"].backlash == pytest.approx(1e-4)


@pytest.mark.parametrize(
    "bearing",
    [
        Bearing.from_designation("6206"),
        Bearing.from_designation("6206/C3", clearance=0.0),
        Bearing(elements=9, element_diameter="9.5 mm", pitch_diameter="46 mm", designation="my 6206"),
    ],
)
def test_bearings_come_back_by_designation_or_fields(bearing):
    train = box(bearings=[RollingContactBearing(name="a", shaft="in", rolling=bearing), *box().bearings[1:]])
    assert again(train).train.part("a").rolling == bearing


SUN, PLANET, RING = (GearSpec(z, "2 mm", internal=z == 84, name=n) for z, n in ((24, "s"), (30, "p"), (84, "r")))


@pytest.mark.parametrize(
    "gears",
    [
        PlanetarySet(SUN, PLANET, RING, 3),
        PlanetarySet(SUN, PLANET, GearSpec(78, "2 mm", internal=True), 3, planet_at_ring=GearSpec(24, "2 mm")),
        planetary((24, 30, 84), "2 mm", 3, helix_angle="10 deg", hand="left", ideal=[3e8, 4e8]),
    ],
)
@pytest.mark.parametrize("pins", [None, {"radial": "5e8 N/m"}, "HK2020"])
@pytest.mark.slow
def test_planetary_stages_come_back(gears, pins):
    stage = replace(box().part("low stage"), gears=gears, pins=pins)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        train = box(planetary_stages=[stage])
        read = again(train).train.part("low stage")
    assert [g.teeth for g in (read.gears.sun, read.gears.planet, read.gears.ring)] == [
        g.teeth for g in (gears.sun, gears.planet, gears.ring)
    ]
    assert read.gears.pairs_sun == replace(gears, name="low stage").pairs_sun or not gears.sun.helix_angle
    assert read.weights == stage.weights
    assert train_toml(replace(train, planetary_stages=(read,))) == train_toml(train)


def test_a_wheel_that_needs_its_addendum_is_written():
    gear = GearSpec(
        21, "3 mm", profile_shift=0.9, addendum="4 mm", hand="left", material=Material(name="bronze"), **HELICAL
    )
    wheel = replace(box().part("z1"), gear=gear)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        train = box(wheels=[wheel, box().part("z2")])
    assert again(train).train.part("z1").gear.addendum == gear.addendum


def test_odd_names_are_escaped():
    sensor = replace(box().part("on the box"), name='a "b"\x7f.c\nd')
    assert again(box(sensors=[sensor])).train.part(sensor.name) == sensor


def test_a_part_may_be_called_as_its_drivetrain():
    train = replace(box(), name="box", running=True, gravity=(0.0, -9.81, 0.0))
    read = again(Description(train, RunSettings(rate="20 kHz")))
    assert (read.train.name, read.train.running, read.train.gravity) == ("box", True, (0.0, -9.81, 0.0))
    assert read.run.rate == 20e3
    assert read.train.part("box").mounts == train.part("box").mounts
