"""The table of what is read of ADAMS, for the documentation."""

from __future__ import annotations

from gearmbs.adams import support_table


class Table:
    """What a notebook shows as a table; it needs nothing of a notebook's packages."""

    def _repr_markdown_(self) -> str:
        return support_table()


def show() -> Table:
    """Return the table for display."""
    return Table()
