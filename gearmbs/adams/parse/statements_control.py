"""Statements of a deck as typed records: linear systems of a control loop."""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.adams.parse.grammar import FLAG, ID, REALS, arg
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
