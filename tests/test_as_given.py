"""Quantities keep the texts they were given as, wherever objects show themselves."""

import copy
import pickle
from dataclasses import replace

import pytest

import gearmbs as gm
from gearmbs.bearings import Bearing, BearingError
from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, SpeedDrive
from gearmbs.drivetrain.parts import Wheel
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.flexible import Support
from gearmbs.gears import ContactLaw, GearPair, GearSpec, OperatingPoint
from gearmbs.gears.faults import RootCrack
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts.quantities import has_quantity
from gearmbs.studies import Case, case_mechanism, make_case, run_case
from gearmbs.studies.case.section import CaseWarning
from gearmbs.units import Given, shown, to_si
from tests.says import says


def test_a_text_becomes_a_number_that_remembers_it():
    module = to_si(" 2 mm ", "length")
    assert module == 0.002
    assert hash(module) == hash(0.002)
    assert repr(module) == "0.002"
    assert f"{module:g}" == "0.002"
    for same in (pickle.loads(pickle.dumps(module)), copy.deepcopy(module), to_si(module, "length")):
        assert isinstance(same, Given)
        assert same.text == "2 mm"
    assert type(2 * module) is float
    assert type(to_si(0.002, "length")) is float
    assert shown(module, "um") == "2 mm"
    assert shown(2 * module, "um") == "4000 um"
    with pytest.raises(ValueError, match="unit is 'furlong'"):
        shown(0.1, "furlong")


@pytest.mark.parametrize(
    ("text", "dimension", "meant"),
    [
        ("2 mmm", "length", "2 mm"),
        ("3 mn", "length", "3 m' or '3 um' or '3 mm"),
        ("1500 rmp", "angular speed", "1500 rpm"),
        ("5 kHzz", "frequency", "5 kHz"),
    ],
)
def test_a_slip_in_a_unit_is_told_with_what_was_meant(text, dimension, meant):
    with pytest.raises(ValueError, match=f"did you mean '{meant}'"):
        to_si(text, dimension)
    with pytest.raises(ValueError, match="write for example '1 dimensionless'"):
        to_si("5 apples", "dimensionless")


@pytest.mark.parametrize(
    ("thing", "text"),
    [
        (OperatingPoint("0.1 kN m"), "OperatingPoint(torque='0.1 kN m')"),
        (OperatingPoint(), "OperatingPoint()"),
        (RootCrack(depth="1 mm", wheel="driven"), "RootCrack(wheel='driven', depth='1 mm')"),
        (
            ContactLaw.linear("3e8 N/m", depth="10 um"),
            "ContactLaw(kind='linear', stiffness='3e8 N/m', exponent=1.0, damping=0.0, depth='10 um')",
        ),
        (
            Shaft(name="in", length="20 cm", position=("1 mm", 0, 0)),
            "Shaft(name='in', length='20 cm', position=('1 mm', 0.0, 0.0))",
        ),
        (Support("a", stiffness="1e8 N/m"), "Support(seat='a', stiffness='1e8 N/m')"),
    ],
)  # fmt: skip
def test_what_is_written_is_shown_and_makes_the_same_again(thing, text):
    assert repr(thing) == text
    assert repr(eval(text)) == text
    assert repr(replace(thing)) == text


def test_wheels_and_pairs_show_the_units_they_were_given_in():
    wheel = GearSpec(20, "2 mm", face_width="1 in", helix_angle="15 deg")
    assert repr(wheel).startswith("GearSpec(teeth=20, module='2 mm', face_width='1 in', ")
    page = wheel._repr_html_()
    assert ">2 mm<" in page
    assert ">1 in<" in page
    assert "15 deg, right hand" in page
    assert wheel.plot().axes[0].get_title(loc="left") == "gear: 20 teeth, module 2 mm, face 1 in, helix 15 deg"
    pair = GearPair.paper(misalignment="30 arcmin", backlash="100 um", torque="0.2 kN m", axial_shift="1 mm")
    assert "backlash 100 um" in repr(pair)
    assert "skew 30 arcmin" in repr(pair)
    page = pair._repr_html_()
    for text in ("30 arcmin skew", "100 um", "0.2 kN m", "<td>1 mm</td>", "3.0645 mm"):
        assert text in page
    # what other settings have changed is not as it was given
    assert "backlash 100 um" not in repr(GearPair.paper(backlash="100 um", centre_distance_error="3 mm"))


def test_a_mechanism_shows_the_units_it_was_given():
    m = Mechanism("rod")
    body = m.body("rod", "2 kg", ["0.1 kg m^2", 0.1, 0.1], position=["10 cm", 0, 0])
    m.revolute("pin", body, m.ground, at=["10 cm", 0, 0])
    spring = m.spring_damper("spring", body.marker(), m.ground.marker(), stiffness="10 N/mm", damping=3.0)
    m.axis_torque("brake", body.marker(), m.ground.marker(), "-1*TIME")
    assert "mass=2 kg" in repr(body)
    assert "10 N/mm, 3 N s/m" in repr(spring)
    page = m._repr_html_()
    for text in ("2 kg", "0.1 kg m^2, 0.1, 0.1", "10 cm, 0, 0", "at 10 cm, 0, 0", "stiffness 10 N/mm"):
        assert text in page
    assert set(m.given) == {"rod", "pin", "spring"}
    assert not any(has_quantity(text) for text in ("10*TIME", "1e5", "31/TIME", "3 + 1/TIME"))
    assert all(has_quantity(text) for text in (("1 mm", 0.0), "3e-4 1/mm^2", "10 N/mm"))


def test_parts_of_a_drivetrain_show_theirs_and_name_their_wheels():
    train = Drivetrain(
        name="one stage",
        shafts=[Shaft(name="in", length="20 cm"), Shaft(name="out")],
        wheels=[
            Wheel(name="pinion", shaft="in", gear=GearSpec(20, "3 mm"), station="5 cm"),
            Wheel(name="wheel", shaft="out", gear=GearSpec(60, "3 mm")),
        ],
        meshes=[GearMesh(name="mesh", driver="pinion", driven="wheel")],
        bearings=[IdealBearing(name="a", shaft="in"), IdealBearing(name="b", shaft="out")],
        drives=[SpeedDrive(name="motor", shaft="in", speed="1500 rpm")],
    )
    page = train._repr_html_()
    assert "length 20 cm" in page
    assert "station 5 cm" in page
    assert [w.gear.name for w in train.wheels] == ["pinion", "wheel"]


def test_a_support_finds_a_wrong_unit_at_once():
    with pytest.raises(ValueError, match="support at 'a': stiffness"):
        Support("a", stiffness="3 mm")


def test_a_suffix_that_no_maker_uses_is_told():
    with pytest.raises(BearingError, match=says("'X'", "after the digits")):
        Bearing.from_designation("6205x")
    for name in ("6205-2RS", "6205ZZ", "6205 C3", "6205LLU", "6205-X", "SKF 6205ETN9"):
        assert Bearing.from_designation(name).elements == 9
    with pytest.warns(UserWarning, match=says("CM", "maker's own class")):
        assert Bearing.from_designation("6205DDUCM").elements == 9


def test_a_case_shows_what_was_given():
    case = gm.Case(name="mine", operation={"speed": "1500 rpm", "duration": 0.4})
    assert repr(case) == "Case(name='mine', operation=Operation(speed='1500 rpm', duration=0.4))"
    assert str(case).splitlines()[:2] == ['name = "mine"', ""]
    assert "mesh frequency 725 Hz" in str(case)
    curve = [["0 s", "0 rpm"], ["2 s", "3000 rpm"]]
    assert case.changed(operation={"speed": curve}).operation.duration == 2.0
    assert case.changed(operation={"speed": curve, "duration": 0.5}).operation.duration == 0.5
    assert case.changed(operation={"speed": "1600 rpm"}).operation.duration == 0.4


def test_a_speed_in_hertz_that_looks_like_rpm_is_remarked(recwarn):
    gm.Case(operation={"speed": "30 Hz"})
    assert not recwarn
    with pytest.warns(CaseWarning, match=says("'1800 Hz'", "108000 rpm", "write '1800 rpm'")):
        gm.Case(operation={"speed": "1800 Hz"})


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: to_si("60 kg", "torque", "load"), says("'1 N*m'", "write for example")),
        (lambda: gm.GearSpec(20, "2 mm", helix_angle=15), "plain numbers: rad; write '15 deg'"),
        (lambda: gm.planetary((19, 17, 56), "2 mm", planet=3), says("'planet'", "planets")),
        (lambda: run_case({"name": "x"}), says("dict", "make_case")),
        (lambda: make_case({"operation": {"duration": -1}}), says("10000 s", "give 1e-05")),
        (lambda: case_mechanism(Case(), "6206", spall=1), says("'spall'", "defects")),
    ],
)
def test_what_is_given_wrongly_has_a_remedy(call, said):
    with pytest.raises(ValueError, match=said):
        call()
