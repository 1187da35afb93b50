"""Fields of nested data by their paths, as "operation.torque"."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def get_path(data: Mapping[str, Any], path: str) -> Any:
    """Return a field of nested data by its path; None where there is none."""
    *sections, name = path.split(".")
    for section in sections:
        data = data.get(section, {})
    return data.get(name)


def entries_of(table: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return the entries of a table and of tables within it, these by paths."""
    found = []
    for key, value in table.items():
        if isinstance(value, Mapping):
            found += [(f"{key}.{inner}", entry) for inner, entry in entries_of(value)]
        else:
            found.append((key, value))
    return found


def entry_of(table: Any, key: str) -> Any:
    """Return an entry of a table, or of one within, alone in a list or not, by its path; None where there is none."""
    for name in key.split("."):
        table = table[0] if isinstance(table, list | tuple) and len(table) == 1 else table
        table = table.get(name) if isinstance(table, Mapping) else None
    return table


def set_entry(table: dict[str, Any], key: str, value: Any) -> None:
    """Set an entry of a table, or of a table within, by its path."""
    *outer, last = key.split(".")
    for name in outer:
        table = table[name]
    table[last] = value


def holds_several(data: Mapping[str, Any], path: str) -> bool:
    """Whether a field of nested data is a list, as that of faults is, which may not be there where there are none."""
    *sections, name = path.split(".")
    for section in sections:
        data = data.get(section, {})
    return name not in data or isinstance(data[name], list | tuple)


def set_path(data: dict[str, Any], path: str, value: Any) -> None:
    """Set a field of nested data by its path; the sections on the way are copied, not changed."""
    *sections, name = path.split(".")
    for section in sections:
        data[section] = dict(data.get(section, {}))
        data = data[section]
    data[name] = value
