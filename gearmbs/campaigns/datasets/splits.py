"""Splits that do not leak: by physical individual, with severities withheld, and the leaking one for comparison."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real

import numpy as np

from gearmbs.campaigns.settings import CampaignError


def split_by_group(
    groups: Sequence[int] | np.ndarray, *, test: float = 0.2, validation: float = 0.1, seed: int = 0
) -> np.ndarray:
    """Return "train", "validation" or "test" for each row; all rows of a group are in the same split.

    Parameters
    ----------
    groups : array_like of int, shape (n,)
        Number of the specimen of each row.
    test, validation : float
        Parts of the groups, at least one each unless zero.

    Raises
    ------
    CampaignError
        If there are too few groups, or no such parts.
    """
    try:
        groups = np.asarray(groups)
        names = np.unique(groups)
    except (TypeError, ValueError):
        names = np.empty(0)
    if not names.size or np.ndim(groups) != 1:
        raise CampaignError(
            "split: groups are none; give the number or name of the specimen of each row, all of a kind"
        )
    parts = (test, validation)
    if not all(isinstance(part, Real) and 0.0 <= float(part) < 1.0 for part in parts):
        raise CampaignError(f"split: test = {test!r}, validation = {validation!r}; give parts from 0 to below 1")
    counts = [max(1, round(part * names.size)) if part > 0.0 else 0 for part in parts]
    if sum(counts) >= names.size:
        raise CampaignError(
            f"split: {names.size} groups are too few for test = {test:g} and validation = {validation:g}"
        )
    order = np.random.default_rng(seed).permutation(names)
    kind = dict.fromkeys(order[: counts[0]], "test") | dict.fromkeys(order[counts[0] : sum(counts)], "validation")
    return np.array([kind.get(g, "train") for g in groups])


def withhold(
    split: np.ndarray,
    severity: np.ndarray,
    low: float,
    high: float,
    points: Sequence[int] | np.ndarray | None = None,
) -> np.ndarray:
    """Return a split in which training rows of a range of severities are "withheld": can a model interpolate?

    Rows without a severity, NaN, are in no range.

    Parameters
    ----------
    split : ndarray of str, shape (n,)
    severity : ndarray, shape (n,)
    low, high : float
        Range, its ends included.
    points : array_like of int, shape (n,), optional
        Operating point of each row: all rows of a point go with those of it that are in the range, so that what is
        left has the same mixture of states. Default: rows go one by one.

    Raises
    ------
    CampaignError
        If the range has no ends in this order.
    """
    if not (isinstance(low, Real) and isinstance(high, Real) and low <= high):
        raise CampaignError(f"withhold: from {low!r} to {high!r}; give the lower end first")
    split = np.asarray(split)
    inside = (np.asarray(severity) >= low) & (np.asarray(severity) <= high)
    if points is not None:
        inside = np.isin(points, np.asarray(points)[inside])
    return np.where((split == "train") & inside, "withheld", split)


def random_split(count: int, *, test: float = 0.2, seed: int = 0) -> np.ndarray:
    """Return a split row by row, whatever they come from: it leaks if rows are windows of the same record or
    specimen."""
    return np.where(np.random.default_rng(seed).random(count) < test, "test", "train")


def one_state_a_group(labels: np.ndarray, groups: np.ndarray, seed: int = 0) -> np.ndarray:
    """Return which rows are left if every group shows one state only, as where each fault is a part of its own.

    States are dealt out evenly. In such data an individual is known by its state, and a split row by row leaks it;
    where every individual is in all states, its other rows have other labels, and such a split misleads instead.
    """
    names, states = np.unique(groups), np.unique(labels)
    dealt = states[np.random.default_rng(seed).permutation(np.arange(names.size) % states.size)]
    return np.asarray(labels) == dealt[np.searchsorted(names, groups)]


def shared_groups(split: np.ndarray, groups: np.ndarray) -> dict[tuple[str, str], int]:
    """Return how many groups each pair of splits shares: zero everywhere if nothing leaks ("withheld" belongs to
    training)."""
    split = np.where(np.asarray(split) == "withheld", "train", split)
    inside = {name: set(np.asarray(groups)[split == name]) for name in np.unique(split)}
    names = sorted(inside)
    return {(a, b): len(inside[a] & inside[b]) for i, a in enumerate(names) for b in names[i + 1 :]}
