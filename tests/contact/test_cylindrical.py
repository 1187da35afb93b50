"""Internal and helical wheels: gaps against searches on the tooth surfaces, derivatives, balances, limits."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec
from gearmbs.gears.transmission import StaticMesh, kinematic_transmission_error, loaded_transmission_error
from tests.contact.probe_tools import Contact, differences, rotation, shaken

HELIX = {"helix_angle": "15 deg"}
PAIRS = {
    "ring": GearPair(GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm"), backlash="0.2 mm"),
    "ring +0.4 mm": GearPair(
        GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm"), centre_distance_error="0.4 mm", backlash="0.9 mm", slices=7
    ),
    "ring -1 mm": GearPair(
        GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm", addendum="2 mm"), centre_distance_error="-1 mm", slices=7
    ),
    "ring +1 mm": GearPair(
        GearSpec(23, "3 mm"),
        GearSpec.ring(70, "3 mm", addendum="2.5 mm", dedendum="5 mm"),
        centre_distance_error="1 mm",
        backlash="1.4 mm",
    ),
    "ring skew": GearPair(GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm"), misalignment="1 deg", backlash="0.9 mm"),
    "ring inclination": GearPair(
        GearSpec(23, "3 mm", tip_rounding="0.2 mm"),
        GearSpec.ring(70, "3 mm", tip_rounding="0.15 mm"),
        misalignment="-1 deg",
        plane="inclination",
        backlash="0.9 mm",
        axial_shift="2 mm",
    ),
    "helical": GearPair(GearSpec(23, "3 mm", **HELIX), GearSpec(37, "3 mm", hand="left", **HELIX), backlash="0.2 mm"),
    "helical left, skew": GearPair(
        GearSpec(23, "3 mm", hand="left", **HELIX),
        GearSpec(37, "3 mm", **HELIX),
        misalignment="1 deg",
        backlash="0.9 mm",
        axial_shift="1.5 mm",
    ),
    "helical inclination": GearPair(
        GearSpec(23, "3 mm", **HELIX),
        GearSpec(37, "3 mm", hand="left", **HELIX),
        misalignment="1 deg",
        plane="inclination",
        backlash="0.9 mm",
        centre_distance_error="1 mm",
    ),
    "helical ring": GearPair(GearSpec(23, "3 mm", **HELIX), GearSpec.ring(70, "3 mm", **HELIX), backlash="0.2 mm"),
    "helical ring +1 mm": GearPair(
        GearSpec(23, "3 mm", **HELIX),
        GearSpec.ring(70, "3 mm", addendum="2.5 mm", dedendum="5 mm", **HELIX),
        centre_distance_error="1 mm",
        backlash="1.4 mm",
    ),
    "helical ring -1 mm": GearPair(
        GearSpec(23, "3 mm", **HELIX),
        GearSpec.ring(70, "3 mm", addendum="2 mm", **HELIX),
        centre_distance_error="-1 mm",
    ),
    "helical ring inclination": GearPair(
        GearSpec(23, "3 mm", **HELIX),
        GearSpec.ring(70, "3 mm", **HELIX),
        misalignment="1 deg",
        plane="inclination",
        backlash="0.9 mm",
    ),
    "helical ring skew": GearPair(
        GearSpec(23, "3 mm", hand="left", **HELIX),
        GearSpec.ring(70, "3 mm", hand="left", **HELIX),
        misalignment="1 deg",
        backlash="0.9 mm",
        axial_shift="-1 mm",
    ),
}


def surface_point(gear, side, tooth, string, z):
    """Point of a tooth flank in the wheel's frame, straight from the definition of the involute and the helix."""
    rb = gear.base_radius
    tangent = string / rb
    around = gear.base_half_angle - gear.sign * (tangent - math.atan(tangent))
    lead = (1 if gear.hand == "right" else -1) * math.tan(gear.helix_angle) / gear.pitch_radius
    angle = side * around + 2 * math.pi * tooth / gear.teeth + lead * z
    radius = math.hypot(rb, string)
    return np.array([radius * math.cos(angle), radius * math.sin(angle), z])


def rounding_point(gear, side, tooth, around, z):
    """Point of the rounding of a spur tooth's tip edge, ``around`` (rad) its axis from the direction of the tip on."""
    angle = side * gear.corner_half_angle + 2 * math.pi * tooth / gear.teeth
    c, s = gear.tip_rounding * math.cos(angle + around), gear.tip_rounding * math.sin(angle + around)
    return np.array([gear.corner_radius * math.cos(angle) + c, gear.corner_radius * math.sin(angle) + s, z])


def section_point(gear, side, tooth, at, frame, centre, normal, zeta, surface=surface_point):
    """Where a flank's curve of constant length of roll, or a line of a rounding, pierces the section plane."""
    origin, axes = frame
    z = 0.0
    for _ in range(12):
        point = origin + axes @ surface(gear, side, tooth, at, z)
        z -= (normal @ (point - centre) - zeta) / (normal @ axes[:, 2])
    return origin + axes @ surface(gear, side, tooth, at, z)


def gap_of_rounding(pair, place, row, bounds, section):
    """Distance of a rounded tip edge from the mate's flank in a section, m, by search; ``row`` is that of the gap."""
    side, i, j, _, _, kind = row[:6]
    corner = int(kind) - 1
    teeth, sides = (i, j), (side, side * pair.wheels[1].sign)

    def point(wheel, at):
        surface = rounding_point if wheel == corner else surface_point
        scale = 1.0 if wheel == corner else 1e-3
        gear = pair.wheels[wheel]
        return section_point(gear, sides[wheel], teeth[wheel], at * scale, place.frames[wheel], *section, surface)

    def distance(s):
        return 1e3 * np.linalg.norm(point(corner, s[0]) - point(1 - corner, s[1]))

    start = np.clip(abs(row[7 - corner]) * 1e3, *bounds[1 - corner])
    around = min(np.linspace(-math.pi, math.pi, 73), key=lambda angle: distance((angle, start)))
    limits = [(around - 0.5, around + 0.5), bounds[1 - corner]]
    found = minimize(
        distance, (around, start), bounds=limits, method="L-BFGS-B", options={"ftol": 1e-16, "gtol": 1e-13}
    )
    options = {"xatol": 1e-11, "fatol": 1e-13, "maxiter": 2000}
    return 1e-3 * minimize(distance, found.x, bounds=limits, method="Nelder-Mead", options=options).fun


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_section_gap_against_search(name):
    pair = PAIRS[name]
    mesh = StaticMesh(pair)
    one, two = pair.wheels
    rng = np.random.default_rng(11)
    kinds, worst, looked = set(), 0.0, 0
    for driver_angle in rng.uniform(0, 2 * np.pi, 2):
        driven = mesh.touching_angle(driver_angle) - pair.sign * 60e-6 / two.base_radius
        place = pair.frames(driver_angle, driven)
        normal = place.axes_1[:, 2] + place.axes_2[:, 2]
        normal /= np.linalg.norm(normal)
        centre = 0.5 * (place.origin_1 + place.origin_2)
        low, high = np.sort([one.sign * one.tip_roll_length, one.base_radius * 0.02]) * 1e3
        tip = two.tip_roll_length * 1e3
        far = math.sqrt(two.root_radius**2 - two.base_radius**2) * 1e3 if two.internal else 0.02 * two.base_radius * 1e3
        bounds = [(low, high), (min(tip, far), max(tip, far))]
        for row in mesh.gaps(driver_angle, driven, np.array([-0.008, 0.003])).copy():
            side, i, j, zeta, gap, kind = row[:6]
            if not 0 < gap < 0.4e-3:
                continue
            kinds.add(int(kind))
            looked += 1

            def distance(s, side=side, i=i, j=j, zeta=zeta, place=place, centre=centre, normal=normal):
                p = section_point(one, side, i, s[0] * 1e-3, place.frames[0], centre, normal, zeta)
                q = section_point(two, side * two.sign, j, s[1] * 1e-3, place.frames[1], centre, normal, zeta)
                return 1e3 * np.linalg.norm(p - q)

            if one.tip_rounding and kind:
                worst = max(worst, abs(gap_of_rounding(pair, place, row, bounds, (centre, normal, zeta)) - gap))
                continue
            start = [np.clip(abs(r) * 1e3, *b) for r, b in zip(row[6:8], bounds)]
            found = minimize(distance, start, bounds=bounds, method="L-BFGS-B", options={"ftol": 1e-16, "gtol": 1e-13})
            options = {"xatol": 1e-10, "fatol": 1e-13}
            found = minimize(distance, found.x, bounds=bounds, method="Nelder-Mead", options=options)

            worst = max(worst, abs(found.fun * 1e-3 - gap))
    assert looked > 3
    assert 0 in kinds
    assert worst < 1e-8


def column_errors(contact, state):
    """Largest error of each of the 24 columns of the derivatives, relative to the column's largest number.

    A quotient across a change of contact is no derivative, since the gap bends there: of several steps the best counts.
    Those as large as 8 are for columns that are small: rounding is that of the stiffest direction, and where one of the
    axes is nearly at right angles to the force its columns are a thousandth of that.
    """
    contact(state, 1)
    exact = contact.jac.copy()
    scale = abs(exact).max(axis=0)
    shares = (8.0, 2.0, 0.5, 0.1, 0.02, 0.005)
    return np.min([abs(differences(contact, state, share) - exact).max(axis=0) / scale for share in shares], axis=0)


@pytest.mark.parametrize("name", PAIRS)
def test_derivatives_of_each_column(name):
    rng = np.random.default_rng(3)
    contact = Contact(PAIRS[name])
    for _ in range(3):
        state = shaken(contact.state(rng.uniform(0, 6), rng.uniform(5e-5, 9e-5), 50.0), rng)
        assert np.linalg.norm(contact(state, 1)[:3]) > 1
        assert column_errors(contact, state).max() < 1e-6


FRICTIONLESS = FlankFriction.none()
LINEAR = ContactLaw.linear("4e8 N/m")


def whole_overlap(ring=False):
    """Pairs whose overlap ratio is one, or nothing: with a helix of any angle the contact line is constant."""
    width = math.pi * 3e-3 / math.sin(math.radians(15))
    sizes = {"contact": LINEAR, "friction": FRICTIONLESS, "torque": 300.0}
    mate = {"internal": True, "hand": "right"} if ring else {"hand": "left"}
    one = GearSpec(23, "3 mm", face_width=width, **HELIX)
    return GearPair(one, GearSpec(70 if ring else 37, "3 mm", face_width=width, **mate, **HELIX), slices=60, **sizes)


@pytest.mark.parametrize("name", ["ring", "ring +0.4 mm", "helical", "helical ring"])
def test_kinematic_transmission_error_vanishes(name):
    error = kinematic_transmission_error(PAIRS[name], 12)
    assert abs(error.error).max() < 1e-12


@pytest.mark.parametrize("name", ["ring", "helical", "helical ring"])
def test_ratio_of_torques_and_axial_force(name):
    pair = PAIRS[name].with_changes(friction=FRICTIONLESS, contact=LINEAR)
    contact = Contact(pair)
    for angle in (0.3, 0.41, 0.52):
        state = contact.state(angle, 1e-11)
        wrench = contact(state)
        arm = state[4] - state[0]
        on_driven = -wrench[3:] + np.cross(arm, wrench[:3])
        # the same sense on both axes for an external pair, the opposite one for an internal
        assert on_driven[2] / wrench[5] == pytest.approx(pair.sign * pair.ratio, rel=1e-8)
        tangential = abs(wrench[5]) / pair.driver.pitch_radius
        assert abs(wrench[2]) == pytest.approx(tangential * math.tan(pair.driver.helix_angle), rel=1e-8)
        # the driver is held back: a right-hand one that turns to the left is pushed towards -z
        assert wrench[5] < 0
        if pair.driver.helix_angle:
            assert wrench[2] * (1 if pair.driver.hand == "right" else -1) > 0
        normal = tangential / math.cos(pair.driver.transverse_pressure_angle) / math.cos(pair.driver.base_helix_angle)
        assert contact.diag[7] == pytest.approx(normal, rel=1e-8)


@pytest.mark.parametrize("ring", [False, True])
def test_transmission_error_is_constant_at_whole_overlap_ratios(ring):
    pair = whole_overlap(ring)
    assert pair.overlap_ratio == pytest.approx(1, abs=1e-12)
    spur = GearPair(
        GearSpec(23, "3 mm"),
        GearSpec(70 if ring else 37, "3 mm", internal=ring),
        contact=LINEAR,
        friction=FRICTIONLESS,
        torque=300.0,
    )
    ripple, most = (loaded_transmission_error(p, points=24).peak_to_peak for p in (pair, spur))
    assert ripple < 0.01 * most


@pytest.mark.parametrize("name", ["ring", "ring skew", "helical", "helical left, skew", "helical ring skew"])
def test_closed_cycle_does_no_work(name):
    contact = Contact(PAIRS[name].with_changes(friction=FRICTIONLESS, contact=LINEAR, slices=20))
    rng = np.random.default_rng(5)
    start = contact.state(0.4, 60e-6)
    shift, turn = rng.normal(size=(2, 2, 3)) * 3e-6, rng.normal(size=(2, 2, 3)) * 6e-5

    def at(angle):
        c, s = math.cos(angle), math.sin(angle)
        state = [a.copy() for a in start]
        state[0] += c * shift[0, 0] + s * shift[0, 1]
        state[1] = rotation(c * turn[0, 0] + s * turn[0, 1]) @ state[1]
        return state

    work, count, step = 0.0, 400, 1e-4
    energies = []
    for k in range(count):
        angle = 2 * math.pi * (k + 0.5) / count
        near = [at(angle + m * step) for m in (1, -1, 2, -2)]
        state = at(angle)
        wrench = contact(state)
        energies.append(contact.diag[0])
        moved, spun = ((8 * (near[0][i] - near[1][i]) - (near[2][i] - near[3][i])) / (12 * step) for i in (0, 1))
        spun = spun @ state[1].T
        spin = 0.5 * np.array([spun[2, 1] - spun[1, 2], spun[0, 2] - spun[2, 0], spun[1, 0] - spun[0, 1]])
        work += (wrench[:3] @ moved + wrench[3:] @ spin) * 2 * math.pi / count
    assert np.ptp(energies) > 0.1 * max(energies)
    assert abs(work) < 1e-8 * max(energies)


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_random_poses_are_finite_and_never_pull(name):
    contact = Contact(PAIRS[name].with_changes(slices=min(PAIRS[name].face_slices, 11)))
    rng = np.random.default_rng(7)
    for _ in range(300):
        state = contact.state(rng.uniform(0, 6), rng.uniform(-1e-4, 3e-4), rng.normal() * 100)
        state = shaken(state, rng, shift=rng.choice([1e-6, 1e-4, 1e-3]), turn=rng.choice([1e-5, 3e-3]), speed=1.0)
        wrench = contact(state, 1)
        assert np.isfinite(wrench).all()
        assert np.isfinite(contact.jac).all()
        assert contact.diag[7] >= 0
        assert contact.diag[0] >= 0


CORNERS = {
    "external": GearPair.paper(centre_distance_error="5 mm", contact=LINEAR),
    "ring": GearPair(
        GearSpec(23, "3 mm"),
        GearSpec.ring(70, "3 mm", addendum="2 mm"),
        centre_distance_error="-3 mm",
        backlash="0.2 mm",
        contact=LINEAR,
    ),
}
"""Wheels that mesh so little that often the corner of one alone bears."""


@pytest.mark.parametrize("name", CORNERS)
def test_friction_on_tip_corners(name):
    pair = CORNERS[name]
    contact, smooth = Contact(pair, 1), Contact(pair.with_changes(friction=FRICTIONLESS), 1)
    depth, kinds = 20e-6, set()
    for angle in np.linspace(0, 2 * math.pi / pair.driver.teeth, 25):
        state = contact.state(angle, depth, 1500.0)
        driven = contact.mesh.touching_angle(angle) + pair.sign * pair.rotation * depth / pair.driven.base_radius
        rows = contact.mesh.gaps(angle, driven, np.zeros(1)).copy()
        touching = rows[rows[:, 4] < 0]
        if len(touching) != 1 or not touching[0, 5] or not smooth(state).any():
            continue
        side, *teeth = touching[0, :3]
        bears = int(touching[0, 5]) - 1
        gear, tooth = pair.wheels[bears], teeth[bears]
        corner_side = side * (gear.sign if bears else 1)
        polar = corner_side * gear.corner_half_angle + 2 * math.pi * tooth / gear.teeth
        corner = gear.corner_radius * np.array([math.cos(polar), math.sin(polar), 0.0])
        point = state[4 * bears] + state[4 * bears + 1] @ corner
        pressing = smooth(state)
        load = contact(state)[:3] - pressing[:3]
        normal = pressing[:3] / np.linalg.norm(pressing[:3])
        sliding = np.cross(state[3], point - state[0]) - np.cross(state[7], point - state[4])
        sliding -= normal * (normal @ sliding)
        speed = np.linalg.norm(sliding)
        if speed < pair.friction.dynamic_speed:
            continue
        kinds.add(bears)
        expected = -pair.friction.dynamic * np.linalg.norm(pressing[:3]) * sliding / speed
        np.testing.assert_allclose(load, expected, atol=1e-9 * np.linalg.norm(pressing[:3]))
        # the force acts half-way between the surfaces, half the depth from the corner
        turn = contact(state)[3:] - pressing[3:] - np.cross(point - state[0], load)
        assert np.linalg.norm(turn) < 0.51 * depth * np.linalg.norm(load)
        # and slides slower or faster by what the wheels turn against each other
        slack = 0.51 * depth * np.linalg.norm(state[3] - state[7])
        assert contact.diag[2] == pytest.approx(np.linalg.norm(load) * speed, abs=np.linalg.norm(load) * slack)
    assert kinds == {0, 1}


@pytest.mark.parametrize(("helix", "slices"), [("0 deg", 1), ("0 deg", 5), ("15 deg", 9)])
@pytest.mark.slow
def test_derivatives_where_a_corner_leaves_the_tip_of_its_mate(helix, slices):
    # tips pass 20 and 35 um apart, so that corners 60 um deep leave the ring's flank over its edge
    one, ring = GearSpec(23, "3 mm", helix_angle=helix), GearSpec.ring(70, "3 mm", addendum="2 mm", helix_angle=helix)
    pair = GearPair(one, ring, centre_distance_error="-3 mm", backlash="0.2 mm", slices=slices)
    contact, rng, met = Contact(pair), np.random.default_rng(3), 0
    depth, tip = 60e-6, -ring.tip_roll_length
    for angle in np.linspace(0, 2 * math.pi / 23, 240, endpoint=False):
        driven = contact.mesh.touching_angle(angle) + contact.mesh.turning * depth / pair.driven.base_radius
        rows = contact.mesh.gaps(angle, driven, np.zeros(1))
        leaving = (rows[:, 4] < 0) & (rows[:, 5] == 1) & (rows[:, 7] + 0.5 * rows[:, 4] > tip)
        if leaving.any() and met < 4:
            met += 1
            assert column_errors(contact, shaken(contact.state(angle, depth, 50.0), rng)).max() < 1e-6
    assert met >= 3
