"""Whether a corrector converges without the entries of its matrix that a plan leaves out."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gearmbs.dae.linalg.entry_lists import RATE_ALLOWED
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, solve
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import KEPT_LAYOUTS

solve_at = caller(solve.declared)

_VEC = float64[::1]
_IVEC = int64[::1]


@lru_cache(maxsize=KEPT_LAYOUTS)
def signs_of_error(n: int) -> np.ndarray:
    """Return signs of the parts of an error that nothing favours."""
    return np.random.default_rng(0).choice([-1.0, 1.0], n)


@njit(boolean(int64, PLAN_TYPE, FACTORS_TYPE, _IVEC, _IVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def converges_without(address, plan, factors, indptr, indices, matrix, signs):
    """Return whether a corrector converges as well without the entries that a plan leaves out.

    Of an error e of the unknowns it leaves M^-1 (M - A) e, here of one with equal parts of all scaled unknowns: an
    improbable one, of which the first correction may leave more than the second does of a later one.

    Parameters
    ----------
    address : int
        Of `gearmbs.dae.linalg.sparse_lu.solve`.
    plan, factors : LUPlan, LUFactors
        Of A, the matrix without these entries.
    indptr, indices, matrix : ndarray
        M, in CSC form.
    signs : ndarray, shape (n,)
        Of `signs_of_error`.
    """
    left, n = plan.left_src, signs.shape[0]
    if left.shape[0] == 0:
        return True
    scale, error, res = np.empty(n), np.empty(n), np.empty(n)
    for k in range(n):
        scale[plan.col_to[k]] = plan.col_scale[k]
    for i in range(n):
        error[i] = signs[i] * scale[i]
    before = 1.0
    for _ in range(2):
        res[:] = 0.0
        column = 0
        for e in range(left.shape[0]):
            p = np.int64(left[e])
            while indptr[column + 1] <= p:
                column += 1
            res[indices[p]] += matrix[p] * error[column]
        solve_at(address)(plan, factors, res, error)
        size, is_number = 0.0, True
        for i in range(n):
            part = abs(error[i] / scale[i])
            size = max(size, part)
            is_number &= not np.isnan(part)
        if is_number and size <= RATE_ALLOWED * before:
            return True
        if not (is_number and size <= before):
            return False
        before = size
    return False
