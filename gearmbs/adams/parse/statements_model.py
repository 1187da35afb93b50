"""Statements of a deck as typed records: parts, markers and constraints."""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass, field

from gearmbs.adams.parse.grammar import CHOICE, EXPRESSION, FLAG, ID, IDS, REAL, REALS, TEXT, WORD, WORDS, arg
from gearmbs.adams.parse.statement import Statement, Vector


@dataclass(frozen=True)
class Units(Statement):
    """UNITS."""

    force: str | None = arg("FORCE", WORD)
    mass: str | None = arg("MASS", WORD)
    length: str | None = arg("LENGTH", WORD)
    time: str | None = arg("TIME", WORD)
    system: str | None = arg("SYSTEM", WORD, choices="CGS FPS IPS MKS NONE")
    ucf: float | None = arg("UCF", REAL)


@dataclass(frozen=True)
class Part(Statement):
    """PART: a rigid body."""

    ground: bool = arg("GROUND", FLAG, False)
    mass: float = arg("MASS", REAL, 0.0, dimension="mass")
    cm: int | None = arg("CM", ID)
    im: int | None = arg("IM", ID)
    ip: Vector | None = arg("IP", REALS, count=(3, 6), dimension="inertia")
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
    material: str | None = arg("MATERIAL", TEXT)
    planar: bool = arg("PLANAR", FLAG, False)


@dataclass(frozen=True)
class PointMass(Statement, keyword="POINT_MASS"):
    """POINT_MASS: a body that does not turn."""

    mass: float = arg("MASS", REAL, 0.0, dimension="mass")
    cm: int | None = arg("CM", ID)
    qg: Vector = arg("QG", REALS, (0.0, 0.0, 0.0), count=3, dimension="length")
    reuler: Vector | None = arg("REULER", REALS, count=3, dimension="angle")
    zg: Vector | None = arg("ZG", REALS, count=3, dimension="length")
    xg: Vector | None = arg("XG", REALS, count=3, dimension="length")
    vx: float = arg("VX", REAL, 0.0, dimension="velocity")
    vy: float = arg("VY", REAL, 0.0, dimension="velocity")
    vz: float = arg("VZ", REAL, 0.0, dimension="velocity")
    exact: tuple[str, ...] = arg("EXACT", WORDS, (), choices="X Y Z")


@dataclass(frozen=True)
class Marker(Statement):
    """MARKER: a frame on a part."""

    part: int | None = arg("PART", ID)
    qp: Vector = arg("QP", REALS, (0.0, 0.0, 0.0), count=3, dimension="length")
    reuler: Vector | None = arg("REULER", REALS, count=3, dimension="angle")
    zp: Vector | None = arg("ZP", REALS, count=3, dimension="length")
    xp: Vector | None = arg("XP", REALS, count=3, dimension="length")
    usexp: bool = arg("USEXP", FLAG, False)
    floating: bool = arg("FLOATING", FLAG, False)
    flex_body: int | None = arg("FLEX_BODY", ID)
    point_mass: int | None = arg("POINT_MASS", ID)
    node_id: int | None = arg("NODE_ID", ID, aliases="NODE")
    fe_part: int | None = arg("FE_PART", ID)
    node_label: int | None = arg("NODE_LABEL", ID)
    curve: int | None = arg("CURVE", ID)

    def owner(self) -> tuple[str, int | None]:
        """Return statement and id of the body it is on."""
        if self.flex_body is not None:
            return "FLEX_BODY", self.flex_body
        if self.fe_part is not None:
            return "FE_PART", self.fe_part
        return ("POINT_MASS", self.point_mass) if self.point_mass is not None else ("PART", self.part)


JOINT_TYPES = "CONVEL CYLINDRICAL FIXED HOOKE PLANAR RACKPIN REVOLUTE SCREW SPHERICAL TRANSLATIONAL UNIVERSAL"


@dataclass(frozen=True)
class Joint(Statement):
    """JOINT."""

    type: str | None = arg("type", CHOICE, choices=JOINT_TYPES)
    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    pitch: float | None = arg("PITCH", REAL, dimension="length")
    pd: float | None = arg("PD", REAL, dimension="length")
    ic: Vector | None = arg("IC", REALS, count=(1, 2))
    ictran: Vector | None = arg("ICTRAN", REALS, count=(1, 2))
    icrot: Vector | None = arg("ICROT", REALS, count=(1, 2))
    friction: str | None = arg("FRICTION", WORD, choices="ON OFF PRELOAD_ONLY")
    delta_v: float | None = arg("DELTA_V", REAL)
    max_deformation: float | None = arg("MAXIMUM_DEFORMATION", REAL)
    max_friction: float | None = arg("MAX_FRICTION", REAL)
    max_fric_rot: float | None = arg("MAX_FRIC_ROT", REAL)
    max_fric_trans: float | None = arg("MAX_FRIC_TRANS", REAL)
    mu_dyn_rot: float | None = arg("MU_DYN_ROT", REAL)
    mu_dyn_trans: float | None = arg("MU_DYN_TRANS", REAL)
    mu_stat_rot: float | None = arg("MU_STAT_ROT", REAL)
    mu_stat_trans: float | None = arg("MU_STAT_TRANS", REAL)
    preload_axial: float | None = arg("PRELOAD_AXIAL", REAL)
    preload_radial: float | None = arg("PRELOAD_RADIAL", REAL)
    preload_x: float | None = arg("PRELOAD_X", REAL)
    preload_y: float | None = arg("PRELOAD_Y", REAL)
    inner_radius: float | None = arg("INNER_RADIUS", REAL)
    outer_radius: float | None = arg("OUTER_RADIUS", REAL)
    pin_radius: float | None = arg("PIN_RADIUS", REAL)
    height: float | None = arg("HEIGHT", REAL)
    width: float | None = arg("WIDTH", REAL)


@dataclass(frozen=True)
class Jprim(Statement):
    """JPRIM: a joint primitive."""

    type: str | None = arg("type", CHOICE, choices="ATPOINT INLINE INPLANE ORIENTATION PARALLEL_AXES PERPENDICULAR")
    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)


@dataclass(frozen=True)
class Coupler(Statement):
    """COUPLER: r1 q1 + r2 q2 (+ r3 q3) = 0."""

    joints: tuple[int, ...] = arg("JOINTS", IDS, (), count=(2, 3))
    type: tuple[str, ...] = arg("TYPE", WORDS, (), choices="ROTATIONAL TRANSLATIONAL")
    scales: Vector = arg("SCALES", REALS, (), count=(1, 3))
    function: str | None = arg("FUNCTION", TEXT)
    routine: str | None = arg("ROUTINE", TEXT)
    expression: str | None = field(default=None, kw_only=True)


@dataclass(frozen=True)
class Gear(Statement):
    """GEAR: equal velocities at the common-velocity marker."""

    joints: tuple[int, ...] = arg("JOINTS", IDS, (), count=2)
    cv: int | None = arg("CV", ID)


@dataclass(frozen=True)
class Gcon(Statement):
    """GCON: a constraint given by an expression that must be zero."""

    i: int | None = arg("I", ID)
    function: str | None = arg("FUNCTION", EXPRESSION)


@dataclass(frozen=True)
class Motion(Statement):
    """MOTION of a joint, or of one component between two markers."""

    joint: int | None = arg("JOINT", ID)
    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    direction: str | None = arg("direction", CHOICE, choices="TRANSLATIONAL ROTATIONAL X Y Z B1 B2 B3")
    level: str | None = arg("level", CHOICE, choices="DISPLACEMENT VELOCITY ACCELERATION")
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)
    icdisp: float | None = arg("ICDISP", REAL)
    icvel: float | None = arg("ICVEL", REAL)
