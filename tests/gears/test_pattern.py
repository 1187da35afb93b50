"""Contact pattern, load sharing and histories."""

import math

import numpy as np
import pytest

from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec
from gearmbs.gears.faults import Crowning, RootCrack
from gearmbs.gears.pattern import contact_history, contact_pattern
from tests.says import says


def test_healthy_pattern_is_even_and_carries_the_load():
    pair = GearPair.paper()
    pattern = contact_pattern(pair, 100.0, points=41)
    assert np.ptp(pattern.pressure, axis=1) == pytest.approx(0, abs=1e-6 * pattern.pressure.max())
    assert pattern.face_load_factor == pytest.approx(1.0)
    middle = pattern.pressure[20]
    # alone at the pitch point: F_n = T / r_b over 20 mm
    assert pattern.roll_angle[20] == pytest.approx(0, abs=1e-12)
    assert middle.mean() == pytest.approx(pair.normal_force / 20e-3, rel=1e-6)
    assert pattern.share.max() == pytest.approx(1.0)
    assert pattern.roll_length[20, 0] == pytest.approx(pair.driver.base_radius * np.tan(np.radians(20)), rel=1e-3)


@pytest.mark.parametrize("teeth", [17, 25])
def test_helical_faces_without_tilt_are_loaded_evenly(teeth):
    """Each section is in contact for a part of the engagement; what is left is the sum of lengths of contact lines."""
    wheels = [GearSpec(z, "4 mm", helix_angle="10 deg", hand=hand, face_width="40 mm")
              for z, hand in ((teeth, "right"), (68, "left"))]  # fmt: skip
    pattern = contact_pattern(GearPair(*wheels, torque=770.0).with_own_stiffness(), sections=21)
    assert 1.0 < pattern.face_load_factor < 1.03


@pytest.mark.slow
@pytest.mark.parametrize("rotation", [1, -1])
def test_shares_of_a_tooth_and_the_next_add_up(rotation):
    pattern = contact_pattern(GearPair.paper(rotation=rotation), 100.0, points=400)
    roll = 2 * np.pi / 29
    at = np.linspace(pattern.roll_angle[0], pattern.roll_angle[0] + roll, 40)
    total = sum(np.interp(at + k * roll, pattern.roll_angle, pattern.share, 0, 0) for k in range(-1, 4))
    assert total == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
def test_skew_loads_the_ends_of_the_face():
    pair = GearPair.paper(misalignment="1 deg", contact=ContactLaw.impact())
    drive, back = contact_pattern(pair, 100.0), contact_pattern(pair, 100.0, side="coast")
    heavy = [p.section[p.pressure.sum(axis=0).argmax()] for p in (drive, back)]
    assert abs(heavy[0]) > 8e-3
    assert abs(heavy[1]) > 8e-3
    assert heavy[0] * heavy[1] < 0
    assert drive.face_load_factor > 2


@pytest.mark.parametrize("load", ["slices", "adams"])
@pytest.mark.parametrize(
    ("placed", "most"),
    [
        ({}, 0.0),
        ({"axial_shift": "4 mm"}, 0.0),
        ({"misalignment": "0.1 deg", "backlash": "0.1 mm"}, 0.0),
        ({"misalignment": "0.3 deg", "pivot": "10 mm", "backlash": "0.2 mm"}, 0.0),
        ({"misalignment": "1 deg", "plane": "inclination", "backlash": "0.15 mm"}, 0.0),
        ({"misalignment": "1 deg", "backlash": "0.1 mm"}, 0.03),
    ],
)
def test_totals_carry_the_torque(load, placed, most):
    # T = (F_drive - F_back) r_b, but for corners, whose arm differs: 1 % here, more of the forces of jammed teeth
    pair = GearPair.paper(load=load, **placed)
    drive, back = (contact_pattern(pair, 100.0, points=15, side=side) for side in ("drive", "coast"))
    miss = (drive.total - back.total) * pair.driven.base_radius - 100.0
    assert abs(miss).max() < 1.5 + most * drive.total.max() * pair.driven.base_radius
    if most == 0:
        assert abs(np.median(miss)) < 0.2
    assert np.all(drive.force <= drive.total * (1 + 1e-12))


def test_any_tooth_can_be_followed():
    faulty = GearPair.paper(faults=[RootCrack(depth="3 mm", tooth=7)])
    healthy = contact_pattern(GearPair.paper(), 100.0, points=21, tooth=7)
    with pytest.warns(UserWarning, match=says("tooth 7", "tooth=")):
        sound = contact_pattern(faulty, 100.0, points=21)
    cracked = contact_pattern(faulty, 100.0, points=21, tooth=7)
    assert sound.force == pytest.approx(healthy.force, abs=1e-6 * healthy.force.max())
    assert cracked.force.sum() < 0.99 * healthy.force.sum()
    same = contact_pattern(GearPair.paper(faults=[RootCrack(depth="3 mm", tooth=0)]), 100.0, points=21)
    assert cracked.force == pytest.approx(same.force, abs=1e-6 * healthy.force.max())


@pytest.mark.parametrize(("rotation", "tooth"), [(1, 0), (1, 40), (-1, 51)])
def test_any_tooth_of_the_driven_wheel_can_be_followed(rotation, tooth):
    """It meets the driver some turns on; what its root gives is what that of any other does."""
    wheels = (GearSpec(21, "3 mm", face_width="20 mm"), GearSpec(52, "3 mm", face_width="20 mm"))

    def followed(faults=(), **tooth):
        pair = GearPair(*wheels, rotation=rotation, torque=100.0, faults=faults)
        return contact_pattern(pair, points=21, sections=3, **tooth).force

    sound = followed()
    cracked = followed([RootCrack(depth="3 mm", wheel="driven", tooth=tooth)], mate=tooth)
    assert cracked.sum() < 0.97 * sound.sum()
    other = followed([RootCrack(depth="3 mm", wheel="driven", tooth=7)], mate=7)
    assert cracked == pytest.approx(other, abs=1e-6 * sound.max())
    assert followed(mate=tooth) == pytest.approx(sound, abs=1e-6 * sound.max())


def test_crowning_loads_the_middle():
    pattern = contact_pattern(GearPair.paper(faults=[Crowning(amount="40 um")]), 100.0)
    assert abs(pattern.section[pattern.pressure.sum(axis=0).argmax()]) < 1e-3


def test_cracked_tooth_carries_less():
    healthy = contact_pattern(GearPair.paper(), 100.0, points=60)
    cracked = contact_pattern(GearPair.paper(faults=[RootCrack(depth="3 mm", tooth=0)]), 100.0, points=60)
    assert cracked.force.sum() < healthy.force.sum()


def test_history_counts_separations_and_coast_hits():
    pair = GearPair.paper(backlash="20 um", friction=FlankFriction.none())
    n = 400
    turn = np.linspace(0, 2 * np.pi, n)
    # the driven wheel swings from drive flank to back flank and back, four times
    depth = 10e-6 * np.cos(4 * turn) * 2 - 10e-6
    start = pair.driven_angle(0.0)
    frames = [pair.frames(0.0, start + d / pair.driven.base_radius) for d in depth]
    zero = np.zeros((n, 3))
    history = contact_history(
        pair,
        (np.array([f.origin_1 for f in frames]), np.array([f.axes_1 for f in frames]), zero, zero),
        (np.array([f.origin_2 for f in frames]), np.array([f.axes_2 for f in frames]), zero, zero),
    )
    assert history.coast_hits == 4
    assert history.separations == 8
    assert history.drive_penetration.max() == pytest.approx(10e-6, rel=1e-6)
    assert history.coast_penetration.max() == pytest.approx(10e-6, rel=1e-2)
    assert np.all(history.damping_power >= 0)
    with pytest.raises(ValueError, match=says("driver", "driven", "399", "instants", "give")):
        contact_history(pair, (zero, np.zeros((n, 3, 3)), zero, zero), (zero[1:], np.zeros((n, 3, 3)), zero, zero))


@pytest.mark.parametrize("internal", [False, True])
@pytest.mark.parametrize("helix", [0.0, 0.26])
def test_tooth_of_any_kind_of_wheel_passes_its_engagement(helix, internal):
    one = GearSpec(23, "3 mm", helix_angle=helix)
    two = GearSpec(70, "3 mm", helix_angle=helix, internal=internal, hand="right" if internal else "left")
    pair = GearPair(one, two, backlash="0.2 mm", friction=FlankFriction.none())
    found = contact_pattern(pair, torque=200.0, points=61, sections=21)
    assert found.force[0] == found.force[-1] == 0
    # loaded for the total contact ratio, in pitches, a little longer by the load
    pitches = found.roll_angle * one.teeth / (2 * math.pi)
    loaded = np.ptp(pitches[found.force > 0])
    step = pitches[1] - pitches[0]
    assert pair.total_contact_ratio - 2 * step < loaded < pair.total_contact_ratio + 0.25 + 2 * step
    torque = found.total * two.base_radius * math.cos(two.base_helix_angle)
    assert torque == pytest.approx(200.0, rel=0.015)
    # teeth one pitch apart share the load
    middle = abs(pitches - pitches.mean()).argmin()
    assert 0.2 < found.share[middle] <= 1
