"""Exact derivatives of a bearing's wrench and rates against differences, in all its kinds."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.bearings import Bearing, Misalignment, OffSize, Waviness
from tests.bearings.probe import Probe

DEEP = Bearing.from_designation("6205")
ANGULAR = Bearing(
    kind="angular contact", elements=11, element_diameter=7.94e-3, pitch_diameter=38.5e-3, contact_angle="25 deg"
)
FOUR = ANGULAR.changed(kind="four point", contact_angle="35 deg")
CYLINDRICAL = Bearing(
    kind="cylindrical roller", elements=13, element_diameter=7.5e-3, pitch_diameter=46.5e-3, roller_length=9.5e-3
)
TAPERED = CYLINDRICAL.changed(kind="tapered roller", elements=17, contact_angle="14 deg")
SPHERICAL = TAPERED.changed(kind="spherical roller", contact_angle="10 deg")
ALIGNING = ANGULAR.changed(kind="self-aligning ball", contact_angle="11 deg")
BACK = ANGULAR.changed(kind="double row angular contact", contact_angle="30 deg", row_distance="12 mm")
TWO_ROLLERS = CYLINDRICAL.changed(kind="double row cylindrical roller", row_distance="12 mm")
RINGS = (Waviness(part="inner", order=7, amplitude="2 um"), Waviness(part="outer", order=5, amplitude="2 um"))
ALL = (
    *RINGS,
    Waviness(part="element", element=2, order=2, amplitude="1 um"),
    Waviness(part="element", element=5, order=3, amplitude="1 um"),
    Misalignment(part="inner", tilt="0.05 deg"),
    Misalignment(tilt="0.03 deg", angle="1 rad"),
    OffSize(amount="3 um", element=4),
)
TORQUELESS = (SPHERICAL.kind, ALIGNING.kind)
CASES = {
    "deep groove": (DEEP, {}),
    "friction": (DEEP, {"rolling_friction": 2e-3, "viscous_friction": 2.0}),
    "wavy rings": (DEEP, {"defects": RINGS}),
    "all defects": (DEEP, {"defects": ALL, "rolling_friction": 0.01}),
    "smooth": (DEEP, {"smooth": "4 um"}),
    "angular contact": (ANGULAR, {"preload": "200 N"}),
    "other sense": (ANGULAR, {"preload": 200.0, "sense": -1, "cage_slip": 0.01}),
    "four point": (FOUR, {}),
    "cylindrical": (CYLINDRICAL, {"slices": 5}),
    "tapered": (TAPERED, {"preload": 300.0, "sense": -1, "defects": RINGS, "slices": 5}),
    "spherical": (SPHERICAL, {"defects": RINGS}),
    "self-aligning": (ALIGNING, {}),
    "double row angular contact": (BACK, {"defects": RINGS, "rolling_friction": 0.01}),
    "double row cylindrical": (TWO_ROLLERS, {"slices": 5}),
    "centrifugal": (ANGULAR, {"preload": 200.0, "centrifugal": True}),
    "centrifugal four point": (FOUR, {"centrifugal": True}),
    "centrifugal four point with defects": (FOUR, {"centrifugal": True, "defects": ALL}),
    "random slip": (DEEP, {"slip_scatter": 0.02, "slip_memory": 0.3, "defects": RINGS, "rolling_friction": 0.01}),
    "random slip, centrifugal": (ANGULAR, {"preload": 200.0, "centrifugal": True, "slip_scatter": 0.02}),
    "centrifugal rollers": (CYLINDRICAL, {"centrifugal": True, "slices": 5}),
    "centrifugal tapered": (TAPERED, {"centrifugal": True, "preload": 300.0, "slices": 5, "defects": RINGS}),
    "centrifugal with defects": (DEEP, {"centrifugal": True, "defects": ALL, "rolling_friction": 0.01}),
}


@pytest.mark.parametrize("name", CASES)
def test_jacobian_against_differences(name):
    bearing, settings = CASES[name]
    probe = Probe(bearing, **settings)
    rng = np.random.default_rng(5)
    checked = 0
    for _ in range(8):
        probe.shaken(rng, 2e-5, 3e-4, 3000.0 if "centrifugal" in name else 300.0)
        value, exact, told = probe()
        if told[3] <= 1.0:
            continue
        # the balls' equilibrium is iterated, to a rounding error of its own
        h = 4e-9 if "centrifugal" in name else 5e-10
        near = probe.differences(steps=(h, 10.0 * h, 1e-4, 1e-3), state_step=1e-5)
        wider = probe.differences(steps=(2 * h, 20.0 * h, 1e-4, 1e-3), state_step=1e-5)
        if abs(near[:6] - wider[:6]).max() > 1e-6 * abs(near[:6]).max():
            # an element is about to touch, where the law has no second derivative
            continue
        checked += 1
        for rows in (slice(0, 3), slice(3, 6)):
            for block in range(9):
                columns = slice(3 * block, 3 * block + 3) if block < 8 else slice(24, None)
                # differences do not resolve less
                scale = max(abs(near[rows, columns]).max(), abs(value[rows]).max())
                if bearing.kind in TORQUELESS and rows.start == 3:
                    # torques of the elements, which cancel
                    scale = max(scale, 0.5 * bearing.pitch_diameter * abs(value[:3]).max())
                assert exact[rows, columns] == pytest.approx(near[rows, columns], abs=1e-6 * scale), (rows, block)
        near = probe.differences(steps=(1e-6, 1e-4, 1e-2, 1e-1), state_step=1e-4)
        assert exact[6:] == pytest.approx(near[6:], abs=1e-7 * abs(near[6:]).max())
    assert checked >= 3


@pytest.mark.parametrize("name", [name for name in CASES if name != "random slip, centrifugal"])
def test_power_is_stored_or_dissipated(name):
    """Power of the wrench + dU/dt + what damping and friction take = 0, at constant centrifugal load."""
    bearing, settings = CASES[name]
    probe = Probe(bearing, **settings)
    rng = np.random.default_rng(8)
    for _ in range(6):
        probe.shaken(rng, 2e-5, 3e-4, 300.0)
        value, _, told = probe()
        force, torque, rates = value[:3], value[3:6], value[6:]
        i, j = probe.frames
        given = force @ (i[12:15] - j[12:15] - np.cross(j[15:], i[:3] - j[:3])) + torque @ (i[15:] - j[15:])
        energies = []
        h = 4e-7
        for side in (h, -h, 2 * h, -2 * h):
            energies.append(probe(moved(probe.frames, side), probe.states + side * rates)[2][0])
        change = (8 * (energies[0] - energies[1]) - (energies[2] - energies[3])) / (12 * h)
        lost = told[1] + told[2]
        size = abs(given) + abs(change) + lost
        # the centrifugal load changes a little as the axes lean
        share = 1e-4 if "centrifugal" in name else 2e-6
        assert given + change + lost == pytest.approx(0.0, abs=share * size + 1e-9)
        assert told[1] >= 0.0
        assert told[2] >= 0.0


def moved(frames: np.ndarray, time: float) -> np.ndarray:
    """Return frames after a short time, with the same velocities, both seen from the second one's axes of motion."""
    from scipy.spatial.transform import Rotation

    out = frames.copy()
    for k in range(2):
        out[k, :3] += time * frames[k, 12:15]
        out[k, 3:12] = (Rotation.from_rotvec(time * frames[k, 15:]).as_matrix() @ frames[k, 3:12].reshape(3, 3)).ravel()
    return out


def test_turning_the_whole_changes_nothing():
    """The wrench turns with the frames."""
    from scipy.spatial.transform import Rotation

    probe = Probe(DEEP, defects=ALL)
    probe.shaken(np.random.default_rng(2), 2e-5, 3e-4, 300.0)
    before = probe()[0]
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    for frame in probe.frames:
        for part in (slice(0, 3), slice(12, 15), slice(15, 18)):
            frame[part] = turn @ frame[part]
        frame[3:12] = (turn @ frame[3:12].reshape(3, 3)).ravel()
    after = probe()[0]
    scale = abs(before[:3]).max()
    np.testing.assert_allclose(after[:3], turn @ before[:3], atol=1e-7 * scale)
    np.testing.assert_allclose(after[3:6], turn @ before[3:6], atol=1e-7 * abs(before[3:6]).max())


@pytest.mark.parametrize("name", CASES)
def test_values_alone_are_the_same(name):
    """Without derivatives or diagnostics a shorter way through the kernel is taken."""
    bearing, settings = CASES[name]
    probe = Probe(bearing, **settings)
    rng = np.random.default_rng(11)
    for _ in range(5):
        probe.shaken(rng, 2e-5, 3e-4, 300.0)
        full = probe()[0]
        np.testing.assert_allclose(probe(want=0)[0], full, rtol=1e-12, atol=1e-12 * abs(full[:3]).max())
