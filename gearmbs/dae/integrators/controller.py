"""Order and step size of the next step, from divided differences over the actual history."""

from __future__ import annotations

from numba import float64, int64, njit, types

from gearmbs.dae.integrators.bdf import divided_difference_norm, step_for_error
from gearmbs.dae.integrators.run_state import (
    CAUTION,
    FIXED_LEADING,
    MAX_ORDER_ALLOWED,
    NODES,
    NPAST,
    ORDER,
    RES,
    SINCE_CHANGE,
    VALUE,
    W_ERROR,
    H,
)

TARGET = 0.2
RAISE_GAIN = 1.15
GROW_FROM = 1.2
GROW_AT_MOST = 2.0
SHRINK_FROM = 0.9
SHRINK_AT_MOST = 0.5
FAIL_SHRINK = (0.1, 0.8)

_VEC = float64[::1]
_IVEC = int64[::1]
_MAT = float64[:, ::1]


@njit(float64(int64, float64, _VEC, _VEC, _MAT, _MAT, _MAT), cache=True, nogil=True, error_model="numpy")
def _step_at_order(k, h, nodes, times, hist, vec, small):
    """Return the step size at order k from ``nodes[0]``, from the difference over the newest k + 2 points."""
    difference = divided_difference_norm(times, k + 2, hist, vec[W_ERROR], small[VALUE], vec[RES])
    return step_for_error(h, nodes, k, difference, TARGET)


@njit(types.void(_VEC, _IVEC, _VEC, _MAT, _MAT, _MAT), cache=True, nogil=True, error_model="numpy")
def after_success(real, count, times, hist, vec, small):
    """Set order and step size after an accepted step; ``hist[0]`` is its result.

    The order is raised only after order + 1 steps without a change or a failure, and only for a clear gain; it is
    lowered as soon as the lower order allows the same step.
    """
    k = count[ORDER]
    h = real[H]
    npast = count[NPAST]
    count[SINCE_CHANGE] += 1
    if count[CAUTION] > 0:
        count[CAUTION] -= 1
    settled = count[SINCE_CHANGE] > k
    if npast < k + 2 or (count[FIXED_LEADING] and not settled):
        # a re-interpolated history tells nothing new before it has been replaced
        return
    best = k
    h_best = _step_at_order(k, h, times, times, hist, vec, small)
    if k > 1:
        h_low = _step_at_order(k - 1, h, times, times, hist, vec, small)
        if h_low >= h_best:
            best = k - 1
            h_best = h_low
    if best == k and k < count[MAX_ORDER_ALLOWED] and npast >= k + 3 and settled and count[CAUTION] == 0:
        h_high = _step_at_order(k + 1, h, times, times, hist, vec, small)
        if h_high > RAISE_GAIN * h_best:
            best = k + 1
            h_best = h_high
    ratio = h_best / h
    if best != k:
        count[ORDER] = best
        count[SINCE_CHANGE] = 0
    if ratio > GROW_FROM:
        if (settled or k == 1 or best != k) and count[CAUTION] == 0:
            real[H] = h * min(ratio, GROW_AT_MOST)
            count[SINCE_CHANGE] = 0
    elif ratio < SHRINK_FROM:
        real[H] = h * max(ratio, SHRINK_AT_MOST)
        count[SINCE_CHANGE] = 0


@njit(types.void(_VEC, _IVEC, _VEC, _MAT, _MAT, _MAT, float64, int64), cache=True, nogil=True, error_model="numpy")
def after_error_failure(real, count, times, hist, vec, small, error, fails):
    """Set order and step size after the error test failed for the ``fails``-th time at this step.

    ``hist[0]`` is the rejected result, so that a kink within the step shows in the differences and takes the order
    down with the step.
    """
    k = count[ORDER]
    h = real[H]
    npast = count[NPAST]
    low, high = FAIL_SHRINK
    if npast < 2:
        factor = 0.8 * (TARGET / error) ** 0.5
        best = 1
    elif fails >= 3:
        factor = 0.25
        best = 1
    else:
        nodes = small[NODES]
        for m in range(min(npast, k + 1)):
            nodes[m] = times[m + 1]
        best = 0
        h_best = 0.0
        lowest = max(1, k - 1) if fails == 1 else 1
        for m in range(k - lowest + 1):
            j = k - m
            h_j = _step_at_order(j, h, nodes, times, hist, vec, small)
            if h_j >= h_best:
                best = j
                h_best = h_j
        factor = h_best / h
        if fails > 1:
            factor = min(factor, 0.5)
    real[H] = h * min(max(factor, low), high)
    count[ORDER] = best
    count[SINCE_CHANGE] = 0
    count[CAUTION] = 1 + best
