"""ACCX, WDTX and their kin in the equations: the reactions of probes, see `gearmbs.mechanism.probes`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.mechanism.expression_syntax import Call, Node, Number, parse
from gearmbs.mechanism.probes import split_off

if TYPE_CHECKING:
    from gearmbs.adams.builders.builder import Builder

LINEAR = ("ACCX", "ACCY", "ACCZ", "ACCM")
ANGULAR = ("WDTX", "WDTY", "WDTZ", "WDTM")
FUNCTIONS = (*LINEAR, *ANGULAR)


class Accelerations:
    """The probes of a deck, one for each marker whose acceleration is asked for."""

    def __init__(self, builder: Builder) -> None:
        self.builder = builder
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
        marker = self.builder.markers.get(ref)
        return marker is not None and not marker.body.is_ground

    def _of(self, ref: int, along: int, axis: int, torque: bool) -> str:
        """Return a component of a marker's acceleration along an axis of another, in the deck's units."""
        if not self._moves(ref):
            return "0"
        if ref not in self.probes:
            joint, mass, inertia = split_off(self.builder.mechanism, f"PROBE_{ref}", self.builder.markers[ref])
            self.probes[ref] = joint.name, mass, inertia
        name, mass, inertia = self.probes[ref]
        units = self.builder.units
        if torque:
            factor = units.factor("torque") / (inertia * units.factor("angular_acceleration"))
            return f'{factor!r}*JOINT("{name}", 0, {6 + axis}, {along})'
        factor = units.factor("force") / (mass * units.factor("acceleration"))
        return f'({factor!r}*JOINT("{name}", 0, {2 + axis}, {along}) + {self._weight(along, axis)})'

    def _weight(self, along: int, axis: int) -> str:
        """Return a component of gravity, shown by two markers on the ground."""
        mechanism, units = self.builder.mechanism, self.builder.units
        if not np.any(mechanism.gravity):
            return "0"
        if self.gravity is None:
            shown = np.asarray(mechanism.gravity) * units.length / units.factor("acceleration")
            tip = mechanism.ground.marker(shown, name="gravity.tip")
            origin = mechanism.ground.marker(name="gravity.origin")
            self.gravity = tip.name, origin.name
        tip_name, origin_name = self.gravity
        return f'D{"XYZ"[axis]}("{tip_name}", "{origin_name}", {along})'
