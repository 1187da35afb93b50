"""The package solve_dae (Radau IIA and BDF in Python) on the same compiled residual and Jacobian."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from benchmarks.methods.base import Callbacks, Method, RunFailed, RunResult, absolute_tolerances, tolerances
from benchmarks.problems.reference import ReferenceProblem

SMALLEST_RTOL = 1e-13
"""What the package accepts; the vector of absolute tolerances does the work, as with IDA."""
DENSE_LIMIT = 150
"""Unknowns up to which dense matrices are the faster ones."""


def _prepare(formulation: str, method: str) -> Callable:
    def prepare(reference: ReferenceProblem) -> Callable[[float], RunResult]:
        from solve_dae.integrate import solve_dae

        problem = reference.make(formulation)
        times = reference.times

        def run(tol: float) -> RunResult:
            calls = Callbacks(problem)

            matrix = calls.sparse if problem.n > DENSE_LIMIT else calls.dense

            def jacobian(t, y, yp):
                by_y = matrix(t, y, yp, 0.0)
                return by_y, matrix(t, y, yp, 1.0) - by_y

            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    solution = solve_dae(
                        calls.residual,
                        (times[0], times[-1]),
                        problem.y0,
                        problem.yp0,
                        method=method,
                        t_eval=times,
                        jac=jacobian,
                        rtol=SMALLEST_RTOL,
                        atol=absolute_tolerances(problem, tol),
                    )
            except (ValueError, RuntimeError, ArithmeticError) as error:
                raise RunFailed(f"{type(error).__name__}: {error}") from error
            if not solution.success or len(solution.t) != len(times):
                raise RunFailed(str(solution.message))
            values = np.ascontiguousarray(solution.y.T[:, reference.columns])
            counts = {"residuals": calls.residuals, "jacobians": calls.jacobians // 2, "factorizations": solution.nlu}
            return RunResult(values, counts)

        return run

    return prepare


def methods() -> list[Method]:
    """Return both methods in the formulations of index one and two."""
    return [
        Method(
            f"solve_dae {method} {form}",
            f"solve_dae {method}",
            "solve-dae",
            _prepare(form, method),
            tolerances(-2, -12),
        )
        for method in ("Radau", "BDF")
        for form in ("SI2", "SI1")
    ]
