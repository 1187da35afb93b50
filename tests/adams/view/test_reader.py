"""Command files of View become decks: objects, expressions that View evaluates, loops, simulations, variables."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gearmbs.adams import DeckError, parse_deck, parse_script, parse_view, read_deck, read_view, run_deck
from gearmbs.adams.builders.builder import marker_orientation
from gearmbs.adams.parse import statements as st
from gearmbs.adams.view.interpreter import Interpreter

from ...says import says
from .files import CHAIN, PENDULUM, WHOLE

TORQUE = (
    "force create direct single_component_force single_component_force_name = .swing.DRIVE  &\n"
    "   type_of_freedom = rotational  &\n"
    '   i_marker_name = .swing.ROD.TOP j_marker_name = .swing.ground.PIVOT action_only = off function = "{}"\n'
)


def by_name(view, kind, name):
    return next(one for one in view.deck.of(kind).values() if one.name == name)


def test_a_pendulum_is_read():
    view = parse_view(PENDULUM)
    assert view.name == "swing"
    assert view.deck.units.length == 1e-3
    rod = by_name(view, st.Part, "ROD")
    assert (rod.id, rod.mass, rod.ip) == (2, 2.0, (100.0, 100.0, 100.0))
    centre = by_name(view, st.Marker, "cm")
    assert np.allclose(centre.qp, (250.0, -500.0 * np.cos(np.pi / 6), 0.0), rtol=0, atol=1e-12)
    assert view.deck.of(st.Marker)[11].name == "PIVOT"
    assert view.variables == {".swing.LENGTH": 500.0, ".swing.TILT": 30.0}
    assert [command.end for command in view.script] == [0.2]
    assert rod.line == 7


def test_variables_are_factors():
    view = parse_view(PENDULUM, variables={"LENGTH": 300.0, ".swing.TILT": 90.0})
    assert np.allclose(by_name(view, st.Marker, "cm").qp, (300.0, 0.0, 0.0), rtol=0, atol=1e-12)
    with pytest.raises(DeckError, match=says("nothing", "variable")):
        parse_view(PENDULUM, variables={"nothing": 1.0})


def test_loops_and_conditions_build_a_chain():
    view = parse_view(CHAIN)
    parts = [part for part in view.deck.of(st.Part).values() if not part.ground]
    assert [part.mass for part in parts] == [0.5, 1.0, 1.5, 2.0]
    assert [part.qg for part in parts] == [(float(k), 0.0, 0.0) for k in range(4)]
    assert len(view.deck.of(st.Joint)) == 4
    assert by_name(view, st.Marker, "end").qp == (1.0, 0.0, 0.0)


def test_all_kinds_are_read_and_written_as_a_deck():
    view = parse_view(WHOLE)
    again = parse_deck(view.text)
    assert not view.deck.unsupported
    for statement in view.deck:
        other = again.items[type(statement)][statement.id]
        assert other.name == statement.name
        for name in statement.given:
            assert np.all(getattr(other, name) == getattr(statement, name)), (statement.label(), name)
    assert len(list(again)) == len(list(view.deck)) > 25


def test_units_of_angle_become_radians():
    view = parse_view(WHOLE)
    bushing = view.deck.of(st.Bushing)[1]
    assert np.allclose(bushing.kt, np.degrees([1.0, 2.0, 3.0]))
    assert np.isclose(by_name(view, st.Part, "B").wz, np.pi / 2)
    assert np.isclose(by_name(view, st.Joint, "J1").icrot[1], np.radians(10.0))
    radians = parse_view(WHOLE.replace("angle = deg", "angle = rad").replace("0, 45, 0", "0, 45d, 0"))
    assert radians.deck.of(st.Bushing)[1].kt == (1.0, 2.0, 3.0)


def test_names_in_expressions_become_ids_and_values():
    view = parse_view(WHOLE)
    force = view.deck.of(st.Sforce)[1]
    i, j = force.i, force.j
    measure = by_name(view, st.Variable, "ME").id
    variable = by_name(view, st.Variable, "V")
    assert force.function.replace(" ", "") == f"STEP(time,0,0,1,(3.5))*DM({i},{j})+VARVAL({variable.id})"
    assert variable.function.replace(" ", "") == f"AKISPL(time,0,1,0)+VARVAL({measure})"
    assert by_name(view, st.Variable, "ME").function.startswith("RTOD * AZ(")


def test_a_file_runs_its_own_simulation(tmp_path):
    path = tmp_path / "swing.cmd"
    path.write_text(PENDULUM)
    result = run_deck(path)
    assert result.success
    height = result.to_dataset().request_1.sel(request_1_column="F2").values
    # a physical pendulum from thirty degrees, solved for itself
    inertia = 2.0 * 0.5**2 + 100e-6
    swing = solve_ivp(
        lambda t, y: (y[1], -2.0 * 9.80665 * 0.5 * np.sin(y[0]) / inertia), (0, 0.2), (np.pi / 6, 0.0), rtol=1e-11
    )
    assert np.isclose(height[-1], -500.0 * np.cos(swing.y[0, -1]), rtol=1e-6)


def test_files_are_written_as_decks(tmp_path):
    path = tmp_path / "swing.cmd"
    path.write_text(PENDULUM)
    files = read_view(path).save(tmp_path / "deck.adm")
    assert [one.name for one in files] == ["deck.adm", "deck_Last_Sim.acf"]
    assert read_deck(files[0]).of(st.Joint).keys() == read_deck(path).of(st.Joint).keys()
    assert parse_script(files[1].read_text()).commands[0].steps == 20


@pytest.mark.parametrize("door", [parse_deck, parse_script])
def test_other_doors_say_what_it_is(door):
    with pytest.raises(DeckError, match=says("View", "read_view", "cmd")):
        door(PENDULUM)


BROKEN = {
    "marker creat marker_name": ("marker", "known", "create"),
    "marker create marker_nam = .swing.ROD.M colour = red": ("colour",),
    "part create rigid_body name_and_position part_name = .other.P": (".other", "no"),
    "marker create marker_name = .swing.ROD.M location = 1, 2": ("location", "three"),
    "marker create marker_name = .swing.ROD.M location = (1 +), 2, 3": ("1 +",),
    "marker create marker_name = .swing.ROD.M location = 0, 0, (1 / 0)": ("zero",),
    "marker create marker_name = .swing.ROD.M relative_to = .swing.nowhere": ("nowhere",),
    "marker create marker_name = .swing.ROD.TOP": ("TOP", "already"),
    "variable modify variable_name = .swing.none real_value = 3": ("none",),
    "if condition = (1)": ("end", "if"),
    "end": ("end",),
    "marker create marker_name = 'x": ("quotation",),
    "marker create marker_name = (x": ("bracket",),
    "defaults units length = furlong": ("furlong", "MILLIMETER"),
    "file command read file_name = ../../x.cmd": ("folder",),
    "while condition = (1)\nvariable set variable_name = .swing.q real_value = 1\nend": ("loop",),
    "defaults units length = meter": ("length", "changed"),
}


@pytest.mark.parametrize("line", BROKEN)
@pytest.mark.slow
def test_errors_have_a_line_and_a_reason(line):
    with pytest.raises(DeckError, match=says(*BROKEN[line])) as caught:
        parse_view(PENDULUM + line + "\n", "swing.cmd")
    assert all(d.file == "swing.cmd" and d.line >= 0 for d in caught.value.diagnostics)


LEFT_OUT = {
    "force create direct multi_point_force multi_point_force_name = .swing.N i_marker_name = .swing.ROD.TOP": "beams",
    "ude create instance instance_name = .swing.T definition_name = .MDI.Forces.vpg_belt": "vpg_belt",
    "ude create instance instance_name = .swing.T definition_name = .MDI.Forces.vpg_tire": "wheel_tire_mass",
    "contact create contact_name = .swing.C i_geometry_name = .swing.ROD.BOB j_geometry_name = .swing.ground.NONE  &\n"
    " stiffness = 1 damping = 1 exponent = 1 dmax = 1": "NONE",
    "constraint create primitive_joint point_point jprim_name = .swing.P i_marker_name = .swing.ROD.TOP  &\n"
    " j_marker_name = .swing.ground.PIVOT": "general_constraint",
}


@pytest.mark.parametrize("line", LEFT_OUT)
def test_what_moves_is_never_left_out_in_silence(line):
    deck = parse_view(PENDULUM + line + "\n").deck
    assert len(deck.unsupported) == 1
    assert LEFT_OUT[line] in deck.unsupported[0].message
    with pytest.raises(DeckError, match=says(LEFT_OUT[line], "skip-unsupported")):
        run_deck(deck, end=0.01, steps=1)


def test_results_that_are_not_made_are_remarked():
    deck = parse_view(PENDULUM + "measure create range measure_name = .swing.R of_measure_name = .swing.HEIGHT\n").deck
    assert not deck.unsupported
    assert any("left out" in str(d) for d in deck.diagnostics)


BLOCKS = """
ude create instance instance_name = .swing.{0} definition_name = .MDI.Acontrols.controls_{1}
variable modify variable_name = .swing.{0}.input_obj object_value = {2}
"""


def gained(block, **gains):
    lines = "variable modify variable_name = .swing.{}.{} real_value = {}\n"
    return "".join(lines.format(block, name, value) for name, value in gains.items())


def controlled(pid_of=".swing.SUM, .swing.AMP"):
    text = PENDULUM
    for block, function in (("WANTED", "0.5"), ("IS", "TIME")):
        text += f"ude create instance instance_name = .swing.{block} definition_name = .MDI.Acontrols.controls_input\n"
        text += f'data_element modify variable variable_name = .swing.{block}.{block}_input function = "{function}"\n'
    text += BLOCKS.format("SUM", "sum", ".swing.WANTED, .swing.IS") + gained("SUM", gain1=1.0, gain2=-1.0)
    text += BLOCKS.format("AMP", "gain", ".swing.SUM") + gained("AMP", gain=7.0)
    text += BLOCKS.format("PID", "pid", pid_of)
    return text + gained("PID", p_gain=3.0, i_gain=2.0, d_gain=0.25, initial_condition=0.1)


def test_blocks_of_controls_are_what_view_exports():
    view = parse_view(controlled())
    names = ("WANTED_input", "IS_input", "SUM_input1", "SUM_input2", "SUM", "AMP_input", "AMP", "PID_input", "PID")
    ids = {by_name(view, st.Variable, name).id: name for name in names}
    state = by_name(view, st.Diff, "PID_sys")
    assert state.ic == (0.1,)
    assert "VARVAL" in state.function.upper()
    assert ids[int(re.search(r"\d+", by_name(view, st.Variable, "AMP_input").function)[0])] == "SUM"
    result = run_deck(parse_view(controlled() + MEASURED).deck, end=1.0, steps=4)
    t, out = result.t, result.request(1)[:, 1]
    error, integral = 0.5 - t, 0.1 + 0.5 * t - t**2 / 2
    np.testing.assert_allclose(out, 3 * error + 2 * integral + 0.25 * 7 * error, atol=1e-6)


MEASURED = (
    "output_control create request request_name = .swing.OUT adams_id = 1 f2 = VARVAL(.swing.PID.PID) f3 = 0 f4 = 0\n"
)


@pytest.mark.parametrize("source", [".swing.SUM", ".swing.SUM, .swing.ROD"])
def test_blocks_of_controls_without_their_inputs_are_refused(source):
    deck = parse_view(controlled(source)).deck
    assert len(deck.unsupported) == 1
    assert re.search(says(".swing.PID", "input_obj"), deck.unsupported[0].message)


@pytest.mark.parametrize(
    ("given", "icdisp"), [("rotational_displacement_ic = 90", np.pi / 2), ("displacement_ic = 0", None)]
)
def test_a_motion_by_velocity_starts_where_it_says(given, icdisp):
    motion = "constraint create motion_generator motion_name = .swing.M joint_name = .swing.HINGE  &\n"
    text = PENDULUM + motion + f'   type_of_freedom = rotational time_derivative = velocity {given} function = "1"\n'
    assert by_name(parse_view(text), st.Motion, "M").icdisp == icdisp
    deck = parse_view(text.replace(given, "displacement_ic = 90")).deck
    assert re.search(says(".swing.M", "displacement_ic"), deck.unsupported[0].message)


MEASURE = (
    "measure create object measure_name = .swing.SEEN object = .swing.{} characteristic = {} {}  &\n"
    "   component = z_component\n"
)


@pytest.mark.parametrize(
    ("of", "characteristic", "how", "expected"),
    [
        ("HINGE", "ax_ay_az_projection_angles", "from_first = yes", "RTOD * AZ({1}, {0})"),
        ("HINGE", "ax_ay_az_projection_angles", "from_first = no", "RTOD * AZ({0}, {1})"),
        ("HINGE", "angular_velocity", "from_first = no coordinate_rframe = .swing.ROD.cm", "RTOD * WZ({0}, {1}, {2})"),
        ("HINGE", "translational_velocity", "from_first = yes motion_rframe = .swing.ground.PIVOT", "VZ({1}, {0})"),
        ("HINGE", "element_torque", "from_first = yes", "JOINT({3}, 0, 8, 0)"),
        ("HINGE", "element_torque", "from_first = no", "JOINT({3}, 1, 8, 0)"),
        ("ROD", "cm_velocity", "from_first = yes", "VZ({2})"),
        ("ROD", "cm_acceleration", "coordinate_rframe = .swing.ROD.TOP", "ACCZ({2}, 0, {0})"),
    ],
)
def test_measures_of_objects_are_those_of_exported_decks(of, characteristic, how, expected):
    """From the first marker View gives the second one's motion seen from the first."""
    view = parse_view(PENDULUM + MEASURE.format(of, characteristic, how))
    ids = [by_name(view, st.Marker, name).id for name in ("TOP", "PIVOT", "cm")]
    ids.append(by_name(view, st.Joint, "HINGE").id)
    assert by_name(view, st.Variable, "SEEN").function == expected.format(*ids)


@pytest.mark.parametrize(
    ("how", "why"),
    [("from_first = yes motion_rframe = .swing.ROD.cm", "not computed"), ("", "from_first is missing")],
    ids=["seen from a frame that moves", "without a sign"],
)
def test_measures_whose_meaning_no_public_model_shows_are_left_out(how, why):
    text = PENDULUM + MEASURE.format("HINGE", "angular_velocity", how)
    deck = parse_view(text).deck
    assert any("SEEN" in str(d) and why in str(d) and "left out" in str(d) for d in deck.diagnostics)
    assert not deck.unsupported
    assert parse_view(text + TORQUE.format("-.swing.SEEN")).deck.unsupported


def test_inactive_objects_are_not_there():
    deck = parse_view(PENDULUM + "constraint attributes constraint_name = .swing.HINGE active = off\n").deck
    assert not deck.of(st.Joint)


def test_words_may_be_shortened():
    short = PENDULUM.replace("marker create marker_name", "mar cre mark").replace(
        "constraint create joint revolute", "cons cre joi rev"
    )
    assert parse_view(short).deck.of(st.Marker).keys() == parse_view(PENDULUM).deck.of(st.Marker).keys()


@pytest.mark.parametrize(
    ("units", "refused"), [("angle", True), ('"angle"', True), ("no_units", False), ("length", False)]
)
def test_angles_of_view_in_functions_of_the_solver_are_refused(units, refused):
    turned = f"variable create variable_name = .swing.TURN units = {units} real_value = 30\n"
    found = parse_view(PENDULUM + turned + TORQUE.format("DTOR * .swing.TURN")).deck
    messages = [d.message for d in found.unsupported]
    assert bool(messages) == refused
    assert not refused or re.search(says(".swing.TURN", "30", "no_units", "DTOR"), messages[0])
    place = "marker create marker_name = .swing.ROD.M location = 0, 0, 0 orientation = (.swing.TURN), 0, 0\n"
    assert not parse_view(PENDULUM + turned + place).deck.unsupported


def test_macros_are_carried_out():
    macro = (
        'macro create macro_name = .swing.ball user_entered_command = "make ball" commands =  &\n'
        '  "marker create marker_name = .swing.ROD.$name location = 0, $height, 0",  &\n'
        '  "!$name:t=string", "!$height:t=real:d=7"\n'
        "make ball name = B1\nmake ball name = B2 height = (3 * 4)\n"
    )
    view = parse_view(PENDULUM + macro)
    assert [by_name(view, st.Marker, name).qp[1] for name in ("B1", "B2")] == [7.0, 12.0]


def test_files_beside_are_read(tmp_path):
    (tmp_path / "inner.cmd").write_text("marker create marker_name = .swing.ROD.INNER location = 1, 2, 3\n")
    (tmp_path / "outer.cmd").write_text(PENDULUM + "file command read file_name = inner.cmd\n")
    assert by_name(read_view(tmp_path / "outer.cmd"), st.Marker, "INNER").qp == (1.0, 2.0, 3.0)
    with pytest.raises(DeckError, match=says("inner.cmd", "folder")):
        parse_view(PENDULUM + "file command read file_name = inner.cmd\n")


@pytest.mark.parametrize(
    ("type_", "count"), [("joint", 2), ("constraint", 3), ("revolute", 2), ("motion", 1), ("force", 1), ("point", 0)]
)
def test_loops_over_objects_of_a_type(type_, count):
    """Types are kinds of objects, or what View calls several kinds; one that is not known is no empty loop."""
    text = PENDULUM + (
        "constraint create joint revolute joint_name = .swing.SECOND i_marker_name = .swing.ROD.cm &\n"
        "   j_marker_name = .swing.ground.PIVOT\n"
        "constraint create motion_generator motion_name = .swing.MO joint_name = .swing.HINGE &\n"
        '   type_of_freedom = rotational function = "0"\n'
        "variable create variable_name = .swing.n integer_value = 0\n"
        f"for variable_name = one object_names = .swing.* type = {type_}\n"
        "variable modify variable_name = .swing.n integer_value = (eval(.swing.n + 1))\nend\n"
    )
    run = Interpreter()
    run.run(text)
    assert not run.errors
    assert run.values.variable(run.database.find(".swing.n")) == count
    run = Interpreter()
    run.run(text.replace(f"type = {type_}", "type = hinges"))
    assert re.search(says("hinges"), str(run.errors[0]))


def coupled(scales):
    """Return the scales of a coupler of the pendulum's hinge with a slide."""
    text = PENDULUM + (
        "part create rigid_body name_and_position part_name = .swing.RACK location = 0, 0, 0\n"
        "part create rigid_body mass_properties part_name = .swing.RACK mass = 1 ixx = 1 iyy = 1 izz = 1\n"
        "marker create marker_name = .swing.RACK.M location = 0, 0, 0\n"
        "constraint create joint translational joint_name = .swing.SLIDE i_marker_name = .swing.RACK.M &\n"
        "   j_marker_name = .swing.ground.PIVOT\n"
        "constraint create complex_joint coupler coupler_name = .swing.CO joint_name = .swing.HINGE, .swing.SLIDE &\n"
        f"   type_of_freedom = rot_trans {scales}\n"
    )
    view = parse_view(text)
    assert any(re.search(says("RACK", "center_of_mass_marker"), d.message) for d in view.deck.diagnostics)
    return [one.scales for one in view.deck.of(st.Coupler).values()], view.deck.unsupported


def test_scales_of_couplers():
    """Angular scale factors are angles in the model's unit, multipliers are numbers."""
    found, missing = coupled("first_angular_scale_factor = 90 second_scale_factor = -0.5")
    assert np.allclose(found, [[np.pi / 2.0, -0.5]])
    assert not missing
    found, missing = coupled("motion_multipliers = 90, -0.5")
    assert np.allclose(found, [[90.0, -0.5]])
    assert not missing
    found, missing = coupled("first_scale_factor = 2")
    assert not found
    assert re.search(says("second_scale_factor"), missing[0].message)


@pytest.mark.parametrize(
    ("turned", "given", "told"),
    [("0, 0, 30", "", True), ("0, 0, 30", "orientation = 0, 0, 0", False), ("0, 0, 0", "", False)],
)
def test_axes_that_are_not_given_are_told_where_they_are_turned(turned, given, told):
    text = PENDULUM + (
        f"part create rigid_body name_and_position part_name = .swing.B location = 1, 0, 0 orientation = {turned}\n"
        f"marker create marker_name = .swing.B.A location = 1, 2, 3 {given}\n"
        f"marker create marker_name = .swing.B.cm location = 1, 2, 3 orientation = 0, 0, 0\n"
        "part create rigid_body mass_properties part_name = .swing.B mass = 1 ixx = 1 iyy = 1 izz = 1\n"
    )
    remarks = [d.message for d in parse_view(text).deck.diagnostics if re.search(says("B.A", "orientation"), d.message)]
    assert len(remarks) == told


@pytest.mark.parametrize(
    ("before", "given", "at", "axis"),
    [
        ("", "location = 1, 2, 3 orientation = 0, 90, 0", (1, 2, 3), (0, -1, 0)),
        ("", "location = 1, 2, 3 along_axis_orientation = 2, 3, 3", (1, 2, 3), (1, 1, 0)),
        ("", "location = 1, 2, 3 along_axis_orientation = 1, 0, 0, 0, 0, 1", (1, 2, 3), (-1, 0, 1)),
        ("", "location = 0, 0, 0 in_plane_orientation = 0, 3, 0, 1, 0, 0", (0, 0, 0), (0, 1, 0)),
        ("", "location = 1, 0, 0 orientation = 90, 90, 0 relative_to = .swing.B", (5, 1, 0), (0, 1, 0)),
        (
            "defaults coordinate_system default_coordinate_system = .swing.B\n",
            "location = 1, 0, 0",
            (5, 1, 0),
            (0, 0, 1),
        ),
        ("defaults units coordinate_system_type = cylindrical\n", "location = 2, 90, 7", (0, 2, 7), (0, 0, 1)),
        (
            "defaults units orientation_type = body123\n",
            "location = 0, 0, 0 orientation = 90, 0, 0",
            (0, 0, 0),
            (0, -1, 0),
        ),
        ("", "location = (LOC_RELATIVE_TO({1, 0, 0}, .swing.B)) relative_to = .swing.B", (5, 1, 0), (0, 0, 1)),
    ],
)
def test_joints_of_two_parts_are_where_their_location_is(before, given, at, axis):
    """A place is one of the frame that is named, or of the default one when the command is given."""
    text = PENDULUM + (
        "part create rigid_body name_and_position part_name = .swing.B location = 5, 0, 0 orientation = 90, 0, 0\n"
        "marker create marker_name = .swing.B.cm location = 0, 0, 0 orientation = 0, 0, 0\n"
        "part create rigid_body mass_properties part_name = .swing.B mass = 1 ixx = 1 iyy = 1 izz = 1\n"
        f"{before}constraint create joint translational joint_name = .swing.SLIDE i_part_name = .swing.B &\n"
        f"   j_part_name = .swing.ground {given}\n"
    )
    view = parse_view(text)
    assert not view.deck.unsupported
    marker = view.deck.of(st.Marker)[by_name(view, st.Joint, "SLIDE").j]
    assert np.allclose(marker.qp, at, atol=1e-12)
    assert np.allclose(marker_orientation(marker)[:, 2], np.array(axis) / np.linalg.norm(axis), atol=1e-12)


def test_names_with_parts_in_quotes():
    """Of files of version 2, in which names may have blanks; texts that only look alike stay."""
    text = PENDULUM.replace(".swing", '."my swing"').replace("model_name = swing", 'model_name = "my swing"')
    text = text.replace(".ROD", '."ROD-1 (a)"').replace(
        'function = "DY(."my swing"."ROD-1 (a)".cm', 'function = "DY(.my_swing.ROD_1__a_.cm'
    )
    text += 'variable create variable_name = ."my swing".T string_value = "swings.", "so it is."\n'
    text += 'output_control create request request_name = ."my swing".R f2 = "DX(.\\"my swing\\".\\"ROD-1 (a)\\".cm)"\n'
    quoted, plain = parse_view(text), parse_view(PENDULUM)
    assert quoted.name == "my_swing"
    assert [len(quoted.deck.of(kind)) for kind in (st.Part, st.Marker, st.Joint, st.Variable)] == [
        len(plain.deck.of(kind)) for kind in (st.Part, st.Marker, st.Joint, st.Variable)
    ]
    assert by_name(quoted, st.Marker, "cm").qp == by_name(plain, st.Marker, "cm").qp
    cm = by_name(quoted, st.Marker, "cm").id
    assert f"DX({cm})" in [one.f2 for one in quoted.deck.of(st.Request).values()]


def test_short_names_mean_what_they_meant_when_they_were_written():
    """Each part's own cm, though all have one."""
    text = (
        PENDULUM
        + """\
part create rigid_body name_and_position part_name = .swing.A location = 1, 0, 0
marker create marker_name = .swing.A.cm location = 1, 0, 0 orientation = 0d, 0d, 0d
part create rigid_body mass_properties part_name = .swing.A mass = 1 center_of_mass_marker = cm ixx = 1 iyy = 1 izz = 1
part create rigid_body name_and_position part_name = .swing.B location = 2, 0, 0
marker create marker_name = .swing.B.cm location = 2, 0, 0 orientation = 0d, 0d, 0d
part create rigid_body mass_properties part_name = .swing.B mass = 1 center_of_mass_marker = cm ixx = 1 iyy = 1 izz = 1
"""
    )
    deck = parse_view(text).deck
    owners = {one.id: one.part for one in deck.of(st.Marker).values()}
    parts = [one for one in deck.of(st.Part).values() if one.name in ("A", "B")]
    assert [owners[one.cm] for one in parts] == [one.id for one in parts]


DAMPED = [0.1 * k for k in range(21)]
SLIDING = [x if k in (0, 1, 2, 6, 7, 11) else 0.0 for k, x in enumerate(DAMPED)]


@pytest.mark.parametrize(
    ("angle", "terms", "refused"), [("deg", DAMPED, True), ("deg", SLIDING, False), ("rad", DAMPED, False)]
)
def test_damping_of_a_beam_is_of_radians(angle, terms, refused):
    """No public model shows whether View's terms of rotations are of degrees, and a symmetric matrix cannot say."""
    text = PENDULUM.replace("angle = deg", f"angle = {angle}").replace("0d, 0d, 0d", "0, 0, 0") + (
        "force create element_like beam beam_name = .swing.BEAM i_marker_name = .swing.ROD.TOP  &\n"
        "   j_marker_name = .swing.ground.PIVOT ixx = 1 iyy = 1 izz = 1 area_of_cross_section = 1 length = 10  &\n"
        "   youngs_modulus = 1 shear_modulus = 1 y_shear_area_ratio = 1 z_shear_area_ratio = 1  &\n"
        f"   matrix_of_damping_terms = {', '.join(map(str, terms))}\n"
    )
    deck = parse_view(text).deck
    if refused:
        assert re.search(says(".swing.BEAM", "matrix_of_damping_terms", "damping_ratio"), deck.unsupported[0].message)
    else:
        assert not deck.unsupported
        assert np.allclose(by_name(parse_view(text), st.Beam, "BEAM").cmatrix, terms)
