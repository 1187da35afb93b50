"""WSTIFF and GSTIFF: variable-coefficient and fixed-leading-coefficient BDF for DAEs G(t, y, y') = 0.

Coefficients in `bdf`, order and step size in `controller`, the corrector in `corrector`, the step loop in `step`,
the run around it in `driver`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.dae.integrators.driver import Run
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.methods import BDF, INTEGRATORS
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult
from gearmbs.wording import any_of


def solve_wstiff(
    problem: DAEProblem,
    t_eval: np.ndarray | None = None,
    options: Options | None = None,
    *,
    t_end: float | None = None,
    **settings: Any,
) -> DAEResult:
    """Integrate a DAE G(t, y, y') = 0 with variable-coefficient BDF.

    Parameters
    ----------
    problem : DAEProblem
        Equations, tables and consistent initial values.
    t_eval : ndarray, optional
        Output times, increasing, from ``problem.t0`` on. Without it every accepted step is an output.
    options : Options, optional
        With the method "WSTIFF" or "GSTIFF".
    t_end : float, optional
        End of the run; default the last of ``t_eval``. No step goes beyond it.
    **settings
        Single options by name, before those of ``options``: see `gearmbs.dae.Options`.

    Returns
    -------
    DAEResult
        Numerical failures do not raise: look at ``status`` and ``message``; what was computed is kept.

    Raises
    ------
    ValueError
        For arguments that make no sense.
    """
    gathered = Options.gather(settings.pop("method", None), options, settings)
    if gathered.integrator.solver != BDF:
        own = [repr(name) for name, known in INTEGRATORS.items() if known.solver == BDF]
        raise ValueError(f"method is {gathered.method!r}; choose {any_of(own)}")
    return Run(problem, t_eval, t_end, gathered).drive()


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
