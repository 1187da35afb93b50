"""Wheels and the simplified gear force of ADAMS/Machinery in command files, by what they do."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_view, run_deck
from gearmbs.adams.builders.routines import bound
from gearmbs.adams.parse import statements as st
from tests.says import says

HEAD = """\
model create model_name = m
defaults units length = mm angle = deg force = newton mass = kg time = sec
marker create marker_name = .m.ground.A location = 0, 0, 5
marker create marker_name = .m.ground.B location = 60, 0, 5
"""
WHEEL = """\
ude create instance instance_name = .m.{name} definition_name = .amachinery.udes.ac_am_cylindrical_gear_element &
   location = 0, 0, 0 orientation = 0, 0, 0
variable modify variable_name = .m.{name}.num_teeth integer_value = {teeth}
variable modify variable_name = .m.{name}.module real_value = 2.0
variable modify variable_name = .m.{name}.alfa real_value = 20.0
variable modify variable_name = .m.{name}.beta real_value = 0.0
variable modify variable_name = .m.{name}.width real_value = 10.0
variable modify variable_name = .m.{name}.gear_type string_value = "{kind}"
variable modify variable_name = .m.{name}.involute_def string_value = "standard"
variable modify variable_name = .m.{name}.define_mass_by string_value = "material"
variable modify variable_name = .m.{name}.mass real_value = {mass}
variable modify variable_name = .m.{name}.ixx real_value = {polar}
variable modify variable_name = .m.{name}.iyy real_value = 20.0
variable modify variable_name = .m.{name}.izz real_value = 20.0
variable modify variable_name = .m.{name}.conn_type string_value = "{how}"
variable modify variable_name = .m.{name}.ref_marker object_value = {at}
ude modify instance instance_name = .m.{name}
marker create marker_name = .m.{name}.gear_part.SPOKE location = 0, 0, 5
"""
FORCE = """\
ude create instance instance_name = .m.MESH definition_name = .amachinery.udes.gear_set
ude create instance instance_name = .m.TEETH definition_name = .amachinery.udes.ac_am_simplified_helical_gear_force
variable modify variable_name = .m.TEETH.gear_1 object_value = .m.ONE
variable modify variable_name = .m.TEETH.gear_2 object_value = .m.TWO
variable modify variable_name = .m.TEETH.stiffness_model string_value = "constant"
variable modify variable_name = .m.TEETH.contact_stiffness real_value = 1.0E+05
variable modify variable_name = .m.TEETH.damping_ratio real_value = 1.0E-04
variable modify variable_name = .m.TEETH.sharpness_factor real_value = 1.0E+04
variable modify variable_name = .m.TEETH.backlash_type string_value = "angle"
variable modify variable_name = .m.TEETH.backlash_angle real_value = 0.3
variable modify variable_name = .m.MESH.force_components object_value = .m.MESH.TEETH
"""
DRIVEN = """\
force create direct single_component_force single_component_force_name = .m.DRIVE type_of_freedom = rotational &
   action_only = on i_marker_name = .m.ONE.gear_part.SPOKE j_marker_name = .m.ground.A function = "{drive}"
force create direct single_component_force single_component_force_name = .m.LOAD type_of_freedom = rotational &
   action_only = on i_marker_name = .m.TWO.gear_part.SPOKE j_marker_name = .m.ground.A function = "{load}"
output_control create request request_name = .m.SPEEDS f2 = "WZ(.m.ONE.gear_part.SPOKE)" &
   f3 = "WZ(.m.TWO.gear_part.SPOKE)" f4 = "AZ(.m.TWO.gear_part.SPOKE)" adams_id = 1
"""


def wheels(one="rotational", two="rotational", second="external", more=FORCE) -> str:
    """Return two wheels of 20 and 40 teeth, 60 mm apart or, the second a ring of 40, 20 mm."""
    far = ".m.ground.B" if second == "external" else ".m.ground.C"
    near = "marker create marker_name = .m.ground.C location = 20, 0, 5\n"
    return (
        HEAD + near
        + WHEEL.format(name="ONE", teeth=20, kind="external", mass=0.1, polar=30.0, how=one, at=".m.ground.A")
        + WHEEL.format(name="TWO", teeth=40, kind=second, mass=0.4, polar=35.0, how=two, at=far)
        + more
    )  # fmt: skip


def test_wheels_are_parts_at_their_markers_with_the_odd_moment_about_the_axis():
    view = parse_view(wheels())
    parts = [part for part in view.deck.of(st.Part).values() if not part.ground]
    assert not view.deck.unsupported
    assert [part.mass for part in parts] == [0.1, 0.4]
    assert [part.qg for part in parts] == [(0.0, 0.0, 5.0), (60.0, 0.0, 5.0)]
    assert [tuple(part.ip) for part in parts] == [(20.0, 20.0, 30.0), (20.0, 20.0, 35.0)]
    assert [joint.type for joint in view.deck.of(st.Joint).values()] == ["REVOLUTE", "REVOLUTE"]


def test_stiffness_play_and_damping_of_the_mesh_are_those_of_the_file():
    from gearmbs.adams.write.contacts import pair_of

    (force,) = parse_view(wheels()).deck.of(st.Gforce).values()
    pair = pair_of(force.pair)
    assert pair.contact_ratio * pair.contact.stiffness == pytest.approx(1e8, rel=1e-12)
    assert pair.contact.damping == pytest.approx(1e-4 * pair.contact.stiffness, rel=1e-12)
    assert pair.normal_backlash == pytest.approx(np.radians(0.3) * pair.driver.base_radius, rel=1e-12)
    assert pair.driver.base_radius == pytest.approx(0.02 * np.cos(np.radians(20.0)), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kept", [False, True], ids=["as it is", "as a deck"])
def test_wheels_turn_by_their_ratio_with_the_force_of_their_torque(kept):
    """The torque at rest grows with the speed until it is the load's: mean speeds and forces by statics."""
    text = wheels() + DRIVEN.format(drive="2000 - 20*WZ(.m.ONE.gear_part.SPOKE)", load="3000")
    view = parse_view(text)
    model = parse_deck(view.text) if kept else view.deck
    result = run_deck(model, end=0.1, steps=400, check=False)
    assert result.success
    speeds = result.request(1)[300:]
    assert speeds[:, 2].mean() / speeds[:, 1].mean() == pytest.approx(-0.5, rel=5e-3)
    (force,) = model.of(st.Gforce)
    across = np.hypot(*result.force("gforce", force)[300:, :2].T).mean()
    assert across == pytest.approx(3.0 / (0.04 * np.cos(np.radians(20.0))), rel=0.03)


@pytest.mark.slow
def test_the_play_of_a_mesh_is_the_angle_of_its_first_wheel():
    """The first wheel is held; the second turns by half of the play each way, over the ratio."""
    push = "100*(STEP(TIME,0,0,0.01,1) - 2*STEP(TIME,0.1,0,0.11,1)) - 200*WZ(.m.TWO.gear_part.SPOKE)"
    text = wheels(one="fixed") + DRIVEN.format(drive="0", load=push)
    angle = run_deck(parse_view(text), end=0.2, steps=40, check=False).request(1)[:, 3]
    assert angle[19] - angle[-1] == pytest.approx(np.radians(0.3) / 2.0, rel=0.02)
    assert angle[19] == pytest.approx(-angle[-1], rel=0.02)


@pytest.mark.slow
def test_a_ring_turns_the_same_way():
    ring = wheels(second="internal") + "variable modify variable_name = .m.TWO.addendum_factor real_value = 0.8\n"
    text = ring + DRIVEN.format(drive="2000 - 20*WZ(.m.ONE.gear_part.SPOKE)", load="-3000")
    speeds = run_deck(parse_view(text), end=0.1, steps=400, check=False).request(1)[300:]
    assert speeds[:, 2].mean() / speeds[:, 1].mean() == pytest.approx(0.5, rel=5e-3)


def test_what_a_set_lists_has_a_name_through_it():
    text = wheels() + "marker create marker_name = .m.ground.D location = (.m.MESH.TEETH.contact_stiffness), 0, 0\n"
    marker = next(one for one in parse_view(text).deck.of(st.Marker).values() if one.name == "D")
    assert marker.qp == (1e5, 0.0, 0.0)


def test_a_wheel_on_springs_has_a_bushing_and_one_without_stands_free():
    soft = "".join(
        f"variable modify variable_name = .m.ONE.{name} real_value = {k}, 2.0, 3.0\n"
        for k, name in enumerate(
            ("compliant_stiffness", "compliant_tstiffness", "compliant_damping", "compliant_tdamping"), 1
        )
    )
    (bushing,) = parse_view(wheels(one="compliant", two="compliant", more=soft)).deck.of(st.Bushing).values()
    assert bushing.k == (1.0, 2.0, 3.0)
    assert bushing.kt == pytest.approx(np.array([2.0, 2.0, 3.0]) / np.radians(1.0), rel=1e-12)
    assert not parse_view(wheels(one="none", two="compliant")).deck.of(st.Joint)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('string_value = "constant"', 'string_value = "calculated"', says("stiffness_model", "calculated", "constant")),
        ('string_value = "rotational"', 'string_value = "glued"', says("conn_type", "glued", "rotational")),
        (
            "contact_stiffness real_value = 1.0E+05",
            "contact_stiffness real_value = -1",
            says("contact_stiffness", "-1"),
        ),
        ("num_teeth integer_value = 20", "num_teeth integer_value = 2", says("teeth", "Python")),
        ("TEETH.gear_2 object_value = .m.TWO", "TEETH.gear_2 object_value = .m.MESH", says("gear_2")),
        ("simplified_helical_gear_force", "worm_gear_force", says("ac_am_worm_gear_force")),
    ],
)
def test_what_is_not_modelled_of_gears_is_named(old, new, told):
    text = wheels()
    assert old in text
    with pytest.raises(DeckError, match=told):
        run_deck(parse_view(text.replace(old, new)), end=1e-4, steps=1, check=False)


def test_wheels_too_far_apart_are_refused():
    text = wheels().replace("location = 60, 0, 5", "location = 61, 0, 5")
    with pytest.raises(DeckError, match=says("61 mm", "60 mm")):
        run_deck(parse_view(text), end=1e-4, steps=1, check=False)


def test_wheels_that_have_no_face_in_common_are_refused():
    """Along the axes the program has both wheels where the first one is."""
    text = wheels().replace("location = 60, 0, 5", "location = 60, 0, {}")
    with pytest.raises(DeckError, match=says("30 mm", "ref_marker")):
        run_deck(parse_view(text.format(35)), end=1e-4, steps=1, check=False)
    assert run_deck(parse_view(text.format(15)), end=1e-4, steps=1, check=False).success


def test_what_the_pair_warns_of_is_a_remark_at_its_line():
    """Not a warning of Python, from a line that the user did not write; stiffer teeth have none."""
    text = wheels().replace("contact_stiffness real_value = 1.0E+05", "contact_stiffness real_value = 100")
    at = 1 + text[: text.index("instance_name = .m.TEETH")].count("\n")

    def fouling(diagnostics):
        return [d.line for d in diagnostics if "foul" in d.message]

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        view, deck = parse_view(text), parse_deck(parse_view(text).text)
        assert not fouling(parse_view(wheels()).deck.diagnostics)
        assert fouling(view.deck.diagnostics) == [at]
        assert fouling(bound(view.deck).diagnostics) == [at]
        assert fouling(bound(deck).diagnostics) == [next(iter(deck.of(st.Gforce).values())).line]
