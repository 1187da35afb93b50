"""How a held run goes on where numbers of its equations jump: its past as it would have been with the new ones.

At a time t_0 the equations G become G + b_0 + b_1 tau + ..., tau = t - t_0. Unknowns with a rate go on from where they
are, their rates jump, and so do the others. To forget the past and start at order one would cost some fifty steps. But
to first order the solution differs from the old one by what the linear equations make of the jump,

    E delta' + A delta = -b_0 - b_1 tau,    delta = 0 at tau = 0 where there is a rate,

A = dG/dy, E = dG/dy'. Added to the points behind t_0 it makes them those of a solution of the new equations, along
which prediction and differences are smooth. With M = A + gamma E, the matrix that is factored anyway, N = gamma M^-1 E
and s = gamma'/gamma, the Laplace transform of the answer to a step is, as a function of gamma',

    (1 + (s - 1) N)^-1 d = d - sum_m (1 - 1/s)^m g_m,    d = -M^-1 b_0,  g_1 = N d,  g_(m+1) = g_m - N g_m,

the series about gamma' = gamma, and (1 - gamma/gamma')^m is the transform of a Laguerre polynomial [1]_:

    delta(tau) = d - sum_m g_m L_m(gamma tau).

A mode lambda converges like (lambda/(lambda - gamma))^m, that is at once where the steps resolve it. One whose decay is
faster than the steps does not, nor need it: the step beyond t_0 is tested as any other, and where it fails the past is
forgotten after all. A few solutions with factors at hand are what it costs, where steps land on jumps once for each
matrix.

References
----------
.. [1] W. T. Weeks, "Numerical inversion of Laplace transforms using Laguerre functions", J. ACM 13 (1966) 419-429.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.corrector import renew_weights, weighted_max
from gearmbs.dae.integrators.restart import start_afresh
from gearmbs.dae.integrators.run_state import ANSWER, STATE_TYPE, copy, matrix_at, record_history, rows_from, times_from
from gearmbs.dae.integrators.step import CLOSE
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, solve
from gearmbs.dae.problem import EPS
from gearmbs.kernels.bound import FUNCTIONS_TYPE
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64, types
from gearmbs.kernels.placed import unbound

TERMS = ANSWER - 1
"""Terms of the series at most, and of a mode that steps do not resolve as many as the order, see `CONVERGES`."""
CONVERGES = 0.3
"""Ratio of a term to the one before up to which more of them than the order are taken. A stiff mode, of which the
series makes a polynomial of their number, would show in the differences, which such a polynomial of the order does not:
six terms of a planetary set at order one make its steps three times as many."""
LARGER = 16.0
"""Ratio of a change to that from which the answer was found up to which it serves: rounding grows with it."""
LEAST_CHANGE = 1e-200
"""Of an input, or its rate over a step, from which an answer is found for a unit of it."""
GAMMA_RANGE = 4.0
"""Ratio of leading coefficients within which an answer serves: its terms are those about one of them."""
SPARE = 2
"""Points behind more than the order that the past keeps, for a rise of the order."""
UNSEEN = 0.2
"""Tolerances by which a term may move the points that the present order takes, and be left out with all that follow. Of
lines, of which many turn one way, 2^-k: differences of order k + 1 amplify it by as much."""
TRUSTED = 16
"""Turns of a line that are foretold to be unseen, by half as much, before one is looked at again."""
ON_LINE = 8.0 * EPS
"""Part of its value by which an input may leave a line by rounding alone."""
DOUBTED = 300.0
"""Tolerances by which a jump may move points before the step beyond it is tested for a past that is of no use. To first
order the answer to a jump is right to a part in some hundreds where contacts open at it: in random torques of 10 N m
each 0.1 ms on the pair of the paper errors are as small as those of cut steps with 30 and 300, with 3000 four times
larger."""
PROBED = 0.01
"""Part of the time 1/gamma over which it is looked at how a jump changes with what moves: kinks lie beyond it."""
CHANGED = 1
LED = 2
"""What `steer` returns, added up."""

_VEC = float64[::1]


@njit(
    types.void(FUNCTIONS_TYPE, STATE_TYPE, PLAN_TYPE, FACTORS_TYPE, float64, _VEC, _VEC, int64[::1], _VEC, boolean,
               boolean, boolean, boolean, int64, float64, float64[:, ::1]),
    cache=True,
    nogil=True,
    error_model="numpy",
)  # fmt: skip
def pass_jump(bound, st, plan, factors, t, y, yp, cells, values, jumps, leads, follows, bent, place, change, g):
    """Cut the last step back to ``t``, change numbers of the equations there, and the past along with them.

    Parameters
    ----------
    bound, st, plan, factors
        Of a run with no step open.
    t, y, yp : float, and ndarrays of shape (n,)
        A time within the last step, and values there.
    cells, values : ndarrays of int and of float
        Places in the table of numbers that change, and what is to stand there.
    jumps, leads : bool
        Whether the equations change at once, b_0, and whether the change grows with the time, b_1.
    follows : bool
        Whether factors and past are of use: else the past is left to the test of the step.
    bent : bool
        Whether the matrix may change with what changes, see `_follow_bent`.
    place : int
        Of the one input that changes, -1 where more do.
    change : float
        By how much it jumps, or its rate.
    g : ndarray, shape (TERMS + 3, n)
        Scratch.
    """
    functions = unbound(bound)
    n = st.y.shape[0]
    landed = _cut(st, t, y, yp)
    reach = t - times_from(st, 0)[min(st.order + 1, st.n_past - 1)]
    moved = 0.0 if follows else np.inf
    if place >= 0 and not jumps and _foresees(st, place, abs(change), reach):
        follows = False
    first, later, d = g[TERMS], g[TERMS + 1], g[TERMS + 2]
    theta = st.h
    # where steps have landed the equations hold, and one answer serves as long as the matrix does
    known = follows and landed and place >= 0 and jumps != leads and abs(change) * min(theta, 1.0) > LEAST_CHANGE
    serves = known and _answer_serves(st, place, change)
    at = t + theta if leads else t
    bends = bent and follows and not known
    if known and not serves:
        functions.residual(at, y, yp, first, st.idata, st.rdata, st.work)
    elif follows and leads and not known and not bends:
        functions.residual(t + theta, y, yp, later, st.idata, st.rdata, st.work)
        if jumps:
            functions.residual(t, y, yp, st.delta, st.idata, st.rdata, st.work)
    if bends:
        moved = _follow_bent(functions, st, plan, factors, t, yp, cells, values, d, g)
    else:
        for k in range(cells.shape[0]):
            st.rdata[cells[k]] = values[k]
    if known:
        if not serves:
            functions.residual(at, y, yp, later, st.idata, st.rdata, st.work)
            per_unit = 1.0 / (change * theta) if leads else 1.0 / change
            for i in range(n):
                later[i] = (later[i] - first[i]) * per_unit
            _find_answer(st, plan, factors, later, place, change)
            st.residuals += 2
        moved = _follow_known(st, t, change, d, g, leads)
    elif follows and not bends:
        if leads:
            functions.residual(t + theta, y, yp, st.res, st.idata, st.rdata, st.work)
            for i in range(n):
                later[i] = st.res[i] - later[i]
        if jumps:
            # what the polynomial has left of the equations is settled along with the jump
            functions.residual(t, y, yp, first, st.idata, st.rdata, st.work)
            if leads:
                for i in range(n):
                    later[i] -= first[i] - st.delta[i]
            moved = _follow(st, plan, factors, t, first, d, g, False)
        if leads:
            for i in range(n):
                later[i] /= theta
            moved = max(moved, _follow(st, plan, factors, t, later, d, g, True))
        st.residuals += int(jumps) * (1 + int(leads)) + 2 * int(leads)
    if follows and leads and not jumps and place >= 0:
        st.turned, st.turn_moves, st.turn_reach, st.turns_trusted = place, moved / abs(change), reach, 0
    _go_on(st, not (landed and moved <= DOUBTED))
    if moved != moved:
        start_afresh(st)


@njit(cache=True, nogil=True, error_model="numpy")
def _cut(st, t, y, yp):
    """Let the last step end at ``t``, with its values there; return whether it did so already.

    A point that is left too near to the new end goes, and so do those further back than serve a step to come.
    """
    times, rows = times_from(st, 0), rows_from(st, 0)
    landed = t == times[0]
    st.t = times[0] = t
    copy(y, rows[0])
    copy(y, st.y)
    copy(yp, st.yp)
    if not landed and st.n_past > 2 and times[0] - times[1] < CLOSE * (times[1] - times[2]):
        for j in range(1, st.n_past - 1):
            times[j] = times[j + 1]
            copy(rows[j + 1], rows[j])
        st.n_past -= 1
    renew_weights(st, y, st.h)
    st.n_past = min(st.n_past, st.order + SPARE)
    return landed


@njit(cache=True, nogil=True, error_model="numpy")
def _go_on(st, doubted):
    """Begin behind a jump: ``doubted`` is whether a step that is refused there tells that the past is of no use."""
    copy(st.yp, st.yp_start)
    st.order = min(st.order, max(1, st.n_past - 1))
    st.restarts += 1
    st.sign_last = 0.0
    st.sign_pencil = 0.0
    st.asked = -np.inf
    st.jumps_in_turn += 1
    st.passing = doubted
    st.n_records = 0
    record_history(st, 0)


@njit(
    int64(FUNCTIONS_TYPE, STATE_TYPE, PLAN_TYPE, FACTORS_TYPE, float64, _VEC, _VEC, int64[:, ::1], float64, float64,
          int64[::1], _VEC, float64[:, ::1]),
    cache=True,
    nogil=True,
    error_model="numpy",
)  # fmt: skip
def steer(bound, st, plan, factors, t, y, yp, places, value, end, cells, values, g):
    """Let an input that only loads depend on jump to a value, or go there evenly from where it is: see `pass_jump`.

    Parameters
    ----------
    bound, st, plan, factors, t, y, yp, cells, g
        As there.
    places : ndarray of int, shape (p, 3)
        Its places among the cells: of the time before the coefficients, the number of these, and whether what stands
        there is bent, see `gearmbs.dae.problem.Place`.
    value, end : float
        Where it goes, and when it is there: ``t`` for a jump.
    values : ndarray
        Written: what stands in the cells then.

    Returns
    -------
    code : int
        CHANGED where it was not so before, and LED where it has a rate.
    """
    for k in range(cells.shape[0]):
        values[k] = st.rdata[cells[k]]
    at, place = places[0, 0], places[0, 0]
    for p in range(places.shape[0]):
        if places[p, 2]:
            # an answer serves no other change
            place = -1
    slope_before = values[at + 2]
    now = values[at + 1] + slope_before * (t - values[at])
    slope, jumps = 0.0, value != now
    if end > t:
        slope, jumps = (value - now) / (end - t), False
        if abs(slope - slope_before) * (end - t) <= ON_LINE * max(abs(now), abs(value)):
            # the line goes on
            slope = slope_before
    leads = slope != slope_before
    if jumps or leads:
        for p in range(places.shape[0]):
            at = places[p, 0]
            values[at], values[at + 1] = t, now if end > t else value
            if places[p, 1] > 1:
                values[at + 2] = slope
        pass_jump(
            bound,
            st,
            plan,
            factors,
            t,
            y,
            yp,
            cells,
            values,
            jumps,
            leads,
            True,
            place < 0,
            place,
            value - now if jumps else slope - slope_before,
            g,
        )
    return CHANGED * int(jumps or leads) + LED * int(slope != 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _unseen_turn(st):
    """Return the tolerances by which a turn of a line may move points, and be left out."""
    return min(UNSEEN, 0.5**st.order)


@njit(cache=True, nogil=True, error_model="numpy")
def _foresees(st, place, turn, reach):
    """Return whether a turn of a line will not be seen, by what was found at one of the same input lately.

    It moves the points in proportion, and by the square of their distance in velocities, by its cube in positions.
    """
    if place != st.turned or st.turns_trusted >= TRUSTED:
        return False
    longer = reach / st.turn_reach
    st.turns_trusted += 1
    return st.turn_moves * turn * longer * longer * max(longer, 1.0) <= 0.5 * _unseen_turn(st)


@njit(cache=True, nogil=True, error_model="numpy")
def _follow(st, plan, factors, t, b, d, g, integrated):
    """Add the answer to a jump ``b`` of the equations, or to one of its rate, to the past and the point at ``t``.

    Parameters
    ----------
    st, plan, factors
        State of the run, and plan and factors of its matrix.
    b : ndarray, shape (n,)
        The jump of the residual.
    d, g : ndarray, shapes (n,) and (TERMS, n)
        Scratch: the answer, and the terms of its series.
    integrated : int
        Whether the jump is one of the rate.

    Returns
    -------
    moves : float
        Tolerances by which it moves the points at most.
    """
    n = st.y.shape[0]
    gamma = st.gamma_factored
    times = times_from(st, 0)
    # looked up once: the compiler cannot tell that nothing written below is a member
    res, delta, w_error = st.res, st.delta, st.w_error
    solve(plan, factors, b, d)
    st.solves += 1
    for i in range(n):
        d[i] = -d[i]
    # the furthest point that the order takes, and of lines, of which more are to come, a higher one; Laguerre
    # polynomials grow with the distance
    reach = t - times[min(st.order + int(integrated), st.n_past - 1)]
    scale = reach if integrated else 1.0
    low, high = 1.0, 1.0 + gamma * reach
    unseen, terms = _unseen_turn(st) if integrated else UNSEEN, TERMS
    moves = scale * high * weighted_max(d, w_error)
    for m in range(TERMS):
        own, before = g[m], d if m == 0 else g[m - 1]
        size = weighted_max(before, w_error)
        if scale * high * size <= unseen:
            terms = m
            break
        low, high = high, ((2.0 * m + 3.0 + gamma * reach) * high - (m + 1.0) * low) / (m + 2.0)
        _carry(st, gamma, before, res)
        solve(plan, factors, res, delta)
        st.solves += 1
        if m == 0:
            copy(delta, own)
        else:
            for i in range(n):
                own[i] = before[i] - delta[i]
        if m >= st.order and weighted_max(own, w_error) > CONVERGES * size:
            terms = m
            break
    _add_answer(st, t, gamma, d, g, terms, integrated)
    return moves


@njit(cache=True, nogil=True, error_model="numpy")
def _exchange(st, cells, values):
    """Exchange what stands in the cells with some values."""
    rdata = st.rdata
    for k in range(cells.shape[0]):
        values[k], rdata[cells[k]] = rdata[cells[k]], values[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _change_beside(functions, st, t, yp, cells, values, now, out):
    """Write by how much a change of numbers makes more of the residual a little later, at ``st.y_pred``, than ``now``.

    Parameters
    ----------
    functions, st
        Of a run; the new numbers are in place.
    t : float
    yp : ndarray, shape (n,)
    cells, values : ndarray
        Places of the numbers, and the old ones.
    now : ndarray, shape (n,)
        By how much the change makes more of it now.
    out : ndarray, shape (n,)
        Written.
    """
    old = st.yp_pred
    functions.residual(t, st.y_pred, yp, out, st.idata, st.rdata, st.work)
    _exchange(st, cells, values)
    functions.residual(t, st.y_pred, yp, old, st.idata, st.rdata, st.work)
    _exchange(st, cells, values)
    for i in range(out.shape[0]):
        out[i] -= old[i] + now[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _follow_bent(functions, st, plan, factors, t, yp, cells, values, d, g):
    """Do what `_follow` does where the jump may depend on the unknowns, as that of a damping or within a dead zone.

    Then the matrix A jumps, too, and along the old solution b_0 grows by a b_1, a b_2 and so on. These begin to tell
    with the square of the time: where they do, no answer to a jump makes the past that of the new equations.

    Parameters
    ----------
    st
        With the old numbers in place, the new ones in ``values``; afterwards they are in both.

    Returns
    -------
    moves : float
        As there; not a number where the past is of no use: it is left as it was then.
    """
    n, gamma = st.y.shape[0], st.gamma_factored
    first, later, jump, at = g[TERMS], g[TERMS + 1], st.yp_between, st.y_pred
    functions.residual(t, st.y, yp, st.delta, st.idata, st.rdata, st.work)
    _exchange(st, cells, values)
    functions.residual(t, st.y, yp, first, st.idata, st.rdata, st.work)
    st.residuals += 4
    for i in range(n):
        jump[i] = first[i] - st.delta[i]
    solve(plan, factors, first, d)
    for i in range(n):
        at[i] = st.y[i] + PROBED * (yp[i] / gamma - d[i])
    _change_beside(functions, st, t + PROBED / gamma, yp, cells, values, jump, later)
    solve(plan, factors, later, d)
    st.solves += 2
    far = 1.0 + gamma * (t - times_from(st, 0)[min(st.order, st.n_past - 1)])
    moves = np.nan
    if far * far * weighted_max(d, st.w_error) <= PROBED * UNSEEN:
        moves = _follow(st, plan, factors, t, first, d, g, False)
    for k in range(cells.shape[0]):
        values[k] = st.rdata[cells[k]]
    return moves


@njit(cache=True, nogil=True, error_model="numpy")
def _answer_serves(st, place, change):
    """Return whether the answer at hand is that to a change of this input with the present matrix."""
    ratio = st.gamma_factored / st.answer_gamma
    return (
        st.answered == place
        and st.answer_jacobians == st.jacobians
        and not st.matrix_wanted
        and abs(change) <= LARGER * abs(st.answer_change)
        and ratio <= GAMMA_RANGE
        and ratio * GAMMA_RANGE >= 1.0
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _carry(st, gamma, before, out):
    """Write gamma E times a vector."""
    jac_slope, entry_row, entry_col, carried = st.jac_slope, st.entry_row, st.entry_col, st.carried
    for i in range(out.shape[0]):
        out[i] = 0.0
    for k in range(st.n_carried):
        p = carried[k]
        out[entry_row[p]] += gamma * jac_slope[p] * before[entry_col[p]]


@njit(cache=True, nogil=True, error_model="numpy")
def _find_answer(st, plan, factors, b, place, change):
    """Keep the answer to a jump ``b`` of the equations, which a unit of an input makes: d, then the terms."""
    n, gamma = st.y.shape[0], st.gamma_factored
    answer, res, delta = matrix_at(st.answer, 0, TERMS + 1, n), st.res, st.delta
    solve(plan, factors, b, delta)
    for i in range(n):
        answer[0, i] = -delta[i]
    for m in range(TERMS):
        _carry(st, gamma, answer[m], res)
        solve(plan, factors, res, delta)
        for i in range(n):
            answer[m + 1, i] = delta[i] if m == 0 else answer[m, i] - delta[i]
    st.solves += TERMS + 1
    st.answered, st.answer_change, st.answer_gamma, st.answer_jacobians = place, change, gamma, st.jacobians


@njit(cache=True, nogil=True, error_model="numpy")
def _follow_known(st, t, change, d, g, integrated):
    """Do what `_follow` does with the answer at hand, in proportion to a change of the input."""
    n, gamma = st.y.shape[0], st.answer_gamma
    times, w_error = times_from(st, 0), st.w_error
    answer = matrix_at(st.answer, 0, TERMS + 1, n)
    reach = t - times[min(st.order + int(integrated), st.n_past - 1)]
    scale = abs(change) * (reach if integrated else 1.0)
    low, high = 1.0, 1.0 + gamma * reach
    unseen = _unseen_turn(st) if integrated else UNSEEN
    moves, terms = 0.0, min(max(st.order, 1), TERMS)
    for m in range(terms):
        moved = scale * high * weighted_max(answer[m], w_error)
        if m == 0:
            moves = moved
        if moved <= unseen:
            terms = m
            break
        low, high = high, ((2.0 * m + 3.0 + gamma * reach) * high - (m + 1.0) * low) / (m + 2.0)
        for i in range(n):
            g[m, i] = change * answer[m + 1, i]
    for i in range(n):
        d[i] = change * answer[0, i]
    _add_answer(st, t, gamma, d, g, terms, integrated)
    return moves


@njit(cache=True, nogil=True, error_model="numpy")
def _add_answer(st, t, gamma, d, g, terms, integrated):
    """Add the series of an answer to the past and to the point at ``t``; the parameters are those of `_follow`."""
    n = st.y.shape[0]
    times, rows = times_from(st, 0), rows_from(st, 0)
    yp, differential = st.yp, st.differential
    # unknowns with a rate go on from where they are: the series begins with what it leaves of zero
    for i in range(n):
        d[i] = 0.0 if differential[i] != 0.0 else d[i]
    for m in range(terms):
        own = g[m]
        for i in range(n):
            d[i] += own[i] if differential[i] != 0.0 else 0.0
    for j in range(st.n_past):
        past = times[j] - t
        x = gamma * past
        # L_0 and L_1; of a jump of the rate what stands for L_m is its integral from 0
        low, high = 1.0, 1.0 - x
        row, whole = rows[j], past if integrated else 1.0
        for i in range(n):
            row[i] += whole * d[i]
        for m in range(1, terms + 1):
            beyond = ((2.0 * m + 1.0 - x) * high - m * low) / (m + 1.0)
            weight = (high - beyond) / gamma if integrated else high
            own = g[m - 1]
            for i in range(n):
                row[i] -= weight * own[i]
            low, high = high, beyond
    copy(rows[0], st.y)
    if not integrated:
        # L_m' = -m at 0
        for m in range(terms):
            own, rate = g[m], gamma * (m + 1.0)
            for i in range(n):
                yp[i] += rate * own[i] * differential[i]
