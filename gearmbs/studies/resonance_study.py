"""The study of a mesh resonance: sweeps up and down by both models, their jumps, and the load at which teeth part."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from gearmbs.progress import told_of_span
from gearmbs.studies.resonance import (
    DIRECTIONS,
    MODELS,
    ResonanceSettings,
    chirp,
    jump_frequency,
    sweep_resonance,
)
from gearmbs.units import Quantity, to_si

LOADS = (1.0, 1000.0)
"""Between these a study looks for the load of separation, N m."""
AROUND = (0.6, 1.5)
"""Where the multibody model's is looked for, over that of the model of one degree of freedom."""


class SeparationLoad(NamedTuple):
    """The load at which teeth begin, or cease, to part near resonance.

    Attributes
    ----------
    torque : float
        N m.
    parted_above : bool
        Whether they part above it; else below.
    """

    torque: float
    parted_above: bool

    def __str__(self) -> str:
        side, other = ("above", "below") if self.parted_above else ("below", "above")
        return f"teeth part {side} {self.torque:.4g} N m, none {other}"


def lowest_lag(settings: ResonanceSettings, torque: Quantity, model: str = MODELS[1]) -> float:
    """Return the lowest lag of a sweep up through the natural frequency under another load, m; negative: teeth part."""
    span = (min(settings.span[0], 0.9), max(settings.span[1], 1.1))
    loaded = replace(settings, torque=torque, span=span)
    return float(sweep_resonance(loaded, "up", model)["lowest"].min())


def separation_load(
    settings: ResonanceSettings | None = None,
    between: tuple[Quantity, Quantity] = LOADS,
    *,
    steps: int = 12,
    model: str = MODELS[1],
) -> SeparationLoad | None:
    """Return the load at which separation begins or ceases, by bisection.

    Until teeth part, the equation is linear in x and so is every amplitude in the load: only what the load changes of
    the stiffness curve makes a threshold. Deflection prolongs the contact of each pair of teeth. Where that raises the
    excitation, as with a contact ratio of a whole number, teeth do not part below a load; where it lowers it, not above
    one.

    Parameters
    ----------
    settings : ResonanceSettings, optional
    between : tuple of float or str
        Two loads, N m, at one of which teeth part and at the other not.
    steps : int
        Halvings of the ratio of the two.
    model : {"one degree", "multibody"}

    Returns
    -------
    SeparationLoad or None
        None if teeth part at both loads, or at neither.
    """
    s = settings or ResonanceSettings()
    low, high = (to_si(torque, "torque", "between") for torque in between)
    parted = [lowest_lag(s, torque, model) < 0.0 for torque in (low, high)]
    if parted[0] == parted[1]:
        return None
    for _ in range(steps):
        middle = math.sqrt(low * high)
        if (lowest_lag(s, middle, model) < 0.0) == parted[0]:
            low = middle
        else:
            high = middle
    return SeparationLoad(math.sqrt(low * high), parted[1])


def separation_loads(settings: ResonanceSettings) -> dict[str, SeparationLoad | None]:
    """Return the load of separation of both models, that of the multibody one to 0.7 %; None where there is none."""
    whole, classical = MODELS
    found = separation_load(settings)
    if found is None:
        return {classical: None}
    low, high = (factor * found.torque for factor in AROUND)
    return {classical: found, whole: separation_load(settings, (low, high), steps=7, model=whole)}


@dataclass(frozen=True)
class ResonanceStudy:
    """Sweeps up and down by both models.

    Attributes
    ----------
    settings : ResonanceSettings
    sweeps : dict of (str, str) to Dataset
        By model and direction; see `sweep_resonance`.
    thresholds : dict of str to (SeparationLoad or None)
        By model; see `separation_loads`.
    """

    settings: ResonanceSettings
    sweeps: dict[tuple[str, str], xr.Dataset]
    thresholds: dict[str, SeparationLoad | None] = field(default_factory=dict)

    def jumps(self) -> dict[str, dict[str, float]]:
        """Return the mesh frequencies at which amplitudes jump, Hz, by model and direction."""
        return {m: {d: jump_frequency(self.sweeps[m, d]) for d in DIRECTIONS} for m in MODELS}

    def report(self) -> str:
        """Return the report in Markdown: jumps of both models, their difference, the load of separation."""
        s, jumps = self.settings, self.jumps()
        lines = [
            "# Mesh resonance", "",
            f"{s.teeth}/{s.teeth} teeth, contact ratio {s.pair.contact_ratio:.4g}, {s.torque:g} N m, damping ratio "
            f"{s.damping_ratio:g}, natural frequency {s.frequency:.5g} Hz.", "",
            "| sweep | multibody, Hz | one degree, Hz | difference, % | lowest lag, um |", "|---|---|---|---|---|",
        ]  # fmt: skip
        for d in DIRECTIONS:
            whole, classical = (jumps[m][d] for m in MODELS)
            lowest = 1e6 * float(self.sweeps[MODELS[0], d]["lowest"].min())
            cells = [f"{whole:.5g}", f"{classical:.5g}", f"{100.0 * (whole / classical - 1.0):+.2f}", f"{lowest:.3g}"]
            lines.append(
                f"| {d} | " + " | ".join(cell.replace("+nan", "-").replace("nan", "no jump") for cell in cells) + " |"
            )
        return "\n".join(lines) + "\n" + self.thresholds_text()

    def thresholds_text(self) -> str:
        """Return the load of separation of each model, a paragraph each."""
        none = f"no load from {LOADS[0]:g} to {LOADS[1]:g} N m at which teeth begin or cease to part"
        return "".join(f"\n{model.capitalize()}: {found or none}.\n" for model, found in self.thresholds.items())

    def figure(self) -> Any:
        """Return amplitude over mesh frequency of both models in both directions, and the lowest lag below it."""
        from gearmbs.view.figure_style import look, new_figure

        with look():
            figure = new_figure(7.0, 6.0)
            upper, lower = figure.subplots(2, 1, sharex=True)
            for (model, direction), sweep in self.sweeps.items():
                f = sweep["frequency"].values / self.settings.frequency
                style: dict[str, Any] = {"lw": 2.0 if model == MODELS[0] else 0.9, "label": f"{model}, {direction}",
                                         "ls": "-" if direction == "up" else "--"}  # fmt: skip
                upper.plot(f, 1e6 * sweep["rms"].values, **style)
                lower.plot(f, 1e6 * sweep["lowest"].values, **style)
            upper.set_ylabel("RMS of the lag, µm")
            upper.legend(frameon=False)
            lower.axhline(0.0, color="0.5", lw=0.8)
            lower.set(ylabel="lowest lag, µm", xlabel="mesh frequency over natural frequency")
        return figure

    def save(self, folder: str | Path) -> list[Path]:
        """Write the sweeps, the report and the figure to a folder; return the paths."""
        from gearmbs.studies.store import write_dataset, write_text
        from gearmbs.view import save_figure

        folder = Path(folder)
        paths = [folder / f"{model.replace(' ', '_')}_{direction}.nc" for model, direction in self.sweeps]
        for path, sweep in zip(paths, self.sweeps.values(), strict=True):
            write_dataset(path, sweep)
        write_text(folder / "report.md", self.report())
        return [*paths, folder / "report.md", *save_figure(self.figure(), folder / "resonance")]


def run_resonance(
    settings: ResonanceSettings | None = None, *, progress: Callable[[str, float], None] | None = None
) -> ResonanceStudy:
    """Sweep a pair up and down through its mesh resonance, by the multibody and by the classical model.

    Parameters
    ----------
    settings : ResonanceSettings, optional
    progress : callable, optional
        Called with "up" or "down" and the part of that multibody sweep that is done.
    """
    s = settings or ResonanceSettings()
    sweeps: dict[tuple[str, str], xr.Dataset] = {}
    for direction in DIRECTIONS:
        told = told_of_span(progress, direction, chirp(s, direction).duration)
        sweeps[MODELS[0], direction] = sweep_resonance(s, direction, MODELS[0], progress=told)
        sweeps[MODELS[1], direction] = sweep_resonance(s, direction, MODELS[1])
    return ResonanceStudy(s, sweeps, separation_loads(s))
