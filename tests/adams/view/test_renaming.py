"""Objects that get another name: what refers to them stays with them, also where the old name is given again."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_view, run_deck
from gearmbs.adams.parse import statements as st
from tests.says import says

from .files import PENDULUM

DRIVE = (
    "force create direct single_component_force single_component_force_name = .swing.DRIVE "
    "type_of_freedom = rotational "
    'action_only = on i_marker_name = .swing.ROD.TOP j_marker_name = PIVOT function = "-5*AZ(.swing.ROD.TOP, PIVOT)"\n'
)


def swung(text: str) -> np.ndarray:
    solution = run_deck(parse_view(text), end=0.2, steps=10, check=False).segments[-1].solution
    (body,) = solution.system.body_names
    return solution.com_position(body)


@pytest.mark.parametrize(
    "change",
    [
        "part modify rigid_body name_and_position part_name = .swing.ROD new_part_name = BAR",
        "marker modify marker_name = .swing.ROD.TOP new_marker_name = .swing.ROD.UP",
        "marker modify marker_name = PIVOT new_marker_name = HERE",
        "part modify rigid_body name_and_position part_name = ground new_part_name = Earth",
        "constraint modify joint revolute joint_name = .swing.HINGE new_joint_name = PIN",
    ],
)
def test_a_model_moves_as_before_under_other_names(change):
    assert np.array_equal(swung(PENDULUM + DRIVE + change + "\n"), swung(PENDULUM + DRIVE))


def test_the_old_name_may_be_given_to_another_part():
    """As programs for drawings write it: the ground gets another name, and a part of theirs is called ground."""
    text = PENDULUM + (
        "part modify rigid_body name_and_position part_name = ground new_part_name = Ground_1\n"
        "part create rigid_body name_and_position part_name = .swing.ground location = 1, 2, 3\n"
        "marker create marker_name = .swing.ground.cm location = 1, 2, 3\n"
        "part create rigid_body mass_properties part_name = .swing.ground mass = 1 ixx = 1 iyy = 1 izz = 1 "
        "center_of_mass_marker = .swing.ground.cm\n"
        "constraint create joint fixed joint_name = .swing.HELD i_marker_name = .swing.ground.cm "
        "j_marker_name = .swing.Ground_1.PIVOT\n"
    )
    view = parse_view(text)
    named = {part.name: part for part in view.deck.of(st.Part).values()}
    assert named["Ground_1"].ground
    assert not named["ground"].ground
    pivot = next(one for one in view.deck.of(st.Marker).values() if one.name == "PIVOT")
    assert pivot.part == named["Ground_1"].id


def test_places_that_follow_an_object_follow_it_under_its_new_name():
    text = PENDULUM + (
        "marker create marker_name = .swing.ground.TIP location = (LOC_RELATIVE_TO({0, 7, 0}, .swing.ROD.cm))\n"
        "part modify rigid_body name_and_position part_name = .swing.ROD new_part_name = BAR location = 0, 20, 0\n"
    )
    views = [parse_view(text), parse_view(text.replace("new_part_name = BAR ", ""))]
    tips = [next(m for m in view.deck.of(st.Marker).values() if m.name == "TIP").qp for view in views]
    assert tips[0] == tips[1]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("marker modify marker_name = .swing.ROD.TOP new_marker_name = .swing.ROD.cm", says("cm", "line")),
        ("marker modify marker_name = .swing.ROD.TOP new_marker_name = .swing.ground.TOP", says("ground", "stays")),
        ("marker modify marker_name = .swing.ROD.TOP new_marker_name = '9'", says("TOP", "stays")),
    ],
)
def test_names_that_cannot_be_given_are_refused(change, told):
    with pytest.raises(DeckError, match=told):
        parse_view(PENDULUM + change + "\n")
