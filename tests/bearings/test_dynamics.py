"""Bearings that turn: energy, cage, lines of defects at their kinematic places, limits of stiffness, modes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from gearmbs.bearings import (
    Bearing,
    BearingError,
    BearingStatics,
    Misalignment,
    OffSize,
    RollingBearing,
    Spall,
    UnevenSpacing,
    Waviness,
)
from gearmbs.bearings.layout import spall_depth
from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism, linear_modes, static_equilibrium
from gearmbs.signals import diagnose_bearing
from gearmbs.studies import bearing_rig, housing_signal, rolling_rig

DEEP = Bearing.from_designation("6205")
SPEED = 2.0 * np.pi * 30.0
ALL = (
    Spall(width="1 mm", edge="0.3 mm"),
    Spall(part="inner", width="1.5 mm", edge="0.3 mm"),
    Spall(part="element", width="1 mm", edge="0.3 mm"),
    Waviness(part="inner", order=3, highest=20, amplitude="0.5 um", seed=2),
    Misalignment(tilt="0.02 deg"),
    OffSize(amount="2 um", element=3),
    UnevenSpacing(amount="0.5 deg", seed=7),
)


def line_near(values: np.ndarray, rate: float, expected: float) -> float:
    """Return the frequency of the strongest line within a line's width of one expected, by the transform itself."""
    window = np.hanning(values.size)
    time = np.arange(values.size) / rate

    def level(f):
        return -abs(np.sum(window * (values - values.mean()) * np.exp(-2j * np.pi * f * time)))

    width = rate / values.size
    grid = np.linspace(expected - width, expected + width, 41)
    best = grid[np.argmin([level(f) for f in grid])]
    return float(minimize_scalar(level, bounds=(best - width / 20, best + width / 20), method="bounded").x)


@pytest.mark.parametrize(
    ("settings", "limit"),
    [
        ({}, 1e-6),
        ({"rolling_friction": 1e-3, "viscous_friction": 1.0, "cage_slip": 0.01}, 1e-6),
        ({"defects": ALL, "rolling_friction": 1e-3}, 1e-6),
    ],
)
@pytest.mark.slow
def test_energy(settings, limit):
    m = bearing_rig(DEEP.changed(clearance="5 um"), speed=SPEED, radial_load=400.0, axial_load=30.0, **settings)
    solution = m.simulate(0.03, rate=500000, tol=1e-10)
    assert solution.success, solution.message
    balance = solution.energy_balance()
    assert balance.attrs["relative_imbalance"] < limit
    assert float(balance.dissipated_damping[-1]) > 0.0
    if "rolling_friction" in settings:
        assert float(balance.dissipated_friction[-1]) > 0.0


@pytest.mark.slow
def test_cage_turns_as_ideal_rolling_says():
    for slip in (0.0, 0.012):
        solution = bearing_rig(DEEP, speed=SPEED, cage_slip=slip).simulate(0.2, rate=2000, tol=1e-8)
        turned = solution.state("bearing.cage")[-1]
        assert turned == pytest.approx(DEEP.ftf * (1.0 - slip) * SPEED * 0.2, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("defect", "order", "slip"),
    [
        (Spall(width="1.5 mm"), DEEP.bpfo, 0.0),
        (Spall(part="inner", width="1.5 mm"), DEEP.bpfi, 0.0),
        (Spall(part="element", width="1.5 mm", element=1), 2 * DEEP.bsf, 0.0),
        (UnevenSpacing(amount="6 deg", element=0), DEEP.ftf, 0.0),
        (Spall(width="1.5 mm"), 0.99 * DEEP.bpfo, 0.01),
    ],
)
def test_lines_of_defects_are_where_kinematics_put_them(defect, order, slip):
    solution = bearing_rig(DEEP, speed=SPEED, axial_load=20.0, defects=defect, cage_slip=slip).simulate(
        1.2, rate=12800, tol=1e-6
    )
    signal = housing_signal(solution, start=0.2)
    values = signal.values[:, 0]
    if isinstance(defect, UnevenSpacing):
        # a slow line stands in the motion itself
        values = solution.com_position("housing")[solution.t >= 0.2, 0]
    else:
        values = values**2
    harmonic = 3 if order > 1.0 else 1
    found = line_near(values, 12800.0, harmonic * order * 30.0) / harmonic
    assert found == pytest.approx(order * 30.0, rel=1e-4 if slip == 0.0 else 1e-3)
    if not isinstance(defect, UnevenSpacing):
        # the speed of a simulation is exact
        report = diagnose_bearing(signal.isel(channel=[0]), "6205", SPEED, tolerance=0.0)
        assert report.fault == {"outer": "outer race", "inner": "inner race"}.get(defect.part, "rolling element")
        assert report.accused[0].slip == pytest.approx(-slip, abs=2e-3)


@pytest.mark.slow
def test_varying_compliance_shakes_the_housing_at_the_ball_pass_frequency():
    solution = bearing_rig(DEEP, speed=SPEED, radial_load=300.0).simulate(0.7, rate=6400, tol=1e-7)
    place = solution.com_position("housing")[solution.t >= 0.2, 0]
    assert line_near(place, 6400.0, DEEP.bpfo * 30.0) == pytest.approx(DEEP.bpfo * 30.0, rel=1e-4)


def test_ball_in_a_spall_loses_what_the_geometry_says():
    """A ball over the middle of a gap is deflected less by its depth, and no more than the depth of the bottom."""
    place = [20e-6, 0.0, 0.0]
    sound = BearingStatics(DEEP).at(place)
    for width, depth in ((0.3e-3, 1.0), (1e-3, 1.0), (1e-3, 5e-6)):
        statics = BearingStatics(DEEP, defects=Spall(width=width, depth=depth, edge=0.02 * width))
        lost = min(spall_depth(width, 0.5 * DEEP.element_diameter), depth)
        left = DEEP.stiffness * max(20e-6 - lost, 0.0) ** 1.5
        assert statics.at(place).element_loads[0] == pytest.approx(left, rel=2e-2, abs=0.2)
        assert statics.at(place).element_loads[1] == pytest.approx(sound.element_loads[1], rel=1e-9)


@pytest.mark.slow
def test_shaking_grows_with_the_width():
    levels = []
    for width in (0.3e-3, 0.6e-3, 1.2e-3):
        solution = bearing_rig(DEEP, speed=SPEED, defects=Spall(width=width)).simulate(0.25, rate=12800, tol=1e-6)
        levels.append(float(np.std(housing_signal(solution, start=0.05).values[:, 0])))
    # the depth of the path grows with the square of the width
    assert levels[1] > 2.0 * levels[0]
    assert levels[2] > 2.0 * levels[1]


def test_modes_have_the_stiffness_at_the_load():
    """A rigid rotor in a bearing: frequencies by its stiffness matrix under the load."""
    load, mass = 600.0, 4.0
    m = Mechanism("rotor")
    rotor = m.body("rotor", mass, (0.02, 0.02, 0.02))
    angular = Bearing(
        kind="angular contact", elements=11, element_diameter=7.94e-3, pitch_diameter=38.5e-3, contact_angle="25 deg"
    )
    for name, z, sense in (("a", -0.1, 1), ("b", 0.1, -1)):
        m.add(RollingBearing.between(name, rotor, m.ground, angular, at=(0, 0, z), preload=300.0, sense=sense))
    m.load("weight", rotor.marker(), m.ground.marker(), fx=str(load))
    static_equilibrium(m, move=True)
    modes = linear_modes(m)
    stiffness = np.zeros((5, 5))
    for z, sense in ((-0.1, 1), (0.1, -1)):
        # motion of the ring by that of the rotor's centre
        arm = np.eye(5)
        arm[0, 4], arm[1, 3] = z, -z
        own = BearingStatics(angular, preload=300.0, sense=sense).at(rotor.position).stiffness
        stiffness += arm.T @ own @ arm
    root = np.diag(np.array([mass, mass, mass, 0.02, 0.02]) ** -0.5)
    expected = np.sqrt(np.linalg.eigvalsh(root @ stiffness @ root)) / (2 * np.pi)
    found = np.sort([f for f in modes.frequencies if f > 1.0])
    # damping takes a little off
    np.testing.assert_allclose(found, expected, rtol=3e-3)


@pytest.mark.slow
def test_stiffer_rings_bring_the_pair_back_to_its_joints():
    """Relative displacement of the wheels falls as 1/stiffness^(2/3), the mesh force tends to that with joints."""
    pair = GearPair.paper(backlash="0.1 mm")
    bearing = Bearing.from_designation("6206")
    ways = []
    for factor in (1.0, 100.0):
        m = rolling_rig(
            pair, bearing, speed="1000 rpm", torque="100 N m", settings={"stiffness": factor * bearing.stiffness}
        )
        solution = m.simulate(0.08, rate=5000, tol=1e-6)
        assert solution.success, solution.message
        ways.append(float(np.abs(solution.com_position("gear 1")[-100:] - solution.com_position("gear 1")[0]).max()))
    assert ways[1] < 0.1 * ways[0]


def test_outer_ring_may_turn():
    """Seen from a ring that turns with the whole, nothing changes but the direction of the load."""
    m = Mechanism("both turn")
    inner = m.body("inner", 1.0, (1e-3, 1e-3, 1e-3), angular_velocity=(0, 0, 50.0))
    outer = m.body("outer", 1.0, (1e-3, 1e-3, 1e-3), angular_velocity=(0, 0, 50.0))
    m.revolute("i", inner, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.revolute("o", outer, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.add(
        RollingBearing.between("b", inner, outer, DEEP.changed(clearance="-4 um"), at=(0, 0, 0), rolling_friction=1e-3)
    )
    solution = m.simulate(0.1, rate=1000, tol=1e-8)
    assert solution.state("b.cage")[-1] == pytest.approx(0.0, abs=1e-9)
    assert solution.angular_velocity("inner")[-1, 2] == pytest.approx(50.0, rel=1e-9)


def test_lives_follow_from_the_loads_of_a_run():
    """A bearing that turns under one load lives as ISO 281 says of that load; the share of slower turns counts less."""
    from gearmbs.bearings import bearing_lives, equivalent_load, rating_life

    rig = bearing_rig(DEEP, speed=SPEED, radial_load=1400.0, axial_load=500.0, mount_damping=1.0)
    solution = rig.simulate(0.2, rate=4000)
    lives = bearing_lives(rig, solution, start=0.1, reliability=0.99).sel(bearing="bearing")
    # the mounts take a part of what draws the housing
    x, y, z = solution.load("bearing")[0][solution.t >= 0.1].mean(axis=0)
    load = equivalent_load(DEEP, float(np.hypot(x, y)), float(z))
    assert float(lives.equivalent_load) == pytest.approx(load, rel=1e-2)
    assert float(lives.largest_load) >= float(lives.equivalent_load)
    turns = rating_life(DEEP, float(lives.equivalent_load), reliability=0.99)
    assert float(lives.life_turns) == pytest.approx(turns)
    assert float(lives.life_hours) == pytest.approx(turns / 30.0 / 3600.0, rel=1e-4)
    with pytest.raises(BearingError, match="start is 9 s"):
        bearing_lives(rig, solution, start=9.0)


@pytest.mark.slow
def test_harmonics_of_the_pair_tend_to_those_with_joints():
    """A whole case on bearings of growing stiffness: its mesh harmonics come near as 1/stiffness^(2/3)."""
    from gearmbs.studies import Case, case_mechanism, run_case

    case, bearing = Case(operation={"duration": 0.2}), Bearing.from_designation("6206")

    def levels(factor=None):
        m = (
            case_mechanism(case)
            if factor is None
            else case_mechanism(case, bearing, stiffness=factor * bearing.stiffness)
        )
        return run_case(case, False, mechanism=m).gmf_rms.sel(way="orders").values

    joints = levels()
    off = [float(np.abs(levels(factor) / joints - 1.0).max()) for factor in (1e2, 1e4)]
    assert off[0] < 0.1
    assert off[1] < 0.1 * off[0]
