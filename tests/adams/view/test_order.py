"""What commands mean by those before them: units, settings, masses; and which variables a factor may be."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_view
from gearmbs.adams.builders.builder import marker_orientation
from gearmbs.adams.parse import statements as st

from ...says import says

MODEL = "model create model_name = m\n"
PLACE = "part create rigid_body name_and_position part_name = .m.P location = {}, 0, 0\n"
MASS = "part {} rigid_body mass_properties part_name = .m.P mass = {} center_of_mass_marker = .m.P.cm  &\n" + (
    "   ixx = 1 iyy = 2 izz = 3\n"
)
CENTRE = "marker create marker_name = .m.P.cm location = 0, 0, 0\n"
BODY = PLACE.format(0) + CENTRE + MASS
METRES = "defaults units length = meter\n"
VARIABLE = "variable create variable_name = .m.{} {}\n"


def part(text: str, **more) -> st.Part:
    """Return the part of a file, which must hold nothing that is left out."""
    deck = parse_view(MODEL + text, **more).deck
    assert not deck.unsupported
    return next(one for one in deck.of(st.Part).values() if not one.ground)


@pytest.mark.parametrize(
    "before",
    [
        PLACE.format(100),
        VARIABLE.format("L", "real_value = 500 units = length"),
        VARIABLE.format("L", "real_value = (50cm)"),
        VARIABLE.format("L", "real_value = (eval(2 * 50(newton / mm)))"),
    ],
)
def test_units_are_not_changed_after_numbers(before):
    with pytest.raises(DeckError, match=says("length", "changed", "before")):
        parse_view(MODEL + before + METRES)


@pytest.mark.parametrize(
    "before",
    [
        VARIABLE.format("L", "real_value = 500"),
        VARIABLE.format("L", "real_value = (2 * 30deg) units = no_units"),
        "",
        "defaults units length = mm\n",
    ],
)
def test_units_are_changed_before_numbers_in_them(before):
    assert part(before + METRES + PLACE.format("(50cm)") + CENTRE + MASS.format("create", 2)).qg == (0.5, 0.0, 0.0)


@pytest.mark.parametrize("after", ["", "defaults orient_axis_and_plane axis_and_plane_setting = z_axis_xz_plane\n"])
def test_a_joint_has_the_axis_that_was_set_when_it_was_made(after):
    """Its x axis along the line, so that it turns about another one."""
    text = BODY.format("create", 2) + "defaults orient_axis_and_plane axis_and_plane_setting = x_axis_xy_plane\n"
    text += "constraint create joint revolute joint_name = .m.J i_part_name = .m.P j_part_name = .m.ground  &\n"
    text += f"   location = 0, 0, 0 along_axis_orientation = 0, 1, 0\n{after}"
    deck = parse_view(MODEL + text).deck
    (joint,) = deck.of(st.Joint).values()
    assert np.allclose(marker_orientation(deck.of(st.Marker)[joint.i])[:, 0], (0, 1, 0), atol=1e-12)


BLOCK = "geometry create shape block block_name = .m.P.B corner_marker = .m.P.cm diag_corner_coords = 100, 20, 30\n"
OF_BLOCK = "part {} rigid_body mass_properties part_name = .m.P density = 1E-6\n"


@pytest.mark.parametrize(
    ("commands", "mass", "ixx"),
    [
        (MASS.format("create", 2) + OF_BLOCK.format("modify"), 0.06, 0.06 / 12 * (20**2 + 30**2)),
        (OF_BLOCK.format("create") + MASS.format("modify", 2), 2.0, 1.0),
        (MASS.format("create", 2).replace("mass = 2", "mass = 2 density = 1E-6"), 2.0, 1.0),
    ],
)
def test_the_last_command_decides_whether_a_mass_is_of_the_geometry(commands, mass, ixx):
    found = part(PLACE.format(0) + CENTRE + BLOCK + commands)
    assert (found.mass, found.ip[0]) == (pytest.approx(mass), pytest.approx(ixx))


TWO = VARIABLE.format("A", "real_value = 2") + BODY.format("create", "(.m.A)")
TWO += VARIABLE.format("P.A", "real_value = 3")


def test_a_factor_that_may_be_two_variables_is_refused():
    with pytest.raises(DeckError, match=says(".m.A", ".m.P.A", "full name")):
        parse_view(MODEL + TWO, variables={"A": 5.0})
    assert part(TWO, variables={".m.A": 5.0}).mass == 5.0
    assert part(TWO, variables={"P.A": 5.0}).mass == 2.0


@pytest.mark.parametrize("held", ["real_value = 1, 2, 3", 'string_value = "2"', "object_value = .m"])
def test_a_factor_is_a_variable_of_one_number(held):
    with pytest.raises(DeckError, match=says(".m.A", "one number")):
        parse_view(MODEL + VARIABLE.format("A", held) + BODY.format("create", 1), variables={"A": 5.0})


@pytest.mark.parametrize("held", ["real_value = 2", "integer_value = 2", "real_value = (2 * .m.C)"])
def test_a_factor_may_be_any_number(held):
    text = VARIABLE.format("C", "real_value = 1") + VARIABLE.format("A", held) + BODY.format("create", "(.m.A)")
    assert part(text, variables={"A": 5.5}).mass == 5.5


@pytest.mark.parametrize("value", ["3cm", "", None, float("nan"), "inf", [1, 2]])
def test_a_factor_that_is_no_number_is_refused(value):
    text = VARIABLE.format("A", "real_value = 2") + BODY.format("create", "(.m.A)")
    with pytest.raises(DeckError, match=says("A", "number", "unit")):
        parse_view(MODEL + text, variables={"A": value})
    assert part(text, variables={"A": "3"}).mass == 3.0


LIMITED = {
    "range = 1, 3": (2.5, 5, "1 to 3"),
    "range = -1, 3 delta_type = relative": (4.5, 0.5, "1 to 5"),
    "range = -50, 10 delta_type = percent_relative": (1.5, 3, "1 to 2.2"),
    "allowed_values = 1, 2, 5": (5, 3, "1, 2, 5"),
}


@pytest.mark.parametrize("limits", LIMITED)
def test_a_factor_outside_its_limits_is_remarked(limits):
    inside, beyond, told = LIMITED[limits]
    of = MODEL + VARIABLE.format("A", "real_value = 2 " + limits) + BODY.format("create", "(.m.A)")

    def remarks(text, value):
        return [d.message for d in parse_view(text, variables={"A": value}).deck.diagnostics if ".m.A" in d.message]

    (remark,) = remarks(of, beyond)
    assert told in remark
    assert not remarks(of, inside)
    unused = "use_range = no" if "range" in limits.split() else "use_allowed_values = no"
    assert not remarks(of.replace(limits, f"{limits} {unused}"), beyond)


@pytest.mark.parametrize("held", ["real_value = 2", "integer_value = 2", "real_value = (2 * 1)"])
def test_variables_of_one_number_are_listed(held):
    text = (
        VARIABLE.format("A", held)
        + VARIABLE.format("B", "real_value = 1, 2")
        + VARIABLE.format("C", "string_value = x")
    )
    assert parse_view(MODEL + text + BODY.format("create", 1)).variables == {".m.A": 2.0}


@pytest.mark.parametrize("written", ["$mass:t=real:d=5", "$'mass:t=real:d=5'", "$mass:d=5 $'mass'"])
def test_defaults_of_macros(written):
    """In quotation marks or without."""
    head, _, rest = written.partition(" ")
    comment, used = (f'"!{head}", ', rest) if rest else ("", head)
    text = (
        PLACE.format(0)
        + CENTRE
        + (
            f'macro create macro_name = .m.put user_entered_command = "put mass" commands = {comment} &\n'
            f'   "part create rigid_body mass_properties part_name = .m.P mass = {used}  &", &\n'
            '   "   center_of_mass_marker = .m.P.cm ixx = 1 iyy = 1 izz = 1"\n'
        )
    )
    assert part(text + "put mass\n").mass == 5.0
    assert part(text + "put mass mass = 7\n").mass == 7.0


def test_a_request_holds_six_variables():
    names = [f".m.V{k}" for k in range(1, 8)]
    text = BODY.format("create", 2) + "".join(
        f'data_element create variable variable_name = {name} function = "{k}"\n' for k, name in enumerate(names)
    )
    asked = "output_control create request request_name = .m.R variable_name = {}\n"
    (found,) = parse_view(MODEL + text + asked.format(", ".join(names[:6]))).deck.of(st.Request).values()
    assert [getattr(found, f"f{k}") for k in (2, 3, 4, 6, 7, 8)] == [f"VARVAL({k})" for k in range(1, 7)]
    deck = parse_view(MODEL + text + asked.format(", ".join(names))).deck
    assert not deck.of(st.Request)
    assert any("7 variables" in d.message for d in deck.diagnostics)
