"""A chain of inertias and springs with backlash, integrated by the classical Runge-Kutta method."""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit

STEPS_PER_PERIOD = 40
"""Steps in a period of the fastest mode."""


@njit(
    "void(float64, float64[::1], float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[::1])",
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def slopes_of(t, state, inertias, ground, load, rows, numbers, prescribed, out):
    """Write the rates of angles and speeds.

    Parameters
    ----------
    t : float
        s.
    state : ndarray, shape (2n,)
        Angles, speeds; those of prescribed shafts are set here.
    inertias, ground, load : ndarray, shape (n,)
        kg m^2, damping against the ground (N m s/rad), torques (N m).
    rows : ndarray, shape (springs, n)
        Levers g.
    numbers : ndarray, shape (springs, 5)
        Stiffness, damping, sense, upper and lower end of the free way.
    prescribed : ndarray, shape (n, 4)
        1 for a prescribed shaft; w, A and 2 pi f of its angle w t - A sin(2 pi f t).
    out : ndarray, shape (2n,)
        Out.
    """
    n = inertias.size
    for i in range(n):
        if prescribed[i, 0] != 0.0:
            w = prescribed[i, 3]
            state[i] = prescribed[i, 1] * t - prescribed[i, 2] * np.sin(w * t)
            state[n + i] = prescribed[i, 1] - prescribed[i, 2] * w * np.cos(w * t)
        out[i] = state[n + i]
        out[n + i] = load[i] - ground[i] * state[n + i]
    for k in range(rows.shape[0]):
        stretch, rate = 0.0, 0.0
        for i in range(n):
            stretch += rows[k, i] * state[i]
            rate += rows[k, i] * state[n + i]
        sense = numbers[k, 2]
        x, force = sense * stretch, 0.0
        if x > numbers[k, 3]:
            force = sense * (numbers[k, 0] * (x - numbers[k, 3])) + numbers[k, 1] * rate
        elif x < numbers[k, 4]:
            force = sense * (numbers[k, 0] * (x - numbers[k, 4])) + numbers[k, 1] * rate
        for i in range(n):
            out[n + i] -= rows[k, i] * force
    for i in range(n):
        out[n + i] = 0.0 if prescribed[i, 0] != 0.0 else out[n + i] / inertias[i]


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], "
    "float64, int64, float64[:, ::1])",
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def integrate(state, inertias, ground, load, rows, numbers, prescribed, step, every, out):
    """Integrate from time 0; write a row each ``every`` steps from the second on.

    Parameters
    ----------
    state : ndarray, shape (2n,)
        At the start; in and out.
    inertias, ground, load, rows, numbers, prescribed : ndarray
        See `slopes_of`.
    step : float
        s.
    every : int
    out : ndarray, shape (m, 2n)
        Out.
    """
    size = state.size
    here, k1, k2, k3, k4 = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    for n in range((out.shape[0] - 1) * every):
        t = n * step
        slopes_of(t, state, inertias, ground, load, rows, numbers, prescribed, k1)
        for i in range(size):
            here[i] = state[i] + 0.5 * step * k1[i]
        slopes_of(t + 0.5 * step, here, inertias, ground, load, rows, numbers, prescribed, k2)
        for i in range(size):
            here[i] = state[i] + 0.5 * step * k2[i]
        slopes_of(t + 0.5 * step, here, inertias, ground, load, rows, numbers, prescribed, k3)
        for i in range(size):
            here[i] = state[i] + step * k3[i]
        slopes_of(t + step, here, inertias, ground, load, rows, numbers, prescribed, k4)
        for i in range(size):
            state[i] += step * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0
        if (n + 1) % every == 0:
            # what is prescribed is exact
            slopes_of(t + step, state, inertias, ground, load, rows, numbers, prescribed, k1)
            out[(n + 1) // every] = state
