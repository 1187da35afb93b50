"""Write a Mechanism as an .adm deck: ``write_deck``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gearmbs.adams.parse.deck import TABLES
from gearmbs.adams.write.elements import (
    as_expressions,
    constraint_statements,
    data_statements,
    element_statements,
    flex_body_arguments,
    hidden,
    joint_statement,
    kept,
    load_statement,
    nearest_node,
    states_of,
)
from gearmbs.adams.write.gear_expressions import is_gear_contact
from gearmbs.adams.write.plants import plant_in
from gearmbs.adams.write.text import COMPONENTS_OF, WriterContext, listed, number, upper, wrapped
from gearmbs.dae.equations.rotation import euler_from_matrix
from gearmbs.dae.methods import FORMULATIONS, INTEGRATORS
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.checks import check_mechanism
from gearmbs.mechanism.contacts import SolidContact
from gearmbs.mechanism.language.lowering import ELEMENT_FORCES
from gearmbs.mechanism.language.syntax import (
    Call,
    Name,
    Node,
    Number,
    Steps,
    children,
    parse,
    shown,
    unparse,
    unrolled,
    with_children,
)
from gearmbs.mechanism.parts.bodies import Body, Marker, markers_kept
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.parts.point_mass import PointMass

# What a written deck asks for: REQUESTs, the files of results, the integrator.


COLUMNS = ("F2", "F3", "F4", "F6", "F7", "F8")
"""Columns of a request that the .req file contains."""
LONGEST = 80
"""Characters of a comment in the .req."""
NOT_ASKED = ("coupler", "gear")
"""Elements whose forces are those of their joints."""
METHODS = sorted(name for name, known in INTEGRATORS.items() if name in known.adams)


def request_statements(writer: WriterContext, requests: Mapping[str, str | Sequence[str]], all_of_them: bool) -> None:
    """Write the requests a user asks for, then those of all bodies and elements.

    Raises
    ------
    ModelError
        For more than six expressions in a request.
    """
    texts: list[tuple[list[str], str]] = []
    for name, given in requests.items():
        expressions = [given] if isinstance(given, str) else list(given)
        if not 1 <= len(expressions) <= len(COLUMNS):
            raise ModelError(f"request '{name}': it holds 1 to {len(COLUMNS)} expressions, got {len(expressions)}")
        texts.append(([writer.expression(e) for e in expressions], name))
    for n, (expressions, name) in enumerate(texts, 1):
        _functions(writer, n, expressions, name)
    if all_of_them:
        _bodies_and_elements(writer, len(texts) + 1)


def _functions(writer: WriterContext, n: int, expressions: list[str], comment: str) -> None:
    columns = [f"{c} = {text}\\" for c, text in zip(COLUMNS, expressions)]
    writer.statement(f"REQUEST/{n}", [*columns, f"COMMENT = {_bare_text(comment)}"], comment)


def _bodies_and_elements(writer: WriterContext, n: int) -> None:
    for body in writer.mechanism.bodies.values():
        for kind in ("DISPLACEMENT", "VELOCITY"):
            comment = f"COMMENT = {_bare_text(f'{body.name} {kind.lower()}')}"
            writer.statement(f"REQUEST/{n}", [kind, f"I = {writer.centers[id(body)]}", comment])
            n += 1
    functions = {kind: function for function, kind in ELEMENT_FORCES.items() if kind not in NOT_ASKED}
    for (kind, name), number_ in writer.elements.items():
        if kind in functions:
            texts = [f"{functions[kind]}({number_}, 0, {c}, 0)" for c in (2, 3, 4, 6, 7, 8)]
            _functions(writer, n, texts, f"{name} force")
            n += 1


def integrator_statement(
    writer: WriterContext, integrator: str | None, formulation: str, tol: float | None, max_step: float | None
) -> None:
    """Write INTEGRATOR when any of its settings is given.

    Raises
    ------
    ModelError
        For a method or formulation that ADAMS does not have.
    """
    if integrator is None and tol is None and max_step is None:
        return
    method = (integrator or "GSTIFF").upper()
    for word, value, known in (("integrator", method, METHODS), ("formulation", formulation, FORMULATIONS)):
        if value not in known:
            raise ModelError(f"{word} = {value!r}: choose one of {', '.join(known)} for a deck")
    arguments = [method, formulation]
    if tol is not None:
        arguments.append(f"ERROR = {number(tol)}")
    if max_step is not None:
        arguments.append(f"HMAX = {number(max_step / writer.units.time)}")
    writer.statement("INTEGRATOR/", arguments)


def _bare_text(text: str) -> str:
    """Return a text without characters that mean something in a deck."""
    return re.sub(r"[^\w .:()+-]+", " ", text).strip()[:LONGEST] or "request"


# Ids of what a mechanism holds, and expressions with ids in place of names.


PLANTS = {"PINVAL": "pinput", "POUVAL": "poutput"}


class DeckNames:
    """Numbers the parts of a mechanism."""

    def __init__(self, mechanism: Mechanism, gears: str) -> None:
        self.mechanism = mechanism
        self.gears = gears
        self.units = mechanism.units
        self.bodies: dict[int, int] = {}
        self.markers: dict[int, int] = {}
        self.marker_names: dict[str, int] = {}
        self.several: set[str] = set()
        self.elements: dict[tuple[str, str], int] = {}
        self.kept = kept(mechanism)
        self.hidden = hidden(mechanism)
        self.numbers = {upper(k): made for k, made in {**mechanism.inputs, **mechanism.parameters}.items()}
        self.plant = plant_in(mechanism)
        others = {key: text for key, text in mechanism.variables.items() if key not in self.plant.aliases}
        self.variables = self._numbered({**others, **self.numbers})
        self.variables |= {upper(key): self.variables[upper(name)] for key, name in self.plant.aliases.items()}
        self.all_states = states_of(mechanism)
        self.states = self._numbered(self.all_states)
        self.splines = {upper(k): n for n, k in enumerate(mechanism.splines, 1)}
        self.arrays = {upper(k): n for n, k in enumerate(mechanism.arrays, 1)}
        self.plants = {(kind, upper(k)): n for n, (kind, k) in enumerate(mechanism.plants, 1)}
        self._number()

    def _numbered(self, table: Iterable[Any]) -> dict[Any, int]:
        """Number variables or states, without those that a statement stands for."""
        return {upper(k): n for n, k in enumerate((k for k in table if upper(k) not in self.hidden), 1)}

    def _number(self) -> None:
        m = self.mechanism
        for n, body in enumerate((m.ground, *m.bodies.values()), 1):
            self.bodies[id(body)] = n
        used = {mk.number for body in (m.ground, *m.bodies.values()) for mk in body.markers if mk.number}
        fresh = (n for n in range(1, 10**9) if n not in used)
        for body in (m.ground, *m.bodies.values()):
            for marker in body.markers:
                self.markers[id(marker)] = marker.number or next(fresh)
                if marker.name.upper() in self.marker_names:
                    self.several.add(marker.name.upper())
                self.marker_names[marker.name.upper()] = self.markers[id(marker)]
        counts: dict[str, int] = {}
        for name, kind in self._kinds():
            counts[kind] = counts.get(kind, 0) + 1
            self.elements[kind, name] = counts[kind]

    def _kinds(self) -> Iterable[tuple[str, str]]:
        for name, joint in self.mechanism.joints.items():
            yield name, joint_statement(joint).lower()
        for own, constraint in self.mechanism.constraints.items():
            for name in constraint.named(own):
                yield name, "gcon"
        for name, element in self.mechanism.elements.items():
            solid = isinstance(element, SolidContact) or (self.gears == "solids" and is_gear_contact(element))
            statement = load_statement(as_expressions(element, self.units)).lower()
            yield name, "contact" if solid else self.kept.get(name, statement)

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
            if call.name == "COSINE":
                raise ModelError(f"{shown(text)}: ADAMS has no function COSINE; use displacements and angles instead")
            call = replace(call, args=tuple(self._argument(call, k, a) for k, a in enumerate(call.args)))
            return self._element_call(call) if call.name in ELEMENT_FORCES else call

        return unparse(unrolled(self._with_variables(parse(text))), rename)

    def _with_variables(self, node: Node) -> Steps[Node]:
        """Let the names of inputs and parameters be the values of variables that stand for them."""
        if isinstance(node, Name) and node.text in self.numbers and node.text not in self.marker_names:
            return Call("VARVAL", (node,), node.at)
        if isinstance(node, Call) and node.name == "VARVAL":
            return node
        parts = []
        for part in children(node):
            parts.append((yield self._with_variables(part)))
        return with_children(node, parts)

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
            if key in self.several:
                raise ModelError(
                    f"{call.name}: several markers are called {key}, in capitals or not; give each a name of its own"
                )
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

    Contacts of solids become GRAPHICS and CONTACTs, meshes .obj files beside the deck. Contacts of spur gears with
    parallel axes become GFORCEs of IMPACT expressions along both lines of action; their friction and the contact of
    tooth corners beyond the path of contact are left out, as comments say. Or they become CONTACTs of solids, which
    hold helices, faults and axial shifts, too. Bodies that deform by modes become FLEX_BODYs with modal neutral files
    beside the deck.

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
    check_mechanism(mechanism)
    if gears not in ("expressions", "solids"):
        raise ModelError(f"gears = {gears!r}; choose 'expressions' or 'solids'")
    with markers_kept((mechanism.ground, *mechanism.bodies.values())):
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


def _owner(body: Body) -> str:
    """Return the statement that a rigid body or a point mass is written as, which its markers name."""
    return "POINT_MASS" if isinstance(body, PointMass) else "PART"


class DeckWriter(DeckNames):
    """Writes the statements of a mechanism."""

    def __init__(self, mechanism: Mechanism, path: str | Path | None = None, gears: str = "expressions") -> None:
        super().__init__(mechanism, gears)
        self.path = path
        self.lines: list[str] = []
        self.centers: dict[int, int] = {}
        self._next_marker = max(self.markers.values(), default=0) + 1
        self._solids = 0

    def model(self, title: str | None) -> None:
        """Write the title and all that moves."""
        self.lines = [" ".join((title or self.mechanism.name).split()) or "mechanism", "!"]
        self._units()
        self._parts()
        constraint_statements(self)
        data_statements(self)
        for name, element in self.mechanism.elements.items():
            element_statements(self, name, element)
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
        arguments = [f"{_owner(body)} = {self.bodies[id(body)]}"]
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
                arguments = [f"{_owner(body)} = {n}", *self._frame("QP", marker.position, marker.orientation)]
                self.statement(f"MARKER/{self.markers[id(marker)]}", arguments, marker.name)

    def _part(self, body: Body, n: int) -> None:
        units = self.units
        own = self._center(body)
        cm = self.centers[id(body)] = self.markers[id(own)] if own is not None else self._next_marker
        arguments = [f"MASS = {number(body.mass / units.mass)}", f"CM = {cm}"]
        if not isinstance(body, PointMass):
            i = body.inertia / units.factor("inertia")
            inertia = [i[0, 0], i[1, 1], i[2, 2], -i[0, 1], -i[0, 2], -i[1, 2]]
            arguments.append(f"IP = {listed(inertia if any(inertia[3:]) else inertia[:3])}")
        self.statement(f"{_owner(body)}/{n}", [*arguments, *self._start(body)], body.name)
        if own is None:
            self._next_marker += 1
            self.statement(f"MARKER/{cm}", [f"{_owner(body)} = {n}", *self._frame("QP", body.com, np.eye(3))])

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

    def gforce(self, name: str, i: int, jfloat: int, rm: int, given: dict[str, str], keyword: str = "GFORCE") -> None:
        """Write a GFORCE, VFORCE or VTORQUE with all its components."""
        n = self.elements[keyword.lower(), name]
        components = COMPONENTS_OF[keyword]
        arguments = [f"I = {i}", f"JFLOAT = {jfloat}", f"RM = {rm}"]
        arguments += [f"{c} = {given.get(c, '0')}" + ("\\" if c != components[-1] else "") for c in components]
        self.statement(f"{keyword}/{n}", arguments, name)
