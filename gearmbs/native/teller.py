"""What a run tells at the present point without Python: accelerations, reactions, loads, and sums of them by name."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.linalg.entry_lists import FEWEST_ENTRIES, LEAVING_PLANS, NEGLIGIBLE
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT
from gearmbs.dae.model.evaluator import GENERIC_TURNS, evaluate_rows
from gearmbs.dae.model.records import Records
from gearmbs.dae.result import Status
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector, matrix_at
from gearmbs.native.pivots import CHOSEN, LEFT_SRC, factor_at, write_plan
from gearmbs.native.series import number_of, tell_expressions

SINGULAR = int(Status.SINGULAR_JACOBIAN)
evaluate_at = caller(evaluate_rows.declared)

TOLD = 1
"""The outputs have been written."""


class Teller(Struct):
    """Records of one instant, what they are evaluated with, and which of them the outputs are.

    Attributes
    ----------
    slots, turns : ndarray
        Places of the entries of the matrix of accelerations; sines by which angles are turned off special positions.
    rdata, work, vals : ndarray
        Tables and values of that matrix.
    pose, solution, phi, strayed : ndarray
        Of `gearmbs.dae.model.records.Records`.
    loads, force, moment : ndarray
        The same with all axes but the first in one.
    first : ndarray of int64, shape (outputs + 1,)
        Where the numbers that add up to an output begin among the following.
    kind, at : ndarray of int64
        Which record, and where in it.
    out : ndarray, shape (outputs,)
    ints, floats, bounds, marker_body, marker_frame, elastic, shapes, counts, further : ndarray
        Of `gearmbs.native.asked.Expressions`.
    own_first, own_kind, own_at : ndarray of int64
        Its ``first``, ``kind`` and ``at``.
    times : ndarray, shape (2,)
        The point that was left last, and the one that was told last.
    kin, acc : ndarray, shapes (2 frames, KIN_COLUMNS) and (2 frames, 6)
        Motions and accelerations of frames there.
    tape_y, angles, known : ndarray
        Unknowns of expressions there, one after the other; counted angles, and what the run has counted of them.
    grad, tape_work : ndarray
        Scratch of expressions.
    """

    evaluate: int  # address of `evaluate_rows`, which is compiled apart
    series: int  # of `evaluate_series`
    elastic_frames: int
    points: int  # how many of two points of expressions are known
    ready: bool  # whether there are pivots
    attempt: int  # of evaluating one instant, which may each need others
    plans: int
    growth: float
    elements: int
    columns: int  # of the loads of an element
    slots: IntVector
    turns: Vector
    rdata: Vector
    work: Vector
    vals: Vector
    pose: Matrix
    solution: Matrix
    phi: Matrix
    strayed: Vector
    loads: Vector
    force: Vector
    moment: Vector
    first: IntVector
    kind: IntVector
    at: IntVector
    out: Vector
    ints: IntVector
    floats: Vector
    bounds: IntVector
    own_first: IntVector
    own_kind: IntVector
    own_at: IntVector
    marker_body: IntVector
    marker_frame: Matrix
    elastic: IntVector
    shapes: Vector
    counts: IntVector
    further: Vector
    times: Vector
    kin: Matrix
    acc: Matrix
    tape_y: Vector
    angles: Vector
    known: Vector
    grad: Vector
    tape_work: Vector


TELLER_TYPE = Teller.struct_kind


@njit(cache=True, error_model="numpy", nogil=True)
def _records(q):
    """Return the records as what evaluates them takes them."""
    rows = q.phi.shape[1] // 3
    loads = q.loads.reshape((1, q.elements, q.columns))
    force, moment = q.force.reshape((1, rows, 3)), q.moment.reshape((1, rows, 3))
    return Records(q.pose, q.solution, loads, q.phi, force, moment, q.strayed)


@njit(cache=True, error_model="numpy", nogil=True)
def _table(d):
    """Return the table of integers that is valid for the present point."""
    return d.table_before if d.before else d.table


@njit(cache=True, error_model="numpy", nogil=True)
def tell(st, d, q, plan, factors, first):
    """Evaluate the records and outputs at the present point.

    Parameters
    ----------
    st : RunState
    d : Driver
    q : Teller
    plan, factors : LUPlan, LUFactors
        Of the matrix of accelerations.
    first : int
        Whether this is the first attempt at this instant, and not one with other pivots.

    Returns
    -------
    code : int
        TOLD, or 0 where pivots have to be chosen first.
    """
    if first == 1:
        q.attempt = 0
        # turns as the run counts them, and other numbers as they were up to the point
        for k in range(q.rdata.shape[0]):
            q.rdata[k] = st.rdata[k]
        for c in range(d.cells.shape[0]):
            q.rdata[d.cells[c]] = d.held[c]
        if not q.ready:
            return 0
    n = st.y.shape[0]
    t, y = np.empty(1), matrix_at(st.y_out, d.present * n, 1, n)
    t[0] = d.t
    done = evaluate_at(q.evaluate)(
        0, 1, t, y, q.slots, _table(d), q.rdata, q.work, q.vals, plan, factors, _records(q), q.growth
    )
    if done == 0:
        q.attempt += 1
        return 0
    for k in range(q.out.shape[0]):
        q.out[k] = 0.0
        for p in range(q.first[k], q.first[k + 1]):
            q.out[k] += number_of(st, d, q, q.kind[p], q.at[p])
    if q.bounds.shape[0] > 0:
        tell_expressions(st, d, q)
    return TOLD


@njit(cache=True, error_model="numpy", nogil=True)
def _assemble(st, d, q, plan, factors, angle):
    """Assemble the matrix of accelerations with every angle turned differently off the present point."""
    n = st.y.shape[0]
    table = _table(d)
    t, y = np.empty(1), np.empty((1, n))
    t[0] = d.t
    for i in range(n):
        y[0, i] = st.y_out[d.present, i]
    for k in range(q.turns.shape[0]):
        y[0, table[T.H_THETA] + k] += angle * q.turns[k]
    q.vals[:] = 0.0
    work = np.zeros(q.work.shape[0])
    evaluate_at(q.evaluate)(
        0, -1, t, y, q.slots, table, q.rdata, work, q.vals, plan, factors, _records(q), GROWTH_LIMIT
    )


@njit(cache=True, error_model="numpy", nogil=True)
def choose_for_outputs(st, d, q, room, columns, rows_left, plan, factors):
    """Choose pivots for the matrix of accelerations, as `gearmbs.dae.model.evaluator.Evaluator.fill` does.

    Parameters
    ----------
    st, d, q, plan, factors
        As of `tell`, which has asked for it.
    room, columns, rows_left
        As of `gearmbs.native.pivots.write_plan`.

    Returns
    -------
    code : int
        CHOSEN or a failure.
    """
    if q.attempt > len(GENERIC_TURNS):
        return SINGULAR
    n = room.indptr.shape[0] - 1
    q.ready = True
    if q.attempt <= 1:
        q.plans += 1
        if q.vals.shape[0] >= FEWEST_ENTRIES and q.plans <= LEAVING_PLANS:
            _assemble(st, d, q, plan, factors, 0.0)
            rank = write_plan(d, room, columns, rows_left, q.vals, 0.0, True, True, NEGLIGIBLE)
            if rank < n:
                return rank if rank < 0 else SINGULAR
            if room.words[2 * LEFT_SRC + 1] > 0:
                return CHOSEN
    _assemble(st, d, q, plan, factors, GENERIC_TURNS[max(q.attempt, 1) - 1])
    rank = write_plan(d, room, columns, rows_left, q.vals, 0.0, False, False, NEGLIGIBLE)
    if rank < n:
        return rank if rank < 0 else SINGULAR
    return CHOSEN


@njit(cache=True, error_model="numpy", nogil=True)
def factor_for_outputs(d, q, plan, factors):
    """Factor the matrix of accelerations with pivots that have just been chosen, and allow their factors to grow."""
    q.growth = max(GROWTH_LIMIT, 100.0 * factor_at(d.factor)(plan, factors, q.vals))
    return TOLD
