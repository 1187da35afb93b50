"""Newton matrix by coloured differences, and adapters that give users' functions the fixed signatures.

A user's function is called with its own few arguments; what the integrator needs beside them (pattern, colours,
increments, addresses of Python callbacks) stands in front of the user's parameters in the tables of the problem:

* ``idata``: the header below, then colour pointers, columns by colour, ``indptr``, ``indices``
* ``rdata``: least and typical magnitude of each unknown for the increments, typical magnitude of its rate, then the
  user's parameters

An increment is a fixed part of the unknown or of what it changes by in a step, but no less than its tolerance, or the
same part of its typical magnitude if that is smaller. A larger increment of an unknown that has become small, say a
radical at 1e-13, would measure the slope at another place. Where the tolerance lies far below the typical magnitude a
second difference, over that magnitude, supplies the entries that rounding hides in the first.

y and y' are moved together, y' by cj times as much, which for small steps is far more than y' itself. That is exact
where G is linear in y'. Where it is not, the two are differenced apart, y' to both sides by a part of its own size.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from gearmbs.dae.problem import EPS, EVENTS_SIG, JACOBIAN_SIG, RESIDUAL_SIG
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import int64, types
from gearmbs.kernels.pointers import call_address

# header of idata
N = 0
N_COLOURS = 1
RESIDUAL_ADDRESS = 2
JACOBIAN_ADDRESS = 3
EVENTS_ADDRESS = 4
COLOUR_PTR = 5
COLOUR_COLS = 6
INDPTR = 7
INDICES = 8
PARAMETERS = 9
NONLINEAR_RATES = 10
N_HEADER = 11

INCREMENT = 1.4901161193847656e-08
"""Square root of the rounding, 2^-26: for a one-sided difference of a function of its own size, the error of the second
derivative is then that of rounding (J. E. Dennis, R. B. Schnabel, "Numerical Methods for Unconstrained Optimization and
Nonlinear Equations", Prentice-Hall 1983, section 5.4)."""
INCREMENT_OF_RATE = 6e-6
"""Part of a rate by which it is moved to both sides: the cube root of the rounding, where its error is that of the
third derivative, 1e-11."""
FAR_BELOW = 1e-3
"""Part of the typical magnitude below which the least one counts as far below it."""
VISIBLE = 100.0
"""Units in the last place of the terms of an equation that a difference must exceed to be trusted."""

_IVEC = int64[::1]
_VEC = types.float64[::1]


@njit(int64(_IVEC, _IVEC, _IVEC), cache=True)
def colour_columns(indptr, indices, colours):
    """Give columns that share a row different colours, greedily; return the number of colours.

    Parameters
    ----------
    indptr, indices : ndarray of int64
        CSC pattern of a square matrix.
    colours : ndarray of int64, shape (n,)
        Written.
    """
    n = colours.shape[0]
    # the pattern by rows: which columns share one
    row_ptr = np.zeros(n + 1, dtype=np.int64)
    for p in range(indices.shape[0]):
        row_ptr[indices[p] + 1] += 1
    for i in range(n):
        row_ptr[i + 1] += row_ptr[i]
    fill = row_ptr.copy()
    row_cols = np.empty(indices.shape[0], dtype=np.int64)
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            row_cols[fill[i]] = j
            fill[i] += 1
    # colour c is taken for column j if taken[c] is j, so that it need not be cleared for each column
    taken = np.full(n + 1, -1, dtype=np.int64)
    colours[:] = -1
    count = 0
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            for q in range(row_ptr[i], row_ptr[i + 1]):
                c = colours[row_cols[q]]
                if c >= 0:
                    taken[c] = j
        c = 0
        while taken[c] == j:
            c += 1
        colours[j] = c
        count = max(count, c + 1)
    return count


def pack_tables(
    indptr: np.ndarray,
    indices: np.ndarray,
    least: np.ndarray,
    typical: np.ndarray,
    rates: np.ndarray,
    parameters: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Lay out ``idata``, ``rdata`` and the length of ``work`` for a user's problem.

    Parameters
    ----------
    indptr, indices : ndarray of int64
        CSC pattern.
    least, typical : ndarray, shape (n,)
        Magnitudes of each unknown, for the increments.
    rates : ndarray, shape (n,)
        Typical magnitudes of the rates, for the same.
    parameters : ndarray
        The user's parameters.

    Returns
    -------
    idata, rdata : ndarray
    work_size : int
    """
    n = len(indptr) - 1
    colours = np.empty(n, dtype=np.int64)
    count = colour_columns(indptr, indices, colours)
    columns = np.argsort(colours, kind="stable").astype(np.int64)
    pointers = np.concatenate(([0], np.cumsum(np.bincount(colours, minlength=count)))).astype(np.int64)
    header = np.zeros(N_HEADER, dtype=np.int64)
    header[N] = n
    header[N_COLOURS] = count
    header[COLOUR_PTR] = N_HEADER
    header[COLOUR_COLS] = header[COLOUR_PTR] + len(pointers)
    header[INDPTR] = header[COLOUR_COLS] + n
    header[INDICES] = header[INDPTR] + n + 1
    header[PARAMETERS] = 3 * n
    idata = np.concatenate((header, pointers, columns, indptr, indices)).astype(np.int64)
    rdata = np.concatenate((least, typical, rates, parameters)).astype(float)
    return idata, rdata, 5 * n


@njit(types.float64(int64, _VEC, _VEC, types.float64, types.float64), cache=True, nogil=True, error_model="numpy")
def _increment(j, y, yp, cj, magnitude):
    """Return the increment of unknown j; the magnitude of y' enters through cj, as its increment is cj times that."""
    return INCREMENT * max(abs(y[j]), max(magnitude, abs(yp[j]) / cj if cj > 0.0 else 0.0))


@njit(types.boolean(int64, _VEC, _VEC, types.float64, _VEC, int64), cache=True, nogil=True, error_model="numpy")
def _hidden(j, y, yp, cj, rdata, n):
    """Return whether rounding may hide entries of column j at its increment."""
    return _increment(j, y, yp, cj, rdata[j]) < FAR_BELOW * INCREMENT * rdata[n + j]


@njit(
    types.void(
        types.FunctionType(RESIDUAL_SIG),
        types.float64,
        _VEC,
        _VEC,
        types.float64,
        _VEC,
        _IVEC,
        _VEC,
        _VEC,
        int64,
        types.boolean,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _difference_colour(residual, t, y, yp, cj, vals, idata, rdata, work, c, wide):
    """Difference the columns of colour c; with ``wide`` over the typical magnitude, for entries that rounding hides.

    Parameters
    ----------
    residual : function
    t, y, yp, cj : float, ndarray, ndarray, float
        Place, and factor of dG/dy'.
    vals : ndarray
        Written: the whole columns, or with ``wide`` the entries whose differences were within the rounding of the
        terms of their equation.
    idata, rdata, work : ndarray
        Tables of `pack_tables`, with G in the first block of ``work`` and the sizes of its terms in the fifth.
    c : int
        Colour.
    wide : bool
    """
    n = idata[N]
    base = work[0:n]
    moved = work[n : 2 * n]
    y_moved = work[2 * n : 3 * n]
    yp_moved = work[3 * n : 4 * n]
    terms = work[4 * n : 5 * n]
    for i in range(n):
        y_moved[i] = y[i]
        yp_moved[i] = yp[i]
    colour_ptr = idata[idata[COLOUR_PTR] :]
    columns = idata[idata[COLOUR_COLS] :]
    indptr = idata[idata[INDPTR] :]
    indices = idata[idata[INDICES] :]
    for q in range(colour_ptr[c], colour_ptr[c + 1]):
        j = columns[q]
        # the second difference is for columns whose increment was far below their typical magnitude
        if wide and not _hidden(j, y, yp, cj, rdata, n):
            continue
        y_moved[j] = y[j] + _increment(j, y, yp, cj, rdata[n + j] if wide else rdata[j])
        yp_moved[j] = yp[j] + cj * (y_moved[j] - y[j])
    residual(t, y_moved, yp_moved, moved, idata, rdata, work)
    for q in range(colour_ptr[c], colour_ptr[c + 1]):
        j = columns[q]
        # what the sum was rounded to, not what was added
        d = y_moved[j] - y[j]
        if d == 0.0:
            continue
        narrow = _increment(j, y, yp, cj, rdata[j])
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            # a wider difference has a larger error of its own: it is taken where the first was lost in rounding
            if not wide or abs(vals[p]) * narrow <= VISIBLE * EPS * terms[i]:
                vals[p] = (moved[i] - base[i]) / d


@njit(
    types.void(
        types.FunctionType(RESIDUAL_SIG),
        types.float64,
        types.float64[::1],
        types.float64[::1],
        types.float64,
        types.float64[::1],
        _IVEC,
        types.float64[::1],
        types.float64[::1],
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _add_rates(residual, t, y, yp, cj, vals, idata, rdata, work):
    """Add cj dG/dy' to ``vals`` by central differences over part of each rate, two residuals for each colour.

    The parameters are those of `difference_matrix`.
    """
    n = idata[N]
    behind, ahead, yp_moved = work[0:n], work[n : 2 * n], work[3 * n : 4 * n]
    colour_ptr = idata[idata[COLOUR_PTR] :]
    columns = idata[idata[COLOUR_COLS] :]
    indptr = idata[idata[INDPTR] :]
    indices = idata[idata[INDICES] :]
    for i in range(n):
        yp_moved[i] = yp[i]
    for c in range(idata[N_COLOURS]):
        first, last = colour_ptr[c], colour_ptr[c + 1]
        for q in range(first, last):
            j = columns[q]
            yp_moved[j] = yp[j] - INCREMENT_OF_RATE * max(abs(yp[j]), rdata[2 * n + j])
        residual(t, y, yp_moved, behind, idata, rdata, work)
        for q in range(first, last):
            j = columns[q]
            yp_moved[j] = yp[j] + INCREMENT_OF_RATE * max(abs(yp[j]), rdata[2 * n + j])
        residual(t, y, yp_moved, ahead, idata, rdata, work)
        for q in range(first, last):
            j = columns[q]
            # central difference: (G(y' + d) - G(y' - d)) / 2d
            d = 2.0 * INCREMENT_OF_RATE * max(abs(yp[j]), rdata[2 * n + j])
            for p in range(indptr[j], indptr[j + 1]):
                vals[p] += cj * ((ahead[indices[p]] - behind[indices[p]]) / d)
            yp_moved[j] = yp[j]


@njit(
    types.void(
        types.FunctionType(RESIDUAL_SIG),
        types.float64,
        types.float64[::1],
        types.float64[::1],
        types.float64,
        types.float64[::1],
        _IVEC,
        types.float64[::1],
        types.float64[::1],
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _difference_together(residual, t, y, yp, cj, vals, idata, rdata, work):
    """Write dG/dy + cj dG/dy' by forward differences, y and y' moved together.

    The parameters are those of `difference_matrix`.
    """
    n = idata[N]
    base = work[0:n]
    residual(t, y, yp, base, idata, rdata, work)
    for c in range(idata[N_COLOURS]):
        _difference_colour(residual, t, y, yp, cj, vals, idata, rdata, work, c, False)
    terms = work[4 * n : 5 * n]
    indptr = idata[idata[INDPTR] :]
    indices = idata[idata[INDICES] :]
    terms[:] = 0.0
    for j in range(n):
        # what each equation is summed up from: rounding of a difference is that of its largest term
        size = max(abs(y[j]), abs(yp[j]) / cj if cj > 0.0 else 0.0)
        for p in range(indptr[j], indptr[j + 1]):
            terms[indices[p]] += abs(vals[p]) * size
    colour_ptr = idata[idata[COLOUR_PTR] :]
    columns = idata[idata[COLOUR_COLS] :]
    for c in range(idata[N_COLOURS]):
        for q in range(colour_ptr[c], colour_ptr[c + 1]):
            if _hidden(columns[q], y, yp, cj, rdata, n):
                _difference_colour(residual, t, y, yp, cj, vals, idata, rdata, work, c, True)
                break


@njit(
    types.void(
        types.FunctionType(RESIDUAL_SIG),
        types.float64,
        types.float64[::1],
        types.float64[::1],
        types.float64,
        types.float64[::1],
        _IVEC,
        types.float64[::1],
        types.float64[::1],
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def difference_matrix(residual, t, y, yp, cj, vals, idata, rdata, work):
    """Write dG/dy + cj dG/dy' by forward differences, one residual for each colour and one for the base.

    Columns with entries that rounding may hide cost their colour a second residual, and where G is not linear in y'
    each colour two more.

    Parameters
    ----------
    residual : function
        Of RESIDUAL_SIG.
    t, y, yp, cj : float, ndarray, ndarray, float
        Time, y, y' and the factor of dG/dy'.
    vals : ndarray, shape (nnz,)
        Written, in CSC order.
    idata, rdata, work : ndarray
        Tables laid out by `pack_tables`, handed to ``residual`` as they are; ``work`` is overwritten.
    """
    apart = idata[NONLINEAR_RATES] != 0 and cj != 0.0
    _difference_together(residual, t, y, yp, 0.0 if apart else cj, vals, idata, rdata, work)
    if apart:
        _add_rates(residual, t, y, yp, cj, vals, idata, rdata, work)


@njit(RESIDUAL_SIG, cache=True, nogil=True, error_model="numpy")
def python_residual(t, y, yp, out, idata, rdata, work):
    """Call the user's Python residual through its C callback."""
    call_address(idata[RESIDUAL_ADDRESS], t, y, yp, 0.0, out)


@njit(JACOBIAN_SIG, cache=True, nogil=True, error_model="numpy")
def python_jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """Call the user's Python Jacobian through its C callback."""
    call_address(idata[JACOBIAN_ADDRESS], t, y, yp, cj, vals)


@njit(EVENTS_SIG, cache=True, nogil=True, error_model="numpy")
def python_events(t, y, yp, out, idata, rdata, work):
    """Call the user's Python event functions through their C callback."""
    call_address(idata[EVENTS_ADDRESS], t, y, yp, 0.0, out)


@cache
def adapt_residual(function: Callable, with_parameters: bool) -> Callable:
    """Return a numba function of RESIDUAL_SIG around a user's ``f(t, y, yp, out[, p])`` compiled by numba."""
    if with_parameters:

        @njit(RESIDUAL_SIG, nogil=True, error_model="numpy")
        def residual(t, y, yp, out, idata, rdata, work):
            function(t, y, yp, out, rdata[idata[PARAMETERS] :])

    else:

        @njit(RESIDUAL_SIG, nogil=True, error_model="numpy")
        def residual(t, y, yp, out, idata, rdata, work):
            function(t, y, yp, out)

    return residual


@cache
def adapt_jacobian(function: Callable, with_parameters: bool, dense: bool) -> Callable:
    """Return a numba function of JACOBIAN_SIG around a user's ``jac(t, y, yp, cj, out[, p])`` compiled by numba."""
    if dense and with_parameters:

        @njit(JACOBIAN_SIG, nogil=True, error_model="numpy")
        def jacobian(t, y, yp, cj, vals, idata, rdata, work):
            n = idata[N]
            function(t, y, yp, cj, vals.reshape((n, n)).T, rdata[idata[PARAMETERS] :])

    elif dense:

        @njit(JACOBIAN_SIG, nogil=True, error_model="numpy")
        def jacobian(t, y, yp, cj, vals, idata, rdata, work):
            n = idata[N]
            function(t, y, yp, cj, vals.reshape((n, n)).T)

    elif with_parameters:

        @njit(JACOBIAN_SIG, nogil=True, error_model="numpy")
        def jacobian(t, y, yp, cj, vals, idata, rdata, work):
            function(t, y, yp, cj, vals, rdata[idata[PARAMETERS] :])

    else:

        @njit(JACOBIAN_SIG, nogil=True, error_model="numpy")
        def jacobian(t, y, yp, cj, vals, idata, rdata, work):
            function(t, y, yp, cj, vals)

    return jacobian


@cache
def differenced(residual: Callable) -> Callable:
    """Return a numba function of JACOBIAN_SIG that differences ``residual``; tables as by `pack_tables`."""

    @njit(JACOBIAN_SIG, nogil=True, error_model="numpy")
    def jacobian(t, y, yp, cj, vals, idata, rdata, work):
        difference_matrix(residual, t, y, yp, cj, vals, idata, rdata, work)

    return jacobian


def _no_events(t, y, yp, out, idata, rdata, work):
    pass


def adapt_events(functions: list[Callable], with_parameters: list[bool]) -> Callable:
    """Return a numba function of EVENTS_SIG around users' ``g(t, y, yp[, p])`` compiled by numba."""
    chain: Callable = njit(EVENTS_SIG, nogil=True, error_model="numpy")(_no_events)
    for place, (function, takes_p) in enumerate(zip(functions, with_parameters, strict=True)):
        chain = _append_event(chain, function, takes_p, place)
    return chain


def _append_event(before: Callable, function: Callable, takes_p: bool, place: int) -> Callable:
    if takes_p:

        @njit(EVENTS_SIG, nogil=True, error_model="numpy")
        def events(t, y, yp, out, idata, rdata, work):
            before(t, y, yp, out, idata, rdata, work)
            out[place] = function(t, y, yp, rdata[idata[PARAMETERS] :])

    else:

        @njit(EVENTS_SIG, nogil=True, error_model="numpy")
        def events(t, y, yp, out, idata, rdata, work):
            before(t, y, yp, out, idata, rdata, work)
            out[place] = function(t, y, yp)

    return events


@njit(
    types.void(
        types.FunctionType(RESIDUAL_SIG),
        types.float64,
        types.float64[::1],
        types.float64[::1],
        types.boolean[::1],
        _IVEC,
        types.float64[::1],
        types.float64[::1],
    ),
    cache=True,
)
def find_differential(residual, t, y, yp, differential, idata, rdata, work):
    """Mark the unknowns whose derivative changes the residual at one point.

    Parameters
    ----------
    residual : function
        Of RESIDUAL_SIG.
    t, y, yp : float, ndarray, ndarray
        The point.
    differential : ndarray of bool, shape (n,)
        Written.
    idata, rdata, work : ndarray
        Tables of the problem, handed to ``residual`` as they are.
    """
    n = y.shape[0]
    base = np.empty(n)
    moved = np.empty(n)
    yp_moved = yp.copy()
    residual(t, y, yp, base, idata, rdata, work)
    for j in range(n):
        yp_moved[j] = yp[j] + 1e-3 * max(1.0, abs(yp[j]))
        residual(t, y, yp_moved, moved, idata, rdata, work)
        differential[j] = False
        for i in range(n):
            if moved[i] != base[i]:
                differential[j] = True
        yp_moved[j] = yp[j]
