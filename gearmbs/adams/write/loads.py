"""Loads and force elements of a mechanism as statements."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.adams.write.contacts import contact_statements
from gearmbs.adams.write.context import COMPONENTS, COMPONENTS_OF, WriterContext
from gearmbs.adams.write.elements import KEYWORDS, as_expressions, element_arguments
from gearmbs.adams.write.gear_solids import gear_solid_statements
from gearmbs.adams.write.gears import gear_statements, is_gear_contact
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism import Torque
from gearmbs.mechanism.contacts import SolidContact
from gearmbs.mechanism.elements import AXIS_FORCE, AXIS_TORQUE, LINE, Load
from gearmbs.mechanism.elements import COMPONENTS as COMPONENT_MODE
from gearmbs.mechanism.forces.friction_force import FrictionForce
from gearmbs.mechanism.function_text import function_text
from gearmbs.mechanism.parts import Marker


def load_statement(element: Any) -> str:
    """Return the statement for an element given by expressions."""
    if not isinstance(element, Load):
        return "GFORCE"
    if element.mode == LINE or (element.mode == AXIS_TORQUE and element.rm is element.j):
        return "SFORCE"
    given = {c for c, e in zip(COMPONENTS, element.expressions) if e is not None}
    if element.mode == COMPONENT_MODE:
        if element.kind == "sforce" and given == {"TZ"} and element.rm is element.j:
            return "SFORCE"
        for kind, keyword in (("vforce", "VFORCE"), ("vtorque", "VTORQUE")):
            if element.kind == kind and given <= set(COMPONENTS_OF[keyword]):
                return keyword
    return "GFORCE"


def element_statements(w: WriterContext, name: str, element: Any) -> None:
    """Write the statements of a force element: its own, expressions, or contacts of solids."""
    if name in w.kept:
        kind = w.kept[name]
        w.statement(f"{KEYWORDS[kind]}/{w.elements[kind, name]}", element_arguments(w, element), name)
    elif isinstance(element, Load | FrictionForce):
        _load(w, name, as_expressions(element))
    elif isinstance(element, Torque):
        text = w.expression(function_text(element.function, w.units.time, w.units.factor("torque")))
        _gforce(w, name, element.i, element.j, element.axis, {"TZ": text})
    elif isinstance(element, SolidContact):
        contact_statements(w, name, element)
    elif is_gear_contact(element) and w.gears == "solids":
        gear_solid_statements(w, name, element)
    elif is_gear_contact(element):
        gear_statements(w, name, element)
    else:
        raise ModelError(
            f"{element.kind} '{name}': it has a compiled function of its own, which has no form in an ADAMS deck; "
            "describe it by expressions (Mechanism.load) or take it out of the mechanism first"
        )


def _load(w: WriterContext, name: str, load: Load) -> None:
    keyword = load_statement(load)
    if keyword == "SFORCE":
        text = w.expression(next(e for e in load.expressions if e is not None) or "0")
        ends = [f"I = {w.markers[id(load.i)]}", f"J = {w.markers[id(load.j)]}"]
        kind = "TRANSLATIONAL" if load.mode == LINE else "ROTATIONAL"
        w.statement(f"SFORCE/{w.elements['sforce', name]}", [kind, *ends, f"FUNCTION = {text}"], name)
        return
    slots = {AXIS_FORCE: ("FZ",), AXIS_TORQUE: ("TZ",)}.get(load.mode, COMPONENTS)
    given = {c: w.expression(e) for c, e in zip(slots, load.expressions) if e is not None}
    _gforce(w, name, load.i, load.j, load.rm, given, keyword)


def _gforce(
    w: WriterContext, name: str, i: Marker, j: Marker, rm: Marker, given: dict[str, str], keyword: str = "GFORCE"
) -> None:
    floating = w.new_marker(j.body, np.zeros(3), np.eye(3), floating=True)
    w.gforce(name, w.markers[id(i)], floating, w.markers[id(rm)], given, keyword)
