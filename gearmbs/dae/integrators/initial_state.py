"""The state with which a run of WSTIFF or GSTIFF starts."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.corrector import set_weights
from gearmbs.dae.integrators.events import SAMPLES
from gearmbs.dae.integrators.newton_matrix import SLOPE_MAX_AGE
from gearmbs.dae.integrators.options import Options, event_rules
from gearmbs.dae.integrators.run_state import KINK_MEMORY, RunState, Sizes, newest_point, state_layout
from gearmbs.dae.problem import DAEProblem

MAX_ITERATIONS = 10
RECORD_BYTES = 8_000_000
CONSUMED_BYTES = 2_000_000
"""Of steps handed to a consumer at a time: what stays in the processor's cache, and outweighs the call of Python's."""

MOST_RECORDS = 8192
MOST_TIMES = 2048
"""Records where times, sizes and orders alone are kept."""

EVENT_BUFFER = 64
LARGEST_PENCIL = 100
"""Unknowns up to which the sign of the determinant is watched: a dense elimination takes 0.3 ms."""
LARGE_GAMMA = 1e6
"""Times the reciprocal span: faster growth than that would leave no solution, and differences of 1e-8 of the unknowns
change their rates by a hundredth of the unknowns a span."""
RATE_ALLOWED = 0.12
"""Rate of a corrector from which on the next step gets a new matrix: another iteration would cost more. Tuned, see the
table of constants."""
RATE_ALLOWED_IF_DEAR = 0.2
"""The same where a matrix is dear. Tuned, see the table of constants."""
DEAR = 12
"""Residuals from which on a matrix is dear, and worth its price only at slower rates of the corrector."""


def initial_state(problem: DAEProblem, options: Options, outputs: np.ndarray, t_end: float, keep: bool) -> RunState:
    """Return the state at the start of a run, with all but the sizes of its steps.

    Parameters
    ----------
    problem : DAEProblem
    options : Options
    outputs : ndarray, shape (m,)
        Output times.
    t_end : float
        End of the run.
    keep : bool
        Whether the unknowns of every step are recorded.

    Raises
    ------
    ValueError
        For tolerances that are not positive, and rules that do not fit the event functions.
    """
    t0 = float(problem.t0)
    n_events = int(problem.n_events) if problem.events is not None else 0
    stops = options.stops(t0, t_end)
    st = _empty_state(problem, outputs, stops, n_events, _rows_of_records(problem.n, keep, options), keep)
    st.stops[:] = stops
    _set_tables(st, problem)
    _set_tolerances(st, problem, options, t_end - t0)
    _set_event_rules(st, n_events, options)
    st.t_end = t_end
    st.h_max = np.inf if options.max_step is None else options.max_step
    st.rtol = options.rtol
    st.rate_allowed = RATE_ALLOWED_IF_DEAR if problem.jacobian_residuals >= DEAR else RATE_ALLOWED
    st.max_order = options.highest_order if options.max_order is None else int(options.max_order)
    st.max_iterations = MAX_ITERATIONS if options.max_iterations is None else int(options.max_iterations)
    st.max_steps = int(options.max_steps or 0)
    st.n_events = n_events
    st.most_crossings = SAMPLES * n_events
    st.fixed_leading = options.method == "GSTIFF"
    st.interpolate = options.interpolates(outputs, stops)
    st.has_hook = problem.hook is not None
    st.keep_rows = keep
    st.step_in_weights = bool((st.tested > st.coupled).any())
    st.t = t0
    st.order = 1
    st.worst_row = st.jumped = st.pole = st.leapt = -1
    st.since_refused = KINK_MEMORY
    st.n_past = 1
    st.gamma_factored = 1.0
    st.left_out = problem.small_entries
    st.matrix_wanted = True
    st.slope_age = SLOPE_MAX_AGE
    st.window_t[st.newest] = t0
    newest_point(st)[:] = st.y
    set_weights(st, st.y, 1.0)
    _record_start(st)
    return st


def _rows_of_records(n: int, keep: bool, options: Options) -> int:
    """Return for how many accepted steps there is room between two calls of the compiled loop."""
    if not keep:
        return MOST_TIMES
    size = RECORD_BYTES if options.consumer is None else CONSUMED_BYTES
    return min(max(size // (8 * n), 8 * HISTORY), MOST_RECORDS)


def _empty_state(
    problem: DAEProblem, outputs: np.ndarray, stops: list[float], n_events: int, records: int, keep: bool
) -> RunState:
    n = problem.n
    sizes = Sizes(
        n=n,
        nnz=len(problem.indices),
        idata=len(problem.idata),
        rdata=len(problem.rdata),
        work=problem.work_size,
        stops=len(stops),
        events=n_events,
        samples=SAMPLES + 1 if n_events else 1,
        crossings=EVENT_BUFFER + SAMPLES * n_events,
        records=records,
    )
    return state_layout(sizes).new(
        outputs=outputs,
        y_out=np.empty((len(outputs), n)),
        yp_out=np.empty((len(outputs), n)),
        record_y=np.empty((records if keep else 1, n)),
    )


def _set_tables(st: RunState, problem: DAEProblem) -> None:
    """Copy the tables, which hooks and events may change, and the initial values."""
    st.idata[:] = problem.idata
    st.rdata[:] = problem.rdata
    st.entry_row[:] = problem.indices
    st.entry_col[:] = np.repeat(np.arange(problem.n), np.diff(problem.indptr))
    st.y[:] = problem.y0
    st.yp[:] = st.yp_start[:] = problem.yp0


def _set_tolerances(st: RunState, problem: DAEProblem, options: Options, span: float) -> None:
    """Set tolerances, and masks of the unknowns as numbers."""
    np.multiply(problem.atol_scale, options.tol, out=st.atol)
    if not st.atol.min(initial=np.inf) > 0.0:
        raise ValueError(f"atol_scale must be positive, is {problem.atol_scale[int(np.argmin(st.atol))]:g} somewhere")
    st.controlled[:] = problem.error_mask
    st.index_one[:] = 0.0 if problem.index_one is None else problem.index_one
    st.watches_pencil = problem.index_one is not None and problem.n <= LARGEST_PENCIL
    st.gamma_large = LARGE_GAMMA / span
    st.has_index_one = bool(st.index_one.any())
    st.nonlinear_rates = problem.nonlinear_rates
    st.tested[:] = np.maximum(st.controlled, st.index_one) if options.corrector == "modified" else 1.0
    st.differential[:] = problem.differential
    st.coupled[:] = np.maximum(np.maximum(st.controlled, st.differential), st.index_one)


def _set_event_rules(st: RunState, n_events: int, options: Options) -> None:
    """Set which crossings count, what they do, and how many are left; default all, nothing, and one until a stop."""
    st.event_left[:] = 1
    for name, values in event_rules(n_events, options).items():
        getattr(st, name)[:n_events] = values


def _record_start(st: RunState) -> None:
    """Make the start the first record, and the first output if one is wanted there."""
    st.n_records = 1
    st.record_t[0] = st.t
    st.record_y[0] = st.y
    if len(st.outputs) and st.outputs[0] == st.t:
        st.y_out[0] = st.y
        st.yp_out[0] = st.yp
        st.next_output = 1
