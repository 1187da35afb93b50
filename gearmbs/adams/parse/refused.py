"""Which statements of a deck use functions that are not evaluated here: ``without_refused``."""

from __future__ import annotations

from collections.abc import Sequence

from gearmbs.adams.errors import UNSUPPORTED, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.grammar import EXPRESSION, specs_of
from gearmbs.adams.parse.readers import read_variables, without_readers
from gearmbs.adams.parse.remedies import instead_of_function
from gearmbs.mechanism.language.library import UNSUPPORTED as REFUSED_FUNCTIONS
from gearmbs.mechanism.language.syntax import Call, parse, walk

READ_IN_DECKS = REFUSED_FUNCTIONS & st.READ_BY.keys()
"""Functions that a mechanism refuses and a deck has, where there is a statement with their id."""


def refused_functions(statement: st.Statement, names: tuple[str, ...] | None = None) -> list[tuple[str, str]]:
    """Return name of the argument and message for each function of a statement that is not supported, each once.

    Parameters
    ----------
    statement : Statement
    names : tuple of str, optional
        Arguments to look at; all without.
    """
    if isinstance(statement, st.FlexBody):
        # a body is not left out for its damping, whose function is checked with the others
        return []
    found: dict[str, tuple[str, str]] = {}
    for name, spec in specs_of(type(statement)).items():
        text = getattr(statement, name)
        if spec.kind != EXPRESSION or text is None or (names is not None and name not in names):
            continue
        try:
            calls = [node for node in walk(parse(text)) if isinstance(node, Call)]
        except ValueError:
            # said where expressions are checked
            continue
        for call in calls:
            if call.name in REFUSED_FUNCTIONS - READ_IN_DECKS and call.name not in found:
                message = f"{statement.label()}: {spec.keyword}: the function {call.name} is not supported"
                found[call.name] = name, message + instead_of_function(call.name)
    return list(found.values())


def without_refused(deck: Deck, gone: Sequence[st.Statement], readers: bool) -> list[Diagnostic]:
    """Take out of a deck what uses functions that are not supported and what reads it; return remarks on them.

    A VARIABLE that nothing reads stays: it is remarked where expressions are checked.

    Parameters
    ----------
    deck : Deck
        Changed in place.
    gone : sequence of Statement
        What has been taken out before, for other reasons.
    readers : bool
        Whether to remark on those that merely read what is taken out.
    """
    others = without_readers(deck, gone)
    read = read_variables(deck)
    refused = []
    remarks = []
    for statement in list(deck):
        if isinstance(statement, st.Variable) and statement.id not in read:
            continue
        told = refused_functions(statement)
        for name, message in told:
            line = statement.given.get(name, statement.line)
            remarks.append(Diagnostic(UNSUPPORTED, message, deck.file, line))
        if told:
            del deck.items[type(statement)][statement.id]
            refused.append(statement)
    others += without_readers(deck, refused) if refused else []
    return remarks + (others if readers else [])
