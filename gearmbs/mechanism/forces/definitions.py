"""Springs between two markers, each law stated once: `gearmbs.kernels.derive` makes ``derived.py``.

Derivatives are by the spatial variations [dP, dpi, dv, dw] of both frames, with dA = dpi x A.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gearmbs.dae.equations.loads.forces import FRAME_A, FRAME_P, FRAME_V, FRAME_W
from gearmbs.kernels.derive import ZERO, Function, Value, derivative, given, inputs, product, tangent

Vector = Sequence[Value]


def dot(a, b):
    """Return the product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Return the cross product of two vectors."""
    return [a[c - 2] * b[c - 1] - a[c - 1] * b[c - 2] for c in range(3)]


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


def seen_from(d, v, spin):
    """Return v - spin x d, the velocity of a point at d from a frame that turns."""
    return [one - other for one, other in zip(v, cross(spin, d))]


class Frame:
    """A row of frames: origin, axes, velocities; and its twelve variations.

    Parameters
    ----------
    row, mark : str
        Name of the array, and of the numbers.
    before : str
        What stands before the place in the row: ``"0, "`` of the first row of a matrix.
    """

    def __init__(self, row: str, mark: str, before: str = "") -> None:
        def three(name: str, first: int) -> list[Value]:
            return inputs(" ".join(f"{mark}_{name}{k}" for k in "xyz"), row, f"{before}{first}" if before else first)

        self.origin, self.v, self.w = three("p", FRAME_P), three("v", FRAME_V), three("w", FRAME_W)
        turn = inputs("turn_x turn_y turn_z")
        rows = [three(name, FRAME_A + 3 * at) for at, name in enumerate("abc")]
        self.axes = [[rows[c][k] for c in range(3)] for k in range(3)]
        for axis in self.axes:
            for c in range(3):
                given(axis[c], {turn[c - 2]: axis[c - 1], turn[c - 1]: -axis[c - 2]})
        self.variations = [*self.origin, *turn, *self.v, *self.w]

    def minus(self, other: Frame) -> tuple[Vector, Vector, Vector]:
        """Return the differences of origins, velocities and angular velocities."""
        pairs = ((self.origin, other.origin), (self.v, other.v), (self.w, other.w))
        return tuple([a - b for a, b in zip(*pair)] for pair in pairs)  # type: ignore[return-value]


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


def changed(name: str, arguments: str, load: Vector, row: int, law: Vector) -> Function:
    """Return the kernel of the derivative of a load along a change of the numbers of its law."""
    rates = dict(zip(law, inputs(" ".join(f"d_{one.name}" for one in law), "changed")))
    sets = placed("out[{}]", row, [tangent(one, rates) for one in load])
    return Function(
        f"{name}_changed", f"{arguments}, changed, out", "Write how it changes with its numbers.", sets=sets
    )


def kernels(
    name: str, what: str, load: Vector, row: int, by: Vector, extra: str = "", slopes: str = ""
) -> list[Function]:
    """Return the kernels that write a load, from a row of the wrench on, and its derivatives."""
    arguments = ", ".join(filter(None, ("one, two, law", extra)))
    more = ", ".join(filter(None, (arguments, slopes)))
    return [
        Function(f"{name}_load", f"{arguments}, wrench", f"Write {what}.", sets=placed("wrench[0, {}]", row, load)),
        Function(
            f"{name}_slopes", f"{more}, jac", f"Write the derivatives of {what}.", sets=matrix("jac", load, by, row)
        ),
    ]


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


def rows(values: Vector, by: Vector) -> Mapping[tuple[int, int], Value]:
    """Return the derivatives that are not zero, by row and column."""
    found = {(r, q): derivative(value, x) for r, value in enumerate(values) for q, x in enumerate(by)}
    return {place: slope for place, slope in found.items() if slope is not ZERO}


def matrix(array: str, values: Vector, by: Vector, first: int) -> dict[str, Value]:
    return {f"{array}[{first + r}, {q}]": slope for (r, q), slope in rows(values, by).items()}


def placed(form: str, first: int, values: Vector) -> dict[str, Value]:
    return {form.format(first + k): value for k, value in enumerate(values)}


def functions() -> list[Function]:
    return [*line_spring(), *axis_spring(), *shifts()]
