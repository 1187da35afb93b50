"""What a script changes, and its mistakes found before a long run.

The deck, which elements act, the state analyses go on from, and the time are a `Session`; `check_script` goes through a
script without computing anything.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gearmbs.adams.builders.control import state_system
from gearmbs.adams.builders.flexible import SHARE, modal_ratios
from gearmbs.adams.builders.mechanism import build_model
from gearmbs.adams.builders.routines import bound, calls_routine
from gearmbs.adams.builders.scopes import IN_DYNAMICS, BodyState, deck_scope, markers_of, translated
from gearmbs.adams.errors import ERROR, UNSUPPORTED, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import check, refused_arguments
from gearmbs.adams.parse.commands import Change, Command, Linear, Script, Simulate, Stop, Switch, apply_change
from gearmbs.adams.parse.deck import (
    READ_IN_DECKS,
    Deck,
    absent_statements,
    needed_by,
    read_variables,
    refused_functions,
)
from gearmbs.adams.parse.grammar import EXPRESSION, specs_of
from gearmbs.dae.equations.expressions.opcodes import LEVEL_TIME, ExpressionError, NotEvaluatedError
from gearmbs.dae.equations.expressions.tape import Tape
from gearmbs.mechanism.language.library import compile_expression
from gearmbs.mechanism.language.syntax import Call, Number, Scope, parse, shown, walk

MOST_OUTPUTS = 10_000_000
"""Output steps of an analysis: more would not fit into memory."""

INTO_OTHERS = (st.Variable, st.Diff)
"""Statements whose expressions are written into those of others, with what is wrong there: they come first."""


SINGLE = ("STATICS", "INITIAL_CONDITIONS", "DISPLACEMENT", "VELOCITY", "ACCELERATION")
"""Analyses that need no span of time."""


@dataclass
class Session:
    """What changes while a script is carried out.

    Attributes
    ----------
    deck : Deck
        As commands have left it.
    inactive : set of (statement name, id)
    state, states, turns
        Where the last analysis ended: parts by statement name and id, DIFFs by id, counted angles; ``state`` is None
        before the first.
    time : float
        In the deck's unit.
    places : dict
        (statement class, id, argument) -> (file, line) of the command that gave it.
    sensed : dict of int to float
        What sensors have evaluated, by id.
    pending : dict
        Of GSEs by id: number of the next sample and the discrete states from then on.
    tol : float or None
        Local error instead of INTEGRATOR's ERROR.
    allow_unsupported : bool
        Whether what is not supported is left out.
    progress : bool, callable or None
        As in :func:`gearmbs.mechanism.simulate`.
    redundancy : str
        Which redundant rows are kept, see `gearmbs.mechanism.checks`.
    check : bool or None
        Whether dynamic analyses are solved again with a smaller error; None: if that costs little.
    interrupted : bool
        Whether somebody interrupted such a second solution: the run is to end where the first has.
    unasked : set of int
        REQUESTs that are left out with what they ask for, by id.
    routines : mapping or None
        For USER(...) in commands, as in :func:`gearmbs.adams.run_deck`.
    """

    deck: Deck
    inactive: set[tuple[str, int]] = field(default_factory=set)
    state: dict[tuple[str, int], BodyState] | None = None
    states: dict[str, float] = field(default_factory=dict)
    turns: dict[tuple[str, str, str], float] = field(default_factory=dict)
    time: float = 0.0
    places: dict[tuple[type, int, str], tuple[str, int]] = field(default_factory=dict)
    sensed: dict[int, float] = field(default_factory=dict)
    pending: dict[int, tuple[int, tuple[float, ...]]] = field(default_factory=dict)
    tol: float | None = None
    allow_unsupported: bool = False
    progress: bool | Callable[[float], None] | None = None
    redundancy: str = "adams"
    check: bool | None = None
    interrupted: bool = False
    unasked: set[int] = field(default_factory=set)
    routines: Mapping[str, Any] | None = None

    @classmethod
    def of(cls, deck: Deck, routines: Mapping[str, Any] | None = None) -> Session:
        """Return the start of a session; what it changes leaves ``deck`` as it is."""
        return cls(replace(deck, items={kind: dict(group) for kind, group in deck.items.items()}), routines=routines)


def active_sensors(session: Session) -> list[st.Sensor]:
    """Return the sensors that watch."""
    return [s for s in session.deck.of(st.Sensor).values() if ("SENSOR", s.id) not in session.inactive]


def unsupported(command: Any, message: str) -> DeckError:
    """Return the error that a command is not supported."""
    return DeckError([Diagnostic(UNSUPPORTED, message, command.file, command.line)])


def switch(session: Session, command: Switch) -> None:
    """Activate or deactivate an element, or all elements of its kind within a range of ids.

    Of a kind that is not supported nothing acts: to switch it changes nothing, whether or not it is left out.

    Raises
    ------
    DeckError
        If the deck does not have it.
    """
    keyword, number = command.element or "", command.id or 0
    if keyword in st.UNSUPPORTED or (keyword, number) in session.deck.left_out:
        return
    there = session.deck.of(st.STATEMENTS[keyword])
    low, high = command.range or (number, number)
    numbers = [n for n in there if low <= n <= high]
    if not numbers and not any(name == keyword and low <= n <= high for name, n in session.deck.left_out):
        label = f"{keyword}/{number}" if number else keyword
        label += f" from {low} to {high}" if command.range else ""
        raise DeckError([Diagnostic(ERROR, f"there is no {label} in the deck", command.file, command.line)])
    for n in numbers:
        (session.inactive.discard if command.on else session.inactive.add)((keyword, n))


def change(session: Session, command: Change, allow_unsupported: bool) -> None:
    """Put a command's arguments into the session's deck.

    Raises
    ------
    DeckError
        If there is nothing to change, or the deck does not hold together with the new arguments.
    """
    new = command.statement
    assert new is not None
    if (new.keyword, new.id) in session.deck.left_out:
        return
    called = calls_routine(new)
    if not called:
        functions = [message for _, message in refused_functions(new, tuple(new.given))]
        if _left_out(session, command, functions, allow_unsupported):
            return
    late = {name for name in new.given if specs_of(type(new))[name].start}
    if late and session.state is not None and not allow_unsupported:
        what = ", ".join(sorted(name.upper() for name in late))
        raise unsupported(
            command,
            f"{new.label()}: {what} after the first analysis; the mechanism goes on from where it is",
        )
    refused = [] if called else refused_arguments(new)
    if refused and not allow_unsupported:
        raise unsupported(command, f"{new.label()}: {', '.join(refused).upper()} is not supported")
    group = session.deck.items.setdefault(type(new), {})
    old = group.get(new.id)
    if old is None:
        if new.id:
            message = f"there is no {new.label()} to change"
            raise DeckError([Diagnostic(ERROR, message, command.file, command.line)])
        group[0] = new
    else:
        group[new.id] = apply_change(old, new)
    session.deck.__dict__.pop("units", None)
    trial = replace(session.deck, diagnostics=[])
    wrong = check(trial)
    missing: list[str] = []
    if called and not wrong:
        try:
            made = bound(replace(trial, diagnostics=[]), session.routines)
            session.deck.functions = made.functions
            group[new.id] = made.of(type(new))[new.id]
        except DeckError as error:
            wrong = [d for d in error.diagnostics if d.severity == ERROR]
            missing = [d.message for d in error.diagnostics if d.severity == UNSUPPORTED]
    if wrong or missing:
        # the deck stays as it was
        if old is None:
            del group[new.id]
        else:
            group[new.id] = old
        session.deck.__dict__.pop("units", None)
        if _left_out(session, command, missing, allow_unsupported) and not wrong:
            return
        raise DeckError([Diagnostic(d.severity, d.message, command.file, command.line) for d in wrong])
    session.places.update({(type(new), new.id, name): (command.file, line) for name, line in new.given.items()})


def _left_out(session: Session, command: Change, messages: list[str], allow_unsupported: bool) -> bool:
    """Remark that a command is left out if there is a reason, or refuse it; return whether it is left out."""
    if messages and not allow_unsupported:
        raise DeckError([Diagnostic(UNSUPPORTED, message, command.file, command.line) for message in messages])
    for message in messages:
        remark(session, Diagnostic(UNSUPPORTED, f"{message}; the command is left out", command.file, command.line))
    return bool(messages)


def remark(session: Session, said: Diagnostic) -> None:
    """Add a remark to the deck, once."""
    if said not in session.deck.diagnostics:
        session.deck.diagnostics.append(said)


def output_times(session: Session, command: Simulate) -> np.ndarray:
    """Return the output times in the deck's unit.

    Raises
    ------
    DeckError
        If the analysis would end before it starts.
    """
    end = command.end if command.end is not None else session.time + (command.duration or 0.0)
    if not end > session.time:
        message = f"END = {end}, but the model is at time {session.time} already"
        raise DeckError([Diagnostic(ERROR, message, command.file, command.line)])
    span = end - session.time
    asked = (command.steps or 100) if command.dtout is None else span / command.dtout
    if asked > MOST_OUTPUTS:
        message = f"{asked:.3g} output steps are asked for; more than {MOST_OUTPUTS:.0e} are not kept: give fewer"
        raise DeckError([Diagnostic(ERROR, message, command.file, command.line)])
    if command.dtout is None:
        return session.time + span * np.arange((command.steps or 100) + 1) / (command.steps or 100)
    count = int(np.floor(span / command.dtout * (1.0 + 1e-12) + 1e-9))
    times = session.time + command.dtout * np.arange(count + 1)
    return times if end - times[-1] < 1e-9 * command.dtout else np.append(times, end)


# Check all expressions of a deck: that they can be read, and that what they name is there.


SOME_MODE = np.array([17.3]), np.array([7.0])
"""A frequency and a number with which CRATIO is tried, before the file with those of the modes is read."""


def expression_errors(deck: Deck, session: Session, scope: Scope) -> list[Diagnostic]:
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
    """
    found = []
    read, absent = read_variables(deck), absent_statements(deck)
    told: set[str] = set()
    for statement in sorted(deck, key=lambda s: not isinstance(s, INTO_OTHERS)):
        if (statement.keyword, statement.id) in session.inactive:
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
                what = _wrong(deck, statement, text, scope)
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
                remark(session, Diagnostic(WARNING, message, file, line))
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
    for statement in deck.each(st.System):
        if (statement.keyword, statement.id) in session.inactive:
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
    remark(session, Diagnostic(UNSUPPORTED, message, session.deck.file, request.line))


def _absent_data(deck: Deck, text: str) -> str:
    """Return which SENSOR or CURVE an expression reads that is not there, "" if there is none."""
    with contextlib.suppress(ExpressionError):
        for node in walk(parse(text)):
            if not isinstance(node, Call) or node.name not in READ_IN_DECKS:
                continue
            keyword, which = st.READ_BY[node.name], node.args[-1] if node.args else None
            if isinstance(which, Number) and which.integer not in deck.of(st.STATEMENTS[keyword]):
                return f"there is no {keyword}/{which.integer} for {node.name}"
    return ""


def _wrong(deck: Deck, statement: st.Statement, text: str, scope: Scope) -> str:
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
    tape = compile_expression(translated(deck, IN_DYNAMICS, text), scope, accelerations=placed, outline=True)
    return _misplaced(statement, text, tape)


def _misplaced(statement: st.Statement, text: str, tape: Tape) -> str:
    if isinstance(statement, st.Motion) and tape.level > LEVEL_TIME:
        return f"{text!r} must be a function of TIME alone"
    if isinstance(statement, st.Gcon) and not tape.second_order:
        return f"{text!r} must depend on positions and TIME only; velocities and forces cannot enter a constraint"
    return ""


def check_script(
    deck: Deck, script: Script, allow_unsupported: bool = False, routines: Mapping[str, Any] | None = None
) -> set[int]:
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
    routines : mapping, optional
        For USER(...) in commands.

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
        session = Session.of(deck, routines)
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
                    if command.statemat:
                        plant_variables(session.deck, st.PlantInput, command.pinput, command)
                        plant_variables(session.deck, st.PlantOutput, command.poutput, command)
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


def plant_variables(deck: Deck, kind: type[st.Plant], number: int | None, command: Command) -> list[st.Variable]:
    """Return the VARIABLEs of a PINPUT or POUTPUT that LINEAR/STATEMAT asks for.

    Raises
    ------
    DeckError
        If there is no such one, or several.
    """
    there, keyword = deck.of(kind), kind.keyword
    message = ""
    if not there:
        message = f"the deck has no {keyword}; add {keyword}/1, VARIABLES=..."
    elif number is None and len(there) > 1:
        message = f"the deck has several; give {keyword} = {', '.join(map(str, there))}"
    elif number is not None and number not in there:
        message = f"there is no {keyword}/{number}; the deck has {keyword} {', '.join(map(str, there))}"
    if message:
        raise DeckError([Diagnostic(ERROR, f"LINEAR/STATEMAT: {message}", command.file, command.line)])
    plant = there[number if number is not None else next(iter(there))]
    return [deck.of(st.Variable)[v] for v in plant.variables]


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
