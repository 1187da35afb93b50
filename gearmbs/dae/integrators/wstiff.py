"""WSTIFF and GSTIFF: variable-coefficient and fixed-leading-coefficient BDF for DAEs G(t, y, y') = 0.

Coefficients in `bdf`, order and step size in `controller`, the corrector in `corrector`, the step loop in `step`,
the run around it in `driver`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gearmbs.dae.integrators.bdf import MAX_ORDER
from gearmbs.dae.integrators.driver import Run
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult


def solve_wstiff(
    problem: DAEProblem,
    t_eval: np.ndarray | None = None,
    *,
    t_end: float | None = None,
    tol: float = 1e-6,
    rtol: float = 0.0,
    method: str = "WSTIFF",
    corrector: str = "original",
    max_order: int = MAX_ORDER,
    max_step: float = np.inf,
    first_step: float | None = None,
    min_step: float | None = None,
    max_iterations: int = 10,
    interpolate: bool = True,
    breakpoints: Sequence[float] = (),
    event_direction: Sequence[int] | None = None,
    event_action: Sequence[int] | None = None,
    event_count: Sequence[int] | None = None,
    dense_output: bool = False,
    slopes: bool = True,
    max_steps: int | None = None,
    progress: Callable[[float], None] | None = None,
    check_start: bool = True,
    error_probe: Callable[[], BaseException | None] | None = None,
    consumer: Callable[[np.ndarray, np.ndarray, np.ndarray], None] | None = None,
) -> DAEResult:
    """Integrate a DAE G(t, y, y') = 0 with variable-coefficient BDF.

    Parameters
    ----------
    problem : DAEProblem
        Equations, tables and consistent initial values.
    t_eval : ndarray, optional
        Output times, increasing, from ``problem.t0`` on. Without it every accepted step is an output.
    t_end : float, optional
        End of the run; default the last of ``t_eval``. No step goes beyond it.
    tol : float
        Local error per step in units of ``problem.atol_scale`` (ADAMS: ERROR).
    rtol : float
        Relative part: the tolerance of unknown i is ``tol * atol_scale[i] + rtol * |y[i]|``.
    method : {"WSTIFF", "GSTIFF"}
        Variable coefficients, or fixed leading coefficients on a re-interpolated equidistant history.
    corrector : {"original", "modified"}
        Whether the corrector test looks at all unknowns or only at those under error control.
    max_order, max_step, first_step, min_step, max_iterations : optional
        KMAX, HMAX, HINIT, HMIN, MAXIT.
    interpolate : bool
        INTERPOLATE: outputs from the interpolating polynomial (True) or by steps that land on them (False).
    breakpoints : sequence of float
        Known discontinuities: the run lands on each and starts afresh at order one.
    event_direction, event_action : sequence of int, optional
        For each event function: crossings that count (-1 falling, 1 rising, 0 both), and what they do (0 record,
        1 stop, 2 land on the crossing and start afresh).
    event_count : sequence of int, optional
        For each event function that stops the run: at which of its crossings; default the first.
    dense_output : bool
        Keep every step, for ``result.sol``.
    slopes : bool
        Without ``t_eval``: whether y' is wanted too; it costs as much memory as y.
    max_steps : int, optional
        Limit on accepted steps.
    progress : callable, optional
        Called now and then as ``progress(t)``.
    check_start : bool
        Refuse initial values that do not satisfy the equations.
    error_probe : callable, optional
        Returns the exception that a Python callback has stored, or None.
    consumer : callable, optional
        Without ``t_eval``: called as ``consumer(t, y, idata)`` with some accepted steps at a time and the integer table
        valid there, instead of keeping them; the arrays are valid during the call only. The result then holds nothing
        but the last step.

    Returns
    -------
    DAEResult
        Numerical failures do not raise: look at ``status`` and ``message``; what was computed is kept.

    Raises
    ------
    ValueError
        For arguments that make no sense.
    """
    return Run(
        problem,
        t_eval,
        t_end=t_end,
        tol=tol,
        rtol=rtol,
        method=method,
        corrector=corrector,
        max_order=max_order,
        max_step=max_step,
        first_step=first_step,
        min_step=min_step,
        max_iterations=max_iterations,
        interpolate=interpolate,
        breakpoints=breakpoints,
        event_direction=event_direction,
        event_action=event_action,
        event_count=event_count,
        dense_output=dense_output,
        slopes=slopes,
        max_steps=max_steps,
        progress=progress,
        check_start=check_start,
        error_probe=error_probe,
        consumer=consumer,
    ).drive()


def resume(result: DAEResult, *, max_steps: int | None = None) -> DAEResult:
    """Go on with an interrupted run, as if it had never stopped.

    Parameters
    ----------
    result : DAEResult
        With a ``checkpoint``: the run was interrupted, or had reached ``max_steps``.
    max_steps : int, optional
        New limit on accepted steps, counted from the start of the run; default none.

    Returns
    -------
    DAEResult
        The whole run from its start.

    Raises
    ------
    ValueError
        If the result has no checkpoint.
    """
    run = result.checkpoint
    if not isinstance(run, Run):
        raise ValueError(f"this run ended with {result.status.name} and cannot be resumed; start a new one")
    run.state.max_steps = max_steps or 0
    return run.drive()
