"""What is summed over modes stands in lanes, gathered by what modes share: neither order nor rounding shows."""

import numpy as np
import pytest

from gearmbs.dae.equations.bodies.inertia import LISTED, ModalInertia
from gearmbs.dae.equations.bodies.lane_lists import in_lanes
from gearmbs.mechanism import Mechanism, Mode, ShapeIntegrals

MODES = 19


def families() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masses, places and shapes of a bar whose modes move it along x, along y or along z, in turn."""
    rng = np.random.default_rng(4)
    masses, places = rng.uniform(0.1, 0.2, 30), np.zeros((30, 3))
    places[:, 2] = np.linspace(-1.0, 1.0, 30)
    places -= masses @ places / masses.sum()
    shapes = np.zeros((MODES, 30, 3))
    for k in range(MODES):
        shapes[k, :, k % 3] = rng.standard_normal(30)
        shapes[k] -= masses @ shapes[k] / masses.sum()
    return masses, places, shapes


def slopes(order: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residual and Jacobian of the bar as it spins and deforms, its modes given in an order but told in their own."""
    masses, places, shapes = families()
    integrals = ShapeIntegrals.of_points(masses, places, shapes[order])
    m = Mechanism()
    inertia = np.einsum("p,pi,pi->", masses, places, places) * np.array([1.0, 1.0, 0.1])
    modes = [Mode(stiffness=1e3 * (1.0 + k)) for k in order]
    m.modal_body(
        "bar", masses.sum(), inertia, modes, lambda place: np.zeros((2, MODES, 3)), integrals=integrals,
        angular_velocity=(1.0, 2.0, 3.0),
    )  # fmt: skip
    system = m.compile()
    system.initialise()
    problem = system.problem()
    own = np.arange(problem.n)
    for letter in ("p", "v", "q"):
        first = problem.names.index(f"{letter}_f_1(bar)")
        own[first + order] = np.arange(first, first + MODES)
    rng = np.random.default_rng(5)
    y, rates = problem.y0[own] + 0.1 * rng.standard_normal(problem.n), rng.standard_normal(problem.n)
    work, out, vals = np.zeros(problem.work_size), np.zeros(problem.n), np.zeros(len(problem.indices))
    back = np.argsort(own)
    given, given_rates = y[back], rates[back]
    problem.residual(0.0, given, given_rates, out, problem.idata, problem.rdata, work)
    problem.jacobian(0.0, given, given_rates, 100.0, vals, problem.idata, problem.rdata, work)
    dense = np.zeros((problem.n, problem.n))
    dense[problem.indices, np.repeat(np.arange(problem.n), np.diff(problem.indptr))] = vals
    return out[own], dense[np.ix_(own, own)]


def test_the_order_of_modes_does_not_matter():
    turned = np.random.default_rng(6).permutation(MODES)
    (residual, jacobian), (other, other_jacobian) = (slopes(order) for order in (np.arange(MODES), turned))
    np.testing.assert_allclose(other, residual, rtol=0.0, atol=1e-13 * np.abs(residual).max())
    np.testing.assert_allclose(other_jacobian, jacobian, rtol=0.0, atol=1e-13 * np.abs(jacobian).max())


def test_families_fill_lanes():
    """Of modes that have something in common with every third one alone, every lane is used but for the last ones."""
    rows = np.zeros((24, 2, 24))
    rows[:, 0] = np.arange(24)[:, None] % 3 == np.arange(24) % 3
    places, (counts, _, _) = in_lanes(rows)
    assert sorted(places) == list(range(24))
    assert counts.tolist() == [8, 8, 8, 0, 0, 0]


def test_modes_in_one_plane_give_one_moment():
    """Of the three squares of J2, two do not vanish; as second moments it is one."""
    masses, places, shapes = families()
    one = ShapeIntegrals.of_points(masses, places, shapes[::3])
    n = len(one.mass)
    inertia = ModalInertia(one.mass, np.eye(n), np.zeros((n, n)), np.zeros((n, 3)), one.cross, one.first, one.second)
    table = inertia.table(np.eye(3))
    assert table[LISTED] == n


@pytest.mark.parametrize("share", [1e-10, 1e-6])
def test_integrals_that_are_rounding_are_left_out(share):
    masses, places, shapes = families()
    sizes = []
    for noise in (0.0, share):
        integrals = ShapeIntegrals.of_points(masses, places, shapes + noise * shapes[np.arange(MODES) - 1])
        m = Mechanism()
        body = m.modal_body(
            "bar", masses.sum(), (2.0, 2.0, 0.1), [Mode(stiffness=1e3)] * MODES,
            lambda place: np.zeros((2, MODES, 3)), integrals=integrals,
        )  # fmt: skip
        sizes.append(body.modal.table(np.eye(3))[LISTED])
    assert (sizes[1] == sizes[0]) == (share < 1e-9)
