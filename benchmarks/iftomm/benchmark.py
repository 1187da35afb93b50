"""Run the benchmark problems and say how far off the solutions are."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from benchmarks.iftomm import models, references
from benchmarks.iftomm.references import Published
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism import Mechanism, ModelError


@dataclass(frozen=True)
class Problem:
    """A benchmark problem.

    Attributes
    ----------
    name, measured : str
        What it is called and which quantity is compared.
    mechanism : callable
    end : float
        s.
    quantity : callable
        Solution -> measured quantity, shape (m, k).
    reference : callable or None
        t -> the same by independent equations.
    options : mapping
        How it is integrated, where not by default.
    """

    name: str
    measured: str
    mechanism: Callable[[], Mechanism]
    end: float
    quantity: Callable[[Solution], np.ndarray]
    reference: Callable[[np.ndarray], np.ndarray] | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def published(self) -> tuple[Published, ...]:
        """Numbers of others."""
        return references.PUBLISHED[self.name]


@dataclass(frozen=True)
class Outcome:
    """What a run of a problem gave.

    Attributes
    ----------
    problem : Problem
    solution : Solution
    error : float
        Largest deviation from the independent solution; nan where there is none.
    published : list of (Published, float)
        Each number of others with ours.
    energy : float
        Largest imbalance of the energy, J.
    seconds : float
    """

    problem: Problem
    solution: Solution
    error: float
    published: list[tuple[Published, float]]
    energy: float
    seconds: float


def _tip(body: str, local: tuple[float, float, float]) -> Callable[[Solution], np.ndarray]:
    return lambda s: s.com_position(body) + s.orientation(body) @ np.array(local)


def _crank_angle(s: Solution) -> np.ndarray:
    axes = s.orientation("K1")
    return np.unwrap(np.arctan2(axes[:, 1, 0], axes[:, 0, 0]))[:, None]


def _first_tip(s: Solution) -> np.ndarray:
    return _tip("crank 0", (0.5, 0, 0))(s)[:, :2]


def _mass(s: Solution) -> np.ndarray:
    return s.com_position("mass")[:, :2]


def _height(s: Solution) -> np.ndarray:
    return s.com_position("slider")[:, 2:]


def _slide(s: Solution) -> np.ndarray:
    return s.com_position("slider")[:, :1]


PROBLEMS = {
    p.name: p
    for p in (
        Problem("A01", "x, y of the mass", models.pendulum, 10.0, _mass, references.pendulum),
        Problem("A01 long", "x, y of the mass over 2000 s", models.pendulum, 2000.0, _mass, references.pendulum),
        Problem("A02", "x, y of B0, two windows", models.four_bars, 10.0, _first_tip, references.four_bars),
        # every flat position is singular for velocities and reactions; positions alone are controlled
        Problem(
            "A02 long",
            "x, y of B0, forty windows",
            partial(models.four_bars, 40),
            20.0,
            _first_tip,
            partial(references.four_bars, loops=40),
            {"formulation": "I3"},
        ),
        Problem("A03", "crank angle beta", models.andrews, 0.05, _crank_angle),
        Problem("A04", "x, y, z of P3", models.bricard, 10.0, _tip("rod 2", (0, -0.5, 0)), references.bricard),
        Problem("A05", "height s of the slider", models.governor, 10.0, _height, references.governor),
        Problem("slider crank", "x of the slider", models.slider_crank, 5.0, _slide, references.slider_crank),
    )
}


def run(name: str, *, tol: float = 1e-9, outputs: int = 2000, **options) -> Outcome:
    """Run one problem.

    Parameters
    ----------
    name : {"A01", "A01 long", "A02", "A02 long", "A03", "A04", "A05", "slider crank"}
        The long ones are as the library defines them; the others as they are mostly run.
    tol : float
        Of :func:`gearmbs.mechanism.simulate`.
    outputs : int
        Output steps.
    **options
        Handed to :func:`gearmbs.mechanism.simulate`.

    Raises
    ------
    ModelError
        For an unknown name.
    """
    if name not in PROBLEMS:
        raise ModelError(f"benchmark problem {name!r} is unknown; choose one of {', '.join(PROBLEMS)}")
    problem = PROBLEMS[name]
    inside = [p.t for p in problem.published]
    t = np.unique(np.concatenate([np.linspace(0.0, problem.end, outputs + 1), inside]))
    t = t[np.concatenate([[True], np.diff(t) > 1e-12])]
    start = time.perf_counter()
    solution = problem.mechanism().simulate(problem.end, t_eval=t, tol=tol, **(dict(problem.options) | options))
    seconds = time.perf_counter() - start
    ours = problem.quantity(solution)
    error = float("nan")
    if problem.reference is not None:
        error = float(np.abs(ours - problem.reference(solution.t)).max())
    found = [(p, float(ours[np.argmin(np.abs(solution.t - p.t)), p.component])) for p in problem.published]
    energy = float(np.abs(solution.energy_balance().imbalance).max())
    return Outcome(problem, solution, error, found, energy, seconds)


def table(outcomes: Iterable[Outcome]) -> str:
    """Return the outcomes as text."""
    lines = []
    for o in outcomes:
        p, stats, report = o.problem, o.solution.stats, o.solution.system.report
        lines.append(
            f"{p.name}: {p.measured}, {p.end:g} s, {stats.steps} steps, {o.seconds:.2f} s; "
            f"{len(report.redundant) if report else 0} redundant rows; {o.solution.status.name}"
        )
        if np.isfinite(o.error):
            lines.append(f"    largest deviation from the independent solution   {o.error:.2e}")
        for value, ours in o.published:
            lines.append(
                f"    t = {value.t:<5g} published {value.value:.10g} ({value.digits:g})  ours {ours:.10g}  "
                f"deviation {ours - value.value:+.1e}  [{value.source}]"
            )
        lines.append(f"    energy imbalance at most {o.energy:.1e} J")
    return "\n".join(lines)
