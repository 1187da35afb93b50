"""Joint friction against closed forms and equations of Coulomb's law, by joint, formulation and integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gearmbs.dae import Status
from gearmbs.mechanism import Mechanism, ModelError, static_equilibrium
from tests.says import says

G = 9.81
SLIDING = {"effect": "sliding", "stiction_transition_velocity": 1e-4}


def block(angle: float, **friction):
    m = Mechanism("incline", gravity=(0, 0, -G))
    body = m.body("block", 2.0, (0.1, 0.1, 0.1))
    rail = m.translational("rail", body, m.ground, axis=(np.cos(angle), 0, -np.sin(angle)))
    m.friction("friction", rail, 0.5, 0.3, **friction)
    return m


def along(solution, angle: float) -> np.ndarray:
    return solution.com_position("block") @ np.array([np.cos(angle), 0, -np.sin(angle)])


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
def test_block_on_an_incline_holds_below_the_angle_of_friction(formulation, integrator):
    """tan 0.4 = 0.42 < 0.5: after the deformation of the surfaces, of the order of 10 um, nothing moves."""
    solution = block(0.4).simulate(1.0, formulation=formulation, integrator=integrator, tol=1e-7)
    assert solution.success, solution.message
    s = along(solution, 0.4)
    assert 0.0 < s[-1] < 3e-5
    assert abs(s[-1] - s[250]) < 1e-8
    # the friction carries m g sin
    assert np.linalg.norm(solution.load("friction")[0][-1]) == pytest.approx(2 * G * np.sin(0.4), rel=1e-6)


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
def test_block_slides_above_the_angle_of_friction(formulation, integrator):
    """tan 0.6 = 0.68 > 0.5: a = g (sin - mu_d cos), but for the first 1.5 mm/s."""
    solution = block(0.6).simulate(1.0, formulation=formulation, integrator=integrator, tol=1e-7)
    rate = G * (np.sin(0.6) - 0.3 * np.cos(0.6))
    velocity = np.linalg.norm(solution.com_velocity("block"), axis=1)
    np.testing.assert_allclose(np.diff(velocity[100:]) / np.diff(solution.t[100:]), rate, rtol=2e-5)
    assert along(solution, 0.6)[-1] == pytest.approx(0.5 * rate, rel=3e-3)


def test_without_deformation_the_block_creeps():
    """mu(V) = mu_s V (3 - V^2/v_s^2)/(2 v_s) equals tan 0.4 at one speed, at which the block creeps."""
    solution = block(0.4, max_stiction_deformation=0.0).simulate(1.0, tol=1e-8)
    creep = 1e-3 * min(np.roots([-1, 0, 3, -2 * np.tan(0.4) / 0.5]).real, key=lambda x: abs(x - 0.6))
    assert np.linalg.norm(solution.com_velocity("block")[-1]) == pytest.approx(creep, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("deformation", [0.0, 1e-6])
def test_pendulum_with_a_dry_pin(deformation):
    """Swings of I a'' = -g L sin a -+ mu r |R|, R the pin force, integrated by half swings of one sign each."""
    mu, r, inertia = 0.2, 0.05, 1.01
    m = Mechanism("pendulum", gravity=(0, 0, -G))
    body = m.body("bob", 1.0, (0.01, 0.01, 0.01), position=(np.sin(0.5), 0, -np.cos(0.5)))
    pin = m.revolute("pin", body, m.ground, at=(0, 0, 0), axis=(0, -1, 0))
    options = {"stiction_transition_velocity": 1e-4, "max_stiction_deformation": deformation}
    m.friction("friction", pin, mu, mu, pin_radius=r, **options)
    solution = m.simulate(4.5, rate=400, tol=1e-9)
    assert solution.success, solution.message
    angle = np.arctan2(solution.com_position("bob")[:, 0], -solution.com_position("bob")[:, 2])

    def swing(sign):
        def rate(_, y):
            turn = 0.0
            for _ in range(40):
                reaction = np.hypot(y[1] ** 2 + G * np.cos(y[0]), turn + G * np.sin(y[0]))
                turn = (-G * np.sin(y[0]) - sign * mu * r * reaction) / inertia
            return [y[1], turn]

        return rate

    expected, start = [], 0.5
    for k in range(4):
        sign = -1.0 if k % 2 == 0 else 1.0
        stop = lambda t, y, sign=sign: y[1] * sign + (1e-3 if t < 0.1 else 0.0)  # noqa: E731
        stop.terminal, stop.direction = True, -1
        start = solve_ivp(swing(sign), (0, 3), [start, 0.0], events=stop, rtol=1e-11, atol=1e-12).y[0, -1]
        expected.append(start)
    turning = np.flatnonzero(np.diff(np.sign(np.diff(angle)))) + 1
    np.testing.assert_allclose(angle[turning[:4]], expected, atol=5e-5)


def test_torsional_vibration_loses_twice_the_friction_over_the_stiffness_each_half_swing():
    """Constant torque T of a preloaded pin against a spring k: turning points a0 - 2 n T/k, then it sticks."""
    m = Mechanism("torsion")
    a0 = 0.5
    wheel = m.body(
        "wheel",
        1.0,
        (0.1, 0.1, 0.2),
        orientation=[[np.cos(a0), -np.sin(a0), 0], [np.sin(a0), np.cos(a0), 0], [0, 0, 1]],
    )
    i, j = wheel.marker(name="i"), m.ground.marker(name="j")
    pin = m.joint("revolute", "pin", i, j)
    m.torsion_spring("spring", i, j, stiffness=20.0)
    m.friction("friction", pin, 0.3, 0.3, pin_radius=0.02, preload_torque=1.2, stiction_transition_velocity=1e-5,
               max_stiction_deformation=1e-8, inputs=("preload",))  # fmt: skip
    solution = m.simulate(3.0, rate=1000, tol=1e-9)
    angle = np.unwrap(np.arctan2(solution.orientation("wheel")[:, 1, 0], solution.orientation("wheel")[:, 0, 0]))
    turning = np.flatnonzero(np.diff(np.sign(np.diff(angle)))) + 1
    # 2 T / k = 0.12: 0.5, -0.38, 0.26, -0.14, 0.02, where 20 * 0.02 < 1.2 holds
    np.testing.assert_allclose(angle[turning[:3]], [-0.38, 0.26, -0.14], atol=2e-4)
    assert angle[-1] == pytest.approx(0.02, abs=2e-4)
    assert np.ptp(angle[2500:]) < 1e-7


def test_cylindrical_joint_shares_its_friction_between_slide_and_turn():
    """With I = m r^2 the slip keeps its direction: V falls by mu g, the body stops after V^2/(2 mu g)."""
    r, mu = 0.1, 0.3
    m = Mechanism("rod", gravity=(0, 0, -G))
    body = m.body("rod", 2.0, (0.02, 0.02, 2.0 * r * r), orientation=[[0, 0, 1], [1, 0, 0], [0, 1, 0]],
                  velocity=(0.6, 0, 0), angular_velocity=(8.0, 0, 0))  # fmt: skip
    guide = m.cylindrical("guide", body, m.ground, axis=(1, 0, 0))
    m.friction(
        "friction", guide, mu, mu, pin_radius=r, stiction_transition_velocity=1e-5, max_stiction_deformation=1e-8
    )
    solution = m.simulate(0.5, rate=1000, tol=1e-9)
    # V = hypot(0.6, 0.8) = 1
    time = 1.0 / (mu * G)
    t = np.minimum(solution.t, time)
    np.testing.assert_allclose(solution.com_position("rod")[:, 0], 0.6 * (t - mu * G * t**2 / 2), atol=2e-6)
    np.testing.assert_allclose(solution.angular_velocity("rod")[:, 0], 8.0 * (1 - mu * G * t), atol=2e-4)


def test_spherical_joint_brakes_a_spinning_body():
    """Hung at its centre of mass: I w' = -mu r m g, the axis stays."""
    m = Mechanism("ball", gravity=(0, 0, -G))
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    body = m.body("ball", 3.0, (0.1, 0.1, 0.1), angular_velocity=4.0 * axis)
    socket = m.spherical("socket", body, m.ground)
    m.friction("friction", socket, 0.4, 0.2, ball_radius=0.03, stiction_transition_velocity=1e-4,
               max_stiction_deformation=1e-7)  # fmt: skip
    solution = m.simulate(1.0, tol=1e-9)
    speed = 4.0 - 0.2 * 0.03 * 3.0 * G / 0.1 * solution.t
    np.testing.assert_allclose(solution.angular_velocity("ball"), speed[:, None] * axis, atol=2e-4)


@pytest.mark.parametrize("kind", ["translational", "cylindrical"])
def test_friction_force_has_a_limit(kind):
    """mu m g = 5.9 N, but at most 2 N: the body stops with 1 m/s^2."""
    m = Mechanism("rail", gravity=(0, 0, -G))
    body = m.body("body", 2.0, (0.1, 0.1, 0.1), velocity=(0.5, 0, 0))
    rail = m.joint(kind, "rail", body, m.ground, axis=(1, 0, 0))
    radius = {"pin_radius": 0.1} if kind == "cylindrical" else {}
    m.friction("friction", rail, 0.3, 0.3, max_force=2.0, **radius, **SLIDING)
    solution = m.simulate(0.4, rate=100, tol=1e-8)
    np.testing.assert_allclose(solution.com_velocity("body")[:, 0], 0.5 - solution.t, atol=1e-6)


@pytest.mark.parametrize("kind", ["revolute", "spherical"])
def test_friction_torque_has_a_limit(kind):
    """mu r m g = 0.18 N m, but at most 0.05: w falls by 0.5 rad/s^2 about its own axis."""
    m = Mechanism("ball", gravity=(0, 0, -G))
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    body = m.body("ball", 3.0, (0.1, 0.1, 0.1), angular_velocity=4.0 * axis)
    joint = m.joint(kind, "joint", body, m.ground, axis=axis)
    m.friction("friction", joint, 0.2, 0.2, ball_radius=0.03, pin_radius=0.03, max_torque=0.05, **SLIDING)
    solution = m.simulate(1.0, rate=100, tol=1e-8)
    np.testing.assert_allclose(solution.angular_velocity("ball"), (4.0 - 0.5 * solution.t)[:, None] * axis, atol=1e-5)


@pytest.mark.slow
def test_static_analyses_warn_of_friction():
    """A block held by friction alone has no equilibrium without; one that friction holds already stays."""
    held = block(0.4)
    with pytest.warns(UserWarning, match=says("static", "take part")):
        with pytest.raises(ModelError, match="free to move"):
            static_equilibrium(held)


@pytest.mark.parametrize("yoke", ["i", "j"])
def test_universal_joint_brakes_one_of_its_arms(yoke):
    """A body hung at its centre turns about one arm: torque mu (r F_radial + a F_axial) against it."""
    m = Mechanism("cross", gravity=(3.0, -4.0, -12.0))
    axis = {"i": (1.0, 0, 0), "j": (0, 1.0, 0)}[yoke]
    body = m.body("yoke", 2.0, (0.1, 0.1, 0.1), angular_velocity=axis)
    arms = body.marker(axis=(1, 0, 0), name="arm i"), m.ground.marker(axis=(0, 1, 0), name="arm j")
    joint = m.joint("universal", "cross", *arms)
    m.friction("friction", joint, 0.3, 0.2, pin_radius=0.05, friction_arm=0.02, yoke=yoke, **SLIDING)
    solution = m.simulate(0.05, rate=1000, tol=1e-8)
    axial, radial = {"i": (6.0, np.hypot(8, 24)), "j": (8.0, np.hypot(6, 24))}[yoke]
    expected = -0.2 * (0.05 * radial + 0.02 * axial) * np.array(axis)
    np.testing.assert_allclose(solution.load("friction")[1][0], expected, rtol=1e-6)
    np.testing.assert_allclose(
        solution.angular_velocity("yoke")[-1] - axis, expected / 0.1 * 0.05, rtol=2e-3, atol=1e-4
    )


def pushed_slide(change: str) -> Mechanism:
    """Return a slide pushed with 30 N at 0.2 m above its rail, with its weight 0.1 m beside it."""
    m = Mechanism("slide", gravity=(0, 0, -G))
    body = m.body("slide", 2.0, (0.1, 0.1, 0.1), position=(0, 0.1, 0))
    rail = m.joint(
        "translational",
        "rail",
        body.marker((0, -0.1, 0), axis=(1, 0, 0), name="i"),
        m.ground.marker(axis=(1, 0, 0), name="j"),
    )
    m.friction("friction", rail, 0.3, 0.1, reaction_arm=0.25, overlap=0.5, overlap_change=change, **SLIDING)
    m.load("push", body.marker((0, -0.1, 0.2), name="push"), m.ground.marker(name="base"), fx="30")
    return m


@pytest.mark.parametrize("change", ["constant", "increasing", "decreasing"])
def test_moments_press_a_slide(change):
    """N = m g + T_bend/overlap + T_turn/arm, until the slide jams where the overlap has gone."""
    solution = pushed_slide(change).simulate(0.25, rate=500, tol=1e-8)
    assert solution.success, solution.message
    x = solution.com_position("slide")[:, 0]
    overlap = 0.5 + {"constant": 0.0, "increasing": 1.0, "decreasing": -1.0}[change] * x
    # bending: about y 30 * 0.2 and, since the push and friction act 0.1 m from the centre, about z m a 0.1
    a = solution.com_acceleration("slide")[:, 0]
    bending = np.hypot(30 * 0.2, 2.0 * a * 0.1)
    normal = 2 * G + bending / overlap + 2 * G * 0.1 / 0.25
    np.testing.assert_allclose(2.0 * a[5:], (30 - 0.1 * normal)[5:], rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("tol", [1e-7, 1e-8])
def test_a_slide_that_jams_ends_the_run(tol):
    """Friction's part 0.1 * 0.1 m |a|/overlap reaches m |a| where the overlap is 0.01 m: no motion goes beyond."""
    solution = pushed_slide("decreasing").simulate(0.4, rate=500, tol=tol)
    assert solution.status in (Status.STALLED, Status.TOO_MANY_REJECTIONS)
    assert "u_x(slide)" in solution.message
    assert 0.27 < solution.t[-1] < 0.28
    assert 0.48 < solution.com_position("slide")[-1, 0] < 0.49


def test_friction_in_a_linkage_with_redundant_joints():
    """The multipliers of removed rows are no unknowns; the others move up. Friction takes the energy out."""
    m = Mechanism("four-bar", gravity=(0, -G, 0))
    points = [(0, 0, 0), (0.5, 1, 0), (2, 1.2, 0), (2, 0, 0)]
    bars = []
    for k in range(3):
        a, b = np.array(points[k]), np.array(points[k + 1])
        bars.append(m.body(f"bar{k + 1}", 1.0, (0.1, 0.1, 0.1), position=(a + b) / 2))
    chain = [m.ground, *bars, m.ground]
    pins = [m.revolute(f"pin{k + 1}", chain[k + 1], chain[k], at=p, axis=(0, 0, 1)) for k, p in enumerate(points)]
    for k in (1, 3):
        m.friction(f"friction{k}", pins[k], 0.3, 0.2, pin_radius=0.1, stiction_transition_velocity=1e-3)
    solution = m.simulate(1.0, rate=2000, tol=1e-8)
    assert solution.success, solution.message
    assert len(solution.system.report.redundant) == 3
    balance = solution.energy_balance()
    assert float(balance.dissipated_joint_friction[-1]) > 0.1
    assert not balance.work_applied.any()
    assert balance.attrs["relative_imbalance"] < 1e-4
    # the torque in pin2 is mu r |F|, F its own reaction across the axis
    force = solution.reaction("pin2")[0]
    torque = np.abs(solution.load("friction1")[1][:, 2])
    np.testing.assert_allclose(torque[500:], 0.02 * np.linalg.norm(force[500:, :2], axis=1), rtol=1e-5)


def test_a_load_may_depend_on_a_reaction():
    """A brake of half the pin's force at radius 0.1 on a wheel hung at its centre: constant deceleration."""
    m = Mechanism("brake", gravity=(0, 0, -G))
    wheel = m.body("wheel", 2.0, (0.1, 0.1, 0.2), angular_velocity=(0, 5.0, 0), orientation=(0.0, np.pi / 2, 0.0))
    pin = m.joint(
        "revolute",
        "pin",
        wheel.marker(axis=wheel.orientation.T @ (0, 1, 0), name="i"),
        m.ground.marker(axis=(0, 1, 0), name="j"),
    )
    m.axis_torque("brake", pin.i, pin.j, "-0.05*JOINT(pin,0,1) + 0.01*JOINT(pin,1,4,j) + 0*FX(i,j)")
    solution = m.simulate(1.0, tol=1e-9)
    moment = (wheel.orientation.T @ (0, 1, 0)) @ wheel.inertia @ (wheel.orientation.T @ (0, 1, 0))
    rate = -0.05 * 2 * G / moment
    np.testing.assert_allclose(solution.angular_velocity("wheel")[:, 1], 5.0 + rate * solution.t, atol=1e-7)


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("fixed", {}, says("revolute", "translational")),
        ("revolute", {}, "pin_radius is needed"),
        ("spherical", {}, "ball_radius is needed"),
        ("revolute", {"pin_radius": -1.0}, "pin_radius = -1.0"),
        ("revolute", {"radius": 1.0}, says("'radius'", "mu_static")),
        ("revolute", {"effect": "none"}, says("effect = 'none'", "choose")),
        ("revolute", {"inputs": ("weight",)}, "inputs has 'weight'"),
        (
            "revolute",
            {"stiction_transition_velocity": 0.0},
            says("friction 'friction'", "stiction_transition_velocity", "positive"),
        ),
        ("revolute", {"max_torque": 0.0}, "max_torque must be positive"),
    ],
)
def test_errors_name_the_parameter(kind, options, words):
    m = Mechanism("m")
    joint = m.joint(kind, "joint", m.body("b", 1.0, (1, 1, 1)), m.ground)
    with pytest.raises(ModelError, match=words):
        m.friction("friction", joint, 0.3, 0.2, **options)


@pytest.mark.parametrize("kind", ["revolute", "translational", "cylindrical", "spherical", "universal"])
@pytest.mark.parametrize("deformation", [0.0, 0.01])
def test_the_kernel_agrees_with_the_function_language(kind, deformation):
    """Decks have the friction as expressions, on which a second body moves exactly as with the kernel."""
    from gearmbs.adams import parse_deck, write_deck

    def swinging(looked_into: bool) -> Mechanism:
        m = Mechanism("dry", gravity=(1, 2, -9.81))
        body = m.body("body", 1.0, (0.1, 0.2, 0.3), position=(0.3, 0, 0), angular_velocity=(0.5, 1, 0.5))
        i = body.marker((-0.3, 0, 0), axis=(0, 1, 0), name="i")
        j = m.ground.marker(axis=(1, 0, 0) if kind == "universal" else (0, 1, 0), name="j")
        lengths = {"pin_radius": 0.05, "friction_arm": 0.02, "bending_arm": 0.2, "ball_radius": 0.03, "overlap": 2.0,
                   "overlap_change": "decreasing", "reaction_arm": 0.3}  # fmt: skip
        m.friction("dry", m.joint(kind, "pin", i, j), 0.3, 0.2, preload_force=0.1, preload_torque=0.02,
                   stiction_transition_velocity=0.05, max_stiction_deformation=deformation, **lengths)  # fmt: skip
        if looked_into:
            m.axis_torque("nothing", i, j, '0*VARVAL("dry.speed")')
        return m

    text = write_deck(swinging(True))
    assert "FRICTION/" not in text
    assert ("DIFF/" in text) == (deformation > 0.0)
    one, two = (m.simulate(0.2, rate=50, tol=1e-9) for m in (swinging(False), parse_deck(text).to_mechanism()))
    np.testing.assert_allclose(two.com_position("body"), one.com_position("body"), atol=1e-8)
    for part in range(2):
        np.testing.assert_allclose(two.load("dry")[part], one.load("dry")[part], atol=2e-7)
