"""The stored table of GMF levels that guards the six cases: ``python -m gearmbs.studies.regression FILE``.

Records of 0.1 s with the study's defaults but a tight tolerance; the levels by orders of all components, unscaled.
"""

from __future__ import annotations

import json
import sys

from gearmbs.studies.case import make_case
from gearmbs.studies.parallel import run_cases
from gearmbs.studies.preset import paper_cases
from gearmbs.studies.store import write_text

DURATION = 0.1
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
        sys.exit("usage: python -m gearmbs.studies.regression FILE")
    text = {
        "command": "python -m gearmbs.studies.regression tests/studies/gmf_levels.json",
        "unit": "m/s^2",
        "levels": gmf_levels(),
    }
    write_text(sys.argv[1], json.dumps(text, indent=1) + "\n")
