"""What a script changes: the deck, which elements act, the state analyses go on from, the time."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gearmbs.adams.builders.scopes import AdamsModel, BodyState
from gearmbs.adams.errors import ERROR, UNSUPPORTED, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import check, refused_arguments
from gearmbs.adams.parse.commands import Change, Simulate, Switch, apply_change
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.grammar import specs_of
from gearmbs.adams.parse.readers import refused_functions
from gearmbs.adams.results.record import Segment
from gearmbs.adams.results.remarks import assembly_of, tracks_of
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.dae.analyses.statics import StaticResult
from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.problem import ModelError
from gearmbs.dae.results.solution import Solution

MOST_OUTPUTS = 10_000_000
"""Output steps of an analysis: more would not fit into memory."""


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

    @classmethod
    def of(cls, deck: Deck) -> Session:
        """Return the start of a session; what it changes leaves ``deck`` as it is."""
        return cls(replace(deck, items={kind: dict(group) for kind, group in deck.items.items()}))


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
    functions = [message for _, message in refused_functions(new, tuple(new.given))]
    if functions and not allow_unsupported:
        raise DeckError([Diagnostic(UNSUPPORTED, message, command.file, command.line) for message in functions])
    if functions:
        for message in functions:
            _remark(session, Diagnostic(UNSUPPORTED, f"{message}; the command is left out", command.file, command.line))
        return
    late = {name for name in new.given if specs_of(type(new))[name].start}
    if late and session.state is not None and not allow_unsupported:
        what = ", ".join(sorted(name.upper() for name in late))
        raise unsupported(
            command,
            f"{new.label()}: {what} after the first analysis; the mechanism goes on from where it is",
        )
    refused = refused_arguments(new)
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
    if wrong:
        # the deck stays as it was
        if old is None:
            del group[new.id]
        else:
            group[new.id] = old
        session.deck.__dict__.pop("units", None)
        raise DeckError([Diagnostic(d.severity, d.message, command.file, command.line) for d in wrong])
    session.places.update({(type(new), new.id, name): (command.file, line) for name, line in new.given.items()})


def _remark(session: Session, remark: Diagnostic) -> None:
    if remark not in session.deck.diagnostics:
        session.deck.diagnostics.append(remark)


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


# Remarks on points of contact that leave an open curve.


OFF = 1e-9
"""Of a curve's length: beyond its end by less than it is at the end."""


def off_the_end(model: AdamsModel, solution: Solution) -> list[str]:
    """Return a remark on each point of contact that is beyond the end of its curve, with the first time of output."""
    remarks = []
    for runner, (statement, length) in model.runners.items():
        travel = solution.com_position(runner)[:, 2]
        beyond = np.flatnonzero((travel < -OFF * length) | (travel > (1.0 + OFF) * length))
        if beyond.size:
            time = solution.t[beyond[0]] / model.deck.units.time
            remarks.append(
                f"{statement.label()}: at TIME = {time:.9g} it is off the end of its curve, where the spline goes on "
                "beyond the points; give points further out, or a SENSOR that ends the analysis before"
            )
    return remarks


# From the solution of an analysis to what its results show: ``segment_of``, ``kept_until``.


def segment_of(
    session: Session,
    command: Simulate,
    kind: str,
    model: AdamsModel,
    solution: Solution,
    options: dict[str, Any],
    note: str | None,
    equilibrium: StaticResult | None = None,
) -> tuple[Segment, RequestEvaluator]:
    """Return an analysis with its requests, forces, tracks and variables, and what evaluates more of it.

    Raises
    ------
    DeckError
        If a REQUEST cannot be evaluated.
    """
    evaluator = RequestEvaluator(model, solution)
    segment = Segment(command, kind, model, solution, options, note, equilibrium=equilibrium)
    if kind != "STATICS":
        segment.assembly = assembly_of(model, solution)
    for request in session.deck.of(st.Request).values():
        try:
            segment.requests[request.id] = evaluator.request(request)
        except ExpressionError as error:
            raise DeckError([Diagnostic(ERROR, str(error), session.deck.file, request.line)]) from error
    for kind_id in model.pairs:
        segment.wrenches[kind_id] = evaluator.wrench(*kind_id)[:, :6]
    segment.tracks = tracks_of(model, solution)
    segment.variables = evaluator.variables()
    segment.note = "\n".join(filter(None, [note, *off_the_end(model, solution)])) or None
    return segment, evaluator


def kept_until(
    session: Session, command: Simulate, kind: str, model: AdamsModel | None, error: Exception, options: dict[str, Any]
) -> Segment | None:
    """Return what an analysis computed before a routine of the user failed in it, None where there is nothing."""
    solution = getattr(error, "solution", None)
    if model is None or solution is None or solution.t.size == 0:
        return None
    with contextlib.suppress(ModelError, DeckError, ArithmeticError):
        return segment_of(session, command, kind, model, solution, options, None)[0]
    return None
