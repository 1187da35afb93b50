"""Contact of wheels about two fixed parallel axes, each law stated once: `gearmbs.kernels.derive` makes ``derived.py``.

The gap of the general section, at no tilt: with the normal (sin alpha, cos alpha) and h_i as in
`gearmbs.contact.gaps.definitions`,

    g = a sin(alpha) - h_1 - h_2,
    h = r_b (phi + psi + alpha) = s of an involute,    h = r sin(alpha + eta) + rho of a tip corner.

Two involutes have one alpha, and one gap for all tooth pairs of a side. Of a corner, alpha is where g is stationary; a
corner close to the mate's base circle is on a plane. A contact is handed on as a row of numbers (`CONTACT`): g, its
slopes by a, phi_1 and phi_2, the normal, where the contact is along it, and the derivatives of these by the angles.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gearmbs.kernels.derive import ONE, ZERO, Function, Value, derivative, given, inputs, tangent


def corner_support(sin, cos, sin_eta, cos_eta, radius, rounding):
    """Return h of a tip corner."""
    return radius * (sin * cos_eta + cos * sin_eta) + rounding


def flank_support(base, start, alpha):
    """Return h of an involute, which is the length of roll; the start is phi + psi."""
    return base * (start + alpha)


def fallen(over, bend):
    """Return by how much the mate's flank is lower where it goes on behind its tip."""
    return 0.5 * bend * over * over


def plane_distance(a, sin_eta, cos_eta, sin_turn, cos_turn, radius, base, beside):
    """Return how far a corner is from the axis of the wide cylinder that stands for a plane of its mate."""
    x = a - radius * cos_eta - (base * cos_turn + beside * sin_turn)
    y = -radius * sin_eta - (base * sin_turn - beside * cos_turn)
    return np.sqrt(x * x + y * y)


def sliding(a, sin, normal, rate_1, rate_2):
    """Return the velocity of wheel 1 against wheel 2 along the profile."""
    return -a * sin * rate_2 - normal * (rate_1 - rate_2)


def planar_wrench(a, force, friction, moment, by_a, by_1, by_2, sin, cos):
    """Return the force on wheel 1 along and across the line of centres, and the moment about its axis.

    ``moment`` is that of friction, its product with the place along the normal.
    """
    return (friction * cos - force * by_a, force * (by_1 + by_2) / a - friction * sin, force * by_1 - moment)


CONTACT = "gap by_a by_1 by_2 sin cos normal"
"""A contact: the gap, its slopes by a, phi_1 and phi_2, the direction of the normal, and the place along it."""
BENDS = "alpha_1 alpha_2 by_a_1 by_a_2 by_1_1 by_1_2 by_2_1 by_2_2 normal_1 normal_2"
"""Derivatives by phi_1 and phi_2: of alpha, of the slopes, of the place. They stand behind the contact."""
Moves = Mapping[Value, Value]


def contact(name: str, arguments: str, what: str, shape: tuple[Value, ...], by: list[Moves]) -> list[Function]:
    """Return the kernels that write a contact and the derivatives of it.

    Parameters
    ----------
    name, arguments, what : str
    shape : tuple of Value
        Gap, sine and cosine of alpha, alpha, place along the normal.
    by : list
        How what these are made of moves with a, phi_1 and phi_2.
    """
    gap, sin, cos, alpha, normal = shape
    by_a, by_1, by_2 = (tangent(gap, moves) for moves in by)
    bends = [tangent(x, moves) for x in (alpha, by_a, by_1, by_2, normal) for moves in by[1:]]
    told = [gap, by_a, by_1, by_2, sin, cos, normal]
    arguments += ", contact"
    return [
        Function(name, arguments, f"Write the contact of {what}.", sets=numbered("contact", told)),
        Function(
            f"{name}_slopes", arguments, f"Write the derivatives of the contact of {what}.",
            sets=numbered("contact", bends, len(told)),
        ),
    ]  # fmt: skip


def corner(first: bool) -> list[Function]:
    """Return the kernels of a tip corner of wheel 1, or of wheel 2, on the mate's involute."""
    a, alpha, sin, cos, start, base, tip, bend = inputs("a alpha sin cos start base tip bend")
    eta, sin_eta, cos_eta, radius, rounding = inputs("eta sin_eta cos_eta radius rounding")
    turn(alpha, sin, cos)
    turn(eta, sin_eta, cos_eta)
    own = corner_support(sin, cos, sin_eta, cos_eta, radius, rounding)
    mate = flank_support(base, start, alpha)
    gap = a * sin - own - mate
    # alpha is where the gap is stationary
    still = derivative(gap, alpha)
    by_a, by_eta = (-derivative(still, x) / derivative(still, alpha) for x in (a, eta))
    gap = gap + fallen(mate + 0.5 * gap - tip, bend)
    moves: list[Moves] = [{eta: ONE, alpha: by_eta}, {start: ONE}]
    return contact(
        f"corner_{1 if first else 2}",
        "a, alpha, sin, cos, start, base, tip, bend, sin_eta, cos_eta, radius, rounding",
        f"a tip corner of wheel {1 if first else 2} on an involute",
        (gap, sin, cos, alpha, (own if first else mate) + 0.5 * gap),
        [{a: ONE, alpha: by_a}, *(moves if first else moves[::-1])],
    )


def corner_on_plane(first: bool) -> list[Function]:
    """Return the kernels of a tip corner of wheel 1, or of wheel 2, on the plane by which an involute begins."""
    a, turned, sin_turn, cos_turn, base, beside, before = inputs("a turned sin_turn cos_turn base beside before")
    eta, sin_eta, cos_eta, radius, rounding, plane = inputs("eta sin_eta cos_eta radius rounding plane")
    turn(turned, sin_turn, cos_turn)
    turn(eta, sin_eta, cos_eta)
    distance = plane_distance(a, sin_eta, cos_eta, sin_turn, cos_turn, radius, base, beside)
    gap, sin = distance - plane - rounding, -sin_turn
    own = corner_support(sin, cos_turn, sin_eta, cos_eta, radius, rounding)
    mate = flank_support(base, before, ZERO)
    moves: list[Moves] = [{eta: ONE}, {turned: ONE}]
    return contact(
        f"plane_{1 if first else 2}",
        "a, sin_turn, cos_turn, base, beside, before, plane, sin_eta, cos_eta, radius, rounding",
        f"a tip corner of wheel {1 if first else 2} on a plane",
        (gap, sin, cos_turn, -turned, (own if first else mate) + 0.5 * gap),
        [{a: ONE}, *(moves if first else moves[::-1])],
    )


def forces() -> list[Function]:
    """Return the kernels that every contact has: its rates, its wrench, and the derivatives of that."""
    a, force, ratio, rate_1, rate_2, phi_1, phi_2 = inputs("a force ratio rate_1 rate_2 phi_1 phi_2")
    stiffness, damping, ratio_slope = inputs("stiffness damping ratio_slope")
    gap, by_a, by_1, by_2, sin, cos, normal = inputs(CONTACT, "contact")
    bends = inputs(BENDS, "contact", 7)
    alpha = given(inputs("alpha")[0], dict(zip((phi_1, phi_2), bends[:2])))
    for k, told in enumerate((by_a, by_1, by_2, normal)):
        given(told, dict(zip((phi_1, phi_2), bends[2 + 2 * k :])))
    given(gap, {phi_1: by_1, phi_2: by_2})
    turn(alpha, sin, cos)
    approach, speed = by_1 * rate_1 + by_2 * rate_2, sliding(a, sin, normal, rate_1, rate_2)
    given(force, {gap: -stiffness, approach: -damping})
    # the ratio depends on the size of the speed; its slope is over that
    given(ratio, {speed: ratio_slope * speed})
    friction = -(ratio * force * speed)
    wrench = planar_wrench(a, force, friction, friction * normal, by_a, by_1, by_2, sin, cos)
    sums = [derivative(row, x) for row in wrench for x in (phi_1, phi_2, rate_1, rate_2)]
    return [
        Function(
            "contact_rates", "a, rate_1, rate_2, contact", "Return the rate of the gap and the sliding velocity.",
            [approach, speed],
        ),
        Function(
            "contact_wrench", "a, force, ratio, rate_1, rate_2, contact, sums", "Add the wrench of a contact.",
            adds=numbered("sums", wrench),
        ),
        Function(
            "contact_slopes",
            "a, force, stiffness, damping, ratio, ratio_slope, rate_1, rate_2, contact, sums",
            "Add the derivatives of the wrench of a contact by both angles and their rates.",
            adds=numbered("sums", sums, 3),
        ),
    ]  # fmt: skip


def flanks() -> list[Function]:
    """Return the kernels of all flanks of a side together: they differ in their places along the normal alone."""
    a, sin, cos, base_1, base_2, place = inputs("a sin cos base_1 base_2 place")
    force, friction, moment, rate_1, rate_2 = inputs("force friction moment rate_1 rate_2")
    wrench = planar_wrench(a, force, friction, moment, sin, -base_1, -base_2, sin, cos)
    return [
        Function("flank_sliding", "a, sin, place, rate_1, rate_2", "Return the sliding velocity of flanks.",
                 [sliding(a, sin, place, rate_1, rate_2)]),
        Function("flank_wrench", "a, sin, cos, base_1, base_2, force, friction, moment, sums",
                 "Add the wrench of flanks: sums of force, friction, and friction times place.",
                 adds=numbered("sums", wrench)),
    ]  # fmt: skip


def turn(angle: Value, sin: Value, cos: Value) -> None:
    """Say of what angle two numbers are sine and cosine."""
    given(sin, {angle: cos})
    given(cos, {angle: -sin})


def numbered(array: str, values, first: int = 0) -> dict[str, Value]:
    return {f"{array}[{first + k}]": value for k, value in enumerate(values)}


def functions() -> list[Function]:
    return [*corner(True), *corner(False), *corner_on_plane(True), *corner_on_plane(False), *forces(), *flanks()]
