"""Arguments ``no_X`` take back what X gave, in each command that has both."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_view, run_deck
from gearmbs.adams.view.interpreter import Interpreter
from gearmbs.adams.view.vocabulary import ROWS

from ...says import says
from .files import PENDULUM

PAIRS = [
    (row, name)
    for row in ROWS
    for name in row.arguments
    if name.startswith("no_") and name[3:] in row.arguments and row.verb == "modify"
]


def test_every_no_is_of_an_argument_or_known():
    others = {
        name for row in ROWS for name in row.arguments if name.startswith("no_") and name[3:] not in row.arguments
    }
    assert others == {"no_friction"}
    assert len(PAIRS) > 20


@pytest.mark.parametrize(("row", "name"), PAIRS, ids=lambda one: one if isinstance(one, str) else "_".join(one.words))
@pytest.mark.parametrize(("word", "left"), [("true", False), ("yes", False), ("false", True), ("no", True)])
def test_what_is_taken_back_is_gone(row, name, word, left):
    run = Interpreter()
    run.run("model create model_name = m\n")
    item = run.database.add(row.kind, ".m.ONE", 1)
    command = f"{' '.join(row.words)} {row.naming} = .m.ONE"
    run.run(f"{command} {name[3:]} = 1\n")
    assert name[3:] in item.fields
    run.run(f"{command} {name} = {word}\n")
    assert not run.errors
    assert (name[3:] in item.fields) == left
    assert name not in item.fields


def test_what_is_given_and_taken_back_at_once_is_refused():
    wrong = "part modify rigid_body initial_velocity part_name = .swing.ROD vx = 1 no_vx = true\n"
    with pytest.raises(DeckError, match=says("vx", "no_vx")):
        parse_view(PENDULUM + wrong)


FREE = (
    "model create model_name = m\n"
    "part create rigid_body name_and_position part_name = .m.P location = 0, 0, 0\n"
    "marker create marker_name = .m.P.cm location = 0, 0, 0\n"
    "part create rigid_body mass_properties part_name = .m.P mass = 2 center_of_mass_marker = .m.P.cm  &\n"
    "   ixx = 1000 iyy = 1000 izz = 1000\n"
    "marker create marker_name = .m.ground.X location = 0, 0, 0 orientation = 90, 90, 0\n"
    "marker create marker_name = .m.P.X location = 0, 0, 0 orientation = 90, 90, 0\n"
)
SLIDE = "constraint {} joint translational joint_name = .m.J {}\n"
ENDS = "i_marker_name = .m.P.X j_marker_name = .m.ground.X velocity_ic = 5"
SPEED = "part {} rigid_body initial_velocity part_name = .m.P {}\n"


@pytest.mark.parametrize(
    ("commands", "x"),
    [
        (SPEED.format("create", "vx = 5"), 5.0),
        (SPEED.format("create", "vx = 5") + SPEED.format("modify", "no_vx = true"), 0.0),
        (SLIDE.format("create", ENDS), 5.0),
        (SLIDE.format("create", ENDS) + SLIDE.format("modify", "no_velocity_ic = true"), 0.0),
    ],
)
def test_a_part_moves_by_what_is_left(commands, x):
    solution = run_deck(parse_view(FREE + commands).deck, end=1.0, steps=1, check=False).segments[-1].solution
    assert np.isclose(1e3 * solution.com_position("P")[-1, 0], x, rtol=0, atol=1e-6)
