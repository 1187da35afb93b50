"""Forward sensitivities against closed forms, conserved quantities and differences of runs at tight tolerances."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import ModelError, forward_sensitivities
from gearmbs.studies import Case, case_mechanism
from tests.says import says

K, C, M_, F = 300.0, 1.5, 2.0, 40.0


def oscillator(k=K, c=C, m=M_, force=F, start=0.0):
    """m x'' + c x' + k x = force, from rest at ``start``."""
    made = gm.Mechanism("oscillator", gravity=(0, 0, 0))
    body = made.body("body", mass=m, inertia=(1, 1, 1), position=(start, 0, 0))
    made.translational("slide", body, made.ground, at=(0, 0, 0), axis=(1, 0, 0))
    place = body.marker(name="place")
    made.load(
        "spring", place, made.ground.marker(), rm=made.ground.marker(), fx=f"{force!r}-{k!r}*DX(place)-{c!r}*VX(place)"
    )
    return made


def response(t, k=K, c=C, m=M_, force=F, start=0.0):
    decay = c / (2 * m)
    omega = np.sqrt(k / m - decay**2)
    rest = force / k
    return rest + (start - rest) * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))


VALUES = {"k": K, "c": C, "m": M_, "force": F, "start": (0.0, 0.1)}


@pytest.fixture(scope="module")
def oscillating():
    return forward_sensitivities(oscillator, VALUES, 2.0, rate=100, tol=1e-8)


@pytest.mark.parametrize("parameter", VALUES)
def test_derivatives_of_an_oscillator_are_those_of_its_closed_form(oscillating, parameter):
    t = oscillating.solution.t
    value = {"k": K, "c": C, "m": M_, "force": F, "start": 0.0}[parameter]
    h = 1e-5 * (abs(value) or 1.0)
    exact = (response(t, **{parameter: value + h}) - response(t, **{parameter: value - h})) / (2 * h)
    found = oscillating.derivative(parameter, "DX(place)")
    assert np.abs(found - exact).max() < 2e-5 * np.abs(exact).max()


def test_a_number_of_the_whole_record_has_a_derivative(oscillating):
    t, h = oscillating.solution.t, 1e-3
    rms = [np.sqrt(np.mean(response(t, k=K + d) ** 2)) for d in (h, -h)]
    found = oscillating.derivative("k", lambda s: np.sqrt(np.mean(s.evaluate("DX(place)") ** 2)))
    assert found == pytest.approx((rms[0] - rms[1]) / (2 * h), rel=1e-4)


def test_reactions_follow_what_moves():
    """The pin of a turntable carries m r w^2: twice that over w by the speed, and 1/r of it by the radius."""

    def table(radius, speed):
        made = gm.Mechanism("table", gravity=(0, 0, 0))
        body = made.body("body", mass=3.0, inertia=(1, 1, 1), position=(radius, 0, 0))
        pin = made.revolute("pin", body, made.ground, at=(0, 0, 0), axis=(0, 0, 1))
        made.rotation("turn", pin, speed, level="velocity")
        return made

    run = forward_sensitivities(table, {"radius": 0.4, "speed": 5.0}, 1.0, rate=50, tol=1e-8)
    force = lambda s: np.linalg.norm(s.reaction("pin")[0], axis=1)  # noqa: E731
    assert run.derivative("radius", force) == pytest.approx(3.0 * 5.0**2, rel=1e-5)
    assert run.derivative("speed", force) == pytest.approx(2 * 3.0 * 0.4 * 5.0, rel=1e-5)


def test_conserved_quantities_have_conserved_derivatives_through_changes_of_angles():
    """A free body that flips over: energy and angular momentum by its first spin stay those of the start."""
    moments = np.array([1.2, 2.0, 3.0])

    def body(spin):
        made = gm.Mechanism("free", gravity=(0, 0, 0))
        made.body("body", mass=1.0, inertia=tuple(moments), angular_velocity=(0.05, spin, 0.02))
        return made

    run = forward_sensitivities(body, {"spin": 3.0}, 8.0, rate=50, tol=1e-9)
    assert len(run.solution.result.epochs) > 1

    def momentum(s):
        turn, omega = s.orientation("body"), s.angular_velocity("body")
        return np.einsum("tij,j,tkj,tk->ti", turn, moments, turn, omega)

    def energy(s):
        local = np.einsum("tji,tj->ti", s.orientation("body"), s.angular_velocity("body"))
        return 0.5 * (moments * local**2).sum(axis=1)

    assert run.derivative("spin", momentum) == pytest.approx(np.tile([0.0, 2.0, 0.0], (401, 1)), abs=2e-3)
    assert run.derivative("spin", energy) == pytest.approx(6.0, rel=1e-4)


def test_a_force_that_begins_at_a_breakpoint():
    """From rest a force that begins at 0.5 s: by its size the motion is that of a unit force."""

    def pushed(size):
        made = gm.Mechanism("pushed", gravity=(0, 0, 0))
        body = made.body("body", mass=2.0, inertia=(1, 1, 1))
        made.translational("slide", body, made.ground, at=(0, 0, 0), axis=(1, 0, 0))
        made.load(
            "push", body.marker(name="place"), made.ground.marker(), rm=made.ground.marker(),
            fx=f"IF(TIME-0.5: 0, 0, {size!r})-200*DX(place)",
        )  # fmt: skip
        return made

    run = forward_sensitivities(pushed, {"size": 7.0}, 1.5, rate=100, tol=1e-8, breakpoints=[0.5])
    t = run.solution.t
    exact = np.where(t > 0.5, (1 - np.cos(10.0 * (t - 0.5))) / 200.0, 0.0)
    assert np.abs(run.derivative("size", "DX(place)") - exact).max() < 2e-5 * exact.max()


@pytest.mark.slow
def test_mesh_force_of_a_gear_pair_against_differences_of_runs():
    case = Case(operation={"speed": "1000 rpm", "torque": 100.0, "run_up": 0.004, "settling": 0.0, "duration": 0.01})

    def pair(torque, damping, shift):
        changed = case.changed(
            operation={"torque": torque}, contact={"damping": damping}, fault={"centre_distance_error": shift}
        )
        return case_mechanism(changed)

    values = {"torque": 100.0, "damping": 3e5, "shift": 1e-4}
    settings = {"rate": 20_000, "rate_scale": 2000.0}
    run = forward_sensitivities(pair, values, 0.012, tol=1e-8, **settings)

    def force(s):
        return s.diagnostics("mesh")["normal_force"][100:]

    for name, value in values.items():
        h = 1e-3 * value
        sides = [force(pair(**values | {name: value + d}).simulate(0.012, tol=1e-10, **settings)) for d in (h, -h)]
        exact = (sides[0] - sides[1]) / (2 * h)
        off = np.abs(run.derivative(name, force) - exact) / np.abs(exact).max()
        # at changes of teeth differences smear what jumps
        assert np.median(off) < 1e-3
        assert np.quantile(off, 0.9) < 2e-2


def test_what_cannot_be_differentiated_is_named():
    with pytest.raises(ModelError, match=says("'start'", "scale")):
        forward_sensitivities(oscillator, {"start": 0.0}, 0.1)
    with pytest.raises(ModelError, match=r"derivative by 'q'.*k"):
        forward_sensitivities(oscillator, {"k": K}, 0.01).derivative("q", "DX(place)")
    with pytest.raises(ModelError, match=says("forward_sensitivities", "'every_step'")):
        forward_sensitivities(oscillator, {"k": K}, 0.1, every_step=True)
    with pytest.raises(ModelError, match=r"IDA.*WSTIFF"):
        forward_sensitivities(oscillator, {"k": K}, 0.1, integrator="IDA")
    with pytest.raises(ModelError, match=r"k.*'stiff'"):
        forward_sensitivities(oscillator, {"k": "stiff"}, 0.1)
    with pytest.raises(ModelError, match=says("build", "Mechanism")):
        forward_sensitivities(lambda k: k, {"k": K}, 0.1)
    with pytest.raises(ModelError, match=says("parameters", "stiffness")):
        forward_sensitivities(oscillator, {}, 0.1)


def test_a_parameter_that_changes_what_there_is_is_refused():
    def maybe(mass):
        made = oscillator()
        if mass > 1.0:
            made.body("more", mass=mass, inertia=(1, 1, 1))
        return made

    with pytest.raises(ModelError, match=says("parameter", "'mass'")):
        forward_sensitivities(maybe, {"mass": 1.0}, 0.1)
    assert forward_sensitivities(maybe, {"mass": 2.0}, 0.01).unknowns["mass"].shape[0] > 1


def hooke(x, k):
    return -k * x


def with_function(law, k, m):
    made = gm.Mechanism("own", gravity=(0, 0, 0))
    body = made.body("body", mass=m, inertia=(1, 1, 1), position=(0.1, 0, 0))
    made.translational("slide", body, made.ground, at=(0, 0, 0), axis=(1, 0, 0))
    made.function("law", law)
    place = body.marker(name="place")
    made.load("spring", place, made.ground.marker(), rm=made.ground.marker(), fx=f"LAW(DX(place),{k!r})")
    return made


def test_functions_of_python_take_parameters_as_arguments():
    """x = 0.1 cos(w t) with w^2 = k/m."""
    run = forward_sensitivities(lambda k, m: with_function(hooke, k, m), {"k": K, "m": M_}, 1.0, rate=20, tol=1e-8)
    t, w = run.solution.t, np.sqrt(K / M_)
    by_speed = -0.1 * t * np.sin(w * t)
    assert run.derivative("k", "DX(place)") == pytest.approx(by_speed * w / (2 * K), abs=2e-8)
    assert run.derivative("m", "DX(place)") == pytest.approx(-by_speed * w / (2 * M_), abs=3e-6)
    with pytest.raises(ModelError, match=says("'k'", "'law'", "outside")):
        forward_sensitivities(lambda k: with_function(lambda x, _: -k * x, 1.0, M_), {"k": K}, 0.1)


def test_a_parameter_without_effect_is_told():
    with pytest.warns(UserWarning, match=says("'idle'", "zero")):
        run = forward_sensitivities(lambda idle: oscillator(), {"idle": 1.0}, 0.05)
    assert not run.derivative("idle", "DX(place)").any()


def pushed(law, **numbers):
    """2 kg on 200 N/m, pushed by a force that is a text of the parameters, from rest."""
    made = gm.Mechanism("pushed", gravity=(0, 0, 0))
    body = made.body("body", mass=2.0, inertia=(1, 1, 1))
    made.translational("slide", body, made.ground, at=(0, 0, 0), axis=(1, 0, 0))
    push = f"{law.format(**{name: repr(value) for name, value in numbers.items()})}-200*DX(place)"
    made.load("push", body.marker(name="place"), made.ground.marker(), rm=made.ground.marker(), fx=push)
    return made


def crossings(force, more, place, t):
    """Place of what is pushed by ``force``, and by ``more`` beyond a place, piece by piece in closed form."""
    x, at, start, speed, beyond = np.zeros_like(t), 0.0, 0.0, 0.0, 0
    while at < t[-1]:
        rest = (force + more * beyond) / 200.0
        a, b = start - rest, 0.1 * speed
        size, phase = np.hypot(a, b), np.arctan2(b, a)
        turn = np.arccos((place - rest) / size)
        comes = (phase + np.array([-turn, turn])[:, None] + 2.0 * np.pi * np.arange(-2, 3)) / 10.0
        last = comes[comes > 1e-9].min()
        inside = (t >= at) & (t <= at + last)
        x[inside] = rest + a * np.cos(10.0 * (t[inside] - at)) + b * np.sin(10.0 * (t[inside] - at))
        start, speed = place, 10.0 * (b * np.cos(10.0 * last) - a * np.sin(10.0 * last))
        at, beyond = at + last, 1 - beyond
    return x


def by_place(t, place, more):
    return (crossings(4.0, more, place + 1e-7, t) - crossings(4.0, more, place - 1e-7, t)) / 2e-7


JUMPING = {
    "a time": ("IF(TIME-{p}: 0, 0, 7)", 0.5, {}, lambda t: np.where(t > 0.5, -0.35 * np.sin(10.0 * t - 5.0), 0.0)),
    "a time at a breakpoint": (
        "IF(TIME-{p}: 0, 0, 7)",
        0.5,
        {"breakpoints": [0.5]},
        lambda t: np.where(t > 0.5, -0.35 * np.sin(10.0 * t - 5.0), 0.0),
    ),
    "a place": ("4+IF(DX(place)-{p}: 0, 0, 1)", 0.01, {}, lambda t: by_place(t, 0.01, 1.0)),
    "a narrow STEP": ("4+STEP(DX(place)-{p}, -1E-8, 0, 1E-8, 1)", 0.013, {}, lambda t: by_place(t, 0.013, 1.0)),
    "a small narrow STEP": (
        "4+STEP(DX(place)-{p}, -1E-8, 0, 1E-8, 0.01)",
        0.013,
        {},
        lambda t: by_place(t, 0.013, 0.01),
    ),
}


@pytest.mark.parametrize("tol", [1e-6, 1e-8])
@pytest.mark.parametrize("law", JUMPING)
def test_jumps_that_depend_on_the_parameter_are_crossed(law, tol):
    """By where or when: up to five of them, and STEPs that are passed between two steps."""
    text, value, options, exact = JUMPING[law]
    run = forward_sensitivities(lambda p: pushed(text, p=p), {"p": value}, 1.5, rate=100, tol=tol, **options)
    wanted = exact(run.solution.t)
    assert np.abs(run.derivative("p", "DX(place)") - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_a_jump_by_what_comes_before_it_is_crossed():
    """A harder push reaches the place earlier; against differences of closed forms."""
    run = forward_sensitivities(
        lambda size: pushed("{size}+IF(DX(place)-0.01: 0, 0, 1)", size=size), {"size": 4.0}, 1.5, rate=100, tol=1e-8
    )
    t = run.solution.t
    wanted = (crossings(4.0 + 1e-6, 1.0, 0.01, t) - crossings(4.0 - 1e-6, 1.0, 0.01, t)) / 2e-6
    assert run.derivative("size", "DX(place)") == pytest.approx(wanted, abs=1e-3 * np.abs(wanted).max())


@pytest.mark.parametrize("options", [{}, {"breakpoints": [0.5]}], ids=["no breakpoint", "breakpoint"])
def test_jumps_at_a_time_of_their_own_are_followed(options):
    run = forward_sensitivities(
        lambda size: pushed("IF(TIME-0.5: 0, 0, {size})", size=size), {"size": 7.0}, 1.5, rate=100, tol=1e-8, **options
    )
    t = run.solution.t
    exact = np.where(t > 0.5, (1 - np.cos(10.0 * (t - 0.5))) / 200.0, 0.0)
    assert np.abs(run.derivative("size", "DX(place)") - exact).max() < 2e-5 * exact.max()


def test_a_step_in_place_of_a_jump_is_followed():
    """By its time a push that comes over 20 ms moves the motion behind it as a whole: dx/dt0 = -x'."""
    run = forward_sensitivities(
        lambda when: pushed("STEP(TIME-{when}, -0.01, 0, 0.01, 7)", when=when), {"when": 0.5}, 1.5, rate=100, tol=1e-8
    )
    rate = run.solution.evaluate("VX(place)")
    assert run.derivative("when", "DX(place)") == pytest.approx(-rate, abs=1e-4 * np.abs(rate).max())


def test_kinks_that_depend_on_the_parameter_are_followed():
    """A stop without damping at its rim: energy is conserved, by the place of the stop, too."""
    text = "6-IMPACT(-DX(place), -VX(place), -{place}, 1E5, 1.5, 0, 1E-3)"
    run = forward_sensitivities(lambda place: pushed(text, place=place), {"place": 0.04}, 1.0, rate=200, tol=1e-9)

    def energy(s):
        x, v = s.evaluate("DX(place)"), s.evaluate("VX(place)")
        return v**2 + 100 * x**2 - 6 * x

    x = run.solution.evaluate("DX(place)")
    inside = x < 0.0399
    assert x.max() > 0.04
    assert run.derivative("place", energy)[inside] == pytest.approx(0.0, abs=2e-4)


def jump_of_python(x, edge):
    return 1.0 if x < edge else 0.0


def test_jumps_inside_functions_of_python_are_seen():
    def build(edge):
        made = pushed("4+ONOFF(DX(place),{edge})", edge=edge)
        made.function("onoff", jump_of_python)
        return made

    run = forward_sensitivities(build, {"edge": 0.02}, 1.0, rate=100, tol=1e-8)
    wanted = (
        crossings(5.0, -1.0, 0.02 + 1e-7, run.solution.t) - crossings(5.0, -1.0, 0.02 - 1e-7, run.solution.t)
    ) / 2e-7
    assert run.derivative("edge", "DX(place)") == pytest.approx(wanted, abs=1e-3 * np.abs(wanted).max())
    assert forward_sensitivities(build, {"edge": 0.2}, 1.0, rate=100).solution.result.success


def test_what_depends_on_nothing_of_a_parameter_has_no_error():
    """A pendulum swings alike whatever its mass; what is left of its sensitivity is rounding."""

    def pendulum(mass, length):
        made = gm.Mechanism("pendulum", gravity=(0, 0, -9.81))
        body = made.body("bob", mass=mass, inertia=(0.1 * mass,) * 3, position=(length, 0, 0))
        made.revolute("pin", body, made.ground, at=(0, 0, 0), axis=(0, 1, 0))
        return made

    run = forward_sensitivities(pendulum, {"mass": 3.0, "length": 1.0}, 1.0, rate=50)
    assert run.local_error["mass"] == 0.0
    assert 0.0 < run.local_error["length"] < 1e-5


def test_sensitivities_have_a_local_error_of_their_own():
    """Teeth bend the derivatives where they leave the run as it is: steps are divided there, for each parameter."""
    case = Case(operation={"speed": "1000 rpm", "torque": 100.0, "run_up": 0.002, "settling": 0.0, "duration": 0.01})

    def geared(torque):
        return case_mechanism(case.changed(operation={"torque": torque}))

    def force_by_torque(tol, **asked):
        run = forward_sensitivities(
            geared, {"torque": 100.0}, 0.004, rate=20_000, tol=tol, rate_scale=1700.0, lump=True, **asked
        )
        force = run.derivative("torque", lambda s: s.diagnostics("mesh")["normal_force"])
        return force, run.local_error["torque"], run.solution.result.stats.steps

    best, _, _ = force_by_torque(1e-10, local_error=1e-6)
    (usual, told, steps), (better, less, same) = force_by_torque(1e-8), force_by_torque(1e-8, local_error=1e-5)
    assert less <= 1e-5 < told
    assert steps == same
    errors = [np.sqrt(np.mean((found - best) ** 2)) for found in (usual, better)]
    assert errors[1] < 0.4 * errors[0]


@pytest.mark.parametrize("asked", [1e-7, 1e-8])
def test_divided_steps_go_through_changes_of_angles(asked):
    """A free body that flips over: its angular momentum by its first spin stays that of the start."""
    moments = np.array([1.2, 2.0, 3.0])

    def body(spin):
        made = gm.Mechanism("free", gravity=(0, 0, 0))
        made.body("body", mass=1.0, inertia=tuple(moments), angular_velocity=(0.05, spin, 0.02))
        return made

    run = forward_sensitivities(body, {"spin": 3.0}, 8.0, rate=50, tol=1e-6, local_error=asked)
    assert len(run.solution.result.epochs) > 1
    assert run.local_error["spin"] <= asked

    def momentum(s):
        turn, omega = s.orientation("body"), s.angular_velocity("body")
        return np.einsum("tij,j,tkj,tk->ti", turn, moments, turn, omega)

    assert run.derivative("spin", momentum) == pytest.approx(np.tile([0.0, 2.0, 0.0], (401, 1)), abs=5e-4)


def test_a_local_error_that_is_not_positive_is_refused():
    with pytest.raises(ModelError, match=says("local_error", "0", "positive")):
        forward_sensitivities(oscillator, VALUES, 1.0, local_error=0.0)


@pytest.mark.parametrize("scale", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("place", ["start", "anchor"])
def test_a_scale_below_the_roundings_of_what_is_added_to_is_made_larger(scale, place):
    """A mass at 1 m on a spring of 50/s^2 and a damper, moved with its start or with the spring's anchor."""

    def sprung(offset, speed):
        made = gm.Mechanism("sprung")
        at = 1.0 + (offset if place == "start" else 0.0)
        body = made.body("body", mass=2.0, inertia=(1, 1, 1), position=(at, 0, 0), velocity=(speed, 0, 0))
        made.translational("slide", body, made.ground, at=(0, 0, 0), axis=(1, 0, 0))
        anchor = 1.2 + (offset if place == "anchor" else 0.0)
        made.ground.marker((anchor, 0, 0), name="J")
        made.load("spring", body.marker(name="I"), made.ground.marker(name="O"), fx="-100*DX(I,J)-0.3*VX(I,J)")
        return made

    run = forward_sensitivities(sprung, {"offset": (0.0, scale), "speed": (0.0, scale)}, 1.0, rate=10)
    d = 0.075
    w = np.sqrt(50.0 - d * d)
    by_start = np.exp(-d) * (np.cos(w) + d / w * np.sin(w))
    exact = {"offset": by_start if place == "start" else 1.0 - by_start, "speed": np.exp(-d) * np.sin(w) / w}
    for name, value in exact.items():
        assert run.derivative(name, lambda s: s.com_position("body")[-1, 0]) == pytest.approx(value, rel=2e-5)


@pytest.mark.slow
def test_lengths_of_teeth_that_just_touch():
    """By the module, which moves flanks a thousand times as far as they are deep in each other, from rest on.

    Differences of runs 1e-5 to either side of it; 1e-4 apart they are the same to 1.4e-4.
    """
    case = Case(operation={"speed": "1000 rpm", "torque": 100.0, "run_up": 0.005, "settling": 0.0, "duration": 0.01})
    module, settings = 0.0030645, {"rate": 20_000, "rate_scale": 2000.0}

    def geared(module):
        return case_mechanism(case.changed(gears={"module": module}))

    def force(solution):
        return solution.contact("mesh")["normal_force"]

    run = forward_sensitivities(geared, {"module": module}, 0.006, tol=1e-10, **settings)
    above, below = (force(geared(module * f).simulate(0.006, tol=1e-12, **settings)) for f in (1.00001, 0.99999))
    expected = (above - below) / 2e-5 / module
    found = run.derivative("module", force)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 1e-3 * np.sqrt(np.mean(expected**2))


@pytest.mark.slow
def test_by_the_pressure_angle_differences_are_met_as_closely_as_steps_are_asked_to_be():
    """What is left is the steps' own: differences over two sizes agree, and derivatives come up to them."""
    case = Case(operation={"speed": 104.72, "torque": 100.0, "run_up": 0.01, "settling": 0.0, "duration": 0.01})
    angle, settings = np.radians(20.0), {"rate": 20_000, "rate_scale": 3000.0, "lump": True}

    def geared(angle):
        return case_mechanism(case.changed(gears={"pressure_angle": angle}))

    def force(solution):
        return solution.contact("mesh")["normal_force"]

    def difference(part):
        above, below = (
            force(geared(angle * f).simulate(0.02, tol=1e-11, **settings)) for f in (1.0 + part, 1.0 - part)
        )
        return (above - below) / (2.0 * part * angle)

    def off(found, expected):
        return np.linalg.norm(found - expected) / np.linalg.norm(expected)

    expected = difference(1e-5)
    assert off(difference(1e-4), expected) < 2e-3
    loose, close = (
        forward_sensitivities(geared, {"angle": angle}, 0.02, tol=1e-8, local_error=allowed, **settings)
        for allowed in (None, 1e-4)
    )
    told = loose.local_error["angle"]
    assert 1e-2 < told < 5e-2
    assert off(loose.derivative("angle", force), expected) < 2.0 * told
    assert off(close.derivative("angle", force), expected) < 4e-3


def test_limits_that_are_infinite_say_nothing_of_a_parameter(recwarn):
    """Friction brings a sliding mass to rest: by its coefficient the way is that of -mu g t^2 / 2; it has no limit."""

    def sliding(mu):
        made = gm.Mechanism("sliding", gravity=(0, 0, -9.81))
        body = made.body("body", mass=1.0, inertia=(1, 1, 1), velocity=(3, 0, 0))
        rail = made.translational("rail", body, made.ground, at=(0, 0, 0), axis=(1, 0, 0))
        made.friction("friction", rail, 1.3 * mu, mu)
        return made

    run = forward_sensitivities(sliding, {"mu": 0.2}, 0.5, rate=20)
    assert not recwarn.list
    way = run.derivative("mu", lambda s: s.com_position("body")[:, 0])
    assert way == pytest.approx(-9.81 * run.solution.t**2 / 2, rel=1e-3, abs=1e-6)


def test_a_stop_that_moves_with_what_touches_it():
    """Everything is shifted, and all places with it; the stop alone moves a thousand times as far as it is deep."""

    def stopped(x):
        made = gm.Mechanism("stopped")
        body = made.body("body", mass=1.0, inertia=(1, 1, 1), position=(0.9 + x, 0, 0))
        made.translational("slide", body, made.ground, at=(0, 0, 0), axis=(1, 0, 0))
        made.parameter("g", "m", 0.9 + x)
        force = "IMPACT(DX(I,J),VX(I,J),g,1e8,1.5,100,1e-4)-STEP(TIME,0,0,0.01,10)"
        made.load("force", body.marker(name="I"), made.ground.marker(name="J"), fx=force)
        return made

    run = forward_sensitivities(stopped, {"x": (0.0, 1.0)}, 0.02, rate=1000, tol=1e-10)
    places = run.derivative("x", lambda s: s.com_position("body")[:, 0])
    assert places == pytest.approx(np.ones(21), abs=1e-7)
