"""Modal damping: one number, a number for each mode, bands of frequency."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.flexible.errors import FlexibleError

Damping = float | str | Sequence[float] | Sequence[tuple[float, float]]
"""What `damping_ratios` takes."""

ADAMS = ((100.0, 0.01), (1000.0, 0.1), (np.inf, 1.0))
"""Bands that ADAMS assumes where nothing is given: 1 % below 100 Hz, 10 % below 1000 Hz, critical above."""


def damping_ratios(frequencies: np.ndarray, damping: Damping) -> np.ndarray:
    """Return the damping ratio of each mode.

    Parameters
    ----------
    frequencies : ndarray, shape (n,)
        Hz.
    damping : float, sequence of float, sequence of (float, float), or "adams"
        One ratio for all modes; one for each; pairs of a frequency (Hz) and the ratio of the modes below it, in rising
        order, the last also for those above; or the bands that ADAMS assumes (`ADAMS`). Interface shapes at many kHz
        hold the step of an integrator down unless they are damped: bands are made for that.

    Raises
    ------
    FlexibleError
        For negative ratios, bands that do not rise, and a wrong number of values.
    """
    frequencies = np.asarray(frequencies, dtype=float)
    if isinstance(damping, str):
        if damping != "adams":
            raise FlexibleError(f"damping = {damping!r}; give a ratio, one for each mode, bands or 'adams'")
        damping = ADAMS
    given = np.asarray(damping, dtype=float)
    if given.ndim == 2 and given.shape[1] == 2:
        limits, values = given.T
        if np.any(np.diff(limits) <= 0.0):
            raise FlexibleError(f"damping: the limits {limits.tolist()} Hz must rise")
        out = values[np.minimum(np.searchsorted(limits, frequencies, side="right"), limits.size - 1)]
    elif given.ndim == 0:
        out = np.full(frequencies.shape, float(given))
    elif given.shape == frequencies.shape:
        out = given.copy()
    else:
        raise FlexibleError(f"damping: {given.size} values for {frequencies.size} modes; give one, one each, or pairs")
    if not np.all(np.isfinite(out) & (out >= 0.0)):
        raise FlexibleError(f"damping: ratios {out[~(out >= 0.0)].tolist()} must not be negative")
    return out
