"""Speed of the gear cases: ``python -m benchmarks.gear_pair``.

Prints, for each state and integrator, simulated seconds per wall second, steps and evaluations per mesh cycle, and
the shares of residual, Jacobian, factorisation and the rest, estimated from the cost of one call of each.
"""

from __future__ import annotations

import os
import platform
import time

import numpy as np

from gearmbs.dae.sparse_lu import analyse, factor, new_factors
from gearmbs.dae.sparse_lu import solve as substitute
from gearmbs.studies import Case, simulate_case

STATES = {
    "healthy": {},
    "misaligned": {"misalignment": "1 deg"},
    "distance": {"centre_distance_error": "3 mm"},
}
RUNS = (("WSTIFF", 1e-7), ("WSTIFF", 3e-7), ("IDA", 1e-7))
CALLS = 2000
HEADER = (
    "| state | integrator | tolerance | simulated s / wall s | steps | residuals | Jacobians | factorisations "
    "| residual % | Jacobian % | factor and solve % | rest % |"
)


def seconds_per_call(call) -> float:
    """Return the median over five batches of the seconds a call takes."""
    times = []
    for _ in range(5):
        start = time.perf_counter()
        for _ in range(CALLS // 5):
            call()
        times.append((time.perf_counter() - start) / (CALLS // 5))
    return float(np.median(times))


def call_costs(solution) -> tuple[float, float, float, float]:
    """Return the seconds of one residual, Jacobian, factorisation and substitution at the end of a run."""
    p = solution.problem
    y, yp, t = solution.result.y[-1].copy(), solution.result.yp[-1].copy(), float(solution.t[-1])
    out, work, vals = np.zeros(p.n), np.zeros(p.work_size), np.zeros(p.indices.size)
    p.jacobian(t, y, yp, 1e5, vals, p.idata, p.rdata, work)
    plan = analyse(p.indptr, p.indices, vals, p.scale)
    factors = new_factors(plan)
    factor(plan, factors, vals)
    return (
        seconds_per_call(lambda: p.residual(t, y, yp, out, p.idata, p.rdata, work)),
        seconds_per_call(lambda: p.jacobian(t, y, yp, 1e5, vals, p.idata, p.rdata, work)),
        seconds_per_call(lambda: factor(plan, factors, vals)),
        seconds_per_call(lambda: substitute(plan, factors, out, out)),
    )


def main(duration: float = 0.5) -> str:
    """Run all cases and return the table in Markdown."""
    lines = [
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}; "
        "steps and evaluations are per mesh cycle; one core; output evaluation not included",
        "",
        HEADER,
        "|" + "---|" * 12,
    ]
    for state, fault in STATES.items():
        for integrator, tolerance in RUNS:
            case = Case(
                operation={"duration": duration},
                fault=fault,
                solver={"integrator": integrator, "tolerance": tolerance},
            )
            solution = simulate_case(case)
            stats = solution.stats
            span = float(solution.t[-1])
            cycles = span * case.mesh_frequency
            residual, jacobian, factoring, substitution = call_costs(solution)
            shares = [
                stats.residuals * residual,
                stats.jacobians * jacobian,
                stats.factorizations * factoring + stats.solves * substitution,
            ]
            shares = [100.0 * s / stats.wall_time for s in shares]
            shares.append(100.0 - sum(shares))
            counts = [stats.steps, stats.residuals, stats.jacobians, stats.factorizations]
            lines.append(
                f"| {state} | {integrator} | {tolerance:g} | {span / stats.wall_time:.2f} | "
                + " | ".join(f"{c / cycles:.1f}" for c in counts)
                + " | "
                + " | ".join(f"{s:.0f}" for s in shares)
                + " |"
            )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    simulate_case(Case(operation={"duration": 0.01}))
    print(main())
