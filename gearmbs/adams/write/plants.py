"""Inputs and outputs of a mechanism as the plant of a deck: VARIABLEs, PINPUT and POUTPUT."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearmbs.adams.write.text import Plant, WriterContext, upper
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.solve.plant_names import PlantNames, Told


class _Texts(PlantNames):
    """Reads outputs as expressions of the language, accelerations included, of what has markers in a deck."""

    def _expression(self, text: str) -> Told:
        return Told(text, "", text)

    def _centre(self, body: Body) -> Marker:
        if isinstance(body, ModalBody):
            raise ModelError(f"'{body.name}' deforms, and a deck has no marker that is its frame; measure at a marker")
        return super()._centre(body)


def plant_in(mechanism: Mechanism) -> Plant:
    """Return the plant of a mechanism; markers that its outputs need are added to bodies."""
    found = Plant()
    for key, text in mechanism.variables.items():
        name = text.strip('"')
        if text == f'"{name}"' and name in mechanism.inputs:
            found.aliases[key] = name
    members = _members(mechanism.plants)
    taken = {found.aliases.get(key) for key in members["pinput"]}
    found.inputs = [name for name in mechanism.inputs if name not in taken]
    told = {f"VARVAL({key})": key for key in members["poutput"]}
    names = _Texts(mechanism)
    for name, output in mechanism.outputs.items():
        if output.text in told:
            found.names[told[output.text]] = name
            continue
        try:
            parts = names.outputs(output)
        except ModelError as error:
            found.left_out[name] = str(error).partition(";")[0]
            continue
        single = len(parts) == 1
        found.outputs |= {name if single else f"{name} {k}": one.expression for k, one in enumerate(parts, 1)}
    return found


def _members(plants: Mapping[tuple[str, Any], tuple[Any, ...]]) -> dict[str, list[Any]]:
    """Return the VARIABLEs of all PINPUTs and of all POUTPUTs."""
    found: dict[str, list[Any]] = {"pinput": [], "poutput": []}
    for (kind, _), members in plants.items():
        found[kind] += members
    return found


def plant_statements(w: WriterContext) -> None:
    """Write the VARIABLEs of outputs, then PINPUTs and POUTPUTs: those of the mechanism, and one each of the rest."""
    m, plant = w.mechanism, w.plant
    for (kind, key), members in m.plants.items():
        ids = ", ".join(str(w.variables[upper(member)]) for member in members)
        w.statement(f"{kind.upper()}/{w.plants[kind, upper(key)]}", [f"VARIABLES = {ids}"], str(key))
    for name, why in plant.left_out.items():
        w.comment(f"output '{name}' is left out: {why}")
    written, last = [], max(w.variables.values(), default=0)
    for name, text in plant.outputs.items():
        try:
            function = w.expression(text)
        except ModelError as error:
            w.comment(f"output '{name}' is left out: {error}")
            continue
        last += 1
        written.append(last)
        w.statement(f"VARIABLE/{last}", [f"FUNCTION = {function}"], name)
    fresh = len(m.plants) + 1
    given = [w.variables[upper(name)] for name in plant.inputs]
    for keyword, ids_of in (("PINPUT", given), ("POUTPUT", written)):
        if ids_of:
            w.statement(f"{keyword}/{fresh}", [f"VARIABLES = {', '.join(map(str, ids_of))}"])
