"""Relative pose of two wheels, and ends of the face, each stated once; see `gearmbs.kernels.derive`.

Symbols are those of docs/theory/contact.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.kernels.derive import (
    ONE,
    Function,
    Value,
    choose,
    derivative,
    given,
    inputs,
    product,
    slopes,
    tangent,
)

COMPILED = 'error_model="numpy", fastmath={"contract": True, "arcp": True}'

Vector = Sequence[Value]


def rates(a, h, p, q, w, twist):
    """Return x' = (a', h', p', q', phi1', phi2') and the turn of M by the twist of wheel 1 relative to wheel 2.

    M turns with half of it about x and y, less what z turns the tilt by; with what moves the line of centres about z.
    """
    rx, ry, rz, ox, oy, oz = twist
    mx = 0.5 * oy - 0.5 * (oz * q / w)
    my = 0.5 * (oz * p / w) - 0.5 * ox
    mz = -((ry + h * my) / a)
    tilted = p * my - q * mx
    share = 1.0 / (1.0 + w)
    own = p * ox + q * oy + w * oz + tilted * (1.0 + 2.0 * w) * share - mz
    return [-rx - h * mx, a * mx - rz, w * mx + q * mz, w * my - p * mz, own, -(tilted * share) - mz], [-my, mx, mz]


def pose() -> list[Function]:
    """x' is linear in the twist: x' = C t, so that the wrench that does the work of Q is C^T Q."""
    a, h, p, q = inputs("a h p q", "x")
    (w,) = inputs("w")
    given(w, {p: -(p / w), q: -(q / w)})
    twist = inputs("rx ry rz ox oy oz", "twist")
    force = inputs("Q_a Q_h Q_p Q_q Q_1 Q_2", "force")
    x, turn = rates(a, h, p, q, w, twist)
    columns = [slopes(one, twist) for one in x]
    turns = [slopes(one, twist) for one in turn]
    wrench = [product(force, [row[k] for row in columns]) for k in range(6)]
    pose_of = (a, h, p, q)
    return [
        Function("pose_rates", "x, w, twist, xd", "Write the rates of the pose.", sets=vector("xd", x)),
        Function("pose_rate_slopes", "x, w, twist, xd_x", "Write their derivatives by a, h, p, q.",
                 sets=matrix("xd_x", [slopes(one, pose_of) for one in x])),
        Function("pose_wrench", "x, w, force, wrench", "Write the wrench on wheel 1 that does the work of a force.",
                 sets=vector("wrench", wrench)),
        Function("pose_wrench_slopes", "x, w, force, wrench_x", "Write its derivatives by a, h, p, q.",
                 sets=matrix("wrench_x", [slopes(one, pose_of) for one in wrench])),
        Function("pose_columns", "x, w, columns, turn", "Write the derivatives by the twist of x' and of M's turn.",
                 sets=matrix("columns", columns) | matrix("turn", turns)),
    ]  # fmt: skip


def vector(name: str, values: Vector) -> dict[str, Value]:
    return {f"{name}[{k}]": value for k, value in enumerate(values)}


def matrix(name: str, values: Sequence[Vector]) -> dict[str, Value]:
    return {f"{name}[{i}, {k}]": value for i, row in enumerate(values) for k, value in enumerate(row)}


def end_of_face(a, h, p, q, base, sa, ca, sig, i_w, width, sign, other):
    """Return where an end face cuts the path of contact along the mean axis.

    ``width`` is half the width towards the end, with its sign, ``sign`` 1 for wheel 1 and -1 for wheel 2, whose axis
    stands at a: ``other`` is 1.
    """
    x, y = base * ca + sig * sa, sig * ca - base * sa
    return (width - sign * (p * x + q * y) - other * (p * a)) * i_w - 0.5 * (sign * h)


def ends() -> list[Function]:
    """Return the kernels of an end of the common face: the nearer end of two, blended where they tie.

    The smaller of two limits at the upper end, where ``end`` is 1, the larger at the lower: (u + v -+ |u - v|) / 2, and
    |d| is sqrt(d^2 + blend^2). cos alpha_0 = r_b/a, length^2 = a^2 - r_b^2, roll sig = (r_b1 f1 - r_b2 f2 + d alpha_0 +
    length)/2.
    """
    a, h, p, q = inputs("a h p q")
    f1, f2 = inputs("_f1 _f2")
    base, mate, total, difference, length = inputs("base mate total difference length")
    sa, ca, sig, i_w, width_1, width_2, end, blend = inputs("sa ca sig i_w width_1 width_2 end blend")
    i_w3, i_w5 = inputs("i_w3 i_w5")
    turned = total / (a * length)
    given(length, {a: a / length})
    given(sa, {a: ca * turned})
    given(ca, {a: -(sa * turned)})
    given(i_w, {p: p * i_w3, q: q * i_w3})
    given(i_w3, {p: 3.0 * (p * i_w5), q: 3.0 * (q * i_w5)})
    given(sig, {a: 0.5 * (difference * turned + a / length), f1: 0.5 * base, f2: -0.5 * mate})
    by = (a, h, p, q, f1, f2)
    u, v = (end_of_face(a, h, p, q, base, sa, ca, sig, i_w, width, sign, other)
            for width, sign, other in ((width_1, 1.0, 0.0), (width_2, -1.0, 1.0)))  # fmt: skip
    apart = u - v
    size = np.sqrt(apart * apart + blend * blend)
    i_size = 1.0 / size
    share = apart * i_size
    bend = blend * blend * i_size * i_size * i_size
    given(size, {x: share * derivative(apart, x) for x in by})
    given(share, {x: bend * derivative(apart, x) for x in by})
    limit = 0.5 * (u + v - end * size)
    first = slopes(limit, by)
    half = {(i, k): derivative(first[i], by[k]) for i in range(6) for k in range(i, 6)}
    second = [[half[min(i, k), max(i, k)] for k in range(6)] for i in range(6)]
    numbers = "a, h, p, q, base, sa, ca, sig, i_w, width_1, width_2, end, blend"
    more = f"{numbers}, mate, total, difference, length, i_w3"
    return [
        Function("end_value", numbers, "Return where the common face ends.", [limit]),
        Function("end_slopes", f"{more}, grad", "Write its gradient by the pose.", sets=vector("grad", first)),
        Function("end_curves", f"{more}, i_w5, hess", "Write its Hessian.", sets=matrix("hess", second)),
    ]


def roll_of_flanks(a, h, p, q, f1, f2, zeta, own, twist, sign, rb1, rb2, alpha, length):
    """Return the length of roll half-way between two flanks, axes taken as parallel but for what a tilt moves first.

    s = (r_b1 F_1 - r_b2 F_2 + (r_b1 - r_b2) alpha + L) / 2 on wheel 1, with the other sign but for L on wheel 2. A tilt
    turns the normal of a section by 2 zeta (q / a - p R_b / (a L)), a helix the tooth by the place along the axis.
    """
    turned = q / a - p * (rb1 + rb2) / (a * length)
    apart = rb1 * f1 - rb2 * f2 + (rb1 - rb2) * alpha
    return 0.5 * (sign * apart + length) + 2.0 * (zeta * own) * turned - twist * (zeta + sign * (0.5 * h))


def foot_square(a, p, q, zeta, r, se, ce, mate):
    """Return the square of the mate's length of roll under a tip corner: P^2 - r_b^2, P from the mate's axis."""
    x, y = a - r * ce - 2.0 * (p * zeta), -(r * se) - 2.0 * (q * zeta)
    return x * x + y * y - mate * mate


def rolls() -> list[Function]:
    """cos alpha = R_b / a and L^2 = a^2 - R_b^2, so that alpha_a = R_b / (a L) and L_a = a / L."""
    by = a, h, p, q, f1, f2 = inputs("a h p q f1 f2")
    zeta, own, twist, sign, rb1, rb2, alpha, length = inputs("zeta own twist sign rb1 rb2 alpha length")
    given(length, {a: a / length})
    given(alpha, {a: (rb1 + rb2) / (a * length)})
    roll = roll_of_flanks(a, h, p, q, f1, f2, zeta, own, twist, sign, rb1, rb2, alpha, length)
    first = slopes(roll, by)
    second = [slopes(one, by) for one in first]
    told = "a, h, p, q, f1, f2, zeta, own, twist, sign, rb1, rb2, alpha, length, grad, hess"
    return [
        Function("flanks_roll", told, "Return the length of roll of flank on flank, write its derivatives.", [roll],
                 sets=vector("grad", first) | matrix("hess", second)),
        *foot(),
    ]  # fmt: skip


def foot() -> list[Function]:
    """A helical tip edge turns by -k per length of its wheel: w (eta - eta_0) + k (Z + r (p cos + q sin)) = 0."""
    a, h, p, q, zeta, r, se, ce, own, s, k, w = inputs("a h p q zeta r se ce own s k w")
    (mate,), (eta, spin) = inputs("mate"), inputs("_eta _F")
    square = foot_square(a, p, q, zeta, r, se, ce, mate)
    given(se, {eta: ce})
    given(ce, {eta: -se})
    given(w, {p: -(p / w), q: -(q / w)})
    along = k * (zeta + own * (0.5 * h) + r * (p * ce + q * se))
    behind = given(along / w, {eta: -ONE, spin: ONE})
    edge = along - w * behind
    by_eta = derivative(edge, eta)
    moves = [{x: ONE, eta: -(derivative(edge, x) / by_eta)} for x in (a, h, p, q, spin)]
    given(s, {x: 0.5 * (derivative(square, x) / s) for x in (a, p, q, eta)})
    first = [tangent(s, move) for move in moves]
    second = [[tangent(first[min(i, k)], moves[max(i, k)]) for k in range(5)] for i in range(5)]
    # the spin is wheel 1's where the corner is, else wheel 2's
    at_1, at_2 = [choose(own, 0.0, x, y) for x, y in ((1.0, 0.0), (0.0, 1.0))]
    shares = [*([ONE] * 4), at_1, at_2]
    wide = [0, 1, 2, 3, 4, 4]
    grad = [first[i] * shares[n] for n, i in enumerate(wide)]
    hess = [[second[i][k] * (shares[n] * shares[m]) for m, k in enumerate(wide)] for n, i in enumerate(wide)]
    told = "a, h, p, q, zeta, r, se, ce, own, s, k, w"
    return [
        Function("foot_square", "a, p, q, zeta, r, se, ce, mate", "Return the square of the length of roll.", [square]),
        Function("foot_slopes", f"{told}, grad", "Add the gradient of the length of roll under a corner.",
                 adds=vector("grad", grad)),
        Function("foot_bends", f"{told}, hess", "Add its Hessian.", adds=matrix("hess", hess)),
    ]  # fmt: skip


def functions() -> list[Function]:
    return [*pose(), *ends(), *rolls()]
