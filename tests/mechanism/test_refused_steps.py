"""Calls of simulators, states and plants that cannot be meant: told in a line with what to do, beside what runs."""

import copy
import pickle
import warnings
from dataclasses import replace

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.solve.simulate import StopAt
from gearmbs.studies import Case, case_mechanism
from tests.mechanism.test_setting import PERIOD, PI, disc, driven, two_discs
from tests.mechanism.test_stepping import slider_crank
from tests.says import says


def test_nothing_goes_on_or_back_while_it_is_called():
    """From a controller, and from a function in the equations; after advance it does."""
    sim = gm.Simulator(two_discs(), 1.0)
    start, wanted = sim.state(), []
    sim.control("load", lambda t, s: wanted[-1](s) if wanted else 1.0, 0.1)
    for call in (lambda s: s.restore(start), lambda s: s.advance(s.t + 0.1)):
        wanted.append(call)
        with pytest.raises(ModelError, match=says("controller", "'load'", "return")):
            sim.advance(sim.t + 0.2)
    wanted.clear()
    sim.restore(start)
    sim.advance(0.2)
    assert sim.get("angular_velocity", "a")[2] > 0.0
    m, held = disc(), []
    m.function("PULL", lambda t: held[0].advance(0.9) or 0.0 if held and t > 0.5 else 0.0, count=1)
    m.axis_torque("pull", m.joints["pin"].i, m.joints["pin"].j, "PULL(TIME)")
    sim = gm.Simulator(m, 1.0)
    sim.advance(0.3)
    held.append(sim)
    with pytest.raises(ModelError, match=says("advance", "function", "return")):
        sim.advance(0.8)


def controlled(**options):
    sim = gm.Simulator(two_discs(), 1.0, **options)
    sim.control("load", PI(), PERIOD)
    return sim


@pytest.mark.parametrize(
    ("controller", "sample_time", "words"),
    [
        (None, PERIOD, ("'load'", "control(...)")),
        (PI(), 2 * PERIOD, ("'load'", "0.001", "0.002")),
        (lambda t, s: 1.0, PERIOD, ("'load'", "restore(numbers)")),
    ],
)
@pytest.mark.parametrize("back", [False, True])
def test_a_controller_that_cannot_go_on_is_told(controller, sample_time, words, back):
    first = controlled()
    first.advance(0.0104)
    state = first.state()

    def gone_on():
        sim = gm.Simulator(two_discs(), 1.0, **({} if back else {"initial": state}))
        if controller is not None:
            sim.control("load", controller, sample_time)
        if back:
            sim.restore(state)
        sim.advance(0.011)
        return sim

    with pytest.warns(UserWarning, match=says(*words)) as told:
        sim = gone_on()
    assert [one.filename for one in told] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.advance(0.012)
        same = controlled(initial=state)
        same.advance(0.011)
        same.restore(state)
        same.advance(0.011)


def test_a_run_from_a_state_with_controllers_says_that_it_has_none():
    sim = controlled()
    sim.advance(0.0104)
    state, m = sim.state(), two_discs()
    with pytest.warns(UserWarning, match=says("state", "'load'", "control(...)")) as told:
        m.simulate(0.011, initial=state)
    assert told[0].filename == __file__

    class Ramp(PI):
        def __call__(self, t):
            return 3.0

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        m.simulate(0.011, initial=state, inputs={"load": (Ramp(), PERIOD)})


def test_a_state_with_other_unknowns_starts_afresh():
    """A copy with others, or others written there, goes on with these, in a run and in a simulator."""
    m = disc()
    sim = gm.Simulator(m, 1.0)
    sim.advance(0.1)
    state = sim.state()
    y = state.y.copy()
    y[state.names.index("eps_psi(disc)")] += 1.0
    pushed = replace(state, y=y)
    assert m.simulate(0.3, initial=pushed).angular_velocity("disc")[-1, 2] == pytest.approx(1.0)
    sim.restore(pushed)
    sim.advance(0.2)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(1.0)
    assert m.simulate(0.3, initial=replace(state, y=state.y.copy())).angular_velocity("disc")[-1, 2] == 0.0
    state.y[:] = y
    assert m.simulate(0.3, initial=state).angular_velocity("disc")[-1, 2] == pytest.approx(1.0)


@pytest.mark.slow
def test_files_that_were_changed_are_no_states(tmp_path):
    """Whatever number of it is another one: else a run would go on from memory that is not its own."""
    sim = controlled()
    sim.advance(0.0104)
    path = sim.state().save(tmp_path / "state.npz")
    assert controlled(initial=gm.State.load(path)).t == sim.t
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    for name, array in arrays.items():
        others = [{key: value for key, value in arrays.items() if key != name}]
        if array.size:
            others.append(arrays | {name: array.reshape(-1)[:-1]})
            if array.dtype.kind == "f":
                others.append(arrays | {name: np.full_like(array, np.nan)})
        for k, other in enumerate(others):
            changed = tmp_path / f"changed {k}.npz"
            np.savez(changed, **other)
            with pytest.raises(ModelError, match=says("changed", "State.save")) as error:
                gm.State.load(changed)
            assert "\n" not in str(error.value)


PLANT = two_discs().linearize(["load", ("torque", "pin a")], [("joint_angle", "pin a"), ("angular_velocity", "b", "z")])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: gm.Simulator(m, 1.0, rate=10), ("Simulator", "'rate'", "advance")),
        (lambda m: gm.Simulator(m, 1.0, inputs={}), ("Simulator", "'inputs'", "simulate()")),
        (lambda m: gm.Simulator(m, 1.0, toll=1e-3), ("Simulator", "'toll'", "tol")),
        (lambda m: m.simulate(1.0, rat=10), ("simulate", "'rat'", "rate")),
        (lambda m: gm.Simulator(m, 1.0, stops=["x"]), ("stops", "'x'", "StopAt")),
        (lambda m: m.simulate(1.0, stops="spin"), ("stops", "'spin'", "StopAt")),
        (lambda m: gm.Simulator(m, 1.0, stops=[StopAt("spin", "5 rad/s")]), ("stops", "'5 rad/s'", "give")),
        (lambda m: gm.Simulator(m, 1.0, stops=[StopAt("spin", 1.0, 4)]), ("stops", "4", "-1")),
        (lambda m: m.linearize(["load"], [], t="1 m"), ("t", "'1 m'", "'1 s'")),
        (lambda m: m.simulate(0.1).state_at("1 m"), ("state_at", "'1 m'", "'1 s'")),
        (lambda m: m.simulate(0.1).state_at(None), ("state_at", "None", "'1 s'")),
        (lambda m: m.linear_modes(t="1 m"), ("t", "'1 m'", "'1 s'")),
        (lambda m: m.simulate(1.0, t_eval="1 s"), ("t_eval", "'1 s'", "brackets")),
        (lambda m: gm.Simulator(m, 1.0).set("load", 10**400), ("'load'", "401", "give")),
        (lambda m: m.linearize(["load"], [], at=disc().simulate(0.1)), ("disc", "'two discs'", "take")),
        (lambda m: gm.Simulator(driven("displacement"), 1.0).control("given", max, 1.0), ("'given'", "speed", "let")),
        (
            lambda m: driven("displacement").simulate(1.0, inputs={"given": ([0, 1], [1.0, 2.0], 1)}),
            ("'given'", "motion: angle", "begin"),
        ),
        (lambda m: gm.Simulator(m, 1.0, tol="1e-6"), ("tol", "'1e-6'", "number")),
        (lambda m: m.simulate(1.0, rate_scale=0), ("rate_scale", "0", "1/s")),
        (lambda m: gm.Simulator(m, 1.0, integrator=3), ("integrator", "3", "WSTIFF")),
        (lambda m: gm.Simulator(m, 1.0, records="no"), ("records", "'no'", "False")),
        (lambda m: m.simulate(0.1, initial=m.simulate(0.1)), ("initial", "Solution", "state_at(t)")),
        (lambda m: m.simulate(0.1, initial=m), ("initial", "Mechanism", "State.load")),
        (lambda m: gm.Simulator(m, 1.0).set("LOAD", 1.0), ("'LOAD'", "did you mean load?")),
        (lambda m: gm.Simulator(m, 1.0).control("load", lambda t: 0.0, 0.1), ("'load'", "(t)", "simulator")),
        (lambda m: m.simulate(1.0, inputs={"load": (lambda t: None, 0.1)}), ("controller", "'load'", "None")),
        (lambda m: m.simulate(1.0, inputs={"load": (lambda t, s: 1.0, 0.1)}), ("'load'", "(t, s)", "(t)")),
        (lambda m: copy.copy(gm.Simulator(m, 1.0)), ("simulator", "initial=sim.state()")),
        (lambda m: copy.deepcopy(gm.Simulator(m, 1.0)), ("simulator", "initial=sim.state()")),
        (lambda m: pickle.dumps(gm.Simulator(m, 1.0)), ("simulator", "initial=")),
        (lambda m: gm.State.load(__file__), ("test_refused_steps.py", "State.save")),
        (lambda m: m.linearize("load", []), ("inputs", "'load'", "['load']")),
        (lambda m: PLANT.frequency_response(np.ones((2, 2))), ("f", "row")),
        (lambda m: PLANT.step([-1.0]), ("times", "-1")),
        (lambda m: PLANT.step(None), ("times", "None")),
        (lambda m: PLANT.frequency_response("2 m"), ("f", "'2 m'", "Hz")),
        (lambda m: PLANT.step(["2 m"]), ("times", "'2 m'", "'1 s'")),
        (lambda m: PLANT.transfer_function(("torque", "pin b")), ("'torque pin b'", "'torque pin a'")),
        (lambda m: PLANT.transfer_function(None), ("None", "'load'")),
        (lambda m: gm.Simulator(m, 1.0).state().changed(3), ("changed", "3", "names")),
        (lambda m: gm.Simulator(m, 1.0).state().changed(None), ("changed", "None", "names")),
        (lambda m: gm.Simulator(m, 1.0).state().save(None), ("state", "None", "file")),
        (lambda m: gm.State.load(None), ("state", "None", "file")),
        (lambda m: PLANT.save(None), ("plant", "None", "file")),
        (lambda m: m.linearize(None, []), ("inputs", "None", "list")),
        (lambda m: m.linearize(["load"], None), ("outputs", "None", "list")),
        (lambda m: m.linearize(m.inputs["load"], []), ("inputs", "'load'", "list")),
        (lambda m: PLANT.frequency_response(1j), ("f", "1j", "Hz")),
        (lambda m: PLANT.frequency_response(np.array([2j])), ("f", "2j", "Hz")),
        (lambda m: m.output("o", ("angular_velocit", "a", "z")), ("'o'", "'angular_velocit'", "'angular_velocity'")),
        (lambda m: m.output("o", ("_now", "a")), ("'o'", "'_now'", "reaction")),
        (lambda m: (m.input("x y", "N"), m.output("o", "2*x y")), ("'o'", "'y'", "quotation")),
        (lambda m: case_mechanism(Case()).linearize(["operation.torque"], []), ("'load.torque'", "('torque', 'load')")),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_told_in_a_line(call, words):
    with pytest.raises(ModelError, match=says(*words)) as error:
        call(two_discs())
    assert "\n" not in str(error.value)


def test_what_is_meant_runs():
    """Quantities with units wherever a time or a frequency is asked for; names as they were asked for."""
    m = two_discs()
    sim = gm.Simulator(m, 1.0, records=np.True_, lump=None)
    sim.set(m.inputs["load"], 2.0)
    assert sim.get("input", m.inputs["load"]) == 2.0
    sim.control("load", max, 0.5)
    m.output("odd", ("angular_velocity", "c", "z"))
    with pytest.raises(KeyError, match=says("output 'odd'", "'c'", "a, b")):
        sim.get("output", "odd")
    assert m.simulate("1 s", t_eval=["0 s", "500 ms"]).t.tolist() == [0.0, 0.5]
    assert m.simulate(0.1).state_at("100 ms").t == 0.1
    assert m.linearize(["load"], [], t="1 s").point.t == 1.0
    np.testing.assert_array_equal(PLANT.frequency_response("2 Hz"), PLANT.frequency_response(2.0))
    np.testing.assert_array_equal(PLANT.frequency_response(["2 Hz", "1 kHz"]), PLANT.frequency_response([2.0, 1e3]))
    np.testing.assert_array_equal(PLANT.step(["500 ms"], ("torque", "pin a")), PLANT.step([0.5], 1))
    one = PLANT.transfer_function(("torque", "pin a"), ("angular_velocity", "b", "z"))
    np.testing.assert_array_equal(one.num, PLANT.transfer_function(1, 1).num)
    np.testing.assert_array_equal(PLANT.frequency_response((1.0, 2.0)), PLANT.frequency_response([1.0, 2.0]))
    assert m.linearize(("load",), ()).inputs == m.linearize(m.inputs, []).inputs == ["load"]
    assert m.output("rate", ("joint_rate", "pin a")).asked == ("joint_rate", "pin a")
    m.input("two words", "N m", 3.0)
    m.output("double", '2*"two words"')
    assert m.simulate(0.1, rate=10.0).output("double").tolist() == [6.0, 6.0]
    m.aliases["second"] = "load"
    one, other = (m.linearize([name], [("joint_rate", "pin a")]) for name in ("load", "second"))
    np.testing.assert_array_equal(one.B, other.B)
    led = driven("displacement").simulate(1.0, inputs={"given": ([0, 1], [0.0, 2.0], 1)})
    assert led.joint_angle("pin a")[-1] == pytest.approx(2.0)
    stopped = Mechanism("disc")
    body = stopped.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0), angular_velocity=(0, 0, 1.0))
    pin = stopped.revolute("pin", body, stopped.ground, axis=(0, 0, 1))
    stopped.algebraic_state("angle", f"AZ({pin.i.name}, {pin.j.name})")
    assert gm.Simulator(stopped, 1.0, stops=(StopAt("angle", 0.5, 1),)).advance(1.0).state == "angle"


def test_sample_times_that_no_time_tells_apart_are_refused_and_short_ones_are_not():
    m = Mechanism("disc")
    disc = m.body("disc", 1.0, (1, 1, 1))
    m.revolute("pin", m.ground, disc)
    m.torque("load", disc, m.input("load", "N m"))
    sim = gm.Simulator(m, 1.0)
    with pytest.raises(ModelError, match=says("sample_time", "told apart")):
        sim.control("load", lambda t, now: 1.0, sample_time=1e-17)
    sim.control("load", lambda t, now: 1.0, sample_time="1 us")
    sim.advance(1e-4)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(1e-4, rel=1e-6)


def test_what_goes_by_two_names_is_listed_under_both_and_what_needs_another_model_says_so():
    sim = gm.Simulator(case_mechanism(Case()), 1.0)
    assert sim.numbers["operation.torque"] == sim.numbers["load.torque"]
    sim.set("operation.torque", "50 N m")
    assert sim.get("input", "operation.torque") == 50.0
    for name in ("gears.teeth", "mesh.backlash", "operation.speed"):
        with pytest.raises(ModelError, match=says(name, "another mechanism")):
            sim.set(name, 1.0)


def test_states_whose_values_contradict_each_other_are_refused_where_they_are_restored():
    """By the joint that they leave open, and the simulation goes on from where it stood; small ones are closed."""
    sim = gm.Simulator(slider_crank(), 1.0)
    sim.advance(0.2)
    state = sim.state()
    sim.advance(0.3)
    before, points = sim.state(), len(sim.solution().t)
    for change in ({"R_x(rod)": 0.05}, {"u_x(rod)": 5.0}):
        ((name, by),) = change.items()
        with pytest.raises(ModelError, match=says("restore", name, "coincident x")):
            sim.restore(state.changed({name: state[name] + by}))
        assert sim.t == 0.3
        assert len(sim.solution().t) == points
    sim.advance(0.4)
    gone = sim.state()
    sim.restore(before)
    sim.advance(0.4)
    np.testing.assert_array_equal(sim.state().y, gone.y)
    sim.restore(state.changed({"R_x(rod)": state["R_x(rod)"] + 1e-5}))
    sim.advance(0.4)
    assert sim.state()["R_x(rod)"] == pytest.approx(gone["R_x(rod)"], abs=1e-4)


def test_a_state_of_another_prescribed_speed_is_gone_on_from_with_what_is_set():
    """The speed that a motion asks for may be set after the state is restored: bodies take it up at once."""
    m = Mechanism("disc")
    disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    pin = m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    m.rotation("drive", pin, m.input("speed", "rad/s", 1.0), level="velocity")
    sim = gm.Simulator(m, 1.0)
    sim.advance(0.1)
    state = sim.state()
    name = next(name for name in state.names if name.startswith("eps_") and abs(state[name]) > 0.5)
    sim.restore(state.changed({name: 3.0 * state[name]}))
    sim.set("speed", 3.0)
    sim.advance(0.2)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(3.0)
    assert sim.get("joint_angle", "pin") == pytest.approx(0.4, abs=1e-6)
