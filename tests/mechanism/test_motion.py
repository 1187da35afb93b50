"""Motions against closed solutions: what the equations must give whatever the integrator."""

import warnings

import numpy as np
import pytest
from scipy.special import ellipk

from gearmbs.mechanism import Mechanism, expression, harmonic, kinematic, polyline_integral, polynomial, ramp
from tests.says import says

INTEGRATORS = ("IDA", "WSTIFF")


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("formulation", ["SI2", "SI1"])
def test_pendulum_period(integrator, formulation):
    """Point pendulum of length 1 m from rest at 90 degrees: T = 4 sqrt(l/g) K(sin^2 45), K the elliptic integral."""
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    bob = m.body("bob", 1.0, (1e-9, 1e-9, 1e-9), position=(1, 0, 0))
    m.revolute("pin", bob, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    period = 4.0 * np.sqrt(1.0 / 9.81) * ellipk(0.5)
    solution = m.simulate(period, integrator=integrator, formulation=formulation, tol=1e-9)
    assert solution.success, solution.message
    np.testing.assert_allclose(solution.com_position("bob")[-1], [1, 0, 0], atol=2e-7)
    # at the lowest point (T/4) the pin carries m g + m v^2/l = 3 m g
    force, _ = m.simulate(period / 4, integrator=integrator, tol=1e-9).reaction("pin")
    np.testing.assert_allclose(force[-1], [0, 0, 3 * 9.81], atol=1e-5)


def test_free_fall_and_spin():
    m = Mechanism("stone", gravity=(0, 0, -9.81))
    m.body("stone", 2.0, (1, 1, 1), velocity=(1, 2, 3), angular_velocity=(0, 0, 5), com=(0.1, 0, 0))
    solution = m.simulate(1.0, integrator="IDA", tol=1e-9)
    # the centre of mass starts at (0.1, 0, 0) with v + w x r = (1, 2.5, 3)
    np.testing.assert_allclose(solution.com_position("stone")[-1], [1.1, 2.5, 3 - 4.905], atol=1e-7)
    np.testing.assert_allclose(solution.angular_velocity("stone")[-1], [0, 0, 5], atol=1e-8)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.slow
def test_tumbling_body_keeps_energy_and_angular_momentum(integrator):
    """Intermediate-axis tumbling crosses the Euler singularity again and again; A J A^T w is constant."""
    moments = np.diag([1.0, 2.0, 3.0])
    m = Mechanism("tumbler")
    m.body("t", 1.0, (1.0, 2.0, 3.0), angular_velocity=(1e-3, 10.0, 0.0))
    solution = m.simulate(10.0, rate=100, integrator=integrator, tol=1e-10)
    assert solution.success, solution.message
    assert len(solution.result.epochs) > 3
    a, w = solution.orientation("t"), solution.angular_velocity("t")
    h = np.einsum("tij,jk,tlk,tl->ti", a, moments, a, w)
    limit = 1e-8 if integrator == "WSTIFF" else 1e-6
    assert np.abs(h - h[0]).max() < limit * np.linalg.norm(h[0])
    assert np.abs(solution.kinetic_energy / solution.kinetic_energy[0] - 1).max() < limit


@pytest.mark.slow
def test_tumbling_through_thousands_of_singularities():
    """Spin about the intermediate axis x: y and z pass the vertical in turn, and the Euler reference changes 5.7 times
    a second; after 400 s energy and angular momentum are off by less than 1e-8."""
    moments = np.diag([2.0, 1.0, 3.0])
    m = Mechanism("tumbler")
    m.body("t", 1.0, (2.0, 1.0, 3.0), angular_velocity=(10.0, 1e-3, 0.0))
    solution = m.simulate(400.0, rate=100, tol=1e-11)
    assert solution.success, solution.message
    assert len(solution.result.epochs) > 2000
    a, w = solution.orientation("t"), solution.angular_velocity("t")
    h = np.einsum("tij,jk,tlk,tl->ti", a, moments, a, w)
    assert np.abs(h - h[0]).max() < 1e-8 * np.linalg.norm(h[0])
    assert np.abs(solution.kinetic_energy / solution.kinetic_energy[0] - 1).max() < 1e-8


def test_wheel_spinning_about_its_own_axis_along_global_z():
    """Exactly on the singularity of the plain 3-1-3 angles; the angle is known: phi(t) = 100 t."""
    m = Mechanism("wheel")
    wheel = m.body("w", 1.0, (0.5, 0.5, 1.0))
    pin = m.revolute("pin", wheel, m.ground, axis=(0, 0, 1))
    m.rotation("drive", pin, polynomial([0.0, 100.0]))
    solution = m.simulate(60.0, integrator="IDA", tol=1e-8)
    turned = solution.orientation("w")[:, :, 0]
    angle = 100.0 * solution.t
    np.testing.assert_allclose(turned[:, 0], np.cos(angle), atol=1e-8)
    np.testing.assert_allclose(turned[:, 1], np.sin(angle), atol=1e-8)
    # of the integrator's own angle, 6000 rad in the end, of which rounding leaves 1e-12
    assert solution.constraint_violation.max() < 1e-11


def test_prescribed_rotation_needs_the_torque_j_alpha():
    """Reaction of the drive is J f''(t) about z; f is the integral of STEP, closed form."""
    m = Mechanism("drive")
    wheel = m.body("w", 1.0, (1.2, 1.2, 2.0))
    pin = m.revolute("pin", wheel, m.ground)
    function = ramp(30.0, over=0.5)
    m.rotation("drive", pin, function)
    solution = m.simulate(0.5, integrator="IDA", tol=1e-9)
    _, moment = solution.reaction("drive")
    expected = 2.0 * np.array([function.derivatives(t)[2] for t in solution.t])
    np.testing.assert_allclose(moment[:, 2], expected, atol=1e-8 * np.abs(expected).max())


def test_prescribed_translation_and_expression_agree():
    def moved(function):
        m = Mechanism("slide")
        block = m.body("b", 3.0, (1, 1, 1))
        slide = m.translational("slide", block, m.ground, axis=(1, 0, 0))
        m.translation("push", slide, function)
        return m.simulate(1.0, integrator="IDA", tol=1e-9)

    closed, text = moved(harmonic(0.2, 3.0)), moved("0.2*SIN(3*TIME)")
    np.testing.assert_allclose(closed.com_position("b"), text.com_position("b"), atol=1e-8)
    # m x'' = -m A w^2 sin(w t)
    force, _ = text.reaction("push")
    np.testing.assert_allclose(force[:, 0], -3.0 * 0.2 * 9.0 * np.sin(3.0 * text.t), atol=1e-7)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_spring_damper_oscillator(integrator):
    """m x'' + c x' + k x = 0 from x0: x = x0 e^{-d t} (cos(w t) + d/w sin(w t))."""
    m = Mechanism("oscillator")
    mass = m.body("m", 2.0, (1, 1, 1), position=(1.1, 0, 0))
    m.translational("guide", mass, m.ground, axis=(1, 0, 0))
    hook = m.ground.marker((0, 0, 0), name="hook")
    m.spring_damper("spring", mass.marker(name="eye"), hook, stiffness=200.0, damping=4.0, length=1.0)
    solution = m.simulate(2.0, integrator=integrator, tol=1e-9)
    d, w = 1.0, np.sqrt(99.0)
    x = 1.0 + 0.1 * np.exp(-d * solution.t) * (np.cos(w * solution.t) + d / w * np.sin(w * solution.t))
    np.testing.assert_allclose(solution.com_position("m")[:, 0], x, atol=5e-8)


def test_screw_advances_by_its_pitch():
    m = Mechanism("screw")
    nut = m.body("nut", 1.0, (1, 1, 1), angular_velocity=(0, 0, 2 * np.pi), velocity=(0, 0, 0.01))
    m.screw("thread", nut, m.ground, pitch=0.01)
    solution = m.simulate(5.0, integrator="IDA", tol=1e-9)
    # five free turns: 50 mm
    assert solution.com_position("nut")[-1, 2] == pytest.approx(0.05, abs=1e-8)


@pytest.mark.parametrize("speed", [10.0, 100.0])
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
def test_turns_are_counted_in_steps_of_many_turns(integrator, speed):
    """Free turns of a screw, with nothing that holds the integrator's steps short."""
    m = Mechanism("screw")
    nut = m.body("nut", 1.0, (1, 1, 1), angular_velocity=(0, 0, speed), velocity=(0, 0, 0.005 * speed / np.pi))
    m.screw("thread", nut, m.ground, pitch=0.01)
    solution = m.simulate(20.0, t_eval=(0.0, 10.0, 20.0), integrator=integrator, tol=1e-8)
    expected = 0.005 * speed / np.pi * solution.t
    np.testing.assert_allclose(solution.com_position("nut")[:, 2], expected, atol=1e-6)
    if integrator != "IDA":
        assert solution.stats.steps < 100


@pytest.mark.parametrize(
    ("integrator", "formulation"),
    # IDA does not take index 3
    [(i, f) for i in ("WSTIFF", "GSTIFF", "IDA") for f in ("SI2", "SI1", "I3") if (i, f) != ("IDA", "I3")],
)
def test_fast_shaft_in_a_bearing_takes_long_steps(integrator, formulation):
    """A Newton matrix of another orientation would let deviations grow, and fail the run or hold its steps short."""
    m = Mechanism("shaft")
    shaft = m.body("shaft", 1.0, (1, 1, 2.0), angular_velocity=(0, 0, 60.0))
    m.revolute("bearing", shaft, m.ground, at=(0, 0, 0))
    m.torque("motor", shaft, 0.5)
    solution = m.simulate(30.0, t_eval=(0.0, 30.0), integrator=integrator, formulation=formulation, tol=1e-9)
    assert solution.angular_velocity("shaft")[-1, 2] == pytest.approx(67.5, rel=1e-6)
    assert solution.stats.steps < 200


def test_counted_angle_of_a_force_in_steps_of_many_turns():
    """A shaft against a torque of 1e-3 AZ: J w' = 0.5 - 1e-3 angle, w(0) = 60."""
    m = Mechanism("shaft")
    shaft = m.body("shaft", 1.0, (1, 1, 2.0), angular_velocity=(0, 0, 60.0))
    i, j = shaft.marker(name="i"), m.ground.marker(name="j")
    m.axis_torque("brake", i, j, "0.5 - 1e-3*AZ(i, j)")
    solution = m.simulate(30.0, t_eval=(0.0, 30.0), tol=1e-9)
    s = np.sqrt(1e-3 / 2.0)
    expected = 60.0 * np.cos(30.0 * s) + 500.0 * s * np.sin(30.0 * s)
    np.testing.assert_allclose(solution.angular_velocity("shaft")[-1, 2], expected, rtol=1e-6)
    assert solution.stats.steps < 2000


def test_coupler_is_a_gear():
    """Two wheels coupled -2 : 1; J1 a1 = T - 2 ... gives a1 = T / (J1 + 4 J2)."""
    m = Mechanism("gears")
    one, two = m.body("one", 1.0, (1, 1, 0.1)), m.body("two", 1.0, (1, 1, 0.2), position=(1, 0, 0))
    pins = [m.revolute(f"pin {b.name}", b, m.ground, at=b.position) for b in (one, two)]
    m.coupler("gear", [(pins[0], 2.0), (pins[1], 1.0)])
    m.torque("motor", one, 0.9)
    solution = m.simulate(2.0, integrator="IDA", tol=1e-9)
    np.testing.assert_allclose(solution.angular_velocity("one")[-1, 2], 0.9 / (0.1 + 4 * 0.2) * 2.0, rtol=1e-7)
    np.testing.assert_allclose(solution.angular_velocity("two")[-1, 2], -4.0, rtol=1e-7)


def test_energy_balance_of_a_conservative_mechanism():
    """Nothing works on a pendulum: its imbalance is held against the exchanged energy, m g (z_max - z_min)."""
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", 1.0, (0.1, 0.1, 0.1), position=(0.5, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    solution = m.simulate(2.0, rate=500, tol=1e-8)
    balance = solution.energy_balance()
    exchanged = 9.81 * np.ptp(solution.com_position("rod")[:, 2])
    expected = float(np.abs(balance.imbalance).max()) / exchanged
    assert balance.attrs["relative_imbalance"] == pytest.approx(expected, rel=1e-3)
    assert balance.attrs["relative_imbalance"] < 1e-6


def test_energy_balance_of_a_body_at_rest_is_no_number():
    m = Mechanism("rest")
    m.body("block", 1.0, (0.1, 0.1, 0.1))
    assert np.isnan(m.simulate(0.1).energy_balance().attrs["relative_imbalance"])


def test_energy_balance_of_a_driven_oscillator():
    m = Mechanism("driven", gravity=(0, 0, -9.81))
    arm = m.body("arm", 1.0, (0.1, 0.1, 0.1), position=(0.5, 0, 0))
    pin = m.revolute("pin", arm, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.rotation("drive", pin, harmonic(0.5, 4.0))
    balance = m.simulate(2.0, rate=2000, integrator="IDA", tol=1e-9).energy_balance()
    assert balance.attrs["relative_imbalance"] < 1e-6


def test_energy_balance_says_where_outputs_are_too_far_apart():
    """A spring that swings at 16 Hz against a slide that is driven: works need outputs within its period."""
    m = Mechanism("driven")
    base = m.body("base", 1.0, (0.1, 0.1, 0.1))
    block = m.body("block", 1.0, (0.1, 0.1, 0.1), position=(0.5, 0, 0))
    slide = m.translational("slide", base, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.translational("guide", block, m.ground, at=(0.5, 0, 0), axis=(1, 0, 0))
    m.translation("drive", slide, harmonic(0.01, 80.0))
    m.spring_damper("spring", base.marker(), block.marker(), stiffness=1e4, damping=20.0)
    run = {"tol": 1e-8, "integrator": "WSTIFF"}
    with pytest.warns(UserWarning, match=says("every", "rate", "every_step=True")):
        coarse = m.simulate(1.0, rate=24, **run).energy_balance()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine, steps = (m.simulate(1.0, **how, **run).energy_balance() for how in ({"rate": 400}, {"every_step": True}))
    assert coarse.attrs["relative_coarseness"] > 0.05
    assert fine.attrs["relative_coarseness"] < 0.01
    assert fine.attrs["relative_imbalance"] < 1e-4
    assert abs(float(coarse.work_motion[-1] / fine.work_motion[-1]) - 1.0) > 0.05
    assert float(steps.work_motion[-1]) == pytest.approx(float(fine.work_motion[-1]), rel=1e-3)


def test_same_run_twice_is_bit_identical():
    m = Mechanism("p", gravity=(0, 0, -9.81))
    bob = m.body("bob", 1.0, (0.1, 0.1, 0.1), position=(1, 0, 0))
    m.spherical("pin", bob, m.ground, at=(0, 0, 0))
    for integrator in INTEGRATORS:
        first, second = (m.simulate(1.0, integrator=integrator).result.y for _ in range(2))
        assert np.array_equal(first, second)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_output_times_may_be_a_column_of_a_table(integrator):
    m = Mechanism("fall", gravity=(0, 0, -9.81))
    m.body("stone", 1.0, (0.1, 0.1, 0.1))
    table = np.column_stack([np.linspace(0.0, 1.0, 5), np.ones(5)])
    solution = m.simulate(1.0, t_eval=table[:, 0], integrator=integrator)
    np.testing.assert_allclose(solution.com_position("stone")[:, 2], -9.81 / 2 * table[:, 0] ** 2, atol=1e-5)


@pytest.mark.parametrize(("t_end", "rate", "count"), [(1.0, 0.1, 2), (0.5, 3.0, 3), (1.0, 333.3, 335), (0.3, 10.0, 4)])
def test_the_last_output_is_the_end(t_end, rate, count):
    """Outputs at multiples of 1/rate below the end and one at the end: floor(t_end rate) + 1 or + 2."""
    m = Mechanism("stone", gravity=(0, 0, -9.81))
    m.body("stone", 2.0, (1, 1, 1))
    t = m.simulate(t_end, rate=rate).t
    assert t.size == count
    assert t[-1] == pytest.approx(t_end, abs=1e-12)
    np.testing.assert_allclose(np.diff(t)[:-1], 1.0 / rate)


@pytest.mark.parametrize(("tol", "off"), [(1e-6, 0.5), (1e-7, 0.06), (1e-8, 1e-2), (1e-9, 1e-3)])
def test_flips_of_a_tumbling_body(tol, off):
    """Moments of 1, 2, 3 kg m^2, spun at w about the middle axis with a about the first.

    The spin about the middle axis goes with sn of modulus k^2 = w^2/(a^2 + w^2): a flip takes
    2 K(k^2) sqrt(3/(a^2 + w^2)). It depends on the logarithm of a, and an error of the step acts like one of a: the
    default tolerance of 1e-6 misses the fifth flip by a tenth to a third of one.
    """
    a, w = 0.01, 10.0
    flip = 2.0 * ellipk(w**2 / (a**2 + w**2)) * np.sqrt(3.0 / (a**2 + w**2))
    m = Mechanism("free")
    m.body("plate", 1.0, (1.0, 2.0, 3.0), angular_velocity=(a, w, 0.0))
    solution = m.simulate(5.9 * flip, rate=200, tol=tol)
    assert solution.success
    spin = np.einsum("tji,tj->ti", solution.orientation("plate"), solution.angular_velocity("plate"))[:, 1]
    k = np.flatnonzero(spin[1:] * spin[:-1] < 0)
    times = solution.t[k] - spin[k] * (solution.t[k + 1] - solution.t[k]) / (spin[k + 1] - spin[k])
    assert len(times) >= 6
    assert abs(times[5] - times[0] - 5.0 * flip) < off * flip


@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("lump", [False, True])
def test_a_pulse_of_a_millisecond_in_a_second_is_not_missed(integrator, lump):
    """500 N for 1 ms, given by an expression that jumps and its instants as breakpoints: 0.5 N s on 2 kg.

    The pulse may belong to its ends or not; of two bodies one is pushed, and a torque turns the other by as much.
    """
    for begins, ends in (("TIME - 0.4", "TIME - 0.401"), ("TIME - 0.4 - 1E-15", "TIME - 0.401 - 1E-15")):
        m = Mechanism("pushed")
        push = f"500*(IF({begins}: 0, 1, 1) - IF({ends}: 0, 1, 1))"
        slide = m.body("slide", 2.0, (1.0, 1.0, 1.0))
        wheel = m.body("wheel", 2.0, (1.0, 1.0, 2.0))
        m.translational("rail", slide, m.ground, axis=(0, 0, 1))
        m.revolute("axle", wheel, m.ground, axis=(0, 0, 1))
        m.axis_force("push", slide.marker(), m.ground.marker(), push)
        m.axis_torque("turn", wheel.marker(), m.ground.marker(), push)
        solution = m.simulate(1.0, integrator=integrator, tol=1e-7, breakpoints=[0.4, 0.401], lump=lump)
        assert solution.success, solution.message
        np.testing.assert_allclose(solution.com_velocity("slide")[-1], [0, 0, 0.25], atol=2e-6)
        np.testing.assert_allclose(solution.angular_velocity("wheel")[-1], [0, 0, 0.25], atol=2e-6)


@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
def test_a_motion_whose_acceleration_jumps_between_breakpoints(integrator):
    """A crank that is driven faster for 2 ms only: 0.5 a t^2 with a = 2e4 rad/s^2, then on at its speed of 40 rad/s."""
    m = Mechanism("driven")
    crank = m.body("crank", 2.0, (1.0, 1.0, 2.0), com=(0.1, 0, 0))
    axle = m.revolute("axle", crank, m.ground, axis=(0, 0, 1))
    m.rotation("drive", axle, "1E4*(MAX(0, TIME - 0.4)**2 - MAX(0, TIME - 0.402)**2)")
    solution = m.simulate(1.0, integrator=integrator, tol=1e-7, breakpoints=[0.4, 0.402])
    assert solution.success, solution.message
    assert solution.angular_velocity("crank")[-1, 2] == pytest.approx(40.0, abs=2e-5)


def driven(way, velocity: float, push="0") -> Mechanism:
    m = Mechanism("slide")
    sled = m.body("sled", 2.0, (1, 1, 1), velocity=(velocity, 0, 0))
    guide = m.translational("guide", sled, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.axis_force("push", guide.i, guide.j, push)
    m.translation("drive", guide, way)
    return m


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
def test_reactions_at_both_ends_of_a_run_are_those_of_the_inside(integrator, formulation):
    """Also where a table, or an expression, begins or ends there, and where it goes on."""
    options = {"integrator": integrator, "formulation": formulation}
    ending = polyline_integral([0, 1], [1, 3], rounding=0)
    for way, acceleration in (
        (ending, 2.0),
        (polyline_integral([-1, 2], [-1, 5], rounding=0), 2.0),
        (expression("TIME + 1.5*MAX(0, TIME)**2 - 1.5*MAX(0, TIME - 1)**2"), 3.0),
    ):
        solution = driven(way, 1.0).simulate(1.0, rate=10.0, **options)
        np.testing.assert_allclose(solution.com_acceleration("sled")[:, 0], acceleration, rtol=1e-9)
        for part in (solution, next(driven(way, 1.0).simulate(1.0, rate=10.0, **options).parts())):
            np.testing.assert_allclose(part.reaction("drive")[0][:, 0], 2.0 * acceleration, rtol=1e-9)
    # within a run either side may be meant
    longer = driven(ending, 1.0).simulate(2.0, rate=2.0, **options).com_acceleration("sled")[:, 0]
    np.testing.assert_allclose(longer[[0, 1, 3, 4]], [2.0, 2.0, 0.0, 0.0], atol=1e-9)


def test_loads_and_kinematics_at_both_ends_are_those_of_the_inside():
    """A push that is there in between, and motions without an integrator; parts that are handed on know the ends."""
    way = polyline_integral([0, 1], [1, 3], rounding=0)
    pushed = driven(way, 1.0, "IF(TIME: 0, 0, IF(TIME - 1: 7, 0, 0))")
    solution = pushed.simulate(1.0, rate=4.0)
    np.testing.assert_allclose(solution.load("push")[0][:, 0], 7.0)
    np.testing.assert_allclose(solution.reaction("drive")[0][:, 0], 4.0 - 7.0, rtol=1e-9)
    handed: list[np.ndarray] = []
    pushed.simulate(1.0, every_step=True, consumer=lambda part: handed.append(part.load("push")[0][:, 0].copy()))
    np.testing.assert_allclose(np.concatenate(handed), 7.0)
    moved = kinematic(driven(way, 1.0), np.linspace(0.0, 1.0, 5))
    np.testing.assert_allclose(moved.reaction("drive")[0][:, 0], 4.0, rtol=1e-9)
    # where nothing jumps the ends are evaluated as they are, to the last digit
    smooth = driven(harmonic(0.3, 5.0), 1.5).simulate(1.0, rate=4.0)
    here = smooth.com_acceleration("sled").copy()
    smooth.inside = {}
    np.testing.assert_array_equal(
        next(smooth.over(smooth.t, smooth.result.y, smooth.result.epochs).parts())._acc[:, 0, :3], here
    )
