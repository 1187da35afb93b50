"""The state of a solution at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.model.start import turns_of_one
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.result import DAEResult
from gearmbs.dae.state import State

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members

TURNS = 1e-12
"""Least turning (rad/s) that is looked at: nothing then turns in any time that is simulated."""


class Computed(Protocol):
    """A solution as far as its states go."""

    problem: DAEProblem
    result: DAEResult
    members: Members | None
    initial: State | None


def state_at(solution: Computed, t: float) -> State:
    """Return the state at a time; see `Solution.state_at`."""
    result, problem = solution.result, solution.problem
    row = int(np.searchsorted(result.t, t))
    at_output = row < len(result.t) and result.t[row] == t
    if at_output and len(result.yp):
        y, yp = result.y[row], result.yp[row]
    elif result.sol is not None and result.t[0] <= t <= result.t[-1]:
        y, yp = result.sol.evaluate(t)
    elif at_output:
        raise ModelError("state_at: this solution holds no rates; simulate with rate, t_eval or dense_output=True")
    else:
        span = f"{result.t[0]:.9g} to {result.t[-1]:.9g} s" if len(result.t) else "nothing"
        raise ModelError(
            f"state_at: t = {t:.9g} s is none of the output times, {span}; put it into t_eval, or simulate with "
            "dense_output=True"
        )
    idata = result.epoch_of(row)
    if not at_output and not np.array_equal(idata, result.epoch_of(row - 1)):
        raise ModelError(
            f"state_at: coordinates change between the outputs at {result.t[row - 1]:.9g} and {result.t[row]:.9g} s; "
            "take one of these times"
        )
    return State.of(problem, t, y, yp, (idata, _counted(solution, t, y, yp, row)), origin=solution.initial)


def _longest(solution: Computed, t: float, y: np.ndarray, yp: np.ndarray) -> float:
    """Return the time in which no counted angle turns by half a turn, s."""
    problem, members = solution.problem, solution.members
    if members is not None and len(members.turn) and problem.hook_interval is not None:
        return problem.hook_interval(t, y, yp)
    rates = slice(int(problem.idata[T.H_EPS]), int(problem.idata[T.H_VF]))
    speed, change = (np.abs(values[rates]).reshape(-1, 3).sum(axis=1) for values in (y, yp))
    return 1.0 / max(turns_of_one(speed, change), TURNS)


def _counted(solution: Computed, t: float, y: np.ndarray, yp: np.ndarray, row: int) -> np.ndarray:
    """Return the table of numbers with turns counted from output to output up to a time.

    Raises
    ------
    ModelError
        Where outputs are too far apart for that.
    """
    result, problem = solution.result, solution.problem
    rdata, work = problem.rdata.copy(), np.zeros(problem.work_size)
    if problem.hook is None:
        return rdata
    points = [(float(result.t[k]), result.y[k], result.epoch_of(k)) for k in range(row)]
    points.append((t, y, result.epoch_of(row)))
    known = result.yp[:row]
    if not len(result.yp) and result.sol is not None:
        known = result.sol.derivative(result.t[:row])
    before = problem.t0
    for (now, values, table), rate in zip(points, [*known, yp], strict=True):
        kept = rdata.copy()
        # the hook may turn its point into other coordinates, which the state is not in
        problem.hook(now, values[None, :].copy(), 1, table.copy(), rdata, work)
        counts = not np.array_equal(kept, rdata)
        if counts and now - before > _longest(solution, now, values, rate):
            raise ModelError(
                f"state_at: turns counted by elements cannot be told from outputs as far apart as {before:.6g} and "
                f"{now:.6g} s; simulate with a higher rate, or take the state of a Simulator"
            )
        before = now
    return rdata
