"""Functions that a file defines itself, and macros that it deletes."""

from __future__ import annotations

import pytest

from gearmbs.adams import DeckError, parse_view
from gearmbs.adams.parse import statements as st
from tests.says import says

from .files import PENDULUM


def function(name: str, text: str, *arguments: str, kind: str = "real") -> str:
    names = f" argument_names = {', '.join(repr(one) for one in arguments)}" if arguments else ""
    return f'function create function_name = .{name} text_of_expression = "{text}"{names} type = {kind}\n'


HALF = function("half", "P1 / 2", "P1")
TALL = function("tall", ".swing.LENGTH * 2")
MACRO = (
    "macro create macro_name = .longer user_entered_command = 'longer' "
    "commands_to_be_executed = 'variable set variable_name = .swing.LENGTH real_value = 600'\n"
)


def value(text: str, asked: str) -> float:
    """Return what an expression of a file comes to, as a design variable of it."""
    made = f"variable create variable_name = .swing.ASKED real_value = (eval({asked}))\n"
    return parse_view(PENDULUM + text + made).variables[".swing.ASKED"]


def place(text: str, asked: str) -> tuple[float, ...]:
    view = parse_view(PENDULUM + text + f"marker create marker_name = .swing.ROD.HERE location = ({asked})\n")
    return next(m.qp for m in view.deck.of(st.Marker).values() if m.name == "HERE")


def test_a_function_of_the_file_is_its_expression():
    assert value(HALF, "half(7) + HALF(.swing.LENGTH)") == 253.5
    assert value(HALF + function("d", "A1 - 2 * a2", "A1", "A2"), "d(half(10), d(3, 1))") == 3.0
    assert value(TALL, "TALL()") == 1000.0


def test_it_follows_what_it_names():
    text = "variable create variable_name = .swing.A real_value = (tall())\n"
    changed = "variable modify variable_name = .swing.LENGTH real_value = 700\n"
    assert parse_view(PENDULUM + TALL + text + changed).variables[".swing.A"] == 1400.0


@pytest.mark.parametrize(
    ("asked", "inline"),
    [
        ("up(7, .swing.ROD.cm)", "LOC_RELATIVE_TO({0, 7, 0}, .swing.ROD.cm)"),
        ("up(7, .swing.ROD.cm) + {1, 0, 0}", "LOC_RELATIVE_TO({0, 7, 0}, .swing.ROD.cm) + {1, 0, 0}"),
        ("same(up(7, .swing.ROD.cm))", "LOC_RELATIVE_TO({0, 7, 0}, .swing.ROD.cm)"),
        (
            "aside(up(7, .swing.ROD.cm))",
            "LOC_RELATIVE_TO(LOC_RELATIVE_TO({0, 7, 0}, .swing.ROD.cm), .swing.ground.PIVOT)",
        ),
    ],
)
def test_places_within_it_are_in_the_frames_of_where_it_is_called(asked, inline):
    """As if the expression stood there: the part is turned, and away from the origin."""
    text = (
        "part modify rigid_body name_and_position part_name = .swing.ROD location = 1, 2, 3 orientation = 90, 20, 0\n"
        + function("up", "LOC_RELATIVE_TO({0, D, 0}, M)", "D", "M", kind="location_orientation")
        + function("aside", "LOC_RELATIVE_TO(L, .swing.ground.PIVOT)", "L", kind="location_orientation")
        + function("same", "L", "L", kind="location_orientation")
    )
    assert place(text, asked) == pytest.approx(place(text, inline), abs=1e-12)


def test_functions_of_texts_and_objects():
    text = function("sout", "STR_SPRINTF(P1, P2)", "P1", "P2", kind="string")
    marker = 'marker create marker_name = (eval(sout(".swing.ROD.m_%d", {4}))) location = 0, 0, 0\n'
    view = parse_view(PENDULUM + text + marker)
    assert any(m.name == "m_4" for m in view.deck.of(st.Marker).values())
    assert value(function("across", "P1.loc_x + 1", "P1"), "across(.swing.ROD.TOP)") == 1.0


def test_a_function_is_changed_renamed_and_deleted():
    third = HALF + 'function modify function_name = .half new_function_name = .third text_of_expression = "P1 / 3"\n'
    assert value(third, "third(9)") == 3.0
    with pytest.raises(DeckError, match=says("HALF", "not evaluated")):
        value(third, "half(9)")
    with pytest.raises(DeckError, match=says("HALF", "not evaluated")):
        value(HALF + "function delete function_name = .half\n", "half(9)")


@pytest.mark.parametrize(
    ("text", "asked", "told"),
    [
        (function("half", "P1 /", "P1"), "1", says("P1 /", "too early")),
        (function("half", " ", "P1"), "1", says("text_of_expression", "needs")),
        (function("half", "P1", "P1", "p1"), "1", says("argument_names", "p1", "own")),
        (function("half", "P1", "P1", kind="colour"), "1", says("type", "colour", "location_orientation")),
        (function("sqrt", "P1", "P1"), "1", says("function_name", "sqrt", "another name")),
        (HALF, "half(1, 2)", says("half", "1", "2", "arguments")),
        (function("half", "P1 / 2", "P1", kind="integer"), "half(3)", says("half", "1.5", "integer")),
        (function("half", "half(P1)", "P1"), "half(3)", says("half", "20", "deep")),
        (function("half", "P1.loc_x", "P1"), "half(3)", says("P1.loc_x", "no object")),
        (function("half", "Q", "P1"), "half(3)", says("Q", "no object")),
        ("function modify function_name = .half type = real\n", "1", says("half", "there is no function")),
        ("function delete function_name = .half\n", "1", says("half", "there is no function")),
    ],
)
def test_what_is_no_function_is_refused(text, asked, told):
    with pytest.raises(DeckError, match=told):
        value(text, asked)


def test_functions_that_call_each_other_without_end_stop():
    twice = "".join(function(f"f{k}", f"f{k + 1}() + f{k + 1}()") for k in range(18))
    with pytest.raises(DeckError, match=says("10000", "values")):
        value(twice + function("f18", "1"), "f0()")


def test_macros_are_deleted_by_their_names():
    deleted = "macro delete macro_name = .longer\n"
    assert parse_view(PENDULUM + MACRO + "longer\n" + deleted).variables[".swing.LENGTH"] == 600.0
    with pytest.raises(DeckError, match=says("longer", "not known")):
        parse_view(PENDULUM + MACRO + deleted + "longer\n")
    with pytest.raises(DeckError, match=says("shorter", "there is no macro")):
        parse_view(PENDULUM + MACRO + deleted.replace("longer", "shorter"))
