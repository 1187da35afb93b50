"""Statements of a deck as typed records: flexible bodies."""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from gearmbs.adams.parse.grammar import EXPRESSION, ID, IDS, INT, PATH, REAL, REALS, TEXT, WORDS, arg
from gearmbs.adams.parse.statement import Statement, Vector

NODES = 100_000
"""More than an FE_PART has nodes: the number of a node is that of its part times this, and its own."""


@dataclass(frozen=True)
class FlexBody(Statement, keyword="FLEX_BODY"):
    """FLEX_BODY: a body with modes, from a modal neutral file."""

    mnf_file: str | None = arg("MNF_FILE", PATH)
    db_file: str | None = arg("DB_FILE", PATH)
    bdf_file: str | None = arg("BDF_FILE", PATH)
    index_in_database: int | None = arg("INDEX_IN_DATABASE", INT)
    matrices: tuple[int, ...] = arg("MATRICES", IDS, (), count=(1, 100))
    qg: Vector = arg("QG", REALS, (0.0, 0.0, 0.0), count=3, dimension="length")
    reuler: Vector | None = arg("REULER", REALS, count=3, dimension="angle")
    zg: Vector | None = arg("ZG", REALS, count=3, dimension="length")
    xg: Vector | None = arg("XG", REALS, count=3, dimension="length")
    vx: float = arg("VX", REAL, 0.0, dimension="velocity")
    vy: float = arg("VY", REAL, 0.0, dimension="velocity")
    vz: float = arg("VZ", REAL, 0.0, dimension="velocity")
    wx: float = arg("WX", REAL, 0.0, dimension="angular_velocity")
    wy: float = arg("WY", REAL, 0.0, dimension="angular_velocity")
    wz: float = arg("WZ", REAL, 0.0, dimension="angular_velocity")
    vm: int | None = arg("VM", ID)
    wm: int | None = arg("WM", ID)
    exact: tuple[str, ...] = arg("EXACT", WORDS, (), choices="X Y Z PSI THETA PHI")
    invariants: tuple[str, ...] = arg("INVARIANTS", WORDS, (), choices="TRUE FALSE")
    dmode: Vector = arg("DMODE", REALS, (), count=(1, 10000))
    vmode: Vector = arg("VMODE", REALS, (), count=(1, 10000))
    char_len: float | None = arg("CHAR_LEN", REAL, dimension="length")
    cratio: str | None = arg("CRATIO", EXPRESSION)


@dataclass(frozen=True)
class Material(Statement):
    """MATERIAL of an FE_PART."""

    label_name: str | None = arg("NAME", TEXT)
    density: float | None = arg("DENSITY", REAL)
    youngs_modulus: float | None = arg("YOUNGS_MODULUS", REAL)
    poissons_ratio: float | None = arg("POISSONS_RATIO", REAL)


@dataclass(frozen=True)
class FePart(Statement, keyword="FE_PART"):
    """FE_PART: a beam of large motion through nodes."""

    type: str | None = arg("TYPE", TEXT)
    qg: Vector = arg("QG", REALS, (0.0, 0.0, 0.0), count=3, dimension="length")
    reuler: Vector | None = arg("REULER", REALS, count=3, dimension="angle")
    node_labels: tuple[int, ...] = arg("NODE_LABELS", IDS, (), count=(1, 1000))
    coordinates: Vector = arg("COORDINATES", REALS, (), count=(1, 7000), dimension="angle")
    section: Vector = arg("SECTION", REALS, (), count=(1, 6000))
    material: int | None = arg("MATERIAL", ID)
    cratiok: float = arg("CRATIOK", REAL, 0.0, dimension="time")
    cratiom: float = arg("CRATIOM", REAL, 0.0)
    preload: str | None = arg("PRELOAD", TEXT)

    zg: ClassVar[None] = None
    xg: ClassVar[None] = None


@dataclass(frozen=True)
class FeNode(Statement, keyword="FE_NODE"):
    """A node of an FE_PART that has been built; the FE_NODE statements of a deck repeat what its FE_PART says."""

    part: str = ""

    def label(self) -> str:
        """Return the part and the number of the node."""
        return f"{self.part}, node {self.id % NODES}"


@dataclass(frozen=True)
class FeLoad(Statement, keyword="FE_LOAD"):
    """FE_LOAD: force and torque a length on an FE_PART."""

    fe_part: int | None = arg("FE_PART", ID)
    rm: int | None = arg("RM", ID)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)
    fx: str | None = arg("FX", EXPRESSION)
    fy: str | None = arg("FY", EXPRESSION)
    fz: str | None = arg("FZ", EXPRESSION)
    tx: str | None = arg("TX", EXPRESSION)
    ty: str | None = arg("TY", EXPRESSION)
    tz: str | None = arg("TZ", EXPRESSION)


@dataclass(frozen=True)
class Mforce(Statement):
    """MFORCE: a distribution of forces on a FLEX_BODY."""

    flex_body: int | None = arg("FLEX_BODY", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    case_index: int | None = arg("CASE_INDEX", INT)
    scale: str | None = arg("SCALE", EXPRESSION)
    force: str | None = arg("FORCE", EXPRESSION)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)
    shares: tuple[str, ...] = field(default=(), kw_only=True)
