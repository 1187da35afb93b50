"""The lists of the page on decks against the program."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from gearmbs.adams.parse import commands
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.language.library import FUNCTIONS
from gearmbs.mechanism.language.lowering import BINARY, ELEMENT_FORCES, UNARY, UNSUPPORTED

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "howto" / "adams.md").read_text(encoding="utf-8")


def listed(heading: str, text: str = PAGE) -> set[str]:
    """Return the capital words of the paragraph that starts with a bold heading."""
    paragraph = text[text.index(f"**{heading}**") :].split("\n\n")[0]
    return set(re.findall(r"\b[A-Z][A-Z0-9_]*\b", paragraph))


@pytest.mark.parametrize(
    ("heading", "known"),
    [
        ("Statements", set(st.STATEMENTS)),
        ("Read over", set(st.IGNORED)),
        ("Refused", set(st.UNSUPPORTED)),
        ("Commands", set(commands.COMMANDS) | (set(st.STATEMENTS) - set(commands.CHANGEABLE))),
    ],
)
def test_page_lists_what_the_program_knows(heading, known):
    assert listed(heading) == known


def test_page_lists_what_a_script_switches():
    after = PAGE[PAGE.index("**these elements**:") :].split("\n* ")[0]
    assert set(re.findall(r"\b[A-Z_]{2,}\b", after)) == set(commands.ELEMENTS.split())


def test_expression_page_lists_all_functions():
    text = (DOCS / "theory" / "expressions.md").read_text(encoding="utf-8")
    assert listed("Functions", text) == {*UNARY, *BINARY, *ELEMENT_FORCES, *FUNCTIONS}
    assert listed("Refused functions", text) == set(UNSUPPORTED)


def test_page_is_up_to_date(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "scripts"))
    script = importlib.import_module("adams_support")
    assert script.page() == PAGE, "run python docs/scripts/adams_support.py"
