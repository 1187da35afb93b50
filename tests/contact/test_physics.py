"""Statics, symmetries, energy and the absence of adhesion."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec
from gearmbs.gears.transmission import StaticMesh

from .probe_tools import Contact, moved, rotation, shaken, varied

ELASTIC = ContactLaw.impact(damping=0.0)
FREE = {"friction": FlankFriction.none(), "contact": ELASTIC}


def static(pair, driver_angle, torque=100.0, slices=None):
    mesh = StaticMesh(pair, slices)
    angle = mesh.loaded_angle(driver_angle, torque, mesh.touching_angle(driver_angle))
    mesh.torque(driver_angle, angle)
    return mesh, angle


def test_normal_force_and_penetration():
    # F = T / r_b whatever the centre distance; K delta^1.3 = F, or F/2 for two pairs (one pair at the pitch point)
    for error in (0.0, 1e-3, 3e-3):
        pair = GearPair.paper(centre_distance_error=error, **FREE)
        mesh, _ = static(pair, 0.0)
        if mesh.diag[5] == 1:
            assert mesh.diag[7] == pytest.approx(100 / pair.driven.base_radius, rel=1e-9)
            assert mesh.diag[3] == pytest.approx(24.43e-6, rel=2e-4)
            radial, tangential = -mesh.wrench[0], mesh.wrench[1]
            assert abs(radial / tangential) == pytest.approx(np.tan(pair.working_pressure_angle), rel=1e-9)
    pair = GearPair.paper(**FREE)
    assert pair.normal_force == pytest.approx(2394.9, abs=0.05)
    assert pair.penetration() == pytest.approx(24.43e-6, abs=5e-9)
    assert pair.penetration(pairs=2) == pytest.approx(14.33e-6, abs=5e-9)
    assert pair.penetration(200.0) == pytest.approx(41.64e-6, abs=5e-9)


@pytest.mark.parametrize(("plane", "depth"), [("skew", 108.5e-6), ("inclination", 69.9e-6)])
def test_wedge_depth(plane, depth):
    # one pair: F = (K / b) d0^(e+1) / (s (e+1)), s = gamma cos(alpha) for skew, gamma sin(alpha) for inclination
    pair = GearPair.paper(misalignment="1 deg", plane=plane, backlash="0.6 mm", **FREE)
    slope = np.radians(1) * (np.cos(np.radians(20)) if plane == "skew" else np.sin(np.radians(20)))
    law = pair.contact
    closed = (pair.normal_force * slope * (law.exponent + 1) * 20e-3 / law.stiffness) ** (1 / (law.exponent + 1))
    assert closed == pytest.approx(depth, rel=1e-3)
    # at a contact ratio below 1 single pairs carry the load; the slope follows the working pressure angle
    pair = pair.with_changes(centre_distance_error="2.6 mm", backlash=0.0)
    alpha = pair.working_pressure_angle
    slope *= np.cos(alpha) / np.cos(np.radians(20)) if plane == "skew" else np.sin(alpha) / np.sin(np.radians(20))
    closed = (pair.normal_force * slope * (law.exponent + 1) * 20e-3 / law.stiffness) ** (1 / (law.exponent + 1))
    found = []
    for driver_angle in np.linspace(0, 0.21, 30):
        mesh, _ = static(pair, driver_angle, slices=41)
        if mesh.diag[5] == 1:
            found.append(mesh.diag[3])
    assert len(found) >= 3
    # what is left is the oblique end of the face and tilt of second order
    assert np.array(found) == pytest.approx(closed, rel=0.01)


@pytest.mark.parametrize("plane", ["skew", "inclination"])
def test_slices_converge(plane):
    forces = {}
    for slices in (11, 21, 161):
        pair = GearPair.paper(misalignment="1 deg", plane=plane, **FREE)
        mesh = StaticMesh(pair, slices)
        forces[slices] = np.array(
            [mesh.torque(a, mesh.ideal_angle(a) + 20e-6 / 0.0417)[0] for a in np.linspace(0, 0.21, 8)]
        )
    assert forces[21] == pytest.approx(forces[161], rel=1e-3)
    assert forces[11] == pytest.approx(forces[161], rel=1e-3)


def test_small_tilt_returns_the_parallel_case():
    parallel = static(GearPair.paper(**FREE), 0.05)[1]
    for slices in (1, 9):
        same = static(GearPair.paper(misalignment=1e-9, **FREE), 0.05, slices=slices)[1]
        # the blended ends of the face cost 1 um of 20 mm
        assert (same - parallel) * 0.0417 == pytest.approx(0, abs=3e-9)


@pytest.mark.parametrize("plane", ["skew", "inclination"])
def test_jams_exactly_when_backlash_is_used_up(plane):
    # wedge over the face: b gamma cos(alpha) for skew, b gamma sin(alpha) for inclination
    for factor, jammed in ((0.97, True), (1.03, False)):
        trial = GearPair.paper(misalignment="0.2 deg", plane=plane)
        pair = trial.with_changes(backlash=factor * trial.jam_backlash, **FREE)
        assert pair.jams is jammed
        mesh = StaticMesh(pair, 41)
        touch = mesh.touching_angle(0.05)
        back = mesh.gaps(0.05, touch)
        assert bool(back[back[:, 0] == -1, 4].min() < 0) is jammed


@pytest.mark.parametrize(("plane", "second_order"), [("skew", 0.72e-6), ("inclination", 5.3e-6)])
def test_the_backlash_that_jams_found_from_gaps(plane, second_order):
    # found without the formula: thinner teeth until the back flanks are free where the drive flanks touch
    missing = []
    for degrees in (0.1, 0.2, 1.0):
        trial = GearPair.paper(misalignment=np.radians(degrees), plane=plane, centre_distance_error="0.01 mm")

        def back_gap(backlash, trial=trial):
            mesh = StaticMesh(trial.with_changes(backlash=backlash), 41)
            rows = mesh.gaps(0.05, mesh.touching_angle(0.05))
            return rows[rows[:, 0] == -1, 4].min()

        needed = trial.jam_backlash - trial.normal_backlash
        found = brentq(back_gap, 0.5 * max(needed, 1e-7), 2 * max(needed, 1e-6), xtol=1e-12)
        missing.append(needed - found)
    # the closed form is of first order in the tilt: what it misses grows with the square, to 0.7 or 5.3 um at 1 degree
    assert missing[2] == pytest.approx(second_order, rel=0.03)
    assert missing[2] / missing[1] == pytest.approx(25, rel=0.06)
    assert missing[1] / missing[0] == pytest.approx(4, rel=0.06)


@pytest.mark.parametrize("changes", [{}, {"misalignment": "1 deg"}, {"centre_distance_error": "3 mm"}])
def test_one_pitch_later_is_the_same(changes):
    contact = Contact(GearPair.paper(**changes))
    state = contact.state(0.123, 20e-6, 100.0)
    first = contact(state)
    turn = 2 * np.pi / 29
    state[1] = state[1] @ rotation(np.array([0, 0, turn]))
    state[5] = state[5] @ rotation(np.array([0, 0, -turn]))
    assert contact(state) == pytest.approx(first, rel=1e-8)


@pytest.mark.parametrize("changes", [{}, {"misalignment": "1 deg"}, {"misalignment": "1 deg", "plane": "inclination"}])
def test_mirrored_drive(changes):
    # reflection in the plane y = 0: forces flip y, torques flip x and z
    forward = Contact(GearPair.paper(**changes))
    back = Contact(GearPair.paper(**{**changes, "rotation": -1}))
    state = forward.state(0.123, 20e-6, 100.0)
    mirror = np.diag([1.0, -1.0, 1.0])
    image = [a.copy() for a in state]
    for k in (0, 2, 4, 6):
        image[k] = mirror @ state[k]
    for k in (1, 5):
        image[k] = mirror @ state[k] @ mirror
    for k in (3, 7):
        image[k] = -mirror @ state[k]
    signs = np.array([1, -1, 1, -1, 1, -1])
    one, two = forward(state), back(image)
    assert two == pytest.approx(signs * one, rel=1e-12, abs=1e-9)
    assert back.diag == pytest.approx(forward.diag, rel=1e-12)


@pytest.mark.parametrize("changes", [{}, {"misalignment": "1 deg"}, {"centre_distance_error": "3 mm"}])
def test_driver_and_driven_exchanged(changes):
    pair = GearPair.paper(driver=GearSpec(29, 95e-3 / 31, face_width="22 mm"), **changes)
    contact = Contact(pair, 11)
    swapped = Contact(pair.with_changes(driver=pair.driven, driven=pair.driver, rotation=1), 11)
    state = shaken(contact.state(0.123, 20e-6, 100.0), np.random.default_rng(2))
    force = contact(state)
    other = swapped(state[4:] + state[:4])
    arm = state[0] - state[4]
    torque = -force[3:] - np.cross(arm, force[:3])
    assert other[:3] == pytest.approx(-force[:3], rel=1e-9)
    assert other[3:] == pytest.approx(torque, rel=1e-8, abs=1e-8)


def test_frame_rotated():
    contact = Contact(GearPair.paper(misalignment="1 deg"))
    state = contact.state(0.123, 20e-6, 100.0)
    turn = rotation(np.array([0.3, -1.1, 2.0]))
    force = contact(state)
    other = contact(moved(state, turn, np.array([0.1, -0.2, 0.3])))
    assert other == pytest.approx(np.concatenate([turn @ force[:3], turn @ force[3:]]), rel=1e-8)


@pytest.mark.parametrize(
    "changes", [{}, {"misalignment": "1 deg"}, {"misalignment": "0.3 deg", "plane": "inclination"}]
)
def test_elastic_force_is_the_gradient_of_its_energy(changes):
    pair = GearPair.paper(**FREE, **changes)
    for slices, tolerance in ((1, 1e-8), (41, 2e-5)):
        contact = Contact(pair, slices)
        rng = np.random.default_rng(8)
        for _ in range(4):
            state = shaken(contact.state(rng.uniform(0, 6), 30e-6), rng)
            force = contact(state)
            gradient = []
            for column in range(6):
                h = 2e-8 if column < 3 else 4e-7
                e = [contact.energy(varied(state, column, m * h)) for m in (1, -1, 2, -2)]
                gradient.append(-(8 * (e[0] - e[1]) - (e[2] - e[3])) / (12 * h))
            scale = np.repeat([abs(force[:3]).max(), abs(force[3:]).max()], 3)
            assert np.array(gradient) / scale == pytest.approx(force / scale, abs=tolerance)


def test_closed_cycle_does_no_work():
    contact = Contact(GearPair.paper(misalignment="1 deg", **FREE), 41)
    start = contact.state(0.1, 30e-6)
    work = 0.0
    stored = 0.0
    angles = np.linspace(0, 2 * np.pi, 801)
    energy = contact.energy(start)
    trail = []
    for t in angles:
        state = [a.copy() for a in start]
        state[0] = state[0] + 8e-6 * np.array([np.sin(t), np.cos(t) - 1, np.sin(2 * t)])
        state[1] = rotation(1e-4 * np.array([np.sin(t), np.cos(t) - 1, np.sin(3 * t)])) @ state[1]
        trail.append((state, contact(state)))
        stored = max(stored, contact.energy(state))
    for (a, fa), (b, fb) in pairwise(trail):
        turn = b[1] @ a[1].T
        step = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        work += 0.5 * ((fa + fb)[:3] @ (b[0] - a[0]) + (fa + fb)[3:] @ step)
    assert contact.energy(trail[-1][0]) == pytest.approx(energy, rel=1e-12)
    assert abs(work) < 2e-5 * stored


def test_centroid_of_a_wedge_sees_five_sevenths():
    # overlap of convex flanks: cross-section as delta^1.5, so the centroid lies 2/7 from the deep end
    pair = GearPair.paper(misalignment="1 deg", backlash="0.6 mm", load="adams", **FREE)
    for slices in (11, 41):
        mesh, _ = static(pair, 0.02, slices=slices)
        if mesh.diag[5] == 1:
            assert pair.penetration() / mesh.diag[3] == pytest.approx(5 / 7, rel=2e-3)


def test_friction_flips_at_the_pitch_point():
    # off the line of action the force on the wheel changes sign when sliding does; its size is mu F
    pair = GearPair.paper(contact=ELASTIC, centre_distance_error="2.1 mm")
    contact = Contact(pair, 1)
    found = []
    for driver_angle in np.linspace(0, 2 * np.pi / 29, 60):
        state = contact.state(driver_angle, 20e-6, 1000 * np.pi / 30)
        force = contact(state)
        if contact.diag[5] == 1:
            alpha = pair.working_pressure_angle
            along = force[0] * np.cos(alpha) - force[1] * np.sin(alpha)
            found.append(along / contact.diag[7])
    found = np.array(found)
    assert found.max() == pytest.approx(0.1, rel=0.05)
    assert found.min() == pytest.approx(-0.1, rel=0.05)


def test_separating_flanks_never_pull():
    contact = Contact(GearPair.paper())
    state = contact.state(0.1, 20e-6, 100.0)
    state[7] = state[7] * 0.9  # the driven wheel lags: pressing harder
    assert contact(state)[0] < 0
    state[7] = state[7] / 0.9 * 1.1  # runs ahead: full damping would pull
    assert np.all(contact(state) == 0)


@pytest.mark.parametrize("slices", [1, 11])
def test_fuzz_stays_finite_pushes_and_does_not_jump(slices):
    pair = GearPair.paper(contact=ELASTIC, friction=FlankFriction.none())
    contact = Contact(pair, slices)
    rng = np.random.default_rng(0)
    stiffest = 4 * pair.contact.exponent * pair.contact.stiffness * (0.4e-3) ** 0.3
    base = contact.state(0.0, 0.0)
    for _ in range(1500):
        state = [a.copy() for a in base]
        state[1] = rotation(rng.normal(size=3) * [0.01, 0.01, 3]) @ state[1]
        state[5] = rotation(rng.normal(size=3) * [0.01, 0.01, 3]) @ state[5]
        state[4] = state[4] + rng.normal(size=3) * [5e-4, 5e-4, 3e-3]
        force = contact(state, 1)
        assert np.isfinite(force).all()
        assert np.isfinite(contact.jac).all()
        assert contact.diag[7] >= 0
        deep = max(contact.diag[3], contact.diag[4])
        if deep < 0.3e-3:
            near = [a.copy() for a in state]
            near[5] = rotation(rng.normal(size=3) * 1e-8) @ near[5]
            assert np.linalg.norm(contact(near)[:3] - force[:3]) < stiffest * 2e-8 * 0.05 * 4
