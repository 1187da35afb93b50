"""The report of the paper's study, in Markdown."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import xarray as xr

from gearmbs.studies.case import Case
from gearmbs.studies.choices import choices
from gearmbs.studies.claims import Claim


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
        f"Default component: {_plain(study.component)}.",
        "",
        "| claim | " + " | ".join(_plain(c) for c in records.component.values) + " |",
        "|---|" + "---|" * records.sizes["component"],
    ]
    verdicts = {str(c): study.claims(str(c)) for c in records.component.values}
    for k, claim in enumerate(study.claims()):
        row = " | ".join("held" if verdicts[str(c)][k].held else "**not held**" for c in records.component.values)
        parts.append(f"| {claim.name} | {row} |")
    parts += ["", "Numbers for the default component:", ""]
    parts += [
        f"* {c.name}: **{'held' if c.held else 'not held'}** (held means: {c.rule}). {c.numbers}."
        for c in study.claims()
    ]
    held = "Held says that this model with these settings behaves as the paper reports; the settings matter, see below."
    return [*parts, "", held, ""]


def _contact(study: StudyTables) -> list[str]:
    return [
        "## Contact",
        "",
        "A driving pair carries the torque with its drive flanks. Two-flank contact braces the wheels: the forces of",
        "both flanks oppose each other, and their sum exceeds what the torque needs.",
        "",
        *_contact_table(study),
        "",
    ]


def _harmonics(study: StudyTables) -> list[str]:
    parts = ["## RMS of the GMF harmonics", ""]
    for component in study.records.component.values:
        parts += [f"### {_plain(component)}", "", *_table(study, str(component)), ""]
    how = "Band: zero-phase band-pass about each harmonic. Orders: amplitudes over whole mesh periods. Scaled, m/s^2."
    return [*parts, how, ""]


def _choices(study: StudyTables) -> list[str]:
    parts = [
        "## What the paper left open, and what was chosen",
        "",
        "| what the paper leaves open | chosen here | why |",
        "|---|---|---|",
    ]
    for c in choices(study.cases, study.component):
        chosen = f"**{c.chosen}** (preset: {c.preset})" if c.changed else c.chosen
        parts.append(f"| {c.what} | {chosen} | {c.why} |")
    return [
        *parts,
        "",
        "The claims depend on these choices, most of all on backlash (two-flank contact under misalignment), on the",
        "penetration depth, the speed and the force component. `gearmbs paper` takes each as an option; the",
        "documentation has maps.",
        "",
    ]


def _settings(study: StudyTables) -> list[str]:
    parts = ["## Settings", "", "| parameter | value |", "|---|---|"]
    skip = ("solver_healthy", "solver_misaligned", "solver_distance", "case_", "title", "scaling")
    attrs = study.records.attrs
    for key, value in attrs.items():
        if not key.startswith(skip) and not key.endswith("_units"):
            parts.append(f"| {key} | {_value(value)} {attrs.get(f'{key}_units', '')}".rstrip() + " |")
    return [*parts, ""]


def _integration(study: StudyTables) -> list[str]:
    parts = [
        "## Integration",
        "",
        "| case | steps | residuals | Jacobians | wall time s | times real time | ms a mesh cycle |",
        "|---|---|---|---|---|---|---|",
    ]
    for case in study.cases:
        key = f"solver_{case.name.replace(', ', '_').replace(' ', '_')}"
        numbers = [study.records.attrs[f"{key}_{item}"] for item in ("steps", "residuals", "jacobians", "wall_time")]
        speed = study.records.attrs[f"{key}_real_time_factor"]
        cycle = 1e3 * study.records.attrs[f"{key}_time_per_mesh_cycle"]
        row = " | ".join(_value(v) for v in numbers)
        parts.append(f"| {case.name} | {row} | {speed:.3g} | {cycle:.3g} |")
    return parts


def _table(study: StudyTables, component: str) -> list[str]:
    lines = ["| load | state | 1 x band | 2 x band | 3 x band | 1 x orders | 2 x orders | 3 x orders |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    band, orders = study.table(component, "band"), study.table(component, "orders")
    for load in band["load"].values:
        for state in band.state.values:
            values = [*band.sel(load=load, state=state).values, *orders.sel(load=load, state=state).values]
            lines.append(f"| {load} | {state} | " + " | ".join(f"{v:.4g}" for v in values) + " |")
    return lines


def _contact_table(study: StudyTables) -> list[str]:
    """Mean sum of normal forces against torque over base radius, shares of the record in each kind of contact."""
    lines = [
        "| load | state | mean normal force, N | torque / base radius, N | both flanks, % of time | no contact, % |",
        "|---|---|---|---|---|---|",
    ]
    radius = study.cases[0].pair().wheels[1].base_radius
    for load in study.records["load"].values:
        for state in study.records["state"].values:
            one = study.records.sel(load=load, state=state)
            drive, back = one["pairs_drive"].values > 0, one["pairs_back"].values > 0
            lines.append(
                f"| {load} | {state} | {float(one['normal_force'].mean()):.5g} | {float(one.torque) / radius:.5g} "
                f"| {100.0 * (drive & back).mean():.3g} | {100.0 * (~drive & ~back).mean():.3g} |"
            )
    return lines


def _largest(records: xr.Dataset, name: str) -> float:
    values = records[name].values
    return float(values[np.argmax(np.abs(values))])


def _plain(name: object) -> str:
    return str(name).replace("_", " ")


def _value(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
