"""Sparse LU against dense solutions; frozen pivots, growth check, near-singular matrices."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.dae.linalg.entry_lists import NEGLIGIBLE_IN_NEWTON
from gearmbs.dae.linalg.lu_plan import SingularMatrixError, analyse, new_lines
from gearmbs.dae.linalg.pivoting import GROWTH_ALLOWED, THRESHOLDS, choose_pivots, equilibrate
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, factor, new_factors, solve
from tests.says import says


def csc(matrix):
    a = sp.csc_array(matrix)
    a.sort_indices()
    return a.indptr.astype(np.int64), a.indices.astype(np.int64), a.data.copy()


def solve_once(matrix, b):
    indptr, indices, vals = csc(matrix)
    plan = analyse(indptr, indices, vals, np.ones(matrix.shape[0]))
    factors = new_factors(plan)
    factor(plan, factors, vals)
    x = np.empty(len(b))
    solve(plan, factors, b, x)
    return x


@pytest.mark.slow
@settings(derandomize=True, max_examples=80, deadline=None)
@given(st.integers(1, 40), st.floats(0.02, 0.4), st.integers(0, 10_000))
def test_random_matrices_with_a_hidden_transversal(n, density, seed):
    rng = np.random.default_rng(seed)
    a = sp.random(n, n, density, random_state=rng, data_rvs=rng.standard_normal).toarray()
    a[np.arange(n), rng.permutation(n)] += rng.choice([-1, 1], n) * rng.uniform(3, 4, n)
    if np.linalg.cond(a) > 1e10:
        return
    b = rng.standard_normal(n)
    x = solve_once(a, b)
    assert np.abs(a @ x - b).max() <= 1e-10 * max(1.0, np.abs(x).max()) * np.abs(a).max()


def kkt(n, m, seed, gamma=1.0):
    """Mass and constraint rows with a zero block on the diagonal."""
    rng = np.random.default_rng(seed)
    g = np.zeros((m, n))
    for row in range(m):
        g[row, rng.choice(n, 3, replace=False)] = rng.standard_normal(3)
    return np.block([[gamma * np.diag(rng.uniform(1, 2, n)), g.T], [g, np.zeros((m, m))]])


@pytest.mark.parametrize("gamma", [1e-3, 1.0, 1e6, 1e12])
def test_zero_diagonal_blocks_and_stiff_scales(gamma):
    a = kkt(30, 12, 3, gamma)
    exact = np.linalg.solve(kkt(30, 12, 3, 1.0), np.ones(42))
    # scaling the mass by gamma scales the multipliers by gamma
    b = np.ones(42)
    b[:30] *= gamma
    x = solve_once(a, b)
    x[30:] /= gamma
    np.testing.assert_allclose(x, exact, rtol=1e-8, atol=1e-10)


def test_replay_with_other_values_and_in_place():
    a = kkt(25, 10, 1)
    indptr, indices, vals = csc(a)
    plan = analyse(indptr, indices, vals, np.ones(35))
    factors = new_factors(plan)
    rng = np.random.default_rng(0)
    for _ in range(5):
        new = vals * rng.uniform(0.5, 2.0, len(vals))
        assert factor(plan, factors, new) < GROWTH_LIMIT
        m = sp.csc_array((new, indices, indptr), shape=a.shape).toarray()
        x = np.ones(35)
        solve(plan, factors, x, x)
        np.testing.assert_allclose(m @ x, 1.0, rtol=1e-7)


def test_growth_tells_when_frozen_pivots_go_bad():
    a = np.array([[1.0, 2.0, 0.5], [0.3, 1.0, 0.0], [0.2, 0.1, 1.0]])
    indptr, indices, vals = csc(a)
    plan = analyse(indptr, indices, vals, np.ones(3))
    factors = new_factors(plan)
    assert factor(plan, factors, vals) <= 10.0
    bad = vals.copy()
    first = (int(plan.row_from[0]), int(plan.col_to[0]))
    place = indptr[first[1]] + np.flatnonzero(indices[indptr[first[1]] : indptr[first[1] + 1]] == first[0])[0]
    bad[place] = 1e-9
    assert factor(plan, factors, bad) > GROWTH_LIMIT
    bad[place] = 0.0
    assert not np.isfinite(factor(plan, factors, bad))
    fresh = analyse(indptr, indices, bad, np.ones(3))
    factors = new_factors(fresh)
    assert factor(fresh, factors, bad) <= 1e3
    x = np.empty(3)
    solve(fresh, factors, np.ones(3), x)
    m = sp.csc_array((bad, indices, indptr), shape=(3, 3)).toarray()
    np.testing.assert_allclose(m @ x, 1.0, atol=1e-12)


def test_singular_matrix_names_what_is_left_over():
    a = kkt(12, 5, 2)
    a[-1] = a[-2]
    a[:, -1] = a[:, -2]
    indptr, indices, vals = csc(a)
    with pytest.raises(SingularMatrixError) as caught:
        analyse(indptr, indices, vals, np.ones(17))
    assert set(caught.value.cols) <= {15, 16}
    assert set(caught.value.rows) <= {15, 16}


def test_empty_column_is_singular():
    a = np.diag([1.0, 0.0, 2.0])
    indptr, indices, vals = csc(sp.csc_array(([1.0, 0.0, 2.0], ([0, 1, 2], [0, 1, 2])), shape=(3, 3)))
    with pytest.raises(SingularMatrixError) as caught:
        analyse(indptr, indices, vals, np.ones(3))
    assert caught.value.cols.tolist() == [1]
    assert a[1, 1] == 0.0


def test_nearly_dependent_equations_are_set_aside():
    a = kkt(12, 5, 2)
    a[-1] = a[-2] * (1 + 1e-11)
    a[:, -1] = a[:, -2] * (1 + 1e-11)
    indptr, indices, vals = csc(a)
    plan = analyse(indptr, indices, vals, np.ones(17), drop=1e-8)
    assert plan.kept.sum() == 16
    factors = new_factors(plan)
    factor(plan, factors, vals)
    b = a @ np.concatenate((np.ones(12), np.zeros(5)))
    x = np.empty(17)
    solve(plan, factors, b, x)
    np.testing.assert_allclose(a @ x, b, atol=1e-9)
    np.testing.assert_allclose(x[:12], 1.0, atol=1e-9)
    assert factors.x.tolist() == [0.0] * 17  # scratch is left clean for the next factorisation


def test_not_finite_is_refused():
    with pytest.raises(ValueError, match=says("matrix", "entries", "finite")):
        analyse(np.array([0, 1]), np.array([0]), np.array([np.nan]), np.ones(1))


def test_fill_of_a_chain_is_linear():
    """A block tridiagonal matrix factors with work proportional to its length."""
    counts = []
    for blocks in (20, 80):
        rng = np.random.default_rng(blocks)
        side = sp.diags_array([1.0, 1.0], offsets=[-1, 1], shape=(blocks, blocks))
        pattern = sp.kron(sp.eye_array(blocks), np.ones((4, 4))) + sp.kron(side, np.ones((4, 4)) * (np.eye(4) > 0))
        a = sp.csc_array(pattern)
        a.data = rng.standard_normal(a.nnz)
        a = a + 6 * sp.eye_array(4 * blocks)
        indptr, indices, vals = csc(a)
        plan = analyse(indptr, indices, vals, np.ones(4 * blocks))
        counts.append(int(np.diff(plan.l_ptr)[plan.u_pos].sum()))
    assert counts[1] / counts[0] < 4.6


@pytest.mark.slow
@settings(derandomize=True, max_examples=40, deadline=None)
@given(st.integers(2, 12), st.integers(0, 10_000))
def test_equilibration_brings_entries_near_one(n, seed):
    """A matrix of ones scaled at random comes back to entries within a power of two."""
    rng = np.random.default_rng(seed)
    a = np.outer(10.0 ** rng.uniform(-6, 6, n), 10.0 ** rng.uniform(-6, 6, n))
    indptr, indices, vals = csc(a)
    rows, cols = np.ones(n), np.ones(n)
    equilibrate(indptr, indices, vals, rows, cols)
    scaled = rows[:, None] * a * cols
    assert scaled.max() / scaled.min() < 5.0
    assert scaled.max() < 4.0


@pytest.mark.slow
def test_noise_in_place_of_zeros_does_not_spoil_the_scaling():
    """Entries that geometry makes zero hold rounding noise of any size; the rest is as well conditioned as before."""
    rng = np.random.default_rng(5)
    n = 400
    rows = np.concatenate([np.arange(n), rng.integers(0, n, 6 * n)])
    cols = np.concatenate([rng.permutation(n), rng.integers(0, n, 6 * n)])
    vals = np.concatenate([rng.uniform(1.0, 2.0, n), 10.0 ** rng.uniform(-16.0, -5.0, 6 * n)])
    # dynamics with h^2, constraints without: the scales that have to be found
    power = 10.0 ** rng.integers(-6, 7, n)
    matrix = sp.csc_array((vals * power[rows], (rows, cols)), shape=(n, n))
    matrix.sum_duplicates()
    indptr, indices = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64)
    plan = analyse(indptr, indices, matrix.data, np.ones(n))
    factors = new_factors(plan)
    factor(plan, factors, matrix.data)
    x = rng.normal(size=n)
    out = np.empty(n)
    solve(plan, factors, matrix @ x, out)
    # a permuted diagonal but for entries of 1e-5: condition below 4
    assert np.abs(out - x).max() < 1e-13
    row_scale, col_scale = np.ones(n), np.ones(n)
    equilibrate(indptr, indices, matrix.data, row_scale, col_scale)
    scaled = row_scale[:, None] * matrix.toarray() * col_scale
    assert np.linalg.cond(scaled) < 10.0


@pytest.mark.slow
def test_growing_entries_ask_for_stricter_pivots():
    """A band of entries 1 and 0.011: pivots of a hundredth of their column let entries grow 1e7 times, a tenth 60."""
    rng = np.random.default_rng(1390)
    n, band = int(rng.integers(30, 120)), int(rng.integers(2, 6))
    dense = np.zeros((n, n))
    for k in range(n):
        for j in range(max(0, k - band), min(n, k + band + 1)):
            if rng.random() < 0.8:
                dense[k, j] = rng.choice([-1, 1]) * (0.011 if rng.random() < 0.6 else 1.0)
    indptr, indices, vals = csc(dense)
    n, size = len(indptr) - 1, 8 * len(indices)
    lines = new_lines(n, size)
    growth = [choose_pivots(indptr, indices, vals, 1e-14, threshold, *lines)[1] for threshold in THRESHOLDS[:2]]
    assert growth[0] > GROWTH_ALLOWED > 10.0 * growth[1]
    x = rng.normal(size=n)
    out = solve_once(dense, dense @ x)
    # backward stable: rounding, a growth below 100, and a sum over 2 * 5 + 1 entries
    assert np.abs(dense @ out - dense @ x).max() < 100.0 * 11 * 2.2e-16 * np.abs(dense).max() * np.abs(out).max()


@pytest.mark.slow
def test_fill_that_does_not_fit_is_told_and_given_room():
    """A scattered matrix fills up; with a small pool lines are moved together, until there is no room at all."""
    rng = np.random.default_rng(4)
    n = 60
    dense = np.where(rng.random((n, n)) < 0.15, rng.normal(size=(n, n)), 0.0) + np.eye(n)
    indptr, indices, vals = csc(dense)

    def pivots(size):
        lines = new_lines(n, size)
        return choose_pivots(indptr, indices, vals, 1e-14, 0.1, *lines)

    assert pivots(len(indices) + 2)[0] == -1
    wide = pivots(50 * len(indices))
    compacted = pivots(4 * len(indices))
    assert wide[0] == compacted[0] == n
    np.testing.assert_array_equal(compacted[2], wide[2])
    np.testing.assert_array_equal(compacted[3], wide[3])


def sparse_with_rounding(n, seed):
    """Pattern, values and a mask of a matrix of which many entries are zero but for rounding."""
    rng = np.random.default_rng(seed)
    pattern = rng.uniform(size=(n, n)) < 0.3
    np.fill_diagonal(pattern, True)
    counts = pattern & ((rng.uniform(size=(n, n)) < 0.4) | np.eye(n, dtype=bool))
    matrix = rng.uniform(0.5, 1.0, (n, n)) * np.where(counts, 1.0, 1e-18) + 4.0 * np.eye(n)
    a = sp.csc_array(pattern.astype(float))
    a.sort_indices()
    columns = np.repeat(np.arange(n), np.diff(a.indptr))
    at = a.indices, columns
    return a.indptr.astype(np.int64), a.indices.astype(np.int64), np.ascontiguousarray(matrix[at]), counts[at]


@pytest.mark.parametrize("n", [7, 30])
def test_negligible_entries_are_left_out_until_they_count(n):
    indptr, indices, vals, counts = sparse_with_rounding(n, n)
    counted = np.zeros(vals.size, dtype=bool)
    plan = analyse(indptr, indices, vals, np.ones(n), counted=counted)
    np.testing.assert_array_equal(counted, counts)
    np.testing.assert_array_equal(np.sort(plan.left_src), np.flatnonzero(~counts))
    factors = new_factors(plan)
    assert factor(plan, factors, vals) < GROWTH_LIMIT
    whole = sp.csc_array((vals, indices, indptr), shape=(n, n)).toarray()
    b, x = np.arange(1.0, n + 1.0), np.empty(n)
    solve(plan, factors, b, x)
    np.testing.assert_allclose(whole @ x, b, rtol=1e-12)

    # rounding may change, an entry that counts may not stay out, and never leaves again
    vals[plan.left_src] *= -3.0
    assert factor(plan, factors, vals) < GROWTH_LIMIT
    grown = int(plan.left_src[0])
    vals[grown] = 0.3
    assert factor(plan, factors, vals) == np.inf
    plan = analyse(indptr, indices, vals, np.ones(n), counted=counted)
    assert counted.sum() == counts.sum() + 1
    assert counted[grown]
    assert grown not in plan.left_src
    factors = new_factors(plan)
    assert factor(plan, factors, vals) < GROWTH_LIMIT
    whole = sp.csc_array((vals, indices, indptr), shape=(n, n)).toarray()
    solve(plan, factors, b, x)
    np.testing.assert_allclose(whole @ x, b, rtol=1e-12)
    vals[plan.left_src[0]] = np.nan
    assert factor(plan, factors, vals) == np.inf


@pytest.mark.parametrize("negligible", NEGLIGIBLE_IN_NEWTON[:2])
def test_couplings_are_left_out_with_the_first_limit_until_they_are_large(negligible):
    """Of five couplings one is too large from the start; those left out may grow to `COUPLING_LIMIT`."""
    n, rng = 30, np.random.default_rng(5)
    a = np.diag(rng.uniform(1.0, 1.5, n)) + np.diag(rng.uniform(0.3, 0.5, n - 1), 1)
    couplings = np.zeros((n, n), dtype=bool)
    for k, size in enumerate((1e-3, 5e-4, 1e-3, 2e-3, 0.15)):
        a[20 + k, k], couplings[20 + k, k] = size, True
    # others of the same size count
    a[5, 25] = 1e-3
    a[a == 0.0] = 1e-9
    indptr, indices, vals = csc(a)
    between, counted = couplings.T.ravel(), np.zeros(n * n, dtype=bool)
    plan = analyse(indptr, indices, vals, np.ones(n), 0.0, counted, negligible, couplings=between)
    small = between & (np.abs(vals) < 0.01)
    leaves = negligible == NEGLIGIBLE_IN_NEWTON[0]
    assert not counted[small].any() if leaves else counted[between].all()
    assert counted[between & ~small].all()
    assert counted[vals == a[5, 25]].any()
    factors = new_factors(plan)
    assert factor(plan, factors, vals) < GROWTH_LIMIT
    grown = int(np.flatnonzero(small)[0])
    vals[grown] = 0.1
    assert factor(plan, factors, vals) < GROWTH_LIMIT
    if leaves:
        vals[grown] = 1.0
        assert factor(plan, factors, vals) == np.inf
        plan = analyse(indptr, indices, vals, np.ones(n), 0.0, counted, negligible, couplings=between)
        assert counted[grown]
        assert factor(plan, new_factors(plan), vals) < GROWTH_LIMIT


def test_what_only_rounding_keeps_from_being_singular_is_not_left_out():
    a = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [1.0, 1.0, 1.0]])
    indptr, indices, _ = csc(np.ones((3, 3)))
    vals = a.T.ravel() * 1.0
    vals[4] += 1e-16
    with pytest.raises(SingularMatrixError):
        analyse(indptr, indices, vals, np.ones(3), counted=np.zeros(9, dtype=bool))


def test_couplings_that_a_matrix_is_singular_without_are_taken():
    a = np.diag([2.0, 0.0, 0.0, 3.0])
    a[1, 2] = a[2, 1] = 0.2
    indptr, indices, vals = csc(np.ones((4, 4)))
    vals = a.T.ravel()
    coupled = vals == 0.2
    plan = analyse(indptr, indices, vals, np.ones(4), 0.0, np.zeros(16, dtype=bool), 1e-4, couplings=coupled)
    factors, x = new_factors(plan), np.empty(4)
    assert factor(plan, factors, vals) < GROWTH_LIMIT
    solve(plan, factors, np.array([2.0, 0.4, 0.6, 3.0]), x)
    np.testing.assert_allclose(x, [1.0, 3.0, 2.0, 1.0], rtol=1e-14)


@pytest.mark.parametrize("with_tail", [False, True])
def test_lists_of_a_plan_are_made_once_for_the_same_pivots_and_scales_for_each_matrix(with_tail):
    n, rng = 40, np.random.default_rng(3)
    # the last rows and columns are full: they make a tail
    a = np.diag(rng.uniform(3.0, 4.0, n))
    a[10:, 10:] += rng.uniform(0.1, 0.2, (n - 10, n - 10))
    indptr, indices, vals = csc(a)
    larger = 256.0 * vals
    one, other = (analyse(indptr, indices, v, np.ones(n), with_tail=with_tail) for v in (vals, larger))
    assert (one.tail < n) is with_tail
    assert other.l_pos is one.l_pos
    assert not np.array_equal(one.row_scale, other.row_scale)
    b = rng.standard_normal(n)
    for plan, v in ((one, vals), (other, larger), (one, vals)):
        factors, x = new_factors(plan), np.empty(n)
        factor(plan, factors, v)
        solve(plan, factors, b, x)
        dense = sp.csc_array((v, indices, indptr)).toarray()
        np.testing.assert_allclose(dense @ x, b, atol=1e-12)
