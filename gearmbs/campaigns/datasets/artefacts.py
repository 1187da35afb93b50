"""Whether a data set's making tells the states: classifiers that see nothing but artefacts have to be at chance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.datasets.baseline import Score, held_out
from gearmbs.campaigns.datasets.layers import STOP

if TYPE_CHECKING:
    import pandas as pd

EDGE = 24
"""Samples at either end that are looked at: filters that begin at a record's edge show in fewer."""

PERMUTATIONS, FEWER = 20, 50
"""Permutations of the labels, and trees of their classifiers; the range of twenty is one of 90 %."""

CANDIDATES = 8
"""Shifts by whole mesh periods that are nearest to whole samples, of which one is taken by chance."""

BLUR = 0.01
"""Noise on both, as a part of the record's RMS, that hides what fractions of a sample make of a waveform."""

BANDS = 4
"""Bands above the pass band of the anti-alias filter."""

BLACKMAN_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)
"""Window with side lobes 92 dB down [1]_: what is below the band must not leak above it.

.. [1] F. J. Harris, On the use of windows for harmonic analysis with the discrete Fourier transform,
   Proc. IEEE 66, 1978.
"""

METADATA = (
    "row", "point", "specimen", "operation.speed", "operation.torque", "sampling_rate", "teeth", "pulses", "length",
)  # fmt: skip
"""Columns that are neither signal nor label, and the row's number, its numbers of pulses and of samples."""


def artefact_leaks(
    rows: pd.DataFrame, *, folds: int = 5, seed: int = 0, permutations: int = PERMUTATIONS
) -> dict[str, Score]:
    """Return how well classifiers do that see artefacts alone, split by specimen, and what chance makes of them.

    Of few specimens, whose records are alike, chance alone takes scores far from 0.5: the same is done again with the
    labels of each operating point permuted, and `Score.chance_low` and `Score.chance_high` are the least and the
    largest of these. A score above them tells that something leaks.

    ``clipping``, ``above the band`` and ``metadata`` try to tell the states, by numbers of clipped samples, by the
    levels above the pass band, and by the columns that are neither signal nor label, with the row's number. ``edges``
    tries to tell a record's end joined with its beginning from stretches within it at the same phase of the mesh:
    waveforms there depend on the states, edges must not. Scores are means over the folds: of classifiers trained on
    different rows the probabilities of all folds together rank below chance where there is nothing to learn.

    Parameters
    ----------
    rows : DataFrame
        Of `read_data_set`.
    folds : int
        Parts of the specimens, each of which is tested by classifiers trained on the others.
    permutations : int
        How often labels are permuted.

    Returns
    -------
    dict of Score
    """
    # a part of the rows, or rows in another order, keep their former numbers
    rows = rows.reset_index(drop=True)
    names = [name for name in rows.columns if name.startswith("signal.")]
    signals = [(k, name) for name in names for k in range(len(rows)) if rows[name][k] is not None]
    owner = np.array([k for k, _ in signals])
    x = [np.asarray(rows[name][k], dtype=float) for k, name in signals]
    clipped = np.array([rows[name.replace("signal.", "clipped.")][k] for k, name in signals], dtype=float)
    states, groups = rows["state"].to_numpy(), rows["specimen"].to_numpy()
    generator = np.random.default_rng(seed)
    joined = np.array([piece for values, k in zip(x, owner) for piece in _joined(values, _period(rows, k), generator)])
    edge = np.tile(["edge", "inside"], len(x))
    box = rows["gearbox"].to_numpy() if "gearbox" in rows else np.zeros(len(rows), dtype=int)
    # records of one operating point have one phase, whatever their states and sensors
    point = np.unique(list(zip(box.astype(str), rows["point"].astype(str))), axis=0, return_inverse=True)[1].ravel()
    levels = np.array([above_the_band(values) for values in x])
    tests = {
        "clipping": (clipped[:, None], states[owner], owner, False),
        "above the band": (levels, states[owner], owner, False),
        "metadata": (_metadata(rows), states, np.arange(len(rows)), False),
        "edges": (joined, edge, np.repeat(owner, 2), True),
    }
    # where a point has one state only, states are dealt out among all points of its specimen
    crossed = rows.groupby(point)["state"].nunique().min() > 1
    blocks = point if crossed else np.unique(groups, return_inverse=True)[1]
    individuals = np.unique(groups)
    fold = np.random.default_rng(seed).permutation(individuals.size) % folds
    found = {}
    for name, (features, labels, row, swapped) in tests.items():
        owners = groups[row]
        parts = fold[np.searchsorted(individuals, owners)]
        own = held_out(features, labels, parts, owners, seed, pooled=False)
        chance = [
            held_out(features, other, parts, owners, seed, pooled=False, trees=FEWER).auroc
            for other in _permuted(labels, (point if swapped else blocks)[row], row, swapped, generator, permutations)
        ]
        found[name] = replace(own, chance_low=min(chance), chance_high=max(chance))
    return found


def _permuted(
    labels: np.ndarray, block: np.ndarray, row: np.ndarray, swapped: bool, generator: np.random.Generator, count: int
) -> Iterator[np.ndarray]:
    """Yield labels as chance might have dealt them: the states of each block among its rows, or all pairs swapped."""
    for _ in range(count):
        other = labels.copy()
        for k in np.unique(block):
            here = np.flatnonzero(block == k)
            if swapped:
                # an edge and what is inside take turns, in all records of a point alike
                if generator.random() < 0.5:
                    other[here] = labels[here].reshape(-1, 2)[:, ::-1].ravel()
                continue
            numbers = np.unique(row[here])
            given = dict(zip(row[here].tolist(), labels[here].tolist()))
            dealt = dict(zip(numbers.tolist(), (given[n] for n in generator.permutation(numbers).tolist())))
            other[here] = [dealt[n] for n in row[here].tolist()]
        yield other


def above_the_band(x: np.ndarray) -> np.ndarray:
    """Return the levels of a signal in bands above the pass band, shape (BANDS + 1,): logarithms, and the kurtosis."""
    phase = 2.0 * np.pi * (np.arange(x.size) + 0.5) / x.size
    window = sum(a * np.cos(k * phase) for k, a in enumerate(BLACKMAN_HARRIS))
    spectrum = np.fft.rfft((x - x.mean()) * window)
    frequency = np.fft.rfftfreq(x.size)
    edges = np.linspace(STOP, 0.5, BANDS + 1)
    power = [np.mean(np.abs(spectrum[(frequency > a) & (frequency <= b)]) ** 2) for a, b in pairwise(edges)]
    high = np.fft.irfft(np.where(frequency > STOP, spectrum, 0.0), x.size)
    tiny = np.finfo(float).tiny
    return np.log(np.array([*power, np.mean(high**4) / max(np.mean(high**2) ** 2, tiny)]) + tiny)


def _period(rows: pd.DataFrame, k: int) -> float:
    """Return the samples of a mesh period of a row, at its mean speed."""
    turns = float(np.mean(np.abs(rows["speed"][k]))) / (2.0 * np.pi)
    return float(rows["sampling_rate"][k]) / (turns * rows["teeth"][k][0])


def _joined(x: np.ndarray, period: float, generator: np.random.Generator) -> list[np.ndarray]:
    """Return a record's end with its beginning, and two stretches from within it, both to the same scale.

    Those are whole mesh periods off, as nearly as samples allow: records of one speed all begin at one phase.
    """
    n = x.size
    shifts = np.arange(1, n) * period
    shifts = shifts[(shifts >= EDGE) & (shifts <= n - 3 * EDGE)]
    off = np.abs(shifts - np.rint(shifts))
    near = np.rint(shifts[np.argsort(off, kind="stable")[: max(2, min(CANDIDATES, shifts.size // 4))]]).astype(int)
    if not near.size:
        # a record shorter than a mesh period
        near = generator.integers(EDGE, n - 2 * EDGE, 2)
    a, b = n - EDGE - generator.choice(near), generator.choice(near)
    pairs = (x[-EDGE:], x[:EDGE]), (x[a : a + EDGE], x[b : b + EDGE])
    scale = x.std() or 1.0
    found = []
    for end, beginning in pairs:
        both = np.r_[end, beginning] / scale
        both += BLUR * generator.standard_normal(both.size)
        # the step where they meet, against the steps about it
        curvature = np.abs(np.diff(both, 2)).reshape(-1, 2).mean(axis=1)
        found.append(np.r_[both, abs(both[EDGE] - both[EDGE - 1]), curvature])
    return found


def _metadata(rows: pd.DataFrame) -> np.ndarray:
    """Return the columns that a careless reader might feed to a classifier, as numbers."""
    first = next(name for name in rows.columns if name.startswith("signal."))
    columns = {
        "row": np.arange(len(rows)),
        "length": rows[first].map(len),
        "pulses": rows["tacho"].map(len),
        "teeth": rows["teeth"].map(lambda teeth: teeth[0]),
    }
    given = [columns.get(name, rows.get(name)) for name in METADATA]
    return np.array([np.asarray(column, dtype=float) for column in given if column is not None]).T
