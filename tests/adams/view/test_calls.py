"""What is evaluated when: arguments of macros at their call, attributes of the objects of a loop in its body."""

from __future__ import annotations

import pytest

from gearmbs.adams import DeckError, parse_view
from gearmbs.adams.parse import statements as st

from ...says import says
from .files import PENDULUM

PLACED = (
    'macro create macro_name = .swing.mac user_entered_command = "place it" commands =  &\n'
    '  "marker create marker_name = .swing.ground.Q$n location = $x, 0, 0",  &\n'
    '  "!$n:t=string", "!$x:t=real:d=7"\n'
    "variable create variable_name = .swing.nx integer_value = 3\n"
    'variable create variable_name = .swing.word string_value = "end"\n'
)


def markers(text):
    found = parse_view(PENDULUM + text).deck.of(st.Marker).values()
    return {one.name: one.qp for one in found}


@pytest.mark.parametrize(
    ("given", "name", "x"),
    [
        ("n = (eval(.swing.nx))", "Q3", 7.0),
        ("n = (EVAL(.swing.nx + 1)) x = (eval(2 * .swing.nx))", "Q4", 6.0),
        ("n = (eval(.swing.word))", "Qend", 7.0),
        ("n = 5 x = (eval(.swing.nx) * .swing.LENGTH)", "Q5", 1500.0),
        ("n = 6 x = (STR_LENGTH(eval(.swing.word)) + eval(-.swing.nx))", "Q6", 0.0),
    ],
)
def test_arguments_of_macros_are_evaluated_at_the_call(given, name, x):
    found = markers(f"{PLACED}place it {given}\nvariable modify variable_name = .swing.nx integer_value = 9\n")
    assert found[name] == (x, 0.0, 0.0)


LOOP = (
    "marker create marker_name = .swing.ground.A location = 1, 2, 3\n"
    "marker create marker_name = .swing.ground.B location = 4, 5, 6\n"
    "for variable_name = {0} object_names = .swing.ground.A, .swing.ground.B\n"
    '  marker create marker_name = (eval("C_" // {0}.name)) location = {1}\n'
    "end\n"
    "marker modify marker_name = .swing.ground.A location = 10, 20, 30\n"
)


@pytest.mark.parametrize("name", ["o", "$_self.o"])
@pytest.mark.parametrize(
    ("place", "of_a"),
    [
        ("(eval({0}.loc_x)), (eval({0}.location[2])), 0", (1.0, 2.0, 0.0)),
        # alive, it follows the object after the loop
        ("({0}.loc_x), ({0}.location[2]), 0", (10.0, 20.0, 0.0)),
    ],
)
def test_attributes_of_the_objects_of_a_loop(name, place, of_a):
    found = markers("defaults model part_name = .swing.ground\n" + LOOP.format(name, place.format(name)))
    assert found["C_A"] == of_a
    assert found["C_B"] == (4.0, 5.0, 0.0)


def test_an_attribute_that_no_object_has_is_named():
    with pytest.raises(DeckError, match=says(".swing.ground.A", "wingspan")):
        markers(LOOP.format("o", "(eval(o.wingspan)), 0, 0"))
    text = "variable create variable_name = .swing.held object_value = .swing.ROD.TOP\n"
    assert not parse_view(
        PENDULUM + text + "variable create variable_name = .swing.x real_value = (.swing.held.loc_x)\n"
    ).deck.unsupported


SPRING = (
    "force create element_like {} = .swing.S i_part_name = .swing.ROD j_part_name = .swing.ground  &\n"
    "   location = {} {}\n"
)
KINDS = {
    "translational_spring_damper spring_damper_name": "stiffness = 1 damping = 0 displacement_at_preload = 100",
    "bushing bushing_name": "stiffness = 1, 1, 1 damping = 0, 0, 0 tstiffness = 1, 1, 1 tdamping = 0, 0, 0",
}


def test_a_spring_of_parts_has_a_place_for_each_end():
    kind = "translational_spring_damper spring_damper_name"
    deck = parse_view(PENDULUM + SPRING.format(kind, "200, 0, 0, 0, 30, 0", KINDS[kind])).deck
    assert not deck.unsupported
    spring = next(iter(deck.of(st.SpringDamper).values()))
    ends = [deck.of(st.Marker)[one].qp for one in (spring.i, spring.j)]
    assert ends == [(200.0, 0.0, 0.0), (0.0, 30.0, 0.0)]


@pytest.mark.parametrize(
    ("kind", "place", "words"),
    [
        ("bushing bushing_name", "200, 0, 0, 0, 0, 0", ("6", "three")),
        ("translational_spring_damper spring_damper_name", "200, 0, 0, 0", ("4", "six")),
    ],
)
def test_other_numbers_of_places_are_refused(kind, place, words):
    deck = parse_view(PENDULUM + SPRING.format(kind, place, KINDS[kind])).deck
    assert len(deck.unsupported) == 1
    assert all(word in deck.unsupported[0].message for word in words)
    once = parse_view(PENDULUM + SPRING.format(kind, "200, 0, 0", KINDS[kind])).deck
    assert not once.unsupported
