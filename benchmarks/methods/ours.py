"""WSTIFF and GSTIFF, and IDA through scikit-sundae with compiled residual and Jacobian."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.methods.base import Method, RunFailed, RunResult, tolerances
from benchmarks.problems.reference import ReferenceProblem
from gearmbs.dae.integrators.ida import solve_ida
from gearmbs.dae.integrators.wstiff import solve_wstiff
from gearmbs.dae.result import DAEResult


def _result(reference: ReferenceProblem, result: DAEResult) -> RunResult:
    if not result.success:
        raise RunFailed(result.message)
    stats = result.stats
    counts = {name: getattr(stats, name) for name in ("steps", "residuals", "jacobians", "factorizations")}
    return RunResult(result.y[:, reference.columns], counts)


def _bdf(formulation: str, method: str) -> Callable:
    def prepare(reference: ReferenceProblem) -> Callable[[float], RunResult]:
        problem = reference.make(formulation)

        def run(tol: float) -> RunResult:
            return _result(reference, solve_wstiff(problem, reference.times, tol=tol, method=method))

        return run

    return prepare


def _ida(formulation: str) -> Callable:
    def prepare(reference: ReferenceProblem) -> Callable[[float], RunResult]:
        problem = reference.make(formulation)

        def run(tol: float) -> RunResult:
            return _result(reference, solve_ida(problem, reference.times, tol=tol))

        return run

    return prepare


def methods() -> list[Method]:
    """Return our integrators in their formulations."""
    sweep = tolerances(-3, -12)
    return [
        *(Method(f"WSTIFF {form}", "WSTIFF", None, _bdf(form, "WSTIFF"), sweep) for form in ("SI2", "SI1", "I3")),
        Method("GSTIFF SI2", "GSTIFF", None, _bdf("SI2", "GSTIFF"), sweep),
        *(Method(f"IDA {form}", "IDA (scikit-sundae)", "scikit-sundae", _ida(form), sweep) for form in ("SI2", "SI1")),
    ]
