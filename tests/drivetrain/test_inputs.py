"""Inputs of drivetrains, made before there is a mechanism: set in simulations, inputs of plants, variables of decks."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import (
    ControlledDrive,
    Drivetrain,
    DrivetrainError,
    ElasticClutch,
    IdealBearing,
    Shaft,
    SpeedDrive,
    TorqueDrive,
    TorqueLoad,
)
from gearmbs.gears import IdealMesh
from gearmbs.mechanism import make_input
from tests.drivetrain.support import stage
from tests.says import says

STIFFNESS, DAMPING = 4000.0, 2.0


def mill(drive, load=0.0):
    """Two shafts and a clutch between them."""
    return Drivetrain(
        "mill",
        shafts=[
            Shaft(name="motor shaft", radius="60 mm", length="300 mm"),
            Shaft(name="mill shaft", radius="90 mm", length="500 mm"),
        ],
        couplings=[
            ElasticClutch(
                name="coupling", first="motor shaft", second="mill shaft", stiffness=STIFFNESS, damping=DAMPING
            )
        ],
        bearings=[IdealBearing(name="a", shaft="motor shaft"), IdealBearing(name="b", shaft="mill shaft")],
        drives=[drive],
        loads=[TorqueLoad(name="mill", shaft="mill shaft", torque=load)],
        running=True,
    )


def inertias(m):
    return [float(m.bodies[name].inertia[2, 2]) for name in ("motor shaft", "mill shaft")]


def test_two_shafts_on_a_clutch_are_two_masses_on_a_spring():
    """A drivetrain's plant against its closed form: x = (phi_1, phi_2, omega_1, omega_2), to 1e-9."""
    train = mill(SpeedDrive(name="motor", shaft="motor shaft", speed="100 rad/s"))
    free = train.of_same_bodies(drives=[ControlledDrive(
        name="motor", shaft="motor shaft", speed="100 rad/s", proportional=1e-9, integral=1e-9, largest=1.0
    )])  # fmt: skip
    plant = free.linearize(
        [("torque", "motor shaft"), ("torque", "mill shaft")],
        [("speed", "motor shaft"), ("angle", "mill shaft"), ("speed", "mill shaft")],
    )
    j = np.array(inertias(free.build()))
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    spread = np.array([[-1.0, 1.0], [1.0, -1.0]])
    a[2:, :2], a[2:, 2:] = STIFFNESS * spread / j[:, None], DAMPING * spread / j[:, None]
    np.testing.assert_allclose(plant.A, a, rtol=1e-9, atol=1e-9 * np.abs(a).max())
    np.testing.assert_allclose(plant.B[2:], np.diag(1.0 / j), rtol=1e-9, atol=1e-12)
    for f in (0.5, 7.0, 90.0):
        s = 2j * np.pi * f
        coupling = STIFFNESS + DAMPING * s
        x = np.linalg.inv(np.diag(j) * s**2 - coupling * spread)
        exact = np.array([s * x[0], x[1], s * x[1]])
        np.testing.assert_allclose(plant.frequency_response(f)[0], exact, rtol=1e-9)


def controlled(k_p=60.0, k_i=300.0):
    return mill(ControlledDrive(
        name="motor", shaft="motor shaft", speed="100 rad/s", proportional=k_p, integral=k_i, largest="1 MN m",
        reference=make_input("wanted", "rad/s", 100.0),
    ))  # fmt: skip


def test_the_speed_that_a_controlled_drive_is_asked_for_is_an_input_of_its_plant():
    """T = k_p (w - omega_1) + k_i int (w - omega_1): at the start, at a state, of the train and of its mechanism."""
    train = controlled()
    m = train.build()
    assert list(m.inputs) == ["wanted"]
    sim = gm.Simulator(m, 1.0)
    sim.advance(0.1)
    state = sim.state()
    j, f = np.array(inertias(m)), 3.0
    s = 2j * np.pi * f
    coupling, control = STIFFNESS + DAMPING * s, 60.0 + 300.0 / s
    matrix = np.diag(j) * s**2 + coupling * np.array([[1.0, -1.0], [-1.0, 1.0]]) + np.diag([control * s, 0.0])
    exact = s * np.linalg.solve(matrix, [control, 0.0])
    shown = [("angular_velocity", name, "z") for name in ("motor shaft", "mill shaft")]
    for found in (
        train.linearize(["wanted"], shown, at="initial"),
        train.linearize(["wanted"], shown, at=state),
        m.linearize(["wanted"], shown, at=state),
    ):
        np.testing.assert_allclose(found.frequency_response(f)[0, :, 0], exact, rtol=1e-6)
        assert found.point.inputs == pytest.approx([100.0])
    with pytest.raises(DrivetrainError, match=says("'wanted'", "'motor'", "at='initial'")):
        train.linearize(["wanted"], shown)
    sim.set("wanted", 110.0)
    sim.advance(0.9)
    assert sim.get("angular_velocity", "motor shaft")[2] == pytest.approx(110.0, rel=1e-2)


def test_inputs_of_drives_are_variables_of_decks():
    from gearmbs.adams import build_mechanism, parse_deck

    again = build_mechanism(parse_deck(gm.write_deck(controlled().build())))
    assert list(again.inputs) == ["wanted"]


def test_a_prescribed_speed_is_an_input():
    """It jumps with all that it drives, has a controller, is an input of the plant, and what is wrong is said."""
    wanted = make_input("speed", "rad/s", 100.0)
    train = mill(SpeedDrive(name="motor", shaft="motor shaft", speed="100 rad/s", reference=wanted))
    m = train.build()
    sim = gm.Simulator(m, 1.0)
    sim.advance(0.1)
    assert sim.get("angular_velocity", "motor shaft")[2] == pytest.approx(100.0, rel=1e-9)
    sim.set("speed", 120.0)
    sim.advance(0.2)
    assert sim.get("angular_velocity", "motor shaft")[2] == pytest.approx(120.0, rel=1e-9)
    assert sim.get("joint_angle", "a") == pytest.approx(10.0 + 12.0, rel=1e-6)
    sim.control("speed", lambda t, s: 120.0 - 10.0 * (t > 0.25), sample_time=0.1)
    sim.advance(0.4)
    assert sim.get("angular_velocity", "motor shaft")[2] == pytest.approx(110.0, rel=1e-9)
    plant = train.linearize(["speed"], [("speed", "motor shaft")], at=sim.state())
    assert plant.frequency_response(5.0)[0, 0, 0] == pytest.approx(1.0, rel=1e-9)
    led = mill(SpeedDrive(name="motor", shaft="motor shaft", speed="100 rad/s", reference="100 + 20*TIME"))
    assert led.build().simulate(0.5).angular_velocity("motor shaft")[-1, 2] == pytest.approx(110.0, rel=1e-9)
    for more, words in (
        ({"reference": make_input("t", "N m")}, says("'motor'", "'t'", "rad/s")),
        ({"reference": wanted, "curve": [(0, 100.0), (1, 50.0)]}, says("'motor'", "reference", "curve")),
    ):
        with pytest.raises((DrivetrainError, gm.mechanism.ModelError), match=words):
            mill(SpeedDrive(name="motor", shaft="motor shaft", speed="100 rad/s", **more)).build()


def test_an_ideal_mesh_has_the_damping_that_is_given():
    def settings(**given):
        return stage().changed("mesh", pair=IdealMesh, settings={"stiffness": "2e8 N/m", **given})

    mesh = settings(damping="800 N s/m").pairs["mesh"]
    assert (mesh.stiffness, mesh.damping) == (2e8, 800.0)
    assert stage().changed("mesh", pair=IdealMesh, settings={"damping": 500.0}).pairs["mesh"].damping == 500.0
    with pytest.raises(DrivetrainError, match=says("'mesh'", "damping_ratio", "800 N s/m")):
        settings(damping="800 N s/m", damping_ratio=0.1).pairs  # noqa: B018
    with pytest.raises(DrivetrainError, match=says("'mesh'", "damping_ratio", "IdealMesh")):
        stage().changed("mesh", settings={"damping": 800.0}).pairs  # noqa: B018


def test_a_deck_is_written_of_what_a_drivetrain_builds():
    with pytest.raises(gm.mechanism.ModelError, match=says("Drivetrain", "build()")):
        gm.write_deck(stage())


@pytest.mark.slow
def test_a_simulated_sweep_is_the_frequency_response():
    """A torque that goes along lines from 1 to 80 Hz, with its run-out: spectra over spectra, to 0.3 %."""
    driven = TorqueDrive(name="motor", shaft="motor shaft", speed="100 rad/s", torque=make_input("torque", "N m"))
    m = mill(driven).build()
    for name in ("a", "b"):
        pin = m.joints[name]
        m.axis_torque(f"drag {name}", pin.i, pin.j, f"-30*(WZ({name}.I, {name}.J) - 100)")
    m.output("speed", ("angular_velocity", "mill shaft", "z"))
    step, count = 2.5e-4, 7000
    t = step * np.arange(count + 1)
    torque = 20.0 * np.sin(2.0 * np.pi * (t + 0.5 * (80.0 - 1.0) / 1.0 * t**2)) * (t < 1.0)
    sim = gm.Simulator(m, t[-1], tol=1e-8)
    speed = [sim.get("output", "speed")]
    for k in range(count):
        sim.set("torque", float(torque[k + 1]), hold=1)
        sim.advance(float(t[k + 1]))
        speed.append(sim.get("output", "speed"))
    f = np.fft.rfftfreq(count + 1, step)
    found = np.fft.rfft(np.array(speed) - 100.0) / np.fft.rfft(torque)
    asked = (f > 2.0) & (f < 70.0)
    exact = m.linearize(["torque"], ["speed"]).frequency_response(f[asked])[:, 0, 0]
    assert np.abs(found[asked] / exact - 1.0).max() < 3e-3
