"""Poses without meaning: wheels that have flown away, whose contact is nothing, and takes no time to find out."""

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec

from .probe_tools import Contact, rotation

HELICAL = {"helix_angle": "20 deg", "face_width": "20 mm"}
PAIRS = {
    "spur": GearPair.paper(backlash="0.1 mm"),
    "tilted": GearPair.paper(misalignment="1 deg", backlash="0.1 mm"),
    "helical": GearPair(GearSpec(29, "3 mm", **HELICAL), GearSpec(29, "3 mm", hand="left", **HELICAL)),
}


@pytest.mark.timeout(120)
@pytest.mark.parametrize("name", PAIRS)
def test_a_wheel_that_is_far_away(name):
    """The reach of the teeth, which grows with the distance, ends at all teeth there are."""
    contact = Contact(PAIRS[name])
    near = contact(contact.state(0.3, 5e-6))
    assert np.abs(near[:3]).max() > 0.0
    for axis in range(3):
        for far in (1e3, 1e6, 1e12, 1e20, 1e27):
            for lean in (0.0, 1e-3, 0.3):
                state = [a.copy() for a in contact.state(0.3, 5e-6)]
                state[4] = state[4] + far * state[1][:, axis]
                state[5] = rotation(lean * state[1][:, 0]) @ state[5]
                assert np.isfinite(contact(state)).all()
    # and nothing of it stays behind
    np.testing.assert_array_equal(contact(contact.state(0.3, 5e-6)), near)
