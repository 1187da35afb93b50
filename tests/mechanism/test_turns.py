"""Angles count their turns as the run has counted them: at outputs however far apart, and from a state on."""

import warnings

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism
from tests.generators import cases, seed
from tests.says import says

INTEGRATORS = ("WSTIFF", "GSTIFF", "IDA")


def oscillator():
    """30 sin t: almost five turns to either side."""
    m = Mechanism("oscillator")
    body = m.body("wheel", mass=1.0, inertia=(1.0, 1.0, 1.0), angular_velocity=(0.0, 0.0, 30.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torsion_spring("coil", m.joints["pin"].i, m.joints["pin"].j, stiffness=1.0)
    return m


def winding(rng):
    """A driven wheel and a free one behind a spring; a load by an expression, one by a variable, another frame each."""
    m = Mechanism("winding")
    speed, depth = rng.uniform(5.0, 60.0) * rng.choice([-1, 1]), rng.uniform(0.0, 20.0)
    first = m.body("first", mass=1.0, inertia=(0.1, 0.1, 0.1))
    second = m.body("second", mass=1.0, inertia=(0.2, 0.2, 0.2), position=(0, 0, 0.1), angular_velocity=(0, 0, speed))
    m.revolute("a", first, m.ground, axis=(0, 0, 1))
    m.revolute("b", second, m.ground, at=(0, 0, 0.1), axis=(0, 0, 1))
    pin = m.joints["a"], m.joints["b"]
    m.rotation("drive", m.joints["a"], f"{depth!r}*(1 - COS({rng.uniform(1.0, 4.0)!r}*TIME))")
    m.torsion_spring("coil", pin[0].i, pin[0].j, stiffness=rng.uniform(0.5, 2.0))
    m.torsion_spring("soft", pin[1].i, pin[1].j, stiffness=rng.uniform(0.0, 0.5), damping=rng.uniform(0.0, 0.05))
    m.algebraic_state("wound", "AZ(b.I, b.J)")
    m.load("by_angle", pin[1].i, pin[1].j, tz=f"{-rng.uniform(0.0, 0.2)!r}*AZ(b.I, b.J)")
    m.load("by_state", pin[1].i, pin[1].j, tz="-0.1*VARVAL(wound)")
    return m


def told(solution):
    """What hangs on turns."""
    return {
        **{name: solution.load(name)[1][:, 2] for name in ("coil", "soft", "by_angle", "by_state")},
        **{f"angle {name}": solution.joint_angle(name) for name in ("a", "b")},
        "AZ": solution.evaluate("AZ(b.I, b.J)"),
        "drive": solution.reaction("drive")[1][:, 2],
        "load_torque": solution.to_dataset().load_torque.values[:, :, 2],
    }


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.slow
def test_random_windings_are_the_same_at_coarse_and_fine_outputs(integrator):
    rng = np.random.default_rng(seed())
    fine = np.linspace(0.0, 3.0, 601)
    most = 0.0
    for _ in range(cases(20)):
        m = winding(rng)
        some = np.unique(np.concatenate([[0, 600], rng.choice(601, rng.integers(1, 9))]))
        lump = bool(rng.integers(2))
        options = {"tol": 1e-7, "integrator": integrator, "lump": lump}
        exact = told(m.simulate(3.0, t_eval=fine, **options))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = told(m.simulate(3.0, t_eval=fine[some], **options))
        for name, values in found.items():
            np.testing.assert_allclose(values, exact[name][some], atol=1e-3, rtol=1e-4, err_msg=name)
        most = max(most, np.abs(np.diff(found["angle b"])).max())
    assert most > 4.0 * np.pi


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("outputs", [9, 2])
def test_a_spring_that_winds_and_unwinds(integrator, outputs):
    t = np.linspace(0.0, 5.0, outputs)
    s = oscillator().simulate(5.0, t_eval=t, tol=1e-8, integrator=integrator)
    for angle in (-s.load("coil")[1][:, 2], s.joint_angle("pin"), s.evaluate("AZ(pin.I, pin.J)")):
        np.testing.assert_allclose(angle, 30.0 * np.sin(t), atol=1e-4)


@pytest.mark.parametrize("step", [0.1, 0.25, 1.0])
def test_a_constant_speed_over_whole_turns(step):
    m = Mechanism("steady")
    body = m.body("wheel", mass=1.0, inertia=(1.0, 1.0, 1.0), angular_velocity=(0.0, 0.0, 30.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torsion_spring("coil", m.joints["pin"].i, m.joints["pin"].j, stiffness=1e-9)
    t = np.arange(0.0, 4.0 + step / 2, step)
    s = m.simulate(4.0, t_eval=t)
    np.testing.assert_allclose(s.load("coil")[1][:, 2], -30e-9 * t, rtol=1e-5, atol=1e-15)
    steps = m.simulate(4.0, every_step=True)
    np.testing.assert_allclose(steps.load("coil")[1][:, 2], -30e-9 * steps.t, rtol=1e-5, atol=1e-15)
    parts = np.concatenate([part.load("coil")[1][:, 2] for part in s.parts(size=2)])
    np.testing.assert_allclose(parts, -30e-9 * t, rtol=1e-5, atol=1e-15)


def test_measures_begin_at_the_turns_of_a_state():
    """In another simulator, in a run of its own and in one that was put back."""
    m, t = oscillator(), np.linspace(1.0, 3.0, 5)
    sim = gm.Simulator(m, t_end=3.0, tol=1e-8)
    sim.advance(1.0)
    state = sim.state()
    again = gm.Simulator(m, t_end=3.0, tol=1e-8, initial=state)
    assert again.get("joint_angle", "pin") == pytest.approx(30.0 * np.sin(1.0), abs=1e-4)
    assert again.get("evaluate", "AZ(pin.I, pin.J)") == pytest.approx(30.0 * np.sin(1.0), abs=1e-4)
    sim.advance(2.5)
    sim.restore(state)
    for one in (sim, again):
        one.advance(3.0)
        assert one.get("joint_angle", "pin") == pytest.approx(30.0 * np.sin(3.0), abs=1e-4)
        found = one.solution()
        np.testing.assert_allclose(-found.load("coil")[1][:, 2], 30.0 * np.sin(found.t), atol=1e-4)
    for options in ({"t_eval": t}, {"every_step": True}):
        run = m.simulate(3.0, initial=state, tol=1e-8, **options)
        for angle in (run.joint_angle("pin"), run.evaluate("AZ(pin.I, pin.J)"), -run.load("coil")[1][:, 2]):
            np.testing.assert_allclose(angle, 30.0 * np.sin(run.t), atol=1e-4)


def test_markers_of_one_name_are_not_taken_for_each_other():
    """Two wheels with a marker 'rim' each, of which an element counts the turns of one."""
    m = Mechanism("twins")
    for name, speed in (("slow", 2.0), ("fast", 20.0)):
        body = m.body(name, mass=1.0, inertia=(1.0, 1.0, 1.0), angular_velocity=(0.0, 0.0, speed))
        m.revolute(f"pin_{name}", body, m.ground, axis=(0, 0, 1))
        body.marker((0.1, 0, 0), name="rim")
    rims = [marker for body in m.bodies.values() for marker in body.markers if marker.name == "rim"]
    m.torsion_spring("coil", rims[1], m.joints["pin_fast"].j, stiffness=1e-9)
    s = m.simulate(3.0, t_eval=[0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(s.joint_angle("pin_slow"), 2.0 * s.t, atol=1e-5)
    np.testing.assert_allclose(s.joint_angle("pin_fast"), 20.0 * s.t, atol=1e-5)
    np.testing.assert_allclose(s.load("coil")[1][:, 2], -20e-9 * s.t, atol=1e-12)


def test_two_outputs_cannot_tell_turns_that_nothing_counts():
    """Unless the speed is the same at both, which leaves nothing to doubt."""
    m = oscillator()
    del m.elements["coil"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert m.simulate(5.0, t_eval=[0.0, 5.0]).joint_angle("pin")[-1] == pytest.approx(150.0, abs=1e-4)
    pin = m.joints["pin"]
    m.load("brake", pin.i, pin.j, tz="-6*SIN(2*TIME)")
    sparse = m.simulate(5.0, t_eval=[0.0, 4.5])
    with pytest.warns(UserWarning, match=says("joint 'pin'", "4.5", "higher rate")):
        sparse.joint_angle("pin")


@pytest.mark.parametrize("lump", [False, True])
@pytest.mark.parametrize("at", ["state", "solution"])
def test_a_plant_begins_at_the_turns_that_have_been_made(at, lump):
    """J w' = -c a - d a^3 after almost two turns; of what the model does not count a solution knows the turns."""
    m = Mechanism("hard")
    wheel = m.body("wheel", mass=1.0, inertia=(2.0, 2.0, 2.0), angular_velocity=(0.0, 0.0, 30.0))
    m.revolute("pin", wheel, m.ground, axis=(0, 0, 1))
    i, j = wheel.marker(name="s.I"), m.ground.marker(name="s.J")
    m.torsion_spring("coil", i, j, stiffness=3.0)
    m.axis_torque("hard", i, j, "-0.05*AZ(s.I, s.J)**3")
    m.torque("drive", wheel, m.input("u", "N m"))
    m.output("energy", "AZ(s.I, s.J)**2")
    m.lump = lump
    sim = gm.Simulator(m, 1.0, tol=1e-9)
    for t in np.linspace(0.0, 0.4, 41)[1:]:
        sim.advance(t)
    angle = sim.get("joint_angle", "pin")
    assert angle > 3.0 * np.pi
    if at == "state":
        plant = m.linearize(["u"], ["energy"], at=sim.state())
    else:
        plant = m.linearize(["u"], ["energy", ("joint_angle", "pin"), "AZ(pin.I, pin.J)**2"], at=sim.solution())
        assert plant.point.outputs[1:] == pytest.approx([angle, angle**2], rel=1e-9)
        assert plant.C[2] == pytest.approx(plant.C[0], rel=1e-9)
    assert plant.A[1, 0] == pytest.approx(-(3.0 + 0.15 * angle**2) / 2.0, rel=1e-9)
    assert plant.C[0, 0] == pytest.approx(2.0 * angle, rel=1e-9)
    assert plant.point.outputs[0] == pytest.approx(sim.get("output", "energy"), rel=1e-9)


@pytest.mark.parametrize("counted", [True, False])
def test_a_state_knows_the_turns_that_something_counts(counted):
    """10 rad: an algebraic state counts them, an output does not, as the page on steps says."""
    m = Mechanism("wheel")
    wheel = m.body("wheel", mass=1.0, inertia=(1.0, 1.0, 1.0), angular_velocity=(0.0, 0.0, 10.0))
    m.revolute("pin", wheel, m.ground, axis=(0, 0, 1))
    (m.algebraic_state if counted else m.output)("turned", "AZ(pin.I, pin.J)")
    sim = gm.Simulator(m, 2.0)
    for t in np.linspace(0.0, 1.0, 21)[1:].tolist():
        sim.advance(t)
    state, angle = sim.state(), 10.0 if counted else 10.0 - 4.0 * np.pi
    assert sim.get("joint_angle", "pin") == pytest.approx(10.0, abs=1e-6)
    assert gm.Simulator(m, 2.0, initial=state).get("joint_angle", "pin") == pytest.approx(angle, abs=1e-6)
    plant = m.linearize([("torque", "pin")], [("joint_angle", "pin")], at=state)
    assert plant.point.outputs == pytest.approx([angle], abs=1e-6)


def under_an_input(level=None):
    """Return a disc of 2 kg m2 that an input turns: by its torque, or by a motion of a level."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    pin = m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    if level is None:
        m.torque("drive", body, m.input("u", "N m"))
    else:
        m.rotation("drive", pin, m.input("u", "rad" if level == "displacement" else "rad/s"), level=level)
    m.output("angle", "AZ(pin.I, pin.J)")
    return m


def test_a_controller_sees_the_angle_at_its_samples():
    """Whatever points are recorded: a sampled position loop is the same as one that advances from sample to sample."""
    ends = []
    for points in (1, 25):
        sim, seen = gm.Simulator(under_an_input(), 0.5), []

        def loop(t, sim, seen=seen):
            angle = sim.get("joint_angle", "pin")
            seen.append((angle, sim.get("output", "angle"), sim.get("evaluate", "AZ(pin.I,pin.J)")))
            return 50.0 * (9.0 - angle) - 20.0 * sim.get("joint_rate", "pin")

        sim.control("u", loop, sample_time=0.02)
        for t in np.linspace(0.0, 0.5, points + 1)[1:].tolist():
            sim.advance(t)
        np.testing.assert_allclose(np.ptp(seen, axis=1), 0.0, atol=1e-12)
        ends.append(sim.get("joint_angle", "pin"))
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    assert ends[0] > 1.0


def test_angles_at_points_that_are_not_recorded():
    """Under 4 N m, t^2, more than two turns in all."""
    sim = gm.Simulator(under_an_input(), 4.0)
    sim.set("u", 4.0)
    for t, record in ((1.0, False), (2.0, False), (3.0, True), (3.5, False), (4.0, True)):
        sim.advance(t, record=record)
        assert sim.get("joint_angle", "pin") == pytest.approx(t * t, abs=1e-5)
        assert sim.get("output", "angle") == pytest.approx(t * t, abs=1e-5)
    assert sim.solution().t.tolist() == [0.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("level", "hold", "values", "angles"),
    [("displacement", 1, (0.0, 0.5, 0.6), (0.0, 0.5, 0.6)), ("velocity", 0, (0.0, 500.0, 1.0), (0.0, 0.5, 0.599))],
)
def test_turns_behind_a_jump_of_a_prescribed_speed(level, hold, values, angles):
    """500 rad/s for a millisecond, then 1 rad/s for 99: the speed before the jump is not one of what follows."""
    sim = gm.Simulator(under_an_input(level), 0.2)
    for t, value, angle in zip((0.1, 0.101, 0.2), values, angles, strict=True):
        sim.set("u", value, hold=hold)
        sim.advance(t)
        assert sim.get("joint_angle", "pin") == pytest.approx(angle, abs=1e-6)
        assert sim.get("output", "angle") == pytest.approx(angle, abs=1e-6)
    np.testing.assert_allclose(sim.solution().joint_angle("pin")[1:], angles, atol=1e-6)
    np.testing.assert_allclose(sim.solution().output("angle")[1:], angles, atol=1e-6)


def driven(kind, opposite=False):
    """A disc that a motion turns by some fifteen turns in a second, which nothing counts; its angle at a time."""
    m = Mechanism("driven")
    disc = m.body("disc", mass=1.0, inertia=(1.0, 1.0, 1.0))
    axes = np.diag([-1.0, -1.0, 1.0]) if opposite else np.eye(3)
    pin = m.joint("revolute", "pin", disc.marker_at((0, 0, 0), axes, name="I"), m.ground.marker(name="J"))
    given, level, angle = {
        "speed": (gm.mechanism.constant(100.0), "velocity", lambda t: 100.0 * t),
        "input": (m.input("speed", "rad/s", 100.0), "velocity", lambda t: 100.0 * t),
        "text": ("100*TIME + SIN(TIME)", "displacement", lambda t: 100.0 * t + np.sin(t)),
        "text of a speed": ("100 + COS(TIME)", "velocity", lambda t: 100.0 * t + np.sin(t)),
        "ahead": (gm.mechanism.polynomial([20.0, 100.0]), "displacement", lambda t: 20.0 + 100.0 * t),
    }[kind]
    begins = -np.pi if opposite else 0.0
    m.rotation("drive", pin, given, level=level, **({} if level == "displacement" else {"start": 0.0}))
    return m, lambda t: angle(t) + begins


@pytest.mark.parametrize("opposite", [False, True])
@pytest.mark.parametrize("kind", ["speed", "input", "text", "text of a speed", "ahead"])
def test_joints_that_motions_drive_begin_at_the_turns_of_a_state(kind, opposite):
    """In another simulator and in a run; the angle is the one that the motion prescribes, half a turn off as drawn."""
    m, angle = driven(kind, opposite)
    az = 'AZ("I", "J")'
    sim = gm.Simulator(m, t_end=1.0, tol=1e-8)
    sim.advance(0.04)
    sim.advance(0.06)
    other = gm.Simulator(m, t_end=1.0, tol=1e-8, initial=sim.state())
    for one in (sim, other):
        assert one.get("joint_angle", "pin") == pytest.approx(angle(0.06), abs=1e-5)
        assert one.get("evaluate", az) == pytest.approx(angle(0.06), abs=1e-5)
        one.advance(0.07)
        assert one.get("joint_angle", "pin") == pytest.approx(angle(0.07), abs=1e-5)
    found = m.simulate(0.1, initial=sim.state(), rate=1000)
    np.testing.assert_allclose(found.joint_angle("pin"), angle(found.t), atol=1e-5)
    np.testing.assert_allclose(found.evaluate(az), angle(found.t), atol=1e-5)


def test_motions_of_markers_of_one_name_are_not_taken_for_each_other():
    """Of two joints whose markers have the same names one is driven; both begin within half a turn."""
    m = Mechanism("twins")
    base = m.body("base", mass=1.0, inertia=(1.0, 1.0, 1.0))
    m.fixed("foot", base, m.ground)
    for name, speed, on in (("driven", 0.0, m.ground), ("free", 30.0, base)):
        body = m.body(name, mass=1.0, inertia=(1.0, 1.0, 1.0), angular_velocity=(0, 0, speed))
        m.joint("revolute", name, body.marker(name="I"), on.marker(name="J"))
    m.rotation("drive", m.joints["driven"], gm.mechanism.polynomial([20.0, 100.0]))
    solution = m.simulate(0.2, rate=200)
    np.testing.assert_allclose(solution.joint_angle("driven"), 20.0 - 6 * np.pi + 100.0 * solution.t, atol=1e-5)
    np.testing.assert_allclose(solution.joint_angle("free"), 30.0 * solution.t, atol=1e-5)


def test_a_speed_that_was_set_goes_on_with_its_turns():
    m, _ = driven("input")
    sim = gm.Simulator(m, t_end=1.0)
    sim.advance(0.1)
    sim.set("speed", 50.0)
    sim.advance(0.2)
    state = sim.state()
    for lump in (False, True):
        if lump:
            sim = gm.Simulator(m, t_end=1.0, lump=True)
            sim.advance(0.1)
            sim.set("speed", 50.0)
            sim.advance(0.2)
            state = sim.state()
        other = gm.Simulator(m, t_end=1.0, initial=state, lump=lump)
        assert other.get("joint_angle", "pin") == pytest.approx(15.0, abs=1e-6)
