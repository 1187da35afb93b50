"""What a constraint given by an expression exerts: closed forms, and joints that hold the same."""

import numpy as np
import pytest

from gearmbs.mechanism import Mechanism, forward_sensitivities, static_equilibrium

TIGHT = {"rate": 50, "tol": 1e-9}


def bead(text: str = "DX(I,G)**2 + DY(I,G)**2 - radius**2", radius: float = 0.3) -> Mechanism:
    """A bead of 2 kg that goes round at 1 m/s, about a point of the ground beside the origin."""
    m = Mechanism("bead")
    place = (0.1 + radius, 0.2, 0.0)
    ball = m.body("ball", mass=2.0, inertia=(1e-3, 1e-3, 1e-3), position=place, velocity=(0, 1.0, 0))
    ball.marker(name="I")
    m.ground.marker((0.1, 0.2, 0.0), name="G")
    m.parameter("radius", "m", radius)
    m.general_constraint("hoop", text)
    m.output("pull", ("reaction_force", "hoop"))
    return m


@pytest.mark.parametrize("lump", [False, True])
def test_a_bead_is_held_by_its_centripetal_force(lump):
    m = bead()
    plate = m.body("plate", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(3.0, 0, 0))
    m.fixed("weld", plate, m.ground)
    run = m.simulate(1.0, lump=lump, **TIGHT)
    apart = run.com_position("ball") - [0.1, 0.2, 0.0]
    force, moment = run.reaction("hoop")
    expected = -2.0 / 0.09 * apart
    np.testing.assert_allclose(force, expected, atol=1e-6)
    np.testing.assert_allclose(moment, 0.0, atol=1e-6)
    np.testing.assert_allclose(force, 2.0 * run.com_acceleration("ball"), atol=1e-9)
    np.testing.assert_allclose(m.measures(run).output("pull"), expected, atol=1e-6)
    told = run.to_dataset()
    np.testing.assert_array_equal(told["reaction_force"].sel(joint="hoop"), force)


def test_the_ground_feels_the_opposite_about_its_own_marker():
    """The first marker that is named says on which side: DX(G,I) is minus DX(I,G)."""
    run = bead("DX(G,I)**2 + DY(G,I)**2 - radius**2").simulate(1.0, **TIGHT)
    force, moment = run.reaction("hoop")
    np.testing.assert_allclose(force, 2.0 / 0.09 * (run.com_position("ball") - [0.1, 0.2, 0.0]), atol=1e-6)
    np.testing.assert_allclose(moment, 0.0, atol=1e-6)


def test_the_reaction_has_derivatives_by_parameters():
    """F = -m v^2 / r (cos a, sin a) with a = v t / r."""
    run = forward_sensitivities(lambda radius: bead(radius=radius), {"radius": 0.3}, 0.5, rate=50, tol=1e-9)
    angle = run.solution.t / 0.3
    c, s = np.cos(angle), np.sin(angle)
    expected = 2.0 / 0.09 * np.column_stack([c - angle * s, s + angle * c, 0.0 * c])
    found = run.derivative("radius", lambda solution: solution.reaction("hoop")[0])
    np.testing.assert_allclose(found, expected, atol=1e-4)


def held(body: str, joint: bool) -> Mechanism:
    """A body by one of its corners at a marker of a block, and by a rod between another and the ground.

    By a joint and a distance, or by the expressions that demand the same.
    """
    m = Mechanism(body, gravity=(0.3, 0.1, -9.81))
    block = m.body("block", 3.0, (0.3, 0.2, 0.4), position=(0.1, 0.0, 0.0), angular_velocity=(0.5, 1.0, -0.7))
    at = {"position": (0.5, 0.2, -0.1)}
    if body == "rigid":
        part = m.body("part", 1.0, (0.03, 0.05, 0.04), com=(0.02, 0.01, 0.0), **at)
    elif body == "elastic":
        from gearmbs.mechanism import Mode

        mode = Mode(stiffness=300.0, mass=0.5, momentum=(0.0, 0.2, 0.1), angular_momentum=(0.01, 0.0, 0.02), start=0.02)
        part = m.modal_body("part", 1.0, (0.03, 0.05, 0.04), [mode], bent, **at)
    else:
        part = m.point_mass("part", 1.0, at=at["position"])
    own = (0.0, 0.0, 0.0) if body == "point" else (-0.1, 0.05, 0.02)
    i = part.marker(own, name="I")
    j = block.marker(i.global_position() - [0.1, 0.0, 0.0], [0.3, 0.5, 0.2], name="J")
    k, g = part.marker(np.negative(own), name="K"), m.ground.marker((1.0, 0.8, 0.4), name="G")
    length = float(np.linalg.norm(k.global_position() - g.global_position()))
    if joint:
        m.joint("inline", "corner", i, j)
        m.distance("rod", k, g)
    else:
        m.general_constraint("corner.x", "DX(I,J,J)")
        m.general_constraint("corner.y", "DY(I,J,J)")
        m.general_constraint("rod", f"DM(K,G) - ({length!r})")
    return m


def bent(point):
    x = point[0]
    return [[0.0, 1.0 + 3.0 * x, 2.0 * x]], [[0.1, -2.0, 3.0]]


@pytest.mark.parametrize("body", ["rigid", "elastic", "point"])
def test_expressions_exert_what_joints_do(body):
    by_joint, by_text = (held(body, joint).simulate(0.2, **TIGHT) for joint in (True, False))
    for of in (0, 1):
        corner = sum(by_text.reaction(f"corner.{axis}")[of] for axis in "xy")
        np.testing.assert_allclose(corner, by_joint.reaction("corner")[of], atol=1e-5)
        np.testing.assert_allclose(by_text.reaction("rod")[of], by_joint.reaction("rod")[of], atol=1e-5)
    assert np.abs(by_joint.reaction("rod")[0]).max() > 1.0


def test_an_expression_of_two_markers_of_one_body_counts_both():
    """DZ(I) + DZ(K) - 2 h holds a plate's middle up: its weight, with the moment of the middle about I."""
    m = Mechanism("plate", gravity=(0, 0, -10.0))
    plate = m.body("plate", 2.0, (0.1, 0.1, 0.2), position=(0.0, 0.0, 0.5))
    plate.marker((0.3, 0.1, 0.0), name="I")
    plate.marker((-0.3, -0.1, 0.0), name="K")
    m.general_constraint("held", "DZ(I) + DZ(K) - 1.0")
    force, moment = m.simulate(0.1, rate=50).reaction("held")
    np.testing.assert_allclose(force, [[0.0, 0.0, 20.0]] * 6, atol=1e-9)
    np.testing.assert_allclose(moment, [np.cross([-0.3, -0.1, 0.0], [0.0, 0.0, 20.0])] * 6, atol=1e-9)


def test_an_angle_that_is_led_takes_a_moment():
    m = Mechanism("rotor")
    wheel = m.body("wheel", 1.0, (0.1, 0.1, 0.2))
    m.revolute("axle", wheel, m.ground)
    wheel.marker(name="I")
    m.ground.marker(name="G")
    m.general_constraint("led", "AZ(I,G) - 0.5*3*TIME**2")
    force, moment = m.simulate(0.4, rate=50).reaction("led")
    np.testing.assert_allclose(force, 0.0, atol=1e-9)
    np.testing.assert_allclose(moment, [[0.0, 0.0, 0.6]] * len(moment), atol=1e-6)


def test_at_rest_it_carries_the_weight():
    m = Mechanism("hung", gravity=(0, 0, -10.0))
    m.body("lamp", 2.0, (0.1, 0.1, 0.1), position=(0.0, 0.0, -1.0)).marker(name="I")
    m.ground.marker(name="G")
    m.general_constraint("cord", "DM(I,G) - 1")
    rest = static_equilibrium(m)
    np.testing.assert_allclose(rest.reactions["cord"][0], [0.0, 0.0, 20.0], atol=1e-6)
