"""Linear plants of drivetrains: two shafts and a mesh against their equations, sensors, transmission error."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

import gearmbs as gm
from gearmbs.drivetrain import (
    ControlledDrive,
    Drivetrain,
    ElasticClutch,
    GearMesh,
    IdealBearing,
    PlanetaryStage,
    Shaft,
    SpeedDrive,
    SpeedSensor,
    TorqueDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.drivetrain.drives import Drive
from gearmbs.gears import GearSpec, IdealMesh, Support, loaded_transmission_error, planetary
from gearmbs.mechanism import ModelError, make_input
from gearmbs.studies import train_modes
from tests.says import says


def stage(drive: str = "torque") -> Drivetrain:
    """Return one stage, 20 to 60 teeth."""
    kind = {"torque": TorqueDrive(name="motor", shaft="in", speed="1500 rpm", torque="100 N m"),
            "speed": SpeedDrive(name="motor", shaft="in", speed="1500 rpm")}[drive]  # fmt: skip
    return Drivetrain(
        "one stage",
        shafts=[Shaft(name="in"), Shaft(name="out")],
        wheels=[
            Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm")),
            Wheel(name="gear", shaft="out", gear=GearSpec(60, "3 mm")),
        ],
        meshes=[GearMesh(name="stage", driver="pinion", driven="gear", settings={"backlash": "0.1 mm"})],
        bearings=[IdealBearing(name="a", shaft="in"), IdealBearing(name="b", shaft="out")],
        drives=[kind],
        loads=[TorqueLoad(name="brake", shaft="out", torque="300 N m")],
        sensors=[SpeedSensor(name="tacho", shaft="out")],
    )


@pytest.mark.slow
def test_two_shafts_and_a_mesh_move_as_two_masses_on_a_spring():
    """J_1 w_1' = T - r_1 F, J_2 w_2' = -r_2 F, F = k (d - e) + c (d' - e'), d = r_1 phi_1 + r_2 phi_2."""
    train = stage()
    plant = train.linearize([("torque", "in"), ("transmission_error", "stage")],
                            ["tacho", ("angle", "in"), ("transmission_error", "stage")])  # fmt: skip
    first, second = (train.part(name).gear.base_radius for name in ("pinion", "gear"))
    m = train.build()
    inertia = np.array([m.bodies[name].inertia[2, 2] for name in ("in", "out")])
    lever = np.array([first, second])
    # stiffness and damping of the flanks that touch, from one entry each
    k, c = (-plant.A[2, column] * inertia[0] / first**2 for column in (0, 2))
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2:, :2] = -k * np.outer(lever, lever) / inertia[:, None]
    a[2:, 2:] = -c * np.outer(lever, lever) / inertia[:, None]
    np.testing.assert_allclose(plant.A, a, rtol=1e-6, atol=1e-9 * np.abs(a).max())
    assert plant.B[2, 0] == pytest.approx(1.0 / inertia[0], rel=1e-9)
    s = 300.0 + 9000.0j
    driven = (c * s + k) * lever
    dynamic = np.diag(inertia) * s**2 + np.outer(lever, driven)
    turned = np.linalg.solve(dynamic, np.array([[1.0, driven[0]], [0.0, driven[1]]]))
    exact = np.array([s * turned[1], turned[0], lever @ turned])
    np.testing.assert_allclose(plant.transfer(s), exact, rtol=1e-6)
    # slowly, too, where the square of the frequency is less than rounding of the flanks
    slow = np.array([1e-6, 1e-3, 0.1])
    turned = lever * inertia[::-1] / (lever**2 @ inertia[::-1])
    np.testing.assert_allclose(plant.frequency_response(slow)[:, 1, 1], turned[0], rtol=1e-6)
    polynomials = plant.transfer_function(("transmission_error", "stage"), "angle in")
    ratio = np.polyval(polynomials.num, 2j * np.pi * slow) / np.polyval(polynomials.den, 2j * np.pi * slow)
    np.testing.assert_allclose(ratio, turned[0], rtol=1e-6)
    # at rest a transmission error is what it says
    assert plant.dc_gain[2, 1] == pytest.approx(1.0, rel=1e-9)
    assert plant.output_units == ["rad/s", "rad", "m"]


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1, -1])
def test_torques_that_are_inputs_keep_their_names_under_load(sense):
    """The plant under 300 N m is that of a load of 300 N m; a load acts against the sense of rotation, a drive with."""
    turning = stage().changed("motor", speed=f"{1500 * sense} rpm")
    shown = ["tacho", ("angle", "in")]
    a, b, c, d = turning.linearize([("torque", "out"), ("torque", "in")], shown)
    train = turning.changed("brake", torque=make_input("braking", "N m", 300.0))
    train = train.changed("motor", torque=make_input("driving", "N m", 90.0))
    plant = train.linearize(["braking", "driving"], shown)
    # the driven shaft turns the other way round
    for found, exact in zip(plant, (a, sense * b, c, d), strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-6, atol=1e-9 * np.abs(exact).max(initial=1e-300))
    assert plant.point.inputs.tolist() == [300.0, 90.0]


@pytest.mark.slow
def test_poles_are_the_modes_of_the_drivetrain():
    train = stage("speed")
    plant, modes = train.linearize([], ["tacho"]), train_modes(train).eigenvalues
    assert plant.poles[plant.poles.imag > 0] == pytest.approx(modes[modes.imag > 0], rel=1e-9)


@pytest.mark.slow
def test_a_drivetrain_that_runs_is_linearised_where_it_is():
    train = stage("speed")
    m = train.build()
    solution = m.simulate(0.2, rate=20000, tol=1e-7, rate_scale=train.rate_scale)
    with pytest.warns(UserWarning, match=says("'stage'", "157.1 rad/s", "phase")) as said:
        plant = train.linearize([("motion", "motor", "rate")], ["tacho", ("speed", "in")], at=solution)
    assert {one.filename for one in said} == {__file__}
    assert plant.point.outputs == pytest.approx([solution.angular_velocity("out")[-1, 2], 50.0 * np.pi], rel=1e-6)
    # slowly the driven shaft follows by the ratio, the other way round
    low = plant.frequency_response(1.0)[0]
    assert low[1, 0] == pytest.approx(1.0, abs=1e-9)
    assert low[0, 0] == pytest.approx(-1.0 / 3.0, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("curve", [None, [1.0, 1.1, 1.2, 1.1]])
def test_teeth_that_run_are_told_and_a_mean_stiffness_is_steady(curve):
    """Of a stiffness that is constant the train turns freely: two poles at zero, exactly; else it has a phase."""
    train = stage().changed("stage", pair=IdealMesh, settings={"stiffness": "4e8 N/m", "stiffness_curve": curve})
    solution = train.build().simulate(0.02, rate=2000)
    with pytest.warns(UserWarning, match=says("'stage'", "phase")) if curve else warnings.catch_warnings():
        if not curve:
            warnings.simplefilter("error")
        plant = train.linearize([("torque", "in")], ["tacho"], at=solution)
    assert (np.sum(np.abs(plant.poles) < 1e-9) == 2) == (curve is None)


def test_names_that_are_none_are_told():
    with pytest.raises(ValueError, match=says("'inn'", "did you mean 'in'")):
        stage().linearize([], [("speed", "inn")], at="initial")


def mill(drive: Drive) -> Drivetrain:
    """Return two shafts and an elastic coupling between them, running at 100 rad/s."""
    return Drivetrain(
        "mill",
        shafts=[
            Shaft(name="motor shaft", radius="60 mm", length="300 mm"),
            Shaft(name="mill shaft", radius="90 mm", length="500 mm"),
        ],
        couplings=[
            ElasticClutch(name="coupling", first="motor shaft", second="mill shaft", stiffness=4000.0, damping=2.0)
        ],
        bearings=[IdealBearing(name="a", shaft="motor shaft"), IdealBearing(name="b", shaft="mill shaft")],
        drives=[drive],
        loads=[TorqueLoad(name="mill", shaft="mill shaft", torque="0 N m")],
        running=True,
    )


@pytest.mark.slow
def test_a_speed_loop_designed_on_the_plant_behaves_so_in_a_simulation():
    """PI by the gain at the crossing; the step of the closed linear loop against the drivetrain with its controller."""
    plant = mill(TorqueDrive(name="motor", shaft="motor shaft", speed=100.0)).linearize(
        [("torque", "motor shaft")], [("speed", "motor shaft"), ("speed", "mill shaft")]
    )
    crossing, corner = 8.0 * np.pi, 1.6 * np.pi
    loop = plant.frequency_response(4.0)[0, 0, 0] * (1 + corner / (1j * crossing))
    k_p = 1.0 / abs(loop)
    a, b, c, _ = plant
    closed = np.block([[a - k_p * b @ c[:1], k_p * corner * b], [-c[:1], np.zeros((1, 1))]])
    driven = np.vstack([k_p * b, [[1.0]]])
    t = np.linspace(0.0, 0.5, 101)
    system = StateSpace(closed, driven, np.pad(c, ((0, 0), (0, 1))), np.zeros((2, 1)))
    _, expected, _ = lsim(system, np.full(t.size, 5.0), t)
    drive = ControlledDrive(name="motor", shaft="motor shaft", speed=100.0, proportional=k_p, integral=k_p * corner,
                            largest=1e6, reference="105")  # fmt: skip
    solution = mill(drive).build().simulate(0.5, t_eval=t, tol=1e-9)
    found = [solution.angular_velocity(name)[:, 2] - 100.0 for name in ("motor shaft", "mill shaft")]
    assert np.transpose(found) == pytest.approx(expected, abs=1e-5)
    # a loop of 79 degrees of margin overshoots a little, by what its integral has gathered
    assert 5.3 < max(found[0]) < 5.8


def test_states_of_its_simulators():
    """As at the solution there, whatever sensors were asked; a sensor that was asked leaves the mechanism as it was."""
    train = stage("speed")
    m = train.build()
    sim = gm.Simulator(m, 0.02)
    sim.advance(0.01)
    told = sim.get("output", "tacho")
    state, asked = sim.state(), ([("torque", "out")], ["tacho", ("speed", "in")])
    plants = [train.linearize(*asked, at=at) for at in (state, sim.solution())]
    assert plants[0].point.outputs[0] == pytest.approx(told, rel=1e-9)
    for one, two in zip(*plants, strict=True):
        np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-9 * np.abs(two).max(initial=1e-300))
    assert m.simulate(0.011, initial=state).output("tacho")[0] == pytest.approx(told, rel=1e-9)
    gm.Simulator(m, 0.02).restore(state)
    m.bodies["in"].marker(name="later")
    with pytest.raises(ModelError, match=says("state", "markers", "take")):
        m.linearize(*asked, at=state)


def test_transmission_error_under_load_counts_from_before_it():
    """What a plant tells at rest under load is how far the teeth have given way, as in the static curve."""
    train = stage("speed")
    plant = train.linearize([("torque", "out")], [("transmission_error", "stage")])
    curve = loaded_transmission_error(train.pairs["stage"], torque=300.0, points=40).error
    assert curve.min() * (1.0 - 1e-3) < plant.point.outputs[0] < curve.max() * (1.0 + 1e-3)


def running(torque, load):
    """Return the stage at its speed, with its flanks on each other, under a drive's and a load's torque."""
    train = stage()
    motor = TorqueDrive(name="motor", shaft="in", speed="1500 rpm", torque=torque)
    brake = TorqueLoad(name="brake", shaft="out", torque=load)
    return train.of_same_bodies(drives=[motor], loads=[brake], running=True)


def drift(train: Drivetrain) -> float:
    """Return by how much the pinion is off its speed at the end of the run-up, as a part of it."""
    speed = train.build().simulate(train.run_up, rate=1000.0, tol=1e-6).angular_velocity("in")[:, 2]
    return float(abs(speed[-1] / speed[0] - 1.0))


@pytest.mark.slow
def test_a_running_train_whose_torques_do_not_begin_together_is_told_of():
    """A number comes on over the run-up, an input acts from the start; of one kind only flank friction slows it."""
    drive, brake = make_input("drive", "N m", 100.0), make_input("braking", "N m", 300.0)
    mixed = [(running(drive, 300.0), "brake", "300 N m"), (running(100.0, brake), "motor", "100 N m")]
    for train, late, size in mixed:
        with pytest.warns(UserWarning, match=says(f"'{late}'", size, "run_up", "make_input")):
            moved = drift(train)
        assert moved > 5.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert drift(running(drive, brake)) < 0.2
        assert drift(running(100.0, 300.0)) < 0.2
        # what is not there yet balances nothing
        running(make_input("later", "N m", 0.0), 300.0).build()
        stage().build()


def test_a_prescribed_speed_gives_the_ratio_at_rest():
    """What a mesh holds to a driven shaft follows it by the ratio of teeth; its angle grows without end."""
    train = stage("speed")
    plant = train.linearize(
        [("motion", "motor", "rate"), ("torque", "out"), ("transmission_error", "stage", "rate")],
        [("speed", "out"), ("angle", "out"), ("transmission_error", "stage")],
    )
    slow = plant.frequency_response(1e-4)[0].real
    gear = train.part("gear").gear.base_radius
    assert plant.dc_gain[0] == pytest.approx([-1.0 / 3.0, 0.0, 1.0 / gear], rel=1e-9, abs=1e-12)
    assert np.isinf(plant.dc_gain[1]).tolist() == [True, False, True]
    assert plant.dc_gain[1:, 1] == pytest.approx(slow[1:, 1], rel=1e-6)
    # a speed that both follow leaves no error of transmission; a rate of errors of flanks lets one grow
    assert plant.dc_gain[2, 0] == pytest.approx(0.0, abs=1e-12)
    assert np.isinf(plant.dc_gain[2, 2])


@pytest.fixture(scope="module")
def planets():
    """Return a set between two shafts that turns, driven at its carrier, as a mechanism, and its solution."""
    gears = planetary((21, 39, 99), "3 mm", 3, face_width="40 mm", wheels={"fillet_radius": "0.8 mm"})
    train = Drivetrain(
        "set",
        shafts=[
            Shaft(name="rotor", length="200 mm", diameter="80 mm"),
            Shaft(name="lay", length="200 mm", diameter="40 mm"),
        ],
        bearings=[IdealBearing(name=f"{name} b", shaft=name) for name in ("rotor", "lay")],
        planetary_stages=[
            PlanetaryStage(name="low", gears=gears, sun="lay", carrier="rotor", ring="ground", sun_station="40 mm",
                           pins=Support(radial="1e9 N/m", damping="2 us"))
        ],
        drives=[TorqueDrive(name="wind", shaft="rotor", speed="100 rpm", torque="400 N m")],
        loads=[TorqueLoad(name="gen", shaft="lay", torque="70 N m")],
        running=True,
    )  # fmt: skip
    m = train.build()
    sim = gm.Simulator(m, 1.0, tol=1e-8, rate_scale=train.rate_scale)
    for t in (0.0, 0.01, 0.02):
        sim.advance(t)
    return m, sim


@pytest.mark.slow
def test_turns_of_planets_in_mesh_count_from_their_carrier(planets):
    """r_bs (phi_s - phi_c) + r_bp (phi_p - phi_c) are micrometres, where absolute angles leave the carrier's turn."""
    m, sim = planets
    name, ring = "low sun-planet 1", "low planet 1-ring"
    m.output("error", ("transmission_error", name))
    one, two = (getattr(m.elements[name].pair, which).base_radius for which in ("driver", "driven"))
    solution = sim.solution()
    sun, carrier = solution.joint_angle("lay b"), solution.joint_angle("rotor b")
    start, now = (solution.orientation("low planet 1")[k] for k in (0, -1))
    planet = np.arctan2((now @ start.T)[1, 0], (now @ start.T)[0, 0])
    # the planet rolls backwards on the ring: within a turn here
    expected = one * (sun - carrier)[-1] + two * (planet - carrier[-1])
    expected -= 2 * np.pi * two * np.round(expected / (2 * np.pi * two))
    assert abs(expected) < 20e-6
    assert carrier[-1] > 0.1
    assert sim.get("transmission_error", name) == pytest.approx(expected, abs=1e-11)
    assert solution.output("error")[-1] == pytest.approx(expected, abs=1e-11)
    assert abs(sim.get("transmission_error", ring)) < 20e-6
    with warnings.catch_warnings():
        # teeth that run
        warnings.simplefilter("ignore")
        plant = m.linearize([("torque", "lay b")], ["error", ("joint_angle", "rotor b")], at=sim.state())
    assert plant.point.outputs[0] == pytest.approx(expected, abs=1e-11)
    slow = plant.frequency_response(1e-3)[0, :, 0]
    assert abs(slow[0] / slow[1]) < 1e-2 * (one + two)


@pytest.mark.slow
def test_carried_axes_whose_carrier_is_not_named_are_refused(planets):
    m, sim = planets
    known = dict(m.carriers)
    try:
        m.carriers.clear()
        with pytest.raises(ModelError, match=says("low sun-planet 1", "gear_contact", "carrier")):
            sim.get("transmission_error", "low sun-planet 1")
    finally:
        m.carriers.update(known)
    assert abs(sim.get("transmission_error", "low sun-planet 1")) < 20e-6
