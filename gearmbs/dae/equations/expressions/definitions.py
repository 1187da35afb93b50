"""Leaves of position level, each stated once: `gearmbs.kernels.derive` makes ``derived.py``.

A leaf is X . e or |X|, with X = R_i + s_i - R_j - s_j and an axis e of a body k. In coordinates (R, theta) of a body
its Euler axes a_k, in global components, carry everything (see the rotation module): a vector s fixed in the body has
ds/dtheta_k = a_k x s, and so has an axis a_l that comes after a_k.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.dae.equations.expressions.opcodes import KIN_AXES
from gearmbs.kernels.derive import ZERO, Function, Value, derivative, given, inputs, product, slopes

Vector = Sequence[Value]


def along(x, e):
    """Return X . e."""
    return product(x, e)


def length(x):
    """Return |X|."""
    return np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])


def turning(body: str, fixed: Vector) -> list[Value]:
    """Say how a vector fixed in a body, and the Euler axes of it, turn with three angles, and return those."""
    theta = inputs(f"{body}_psi {body}_theta {body}_phi")
    axes = [inputs(" ".join(f"{body}_{k}{c}" for c in "xyz"), f"{body}_body", KIN_AXES + 3 * k) for k in range(3)]
    for v, before in ((fixed, axes), (axes[1], axes[:1]), (axes[2], axes[:2])):
        for c in range(3):
            given(v[c], {t: a[c - 2] * v[c - 1] - a[c - 1] * v[c - 2] for t, a in zip(theta, before)})
    return theta


def leaf(name: str, with_axis: bool) -> list[Function]:
    """Return the kernels of the derivatives of a leaf by R and theta of bodies i and j, and theta of k."""
    places = [inputs(f"{body}_x {body}_y {body}_z") for body in "ij"]
    arms = [inputs(f"arm_{body}x arm_{body}y arm_{body}z", f"arm_{body}") for body in "ij"]
    x, e = inputs("x y z", "vector"), inputs("e_x e_y e_z", "axis")
    turns = [turning(body, arm) for body, arm in zip("ij", arms)]
    for c in range(3):
        moved: dict[Value, Value | float] = {}
        for sign, place, arm, turn in zip((1.0, -1.0), places, arms, turns):
            moved |= {place[c]: sign} | {theta: sign * derivative(arm[c], theta) for theta in turn}
        given(x[c], moved)
    by = [*places[0], *turns[0], *places[1], *turns[1]]
    value, arguments = length(x), "arm_i, arm_j, vector, i_body, j_body"
    if with_axis:
        by += turning("k", e)
        value, arguments = along(x, e), "arm_i, arm_j, vector, axis, i_body, j_body, k_body"
    rows = {f"out[{p}]": slope for p, slope in enumerate(slopes(value, by))}
    pairs = [(p, q, derivative(row, by[q])) for p, row in enumerate(rows.values()) for q in range(p, len(by))]
    curves = {f"out[{p}, {q}]": curve for p, q, curve in pairs if curve is not ZERO}
    return [
        Function(f"{name}_slopes", f"{arguments}, out", "Write the gradient.", sets=rows),
        Function(f"{name}_curves", f"{arguments}, out", "Write half the Hessian where it is not zero.", sets=curves),
    ]


def functions() -> list[Function]:
    return [*leaf("along", True), *leaf("length", False)]
