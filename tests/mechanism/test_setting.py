"""Inputs that are set while a simulator goes on: against exact solutions, and bit for bit after going back."""

import numpy as np
import pytest
from scipy.linalg import expm

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError
from tests.says import says

PERIOD = 1e-3
SHAFT = {"stiffness": 400.0, "damping": 0.8}
A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-200, 200, -0.4, 0.4], [400, -400, 0.8, -0.8]])
B = np.array([0, 0, 0.5, 0.0])
"""Angles and speeds of two discs, 2 and 1 kg m^2, on a shaft; a torque on the first."""


def two_discs(lump=False):
    m = Mechanism("two discs")
    markers = []
    for name, inertia in (("a", 2.0), ("b", 1.0)):
        body = m.body(name, mass=1.0, inertia=(inertia,) * 3)
        m.revolute(f"pin {name}", body, m.ground, axis=(0, 0, 1))
        markers.append(body.marker(name=f"on {name}"))
    m.torsion_spring("shaft", *markers, **SHAFT)
    m.torque("drive", m.bodies["a"], m.input("load", "N m"))
    m.lump = lump
    return m


def held(x, u, slope, span):
    """Return x after a span with the torque u + slope t, exactly."""
    m = np.zeros((6, 6))
    m[:4, :4], m[:4, 4], m[4, 5] = A, B, 1.0
    return (expm(m * span) @ np.concatenate([x, [u, slope]]))[:4]


def unknowns(sim):
    angles = [sim.get("joint_angle", f"pin {name}") for name in "ab"]
    return np.array(angles + [sim.get("angular_velocity", name)[2] for name in "ab"])


@pytest.mark.slow
@pytest.mark.parametrize("lump", [False, True])
def test_a_sampled_controller(lump):
    """PI control of the speed each millisecond, the torque held in between: the exact solution of the sampled plant."""

    def torque(speed, memory):
        memory[0] += PERIOD * (10.0 - speed)
        return 3.0 * (10.0 - speed) + 5.0 * memory[0]

    x, memory = np.zeros(4), [0.0]
    for _ in range(300):
        x = held(x, torque(x[2], memory), 0.0, PERIOD)
    off = []
    for tol in (1e-8, 1e-10):
        sim, own = gm.Simulator(two_discs(lump), 1.0, tol=tol), [0.0]
        sim.control("load", lambda t, s, own=own: torque(s.get("angular_velocity", "a")[2], own), PERIOD)
        sim.advance(0.3)
        off.append(np.abs(unknowns(sim) - x).max())
        # a step or two for each sample, and not the fifty of a start
        assert sim.solution().stats.steps < 900
    assert off[1] < 1e-8
    assert off[1] < off[0] < 1e-6


@pytest.mark.parametrize("lump", [False, True])
def test_lines_and_steps(lump):
    """Held, led evenly, held where it was led to; and a second value at the same time counts alone."""
    sim, x = gm.Simulator(two_discs(lump), 1.0, tol=1e-9), np.zeros(4)
    sim.set("load", 50.0)
    assert sim.get("input", "load") == 50.0
    before = 0.0
    for k, (value, hold) in enumerate([(4.0, 0), (10.0, 1), (None, 0), (-2.0, 1), (6.0, 0), (0.0, 1), (0.0, 0)]):
        if value is not None:
            sim.set("load", value, hold)
        u = before if hold or value is None else value
        slope = (value - before) / 0.05 if hold else 0.0
        sim.advance(0.05 * (k + 1))
        x, before = held(x, u, slope, 0.05), before if value is None else value
        assert sim.get("input", "load") == pytest.approx(before, abs=1e-12)
        np.testing.assert_allclose(unknowns(sim), x, rtol=0, atol=3e-7)
    assert sim.get("com_acceleration", "a") == pytest.approx(0.0, abs=1e-9)
    solution = sim.solution()
    np.testing.assert_allclose(solution.input("load"), [4.0, 4.0, 10.0, 10.0, -2.0, 6.0, 0.0, 0.0], atol=1e-12)
    # the acceleration and expressions up to each point, where the torque jumps
    twist = solution.evaluate('0.5*(load - 400*AZ("on a", "on b") - 0.8*WZ("on a", "on b"))')
    np.testing.assert_allclose(solution.angular_acceleration("a")[:, 2], twist, rtol=0, atol=1e-9)


def test_the_past_is_left_alone():
    """What was returned up to the point of a jump stays, and does not depend on it."""
    ends = []
    for values in ((1.0, 1.0), (1.0, -7.0)):
        sim = gm.Simulator(two_discs(), 1.0)
        for k, value in enumerate(values):
            sim.set("load", value)
            sim.advance(0.01 * (k + 1))
        ends.append(sim.solution())
    np.testing.assert_array_equal(ends[0].result.y[:2], ends[1].result.y[:2])
    np.testing.assert_array_equal(ends[0].angular_acceleration("a")[:2], ends[1].angular_acceleration("a")[:2])
    assert abs(ends[0].angular_velocity("a")[2, 2] - ends[1].angular_velocity("a")[2, 2]) > 0.03


def tumbling():
    """A body that changes its Euler angles on the way, pulled by an input."""
    m = Mechanism("top", gravity=(0.0, 0.0, -9.81))
    body = m.body("top", mass=1.0, inertia=(0.02, 0.03, 0.045), position=(0, 0, 0.2), angular_velocity=(3.0, 9.0, 4.0))
    m.spherical("foot", body, m.ground, at=(0, 0, 0))
    i, j = body.marker(name="tip"), m.ground.marker(name="base")
    m.input("load", "N", 0.0)
    m.load("pull", i, j, fx="0.3*load", fy="-0.2*load")
    return m


@pytest.mark.parametrize("model", [two_discs, tumbling])
@pytest.mark.slow
def test_going_back_is_exact(model, tmp_path):
    """From a state taken before and after a value is set, in another simulator too, the same follows bit for bit."""
    values = np.random.default_rng(5).normal(size=60)

    def go(sim, first):
        for k in range(first, 60):
            sim.set("load", values[k], hold=int(k % 3 == 2))
            sim.advance(0.016 * (k + 1))
        return sim.solution()

    sim = gm.Simulator(model(), 1.0)
    wanted = go(sim, 0)
    if model is tumbling:
        assert len(wanted.result.epochs) > 1
    for at in (7, 33):
        sim = gm.Simulator(model(), 1.0)
        for k in range(at):
            sim.set("load", values[k], hold=int(k % 3 == 2))
            sim.advance(0.016 * (k + 1))
        before = sim.state()
        if at % 3 != 2:
            sim.set("load", values[at])
        states = [before, sim.state(), gm.State.load(before.save(tmp_path / "s.npz"))]
        again = go(sim, at)
        np.testing.assert_array_equal(again.result.y, wanted.result.y)
        for state in states:
            sim.restore(state)
            again = go(sim, at)
            np.testing.assert_array_equal(again.result.y, wanted.result.y)
            np.testing.assert_array_equal(again.input("load"), wanted.input("load"))
            other = go(gm.Simulator(model(), 1.0, initial=state), at)
            np.testing.assert_array_equal(other.result.y, wanted.result.y[at:])


@pytest.mark.parametrize("size", [3.0, 0.1])
def test_many_small_turns(size, tmp_path):
    """Led along a wave each half millisecond, some turns looked at and some not: exact, and back to any bit for bit."""
    options = {"tol": 1e-9, "rate_scale": 100.0}
    times = np.linspace(0.0, 0.06, 121)
    wave = np.concatenate([[0.0], size * np.sin(80.0 * times[:-1])])
    sim, states = gm.Simulator(two_discs(), 0.2, **options), {}
    for k, t in enumerate(times[1:]):
        if k in (40, 57, 90):
            states[k] = sim.state()
        sim.set("load", wave[k + 1], hold=1)
        sim.advance(t)
    wanted, exact = sim.solution(), np.zeros((121, 4))
    for k in range(120):
        exact[k + 1] = held(exact[k], wave[k], (wave[k + 1] - wave[k]) / 5e-4, 5e-4)
    for k, name in enumerate("ab"):
        speed = wanted.angular_velocity(name)[:, 2]
        np.testing.assert_allclose(speed, exact[:, 2 + k], rtol=0, atol=2e-6)
    for k, state in states.items():
        sim.restore(state)
        kept = gm.State.load(state.save(tmp_path / "s.npz"))
        for other in (sim, *(gm.Simulator(two_discs(), 0.2, initial=one, **options) for one in (state, kept))):
            for j in range(k, 120):
                other.set("load", wave[j + 1], hold=1)
                other.advance(times[j + 1])
            np.testing.assert_array_equal(other.solution().result.y[k - 121 :], wanted.result.y[k:])


def test_one_input_or_two():
    """A value that is set alone, in one compiled call, is passed as one that is set along with another."""
    ends = []
    for also in ((), ("idle",)):
        m = two_discs()
        m.torque("other", m.bodies["b"], m.input("idle", "N m", 1.0))
        sim = gm.Simulator(m, 1.0)
        for k, value in enumerate((0.3, -2.0, 7.0, 7.0, 0.5)):
            sim.set("load", value)
            for name in also:
                sim.set(name, 1.0)
            sim.advance(0.004 * (k + 1))
        ends.append(sim.solution())
    np.testing.assert_array_equal(ends[0].result.y, ends[1].result.y)
    np.testing.assert_array_equal(ends[0].input("load"), ends[1].input("load"))


def test_steps_land_where_an_input_jumps_at_each_point():
    """From the third such point on; where nothing is set they pass points again, but for the first."""
    sim, ends = gm.Simulator(two_discs(), 1.0), []
    for k in range(40):
        if k < 20 or k > 30:
            sim.set("load", 5.0 + (-1.0) ** k)
        sim.advance(1.7e-3 * (k + 1))
        ends.append(sim._run.state.t - sim.t)
    landed = np.array(ends) == 0.0
    assert landed[3:20].all()
    assert not landed[21:31].any()
    assert landed[34:].all()


@pytest.mark.parametrize("hold", [0, 1])
def test_the_answer_to_an_input_is_found_once_for_each_matrix(hold):
    """Equations are evaluated for a change of the input only where their matrix has been since the last one."""
    sim = gm.Simulator(two_discs(), 1.0, tol=1e-9)
    state, evaluated, matrices, values = sim._run.state, [], [], np.random.default_rng(7).normal(size=60)
    for k in range(60):
        sim.set("load", values[k], hold)
        before = state.residuals
        if k > 0:
            assert sim._steer(1e-3 * (k + 1))
        evaluated.append(state.residuals - before)
        matrices.append(state.jacobians)
        sim.advance(1e-3 * (k + 1))
    again = np.flatnonzero(np.diff(matrices) == 0) + 1
    again = again[again > 5]
    assert again.size > 20
    assert not np.array(evaluated)[again].any()


def test_an_input_that_acts_by_its_square():
    """2 w' = u^2, with values of both signs and of any size."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    pin = m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.input("u", "N m")
    m.axis_torque("drive", pin.i, pin.j, "u**2")
    u = np.random.default_rng(3).normal(size=100) * 10.0 ** (np.arange(100) % 4 - 2)
    sim, speed = gm.Simulator(m, 1.0, tol=1e-9), []
    for k, value in enumerate(u.tolist()):
        sim.set("u", value)
        sim.advance(1e-3 * (k + 1))
        speed.append(sim.get("angular_velocity", "disc")[2])
    np.testing.assert_allclose(speed, 0.5e-3 * np.cumsum(u**2), rtol=0, atol=1e-7)


class PI:
    """A controller of the speed of a disc that can tell what it remembers, and be told."""

    def __init__(self):
        self.sum = 0.0

    def __call__(self, t, sim):
        error = 10.0 - sim.get("angular_velocity", "a")[2]
        self.sum += PERIOD * error
        return 3.0 * error + 5.0 * self.sum

    def state(self):
        return [self.sum]

    def restore(self, numbers):
        (self.sum,) = numbers


def test_a_state_holds_what_controllers_remember(tmp_path):
    """Back in the same simulator, on in another one, and from a file, also between samples: the same bits."""

    def made(**options):
        sim = gm.Simulator(two_discs(), 1.0, **options)
        sim.control("load", PI(), PERIOD)
        return sim

    sim = made()
    sim.advance(0.0104)
    state = sim.state()
    sim.advance(0.02)
    wanted = unknowns(sim)
    sim.restore(state)
    others = [sim, made(initial=state), made(initial=gm.State.load(state.save(tmp_path / "s.npz")))]
    others.append(made())
    others[-1].advance(0.005)
    others[-1].restore(state)
    for other in others:
        other.advance(0.02)
        np.testing.assert_array_equal(unknowns(other)[2:], wanted[2:])
    # without what it remembers the torque is another one
    bare = gm.Simulator(two_discs(), 1.0, initial=state)
    pi = PI()
    with pytest.warns(UserWarning, match=says("'load'", "restore(numbers)")):
        bare.control("load", lambda t, s: pi(t, s), PERIOD)
    bare.advance(0.02)
    assert abs(unknowns(bare)[2] - wanted[2]) > 1e-6
    odd = PI()
    odd.state = lambda: "much"
    sim = gm.Simulator(two_discs(), 1.0)
    sim.control("load", odd, PERIOD)
    with pytest.raises(ModelError, match=says("load", "'much'", "numbers")):
        sim.state()


def test_a_state_tells_of_controllers_that_remember_nothing(tmp_path):
    """Of a plain function when it samples: it goes on there, in another simulator too, and whoever lacks it is told."""

    def made(**options):
        sim = gm.Simulator(two_discs(), 1.0, **options)
        sim.control("load", lambda t, s: 3.0 - s.get("angular_velocity", "a")[2], 3e-4)
        return sim

    sim = made()
    sim.advance(0.0104)
    state = sim.state()
    sim.advance(0.02)
    wanted = unknowns(sim)
    sim.restore(state)
    for other in (sim, made(initial=state), made(initial=gm.State.load(state.save(tmp_path / "s.npz")))):
        other.advance(0.02)
        np.testing.assert_array_equal(unknowns(other)[2:], wanted[2:])
    bare = gm.Simulator(two_discs(), 1.0, initial=state)
    assert bare.awaited == ["load"]
    with pytest.warns(UserWarning, match=says("'load'", "control(...)")):
        bare.advance(0.02)


def test_what_has_a_controller_is_not_set_besides():
    """At a sample the controller would write over it in silence; another input is set as ever."""
    m = two_discs()
    m.input("other", "N m")
    m.torque("more", m.bodies["a"], m.inputs["other"])
    sim = gm.Simulator(m, 1.0)
    sim.control("load", lambda t, s: 70.0, 1e-3)
    sim.advance(0.01)
    for name in ("load", m.inputs["load"]):
        with pytest.raises(ModelError, match=says("'load'", "controller", "return")):
            sim.set(name, 10.0)
    sim.set("other", 10.0)
    sim.advance(0.0105)
    assert (sim.get("input", "load"), sim.get("input", "other")) == (70.0, 10.0)


def test_a_controller_does_not_go_on_itself():
    sim = gm.Simulator(two_discs(), 1.0)
    sim.control("load", lambda t, s: 1.0 if t < 0.25 else s.advance(t + 0.1), 0.1)
    sim.advance(0.25)
    with pytest.raises(ModelError, match=says("advance", "controller", "return")):
        sim.advance(0.4)
    assert sim.t == pytest.approx(0.3)


def driven(level):
    """A disc that a motion drives, and another on a shaft."""
    m = two_discs()
    unit = {"displacement": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}[level]
    m.rotation("motion", m.joints["pin a"], m.input("given", unit), level=level)
    return m


@pytest.mark.parametrize(
    ("level", "hold", "angle", "speed"),
    [("velocity", 0, 0.5, 5.0), ("velocity", 1, 0.25, 5.0), ("acceleration", 0, 0.025, 0.5),
     ("displacement", 1, 5.0, 50.0)],
)  # fmt: skip
def test_motions_are_led(level, hold, angle, speed):
    """A speed may jump, as at an impact without rebound, an angle may not; both go on from where they are."""
    sim = gm.Simulator(driven(level), 1.0, tol=1e-8)
    sim.advance(0.1)
    sim.set("given", 5.0, hold)
    sim.advance(0.2)
    assert sim.get("joint_angle", "pin a") == pytest.approx(angle, abs=1e-7)
    assert sim.get("angular_velocity", "a")[2] == pytest.approx(speed, abs=1e-6)
    sim.set("given", sim.get("input", "given"), 1)
    sim.advance(0.3)
    further = {"velocity": 0.5, "acceleration": 0.05 + 0.025, "displacement": 0.0}[level]
    assert sim.get("joint_angle", "pin a") == pytest.approx(angle + further, abs=1e-7)


def test_a_speed_that_jumps_takes_others_along():
    """Momentum: a coupled disc jumps with the driven one, one on a spring does not."""
    m = driven("velocity")
    body = m.body("c", mass=1.0, inertia=(3.0, 3.0, 3.0))
    pin = m.revolute("pin c", body, m.ground, axis=(0, 0, 1))
    m.gear("gear", m.joints["pin a"], pin, -0.5)
    sim = gm.Simulator(m, 1.0, tol=1e-8)
    sim.advance(0.1)
    sim.set("given", 4.0)
    sim.advance(0.1 + 1e-6)
    assert sim.get("angular_velocity", "c")[2] == pytest.approx(-2.0, abs=1e-6)
    assert sim.get("angular_velocity", "b")[2] == pytest.approx(0.0, abs=1e-3)


def test_parameters_are_set():
    """A brake that is let go: the speed falls by exp(-c t / J) and stays."""
    m = Mechanism("disc")
    disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0), angular_velocity=(0, 0, 3.0))
    pin = m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    m.parameter("drag", "N m s/rad", 1.0)
    m.axis_torque("brake", pin.i, pin.j, "-drag*WZ(pin.I, pin.J)")
    sim = gm.Simulator(m, 3.0, tol=1e-9)
    for t, drag in ((0.5, 4.0), (1.0, 0.0), (1.5, 0.0)):
        sim.advance(t)
        sim.set("drag", drag)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(3.0 * np.exp(-0.25 - 1.0), abs=1e-8)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.set("lod", 1.0), ("lod", "load")),
        (lambda s: s.set("load", "3 rpm"), ("load", "3 rpm", "N m")),
        (lambda s: s.set("load", [1.0, 2.0]), ("load", "[1.0, 2.0]")),
        (lambda s: s.set("load", np.inf), ("load", "inf", "finite")),
        (lambda s: s.set("load", 1.0, hold=2), ("load", "hold", "2")),
        (lambda s: s.set("given", 1.0), ("given", "motion: angle", "hold=1", "speed")),
        (lambda s: (s.set("load", 1.0, 1), s.state()), ("load", "before")),
        (lambda s: s.control("lod", lambda t, s: 0.0, 1e-3), ("lod", "load")),
        (lambda s: s.control("load", 3.0, 1e-3), ("load", "3.0", "function")),
        (lambda s: s.control("load", lambda t, s: 0.0, 0.0), ("load", "0.0", "positive")),
        (lambda s: [s.control("load", lambda t, s: 0.0, 0.1) for _ in "12"], ("load", "controller")),
        (lambda s: s.get("input", "lod"), ("lod", "load")),
    ],
)
def test_what_is_wrong_is_said_in_a_line(call, words):
    sim = gm.Simulator(driven("displacement"), 1.0)
    with pytest.raises(ModelError, match=says(*words)) as error:
        call(sim)
    assert "\n" not in str(error.value)
    sim.set("given", "3 deg", hold=1)
    sim.advance(0.01)


def disc():
    """2 w' = u."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, m.input("u", "N m"))
    m.input("v", "N m")
    return m


def spin(found):
    return found.angular_velocity("disc")[-1, 2]


@pytest.mark.parametrize("points", [2, 11])
def test_a_line_does_not_depend_on_samples_of_others(points):
    """2 w' = 10 t, w(1) = 2.5, whatever is asked for and whoever samples."""
    inputs = {"u": ([0.0, 1.0], [0.0, 10.0], 1), "v": (lambda t: 0.0, "10 ms")}
    found = disc().simulate(1.0, t_eval=np.linspace(0.0, 1.0, points), inputs=inputs, tol=1e-9)
    assert spin(found) == pytest.approx(2.5, abs=1e-6)
    np.testing.assert_allclose(found.input("u"), 10.0 * found.t, atol=1e-9)


def test_a_line_ends_with_its_advance():
    """Another input that jumps on the way, as the speed of a motion too, leaves it alone; so does no state."""
    m = disc()
    other = m.body("other", mass=1.0, inertia=(1.0, 1.0, 1.0))
    m.rotation("turn", m.revolute("axle", other, m.ground), m.input("rate", "rad/s"), level="velocity")
    sim = gm.Simulator(m, 2.0, tol=1e-9)
    sim.control("v", lambda t, s: t, 0.03)
    sim.control("rate", lambda t, s: t, 0.07)
    sim.set("u", 10.0, hold=1)
    sim.advance(0.5)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(1.25, abs=1e-6)
    sim.advance(1.0)
    assert sim.get("angular_velocity", "disc")[2] == pytest.approx(3.75, abs=1e-6)
    sim = gm.Simulator(disc(), 2.0)
    sim.control("v", lambda t, s: s.state().t, 0.03)
    sim.set("u", 10.0, hold=1)
    with pytest.raises(ModelError, match=says("u", "on its way", "advance")):
        sim.advance(0.5)


def test_a_state_of_a_solution_has_the_inputs_of_its_time():
    sim = gm.Simulator(disc(), 3.0, tol=1e-9)
    sim.advance(0.5)
    sim.set("u", 4.0)
    sim.advance(1.0)
    state = sim.solution().state_at(1.0)
    on = disc().simulate(2.0, t_eval=[1.0, 2.0], initial=state, tol=1e-9)
    np.testing.assert_allclose(on.angular_velocity("disc")[:, 2], [1.0, 3.0], rtol=0, atol=1e-6)
    np.testing.assert_array_equal(on.input("u"), [4.0, 4.0])
    assert gm.Simulator(disc(), 3.0, initial=state).get("input", "u") == 4.0
    led = disc().simulate(0.5, t_eval=[0.0, 0.2, 0.4, 0.5], inputs={"u": ([0.0, 0.3], [2.0, 5.0])}, tol=1e-9)
    for t, value in ((0.2, 2.0), (0.4, 5.0)):
        on = disc().simulate(0.6, t_eval=[t, 0.6], initial=led.state_at(t))
        np.testing.assert_array_equal(on.input("u"), [value, value])
        assert disc().linearize(["u"], [("angular_velocity", "disc", "z")], at=led, t=t).point.inputs == [value]


def test_a_line_ends_where_a_state_was_taken(tmp_path):
    """Held at 10 from 0.5 s on in each continuation: w(1) = 1.25 + 2.5."""
    sim = gm.Simulator(disc(), 2.0, tol=1e-9)
    sim.set("u", 10.0, hold=1)
    sim.advance(0.5)
    state = sim.state()
    other = gm.Simulator(disc(), 2.0, tol=1e-9, initial=gm.State.load(state.save(tmp_path / "s.npz")))
    ends = [disc().simulate(1.0, t_eval=[0.5, 1.0], initial=state, tol=1e-9)]
    for one in (sim, other):
        one.advance(1.0)
        ends.append(one.solution())
    ends.append(disc().simulate(1.0, t_eval=[0.5, 1.0], initial=sim.solution().state_at(0.5), tol=1e-9))
    sim.restore(state)
    sim.advance(1.0)
    for end in [*ends, sim.solution()]:
        assert end.input("u")[-1] == pytest.approx(10.0, abs=1e-12)
        assert spin(end) == pytest.approx(3.75, abs=1e-6)


def test_an_angle_that_was_led_stays_where_a_state_was_taken():
    sim = gm.Simulator(driven("displacement"), 1.0, tol=1e-8)
    sim.set("given", 0.5, hold=1)
    sim.advance(0.1)
    on = driven("displacement").simulate(0.2, t_eval=[0.1, 0.2], initial=sim.state(), tol=1e-8)
    assert on.success
    assert on.joint_angle("pin a")[-1] == pytest.approx(0.5, abs=1e-7)
    assert on.angular_velocity("a")[-1, 2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("lump", [False, True])
@pytest.mark.slow
def test_what_is_set_acts_from_the_next_advance_on(lump):
    """Until then an input tells what is going to act, all else what has: at the start as in a model made so."""

    def model(u=0.0):
        m = two_discs(lump)
        m.input("u", "rad/s", u)
        m.algebraic_state("sum", 'WZ("pin a.I", "pin a.J") + u')
        m.algebraic_state("double", "2*VARVAL(sum)")
        m.output("told", "3*u")
        return m

    def all_of(told):
        return [np.ravel(told(*asked))[-1] for asked in (("state", "sum"), ("state", "double"), ("output", "told"))]

    def over(solution):
        return np.array([solution.input("u"), solution.state("sum"), solution.state("double"), solution.output("told")])

    sim = gm.Simulator(model(), 1.0)
    sim.set("u", 10.0)
    assert (sim.get("input", "u"), all_of(sim.get)) == (10.0, [0.0, 0.0, 0.0])
    sim.advance(0.5)
    assert all_of(sim.get) == pytest.approx([10.0, 20.0, 30.0])
    sim.set("u", 20.0)
    for look in (lambda: None, sim.state):
        look()
        assert (sim.get("input", "u"), all_of(sim.get)) == (20.0, pytest.approx([10.0, 20.0, 30.0]))
        np.testing.assert_allclose(over(sim.solution()), np.outer([10.0, 10.0, 20.0, 30.0], [1.0, 1.0]), atol=1e-9)
    sim.advance(0.6)
    assert (sim.get("input", "u"), all_of(sim.get)) == (20.0, pytest.approx([20.0, 40.0, 60.0]))
    led, made = model().simulate(0.5, rate=2.0, inputs={"u": 10.0}), model(10.0).simulate(0.5, rate=2.0)
    np.testing.assert_allclose(over(led), over(made), atol=1e-9)


def driven_wheels():
    """A wheel whose speed is an input, one geared to it, and a pendulum on this one."""
    m = gm.Mechanism("wheels")
    one, two, third = (
        m.body(name, mass=1.0, inertia=(k,) * 3) for name, k in (("one", 1.0), ("two", 2.0), ("arm", 3.0))
    )
    pin = m.revolute("pin", one, m.ground, axis=(0, 0, 1))
    m.gear("gear", pin, m.revolute("axle", two, m.ground, axis=(0, 0, 1)), 2.0)
    elbow = m.revolute("elbow", third, two, axis=(1, 0, 0))
    m.rotation("turn", pin, m.input("speed", "rad/s"), level="velocity")
    m.axis_torque("spring", elbow.i, elbow.j, "3 - 50*AZ(elbow.I, elbow.J) + push")
    m.input("push", "N m")
    m.algebraic_state("pushed", "10*push")
    return m


@pytest.mark.parametrize("start", [0.0, 0.2])
def test_a_state_where_a_speed_jumps_is_behind_the_jump(start, tmp_path):
    """It goes on bit for bit as without it, also from a file and with another integrator; points before it are kept."""
    runs = []
    for asked in (False, True):
        sim = gm.Simulator(driven_wheels(), 1.0, tol=1e-8)
        sim.set("speed", 3.0)
        for t in (0.1, 0.2) if start else ():
            sim.advance(t)
        sim.set("speed", 1.0)
        state = sim.state() if asked else None
        sim.advance(0.5)
        runs.append(sim.solution())
    wanted, again = runs
    sim.restore(state)
    assert sim.get("angular_velocity", "two")[2] == pytest.approx(2.0, abs=1e-9)
    sim.advance(0.5)
    other = gm.Simulator(driven_wheels(), 1.0, tol=1e-8, initial=gm.State.load(state.save(tmp_path / "jump.npz")))
    other.advance(0.5)
    for found in (again, sim.solution()):
        np.testing.assert_array_equal(found.t, wanted.t)
        np.testing.assert_array_equal(found.angular_velocity("two"), wanted.angular_velocity("two"))
    for found in (*runs, sim.solution(), other.solution()):
        assert found.joint_angle("elbow")[-1] == wanted.joint_angle("elbow")[-1]
    run = driven_wheels().simulate(0.5, initial=state, integrator="IDA", tol=1e-8)
    assert run.joint_angle("elbow")[-1] == pytest.approx(wanted.joint_angle("elbow")[-1], abs=1e-5)


@pytest.mark.parametrize("name", ["speed", "push"])
def test_what_is_set_before_the_start_acts_from_it_on_though_a_state_is_taken_between(name):
    sim = gm.Simulator(driven_wheels(), 1.0)
    sim.set(name, 3.0)
    sim.state()
    sim.set("push", 5.0)
    sim.advance(0.1)
    np.testing.assert_array_equal(sim.solution().state("pushed"), [50.0, 50.0])
    np.testing.assert_array_equal(sim.solution().input("push"), [5.0, 5.0])


@pytest.mark.parametrize("name", ["speed", "push"])
def test_points_before_a_state_without_history_are_kept_where_something_is_set_there(name):
    sim = gm.Simulator(driven_wheels(), 1.0)
    sim.set("speed", 3.0)
    for t in (0.1, 0.2):
        sim.advance(t)
    sim.restore(sim.state().without_history())
    sim.set(name, 1.0)
    sim.advance(0.3)
    found = sim.solution()
    np.testing.assert_allclose(found.t, [0.0, 0.1, 0.2, 0.3])
    speeds = [3.0, 3.0, 3.0, 1.0 if name == "speed" else 3.0]
    np.testing.assert_allclose(found.angular_velocity("two")[:, 2], 2.0 * np.array(speeds), atol=1e-6)
    np.testing.assert_array_equal(found.input("speed"), speeds)


@pytest.mark.slow
@pytest.mark.parametrize("torque", ["u*u", "u*SIN(7*TIME)", "IF(u-5: 0, 0, 100*(u-5)**2)", "2*u"])
def test_lines_whose_effect_is_not_in_proportion_are_followed_to_the_tolerance(torque):
    """What a turn of them would have done to the past is not known; runs that begin afresh at each turn do not ask."""

    def speeds(tol, afresh=False):
        m = gm.Mechanism("two discs")
        markers = []
        for name, inertia in (("a", 2.0), ("b", 1.0)):
            body = m.body(name, mass=1.0, inertia=(inertia,) * 3)
            m.revolute(f"pin {name}", body, m.ground, axis=(0, 0, 1))
            markers.append(body.marker(name=f"on {name}"))
        m.torsion_spring("shaft", *markers, stiffness=400.0, damping=0.8)
        m.input("u", "N m")
        m.torque("drive", m.bodies["a"], torque)
        simulator, rng, found = gm.Simulator(m, 0.2, tol=tol), np.random.default_rng(1), []
        for t in np.arange(1, 41) * 3e-3:
            if afresh and simulator.t:
                simulator.restore(simulator.state().without_history())
            simulator.set("u", 10.0 * rng.standard_normal(), hold=1)
            simulator.advance(t)
            found.append(simulator.get("angular_velocity", "a")[2])
        return np.array(found)

    exact = speeds(1e-11, afresh=True)
    for tol in (1e-7, 1e-9):
        errors = [np.abs(speeds(tol, afresh) - exact).max() for afresh in (False, True)]
        assert errors[0] < 30.0 * errors[1]
        assert errors[0] < 300.0 * tol * max(1.0, np.abs(exact).max())
