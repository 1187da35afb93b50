"""Distributed loads on modal bodies: closed form, loads at nodes, momentum, and what is refused."""

import numpy as np
import pytest

from gearmbs.flexible import Shaft, ShaftSection
from gearmbs.mechanism import Mechanism, ModelError, add_modal_force
from gearmbs.mechanism.load_methods import frame_marker
from tests.says import says


@pytest.fixture(scope="module")
def bar():
    return Shaft([ShaftSection(0.4, 0.01)], seats={"A": 0.0, "B": 0.4}).modal_model().slowest(4)


def test_a_constant_force_on_the_modes_of_a_free_body(bar):
    """q = Q / (m w^2) (1 - cos w t), and the frame stays where it is."""
    m = Mechanism("free")
    body = bar.add_to(m, "bar", damping=0.0)
    load = np.r_[np.zeros(6), 10.0, -20.0, 30.0, 5.0]
    add_modal_force(m, "f", body, load)
    t = np.linspace(0, 0.01, 51)
    tolerance = 1e-10  # of coordinates that reach 1.2e-5, errors are absolute
    solution = m.simulate(0.01, t_eval=t, tol=tolerance)
    w = 2 * np.pi * bar.frequencies
    expected = load[6:] / (np.diag(bar.integrals.mass) * w**2) * (1 - np.cos(np.outer(t, w)))
    found = solution.modal_coordinates("bar")
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance)


@pytest.mark.parametrize("formulation", ["I3", "SI2", "SI1"])
def test_a_force_that_depends_on_a_modal_coordinate_is_a_spring_and_a_damper_of_the_mode(bar, formulation):
    m = Mechanism("fed back")
    body = bar.add_to(m, "bar", damping=0.0, start=[1e-3, 0, 0, 0])
    w = float(2 * np.pi * bar.frequencies[0])
    stiffer, damping = 0.5 * w**2, 0.02 * w
    feedback = f"-{stiffer!r}*{body.mode(1)} - {damping!r}*{body.mode(1, rate=True)}"
    add_modal_force(m, "f", body, np.eye(10)[6], feedback)
    solution = m.simulate(0.01, t_eval=np.linspace(0, 0.01, 101), tol=1e-10, formulation=formulation)
    t, z = solution.t, 0.5 * damping
    ringing = np.sqrt(1.5 * w**2 - z**2)
    expected = 1e-3 * np.exp(-z * t) * (np.cos(ringing * t) + z / ringing * np.sin(ringing * t))
    np.testing.assert_allclose(solution.modal_coordinates("bar")[:, 0], expected, rtol=0.0, atol=1e-8)
    np.testing.assert_array_equal(solution.evaluate(body.mode(1)), solution.modal_coordinates("bar")[:, 0])
    np.testing.assert_array_equal(solution.evaluate("MODAL1(bar,3)"), solution.modal_velocities("bar")[:, 2])
    # eigenvalues of the linearised equations have the feedback, too
    if formulation == "SI2":
        found = m.linear_modes().eigenvalues
        assert np.abs(found - (-z + 1j * ringing)).min() < 1e-6 * w


def test_modal_coordinates_that_do_not_exist_are_named(bar):
    m = Mechanism("wrong")
    body = bar.add_to(m, "bar")
    m.body("rigid", 1.0, (1.0, 1.0, 1.0))
    with pytest.raises(ModelError, match=says("body 'bar'", "mode 5", "1", "4")):
        body.mode(5)
    for text, message in (
        ("MODAL(bar,9)", says("mforce 'f'", "MODAL", "1 to 4")),
        ("MODAL(rigid,1)", says("body RIGID", "BAR")),
    ):
        m.elements.pop("f", None)
        add_modal_force(m, "f", body, np.eye(10)[6], text)
        with pytest.raises(ModelError, match=message):
            m.simulate(0.01, rate=100)


def swung(bar, force, at_node):
    m = Mechanism("clamped")
    body = bar.add_to(m, "bar", damping=0.05)
    m.fixed("clamp", body.marker(bar.place("A")), m.ground.marker())
    f, t = np.array([force, 0.0, 0.3 * force]), np.array([0.0, 0.02 * force, 0.0])
    if at_node:
        tip = body.marker(bar.place("B"))
        parts = {c: f"{v!r}*SIN(300*TIME)" for c, v in zip(("fx", "fy", "fz", "tx", "ty", "tz"), map(float, [*f, *t]))}
        m.load("f", tip, m.ground.marker(), rm=frame_marker(body), **parts)
    else:
        add_modal_force(m, "f", body, bar.modal_load({"B": (f, t)}), "SIN(300*TIME)")
    return m.simulate(0.03, t_eval=np.linspace(0, 0.03, 61), tol=1e-9).modal_coordinates("bar")


def test_it_is_a_force_at_a_node_but_for_the_bend_of_its_arm(bar):
    """The arm of a force at a node bends with the body, by an amount that grows with the force."""
    errors = []
    for force in (10.0, 1.0):
        at_node, spread = swung(bar, force, True), swung(bar, force, False)
        errors.append(np.abs(at_node - spread).max() / np.abs(at_node).max())
    assert errors[1] < 2e-5
    assert 7.0 < errors[0] / errors[1] < 13.0


def test_force_and_reaction_keep_the_momentum(bar):
    m = Mechanism("two")
    body = bar.add_to(m, "bar", damping=0.02)
    other = m.body("other", 2.0, (0.01, 0.01, 0.01), position=(0.1, 0.0, 0.0))
    load = bar.modal_load({"A": ((1.0, 2.0, 0.5), (0, 0, 0)), "B": ((3.0, -1.0, 0.5), (0.01, 0, 0))})
    add_modal_force(m, "f", body, load, "SIN(200*TIME)", reaction=other.marker())
    solution = m.simulate(0.05, rate=1000, tol=1e-8)
    gained, lost = 2.0 * solution.com_velocity("other"), bar.properties.mass * solution.com_velocity("bar")
    assert np.abs(gained).max() > 0.01
    np.testing.assert_allclose(gained + lost, 0, atol=1e-6 * np.abs(gained).max())


def test_what_is_no_load_is_refused(bar):
    m = Mechanism("m")
    body = bar.add_to(m, "bar")
    with pytest.raises(ModelError, match=says("4", "force", "10")):
        add_modal_force(m, "f", body, np.ones(4))
    with pytest.raises(ModelError, match=says("'rigid'", "apply a load")):
        add_modal_force(m, "f", m.body("rigid", 1.0, (1, 1, 1)), np.ones(10))
