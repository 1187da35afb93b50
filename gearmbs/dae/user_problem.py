"""A user's functions, compiled by numba or plain Python, made a `DAEProblem`."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, issparse

from gearmbs.dae.integrators import differences
from gearmbs.dae.integrators.messages import moved_rates, unknown_name
from gearmbs.dae.linalg.lu_plan import LUPlan, SingularMatrixError, analyse
from gearmbs.dae.linalg.sparse_lu import LUFactors, factor, new_factors, solve
from gearmbs.dae.problem import DAEProblem
from gearmbs.kernels.jit import is_compiled
from gearmbs.kernels.pointers import PythonCallback

RATES_STEP = 1e-12
"""Step of implicit Euler over which rates are solved for, as part of the span: so short that no rate moves its unknown
by a tolerance, and long enough for y to change by more than rounding where rates are of the order of y by the span."""
RATES_SWEEPS = 3
RATES_RATIO = 100.0
"""By which that step is shortened where an unknown still moves by a tolerance; in all to some 1e-34 of the span. The
move of a rate shrinks on the way, a jump does not."""
RATES_ROUNDS = 12
RATES_ITERATIONS = 100
"""From rates a million times too large Newton's method takes ln 1e6/ln(p/(p - 1)) of them with a power p: 62 with 5."""
RATES_HALVINGS = 40
"""Halvings of a correction of Newton's method until the next one, with the same matrix, is smaller: an exponential
overshoots by any factor a double can hold."""
RATES_FOUND = 1e-8
"""Part of a rate within which Newton's method has found it: its next correction is the square of that."""
RATES_REMARKED = 1e-6
"""Part of a rate, or of a typical one, from which on a change of given rates is told."""
RATES_HOLD = 1e-10
"""Residual, in terms of what typical rates do to it, that counts as zero: some roundings."""
BENT = 1e-12
"""Second difference of G by y', in terms of G, beyond rounding."""
LARGEST_BLOCK = 600
"""Algebraic unknowns up to which those of index one are looked for, by a dense decomposition: 0.2 s."""
NEARBY = 1e-3
"""Part of the span, and of the unknowns, by which the start is left to see whether more derivatives appear."""
NULL = 1e-5
"""Part of the largest singular value below which one, or a component of a vector, counts as zero in a block of
differences, whose entries are right to 1e-8 where the tolerance allows an increment of some 1e-8, else to 1e-5."""


def _takes(function: Callable, fewest: int, what: str) -> bool:
    """Return whether ``function`` takes the parameters ``p`` beside its ``fewest`` arguments."""
    inner = getattr(function, "py_func", function)
    try:
        count = len(inspect.signature(inner).parameters)
    except (TypeError, ValueError):
        return False
    if count not in (fewest, fewest + 1):
        raise ValueError(
            f"{what} takes {count} arguments; it must take {fewest}, or {fewest + 1} with the parameters p last"
        )
    return count == fewest + 1


class _UserFunctions:
    """Compiled functions of one user's problem, and the exceptions its Python callbacks have raised."""

    def __init__(self, n: int, parameters: np.ndarray):
        self.n = n
        self.parameters = parameters
        self.errors: list[BaseException] = []
        self.callbacks: list[PythonCallback] = []
        self.addresses: dict[int, int] = {}

    def _register(self, slot: int, function: Callable, n_out: int) -> None:
        callback = PythonCallback(function, self.n, n_out, self.errors)
        self.callbacks.append(callback)
        assert callback.address is not None
        self.addresses[slot] = callback.address

    def tables(
        self, compiled: dict[str, Any], least: np.ndarray, scales: np.ndarray, span: float
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Return the tables of the problem and the length of its work array, with the addresses of its callbacks."""
        idata, rdata, work_size = differences.pack_tables(
            compiled["indptr"], compiled["indices"], least, scales, least / span, self.parameters
        )
        for slot, address in self.addresses.items():
            idata[slot] = address
        return idata, rdata, work_size

    def residual(self, fun: Callable) -> Callable:
        takes_p = _takes(fun, 4, "the residual")
        if is_compiled(fun):
            return differences.adapt_residual(fun, takes_p)
        extra = (self.parameters,) if takes_p else ()

        def call(t, y, yp, _unused, out):
            answer = fun(t, y, yp, out, *extra)
            if answer is not None and answer is not out:
                raise TypeError(
                    f"the residual returned {type(answer).__name__}; it must write G into its argument out and return "
                    "nothing"
                )

        self._register(differences.RESIDUAL_ADDRESS, call, self.n)
        return differences.python_residual

    def jacobian(self, jac: Callable | None, residual: Callable, nnz: int, dense: bool) -> Callable:
        if jac is None:
            return differences.differenced(residual)
        takes_p = _takes(jac, 5, "the Jacobian")
        if is_compiled(jac):
            return differences.adapt_jacobian(jac, takes_p, dense)
        extra = (self.parameters,) if takes_p else ()
        n = self.n

        def call(t, y, yp, cj, vals):
            jac(t, y, yp, cj, vals.reshape((n, n)).T if dense else vals, *extra)

        self._register(differences.JACOBIAN_ADDRESS, call, nnz)
        return differences.python_jacobian

    def events(self, functions: Sequence[Callable]) -> Callable:
        takes_p = [_takes(g, 3, "an event function") for g in functions]
        if all(is_compiled(g) for g in functions):
            return differences.adapt_events(list(functions), takes_p)
        extras = [(self.parameters,) if p else () for p in takes_p]

        def call(t, y, yp, _unused, out):
            for i, (g, extra) in enumerate(zip(functions, extras, strict=True)):
                out[i] = g(t, y, yp, *extra)

        self._register(differences.EVENTS_ADDRESS, call, len(functions))
        return differences.python_events


def _vector(value: Any, n: int, name: str) -> np.ndarray:
    array = np.asarray(value, dtype=float)
    if array.ndim == 0:
        array = np.full(n, float(array))
    if array.shape != (n,):
        raise ValueError(
            f"{name} has shape {array.shape}; it must be a number or have one entry for each of {n} unknowns"
        )
    return array.copy()


def _mask(value: Any, n: int, name: str) -> np.ndarray:
    mask = np.asarray(value)
    if mask.dtype != bool or mask.shape != (n,):
        raise ValueError(f"{name} must be {n} booleans, has shape {mask.shape} and type {mask.dtype}")
    return mask.copy()


def _pattern(jac_sparsity: Any, n: int) -> tuple[np.ndarray, np.ndarray]:
    if jac_sparsity is None:
        return np.arange(0, n * n + 1, n, dtype=np.int64), np.tile(np.arange(n, dtype=np.int64), n)
    pattern = csc_array(jac_sparsity if issparse(jac_sparsity) else np.asarray(jac_sparsity) != 0)
    if pattern.shape != (n, n):
        raise ValueError(f"jac_sparsity has shape {pattern.shape}; it must be ({n}, {n})")
    pattern.sort_indices()
    return pattern.indptr.astype(np.int64), pattern.indices.astype(np.int64)


def _find_rates(problem: DAEProblem, span: float) -> None:
    """Set y' of differential unknowns by a few Newton sweeps on a vanishing implicit Euler step.

    Where the values are off the constraints, the sweeps take the jump onto them for a rate, which would hide the
    inconsistency from the check of the start: then the rates stay zero.
    """
    work = np.zeros(problem.work_size)
    tables = (problem.idata, problem.rdata, work)
    moving = problem.differential
    gamma = 1.0 / (RATES_STEP * span)
    out = np.empty(problem.n)

    def sweep(gamma: float, factored: tuple[LUPlan, LUFactors]) -> np.ndarray:
        problem.residual(problem.t0, problem.y0, problem.yp0, out, *tables)
        delta = np.empty(problem.n)
        solve(*factored, out, delta)
        return delta[moving]

    tolerance = problem.atol_scale[moving]
    for _ in range(RATES_ROUNDS):
        factored = _factors_at_start(problem, gamma, tables)
        if factored is None:
            return
        jump = sweep(gamma, factored)
        if (np.abs(jump) <= tolerance).all():
            break
        gamma *= RATES_RATIO
    else:
        # the move of a rate shrinks with the step, a jump does not
        return
    problem.yp0[moving] -= gamma * jump
    for _ in range(RATES_SWEEPS - 1):
        problem.yp0[moving] -= gamma * sweep(gamma, factored)


def _find_steep(problem: DAEProblem, functions: _UserFunctions, span: float) -> None:
    """Mark as differential also unknowns whose derivative changes G over rates of one or typical ones only.

    Over a thousandth of them a fourth power is lost in the rounding of other terms.
    """
    tables = problem.idata, problem.rdata, np.zeros(problem.work_size)
    known = len(functions.errors)
    base, moved = np.empty(problem.n), np.empty(problem.n)
    problem.residual(problem.t0, problem.y0, problem.yp0, base, *tables)
    for j in np.flatnonzero(~problem.differential):
        for size in (1.0 + abs(problem.yp0[j]), problem.scale[j] / span):
            rates = problem.yp0.copy()
            rates[j] += size
            problem.residual(problem.t0, problem.y0, rates, moved, *tables)
            if len(functions.errors) == known and np.isfinite(moved).all() and (moved != base).any():
                problem.differential[j] = True
            del functions.errors[known:]


def _nonlinear_in_rates(problem: DAEProblem, functions: _UserFunctions, span: float) -> bool:
    """Return whether second differences of G by y' do not vanish, over rates of the order of the given ones or of one,
    and over typical ones. Where G is not defined there it is not linear either.
    """
    tables = problem.idata, problem.rdata, np.zeros(problem.work_size)
    known = len(functions.errors)
    moving = problem.differential
    for size in (1.0 + np.abs(problem.yp0), problem.scale / span):
        way = np.where(moving, size * np.random.default_rng(0).uniform(0.5, 1.0, problem.n), 0.0)
        values = np.empty((3, problem.n))
        for k in range(3):
            problem.residual(problem.t0, problem.y0, problem.yp0 + k * way, values[k], *tables)
        raised = len(functions.errors) > known
        if known == 0 and raised and not np.isfinite(values[0]).all():
            return False
        del functions.errors[known:]
        if not np.isfinite(values[0]).all():
            return False
        bend = np.abs(values[2] - 2.0 * values[1] + values[0])
        if raised or not np.isfinite(values).all() or (bend > BENT * np.abs(values).sum(axis=0)).any():
            return True
    return False


def _settle_rates(problem: DAEProblem, span: float, given: bool) -> str:
    """Solve G = 0 for y' of differential unknowns where G is not linear in them; return what to say of it.

    Newton's method, with y kept: steps of implicit Euler so short that y does not move in them, which take the change
    of algebraic unknowns into account. Its path stays on the branch of the given rates, else of zero.

    Raises
    ------
    ValueError
        Where it does not converge though the constraints hold: the rates are then not determined by y alone.
    """
    tables = problem.idata, problem.rdata, np.zeros(problem.work_size)
    moving, given_rates = problem.differential, problem.yp0.copy()
    typical = problem.rdata[2 * problem.n : 3 * problem.n]
    unit = np.maximum(np.abs(given_rates), typical)
    gamma, out, delta = 1.0 / (RATES_STEP * span), np.empty(problem.n), np.empty(problem.n)
    raises = 0
    for _ in range(RATES_ITERATIONS):
        factored = _factors_at_start(problem, gamma, tables)
        if factored is None:
            break
        problem.residual(problem.t0, problem.y0, problem.yp0, out, *tables)
        solve(*factored, out, delta)
        if not np.isfinite(delta).all():
            break
        if not (np.abs(delta[moving]) <= problem.atol_scale[moving]).all():
            # the move of a rate shrinks with the step, a jump of y does not
            raises += 1
            if raises > RATES_ROUNDS:
                break
            gamma *= RATES_RATIO
            continue
        move, before, size = gamma * delta[moving], problem.yp0[moving], np.abs(delta[moving] / unit[moving]).max()
        for halvings in range(RATES_HALVINGS):
            problem.yp0[moving] = before - 0.5**halvings * move
            problem.residual(problem.t0, problem.y0, problem.yp0, out, *tables)
            if np.isfinite(out).all():
                solve(*factored, out, delta)
                if np.abs(delta[moving] / unit[moving]).max() <= (1.0 - 0.25 * 0.5**halvings) * size:
                    break
        if (np.abs(move) <= RATES_FOUND * np.maximum(np.abs(problem.yp0), typical)[moving]).all():
            moved = np.abs(problem.yp0 - given_rates) > RATES_REMARKED * np.maximum(np.abs(problem.yp0), typical)
            return moved_rates(problem, np.flatnonzero(moved), given_rates) if given else ""
    problem.yp0[:] = given_rates
    problem.residual(problem.t0, problem.y0, given_rates, out, *tables)
    size = np.where(moving, np.maximum(np.abs(given_rates), typical), 0.0)
    rest = given_rates + size * np.random.default_rng(0).uniform(0.5, 1.0, problem.n)
    moved_out = np.empty(problem.n)
    problem.residual(problem.t0, problem.y0, rest, moved_out, *tables)
    rows = moved_out != out
    off = float(np.max(np.abs(out), initial=0.0))
    if not np.isfinite(off) or np.max(np.abs(out[~rows]), initial=0.0) > RATES_HOLD * (1.0 + np.abs(problem.y0).max()):
        # values off the constraints, or equations that are not defined: the check of the start says so
        return ""
    if off <= RATES_HOLD * float(np.max(np.abs(moved_out - out)[rows], initial=0.0)):
        return ""
    row = int(np.argmax(np.where(rows, np.abs(out), 0.0)))
    raise ValueError(
        f"the rates at the start cannot be found: G is not linear in y', and from yp0 = "
        f"{np.array2string(given_rates, threshold=6)} Newton's method does not come to rates that satisfy equation "
        f"{row} (residual {out[row]:.3g}); dG/dy' vanishes on the way, or several rates are possible, or none. Give "
        "yp0= near the rates that are meant"
    )


def _factors_at_start(problem: DAEProblem, gamma: float, tables: tuple) -> tuple[LUPlan, LUFactors] | None:
    """Factor the Newton matrix at the start for a step of size 1 / ``gamma``; None if that cannot be done."""
    out, vals = np.empty(problem.n), np.empty(len(problem.indices))
    problem.residual(problem.t0, problem.y0, problem.yp0, out, *tables)
    problem.jacobian(problem.t0, problem.y0, problem.yp0, gamma, vals, *tables)
    if not (np.isfinite(out).all() and np.isfinite(vals).all()):
        return None
    try:
        plan = analyse(problem.indptr, problem.indices, vals, problem.scale)
    except SingularMatrixError:
        return None
    factors = new_factors(plan)
    factor(plan, factors, vals)
    return plan, factors


def _index_one(problem: DAEProblem) -> np.ndarray:
    """Return which algebraic unknowns the equations without derivatives determine at the start, shape (n,).

    Those that no null vector of B moves, B the derivatives of these equations by all algebraic unknowns.
    """
    found = np.zeros(problem.n, dtype=bool)
    columns = np.flatnonzero(~problem.differential)
    if not 0 < len(columns) <= LARGEST_BLOCK:
        return found
    tables = (problem.idata, problem.rdata, np.zeros(problem.work_size))
    base, moved, vals = np.empty(problem.n), np.empty(problem.n), np.empty(len(problem.indices))
    problem.residual(problem.t0, problem.y0, problem.yp0, base, *tables)
    # no two rates by the same, which an equation might balance
    rates = problem.yp0 + (1.0 + np.abs(problem.yp0)) * np.random.default_rng(0).uniform(0.5, 1.0, problem.n)
    problem.residual(problem.t0, problem.y0, rates, moved, *tables)
    problem.jacobian(problem.t0, problem.y0, problem.yp0, 0.0, vals, *tables)
    if not (np.isfinite(base).all() and np.isfinite(moved).all() and np.isfinite(vals).all()):
        return found
    matrix = csc_array((vals, problem.indices, problem.indptr), shape=(problem.n, problem.n)).tocsr()
    block = matrix[np.flatnonzero(moved == base)][:, columns].toarray() * problem.scale[columns]
    block = block[np.abs(block).max(axis=1) > 0.0] if len(block) else block
    if not len(block):
        return found
    block /= np.abs(block).max(axis=1, keepdims=True)
    _, values, right = np.linalg.svd(block)
    null = right[int((values > NULL * values[0]).sum()) :]
    found[columns] = (np.abs(null) <= NULL).all(axis=0)
    return found


def _compiled(
    functions: _UserFunctions, fun: Callable, jac: Callable | None, jac_sparsity: Any, events: Sequence[Callable]
) -> dict[str, Any]:
    """Return the fields of a `DAEProblem` with its functions and the pattern of its matrix; see `as_problem`."""
    indptr, indices = _pattern(jac_sparsity, functions.n)
    residual = functions.residual(fun)
    return {
        "residual": residual,
        "jacobian": functions.jacobian(jac, residual, len(indices), jac_sparsity is None),
        "events": functions.events(events) if len(events) else None,
        "n_events": len(events),
        "indptr": indptr,
        "indices": indices,
    }


def _check_derivatives(problem: DAEProblem, functions: _UserFunctions, span: float) -> None:
    """Refuse equations whose derivatives stand in G, but not at the start, or nowhere.

    Raises
    ------
    ValueError
    """
    found = np.zeros(problem.n, dtype=np.bool_)
    tables = problem.idata, problem.rdata, np.zeros(problem.work_size)
    known = len(functions.errors)
    # two ways off the start: one of them may lead out of where the equations are defined
    for side in (1.0, -1.0):
        t, y = problem.t0 + NEARBY * span, problem.y0 + side * NEARBY * (1.0 + np.abs(problem.y0))
        near, out = np.zeros(problem.n, dtype=np.bool_), np.empty(problem.n)
        problem.residual(t, y, problem.yp0, out, *tables)
        if np.isfinite(out).all() and len(functions.errors) == known:
            differences.find_differential(problem.residual, t, y, problem.yp0, near, *tables)
            found |= near & (len(functions.errors) == known)
        del functions.errors[known:]
    lost = np.flatnonzero(found & ~problem.differential)
    if len(lost):
        named = ", ".join(unknown_name(problem, int(i)) for i in lost)
        raise ValueError(
            f"dG/dy' vanishes at the start for {named}: the derivative stands in G, but its factor is zero at "
            f"t0 = {problem.t0:g}, y0 = {np.array2string(problem.y0, threshold=6)}, so that the equations do not say "
            "how the solution leaves this point (it may be infinitely fast, or one of many). Start a little later on "
            "the solution, or give differential= and yp0= if you know how it goes on"
        )
    if not problem.differential.any():
        raise ValueError(
            "no derivative appears in G, so that nothing is under error control: find the roots of algebraic equations "
            "otherwise, or put unknowns under error control with error_mask="
        )


def _start(y0: npt.ArrayLike, atol: npt.ArrayLike, scale: npt.ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return initial values, absolute tolerances and scales as vectors; raise a ValueError if they cannot be that."""
    y0 = np.array(y0, dtype=float).ravel()
    if len(y0) == 0:
        raise ValueError("y0 is empty")
    atols = _vector(atol, len(y0), "atol")
    if not (atols > 0).all():
        raise ValueError(f"atol must be positive, is {atols.min():g} for unknown {int(np.argmin(atols))}")
    return y0, atols, _vector(scale, len(y0), "scale")


class EquationKeywords(TypedDict, total=False):
    """What is to be said of equations beside them, for type checkers: arguments of `as_problem`."""

    p: np.ndarray | None
    scale: float | np.ndarray
    error_mask: np.ndarray | None
    differential: np.ndarray | None
    jac: Callable | None
    jac_sparsity: Any
    names: Sequence[str]


def as_problem(
    fun: Callable,
    t0: float,
    y0: npt.ArrayLike,
    yp0: npt.ArrayLike | None,
    span: float,
    *,
    p: np.ndarray | None = None,
    atol: npt.ArrayLike = 1e-8,
    scale: float | np.ndarray = 1.0,
    error_mask: np.ndarray | None = None,
    differential: np.ndarray | None = None,
    jac: Callable | None = None,
    jac_sparsity: Any = None,
    events: Sequence[Callable] = (),
    names: Sequence[str] = (),
) -> tuple[DAEProblem, list[BaseException]]:
    """Turn a user's functions into a `DAEProblem`.

    Parameters
    ----------
    fun, t0, y0, yp0
        Residual and start, as in `solve_dae`.
    span : float
        Length of the run.
    p : array_like, optional
        Parameters handed to ``fun``, ``jac`` and ``events``.
    atol : float or ndarray
        Absolute tolerances.
    scale : float or ndarray
        Typical magnitude of the unknowns, for increments and for scaling the Newton matrix.
    error_mask : ndarray of bool, optional
        Unknowns under error control; default those whose derivative appears (multipliers are left out). For a system
        of index three only the positions.
    differential : ndarray of bool, optional
        Unknowns whose derivative appears in G; found by probing G at the start if not given.
    jac : callable, optional
        ``jac(t, y, yp, cj, out[, p])`` writes dG/dy + cj dG/dy' into ``out``: the (n, n) matrix, or with
        ``jac_sparsity`` its entries in CSC order. Without it coloured differences are used.
    jac_sparsity : array_like or sparse matrix, shape (n, n), optional
        Pattern of dG/dy and dG/dy' together.
    events : sequence of callable
        ``g(t, y, yp[, p])``.
    names : sequence of str
        Names of the unknowns, for messages.

    Returns
    -------
    problem : DAEProblem
        With ``atol_scale`` set to ``atol``: integrate with ``tol=1``.
    errors : list of BaseException
        Where Python callbacks leave what they raise; while it is not empty they are not called.
    """
    y0, atols, scales = _start(y0, atol, scale)
    n = len(y0)
    parameters = np.array([] if p is None else p, dtype=float).ravel()
    functions = _UserFunctions(n, parameters)
    compiled = _compiled(functions, fun, jac, jac_sparsity, events)
    idata, rdata, work_size = functions.tables(
        compiled, np.minimum(scales, atols / differences.INCREMENT), scales, span
    )
    rates = np.zeros(n) if yp0 is None else _vector(yp0, n, "yp0")
    tables = idata, rdata, np.zeros(work_size)
    mask = _mask(differential, n, "differential") if differential is not None else np.empty(n, dtype=np.bool_)
    if differential is None:
        differences.find_differential(compiled["residual"], float(t0), y0, rates, mask, *tables)
    problem = DAEProblem(
        n=n,
        **compiled,
        idata=idata,
        rdata=rdata,
        work_size=work_size,
        y0=y0,
        yp0=rates,
        error_mask=mask.copy() if error_mask is None else _mask(error_mask, n, "error_mask"),
        atol_scale=atols,
        scale=scales,
        differential=mask,
        t0=float(t0),
        names=list(names),
        callbacks=functions.callbacks,
        jacobian_residuals=1 + int(idata[differences.N_COLOURS]) if jac is None else 0,
    )
    if differential is None:
        _find_steep(problem, functions, span)
        if error_mask is None:
            problem.error_mask = problem.differential.copy()
    if differential is None and error_mask is None:
        _check_derivatives(problem, functions, span)
    if not problem.error_mask.any():
        raise ValueError(
            "error_mask leaves no unknown under error control: set it at least for unknowns whose derivatives appear"
        )
    problem.nonlinear_rates = _nonlinear_in_rates(problem, functions, span)
    if problem.nonlinear_rates:
        idata[differences.NONLINEAR_RATES] = 1
        problem.start_note = _settle_rates(problem, span, yp0 is not None)
    elif yp0 is None:
        _find_rates(problem, span)
    problem.index_one = _index_one(problem)
    return problem, functions.errors
