"""Write a Mechanism as an .adm deck: ``write_deck``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gearmbs.adams.builders.constraints import JOINT_KINDS, JPRIM_KINDS
from gearmbs.adams.parse.units import TABLES
from gearmbs.adams.write.contacts import contact_statements
from gearmbs.adams.write.elements import KEYWORDS, as_expressions, element_arguments, hidden, kept, states_of
from gearmbs.adams.write.flexible import flex_body_arguments, nearest_node
from gearmbs.adams.write.gear_solids import gear_solid_statements
from gearmbs.adams.write.gears import gear_statements, is_gear_contact
from gearmbs.adams.write.output import integrator_statement, request_statements
from gearmbs.adams.write.text import listed, number, wrapped
from gearmbs.dae.equations import constraint_terms as terms
from gearmbs.dae.equations.rotation import euler_from_matrix
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism import Mechanism, Torque
from gearmbs.mechanism.contacts import SolidContact
from gearmbs.mechanism.elements import AXIS_FORCE, AXIS_TORQUE, LINE, Load
from gearmbs.mechanism.elements import COMPONENTS as COMPONENT_MODE
from gearmbs.mechanism.expression_functions import ELEMENT_FORCES
from gearmbs.mechanism.expression_syntax import Call, Name, Node, Number, parse, shown, unparse
from gearmbs.mechanism.forces.friction_force import FrictionForce
from gearmbs.mechanism.function_text import function_text
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.modal import ModalBody
from gearmbs.mechanism.parts import Body, Marker

STATEMENT_OF = {v: k for k, v in JOINT_KINDS.items()}
PRIMITIVE_OF = {v: k for k, v in JPRIM_KINDS.items()}
PLANTS = {"PINVAL": "pinput", "POUVAL": "poutput"}
COMPONENTS = ("FX", "FY", "FZ", "TX", "TY", "TZ")
COMPONENTS_OF = {"GFORCE": COMPONENTS, "VFORCE": COMPONENTS[:3], "VTORQUE": COMPONENTS[3:]}


def write_deck(
    mechanism: Mechanism,
    path: str | Path | None = None,
    *,
    title: str | None = None,
    output: bool = True,
    requests: Mapping[str, str | Sequence[str]] | None = None,
    integrator: str | None = None,
    formulation: str = "SI2",
    tol: float | None = None,
    max_step: float | None = None,
    gears: Literal["expressions", "solids"] = "expressions",
) -> str:
    """Write a mechanism as an .adm file, in the mechanism's units.

    Contacts of solids become GRAPHICS and CONTACTs, meshes .obj files beside the deck. Contacts of gears with parallel
    axes become GFORCEs of IMPACT expressions along both lines of action; their friction and the contact of tooth
    corners beyond the path of contact are left out, as comments say. Or they become CONTACTs of solids. Bodies that
    deform by modes become FLEX_BODYs with modal neutral files beside the deck.

    Parameters
    ----------
    mechanism : Mechanism
    path : path, optional
        File to write; without it the text is only returned.
    title : str, optional
        First line; default: the mechanism's name.
    output : bool
        Ask for the request file and the results file (OUTPUT/REQSAVE, RESULTS/XRF), with requests for the position and
        velocity of every body and the forces of all elements.
    requests : mapping of str to str or sequence of str, optional
        More requests by name: up to six expressions in the mechanism's function language.
    integrator, formulation : str, optional
        INTEGRATOR's method, GSTIFF or WSTIFF, and formulation; written when the method or one of the next is given.
    tol : float, optional
        Its ERROR.
    max_step : float, optional
        Its HMAX, s.
    gears : {"expressions", "solids"}
        ``solids``: gear contacts become CONTACTs between meshes of the wheels, in .obj files beside the deck. Comments
        hold the whole pair, so that the deck, read back here, has the exact contact again, with friction and faults.

    Returns
    -------
    str
        The deck.

    Raises
    ------
    ModelError
        Naming what cannot be written.
    """
    if gears not in ("expressions", "solids"):
        raise ModelError(f"gears = {gears!r}; choose 'expressions' or 'solids'")
    writer = DeckWriter(mechanism, path, gears)
    writer.model(title)
    request_statements(writer, requests or {}, output)
    if output:
        writer.statement("OUTPUT/REQSAVE", [])
        writer.statement("RESULTS/XRF", [])
    integrator_statement(writer, integrator, formulation, tol, max_step)
    text = "\n".join([*writer.lines, "END"]) + "\n"
    if path is not None:
        Path(path).write_text(text, encoding="utf-8", newline="\n")
    return text


class DeckWriter:
    """Numbers the parts of a mechanism and writes their statements."""

    def __init__(self, mechanism: Mechanism, path: str | Path | None = None, gears: str = "expressions") -> None:
        self.mechanism = mechanism
        self.path = path
        self.gears = gears
        self.units = mechanism.units
        self.lines: list[str] = []
        self.bodies: dict[int, int] = {}
        self.markers: dict[int, int] = {}
        self.marker_names: dict[str, int] = {}
        self.elements: dict[tuple[str, str], int] = {}
        self.centers: dict[int, int] = {}
        self.kept = kept(mechanism)
        self._hidden = hidden(mechanism)
        self.variables = self._numbered(mechanism.variables)
        self.all_states = states_of(mechanism)
        self.states = self._numbered(self.all_states)
        self.splines = {_upper(k): n for n, k in enumerate(mechanism.splines, 1)}
        self.arrays = {_upper(k): n for n, k in enumerate(mechanism.arrays, 1)}
        self.plants = {(kind, _upper(k)): n for n, (kind, k) in enumerate(mechanism.plants, 1)}
        self._next_marker = 1
        self._solids = 0

    def _numbered(self, table: Iterable[Any]) -> dict[Any, int]:
        """Number variables or states, without those that a statement stands for."""
        return {_upper(k): n for n, k in enumerate((k for k in table if _upper(k) not in self._hidden), 1)}

    def model(self, title: str | None) -> None:
        """Write the title and all that moves."""
        self.lines = [" ".join((title or self.mechanism.name).split()) or "mechanism", "!"]
        self._units()
        self._number()
        self._parts()
        self._constraints()
        self._data()
        for name, element in self.mechanism.elements.items():
            self._element(name, element)
        g = self.mechanism.gravity / self.units.factor("acceleration")
        if np.any(g != 0.0):
            keys = ("IGRAV", "JGRAV", "KGRAV")
            self.statement("ACCGRAV/", [f"{k} = {number(v)}" for k, v in zip(keys, g) if v != 0.0])

    # --- pieces -------------------------------------------------------------------------------------

    def statement(self, head: str, arguments: Iterable[str], name: str | None = None) -> None:
        """Append a statement, one argument a line, with its name in a comment in front."""
        if name:
            self.lines.append(f"!   adams_view_name='{name}'")
        self.lines.append(head)
        for argument in arguments:
            self.lines.extend(wrapped(argument))

    def comment(self, text: str) -> None:
        """Append a comment."""
        self.lines.append(f"! {text}")

    def new_marker(self, body: Body, position: np.ndarray, axes: np.ndarray, floating: bool = False) -> int:
        """Write a marker on a body and return its id."""
        if isinstance(body, ModalBody):
            raise ModelError(
                f"body '{body.name}': a force needs a {'floating ' * floating}marker on it, and it deforms; let the "
                "force's J marker be on the other body"
            )
        number_ = self._next_marker
        self._next_marker += 1
        arguments = [f"PART = {self.bodies[id(body)]}"]
        if floating:
            arguments.append("FLOATING")
        else:
            arguments += self._frame("QP", position, axes)
        self.statement(f"MARKER/{number_}", arguments)
        return number_

    def graphics(self, arguments: Iterable[str], name: str) -> int:
        """Write a GRAPHICS and return its id."""
        self._solids += 1
        self.statement(f"GRAPHICS/{self._solids}", arguments, name)
        return self._solids

    def _frame(self, keyword: str, position: np.ndarray, axes: np.ndarray) -> list[str]:
        out = []
        if np.any(position != 0.0):
            out.append(f"{keyword} = {listed(position / self.units.length)}")
        if np.abs(axes - np.eye(3)).max() > 1e-15:
            out.append(f"REULER = {listed(euler_from_matrix(axes))}")
        return out

    def expression(self, text: str) -> str:
        """Return an expression with names replaced by ids."""

        def rename(call: Call) -> Call:
            if call.name == "INTEGRAL":
                raise ModelError(
                    f"{shown(text)}: ADAMS has no function INTEGRAL; give a motion by its velocity to a joint, "
                    "or use a differential state"
                )
            if call.name in ("MODAL", "MODAL1"):
                raise ModelError(f"{shown(text)}: ADAMS has no function {call.name}; use markers at nodes instead")
            call = replace(call, args=tuple(self._argument(call, k, a) for k, a in enumerate(call.args)))
            return self._element_call(call) if call.name in ELEMENT_FORCES else call

        return unparse(parse(text), rename)

    def _argument(self, call: Call, position: int, arg: Node) -> Node:
        """Replace the name of a marker or data element by its id."""
        key: Any = arg.text if isinstance(arg, Name) else arg.integer if isinstance(arg, Number) else None
        table: dict[Any, int] = {}
        if call.name == "VARVAL":
            table = self.variables if key in self.variables else self.states
        elif call.name in ("DIF", "DIF1"):
            table = self.states
        elif call.name in ("CUBSPL", "AKISPL") and position == 2:
            table = self.splines
        elif call.name == "ARYVAL" and position == 0:
            table = self.arrays
        elif call.name in PLANTS and position == 0:
            table = {k: n for (kind, k), n in self.plants.items() if kind == PLANTS[call.name]}
        elif isinstance(arg, Name) and (call.name not in ELEMENT_FORCES or position > 0):
            table = self.marker_names
        return Number(float(table[key]), arg.at, table[key]) if key in table else arg

    def _element_call(self, call: Call) -> Call:
        """Ask for an element's force under the statement it is written as."""
        first = call.args[0] if call.args else None
        if isinstance(first, Name):
            for (kind, name), n in self.elements.items():
                if name.upper() == first.text:
                    keyword = next(k for k, v in ELEMENT_FORCES.items() if v == kind)
                    return replace(call, name=keyword, args=(Number(float(n), first.at, n), *call.args[1:]))
        return call

    # --- sections -----------------------------------------------------------------------------------

    def _units(self) -> None:
        names = []
        for quantity, table in TABLES.items():
            value = getattr(self.units, quantity)
            found = [n for n, v in table.items() if abs(v - value) <= 1e-12 * value]
            if not found:
                raise ModelError(f"units: {value} SI is no unit of {quantity} that ADAMS knows; change mechanism.units")
            names.append(f"{quantity.upper()} = {found[0]}")
        self.statement("UNITS/", names)

    def _number(self) -> None:
        m = self.mechanism
        for n, body in enumerate((m.ground, *m.bodies.values()), 1):
            self.bodies[id(body)] = n
        used = {mk.number for body in (m.ground, *m.bodies.values()) for mk in body.markers if mk.number}
        fresh = (n for n in range(1, 10**9) if n not in used)
        for body in (m.ground, *m.bodies.values()):
            for marker in body.markers:
                self.markers[id(marker)] = marker.number or next(fresh)
                self.marker_names[marker.name.upper()] = self.markers[id(marker)]
        self._next_marker = max(self.markers.values(), default=0) + 1
        counts: dict[str, int] = {}
        for name, kind in self._kinds():
            counts[kind] = counts.get(kind, 0) + 1
            self.elements[kind, name] = counts[kind]

    def _kinds(self) -> Iterable[tuple[str, str]]:
        for name, joint in self.mechanism.joints.items():
            yield name, joint_statement(joint).lower()
        for name in self.mechanism.constraints:
            yield name, "gcon"
        for name, element in self.mechanism.elements.items():
            solid = isinstance(element, SolidContact) or (self.gears == "solids" and is_gear_contact(element))
            yield name, "contact" if solid else self.kept.get(name) or load_statement(as_expressions(element)).lower()

    def _parts(self) -> None:
        for body in (self.mechanism.ground, *self.mechanism.bodies.values()):
            n = self.bodies[id(body)]
            if body.is_ground:
                self.statement(f"PART/{n}", ["GROUND"], "ground")
            elif isinstance(body, ModalBody):
                self._flex_body(body, n)
                continue
            else:
                self._part(body, n)
            for marker in body.markers:
                arguments = [f"PART = {n}", *self._frame("QP", marker.position, marker.orientation)]
                self.statement(f"MARKER/{self.markers[id(marker)]}", arguments, marker.name)

    def _part(self, body: Body, n: int) -> None:
        units = self.units
        own = self._center(body)
        cm = self.centers[id(body)] = self.markers[id(own)] if own is not None else self._next_marker
        i = body.inertia / units.factor("inertia")
        inertia = [i[0, 0], i[1, 1], i[2, 2], -i[0, 1], -i[0, 2], -i[1, 2]]
        if not any(inertia[3:]):
            inertia = inertia[:3]
        arguments = [f"MASS = {number(body.mass / units.mass)}", f"CM = {cm}", f"IP = {listed(inertia)}"]
        self.statement(f"PART/{n}", [*arguments, *self._start(body)], body.name)
        if own is None:
            self._next_marker += 1
            self.statement(f"MARKER/{cm}", [f"PART = {n}", *self._frame("QP", body.com, np.eye(3))])

    def _start(self, body: Body) -> list[str]:
        """Return where a body starts, and the velocity of its centre of mass."""
        arm = body.orientation @ body.com
        velocity = (body.velocity + np.cross(body.angular_velocity, arm)) / self.units.factor("velocity")
        spin = body.orientation.T @ body.angular_velocity / self.units.factor("angular_velocity")
        return [
            *self._frame("QG", body.position, body.orientation),
            *(f"V{a} = {number(v)}" for a, v in zip("XYZ", velocity) if v != 0.0),
            *(f"W{a} = {number(v)}" for a, v in zip("XYZ", spin) if v != 0.0),
        ]

    def _flex_body(self, body: ModalBody, n: int) -> None:
        markers = list(body.markers)
        if not markers and body.origin is not None:
            # something has to be asked for; the mechanism does not get it
            markers = [Marker(f"{body.name}.node", body, nearest_node(body.origin.model), np.eye(3))]
            self.markers[id(markers[0])] = self._next_marker
            self._next_marker += 1
        arguments, nodes = flex_body_arguments(self, body, markers)
        self.statement(f"FLEX_BODY/{n}", [*self._start(body), *arguments], body.name)
        for marker in markers:
            own = [f"FLEX_BODY = {n}", f"NODE_ID = {nodes[id(marker)]}"]
            own += self._frame("QP", marker.position, marker.orientation)
            self.statement(f"MARKER/{self.markers[id(marker)]}", own, marker.name)
        self.centers[id(body)] = self.markers[id(markers[0])]

    @staticmethod
    def _center(body: Body) -> Marker | None:
        """Return a marker at the centre of mass along the body's axes."""
        there = (m for m in body.markers if np.array_equal(m.position, body.com))
        return next((m for m in there if np.array_equal(m.orientation, np.eye(3))), None)

    def _constraints(self) -> None:
        for name, joint in self.mechanism.joints.items():
            keyword = joint_statement(joint)
            head = f"{keyword}/{self.elements[keyword.lower(), name]}"
            i, j = f"I = {self.markers[id(joint.i)]}", f"J = {self.markers[id(joint.j)]}"
            if keyword == "JOINT":
                self.statement(head, [*self._joint_type(joint), i, j], name)
            elif keyword == "JPRIM":
                self.statement(head, [PRIMITIVE_OF[joint.kind], i, j], name)
            elif keyword == "COUPLER":
                self.statement(head, self._coupler(joint), name)
            elif keyword == "MOTION":
                self.statement(head, self._motion(joint), name)
            else:
                length = joint.rows[0].function
                assert length is not None
                a, b = self.markers[id(joint.i)], self.markers[id(joint.j)]
                text = f"DM({a}, {b}) - {number(length.parameters[0] / self.units.length)}"
                self.statement(head, [i, f"FUNCTION = {text}"], name)
        for name, text in self.mechanism.constraints.items():
            self.statement(f"GCON/{self.elements['gcon', name]}", [f"FUNCTION = {self.expression(text)}"], name)

    def _joint_type(self, joint: Joint) -> list[str]:
        if joint.kind != "screw":
            return [STATEMENT_OF[joint.kind]]
        angle = next(t for t in joint.rows[-1].terms if t.kind == terms.ANGLE)
        return ["SCREW", f"PITCH = {number(-2.0 * np.pi * angle.coefficient / self.units.length)}"]

    def _joint_id(self, i: Marker, j: Marker) -> int:
        for name, joint in self.mechanism.joints.items():
            if joint.i is i and joint.j is j and joint_statement(joint) == "JOINT":
                return self.elements["joint", name]
        raise ModelError(f"no joint connects {i.name} and {j.name}; a motion or coupler of it cannot be written")

    def _coupler(self, joint: Joint) -> list[str]:
        row = joint.rows[0].terms
        ids = [self._joint_id(t.i, t.j) for t in row]
        scales = [t.coefficient if t.kind == terms.ANGLE else t.coefficient * self.units.length for t in row]
        kinds = ["R" if t.kind == terms.ANGLE else "T" for t in row]
        return [f"JOINTS = {', '.join(map(str, ids))}", f"TYPE = {':'.join(kinds)}", f"SCALES = {listed(scales)}"]

    def _motion(self, joint: Joint) -> list[str]:
        row = joint.rows[0]
        rotational = joint.kind == "rotation"
        function = row.rotation if rotational else row.function
        assert function is not None
        scale = 1.0 if rotational else self.units.length
        head = [f"JOINT = {self._joint_id(joint.i, joint.j)}", "ROTATIONAL" if rotational else "TRANSLATIONAL"]
        given = joint.prescribed
        if given is None:
            return [*head, f"FUNCTION = {self.expression(function_text(function, self.units.time, scale))}"]
        rate, change = scale / self.units.time, scale / self.units.time ** (1 if given.level == "velocity" else 2)
        text = self.expression(function_text(given.function, self.units.time, change))
        starts = [f"ICDISP = {number(given.start / scale)}"]
        if given.level == "acceleration":
            starts.append(f"ICVEL = {number(given.rate / rate)}")
        return [*head, given.level.upper(), *starts, f"FUNCTION = {text}"]

    def _data(self) -> None:
        m = self.mechanism
        for key, text in m.variables.items():
            if _upper(key) in self._hidden:
                continue
            n = self.variables[_upper(key)]
            self.statement(f"VARIABLE/{n}", [f"FUNCTION = {self.expression(text)}"], str(key))
        for key, state in self.all_states.items():
            if _upper(key) in self._hidden:
                continue
            if state.algebraic:
                raise ModelError(f"state '{key}': an algebraic state cannot be written; use a variable")
            text = _times(self.expression(state.expression), self.units.time)
            arguments = [f"IC = {number(state.start)}", f"FUNCTION = {text}"]
            self.statement(f"DIFF/{self.states[_upper(key)]}", arguments, str(key))
        for key, values in m.arrays.items():
            self.statement(f"ARRAY/{self.arrays[_upper(key)]}", ["IC", f"NUMBERS = {listed(values)}"], str(key))
        for (kind, key), members in m.plants.items():
            ids = ", ".join(str(self.variables[_upper(member)]) for member in members)
            self.statement(f"{kind.upper()}/{self.plants[kind, _upper(key)]}", [f"VARIABLES = {ids}"], str(key))
        for key, data in m.splines.items():
            arguments = [f"X = {listed(data.x)}"]
            if data.z:
                arguments += [f"Y = {number(z)}, {listed(row)}" for z, row in zip(data.z, data.y)]
            else:
                arguments.append(f"Y = {listed(data.y[0])}")
            if data.linear_extrapolate:
                arguments.append("LINEAR_EXTRAPOLATE")
            self.statement(f"SPLINE/{self.splines[_upper(key)]}", arguments, str(key))

    def _element(self, name: str, element: Any) -> None:
        if name in self.kept:
            kind = self.kept[name]
            self.statement(f"{KEYWORDS[kind]}/{self.elements[kind, name]}", element_arguments(self, element), name)
        elif isinstance(element, Load | FrictionForce):
            self._load(name, as_expressions(element))
        elif isinstance(element, Torque):
            text = self.expression(function_text(element.function, self.units.time, self.units.factor("torque")))
            self._gforce(name, element.i, element.j, element.axis, {"TZ": text})
        elif isinstance(element, SolidContact):
            contact_statements(self, name, element)
        elif is_gear_contact(element) and self.gears == "solids":
            gear_solid_statements(self, name, element)
        elif is_gear_contact(element):
            gear_statements(self, name, element)
        else:
            raise ModelError(
                f"{element.kind} '{name}': it has a compiled function of its own, which has no form in an ADAMS deck; "
                "describe it by expressions (Mechanism.load) or take it out of the mechanism first"
            )

    def _load(self, name: str, load: Load) -> None:
        keyword = load_statement(load)
        if keyword == "SFORCE":
            text = self.expression(next(e for e in load.expressions if e is not None) or "0")
            ends = [f"I = {self.markers[id(load.i)]}", f"J = {self.markers[id(load.j)]}"]
            kind = "TRANSLATIONAL" if load.mode == LINE else "ROTATIONAL"
            self.statement(f"SFORCE/{self.elements['sforce', name]}", [kind, *ends, f"FUNCTION = {text}"], name)
            return
        slots = {AXIS_FORCE: ("FZ",), AXIS_TORQUE: ("TZ",)}.get(load.mode, COMPONENTS)
        given = {c: self.expression(e) for c, e in zip(slots, load.expressions) if e is not None}
        self._gforce(name, load.i, load.j, load.rm, given, keyword)

    def _gforce(
        self, name: str, i: Marker, j: Marker, rm: Marker, given: dict[str, str], keyword: str = "GFORCE"
    ) -> None:
        floating = self.new_marker(j.body, np.zeros(3), np.eye(3), floating=True)
        self.gforce(name, self.markers[id(i)], floating, self.markers[id(rm)], given, keyword)

    def gforce(self, name: str, i: int, jfloat: int, rm: int, given: dict[str, str], keyword: str = "GFORCE") -> None:
        """Write a GFORCE, VFORCE or VTORQUE with all its components."""
        n = self.elements[keyword.lower(), name]
        components = COMPONENTS_OF[keyword]
        arguments = [f"I = {i}", f"JFLOAT = {jfloat}", f"RM = {rm}"]
        arguments += [f"{c} = {given.get(c, '0')}" + ("\\" if c != components[-1] else "") for c in components]
        self.statement(f"{keyword}/{n}", arguments, name)


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


def _times(text: str, factor: float) -> str:
    return text if factor == 1.0 else f"{number(factor)}*({text})"


def _upper(key: Any) -> Any:
    return key.upper() if isinstance(key, str) else key
