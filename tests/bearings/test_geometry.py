"""Kinematic multiples, Hertz constants, ratings, life and the catalogue against published numbers."""

from __future__ import annotations

import math
import re
import warnings

import numpy as np
import pytest

from gearmbs.bearings import Bearing, BearingError, equivalent_load, groove_contact, mean_load, rating_life
from gearmbs.bearings.designations.catalogue import ELEMENTS
from gearmbs.bearings.laws_kernel import line_contact
from gearmbs.bearings.rating import dynamic_rating, load_factors
from tests.says import says

MULTIPLES = {
    "CWRU drive end": (0.3983, 3.5848, 5.4152, 2.3567),
    "CWRU fan end": (0.3816, 3.0531, 4.9469, 1.9938),
    "MFPT": (0.4056, 3.2450, 4.7550, 2.5546),
    "ER-10K": (0.3815, 3.0523, 4.9477, 1.9919),
    "ER16K": (0.3969, 3.5724, 5.4276, 2.3225),
    "ZA-2115": (0.4433, 7.0921, 8.9079, 4.1975),
    "UER204": (0.3854, 3.0831, 4.9169, 2.0666),
    "6204": (0.3815, 3.0522, 4.9478, 1.9916),
    "6206": (0.3965, 3.5682, 5.4318, 2.3112),
    "6010": (0.4328, 6.0598, 7.9402, 3.6556),
}


@pytest.mark.parametrize("name", MULTIPLES)
def test_multiples(name):
    bearing = Bearing.from_designation(name)
    ftf, bpfo, bpfi, bsf = MULTIPLES[name]
    assert (bearing.ftf, bearing.bpfo, bearing.bpfi, bearing.bsf) == pytest.approx((ftf, bpfo, bpfi, bsf), abs=6e-5)
    assert bearing.bpfo + bearing.bpfi == pytest.approx(bearing.elements)
    assert bearing.bpfo == pytest.approx(bearing.elements * bearing.ftf)


@pytest.mark.parametrize(
    ("name", "inner", "outer", "series"),
    [
        ("6204", 2.802e10, 2.511e10, 9.369e9),
        ("6205", 2.818e10, 2.501e10, 9.375e9),
        ("6206", 3.085e10, 2.741e10, 1.027e10),
    ],
)
def test_hertz_constants(name, inner, outer, series):
    bearing = Bearing.from_designation(name)
    assert (*bearing.contact_stiffness, bearing.stiffness) == pytest.approx((inner, outer, series), rel=1e-3)


def test_ball_on_ball_of_equal_curvatures_is_the_sphere():
    """A groove as flat as a plane: Hertz's closed form of a sphere on a plane, K = 4/3 E* sqrt(R)."""
    contact = groove_contact(0.01, 1e4, 0.0, 2.07e11, 0.3)
    modulus = 2.07e11 / 2.0 / (1.0 - 0.09)
    assert contact.stiffness == pytest.approx(4.0 / 3.0 * modulus * np.sqrt(0.005), rel=3e-5)
    assert contact.curvature_sum == pytest.approx((4.0 - 1e-4) / 0.01)
    assert contact.curvature_difference == pytest.approx(1e-4 / (4.0 - 1e-4))
    assert contact.ellipticity == pytest.approx(1.0, abs=1e-3)
    radius = (3.0 * 0.005 / (4.0 * modulus)) ** (1.0 / 3.0)
    assert contact.semi_axes == pytest.approx((radius, radius), rel=1e-3)
    assert contact.pressure(contact.force_at(2e9)) == pytest.approx(2e9)


def test_palmgrens_line():
    """delta = 3.84e-5 Q^0.9/L^0.8, mm and N."""
    force, length = 1234.0, 12.0
    delta = 3.84e-5 * force**0.9 / length**0.8
    assert line_contact(1e-3 * length) * (1e-3 * delta) ** (10.0 / 9.0) == pytest.approx(force)


@pytest.mark.parametrize("name", ["6205", "NU206"])
def test_stiffness_of_any_elements_goes_with_their_modulus(name):
    known = {} if name == "6205" else {"elements": 13, "dynamic_rating": "44 kN"}
    steel = Bearing.from_designation(name, **known)
    ceramic = steel.changed(youngs_modulus="310 GPa", poisson_ratio=0.26)
    share = 310 / (1 - 0.26**2) / (207 / (1 - 0.3**2))
    assert ceramic.stiffness == pytest.approx(share * steel.stiffness)
    assert (ceramic.rating, ceramic.rating_at_rest) == (steel.rating, steel.rating_at_rest)


@pytest.mark.parametrize(
    ("name", "dynamic", "static"),
    [
        ("6204", 12.7e3, 6.55e3), ("6205", 14.0e3, 7.8e3), ("6206", 19.5e3, 11.2e3), ("6207", 25.5e3, 15.3e3),
        ("6208", 29.1e3, 17.9e3), ("6308", 40.5e3, 24.0e3), ("6309", 53.0e3, 31.5e3), ("6310", 61.8e3, 38.0e3),
    ],
)  # fmt: skip
def test_ratings_are_those_in_catalogues(name, dynamic, static):
    bearing = Bearing.from_designation(name)
    assert bearing.rating == pytest.approx(dynamic, rel=0.02)
    assert bearing.rating_at_rest == pytest.approx(static, rel=0.02)


def test_life():
    bearing = Bearing.from_designation("6205", dynamic_rating=14e3)
    assert rating_life(bearing, "1.4 kN") == rating_life(bearing, 1400.0)
    assert equivalent_load(bearing, "1 kN", "800 N") == equivalent_load(bearing, 1000.0, 800.0)
    with pytest.raises(BearingError, match=says("load", "'1 mm'", "N")):
        rating_life(bearing, "1 mm")
    with pytest.raises(BearingError, match=says("reliability", "'95 %'", "give")):
        rating_life(bearing, 1400.0, reliability="95 %")
    # a second row and the best steel are no slip of a unit
    assert bearing.changed(dynamic_rating="40 kN", static_rating="20 kN").rating == 40e3
    assert rating_life(bearing, 1400.0) == pytest.approx(1e9)
    assert rating_life(bearing, 1400.0, reliability=0.99) == pytest.approx(0.25e9)
    assert equivalent_load(bearing, 1000.0) == 1000.0
    # f_0 F_a/C_0 = 1000/(9 7.94^2) = 1.762: Y between 1.45 and 1.31
    assert equivalent_load(bearing, 500.0, 1000.0) == pytest.approx(
        0.56 * 500 + 1000 * (1.45 - 0.14 * 0.3824 / 0.69), rel=1e-3
    )
    halves = mean_load(bearing, np.array([1000.0, 2000.0]))
    assert halves == pytest.approx(((1e9 + 8e9) / 2) ** (1 / 3))
    slow = mean_load(bearing, np.array([1000.0, 2000.0]), speed=np.array([3.0, 1.0]))
    assert slow == pytest.approx(((3e9 + 8e9) / 4) ** (1 / 3))
    rollers = Bearing(kind="cylindrical roller", elements=13, element_diameter=7.5e-3, pitch_diameter=46.5e-3,
                      roller_length=9.5e-3)  # fmt: skip
    assert rating_life(rollers, rollers.rating / 2) == pytest.approx(1e6 * 2 ** (10 / 3))
    with pytest.raises(BearingError, match="no axial load"):
        equivalent_load(rollers, 100.0, 50.0)


@pytest.mark.parametrize(("text", "clearance"), [("6205/HC5", 0.0), ("6205/HC5C3WT", 20.5e-6), ("6205HC5-C3", 20.5e-6)])
def test_ceramic_elements_are_no_class_of_clearance(text, clearance):
    with pytest.warns(UserWarning, match=says("HC", "steel", "density=", "youngs_modulus=")):
        assert Bearing.from_designation(text).clearance == pytest.approx(clearance)
    own = Bearing.from_designation(text, youngs_modulus="246 GPa", density=3200.0)
    assert own.clearance == pytest.approx(clearance)
    # a seal named 2RSH, and a class
    assert Bearing.from_designation("6205-2RSHC3").clearance == pytest.approx(20.5e-6)


@pytest.mark.parametrize("text", ["6205", "6205-2RS", "6205-2Z/C3", "SKF 6205", "6205 C4"])
def test_suffixes(text):
    bearing = Bearing.from_designation(text)
    assert bearing.elements == 9
    assert (bearing.bore, bearing.outside_diameter, bearing.width) == pytest.approx((0.025, 0.052, 0.015))


@pytest.mark.parametrize(
    ("text", "clearance"), [("6205", 0.0), ("6205/CN", 12.5e-6), ("6205-2RS C3", 20.5e-6), ("6310/C4", 40.5e-6)]
)
def test_class_of_clearance(text, clearance):
    assert Bearing.from_designation(text).clearance == pytest.approx(clearance)


def test_an_uncertain_bearing_asks():
    with pytest.raises(BearingError, match=says("25 mm", "diameter 62 mm", "17 mm")):
        Bearing.from_designation("6305")
    own = Bearing.from_designation("6305", elements=7, element_diameter="11.5 mm")
    assert own.pitch_diameter == pytest.approx(0.0435)
    with pytest.raises(BearingError, match="in the catalogue"):
        Bearing.from_designation("NU3206")
    with pytest.warns(UserWarning, match=says("6305", "estimated", "Count")):
        usual = Bearing.from_designation("6305", estimate=True)
    assert usual.estimated == ("elements", "element_diameter")
    assert (usual.bore, usual.outside_diameter, usual.width) == (0.025, 0.062, 0.017)
    assert usual.elements == 7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"elements": 2}, says("Bearing.elements", "2", "give a whole number")),
        ({"elements": 40}, says("Bearing.elements", "40", "7.94 mm", "39.04 mm", "15")),
        ({"element_diameter": "8 kg"}, "Bearing.element_diameter"),
        ({"pitch_diameter": 1e-3}, says("Bearing.pitch_diameter", "give the diameter")),
        ({"kind": "magic"}, "choose deep groove"),
        ({"kind": "angular contact"}, says("'25 deg'")),
        ({"kind": "tapered roller"}, "effective length"),
        ({"inner_curvature": 0.4}, says("Bearing.inner_curvature", "wider", "ball")),
        ({"clearance": "9 mm"}, says("Bearing.clearance", "um")),
        ({"bore": 25}, says("Bearing.bore", "25 m", "plain")),
        ({"bore": "35 mm"}, says("Bearing.bore", "35 mm", "31.1 mm", "smaller")),
        ({"outside_diameter": "42 mm"}, says("Bearing.outside_diameter", "42 mm", "46.98 mm", "larger")),
        ({"dynamic_rating": 14.0}, says("Bearing.dynamic_rating", "14 N", "'14 kN'")),
        ({"static_rating": "7.8 MN"}, says("Bearing.static_rating", "N")),
        ({"density": float("nan")}, says("Bearing.density", "nan", "give")),
    ],
)
def test_refuses(changes, message):
    with pytest.raises(BearingError, match=message):
        Bearing.from_designation("6205").changed(**changes)


@pytest.mark.parametrize(
    ("designation", "diameter", "pitch"),
    [("NU206 ECP", 9e-3, 46.5e-3), ("NJ 208", 11e-3, 60.5e-3), ("N305", 10e-3, 44e-3), ("SKF NUP 308-E", 14e-3, 66e-3)],
)
def test_rollers_follow_from_the_interchangeable_raceways(designation, diameter, pitch):
    bearing = Bearing.from_designation(designation, elements=12, roller_length="9 mm")
    assert bearing.kind == "cylindrical roller"
    assert bearing.element_diameter == pytest.approx(diameter)
    assert bearing.pitch_diameter == pytest.approx(pitch)


def test_roller_length_follows_from_the_makers_rating():
    """Thirteen rollers of 9 x 10 mm are in an NU 206 of 44 kN."""
    bearing = Bearing.from_designation("NU206", elements=13, dynamic_rating="44 kN")
    assert bearing.roller_length == pytest.approx(10e-3, rel=0.05)
    assert dynamic_rating(bearing) == pytest.approx(44e3)


@pytest.mark.parametrize(
    ("designation", "factor", "limit"),
    [("30206", 1.6, 0.37), ("30204", 1.7, 0.35), ("30210", 1.4, 0.42), ("30305", 2.0, 0.30), ("30308", 1.74, 0.35)],
)
def test_contact_angles_of_tapered_bearings_give_the_makers_load_factors(designation, factor, limit):
    bearing = Bearing.from_designation(designation, elements=12, element_diameter="7 mm", roller_length="10 mm")
    assert load_factors(bearing, 1.0, 10.0)[1] == pytest.approx(factor, abs=0.06)
    assert 1.5 * math.tan(bearing.contact_angle) == pytest.approx(limit, abs=0.006)


@pytest.mark.parametrize(
    ("designation", "asked"),
    [("NU206", "give elements=, roller_length= (or dynamic_rating="), ("30206", "element_diameter=, roller_length="),
     ("7206-B", "contact angle 40 deg"), ("QJ208", "four point bearing"), ("30215", "contact_angle="),
     ("NU3206", "in the catalogue"), ("NU2206", "give elements=, roller_length=")],
)  # fmt: skip
def test_asks_for_what_designations_leave_open(designation, asked):
    with pytest.raises(BearingError, match=re.escape(asked)):
        Bearing.from_designation(designation)


@pytest.mark.parametrize(
    ("text", "clearance"), [("NU206", 0.0), ("NU206/CN", 32.5e-6), ("NJ 308 ECP/C3", 57.5e-6), ("N210 C5", 110e-6)]
)
def test_classes_of_cylindrical_rollers_are_wider(text, clearance):
    bearing = Bearing.from_designation(text, elements=13, roller_length=9e-3)
    assert bearing.clearance == pytest.approx(clearance, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "told"), [("QJ206/C3", "axial clearance"), ("7206 B/C3", "mounted"), ("30206/CN", "mounted")]
)
def test_classes_that_say_nothing_of_a_radial_clearance_are_asked_for(text, told):
    with pytest.raises(BearingError, match=told):
        Bearing.from_designation(text, elements=12, element_diameter=9e-3)
    counted = {"elements": 12, "element_diameter": 9e-3, "clearance": "20 um"}
    if text.startswith("30"):
        counted["roller_length"] = 10e-3
    assert Bearing.from_designation(text, **counted).clearance == pytest.approx(20e-6)


def test_fields_behind_a_designation():
    bearing = Bearing.from_designation("6305, elements=7, element_diameter=13.49 mm, inner_curvature=0.515")
    assert (bearing.elements, bearing.designation) == (7, "6305")
    assert bearing.element_diameter == pytest.approx(13.49e-3)
    assert bearing.inner_curvature == 0.515
    own = Bearing.from_designation("elements=7, element_diameter=13.49 mm, pitch_diameter=44 mm")
    assert own.bpfo == pytest.approx(7 * 0.5 * (1 - 13.49 / 44))
    # what is given by name counts before the text
    assert Bearing.from_designation("6205, clearance=10 um", clearance=0.0).clearance == 0.0
    with pytest.raises(BearingError, match=says("'balls=7'", "bearing")):
        Bearing.from_designation("6305, balls=7")
    with pytest.raises(BearingError, match="needs pitch_diameter="):
        Bearing.from_designation("elements=7, element_diameter=13.49 mm")
    with pytest.raises(BearingError, match="elements is 'seven'"):
        Bearing.from_designation("6305, elements=seven, element_diameter=13 mm")


def test_defects_may_be_tables():
    from gearmbs.bearings import RollingBearing, Spall, Waviness
    from gearmbs.mechanism import Mechanism

    m = Mechanism("one")
    tables = [{"kind": "spall", "part": "inner", "width": "1 mm"}, {"kind": "waviness", "order": 7}]
    made = RollingBearing("a", m.ground.marker(), m.ground.marker(), Bearing.from_designation("6205"), defects=tables)
    assert made.defects == (Spall(part="inner", width=1e-3), Waviness(order=7))
    for wrong, told in (
        ({"kind": "hole"}, says("kind 'hole'", "spall", "choose")),
        ({"kind": "spall", "size": 1.0}, "spall: .*'size'"),
        ("spall", "give defects of gearmbs.bearings, or tables"),
    ):
        with pytest.raises(BearingError, match=told):
            RollingBearing("b", m.ground.marker(), m.ground.marker(), Bearing.from_designation("6205"), defects=wrong)


@pytest.mark.parametrize(
    ("text", "clearance"),
    [
        ("6205C3", 20.5e-6), ("6205ZZC3", 20.5e-6), ("6205-2RSC3", 20.5e-6), ("NTN 6205LLUC4/5K", 32e-6),
        ("6205/P63", 20.5e-6), ("6205/C3H", 24.25e-6), ("6205-C3L", 16.75e-6), ("6205/P6", 0.0), ("6205CN", 12.5e-6),
        ("6205DDU", 0.0), ("6205-C-2HRS", 0.0),
    ],
)  # fmt: skip
def test_class_of_clearance_as_makers_write_it(text, clearance):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Bearing.from_designation(text).clearance == pytest.approx(clearance, abs=1e-12)


@pytest.mark.parametrize("text", ["6205/C9", "6205C9", "6205 C1", "6205ZZ/C33", "6205-2RSC6", "NU206/C9"])
def test_classes_that_are_none_are_refused_by_name(text):
    counted = {"elements": 13, "roller_length": 9e-3} if text.startswith("NU") else {}
    with pytest.raises(BearingError, match=r"C(\d+|M) is .* choose C2, CN, C3, C4, C5"):
        Bearing.from_designation(text, **counted)
    assert Bearing.from_designation(text, clearance="30 um", **counted).clearance == pytest.approx(30e-6)


def test_other_suffixes_never_stand_for_a_class_in_silence():
    with pytest.raises(BearingError, match="C2 and C3; give one"):
        Bearing.from_designation("6205C2/C3")
    with pytest.warns(UserWarning, match=says("XYZ")):
        assert Bearing.from_designation("6205-XYZ/C3").clearance == pytest.approx(20.5e-6)
    sizes = {"elements": 10, "element_diameter": 20e-3, "pitch_diameter": 130e-3}
    with pytest.raises(BearingError, match=says("C3", "clearance", "catalogue")):
        Bearing.from_designation("6244/C3", **sizes)
    assert Bearing.from_designation("6244", **sizes).clearance == 0.0
    assert Bearing.from_designation("6220/C3", **sizes).clearance == pytest.approx(44e-6)


def test_loads_count_by_their_size():
    bearing = Bearing.from_designation("6205")
    for radial, axial in ((1000.0, 500.0), (1000.0, 50.0), (0.0, 500.0)):
        known = equivalent_load(bearing, radial, axial)
        assert {equivalent_load(bearing, a * radial, b * axial) for a in (1, -1) for b in (1, -1)} == {known}


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda b: rating_life(b, 1400.0, life_factor=-1.0), "life_factor is -1.0"),
        (lambda b: rating_life(b, 1400.0, life_factor=0.0), "life_factor is 0.0"),
        (lambda b: rating_life(b, math.inf), "load is inf N"),
        (lambda b: rating_life(b, math.nan), "load is nan N"),
        (lambda b: equivalent_load(b, math.nan), "radial is nan N"),
        (lambda b: equivalent_load(b, 1.0, math.inf), "axial is inf N"),
        (lambda b: mean_load(b, np.array([1.0, math.nan])), says("radial has values")),
        (lambda b: mean_load(b, np.ones(2), speed=np.zeros(2)), "speed is 0 throughout"),
        (lambda b: mean_load(b, np.ones(2), speed=np.array([1.0, math.inf])), "speed has values"),
        (lambda b: mean_load(b, np.ones(2), np.ones(3)), says("3", "axial")),
        (lambda b: mean_load(b, np.ones(0)), says("0", "radial")),
    ],
)
def test_loads_that_give_no_life_are_refused_by_name(call, told):
    with pytest.raises(BearingError, match=told):
        call(Bearing.from_designation("6205"))


def test_a_bearing_at_rest_for_a_while_has_a_mean_load():
    bearing = Bearing.from_designation("6205")
    load = mean_load(bearing, np.array([1000.0, 2000.0]), speed=np.array([0.0, -3.0]))
    assert rating_life(bearing, load, life_factor=0.5) == pytest.approx(0.5 * rating_life(bearing, 2000.0))


def test_a_modulus_in_a_wrong_unit_is_remarked_on():
    with pytest.warns(UserWarning, match=r"Bearing: E = 207 Pa .*'207 GPa'"):
        Bearing.from_designation("6205", youngs_modulus=207.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Bearing.from_designation("6205", youngs_modulus="310 GPa", density=3200.0)  # silicon nitride


BOUNDARY = """
6008 40 68 15|6030 150 225 35|6211 55 100 21|6217 85 150 28|6232 160 290 48|6313 65 140 33|6324 120 260 55
6408 40 110 27|7211 B 55 100 21|7311 BECBP 55 120 29|7216-B-JP 80 140 26|7020AC 100 150 24|QJ 312 60 130 31
NU 213 65 120 23|NU2213 ECP 65 120 31|NJ 2310 ECP/C3 50 110 40|NUP2320 100 215 73|NU1016 80 125 22|NU415 75 190 45
30310 50 110 29.25|32216 80 140 35.25|32313 65 140 51|30215 75 130 27.25|32011 X 55 90 23
"""
"""Designations with bore, outside diameter and width, mm, as makers' catalogues have them."""


@pytest.mark.parametrize("row", [row for row in BOUNDARY.replace("\n", "|").split("|") if row])
def test_boundary_dimensions_of_industrial_gearboxes(row):
    *name, bore, outside, width = row.split()
    with pytest.warns(UserWarning, match=says("elements=", "estimated")):
        bearing = Bearing.from_designation(" ".join(name), estimate=True)
    found = (bearing.bore, bearing.outside_diameter, bearing.width)
    assert found == pytest.approx((1e-3 * float(bore), 1e-3 * float(outside), 1e-3 * float(width)), abs=1e-9)
    assert "elements" in bearing.estimated
    # the elements fit beside each other and between the rings, and ISO 281 gives what is printed
    assert bearing.element_diameter < 0.5 * (bearing.outside_diameter - bearing.bore)
    by_formula = bearing.changed(dynamic_rating=None)
    if bearing.dynamic_rating is not None:
        assert by_formula.rating == pytest.approx(bearing.dynamic_rating, rel=0.1)


def test_usual_elements_are_those_of_the_bearings_that_are_known(monkeypatch):
    diameters = []
    for name, (count, diameter, _) in list(ELEMENTS.items()):
        monkeypatch.delitem(ELEMENTS, name)
        with pytest.warns(UserWarning, match=says(name, "estimated")):
            usual = Bearing.from_designation(name, estimate=True)
        assert usual.elements == count, name
        diameters.append(1e3 * usual.element_diameter / diameter - 1.0)
    assert np.sort(np.abs(diameters))[-3] < 0.01
    assert np.max(np.abs(diameters)) < 0.08


@pytest.mark.parametrize(
    ("text", "kilonewtons"), [("6211", 43.4), ("6313", 92.7), ("6408", 64.0), ("NU213 ECP", 108.0), ("NU2320", 570.0)]
)
def test_ratings_of_makers_where_they_are_tabulated(text, kilonewtons):
    with pytest.warns(UserWarning, match=says(text, "estimated", "catalogue")):
        bearing = Bearing.from_designation(text, estimate=True)
    assert bearing.rating == pytest.approx(1e3 * kilonewtons)
    assert rating_life(bearing, 0.1 * bearing.rating) == pytest.approx(1e6 * 10.0 ** (10 / 3 if bearing.rollers else 3))
