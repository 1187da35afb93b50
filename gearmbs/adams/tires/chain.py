"""Function expressions in steps: what is used more than once becomes a VARIABLE, states become DIFFs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gearmbs.adams.write.text import number


def n(value: float) -> str:
    """Return a number as a factor of an expression."""
    text = number(value)
    return f"({text})" if text.startswith("-") else text


def linear(first: float, *more: tuple[float, str]) -> str:
    """Return a sum of a constant and of factors times expressions, without what is zero."""
    terms = [n(first)] if first or not any(k for k, _ in more) else []
    return "(" + " + ".join(terms + [f"{n(k)}*{x}" for k, x in more if k]) + ")"


def magic(b: str, x: str, e: str, c: float, wave: str = "SIN") -> str:
    """Return sin or cos of C atan(B x - E (B x - atan B x)), the Magic Formula without its peak."""
    y = f"{b}*{x}"
    return f"{wave}({n(c)}*ATAN({y} - {e}*({y} - ATAN({y}))))"


def sign(x: str) -> str:
    """Return the sign of an expression, 0 of 0."""
    return f"IF({x}: -1, 0, 1)"


def root(x: str) -> str:
    """Return the square root of an expression."""
    return f"SQRT({x})"


def within(x: str, low: float, high: float) -> str:
    """Return an expression kept between two bounds."""
    return f"MAX({n(low)}, MIN({n(high)}, {x}))"


@dataclass(frozen=True)
class Contact:
    """What a tire's formulas are given, in SI: expressions.

    Attributes
    ----------
    variable : callable
        Makes a VARIABLE of a name and a function; returns how expressions call it.
    state, rate : callable
        The first makes a DIFF of a name and returns how expressions call it, the second says what its rate is.
    vx : str
        Speed of the wheel's centre along the road.
    vsy : str
        Speed of the point of contact across it.
    spin : str
        Rotation about the axle, positive when rolling forwards.
    gamma, loaded, deflection, fz : str
        Inclination, loaded radius, R0 minus it, load.
    """

    variable: Callable[[str, str], str]
    state: Callable[[str], str]
    rate: Callable[[str, str], None]
    vx: str
    vsy: str
    spin: str
    gamma: str
    loaded: str
    deflection: str
    fz: str

    def heading(self, low: float) -> str:
        """Return 1 of a tire that rolls forwards and -1 backwards, where the trail is ahead; between at low speeds."""
        return within(f"{self.vx}*{n(1.0 / low)}", -1.0, 1.0)


@dataclass(frozen=True)
class Wrench:
    """Forces and moments at the point of contact: along the wheel, across it, and about these and the normal."""

    fx: str
    fy: str
    mx: str
    my: str
    mz: str
