"""Steps limited by rounding: how far rounding moves the corrector, and when a step is taken in spite of it."""

from __future__ import annotations

import numpy as np
from numba import float64

from gearmbs._jit import njit
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.corrector import ROUNDING_LEVEL
from gearmbs.dae.integrators.run_state import STATE_TYPE
from gearmbs.dae.integrators.weights import weighted_max
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, solve

NOISE_SAMPLES = 2
NOISE_MARGIN = 4.0
NOISY_ALLOWED = 60
PREDICTION_ERROR = 2.0
GOLDEN_FRACTION = 0.6180339887498949
EPS = 2.220446049250313e-16


@njit(float64(STATE_TYPE, PLAN_TYPE, FACTORS_TYPE), cache=True, nogil=True, error_model="numpy")
def rounding_level(st, plan, factors):
    """Return how far rounding alone moves the corrector, in units of the tolerance.

    The terms of the equations are about |J| |y| in size, and their sums wrong by the last digit of that. Near a
    singular position of a mechanism the equations turn such errors into many times as much of some unknowns, whatever
    the step.

    Parameters
    ----------
    st : RunState
        With the unknowns in ``y`` and the factored matrix in ``matrix``; ``res`` and ``y_between`` are overwritten.
    plan, factors : LUPlan, LUFactors
    """
    y, matrix, size, moved = st.y, st.matrix, st.res, st.y_between
    n = y.shape[0]
    size[:] = 0.0
    for k in range(n):
        a = abs(y[plan.col_to[k]])
        for p in range(plan.a_ptr[k], plan.a_ptr[k + 1]):
            size[plan.row_from[plan.a_pos[p]]] += abs(matrix[plan.a_src[p]]) * a
    level = 0.0
    phase = 0.0
    for _ in range(NOISE_SAMPLES):
        for i in range(n):
            # signs without a pattern: the fractional parts of multiples of the golden ratio
            phase += GOLDEN_FRACTION
            phase -= np.floor(phase)
            moved[i] = EPS * size[i] if phase < 0.5 else -EPS * size[i]
        solve(plan, factors, moved, moved)
        level = max(level, weighted_max(moved, st.w_error))
    return level


@njit(cache=True, nogil=True, error_model="numpy")
def accept_noise(st, plan, factors, from_prediction):
    """Return whether rounding explains ``st.delta``; if so, leave the better of corrector and prediction in ``st.y``.

    That is a result too far from its prediction, which is noisy itself, or else a correction that will not get
    smaller. No step would mend it near a singular position, so the run has to go through as it is. The noise passed on
    to the past, ``st.noise`` in units of the tolerance, comes back amplified by 2^k in predictions of order k.
    Where that is less than the noise of the corrector, the prediction stands for the solution.

    Parameters
    ----------
    st : RunState
    plan, factors : LUPlan, LUFactors
    from_prediction : bool
        Whether ``st.delta`` is the distance from the prediction.
    """
    if not st.matrix_fresh or st.noise_run >= NOISY_ALLOWED or st.n_past < 3:
        return False
    noise = rounding_level(st, plan, factors)
    predicted = 2.0**st.order * max(st.noise, ROUNDING_LEVEL) + PREDICTION_ERROR
    leeway = 2.0 * predicted if from_prediction else 0.0
    if not weighted_max(st.delta, st.w_error) <= NOISE_MARGIN * noise + leeway:
        return False
    if noise < ROUNDING_LEVEL:
        return False
    st.noise_left = HISTORY
    if noise <= predicted:
        st.noise = max(st.noise, noise)
        return True
    st.noise = max(st.noise, predicted)
    for i in range(st.y.shape[0]):
        st.y[i] = st.y_pred[i]
        st.yp[i] = st.yp_pred[i]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def remember_noise(st):
    """Note the noise in the history, in case this step is refused after all."""
    st.noise_before = st.noise
    st.noise_left_before = st.noise_left


@njit(cache=True, nogil=True, error_model="numpy")
def forget_noise(st):
    """Take back what `accept_noise` noted in a step that was refused: it has not come into the past."""
    st.noise = st.noise_before
    st.noise_left = st.noise_left_before


@njit(cache=True, nogil=True, error_model="numpy")
def count_noise(st):
    """Count an accepted step while there is noise in the history, and note in ``st.noisy`` whether there is."""
    st.noisy = st.noise_left > 0
    if not st.noisy:
        return
    st.noise_left -= 1
    st.noise_run += 1
    st.noise_limited += 1
    st.matrix_wanted = True
    if st.noise_left == 0:
        st.noise_run = 0
        st.noise = 0.0
