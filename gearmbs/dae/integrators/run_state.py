"""State of an integration: everything the compiled loop needs to stop anywhere and go on.

Its members are attributes, ``st.order``, ``st.y_pred``, in compiled code and in Python alike.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import (
    KEPT_LAYOUTS,
    BlockLayout,
    IndexVector,
    IntVector,
    Matrix,
    Struct,
    Vector,
    matrix_at,
    vector_at,
)

# return codes of the compiled loop; zero and above are not failures
RUNNING = 0
DONE = 1
TERMINAL = 2
PAUSED = 3
REPIVOT = 4
BUFFER_FULL = 5
FAIL_NOT_FINITE = -3
FAIL_STEP_TOO_SMALL = -4
FAIL_TOO_MANY_REJECTIONS = -5
FAIL_TOO_MANY_STEPS = -7
FAIL_NEWTON = -9

WINDOW = 4 * HISTORY
"""Rows of the window that slides over the history; the longer, the more seldom it is moved back."""

KINK_MEMORY = 64
"""Steps after a refused one for which derivatives of the solution count as jumping; see `controller.meets_kinks`."""

ANSWER = 7
"""Vectors of the answer to a change of an input, see `gearmbs.dae.integrators.stepping.jumps`."""
MAX_NODES = 2 * HISTORY
"""Length of the vectors that hold coefficients of a step."""


class RunState(Struct):
    """Scalars and arrays of one run; the scalars are described where they are declared.

    Attributes
    ----------
    window_t : ndarray, shape (WINDOW,)
        Times of the stored points. From ``newest`` on, newest first; see `history`.
    window_y : ndarray, shape (WINDOW * n,)
        Values at these times, row after row.
    y, yp : ndarray, shape (n,)
        Iterate of the corrector, in the end its result.
    y_pred, yp_pred : ndarray, shape (n,)
        Prediction.
    res, delta : ndarray, shape (n,)
        Residual; last correction, or corrector minus predictor.
    y_between, yp_between : ndarray, shape (n,)
        Values inside the last step.
    yp_start : ndarray, shape (n,)
        Rates with which a run starts, or starts afresh.
    w_error, w_newton : ndarray, shape (n,)
        Weights of the error test and of the corrector test.
    weight : ndarray, shape (n,)
        Reciprocal tolerances of all unknowns.
    atol : ndarray, shape (n,)
        Absolute tolerances.
    controlled, tested, differential, coupled : ndarray, shape (n,)
        1 for unknowns under error control, for those the corrector test looks at, for those that cannot jump
        (`DAEProblem.goes_on`: their derivative appears, or they follow from such ones, as velocities do from momenta),
        and for those that it judges by their tolerance whatever the step: controlled, differential, or of index one.
    index_one : ndarray, shape (n,)
        1 for algebraic unknowns that equations without derivatives determine, else 0.
    value, slope, nodes, respacing : ndarray, shape (MAX_NODES,), and (HISTORY, MAX_NODES) for the last
        Coefficients: of interpolation for values and slopes, times of points, weights of re-interpolation.
    answer : ndarray, shape (ANSWER * n,)
        Answer of the linear equations to a unit of an input, see `gearmbs.dae.integrators.stepping.jumps`.
    jac, jac_slope, matrix : ndarray
        CSC values: the Newton matrix at its last evaluation, its derivative dG/dy' by the leading coefficient, and the
        matrix carried over to the current leading coefficient, which is the one that is factored.
    carried : ndarray
        Entries with a derivative by the leading coefficient, of which ``n_carried`` are taken.
    entry_row, entry_col : ndarray
        Equation and unknown of each entry.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.
    stops : ndarray
        Times to land on, at which the equations may jump.
    outputs : ndarray, shape (m,)
        Output times.
    y_out, yp_out : ndarray, shape (m, n)
        Outputs.
    kept, kept_out : ndarray, shapes (p,) and (m, p)
        Places in ``rdata`` of counted turns, and what stood there at each output.
    watched : ndarray of int64, shape (w,)
        Places in ``work`` that are recorded with each step.
    record_t, record_h, record_order, record_y : ndarray
        End, size, order and result of accepted steps since the last call, of ``record_y`` (records, n + w) with what
        the last evaluation left in the watched places; rows of order 0 are history alone.
    g_old, g_new : ndarray
        Event functions at the last accepted point and at the new one.
    g_between : ndarray, shape (samples, n_events)
        Event functions over the last step.
    event_direction, event_action, event_left : ndarray of int64, shape (n_events,)
        Crossings that count, what they do, and how many are left until a stop.
    crossing_t, crossing_event, crossing_y : ndarray
        Crossings since the last call.
    """

    # what is asked for
    t_end: float
    h_max: float
    h_min: float
    rtol: float
    max_order: int
    max_iterations: int
    max_steps: int  # 0: no limit
    n_events: int
    most_crossings: int  # that one step may have
    fixed_leading: bool  # GSTIFF
    interpolate: bool  # outputs by interpolation, or by steps that land on them
    has_hook: bool
    has_index_one: bool
    nonlinear_rates: bool  # whether G is not linear in y'
    watches_poles: bool  # whether rates may be infinite, see `branches.passes_pole`
    watches_pencil: bool  # whether the sign of the determinant is watched, see `branches.keeps_its_index`
    constrained: bool  # whether there are multipliers, or what is like them: unknowns of index two and more
    keep_rows: bool  # whether y of every step is recorded
    step_in_weights: bool  # whether the size of the step enters the weights of the corrector test
    t_pause: float  # the loop returns after the first step that ends here or later
    code: int  # with which the compiled loop has returned, RUNNING where that has been seen to
    # where the run stands
    t: float  # end of the last accepted step
    h: float  # size wanted of the next step
    order: int
    newest: int  # row of the window with the newest point, or with the end of the open step
    n_past: int  # points accepted and not forgotten, at most HISTORY
    since_change: int  # steps since order or size last changed
    caution: int  # steps without growth still to come after a failure
    starting: bool  # whether order and size still grow after a start, see `controller.after_start`
    passing: bool  # whether the open step is the first beyond a stop or an event
    landing: bool  # whether the open step ends at a stop
    jump_before_stop: bool  # by rounding, so that steps that land on the stop take the equations before it
    start_tries: int  # attempts of a first step that the error test has refused
    h_tried: float  # size of the last of them
    rate_jumped: int  # unknown whose rate the first of them has found to have jumped the most, -1 for none
    rate_before: float  # before the jump
    blocks: int  # blocks of points tried behind it, see `restart.take_block`
    h_block: float  # distance of the points of the next one
    since_kink: int  # steps since one that was refused, or had an error not foretold; see `controller.meets_kinks`
    turned: int  # place of the input whose line has turned last, -1 for none
    turn_moves: float  # tolerances that points move by for a turn of one, at the reach of the points then
    turn_reach: float
    turns_trusted: int  # turns since that was found
    answered: int  # place of the input whose answer is at hand, -1 for none
    answer_change: float  # of the input from which it was found
    answer_gamma: float  # leading coefficient of its series
    answer_jacobians: int  # evaluations of the matrix until then
    asked: float  # communication point that a held run goes to, -inf behind a jump until the next one is asked for
    jumps_in_turn: int  # communication points in a row at which the equations have jumped
    # the open step
    open: bool  # its row is taken
    t_old: float
    t_new: float
    t_seen: float  # where the equations are evaluated: t_new, or just before where the step lands on a stop
    step: float  # t_new - t_old
    h_wanted: float  # size before it was fitted to a stop
    h_first: float  # size of the first attempt
    h_refused: float  # size of the last attempt
    gamma: float  # leading coefficient: y' = y'_pred + gamma (y - y_pred)
    error_constant: float  # local error in units of corrector minus predictor
    error: float  # of the last refused attempt, in units of the tolerance
    error_fails: int
    newton_fails: int
    nan_fails: int
    singular_fails: int
    worst: int  # unknown, or equation, behind the last failure; -1 - e for event e
    worst_error: int  # unknown behind the last failure of the error test
    worst_row: int  # equation furthest from holding where the corrector got no further, -1 for none
    index_changes: bool  # the last attempt met a singular pencil
    jumped: int  # unknown of index one that left its branch, -1 for none
    jump_from: float
    jump_to: float
    pole: int  # unknown whose rate has a pole that a step of the run has met, -1 for none
    pole_met: bool  # whether an attempt of the open step has
    leapt: int  # unknown whose own derivative was a multiple of the one before at the last evaluation, -1 for none
    pole_at: float  # its value there
    violation: float  # its residual, in units of what tolerances and rounding explain
    # the Newton matrix
    matrix_wanted: bool  # to be evaluated at the next prediction
    matrix_fresh: bool  # evaluated in this step
    matrix_age: int  # steps since its evaluation
    slope_age: int  # evaluations since that of its derivative by gamma
    n_carried: int  # entries that depend on the leading coefficient
    matrix_judged: bool  # whether what the plan leaves out has been looked at since the evaluation
    gamma_evaluated: float
    gamma_factored: float
    growth_limit: float  # growth of its factors beyond which pivots are chosen anew
    gamma_planned: float  # leading coefficient at which pivots, and entries to leave out, were chosen
    plan_sign: float  # sign of the permutations of its pivots
    sign_last: float  # of the determinant of the factored matrix at the last accepted step, 0 if it is not known
    sign_pencil: float  # of the determinant of dG/dy + gamma dG/dy' for large gamma, 0 likewise
    t_pencil: float  # where that was seen
    gamma_large: float  # the least of these gamma
    rate: float  # of convergence of the corrector, as last seen
    matrix_dear: bool  # whether it takes many residuals to evaluate and to factor, as with bodies that deform
    rate_allowed: float  # beyond which the matrix is evaluated anew for the next step
    drop_level: int  # how large pivots may be to be left out near a singular position
    drop_age: int
    drop_failed: bool  # whether setting pivots aside has not helped in this step
    drop_rounds: int
    left_out: bool  # whether entries larger than rounding may be left out of the matrix
    doubts: int  # failures of the corrector for which the entries left out of the matrix were suspected
    # steps limited by rounding
    noise: float  # passed on to the history, in units of the tolerance
    noise_left: int  # steps until it has left the history
    noise_run: int  # such steps in a row
    noise_before: float  # both before this step
    noise_left_before: int
    noisy: bool  # whether this step was taken so
    # outputs and records
    next_output: int
    next_stop: int
    n_records: int
    n_crossings: int
    # what it has cost
    steps: int
    error_rejections: int
    newton_rejections: int
    restarts: int
    residuals: int
    jacobians: int
    factorizations: int
    solves: int
    noise_limited: int
    # arrays
    window_t: Vector
    window_y: Vector
    y: Vector
    yp: Vector
    y_pred: Vector
    yp_pred: Vector
    res: Vector
    delta: Vector
    y_between: Vector
    yp_between: Vector
    yp_start: Vector
    w_error: Vector
    w_newton: Vector
    weight: Vector
    atol: Vector
    controlled: Vector
    tested: Vector
    differential: Vector
    coupled: Vector
    index_one: Vector
    value: Vector
    slope: Vector
    nodes: Vector
    respacing: Matrix
    answer: Vector
    jac: Vector
    jac_slope: Vector
    matrix: Vector
    carried: IndexVector
    entry_row: IndexVector
    entry_col: IndexVector
    idata: IntVector
    rdata: Vector
    work: Vector
    stops: Vector
    outputs: Vector
    y_out: Matrix
    yp_out: Matrix
    kept: IntVector
    kept_out: Matrix
    watched: IntVector
    record_t: Vector
    record_h: Vector
    record_order: IntVector
    record_y: Matrix
    g_old: Vector
    g_new: Vector
    g_between: Matrix
    event_direction: IntVector
    event_action: IntVector
    event_left: IntVector
    crossing_t: Vector
    crossing_event: IntVector
    crossing_y: Matrix


STATE_TYPE = RunState.struct_kind


PER_UNKNOWN = (
    "y", "yp", "y_pred", "yp_pred", "res", "delta", "y_between", "yp_between", "yp_start",
)  # fmt: skip
SET_PER_UNKNOWN = (
    "w_error", "w_newton", "weight", "atol", "controlled", "tested", "differential", "coupled", "index_one",
)  # fmt: skip
PER_ENTRY = ("jac", "jac_slope", "matrix", "carried")
COEFFICIENTS = ("value", "slope", "nodes")
PER_EVENT = ("g_new", "event_direction", "event_action")


class Sizes(NamedTuple):
    """Sizes of the arrays of a run.

    Attributes
    ----------
    n, nnz : int
        Unknowns; entries of the matrix.
    idata, rdata, work : int
        Tables and scratch of the problem.
    stops : int
        Times to land on.
    events, samples, crossings, records : int
        Event functions, and their samples over a step; places for crossings, and for accepted steps, between two calls
        of the compiled loop.
    """

    n: int
    nnz: int
    idata: int
    rdata: int
    work: int
    stops: int
    events: int
    samples: int
    crossings: int
    records: int


@lru_cache(maxsize=KEPT_LAYOUTS)
def state_layout(sizes: Sizes) -> BlockLayout[RunState]:
    """Return where the arrays of a state stand; outputs and ``record_y``, which outlive it or are large, are given."""
    n, records, crossings = sizes.n, sizes.records, sizes.crossings
    return BlockLayout(
        RunState,
        {
            **dict.fromkeys(SET_PER_UNKNOWN, n),
            **dict.fromkeys(("entry_row", "entry_col"), sizes.nnz),
            "stops": sizes.stops,
            # what states take along, together
            "window_t": WINDOW,
            "window_y": WINDOW * n,
            **dict.fromkeys(PER_UNKNOWN, n),
            **dict.fromkeys(PER_ENTRY, sizes.nnz),
            **dict.fromkeys(COEFFICIENTS, MAX_NODES),
            "respacing": (HISTORY, MAX_NODES),
            "answer": ANSWER * n,
            **dict.fromkeys(("g_old", "event_left"), max(1, sizes.events)),
            "idata": sizes.idata,
            "rdata": sizes.rdata,
            "work": max(1, sizes.work),
            # up to here
            **dict.fromkeys(PER_EVENT, max(1, sizes.events)),
            "g_between": (sizes.samples, max(1, sizes.events)),
            **dict.fromkeys(("crossing_t", "crossing_event"), crossings),
            "crossing_y": (crossings if sizes.events else 1, n),
            **dict.fromkeys(("record_t", "record_h", "record_order"), records),
        },
    )


# The history of a run: a window of rows that slides, so that a step stores its point without moving the others.
#
# Points stand newest first from row ``st.newest`` of the window on. A step takes the row before; at the front of the
# window the rows still needed are moved to its end, once in many steps.


@njit(cache=True, nogil=True, error_model="numpy")
def copy(source, target):
    """Copy a vector; a slice assignment would bring numba's checks of shapes and their messages with it."""
    for i in range(source.shape[0]):
        target[i] = source[i]


@njit(cache=True, nogil=True, error_model="numpy")
def times_from(st, first):
    """Return the times of the stored points from the ``first``-th on, newest first.

    With a step open the 0-th is its end, the first the newest accepted one.
    """
    return vector_at(st.window_t, st.newest + first, HISTORY - first)


@njit(cache=True, nogil=True, error_model="numpy")
def rows_from(st, first):
    """Return the values of the stored points from the ``first``-th on, shape (HISTORY - first, n)."""
    n = st.y.shape[0]
    return matrix_at(st.window_y, (st.newest + first) * n, HISTORY - first, n)


@njit(cache=True, nogil=True, error_model="numpy")
def open_row(st):
    """Make room for a new point in front of the stored ones."""
    if st.newest == 0:
        n = st.y.shape[0]
        first = WINDOW - HISTORY + 1
        for j in range(min(st.n_past, HISTORY - 1)):
            st.window_t[first + j] = st.window_t[j]
            for i in range(n):
                st.window_y[(first + j) * n + i] = st.window_y[j * n + i]
        st.newest = first
    st.newest -= 1


@njit(cache=True, nogil=True, error_model="numpy")
def resample(rows, k, weights, old):
    """Replace the rows 1 to k by ``sum_m weights[j, m] rows[m]`` over all rows from 0 to k; ``old`` is scratch."""
    for i in range(rows.shape[1]):
        for m in range(k + 1):
            old[m] = rows[m, i]
        for j in range(1, k + 1):
            v = 0.0
            for m in range(k + 1):
                v += weights[j, m] * old[m]
            rows[j, i] = v


@njit(cache=True, nogil=True, error_model="numpy")
def respace(st):
    """Re-interpolate the history to the open step's size: fixed leading coefficients (GSTIFF).

    Points older than the newest are moved to ``t_old - j h`` on the polynomial of the order to be used.

    Returns
    -------
    moved : bool
    """
    times, hist = times_from(st, 1), rows_from(st, 1)
    h = st.step
    k = min(st.order, st.n_past - 1)
    st.order = max(k, 1)
    if k < 1:
        return False
    t = times[0]
    if abs((t - times[1]) - h) <= 1e-10 * h + 4.0 * EPS * abs(t):
        return False
    weights = st.respacing
    for j in range(1, k + 1):
        # value weights of the polynomial through the k + 1 old points at the new place
        for m in range(k + 1):
            w = 1.0
            for l in range(k + 1):
                if l != m:
                    w *= (t - j * h - times[l]) / (times[m] - times[l])
            weights[j, m] = w
    resample(hist, k, weights, st.nodes)
    moved = times[1] != t - h
    for j in range(1, k + 1):
        times[j] = t - j * h
    st.n_past = k + 1
    st.since_change = 0
    return moved


@njit(cache=True, nogil=True, error_model="numpy")
def record_history(st, first):
    """Append the rewritten history from the ``first``-th point on, oldest first, as records of order 0."""
    times, hist = times_from(st, first), rows_from(st, first)
    for j in range(min(st.n_past, HISTORY - 1) - 1, -1, -1):
        p = st.n_records
        st.record_t[p] = times[j]
        st.record_h[p] = 0.0
        st.record_order[p] = 0
        if st.keep_rows:
            copy(hist[j], st.record_y[p])
        st.n_records = p + 1


@njit(cache=True, nogil=True, error_model="numpy")
def forget(st):
    """Forget the history but its newest point and go on at order one."""
    st.n_past = 1
    st.order = 1
    st.starting = True
    st.start_tries = 0
    st.since_change = 0
    st.caution = 0
    st.matrix_wanted = True
    st.noise_left = 0
    st.noise_run = 0
    st.noise = 0.0


def newest_point(st: RunState) -> np.ndarray:
    """Return the values of the newest stored point, for Python, shape (n,)."""
    n = len(st.y)
    first = int(st.newest) * n
    return st.window_y[first : first + n]
