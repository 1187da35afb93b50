"""Bearings at rest: closed forms, load distributions, limits and balances."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from gearmbs.bearings import Bearing, BearingError, BearingStatics, Misalignment, OffSize, Waviness, stiffness_matrix
from tests.says import says

K = 1e10
DEEP = Bearing.from_designation("6205")
ANGULAR = Bearing(
    kind="angular contact", elements=11, element_diameter=7.94e-3, pitch_diameter=38.5e-3, contact_angle="25 deg"
)
ROLLERS = Bearing(
    kind="cylindrical roller", elements=13, element_diameter=7.5e-3, pitch_diameter=46.5e-3, roller_length=9.5e-3
)


def small(elements: int, clearance: float = 0.0, **more) -> Bearing:
    return Bearing(elements=elements, element_diameter=1e-5, pitch_diameter=0.04, clearance=clearance, **more)


@pytest.mark.parametrize(
    ("gap", "way", "largest", "slope"),
    [(0.0, 14.343, 543.21, 1.0458e8), (5.0, 20.271, 596.74, 1.0444e8), (10.0, 26.160, 649.65, 1.0403e8)],
)
def test_static_table(gap, way, largest, slope):
    bearing = Bearing(elements=8, element_diameter=8e-3, pitch_diameter=0.04, clearance=2e-6 * gap)
    state = BearingStatics(bearing, stiffness=K).under([1000.0, 0.0, 0.0])
    assert 1e6 * state.displacement[0] == pytest.approx(way, rel=1e-4)
    assert state.largest == pytest.approx(largest, rel=1e-4)
    assert state.stiffness[0, 0] == pytest.approx(slope, rel=1e-4)
    assert state.loaded == 3


@pytest.mark.parametrize("elements", [7, 12, 15])
@pytest.mark.parametrize("gap", [0.0, 3e-6, -2e-6])
@pytest.mark.parametrize("cage", [0.0, 0.17])
def test_load_distribution_is_that_of_the_plane_problem(elements, gap, cage):
    """sum K max(x cos + y sin - c, 0)^1.5 (cos, sin) = F, by independent iteration."""
    from scipy.optimize import root

    bearing = Bearing(elements=elements, element_diameter=6e-3, pitch_diameter=0.04, clearance=2.0 * gap)
    state = BearingStatics(bearing, stiffness=K).under([800.0, 300.0, 0.0], cage_angle=cage)
    angles = cage + 2.0 * np.pi * np.arange(elements) / elements

    def miss(u):
        loads = K * np.maximum(1e-6 * (u[0] * np.cos(angles) + u[1] * np.sin(angles)) - gap, 0.0) ** 1.5
        return [loads @ np.cos(angles) - 800.0, loads @ np.sin(angles) - 300.0]

    found = root(miss, [15.0, 6.0], tol=1e-12).x
    assert 1e6 * state.displacement[:2] == pytest.approx(found, rel=1e-6)
    loads = K * np.maximum(1e-6 * (found[0] * np.cos(angles) + found[1] * np.sin(angles)) - gap, 0.0) ** 1.5
    assert state.element_loads == pytest.approx(loads, rel=1e-5, abs=1e-6)


def test_stribecks_numbers():
    """Z Q_max/F_r of many elements without clearance: 1/J_r."""
    integral = quad(lambda a: np.cos(a) ** 2.5, 0.0, np.pi / 2)[0] / np.pi
    state = BearingStatics(small(2001), stiffness=K).under([1000.0, 0.0, 0.0])
    assert state.largest * 2001 / 1000.0 == pytest.approx(1.0 / integral, rel=1e-6)
    assert 1.0 / integral == pytest.approx(4.37010, abs=1e-5)
    rollers = small(2001, kind="cylindrical roller", roller_length=0.01)
    state = BearingStatics(rollers, stiffness=1e9, slices=1).under([1000.0, 0.0, 0.0])
    assert state.largest * 2001 / 1000.0 == pytest.approx(4.08499, abs=1e-5)


def test_varying_compliance():
    bearing = Bearing(elements=9, element_diameter=8e-3, pitch_diameter=0.04)
    statics = BearingStatics(bearing, stiffness=K)
    turn = np.linspace(0.0, 2.0 * np.pi / 9, 37)
    ways = np.array([statics.under([1000.0, 0.0, 0.0], cage_angle=a).displacement[0] for a in turn])
    assert 1e6 * np.ptp(ways) == pytest.approx(0.0567, abs=5e-5)
    assert ways[0] == pytest.approx(ways[-1], rel=1e-9)


def test_axial_load_opens_the_contact_angle():
    """Deep groove: cos(a_0) = 1 - P_d/(2 A); the angle under load by the equation of a ball alone."""
    clearance, load = 15e-6, 500.0
    bearing = DEEP.changed(clearance=clearance)
    state = BearingStatics(bearing).under([0.0, 0.0, load])
    distance = bearing.groove_distance
    free = np.arccos(1.0 - 0.5 * clearance / distance)

    def miss(angle):
        delta = distance * (np.cos(free) / np.cos(angle) - 1.0)
        return bearing.elements * bearing.stiffness * delta**1.5 * np.sin(angle) - load

    angle = brentq(miss, free, 1.0, xtol=1e-14)
    assert state.contact_angles == pytest.approx(np.full(9, angle), rel=1e-7)
    assert state.displacement[2] == pytest.approx(distance * (np.cos(free) * np.tan(angle) - 0.0), rel=1e-6)


def test_centrifugal_load_parts_the_contact_angles():
    """Slow it is the bearing without; fast it agrees with a ball's equilibrium solved alone."""
    from scipy.optimize import root

    load = [0.0, 0.0, 500.0]
    still = BearingStatics(ANGULAR).under(load)
    slow = BearingStatics(ANGULAR, centrifugal=True, speed=1.0).under(load)
    assert slow.displacement == pytest.approx(still.displacement, rel=1e-6, abs=1e-15)
    speed = 2500.0
    fast = BearingStatics(ANGULAR, centrifugal=True, speed=speed).under(load)
    b = ANGULAR
    flung = b.element_mass * 0.5 * b.pitch_diameter * (b.ftf * speed) ** 2
    d, (k_i, k_o) = b.element_diameter, b.contact_stiffness
    angle = b.contact_angle

    def miss(u):
        vr, vz, z = 1e-4 * u
        ar, az = b.groove_distance * np.cos(angle), b.groove_distance * np.sin(angle) + z
        lo, li = np.hypot(vr, vz), np.hypot(ar - vr, az - vz)
        qo, qi = k_o * max(lo - 0.025 * d, 0.0) ** 1.5, k_i * max(li - 0.015 * d, 0.0) ** 1.5
        return [
            qo * vr / lo - qi * (ar - vr) / li - flung, qo * vz / lo - qi * (az - vz) / li,
            b.elements * qi * (az - vz) / li - 500.0,
        ]  # fmt: skip

    start = 1e4 * np.array([0.026 * d * np.cos(angle), 0.026 * d * np.sin(angle), still.displacement[2]])
    solution = root(miss, start, tol=1e-13)
    assert solution.success
    assert fast.displacement[2] == pytest.approx(1e-4 * solution.x[2], rel=1e-6)
    assert fast.contact_angles[0] > still.contact_angles[0] + 0.05


FOUR = ANGULAR.changed(kind="four point", contact_angle="35 deg", clearance="10 um")


@pytest.mark.parametrize("place", [[12e-6, -3e-6, 2e-6], [4e-6, 0.0, 10e-6, 1e-4, -2e-4], [1e-6, 0.0, -12e-6]])
def test_balls_of_a_fast_four_point_bearing_touch_up_to_four_grooves(place):
    """The load agrees with the sum over balls whose equilibrium in all four grooves is solved alone."""
    from scipy.optimize import minimize

    b, speed = FOUR, 2500.0
    state = BearingStatics(b, centrifugal=True, speed=speed, damping=0.0).at(place)
    flung = b.element_mass * 0.5 * b.pitch_diameter * (b.ftf * speed) ** 2
    d, (k_i, k_o), angle = b.element_diameter, b.contact_stiffness, b.contact_angle
    x, y, z, tilt_x, tilt_y = np.pad(place, (0, 5 - len(place)))
    # the axis of the inner ring leans by (tilt_y, -tilt_x), to first order
    total, touching = np.zeros(3), set()
    for j in range(b.elements):
        c, s = np.cos(2 * np.pi * j / b.elements), np.sin(2 * np.pi * j / b.elements)
        phi = tilt_y * c - tilt_x * s
        outer, inner = [], []
        for sign in (1.0, -1.0):
            outer.append(-0.025 * d * np.array([np.cos(angle), sign * np.sin(angle)]))
            height, radius = sign * 0.015 * d * np.sin(angle), 0.5 * b.pitch_diameter + 0.015 * d * np.cos(angle)
            inner.append(
                outer[-1] + b.groove_distance * np.array([np.cos(angle), sign * np.sin(angle)])
                + np.array([x * c + y * s - 0.5 * b.clearance + height * phi, z - radius * phi])
            )  # fmt: skip

        def pressed(v, outer=outer, inner=inner):
            return [max(np.linalg.norm(v - o) - 0.025 * d, 0.0) for o in outer] + [
                max(np.linalg.norm(i - v) - 0.015 * d, 0.0) for i in inner
            ]

        def potential(u, pressed=pressed):
            deltas = pressed(1e-5 * u)
            stored = sum(0.4 * k * delta**2.5 for k, delta in zip((k_o, k_o, k_i, k_i), deltas))
            return 1e3 * (stored - flung * 1e-5 * u[0])

        found = minimize(potential, [0.5, 0.1 * np.sign(z)], method="Nelder-Mead",
                         options={"xatol": 1e-9, "fatol": 1e-16, "maxiter": 4000, "maxfev": 4000})  # fmt: skip
        v = 1e-5 * found.x
        deltas = pressed(v)
        touching.add(sum(delta > 0.0 for delta in deltas))
        for i, delta in zip(inner, deltas[2:]):
            force = k_i * delta**1.5 * (i - v) / np.linalg.norm(i - v)
            total += [force[0] * c, force[0] * s, force[1]]
    assert max(touching) > 2
    np.testing.assert_allclose(state.load[:3], total, rtol=2e-5, atol=2e-5 * np.abs(total).max())


def test_slow_four_point_bearing_is_the_one_without_centrifugal_load():
    for place in ([0.0, 0.0, 60e-6], [0.0, 0.0, -60e-6]):
        still = BearingStatics(FOUR).at(place).load
        slow = BearingStatics(FOUR, centrifugal=True, speed=1.0).at(place).load
        np.testing.assert_allclose(slow, still, rtol=1e-4, atol=1e-6 * np.abs(still).max())


def test_four_point_bearing_carries_both_ways():
    statics = BearingStatics(ANGULAR.changed(kind="four point", contact_angle="35 deg"))
    up, down = statics.under([0.0, 0.0, 400.0]), statics.under([0.0, 0.0, -400.0])
    assert up.displacement[2] == pytest.approx(-down.displacement[2], rel=1e-9)
    # one line alone is the angular contact bearing of that angle
    alone = BearingStatics(ANGULAR.changed(contact_angle="35 deg")).under([0.0, 0.0, 400.0])
    assert up.displacement[2] == pytest.approx(alone.displacement[2], rel=1e-9)


def test_preload_is_what_the_rings_feel():
    for sense in (1, -1):
        state = BearingStatics(ANGULAR, preload="250 N", sense=sense).at([0.0, 0.0, 0.0])
        assert state.load[2] == pytest.approx(250.0 * sense, rel=1e-9)
    tapered = ROLLERS.changed(kind="tapered roller", contact_angle="14 deg")
    assert BearingStatics(tapered, preload=300.0).at([0.0, 0.0, 0.0]).load[2] == pytest.approx(300.0, rel=1e-9)


def test_crowned_rollers_share_a_tilt():
    """Tilted, one end carries more and there is a moment against the tilt; straight on it is symmetric."""
    statics = BearingStatics(ROLLERS)
    straight = statics.under([800.0, 0.0, 0.0])
    tilted = statics.under([800.0, 0.0, 0.0], start=[0, 0, 0, 0, 1e-3])
    assert straight.load[4] == pytest.approx(0.0, abs=1e-9)
    assert tilted.load[4] > 0.1
    # the force grows faster than the deflection, so that unequal deflections carry more than their mean
    assert tilted.displacement[0] < straight.displacement[0]


def test_stiffness_is_symmetric_and_of_the_load():
    matrix = stiffness_matrix(ANGULAR, [300.0, 100.0, 500.0], preload=100.0)
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-6, atol=1e-6 * abs(matrix).max())
    statics = BearingStatics(ANGULAR, preload=100.0)
    state = statics.under([300.0, 100.0, 500.0])
    for k, h in enumerate((1e-9, 1e-9, 1e-9, 1e-7, 1e-7)):
        way = h * np.eye(5)[k]
        slope = (statics.at(state.displacement + way).load - statics.at(state.displacement - way).load) / (2 * h)
        np.testing.assert_allclose(state.stiffness[:, k], slope, atol=1e-5 * abs(slope).max())


def test_curve_and_dataset():
    states = BearingStatics(DEEP).curve([[f, 0.0, 0.0] for f in (100.0, 500.0, 2000.0)])
    ways = [s.displacement[0] for s in states]
    assert ways == sorted(ways)
    # force by displacement to the power 1.5 while the same balls carry
    assert ways[1] / ways[0] == pytest.approx(5.0 ** (2 / 3), rel=1e-6)
    data = states[0].to_dataset()
    assert data.element_load.attrs["units"] == "N"
    assert data.sizes == {"axis": 5, "by": 5, "element": 9}


def test_large_ball_and_leaning_ring():
    state = BearingStatics(DEEP, defects=OffSize(amount="4 um", element=2)).at([0.0, 0.0, 0.0])
    assert np.nonzero(state.element_loads)[0].tolist() == [2]
    assert state.largest == pytest.approx(DEEP.stiffness * 4e-6**1.5, rel=1e-9)
    leaning = BearingStatics(ANGULAR, preload=200.0, defects=Misalignment(tilt=1e-4)).at([0.0, 0.0, 0.0])
    against = BearingStatics(ANGULAR, preload=200.0).at([0.0, 0.0, 0.0, 0.0, -1e-4])
    np.testing.assert_allclose(leaning.load, against.load, atol=1e-3 * abs(against.load).max())


def test_a_load_it_cannot_carry():
    with pytest.raises(BearingError, match=says("carry", "direction")):
        BearingStatics(ROLLERS).under([500.0, 0.0, 100.0])
    for load in ([500.0], ["500 N"] * 6, "500 N", [None, 0.0, 0.0]):
        with pytest.raises(BearingError, match="give 3 or 5 numbers"):
            BearingStatics(ROLLERS).under(load)
    with pytest.raises(BearingError, match=says("load", "'5 N'", "N*m")):
        BearingStatics(DEEP).under(["500 N", 0.0, 0.0, "5 N", 0.0])


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"defects": OffSize(amount=2)}, ("OffSize.amount", "0.397 mm", "plain")),
        ({"defects": Waviness(amplitude="5 mm")}, ("Waviness.amplitude", "5 mm", "0.397 mm")),
        ({"smooth": "2 mm"}, ("smooth", "0.002 m", "'2 um'")),
        ({"rolling_friction": 15}, ("rolling_friction", "15", "0.0015")),
    ],
)
def test_sizes_that_are_meant_in_other_units(settings, told):
    with pytest.raises(BearingError, match=says(*told)):
        BearingStatics(DEEP, **settings)
    # what is meant
    BearingStatics(
        DEEP, defects=[OffSize(amount="2 um"), Waviness(amplitude="5 um")], smooth="2 um", rolling_friction=0.0015
    )


def test_loads_and_places_as_texts():
    statics = BearingStatics(DEEP)
    state = statics.under(["0.5 kN", 0.0, "100 N", "200 N mm", 0.0])
    assert np.array_equal(state.load, statics.under([500.0, 0.0, 100.0, 0.2, 0.0]).load)
    assert np.array_equal(statics.at(["5 um", 0, 0]).load, statics.at([5e-6, 0.0, 0.0]).load)


def test_deflection_curve_has_the_slope_of_its_stiffness():
    loads = np.linspace(200.0, 2000.0, 37)
    curve = BearingStatics(Bearing.from_designation("6205/CN")).deflection_curve([3.0, 0.0, 0.0], loads)
    slope = np.gradient(curve.deflection.values, loads)
    np.testing.assert_allclose(1.0 / curve.stiffness.values[3:-3], slope[3:-3], rtol=5e-3)
    assert curve.loaded_elements.values[0] <= curve.loaded_elements.values[-1]
    with pytest.raises(BearingError, match=says("direction", "[0.0, 0.0, 0.0]", "give 3 or 5")):
        BearingStatics(Bearing.from_designation("6205")).deflection_curve([0.0, 0.0, 0.0], loads)
