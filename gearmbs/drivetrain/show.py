"""The parts of a drivetrain as a table for notebooks, as they were given."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gearmbs._shown import html_table, readable, settings_of
from gearmbs.drivetrain.part import Part


def parts_html(name: str, parts: Iterable[Part], laws: Mapping[str, str]) -> str:
    """Return the parts of a drivetrain with their settings that are not at their defaults, meshes with their laws."""
    rows = []
    for part in parts:
        settings = [f"{key.replace('_', ' ')} {readable(value)}" for key, value in settings_of(part)[1:]]
        if part.name in laws:
            settings.append(f"law {laws[part.name]}")
        rows.append((part.title, part.name, "; ".join(settings)))
    return html_table(f"Drivetrain {name}", ("", "part", "settings"), rows)
