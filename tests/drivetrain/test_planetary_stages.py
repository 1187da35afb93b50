"""Planetary stages inside drivetrains, against the set alone, closed laws and mechanisms made by hand."""

import json
import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.adams import write_deck
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    ElasticBearing,
    ElasticClutch,
    GearMesh,
    Housing,
    IdealBearing,
    InductionMotor,
    Mount,
    PlanetaryStage,
    RunSettings,
    Shaft,
    SpeedDrive,
    SpeedSensor,
    TorqueLoad,
    Wheel,
)
from gearmbs.drivetrain.description import read_description
from gearmbs.drivetrain.plants import resting
from gearmbs.flexible import box_model
from gearmbs.gears import GearPair, GearSpec, IdealMesh, PlanetarySet, Support, planetary, planetary_mechanism
from gearmbs.mechanism import linear_modes
from gearmbs.mechanism.solve.analyses import static_equilibrium
from gearmbs.studies import (
    load_train,
    mode_table,
    named_modes,
    run_train,
    train_campbell,
    train_modes,
    train_report,
    train_scene,
    train_signal,
)
from gearmbs.studies.run import steady
from gearmbs.studies.train_record import TrainRecorder
from gearmbs.studies.train_views import mesh_orders
from gearmbs.studies.trains import transmission_error
from tests.says import says

TEETH = (24, 30, 84)
IDEAL = {"ideal": (4e8, 5e8)}
PINS = Support(radial="5e8 N/m", damping="1e-6 s")
MEMBERS = ("sun", "carrier", "ring")
Z_RATIO = TEETH[2] / TEETH[0]


def gears(**changes):
    return planetary(TEETH, "1.5 mm", **{"planets": 3, **changes})


def light(name, **others):
    """A shaft that weighs nothing beside the members on it."""
    return Shaft(name=name, length="10 mm", diameter="10 mm", mass=1e-9, inertia=1e-15, **others)


def alone(held="ring", drive="sun", load="carrier", speed="600 rpm", torque="50 N m", on="ground", set_of=None, **more):
    """A train of nothing but a stage; its shafts are called as the members on them."""
    names = [member for member in MEMBERS if member != held]
    parts = {
        "shafts": [light(name) for name in names],
        "bearings": [IdealBearing(name=f"{name} seat", shaft=name, on="ground") for name in names],
        "drives": [SpeedDrive(name="motor", shaft=drive, speed=speed)],
        "loads": [TorqueLoad(name="brake", shaft=load, torque=torque)],
        **{key: more.pop(key) for key in ("housings", "drives", "loads", "sensors", "run_up") if key in more},
    }
    holders = {member: on if member == held else member for member in MEMBERS}
    stage = PlanetaryStage(name="set", gears=set_of or gears(**IDEAL), **holders, **more)
    return Drivetrain("alone", planetary_stages=[stage], **parts)


def two_stages(set_of=None, pins=PINS, mesh=None, **changes):
    """A parallel stage before a planetary one, whose carrier turns the output in two bearings."""
    first, second = ({"bore_radius": "10 mm"} for _ in range(2))
    given = {
        "shafts": [Shaft(name=n, length=length, diameter="20 mm")
                   for n, length in (("in", "50 mm"), ("mid", "100 mm"), ("out", "100 mm"))],
        "wheels": [
            Wheel(name="z1", shaft="in", station="20 mm", gear=GearSpec(20, "2 mm", **first)),
            Wheel(name="z2", shaft="mid", station="20 mm", gear=GearSpec(50, "2 mm", **second)),
        ],
        "meshes": [mesh or GearMesh(name="first", driver="z1", driven="z2", settings={"backlash": "50 um"})],
        "bearings": [IdealBearing(name="a", shaft="in"), IdealBearing(name="b", shaft="mid"),
                     IdealBearing(name="c", shaft="out")],
        "planetary_stages": [PlanetaryStage(name="second", sun="mid", sun_station="80 mm", carrier="out", ring="ground",
                                            pins=pins, gears=set_of or gears())],
        "drives": [SpeedDrive(name="motor", shaft="in", speed="3000 rpm")],
        "loads": [TorqueLoad(name="brake", shaft="out", torque="60 N m")],
        "run_up": 0.01,
    }  # fmt: skip
    return Drivetrain("two stages", **{**given, **changes})


def unloaded(train):
    """All but: forces that turn with the teeth have a stiffness of their own."""
    return train.changed("brake", torque=1e-6)


# Speeds, torques and lines.


@pytest.mark.parametrize(
    ("held", "drive", "load", "ratio"),
    [
        ("ring", "sun", "carrier", 1 / (1 + Z_RATIO)),
        ("ring", "carrier", "sun", 1 + Z_RATIO),
        ("carrier", "sun", "ring", -1 / Z_RATIO),
        ("carrier", "ring", "sun", -Z_RATIO),
        ("sun", "ring", "carrier", Z_RATIO / (1 + Z_RATIO)),
        ("sun", "carrier", "ring", (1 + Z_RATIO) / Z_RATIO),
    ],
)
def test_speeds_and_torques_are_those_of_willis_whichever_member_is_held(held, drive, load, ratio):
    train = alone(held, drive, load)
    assert train.kinematics.ratio(load, drive) == pytest.approx(ratio, rel=1e-12)
    power = train.power.drive["motor"] * train.speeds[drive]
    assert power == pytest.approx(50.0 * abs(train.speeds[load]), rel=1e-12)
    torques = train.power.members["set"]
    assert sum(torques.values()) == pytest.approx(0.0, abs=1e-9)
    assert torques["ring"] / torques["sun"] == pytest.approx(Z_RATIO, rel=1e-12)
    assert abs(torques[load]) == pytest.approx(50.0, rel=1e-12)
    # whichever turns, the planets hold the member back that drives
    assert train.pairs["set sun-planet 1"].rotation == (-1 if torques["sun"] > 0.0 else 1)


def test_two_drives_of_a_stage_without_a_held_member_add():
    drives = [SpeedDrive(name="one", shaft="sun", speed=100.0), SpeedDrive(name="two", shaft="ring", speed=20.0)]
    train = alone(held=None, drives=drives)
    assert train.speeds["carrier"] == pytest.approx((100.0 + Z_RATIO * 20.0) / (1 + Z_RATIO), rel=1e-12)
    power = train.power.drive["one"] * 100.0 + train.power.drive["two"] * 20.0
    assert power == pytest.approx(50.0 * train.speeds["carrier"], rel=1e-12)
    assert train.power.drive["two"] / train.power.drive["one"] == pytest.approx(Z_RATIO, rel=1e-12)


def branched(**changes):
    """The drive splits: to the sun, and through two wheels to the ring; the carrier is the output."""
    wheel, other = GearSpec(30, "2 mm", bore_radius="5 mm"), GearSpec(120, "2 mm", bore_radius="5 mm")
    shafts = [light("sun"), light("carrier"), light("ring"), light("side")]
    shafts = [replace(shaft, length=0.2, diameter=0.001, radius=None) for shaft in shafts]
    stations = {"sun_station": "20 mm", "carrier_station": "20 mm", "ring_station": "20 mm"}
    stage = PlanetaryStage(name="set", gears=gears(), sun="sun", carrier="carrier", ring="ring", **stations)
    return Drivetrain(
        "branched",
        shafts=shafts,
        wheels=[
            Wheel(name="w1", shaft="sun", station="100 mm", gear=wheel), Wheel(name="w2", shaft="side", gear=other),
            Wheel(name="w3", shaft="side", station="150 mm", gear=wheel),
            Wheel(name="w4", shaft="ring", station="150 mm", gear=other),
        ],
        meshes=[GearMesh(name="m1", driver="w1", driven="w2"), GearMesh(name="m2", driver="w3", driven="w4")],
        bearings=[IdealBearing(name=f"b {shaft.name}", shaft=shaft.name) for shaft in shafts],
        planetary_stages=[stage],
        drives=[SpeedDrive(name="motor", shaft=changes.get("drive", "sun"), speed=changes.get("speed", 160.0))],
        loads=[TorqueLoad(name="brake", shaft=changes.get("load", "carrier"), torque=40.0)],
    )  # fmt: skip


def test_power_that_branches_into_a_stage_is_followed_from_either_end():
    train = branched()
    expected = (160.0 + Z_RATIO * 10.0) / (1 + Z_RATIO)
    assert train.speeds["carrier"] == pytest.approx(expected, rel=1e-12)
    other = branched(drive="carrier", speed=expected, load="sun")
    assert other.speeds["sun"] == pytest.approx(160.0, rel=1e-12)
    assert train.power.drive["motor"] * 160.0 == pytest.approx(40.0 * expected, rel=1e-12)
    through = train.power.torques["m2"][1] * train.speeds["ring"]
    assert through == pytest.approx(-train.power.members["set"]["ring"] * train.speeds["ring"], rel=1e-12)
    assert train.power.torques["m1"][0] * 160.0 == pytest.approx(-through, rel=1e-12)


def test_lines_are_those_of_the_set_and_its_neighbours():
    table = two_stages(pins="6203").kinematics
    mid, carrier = 20.0, 20.0 * 24 / 108
    found = {(row.of, row.name): row.frequency for row in table.lines.itertuples()}
    mesh = 24 * (mid - carrier)
    planet = mesh / 30
    for (of, name), expected in {
        ("second", "GMF"): mesh, ("first", "GMF"): 1000.0, ("second", "planet pass"): 3 * carrier,
        ("second", "sun fault"): 3 * (mid - carrier), ("second", "planet fault"): planet,
        ("second", "ring fault"): 3 * carrier, ("second sun", "hunting tooth"): mesh / 120,
        ("second ring", "hunting tooth"): mesh / 420,
    }.items():  # fmt: skip
        assert found[of, name] == pytest.approx(expected, rel=1e-12), (of, name)
    pins = two_stages(pins="6203").planetary_stages[0].on_pins.rolling
    assert found["second pins", "BPFO"] == pytest.approx(pins.multiples["BPFO"] * planet, rel=1e-12)
    # what passes the loaded side of a pin: its inner ring stands, and the cage is dragged on by the outer one
    cage = pins.multiples["BPFI"] / pins.elements * planet
    assert found["second pins", "cage at the pin"] == pytest.approx(cage, rel=1e-12)
    assert ("second pins", "FTF") not in found
    assert table.nearest(2 * mesh)[0] == "2 x GMF of second"
    assert table.nearest(mesh + planet)[0] == "1 x GMF of second +1 x planet of second"
    # all wheels stand as before after whole turns of shafts and planets
    turns = table.common_period() * np.array([*table.train.turning.values()]) / (2 * math.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)


def turbine(low, middle, fast):
    """Two planetary stages from rotor to a parallel one, or one planetary and two parallel ones."""
    names = ["rotor", "first", "second", "high"]
    shafts = [light(name) for name in names]
    # the last one is short: it passes beside the ring of the stage before it
    shafts = [replace(shaft, length=0.5 if shaft.name == "high" else 2.0) for shaft in shafts]
    stages, wheels, meshes = [], [], []
    for k, stage in enumerate((low, middle, fast)):
        before, after = names[k], names[k + 1]
        if isinstance(stage, PlanetaryStage):
            at = {"sun_station": 0.2, "carrier_station": 1.8}
            stages.append(replace(stage, sun=after, carrier=before, ring="ground", **at))
        else:
            for name, shaft, gear in ((f"big {k}", before, stage[0]), (f"small {k}", after, stage[1])):
                wheels.append(
                    Wheel(name=name, shaft=shaft, gear=gear, station=0.2 if shaft == "high" else 1.0 + 0.1 * k)
                )
            meshes.append(GearMesh(name=f"mesh {k}", driver=f"big {k}", driven=f"small {k}"))
    return Drivetrain(
        "turbine", shafts=shafts, wheels=wheels, meshes=meshes, planetary_stages=stages,
        bearings=[IdealBearing(name=f"b {name}", shaft=name) for name in names],
        drives=[SpeedDrive(name="wind", shaft="rotor", speed="12.1 rpm")],
        loads=[TorqueLoad(name="generator", shaft="high", torque="1 kN m")],
    )  # fmt: skip


def planets_of(name, teeth, module, radius, **others):
    wheels = {"fillet_radius": 0.2 * module}
    stage_of = planetary(teeth, module, 3, carrier_radius=radius, wheels=wheels, **others)
    return PlanetaryStage(name=name, gears=stage_of, sun="", carrier="", ring="")


def published_turbine():
    # Nejad, Guo, Gao, Moan: Development of a 5 MW reference gearbox for offshore wind turbines. Wind Energy 19 (2016)
    one = planets_of("one", (19, 17, 56), 0.045, 0.863, face_width=0.491, profile_shifts=(0.617, 0.802, -0.501))
    two = planets_of("two", (18, 36, 93), 0.021, 0.584, face_width=0.550, profile_shifts=(0.389, 0.504, 0.117))
    wheels = {"face_width": 0.36, "helix_angle": "10 deg", "bore_radius": 0.01}
    fast = (GearSpec(95, 0.014, profile_shift=0.669, hand="right", **wheels),
            GearSpec(24, 0.014, profile_shift=0.480, hand="left", **wheels))  # fmt: skip
    return turbine(one, two, fast)


def test_ratios_of_published_turbine_gearboxes():
    train = published_turbine()
    table = train.kinematics
    assert abs(table.ratio("high", "rotor")) == pytest.approx(96.354, abs=5e-4)
    rotor = 12.1 / 60.0
    assert table.mesh_frequency("one") == pytest.approx(56 * rotor, rel=1e-12)
    assert table.mesh_frequency("two") == pytest.approx(93 * 75 / 19 * rotor, rel=1e-12)
    # what the generator takes the rotor gives, and planets push the rotor back
    assert train.power.drive["wind"] == pytest.approx(1e3 * 96.354, rel=1e-5)
    assert train.power.members["one"]["carrier"] == pytest.approx(-train.power.drive["wind"], rel=1e-12)
    assert train.pairs["mesh 2"].geometry.centre_distance == pytest.approx(0.861, abs=2e-4)


# The mechanism.


@pytest.mark.parametrize("held", ["ring", "carrier", None])
@pytest.mark.parametrize("pins", [None, PINS])
def test_modes_of_a_train_of_one_stage_are_those_of_the_set_alone(held, pins):
    drive = "sun" if held != "sun" else "ring"
    drives = [] if held else [SpeedDrive(name="second", shaft="ring", speed=10.0)]
    train = alone(held, drive, "ring" if held == "carrier" else "carrier", pins=pins,
                  drives=[SpeedDrive(name="motor", shaft=drive, speed=60.0), *drives])  # fmt: skip
    train = unloaded(train)
    speeds = {drive: 0.0} if held else {drive: 0.0, "ring": 0.0}
    whole = planetary_mechanism(gears(**IDEAL), held=held, speeds=speeds, pins=pins)
    expected, found = linear_modes(whole, t=1.0).frequencies, train_modes(train).frequencies
    top = expected.max()
    np.testing.assert_allclose(np.sort(found[found > 1e-4 * top]), np.sort(expected[expected > 1e-4 * top]), rtol=1e-7)


def at_rest(train):
    """Return forces of all contacts at rest under the loads."""
    still = resting(train)
    found = static_equilibrium(still.build(), t=2 * still.run_up).solution
    return {one.name: float(found.diagnostics(one.name)["normal_force"][-1]) for one in train.meshings}


def test_forces_at_rest_are_those_of_the_set_alone_in_true_contact():
    errors = {1: (0.0, 2e-6), 2: (1e-6, -1e-6)}
    set_of = gears(pin_errors=errors, backlash_sun="20 um", backlash_ring="20 um")
    found = at_rest(alone(set_of=set_of, pins=PINS, run_up=0.005))
    whole = planetary_mechanism(set_of, speeds={"sun": 0.0}, torques={"carrier": -50.0}, pins=PINS, run_up="5 ms")
    rest = static_equilibrium(whole, t=0.01).solution
    for k in (1, 2, 3):
        for name in (f"sun-planet {k}", f"planet {k}-ring"):
            expected = float(rest.diagnostics(name)["normal_force"][-1])
            assert found[f"set {name}"] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_planets_share_equally_and_by_statics_with_a_pin_error():
    radius, alpha = float(gears().carrier_radius), math.radians(20.0)
    force = 50.0 / radius / 3.0
    equal = at_rest(alone(pins=PINS))
    np.testing.assert_allclose(list(equal.values()), force / (2 * math.cos(alpha)), rtol=1e-6)
    # a planet yields by its pin and by both meshes, which it divides; an error of its pin is as much less way
    error = 1.5e-6
    soft = 1 / PINS.radial + (1 / IDEAL["ideal"][0] + 1 / IDEAL["ideal"][1]) / (2 * math.cos(alpha)) ** 2
    found = at_rest(alone(set_of=gears(**IDEAL, pin_errors={1: (0.0, error)}), pins=PINS))
    # the carrier is driven: a pin that is ahead of it carries less
    expected = [force + error / (3 * soft), force - 2 * error / (3 * soft), force + error / (3 * soft)]
    for side in ("sun-planet {}", "planet {}-ring"):
        shares = [found["set " + side.format(k)] * 2 * math.cos(alpha) for k in (1, 2, 3)]
        np.testing.assert_allclose(shares, expected, rtol=1e-4)


@pytest.mark.parametrize("held", ["ring", "carrier"])
@pytest.mark.parametrize("drive", ["sun", "other"])
def test_pin_errors_are_in_the_sense_of_rotation_whichever_way_the_set_turns(held, drive):
    other = "carrier" if held == "ring" else "ring"
    shafts = {"drive": drive if drive == "sun" else other, "load": other if drive == "sun" else "sun"}
    set_of = gears(**IDEAL, pin_errors={1: (1e-6, 2e-6)})
    one, mirrored = (at_rest(alone(held, **shafts, speed=s, set_of=set_of, pins=PINS)) for s in (60.0, -60.0))
    np.testing.assert_allclose(list(mirrored.values()), list(one.values()), rtol=1e-6)
    shares = [one[f"set sun-planet {k}"] for k in (1, 2, 3)]
    assert max(shares) > 1.2 * min(shares)


def test_forces_of_pins_are_in_the_sense_of_rotation_too():
    set_of = gears(**IDEAL, pin_errors={1: (0.0, 2e-6)})
    told = []
    for speed in (60.0, -60.0):
        still = resting(alone(speed=speed, set_of=set_of, pins=PINS))
        m = still.build()
        rest = static_equilibrium(m, t=2 * still.run_up).solution
        told.append(TrainRecorder(still, m).columns(rest).bearing_force[-1, -3:])
    np.testing.assert_allclose(told[1], told[0], rtol=1e-5, atol=1e-3)
    # the load on the carrier holds planets back by their pins
    assert told[0][:, 1].sum() * float(set_of.carrier_radius) == pytest.approx(-50.0, rel=1e-5)


@pytest.mark.parametrize("carrier", [1.0, 0.0])
def test_pin_errors_of_the_set_alone_are_in_the_sense_of_rotation(carrier):
    errors = {0: (0.0, 1e-4)}
    for sign in (1, -1):
        speeds = {"carrier": 60.0 * sign * carrier} if carrier else {"sun": 60.0 * sign}
        m = planetary_mechanism(gears(**IDEAL, pin_errors=errors), speeds=speeds, held="ring" if carrier else "carrier")
        assert m.bodies["planet 1"].position[1] == pytest.approx(sign * 1e-4, rel=1e-12)
    # nothing turns: the drive flanks tell it
    for rotation in (1, -1):
        m = planetary_mechanism(gears(**IDEAL, rotation=rotation, pin_errors=errors), speeds={"sun": 0.0})
        assert m.bodies["planet 1"].position[1] == pytest.approx(rotation * 1e-4, rel=1e-12)


def test_a_parallel_and_a_planetary_stage_are_as_a_mechanism_made_by_hand():
    settings = {"stiffness": 3e8, "damping_ratio": 0.0}
    mesh = GearMesh(name="first", driver="z1", driven="z2", settings=settings, pair=IdealMesh)
    train = unloaded(two_stages(set_of=gears(**IDEAL), mesh=mesh))
    wheel, pinion = train.parts["z2"].gear, train.parts["z1"].gear
    bare = gears(**IDEAL, rotation=-1)
    turning = {name: shaft.body()[2] for name, shaft in ((s.name, s) for s in train.shafts)}
    own = {"sun": bare.sun.inertia[2] + turning["mid"] + wheel.inertia[2]}
    own["carrier"] = train.planetary_stages[0].weights["carrier"][1][2] + turning["out"]
    m = planetary_mechanism(bare, pins=PINS, masses={name: (1.0, moment) for name, moment in own.items()})
    pair = GearPair(pinion, wheel)
    place = (-pair.centre_distance, 0.0, 0.0)
    axis = m.body("z1", 1.0, (1.0, 1.0, turning["in"] + pinion.inertia[2]), position=place)
    m.rotation("drive", m.revolute("z1 seat", axis, m.ground, at=place, axis=(0, 0, 1)), 0.0)
    m.gear_contact("first", axis, m.bodies["sun"], IdealMesh(pair, 3e8))
    expected, found = linear_modes(m, t=1.0).frequencies, train_modes(train).frequencies
    top = expected.max()
    np.testing.assert_allclose(np.sort(found[found > 1e-4 * top]), np.sort(expected[expected > 1e-4 * top]), rtol=1e-6)


def test_the_torsional_chain_has_the_modes_of_planets_on_ideal_pins():
    train = unloaded(two_stages(set_of=gears(**IDEAL), pins=None))
    train = train.changed("first", pair=IdealMesh, settings={"stiffness": 3e8, "damping_ratio": 0.0})
    chain, modes = train.torsional(), train_modes(train)
    assert chain.names == ("in", "mid", "out", "second planet 1", "second planet 2", "second planet 3")
    found = chain.frequencies()
    expected = np.sort(modes.frequencies[modes.oscillating])
    np.testing.assert_allclose(found[found > 0.0], expected[-found[found > 0.0].size :], rtol=1e-5)
    t, angles, speeds = chain.simulate(2e-3, {"out": -60.0}, {"in": (100.0, 0.0, 0.0)})
    assert speeds[0] == pytest.approx([train.turning[n] * 100.0 / train.speeds["in"] for n in chain.names], rel=1e-9)
    assert np.all(np.isfinite(angles))
    assert t[-1] == pytest.approx(2e-3)


@pytest.mark.slow
def test_a_carrier_on_a_shaft_that_bends_becomes_that_on_a_rigid_one():
    bearings = [ElasticBearing(name=n, shaft="out", station=z, stiffness=(2e8, 2e8, 1e8))
                for n, z in (("c", "10 mm"), ("d", "90 mm"))]  # fmt: skip
    rigid = two_stages(set_of=gears(**IDEAL))
    rigid = replace(rigid, bearings=[*rigid.bearings[:2], *bearings])

    def with_stiffness(factor):
        shaft = rigid.parts["out"]
        return rigid.with_parts(replace(shaft, modes=4, youngs_modulus=2.1e11 * factor))

    limit = train_modes(rigid)
    expected = np.sort(limit.frequencies[limit.oscillating])[:6]
    errors = []
    for factor in (1.0, 1e3):
        modes = train_modes(with_stiffness(factor))
        errors.append(np.abs(np.sort(modes.frequencies[modes.oscillating])[:6] / expected - 1.0).max())
    assert errors[0] > 0.01
    assert errors[1] < 2e-3


@pytest.mark.slow
def test_energy_is_closed_and_the_record_holds_what_the_stage_does():
    # the sun drives: a pin that is behind carries more
    train = two_stages(gears(pin_errors={1: (0.0, "-5 um")}, backlash_sun="50 um", backlash_ring="50 um"),
                       sensors=[SpeedSensor(name="speed", shaft="out")])  # fmt: skip
    solution = train.build().simulate(0.03, every_step=True, tol=1e-9, rate_scale=train.rate_scale)
    assert solution.energy_balance().relative_imbalance < 1e-5
    record = run_train(train, RunSettings(settling=0.02, duration=0.1, tolerance=1e-6))
    # mean forces carry the load, planet by planet in proportion to their pins
    stage, radius = train.planetary_stages[0], float(train.planetary_stages[0].gears.carrier_radius)
    pins = record.bearing_force.sel(bearing=[stage.pin(k) for k in (1, 2, 3)]).mean("time").values
    assert pins[:, 1].sum() * radius == pytest.approx(-60.0, rel=1e-2)
    assert pins[1, 1] < 2 * pins[0, 1]
    sun = record.normal_force.sel(mesh=[f"second sun-planet {k}" for k in (1, 2, 3)]).mean("time").values
    base = stage.gears.sun.base_radius
    assert sun.sum() * base == pytest.approx(60.0 * 24 / 108, rel=1e-2)
    # both meshes push a planet on
    np.testing.assert_allclose(-pins[:, 1], 2 * math.cos(math.radians(20.0)) * sun, rtol=0.03)
    assert record.speed.sel(shaft="second planet 1").mean() == pytest.approx(train.turning["second planet 1"], rel=1e-3)
    signal = train_signal(record, "speed", mesh="second planet 3-ring")
    frequency = signal.attrs["teeth"][0] * signal.attrs["speed"] / (2 * math.pi)
    assert frequency == pytest.approx(train.kinematics.mesh_frequency("second"), rel=1e-3)
    assert float(record.mesh_frequency.sel(mesh="second planet 3-ring")) == pytest.approx(frequency, rel=1e-3)
    report = train_report(train, record)
    assert "| second | sun |" in report
    assert "second planet 2 pin" in report
    assert report.count("### ") == 3


@pytest.mark.slow
def test_transmission_errors_of_planets_on_ideal_pins_are_how_far_the_teeth_yield():
    train = alone(set_of=gears(), speed="3000 rpm", load="carrier", torque="50 N m", run_up=0.005)
    record = run_train(train, RunSettings(settling=0.02, duration=0.03, tolerance=1e-7))
    for mesh in train.meshings:
        one = record.sel(mesh=mesh.name)
        assert float(one.transmission_error.mean()) == pytest.approx(float(one.penetration_drive.mean()), rel=0.02)


@pytest.mark.parametrize("held", ["ring", "carrier"])
def test_transmission_errors_know_how_far_a_housing_that_holds_a_member_turns(held):
    feet = [Mount(name=f"foot {k}", at=(0.2 * math.cos(a), 0.2 * math.sin(a), 0.0), stiffness=(1e6,) * 3)
            for k, a in enumerate((0.3, 0.3 + math.tau / 3, 0.3 + 2 * math.tau / 3))]  # fmt: skip
    load = "carrier" if held == "ring" else "ring"
    for changes, turns in (({"housings": [case(mounts=feet)], "on": "case"}, True), ({}, False)):
        still = resting(alone(held, load=load, run_up=0.005, **changes))
        m = still.build()
        rest = static_equilibrium(m, t=2 * still.run_up).solution
        told = TrainRecorder(still, m).columns(rest)
        angle = told.turned[-1, -1]
        # three springs around the axis against the torque on the member held
        torque = still.power.members["set"][held]
        expected = torque / (3 * 1e6 * 0.2**2) if turns else 0.0
        assert angle == pytest.approx(expected, rel=1e-2)
        errors = transmission_error(still, told.turned, told.twisted)[-1]
        forces = [float(rest.diagnostics(mesh.name)["normal_force"][-1]) for mesh in still.meshings]
        stiffness = np.repeat(IDEAL["ideal"], 3)
        np.testing.assert_allclose(errors, np.array(forces) / stiffness, rtol=1e-4)


@pytest.mark.slow
def test_levels_of_what_planets_do_to_shafts_do_not_depend_on_the_length_of_the_record():
    train = alone(set_of=planetary((22, 26, 74), "1.5 mm", 3), pins=PINS, speed="3000 rpm", run_up=0.01)
    turn = math.tau / train.speeds["carrier"]
    force, other = ("carrier seat x", "force of set sun-planet 1")
    found = []
    for duration in (0.5 * turn, turn, 1.7 * turn, 2 * turn):
        record = run_train(train, RunSettings(settling=0.05, duration=duration, tolerance=1e-6))
        levels = record.mesh_rms.sel(mesh="set sun-planet 1", harmonic=[1, 2])
        assert (record.attrs["remarks"] == "none") == (duration >= turn)
        found.append([levels.sel(signal=signal).values for signal in (force, other)])
    # of two turns every second line is an order of the carrier: the mesh is the 74th, and each third moves the axis
    x = record.bearing_force.sel(bearing="carrier seat", xyz="x").values
    lines = np.abs(np.fft.rfft(x - x.mean()))[::2] * math.sqrt(2) / x.size
    expected = [math.hypot(*lines[order - 3 : order + 4]) for order in (74, 148)]
    assert lines[75] > 5 * lines[74]
    np.testing.assert_allclose(found[3][0], expected, rtol=0.02)
    for levels, meshes in found[1:]:
        np.testing.assert_allclose(levels, found[3][0], rtol=0.02)
        np.testing.assert_allclose(meshes, found[3][1], rtol=0.02)
    assert np.isnan(found[0][0]).all()
    np.testing.assert_allclose(found[0][1], found[3][1], rtol=0.02)


@pytest.mark.slow
def test_a_train_that_runs_already_turns_as_it_must_with_rolling_pins():
    train = replace(two_stages(gears(), pins="6203"), running=True)
    solution = train.build().simulate(2e-3, rate=20000, tol=1e-7, rate_scale=train.rate_scale)
    for body, speed in train.turning.items():
        found = solution.angular_velocity(body)[:, 2]
        np.testing.assert_allclose(found, speed, rtol=0.05)


def test_modes_are_named_by_the_stage_and_its_pins():
    train = two_stages()
    named = named_modes(train)
    assert {"mesh 'second sun'", "bearing 'second pins'"} <= set(named.name.values.tolist())
    assert mode_table(named)["other"].abs().max() < 1e-4
    diagram = train_campbell(train, ["0 rpm", "3000 rpm"], maximum=12e3)
    assert "1 x second" in diagram.order_name.values
    assert np.all(np.isfinite(diagram.critical_gain))


def test_each_side_of_stepped_planets_excites_at_its_own_frequency():
    stepped = PlanetarySet(GearSpec(24, "1.5 mm"), GearSpec(36, "1.5 mm"), GearSpec.ring(86, "1.5 mm"),
                           planet_at_ring=GearSpec(26, "1.5 mm"), **IDEAL)  # fmt: skip
    train = alone(set_of=stepped, pins=PINS)
    turns = stepped.frequencies(sun=train.speeds["sun"], ring=0.0)
    orders = mesh_orders(train)
    shaft = train.kinematics.shaft_frequency("sun")
    assert set(orders) == {f"{h} x set {side}" for h in (1, 2) for side in ("sun", "ring")}
    assert orders["2 x set ring"] * shaft == pytest.approx(2 * turns["mesh_ring"], rel=1e-12)
    assert orders["1 x set sun"] * shaft == pytest.approx(turns["mesh"], rel=1e-12)
    diagram = train_campbell(train, ["0 rpm", "3000 rpm"], maximum=2e4)
    assert "1 x set ring" in diagram.order_name.values
    assert np.all(np.isfinite(diagram.critical_gain))
    assert set(mesh_orders(alone())) == {"1 x set", "2 x set"}


@pytest.mark.slow
def test_the_view_shows_planets_carrier_and_a_held_ring():
    train = two_stages()
    scene = train_scene(train)
    colours = [part.colour for part in scene.parts if part.name in {shaft.name for shaft in train.shafts}]
    assert len(set(colours)) == len(colours) == len(train.shafts)
    names = [part.name for part in scene.parts]
    assert {"second planet 1", "second ring", "mid", "out"} <= set(names)
    ring = next(part for part in scene.parts if part.name == "second ring")
    assert np.ptp(ring.mesh.vertices, axis=0)[0] > 2 * gears().ring.root_radius


def test_a_deck_has_the_planets_and_their_meshes(tmp_path):
    contact = {"contact": {"kind": "impact"}}
    train = two_stages(gears(contact=None), pins=None).changed("first", settings=contact)
    stage = train.planetary_stages[0]
    from gearmbs.gears import ContactLaw

    train = train.with_parts(replace(stage, gears=gears(contact=ContactLaw.impact())))
    write_deck(train.build(), tmp_path / "train.adm")
    text = (tmp_path / "train.adm").read_text()
    assert "second planet 3" in text


# Files, and what is refused.

FILE = """
gravity = [0.0, -9.81, 0.0]
[shafts.in]
length = "100 mm"
bearings.a = { station = "50 mm" }
[shafts.out]
length = "100 mm"
bearings.c = { station = "50 mm" }
[planetary_stages.low]
sun = "in"
carrier = "out"
ring = "ground"
teeth = [24, 30, 84]
module = "1.5 mm"
planets = 3
backlash_sun = "50 um"
pins = { radial = "5e8 N/m", damping = "1e-6 s" }
pin_errors = { 2 = ["0 um", "5 um"] }
friction = { static = 0.1, dynamic = 0.05 }
[[planetary_stages.low.faults]]
at = "planet 1 sun side"
kind = "broken tooth"
tooth = 3
[drives.motor]
shaft = "in"
speed = "1500 rpm"
[loads.brake]
shaft = "out"
torque = "60 N m"
"""


def test_a_file_describes_a_stage_as_python_does(tmp_path):
    path = tmp_path / "train.toml"
    path.write_text(FILE)
    stage = load_train(path).train.planetary_stages[0]
    assert stage.gears.pin_errors[1] == pytest.approx((0.0, 5e-6))
    assert stage.on_pins == PINS
    assert stage.gears.backlash_sun == pytest.approx(50e-6)
    where, fault = stage.gears.faults[0]
    assert (where, fault.tooth) == ("planet 1 sun side", 3)
    assert stage.gears.friction.dynamic == 0.05
    assert len(load_train(path).train.build().elements) > 6


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('module = "1.5 mm"\n', "", ("planetary_stages.low", "module", "missing")),
        ("planets = 3", "planet = 3", ("planetary_stages.low", "planet", "planets")),
        ('sun = "in"\n', "", ("planetary_stages.low", "sun", "missing")),
        ("planets = 3", "planets = 5", ("planetary_stages.low", "5", "nearest")),
        ('radial = "5e8 N/m"', 'radial = "-5 N/m"', ("pins", "radial", "0 or more")),
    ],
)
def test_what_is_wrong_in_a_file_is_named(tmp_path, old, new, words):
    path = tmp_path / "train.toml"
    path.write_text(FILE.replace(old, new))
    with pytest.raises(DrivetrainError, match=says("train.toml", *words)):
        load_train(path)


def test_rolling_pins_have_defects_from_a_file(tmp_path):
    path = tmp_path / "train.toml"
    springs = 'pins = { radial = "5e8 N/m", damping = "1e-6 s" }'
    spall = 'defects = [{ kind = "spall", part = "outer", width = "1 mm" }]'
    path.write_text(FILE.replace(springs, f'pins = {{ rolling = "6203", {spall} }}'))
    pin = load_train(path).train.build().elements["low planet 2 pin"]
    assert pin.bearing.designation == "6203"
    assert pin.settings.defects[0].part == "outer"
    path.write_text(FILE.replace(springs, 'pins = { rolling = "6203", dampings = 5.0 }'))
    with pytest.raises(DrivetrainError, match=says("'low'", "pins", "dampings", "damping")):
        load_train(path)


def test_faults_need_a_reader_of_theirs(tmp_path):
    path = tmp_path / "train.toml"
    path.write_text(FILE)
    with pytest.raises(DrivetrainError, match=says("planetary_stages.low", "faults", "gearmbs run")):
        read_description(path)


def case(**others):
    return Housing(name="case", mass="20 kg", inertia=(1.0, 1.0, 1.0), **others)


def in_walls(**changes):
    """A stage whose ring is in the end wall of a box on four feet."""
    feet = [Mount(name=f"foot {k}", at=(x, y, 0.0), stiffness=(changes.get("feet", 1e8),) * 3, radius="30 mm")
            for k, (x, y) in enumerate(((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)))]  # fmt: skip
    model = box_model((0.24, 0.24, 0.1), "12 mm", divisions=(4, 4, 1))
    stiff = changes.get("stiffness", 1.0)
    walls = Housing(name="case", model=replace(model, stiffness=stiff * model.stiffness), mounts=feet, modes=6,
                    at=(-0.12, -0.12, -0.006), seats=changes.get("seats", {}))  # fmt: skip
    return alone(on="case", housings=[walls], pins=PINS)


@pytest.mark.slow
def test_a_ring_in_a_housing_of_finite_elements_pushes_on_its_mounts():
    train = in_walls()
    still = resting(train)
    rest = static_equilibrium(still.build(), t=2 * still.run_up).solution
    forces = np.array([rest.load(f"foot {k}")[0][-1] for k in range(4)])
    places = np.array([mount.at for mount in train.housings[0].mounts])
    moment = np.cross(places, forces)[:, 2].sum()
    assert moment == pytest.approx(-train.power.members["set"]["ring"], rel=1e-5)
    assert "set ring" in train.modal_models["case"].seats
    expected = train_modes(alone(pins=PINS)).frequencies.max()
    soft, stiff = (train_modes(in_walls(stiffness=x, feet=x * 1e8)) for x in (1.0, 1e2))
    near = [np.abs(modes.frequencies[modes.oscillating] / expected - 1.0).min() for modes in (soft, stiff)]
    assert near[1] < 1e-3
    assert near[0] > 10 * near[1]


@pytest.mark.slow
def test_a_ring_without_nodes_of_its_housing_is_refused():
    with pytest.raises(DrivetrainError, match=says("'set ring'", "'case'", "nodes")):
        _ = in_walls(seats={"set ring": ("1 mm", "1 mm")}).modal_models


@pytest.mark.slow
def test_a_ring_may_be_on_a_rigid_housing_and_a_carrier_not_on_finite_elements():
    train = alone(on="case", housings=[case()])
    assert train.build().elements["set planet 1-ring"].j.body.name == "case"
    feet = [Mount(name=f"foot {k}", at=at, stiffness=(1e7,) * 3, radius="20 mm")
            for k, at in enumerate(((0, 0, 0), (0.2, 0, 0), (0.1, 0, 0.2)))]  # fmt: skip
    walls = Housing(name="case", model=box_model((0.2, 0.2, 0.2), "40 mm", divisions=(1, 1, 1)), mounts=feet)
    with pytest.raises(DrivetrainError, match=says("'set'", "carrier", "'case'", "finite elements")):
        alone(held="carrier", load="ring", on="case", housings=[walls])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sun": "ground"}, ("sun", "ring", "held")),
        ({"carrier": "in"}, ("carrier", "'in'", "own")),
        ({"sun": "motor"}, ("sun", "'motor'", "drive")),
        ({"ring": "case"}, ("ring", "'case'", "no part")),
        ({"sun_station": "300 mm"}, ("sun_station", "300", "'in'")),
        ({"ring_station": "3 mm"}, ("ring_station", "no shaft")),
    ],
)
def test_members_that_cannot_be_are_refused(tmp_path, changes, words):
    path = tmp_path / "train.toml"
    path.write_text(FILE)
    train = load_train(path).train
    stage = train.planetary_stages[0]
    assert train.with_parts(replace(stage, sun_station="30 mm")).layout.seats["in"].origin[2] == pytest.approx(0.0)
    with pytest.raises(DrivetrainError, match=says("'low'", *words)):
        train.with_parts(replace(stage, **changes))


def test_members_that_are_placed_apart_are_refused():
    train = two_stages()
    for place, words in (((0.0, 0.0, 0.0), "along"), ((0.1, 0.0, 0.03), "coaxial")):
        with pytest.raises(DrivetrainError, match=says("'second'", "'mid'", "'out'", words)):
            replace(train, shafts=[
                train.shafts[0],
                replace(train.shafts[1], position=(0.0, 0.0, 0.0)),
                replace(train.shafts[2], position=place),
            ])  # fmt: skip
    fits = replace(train, shafts=[train.shafts[0], replace(train.shafts[1], position=(0.0, 0.0, 0.0)),
                                  replace(train.shafts[2], position=(0.0, 0.0, 0.03))])  # fmt: skip
    assert fits.layout.seats["out"].origin[2] == pytest.approx(0.03)


def test_a_stage_that_no_member_holds_needs_two_speeds_that_agree():
    with pytest.raises(DrivetrainError, match=says("'set'", "drive", "two")):
        alone(held=None)
    speeds = {"sun": 100.0, "ring": 20.0, "carrier": (100.0 + Z_RATIO * 20.0) / (1 + Z_RATIO)}

    def driven(**others):
        drives = [SpeedDrive(name=f"on {n}", shaft=n, speed=w) for n, w in {**speeds, **others}.items()]
        return alone(held=None, drives=drives)

    assert driven().speeds["carrier"] == pytest.approx(speeds["carrier"])
    with pytest.raises(DrivetrainError, match=says("'set'", "30", "teeth")):
        driven(carrier=30.0)


def test_the_mass_of_a_member_on_a_housing_belongs_to_that():
    heavy = {"masses": {"ring": (50.0, 1.0)}}
    with pytest.raises(DrivetrainError, match=says("'set'", "masses", "ring", "'case'")):
        alone(on="case", housings=[case()], **heavy)
    assert alone(on="case", housings=[case()], masses={"sun": (2.0, 1e-3)}).build().bodies["sun"].mass > 2.0
    on_shaft = alone(held="carrier", load="ring", **heavy)
    assert on_shaft.build().bodies["ring"].mass == pytest.approx(50.0)


def crowded(sun="20 mm", first="0 mm", wheel="0 mm", teeth=18, second="60 mm"):
    """A wheel on the sun's shaft, with a pinion beside it, a stage behind it, and a second one behind that."""
    shafts = [
        Shaft(name="sun", length="200 mm", diameter=sun),
        Shaft(name="mid", length="200 mm", diameter="10 mm"),
        Shaft(name="out", length="60 mm", diameter="10 mm"),
        Shaft(name="side", length="20 mm", diameter="10 mm"),
    ]
    one = PlanetaryStage(name="one", gears=gears(), sun="sun", sun_station="100 mm", carrier="mid", ring="ground",
                         carrier_station=first)  # fmt: skip
    two = PlanetaryStage(name="two", gears=gears(), sun="mid", sun_station=second, carrier="out", ring="ground")
    return Drivetrain(
        "crowded", shafts=shafts, planetary_stages=[one, two],
        bearings=[IdealBearing(name=f"b {s.name}", shaft=s.name) for s in shafts],
        wheels=[Wheel(name="w", shaft="sun", station=wheel, gear=GearSpec(teeth, "1.5 mm")),
                Wheel(name="pinion", shaft="side", gear=GearSpec(100, "1.5 mm"))],
        meshes=[GearMesh(name="m", driver="pinion", driven="w")],
        drives=[SpeedDrive(name="motor", shaft="side", speed=10.0)],
        loads=[TorqueLoad(name="brake", shaft="out", torque=40.0)],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sun": "40 mm", "teeth": 60}, ("'one'", "shaft 'sun'", "20 mm")),
        ({"wheel": "100 mm"}, ("'one'", "'pinion'", "76.5 mm")),
        ({"wheel": "75 mm", "teeth": 60}, None),
        ({"wheel": "85 mm", "teeth": 60}, ("'one'", "'w'", "46.5 mm")),
        ({"second": "15 mm"}, ("'one'", "stage 'two'", "20 mm")),
        ({"sun": "30 mm", "teeth": 60, "second": "25 mm"}, None),
    ],
)
def test_planets_need_room_of_their_own(changes, words):
    crowded()
    if words is None:
        crowded(**changes)
        return
    with pytest.raises(DrivetrainError, match=says(*words)):
        crowded(**changes)


def test_a_stage_that_nothing_drives_is_refused():
    with pytest.raises(DrivetrainError, match=says("'set'", "drive")):
        alone(drives=[], loads=[])


def differential(drives, duration, settling=0.01, **more):
    """Return a train without a held member and its record."""
    train = alone(held=None, drives=drives, set_of=gears(), pins=PINS, run_up=0.005, **more)
    return train, run_train(train, RunSettings(settling=settling, duration=duration))


@pytest.mark.slow
def test_a_stage_that_turns_as_a_block_has_signals_and_lines_of_shafts():
    drives = [SpeedDrive(name=f"on {n}", shaft=n, speed="1000 rpm") for n in ("sun", "ring")]
    train, record = differential(drives, 0.02)
    signal = train_signal(record, "force of set sun-planet 1")
    assert "speed" not in signal.attrs
    lines = json.loads(signal.attrs["known_lines"])
    assert lines["1 x 1x of carrier"] == pytest.approx(1000 / 60, rel=1e-6)
    assert lines["1 x GMF of set"] == pytest.approx(0.0, abs=1e-4)
    assert train_report(train, record).count("### ") == 2


@pytest.mark.slow
def test_lines_of_shafts_that_slip_each_its_way_are_at_their_own_speeds():
    motor = InductionMotor(name="on sun", shaft="sun", speed="1400 rpm", power="2 kW", breakdown=2.5)
    drives = [motor, SpeedDrive(name="on ring", shaft="ring", speed="200 rpm")]
    record = differential(drives, 0.1, settling=0.1)[1]
    lines = json.loads(train_signal(record, "force of set sun-planet 1").attrs["known_lines"])
    turns = record.speed.mean("time") / math.tau
    assert abs(float(turns.sel(shaft="sun")) / (1400 / 60) - 1.0) > 0.005
    for shaft in MEMBERS:
        assert lines[f"1 x 1x of {shaft}"] == pytest.approx(float(turns.sel(shaft=shaft)), rel=1e-9)
    mesh = 24 * float(turns.sel(shaft="sun") - turns.sel(shaft="carrier"))
    assert lines["2 x GMF of set"] == pytest.approx(2 * mesh, rel=1e-9)
    assert float(record.mesh_frequency[0]) == pytest.approx(mesh, rel=1e-4)


@pytest.mark.slow
def test_the_steady_motion_of_planets_on_axes_that_stand_repeats_itself_after_a_mesh():
    set_of = gears(backlash_sun="50 um", backlash_ring="50 um")
    train = alone(held="carrier", load="ring", set_of=set_of, speed="3000 rpm", run_up=0.005)
    mesh = 1.0 / train.kinematics.mesh_frequency("set")
    record = run_train(train, RunSettings(settling=0.06, duration=0.02, tolerance=1e-9))
    # `steady` finds lines within 2e-3 of the largest, which is that of the sun's mesh, from wherever it begins
    largest = float(record.mesh_rms.sel(signal="force of set sun-planet 1", harmonic=1, mesh="set sun-planet 1"))
    for settle in (1, 2, 8):
        motion = gm.steady(train, settle=settle)
        assert motion.orbit.period == pytest.approx(mesh, rel=1e-12)
        t = motion.solution.t
        for name in ("set sun-planet 1", "set planet 3-ring"):
            force, found = motion.solution.contact(name)["normal_force"], record.sel(mesh=name)
            assert np.trapezoid(force, t) / mesh == pytest.approx(float(found.normal_force.mean()), rel=1e-3)
            first = abs(np.trapezoid(force * np.exp(-1j * math.tau * t / mesh), t)) * math.sqrt(2.0) / mesh
            level = found.mesh_rms.sel(signal=f"force of {name}", harmonic=1)
            assert first == pytest.approx(float(level), abs=2e-3 * largest)


def test_a_long_period_of_planets_is_told_before_it_is_integrated(monkeypatch):
    monkeypatch.setattr(steady, "steady_motion", lambda mechanism, period, **settings: period)
    train = alone()
    mesh = 1.0 / train.kinematics.mesh_frequency("set")
    with pytest.warns(UserWarning, match=says("840", "period", "run_train")):
        assert gm.steady(train) == pytest.approx(840 * mesh, rel=1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert gm.steady(train, 0.1) == 0.1
        held = alone(held="carrier", load="ring")
        assert gm.steady(held) == pytest.approx(1.0 / held.kinematics.mesh_frequency("set"))


def test_a_clutch_leads_into_a_stage():
    train = two_stages()
    clutch = ElasticClutch(name="clutch", first="motor shaft", second="in", stiffness=1e4)
    shaft = Shaft(name="motor shaft", length="50 mm")
    coupled = replace(train, shafts=[*train.shafts, shaft], couplings=[clutch],
                      bearings=[*train.bearings, IdealBearing(name="m", shaft="motor shaft")],
                      drives=[SpeedDrive(name="motor", shaft="motor shaft", speed="3000 rpm")])  # fmt: skip
    assert coupled.power.torques["clutch"][1] == pytest.approx(60.0 / (2.5 * 4.5), rel=1e-12)
