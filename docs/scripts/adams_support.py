"""The table of what is read of ADAMS, for the documentation."""

from __future__ import annotations

from IPython.display import Markdown, display

from gearmbs.adams import support_table


def show() -> None:
    """Display the table."""
    display(Markdown(support_table()))
