"""Joints, motions, forces, data and deforming bodies of a mechanism as statements.

Elements that keep their statement have what they were made from, in the mechanism's units, with them (``parameters``).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.adams.builders.constraints import JOINT_KINDS, JPRIM_KINDS
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import specs_of
from gearmbs.adams.write.contacts import contact_statements, gear_solid_statements
from gearmbs.adams.write.gear_expressions import gear_statements, is_gear_contact
from gearmbs.adams.write.plants import plant_statements
from gearmbs.adams.write.text import COMPONENTS, COMPONENTS_OF, WriterContext, listed, number, upper
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism, Torque
from gearmbs.mechanism.contacts import SolidContact
from gearmbs.mechanism.forces.friction import INPUTS, KINDS, JointFriction
from gearmbs.mechanism.forces.springs import LineSpring
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.elements import AXIS_FORCE, AXIS_TORQUE, LINE, ForceElement, Load, State
from gearmbs.mechanism.parts.elements import COMPONENTS as COMPONENT_MODE
from gearmbs.mechanism.parts.inputs import text_of, unit_factor
from gearmbs.mechanism.parts.joints import Joint
from gearmbs.mechanism.parts.modal import ModalBody, ShapedMarker

if TYPE_CHECKING:
    from gearmbs.flexible import ModalModel
    from gearmbs.mechanism.language.syntax import Units

INVARIANTS = {"full": "TTTTTTTTT", "partial": "TTTTFTTTF", "constant": "TTTTFTTFF"}
"""Inertia invariants that a level of coupling keeps; the reader knows the same."""
SAME = 1e-9
"""Difference of axes, and distance of places, m, up to which they are the same: rounding of a model's places."""
RIGID = 6
"""Rigid motions, which come first in the neutral files written here."""


# Variables, states, arrays and splines of a mechanism as statements.


def data_statements(w: WriterContext) -> None:
    """Write variables, states, arrays, plant inputs and outputs, and splines."""
    m = w.mechanism
    for key, text in m.variables.items():
        if upper(key) in w.hidden or key in w.plant.aliases:
            continue
        n = w.variables[upper(key)]
        w.statement(f"VARIABLE/{n}", [f"FUNCTION = {w.expression(text)}"], w.plant.names.get(key, str(key)))
    for made in w.numbers.values():
        value = made.start / unit_factor(w.units, made.unit)
        w.statement(f"VARIABLE/{w.variables[upper(made.name)]}", [f"FUNCTION = {number(value)}"], made.name)
    for key, state in w.all_states.items():
        if upper(key) in w.hidden:
            continue
        if state.algebraic:
            raise ModelError(f"state '{key}': an algebraic state cannot be written; use a variable")
        text = _times(w.expression(state.expression), w.units.time)
        arguments = [f"IC = {number(state.start)}", f"FUNCTION = {text}"]
        w.statement(f"DIFF/{w.states[upper(key)]}", arguments, str(key))
    for key, values in m.arrays.items():
        w.statement(f"ARRAY/{w.arrays[upper(key)]}", ["IC", f"NUMBERS = {listed(values)}"], str(key))
    plant_statements(w)
    for key, data in m.splines.items():
        arguments = [f"X = {listed(data.x)}"]
        if data.z:
            arguments += [f"Y = {number(z)}, {listed(row)}" for z, row in zip(data.z, data.y)]
        else:
            arguments.append(f"Y = {listed(data.y[0])}")
        if data.linear_extrapolate:
            arguments.append("LINEAR_EXTRAPOLATE")
        w.statement(f"SPLINE/{w.splines[upper(key)]}", arguments, str(key))


def _times(text: str, factor: float) -> str:
    return text if factor == 1.0 else f"{number(factor)}*({text})"


KEYWORDS = {
    "springdamper": "SPRINGDAMPER", "bushing": "BUSHING", "field": "FIELD", "beam": "BEAM", "friction": "FRICTION",
}  # fmt: skip


def kept(mechanism: Mechanism) -> dict[str, str]:
    """Return the loads that keep their statement: name -> kind."""
    found = {}
    for name, load in mechanism.elements.items():
        made = getattr(load, "parameters", None) is not None and load.kind in KEYWORDS
        if made and not isinstance(load, Load):
            if load.kind != "friction" or not _used_elsewhere(mechanism, name, load):
                found[name] = load.kind
    return found


def hidden(mechanism: Mechanism) -> set[str]:
    """Return the names, in capitals, of the variables and states that FRICTION statements stand for."""
    keys: set[str] = set()
    for name, kind in kept(mechanism).items():
        if kind == "friction":
            keys |= {key.upper() for key in _parameters(mechanism.elements[name])["keys"]}
    return keys


def element_arguments(writer: WriterContext, load: Any) -> list[str]:
    """Return the arguments of the statement a load was made from, numbers in the mechanism's units."""
    p = _parameters(load)
    if load.kind == "friction":
        return _friction(writer, p["joint"], p["friction"])
    ends = [f"I = {writer.markers[id(load.i)]}", f"J = {writer.markers[id(load.j)]}"]
    if load.kind == "springdamper":
        kind, *numbers = _spring(load, p, writer.units)
        return [kind, *ends, *numbers]
    return [*ends, *{"bushing": _bushing, "field": _field, "beam": _beam}[load.kind](p)]


def as_expressions(element: Any, units: Units) -> Any:
    """Return the load by expressions that stands for an element, as a friction; those without one as they are."""
    made = element.by_expressions(units) if isinstance(element, ForceElement) else None
    return element if made is None else made[0]


def states_of(mechanism: Mechanism) -> dict[Any, State]:
    """Return the states that are written: those of the mechanism, and of elements that are written as expressions."""
    found: dict[Any, State] = dict(mechanism.states)
    whole = kept(mechanism)
    for name, element in mechanism.elements.items():
        made = element.by_expressions(mechanism.units) if isinstance(element, ForceElement) else None
        if made is not None and name not in whole:
            found |= {state: State(state, text, start) for state, (text, start) in made[1].items()}
    return found


def _parameters(load: Any) -> Mapping[str, Any]:
    return load.parameters or {}


def _used_elsewhere(mechanism: Mechanism, name: str, load: Load) -> bool:
    """Whether other expressions use the variables of a friction, so that they must be written."""
    keys = {key.upper() for key in _parameters(load)["keys"]}
    texts = [str(text) for key, text in mechanism.variables.items() if str(key).upper() not in keys]
    texts += [state.expression for key, state in mechanism.states.items() if str(key).upper() not in keys]
    texts += [text for constraint in mechanism.constraints.values() for text in constraint.rows.values()]
    for other, element in mechanism.elements.items():
        if other != name and isinstance(element, Load):
            texts += [text for text in element.expressions if text]
    used = "\n".join(texts).upper()
    return any(key in used for key in keys)


def _spring(load: Any, p: Mapping[str, Any], units: Units) -> list[str]:
    line = isinstance(load, LineSpring)
    out = ["TRANSLATIONAL" if line else "ROTATIONAL"]
    for word, key in zip(("K", "C", "LENGTH", "FORCE") if line else ("KT", "CT", "ANGLE", "TORQUE"), load.dimensions):
        # a number that has been changed since it was given is written as it is now
        given, now, factor = p[key], getattr(load, key), units.factor(load.dimensions[key])
        out.append(f"{word} = {number(given if given * factor == now else now / factor)}")
    return out


def _bushing(p: Mapping[str, Any]) -> list[str]:
    words = {"K": "stiffness", "KT": "torsional_stiffness", "C": "damping", "CT": "torsional_damping"}
    out = [f"{w} = {listed(p[key])}" for w, key in words.items()]
    preload = p.get("preload")
    if preload is not None and np.any(preload):
        out += [f"FORCE = {listed(preload[:3])}", f"TORQUE = {listed(preload[3:])}"]
    return out


def _field(p: Mapping[str, Any]) -> list[str]:
    """A FIELD's matrices are written by columns."""
    out = [f"KMATRIX = {listed(np.asarray(p['stiffness']).T.ravel())}"]
    if np.any(p["damping"]):
        out.append(f"CMATRIX = {listed(np.asarray(p['damping']).T.ravel())}")
    return [*out, f"LENGTH = {listed(p['free'])}", f"FORCE = {listed(p['preload'])}"]


def _beam(p: Mapping[str, Any]) -> list[str]:
    out = [f"{w} = {number(p[key])}" for w, key in (("LENGTH", "length"), ("AREA", "area"))]
    out += [f"{w} = {number(v)}" for w, v in zip(("IXX", "IYY", "IZZ"), p["second_moments"])]
    out += [f"{w} = {number(v)}" for w, v in zip(("ASY", "ASZ"), p["shear_ratios"])]
    out += [f"EMODULUS = {number(p['modulus'])}", f"GMODULUS = {number(p['shear_modulus'])}"]
    damping = p.get("damping")
    if damping is None:
        return [*out, f"CRATIO = {number(p['damping_ratio'])}"]
    # the lower triangle by columns is the upper one by rows
    return [*out, f"CMATRIX = {listed(damping[np.triu_indices(6)])}"]


def _friction(writer: WriterContext, joint: Joint, f: JointFriction) -> list[str]:
    inputs = [i for i in INPUTS if i in f.inputs and _matters(joint, f, i)]
    out = [
        f"JOINT = {writer.elements['joint', joint.name]}",
        f"MU_STATIC = {number(f.mu_static)}",
        f"MU_DYNAMIC = {number(f.mu_dynamic)}",
        f"STICTION_TRANSITION_VELOCITY = {number(f.stiction_transition_velocity)}",
        f"MAX_STICTION_DEFORMATION = {number(f.max_stiction_deformation)}",
        f"EFFECT = {f.effect.upper()}",
        f"INPUTS = {':'.join(i.upper() for i in inputs) or 'NONE'}",
    ]
    kind, specs = KINDS[joint.kind], specs_of(st.Friction)
    if kind.force:
        out.append(f"FRICTION_FORCE_PRELOAD = {number(f.preload_force)}")
    if kind.torque:
        out.append(f"FRICTION_TORQUE_PRELOAD = {number(f.preload_torque)}")
    for field in kind.lengths:
        value = getattr(f, field)
        if value > 0.0 or field == "friction_arm":
            out.append(f"{specs[field].keyword} = {number(value)}")
    if "overlap" in kind.lengths:
        out.append(f"OVERLAP_DELTA = {f.overlap_change.upper()}")
    if kind.yoke:
        out.append(f"YOKE = {f.yoke.upper()}_YOKE")
    for word, most in (("MAX_FRICTION_FORCE", f.max_force), ("MAX_FRICTION_TORQUE", f.max_torque)):
        if most is not None:
            out.append(f"{word} = {number(most)}")
    return out


def _matters(joint: Joint, f: JointFriction, item: str) -> bool:
    """Whether an input has an effect on the joint: a length of zero switches a moment off."""
    if item == "preload":
        return True
    pressing = KINDS[joint.kind].pressing
    if item not in pressing:
        return False
    length = pressing[item]
    return length is None or getattr(f, length) > 0.0


# Joints, primitives, couplers, motions and general constraints, and the loads.


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
        raise ModelError(
            f"joint '{joint.name}': its kind {joint.kind} has no form in an ADAMS deck; write the deck without it and "
            "add the statement of a joint that holds as much"
        )
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
    for own, constraint in w.mechanism.constraints.items():
        for name, text in constraint.named(own).items():
            w.statement(f"GCON/{w.elements['gcon', name]}", [f"FUNCTION = {w.expression(text)}"], name)


def _joint_type(w: WriterContext, joint: Joint) -> list[str]:
    if joint.kind != "screw":
        return [STATEMENT_OF[joint.kind]]
    angle = next(t for t in joint.rows[-1].terms if t.kind == terms.ANGLE)
    return ["SCREW", f"PITCH = {number(-2.0 * np.pi * angle.coefficient / w.units.length)}"]


def _joint_id(w: WriterContext, i: Marker, j: Marker) -> int:
    """Return the id of the JOINT between two markers, or of one about their axis that measures the same angle.

    Raises
    ------
    ModelError
        If there is none.
    """
    for name, joint in w.mechanism.joints.items():
        if joint.i is i and joint.j is j and joint_statement(joint) == "JOINT":
            return w.elements["joint", name]
    for name, joint in w.mechanism.joints.items():
        between = joint.i.body is i.body and joint.j.body is j.body
        if joint.kind == "revolute" and between and _along(joint.i, i) and _along(joint.j, j):
            return w.elements["joint", name]
    raise ModelError(
        f"no joint connects {i.name} and {j.name}; a motion or coupler of it cannot be written: it needs a revolute "
        f"joint about that axis between '{i.body.name}' and '{j.body.name}', in a drivetrain a shaft with one "
        "IdealBearing"
    )


def _along(one: Marker, two: Marker) -> bool:
    """Whether two markers of a body have the same axes but for rounding, and one z axis."""
    axes = two.global_orientation()
    apart = axes.T @ (one.global_position() - two.global_position())
    return bool(np.abs(axes - one.global_orientation()).max() <= SAME and np.abs(apart[:2]).max() <= SAME)


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
        return [*head, f"FUNCTION = {w.expression(text_of(function, w.units, scale))}"]
    rate, change = scale / w.units.time, scale / w.units.time ** (1 if given.level == "velocity" else 2)
    text = w.expression(text_of(given.function, w.units, change))
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
    elif isinstance(made := as_expressions(element, w.units), Load):
        _load(w, name, made)
    elif isinstance(element, Torque):
        text = w.expression(text_of(element.function, w.units, w.units.factor("torque")))
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
            f"{element.instead}"
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


# Bodies that deform by modes as FLEX_BODY statements with modal neutral files beside the deck.


def flex_body_arguments(
    writer: WriterContext, body: ModalBody, markers: Sequence[Marker]
) -> tuple[list[str], dict[int, int]]:
    """Write the neutral file of a body and return what its statement says of it, and the nodes of its markers.

    Parameters
    ----------
    writer : WriterContext
    body : ModalBody
        Added by :meth:`gearmbs.flexible.ModalModel.add_to`.
    markers : sequence of Marker
        On it, that are written.

    Returns
    -------
    arguments : list of str
        Without place and velocity; the damping has to stay the last.
    nodes : dict of int to int
        Node of each marker, by ``id(marker)``. A marker that is at no node gets one without mass, which moves like it.

    Raises
    ------
    ModelError
        If the body cannot be in such a file, or the deck is not written to one.
    """
    from gearmbs.flexible.material import FlexibleError
    from gearmbs.flexible.mnf import mnf_of, with_seat_nodes, write_mnf
    from gearmbs.flexible.modal_model import Seat

    label = f"body '{body.name}'"
    origin = body.origin
    if origin is None:
        raise ModelError(
            f"{label}: it deforms by modes without a model behind them, which a modal neutral file needs; add it by "
            "ModalModel.add_to, or put a rigid body in its place (Mechanism.body)"
        )
    if origin.model.stiffened:
        raise ModelError(f"{label}: a modal neutral file has no stiffening by spin; reduce it without spin=")
    if writer.path is None:
        raise ModelError(f"{label}: its modal neutral file stands beside the deck; give the deck's path")
    seats = dict(origin.model.seats)
    for marker in markers:
        if isinstance(marker, ShapedMarker):
            raise ModelError(
                f"{label}: {marker.name} has shapes of its own, as those of modal forces; a deck has markers at nodes"
            )
        seats[_seat(marker)] = Seat(marker.position, *origin.model.shapes(marker.position))
    try:
        model, nodes = with_seat_nodes(replace(origin.model, seats=seats))
        content = mnf_of(model)
    except FlexibleError as error:
        raise ModelError(f"{label}: {error}") from error
    path = Path(writer.path)
    file = path.with_name(f"{path.stem}_{re.sub(r'[^A-Za-z0-9]+', '_', body.name).strip('_')}.mnf")
    write_mnf(file, content)
    arguments = [f"MNF_FILE = {file.name}"]
    words = ("TRUE" if letter == "T" else "FALSE" for letter in INVARIANTS[origin.coupling])
    arguments.append(f"INVARIANTS = {':'.join(words)}")
    if np.any(body.start):
        arguments.append(f"DMODE = {listed(body.start)}")
    if np.any(body.rate):
        arguments.append(f"VMODE = {listed(body.rate * writer.units.time)}")
    arguments.append(f"CRATIO = {damping_text(origin.ratios)}")
    return arguments, {id(marker): nodes[_seat(marker)] for marker in markers}


def nearest_node(model: ModalModel) -> np.ndarray:
    """Return the place of the node nearest to the centre of mass, m."""
    return model.positions[int(np.argmin(np.linalg.norm(model.positions - model.properties.com, axis=1)))].copy()


def damping_text(ratios: np.ndarray) -> str:
    """Return the damping ratios of elastic modes as an expression in FXMODE, the number of the mode in its file."""
    text = repr(float(ratios[-1]))
    for k in range(len(ratios) - 1, 0, -1):
        if ratios[k - 1] != ratios[k]:
            below = repr(float(ratios[k - 1]))
            text = f"IF(FXMODE - {RIGID + k + 0.5}: {below}, {below}, {text})"
    return text


def _seat(marker: Marker) -> str:
    return f"marker {id(marker)}"
