"""One call for users: `solve_dae`, in the manner of scipy's ``solve_ivp``, for any DAE and any of our integrators."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt

from gearmbs.dae.integrators.options import OptionKeywords, Options
from gearmbs.dae.methods import those_that
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult, DenseOutput, Status
from gearmbs.dae.user_problem import EquationKeywords, as_problem
from gearmbs.logs import log_run
from gearmbs.progress import time_bar
from gearmbs.wording import any_of

DEFAULT_OUTPUTS = 201
DEFAULT_RTOL = 1e-6
"""Relative tolerance where none is given: six digits, a local error far below that of most data."""
OF_EQUATIONS = ("error_mask", "differential", "jac", "jac_sparsity", "p", "scale", "names")
"""Arguments of `as_problem` that `solve_dae` hands on."""


class SolveKeywords(OptionKeywords, EquationKeywords, total=False):
    """What `solve_dae` takes beside its own arguments, for type checkers."""


def _event_rules(events: Sequence[Callable]) -> dict[str, Any]:
    """Read scipy's attributes ``direction`` and ``terminal``, and ours ``restart``, from event functions.

    A whole number in ``terminal`` says at which occurrence of the event the run ends, as in scipy.
    """
    direction, action, count = [], [], []
    for g in events:
        # of a compiled function they stand on it, or on the Python function that it was made from
        inner = getattr(g, "py_func", g)
        given = {name: getattr(g, name, getattr(inner, name, 0)) for name in ("direction", "terminal", "restart")}
        direction.append(int(np.sign(given["direction"])))
        terminal = given["terminal"]
        if isinstance(terminal, bool | np.bool_):
            terminal = int(terminal)
        if terminal is not None and (terminal != int(terminal) or terminal < 0):
            raise ValueError(
                f"terminal of {getattr(inner, '__name__', 'an event function')} is {terminal!r}; set True, False, "
                "or the number of the occurrence that ends the run"
            )
        action.append(1 if terminal else 2 if given["restart"] else 0)
        count.append(max(1, int(terminal or 0)))
    return {"event_direction": direction, "event_action": action, "event_count": count}


def solve_dae(
    fun: Callable | DAEProblem,
    t_span: tuple[float, float],
    y0: npt.ArrayLike | None = None,
    yp0: npt.ArrayLike | None = None,
    *,
    method: str | None = None,
    rtol: float | None = None,
    atol: npt.ArrayLike = 1e-8,
    events: Callable | Sequence[Callable] | None = None,
    t_eval: npt.ArrayLike | None = None,
    options: Options | None = None,
    **more: Unpack[SolveKeywords],
) -> DAEResult:
    """Solve an implicit system G(t, y, y') = 0 of index one or two, or three with an ``error_mask``.

    Mechanical systems of index three fail with the default error control, since the error of their velocities does not
    shrink with the step: put positions alone under control, or better, write the stabilised index-2 form.

    Parameters
    ----------
    fun : callable or DAEProblem
        ``fun(t, y, yp, out)`` or ``fun(t, y, yp, out, p)`` writes G into ``out``: compiled by numba (fast, runs without
        the GIL) or plain Python. A `DAEProblem` brings its own initial values, Jacobian, tolerances and events.
    t_span : (float, float)
        Start and end.
    y0, yp0 : array_like, shape (n,)
        Initial values. ``y0`` must satisfy the algebraic equations. Without ``yp0`` the derivatives are worked out.
    method : str
        One of `gearmbs.dae.methods.INTEGRATORS`; default "WSTIFF", BDF with variable coefficients.
    rtol, atol : float or ndarray
        Local error of unknown i per step: ``atol[i] + rtol * |y[i]|``; ``rtol`` is 1e-6 by default. Ignored for a
        `DAEProblem`, which takes ``tol``: its ``atol_scale`` times this is the absolute tolerance.
    events : callable or list of callable, optional
        ``g(t, y, yp[, p])`` whose zeros are located. Attributes: ``direction`` (-1, 0, 1), ``terminal`` (True to
        stop there, a number to stop at that occurrence), ``restart`` (land there as on a breakpoint, for
        discontinuities).
    t_eval : array_like, optional
        Output times; default every step. Algebraic unknowns outside error control are solved for there, see
        `gearmbs.dae.integrators.algebraic`; where that is not possible the message says so.
    options : Options, optional
        Settings of the integrator in one object.
    **more
        Single settings of the integrator by name, before those of ``options``, such as ``dense_output``, ``max_step``,
        ``first_step``, ``max_order``, ``breakpoints``: see `gearmbs.dae.Options`. And what else is to be said of the
        equations, see `gearmbs.dae.user_problem.as_problem`: ``error_mask``, ``differential``, ``jac``,
        ``jac_sparsity``, ``p``, ``scale``, ``names``.

    Returns
    -------
    DAEResult
        One row of ``y`` for each time. Numerical failures do not raise: see ``status`` and ``message``.

    Raises
    ------
    ValueError
        For arguments that make no sense.

    Examples
    --------
    >>> from gearmbs.dae import solve_dae
    >>> def decay(t, y, yp, out):
    ...     out[0] = yp[0] + y[0]
    >>> result = solve_dae(decay, (0.0, 1.0), [1.0], rtol=1e-8, t_eval=[1.0])
    >>> round(float(result.y[-1, 0]), 6)
    0.367879
    """
    settings: dict[str, Any] = {**more}
    of_equations = {name: settings.pop(name) for name in OF_EQUATIONS if name in settings}
    chosen = Options.gather(method, options, settings, "beside what is said of the equations ")
    t0, t_end = (float(t) for t in t_span)
    if not (np.isfinite([t0, t_end]).all() and t_end > t0):
        raise ValueError(f"t_span is ({t0:g}, {t_end:g}); it must be two increasing, finite times")
    if isinstance(fun, DAEProblem):
        problem = _checked_problem(fun, t0, y0, events, of_equations)
    else:
        problem, chosen = _posed(fun, (t0, t_end), y0, yp0, rtol, atol, events, of_equations, chosen, options)
    for option, wanted in (("dense_output", chosen.dense_output), ("event_action", bool(problem.n_events))):
        if wanted and not chosen.integrator.can(option):
            others = any_of(those_that(option))
            raise ValueError(f"method={chosen.method!r} has neither dense output nor events here; use {others}")
    with time_bar(chosen.progress, "solving", t0, t_end) as told:
        chosen = replace(chosen, progress=told)
        if chosen.integrator.compiled:
            result = chosen.integrator.load()(problem, t_eval, chosen, t_end=t_end)
        else:
            result = _run_at_outputs(problem, chosen, (t0, t_end), t_eval)
        log_run("dae", f"{problem.n} equations by {chosen.method}", result)
        return result


def _checked_problem(
    problem: DAEProblem, t0: float, y0: npt.ArrayLike | None, events: Any, of_equations: Mapping[str, Any]
) -> DAEProblem:
    """Return the problem; refuse what a DAEProblem says itself."""
    if y0 is not None or of_equations.get("jac") is not None or events is not None:
        raise ValueError("a DAEProblem brings its own y0, jac and events: set them there")
    if problem.t0 != t0:
        raise ValueError(f"t_span starts at {t0:g}, the problem at {problem.t0:g}")
    return problem


def _posed(
    fun: Callable,
    t_span: tuple[float, float],
    y0: npt.ArrayLike | None,
    yp0: npt.ArrayLike | None,
    rtol: float | None,
    atol: npt.ArrayLike,
    events: Callable | Sequence[Callable] | None,
    of_equations: Mapping[str, Any],
    chosen: Options,
    base: Options | None,
) -> tuple[DAEProblem, Options]:
    """Return a user's equations as a problem, and options that fit it.

    Parameters
    ----------
    fun, t_span, y0, yp0, rtol, atol, events
        As in `solve_dae`.
    of_equations : mapping
        Arguments of `as_problem`.
    chosen, base : Options
        All options, and the object among them that may hold ``rtol``.
    """
    if y0 is None:
        raise ValueError("y0 is missing")
    functions = [events] if callable(events) else list(events or ())
    problem, errors = as_problem(
        fun, t_span[0], y0, yp0, t_span[1] - t_span[0], atol=atol, events=functions, **of_equations
    )
    if rtol is None:
        rtol = DEFAULT_RTOL if base is None else base.rtol
    rules: dict[str, Any] = _event_rules(functions) if functions else {}
    return problem, replace(chosen, tol=1.0, rtol=float(rtol), errors=errors, **rules)


def _run_at_outputs(
    problem: DAEProblem, options: Options, t_span: tuple[float, float], t_eval: npt.ArrayLike | None
) -> DAEResult:
    """Run an integrator that wants the start among its outputs; without ``t_eval`` at evenly spaced times."""
    times = np.linspace(*t_span, DEFAULT_OUTPUTS) if t_eval is None else np.asarray(t_eval, dtype=float)
    if times.ndim != 1 or not times.size:
        raise ValueError(f"t_eval has shape {times.shape}; it must be a list of at least one time")
    if times[0] < t_span[0] or times[-1] > t_span[1]:
        raise ValueError(f"t_eval {times[0]:g} .. {times[-1]:g} leaves t_span")
    padded = times if times[0] == t_span[0] else np.concatenate((t_span[:1], times))
    result = options.integrator.load()(problem, padded, options)
    if padded is not times:
        result.t, result.y, result.yp = result.t[1:], result.y[1:], result.yp[1:]
    if options.errors:
        error = options.errors[0]
        result.status = Status.USER_ERROR
        result.message = f"{Status.USER_ERROR.sentence} {type(error).__name__}: {error}"
    return result


__all__ = ["DAEResult", "DenseOutput", "Status", "as_problem", "solve_dae"]
