"""Closed-form numbers of wheels and pairs."""

import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.gears import FlankFriction, GearPair, GearSpec, PairGeometry, involute
from tests.says import says

MM = 1e-3


def test_paper_table():
    # m = 95/31 mm: r_p = 29 m / 2, r_a = r_p + m, r_b = r_p cos 20 deg, r_f = r_p - 1.25 m, r_c = 0.38 m
    gear = GearPair.paper().driver
    m = 95 / 31
    for value, expected in (
        (gear.pitch_radius, 44.43548),
        (gear.base_radius, 41.75570),
        (gear.tip_radius, 47.5),
        (gear.root_radius, 40.60484),
        (gear.fillet_radius, 1.16452),
        (gear.base_pitch, 9.04685),
        (gear.tooth_thickness, 4.81373),
        (gear.tip_thickness, 2.2503),
    ):
        assert value / MM == pytest.approx(expected, abs=6e-6 if expected != 2.2503 else 6e-5)
    assert gear.tip_radius / MM == pytest.approx(15.5 * m, rel=1e-15)
    # the printed module misses the printed radii
    assert 0.5 * 29 * 3.065 - 44.435 > 5e-3


def test_root_arc_closes_the_profile():
    # an arc tangent to the root circle reaches its radial tangent within 3 um of the base circle
    gear = GearPair.paper().driver
    assert abs(gear.form_radius - gear.base_radius) < 3e-6
    assert gear.form_roll_length == 0


def test_mass_and_inertia_of_the_disc():
    # rho pi r_p^2 b and half that times r_p^2
    gear = GearPair.paper().driver
    assert gear.mass == pytest.approx(0.974, abs=5e-4)
    assert gear.inertia[2] == pytest.approx(9.6e-4, rel=2e-3)
    bored = GearSpec(29, "3 mm", bore_radius="10 mm")
    plain = GearSpec(29, "3 mm")
    assert bored.mass == pytest.approx(plain.mass * (1 - (10 / 43.5) ** 2), rel=1e-12)


@pytest.mark.parametrize(
    ("error", "alpha", "ratio", "j_wt", "j_bn", "path"),
    [
        (0.0, 20.000, 1.6459, 0.0, 0.0, 14.891),
        (1.0, 21.684, 1.3353, 0.7662, 0.7120, 12.080),
        (2.1645, 23.458, 1.0000, 1.7512, 1.6065, 9.047),
        (3.0, 24.632, 0.7733, 2.5165, 2.2875, 6.996),
    ],
)
def test_centre_distance(error, alpha, ratio, j_wt, j_bn, path):
    # cos alpha' = (r_b1 + r_b2) / a', j_wt = 2 a' (inv alpha' - inv alpha), j_bn = j_wt cos alpha'
    pair = GearPair.paper(centre_distance_error=error * MM)
    assert math.degrees(pair.working_pressure_angle) == pytest.approx(alpha, abs=1.5e-3)
    assert pair.contact_ratio == pytest.approx(ratio, abs=6e-5)
    assert pair.circumferential_backlash / MM == pytest.approx(j_wt, abs=6e-5)
    assert pair.normal_backlash / MM == pytest.approx(j_bn, abs=6e-5)
    assert pair.path_of_contact / MM == pytest.approx(path, abs=6e-4)
    if error == 0:
        assert pair.centre_distance / MM == pytest.approx(88.87097, abs=6e-6)
        assert pair.start_of_active_profile[0] / MM == pytest.approx(42.469, abs=6e-4)


def test_backlash_by_thinning_adds_up():
    pair = GearPair.paper(backlash="0.1 mm")
    assert pair.normal_backlash == pytest.approx(0.1 * MM, rel=1e-9)
    pair = GearPair.paper(backlash="0.1 mm", centre_distance_error="1 mm")
    assert pair.normal_backlash / MM == pytest.approx(0.8120, abs=6e-5)


@pytest.mark.parametrize("helix", [0.0, 0.2, math.radians(25.0)])
def test_backlash_between_flanks_is_that_of_tooth_thicknesses(helix):
    """At nominal centre distance j_bn = j_t cos(alpha_n) cos(beta), with j_t on the pitch circles."""
    one, two = (GearSpec(z, "2 mm", helix_angle=helix, hand=h) for z, h in ((25, "left"), (40, "right")))
    geometry = GearPair(one, two, backlash="0.4 mm").geometry
    expected = geometry.circumferential_backlash * math.cos(math.radians(20.0)) * math.cos(helix)
    assert geometry.flank_backlash == pytest.approx(expected, rel=1e-12)
    assert (geometry.flank_backlash < 0.3999 * MM) == (helix > 0.0)


def test_contact_ratio_of_62_62():
    # the potential-energy code of ROSS gives 1.78978 for m = 2 mm
    assert GearPair(GearSpec(62, "2 mm"), GearSpec(62, "2 mm")).contact_ratio == pytest.approx(1.78978, abs=6e-6)


def test_jam_backlash():
    gamma, alpha, b = math.radians(1), math.radians(20), 20 * MM
    assert GearPair.paper(misalignment="1 deg").jam_backlash == pytest.approx(b * gamma * math.cos(alpha))
    tilted = GearPair.paper(misalignment="1 deg", plane="inclination")
    assert tilted.jam_backlash == pytest.approx(b * gamma * math.sin(alpha))
    assert tilted.jams
    assert not tilted.with_changes(backlash="0.2 mm").jams


def test_placement():
    pair = GearPair.paper(misalignment="1 deg", pivot="5 mm", centre_distance_error="1 mm")
    place = pair.placement()
    assert place.origin_1 == pytest.approx(np.zeros(3))
    angle = math.acos(place.axes_1[:, 2] @ place.axes_2[:, 2])
    assert angle == pytest.approx(math.radians(1))
    # the pivot, 5 mm along the axis, is where it is without tilt
    assert place.origin_2 + 5 * MM * place.axes_2[:, 2] == pytest.approx([pair.centre_distance, 0, 5 * MM])


BAD_WHEELS = {
    says("gear.teeth", "4", "give", "5"): {"teeth": 4},
    says("gear.module", "-0.001 m", "positive"): {"module": -1e-3},
    says("gear.face_width", "0 mm", "positive"): {"face_width": 0.0},
    says("gear.pressure_angle", "1145.916 deg", "give 5"): {"pressure_angle": 20.0},
    "undercut": {"teeth": 10},
    "pointed": {"profile_shift": 1.0, "teeth": 12},
    says("gear.thinning", "-0.01 mm", "profile_shift"): {"thinning": -1e-5},
    says("gear.bore_radius", "60.0000 mm", "39.7500 mm"): {"bore_radius": "60 mm"},
    says("gear.fillet_radius", "2.5000 mm", "reduce"): {"fillet_radius": "2.5 mm"},
    says("gear.tip_rounding", "2.0000 mm", "2.2029 mm"): {"tip_rounding": "2 mm"},
    says("gear.addendum", "-1 mm", "positive"): {"addendum": "-1 mm"},
    says("gear.module", "NaN", "give"): {"module": float("nan")},
    says("gear.module", "'3 kg'", "'1 mm'"): {"module": "3 kg"},
}


@pytest.mark.parametrize("word", BAD_WHEELS)
def test_impossible_wheels_are_named(word):
    arguments = {"teeth": 29, "module": "3 mm"} | BAD_WHEELS[word]
    with pytest.raises(ValueError, match=word):
        GearSpec(**arguments)


def test_root_on_the_wrong_side():
    with pytest.raises(ValueError, match="root_radius is 45"):
        GearSpec.from_radii(29, "3 mm", tip_radius="46.5 mm", root_radius="45 mm")
    with pytest.raises(ValueError, match="tip_radius is 43"):
        GearSpec.from_radii(29, "3 mm", tip_radius="43 mm", root_radius="40 mm")
    with pytest.raises(ValueError, match="leave no involute"):
        GearSpec(120, "3 mm", dedendum="0.2 mm", fillet_radius="3 mm")


@pytest.mark.parametrize("helix", [0.0, math.radians(20)])
@pytest.mark.parametrize("pressure", ["20 deg", "25 deg"])
def test_default_wheels_of_any_size_mesh(pressure, helix):
    """Default root arcs leave the flanks what a rack with a tip radius of 0.38 modules does: room for any mate."""
    module = 2e-3
    wheels = [
        [GearSpec(z, module, pressure_angle=pressure, helix_angle=helix, hand=hand) for z in (29, 41, 62, 80, 120, 400)]
        for hand in ("right", "left" if helix else "right")
    ]
    alpha = wheels[0][0].pressure_angle
    straight = 1.25 * module - 0.38 * module * (1 - math.sin(alpha))
    for gear in wheels[0]:
        sine = math.sin(gear.transverse_pressure_angle)
        assert gear.form_roll_length <= max(0.0, gear.pitch_radius * sine - straight / sine) + 1e-12 or gear.teeth == 29
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for one in wheels[0]:
            for two in wheels[1]:
                # a light load: mates that are almost racks come to within a micrometre of the arcs
                GearPair(one, two, torque=1.0)
    # the arcs of small wheels begin lower anyway, and one that was given stays
    if pressure == "20 deg" and not helix:
        assert [w.fillet_radius / module for w in wheels[0][:2]] == pytest.approx([0.38, 0.38])
        assert GearSpec(120, module, fillet_radius=0.38 * module).fillet_radius == 0.38 * module
        assert GearPair(wheels[0][4], wheels[1][4]).contact_ratio == pytest.approx(1.8714, abs=5e-5)


BAD_PAIRS = {
    says("88.0710", "increase centre_distance_error"): {"centre_distance_error": "-0.8 mm"},
    says("95.8710", "reduce centre_distance_error"): {"centre_distance_error": "7 mm"},
    says("GearPair.backlash", "-0.1 mm", "give 0"): {"backlash": "-0.1 mm"},
    says("GearPair.misalignment", "57.296 deg", "'1 deg'"): {"misalignment": 1.0},
    says("GearPair.plane", "'sideways'", "choose 'skew'"): {"plane": "sideways"},
    says("GearPair.rotation", "2", "give 1"): {"rotation": 2},
    says("GearPair.rotation", "1.0", "give 1"): {"rotation": 1.0},
    says("GearPair.rotation", "True", "give 1"): {"rotation": True},
    says("GearPair.friction", "True", "FlankFriction"): {"friction": True},
    says("GearPair.friction", "0.05", "FlankFriction"): {"friction": 0.05},
    says("GearPair.contact", "3e8", "ContactLaw"): {"contact": "3e8 N/m"},
    says("GearPair.slices", "0", "give"): {"slices": 0},
    says("GearPair.load", "'magic'", "choose 'slices'"): {"load": "magic"},
    says("GearPair.axial_shift", "25.0000", "less than 20"): {"axial_shift": "25 mm"},
    says("axial_shift", "-20.0000 mm"): {"axial_shift": "-20 mm"},
    says("GearPair.torque", "'100 N'", "'1 N*m'"): {"torque": "100 N"},
    says("8.856394 mm", "module and pressure_angle"): {"driven": GearSpec(29, "3 mm")},
    says("-0.6040", "interference", "addendum"): {
        "driver": GearSpec(15, 95e-3 / 31),
        "driven": GearSpec(120, 95e-3 / 31),
    },
}


@pytest.mark.parametrize("words", BAD_PAIRS)
def test_impossible_pairs_are_named(words):
    with pytest.raises(ValueError, match=words):
        GearPair.paper(**BAD_PAIRS[words])


def test_senses_of_rotation_and_frictions_are_taken():
    assert GearPair.paper(rotation=np.int64(-1)).operating_point.rotation == -1
    assert GearPair.paper(friction=FlankFriction.none()).friction == FlankFriction.none()


@settings(max_examples=60, derandomize=True, deadline=None)
@given(b1=st.integers(5, 60), b2=st.integers(5, 60), shift=st.floats(-80, 80))
@pytest.mark.slow
def test_common_face_width_is_the_overlap_of_both_faces(b1, b2, shift):
    """In mm, counted by the ends of both faces, whichever is the wider and the driver."""
    one, two = (GearSpec(29, "3 mm", face_width=b * 1e-3) for b in (b1, b2))
    overlap = min(b1, b2, 0.5 * (b1 + b2) - abs(shift))
    if overlap <= 1e-3:
        with pytest.raises(ValueError, match=says("axial_shift", "overlap", "give less")):
            PairGeometry(one, two, axial_shift=shift * 1e-3)
        return
    pair = PairGeometry(one, two, axial_shift=shift * 1e-3)
    assert pair.common_face_width == pytest.approx(overlap * 1e-3, rel=1e-9)
    assert pair.face_share == pytest.approx(overlap / min(b1, b2), rel=1e-9)
    assert pair.narrower_face_width == min(b1, b2) * 1e-3


@settings(max_examples=60, derandomize=True, deadline=None)
@given(
    z1=st.integers(18, 80),
    z2=st.integers(18, 80),
    module=st.floats(1e-3, 8e-3),
    error=st.floats(0, 0.4),
    thinning=st.floats(0, 0.05),
)
def test_pairs_of_any_size(z1, z2, module, error, thinning):
    one, two = GearSpec(z1, module, thinning=thinning * module), GearSpec(z2, module)
    pair = GearPair(one, two, centre_distance_error=error * module)
    alpha = pair.working_pressure_angle
    play = 2 * pair.centre_distance * (involute(alpha) - involute(math.radians(20))) * math.cos(alpha)
    # thinning acts along the line of action through the base circle: j = s cos(alpha)
    expected = play + thinning * module * math.cos(math.radians(20))
    assert pair.normal_backlash == pytest.approx(expected, abs=1e-12)
    assert one.half_angle(one.tip_radius) > 0
    assert pair.path_of_contact < pair.line_of_action


def test_pair_shows_itself():
    pair = GearPair.paper(misalignment="1 deg", backlash="0.1 mm")
    assert repr(pair) == (
        "GearPair(29/29 teeth, module 3.065 mm, centre distance 88.8710 mm, backlash 0.1 mm, 100 N m on the driven "
        "wheel, skew 1 deg, impact, 2.9852e+05 N/mm^1.3 a tooth pair, damping 298.5 N s/mm, fully on at 100 um)"
    )
    assert "<td>contact ratio</td><td>1.6" in pair._repr_html_()


@pytest.mark.parametrize("teeth", [24, 80, 150])
def test_what_is_kept_of_a_wheel_is_that_of_its_final_root_arc(teeth):
    """Default arcs are fitted step by step; what follows from them is that of a wheel given the last one."""
    fitted = GearSpec(teeth, "2 mm")
    given = GearSpec(teeth, "2 mm", fillet_radius=fitted.fillet_radius)
    for name in ("fillet_centre_radius", "form_radius", "form_roll_length", "fillet_half_angle"):
        assert getattr(fitted, name) == getattr(given, name)


def test_geometry_is_kept_and_not_handed_on_to_copies():
    pair = GearPair.paper()
    assert pair.centre_distance is pair.centre_distance
    wider = pair.with_changes(centre_distance_error="1 mm")
    assert wider.centre_distance == pytest.approx(pair.centre_distance + 1e-3, abs=1e-15)
    assert wider.contact_ratio < pair.contact_ratio


def test_teeth_counted_by_numpy_are_teeth():
    assert [GearSpec(np.int64(n), "3 mm").teeth for n in (20, -70)] == [20, 70]
    assert GearSpec(np.int64(-70), "3 mm").internal
