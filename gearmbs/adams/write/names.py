"""Ids of what a mechanism holds, and expressions with ids in place of names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from gearmbs.adams.write.elements import as_expressions, hidden, kept, states_of
from gearmbs.adams.write.gears import is_gear_contact
from gearmbs.adams.write.joints import joint_statement
from gearmbs.adams.write.loads import load_statement
from gearmbs.adams.write.text import upper
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.contacts import SolidContact
from gearmbs.mechanism.expression_functions import ELEMENT_FORCES
from gearmbs.mechanism.expression_syntax import Call, Name, Node, Number, parse, shown, unparse

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
        self.elements: dict[tuple[str, str], int] = {}
        self.kept = kept(mechanism)
        self.hidden = hidden(mechanism)
        self.variables = self._numbered(mechanism.variables)
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
                self.marker_names[marker.name.upper()] = self.markers[id(marker)]
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
