"""Springs between two markers, each law stated once: `gearmbs.kernels.derive` makes ``derived.py``.

Derivatives are by the spatial variations [dP, dpi, dv, dw] of both frames, with dA = dpi x A.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.loads.traced import Frame, changed, kernels, placed, rows, seen_from
from gearmbs.kernels.derive import Function, given, inputs, product


def step(x):
    """Return STEP(x, 0, 0, 1, 1)."""
    r = np.minimum(np.maximum(x, 0.0), 1.0)
    return r * r * (3.0 - 2.0 * r)


def impact_forces(depth, rate, stiffness, exponent, damping, full_depth):
    """Return k d^e, and IMPACT: max(0, k d^e + c STEP(d, 0, 0, d_max, 1) d')."""
    elastic = stiffness * depth**exponent
    return elastic, np.maximum(elastic + damping * step(depth / full_depth) * rate, 0.0)


def line_force(d, u, stiffness, damping, free, preload):
    """Return F along the line d from J to I, seen from J moving by u."""
    length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    along = (u[0] * d[0] + u[1] * d[1] + u[2] * d[2]) / length
    force = preload - stiffness * (length - free) - damping * along
    return [force / length * x for x in d]


def axis_torque(z, w, angle, stiffness, damping, free, preload):
    """Return N about the axis z of J, by the angle of I about it and by w, seen from J."""
    torque = preload - stiffness * (angle - free) - damping * product(w, z)
    return [torque * x for x in z]


LAW = "stiffness damping free preload"


def line_spring() -> list[Function]:
    i, j = Frame("one", "i"), Frame("two", "j")
    d, u, _ = i.minus(j)
    law = inputs(LAW, "law")
    force = line_force(d, u, *law)
    made = kernels("line", "the force of a spring along a line", force, 0, i.variations + j.variations)
    return [*made, changed("line", "one, two, law", force, 0, law)]


def axis_spring() -> list[Function]:
    i, j = Frame("one", "i"), Frame("two", "j")
    angle, *slopes = inputs("angle angle_x angle_y angle_z")
    turns = i.variations[3:6] + j.variations[3:6]
    given(angle, dict(zip(turns, [*slopes, *(-slope for slope in slopes)])))
    law = inputs(LAW, "law")
    torque = axis_torque(j.axes[2], i.minus(j)[2], angle, *law)
    by, what = i.variations + j.variations, "the torque of a spring about an axis"
    made = kernels("axis", what, torque, 3, by, "angle", "angle_x, angle_y, angle_z")
    return [*made, changed("axis", "one, two, law, angle", torque, 3, law)]


def shifts() -> list[Function]:
    """Return the kernels of what bushings, fields and beams see of I in the axes of J, all but the angles."""
    i, j = Frame("one", "i"), Frame("two", "j")
    d, v, w = i.minus(j)
    seen = seen_from(d, v, j.w)
    told = [product(axis, x) for x in (d, seen, w) for axis in j.axes]
    by = i.variations + j.variations
    slopes = {f"slopes[{row}, {q}]": slope for (row, q), slope in rows(told, by).items()}
    return [
        Function("shifts", "one, two, seen", "Write displacements and velocities in the axes of J.",
                 sets=placed("seen[{}]", 0, told)),
        Function("shift_slopes", "one, two, slopes", "Write their derivatives.", sets=slopes),
    ]  # fmt: skip


def functions() -> list[Function]:
    return [*line_spring(), *axis_spring(), *shifts()]
