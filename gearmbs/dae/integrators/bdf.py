"""Coefficients of variable-coefficient BDF from the actual step history.

With past points t_1 > t_2 > ... (``nodes``, newest first) and a new time t, the predictor of order k is the
polynomial through the k + 1 newest points. The corrector polynomial agrees with it at t_1 .. t_k and takes the unknown
value y at t, so

    y' = y'_pred + gamma (y - y_pred),   gamma = sum_{j=1..k} 1/(t - t_j),

and the leading term of the local error is r/(1 + r) (y - y_pred) with r = 1/(gamma T), T = t - t_{k+1}.

References
----------
.. [1] W. M. G. van Bokhoven, "Linear implicit differentiation formulas of variable step and order",
       IEEE Trans. Circuits and Systems 22 (1975) 109-115.
"""

from __future__ import annotations

from gearmbs.dae.result import lagrange_weights
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types
from gearmbs.kernels.lanes import bits_of, double_of

MAX_ORDER = 6
HISTORY = MAX_ORDER + 2
MAX_STEP_RATIO = 8.0
"""Largest ratio of the step found to the one the search starts from: the eight that first steps may grow by. Over
longer ones a divided difference of the past says nothing."""
STEP_SEARCH_SWEEPS = 3

_VEC = float64[::1]


@njit(float64(float64, _VEC, int64), cache=True, nogil=True, error_model="numpy")
def leading_coefficient(t, nodes, k):
    """Return gamma of the order-k formula at ``t`` over the past times ``nodes`` (newest first)."""
    gamma = 0.0
    for j in range(k):
        gamma += 1.0 / (t - nodes[j])
    return gamma


@njit(float64(float64, _VEC, int64), cache=True, nogil=True, error_model="numpy")
def error_constant(t, nodes, k):
    """Return r/(1 + r), the local error of order k in units of corrector minus predictor."""
    r = 1.0 / (leading_coefficient(t, nodes, k) * (t - nodes[k]))
    return r / (1.0 + r)


@njit(float64(float64, _VEC, int64, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def step_coefficients(t, nodes, k, value, slope):
    """Write the predictor weights for y and y' of the order-k step to ``t`` and return gamma."""
    lagrange_weights(t, nodes, k + 1, value, slope)
    return leading_coefficient(t, nodes, k)


@njit(cache=True, nogil=True, error_model="numpy")
def predict(value, slope, count, hist, y, yp):
    """Write ``y = sum value[j] hist[j]`` and ``yp = sum slope[j] hist[j]`` over ``count`` rows, three at a time."""
    n = y.shape[0]
    for j in range(0, count, 3):
        rows = min(3, count - j)
        # a missing row enters as the first of its three, times zero
        r0, r1, r2 = hist[j], hist[j + (1 if rows > 1 else 0)], hist[j + (2 if rows > 2 else 0)]
        a0, b0 = value[j], slope[j]
        a1, b1 = (value[j + 1], slope[j + 1]) if rows > 1 else (0.0, 0.0)
        a2, b2 = (value[j + 2], slope[j + 2]) if rows > 2 else (0.0, 0.0)
        if j == 0:
            for i in range(n):
                y[i] = a0 * r0[i] + a1 * r1[i] + a2 * r2[i]
                yp[i] = b0 * r0[i] + b1 * r1[i] + b2 * r2[i]
        else:
            for i in range(n):
                y[i] = y[i] + a0 * r0[i] + a1 * r1[i] + a2 * r2[i]
                yp[i] = yp[i] + b0 * r0[i] + b1 * r1[i] + b2 * r2[i]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _divided_difference_weights(nodes, count, weights):
    """Write w with f[t_1 .. t_count] = sum w[j] f(t_j)."""
    for j in range(count):
        product = 1.0
        for m in range(count):
            if m != j:
                product *= nodes[j] - nodes[m]
        weights[j] = 1.0 / product


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _combination_norm(weights, hist, inv_weight, count):
    top = int64(0)
    for i in range(inv_weight.shape[0]):
        v = 0.0
        for j in range(count):
            v += weights[j] * hist[j, i]
        top = max(top, bits_of(abs(v * inv_weight[i])))
    return double_of(top)


@njit(cache=True, nogil=True, error_model="numpy")
def combination_norm(weights, count, hist, inv_weight):
    """Return max_i inv_weight[i] |sum_j weights[j] hist[j, i]| over the first 2 to HISTORY rows.

    The count of rows is a constant in each branch: the compiler unrolls the sum and vectorises over the unknowns.
    """
    if count == 2:
        return _combination_norm(weights, hist, inv_weight, 2)
    if count == 3:
        return _combination_norm(weights, hist, inv_weight, 3)
    if count == 4:
        return _combination_norm(weights, hist, inv_weight, 4)
    if count == 5:
        return _combination_norm(weights, hist, inv_weight, 5)
    if count == 6:
        return _combination_norm(weights, hist, inv_weight, 6)
    if count == 7:
        return _combination_norm(weights, hist, inv_weight, 7)
    return _combination_norm(weights, hist, inv_weight, HISTORY)


@njit(types.void(_VEC, int64, _VEC), cache=True, nogil=True, error_model="numpy")
def divided_difference_weights(nodes, count, weights):
    """Write w with f[t_1 .. t_count] = sum w[j] f(t_j); the number of nodes is a constant in most branches."""
    if count == 2:
        _divided_difference_weights(nodes, 2, weights)
    elif count == 3:
        _divided_difference_weights(nodes, 3, weights)
    elif count == 4:
        _divided_difference_weights(nodes, 4, weights)
    elif count == 5:
        _divided_difference_weights(nodes, 5, weights)
    elif count == 6:
        _divided_difference_weights(nodes, 6, weights)
    elif count == 7:
        _divided_difference_weights(nodes, 7, weights)
    else:
        _divided_difference_weights(nodes, count, weights)


@njit(cache=True, nogil=True, error_model="numpy")
def divided_difference_norm(nodes, count, hist, inv_weight, weights):
    """Return max_i inv_weight[i] |f_i[t_1 .. t_count]| over the rows of ``hist``; ``weights`` is overwritten."""
    divided_difference_weights(nodes, count, weights)
    return combination_norm(weights, count, hist, inv_weight)


@njit(float64(float64, _VEC, int64, float64), cache=True, nogil=True, error_model="numpy")
def local_error(h, nodes, k, difference):
    """Return the local error of an order-k step of size h from ``nodes[0]``.

    Parameters
    ----------
    h : float
    nodes : ndarray
        Past times, newest first; k + 1 are used.
    k : int
    difference : float
        Norm of the divided difference of order k + 1, y^(k+1)/(k+1)!.
    """
    t = nodes[0] + h
    product = 1.0
    for j in range(k + 1):
        product *= t - nodes[j]
    return error_constant(t, nodes, k) * product * difference


@njit(float64(float64, _VEC, int64, float64, float64), cache=True, nogil=True, error_model="numpy")
def step_for_error(h, nodes, k, difference, target):
    """Return about the step size whose local error at order k is ``target``, within a factor 8 of h.

    Far older points than the step let the error grow with less than the power k + 1 of h; a shrinking step follows the
    power that holds at the trial size, a growing one trusts the full power and so stays on the safe side.
    """
    trial = h
    for _ in range(STEP_SEARCH_SWEEPS):
        e = local_error(trial, nodes, k, difference)
        if e * MAX_STEP_RATIO ** (k + 1) <= target:
            trial *= MAX_STEP_RATIO
        else:
            power = k + 1.0
            if e > target:
                power = 0.0
                for j in range(k + 1):
                    power += trial / (trial + nodes[0] - nodes[j])
            trial *= (target / e) ** (1.0 / power)
        trial = min(max(trial, h / MAX_STEP_RATIO), h * MAX_STEP_RATIO)
        if e > 0.8 * target and e < 1.25 * target:
            break
    return trial
