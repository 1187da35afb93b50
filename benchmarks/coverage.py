"""How often intervals of an identification on the gear pair hold the truth: ``python -m benchmarks.coverage FOLDER``.

A table is the mesh harmonics of a pair of known penetration, stiffness and friction at two loads, two components of the
force and three harmonics, each with 2 % of noise of its own. The fit knows nothing of the truth but begins there, which
saves simulations: where the search ends does not depend on it.

Two hundred shares scatter by 1.5 %, five hundred by 1 %, whoever estimates. So that chance is told from fault, the same
noise goes through the exact theory, too: with the derivatives at the truth the estimate's error is (J'J)^-1 J' times
the noise, normal with exactly the covariance that the intervals are made of, and held by 95 % of them. The share of the
fits less that of the theory on the same tables, plus 95 %, is the coverage with most of the chance taken out.
"""

from __future__ import annotations

import argparse
import copy
from functools import cache
from pathlib import Path

import numpy as np

from gearmbs.identify import CaseProblem, Free
from gearmbs.studies import Case

NOISE = 0.02
TORQUES = {"low": 100.0, "high": 200.0}
COMPONENTS = ("line_of_action", "line_of_centres")
"""The other two components are combinations of these, and would not be independent."""

TRUTH = {"contact.depth": 1e-4, "contact.stiffness": 2.9852e5 * 1000.0**1.3, "friction.dynamic": 0.05}


@cache
def _exact() -> tuple[CaseProblem, np.ndarray]:
    """Return a problem that knows the simulations about the truth, which all tables share, and the exact values."""
    import pandas as pd

    cases = {name: Case(operation={"torque": torque}) for name, torque in TORQUES.items()}
    free = [Free(name, value) for name, value in TRUTH.items()]
    free[2] = Free("friction.dynamic", TRUTH["friction.dynamic"], also={"friction.static": 2.0})
    rows = [(case, c, k, 1.0, NOISE) for case in cases for c in COMPONENTS for k in (1, 2, 3)]
    table = pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"])
    problem = CaseProblem(table, cases, free, way="orders")
    problem.derivatives()
    return problem, problem.predictions([np.array(list(TRUTH.values()))])[0]


def recovered(seed: int) -> dict[str, float]:
    """Return whether the 95 % intervals of a noisy table hold the truth, and how far off the values are."""
    known, exact = _exact()
    noise = np.random.default_rng([17, int(seed)]).standard_normal(exact.size)
    problem = copy.copy(known)
    problem.table = known.table.assign(value=np.exp(exact + NOISE * noise))
    problem._known, problem._slopes = dict(known._known), dict(known._slopes)
    problem.notes = []
    fit = problem.fit()
    matrix = known.derivatives()
    covariance = np.linalg.inv(matrix.T @ matrix)
    ideal = covariance @ matrix.T @ noise / np.sqrt(np.diag(covariance))
    found: dict[str, float] = {"simulations": float(problem.simulations - known.simulations)}
    for k, (name, value) in enumerate(TRUTH.items()):
        low, high = fit.interval(name)
        found[f"ideal.{name}"] = float(ideal[k])
        found[f"held.{name}"] = float(low <= value <= high)
        found[f"off.{name}"] = float(np.log(fit[name] / value) / (fit.errors[fit.names.index(name)] / fit[name]))
    return found


def main(folder: Path, tables: int = 200, workers: int = 2, first: int = 0) -> None:
    """Run the fits as a campaign and print the shares."""
    from scipy.stats import norm

    from gearmbs.campaigns import Campaign, FunctionSubject, make_plan
    from gearmbs.campaigns.sobol_bounds import probability

    subject = FunctionSubject("benchmarks.coverage:recovered", {"seed": 0})
    rows = [{"seed": k} for k in range(first, first + tables)]
    campaign = Campaign(folder, make_plan(subject, (), "list", options={"rows": rows}, unit=10))
    print(campaign.run(workers))
    table = campaign.table
    for name in TRUTH:
        share, low, high = probability(table[f"held.{name}"].to_numpy())
        spread = table[f"off.{name}"].std()
        print(f"{name}: {share:.1%} of the intervals hold the truth ({low:.1%} to {high:.1%}), deviation {spread:.3f}")
        ideal = table[f"ideal.{name}"]
        theory = (ideal.abs() < norm.ppf(0.975)).mean()
        apart = (table[f"off.{name}"] - ideal).std()
        print(
            f"    exact theory on the same noise {theory:.1%}, deviation {ideal.std():.3f}; the fits differ from it "
            f"by {apart:.3f} standard errors; coverage without that chance {share - theory + 0.95:.1%}"
        )
    held = table[[f"held.{name}" for name in TRUTH]].to_numpy()
    print(f"all: {held.mean():.1%}; {table.simulations.mean():.0f} new simulations a table")
    print(f"{campaign.status().processor_seconds:.0f} s of processor time")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.coverage", description=(__doc__ or "").partition(":")[0]
    )
    parser.add_argument("folder", type=Path, help="of the campaign")
    for name, default, about in (("tables", 200, "that are fitted"), ("workers", 2, "processes"), ("first", 0, "seed")):
        parser.add_argument(name, type=int, nargs="?", default=default, help=f"{about} (%(default)s)")
    asked = parser.parse_args()
    main(asked.folder, asked.tables, asked.workers, asked.first)
