"""Check all expressions of a deck: that they can be read, and that what they name is there."""

from __future__ import annotations

import contextlib

import numpy as np

from gearmbs.adams.builders.control import state_system
from gearmbs.adams.builders.data_calls import IN_DYNAMICS, Present, translated
from gearmbs.adams.builders.fe_parts import SHARE
from gearmbs.adams.builders.flexible import modal_ratios
from gearmbs.adams.errors import ERROR, UNSUPPORTED, WARNING, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.grammar import EXPRESSION, specs_of
from gearmbs.adams.parse.readers import left_out, needed_by, read_variables
from gearmbs.adams.run.session import Session
from gearmbs.dae.equations.expressions.errors import ExpressionError, NotEvaluatedError
from gearmbs.dae.equations.expressions.opcodes import LEVEL_TIME
from gearmbs.dae.equations.expressions.tape import Tape
from gearmbs.mechanism.expression_compiler import compile_expression
from gearmbs.mechanism.expression_syntax import Call, Number, Scope, parse, shown, walk

SOME_MODE = np.array([17.3]), np.array([7.0])
"""A frequency and a number with which CRATIO is tried, before the file with those of the modes is read."""
OF_DATA: dict[str, type[st.Statement]] = {"SENVAL": st.Sensor, "CURVE": st.CurveStatement}
"""Functions whose last argument is the id of such a statement."""
INTO_OTHERS = (st.Variable, st.Diff)
"""Statements whose expressions are written into those of others, with what is wrong there: they come first."""


def expression_errors(deck: Deck, session: Session, scope: Scope, present: Present = IN_DYNAMICS) -> list[Diagnostic]:
    """Return every expression of the active statements that is not understood, with the line that gave it.

    Nothing is compiled or evaluated. What a VARIABLE asks for that is not there is only remarked, in the session's
    deck, if nothing reads it.

    Parameters
    ----------
    deck : Deck
    session : Session
        Which statements are active, and where commands have changed them.
    scope : Scope
        What expressions may name: `gearmbs.adams.builders.scopes.deck_scope`, or that of a mechanism.
    present : Present
    """
    found = []
    read, absent = read_variables(deck), left_out(deck)
    told: set[str] = set()
    for statement in sorted(deck, key=lambda s: not isinstance(s, INTO_OTHERS)):
        if (st.KEYWORD_OF[type(statement)], statement.id) in session.inactive:
            continue
        if absent and isinstance(statement, st.Request):
            needed = sorted(needed_by(statement) & absent.keys())
            if needed:
                _leave_out(session, statement, absent[needed[0]])
                continue
        for name, spec in specs_of(type(statement)).items():
            text = getattr(statement, name)
            if spec.kind != EXPRESSION or text is None:
                continue
            unread, said = False, ""
            try:
                what = _wrong(deck, statement, text, scope, present)
            except ExpressionError as error:
                unread = isinstance(error, NotEvaluatedError) and statement.id not in read
                unread = unread and isinstance(statement, st.Variable)
                said = str(error)
                what = said if unread else _absent_data(deck, text) or said
            except ValueError:
                # of a CURVE, which is said of its own statement
                continue
            if not what or (what in told and shown(text) not in what):
                continue
            own = (deck.file, statement.given.get(name, statement.line))
            file, line = session.places.get((type(statement), statement.id, name), own)
            message = f"{statement.label()}: {spec.keyword}: {what}"
            if unread:
                message += "; nothing that is computed here reads it, so it is left out"
                remark = Diagnostic(WARNING, message, file, line)
                if remark not in session.deck.diagnostics:
                    session.deck.diagnostics.append(remark)
                continue
            told |= {what, said}
            found.append(Diagnostic(ERROR, message, file, line))
    systems = _system_errors(deck, session)
    if systems:
        # what their arrays hold is not known
        found = [d for d in found if "ARYVAL" not in d.message]
    return sorted(found + systems, key=lambda d: d.line)


def _system_errors(deck: Deck, session: Session) -> list[Diagnostic]:
    """Return which LSE, TFSISO and GSE do not hold together: functions ask for their states and outputs."""
    found = []
    for kind in (st.Lse, st.Tfsiso, st.Gse):
        for statement in deck.of(kind).values():
            if (st.KEYWORD_OF[kind], statement.id) in session.inactive:
                continue
            try:
                state_system(deck, statement)
            except ValueError as error:
                found.append(Diagnostic(ERROR, f"{statement.label()}: {error}", deck.file, statement.line))
    return found


def _leave_out(session: Session, request: st.Request, need: str) -> None:
    """Say that a REQUEST is left out with what it asks for."""
    session.unasked.add(request.id)
    message = f"{request.label()}: it needs {need}, which is left out"
    remark = Diagnostic(UNSUPPORTED, message, session.deck.file, request.line)
    if remark not in session.deck.diagnostics:
        session.deck.diagnostics.append(remark)


def _absent_data(deck: Deck, text: str) -> str:
    """Return which SENSOR or CURVE an expression reads that is not there, "" if there is none."""
    with contextlib.suppress(ExpressionError):
        for node in walk(parse(text)):
            if not isinstance(node, Call) or node.name not in OF_DATA:
                continue
            kind, which = OF_DATA[node.name], node.args[-1] if node.args else None
            if isinstance(which, Number) and which.integer not in deck.of(kind):
                return f"there is no {st.KEYWORD_OF[kind]}/{which.integer} for {node.name}"
    return ""


def _wrong(deck: Deck, statement: st.Statement, text: str, scope: Scope, present: Present) -> str:
    """Return why an expression does not do for its statement, "" when it does.

    Raises
    ------
    ExpressionError
        If it is not understood.
    """
    if isinstance(statement, st.FlexBody):
        try:
            modal_ratios(text, *SOME_MODE)
        except ValueError as error:
            return str(error)
        return ""
    if isinstance(statement, st.FeLoad):
        text = SHARE.sub("(0.5)", text)
    placed = not isinstance(statement, (st.Motion, st.Gcon))
    tape = compile_expression(translated(deck, present, text), scope, accelerations=placed, outline=True)
    return _misplaced(statement, text, tape)


def _misplaced(statement: st.Statement, text: str, tape: Tape) -> str:
    if isinstance(statement, st.Motion) and tape.level > LEVEL_TIME:
        return f"{text!r} must be a function of TIME alone"
    if isinstance(statement, st.Gcon) and not tape.second_order:
        return f"{text!r} must depend on positions and TIME only; velocities and forces cannot enter a constraint"
    return ""
