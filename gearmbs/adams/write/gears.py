"""A gear contact as IMPACT expressions: both flanks along their lines of action, pair by pair.

Wheels of parallel axes at a fixed distance a touch along the common tangents of their base circles.
With psi_1, psi_2 the angles of the middles of teeth 0 from the line of centres, h the half angle of a
tooth on the base circle and alpha' the working pressure angle, the strings of the drive flanks are
s_i = r_bi (psi_i + h_i + alpha') and the penetration of every pair is s_1 + s_2 - a sin(alpha'), up to
a whole number of base pitches; the back flanks have psi and the sense of turning reversed.  A pair bears
while its string s_1 lies on the path of contact; a sum over the pairs within reach counts them.

What an ADAMS owner can cross-check with it: load sharing, the fluctuation of the mesh force, reactions.
Left out: friction, tooth corners beyond the path of contact, tilted axes, faults.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gearmbs.adams.pairs import friction_of, normal_law_of, pair_comments
from gearmbs.adams.write.contacts import external, friction_law, normal_law, touch
from gearmbs.adams.write.text import WriterContext
from gearmbs.dae.problem import ModelError
from gearmbs.gears import GearPair
from gearmbs.gears.contact_element import GearContact

PARALLEL = 1e-9
"""Sine of the angle between two axes up to which they are parallel but for rounding of a model's orientations."""
EDGE = 0.01
"""Width over which a pair takes and leaves the load, in base pitches."""


def is_gear_contact(element: Any) -> bool:
    """Whether an element is a gear contact."""
    return isinstance(element, GearContact)


def gear_statements(writer: WriterContext, name: str, element: GearContact) -> None:
    """Write a gear contact as one GFORCE between the wheels.

    Raises
    ------
    ModelError
        For tilted axes, internal gears or a contact law that is no IMPACT: a linear law is one with the exponent 1.
    """
    pair: Any = element.pair
    if not all(hasattr(pair, a) for a in ("wheels", "contact", "line_of_action", "working_pressure_angle")):
        raise ModelError(f"gear contact '{name}': its pair does not tell its geometry; it cannot be written")
    law = pair.contact
    if law.kind == "hunt-crossley":
        raise ModelError(f"gear contact '{name}': the law {law.kind!r} has no form in ADAMS; use ContactLaw.impact")
    if getattr(pair, "stiffness_curve", "constant") != "constant":
        raise ModelError(
            f"gear contact '{name}': its stiffness varies along the path, which IMPACT does not; take a constant one"
        )
    frames = [(m.global_position(), m.global_orientation()) for m in (element.i, element.j)]
    axis = frames[0][1][:, 2]
    apart = frames[1][0] - frames[0][0]
    apart = apart - axis * (axis @ apart)
    if np.linalg.norm(np.cross(axis, frames[1][1][:, 2])) > PARALLEL or frames[1][1][:, 2] @ axis < 0.0:
        raise ModelError(f"gear contact '{name}': tilted axes cannot be written as an expression; align the wheels")
    toward = apart / np.linalg.norm(apart)
    sights = []
    for (origin, _), x in zip(frames, (toward, -toward)):
        axes = np.column_stack([x, np.cross(axis, x), axis])
        sights.append(writer.new_marker(writer.mechanism.ground, origin, axes))
    wheels = [writer.markers[id(m)] for m in (element.i, element.j)]
    floating = writer.new_marker(element.j.body, np.zeros(3), np.eye(3), floating=True)
    writer.comment(f"{name}: IMPACT of each pair of flanks along the lines of action; without friction and corners")
    drive, back = (_flank(writer, pair, wheels, sights, frames, sign) for sign in (1.0, -1.0))
    alpha = pair.working_pressure_angle
    lever = pair.wheels[0].base_radius / writer.units.length
    given = {
        "FX": f"-({math.sin(alpha)!r})*(({drive}) + ({back}))",
        "FY": f"-({math.cos(alpha)!r})*(({drive}) - ({back}))",
        "TZ": f"-({lever!r})*(({drive}) - ({back}))",
    }
    writer.gforce(name, wheels[0], floating, sights[0], {k: writer.expression(t) for k, t in given.items()})


def _flank(
    writer: WriterContext,
    pair: Any,
    wheels: list[int],
    sights: list[int],
    frames: list[tuple[np.ndarray, np.ndarray]],
    sign: float,
) -> str:
    """Return the sum of the normal forces of all pairs on the drive (sign 1) or back flanks (-1), as text."""
    units = writer.units
    one, two = pair.wheels
    alpha, line = pair.working_pressure_angle, pair.line_of_action
    pitch = one.base_pitch
    rb = (one.base_radius, two.base_radius)
    offsets = [r * (w.base_half_angle + alpha) for r, w in zip(rb, pair.wheels)]
    start = [_angle(frame, other) for frame, other in ((frames[0], frames[1]), (frames[1], frames[0]))]
    present = sum(o + sign * r * a for o, r, a in zip(offsets, rb, start)) - line
    whole = round(present / pitch)
    length = units.length

    def string(k: int) -> str:
        return f"({offsets[k] / length!r} + ({sign * rb[k] / length!r})*AZ({wheels[k]}, {sights[k]}))"

    depth = f"({string(0)} + {string(1)} - ({(line + whole * pitch) / length!r}))"
    rates = [f"({sign * r / length!r})*WZ({w}, {s}, {s})" for r, w, s in zip(rb, wheels, sights)]
    law = pair.contact
    k = law.stiffness * length**law.exponent / units.force
    c = law.damping / units.factor("damping")
    force = f"IMPACT(-{depth}, -({' + '.join(rates)}), 0, {k!r}, {law.exponent!r}, {c!r}, {law.depth / length!r})"
    low, high = line - two.tip_roll_length, one.tip_roll_length
    edge = EDGE * pitch
    first = math.floor(low / pitch) - 1
    last = math.ceil(high / pitch) + 1
    place = f"MOD({string(0)} + {1e6 * pitch / length!r}, {pitch / length!r})"
    shares = []
    for n in range(first, last + 1):
        u = f"({place} + ({n * pitch / length!r}))"
        enter = f"STEP({u}, {(low - edge) / length!r}, 0, {(low + edge) / length!r}, 1)"
        leave = f"STEP({u}, {(high - edge) / length!r}, 1, {(high + edge) / length!r}, 0)"
        if n * pitch + pitch >= low - edge and n * pitch <= high + edge:
            shares.append(f"{enter}*{leave}")
    return f"({' + '.join(shares)})*{force}"


def _angle(frame: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> float:
    """Return the angle of a wheel's x axis from the direction of the other wheel's centre, about its axis."""
    axis, x = frame[1][:, 2], frame[1][:, 0]
    toward = other[0] - frame[0]
    toward = toward - axis * (axis @ toward)
    return float(np.arctan2(axis @ np.cross(toward, x), toward @ x))


# A gear contact as the contact of two solids: meshes for other programs, the very pair in comments for this one.


def gear_solid_statements(writer: WriterContext, name: str, element: GearContact) -> None:
    """Write both wheels as meshes beside the deck, and a CONTACT between them with the pair in comments before it.

    Raises
    ------
    ModelError
        For what is no `GearPair`, a law without a form in ADAMS, or a deck that is no file.
    """
    from gearmbs.view import pair_solids

    pair: Any = element.pair
    if not isinstance(pair, GearPair):
        raise ModelError(f"gear contact '{name}': only a GearPair is written as solids, not a {type(pair).__name__}")
    try:
        comments = pair_comments(pair)
    except ValueError as error:
        raise ModelError(f"gear contact '{name}': {error}") from error
    laws = [*normal_law(writer, normal_law_of(name, pair)), *friction_law(writer, friction_of(pair.friction))]
    sides = []
    for marker, solid, wheel in zip((element.i, element.j), pair_solids(pair), ("driver", "driven")):
        label = f"{name}.{wheel}"
        arguments = external(writer, label, solid.vertices, solid.triangles, writer.markers[id(marker)])
        sides.append([writer.graphics(arguments, label)])
    writer.comment(f"{name}: read by gearmbs, this is the exact contact of the pair in the next comments;")
    writer.comment("other programs let the meshes touch")
    for comment in comments:
        writer.comment(comment)
    touch(writer, name, sides, laws)
