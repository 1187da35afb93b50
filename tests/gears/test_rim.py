"""Bending of a ring's rim between its bolts."""

import math

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.stiffness import SHEAR, arc_flexibility, mesh_stiffness, rim_compliance, tooth_compliance

RING = GearSpec.ring(70, "3 mm", rim_thickness="8 mm")
MODULI = (2e11, 8e10)


def test_a_beam_of_large_radius_is_straight():
    length, thickness, width, radius = 0.1, 0.01, 0.02, 1e4
    young, rigid = MODULI
    area, second = thickness * width, thickness**3 * width / 12
    found = arc_flexibility(radius, length / radius, thickness, width, MODULI)
    bent = length**3 / (3 * young * second) + SHEAR * length / (rigid * area)
    assert found[0, 0] == pytest.approx(bent, rel=1e-5)
    assert found[1, 1] == pytest.approx(length / (young * area), rel=1e-4)
    assert found[2, 2] == pytest.approx(length / (young * second), rel=1e-9)
    assert found[0, 2] == pytest.approx(length**2 / (2 * young * second), rel=1e-5)
    # both ends clamped, loaded in the middle: L^3 / (192 E I), with L twice the length
    both = sum(np.linalg.inv(arc_flexibility(radius, s * length / radius, thickness, width, MODULI)) for s in (1, -1))
    middle = (2 * length) ** 3 / (192 * young * second) + SHEAR * 2 * length / (4 * rigid * area)
    assert np.linalg.inv(both)[0, 0] == pytest.approx(middle, rel=1e-5)


def test_a_quarter_circle():
    # in-plane bending alone: outwards R^3 pi / (4 E I) for a force across the end of a quarter ring
    found = arc_flexibility(0.1, 0.5 * math.pi, 1e-4, 1.0, MODULI)
    second = 1e-12 / 12
    assert found[0, 0] == pytest.approx(math.pi * 0.1**3 / (4 * MODULI[0] * second), rel=1e-4)
    assert found[1, 1] == pytest.approx((0.75 * math.pi - 2) * 0.1**3 / (MODULI[0] * second), rel=1e-4)


def test_loads_from_either_side_are_alike():
    beta, lever = np.array([0.3, 0.4]), np.array([1e-3, 2e-3])
    np.testing.assert_allclose(rim_compliance(RING, 6, beta, lever), rim_compliance(RING, 6, math.pi - beta, lever))
    assert (rim_compliance(RING, 6, beta, lever) > 0).all()


def test_more_bolts_and_thicker_rims_are_stiffer():
    pair = GearPair(GearSpec(23, "3 mm"), RING, backlash="0.1 mm")
    held = mesh_stiffness(pair, 20).mean
    means = [mesh_stiffness(pair, 20, rim_supports=n).mean for n in (3, 6, 12, 24)]
    assert means == sorted(means)
    assert means[-1] < held
    thick = pair.with_changes(driven=GearSpec.ring(70, "3 mm", rim_thickness="16 mm"))
    assert mesh_stiffness(thick, 20, rim_supports=6).mean > means[1]
    assert (tooth_compliance(RING).rim == 0).all()


def test_bad_input_is_one_line():
    with pytest.raises(ValueError, match="gear is external"):
        tooth_compliance(GearSpec(23, "3 mm"), rim_supports=6)
    with pytest.raises(ValueError, match="rim_supports is 1"):
        tooth_compliance(RING, rim_supports=1)
