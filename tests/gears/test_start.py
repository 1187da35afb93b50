"""Teeth that start deep in each other are refused by name; what a load explains, and what jams by its drawing, runs."""

import math
import re

import numpy as np
import pytest

from gearmbs.dae.problem import ModelError
from gearmbs.gears import ContactLaw, GearPair, GearSpec, planetary
from gearmbs.gears.planetary_mechanism import planetary_mechanism
from gearmbs.mechanism import Mechanism
from tests.drivetrain.support import rotation, stage
from tests.generators import cases, seed
from tests.says import says

PAPER = GearPair.paper(backlash="0.1 mm")


def two_wheels(pair, depth=0.0, torque=0.0, held=False):
    """Wheels on revolute joints, the driver at rest, the driven one turned ``depth`` (m) into its mate."""
    turn = pair.sign * pair.rotation * depth / pair.driven.base_radius
    place = pair.frames(0.0, pair.driven_angle(0.0) + turn)
    m = Mechanism("two wheels")
    wheels = []
    for k, ((origin, axes), wheel) in enumerate(zip(place.frames, pair.wheels)):
        body = m.body(f"wheel {k + 1}", wheel.mass, wheel.inertia, position=origin, orientation=axes)
        joint = m.revolute(f"bearing {k + 1}", body, m.ground, at=origin, axis=axes[:, 2])
        if k == 0 or held:
            m.rotation(f"drive {k + 1}", joint, "0.0")
        wheels.append(body)
    # the load presses the driven wheel against the driver's flanks
    m.torque("load", wheels[1], pair.sign * pair.rotation * torque, axis=place.axes_2[:, 2])
    m.gear_contact("mesh", *wheels, pair)
    return m


@pytest.mark.parametrize("depth", [0.2e-3, 0.635e-3, -0.3e-3])
def test_deep_teeth_are_refused_by_name_with_a_way_out(depth):
    flanks = "drive" if depth > 0 else "coast"
    deep = depth if depth > 0 else -depth - PAPER.normal_backlash
    with pytest.raises(ModelError, match=rf"gear contact 'mesh'.*{flanks}") as error:
        two_wheels(PAPER, depth).simulate(1e-4)
    said = float(re.search(r"teeth are ([\d.]+) mm deep", str(error.value)).group(1)) * 1e-3
    assert said == pytest.approx(deep, rel=1e-3)
    # turned as the message says they just touch
    turn = math.radians(float(re.search(r"Turn 'wheel 2' by (\S+) deg", str(error.value)).group(1)))
    left = depth + turn * PAPER.rotation * PAPER.driven.base_radius
    two_wheels(PAPER, left).simulate(1e-4)
    touching = {"drive": 0.0, "coast": -PAPER.normal_backlash}[flanks]
    assert left == pytest.approx(touching, abs=1e-3 * deep)


def test_a_start_under_load_runs_as_deep_as_the_load_presses():
    for torque in (50.0, 400.0, 3000.0):
        static = PAPER.penetration(torque, 2)
        two_wheels(PAPER, static, torque).simulate(1e-4)
        two_wheels(PAPER, 1.6 * static, torque).simulate(1e-4)
    static = PAPER.penetration(400.0, 2)
    with pytest.raises(ModelError, match=says("explain nothing")):
        two_wheels(PAPER, 1.5 * static, -400.0).simulate(1e-4)
    with pytest.raises(ModelError, match=r"loads there explain \d+ %"):
        two_wheels(PAPER, 3.5 * static, 400.0).simulate(1e-4)


def test_soft_teeth_start_as_deep_as_they_yield():
    soft = PAPER.with_changes(contact=ContactLaw.linear("2e6 N/m", damping="20 N*s/m"))
    depth = soft.penetration(50.0, 2)
    assert depth > 0.2e-3
    two_wheels(soft, depth, 50.0).simulate(1e-4)
    with pytest.raises(ModelError, match="its teeth are"):
        two_wheels(soft, depth, 0.0).simulate(1e-4)


def test_wheels_both_held_are_refused_where_they_are_deep():
    two_wheels(PAPER, 30e-6, held=True).simulate(1e-4)
    with pytest.raises(ModelError, match=says("0.2 mm", "teeth")):
        two_wheels(PAPER, 0.2e-3, held=True).simulate(1e-4)


def test_teeth_that_jam_by_their_drawing_start():
    with pytest.warns(UserWarning, match=says("88.6710 mm", "-0.1356 mm", "give backlash 0.1356 mm")):
        tight = GearPair.paper(centre_distance_error="-0.2 mm")
    two_wheels(tight).simulate(1e-5)
    two_wheels(GearPair.paper(misalignment="1 deg")).simulate(1e-5)


def test_any_pair_starts_where_it_is_placed_and_not_deep():
    rng = np.random.default_rng(seed())
    for _ in range(cases(12)):
        internal = bool(rng.integers(2))
        helix = {"helix_angle": f"{rng.choice([0, 15])} deg"}
        z1 = int(rng.integers(17, 40))
        if internal:
            mate = GearSpec.ring(z1 + int(rng.integers(20, 60)), "2 mm", addendum="1.5 mm", **helix)
        else:
            mate = GearSpec(int(rng.integers(17, 80)), "2 mm", hand="left", **helix)
        pair = GearPair(GearSpec(z1, "2 mm", **helix), mate, backlash="0.15 mm", rotation=int(rng.choice([-1, 1])))
        assert two_wheels(pair).elements["mesh"].start_overlap() is None
        deep = rng.uniform(0.06e-3, 0.5e-3)
        overlap = two_wheels(pair, deep).elements["mesh"].start_overlap()
        assert overlap is not None
        assert "on the drive flanks" in overlap.text


def turned(mechanism, body, depth, radius):
    """The mechanism with one of its bodies turned about its z axis until its teeth are so deep in their mates."""
    one = mechanism.bodies[body]
    one.orientation = rotation(one.orientation[:, 2] * depth / radius) @ one.orientation
    return mechanism


@pytest.mark.parametrize("depth", [0.3e-3, -0.5e-3])
def test_a_wheel_of_a_drivetrain(depth):
    train = stage()
    radius = train.wheels[1].gear.base_radius
    with pytest.raises(ModelError, match=says("gear", "'mesh'")):
        turned(train.build(), "out", depth, radius).simulate(1e-4)
    turned(train.build(), "out", math.copysign(30e-6, depth), radius).simulate(1e-4)


def test_a_planet_of_a_set():
    gears = planetary((24, 30, 84), "1.5 mm", backlash_sun="0.05 mm", backlash_ring="0.05 mm")
    settings = {"speeds": {"sun": "300 rpm"}, "torques": {"carrier": "-60 N m"}, "run_up": "0.01 s"}
    planetary_mechanism(gears, **settings).simulate(1e-5)
    for sign in (1, -1):
        deep = turned(planetary_mechanism(gears, **settings), "planet 2", sign * 0.3e-3, gears.planet.base_radius)
        with pytest.raises(ModelError, match=r"gear contact '(sun-planet 2|planet 2-ring)'"):
            deep.simulate(1e-5)


def test_a_run_that_goes_on_from_an_impact():
    two_wheels(PAPER, 0.15e-3).simulate(1e-6, continued=True)
