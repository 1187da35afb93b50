"""Where a step of WSTIFF goes: microseconds a step by part, on a gear pair, Andrews's squeezer and a long chain."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numba import njit

from benchmarks.markdown import number, table
from benchmarks.problems.reference import chain_problem, reference_problems
from benchmarks.timing import seconds_per_call
from gearmbs.dae.integrators import driver, run_state, step
from gearmbs.dae.integrators.corrector import set_weights
from gearmbs.dae.integrators.driver import Run
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.run_state import rows_from
from gearmbs.dae.linalg.sparse_lu import factor, solve
from gearmbs.dae.problem import DAEProblem
from gearmbs.kernels.placed import unbound
from gearmbs.studies import Case, simulate_case

TITLE = "Parts of a step"
GEAR_SPAN = 0.1
GEAR_TOLERANCE = 1e-7
CHAIN_LOOPS = 160
CHAIN_SPAN = 5.0
REPEATS = 7
CALLS = 300


@njit
def _residuals(n, bound, st):
    functions = unbound(bound)
    for _ in range(n):
        functions.residual(st.t, st.y, st.yp, st.res, st.idata, st.rdata, st.work)


@njit
def _jacobians(n, bound, st):
    functions = unbound(bound)
    for _ in range(n):
        functions.jacobian(st.t, st.y, st.yp, st.gamma, st.jac, st.idata, st.rdata, st.work)


@njit
def _factorisations(n, st, plan, factors):
    for _ in range(n):
        factor(plan, factors, st.matrix)


@njit
def _substitutions(n, st, plan, factors):
    for _ in range(n):
        solve(plan, factors, st.res, st.delta)


@njit
def _hooks(n, bound, st):
    functions = unbound(bound)
    for _ in range(n):
        functions.hook(st.t, rows_from(st, 0), st.n_past, st.idata, st.rdata, st.work)


@njit
def _ends(n, st):
    for _ in range(n):
        st.h = st.h_wanted
        step.choose_end(st)


@njit
def _predictions(n, st):
    for _ in range(n):
        step.predict(st)


@njit
def _error_norms(n, st):
    row = rows_from(st, 0)[0]
    for _ in range(n):
        step.correction_norm(st, row)


@njit
def _next_steps(n, st):
    order, h, since_change, noisy = st.order, st.h, st.since_change, st.noisy
    st.noisy = False
    for _ in range(n):
        step.choose_next(st)
        st.order, st.h, st.since_change = order, h, since_change
    st.noisy = noisy


@njit
def _weights(n, st):
    for _ in range(n):
        set_weights(st, st.y, st.step)


def warm(problem: DAEProblem, options: Options, t_end: float) -> Run:
    """Return a run that stands before a step after the first half of its span."""
    run = Run(problem, None, t_end, options)
    failure = driver.begin(run)
    if failure is not None:
        raise RuntimeError(failure[1])
    code = run_state.RUNNING
    while run.state.t < 0.5 * t_end and code >= 0:
        code = step.advance(run.functions, run.state, run.algebraic.part, run.plan, run.factors, 1)
        if code == run_state.REPIVOT:
            run.repivot()
        elif code == run_state.BUFFER_FULL:
            run.records.drain()
        elif code == run_state.PAUSED:
            run.records.change_table()
    return run


def part_costs(run: Run) -> dict[str, float]:
    """Return the seconds a call of each part takes on the state of a run that is under way.

    Parameters
    ----------
    run : Run
        Its state is used up.
    """
    st, functions, plan, factors = run.state, run.functions, run.plan, run.factors
    step.open_step(st)
    step.choose_end(st)
    step.predict(st)
    costs = {
        "residual": seconds_per_call(lambda n: _residuals(n, functions, st), CALLS),
        "Jacobian": seconds_per_call(lambda n: _jacobians(n, functions, st), CALLS // 10),
        "factorisation": seconds_per_call(lambda n: _factorisations(n, st, plan, factors), CALLS // 3),
        "substitution": seconds_per_call(lambda n: _substitutions(n, st, plan, factors), CALLS),
        "end": seconds_per_call(lambda n: _ends(n, st), CALLS),
        "prediction": seconds_per_call(lambda n: _predictions(n, st), CALLS),
        "error norm": seconds_per_call(lambda n: _error_norms(n, st), CALLS),
        "next step": seconds_per_call(lambda n: _next_steps(n, st), CALLS),
        "all weights": seconds_per_call(lambda n: _weights(n, st), CALLS),
    }
    if st.has_hook:
        costs["hook"] = seconds_per_call(lambda n: _hooks(n, functions, st), CALLS)
    return costs


def measure(name: str, problem: DAEProblem, options: Options, t_end: float) -> dict:
    """Time whole runs and the calls of their parts; return microseconds a step.

    Parameters
    ----------
    name : str
    problem : DAEProblem
    options : Options
    t_end : float
        End of the run.
    """
    seconds = []
    for _ in range(REPEATS):
        begin = time.process_time()
        result = Run(problem, np.array([problem.t0, t_end]), t_end, options).drive()
        seconds.append(time.process_time() - begin)
    if not result.success:
        return {"case": name, "failed": result.message}
    stats = result.stats
    attempts = stats.steps + stats.error_rejections + stats.newton_rejections
    costs = part_costs(warm(problem, options, t_end))
    calls = {
        "residual": stats.residuals,
        "Jacobian": stats.jacobians,
        "factorisation": stats.factorizations,
        "substitution": stats.solves,
        "end": attempts,
        "prediction": attempts,
        "error norm": attempts,
        "next step": stats.steps,
        "all weights": attempts if options.rtol > 0.0 or options.corrector == "original" else 0,
        "hook": stats.steps,
    }
    split = {part: 1e6 * costs[part] * calls[part] / stats.steps for part in costs}
    whole = 1e6 * float(np.median(seconds)) / stats.steps
    equations = sum(split[part] for part in ("residual", "Jacobian", "factorisation", "substitution"))
    return {
        "case": name,
        "unknowns": problem.n,
        "steps": stats.steps,
        "us_per_step": whole,
        "split": split,
        "beside_equations": whole - equations,
    }


def gear_pair() -> dict:
    """Measure the healthy pair of the study at 100 N m, as its cases are run."""
    case = Case(operation={"duration": GEAR_SPAN, "torque": "100 N m"})
    solution = simulate_case(case)
    options = Options(tol=GEAR_TOLERANCE, corrector="modified", slopes=False)
    return measure("healthy pair", solution.problem, options, float(solution.t[-1]))


def squeezer() -> dict:
    """Measure Andrews's squeezing mechanism."""
    reference = reference_problems()["Andrews"]
    return measure("Andrews", reference.make("SI2"), Options(tol=1e-7), float(reference.times[-1]))


def chain(loops: int) -> dict:
    """Measure a chain of four-bar linkages."""
    problem = chain_problem(loops, CHAIN_SPAN).make("SI2")
    return measure(f"chain of {loops}", problem, Options(tol=1e-5), CHAIN_SPAN)


def cells(quick: bool) -> list[tuple[str, Callable[[], dict]]]:
    """Return name and measurement of each part."""
    parts: list[tuple[str, Callable[[], dict]]] = [("Andrews", squeezer)]
    if not quick:
        parts += [("healthy pair", gear_pair), ("chain", lambda: chain(CHAIN_LOOPS))]
    return parts


def finish(results: list[dict]) -> dict:
    """Return nothing: the parts say it all."""
    return {}


def render(extra: dict) -> str:
    """Return the table in Markdown."""
    rows = [r for r in extra["results"] if "split" in r]
    names = list(dict.fromkeys(part for r in rows for part in r["split"]))
    header = ["us a step", *(f"{r['case']}, {r['unknowns']} unknowns" for r in rows)]
    lines = [[part, *(number(r["split"][part]) if part in r["split"] else "-" for r in rows)] for part in names]
    lines.append(["beside residual, Jacobian and linear algebra", *(number(r["beside_equations"]) for r in rows)])
    lines.append(["whole step", *(number(r["us_per_step"]) for r in rows)])
    return (
        "Microseconds of a step by part, each timed on its own in a run under way, times its calls; the whole is the "
        "median of whole runs.\n\n" + table(header, lines)
    )
