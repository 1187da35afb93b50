"""What can be asked of a finished solution: joints, markers, states and expressions, against closed solutions."""

from __future__ import annotations

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError, harmonic
from tests.says import says


@pytest.fixture(scope="module")
def machine():
    """A wheel driven at 40 rad/s with an eccentric centre of mass, a slider moved by t^2, a lagging state."""
    m = Mechanism("machine")
    wheel = m.body("wheel", 1.0, (0.1, 0.1, 0.1), com=(0.02, 0, 0), position=(1, 0, 0))
    slide = m.body("slide", 1.0, (0.1, 0.1, 0.1))
    hinge = m.revolute("hinge", wheel, m.ground, at=(1, 0, 0), axis=(0, 0, 1))
    guide = m.translational("guide", slide, m.ground, axis=(1, 0, 0))
    m.rotation("motor", hinge, "0.5 + 40*TIME")
    m.translation("push", guide, "TIME**2")
    rim, shoe = wheel.marker((0.3, 0, 0), name="rim"), slide.marker(name="shoe")
    m.spring_damper("band", rim, shoe, stiffness=50.0)
    lag = m.differential_state("lag", "-2*DIF(lag)", start=3.0)
    return m, m.simulate(1.0, rate=20, tol=1e-9), lag


def test_joint_coordinates(machine):
    m, solution, _ = machine
    t = solution.t
    # 2 rad between outputs, six turns in all
    np.testing.assert_allclose(solution.joint_angle("hinge"), 0.5 + 40 * t, atol=1e-9)
    np.testing.assert_allclose(solution.joint_angle(m.joints["hinge"]), solution.joint_angle("hinge"))
    np.testing.assert_allclose(solution.joint_displacement("guide"), t**2, atol=1e-9)
    np.testing.assert_allclose(solution.joint_rate("hinge"), 40.0, atol=1e-9)
    np.testing.assert_allclose(solution.joint_rate("guide"), 2.0 * t, atol=1e-7)
    with pytest.raises(ModelError, match=says("joint 'guide'", "angle")):
        solution.joint_angle("guide")
    with pytest.raises(KeyError, match="the joints are hinge, guide"):
        solution.joint_angle("hing")


def test_markers_and_frames(machine):
    m, solution, _ = machine
    t, turn = solution.t, 0.5 + 40 * solution.t
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * t], axis=1)
    along = np.stack([-np.sin(turn), np.cos(turn), 0 * t], axis=1)
    np.testing.assert_allclose(solution.marker_position("rim"), [1, 0, 0] + 0.3 * ring, atol=1e-9)
    np.testing.assert_allclose(solution.marker_velocity("rim"), 12.0 * along, atol=1e-7)
    # the body's own frame stays on the axis, its centre of mass does not
    np.testing.assert_allclose(
        solution.marker_position(m.bodies["wheel"]), np.tile([1.0, 0, 0], (t.size, 1)), atol=1e-9
    )
    np.testing.assert_allclose(solution.com_position("wheel"), [1, 0, 0] + 0.02 * ring, atol=1e-9)
    late = m.ground.marker((0, 2, 0), name="late") if "late" not in [k.name for k in m.ground.markers] else "late"
    assert solution.marker_position(late)[3] == pytest.approx([0, 2, 0])
    with pytest.raises(KeyError, match=r"the markers are .*rim"):
        solution.marker_position("rimm")


def test_states(machine):
    _, solution, lag = machine
    np.testing.assert_allclose(solution.state(lag), 3 * np.exp(-2 * solution.t), rtol=1e-6)
    np.testing.assert_allclose(solution.to_dataset()["states"].sel(state="lag"), solution.state("lag"))
    with pytest.raises(KeyError, match="the states are lag"):
        solution.state("lead")


def test_expressions(machine):
    m, solution, _ = machine
    t, turn = solution.t, 0.5 + 40 * solution.t
    rim = np.stack([1 + 0.3 * np.cos(turn), 0.3 * np.sin(turn)], axis=1)
    apart = np.hypot(rim[:, 0] - t**2, rim[:, 1])
    np.testing.assert_allclose(solution.evaluate("DM(rim, shoe)"), apart, atol=1e-9)
    first = np.hypot(1 + 0.3 - 0.0, 0.0)  # where the bodies were drawn: rim at 1.3, shoe at 0
    np.testing.assert_allclose(solution.evaluate("FM(rim, shoe)"), 50 * np.abs(apart - first), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(solution.evaluate("ACCX(shoe)"), 2.0, rtol=1e-7)
    np.testing.assert_allclose(solution.evaluate("2*DIF(lag) + TIME"), 2 * solution.state("lag") + t)
    np.testing.assert_allclose(solution.evaluate('AZ("hinge.I", "hinge.J")*RTOD'), np.degrees(turn), atol=1e-6)
    moment = solution.reaction("motor")[1][:, 2]
    np.testing.assert_allclose(solution.evaluate("MOTION(motor, 0, 8, 0)"), moment, atol=1e-9)
    if "late too" not in [k.name for k in m.ground.markers]:
        m.ground.marker((0, 0, 4), name="late too")
    np.testing.assert_allclose(solution.evaluate('DZ(shoe, "late too")'), -4.0, atol=1e-12)
    with pytest.raises(ModelError, match=says("TIM", "TIME", "column 3", "'2*TIM'")):
        solution.evaluate("2*TIM")


@pytest.mark.parametrize(("counted", "label"), [
    (lambda found: found.joint_angle("hinge"), "joint 'hinge'"),
    (lambda found: found.evaluate('AZ("hinge.I", "hinge.J")'), "AZ(hinge.I, hinge.J)"),
])  # fmt: skip
def test_turns_that_outputs_cannot_tell_are_warned_of(recwarn, counted, label):
    """26 turns between outputs under a torque that varies: the mean of two speeds is off by more than half a turn."""

    def turned(rate):
        m = Mechanism("disc")
        disc = m.body("disc", 1.0, (1, 1, 1), angular_velocity=(0, 0, -500.0))
        m.revolute("hinge", disc, m.ground)
        m.torque("drive", disc, harmonic(1000.0, 3.0))
        return counted(m.simulate(4.0, rate=rate))[-1]

    exact = -2000.0 + 1000.0 / 3.0 * (4.0 - np.sin(12.0) / 3.0)
    # 13 turns between outputs are counted as well as a part of one
    for rate in (6, 500):
        assert turned(rate) == pytest.approx(exact, abs=1e-3)
    assert not recwarn.list
    with pytest.warns(UserWarning, match=says(label, "t", "rate")):
        turned(3)


def test_rates_of_joints_on_what_moves_are_those_of_plants():
    """In axes of J: of a slide on an arm that turns, and of a pin on it."""
    m = Mechanism("arm")
    arm = m.body("arm", 1.0, (0.1, 0.1, 0.1), angular_velocity=(0, 0, 2.0))
    slide = m.body(
        "slide", 1.0, (0.1, 0.1, 0.1), position=(0.5, 0, 0), velocity=(0.7, 1.0, 0), angular_velocity=(0, 0, 2.0)
    )
    disc = m.body(
        "disc", 1.0, (0.1, 0.1, 0.1), position=(0.5, 0, 0), velocity=(0.7, 1.0, 0), angular_velocity=(0, 0, 5.0)
    )
    m.revolute("hub", arm, m.ground, axis=(0, 0, 1))
    m.translational("rail", slide, arm, at=(0.2, 0.3, 0), axis=(1, 0, 0))
    m.revolute("pin", disc, slide, at=(0.5, 0, 0), axis=(0, 0, 1))
    for name in ("hub", "rail", "pin"):
        m.output(name, ("joint_rate", name))
    start = m.simulate(0.1)
    rates = [start.output(name)[0] for name in ("hub", "rail", "pin")]
    np.testing.assert_allclose(rates, [2.0, 0.7, 3.0], atol=1e-9)
    sim = gm.Simulator(m, 0.1)
    sim.advance(0.1)
    told = [sim.get("joint_rate", name) for name in ("hub", "rail", "pin")]
    with pytest.warns(UserWarning, match=says("slide", "vary")):
        plant = m.linearize([], ["hub", "rail", "pin"], at=sim.state())
    np.testing.assert_allclose(plant.point.outputs, told, atol=1e-9)
    assert [sim.get("output", name) for name in ("hub", "rail", "pin")] == told


def test_plants_between_outputs_have_the_turns_of_their_time():
    """10 rad/s, 4 rad from one output to the next."""
    m = Mechanism("disc")
    disc = m.body("disc", 1.0, (2.0, 2.0, 2.0), angular_velocity=(0, 0, 10.0))
    m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    solution = m.simulate(2.0, rate=2.5, dense_output=True)
    for t in (0.4, 0.41, 0.79, 2.0):
        plant = m.linearize([], [("joint_angle", "pin")], at=solution, t=t)
        np.testing.assert_allclose(plant.point.outputs, [10.0 * t], rtol=1e-9)
