"""Tables of what the package can do, made from the tables in its sources, for the documentation."""

from __future__ import annotations

import public_bearings as recordings

from gearmbs.dae.methods import formulations_table, integrators_table
from gearmbs.signals.files.table import formats_table


class Table:
    """What a notebook shows as a table; it needs nothing of a notebook's packages."""

    def __init__(self, text: str):
        self.text = text

    def _repr_markdown_(self) -> str:
        return self.text


def formats() -> Table:
    """Return the formats of recordings."""
    return Table(formats_table())


def integrators() -> Table:
    """Return the integrators."""
    return Table(integrators_table())


def formulations() -> Table:
    """Return the formulations."""
    return Table(formulations_table())


def public_bearings(table: str) -> Table:
    """Return one of the tables of bearings in public recordings: summary, sound or hard."""
    return Table(getattr(recordings, table)())
