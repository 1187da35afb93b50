"""Simulations of a command file: each runs with the model as it is when its command comes.

The body has 2 kg and moves along x, so that 20 N give 10 m/s^2: closed forms in metres.
"""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs.adams import DeckError, parse_view, read_deck, read_script, read_view, run_deck
from gearmbs.adams.parse import statements as st
from gearmbs.cli import app
from tests.says import says

MODEL = """\
model create model_name = m
defaults units length = meter angle = deg force = newton mass = kg time = sec
marker create marker_name = .m.ground.X location = 0, 0, 0 orientation = 90, 90, 0
part create rigid_body name_and_position part_name = .m.P location = 0, 0, 0
marker create marker_name = .m.P.cm location = 0, 0, 0
part create rigid_body mass_properties part_name = .m.P mass = 2 center_of_mass_marker = .m.P.cm ixx = 1 iyy = 1 izz = 1
variable create variable_name = .m.PULL real_value = 20
force create direct single_component_force single_component_force_name = .m.SF type_of_freedom = translational  &
   i_marker_name = .m.P.cm j_marker_name = .m.ground.X action_only = on function = ".m.PULL"
"""
RUN = "simulation single_run transient end_time = {} number_of_steps = 2\n"
ONE, TWO = RUN.format(1), RUN.format(2)
RESET = "simulation single_run reset\n"
PULL = "variable modify variable_name = .m.PULL real_value = {}\n"
OFF, ON = (f"force attributes force_name = .m.SF active = {word}\n" for word in ("off", "on"))
FORTY = 'force modify direct single_component_force single_component_force_name = .m.SF function = "40"\n'
MASS = "part modify rigid_body mass_properties part_name = .m.P mass = {}\n"
GRAVITY = "force {} body gravitational gravity_field_name = .m.G x_component = {} y_component = 0 z_component = 0\n"


def ends(text: str, name: str | None = None, part: str = "P") -> list[float]:
    """Return where the part is at the end of each part of a simulation."""
    view = parse_view(text)
    result = run_deck(view, None if name is None else view.scripts[name])
    assert result.success
    return [float(one.solution.com_position(part)[-1, 0]) for one in result.segments]


@pytest.mark.parametrize(
    ("before", "between", "places"),
    [
        ("", "", [5.0, 20.0]),
        ("", PULL.format(40), [5.0, 25.0]),
        ("", FORTY, [5.0, 25.0]),
        ("", OFF, [5.0, 15.0]),
        (OFF, ON, [0.0, 5.0]),
        ("", MASS.format(4), [5.0, 17.5]),
        (GRAVITY.format("create", 0), GRAVITY.format("modify", 10), [5.0, 25.0]),
        (GRAVITY.format("create", 10) + "force attributes force_name = .m.G active = off\n",
         "force attributes force_name = .m.G active = on\n", [5.0, 25.0]),
    ],
)  # fmt: skip
def test_a_change_between_two_simulations_acts_on_the_second(before, between, places):
    assert np.allclose(ends(MODEL + before + ONE + between + TWO), places, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("between", "words"),
    [
        ("part modify rigid_body name_and_position part_name = .m.P location = 1, 0, 0\n", ("QG", "starts", "reset")),
        ("part create rigid_body name_and_position part_name = .m.Q location = 0, 0, 0\n", ("PART", "made", "reset")),
        ("part attributes part_name = .m.P active = off\n", ("PART", "P", "taken out", "reset")),
        (ONE, ("END", "1.0")),
    ],
)
def test_what_cannot_be_changed_between_two_simulations_is_refused(between, words):
    text = MODEL + ONE + between
    with pytest.raises(DeckError, match=says(*words)) as caught:
        run_deck(parse_view(text + TWO))
    line = text.count("\n") + (1 if between is not ONE else 0)
    assert [one.line for one in caught.value.diagnostics] == [line]
    assert run_deck(parse_view(text.replace(between, RESET + between) + (TWO if "off" not in between else ""))).success


def test_after_a_reset_each_analysis_is_a_run_of_its_own():
    text = MODEL + ONE + RESET + PULL.format(40) + ONE
    view = parse_view(text)
    assert view.own == ("Run_1", "Last_Run")
    assert np.allclose([ends(text, name)[-1] for name in view.own], [5.0, 10.0], rtol=1e-6)
    # the last analysis is what the file leaves, and says that there were others
    result = run_deck(view)
    assert np.isclose(result.segments[-1].solution.com_position("P")[-1, 0], 10.0, rtol=1e-6)
    assert any("Run_1" in str(message) for message in result.messages)
    assert not any("Run_" in str(message) for message in run_deck(parse_view(MODEL + ONE)).messages)


def test_a_loop_over_a_variable_with_resets():
    loop = (
        "for variable_name = k start_value = 1 end_value = 3\n"
        "variable modify variable_name = .m.PULL real_value = (eval(k * 20))\n"
        f"{ONE}{RESET}end\n"
    )
    view = parse_view(MODEL + loop)
    assert view.own == ("Run_1", "Run_2", "Last_Run")
    assert np.allclose([ends(MODEL + loop, name) for name in view.own], [[5.0], [10.0], [15.0]], rtol=1e-6)


def test_an_analysis_is_kept_under_the_name_it_is_saved_under():
    save = "simulation single_run save analysis_name = {}\n"
    text = MODEL + ONE + save.format("short") + OFF + TWO + RESET + ONE + save.format("again")
    view = parse_view(text)
    assert view.own == ("short", "Run_2", "again")
    assert np.allclose(ends(text, "short"), [5.0], rtol=1e-6)
    assert np.allclose(ends(text, "Run_2"), [5.0, 15.0], rtol=1e-6)
    with pytest.raises(DeckError, match=says("short", "already")):
        parse_view(text + save.format("short"))
    with pytest.raises(DeckError, match=says("short", "before")):
        parse_view(MODEL + save.format("short"))


SCRIPT = "simulation script create sim_script_name = .m.S {}\n"
INNER = 'commands = "simulation single_run transient end_time=0.5 number_of_steps=2", "{}",' + (
    '"simulation single_run transient end_time=1 number_of_steps=2"'
)


@pytest.mark.parametrize(
    ("script", "last"),
    [
        (INNER.format("force attributes force_name=.m.SF active=off"), 3.75),
        ('solver_commands = "simulate/dynamic, end=0.5, steps=2", "deactivate/sforce, id=1",  &\n'
         '   "simulate/dynamic, end=1, steps=2"', 3.75),
        (INNER.format("variable modify variable_name=.m.PULL real_value=60"), 7.5),
        (INNER.format("simulation single_run reset"), 5.0),
        (INNER.format("view erase"), 5.0),
        ("end_time = 1 number_of_steps = 2", 5.0),
    ],
)  # fmt: skip
def test_commands_of_a_script_are_those_outside_of_it(script, last):
    text = MODEL + SCRIPT.format(script)
    assert np.isclose(ends(text, "S")[-1], last, rtol=1e-6)
    # and leave the model of other simulations as it is, as long as the file does not run the script
    assert np.isclose(ends(text + ONE)[-1], 5.0, rtol=1e-6)
    view = parse_view(text)
    assert "20" in view.deck.of(st.Sforce)[1].function


def test_scripts_run_in_order():
    scripted = "simulation single_run scripted sim_script_name = .m.S reset_before_and_after = {}\n"
    text = MODEL + SCRIPT.format('solver_commands = "sim/dyn, end=2, steps=3"')
    assert np.allclose(ends(text + ONE + scripted.format("no")), [5.0, 20.0], rtol=1e-6)
    both = text + ONE + PULL.format(40) + scripted.format("yes") + ONE
    assert parse_view(both).own == ("Run_1", "Run_2", "Last_Run")
    assert np.allclose(ends(both, "Run_2"), [40.0], rtol=1e-6)
    assert np.allclose(ends(both), [10.0], rtol=1e-6)
    # a script that ends by STOP ends itself
    stopped = MODEL + SCRIPT.format('solver_commands = "sim/dyn, end=1, steps=3", "stop"')
    assert np.allclose(ends(stopped + scripted.format("no") + TWO), [5.0, 20.0], rtol=1e-6)
    with pytest.raises(DeckError, match=says("no script", ".m.T")):
        parse_view(text + scripted.replace(".m.S", ".m.T").format("no"))
    with pytest.raises(DeckError, match=says("reset_before_and_after", "perhaps")):
        parse_view(text + scripted.format("perhaps"))


def test_a_script_that_runs_itself_ends():
    own = 'commands = "simulation single_run scripted sim_script_name=.m.S"'
    with pytest.raises(DeckError, match=says("within each other")):
        run_deck(parse_view(MODEL + SCRIPT.format(own)))


@pytest.mark.slow
def test_a_script_that_cannot_be_carried_out_is_refused_when_it_is_run(tmp_path):
    stale = SCRIPT.format('commands = "simulation single_run transient end_time=1 number_of_steps=2 model_name=.old"')
    for text in (stale, SCRIPT.format('solver_commands = "simulate/nonsense"')):
        view = parse_view(MODEL + text)
        assert list(view.refused) == ["S"]
        assert any("left out" in one.message and one.line for one in view.deck.diagnostics)
        with pytest.raises(DeckError, match=says("in the simulation")):
            run_deck(view)
        assert run_deck(view, end=1.0).success
        # nor does it stand in the way of others
        assert np.allclose(ends(MODEL + text + ONE), [5.0], rtol=1e-6)
    path = tmp_path / "x.cmd"
    path.write_text(MODEL + stale)
    for more in ([], ["--simulation", "S"]):
        result = CliRunner().invoke(app, ["adams", str(path), *more])
        assert result.exit_code == 1
        assert ".old" in result.output
    with pytest.raises(DeckError, match=says("no model", ".old")):
        parse_view(MODEL + stale + "simulation single_run scripted sim_script_name = .m.S\n")


OTHER = """\
model create model_name = {0}
part create rigid_body name_and_position part_name = .{0}.P location = 0, 0, 0
marker create marker_name = .{0}.P.cm location = 0, 0, 0
part create rigid_body mass_properties part_name = .{0}.P mass = 1  &
   center_of_mass_marker = .{0}.P.cm ixx = 1 iyy = 1 izz = 1
part create rigid_body initial_velocity part_name = .{0}.P vx = {1}
"""
UNITS = "defaults units length = meter angle = deg force = newton mass = kg time = sec\n"
MODELS = UNITS + OTHER.format("wanted", 1) + OTHER.format("other", 7)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("defaults model model_name = .wanted\n" + ONE, 1.0),
        (ONE.replace("\n", " model_name = .wanted\n"), 1.0),
        (ONE.replace("\n", " model_name = other\n"), 7.0),
        (ONE, 7.0),
        ("model create model_name = empty\n" + ONE, 7.0),
    ],
)
def test_the_model_of_a_simulation(text, place):
    assert np.isclose(ends(MODELS + text)[-1], place, rtol=1e-9)


def test_models_keep_their_own_time():
    wanted, other = (f"{{}} model_name = .{name}\n" for name in ("wanted", "other"))
    text = MODELS + "".join(where.format(run.strip()) for where, run in ((wanted, ONE), (other, TWO), (wanted, TWO)))
    assert parse_view(text).own == ("Run_1", "Last_Run")
    assert np.allclose(ends(text, "Run_1"), [1.0, 2.0], rtol=1e-9)
    assert np.allclose(ends(text), [14.0], rtol=1e-9)
    assert parse_view(text, model="wanted").own == ("Last_Run",)


@pytest.mark.parametrize("text", [ONE.replace("\n", " model_name = .zz\n"), "defaults model model_name = .zz\n" + ONE])
def test_an_unknown_model_is_refused(text):
    with pytest.raises(DeckError, match=says("no model", "zz")) as caught:
        parse_view(MODELS + text)
    assert caught.value.diagnostics[0].line == MODELS.count("\n") + 1
    with pytest.raises(DeckError, match=says("zz", "wanted", "other")):
        parse_view(MODELS, model="zz")


@pytest.mark.parametrize(
    ("word", "analysis"),
    [
        ("auto_select", "SIMULATE/DYNAMICS"),
        ("dynamic", "SIMULATE/DYNAMICS"),
        ("kinematic", "SIMULATE/KINEMATICS"),
        ("static", "SIMULATE/STATICS"),
    ],
)
def test_types_of_simulations(word, analysis):
    (command,) = parse_view(MODEL + ONE.replace("\n", f" type = {word}\n")).script
    assert command.text == f"{analysis}, END=1, STEPS=2"
    assert command.line == MODEL.count("\n") + 1


def test_initial_conditions_take_no_time():
    text = MODEL + "simulation single_run transient type = initial_conditions\n" + ONE
    assert next(iter(parse_view(text).script)).text == "SIMULATE/INITIAL_CONDITIONS"
    assert np.allclose(ends(text), [0.0, 5.0], rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("end_time = 1 number_of_steps = 2 type = nonsense", ("nonsense", "dynamic", "static")),
        ("end_time = 1 number_of_steps = 2 type = eigensolution", ("eigensolution", "kinematic")),
        ("number_of_steps = 2", ("end_time", "duration")),
        ("end_time = 1 number_of_steps = 2.5", ("number_of_steps", "whole")),
        ("end_time = 1 number_of_steps = 2 initial_static = perhaps", ("initial_static", "perhaps")),
        ("number_of_steps = 2 forever = yes", ("forever", "end_time")),
    ],
)
def test_wrong_simulations_are_refused(wrong, words):
    with pytest.raises(DeckError, match=says(*words)) as caught:
        parse_view(f"{MODEL}simulation single_run transient {wrong}\n")
    assert caught.value.diagnostics[0].line == MODEL.count("\n") + 1


def test_what_only_shows_results_may_come_after_the_simulation():
    request = 'output_control create request request_name = .m.R f1 = "DX(.m.P.cm)"\n'
    view = parse_view(MODEL + ONE + request)
    assert not view.models
    assert run_deck(view).to_dataset().request_1.sel(request_1_column="F1").values[-1] == pytest.approx(5.0)
    # what acts does not
    late = parse_view(MODEL + ONE + OFF)
    assert list(late.models) == ["Last_Run"]
    assert np.allclose(ends(MODEL + ONE + OFF), [5.0], rtol=1e-6)


def test_simulations_become_scripts_with_their_decks(tmp_path):
    path = tmp_path / "x.cmd"
    path.write_text(MODEL + ONE + RESET + PULL.format(40) + ONE)
    files = read_view(path).save(tmp_path / "x.adm")
    assert [one.name for one in files] == ["x.adm", "x_Run_1.adm", "x_Run_1.acf", "x_Last_Run.acf"]
    for name, place in (("x_Run_1.acf", 5.0), ("x_Last_Run.acf", 10.0)):
        script = read_script(tmp_path / name)
        result = run_deck(read_deck(tmp_path / f"{script.model}.adm"), script)
        assert np.isclose(result.segments[-1].solution.com_position("P")[-1, 0], place, rtol=1e-6)


@pytest.mark.slow
def test_the_command_runs_each_analysis(tmp_path):
    path = tmp_path / "x.cmd"
    path.write_text(MODEL + ONE + RESET + PULL.format(40) + ONE)
    result = CliRunner().invoke(app, ["adams", str(path)])
    assert result.exit_code == 0
    assert {one.name for one in tmp_path.glob("*.res")} == {"x.res", "x_Run_1.res"}
    for more in (["--end", "1"], [str(tmp_path / "x.acf")]):
        result = CliRunner().invoke(app, ["adams", str(path), "--simulation", "Run_1", *more])
        assert result.exit_code == 1
        assert "--simulation" in result.output
    path.write_text(MODEL)
    result = CliRunner().invoke(app, ["adams", str(path), "--simulation", "ZZ"])
    assert result.exit_code == 1
    assert "ZZ" in result.output


def test_a_setting_that_comes_later_acts_later():
    setting = "executive_control set numerical_integration_parameters model_name = m error_tolerance = 1e-3\n"
    view = parse_view(MODEL + ONE + setting + TWO)
    result = run_deck(view)
    assert [one.options["tol"] for one in result.segments] == [1e-8, 1e-3]
    assert [one.options["tol"] for one in run_deck(parse_view(MODEL + setting + ONE + TWO)).segments] == [1e-3, 1e-3]


@pytest.mark.parametrize(
    ("before", "between"),
    [
        ('data_element create variable variable_name = .m.V function = "20"\n',
         'data_element modify variable variable_name = .m.V function = "40"\n'),
        ('data_element create variable variable_name = .m.V function = "20"\n',
         'data_element create variable variable_name = .m.W function = "40"\n'
         'force modify direct single_component_force single_component_force_name = .m.SF function = "VARVAL(.m.W)"\n'),
    ],
)  # fmt: skip
def test_data_that_a_force_reads_changes_between(before, between):
    reads = 'force modify direct single_component_force single_component_force_name = .m.SF function = "VARVAL(.m.V)"\n'
    assert np.allclose(ends(MODEL + before + reads + ONE + between + TWO), [5.0, 25.0], rtol=1e-6)


def test_an_axis_changes_between():
    # the second second: 10 m/s along x from 5 m, and 10 m/s^2 along z
    turned = "marker modify marker_name = .m.ground.X orientation = 0, 0, 0\n"
    result = run_deck(parse_view(MODEL + ONE + turned + TWO))
    assert np.allclose(result.segments[-1].solution.com_position("P")[-1], [15.0, 0.0, 5.0], rtol=1e-6, atol=1e-9)


def test_the_last_way_to_say_something_counts():
    routine = "force modify direct single_component_force single_component_force_name = .m.SF user_function = 1, 2\n"
    assert np.allclose(ends(MODEL + routine + FORTY + ONE), [10.0], rtol=1e-6)
    assert parse_view(MODEL + FORTY + routine).deck.of(st.Sforce)[1].function == "USER(1, 2)"
    modified = "simulation script modify sim_script_name = .m.S {}\n"
    text = MODEL + SCRIPT.format("end_time = 1 number_of_steps = 2")
    (command,) = parse_view(text + modified.format("duration = 2 step_size = 0.5")).script
    assert command.text == "SIMULATE/DYNAMICS, DURATION=2, DTOUT=0.5"
    (command,) = parse_view(text + modified.format('solver_commands = "simulate/static"')).script
    assert command.text == "simulate/static"
    with pytest.raises(DeckError, match=says("exclude", "solver_commands", "end_time")):
        parse_view(text + modified.format('end_time = 2 solver_commands = "simulate/static"'))
