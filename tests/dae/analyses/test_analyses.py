"""Static equilibrium, linear modes and kinematics against closed solutions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from gearmbs.mechanism import Mechanism, ModelError, SingularModelError, polynomial
from gearmbs.mechanism.solve.analyses import kinematic, linear_modes, quasi_static, static_equilibrium
from tests.says import says

G = 9.81


def hanging(k: float = 200.0, c: float = 0.0, mass: float = 2.0) -> Mechanism:
    m = Mechanism("hanging mass", gravity=(0, 0, -G))
    block = m.body("block", mass, (0.1, 0.1, 0.1))
    m.translational("guide", block, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    i, j = block.marker(name="tip"), m.ground.marker(name="anchor")
    m.axis_force("spring", i, j, f"-{k}*DZ(tip,anchor,anchor) - {c}*VZ(tip,anchor,anchor)")
    return m


def pendulum(angle: float, *, mass: float = 1.5, length: float = 0.8, inertia: float = 0.02, kt: float = 0.0):
    """A rod hanging from the origin, turned by ``angle`` from the vertical about y."""
    m = Mechanism("pendulum", gravity=(0, 0, -G))
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    rod = m.body("rod", mass, (inertia,) * 3, position=turn @ (0, 0, -length), orientation=turn)
    pin_i = rod.marker((0, 0, length), axis=(0, 1, 0), name="pin_i")
    pin_j = m.ground.marker((0, 0, 0), axis=(0, 1, 0), name="pin_j")
    m.joint("revolute", "pin", pin_i, pin_j)
    if kt:
        free = 0.7
        m.torsion_spring("spring", pin_i, pin_j, stiffness=kt, angle=free)
    return m


def swing(result, body: str = "rod") -> float:
    """Angle of a rod from the vertical about y."""
    x, _, z = result.com_position(body)
    return float(np.arctan2(-x, -z))


def test_hanging_mass_sinks_by_weight_over_stiffness():
    found = static_equilibrium(hanging())
    # k z = -m g
    assert found.com_position("block") == pytest.approx([0, 0, -2.0 * G / 200.0], abs=1e-12)
    assert found.loads["spring"][0][2] == pytest.approx(2.0 * G, rel=1e-12)
    assert found.reactions["guide"][0] == pytest.approx([0, 0, 0], abs=1e-9)
    assert found.stable
    assert not found.neutral
    assert found.residual < 1e-10


@pytest.mark.parametrize("start", [np.pi / 2, -0.3, 2.8, 3.1])
def test_pendulum_comes_to_rest_below_its_pin(start):
    mechanism = pendulum(start)
    found = static_equilibrium(mechanism)
    assert found.com_position("rod") == pytest.approx([0, 0, -0.8], abs=1e-8)
    assert found.marker_position(mechanism.joints["pin"].i) == pytest.approx([0, 0, 0], abs=1e-8)
    assert found.marker_position(mechanism.bodies["rod"]) == pytest.approx([0, 0, -0.8], abs=1e-8)
    # the pin carries the weight
    assert found.reactions["pin"][0] == pytest.approx([0, 0, 1.5 * G], abs=1e-8)
    assert found.stable


def test_pendulum_with_torsion_spring_balances():
    kt = 6.0
    found = static_equilibrium(pendulum(0.2, kt=kt))
    # kt (phi - 0.7) = -m g l sin(phi)
    phi = brentq(lambda a: kt * (a - 0.7) + 1.5 * G * 0.8 * np.sin(a), -1.0, 2.0, xtol=1e-15)
    assert swing(found) == pytest.approx(phi, abs=1e-11)


@pytest.mark.slow
def test_body_without_support_is_named():
    m = Mechanism("two", gravity=(0, 0, -G))
    m.body("held", 1.0, (0.1, 0.1, 0.1))
    m.fixed("weld", m.bodies["held"], m.ground)
    m.body("stone", 1.0, (0.1, 0.1, 0.1))
    with pytest.raises(SingularModelError, match=says("'stone'", "0", "1")):
        static_equilibrium(m)


def test_neutral_motion_is_named_but_accepted():
    m = hanging()
    wheel = m.body("wheel", 1.0, (0.1, 0.1, 0.1), position=(1, 0, 0))
    m.revolute("axle", wheel, m.ground, at=(1, 0, 0), axis=(0, 0, 1))
    found = static_equilibrium(m)
    assert found.neutral == ["wheel"]
    assert found.stable


def test_simulation_from_equilibrium_stays():
    m = pendulum(0.9, kt=6.0)
    found = static_equilibrium(m, move=True)
    solution = m.simulate(0.5, tol=1e-8)
    assert np.abs(solution.com_position("rod") - found.com_position("rod")).max() < 1e-9


def test_motions_are_frozen_at_the_given_time():
    m = pendulum(0.0)
    m.rotation("drive", m.joints["pin"], polynomial([0.0, 0.5]))
    found = static_equilibrium(m, t=1.0)
    assert swing(found) == pytest.approx(0.5, abs=1e-11)
    # the motion holds the moment of the weight
    assert abs(found.reactions["drive"][1][1]) == pytest.approx(1.5 * G * 0.8 * np.sin(0.5), rel=1e-9)


def test_states_that_follow_time_alone_keep_their_value():
    m = hanging()
    m.differential_state("drive", "2", start=0.25)
    found = static_equilibrium(m)
    assert found.com_position("block")[2] == pytest.approx(-2.0 * G / 200.0, abs=1e-12)
    assert found.solution.result.y[0, -1] == 0.25


def test_pendulum_frequency():
    found = linear_modes(pendulum(0.0))
    # omega^2 = m g l / (m l^2 + J)
    omega = np.sqrt(1.5 * G * 0.8 / (1.5 * 0.64 + 0.02))
    assert found.eigenvalues == pytest.approx([1j * omega], rel=1e-10)
    assert found.frequencies == pytest.approx([omega / 2 / np.pi], rel=1e-10)
    assert found.kinds == ["oscillating"]


def test_upright_pendulum_is_unstable():
    found = linear_modes(pendulum(np.pi))
    omega = np.sqrt(1.5 * G * 0.8 / (1.5 * 0.64 + 0.02))
    assert sorted(found.eigenvalues.real) == pytest.approx([-omega, omega], rel=1e-9)
    assert not found.stable


def test_simple_pendulum_is_square_root_of_g_over_l():
    found = linear_modes(pendulum(0.0, inertia=1e-9))
    assert found.frequencies[0] == pytest.approx(np.sqrt(G / 0.8) / 2 / np.pi, rel=1e-8)


def test_double_pendulum():
    m = Mechanism("double", gravity=(0, 0, -G))
    a = m.body("a", 1.0, (1e-12,) * 3, position=(0, 0, -1.0))
    b = m.body("b", 1.0, (1e-12,) * 3, position=(0, 0, -2.0))
    m.revolute("p", a, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.revolute("q", b, a, at=(0, 0, -1.0), axis=(0, 1, 0))
    found = linear_modes(m)
    # two equal masses and lengths: omega^2 = (2 -+ sqrt 2) g / l; x_b / x_a = 1 +- sqrt 2
    assert (2 * np.pi * found.frequencies) ** 2 == pytest.approx([(2 - 2**0.5) * G, (2 + 2**0.5) * G], rel=1e-9)
    ratio = found.shapes[:, 1, 0] / found.shapes[:, 0, 0]
    assert ratio == pytest.approx([1 + 2**0.5, 1 - 2**0.5], rel=1e-8)


def test_damped_oscillator():
    k, c, mass = 200.0, 3.0, 2.0
    found = linear_modes(hanging(k, c, mass), at="equilibrium")
    # s = -c/2m +- i sqrt(k/m - (c/2m)^2)
    decay = c / (2 * mass)
    assert found.eigenvalues == pytest.approx([-decay + 1j * np.sqrt(k / mass - decay**2)], rel=1e-10)
    assert found.damping_ratios == pytest.approx([decay / np.sqrt(k / mass)], rel=1e-10)
    assert "oscillating" in found.table()


def test_overdamped_oscillator_has_two_real_modes():
    found = linear_modes(hanging(200.0, 100.0, 2.0))
    # s^2 + 50 s + 100 = 0
    assert sorted(found.eigenvalues.real) == pytest.approx(sorted(np.roots([1, 50, 100])), rel=1e-9)
    assert found.kinds == ["real", "real"]
    assert not found.oscillating.size
    assert np.all(np.isnan(found.frequencies))
    assert "no modes: real eigenvalues" in found.table()
    assert repr(found) == "Modes(2 without oscillation, stable)"


def test_free_body_has_six_rigid_modes():
    m = Mechanism("free")
    m.body("b", 1.0, (0.1, 0.2, 0.3))
    found = linear_modes(m)
    assert found.kinds == ["rigid"] * 6
    assert np.all(found.frequencies == 0.0)


def wound(axes: np.ndarray, torque: float, kind: str) -> Mechanism:
    """A body turned about its pin's z by a torque on springs that count full turns; all of it placed by ``axes``."""
    m = Mechanism("wound")
    body = m.body("body", 1.0, (0.2, 0.3, 0.25), orientation=axes)
    m.spherical("pin", body, m.ground, at=(0, 0, 0))
    i, j = body.marker(name="I"), m.ground.marker((0, 0, 0), axes, name="J")
    if kind == "bushing":
        m.bushing("seat", i, j, stiffness=(0, 0, 0), torsional_stiffness=(50, 60, 5))
    else:
        m.load("spring", i, m.ground.marker((0, 0, 0), name="reaction"), tz="-5 * AZ(I, J)", rm=j)
        tip, held = body.marker((0, 0, 1)), m.ground.marker(axes @ (0, 0, 3))
        m.spring_damper("stay", tip, held, stiffness=60.0, length=1.0)
    m.load("drive", body.marker(name="end"), m.ground.marker((0, 0, 0), name="base"), tz=str(torque), rm=j)
    return m


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["bushing", "load"])
@pytest.mark.parametrize("torque", [10.0, 20.0, 20.0 + 10.0 * np.pi], ids=["no turn", "past half", "one turn more"])
def test_modes_at_an_equilibrium_keep_its_counted_turns(torque, kind):
    """About z sqrt(5 / 0.25); sideways stays of 60 N * 3 m, or springs with K = diag(50, 60) turned by torque / 5."""
    aslant = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
    aslant *= np.linalg.det(aslant)
    if kind == "load":
        expected = np.sqrt([20.0, 60.0 * 1.5 / 0.3, 60.0 * 1.5 / 0.2])
    else:
        expected = {10.0: [4.4721, 13.0562, 17.1265]}.get(torque, [4.4721, 13.3004, 16.8121])
    for axes in (np.eye(3), aslant):
        m = wound(axes, torque, kind)
        rest = static_equilibrium(m)
        ways = [linear_modes(m, at=rest), linear_modes(m, at="equilibrium")]
        static_equilibrium(m, move=True)
        ways.append(linear_modes(m))
        for found in ways:
            assert np.abs(found.eigenvalues) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("stiffness", [1e6, 1e9, 1e12])
def test_a_slow_mode_is_found_beside_fast_ones(stiffness):
    """A pendulum and 10 g on a bushing of up to 1.6 MHz: a ratio of the squares of 1e13."""
    m = pendulum(0.0)
    small = m.body("small", 0.01, (1e-6,) * 3, position=(1, 0, 0))
    here, there = small.marker(name="here"), m.ground.marker((1, 0, 0), name="there")
    m.bushing("seat", here, there, stiffness=[stiffness] * 3, torsional_stiffness=[1e-4 * stiffness] * 3)
    found = linear_modes(m)
    # omega^2 = m g l / (m l^2 + J), k / m, kt / J = 1e-4 k / 1e-6
    slow = np.sqrt(1.5 * G * 0.8 / (1.5 * 0.64 + 0.02))
    fast = np.sqrt(100.0 * stiffness)
    assert found.eigenvalues == pytest.approx([1j * slow] + [1j * fast] * 6, rel=1e-9)
    assert found.kinds == ["oscillating"] * 7
    assert found.stable


def cantilever(count: int, rotary: float, *, held: bool) -> tuple[Mechanism, float]:
    """A steel bar of 1 m x 10 mm x 20 mm as beams between lumps; EI of the easy direction."""
    modulus, b, h = 2.1e11, 0.01, 0.02
    area, easy, hard = b * h, h * b**3 / 12, b * h**3 / 12
    m = Mechanism("bar")
    before = m.ground.marker(name="root") if held else None
    for k in range(count):
        mass = 7800 * area / count * (0.5 if k == count - 1 else 1.0)
        lump = m.body(f"lump{k}", mass, (rotary,) * 3, position=((k + 1) / count, 0, 0))
        here = lump.marker(name=f"m{k}")
        if before is not None:
            moments = (0.229 * h * b**3, hard, easy)
            sizes = {"length": 1 / count, "area": area, "second_moments": moments}
            m.beam(f"beam{k}", here, before, modulus=modulus, shear_modulus=8e10, **sizes)
        before = here
    return m, float(np.sqrt(modulus * easy / (7800 * area)))


@pytest.mark.parametrize("rotary", [1e-6, 1e-9, 1e-12])
def test_cantilever_of_beams_has_no_rigid_mode(rotary):
    """The lumps' rotary inertia makes modes of up to 90 MHz beside the first bending mode of 8.4 Hz."""
    m, wave = cantilever(20, rotary, held=True)
    found = linear_modes(m)
    assert found.kinds == ["oscillating"] * 120
    # Euler and Bernoulli: omega = (1.8751 / l)^2 sqrt(EI / rho A); twice that in the other direction (h = 2 b);
    # 20 lumps are off by their (1 / 20)^2
    first = 1.8751**2 * wave / (2 * np.pi)
    assert found.frequencies[:2] == pytest.approx([first, 2 * first], rel=2.5e-3)
    assert found.stable


def test_free_bar_of_beams_has_six_rigid_modes():
    m, wave = cantilever(20, 1e-9, held=False)
    found = linear_modes(m)
    assert found.kinds == ["rigid"] * 6 + ["oscillating"] * 114
    # free-free: (4.7300 / l)^2, a bar of 19 intervals with a light end
    assert found.frequencies[6] == pytest.approx(4.73**2 * wave / (2 * np.pi), rel=0.06)


def test_rigid_motions_of_damped_and_joined_bodies():
    m = Mechanism("pair")
    a = m.body("a", 1.0, (0.1,) * 3)
    b = m.body("b", 2.0, (0.1,) * 3, position=(1, 0, 0))
    i, j = b.marker((-0.5, 0, 0), name="i"), a.marker((0.5, 0, 0), name="j")
    m.bushing("link", i, j, stiffness=(6e8, 0, 0), damping=(0, 0, 0))
    m.bushing("oil", a.marker(name="k"), m.ground.marker(name="l"), damping=(0, 0.3, 0))
    found = linear_modes(m)
    # stretching: omega^2 = k (1/m_a + 1/m_b) = 9e8; oil: c / m_a = 0.3; all other eleven motions are free
    assert found.kinds == ["rigid"] * 11 + ["damped rigid", "oscillating"]
    assert found.eigenvalues[-2:] == pytest.approx([-0.3, 30000j], rel=1e-9)


def test_spin_of_rounding_size_is_none():
    """A released body that turns at 1e-15 rad/s is as free as one at rest."""
    m = Mechanism("released", gravity=(0, 0, -G))
    m.body("b", 1.0, (0.1, 0.2, 0.25), velocity=(0, 0, -3), angular_velocity=(1e-15, 3e-15, 0))
    assert linear_modes(m).kinds == ["rigid"] * 6


def test_no_degrees_of_freedom_no_modes():
    found = linear_modes(four_bar())
    assert len(found) == 0
    assert found.shapes.shape == (0, 3, 6)
    assert found.stable
    assert "no modes" in str(found)


def test_results_print_what_they_hold():
    rest = static_equilibrium(hanging())
    assert "stable" in repr(rest)
    assert len(repr(rest)) < 120
    assert "block" in str(rest)
    assert "-0.0981" in str(rest)
    modes = linear_modes(hanging())
    assert str(modes) == modes.table()
    assert repr(modes) == "Modes(1 oscillating, 1.59155 to 1.59155 Hz, stable)"


def test_filter_state_adds_its_eigenvalue():
    m = hanging()
    m.differential_state("lag", "-5*DIF(lag)", start=1.0)
    found = linear_modes(m)
    assert found.eigenvalues == pytest.approx([-5.0, 10j], rel=1e-9)


def four_bar() -> Mechanism:
    m = Mechanism("four-bar", gravity=(0, -G, 0))
    a, b, c, d = (np.array(p, dtype=float) for p in ((0, 0, 0), (1, 0, 0), (3, 2, 0), (4, 0, 0)))
    for name, mid in (("crank", (a + b) / 2), ("coupler", (b + c) / 2), ("rocker", (c + d) / 2)):
        m.body(name, 1.0, (0.1, 0.1, 0.1), position=mid)
    crank, coupler, rocker = m.bodies.values()
    drive = m.revolute("A", crank, m.ground, at=a, axis=(0, 0, 1))
    m.revolute("B", coupler, crank, at=b, axis=(0, 0, 1))
    m.revolute("C", rocker, coupler, at=c, axis=(0, 0, 1))
    m.revolute("D", rocker, m.ground, at=d, axis=(0, 0, 1))
    m.rotation("motor", drive, polynomial([0.0, 3.0, 0.5]))
    return m


def test_four_bar_kinematics_close_the_loop():
    m = four_bar()
    t = np.linspace(0.0, 3.0, 61)
    found = kinematic(m, t)
    # crank pin on its circle; joint C is the intersection of two circles, the branch above BD
    angle = 3.0 * t + 0.5 * t**2
    b = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    l2, l3 = np.hypot(2, 2), np.hypot(1, 2)
    to_d = np.array([4.0, 0.0]) - b
    gap = np.linalg.norm(to_d, axis=1)
    along = (l2**2 - l3**2 + gap**2) / (2 * gap)
    up = np.sqrt(l2**2 - along**2)
    unit = to_d / gap[:, None]
    normal = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    c = b + along[:, None] * unit + up[:, None] * normal
    assert found.com_position("coupler")[:, :2] == pytest.approx((b + c) / 2, abs=1e-11)
    assert found.angular_velocity("crank")[:, 2] == pytest.approx(3.0 + t, rel=1e-11)
    assert found.angular_acceleration("crank")[:, 2] == pytest.approx(np.ones(61), rel=1e-8)
    # velocities and accelerations are the derivatives of the positions (central differences)
    fine = kinematic(m, np.array([0.0, 0.999, 1.0, 1.001]))
    x, v = fine.com_position("rocker"), fine.com_velocity("rocker")
    assert v[2] == pytest.approx((x[3] - x[1]) / 0.002, abs=1e-4)
    assert fine.com_acceleration("rocker")[2] == pytest.approx((v[3] - v[1]) / 0.002, abs=1e-3)


def test_kinematics_agree_with_dynamics():
    t = np.linspace(0.0, 1.0, 11)
    a, b = kinematic(four_bar(), t), four_bar().simulate(1.0, t_eval=t, tol=1e-9)
    assert a.reaction("C")[0] == pytest.approx(b.reaction("C")[0], abs=1e-4)
    assert a.com_position("rocker") == pytest.approx(b.com_position("rocker"), abs=1e-7)


def test_kinematics_refuse_degrees_of_freedom():
    with pytest.raises(ModelError, match=says("1", "degrees of freedom")):
        kinematic(pendulum(0.1), np.linspace(0.0, 1.0, 3))


@pytest.mark.slow
def test_kinematics_name_the_time_of_locking():
    m = Mechanism("reach")
    crank = m.body("crank", 1.0, (0.1, 0.1, 0.1))
    rod = m.body("rod", 1.0, (0.1, 0.1, 0.1), position=(0.75, 0.5, 0))
    slide = m.body("slide", 1.0, (0.1, 0.1, 0.1), position=(1.5, 0, 0))
    knee = (0.75, np.sqrt(1.0 - 0.75**2), 0)
    m.revolute("hip", crank, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.revolute("knee", rod, crank, at=knee, axis=(0, 0, 1))
    m.revolute("foot", slide, rod, at=(1.5, 0, 0), axis=(0, 0, 1))
    guide = m.translational("guide", slide, m.ground, at=(1.5, 0, 0), axis=(1, 0, 0))
    m.translation("pull", guide, polynomial([0.0, 1.0]))
    # two unit rods are stretched when the slide has moved from 1.5 m to 2 m
    assert kinematic(m, np.array([0.0, 0.45])).com_position("slide")[-1, 0] == pytest.approx(1.95, abs=1e-12)
    with pytest.raises(ModelError, match=r"t = 0\.(49999|5)"):
        kinematic(m, np.linspace(0.0, 1.0, 5))


DECK = """hanging mass
ACCGRAV/KGRAV=-10
PART/1,GROUND
MARKER/10,PART=1
PART/2,MASS=2,CM=20,IP=1,1,1
MARKER/20,PART=2
JOINT/1,TRANSLATIONAL,I=20,J=10
SFORCE/1,TRANS,I=20,J=10,ACTIONONLY,FUNCTION=-50*DZ(20,10,10)
REQUEST/1,F2=DZ(20,10)\\F3=VZ(20,10)
END
"""


def test_script_with_statics_then_dynamics_and_modes():
    from gearmbs.adams import parse_deck, parse_script
    from gearmbs.adams.results.result import message_text
    from gearmbs.adams.runner import run_deck

    commands = "model\nout\nSIMULATE/STATICS\nLINEAR/EIGENSOL\nSIMULATE/DYNAMICS, END=1, STEPS=4\nSTOP\n"
    result = run_deck(parse_deck(DECK), parse_script(commands))
    # z = -m g / k = -0.4 at rest; omega = sqrt(k / m) = 5
    assert result.success
    assert result.request(1)[:, 1] == pytest.approx(np.full(6, -0.4), abs=1e-9)
    assert result.modes[0].eigenvalues == pytest.approx([5j], rel=1e-9)
    assert "Performing Static Simulation" in message_text(result)


@pytest.mark.slow
def test_quasi_static_sequence_follows_a_driven_crank():
    """A weight hung from a crank that turns three times: it hangs below the crank's end; the drive carries m g cos."""
    m = Mechanism("crane", gravity=(0, 0, -10.0))
    crank = m.body("crank", 1.0, (0.1, 0.1, 0.1))
    pin = m.revolute("pin", crank, m.ground, axis=(0, 1, 0))
    m.rotation("drive", pin, "TIME")
    weight = m.body("weight", 2.0, (0.1, 0.1, 0.1), position=(1, 0, -1))
    m.revolute("hook", weight, crank, at=(1, 0, 0), axis=(0, 1, 0))
    times = np.linspace(0.0, 20.0, 41)
    solution = quasi_static(m, times)
    np.testing.assert_allclose(solution.com_position("weight")[:, 2], -np.sin(times) - 1, atol=1e-9)
    np.testing.assert_allclose(solution.reaction("drive")[1][:, 1], -20.0 * np.cos(times), atol=1e-8)
    with pytest.raises(ModelError, match="increasing times"):
        quasi_static(m, np.array([1.0, 0.0]))


@pytest.mark.slow
def test_quasi_static_snap_through():
    """A weight on a spring between side walls, pushed down: past the flat position it snaps to the other side."""
    m = Mechanism("snap")
    block = m.body("block", 1.0, (1, 1, 1), position=(0, 0, 0.3))
    m.translational("guide", block, m.ground, axis=(0, 0, 1))
    eye, wall = block.marker(name="eye"), m.ground.marker((1, 0, 0), name="wall")
    m.spring_damper("spring", eye, wall, stiffness=1000.0, length=float(np.hypot(1, 0.3)))
    m.load("push", block.marker(name="top"), m.ground.marker(name="base"), fz="-TIME")
    solution = quasi_static(m, np.linspace(0.0, 20.0, 41))
    z = solution.com_position("block")[:, 2]
    # k (1 - l0/l) z + t = 0 on both branches
    length = np.hypot(1, z)
    np.testing.assert_allclose(1000 * (1 - np.hypot(1, 0.3) / length) * z + solution.t, 0.0, atol=1e-6)
    assert z[0] > 0.29
    assert z[-1] < -0.3
    assert np.diff(z).min() < -0.4


def train(rng: np.random.Generator, slow: bool, spin: float) -> tuple[Mechanism, np.ndarray, np.ndarray, np.ndarray]:
    """Return wheels about one axis in space with dampers between them and to the ground, inertias, K and C.

    Some of the dampers to the ground have a soft spring beside them, if ``slow``.
    """
    n, m = int(rng.integers(1, 5)), Mechanism("train")
    axis = rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
    axis = axis / np.linalg.norm(axis)
    inertia, stiffness, damping = 10.0 ** rng.uniform(-2, 2, n), np.zeros((n, n)), np.zeros((n, n))
    pins = []
    for k in range(n):
        wheel = m.body(f"wheel{k}", mass=1.0, inertia=(inertia[k],) * 3, angular_velocity=tuple(spin * axis))
        pins.append(m.revolute(f"pin{k}", wheel, m.ground, at=(0, 0, 0), axis=tuple(axis)))
    held = rng.random(n) < 0.5
    held[rng.integers(n)] |= slow
    ties = [(k, k - 1) for k in range(1, n) if rng.random() < 0.7] + [(int(k), -1) for k in np.flatnonzero(held)]
    for k, other in ties:
        c = 10.0 ** rng.uniform(-2, 2)
        soft = c * 10.0 ** rng.uniform(-5, -3) + 1e-7 * spin**2 * inertia.sum() if slow and other < 0 else 0.0
        m.torsion_spring(
            f"{k} {other}", pins[k].i, pins[k].j if other < 0 else pins[other].i, stiffness=soft, damping=c
        )
        apart = np.eye(n)[k] - (np.eye(n)[other] if other >= 0 else 0.0)
        stiffness += soft * np.outer(apart, apart)
        damping += c * np.outer(apart, apart)
    return m, inertia, stiffness, damping


@pytest.mark.parametrize("number", [*range(60), 168, 176, 342])
def test_motions_that_nothing_but_dampers_resist_are_rigid_and_slow_decays_are_not(number):
    """At any speed, also while dampers brake the wheels: as many as K has null directions, and no others."""
    rng = np.random.default_rng([41, number])
    slow, spin = number % 3 == 0, 10.0 ** rng.uniform(-1, 2.5) if number % 2 == 0 else 0.0
    m, inertia, stiffness, damping = train(rng, slow, spin)
    found = linear_modes(m)
    sizes = np.linalg.eigvalsh(stiffness)
    assert found.kinds.count("rigid") == int(np.sum(sizes <= 1e-12 * sizes[-1]))
    assert found.stable
    n = len(inertia)
    first = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness / inertia[:, None], -damping / inertia[:, None]]])
    rates = np.sort(np.linalg.eigvals(first).real)
    got = np.sort(np.repeat(found.eigenvalues.real, 1 + (found.eigenvalues.imag > 0.0)))
    for s in got[got < 0.0]:
        assert np.abs(rates / s - 1.0).min() < 1e-2


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize(("inertia", "damping"), [(1e6, 1e-6), (1.0, 1e-9), (0.2, 1e-13)])
def test_a_soft_damper_on_a_large_inertia_decays(inertia, damping, beside):
    m = Mechanism("slow")
    wheel = m.body("wheel", mass=1.0, inertia=(inertia,) * 3)
    pin = m.revolute("pin", wheel, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.torsion_spring("damper", pin.i, pin.j, stiffness=0.0, damping=damping)
    if beside:
        m.revolute("free", m.body("base", mass=1.0, inertia=(1.0, 1.0, 1.0)), m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    found = linear_modes(m)
    assert found.kinds == ["rigid"] * (1 + beside) + ["damped rigid"]
    assert found.eigenvalues[-1].real == pytest.approx(-damping / inertia, rel=1e-6)


@pytest.mark.parametrize(("fast", "slow"), [(10.0, 1.0), (300.0, 1.0), (1000.0, 0.5), (1e4, 10.0), (1000.0, 1e-2)])
def test_what_spins_slowly_nutates_beside_what_spins_fast(fast, slow):
    """Two rotors apart: I_t w' = i (I_a Omega) w at right angles to the spin, 2/3 Omega here."""
    m = Mechanism("rotors")
    for name, speed, x in (("fast", fast, 0.0), ("slow", slow, 1.0)):
        rotor = m.body(name, 1.0, (0.03, 0.03, 0.02), position=(x, 0.0, 0.0), angular_velocity=(0.0, 0.0, speed))
        m.spherical(f"{name} end", rotor, m.ground, at=(x, 0.0, 0.0))
    found = linear_modes(m)
    nutations = np.sort(np.abs(found.eigenvalues[found.oscillating].imag))
    np.testing.assert_allclose(nutations, [2.0 / 3.0 * speed for speed in (slow, fast)], rtol=1e-6)


@pytest.mark.parametrize("first", range(0, 60, 15))
def test_chains_in_space_have_the_modes_of_their_springs_and_no_others(first):
    """Free points and bodies on stiff line springs: their lengths are rounding off, which is no stiffness sideways."""
    for seed in range(first, first + 15):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(2, 6))
        masses = np.exp(rng.uniform(np.log(0.003), np.log(80.0), n))
        stiffnesses, decay = 10 ** rng.uniform(4, 9, n - 1), 10 ** rng.uniform(-6, -3)
        points, places = rng.random(n) < 0.5, rng.normal(size=(n, 3))
        m = Mechanism("chain")
        parts = [
            m.point_mass(f"p{k}", mass, at=place)
            if point
            else m.body(f"b{k}", mass, (0.01, 0.011, 0.012), position=place)
            for k, (mass, place, point) in enumerate(zip(masses, places, points))
        ]
        springs = [(k, k + 1, stiffness) for k, stiffness in enumerate(stiffnesses)]
        if seed % 3 == 0:
            # a soft one to the ground has a mode still
            springs.append((0, n, 10 ** rng.uniform(0, 2)))
        at = np.vstack([places, rng.normal(size=3) + 5.0])
        ends = [*(part.marker() for part in parts), m.ground.marker(at[n])]
        stretch = np.zeros((len(springs), n + 1, 3))
        for row, (i, j, stiffness) in zip(stretch, springs):
            m.spring_damper(f"s{i}{j}", ends[i], ends[j], stiffness=stiffness, damping=decay * stiffness)
            row[j] = np.sqrt(stiffness) * (at[j] - at[i]) / np.linalg.norm(at[j] - at[i])
            row[i] = -row[j]
        # M^-1/2 K M^-1/2 = Y^T Y; s^2 + decay w^2 s + w^2 = 0
        half = (stretch[:, :n] / np.sqrt(masses)[:, None]).reshape(len(springs), 3 * n)
        squares = np.linalg.svd(half, compute_uv=False) ** 2
        fast = -0.5 * (decay * squares + np.emath.sqrt((decay * squares) ** 2 - 4.0 * squares))
        wanted = np.concatenate([fast, squares / fast])
        found = linear_modes(m)
        values = np.concatenate([found.eigenvalues, found.eigenvalues[found.oscillating].conj()])
        values = values[values != 0.0]
        assert found.kinds.count("rigid") == int((6 - 3 * points).sum()) - len(springs), seed
        assert values.size == wanted.size, seed
        for value in wanted:
            assert np.abs(values - value).min() <= 1e-6 * abs(value), seed


@pytest.mark.parametrize("seed", range(4))
def test_springs_far_slower_than_the_spin_are_found_about_any_axis(seed):
    """s^2 + 2 D w s + w^2 = 0 about an axis in space, w = 1e-5 and 1e-4 of the spin."""
    rng = np.random.default_rng(seed)
    m, spin, wanted = Mechanism("soft"), 300.0, []
    for k, share in enumerate((1e-5, 1e-4)):
        axis, inertia, ratio = rng.normal(size=3), 10.0 ** rng.uniform(-2, 2), rng.uniform(0.1, 0.9)
        axis /= np.linalg.norm(axis)
        wheel = m.body(f"wheel{k}", 1.0, (inertia,) * 3, angular_velocity=tuple(spin * axis))
        pin = m.revolute(f"pin{k}", wheel, m.ground, at=(0, 0, 0), axis=tuple(axis))
        rate = share * spin
        m.torsion_spring(f"spring{k}", pin.i, pin.j, stiffness=inertia * rate**2, damping=2.0 * ratio * inertia * rate)
        wanted.append(rate * complex(-ratio, np.sqrt(1.0 - ratio**2)))
    found = linear_modes(m)
    assert found.kinds == ["oscillating"] * 2
    np.testing.assert_allclose(found.eigenvalues, wanted, rtol=1e-3)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 11, 37, 48, 49, 65, 72, 98, 105, 111, 113, 125, 143, 461])
def test_what_is_at_rest_neither_swings_nor_decays_beside_what_spins(seed):
    """Free, on a ball and on a pin, in any direction; what spins freely nutates with J_p / J_t = 1.5 of its speed."""
    rng = np.random.default_rng([7, seed])
    m, rigid, nutations, decays = Mechanism("apart", gravity=(0, 0, 0)), 0, [], []
    for k in range(int(rng.integers(2, 5))):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        frame *= np.linalg.det(frame)
        kind = rng.choice(["free", "ball", "pin", "damped"])
        spin = 10.0 ** rng.uniform(-1, 4) if kind != "damped" and (k == 0 or rng.random() < 0.4) else 0.0
        place, inertia = rng.normal(size=3), 10.0 ** rng.uniform(-4, 2)
        turned = {"orientation": frame, "angular_velocity": tuple(spin * frame[:, 2])}
        body = m.body(f"b{k}", 1.0, (inertia, inertia, 1.5 * inertia), position=place, **turned)
        if kind == "ball":
            m.spherical(f"j{k}", body, m.ground, at=tuple(place))
        if kind in ("pin", "damped"):
            pin = m.revolute(f"j{k}", body, m.ground, at=tuple(place), axis=tuple(frame[:, 2]))
        if kind == "damped":
            decay = 10.0 ** rng.uniform(-5, 1)
            m.torsion_spring(f"d{k}", pin.i, pin.j, stiffness=0.0, damping=1.5 * inertia * decay)
            decays.append(-decay)
        if kind in ("free", "ball") and spin:
            nutations.append(1.5 * spin)
        rigid += {"free": 6, "ball": 3, "pin": 1, "damped": 1}[kind]
    found = linear_modes(m)
    kinds = np.array(found.kinds)
    assert sorted(kinds) == sorted(
        ["rigid"] * rigid + ["oscillating"] * len(nutations) + ["damped rigid"] * len(decays)
    )
    np.testing.assert_allclose(found.eigenvalues[found.oscillating].imag, np.sort(nutations), rtol=1e-6)
    np.testing.assert_allclose(found.eigenvalues[kinds == "damped rigid"].real, np.sort(decays)[::-1], rtol=1e-4)
