"""Statements of a deck as typed records: forces."""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass, field

from gearmbs.adams.parse.grammar import CHOICE, EXPRESSION, FLAG, ID, REAL, REALS, TEXT, WORD, WORDS, arg
from gearmbs.adams.parse.statement import Statement, Vector


@dataclass(frozen=True)
class Sforce(Statement):
    """SFORCE: a single-component force or torque."""

    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    type: str | None = arg("type", CHOICE, choices="TRANSLATIONAL ROTATIONAL")
    action_only: bool = arg("ACTIONONLY", FLAG, False)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)


@dataclass(frozen=True)
class _Acting(Statement):
    """Where a force of several components acts, and along which axes."""

    i: int | None = arg("I", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    rm: int | None = arg("RM", ID)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)


@dataclass(frozen=True)
class Vforce(_Acting):
    """VFORCE: three force components along the axes of RM."""

    fx: str | None = arg("FX", EXPRESSION)
    fy: str | None = arg("FY", EXPRESSION)
    fz: str | None = arg("FZ", EXPRESSION)


@dataclass(frozen=True)
class Vtorque(_Acting):
    """VTORQUE: three torque components along the axes of RM."""

    tx: str | None = arg("TX", EXPRESSION)
    ty: str | None = arg("TY", EXPRESSION)
    tz: str | None = arg("TZ", EXPRESSION)


@dataclass(frozen=True)
class Gforce(Vtorque, Vforce):
    """GFORCE: force and torque components along the axes of RM."""


@dataclass(frozen=True)
class SpringDamper(Statement):
    """SPRINGDAMPER: a linear spring and damper between two markers."""

    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    type: str | None = arg("type", CHOICE, choices="TRANSLATIONAL ROTATIONAL")
    k: float = arg("K", REAL, 0.0, dimension="stiffness")
    c: float = arg("C", REAL, 0.0, dimension="damping")
    length: float = arg("LENGTH", REAL, 0.0, dimension="length")
    force: float = arg("FORCE", REAL, 0.0, dimension="force")
    kt: float = arg("KT", REAL, 0.0, dimension="rotational_stiffness")
    ct: float = arg("CT", REAL, 0.0, dimension="rotational_damping")
    angle: float = arg("ANGLE", REAL, 0.0, dimension="angle")
    torque: float = arg("TORQUE", REAL, 0.0, dimension="torque")


@dataclass(frozen=True)
class Bushing(Statement):
    """BUSHING: linear springs and dampers along and about the axes of J."""

    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    k: Vector = arg("K", REALS, (0.0, 0.0, 0.0), count=3, dimension="stiffness")
    kt: Vector = arg("KT", REALS, (0.0, 0.0, 0.0), count=3, dimension="rotational_stiffness")
    c: Vector = arg("C", REALS, (0.0, 0.0, 0.0), count=3, dimension="damping")
    ct: Vector = arg("CT", REALS, (0.0, 0.0, 0.0), count=3, dimension="rotational_damping")
    force: Vector = arg("FORCE", REALS, (0.0, 0.0, 0.0), count=3, dimension="force")
    torque: Vector = arg("TORQUE", REALS, (0.0, 0.0, 0.0), count=3, dimension="torque")


@dataclass(frozen=True)
class Field(Statement):
    """FIELD: a full 6x6 stiffness and damping between two markers, matrices by columns."""

    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    kmatrix: Vector | None = arg("KMATRIX", REALS, count=36)
    cmatrix: Vector | None = arg("CMATRIX", REALS, count=36)
    cratio: float | None = arg("CRATIO", REAL)
    length: Vector | None = arg("LENGTH", REALS, count=6)
    force: Vector | None = arg("FORCE", REALS, count=6)
    function: str | None = arg("FUNCTION", TEXT)
    routine: str | None = arg("ROUTINE", TEXT)
    components: tuple[str, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True)
class Beam(Statement):
    """BEAM: a massless Timoshenko beam from J to I along x of J."""

    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    length: float | None = arg("LENGTH", REAL, dimension="length")
    ixx: float | None = arg("IXX", REAL)
    iyy: float | None = arg("IYY", REAL)
    izz: float | None = arg("IZZ", REAL)
    area: float | None = arg("AREA", REAL)
    asy: float = arg("ASY", REAL, 0.0)
    asz: float = arg("ASZ", REAL, 0.0)
    emodulus: float | None = arg("EMODULUS", REAL)
    gmodulus: float | None = arg("GMODULUS", REAL)
    cratio: float | None = arg("CRATIO", REAL)
    cmatrix: Vector | None = arg("CMATRIX", REALS, count=21)
    formulation: str = arg("FORMULATION", WORD, "LINEAR", choices="LINEAR STRING NONLINEAR")


@dataclass(frozen=True)
class Accgrav(Statement):
    """ACCGRAV: the acceleration of gravity."""

    igrav: float = arg("IGRAV", REAL, 0.0, dimension="acceleration")
    jgrav: float = arg("JGRAV", REAL, 0.0, dimension="acceleration")
    kgrav: float = arg("KGRAV", REAL, 0.0, dimension="acceleration")


@dataclass(frozen=True)
class Friction(Statement):
    """FRICTION: dry friction of a joint."""

    joint: int | None = arg("JOINT", ID)
    mu_static: float | None = arg("MU_STATIC", REAL)
    mu_dynamic: float | None = arg("MU_DYNAMIC", REAL)
    transition: float = arg("STICTION_TRANSITION_VELOCITY", REAL, 0.1, dimension="velocity")
    deformation: float = arg("MAX_STICTION_DEFORMATION", REAL, 0.01, dimension="length")
    effect: str = arg("EFFECT", WORD, "ALL", choices="ALL STICTION SLIDING")
    inputs: tuple[str, ...] = arg(
        "INPUTS", WORDS, (), choices="ALL NONE PRELOAD REACTION_FORCE BENDING_MOMENT TORSIONAL_MOMENT"
    )
    force_preload: float = arg("FRICTION_FORCE_PRELOAD", REAL, 0.0, dimension="force")
    torque_preload: float = arg("FRICTION_TORQUE_PRELOAD", REAL, 0.0, dimension="torque")
    friction_arm: float = arg("FRICTION_ARM", REAL, 1.0, dimension="length")
    bending_arm: float = arg("BENDING_REACTION_ARM", REAL, 1.0, dimension="length")
    pin_radius: float = arg("PIN_RADIUS", REAL, 1.0, dimension="length")
    reaction_arm: float = arg("REACTION_ARM", REAL, 1.0, dimension="length")
    ball_radius: float = arg("BALL_RADIUS", REAL, 1.0, dimension="length")
    overlap: float = arg("INITIAL_OVERLAP", REAL, 1000.0, dimension="length")
    overlap_delta: str = arg("OVERLAP_DELTA", WORD, "CONSTANT", choices="CONSTANT INCREASING DECREASING")
    yoke: str = arg("YOKE", WORD, "I_YOKE", choices="I_YOKE J_YOKE")
    inactive: str | None = arg("INACTIVE", WORD, aliases="INACTIVE_DURING")
    formulation: str | None = arg("FORMULATION", WORD, choices="ORIGINAL LUGRE")
    max_force: float | None = arg("MAX_FRICTION_FORCE", REAL, dimension="force")
    max_torque: float | None = arg("MAX_FRICTION_TORQUE", REAL, dimension="torque")
