"""Records of drivetrains and planetary sets whose mesh harmonics are as accurate as asked, and tell how accurate.

As of a case (`gearmbs.studies.run.accuracy`) each run has a twin whose tolerance is a decade larger and which has half
as many slices of each face. It ends in the middle of the record: what the first half of the run and the twin differ by
bounds the error of steps and slices. Trains have no period that all their parts share: to this comes what the two
halves of a record differ by, half of which their mean, the record, is off by if what makes them differ is chance, and
more than which if it dies out.

Flanks that part make a motion hang on where it came from. Two runs are then two samples rather than a good and a less
good one of the same motion, and other motions may exist beside it, of which the record says that it does not know.

Each signal, as the force of a mesh, of a bearing or a sensor's, is judged by its own largest line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.studies.run.accuracy import FEWEST_SLICES, per_cent
from gearmbs.studies.run.periodic import LEAST_LEVEL
from gearmbs.studies.run.refined import COARSER, Made, refined
from gearmbs.studies.train_bearings import LIFE_LOAD_ERROR
from gearmbs.wording import warn

if TYPE_CHECKING:
    import xarray as xr

LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-12, 5e-6
"""Of runs: as of `gearmbs.drivetrain.RunSettings`."""

USUAL = 1e-2
"""Accuracy for which the usual tolerance does: of random trains and sets errors of steps were a fifth of it in the
median there. What is asked below takes a smaller one in proportion."""

SHARE = 0.5
"""Part of the difference from the twin that is taken as the error of steps, the largest of the harmonics of a mesh: as
of a case, 1/(10^a - 1) with errors that follow the power a = 0.48 of the tolerance at least. Shafts that bend ask for
it; see docs/theory/periodic.md for the random sets and trains over which it was measured."""

FLOOR = 5e-4
"""Error that is told at least, as a part of the largest line, and half of what can be asked for: a flywheel behind a
soft clutch, whose motion dies out more slowly than a record lasts, left 4.2e-4 where run and twin told 2.4e-4."""

SMALLEST = 2.0 * FLOOR
"""Least accuracy that can be asked for."""

APART = 5e-2
"""Difference, as a part of the largest line of the signal, beyond which the whole of it is the error."""

PARTED = 2.0
"""Of the difference, where flanks part: of two samples of one distribution the second is that far off the first in one
of six, of the largest of three harmonics in fewer."""

OTHERWISE = 0.05
"""Part of the time by which flanks are apart more in one run than in its twin if they are of different motions."""


@dataclass(frozen=True)
class Lines:
    """What a run is judged by.

    Attributes
    ----------
    record : Dataset
        With the levels in it.
    names : list of str
        Of the signals.
    levels : ndarray, shape (signals, meshes, harmonics)
        RMS; NaN where a speed is not steady.
    halves : ndarray, shape (2, signals, meshes, harmonics)
        Those of the two halves of the record.
    apart : float
        Part of the time of the first half in which the flanks of a mesh were apart, largest of those that carry.
    apart_before : float
        The same over all of the run behind the run-up, as far as it is known.
    loads : ndarray, shape (2, bearings)
        Equivalent loads of the two halves; of a twin those of the first alone.
    """

    record: xr.Dataset
    names: list[str]
    levels: np.ndarray
    halves: np.ndarray
    apart: float = 0.0
    apart_before: float = 0.0
    loads: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


@dataclass(frozen=True)
class Precise:
    """To what a train or a set is run.

    Attributes
    ----------
    tolerance : float
    slices : dict of str to int
        Of the face, by mesh; those with one slice are not in it.
    half : bool
        Whether the run ends in the middle of the record, as that of a twin does.
    """

    tolerance: float
    slices: Mapping[str, int]
    half: bool = False

    def coarser(self) -> Precise:
        """Return that of the twin."""
        halved = {name: max(FEWEST_SLICES - 1, n // 2) for name, n in self.slices.items()}
        return Precise(min(COARSER * self.tolerance, LARGEST_TOLERANCE), halved, half=True)

    def finer(self, part: float) -> Precise:
        """Return that of the next run, whose errors have to be a part of these."""
        tolerance = self.tolerance * float(np.clip(part, 1e-3, 1.0 / COARSER))
        return Precise(max(LEAST_TOLERANCE, tolerance), {name: 2 * n - 1 for name, n in self.slices.items()})

    def __str__(self) -> str:
        counts = sorted(set(self.slices.values()))
        sliced = f" and {' and '.join(map(str, counts))} slices of the faces" if counts else ""
        return f"{self.tolerance:.2g}{sliced}"


@dataclass(frozen=True)
class Errors:
    """Numerical errors of levels.

    Attributes
    ----------
    whole, drift : ndarray, shape (signals, meshes, harmonics)
        The errors, and the part that the record's length has.
    largest : ndarray, shape (signals, 1, 1)
        What those of each signal are judged by.
    samples : ndarray of bool, shape (signals, meshes, 1)
        Where run and twin are two samples of motions whose flanks part, which finer runs bring no nearer to each other.
    """

    whole: np.ndarray
    drift: np.ndarray
    largest: np.ndarray
    samples: np.ndarray

    @property
    def worst(self) -> float:
        """Largest error as a part."""
        return _part(self.whole, self.largest)

    @property
    def mendable(self) -> float:
        """The same of what finer runs mend."""
        by_steps = np.sqrt(np.maximum(self.whole**2 - self.drift**2, 0.0))
        return _part(np.where(self.samples, 0.0, by_steps), self.largest)


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
        With ``<level>_error``, of bearings in which parts roll ``life_load_error``, and attributes ``accuracy_asked``,
        ``accuracy_found``, ``accuracy_by`` and ``record_apart``, the part of the time in which flanks were apart.

    Warns
    -----
    UserWarning
        If the accuracy was not reached, or flanks came apart, so that other motions may exist.
    """
    first = replace(first, tolerance=max(LEAST_TOLERANCE, first.tolerance * min(1.0, wanted / USUAL)))
    done = refined(
        first,
        run,
        lambda fine, before: before or Made(coarse := fine.settings.coarser(), run(coarse)),
        lambda fine, twin: errors_of(fine.result, twin.result, groups, _share(fine.settings, twin.settings)),
        Precise.finer,
        wanted,
        LEAST_TOLERANCE,
    )
    found, twin, errors = done.fine.result, done.twin.result, done.judged
    record, values = found.record, found.record[level]
    record[f"{level}_error"] = values.copy(data=errors.whole.reshape(values.shape))
    record[f"{level}_error"].attrs = {"long_name": f"numerical error of the {values.attrs.get('long_name', level)}"}
    if np.isfinite(found.loads).any():
        loads = errors_of_loads(found, twin, _share(done.fine.settings, done.twin.settings))
        record[LIFE_LOAD_ERROR] = ("bearing", loads)
        record[LIFE_LOAD_ERROR].attrs = {"units": "N", "long_name": "numerical error of the equivalent loads of lives"}
    worst = errors.worst
    said = (
        f"mesh harmonics are known to {per_cent(worst)} of the largest of their signal, by runs at tolerances of "
        f"{done.fine.settings}, and of {done.twin.settings}"
    )
    if worst > wanted:
        said += f"; {per_cent(wanted)} was asked for"
        if (of_length := _part(errors.drift, errors.largest)) > 0.5 * worst:
            said += (
                f", but the two halves of the record differ by {per_cent(2.0 * of_length)}: a longer settling or "
                "duration lets more die out, or averages more of it"
            )
        said += _nothing(found, errors)
    apart = max(found.apart, found.apart_before)
    if apart > 0.0:
        said += _other_motions(found, twin, apart, done.fine.settings.tolerance)
    if worst > wanted or apart > 0.0:
        warn(f"{name}: {said}")
    record.attrs |= {"accuracy_asked": wanted, "accuracy_found": worst, "accuracy_by": said, "record_apart": apart}
    return record


def _nothing(found: Lines, errors: Errors) -> str:
    """Return what is said of signals whose lines are all below their errors."""
    most = np.nanmax(np.where(np.isfinite(found.levels), found.levels, 0.0), axis=(1, 2))
    least = np.nanmax(np.where(np.isfinite(errors.whole), errors.whole, 0.0), axis=(1, 2))
    lost = [k for k in range(most.size) if least[k] > most[k]]
    if not lost:
        return ""
    worst = max(lost, key=lambda k: least[k] / max(most[k], np.finfo(float).tiny))
    more = f" and {len(lost) - 1} other signals" if len(lost) > 1 else ""
    return (
        f"; of {found.names[worst]}{more} no line is told from nothing: {most[worst]:.2g} at most, of which the error "
        f"is {least[worst]:.2g}, as where there is no load"
    )


def _other_motions(found: Lines, twin: Lines, apart: float, tolerance: float) -> str:
    """Return what is said of a motion whose flanks come apart."""
    both = ""
    if abs(found.apart - twin.apart) > OTHERWISE:
        both = (
            f", in {per_cent(found.apart)} of the first half of the record and in {per_cent(twin.apart)} of it in the "
            "coarser run, which is another motion"
        )
    return (
        f"; flanks were apart in {per_cent(apart)} of the time behind the run-up{both}: other motions may "
        f"exist beside this one, of which this is no error; compare a tolerance of "
        f"{0.01 * tolerance:.1g}, or another settling"
    )


def errors_of(found: Lines, twin: Lines, groups: np.ndarray, share: float) -> Errors:
    """Return the numerical errors of levels from those of the twin, whose first half of the record is looked at."""
    levels = found.levels
    largest = np.nanmax(np.where(np.isfinite(levels), levels, 0.0), axis=(1, 2), keepdims=True)
    for group in np.unique(groups):
        of = groups == group
        largest[of] = np.maximum(largest[of], LEAST_LEVEL * largest[of].max())
    # single harmonics of the two may agree by chance: the largest difference among those of a mesh counts
    apart = np.abs(found.halves[0] - twin.halves[0])
    apart = np.max(np.where(np.isfinite(apart), apart, 0.0), axis=2, keepdims=True)
    far, parted = apart > APART * largest, _parted(found, twin)
    error = (PARTED if parted else np.where(far, 1.0, share)) * apart
    error = np.maximum(error, FLOOR * largest)
    halves = np.abs(found.halves[1] - found.halves[0])
    drift = 0.5 * np.max(np.where(np.isfinite(halves), halves, 0.0), axis=2, keepdims=True)
    whole = np.where(np.isfinite(levels), np.hypot(error, drift), np.nan)
    return Errors(whole, np.broadcast_to(drift, levels.shape), largest, far & parted)


def _parted(found: Lines, twin: Lines) -> bool:
    """Return whether flanks part in a run or its twin, so that they may be of different motions."""
    return max(found.apart, found.apart_before, twin.apart) > 0.0


def errors_of_loads(found: Lines, twin: Lines, share: float) -> np.ndarray:
    """Return the numerical errors of equivalent loads, shape (bearings,), as `errors_of` those of levels."""
    apart = np.abs(found.loads[0] - twin.loads[0])
    part = PARTED if _parted(found, twin) else share
    drift = 0.5 * np.abs(found.loads[1] - found.loads[0])
    return np.maximum(np.hypot(part * apart, drift), FLOOR * found.loads[0])


def _share(fine: Precise, coarse: Precise) -> float:
    """Return the part of the difference of two runs that the error of the finer one is at most.

    Where they differ in their slices, too, it may be of both: `SHARE` for the steps, and for the slices as of a case.
    """
    ratios = [coarse.slices[name] / n for name, n in fine.slices.items()]
    return SHARE + max((r**2 / (1.0 - r**2) for r in ratios if r < 1.0), default=0.0)


def _part(error: np.ndarray, largest: np.ndarray) -> float:
    """Return the largest error as a part of what it is judged by; signals that are zero have none."""
    with np.errstate(all="ignore"):
        parts = np.where(largest > 0.0, error / largest, 0.0)
    return float(np.nanmax(parts, initial=0.0))


def time_apart(t: np.ndarray, forces: np.ndarray) -> float:
    """Return the part of a time in which a mesh carries nothing, the largest of those that ever do.

    Parameters
    ----------
    t : ndarray, shape (m,)
        s.
    forces : ndarray, shape (m, meshes)
        Of the teeth, N: zero where flanks are apart.
    """
    loaded = forces[1:, (forces > 0.0).any(axis=0)] == 0.0
    if not loaded.size:
        return 0.0
    steps = np.diff(t)
    return float(((steps @ loaded) / steps.sum()).max())
