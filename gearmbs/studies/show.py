"""Cases and studies as tables and figures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from gearmbs._display import html_table
from gearmbs.studies.case.section import Section
from gearmbs.studies.case.texts import readable
from gearmbs.view import mesh_view
from gearmbs.view.figures.style import BLUE, ORANGE, VERMILLION, look, new_figure

if TYPE_CHECKING:
    from gearmbs.studies.case.case import Case
    from gearmbs.studies.presets.paper import PaperStudy
    from gearmbs.studies.run.sweep import Sweep


def case_html(case: Case) -> str:
    """Return the settings of a case as a table, quantities as the user gave them, others in usual units."""
    rows = []
    for name in type(case).model_fields:
        section = getattr(case, name)
        if not isinstance(section, Section):
            continue
        for key in type(section).model_fields:
            if name == "fault" and key == "teeth":
                continue
            origin = "" if key in section.model_fields_set else "default"
            rows.append((name, key.replace("_", " "), readable(section, key), origin))
        if name == "fault":
            for fault in case.fault.teeth:
                settings = ", ".join(f"{k} {v}" for k, v in fault.items() if k != "kind" and v is not None)
                rows.append((name, "tooth fault", f"{fault['kind']}: {settings}", ""))
    note = (
        f"Mesh frequency {case.mesh_frequency:.6g} Hz; signals at {case.signal_rate:g} Hz, forces and contact at "
        f"{case.output_rate:g} Hz."
    )
    return html_table(f"Case {case.name}", ("", "setting", "value", ""), rows, note)


def case_plot(case: Case, *, title: str | None = None) -> Figure:
    """Draw the teeth of a case in mesh, and its speed and torque over time.

    Parameters
    ----------
    case : Case
    title : str, optional
    """
    operation = case.operation
    start = operation.run_up + operation.settling
    with look():
        figure = new_figure(9.6, 5.4)
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        mesh_view(case.pair(), ax=left, title=title or f"{case.name}: the mesh under load")
        t = np.linspace(0.0, start + operation.longest, 601)
        right.plot(t, _speed(case, t), color=BLUE, label="speed of the driver, rpm")
        right.set_ylabel("speed, rpm", color=BLUE)
        right.set_ylim(bottom=0.0)
        other = right.twinx()
        other.plot(t, _torque(case, t), color=ORANGE)
        other.set_ylabel("torque, N m", color=ORANGE)
        other.set_ylim(bottom=0.0)
        other.grid(False)
        other.spines["right"].set_visible(True)
        right.axvspan(start, start + operation.longest, color="#EEF1F5", zorder=0)
        right.annotate(
            "record",
            (start + 0.5 * operation.longest, 0.03),
            xycoords=("data", "axes fraction"),
            ha="center",
            fontsize=9,
        )
        right.set_xlabel("time, s")
        right.set_title("Speed and torque")
        right.margins(x=0)
    return figure


def _speed(case: Case, t: np.ndarray) -> np.ndarray:
    return np.array([case.driver_angle.derivatives(at)[1] for at in t]) * 30.0 / math.pi


def _torque(case: Case, t: np.ndarray) -> np.ndarray:
    from gearmbs.studies.case.drive import load_torque

    o = case.operation
    load = load_torque(o.torque, o.run_up, o.run_up + o.settling)
    return np.array([load(at) for at in t])


def study_plot(study: PaperStudy, load: str = "low", *, title: str | None = None) -> Figure:
    """Draw the levels of the mesh harmonics of a study at one of its loads, as the paper does."""
    from gearmbs.view import gmf_bars

    torque = float(study.records.torque.sel(load=load))
    return gmf_bars(
        study.table().sel(load=load),
        title=title
        or f"Model, {load} load ({torque:g} N m): RMS of the GMF harmonics, {study.component.replace('_', ' ')}",
    )


def sweep_plot(sweep: Sweep, component: str | None = None, **options: Any) -> Figure:
    """Draw a sweep: over speeds a waterfall of spectra, over other settings the levels of the mesh harmonics."""
    if sweep.field == "operation.speed":
        return waterfall_of(sweep, component, **options)
    table = sweep.table(component)
    with look():
        figure = new_figure(7.2, 4.2)
        ax = figure.subplots()
        for k, colour in zip((1, 2, 3), (BLUE, ORANGE, VERMILLION), strict=True):
            x, levels = table.index.to_numpy(), table[f"{k} x GMF"].to_numpy()
            ax.plot(x, levels, "o-", color=colour, label=f"{k} × GMF")
            if f"{k} x GMF +/-" in table:
                ax.errorbar(x, levels, table[f"{k} x GMF +/-"].to_numpy(), fmt="none", ecolor=colour, capsize=3.0)
        ax.set_xlabel(f"{sweep.field.rpartition('.')[2].replace('_', ' ')}, {sweep.unit}")
        ax.set_ylabel(f"RMS by {table['way'].iloc[0]}, m/s²")
        ax.set_title(options.get("title") or f"{sweep.case.name}: mesh harmonics, {sweep.component(component)}")
        ax.legend()
    return figure


def waterfall_of(sweep: Sweep, component: str | None = None, **options: Any) -> Figure:
    """Draw the spectra of a sweep over speeds, one behind the other."""
    from gearmbs.view import waterfall_plot

    title = options.pop("title", f"{sweep.case.name}: {sweep.component(component).replace('_', ' ')}")
    teeth = sweep.case.gears.teeth[0]
    return waterfall_plot(sweep.waterfall(component), orders=(teeth, 2 * teeth, 3 * teeth), title=title, **options)
