"""Sentences for the modeller about how a run ended."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.dae.problem import EPS, DAEProblem
from gearmbs.dae.result import Status

WINDOW = 50_000
"""Steps that are looked at together by `gearmbs.dae.integrators.driver.StallWatch`."""


class Chatter(NamedTuple):
    """An unknown that stays where its rate jumps.

    Attributes
    ----------
    unknown : int
    place : float
        Where it stays.
    low, high : float
        Between which its rate jumps.
    """

    unknown: int
    place: float
    low: float
    high: float


NAMES_SHOWN = 6
NOISE_WORTH_TELLING = 0.1
"""Movement by rounding, in units of the tolerance, from which on rounding is named as a cause."""

ENDS = (
    "The solution seems to end there, as at a fold, where two branches meet; end the run before, or see whether the "
    "equation is the one that is meant."
)
"""Advice on equations without a solution on the branch that was followed."""

ADVICE = {
    Status.NOT_FINITE: (
        "Look for a division by zero, the root or logarithm of a negative number, or a table that ends there."
    ),
    Status.STEP_TOO_SMALL: "Look for a discontinuity there, loosen its tolerance, or lower min_step (HMIN).",
    Status.NEWTON_FAILURE: (
        "Check the Jacobian if it is your own, look for a discontinuity, or try corrector='modified'."
    ),
    Status.TOO_MANY_REJECTIONS: (
        "The equations may jump there: use an event or a breakpoint at the jump, or loosen the tolerance of that "
        "unknown."
    ),
    Status.TOO_MANY_STEPS: "Raise max_steps or loosen the tolerance.",
    Status.STALLED: (
        "The equations may have no solution beyond this time, or jump there; look at the unknown named, or end the run "
        "before."
    ),
    Status.INCONSISTENT_START: (
        "Make positions and velocities satisfy the constraints before the run, or pass check_start=False to let the "
        "first step repair them."
    ),
    Status.SOLVER_FAILURE: (
        "Try a looser tolerance, a smaller maximum step, a smoother start, or the WSTIFF integrator."
    ),
}
"""What to try, for those who write the equations; others bring their own in `DAEProblem.advice`."""


def advice(problem: DAEProblem, status: Status) -> str:
    """Return what to try after a failure, in the words of whoever states the problem."""
    return problem.advice.get(status, ADVICE[status])


def unknown_name(problem: DAEProblem, index: int) -> str:
    """Return the name of unknown ``index``, or ``y[index]``."""
    if 0 <= index < len(problem.names):
        return problem.names[index]
    return f"y[{index}]"


def list_names(problem: DAEProblem, indices: np.ndarray) -> str:
    """Return the names of the first few unknowns, and how many there are besides."""
    names = [unknown_name(problem, int(i)) for i in indices[:NAMES_SHOWN]]
    more = len(indices) - len(names)
    return ", ".join(names) + (f" and {more} more" if more > 0 else "")


def singular(problem: DAEProblem, t: float, rows: np.ndarray, cols: np.ndarray) -> str:
    """Explain a singular Newton matrix by the unknowns that no equation determines."""
    return (
        f"{Status.SINGULAR_JACOBIAN.sentence} At t = {t:.9g} nothing determines {list_names(problem, cols)} "
        f"(left-over equations: {_list_indices(rows)}). Check for redundant or conflicting constraints, for a part "
        "without mass or inertia that is free to move, and for an unknown that appears in no equation."
    )


def _list_indices(rows: np.ndarray) -> str:
    shown = ", ".join(str(int(r)) for r in rows[:NAMES_SHOWN])
    return shown + (", ..." if len(rows) > NAMES_SHOWN else "")


def _of_constraint(problem: DAEProblem, row: int) -> str:
    """Return the name of the constraint that an equation is, "" for another one."""
    name = problem.names[row] if row < len(problem.names) else ""
    kind, opened, rest = name.partition("(")
    return f", '{rest[:-1]}'," if kind in ("lambda", "mu") and opened and rest.endswith(")") else ""


def inconsistent(problem: DAEProblem, t: float, worst: int, row: int, jump: float) -> str:
    """Explain initial values that do not satisfy the equations."""
    return (
        f"{Status.INCONSISTENT_START.sentence} At t = {t:.9g} {unknown_name(problem, worst)} would have to jump by "
        f"about {jump:.3g} in the first instant; equation {row}{_of_constraint(problem, row)} is violated most. "
        f"{advice(problem, Status.INCONSISTENT_START)}"
    )


def repaired_start(problem: DAEProblem, unknowns: np.ndarray, moves: np.ndarray) -> str:
    """Say how far ``check_start=False`` has moved the initial values."""
    listed = ", ".join(f"{unknown_name(problem, int(i))} by {moves[i]:.3g}" for i in unknowns[:NAMES_SHOWN])
    more = len(unknowns) - NAMES_SHOWN
    return f" The initial values were moved onto the equations: {listed}{f' and {more} more' if more > 0 else ''}."


def not_repaired(problem: DAEProblem, t: float, worst: int) -> str:
    """Explain initial values that Newton's method does not bring onto the equations."""
    return (
        f"{Status.INCONSISTENT_START.sentence} At t = {t:.9g} Newton's method does not bring them onto the equations "
        f"either; the largest correction is in {unknown_name(problem, worst)}. Give values that satisfy the equations."
    )


def moved_rates(problem: DAEProblem, unknowns: np.ndarray, given: np.ndarray) -> str:
    """Say which given rates did not satisfy the equations and what took their place, or nothing if there are none."""
    if not len(unknowns):
        return ""
    shown = unknowns[:NAMES_SHOWN]
    listed = ", ".join(f"{unknown_name(problem, int(i))}' from {given[i]:.6g} to {problem.yp0[i]:.6g}" for i in shown)
    more = len(unknowns) - len(shown)
    return f" Initial rates were moved onto the equations: {listed}{f' and {more} more' if more > 0 else ''}."


def replaced_start(problem: DAEProblem, unknowns: np.ndarray) -> str:
    """Say which algebraic unknowns did not start on their equations, or nothing if there are none."""
    if not len(unknowns):
        return ""
    return (
        f" Initial values of algebraic unknowns did not satisfy the equations: {list_names(problem, unknowns)}. The "
        "run replaced them in its first step; an output at the start holds them as given unless they could be "
        "solved for there."
    )


def not_finite(problem: DAEProblem, t: float, row: int, what: str = "equation") -> str:
    """Explain NaN or infinity out of a user's function."""
    named = f" ({problem.names[row]})" if 0 <= row < len(problem.names) else ""
    return (
        f"{Status.NOT_FINITE.sentence} Near t = {t:.9g} {what} {row}{named} is NaN or infinite, and smaller steps did "
        f"not help. {advice(problem, Status.NOT_FINITE)}"
    )


def event_not_finite(problem: DAEProblem, t: float, which: int) -> str:
    """Explain NaN or infinity out of an event function."""
    return (
        f"{Status.NOT_FINITE.sentence} At t = {t:.9g} event function {which} is NaN or infinite, so that its crossings "
        f"cannot be seen. {advice(problem, Status.NOT_FINITE)}"
    )


def _rounding(noise: float) -> str:
    """Say that double precision does not allow the tolerance, where it does not."""
    if noise < NOISE_WORTH_TELLING:
        return ""
    return (
        f" Rounding alone moves the solution there by about {noise:.2g} times its tolerance: the position is nearly "
        "singular, or the tolerance too tight for double precision, and a looser one is all that helps."
    )


def step_too_small(
    problem: DAEProblem, t: float, h: float, worst: int, error: float, noise: float = 0.0, ends: str = ""
) -> str:
    """Explain a run that would need steps below HMIN."""
    what = f"; the error is dominated by {unknown_name(problem, worst)} ({error:.3g} times its tolerance)"
    return (
        f"{Status.STEP_TOO_SMALL.sentence} At t = {t:.9g} with h = {h:.3g}{what if error > 0.0 else ''}."
        f"{_rounding(noise)} {ends or advice(problem, Status.STEP_TOO_SMALL)}"
    )


def newton(problem: DAEProblem, t: float, h: float, worst: int, noise: float = 0.0, ends: str = "") -> str:
    """Explain a corrector that fails at the smallest step."""
    return (
        f"{Status.NEWTON_FAILURE.sentence} At t = {t:.9g} with h = {h:.3g}; the largest correction is in "
        f"{unknown_name(problem, worst)}.{_rounding(noise)} {ends or advice(problem, Status.NEWTON_FAILURE)}"
    )


def too_many_rejections(problem: DAEProblem, t: float, h: float, worst: int, noise: float = 0.0, ends: str = "") -> str:
    """Explain a step that was refused again and again."""
    return (
        f"{Status.TOO_MANY_REJECTIONS.sentence} At t = {t:.9g} with h = {h:.3g}, mostly because of "
        f"{unknown_name(problem, worst)}.{_rounding(noise)} {ends or advice(problem, Status.TOO_MANY_REJECTIONS)}"
    )


def equation_name(problem: DAEProblem, row: int) -> str:
    """Return what equation ``row`` goes by: its index, and the name of the unknown that stands for it."""
    return f"equation {row}" + (f" ({problem.names[row]})" if 0 <= row < len(problem.names) else "")


def solution_ends(problem: DAEProblem, row: int, violation: float) -> str:
    """Explain an equation that cannot be satisfied any more, or nothing if all hold."""
    if row < 0 or not violation > 1.0:
        return ""
    times = f"{violation:.2g} times" if np.isfinite(violation) else "infinitely more than"
    name = equation_name(problem, row)
    return (
        f"{name[0].upper()}{name[1:]} is not satisfied beyond that time, however short the step: its residual is "
        f"{times} what tolerances and rounding explain. {ENDS}"
    )


def no_solution(problem: DAEProblem, row: int) -> str:
    """Explain Newton's method that finds nothing beyond a time, though what it leaves is small."""
    return (
        f"Beyond that time Newton's method finds no solution, however short the step, because of "
        f"{equation_name(problem, row)}. {ENDS}"
    )


def branch_ends(problem: DAEProblem, unknown: int, before: float, after: float) -> str:
    """Explain an unknown that would have to jump though its equation does not."""
    return (
        f"{unknown_name(problem, unknown)} would jump from {before:.6g} to {after:.6g}, another branch of an equation "
        f"that does not jump. {ENDS}"
    )


def passes_pole(problem: DAEProblem, unknown: int, place: float) -> str:
    """Explain a rate with a pole, at which a solution ends from either side."""
    name = unknown_name(problem, unknown)
    return (
        f"The rate of {name} has a pole near {name} = {place:.6g} and points at it from both sides, so that no "
        f"solution goes on from there. {ENDS}"
    )


def index_changes(after: float, before: float) -> str:
    """Explain a matrix pencil that becomes singular just beyond ``after``, or until ``before``."""
    where = f"just beyond t = {after:.9g}" if after == before else f"between t = {after:.9g} and {before:.9g}"
    return (
        f"{Status.SINGULAR_JACOBIAN.sentence} The determinant of dG/dy + gamma dG/dy' changes its sign {where}: the "
        "factor of a derivative passes through zero, an algebraic unknown has a pole, or two branches meet. The "
        "equations do not say how the solution goes on; end the run before, or start another one beyond."
    )


def unresolved(problem: DAEProblem, t: float, h: float, unknown: int, value: float, moved: int, off: float) -> str:
    """Explain an output that shows what the steps have passed over."""
    return (
        f"What happens at t = {t:.9g} lies within a step of {h:.3g} that has not seen it: "
        f"{unknown_name(problem, unknown)} is {value:.6g} there, and a step that ended there would move "
        f"{unknown_name(problem, moved)} by {off:.2g} tolerances. The solution from there on leaves it out. Give its "
        "time in breakpoints, or a max_step shorter than it lasts."
    )


def too_many_steps(problem: DAEProblem, t: float, steps: int) -> str:
    """Explain that the limit on steps was reached."""
    return (
        f"{Status.TOO_MANY_STEPS.sentence} {steps} steps took the run to t = {t:.9g}. "
        f"{advice(problem, Status.TOO_MANY_STEPS)}"
    )


def below_rounding(problem: DAEProblem, t: float, unknown: int, value: float, tolerance: float, least: float) -> str:
    """Explain a tolerance that no step can satisfy, and name the least that one could."""
    return (
        f"{Status.BELOW_ROUNDING.sentence} At t = {t:.9g} {unknown_name(problem, unknown)} is {value:.6g} and may be "
        f"off by {tolerance:.2g} a step, {tolerance / abs(value) / EPS:.2g} units of its last digit; the least to "
        f"ask for is {least:.2g}, or rtol = {least / abs(value):.1g}. Loosen the tolerance, or count the unknown "
        "from another origin if it is large and changes little."
    )


def stalled(problem: DAEProblem, t: float, progress: float, needed: float, worst: int, noise: float = 0.0) -> str:
    """Explain a run that goes on without getting anywhere."""
    return (
        f"{Status.STALLED.sentence} Near t = {t:.9g} {WINDOW} steps went {progress:.3g}, mostly because of "
        f"{unknown_name(problem, worst)}; at that rate the end is {needed:.1g} steps away."
        f"{_rounding(noise) or f' {advice(problem, Status.STALLED)}'}"
    )


def chatters(problem: DAEProblem, t: float, chatter: Chatter) -> str:
    """Explain a solution that stays where a rate jumps, and how such equations are posed."""
    name = unknown_name(problem, chatter.unknown)
    return (
        f"{Status.STALLED.sentence} Near t = {t:.9g} the equations jump at {name} = {chatter.place:.3g}: the rate of "
        f"{name} changes between {chatter.low:.3g} and {chatter.high:.3g} from step to step, and the solution stays "
        "there (it slides on the jump, or chatters). Let the jump take a width, say tanh(y/width) for sign(y) with a "
        "width of a hundred tolerances or more, or pose the sliding as an equation of its own."
    )


def user_error(t: float, error: BaseException) -> str:
    """Explain an exception out of a user's Python function."""
    return f"{Status.USER_ERROR.sentence} Near t = {t:.9g}: {type(error).__name__}: {error}"
