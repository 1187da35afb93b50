"""The tables of integrators and of formulations: what each is, takes and can do.

Checks of names and options, messages, help texts and the documentation follow from it. It is light: an integrator's
module is loaded with its first run.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Integrator:
    """One integrator.

    Parameters
    ----------
    words : str
        What it is, for the documentation.
    solver : str
        ``"module:function"``, called as ``function(problem, t_eval, options, t_end=...)``; see
        `gearmbs.dae.integrators.wstiff.solve_wstiff`.
    takes : tuple of str, optional
        Fields of `gearmbs.dae.Options` that it takes; default all.
    highest_order : int
        Order it goes up to.
    most_iterations : float
        Largest number of iterations of the corrector that can be asked for.
    compiled : bool
        Whether whole runs are compiled and free of the interpreter's lock, as those of
        `gearmbs.dae.integrators.driver`. Others want the start among their output times, choose themselves what is
        given as zero, and leave errors of functions in Python to their caller.
    tolerance, largest_tolerance : float
        Local error a step that studies of forced vibration take by default, and the largest that they accept.
    adams : tuple of str
        What ADAMS calls it.
    """

    words: str
    solver: str
    takes: tuple[str, ...] | None = None
    highest_order: int
    most_iterations: float = 100
    compiled: bool = True
    tolerance: float
    largest_tolerance: float
    adams: tuple[str, ...] = ()

    def load(self) -> Callable:
        """Load its module, and with it its kernels, and return the function that integrates."""
        module, _, name = self.solver.partition(":")
        return getattr(importlib.import_module(module), name)

    def can(self, option: str) -> bool:
        """Return whether it takes an option of `gearmbs.dae.Options`."""
        return self.takes is None or option in self.takes


BDF = "gearmbs.dae.integrators.wstiff:solve_wstiff"

INTEGRATORS: dict[str, Integrator] = {
    "WSTIFF": Integrator(
        words="BDF with variable coefficients",
        solver=BDF,
        highest_order=6,
        tolerance=1e-7,
        largest_tolerance=5e-6,
        adams=("WSTIFF",),
    ),
    "GSTIFF": Integrator(
        words="BDF with fixed leading coefficients, on a history interpolated to equal steps",
        solver=BDF,
        highest_order=6,
        tolerance=1e-7,
        largest_tolerance=5e-6,
        adams=("GSTIFF", "SI2_GSTIFF"),
    ),
    "IDA": Integrator(
        words="IDA of SUNDIALS",
        solver="gearmbs.dae.integrators.ida:solve_ida",
        takes=(
            "tol",
            "rtol",
            "max_order",
            "max_step",
            "first_step",
            "min_step",
            "max_iterations",
            "max_steps",
            "breakpoints",
            "progress",
        ),
        highest_order=5,
        most_iterations=math.inf,
        compiled=False,
        # at the same tolerance it makes ten times the error of the others
        tolerance=1e-8,
        largest_tolerance=1e-6,
    ),
}
DEFAULT = "WSTIFF"
"""The integrator where none is named."""


@dataclass(frozen=True, kw_only=True)
class Formulation:
    """One way of writing the constraints into the equations of motion.

    Parameters
    ----------
    words : str
        What it is, for the documentation.
    number : int
        In the tables of the kernels, which take from `gearmbs.dae.equations.unknowns` what it chooses.
    adams : str
        What message files of ADAMS call it.
    """

    words: str
    number: int
    adams: str


FORMULATIONS: dict[str, Formulation] = {
    "I3": Formulation(words="index 3: positions alone are constrained", number=0, adams="INDEX-3"),
    "SI2": Formulation(
        words="stabilised index 2: positions and velocities are constrained", number=1, adams="stabilized INDEX-2"
    ),
    "SI1": Formulation(
        words="stabilised index 1: as SI2, the multipliers being derivatives of unknowns",
        number=2,
        adams="stabilized INDEX-1",
    ),
}


def those_that(can: str) -> list[str]:
    """Return the integrators that take an option of `gearmbs.dae.Options`."""
    return [name for name, integrator in INTEGRATORS.items() if integrator.can(can)]


def integrators_table() -> str:
    """Return the integrators with their orders, abilities and tolerances, as a Markdown table."""
    rows = ["| integrator | what it is | order | events, dense output | whole runs compiled | tolerance of studies |"]
    rows.append("|---|---|---|---|---|---|")
    for name, known in INTEGRATORS.items():
        able = "yes" if known.can("event_action") and known.can("dense_output") else "no"
        compiled = "yes" if known.compiled else "no"
        bounds = f"{known.tolerance:g}, at most {known.largest_tolerance:g}"
        default = " (default)" if name == DEFAULT else ""
        rows.append(f"| `{name}`{default} | {known.words} | {known.highest_order} | {able} | {compiled} | {bounds} |")
    return "\n".join(rows)


def formulations_table() -> str:
    """Return the formulations as a Markdown table."""
    rows = ["| formulation | what it is | in message files |", "|---|---|---|"]
    rows += [f"| `{name}` | {known.words} | {known.adams} |" for name, known in FORMULATIONS.items()]
    return "\n".join(rows)
