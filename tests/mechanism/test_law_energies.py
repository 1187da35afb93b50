"""Energies of force laws, and numbers that stand inside the function of a force."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism, Wrench, choose, force_law
from gearmbs.mechanism.forces.laws import derive_law
from gearmbs.mechanism.solve.sensitivities import check_functions
from tests.says import says


def frames(number):
    rows = np.zeros((number, 18))
    rows[:, 3:12] = np.eye(3).ravel()
    rows[:, :3] = np.arange(3 * number).reshape(number, 3) ** 2 * 0.1
    return rows


def wrench_of(made, rows, numbers=()):
    wrench, told = np.zeros((1, 6)), np.zeros(2)
    made.values(0.0, rows, np.zeros(0), np.array(numbers, dtype=float), wrench, np.zeros(0), told)
    return wrench[0], told


def test_a_damper_beside_an_energy_leaves_the_force_that_the_energy_asks_for():
    law = force_law(lambda i, k, c: Wrench(energy=0.5 * k * (i.origin @ i.origin), torque=-c * i.angular_velocity))
    rows = frames(1)
    rows[0, :3], rows[0, 15:] = (0.5, 0.0, -1.0), (0.0, 2.0, 0.0)
    wrench, told = wrench_of(derive_law("force 'x'", law, 1, {"k": 100.0, "c": 3.0}, ()), rows, (100.0, 3.0))
    assert wrench == pytest.approx([-50.0, 0.0, 100.0, 0.0, -6.0, 0.0])
    assert told == pytest.approx([62.5, 12.0])


def test_a_force_beside_an_energy_is_the_whole_and_leaves_its_torque():
    law = force_law(lambda i, k: Wrench(energy=k * (1.0 - i.axes[2, 2]), force=[1.0, 2.0, 3.0]))
    rows = frames(1)
    turn = 0.3
    rows[0, 3:12] = [1, 0, 0, 0, np.cos(turn), -np.sin(turn), 0, np.sin(turn), np.cos(turn)]
    wrench, _ = wrench_of(derive_law("force 'x'", law, 1, {"k": 4.0}, ()), rows, (4.0,))
    assert wrench == pytest.approx([1.0, 2.0, 3.0, -4.0 * np.sin(turn), 0.0, 0.0])


def far(i, j):
    """Something in global components that acts beyond 100 m alone."""
    d = i.origin - j.origin
    return choose(d @ d, 1e4, d[2], 0.0)


ONE_SIDED = {
    "turned": lambda i, j: (i.origin - j.origin)[0] ** 2,
    "shifted": lambda i, j: (i.origin + j.origin) @ j.axes[:, 1],
    "turned alike": lambda i, j: i.axes[0, 0],
    "changes": far,
}
OF_BOTH = {
    "axes": lambda i, j: ((i.origin - j.origin) @ j.axes[:, 0]) ** 2 + 3.0 * i.axes[:, 0] @ j.axes[:, 1],
    "distance": lambda i, j: -1.0 / np.linalg.norm(i.origin - j.origin),
    "contact": lambda i, j: np.maximum(0.02 - (i.origin - j.origin) @ j.axes[:, 2], 0.0) ** 2.5,
}


@pytest.mark.parametrize("word", ONE_SIDED)
def test_an_energy_that_is_not_of_both_bodies_is_refused(word):
    law = force_law(lambda i, j: Wrench(energy=ONE_SIDED[word](i, j)))
    with pytest.raises(ModelError, match=says("force 'x'", "energy", word, "axes of j")):
        derive_law("force 'x'", law, 2, {}, (), start=frames(2))


@pytest.mark.parametrize("name", OF_BOTH)
def test_energies_of_how_two_bodies_stand_are_taken(name):
    law = force_law(lambda i, j: Wrench(energy=OF_BOTH[name](i, j)))
    derive_law("force 'x'", law, 2, {}, (), start=frames(2))


@pytest.mark.slow
def test_against_the_ground_any_energy_is_taken():
    law = force_law(lambda i, j, k: Wrench(energy=0.5 * k * (i.origin - j.origin)[0] ** 2))
    m = Mechanism("two")
    one, other = (m.body(name, mass=1.0, inertia=(1, 1, 1), position=(x, 0, 0)) for name, x in (("a", 0.5), ("b", 0)))
    m.force("ground", law, one.marker(), m.ground.marker(), parameters={"k": 4.0})
    with pytest.raises(ModelError, match=says("between", "turned", "ground")):
        m.force("between", law, one.marker(), other.marker(), parameters={"k": 4.0})
    assert m.simulate(1.0, tol=1e-8).com_position("a")[-1, 0] == pytest.approx(0.5 * np.cos(2.0), abs=1e-5)


def test_numbers_from_outside_are_those_of_the_moment():
    table, rows = np.array([1.0, 2.0]), frames(1)
    rows[0, :3] = 1.0, 1.0, 1.0
    law = force_law(lambda i: Wrench(force=-table[1] * i.origin))
    first = derive_law("force 'x'", law, 1, {}, ())
    table[1] = 7.0
    second = derive_law("force 'x'", law, 1, {}, ())
    assert [wrench_of(made, rows)[0][0] for made in (first, second)] == [-2.0, -7.0]
    assert derive_law("force 'y'", law, 1, {}, ()).values is second.values


def with_law(inside, given):
    m = Mechanism("one")
    body = m.body("a", mass=1.0, inertia=(1, 1, 1))
    law = force_law(lambda i, k: Wrench(force=-inside * k * i.origin))
    m.force("pull", law, body.marker(), parameters={"k": given})
    return m


def with_kernel(inside, given):
    def kernel(t, frames, states, parameters, wrench, rates, diagnostics):
        wrench[0, 0] = -inside * parameters[0] * frames[0, 0]

    m = Mechanism("one")
    m.force("pull", kernel, m.body("a", mass=1.0, inertia=(1, 1, 1)).marker(), parameters={"k": given})
    return m


@pytest.mark.slow
@pytest.mark.parametrize("build", [with_law, with_kernel])
def test_sensitivities_refuse_numbers_inside_a_force(build):
    """A part that also depends on the parameter would hide that the derivative lacks the other one."""
    with pytest.raises(ModelError, match=says("stiffness", "pull", "parameters={'stiffness'")):
        check_functions("stiffness", build(2.0, 3.0), build(2.1, 3.0))
    check_functions("stiffness", build(2.0, 3.0), build(2.0, 3.1))
