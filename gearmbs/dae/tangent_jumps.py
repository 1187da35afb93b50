"""Where the equations jump along a run, or change within a part of a step, and what that does to its sensitivities.

Where the rates jump by [y'] at a time t* that depends on the parameter, the sensitivities jump by -[y'] dt*/dp. Where
they change within a short time, as by a narrow STEP, no step may have a point there, and what is missing is nearly as
much. Nothing is known of the equations but their residual: along the polynomial of a step intervals are halved for as
long as its fourth difference does not fade. It does wherever the equations are continuous, with kinks, too: intervals
that are small beside the steps lie about a jump, a narrow change, or a kink, of which only the first two have rates
behind them that stay other ones. When they come is then looked up beside the run, with unknowns and numbers moved along
a sensitivity.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.linalg.sparse_lu import solve
from gearmbs.dae.problem import EPS
from gearmbs.dae.result import lagrange_weights
from gearmbs.dae.tangent_track import MOST, lane_of, slot_of
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES

SEEN = 1e-5
"""Part of the largest rate of an unknown, so far, from which on a jump of its rate is looked for. Less counts for as
little in the derivatives, unless they are by nothing else."""
ROUNDED = 1e3
"""Roundings of a typical unknown, times gamma, that a rate is not told from: residuals are sums of many terms."""
APART = 8.0
"""Roundings of a time between two that count as the same: an expression may jump at another sum than a breakpoint."""
NODES = 5
"""Points of an interval: their fourth difference is looked at."""
DEEP = 128
"""Intervals that wait at once: halved until rounding, each leaves one beside it."""
LOOKS = 4096
"""Intervals of a step that are looked at: a smooth residual is through with a few, a jump in it with a hundred."""
SMALLER, MOVES = 1e-2, 6
"""Part of the move before, and number of moves, with which the time of a jump is looked up: it is to move by less than
some steps, which are short at a jump. A difference of residuals at one has made sensitivities huge, so that these do
not tell how far to move."""
NARROW = 0.25
"""Part of a step of the run up to which an interval is one of a change within a step."""
BESIDE = 0.25
"""Part of such a change that rates may change by in an interval as long before and behind it: a kink is none."""
NOTED = 1e-3
"""Part of the largest sensitivity so far that it moves at least to be gone through in points of its own."""
WIDENED = 4.0
"""Ratio of one interval in which a moved jump is looked for to the one before."""


@njit(cache=True, nogil=True, error_model="numpy")
def _residual(functions, tr, k, t, yp, p, by, idata, rdata, work):
    """Write the residual at a time to ``plus``, on the run moved along a parameter.

    Parameters
    ----------
    functions, tr, k, yp, idata, rdata, work
        As of `look_for_jumps`.
    t : float
    p : int
        The parameter.
    by : float
        By how much of its scale; unknowns move along its sensitivities.
    """
    n = tr.scale.shape[0]
    lagrange_weights(t, tr.times, k + 1, tr.value, tr.slope)
    between, history = tr.between, tr.y
    for j in range(k + 1):
        weight = tr.value[j]
        if j == 0:
            for i in range(n):
                between[i] = weight * history[0, i]
            continue
        for i in range(n):
            between[i] += weight * history[j, i]
    if by != 0.0:
        for j in range(k + 1):
            for i in range(n):
                between[i] += tr.value[j] * by * tr.s[lane_of(tr, j, p, i)]
    first, last = tr.first[p], tr.first[p + 1]
    if by != 0.0:
        for q in range(first, last):
            tr.kept[q] = rdata[tr.place[q]]
            rdata[tr.place[q]] += by * tr.weight[q]
    functions.residual(t, tr.between, yp, tr.plus, idata, rdata, work)
    if by != 0.0:
        for q in range(first, last):
            rdata[tr.place[q]] = tr.kept[q]


@njit(cache=True, nogil=True, error_model="numpy")
def _correction(functions, tr, plan, factors, k, t, yp, p, by, out, idata, rdata, work):
    """Write by how much the corrector would move the unknowns at a time to ``out``.

    Parameters
    ----------
    functions, tr, plan, factors, k, yp, idata, rdata, work
        As of `look_for_jumps`.
    t, p, by
        As of `_residual`.
    out : ndarray, shape (n,)
    """
    _residual(functions, tr, k, t, yp, p, by, idata, rdata, work)
    solve(plan, factors, tr.plus, out)


@njit(cache=True, nogil=True, error_model="numpy")
def _size(tr, i, moved):
    """Return a change of what `_correction` finds of unknown i, as part of what is looked at."""
    limit = SEEN * tr.most_rate[i] + ROUNDED * EPS * tr.gamma * tr.scale[i]
    return tr.watched[i] * abs(tr.gamma * moved) / limit


@njit(cache=True, nogil=True, error_model="numpy")
def _differs(tr, plan, factors):
    """Return whether the fourth difference of the residual, in ``tr.last_seen``, is more than what is looked at."""
    found, rates, scale, watched = tr.first_seen, tr.most_rate, tr.scale, tr.watched
    solve(plan, factors, tr.last_seen, found)
    gamma, rounded, seen = tr.gamma, ROUNDED * EPS * tr.gamma, False
    for i in range(scale.shape[0]):
        seen |= watched[i] * abs(gamma * found[i]) > SEEN * rates[i] + rounded * scale[i]
    return seen


@njit(cache=True, nogil=True, error_model="numpy")
def _seen_at_nodes(functions, tr, plan, factors, k, steps, yp, idata, rdata, work):
    """Return whether there may be a jump, by a fourth difference over the ends of steps and few points between them.

    At an end the residual is known, but for the rates: those of the newest point are taken at all. So three steps take
    one evaluation, in the middle of the widest. Points stand at uneven distances; a jump between any two counts fully.

    Parameters
    ----------
    functions, tr, plan, factors, k, steps, yp, idata, rdata, work
        As of `look_for_jumps`.
    """
    n, difference = tr.scale.shape[0], tr.last_seen
    nodes, weights, ends = np.empty(NODES), np.empty(NODES), np.empty(NODES, dtype=np.int64)
    for q in range(steps + 1):
        nodes[q], ends[q] = tr.times[q], q
    for count in range(steps + 1, NODES):
        # in the middle of the widest interval
        widest = 0
        for q in range(count - 1):
            if nodes[q] - nodes[q + 1] > nodes[widest] - nodes[widest + 1]:
                widest = q
        for q in range(count, widest + 1, -1):
            nodes[q], ends[q] = nodes[q - 1], ends[q - 1]
        nodes[widest + 1], ends[widest + 1] = 0.5 * (nodes[widest] + nodes[widest + 2]), -1
    # what all points behind a jump add up to
    total, least = 0.0, np.inf
    for q in range(NODES):
        weights[q] = 1.0
        for m in range(NODES):
            if m != q:
                weights[q] *= (nodes[0] - nodes[NODES - 1]) / (nodes[q] - nodes[m])
        total += weights[q]
        if q < NODES - 1:
            least = min(least, abs(total))
    for i in range(n):
        difference[i], tr.found[i] = 0.0, 0.0
    for q in range(NODES):
        w = weights[q] / least
        if ends[q] >= 0:
            slot = slot_of(tr, ends[q])
            for i in range(n):
                difference[i] += w * tr.left[slot, i]
                tr.found[i] += w * (yp[i] - tr.rates[slot, i])
        else:
            _residual(functions, tr, k, nodes[q], yp, 0, 0.0, idata, rdata, work)
            for i in range(n):
                difference[i] += w * tr.plus[i]
    for q in range(tr.slope_row.shape[0]):
        difference[tr.slope_row[q]] += tr.slope_value[q] * tr.found[tr.slope_col[q]]
    return _differs(tr, plan, factors)


@njit(cache=True, nogil=True, error_model="numpy")
def look_for_jumps(functions, tr, plan, factors, k, steps, yp, idata, rdata, work):
    """Look for jumps in the last steps, to the newest point, and note what each moves the sensitivities by.

    Parameters
    ----------
    functions, tr, plan, factors
        As of `gearmbs.dae.tangent_steps.follow_run`, with the newest point in the history.
    k : int
        Order of the polynomial.
    steps : int
        At most k, so that it goes through their ends.
    yp : ndarray, shape (n,)
        Rates at the newest point, with which the residual is looked at.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.
    """
    n = tr.scale.shape[0]
    difference, seen, stack = tr.last_seen, tr.looked_at, tr.stack
    for i in range(n):
        tr.most_rate[i] = max(tr.most_rate[i], abs(yp[i]))
    by_ends = tr.constant_slopes and tr.known > steps
    if by_ends:
        if not _seen_at_nodes(functions, tr, plan, factors, k, steps, yp, idata, rdata, work):
            return
    # a jump right at the end belongs to the step behind it, one right at the start to these
    lows, highs = np.empty(DEEP), np.empty(DEEP)
    lows[0] = tr.times[steps] - APART * EPS * abs(tr.times[steps])
    highs[0] = tr.times[0] - APART * EPS * abs(tr.times[0])
    waiting, looks = 1, 0
    narrow = NARROW * (tr.times[0] - tr.times[steps]) / steps
    # adjacent intervals that are small, from late to early: none yet
    begin, end, jumps = np.inf, np.inf, False
    while waiting > 0 and looks < LOOKS:
        waiting -= 1
        low, high = lows[waiting], highs[waiting]
        for j in range(NODES):
            if looks > 0 and j % 2 == 0:
                for i in range(n):
                    seen[j, i] = stack[3 * waiting + j // 2, i]
            else:
                _residual(functions, tr, k, low + 0.25 * j * (high - low), yp, 0, 0.0, idata, rdata, work)
                for i in range(n):
                    seen[j, i] = tr.plus[i]
        looks += 1
        for i in range(n):
            difference[i] = seen[0, i] - 4.0 * seen[1, i] + 6.0 * seen[2, i] - 4.0 * seen[3, i] + seen[4, i]
        fades = not _differs(tr, plan, factors)
        last = high - low <= APART * EPS * abs(high) or waiting + 2 > DEEP
        if fades or last:
            if high - low <= narrow:
                begin, end = low, high if begin == end else end
            elif begin < end:
                if not jumps:
                    _note_narrow(functions, tr, plan, factors, k, yp, begin, end, idata, rdata, work)
                begin, end, jumps = np.inf, np.inf, False
            if not fades:
                jumps = True
                _note(functions, tr, plan, factors, k, yp, low, high, narrow, idata, rdata, work)
            continue
        middle = low + 0.5 * (high - low)
        lows[waiting], highs[waiting] = low, middle
        lows[waiting + 1], highs[waiting + 1] = middle, high
        for j in range(3):
            for i in range(n):
                stack[3 * waiting + j, i] = seen[j, i]
                stack[3 * (waiting + 1) + j, i] = seen[j + 2, i]
        waiting += 2
    if begin < end and not jumps:
        _note_narrow(functions, tr, plan, factors, k, yp, begin, end, idata, rdata, work)
    if by_ends and looks == 1:
        # what was seen over the ends of the steps and not between them is right at the last, of the step behind it
        tr.known = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _note_narrow(functions, tr, plan, factors, k, yp, low, high, idata, rdata, work):
    """Note what a change within some small intervals moves the sensitivities by, if it is one.

    Parameters
    ----------
    functions, tr, plan, factors, k, yp, idata, rdata, work
        As of `look_for_jumps`.
    low, high : float
        Begin and end of the intervals, which about a change at the end of the steps may be part of it.
    """
    before, after, found = tr.first_seen, tr.last_seen, tr.seen_between
    width = high - low
    for _ in range(2):
        _correction(functions, tr, plan, factors, k, low, yp, 0, 0.0, before, idata, rdata, work)
        _correction(functions, tr, plan, factors, k, high, yp, 0, 0.0, after, idata, rdata, work)
        told = _most_changed(tr)
        change = after[told] - before[told]
        if _size(tr, told, change) > 1.0:
            _correction(functions, tr, plan, factors, k, low - width, yp, 0, 0.0, found, idata, rdata, work)
            earlier = abs(found[told] - before[told])
            _correction(functions, tr, plan, factors, k, high + width, yp, 0, 0.0, found, idata, rdata, work)
            if max(earlier, abs(found[told] - after[told])) < BESIDE * abs(change):
                break
        low, high = low - width, high + width
    else:
        return
    _note(functions, tr, plan, factors, k, yp, low, high, 0.0, idata, rdata, work)


@njit(cache=True, nogil=True, error_model="numpy")
def _most_changed(tr):
    """Return the unknown whose correction changes most, as a part of what is looked at."""
    before, after, told = tr.first_seen, tr.last_seen, 0
    for i in range(tr.scale.shape[0]):
        if _size(tr, i, after[i] - before[i]) > _size(tr, told, after[told] - before[told]):
            told = i
    return told


@njit(cache=True, nogil=True, error_model="numpy")
def _delay(functions, tr, plan, factors, k, yp, low, high, told, p, idata, rdata, work):
    """Return by how much later a change comes by one of a parameter, infinite where it need not come."""
    by = MOST
    for _ in range(MOVES):
        by *= SMALLER
        late = _moved(functions, tr, plan, factors, k, yp, low, high, told, p, by, idata, rdata, work)
        late -= _moved(functions, tr, plan, factors, k, yp, low, high, told, p, -by, idata, rdata, work)
        if np.isfinite(late):
            break
    if abs(late) <= 4.0 * APART * EPS * abs(high):
        return 0.0
    return late / (2.0 * by)


@njit(cache=True, nogil=True, error_model="numpy")
def _note(functions, tr, plan, factors, k, yp, low, high, beside, idata, rdata, work):
    """Note what a jump, or a narrow change, moves the sensitivities by; leave the corrections before and behind it.

    Parameters
    ----------
    functions, tr, plan, factors, k, yp, idata, rdata, work
        As of `look_for_jumps`.
    low, high : float
        Between which the equations jump, or change.
    beside : float
        Time before and behind that in which it is looked for again; 0 of a change, which is none that has to be crossed
        lest derivatives were wrong.
    """
    before, after = tr.first_seen, tr.last_seen
    n = tr.scale.shape[0]
    _correction(functions, tr, plan, factors, k, low, yp, 0, 0.0, before, idata, rdata, work)
    _correction(functions, tr, plan, factors, k, high, yp, 0, 0.0, after, idata, rdata, work)
    told = _most_changed(tr)
    counts = False
    for p in range(tr.parameters):
        delay = abs(_delay(functions, tr, plan, factors, k, yp, low, high, told, p, idata, rdata, work))
        if delay == 0.0:
            continue
        for i in range(n):
            moved = tr.watched[i] * abs(tr.gamma * (after[i] - before[i])) * delay
            if beside > 0.0 and moved > tr.lost[p, i]:
                tr.lost[p, i] = moved
                tr.lost_at[p] = high
            counts |= moved > NOTED * tr.largest[LANES * (n * (p // LANES) + i) + p % LANES]
    if counts and tr.changed < tr.changes.shape[0]:
        tr.changes[tr.changed, 0], tr.changes[tr.changed, 1] = low - beside, high + beside
        tr.changed += 1


@njit(cache=True, nogil=True, error_model="numpy")
def cross(functions, tr, plan, factors, k, high, yp, idata, rdata, work):
    """Take the sensitivities across a jump that comes right behind the newest point: they jump by -[y'] dt*/dp.

    The last step was so short that the corrector's matrix is nearly that of the rates alone.

    Parameters
    ----------
    functions, tr, plan, factors, k, yp, idata, rdata, work
        As of `look_for_jumps`.
    high : float
        Right behind the jump.
    """
    before, after = tr.first_seen, tr.last_seen
    n, low = tr.scale.shape[0], tr.times[0]
    _correction(functions, tr, plan, factors, k, low, yp, 0, 0.0, before, idata, rdata, work)
    _correction(functions, tr, plan, factors, k, high, yp, 0, 0.0, after, idata, rdata, work)
    told = _most_changed(tr)
    delays = np.zeros(tr.parameters)
    seen = _size(tr, told, after[told] - before[told]) > 1.0
    for p in range(tr.parameters):
        delays[p] = _delay(functions, tr, plan, factors, k, yp, low, high, told, p, idata, rdata, work)
        if not (seen and np.isfinite(delays[p])):
            # it is not here, or only just comes
            delays[p], tr.lost[p, told], tr.lost_at[p] = 0.0, np.inf, high
        if delays[p] != 0.0:
            tr.lost_at[p] = high
    # what they change by in as long times before and behind is no part of it
    for side in range(2):
        begin, end = (low - (high - low), low) if side == 0 else (high, high + (high - low))
        for t, sign in ((begin, 0.5), (end, -0.5)):
            _correction(functions, tr, plan, factors, k, t, yp, 0, 0.0, tr.found, idata, rdata, work)
            for i in range(n):
                after[i] += sign * tr.found[i]
    for p in range(tr.parameters):
        for i in range(n):
            # the corrector would move a rate by minus gamma times what it finds
            tr.s[lane_of(tr, 0, p, i)] += tr.differential[i] * tr.gamma * (after[i] - before[i]) * delays[p]


@njit(cache=True, nogil=True, error_model="numpy")
def _moved(functions, tr, plan, factors, k, yp, low, high, told, p, by, idata, rdata, work):
    """Return by how much later a jump comes with the run moved along a parameter.

    Parameters
    ----------
    functions, tr, plan, factors, k, yp, idata, rdata, work
        As of `look_for_jumps`.
    low, high : float
        Between which the equations jump on the run itself.
    told : int
        Unknown by whose correction it is told on which side of the jump a time lies.
    p, by
        As of `_residual`.
    """
    before, after, found = tr.first_seen[told], tr.last_seen[told], tr.seen_between
    width, most = high - low, WIDENED * (tr.times[0] - tr.times[1])
    first, last = low, high
    for _ in range(64):
        _correction(functions, tr, plan, factors, k, first, yp, p, by, found, idata, rdata, work)
        earlier = abs(found[told] - after) < abs(found[told] - before)
        _correction(functions, tr, plan, factors, k, last, yp, p, by, found, idata, rdata, work)
        later = abs(found[told] - after) > abs(found[told] - before)
        if not earlier and not later:
            break
        width *= WIDENED
        if width > most:
            # it comes by more than steps later, or no longer, as where the run just reaches it
            return np.inf if by > 0.0 else -np.inf
        if earlier:
            last, first = first, first - width
        else:
            first, last = last, last + width
    while last - first > APART * EPS * abs(high):
        middle = first + 0.5 * (last - first)
        _correction(functions, tr, plan, factors, k, middle, yp, p, by, found, idata, rdata, work)
        if abs(found[told] - after) < abs(found[told] - before):
            last = middle
        else:
            first = middle
    return 0.5 * ((first - low) + (last - high))
