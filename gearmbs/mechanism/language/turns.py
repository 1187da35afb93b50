"""Full turns between outputs: whether they can be counted."""

from __future__ import annotations

import warnings

import numpy as np

SPLINE_POINTS = 4
"""Outputs from which a cubic spline says more about a speed than its mean between two of them."""


def warn_of_doubtful_turns(t: np.ndarray, angle: np.ndarray, speed: np.ndarray, label: str) -> None:
    """Warn where a spline through the speeds makes another number of turns between two outputs than was counted."""
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(t)
    doubtful = np.flatnonzero(np.round((np.diff(angle) - _finer_steps(t, speed, steps)) / (2 * np.pi)))
    if doubtful.size:
        k = int(doubtful[0])
        warnings.warn(
            f"{label}: its full turns cannot be counted surely from t = {t[k]:.6g} to {t[k + 1]:.6g} s, where it turns "
            f"{abs(steps[k]) / (2 * np.pi):.3g} times between two outputs and its speed changes; simulate with a "
            "higher rate",
            stacklevel=4,
        )


def _finer_steps(t: np.ndarray, speed: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the angles (rad) from output to output by a spline through the speeds, where turns could be miscounted."""
    if t.size < SPLINE_POINTS or abs(steps).max() < np.pi or np.diff(t).min() <= 0.0:
        return steps
    from scipy.interpolate import CubicSpline

    return np.diff(CubicSpline(t, speed).antiderivative()(t))
