"""Support functions of tooth profiles in a tilted section, stated once: `gearmbs.kernels.derive` makes ``derived.py``.

An involute has ``h = (kappa / w) s``, ``s = r_b (phi + psi + alpha + E)``, an involute helicoid
``h = (U s + V Z) / Omega``, and a tip corner ``h = r (sin(alpha + eta) + m A V) + rho kappa / w`` with
``m = 1 / (w (1 + w))``, ``V = A sin(alpha + eta) + B cos(alpha + eta)``; letters as in `profiles`. Derivatives are by
alpha, by the tilt (A, B) along and across a normal at rest, by the spin F and the place Z. What is handed in says how
it moves: as alpha grows the normal turns in the tilt, ``dA = B dalpha``, ``dB = -A dalpha``, and what hangs on the
tilt alone, such as w, Omega and the V of a corner, stands still.
"""

from __future__ import annotations

from collections.abc import Sequence

from gearmbs.kernels.derive import ONE, Function, Value, derivative, given, inputs, slopes

COMPILED = 'error_model="numpy", fastmath={"contract": True, "arcp": True}'
"""As all kernels of contact, see `gearmbs.contact.records`."""
TILT = "w i_w one m m_w m_ww"


def involute_support(kap, i_w, s):
    """Return h of an involute."""
    return kap * i_w * s


def helicoid_support(U, V, s, Z, inverse):
    """Return h of an involute helicoid."""
    return (U * s + V * Z) * inverse


def corner_support(sn, A, V, m, kap, i_w, radius, rounding):
    """Return h of a tip corner."""
    return radius * (sn + m * A * V) + rounding * kap * i_w


class Section:
    """The tilt in a section with what follows from it."""

    def __init__(self) -> None:
        self.by = alpha, by_A, by_B, _ = inputs("_alpha _A _B _F")
        self.A, self.B, self.kap = A, B, kap = inputs("A B kap")
        self.w, self.i_w, self.one, self.m, m_w, m_ww = w, i_w, one, m, _, _ = inputs(TILT)
        given(A, {by_A: ONE, alpha: B})
        given(B, {by_B: ONE, alpha: -A})
        given(kap, {by_B: -B / kap, alpha: A * B / kap})
        for value, slope in ((w, -ONE), (i_w, i_w * i_w), (one, one * one), (m, -m_w), (m_w, -m_ww)):
            given(value, {by_A: slope * A * i_w, by_B: slope * B * i_w})

    def turn(self) -> tuple[Value, Value]:
        """Return the slopes of E by A and B."""
        by_A = self.B * self.i_w * self.one
        return by_A, self.A * (self.w + self.B * self.B) * self.i_w * self.one / self.kap / self.kap


def involute() -> list[Function]:
    x = Section()
    alpha, by_A, by_B, spin = x.by
    (s, rb), (E_A, E_B) = inputs("s rb"), x.turn()
    given(s, {alpha: rb * x.w / x.kap / x.kap, spin: rb, by_A: rb * E_A, by_B: rb * E_B})
    return kernels("involute", "A B kap s rb", involute_support(x.kap, x.i_w, s), x.by)


def helicoid() -> list[Function]:
    x = Section()
    alpha, by_A, by_B, spin = x.by
    c, K, R, U, V, inverse, s, place, rb, t = inputs("c K R U V inverse s Z rb t")
    (E_A, E_B), K_B, i_K = x.turn(), -c * R, 1.0 / K
    given(K, {by_B: K_B, alpha: x.A * c * R})
    given(R, {by_B: i_K * i_K * i_K, alpha: -x.A * i_K * i_K * i_K})
    given(U, {alpha: V * R, by_A: -(x.A * K * x.i_w + t), by_B: x.w * K_B - x.B * K * x.i_w})
    given(V, {alpha: c * U * R, by_A: c * (x.w - x.A * x.A * x.i_w), by_B: -(c * x.A * x.B * x.i_w + t * K_B)})
    given(inverse, {by_A: 2.0 * c * x.A * inverse * inverse, by_B: 2.0 * c * x.B * inverse * inverse})
    given(s, {alpha: rb * i_K / (U * inverse), spin: rb, by_A: rb * E_A, by_B: rb * (E_B - t * i_K / x.kap / x.kap)})
    h = helicoid_support(U, V, s, place, inverse)
    return kernels("helicoid", "A B kap c K R U V inverse s Z rb t", h, [*x.by, place])


def corner() -> list[Function]:
    x = Section()
    alpha, by_A, by_B, spin = x.by
    sn, cs, V, radius, rounding = inputs("sn cs V radius rounding")
    given(sn, {alpha: cs, spin: cs})
    given(cs, {alpha: -sn, spin: -sn})
    given(V, {by_A: sn, by_B: cs, spin: x.A * cs - x.B * sn})
    h = corner_support(sn, x.A, V, x.m, x.kap, x.i_w, radius, rounding)
    return kernels("corner", "A B kap sn cs V radius rounding", h, x.by)


def kernels(name: str, arguments: str, h: Value, by: Sequence[Value]) -> list[Function]:
    """Return the kernels of h with its slopes, and of its second derivatives row by row."""
    first = slopes(h, by)
    second = [derivative(row, x) for k, row in enumerate(first) for x in by[k:]]
    told = ", ".join(f"{arguments} {TILT}".split())
    return [
        Function(
            f"{name}_slopes", told, "Return h and its slopes by alpha, A, B, F and what else there is.", [h, *first]
        ),
        Function(f"{name}_curvatures", told, "Return the upper half of its second derivatives.", second),
    ]


def functions() -> list[Function]:
    return [*involute(), *helicoid(), *corner()]
