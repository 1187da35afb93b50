"""PINPUT and POUTPUT of a deck as inputs and outputs of its mechanism."""

from __future__ import annotations

import re
from functools import partial

from gearmbs.adams.builders.scopes import IN_DYNAMICS, AdamsModel, translated, with_name
from gearmbs.adams.errors import WARNING, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.language.lowering import ELEMENT_FORCES
from gearmbs.mechanism.parts.functions import TimeFunction
from gearmbs.mechanism.parts.inputs import Input

ASKED = re.compile(r"VARVAL\(\s*(\d+)\s*\)", re.IGNORECASE)
ALONE = re.compile(r"(?:([\d.e+-]+)\*\()?VARVAL\((\d+)\)\)?", re.IGNORECASE)
"""An expression that is a VARIABLE and nothing else, in other units than SI times the SI value of one."""
FORCES = re.compile(rf"\b(?:{'|'.join(ELEMENT_FORCES)})\s*\(", re.IGNORECASE)
RATES = {("rotation", "velocity"): "rad/s", ("rotation", "acceleration"): "rad/s^2",
         ("translation", "velocity"): "m/s", ("translation", "acceleration"): "m/s^2"}  # fmt: skip
"""Units of what motions are given by."""


def name_plants(model: AdamsModel) -> None:
    """Let VARIABLEs of PINPUTs be inputs of the mechanism, and those of POUTPUTs outputs, by their names in the deck.

    An input is a VARIABLE whose FUNCTION is a number. It keeps the deck's unit, which expressions do not tell; as the
    rate of a motion it is in SI. The rest stays as it is, with a remark in the deck.
    """
    m, deck = model.mechanism, model.deck
    there = deck.of(st.Variable)
    owners: dict[tuple[str, str], int] = {}

    def remark(plant: st.Plant, text: str) -> None:
        deck.diagnostics.append(Diagnostic(WARNING, f"{plant.label()}: {text}", deck.file, plant.line))

    for plant in deck.each(st.Plant):
        for variable in (there[n] for n in plant.variables if n in there):
            own = f"VARIABLE_{variable.id}"
            name = (variable.name or own).replace('"', "").replace("'", "")
            owner = owners.setdefault((plant.keyword, name), variable.id)
            if owner != variable.id:
                remark(plant, f"{variable.label()} goes by {own!r}: {name!r} is VARIABLE/{owner}")
                name = own
            try:
                if plant.keyword == "POUTPUT":
                    if name not in m.outputs:
                        _name_elements(model, variable.id)
                        m.output(name, f"VARVAL({variable.id})")
                elif name not in m.inputs:
                    _name_input(model, variable, name)
            except ModelError as error:
                remark(plant, f"{variable.label()} has no name in the mechanism: {error}")


def _name_elements(model: AdamsModel, number: int) -> None:
    """Let what a VARIABLE depends on ask for forces by the names of elements, where no statement has read it so."""
    m = model.mechanism
    for one in _seen(model, f"VARVAL({number})"):
        text = m.variables.get(one)
        if text is not None and FORCES.search(text) is not None:
            m.variables[one] = translated(model.deck, IN_DYNAMICS, text, partial(with_name, model))


def _name_input(model: AdamsModel, variable: st.Variable, name: str) -> None:
    m = model.mechanism
    try:
        value = float(variable.function or "")
    except ValueError:
        raise ModelError(f"its FUNCTION is {variable.function}, no number, and closes the loop already") from None
    motions, unit, factor = _motions(model, variable.id)
    made = m.input(name, unit, value * factor)
    m.variables[variable.id] = f'"{name}"'
    for motion in motions:
        _lead(model, motion, made)


def _motions(model: AdamsModel, number: int) -> tuple[list[str], str, float]:
    """Return the motions that a VARIABLE alone is a rate of, its unit, and the SI value of the deck's.

    Raises
    ------
    ModelError
        If a motion makes something else of it, whose integral is not known beforehand.
    """
    m, found, units = model.mechanism, [], set()
    for name, joint in m.joints.items():
        given = joint.prescribed
        if given is None or number not in _seen(model, given.function.text):
            continue
        alone = ALONE.fullmatch(given.function.text)
        if alone is None or int(alone[2]) != number:
            raise ModelError(f"motion '{name}' integrates {given.function.text}; give it the VARIABLE alone")
        found.append(name)
        units.add((RATES[joint.kind, given.level], float(alone[1] or 1.0)))
    if len(units) > 1:
        raise ModelError(f"motions {', '.join(found)} take it in different units; give each its own VARIABLE")
    return (found, *units.pop()) if units else ([], "dimensionless", 1.0)


def _seen(model: AdamsModel, text: str) -> set[int]:
    """Return the VARIABLEs that an expression depends on."""
    found: set[int] = set()
    texts = [text]
    while texts:
        for number in map(int, ASKED.findall(texts.pop())):
            if number not in found:
                found.add(number)
                texts.append(str(model.mechanism.variables.get(number, "")))
    return found


def _lead(model: AdamsModel, name: str, made: Input) -> None:
    """Let an input be the rate of a motion, which keeps its place among the joints."""
    m = model.mechanism
    old = m.joints[name]
    given = old.prescribed
    assert given is not None
    joint = next(one for one in m.joints.values() if one is not old and one.i is old.i and one.j is old.j)
    order = list(m.joints)
    del m.joints[name]
    add = m.rotation if old.kind == "rotation" else m.translation
    function: TimeFunction = made
    add(name, joint, function, level=given.level, start=given.start, rate=given.rate)
    m.joints = {key: m.joints[key] for key in order}


__all__ = ["name_plants"]
