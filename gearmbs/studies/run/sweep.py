"""One setting of a case over many values: resumable, with tables, signals and a figure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs._display import Shown, html_table
from gearmbs.files import python_scalar
from gearmbs.schema.quantities import SHOWN
from gearmbs.signals.files.simulated import record_signal
from gearmbs.studies.case.case import Case, CaseError
from gearmbs.studies.case.section import Section, measures_of
from gearmbs.studies.case.texts import readable
from gearmbs.studies.presets.paper_cases import DEFAULT_COMPONENT
from gearmbs.studies.run.levels import told_way
from gearmbs.studies.run.parallel import run_cases
from gearmbs.studies.run.store import file_stem, save_study
from gearmbs.wording import did_you_mean

if TYPE_CHECKING:
    from gearmbs.signals.time_frequency import SweepWaterfallKeywords
    from gearmbs.studies.case.keywords import SolverKeywords
    from gearmbs.units import QuantityLike


@dataclass(frozen=True)
class Sweep(Shown):
    """Records of a case over the values of one setting.

    Attributes
    ----------
    case : Case
        What all have in common.
    field : str
        The setting, ``"operation.speed"``.
    cases : list of Case
    results : list
        The record of each case, or its error where errors were kept.
    """

    case: Case
    field: str
    cases: list[Case]
    results: list[Any]

    @property
    def records(self) -> list[xr.Dataset]:
        """The records, without cases that failed."""
        return [result for result in self.results if isinstance(result, xr.Dataset)]

    @property
    def failures(self) -> dict[str, Exception]:
        """The errors of cases that failed, by name."""
        return {c.name: r for c, r in zip(self.cases, self.results, strict=True) if isinstance(r, Exception)}

    @property
    def unit(self) -> str:
        """Unit of the values in tables and figures."""
        measure = _measure(self.case, self.field)
        return "1" if measure is None else measure.shown or measure.unit

    @property
    def values(self) -> np.ndarray:
        """The setting's values of the records, in `unit`."""
        numbers = [_value(c, self.field) for c, r in zip(self.cases, self.results, strict=True) if _is_record(r)]
        return np.array(numbers, dtype=float) / SHOWN.get(self.unit, 1.0)

    def component(self, name: str | None = None) -> str:
        """Return a force component's name: the one asked for, or the default.

        Raises
        ------
        CaseError
            If the records have no such component.
        """
        known = [str(c) for c in self.records[0].component.values] if self.records else [DEFAULT_COMPONENT]
        wanted = name or DEFAULT_COMPONENT
        if wanted not in known:
            raise CaseError(f"component: {wanted!r} is unknown; choose one of {', '.join(known)}")
        return wanted

    def signals(self, component: str | None = None) -> list[xr.DataArray]:
        """Return the acceleration of each record as a signal, for everything that signals are good for."""
        return [record_signal(record, self.component(component)) for record in self.records]

    def table(self, component: str | None = None) -> pd.DataFrame:
        """Return RMS of the mesh harmonics (m/s^2), the mesh frequency (Hz) and the solver's cost, a row a value.

        All rows have their levels by ``way``: by bands, or by orders if one of the records is too short for bands.
        Of records to an accuracy each level has its numerical error beside it, as ``1 x GMF +/-``.
        ``record`` says whether a record has the length that was given, or one after which the motion repeats itself, or
        the longest one.
        """
        name, way = self.component(component), told_way(self.records)
        rows = []
        for record in self.records:
            row = {"mesh frequency, Hz": record.attrs["mesh_frequency"]}
            if "gmf_rms" in record:
                levels = record["gmf_rms"].sel(component=name, way=way)
                row |= {f"{int(h)} x GMF": float(level) for h, level in zip(levels.harmonic, levels, strict=True)}
                if "gmf_rms_error" in record:
                    off = record["gmf_rms_error"].sel(component=name, way=way)
                    row |= {f"{int(h)} x GMF +/-": float(error) for h, error in zip(off.harmonic, off, strict=True)}
                row["way"] = way
            row["record"] = record.attrs.get("record_status", "given")
            row["ms a mesh cycle"] = 1e3 * record.attrs["solver_time_per_mesh_cycle"]
            rows.append(row)
        index = pd.Index(self.values, name=f"{self.field.rpartition('.')[2]}, {self.unit}")
        return pd.DataFrame(rows, index=index)

    def waterfall(self, component: str | None = None, **settings: Unpack[SweepWaterfallKeywords]) -> xr.DataArray:
        """Return the spectra of the records over speed; ``settings`` are those of `gearmbs.signals.waterfall`."""
        from gearmbs.signals import waterfall

        return waterfall(self.signals(component), **settings)

    def save(self, folder: str | Path) -> list[Path]:
        """Write the records that are there, the table and the figure to a folder; return the paths."""
        records = {f"{file_stem(r.attrs['case'])}.nc": r for r in self.records}
        return save_study(
            folder, records, {"table.csv": lambda: self.table().to_csv()}, lambda: {"figure": self.plot()}
        )

    def _repr_html_(self) -> str:
        table = self.table()
        rows = [(float(value), *row) for value, row in zip(table.index, table.itertuples(index=False), strict=True)]
        note = "; ".join(f"{name} failed: {error}" for name, error in self.failures.items())
        return html_table(f"Sweep of {self.field}, {self.case.name}", (table.index.name, *table.columns), rows, note)

    def __str__(self) -> str:
        return f"{self!r}\n{self.table().to_string(float_format='{:.5g}'.format)}"

    def __repr__(self) -> str:
        return f"Sweep({self.case.name!r}, {self.field}: {len(self.records)} of {len(self.cases)} records)"


def sweep(
    case: Case,
    field: str,
    values: Sequence[Any],
    *,
    folder: str | Path | None = None,
    workers: int | None = None,
    progress: bool | Callable[[str, float], None] | None = None,
    errors: Literal["raise", "keep"] = "raise",
    accuracy: QuantityLike | None = None,
) -> Sweep:
    """Run a case for many values of one of its settings.

    Sampling rates that the case leaves open are those of the value that needs the highest, so that spectra fit
    together.

    Parameters
    ----------
    case : Case
        Everything else. Without a duration of its own records are as long as their harmonics need ("auto").
    field : str
        Section and setting, such as ``"operation.speed"`` or ``"fault.misalignment"``.
    values : sequence
        As the setting takes them: texts with units, or numbers in SI.
    folder : path, optional
        Records are written there as they come; a call that was interrupted goes on where it stopped.
    workers, progress, errors
        See `run_cases`.
    accuracy : float or str, optional
        Of the mesh harmonics of each record, such as "1 %", see `run_case`; the table and the figure tell their errors.

    Returns
    -------
    Sweep
        Shows itself as a table and with ``plot()``: over speeds a waterfall of spectra.

    Raises
    ------
    CaseError
        If there is no such setting, or a value is impossible; nothing is simulated then.
    SimulationFailed
        If a case fails and errors are not kept.

    Examples
    --------
    >>> speeds = [f"{n} rpm" for n in range(300, 3001, 300)]
    >>> study = sweep(Case(), "operation.speed", speeds, folder="speeds")  # doctest: +SKIP
    >>> study.plot()  # doctest: +SKIP
    """
    cases = cases_of_sweep(case, field, values)
    results = run_cases(cases, workers=workers, progress=progress, errors=errors, folder=folder, accuracy=accuracy)
    return Sweep(case, field, cases, results)


def cases_of_sweep(case: Case, field: str, values: Sequence[Any]) -> list[Case]:
    """Return the cases of `sweep`; CaseError if there is no such setting, or a value is impossible."""
    section, _, name = field.partition(".")
    _check_field(case, field)
    case = case.as_one_of_many()
    values = values if isinstance(values, str) else list(values)
    if isinstance(values, str) or not values:
        raise CaseError(f"values: {values!r}; give a sequence of values of {field}")
    cases = []
    for place, value in enumerate(values, 1):
        change: dict[str, Any] = {section: {name: python_scalar(value)}}
        try:
            one = case.changed(**change)
        except CaseError as error:
            raise CaseError(f"value {place} of {field}: {str(error).partition(': ')[2] or error}") from None
        cases.append(one)
    rates: SolverKeywords = {
        "signal_rate": max(c.signal_rate for c in cases),
        "output_rate": max(c.output_rate for c in cases),
    }
    if case.solver.signal_rate is None and case.solver.output_rate is None:
        cases = [c.changed(solver=rates) for c in cases]
    cases = [c.changed(name=f"{case.name}, {name} {readable(getattr(c, section), name)}") for c in cases]
    return cases


def between(ends: Sequence[str], count: int, case: Case, field: str) -> list[Any]:
    """Return values evenly from the first to the second of two texts, in SI."""
    if len(ends) != 2 or count < 2:
        raise CaseError(f"values: {', '.join(ends)} with a count of {count}; give two values and a count from 2 up")
    _check_field(case, field)
    low, high = (_number_at(one, field) for one in cases_of_sweep(case, field, ends))
    return list(np.linspace(low, high, count))


def _number_at(case: Case, field: str) -> float:
    section, _, name = field.partition(".")
    value = getattr(getattr(case, section), name)
    if not isinstance(value, (int, float)):
        raise CaseError(f"{field} is {value!r}, no number: give its values one by one, without a count")
    return float(value)


def _is_record(result: Any) -> bool:
    return isinstance(result, xr.Dataset)


def _check_field(case: Case, field: str) -> None:
    known = [
        f"{section}.{name}"
        for section in type(case).model_fields
        if isinstance(getattr(case, section), Section)
        for name in type(getattr(case, section)).model_fields
    ]
    if field not in known:
        ends = next((k for k in known if k.endswith(f".{field}")), None)
        otherwise = f"did you mean {ends}?" if ends else f"settings are {', '.join(known)}"
        hint = did_you_mean(field, known, otherwise=otherwise)
        raise CaseError(f"field: {field!r} is no setting of a case; {hint}")


def _measure(case: Case, field: str) -> Any:
    section, _, name = field.partition(".")
    settings: Section = getattr(case, section)
    return measures_of(type(settings)).get(name)


def _value(case: Case, field: str) -> float:
    """Return the value of a setting as a number; of a curve its largest, of two wheels the first."""
    section, _, name = field.partition(".")
    value = getattr(getattr(case, section), name)
    if isinstance(value, tuple):
        value = max(v for _, v in value) if isinstance(value[0], tuple) else value[0]
    return float("nan") if isinstance(value, str) or value is None else float(value)
