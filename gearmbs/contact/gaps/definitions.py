"""The gap of two profiles in a section across two tilted wheels, stated once; see `gearmbs.kernels.derive`.

A section plane stands across the mean axis. In it the contact normal is ``n = (sin alpha, cos alpha)`` from wheel 1 to
wheel 2, and with the support functions h of the two profiles

    gap = stationary over alpha of  a sin(alpha) - 2 (A / w) zeta - h_1 - h_2,      A = p sin(alpha) + q cos(alpha).

An involute has ``h = (kappa / w) s``, ``s = r_b (phi + psi + alpha + E)``, an involute helicoid
``h = (U s + V Z) / Omega``, and a tip corner ``h = r (sin(alpha + eta) + m A L) + rho kappa / w`` with
``m = 1 / (w (1 + w))``, ``L = A sin(alpha + eta) + B cos(alpha + eta)``; letters as in docs/theory/contact.md.

Derivatives are taken in the frame of the normal: by alpha, by the tilt (A, B) along and across a normal at rest, by a,
h and both spins; A and B are turned into p and q at the end. What is handed in says how it moves: as alpha grows the
normal turns in the tilt, ``dA = B dalpha``, ``dB = -A dalpha``, and what hangs on the tilt alone, such as w, Omega and
the L of a corner, stands still. Alpha is eliminated: ``g_xx - g_xalpha g_alphax / g_alphaalpha``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gearmbs.kernels.derive import ONE, Function, Value, choose, derivative, given, inputs, tangent

COMPILED = 'error_model="numpy", fastmath={"contract": True, "arcp": True}'
"""As all kernels of contact, see `gearmbs.contact.records`."""
TILT = "p q w i_w one m m_w m_ww"
Moves = Mapping[Value, Value]


def gap_of(a, sa, A, i_w, zeta, both):
    """Return the gap from both support functions together, of spur wheels."""
    return a * sa - 2.0 * (A * i_w * zeta) - both


def involute_support(kap, s_w):
    """Return h of an involute."""
    return kap * s_w


def helicoid_support(U, V, s, Z, inverse):
    """Return h of an involute helicoid."""
    return (U * s + V * Z) * inverse


def corner_support(sn, A, L, m, kap, i_w, radius, rounding):
    """Return h of a tip corner."""
    return radius * (sn + m * A * L) + rounding * kap * i_w


class Section:
    """A normal and the tilt of both axes in a section, with what follows from them; wheels are handed in."""

    def __init__(self) -> None:
        self.a, self.zeta, self.h, self.sa, self.ca = inputs("a zeta h sa ca")
        sa, ca = self.sa, self.ca
        p, q, w, i_w, one, m, m_w, m_ww = inputs(TILT)
        self.w, self.i_w, self.one, self.m = w, i_w, one, m
        self.alpha, self.by_A, self.by_B = alpha, by_A, by_B = inputs("_alpha _A _B")
        self.F1, self.F2 = inputs("_F1 _F2")
        given(sa, {alpha: ca})
        given(ca, {alpha: -sa})
        self.A = A = given(p * sa + q * ca, {by_A: ONE, alpha: p * ca - q * sa})
        self.B = B = given(p * ca - q * sa, {by_B: ONE, alpha: -A})
        for value, slope in ((w, -ONE), (i_w, i_w * i_w), (one, one * one), (m, -m_w), (m_w, -m_ww)):
            given(value, {by_A: slope * A * i_w, by_B: slope * B * i_w})
        self.kap = kap = np.sqrt(1.0 - B * B)
        self.i_k = i_k = 1.0 / kap
        given(kap, {by_B: -B * i_k, alpha: A * B * i_k})
        given(i_k, {by_B: B * i_k * i_k * i_k, alpha: -A * B * i_k * i_k * i_k})

    def turn(self) -> tuple[Value, Value]:
        """Return the slopes of E by A and B."""
        by_A = self.B * self.i_w * self.one
        return by_A, self.A * (self.w + self.B * self.B) * self.i_w * self.one * self.i_k * self.i_k

    def frame(
        self, spin_1: Moves, spin_2: Moves, tilted: Sequence[Moves] = ({}, {}), shift: Moves | None = None
    ) -> list:
        """Return what moves with a, h, A, B and both spins; what else than the tilt moves with A and B."""
        by_A, by_B = tilted
        return [{self.a: ONE}, {self.h: ONE, **(shift or {})}, {self.by_A: ONE, **by_A}, {self.by_B: ONE, **by_B},
                spin_1, spin_2]  # fmt: skip

    def turned(self, row: Sequence[Value]) -> list[Value]:
        """Return derivatives by the six pose numbers from those in the frame of the normal."""
        by_a, by_h, by_A, by_B, *spins = row
        return [by_a, by_h, by_A * self.sa + by_B * self.ca, by_A * self.ca - by_B * self.sa, *spins]

    def involute(self, s: Value, rb: Value, spins: Moves) -> Value:
        """Return h of an involute, or of two that have one sum of lengths of roll."""
        E_A, E_B = self.turn()
        i_w2 = self.i_w * self.i_w
        s_w = s * self.i_w
        given(s_w, {
            self.alpha: rb * self.i_k * self.i_k, **{spin: base * self.i_w for spin, base in spins.items()},
            self.by_A: rb * E_A * self.i_w + s_w * self.A * i_w2, self.by_B: rb * E_B * self.i_w + s_w * self.B * i_w2,
        })  # fmt: skip
        h, A, B = involute_support(self.kap, s_w), self.A, self.B
        slope, i_k2 = self.i_k * (A * B * s_w + rb), self.i_k * self.i_k
        # what the chain rule does not find: kappa / kappa^2 = 1 / kappa, and w^2 = 1 - A^2 - B^2
        still = (self.by_A, self.by_B, *spins)
        given(slope, {x: derivative(slope, x) for x in still}
              | {self.alpha: (B * B * (self.w * self.w * i_k2) - A * A) * self.i_k * s_w})  # fmt: skip
        return given(h, {x: derivative(h, x) for x in still} | {self.alpha: slope})

    def corner(self, eta: Value) -> Value:
        """Return h of a tip corner at the polar angle eta."""
        sin, cos, radius, rounding = inputs("se ce radius rounding")
        sn, cs = self.sa * cos + self.ca * sin, self.ca * cos - self.sa * sin
        given(sn, {self.alpha: cs, eta: cs})
        given(cs, {self.alpha: -sn, eta: -sn})
        self.across = self.A * cs - self.B * sn
        self.along = along = self.A * sn + self.B * cs
        given(self.across, {self.by_A: cs, self.by_B: -sn, eta: -along})
        given(along, {self.by_A: sn, self.by_B: cs, eta: self.across})
        self.radius = radius
        return corner_support(sn, self.A, along, self.m, self.kap, self.i_w, radius, rounding)

    def edge(self, Z: Value, eta: Value, spin: Value) -> tuple[Value, dict[Value, Value]]:
        """Return h of a helical tip edge, and how its polar angle moves with A, B, its spin and h.

        The edge turns by -k per length of its wheel's axis, ``w (eta - eta_0) + k (Z + r L) = 0``.
        """
        h = self.corner(eta)
        (k,) = inputs("k")
        behind = given(k * (Z + self.radius * self.along) * self.i_w, {eta: -ONE, spin: ONE})
        equation = k * (Z + self.radius * self.along) - self.w * behind
        by_eta = self.w + k * self.radius * self.across
        by = (self.by_A, self.by_B, spin, self.h)
        return h + Z * self.A * self.i_w, {x: -(derivative(equation, x) / by_eta) for x in by}

    def screw(self) -> None:
        """Add what the tilt and the size of the helix fix."""
        self.t, self.c = t, c = inputs("t c")
        A, B, w, alpha, by_A, by_B = self.A, self.B, self.w, self.alpha, self.by_A, self.by_B
        self.K = K = np.sqrt(1.0 - c * (B * B))
        self.i_K = i_K = 1.0 / K
        self.R = R = B * i_K
        i_K3 = i_K * i_K * i_K
        given(K, {by_B: -c * R, alpha: A * c * R})
        given(i_K, {by_B: c * B * i_K3, alpha: -c * A * B * i_K3})
        given(R, {by_B: i_K3, alpha: -A * i_K3})
        self.inverse = inverse = 1.0 / (1.0 - c * (A * A + B * B))
        given(inverse, {by_A: 2.0 * c * A * inverse * inverse, by_B: 2.0 * c * B * inverse * inverse})
        self.wK, self.tA, self.cwA, self.tK = w * K, t * A, c * w * A, t * K

    def helicoid(self, sign: float, s: Value, Z: Value, rb: Value, spin: Value) -> Value:
        """Return h of an involute helicoid whose helix is t, or -t for ``sign`` -1."""
        A, B, w, i_w, c, K, R = self.A, self.B, self.w, self.i_w, self.c, self.K, self.R
        t, tA, tK = (sign * x for x in (self.t, self.tA, self.tK))
        U, V = self.wK - tA, self.cwA - tK
        E_A, E_B = self.turn()
        given(U, {self.alpha: V * R, self.by_A: -(A * K * i_w + t), self.by_B: -(c * w * R + B * K * i_w)})
        given(V, {self.alpha: c * U * R, self.by_A: c * (w - A * A * i_w), self.by_B: c * (t * R - A * B * i_w)})
        given(s, {self.alpha: rb * self.i_K / (U * self.inverse), spin: rb, self.by_A: rb * E_A,
                  self.by_B: rb * (E_B - t * self.i_K * self.i_k * self.i_k)})  # fmt: skip
        return helicoid_support(U, V, s, Z, self.inverse)

    def roll(self, sign: float, h: Value, s: Value, Z: Value) -> Value:
        """Return the length of roll in the wheel's own transverse plane where the section's profile has this normal."""
        return s - sign * self.t * (self.A * h + self.B * derivative(h, self.alpha) + self.w * Z)


def gap_kernels(
    name: str, arguments: str, what: str, x: Section, gap: Value, frame: list, rolls: Sequence[Value] = (), own=None
) -> list[Function]:
    """Return the kernels of a gap: of its normal, of its gradient, and of its second derivatives.

    Parameters
    ----------
    name, arguments, what : str
    x : Section
    gap : Value
        Its size at a normal that need not be that of the contact.
    frame : list
        What moves with the pose, as of `Section.frame`.
    rolls : sequence of Value
        Lengths of roll, returned with the gap.
    own : Value, optional
        Positive where the first of both spins is wheel 1's; the frame's last two rows are exchanged where it is not.
    """
    still = derivative(gap, x.alpha)
    bend = derivative(still, x.alpha)
    first = [tangent(gap, moves) for moves in frame]
    mixed = x.turned([tangent(still, moves) for moves in frame])
    turns = [-(one / bend) for one in mixed]
    half = {(i, k): tangent(first[i], frame[k]) for i in range(6) for k in range(i, 6)}
    rows = [x.turned([half[min(i, k), max(i, k)] for k in range(6)]) for i in range(6)]
    second = list(zip(*[x.turned(column) for column in zip(*rows)]))
    bent = [[second[i][k] + mixed[i] * turns[k] for k in range(6)] for i in range(6)]
    grad = column("grad", placed(own, x.turned(first)))
    bends = column("alpha_x", placed(own, turns)) | upper("hess", placed_rows(own, bent))
    said = "gap and lengths of roll" if rolls else "gap"
    return [
        Function(f"{name}_normal", told(arguments), f"Return g_alpha, g_alphaalpha and g_alphazeta of {what}.",
                 [still, bend, derivative(still, x.zeta)]),
        Function(f"{name}_gap", told(f"{arguments} grad j"), f"Return the {said} of {what}; write its gradient.",
                 [gap, *rolls], sets=grad),
        Function(f"{name}_bend", told(f"{arguments} alpha_x hess j"), f"Write turn and Hessian of {what}.",
                 sets=bends),
    ]  # fmt: skip


def told(arguments: str) -> str:
    """Return the arguments of a kernel, the tilt behind them."""
    return ", ".join(f"{arguments} {TILT}".split())


def placed(own: Value | None, row: Sequence[Value]) -> list[Value]:
    """Return derivatives by a, h, p, q and both spins, of which the first is wheel 1's where ``own`` is positive."""
    if own is None:
        return list(row)
    return [*row[:4], choose(own, 0.0, row[4], row[5]), choose(own, 0.0, row[5], row[4])]


def placed_rows(own: Value | None, matrix: Sequence[Sequence[Value]]) -> list[list[Value]]:
    """Return rows and columns of second derivatives likewise."""
    columns = [placed(own, row) for row in matrix]
    return [list(row) for row in zip(*[placed(own, row) for row in zip(*columns)])]


def upper(array: str, rows: Sequence[Sequence[Value]]) -> dict[str, Value]:
    return {f"{array}[{i}, {k}, j]": rows[i][k] for i in range(6) for k in range(i, 6)}


def column(array: str, values: Sequence[Value]) -> dict[str, Value]:
    return {f"{array}[{k}, j]": value for k, value in enumerate(values)}


def point_kernels(name: str, arguments: str, what: str, x: Section, place: Value, frame: list) -> list[Function]:
    """Return the kernels of where a contact stands: half the gap off wheel 1's profile, along normal and tangent.

    ``place`` is the profile's distance along the normal from the centre of wheel 1; along the tangent stands its slope.
    """
    (gap,) = inputs("gap")
    turns, grad = (
        [inputs(f"{n}_{k}", array, f"{k}, j")[0] for k in range(6)] for n, array in (("e", "alpha_x"), ("g", "grad"))
    )
    slope, bend = derivative(place, x.alpha), derivative(derivative(place, x.alpha), x.alpha)
    normal = x.turned([tangent(place, moves) for moves in frame])
    across = x.turned([tangent(slope, moves) for moves in frame])
    normal_x = [0.5 * g + slope * e + one for g, e, one in zip(grad, turns, normal)]
    tangent_x = [bend * e + one for e, one in zip(turns, across)]
    numbers = told(f"{arguments} alpha_x grad normal_x tangent_x j")
    return [
        Function(f"{name}_point", told(f"gap {arguments}"), f"Return where {what} bears along normal and tangent.",
                 [place + 0.5 * gap, slope]),
        Function(f"{name}_point_slopes", numbers, f"Write how that moves of {what}.",
                 sets=column("normal_x", normal_x) | column("tangent_x", tangent_x)),
    ]  # fmt: skip


FLANK = "a zeta sa ca s"
CORNER = "se ce radius rounding"


def spur() -> list[Function]:
    """Return the kernels of spur wheels: two involutes, a tip corner on an involute, and where these bear."""
    x = Section()
    s, rb1, rb2 = inputs("s rb1 rb2")
    gap = gap_of(x.a, x.sa, x.A, x.i_w, x.zeta, x.involute(s, rb1 + rb2, {x.F1: rb1, x.F2: rb2}))
    flanks = gap_kernels("flanks", f"{FLANK} rb1 rb2", "two involutes", x, gap, x.frame({x.F1: ONE}, {x.F2: ONE}))
    x = Section()
    s, rb, own, eta = inputs("s rb own _eta")
    both = x.corner(eta) + x.involute(s, rb, {x.F2: rb})
    gap, frame = gap_of(x.a, x.sa, x.A, x.i_w, x.zeta, both), x.frame({eta: ONE}, {x.F2: ONE})
    corners = gap_kernels("corner", f"{FLANK} rb {CORNER} own", "a tip corner on an involute", x, gap, frame, own=own)
    x = Section()
    s, rb = inputs("s rb")
    place = x.involute(s, rb, {x.F1: rb}) + x.A * x.i_w * (x.zeta + 0.5 * x.h)
    points = point_kernels("involute", "zeta h sa ca s rb", "an involute", x, place, x.frame({x.F1: ONE}, {}))
    x = Section()
    (eta,) = inputs("_eta")
    place = x.corner(eta) + x.A * x.i_w * (x.zeta + 0.5 * x.h)
    frame = x.frame({eta: ONE}, {})
    return [
        *flanks,
        *corners,
        *points,
        *point_kernels("corner", f"zeta h sa ca {CORNER}", "a tip corner", x, place, frame),
    ]


HELICOID = "a zeta h sa ca t c"


def helical() -> list[Function]:
    """Return the kernels of helical wheels: two helicoids, a tip edge on a helicoid, and where these bear."""
    x = Section()
    x.screw()
    s1, s2, rb1, rb2 = inputs("s1 s2 rb1 rb2")
    Z1, Z2 = x.zeta + 0.5 * x.h, x.zeta - 0.5 * x.h
    h1, h2 = x.helicoid(1.0, s1, Z1, rb1, x.F1), x.helicoid(-1.0, s2, Z2, rb2, x.F2)
    flanks = gap_kernels(
        "helicoids", f"{HELICOID} s1 s2 rb1 rb2", "two helicoids", x, x.a * x.sa - h1 - h2,
        x.frame({x.F1: ONE}, {x.F2: ONE}), [x.roll(1.0, h1, s1, Z1), x.roll(-1.0, h2, s2, Z2)],
    )  # fmt: skip
    x = Section()
    x.screw()
    s, rb, own, eta = inputs("s rb own _eta")
    # wheel 1's middle stands half of h before the origin of zeta, wheel 2's half behind it
    Z, Z_mate = x.zeta + own * (0.5 * x.h), x.zeta - own * (0.5 * x.h)
    mate = x.helicoid(1.0, s, Z_mate, rb, x.F2)
    edge, moves = x.edge(Z, eta, x.F1)
    frame = edge_frame(x, eta, moves, {x.F2: ONE})
    edges = gap_kernels(
        "edge", f"{HELICOID} s rb {CORNER} k own", "a tip edge on a helicoid", x, x.a * x.sa - edge - mate, frame,
        [x.roll(1.0, mate, s, Z_mate)], own,
    )  # fmt: skip
    x = Section()
    x.screw()
    s, rb = inputs("s rb")
    place = x.helicoid(1.0, s, x.zeta + 0.5 * x.h, rb, x.F1)
    points = point_kernels("helicoid", "zeta h sa ca t c s rb", "a helicoid", x, place, x.frame({x.F1: ONE}, {}))
    x = Section()
    (eta,) = inputs("_eta")
    place, moves = x.edge(x.zeta + 0.5 * x.h, eta, x.F1)
    frame = edge_frame(x, eta, moves, {})
    return [*flanks, *edges, *points, *point_kernels("edge", f"zeta h sa ca {CORNER} k", "a tip edge", x, place, frame)]


def edge_frame(x: Section, eta: Value, moves: Moves, mate: Moves) -> list:
    """Return the frame of a helical tip edge, whose polar angle moves with its wheel's pose."""
    by_A, by_B, spin, h = ({eta: moves[one]} for one in (x.by_A, x.by_B, x.F1, x.h))
    return x.frame({x.F1: ONE, **spin}, mate, (by_A, by_B), h)


def line_distance(a, p, q, vx, vy, m, i_w, zeta):
    """Return the distance in space of two lines, each parallel to one wheel's axis.

    A plane across one wheel's axis leans against the section by (p, q): the difference v of the lines' places in their
    wheels' own planes is stretched along the tilt, and both axes part by 2 zeta (p, q) / w. Of an offset in the section
    the part along the axes is no distance.
    """
    along = (p * vx + q * vy) * m - 2.0 * (zeta * i_w)
    dx, dy = a + vx + p * along, vy + q * along
    lean = p * dx + q * dy
    return np.sqrt(dx * dx + dy * dy - lean * lean)


def lines() -> list[Function]:
    """Return the kernels of a tip line and a root line: v turns with both wheels, t and c are its slopes."""
    a, p, q, zeta, vx, vy, tx, ty, cx, cy = inputs("a p q zeta vx vy tx ty cx cy")
    i_w, m, m_w, m_ww, sign, offset, own, tip, root = inputs("i_w m m_w m_ww sign offset own _tip _root")
    given(vx, {tip: tx, root: cx})
    given(vy, {tip: ty, root: cy})
    # a place on a circle turned by its angle: the second derivative is the first, turned by a right angle
    for x, y, angle in ((tx, ty, tip), (cx, cy, root)):
        given(x, {angle: -y})
        given(y, {angle: x})
    for value, slope in ((i_w, i_w * i_w), (m, -m_w), (m_w, -m_ww)):
        given(value, {p: slope * p * i_w, q: slope * q * i_w})
    gap = sign * (line_distance(a, p, q, vx, vy, m, i_w, zeta) - offset)
    (h,) = inputs("_h")
    pose = (a, h, p, q, tip, root)
    first = [derivative(gap, x) for x in pose]
    second = [[derivative(one, x) for x in pose] for one in first]
    numbers = "a, p, q, zeta, vx, vy, tx, ty, cx, cy, i_w, m, m_w, m_ww, sign, offset, own"
    return [
        Function("line_gap", f"{numbers}, grad, j", "Return the gap of a tip line and a root line; write its gradient.",
                 [gap], sets=column("grad", placed(own, first))),
        Function("line_bend", f"{numbers}, hess, j", "Write the Hessian of the gap of a tip line and a root line.",
                 sets=upper("hess", placed_rows(own, second))),
    ]  # fmt: skip


def functions() -> list[Function]:
    return [*spur(), *helical(), *lines()]
