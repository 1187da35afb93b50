"""Output at given times and event location, both on the polynomial of the last step.

Algebraic unknowns outside error control are solved for there, see `gearmbs.dae.integrators.algebraic`.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.algebraic.between import note_moves, settle_between
from gearmbs.dae.integrators.algebraic.instant import settle
from gearmbs.dae.integrators.corrector import GOLDEN_FRACTION
from gearmbs.dae.integrators.run_state import copy, rows_from, times_from
from gearmbs.kernels.jit import njit

SECANTS = 20
"""Tries by secants; the root of a smooth function takes some ten."""
ROOT_ITERATIONS = 80
"""Tries in all; the last 60 halve what is left, to rounding whatever the function does: a jump has no root."""
ROOT_EPS = 4e-16
"""Part of the time within which a crossing lies: one to three neighbouring doubles."""

SAMPLES = 64
"""Parts of a step, at most, in each of which an event function may change sign once."""
COARSEST = 16
"""Samples from one to the next at first: a quarter of the step."""
STRAIGHT = 0.2
"""Part of its range over the step by which an event function may leave its chords where no more samples are taken: a
parabola between two chords of a quarter of its arc leaves them by a sixteenth, a full wave by all."""

TURNS = 40
"""Tries for a value beyond zero where an event function turns within a step, by golden section: to 1e-8 of the step, at
which a parabola is at its vertex to rounding."""
RECORD = 0
STOP = 1
RESTART = 2


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(functions, st, part, t, y, yp):
    """Write y and y' at ``t`` from the polynomial of the last step, of its order through the newest points."""
    settle_between(
        functions, part, t, st.t_old, rows_from(st, 1)[0], st.step, times_from(st, 0), rows_from(st, 0), 0,
        st.order + 1, y, yp, st.idata, st.rdata, st.work,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def write_outputs(functions, st, part, t):
    """Write all outputs up to ``t``, which lies in the last step; at its very end the corrector's values."""
    while st.next_output < st.outputs.shape[0] and st.outputs[st.next_output] <= t:
        row = st.next_output
        if st.outputs[row] == st.t_new:
            copy(st.y, st.y_out[row])
            copy(st.yp, st.yp_out[row])
            if part.count > 0:
                settle(functions, part, st.t_new, st.y_out[row], st.yp_out[row], st.step, st.idata, st.rdata, st.work)
        else:
            interpolate(functions, st, part, st.outputs[row], st.y_out[row], st.yp_out[row])
            note_moves(part, st.outputs[row], st.y_out[row], st.step, st.rdata)
        for c in range(st.kept.shape[0]):
            st.kept_out[row, c] = st.rdata[st.kept[c]]
        st.next_output = row + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _root(functions, st, part, which, a, fa, b, fb):
    """Return where event ``which`` changes sign between a and b: Illinois method on the polynomial, then bisection.

    ``st.g_new`` is overwritten.

    Parameters
    ----------
    functions, st, part
        As everywhere in a run.
    which : int
        The event.
    a, b : float
        Times on both sides of the change, in any order.
    fa, fb : float
        Values of the event there.
    """
    y, yp, g = st.y_between, st.yp_between, st.g_new
    side = 0
    for k in range(ROOT_ITERATIONS):
        if fb == 0.0 or abs(b - a) <= ROOT_EPS * max(abs(a), abs(b)):
            break
        # secant through both ends
        t = b - fb * (b - a) / (fb - fa)
        if k >= SECANTS or not (min(a, b) < t < max(a, b)):
            t = 0.5 * (a + b)
            if t == a or t == b:
                break
        interpolate(functions, st, part, t, y, yp)
        functions.events(t, y, yp, g, st.idata, st.rdata, st.work)
        f = g[which]
        if f == 0.0:
            return t
        if (f > 0.0) == (fb > 0.0):
            b = t
            fb = f
            # Illinois: an end that stays twice has its value halved, so that the secant passes it
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
def _sample_time(st, i):
    """Return the time of sample i of the last step."""
    return st.t_new if i == SAMPLES else st.t_old + (st.t_new - st.t_old) * (i / SAMPLES)


@njit(cache=True, nogil=True, error_model="numpy")
def _sample(functions, st, part):
    """Sample the event functions over the last step into ``st.g_between``; return the samples from one to the next.

    Functions of differential unknowns are as smooth as the error test has made these: the ends of the step tell, and
    what `_turn_beyond_zero` finds where they turn. What algebraic unknowns do between is unknown to it, so that samples
    are halved until the functions follow their chords.
    """
    g = st.g_between
    for e in range(st.n_events):
        g[0, e] = st.g_old[e]
        g[SAMPLES, e] = st.g_new[e]
    if part.count == 0:
        return SAMPLES
    stride = SAMPLES
    while stride > 1:
        half = stride // 2
        straight = True
        for i in range(half, SAMPLES, stride):
            t = _sample_time(st, i)
            interpolate(functions, st, part, t, st.y_between, st.yp_between)
            functions.events(t, st.y_between, st.yp_between, g[i], st.idata, st.rdata, st.work)
        for e in range(st.n_events):
            low = np.inf
            high = -np.inf
            off = 0.0
            for i in range(0, SAMPLES + 1, half):
                low = min(low, g[i, e])
                high = max(high, g[i, e])
            for i in range(half, SAMPLES, stride):
                # how far the sample in the middle is off the chord
                off = max(off, abs(g[i, e] - 0.5 * (g[i - half, e] + g[i + half, e])))
            straight &= off <= STRAIGHT * (high - low)
        stride = half
        if straight and stride <= COARSEST:
            break
    return stride


@njit(cache=True, nogil=True, error_model="numpy")
def _value_at(functions, st, part, which, at):
    """Return event ``which`` on the polynomial of the last step, ``at`` a part of it; ``st.g_new`` is overwritten."""
    interpolate(functions, st, part, st.t_old + at * (st.t_new - st.t_old), st.y_between, st.yp_between)
    functions.events(
        st.t_old + at * (st.t_new - st.t_old), st.y_between, st.yp_between, st.g_new, st.idata, st.rdata, st.work
    )
    return st.g_new[which]


@njit(cache=True, nogil=True, error_model="numpy")
def _turn_beyond_zero(functions, st, part, which, first, last):
    """Return the part of the last step at which an event that has one sign at both ends has the other; NaN for none.

    Where it turns towards zero and back, both crossings may lie within. A function that bends one way lies above its
    tangents: if these meet before zero it does not reach it.
    """
    if not (first > 0.0) == (last > 0.0) or first == 0.0 or last == 0.0:
        return np.nan
    sign = 1.0 if first > 0.0 else -1.0
    near = 1.0 / SAMPLES
    # slopes at both ends, and where their tangents meet
    falls = sign * (_value_at(functions, st, part, which, near) - first) / near
    rises = sign * (last - _value_at(functions, st, part, which, 1.0 - near)) / near
    if not (falls < 0.0 and rises > 0.0):
        return np.nan
    # first + falls x = last + rises (x - 1)
    meet = (sign * (last - first) - rises) / (falls - rises)
    if sign * first + falls * meet > 0.0:
        return np.nan
    low, high = 0.0, 1.0
    one, two = 1.0 - GOLDEN_FRACTION, GOLDEN_FRACTION
    at_one, at_two = (
        sign * _value_at(functions, st, part, which, one),
        sign * _value_at(functions, st, part, which, two),
    )
    for _ in range(TURNS):
        if at_one < 0.0:
            return one
        if at_two < 0.0:
            return two
        # golden section: the least value is on the side of the smaller of two
        if at_one < at_two:
            high, two, at_two = two, one, at_one
            one = high - GOLDEN_FRACTION * (high - low)
            at_one = sign * _value_at(functions, st, part, which, one)
        else:
            low, one, at_one = one, two, at_two
            two = low + GOLDEN_FRACTION * (high - low)
            at_two = sign * _value_at(functions, st, part, which, two)
    return np.nan


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
def locate_events(functions, st, part):
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
    functions.events(t, st.y, st.yp, st.g_new, st.idata, st.rdata, st.work)
    stride = _sample(functions, st, part)
    g = st.g_between
    for e in range(st.n_events):
        left = st.event_left[e]
        parts, turn = SAMPLES // stride, np.nan
        if parts == 1:
            turn = _turn_beyond_zero(functions, st, part, e, g[0, e], g[SAMPLES, e])
            parts = 1 if np.isnan(turn) else 2
        a, before = st.t_old, g[0, e]
        for i in range(1, parts + 1):
            if i < parts and stride == SAMPLES:
                b, after = st.t_old + turn * (t - st.t_old), _value_at(functions, st, part, e, turn)
            else:
                b, after = _sample_time(st, min(i * stride, SAMPLES)), g[min(i * stride, SAMPLES), e]
            rising = before < 0.0 and after >= 0.0 and st.event_direction[e] >= 0
            falling = before > 0.0 and after <= 0.0 and st.event_direction[e] <= 0
            if rising or falling:
                root = _root(functions, st, part, e, a, before, b, after)
                does = st.event_action[e]
                acts = does == RESTART or (does == STOP and left <= 1)
                left -= 1
                if acts and (action == RECORD or root < cut):
                    cut = root
                    action = does
                _store_crossing(st, first, root, e)
            a, before = b, after
    while st.n_crossings > first and st.crossing_t[st.n_crossings - 1] > cut:
        st.n_crossings -= 1
    for p in range(first, st.n_crossings):
        st.event_left[st.crossing_event[p]] -= 1
        interpolate(functions, st, part, st.crossing_t[p], st.y_between, st.yp_between)
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
def cut_step(functions, st, part, cut):
    """Let the last step end at a crossing: replace its end by the polynomial's value there."""
    interpolate(functions, st, part, cut, st.y_between, st.yp_between)
    copy(st.y_between, st.y)
    copy(st.yp_between, st.yp)
    copy(st.y_between, rows_from(st, 0)[0])
    times_from(st, 0)[0] = cut
    st.t = cut
    functions.events(cut, st.y, st.yp, st.g_old, st.idata, st.rdata, st.work)
