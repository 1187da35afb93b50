"""The stored benchmark results for the documentation.

``python docs/scripts/benchmark_results.py out/bench/results.json`` stores those of a run.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from IPython.display import Markdown, display
from matplotlib.figure import Figure

from benchmarks import plots, precision
from benchmarks.digits import TOLERANCES
from benchmarks.runner import PARTS

STORED = Path(__file__).parents[1] / "data" / "benchmarks.json"
DIGITS = 4


def rounded(value):
    """Return a result with its numbers rounded to `DIGITS` significant digits."""
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return value


def _short(row: dict) -> dict:
    return {key: value for key, value in row.items() if key not in ("values", "reference", "unknowns")}


def store(results: Path, stored: Path = STORED) -> None:
    """Keep what tables and figures need of a run's ``results.json``; parts the run does not have stay as they are."""
    outcome = json.loads(results.read_text(encoding="utf-8"))
    known = json.loads(stored.read_text(encoding="utf-8")) if stored.exists() else {"parts": {}}
    for name, part in outcome["parts"].items():
        kept = {key: value for key, value in part.items() if key != "figures"}
        if name == "precision":
            del kept["results"]
        if name == "digits":
            kept["results"] = [row if row["tolerance"] == TOLERANCES[-1] else _short(row) for row in kept["results"]]
        known["parts"][name] = (kept if name == "digits" else rounded(kept)) | {"machine": outcome["machine"]}
    lines = [f"{json.dumps(name)}: {json.dumps(part)}" for name, part in known["parts"].items()]
    stored.write_text('{"parts": {\n' + ",\n".join(lines) + "\n}}\n", encoding="utf-8")


def part_of(name: str) -> dict:
    """Return the stored outcome of a part."""
    return json.loads(STORED.read_text(encoding="utf-8"))["parts"][name]


def machine(name: str) -> None:
    """Display on what a part was measured."""
    facts = part_of(name)["machine"]
    packages = ", ".join(f"{package} {version}" for package, version in facts["packages"].items())
    display(
        Markdown(
            f"Measured on {facts['processor']}, {facts['cores']} cores, {facts['system']}, one thread, "
            f"{facts['date']}, load average at the start {facts['load_average']:.1f}: "
            f"Python {facts['python']}, {packages}."
        )
    )


def show(name: str) -> None:
    """Display the tables of a part, headings as bold lines."""
    lines = PARTS[name].render(part_of(name)).splitlines()
    display(Markdown("\n".join(f"**{line.lstrip('# ')}**" if line.startswith("#") else line for line in lines)))


def figure(name: str) -> Figure:
    """Return the figure of a part."""
    drawn = plots.figure_of(name, part_of(name))
    assert drawn is not None
    return drawn


def short_of(aim: float) -> None:
    """Display where another method needs less than ``aim`` times the time of WSTIFF."""
    lines = precision.short_of(part_of("precision"), aim)
    display(Markdown("\n".join(f"* {line} times" for line in lines) if lines else "* nowhere"))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python docs/scripts/benchmark_results.py out/bench/results.json")
    store(Path(sys.argv[1]))
