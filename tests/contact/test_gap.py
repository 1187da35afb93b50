"""Gaps of tooth pairs against brute-force searches over both surfaces."""

import numpy as np
import pytest
from scipy.optimize import minimize

from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.transmission import StaticMesh


def flank_point(gear, side, tooth, string, z):
    """Point of a tooth flank in the wheel's frame, straight from the definition of the involute."""
    start = side * gear.base_half_angle + 2 * np.pi * tooth / gear.teeth
    tangent = start - side * string / gear.base_radius
    c, s = np.cos(tangent), np.sin(tangent)
    return np.array(
        [gear.base_radius * c - side * string * s, gear.base_radius * s + side * string * c, z]
    )  # the string leaves the base circle at right angles


def section_point(gear, side, tooth, string, origin, axes, centre, normal, zeta):
    """Where the generator of a flank at ``string`` pierces the section plane."""
    foot = origin + axes @ flank_point(gear, side, tooth, string, 0.0)
    axis = axes[:, 2]
    return foot + axis * (zeta - normal @ (foot - centre)) / (normal @ axis)


def nearest(distance, bounds, starts):
    """Smallest value of a function of the two strings, by bounded minimisation from several starts."""
    best = np.inf
    for start in starts:
        found = minimize(distance, start, bounds=bounds, method="L-BFGS-B", options={"ftol": 1e-16, "gtol": 1e-13})
        found = minimize(
            distance, found.x, bounds=bounds, method="Nelder-Mead", options={"xatol": 1e-11, "fatol": 1e-13}
        )
        best = min(best, found.fun)
    return best


PAIRS = {
    "29/29": GearPair.paper(backlash="0.3 mm"),
    "29/29 skew": GearPair.paper(backlash="0.9 mm", misalignment="1 deg"),
    "29/29 inclination": GearPair.paper(backlash="0.9 mm", misalignment="1 deg", plane="inclination"),
    "29/29 +3 mm, skew": GearPair.paper(centre_distance_error="3 mm", misalignment="-1 deg"),
    "17/38 both": GearPair(
        GearSpec(17, "2 mm"), GearSpec(38, "2 mm"), misalignment="1 deg", centre_distance_error="0.7 mm", slices=5
    ),
    "20/53 -0.3 mm": GearPair(
        GearSpec(20, "3 mm", profile_shift=0.1),
        GearSpec(53, "3 mm", profile_shift=-0.1),
        centre_distance_error="-0.3 mm",
        backlash="0.8 mm",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_section_gap_against_search(name):
    pair = PAIRS[name]
    mesh = StaticMesh(pair)
    one, two = pair.wheels
    rng = np.random.default_rng(11)
    kinds = set()
    worst = 0.0
    for driver_angle in rng.uniform(0, 2 * np.pi, 4):
        driven = mesh.touching_angle(driver_angle) - 60e-6 / two.base_radius
        place = pair.frames(driver_angle, driven)
        normal = place.axes_1[:, 2] + place.axes_2[:, 2]
        normal /= np.linalg.norm(normal)
        centre = 0.5 * (place.origin_1 + place.origin_2)
        for row in mesh.gaps(driver_angle, driven, np.array([-0.008, 0.003])).copy():
            side, i, j, zeta, gap, kind = row[:6]
            if not 0 < gap < 0.6e-3:
                continue
            kinds.add(int(kind))

            def distance(s, side=side, i=i, j=j, zeta=zeta, place=place, centre=centre, normal=normal):
                p = section_point(one, side, i, s[0] * 1e-3, place.origin_1, place.axes_1, centre, normal, zeta)
                q = section_point(two, side, j, s[1] * 1e-3, place.origin_2, place.axes_2, centre, normal, zeta)
                return 1e3 * np.linalg.norm(p - q)

            tips = np.array([one.tip_roll_length, two.tip_roll_length]) * 1e3
            start = np.clip(row[6:8] * 1e3, 1e-3, tips)
            bounds = [(1e-3, tips[0]), (1e-3, tips[1])]
            found = nearest(distance, bounds, [start, np.clip(start + [0.3, -0.3], 1e-3, tips)]) * 1e-3
            worst = max(worst, abs(found - gap))
    assert 0 in kinds
    assert kinds & {1, 2}
    assert worst < 1e-8


def test_section_gap_is_the_distance_in_space():
    # the gap in the section and the distance to the whole other surface differ by a cosine of half the tilt
    pair = PAIRS["29/29 skew"]
    mesh = StaticMesh(pair)
    one, two = pair.wheels
    driven = mesh.touching_angle(0.1) - 20e-6 / two.base_radius
    place = pair.frames(0.1, driven)
    normal = place.axes_1[:, 2] + place.axes_2[:, 2]
    normal /= np.linalg.norm(normal)
    centre = 0.5 * (place.origin_1 + place.origin_2)
    rows = mesh.gaps(0.1, driven, np.array([-0.009, 0.009])).copy()
    checked = 0
    for row in rows[(rows[:, 4] > 0) & (rows[:, 4] < 0.5e-3) & (rows[:, 5] == 0)]:
        side, i, j, zeta, gap = row[:5]
        point = section_point(two, side, j, row[7], place.origin_2, place.axes_2, centre, normal, zeta)

        def distance(y, side=side, i=i, point=point):
            return 1e3 * np.linalg.norm(
                place.origin_1 + place.axes_1 @ flank_point(one, side, i, y[0] * 1e-3, y[1] * 1e-3) - point
            )

        local = place.axes_1.T @ (point - place.origin_1)
        found = minimize(distance, [row[6] * 1e3, local[2] * 1e3], method="Nelder-Mead", options={"xatol": 1e-10})
        assert found.fun * 1e-3 == pytest.approx(gap, abs=1e-8, rel=5e-5)
        checked += 1
    assert checked >= 2


def test_first_order_picture_is_wrong_by_r_gamma_squared():
    # at 1 degree the tilt moves a section by up to r gamma^2 / 2 = 6.8 um, which a first-order picture misses
    gamma = np.radians(1.0)
    assert 0.5 * 44.435e-3 * gamma**2 == pytest.approx(6.8e-6, rel=0.01)
    straight, tilted = StaticMesh(GearPair.paper(backlash="0.9 mm")), StaticMesh(PAIRS["29/29 inclination"])
    driven = straight.touching_angle(0.05)
    gaps = [mesh.gaps(0.05, driven, np.zeros(1)).copy() for mesh in (straight, tilted)]
    change = abs(gaps[1][:, 4] - gaps[0][:, 4])[(gaps[0][:, 0] == 1) & (gaps[0][:, 5] == 0)]
    assert 1e-6 < change.max() < 10e-6
