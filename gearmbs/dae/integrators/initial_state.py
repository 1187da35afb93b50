"""The state with which a run of WSTIFF or GSTIFF starts."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.history import newest_point
from gearmbs.dae.integrators.newton_matrix import SLOPE_MAX_AGE
from gearmbs.dae.integrators.options import Options, event_rules
from gearmbs.dae.integrators.run_state import KINK_MEMORY, RunState, new_state
from gearmbs.dae.integrators.weights import set_weights
from gearmbs.dae.problem import DAEProblem

NEWTON_TOLERANCE = 1.0
MAX_ITERATIONS = 10
RECORD_BYTES = 8_000_000
CONSUMED_BYTES = 2_000_000
"""Of steps handed to a consumer at a time: what stays in the processor's cache, and outweighs the call of Python's."""

MOST_RECORDS = 8192
EVENT_BUFFER = 64
RATE_ALLOWED = 0.12
RATE_ALLOWED_IF_DEAR = 0.2
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
    n = problem.n
    t0 = float(problem.t0)
    n_events = int(problem.n_events) if problem.events is not None else 0
    st = new_state(
        n,
        len(problem.indices),
        y=np.array(problem.y0, dtype=float),
        yp=np.array(problem.yp0, dtype=float),
        yp_start=np.array(problem.yp0, dtype=float),
        **_masks(problem, options),
        idata=np.array(problem.idata, dtype=np.int64),
        rdata=np.array(problem.rdata, dtype=float),
        work=np.zeros(max(1, problem.work_size)),
        stops=np.array(sorted(b for b in options.breakpoints if t0 < b < t_end), dtype=float),
        outputs=outputs,
        y_out=np.empty((len(outputs), n)),
        yp_out=np.empty((len(outputs), n)),
        **_record_buffers(n, keep, options.consumer is not None),
        **_event_buffers(n, n_events, options),
    )
    st.t_end = t_end
    st.h_max = np.inf if options.max_step is None else options.max_step
    st.rtol = options.rtol
    st.newton_tolerance = NEWTON_TOLERANCE
    st.rate_allowed = RATE_ALLOWED_IF_DEAR if problem.jacobian_residuals >= DEAR else RATE_ALLOWED
    st.max_order = options.highest_order if options.max_order is None else options.max_order
    st.max_iterations = MAX_ITERATIONS if options.max_iterations is None else options.max_iterations
    st.max_steps = options.max_steps or 0
    st.n_events = n_events
    st.fixed_leading = options.method == "GSTIFF"
    st.interpolate = options.interpolate
    st.has_hook = problem.hook is not None
    st.keep_rows = keep
    st.step_in_weights = bool((st.tested > st.coupled).any())
    st.t = t0
    st.order = 1
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


def _masks(problem: DAEProblem, options: Options) -> dict[str, np.ndarray]:
    """Return tolerances, and masks of the unknowns as numbers."""
    atol = options.tol * np.asarray(problem.atol_scale, dtype=float)
    if not (atol > 0).all():
        raise ValueError(f"atol_scale must be positive, is {problem.atol_scale[int(np.argmin(atol))]:g} somewhere")
    controlled = np.array(problem.error_mask, dtype=float)
    differential = np.array(problem.differential, dtype=float)
    return {
        "atol": atol,
        "controlled": controlled,
        "tested": controlled.copy() if options.corrector == "modified" else np.ones(problem.n),
        "differential": differential,
        "coupled": np.maximum(controlled, differential),
    }


def _record_buffers(n: int, keep: bool, consumed: bool) -> dict[str, np.ndarray]:
    size = CONSUMED_BYTES if consumed else RECORD_BYTES
    rows = int(np.clip(size // (8 * n), 8 * HISTORY, MOST_RECORDS)) if keep else MOST_RECORDS
    return {
        "record_t": np.zeros(rows),
        "record_h": np.zeros(rows),
        "record_order": np.zeros(rows, dtype=np.int64),
        "record_y": np.zeros((rows if keep else 1, n)),
    }


def _event_buffers(n: int, n_events: int, options: Options) -> dict[str, np.ndarray]:
    direction, action, left = event_rules(n_events, options)
    crossings = EVENT_BUFFER + n_events
    return {
        "g_old": np.zeros(max(1, n_events)),
        "g_new": np.zeros(max(1, n_events)),
        "event_direction": direction,
        "event_action": action,
        "event_left": left,
        "crossing_t": np.zeros(crossings),
        "crossing_event": np.zeros(crossings, dtype=np.int64),
        "crossing_y": np.zeros((crossings if n_events else 1, n)),
    }


def _record_start(st: RunState) -> None:
    """Make the start the first record, and the first output if one is wanted there."""
    st.n_records = 1
    st.record_t[0] = st.t
    st.record_y[0] = st.y
    if len(st.outputs) and st.outputs[0] == st.t:
        st.y_out[0] = st.y
        st.yp_out[0] = st.yp
        st.next_output = 1
