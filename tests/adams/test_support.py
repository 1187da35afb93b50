"""The table of what is read, against the reader."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearmbs.adams import DeckError, parse_deck, support_table
from gearmbs.adams import support as table
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import UNSUPPORTED_ARGUMENTS
from gearmbs.adams.parse.commands import UNSUPPORTED_COMMANDS
from gearmbs.adams.parse.grammar import specs_of
from gearmbs.mechanism.expression_functions import UNSUPPORTED as REFUSED_FUNCTIONS

from .decks import PENDULUM

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "adams_table.md"


def test_every_statement_stands_in_the_table_as_the_reader_takes_it():
    how = {row[0]: row[1] for row in table.statement_rows()}
    assert set(how) == {*st.STATEMENTS, *st.IGNORED, *st.UNSUPPORTED}
    for name, word in how.items():
        if word == table.REFUSED:
            deck = parse_deck(PENDULUM.replace("END\n", f"{name}/77, X=1\nEND\n"))
            assert [d.message for d in deck.unsupported] == [f"{name}/77 is not supported; it changes the motion"]
        elif word == table.OVER:
            deck = parse_deck(PENDULUM.replace("END\n", f"{name}/77, X=1\nEND\n"))
            assert any(name in d.message and "ignored" in d.message for d in deck.diagnostics)
        else:
            assert name in st.STATEMENTS


def test_what_is_refused_has_something_to_do_instead():
    assert set(table.INSTEAD) >= st.UNSUPPORTED
    for cls, fields in UNSUPPORTED_ARGUMENTS.items():
        for field in fields:
            keyword = specs_of(cls)[field].keyword
            known = (st.KEYWORD_OF[cls], keyword) in table.INSTEAD_OF_ARGUMENTS
            assert known or cls is st.Marker, f"{st.KEYWORD_OF[cls]} {keyword}"
    for name, keyword in table.INSTEAD_OF_ARGUMENTS:
        specs = specs_of(st.STATEMENTS[name]).values()
        assert keyword in {s.keyword for s in specs}, f"{name} has no {keyword}"


def test_functions_of_the_table_are_those_of_expressions():
    for name, how, _ in table.function_rows():
        if how != table.REFUSED:
            continue
        text = PENDULUM.replace("END\n", f"REQUEST/77, F2={name}(1,1,1,1)\nEND\n")
        from gearmbs.adams import run_deck

        with pytest.raises(DeckError, match=f"{name}|unsupported"):
            run_deck(parse_deck(text), end=0.01, steps=1)
    # TRANS is a name that decks use; no description of it was found
    assert set(table.INSTEAD_OF_FUNCTIONS) == REFUSED_FUNCTIONS - {"TRANS"}
    assert set(table.INSTEAD_OF_COMMANDS) == set(UNSUPPORTED_COMMANDS)


def test_the_page_shows_the_table():
    assert "adams_support.show()" in PAGE.read_text(encoding="utf-8")
    text = support_table()
    assert "| BEAM | read |" in text
    assert "| TIRE | refused | | | a GFORCE" in " ".join(text.split())
