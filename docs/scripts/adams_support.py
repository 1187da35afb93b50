"""What is read of ADAMS, for the documentation: a table, and the lists of the page on decks.

``python docs/scripts/adams_support.py`` writes the lists into the page; a test fails if it is not up to date.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable
from pathlib import Path

from gearmbs.adams import support_table
from gearmbs.adams.parse import commands
from gearmbs.adams.parse import statements as st

PAGE = Path(__file__).parents[1] / "howto" / "adams.md"
BEGIN, END = "<!-- statements: written by docs/scripts/adams_support.py -->\n", "\n<!-- end of statements -->\n"
WIDTH = 150


class Table:
    """What a notebook shows as a table; it needs nothing of a notebook's packages."""

    def _repr_markdown_(self) -> str:
        return support_table()


def show() -> Table:
    """Return the table for display."""
    return Table()


def lists() -> str:
    """Return what is read, read over, refused, changed and switched."""

    def names(found: Iterable[str]) -> str:
        return ", ".join(sorted(found))

    def most(found: Iterable[str]) -> str:
        *first, last = sorted(found)
        return f"{', '.join(first)} and {last}"

    kept = [name for name in commands.LEFT_ON.split() if name != "REQUEST"]
    paragraphs = [
        f"**Statements**: {names(st.STATEMENTS)}.",
        f"**Read over**, since they do not affect the results: {names(st.IGNORED)}.",
        f"**Refused** by name and line: {names(st.UNSUPPORTED)}.",
        f"**Commands** of a script: {names(commands.COMMANDS)}, and any statement but {most(commands.FIXED)} with new "
        "values.",
    ]
    points = [
        f"ACTIVATE and DEACTIVATE switch **these elements**: {names(commands.ELEMENTS.split())}.",
        f"What is not modelled can be switched without effect; {most(kept)} stay on.",
    ]
    plain = textwrap.TextWrapper(WIDTH, break_long_words=False, break_on_hyphens=False)
    listed = textwrap.TextWrapper(WIDTH, initial_indent="* ", subsequent_indent="  ", break_long_words=False)
    return "\n\n".join([*map(plain.fill, paragraphs), "\n".join(map(listed.fill, points))])


def page() -> str:
    """Return the page on decks with its lists as they must be."""
    text = PAGE.read_text(encoding="utf-8")
    pattern = f"(?<={re.escape(BEGIN)}).*?(?={re.escape(END)})"
    return re.sub(pattern, lambda _: f"\n{lists()}\n", text, flags=re.S)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
