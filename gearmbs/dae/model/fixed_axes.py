"""A model whose bodies turn about fixed axes as a DAE in their angles; see `gearmbs.dae.equations.fixed_axes`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.equations import fixed_axes as fx
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.expressions.opcodes import HEAD_ALGEBRAIC_LIST
from gearmbs.dae.equations.fixed_axes_jacobian import axes_jacobian, axes_pattern
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V, POSE_W
from gearmbs.dae.equations.unknowns import SI2
from gearmbs.dae.model.start import turns_of_one
from gearmbs.dae.problem import DAEProblem

if TYPE_CHECKING:
    from gearmbs.dae.model.model import Model
    from gearmbs.dae.model.system import System

TRAILING = ("omega", "phi")


@dataclass(frozen=True)
class Axis:
    """The revolute joint on the ground that a body turns in, by the numbers of the integrated model.

    Attributes
    ----------
    i, j : int
        Markers; one is on the body, the other on the ground.
    turns_i : bool
        Whether the body is that of I.
    motion : int or None
        Constraint row of the motion that prescribes the turn.
    """

    i: int
    j: int
    turns_i: bool
    motion: int | None = None


def _depends_on_states_only(idata: np.ndarray) -> bool:
    """Whether no load and no state's equation depends on other unknowns than positions, velocities and states."""
    first, last = int(idata[T.H_Z]), int(idata[T.H_Z] + idata[T.H_STATES])
    lists = np.concatenate([np.zeros(0, dtype=np.int64), *_unknowns_listed(idata)])
    of_reactions = T.forces_in(idata)[:, T.FORCE_KIND] == T.REACTION
    return not of_reactions.any() and bool(((lists >= first) & (lists < last)).all())


def _unknowns_listed(idata: np.ndarray) -> list[np.ndarray]:
    """Return views of all lists of unknowns in packed tables: of force elements, of expressions, of their codes."""
    extra = idata[int(idata[T.H_I_EXTRA]) :]
    lists = []
    for row in T.forces_in(idata):
        first = row[T.FORCE_DEPENDS]
        first += 1 + extra[first]
        lists.append(extra[first + 1 : first + 1 + extra[first]])
    for tape in T.rows_in(idata, int(idata[T.H_I_TAPE]), int(idata[T.H_TAPES]), T.TAPE_COLUMNS):
        codes, count = tape[T.TAPE_I], tape[T.TAPE_N_UNKNOWNS]
        for first in (tape[T.TAPE_BODIES] + tape[T.TAPE_N_BODIES], codes + extra[codes + HEAD_ALGEBRAIC_LIST]):
            lists.append(extra[first : first + count])
    return lists


def fixed_axis_problem(system: System, axes: Sequence[Axis], rate_scale: float) -> DAEProblem | None:
    """Return the DAE in the angles of bodies that turn about fixed axes, with consistent initial values.

    Parameters
    ----------
    system : System
        All six coordinates of each body, assembled.
    axes : sequence of Axis
        One a moving body, in their order; no other constraint acts.
    rate_scale : float
        Ratio of the error allowed in angular velocities to that in angles, 1/s.

    Returns
    -------
    DAEProblem or None
        None if a load depends on multipliers or on other loads, or if nothing is left to integrate.

    Raises
    ------
    ModelError
        As `System.problem`, if a load or a function of time has no finite value at the start.
    """
    model, states = system.model, len(system.model.states)
    free = [k for k, axis in enumerate(axes) if axis.motion is None]
    packed = model.pack(SI2)
    if not (free or states) or not _depends_on_states_only(packed[0]):
        return None
    turns = np.array([_turn(system, k, axis) for k, axis in enumerate(axes)])
    if not (turns[free, fx.TURN_INERTIA] > 0.0).all():
        return None
    n = 2 * len(free) + states
    idata, rdata, size = _with_axes(model, packed, axes, free, turns)
    whole = system.problem("SI2", rate_scale) if states else None
    at = int(model.layout(SI2)["z"])
    z = slice(2 * len(free), n)
    y, yp, out, work = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(size)
    omega, phi = np.split(np.arange(z.start), 2)
    y[omega] = [turns[k, :3] @ system.pose[k, POSE_W:] for k in free]
    scale, allowed, mask, differential = np.ones(n), np.ones(n), np.ones(n, dtype=bool), np.ones(n, dtype=bool)
    # neither the angle nor the place of the centre of mass may be off by more than is allowed of a coordinate
    reach = np.array([np.linalg.norm(turns[k, fx.TURN_ARM + 3 : fx.TURN_ARM + 6]) for k in free])
    length = min(system.length, 1.0)
    allowed[phi] = allowed[omega] = np.minimum(1.0, length / np.maximum(reach, 1e-300))
    allowed[omega] *= rate_scale
    if whole is not None:
        of_whole = slice(at, at + states)
        y[z], scale[z], allowed[z] = whole.y0[of_whole], whole.scale[of_whole], whole.atol_scale[of_whole]
        mask[z], differential[z] = whole.error_mask[of_whole], whole.differential[of_whole]
    _start_motions(system, axes, idata, rdata, y, work)
    fx.axes_residual(system.t0, y, yp, out, idata, rdata, work)
    if not np.isfinite(out).all():
        # says which load or function it is
        system.problem("SI2", rate_scale)
    yp[omega], yp[phi] = -out[omega] / turns[free, fx.TURN_INERTIA], y[omega]
    yp[z] = -out[z] * differential[z]
    indptr, indices, slots = axes_pattern(idata, rdata, size, system.t0, y)
    idata = _with_slots(idata, slots)
    names = [f"{part}({system.body_names[k]})" for part in TRAILING for k in free]
    counted = len(model.angles) > 0 or any(tape.n_angles for tape in model.tapes)
    return DAEProblem(
        n=n,
        residual=fx.axes_residual,
        jacobian=axes_jacobian,
        indptr=indptr,
        indices=indices,
        idata=idata,
        rdata=rdata,
        work_size=size,
        y0=y,
        yp0=yp,
        error_mask=mask,
        atol_scale=allowed,
        scale=scale,
        differential=differential,
        t0=system.t0,
        names=[*names, *(f"z({name})" for name in system.state_names)],
        solved_at_outputs=~mask & ~differential,
        hook=fx.axes_hook if counted else None,
        hook_interval=_hook_interval(omega, model, axes, (idata, rdata, size)) if counted else None,
    )


def _hook_interval(omega: np.ndarray, model: Model, axes: Sequence[Axis], tables: tuple[np.ndarray, np.ndarray, int]):
    """Time in which no counted angle turns by half a turn."""
    driven = [function for function in _functions(model, axes) if function >= 0]
    idata, rdata, size = tables
    work = np.zeros(size)

    def interval(t: float, y: np.ndarray, yp: np.ndarray) -> float:
        turning = turns_of_one(y[omega], yp[omega])
        if driven:
            values = _function_values(t, y, idata, rdata, work)[driven]
            turning = max(turning, turns_of_one(values[:, 1], values[:, 2]))
        return 1.0 / max(turning, 1e-12)

    return interval


def _turn(system: System, k: int, axis: Axis) -> np.ndarray:
    """Return the reals of the axis of body k + 1, all but the start of its motion."""
    model, pose = system.model, system.pose[k]
    fixed = model.marker_frame[axis.j if axis.turns_i else axis.i]
    point, n = fixed[:3], fixed[3:].reshape(3, 3)[:, 2]
    axes, arm = pose[POSE_A:POSE_V].reshape(3, 3), pose[POSE_R:POSE_A] - point
    mass, inertia = model.bodies[k + 1, T.BODY_MASS], model.bodies[k + 1, T.BODY_INERTIA :].reshape(3, 3)
    along = axes.T @ n
    across = np.cross(n, arm)
    cross = np.array([[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]])
    row = np.zeros(fx.TURN_COLUMNS)
    row[fx.TURN_AXIS : fx.TURN_POINT], row[fx.TURN_POINT : fx.TURN_INERTIA] = n, point
    row[fx.TURN_INERTIA], row[fx.TURN_MASS] = along @ inertia @ along + mass * across @ across, mass
    row[fx.TURN_SENSE] = 1.0 if axis.turns_i else -1.0
    # Rodrigues' formula: what is along the axis stays, what is across turns
    kept = np.outer(n, n)
    for first, value in ((fx.TURN_ARM, arm), (fx.TURN_MATRIX, axes)):
        parts = [np.ravel(part @ value) for part in (kept, np.eye(3) - kept, cross)]
        row[first : first + 3 * value.size] = np.concatenate(parts)
    return row


def _watched_markers(idata: np.ndarray) -> np.ndarray:
    """Return the markers whose frames loads and counted angles look at."""
    extra, forces = idata[int(idata[T.H_I_EXTRA]) :], T.forces_in(idata)
    seen = [extra[row[T.FORCE_SEES] + 1 :][: extra[row[T.FORCE_SEES]]] for row in forces if row[0] == T.COMPILED]
    angles = T.rows_in(idata, int(idata[T.H_I_ANGLE]), int(idata[T.H_ANGLES]), T.ANGLE_COLUMNS)
    ends = [forces[:, [T.FORCE_I, T.FORCE_J]].ravel(), angles[:, [T.ANGLE_I, T.ANGLE_J]].ravel()]
    directions = forces[forces[:, T.FORCE_KIND] == T.EXPRESSION, T.FORCE_RM]
    return np.unique(np.concatenate([*seen, *ends, directions])).astype(np.int64)


def _with_axes(
    model: Model, packed: tuple[np.ndarray, np.ndarray, int], axes: Sequence[Axis], free: list[int], turns: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the tables of the model with those of the axes behind them, no slots yet, and the size of the work."""
    idata, rdata, size = packed
    shift = 2 * len(free) - int(idata[T.H_Z])
    for part in _shared_once(_unknowns_listed(idata)):
        part += shift
    forces = T.forces_in(idata)
    forces[forces[:, T.FORCE_KIND] == T.COMPILED, T.FORCE_Z] += shift
    idata[T.H_Z] += shift
    idata[T.H_UNKNOWNS] = 2 * len(free) + len(model.states)
    table = np.full((len(axes), fx.AXIS_COLUMNS), -1, dtype=np.int64)
    for place, k in enumerate(free):
        table[k, fx.AXIS_OMEGA], table[k, fx.AXIS_PHI] = place, len(free) + place
    table[:, fx.AXIS_FUNCTION] = _functions(model, axes)
    markers = _watched_markers(idata)
    rdata = np.concatenate([rdata, turns.ravel()])
    ends = [len(markers), 0, len(axes)]
    return np.concatenate([idata, table.ravel(), markers, ends]), rdata, size


def _with_slots(idata: np.ndarray, slots: np.ndarray) -> np.ndarray:
    """Return the integers with the slots of the Jacobian."""
    markers, _, axes = idata[-fx.COUNTS :]
    return np.concatenate([idata[: -fx.COUNTS], slots, [markers, len(slots), axes]])


def _shared_once(lists: list[np.ndarray]) -> list[np.ndarray]:
    """Return the lists without those that are the same places again."""
    return list({(part.__array_interface__["data"][0], part.size): part for part in lists if part.size}.values())


def _start_motions(system: System, axes: Sequence[Axis], idata: np.ndarray, rdata: np.ndarray, y, work) -> None:
    """Let the angles of prescribed turns count from the start."""
    values = _function_values(system.t0, y, idata, rdata, work)
    for turn, function in zip(_turns_in(rdata, len(axes)), _functions(system.model, axes), strict=True):
        if function >= 0:
            turn[fx.TURN_START] = values[function, 0]


def _function_values(t: float, y: np.ndarray, idata: np.ndarray, rdata: np.ndarray, work: np.ndarray) -> np.ndarray:
    """Return the values of all functions of time and their first and second rates, (functions, 3)."""
    # no loads and states: they may not be defined where bodies have not been turned to
    alone = idata.copy()
    alone[[T.H_FORCES, T.H_STATES]] = 0
    fx.axes_residual(t, y, np.zeros(y.size), np.zeros(y.size), alone, rdata, work)
    return T.rows_in(work, int(idata[T.H_W_FUNCTION]), int(idata[T.H_FUNCTIONS]), T.FUNCTION_VALUES)


def _functions(model: Model, axes: Sequence[Axis]) -> list[int]:
    """Return the functions of time of the motions about the axes, -1 of a free one."""
    rows = [axis.motion for axis in axes]
    return [-1 if r is None else int(model.terms[model.rows[r, T.ROW_FIRST], T.TERM_FUNCTION]) for r in rows]


def _turns_in(rdata: np.ndarray, count: int) -> np.ndarray:
    return rdata[rdata.size - fx.TURN_COLUMNS * count :].reshape(count, fx.TURN_COLUMNS)


def starting_values(problem: DAEProblem, count: int) -> np.ndarray:
    """Return the values of the motions' functions of time at the start, one an axis; zero of a free one."""
    return _turns_in(problem.rdata, count)[:, fx.TURN_START].copy()
