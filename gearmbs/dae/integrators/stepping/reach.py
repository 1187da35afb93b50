"""The compiled way from one communication point to the next, for as long as there is nothing else to do."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.algebraic.part import PART_TYPE
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.run_state import (
    BUFFER_FULL,
    RUNNING,
    STATE_TYPE,
    copy,
    record_history,
    rows_from,
    times_from,
)
from gearmbs.dae.integrators.step import advance
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE
from gearmbs.dae.result import combine, lagrange_weights
from gearmbs.kernels.bound import FUNCTIONS_TYPE
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types
from gearmbs.kernels.pointers import address, caller, direct

CHUNK = 16
"""Accepted steps between two looks at the time reached."""
ADVANCE = int64(FUNCTIONS_TYPE, STATE_TYPE, PART_TYPE, PLAN_TYPE, FACTORS_TYPE, int64)
advance_at = caller(ADVANCE)


def address_of_advance() -> int:
    """Return where the compiled loop of steps is found in this process."""
    direct(advance)
    return address(advance, ADVANCE)


@njit(int64(STATE_TYPE), cache=True, nogil=True, error_model="numpy")
def drain(st):
    """Make room for further records but keep the points of a polynomial; return their number."""
    m = st.n_records
    kept = min(m, HISTORY)
    for j in range(kept):
        k = m - kept + j
        st.record_t[j], st.record_h[j], st.record_order[j] = st.record_t[k], st.record_h[k], st.record_order[k]
        if st.keep_rows:
            copy(st.record_y[k], st.record_y[j])
    st.n_records = kept
    return kept


@njit(types.void(STATE_TYPE, int64), cache=True, nogil=True, error_model="numpy")
def stand_behind(st, order):
    """Keep the window as records, the newest as the end of a step of an order, or 0 where the window does not tell it.

    Parameters
    ----------
    st : RunState
        With no step open.
    order : int
    """
    st.n_records = 0
    st.next_output = st.outputs.shape[0]
    record_history(st, 0)
    st.record_order[st.n_records - 1] = order


@njit(cache=True, nogil=True, error_model="numpy")
def write_within(st, part, t, row):
    """Write the values at ``t`` within the last step, as its outputs are, if the window tells them; return that."""
    order = st.record_order[st.n_records - 1]
    if order == 0 or part.count > 0:
        return False
    times, rows, y, yp = times_from(st, 0), rows_from(st, 0), st.y_out[row], st.yp_out[row]
    if t == times[0]:
        copy(st.y, y)
        copy(st.yp, yp)
    else:
        lagrange_weights(t, times, order + 1, part.value, part.slope)
        combine(part.value, part.slope, order + 1, rows, 0, y, yp)
    for c in range(st.kept.shape[0]):
        st.kept_out[row, c] = st.rdata[st.kept[c]]
    return True


NOT_BEGUN = 0
REACHED = 1
INTERRUPTED = 2
"""What `reach` returns."""


@njit(
    int64(FUNCTIONS_TYPE, STATE_TYPE, PART_TYPE, PLAN_TYPE, FACTORS_TYPE, int64, float64, int64, int64),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def reach(bound, st, part, plan, factors, advance_address, t, row, last):
    """Take steps until one ends at ``t`` or later, and write the values there; say whether that is done.

    Parameters
    ----------
    bound, st, part, plan, factors
        Of a run, see `advance`.
    advance_address : int
        Of `advance`, which is compiled apart.
    t : float
        Beyond the last step, or within it.
    row : int
        Of the outputs.
    last : int
        Steps from which on somebody has to look at how the run gets on.

    Returns
    -------
    code : int
        NOT_BEGUN where the values have to be told from Python; REACHED;
        INTERRUPTED where ``st.code`` has to be heeded, a look is due, or an event has come.
    """
    if t != st.asked:
        # not the rest of the way to a point that was asked for before
        if st.asked != -np.inf:
            st.jumps_in_turn = 0
        st.asked = t
    if t <= st.t:
        return REACHED if write_within(st, part, t, row) else NOT_BEGUN
    if t > st.t_end or st.code != RUNNING or st.steps >= last:
        return NOT_BEGUN
    st.outputs[row] = t
    st.t_pause = t
    st.next_output = row
    take = advance_at(advance_address)
    chunk = 1 if st.n_events > 0 else CHUNK
    while st.code == RUNNING and st.steps < last and st.n_crossings == 0:
        take(bound, st, part, plan, factors, chunk)
        if st.code == BUFFER_FULL:
            drain(st)
            st.code = RUNNING
        elif st.code == RUNNING and st.t >= t and st.n_crossings == 0:
            st.outputs[row] = np.inf
            return REACHED
    return INTERRUPTED
