"""How a run goes on beyond a jump: the past forgotten, a first step of order one, then points of high order at once.

A history grown from order one takes some fifty steps to its final size and order: points that a low order has left are
off by what no smooth function is, and differences, by which longer steps and higher orders are chosen, amplify that. So
the first step, which finds the rates beyond the jump, is followed by a block: `POINTS` points at equal distances h, and
the polynomial P through these and the newest one, with

    G(t_j, P(t_j), P'(t_j)) = 0,   j = 1 .. POINTS,

which is collocation. It is solved by deferred correction: sweeps of implicit Euler, all with one matrix,

    G(t_j, y_j, P'(t_j) + (d_j - d_(j-1))/h) = 0,   d_j = y_j - P(t_j),   d_0 = 0,

P through the points of the sweep before. Each sweep raises the order by one, and stiff unknowns are at their
equilibrium with the first. The run then goes on from the newest point as if it had come along P: the points before the
jump are replaced by values of P, and each step beyond is tested as any other.

References
----------
.. [1] R. Frank, C. W. Ueberhuber, "Iterated defect correction for the efficient solution of stiff systems of ordinary
       differential equations", BIT 17 (1977) 146-159.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators import bdf
from gearmbs.dae.integrators.controller import target
from gearmbs.dae.integrators.corrector import apply_correction, renew_weights, weighted_max
from gearmbs.dae.integrators.newton_matrix import form_matrix
from gearmbs.dae.integrators.run_state import (
    RUNNING,
    WINDOW,
    copy,
    forget,
    record_history,
    resample,
    rows_from,
    times_from,
)
from gearmbs.dae.linalg.sparse_lu import solve
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at

RESTART_SHRINK = 0.1
"""Ratio of the first step without a past to the refused one with it. Where the equations have jumped its error falls
with its size, and `shorten_first_step` takes it from there. Tuned, see the table of constants."""
FIRST_TARGET = 0.01
"""Error of the first step after refused attempts, in tolerances: half of what the next ones are meant to have."""
FIRST_SHRINK = (1e-3, 0.5)
"""Between which the size of a first step changes after a refusal: its error falls with the square, or less."""
POINTS = 5
"""Points of a block: their fifth difference tells the error of the order below, at which the run goes on."""
BLOCK_ORDER = POINTS - 1
BLOCKS = 4
"""Blocks that are tried at most, of other sizes."""
BLOCK_PART = 0.5
"""Size h of the first block tried, as part of the last step before the jump: about the ratio of steps of `BLOCK_ORDER`
to those of order six."""
BLOCK_SIZE = 4.0
"""h^5 y^(5) of the first block tried, in tolerances: ten times the local error at order four."""
BLOCK_SHRINK = 0.2
"""Ratio of the next h to one whose sweeps did not converge."""
SHORT_OF_STOP = 0.99
"""Part of the way to the next stop that a block takes: at its end the equations may have jumped."""
LEAST_GAIN = 4.0
"""Ratio of h to the step of order one from which a block is worth its sweeps."""
SWEEPS = 12
SETTLED = 0.05
"""Tolerances by which the last sweep may move a point: what it leaves is a tenth of that, as a rule."""
BLOCK_ERROR = 5.0
"""Largest local error of the order below a block's, in tolerances, with which it counts as resolved: its own is the
smaller one of the next order, and the first step is as long as its error allows."""


@njit(cache=True, nogil=True, error_model="numpy")
def start_afresh(st):
    """Forget the past after all, where a step beyond a possible discontinuity was refused; return whether it was that.

    A stop or an event may be no discontinuity, or one of a derivative that the tolerance does not see: the past then
    foretells the step beyond it as any other, and the run goes on as if nothing had been.
    """
    if not st.passing or st.n_past == 1:
        return False
    st.passing = False
    forget(st)
    st.h = RESTART_SHRINK * st.step
    st.h_block = BLOCK_PART * st.step
    st.blocks = 0
    st.rate_jumped = -1
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def shorten_first_step(st):
    """Choose the size of the next attempt of a first step, and from two attempts the rates it starts with.

    Where the equations jump, as at a restart, the rates before the jump are not those after it, and leave an error that
    falls with h and not with h^2. Implicit Euler gives r(h) = (y - y_0)/h = y'_0 + h y'' + ..., whatever y'_0 it is
    predicted with: two attempts give both,

        y'' = (r_1 - r_2)/(h_1 - h_2),   y'_0 = r_2 - h_2 (r_1 - r_2)/(h_1 - h_2),

    and the first step with an error h^2 y''/2 of `FIRST_TARGET` tolerances.
    """
    h, rate, start = st.step, st.yp_between, rows_from(st, 1)[0]
    st.start_tries += 1
    ratio = np.sqrt(FIRST_TARGET / st.error)
    if st.start_tries > 1:
        apart = st.h_tried - h
        bend = 0.0
        for i in range(st.y.shape[0]):
            if st.differential[i] != 0.0:
                new = (st.y[i] - start[i]) / h
                slope = (rate[i] - new) / apart
                rate[i] = new
                st.yp_start[i] = new - h * slope
                bend = max(bend, abs(slope) * st.w_error[i])
                if i == st.rate_jumped:
                    _size_block(st, abs(st.yp_start[i] - st.rate_before) * st.w_error[i], abs(slope) * st.w_error[i])
        if bend > 0.0:
            ratio = min(FIRST_SHRINK[1], np.sqrt(FIRST_TARGET / bend) / h)
    else:
        most = 0.0
        for i in range(st.y.shape[0]):
            rate[i] = (st.y[i] - start[i]) / h
            off = abs(rate[i] - st.yp_start[i]) * st.w_error[i] * st.differential[i]
            if off > most:
                most = off
                st.rate_jumped, st.rate_before = i, st.yp_start[i]
    st.h_tried = h
    st.h = h * min(max(ratio, FIRST_SHRINK[0]), FIRST_SHRINK[1])


@njit(cache=True, nogil=True, error_model="numpy")
def _size_block(st, jump, bend):
    """Bound the size of a block by what the unknown does whose rate has jumped the most, all in tolerances.

    With the rate q = y''/y' at which it decays or swings its fifth derivative is y' q^4.
    """
    if bend > 0.0 and jump > 0.0:
        st.h_block = min(st.h_block, (jump / bend) ** 0.8 * (BLOCK_SIZE / jump) ** 0.2)


@njit(cache=True, nogil=True, error_model="numpy")
def take_block(functions, st, plan, factors):
    """After the first step of a start within a run, replace its past by that of a block of points beyond, if one holds.

    The step to come is open. Without success all is left as it was.

    Returns
    -------
    code : int
        RUNNING, or REPIVOT where pivots have to be chosen anew before.
    """
    if not st.starting or st.n_past != 2 or st.blocks >= BLOCKS or st.max_order < BLOCK_ORDER or st.drop_level > 0:
        return RUNNING
    times, rows = times_from(st, 1), rows_from(st, 1)
    t = times[0]
    stop = st.t_end
    if st.next_stop < st.stops.shape[0]:
        stop = min(stop, st.stops[st.next_stop])
    if st.blocks == 0:
        copy(st.yp, st.yp_start)
        st.matrix_wanted = True
    # the start proper, which is needed where no block holds
    t_start, h_first = times[1], st.h
    copy(rows[1], rows[POINTS + 1])
    st.order = BLOCK_ORDER
    st.h_wanted = st.h
    spread = 0.0
    code = RUNNING
    while st.blocks < BLOCKS:
        h = min(st.h_block, SHORT_OF_STOP * (stop - t) / POINTS)
        if not h > LEAST_GAIN * h_first:
            break
        st.blocks += 1
        st.t_seen = t + h
        st.gamma = 1.0 / h
        code = form_matrix(functions, st, plan, factors)
        if code != RUNNING:
            break
        if spread > 0.0:
            _move_points(st, spread, h / spread)
        else:
            _guess_points(st, h)
        renew_weights(st, rows[0], h)
        if _settle_points(functions, st, plan, factors, h):
            error = _block_error(st, h)
            if error > BLOCK_ERROR:
                st.h_block = h * max(BLOCK_SHRINK, (target(st, BLOCK_ORDER) / error) ** (1.0 / POINTS))
            elif _unsettled_at_start(functions, st, plan, factors) > BLOCK_ERROR:
                st.h_block = BLOCK_SHRINK * h
            else:
                _go_on(st, h)
                return RUNNING
            spread = h
        else:
            st.h_block = BLOCK_SHRINK * h
            spread = 0.0
    copy(rows[POINTS + 1], rows[1])
    times[1] = t_start
    st.order = 1
    st.h = h_first
    st.matrix_wanted = True
    return code


@njit(cache=True, nogil=True, error_model="numpy")
def _guess_points(st, h):
    """Place the points of a block on the tangent."""
    times, rows = times_from(st, 1), rows_from(st, 1)
    for j in range(1, POINTS + 1):
        times[j] = times[0] + j * h
        for i in range(st.y.shape[0]):
            rows[j, i] = rows[0, i] + j * h * st.differential[i] * st.yp_start[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _move_points(st, h, ratio):
    """Take the points of a block elsewhere on their polynomial, ``ratio`` times as far from the newest point."""
    times, rows, weights = times_from(st, 1), rows_from(st, 1), st.respacing
    for j in range(1, POINTS + 1):
        for m in range(POINTS + 1):
            w = 1.0
            for l in range(POINTS + 1):
                if l != m:
                    w *= (j * ratio - l) / (m - l)
            weights[j, m] = w
        times[j] = times[0] + j * ratio * h
    resample(rows, POINTS, weights, st.nodes)


@njit(cache=True, nogil=True, error_model="numpy")
def _settle_points(functions, st, plan, factors, h):
    """Correct the points of a block in sweeps of implicit Euler; return whether they converge."""
    n = st.y.shape[0]
    times, rows = times_from(st, 1), rows_from(st, 1)
    # rows of the window beyond the history, or before it
    free = st.newest + bdf.HISTORY
    if free + POINTS > WINDOW:
        free = st.newest - POINTS
    settled = matrix_at(st.window_y, free * n, POINTS, n)
    y, yp, y_pred, yp_pred, moved = st.y, st.yp, st.y_pred, st.yp_pred, st.yp_between
    before = np.inf
    for sweep in range(SWEEPS):
        change = 0.0
        for i in range(n):
            moved[i] = 0.0
        for j in range(1, POINTS + 1):
            st.t_seen = times[j]
            bdf.step_coefficients(times[j], times, POINTS, st.value, st.slope)
            bdf.predict(st.value, st.slope, POINTS + 1, rows, y_pred, yp_pred)
            for i in range(n):
                y[i] = y_pred[i] + moved[i]
                yp[i] = yp_pred[i]
            # one correction each: the sweep to come corrects what it leaves, too
            functions.residual(st.t_seen, y, yp, st.res, st.idata, st.rdata, st.work)
            solve(plan, factors, st.res, st.delta)
            apply_correction(st.delta, st.gamma, st.w_newton, y, yp)
            for i in range(n):
                moved[i] = y[i] - rows[j, i]
                settled[j - 1, i] = y[i]
            change = max(change, weighted_max(moved, st.w_error))
        st.residuals += POINTS
        st.solves += POINTS
        for j in range(POINTS):
            copy(settled[j], rows[j + 1])
        if change <= SETTLED:
            return True
        if sweep > 1 and not change * (change / before) ** (SWEEPS - 1 - sweep) <= SETTLED:
            return False
        before = change
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _unsettled_at_start(functions, st, plan, factors):
    """Return by how much a step of a block would move what its polynomial leaves of the equations where it begins.

    They hold at the points beyond. Between the start and the first of these they may have a kink, as where a contact
    closes: the polynomial is then a solution of what lies behind the kink all the way, as smooth as any.
    """
    times, rows = times_from(st, 1), rows_from(st, 1)
    bdf.step_coefficients(times[0], times, POINTS, st.value, st.slope)
    bdf.predict(st.value, st.slope, POINTS + 1, rows, st.y, st.yp)
    st.t_seen = times[0]
    functions.residual(st.t_seen, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    solve(plan, factors, st.res, st.delta)
    st.residuals += 1
    st.solves += 1
    return weighted_max(st.delta, st.w_error)


@njit(cache=True, nogil=True, error_model="numpy")
def _block_error(st, h):
    """Return the local error of the order below that of a block, in a step of its size from the newest point."""
    times, nodes = times_from(st, 1), st.nodes
    difference = bdf.divided_difference_norm(times, POINTS + 1, rows_from(st, 1), st.w_error, st.value)
    for m in range(POINTS):
        nodes[m] = times[0] - m * h
    return bdf.local_error(h, nodes, BLOCK_ORDER, difference)


@njit(cache=True, nogil=True, error_model="numpy")
def _go_on(st, h):
    """Replace the past by values of the block's polynomial, and go on with a step of its size, or as long as allowed.

    What the first step has left of unknowns without derivative is replaced by what the points beyond say.
    """
    rows = rows_from(st, 1)
    for i in range(st.y.shape[0]):
        if st.differential[i] == 0.0:
            rows[0, i] = 5.0 * (rows[1, i] - rows[4, i]) - 10.0 * (rows[2, i] - rows[3, i]) + rows[5, i]
    error = _block_error(st, h)
    _move_points(st, h, -1.0)
    st.n_past = POINTS + 1
    st.h = h * min(1.0, (target(st, BLOCK_ORDER) / error) ** (1.0 / POINTS)) if error > 0.0 else h
    st.h_first = st.h
    st.since_change = POINTS
    st.starting = False
    st.matrix_fresh = False
    record_history(st, 1)
