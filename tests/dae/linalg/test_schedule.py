"""Factoring by levels gives the numbers of the column by column form, to the last bit."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.dae.linalg.lu_plan import LUPlan, analyse
from gearmbs.dae.linalg.sparse_lu import factor, new_factors, solve, solve_pair


def column_by_column(plan: LUPlan, vals: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Return growth, L, U and inverse pivots along the plan's columns (left-looking)."""
    n = len(plan.row_from)
    x, l_vals, u_vals, inverse = np.zeros(n), np.zeros(len(plan.l_pos)), np.zeros(len(plan.u_pos)), np.zeros(n)
    for k in range(n):
        for p in range(plan.a_ptr[k], plan.a_ptr[k + 1]):
            x[plan.a_pos[p]] = vals[plan.a_src[p]] * plan.a_scale[p]
        for p in range(plan.u_ptr[k], plan.u_ptr[k + 1]):
            j = plan.u_pos[p]
            u_vals[p] = x[j]
            for q in range(plan.l_ptr[j], plan.l_ptr[j + 1]):
                x[plan.l_pos[q]] -= l_vals[q] * u_vals[p]
        inverse[k] = 1.0 / x[k] if plan.kept[k] else 0.0
        for q in range(plan.l_ptr[k], plan.l_ptr[k + 1]):
            l_vals[q] = x[plan.l_pos[q]] * inverse[k]
        x[:] = 0.0
    return np.abs(l_vals).max(initial=0.0), l_vals, u_vals, inverse


def substituted(plan: LUPlan, l_vals, u_vals, inverse, b) -> np.ndarray:
    """Return the solution with these factors, entry after entry in the order of the columns."""
    x = b[plan.row_from] * plan.row_scale
    for q in range(len(l_vals)):
        x[plan.l_pos[q]] -= l_vals[q] * x[plan.l_col[q]]
    for p in range(len(u_vals) - 1, -1, -1):
        k = plan.u_col[p]
        x[plan.u_pos[p]] -= u_vals[p] * (x[k] * inverse[k])
    out = np.empty(len(b))
    out[plan.col_to] = x * inverse * plan.col_scale
    return out


def sparse_matrix(n: int, density: float, seed: int) -> sp.csc_array:
    rng = np.random.default_rng(seed)
    a = sp.random_array((n, n), density=density, rng=rng, data_sampler=lambda size: rng.standard_normal(size))
    hidden = sp.coo_array((rng.uniform(3.0, 4.0, n), (np.arange(n), rng.permutation(n))), shape=(n, n))
    a = sp.csc_array(a + hidden)
    a.sort_indices()
    return a


def same_bits(a: sp.csc_array, drop: float = 0.0) -> LUPlan:
    """Compare factors and solutions of a matrix and of one with other values."""
    n, rng = a.shape[0], np.random.default_rng(a.nnz)
    plan = analyse(a.indptr.astype(np.int64), a.indices.astype(np.int64), a.data, np.ones(n), drop)
    factors, pair, out = new_factors(plan), np.zeros((4, n)), np.empty(n)
    lower, both = len(plan.l_to), len(plan.l_to) + len(plan.u_to)
    for _ in range(2):
        growth, l_vals, u_vals, inverse = column_by_column(plan, a.data)
        assert factor(plan, factors, a.data) == growth
        np.testing.assert_array_equal(factors.pivot_inv, inverse)
        places = {(int(i), int(k)): v for i, k, v in zip(plan.l_pos, plan.l_col, l_vals, strict=True)}
        np.testing.assert_array_equal(
            factors.lu[:lower], [places[int(i), int(k)] for i, k in zip(plan.l_to, plan.l_by, strict=True)]
        )
        places = {(int(i), int(k)): v for i, k, v in zip(plan.u_pos, plan.u_col, u_vals, strict=True)}
        kept = plan.kept[plan.u_by] > 0.0
        expected = np.array([places[int(i), int(k)] for i, k in zip(plan.u_to, plan.u_by, strict=True)])
        np.testing.assert_array_equal(factors.lu[lower:both][kept], expected[kept])
        b, c = rng.standard_normal((2, n))
        solve(plan, factors, b, out)
        np.testing.assert_array_equal(out, substituted(plan, l_vals, u_vals, inverse, b))
        pair[:2] = b, c
        solve_pair(plan, factors, pair)
        np.testing.assert_array_equal(pair[0], out)
        np.testing.assert_array_equal(pair[1], substituted(plan, l_vals, u_vals, inverse, c))
        a.data = a.data * rng.uniform(0.9, 1.1, a.nnz)
    return plan


@pytest.mark.slow
@settings(derandomize=True, max_examples=40, deadline=None)
@given(st.integers(1, 40), st.floats(0.0, 0.08), st.integers(0, 10_000))
def test_random_matrices(n, density, seed):
    a = sparse_matrix(n, density, seed)
    if np.linalg.cond(a.toarray()) < 1e10:
        same_bits(a)


def test_few_levels_of_many_columns():
    """Arrowheads beside each other: leaves, corners and the leaves that come after them, whatever their number."""
    block = np.eye(4) * 5.0
    block[-1, :-1] = block[:-1, -1] = 1.0
    plan = same_bits(sp.csc_array(np.kron(np.eye(30), block)))
    assert len(plan.pivot_ptr) - 1 == 3
    assert sorted(plan.pivot_order) == list(range(120))


@pytest.mark.parametrize("seed", range(4))
def test_equations_set_aside(seed):
    """Dependent rows and columns leave unknowns without a pivot; what belongs to them is not used."""
    a = sparse_matrix(30, 0.06, seed).toarray()
    a[7], a[:, 3] = a[5] * (1.0 + 1e-12), a[:, 11] * (1.0 - 1e-12)
    plan = same_bits(sp.csc_array(a), drop=1e-8)
    assert plan.kept.sum() < 30
