"""Functions of a deck in terms of those that mechanisms know: SENVAL, CURVE, ARYVAL of variables, MODE."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearmbs.adams.builders.control import diff_name, has_rate, rate_name, state_systems
from gearmbs.adams.builders.curve_data import curve_points
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.language.syntax import Call, Chain, Name, Node, Number, Power, parse, unparse
from gearmbs.mechanism.language.syntax import parse as parsed
from gearmbs.mechanism.parts.probes import split_off

if TYPE_CHECKING:
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.parts.bodies import Marker

CONCERNED = re.compile(r"\b(SENVAL|CURVE|ARYVAL|DIF|DIF1)\s*\(", re.IGNORECASE)
MODE = re.compile(r"\bMODE\b(?!\s*\()", re.IGNORECASE)

MODES = {
    "KINEMATICS": 1, "INITIAL_CONDITIONS": 3, "DYNAMICS": 4, "TRANSIENT": 4, "STATICS": 5, "QUASI_STATICS": 6,
    "LINEAR": 7,
}  # fmt: skip
"""What MODE is in each analysis."""


class Present(NamedTuple):
    """What functions of the deck ask for that is constant during an analysis.

    Attributes
    ----------
    mode : int
        Which analysis it is: MODE.
    sensed : mapping of int to float
        What sensors have evaluated, by id: SENVAL.
    """

    mode: int = MODES["DYNAMICS"]
    sensed: Mapping[int, float] = MappingProxyType({})


IN_DYNAMICS = Present()


def data_call(deck: Deck, present: Present, call: Call) -> Node:
    """Return what a call stands for; others as they are.

    SENVAL(s) is the number that sensor s evaluated last, 0 before; ARYVAL(a, k) of an array of variables is VARVAL of
    the k-th, of one of states or outputs what its system makes it; DIF and DIF1 of an implicit DIFF are algebraic
    states; CURVE(u, order, component, c), with u from -1 to 1, a spline of the curve's parameter.
    """
    numbers = [a.integer if isinstance(a, Number) else None for a in call.args]
    if call.name == "SENVAL" and len(numbers) == 1 and numbers[0] in deck.of(st.Sensor):
        return Number(present.sensed.get(numbers[0] or 0, 0.0), call.at)
    if call.name == "ARYVAL" and len(numbers) == 2 and numbers[0] is not None and numbers[1] is not None:
        array = deck.of(st.Array).get(numbers[0])
        if array is not None and 1 <= numbers[1] <= len(array.variables):
            ref = array.variables[numbers[1] - 1]
            return Call("VARVAL", (Number(float(ref), call.at, ref),), call.at)
        return _of_system(deck, call, numbers[0], numbers[1])
    if call.name in ("DIF", "DIF1") and numbers[:1] and numbers[0] in deck.of(st.Diff):
        return _of_diff(deck.of(st.Diff)[numbers[0] or 0], call)
    if call.name == "CURVE" and len(numbers) == 4 and numbers[3] in deck.of(st.CurveStatement):
        return _curve(deck, call, numbers)
    return call


def _of_system(deck: Deck, call: Call, array: int, place: int) -> Node:
    """Return a state or an output of the system that an array belongs to."""
    for statement, system in state_systems(deck):
        if isinstance(statement, st.Gse) and array == statement.xd and 1 <= place <= statement.nd:
            return Number(statement.held[place - 1], call.at)
        if array == system.x and 1 <= place <= len(system.names):
            name = "DIF" if system.rates()[place - 1] is not None else "VARVAL"
            return Call(name, (Name(system.names[place - 1], call.at),), call.at)
        if array == system.y and 1 <= place <= len(system.outputs()):
            return parsed(system.outputs()[place - 1])
    return call


def _of_diff(diff: st.Diff, call: Call) -> Node:
    """Return the value or the rate of an implicit DIFF; of others the call as it is."""
    if not diff.implicit or (call.name == "DIF") == has_rate(diff):
        return call
    name = diff_name(diff) if call.name == "DIF" else rate_name(diff_name(diff))
    return Call("VARVAL", (Name(name, call.at),), call.at)


def _curve(deck: Deck, call: Call, numbers: list[int | None]) -> Node:
    order, component, number = numbers[1], numbers[2], numbers[3]
    if order not in (0, 1, 2) or component not in (1, 2, 3):
        return call
    if deck.of(st.CurveStatement)[number or 0].sampled:
        # by its own parameter, not by its length
        own = Name(f"CURVE_{number}.BY.{'XYZ'[component - 1]}", call.at)
        return Call(
            "CUBSPL", (call.args[0], Number(0.0, call.at, 0), own, Number(float(order), call.at, order)), call.at
        )
    half = 0.5 * curve_points(deck, number).length
    at = call.at
    travel = Chain(Chain(call.args[0], (("+", Number(1.0, at, 1)),), at), (("*", Number(half, at)),), at)
    name = Name(f"CURVE_{number}.{'XYZ'[component - 1]}", at)
    value = Call("CUBSPL", (travel, Number(0.0, at, 0), name, Number(float(order), at, order)), at)
    scale = Power(Number(half, at), Number(float(order), at, order), at)
    return Chain(scale, (("*", value),), at)


def translated(deck: Deck, present: Present, text: str, rename: Callable[[Call], Node] | None = None) -> str:
    """Return an expression with MODE and calls of data elements replaced, and then those that ``rename`` knows."""
    text = MODE.sub(str(present.mode), text)
    if rename is None and CONCERNED.search(text) is None:
        return text

    def both(call: Call) -> Node:
        found = data_call(deck, present, call)
        return rename(found) if rename is not None and found is call else found

    return unparse(parsed(text), both)


# ACCX, WDTX and their kin in the equations: the reactions of probes, see `gearmbs.mechanism.parts.probes`.


LINEAR = ("ACCX", "ACCY", "ACCZ", "ACCM")
ANGULAR = ("WDTX", "WDTY", "WDTZ", "WDTM")
FUNCTIONS = (*LINEAR, *ANGULAR)


class Accelerations:
    """The probes of a deck, one for each marker whose acceleration is asked for."""

    def __init__(self, mechanism: Mechanism, markers: Mapping[int, Marker]) -> None:
        self.mechanism, self.markers, self.units = mechanism, markers, mechanism.units
        self.probes: dict[int, tuple[str, float, float]] = {}
        self.gravity: tuple[str, str] | None = None

    def call(self, call: Call) -> Node:
        """Return what a function of accelerations stands for; other calls as they are.

        Raises
        ------
        ValueError
            If it is seen from a frame that moves, or the body has no mass.
        """
        if call.name not in FUNCTIONS:
            return call
        refs = [a.integer or 0 if isinstance(a, Number) else 0 for a in call.args] + [0] * 4
        magnitude = call.name.endswith("M")
        i, j = refs[0], refs[1]
        along, seen = (0, refs[2]) if magnitude else (refs[2], refs[3])
        if self._moves(seen):
            raise ValueError(f"{call.name} in a frame that moves, MARKER/{seen}, can only be asked for in a REQUEST")
        torque = call.name in ANGULAR
        axes = (0, 1, 2) if magnitude else ("XYZ".index(call.name[-1]),)
        parts = [f"({self._of(i, along, k, torque)} - {self._of(j, along, k, torque)})" for k in axes]
        text = parts[0] if len(parts) == 1 else f"SQRT({' + '.join(f'{p}**2' for p in parts)})"
        return parse(text)

    def _moves(self, ref: int) -> bool:
        marker = self.markers.get(ref)
        return marker is not None and not marker.body.is_ground

    def _of(self, ref: int, along: int, axis: int, torque: bool) -> str:
        """Return a component of a marker's acceleration along an axis of another, in the deck's units."""
        if not self._moves(ref):
            return "0"
        if ref not in self.probes:
            joint, mass, inertia = split_off(self.mechanism, f"PROBE_{ref}", self.markers[ref])
            self.probes[ref] = joint.name, mass, inertia
        name, mass, inertia = self.probes[ref]
        units = self.units
        if torque:
            factor = units.factor("torque") / (inertia * units.factor("angular_acceleration"))
            return f'{factor!r}*JOINT("{name}", 0, {6 + axis}, {along})'
        factor = units.factor("force") / (mass * units.factor("acceleration"))
        return f'({factor!r}*JOINT("{name}", 0, {2 + axis}, {along}) + {self._weight(along, axis)})'

    def _weight(self, along: int, axis: int) -> str:
        """Return a component of gravity, shown by two markers on the ground."""
        mechanism, units = self.mechanism, self.units
        if not np.any(mechanism.gravity):
            return "0"
        if self.gravity is None:
            shown = np.asarray(mechanism.gravity) * units.length / units.factor("acceleration")
            tip = mechanism.ground.marker(shown, name="gravity.tip")
            origin = mechanism.ground.marker(name="gravity.origin")
            self.gravity = tip.name, origin.name
        tip_name, origin_name = self.gravity
        return f'D{"XYZ"[axis]}("{tip_name}", "{origin_name}", {along})'
