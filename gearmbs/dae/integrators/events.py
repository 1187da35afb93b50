"""Output at given times and event location, both on the polynomial of the last step."""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.dense_output import combine, lagrange_weights
from gearmbs.dae.integrators.history import copy, rows_from, times_from

SECANTS = 20
"""Tries by secants; the root of a smooth function takes some ten."""
ROOT_ITERATIONS = 80
"""Tries in all; the last 60 halve what is left, to rounding whatever the function does: a jump has no root."""
ROOT_EPS = 4e-16

RECORD = 0
STOP = 1
RESTART = 2


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(st, t, y, yp):
    """Write y and y' at ``t`` from the polynomial of the last step, of its order through the newest points."""
    count = st.order + 1
    lagrange_weights(t, times_from(st, 0), count, st.value, st.slope)
    combine(st.value, st.slope, count, rows_from(st, 0), 0, y, yp)


@njit(cache=True, nogil=True, error_model="numpy")
def write_outputs(t, st):
    """Write all outputs up to ``t``, which lies in the last step; at its very end the corrector's values."""
    while st.next_output < st.outputs.shape[0] and st.outputs[st.next_output] <= t:
        row = st.next_output
        if st.outputs[row] == st.t_new:
            copy(st.y, st.y_out[row])
            copy(st.yp, st.yp_out[row])
        else:
            interpolate(st, st.outputs[row], st.y_out[row], st.yp_out[row])
        st.next_output = row + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _root(functions, st, which):
    """Return where in the last step event ``which`` changes sign: Illinois method on the polynomial, then bisection.

    ``st.g_new`` comes in with the event functions at the end of the step, and is overwritten.
    """
    y, yp, g = st.y_between, st.yp_between, st.g_new
    a = st.t_old
    b = st.t_new
    fa = st.g_old[which]
    fb = g[which]
    side = 0
    for k in range(ROOT_ITERATIONS):
        if fb == 0.0 or abs(b - a) <= ROOT_EPS * max(abs(a), abs(b)):
            break
        t = b - fb * (b - a) / (fb - fa)
        if k >= SECANTS or not (min(a, b) < t < max(a, b)):
            t = 0.5 * (a + b)
            if t == a or t == b:
                break
        interpolate(st, t, y, yp)
        functions.events(t, y, yp, g, st.idata, st.rdata, st.work)
        f = g[which]
        if f == 0.0:
            return t
        if (f > 0.0) == (fb > 0.0):
            b = t
            fb = f
            if side == 1:
                fa *= 0.5
            side = 1
        else:
            a = t
            fa = f
            if side == -1:
                fb *= 0.5
            side = -1
    return b


@njit(cache=True, nogil=True, error_model="numpy")
def _store_crossing(st, first, root, which):
    """Insert a crossing among those of the step, from place ``first`` on, in order of time."""
    p = st.n_crossings
    while p > first and st.crossing_t[p - 1] > root:
        st.crossing_t[p] = st.crossing_t[p - 1]
        st.crossing_event[p] = st.crossing_event[p - 1]
        p -= 1
    st.crossing_t[p] = root
    st.crossing_event[p] = which
    st.n_crossings += 1


@njit(cache=True, nogil=True, error_model="numpy")
def locate_events(functions, st):
    """Find and store the crossings of the last step; leave the event functions at its end in ``st.g_new``.

    Returns
    -------
    cut : float
        Time of the first crossing that stops or restarts the run, the end of the step without one.
    action : int
        RECORD, STOP or RESTART at that time.
    """
    t = st.t_new
    first = st.n_crossings
    cut = t
    action = RECORD
    for e in range(st.n_events):
        functions.events(t, st.y, st.yp, st.g_new, st.idata, st.rdata, st.work)
        rising = st.g_old[e] < 0.0 and st.g_new[e] >= 0.0
        falling = st.g_old[e] > 0.0 and st.g_new[e] <= 0.0
        if not ((rising and st.event_direction[e] >= 0) or (falling and st.event_direction[e] <= 0)):
            continue
        root = _root(functions, st, e)
        does = st.event_action[e]
        acts = does == RESTART or (does == STOP and st.event_left[e] <= 1)
        if acts and (action == RECORD or root < cut):
            cut = root
            action = does
        _store_crossing(st, first, root, e)
    while st.n_crossings > first and st.crossing_t[st.n_crossings - 1] > cut:
        st.n_crossings -= 1
    for p in range(first, st.n_crossings):
        st.event_left[st.crossing_event[p]] -= 1
        interpolate(st, st.crossing_t[p], st.y_between, st.yp_between)
        copy(st.y_between, st.crossing_y[p])
    functions.events(t, st.y, st.yp, st.g_new, st.idata, st.rdata, st.work)
    return cut, action


@njit(cache=True, nogil=True, error_model="numpy")
def end_of_step(st):
    """Keep the event functions of the end of the step for the next one; return whether they are finite."""
    for e in range(st.n_events):
        if not np.isfinite(st.g_new[e]):
            st.worst = -1 - e
            return False
        st.g_old[e] = st.g_new[e]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def cut_step(functions, st, cut):
    """Let the last step end at a crossing: replace its end by the polynomial's value there."""
    interpolate(st, cut, st.y_between, st.yp_between)
    copy(st.y_between, st.y)
    copy(st.yp_between, st.yp)
    copy(st.y_between, rows_from(st, 0)[0])
    times_from(st, 0)[0] = cut
    st.t = cut
    functions.events(cut, st.y, st.yp, st.g_old, st.idata, st.rdata, st.work)
