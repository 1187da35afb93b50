"""All benchmarks side by side in one run: measure, save each part, write JSON, Markdown and figures."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType

from benchmarks import contact, digits, gear_pair, plots, precision, size, step_parts, whole_case
from benchmarks.machine import describe
from benchmarks.store import Store
from gearmbs.files import write_whole

PARTS: dict[str, ModuleType] = {
    "gear": gear_pair,
    "precision": precision,
    "digits": digits,
    "size": size,
    "contact": contact,
    "step": step_parts,
    "case": whole_case,
}


def run_part(name: str, store: Store, quick: bool, only: str = "") -> dict:
    """Measure a part, or find its pieces on disk, and return pieces and summary."""
    module = PARTS[name]
    results = [store.part(f"{name} - {key}", compute) for key, compute in module.cells(quick) if only in key]
    return {"title": module.TITLE, "results": results, **module.finish(results)}


def report_text(outcome: dict) -> str:
    """Return the whole report in Markdown."""
    machine = outcome["machine"]
    packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items())
    lines = [
        "# Benchmark results\n",
        f"{machine['processor']}, {machine['cores']} cores, {machine['system']}; Python {machine['python']}, gearmbs "
        f"{machine['gearmbs']}, {packages}; one thread; {machine['date']}"
        + ("; quick run, fewer cases" if outcome["quick"] else "")
        + ".\n",
    ]
    for name, part in outcome["parts"].items():
        lines.append(f"## {part['title']}\n")
        for figure in part["figures"]:
            if figure.endswith(".png"):
                lines.append(f"![{part['title']}]({figure})\n")
        lines.append(PARTS[name].render(part))
    return "\n".join(lines)


def run(
    names: Sequence[str], out: Path, quick: bool, fresh: bool, report: Callable[[str], None], only: str = ""
) -> dict:
    """Run the named parts and write ``results.json``, ``results.md`` and the figures into ``out``.

    Parameters
    ----------
    names : sequence of str
        Of `PARTS`.
    out : Path
    quick : bool
        Fewer cases, coarser: minutes instead of a quarter of an hour.
    fresh : bool
        Measure again what was saved by an earlier run.
    report : callable
        Called with a line of text now and then.
    only : str
        Measure only pieces whose name contains this.

    Returns
    -------
    dict
        What ``results.json`` holds.
    """
    store = Store(out / "parts", f"quick={quick}", fresh, report)
    outcome: dict = {"machine": describe(), "quick": quick, "parts": {}}
    for name in names:
        part = run_part(name, store, quick, only)
        part["figures"] = [path.name for path in plots.write(name, part, out)]
        outcome["parts"][name] = part
    write_whole(out / "results.json", json.dumps(outcome, indent=1))
    write_whole(out / "results.md", report_text(outcome))
    return outcome


def main(arguments: Sequence[str] | None = None) -> None:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"any of {', '.join(PARTS)}; default all")
    parser.add_argument("--out", type=Path, default=Path("out/bench"), help="folder for the results (out/bench)")
    parser.add_argument("--quick", action="store_true", help="fewer cases, coarser")
    parser.add_argument("--fresh", action="store_true", help="measure again what an earlier run has saved")
    parser.add_argument("--only", default="", metavar="TEXT", help="measure only pieces whose name contains TEXT")
    given = parser.parse_args(arguments)
    unknown = [name for name in given.parts if name not in PARTS]
    if unknown:
        parser.error(f"unknown part {', '.join(unknown)}; choose from {', '.join(PARTS)}")
    names = given.parts or list(PARTS)
    if not any(given.only in key for name in names for key, _ in PARTS[name].cells(given.quick)):
        parser.error(f"no piece of {', '.join(names)} has {given.only!r} in its name")
    run(names, given.out, given.quick, given.fresh, partial(print, flush=True), given.only)
    print(f"\n{(given.out / 'results.md').read_text(encoding='utf-8')}\nwritten to {given.out}")
