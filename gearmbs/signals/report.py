"""Small helpers for reports as Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence


def significant(value: float, digits: int = 4) -> str:
    """A number with so many significant digits, plain where that is readable; a dash for what is not a number."""
    value = float(value)
    if math.isnan(value):
        return "-"
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    power = math.floor(math.log10(abs(value)))
    if -4 <= power < digits + 2:
        return f"{value:.{max(0, digits - 1 - power)}f}"
    return f"{value:.{digits - 1}e}"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; vertical bars inside cells are escaped."""
    lines = [_row(header), "|" + "|".join("---" for _ in header) + "|"]
    return "\n".join(lines + [_row(row) for row in rows])


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"
