"""One pitch later, driven the other way round, wheels exchanged, frame turned: the same forces, to rounding."""

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec

from .probe_tools import Contact, moved, rotation, shaken

# a length of 0.1 m is rounded to 1e-17 m, a penetration of 20 um made of a few dozen of them is good to 1e-11
ROUNDING = 2e-10


def gears(z1, z2, **changes):
    return GearPair(GearSpec(z1, "2 mm"), GearSpec(z2, "2 mm", face_width="22 mm"), **changes)


PAIRS = {
    "29/29": GearPair.paper(),
    "29/29 skew": GearPair.paper(misalignment="1 deg"),
    "29/29 inclination": GearPair.paper(misalignment="1 deg", plane="inclination"),
    "29/29 +3 mm": GearPair.paper(centre_distance_error="3 mm"),
    "29/29 in the roots": GearPair.paper(root_contact=True, centre_distance_error="-0.77 mm", backlash="1.5 mm"),
    "17/38": gears(17, 38, misalignment="0.3 deg"),
    "62/62": gears(62, 62, centre_distance_error="0.5 mm"),
    "20/53": gears(20, 53, axial_shift="2 mm", load="adams"),
}


@pytest.fixture(params=PAIRS)
def setting(request):
    """A pair and four states of it, leaning, shifted and moving."""
    pair = PAIRS[request.param]
    rng = np.random.default_rng(2)
    contact = Contact(pair)
    states = [shaken(contact.state(rng.uniform(0, 6), 20e-6, 100.0), rng) for _ in range(4)]
    return pair, contact, states


def assert_same(one, two):
    scale = np.repeat([np.abs(one[:3]).max(), np.abs(one[3:]).max()], 3) + 1e-30
    assert one[:3].any()
    assert np.abs(two - one) / scale == pytest.approx(0.0, abs=ROUNDING)


def test_one_pitch_later(setting):
    pair, contact, states = setting
    for state in states:
        force = contact(state)
        later = list(state)
        for k, wheel, sense in ((1, pair.driver, 1), (5, pair.driven, -1)):
            later[k] = state[k] @ rotation(np.array([0, 0, sense * 2 * np.pi / wheel.teeth]))
        assert_same(force, contact(later))


def test_seen_from_another_frame(setting):
    _, contact, states = setting
    turn = rotation(np.array([0.3, -1.1, 2.0]))
    for state in states:
        force = contact(state)
        other = contact(moved(state, turn, np.array([0.1, -0.2, 0.3])))
        assert_same(np.concatenate([turn @ force[:3], turn @ force[3:]]), other)


def test_driver_and_driven_exchanged(setting):
    pair, contact, states = setting
    swapped = Contact(pair.with_changes(driver=pair.driven, driven=pair.driver, axial_shift=-pair.axial_shift))
    for state in states:
        force = contact(state)
        other = swapped(state[4:] + state[:4])
        # action and reaction: the opposite force, its moment about the other origin
        arm = state[0] - state[4]
        assert_same(np.concatenate([-force[:3], -force[3:] - np.cross(arm, force[:3])]), other)


def test_mirrored(setting):
    # in a mirror across y forces flip y, torques and spins flip x and z; the flanks change roles
    pair, contact, states = setting
    back = Contact(pair.with_changes(rotation=-1))
    mirror = np.diag([1.0, -1.0, 1.0])
    for state in states:
        image = [mirror @ a @ mirror if k in (1, 5) else mirror @ a for k, a in enumerate(state)]
        image[3], image[7] = -image[3], -image[7]
        force = contact(state)
        assert_same(np.concatenate([mirror @ force[:3], -mirror @ force[3:]]), back(image))
        assert back.diag == pytest.approx(contact.diag, rel=1e-8)
