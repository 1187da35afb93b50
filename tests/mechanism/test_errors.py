"""Wrong models get an error that names the part and says what to do."""

import numpy as np
import pytest

from gearmbs.dae.result import Status
from gearmbs.gears import GearPair
from gearmbs.mechanism import AssemblyError, Mechanism, ModelError, SingularModelError, polynomial, ramp, step
from tests.says import says

UNIT = (1.0, 1.0, 1.0)


def pendulum() -> Mechanism:
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", 1.0, (0.1, 0.1, 0.01), position=(0.5, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    return m


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mass": -1.0}, "body 'b': mass = -1.0 kg"),
        ({"mass": "2 N"}, says("body 'b'", "mass", "'2 N'")),
        ({"position": ("100 mm", 0, "3 kg")}, "body 'b': position: '3 kg'"),
        ({"inertia": ("a", 1, 1)}, "body 'b': inertia"),
        ({"mass": float("nan")}, "body 'b': mass: got NaN"),
        ({"inertia": (1, -1, 1)}, "body 'b': inertia"),
        ({"inertia": (1, 2)}, "give 3 moments"),
        ({"inertia": [[1, 2, 0], [0, 1, 0], [0, 0, 1]]}, "not symmetric"),
        ({"position": (0, 0)}, "body 'b': position"),
        ({"position": (0, np.inf, 0)}, says("three finite numbers")),
        ({"orientation": 2 * np.eye(3)}, "not a rotation"),
        ({"velocity": "fast"}, "body 'b': velocity"),
    ],
)
def test_bad_body(options, words):
    values = {"mass": 1.0, "inertia": UNIT, **options}
    with pytest.raises(ModelError, match=words):
        Mechanism().body("b", **values)


def test_names_are_unique_and_belong():
    m = pendulum()
    with pytest.raises(ModelError, match=says("body 'rod'", "name")):
        m.body("rod", 1.0, UNIT)
    with pytest.raises(ModelError, match=says("'pin'", "joint", "choose another")):
        m.revolute("pin", m.bodies["rod"], m.ground)
    stranger = Mechanism().body("other", 1.0, UNIT)
    with pytest.raises(ModelError, match="'other' does not belong"):
        m.fixed("weld", stranger, m.ground)


def test_names_of_bodies_in_the_place_of_bodies():
    m = pendulum()
    for call in (lambda: m.torque("t", "rod", 1.0), lambda: m.revolute("r", "rod", m.ground)):
        with pytest.raises(ModelError, match=says("'rod'", "body or a marker", "bodies['rod']")):
            call()
    m.torque("t", m.bodies["rod"], 1.0)


def test_bad_joints():
    m = pendulum()
    rod = m.bodies["rod"]
    with pytest.raises(ModelError, match=says("'rubber'", "choose")):
        m.joint("rubber", "x", rod, m.ground)
    with pytest.raises(ModelError, match=says("'rod'", "both markers")):
        m.fixed("weld", rod, rod)
    with pytest.raises(ModelError, match="the zero vector"):
        m.revolute("x", rod, m.ground, axis=(0, 0, 0))
    with pytest.raises(ModelError, match=says("'push'", "'pin'", "translational or cylindrical")):
        m.translation("push", m.joints["pin"], 1.0)
    with pytest.raises(ModelError, match=says("joint 'stick'", "length", "-1.0", "positive")):
        m.distance("stick", rod.marker(), m.ground.marker(), length=-1)
    with pytest.raises(ModelError, match=says("step", "later", "start")):
        step(1.0, 0.0, 1.0, 1.0)
    with pytest.raises(ModelError, match="cannot be negative"):
        ramp(1.0, over=-1.0)


def test_empty_mechanism():
    with pytest.raises(ModelError, match=says("'nothing'", "bodies")):
        Mechanism("nothing").compile()


def test_bad_expression_names_element_and_place():
    m = pendulum()
    tip = m.bodies["rod"].marker((0.5, 0, 0), name="tip")
    m.line_force("spring", tip, m.ground.marker((0, 0, 2), name="hook"), "-10*(DM(tip, hok) - 1)")
    with pytest.raises(ModelError, match=r"sforce 'spring'.*(?i:hok)"):
        m.compile()


def test_general_constraint_of_velocities_is_refused():
    m = pendulum()
    m.bodies["rod"].marker(name="tip")
    m.general_constraint("odd", "VX(tip) - 1")
    with pytest.raises(ModelError, match="positions and TIME only"):
        m.compile()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"t_end": -1.0}, "t_end = -1.0"),
        ({"t_end": float("nan")}, "t_end: got NaN"),
        ({"t_end": 1.0, "integrator": "EULER"}, "integrator: 'EULER' is unknown"),
        ({"t_end": 1.0, "formulation": "SI9"}, "formulation: 'SI9' is unknown"),
        ({"t_end": 1.0, "tol": -1.0}, "tol = -1.0"),
        ({"t_end": 1.0, "rate": 0.0}, "rate = 0.0"),
    ],
)
def test_bad_simulation_options(options, words):
    with pytest.raises(ModelError, match=words):
        pendulum().simulate(**options)


def test_redundant_constraints_are_named_and_set_aside():
    """A planar four-bar in space with four revolutes: Kutzbach counts 24 - 4 x 5 - ... = -2, three rows too many."""
    m = Mechanism("four-bar", gravity=(0, -9.81, 0))
    points = [(0, 0, 0), (0, 1, 0), (2, 1, 0), (2, 0, 0)]
    bars = []
    for k in range(3):
        a, b = np.array(points[k]), np.array(points[k + 1])
        bars.append(m.body(f"bar{k + 1}", 1.0, (0.1, 0.1, 0.1), position=(a + b) / 2))
    chain = [m.ground, *bars, m.ground]
    for k, point in enumerate(points):
        m.revolute(f"pin{k + 1}", chain[k + 1], chain[k], at=point, axis=(0, 0, 1))
    system = m.compile()
    report = system.initialise()
    # 18 coordinates, 20 rows, of which three repeat that the mechanism is planar
    assert report.degrees_of_freedom == 1
    assert len(report.redundant) == 3
    assert all(name.startswith("pin4") for name in report.redundant)
    assert "pin4" in str(report)
    solution = m.simulate(0.5, integrator="IDA", tol=1e-8)
    assert solution.success
    assert solution.constraint_violation.max() < 1e-9


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
def test_locking_is_named(integrator):
    """A crank of 1 m on a rod of 0.8 m cannot turn past asin 0.8 = 0.927 rad."""
    m = Mechanism("slider crank", gravity=(0, -9.81, 0))
    crank = m.body("crank", 1.0, UNIT, position=(0.5, 0, 0))
    rod, slider = m.body("rod", 1.0, UNIT, position=(1.4, 0, 0)), m.body("slider", 1.0, UNIT, position=(1.8, 0, 0))
    main = m.revolute("main", crank, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.revolute("big end", rod, crank, at=(1, 0, 0), axis=(0, 0, 1))
    m.revolute("small end", slider, rod, at=(1.8, 0, 0), axis=(0, 0, 1))
    m.translational("bore", slider, m.ground, at=(1.8, 0, 0), axis=(1, 0, 0))
    m.rotation("drive", main, "TIME")
    solution = m.simulate(2.0, integrator=integrator)
    assert not solution.success
    assert solution.t[-1] == pytest.approx(np.arcsin(0.8), abs=5e-3)
    assert "near a position where it locks" in solution.message
    assert "bore" in solution.message or "end" in solution.message
    assert "drive" in solution.message or "motions" in solution.message


def test_planar_linkages_are_no_conflict():
    """Rows across the plane have rates of rounding only; they do not contradict the motion."""
    m = Mechanism("four-bar", gravity=(0, -9.81, 0))
    points = [(0, 0, 0), (0, 1, 0), (2, 1, 0), (2, 0, 0)]
    bars = [m.body(f"bar{k}", 1.0, UNIT, position=(np.array(points[k]) + points[k + 1]) / 2) for k in range(3)]
    for k, (i, j) in enumerate(zip([*bars, m.ground], [m.ground, *bars])):
        m.revolute(f"pin{k}", i, j, at=points[k], axis=(0, 0, 1))
    m.rotation("drive", m.joints["pin0"], "2*TIME")
    assert m.simulate(3.0, tol=1e-8).success


@pytest.mark.parametrize(("omega", "rate", "tol"), [(8.0, 400, 1e-6), (30.0, 170, 1e-4), (3.0, 1500, 1e-8)])
def test_errors_of_the_integrator_are_no_conflict(omega, rate, tol):
    """A crank-rocker of four parallel hinges: the redundant rows are off by the tolerance, not by a contradiction."""
    a, b, c, d, start = 0.1, 0.3, 0.25, 0.3, np.pi / 3
    p = a * np.array([np.cos(start), np.sin(start), 0.0])
    far = np.array([d, 0.0, 0.0])
    # the elbow of the coupler b and the rocker c
    q = np.linalg.norm(far - p)
    turn = np.arctan2(-p[1], d - p[0]) + np.arccos((q * q + b * b - c * c) / (2 * q * b))
    elbow = p + b * np.array([np.cos(turn), np.sin(turn), 0.0])
    m = Mechanism("crank-rocker", gravity=(0, -9.81, 0))

    def bar(name, first, last):
        x = (last - first) / np.linalg.norm(last - first)
        axes = np.column_stack([x, np.cross([0, 0, 1], x), [0, 0, 1]])
        return m.body(name, 1.0, (1e-5, 1e-2, 1e-2), position=(first + last) / 2, orientation=axes)

    crank, coupler, rocker = bar("crank", 0 * p, p), bar("coupler", p, elbow), bar("rocker", far, elbow)
    where = {"axis": (0, 0, 1)}
    main = m.revolute("A", crank, m.ground, at=(0, 0, 0), **where)
    m.revolute("B", coupler, crank, at=p, **where)
    m.revolute("C", rocker, coupler, at=elbow, **where)
    m.revolute("D", rocker, m.ground, at=far, **where)
    m.rotation("motor", main, f"{omega}*TIME", level="displacement")
    solution = m.simulate(1.5, rate=rate, tol=tol)
    assert solution.success, solution.message
    assert "Removed as redundant" in solution.message


def test_conflicting_constraints():
    m = Mechanism("conflict")
    body = m.body("b", 1.0, UNIT)
    m.fixed("weld", body, m.ground)
    m.distance("stick", body.marker((0, 0, 0)), m.ground.marker((1, 0, 0)), length=2.0)
    with pytest.raises(AssemblyError, match="stick"):
        m.compile().initialise()


def test_moments_no_body_can_have():
    with pytest.warns(UserWarning, match=says("exceeds the sum")):
        Mechanism("m").body("b", 1.0, (1.0, 1.0, 5.0))


@pytest.mark.parametrize(
    ("first", "second", "words"), [(1.0, 2.0, says("again: angle", "remove", "correct")), (1.0, 1.0, None)]
)
def test_two_motions_on_one_hinge(first, second, words):
    """The second motion repeats the first or contradicts it from the start."""
    m = Mechanism("two motors")
    wheel = m.body("wheel", 1.0, UNIT)
    hinge = m.revolute("hinge", wheel, m.ground)
    m.rotation("motor", hinge, polynomial([0.0, first]))
    m.rotation("again", hinge, polynomial([0.0, second]))
    if words:
        with pytest.raises(AssemblyError, match=words):
            m.simulate(1.0)
        return
    solution = m.simulate(1.0)
    assert solution.success
    assert "Removed as redundant: again" in solution.message
    with pytest.raises(KeyError, match="removed as redundant"):
        solution.reaction("again")


def test_motions_that_part_later_are_a_conflict():
    """Both start from rest with no acceleration; the second turns further. What was computed is kept."""
    m = Mechanism("two motors")
    wheel = m.body("wheel", 1.0, UNIT)
    hinge = m.revolute("hinge", wheel, m.ground)
    m.rotation("motor", hinge, polynomial([0.0, 0.0, 0.0, 1.0]))
    m.rotation("again", hinge, polynomial([0.0, 0.0, 0.0, 1.5]))
    solution = m.simulate(1.0)
    assert not solution.success
    assert solution.status is Status.CONFLICTING_CONSTRAINTS
    assert "again" in solution.message
    assert "violated at a rate" in solution.message
    assert solution.t[-1] == 1.0


def test_impossible_assembly():
    m = Mechanism("too short")
    body = m.body("b", 1.0, UNIT, position=(1, 0, 0))
    m.spherical("ball", body, m.ground, at=(0, 0, 0))
    m.distance("stick", body.marker((0, 0, 0)), m.ground.marker((10, 3, 0)), length=1.0)
    with pytest.raises(AssemblyError, match="cannot be assembled"):
        m.compile().initialise()


def test_massless_free_body():
    m = Mechanism("massless")
    m.body("ghost", 0.0, (0, 0, 0))
    with pytest.raises(SingularModelError, match=says("body 'ghost'")):
        m.compile().problem()


@pytest.mark.parametrize("dense_up_to", [600, 6])
def test_a_light_body_beside_a_heavy_one_is_not_massless(monkeypatch, dense_up_to):
    monkeypatch.setattr("gearmbs.dae.model.diagnosis.DENSE_COORDINATES", dense_up_to)
    for ghost in (False, True):
        m = Mechanism("scales")
        m.body("press", 2e4, (3e4,) * 3)
        m.body("grain", 2e-7, (2e-14,) * 3)
        held = m.body("massless", 0.0, (0, 0, 0))
        m.fixed("weld", held, m.ground, at=(0, 0, 0))
        if not ghost:
            assert m.compile().problem().n > 0
            continue
        m.body("ghost", 0.0, (0, 0, 0))
        with pytest.raises(SingularModelError, match=says("body 'ghost'")):
            m.compile().problem()


@pytest.mark.parametrize("dense_up_to", [600, 6])
def test_massless_free_body_at_the_end_of_a_chain(monkeypatch, dense_up_to):
    """The last of 20 slender rods hangs on a ball: nothing resists its turning about itself. A pin holds it."""
    monkeypatch.setattr("gearmbs.dae.model.diagnosis.DENSE_COORDINATES", dense_up_to)
    for ball in (False, True):
        m = Mechanism("rods", gravity=(0, -9.81, 0))
        last = m.ground
        for k in range(20):
            rod = m.body(f"rod {k}", 1.0, (0, 1 / 12, 1 / 12), position=(k + 0.5, 0, 0))
            if ball and k == 19:
                m.spherical(f"ball {k}", rod, last, at=(k, 0, 0))
            else:
                m.revolute(f"pin {k}", rod, last, at=(k, 0, 0), axis=(0, 0, 1))
            last = rod
        system = m.compile()
        if not ball:
            assert system.problem().n > 20 * 12
            continue
        with pytest.raises(SingularModelError, match=says("body 'rod 19'")):
            system.problem()


def test_massless_held_body_is_fine():
    m = Mechanism("carried", gravity=(0, 0, -9.81))
    weight = m.body("weight", 2.0, UNIT)
    ghost = m.body("ghost", 0.0, (0, 0, 0))
    m.fixed("weld", ghost, weight)
    solution = m.simulate(1.0, integrator="IDA", tol=1e-8)
    # free fall: z = -g t^2 / 2
    assert solution.com_position("ghost")[-1, 2] == pytest.approx(-4.905, abs=1e-6)


def test_repr_lists_the_parts():
    text = repr(pendulum())
    assert "6 coordinates, 5 constraint rows" in text
    assert "'rod'" in text
    assert "revolute" in text


def test_unknown_names_in_results():
    solution = pendulum().simulate(0.1, integrator="IDA")
    with pytest.raises(KeyError, match=says("'arm'", "bodies are rod")):
        solution.com_position("arm")
    with pytest.raises(KeyError, match=says("'hinge'", "joints are pin")):
        solution.reaction("hinge")


def test_table_of_unknowns():
    table = pendulum().compile().unknowns_table()
    assert "theta_psi(rod)" in table
    assert "lambda(pin: coincident x)" in table
    assert "(5), (7)" in table


def test_wheels_in_each_other_or_out_of_reach():
    pair = GearPair.paper()
    m = Mechanism("wheels")
    one = m.body("one", 1.0, UNIT)
    same = m.body("same", 1.0, UNIT)
    far = m.body("far", 1.0, UNIT, position=(0.2, 0.0, 0.0))
    with pytest.raises(ModelError, match=says("gear contact 'mesh'", "0 mm")):
        m.gear_contact("mesh", one, same, pair)
    with pytest.warns(UserWarning, match=says("'far mesh'", "teeth cannot touch")):
        m.gear_contact("far mesh", one, far, pair)


@pytest.mark.parametrize("kind", ["universal", "perpendicular"])
def test_axes_that_should_cross(kind):
    m = Mechanism("cross")
    one, two = m.body("one", 1.0, UNIT), m.body("two", 1.0, UNIT)
    with pytest.raises(ModelError, match=says(f"{kind} joint 'j'", "axis_j")):
        m.joint(kind, "j", one, two, at=(0, 0, 0), axis=(0, 0, 1))
    with pytest.raises(ModelError, match=says("10", "right angles")):
        m.joint(kind, "j", one, two, axis=(0, 0, 1), axis_j=(0, np.sin(np.pi / 18), np.cos(np.pi / 18)))
    with pytest.raises(ModelError, match=says("'k'", "'l'", "0", "right angles")):
        m.joint(kind, "j", one.marker(name="k"), two.marker(name="l"))
    joint = m.joint(kind, "j", one, two, at=(0, 0, 0), axis=(0, 0, 1), axis_j=(1, 0, 0))
    assert joint.j.global_orientation()[:, 2] == pytest.approx([1, 0, 0])
    assert m.compile().initialise().largest_correction == 0.0
    with pytest.raises(ModelError, match=says("axis_j", "universal", "perpendicular")):
        m.revolute("r", one, m.ground, axis_j=(1, 0, 0))


def test_a_body_takes_the_axis_of_the_marker_it_is_joined_to():
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", 1.0, UNIT, position=(0.5, 0, 0))
    end = rod.marker((-0.5, 0, 0), axis=(0, 1, 0), name="end")
    joint = m.revolute("pin", end, m.ground)
    assert joint.j.global_orientation()[:, 2] == pytest.approx([0, 1, 0])
    solution = m.simulate(0.5)
    # it swings about y, and nothing had to be moved to assemble it
    assert solution.com_position("rod")[-1, 2] < -0.2
    assert "assembly" not in solution.message
    with pytest.raises(ModelError, match=says("'again'", "markers or bodies")):
        m.revolute("again", end, m.ground, axis=(0, 1, 0))


@pytest.mark.parametrize(
    ("expression", "words"),
    [("1/TIME", says("t = 0 s", "value")), ("SQRT(-1-TIME)", "SQRT"), ("LOG(-TIME)", "sforce 's'")],
)
def test_forces_that_are_not_finite_are_named(expression, words):
    m = Mechanism("free")
    body = m.body("b", 1.0, UNIT)
    m.line_force("fine", body.marker(name="tip"), m.ground.marker((2, 0, 0), name="a"), "3")
    m.line_force("s", body.marker(name="top"), m.ground.marker((2, 0, 1), name="b"), expression)
    with pytest.raises(ModelError, match=words):
        m.simulate(0.1)
    with pytest.raises(ModelError, match="'s'"):
        m.compile().problem()


@pytest.mark.parametrize("text", ["SQRT(-1-TIME)", "SQRT(TIME)"])
def test_motions_that_are_not_finite_are_named(text):
    """The first has no value at the start, the second no rate."""
    m = pendulum()
    m.rotation("swing", m.joints["pin"], text)
    with pytest.raises(ModelError, match="swing: angle: "):
        m.simulate(0.1)


def test_corrections_of_the_assembly_are_told():
    m = pendulum()
    m.rotation("swing", m.joints["pin"], "PI/6 + TIME")
    solution = m.simulate(0.1)
    assert "turned body 'rod' by 30 degrees before the start" in solution.message
    assert "turned body 'rod' by 30 degrees" in str(solution.system.report)
    # on a circle of 0.5 m: 2 sin(15 degrees) 0.5 m
    assert solution.system.report.moved == ("rod", pytest.approx(2 * 0.5 * np.sin(np.pi / 12)))


def test_slips_get_an_answer():
    m = pendulum()
    with pytest.raises(ModelError, match=says("'r'", "give a number")):
        m.rotation("r", m.joints["pin"], lambda t: t)
    with pytest.raises(ModelError, match=says("'steps'", "t_eval", "every_step")):
        m.simulate(1.0, steps=100)
    with pytest.raises(ModelError, match=says("'toll'", "tol")):
        m.simulate(1.0, toll=1e-6)
    with pytest.raises(KeyError, match=says("'nope'", "elements are none")):
        m.simulate(0.1).load("nope")
    m.friction("dry", m.joints["pin"], 0.3, 0.2, pin_radius=0.01)
    with pytest.raises(ModelError, match=says("load", "friction", "name 'dry'")):
        m.friction("dry", m.joints["pin"], 0.3, 0.2, pin_radius=0.01)


@pytest.mark.parametrize(("t_end", "rate", "count"), [(1.0, 0.1, 2), (0.5, 3, 3), (1.0, 333.3, 335), (0.1, 1000, 101)])
def test_runs_end_at_their_end_whatever_the_rate(t_end, rate, count):
    solution = pendulum().simulate(t_end, rate=rate)
    assert solution.t[-1] == t_end
    assert len(solution) == count
    assert np.diff(solution.t).min() > 0.0


@pytest.mark.parametrize(
    ("line", "ok"),
    [
        ("JOINT/1, UNIVERSAL, I=20, J=10", False),
        ("JOINT/1, UNIVERSAL, I=20, J=11", True),
        # the arms of a Hooke joint are x of I and y of J
        ("JOINT/1, HOOKE, I=20, J=10", True),
        ("JOINT/1, HOOKE, I=21, J=10", False),
        ("JPRIM/1, PERPENDICULAR, I=20, J=10", False),
    ],
)
def test_axes_that_should_cross_in_decks(line, ok):
    from gearmbs.adams import DeckError, parse_deck

    deck = "x\nPART/1,GROUND\nMARKER/10,PART=1\nMARKER/11,PART=1,REULER=0,90D,0\nPART/2,MASS=2,CM=20,IP=1,1,1\n"
    deck += f"MARKER/20,PART=2\nMARKER/21,PART=2,REULER=90D,0,0\n{line}\nEND\n"
    if ok:
        assert len(parse_deck(deck).to_mechanism().joints) == 1
        return
    with pytest.raises(DeckError, match=says("8", "0", "right angles")):
        parse_deck(deck).to_mechanism()
