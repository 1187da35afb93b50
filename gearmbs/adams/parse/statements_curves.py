"""Statements of a deck as typed records: matrices, curves and what moves along them."""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass, field

from gearmbs.adams.parse.grammar import CHOICE, FLAG, ID, INT, REAL, REALS, TEXT, WORD, arg
from gearmbs.adams.parse.statement import Statement, Vector


@dataclass(frozen=True)
class Matrix(Statement):
    """MATRIX of numbers."""

    full: str | None = arg("FULL", WORD, choices="RORDER CORDER")
    sparse: bool = arg("SPARSE", FLAG, False)
    rows: int | None = arg("ROWS", INT)
    columns: int | None = arg("COLUMNS", INT)
    values: Vector = arg("VALUES", REALS, (), count=(1, 1000000))
    data_file: str | None = arg("FILE", TEXT)
    matrix_name: str | None = arg("NAME", TEXT)


@dataclass(frozen=True)
class CurveStatement(Statement, keyword="CURVE"):
    """CURVE through, or by, the points of a MATRIX."""

    ends: str | None = arg("ends", CHOICE, choices="CLOSED OPEN")
    points: str | None = arg("points", CHOICE, choices="CURVE_POINTS CONTROL_POINTS")
    order: int = arg("ORDER", INT, 4)
    matrix: int | None = arg("MATRIX", ID)
    function: str | None = arg("FUNCTION", TEXT)
    routine: str | None = arg("ROUTINE", TEXT)
    sampled: tuple[Vector, ...] = field(default=(), kw_only=True)
    minpar: float | None = arg("MINPAR", REAL)
    maxpar: float | None = arg("MAXPAR", REAL)


@dataclass(frozen=True)
class Ptcv(Statement):
    """PTCV: a point stays on a curve."""

    i: int | None = arg("I", ID)
    curve: int | None = arg("CURVE", ID)
    rm: int | None = arg("RM", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    disp: Vector | None = arg("DISP", REALS, count=3, dimension="length")
    vel: float | None = arg("VEL", REAL, dimension="velocity")
    icm: int | None = arg("ICM", ID)


@dataclass(frozen=True)
class Cvcv(Statement):
    """CVCV: two plane curves stay in touch."""

    icurve: int | None = arg("ICURVE", ID)
    jcurve: int | None = arg("JCURVE", ID)
    irm: int | None = arg("IRM", ID)
    jrm: int | None = arg("JRM", ID)
    ifloat: int | None = arg("IFLOAT", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    idisp: Vector | None = arg("IDISP", REALS, count=3, dimension="length")
    jdisp: Vector | None = arg("JDISP", REALS, count=3, dimension="length")
    ivel: float | None = arg("IVEL", REAL, dimension="velocity")
    jvel: float | None = arg("JVEL", REAL, dimension="velocity")
    iicm: int | None = arg("IICM", ID)
    jicm: int | None = arg("JICM", ID)
