"""Output at given times and event location, both on the polynomial of the last step."""

from __future__ import annotations

from numba import float64, int64, njit, types

from gearmbs.dae.dense_output import combine, lagrange_weights
from gearmbs.dae.integrators.run_state import (
    HAS_EVENTS,
    N_CROSSINGS,
    NEXT_OUTPUT,
    SLOPE,
    VALUE,
    Y_INT,
    YP,
    YP_INT,
    Y,
)
from gearmbs.dae.problem import EVENTS_SIG

ROOT_ITERATIONS = 80
ROOT_EPS = 4e-16

RECORD = 0
STOP = 1
RESTART = 2

_VEC = float64[::1]
_IVEC = int64[::1]
_MAT = float64[:, ::1]


@njit(types.void(float64, int64, _VEC, _MAT, _MAT, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def interpolate(t, k, times, hist, small, y, yp):
    """Write y and y' at ``t`` from the order-k polynomial through the newest k + 1 points."""
    lagrange_weights(t, times, k + 1, small[VALUE], small[SLOPE])
    combine(small[VALUE], small[SLOPE], k + 1, hist, 0, y, yp)


@njit(
    types.void(float64, int64, _IVEC, _VEC, _MAT, _MAT, _MAT, _VEC, _MAT, _MAT),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def write_outputs(t, k, count, times, hist, vec, small, outputs, y_out, yp_out):
    """Write all outputs up to ``t``, which lies in the last step; at its very end the corrector's values."""
    n = hist.shape[1]
    while count[NEXT_OUTPUT] < outputs.shape[0] and outputs[count[NEXT_OUTPUT]] <= t:
        row = count[NEXT_OUTPUT]
        if outputs[row] == times[0]:
            for i in range(n):
                y_out[row, i] = vec[Y, i]
                yp_out[row, i] = vec[YP, i]
        else:
            interpolate(outputs[row], k, times, hist, small, y_out[row], yp_out[row])
        count[NEXT_OUTPUT] = row + 1


@njit(
    float64(types.FunctionType(EVENTS_SIG), int64, int64, _VEC, _MAT, _MAT, _MAT, _VEC, _VEC, _IVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _root(events, which, k, times, hist, vec, small, g_old, g_work, idata, rdata, work):
    """Return the time in the last step where event ``which`` changes sign (Illinois method on the polynomial).

    ``g_work`` comes in with the event functions at the end of the step.
    """
    y = vec[Y_INT]
    yp = vec[YP_INT]
    a = times[1]
    b = times[0]
    fa = g_old[which]
    fb = g_work[which]
    side = 0
    for _ in range(ROOT_ITERATIONS):
        if fb == 0.0 or abs(b - a) <= ROOT_EPS * max(abs(a), abs(b)):
            break
        t = b - fb * (b - a) / (fb - fa)
        if not (min(a, b) < t < max(a, b)):
            t = 0.5 * (a + b)
            if t == a or t == b:
                break
        interpolate(t, k, times, hist, small, y, yp)
        events(t, y, yp, g_work, idata, rdata, work)
        f = g_work[which]
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


@njit(
    types.UniTuple(float64, 2)(
        types.FunctionType(EVENTS_SIG),
        float64,
        int64,
        _IVEC,
        _VEC,
        _MAT,
        _MAT,
        _MAT,
        _VEC,
        _VEC,
        int64[:, ::1],
        _VEC,
        _IVEC,
        _MAT,
        _IVEC,
        _VEC,
        _VEC,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def locate_events(
    events, t, k, count, times, hist, vec, small, g_old, g_new, rules, hit_t, hit_which, hit_y, idata, rdata, work
):
    """Find and store the crossings of the last step.

    Returns
    -------
    cut : float
        Time of the first crossing that stops or restarts the run, ``t`` without one.
    action : float
        RECORD, STOP or RESTART at that time.
    """
    n_events = count[HAS_EVENTS]
    n = hist.shape[1]
    first = count[N_CROSSINGS]
    cut = t
    action = RECORD
    for e in range(n_events):
        events(t, vec[Y], vec[YP], g_new, idata, rdata, work)
        rising = g_old[e] < 0.0 and g_new[e] >= 0.0
        falling = g_old[e] > 0.0 and g_new[e] <= 0.0
        if not ((rising and rules[0, e] >= 0) or (falling and rules[0, e] <= 0)):
            continue
        root = _root(events, e, k, times, hist, vec, small, g_old, g_new, idata, rdata, work)
        acts = rules[1, e] == RESTART or (rules[1, e] == STOP and rules[2, e] <= 1)
        if acts and (action == RECORD or root < cut):
            cut = root
            action = rules[1, e]
        # insertion keeps the crossings of one step in order of time
        p = count[N_CROSSINGS]
        while p > first and hit_t[p - 1] > root:
            hit_t[p] = hit_t[p - 1]
            hit_which[p] = hit_which[p - 1]
            p -= 1
        hit_t[p] = root
        hit_which[p] = e
        count[N_CROSSINGS] += 1
    while count[N_CROSSINGS] > first and hit_t[count[N_CROSSINGS] - 1] > cut:
        count[N_CROSSINGS] -= 1
    for p in range(first, count[N_CROSSINGS]):
        rules[2, hit_which[p]] -= 1
        interpolate(hit_t[p], k, times, hist, small, vec[Y_INT], vec[YP_INT])
        for i in range(n):
            hit_y[p, i] = vec[Y_INT, i]
    events(t, vec[Y], vec[YP], g_new, idata, rdata, work)
    return cut, float(action)
