"""Factors of the equivalent load by ISO 281, thrust of pairs, and designations of sets and reinforced designs."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from gearmbs.bearings import Bearing, BearingError, equivalent_load, mean_load
from gearmbs.bearings.kinds import ANGULAR, DOUBLE_ANGULAR, TILTED
from gearmbs.bearings.rating import induced_thrust, life_exponent, load_factors, paired_thrust
from tests.says import says

BALLS = {"elements": 12, "element_diameter": "10 mm", "pitch_diameter": "46 mm"}
MAKERS = """
0.178 0.38 1.47 1.65 2.39|0.357 0.40 1.40 1.57 2.28|0.714 0.43 1.30 1.46 2.11|1.07 0.46 1.23 1.38 2.00
1.43 0.47 1.19 1.34 1.93|2.14 0.50 1.12 1.26 1.82|3.57 0.55 1.02 1.14 1.66|5.35 0.56 1.00 1.12 1.63
"""
"""Tables that makers print for 15 degrees: f_0 F_a/C_0, e, Y of a single bearing, Y below and above e of a pair."""


def balls(degrees, kind="angular contact", **fields):
    return Bearing(kind=kind, contact_angle=math.radians(degrees), **BALLS, **fields)


@pytest.mark.parametrize(
    "row", [[float(x) for x in row.split()] for row in MAKERS.strip().replace("\n", "|").split("|")]
)
def test_fifteen_degrees_have_the_factors_that_makers_print(row):
    level, e, y, below, above = row
    # C_0 = f_0 i Z d^2 cos(a)
    axial = level * 12 * 100 * math.cos(math.radians(15.0))
    single, pair = balls(15.0), balls(15.0, "double row angular contact", row_distance="12 mm")
    assert load_factors(single, 0.9 * axial / e, axial) == pytest.approx((0.44, y), abs=2e-3)
    assert load_factors(single, 1.1 * axial / e, axial) == (1.0, 0.0)
    assert load_factors(pair, 1.8 * axial / e, 2.0 * axial) == pytest.approx((0.72, above), abs=2e-3)
    assert load_factors(pair, 2.2 * axial / e, 2.0 * axial) == pytest.approx((1.0, below), abs=2e-3)


def test_factors_of_all_angles_meet_at_the_limit():
    """X + e Y is 1, of two rows 1 + e Y below it, but for the rounding of the printed tables."""
    for rows in ANGULAR.values():
        assert all(x + e * y == pytest.approx(1.0, abs=0.012) for e, x, y in rows)
    for rows in DOUBLE_ANGULAR.values():
        assert all(x + e * y == pytest.approx(1.0 + e * below, abs=0.015) for e, x, y, below in rows)


def test_deep_groove_bearings_with_an_angle_count_it():
    level = 0.689 * 12 * 100
    assert load_factors(balls(0.0, "deep groove"), 0.0, level) == pytest.approx((0.56, 1.71))
    assert load_factors(balls(5.0, "deep groove"), 0.0, level) == pytest.approx((0.56, 1.71))
    assert load_factors(balls(10.0, "deep groove"), 0.0, level) == pytest.approx((0.46, 1.52))
    assert load_factors(balls(12.5, "deep groove"), 0.0, level) == pytest.approx((0.45, 1.41))
    assert load_factors(balls(15.0, "deep groove"), 0.0, level) == pytest.approx(load_factors(balls(15.0), 0.0, level))
    with pytest.raises(BearingError, match=says("contact_angle", "46", "give")):
        equivalent_load(balls(46.0), 1.0, 1.0)
    assert equivalent_load(balls(45.0), 1000.0, 2000.0) == pytest.approx(330.0 + 0.5 * 2000.0)


def test_a_tilted_axis_is_no_axial_load_of_cylindrical_rollers():
    rollers = Bearing(kind="cylindrical roller", elements=13, element_diameter="9 mm", pitch_diameter="46.5 mm",
                      roller_length="9 mm")  # fmt: skip
    assert equivalent_load(rollers, 811.0, 0.01114) == 811.0
    assert equivalent_load(rollers, 811.0, 0.9 * TILTED * 811.0) == 811.0
    with pytest.raises(BearingError, match=says("F_a", "341", "stiffness", "0")):
        equivalent_load(rollers, 811.0, 341.0)


def test_pairs_carry_the_thrust_that_their_radial_loads_induce():
    """30206, Y = 1.6: F_r = 1822 and 835 N, 664 N on the shaft towards the less loaded one, and away from it."""
    tapered = Bearing(kind="tapered roller", contact_angle=math.atan(0.25), roller_length="10 mm", **BALLS)
    assert induced_thrust(tapered, 1822.0) == pytest.approx(1822.0 / 3.2)
    axial = paired_thrust(tapered, tapered, (835.0, 1822.0), 664.0)
    assert axial == pytest.approx((1822.0 / 3.2 + 664.0, 1822.0 / 3.2))
    assert equivalent_load(tapered, 835.0, axial[0]) == pytest.approx(0.4 * 835.0 + 1.6 * 1233.4, rel=1e-4)
    assert paired_thrust(tapered, tapered, (1822.0, 835.0), 664.0) == pytest.approx((835.0 / 3.2 + 664.0, 835.0 / 3.2))
    balls40 = balls(40.0)
    assert paired_thrust(balls40, balls40, (1000.0, 500.0), 0.0) == pytest.approx((1140.0, 1140.0))
    # e of 15 degrees is that of the axial load found
    small = balls(15.0)
    first, second = paired_thrust(small, small, (1000.0, 1000.0), 200.0)
    assert second == pytest.approx(induced_thrust(small, 1000.0, second), rel=1e-5)
    assert first == pytest.approx(second + 200.0)
    assert induced_thrust(balls(0.0, "deep groove"), 1000.0) == 0.0


@pytest.mark.parametrize(
    "name", ["7208 BEP/DB", "30208 DF", "7208BDB", "7208 BDF", "7008 ACD/P4ADBA", "31306 J2/QDF", "7010 CTA/QBC",
             "NU1010/DR", "7208-B-DT", "6206/DB"],
)  # fmt: skip
def test_matched_sets_are_no_single_bearing(name):
    with pytest.raises(BearingError, match=says(name, "its own station")):
        Bearing.from_designation(name, estimate=True)


@pytest.mark.parametrize(
    "name", ["7208 BECBP", "30208 J2/Q", "7208 CD/P4A", "6206DDU", "6206DU", "3206 DA", "NN3010 TN"]
)
def test_suffixes_like_those_of_sets_are_taken(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert Bearing.from_designation(name, estimate=True).rating > 1e4


def test_reinforced_designs_are_told_to_have_the_ratings_of_the_basic_one():
    for name in ("6205 ETN9", "7208 BEP"):
        with pytest.warns(UserWarning, match=says("E", "basic", "dynamic_rating=")):
            Bearing.from_designation(name, estimate=True)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        own = Bearing.from_designation("6205 ETN9", estimate=True, dynamic_rating="17.8 kN", static_rating="9.8 kN")
        Bearing.from_designation("6205-2RS", estimate=True)
        Bearing.from_designation("NU208 ECP", estimate=True)
    assert own.rating == 17800.0
    assert not [one for one in said if "basic" in str(one.message)]


@pytest.mark.parametrize("designation", ["6206", "7206C", "QJ206", "1206", "22206", "NU206", "30206", "51106"])
def test_a_mean_load_is_that_of_the_equivalent_loads_one_by_one(designation):
    bearing = Bearing.from_designation(designation, estimate=True)
    draw = np.random.default_rng(206)
    radial, axial = draw.uniform(-3000.0, 3000.0, 60), draw.uniform(-2000.0, 2000.0, 60)
    radial[0] = axial[1] = 0.0
    if designation.startswith("NU"):
        axial *= 0.0
    if designation.startswith("51"):
        radial = 0.04 * axial
    p = life_exponent(bearing)
    loads = np.array([equivalent_load(bearing, *pair) for pair in zip(radial, axial)])
    assert mean_load(bearing, radial, axial) == pytest.approx(np.mean(loads**p) ** (1.0 / p), rel=1e-14)


def test_the_first_load_that_a_bearing_does_not_carry_is_named():
    rollers = Bearing.from_designation("NU206", estimate=True)
    with pytest.raises(BearingError, match=says("F_a", "300 N", "2000 N")):
        mean_load(rollers, np.array([1000.0, 2000.0, 3000.0]), np.array([0.0, -300.0, 400.0]))
    thrust = Bearing.from_designation("51106", estimate=True)
    with pytest.raises(BearingError, match=says("F_r", "200 N", "1000 N")):
        mean_load(thrust, np.array([10.0, 200.0]), np.array([1000.0, 1000.0]))
