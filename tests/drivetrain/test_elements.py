"""Motors, couplings and loads against closed forms."""

import re

import numpy as np
import pytest

from gearmbs.drivetrain import (
    Brake,
    CircuitMotor,
    ControlledDrive,
    CurveMotor,
    Drag,
    DrivetrainError,
    ElasticClutch,
    Fan,
    InductionMotor,
    Pump,
    TableLoad,
    TorqueDrive,
    TorqueLoad,
    TorsionalShaft,
    gear_pump_ripple,
)
from gearmbs.drivetrain.part import Attached
from gearmbs.mechanism import static_equilibrium
from tests.drivetrain.support import evaluate, frame, rotor
from tests.says import says

MOTOR = {"shaft": "rotor", "name": "motor", "speed": "1450 rpm", "power": "7.5 kW", "breakdown": 2.8}


def turning(m, pin, part, speed, running=True, run_up=0.01):
    part.add(Attached(m, pin.i, pin.j, speed, run_up, running))
    return m.elements[part.name]


def torque_at(part, speed, inputs=(1.0,), states=(), angle=0.0):
    """Return the torque an element exerts at a speed."""
    m, pin = rotor()
    element = turning(m, pin, part, abs(speed) if speed else 1.0)
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    frames = np.array(
        [frame((0, 0, 0), axes, (0, 0, 0), (0, 0, speed)), frame((0, 0, 0), np.eye(3), (0,) * 3, (0,) * 3)]
    )
    wrench, _, jac, told = evaluate(element, frames, states, inputs)
    return wrench[5], jac[5, 11], told


def test_kloss_points_and_slopes():
    """7.5 kW, 4 poles, 50 Hz, 1450 rpm, T_b/T_n = 2.8."""
    motor = InductionMotor(**MOTOR)
    rated, synchronous = 1450 * np.pi / 30, 50 * np.pi
    assert motor.rated_torque == pytest.approx(7500 / rated, rel=1e-14)
    assert motor.breakdown_slip == pytest.approx((1 / 30) * (2.8 + np.sqrt(2.8**2 - 1)), rel=1e-12)
    for speed, torque in (
        (rated, 49.3931),
        (synchronous * (1 - motor.breakdown_slip), 138.3006),
        (0.0, 48.3539),
        (synchronous, 0.0),
    ):
        found, _, told = torque_at(motor, speed)
        assert found == pytest.approx(torque, abs=2e-3)
        s = 1 - speed / synchronous
        exact = 2 * 2.8 * 7500 / rated / (s / motor.breakdown_slip + motor.breakdown_slip / s) if s else 0.0
        assert found == pytest.approx(exact, rel=1e-12, abs=1e-9)
        assert told[0] == pytest.approx(s, abs=1e-12)
    assert torque_at(motor, rated)[1] == pytest.approx(-8.811, abs=1e-3)
    assert torque_at(motor, rated)[1] == pytest.approx(-motor.damping(), rel=1e-12)
    assert torque_at(motor, synchronous)[1] == pytest.approx(-9.755, abs=1e-3)


def test_motor_settles_where_its_curve_meets_the_load():
    m, pin = rotor()
    motor = InductionMotor(**{**MOTOR, "lag": True})
    turning(m, pin, motor, motor.speed)
    turning(m, pin, TorqueLoad(name="load", shaft="rotor", torque=7500 / motor.speed), motor.speed)
    solution = m.simulate(2.0, rate=500, tol=1e-9, rate_scale=10.0)
    assert solution.angular_velocity("rotor")[-1, 2] == pytest.approx(motor.speed, rel=1e-6)
    assert solution.state("motor.torque")[-1] == pytest.approx(motor.rated_torque, rel=1e-6)
    assert solution.energy_balance().relative_imbalance < 1e-5


def test_circuit_is_the_circuit():
    """Power in the rotor resistance over the synchronous speed, by complex impedances."""
    motor = CircuitMotor(
        name="motor", shaft="rotor", speed="1450 rpm", voltage=231.0, stator_resistance=0.72, rotor_resistance=0.61,
        stator_reactance=1.5, rotor_reactance=1.9, magnetising_reactance=41.0,
    )  # fmt: skip
    for speed in (0.0, 80.0, 150.0, 160.0):
        s = 1 - speed / (50 * np.pi)
        rotor_branch = 0.61 / s + 1.9j
        branch = rotor_branch * 41j / (rotor_branch + 41j)
        voltage = 231.0 * branch / (branch + 0.72 + 1.5j)
        current = abs(voltage / rotor_branch)
        torque = 3 * current**2 * 0.61 / s / (50 * np.pi)
        assert torque_at(motor, speed)[0] == pytest.approx(torque, rel=1e-12)
    assert motor.breakdown_torque == pytest.approx(max(motor.torque(w) for w in np.linspace(0, 157, 20001)), rel=1e-7)


def test_controlled_drive_holds_its_speed_under_load():
    m, pin = rotor()
    drive = ControlledDrive(name="motor", shaft="rotor", speed=100.0, proportional=3.0, integral=40.0, largest=80.0)
    turning(m, pin, drive, 100.0, running=False, run_up=0.1)
    turning(m, pin, TorqueLoad(name="load", shaft="rotor", torque=30.0), 100.0)
    solution = m.simulate(2.0, rate=500, tol=1e-8, rate_scale=10.0)
    assert solution.angular_velocity("rotor")[-1, 2] == pytest.approx(100.0, abs=1e-4)
    torque = solution.load("motor")[1][:, 2]
    assert torque[-1] == pytest.approx(30.0, abs=1e-3)
    assert torque.max() <= 80.0


def test_gains_of_a_controlled_drive_have_their_units():
    drive = ControlledDrive(
        name="motor", shaft="rotor", speed=100.0, proportional="5 N m s/rad", integral="40 N m/rad", largest=80.0
    )
    assert (drive.proportional, drive.integral) == (5.0, 40.0)
    with pytest.raises(DrivetrainError, match=says("proportional", "5 N", "s/rad")):
        ControlledDrive(name="motor", shaft="rotor", speed=100.0, proportional="5 N", integral=40.0, largest=80.0)


def test_curve_and_torque_drives():
    curve = CurveMotor(name="m", shaft="rotor", speed=50.0, speeds=(0.0, 50.0, 100.0), torques=(40.0, 30.0, 0.0))
    for speed, torque in ((0.0, 40.0), (50.0, 30.0), (100.0, 0.0)):
        assert torque_at(curve, speed)[0] == pytest.approx(torque)
    assert torque_at(TorqueDrive(name="m", shaft="rotor", speed=1.0, torque=5.0), 3.0, (5.0,))[0] == 5.0


def test_clutch_loses_a_cycle_what_its_relative_damping_says():
    """Twist A sin(w t) on a linear clutch: pi c w A^2 = psi k A^2 / 2."""
    k, psi, f, amplitude = 3000.0, 0.8, 12.0, 0.02
    m, pin = rotor()
    clutch = ElasticClutch(
        name="clutch", first="a", second="b", stiffness=k, relative_damping=psi, damping_frequency=f
    )  # fmt: skip
    turning(m, pin, clutch, 1.0)
    m.rotation("drive", pin, f"{amplitude}*SIN({2 * np.pi * f}*TIME)")
    solution = m.simulate(2 / f, rate=400 * f, tol=1e-9)
    lost = solution.energy_balance().dissipated_damping.values
    whole = lost[-1] - lost[400]
    assert clutch.tangent_damping == pytest.approx(psi * k / (2 * np.pi * 2 * np.pi * f))
    assert whole == pytest.approx(psi * 0.5 * k * amplitude**2, rel=1e-6)


def twisted(clutch, twist, speed=0.0):
    return torque_at(clutch, speed, (twist,), angle=twist)


@pytest.mark.slow
def test_clutch_stages_and_dead_band():
    soft = ElasticClutch(name="c", first="a", second="b", stiffness=100.0, cubic=4e4, second_stiffness=900.0,
                         second_stage=0.05, transition=0.01)  # fmt: skip
    torque, _, told = twisted(soft, 0.1)
    assert torque == pytest.approx(-(100.0 * 0.1 + 4e4 * 1e-3 + 800.0 * (0.05 - 0.005)))
    # the energy is the torque's integral
    twists = np.linspace(0, 0.1, 2001)
    work = np.trapezoid([-twisted(soft, x)[0] for x in twists], twists)
    assert told[0] == pytest.approx(work, rel=1e-6)
    jaw = ElasticClutch(name="c", first="a", second="b", stiffness=1e4, damping=50.0, dead_band=0.1, depth=0.01)
    assert twisted(jaw, 0.0499, 10.0)[0] == 0.0
    assert twisted(jaw, 0.06)[0] == pytest.approx(-100.0)
    assert twisted(jaw, -0.06)[0] == pytest.approx(100.0)
    # leaving fast: the damping alone would pull
    assert twisted(jaw, 0.06, -100.0)[0] == 0.0
    for twist in np.linspace(-0.1, 0.1, 41):
        for speed in (-100.0, -1.0, 1.0, 100.0):
            assert twisted(jaw, twist, speed)[0] * twist <= 0.0


def test_torsional_shaft_has_the_stiffness_of_a_circle():
    shaft = TorsionalShaft(name="s", first="a", second="b", length="500 mm", diameter="40 mm", shear_modulus=8e10)
    assert shaft.tangent == pytest.approx(8e10 * np.pi * 0.04**4 / 32 / 0.5)
    m, pin = rotor()
    turning(m, pin, shaft, 1.0)
    turning(m, pin, TorqueDrive(name="t", shaft="rotor", speed=1.0, torque=200.0), 1.0)
    turned = static_equilibrium(m, t=1.0).solution.orientation("rotor")[0]
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(200.0 / shaft.tangent, rel=1e-9)


def test_damping_of_a_torsional_shaft_is_a_time():
    """Its field was called a ratio: that name still works, and says what it is."""
    given = dict(name="s", first="a", second="b", stiffness=5e4)
    shaft = TorsionalShaft(**given, damping_time="0.1 ms")
    assert shaft.tangent_damping == pytest.approx(5.0)
    with pytest.warns(FutureWarning, match=r"coupling 's': damping_ratio .* write damping_time"):
        former = TorsionalShaft(**given, damping_ratio="0.1 ms")
    assert former == shaft
    with pytest.raises(DrivetrainError, match=r"coupling 's': damping_ratio .* give damping_time alone"):
        TorsionalShaft(**given, damping_time=1e-4, damping_ratio=1e-4)


@pytest.mark.parametrize(("teeth", "nonuniformity", "first", "second"), [
    (10, 0.2121, 0.0851, 0.0206), (12, 0.1775, 0.0710, 0.0171), (14, 0.1526, 0.0609, 0.0146),
])  # fmt: skip
def test_pump_ripple(teeth, nonuniformity, first, second):
    """External gear pump: published values, and the delivery sampled along the line of action."""
    found, _ = gear_pump_ripple(teeth)
    assert found == pytest.approx(nonuniformity, abs=1e-4)
    pump = Pump(name="p", shaft="rotor", displacement="20 cm^3", pressure=1e6, teeth=teeth, harmonics=400)
    a = np.array(pump.factors)
    assert abs(a[0]) == pytest.approx(first, abs=1e-3)
    assert abs(a[1]) == pytest.approx(second, abs=1e-3)
    u = np.linspace(-0.5, 0.5, 4001)
    half = 0.5 * np.pi * np.cos(np.deg2rad(20))
    delivery = (teeth / 2 + 1) ** 2 - (teeth / 2) ** 2 - (2 * half * u) ** 2
    mean = np.trapezoid(delivery, u)
    series = 1 + np.cos(2 * np.pi * np.outer(u, np.arange(1, 401))) @ a
    np.testing.assert_allclose(series, delivery / mean, atol=1e-3)


def test_pump_torque_and_flow():
    """The two loads of the bench from one pump: 100 N m at 1 MPa and 200 N m at 5 MPa need an idle torque of 75 N m."""
    pump = Pump(
        name="p", shaft="rotor", displacement=2 * np.pi * 100 / 4e6, pressure="1 MPa", idle=75.0, smoothing=1e-3
    )
    assert torque_at(pump, 50.0, (1e6,))[0] == pytest.approx(-100.0)
    assert torque_at(pump, 50.0, (5e6,))[0] == pytest.approx(-200.0)
    assert torque_at(pump, 50.0, (5e6,))[2][0] == pytest.approx(pump.displacement * 50 / (2 * np.pi))
    assert pump.nominal(50.0) == pytest.approx(100.0)
    m, pin = rotor()
    slow = Pump(name="p", shaft="rotor", displacement=1e-4, pressure="2 MPa", lag=0.05)
    turning(m, pin, slow, 100.0, running=False, run_up=1e-4)
    m.rotation("drive", pin, "100*TIME")
    solution = m.simulate(0.5, rate=400, tol=1e-8)
    # a step of 0.1 ms counts from its middle on
    exact = 2.0 * (1 - np.exp(-(solution.t - 5e-5) / 0.05))
    np.testing.assert_allclose(solution.state("p.pressure")[1:], exact[1:], rtol=1e-4)


def test_resistances():
    assert torque_at(Fan(name="f", shaft="r", torque=80.0, at_speed=100.0), 50.0)[0] == pytest.approx(-20.0)
    assert torque_at(Brake(name="b", shaft="r", torque=9.0), 50.0)[0] == pytest.approx(-9.0)
    assert torque_at(Brake(name="b", shaft="r", torque=9.0), -50.0)[0] == pytest.approx(9.0)
    drag = Drag(name="d", shaft="r", torque=0.5, viscous=0.01)
    assert torque_at(drag, 50.0)[0] == pytest.approx(-1.0)
    assert torque_at(drag, 50.0)[2][0] == pytest.approx(50.0)
    over_speed = TableLoad(name="t", shaft="r", over="speed", places=(0.0, 50.0, 100.0), torques=(0.0, 7.0, 20.0))
    assert torque_at(over_speed, 50.0)[0] == pytest.approx(-7.0)
    turn = np.linspace(0, 2 * np.pi, 33)
    over_angle = TableLoad(name="t", shaft="r", over="angle", places=turn, torques=3 + np.sin(turn))
    assert torque_at(over_angle, 1.0, (1.0, 1.2), angle=1.2)[0] == pytest.approx(-(3 + np.sin(1.2)), abs=1e-4)


TABLES = [
    ("angle", ("0 deg", "180 deg", "360 deg"), (0.0, 20.0, 0.0), 10.0),
    ("speed", ("0 rpm", "200 rpm", "300 rpm"), (0.0, 2.0, 10.0), None),
    ("speed", ("0 rpm", "1000 rpm", "1100 rpm"), (0.0, 1.0, 100.0), None),
    ("time", (0.0, 0.1, 0.2, 1.0), (0.0, 10.0, 12.0, 10.0), None),
]


@pytest.mark.parametrize(("over", "places", "torques", "exact"), TABLES)
def test_the_torque_of_a_table_at_the_operating_point_is_that_of_its_run(over, places, torques, exact):
    """Over speed what the kernel writes there, inside and beyond; else the mean of what it writes."""
    load = TableLoad(name="t", shaft="r", over=over, places=places, torques=torques)
    speed = 600 * np.pi / 30
    nominal = load.nominal(speed)
    if over == "speed":
        assert nominal == pytest.approx(-torque_at(load, speed)[0], rel=1e-13)
        return
    at = np.linspace(0.0, load.places[-1], 2001)
    if over == "angle":
        run = [-torque_at(load, 1.0, (1.0, angle), angle=angle)[0] for angle in at[::20]]
        assert nominal == pytest.approx(np.trapezoid(run, at[::20]) / at[-1], rel=1e-3)
    else:
        m, pin = rotor(0.5)
        turning(m, pin, load, 1.0)
        solution = m.simulate(1.0, rate=10, tol=1e-9)
        assert nominal == pytest.approx(-0.5 * solution.angular_velocity("rotor")[-1, 2], rel=1e-6)
    assert exact is None or nominal == pytest.approx(exact, rel=1e-13)


def test_curves_that_leave_their_points_and_speeds_beyond_them_are_doubted():
    def doubts(over, places, torques, rpm=600.0):
        return TableLoad(name="t", shaft="r", over=over, places=places, torques=torques).doubts(rpm * np.pi / 30)

    (beyond,) = doubts("speed", ("0 rpm", "200 rpm", "300 rpm"), (0.0, 2.0, 10.0))
    assert re.search(says("load 't'", "300 rpm", "600 rpm", "41 N m", "give points up to"), beyond)
    assert doubts("speed", ("0 rpm", "200 rpm", "300 rpm"), (0.0, 2.0, 10.0), 290.0) == []
    (swings,) = doubts("angle", ("0 deg", "10 deg", "20 deg", "360 deg"), (-5.0, 300.0, -5.0, -5.0))
    assert re.search(says("load 't'", "-5 to 300 N m", "mean", "-2407.4 N m", "give more points"), swings)
    (swings,) = doubts("time", (0.0, 0.1, 0.2, 1.0), (0.0, 100.0, 10.0, 10.0))
    assert re.search(says("load 't'", "0 to 100 N m", "give more points"), swings)
    third = 2.0 * np.pi / 3.0 * np.arange(4)
    assert doubts("angle", third, np.cos(third)) == []


def test_load_over_time_from_a_table():
    m, pin = rotor(0.5)
    load = TableLoad(name="t", shaft="r", over="time", places=(0.0, 0.3, 0.6, 1.0), torques=(0.0, 0.6, 1.2, 2.0))
    turning(m, pin, load, 1.0)
    solution = m.simulate(1.0, rate=200, tol=1e-8)
    np.testing.assert_allclose(solution.angular_velocity("rotor")[:, 2], -2 * solution.t**2, atol=1e-5)


@pytest.mark.parametrize("running", [True, False])
@pytest.mark.parametrize(("over", "places"), [("speed", (-1e3, 0.0, 1e3)), ("angle", (0.0, 2.0, 4.0, 2.0 * np.pi))])
def test_a_table_comes_on_over_the_run_up_as_numbers_do(over, places, running):
    m, pin = rotor(0.5)
    turning(
        m, pin, TableLoad(name="t", shaft="r", over=over, places=places, torques=(2.0,) * len(places)), 1.0, running
    )
    other, axis = rotor(0.5)
    turning(other, axis, TorqueLoad(name="t", shaft="r", torque=2.0), 1.0, running)
    by_table, by_number = (
        one.simulate(0.02, rate=2000, tol=1e-9).angular_velocity("rotor")[:, 2] for one in (m, other)
    )
    np.testing.assert_allclose(by_table, by_number, atol=1e-8)
    # half of the first 0.01 s counts
    assert by_table[-1] == pytest.approx(-2.0 / 0.5 * 0.015, rel=1e-6)


@pytest.mark.parametrize(("make", "words"), [
    (lambda: InductionMotor(**{**MOTOR, "speed": "1500 rpm"}), "synchronous speed is 1500 rpm"),
    (lambda: InductionMotor(**{**MOTOR, "poles": 3}), "poles is 3"),
    (lambda: ElasticClutch(name="c", first="a", second="b", stiffness=1.0, relative_damping=0.5), "damping_frequency"),
    (lambda: ElasticClutch(name="c", first="a", second="b", stiffness=-1.0), "coupling 'c': stiffness is -1"),
    (lambda: Pump(name="p", shaft="a", displacement="1 kg", pressure=1), says("displacement", "'1 kg'", "'1 m^3'")),
    (lambda: TorsionalShaft(name="t", first="a", second="b", length=1.0), says("length", "give stiffness")),
    (lambda: TableLoad(name="t", shaft="a", over="moon", places=(1,), torques=(1,)), "over is 'moon'"),
])  # fmt: skip
def test_wrong_numbers_are_named(make, words):
    with pytest.raises(DrivetrainError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), np.float64("nan")])
@pytest.mark.parametrize(
    ("kind", "field", "others"),
    [
        (TorqueLoad, "torque", {"shaft": "a"}),
        (TorqueDrive, "torque", {"shaft": "a", "speed": 10.0}),
        (Pump, "pressure", {"shaft": "a", "displacement": "10 cm^3"}),
        (Brake, "share", {"shaft": "a", "torque": 1.0}),
    ],
)
def test_a_load_that_is_no_number_is_refused_by_name(kind, field, others, value):
    with pytest.raises(DrivetrainError, match=rf"'x'.*{field}.*(nan|inf).*give"):
        kind(name="x", **{field: value}, **others)
    for fine in (2.0, "2*SIN(TIME)"):
        kind(name="x", **{field: fine}, **others)
