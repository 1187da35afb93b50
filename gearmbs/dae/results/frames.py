"""Frames over time: motion of the ground, the bodies and the elastic frames of modal bodies' markers.

With it what else a solution says by time: full turns between outputs, the state at a time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import KIN_A, KIN_AXES, KIN_R, KIN_V, KIN_W, POSE_A, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model.elastic import elastic_frames
from gearmbs.dae.model.evaluator import Records
from gearmbs.dae.model.model import Model
from gearmbs.dae.model.system import turns_of_one
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.result import DAEResult
from gearmbs.dae.state import State
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members

# Output times with all that was evaluated at them, which energies and motions of frames are computed from.


class Evaluated(NamedTuple):
    """A model over time.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Output times, s.
    model : Model
    records : Records
        Poses, accelerations, multipliers, loads.
    """

    t: np.ndarray
    model: Model
    records: Records

    def modal(self, body: int) -> np.ndarray:
        """Return q_f, v_f and their accelerations of a modal body, shape (3, m, modes); the ground is body 0."""
        first = sum(self.model.modes[:body])
        return self.records.modal[:, :, first : first + self.model.modes[body]]


KIN_PLACES = KIN_AXES + 9
ACC_PLACES = 6


def frame_motion(found: Evaluated, model: Model | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the kinematics (m, frames, 27) and acceleration (m, frames, 6) tables over time, the ground first.

    Frames are numbered as in ``Model.marker_body``; columns are those of the compiled tables. ``model`` may have more
    markers than that of the solution.
    """
    records = found.records
    model = found.model if model is None else model
    poses, accelerations = records.by_body, records.accelerations
    m, bodies = poses.shape[:2]
    frames = 1 + bodies + len(model.frame_body)
    kin, acc = np.zeros((m, frames, KIN_PLACES)), np.zeros((m, frames, ACC_PLACES))
    kin[:, 0, KIN_A : KIN_A + 9] = np.eye(3).ravel()
    moving = slice(1, 1 + bodies)
    kin[:, moving, KIN_R : KIN_R + 3] = poses[:, :, POSE_R : POSE_R + 3]
    kin[:, moving, KIN_V : KIN_V + 3] = poses[:, :, POSE_V : POSE_V + 3]
    kin[:, moving, KIN_A : KIN_A + 9] = poses[:, :, POSE_A : POSE_A + 9]
    kin[:, moving, KIN_W : KIN_W + 3] = poses[:, :, POSE_W : POSE_W + 3]
    acc[:, moving] = accelerations
    for k, body in enumerate(model.frame_body):
        n = model.modes[body]
        shapes = model.modal[model.shape_at[k] : model.shape_at[k] + 3 + 6 * n]
        parts = shapes[:3], shapes[3 : 3 + 3 * n].reshape(3, n).T, shapes[3 + 3 * n :].reshape(3, n).T
        f = 1 + bodies + k
        kin[:, f], acc[:, f] = elastic_motion(kin[:, body], acc[:, body], found.modal(body), *parts)
    return kin, acc


def body_motion(found: Evaluated, body: int) -> np.ndarray:
    """Return the motion of a body's frame at its centre of mass, columns ``KIN_*``, shape (m, 27); the first is 1."""
    pose = found.records.by_body[:, body - 1]
    kin = np.zeros((found.t.size, KIN_PLACES))
    kin[:, KIN_R : KIN_R + 3] = pose[:, POSE_R : POSE_R + 3]
    kin[:, KIN_V : KIN_V + 3] = pose[:, POSE_V : POSE_V + 3]
    kin[:, KIN_A : KIN_A + 9] = pose[:, POSE_A : POSE_A + 9]
    kin[:, KIN_W : KIN_W + 3] = pose[:, POSE_W : POSE_W + 3]
    return kin


def elastic_motion(
    kin: np.ndarray, acc: np.ndarray | None, modal: np.ndarray, s0: np.ndarray, phi: np.ndarray, psi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return motion (m, 27) and accelerations (m, 6) of an elastic frame from those of its body.

    Parameters
    ----------
    kin, acc : ndarray, shapes (m, 27), (m, 6)
        Of the body; without accelerations those returned are meaningless.
    modal, s0, phi, psi : ndarray
        As of `gearmbs.dae.model.elastic.elastic_frames`.
    """
    acc = np.zeros((len(kin), ACC_PLACES)) if acc is None else acc
    frame, accelerations = np.zeros(kin.shape), np.zeros(acc.shape)
    # copies: models are read-only
    tables = (np.array(table, dtype=float, order="C") for table in (kin, acc, modal, s0, phi, psi))
    elastic_frames(*tables, frame, accelerations)
    return frame, accelerations


TURNS = 1e-12
"""Least turning (rad/s) that is looked at: nothing then turns in any time that is simulated."""


class Computed(Protocol):
    """A solution as far as its states go."""

    problem: DAEProblem
    result: DAEResult
    members: Members | None
    initial: State | None
    given: np.ndarray | None


def state_at(solution: Computed, t: float) -> State:
    """Return the state at a time; see `Solution.state_at`."""
    result, problem, kept = solution.result, solution.problem, solution.result.kept
    if kept is not None and kept.t == t:
        tables = kept.idata, kept.rdata
        return State.of(problem, t, kept.y, kept.yp, tables, origin=solution.initial, given=solution.given)
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
    return State.of(
        problem, t, y, yp, (idata, _counted(solution, t, y, yp, row)), origin=solution.initial, given=solution.given
    )


def _longest(solution: Computed, t: float, y: np.ndarray, yp: np.ndarray) -> float:
    """Return the time in which no counted angle turns by half a turn, s."""
    problem, members = solution.problem, solution.members
    if members is not None and len(members.turn) and problem.hook_interval is not None:
        return problem.hook_interval(t, y, yp)
    rates = slice(int(problem.idata[T.H_EPS]), int(problem.idata[T.H_VF]))
    speed, change = (np.abs(values[rates]).reshape(-1, 3).sum(axis=1) for values in (y, yp))
    return 1.0 / max(turns_of_one(speed, change), TURNS)


def _counted(solution: Computed, t: float, y: np.ndarray, yp: np.ndarray, row: int) -> np.ndarray:
    """Return the table of numbers with inputs, and turns counted from output to output, up to a time.

    Raises
    ------
    ModelError
        Where outputs are too far apart for that.
    """
    result, problem = solution.result, solution.problem
    rdata, work = problem.rdata.copy(), np.zeros(problem.work_size)
    cells, held = result.held if result.held is not None else (np.empty(0, dtype=np.int64), np.empty((row + 1, 0)))
    if problem.hook is None:
        rdata[cells] = held[row]
        return rdata
    points = [(float(result.t[k]), result.y[k], result.epoch_of(k)) for k in range(row)]
    points.append((t, y, result.epoch_of(row)))
    known = result.yp[:row]
    if not len(result.yp) and result.sol is not None:
        known = result.sol.derivative(result.t[:row])
    before = problem.t0
    for (now, values, table), rate, values_held in zip(points, [*known, yp], held[: row + 1], strict=True):
        rdata[cells] = values_held
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


def known_turns(solution: Computed, function: str, i: str, j: str, start: float | None = None) -> np.ndarray:
    """Return an angle less than half a turn off, by names of its markers, shape (m,), rad; NaN where nothing counts it.

    That is as the run has counted it at its outputs, or where it starts if they are none of its own. Constraints count
    from half a turn on either side: where ``start`` says that the run begins some turns further, they are added.
    """
    result, angles = solution.result, solution.problem.counted
    found = np.full(len(result.t), np.nan)
    if angles is None or (function, i, j) not in angles.angles or not len(found):
        return found
    k = angles.angles.index((function, i, j))
    begun = np.array([solution.problem.t0], dtype=float)
    first = angles.values(begun, solution.problem.rdata[angles.places][None, :])[0, k]
    further = 0.0 if start is None else 2.0 * np.pi * np.round((start - first) / (2.0 * np.pi))
    if result.counted is not None:
        return angles.values(result.t, result.counted)[:, k] + further
    if result.t[0] == solution.problem.t0:
        found[0] = first + further
    return found


SPLINE_POINTS = 4
"""Outputs from which a cubic spline says more about a speed than its mean between two of them."""


def rows_of_jumps(t: np.ndarray, jumped: frozenset[float]) -> np.ndarray:
    """Return which of some times are among those at which velocities have jumped."""
    return np.array([one in jumped for one in t.tolist()], dtype=bool) if jumped else np.zeros(t.size, dtype=bool)


def mean_speeds(speed: np.ndarray, jumps: np.ndarray) -> np.ndarray:
    """Return the mean of the speeds at both ends of each interval; behind a jump the speed at its end is all there is.

    Parameters
    ----------
    speed : ndarray, shape (m,)
        Where it jumps, that before.
    jumps : ndarray of bool, shape (m,)

    Returns
    -------
    ndarray, shape (m - 1,)
    """
    return np.where(jumps[:-1], speed[1:], 0.5 * (speed[1:] + speed[:-1]))


def warn_of_doubtful_turns(t: np.ndarray, angle: np.ndarray, speed: np.ndarray, jumps: np.ndarray, label: str) -> None:
    """Warn where a spline through the speeds makes another number of turns between two outputs than was counted."""
    steps = mean_speeds(speed, jumps) * np.diff(t)
    if t.size < SPLINE_POINTS or jumps.any():
        # speeds between those at both ends lead so far off their mean
        off = np.where(jumps[:-1], 0.0, 0.5 * np.abs(np.diff(speed)) * np.diff(t))
    else:
        off = np.abs(np.diff(angle) - _finer_steps(t, speed, steps))
    doubtful = np.flatnonzero(off > np.pi)
    if doubtful.size:
        k = int(doubtful[0])
        warn(
            f"{label}: its full turns cannot be counted surely from t = {t[k]:.6g} to {t[k + 1]:.6g} s, where it turns "
            f"{abs(steps[k]) / (2 * np.pi):.3g} times between two outputs and its speed changes; simulate with a "
            "higher rate"
        )


def _finer_steps(t: np.ndarray, speed: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the angles (rad) from output to output by a spline through the speeds, where turns could be miscounted."""
    if abs(steps).max() < np.pi or np.diff(t).min() <= 0.0:
        return steps
    from scipy.interpolate import CubicSpline

    return np.diff(CubicSpline(t, speed).antiderivative()(t))
