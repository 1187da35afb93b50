"""Bearings with two rows against sums over their elements in plain numpy, printed factors and the standard's tables."""

import math
import warnings

import numpy as np
import pytest

from gearmbs.bearings import Bearing, BearingError, BearingStatics, OffSize, RollingBearing, Waviness
from gearmbs.bearings.rating import dynamic_rating, equivalent_load, load_factors, rating_life, static_rating
from gearmbs.mechanism import Mechanism, static_equilibrium
from tests.says import says

GIVEN = {"elements": 13, "element_diameter": 8e-3, "pitch_diameter": 46e-3, "clearance": "6 um"}
BACK = Bearing(kind="double row angular contact", contact_angle="30 deg", row_distance="12 mm", **GIVEN)
BALLS = Bearing(kind="double row deep groove", row_distance="10 mm", **GIVEN)
ALIGNING = Bearing(kind="self-aligning ball", contact_angle="11 deg", **GIVEN)
SPHERICAL = Bearing(kind="spherical roller", contact_angle="10 deg", roller_length="8 mm", **GIVEN)
ROLLERS = Bearing(kind="double row cylindrical roller", row_distance="10 mm", roller_length="7 mm", **GIVEN)
PLACES = [
    [12e-6, 5e-6, 8e-6, 1e-4, -2e-4], [20e-6, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 25e-6, 0.0, 0.0],
    [-3e-6, 9e-6, -30e-6, 2e-4, 1e-4],
]  # fmt: skip


def energy(bearing, place, cage):
    """Return K/(n + 1) sum max(delta, 0)^(n + 1) over both rows, by rigid motions of the points that are touched."""
    d, turn = np.array(place[:3]), np.array([place[3], place[4], 0.0])
    total, a, clear = 0.0, bearing.contact_angle, 0.5 * bearing.clearance
    for angle in cage + 2.0 * math.pi * np.arange(bearing.elements) / bearing.elements:
        radial, axis = np.array([math.cos(angle), math.sin(angle), 0.0]), np.array([0.0, 0.0, 1.0])
        for side in (-1.0, 1.0):
            if bearing.kind in ("self-aligning ball", "spherical roller"):
                normal = math.cos(a) * radial + side * math.sin(a) * axis
                point = 0.5 * bearing.pitch_diameter * (radial + side * math.tan(a) * axis)
                delta = normal @ (d + np.cross(turn, point)) - clear * math.cos(a)
            elif bearing.rollers:
                point = 0.5 * bearing.pitch_diameter * radial + 0.5 * side * bearing.row_distance * axis
                delta = radial @ (d + np.cross(turn, point)) - clear
            else:
                # back to back: the row above presses downward
                reach, long = (bearing.inner_curvature - 0.5) * bearing.element_diameter, bearing.groove_distance
                normal = math.cos(a) * radial - side * math.sin(a) * axis
                middle = 0.5 * bearing.pitch_diameter * radial + 0.5 * side * bearing.row_distance * axis
                moved = long * normal - clear * radial + d + np.cross(turn, middle + reach * normal)
                delta = math.hypot(moved @ radial, moved @ axis) - long
            total += bearing.stiffness / (bearing.exponent + 1.0) * max(delta, 0.0) ** (bearing.exponent + 1.0)
    return total


def slope(function, place):
    step = np.array([1e-8, 1e-8, 1e-8, 5e-7, 5e-7])
    found = []
    for k in range(5):
        e = np.eye(5)[k] * step
        near, far = (function(place + m * e) - function(place - m * e) for m in (1.0, 2.0))
        found.append((8.0 * near - far) / (12.0 * step[k]))
    return np.array(found)


@pytest.mark.parametrize("bearing", [BACK, BALLS, ALIGNING, SPHERICAL, ROLLERS], ids=lambda bearing: bearing.kind)
@pytest.mark.parametrize("place", PLACES)
def test_loads_are_the_slopes_of_the_energy_of_both_rows(bearing, place):
    # without a profile of the rollers: one slice each
    state = BearingStatics(bearing, slices=1).at(place, cage_angle=0.1)
    expected = slope(lambda p: energy(bearing, p, 0.1), np.array(place))
    size = np.array([1.0, 1.0, 1.0, 0.02, 0.02]) * max(float(np.abs(expected).max()), 1.0)
    assert state.load / size == pytest.approx(expected / size, abs=3e-5)


@pytest.mark.parametrize("bearing", [ALIGNING, SPHERICAL], ids=lambda bearing: bearing.kind)
def test_a_tilt_takes_no_moment_and_moves_nothing(bearing):
    upright, tilted = (BearingStatics(bearing).at([15e-6, 4e-6, 9e-6, *tilt]) for tilt in ((0.0, 0.0), (0.03, -0.02)))
    assert upright.largest > 100.0
    assert tilted.load[:3] == pytest.approx(upright.load[:3], rel=1e-9)
    lever = 0.5 * bearing.pitch_diameter * float(np.linalg.norm(upright.load[:3]))
    for state in (upright, tilted):
        assert np.abs(state.load[3:]).max() < 1e-10 * lever
    assert np.abs(upright.stiffness[3:, 3:]).max() < 1e-9 * upright.stiffness[0, 0] * bearing.pitch_diameter**2
    # a load is carried at any tilt, a moment is refused
    state = BearingStatics(bearing).under([900.0, 0.0, 300.0, 0.0, 0.0], start=[0.0, 0.0, 0.0, 0.01, 0.0])
    assert state.load == pytest.approx([900.0, 0.0, 300.0, 0.0, 0.0], abs=1e-4)
    with pytest.raises(BearingError, match=says("equilibrium", "nothing")):
        BearingStatics(bearing).under([900.0, 0.0, 0.0, 1.0, 0.0])


def test_two_rows_back_to_back_carry_moments_and_both_senses():
    statics = BearingStatics(BACK.changed(clearance=0.0))
    up, down = (statics.under([0.0, 0.0, force]) for force in (800.0, -800.0))
    assert up.displacement[2] == pytest.approx(-down.displacement[2], rel=1e-9)
    # lines of contact part towards the axis: the lever is longer than half the distance of the rows
    radial, tilt = up.stiffness[0, 0], up.stiffness[3, 3]
    assert tilt / radial > (0.5 * BACK.row_distance) ** 2
    assert statics.under([500.0, 0.0, 200.0, 5.0, 0.0]).load == pytest.approx([500.0, 0.0, 200.0, 5.0, 0.0], abs=1e-4)


@pytest.mark.parametrize(
    ("angled", "parallel"),
    [(SPHERICAL, ROLLERS.changed(roller_length="8 mm")), (BACK, BALLS.changed(row_distance="12 mm"))],
)
def test_without_an_angle_two_rows_are_parallel(angled, parallel):
    """A row each of the single bearing: twice its radial force at a displacement."""
    small = angled.changed(contact_angle=1e-5)
    way = [20e-6, 0.0, 0.0]
    flat, expected = (BearingStatics(b, slices=1).at(way) for b in (small, parallel))
    assert flat.load[0] == pytest.approx(expected.load[0], rel=1e-6)
    assert flat.stiffness[0, 0] == pytest.approx(expected.stiffness[0, 0], rel=1e-6)
    single = parallel.changed(kind="cylindrical roller" if parallel.rollers else "deep groove")
    assert expected.load[0] == pytest.approx(2.0 * BearingStatics(single, slices=1).at(way).load[0], rel=1e-12)


@pytest.mark.parametrize(("ratio", "factor"), [(0.05, 17.3), (0.10, 23.4), (0.16, 29.7), (0.20, 33.5), (0.30, 40.3)])
def test_self_aligning_ratings_are_those_of_the_standards_table(ratio, factor):
    pitch, angle = 0.1, math.radians(10.0)
    ball = ratio * pitch / math.cos(angle)
    bearing = Bearing(
        kind="self-aligning ball", elements=9, element_diameter=ball, pitch_diameter=pitch, contact_angle=angle
    )
    size = (1e3 * ball) ** 1.8 if ball <= 25.4e-3 else 3.647 * (1e3 * ball) ** 1.4
    by_table = 1.3 * factor * (2.0 * math.cos(angle)) ** 0.7 * 9 ** (2 / 3) * size
    assert dynamic_rating(bearing) == pytest.approx(by_table, rel=0.01)


@pytest.mark.parametrize(("ratio", "factor"), [(0.05, 44.2), (0.10, 52.6), (0.16, 56.5), (0.20, 56.8)])
def test_double_row_ratings_are_those_of_the_standards_table(ratio, factor):
    bearing = BALLS.changed(element_diameter=ratio * 0.046, elements=11)
    by_table = 1.3 * factor * 2.0**0.7 * 11 ** (2 / 3) * (1e3 * ratio * 0.046) ** 1.8
    assert dynamic_rating(bearing) == pytest.approx(by_table, rel=0.01)


@pytest.mark.parametrize(
    ("name", "limit", "below", "above"),
    [("1210", 0.21, 3.0, 4.7), ("2210", 0.29, 2.2, 3.4), ("22214", 0.26, 2.6, 3.9), ("22208", 0.31, 2.2, 3.2),
     ("22320", 0.35, 1.9, 2.9)],
)  # fmt: skip
def test_load_factors_are_the_printed_ones(name, limit, below, above):
    bearing = by_name(name)
    assert 1.5 * math.tan(bearing.contact_angle) == pytest.approx(limit, abs=0.011)
    assert load_factors(bearing, 1.0, 0.5 * limit)[1] == pytest.approx(below, rel=0.04)
    x, y = load_factors(bearing, 1.0, 2.0 * limit)
    assert (x, y) == (0.67 if bearing.rollers else 0.65, pytest.approx(above, rel=0.04))
    # below the limit the axial load counts, too, and the load is continuous there within the table's rounding
    assert equivalent_load(bearing, 1000.0, 100.0) > 1000.0
    low, high = (equivalent_load(bearing, 1000.0, 1000.0 * limit * part) for part in (0.95, 1.1))
    assert low < high < 1.25 * low


def by_name(name, **changes):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return Bearing.from_designation(name, estimate=True, **changes)


def test_a_life_by_hand():
    """22210 (C = 100 kN, e = 0.24) under 5 kN and 1 kN: P = 5 + 0.45/0.16 = 7.81 kN; 1000 turns a minute."""
    bearing = by_name("22210 E")
    load = equivalent_load(bearing, "5 kN", "1 kN")
    assert load == pytest.approx(5000.0 + 0.45 * 1.5 / 0.24 * 1000.0)
    hours = rating_life(bearing, load) / 60e3
    assert hours == pytest.approx((100e3 / 7812.5) ** (10 / 3) * 1e6 / 60e3, rel=1e-9)


@pytest.mark.parametrize(
    "name", ["22210 E", "22316", "23124", "24030", "1210", "2310", "3206 A", "3308", "NN 3010", "NNU 4920"]
)
def test_estimated_elements_give_the_printed_ratings(name):
    bearing = by_name(name)
    assert bearing.rating_source
    assert dynamic_rating(bearing) == pytest.approx(bearing.dynamic_rating, rel=0.1)
    assert static_rating(bearing) == pytest.approx(bearing.static_rating, rel=0.45)
    assert {"elements", "element_diameter"} <= set(bearing.estimated)
    assert bearing.rows == 2
    assert 2.0 * bearing.offset < bearing.width


@pytest.mark.parametrize(("name", "clearance"), [("22316 E/C3", 95e-6), ("22316/CN", 65e-6), ("1210/C3", 34.5e-6)])
def test_classes_of_self_aligning_bearings_are_their_own(name, clearance):
    assert by_name(name).clearance == pytest.approx(clearance, abs=1e-12)


@pytest.mark.parametrize(
    "name",
    ["22316 EK/C3", "1210 K/C3", "22210-E1-XL-K/C3", "22210EAKE4/C3", "22210CAMKE4/C3", "22210RHKW33/C3",
     "22210-BEA-XL-K-MB1/C3", "2210-2RS-K-TVH/C3", "2210 E-2RS1KTN9/C3", "NN 3010 KTN9/SP/C3", "NU2210 K/C3"],
)  # fmt: skip
def test_classes_of_tapered_bores_are_not_known(name):
    with pytest.raises(BearingError, match=says("C3", "clearance=")):
        by_name(name)
    assert by_name(name, clearance="50 um").clearance == pytest.approx(50e-6)
    assert by_name(name.replace("/C3", "")).clearance == 0.0


@pytest.mark.parametrize(
    ("name", "clearance"), [("22210-E1-XL-C3", 65e-6), ("2210-2RS-TVH/C3", 34.5e-6), ("NU2210 ECP/C3", 65e-6)]
)
def test_classes_beside_tapered_bores_are_those_of_the_standard(name, clearance):
    assert by_name(name).clearance == pytest.approx(clearance, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "angle"),
    [("3206 A", 30), ("3206-B-TVH", 25), ("3206-BD-XL-TVH", 30), ("3306-DA", 45), ("3308 D", 45), ("3308 DNRCBM", 40)],
)
def test_contact_angles_by_the_letters_of_two_rows(name, angle):
    """As printed by two makers: B 25 and BD 30 degrees; 45 with a split inner ring, 40 with a snap ring, too."""
    assert math.degrees(by_name(name).contact_angle) == pytest.approx(angle)


def test_another_bore_behind_the_size_is_asked_for():
    """22205/20 has a bore of 20 mm, 22205 of 25."""
    with pytest.raises(BearingError, match=says("20", "bore=")):
        by_name("22205/20 E")
    assert by_name("22205/20 E", bore="20 mm").bore == pytest.approx(20e-3)
    assert by_name("22205/C3").bore == pytest.approx(25e-3)
    assert by_name("22205 E/W33").bore == pytest.approx(25e-3)


@pytest.mark.parametrize("bearing", [BACK, BALLS, ALIGNING, SPHERICAL, ROLLERS], ids=lambda bearing: bearing.kind)
def test_elements_of_each_row_have_their_own_force(bearing):
    """Under a radial load both rows are alike: as many elements carry, and the largest has, what one row tells."""
    state = BearingStatics(bearing, slices=1).at([25e-6, 0.0, 0.0])
    first, second = state.element_loads.reshape(2, bearing.elements)
    assert first == pytest.approx(second, rel=1e-12)
    a, reach = bearing.contact_angle, 0.0 if bearing.fixed_normals else bearing.groove_distance
    loads = []
    for angle in 2.0 * math.pi * np.arange(bearing.elements) / bearing.elements:
        moved = 25e-6 * math.cos(angle) - 0.5 * bearing.clearance
        if reach:
            delta = math.hypot(reach * math.cos(a) + moved, reach * math.sin(a)) - reach
        else:
            delta = moved * math.cos(a)
        loads.append(bearing.stiffness * max(delta, 0.0) ** bearing.exponent)
    assert first == pytest.approx(loads, rel=1e-6)
    assert state.largest == pytest.approx(max(loads), rel=1e-6)
    assert state.loaded == 2 * sum(load > 0.0 for load in loads)


@pytest.mark.parametrize("part", ["inner", "outer"])
def test_of_two_rows_the_first_has_the_defects_of_rings(part):
    wave = Waviness(part=part, order=7, amplitude="2 um")
    for way, touched in ((20e-6, False), (-20e-6, True)):
        plain, wavy = (BearingStatics(SPHERICAL, defects=d).at([0.0, 0.0, 5.0 * way]) for d in ((), (wave,)))
        assert plain.largest > 0.0
        assert np.array_equal(plain.load, wavy.load) is not touched


def test_what_two_rows_do_not_know_is_refused_and_the_rest_runs():
    m = Mechanism("seat")
    shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))

    def made(bearing, **settings):
        return RollingBearing("A", shaft.marker(), m.ground.marker(), bearing=bearing, **settings)

    ball = Waviness(part="element", element=1, order=2, amplitude="1 um")
    with pytest.raises(BearingError, match=says("centrifugal", "leave")):
        made(BACK, centrifugal=True)
    with pytest.raises(BearingError, match=says("element", "row")):
        made(BACK, defects=[ball])
    with pytest.raises(BearingError, match=says("preload", "clearance")):
        made(SPHERICAL, preload="100 N")
    with pytest.raises(BearingError, match=says("row_distance", "rows")):
        BACK.changed(row_distance=None)
    single = BACK.changed(kind="angular contact")
    assert made(single, centrifugal=True, defects=[ball], preload="100 N")
    assert made(BACK, defects=[OffSize(amount="1 um", element=1), Waviness(part="outer", order=3, amplitude="1 um")])


@pytest.mark.parametrize(
    ("name", "told"),
    [("89308", "cylindrical roller thrust"), ("29412 E", "spherical roller thrust"), ("C 2210", "toroidal"),
     ("RLS 8", "inch"), ("LM11949/910", "inch"),
     ("BS2-2210-2RS/VT143", "sealed spherical")],
)  # fmt: skip
def test_what_is_not_there_is_told_by_name(name, told):
    with pytest.raises(BearingError, match=rf"{told}.*(bushing|kind=|width=)"):
        Bearing.from_designation(name, estimate=True)


SINGLE = Bearing(kind="cylindrical roller", roller_length="9 mm", **GIVEN)


@pytest.mark.parametrize(
    "bearing", [BACK, BALLS, ALIGNING, SPHERICAL, ROLLERS, SINGLE], ids=lambda bearing: bearing.kind
)
def test_diagnostics_of_a_mechanism_count_elements_and_not_their_slices(bearing):
    """At rest under a load the elements that carry, and the largest force of one, are those of the bearing alone."""
    m = Mechanism("ring")
    ring = m.body("ring", 0.2, (1e-4, 1e-4, 1e-4))
    m.add(RollingBearing("bearing", ring.marker(), m.ground.marker(), bearing=bearing))
    m.joint("orientation", "held", ring, m.ground)
    if bearing.contact_angle == 0.0:
        m.joint("inplane", "middle", ring.marker(), m.ground.marker())
    load = np.array([900.0, 350.0, 0.0])
    m.load("pull", ring.marker(), m.ground.marker(), **{f"f{c}": str(f) for c, f in zip("xy", load)})
    told = static_equilibrium(m).solution.diagnostics("bearing")
    state = BearingStatics(bearing).under(load)
    assert state.loaded == np.sum(state.element_loads > 0.0)
    assert told["loaded_elements"][-1] == state.loaded
    assert told["largest_element_force"][-1] == pytest.approx(state.largest, rel=1e-5)
    # the share of an element: at least that of even ones, at most the whole
    assert np.hypot(*load[:2]) / (bearing.rows * bearing.elements) < state.largest < np.hypot(*load[:2])
