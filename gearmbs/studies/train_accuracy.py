"""Records of drivetrains and planetary sets whose mesh harmonics are as accurate as asked, and tell how accurate.

As of a case (`gearmbs.studies.run.accuracy`) each run has a twin over the same time, whose tolerance is `COARSER` times
as large and which has half as many slices of each face. What the two differ by bounds the error of steps and slices.
Trains have no period that all their parts share: to this comes what the two halves of a record differ by, half of which
their mean, the record, is off by if what makes them differ is chance, and more than which if it dies out.

Each signal, as the force of a mesh, of a bearing or a sensor's, is judged by its own largest line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from gearmbs.studies.run.accuracy import APART, ATTEMPTS, COARSER, FEWEST_SLICES, FLOOR, SHARE, per_cent
from gearmbs.studies.run.periodic import LEAST_LEVEL
from gearmbs.wording import warn

if TYPE_CHECKING:
    import xarray as xr

LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-12, 5e-6
"""Of runs: as of `gearmbs.drivetrain.RunSettings`."""

USUAL = 1e-2
"""Accuracy for which the usual tolerance does: of random trains and sets errors of steps were a fifth of it in the
median there. What is asked below takes a smaller one in proportion."""

Run = TypeVar("Run")


@dataclass(frozen=True)
class Lines:
    """What a run is judged by.

    Attributes
    ----------
    record : Dataset
        With the levels in it.
    levels : ndarray, shape (signals, meshes, harmonics)
        RMS; NaN where a speed is not steady.
    halves : ndarray, shape (2, signals, meshes, harmonics)
        Those of the two halves of the record.
    """

    record: xr.Dataset
    levels: np.ndarray
    halves: np.ndarray


@dataclass(frozen=True)
class Precise:
    """To what a train or a set is run.

    Attributes
    ----------
    tolerance : float
    slices : dict of str to int
        Of the face, by mesh; those with one slice are not in it.
    """

    tolerance: float
    slices: Mapping[str, int]

    def coarser(self) -> Precise:
        """Return that of the twin."""
        halved = {name: max(FEWEST_SLICES - 1, n // 2) for name, n in self.slices.items()}
        return Precise(min(COARSER * self.tolerance, LARGEST_TOLERANCE), halved)

    def finer(self, part: float) -> Precise:
        """Return that of the next run, whose errors have to be a part of these."""
        tolerance = self.tolerance * float(np.clip(part, 1e-3, 1.0 / COARSER))
        return Precise(max(LEAST_TOLERANCE, tolerance), {name: 2 * n - 1 for name, n in self.slices.items()})

    def __str__(self) -> str:
        counts = sorted(set(self.slices.values()))
        sliced = f" and {' and '.join(map(str, counts))} slices of the faces" if counts else ""
        return f"{self.tolerance:.2g}{sliced}"


def accurate_lines(
    run: Callable[[Precise], Lines],
    first: Precise,
    wanted: float,
    groups: np.ndarray,
    level: str,
    name: str,
) -> xr.Dataset:
    """Return a record whose mesh harmonics are as accurate as asked, and what they are known to.

    Parameters
    ----------
    run : callable
        Simulates to a precision.
    first : Precise
        The usual tolerance and slices.
    wanted : float
        Accuracy, as a part of the largest line of each signal.
    groups : ndarray of int, shape (signals,)
        Signals of one unit: one below a hundredth of their largest is judged as if it had that.
    level : str
        Name of the levels in the record.
    name : str
        Of the train, for what is said.

    Returns
    -------
    Dataset
        With ``<level>_error``, and attributes ``accuracy_asked``, ``accuracy_found`` and ``accuracy_by``.
    """
    fine = Precise(max(LEAST_TOLERANCE, first.tolerance * min(1.0, wanted / USUAL)), first.slices)
    found, coarse = run(fine), fine.coarser()
    twin = run(coarse)
    for attempt in range(ATTEMPTS):
        error, largest, drift = errors_of(found, twin, groups, _share(fine, coarse))
        worst = _part(error, largest)
        by_steps = _part(np.sqrt(np.maximum(error**2 - drift**2, 0.0)), largest)
        # a finer run does not mend what hangs on the length of the record
        if worst <= wanted or by_steps <= 0.5 * wanted or attempt == ATTEMPTS - 1 or fine.tolerance <= LEAST_TOLERANCE:
            break
        coarse, twin = fine, found
        fine = fine.finer(0.5 * wanted / by_steps)
        found = run(fine)
    record, values = found.record, found.record[level]
    record[f"{level}_error"] = values.copy(data=error.reshape(values.shape))
    record[f"{level}_error"].attrs = {"long_name": f"numerical error of the {values.attrs.get('long_name', level)}"}
    said = (
        f"mesh harmonics are known to {per_cent(worst)} of the largest of their signal, by runs at tolerances of "
        f"{fine}, and of {coarse}"
    )
    if worst > wanted:
        said += f"; {per_cent(wanted)} was asked for"
        if (of_length := _part(drift, largest)) > 0.5 * worst:
            said += (
                f", but the two halves of the record differ by {per_cent(2.0 * of_length)}: a longer settling or "
                "duration lets more die out, or averages more of it"
            )
        warn(f"{name}: {said}")
    record.attrs |= {"accuracy_asked": wanted, "accuracy_found": worst, "accuracy_by": said}
    return record


def errors_of(found: Lines, twin: Lines, groups: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the numerical errors of levels, what they are judged by, and the part that the record's length has.

    All of shape (signals, meshes, harmonics), but the second, which is (signals, 1, 1).
    """
    levels = found.levels
    largest = np.nanmax(np.where(np.isfinite(levels), levels, 0.0), axis=(1, 2), keepdims=True)
    for group in np.unique(groups):
        of = groups == group
        largest[of] = np.maximum(largest[of], LEAST_LEVEL * largest[of].max())
    # single harmonics of the two may agree by chance: the largest difference among those of a mesh counts
    apart = np.abs(levels - twin.levels)
    apart = np.max(np.where(np.isfinite(apart), apart, 0.0), axis=2, keepdims=True)
    error = np.where(apart > APART * largest, 1.0, share) * apart
    error = np.maximum(error, FLOOR * largest)
    halves = np.abs(found.halves[1] - found.halves[0])
    drift = 0.5 * np.max(np.where(np.isfinite(halves), halves, 0.0), axis=2, keepdims=True)
    whole = np.where(np.isfinite(levels), np.hypot(error, drift), np.nan)
    return whole, largest, np.broadcast_to(drift, levels.shape)


def _share(fine: Precise, coarse: Precise) -> float:
    """Return the part of the difference of two runs that the error of the finer one is at most."""
    ratios = [coarse.slices[name] / n for name, n in fine.slices.items()]
    return max([SHARE, *(r**2 / (1.0 - r**2) for r in ratios if r < 1.0)])


def _part(error: np.ndarray, largest: np.ndarray) -> float:
    """Return the largest error as a part of what it is judged by; signals that are zero have none."""
    with np.errstate(all="ignore"):
        parts = np.where(largest > 0.0, error / largest, 0.0)
    return float(np.nanmax(parts, initial=0.0))


def settled_halves(evaluate: Callable[[float, float], Any], settling: float, duration: float) -> tuple[Any, Any]:
    """Return what is evaluated of the two halves of a record, from its settling and duration, s."""
    half = 0.5 * duration
    return evaluate(settling, half), evaluate(settling + half, half)
