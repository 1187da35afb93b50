"""Constraint terms, each stated once: `gearmbs.kernels.derive` makes ``derived.py``.

A term measures two markers by vectors that are fixed in their bodies. All its derivatives follow from how such a vector
s moves: with a rotation dpi as dpi x s; with the Euler angles theta_k about the axes a_k, in global components, as
a_k x s, and so do the axes that come after (see the rotation module); with time as w x s. Here these are three sorts of
variables in one trace. Of second rates the part without accelerations is wanted, so velocities do not change.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.dae.equations.expressions.opcodes import KIN_V, KIN_W
from gearmbs.dae.equations.layout import MK_ARM, MK_AXES
from gearmbs.dae.equations.rotation import KIN_AXES
from gearmbs.kernels.derive import ZERO, Function, Value, derivative, given, inputs, product, slopes

Vector = Sequence[Value]


def length(x):
    """Return |x|."""
    return np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])


def turned(x, y, f):
    """Return y turned by f about the third axis."""
    return [np.cos(f) * y[c] - np.sin(f) * x[c] for c in range(3)]


def cross(a: Vector, b: Vector, c: int) -> Value:
    """Return a component of a x b."""
    return a[c - 2] * b[c - 1] - a[c - 1] * b[c - 2]


class Body:
    """A body that moves: its variations, its Euler angles, and the vectors that are fixed in it.

    Parameters
    ----------
    mark : str
    time : Value
        By which rates are taken.
    order : sequence of str, optional
        Names of the axes of space for the kernel: those of a term along one axis begin with this one.
    moves : bool
        Whether it has rates.
    """

    def __init__(self, mark: str, time: Value, order: Sequence[str] = (), moves: bool = True) -> None:
        self.mark, self.time, self.order = mark, time, order
        self.turn = inputs(f"{mark}_pi_x {mark}_pi_y {mark}_pi_z")
        self.angles = inputs(f"{mark}_psi {mark}_theta {mark}_phi")
        self.axes = [self.vector(f"{mark}_{k}", f"{mark}_body", KIN_AXES + 3 * k) for k in range(3)]
        self.v = self.vector(f"{mark}_v", f"{mark}_body", KIN_V) if moves else [ZERO] * 3
        self.w = self.vector(f"{mark}_w", f"{mark}_body", KIN_W) if moves else [ZERO] * 3
        for k, axis in enumerate(self.axes):
            self.fix(axis, k)

    def vector(self, name: str, array: str, first: int | str) -> Vector:
        if not self.order:
            return inputs(" ".join(f"{name}{c}" for c in "xyz"), array, first)
        start = f"{first} + " if first else ""
        return [inputs(f"{name}{c}", array, f"{start}{index}")[0] for c, index in zip("xyz", self.order)]

    def fix(self, s: Vector, before: int = 3) -> Vector:
        """Say how a vector moves that is fixed in the body, or an Euler axis with the angles before it."""
        for c in range(3):
            moved: dict[Value, Value] = {self.turn[c - 2]: s[c - 1], self.turn[c - 1]: -s[c - 2]}
            moved |= {angle: cross(axis, s, c) for angle, axis in zip(self.angles, self.axes[:before])}
            given(s[c], moved | {self.time: cross(self.w, s, c)})
        return s

    def fixed(self, name: str, array: str, first: int | str) -> Vector:
        """Return a vector of an array that is fixed in the body."""
        return self.fix(self.vector(name, array, first))


def separation(i: Body, j: Body, one: Vector, two: Vector) -> tuple[Vector, Vector, Vector]:
    """Return P_I - P_J = R_I + s_I - R_J - s_J as numbers that are handed in, with R_I and R_J."""
    r_i, r_j = inputs("R_ix R_iy R_iz"), inputs("R_jx R_jy R_jz")
    x = inputs("x y z", "apart")
    turns = [*i.turn, *i.angles, *j.turn, *j.angles]
    for c in range(3):
        moved = {by: derivative(one[c], by) - derivative(two[c], by) for by in turns}
        rate = i.v[c] - j.v[c] + derivative(one[c], i.time) - derivative(two[c], i.time)
        given(x[c], moved | {r_i[c]: 1.0, r_j[c]: -1.0, i.time: rate})
    return x, r_i, r_j


class Term:
    """A term, from which its kernels follow.

    Parameters
    ----------
    name, arguments : str
        Of its kernels, which are given the rows of the bodies as well where they need them.
    phi : Value
    i, j : Body
    places : sequence of Value
        R of I and of J; none for a term without.
    """

    def __init__(self, name: str, arguments: str, phi: Value, i: Body, j: Body, places: Sequence[Vector] = ()) -> None:
        self.name, self.arguments, self.phi, self.i, self.j = name, arguments, phi, i, j
        self.by = [list(places[0]) if places else [ZERO] * 3, i.turn, list(places[1]) if places else [ZERO] * 3, j.turn]
        self.over = [self.by[0], i.angles, self.by[2], j.angles]

    def along(self, variables: Sequence[Vector], what: Value, form: str) -> dict[str, Value]:
        """Return the derivatives that are not zero, by place."""
        flat = [x for group in variables for x in group]
        found = [(q, derivative(what, x)) for q, x in enumerate(flat) if x is not ZERO]
        return {form.format(q): slope for q, slope in found if slope is not ZERO}

    def gradient(self, *returned: Value) -> Function:
        """Return the kernel of the gradient by [dR_I, dpi_I, dR_J, dpi_J], and of what it returns beside."""
        text = "Write the gradient by places and rotations."
        sets = self.along(self.by, self.phi, "g[{}]")
        return Function(f"{self.name}_slopes", f"{self.arguments}, g", text, returned, sets)

    def bent(self) -> Function:
        """Return the kernel of the second rate without accelerations."""
        text = "Return the second rate without accelerations."
        second = derivative(derivative(self.phi, self.i.time), self.i.time)
        return Function(f"{self.name}_bent", f"{self.arguments}, i_body, j_body", text, [second])

    def curves(self, both: bool = False) -> Function:
        """Return the kernel of the Hessian over [R_I, theta_I, R_J, theta_J], of its upper half or of both."""
        flat = [x for group in self.over for x in group]
        first = [derivative(self.phi, x) if x is not ZERO else ZERO for x in flat]
        sets: dict[str, Value] = {}
        for p, slope in enumerate(first):
            for q in range(p, 12):
                curve = derivative(slope, flat[q]) if flat[q] is not ZERO else ZERO
                if curve is not ZERO:
                    sets |= {f"hess[{p}, {q}]": curve} | ({f"hess[{q}, {p}]": curve} if both else {})
        text = (
            f"Write the Hessian over places and Euler angles{'' if both else ', its upper half,'} where it is not zero."
        )
        return Function(f"{self.name}_curves", f"{self.arguments}, i_body, j_body, hess", text, sets=sets)


def bodies(*order: str) -> tuple[Body, Body]:
    (time,) = inputs("time")
    return Body("i", time, order), Body("j", time, order)


def point() -> list[Function]:
    """One component, c, of P_I - P_J; c1 and c2 are those that follow."""
    i, j = bodies("c", "c1", "c2")
    arms = [i.fixed("arm_i", "i_frame", MK_ARM), j.fixed("arm_j", "j_frame", MK_ARM)]
    return [Term("point", "c, c1, c2, i_frame, j_frame", arms[0][0] - arms[1][0], i, j).curves(both=True)]


def dot() -> list[Function]:
    i, j = bodies()
    phi = product(i.fixed("a_", "i_frame", "a"), j.fixed("b_", "j_frame", "b"))
    term = Term("dot", "i_frame, a, j_frame, b", phi, i, j)
    return [term.gradient(phi), term.curves(both=True)]


def offset() -> list[Function]:
    """An axis of J times P_I - P_J."""
    i, j = bodies()
    x, r_i, r_j = separation(i, j, i.fixed("arm_i", "i_frame", MK_ARM), j.fixed("arm_j", "j_frame", MK_ARM))
    phi = product(x, j.fixed("b_", "j_frame", "b"))
    term = Term("offset", "i_frame, j_frame, b, apart", phi, i, j, (r_i, r_j))
    return [term.gradient(phi), term.bent(), term.curves()]


def distance() -> list[Function]:
    i, j = bodies()
    x, r_i, r_j = separation(i, j, i.fixed("arm_i", "i_frame", MK_ARM), j.fixed("arm_j", "j_frame", MK_ARM))
    phi = length(x)
    term = Term("distance", "i_frame, j_frame, apart", phi, i, j, (r_i, r_j))
    return [term.gradient(phi), term.bent(), term.curves()]


def angle() -> list[Function]:
    """The angle of x_I about z_J from x_J, of which sine and cosine are products of axes."""
    i, j = bodies()
    x_i, x_j = i.fixed("a_", "i_frame", MK_AXES), j.fixed("b_", "j_frame", MK_AXES)
    sine, cosine = product(x_i, j.fixed("d_", "j_frame", MK_AXES + 3)), product(x_i, x_j)
    square = cosine * cosine + sine * sine
    (phi,) = inputs("phi")
    moved = {x: (cosine * derivative(sine, x) - sine * derivative(cosine, x)) / square
             for x in [*i.turn, *i.angles, *j.turn, *j.angles, i.time]}  # fmt: skip
    term = Term("angle", "i_frame, j_frame", given(phi, moved), i, j)
    return [term.gradient(sine, cosine), term.bent(), term.curves()]


def rotation() -> list[Function]:
    """x_I times y_J turned by f(t), whose Hessian is that of a product of axes."""
    i, j = bodies()
    f, f1, f2, at_rest = *inputs("f f1 f2"), *inputs("at_rest")
    given(f, {i.time: f1, at_rest: f1})
    given(f1, {i.time: f2})
    x, y = j.fixed("b_", "j_frame", MK_AXES), j.fixed("d_", "j_frame", MK_AXES + 3)
    phi = product(i.fixed("a_", "i_frame", MK_AXES), turned(x, y, f))
    term, partial = Term("rotation", "i_frame, j_frame, f", phi, i, j), derivative(phi, at_rest)
    slope = term.gradient(phi, partial)
    slope.arguments = "i_frame, j_frame, f, f1, g, gt"
    slope.sets = {**slope.sets, **term.along(term.by, partial, "gt[{}]")}
    bent = term.bent()
    bent.arguments = "i_frame, j_frame, f, f1, f2, i_body, j_body"
    return [slope, bent]


def motions() -> list[Function]:
    """Return the kernels of what moves with bodies, for terms of these alone: vectors are triples of numbers."""
    (time,) = inputs("time")
    i, j, ground = Body("i", time), Body("j", time), Body("j", time, moves=False)
    i.w = inputs("w_x w_y w_z", "w")
    place = i.fixed("r_", "r", 0)
    v = inputs("v_x v_y v_z", "v")
    rates = [v[c] + derivative(place[c], time) for c in range(3)]
    bents = [derivative(rate, time) for rate in rates]
    made = [Function("point_motion", "v, w, r", "Return the velocity and the second rate of a point of a body.",
                     [*rates, *bents])]  # fmt: skip
    for name, other, arguments in (("dot_motion", j, "a, b, w, u"), ("dot_with_fixed", ground, "a, b, w")):
        if other is j:
            j.w = inputs("u_x u_y u_z", "u")
        a, b = i.fixed("a_", "a", 0), other.fixed("b_", "b", 0)
        phi = product(a, b)
        rate = derivative(phi, time)
        text = "Return a . b, its rate and second rate, and a x b, the gradient by the rotation of a's body."
        made.append(Function(name, arguments, text, [phi, rate, derivative(rate, time), *slopes(phi, i.turn)]))
    return made


def functions() -> list[Function]:
    return [*motions(), *point(), *dot(), *offset(), *distance(), *angle(), *rotation()]
