"""Accelerations, reactions and projection at output times against closed forms."""

import numpy as np
import pytest

from gearmbs.dae.linalg.sparse_lu import factor
from gearmbs.dae.model.evaluator import assemble
from gearmbs.mechanism import Mechanism
from tests.says import says

LENGTH, MASS, G = 0.7, 1.3, 9.81


def pendulum(kind: str) -> Mechanism:
    m = Mechanism("pendulum", gravity=(0.0, -G, 0.0))
    bob = m.body("bob", MASS, (1e-9, 1e-9, 1e-9), position=(LENGTH, 0.0, 0.0))
    if kind == "revolute":
        m.revolute("pin", bob.marker((-LENGTH, 0.0, 0.0)), m.ground.marker((0.0, 0.0, 0.0)))
    else:
        m.distance("pin", bob.marker((0.0, 0.0, 0.0)), m.ground.marker((0.0, 0.0, 0.0)))
    return m


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
def test_pin_force_of_a_pendulum(integrator):
    """Released level, at the angle s below: tension 3 m g sin s, so the pin pulls with m g (3 sin s) along the rod."""
    solution = pendulum("revolute").simulate(0.8, rate=500, tol=1e-9, integrator=integrator)
    r = solution.com_position("bob")
    along = r / LENGTH
    tension = -3.0 * MASS * G * along[:, 1]
    force, _ = solution.reaction("pin")
    np.testing.assert_allclose(force, -tension[:, None] * along, atol=2e-6 * MASS * G)


def test_a_body_and_a_joint_are_taken_as_such_or_by_name():
    m = pendulum("revolute")
    solution = m.simulate(0.1, rate=100)
    bob, pin = m.bodies["bob"], m.joints["pin"]
    for what in ("com_position", "orientation", "angular_velocity", "com_acceleration"):
        assert (getattr(solution, what)(bob) == getattr(solution, what)("bob")).all()
    assert (solution.reaction_force(pin) == solution.reaction_force("pin")).all()
    with pytest.raises(KeyError, match=says("'arm'", "bob")):
        solution.com_position("arm")


def test_outputs_satisfy_the_constraints_better_than_the_integrator():
    """The outputs are projected onto the circle, to rounding; what the interpolant returns is off by 7e-10."""
    solution = pendulum("distance").simulate(2.0, rate=200, tol=1e-5)
    raw = solution.result.y[:, [u.name.startswith("R_") for u in solution.system.unknowns()]]
    strayed = np.abs(np.linalg.norm(raw, axis=1) - LENGTH).max()
    assert 1e-11 < strayed < 1e-8
    np.testing.assert_allclose(np.linalg.norm(solution.com_position("bob"), axis=1), LENGTH, atol=1e-12)
    assert solution.constraint_violation.max() == pytest.approx(strayed, rel=1e-3)


def test_acceleration_is_the_second_derivative_of_the_position():
    """Differences of order 4 at 1 kHz: error about (omega h)^4 = (6 / 1000)^4 = 1e-9 of the acceleration."""
    solution = pendulum("revolute").simulate(0.5, rate=1000, tol=1e-10)
    r, h = solution.com_position("bob"), 1e-3
    second = (-r[4:] + 16 * r[3:-1] - 30 * r[2:-2] + 16 * r[1:-3] - r[:-4]) / (12 * h * h)
    np.testing.assert_allclose(solution.com_acceleration("bob")[2:-2], second, atol=2e-4)


def slider_crank() -> Mechanism:
    """A driven crank, a rod on a ball and a universal joint, a slider: terms of points, axes, offsets and a motion."""
    m = Mechanism("slider crank", gravity=(0.3, -9.81, 0.5))
    crank = m.body("crank", 1.0, (0.01, 0.02, 0.015), position=(0.0, 0.1, 0.0))
    rod = m.body("rod", 0.8, (0.03, 0.002, 0.03), position=(0.3, 0.1, 0.05))
    slider = m.body("slider", 1.5, (0.01, 0.01, 0.02), position=(0.6, 0.0, 0.1))
    pin = m.revolute("pin", crank, m.ground, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    m.spherical("ball", rod, crank, at=(0.0, 0.2, 0.0))
    m.universal("cross", rod, slider, at=(0.6, 0.0, 0.1), axis=(0.0, 1.0, 0.0), axis_j=(0.0, 0.0, 1.0))
    m.translational("guide", slider, m.ground, at=(0.6, 0.0, 0.1), axis=(1.0, 0.0, 0.0))
    m.rotation("drive", pin, "9*TIME + 0.2*SIN(20*TIME)")
    m.spring_damper("spring", slider.marker((0.0, 0.0, 0.0)), m.ground.marker((1.0, 0.0, 0.1)), stiffness=500.0,
                    damping=5.0, length=0.3)  # fmt: skip
    return m


def test_constraints_are_the_same_in_any_company():
    """The tables are shared by all configurations of a system; on the way bodies change their Euler references."""
    system = slider_crank().compile()
    axes = np.array([[1.0, 2.0, -0.5], [0.3, -1.0, 2.0], [2.0, 0.1, 1.0]])
    steps = [np.concatenate([[0.0, 0.0, 0.0, *(s * axis)] for axis in axes]) for s in np.linspace(0.0, 1.5, 7)]
    places = [system.configuration.displaced(step) for step in steps]
    times = np.linspace(0.0, 0.3, 7)
    found = system.constraint_jacobians(np.array([place.pose for place in places]), times)
    references = set()
    for place, t, jacobian in zip(places, times, found):
        alone = slider_crank().compile()
        references.add(tuple(alone.assembler.at(place, t, None, alone.state_start).codes))
        np.testing.assert_array_equal(jacobian.toarray(), alone.constraint_jacobian(place, t)[0].toarray())
    assert len(references) > 1


def test_outputs_whose_pivots_do_not_fit_get_new_ones():
    """With a bound on the growth that eleven rows keep and later ones exceed, plans change on the way."""
    solution = slider_crank().simulate(2.0, rate=60.0)
    evaluator = solution._evaluator()
    choose, chosen_at = evaluator._choose_pivots, []

    def growth(row, table):
        vals, place = np.zeros(evaluator.vals.size), slice(row, row + 1)
        y = np.ascontiguousarray(solution.result.y[place])
        tables = evaluator.pattern[2], table, evaluator.rdata.copy(), evaluator.work.size
        assemble(solution.t[place], y, *tables, vals)
        return factor(evaluator.plan, evaluator.factors, vals)

    def strictly(t, y, table, *settings):
        choose(t, y, table, *settings)
        first = int(np.searchsorted(solution.t, t[0]))
        growths = np.array([growth(k, table) for k in range(first, min(first + 11, solution.t.size))])
        # growth is infinite where an entry that was zero at the first row is not
        evaluator.growth = 1.001 * growths[np.isfinite(growths)].max()
        chosen_at.append(first)

    evaluator._choose_pivots = strictly
    out = solution._new_records(solution.t.size)
    evaluator.fill(solution.t, solution.result.y, solution.result.epochs, out)
    assert len(chosen_at) > 2
    for name, a, b in zip(out._fields, out, solution._records, strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-10 * max(1.0, np.abs(b).max()), err_msg=name)
