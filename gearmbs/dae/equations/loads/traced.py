"""Frames of markers in definitions of force elements, and the kernels that these become.

`gearmbs.kernels.derive` traces a law; here are its vectors, and the derivatives by the spatial variations
[dP, dpi, dv, dw] of each frame, with dA = dpi x A.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gearmbs.dae.equations.loads.forces import FRAME_A, FRAME_P, FRAME_V, FRAME_W
from gearmbs.kernels.derive import ZERO, Function, Value, derivative, given, inputs, tangent

Vector = Sequence[Value]


def dot(a, b):
    """Return the product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Return the cross product of two vectors."""
    return [a[c - 2] * b[c - 1] - a[c - 1] * b[c - 2] for c in range(3)]


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


def rows(values: Vector, by: Vector) -> Mapping[tuple[int, int], Value]:
    """Return the derivatives that are not zero, by row and column."""
    found = {(r, q): derivative(value, x) for r, value in enumerate(values) for q, x in enumerate(by)}
    return {place: slope for place, slope in found.items() if slope is not ZERO}


def matrix(array: str, values: Vector, by: Vector, first: int) -> dict[str, Value]:
    return {f"{array}[{first + r}, {q}]": slope for (r, q), slope in rows(values, by).items()}


def placed(form: str, first: int, values: Vector) -> dict[str, Value]:
    return {form.format(first + k): value for k, value in enumerate(values)}
