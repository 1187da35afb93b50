"""Errors of flanks as excitations of a plant, against closed forms and runs, and meshes that carry nothing."""

import warnings

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import (
    Drag,
    Drivetrain,
    ElasticClutch,
    GearMesh,
    IdealBearing,
    Shaft,
    SpeedDrive,
    Wheel,
)
from gearmbs.gears import FlankFriction, GearSpec, IdealMesh
from gearmbs.gears.geometry import turn_z
from gearmbs.mechanism import Mechanism, ModelError
from tests.says import says

PAIR = gm.GearPair(GearSpec(20, "3 mm", face_width="20 mm"), GearSpec(60, "3 mm", face_width="20 mm"))
LEVERS = np.array([PAIR.driver.base_radius, PAIR.driven.base_radius])
STIFFNESS, DAMPING, INERTIA, HELD = 2e7, 300.0, np.array([4e-4, 1.6e-2]), np.array([2000.0, 3000.0])


def at_rest(torque=60.0, mesh=None):
    """Two wheels on springs about their axes, wound up so that the mesh carries a force."""
    m = Mechanism("pair")
    apart = PAIR.geometry.centre_distance
    wheels = [
        m.body(name, 1.0, (1.0, 1.0, float(inertia)), position=(x, 0, 0), orientation=turn_z(angle))
        for name, inertia, x, angle in zip(("one", "two"), INERTIA, (0.0, apart), (0.0, np.pi / 60), strict=True)
    ]
    for wheel, stiffness in zip(wheels, HELD, strict=True):
        pin = m.revolute(f"{wheel.name} pin", wheel, m.ground, axis=(0, 0, 1))
        m.torsion_spring(f"{wheel.name} spring", pin.i, pin.j, stiffness=float(stiffness))
    m.torque("wind", wheels[0], torque)
    m.gear_contact("mesh", *wheels, mesh or IdealMesh(PAIR, stiffness=STIFFNESS, damping=DAMPING))
    return m


@pytest.mark.parametrize("speed", [150.0, -90.0])
def test_an_error_that_goes_with_the_angle_pushes_the_first_wheel_besides(speed):
    """M phi'' + K phi = (k u + c u') r + F u'/Omega on the first wheel, F the force that the mesh carries."""
    m = at_rest()
    asked = [("joint_rate", "one pin"), ("joint_rate", "two pin")]
    inputs = [("transmission_error", "mesh"), ("transmission_error", "mesh", "position", f"{speed} rad/s")]
    plants = [m.linearize([one], asked, at="equilibrium") for one in inputs]
    f = np.array([40.0, 400.0, 900.0])
    force = 60.0 * LEVERS[0] / HELD[0] / (1.0 / STIFFNESS + (LEVERS**2 / HELD).sum())
    for s, fixed, turning in zip(2j * np.pi * f, *(p.frequency_response(f) for p in plants), strict=True):
        flank = STIFFNESS + DAMPING * s
        matrix = np.diag(INERTIA) * s**2 + np.diag(HELD) + flank * np.outer(LEVERS, LEVERS)
        for found, push in ((fixed, 0.0), (turning, force * s / speed)):
            exact = s * np.linalg.solve(matrix, flank * LEVERS + np.array([push, 0.0]))
            np.testing.assert_allclose(found[:, 0], exact, rtol=1e-6)


CYCLE = np.arange(512) / 512
SIZE, SPEED, SLOWLY = 1e-7, 150.0, 5.0


def by_runs(make, shown):
    """Return e^(i a) (slope - i value) of what static positions show of an error SIZE sin(a), once a mesh cycle."""
    rest, *moved = [
        np.array(make(error).linearize([], shown, at="equilibrium").point.outputs)
        for error in (None, *(SIZE * np.sin(2.0 * np.pi * (CYCLE + phase)) for phase in (0.0, 0.25)))
    ]
    return moved[0] - rest - 1j * (moved[1] - rest)


def by_plant(make, shown):
    """Return the same but e^(i a), which is not known: what an error does at rest, and what its rate does besides."""
    kinds = [("transmission_error", "mesh", *speed) for speed in ((), ("position", SPEED))]
    value, both = (
        make(None).linearize([kind], shown, at="equilibrium").frequency_response(SLOWLY)[0, :, 0] for kind in kinds
    )
    teeth = PAIR.driver.teeth
    slope = (teeth * SPEED * (both - value) / (2j * np.pi * SLOWLY)).real
    return SIZE * (slope - 1j * value.real)


def in_bushings(error):
    m = Mechanism("free across")
    apart = PAIR.geometry.centre_distance
    wheels = []
    for name, inertia, x, angle, held in zip(
        ("one", "two"), INERTIA, (0.0, apart), (0.0, np.pi / 60), HELD, strict=True
    ):
        wheel = m.body(name, 1.0, (1.0, 1.0, float(inertia)), position=(x, 0, 0), orientation=turn_z(angle))
        wheels.append(wheel)
        seats = (body.marker_at((x, 0, 0), np.eye(3)) for body in (wheel, m.ground))
        m.bushing(
            f"{name} seat", *seats, stiffness=(5e7, 5e7, 5e7), damping=(1e2, 1e2, 1e2),
            torsional_stiffness=(1e6, 1e6, float(held)), torsional_damping=(0, 0, 0),
        )  # fmt: skip
    m.torque("wind", wheels[0], 60.0)
    m.gear_contact("mesh", *wheels, IdealMesh(PAIR, stiffness=STIFFNESS, damping=DAMPING, error=error))
    return m


def on_an_arm(error):
    m = Mechanism("arm")
    arm = m.body("arm", 1.0, (1.0, 1.0, 0.5))
    one, two = (
        m.body(name, mass, (1.0, 1.0, float(inertia)), position=(x, 0, 0), orientation=turn_z(angle))
        for name, mass, inertia, x, angle in zip(
            ("one", "two"), (1.0, 1e-3), INERTIA, (0.0, PAIR.geometry.centre_distance), (0.0, np.pi / 60), strict=True
        )
    )
    for body, base, stiffness in ((arm, m.ground, 4e4), (one, m.ground, 2000.0), (two, arm, 3000.0)):
        pin = m.revolute(f"{body.name} pin", body, base, axis=(0, 0, 1))
        m.torsion_spring(f"{body.name} spring", pin.i, pin.j, stiffness=stiffness)
    m.torque("wind", one, 60.0)
    mesh = IdealMesh(PAIR, stiffness=STIFFNESS, damping=DAMPING, error=error)
    m.gear_contact("mesh", one, two, mesh, carrier=arm)
    return m


SEATS = [("load", f"{name} seat", part) for name in ("one", "two") for part in ("fx", "fy")]
PINS = [("joint_angle", f"{name} pin") for name in ("arm", "one", "two")]


@pytest.mark.parametrize(("make", "shown"), [(in_bushings, SEATS), (on_an_arm, PINS)])
def test_an_error_that_goes_with_the_angle_acts_back_on_what_holds_the_centres(make, shown):
    """The phase counts from the line of action, which the centres carry; static positions with the error know it."""
    found, expected = by_runs(make, shown), by_plant(make, shown)
    found *= np.exp(-1j * np.angle(np.vdot(expected, found)))
    np.testing.assert_allclose(found, expected, atol=0.01 * np.abs(expected).max())


def test_equal_names_of_states_and_wrong_speeds():
    """Each rate of an error that is given by its acceleration is a state of its own."""
    m = at_rest()
    plant = m.linearize([("transmission_error", "mesh", "acceleration")], [("joint_rate", "one pin")])
    assert len(set(plant.states)) == len(plant.states)
    assert plant.states[-2:] == [f"transmission_error mesh acceleration ({one})" for one in ("position", "rate")]
    both = m.linearize([("transmission_error", "mesh"), ("transmission_error", "mesh", "position", 50.0)], [])
    assert list(both.inputs) == ["transmission_error mesh", "transmission_error mesh of the angle"]
    for speed, words in ((0.0, says("'mesh'", "0 rad/s")), ("3 m", says("'mesh'", "rad/s"))):
        with pytest.raises(ModelError, match=words):
            m.linearize([("transmission_error", "mesh", "position", speed)], [])


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_speed_of_an_error_that_goes_with_the_angle_is_held_against_the_point(sense):
    m = at_rest()
    for body, share in zip(("one", "two"), (1.0, -1.0 / 3.0), strict=True):
        m.bodies[body].angular_velocity = (0.0, 0.0, 40.0 * sense * share)
    m.linearize([("transmission_error", "mesh", "position", 50.0 * sense)], [])
    with pytest.raises(ModelError, match=says("'transmission_error mesh of the angle'", f"{-50 * sense:g} rad/s")):
        m.linearize([("transmission_error", "mesh", "position", -50.0 * sense)], [])


def test_a_mesh_that_carries_nothing_is_told_of():
    """Teeth with backlash that do not touch; with a load that has come on they do."""
    teeth = PAIR.with_changes(backlash="0.1 mm", friction=FlankFriction.none())
    m = at_rest(gm.mechanism.step(0.0, 0.0, 0.1, 60.0), teeth)
    for options in ({}, {"at": "equilibrium"}):
        with pytest.warns(UserWarning, match=says("'mesh'", "t = 0 s", "at='equilibrium'")):
            m.linearize([], [("joint_angle", "one pin")], **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loaded = m.linearize([], [("joint_angle", "one pin")], at="equilibrium", t=1.0)
    assert np.abs(loaded.poles).max() > 1e4


def turning(error, speed):
    """A drive at a speed, a clutch, a mesh, a clutch, and what brakes by its speed."""
    names = ("motor", "in", "out", "brake")
    return Drivetrain(
        "train",
        shafts=[Shaft(name=name, radius="20 mm", length="100 mm") for name in names],
        wheels=[
            Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm")),
            Wheel(name="gear", shaft="out", gear=GearSpec(60, "3 mm")),
        ],
        meshes=[
            GearMesh(
                name="mesh", driver="pinion", driven="gear", pair=IdealMesh,
                settings={"stiffness": "2e7 N/m", "error": error},
            )
        ],
        couplings=[
            ElasticClutch(name="c1", first="motor", second="in", stiffness=2000.0, damping=0.3),
            ElasticClutch(name="c2", first="out", second="brake", stiffness=3000.0, damping=1.0),
        ],
        bearings=[IdealBearing(name=f"{name} b", shaft=name) for name in names],
        drives=[SpeedDrive(name="drive", shaft="motor", speed=speed)],
        loads=[Drag(name="drag", shaft="brake", torque=0.0, viscous=1.5)],
        running=True,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [150.0, 400.0])
def test_errors_of_a_mesh_under_load_excite_as_in_a_run(frequency):
    """2 um once a mesh cycle, at the speed that makes it the frequency; an error fixed in time is off by a third."""
    speed, size = 2.0 * np.pi * frequency / 20, 2e-6
    error = size * np.sin(2.0 * np.pi * np.arange(128) / 128)
    smooth = turning(None, speed)
    at = smooth.build().simulate(0.2, rate=1000)
    shown = [("speed", name) for name in ("in", "out", "brake")]
    late = 0.4 + np.arange(256) / 256 * 8.0 / frequency
    run = turning(error.tolist(), speed).build().simulate(late[-1], t_eval=np.r_[0.0, late], tol=1e-9)
    turn = np.exp(-2j * np.pi * frequency * late)
    found = [2.0 / 256 * abs(run.angular_velocity(name)[1:, 2] @ turn) for name in ("in", "out", "brake")]
    off = {}
    for kind in ((), ("position", speed)):
        plant = smooth.linearize([("transmission_error", "mesh", *kind)], shown, at=at)
        expected = size * np.abs(plant.frequency_response(frequency)[0, :, 0])
        off[len(kind)] = np.abs(np.array(found) / expected - 1.0).max()
    assert off[2] < 0.01
    assert off[0] > (0.3 if frequency == 400.0 else 0.01)
