"""Statements of a deck as typed records: linear systems of a control loop."""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from gearmbs.adams.parse.grammar import EXPRESSION, FLAG, ID, INT, REAL, REALS, TEXT, WORD, arg
from gearmbs.adams.parse.statement import Statement, Vector


@dataclass(frozen=True)
class _System(Statement):
    """States, inputs and outputs, each an ARRAY."""

    x: int | None = arg("X", ID)
    u: int | None = arg("U", ID)
    y: int | None = arg("Y", ID)
    static_hold: bool = arg("STATIC_HOLD", FLAG, False)


@dataclass(frozen=True)
class Lse(_System):
    """LSE: x' = A x + B u, y = C x + D u."""

    a: int | None = arg("A", ID)
    b: int | None = arg("B", ID)
    c: int | None = arg("C", ID)
    d: int | None = arg("D", ID)
    ic: int | None = arg("IC", ID)


@dataclass(frozen=True)
class Tfsiso(_System):
    """TFSISO: y(s)/u(s) = (b0 + b1 s + ...)/(a0 + a1 s + ...)."""

    numerator: Vector = arg("NUMERATOR", REALS, (), count=(1, 30))
    denominator: Vector = arg("DENOMINATOR", REALS, (), count=(1, 30))


@dataclass(frozen=True)
class Gse(_System):
    """GSE: x' = f(t, x, xd, u), y = g(t, x, xd, u) and at samples xd_next = h(t, x, xd, u), by routines of the user.

    With IMPLICIT the first is 0 = f(t, x, xd, u, x').

    Attributes
    ----------
    callers : mapping
        Of the parts "deriv", "output" and "update", once they are bound.
    held : tuple of float
        Discrete states as they are.
    rated : tuple of bool
        Of each continuous state of implicit equations, whether they depend on its rate.
    """

    ns: int = arg("NS", INT, 0)
    nd: int = arg("ND", INT, 0)
    no: int = arg("NO", INT, 0)
    xd: int | None = arg("XD", ID)
    ic: int | None = arg("IC", ID)
    icd: int | None = arg("ICD", ID)
    sample_period: str | None = arg("SAMPLE_PERIOD", EXPRESSION)
    sample_offset: float = arg("SAMPLE_OFFSET", REAL, 0.0, dimension="time")
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)
    interface: str | None = arg("INTERFACE", TEXT)
    implicit: bool = arg("IMPLICIT", FLAG, False)
    xxflag: str | None = arg("XXFLAG", WORD)
    xuflag: str | None = arg("XUFLAG", WORD)
    yxflag: str | None = arg("YXFLAG", WORD)
    yuflag: str | None = arg("YUFLAG", WORD)
    callers: Any = field(default=None, kw_only=True, compare=False)
    held: Vector = field(default=(), kw_only=True)
    rated: tuple[bool, ...] = field(default=(), kw_only=True)
