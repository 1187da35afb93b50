"""Files of a generator against the same mechanisms built in Python."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import build_mechanism, parse_view

from .generator import made


def rates(mechanism):
    """Return where bodies are and how they accelerate at the start, by name."""
    system = mechanism.compile(0.0)
    system.initialise()
    found = np.asarray(system.accelerations(system.pose, 0.0)[0]).reshape(len(mechanism.bodies), -1)
    return {name: (system.pose[k], found[k]) for k, name in enumerate(mechanism.bodies)}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_a_command_file_is_the_mechanism_of_python(seed):
    text, expected = made(seed)
    view = parse_view(text)
    assert not view.deck.unsupported
    theirs, ours = rates(expected), rates(build_mechanism(view.deck))
    named = {part.name: part for part in view.deck.of(type(view.deck.ground())).values() if not part.ground}
    assert set(theirs) == set(named)
    for (pose, acceleration), (own_pose, own) in zip(theirs.values(), ours.values()):
        assert np.allclose(own_pose, pose, rtol=0, atol=1e-9)
        assert np.allclose(own, acceleration, rtol=1e-7, atol=1e-7 * np.abs(acceleration).max())
