"""Outputs evaluated side by side against one after the other, which solves the whole saddle-point system of each."""

import itertools

import numpy as np
import pytest

from gearmbs.dae.linalg.sparse_lu import factor
from gearmbs.dae.model.evaluator import NEVER, assemble
from gearmbs.dae.model.side_by_side import is_possible
from gearmbs.kernels.lanes import LANES
from gearmbs.mechanism import Mechanism, Mode
from tests.mechanism.test_lumping import tree


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


def coupled() -> Mechanism:
    """Two wheels whose angles are counted, a tenth of a turn an output, nearly one for eight; a pendulum on a rod."""
    m = Mechanism("coupled", gravity=(0.0, -9.81, 0.0))
    wheels = []
    for k, x in enumerate((0.0, 0.3)):
        spin = (0.0, 0.0, 12.0 if k == 0 else -24.0)
        wheel = m.body(f"wheel {k}", 2.0, (0.02, 0.02, 0.03), position=(x, 0.0, 0.0), angular_velocity=spin)
        wheels.append(m.revolute(f"axle {k}", wheel, m.ground, at=(x, 0.0, 0.0), axis=(0.0, 0.0, 1.0)))
    m.gear("pair", wheels[0], wheels[1], -2.0)
    bob = m.body("bob", 0.5, (1e-3, 1e-3, 1e-3), position=(0.5, 0.3, 0.0))
    m.distance("rod", bob.marker((0.0, 0.0, 0.0)), m.ground.marker((0.0, 0.3, 0.0)))
    m.torque("motor", m.bodies["wheel 0"], "0.5*SIN(3*TIME)", axis=(0.0, 0.0, 1.0))
    return m


def records(solution, has_lanes: bool, first: int = 0):
    """Return what is evaluated at the outputs of a solution, in lanes or not, and the evaluator."""
    evaluator = solution._evaluator()
    evaluator.fewest_together = LANES if has_lanes else NEVER
    out = solution._new_records(solution.t.size - first)
    evaluator.fill(solution.t[first:], solution.result.y[first:], solution.result.epochs[:1], out)
    assert (evaluator.side is not None) == has_lanes
    return out, evaluator


def agree(one, other, tolerance: float = 1e-10) -> None:
    for name, a, b in zip(one._fields, one, other, strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance * max(1.0, np.abs(b).max()), err_msg=name)


def moved_by_rounding(solution) -> list[np.ndarray]:
    """Return how far the last digit of the unknowns moves each row of the records evaluated one after the other."""
    last_digit = np.random.default_rng(7).integers(-1, 2, (4, *solution.result.y.shape)) * np.finfo(float).eps
    exact = solution.result.y.copy()
    alone, _ = records(solution, False)
    moved = [np.zeros(len(a)) for a in alone]
    for change in last_digit:
        solution.result.y[:] = exact * (1.0 + change)
        for most, a, b in zip(moved, alone, records(solution, False)[0], strict=True):
            np.maximum(most, np.abs(a - b).reshape(len(a), -1).max(axis=1, initial=0.0), out=most)
    solution.result.y[:] = exact
    return moved


@pytest.mark.parametrize("build", [slider_crank, coupled, tree])
@pytest.mark.parametrize("tol", [1e-4, 1e-10])
def test_records_are_those_of_one_output_after_the_other(build, tol):
    """At a loose tolerance all outputs are projected; 203 of them leave three beyond the last eight.

    From one to the next bodies turn too far for the factors of the output before, with which outputs one after the
    other are else projected nearly as well. Where joints of the tree are near a singular position, the last digit of
    the unknowns moves reactions of 1e6 by 1e-3: both ways are right to that.
    """
    solution = build().simulate(10.1, rate=20.0, tol=tol)
    assert solution.success, solution.message
    together, _ = records(solution, True)
    alone, _ = records(solution, False)
    assert solution.t.size % LANES == 3
    for name, a, b, moved in zip(together._fields, together, alone, moved_by_rounding(solution), strict=True):
        apart = np.abs(a - b).reshape(len(a), -1).max(axis=1, initial=0.0)
        assert np.all(apart <= 1e-10 * max(1.0, np.abs(b).max()) + moved), name


@pytest.mark.parametrize("tol", [1e-4, 1e-10])
def test_records_of_bodies_integrated_as_one(tol):
    """What is recovered of seven bodies as one, with loads and joints on its members, against the same one by one."""
    solution = tree().simulate(10.1, rate=20.0, tol=tol, lump=True)
    assert solution.success, solution.message
    assert solution.members is not None
    together, _ = records(solution, True)
    alone, _ = records(solution, False)
    agree(together, alone)


def test_steps_on_the_constraints_are_left_where_they_are():
    """Integrator's own steps: most satisfy the constraints to rounding, some blocks of eight do not."""
    solution = slider_crank().simulate(0.5, every_step=True, tol=1e-8)
    together, _ = records(solution, True)
    alone, _ = records(solution, False)
    agree(together, alone)


def test_outputs_whose_pivots_do_not_fit_get_new_ones():
    """With a bound on the growth that eleven rows keep and later ones exceed, plans change within blocks of eight."""
    solution = slider_crank().simulate(2.0, rate=60.0)
    alone, _ = records(solution, False)
    evaluator = solution._evaluator()
    evaluator.fewest_together = LANES
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
        # a thousandth for rounding in lanes; growth is infinite where an entry that was zero at the first row is not
        evaluator.growth = 1.001 * growths[np.isfinite(growths)].max()
        chosen_at.append(first)

    evaluator._choose_pivots = strictly
    out = solution._new_records(solution.t.size)
    evaluator.fill(solution.t, solution.result.y, solution.result.epochs, out)
    assert any(b - a > LANES and (b - a) % LANES for a, b in itertools.pairwise(chosen_at))
    agree(out, alone)


def test_which_models_are_evaluated_side_by_side():
    def possible(m: Mechanism) -> bool:
        return is_possible(m.compile().problem().idata)

    assert possible(slider_crank())
    free = Mechanism("free")
    free.body("ball", 1.0, (1.0, 1.0, 1.0))
    assert not possible(free)
    bent = slider_crank()
    mode = Mode(frequency=5.0, mass=0.2, momentum=(0.0, 0.0, 0.3))
    beam = bent.modal_body("beam", 1.0, (0.1, 0.1, 0.1), [mode], lambda p: ([[0, 0, p[0] ** 2]], [[0, -2 * p[0], 0]]))
    bent.fixed("seat", beam, bent.ground, at=(2.0, 0.0, 0.0))
    assert not possible(bent)
