"""Geometry of internal and helical pairs against published sets and closed formulas."""

import math

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec, PairGeometry
from gearmbs.gears.iso6336 import iso_mesh_stiffness, iso_single_stiffness, iso_theoretical_stiffness
from tests.says import says


def at_distance(one, two, distance):
    error = distance - PairGeometry(one, two).nominal_centre_distance
    return PairGeometry(one, two, centre_distance_error=error)


def wheel(teeth, module, tip_diameter, shift, helix=0.0, hand="right", width=0.1, sign=1):
    """A wheel in mm and degrees; its root follows from the tip."""
    pitch = teeth * module / math.cos(math.radians(helix))
    root = pitch - sign * (2.5 - 2 * shift) * module
    return GearSpec.from_radii(
        sign * teeth,
        module * 1e-3,
        0.5e-3 * tip_diameter,
        0.5e-3 * root,
        profile_shift=shift,
        helix_angle=math.radians(helix),
        hand=hand,
        face_width=width,
        name="ring" if sign < 0 else f"z{teeth}",
    )


SUN, PLANET = wheel(19, 45, 978.839, 0.617), wheel(17, 45, 905.440, 0.802)
RING = wheel(56, 45, 2475.087, -0.501, sign=-1)
FAST = wheel(24, 14, 380.751, 0.480, 10, "left", 0.36), wheel(95, 14, 1395.372, 0.669, 10, "right", 0.36)


@pytest.mark.parametrize(
    ("one", "two", "distance", "angle", "transverse", "overlap", "shifts"),
    [
        (SUN, PLANET, 0.863, 28.1175, 1.1148, 0.0, 1.41913),
        (PLANET, RING, 0.863, 17.1607, 1.2785, 0.0, 0.30083),
        (*FAST, 0.861, 22.8560, 1.4627, 1.4213, 1.14909),
        (
            wheel(16, 4.5, 82.635, 0.1817, width=0.014), wheel(24, 4.5, 118.544, 0.1715, width=0.014),
            0.0915001, 22.4389, 1.4624, 0.0, 0.3532,
        ),
        (
            wheel(20, 3.5, 80.672, 0.1809, 15, "left", 0.023), wheel(30, 3.5, 116.264, 0.0891, 15, "right", 0.023),
            0.0915003, 22.115, 1.46, 0.541, 0.27,
        ),
    ],
)  # fmt: skip
def test_published_pairs(one, two, distance, angle, transverse, overlap, shifts):
    pair = at_distance(one, two, distance)
    assert math.degrees(pair.working_pressure_angle) == pytest.approx(angle, abs=6e-4)
    assert pair.contact_ratio == pytest.approx(transverse, abs=2e-4)
    assert pair.overlap_ratio == pytest.approx(overlap, abs=5e-4)
    assert pair.total_contact_ratio == pair.contact_ratio + pair.overlap_ratio
    assert pair.shift_sum == pytest.approx(shifts, abs=2e-5)


def test_fouling_of_a_large_ring():
    needed, free = at_distance(PLANET, RING, 0.863).fouling_angles
    assert (free, needed) == pytest.approx((0.25355, 0.24671), abs=1e-5)


def helical_example():
    one = GearSpec(
        17, "8 mm", profile_shift=0.145, face_width=0.1, helix_angle="15.8 deg", dedendum=(1.4 - 0.145) * 8e-3
    )
    two = GearSpec(103, "8 mm", hand="left", face_width=0.1, helix_angle="15.8 deg", dedendum=1.4 * 8e-3)
    return at_distance(one, two, 0.5)


def test_helical_example_of_the_standard():
    pair = helical_example()
    one, two = pair.driver, pair.driven
    assert math.degrees(one.transverse_pressure_angle) == pytest.approx(20.7197, abs=1e-4)
    assert math.degrees(one.base_helix_angle) == pytest.approx(14.8245, abs=1e-4)
    assert math.degrees(pair.working_pressure_angle) == pytest.approx(21.0661, abs=1e-4)
    assert (one.virtual_teeth, two.virtual_teeth) == pytest.approx((18.9051, 114.5428), abs=1e-4)
    assert (pair.contact_ratio, pair.overlap_ratio) == pytest.approx((1.54934, 1.08337), abs=1e-5)
    unit = 1e9  # N/(mm um) in N/m^2
    assert iso_theoretical_stiffness(pair) / unit == pytest.approx(17.855840, abs=2e-6)
    steel = 2.07 / 2.06
    assert iso_single_stiffness(pair) / unit / steel == pytest.approx(12.370472, abs=2e-6)
    assert iso_mesh_stiffness(pair) == iso_single_stiffness(pair) * (0.75 * pair.contact_ratio + 0.25)
    assert iso_single_stiffness(pair, web=(0.03, 0.024)) < iso_single_stiffness(pair)
    assert iso_single_stiffness(pair, web=("30 mm", "24 mm")) == iso_single_stiffness(pair, web=(0.03, 0.024))
    with pytest.raises(ValueError, match=says("web", "30000", "24000 mm", "'30 mm'")):
        iso_single_stiffness(pair, web=(30, 24))
    width = 0.1 / math.cos(one.base_helix_angle)
    lines = np.array([pair.contact_line_length(phase) for phase in np.linspace(0, 1, 4000, endpoint=False)]) / width
    assert (lines.mean(), lines.min(), lines.max()) == pytest.approx((1.5493, 1.5071, 1.5840), abs=1e-4)


@pytest.mark.parametrize(("teeth", "ratio"), [((20, -70), 1.9136), ((36, -100), 1.9277), ((28, 36), 1.6652)])
def test_contact_ratio_of_standard_pairs(teeth, ratio):
    one, two = (GearSpec(z, "2 mm") for z in teeth)
    assert PairGeometry(one, two).contact_ratio == pytest.approx(ratio, abs=5e-5)
    assert two.internal == (teeth[1] < 0)


def test_contact_line_of_a_spur_pair_jumps_between_one_and_two():
    pair = PairGeometry(GearSpec(28, "2 mm"), GearSpec(36, "2 mm"))
    lines = np.array([pair.contact_line_length(phase) for phase in np.linspace(0, 1, 2000, endpoint=False)])
    assert set(np.round(lines / pair.driver.face_width, 9)) == {1.0, 2.0}
    assert lines.mean() / pair.driver.face_width == pytest.approx(pair.contact_ratio, abs=1e-3)


def test_contact_line_is_constant_at_whole_overlap():
    helix = math.radians(20)
    width = math.pi * 2e-3 / math.sin(helix)
    one, two = (
        GearSpec(z, "2 mm", helix_angle=helix, hand=h, face_width=width) for z, h in ((25, "left"), (40, "right"))
    )
    pair = PairGeometry(one, two)
    assert pair.overlap_ratio == pytest.approx(1, abs=1e-12)
    lines = np.array([pair.contact_line_length(phase) for phase in np.linspace(0, 1, 99)])
    assert np.ptp(lines) < 1e-12 * lines.mean()


def test_backlash_of_a_ring_grows_towards_its_middle():
    one, two = GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm")
    shifted = [GearPair(one, two, backlash="0.1 mm", centre_distance_error=e) for e in (-1e-5, 1e-5)]
    slope = (shifted[1].normal_backlash - shifted[0].normal_backlash) / 2e-5
    assert slope == pytest.approx(-2 * math.sin(PairGeometry(one, two).working_pressure_angle), rel=1e-5)


def test_conventions_of_the_profile_shift():
    plain = GearSpec.ring(56, "45 mm", profile_shift=-0.501)
    assert GearSpec.ring(56, "45 mm", outward_shift=0.501) == plain
    assert GearSpec(-56, "45 mm", profile_shift=-0.501, name="ring") == plain
    assert plain.outward_shift == 0.501
    assert 2 * plain.tip_radius == pytest.approx(45e-3 * (56 - 2 + 2 * 0.501))


def test_mass_of_a_rim():
    ring = GearSpec.ring(70, "3 mm", rim_thickness="12 mm", face_width="20 mm")
    area = math.pi * (ring.outer_radius**2 - ring.pitch_radius**2)
    assert ring.outer_radius == pytest.approx(ring.root_radius + 0.012)
    assert ring.mass == pytest.approx(7850 * area * 0.02)


HELIX = {"helix_angle": "10 deg"}


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: PairGeometry(GearSpec(28, "2 mm", **HELIX), GearSpec(36, "2 mm", **HELIX)), "opposite hands"),
        (lambda: PairGeometry(GearSpec(28, "2 mm", **HELIX), GearSpec(-90, "2 mm", hand="left", **HELIX)), "same hand"),
        (lambda: PairGeometry(GearSpec(28, "2 mm", **HELIX), GearSpec(36, "2 mm")), "helix angles differ"),
        (lambda: PairGeometry(GearSpec(-90, "2 mm"), GearSpec(28, "2 mm")), says("make the internal")),
        (lambda: PairGeometry(GearSpec(60, "2 mm"), GearSpec(-45, "2 mm")), "no larger than"),
        (lambda: PairGeometry(GearSpec(38, "2 mm"), GearSpec(-44, "2 mm")), "interference|foul"),
        (lambda: GearSpec(-30, "2 mm"), says("inside the base")),
        (lambda: GearSpec(-60, "2 mm", bore_radius="5 mm"), says("gear.bore_radius", "5.0000 mm", "internal")),
        (lambda: GearSpec(60, "2 mm", rim_thickness="5 mm"), says("rim_thickness", "internal")),
        (lambda: GearSpec(60, "2 mm", helix_angle="50 deg"), "helix_angle is 50"),
        (lambda: GearSpec(60, "2 mm", hand="up"), "hand is 'up'"),
        (
            lambda: GearSpec.ring(60, "2 mm", profile_shift=0.1, outward_shift=0.1),
            says("ring", "profile_shift", "outward_shift", "give one"),
        ),
    ],
)
def test_bad_wheels_are_one_line(build, words):
    with pytest.raises(ValueError, match=words) as caught:
        build()
    assert "\n" not in str(caught.value)


def test_radial_assembly_needs_a_difference_of_teeth():
    assert PairGeometry(GearSpec(20, "2 mm"), GearSpec(-70, "2 mm")).radial_assembly
    near = PairGeometry(GearSpec(40, "2 mm"), GearSpec(-52, "2 mm", addendum="1.4 mm"))
    assert not near.radial_assembly


def test_tables_print_both_conventions_of_the_shift():
    pair = GearPair(
        GearSpec(23, "3 mm", profile_shift=0.1, helix_angle="15 deg"),
        GearSpec.ring(70, "3 mm", outward_shift=0.1, helix_angle="15 deg"),
        backlash="0.1 mm",
    )
    page = pair._repr_html_()
    for words in ("ISO 21771", "outwards", "+0.1000", "-0.1000", "helix angle", "overlap ratio", "right"):
        assert words in page
