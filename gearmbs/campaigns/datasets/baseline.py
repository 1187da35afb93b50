"""A baseline on features, with the split that leaks and the one that does not side by side, and a test on real
recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.campaigns.datasets.features import NAMES
from gearmbs.campaigns.datasets.splits import random_split, split_by_group
from gearmbs.campaigns.errors import CampaignError

TREES = 200
RESAMPLES = 200


@dataclass(frozen=True)
class Score:
    """Area under the receiver operating characteristic, averaged over the classes (one against the rest).

    Attributes
    ----------
    auroc, low, high : float
        Value and 95 % interval, from resampling groups of the test rows; no interval, NaN, from a single group.
    accuracy : float
    chance : float
        Accuracy of always naming the commonest class.
    count, groups : int
        Test rows and the groups they come from.
    """

    auroc: float
    low: float
    high: float
    accuracy: float
    chance: float
    count: int
    groups: int

    def __str__(self) -> str:
        return (
            f"macro AUROC {self.auroc:.3f} ({self.low:.3f} to {self.high:.3f}), accuracy {self.accuracy:.3f} (chance "
            f"{self.chance:.3f}), {self.count} windows of {self.groups} groups"
        )


def classifier(seed: int = 0) -> Any:
    """Return the baseline's classifier: a random forest, the same for the same seed.

    Raises
    ------
    CampaignError
        Without scikit-learn.
    """
    try:
        from sklearn.ensemble import RandomForestClassifier
    except ImportError:
        raise CampaignError("the baseline needs scikit-learn: pip install 'gearmbs[datasets]'") from None
    return RandomForestClassifier(TREES, min_samples_leaf=2, class_weight="balanced", random_state=seed)


def score(model: Any, x: np.ndarray, labels: np.ndarray, groups: np.ndarray, seed: int = 0) -> Score:
    """Return how well a fitted classifier does on rows, with an interval by resampling groups."""
    p = model.predict_proba(x)
    guess = np.asarray(model.classes_)[p.argmax(axis=1)]
    names = np.unique(groups)
    generator = np.random.default_rng(seed)
    drawn = []
    for _ in range(RESAMPLES):
        rows = np.concatenate([np.flatnonzero(groups == g) for g in generator.choice(names, names.size)])
        drawn.append(macro_auroc(labels[rows], p[rows], model.classes_))
    drawn = [value for value in drawn if np.isfinite(value)]
    low, high = np.quantile(drawn, [0.025, 0.975]) if names.size > 1 and drawn else (np.nan, np.nan)
    counts = np.unique(labels, return_counts=True)[1]
    return Score(
        macro_auroc(labels, p, model.classes_),
        float(low),
        float(high),
        float(np.mean(guess == labels)),
        float(counts.max() / counts.sum()),
        len(labels),
        names.size,
    )


def macro_auroc(labels: np.ndarray, scores: np.ndarray, classes: np.ndarray) -> float:
    """Return the mean over the classes of the probability that a row of the class scores higher than one of the rest.

    Classes that do not occur, or alone, are left out; ties count half.
    """
    from scipy.stats import rankdata

    found = []
    for k, name in enumerate(classes):
        inside = labels == name
        n, m = int(inside.sum()), int((~inside).sum())
        if n and m:
            ranks = rankdata(scores[:, k])
            found.append((ranks[inside].sum() - 0.5 * n * (n + 1)) / (n * m))
    return float(np.mean(found)) if found else float("nan")


def leak_and_no_leak(
    x: np.ndarray, labels: np.ndarray, groups: np.ndarray, *, test: float = 0.3, seed: int = 0
) -> dict[str, Score]:
    """Return the baseline's scores by a random split of windows and by a split of specimens.

    Parameters
    ----------
    x : ndarray, shape (n, k)
        Features of windows.
    labels : ndarray of str, shape (n,)
    groups : ndarray of int, shape (n,)
        Specimen of each window.
    """
    splits = {
        "random windows": random_split(len(labels), test=test, seed=seed),
        "by specimen": split_by_group(groups, test=test, validation=0.0, seed=seed),
    }
    found = {}
    for name, split in splits.items():
        train, held = split == "train", split == "test"
        model = classifier(seed).fit(x[train], labels[train])
        found[name] = score(model, x[held], labels[held], groups[held], seed)
    return found


def from_simulation_to_recordings(
    x: np.ndarray, labels: np.ndarray, real: np.ndarray, real_labels: np.ndarray, real_groups: np.ndarray, seed: int = 0
) -> tuple[Score, dict[str, float]]:
    """Train the baseline on simulated windows alone and score it on windows of recordings.

    Parameters
    ----------
    x, labels : ndarray
        Features of simulated windows and their states; those whose state no recording has are left out.
    real, real_labels, real_groups : ndarray
        The same of recordings, and the number of the recording each window is of.

    Returns
    -------
    Score
        Of the classifier.
    dict of float
        Of two classes the AUROC of every single feature, as a classical indicator would give: above a half if it
        differs between them in the same direction as in the simulation.
    """
    known = np.isin(labels, np.unique(real_labels))
    if np.unique(labels[known]).size < 2:
        raise CampaignError(f"recordings: labels are {sorted(set(real_labels))}; give recordings of two states or more")
    model = classifier(seed).fit(x[known], labels[known])
    classes = np.unique(real_labels)
    alone = {}
    if classes.size == 2:
        one = classes[:1]
        for k, name in enumerate(NAMES):
            simulated = macro_auroc(labels[known], x[known, k : k + 1], one)
            recorded = macro_auroc(real_labels, real[:, k : k + 1], one)
            alone[name] = recorded if simulated >= 0.5 else 1.0 - recorded
    return score(model, real, real_labels, real_groups, seed), alone
