"""A run taken step by step, to look into its state in between."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators import driver
from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.integrators.driver import Run
from gearmbs.dae.integrators.newton_matrix import form_matrix as _form_matrix
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.step import advance
from gearmbs.dae.integrators.step import deliver as _deliver
from gearmbs.dae.integrators.step import solve_step as _solve_step
from gearmbs.dae.problem import DAEProblem
from gearmbs.kernels.jit import njit
from gearmbs.kernels.placed import unbound


def started(problem: DAEProblem, t_eval: np.ndarray | None = None, t_end: float | None = None, **settings) -> Run:
    """Return a run that stands at its start, with pivots chosen."""
    run = Run(problem, t_eval, t_end, Options(**settings))
    failure = driver.begin(run)
    assert failure is None, failure
    return run


def take_step(run: Run) -> int:
    """Take one accepted step, with the help of Python where it is needed; return the code of the loop."""
    while True:
        code = advance(run.functions, run.state, run.algebraic.part, run.plan, run.factors, 1)
        if code == s.REPIVOT:
            assert run.repivot() is None
        elif code == s.BUFFER_FULL:
            run.records.drain()
        else:
            return code


# Parts of a step that take the four functions of a problem, for runs that know them by their addresses.


@njit(cache=True, nogil=True, error_model="numpy")
def form_matrix(bound, st, plan, factors):
    """Form the matrix of the step that is open."""
    return _form_matrix(unbound(bound), st, plan, factors)


@njit(cache=True, nogil=True, error_model="numpy")
def solve_step(bound, st, plan, factors):
    """Solve the equations of the step that is open."""
    return _solve_step(unbound(bound), st, plan, factors)


@njit(cache=True, nogil=True, error_model="numpy")
def deliver(bound, st, part):
    """Deliver an accepted step to the records."""
    return _deliver(unbound(bound), st, part)
