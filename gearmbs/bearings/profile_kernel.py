"""Periodic profiles by cubic B-splines: value, slope and curvature."""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit

MARGIN = 3
"""Coefficients beyond the nodes of a turn, so that no index wraps."""


@njit(cache=True, error_model="numpy")
def place_of(nodes, angle):
    """Return the interval of a profile with so many nodes in which an angle lies, and where in it, 0 to 1."""
    x = angle * (nodes / (2.0 * np.pi))
    x -= nodes * np.floor(x / nodes)
    k = int(x)
    if k >= nodes:
        k = nodes - 1
    return k, x - k


@njit(cache=True, error_model="numpy")
def profile_value(reals, at, k, f):
    """Return the profile whose coefficients begin at ``at``, in interval k at f."""
    g = 1.0 - f
    a, b, c, d = reals[at + k], reals[at + k + 1], reals[at + k + 2], reals[at + k + 3]
    b_weight = (3.0 * f - 6.0) * f * f + 4.0
    c_weight = ((3.0 - 3.0 * f) * f + 3.0) * f + 1.0
    return (g * g * g * a + b_weight * b + c_weight * c + f * f * f * d) / 6.0


@njit(cache=True, error_model="numpy")
def profile_slope(reals, at, nodes, k, f):
    """Return its slope by the angle."""
    g = 1.0 - f
    a, b, c, d = reals[at + k], reals[at + k + 1], reals[at + k + 2], reals[at + k + 3]
    total = -g * g * a + (3.0 * f - 4.0) * f * b + ((2.0 - 3.0 * f) * f + 1.0) * c + f * f * d
    return total * (nodes / (4.0 * np.pi))


@njit(cache=True, error_model="numpy")
def profile_curvature(reals, at, nodes, k, f):
    """Return its second derivative by the angle."""
    a, b, c, d = reals[at + k], reals[at + k + 1], reals[at + k + 2], reals[at + k + 3]
    total = (1.0 - f) * a + (3.0 * f - 2.0) * b + (1.0 - 3.0 * f) * c + f * d
    return total * (nodes / (2.0 * np.pi)) ** 2
