"""The linear plant between a deck's PINPUT and POUTPUT, as LINEAR/STATEMAT asks for it.

The VARIABLEs of the PINPUT become states that keep their values, those of the POUTPUT the rates of further states, so
that the matrices are parts of one exact linearisation; see `gearmbs.dae.analyses.plant`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Command, Linear
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.adams.run.session import Session
from gearmbs.dae.analyses import plant as _plant
from gearmbs.dae.analyses.plant import LinearPlant
from gearmbs.dae.analyses.statics import initial_conditions

if TYPE_CHECKING:
    from gearmbs.adams.builders.scopes import AdamsModel
    from gearmbs.dae.model.system import System


def plant_of(session: Session, command: Linear, build: Callable[[Session], tuple[AdamsModel, System]]) -> LinearPlant:
    """Carry out LINEAR/STATEMAT at the session's present state; ``build`` makes a session's model and system."""
    deck = session.deck
    inputs = _variables(deck, st.PlantInput, command.pinput, command)
    outputs = _variables(deck, st.PlantOutput, command.poutput, command)
    model, system = build(session)
    evaluator = RequestEvaluator(model, initial_conditions(system))
    values = [float(evaluator.expression(f"VARVAL({v.id})")[-1]) for v in inputs]
    first = 1 + max(deck.of(st.Diff), default=0)
    items = {kind: dict(group) for kind, group in deck.items.items()}
    variables, diffs = items.setdefault(st.Variable, {}), items.setdefault(st.Diff, {})
    ids = range(first, first + len(inputs) + len(outputs))
    for k, (variable, value) in enumerate(zip(inputs, values)):
        variables[variable.id] = replace(variable, function=f"DIF({first + k})")
        diffs[first + k] = st.Diff(id=first + k, function="0", ic=(value,))
    for k, variable in enumerate(outputs, len(inputs)):
        diffs[first + k] = st.Diff(id=first + k, function=f"VARVAL({variable.id})")
    _, system = build(replace(session, deck=replace(deck, items=items)))
    # the names of the differential states, in their order among the unknowns
    kinds = system.model.differential_states
    names = [name for name, differential in zip(system.state_names, kinds) if differential]
    places = [names.index(str(number)) for number in ids]
    labels = {str(n): v.name or v.label() for n, v in zip(ids, [*inputs, *outputs])}
    shown = [labels.get(name, f"DIFF_{name}" if name.isdigit() else name) for name in names]
    count = len(inputs)
    return _plant.linear_plant(system, places[:count], places[count:], shown, deck.units.time)


def _variables(deck: Deck, kind: type[st.Plant], number: int | None, command: Command) -> list[st.Variable]:
    """Return the VARIABLEs of a PINPUT or POUTPUT."""
    there, keyword = deck.of(kind), st.KEYWORD_OF[kind]
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
