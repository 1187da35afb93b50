"""Joints, primitives, couplers, motions and general constraints of a mechanism as statements."""

from __future__ import annotations

import numpy as np

from gearmbs.adams.builders.constraints import JOINT_KINDS, JPRIM_KINDS
from gearmbs.adams.write.context import WriterContext
from gearmbs.adams.write.text import listed, number
from gearmbs.dae.equations import constraint_terms as terms
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.function_text import function_text
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.parts import Marker

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
