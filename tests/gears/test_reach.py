"""How far tip corners reach, on pairs at random: placement, transmission error, and forces without a step.

The seed is ``GEARMBS_SEED``, the number of pairs ``GEARMBS_CASES``.
"""

import math

import numpy as np
import pytest

from gearmbs.contact.probe import KIND, ROLL_1, ROLL_2
from gearmbs.gears import GearPair, GearSpec, kinematic_transmission_error, loaded_transmission_error
from gearmbs.gears.tables import corner_reach
from gearmbs.gears.transmission import GAP, SIDE, StaticMesh
from tests.gears.random_pairs import ELASTIC, pairs
from tests.generators import cases, seed

POSITIONS = 200  # over a mesh cycle
HALVINGS = 10  # of the spacing where the force changes most: a smooth one then changes by 2e-4 of its largest value
STEP = 1e-3


def pressed(mesh, angle, depth):
    """Torque on the driven wheel with the flanks a depth (m, at the base circle) beyond where endless ones touch."""
    turn = mesh.turning * depth / mesh.geometry.driven.base_radius
    return mesh.torque(mesh.rotation * angle, mesh.ideal_angle(mesh.rotation * angle) + turn)[0]


def largest_step(function, pitch):
    """Largest change over a spacing that is halved again and again where most changes, over the largest value."""
    at = np.linspace(0.0, pitch, POSITIONS + 1)
    values = np.array([function(x) for x in at])
    worst = 0.0
    for k in np.argsort(abs(np.diff(values)))[-3:]:
        low, high = at[k], at[k + 1]
        below, above = values[k], values[k + 1]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            value = function(middle)
            if abs(value - below) > abs(above - value):
                high, above = middle, value
            else:
                low, below = middle, value
        worst = max(worst, abs(above - below))
    return worst / abs(values).max()


def check(pair, label):
    pitch = 2 * math.pi / pair.driver.teeth
    error = kinematic_transmission_error(pair, 24)
    if pair.contact_ratio > 1:
        assert abs(error.error).max() < 1e-9, label
    mesh = StaticMesh(pair)
    for phase in (0.0, 0.3, 0.7):
        angle = mesh.rotation * phase * pitch
        gaps = mesh.gaps(angle, mesh.touching_angle(angle))
        # the coast flanks overlap where the drawing has negative backlash
        free = gaps if pair.normal_backlash > 0 else gaps[gaps[:, SIDE] == mesh.rotation]
        assert free[:, GAP].min() > -1e-9, label
    for depth in (5e-6, 20e-6, 60e-6):
        assert largest_step(lambda x, depth=depth: pressed(mesh, x, depth), pitch) < STEP, (label, depth)


@pytest.mark.slow
@pytest.mark.parametrize("internal", [True, False])
def test_pairs_at_random(internal):
    rng = np.random.default_rng(seed())
    for k, pair in enumerate(pairs(rng, cases(25), internal)):
        check(pair, f"pair {k} of seed {seed()}: {pair}")


@pytest.mark.slow
def test_pairs_far_apart():
    # contact ratios mostly below one: tip corners carry the motion over part of the cycle
    rng, below = np.random.default_rng(seed()), 0
    for k, pair in enumerate(pairs(rng, cases(25), False, apart=1.2)):
        try:
            check(pair, f"pair {k} of seed {seed()}: {pair}")
        except ValueError as error:
            assert "lose each other" in str(error)  # noqa: PT017
            assert pair.contact_ratio < 0.6
        below += pair.contact_ratio < 1
    assert below


def test_few_teeth_of_difference():
    # corners of other teeth, without a foot on the mate, once placed this pair 0.6 mm deep
    one = GearSpec(17, "2 mm", helix_angle="20 deg", profile_shift=0.3)
    ring = GearSpec.ring(34, "2 mm", helix_angle="20 deg", addendum="1.6 mm")
    pair = GearPair(one, ring, backlash="0.2 mm")
    assert kinematic_transmission_error(pair, 40).peak_to_peak < 1e-12


@pytest.mark.slow
def test_corners_of_a_ring_leave_slowly():
    # with ten teeth of difference a corner stays within 60 um of its mate for two pitches beyond the path
    pair = GearPair(GearSpec(60, "2 mm"), GearSpec.ring(70, "2 mm", addendum="1.6 mm"), **ELASTIC)
    error = loaded_transmission_error(pair, 700.0).error
    assert abs(np.diff(error)).max() < 0.02 * np.ptp(error)
    assert np.ptp(error) < 0.7e-6
    reach = corner_reach(pair.geometry, 0)
    assert reach.length > 8 * pair.driver.base_pitch
    needed, free = pair.fouling_angles
    # tips pass with what the check of fouling tips leaves free
    assert reach.passing_gap == pytest.approx((free - needed) * pair.driven.base_radius, rel=0.03)


def test_wide_helical_wheels_have_room_for_all_their_rows():
    # 40 mm of 0.66 mm teeth at 35 degrees: more than a hundred slices
    kind = {"helix_angle": "35 deg", "pressure_angle": "20 deg", "face_width": "40 mm"}
    pair = GearPair(
        GearSpec(60, "0.66 mm", **kind), GearSpec.ring(94, "0.66 mm", addendum="0.5 mm", **kind), rotation=-1
    )
    assert pair.face_slices > 100
    assert abs(kinematic_transmission_error(pair, 6).error).max() < 1e-9
    mesh = StaticMesh(pair)
    gaps = mesh.gaps(0.0, mesh.ideal_angle(0.0))
    assert len(gaps) < len(mesh.rows)
    assert np.unique(gaps[:, SIDE]).tolist() == [-1.0, 1.0]


# --- against sampled profiles ----------------------------------------------------------------------------------------
SAMPLES = 4000


def outline(gear):
    """Radii and polar angles of the flank that faces counter-clockwise of a tooth on the x axis, root to tip."""
    rb = gear.base_radius
    roll = np.linspace(gear.form_roll_length, gear.tip_roll_length, SAMPLES)
    around = gear.base_half_angle - gear.sign * (roll / rb - np.arctan(roll / rb))
    return np.hypot(rb, roll), around


def first_touch(pair, driver_angle):
    """Driven angle at which sampled flanks first meet, the driver turning counter-clockwise, and how close, m.

    Knows nothing of tooth pairs, corners or paths of contact. Each point of the driver's flanks is compared with the
    mate's flank at the same distance from the mate's axis, its tip included: where it has no flank, nothing is met.
    """
    one, two = pair.wheels
    ideal = StaticMesh(pair).ideal_angle(driver_angle)
    mate_radius, mate_around = outline(two)
    order = np.argsort(mate_radius)
    tip, pitch = mate_radius[-1], 2 * math.pi / two.teeth
    radius, around = outline(one)
    least = math.inf
    for tooth in range(one.teeth):
        angle = driver_angle + 2 * math.pi * tooth / one.teeth + around
        place = radius * np.exp(1j * angle) - pair.centre_distance
        crossing = np.flatnonzero(np.diff(np.sign(abs(place) - tip)))
        part = (tip - abs(place[crossing])) / (abs(place[crossing + 1]) - abs(place[crossing]))
        at_tip = place[crossing] + part * (place[crossing + 1] - place[crossing])
        inside = (abs(place) >= mate_radius.min()) & (abs(place) <= mate_radius.max())
        place = np.append(place[inside], at_tip * tip / abs(at_tip))
        flank = np.interp(abs(place), mate_radius[order], mate_around[order])
        # flanks that meet face counter-clockwise on both external wheels, and clockwise on a ring
        free = pair.sign * (np.angle(place) - ideal) - flank
        # overlaps of a seventh of a pitch count as such, more than that is the room ahead of the next tooth
        least = min(least, ((free + pitch / 7) % pitch - pitch / 7).min(initial=math.inf))
    return ideal + pair.sign * least


SAMPLED = {
    "external": GearPair.paper(backlash="0.1 mm"),
    "external, contact ratio 0.77": GearPair.paper(centre_distance_error="3 mm"),
    "external, contact ratio 0.4": GearPair(GearSpec(20, "2 mm"), GearSpec(53, "2 mm"), centre_distance_error="2.2 mm"),
    "external, shifted": GearPair(GearSpec(17, "2 mm", profile_shift=0.4), GearSpec(38, "2 mm", profile_shift=-0.1)),
    "ring, 8 teeth of difference": GearPair(
        GearSpec(32, "2 mm", addendum="1.4 mm"),
        GearSpec.ring(40, "2 mm", addendum="1.2 mm", outward_shift=0.25),
        backlash="0.1 mm",
    ),
    "ring, 10 teeth of difference": GearPair(GearSpec(60, "2 mm"), GearSpec.ring(70, "2 mm", addendum="1.6 mm")),
    "ring, 17 teeth of difference": GearPair(
        GearSpec(17, "2 mm", profile_shift=0.3), GearSpec.ring(34, "2 mm", addendum="1.6 mm"), backlash="0.2 mm"
    ),
    "ring, 47 teeth of difference": GearPair(GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm"), backlash="0.2 mm"),
    "ring, contact ratio 0.25": GearPair(
        GearSpec(23, "3 mm"),
        GearSpec.ring(70, "3 mm", addendum="2 mm"),
        centre_distance_error="-3 mm",
        backlash="0.2 mm",
    ),
}


@pytest.mark.parametrize("name", SAMPLED)
def test_touching_against_sampled_flanks(name):
    pair = SAMPLED[name]
    mesh = StaticMesh(pair)
    for phase in np.random.default_rng(seed()).uniform(0, 1, 8):
        angle = phase * 2 * math.pi / pair.driver.teeth
        touching = mesh.touching_angle(angle)
        closer = pair.sign * (first_touch(pair, angle) - touching) * pair.driven.base_radius
        label = f"{name} at {phase} of a pitch: {closer:.2e} m"
        # chords of the samples are off by 1e-10 m
        if on_both_corners(mesh, angle, touching):
            # sharp corners let go of each other at once, rounded edges (docs/theory/contact.md) somewhat later
            assert -5e-9 < closer < 10e-6, label
        else:
            assert abs(closer) < 5e-9, label


def on_both_corners(mesh, driver_angle, driven_angle):
    """Whether a wheel's tip corner touches the mate behind the mate's own tip."""
    gaps = mesh.gaps(driver_angle, driven_angle)
    touching = gaps[abs(gaps[:, GAP]) < 1e-9]
    tips = [gear.sign * gear.tip_roll_length for gear in (mesh.geometry.driver, mesh.geometry.driven)]
    beyond = [touching[:, (ROLL_1, ROLL_2)[k]] > tips[k] + 1e-12 for k in range(2)]
    return bool(np.any((touching[:, KIND] == 1) & beyond[1] | (touching[:, KIND] == 2) & beyond[0]))
