"""Point masses: against closed forms, minimal coordinates and rigid bodies; what they refuse."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.sparse import csc_array

from gearmbs.adams import parse_deck
from gearmbs.adams.write.deck_writer import write_deck
from gearmbs.dae.equations import jacobian as exact
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.residual import residual
from gearmbs.dae.model.model import Configuration
from gearmbs.dae.model.system import FORMULATIONS
from gearmbs.mechanism import Mechanism, ModelError, PointMass, kinematic, quasi_static, static_equilibrium
from gearmbs.mechanism.checks import singular_passage
from gearmbs.view import mechanism_scene, solution_scene
from tests.says import says

G = 9.81
TURNED = (0.3, 0.7, -0.2)


# --- equations -----------------------------------------------------------------------------------------


def joined(kind: str) -> Mechanism:
    """Two point masses and a rigid body between them, so that unknowns of angles have gaps, joined by one thing."""
    m = Mechanism(kind, gravity=(0.3, -0.2, -G))
    one = m.point_mass("one", 1.5, at=(0.1, 0.2, -0.1), com=(0.05, 0.1, 0.2), orientation=TURNED)
    block = m.body("block", 2.0, (0.02, 0.03, 0.04), position=(0.5, 0.1, 0.2), orientation=(0.4, 1.1, 0.2))
    two = m.point_mass("two", 0.7, at=(-0.4, 0.3, 0.6))
    i, k = one.marker((0.1, -0.2, 0.3), TURNED, name="I"), two.marker((0.0, 0.0, 0.1), (1.0, 0.5, 0.3), name="K")
    j, g = block.marker((0.1, 0.05, 0.2), (0.1, 0.4, 0.3), name="J"), m.ground.marker((0.3, 0.3, 0.3), name="G")
    if kind == "spring":
        m.spring_damper("s", i, j, stiffness=50.0, damping=3.0)
        m.spring_damper("between", k, i, stiffness=20.0, damping=1.0)
        m.spring_damper("own", g, k, stiffness=20.0, damping=1.0)
    elif kind == "load":
        m.load("l", i, j, rm=k, fx="3*DX(I,J,K)*TIME", fy="VM(I,J)", fz="AZ(I,J)+WY(I,J,J)")
        m.load("back", j, k, fz="DM(I,J)*PHI(J,K)")
    elif kind == "bushing":
        m.bushing("b", j, i, stiffness=(10.0, 20.0, 30.0), damping=(1.0, 2.0, 3.0))
    elif kind == "expression":
        m.general_constraint("g", "DX(I,J)*DM(I,G)-0.3*DY(K,J,J)+SIN(TIME)")
        m.differential_state("w", "DM(I,K)+VZ(K,G)")
    elif kind == "distance":
        m.distance("d", i, j)
        m.distance("e", k, i)
    elif kind == "reaction":
        m.joint("inline", "slide", i, j)
        m.distance("rod", k, g)
        m.load("l", j, g, fx="JOINT(slide,0,2,0)", fy="GCON(rod,0,2,0)")
    elif kind == "swapped":
        m.joint("inline", "l", j, i)
        m.joint("inplane", "p", g, k)
    else:
        m.joint(kind, "a", i, j)
        m.joint(kind, "b", k, i)
    return m


KINDS = [
    "spring", "load", "bushing", "expression", "reaction", "distance", "swapped", "spherical", "at_point", "inplane",
    "inline",
]  # fmt: skip


@pytest.mark.parametrize("formulation", list(FORMULATIONS))
@pytest.mark.parametrize("kind", KINDS)
def test_jacobian_equals_central_differences(kind, formulation):
    model = joined(kind).compile().model
    form = FORMULATIONS[formulation]
    idata, rdata, size = model.pack(form)
    n = int(idata[T.H_UNKNOWNS])
    indptr, indices, slots = exact.pattern(idata, rdata, size, 0.0, np.zeros(n))
    idata, rdata, size = model.pack(form, slots)
    rng = np.random.default_rng(7)
    y, yp, work = rng.standard_normal(n), rng.standard_normal(n), np.zeros(size)
    cj, t = 2.7, 0.31
    vals = np.zeros(indices.size)
    exact.jacobian(t, y, yp, cj, vals, idata, rdata, work)
    found = csc_array((vals, indices, indptr), shape=(n, n)).toarray()

    def evaluate(dy):
        out = np.zeros(n)
        residual(t, y + dy, yp + cj * dy, out, idata, rdata, work)
        return out

    h = 1e-3
    steps = h * np.eye(n)
    columns = [(8 * (evaluate(e) - evaluate(-e)) - (evaluate(2 * e) - evaluate(-2 * e))) / (12 * h) for e in steps]
    np.testing.assert_allclose(found, np.array(columns).T, atol=5e-8 * max(1.0, np.abs(found).max()))


@pytest.mark.parametrize("kind", KINDS[3:])
def test_quadratic_part_is_the_second_derivative_along_a_motion(kind):
    system = joined(kind).compile()
    pose = system.pose.copy()
    pose[:, 12:] = np.random.default_rng(3).standard_normal((3, 6))
    pose[[0, 2], 15:] = 0.0
    place = Configuration(pose)

    def at(s):
        found = system.assembler.at(place.displaced(s * place.velocities), 0.3 + s, None, system.state_start)
        return found.phi[0::3], found.phi[1::3], found.rhs[place.coordinates :]

    h = 1e-3
    values = [at(k * h) for k in (-2, -1, 0, 1, 2)]
    first, second = (
        (8 * (values[3][k] - values[1][k]) - (values[4][k] - values[0][k])) / (12 * h) for k in range(2)
    )  # fmt: skip
    np.testing.assert_allclose(values[2][1], first, atol=1e-8)
    np.testing.assert_allclose(-values[2][2], second, atol=1e-7)


def test_a_point_mass_has_three_coordinates():
    m = joined("spring")
    system = m.compile()
    names = [u.name for u in system.model.unknowns("I3")]
    assert names[:9] == [f"u_{c}({b})" for b in ("one", "block", "two") for c in "xyz"]
    assert [n for n in names if n.startswith("theta_")] == [f"theta_{c}(block)" for c in ("psi", "theta", "phi")]
    assert len(names) == len(system.problem("I3").y0)
    counts = system.model.counts
    assert counts.coordinates == 12
    assert counts.owners.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 1, 1, 1]
    assert system.report.degrees_of_freedom == 12
    assert "12 coordinates" in repr(m)
    assert repr(m.bodies["one"]) == "PointMass('one', mass=1.5 kg, 1 markers)"


# --- motion --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", list(FORMULATIONS))
def test_a_pendulum_is_that_of_a_rigid_body_of_hardly_any_inertia(formulation):
    """Of a rod without mass; the point mass hangs excentrically and in axes of its own, which changes nothing."""
    runs = []
    for point in (True, False):
        m = Mechanism("pendulum", gravity=(0, 0, -G))
        if point:
            ball = m.point_mass("ball", 2.0, at=(0.6, 0.2, 0.1), com=(0, 0, 0.1), orientation=TURNED)
            eye = ball.marker(ball.com)
            start = eye.global_position()
        else:
            ball = m.body("ball", 2.0, (1e-9, 1e-9, 1e-9), position=start, velocity=(0, 1.0, 0))
            eye = ball.marker()
        ball.velocity = np.array([0.0, 1.0, 0.0])
        m.distance("rod", eye, m.ground.marker())
        runs.append(m.simulate(1.0, rate=20, tol=1e-9, formulation=formulation))
    np.testing.assert_allclose(runs[0].com_position("ball"), runs[1].com_position("ball"), atol=1e-7)
    pulls = [run.reaction_force("rod") for run in runs]
    np.testing.assert_allclose(pulls[0], pulls[1], atol=1e-5 * np.abs(pulls[1]).max())


@pytest.mark.parametrize("kind", ["spherical", "at_point"])
def test_a_point_mass_on_a_rod_adds_its_steiner_part(kind):
    """A hinged rod with a point mass at its tip is the rod with that mass times the length squared."""
    m = Mechanism("rod", gravity=(0, 0, -G))
    rod = m.body("rod", 1.0, (0.01, 0.1, 0.1), position=(0.5, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    ball = m.point_mass("ball", 0.5, at=(1.2, 0, 0))
    m.joint(kind, "tip", ball, rod, at=(1.2, 0, 0))
    s = m.simulate(1.0, rate=20, tol=1e-9)
    assert s.system.report.degrees_of_freedom == 1
    inertia, pull = 0.1 + 0.25 + 0.5 * 1.44, (0.5 + 0.5 * 1.2) * G
    swing = solve_ivp(lambda t, y: [y[1], pull / inertia * np.cos(y[0])], (0, 1), [0, 0], t_eval=s.t, rtol=1e-11,
                      atol=1e-12)  # fmt: skip
    angle = swing.y[0]
    np.testing.assert_allclose(s.com_position("ball")[:, 2], -1.2 * np.sin(angle), atol=1e-7)
    np.testing.assert_allclose(s.orientation("ball"), np.tile(np.eye(3), (21, 1, 1)), atol=0)
    np.testing.assert_allclose(s.angular_velocity("ball"), 0.0, atol=0)
    assert np.abs(s.energy_balance()["imbalance"]).max() < 1e-6


def two_masses(k: float = 300.0, c: float = 0.0) -> Mechanism:
    m = Mechanism("two masses")
    left, right = m.point_mass("left", 2.0), m.point_mass("right", 0.5, at=(1.1, 0, 0))
    m.spring_damper("spring", left.marker(), right.marker(), stiffness=k, damping=c, length=1.0)
    return m


def test_two_masses_on_a_spring_vibrate_at_their_reduced_mass():
    s = two_masses().simulate(1.0, rate=100, tol=1e-9)
    rate = np.sqrt(300.0 / 0.4)
    apart = s.com_position("right")[:, 0] - s.com_position("left")[:, 0]
    np.testing.assert_allclose(apart, 1.0 + 0.1 * np.cos(rate * s.t), atol=1e-6)
    np.testing.assert_allclose(
        2.0 * s.com_position("left")[:, 0] + 0.5 * s.com_position("right")[:, 0], 0.55, atol=1e-9
    )


def test_linear_modes_of_two_masses():
    modes = two_masses(c=0.8).linear_modes()
    # held along the line alone: five rigid motions, of which two pull at the stretched spring
    rate = np.sqrt(300.0 / 0.4)
    found = modes.frequencies[modes.oscillating]
    np.testing.assert_allclose(found.max(), rate / (2 * np.pi), rtol=1e-9)
    shape = modes.shapes[modes.oscillating[np.argmax(found)]]
    np.testing.assert_allclose(np.abs(shape[:, 0]), [0.25, 1.0], atol=1e-9)
    np.testing.assert_allclose(shape[:, 1:], 0.0, atol=1e-9)
    damped = modes.damping_ratios[modes.oscillating[np.argmax(found)]]
    np.testing.assert_allclose(damped, 0.8 / 0.4 / (2 * rate), rtol=1e-8)


def test_a_chain_of_five_against_minimal_coordinates():
    """Angles of the links from the vertical: M_ij = l^2 cos(a_i - a_j) sum of the masses from the later one on."""
    masses, length = np.array([0.3, 1.0, 0.2, 0.5, 0.7]), 0.4
    starts = np.array([0.9, 0.3, 1.4, -0.2, 0.6])
    m = Mechanism("chain", gravity=(0, 0, -G))
    place, last = np.zeros(3), m.ground.marker()
    for k, (mass, angle) in enumerate(zip(masses, starts)):
        place = place + length * np.array([np.sin(angle), 0.0, -np.cos(angle)])
        bob = m.point_mass(f"bob{k}", mass, at=place).marker()
        m.distance(f"link{k}", bob, last)
        last = bob
    s = m.simulate(0.6, rate=50, tol=1e-10)
    assert s.system.report.degrees_of_freedom == 10
    below = np.cumsum(masses[::-1])[::-1]
    shared = below[np.maximum.outer(np.arange(5), np.arange(5))]

    def rates(t, y):
        a, w = y[:5], y[5:]
        apart = a[:, None] - a
        force = -length * (shared * np.sin(apart)) @ w**2 - G * below * np.sin(a)
        return np.concatenate([w, np.linalg.solve(length * shared * np.cos(apart), force)])

    y0 = np.concatenate([starts, np.zeros(5)])
    angles = solve_ivp(rates, (0, 0.6), y0, t_eval=s.t, rtol=1e-11, atol=1e-12).y[:5]
    np.testing.assert_allclose(s.com_position("bob4")[:, 0], length * np.sin(angles).sum(axis=0), atol=1e-6)
    np.testing.assert_allclose(s.com_position("bob4")[:, 2], -length * np.cos(angles).sum(axis=0), atol=1e-6)
    assert np.abs(s.energy_balance()["imbalance"]).max() < 1e-6


def slider(rate: float = 3.0) -> Mechanism:
    """Crank of 0.2 m, rod of 0.5 m without mass, a point mass for a piston; nothing is left free."""
    m = Mechanism("slider", gravity=(0, 0, -G))
    crank = m.body("crank", 1.0, (0.01, 0.01, 0.01))
    piston = m.point_mass("piston", 2.0, at=(0.7, 0, 0))
    m.rotation("motor", m.revolute("pin", crank, m.ground, axis=(0, 1, 0)), f"{rate}*TIME")
    m.distance("rod", crank.marker((0.2, 0, 0)), piston.marker())
    m.joint("inline", "rail", piston, m.ground, axis=(1, 0, 0))
    return m


@pytest.mark.parametrize("way", ["kinematic", "WSTIFF", "IDA"])
def test_a_piston_follows_its_crank(way):
    m, t = slider(), np.linspace(0.0, 1.0, 11)
    s = kinematic(m, t) if way == "kinematic" else m.simulate(1.0, rate=10, tol=1e-8, integrator=way)
    assert s.system.report.degrees_of_freedom == 0
    a = 3.0 * t
    place = 0.2 * np.cos(a) + np.sqrt(0.25 - 0.04 * np.sin(a) ** 2)
    np.testing.assert_allclose(s.com_position("piston")[:, 0], place, atol=1e-6)
    h = 1e-4
    near = [0.2 * np.cos(b) + np.sqrt(0.25 - 0.04 * np.sin(b) ** 2) for b in (a - 3 * h, a, a + 3 * h)]
    np.testing.assert_allclose(s.com_acceleration("piston")[:, 0], (near[0] - 2 * near[1] + near[2]) / h**2, atol=1e-5)


@pytest.mark.parametrize("rate", [37, 10])
def test_a_position_of_change_passed_between_outputs_is_found(rate):
    """Of a rod as long as the crank: at a quarter turn the piston could stay in the middle."""
    found = []
    for point in (True, False):
        m = Mechanism("equal")
        crank = m.body("crank", 1.0, (0.01, 0.01, 0.01), orientation=[[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
        piston = m.point_mass("piston", 2.0, at=(0.32, 0, 0)) if point else m.body("piston", 2.0, (1, 1, 1),
                                                                                   position=(0.32, 0, 0))  # fmt: skip
        m.rotation("motor", m.revolute("pin", crank, m.ground, axis=(0, 1, 0)), "1.5*TIME")
        m.distance("rod", crank.marker((0.2, 0, 0)), piston.marker())
        m.joint("inline" if point else "translational", "rail", piston, m.ground, axis=(1, 0, 0))
        found.append(singular_passage(m.simulate(1.0, rate=rate)))
    assert found[0] is not None
    np.testing.assert_allclose(found[0][0], found[1][0], atol=1e-6)
    assert "rod: distance 0.2 m" in found[0][1]


def test_a_force_acts_along_the_axes_a_marker_was_given():
    """x of a marker turned with the body's frame: both stay, so the acceleration is constant."""
    m = Mechanism("thrust")
    ball = m.point_mass("ball", 2.0, at=(1, 2, 3), velocity=(0, 0, 1), orientation=TURNED)
    nozzle = ball.marker((0.3, 0.1, -0.2), (0.2, 0.4, 0.6), name="nozzle")
    m.load("thrust", nozzle, m.ground.marker(), rm=nozzle, fx=6.0)
    s = m.simulate(1.0, rate=10, tol=1e-8)
    along = nozzle.global_orientation()[:, 0]
    moved = np.outer(s.t, [0, 0, 1]) + np.outer(1.5 * s.t**2, along)
    np.testing.assert_allclose(s.com_position("ball") - [1, 2, 3], moved, atol=1e-7)
    np.testing.assert_allclose(s.marker_position(nozzle) - nozzle.global_position(), moved, atol=1e-7)
    np.testing.assert_allclose(s.com_acceleration("ball"), np.tile(3.0 * along, (11, 1)), atol=1e-9)


def test_what_a_joint_between_a_body_and_a_point_mass_carries():
    """A block that slides along a track that a point mass carries: the track keeps its direction."""
    m = Mechanism("track", gravity=(0, 0, -G))
    carrier = m.point_mass("carrier", 3.0)
    track = carrier.marker(axis=(1.0, 0.0, -1.0), name="track")
    block = m.body("block", 1.0, (0.1, 0.1, 0.1))
    m.joint("inline", "slide", block.marker(), track)
    m.joint("inline", "rail", carrier, m.ground, axis=(1, 0, 0))
    s = m.simulate(0.5, rate=10, tol=1e-9)
    assert s.system.report.degrees_of_freedom == 5
    # wedge of 45 degrees: x'' of the carrier is -m sin cos g / (M + m sin^2)
    push = -0.5 * G / (3.0 + 0.5)
    np.testing.assert_allclose(s.com_position("carrier")[:, 0], 0.5 * push * s.t**2, atol=1e-7)
    np.testing.assert_allclose(s.com_position("block")[:, 0], -1.5 * push * s.t**2, atol=1e-7)


# --- analyses ------------------------------------------------------------------------------------------


def test_a_weight_between_two_springs_rests_where_their_forces_balance():
    m = Mechanism("net", gravity=(0, 0, -G))
    knot = m.point_mass("knot", 1.0, at=(0.1, 0.05, 0.2))
    for k, x in enumerate((-1.0, 1.0)):
        m.line_force(f"rope{k}", knot.marker(), m.ground.marker((x, 0, 0)), f'-100*DM("knot.marker{k + 1}",'
                     f'"ground.marker{k + 1}")')  # fmt: skip
    rest = static_equilibrium(m)
    # two springs of no free length: 200 N/m from the middle
    np.testing.assert_allclose(rest.pose[0, :3], [0, 0, -G / 200], atol=1e-10)
    m.load("wind", knot.marker(name="W"), m.ground.marker(), fx="20*TIME")
    followed = quasi_static(m, np.linspace(0.0, 1.0, 3))
    np.testing.assert_allclose(followed.com_position("knot")[:, 0], [0, 0.05, 0.1], atol=1e-9)


@pytest.mark.slow
def test_a_free_point_mass_without_a_balance_is_named():
    m = Mechanism("falling", gravity=(0, 0, -G))
    m.point_mass("stone", 1.0)
    m.body("held", 1.0, (1, 1, 1))
    m.fixed("weld", m.bodies["held"], m.ground)
    with pytest.raises(ModelError, match=says("stone", "translation", "hold it")):
        static_equilibrium(m)


def test_assembly_moves_a_point_mass_and_keeps_its_axes():
    m = Mechanism("assembled")
    ball = m.point_mass("ball", 1.0, at=(0.2, 0.0, 0.01), velocity=(1.0, 0.0, 0.5), orientation=TURNED)
    m.joint("inplane", "floor", ball.marker(), m.ground.marker())
    system = m.compile()
    system.initialise()
    np.testing.assert_allclose(system.pose[0, :3], [0.2, 0, 0], atol=1e-12)
    np.testing.assert_allclose(system.pose[0, 3:12].reshape(3, 3), ball.orientation, atol=0)
    np.testing.assert_allclose(system.pose[0, 12:], [1, 0, 0, 0, 0, 0], atol=1e-12)


def test_a_point_mass_held_by_joints_alone_is_remarked_as_locked():
    m = Mechanism("locked")
    ball, free = m.point_mass("ball", 1.0), m.point_mass("free", 1.0, at=(1, 0, 0))
    m.spherical("a", ball, m.ground)
    m.joint("inplane", "b", free, m.ground)
    message = m.simulate(0.01).message
    assert "'ball' cannot move" in message
    assert "'free'" not in message


def test_modes_beside_a_spinning_rotor():
    """A rotor that spins describes its own rotations otherwise; a point mass on a spring beside it does not care."""
    m = Mechanism("beside")
    ball = m.point_mass("ball", 2.0, at=(1, 0, 0))
    rotor = m.body("rotor", 1.0, (0.02, 0.02, 0.04), angular_velocity=(0, 0, 100.0))
    m.revolute("axle", rotor, m.ground)
    m.bushing("springs", ball.marker(), m.ground.marker((1, 0, 0)), stiffness=(8.0, 18.0, 32.0))
    modes = m.linear_modes()
    np.testing.assert_allclose(2 * np.pi * modes.frequencies[modes.oscillating], [2, 3, 4], rtol=1e-7)


def test_bodies_fixed_to_each_other_are_one_beside_a_point_mass():
    runs = []
    for lump in (False, True):
        m = Mechanism("lumped", gravity=(0, 0, -G))
        arm = m.body("arm", 1.0, (0.01, 0.1, 0.1), position=(0.5, 0, 0))
        head = m.body("head", 0.4, (0.01, 0.01, 0.01), position=(1, 0, 0))
        ball = m.point_mass("ball", 0.5, at=(1, 0.1, 0.3), com=(0, 0, 0.2), velocity=(0.3, 0, 0), orientation=TURNED)
        m.revolute("pin", arm, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
        m.fixed("weld", head, arm)
        m.spring_damper("spring", ball.marker(ball.com), head.marker(), stiffness=40.0, length=0.2)
        runs.append(m.simulate(0.4, rate=20, tol=1e-9, lump=lump))
    for name in ("ball", "head"):
        np.testing.assert_allclose(runs[0].com_position(name), runs[1].com_position(name), atol=1e-7)
    np.testing.assert_allclose(runs[0].orientation("ball"), runs[1].orientation("ball"), atol=1e-14)
    np.testing.assert_allclose(runs[0].reaction_force("weld"), runs[1].reaction_force("weld"), atol=1e-5)


def test_it_is_drawn_and_kept():
    m = two_masses()
    s = m.simulate(0.1)
    assert s.to_dataset()["position"].sel(body="right").shape == (s.t.size, 3)
    assert {part.name for part in mechanism_scene(m).parts} >= {"left", "right"}
    assert {part.name for part in solution_scene(s).parts} >= {"left", "right"}


# --- decks ---------------------------------------------------------------------------------------------


def test_a_deck_and_back():
    m = Mechanism("deck", gravity=(0, 0, -G))
    ball = m.point_mass("ball", 2.0, at=(1, 0, 0), velocity=(0, 0.5, 0), com=(0.1, 0, 0.2), orientation=TURNED)
    hook = ball.marker((0.2, 0.1, 0), (0.1, 0.2, 0.3), name="hook")
    m.load("pull", ball.marker(name="J"), m.ground.marker(name="G"), rm=hook, fx=1.0, fz='-8*DZ("hook")', kind="vforce")
    # the reaction acts on the ball where the force does, beside it: the moment does nothing
    m.load("push", m.ground.marker((0, 0, 1), name="P"), ball.marker(name="Q"), fy="2*TIME", kind="vforce")
    text = write_deck(m)
    assert "POINT_MASS/" in text
    assert "IP =" not in text
    again = parse_deck(text).to_mechanism()
    found = next(iter(again.bodies.values()))
    assert isinstance(found, PointMass)
    np.testing.assert_allclose(found.com, ball.com, atol=1e-15)
    runs = [one.simulate(0.5, rate=20, tol=1e-9) for one in (m, again)]
    np.testing.assert_allclose(runs[1].com_position(found.name), runs[0].com_position("ball"), atol=1e-9)


# --- what is refused -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "kind", ["fixed", "revolute", "cylindrical", "translational", "planar", "orientation", "parallel_axes", "pin_slot"]
)
def test_joints_that_hold_an_orientation_are_refused(kind):
    m = Mechanism("refused")
    ball, block = m.point_mass("ball", 1.0), m.body("block", 1.0, (1, 1, 1))
    for pair in ((ball, block), (m.ground, ball)):
        with pytest.raises(ModelError, match=says("pin", "'ball'", "spherical", "m.body")):
            m.joint(kind, "pin", *pair)
    with pytest.raises(ModelError, match=says("pin", "'ball'", "spherical", "m.body")):
        m.screw("pin", ball, block, pitch=0.1)
    # the name is free again, and so are those of its markers
    m.spherical("pin", ball, block)
    with pytest.raises(ModelError, match=says("friction", "'ball'", "torque", "m.body")):
        m.friction("friction", m.joints["pin"], 0.3, 0.2, ball_radius=0.01)
    with pytest.raises(ModelError, match=says("turn", "'ball'", "m.body")):
        m.rotation("turn", m.joint("self_aligning", "eye", ball, m.ground), 1.0)


def test_torques_are_refused_and_forces_of_the_same_kind_are_not():
    m = Mechanism("refused")
    ball = m.point_mass("ball", 1.0).marker(name="B")
    ground = m.ground.marker(name="G")
    refused = {
        "torque": lambda: m.torque("t", ball, 1.0),
        "reaction": lambda: m.axis_torque("t", ground, ball, "TIME"),
        "gforce": lambda: m.load("t", ball, ground, fx=1.0, tz="0.1*TIME"),
        "bushing": lambda: m.bushing("t", ball, ground, stiffness=(1, 1, 1), torsional_stiffness=(1, 0, 0)),
        "torsion spring": lambda: m.torsion_spring("t", ball, ground, stiffness=1.0),
    }
    for add in refused.values():
        with pytest.raises(ModelError, match=says("'t'", "torque", "'ball'", "leave")):
            add()
    m.load("gforce", ball, ground, fx=1.0, tz="0")
    m.bushing("bushing", ball, ground, stiffness=(1, 1, 1))
    m.axis_force("axis", ground, ball, "TIME")
    assert np.isfinite(m.simulate(0.01).com_position("ball")).all()


@pytest.mark.parametrize("mass", [0.0, -1.0, float("nan")])
def test_a_mass_that_is_none_is_refused(mass):
    with pytest.raises(ModelError, match=says("ball", "mass", "kg")):
        Mechanism("none").point_mass("ball", mass)


def test_an_angular_velocity_is_refused():
    m = two_masses()
    m.bodies["left"].angular_velocity = np.array([0.0, 0.0, 1.0])
    with pytest.raises(ModelError, match=says("left", "angular_velocity", "inertia")):
        m.simulate(0.1)


def test_a_name_in_use_is_refused():
    m = two_masses()
    with pytest.raises(ModelError, match=says("left", "in use")):
        m.point_mass("left", 1.0)


def _turning(t, frames, states, parameters, wrench, rates, diagnostics):
    wrench[0, 0] = 1.0
    wrench[0, 5] = parameters[0]


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.slow
def test_a_torque_of_ones_own_on_a_point_mass_is_told(swapped):
    """It vanished, and so did its reaction, without a word."""
    for torque in (3.0, 0.0):
        m = Mechanism("m")
        parts = [m.point_mass("p", 2.0), m.body("b", 1.0, (0.1, 0.1, 0.1), position=(0, 1, 0))]
        i, j = parts[::-1] if swapped else parts
        m.force("f", _turning, i.marker(), j.marker(), parameters=[torque])
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            m.simulate(0.02, rate=100)
        said = [str(w.message) for w in told if "did nothing" in str(w.message)]
        assert len(said) == (torque > 0.0)
        assert all("force 'f'" in words and "3 N m" in words and "'p'" in words for words in said)
