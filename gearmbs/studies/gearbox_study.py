"""The industrial gearbox, studied: modes, Campbell diagram, steady state and run-up, bearing forces, housing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Drivetrain, RunSettings
from gearmbs.progress import told_of_span
from gearmbs.studies.gearbox import SHAFTS, GearboxSettings, gearbox_choices, industrial_gearbox
from gearmbs.studies.store import write_dataset, write_text
from gearmbs.studies.train_modes import mesh_orders, train_modes
from gearmbs.studies.train_report import train_report
from gearmbs.studies.trains import run_train
from gearmbs.units import to_si

if TYPE_CHECKING:
    from gearmbs.dae.analyses.modes import Modes

HIGHEST = 2000.0
"""Modes up to this frequency are told, Hz."""
SETTLING = 0.3
"""Time from the load's coming on to the record, s: the clutches' modes have then lost all but a thousandth."""
HELD = 0.1
"""Share of the run-up at whose end the speed is held, so that windows of order tracking fit into the steady part."""
SLOWEST = 0.25
"""Speed at which the run-up begins, over the operating speed."""


@dataclass(frozen=True)
class GearboxStudy:
    """What was computed of the industrial gearbox.

    Attributes
    ----------
    train : Drivetrain
    modes : Modes
        Under load, see `gearmbs.studies.train_modes`.
    steady, run_up : Dataset
        Records at the operating speed and of a run-up to it, see `gearmbs.studies.run_train`.
    settings : GearboxSettings
    """

    train: Drivetrain
    modes: Modes
    steady: xr.Dataset
    run_up: xr.Dataset
    settings: GearboxSettings

    def campbell(self) -> xr.Dataset:
        """Return the Campbell diagram: modes under load, mesh harmonics, and where they meet."""
        from gearmbs.signals import campbell

        operating = float(self.train.drives[0].speed)
        found = campbell(self.modes, np.linspace(0.0, 1.2 * operating, 13), mesh_orders(self.train), maximum=HIGHEST)
        return found.assign_attrs(operating_speed=operating)

    def report(self) -> str:
        """Return the report in Markdown: modes, critical speeds, the steady state, the run-up, choices."""
        from gearmbs.signals.campbell import critical_speeds

        lines = [
            "# Industrial gearbox",
            "",
            "## Modes under load",
            "",
            "| mode | Hz | damping ratio |",
            "|---|---|---|",
        ]
        modes = self.modes.oscillating
        told = zip(self.modes.frequencies[modes], self.modes.damping_ratios[modes], strict=True)
        for k, (f, zeta) in enumerate((pair for pair in told if 0.1 < pair[0] < HIGHEST), 1):
            lines.append(f"| {k} | {f:.5g} | {zeta:.3g} |")
        lines += ["", "## Critical speeds of the motor, from half of the operating speed on", "",
                  "| rpm | Hz | mode | mesh harmonic |", "|---|---|---|---|"]  # fmt: skip
        found = critical_speeds(self.campbell())
        for row in found[found.speed_rpm > 0.5 * self.train.drives[0].speed * 30.0 / np.pi].itertuples():
            lines.append(f"| {row.speed_rpm:.5g} | {row.frequency_hz:.5g} | {row.mode} | {row.order} |")
        lines += ["", train_report(self.train, self.steady).replace("# industrial gearbox", "# Steady state", 1)]
        lines += [train_report(self.train, self.run_up).replace("# industrial gearbox", "# Run-up", 1)]
        lines += ["# Choices", "", "| what | chosen | why |", "|---|---|---|"]
        lines += [f"| {c.what} | {c.chosen} | {c.why} |" for c in gearbox_choices(self.settings)]
        return "\n".join(lines) + "\n"

    def figures(self) -> dict[str, Any]:
        """Return the Campbell diagram, and housing and bearings along the run-up, by name."""
        from gearmbs.view import campbell_plot
        from gearmbs.view.figure_style import look, new_figure

        tracks = self.run_up["mesh_track"]
        rpm = tracks["track_speed"].values * 30.0 / np.pi
        with look():
            figure = new_figure(8.0, 6.0)
            upper, lower = figure.subplots(2, 1, sharex=True)
            for mesh in self.train.meshes:
                for shaft in SHAFTS:
                    row = tracks.sel(mesh=mesh.name, harmonic=1)
                    label = f"{shaft} b, {mesh.name}"
                    upper.plot(rpm, row.sel(signal=f"housing at {shaft} b").values, label=label, lw=1.0)
                    lower.plot(rpm, row.sel(signal=f"{shaft} b y").values, label=label, lw=1.0)
            upper.set_ylabel("housing, 1st mesh harmonic,\nm/s² RMS")
            upper.legend(frameon=False, ncols=2)
            lower.set(ylabel="bearing force y,\nN RMS", xlabel="motor, rpm", yscale="log")
        return {"campbell": campbell_plot(self.campbell(), title="industrial gearbox"), "run_up": figure}

    def save(self, folder: str | Path) -> list[Path]:
        """Write records, report and figures to a folder; return the paths."""
        from gearmbs.view import save_figure

        folder = Path(folder)
        paths = [folder / "steady.nc", folder / "run_up.nc", folder / "report.md"]
        for path, record in zip(paths, (self.steady, self.run_up), strict=False):
            write_dataset(path, record)
        write_text(paths[2], self.report())
        for name, figure in self.figures().items():
            paths += save_figure(figure, folder / name)
        return paths


def run_gearbox(
    settings: GearboxSettings | None = None,
    *,
    duration: float = 1.0,
    run_up: float = 4.0,
    tolerance: float = 1e-6,
    progress: Callable[[str, float], None] | None = None,
) -> GearboxStudy:
    """Compute modes, steady state and a run-up of the industrial gearbox.

    Parameters
    ----------
    settings : GearboxSettings, optional
        Without ``curve``, at a prescribed speed.
    duration : float
        Of the record at the operating speed, s.
    run_up : float
        Time from a quarter of the operating speed to it, of which the last tenth holds it, s.
    tolerance : float
    progress : callable, optional
        Called with "steady" or "run-up" and the part of it that is done.

    Raises
    ------
    ValueError
        If the settings have a curve, or a motor whose speed is not prescribed.
    SimulationFailed
        If a run stops early.
    """
    s = settings or GearboxSettings()
    if s.curve is not None or s.motor != "speed":
        raise ValueError("settings: a run-up is added here; leave curve out, and motor 'speed'")
    train = industrial_gearbox(s)
    speed = to_si(s.speed, "angular speed", "speed")
    reached = SETTLING + (1.0 - HELD) * run_up
    points = ((SETTLING, SLOWEST * speed), (reached, speed), (SETTLING + run_up, speed))
    faster = industrial_gearbox(replace(s, curve=points))
    modes = train_modes(train)
    records = []
    for name, one, length in (("steady", train, duration), ("run-up", faster, run_up)):
        run = RunSettings(settling=SETTLING, duration=length, tolerance=tolerance)
        told = told_of_span(progress, name, one.run_up + run.settling + length)
        records.append(run_train(one, run, progress=told))
    return GearboxStudy(train, modes, records[0], records[1], s)
