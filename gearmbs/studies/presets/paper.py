"""The paper's study: its six cases simulated, their GMF harmonics in one dataset, tables, figures, and its report."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
import xarray as xr

from gearmbs._display import Shown, html_table
from gearmbs.dae.result import SolverStats
from gearmbs.files import write_whole
from gearmbs.schema.described import chosen
from gearmbs.signals import COMPONENTS, rms_factor
from gearmbs.signals.analysis.report import markdown_table
from gearmbs.studies.case.case import Case, CaseError, make_case
from gearmbs.studies.case.limits import check_record
from gearmbs.studies.presets.paper_cases import (
    DEFAULT_COMPONENT,
    LOAD_NAMES,
    LOADS,
    MISALIGNMENT,
    STATES,
    Claim,
    judge,
    paper_cases,
)
from gearmbs.studies.run.parallel import run_cases
from gearmbs.studies.run.record import flank_shares
from gearmbs.studies.run.store import save_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TARGET_RMS = 1.0
"""RMS, m/s^2, to which the healthy signal at low load is scaled; the paper's own value is not published."""

COSTS = ("mesh_cycles", "real_time_factor", "time_per_mesh_cycle")
"""What a record says of its cost beside the solver's statistics."""

WHY = {
    "speed": "puts three harmonics far below half the sampling rate",
    "penetration d of full damping": "ADAMS's default; 0.01 mm is stiffer and damps far more",
    "stiffness K": "the exponent is 1.3, so K is per mm^1.3; the printed N/mm^(3/2) contradicts it",
    "damping C": "the paper's C = 0.001 K, read as the number of K times 0.001",
    "normal backlash": "by thinning; the table's standard teeth have none, and no real pair runs without",
    "face width": "a usual ratio to the module",
    "gears": "steel discs of the pitch radius",
    "shafts": "solid steel cylinders",
    "misalignment": "in parallel planes (skew) about the middle of the driven face",
    "centre distance": "the paper's figure",
    "friction": "ADAMS's velocity law with usual coefficients of steel",
    "start": "STEP of speed and torque, then settling, then the record",
    "record": "as the paper's measurements were sampled",
    "which force": "the fixed joint between driven gear and shaft; every component is stored and judged",
    "mean": "removed before scaling; the band-pass removes it anyway",
    "scaling": "keeps states and loads comparable",
    "filter band": "neighbouring harmonics stay apart",
}


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

    def figures(self) -> dict[str, Figure]:
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
    for case in cases:
        check_record(case, bands=True)
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


# What the paper leaves open, and what a study chose for it, from the study's own cases.


@dataclass(frozen=True)
class Choice:
    """One thing the paper leaves open.

    Attributes
    ----------
    what : str
    chosen : str
        The study's value, with its unit.
    preset : str
        The preset's value.
    why : str
        Reason of the preset's value.
    """

    what: str
    chosen: str
    preset: str
    why: str

    @property
    def changed(self) -> bool:
        """Whether the study differs from the preset."""
        return self.chosen != self.preset


def choices(cases: list[Case], component: str) -> list[Choice]:
    """Return what a study of the six cases chose, beside the preset.

    Parameters
    ----------
    cases : list of Case
        As :func:`gearmbs.studies.presets.paper_cases.paper_cases` returns them.
    component : str
        Force component of the figures.
    """
    chosen, preset = _values(cases, component), _values(paper_cases(), DEFAULT_COMPONENT)
    return [Choice(what, chosen[what], preset[what], why) for what, why in WHY.items()]


def _values(cases: list[Case], component: str) -> dict[str, str]:
    case = cases[0]
    pair = case.pair()
    o, f, c, r, s = case.operation, case.fault, case.contact, case.friction, case.shafts
    tilts = [x.fault for x in cases if x.fault.misalignment]
    shifts = [x.fault.centre_distance_error for x in cases if x.fault.centre_distance_error]
    wheels = " and ".join(f"{w.mass:.4g} kg" for w in pair.wheels)
    tilt = "none"
    if tilts:
        pivot = f", pivot {1e3 * tilts[0].pivot:+.4g} mm along the axis" if tilts[0].pivot else ""
        tilt = f"{np.rad2deg(tilts[0].misalignment):.4g} degree, {tilts[0].plane}{pivot}"
    friction = "none"
    if r.enabled:
        friction = (
            f"{r.static:.4g} below {r.static_speed:.4g} m/s, {r.dynamic:.4g} above {r.dynamic_speed:.4g} m/s of sliding"
        )
    return {
        "speed": f"{o.top_speed * 30 / np.pi:.6g} rpm: GMF {case.mesh_frequency:.2f} Hz",
        "penetration d of full damping": f"{1e3 * c.depth:.4g} mm",
        "stiffness K": f"{c.stiffness}, exponent {c.exponent:g}",
        "damping C": str(c.damping),
        "normal backlash": f"{1e3 * f.backlash:.4g} mm",
        "face width": f"{1e3 * pair.narrower_face_width:.4g} mm",
        "gears": wheels,
        "shafts": f"diameter {2e3 * s.radius:.4g} mm, length {1e3 * s.length:.4g} mm",
        "misalignment": tilt,
        "centre distance": f"{1e3 * shifts[0]:+.4g} mm" if shifts else "nominal",
        "friction": friction,
        "start": f"over {o.run_up:.4g} s, settling {o.settling:.4g} s",
        "record": f"{o.duration:.4g} s at {case.signal_rate:.6g} Hz",
        "which force": component.replace("_", " "),
        "mean": "removed",
        "scaling": "one factor from the healthy signal at low load, kept for the other five",
        "filter band": "a quarter of the GMF to both sides of each harmonic, zero phase",
    }


class StudyTables(Protocol):
    """What the report needs of a study; :class:`gearmbs.studies.PaperStudy` has it."""

    @property
    def records(self) -> xr.Dataset:
        """All cases, over load and state."""

    @property
    def component(self) -> str:
        """The default component."""

    @property
    def cases(self) -> list[Case]:
        """The six cases."""

    def table(self, component: str | None = None, way: str = "band") -> xr.DataArray:
        """Scaled RMS of the harmonics."""

    def claims(self, component: str | None = None, way: str = "band") -> list[Claim]:
        """The three claims, judged."""


def paper_report(study: StudyTables) -> str:
    """Return the report of a study: verdicts, tables, settings, choices.

    Returns
    -------
    str
        Markdown.
    """
    sections = (_claims, _contact, _harmonics, _choices, _settings, _integration)
    return "\n".join(line for section in sections for line in section(study)) + "\n"


def _claims(study: StudyTables) -> list[str]:
    records = study.records
    gmf = float(records.frequency.sel(harmonic=1))
    torques = ", ".join(f"{float(t):g}" for t in records.torque.values)
    parts = [
        "# The paper's study: GMF harmonics of a gear pair",
        "",
        f"Six cases: healthy, misaligned by {np.rad2deg(_largest(records, 'fault_misalignment')):g} degree, centre "
        f"distance {1e3 * _largest(records, 'fault_centre_distance_error'):+g} mm; "
        f"{torques} N m. GMF {gmf:.2f} Hz. Acceleration of the driven gear from the force in its shaft joint, "
        f"scaled ({records.attrs['scaling']}).",
        "",
        "## The three claims",
        "",
        f"Default component: {_spaced(study.component)}.",
        "",
        verdict_table({_spaced(c): study.claims(str(c)) for c in records.component.values}),
    ]
    parts += ["", "Numbers for the default component:", ""]
    parts += [
        f"* {c.name}: **{'held' if c.held else 'not held'}** (held means: {c.rule}). {c.numbers}."
        for c in study.claims()
    ]
    held = "Held says that this model with these settings behaves as the paper reports; the settings matter, see below."
    return [*parts, "", held, ""]


def verdict_table(judged: Mapping[str, Sequence[Claim]]) -> str:
    """Return the verdicts on the claims in Markdown: a row a claim, a column for each by whom they were judged."""
    rows = [
        [of_one[0].name, *("held" if claim.held else "**not held**" for claim in of_one)]
        for of_one in zip(*judged.values(), strict=True)
    ]
    return markdown_table(["claim", *judged], rows)


def _contact(study: StudyTables) -> list[str]:
    return [
        "## Contact",
        "",
        "A driving pair carries the torque with its drive flanks. Two-flank contact braces the wheels: the forces of",
        "both flanks oppose each other, and their sum exceeds what the torque needs.",
        "",
        _contact_table(study),
        "",
    ]


def _harmonics(study: StudyTables) -> list[str]:
    parts = ["## RMS of the GMF harmonics", ""]
    for component in study.records.component.values:
        parts += [f"### {_spaced(component)}", "", _table(study, str(component)), ""]
    how = "Band: zero-phase band-pass about each harmonic. Orders: amplitudes over whole mesh periods. Scaled, m/s^2."
    return [*parts, how, ""]


def _choices(study: StudyTables) -> list[str]:
    rows = [
        [c.what, f"**{c.chosen}** (preset: {c.preset})" if c.changed else c.chosen, c.why]
        for c in choices(study.cases, study.component)
    ]
    return [
        "## What the paper left open, and what was chosen",
        "",
        markdown_table(["what the paper leaves open", "chosen here", "why"], rows),
        "",
        "The claims depend on these choices, most of all on backlash (two-flank contact under misalignment), on the",
        "penetration depth, the speed and the force component. `gearmbs paper` takes each as an option; the",
        "documentation has maps.",
        "",
    ]


def _settings(study: StudyTables) -> list[str]:
    skip = ("solver_healthy", "solver_misaligned", "solver_distance", "case_", "title", "scaling")
    attrs = study.records.attrs
    rows = [
        [key, f"{_value(value)} {attrs.get(f'{key}_units', '')}".rstrip()]
        for key, value in attrs.items()
        if not key.startswith(skip) and not key.endswith("_units")
    ]
    return ["## Settings", "", markdown_table(["parameter", "value"], rows), ""]


def _integration(study: StudyTables) -> list[str]:
    rows = []
    for case in study.cases:
        key = f"solver_{case.name.replace(', ', '_').replace(' ', '_')}"
        numbers = [study.records.attrs[f"{key}_{item}"] for item in ("steps", "residuals", "jacobians", "wall_time")]
        speed = study.records.attrs[f"{key}_real_time_factor"]
        cycle = 1e3 * study.records.attrs[f"{key}_time_per_mesh_cycle"]
        rows.append([case.name, *map(_value, numbers), f"{speed:.3g}", f"{cycle:.3g}"])
    header = ["case", "steps", "residuals", "Jacobians", "wall time s", "times real time", "ms a mesh cycle"]
    return ["## Integration", "", markdown_table(header, rows)]


def _table(study: StudyTables, component: str) -> str:
    rows = []
    band, orders = study.table(component, "band"), study.table(component, "orders")
    for load in band["load"].values:
        for state in band.state.values:
            values = [*band.sel(load=load, state=state).values, *orders.sel(load=load, state=state).values]
            rows.append([load, state, *(f"{v:.4g}" for v in values)])
    header = ["load", "state", *(f"{h} x {way}" for way in ("band", "orders") for h in (1, 2, 3))]
    return markdown_table(header, rows)


def _contact_table(study: StudyTables) -> str:
    """Mean sum of normal forces against torque over base radius, shares of the record in each kind of contact."""
    header = ["load", "state", "mean normal force, N", "torque / base radius, N", "both flanks, % of time",
              "no contact, %"]  # fmt: skip
    rows = []
    radius = study.cases[0].pair().wheels[1].base_radius
    for load in study.records["load"].values:
        for state in study.records["state"].values:
            one = study.records.sel(load=load, state=state)
            forces = float(one["normal_force"].mean()), float(one.torque) / radius
            rows.append([load, state, *(f"{v:.5g}" for v in forces), *flank_shares(one)])
    return markdown_table(header, rows)


def _largest(records: xr.Dataset, name: str) -> float:
    values = records[name].values
    return float(values[np.argmax(np.abs(values))])


def _spaced(name: object) -> str:
    return str(name).replace("_", " ")


def _value(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


# The stored table of GMF levels that guards the six cases: ``python -m gearmbs.studies.presets.paper FILE``.
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
        sys.exit("usage: python -m gearmbs.studies.presets.paper FILE")
    text = {
        "command": "python -m gearmbs.studies.presets.paper tests/studies/gmf_levels.json",
        "unit": "m/s^2",
        "levels": gmf_levels(),
    }
    write_whole(sys.argv[1], json.dumps(text, indent=1) + "\n")
