"""Numbers that are set without Python: what `gearmbs.mechanism.solve.settings` and a held run do, compiled."""

from __future__ import annotations

from gearmbs.dae.integrators.run_state import copy
from gearmbs.dae.integrators.stepping.jumps import CHANGED, pass_jump, steer
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import matrix_at
from gearmbs.native.driver import forget_changes, write_last_step

steer_at = caller(steer.declared)
pass_jump_at = caller(pass_jump.declared)


@njit(cache=True, nogil=True, error_model="numpy")
def value_of(d, table, number):
    """Return the value of a number at the present time from what stands in its cells.

    Parameters
    ----------
    d : Driver
    table : ndarray
        What stands in ``d.cells``.
    number : int
    """
    p = d.first[number]
    at = d.place[p]
    if d.is_input[number] == 1:
        return table[at + 1] + table[at + 2] * (d.t - table[at])
    return (table[at] - d.offset[p]) / d.per_unit[p]


@njit(cache=True, nogil=True, error_model="numpy")
def present_value(st, d, number):
    """Return the present value of a number, the one that was set last."""
    if d.waiting[number] == 1:
        return d.wanted[number]
    for c in range(d.cells.shape[0]):
        d.values[c] = st.rdata[d.cells[c]]
    return value_of(d, d.values, number)


@njit(cache=True, nogil=True, error_model="numpy")
def _write(d, number):
    """Let a number be held at what is wanted from the present time on, in ``d.values``."""
    for p in range(d.first[number], d.first[number + 1]):
        at, value = d.place[p], d.wanted[number]
        if d.coefficients[p] == 0:
            d.values[at] = d.offset[p] + d.per_unit[p] * value
        else:
            d.values[at], d.values[at + 1] = d.t, value
            if d.coefficients[p] > 1:
                d.values[at + 2] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _is_plain(d, number):
    """Return whether a number is an input that stands nowhere but before coefficients."""
    plain = d.is_input[number] == 1
    for p in range(d.first[number], d.first[number + 1]):
        plain &= d.coefficients[p] > 0
    return plain


@njit(cache=True, nogil=True, error_model="numpy")
def _keeps_coordinates(st, d):
    """Return whether the last step is known to have ended without a change of coordinates."""
    if d.changed_at != st.steps and d.given_at != st.steps:
        return True
    write_last_step(st, d)
    for k in range(st.idata.shape[0]):
        if d.last_table[k] != st.idata[k]:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _return_to_coordinates(st, d):
    """Take back a change of coordinates at an end of the last step that is no end any more."""
    n, count = st.y.shape[0], d.last_count
    copy(d.last_table, st.idata)
    st.n_past, st.order = count, min(st.order, max(1, count - 1))
    for j in range(count):
        st.window_t[st.newest + j] = d.last_t[j]
        for i in range(n):
            st.window_y[(st.newest + j) * n + i] = d.last_rows[j, i]


@njit(cache=True, nogil=True, error_model="numpy")
def apply(bound, st, plan, factors, d, shows):
    """Cut the last step back to the present point and go on from there with the numbers that have been set.

    Parameters
    ----------
    bound, st, plan, factors
        Of a run, see `gearmbs.dae.integrators.step.advance`.
    d : Driver
    shows : int
        Whether what is told at the present point is to be with these numbers, and not with those before.

    Returns
    -------
    changes : int
        Whether anything has changed.
    """
    count, only = 0, -1
    for k in range(d.waiting.shape[0]):
        if d.waiting[k] == 1:
            count, only = count + 1, k
    if count == 0 and shows == 0:
        return 0
    y, yp = st.y_out[d.present], st.yp_out[d.present]
    kept, done, steered = _keeps_coordinates(st, d), False, False
    if count == 1 and kept and st.steps > 0 and _is_plain(d, only):
        first, size = d.first[only], d.first[only + 1] - d.first[only]
        places = matrix_at(d.plain, 3 * first, size, 3)
        code = steer_at(d.steer)(
            bound, st, plan, factors, d.t, y, yp, places, d.wanted[only], d.t, d.cells, d.values, d.scratch
        )
        steered, done = True, (code & CHANGED) != 0
    if not steered:
        for c in range(d.cells.shape[0]):
            d.values[c] = st.rdata[d.cells[c]]
        loads, jumps, leads, bent = True, False, False, False
        for k in range(d.waiting.shape[0]):
            if d.waiting[k] == 0:
                continue
            now = value_of(d, d.values, k)
            slope = d.values[d.place[d.first[k]] + 2] if d.is_input[k] == 1 else 0.0
            jumped, turned = d.wanted[k] != now, slope != 0.0
            if jumped or turned:
                _write(d, k)
                loads &= d.is_input[k] == 1 or d.loads[k] == 1
                jumps, leads = jumps or jumped, leads or turned
                for p in range(d.first[k], d.first[k + 1]):
                    bent |= d.plain[3 * p + 2] != 0
        done = jumps or leads
        if done:
            if not kept:
                _return_to_coordinates(st, d)
            if not (kept and loads):
                st.matrix_wanted = True
            bent |= not loads
            pass_jump_at(d.pass_jump)(
                bound, st, plan, factors, d.t, y, yp, d.cells, d.values, jumps, leads, kept, bent, -1, 0.0, d.scratch
            )
            if not kept:
                forget_changes(st, d)
                d.before = False
    d.waiting[:] = 0
    if done:
        d.given_at, d.jumped_at, d.t_jumped = -1, st.steps, d.t
        copy(y, d.jump_y)
        copy(yp, d.jump_yp)
    if shows == 1:
        for c in range(d.cells.shape[0]):
            d.held[c] = st.rdata[d.cells[c]]
    return int(done)
