"""Bodies fixed to each other, integrated as one: the same motions and reactions as with all bodies."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism, Mode
from gearmbs.mechanism.lumping import lumped

TIGHT = {"tol": 1e-10, "rate": 50.0}


def turned(seed: int) -> np.ndarray:
    return Rotation.random(random_state=seed).as_matrix()


def tree(seed: int = 0) -> Mechanism:
    """A tree of seven bodies on a hinge, springs and a torque between members, two more bodies on ball joints."""
    random = np.random.default_rng(seed)
    m = Mechanism("tree", gravity=(1.0, -2.0, -9.0))
    parts = []
    for k in range(7):
        rods = random.uniform(-0.3, 0.3, (6, 3))
        parts.append(
            m.body(
                f"part {k}",
                random.uniform(0.5, 2.0),
                sum(r @ r * np.eye(3) - np.outer(r, r) for r in rods) + 0.02 * np.eye(3),
                com=random.uniform(-0.1, 0.1, 3),
                position=random.uniform(-0.5, 0.5, 3),
                orientation=turned(seed + k),
            )
        )
    m.revolute("hinge", parts[2], m.ground, at=(0.1, 0.0, 0.2), axis=(0.0, 1.0, 1.0))
    for k, (i, j) in enumerate([(0, 1), (2, 1), (3, 1), (3, 4), (0, 5), (6, 5)]):
        at = random.uniform(-0.5, 0.5, 3)
        m.fixed(f"weld {k}", parts[i], parts[j], at=at, axis=random.uniform(-1.0, 1.0, 3))
    bob = m.body("bob", 0.7, (0.02, 0.03, 0.04), position=(0.5, 0.5, 0.0), angular_velocity=(1.0, 2.0, 0.0))
    m.spherical("ball", bob, parts[4], at=(0.4, 0.4, 0.1))
    ends = [parts[k].marker((0.1 * k, 0.2, -0.1)) for k in range(7)]
    m.spring_damper("spring", ends[6], m.ground.marker((1.0, 0.5, 0.2)), stiffness=80.0, damping=1.0, length=0.5)
    m.spring_damper("inner spring", ends[0], ends[3], stiffness=500.0, damping=1.0, length=0.3)
    m.spring_damper("tie", bob.marker((0.1, 0.0, 0.0)), ends[5], stiffness=60.0, damping=0.5, length=0.2)
    m.torque("motor", parts[3], "2*SIN(3*TIME)", axis=(0.0, 0.0, 1.0))
    return m


def agree(lump, full, tolerance: float) -> None:
    """Compare everything two solutions tell, relative to its largest value."""
    assert lump.success, lump.message
    a, b = lump.to_dataset(), full.to_dataset()
    assert set(a) == set(b)
    assert list(a.body.values) == list(b.body.values)
    assert list(a.joint.values) == list(b.joint.values)
    for name in set(a) - {"constraint_violation"}:
        size = max(float(np.abs(b[name]).max()), 1e-3)
        assert float(np.abs(a[name] - b[name]).max()) <= tolerance * size, name


def turned_by_rounding(pose: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return the pose with each body turned by a few last digits: its matrix comes of angles that are rounded."""
    near = pose.copy()
    for body in near:
        turn = Rotation.from_rotvec(4.0 * np.finfo(float).eps * random.choice([-1.0, 1.0], 3))
        body[3:12] = (turn.as_matrix() @ body[3:12].reshape(3, 3)).ravel()
    return near


def exact_reactions(solution, k: int) -> None:
    """Compare accelerations and multipliers at an output with the whole system solved at the same pose.

    Where stiff flanks bear a torque, or just touch, the last digits of the angles make a torque of their own, however
    small the accelerations are: what they move comes on top of 1e-9.
    """
    whole, t = solution.system, float(solution.t[k])
    pose, random = solution._pose[k].copy(), np.random.default_rng(7)
    exact = whole.accelerations(pose, t)[:2]
    # of eight, since flanks that just touch bear where they are turned one way only
    near = [whole.accelerations(turned_by_rounding(pose, random), t)[:2] for _ in range(8)]
    for found, expected, *others in zip((solution._acc[k], solution.multipliers[k]), exact, *near, strict=True):
        moved = max(np.abs(other - expected).max() for other in others)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max() + moved)


@pytest.mark.parametrize("seed", [0, 10, 20])
def test_a_tree_of_fixed_bodies(seed):
    lump, full = tree(seed).simulate(0.5, lump=True, **TIGHT), tree(seed).simulate(0.5, **TIGHT)
    assert lump.problem.n < 0.5 * full.problem.n
    assert lump.stats.steps < 1.2 * full.stats.steps
    agree(lump, full, 1e-6)
    for k in (0, 7, 25):
        exact_reactions(lump, k)


def test_energy_and_expressions_are_about_all_bodies():
    lump, full = tree().simulate(0.5, lump=True, **TIGHT), tree().simulate(0.5, **TIGHT)
    np.testing.assert_allclose(lump.kinetic_energy, full.kinetic_energy, rtol=1e-6)
    a, b = lump.energy_balance(), full.energy_balance()
    np.testing.assert_allclose(a.work_applied, b.work_applied, atol=1e-6)
    for solution in (lump, full):
        solution.system.mechanism.bodies["part 5"].marker((0.1, 0.0, 0.0), name="late")
    np.testing.assert_allclose(lump.evaluate("ACCX(late)"), full.evaluate("ACCX(late)"), atol=1e-4)
    np.testing.assert_allclose(lump.joint_angle("hinge"), full.joint_angle("hinge"), atol=1e-6)


def chain_on_ground() -> Mechanism:
    """A bracket of three bodies fixed to the ground bears a driven crank made of two, another motion moves a slide."""
    m = Mechanism("bracket", gravity=(0.0, 0.0, -9.81))
    stand = [m.body(f"stand {k}", 1.0 + k, (0.1, 0.1, 0.1), position=(0.0, 0.0, 0.2 * k)) for k in range(3)]
    m.fixed("foot", stand[0], m.ground, at=(0.0, 0.0, -0.1))
    m.fixed("lower", stand[1], stand[0], at=(0.0, 0.0, 0.1), axis=(0.0, 1.0, 0.0))
    m.fixed("upper", stand[1], stand[2], at=(0.0, 0.0, 0.3), axis=(1.0, 0.0, 0.0))
    arm = m.body("arm", 0.8, (0.01, 0.05, 0.05), position=(0.2, 0.0, 0.5))
    tip = m.body("tip", 0.3, (0.01, 0.01, 0.01), position=(0.4, 0.0, 0.5))
    pin = m.revolute("pin", arm, stand[2], at=(0.0, 0.0, 0.5), axis=(0.0, 1.0, 0.0))
    m.fixed("screw", arm, tip, at=(0.3, 0.0, 0.5))
    m.rotation("drive", pin, "2*TIME**2")
    slider = m.body("slider", 0.5, (0.01, 0.01, 0.01), position=(0.0, 0.3, 0.0))
    guide = m.translational("guide", slider, stand[0], at=(0.0, 0.3, 0.0), axis=(0.0, 1.0, 0.0))
    m.translation("push", guide, "0.1*SIN(5*TIME)")
    return m


@pytest.mark.slow
def test_bodies_fixed_to_the_ground_are_ground():
    lump, full = chain_on_ground().simulate(1.0, lump=True, **TIGHT), chain_on_ground().simulate(1.0, **TIGHT)
    model = lumped(chain_on_ground())
    assert model is not None
    assert model.system.body_names == ["arm + tip", "slider"]
    assert lump.problem.n < 0.4 * full.problem.n
    agree(lump, full, 1e-7)
    for k in (0, 20, 50):
        exact_reactions(lump, k)
    # by hand: the foot carries the weight of all less what accelerates
    moving = sum(body.mass * full.com_acceleration(name)[:, 2] for name, body in chain_on_ground().bodies.items())
    weight = 9.81 * sum(body.mass for body in chain_on_ground().bodies.values())
    np.testing.assert_allclose(lump.reaction("foot")[0][:, 2], weight + moving, rtol=1e-9)


def test_a_loop_of_fixed_joints_is_redundant_as_it_is_with_all_bodies():
    def ring() -> Mechanism:
        m = tree()
        m.fixed("closing weld", m.bodies["part 6"], m.bodies["part 4"], at=(0.0, 0.1, 0.0))
        return m

    lump, full = ring().simulate(0.3, lump=True, **TIGHT), ring().simulate(0.3, **TIGHT)
    assert lump.success
    assert "closing weld" in lump.message
    assert lump.message.split("Removed as")[1] == full.message.split("Removed as")[1]
    agree(lump, full, 1e-6)
    with pytest.raises(KeyError, match="removed as redundant"):
        lump.reaction("closing weld")


def test_shared_loads_stay_with_the_joints_that_carry_them():
    """A hinge in front of the weld of the same two bodies takes five of its six rows: the weld cannot vanish."""
    m = Mechanism("double", gravity=(0.0, 0.0, -9.81))
    a = m.body("a", 1.0, (0.1, 0.1, 0.1))
    b = m.body("b", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.revolute("hinge", a, b, at=(0.5, 0.0, 0.0))
    m.fixed("weld", a, b, at=(0.5, 0.0, 0.0))
    m.spherical("ball", a, m.ground, at=(-0.5, 0.0, 0.0))
    assert lumped(m) is None
    lump = m.simulate(0.3, lump=True, **TIGHT)
    assert "lump: no bodies are integrated as one, since the fixed joints share loads" in lump.message
    agree(lump, m.simulate(0.3, **TIGHT), 1e-12)


def test_a_reaction_in_an_expression_keeps_its_joint():
    def gripped() -> Mechanism:
        m = chain_on_ground()
        marker = m.joints["screw"].j.name
        on = m.bodies["slider"].marker(name="on")
        m.load("answer", on, m.ground.marker(name="off"), fx=f"0.1*JOINT(screw, 0, 4, {marker})")
        return m

    one = lumped(gripped())
    assert one is not None
    assert "screw" in one.system.mechanism.joints
    assert one.system.body_names == ["arm", "tip", "slider"]
    agree(gripped().simulate(0.3, lump=True, **TIGHT), gripped().simulate(0.3, **TIGHT), 1e-6)


def test_a_general_constraint_keeps_its_bodies_apart():
    m = chain_on_ground()
    tip = m.bodies["tip"].marker((0.05, 0.0, 0.0), name="nose")
    other = m.body("other", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.general_constraint("leash", f"DX({other.marker(name='o').name}, {tip.name}) - 0.5")
    one = lumped(m)
    assert one is not None
    assert "tip" in one.system.body_names
    lump, full = m.simulate(0.2, lump=True, **TIGHT), m.simulate(0.2, **TIGHT)
    agree(lump, full, 1e-6)


def test_errors_name_the_bodies_of_the_user():
    m = chain_on_ground()
    m.bodies["tip"].inertia[:] = np.nan
    with pytest.raises(Exception, match="body 'tip'"):
        m.simulate(0.1, lump=True)


def test_a_mechanism_at_rest_and_one_without_fixed_joints_run_as_they_are():
    m = Mechanism("rest", gravity=(0.0, 0.0, -9.81))
    block = m.body("block", 2.0, (0.1, 0.1, 0.1))
    m.fixed("weld", block, m.ground)
    lump = m.simulate(0.1, lump=True)
    np.testing.assert_allclose(lump.reaction("weld")[0][:, 2], 19.62, rtol=1e-9)
    bob = m.body("bob", 1.0, (0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0))
    m.spherical("ball", bob, block, at=(0.5, 0.0, 0.0))
    agree(m.simulate(0.3, lump=True, **TIGHT), m.simulate(0.3, **TIGHT), 1e-7)


def test_a_body_that_deforms_keeps_all_apart_and_the_message_says_so():
    def flexible() -> Mechanism:
        m = Mechanism("flexible", gravity=(0.0, 0.0, -9.81))
        mode = Mode(frequency=5.0, mass=0.2, momentum=(0.0, 0.0, 0.3))
        rod = m.modal_body("rod", 1.0, (0.01, 0.1, 0.1), [mode], lambda p: ([[0, 0, p[0] ** 2]], [[0, -2 * p[0], 0]]))
        stand = m.body("stand", 1.0, (0.1, 0.1, 0.1))
        m.fixed("foot", stand, m.ground)
        m.fixed("clamp", rod, stand)
        return m

    assert lumped(flexible()) is None
    lump, full = flexible().simulate(0.2, lump=True, **TIGHT), flexible().simulate(0.2, **TIGHT)
    remark = "lump: no bodies are integrated as one, since the mechanism has bodies that deform: 'rod'."
    assert lump.message == f"{full.message} {remark}"
    agree(lump, full, 1e-12)


def test_without_fixed_joints_the_message_says_so():
    m = Mechanism("free")
    m.body("plate", 1.0, (1.0, 2.0, 3.0))
    assert m.simulate(0.1, lump=True).message.endswith("since there is no fixed joint.")
    assert "lump" not in m.simulate(0.1).message


def test_parts_of_a_lumped_run_are_its_whole():
    found: list[tuple] = []
    options = {"every_step": True, "lump": True, "tol": 1e-6}
    whole = tree().simulate(0.3, **options)
    tree().simulate(0.3, consumer=lambda p: found.append((p.t.copy(), p.reaction("weld 3")[0].copy())), **options)
    t, force = (np.concatenate(part) for part in zip(*found, strict=True))
    np.testing.assert_array_equal(t, whole.t)
    np.testing.assert_allclose(force, whole.reaction("weld 3")[0], rtol=1e-9, atol=1e-9)
