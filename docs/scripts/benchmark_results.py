"""Benchmark results for the documentation: those on disk, and a short measurement."""

from __future__ import annotations

import platform
import time
from pathlib import Path

import pandas as pd
from IPython.display import Markdown, display

from gearmbs.studies import Case, simulate_case

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"
STATES = {"healthy": {}, "misaligned": {"misalignment": "1 deg"}, "+3 mm": {"centre_distance_error": "3 mm"}}
SIMULATED = 0.2


def show(folder: Path = RESULTS) -> None:
    """Display the Markdown files of a folder, headings as bold lines, or say that there are none."""
    files = sorted(folder.glob("*.md")) if folder.is_dir() else []
    if not files:
        display(Markdown("*No results were stored when this page was built.*"))
    for path in files:
        lines = path.read_text(encoding="utf-8").splitlines()
        display(Markdown("\n".join(f"**{line.lstrip('# ')}**" if line.startswith("#") else line for line in lines)))


def quick() -> pd.DataFrame:
    """Return steps and times of the three states with the default integrator."""
    rows = []
    for name, fault in STATES.items():
        case = Case(name=name, operation={"duration": SIMULATED - 0.11}, fault=fault)
        simulate_case(case.changed(operation={"duration": 0.001}))
        begin = time.perf_counter()
        solution = simulate_case(case)
        seconds = time.perf_counter() - begin
        cycles = case.mesh_frequency * solution.t[-1]
        stats = solution.stats
        rows.append(
            {
                "state": name,
                "wall s per simulated s": round(seconds / solution.t[-1], 2),
                "of it in the integrator": round(stats.wall_time / solution.t[-1], 2),
                "steps a mesh cycle": round(stats.steps / cycles, 1),
                "residuals a mesh cycle": round(stats.residuals / cycles, 1),
                "Jacobians a mesh cycle": round(stats.jacobians / cycles, 1),
            }
        )
    print(f"{platform.machine()}, Python {platform.python_version()}")
    return pd.DataFrame(rows).set_index("state")
