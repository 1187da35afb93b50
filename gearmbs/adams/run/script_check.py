"""Go through a script without computing anything, so that its mistakes show before a long run: ``check_script``."""

from __future__ import annotations

from dataclasses import replace

from gearmbs.adams.builders.data_calls import translated
from gearmbs.adams.builders.mechanism import build_model
from gearmbs.adams.builders.model import AdamsModel, markers_of
from gearmbs.adams.errors import ERROR, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Change, Linear, Script, Simulate, Stop, Switch
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.grammar import EXPRESSION, specs_of
from gearmbs.adams.parse.readers import read_variables
from gearmbs.adams.run.session import Session, active_sensors, change, output_times, switch, unsupported
from gearmbs.dae.equations.expressions.errors import ExpressionError, NotEvaluatedError
from gearmbs.dae.equations.expressions.opcodes import LEVEL_TIME
from gearmbs.dae.equations.expressions.tape import Tape
from gearmbs.mechanism.expression_compiler import compile_expression

SINGLE = ("STATICS", "INITIAL_CONDITIONS", "DISPLACEMENT", "VELOCITY", "ACCELERATION")
"""Analyses that need no span of time."""


def check_script(deck: Deck, script: Script, allow_unsupported: bool = False) -> None:
    """Check everything about a script that is known before it is run.

    The elements it switches and changes must be there, its times must go on, the mechanism of the first analysis must
    be built, and the expressions of all statements, as they are at every analysis, must be understood.

    Parameters
    ----------
    deck : Deck
    script : Script
    allow_unsupported : bool
        Whether what is not supported is left out.

    Raises
    ------
    DeckError
        With all that is wrong.
    """
    session = Session.of(deck)
    errors: list[Diagnostic] = []
    checked = False
    for command in script:
        if isinstance(command, Stop):
            break
        try:
            if isinstance(command, Change):
                checked = False
                change(session, command, allow_unsupported)
            elif isinstance(command, Switch):
                checked = False
                switch(session, command)
            elif isinstance(command, (Linear, Simulate)):
                if isinstance(command, Linear):
                    check_linear(command)
                else:
                    _advance(session, command)
                if not checked:
                    checked = True
                    errors += _model_errors(session, allow_unsupported)
                session.state = session.state or {}
        except DeckError as error:
            errors += error.diagnostics
    if errors:
        raise DeckError(list(dict.fromkeys(errors)))


def check_linear(command: Linear) -> None:
    """Refuse what LINEAR cannot do here.

    Raises
    ------
    DeckError
    """
    if command.eigensol == command.statemat:
        raise unsupported(command, "LINEAR takes one of EIGENSOL and STATEMAT; more is not supported")


def is_sequence(command: Simulate) -> bool:
    """Whether an analysis goes through a span of time."""
    return command.kind not in SINGLE or command.end is not None or command.duration is not None


def _advance(session: Session, command: Simulate) -> None:
    if is_sequence(command) and not any(s.back for s in active_sensors(session)):
        session.time = float(output_times(session, command)[-1])


def _model_errors(session: Session, allow_unsupported: bool) -> list[Diagnostic]:
    """Return what is wrong with the deck as it is at an analysis.

    Later analyses start elsewhere, where an element that cannot be built now may be; they are left to the run.
    """
    quiet = replace(session.deck, diagnostics=list(session.deck.diagnostics))
    try:
        model = build_model(quiet, allow_unsupported, frozenset(session.inactive))
    except DeckError as error:
        return list(error.diagnostics) if session.state is None else []
    if not model.mechanism.bodies:
        message = "no PART moves; add one with its mass and centre of mass: PART/2, MASS=1, CM=20, IP=1,1,1"
        return [Diagnostic(ERROR, message, session.deck.file, 0)]
    return expression_errors(model, session)


def expression_errors(model: AdamsModel, session: Session) -> list[Diagnostic]:
    """Return every expression of the active statements that is not understood, with the line that gave it."""
    deck = model.deck
    markers = markers_of(model.mechanism)
    bodies = {id(body): k for k, body in enumerate((model.mechanism.ground, *model.mechanism.bodies.values()))}
    scope = model.scope({id(m): k for k, m in enumerate(markers)}, [bodies[id(m.body)] for m in markers])
    found = []
    read = read_variables(deck)
    for statement in deck:
        key = (st.KEYWORD_OF[type(statement)], statement.id)
        if key in session.inactive or isinstance(statement, (st.FlexBody, st.FeLoad)):
            # CRATIO is evaluated for each mode of the body, S at each node of a beam
            continue
        for name, spec in specs_of(type(statement)).items():
            text = getattr(statement, name)
            if spec.kind != EXPRESSION or text is None:
                continue
            left_out = False
            try:
                tape = compile_expression(
                    translated(deck, model.present, text),
                    scope,
                    accelerations=not isinstance(statement, (st.Motion, st.Gcon)),
                )
                message = _misplaced(statement, text, tape)
            except ExpressionError as error:
                message = str(error)
                left_out = isinstance(error, NotEvaluatedError) and statement.id not in read
            if message:
                own = (deck.file, statement.given.get(name, statement.line))
                file, line = session.places.get((type(statement), statement.id, name), own)
                message = f"{statement.label()}: {spec.keyword}: {message}"
                if left_out and isinstance(statement, st.Variable):
                    message += "; nothing that is computed here reads it, so it is left out"
                    remark = Diagnostic(WARNING, message, file, line)
                    if remark not in session.deck.diagnostics:
                        session.deck.diagnostics.append(remark)
                    continue
                found.append(Diagnostic(ERROR, message, file, line))
    return found


def _misplaced(statement: st.Statement, text: str, tape: Tape) -> str:
    """Return why an expression does not do for its statement, "" when it does."""
    if isinstance(statement, st.Motion) and tape.level > LEVEL_TIME:
        return f"{text!r} must be a function of TIME alone"
    if isinstance(statement, st.Gcon) and not tape.second_order:
        return f"{text!r} must depend on positions and TIME only; velocities and forces cannot enter a constraint"
    return ""
