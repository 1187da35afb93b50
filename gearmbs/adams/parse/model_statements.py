"""What all statements of a deck have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from gearmbs.adams.parse.grammar import (
    CHOICE,
    EXPRESSION,
    FLAG,
    ID,
    IDS,
    INT,
    PATH,
    REAL,
    REALS,
    TEXT,
    WORD,
    WORDS,
    arg,
)

Vector = tuple[float, ...]


@dataclass(frozen=True)
class Statement:
    """What all statements have: id, place in the source, name.

    Attributes
    ----------
    id : int
        0 for statements without one.
    file : str
    line : int
    name : str or None
        From an ``adams_view_name`` comment.
    given : mapping of str to int
        Source line of every argument that was given.
    pair : str
        A gear pair in comments in front, see `gearmbs.adams.pairs`.
    """

    keyword: ClassVar[str] = ""
    """The statement's name in a deck; a class gives it where it is not the class's own, as in ``keyword="IC"``."""

    id: int = 0
    file: str = ""
    line: int = 0
    name: str | None = None
    given: dict[str, int] = field(default_factory=dict, compare=False)
    pair: str = ""

    def __init_subclass__(cls, keyword: str | None = None, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.keyword = keyword or cls.__name__.upper()

    def label(self) -> str:
        """Return the statement as a modeller names it, for instance JOINT/3."""
        return f"{self.keyword}/{self.id}" if self.id else self.keyword


# Statements of a deck as typed records: parts, markers and constraints.


# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009


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


# Statements of a deck as typed records: forces.


# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009


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


# Statements of a deck as typed records: contacts and the solids that touch.


# `arg` returns a dataclass field; the linter takes it for a default value


SOLIDS = "BOX CYLINDER ELLIPSOID EXTERNAL EXTRUSION FRUSTUM PLANE POINT REVOLUTION TORUS"
"""Solids that can touch."""


@dataclass(frozen=True)
class Graphics(Statement):
    """GRAPHICS: a solid, as far as a CONTACT names it."""

    type: str | None = arg("type", CHOICE, choices=SOLIDS)
    cm: int | None = arg("CM", ID)
    rm: int | None = arg("RM", ID)
    corner: int | None = arg("CORNER", ID)
    curve: int | None = arg("CID", ID, aliases="CURVE")
    length: float | None = arg("LENGTH", REAL)
    radius: float | None = arg("RADIUS", REAL)
    bottom: float | None = arg("BOTTOM", REAL)
    top: float | None = arg("TOP", REAL)
    major: float | None = arg("MAJOR_RADIUS", REAL)
    minor: float | None = arg("MINOR_RADIUS", REAL)
    x: float | None = arg("X", REAL, aliases="X")
    y: float | None = arg("Y", REAL, aliases="Y")
    z: float | None = arg("Z", REAL, aliases="Z")
    xscale: float | None = arg("XSCALE", REAL)
    yscale: float | None = arg("YSCALE", REAL)
    zscale: float | None = arg("ZSCALE", REAL)
    xmin: float | None = arg("XMIN", REAL)
    xmax: float | None = arg("XMAX", REAL)
    ymin: float | None = arg("YMIN", REAL)
    ymax: float | None = arg("YMAX", REAL)
    rangle: float | None = arg("RANGLE", REAL, dimension="angle")
    sides: int | None = arg("SIDES", INT)
    seg: int | None = arg("SEG", INT)
    data_file: str | None = arg("FILE", PATH)
    element: str | None = arg("ELEMENT", TEXT)
    faceting: float | None = arg("FACETING_TOLERANCE", REAL)

    @property
    def marker(self) -> int | None:
        """The marker whose frame holds the solid."""
        return next((ref for ref in (self.cm, self.corner, self.rm) if ref is not None), None)


@dataclass(frozen=True)
class Contact(Statement):
    """CONTACT: solids that touch and rub."""

    kind: str | None = arg("TYPE", WORD)
    igeom: tuple[int, ...] = arg("IGEOM", IDS, (), count=(1, 1000))
    jgeom: tuple[int, ...] = arg("JGEOM", IDS, (), count=(1, 1000))
    law: str | None = arg("law", CHOICE, choices="IMPACT POISSON")
    stiffness: float | None = arg("STIFFNESS", REAL)
    exponent: float = arg("EXPONENT", REAL, 1.0)
    damping: float = arg("DAMPING", REAL, 0.0, dimension="damping")
    dmax: float | None = arg("DMAX", REAL, dimension="length")
    penalty: float | None = arg("PENALTY", REAL, dimension="stiffness")
    restitution: float | None = arg("RESTITUTION_COEFFICIENT", REAL)
    augmented: bool = arg("AUGMENTED_LAGRANGIAN_FORMULATION", FLAG, False)
    coulomb: str = arg("COULOMB_FRICTION", WORD, "OFF", choices="ON OFF DYNAMICS_ONLY DYNAMICSONLY")
    no_friction: bool = arg("NO_FRICTION", FLAG, False)
    mu_static: float = arg("MU_STATIC", REAL, 0.0)
    mu_dynamic: float = arg("MU_DYNAMIC", REAL, 0.0)
    stiction: float | None = arg("STICTION_TRANSITION_VELOCITY", REAL, dimension="velocity")
    transition: float | None = arg("FRICTION_TRANSITION_VELOCITY", REAL, dimension="velocity")
    stiction_law: str | None = arg("STICTION", WORD, choices="ON OFF")
    max_deformation: float | None = arg("MAX_STICTION_DEFORMATION", REAL, dimension="length")
    normal_function: str | None = arg("NORMAL_FUNCTION", TEXT)
    friction_function: str | None = arg("FRICTION_FUNCTION", TEXT)
    iflex: int | None = arg("IFLEX", ID)
    jflex: int | None = arg("JFLEX", ID)
    flip_i: bool = arg("I_FLIP_NORMAL", FLAG, False)
    flip_j: bool = arg("J_FLIP_NORMAL", FLAG, False)


# Statements of a deck as typed records: matrices, curves and what moves along them.


# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009


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
