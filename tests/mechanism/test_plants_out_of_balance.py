"""Plants where a mechanism is not in balance: in the coordinates of its joints, with a remark, against derivatives."""

from __future__ import annotations

import warnings
from contextlib import nullcontext

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gearmbs as gm
from tests.says import says

GRAVITY = 9.81
CART, POLE, ARM, INERTIA = 2.0, 1.0, 0.5, 0.03


def aslant(angle: float, arm: float = ARM) -> gm.Mechanism:
    """Return a pendulum about y, held at an angle by nothing."""
    m = gm.Mechanism("pendulum", gravity=(0, 0, -GRAVITY))
    turned = Rotation.from_rotvec((0, angle, 0)).as_matrix()
    rod = m.body("rod", POLE, (INERTIA,) * 3, position=turned @ (0, 0, -arm), orientation=turned)
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    return m


@pytest.mark.parametrize("arm", [0.2, 0.5, 3.0])
def test_a_pendulum_that_nothing_holds_is_linearised_in_its_angle(arm):
    """(I + m l^2) phi'' + m g l sin phi = T, whichever coordinate of its body is the longest."""
    angle, inertia = 1.0, INERTIA + POLE * arm**2
    m = aslant(angle, arm)
    with pytest.warns(UserWarning, match=says("rod", "balance", "equilibrium")) as told:
        plant = m.linearize([("torque", "pin")], [("joint_angle", "pin")])
    weight = POLE * GRAVITY * arm
    assert f"{-weight * np.sin(angle):.4g} N m" in str(told[0].message)
    assert told[0].filename == __file__
    assert plant.A == pytest.approx(np.array([[0, 1], [-weight * np.cos(angle) / inertia, 0]]), rel=1e-9, abs=1e-9)
    assert plant.C == pytest.approx(np.array([[1.0, 0.0]]), abs=1e-12)
    assert m.linear_modes().eigenvalues[0].imag == pytest.approx(np.sqrt(-plant.A[1, 0]), rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1.0, np.pi])
def test_what_is_held_or_rests_is_not_remarked_on(angle):
    m = aslant(angle)
    m.torque("hold", m.bodies["rod"], POLE * GRAVITY * ARM * np.sin(angle), axis=(0, 1, 0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plant = m.linearize([("torque", "pin")], [("joint_angle", "pin")])
        aslant(0.3).linearize([("torque", "pin")], [("joint_angle", "pin")], at="equilibrium")
    assert plant.A[1, 0] == pytest.approx(-POLE * GRAVITY * ARM * np.cos(angle) / (INERTIA + POLE * ARM**2), rel=1e-9)


def test_what_moves_off_and_stays_the_same_is_not_remarked_on():
    """A disc with its mass beside its axis under a torque, and a mass that falls into a linear spring."""
    m = gm.Mechanism("off")
    disc = m.body("disc", 1.0, (0.1,) * 3, position=(0.2, 0, 0))
    m.revolute("pin", disc, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.torque("drive", disc, 3.0)
    block = m.body("block", 2.0, (0.1,) * 3, position=(0, 0, 1.0))
    m.translational("guide", block, m.ground, at=(0, 0, 1.0), axis=(0, 0, 1))
    m.load("spring", block.marker(name="s.I"), m.ground.marker(name="s.J"), fz="-20 - 800*(DZ(s.I) - 1)")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plant = m.linearize([("torque", "pin")], [("joint_angle", "pin")])
    assert plant.states[:2] == ["disc: rotation about z", "block: z"]
    assert plant.A[2:, :2] == pytest.approx(np.diag([0.0, -400.0]), abs=1e-9)


def test_a_spring_that_is_not_linear_is_remarked_on():
    """Of F = -k x^3 out of balance the stiffness is that of the place, 3 k x^2."""
    m = gm.Mechanism("hard")
    block = m.body("block", 2.0, (0.1,) * 3, position=(0, 0, 1.0))
    m.translational("guide", block, m.ground, at=(0, 0, 1.0), axis=(0, 0, 1))
    m.load("spring", block.marker(name="s.I"), m.ground.marker(name="s.J"), fz="-50*DZ(s.I)**3")
    with pytest.warns(UserWarning, match=says("block: z", "-50 N", "balance")):
        plant = m.linearize([("force", "guide")], [("joint_displacement", "guide")])
    assert plant.A[1, 0] == pytest.approx(-75.0, rel=1e-9)


def cart(angle: float, spin: float, speed: float, axes: np.ndarray) -> gm.Mechanism:
    """Return a cart on a rail with a pole that hangs from it, all in axes of any direction."""
    m = gm.Mechanism("cart and pole", gravity=axes @ (0, 0, -GRAVITY))
    moving = axes @ (speed, 0, 0)
    body = m.body("cart", CART, (0.1,) * 3, orientation=axes, velocity=moving)
    m.translational("rail", body, m.ground, at=(0, 0, 0), axis=axes[:, 0])
    turned, turning = axes @ Rotation.from_rotvec((0, angle, 0)).as_matrix(), axes @ (0, spin, 0)
    arm = turned @ (0, 0, -ARM)
    pole = m.body("pole", POLE, (INERTIA,) * 3, position=arm, orientation=turned, angular_velocity=turning,
                  velocity=moving + np.cross(turning, arm))  # fmt: skip
    m.revolute("hinge", pole, body, at=(0, 0, 0), axis=axes[:, 1])
    return m


def _accelerations(angle, spin, force, torque):
    """(M + m) x'' - m l (sin phi)'' = F, (I + m l^2) phi'' - m l cos phi x'' + m g l sin phi = T."""
    couple = -POLE * ARM * np.cos(angle)
    matrix = np.array([[CART + POLE, couple], [couple, INERTIA + POLE * ARM**2]])
    pushed = [force - POLE * ARM * np.sin(angle) * spin**2, torque - POLE * GRAVITY * ARM * np.sin(angle)]
    return np.linalg.solve(matrix, np.array(pushed))


@pytest.mark.parametrize("tilt", [0.0, 0.7])
@pytest.mark.parametrize(
    ("angle", "spin", "speed"),
    [(0.6, 0.0, 0.0), (2.0, 0.0, 0.0), (0.6, 2.0, 1.3), (0.0, 3.0, 0.0), (0.6, 0.01, 0.0), (0.6, 1e-9, 0.0)],
)
def test_a_cart_and_pole_anywhere_and_in_any_axes(tilt, angle, spin, speed):
    """The derivatives of x'' and phi'' by x, phi, their rates, F and T, by complex steps; from rest on slowly, too."""
    m = cart(angle, spin, speed, Rotation.from_rotvec(tilt * np.array([1, 2, 3]) / np.sqrt(14.0)).as_matrix())
    shown = [("joint_displacement", "rail"), ("joint_angle", "hinge"), ("joint_rate", "hinge")]
    with pytest.warns(UserWarning, match=says("pole", "vary", "time") if spin > 1e-6 else says("balance")):
        plant = m.linearize([("force", "rail"), ("torque", "hinge")], shown)
    h = 1e-30
    by = [np.imag(_accelerations(*row)) / h for row in np.array([angle, spin, 0, 0]) + 1j * h * np.eye(4)]
    exact = np.transpose([np.zeros(2), by[0], np.zeros(2), by[1], by[2], by[3]])
    np.testing.assert_allclose(np.hstack([plant.A, plant.B])[2:], exact, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(plant.C, np.eye(4)[[0, 1, 3]], atol=1e-9)
    assert plant.states[:2] == (
        ["rail: displacement", "hinge: angle"] if tilt else ["cart: x", "pole: rotation about y"]
    )


@pytest.mark.parametrize("tilt", [0.0, 0.7])
@pytest.mark.parametrize(("angle", "spin"), [(0.0, 0.0), (0.6, 0.0), (0.6, 2.0)])
def test_a_pendulum_on_a_base_that_is_turned(tilt, angle, spin):
    """(I + m l^2) phi'' + m g l sin phi = 0 of the absolute angle; the joint's own is less that of the base."""
    axes = Rotation.from_rotvec(tilt * np.array([1, 2, 3]) / np.sqrt(14.0)).as_matrix()
    m = gm.Mechanism("base", gravity=axes @ (0, 0, -GRAVITY))
    base = m.body("base", CART, (0.1,) * 3, orientation=axes)
    m.rotation("drive", m.revolute("main", base, m.ground, at=(0, 0, 0), axis=axes[:, 1]), 0.0)
    turned, turning = axes @ Rotation.from_rotvec((0, angle, 0)).as_matrix(), axes @ (0, spin, 0)
    arm = turned @ (0, 0, -ARM)
    pole = m.body("pole", POLE, (INERTIA,) * 3, position=arm, orientation=turned, angular_velocity=turning,
                  velocity=np.cross(turning, arm))  # fmt: skip
    m.revolute("hinge", pole, base, at=(0, 0, 0), axis=axes[:, 1])
    with pytest.warns(UserWarning, match=says("equations" if spin else "-2.77 N m")) if angle else nullcontext():
        plant = m.linearize([("motion", "drive", "acceleration")], [("joint_angle", "hinge")])
    rate = POLE * GRAVITY * ARM * np.cos(angle) / (INERTIA + POLE * ARM**2)
    s = 3.0 + 4.0j
    # the pole stays where it is
    assert plant.transfer(s)[0, 0] == pytest.approx(-1.0 / s**2, rel=1e-9)
    if tilt:
        assert plant.states[0] == "hinge: angle"
        assert plant.C[0] == pytest.approx([1, 0, 0, 0], abs=1e-9)
        assert plant.A[1] == pytest.approx([-rate, 0, -rate, 0], rel=1e-8, abs=1e-9)
        assert plant.B[1] == pytest.approx([-1.0], rel=1e-9)
    else:
        assert plant.states[0] == "pole: rotation about y"
        assert plant.C[0] == pytest.approx([1, 0, -1, 0], abs=1e-9)
        assert plant.A[1] == pytest.approx([-rate, 0, 0, 0], rel=1e-8, abs=1e-9)


CRANK, ROD = 0.1, 0.3


def _kinematics(angle):
    """Return by complex numbers, too, the rates of a rod's angle, of its middle along x and of a block by a crank's."""
    lean = -np.arcsin(CRANK * np.sin(angle) / ROD)
    swing = -CRANK * np.cos(angle) / (ROD * np.cos(lean))
    reach = -CRANK * np.sin(angle)
    return lean, swing, reach - 0.5 * ROD * np.sin(lean) * swing, reach - ROD * np.sin(lean) * swing


def _pushed(angle):
    """Acceleration of the crank at rest, -V' / I, with the middles of crank and rod at half the height of their pin."""
    _, swing, middle, way = _kinematics(angle)
    height = 0.5 * CRANK * np.cos(angle)
    inertia = 0.01 + (0.5 * CRANK) ** 2 + 0.01 * swing**2 + 0.5 * (middle**2 + height**2) + 2.0 * way**2
    return -GRAVITY * (1.0 + 0.5) * height / inertia


def crank(angle: float, backwards: bool) -> gm.Mechanism:
    """Return a slider crank at rest, with its joints made from the crank on or from the block on."""
    m = gm.Mechanism("slider crank", gravity=(0.0, -GRAVITY, 0.0))
    lean = float(_kinematics(angle)[0])
    pin = CRANK * np.array([np.cos(angle), np.sin(angle), 0.0])
    end = np.array([pin[0] + ROD * np.cos(lean), 0.0, 0.0])
    turned, leaning = (Rotation.from_rotvec((0, 0, a)).as_matrix() for a in (angle, lean))
    bodies = [
        m.body("crank", 1.0, (0.01,) * 3, position=0.5 * pin, orientation=turned),
        m.body("rod", 0.5, (0.01,) * 3, position=0.5 * (pin + end), orientation=leaning),
        m.body("block", 2.0, (0.01,) * 3, position=end),
    ]
    joints = [
        lambda: m.revolute("main", bodies[0], m.ground, at=(0, 0, 0), axis=(0, 0, 1)),
        lambda: m.revolute("pin", bodies[1], bodies[0], at=pin, axis=(0, 0, 1)),
        lambda: m.revolute("wrist", bodies[1], bodies[2], at=end, axis=(0, 0, 1)),
        lambda: m.translational("guide", bodies[2], m.ground, at=end, axis=(1, 0, 0)),
    ]
    for make in reversed(joints) if backwards else joints:
        make()
    return m


@pytest.mark.filterwarnings("ignore:.*balance")
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.slow
def test_a_slider_crank_has_one_coordinate_over_a_turn(backwards):
    """A is a continuous function of the crank's angle, d/d phi of phi'', through dead centres and upright positions."""
    for angle in np.linspace(0.05, 2.0 * np.pi + 0.05, 16):
        plant = crank(angle, backwards).linearize([("torque", "main")], [("joint_angle", "main")])
        assert plant.states == ["crank: rotation about z", "crank: rotation about z, rate"]
        assert plant.A[1, 0] == pytest.approx(np.imag(_pushed(angle + 1e-30j)) / 1e-30, rel=1e-7, abs=1e-7)


@pytest.mark.filterwarnings("ignore:.*balance")
def test_a_ball_joint_has_the_rotations_of_its_body_anywhere():
    for turn in ((0.3, 0, 0), (0, 1.5, 0.2), (0.5, -0.7, 2.0)):
        turned = Rotation.from_rotvec(turn).as_matrix()
        m = gm.Mechanism("pendulum", gravity=(0, 0, -GRAVITY))
        rod = m.body("rod", POLE, (INERTIA,) * 3, position=turned @ (0, 0, -3.0), orientation=turned)
        m.spherical("ball", rod, m.ground, at=(0, 0, 0))
        plant = m.linearize([("torque", "rod", "x")], [("com_position", "rod", "x")])
        assert plant.states[:3] == [f"rod: rotation about {c}" for c in "xyz"]


def test_what_has_come_to_rest_has_the_coordinates_of_its_equilibrium():
    """A double pendulum that still swings by 1e-7 rad/s, as simulations leave it."""
    m = gm.Mechanism("double", gravity=(0, 0, -GRAVITY))
    creeping = (0, 1e-7, 0)
    upper = m.body("upper", 1.0, (INERTIA,) * 3, position=(0, 0, -0.3), angular_velocity=creeping,
                   velocity=np.cross(creeping, (0, 0, -0.3)))  # fmt: skip
    lower = m.body("lower", 0.5, (INERTIA,) * 3, position=(0, 0, -0.8), angular_velocity=creeping,
                   velocity=np.cross(creeping, (0, 0, -0.8)))  # fmt: skip
    m.revolute("shoulder", upper, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.revolute("elbow", lower, upper, at=(0, 0, -0.6), axis=(0, 1, 0))
    asked = [("torque", "elbow")], [("joint_angle", "elbow")]
    rest = m.linearize(*asked, at="equilibrium")
    assert rest.states[:2] == ["upper: rotation about y", "elbow: angle"]
    for at in ("initial", m.simulate(0.2, rate=10)):
        plant = m.linearize(*asked, at=at)
        assert plant.states == rest.states
        np.testing.assert_allclose(plant.A, rest.A, rtol=0, atol=1e-5)
