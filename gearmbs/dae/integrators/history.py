"""The history of a run: a window of rows that slides, so that a step stores its point without moving the others.

Points stand newest first from row ``st.newest`` of the window on. A step takes the row before; at the front of the
window the rows still needed are moved to its end, once in many steps.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.run_state import WINDOW, RunState

EPS = 2.220446049250313e-16


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
    old = st.nodes
    for i in range(hist.shape[1]):
        for m in range(k + 1):
            old[m] = hist[m, i]
        for j in range(1, k + 1):
            v = 0.0
            for m in range(k + 1):
                v += weights[j, m] * old[m]
            hist[j, i] = v
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
            for i in range(hist.shape[1]):
                st.record_y[p, i] = hist[j, i]
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
