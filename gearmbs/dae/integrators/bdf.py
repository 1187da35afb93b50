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

from numba import float64, int64, njit, types

from gearmbs.dae.dense_output import lagrange_weights

MAX_ORDER = 6
HISTORY = MAX_ORDER + 2
MAX_STEP_RATIO = 8.0
STEP_SEARCH_SWEEPS = 3

_VEC = float64[::1]
_MAT = float64[:, ::1]


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


@njit(types.void(_VEC, _VEC, int64, _MAT, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def predict(value, slope, count, hist, y, yp):
    """Write ``y = sum value[j] hist[j]`` and ``yp = sum slope[j] hist[j]`` over ``count`` rows."""
    n = y.shape[0]
    a = value[0]
    b = slope[0]
    for i in range(n):
        v = hist[0, i]
        y[i] = a * v
        yp[i] = b * v
    for j in range(1, count):
        a = value[j]
        b = slope[j]
        for i in range(n):
            v = hist[j, i]
            y[i] += a * v
            yp[i] += b * v


@njit(types.void(_VEC, int64, _VEC), cache=True, nogil=True, error_model="numpy")
def divided_difference_weights(nodes, count, weights):
    """Write w with f[t_1 .. t_count] = sum w[j] f(t_j)."""
    for j in range(count):
        product = 1.0
        for m in range(count):
            if m != j:
                product *= nodes[j] - nodes[m]
        weights[j] = 1.0 / product


@njit(float64(_VEC, int64, _MAT, _VEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def divided_difference_norm(nodes, count, hist, inv_weight, weights, scratch):
    """Return max_i inv_weight[i] |f_i[t_1 .. t_count]| over the rows of ``hist``."""
    divided_difference_weights(nodes, count, weights)
    n = inv_weight.shape[0]
    a = weights[0]
    for i in range(n):
        scratch[i] = a * hist[0, i]
    for j in range(1, count):
        a = weights[j]
        for i in range(n):
            scratch[i] += a * hist[j, i]
    top = 0.0
    for i in range(n):
        top = max(top, abs(scratch[i]) * inv_weight[i])
    return top


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
        if e <= target * MAX_STEP_RATIO ** -(k + 1.0):
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
