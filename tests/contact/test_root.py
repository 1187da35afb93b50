"""Tips bottoming in the mate's root at reduced centre distance."""

import numpy as np
import pytest

from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec

from .probe_tools import Contact, differences, shaken, varied

ELASTIC = {"contact": ContactLaw.impact(damping=0.0), "friction": FlankFriction.none()}


def pair(**changes):
    defaults = {"backlash": "1.6 mm", "centre_distance_error": "-0.82 mm", "root_contact": True}
    return GearPair.paper(**ELASTIC, **(defaults | changes))


def root_depth(pair, place):
    """Deepest point of either wheel's tip arcs in the other's root arcs and root circle, parallel axes, by search."""
    worst = 0.0
    frames = ((place.origin_1, place.axes_1), (place.origin_2, place.axes_2))
    for tip_of, root_of in ((0, 1), (1, 0)):
        tip, root = pair.wheels[tip_of], pair.wheels[root_of]
        (o_tip, a_tip), (o_root, a_root) = frames[tip_of], frames[root_of]
        land = np.linspace(-tip.corner_half_angle, tip.corner_half_angle, 20001)
        for tooth in range(29):
            angle = 2 * np.pi * tooth / 29 + land
            local = tip.tip_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle])
            point = a_root.T @ (o_tip[:, None] + a_tip @ local - o_root[:, None])
            radius = np.hypot(point[0], point[1])
            if radius.min() > root.form_radius:
                continue
            step = 2 * np.pi / 29
            polar = (np.arctan2(point[1], point[0]) + 0.5 * step) % step - 0.5 * step
            # half a space, from the middle of the tooth on: root arc up to its centre, root circle beyond
            x, y = radius * np.cos(abs(polar)), radius * np.sin(abs(polar))
            eta = root.fillet_half_angle
            cx, cy = root.fillet_centre_radius * np.cos(eta), root.fillet_centre_radius * np.sin(eta)
            on_arc = abs(polar) < eta
            below = (x - cx) * np.cos(eta) + (y - cy) * np.sin(eta) < 0
            arc = np.hypot(x - cx, y - cy) - root.fillet_radius
            circle = root.root_radius - radius
            depth = np.where(on_arc, np.where(below, arc, -1.0), circle)
            worst = max(worst, depth.max())
    return worst


def test_depth_against_search():
    wheels = pair()
    contact = Contact(wheels, 1)
    checked = 0
    for angle in np.linspace(0, 2 * np.pi / 29, 15):
        # between the flanks: only roots are touched
        middle = contact.mesh.touching_angle(angle) - 0.5 * wheels.normal_backlash / wheels.driven.base_radius
        place = wheels.frames(angle, middle)
        zero = np.zeros(3)
        contact([place.origin_1, place.axes_1, zero, zero, place.origin_2, place.axes_2, zero, zero])
        depth = max(contact.diag[3], contact.diag[4])
        expected = root_depth(wheels, place)
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


@pytest.mark.parametrize(("misalignment", "slices"), [("0 deg", 1), ("1 deg", 1), ("0.3 deg", 7)])
def test_jacobian_and_energy(misalignment, slices):
    contact = Contact(pair(misalignment=misalignment), slices)
    rng = np.random.default_rng(4)
    checked = 0
    for angle in np.linspace(0, 0.4, 12):
        state = shaken(contact.state(angle, -rng.uniform(0.1e-3, 0.8e-3)), rng, shift=5e-6)
        force = contact(state, 1)
        if not max(contact.diag[3], contact.diag[4]) > 1e-5:
            continue
        exact = contact.jac.copy()
        near = differences(contact, state)
        checked += 1
        for rows in (slice(0, 3), slice(3, 6)):
            for block in (0, 1, 4, 5):
                columns = slice(3 * block, 3 * block + 3)
                scale = abs(near[rows, columns]).max()
                assert exact[rows, columns] == pytest.approx(near[rows, columns], abs=5e-5 * scale)
        gradient = []
        for column in range(6):
            h = 1e-7 if column < 3 else 2e-6
            e = [contact.energy(varied(state, column, m * h)) for m in (1, -1, 2, -2)]
            gradient.append(-(8 * (e[0] - e[1]) - (e[2] - e[3])) / (12 * h))
        scale = np.repeat([abs(force[:3]).max(), abs(force[3:]).max()], 3)
        assert np.array(gradient) / scale == pytest.approx(force / scale, abs=5e-5 if slices == 1 else 2e-3)
    assert checked >= 4


def test_not_looked_for_with_ample_clearance():
    assert not GearPair.paper().tips_may_bottom
    assert GearPair.paper(centre_distance_error="-0.7 mm").tips_may_bottom
    assert GearSpec(29, "3 mm").dedendum > GearSpec(29, "3 mm").addendum
