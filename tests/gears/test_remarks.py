"""What is no mistake and rarely meant is remarked on: negative backlash, tips close to roots and to each other."""

import math
import re
import warnings

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec, PairGeometry, kinematic_transmission_error, loaded_transmission_error
from gearmbs.gears.tables import fillet_clearance
from tests.says import says

RING = {"driver": GearSpec(23, "3 mm"), "driven": GearSpec.ring(70, "3 mm")}


def quiet(make):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return make()


@pytest.mark.parametrize(
    ("wheels", "sign"), [({"driver": GearSpec(29, "3 mm"), "driven": GearSpec(31, "3 mm")}, -1), (RING, 1)]
)
@pytest.mark.parametrize("kind", [GearPair, PairGeometry])
def test_negative_backlash_is_remarked_on_with_its_value(kind, wheels, sign):
    quiet(lambda: kind(**wheels))
    with pytest.warns(UserWarning, match=r"negative backlash: .* -0\.\d+ mm") as said:
        tight = kind(**wheels, centre_distance_error=sign * 0.25e-3)
    # by the line that makes the pair, once
    assert [w.filename for w in said] == [__file__]
    text = str(said[0].message)
    assert float(re.search(r"backlash is (\S+) mm", text).group(1)) == pytest.approx(
        1e3 * tight.normal_backlash, rel=1e-3
    )
    enough = float(re.search(r"give backlash (\S+) mm or more", text).group(1)) * 1e-3 + 1e-7
    assert quiet(lambda: kind(**wheels, centre_distance_error=sign * 0.25e-3, backlash=enough)).normal_backlash >= 0
    farther = float(re.search(r"centre_distance_error by (\S+) mm", text).group(1)) * 1e-3
    # to first order
    error = sign * (0.25e-3 - 1.02 * farther)
    assert quiet(lambda: kind(**wheels, centre_distance_error=error)).normal_backlash >= 0


def test_tips_that_foul_roots_under_the_load_are_remarked_on():
    arcs = {"driver": "0.5 mm", "driven": "0.76 mm"}
    wheels = {name: GearSpec(62, "2 mm", fillet_radius=arc) for name, arc in arcs.items()}
    plain = GearPair(**wheels, torque=1.0)
    # the driven wheel's root arc, as large as small wheels have it, is within reach of the driver's tips
    assert 5e-6 < fillet_clearance(plain, 0) < 15e-6 < fillet_clearance(plain, 1)
    yielding = plain.penetration(100.0, 2)
    fouls = -fillet_clearance(plain, 0, yielding)
    assert 0 < fouls < yielding
    quiet(lambda: GearPair(**wheels, torque=20.0))
    expected = says("driver (gear)", "driven wheel (gear)", f"{1e3 * fouls:.3g} mm")
    with pytest.warns(UserWarning, match=expected) as said:
        GearPair(**wheels, torque=100.0)
    assert [w.filename for w in said] == [__file__]
    quiet(lambda: GearPair(**wheels, torque=100.0, root_contact=True))
    # default arcs are not
    quiet(lambda: GearPair(GearSpec(62, "2 mm"), GearSpec(62, "2 mm"), torque=100.0))


def test_tips_that_meet_tips_under_the_load_are_remarked_on():
    wheels = {"driver": GearSpec(60, "2 mm"), "driven": GearSpec.ring(70, "2 mm", addendum="1.6 mm")}
    quiet(lambda: GearPair(**wheels))
    with pytest.warns(UserWarning, match=says("8000 N", "m", "pass each other")):
        GearPair(**wheels, torque=8000.0)


@pytest.mark.parametrize("pair", [GearPair.paper(), GearPair(GearSpec(17, "2 mm"), GearSpec(38, "2 mm"))])
def test_fillet_clearance_is_that_of_the_outlines(pair):
    # points of the arc against the driver's corner, with wheels turned by hand; the flanks that meet face
    # counter-clockwise on both
    one, two = pair.wheels
    around = np.linspace(0.0, 0.5 * math.pi, 2000)  # from the radial end of the flank on to the root circle
    end = two.fillet_half_angle - math.asin(two.fillet_radius / two.fillet_centre_radius)
    centre = two.fillet_centre_radius * np.exp(1j * two.fillet_half_angle)
    arc = centre + two.fillet_radius * np.exp(1j * (end - 0.5 * math.pi - around))
    start, found = pair.driven_angle(0.0), math.inf
    for angle in np.linspace(-0.15, 0.15, 1201):
        corner = one.corner_radius * np.exp(1j * (angle + one.corner_half_angle))
        driven = start - angle / pair.ratio
        # the tooth whose arc is next to the corner
        tooth = np.round(
            (np.angle(corner - pair.centre_distance) - driven - end) % (2 * math.pi) * two.teeth / (2 * math.pi)
        )
        local = (corner - pair.centre_distance) * np.exp(-1j * (driven + 2 * math.pi * tooth / two.teeth))
        distance = abs(arc - local)
        nearest = int(distance.argmin())
        if 0 < nearest < around.size - 1:
            found = min(found, float(distance[nearest]))
    assert fillet_clearance(pair, 0) == pytest.approx(found, abs=3e-6)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"misalignment": "0.5 deg", "backlash": "0.5 mm"}, "the misalignment of 0.5 deg"),
        ({"driver": GearSpec(23, "3 mm", helix_angle="10 deg", hand="right"),
          "driven": GearSpec(41, "3 mm", helix_angle="10 deg", hand="left")}, "the helix"),
    ],
)  # fmt: skip
def test_one_section_of_flanks_that_vary_along_the_face_is_remarked_on(changes, told):
    given = {"driver": GearSpec(23, "3 mm"), "driven": GearSpec(41, "3 mm"), "torque": 1.0, **changes}
    with pytest.warns(UserWarning, match=rf"GearPair.slices is 1: .*{told}"):
        GearPair(**given, slices=1)
    quiet(lambda: GearPair(**given, slices=2))
    quiet(lambda: GearPair(**given))


@pytest.mark.parametrize("analysis", [loaded_transmission_error, kinematic_transmission_error])
def test_an_analysis_in_one_section_of_flanks_that_vary_is_remarked_on(analysis):
    wheels = GearSpec(23, "3 mm"), GearSpec(41, "3 mm")
    tilted = GearPair(*wheels, misalignment="0.2 deg", backlash="0.5 mm")
    with pytest.warns(UserWarning, match=says("1", "misalignment", "0.2 deg", "leave slices")) as said:
        analysis(tilted, points=2, slices=1)
    assert [w.filename for w in said] == [__file__]
    quiet(lambda: analysis(tilted, points=2, slices=5))
    quiet(lambda: analysis(GearPair(*wheels), points=2, slices=1))
    with pytest.raises(ValueError, match=says("slices", "0", "1", "give an integer")):
        analysis(tilted, points=2, slices=0)


def test_one_section_of_parallel_wheels_is_not_remarked_on():
    quiet(lambda: GearPair(GearSpec(23, "3 mm"), GearSpec(41, "3 mm"), torque=1.0, slices=1))


@pytest.mark.parametrize("name", ["face_width", "rim_thickness"])
def test_lengths_in_a_wrong_unit(name):
    def made(value):
        wheel = {"internal": True} if name == "rim_thickness" else {}
        return GearSpec(40, "3 mm", **{name: value}, **wheel)

    with pytest.raises(ValueError, match=rf"gear.{name} is 20 m, .* write '20 mm'"):
        made(20)
    with pytest.warns(UserWarning, match=says(f"gear.{name}", "1000 mm", "3 mm")):
        made(1.0)
    quiet(lambda: made("200 mm"))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"profile_shift": "0.5 mm"}, r"profile_shift is '0.5 mm'; give the coefficient"),
        ({"profile_shift": None}, r"profile_shift is None"),
        ({"material": "plastic"}, r"material is 'plastic'; give a Material"),
        ({"module": None}, r"module is None; give a length"),
    ],
)
def test_other_kinds_of_values_are_refused_by_name(changes, told):
    with pytest.raises(ValueError, match=rf"gear.{told}"):
        GearSpec(**{"teeth": 20, "module": "3 mm", **changes})
    GearSpec(20, "3 mm", profile_shift=np.float64(0.5))


def test_a_negative_torque_is_refused_by_name():
    with pytest.raises(ValueError, match=says("GearPair.torque", "-100 N m", "give its size")):
        GearPair(GearSpec(23, "3 mm"), GearSpec(41, "3 mm"), torque=-100.0)
    GearPair(GearSpec(23, "3 mm"), GearSpec(41, "3 mm"), torque=100.0, rotation=-1)
