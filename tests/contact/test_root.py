"""Tips bottoming in the mate's root at reduced centre distance."""

import numpy as np
import pytest

from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec

from .probe_tools import STEPS, Contact, differences, shaken, varied

ELASTIC = {"contact": ContactLaw.impact(damping=0.0), "friction": FlankFriction.none()}


def pair(**changes):
    defaults = {"backlash": "1.6 mm", "centre_distance_error": "-0.82 mm", "root_contact": True}
    return GearPair.paper(**ELASTIC, **(defaults | changes))


def ring_pair(gear=None, ring=None, **changes):
    """A pinion in a ring whose tips stand 0.3 mm off the roots, with room between the flanks."""
    shallow = {"dedendum": "3.3 mm", "fillet_radius": "0.3 mm"}
    defaults = {"backlash": "1.4 mm", "root_contact": True}
    return GearPair(
        GearSpec(23, "3 mm", **shallow | (gear or {})),
        GearSpec.ring(70, "3 mm", **shallow | (ring or {})),
        **ELASTIC,
        **(defaults | changes),
    )


ROUND = {"tip_rounding": "0.25 mm"}
DISPLACED = {
    "external": (pair(), 0.0),
    "external, rounded tips": (
        GearPair(
            GearSpec(29, "3 mm", **ROUND),
            GearSpec(31, "3 mm", **ROUND),
            backlash="1.6 mm",
            centre_distance_error="-0.78 mm",
            root_contact=True,
            **ELASTIC,
        ),
        0.0,
    ),
    "ring": (ring_pair(), 0.34e-3),
    "ring, its roots only": (ring_pair(gear={"dedendum": "4 mm"}), 0.34e-3),
    "ring, the pinion's roots only": (ring_pair(ring={"dedendum": "4 mm"}), 0.34e-3),
    "ring, rounded tips": (ring_pair(gear=ROUND, ring=ROUND), 0.36e-3),
}


def displaced(contact, angle, driven_angle, shift):
    """Poses with wheel 1 moved by ``shift`` (m) along the line of centres, deeper into an internal wheel 2."""
    place = contact.pair.frames(angle, driven_angle)
    apart = place.origin_1 - place.origin_2
    origin = place.origin_1 + shift * apart / np.linalg.norm(apart)
    zero = np.zeros(3)
    return [origin, place.axes_1, zero, zero, place.origin_2, place.axes_2, zero, zero]


def between(contact, angle):
    """Angle of wheel 2 with the teeth in the middle of its spaces, at the pair's own centre distance."""
    wheels = contact.pair
    turn = 0.5 * wheels.normal_backlash / wheels.driven.base_radius
    return contact.mesh.touching_angle(angle) - wheels.sign * wheels.rotation * turn


def tip_points(gear):
    """Points of one tip around tooth 0: its land and the arcs of its edges."""
    land = np.linspace(-gear.corner_half_angle, gear.corner_half_angle, 20001)
    points = gear.tip_radius * np.stack([np.cos(land), np.sin(land)])
    if gear.tip_rounding:
        around = np.linspace(0, 2 * np.pi, 40001)
        for half in (-gear.corner_half_angle, gear.corner_half_angle):
            centre = gear.corner_radius * np.array([[np.cos(half)], [np.sin(half)]])
            points = np.hstack([points, centre + gear.tip_rounding * np.stack([np.cos(around), np.sin(around)])])
    return points


def root_depth(wheels, state):
    """Deepest point of either wheel's tips in the other's root arcs and root circle, parallel axes, by search."""
    worst = 0.0
    frames = ((state[0], state[1]), (state[4], state[5]))
    for tip_of, root_of in ((0, 1), (1, 0)):
        tip, root = wheels.wheels[tip_of], wheels.wheels[root_of]
        (o_tip, a_tip), (o_root, a_root) = frames[tip_of], frames[root_of]
        shape = tip_points(tip)
        for tooth in range(tip.teeth):
            angle = 2 * np.pi * tooth / tip.teeth
            c, s = np.cos(angle), np.sin(angle)
            local = np.array([[c, -s], [s, c]]) @ shape
            point = a_root.T @ (o_tip[:, None] + a_tip @ np.vstack([local, 0 * local[0]]) - o_root[:, None])
            radius = np.hypot(point[0], point[1])
            # outwards is deeper for an internal wheel
            if (root.sign * radius).min() > root.sign * root.form_radius:
                continue
            step = 2 * np.pi / root.teeth
            polar = (np.arctan2(point[1], point[0]) + 0.5 * step) % step - 0.5 * step
            # half a space, from the middle of the tooth on: root arc up to its centre, root circle beyond
            x, y = radius * np.cos(abs(polar)), radius * np.sin(abs(polar))
            eta = root.fillet_half_angle
            cx, cy = root.fillet_centre_radius * np.cos(eta), root.fillet_centre_radius * np.sin(eta)
            on_arc = abs(polar) < eta
            below = root.sign * ((x - cx) * np.cos(eta) + (y - cy) * np.sin(eta)) < 0
            arc = np.hypot(x - cx, y - cy) - root.fillet_radius
            circle = root.sign * (root.root_radius - radius)
            depth = np.where(on_arc, np.where(below, arc, -1.0), circle)
            worst = max(worst, depth.max())
    return worst


@pytest.mark.slow
@pytest.mark.parametrize("name", DISPLACED)
def test_depth_against_search(name):
    wheels, shift = DISPLACED[name]
    contact = Contact(wheels, 1)
    checked = 0
    for angle in np.linspace(0, 2 * np.pi / wheels.driver.teeth, 15):
        state = displaced(contact, angle, between(contact, angle), shift)
        contact(state)
        depth = max(contact.diag[3], contact.diag[4])
        expected = root_depth(wheels, state)
        if expected > 0:
            checked += 1
        assert depth == pytest.approx(max(expected, 0.0), abs=1e-8)
    assert checked >= 3


def test_pushes_the_wheels_apart():
    contact = Contact(pair(), 1)
    mesh = contact.mesh
    angle = mesh.touching_angle(0.0) - 0.5 * pair().normal_backlash / 0.04176
    place = pair().frames(0.0, angle)
    zero = np.zeros(3)
    state = [place.origin_1, place.axes_1, zero, zero, place.origin_2, place.axes_2, zero, zero]
    force = contact(state)
    assert force[0] < 0
    assert contact.diag[7] > 0


def block_errors(exact, near):
    """Error of each 3 x 3 block of the derivatives by places and turns over the block's largest entry."""
    errors = []
    for rows in (slice(0, 3), slice(3, 6)):
        for block in (0, 1, 4, 5):
            columns = slice(3 * block, 3 * block + 3)
            errors.append(abs(exact[rows, columns] - near[rows, columns]).max() / abs(near[rows, columns]).max())
    return errors


SHARES = (1, 3, 8, 20, 50, 150, 400)
"""Steps of quotients, of which the best counts for each block: small ones see rounding, large ones the corners.

Rounding is that of the distance to a plane. Where a tip presses towards the axis and the wheels are hardly tilted,
torques about the axis are 1e-7 m times the force, and their derivatives are lost in it up to the largest steps.
"""


def gradient(contact, state, share):
    """Force and torque on wheel 1 as what the energy loses, central differences of fourth order."""
    found = []
    for column in range(6):
        h = share * STEPS[column // 3]
        e = [contact.energy(varied(state, column, m * h)) for m in (1, -1, 2, -2)]
        found.append(-(8 * (e[0] - e[1]) - (e[2] - e[3])) / (12 * h))
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize(("misalignment", "slices"), [("0 deg", 1), ("1 deg", 1), ("0.3 deg", 7)])
@pytest.mark.parametrize("kind", ["external", "ring"])
def test_jacobian_and_energy(kind, misalignment, slices):
    wheels, shift = (pair, 0.0) if kind == "external" else (ring_pair, 0.34e-3)
    contact = Contact(wheels(misalignment=misalignment), slices)
    rng = np.random.default_rng(4)
    errors = []
    for angle in np.linspace(0, 0.4, 12):
        middle = between(contact, angle) + rng.uniform(-0.2e-3, 0.2e-3) / contact.pair.driven.base_radius
        state = shaken(displaced(contact, angle, middle, shift), rng, shift=5e-6)
        force = contact(state, 1)
        if not max(contact.diag[3], contact.diag[4]) > 1e-5:
            continue
        exact = contact.jac.copy()
        misses = [block_errors(exact, differences(contact, state, share)) for share in SHARES]
        errors.append(np.min(misses, axis=0).max())
        scale = np.repeat([abs(force[:3]).max(), abs(force[3:]).max()], 3)
        misses = [abs(gradient(contact, state, share) - force) / scale for share in SHARES]
        assert np.min(misses, axis=0).max() < 5e-5
    assert len(errors) >= 4
    assert np.median(errors) < 1e-6
    assert max(errors) < 2e-5


def test_not_looked_for_with_ample_clearance():
    assert not GearPair.paper().tips_may_bottom
    assert GearPair.paper(centre_distance_error="-0.7 mm").tips_may_bottom
    assert not GearPair(GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm")).tips_may_bottom
    with pytest.raises(ValueError, match="root_contact is True"):
        GearPair(GearSpec(23, "3 mm", helix_angle=0.2), GearSpec.ring(70, "3 mm", helix_angle=0.2), root_contact=True)
    shallow = GearSpec.ring(70, "3 mm", dedendum="3.2 mm", fillet_radius="0.2 mm")
    assert GearPair(GearSpec(23, "3 mm"), shallow).tips_may_bottom
    assert GearSpec(29, "3 mm").dedendum > GearSpec(29, "3 mm").addendum
