"""Joints that lock a body are remarked in the solution; what is fixed or driven on purpose is not."""

import pytest

from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.checks import locked_bodies
from gearmbs.studies import gear_rig


def rod(*pins):
    """A rod with revolute joints on the ground about these axes through its end."""
    m = Mechanism("rod", gravity=(0, 0, -9.81))
    body = m.body("rod", 1.0, (0.1, 0.1, 0.01), position=(0.5, 0, 0))
    for k, (at, axis) in enumerate(pins, 1):
        m.revolute(f"pin {k}", body, m.ground, at=at, axis=axis)
    return m


def test_a_second_hinge_is_remarked():
    """About another axis, or the same direction at another place."""
    for second in (((0, 0, 0), (1, 0, 0)), ((1, 0, 0), (0, 1, 0))):
        solution = rod(((0, 0, 0), (0, 1, 0)), second).simulate(0.05)
        assert solution.success
        assert "Body 'rod' cannot move: 'pin 1' and 'pin 2' together leave it no motion; fix it" in solution.message
        assert repr(solution).endswith("fix it to the ground if that is meant.")


@pytest.mark.parametrize(
    "mechanism",
    [
        rod(((0, 0, 0), (0, 1, 0))),
        # the same hinge twice: redundant, but it turns
        rod(((0, 0, 0), (0, 1, 0)), ((0, 0.3, 0), (0, 1, 0))),
        gear_rig(GearPair.paper(), speed="1000 rpm"),
    ],
    ids=["pendulum", "two bearings of a shaft", "rig"],
)
def test_what_moves_is_not(mechanism):
    system = mechanism.compile()
    system.initialise()
    assert locked_bodies(mechanism, system) == []


def test_what_is_fixed_or_driven_on_purpose_is_not():
    m = rod(((0, 0, 0), (0, 1, 0)))
    m.rotation("motor", m.joints["pin 1"], "2*TIME")
    base, top = m.body("base", 1.0, (1, 1, 1)), m.body("top", 1.0, (1, 1, 1))
    m.fixed("bolts", base, m.ground)
    m.fixed("screws", top, base)
    assert "cannot move" not in m.simulate(0.01).message


def test_a_slider_at_its_dead_centre_is_not():
    m = Mechanism("crank")
    crank = m.body("crank", 1.0, (0.01, 0.01, 0.01), position=(0.05, 0, 0))
    rod = m.body("rod", 1.0, (0.01, 0.01, 0.01), position=(0.25, 0, 0))
    block = m.body("block", 1.0, (0.01, 0.01, 0.01), position=(0.4, 0, 0))
    m.revolute("main", crank, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.revolute("pin", rod, crank, at=(0.1, 0, 0), axis=(0, 0, 1))
    m.spherical("wrist", rod, block, at=(0.4, 0, 0))
    m.translational("guide", block, m.ground, at=(0.4, 0, 0), axis=(1, 0, 0))
    m.torque("drive", crank, 5.0, axis=(0, 0, 1))
    assert "cannot move" not in m.simulate(0.05).message


def test_many_are_summed_up():
    m = Mechanism("frame")
    bodies = [m.body(name, 1.0, (1, 1, 1), position=(k, 0, 0)) for k, name in enumerate("abcd")]
    for k, body in enumerate(bodies):
        for axis in ((1, 0, 0), (0, 1, 0)):
            m.revolute(f"hinge {2 * k + axis[1]}", body, m.ground, axis=axis)
    assert "Bodies 'a', 'b', 'c' and 1 more cannot move: 'hinge 0', 'hinge 1'" in m.simulate(0.01).message
