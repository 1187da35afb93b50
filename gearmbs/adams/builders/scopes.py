"""What the names and ids in a deck's expressions stand for, known before a mechanism is built: ``deck_scope``."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gearmbs.adams.builders.control import state_systems
from gearmbs.adams.builders.curve_data import curve_points
from gearmbs.adams.builders.data_calls import Present, translated
from gearmbs.adams.builders.element_pairs import KINDS, acts, marker_pair
from gearmbs.adams.builders.implicit import implicit_states
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import spline_data
from gearmbs.adams.parse.deck import Deck
from gearmbs.dae.equations.expressions import SplineData
from gearmbs.mechanism.curves import AXES
from gearmbs.mechanism.expression_syntax import Scope

FORCE_AND_TORQUE = (0, 3)
"""First components of both, see `Scope.absent`."""


def sensor_state(number: int) -> str:
    """Return the name of the state that follows a SENSOR's function."""
    return f"SENSOR_{number}"


def data_scope(deck: Deck, present: Present) -> Scope:
    """Return what expressions may name of a deck's data: all but markers, elements, curves and algebraic states."""
    return Scope(
        variables={v.id: _text(deck, present, v.function) for v in deck.of(st.Variable).values()},
        diffs={d.id: None if d.implicit else _text(deck, present, d.function) for d in deck.of(st.Diff).values()}
        | {name: text for _, system in state_systems(deck) for name, text in zip(system.names, system.rates())},
        splines={s.id: spline_data(s) for s in deck.of(st.Spline).values() if s.data_file is None},
        arrays={a.id: a.numbers for a in deck.of(st.Array).values()},
        functions=deck.functions,
        plants={
            (kind, plant.id): plant.variables
            for kind, group in (("pinput", st.PlantInput), ("poutput", st.PlantOutput))
            for plant in deck.of(group).values()
        },
        units=deck.units,
    )


def deck_scope(deck: Deck, present: Present, inactive: frozenset[tuple[str, int]] = frozenset()) -> Scope:
    """Return what expressions of a deck may name, all of it, without anything being computed.

    Bodies are numbered as the deck's markers name them; the tapes do to check expressions, not to evaluate them.
    """
    markers: dict[Any, int] = {}
    rows: list[int] = []
    grounds = {("PART", p.id) for p in deck.of(st.Part).values() if p.ground}
    bodies: dict[tuple[str, int | None], int] = {}
    for k, marker in enumerate(deck.of(st.Marker).values()):
        markers[marker.id] = markers[(marker.name or f"MARKER_{marker.id}").replace('"', "'").upper()] = k
        owner = marker.owner()
        rows.append(0 if owner in grounds else bodies.setdefault(owner, 1 + len(bodies)))
    of_kind: dict[str, dict[int, Any]] = {kind: deck.of(cls) for cls, kind in KINDS.items()}
    elements = [(kind, s) for kind, group in of_kind.items() for s in group.values()]
    data = data_scope(deck, present)
    return replace(
        data,
        markers=markers,
        marker_body=rows,
        splines={**data.splines, **_curves(deck)},
        states=_algebraic_states(deck),
        forces={(kind, s.id): marker_pair(deck, s) for kind, s in elements},
        absent=frozenset(
            (kind, s.id, base) for kind, s in elements if not acts(s, inactive) for base in FORCE_AND_TORQUE
        ),
    )


def _text(deck: Deck, present: Present, function: str | None) -> str:
    """Return an expression that others read; what is wrong with it is said of its own statement."""
    try:
        return translated(deck, present, function or "0")
    except ValueError:
        return "0"


def _algebraic_states(deck: Deck) -> frozenset[str]:
    """Return the names of unknowns of their own: of implicit equations, and of sensors."""
    states = [s for d in deck.of(st.Diff).values() if d.implicit for s in implicit_states(d, "0", 1.0).values()]
    states += [s for _, system in state_systems(deck) for s in system.algebraic]
    names = {str(s.name).upper() for s in states if s.algebraic}
    return frozenset(names | {sensor_state(number) for number in deck.of(st.Sensor)})


def _curves(deck: Deck) -> dict[Any, SplineData]:
    """Return the components of curves; what is wrong with one is said of its own statement."""
    found: dict[Any, SplineData] = {}
    for curve in deck.of(st.CurveStatement).values():
        try:
            s, points = curve_points(deck, curve.id).tables()
            for k, axis in enumerate(AXES):
                found[f"CURVE_{curve.id}.{axis}"] = SplineData(tuple(s), (tuple(points[:, k]),))
        except ValueError:
            continue
        if curve.sampled:
            alpha, *rows = zip(*curve.sampled)
            found |= {f"CURVE_{curve.id}.BY.{axis}": SplineData(alpha, (row,)) for axis, row in zip(AXES, rows)}
    return found
