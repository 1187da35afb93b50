"""Joints, primitives, couplers, motions and general constraints of a mechanism as statements."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.adams.builders.constraints import JOINT_KINDS, JPRIM_KINDS
from gearmbs.adams.write.contacts import contact_statements
from gearmbs.adams.write.elements import KEYWORDS, as_expressions, element_arguments
from gearmbs.adams.write.gears import gear_solid_statements, gear_statements, is_gear_contact
from gearmbs.adams.write.text import COMPONENTS, COMPONENTS_OF, WriterContext, listed, number
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Torque
from gearmbs.mechanism.contacts import SolidContact
from gearmbs.mechanism.forces.friction import FrictionForce
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.elements import AXIS_FORCE, AXIS_TORQUE, LINE, Load
from gearmbs.mechanism.parts.elements import COMPONENTS as COMPONENT_MODE
from gearmbs.mechanism.parts.functions import function_text
from gearmbs.mechanism.parts.joints import Joint

STATEMENT_OF = {v: k for k, v in JOINT_KINDS.items()}
PRIMITIVE_OF = {v: k for k, v in JPRIM_KINDS.items()}


def joint_statement(joint: Joint) -> str:
    """Return the statement a joint of the mechanism is written as.

    Raises
    ------
    ModelError
        For a kind ADAMS does not have.
    """
    if joint.kind in STATEMENT_OF or joint.kind == "screw":
        return "JOINT"
    if joint.kind in PRIMITIVE_OF:
        return "JPRIM"
    table = {"coupler": "COUPLER", "rotation": "MOTION", "translation": "MOTION", "distance": "GCON"}
    if joint.kind not in table:
        raise ModelError(f"joint '{joint.name}': its kind {joint.kind} has no form in an ADAMS deck")
    return table[joint.kind]


def constraint_statements(w: WriterContext) -> None:
    """Write joints, primitives, couplers, motions and general constraints."""
    for name, joint in w.mechanism.joints.items():
        keyword = joint_statement(joint)
        head = f"{keyword}/{w.elements[keyword.lower(), name]}"
        i, j = f"I = {w.markers[id(joint.i)]}", f"J = {w.markers[id(joint.j)]}"
        if keyword == "JOINT":
            w.statement(head, [*_joint_type(w, joint), i, j], name)
        elif keyword == "JPRIM":
            w.statement(head, [PRIMITIVE_OF[joint.kind], i, j], name)
        elif keyword == "COUPLER":
            w.statement(head, _coupler(w, joint), name)
        elif keyword == "MOTION":
            w.statement(head, _motion(w, joint), name)
        else:
            length = joint.rows[0].function
            assert length is not None
            a, b = w.markers[id(joint.i)], w.markers[id(joint.j)]
            text = f"DM({a}, {b}) - {number(length.parameters[0] / w.units.length)}"
            w.statement(head, [i, f"FUNCTION = {text}"], name)
    for name, text in w.mechanism.constraints.items():
        w.statement(f"GCON/{w.elements['gcon', name]}", [f"FUNCTION = {w.expression(text)}"], name)


def _joint_type(w: WriterContext, joint: Joint) -> list[str]:
    if joint.kind != "screw":
        return [STATEMENT_OF[joint.kind]]
    angle = next(t for t in joint.rows[-1].terms if t.kind == terms.ANGLE)
    return ["SCREW", f"PITCH = {number(-2.0 * np.pi * angle.coefficient / w.units.length)}"]


def _joint_id(w: WriterContext, i: Marker, j: Marker) -> int:
    for name, joint in w.mechanism.joints.items():
        if joint.i is i and joint.j is j and joint_statement(joint) == "JOINT":
            return w.elements["joint", name]
    raise ModelError(f"no joint connects {i.name} and {j.name}; a motion or coupler of it cannot be written")


def _coupler(w: WriterContext, joint: Joint) -> list[str]:
    row = joint.rows[0].terms
    ids = [_joint_id(w, t.i, t.j) for t in row]
    scales = [t.coefficient if t.kind == terms.ANGLE else t.coefficient * w.units.length for t in row]
    kinds = ["R" if t.kind == terms.ANGLE else "T" for t in row]
    return [f"JOINTS = {', '.join(map(str, ids))}", f"TYPE = {':'.join(kinds)}", f"SCALES = {listed(scales)}"]


def _motion(w: WriterContext, joint: Joint) -> list[str]:
    row = joint.rows[0]
    rotational = joint.kind == "rotation"
    function = row.rotation if rotational else row.function
    assert function is not None
    scale = 1.0 if rotational else w.units.length
    head = [f"JOINT = {_joint_id(w, joint.i, joint.j)}", "ROTATIONAL" if rotational else "TRANSLATIONAL"]
    given = joint.prescribed
    if given is None:
        return [*head, f"FUNCTION = {w.expression(function_text(function, w.units.time, scale))}"]
    rate, change = scale / w.units.time, scale / w.units.time ** (1 if given.level == "velocity" else 2)
    text = w.expression(function_text(given.function, w.units.time, change))
    starts = [f"ICDISP = {number(given.start / scale)}"]
    if given.level == "acceleration":
        starts.append(f"ICVEL = {number(given.rate / rate)}")
    return [*head, given.level.upper(), *starts, f"FUNCTION = {text}"]


# Loads and force elements of a mechanism as statements.


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
