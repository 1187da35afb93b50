"""Linear plants against closed forms, eigenvalues and simulations."""

from __future__ import annotations

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.dae.analyses.plant import LinearPlant
from gearmbs.dae.problem import ModelError
from tests.says import says

MOTOR, LOAD, STIFFNESS, DAMPING = 0.4, 1.7, 850.0, 3.0
GRAVITY = 9.81


def two_masses() -> gm.Mechanism:
    """Return two inertias on a shaft, each in its bearing."""
    m = gm.Mechanism("two masses")
    motor = m.body("motor", 2.0, (0.3, 0.3, MOTOR))
    load = m.body("load", 3.0, (1.0, 1.0, LOAD), position=(0, 0, 0.3))
    m.revolute("motor bearing", motor, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.revolute("load bearing", load, m.ground, at=(0, 0, 0.3), axis=(0, 0, 1))
    ends = load.marker(name="shaft.I"), motor.marker((0, 0, 0.3), name="shaft.J")
    m.torsion_spring("shaft", *ends, stiffness=STIFFNESS, damping=DAMPING)
    return m


def test_two_masses_have_the_matrices_of_their_equations():
    """x = (phi_1, phi_2, omega_1, omega_2), J omega' = +-(k (phi_2 - phi_1) + c (omega_2 - omega_1)) + T."""
    outputs = [
        ("joint_angle", "load bearing"), ("joint_rate", "motor bearing"), ("angular_acceleration", "load", "z"),
        ("load", "shaft", "tz"), "WDTZ(shaft.I, shaft.J) + 2*WZ(shaft.I)",
    ]  # fmt: skip
    plant = two_masses().linearize([("torque", "motor bearing"), ("torque", "load", "z")], outputs)
    k, c = STIFFNESS, DAMPING
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2] = np.array([-k, k, -c, c]) / MOTOR
    a[3] = np.array([k, -k, c, -c]) / LOAD
    b = np.zeros((4, 2))
    b[2, 0], b[3, 1] = 1.0 / MOTOR, 1.0 / LOAD
    shown = np.array([[0, 1, 0, 0], [0, 0, 1, 0], a[3], [k, -k, c, -c], a[3] - a[2] + [0, 0, 0, 2]])
    direct = np.array([[0, 0], [0, 0], b[3], [0, 0], b[3] - b[2]])
    for found, exact in zip(plant, (a, b, shown, direct), strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-12 * k / MOTOR)
    assert plant.states == ["motor: rotation about z", "load: rotation about z", "motor: rotation about z, rate",
                            "load: rotation about z, rate"]  # fmt: skip
    assert plant.input_units == ["N m", "N m"]
    assert plant.output_units == ["rad", "rad/s", "rad/s^2", "N m", ""]


def test_the_transfer_function_of_two_masses():
    """omega_1 / T = (J_2 s^2 + c s + k) / (s (J_1 J_2 s^2 + (J_1 + J_2)(c s + k)))."""
    plant = two_masses().linearize(
        [("torque", "motor bearing")], [("joint_rate", "motor bearing"), ("load", "shaft", "tz")]
    )
    f = np.array([0.1, 3.0, 8.0, 200.0])
    s = 2j * np.pi * f
    exact = (LOAD * s**2 + DAMPING * s + STIFFNESS) / (
        s * (MOTOR * LOAD * s**2 + (MOTOR + LOAD) * (DAMPING * s + STIFFNESS))
    )
    np.testing.assert_allclose(plant.frequency_response(f)[:, 0, 0], exact, rtol=1e-9)
    np.testing.assert_allclose([plant.transfer(one)[0, 0] for one in s], exact, rtol=1e-9)
    polynomials = plant.transfer_function("torque motor bearing", "joint_rate motor bearing")
    found = np.polyval(polynomials.num, s) / np.polyval(polynomials.den, s)
    np.testing.assert_allclose(found, exact, rtol=1e-6)
    # a constant torque turns both ever faster; the shaft carries the share of the load's inertia
    assert plant.dc_gain[:, 0] == pytest.approx([np.inf, LOAD / (MOTOR + LOAD)], rel=1e-9)


def test_a_plant_is_what_control_programs_take():
    from scipy.signal import StateSpace, lsim

    plant = two_masses().linearize([("torque", "motor bearing")], [("load", "shaft", "tz")])
    t = np.linspace(0.0, 0.2, 401)
    _, answer, _ = lsim(StateSpace(*plant), np.ones_like(t), t)
    assert answer == pytest.approx(plant.step(t)[:, 0], abs=1e-9)


def test_python_control_takes_plants():
    control = pytest.importorskip("control")
    plant = two_masses().linearize([("torque", "motor bearing")], [("load", "shaft", "tz")])
    system, f = control.ss(*plant), np.array([0.5, 3.0, 40.0])
    assert system.nstates == len(plant.states)
    answer = system(2j * np.pi * f)
    np.testing.assert_allclose(np.ravel(answer), plant.frequency_response(f)[:, 0, 0], rtol=1e-9)


def test_outputs_may_share_the_acceleration_of_a_marker():
    """A free body, whatever outputs stand beside each other: m a = F."""
    m = gm.Mechanism("free")
    m.body("b", 2.0, (0.1, 0.1, 0.1))
    outputs = [("com_acceleration", "b"), ("com_acceleration", "b", "x")]
    plant = m.linearize([("force", "b", axis) for axis in "xyz"], outputs)
    assert plant.D == pytest.approx(0.5 * np.eye(3)[[0, 1, 2, 0]], abs=1e-12)


def pendulum(angle: float = 0.0) -> gm.Mechanism:
    m = gm.Mechanism("pendulum", gravity=(0, 0, -GRAVITY))
    turned = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    rod = m.body("rod", 2.0, (0.1, 0.1, 0.02), position=turned @ (0, 0, -0.4), orientation=turned)
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    return m


def test_a_pendulum_held_aslant_by_its_torque():
    """(I + m l^2) phi'' + m g l sin phi = T about the angle at which T balances the weight."""
    angle = 0.6
    m = pendulum(angle)
    rod, inertia = m.bodies["rod"], 0.1 + 2.0 * 0.4**2
    # about y a positive turn lifts the rod to negative x
    holding = 2.0 * GRAVITY * 0.4 * np.sin(angle)
    m.torque("hold", rod, holding, axis=(0, 1, 0))
    plant = m.linearize([("torque", "pin"), ("force", "rod", "x")], [("joint_angle", "pin"), ("reaction", "pin", "fz")])
    assert plant.A[1] == pytest.approx([-2.0 * GRAVITY * 0.4 * np.cos(angle) / inertia, 0.0], rel=1e-9)
    assert plant.B[1] == pytest.approx([1.0 / inertia, -0.4 * np.cos(angle) / inertia], rel=1e-9)
    # the bearing carries m (z'' + g), z = -l cos phi
    rise = 2.0 * 0.4 * np.sin(angle)
    assert plant.C == pytest.approx(np.array([[1.0, 0.0], rise * plant.A[1]]), rel=1e-9)
    assert plant.D[1] == pytest.approx(rise * plant.B[1], rel=1e-9)
    assert plant.point.outputs == pytest.approx([0.0, 2.0 * GRAVITY], abs=1e-9)


CRANK, ROD, CRANK_INERTIA, SLIDER = 0.1, 0.35, 0.02, 1.5


def slider_crank(angle: float, speed: float = 0.0) -> gm.Mechanism:
    """Return a crank about z, a rod without mass (a fixed distance), and a slider along x that a spring holds."""
    m = gm.Mechanism("slider crank")
    c, s = np.cos(angle), np.sin(angle)
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    crank = m.body("crank", 1.0, (0.01, 0.01, CRANK_INERTIA), orientation=turned, angular_velocity=(0, 0, speed))
    place, rate = _slide(angle)
    slider = m.body("slider", SLIDER, (0.01, 0.01, 0.01), position=(place, 0, 0), velocity=(rate * speed, 0, 0))
    m.revolute("main", crank, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.translational("guide", slider, m.ground, at=(place, 0, 0), axis=(1, 0, 0))
    m.distance("rod", crank.marker((CRANK, 0, 0), name="pin"), slider.marker(name="wrist"), ROD)
    return m


def _slide(angle):
    """Return x = r cos a + sqrt(l^2 - r^2 sin^2 a) and dx/da."""
    root = np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
    return CRANK * np.cos(angle) + root, -CRANK * np.sin(angle) - CRANK**2 * np.sin(angle) * np.cos(angle) / root


def _crank_acceleration(angle: float, speed: float, torque: float, force: float) -> float:
    """Return a'' of I(a) a'' + I'(a) a'^2/2 = T + F x', I = J + m x'^2, derivatives by complex steps."""
    h = 1e-30
    first, second = _slide(angle)[1], np.imag(_slide(angle + 1j * h)[1]) / h
    inertia = CRANK_INERTIA + SLIDER * first**2
    return (torque + force * first - SLIDER * first * second * speed**2) / inertia


def test_a_slider_crank_at_rest_under_forces_in_balance():
    angle, force = 0.9, -120.0
    slope = _slide(angle)[1]
    m = slider_crank(angle)
    m.torque("brake", m.bodies["crank"], -force * slope)
    m.load("gas", m.bodies["slider"].marker(name="gas.I"), m.ground.marker(name="gas.J"), fx=force)
    plant = m.linearize(
        [("torque", "main"), ("force", "slider", "x")],
        ["AZ(main.I, main.J)", ("com_velocity", "slider", "x"), ("com_acceleration", "slider", "x")],
    )
    h = 1e-5
    by_angle = (_crank_acceleration(angle + h, 0, -force * slope, force) - _crank_acceleration(
        angle - h, 0, -force * slope, force)) / (2 * h)  # fmt: skip
    inertia = CRANK_INERTIA + SLIDER * slope**2
    # whatever its coordinate, its poles are the crank's
    assert np.sort_complex(plant.poles) == pytest.approx(np.sort_complex(np.roots([1.0, 0.0, -by_angle])), rel=1e-7)
    s = 2.0 + 9.0j
    turned = np.array([1.0, slope]) / (inertia * (s**2 - by_angle))
    exact = np.array([turned, turned * slope * s, turned * slope * s**2])
    assert plant.transfer(s) == pytest.approx(exact, rel=1e-7)


def test_a_prescribed_displacement_moves_a_mass_on_a_spring():
    """m x'' + c (x' - u') + k (x - u) = 0; the force on the motion is -c (x' - u') - k (x - u) + M u''."""
    mass, base, k, c = 2.0, 0.7, 300.0, 5.0
    m = gm.Mechanism("shaker")
    table = m.body("table", base, (1, 1, 1))
    rider = m.body("rider", mass, (1, 1, 1), position=(0.5, 0, 0))
    guide = m.translational("guide", table, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.translational("slide", rider, m.ground, at=(0.5, 0, 0), axis=(1, 0, 0))
    m.spring_damper("spring", rider.marker(name="s.I"), table.marker(name="s.J"), stiffness=k, damping=c)
    m.translation("shake", guide, 0.0)
    shown = [("com_position", "rider", "x"), ("com_velocity", "rider", "x"), ("com_acceleration", "rider", "x"),
             ("reaction", "shake", "fx")]  # fmt: skip
    s = 3.0 + 11.0j
    ratio = (c * s + k) / (mass * s**2 + c * s + k)
    exact = np.array([ratio, s * ratio, s**2 * ratio, base * s**2 + mass * s**2 * ratio])
    by_acceleration = m.linearize([("motion", "shake", "acceleration")], shown)
    assert by_acceleration.transfer(s)[:, 0] == pytest.approx(exact / s**2, rel=1e-9)
    assert by_acceleration.states[-2:] == ["motion shake acceleration (position)", "motion shake acceleration (rate)"]
    by_rate = m.linearize([("motion", "shake", "rate")], shown[:3])
    assert by_rate.transfer(s)[:, 0] == pytest.approx(exact[:3] / s, rel=1e-9)
    by_place = m.linearize([("motion", "shake")], shown[:2])
    assert by_place.transfer(s)[:, 0] == pytest.approx(exact[:2], rel=1e-9)
    assert len(by_place.A) == 2
    poles = np.sort_complex(np.roots([mass, c, k]))
    for plant in (by_place, by_rate, by_acceleration):
        moving = plant.poles[np.abs(plant.poles) > 1e-6]
        assert np.sort_complex(moving) == pytest.approx(poles, rel=1e-9)
    assert by_rate.input_units == ["m/s"]
    with pytest.raises(ModelError, match=says("reaction shake fx", "motion shake rate", "'acceleration'")):
        m.linearize([("motion", "shake", "rate")], shown)
    with pytest.raises(ModelError, match=says("com_acceleration rider x", "motion shake", "'rate' or 'acceleration'")):
        m.linearize([("motion", "shake")], shown[:3])


def test_a_prescribed_rotation_drives_a_rotor_through_a_shaft():
    m = two_masses()
    m.rotation("drive", m.joints["motor bearing"], "20*TIME", level="displacement")
    m.bodies["motor"].angular_velocity = m.bodies["load"].angular_velocity = np.array([0, 0, 20.0])
    plant = m.linearize([("motion", "drive", "rate")], [("joint_rate", "load bearing"), ("load", "shaft", "tz")])
    s = 4.0 + 30.0j
    over = LOAD * s**2 + DAMPING * s + STIFFNESS
    carried = (DAMPING * s + STIFFNESS) * LOAD * s**2 / over / s
    exact = [(DAMPING * s + STIFFNESS) / over, carried]
    assert plant.transfer(s)[:, 0] == pytest.approx(exact, rel=1e-9)


def test_poles_are_the_eigenvalues_of_the_linear_modes():
    m = pendulum()
    arm = m.body("arm", 0.8, (0.02, 0.02, 0.005), position=(0, 0, -1.0))
    m.revolute("elbow", arm, m.bodies["rod"], at=(0, 0, -0.8), axis=(0, 1, 0))
    m.torsion_spring("stiff", arm.marker((0, 0, 0.2), name="e.I"), m.bodies["rod"].marker((0, 0, -0.4), name="e.J"),
                     stiffness=2.0, damping=0.1)  # fmt: skip
    plant = m.linearize([("torque", "elbow")], [("joint_angle", "elbow")])
    modes = m.linear_modes().eigenvalues
    both = np.concatenate([modes, modes[modes.imag > 0].conj()])
    # real parts of undamped ones are rounding, and order nothing
    by_speed = [poles[np.argsort(poles.imag)] for poles in (plant.poles, both)]
    assert by_speed[0] == pytest.approx(by_speed[1], rel=1e-9)


def test_a_spinning_rotor_on_springs_whirls():
    """J p'' -+ i C w p' + k p = 0 in the plane of complex tilts: forward and backward whirl, in axes at rest."""
    polar, transverse, k, speed = 0.5, 0.3, 4000.0, 60.0
    m = gm.Mechanism("rotor")
    disc = m.body("disc", 5.0, (transverse, transverse, polar), angular_velocity=(0, 0, speed))
    m.spherical("centre", disc, m.ground, at=(0, 0, 0))
    top = disc.marker((0, 0, 1.0), name="top")
    m.load("springs", top, m.ground.marker(name="springs.J"), fx=f"-{k}*DX(top)", fy=f"-{k}*DY(top)")
    plant = m.linearize(
        [("torque", "disc", "x")], [("angular_velocity", "disc", "x"), ("angular_velocity", "disc", "y")]
    )
    whirl = np.roots([transverse, -1j * polar * speed, k])
    found = np.sort(plant.poles.imag[plant.poles.imag > 1e-3])
    assert found == pytest.approx(np.sort(np.abs(whirl.imag)), rel=1e-9)
    # with p = phi_x + i phi_y, J p'' - i C w p' + k p = T; omega = (phi_x' + w phi_y, phi_y' - w phi_x) in axes at rest
    s = 1.0 + 40.0j
    forward = 1.0 / (transverse * s**2 - 1j * polar * speed * s + k)
    backward = 1.0 / (transverse * s**2 + 1j * polar * speed * s + k)
    tilted = 0.5 * (forward + backward), -0.5j * (forward - backward)
    exact = [s * tilted[0] + speed * tilted[1], s * tilted[1] - speed * tilted[0]]
    assert plant.transfer(s)[:, 0] == pytest.approx(exact, rel=1e-9)


@pytest.mark.slow
def test_a_state_of_a_simulation_is_an_operating_point():
    m = two_masses()
    m.torque("push", m.bodies["motor"], 5.0)
    m.load("wind", m.bodies["load"].marker(name="w.I"), m.ground.marker(name="w.J"), tz="-0.02*WZ(w.I)*ABS(WZ(w.I))")
    solution = m.simulate(2.0, tol=1e-9, t_eval=np.linspace(0, 2, 401))
    plant = m.linearize([("torque", "motor bearing")], [("joint_rate", "load bearing")], at=solution)
    speed = solution.angular_velocity("load")[-1, 2]
    assert plant.point.t == 2.0
    assert plant.point.outputs == pytest.approx([speed], rel=1e-9)
    assert plant.A[3, 3] == pytest.approx(-(DAMPING + 0.04 * speed) / LOAD, rel=1e-8)
    again = m.linearize([("torque", "motor bearing")], [("joint_rate", "load bearing")], at=solution.state_at(2.0))
    for one, two in zip(plant, again, strict=True):
        np.testing.assert_array_equal(one, two)
    assert again.point.state is not None


@pytest.mark.parametrize(
    ("inputs", "outputs", "options", "message"),
    [
        ([("torqe", "motor bearing")], [], {}, says("torqe", "did you mean 'torque'")),
        ([("torque", "moter bearing")], [], {}, says("moter bearing", "did you mean 'motor bearing'")),
        ([("torque", "motor")], [], {}, says("motor", "axis", "'x'")),
        ([("torque", "motor", "w")], [], {}, says("'w'", "'x', 'y' or 'z'")),
        ([("torque", "motor bearing", "z")], [], {}, says("motor bearing", "leave 'z'")),
        ([("motion", "motor bearing")], [], {}, says("motor bearing", "revolute", "none")),
        (["torque"], [], {}, says("'torque'", "tuple")),
        ([], [("joint_angle", "shaft")], {}, says("'shaft'", "motor bearing")),
        ([], [("joint_displacement", "load bearing")], {}, says("load bearing", "revolute", "translational")),
        ([], [("com_velocity", "lod", "x")], {}, says("'lod'", "did you mean 'load'")),
        ([], [("reaction", "load bearing", "mx")], {}, says("'mx'", "'fx'", "'tz'")),
        ([], [("load", "spring")], {}, says("'spring'", "shaft")),
        ([], [("state", "heat")], {}, says("'heat'", "none")),
        ([], ["WZ(motr.I)"], {}, says("MOTR.I", "WZ")),
        ([], ["WZ(shaft.I"], {}, says("WZ(shaft.I", "column")),
        ([], ["2*ACCX(shft.I)"], {}, says("2*ACCX(shft.I)", "SHFT.I", "did you mean SHAFT.I")),
        ([], ["WDTY(shaft.I, 0, load)"], {}, says("WDTY", "MARKER LOAD")),
        ([], ["ACCM()"], {}, says("ACCM", "1 to 3")),
        ([], ["ACCX(2*3)"], {}, says("2*3", "id or name")),
        ([], [("transmission_error", "shaft")], {}, says("'shaft'", "none")),
        ([], ["1"], {"at": "rest"}, says("'rest'", "'equilibrium'")),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_in_one_line(inputs, outputs, options, message):
    m = two_masses()
    markers = [one.name for body in m.bodies.values() for one in body.markers]
    with pytest.raises(ModelError, match=message) as told:
        m.linearize(inputs, outputs, **options)
    assert "\n" not in str(told.value)
    assert [one.name for body in m.bodies.values() for one in body.markers] == markers


def test_accelerations_of_the_ground_and_from_it_are_outputs():
    m = two_masses()
    m.ground.marker(name="wall")
    shown = ["WDTZ(shaft.I)", "WDTZ(shaft.I, 0, 0)", 'WDTZ("shaft.i", wall, wall)', "WDTZ(wall)", "WDTZ(0, shaft.I)"]
    plant = m.linearize([("torque", "load", "z")], shown)
    assert plant.D[:, 0] == pytest.approx(np.array([1, 1, 1, 0, -1]) / LOAD, rel=1e-9)


def test_inputs_of_the_mechanism_by_their_names():
    """A torque that an expression makes of an input, exactly as its derivative by it, at the value it has."""
    m = two_masses()
    m.input("current", "1", 3.0)
    m.torque("motor", m.bodies["motor"], m.input("pull", "N m", 2.0))
    m.load("coil", m.bodies["motor"].marker(name="c.I"), m.ground.marker(name="c.J"), tz="0.5*current**2 - 0.1*WZ(c.I)")
    plant = m.linearize(["current", "pull"], [("joint_rate", "load bearing")])
    assert plant.B[2] == pytest.approx([3.0 / MOTOR, 1.0 / MOTOR], rel=1e-9)
    assert plant.A[2, 2] == pytest.approx(-(DAMPING + 0.1) / MOTOR, rel=1e-9)
    assert plant.point.inputs.tolist() == [3.0, 2.0]
    assert plant.input_units == ["dimensionless", "N m"]
    with pytest.raises(ModelError, match=says("'curent'", "did you mean 'current'")):
        m.linearize(["curent"], [])


def test_outputs_take_inputs_and_parameters_as_they_are_at_the_operating_point():
    m = two_masses()
    m.torque("motor", m.bodies["motor"], m.input("pull", "N m", 1.0))
    m.parameter("drag", "N m s/rad", 0.3)
    simulator = gm.Simulator(m, 1.0)
    simulator.set("pull", 2.0)
    simulator.set("drag", 0.7)
    simulator.advance(0.1)
    state, outputs = simulator.state(), ["pull", "pull*WZ(shaft.J)", "drag*WZ(shaft.J)"]
    plant = m.linearize(["pull"], outputs, at=state)
    speed = simulator.get("angular_velocity", "motor")[2]
    assert plant.point.outputs == pytest.approx([2.0, 2.0 * speed, 0.7 * speed], rel=1e-9)
    assert plant.C[:, 2] == pytest.approx([0.0, 2.0, 0.7], rel=1e-9)
    assert plant.D[:, 0] == pytest.approx([1.0, speed, 0.0], rel=1e-9)
    assert plant.point.inputs.tolist() == [2.0]


def test_outputs_of_the_mechanism_by_their_names():
    m = two_masses()
    turned = m.output("twist", "AZ(shaft.I, shaft.J)")
    m.output("speed", ("angular_velocity", "load", "z"))
    named = m.linearize([("torque", "motor bearing")], [turned, "speed"])
    asked = m.linearize([("torque", "motor bearing")], ["AZ(shaft.I, shaft.J)", ("angular_velocity", "load", "z")])
    assert named.outputs == ["twist", "speed"]
    assert named.output_units == asked.output_units
    np.testing.assert_array_equal(named.C, asked.C)
    with pytest.raises(ModelError, match=says("sped", "speed")):
        m.linearize([("torque", "motor bearing")], ["sped"])


def test_an_input_that_is_the_speed_of_a_motion():
    m = two_masses()
    m.rotation("drive", m.joints["motor bearing"], m.input("speed", "rad/s", 20.0), level="velocity")
    for body in m.bodies.values():
        body.angular_velocity = np.array([0, 0, 20.0])
    plant = m.linearize(["speed"], [("joint_rate", "load bearing"), ("load", "shaft", "tz")])
    s = 4.0 + 30.0j
    over = LOAD * s**2 + DAMPING * s + STIFFNESS
    exact = [(DAMPING * s + STIFFNESS) / over, (DAMPING * s + STIFFNESS) * LOAD * s / over]
    assert plant.transfer(s)[:, 0] == pytest.approx(exact, rel=1e-9)
    with pytest.raises(ModelError, match=says("reaction drive tz", "'speed'", "level='acceleration'", "'drive'")):
        m.linearize(["speed"], [("reaction", "drive", "tz")])


def _held() -> gm.Mechanism:
    """Return two masses on springs and dampers to the ground, so that transients die away."""
    m = two_masses()
    for name in ("motor", "load"):
        i, j = m.joints[f"{name} bearing"].i, m.joints[f"{name} bearing"].j
        m.torsion_spring(f"{name} spring", i, j, stiffness=40.0, damping=4.0)
    return m


def test_the_frequency_response_is_what_sines_leave_behind():
    """Amplitude and phase after the transients, at three frequencies about the resonance; of small swings."""
    plant = _held().linearize([("torque", "motor bearing")], [("joint_angle", "load bearing")])
    for f in (0.6, 4.0, 9.0):
        m = _held()
        m.torque("shake", m.bodies["motor"], f"0.2*SIN({2 * np.pi * f!r}*TIME)")
        last = 8.0 + 3.0 / f * np.arange(64) / 64
        solution = m.simulate(last[-1], t_eval=np.concatenate([[0.0], last]), tol=1e-9)
        angle = solution.evaluate('AZ("load bearing.I", "load bearing.J")')[1:]
        found = 2.0 / 64 * np.sum(angle * np.exp(-2j * np.pi * f * last)) / 0.2 / -1j
        assert found == pytest.approx(plant.frequency_response(f)[0, 0, 0], rel=1e-2)


def test_a_slider_crank_that_turns_is_linearised_about_its_motion():
    """The derivatives of a'' = f(a, a') at a speed that is not steady, and the poles that the modes have there."""
    angle, speed = 0.9, 7.0
    m = slider_crank(angle, speed)
    shown = ["WZ(main.I)", ("com_velocity", "slider", "x"), ("com_acceleration", "slider", "x")]
    with pytest.warns(UserWarning, match=says("crank", "slider", "vary with time")):
        plant = m.linearize([("torque", "main"), ("force", "slider", "x")], shown)
    h, g = 1e-3, 1e-30

    def rate(a, w, torque=0.0, force=0.0):
        return _crank_acceleration(a, w, torque, force)

    by_angle = (8 * (rate(angle + h, speed) - rate(angle - h, speed))
                - (rate(angle + 2 * h, speed) - rate(angle - 2 * h, speed))) / (12 * h)  # fmt: skip
    by_speed = (rate(angle, speed + h) - rate(angle, speed - h)) / (2 * h)
    by_torque, by_force = rate(angle, speed, 1.0) - rate(angle, speed), rate(angle, speed, 0, 1.0) - rate(angle, speed)
    assert plant.states[0] == "crank: rotation about z"
    assert plant.A[1] == pytest.approx([by_angle, by_speed], rel=1e-8)
    assert plant.B[1] == pytest.approx([by_torque, by_force], rel=1e-9)
    slope, bend = _slide(angle)[1], np.imag(_slide(angle + 1j * g)[1]) / g
    # x' = x_a w, x'' = x_a a'' + x_aa w^2
    assert plant.C[1] == pytest.approx([bend * speed, slope], rel=1e-8)
    assert plant.D[2] == pytest.approx([slope * by_torque, slope * by_force], rel=1e-9)
    third = (np.imag(_slide(angle + h + 1j * g)[1]) - np.imag(_slide(angle - h + 1j * g)[1])) / g / (2 * h)
    now = rate(angle, speed)
    by_place = bend * now + slope * by_angle + third * speed**2
    assert plant.C[2] == pytest.approx([by_place, slope * by_speed + 2 * bend * speed], rel=1e-5)
    with pytest.warns(UserWarning, match=says("crank", "slider")):
        modes = m.linear_modes().eigenvalues
    assert np.sort(plant.poles.real) == pytest.approx(np.sort(modes.real), rel=1e-9)


def test_a_slider_crank_that_is_let_go_is_linearised_with_its_acceleration():
    angle, torque, h = 0.9, 3.0, 1e-3
    m = slider_crank(angle)
    m.torque("push", m.bodies["crank"], torque)
    with pytest.warns(UserWarning, match=says("crank", "3 N m", "balance")):
        plant = m.linearize([("torque", "main")], ["WZ(main.I)"])
    ends = [_crank_acceleration(angle + k * h, 0.0, torque, 0.0) for k in (1, -1, 2, -2)]
    by_angle = (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12 * h)
    assert plant.A[1] == pytest.approx([by_angle, 0.0], rel=1e-8)
    # the poles are s^2 = by_angle: the modes have them, too
    assert m.linear_modes().eigenvalues[0].imag == pytest.approx(np.sqrt(-by_angle), rel=1e-8)


def test_a_four_bar_linkage_of_parallel_cranks():
    """(2 J + m r^2) a'' + m g r sin a = T: the coupler does not turn, cranks J are balanced about their pivots."""
    r, inertia, mass = 0.3, 0.02, 1.5
    m = gm.Mechanism("parallelogram", gravity=(0, 0, -GRAVITY))
    coupler = m.body("coupler", mass, (0.1, 0.1, 0.1), position=(0.25, 0, -r))
    for name, x in (("left", 0.0), ("right", 0.5)):
        crank = m.body(name, 0.5, (inertia,) * 3, position=(x, 0, 0))
        m.revolute(f"{name} pivot", crank, m.ground, at=(x, 0, 0), axis=(0, 1, 0))
        m.revolute(f"{name} pin", coupler, crank, at=(x, 0, -r), axis=(0, 1, 0))
    plant = m.linearize(
        [("torque", "left pivot")], ['AZ("right pivot.I", "right pivot.J")', ("com_acceleration", "coupler", "x")]
    )
    whole = 2.0 * inertia + mass * r**2
    s = 1.5 + 4.0j
    turned = 1.0 / (whole * s**2 + mass * GRAVITY * r)
    # about y a positive turn swings what hangs to negative x
    assert plant.transfer(s)[:, 0] == pytest.approx([turned, -r * s**2 * turned], rel=1e-9)


def turning(stiffness=100.0, drag=0.5):
    """Two discs on a shaft that turns freely, the first of which is braked."""
    m = gm.Mechanism("turning")
    a, b = (m.body(name, 1.0, (inertia,) * 3) for name, inertia in (("a", 2.0), ("b", 1.0)))
    first, second = (m.revolute(f"pin_{body.name}", body, m.ground, axis=(0, 0, 1)) for body in (a, b))
    m.torsion_spring("shaft", first.i, second.i, stiffness=stiffness, damping=0.5)
    m.torque("drive", a, m.input("load", "N m"))
    m.parameter("drag", "N m s/rad", drag)
    m.axis_torque("brake", first.i, first.j, f"-drag*WZ({first.i.name},{first.j.name})")
    return m


def test_the_response_at_rest_leaves_out_an_angle_that_no_output_shows():
    plant = turning().linearize(["load"], [("joint_rate", "pin_b"), ("joint_angle", "pin_b")])
    f = np.array([0.0, 1e-6])
    answer = plant.frequency_response(f)[:, :, 0]
    # a torque of 1 N m turns against the brake at 1 / drag, and the angle without end
    assert answer[0, 0] == pytest.approx(2.0, rel=1e-9)
    assert answer[1, 0] == pytest.approx(2.0, rel=1e-3)
    assert np.isinf(answer[0, 1])
    assert plant.transfer(0.0)[0, 0] == pytest.approx(2.0, rel=1e-9)


def test_a_plant_at_the_run_of_another_mechanism_has_its_own_numbers():
    sim = gm.Simulator(turning(400.0, 3.0), 1.0)
    for t in (0.1, 0.2):
        sim.advance(t)
    outputs = [("joint_rate", "pin_b")]
    own = turning().linearize(["load"], outputs)
    for at in (sim.solution(), sim.state()):
        found = turning().linearize(["load"], outputs, at=at)
        np.testing.assert_allclose(np.sort_complex(found.poles), np.sort_complex(own.poles), atol=1e-6)
    # what the run itself has changed is taken over
    sim.set("shaft.stiffness", 900.0)
    sim.advance(0.3)
    stiffer = turning(900.0).linearize(["load"], outputs)
    for at in (sim.solution(), sim.state()):
        found = turning().linearize(["load"], outputs, at=at)
        np.testing.assert_allclose(np.sort_complex(found.poles), np.sort_complex(stiffer.poles), atol=1e-6)


def test_motions_that_nothing_resists_have_poles_that_are_zero():
    """Two discs of 2 and 5 kg m^2 on a stiff shaft; a state of its own, and an input led by its acceleration."""
    stiffness, damping = 3e8, 40.0
    m = gm.Mechanism("two discs")
    markers = []
    for name, inertia in (("a", 2.0), ("b", 5.0)):
        body = m.body(name, mass=1.0, inertia=(inertia,) * 3)
        m.revolute(f"pin {name}", body, m.ground, axis=(0, 0, 1))
        markers.append(body.marker(name=f"on {name}"))
    m.torsion_spring("shaft", *markers, stiffness=stiffness, damping=damping)
    plant = m.linearize([("torque", "pin a")], [("joint_angle", "pin b")])
    reduced = 2.0 * 5.0 / 7.0
    fast = np.roots([1.0, damping / reduced, stiffness / reduced])
    assert (plant.poles[:2] == 0.0).all()
    np.testing.assert_allclose(np.sort_complex(plant.poles[2:]), np.sort_complex(fast), rtol=1e-9)
    assert (plant.transfer_function().den[-2:] == 0.0).all()
    # two more of an angle that is given by its second rate, one of a state that decays
    third = m.body("c", mass=1.0, inertia=(1.0, 1.0, 1.0))
    m.rotation("motor", m.revolute("pin c", third, m.ground, axis=(0, 0, 1)), 0.0)
    m.differential_state("lag", '-3*DIF(lag) + WZ("on b")')
    plant = m.linearize([("motion", "motor", "acceleration")], [("joint_angle", "pin c")])
    assert plant.poles.size == len(plant.A) == 7
    assert (plant.poles[:4] == 0.0).all()
    np.testing.assert_allclose(np.sort_complex(plant.poles[4:]), np.sort_complex([*fast, -3.0]), rtol=1e-9)


def test_poles_are_the_eigenvalues_of_the_matrix():
    """Of what is held, where both can be computed."""
    m = gm.Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0, 0, -0.5))
    pin = m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.differential_state("lag", "AZ(pin.I, pin.J) - 5*DIF(lag)")
    m.torsion_spring("spring", pin.i, pin.j, stiffness=2.0, damping=0.3)
    plant = m.linearize([("torque", "pin")], [("joint_angle", "pin"), ("state", "lag")])
    np.testing.assert_allclose(np.sort_complex(plant.poles), np.sort_complex(np.linalg.eigvals(plant.A)), rtol=1e-9)


def stiff(ground: float = 0.0) -> tuple[gm.Mechanism, np.ndarray]:
    """Return two discs on a stiff shaft, with a torque between them, and their inertias."""
    inertia = np.array([0.02, 0.9])
    m = gm.Mechanism("stiff")
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    bodies = [m.body(name, 1.0, (own,) * 3) for name, own in zip("ab", inertia, strict=True)]
    pins = [m.revolute(f"pin {body.name}", body, m.ground, at=(0, 0, 0), axis=axis) for body in bodies]
    ends = [body.marker(orientation=pins[0].i.orientation, name=f"{body.name} end") for body in bodies]
    m.torsion_spring("shaft", *ends, stiffness=3e8, damping=2e3)
    m.input("pull", "N m")
    m.axis_torque("between", pins[0].i, pins[1].i, "pull")
    m.axis_torque("drag", pins[1].i, pins[1].j, f'-{ground}*WZ("pin b.I", "pin b.J", "pin b.J")')
    return m, inertia


@pytest.mark.parametrize("drag", [0.0, 0.03])
def test_what_turns_freely_is_exact_at_all_frequencies(drag):
    """J_1 p_1'' = T + k (p_2 - p_1) + .., at frequencies of which the square is less than rounding of k / J."""
    m, (one, two) = stiff(drag)
    shown = [
        ("joint_angle", "pin a"),
        ("joint_rate", "pin b"),
        ("load", "shaft", "tz"),
        ("angular_acceleration", "a", "x"),
    ]
    plant = m.linearize(["pull", ("torque", "pin a")], shown)
    f = np.array([1e-5, 1e-4, 1e-3, 0.1, 30.0, 3000.0, 3e5])
    s = 2j * np.pi * f
    couple = 2e3 * s + 3e8
    # p_1, p_2 and p_1 - p_2 by Cramer's rule, without differences of large numbers
    whole = one * two * s**2 + one * drag * s + (one + two) * couple + drag * couple / s
    twist = np.array([(one + two) + drag / s, two + drag / s]) / whole
    first = np.array([two * s**2 + drag * s, two * s**2 + drag * s + couple]) / (whole * s**2)
    second = np.array([np.full(s.size, -one), couple / s**2]) / whole
    exact = np.array([first, s * second, -couple * twist * 2.0 / 3.0, s**2 * first / 3.0])
    exact = exact.transpose(2, 0, 1)
    answer = plant.frequency_response(f)
    # the fast pole, known to its rounding, beside which s is looked at; some units of it are lost on the way
    fast = np.sqrt(3e8 * (1.0 / one + 1.0 / two))
    allowed = 1e-9 + 16.0 * np.finfo(float).eps * fast / np.abs(s)
    for found in (answer, np.array([plant.transfer(each) for each in s])):
        for given, wanted, share in zip(found, exact, allowed, strict=True):
            np.testing.assert_allclose(given[:3], wanted[:3], rtol=share)
            # what the shaft takes of the torque, and the torque
            np.testing.assert_allclose(given[3], wanted[3], rtol=share, atol=1e-14 / one)
    # beside a slow pole the polynomials have what rounding leaves
    for j in range(0 if drag else 2):
        for k in range(3):
            polynomials = plant.transfer_function(j, k)
            ratio = np.polyval(polynomials.num, s[2:]) / np.polyval(polynomials.den, s[2:])
            np.testing.assert_allclose(ratio, exact[2:, k, j], rtol=2e-5)


def test_a_torque_between_bodies_leaves_them_where_they_are_at_rest():
    """p_1 = J_2 / (J_1 + J_2) T / k: no motion of both; against the ground both turn ever faster."""
    m, (one, two) = stiff()
    plant = m.linearize(["pull", ("torque", "pin a")], [("joint_angle", "pin a"), ("load", "shaft", "tz")])
    exact = [[two / (one + two) / 3e8, np.inf], [-2.0 / 3.0, -2.0 / 3.0 * two / (one + two)]]
    assert plant.dc_gain == pytest.approx(np.array(exact), rel=1e-9)
    assert plant.frequency_response(0.0)[0] == pytest.approx(np.array(exact), rel=1e-9)


def test_coefficients_beyond_what_a_number_holds_are_refused():
    """The last coefficient is the product of all poles: of 60 at 1e6 rad/s 1e360, of 20 it is 1e120."""
    for count, fits in ((20, True), (60, False)):
        poles = -1e6 * np.linspace(1.0, 2.0, count)
        states = [f"x{k}" for k in range(count)]
        ones = np.ones((count, 1))
        plant = LinearPlant(np.diag(poles), ones, ones.T, np.zeros((1, 1)), states, ["u"], ["y"])
        exact = np.sum(1.0 / (2j * np.pi * 1e5 - poles))
        assert plant.frequency_response(1e5)[0, 0, 0] == pytest.approx(exact, rel=1e-9)
        if fits:
            assert np.isfinite(plant.transfer_function().den).all()
        else:
            with pytest.raises(ModelError, match=says("60", "transfer", "frequency_response")):
                plant.transfer_function()
