"""A baseline on features, with the split that leaks and the one that does not side by side, and a test on real
recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.datasets.splits import random_split, split_by_group
from gearmbs.campaigns.settings import CampaignError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from sklearn.ensemble import RandomForestClassifier

# Features of vibration windows that any record offers: classical indicators, and the spectrum about the mesh
# harmonics.


HARMONICS = 4
SIDEBANDS = 3
NAMES = (
    "kurtosis",
    "crest",
    "skewness",
    *(f"mesh_{k}" for k in range(1, HARMONICS + 1)),
    *(f"sidebands_{k}" for k in range(1, HARMONICS + 1)),
    "residual_kurtosis",
    "residual_share",
    "envelope_shaft",
    "envelope_shaft_2",
    "tilt",
)
"""Names of the features, none of which changes with the gain of the sensor."""
ORDERS = tuple(k for k, name in enumerate(NAMES) if name.startswith(("mesh", "sidebands")))
"""Places of the features by mesh order, which know the shaft's angle and little of the structure."""


def features(x: np.ndarray, rate: float, shaft: float, teeth: int) -> np.ndarray:
    """Return the features of a window, shape (len(NAMES),); none depends on the sensor's gain.

    Parameters
    ----------
    x : ndarray, shape (n,)
    rate : float
        Hz.
    shaft : float
        Frequency of the shaft that carries the wheel, Hz; of either sign.
    teeth : int

    Raises
    ------
    CampaignError
        If the shaft stands still.
    """
    shaft = abs(shaft)
    if not 0.0 < shaft < np.inf:
        raise CampaignError(f"features: shaft = {shaft!r} Hz; give the frequency of a shaft that turns")
    x = np.asarray(x, dtype=float) - np.mean(x)
    rms = float(np.sqrt(np.mean(x**2))) or 1.0
    x = x / rms
    window = np.hanning(x.size)
    power = np.abs(np.fft.rfft(x * window)) ** 2
    frequency = np.fft.rfftfreq(x.size, 1.0 / rate)
    whole = float(power.sum())
    width = 2.5 * rate / x.size

    def band(f: float) -> float:
        return float(power[np.abs(frequency - f) <= width].sum()) / whole

    mesh = [band(k * teeth * shaft) for k in range(1, HARMONICS + 1)]
    sides = [
        sum(band((k * teeth + s * m) * shaft) for m in range(1, SIDEBANDS + 1) for s in (-1, 1))
        for k in range(1, HARMONICS + 1)
    ]
    spectrum = np.fft.rfft(x)
    for k in range(1, int(0.5 * rate / (teeth * shaft)) + 1):
        spectrum[np.abs(frequency - k * teeth * shaft) <= width] = 0.0
    rest = np.fft.irfft(spectrum, x.size)
    share = float(np.mean(rest**2))
    envelope = np.abs(_analytic(rest))
    lines = np.abs(np.fft.rfft((envelope - envelope.mean()) * window))
    total = float(np.sum(lines[frequency < 20.0 * shaft])) or 1.0

    def line(f: float) -> float:
        return float(lines[np.abs(frequency - f) <= width].sum()) / total

    tiny = 1e-12
    return np.array(
        [
            np.log(np.mean(x**4)),
            np.log(np.abs(x).max()),
            float(np.mean(x**3)),
            *np.log(np.array(mesh) + tiny),
            *np.log(np.array(sides) + tiny),
            np.log(float(np.mean(rest**4)) / max(share, tiny) ** 2),
            np.log(share + tiny),
            line(shaft),
            line(2.0 * shaft),
            float(np.sum(frequency * power) / whole / (0.5 * rate)),
        ]
    )


def _analytic(x: np.ndarray) -> np.ndarray:
    spectrum = np.fft.fft(x)
    spectrum[1 : (x.size + 1) // 2] *= 2.0
    spectrum[x.size // 2 + 1 :] = 0.0
    return np.fft.ifft(spectrum)


def windows(x: np.ndarray, size: int) -> np.ndarray:
    """Return the whole windows of signals along the last axis side by side, shape (..., k, size)."""
    count = x.shape[-1] // size
    return x[..., : count * size].reshape(*x.shape[:-1], count, size)


def recording_features(signal: xr.DataArray, *, shaft: float, teeth: int, window: float = 0.25) -> np.ndarray:
    """Return the features of all windows of all channels of a recording, shape (windows, len(NAMES)).

    Parameters
    ----------
    signal : DataArray
        Dimensions (time, channel), with its sampling rate; see `gearmbs.signals.read_signal`.
    shaft : float
        Frequency of the shaft that carries the wheel, Hz.
    teeth : int
    window : float
        s.
    """
    from gearmbs.signals import rate_of

    rate = rate_of(signal)
    size = round(window * rate)
    if not 0 < size <= signal.sizes["time"]:
        raise CampaignError(
            f"features: window = {window:g} s is none of a recording of {signal.sizes['time'] / rate:g} s; give a "
            "shorter one"
        )
    parts = windows(signal.transpose("channel", "time").values, size).reshape(-1, size)
    return np.array([features(part, rate, shaft, teeth) for part in parts])


def feature_table(rows: pd.DataFrame, *, window: float = 0.25) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return features of the windows of a data set's signals, their states, specimens and severities.

    Parameters
    ----------
    rows : DataFrame
        Of `read_data_set`.
    window : float
        s.
    """
    # a part of the rows, or rows in another order, keep their former numbers
    rows = rows.reset_index(drop=True)
    found, owner = [], []
    for name in (name for name in rows.columns if name.startswith("signal.")):
        for k, x in enumerate(rows[name]):
            if x is None:
                continue
            rate, shaft = rows["sampling_rate"][k], float(np.mean(np.abs(rows["speed"][k]))) / (2.0 * np.pi)
            for part in windows(np.asarray(x, dtype=float), round(window * rate)):
                found.append(features(part, rate, shaft, rows["teeth"][k][0]))
                owner.append(k)
    if not found:
        raise CampaignError(f"features: no signal is as long as the window of {window:g} s; give a shorter one")
    labels = rows.iloc[owner]
    return np.array(found), *(labels[name].to_numpy() for name in ("state", "specimen", "severity"))


def against_reference(x: np.ndarray, owners: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return features less the mean of those of a reference, each sensor's and operating point's own.

    What a structure and its sensors make of every state is so taken out. Rows of the reference are at zero on average
    and must not be trained or tested on; leave them out.

    Parameters
    ----------
    x : ndarray, shape (n, k)
    owners : ndarray, shape (n,)
        Of which sensor at which operating point each row is.
    reference : ndarray of bool, shape (n,)
        Rows that are known to be healthy.

    Raises
    ------
    CampaignError
        If an owner has no row of reference, or rows are given by anything but a truth value each.
    """
    found = np.asarray(x, dtype=float).copy()
    truths = np.asarray(reference)
    if truths.shape != (len(found),) or not np.isin(truths, (0, 1)).all():
        raise CampaignError(f"reference: give true or false for each of the {len(found)} rows")
    reference = truths.astype(bool)
    for name in np.unique(owners):
        mine = np.asarray(owners) == name
        if not np.any(mine & reference):
            raise CampaignError(f"reference: {name} has no row that is known to be healthy; give one, or leave it out")
        found[mine] -= found[mine & reference].mean(axis=0)
    return found


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
    chance_low, chance_high : float
        Least and largest area with labels dealt out by chance, where that was tried, else NaN.
    """

    auroc: float
    low: float
    high: float
    accuracy: float
    chance: float
    count: int
    groups: int
    chance_low: float = float("nan")
    chance_high: float = float("nan")

    def __str__(self) -> str:
        by_chance = f", {self.chance_low:.3f} to {self.chance_high:.3f} by chance" if self.chance_low > 0.0 else ""
        return (
            f"macro AUROC {self.auroc:.3f} ({self.low:.3f} to {self.high:.3f}){by_chance}, accuracy "
            f"{self.accuracy:.3f} (chance {self.chance:.3f}), {self.count} windows of {self.groups} groups"
        )


def classifier(seed: int = 0, trees: int = TREES) -> RandomForestClassifier:
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
    return RandomForestClassifier(trees, min_samples_leaf=2, class_weight="balanced", random_state=seed)


def score(model: Any, x: np.ndarray, labels: np.ndarray, groups: np.ndarray, seed: int = 0) -> Score:
    """Return how well a fitted classifier does on rows, with an interval by resampling groups."""
    return scored(model.predict_proba(x), model.classes_, labels, groups, seed)


def scored(
    p: np.ndarray,
    classes: np.ndarray,
    labels: np.ndarray,
    groups: np.ndarray,
    seed: int = 0,
    fold: np.ndarray | None = None,
) -> Score:
    """Return how good probabilities of classes are, shape (n, classes), with an interval by resampling groups.

    With the number of the fold of each row rows are ranked within their fold, and the mean over the folds is taken.
    """
    parts = np.zeros(len(labels), dtype=int) if fold is None else np.asarray(fold)
    guess = np.asarray(classes)[p.argmax(axis=1)]
    names = np.unique(groups)
    generator = np.random.default_rng(seed)
    drawn = []
    for _ in range(RESAMPLES):
        rows = np.concatenate([np.flatnonzero(groups == g) for g in generator.choice(names, names.size)])
        drawn.append(_mean_auroc(labels[rows], p[rows], classes, parts[rows]))
    drawn = [value for value in drawn if np.isfinite(value)]
    low, high = np.quantile(drawn, [0.025, 0.975]) if names.size > 1 and drawn else (np.nan, np.nan)
    counts = np.unique(labels, return_counts=True)[1]
    return Score(
        _mean_auroc(labels, p, classes, parts),
        float(low),
        float(high),
        float(np.mean(guess == labels)),
        float(counts.max() / counts.sum()),
        len(labels),
        names.size,
    )


def _mean_auroc(labels: np.ndarray, p: np.ndarray, classes: np.ndarray, parts: np.ndarray) -> float:
    """Return the macro AUROC of each part of the rows, in the mean by their numbers of rows."""
    found = [(np.sum(parts == k), macro_auroc(labels[parts == k], p[parts == k], classes)) for k in np.unique(parts)]
    known = [(count, value) for count, value in found if np.isfinite(value)]
    return float(sum(n * v for n, v in known) / sum(n for n, _ in known)) if known else float("nan")


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


def from_recordings_to_recordings(real: np.ndarray, labels: np.ndarray, groups: np.ndarray, *, seed: int = 0) -> Score:
    """Train the baseline on recordings and score it on others: the first of each state is held out, then the second.

    Parameters
    ----------
    real, labels, groups : ndarray
        Features of windows of recordings, their states, and the number of the recording each is of. Where the
        recordings of each state are in the same order of operating points, an operating point is held out at a time.

    Raises
    ------
    CampaignError
        If a state has one recording only, so that nothing is left to train on.
    """
    fold = np.zeros(len(labels), dtype=int)
    for state in np.unique(labels):
        numbers = np.unique(groups[labels == state])
        if numbers.size < 2:
            raise CampaignError(
                f"recordings: {state} has one only; give two or more to train on some and test on others"
            )
        fold[labels == state] = np.searchsorted(numbers, groups[labels == state])
    return held_out(real, labels, fold, groups, seed)


def held_out(
    x: np.ndarray,
    labels: np.ndarray,
    fold: np.ndarray,
    groups: np.ndarray,
    seed: int = 0,
    *,
    pooled: bool = True,
    trees: int = TREES,
) -> Score:
    """Return how well the baseline does on the rows of each fold, trained on those of all others.

    Rows of all folds are ranked together, or, not pooled, those of each by themselves.
    """
    classes = np.unique(labels)
    p = np.zeros((len(labels), classes.size))
    for k in np.unique(fold):
        model = classifier(seed, trees).fit(x[fold != k], labels[fold != k])
        p[np.ix_(fold == k, np.searchsorted(classes, model.classes_))] = model.predict_proba(x[fold == k])
    return scored(p, classes, labels, groups, seed, None if pooled else fold)


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
