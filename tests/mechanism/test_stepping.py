"""States and steps of one's own: what goes on from a state is what one run would have given, bit for bit."""

import gc
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import (
    Accelerometer,
    Housing,
    HousingMode,
    IdealBearing,
    Laser,
    Mount,
    RollingContactBearing,
    SpeedSensor,
    TorqueSensor,
    Wheel,
)  # fmt: skip
from gearmbs.gears import GearSpec, PlanetarySet, planetary_mechanism
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.parts import functions
from gearmbs.studies import flexible_rig
from gearmbs.studies.run.simulation import case_mechanism
from tests.drivetrain.support import stage
from tests.drivetrain.test_kinds_of_wheels import QUIET
from tests.mechanism.agreement import assert_all_names_agree
from tests.says import says

PAIR = {"tol": 1e-7, "rate_scale": 3000.0}


def slider_crank(length=0.3):
    """A slider crank with a spring that counts turns, a state of its own and one that equations determine."""
    m = Mechanism("slider crank", gravity=(0.0, -9.81, 0.0))
    crank = m.body("crank", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.05, 0, 0))
    rod = m.body("rod", mass=0.5, inertia=(0.01, 0.01, 0.01), position=(0.1 + 0.5 * length, 0, 0))
    block = m.body("block", mass=2.0, inertia=(0.01, 0.01, 0.01), position=(0.1 + length, 0, 0))
    m.revolute("main", crank, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.revolute("pin", rod, crank, at=(0.1, 0, 0), axis=(0, 0, 1))
    m.spherical("wrist", rod, block, at=(0.1 + length, 0, 0))
    m.translational("guide", block, m.ground, at=(0.1 + length, 0, 0), axis=(1, 0, 0))
    m.differential_state("lag", "20*(DX(guide.I, guide.J) - DIF(lag))")
    m.algebraic_state("squeeze", "50*TANH(10*VX(guide.I, guide.J)) + DIF(lag)")
    i, j = m.joints["main"].i, m.joints["main"].j
    m.torsion_spring("coil", i, j, stiffness=0.4, damping=0.001)
    m.torque("drive", crank, 6.0, axis=(0, 0, 1))
    return m


def top():
    """A heavy body that tumbles, so that its Euler angles change their reference on the way."""
    m = Mechanism("top", gravity=(0.0, 0.0, -9.81))
    body = m.body("top", mass=1.0, inertia=(0.02, 0.03, 0.045), position=(0, 0, 0.2), angular_velocity=(3.0, 9.0, 4.0))
    m.spherical("foot", body, m.ground, at=(0, 0, 0))
    return m


def advanced(m, times, **options):
    """Return a simulator that has gone through some times."""
    sim = gm.Simulator(m, float(times[-1]), **options)
    for t in times[1:]:
        sim.advance(t)
    return sim


@pytest.mark.parametrize(
    ("model", "options"),
    [
        (slider_crank, {}),
        (slider_crank, {"integrator": "GSTIFF"}),
        (slider_crank, {"breakpoints": [0.3, 0.61]}),
        (slider_crank, {"formulation": "SI1"}),
        (top, {}),
        (top, {"interpolate": False}),
    ],
)
def test_points_are_outputs_of_one_run(model, options):
    """Many points in a step and many steps between two points, on the way through changes of coordinates."""
    times = np.concatenate((np.linspace(0.0, 0.6, 13), np.linspace(0.602, 0.7, 50), [1.0]))
    one = model().simulate(1.0, t_eval=times, **options)
    solution = advanced(model(), times, **options).solution()
    assert one.success
    np.testing.assert_array_equal(solution.result.y, one.result.y)
    np.testing.assert_array_equal(solution.result.yp, one.result.yp)
    for body in one.system.body_names:
        np.testing.assert_array_equal(solution.com_acceleration(body), one.com_acceleration(body))
    if model is top:
        assert len(one.result.epochs) > 1


@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize("model", [slider_crank, top])
@pytest.mark.slow
def test_continuations_are_exact(model, integrator, tmp_path):
    """In the same simulator, in another one, from a file, and in a run: the same states, bit for bit."""
    times = np.linspace(0.0, 1.0, 47)
    for at in (3, 33):
        sim = gm.Simulator(model(), 1.0, integrator=integrator)
        for t in times[1 : at + 1]:
            sim.advance(t)
        state = sim.state()
        for t in times[at + 1 :]:
            sim.advance(t)
        wanted = sim.solution().result.y
        sim.restore(state)
        for t in times[at + 1 :]:
            sim.advance(t)
        np.testing.assert_array_equal(sim.solution().result.y, wanted)
        read = gm.State.load(state.save(tmp_path / "s.npz"))
        for name in ("y", "yp"):
            np.testing.assert_array_equal(getattr(read, name), getattr(state, name))
        for other in (state, read):
            sim = gm.Simulator(model(), 1.0, integrator=integrator, initial=other)
            for t in times[at + 1 :]:
                sim.advance(t)
            np.testing.assert_array_equal(sim.solution().result.y, wanted[at:])
            run = model().simulate(1.0, t_eval=times[at:], integrator=integrator, initial=other)
            np.testing.assert_array_equal(run.result.y, wanted[at:])


@pytest.mark.parametrize("records", [True, False])
@pytest.mark.parametrize("model", [slider_crank, top])
@pytest.mark.slow
def test_branches_from_states_of_one_run(model, records):
    """Every state on the way, gone back to out of order and more than once, is left as the first time, bit for bit."""
    times = np.linspace(0.0, 1.0, 41)
    sim = gm.Simulator(model(), 1.0, records=records)
    states, passed = [], []
    for t in times[1:]:
        sim.advance(t)
        states.append(sim.state())
        passed.append(sim.state().y)
    pickled = pickle.loads(pickle.dumps(states[11]))
    in_place = sim._run
    for first in (7, 29, 7, 11, 0, 38, 11):
        sim.restore(states[first])
        # with records a state whose point is gone begins a run of its own
        assert records or sim._run is in_place
        np.testing.assert_array_equal(sim.state().y, passed[first])
        for k in range(first + 1, min(first + 12, len(states))):
            sim.advance(times[k + 1])
            np.testing.assert_array_equal(sim.state().y, passed[k])
            np.testing.assert_array_equal(sim.state().yp, states[k].yp)
        if records:
            # points of what was left behind are gone, and coordinates are those of their time
            told = sim.solution().t
            np.testing.assert_array_equal(told, times[k + 2 - len(told) : k + 2])
    other = gm.Simulator(model(), 1.0, initial=pickled)
    other.advance(times[20])
    np.testing.assert_array_equal(other.state().y, passed[19])


@pytest.mark.slow
def test_a_state_brings_no_tolerance_and_no_order():
    """A run that goes on from a loose one has its own tolerance and largest order, as one that began with them."""
    state = advanced(slider_crank(), (0.0, 0.3), tol=1e-4).state()
    exact = slider_crank().simulate(1.0, t_eval=[0.3, 1.0], tol=1e-11, initial=state)

    def error(run):
        off = run.com_position("block") - exact.com_position("block")
        return float(np.abs(off[-1]).max())

    loose, tight = (slider_crank().simulate(1.0, t_eval=[0.3, 1.0], tol=tol, initial=state) for tol in (1e-4, 1e-9))
    assert tight.stats.steps > 2 * loose.stats.steps
    assert error(tight) < 1e-2 * error(loose)
    low, usual = (slider_crank().simulate(1.0, t_eval=[0.3, 1.0], tol=1e-5, initial=state, max_order=k) for k in (1, 6))
    assert low.stats.steps > 5 * usual.stats.steps


@pytest.mark.parametrize("at", [0.15, 0.2, 0.25, 0.3, 0.35])
@pytest.mark.slow
def test_a_state_of_a_loose_run_is_gone_on_from_afresh_by_tight_ones(at, tmp_path):
    """What it remembers is off from one point to the next by its own tolerance; as tight a run goes on with that."""
    state = advanced(slider_crank(), (0.0, at), tol=1e-4).state()
    read = gm.State.load(state.save(tmp_path / "s.npz"))
    for given in (state, read):
        assert given.history.tol == 1e-4
        tight, alone = (
            slider_crank().simulate(1.0, t_eval=[at, 1.0], tol=1e-9, initial=each)
            for each in (given, given.without_history())
        )
        assert tight.success, tight.message
        np.testing.assert_array_equal(tight.result.y, alone.result.y)
    exact = slider_crank().simulate(1.0, t_eval=[at, 1.0], tol=1e-11, initial=state)
    off = tight.com_position("block")[-1] - exact.com_position("block")[-1]
    assert np.abs(off).max() < 1e-8
    loose, alone = (
        slider_crank().simulate(1.0, t_eval=[at, 1.0], tol=1e-4, initial=each)
        for each in (state, state.without_history())
    )
    assert loose.success
    assert not np.array_equal(loose.result.y[-1], alone.result.y[-1])


@pytest.mark.parametrize(("model", "joint"), [(slider_crank, "pin"), (top, "foot")])
@pytest.mark.slow
def test_a_state_of_a_loose_run_is_moved_onto_the_constraints(model, joint):
    """It leaves them open by its own tolerance: tighter runs close them, by no more, and go on with theirs."""
    state = model().simulate(1.0, tol=1e-4, dense_output=True).state_at(0.5007)
    soon = state.t + 1e-7
    runs = [model().simulate(1.0, t_eval=[state.t, soon, 1.0], initial=state, tol=tol) for tol in (1e-8, 1e-10)]
    body = runs[0].system.body_names[0]
    for run in runs:
        assert run.success
        assert run.constraint_violation.max() < 1e-7
        assert np.abs(run.result.y[0] - state.y).max() < 1e-4
    assert "moved onto" in runs[1].message
    np.testing.assert_allclose(runs[0].com_position(body)[-1], runs[1].com_position(body)[-1], atol=1e-6)
    sim = gm.Simulator(model(), 1.0, initial=state, tol=1e-10)
    # a simulator stands at the state as it is given until it goes on
    moved = np.abs(runs[1].result.y[0] - state.y)[: runs[1].problem.names.index(f"R_x({body})")].max()
    np.testing.assert_allclose(
        sim.get("reaction", joint)[0], runs[1].reaction(joint)[0][0], rtol=1e-6, atol=max(moved, 1e-6)
    )
    sim.advance(soon)
    np.testing.assert_allclose(sim.get("reaction", joint)[0], runs[1].reaction(joint)[0][1], rtol=1e-9, atol=1e-9)
    sim.advance(1.0)
    np.testing.assert_array_equal(sim.solution().result.y[-1], runs[1].result.y[-1])


@pytest.mark.slow
def test_states_of_a_loose_run_go_on_from_any_time():
    """Also where they are off by a few tolerances only, which no step of any size would accept."""
    m = slider_crank()
    loose = m.simulate(0.7, tol=1e-4, dense_output=True)
    for t in np.linspace(0.31, 0.67, 10):
        run = m.simulate(t + 2e-3, t_eval=[t, t + 2e-3], initial=loose.state_at(t), tol=1e-8, max_steps=2000)
        assert run.success, run.message


def test_branches_with_inputs():
    """A branch with another input leaves nothing behind in the state that it began in."""
    m = disc(0.0)
    m.torque("load", m.bodies["disc"], m.input("load", "N m"))
    sim = gm.Simulator(m, 1.0)
    sim.set("load", 4.0)
    sim.advance(0.3)
    state = sim.state()
    ends = []
    for value, hold in ((None, 0), (10.0, 0), (10.0, 1), (None, 0)):
        sim.restore(state)
        if value is not None:
            sim.set("load", value, hold=hold)
        for t in (0.4, 0.5):
            sim.advance(t)
        ends.append(float(sim.get("angular_velocity", "disc")[2]))
    assert ends[0] == ends[3] == pytest.approx(1.0, rel=1e-9)
    assert ends[1:3] == pytest.approx([1.6, 1.45], rel=1e-6)  # the tolerance


def disc(torque):
    """A disc of 2 kg m^2 with a torque (N m)."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, torque)
    return m


def test_a_history_goes_with_its_equations_only(tmp_path):
    """The step that passed the state was made with the torque of before: with another one a run starts afresh."""
    sim = gm.Simulator(disc(1.0), 10.0)
    sim.advance(1.0)
    state = sim.state()
    for initial in (state, gm.State.load(state.save(tmp_path / "s.npz"))):
        for torque, angle in ((-5.0, -0.5), (3.0, 1.5), (1.0, 1.0)):
            branch = gm.Simulator(disc(torque), 10.0, initial=initial)
            branch.advance(2.0)
            assert branch.get("joint_angle", "pin") == pytest.approx(angle, abs=1e-5)
            run = disc(torque).simulate(10.0, t_eval=[1.0, 2.0, 10.0], initial=initial)
            assert run.joint_angle("pin")[1] == pytest.approx(angle, abs=1e-5)
            other = gm.Simulator(disc(torque), 10.0)
            other.restore(initial)
            other.advance(2.0)
            assert other.get("angular_velocity", "disc")[2] == pytest.approx(0.5 + 0.5 * torque, abs=1e-5)


@pytest.mark.slow
def test_functions_of_python_are_the_same_only_if_they_are_one(tmp_path):
    """The same text with another function is another model, also where the first one is gone."""

    def driven(scale):
        m = disc("FAST(TIME)")
        m.function("fast", lambda t: scale * (1.0 + 0.0 * t))
        return m

    m = driven(1.0)
    sim = gm.Simulator(m, 10.0)
    sim.advance(1.0)
    state = sim.state()
    read = gm.State.load(state.save(tmp_path / "s.npz"))
    sim.advance(2.0)
    wanted = sim.solution().result.y[-1]
    for initial in (state, read):
        same = gm.Simulator(m, 10.0, initial=initial)
        same.advance(2.0)
        np.testing.assert_array_equal(same.solution().result.y[-1], wanted)
    del sim, same, m
    gc.collect()
    for initial in (state, read):
        other = gm.Simulator(driven(-5.0), 10.0, initial=initial)
        other.advance(2.0)
        assert other.get("joint_angle", "pin") == pytest.approx(-0.5, abs=1e-5)


@pytest.mark.slow
def test_the_page_on_steps_says_what_comes_out(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    page = (Path(__file__).parents[2] / "docs" / "howto" / "stepping.md").read_text()
    exec("\n".join(re.findall(r"```\{code-cell\} ipython3\n(.*?)```", page, re.DOTALL)), {})
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("lowest at")
    assert told[1:3] == ["True", "True"]
    # 2 w' = u - 0.5 w: u = 4 for 0.5 s, then 4 + 60 t for 0.1 s with the solution 120 t - 472; then w' = 5
    speed = 8.0 * (1.0 - np.exp(-0.125))
    speed = (speed + 472.0) * np.exp(-0.025) - 472.0 + 120.0 * 0.1 + 5.0 * 0.4
    assert float(told[3].split()[1]) == pytest.approx(speed, abs=1e-5)
    assert float(told[4]) == pytest.approx(10.0, abs=0.5)


def test_pair_of_the_paper():
    """With its bodies as one and with all of them."""
    m = case_mechanism(gm.Case())
    for lump in (True, False):
        times = np.linspace(0.0, 0.02 if lump else 0.005, 101)
        sim = gm.Simulator(m, float(times[-1]), lump=lump, **PAIR)
        for t in times[1:51]:
            sim.advance(t)
        state = sim.state()
        for t in times[51:]:
            sim.advance(t)
        one = m.simulate(float(times[-1]), t_eval=times, lump=lump, **PAIR)
        np.testing.assert_array_equal(sim.solution().result.y, one.result.y)
        sim.restore(state)
        for t in times[51:]:
            sim.advance(t)
        np.testing.assert_array_equal(sim.solution().result.y, one.result.y)
        assert_all_names_agree(m, sim, one)


@pytest.mark.slow
def test_values_are_those_of_the_solution():
    times = np.linspace(0.0, 1.0, 31)
    one = slider_crank().simulate(1.0, t_eval=times)
    sim = gm.Simulator(slider_crank(), 1.0)
    for k, t in enumerate(times[1:], start=1):
        sim.advance(t)
        force, moment = sim.get("reaction", "pin")
        np.testing.assert_allclose(force, one.reaction("pin")[0][k], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(sim.get("load", "coil")[1], one.load("coil")[1][k], rtol=1e-9, atol=1e-12)
        assert sim.get("joint_angle", "main") == pytest.approx(one.joint_angle("main")[k], rel=1e-12)
        assert sim.get("state", "lag") == one.state("lag")[k]
        text = "AZ(main.I, main.J) + DX(guide.I, guide.J)"
        assert sim.get("evaluate", text) == pytest.approx(one.evaluate(text)[k], rel=1e-12)
        assert moment.shape == (3,)
    assert abs(one.joint_angle("main")[-1]) > 2 * np.pi
    assert sim.real_time_factor > 0.0


@pytest.mark.slow
def test_states_of_a_solution(tmp_path):
    """They start a run afresh, with the turns counted until then."""
    times = np.linspace(0.0, 1.0, 1001)
    one = slider_crank().simulate(1.0, t_eval=times, dense_output=True)
    for state in (one.state_at(times[800]), gm.State.load(one.state_at(0.8034).save(tmp_path / "a.npz"))):
        assert state.history is None
        later = slider_crank().simulate(1.0, t_eval=[state.t, *times[804:]], initial=state)
        assert later.success
        for get in (lambda s: s.com_position("block"), lambda s: s.load("coil")[1]):
            np.testing.assert_allclose(get(later)[1:], get(one)[804:], rtol=1e-4, atol=2e-5)
        again = slider_crank().simulate(1.0, t_eval=[state.t, *times[804:]], initial=later.state_at(times[900]).of(
            later.problem, state.t, state.y, state.yp, state.tables(slider_crank().compile().problem()), origin=state
        ))  # fmt: skip
        np.testing.assert_array_equal(again.result.y, later.result.y)
    turned = later.state_at(times[950])
    last = slider_crank().simulate(1.0, initial=turned)
    np.testing.assert_allclose(last.load("coil")[1][-1], one.load("coil")[1][-1], rtol=1e-3)


@pytest.mark.slow
def test_what_does_not_fit_is_refused(tmp_path):
    sim = gm.Simulator(slider_crank(), 1.0)
    sim.advance("0.2 s")
    state = sim.state()
    with pytest.raises(ModelError, match=says("unknown", "'u_x(crank)'", "'u_x(top)'", "take")):
        top().simulate(1.0, initial=state)
    other = slider_crank()
    other.body("more", mass=1.0, inertia=(0.1, 0.1, 0.1))
    with pytest.raises(ModelError, match=says("state", "unknown", "take")):
        other.simulate(1.0, initial=state)
    with pytest.raises(ModelError, match=says("87", "70", "'mu(main:")):
        slider_crank().simulate(1.0, initial=state, formulation="I3")
    with pytest.raises(ModelError, match=says("0.2", "t_start", "0.5", "leave")):
        slider_crank().simulate(1.0, initial=state, t_start=0.5)
    for t_end in (0.1, 0.2):
        with pytest.raises(ModelError, match=says("t_end", "0.2")):
            slider_crank().simulate(t_end, initial=state)
    with pytest.raises(ModelError, match=says("0.1", "later", "t_end")):
        gm.Simulator(slider_crank(), 0.1).restore(state)
    late, early = gm.Simulator(slider_crank(), 1.0, initial=state), gm.Simulator(slider_crank(), 1.0).state()
    with pytest.raises(ModelError, match=says("pass", "initial=")):
        late.restore(early)
    # a wheel of other size has a state of the same kind, and another integrator starts afresh from it
    assert slider_crank(0.3).simulate(0.3, initial=state, integrator="IDA").success
    assert slider_crank(0.3).simulate(0.3, initial=state, t_start=0.2).success
    path = tmp_path / "cut.npz"
    path.write_bytes(state.save(tmp_path / "s.npz").read_bytes()[:5000])
    with pytest.raises(ModelError, match=says("cut.npz", "whole")):
        gm.State.load(path)
    with pytest.raises(ModelError, match=says("state", ".npz")):
        state.save(tmp_path / "s.txt")
    afresh = slider_crank().simulate(0.3, initial=state.without_history())
    gone_on = slider_crank().simulate(0.3, t_eval=[0.2, 0.3], initial=state)
    np.testing.assert_allclose(afresh.com_position("block")[-1], gone_on.com_position("block")[-1], atol=1e-5)
    for start in (gm.Simulator, Mechanism.simulate):
        with pytest.raises(ModelError, match=says("initial", "'s.npz'", "State.load")):
            start(slider_crank(), 1.0, initial="s.npz")
    with pytest.raises(ModelError, match=says("0.2", "Joints", "centres", "make")):
        gm.Simulator(slider_crank(0.4), 1.0, initial=state).advance(0.3)
    solution = slider_crank().simulate(1.0, rate=10)
    with pytest.raises(ModelError, match=says("0.55", "output", "times")):
        solution.state_at(0.55)
    with pytest.raises(ModelError, match=says("take", "Simulator")):
        slider_crank().simulate(3.0, t_eval=[0.0, 2.9, 3.0]).state_at(3.0)


def test_wrong_calls_say_what_to_do():
    sim = gm.Simulator(top(), 1.0, records=False)
    sim.advance(0.2)
    for t, told in (
        (0.1, "restore"),
        (float("nan"), says("t", "NaN", "give a finite")),
        (2.0, "later t_end"),
        ("5 mm", says("t", "'5 mm'", "'1 s'")),
    ):
        with pytest.raises(ModelError, match=told) as error:
            sim.advance(t)
        assert "\n" not in str(error.value)
    assert sim.t == 0.2
    sim.advance(0.2)
    with pytest.raises(ModelError, match=says("'com_positon'", "com_position")):
        sim.get("com_positon", "top")
    with pytest.raises(KeyError, match=says("'wheel'", "top")):
        sim.get("com_position", "wheel")
    for asked, told in (
        (("kinetic_energy", "top"), ("'kinetic_energy'", "no name", "'top'")),
        (("com_position",), ("'com_position'", "body", "none")),
        (("com_position", "top", "z"), ("'com_position'", "body", "'top', 'z'")),
        (("output",), ("'output'", "name", "none")),
    ):
        with pytest.raises(ModelError, match=says(*told)):
            sim.get(*asked)
    with pytest.raises(ModelError, match=says("expression", "3", "text")):
        sim.get("evaluate", 3)
    assert sim.get("kinetic_energy") > 0.0
    for name in ("t", "t_end"):
        with pytest.raises(ModelError, match=says(name, "0.1", "another one")):
            setattr(sim, name, 0.1)
    for other in (None, "state.npz"):
        with pytest.raises(ModelError, match=says("restore", repr(other), "State.load")):
            sim.restore(other)
    with pytest.raises(ModelError, match=says("'top'", "Mechanism")):
        gm.Simulator("top", 1.0)
    with pytest.raises(ModelError, match="records=True"):
        sim.solution()
    with pytest.raises(ModelError, match=says("IDA", "WSTIFF")):
        gm.Simulator(top(), 1.0, integrator="IDA")
    with pytest.raises(ModelError, match="dense_output"):
        gm.Simulator(top(), 1.0, dense_output=True)


def test_a_failure_can_be_gone_back_from():
    m = Mechanism("burst")
    body = m.body("body", mass=1.0, inertia=(0.1, 0.1, 0.1))
    m.revolute("pin", body, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.torque("load", body, functions.expression("SQRT(0.5 - TIME)"))
    sim = gm.Simulator(m, 1.0)
    sim.advance(0.3)
    state = sim.state()
    with pytest.raises(ModelError, match=says("finite", "0.5", "N_x(load)")):
        sim.advance(0.7)
    with pytest.raises(ModelError, match=says("failed", "restore")):
        sim.advance(0.4)
    with pytest.raises(ModelError, match=says("simulation has failed", "0.5")):
        sim.state()
    sim.restore(state)
    sim.advance(0.4)
    assert sim.solution().success
    one = m.simulate(0.4, t_eval=[0.0, 0.3, 0.4])
    np.testing.assert_allclose(sim.solution().com_velocity("body"), one.com_velocity("body"), atol=1e-9)


def planets():
    """A planetary set whose meshes are forces given by equations, unknowns of their own."""
    wheels = GearSpec(28, "2 mm"), GearSpec(36, "2 mm"), GearSpec.ring(100, "2 mm")
    gears = PlanetarySet(*wheels, planets=4, ideal=(1e8, 1e8))
    return planetary_mechanism(gears, speeds={"sun": 50.0}, torques={"carrier": -20.0}, run_up=0.01), {"tol": 1e-5}


@pytest.mark.slow
def test_planetary_set():
    m, _ = planets()
    times = np.linspace(0.0, 0.02, 41)
    sim = gm.Simulator(m, 0.02, tol=1e-5)
    for t in times[1:21]:
        sim.advance(t)
    state = sim.state()
    for t in times[21:]:
        sim.advance(t)
    one = m.simulate(0.02, t_eval=times, tol=1e-5)
    np.testing.assert_array_equal(sim.solution().result.y, one.result.y)
    assert_all_names_agree(m, sim, one)
    run = m.simulate(0.02, t_eval=times[20:], tol=1e-5, initial=state)
    np.testing.assert_array_equal(run.result.y, one.result.y[20:])


def rolling_train():
    """A stage with ball bearings at the seats of one shaft and a housing with a mode of its own on mounts."""
    mode = HousingMode(
        name="panel", mass=5.0, stiffness=5.0 * (2 * np.pi * 700) ** 2, damping_ratio=0.01, shape={"a": (0.0, 0.0, 0.1)}
    )
    mounts = [Mount(name=f"mount {x}", at=(x, 0.0, -0.1), stiffness=(1e7, 1e7, 2e7)) for x in (-0.2, 0.2)]
    bearings = [IdealBearing(name="a", shaft="in")] + [
        RollingContactBearing(name=name, shaft="out", station=station, rolling="6206", settings={})
        for name, station in (("left", 0.02), ("right", 0.08))
    ]
    wheels = [
        Wheel(name="pinion", shaft="in", station=0.035, gear=GearSpec(20, "3 mm", name="pinion")),
        Wheel(name="gear", shaft="out", station=0.035, gear=GearSpec(60, "3 mm", name="gear")),
    ]
    housing = Housing(name="box", mass=40.0, inertia=(0.6, 0.8, 1.0), at=(0.1, 0.0, 0.0), mounts=mounts, modes=[mode])
    sensors = [
        SpeedSensor(name="tacho", shaft="out"),
        TorqueSensor(name="torque", of="brake"),
        Laser(name="laser", shaft="in", direction=(0.0, 1.0, 0.0), offset=0.002),
        Accelerometer(name="pickup", bearing="a", direction=(0.0, 0.6, 0.8)),
    ]
    train = stage(wheels=wheels, bearings=bearings, housings=[housing], sensors=sensors, run_up=0.01, running=True)
    return train.changed("mesh", settings=QUIET).build(), {"tol": 1e-7, "rate_scale": train.rate_scale}


def flexible_pair():
    """The pair of the paper on flexible shafts."""
    return flexible_rig(gm.Case().pair(), speed="300 rpm", modes=1), {"tol": 1e-6, "rate_scale": 3000.0}


@pytest.mark.slow
@pytest.mark.parametrize("model", [rolling_train, flexible_pair])
def test_drivetrains_go_on_as_one_run(model):
    """Outputs of 200 points, and those that follow a state half-way; every quantity of the last point."""
    m, options = model()
    end = 0.004
    times = np.linspace(0.0, end, 201)
    one = m.simulate(end, t_eval=times, **options)
    sim = gm.Simulator(m, end, **options)
    for t in times[1:101]:
        sim.advance(t)
    state = sim.state()
    for restored in (False, True):
        if restored:
            sim.restore(state)
        for t in times[101:]:
            sim.advance(t)
        np.testing.assert_array_equal(sim.solution().result.y, one.result.y)
    told = assert_all_names_agree(m, sim, one)
    assert told["output"] == len(m.outputs) == (4 if model is rolling_train else 0)
