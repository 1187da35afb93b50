"""Text with units becomes SI; everything else is refused by name."""

import math
import warnings

import pytest

from gearmbs import units
from gearmbs.gears import ContactLaw, FlankFriction, GearSpec
from gearmbs.units import to_si
from tests.says import says


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.1 mm", "length", 1e-4),
        ("1000 rpm", "angular speed", 104.71975511965977),
        ("1 deg", "angle", 0.017453292519943295),
        ("1°", "angle", 0.017453292519943295),
        ("100 N m", "torque", 100.0),
        ("100 N*mm", "torque", 0.1),
        ("207 GPa", "pressure", 2.07e11),
        ("12.8 kHz", "frequency", 12800.0),
        ("20 percent", "dimensionless", 0.2),
        (3.0, "length", 3.0),
        (3, "length", 3.0),
        # 2.9852e5 N/mm^1.3 = 2.9852e5 * (1000)^1.3 N/m^1.3
        ("2.9852e5 N/mm^1.3", "N/m^1.3", 2.9852e5 * 1e3**1.3),
    ],
)
def test_values(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "unit"),
    [
        ("3", "length"),
        ("20", "angle"),
        ("1 kg", "length"),
        ("abc", "length"),
        ("1 furlongz", "length"),
        ("", "length"),
        (float("nan"), "length"),
        ("nan mm", "length"),
        ("1 N/mm^1.5", "N/m^1.3"),
    ],
)
def test_refused_values_name_the_field(value, unit):
    with pytest.raises(ValueError, match=r"pair\.depth"):
        to_si(value, unit, "pair.depth")


@pytest.mark.parametrize("value", [True, None, [1.0], {"a": 1}])
def test_refused_types_name_the_field(value):
    with pytest.raises(TypeError, match=r"pair\.depth"):
        to_si(value, "length", "pair.depth")


def test_impact_damping_is_a_thousandth_of_the_printed_stiffness():
    # 0.001 * 2.9852e5 = 298.52 N s/mm
    law = ContactLaw.impact()
    assert law.damping == pytest.approx(298.52e3, rel=1e-12)
    assert ContactLaw.impact(damping="300 N*s/mm").damping == pytest.approx(3e5)


def test_laws_refuse_nonsense():
    for arguments in (
        {"stiffness": "-1 N/mm^1.3"},
        {"exponent": 0.5, "stiffness": 1e9},
        {"damping": -1.0},
        {"depth": 0.0},
    ):
        name, value = next(iter(arguments.items()))
        wrong = "-7943.282347242817" if name == "stiffness" else str(value)
        with pytest.raises(ValueError, match=says(f"ContactLaw.{name}", wrong)):
            ContactLaw.impact(**arguments)
    for arguments in ({"static": -0.1}, {"static_speed": "2 m/s"}, {"kind": "glue"}):
        name, wrong = next(iter(arguments.items()))
        wrong = "2.0 m/s" if name == "static_speed" else repr(wrong)
        with pytest.raises(ValueError, match=says(f"FlankFriction.{name}", wrong)):
            FlankFriction(**arguments)


def test_friction_that_grows_with_sliding_is_remarked_on():
    with pytest.warns(UserWarning, match=says("FlankFriction.static", "0.05", "dynamic 0.1", "Give static")):
        FlankFriction(static=0.05, dynamic=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        FlankFriction(static=0.1, dynamic=0.1)
        # laws that have no static coefficient
        FlankFriction(dynamic=0.3, kind="smooth")
        FlankFriction(dynamic=0.3, kind="none")


def test_hertz_line_contact():
    # Palmgren: 1000 N on 20 mm of steel: 3.84e-5 * 1000^0.9 / 20^0.8 = 1.752e-3 mm
    law = ContactLaw.hertz_line("20 mm", "206 GPa", 0.3)
    assert (1000 / law.stiffness) ** 0.9 == pytest.approx(3.84e-8 * 1000**0.9 / 20**0.8, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("30 Hz", "angular speed", 60.0 * math.pi),
        ("1800 1/min", "angular speed", 60.0 * math.pi),
        ("1800 U/min", "angular speed", 60.0 * math.pi),
        ("1800 RPM", "angular speed", 60.0 * math.pi),
        ("180 deg/s", "angular speed", math.pi),
        ("60 rpm", "frequency", 1.0),
        ("6.283185307179586 rad/s", "frequency", 1.0),
        ("50 1/s", "frequency", 50.0),
        ("30 Nm", "torque", 30.0),
        ("1.5 kNm", "torque", 1500.0),
        ("30 Nmm", "torque", 0.03),
    ],
)
def test_turns_are_not_radians_and_usual_spellings(text, dimension, value):
    assert to_si(text, dimension) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("1 Hz", "rad/s", math.tau),
        ("1 Hz", "Hz", 1.0),
        ("1 Hz", "1/s", 1.0),
        ("1 rpm", "rad/s", math.tau / 60.0),
        ("1 Hz/s", "rad/s^2", math.tau),
        ("2 kHz/s", "rad/s^2", 2e3 * math.tau),
        ("60 rpm/s", "rad/s^2", math.tau),
        ("60 rpm/s", "Hz/s", 1.0),
        ("360 deg/s^2", "Hz/s", 1.0),
        ("1 kHz/s", "Hz/s", 1e3),
        ("1 Hz^2", "rad^2/s^2", math.tau**2),
        ("60 rpm", "1/min * rad", math.tau * 60.0),
        ("1 N m/Hz", "N*m*s/rad", 1.0 / math.tau),
        ("1 N m/rpm", "N*m*s/rad", 60.0 / math.tau),
        ("1 N m s/turn", "N*m*s/rad", 1.0 / math.tau),
        ("1 N m s/deg", "N*m*s/rad", 180.0 / math.pi),
        ("1 N m s", "N*m*s/rad", 1.0),
        ("1 N m/Hz^2", "N*m*s^2/rad^2", math.tau**-2),
        ("1 m/Hz", "m*s/rad", 1.0 / math.tau),
        ("1 J/rad^2", "N*m/rad", 1.0),
        ("1 W/Hz^2", "N*m*s/rad", math.tau**-2),
        ("20 N/Hz", "N*s", 20.0),
        ("1 cm^3/turn", "m^3/rad", 1e-6 / math.tau),
        ("50 mm*Hz", "speed", 0.05),
        ("2 turn", "angle", 2.0 * math.tau),
        ("4 kHz*s", "dimensionless", 4e3),
    ],
)
def test_turns_inside_compound_units(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "fault"),
    [
        ("1 deg^2", "angle", "power of the angle"),
        ("1 deg^2/s", "rad/s", "power of the angle"),
        ("1 1/min/s", "rad/s^2", "power of the angle"),
        ("1 N m min", "N*m*s/rad", "power of the angle"),
        ("inf m", "length", "finite"),
        ("1e400 m", "length", "finite"),
        ("-1e400 N/m", "N/m", "finite"),
        ("1 K", "temperature", "'temperature' is no unit"),
        ("1 L", "volume", "'m^3'"),
    ],
)
def test_turns_that_may_be_radians_and_what_is_not_finite(text, unit, fault):
    with pytest.raises(ValueError, match=says("field", fault)):
        to_si(text, unit, "field")
    assert to_si("1 L", "m^3") == pytest.approx(1e-3)
    assert to_si("1 K", "K") == 1.0
    assert to_si("1e300 m", "length") == 1e300


def test_a_reciprocal_second_may_be_either():
    with pytest.raises(ValueError, match=says("'Hz'", "'rad/s'", "write 'rpm'")):
        to_si("30 1/s", "angular speed", "speed")


def test_a_module_of_metres_is_a_forgotten_unit():
    with pytest.raises(ValueError, match=says("m", "write '3 mm'")):
        GearSpec(teeth=20, module=3)
    with pytest.raises(ValueError, match="write for example '3 mm'"):
        GearSpec(teeth=20, module="3")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("0.1 mm", "m"),
        ("1000 rpm", "rad/s"),
        ("2.9852e5 N/mm^1.3", "N/m^1.3"),
        ("100 N m", "N*m"),
        (".5 um", "m"),
        ("7.85 g/cm^3", "kg/m^3"),
        ("207 GPa", "Pa"),
        ("-3 N*m/deg", "N*m/rad"),
        ("12.8 kHz", "Hz"),
        ("1.5 kg mm**2", "kg*m^2"),
        ("20 N/mm/deg", "N/m/rad"),
    ],
)
def test_common_units_agree_with_the_registry(text, unit):
    """What is read without the registry of units is what the registry says, but for four roundings in either."""
    import pint

    quick = units._quick(text, unit)
    assert quick == pytest.approx(pint.UnitRegistry().Quantity(text).to(unit).magnitude, rel=8 * 2.0**-53, abs=0.0)


@pytest.mark.parametrize(
    ("text", "unit"),
    [("30 Hz", "rad/s"), ("5", "m"), ("3 km", "m"), ("1 2 mm", "m"), ("95/31 mm", "m"), ("3 mm", "s"), ("nan mm", "m")],
)
def test_all_else_is_left_to_the_registry(text, unit):
    assert units._quick(text, unit) is None


@pytest.mark.parametrize("text", ["3,5 mm", "1,000 rpm", "1.000,5 rpm"])
def test_commas_in_numbers_are_refused(text):
    """They were dropped: 35 mm for three and a half."""
    with pytest.raises(ValueError, match=says("field", repr(text), "comma", "point")):
        to_si(text, text.split()[1], "field")


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("\N{MINUS SIGN}3 mm", "length", -3e-3),
        ("- 3 mm", "length", -3e-3),
        ("+3 mm", "length", 3e-3),
        ("1e3mm", "length", 1.0),
        (".5 mm", "length", 5e-4),
        ("1\u00a0mm", "length", 1e-3),
        ("3 \N{MICRO SIGN}m", "length", 3e-6),
        ("3 \N{GREEK SMALL LETTER MU}m", "length", 3e-6),
        ("3 mm\N{SUPERSCRIPT TWO}", "area", 3e-6),
        ("9.81 m s\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT TWO}", "acceleration", 9.81),
        ("9.81 m/s/s", "acceleration", 9.81),
        ("-20°", "angle", -0.3490658503988659),
        ("50%", "dimensionless", 0.5),
        ("50 %", "dimensionless", 0.5),
        ("0.5 mm/mm", "dimensionless", 0.5),
        ("5 1/s", "frequency", 5.0),
        ("1500 1/min", "angular speed", 157.07963267948966),
        ("2*3 mm", "length", 6e-3),
        ("10 mm - 15 mm", "length", -5e-3),
        ("30 J/rad", "torque", 30.0),
        ("30 N m", "N*m/rad", 30.0),
        ("30 N m/deg", "N*m/rad", 1718.8733853924696),
        ("1 N m s^2/rad", "inertia", 1.0),
        ("60 N m rpm", "power", 6.283185307179586),
        ("3 mils", "length", 7.62e-5),
        ("0.5mil", "length", 1.27e-5),
        ("2 mil/s", "speed", 5.08e-5),
        ("25 rev/s", "angular speed", 50.0 * math.pi),
        ("1500 rev/min", "angular speed", 50.0 * math.pi),
        ("2 revs", "angle", 4.0 * math.pi),
        ("2 milliradian", "angle", 2e-3),
    ],
)
def test_odd_texts_that_can_be_read(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "fault"),
    [
        ("3 mm 2", "length", "two numbers"),
        ("48(2) N m", "torque", "uncertainty"),
        ("210(5) GPa", "pressure", "uncertainty"),
        ("2 m/s 3", "speed", "two numbers"),
        ("1 000 mm", "length", "two numbers"),
        ("1\u202f000 mm", "length", "two numbers"),
        ("1.000.000 mm", "length", "two numbers"),
        ("3e2.5 mm", "length", "two numbers"),
        ("1 1/2 mm", "length", "two numbers"),
        ("5 ft 6 in", "area", "two numbers"),
        ("20 % 3", "dimensionless", "two numbers"),
        ("1'000 mm", "length", '"\'"'),
        ("20°30'", "angle", '"\'"'),
        ("3 mm # bore", "length", "'#'"),
        ("\N{INFINITY} mm", "length", "'\N{INFINITY}'"),
        ("--3 mm", "length", "two signs"),
        ("+-3 mm", "length", "two signs"),
        ("mm", "length", "no number"),
        ("3 mm/deg", "length", "an angle"),
        ("300 cm^3/rad", "m^3", "2 pi"),
        ("30 N m/rad", "torque", "an angle"),
        ("20 deg", "dimensionless", "an angle"),
        ("2 deg", "length", "an angle"),
        ("2 deg", "frequency", "in deg"),
        ("3 mils", "angle", "in th"),
        ("20 degC", "length", "°C"),
        ("3 mm mm", "length", "mm ** 2"),
    ],
)
def test_odd_texts_that_would_be_read_wrongly(text, unit, fault):
    with pytest.raises(ValueError, match=says("gap", repr(text), fault, "'1 ")):
        to_si(text, unit, "gap")


@pytest.mark.parametrize("text", ["2", "2 mm/mm", "2 %"])
def test_a_number_without_a_unit_gets_one_in_the_hint(text):
    with pytest.raises(ValueError, match=says("gap", repr(text), "no unit", "'2 mm'")):
        to_si(text, "length", "gap")
