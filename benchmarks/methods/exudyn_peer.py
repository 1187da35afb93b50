"""Exudyn: its own models of the same problems, generalised alpha and trapezoidal rule with a fixed step."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable

import numpy as np

from benchmarks.methods.base import Method, NotPossible, RunFailed, RunResult, assign
from benchmarks.methods.exudyn_models import MODELS, Model, four_bar_chain
from benchmarks.problems.reference import ReferenceProblem

SOLVERS = ("generalized alpha", "trapezoidal index 2")
SPARSE_FROM = 8
"""Bodies from which the sparse solver is the faster one."""
SMALLEST_PART = 64
"""Where its Newton iteration fails it may shorten a step so many times; left alone it goes on for minutes."""
REASONS = {
    "car axis": "its moving base would need a Python function in every step",
    "Andrews": "no model of its relative angles is provided here",
}


def model_of(reference: ReferenceProblem) -> Model:
    """Return the Exudyn model of a standard problem."""
    name = reference.name
    if name.startswith("four-bar chain"):
        return four_bar_chain(int(name.rpartition("=")[2]))
    if name not in MODELS:
        raise NotPossible(REASONS.get(name, "there is no Exudyn model of it here"))
    return MODELS[name](0)


def simulate(model: Model, t_end: float, steps: int, solver: str, sparse: bool) -> dict[str, int]:
    """Run a fresh simulation of an assembled model and return its counts.

    Raises
    ------
    RunFailed
        If Exudyn gives up.
    """
    exu, mbs = model.exu, model.mbs
    settings = exu.SimulationSettings()
    integration = {
        "numberOfSteps": steps,
        "endTime": t_end,
        "minimumStepSize": t_end / steps / SMALLEST_PART,
        "newton.useModifiedNewton": True,
        "verboseMode": 0,
    }
    assign(settings.timeIntegration, integration)
    assign(settings.solution, {"file.write": False, "sensors.writePeriod": model.grid, "sensors.active": True})
    assign(settings, {"parallel.numberOfThreads": 1, "show.statistics": False})
    kinds = exu.LinearSolverType
    assign(settings, {"linearSolver.solverType": kinds.EigenSparse if sparse else kinds.EXUdense})
    kind = exu.DynamicSolverType.GeneralizedAlpha
    if solver == "trapezoidal index 2":
        kind = exu.DynamicSolverType.TrapezoidalIndex2
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            mbs.SolveDynamic(settings, solverType=kind, showHints=False, showCausingItems=False)
    except exu.SolverError as error:
        raise RunFailed(str(error).partition("\n")[0]) from error
    return {"steps": steps}


def _prepare(solver: str) -> Callable:
    def prepare(reference: ReferenceProblem) -> Callable[[float], RunResult]:
        model = model_of(reference)
        t_end = float(reference.times[-1])
        periods = round(t_end / model.grid)

        def run(steps_a_period: float) -> RunResult:
            counts = simulate(model, t_end, periods * int(steps_a_period), solver, model.bodies >= SPARSE_FROM)
            values = model.values(reference.times)
            if not np.isfinite(values).all():
                raise RunFailed("the solution is not finite")
            return RunResult(values, counts)

        return run

    return prepare


def methods() -> list[Method]:
    """Return both solvers; the knob is the number of steps between stored outputs."""
    knobs = tuple(float(round(10 * 2 ** (k / 1.0))) for k in range(12))
    return [
        Method(f"Exudyn {solver}", "Exudyn", "exudyn", _prepare(solver), knobs, "steps per output")
        for solver in SOLVERS
    ]
