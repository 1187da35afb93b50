"""How well two tables of levels agree: in order, and in dB."""

from __future__ import annotations

import math

import numpy as np

TIE = 0.01


def ordinal_agreement(experiment: np.ndarray, model: np.ndarray, tie: float = TIE) -> float:
    """Fraction of the pairs of states that two lists of values put in the same order.

    Values within the fraction `tie` of each other count as equal; equal in one list and not in the other is a
    disagreement of one half. 1 means the same order throughout, 0 the reverse.

    Parameters
    ----------
    experiment, model : ndarray of shape (states,)
    """
    score, pairs = 0.0, 0
    for i in range(len(experiment)):
        for j in range(i + 1, len(experiment)):
            a, b = _order(experiment[i], experiment[j], tie), _order(model[i], model[j], tie)
            score += 1.0 - 0.5 * abs(a - b)
            pairs += 1
    return score / pairs if pairs else math.nan


def level_distance(experiment: np.ndarray, model: np.ndarray) -> float:
    """Distance in dB: root mean square over all values of 20 log10(model / experiment); zero for equal tables."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = 20.0 * np.log10(np.asarray(model) / np.asarray(experiment))
    return float(np.sqrt(np.mean(ratio**2)))


def _order(a: float, b: float, tie: float) -> int:
    if abs(a - b) <= tie * max(abs(a), abs(b)):
        return 0
    return 1 if a > b else -1
