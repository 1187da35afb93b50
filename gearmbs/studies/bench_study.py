"""The paper's three claims judged on the bench, beside the pair's."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from gearmbs.drivetrain import RunSettings
from gearmbs.progress import told_of_span
from gearmbs.signals import convert
from gearmbs.signals.orders import harmonic_amplitudes
from gearmbs.signals.simulated import holds_speed
from gearmbs.studies.bench import PRESSURES, STATES, BenchSettings, bench_choices, bench_train
from gearmbs.studies.case import Case
from gearmbs.studies.claims import Claim, judge
from gearmbs.studies.paper import PaperStudy, run_paper
from gearmbs.studies.store import write_dataset, write_text
from gearmbs.studies.trains import run_train, train_signal

SENSORS = ("laser", "support")
LOW_BAND = 100.0
"""Hz; below, integration and differentiation of the laser's signal are cut off."""


@dataclass(frozen=True)
class BenchStudy:
    """Results of the bench's six runs, and of the pair's.

    Attributes
    ----------
    table : DataArray
        RMS of the acceleration at the first three mesh harmonics, dims (sensor, load, state, harmonic), m/s^2.
    records : dict of (str, str) to Dataset
        By load and state; see `gearmbs.studies.run_train`.
    settings : BenchSettings
    pair : PaperStudy or None
    """

    table: xr.DataArray
    records: dict[tuple[str, str], xr.Dataset]
    settings: BenchSettings
    pair: PaperStudy | None = None

    def claims(self, sensor: str) -> list[Claim]:
        """Judge the three claims by a sensor, "laser" or "support"."""
        return judge(self.table.sel(sensor=sensor), sensor)

    def judged(self) -> dict[str, list[Claim]]:
        """Return the three claims as the bench's sensors, and the pair if it was run, have them."""
        out = {f"bench, {name}": self.claims(name) for name in SENSORS}
        if self.pair is not None:
            out[f"pair, {self.pair.component.replace('_', ' ')}"] = self.pair.claims()
        return out

    def report(self) -> str:
        """Return the report in Markdown: verdicts of bench and pair side by side, tables, choices."""
        judged = self.judged()
        lines = ["# The test bench of Fig. 2", "", "## The three claims", "",
                 "| claim | " + " | ".join(judged) + " |", "|---|" + "---|" * len(judged)]  # fmt: skip
        for k, claim in enumerate(next(iter(judged.values()))):
            row = " | ".join("held" if claims[k].held else "**not held**" for claims in judged.values())
            lines.append(f"| {claim.name} | {row} |")
        for name, claims in judged.items():
            lines += ["", f"{name}:", ""]
            lines += [f"* {c.name}: **{'held' if c.held else 'not held'}** ({c.rule}). {c.numbers}." for c in claims]
        lines += ["", "## RMS of the mesh harmonics, m/s^2", "", "| sensor | load | state | 1 x | 2 x | 3 x |",
                  "|---|---|---|---|---|---|"]  # fmt: skip
        for sensor in SENSORS:
            for load in PRESSURES:
                for state in STATES:
                    levels_of = self.table.sel(sensor=sensor, load=load, state=state).values
                    lines.append(f"| {sensor} | {load} | {state} | " + " | ".join(f"{v:.4g}" for v in levels_of) + " |")
        lines += ["", "## Meshes", "", "| load | state | mesh | mean normal force, N | both flanks, % of time |",
                  "|---|---|---|---|---|"]  # fmt: skip
        for (load, state), record in self.records.items():
            for mesh in record.mesh.values:
                one = record.sel(mesh=mesh)
                both = 100 * np.mean((one.pairs_drive.values > 0) & (one.pairs_back.values > 0))
                lines.append(f"| {load} | {state} | {mesh} | {float(one.normal_force.mean()):.5g} | {both:.3g} |")
        lines += ["", "## Choices", "", "| what | chosen | why |", "|---|---|---|"]
        lines += [f"| {c.what} | {c.chosen} | {c.why} |" for c in bench_choices(self.settings)]
        return "\n".join(lines) + "\n"

    def figure(self, load: str):
        """Return the bars of both sensors, and of the pair, at a load: a panel each."""
        from gearmbs.view import gmf_bars
        from gearmbs.view.figure_style import look, new_figure

        panels = [(f"bench, {name}", self.table.sel(sensor=name, load=load)) for name in SENSORS]
        if self.pair is not None:
            panels.append(("pair, scaled", self.pair.table().sel(load=load)))
        with look():
            figure = new_figure(4.6 * len(panels), 4.2)
            axes = figure.subplots(1, len(panels))
            for ax, (title, table) in zip(np.atleast_1d(axes), panels, strict=True):
                gmf_bars(
                    table.drop_vars(["sensor"], errors="ignore"), title=f"{title}, {load} load", ax=ax, values=False
                )
        return figure

    def verdict_figure(self):
        """Return the verdicts on the three claims with their numbers: a row a claim, a column a place of judgement."""
        from textwrap import fill

        from matplotlib.patches import Rectangle

        from gearmbs.view.figure_style import look, new_figure

        judged = self.judged()
        with look():
            figure = new_figure(3.4 * len(judged) + 2.0, 4.6)
            ax = figure.subplots()
            for column, claims in enumerate(judged.values()):
                for row, claim in enumerate(claims):
                    word, colour = ("held", "#d5e8d4") if claim.held else ("not held", "#f8cecc")
                    ax.add_patch(Rectangle((column, row), 1.0, 1.0, facecolor=colour, edgecolor="white", lw=3.0))
                    ax.text(column + 0.5, row + 0.2, word, ha="center", va="center", fontweight="bold")
                    ax.text(column + 0.5, row + 0.62, fill(claim.numbers, 44), ha="center", va="center", fontsize=7)
            names = [fill(claim.name, 22) for claim in next(iter(judged.values()))]
            ax.set(xlim=(0, len(judged)), ylim=(len(names), 0))
            ax.set_xticks(np.arange(len(judged)) + 0.5, list(judged))
            ax.set_yticks(np.arange(len(names)) + 0.5, names)
            ax.xaxis.tick_top()
            ax.tick_params(length=0)
            ax.grid(visible=False)
            for spine in ax.spines.values():
                spine.set_visible(False)
        return figure

    def save(self, folder: str | Path) -> list[Path]:
        """Write records, table, figures and report to a folder; return the paths."""
        from gearmbs.view import save_figure

        folder = Path(folder)
        paths = []
        for (load, state), record in self.records.items():
            path = folder / "records" / f"{load}_{state}.nc"
            write_dataset(path, record)
            paths.append(path)
        write_dataset(folder / "bench.nc", self.table.to_dataset(name="gmf_rms"))
        write_text(folder / "report.md", self.report())
        paths += [folder / "bench.nc", folder / "report.md"]
        for load in PRESSURES:
            paths += save_figure(self.figure(load), folder / f"{load}_load")
        return [*paths, *save_figure(self.verdict_figure(), folder / "verdicts")]


def run_bench(
    settings: BenchSettings | None = None,
    run: RunSettings | None = None,
    *,
    pair: bool = True,
    workers: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> BenchStudy:
    """Simulate the bench in its three states at 1 and 5 MPa, and the pair of the paper's model beside it.

    Parameters
    ----------
    settings : BenchSettings, optional
    run : RunSettings, optional
        Default: 0.2 s of settling, 1 s of record.
    pair : bool
        Whether to run the pair's study, too, with a record of the same length.
    workers : int, optional
        Of the pair's study.
    progress : callable, optional
        Called with the name of a run and the part of it that is done.

    Raises
    ------
    SimulationFailed
        If a run stops early.
    """
    settings = settings or BenchSettings()
    if settings.bearings == "ideal":
        raise ValueError("bearings is 'ideal': a laser sees nothing move in rigid bearings; give 'elastic'")
    run = run or RunSettings(settling=0.2, duration=1.0)
    records: dict[tuple[str, str], xr.Dataset] = {}
    for load, pressure in PRESSURES.items():
        for state in STATES:
            train = bench_train(pressure, state, settings)
            name = f"bench, {state}, {load} load"
            told = told_of_span(progress, name, train.run_up + run.settling + run.duration)
            with warnings.catch_warnings():
                # the paper's law over-damps the meshes; the choices and the report say so
                warnings.filterwarnings("ignore", r"mesh '.*' is damped .* times critically")
                records[load, state] = run_train(train, run, progress=told)
    rows = [[[levels(records[load, state], sensor) for state in STATES] for load in PRESSURES] for sensor in SENSORS]
    table = xr.DataArray(
        np.array(rows), dims=("sensor", "load", "state", "harmonic"),
        coords={"sensor": list(SENSORS), "load": list(PRESSURES), "state": list(STATES), "harmonic": [1, 2, 3]},
        attrs={"units": "m/s^2", "long_name": "RMS of the gear mesh frequency harmonics"},
    )  # fmt: skip
    beside = None
    if pair:
        base = Case(
            operation={"duration": run.duration, "speed": settings.speed}, fault={"backlash": settings.backlash}
        )
        beside = run_paper(base, workers=workers, progress=progress)
    return BenchStudy(table, records, settings, beside)


def levels(record: xr.Dataset, sensor: str, harmonics: int = 3) -> np.ndarray:
    """Return the RMS of a sensor's acceleration at the mesh harmonics, m/s^2, at the mean speed of the record.

    NaN where that speed is not steady. A velocity is differentiated to acceleration as a laser's is, in a band from
    `LOW_BAND` on.
    """
    if not holds_speed(record):
        return np.full(harmonics, np.nan)
    signal = train_signal(record, sensor, "pair 1")
    rate = float(record.attrs["run_rate"])
    if str(record.sensor_units.sel(sensor=sensor).item()) == "m/s":
        signal = convert(signal, "acceleration", band=(LOW_BAND, 0.45 * rate))
    frequency = float(record["mesh_rms"].mesh_frequency.sel(mesh="pair 1"))
    orders = np.arange(1, harmonics + 1)
    return np.abs(harmonic_amplitudes(signal.values, rate, frequency, orders))[:, 0] / np.sqrt(2.0)
