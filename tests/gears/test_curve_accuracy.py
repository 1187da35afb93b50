"""Transmission error and stiffness at rest with numerical errors: they hold against more slices and points."""

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec, kinematic_transmission_error, loaded_transmission_error
from gearmbs.gears.modifications import Crowning
from tests.says import says

HELICAL = GearPair(
    GearSpec(23, "3 mm", helix_angle="15 deg", hand="right", face_width="20 mm"),
    GearSpec(31, "3 mm", helix_angle="15 deg", hand="left", face_width="20 mm"),
    backlash="0.1 mm", torque=100.0,
)  # fmt: skip
SPUR = GearPair(GearSpec(23, "3 mm", face_width="20 mm"), GearSpec(31, "3 mm", face_width="20 mm"), torque=100.0)


def numbers(curve):
    return np.array([curve.mean, curve.peak_to_peak, *curve.harmonics(), curve.stiffness.mean()])


def told(curve):
    e = curve.errors
    return np.array([e.mean, e.peak_to_peak, *[e.harmonics] * 5, e.stiffness])


@pytest.mark.slow
@pytest.mark.parametrize("pair", [HELICAL, SPUR, HELICAL.with_faults(Crowning(wheel="driver", amount="5 um"))])
def test_what_a_loaded_curve_tells_is_within_its_errors(pair):
    known = loaded_transmission_error(pair, points=200, accuracy="2 %")
    assert known.errors.found <= 0.02
    slices = 4 * known.errors.slices if known.errors.slices > 1 else 1
    true = loaded_transmission_error(pair, points=8 * known.errors.points, slices=slices)
    assert (np.abs(numbers(known) - numbers(true)) <= told(known)).all()
    assert "%" in str(known.errors)


def test_a_curve_of_perfect_flanks_without_load_is_exact():
    known = kinematic_transmission_error(SPUR, points=20, accuracy="1 %")
    assert known.errors.slices == 1
    assert known.errors.points == 20


def test_what_cannot_be_judged_is_named():
    with pytest.raises(ValueError, match=says("one slice", "two slices")):
        loaded_transmission_error(HELICAL, slices=1, accuracy="1 %")
    with pytest.raises(ValueError, match=says("points is 21", "even")):
        loaded_transmission_error(SPUR, points=21, accuracy="1 %")
    with pytest.raises(ValueError, match=says("accuracy = '1 N'")):
        loaded_transmission_error(SPUR, accuracy="1 N")
