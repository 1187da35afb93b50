"""Stresses of flank and root against the standard's worked example, the cut root curve and closed limits."""

import math

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec, Material, PairGeometry
from gearmbs.gears.iso6336 import iso_mesh_stiffness, iso_stresses, root_section
from gearmbs.gears.stiffness import rack_root
from tests.says import says

STEEL = Material(youngs_modulus=206e9, poisson_ratio=0.3)


def example():
    """ISO/TR 6336-30, example 1, with its tip diameters of 159.66 and 872.35 mm."""
    wheels = []
    for z, x, hand, tip in ((17, 0.145, "right", 159.66e-3), (103, 0.0, "left", 872.35e-3)):
        sizes = {"profile_shift": x, "hand": hand, "face_width": 0.1, "helix_angle": "15.8 deg", "material": STEEL}
        plain = GearSpec(z, "8 mm", **sizes)
        addendum, dedendum = 0.5 * tip - plain.pitch_radius, (1.4 - x) * 8e-3
        wheels.append(GearSpec(z, "8 mm", addendum=addendum, dedendum=dedendum, **sizes))
    error = 0.5 - PairGeometry(*wheels).nominal_centre_distance
    return GearPair(*wheels, centre_distance_error=error)


def test_contact_stress_of_the_example():
    pair = example()
    stresses = iso_stresses(pair, 9000 * 103 / 17)
    assert stresses.tangential_force == pytest.approx(127352, rel=1e-5)
    assert stresses.zone == pytest.approx(2.39533, abs=5e-6)
    assert stresses.elasticity == pytest.approx(189811.7, abs=0.1)
    assert stresses.overlap == pytest.approx(0.803, abs=5e-4)
    assert stresses.helix == pytest.approx(1.01944, abs=5e-6)
    assert stresses.single_pair == (1.0, 1.0)
    assert stresses.helix_root == pytest.approx(1 - 15.8 / 120)
    assert stresses.nominal_contact == pytest.approx(1206.58207e6, rel=1e-7)
    assert iso_mesh_stiffness(pair) == pytest.approx(17.4648e9, rel=5e-6)
    assert 0.85 * iso_mesh_stiffness(pair) == pytest.approx(14.8451e9, rel=5e-6)
    assert stresses.contact(1.2)[0] == pytest.approx(math.sqrt(1.2) * stresses.nominal_contact)


def test_faces_in_mesh_in_part_are_stressed_as_narrow_ones():
    def made(width, shift=0.0):
        return GearPair(GearSpec(20, "3 mm", face_width=width), GearSpec(60, "3 mm"), axial_shift=shift)

    for shift, width in (("10 mm", "10 mm"), ("-15 mm", "5 mm")):
        shifted, narrow = (iso_stresses(pair, 300.0) for pair in (made("20 mm", shift), made(width)))
        assert shifted.contact() == pytest.approx(narrow.contact())
        assert shifted.root() == pytest.approx(narrow.root())
    # a wider pinion that still covers its mate
    assert iso_stresses(made("30 mm", "4 mm"), 300.0).contact() == pytest.approx(
        iso_stresses(made("30 mm"), 300.0).contact()
    )


@pytest.mark.parametrize(("teeth", "shift", "radius"), [(17, 0.145, 0.25), (25, 0.0, 0.38), (60, 0.2, 0.3)])
def test_root_section_lies_where_the_cut_root_has_its_30_degree_tangent(teeth, shift, radius):
    gear = GearSpec(teeth, "4 mm", profile_shift=shift, fillet_radius=radius * 4e-3)
    pair = PairGeometry(gear, GearSpec(40, "4 mm"))
    half, height = rack_root(gear, 100_001)
    lean = np.arctan2(-np.diff(half), np.diff(height))
    at = int(np.argmin(abs(lean - math.radians(30))))
    section = root_section(gear, pair)
    assert section.chord == pytest.approx(2 * half[at] / gear.module, abs=2e-5)
    curve = np.hypot(np.gradient(half), np.gradient(height))[at] / abs(np.gradient(np.unwrap(lean))[at])
    assert section.radius == pytest.approx(curve / gear.module, rel=1e-3)
    # the load's line crosses the middle of the tooth where its tangent to the base circle does
    crossing = gear.base_radius / math.cos(section.angle)
    assert section.arm == pytest.approx((crossing - height[at]) / gear.module, abs=2e-5)


def test_root_of_a_large_ring_is_that_of_a_rack():
    gear = GearSpec.ring(200_000, "2 mm", fillet_radius="0.5 mm", dedendum="2.5 mm")
    section = root_section(gear, PairGeometry(GearSpec(30, "2 mm"), gear))
    alpha, depth, radius = math.radians(20), 1.25, 0.25
    # centre of the arc from the middle of a rack's tooth, and where its tangent leans by 60 degrees
    centre = math.pi / 4 + (depth - radius) * math.tan(alpha) + radius / math.cos(alpha)
    assert section.chord == pytest.approx(2 * (centre - radius * math.cos(math.radians(60))), abs=1e-4)
    assert section.radius == pytest.approx(radius, abs=1e-4)


@pytest.mark.parametrize("helix", [0.0, 0.3])
@pytest.mark.parametrize("internal", [False, True])
def test_stresses_of_every_kind_of_wheels(helix, internal):
    one = GearSpec(23, "3 mm", helix_angle=helix)
    two = GearSpec(70, "3 mm", helix_angle=helix, internal=internal, hand="right" if internal else "left")
    pair = GearPair(one, two, backlash="0.2 mm")
    stresses = iso_stresses(pair, 300.0)
    assert all(50e6 < value < 1e9 for value in (*stresses.root(), *stresses.contact()))
    # roots grow with the load, pressures with its root
    twice = iso_stresses(pair, 600.0)
    assert twice.root()[1] == pytest.approx(2 * stresses.root()[1])
    assert twice.contact()[0] == pytest.approx(math.sqrt(2) * stresses.contact()[0])
    if internal:
        outside = iso_stresses(pair.with_changes(driven=GearSpec(70, "3 mm", helix_angle=helix, hand="left")), 300.0)
        # hollow flanks press less
        assert stresses.nominal_contact < outside.nominal_contact


def test_thin_rims():
    ring = GearSpec.ring(70, "3 mm", rim_thickness="8 mm")
    pair = GearPair(GearSpec(23, "3 mm"), ring, backlash="0.1 mm")
    assert iso_stresses(pair).rim[1] == pytest.approx(1.15 * math.log(8.324 * 3 / 8))
    thin = pair.with_changes(driven=GearSpec.ring(70, "3 mm", rim_thickness="5 mm"))
    with pytest.raises(ValueError, match=says("rim_thickness", "ISO 6336-3")):
        iso_stresses(thin)
    with pytest.raises(ValueError, match=says("torque", "-1.0", "give a positive")):
        iso_stresses(pair, -1.0)
