"""Static condensation of modes against the whole matrix."""

import numpy as np
import pytest
import scipy.sparse as sp

import gearmbs as gm
from gearmbs.dae.linalg.condensed import GROUP, MODES
from gearmbs.dae.linalg.condensed_lists import FEWEST
from gearmbs.dae.linalg.entry_lists import NEGLIGIBLE_IN_NEWTON
from gearmbs.dae.linalg.lu_plan import SingularMatrixError, analyse, parity
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, factor, new_factors, refactor_carried, solve
from tests.mechanism.test_stepping import flexible_pair


def bodies_on_joints(counts, rest, seed, gamma=1e4):
    """Return a matrix as Newton's of bodies with modes, and the places of these.

    Unknowns are p of all modes, ten others, v of all modes, the other others, and q of all modes.
    """
    rng = np.random.default_rng(seed)
    m, early = sum(counts), 10
    p, v, q = np.arange(m), m + early + np.arange(m), 2 * m + rest + np.arange(m)
    others = np.concatenate([m + np.arange(early), 2 * m + early + np.arange(rest - early)])
    n = 3 * m + rest
    a = np.zeros((n, n))
    body = np.repeat(np.arange(len(counts)), counts)
    frequency = rng.uniform(1e3, 1e5, m)
    a[p, p], a[p, q], a[p, v] = gamma, frequency**2, 0.1 * frequency
    a[v, p], a[v, v], a[v, q] = 1.0, -1.0, -1e-3 * rng.standard_normal(m)
    a[q, v], a[q, q] = 1.0, -gamma
    a[np.ix_(others, others)] = 3.0 * np.eye(rest) + 0.1 * rng.standard_normal((rest, rest)) * (
        rng.random((rest, rest)) < 0.2
    )
    for one in range(len(counts)):
        mine, met = body == one, rng.choice(others, min(rest, 11), replace=False)
        size = (mine.sum(), len(met))
        for rows, share in ((p[mine], 0.8), (v[mine], 0.3), (q[mine], 0.3)):
            some = met[: 1 + int(share * len(met))] if share > 0.5 else rng.choice(met, 3, replace=False)
            a[np.ix_(rows, some)] = rng.standard_normal((size[0], len(some)))
        for columns in (v[mine], q[mine]):
            some = rng.choice(met, 9, replace=False)
            a[np.ix_(some, columns)] = 0.1 * rng.standard_normal((len(some), size[0]))
    modes = np.column_stack([p, v, q, body]).ravel().astype(np.int64)
    return sp.csc_array(a), modes


def pattern(a):
    a.sort_indices()
    return a.indptr.astype(np.int64), a.indices.astype(np.int64), a.data


def residue(a, x, b):
    """Return what is left of equations, by the size of their terms."""
    return np.abs((a @ x - b) / (abs(a) @ np.abs(x) + np.abs(b))).max()


@pytest.mark.parametrize("with_tail", [False, True])
@pytest.mark.parametrize("counts", [(4,), (8, 1), (16, 17), (3, 9, 24)])
@pytest.mark.parametrize("rest", [12, 45])
def test_solutions_are_those_of_the_matrix(counts, rest, with_tail):
    a, modes = bodies_on_joints(counts, rest, sum(counts) + rest)
    n = a.shape[0]
    rng = np.random.default_rng(n)
    plan = analyse(*pattern(a), np.ones(n), with_tail=with_tail, modes=modes)
    assert plan.groups.reshape(-1, GROUP)[:, MODES].tolist() == list(counts)
    assert sorted(plan.row_from) == sorted(plan.col_to) == list(range(n))
    factors, x = new_factors(plan), np.empty(n)
    for _ in range(3):
        assert 0.0 < factor(plan, factors, a.data) < GROWTH_LIMIT
        for _ in range(2):
            b = rng.standard_normal(n)
            solve(plan, factors, b, x)
            assert residue(a, x, b) < 1e-11
            solve(plan, factors, b, b)
            np.testing.assert_array_equal(b, x)
        a.data = a.data * rng.uniform(0.9, 1.1, a.nnz)


@pytest.mark.parametrize("gamma", [1e1, 1e4, 1e7])
@pytest.mark.parametrize(
    ("mass", "damping", "stiffness"), [(0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
)
def test_modes_without_mass_damping_or_stiffness(gamma, mass, damping, stiffness):
    a, modes = bodies_on_joints((8, 5), 15, 8, gamma)
    p, v, q = modes.reshape(-1, 4)[::2, :3].T
    n, whole = a.shape[0], sp.lil_array(a)
    for i, j, share in ((v, v, mass), (p, v, damping), (p, q, stiffness)):
        for k in range(len(p)):
            whole[i[k], j[k]] *= share
    for k in range(len(p)):
        # nothing but the mode's own
        whole[v[k], q[k]] = 0.0
    a = sp.csc_array(whole)
    plan = analyse(*pattern(a), np.ones(n), modes=modes)
    assert len(modes_of(plan)) == 13
    factors, x, b = new_factors(plan), np.empty(n), np.random.default_rng(1).standard_normal(n)
    assert factor(plan, factors, a.data) < GROWTH_LIMIT
    solve(plan, factors, b, x)
    assert residue(a, x, b) < max(1e-11, 10.0 * np.finfo(float).eps * gamma)


def test_a_mode_of_nothing_is_a_singular_matrix_as_without_condensation():
    a, modes = bodies_on_joints((8,), 15, 8)
    p, v, q, _ = modes.reshape(-1, 4)[3]
    whole = sp.lil_array(a)
    whole[[v], :] = 0.0
    whole[:, [v, q]] = 0.0
    whole[v, p], whole[q, v], whole[q, q] = 1.0, 1.0, -1e4
    for given in (None, modes):
        with pytest.raises(SingularMatrixError):
            analyse(*pattern(sp.csc_array(whole)), np.ones(a.shape[0]), modes=given)


@pytest.mark.slow
def test_newton_matrices_of_shafts_at_other_steps():
    """What the matrix is carried over to a tenth of the step and ten times it, solved for unknowns that are known."""
    m, options = flexible_pair()
    sim = gm.Simulator(m, 0.01, lump=False, **options)
    rng = np.random.default_rng(3)
    for t in (0.001, 0.003):
        sim.advance(t)
        run, st = sim._run, sim._run.state
        n, problem = len(run.scale), run.problem
        for share in (0.1, 1.0, 10.0):
            gamma = share * st.gamma
            vals = st.jac + (gamma - st.gamma_evaluated) * st.jac_slope
            counted = ~problem.couplings
            between = counted, NEGLIGIBLE_IN_NEWTON[0], True, problem.couplings
            plan = analyse(run.indptr, run.indices, vals, run.scale, 0.0, *between, problem.modes)
            assert len(plan.mode_at) == 3 * 32
            vals[plan.left_src] = 0.0
            factors, x = new_factors(plan), np.empty(n)
            assert factor(plan, factors, vals) < GROWTH_LIMIT
            a = sp.csc_array((vals, run.indices, run.indptr), shape=(n, n))
            known = run.scale * rng.standard_normal(n)
            b = a @ known
            solve(plan, factors, b, x)
            assert residue(a, x, b) < 1e-8
            np.testing.assert_allclose(x / run.scale, known / run.scale, atol=1e-5)


def modes_of(plan):
    """Return the places of p of the modes that a plan condenses."""
    return sorted(plan.mode_at[::3].tolist())


def test_modes_that_meet_others_are_eliminated_with_all_unknowns():
    a, modes = bodies_on_joints((6, 5), 20, 1)
    n, whole = a.shape[0], sp.lil_array(a)
    p, v, q = modes.reshape(-1, 4)[:, :3].T
    # v of one by q of another mode, p in a joint's equation, and a pivot that cancels
    whole[v[0], q[3]], whole[20, p[5]], whole[p[7], q[7]] = 0.5, 0.5, 0.0
    whole[p[7], v[7]] = whole[p[7], p[7]] * whole[v[7], v[7]]
    whole[v[7], q[7]] = 0.0
    a = sp.csc_array(whole)
    plan = analyse(*pattern(a), np.ones(n), modes=modes)
    assert modes_of(plan) == [k for k in p if k not in p[[0, 3, 5, 7]]]
    factors, x, b = new_factors(plan), np.empty(n), np.random.default_rng(0).standard_normal(n)
    assert factor(plan, factors, a.data) < GROWTH_LIMIT
    solve(plan, factors, b, x)
    assert residue(a, x, b) < 1e-11


def test_few_modes_are_not_worth_it():
    a, modes = bodies_on_joints((FEWEST - 1,), 12, 1)
    assert len(analyse(*pattern(a), np.ones(a.shape[0]), modes=modes).groups) == 0


def test_pivots_have_the_sign_of_the_determinant():
    a, modes = bodies_on_joints((7, 4), 15, 3)
    plan = analyse(*pattern(a), np.ones(a.shape[0]), modes=modes)
    factors = new_factors(plan)
    factor(plan, factors, a.data)
    signs = np.prod(np.sign(factors.pivot_inv)) * parity(plan.row_from) * parity(plan.col_to)
    assert signs == np.linalg.slogdet(a.toarray())[0]


def test_a_matrix_carried_over_is_factored_as_a_new_one():
    a, modes = bodies_on_joints((9, 6), 15, 4)
    n, rng = a.shape[0], np.random.default_rng(5)
    plan = analyse(*pattern(a), np.ones(n), modes=modes)
    slope = np.where(rng.random(a.nnz) < 0.1, 0.1 * a.data, 0.0)
    carried, anew = new_factors(plan), new_factors(plan)
    factor(plan, carried, a.data)
    x, y, b = np.empty(n), np.empty(n), rng.standard_normal(n)
    for step in range(4):
        vals = a.data + step * slope
        # nothing has been noted of the first one
        assert refactor_carried(plan, carried, vals, slope, True) == factor(plan, anew, vals)
        solve(plan, carried, b, x)
        solve(plan, anew, b, y)
        np.testing.assert_array_equal(x, y)


def test_a_pivot_that_has_cancelled_asks_for_others():
    a, modes = bodies_on_joints((8,), 15, 6)
    p, v, q, _ = modes.reshape(-1, 4)[2]
    whole = sp.lil_array(a)
    f = whole[p, p] / whole[v, p]
    g = (whole[p, v] - f * whole[v, v]) / whole[q, v]
    plan, vanishing = analyse(*pattern(a), np.ones(a.shape[0]), modes=modes), f * whole[v, q] + g * whole[q, q]
    whole[p, q] = vanishing * (1.0 + 1e-9)
    spoiled = sp.csc_array(whole)
    assert not factor(plan, new_factors(plan), pattern(spoiled)[2]) <= GROWTH_LIMIT
    assert p not in modes_of(analyse(*pattern(spoiled), np.ones(a.shape[0]), modes=modes))
