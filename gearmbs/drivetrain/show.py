"""The parts of a drivetrain as a table for notebooks, as they were given."""

from __future__ import annotations

from collections.abc import Iterable

from gearmbs._shown import html_table, readable, settings_of
from gearmbs.drivetrain.part import Part


def parts_html(name: str, parts: Iterable[Part]) -> str:
    """Return the parts of a drivetrain with their settings that are not at their defaults."""
    rows = [
        (part.title, part.name, "; ".join(f"{key.replace('_', ' ')} {readable(v)}" for key, v in settings_of(part)[1:]))
        for part in parts
    ]
    return html_table(f"Drivetrain {name}", ("", "part", "settings"), rows)
