"""The paper's study: its six cases simulated, their GMF harmonics in one dataset, tables, figures and report."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import xarray as xr

from gearmbs._shown import Shown, html_table
from gearmbs.dae.result import SolverStats
from gearmbs.files import write_whole
from gearmbs.schema.messages import chosen
from gearmbs.signals import COMPONENTS, rms_factor
from gearmbs.studies.case.case import Case, CaseError, make_case
from gearmbs.studies.paper.preset import (
    DEFAULT_COMPONENT,
    LOAD_NAMES,
    LOADS,
    MISALIGNMENT,
    STATES,
    Claim,
    judge,
    paper_cases,
)
from gearmbs.studies.paper.report import paper_report
from gearmbs.studies.run.parallel import run_cases
from gearmbs.studies.run.store import save_study

TARGET_RMS = 1.0
"""RMS, m/s^2, to which the healthy signal at low load is scaled; the paper's own value is not published."""

COSTS = ("mesh_cycles", "real_time_factor", "time_per_mesh_cycle")
"""What a record says of its cost beside the solver's statistics."""


@dataclass(frozen=True)
class PaperStudy(Shown):
    """Results of the six cases.

    Attributes
    ----------
    records : Dataset
        All cases, over dimensions load and state; ``gmf_rms`` unscaled and ``gmf_rms_scaled`` in units of the target.
    component : str
        The study's stated default component.
    cases : list of Case
    """

    records: xr.Dataset
    component: str
    cases: list[Case]

    def table(self, component: str | None = None, way: str = "band") -> xr.DataArray:
        """Return the scaled RMS of the harmonics, dims (load, state, harmonic), m/s^2."""
        return self.records["gmf_rms_scaled"].sel(component=component or self.component, way=way)

    def claims(self, component: str | None = None, way: str = "band") -> list[Claim]:
        """Judge the paper's three claims for a force component."""
        name = component or self.component
        return judge(self.table(name, way), name)

    def _repr_html_(self) -> str:
        claims = [(claim.name, "held" if claim.held else "not held", claim.numbers) for claim in self.claims()]
        table = self.table()
        rows = [
            (str(load), str(state), *(float(v) for v in table.sel(load=load, state=state).values))
            for load in table["load"].values
            for state in table.state.values
        ]
        names = ("load", "state", "1 x GMF", "2 x GMF", "3 x GMF")
        levels = html_table(f"RMS of the GMF harmonics, {self.component.replace('_', ' ')}, scaled, m/s^2", names, rows)
        return html_table("The paper's study", ("claim", "", "numbers"), claims) + levels

    def to_csv(self) -> str:
        """Return the GMF table of all components as CSV."""
        lines = ["load,state,component,way,harmonic,frequency_hz,rms_m_s2,scaled_rms_m_s2"]
        raw, scaled = self.records["gmf_rms"], self.records["gmf_rms_scaled"]
        order = ("load", "state", "component", "way", "harmonic")
        raw, scaled = raw.transpose(*order), scaled.transpose(*order)
        frequency = dict(zip(raw.harmonic.values, raw.frequency.values))
        places = product(*(raw[name].values for name in order))
        for place, level, in_scale in zip(places, raw.values.ravel(), scaled.values.ravel()):
            lines.append(
                f"{','.join(str(part) for part in place)},{frequency[place[-1]]:.6f},{level:.8g},{in_scale:.8g}"
            )
        return "\n".join(lines) + "\n"

    def save(self, folder: str | Path) -> list[Path]:
        """Write dataset, table, figures and report to a folder; return the paths."""
        texts = {"gmf_rms.csv": self.to_csv, "report.md": lambda: paper_report(self)}
        return save_study(folder, {"paper.nc": self.records}, texts, self.figures)

    def figures(self) -> dict[str, Any]:
        """Return figures 5 and 7 of the paper, the bars at low and at high load, by name."""
        from gearmbs.view import gmf_bars

        found = {}
        for load, stem, label in (("low", "figure_5", "low load"), ("high", "figure_7", "high load")):
            torque = float(self.records.torque.sel(load=load))
            found[stem] = gmf_bars(
                self.table().sel(load=load),
                title=f"Model, {label} ({torque:g} N m): RMS of the GMF harmonics, {self.component.replace('_', ' ')}",
            )
        return found


def run_paper(
    base: Case | None = None,
    *,
    torques: tuple[float, float] = LOADS,
    misalignment: float = MISALIGNMENT,
    component: str = DEFAULT_COMPONENT,
    workers: int | None = None,
    progress: bool | Callable[[str, float], None] | None = None,
    done: Callable[[Case, xr.Dataset], None] | None = None,
    folder: str | Path | None = None,
) -> PaperStudy:
    """Simulate the six cases of the paper and evaluate them.

    Parameters
    ----------
    base : Case, optional
        Everything but load and fault; default: the preset of :class:`gearmbs.studies.Case`.
    torques : tuple of float
        Low and high load, N m.
    misalignment : float
        Angle of the misaligned case, rad.
    component : str
        Force component of the figures: one of ``line_of_action``, ``line_of_centres``, ``tangential``, ``resultant``.
    workers, progress, done, folder
        See :func:`gearmbs.studies.run_cases`.

    Examples
    --------
    >>> study = run_paper(Case(operation={"duration": 0.2}))  # doctest: +SKIP
    >>> study.table()  # doctest: +SKIP
    """
    chosen(COMPONENTS, component, "", CaseError, "component:")
    cases = paper_cases(base=base, torques=torques, misalignment=misalignment)
    records = run_cases(cases, workers=workers, progress=progress, done=done, folder=folder)
    return PaperStudy(combine(cases, records, component), component, cases)


def combine(cases: list[Case], records: list[xr.Dataset], component: str) -> xr.Dataset:
    """Put the six records into one dataset over load and state and scale them.

    One factor, from the healthy record at low load in the default component, serves all cases and components, so
    that states and loads remain comparable.
    """
    rows = [records[i : i + len(STATES)] for i in range(0, len(records), len(STATES))]
    bare = [[r.drop_attrs(deep=False) for r in row] for row in rows]
    together = xr.concat(
        [xr.concat(row, dim="state", combine_attrs="override") for row in bare], dim="load", combine_attrs="override"
    ).assign_coords(state=list(STATES), load=list(LOAD_NAMES))
    signal = records[0]["acceleration"].sel(component=[component]).rename(signal_time="time", component="channel")
    factor = rms_factor(signal, TARGET_RMS)
    together["acceleration_scaled"] = together["acceleration"] * factor
    together["gmf_rms_scaled"] = together["gmf_rms"] * factor
    for name in ("acceleration", "gmf_rms"):
        text = together[name].attrs.get("long_name", name)
        together[f"{name}_scaled"].attrs = {"units": "m/s^2", "long_name": f"{text}, scaled"}
    together = together.assign_coords(
        torque=("load", [row[0].attrs["operation_torque"] for row in rows], {"units": "N m"})
    )
    statistics = {f"solver_{name}" for name in (*SolverStats().as_dict(), *COSTS, "time_per_mesh_cycle_units")}
    together.attrs = {
        k: v for k, v in records[0].attrs.items() if k not in statistics and k not in ("case", "case_json")
    }
    for key in ("operation_torque", "operation_torque_units"):
        together.attrs.pop(key)
    for key in ("fault_misalignment", "fault_centre_distance_error", "contact_ratio", "face_slices"):
        together.attrs.pop(key)
        units = {"units": together.attrs.pop(f"{key}_units", "1")}
        together = together.assign_coords({key: ("state", [r.attrs[key] for r in rows[0]], units)})
    said = [f"{state}: {r.attrs['remarks']}" for state, r in zip(STATES, rows[0]) if r.attrs["remarks"] != "none"]
    together.attrs["remarks"] = "; ".join(said) or "none"
    together.attrs["title"] = "gear pair: the paper's six cases"
    together.attrs["scaling"] = (
        f"factor {factor:.8g}: healthy at low load, {component}, to an RMS of {TARGET_RMS} m/s^2; kept for all"
    )
    together.attrs["scale_factor"] = factor
    together.attrs["component"] = component
    for case, record in zip(cases, records):
        key = case.name.replace(", ", "_").replace(" ", "_")
        together.attrs[f"case_{key}"] = record.attrs["case_json"]
        for item in ("steps", "residuals", "jacobians", "wall_time", *COSTS):
            together.attrs[f"solver_{key}_{item}"] = record.attrs[f"solver_{item}"]
    return together


# The stored table of GMF levels that guards the six cases: ``python -m gearmbs.studies.paper.paper FILE``.
#
# Records of 0.1 s with the study's defaults but a tight tolerance; the levels by orders of all components, unscaled.


DURATION = 0.1
"""Length of the records of the guard, s: some fifty mesh periods."""
TOLERANCE = 1e-9
"""So tight that rounding, which differs between machines, stays far below the comparison's 0.1 %."""


def gmf_levels(workers: int | None = None, *, lump: bool = False) -> dict[str, dict[str, list[float]]]:
    """Return the RMS of the first three mesh harmonics, m/s^2, by case and component; ``lump`` as in a case."""
    solver = {"tolerance": TOLERANCE, "lump": lump}
    cases = paper_cases(base=make_case({"operation": {"duration": DURATION}, "solver": solver}))
    levels = {}
    for case, record in zip(cases, run_cases(cases, workers=workers)):
        table = record["gmf_rms"].sel(way="orders")
        levels[case.name] = {str(c): table.sel(component=c).values.tolist() for c in table.component.values}
    return levels


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m gearmbs.studies.paper.paper FILE")
    text = {
        "command": "python -m gearmbs.studies.paper.paper tests/studies/gmf_levels.json",
        "unit": "m/s^2",
        "levels": gmf_levels(),
    }
    write_whole(sys.argv[1], json.dumps(text, indent=1) + "\n")
