"""What of ADAMS is read, made from the program itself: ``support_table``.

The statements, their arguments and the functions are those of the reader; only what to do instead of what is not there
is written down here.
"""

from __future__ import annotations

from gearmbs.adams.parse import commands as acf
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import READ_IN_DECKS
from gearmbs.adams.parse.grammar import CHOICE, specs_of
from gearmbs.adams.parse.statements import INSTEAD, INSTEAD_OF_ARGUMENTS, INSTEAD_OF_FUNCTIONS
from gearmbs.mechanism.language.library import FUNCTIONS
from gearmbs.mechanism.language.lowering import BINARY, ELEMENT_FORCES, UNARY
from gearmbs.mechanism.language.lowering import UNSUPPORTED as REFUSED_FUNCTIONS

READ, OVER, REFUSED = "read", "read over", "refused"
READ_THERE = "read, see the last column"
OF_DECKS = READ_IN_DECKS | frozenset("FXFREQ FXMODE MODE USER".split())
"""Functions that decks have in some places or forms."""

INSTEAD_OF_COMMANDS: dict[str, str] = {
    "CONTROL": "FILE/COMMAND for another script",
    "FLEX_BODY": "the statement in the deck, with its final values",
    "RELOAD": "one script for all analyses; each goes on from the one before",
    "SAVE": "one script for all analyses; `.nc` and .res files keep the results",
}
"""What to do instead of commands that are refused."""


def statement_rows() -> list[tuple[str, str, str, str, str]]:
    """Return name, whether it is read, arguments without effect, arguments refused, and what to do instead."""
    rows = []
    for name, cls in st.STATEMENTS.items():
        keyword = {field: "/".join(s.choices) if s.kind == CHOICE else s.keyword for field, s in specs_of(cls).items()}
        idle = [keyword[field] for field, spec in specs_of(cls).items() if spec.idle]
        refused = [keyword[field] for field, spec in specs_of(cls).items() if spec.instead is not None]
        ways = dict.fromkeys(INSTEAD_OF_ARGUMENTS.get((name, one), "") for one in refused)
        rows.append((name, READ, ", ".join(idle), ", ".join(refused), "; ".join(way for way in ways if way)))
    rows += [(name, OVER, "", "", "") for name in st.IGNORED]
    rows += [(name, REFUSED, "", "", INSTEAD.get(name, "")) for name in st.UNSUPPORTED]
    return sorted(rows)


def command_rows() -> list[tuple[str, str, str]]:
    """Return the commands of a script, each with whether it is read and what to do instead."""
    rows = [(name, READ, "") for name in acf.COMMANDS]
    rows += [(name, "read, with new values of the statement", "") for name in acf.CHANGEABLE]
    rows += [(name, OVER, "") for name in acf.IGNORED_COMMANDS]
    rows += [(name, REFUSED, INSTEAD_OF_COMMANDS.get(name, "")) for name in acf.UNSUPPORTED_COMMANDS]
    return sorted(rows)


def function_rows() -> list[tuple[str, str, str]]:
    """Return name, whether it is read and what to do instead, of the functions of expressions."""
    read = {*UNARY, *BINARY, *ELEMENT_FORCES, *FUNCTIONS}
    rows = [(name, READ, "") for name in read]
    for name in REFUSED_FUNCTIONS - read:
        rows.append((name, READ_THERE if name in OF_DECKS else REFUSED, INSTEAD_OF_FUNCTIONS.get(name, "")))
    return sorted(rows)


def support_table() -> str:
    """Return as Markdown what of ADAMS is read: statements, commands, functions; and what to do instead of others."""
    lines = ["| statement | | without effect | refused | instead |", "|---|---|---|---|---|"]
    lines += [f"| {name} | {how} | {idle} | {refused} | {way} |" for name, how, idle, refused, way in statement_rows()]
    lines += ["", "| command | | instead |", "|---|---|---|"]
    lines += [f"| {name} | {how} | {way} |" for name, how, way in command_rows()]
    lines += ["", "| function | | instead |", "|---|---|---|"]
    lines += [f"| {name} | {how} | {way} |" for name, how, way in function_rows()]
    return "\n".join(lines)
