"""Kernels of force elements given by a user's function, whose address comes first among the integers.

The function has the signature `FUNCTION_SIG`; see :meth:`gearmbs.mechanism.Mechanism.force`. Without a second one for
the derivatives these are central differences, with a small step in each spatial variation of each frame and in each
state. Both kernels are compiled once, with the package; only the user's function is compiled when it is given.
"""

from __future__ import annotations

import numpy as np
from numba import types

from gearmbs._jit import njit
from gearmbs.dae.compiled.pointers import F8, MAT, VEC, caller
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations.force_elements import DERIVATIVES, FORCE_SIG, FRAME_A, FRAME_COLUMNS, FRAME_P

FUNCTION_SIG = types.void(F8, MAT, VEC, VEC, MAT, VEC, VEC)
"""function(t, frames, states, parameters, wrench, rates, diagnostics)"""
DERIVATIVES_SIG = types.void(F8, MAT, VEC, VEC, MAT)
"""derivatives(t, frames, states, parameters, jac)"""

function_at = caller(FUNCTION_SIG)
derivatives_at = caller(DERIVATIVES_SIG)

STEPS = 4
"""Reals in front of the parameters: steps of length, angle, speed and angular speed."""
STATE_STEP = 1e-6
"""Step of a state, of its size."""
SMALLEST_STATE_STEP = 1e-9


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def with_derivatives(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Call the user's function and, if derivatives are wanted, the function that gives them.

    Arguments as in `gearmbs.dae.equations.force_elements`; ``ints`` holds the addresses of both.
    """
    parameters = vector_at(reals, STEPS, reals.size - STEPS)
    function_at(ints[0])(t, frames, states, parameters, wrench, rates, diagnostics)
    if want & DERIVATIVES:
        derivatives_at(ints[1])(t, frames, states, parameters, jac)


@njit("void(float64[:, ::1], float64[:, ::1], int64, int64, float64)", cache=True, nogil=True, error_model="numpy")
def vary(frames, out, k, c, h):
    """Write the frames to ``out``, frame k moved by its spatial variation c of size h."""
    for m in range(frames.shape[0]):
        for q in range(FRAME_COLUMNS):
            out[m, q] = frames[m, q]
    if c < 3:
        out[k, FRAME_P + c] += h
    elif c < 6:
        c1, c2 = (c - 2) % 3, (c - 1) % 3
        sine, cosine = np.sin(h), np.cos(h)
        for q in range(3):
            y, z = frames[k, FRAME_A + 3 * c1 + q], frames[k, FRAME_A + 3 * c2 + q]
            out[k, FRAME_A + 3 * c1 + q] = cosine * y - sine * z
            out[k, FRAME_A + 3 * c2 + q] = sine * y + cosine * z
    else:
        # velocity and angular velocity stand behind the orientation
        out[k, c + 6] += h


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def by_differences(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Call the user's function and, if derivatives are wanted, find them by central differences.

    Arguments as in `gearmbs.dae.equations.force_elements`; ``ints`` holds the address of the function, ``reals``
    begins with the steps.
    """
    parameters = vector_at(reals, STEPS, reals.size - STEPS)
    function_at(ints[0])(t, frames, states, parameters, wrench, rates, diagnostics)
    if not want & DERIVATIVES:
        return
    markers, wrenches = frames.shape[0], wrench.shape[0]
    at = markers * FRAME_COLUMNS
    moved = matrix_at(work, 0, markers, FRAME_COLUMNS)
    moved_states = vector_at(work, at, states.size)
    at += states.size
    told = vector_at(work, at, diagnostics.size)
    at += diagnostics.size
    loads = matrix_at(work, at, wrenches, 6)
    speeds = vector_at(work, at + 6 * wrenches, rates.size)
    for k in range(states.size):
        moved_states[k] = states[k]
    for column in range(12 * markers + states.size):
        k, c = column // 12, column % 12
        of_state = column >= 12 * markers
        z = column - 12 * markers
        h = max(STATE_STEP * abs(states[z]), SMALLEST_STATE_STEP) if of_state else reals[c // 3]
        for side in (1.0, -1.0):
            for q in range(loads.size + speeds.size + told.size):
                work[at - told.size + q] = 0.0
            if of_state:
                vary(frames, moved, 0, 0, 0.0)
                moved_states[z] = states[z] + side * h
            else:
                vary(frames, moved, k, c, side * h)
            function_at(ints[0])(t, moved, moved_states, parameters, loads, speeds, told)
            for w in range(wrenches):
                for q in range(6):
                    jac[6 * w + q, column] += side * loads[w, q] / (2.0 * h)
            for q in range(rates.size):
                jac[6 * wrenches + q, column] += side * speeds[q] / (2.0 * h)
        if of_state:
            moved_states[z] = states[z]
