"""The ideal mesh made from a pair's tooth contact carries its load with its stiffness, for every kind of wheels."""

import math
import warnings

import numpy as np
import pytest

from gearmbs.contact.ideal import ideal_mesh
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec, IdealMesh
from gearmbs.gears.ideal_mesh import IdealMeshForce
from gearmbs.gears.transmission import StaticMesh
from gearmbs.mechanism.forces.functions import vary
from tests.drivetrain.support import differences, evaluate, rotation
from tests.says import says

LOAD = 200.0


def torque_on_driven(compiled, place):
    """Torque of the kernel on the driven wheel about its axis, N m."""
    frames = np.zeros((2, 18))
    for row, (origin, axes) in zip(frames, place.frames):
        row[:3], row[3:12] = origin, axes.ravel()
    wrench, jac, none = np.zeros((1, 6)), np.zeros((6, 24)), np.zeros(0)
    work = np.zeros(compiled.scratch)
    ideal_mesh(compiled.integers, compiled.reals, 0.0, frames, none, none, 1, work, wrench, none, jac, np.zeros(4))
    moment = -wrench[0, 3:] + np.cross(place.origin_2 - place.origin_1, wrench[0, :3])
    return float(moment @ place.axes_2[:, 2])


@pytest.mark.parametrize("helix", [0.0, 0.26])
@pytest.mark.parametrize("internal", [False, True])
def test_load_and_stiffness_are_those_of_the_teeth(internal, helix):
    one = GearSpec(23, "3 mm", helix_angle=helix)
    two = GearSpec(
        70 if internal else 37,
        "3 mm",
        helix_angle=helix,
        internal=internal,
        hand="right" if internal else "left",
    )
    pair = GearPair(one, two, backlash="0.2 mm", contact=ContactLaw.linear("4e8 N/m"), friction=FlankFriction.none())
    compiled = IdealMeshForce("mesh", None, None, IdealMesh.from_contact(pair, LOAD, 64)).compiled()
    teeth = StaticMesh(pair)
    loads, slopes = [], []
    for k in range(7):
        angle = (k + 0.37) / 7 * 2 * math.pi / one.teeth
        driven = teeth.loaded_angle(angle, LOAD, teeth.ideal_angle(angle) + teeth.turning * 1e-4)
        step = 1e-7
        found = [torque_on_driven(compiled, pair.frames(angle, driven + s)) for s in (0.0, step, -step)]
        loads.append(abs(abs(found[0]) / LOAD - 1))
        slopes.append(abs((found[1] - found[2]) / (2 * step) / teeth.torque(angle, driven)[1] - 1))
    # where the number of teeth in contact steps, a curve through 64 points does so over a sixty-fourth of the cycle
    judged = np.max if helix else np.median
    assert judged(loads) < 2e-3
    assert judged(slopes) < 5e-3


def loaded_frames(place, seed=0, tilt=2e-3, shift=2e-5):
    """Return frames of both wheels, moved and tilted a little, with their rates."""
    random = np.random.default_rng(seed)
    rows = [np.concatenate([origin + shift * random.standard_normal(3),
                            (rotation(tilt * random.standard_normal(3)) @ axes).ravel(),
                            0.01 * random.standard_normal(3), 3.0 * random.standard_normal(3)])
            for origin, axes in place.frames]  # fmt: skip
    return np.vstack(rows)


def helical_element(internal, rotation=1):
    """Return the ideal mesh of a helical pair as a force element, and the pair."""
    one = GearSpec(21, "3 mm", helix_angle="14 deg", face_width="25 mm")
    two = GearSpec(
        84 if internal else 52, "3 mm", helix_angle="14 deg", internal=internal, hand="right" if internal else "left"
    )
    pair = GearPair(one, two, backlash="0.1 mm", rotation=rotation)
    return IdealMeshForce("mesh", None, None, IdealMesh(pair, 4e8, damping=1e3)), pair


@pytest.mark.parametrize("internal", [False, True])
@pytest.mark.parametrize("rotation", [1, -1])
def test_the_spring_of_helical_wheels_goes_through_the_pitch_point_however_they_have_turned(internal, rotation):
    element, pair = helical_element(internal, rotation)
    radius = pair.driver.base_radius / math.cos(pair.geometry.working_pressure_angle)
    for turn in (-5.0, 0.0, 0.1, 1.3, 4.0):
        frames = np.zeros((2, 18))
        for row, (origin, axes) in zip(frames, pair.placement(turn).frames):
            row[:3], row[3:12] = origin, axes.ravel()
        _, _, jac, _ = evaluate(element, frames)
        # the planet touches its ring on the side away from the ring's centre
        pitch_point = np.array([-radius if internal else radius, 0.0, 0.0])
        # of a spring K n n^T a shift along x tells force and moment: the moment about the pitch point is none
        force, moment = jac[:3, 0], jac[3:6, 0]
        assert abs(force[2] / np.linalg.norm(force)) == pytest.approx(math.sin(pair.driver.base_helix_angle))
        np.testing.assert_allclose(moment, np.cross(pitch_point, force), atol=1e-9 * radius * np.abs(force).max())


@pytest.mark.parametrize("internal", [False, True])
def test_derivatives_of_helical_springs_are_those_of_their_forces(internal):
    element, pair = helical_element(internal)
    frames = loaded_frames(pair.placement(2.2))
    _, _, jac, _ = evaluate(element, frames)
    expected = differences(element, frames, (), (), step=1e-7)
    scale = np.abs(expected).max(axis=0)
    assert np.abs(jac - expected).max(axis=0) == pytest.approx(np.zeros(24), abs=1e-8 * scale.max())


def test_the_force_of_tilted_helical_springs_is_that_of_their_energy():
    element, pair = helical_element(False)
    frames = loaded_frames(pair.placement(-3.0))
    frames[:, 12:] = 0.0
    wrench, _, _, _ = evaluate(element, frames)
    step, found = 1e-7, np.zeros(6)
    for column in range(6):
        energies = []
        for sign in (1.0, -1.0):
            moved = np.zeros_like(frames)
            vary(np.ascontiguousarray(frames), moved, 0, column, sign * step)
            energies.append(evaluate(element, moved)[3][0])
        found[column] = -(energies[0] - energies[1]) / (2.0 * step)
    np.testing.assert_allclose(wrench, found, atol=1e-6 * np.abs(wrench).max())


@pytest.mark.parametrize("stiffness", [400.0, 400e3])
def test_a_stiffness_that_is_meant_in_other_units_is_told(stiffness):
    pair = GearPair.paper()
    with pytest.warns(UserWarning, match=says("IdealMesh.stiffness", "N/m", "write")):
        IdealMesh(pair, stiffness)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert IdealMesh(pair, f"{stiffness} N/m").stiffness == stiffness
        IdealMesh(pair, 4e8)
