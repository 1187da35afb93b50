"""What a run tells at the present point without Python: accelerations, reactions, loads, and sums of them by name."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.linalg.entry_lists import FEWEST_ENTRIES, LEAVING_PLANS, NEGLIGIBLE
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT
from gearmbs.dae.model.evaluator import FIXED_TURNS, GENERIC_TURNS, evaluate_rows
from gearmbs.dae.model.kinetic import write_kinetic_energy
from gearmbs.dae.model.members import AXES_SIG, EDGE_COLUMNS, PLACE_COLUMNS, TURN_COLUMNS, Members, expand
from gearmbs.dae.model.records import Records
from gearmbs.dae.result import Status
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector, matrix_at
from gearmbs.native.pivots import CHOSEN, LEFT_SRC, factor_at, write_plan
from gearmbs.native.series import number_of, tell_expressions

SINGULAR = int(Status.SINGULAR_JACOBIAN)
evaluate_at = caller(evaluate_rows.declared)
axes_at = caller(AXES_SIG)
expand_at = caller(expand.declared)
kinetic_at = caller(write_kinetic_energy.declared)

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
    home : ndarray
        Values of the matrix of accelerations at the home of pivots, see `gearmbs.dae.problem.DAEProblem`; empty without
        one.
    bodies, modal, integrals : ndarray
        Of `gearmbs.dae.model.kinetic.Inertias`.
    energy : ndarray, shape (1,)
        Kinetic energy, J.
    group, place, of_marker, row, edge, turn : ndarray
        Of `gearmbs.dae.model.members.Members`, each with all axes in one; empty where bodies are integrated one by one.
    own_pose, own_solution, own_phi, own_strayed, own_loads, own_force, own_moment : ndarray
        As ``pose`` to ``moment``, of what is integrated in their place.
    """

    evaluate: int  # address of `evaluate_rows`, which is compiled apart
    series: int  # of `evaluate_series`
    elastic_frames: int
    kinetic: int  # of `write_kinetic_energy`; 0 where no output needs it
    expand: int  # of `expand`, where bodies are integrated as one; 0 where not
    axes: int  # of `evaluate_axes`, where angles alone are integrated; 0 where not
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
    home: Vector
    bodies: Matrix
    modal: IntVector
    integrals: Vector
    energy: Vector
    group: IntVector
    place: Vector
    of_marker: IntVector
    row: IntVector
    edge: IntVector
    turn: IntVector
    own_pose: Matrix
    own_solution: Matrix
    own_phi: Matrix
    own_strayed: Vector
    own_loads: Vector
    own_force: Vector
    own_moment: Vector


TELLER_TYPE = Teller.struct_kind


@njit(cache=True, error_model="numpy", nogil=True)
def _records(q):
    """Return the records as what evaluates them takes them."""
    rows = q.phi.shape[1] // 3
    loads = q.loads.reshape((1, q.elements, q.columns))
    force, moment = q.force.reshape((1, rows, 3)), q.moment.reshape((1, rows, 3))
    return Records(q.pose, q.solution, loads, q.phi, force, moment, q.strayed)


@njit(cache=True, error_model="numpy", nogil=True)
def _solved(q):
    """Return the records of what is integrated."""
    if q.expand == 0:
        return _records(q)
    rows = q.own_phi.shape[1] // 3
    loads = q.own_loads.reshape((1, q.elements, q.columns))
    force, moment = q.own_force.reshape((1, rows, 3)), q.own_moment.reshape((1, rows, 3))
    return Records(q.own_pose, q.own_solution, loads, q.own_phi, force, moment, q.own_strayed)


@njit(cache=True, error_model="numpy", nogil=True)
def _members(q):
    """Return what bodies that are integrated as one are made of."""
    places, edges, turns = q.place.shape[0], q.edge.shape[0], q.turn.shape[0]
    return Members(
        q.group, matrix_at(q.place, 0, places // PLACE_COLUMNS, PLACE_COLUMNS), q.of_marker, q.row,
        matrix_at(q.edge, 0, edges // EDGE_COLUMNS, EDGE_COLUMNS),
        matrix_at(q.turn, 0, turns // TURN_COLUMNS, TURN_COLUMNS),
    )  # fmt: skip


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
        if not q.ready and q.axes == 0:
            return 0
    n = st.y.shape[0]
    t, y = np.empty(1), matrix_at(st.y_out, d.present * n, 1, n)
    t[0] = d.t
    if q.axes != 0:
        axes_at(q.axes)(0, 1, t, y, _table(d), q.rdata, q.work, _members(q), _records(q))
    else:
        done = evaluate_at(q.evaluate)(
            0, 1, t, y, q.slots, _table(d), q.rdata, q.work, q.vals, plan, factors, _solved(q), q.growth
        )
        if done == 0:
            q.attempt += 1
            return 0
        if q.expand != 0:
            expand_at(q.expand)(0, 1, t, _table(d), q.rdata, q.work, _members(q), _solved(q), _records(q))
        if q.home.shape[0] > 0 and q.attempt > 0:
            # these pivots were those of this point
            q.ready = False
    if q.kinetic != 0:
        kinetic_at(q.kinetic)(q.pose, q.bodies, q.modal, q.integrals, q.energy)
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
    evaluate_at(q.evaluate)(0, -1, t, y, q.slots, table, q.rdata, work, q.vals, plan, factors, _solved(q), GROWTH_LIMIT)


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
    if q.attempt > (len(GENERIC_TURNS) if q.home.shape[0] == 0 else len(FIXED_TURNS)):
        return SINGULAR
    n = room.indptr.shape[0] - 1
    q.ready = True
    if q.home.shape[0] > 0 and q.attempt == 0:
        q.vals[:] = q.home
        rank = write_plan(d, room, columns, rows_left, q.vals, 0.0, False, False, NEGLIGIBLE)
        return CHOSEN if rank == n else rank if rank < 0 else SINGULAR
    if q.home.shape[0] == 0 and q.attempt <= 1:
        q.plans += 1
        if q.vals.shape[0] >= FEWEST_ENTRIES and q.plans <= LEAVING_PLANS:
            _assemble(st, d, q, plan, factors, 0.0)
            rank = write_plan(d, room, columns, rows_left, q.vals, 0.0, True, True, NEGLIGIBLE)
            if rank < n:
                return rank if rank < 0 else SINGULAR
            if room.words[2 * LEFT_SRC + 1] > 0:
                return CHOSEN
    turn = GENERIC_TURNS[max(q.attempt, 1) - 1] if q.home.shape[0] == 0 else FIXED_TURNS[q.attempt - 1]
    _assemble(st, d, q, plan, factors, turn)
    rank = write_plan(d, room, columns, rows_left, q.vals, 0.0, False, False, NEGLIGIBLE)
    if rank < n:
        return rank if rank < 0 else SINGULAR
    return CHOSEN


@njit(cache=True, error_model="numpy", nogil=True)
def factor_for_outputs(d, q, plan, factors):
    """Factor the matrix of accelerations with pivots that have just been chosen, and allow their factors to grow."""
    q.growth = max(GROWTH_LIMIT, 100.0 * factor_at(d.factor)(plan, factors, q.vals))
    return TOLD
