"""Records whose mesh harmonics are as accurate as asked, and tell how accurate they are.

A run has three numerical errors: of its steps, which the tolerance bounds; of its length, where the motion has not yet
come back to itself; of the sum over slices that stands for the integral along the face. Each run has a *twin* over the
same stretch of the motion, whose tolerance is a decade larger (`gearmbs.studies.run.refined`) and which has half as
many slices of the face. What the two differ by is mostly the error of the twin. That of the run itself is smaller, by

    tolerance   ten times with a method of order one in the tolerance; the harmonics of meshing wheels, whose steps are
                cut by kinks, were found to follow its power of 0.6 to 1: four times at least
    slices      by the square of their ratio r, as the sum is a trapezoidal rule of pieces with kinks: r^2/(1 - r^2) of
                the difference

With `SHARE` = 1/2 of the difference as the error of the run, or the part that the slices ask for, there is room for
both in one. Single harmonics of the two may agree by chance: the largest difference among those of a component counts
for all of them. To this comes the part by which the motion does not repeat itself.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from gearmbs.dae.methods import INTEGRATORS
from gearmbs.schema.quantities import accuracy_part
from gearmbs.studies.case.case import Case, CaseError, CaseWarning
from gearmbs.studies.case.limits import check_record, holds_period
from gearmbs.studies.case.sections import LEAST_TOLERANCE
from gearmbs.studies.run.levels import LEVELS
from gearmbs.studies.run.periodic import HOLDS, LEAST_LEVEL, Found, Precision
from gearmbs.studies.run.record import SERIES, VARIABLES, PlainRecord, dims_of, told_of, values_of
from gearmbs.studies.run.refined import COARSER, Behind, Made, refined
from gearmbs.units import QuantityLike

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.mechanism import Mechanism
    from gearmbs.studies.case.keywords import ContactKeywords

SHARE = 0.5
"""Part of the difference from the twin that is taken as the error; see the module's text."""

DECAYED = 0.5
"""Part of a record's deviation that its mean is off by where an oscillation decays fast; see `periodic`."""

USUAL = {True: 2e-3, False: 1e-2}
"""Accuracy for which the usual tolerance does: of records that are as long as needed, whose tolerance is a tenth of the
others', and of those with a duration. Of random cases it was 1.4e-4 in the median, 7e-4 at most; of others, five times
that. What is asked below takes a smaller tolerance in proportion."""

APART = 1e-2
"""Difference, as a part of the largest harmonic of the component, beyond which the two runs are no longer a good one
and a less good one of the same motion: then the whole of it is the error."""

FLOOR = 1e-4
"""Error that is told at least, as a part of the largest harmonic: below it errors of steps that kinks cut fall with a
small power of the tolerance, and by chance."""

SMALLEST = 2.0 * FLOOR
"""Least accuracy that can be asked for."""

FEWEST_SLICES = 3
"""Slices of a face along which flanks vary that can be judged: the twin has two of them at least."""

NOTED = 0.3
"""Part of the asked accuracy that a motion may miss to be said to repeat itself, if that is less than usual."""


class Recorded(NamedTuple):
    """A record, and what it takes to judge it by that of a twin.

    Attributes
    ----------
    record : PlainRecord or Dataset
    found : Found or None
        Mesh periods that the record of a twin is of; None unless the duration is "auto".
    levels : ndarray or None
        RMS of the mesh harmonics over the part of the record that a twin shares; default those of all of it.
    behind : Behind or None
        What was simulated, with a state behind the run-up for a twin to start from.
    """

    record: PlainRecord | xr.Dataset
    found: Found | None = None
    levels: np.ndarray | None = None
    behind: Behind | None = None


class _Judged(NamedTuple):
    """Numerical errors of levels, the part of a difference that they are at least, and the largest as a part."""

    error: np.ndarray
    share: float
    worst: float

    @property
    def mendable(self) -> float:
        return self.worst


class Run(Protocol):
    """Simulates a case, for some variables, to a precision."""

    def __call__(self, case: Case, variables: Collection[str] | None, precision: Precision) -> Recorded: ...


def asked_accuracy(
    accuracy: QuantityLike, of: str = "the largest mesh harmonic of a component", smallest: float = SMALLEST
) -> float:
    """Return an accuracy as a part; see `gearmbs.schema.quantities.accuracy_part`.

    Raises
    ------
    CaseError
        If it is none, or beyond what can be asked for.
    """
    try:
        return accuracy_part(accuracy, of, smallest)
    except ValueError as error:
        raise CaseError(str(error)) from None


def check_accurate(case: Case, accuracy: QuantityLike) -> float:
    """Return the accuracy asked for as a part, if a case can be simulated to one.

    Raises
    ------
    CaseError
        If it is none, or the case has a tolerance of its own or too few slices.
    """
    wanted = asked_accuracy(accuracy)
    if case.solver.tolerance is not None:
        raise CaseError(
            f"case '{case.name}': accuracy = {accuracy!r}: the tolerance is chosen for it, but the case has "
            f"solver.tolerance = {case.solver.tolerance:g}; leave one of the two out"
        )
    few = case.contact.slices is not None and case.contact.slices < FEWEST_SLICES
    if few and case.changed(contact={"slices": None}).pair().face_slices > 1:
        raise CaseError(
            f"case '{case.name}': accuracy = {accuracy!r}: what contact.slices = {case.contact.slices} is good for "
            f"cannot be told from fewer; give {FEWEST_SLICES} or more, or leave slices out"
        )
    return wanted


def accurate_record(
    run: Run, case: Case, accuracy: QuantityLike, variables: Collection[str] | None, mechanism: Mechanism | None = None
) -> xr.Dataset:
    """Return the record of a case whose mesh harmonics are as accurate as asked, and what they are known to.

    Parameters
    ----------
    run : callable
        Simulates a case; see `Run`.
    case : Case
        Without a tolerance.
    accuracy : float or str
        Of the mesh harmonics, as a part of the largest of their component; see `asked_accuracy`.
    variables : collection of str or None
        As of `gearmbs.studies.run_case`.
    mechanism : Mechanism, optional
        What is simulated instead of that of the case, whose slices stay.

    Returns
    -------
    Dataset
        As of `gearmbs.studies.run_case`. ``gmf_rms_error``, or ``order_rms_error``: the numerical error of each level,
        with the level's dimensions and unit. Other variables over time have the errors of their mean and of their
        standard deviation as the attributes ``error_of_mean`` and ``error_of_std``. Attributes ``accuracy_asked``,
        ``accuracy_found`` and ``accuracy_by``, in words.

    Raises
    ------
    CaseError
        See `check_accurate`; and if a mechanism of one's own has slices.

    Warns
    -----
    CaseWarning
        If the accuracy was not reached, or flanks came apart, so that other motions may exist.
    """
    wanted = check_accurate(case, accuracy)
    slices, given = case.pair().face_slices, case.contact.slices is not None
    own = _slices_of(mechanism)
    if own > 1:
        raise CaseError(
            f"accuracy = {accuracy!r}: what the {own} slices of the face of a mechanism of one's own are good for "
            "is not known; run the case without the mechanism, or leave accuracy out"
        )
    level = LEVELS[0 if case.operation.speed_curve is None else 1]
    kept = set(VARIABLES if variables is None else variables)
    both = kept - {"acceleration"} | {level}
    precision = Precision(min(HOLDS, NOTED * wanted))
    usual = min(case.tolerance, INTEGRATORS[case.solver.integrator].largest_tolerance / COARSER)
    first = _at(case, max(LEAST_TOLERANCE, usual * min(1.0, wanted / USUAL[case.is_auto])), slices)

    def twin_of(fine: Made[Case, Recorded], before: Made[Case, Recorded] | None) -> Made[Case, Recorded]:
        # the run before is a twin only if it has fewer slices, too
        if before is not None and not (given and slices > 1):
            return before
        return _twin(run, fine.settings, fine.result, both)

    def judge(fine: Made[Case, Recorded], twin: Made[Case, Recorded]) -> _Judged:
        share = _share(fine.settings, twin.settings)
        error, worst = _errors(fine.result, twin.result, level, share)
        return _Judged(error, share, worst)

    def finer(fine: Case, part: float) -> Case:
        count = fine.pair().face_slices
        more = count if count == 1 or given else 2 * count - 1
        return _at(case, max(LEAST_TOLERANCE, fine.tolerance * part), more)

    done = refined(
        first, lambda one: run(one, kept | {level}, precision), twin_of, judge, finer, wanted, LEAST_TOLERANCE
    )
    made, twin, fine, coarse = (
        done.fine.result.record,
        done.twin.result.record,
        done.fine.settings,
        done.twin.settings,
    )
    error, share, worst = done.judged.error, done.judged.share, done.judged.worst
    if level in kept:
        _add_level_errors(made, level, error)
    record = made.dataset() if isinstance(made, PlainRecord) else made
    for name in kept & {*SERIES} & {*record.data_vars}:
        if name in twin:
            _add_errors(record[name], values_of(twin, name), share, worst)
    if level not in kept:
        record = record.drop_vars(level)
        left = {dim for one in record.data_vars.values() for dim in one.dims}
        record = record.drop_vars([name for name, one in record.coords.items() if not left.issuperset(one.dims)])
    record = _told(record, wanted, worst, fine, coarse)
    # the case as it was asked for: its tolerance is that of its accuracy, and is told beside it
    record.attrs["case_json"] = case.model_dump_json()
    return record


def _slices_of(mechanism: Mechanism | None) -> int:
    """Return the most slices of the face that a mesh of a mechanism has."""
    elements = () if mechanism is None else mechanism.elements.values()
    return max((getattr(getattr(one, "pair", None), "face_slices", 1) for one in elements), default=1)


def _twin(run: Run, fine: Case, found: Recorded, variables: Collection[str]) -> Made[Case, Recorded]:
    """Return a coarser case and its record over the same stretch of the motion."""
    slices = fine.pair().face_slices
    largest = INTEGRATORS[fine.solver.integrator].largest_tolerance
    coarse = _at(fine, min(COARSER * fine.tolerance, largest), max(FEWEST_SLICES - 1, slices // 2) if slices > 1 else 1)
    if not fine.is_auto and found.levels is not None:
        coarse = part_of(coarse) or coarse
    return Made(coarse, run(coarse, variables, Precision(like=found.found, behind=found.behind, is_twin=True)))


def part_of(case: Case) -> Case | None:
    """Return a case whose record is the part that run and twin are held against each other over; None for all of it.

    It is the first half, if that can be evaluated and no fault of a tooth is left out of it.
    """
    if case.operation.speed_curve is not None or case.is_auto:
        return None
    half = case.changed(operation={"duration": 0.5 * case.operation.longest})
    try:
        check_record(half)
    except CaseError:
        return None
    return half if holds_period(half) else None


def _share(fine: Case, coarse: Case) -> float:
    """Return the part of the difference of two runs that the error of the finer one is at most."""
    ratio = coarse.pair().face_slices / fine.pair().face_slices
    return max(SHARE, ratio**2 / (1.0 - ratio**2)) if ratio < 1.0 else SHARE


def _add_level_errors(made: PlainRecord | xr.Dataset, level: str, error: np.ndarray) -> None:
    """Add the errors of levels to a record."""
    values = made.data[level] if isinstance(made, PlainRecord) else made[level]
    told = values[2] if isinstance(values, tuple) else values.attrs
    attributes = {"units": told["units"], "long_name": f"numerical error of the {told['long_name']}"}
    variable = dims_of(made, level), error, attributes
    if isinstance(made, PlainRecord):
        made.data[f"{level}_error"] = variable
    else:
        made[f"{level}_error"] = variable


def _add_errors(series: xr.DataArray, other: np.ndarray, share: float, worst: float) -> None:
    """Add the errors of its mean and standard deviation to a variable over time.

    They are single differences over what the twin has of it, which may be small by chance: of the larger one, and what
    the harmonics are off by as parts, of the standard deviation.
    """
    one, two = (v.astype(float).reshape(len(v), -1) for v in (series.values, other))
    part = one[: len(two)]
    apart = np.maximum(np.abs(part.mean(axis=0) - two.mean(axis=0)), np.abs(part.std(axis=0) - two.std(axis=0)))
    error = (share * apart + worst * one.std(axis=0)).squeeze()
    for what in ("mean", "std"):
        series.attrs[f"error_of_{what}"] = error.tolist()


def _at(case: Case, tolerance: float, slices: int) -> Case:
    """Return a case at a tolerance and with so many slices of the face, one as lumped as the given one."""
    contact: ContactKeywords = {} if slices == case.pair().face_slices else {"slices": slices}
    return case.changed(solver={"tolerance": tolerance, "lump": case.lump}, contact=contact)


def _errors(made: Recorded, twin: Recorded, level: str, share: float) -> tuple[np.ndarray, float]:
    """Return the numerical errors of the levels of a record from those of its twin, and the largest as a part.

    That is of the largest level of the component, or of a hundredth of that of all.
    """
    record, told = made.record, told_of(made.record)
    values, dims = values_of(record, level), dims_of(record, level)
    along, across = dims.index("harmonic"), dims.index("component")
    one, two = (values_of(run.record, level) if run.levels is None else run.levels for run in (made, twin))
    apart = np.fmax.reduce(np.abs(one - two), axis=along, keepdims=True)
    if "way" in dims:
        # half of a record may be too short for bands
        apart = np.where(np.isnan(apart), np.fmax.reduce(apart, axis=dims.index("way"), keepdims=True), apart)
    largest = np.fmax.reduce(values, axis=along, keepdims=True)
    error = np.where(apart > APART * largest, 1.0, share) * apart
    error = np.maximum(error, FLOOR * largest) + 0.0 * values
    if told.get("record_status") == "periodic":
        returned = told["record_deviation"] * np.maximum(values, LEAST_LEVEL * largest)
        error = np.hypot(error, DECAYED * returned)
    elif "record_status" in told:
        # of what does not repeat itself two stretches are two samples, of which neither is the better one
        error = np.maximum(error, apart)
    others = tuple(k for k, dim in enumerate(dims) if dim not in ("way", "component"))
    largest = np.fmax.reduce(values, axis=others, keepdims=True)
    of = np.maximum(largest, LEAST_LEVEL * np.fmax.reduce(largest, axis=across, keepdims=True))
    return error, float(np.nanmax(error / of))


def _told(record: xr.Dataset, wanted: float, worst: float, fine: Case, coarse: Case) -> xr.Dataset:
    """Return a record that says what its mesh harmonics are known to."""
    slices = [one.pair().face_slices for one in (fine, coarse)]
    sliced = f" and {slices[0]} slices of the face" if slices[0] > 1 else ""
    against = f" and {slices[1]}" if slices[0] > 1 else ""
    said = (
        f"mesh harmonics are known to {per_cent(worst)} of the largest of their component, by runs at tolerances of "
        f"{fine.tolerance:.2g}{sliced}, and of {coarse.tolerance:.2g}{against}"
    )
    if worst > wanted:
        said += f"; {per_cent(wanted)} was asked for"
        if record.attrs.get("record_status", "periodic") != "periodic":
            said += ", but the motion does not repeat itself: a longer duration averages more of it"
    apart = record.attrs.get("record_apart", 0.0)
    if apart > 0.0:
        said += (
            f"; the flanks were apart in {100 * apart:.2g} % of the time behind the run-up: other motions may exist "
            "beside this one, of which this is no error; compare duration = 'auto', and a tolerance of "
            f"{0.01 * fine.tolerance:.1g}"
        )
    if worst > wanted or apart > 0.0:
        warnings.warn(CaseWarning(f"case '{fine.name}': {said}"), stacklevel=4)
    record.attrs |= {"accuracy_asked": wanted, "accuracy_found": worst, "accuracy_by": said}
    return record


def per_cent(part: float) -> str:
    return f"{float(f'{100.0 * part:.2g}'):g} %"
