"""Bodies that turn about fixed axes, integrated by their angles alone: the same motions and reactions as with all."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.model.members import TURN_ROOT
from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.lumping import lumped
from gearmbs.mechanism.parts.functions import as_function
from gearmbs.mechanism.parts.joints import Joint, Row, Term
from gearmbs.studies import Case, simulate_case
from tests.mechanism.test_lumping import TIGHT, agree, exact_reactions
from tests.mechanism.test_own_forces import maxwell

SKEW = np.array([1.0, 2.0, 2.0]) / 3.0


def rotor(driven: bool = False, swapped: bool = False) -> Mechanism:
    """An eccentric rotor of two bodies on a skew axis in a bracket, with products of inertia, and a second one."""
    m = Mechanism("rotor", gravity=(1.0, -2.0, -9.0))
    bracket = m.body("bracket", 2.0, (0.1, 0.2, 0.3), position=(0.1, 0.0, -0.2))
    m.fixed("foot", bracket, m.ground, at=(0.0, 0.1, -0.3), axis=(1.0, 1.0, 0.0))
    hub = m.body(
        "hub", 1.5, (0.02, 0.03, 0.04, 0.004, -0.006, 0.008), com=(0.02, -0.01, 0.03), position=(0.2, 0.1, 0.0),
        orientation=Rotation.random(random_state=1).as_matrix(),
    )  # fmt: skip
    fan = m.body("fan", 0.4, (0.01, 0.012, 0.008), position=(0.4, 0.3, 0.1))
    m.fixed("key", fan, hub, at=(0.3, 0.2, 0.0), axis=(0.0, 1.0, 1.0))
    ends = (bracket, hub) if swapped else (hub, bracket)
    pin = m.revolute("pin", *ends, at=(0.15, 0.05, 0.02), axis=SKEW)
    if driven:
        m.rotation("drive", pin, "3*TIME + 2*TIME**2 + 0.1*SIN(7*TIME)")
    inertia = (0.01, 0.02, 0.025, 0.001, 0.002, 0.003)
    wheel = m.body("wheel", 0.8, inertia, com=(0.03, 0.0, 0.01), position=(0.6, 0.0, 0.0))
    m.revolute("pivot", wheel, m.ground, at=(0.6, 0.05, 0.0), axis=(0.0, 1.0, 1.0))
    between = wheel.marker((0.1, 0.0, 0.02)), fan.marker((0.0, 0.1, 0.0))
    m.spring_damper("tie", *between, stiffness=60.0, damping=0.5, length=0.2)
    between = hub.marker((0.1, 0.0, 0.0)), bracket.marker((0.5, 0.2, 0.3))
    m.spring_damper("stay", *between, stiffness=90.0, damping=1.0, length=0.3)
    m.torque("motor", wheel, "0.5*SIN(3*TIME)", axis=(0.0, 0.0, 1.0))
    return m


def reduced(m: Mechanism):
    one = lumped(m)
    assert one is not None
    problem, members = one.problem("SI2", 1.0)
    return problem, members


def is_reduced(m: Mechanism) -> bool:
    return len(reduced(m)[1].turn) > 0


@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize("swapped", [False, True])
def test_a_skew_eccentric_rotor(driven, swapped):
    lump, full = (rotor(driven, swapped).simulate(1.0, lump=on, **TIGHT) for on in (True, False))
    assert lump.problem.n == (2 if driven else 4)
    agree(lump, full, 1e-6)
    for k in (0, 7, 25, 50):
        exact_reactions(lump, k)
    assert np.abs(lump.constraint_violation).max() == 0.0
    # what is left is the rule by which works are summed up between outputs
    ours, theirs = lump.energy_balance(), full.energy_balance()
    np.testing.assert_allclose(ours.imbalance, theirs.imbalance, atol=1e-7 * float(theirs.kinetic.max()))
    assert float(np.abs(ours.imbalance).max()) < 1e-4 * float(theirs.kinetic.max())
    np.testing.assert_allclose(lump.joint_angle("pin"), full.joint_angle("pin"), atol=1e-6)


@pytest.mark.parametrize("integrator", ["GSTIFF", "IDA"])
def test_other_integrators(integrator):
    settings = {"tol": 1e-9, "rate": 50.0, "integrator": integrator}
    lump, full = (rotor().simulate(0.5, lump=on, **settings) for on in (True, False))
    assert lump.problem.n == 4
    agree(lump, full, 1e-5)


@pytest.mark.parametrize("formulation", ["I3", "SI1"])
def test_other_formulations_keep_six_coordinates_and_the_message_says_so(formulation):
    lump = rotor().simulate(0.1, lump=True, tol=1e-6, formulation=formulation)
    assert lump.problem.n > 20
    assert f"with {formulation}" in lump.message
    agree(lump, rotor().simulate(0.1, tol=1e-6, formulation=formulation), 1e-3)


def differences(problem, y, yp, t, cj):
    """Return dG/dy + cj dG/dy' by central differences."""
    out = np.zeros((problem.n, problem.n))
    work = np.zeros(problem.work_size)
    for k in range(problem.n):
        sides = []
        for sign in (1.0, -1.0):
            step = sign * 1e-6 * max(1.0, abs(y[k]))
            a, b, res = y.copy(), yp.copy(), np.zeros(problem.n)
            a[k] += step
            b[k] += cj * step
            problem.residual(t, a, b, res, problem.idata, problem.rdata, work)
            sides.append(res)
        out[:, k] = (sides[0] - sides[1]) / (2e-6 * max(1.0, abs(y[k])))
    return out


def with_states() -> Mechanism:
    """The rotor with states of expressions and of a kernel, loads that depend on them, and angles past full turns."""
    m = rotor()
    pin, pivot = m.joints["pin"], m.joints["pivot"]
    m.torque("spin", m.bodies["hub"], "12*STEP(TIME, 0, 0, 0.2, 1)", axis=SKEW)
    m.torsion_spring("wound", pin.i, pin.j, stiffness=0.05, damping=0.02)
    m.differential_state("turned", f"20*(AZ({pin.i.name}, {pin.j.name}) - DIF(turned))")
    m.differential_state("lag", f"WZ({pivot.i.name}, {pivot.j.name}) - 3*DIF(lag) + 0.1*DIF(turned)", start=0.2)
    i, j = m.bodies["fan"].marker((0.1, 0.2, 0.3)), m.bodies["wheel"].marker()
    m.load("pull", i, j, fx="1 + TIME", ty="-0.2*DIF(lag)")
    m.axis_torque("filter", pivot.i, pivot.j, "-0.01*DIF(turned) - 0.1*DIF(lag)")
    m.force(
        "strut", maxwell, j, m.ground.marker((0.5, 0.3, 0.4)), parameters=(200.0, 20.0), states={"creep": 0.002},
        diagnostics=[("spring", "J", "stored"), ("dashpot", "W", "dissipated")],
    )  # fmt: skip
    return m


def dense(problem, vals):
    """Return a matrix of a problem's pattern."""
    out = np.zeros((problem.n, problem.n))
    out[problem.indices, np.repeat(np.arange(problem.n), np.diff(problem.indptr))] = vals
    return out


@pytest.mark.slow
@pytest.mark.parametrize("make", [rotor, lambda: rotor(True), with_states])
def test_jacobian(make):
    problem, _ = reduced(make())
    random = np.random.default_rng(3)
    y, yp = random.uniform(-1.0, 1.0, problem.n), random.uniform(-1.0, 1.0, problem.n)
    vals, t, cj = np.zeros(len(problem.indices)), 0.3, 7.0
    problem.jacobian(t, y, yp, cj, vals, problem.idata, problem.rdata, np.zeros(problem.work_size))
    expected = differences(problem, y, yp, t, cj)
    np.testing.assert_allclose(dense(problem, vals), expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.slow
def test_states_and_counted_angles():
    lump, full = (with_states().simulate(0.8, lump=on, **TIGHT) for on in (True, False))
    assert lump.problem.n == 7
    agree(lump, full, 1e-5)
    np.testing.assert_allclose(lump.state("lag"), full.state("lag"), atol=1e-7)
    np.testing.assert_allclose(lump.evaluate("AZ(pin.I, pin.J)"), full.evaluate("AZ(pin.I, pin.J)"), atol=1e-6)
    assert np.abs(lump.joint_angle("pin")).max() > 2.0 * np.pi


@pytest.mark.parametrize("setting", [{}, {"misalignment": "1 deg"}, {"centre_distance_error": "3 mm"}], ids=str)
@pytest.mark.parametrize("torque", ["100 N m", "200 N m"])
@pytest.mark.slow
def test_gear_cases(setting, torque):
    """At the states of the reduced run all bodies' own equations give the same reactions and accelerations."""
    case = Case(operation={"duration": 0.002, "torque": torque}, fault=setting, solver={"lump": True})
    lump = simulate_case(case)
    assert lump.problem.n == 2
    for k in np.linspace(0, len(lump) - 1, 9).astype(int):
        exact_reactions(lump, k)


def two_wheels(held: bool = False) -> Mechanism:
    """A pair on two shafts with keys, driven by nothing; ``held`` by a spring that looks at a wheel's frame."""
    pair = GearPair.paper(backlash="0.1 mm")
    place = pair.placement(0.1)
    m = Mechanism("wheels")
    frames = []
    for k, wheel in enumerate(pair.wheels):
        origin, axes = (place.origin_1, place.axes_1) if k == 0 else (place.origin_2, place.axes_2)
        body = m.body(f"wheel {k + 1}", wheel.mass, wheel.inertia, position=origin, orientation=axes)
        shaft = m.body(f"shaft {k + 1}", 1.0, (0.1, 0.1, 0.1), position=origin + 0.1 * axes[:, 2])
        m.fixed(f"key {k + 1}", body, shaft, at=origin)
        # the second hinge is seen from its other end
        m.revolute(f"hinge {k + 1}", shaft, m.ground, at=origin, axis=axes[:, 2] * (1.0 - 2.0 * k))
        frames.append(body.marker())
    m.gear_contact("mesh", *frames, pair)
    if held:
        m.spring_damper("stay", frames[0], m.ground.marker((0.4, 0.3, 0.2)), stiffness=10.0, damping=0.1, length=0.2)
    return m


@pytest.mark.parametrize("held", [False, True])
def test_wheels_by_their_angles_have_the_equations_of_wheels_by_their_frames(held, monkeypatch):
    lean, _ = reduced(two_wheels(held))
    monkeypatch.setattr("gearmbs.gears.contact_element.lean_contact", lambda *tables: None)
    whole, _ = reduced(two_wheels(held))
    random = np.random.default_rng(4)
    assert lean.rdata.size > whole.rdata.size
    largest = 0.0
    for _ in range(30):
        turn, spin = random.uniform(-5.0, 5.0), random.uniform(-200.0, 200.0)
        y = np.array([spin, spin + random.normal(), turn, turn + random.uniform(-4e-3, 4e-3)])
        found = []
        for problem in (lean, whole):
            out, vals, work = np.zeros(4), np.zeros(problem.indices.size), np.zeros(problem.work_size)
            problem.residual(0.0, y, np.zeros(4), out, problem.idata, problem.rdata, work)
            problem.jacobian(0.0, y, np.zeros(4), 3.0, vals, problem.idata, problem.rdata, work)
            found.append((out[:2], dense(problem, vals)[:2]))
        (ours, by), (theirs, exact) = found
        largest = max(largest, float(np.abs(theirs).max()))
        assert ours == pytest.approx(theirs, rel=1e-8, abs=1e-8)
        assert by == pytest.approx(exact, rel=1e-8, abs=1e-8 * np.abs(exact).max())
    assert largest > 100.0


def a_reaction_in_a_load() -> Mechanism:
    m = rotor()
    pivot = m.joints["pivot"]
    m.axis_torque("brake", pivot.i, pivot.j, f"0.01*JOINT(pin, 0, 4, {m.joints['pin'].j.name})")
    return m


def a_load_in_a_load() -> Mechanism:
    m = rotor()
    pivot = m.joints["pivot"]
    m.axis_torque("first", pivot.i, pivot.j, "SIN(TIME)")
    m.axis_torque("echo", m.joints["pin"].i, m.joints["pin"].j, f"0.1*SFORCE(first, 0, 8, {pivot.j.name})")
    return m


def a_coupler() -> Mechanism:
    m = rotor()
    m.gear("mesh", m.joints["pin"], m.joints["pivot"], -0.5)
    return m


def a_free_body() -> Mechanism:
    m = rotor()
    m.body("stone", 1.0, (0.1, 0.1, 0.1))
    return m


@pytest.mark.parametrize("make", [a_reaction_in_a_load, a_load_in_a_load, a_coupler, a_free_body])
def test_what_is_not_so_simple_keeps_six_coordinates(make):
    assert not is_reduced(make())
    agree(make().simulate(0.2, lump=True, **TIGHT), make().simulate(0.2, **TIGHT), 1e-6)


def test_without_a_fixed_joint():
    """A physical pendulum: one angle, and the reactions of its pin by hand."""
    m = Mechanism("pendulum", gravity=(0.0, 0.0, -9.81))
    bob = m.body("bob", 2.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.revolute("pin", bob, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
    lump, full = (m.simulate(1.0, lump=on, **TIGHT) for on in (True, False))
    assert lump.problem.n == 2
    agree(lump, full, 1e-7)
    angle = np.arctan2(-lump.com_position("bob")[:, 2], lump.com_position("bob")[:, 0])
    rate = lump.angular_velocity("bob")[:, 1]
    alpha = 2.0 * 9.81 * np.cos(angle) / 2.1
    np.testing.assert_allclose(lump.angular_acceleration("bob")[:, 1], alpha, rtol=1e-9, atol=1e-9)
    along = lump.reaction("pin")[0] @ np.array([1.0, 0.0, 0.0]) * np.cos(angle)
    along -= lump.reaction("pin")[0] @ np.array([0.0, 0.0, 1.0]) * np.sin(angle)
    np.testing.assert_allclose(along, -2.0 * rate**2 - 2.0 * 9.81 * np.sin(angle), atol=1e-8)


def test_a_second_bearing_is_redundant():
    m = rotor()
    m.revolute("end", m.bodies["hub"], m.bodies["bracket"], at=np.array([0.15, 0.05, 0.02]) + 0.4 * SKEW, axis=SKEW)
    lump, full = m.simulate(0.3, lump=True, **TIGHT), m.simulate(0.3, **TIGHT)
    assert lump.success
    assert lump.problem.n == 4
    assert lump.message.split("Removed as")[1] == full.message.split("Removed as")[1]
    agree(lump, full, 1e-6)


def test_a_driven_bodies_only_mechanism_has_nothing_to_integrate():
    m = Mechanism("driven", gravity=(0.0, 0.0, -9.81))
    bob = m.body("bob", 2.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.rotation("drive", m.revolute("pin", bob, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0)), "TIME**2")
    assert not is_reduced(m)
    agree(m.simulate(0.5, lump=True, **TIGHT), m.simulate(0.5, **TIGHT), 1e-8)


def driven_elsewhere(apart: float, tilt: float = 0.0) -> Mechanism:
    """The rotor, its hub driven between markers of their own, further along the axis: x axes apart, z axes tilted."""
    m = rotor()
    pin, place = m.joints["pin"], np.array([0.15, 0.05, 0.02]) + 0.3 * SKEW
    ends = []
    for marker, turn in ((pin.i, apart), (pin.j, 0.0)):
        body = marker.body
        axes = marker.global_orientation() @ Rotation.from_euler("zx", [turn, tilt]).as_matrix()
        ends.append(body.marker(body.orientation.T @ (place - body.position), body.orientation.T @ axes))
    function = as_function("0.2 + 3*TIME + 0.1*SIN(7*TIME)", "rad", "drive")
    row = Row("angle", (Term(terms.ROTATION, *ends),), None, function)
    m.joints["drive"] = Joint("drive", "rotation", *ends, [row])
    return m


@pytest.mark.parametrize("apart", [0.2, np.pi + 0.2])
def test_a_motion_between_markers_of_its_own(apart):
    """Where they are along the axis makes no difference, as a rotation exerts a moment alone."""
    assert reduced(driven_elsewhere(apart))[1].turn[0, TURN_ROOT] == (1 if apart < 1.0 else -1)
    lump, full = (driven_elsewhere(apart).simulate(0.5, lump=on, **TIGHT) for on in (True, False))
    assert lump.problem.n == 2
    agree(lump, full, 1e-6)
    exact_reactions(lump, 7)


def test_a_motion_about_another_axis_keeps_six_coordinates():
    assert not is_reduced(driven_elsewhere(0.2, tilt=1e-3))
    lump, full = (driven_elsewhere(0.2, tilt=1e-3).simulate(0.2, lump=on, **TIGHT) for on in (True, False))
    agree(lump, full, 1e-6)


@pytest.mark.parametrize("level", ["displacement", "velocity", "acceleration"])
@pytest.mark.parametrize("apart", [0.4, np.pi - 0.2, np.pi + 0.9])
@pytest.mark.slow
def test_a_motion_whose_x_axes_start_apart(apart, level):
    """Beyond a quarter of a turn the motion holds them opposite; torque and power of the drive are then the same."""

    def make() -> Mechanism:
        m = Mechanism("driven", gravity=(0.0, -9.81, 0.0))
        wheel = m.body("wheel", 1.0, (0.01, 0.012, 0.02, 0.001, -0.002, 0.001), com=(0.02, 0.01, 0.03))
        on_wheel = wheel.marker((0.0, 0.0, 0.0), Rotation.from_euler("z", apart).as_matrix())
        pin = m.revolute("pin", on_wheel, m.ground.marker((0.0, 0.0, 0.0)))
        settings = {"displacement": {}, "velocity": {"start": 0.3}, "acceleration": {"start": 0.3, "rate": 2.0}}
        function = "0.3 + 2*TIME + SIN(5*TIME)" if level == "displacement" else "3 + 20*TIME"
        m.rotation("drive", pin, function, level=level, **settings[level])
        arm = m.body("arm", 0.5, (0.01, 0.01, 0.01), com=(0.0, 0.05, 0.0), position=(1.0, 0.0, 0.0))
        m.revolute("pivot", arm, m.ground, at=(1.0, 0.0, 0.0))
        ends = wheel.marker((0.1, 0.05, 0.0)), arm.marker((-0.1, 0.02, 0.05))
        m.spring_damper("tie", *ends, stiffness=50.0, damping=0.3, length=0.7)
        return m

    assert reduced(make())[1].turn[0, TURN_ROOT] == (1 if apart < 0.5 * np.pi else -1)
    settings = TIGHT | {"t_start": 0.2}
    lump, full = make().simulate(0.5, lump=True, **settings), make().simulate(0.5, **settings)
    assert lump.problem.n == 2
    agree(lump, full, 1e-6)
    exact_reactions(lump, 7)
    ours, theirs = lump.energy_balance(), full.energy_balance()
    for name in theirs:
        np.testing.assert_allclose(ours[name], theirs[name], atol=1e-6 * float(theirs.kinetic.max()))


@pytest.mark.parametrize("lump", [False, True])
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
def test_turns_of_a_driven_body_that_turns_back_between_outputs(integrator, lump):
    """The integral of a counted angle, 12 sin(9 t): z = 4/3 (1 - cos(9 t))."""
    m = Mechanism("driven")
    wheel = m.body("wheel", 1.0, (0.1, 0.1, 0.1))
    pin = m.revolute("pin", wheel, m.ground, at=(0.0, 0.0, 0.0))
    m.rotation("drive", pin, "12*SIN(9*TIME)")
    m.differential_state("sum", f"AZ({pin.i.name}, {pin.j.name})")
    slow = m.body("slow", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.revolute("pivot", slow, m.ground, at=(1.0, 0.0, 0.0))
    solution = m.simulate(1.5, lump=lump, integrator=integrator, tol=1e-8, t_eval=(0.0, 0.7, 1.5))
    np.testing.assert_allclose(solution.state("sum"), 4.0 / 3.0 * (1.0 - np.cos(9.0 * solution.t)), atol=1e-5)
