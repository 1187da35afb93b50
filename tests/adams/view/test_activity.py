"""What is handed to the solver: groups, parts that are off with what needs them, dependents. The body: 2 kg, 20 N."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_view, run_deck
from gearmbs.adams.parse import statements as st
from tests.says import says

from .test_runs import MODEL, OFF, ON, ONE, RESET, RUN, ends

GROUP = "group {} group_name = .m.G {}\n"
CREATED = GROUP.format("create", "objects_in_group = .m.SF")
OTHER_GROUP = "group create group_name = .m.H objects_in_group = .m.SF\n"
OTHER_ON = "group attributes group_name = .m.H active = on\n"
SWITCHED = GROUP.format("attributes", "active = {}")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (CREATED, 5.0),
        (CREATED + SWITCHED.format("off"), 0.0),
        (CREATED + SWITCHED.format("off") + SWITCHED.format("on"), 5.0),
        (CREATED + SWITCHED.format("off") + SWITCHED.format("no_opinion"), 0.0),
        (CREATED + SWITCHED.format("no_opinion"), 5.0),
        (GROUP.format("create", "objects_in_group = .m.SF expr_active = 0"), 0.0),
        (GROUP.format("create", "objects_in_group = .m.SF expr_active = 1"), 5.0),
        (GROUP.format("create", "objects_in_group = .m.S* type_filter = force") + SWITCHED.format("off"), 0.0),
        (GROUP.format("create", "objects_in_group = .m.S* type_filter = marker") + SWITCHED.format("off"), 5.0),
        (GROUP.format("create", "objects_in_group = .m.P") + GROUP.format("modify", "objects_in_group = .m.SF")
         + SWITCHED.format("off"), 0.0),
        (CREATED + GROUP.format("modify", "expr_active = 0"), 0.0),
        (CREATED + GROUP.format("modify", "expr_active = 0") + SWITCHED.format("on"), 5.0),
        # of a group in a group
        (CREATED + "group create group_name = .m.H objects_in_group = .m.G expand_groups = yes\n"
         "group attributes group_name = .m.H active = off\n", 0.0),
        # by an expression, which stays alive
        (GROUP.format("create", "objects_in_group = .m.SF expr_active = (.m.PULL > 30)"), 0.0),
        (OFF + CREATED, 0.0),
        (CREATED + OTHER_GROUP + SWITCHED.format("off"), 0.0),
        (CREATED + OTHER_GROUP + OTHER_ON + SWITCHED.format("off"), 0.0),
        (GROUP.format("create", "objects_in_group = .m.NONE"), 5.0),
    ],
)  # fmt: skip
def test_groups_switch_their_objects(text, place):
    assert np.isclose(ends(MODEL + text + ONE)[-1], place, rtol=1e-6, atol=1e-12)


def test_a_group_by_an_expression_follows_its_variable():
    group = GROUP.format("create", "objects_in_group = .m.SF expr_active = (.m.PULL > 30)")
    pull = "variable modify variable_name = .m.PULL real_value = {}\n"
    text = MODEL + group + ONE + pull.format(40) + RUN.format(2) + RESET + ONE
    assert np.allclose(ends(text, "Run_1"), [0.0, 10.0], rtol=1e-6, atol=1e-12)
    assert np.allclose(ends(text), [10.0], rtol=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CREATED + SWITCHED.format("off") + ON, ("switched on after", ".m.SF", "G")),
        (CREATED + OFF + SWITCHED.format("on"), ("after .m.SF", "G")),
        (CREATED + OTHER_GROUP + SWITCHED.format("off") + OTHER_ON, (".m.SF", ".m.H", "one of them")),
        (GROUP.format("create", "objects_in_group = .m.NONE") + SWITCHED.format("off"), ("no .m.NONE",)),
        (CREATED + SWITCHED.format("perhaps"), ("active", "perhaps", "no_opinion")),
    ],
)
def test_what_a_group_does_is_not_guessed(text, words):
    with pytest.raises(DeckError, match=says(*words)):
        run_deck(parse_view(MODEL + text + ONE))


JOINTED = """\
part create rigid_body name_and_position part_name = .m.Q location = 1, 0, 0
marker create marker_name = .m.Q.cm location = 1, 0, 0
part create rigid_body mass_properties part_name = .m.Q mass = 2  &
   center_of_mass_marker = .m.Q.cm ixx = 1 iyy = 1 izz = 1
marker create marker_name = .m.P.at_q location = 1, 0, 0
constraint create joint fixed joint_name = .m.J i_marker_name = .m.Q.cm j_marker_name = .m.P.at_q
"""
HINGED = JOINTED.replace("joint fixed", "joint revolute") + (
    "constraint create motion_generator motion_name = .m.MO joint_name = .m.J type_of_freedom = rotational  &\n"
    '   function = "time"\n'
)


@pytest.mark.parametrize(
    ("switched", "place"),
    [
        ("", 2.5),
        ("constraint attributes constraint_name = .m.J active = off\n", 5.0),
        ("part attributes part_name = .m.Q active = off\n", 5.0),
        ("marker attributes marker_name = .m.P.at_q active = off\n", 5.0),
        ("entity attributes entity_name = .m.Q active = off\n", 5.0),
        ("part attributes part_name = .m.Q active = off dependents_active = off\n", 5.0),
        (GROUP.format("create", "objects_in_group = .m.Q") + SWITCHED.format("off"), 5.0),
    ],
)
def test_a_joint_is_off_with_its_part_or_marker(switched, place):
    assert np.isclose(ends(MODEL + JOINTED + switched + ONE)[-1], place, rtol=1e-6)


def test_a_motion_is_off_with_its_joint():
    off = "constraint attributes constraint_name = .m.J active = off\n"
    view = parse_view(MODEL + HINGED + off + ONE)
    assert not view.deck.of(st.Motion)
    assert any("MO" in one.message and ".m.J" in one.message for one in view.deck.diagnostics)
    assert np.isclose(ends(MODEL + HINGED + off + ONE)[-1], 5.0, rtol=1e-6)
    assert parse_view(MODEL + HINGED + ONE).deck.of(st.Motion)


def test_a_joint_is_switched_off_between_two_simulations():
    off = "constraint attributes constraint_name = .m.J active = off\n"
    half = RUN.format(0.5)
    # 5 m/s^2 together, then 10 m/s^2 alone, from 2.5 m/s
    assert np.allclose(ends(MODEL + JOINTED + half + off + ONE), [0.625, 0.625 + 1.25 + 1.25], rtol=1e-6)
    with_motion = parse_view(MODEL + HINGED + half + off + ONE).script
    assert [one.text for one in with_motion][1:3] == ["DEACTIVATE/JOINT, ID=1", "DEACTIVATE/MOTION, ID=1"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("dependents_active = off", ("dependents_active", "active as well")),
        ("active = on dependents_active = off", ("dependents_active", "active as well")),
    ],
)
def test_dependents_alone_are_named(given, words):
    with pytest.raises(DeckError, match=says(*words)):
        parse_view(MODEL + JOINTED + f"part attributes part_name = .m.Q {given}\n")


def test_dependents_that_are_off_themselves_are_named():
    both = "{}marker attributes marker_name = .m.Q.cm active = on dependents_active = on\n"
    assert parse_view(MODEL + JOINTED + both.format("")).deck.of(st.Joint)
    with pytest.raises(DeckError, match=says(".m.J", "off itself")):
        parse_view(MODEL + JOINTED + both.format("constraint attributes constraint_name = .m.J active = off\n"))


BALLS = """\
geometry create shape ellipsoid ellipsoid_name = .m.P.B center_marker = .m.P.cm  &
   x_scale_factor = 2 y_scale_factor = 2 z_scale_factor = 2
marker create marker_name = .m.ground.C location = 3, 0, 0
geometry create shape ellipsoid ellipsoid_name = .m.ground.B center_marker = .m.ground.C  &
   x_scale_factor = 2 y_scale_factor = 2 z_scale_factor = 2
contact create contact_name = .m.C i_geometry_name = .m.P.B j_geometry_name = .m.ground.B  &
   stiffness = 1e6 damping = 1 exponent = 1.5 dmax = 0.01
"""


def test_a_contact_is_off_with_its_solid():
    off = "geometry attributes geometry_name = .m.ground.B active = off\n"
    assert parse_view(MODEL + BALLS).deck.of(st.Contact)
    assert not parse_view(MODEL + BALLS + off).deck.of(st.Contact)
    # of 1 m between the balls and 5 m in a second without contact
    assert np.isclose(ends(MODEL + BALLS + off + ONE)[-1], 5.0, rtol=1e-6)
    assert ends(MODEL + BALLS + ONE)[-1] < 1.1


def test_solids_that_are_off_have_no_mass():
    block = "geometry create shape block block_name = .m.P.{} corner_marker = .m.P.cm diag_corner_coords = 1, 1, {}\n"
    heavy = "part modify rigid_body mass_properties part_name = .m.P density = 2\n"
    group = GROUP.format("create", "objects_in_group = .m.P.TWO expr_active = {}")
    text = MODEL + block.format("ONE", 1) + block.format("TWO", 2) + heavy
    for active, mass in ((1, 6.0), (0, 2.0)):
        part = next(one for one in parse_view(text + group.format(active)).deck.of(st.Part).values() if not one.ground)
        assert part.mass == pytest.approx(mass)
