"""Gaps at random poses against an independent search: points of one flank against the whole surface of the other.

The search knows only the definition of the involute. It takes points of wheel 1's flank in a section, finds their
distance to wheel 2's surface in space, along its normal, and looks for the smallest; where that is found beyond a tip,
the tip corner takes over. It works for overlapping flanks as well as for free ones.
"""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from gearmbs.contact import GAP_COLUMNS, pair_gaps
from gearmbs.gears import GearPair, GearSpec

from .probe_tools import Contact, rotation

REACH = 0.2e-3  # gaps compared, m, either way


def flank_place(gear, side, tooth, string):
    """Point of a flank in the plane of its wheel."""
    turn = side * gear.base_half_angle + 2 * np.pi * tooth / gear.teeth - side * string / gear.base_radius
    radial = np.array([np.cos(turn), np.sin(turn)])
    return gear.base_radius * radial + side * string * np.array([-radial[1], radial[0]])


def distance(gear, side, tooth, place):
    """Signed distance of a place in the wheel's plane from a flank, and the string length of its foot there."""
    radius = np.hypot(*place)
    if radius <= gear.base_radius:
        return 1.0, 0.0
    string = np.sqrt(radius**2 - gear.base_radius**2)
    tangent = np.arctan2(place[1], place[0]) - side * np.arctan2(string, gear.base_radius)
    rolled = side * (side * gear.base_half_angle + 2 * np.pi * tooth / gear.teeth - tangent)
    rolled -= 2 * np.pi * np.round((rolled - string / gear.base_radius) / (2 * np.pi))
    return string - gear.base_radius * rolled, gear.base_radius * rolled


class Search:
    """Two wheels at a pose, in a section across the mean of their axes."""

    def __init__(self, pair, frames):
        self.wheels, self.frames = pair.wheels, frames
        mean = frames[0][1][:, 2] + frames[1][1][:, 2]
        self.mean = mean / np.linalg.norm(mean)
        self.middle = 0.5 * (frames[0][0] + frames[1][0])

    def from_flank(self, wheel, side, teeth, station, string):
        """Distance of a point of one wheel's flank in the section from the other wheel's, and its foot."""
        origin, axes = self.frames[wheel]
        point = origin + axes[:, :2] @ flank_place(self.wheels[wheel], side, teeth[wheel], string)
        lift = (station - self.mean @ (point - self.middle)) / (self.mean @ axes[:, 2])
        origin_2, axes_2 = self.frames[1 - wheel]
        local = axes_2.T @ (point + lift * axes[:, 2] - origin_2)
        return distance(self.wheels[1 - wheel], side, teeth[1 - wheel], local[:2])

    def gap(self, side, teeth, station):
        """Kind of contact (0 flank on flank, 1 or 2 whose corner), gap and the two string lengths."""
        tip_1, tip_2 = (w.tip_roll_length for w in self.wheels)
        found = minimize_scalar(
            lambda s: self.from_flank(0, side, teeth, station, s)[0],
            bounds=(1e-6, 1.6 * tip_1),
            method="bounded",
            options={"xatol": 1e-9},
        )
        gap, foot = self.from_flank(0, side, teeth, station, found.x)
        if found.x <= tip_1 and foot <= tip_2:
            return 0, gap, found.x, foot
        if found.x - tip_1 > foot - tip_2:
            gap, foot = self.from_flank(0, side, teeth, station, tip_1)
            return 1, gap, tip_1, foot
        gap, foot = self.from_flank(1, side, teeth, station, tip_2)
        return 2, gap, foot, tip_2


def gears(z1, z2, module="2 mm", **changes):
    return GearPair(GearSpec(z1, module), GearSpec(z2, module), **changes)


PAIRS = {
    "29/29": GearPair.paper(backlash="0.3 mm"),
    "29/29 at +3 mm": GearPair.paper(centre_distance_error="3 mm"),
    "17/38": gears(17, 38, centre_distance_error="0.7 mm"),
    "62/62": gears(62, 62, centre_distance_error="1 mm"),
    "20/53 at -0.3 mm": gears(20, 53, "3 mm", centre_distance_error="-0.3 mm", backlash="0.8 mm"),
}


def random_frames(contact, rng):
    """Both wheels somewhere near each other: offset 0.1 mm, shifted 2 mm along the axes, each leaning 0.2 degrees."""
    state = contact.state(rng.uniform(0, 2 * np.pi), rng.uniform(-0.1e-3, 0.1e-3))
    frame, shift = rotation(rng.normal(size=3)), rng.normal(size=3) * 0.1
    frames = []
    for origin, axes in ((state[0], state[1]), (state[4], state[5])):
        moved = origin + rng.normal(size=3) * [1e-4, 1e-4, 2e-3]
        leaning = rotation(rng.normal(size=3) * [0.0035, 0.0035, 1e-3]) @ axes
        frames.append((frame @ moved + shift, np.ascontiguousarray(frame @ leaning)))
    return frames


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_gaps_at_random_poses(name):
    pair = PAIRS[name]
    contact = Contact(pair, 11)
    rng = np.random.default_rng(17)
    rows = np.zeros((600, len(GAP_COLUMNS)))
    worst = {0: 0.0, 1: 0.0, 2: 0.0}
    for _ in range(40):
        frames = random_frames(contact, rng)
        search = Search(pair, frames)
        count = pair_gaps(
            *(contact.gi, contact.gr, *frames[0], *frames[1], rng.uniform(-0.01, 0.01, 2), rows, contact.work)
        )
        for side, one, two, station, gap, kind in rows[:count, :6]:
            expected, distance, *_ = search.gap(int(side), (int(one), int(two)), station)
            if abs(distance) < REACH:
                assert kind == expected
                worst[expected] = max(worst[expected], abs(gap - distance))
    # every kind of contact was met; a lean of A along the normal costs gap A^2 / 2, at most 8e-9 at a degree
    assert min(worst.values()) > 0
    assert max(worst.values()) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("name", ["29/29 at +3 mm", "17/38"])
def test_no_pair_is_overlooked(name):
    pair = PAIRS[name]
    contact = Contact(pair, 11)
    rng = np.random.default_rng(3)
    rows = np.zeros((600, len(GAP_COLUMNS)))
    close = 0
    for _ in range(3):
        frames = random_frames(contact, rng)
        search = Search(pair, frames)
        count = pair_gaps(*(contact.gi, contact.gr, *frames[0], *frames[1], np.zeros(1), rows, contact.work))
        seen = {tuple(row[:3].astype(int)) for row in rows[:count]}
        # every tooth of one wheel against every tooth of the other
        for side in (1, -1):
            for one in range(pair.driver.teeth):
                for two in range(pair.driven.teeth):
                    _, gap, string_1, string_2 = search.gap(side, (one, two), 0.0)
                    facing = (
                        max(string_1 / pair.wheels[0].tip_roll_length, string_2 / pair.wheels[1].tip_roll_length) <= 1
                    )
                    if abs(gap) < REACH and facing and min(string_1, string_2) > 0:
                        close += 1
                        assert (side, one, two) in seen
    assert close >= 2


@pytest.mark.slow
def test_lean_beyond_a_degree_costs_its_square():
    # gap in the section against distance in space: gap A^2 / 2 with the lean A of the axes along the normal
    pair = GearPair.paper(backlash="1.9 mm")
    contact = Contact(pair, 11)
    rng = np.random.default_rng(5)
    rows = np.zeros((600, len(GAP_COLUMNS)))
    checked = 0
    for _ in range(20):
        frames = random_frames(contact, rng)
        lean = rotation(rng.normal(size=3) * 0.02)
        frames[1] = (frames[1][0], np.ascontiguousarray(lean @ frames[1][1]))
        search = Search(pair, frames)
        count = pair_gaps(*(contact.gi, contact.gr, *frames[0], *frames[1], np.zeros(1), rows, contact.work))
        for row in rows[:count]:
            kind, distance, *_ = search.gap(int(row[0]), (int(row[1]), int(row[2])), row[3])
            if abs(distance) < REACH and kind == row[5]:
                across = 0.5 * np.linalg.norm(frames[0][1][:, 2] - frames[1][1][:, 2])
                assert abs(row[4] - distance) < 0.5 * across**2 * abs(distance) + 1e-9
                checked += 1
    assert checked > 10
