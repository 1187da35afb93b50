"""How the paper's three claims depend on what the paper left open: data and maps.

``python docs/scripts/sensitivity.py`` simulates the grid and writes ``docs/data/sensitivity.csv``; points already in
the file are kept, so that an interrupted run goes on where it stopped. The documentation reads that file and draws the
maps with :func:`claim_maps`.
"""

from __future__ import annotations

import argparse
import csv
import io
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

from gearmbs.signals import COMPONENTS
from gearmbs.studies import Case, SimulationFailed, make_case, run_cases
from gearmbs.studies.claims import MUCH
from gearmbs.studies.store import write_text
from gearmbs.view.figure_style import new_figure

DATA = Path(__file__).parent.parent / "data" / "sensitivity.csv"
DEPTHS = (0.01, 0.03, 0.1, 0.3, 1.0)
BACKLASHES = (0.05, 0.1, 0.2, 0.4)
SPEEDS = (300, 1000, 2000, 3000)
FRICTIONS = (0.0, 0.1, 0.2)
PRESET = {"depth_mm": 0.1, "backlash_mm": 0.1, "speed_rpm": 1000, "friction": 0.1}
TORQUES = {"low": 100.0, "high": 200.0}
STATES = {
    "healthy": {},
    "skew": {"misalignment": "1 deg", "plane": "skew"},
    "inclination": {"misalignment": "1 deg", "plane": "inclination"},
    "distance": {"centre_distance_error": "3 mm"},
}
SETTINGS = tuple(PRESET)
COLUMNS = (*SETTINGS, "state", "load", "component", "h1", "h2", "h3")
MESH_PERIODS = 40
"""Least length of a record, for the band-pass filters."""
CLAIMS = (
    "misaligned (skew) / healthy, 2 x GMF",
    "misaligned (inclination) / healthy, 2 x GMF",
    "+3 mm / healthy, least of 1-3 x GMF",
    "high / low load, least of all states and harmonics",
    "high / low load, harmonics together, least of the states",
)
"""Least ratio over both loads; the claim holds where it reaches the number of :data:`LEAST`."""

LEAST = (1.0, 1.0, 1.0, MUCH, MUCH)


def grid() -> list[dict[str, float]]:
    """Return the points: depth with backlash, depth with speed, depth with friction, about the preset."""
    points = [PRESET | {"depth_mm": d, "backlash_mm": b} for d in DEPTHS for b in BACKLASHES]
    points += [PRESET | {"depth_mm": d, "speed_rpm": n} for d in DEPTHS for n in SPEEDS]
    points += [PRESET | {"depth_mm": d, "friction": f} for d in DEPTHS[::2] for f in FRICTIONS]
    return [dict(p) for p in dict.fromkeys(tuple(point.items()) for point in points)]


def point_cases(point: dict[str, float]) -> list[Case]:
    """Return the eight cases of a point: four states at two loads."""
    mesh_frequency = 29 * point["speed_rpm"] / 60
    cases = []
    for load, torque in TORQUES.items():
        for state, fault in STATES.items():
            data = {
                "name": f"{state}, {load}",
                "operation": {
                    "speed": f"{point['speed_rpm']} rpm",
                    "torque": torque,
                    "run_up": 0.03,
                    "settling": 0.03,
                    "duration": max(0.1, MESH_PERIODS / mesh_frequency),
                },
                "fault": {**fault, "backlash": f"{point['backlash_mm']} mm"},
                "contact": {"depth": f"{point['depth_mm']} mm"},
                "solver": {"output_rate": 25600},
            }
            if point["friction"] > 0.0:
                data["friction"] = {"static": point["friction"], "dynamic": 0.5 * point["friction"]}
            else:
                data["friction"] = {"enabled": False}
            cases.append(make_case(data))
    return cases


def simulate_point(point: dict[str, float], workers: int) -> list[dict[str, object]]:
    """Return the rows of a point: RMS of the harmonics by orders, m/s^2."""
    cases = point_cases(point)
    try:
        records = run_cases(cases, workers=workers)
    except SimulationFailed as failure:
        print(f"left out: {failure}")
        return []
    rows = []
    for case, record in zip(cases, records):
        state, load = case.name.split(", ")
        for component in COMPONENTS:
            levels = record["gmf_rms"].sel(way="orders", component=component).values
            values = {f"h{k + 1}": f"{level:.5g}" for k, level in enumerate(levels)}
            rows.append({**point, "state": state, "load": load, "component": component, **values})
    return rows


def run(path: Path = DATA, workers: int = 1) -> None:
    """Simulate the points that are not in ``path`` yet and write them there."""
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    known = {tuple(float(row[name]) for name in SETTINGS) for row in rows}
    for point in grid():
        if tuple(float(value) for value in point.values()) in known:
            continue
        print(point, flush=True)
        rows += simulate_point(point, workers)
        text = io.StringIO()
        writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        write_text(path, text.getvalue())


def load(path: Path = DATA) -> pd.DataFrame:
    """Return the data, one row a point, state, load and component."""
    return pd.read_csv(path)


def claim_ratios(data: pd.DataFrame, component: str = "line_of_action") -> pd.DataFrame:
    """Return for each point the ratios that decide the claims, as :data:`CLAIMS` names them."""
    chosen = data[data.component == component].set_index([*SETTINGS, "state", "load"])[["h1", "h2", "h3"]]
    table = chosen.unstack("load").stack("load", future_stack=True).unstack("state")
    per_load = pd.DataFrame(
        {
            CLAIMS[0]: table["h2"]["skew"] / table["h2"]["healthy"],
            CLAIMS[1]: table["h2"]["inclination"] / table["h2"]["healthy"],
            CLAIMS[2]: pd.concat([table[h]["distance"] / table[h]["healthy"] for h in ("h1", "h2", "h3")], axis=1).min(
                axis=1
            ),
        }
    )
    out = per_load.groupby(level=list(SETTINGS)).min()
    loads = chosen.unstack("load")
    ratio = pd.concat([loads[h]["high"] / loads[h]["low"] for h in ("h1", "h2", "h3")], axis=1).min(axis=1)
    out[CLAIMS[3]] = ratio.groupby(level=list(SETTINGS)).min()
    together = np.sqrt((chosen**2).sum(axis=1)).unstack("load")
    out[CLAIMS[4]] = (together["high"] / together["low"]).groupby(level=list(SETTINGS)).min()
    return out


def claim_maps(ratios: pd.DataFrame, across: str, label: str) -> Figure:
    """Draw the ratios over penetration depth and one other setting, the rest at the preset.

    Parameters
    ----------
    ratios : DataFrame
        From :func:`claim_ratios`.
    across : str
        Setting of the vertical axis.
    label : str
        Its axis label with unit.
    """
    rest = [name for name in SETTINGS if name not in ("depth_mm", across)]
    table = ratios.reset_index()
    for name in rest:
        table = table[np.isclose(table[name], PRESET[name])]
    figure = new_figure(9.0, 9.2)
    axes = list(figure.subplots(3, 2).flat)
    for ax in axes[len(CLAIMS) :]:
        ax.set_visible(False)
    for ax, claim in zip(axes, CLAIMS):
        grid_values = table.pivot(index=across, columns="depth_mm", values=claim)
        grid_values = grid_values.dropna(axis=1, how="any")
        logs = np.log10(grid_values.values)
        span = max(0.3, float(np.nanmax(np.abs(logs))))
        ax.pcolormesh(logs, cmap="PuOr_r", norm=TwoSlopeNorm(0.0, -span, span), edgecolors="white", linewidth=1.5)
        for (row, column), value in np.ndenumerate(grid_values.values):
            if np.isfinite(value):
                dark = abs(np.log10(value)) > 0.6 * span
                text = f"{value:.2g}" if value < 100 else f"{value:.0f}"
                weight = "normal" if value > 1.0 else "bold"
                colour = "white" if dark else "black"
                ax.text(column + 0.5, row + 0.5, text, ha="center", va="center", color=colour, weight=weight)
        ax.set_xticks(np.arange(grid_values.shape[1]) + 0.5, [f"{d:g}" for d in grid_values.columns])
        ax.set_yticks(np.arange(grid_values.shape[0]) + 0.5, [f"{v:g}" for v in grid_values.index])
        ax.set_xlabel("penetration of full damping d, mm")
        ax.set_ylabel(label)
        ax.set_title(claim, fontsize=10)
    return figure


def held_shares(data: pd.DataFrame) -> pd.DataFrame:
    """Return the share of the points at which each claim holds, by force component, in percent."""
    shares = {c: (claim_ratios(data, c) > np.array(LEAST)).mean() * 100 for c in COMPONENTS}
    return pd.DataFrame(shares).round(0).astype(int)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=1)
    run(workers=parser.parse_args().workers)
