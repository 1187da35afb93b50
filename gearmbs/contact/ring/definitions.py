"""The piece of a bending rim at a planet, stated once: `gearmbs.kernels.derive` makes ``derived.py``.

What it is and how it moves is told at the head of `gearmbs.contact.ring.kernel`. The rim's shape at the planet enters
by sums over its modes, each with its derivatives by the angle theta; derivatives are by the variations of both frames
and by these sums, as the amplitudes themselves move them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gearmbs.dae.equations.loads.traced import Frame, cross, dot, matrix, placed
from gearmbs.kernels.derive import ONE, ZERO, Function, derivative, given, inputs

SHAPE = "w w_1 w_2 w_3 v v_1 v_2 psi psi_1 psi_2 turning turning_1".split()
"""w, its rate v at a place of the rim, psi and its rate: each followed by its derivatives by theta."""


def place(planet, ring):
    """Return theta of a planet in the ring's axes, e_r, e_t, theta's gradient by the planet's place, and theta'."""
    arm, v, _ = planet.minus(ring)
    x, y = dot(ring.axes[0], arm), dot(ring.axes[1], arm)
    far = np.sqrt(x * x + y * y)
    radial = [(x * a + y * b) / far for a, b in zip(ring.axes[0], ring.axes[1])]
    along = [(x * b - y * a) / far for a, b in zip(ring.axes[0], ring.axes[1])]
    gradient = [one / far for one in along]
    rate = dot(gradient, [one - other for one, other in zip(v, cross(ring.w, arm))])
    return np.arctan2(y, x), radial, along, gradient, rate


def displaced(radial, along, w, slope):
    """Return w e_r + w' e_t."""
    return [w * a + slope * b for a, b in zip(radial, along)]


def piece(ring, radial, along, rate, s):
    """Return origin, axes, velocity and angular velocity of the piece of rim at a planet."""
    x, y, z = ring.axes
    shift = displaced(radial, along, s["w"], s["w_1"])
    drift = rate * (s["w"] + s["w_2"])
    moved = displaced(radial, along, s["v"], s["v_1"] + drift)
    turn_rate = s["turning"] + s["psi_1"] * rate
    cosine, sine = np.cos(s["psi"]), np.sin(s["psi"])
    axes = [displaced(x, y, cosine, sine), displaced(x, y, -sine, cosine), z]
    velocity = [a + b + c for a, b, c in zip(ring.v, cross(ring.w, shift), moved)]
    return [a + b for a, b in zip(ring.origin, shift)], axes, velocity, [a + turn_rate * b for a, b in zip(ring.w, z)]


def handed_on(planet, origin, axis, radial, along, gradient, load, s):
    """Return the wrench on the planet with S along its path, and F_r, F_t and M_z on the piece."""
    force = load[:3]
    arm = [a - b for a, b in zip(planet.origin, origin)]
    moment = [a + b for a, b in zip(load[3:], cross(arm, force))]
    pushing, axial = -dot(force, along), -dot(axis, moment)
    push = pushing * (s["w"] + s["w_2"]) + axial * s["psi_1"]
    return [a + push * b for a, b in zip(force, gradient)] + list(load[3:]), (-dot(force, radial), pushing, axial)


def functions() -> list[Function]:
    planet, ring = Frame("planet", "p"), Frame("ring", "r")
    theta, radial, along, gradient, rate = place(planet, ring)
    sums, load = inputs(" ".join(SHAPE), "shape"), inputs("fx fy fz nx ny nz", "load")
    s = dict(zip(SHAPE, sums))
    for name, following in pairwise(SHAPE):
        if following.startswith(name.split("_")[0] + "_"):
            given(s[name], {theta: s[following]})
    origin, axes, velocity, spin = piece(ring, radial, along, rate, s)
    acting, parts = handed_on(planet, origin, ring.axes[2], radial, along, gradient, load, s)
    by = [*planet.variations, *ring.variations, *sums]
    # the piece turns with the ring, and by psi in it
    turns = [
        [(ONE if one is turn else ZERO) + axis * derivative(s["psi"], one) for one in by]
        for turn, axis in zip(ring.variations[3:6], ring.axes[2])
    ]
    moved = [[derivative(value, one) for one in by] for value in (theta, *origin, *velocity, *spin)]
    piece_slopes = [*moved[:4], *turns, *moved[4:]]
    slopes = {f"piece[{r}, {q}]": x for r, row in enumerate(piece_slopes) for q, x in enumerate(row) if x is not ZERO}
    pose = [*origin, *(axes[k][c] for c in range(3) for k in range(3)), *velocity, *spin]
    return [
        Function("place", "planet, ring", "Return theta.", [theta]),
        Function("piece", "planet, ring, shape, pose", "Write the frame of the piece.",
                 sets=placed("pose[{}]", 0, pose)),
        Function("handed_on", "planet, ring, shape, load, acting", "Write the planet's wrench; return F_r, F_t, M_z.",
                 parts, sets=placed("acting[{}]", 0, acting)),
        Function("slopes", "planet, ring, shape, load, piece, handed",
                 "Write the derivatives of theta, of the twelve variations of the piece, and of what is handed on.",
                 sets=slopes | matrix("handed", [*acting, *parts], [*by, *load], 0)),
    ]  # fmt: skip
