"""A model whose bodies turn about fixed axes as a DAE in their angles; see `gearmbs.dae.equations.fixed_axes`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.equations import fixed_axes as fx
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import ROW_PARTIAL, ROW_RECORD, apply_element, apply_evaluated
from gearmbs.dae.equations.constraints.terms import cross3, dot3
from gearmbs.dae.equations.expressions.opcodes import HEAD_ALGEBRAIC_LIST
from gearmbs.dae.equations.fixed_axes import (
    AXIS_FUNCTION,
    AXIS_OMEGA,
    S_TURNS,
    TURN_AXIS,
    TURN_INERTIA,
    TURN_MASS,
    TURN_POINT,
    TURN_SENSE,
    axes_in,
    axes_jacobian,
    axes_pattern,
    put_turns,
    update_axes,
)
from gearmbs.dae.equations.kinematics import track, turns_are_counted
from gearmbs.dae.equations.loads.forces import (
    DIAGNOSTICS,
    FRAME_A,
    FRAME_COLUMNS,
    FRAME_P,
    LEAN_ADDRESS,
    LEAN_COLUMNS,
    TURNING_SIG,
    evaluate_lean,
)
from gearmbs.dae.equations.rotation import KIN_R, KIN_W, POSE_A, POSE_R, POSE_V, POSE_W
from gearmbs.dae.equations.unknowns import SI2
from gearmbs.dae.model.members import (
    AXES_SIG,
    TURN_I,
    TURN_J,
    TURN_ROOT,
    TURN_ROWS,
    TURN_SIDE,
    Members,
    deduct_loads,
    internal_reactions,
    move_member,
)
from gearmbs.dae.model.records import Records
from gearmbs.dae.model.system import counted_angles, turns_of_one
from gearmbs.dae.problem import DAEProblem
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64
from gearmbs.kernels.pointers import address
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at

if TYPE_CHECKING:
    from gearmbs.dae.model.model import Model
    from gearmbs.dae.model.system import System

TRAILING = ("omega", "phi")

ON_AXIS = 1e-12
"""Distance of a centre of mass from its axis, m, that is rounding: the weight of a tonne makes a moment of 1e-8 N m."""


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
    at = int(model.layouts[SI2]["z"])
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
        constant_slopes=True,
        names=[*names, *(f"z({name})" for name in system.state_names)],
        solved_at_outputs=~mask & ~differential,
        finite_rates=model.has_finite_forces,
        hook=fx.axes_hook if counted else None,
        hook_interval=_hook_interval(omega, model, axes, (idata, rdata, size)) if counted else None,
        numbers=model.numbers_in(idata),
        aliases=model.aliases,
        counted=counted_angles(system, idata),
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


def _watched_markers(idata: np.ndarray, lean: np.ndarray) -> np.ndarray:
    """Return the markers whose frames loads and counted angles look at; loads with a lean kernel look at none."""
    extra, forces = idata[int(idata[T.H_I_EXTRA]) :], T.forces_in(idata)[lean[:, LEAN_ADDRESS] == 0]
    seen = [extra[row[T.FORCE_SEES] + 1 :][: extra[row[T.FORCE_SEES]]] for row in forces if row[0] == T.COMPILED]
    angles = T.rows_in(idata, int(idata[T.H_I_ANGLE]), int(idata[T.H_ANGLES]), T.ANGLE_COLUMNS)
    # a torque of a compiled element acts wherever its markers are
    placed = forces[(forces[:, T.FORCE_KIND] != T.COMPILED) | (forces[:, T.FORCE_F] >= 0)]
    ends = [placed[:, [T.FORCE_I, T.FORCE_J]].ravel(), angles[:, [T.ANGLE_I, T.ANGLE_J]].ravel()]
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
    lean, own = _lean_elements(model, turns, rdata.size)
    markers = _watched_markers(idata, lean)
    table[:, fx.AXIS_SEEN] = _bodies_seen(idata, model.marker_body[markers], turns)
    rdata = np.concatenate([rdata, own, turns.ravel()])
    ends = [len(markers), 0, len(axes), -1]
    return np.concatenate([idata, lean.ravel(), table.ravel(), markers, ends]), rdata, size


def _lean_elements(model: Model, turns: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows ``LEAN_*`` of all force elements, and their tables, of which the first will be at ``first``."""
    rows, tables = np.zeros((len(model.forces), LEAN_COLUMNS), dtype=np.int64), [np.zeros(0)]
    for number, offer in model.lean.items():
        markers = model.forces[number, [T.FORCE_I, T.FORCE_J]]
        bodies = model.marker_body[markers] - 1
        if (bodies < 0).any():
            continue
        # point and direction
        axes = turns[bodies, : fx.TURN_INERTIA].reshape(2, 2, 3)[:, ::-1]
        frames = np.zeros((2, FRAME_COLUMNS))
        for frame, marker, turn in zip(frames, model.marker_frame[markers], turns[bodies], strict=True):
            # a + b: where nothing has turned
            arm, turned = turn[fx.TURN_ARM : fx.TURN_MATRIX], turn[fx.TURN_MATRIX :].reshape(3, 3, 3)[:2].sum(axis=0)
            centre = turn[fx.TURN_POINT : fx.TURN_INERTIA] + arm.reshape(3, 3)[:2].sum(axis=0)
            frame[FRAME_P : FRAME_P + 3] = centre + turned @ marker[:3]
            frame[FRAME_A : FRAME_A + 9] = (turned @ marker[3:].reshape(3, 3)).ravel()
        made = offer(frames, axes)
        if made is not None:
            kernel, own = made
            levers = np.cross(axes[:, 1], frames[0, FRAME_P : FRAME_P + 3] - axes[:, 0])
            rows[number] = address(kernel, TURNING_SIG), first + sum(map(len, tables)), own.size
            tables += [levers.ravel(), own]
    return rows, np.concatenate(tables)


def _bodies_seen(idata: np.ndarray, bodies: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return of which bodies the residual needs the place: ``bodies`` are those of the markers that are looked at."""
    if idata[T.H_TAPES] > 0:
        # expressions look at any marker
        return np.ones(len(turns), dtype=bool)
    arms = turns[:, fx.TURN_ARM + 3 : fx.TURN_ARM + 6]
    return np.isin(np.arange(len(turns)) + 1, bodies) | (np.linalg.norm(arms, axis=1) > ON_AXIS)


def _with_slots(idata: np.ndarray, slots: np.ndarray) -> np.ndarray:
    """Return the integers with the slots of the Jacobian."""
    markers, _, axes, kept = idata[-fx.COUNTS :]
    return np.concatenate([idata[: -fx.COUNTS], slots, [markers, len(slots), axes, kept]])


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


def axes_of(idata: np.ndarray, rdata: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the integers and the reals of the axes, one a row, as `fx.axes_in` does in compiled code."""
    markers, slots, count, _ = (int(number) for number in idata[-fx.COUNTS :])
    first = idata.size - fx.COUNTS - slots - markers - fx.AXIS_COLUMNS * count
    return T.rows_in(idata, first, count, fx.AXIS_COLUMNS), _turns_in(rdata, count)


def _turns_in(rdata: np.ndarray, count: int) -> np.ndarray:
    return rdata[rdata.size - fx.TURN_COLUMNS * count :].reshape(count, fx.TURN_COLUMNS)


def starting_values(problem: DAEProblem, count: int) -> np.ndarray:
    """Return the values of the motions' functions of time at the start, one an axis; zero of a free one."""
    return _turns_in(problem.rdata, count)[:, fx.TURN_START].copy()


# Records of bodies that turn about fixed axes, from their angles alone.
#
# Nothing is solved for: where loads are known, so are the angular accelerations, and what the joint of a group
# transmits is all that moves it,
#
#     W = sum over its members of m (a - g), and of moments, less the loads on them;
#
# n . W is zero of a free group, and what the motion exerts of a driven one.


_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]

SCRATCH = 24
"""Places of the scratch, as many as `move_member` takes."""


@njit(cache=True, error_model="numpy", forceinline=True)
def accelerate(k, axes, turns, tab, own, solution, s):
    """Write a and alpha of body k + 1 to ``solution``, from the loads on it in ``own``; ``s`` is scratch."""
    turn, body, first = turns[k], tab.kin[k + 1], 6 * k
    for c in range(3):
        s[c] = body[KIN_R + c] - turn[TURN_POINT + c]
        s[3 + c] = own[first + c] + turn[TURN_MASS] * tab.gravity[c]
    if axes[k, AXIS_OMEGA] >= 0:
        cross3(s, 0, s, 3, s, 6)
        moment = dot3(turn, TURN_AXIS, s, 6) + dot3(turn, TURN_AXIS, own, first + 3)
        alpha = moment / turn[TURN_INERTIA]
    else:
        alpha = turn[TURN_SENSE] * tab.fval[axes[k, AXIS_FUNCTION], 2]
    # a = alpha n x rho + w x (w x rho)
    cross3(turn, TURN_AXIS, s, 0, s, 3)
    cross3(body, KIN_W, s, 0, s, 6)
    cross3(body, KIN_W, s, 6, s, 6)
    for c in range(3):
        solution[first + c] = alpha * s[3 + c] + s[6 + c]
        solution[first + 3 + c] = alpha * turn[TURN_AXIS + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def joint_reaction(k, function, members, tab, wrench, multipliers, phi, force, moment, s):
    """Write what the joint of group k + 1, and its motion, transmit; the wrenches of members are less it then.

    Parameters
    ----------
    k : int
    function : int
        Function of time of the motion, or -1.
    members, tab, wrench, multipliers, phi, force, moment
        As of `gearmbs.dae.model.members.internal_reactions`. Of ``phi``, which begins with zeros, only the rates of
        motions are anything else.
    s : ndarray
        Scratch, 12 places.
    """
    frame, turn = tab.frame, members.turn[k]
    i, j, side = turn[TURN_I], turn[TURN_J], 1.0 * turn[TURN_SIDE]
    of_i, of_j = members.of_marker[i], members.of_marker[j]
    for c in range(6):
        s[c] = 0.0
    for m in range(members.group.size):
        if members.group[m] == k + 1:
            for c in range(6):
                s[c] += wrench[m, c]
    for c in range(6):
        total = s[c]
        if of_i >= 0:
            wrench[of_i, c] -= side * total
        if of_j >= 0:
            wrench[of_j, c] += side * total
    # moment on I's body about marker I
    body = tab.kin[tab.marker_body[i]]
    for c in range(3):
        s[6 + c] = body[KIN_R + c] + frame[i, T.MK_ARM + c]
    cross3(s, 6, s, 0, s, 9)
    for c in range(3):
        s[6 + c] = side * (s[3 + c] - s[9 + c])
    for c in range(3):
        row = turn[TURN_ROWS + c]
        for d in range(3):
            force[row, d] = moment[row, d] = 0.0
        force[row, c] = side * s[c]
        multipliers[row] = -force[row, c]
    for c in range(3):
        row = turn[TURN_ROWS + 3 + c]
        if row < 0:
            continue
        if c < 2:
            # z_I normal to x_J, y_J
            cross3(frame[i], T.MK_AXES + 6, frame[j], T.MK_AXES + 3 * c, s, 9)
        else:
            root = 1.0 * turn[TURN_ROOT]
            for d in range(3):
                s[9 + d] = root * frame[j, T.MK_AXES + 6 + d]
            phi[ROW_RECORD * row + ROW_PARTIAL] = -root * tab.fval[function, 1]
        along = dot3(s, 6, s, 9)
        multipliers[row] = -along
        for d in range(3):
            force[row, d] = 0.0
            moment[row, d] = along * s[9 + d]


@njit(cache=True, error_model="numpy", nogil=True)
def _evaluate(first, last, t, y, idata, rdata, work, members, records, own, turning, wrench, s):
    """Do what `evaluate_axes` promises, in arrays that its caller keeps alive.

    Parameters
    ----------
    first, last, t, y, idata, rdata, work, members, records
        As of `evaluate_axes`.
    own, turning : ndarray, shape (6 groups,)
        Scratch: applied loads on the groups, and their accelerations.
    wrench, s : ndarray, shapes (members, 6) and (SCRATCH,)
        Scratch.
    """
    idata, t, rdata, work = uncounted(idata), uncounted(t), uncounted(rdata), uncounted(work)
    own, turning, s = uncounted(own), uncounted(turning), uncounted(s)
    tab = T.unpack(idata, rdata, work)
    leans, axes, markers, _, turns = axes_in(idata, rdata)
    n, count = y.shape[1], members.group.size
    all_y, wrench = matrix_at(y, 0, y.shape[0], n), matrix_at(wrench, 0, count, 6)
    elements, columns = records.loads.shape[1], records.loads.shape[2]
    rows, size, poses = records.force.shape[1], records.solution.shape[1], records.pose.shape[1]
    base, counts_turns = 6 * count, turns_are_counted(tab)
    for k in range(first, last):
        at = vector_at(all_y, n * k, n)
        loads = matrix_at(records.loads, elements * columns * k, elements, columns)
        pose = vector_at(records.pose, poses * k, poses)
        solution = vector_at(records.solution, size * k, size)
        multipliers = vector_at(solution, base, rows)
        phi = vector_at(records.phi, ROW_RECORD * rows * k, ROW_RECORD * rows)
        force = matrix_at(records.force, 3 * rows * k, rows, 3)
        moment = matrix_at(records.moment, 3 * rows * k, rows, 3)
        update_axes(t[k], at, axes, markers, turns, tab, True)
        if counts_turns:
            track(t[k], at, tab, True)
        for c in range(own.size):
            own[c] = 0.0
        for f in range(idata[T.H_FORCES]):
            if leans[f, LEAN_ADDRESS] != 0:
                put_turns(tab.force[f], at, axes, turns, tab)
                evaluate_lean(tab.force[f], leans[f], S_TURNS, rdata, tab, np.int64(DIAGNOSTICS))
                apply_evaluated(f, own, loads, tab)
            else:
                apply_element(f, t[k], at, own, loads, tab)
        for a in range(axes.shape[0]):
            accelerate(a, axes, turns, tab, own, turning, s)
        for m in range(count):
            move_member(m, members, tab, turning, pose, solution, wrench, s)
        deduct_loads(loads, members, tab, wrench, s)
        for a in range(axes.shape[0]):
            joint_reaction(
                a, axes[a, AXIS_FUNCTION], members, tab, wrench, multipliers, phi, force, moment, s
            )  # fmt: skip
        internal_reactions(members, tab, wrench, multipliers, phi, force, moment, s)
        records.strayed[k] = 0.0


@njit(AXES_SIG, cache=True, error_model="numpy", nogil=True)
def evaluate_axes(first, last, t, y, idata, rdata, work, members, records):
    """Evaluate output rows ``first`` to ``last - 1``.

    Parameters
    ----------
    first, last : int
    t : ndarray, shape (m,)
        Output times, s.
    y : ndarray, shape (m, unknowns)
    idata, rdata, work : ndarray
        Tables of `gearmbs.dae.equations.fixed_axes`.
    members : Members
    records : Records
        Written.
    """
    loads, turning = np.zeros(idata[T.H_COORDINATES]), np.zeros(idata[T.H_COORDINATES])
    wrench, s = np.zeros((members.group.size, 6)), np.zeros(SCRATCH)
    _evaluate(first, last, t, y, idata, rdata, work, members, records, loads, turning, wrench, s)


class AxisEvaluator:
    """Fills the records of all bodies and joints from the unknowns of groups that turn about fixed axes."""

    def __init__(self, problem: DAEProblem, members: Members) -> None:
        self.members = members
        self.rdata = problem.rdata.copy()
        self.work = np.zeros(problem.work_size)

    def fill(self, t: np.ndarray, y: np.ndarray, epochs, records: Records) -> None:
        """Fill ``records`` for all rows of ``y``; ``epochs`` names the integer tables valid from each row on."""
        y = np.ascontiguousarray(y)
        bounds = [row for row, _ in epochs] + [t.size]
        for (first, table), last in zip(epochs, bounds[1:]):
            evaluate_axes(first, last, t, y, np.ascontiguousarray(table), self.rdata, self.work, self.members, records)
