"""At which points the sensitivities of a run are followed: the ends of its steps, and some between them."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.bdf import MAX_ORDER
from gearmbs.dae.result import DenseOutput

END_OF_STEP, AFRESH, SHORT, JUMP = 1, 2, 4, 8
"""Flags of a point: it ends a step of the run; no point before it but the last counts; no step to it is too long; the
equations jump between the point before and this one, which has the same time but for rounding."""
GROWTH, GROWING_ORDER = 1.4, 3
"""Ratio of a step to the one before it, and order, with which steps grow behind a restart: for ever at this ratio the
formula of order three is stable up to 1.53, that of order four up to 1.28."""
EVEN, EVEN_ORDER = 0.99, 4
"""Part of the longest step allowed from which one was limited by that, and the order taken there."""
SHORTER = 0.25
"""Ratio of a step of order one to the one before it from which a run has started afresh."""
SAFE, LEAST, MOST_GROWTH = 0.8, 0.1, 2.0
"""Part of the step whose local error is what is allowed that is tried next; its bounds, as part of the one before."""


def shorter(h: float, over: float, order: int) -> float:
    """Return the step behind one of size ``h`` whose local error was ``over`` of what is allowed."""
    wanted = SAFE * over ** (-1.0 / (order + 1)) if over > 0.0 else MOST_GROWTH
    return h * min(max(wanted, LEAST), MOST_GROWTH)


def points_of(sol: DenseOutput, longest: float = np.inf) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, orders and flags of the points at which a run is followed.

    These are the ends of its steps. Where it starts afresh, long steps behind short ones are divided, so that the
    order can grow from one as it does at the start of a run. Steps as long as ``longest`` allows are even and say
    nothing of the order: a motion at rest has the first one. There it grows by itself.
    """
    nodes, step_orders = sol.stored()
    steps = np.flatnonzero(step_orders > 0)
    ends, step_orders = nodes[steps], step_orders[steps].astype(np.int64)
    sizes = np.diff(ends, prepend=nodes[steps[0] - 1])
    even = sizes > EVEN * longest
    # of all other steps times and orders are those of the run, once the order has grown
    notable = np.append(np.flatnonzero((step_orders == 1) | even), ends.size)
    times: list[np.ndarray] = []
    orders: list[np.ndarray] = []
    flags: list[np.ndarray] = []
    before, size, allowed, growing, at = 0, np.inf, 1, False, 0
    while at < ends.size:
        if not growing and allowed >= MAX_ORDER:
            until = int(notable[np.searchsorted(notable, at)])
            if until > at:
                times.append(ends[at:until])
                orders.append(np.minimum(step_orders[at:until], MAX_ORDER))
                flags.append(np.full(until - at, END_OF_STEP))
                size, before, at = float(sizes[until - 1]), int(step_orders[until - 1]), until
                continue
        end, h, order = float(ends[at]), float(sizes[at]), int(step_orders[at])
        # the last steps are cut by the end
        still = even[at] or (at > 0 and even[at - 1] and order == 1)
        even[at] = still
        if still:
            order = max(order, min(EVEN_ORDER, before + 1))
        afresh = order == 1 and (before != 1 or h < SHORTER * size)
        growing |= afresh
        inner, last_piece = np.array([end]), h
        if not afresh and growing and h > GROWTH * size:
            number = int(np.ceil(np.log1p((GROWTH - 1.0) * h / (GROWTH * size)) / np.log(GROWTH)))
            pieces = GROWTH ** np.arange(number, dtype=float)
            inner = np.append((end - h + h * np.cumsum(pieces) / pieces.sum())[:-1], end)
            last_piece = h * float(pieces[-1] / pieces.sum())
        elif not afresh and allowed >= min(order, GROWING_ORDER):
            growing = False
        allowed = 0 if afresh else allowed
        grown = []
        for _ in inner:
            allowed = min(allowed + 1, GROWING_ORDER if growing else MAX_ORDER)
            grown.append(allowed if growing else min(allowed, order))
        flag = np.full(inner.size, AFRESH if afresh else 0)
        flag[-1] |= END_OF_STEP
        times.append(inner)
        orders.append(np.array(grown))
        flags.append(flag)
        size, before, at = last_piece, order, at + 1
    return np.concatenate(times), np.concatenate(orders).astype(np.int64), np.concatenate(flags).astype(np.int64)
