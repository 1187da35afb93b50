"""Solutions handed on while the integration goes are those that would have been kept."""

import numpy as np
import pytest

from gearmbs.mechanism import Mechanism, ModelError
from tests.says import says


def tumbling() -> Mechanism:
    """A body that passes through several Euler references on a swinging arm."""
    m = Mechanism("tumbling", gravity=(0.0, 0.0, -9.81))
    arm = m.body("arm", 1.0, (0.02, 0.1, 0.1), position=(0.5, 0.0, 0.0))
    rotor = m.body("rotor", 2.0, (0.3, 0.2, 0.1), position=(1.0, 0.0, 0.0), angular_velocity=(3.0, 7.0, 1.0))
    m.revolute("pin", arm, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
    m.spherical("ball", rotor, arm, at=(1.0, 0.0, 0.0))
    return m


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.slow
def test_parts_are_the_whole(integrator):
    found: list[tuple] = []

    def take(part):
        found.append((part.t.copy(), part.reaction("pin")[0].copy(), part.orientation("rotor").copy()))

    options = {"every_step": True, "integrator": integrator, "tol": 1e-7 if integrator == "WSTIFF" else 1e-9}
    whole = tumbling().simulate(1.5, **options)
    last = tumbling().simulate(1.5, consumer=take, **options)
    t, force, turned = (np.concatenate(part) for part in zip(*found, strict=True))
    assert integrator == "IDA" or len(whole.result.epochs) > 1
    assert len(found) > 1 or t.size < 2000
    np.testing.assert_array_equal(t, whole.t)
    np.testing.assert_allclose(force, whole.reaction("pin")[0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(turned, whole.orientation("rotor"), atol=1e-12)
    assert last.success
    assert last.t[-1] == whole.t[-1]
    assert last.stats.steps == whole.stats.steps
    np.testing.assert_allclose(last.com_position("rotor")[-1], whole.com_position("rotor")[-1], atol=1e-12)


def test_a_conflict_on_the_way_is_found():
    """Two hinges on one door, the second of which leaves the axis: the motion contradicts the removed row."""
    m = Mechanism("door")
    door = m.body("door", 1.0, (0.1, 0.1, 0.1))
    m.revolute("hinge", door, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    m.rotation("swing", m.joints["hinge"], "0.5*TIME**2")
    m.rotation("other swing", m.joints["hinge"], "0.5*TIME**2 + 0.01*TIME**3")
    solution = m.simulate(1.0, every_step=True, consumer=lambda part: None)
    kept = m.simulate(1.0, every_step=True)
    assert not kept.success
    assert not solution.success
    assert "other swing" in solution.message


def test_a_consumer_needs_the_steps():
    with pytest.raises(ModelError, match=says("consumer", "give every_step=True")):
        tumbling().simulate(1.0, consumer=print)
