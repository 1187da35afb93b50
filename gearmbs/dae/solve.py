"""One call for users: `solve_dae`, in the manner of scipy's ``solve_ivp``, for any DAE and any of our integrators."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numba.core.registry import CPUDispatcher
from scipy.sparse import csc_array, issparse

from gearmbs.dae.integrators import differences
from gearmbs.dae.integrators.ida import IDA_MAX_ORDER, solve_ida
from gearmbs.dae.integrators.wstiff import solve_wstiff
from gearmbs.dae.linalg.sparse_lu import LUFactors, LUPlan, SingularMatrixError, analyse, factor, new_factors, solve
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult, DenseOutput, Status

METHODS = ("WSTIFF", "GSTIFF", "IDA")
IDA_DEFAULT_OUTPUTS = 201
SET_HERE = ("problem", "t_end", "error_probe")
SETTLING_STEP = 1e-12
SETTLING_SWEEPS = 3
SETTLING_RATIO = 100.0
SETTLING_ROUNDS = 12


def _takes(function: Callable, fewest: int, what: str) -> bool:
    """Return whether ``function`` takes the parameters ``p`` beside its ``fewest`` arguments."""
    inner = function.py_func if isinstance(function, CPUDispatcher) else function
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
        self.callbacks: list[differences.PythonCallback] = []
        self.addresses: dict[int, int] = {}

    def _register(self, slot: int, function: Callable, n_out: int) -> None:
        callback = differences.PythonCallback(function, self.n, n_out, self.errors)
        self.callbacks.append(callback)
        assert callback.address is not None
        self.addresses[slot] = callback.address

    def residual(self, fun: Callable) -> Callable:
        takes_p = _takes(fun, 4, "the residual")
        if isinstance(fun, CPUDispatcher):
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
        if isinstance(jac, CPUDispatcher):
            return differences.adapt_jacobian(jac, takes_p, dense)
        extra = (self.parameters,) if takes_p else ()
        n = self.n

        def call(t, y, yp, cj, vals):
            jac(t, y, yp, cj, vals.reshape((n, n)).T if dense else vals, *extra)

        self._register(differences.JACOBIAN_ADDRESS, call, nnz)
        return differences.python_jacobian

    def events(self, functions: Sequence[Callable]) -> Callable:
        takes_p = [_takes(g, 3, "an event function") for g in functions]
        if all(isinstance(g, CPUDispatcher) for g in functions):
            return differences.adapt_events(list(functions), takes_p)
        extras = [(self.parameters,) if p else () for p in takes_p]

        def call(t, y, yp, _unused, out):
            for i, (g, extra) in enumerate(zip(functions, extras, strict=True)):
                out[i] = g(t, y, yp, *extra)

        self._register(differences.EVENTS_ADDRESS, call, len(functions))
        return differences.python_events

    def probe(self) -> BaseException | None:
        """Return the first exception a callback has raised."""
        return self.errors[0] if self.errors else None


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


def _settle_rates(problem: DAEProblem, span: float) -> None:
    """Set y' of differential unknowns by a few Newton sweeps on a vanishing implicit Euler step.

    Where the values are off the constraints, the sweeps take the jump onto them for a rate, which would hide the
    inconsistency from the check of the start: then the rates stay zero.
    """
    work = np.zeros(problem.work_size)
    tables = (problem.idata, problem.rdata, work)
    moving = problem.differential
    gamma = 1.0 / (SETTLING_STEP * span)
    out = np.empty(problem.n)

    def sweep(gamma: float, factored: tuple[LUPlan, LUFactors]) -> np.ndarray:
        problem.residual(problem.t0, problem.y0, problem.yp0, out, *tables)
        delta = np.empty(problem.n)
        solve(*factored, out, delta)
        return delta[moving]

    tolerance = problem.atol_scale[moving]
    for _ in range(SETTLING_ROUNDS):
        factored = _settling_factors(problem, gamma, tables)
        if factored is None:
            return
        jump = sweep(gamma, factored)
        if (np.abs(jump) <= tolerance).all():
            break
        gamma *= SETTLING_RATIO
    else:
        # the move of a rate shrinks with the step, a jump does not
        return
    problem.yp0[moving] -= gamma * jump
    for _ in range(SETTLING_SWEEPS - 1):
        problem.yp0[moving] -= gamma * sweep(gamma, factored)


def _settling_factors(problem: DAEProblem, gamma: float, tables: tuple) -> tuple[LUPlan, LUFactors] | None:
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


def as_problem(
    fun: Callable,
    t0: float,
    y0: np.ndarray,
    yp0: np.ndarray | None,
    span: float,
    *,
    p: np.ndarray | None = None,
    atol: float | np.ndarray = 1e-8,
    scale: float | np.ndarray = 1.0,
    error_mask: np.ndarray | None = None,
    differential: np.ndarray | None = None,
    jac: Callable | None = None,
    jac_sparsity: Any = None,
    events: Sequence[Callable] = (),
    names: Sequence[str] = (),
) -> tuple[DAEProblem, Callable[[], BaseException | None]]:
    """Turn a user's functions into a `DAEProblem`; parameters as in `solve_dae`.

    Returns
    -------
    problem : DAEProblem
        With ``atol_scale`` set to ``atol``: integrate with ``tol=1``.
    error_probe : callable
        Returns the first exception raised by a Python callback, or None.
    """
    y0 = np.array(y0, dtype=float).ravel()
    n = len(y0)
    if n == 0:
        raise ValueError("y0 is empty")
    parameters = np.array([] if p is None else p, dtype=float).ravel()
    scales = _vector(scale, n, "scale")
    atols = _vector(atol, n, "atol")
    if not (atols > 0).all():
        raise ValueError(f"atol must be positive, is {atols.min():g} for unknown {int(np.argmin(atols))}")
    indptr, indices = _pattern(jac_sparsity, n)
    functions = _UserFunctions(n, parameters)
    residual = functions.residual(fun)
    jacobian = functions.jacobian(jac, residual, len(indices), jac_sparsity is None)
    compiled_events = functions.events(events) if len(events) else None
    least = np.minimum(scales, atols / differences.INCREMENT)
    idata, rdata, work_size = differences.pack_tables(indptr, indices, least, scales, parameters)
    for slot, address in functions.addresses.items():
        idata[slot] = address
    rates = np.zeros(n) if yp0 is None else _vector(yp0, n, "yp0")
    if differential is None:
        differential = np.empty(n, dtype=np.bool_)
        differences.find_differential(residual, float(t0), y0, rates, differential, idata, rdata, np.zeros(work_size))
    else:
        differential = _mask(differential, n, "differential")
    problem = DAEProblem(
        n=n,
        residual=residual,
        jacobian=jacobian,
        indptr=indptr,
        indices=indices,
        idata=idata,
        rdata=rdata,
        work_size=work_size,
        y0=y0,
        yp0=rates,
        error_mask=differential.copy() if error_mask is None else _mask(error_mask, n, "error_mask"),
        atol_scale=atols,
        scale=scales,
        differential=differential,
        t0=float(t0),
        names=list(names),
        events=compiled_events,
        n_events=len(events),
    )
    if not problem.error_mask.any():
        raise ValueError("error_mask leaves no unknown under error control")
    if yp0 is None:
        _settle_rates(problem, span)
    return problem, functions.probe


def _event_rules(events: Sequence[Callable]) -> dict[str, list[int]]:
    """Read scipy's attributes ``direction`` and ``terminal``, and ours ``restart``, from event functions.

    A whole number in ``terminal`` says at which occurrence of the event the run ends, as in scipy.
    """
    direction, action, count = [], [], []
    for g in events:
        attributes = g.py_func if isinstance(g, CPUDispatcher) else g
        direction.append(int(np.sign(getattr(attributes, "direction", 0))))
        terminal = getattr(attributes, "terminal", False)
        if isinstance(terminal, bool | np.bool_):
            terminal = int(terminal)
        if terminal is not None and (terminal != int(terminal) or terminal < 0):
            raise ValueError(
                f"terminal of {getattr(attributes, '__name__', 'an event function')} is {terminal!r}; set True, False, "
                "or the number of the occurrence that ends the run"
            )
        action.append(1 if terminal else 2 if getattr(attributes, "restart", False) else 0)
        count.append(max(1, int(terminal or 0)))
    return {"event_direction": direction, "event_action": action, "event_count": count}


def _check_options(method: str, options: Mapping[str, Any], max_order: int | None, rtol: float) -> None:
    """Refuse options the integrator does not have, and what IDA would pass over or reject in words of its own."""
    solver = solve_ida if method == "IDA" else solve_wstiff
    named = {*inspect.signature(solve_dae).parameters, *SET_HERE}
    known = [name for name in inspect.signature(solver).parameters if name not in named]
    unknown = sorted(set(options) - set(known))
    if unknown:
        raise ValueError(
            f"method={method!r} does not know {', '.join(unknown)}; beside the arguments of solve_dae it takes "
            f"{', '.join(known)}"
        )
    if method == "IDA" and max_order is not None and not 1 <= max_order <= IDA_MAX_ORDER:
        raise ValueError(f"max_order (KMAX) must be 1 to {IDA_MAX_ORDER} for IDA, is {max_order!r}")
    if not (np.isfinite(rtol) and rtol >= 0):
        raise ValueError(f"rtol must not be negative, is {rtol!r}")


def solve_dae(
    fun: Callable | DAEProblem,
    t_span: tuple[float, float],
    y0: np.ndarray | None = None,
    yp0: np.ndarray | None = None,
    *,
    method: str = "WSTIFF",
    rtol: float = 1e-6,
    atol: float | np.ndarray = 1e-8,
    tol: float = 1e-6,
    error_mask: np.ndarray | None = None,
    differential: np.ndarray | None = None,
    jac: Callable | None = None,
    jac_sparsity: Any = None,
    events: Callable | Sequence[Callable] | None = None,
    t_eval: np.ndarray | None = None,
    dense_output: bool = False,
    max_step: float = np.inf,
    first_step: float | None = None,
    min_step: float | None = None,
    max_order: int | None = None,
    p: np.ndarray | None = None,
    scale: float | np.ndarray = 1.0,
    names: Sequence[str] = (),
    **options: Any,
) -> DAEResult:
    """Solve an implicit system G(t, y, y') = 0 of index one or two, or three with an ``error_mask``.

    Mechanical systems with constraints on positions only (index three) fail with the default error control, since the
    error of their velocities does not shrink with the step: put the positions alone under control, or better, write
    the stabilised index-2 form, with the constraints on velocities too and a second set of multipliers.

    Parameters
    ----------
    fun : callable or DAEProblem
        ``fun(t, y, yp, out)`` or ``fun(t, y, yp, out, p)`` writes G into ``out``: compiled by numba (fast, runs without
        the GIL) or plain Python. A `DAEProblem` brings its own initial values, Jacobian, tolerances and events.
    t_span : (float, float)
        Start and end.
    y0, yp0 : array_like, shape (n,)
        Initial values. ``y0`` must satisfy the algebraic equations. Without ``yp0`` the derivatives are worked out.
    method : {"WSTIFF", "GSTIFF", "IDA"}
        Variable-coefficient BDF, fixed-leading-coefficient BDF, or SUNDIALS IDA.
    rtol, atol : float or ndarray
        Local error of unknown i per step: ``atol[i] + rtol * |y[i]|``. Ignored for a `DAEProblem`, which takes ``tol``.
    tol : float
        For a `DAEProblem`: its ``atol_scale`` times this is the absolute tolerance (ADAMS: ERROR).
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
    events : callable or list of callable, optional
        ``g(t, y, yp[, p])`` whose zeros are located. Attributes: ``direction`` (-1, 0, 1), ``terminal`` (True to
        stop there, a number to stop at that occurrence), ``restart`` (land there and start afresh, for
        discontinuities).
    t_eval : array_like, optional
        Output times; default every step.
    dense_output : bool
        Return the interpolant ``sol``. Not with IDA.
    max_step, first_step, min_step, max_order : optional
        HMAX, HINIT, HMIN and KMAX.
    p : array_like, optional
        Parameters handed to ``fun``, ``jac`` and ``events``.
    scale : float or ndarray
        Typical magnitude of the unknowns, for increments and for scaling the Newton matrix.
    names : sequence of str
        Names of the unknowns, for messages.
    **options
        Further options of `gearmbs.dae.integrators.wstiff.solve_wstiff`: ``corrector``, ``breakpoints``,
        ``interpolate``, ...

    Returns
    -------
    DAEResult
        ``y`` has one row for each time. Numerical failures do not raise: see ``status`` and ``message``.

    Raises
    ------
    ValueError
        For arguments that make no sense.

    Examples
    --------
    >>> import numpy as np
    >>> from gearmbs.dae.solve import solve_dae
    >>> def decay(t, y, yp, out):
    ...     out[0] = yp[0] + y[0]
    >>> result = solve_dae(decay, (0.0, 1.0), [1.0], rtol=1e-8, t_eval=[1.0])
    >>> bool(abs(result.y[-1, 0] - np.exp(-1.0)) < 1e-6)
    True
    """
    if method not in METHODS:
        raise ValueError(f"method is {method!r}; choose one of {', '.join(METHODS)}")
    t0, t_end = (float(t) for t in t_span)
    if not (np.isfinite([t0, t_end]).all() and t_end > t0):
        raise ValueError(f"t_span is ({t0:g}, {t_end:g}); it must be two increasing, finite times")
    _check_options(method, options, max_order, rtol)
    probe = None
    if isinstance(fun, DAEProblem):
        if y0 is not None or jac is not None or events is not None:
            raise ValueError("a DAEProblem brings its own y0, jac and events: set them there")
        if fun.t0 != t0:
            raise ValueError(f"t_span starts at {t0:g}, the problem at {fun.t0:g}")
        problem, relative = fun, 0.0
    else:
        if y0 is None:
            raise ValueError("y0 is missing")
        functions = [events] if callable(events) else list(events or ())
        problem, probe = as_problem(
            fun,
            t0,
            y0,
            yp0,
            t_end - t0,
            p=p,
            atol=atol,
            scale=scale,
            error_mask=error_mask,
            differential=differential,
            jac=jac,
            jac_sparsity=jac_sparsity,
            events=functions,
            names=names,
        )
        tol, relative = 1.0, float(rtol)
        if functions:
            options.update(_event_rules(functions))
    if method == "IDA":
        if dense_output or problem.n_events:
            raise ValueError("method='IDA' has neither dense output nor events here; use WSTIFF or GSTIFF")
        limits = {
            "max_order": IDA_MAX_ORDER if max_order is None else max_order,
            "max_step": 0.0 if np.isinf(max_step) else max_step,
            "first_step": first_step or 0.0,
            "min_step": min_step or 0.0,
        }
        return _dispatch_ida(problem, probe, (t0, t_end), t_eval, tol=tol, rtol=relative, **limits, **options)
    return solve_wstiff(
        problem,
        t_eval,
        t_end=t_end,
        tol=tol,
        rtol=relative,
        method=method,
        max_order=6 if max_order is None else max_order,
        max_step=max_step,
        first_step=first_step,
        min_step=min_step,
        dense_output=dense_output,
        error_probe=probe,
        **options,
    )


def _dispatch_ida(
    problem: DAEProblem,
    probe: Callable[[], BaseException | None] | None,
    t_span: tuple[float, float],
    t_eval: np.ndarray | None,
    **options: Any,
) -> DAEResult:
    """Run IDA over ``t_span``; without ``t_eval`` at evenly spaced times."""
    times = np.linspace(*t_span, IDA_DEFAULT_OUTPUTS) if t_eval is None else np.asarray(t_eval, dtype=float)
    if times.ndim != 1 or not times.size:
        raise ValueError(f"t_eval has shape {times.shape}; it must be a list of at least one time")
    if times[0] < t_span[0] or times[-1] > t_span[1]:
        raise ValueError(f"t_eval {times[0]:g} .. {times[-1]:g} leaves t_span")
    padded = times if times[0] == t_span[0] else np.concatenate((t_span[:1], times))
    result = solve_ida(problem, padded, **options)
    if padded is not times:
        result.t, result.y, result.yp = result.t[1:], result.y[1:], result.yp[1:]
    error = probe() if probe is not None else None
    if error is not None:
        result.status = Status.USER_ERROR
        result.message = f"{Status.USER_ERROR.sentence} {type(error).__name__}: {error}"
    return result


__all__ = ["DAEResult", "DenseOutput", "Status", "as_problem", "solve_dae"]
