"""Gear forces of ADAMS/Machinery: a GFORCE between two wheels, bound to a pair of this program.

Machinery computes its gear forces in a library of its own. What its arrays hold is not published, so that a deck does
not tell the wheels; whoever runs it gives a `gearmbs.gears.GearPair`, and where the wheels are follows from the deck:
each turns about the axis of its joint, at the place along it where the GFORCE acts.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.builders.builder import Builder, marker_orientation, part_orientation
from gearmbs.adams.errors import WARNING
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck

if TYPE_CHECKING:
    from gearmbs.gears import GearPair

NAMED = re.compile(r"(^|\.)GFO_|machinery", re.IGNORECASE)
"""View names of Machinery's gear forces, and its library."""
TURNING = ("REVOLUTE", "CYLINDRICAL")
PARALLEL = 1e-6
"""Sine of the angle between axes that are taken as parallel: six digits of a deck's angles."""
APART = 0.25
"""Modules by which a centre distance may differ from the pair's: beyond, the deck has other wheels, or another axis."""
REMARKED = 1e-3
"""Modules by which it may differ without a remark."""
ROUNDED = 1e-3
"""Modules that the last digit of a place may be: flanks yield by less, and farther away any number of teeth is near."""

Frame = tuple[np.ndarray, np.ndarray]
"""Origin, m, and axes as columns."""


def is_gear_force(s: st.Statement) -> bool:
    """Whether a statement is a gear force of Machinery, by its name or its library."""
    return isinstance(s, st.Gforce) and any(NAMED.search(text or "") for text in (s.name, s.routine))


def is_pair(value: object) -> bool:
    """Whether what is given for a routine is a pair of wheels; their package is loaded by who makes one."""
    return hasattr(value, "contact_element") and hasattr(value, "driven_angle")


def add_gears(b: Builder, s: st.Gforce, pair: GearPair) -> None:
    """Let the teeth of a pair touch on the parts of a GFORCE: the driver on that of I, the driven wheel on JFLOAT's.

    Raises
    ------
    ValueError
        If the deck does not say where the wheels are, or elsewhere than the pair has them.
    """
    deck = b.deck
    floating = deck.of(st.Marker).get(s.jfloat or 0)
    first, second = deck.of(st.Marker)[s.i or 0].part, floating.part if floating is not None else None
    if first is None or second is None:
        raise ValueError("a gear force needs two PARTs that turn, of I and of JFLOAT")
    owners = first, second
    here = _frame(deck, s.i or 0, b.units.length)[0]
    axes: list[Frame | None] = [_axis(deck, part, b.units.length) for part in owners]
    if s.pair:
        # of a command file: its markers are where the wheels are, z their axes
        axes = [_frame(deck, ref or 0, b.units.length) for ref in (s.i, s.rm)]
    known = [axis for axis in axes if axis is not None]
    if not known:
        raise ValueError(f"neither PART/{first} nor PART/{second} turns about a JOINT; a wheel needs one")
    z = known[0][1][:, 2]
    # a wheel that is held, as a ring: along the other's axis, through its centre of mass
    points = [_centre(deck, part, b.units.length) if axis is None else axis[0] for part, axis in zip(owners, axes)]
    across = max(float(np.linalg.norm(np.cross(z, axis[1][:, 2]))) for axis in known)
    if across > PARALLEL:
        angle = np.degrees(np.arcsin(min(across, 1.0)))
        raise ValueError(f"the axes of its wheels are {angle:.4g} deg apart; those of a pair are parallel")
    one, two = (point + ((here - point) @ z) * z for point in points)
    _check_digits(pair, one, two, *(_pose(deck, part, b.units.length)[0] for part in owners))
    _check_distance(b, s, pair, float(np.linalg.norm(two - one)))
    x = (two - one) / np.linalg.norm(two - one)
    frame = np.column_stack([x, np.cross(z, x), z])
    free = 0.5 * pair.normal_backlash / pair.driven.base_radius
    placed = pair.frames(0.0, pair.driven_angle() - pair.sign * free)
    wheels = []
    for part, origin, turned, side in zip(owners, (one, two), (placed.axes_1, placed.axes_2), "IJ"):
        place, axes_of_part = _pose(deck, part, b.units.length)
        body = b.mechanism.ground if deck.of(st.Part)[part].ground else b.mechanism.bodies[b.model.names["part", part]]
        own = axes_of_part.T @ (origin - place), axes_of_part.T @ frame @ turned
        wheels.append(body.marker(*own, name=f"{b.model.names['gforce', s.id]}.wheel.{side}"))
    b.mechanism.gear_contact(b.model.names["gforce", s.id], wheels[0], wheels[1], pair)
    teeth = f"{pair.driver.teeth} teeth on PART/{first}, {pair.driven.teeth} on PART/{second}"
    b.remark(WARNING, s, f"in place of its own law, the exact contact of a pair: {teeth}")


def _check_digits(pair: GearPair, *places: np.ndarray) -> None:
    """Refuse wheels that are so far from the origin that rounding moves their teeth."""
    far = float(np.abs(places).max())
    if not np.spacing(far) < ROUNDED * pair.driver.module:
        raise ValueError(
            f"its wheels are {far:.3g} m from the origin, where double precision has no digits left for teeth of "
            f"module {1e3 * pair.driver.module:.4g} mm; move the model to the origin"
        )


def _check_distance(b: Builder, s: st.Gforce, pair: GearPair, distance: float) -> None:
    """Refuse wheels elsewhere than the pair has them; remark a small difference."""
    off = abs(distance - pair.centre_distance) / pair.driver.module
    told = f"its wheels are {1e3 * distance:.6g} mm apart, those of the pair {1e3 * pair.centre_distance:.6g} mm"
    if off > APART:
        raise ValueError(f"{told}: give the pair of these wheels, or the revolute JOINT of each")
    if off > REMARKED:
        b.remark(WARNING, s, f"{told}; they touch where the deck has them")


def _pose(deck: Deck, number: int, length: float) -> Frame:
    part = deck.of(st.Part)[number]
    return (np.zeros(3), np.eye(3)) if part.ground else (length * np.array(part.qg), part_orientation(part))


def _frame(deck: Deck, number: int, length: float) -> Frame:
    """Return a marker's place and axes where the deck puts its part."""
    marker = deck.of(st.Marker)[number]
    place, axes = _pose(deck, marker.part or 0, length)
    return place + axes @ (length * np.array(marker.qp)), axes @ marker_orientation(marker)


def _axis(deck: Deck, part: int, length: float) -> Frame | None:
    """Return a point and the axes of the joint about which a part turns, rather one with the ground; or None."""
    found: list[tuple[bool, int]] = []
    for joint in deck.of(st.Joint).values():
        refs = [ref or 0 for ref in (joint.i, joint.j)]
        parts = [deck.of(st.Marker)[ref].part for ref in refs]
        if joint.type in TURNING and part in parts:
            held = not any(p is not None and deck.of(st.Part)[p].ground for p in parts)
            found.append((held, refs[parts.index(part)]))
    return _frame(deck, min(found)[1], length) if found else None


def _centre(deck: Deck, part: int, length: float) -> np.ndarray:
    cm = deck.of(st.Part)[part].cm
    return _pose(deck, part, length)[0] if cm is None else _frame(deck, cm, length)[0]
