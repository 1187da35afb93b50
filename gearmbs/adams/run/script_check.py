"""Go through a script without computing anything, so that its mistakes show before a long run: ``check_script``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gearmbs.adams.builders.data_calls import IN_DYNAMICS
from gearmbs.adams.builders.mechanism import build_model
from gearmbs.adams.builders.model import markers_of
from gearmbs.adams.builders.scopes import deck_scope
from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse.commands import Change, Linear, Script, Simulate, Stop, Switch
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.run.expression_check import expression_errors
from gearmbs.adams.run.session import Session, active_sensors, change, output_times, switch, unsupported

SINGLE = ("STATICS", "INITIAL_CONDITIONS", "DISPLACEMENT", "VELOCITY", "ACCELERATION")
"""Analyses that need no span of time."""


def check_script(deck: Deck, script: Script, allow_unsupported: bool = False) -> set[int]:
    """Check everything about a script that is known before it is run.

    The elements it switches and changes must be there, its times must go on, the mechanism of the first analysis must
    be built, and the expressions of all statements, as they are at every analysis, must be understood. Expressions and
    commands come first, which takes no kernels: building a mechanism may have to compile them.

    Parameters
    ----------
    deck : Deck
    script : Script
    allow_unsupported : bool
        Whether what is not supported is left out.

    Returns
    -------
    set of int
        REQUESTs that are left out with what they ask for.

    Raises
    ------
    DeckError
        With all that is wrong.
    """
    unasked: set[int] = set()
    for model_errors in (_errors_of_expressions, _errors_of_model):
        session = Session.of(deck)
        errors = _gone_through(session, script, allow_unsupported, model_errors)
        if not allow_unsupported:
            errors += deck.unsupported
        if errors:
            raise DeckError(list(dict.fromkeys(errors)))
        unasked |= session.unasked
    return unasked


def _gone_through(
    session: Session, script: Script, allow_unsupported: bool, model_errors: Callable[[Session, bool], list[Diagnostic]]
) -> list[Diagnostic]:
    """Return what is wrong with a script's commands, and with the deck as it is at each of its analyses."""
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
                    errors += model_errors(session, allow_unsupported)
                session.state = session.state or {}
        except DeckError as error:
            errors += error.diagnostics
    return errors


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


def _errors_of_expressions(session: Session, _: bool) -> list[Diagnostic]:
    """Return the expressions that are wrong, as the deck alone shows them."""
    deck = replace(session.deck, diagnostics=[])
    return expression_errors(deck, session, deck_scope(deck, IN_DYNAMICS, frozenset(session.inactive)))


def _errors_of_model(session: Session, allow_unsupported: bool) -> list[Diagnostic]:
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
    markers = markers_of(model.mechanism)
    bodies = {id(body): k for k, body in enumerate((model.mechanism.ground, *model.mechanism.bodies.values()))}
    scope = model.scope({id(m): k for k, m in enumerate(markers)}, [bodies[id(m.body)] for m in markers])
    return expression_errors(model.deck, session, scope)
