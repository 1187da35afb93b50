"""Cases side by side: threads where the integrator frees them, processes where it does not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal, overload

import xarray as xr

from gearmbs.dae.methods import INTEGRATORS
from gearmbs.files import check_place
from gearmbs.progress import bars
from gearmbs.studies.case.case import Case, CaseError
from gearmbs.studies.case.limits import check_record
from gearmbs.studies.run.accuracy import asked_accuracy, check_accurate
from gearmbs.studies.run.claims import Claim, claimed
from gearmbs.studies.run.engine import processes, run_jobs, threads
from gearmbs.studies.run.simulation import SimulationFailed, SimulationInterrupted, run_case
from gearmbs.studies.run.store import RecordFolder, file_stem, record_size
from gearmbs.system import cores
from gearmbs.units import QuantityLike
from gearmbs.wording import warn


class StorageWarning(UserWarning):
    """A record could not be written where it was wanted; the message says where it is."""


def run_named(
    work: Callable[[str, Callable[[float], None]], Any],
    names: Sequence[str],
    *,
    workers: int | None = None,
    progress: bool | Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """Return what ``work(name, report)`` gives by name, in threads, with bars; as many at a time as there are cores."""
    with bars(progress, names) as move:
        done = None if move is None else lambda name, _result: move(name, 1.0)
        results = run_jobs(work, names, workers or cores(), where=threads, progress=move, done=done)
    return dict(zip(names, results, strict=True))


@overload
def run_cases(
    cases: Sequence[Case],
    *,
    workers: int | None = ...,
    progress: bool | Callable[[str, float], None] | None = ...,
    done: Callable[[Case, xr.Dataset], None] | None = ...,
    folder: str | Path | None = ...,
    errors: Literal["raise"] = ...,
    accuracy: QuantityLike | None = ...,
) -> list[xr.Dataset]: ...


@overload
def run_cases(
    cases: Sequence[Case],
    *,
    workers: int | None = ...,
    progress: bool | Callable[[str, float], None] | None = ...,
    done: Callable[[Case, xr.Dataset], None] | None = ...,
    folder: str | Path | None = ...,
    errors: Literal["keep"],
    accuracy: QuantityLike | None = ...,
) -> list[xr.Dataset | SimulationFailed | CaseError]: ...


def run_cases(
    cases: Sequence[Case],
    *,
    workers: int | None = None,
    progress: bool | Callable[[str, float], None] | None = None,
    done: Callable[[Case, xr.Dataset], None] | None = None,
    folder: str | Path | None = None,
    errors: Literal["raise", "keep"] = "raise",
    accuracy: QuantityLike | None = None,
) -> Sequence[xr.Dataset | SimulationFailed | CaseError]:
    """Run cases in parallel and return their records in order.

    Parameters
    ----------
    cases : sequence of Case
        With different names.
    workers : int, optional
        Default: the cores available.
    progress : bool or callable, optional
        Bars, see `gearmbs.progress`; a callable is told ``progress(name, fraction)`` from time to time.
    done : callable, optional
        ``done(case, record)`` as soon as a case is finished, so that nothing computed is lost if a later one fails.
    folder : path, optional
        Records are written there as they come, ``<name>.nc``, and taken up again: what an interrupted call has
        finished is not computed twice. A record counts if every setting of its case and the version are the same.
        Calls at the same time share the cases.
    errors : {"raise", "keep"}
        What becomes of a case that fails: "raise" stops the others, "keep" puts the error in the place of its record.
    accuracy : float or str, optional
        Of the mesh harmonics of each record, see `gearmbs.studies.run_case`.

    Returns
    -------
    list of Dataset
        With ``errors="keep"`` the `SimulationFailed` or `CaseError` of cases that failed, in their places.

    Raises
    ------
    ValueError
        If two cases share a name, or the record of one could not be evaluated; nothing is simulated then.
    SimulationFailed
        If a case fails; the others are stopped. What was computed of it is in its ``partial()``.
    OSError
        If the folder cannot be written or has not the room; nothing is simulated then.
    """
    if errors not in ("raise", "keep"):
        raise ValueError(f"errors: {errors!r} is unknown; choose raise or keep")
    names = [case.name for case in cases]
    if len(set(names)) != len(names):
        raise ValueError(f"cases: the names {names} are not all different; name each case")
    if folder is not None and len({file_stem(name) for name in names}) != len(names):
        raise ValueError(
            f"cases: of the names {names} two make the same file; name them apart, as by more than / and _"
        )
    wanted = None if accuracy is None else asked_accuracy(accuracy)
    found: dict[str, Any] = {}
    for case in cases:
        try:
            check_record(case)
            if wanted is not None:
                check_accurate(case, wanted)
        except CaseError as error:
            if errors == "raise":
                raise
            found[case.name] = error
    ledger = None if folder is None else RecordFolder(Path(folder), wanted)
    if ledger is not None:
        stored = {case.name: ledger.result(case) for case in cases if case.name not in found}
        found |= {name: known[0] for name, known in stored.items() if known is not None}
        needed = sum(record_size(case) for case in cases if case.name not in found)
        check_place(ledger.path, needed, f"the study of {len(cases) - len(found)} records")
        ledger.path.mkdir(parents=True, exist_ok=True)
    left = [case for case in cases if case.name not in found]
    workers = max(1, min(workers or cores(), len(left)))
    if workers > 1:
        # the longest first, or the last one would keep the others waiting
        left.sort(key=_cost, reverse=True)
    compiled = all(INTEGRATORS[case.solver.integrator].compiled for case in left)
    with bars(progress, names) as move:
        move = move or _unseen
        for name in found:
            move(name, 1.0)

        def finished(case: Case, ended: tuple[Any, str]) -> None:
            result, trouble = ended
            found[case.name] = result
            move(case.name, 1.0)
            if trouble:
                # the record is in memory all the same, and other cases are not to blame
                warn(trouble, StorageWarning)
            if done is not None and not isinstance(result, SimulationFailed):
                done(case, result)

        run_jobs(
            partial(_carried_out, ledger, errors == "keep", wanted),
            left,
            workers,
            where=threads if workers == 1 or compiled else processes,
            progress=lambda case, fraction: move(case.name, fraction),
            done=finished,
            ledger=ledger,
        )
    return [found[name] for name in names]


def _unseen(_name: str, _fraction: float) -> None:
    """Show nothing."""


def _span(case: Case) -> float:
    """Simulated time of a case up to the end of its record, s."""
    return case.operation.run_up + case.operation.settling + case.operation.longest


def _cost(case: Case) -> float:
    """Expected time of a case, in no particular unit: a second slice costs a tenth of the first."""
    return _span(case) * (9.0 + case.pair().face_slices)


def _carried_out(
    ledger: RecordFolder | None, keep: bool, accuracy: float | None, case: Case, report: Callable[[float], None]
) -> tuple[Any, str]:
    """Return the record of a case, or the failure if it is to be kept, and why it is not where it should be."""

    run = run_case if accuracy is None else partial(run_case, accuracy=accuracy)
    begun = False

    def work(_claim: Claim | None = None) -> tuple[Any, str]:
        nonlocal begun
        begun = True
        try:
            record = run(case, lambda t: report(min(t / _span(case), 1.0)))
        except SimulationFailed as failure:
            if not keep or isinstance(failure, SimulationInterrupted):
                raise
            return failure, ""
        return record, "" if ledger is None else ledger.enter(case, record)

    if ledger is None:
        return work()
    try:
        return claimed(ledger, case, work)
    except OSError:
        if begun:
            raise
        # no room for a claim, which only saves work
        return work()
