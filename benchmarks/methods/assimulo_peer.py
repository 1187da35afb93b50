"""Assimulo's IDA and Radau5DAE on the same compiled residual and, where the method takes one, Jacobian."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable

import numpy as np

from benchmarks.methods.base import (
    Callbacks,
    Method,
    NotPossible,
    RunFailed,
    RunResult,
    absolute_tolerances,
    assign,
    tolerances,
)
from benchmarks.problems.reference import ReferenceProblem

SMALLEST_RTOL = 1e-13
MAX_STEPS = 200_000
LARGEST = 1500
QUIET = 50


def _prepare(formulation: str, solver_name: str) -> Callable:
    def prepare(reference: ReferenceProblem) -> Callable[[float], RunResult]:
        with contextlib.redirect_stdout(io.StringIO()):
            from assimulo import solvers
            from assimulo.problem import Implicit_Problem

        problem = reference.make(formulation)
        if problem.n > LARGEST:
            raise NotPossible(f"its matrices are dense: {problem.n} unknowns take minutes a run")
        times = reference.times

        def run(tol: float) -> RunResult:
            calls = Callbacks(problem)
            model = Implicit_Problem(calls.residual, problem.y0, problem.yp0, float(times[0]))
            model.jac = lambda c, t, y, yd: calls.dense(t, y, yd, c)
            assign(model, {"algvar": problem.error_mask.astype(float).tolist()})
            solver = getattr(solvers, solver_name)(model)
            tight = {"rtol": SMALLEST_RTOL, "atol": absolute_tolerances(problem, tol)}
            assign(solver, {**tight, "verbosity": QUIET, "maxsteps": MAX_STEPS})
            if solver_name == "IDA":
                assign(solver, {"suppress_alg": True})
            try:
                t, y, _ = solver.simulate(float(times[-1]), 0, times[1:].tolist())
            except Exception as error:
                raise RunFailed(f"{type(error).__name__}: {error}") from error
            t, y = np.asarray(t), np.asarray(y)
            rows = np.searchsorted(t, times - 1e-12 * times[-1])
            if rows[-1] >= len(t) or np.abs(t[rows] - times).max() > 1e-9 * times[-1]:
                raise RunFailed(f"the run ended at t = {t[-1]:.6g}")
            counts = {
                "steps": int(solver.statistics["nsteps"]),
                "residuals": calls.residuals,
                "jacobians": int(solver.statistics["njacs"]),
            }
            return RunResult(y[rows][:, reference.columns], counts)

        return run

    return prepare


def methods() -> list[Method]:
    """Return IDA and Radau5DAE in the formulations of index one and two."""
    return [
        Method(
            f"Assimulo {name} {form}", f"Assimulo {name}", "assimulo-testing", _prepare(form, name), tolerances(-3, -12)
        )
        for name in ("IDA", "Radau5DAE")
        for form in ("SI2", "SI1")
    ]
