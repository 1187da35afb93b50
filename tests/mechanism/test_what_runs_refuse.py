"""What runs, states, inputs and plants refuse in a line that names it, and what is next to it and runs."""

from __future__ import annotations

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import Drivetrain, IdealBearing, Shaft
from gearmbs.mechanism import ModelError
from tests.says import says


def disc() -> gm.Mechanism:
    """Return a disc of 2 kg m^2 with a torque that is an input."""
    m = gm.Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, m.input("load", "N m"))
    return m


def speed(solution) -> np.ndarray:
    return solution.angular_velocity("disc")[:, 2]


@pytest.mark.parametrize("option", ["dense_output", "history", "event_count"])
def test_options_that_a_run_with_inputs_has_not(option):
    with pytest.raises(ModelError, match=says("inputs", option)):
        disc().simulate(1.0, inputs={"load": 1.0}, **{option: True})


def test_options_are_refused_in_words_of_the_call():
    with pytest.raises(ModelError, match=says("simulate", "bogus", "t_eval")):
        disc().simulate(1.0, inputs={"load": 1.0}, bogus=True)
    found: list[float] = []
    solution = disc().simulate(1.0, rate=10, inputs={"load": 1.0}, max_step=0.1, progress=found.append)
    assert speed(solution)[-1] == pytest.approx(0.5, rel=1e-9)
    assert found[-1] == 1.0


@pytest.mark.parametrize("gap", [1e-300, 1e-13])
@pytest.mark.parametrize("hold", [0, 1])
def test_times_that_are_not_told_apart(gap, hold):
    with pytest.raises(ModelError, match=says("'load'", f"{gap:.2g} s", "1e-12 s")):
        disc().simulate(1.0, inputs={"load": ([0.0, gap], [0.0, 1.0], hold)})
    near = disc().simulate(1.0, inputs={"load": ([0.0, 1e-6], [0.0, 1.0], hold)})
    assert speed(near)[-1] == pytest.approx(0.5, rel=1e-5)


def test_a_step_after_a_value_that_is_no_step():
    sim = gm.Simulator(disc(), 1.0)
    sim.set("load", 1.0)
    with pytest.raises(ModelError, match=says("1e-300 s", "1e-12 s", "more")):
        sim.advance(1e-300)
    sim.advance(1e-6)
    sim.set("load", 2.0)
    sim.advance(1.0)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(1.0, rel=1e-5)
    # without a value set points may lie as close as they can
    sim = gm.Simulator(disc(), 1.0)
    sim.advance(0.5)
    sim.advance(float(np.nextafter(0.5, 1.0)))


def test_tables_whose_times_differ_by_rounding():
    """0.1 k and k / 10 are told apart by the last digit at some k."""
    m = disc()
    m.axis_torque("other", m.joints["pin"].i, m.joints["pin"].j, "more")
    m.input("more", "N m")
    first, second = np.array([0.1 * k for k in range(10)]), np.arange(10) / 10
    assert (first != second).any()
    values = np.arange(10.0)
    both = m.simulate(1.0, t_eval=[0.0, 0.3, 1.0], inputs={"load": (first, values), "more": (second, -values)})
    assert speed(both) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_an_input_is_asked_for_once():
    with pytest.raises(ModelError, match=says("'load'", "2 times")):
        disc().linearize(["load", "load"], [])
    assert disc().linearize(["load"], [("joint_rate", "pin")] * 2).B[1] == pytest.approx([0.5])


@pytest.mark.parametrize(("name", "instead"), [("2x", "u_2x"), ("2:x", "u_2_x")])
def test_names_that_expressions_cannot_use(name, instead):
    for make in (disc().input, disc().parameter):
        with pytest.raises(ModelError, match=says(repr(name), f"'{instead}'")):
            make(name, "N m", 1.0)
    disc().input(instead, "N m")
    disc().parameter("of two words", "N m", 1.0)


def test_inputs_are_no_numbers():
    m = disc()
    for wrong in (lambda: 2 * m.inputs["load"], lambda: -m.inputs["load"], lambda: m.inputs["load"] / np.float64(3)):
        with pytest.raises(ModelError, match=says("'load'", "'2*load'")):
            wrong()
    m.axis_torque("twice", m.joints["pin"].i, m.joints["pin"].j, "2*load")
    assert m.linearize(["load"], [("joint_rate", "pin")]).B[1] == pytest.approx([1.5])


def test_a_state_is_in_a_file(tmp_path):
    with pytest.raises(ModelError, match=says(str(tmp_path), "file")):
        gm.State.load(tmp_path)
    sim = gm.Simulator(disc(), 1.0)
    sim.state().save(tmp_path / "state.npz")
    assert gm.State.load(tmp_path / "state.npz").t == 0.0


def test_times_of_outputs_beside_a_state():
    m = disc()
    sim = gm.Simulator(m, 2.0)
    sim.set("load", 4.0)
    sim.advance(1.0)
    state = sim.state()
    for times in ([0.0, 2.0], [0.5, 0.9]):
        with pytest.raises(ModelError, match=says("t_eval", f"{times[0]:g} s", "1 s")):
            m.simulate(2.0, t_eval=times, initial=state)
    with pytest.raises(ModelError, match=says("t_eval", "1 s", "later")):
        m.simulate(2.0, t_eval=[1.0], initial=state)
    for wrong in ([], [1.0, np.nan], [[1.0, 2.0]], [1.0, 2.0, 1.5]):
        with pytest.raises(ModelError, match=says("t_eval", "later")):
            m.simulate(2.0, t_eval=wrong, initial=state)
    for inputs in (None, {"load": 4.0}):
        solution = m.simulate(2.0, t_eval=[1.5, 2.0], initial=state, inputs=inputs)
        assert solution.t.tolist() == [1.5, 2.0]
        assert speed(solution) == pytest.approx([3.0, 4.0], rel=1e-6)


def test_what_is_no_mechanism():
    train = Drivetrain("shaft", shafts=[Shaft(name="s")], bearings=[IdealBearing(name="b", shaft="s")])
    calls = (gm.Simulator, gm.Mechanism.simulate, lambda m, _: gm.linearize(m, [], []))
    for call in calls:
        with pytest.raises(ModelError, match=says("Case", "case_mechanism")):
            call(gm.Case(), 1.0)
        with pytest.raises(ModelError, match=says("Drivetrain", "build()")):
            call(train, 1.0)
        call(train.build(), 1.0)
