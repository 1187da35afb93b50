"""Weights of the error test and of the corrector test, and norms with them."""

from __future__ import annotations

from numba import float64, int64, void

from gearmbs._jit import njit
from gearmbs.dae.compiled.ordered_bits import bits_of, double_of
from gearmbs.dae.integrators.run_state import STATE_TYPE

_VEC = float64[::1]


@njit(cache=True, nogil=True, error_model="numpy")
def weighted_max(v, weight):
    """Return max_i |v[i]| weight[i]; infinity or NaN if an entry is not finite."""
    top = int64(0)
    for i in range(v.shape[0]):
        top = max(top, bits_of(abs(v[i] * weight[i])))
    return double_of(top)


@njit(int64(_VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def weighted_argmax(v, weight):
    """Return the index of the largest |v[i]| weight[i]."""
    top = -1.0
    where = 0
    for i in range(v.shape[0]):
        a = abs(v[i]) * weight[i]
        if a > top:
            top = a
            where = i
    return where


@njit(void(STATE_TYPE, _VEC, float64), cache=True, nogil=True, error_model="numpy")
def set_weights(st, y, h):
    """Set the weights of the error test and of the corrector test from the tolerances at ``y``.

    Algebraic unknowns outside error control (multipliers, forces) reach the others only through a step of size h, and
    h times their error is what the corrector test sees; taken at face value their rounding noise, which grows
    like 1/h, would never let a small step converge.

    Parameters
    ----------
    st : RunState
    y : ndarray, shape (n,)
    h : float
        Size of the step.
    """
    rtol = st.rtol
    weight, atol = st.weight, st.atol
    w_error, controlled = st.w_error, st.controlled
    w_newton, tested, coupled = st.w_newton, st.tested, st.coupled
    reach = min(h, 1.0)
    # one result a loop: the compiler vectorises no loop over more arrays than it can check for overlap
    for i in range(y.shape[0]):
        weight[i] = 1.0 / (atol[i] + rtol * abs(y[i]))
    for i in range(y.shape[0]):
        w_error[i] = controlled[i] * weight[i]
    for i in range(y.shape[0]):
        w_newton[i] = tested[i] * weight[i] * max(coupled[i], reach)


@njit(cache=True, nogil=True, error_model="numpy")
def renew_weights(st, y, h):
    """Set the weights for a step of size h from ``y`` where they have changed since the last one."""
    if st.rtol > 0.0 or st.step_in_weights:
        set_weights(st, y, h)
