"""Constraints written as formulas: the same as the package's joints, derivatives by jets of the formulas, messages."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.adams import parse_deck, write_deck
from gearmbs.dae.model.model import Configuration
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism, choose, expression, forward_sensitivities, linear_modes, static_equilibrium
from gearmbs.mechanism.language.syntax import Units
from tests.jets import Jet
from tests.says import says


def hinge(i, j):
    turned = i.orientation(j)
    x, y, z = i.position(j)
    return {"x": x, "y": y, "z": z, "x of I": turned[0, 2], "y of I": turned[1, 2]}


def in_global_components(i, j):
    """The hinge again, by origins and axes."""
    return [*(i.origin - j.origin), i.axes[:, 2] @ j.axes[:, 0], i.axes[:, 2] @ j.axes[:, 1]]


def rod(i, j, length):
    return i.distance(j) - length


def rod_by_components(i, j, length):
    apart = i.origin - j.origin
    return np.sqrt(apart @ apart) - length


def screw(i, j, pitch):
    x, y, z = i.position(j)
    turned = i.orientation(j)
    return [x, y, turned[0, 2], turned[1, 2], z - pitch / (2.0 * np.pi) * i.angle(j)]


def geared(i, j, k, ratio):
    return i.angle(j) + ratio * k.angle(j)


def cam(i, j, k, lift, base=0.2):
    """K stands off j's axis by the radius of a cam that turns with I."""
    return k.position(j)[1] - base - lift * np.cos(2.0 * i.angle(j))


def led(i, j, t, speed):
    return i.angle(j) - np.maximum(speed * (t - 0.05), 0.0) ** 3


class Stands:
    """Where a marker stands, by numbers or jets of its frame."""

    def __init__(self, origin, axes):
        self.origin, self.axes = np.array(origin), np.array(axes)

    def position(self, of):
        return (self.origin - of.origin) @ of.axes

    def orientation(self, of):
        return of.axes.T @ self.axes

    def distance(self, of):
        apart = self.origin - of.origin
        return np.sqrt(apart @ apart)

    def angle(self, of):
        x = self.axes[:, 0]
        return np.arctan2(x @ of.axes[:, 1], x @ of.axes[:, 0])


def two_bodies(gravity=(0.3, -0.2, -9.81)):
    m = Mechanism("two", gravity=gravity)
    one = m.body("one", 2.0, (0.03, 0.05, 0.04), position=(0.2, 0.1, 0.0), angular_velocity=(0.2, 0.1, 0.7))
    two = m.body("two", 1.0, (0.02, 0.03, 0.01), position=(-0.3, 0.2, 0.1), velocity=(0.1, 0.0, 0.2))
    return m, one, two


def moving(m, seed):
    """Return a system at random places and velocities, that need not fit together, and these."""
    system = m.compile()
    rng = np.random.default_rng(seed)
    pose = system.pose.copy()
    pose[:, :3] += 0.1 * rng.normal(size=(len(pose), 3))
    for row in pose:
        row[3:12] = (Rotation.from_rotvec(0.3 * rng.normal(size=3)).as_matrix() @ row[3:12].reshape(3, 3)).ravel()
    pose[:, 12:] = rng.normal(size=(len(pose), 6))
    return system, Configuration(pose)


def rows_of(system, place):
    """Return Phi, its rate, the second rate without accelerations, and the gradient."""
    found = system.assembler.at(place, 0.3, None, system.state_start)
    gradient = system.assembler.constraints(place, 0.3, system.state_start)[0].toarray()
    return found.phi[0::3], found.phi[1::3], -found.rhs[place.coordinates :], gradient


TWO_MARKERS = {
    "hinge": (in_global_components, {}, lambda m, i, j: m.revolute("joint", i, j)),
    "rod": (rod, {"length": 0.6}, lambda m, i, j: m.distance("joint", i, j, 0.6)),
    "rod by components": (rod_by_components, {"length": 0.6}, lambda m, i, j: m.distance("joint", i, j, 0.6)),
    "screw": (screw, {"pitch": 0.3}, lambda m, i, j: m.screw("joint", i, j, pitch=0.3)),
}


@pytest.mark.parametrize("kind", TWO_MARKERS)
def test_rows_are_those_of_joints(kind):
    """Values, rates, right-hand sides and gradients at a place that they do not hold at."""
    law, numbers, joint = TWO_MARKERS[kind]
    found = []
    for built in (True, False):
        m, one, two = two_bodies()
        i, j = one.marker((0.1, 0.0, 0.2), name="I"), two.marker((0.0, 0.3, 0.1), name="J")
        if built:
            joint(m, i, j)
        else:
            m.general_constraint("joint", law, i, j, parameters=numbers)
        found.append(rows_of(*moving(m, 2)))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("law", [hinge, in_global_components, rod, rod_by_components, screw, geared, cam, led])
def test_rates_are_those_of_jets(law):
    """Phi, dPhi/dt and d2Phi/dt2 along R + v t, exp(w t) A: jets of the formula as it is written, to 1e-10."""
    m, one, two = two_bodies()
    i, j = one.marker((0.1, 0.0, 0.2), name="I"), two.marker((0.0, 0.3, 0.1), name="J")
    markers = [i, j, m.ground.marker((0.4, 0.1, 0.0), name="K")][: 3 if "k" in law.__code__.co_varnames else 2]
    every = {"length": 0.6, "pitch": 0.3, "ratio": -2.5, "lift": 0.03, "speed": 2.0}
    names = law.__code__.co_varnames[len(markers) : law.__code__.co_argcount]
    numbers = {name: every[name] for name in names if name in every}
    m.general_constraint("joint", law, *markers, parameters=numbers)
    system, place = moving(m, 3)
    phi, rate, second, _ = rows_of(system, place)
    rows = {"one": place.pose[0], "two": place.pose[1], "ground": np.array([0, 0, 0, *np.eye(3).ravel(), *[0] * 6])}

    def jet(value, first, curved):
        return Jet(value, np.array([first]), np.array([[curved]]))

    def stands(marker):
        row = rows[marker.body.name]
        spin = np.array([[0, -row[17], row[16]], [row[17], 0, -row[15]], [-row[16], row[15], 0]])
        axes = row[3:12].reshape(3, 3)
        arm, frame = axes @ (marker.position - marker.body.com), axes @ marker.orientation
        origin = zip(row[:3] + arm, row[12:15] + spin @ arm, spin @ spin @ arm)
        turned = zip(frame.ravel(), (spin @ frame).ravel(), (spin @ spin @ frame).ravel())
        return Stands([jet(*x) for x in origin], np.array([jet(*x) for x in turned]).reshape(3, 3))

    given = {**numbers, "t": jet(0.3, 1.0, 0.0)}
    if law is led:
        # where it is led already
        told = stands(i).angle(stands(j)) - (2.0 * (given["t"] - 0.05)) ** 3
    else:
        told = law(*map(stands, markers), **{name: given[name] for name in names if name in given})
    told = list(told.values()) if isinstance(told, dict) else np.ravel(np.array(told, dtype=object))
    for found, exact in ((phi, [x.value for x in told]), (rate, [x.gradient[0] for x in told])):
        np.testing.assert_allclose(found, exact, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(second, [x.hessian[0, 0] for x in told], rtol=1e-10, atol=1e-11)


def pendulum(by_law):
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    arm = m.body("arm", 1.0, (0.03, 0.05, 0.04), position=(0.5, 0, 0), angular_velocity=(0, 0.4, 0))
    across = Rotation.from_rotvec([-0.5 * np.pi, 0, 0]).as_matrix()
    i, j = arm.marker((-0.5, 0, 0), across, name="I"), m.ground.marker((0, 0, 0), across, name="J")
    bob = m.body("bob", 0.5, (0.01, 0.01, 0.01), position=(1.0, 0.0, -0.5))
    ball, tip = bob.marker(name="B"), arm.marker((0.5, 0, 0), name="T")
    if by_law:
        m.general_constraint("pin", hinge, i, j)
        m.general_constraint("rod", rod, ball, tip, parameters={"length": 0.5})
    else:
        m.revolute("pin", i, j)
        m.distance("rod", ball, tip, 0.5)
    return m


@pytest.mark.parametrize("formulation", ["SI2", "I3"])
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
def test_runs_and_reactions_are_those_of_joints(integrator, formulation):
    by = {"rate": 100, "tol": 1e-8, "integrator": integrator, "formulation": formulation}
    one, other = (pendulum(law).simulate(0.05, **by) for law in (False, True))
    np.testing.assert_allclose(other.com_position("bob"), one.com_position("bob"), rtol=0, atol=1e-12)
    for name in ("pin", "rod"):
        for found, exact in zip(other.reaction(name), one.reaction(name), strict=True):
            np.testing.assert_allclose(found, exact, rtol=0, atol=1e-12 * np.abs(one.reaction(name)[0]).max())


def test_statics_and_modes_are_those_of_joints():
    one, other = (static_equilibrium(pendulum(law)) for law in (False, True))
    np.testing.assert_allclose(other.com_position("bob"), one.com_position("bob"), atol=1e-9)
    np.testing.assert_allclose(other.reactions["pin"][0], one.reactions["pin"][0], atol=1e-8)
    modes = [linear_modes(pendulum(law), at=rest) for law, rest in ((False, one), (True, other))]
    np.testing.assert_allclose(modes[1].frequencies, modes[0].frequencies, atol=1e-7)


def test_parameters_have_names_and_derivatives():
    """|F| = m v^2 / r of a bead on a hoop."""

    def hoop(i, g, radius):
        return i.position(g) @ i.position(g) - radius**2

    def build(radius):
        m = Mechanism("bead")
        ball = m.body("ball", 2.0, (1e-3, 1e-3, 1e-3), position=(radius, 0.0, 0.0), velocity=(0, 1.0, 0))
        m.general_constraint("hoop", hoop, ball.marker(), m.ground.marker(), parameters={"radius": radius})
        return m

    assert build(0.3).parameters["hoop.radius"].start == 0.3
    by = forward_sensitivities(build, {"radius": 0.3}, 0.02, rate=100, tol=1e-9)
    pull = by.derivative("radius", lambda s: np.linalg.norm(s.reaction("hoop")[0], axis=1))
    np.testing.assert_allclose(pull, -2.0 / 0.3**2, rtol=1e-5)


def test_a_law_is_in_si_whatever_the_units_and_copies_keep_it():
    m, one, two = two_bodies()
    m.units = Units(length=1e-3, time=1e-3)
    law = {"length": m.parameter("long", "m", 0.6)}
    m.general_constraint("joint", rod, one.marker(name="I"), two.marker(name="J"), parameters=law)
    assert "joint.length" not in m.parameters
    si, *bodies = two_bodies()
    si.general_constraint("joint", rod, *(b.marker(name=n) for b, n in zip(bodies, "IJ")), parameters={"length": 0.6})
    for made in (m, copy.deepcopy(m), pickle.loads(pickle.dumps(m))):
        for found, exact in zip(rows_of(*moving(made, 4)), rows_of(*moving(si, 4)), strict=True):
            np.testing.assert_allclose(found, exact, rtol=1e-12, atol=1e-13)


def test_what_is_needed_twice_is_written_once():
    def folded(i, j):
        x = i.position(j) @ i.position(j)
        for _ in range(12):
            x = np.sin(x) + x * np.cos(x)
        return x

    m, one, two = two_bodies()
    m.general_constraint("joint", folded, one.marker(name="I"), two.marker(name="J"))
    assert len(m.constraints["joint"].rows["expression"]) + sum(map(len, m.variables.values())) < 3000
    assert np.isfinite(rows_of(*moving(m, 5))[3]).all()


def test_redundant_rows_are_told_by_their_labels():
    by_law = pendulum(False)
    by_law.general_constraint("again", hinge, by_law.bodies["arm"].markers[0], by_law.ground.markers[0])
    told = by_law.simulate(0.01).system.report.redundant
    assert {"again: x", "again: y of I"} <= set(told)


def tangled(i, j):
    return i.position(j)[0] if i.position(j)[1] > 0.0 else 1.0


BAD = [
    (lambda i, j: i.velocity[0], {}, ("velocity", "positions and time")),
    (lambda i, j: i.place[0], {}, ("no place", "position(j)")),
    (tangled, {}, ("branch", "gm.choose")),
    (lambda i, j: 1.0, {}, ("does not depend", "leave it out")),
    (lambda i, j, t: np.sin(t), {}, ("does not depend", "leave it out")),
    (lambda i, j: [], {}, ("returns nothing",)),
    (lambda i, j: "x", {}, ("text",)),
    (lambda i, j: i.position(i), {}, ("another marker",)),
    (rod, {}, ("'length'", "is missing", "parameters=")),
    (rod, {"length": 1.0, "width": 2.0}, ("no parameter 'width'", "length")),
    (rod, {"length": "30 cm"}, ("'30 cm'", "in SI")),
    (lambda i: i.origin[0], {}, ("2 markers", "(i)")),
    (lambda i, j: i.distance(j) * np.inf, {}, ("inf", "leave it out")),
]


@pytest.mark.parametrize(("law", "numbers", "words"), BAD)
def test_what_cannot_be_a_constraint_is_refused(law, numbers, words):
    m, one, two = two_bodies()
    with pytest.raises(ModelError, match=says("'c'", *words)):
        m.general_constraint("c", law, one.marker(), two.marker(), parameters=numbers)
    assert not m.constraints
    assert not m.parameters


def test_markers_are_told_apart():
    m, one, two = two_bodies()
    i, same = one.marker(name="tip"), two.marker(name="TIP")
    with pytest.raises(ModelError, match=says("'tip'", "a name of its own")):
        m.general_constraint("c", rod, i, same, parameters={"length": 1.0})
    with pytest.raises(ModelError, match=says("two bodies or more")):
        m.general_constraint("c", rod, i, one.marker(), parameters={"length": 1.0})
    with pytest.raises(ModelError, match=says("markers", "an expression")):
        m.general_constraint("c", "DX(tip)", i)


@pytest.mark.parametrize("place", ["g", "G"])
def test_names_are_not_taken_over_by_later_markers(place):
    """Expressions know markers by names, in which capitals do not count: one that two have is no name."""
    m, one, two = two_bodies()
    m.general_constraint("c", rod, one.marker(name="G"), two.marker(name="J"), parameters={"length": 0.6})
    m.ground.marker((0.5, 0.0, 0.0), name=place)
    for use in (m.compile, lambda: write_deck(m)):
        with pytest.raises(ModelError, match=says("several markers", "G")):
            use()


def test_choices_and_powers_of_numbers():
    def law(i, j, t, n=1.5):
        z = i.position(j)[2] + 1.0
        return choose(z, 0.0, z**n - np.abs(z) ** -2.5, np.hypot(z, t)) - np.arcsin(0.1 * z)

    m, one, two = two_bodies()
    m.general_constraint("c", law, one.marker(name="I"), two.marker(name="J"))
    m.joint("inplane", "plane", one.markers[0], two.markers[0])
    system, place = moving(m, 6)
    above, found = rows_of(system, place)[0]
    z = above + 1.0
    assert z > 0.0
    assert found == pytest.approx(z**1.5 - z**-2.5 - np.arcsin(0.1 * z), rel=1e-13)


def test_a_motion_by_a_law_is_that_of_the_package():
    """A flywheel led by an angle of time, as `rotation` does it."""
    found = []
    for by_law in (True, False):
        m = Mechanism("wheel")
        wheel = m.body("wheel", 1.0, (0.1, 0.1, 0.2))
        axle = m.revolute("axle", wheel, m.ground)
        if by_law:
            m.general_constraint("drive", lambda i, j, t: i.angle(j) - 1.5 * t**2, axle.i, axle.j)
        else:
            m.rotation("drive", axle, expression("1.5*TIME**2"))
        found.append(m.simulate(0.1, rate=50).reaction("drive")[1])
    np.testing.assert_allclose(found[0], found[1], atol=1e-10)
    np.testing.assert_allclose(found[0][:, 2], 0.6, atol=1e-9)


def test_a_gear_by_a_law_is_a_coupler():
    """Two wheels on pins, 1 to 2.5: torques of both as of the coupler, the law's about the first marker."""
    found = []
    for by_law in (True, False):
        m = Mechanism("gear")
        pins = []
        for name, x in (("one", 0.0), ("two", 0.3)):
            wheel = m.body(name, 1.0, (0.1, 0.1, 0.2), position=(x, 0, 0))
            pins.append(m.revolute(f"pin {name}", wheel, m.ground, at=(x, 0, 0)))
        m.torque("drive", m.bodies["one"], 3.0)
        if by_law:
            a, b = pins
            m.general_constraint("gear", geared, a.i, a.j, b.i, parameters={"ratio": 2.5})
        else:
            m.coupler("gear", [(pins[0], 1.0), (pins[1], 2.5)])
        run = m.simulate(0.1, rate=50, tol=1e-8)
        found.append([run.angular_velocity("two"), *run.reaction("gear"), *run.reaction("pin two")])
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-11)
    # 3 N m turn J = 0.2 (1 + 1 / 2.5^2), of which the law takes what the other wheel needs
    np.testing.assert_allclose(found[0][2][:, 2], -3.0 * 0.16 / 1.16, rtol=1e-9)


def test_decks_take_positions_and_angles():
    def thread(i, j, pitch):
        x, y, z = i.position(j)
        common = np.sin(x * x + y * y + z * z + 1.0)
        return {"advance": common * z - pitch * i.angle(j), "across": common**3 * x}

    m, one, two = two_bodies()
    i, j = one.marker(name="I"), two.marker(name="J")
    m.general_constraint("nut", thread, i, j, parameters={"pitch": 0.05})
    again = parse_deck(write_deck(m)).to_mechanism()
    assert list(again.constraints) == ["nut: advance", "nut: across"]
    for found, exact in zip(rows_of(*moving(again, 7)), rows_of(*moving(m, 7)), strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-8)
    m.general_constraint("pin", hinge, i, j)
    with pytest.raises(ModelError, match=says("no function COSINE")):
        write_deck(m)
