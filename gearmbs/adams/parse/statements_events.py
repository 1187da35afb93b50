"""Statements of a deck as typed records: sensors, texts."""

# `arg` returns a dataclass field; the linter takes it for a default value

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.adams.parse.grammar import CHOICE, EXPRESSION, FLAG, REAL, TEXT, arg
from gearmbs.adams.parse.statement import Statement


@dataclass(frozen=True)
class Sensor(Statement):
    """SENSOR: what happens when an expression passes a value."""

    relation: str = arg("relation", CHOICE, "EQ", choices="EQ GE LE")
    value: float = arg("VALUE", REAL, 0.0)
    error: float = arg("ERROR", REAL, 1e-3)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)
    evaluate: str | None = arg("EVALUATE", EXPRESSION, aliases="EVAL")
    evaluate_routine: str | None = arg("EVALUATE_ROUTINE", TEXT)
    angular: bool = arg("ANGULAR", FLAG, False)
    bisection: bool = arg("BISECTION", FLAG, False)
    codgen: bool = arg("CODGEN", FLAG, False)
    dt: float | None = arg("DT", REAL, dimension="time")
    halt: bool = arg("HALT", FLAG, False)
    print_: bool = arg("PRINT", FLAG, False)
    restart: bool = arg("RESTART", FLAG, False)
    back: bool = arg("RETURN", FLAG, False)
    stepsize: float | None = arg("STEPSIZE", REAL, dimension="time")
    yydump: bool = arg("YYDUMP", FLAG, False)


@dataclass(frozen=True)
class String(Statement):
    """STRING: a text, which routines of a user may ask for."""

    text: str | None = arg("STRING", TEXT)
