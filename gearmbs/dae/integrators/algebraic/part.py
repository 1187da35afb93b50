"""The part of a problem that is solved at an instant: equations, unknowns, a dense matrix with its factors."""

from __future__ import annotations

from functools import cache

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector

SINGULAR = 1e-13
"""Ratio of pivots of the scaled matrix below which it counts as singular."""
LOOKED_AT = 10
"""Outputs that are looked at, those the furthest off: one for each algebraic unknown."""
MAX_POINTS = 8
"""Points of a polynomial of the highest order, and one to spare."""


class AlgebraicPart(Struct):
    """Equations and unknowns that are solved at an instant, and scratch for it.

    Attributes
    ----------
    rows : ndarray of int64, shape (m,)
        Equation of the problem.
    lifted : ndarray of int64, shape (m,)
        1 where its derivative by time takes its place.
    cols : ndarray of int64, shape (m,)
        Unknown of the problem.
    rates : ndarray of int64, shape (m,)
        1 where its rate is solved for.
    entry_row, entry_col, entry_at, entry_kind : ndarray of int64
        Entries of the matrix: place in it, place among the CSC values, and 1 for a derivative by a rate.
    atol : ndarray, shape (n,)
        Absolute tolerances.
    lu, scale, pivots : ndarray, shapes (m, m), (m,) and (m,)
        Factors of the matrix, scales of its rows, interchanges.
    f, guess, last, known, here : ndarray, shape (m,)
        What the equations are off by, or corrections; values to return to: of a guess, of slopes, along a branch; what
        they are off by at a breakpoint.
    told : ndarray, shape (m,)
        What an integrator says of them between its steps.
    moved, moved_at, moved_step : ndarray, shape (s,)
        By how many tolerances outputs are off that, the furthest of each of at most `LOOKED_AT` unknowns; when; and the
        size of the step around. Zero for a place that is free.
    moved_of : ndarray of int64, shape (s,)
        Which of the unknowns.
    moved_rdata : ndarray, shape (s, p)
        The table of numbers that was valid then: angles count their turns in it.
    """

    count: int
    any_lifted: bool
    any_rates: bool
    noting: bool  # whether outputs far off are to be kept
    factored: bool
    rtol: float
    t_start: float  # ends of the run: a table may end with it
    t_end: float
    t_first: float  # breakpoints or ends on either side: beyond them constraints may have other derivatives
    t_last: float
    failures: int  # instants at which the iteration did not converge
    first_failure: float
    rows: IntVector
    lifted: IntVector
    cols: IntVector
    rates: IntVector
    entry_row: IntVector
    entry_col: IntVector
    entry_at: IntVector
    entry_kind: IntVector
    atol: Vector
    vals: Vector
    vals_of_rates: Vector
    lu: Matrix
    scale: Vector
    pivots: IntVector
    f: Vector
    guess: Vector
    last: Vector
    known: Vector
    here: Vector
    told: Vector
    moved: Vector
    moved_at: Vector
    moved_step: Vector
    moved_of: IntVector
    moved_rdata: Matrix
    res: Vector
    y_moved: Vector
    yp_kept: Vector
    value: Vector
    slope: Vector


PART_TYPE = AlgebraicPart.struct_kind


def new_part(m: int, n: int, nnz: int, entries: int, numbers: int) -> AlgebraicPart:
    """Return room for m equations among those of n unknowns, with ``nnz`` entries, ``entries`` of them in these."""
    places = min(m, LOOKED_AT)
    return AlgebraicPart(
        count=m,
        t_start=-np.inf,
        t_end=np.inf,
        t_first=-np.inf,
        t_last=np.inf,
        **{name: np.zeros(m, dtype=np.int64) for name in ("rows", "lifted", "cols", "rates", "pivots")},
        **{name: np.zeros(entries, dtype=np.int64) for name in ("entry_row", "entry_col", "entry_at", "entry_kind")},
        **{name: np.zeros(m) for name in ("scale", "f", "guess", "last", "known", "here")},
        told=np.zeros(m),
        noting=True,
        **{name: np.zeros(places) for name in ("moved", "moved_at", "moved_step")},
        moved_of=np.zeros(places, dtype=np.int64),
        moved_rdata=np.empty((places, numbers)),
        **{name: np.zeros(n) for name in ("atol", "res", "y_moved", "yp_kept")},
        **{name: np.zeros(nnz) for name in ("vals", "vals_of_rates")},
        **{name: np.zeros(MAX_POINTS) for name in ("value", "slope")},
        lu=np.zeros((m, m)),
    )


@cache
def nothing() -> AlgebraicPart:
    """Return the part of problems without anything to solve for: compiled code but looks at its count."""
    return new_part(0, 0, 0, 0, 0)


@njit(cache=True, nogil=True, error_model="numpy")
def factor(part):
    """Factor ``part.lu`` with rows scaled to one, by Gauss's elimination with row interchanges; False if singular."""
    a, scale, pivots = part.lu, part.scale, part.pivots
    m = part.count
    for i in range(m):
        top = 0.0
        for j in range(m):
            top = max(top, abs(a[i, j]))
        if not (top > 0.0 and top < np.inf):
            return False
        scale[i] = 1.0 / top
        for j in range(m):
            a[i, j] *= scale[i]
    largest = 0.0
    for k in range(m):
        p = k
        for i in range(k + 1, m):
            if abs(a[i, k]) > abs(a[p, k]):
                p = i
        pivots[k] = p
        column = 0.0
        for i in range(m):
            column = max(column, abs(a[i, k]))
        if not abs(a[p, k]) > SINGULAR * column:
            return False
        largest = max(largest, column)
        if p != k:
            for j in range(m):
                a[k, j], a[p, j] = a[p, j], a[k, j]
        for i in range(k + 1, m):
            q = a[i, k] / a[k, k]
            a[i, k] = q
            if q != 0.0:
                for j in range(k + 1, m):
                    a[i, j] -= q * a[k, j]
    return np.isfinite(largest)


@njit(cache=True, nogil=True, error_model="numpy")
def solve(part, x):
    """Solve with the factors of `factor`; ``x`` is right-hand side and solution."""
    a, m = part.lu, part.count
    for k in range(m):
        x[k] *= part.scale[k]
    for k in range(m):
        p = part.pivots[k]
        x[k], x[p] = x[p], x[k]
    for k in range(m):
        for i in range(k + 1, m):
            x[i] -= a[i, k] * x[k]
    for k in range(m - 1, -1, -1):
        x[k] /= a[k, k]
        for i in range(k):
            x[i] -= a[i, k] * x[k]
