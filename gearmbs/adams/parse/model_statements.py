"""Statements of a deck as typed records: bodies, markers, constraints, forces, contacts, curves."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

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
    Statement,
    arg,
)

if TYPE_CHECKING:
    from gearmbs.gears import GearPair

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

Vector = tuple[float, ...]

# why arguments that stand in several places have no effect
LITTLE = "the parts are moved as little as the joints allow"
WITHOUT_FRICTION = "a joint rubs by them only where it says FRICTION = ON; for friction write a FRICTION statement"
BY_DEPTH = "solids press by depth and rub by speed alone"
LIMITS = "they are limits of a PLANE"


@dataclass(frozen=True)
class Units(Statement, once=True, changeable=False):
    """UNITS."""

    force: str | None = arg("FORCE", WORD)
    mass: str | None = arg("MASS", WORD)
    length: str | None = arg("LENGTH", WORD)
    time: str | None = arg("TIME", WORD)
    system: str | None = arg("SYSTEM", WORD, choices="CGS FPS IPS MKS NONE")
    ucf: float | None = arg("UCF", REAL)


@dataclass(frozen=True)
class _Placed(Statement, read=False):
    """Where a body is, how its frame is turned, and how it moves, at the start."""

    qg: Vector = arg("QG", REALS, (0.0, 0.0, 0.0), count=3, dimension="length", start=True)
    reuler: Vector | None = arg("REULER", REALS, count=3, dimension="angle", start=True)
    zg: Vector | None = arg("ZG", REALS, count=3, dimension="length", start=True)
    xg: Vector | None = arg("XG", REALS, count=3, dimension="length", start=True)
    vx: float = arg("VX", REAL, 0.0, dimension="velocity", start=True)
    vy: float = arg("VY", REAL, 0.0, dimension="velocity", start=True)
    vz: float = arg("VZ", REAL, 0.0, dimension="velocity", start=True)


@dataclass(frozen=True)
class Turning(_Placed, read=False):
    """How a body turns at the start, too, and the markers along whose axes its velocities are given."""

    wx: float = arg("WX", REAL, 0.0, dimension="angular_velocity", start=True)
    wy: float = arg("WY", REAL, 0.0, dimension="angular_velocity", start=True)
    wz: float = arg("WZ", REAL, 0.0, dimension="angular_velocity", start=True)
    vm: int | None = arg("VM", ID, start=True)
    wm: int | None = arg("WM", ID, start=True)


@dataclass(frozen=True)
class Part(Turning):
    """PART: a rigid body."""

    ground: bool = arg("GROUND", FLAG, False)
    mass: float = arg("MASS", REAL, 0.0, dimension="mass")
    cm: int | None = arg("CM", ID)
    im: int | None = arg("IM", ID)
    ip: Vector | None = arg("IP", REALS, count=(3, 6), dimension="inertia")
    exact: tuple[str, ...] = arg("EXACT", WORDS, (), choices="X Y Z PSI THETA PHI", start=True, idle=LITTLE)
    material: str | None = arg("MATERIAL", TEXT)
    planar: bool = arg("PLANAR", FLAG, False)


@dataclass(frozen=True)
class PointMass(_Placed, keyword="POINT_MASS", switch="on"):
    """POINT_MASS: a body that does not turn."""

    mass: float = arg("MASS", REAL, 0.0, dimension="mass", positive=True)
    cm: int | None = arg("CM", ID)
    exact: tuple[str, ...] = arg("EXACT", WORDS, (), choices="X Y Z", start=True, idle=LITTLE)


@dataclass(frozen=True)
class Marker(Statement):
    """MARKER: a frame on a part."""

    part: int | None = arg("PART", ID, required=True)
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
    curve: int | None = arg("CURVE", ID, instead="")

    def owner(self) -> tuple[str, int | None]:
        """Return statement and id of the body it is on."""
        if self.flex_body is not None:
            return "FLEX_BODY", self.flex_body
        if self.fe_part is not None:
            return "FE_PART", self.fe_part
        return ("POINT_MASS", self.point_mass) if self.point_mass is not None else ("PART", self.part)


JOINT_TYPES = "CONVEL CYLINDRICAL FIXED HOOKE PLANAR RACKPIN REVOLUTE SCREW SPHERICAL TRANSLATIONAL UNIVERSAL"


@dataclass(frozen=True)
class Joint(Statement, entity="Joint"):
    """JOINT."""

    type: str | None = arg("type", CHOICE, choices=JOINT_TYPES, required=True)
    i: int | None = arg("I", ID, required=True)
    j: int | None = arg("J", ID, required=True)
    pitch: float | None = arg("PITCH", REAL, dimension="length")
    pd: float | None = arg("PD", REAL, dimension="length")
    ic: Vector | None = arg("IC", REALS, count=(1, 2), start=True)
    ictran: Vector | None = arg("ICTRAN", REALS, count=(1, 2), start=True)
    icrot: Vector | None = arg("ICROT", REALS, count=(1, 2), start=True)
    friction: str | None = arg(
        "FRICTION",
        WORD,
        choices="ON OFF PRELOAD_ONLY",
        instead="a FRICTION statement; the law of this one is not known",
    )
    delta_v: float | None = arg("DELTA_V", REAL, idle=WITHOUT_FRICTION)
    max_deformation: float | None = arg("MAXIMUM_DEFORMATION", REAL, idle=WITHOUT_FRICTION)
    max_friction: float | None = arg("MAX_FRICTION", REAL, idle=WITHOUT_FRICTION)
    max_fric_rot: float | None = arg("MAX_FRIC_ROT", REAL, idle=WITHOUT_FRICTION)
    max_fric_trans: float | None = arg("MAX_FRIC_TRANS", REAL, idle=WITHOUT_FRICTION)
    mu_dyn_rot: float | None = arg("MU_DYN_ROT", REAL, idle=WITHOUT_FRICTION)
    mu_dyn_trans: float | None = arg("MU_DYN_TRANS", REAL, idle=WITHOUT_FRICTION)
    mu_stat_rot: float | None = arg("MU_STAT_ROT", REAL, idle=WITHOUT_FRICTION)
    mu_stat_trans: float | None = arg("MU_STAT_TRANS", REAL, idle=WITHOUT_FRICTION)
    preload_axial: float | None = arg("PRELOAD_AXIAL", REAL, idle=WITHOUT_FRICTION)
    preload_radial: float | None = arg("PRELOAD_RADIAL", REAL, idle=WITHOUT_FRICTION)
    preload_x: float | None = arg("PRELOAD_X", REAL, idle=WITHOUT_FRICTION)
    preload_y: float | None = arg("PRELOAD_Y", REAL, idle=WITHOUT_FRICTION)
    inner_radius: float | None = arg("INNER_RADIUS", REAL, idle=WITHOUT_FRICTION)
    outer_radius: float | None = arg("OUTER_RADIUS", REAL, idle=WITHOUT_FRICTION)
    pin_radius: float | None = arg("PIN_RADIUS", REAL, idle=WITHOUT_FRICTION)
    height: float | None = arg("HEIGHT", REAL, idle=WITHOUT_FRICTION)
    width: float | None = arg("WIDTH", REAL, idle=WITHOUT_FRICTION)


@dataclass(frozen=True)
class Jprim(Statement, entity="Primitive_Joint"):
    """JPRIM: a joint primitive."""

    type: str | None = arg(
        "type", CHOICE, choices="ATPOINT INLINE INPLANE ORIENTATION PARALLEL_AXES PERPENDICULAR", required=True
    )
    i: int | None = arg("I", ID, required=True)
    j: int | None = arg("J", ID, required=True)


@dataclass(frozen=True)
class Coupler(Statement, entity="Coupler", subroutine="COUSUB", changeable=False):
    """COUPLER: r1 q1 + r2 q2 (+ r3 q3) = 0."""

    joints: tuple[int, ...] = arg("JOINTS", IDS, (), count=(2, 3), required=True)
    type: tuple[str, ...] = arg("TYPE", WORDS, (), choices="ROTATIONAL TRANSLATIONAL")
    scales: Vector = arg("SCALES", REALS, (), count=(1, 3))
    function: str | None = arg("FUNCTION", TEXT, instead="USER with a routine, or SCALES")
    routine: str | None = arg("ROUTINE", TEXT)
    expression: str | None = field(default=None, kw_only=True)


@dataclass(frozen=True)
class Gear(Statement, entity="Gear", changeable=False):
    """GEAR: equal velocities at the common-velocity marker."""

    joints: tuple[int, ...] = arg("JOINTS", IDS, (), count=2, required=True)
    cv: int | None = arg("CV", ID, required=True)


@dataclass(frozen=True)
class Gcon(Statement, entity="GCon"):
    """GCON: a constraint given by an expression that must be zero."""

    i: int | None = arg("I", ID)
    function: str | None = arg("FUNCTION", EXPRESSION, required=True)


@dataclass(frozen=True)
class Motion(Statement, entity="Motion", subroutine="MOTSUB"):
    """MOTION of a joint, or of one component between two markers."""

    joint: int | None = arg("JOINT", ID)
    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    direction: str | None = arg("direction", CHOICE, choices="TRANSLATIONAL ROTATIONAL X Y Z B1 B2 B3")
    level: str | None = arg("level", CHOICE, choices="DISPLACEMENT VELOCITY ACCELERATION")
    function: str | None = arg("FUNCTION", EXPRESSION, required=True)
    routine: str | None = arg("ROUTINE", TEXT)
    icdisp: float | None = arg("ICDISP", REAL, start=True)
    icvel: float | None = arg("ICVEL", REAL, start=True)


# Statements of a deck as typed records: forces.


@dataclass(frozen=True)
class Sforce(Statement, entity="SForce", subroutine="SFOSUB"):
    """SFORCE: a single-component force or torque."""

    i: int | None = arg("I", ID, required=True)
    j: int | None = arg("J", ID, required=True)
    type: str | None = arg("type", CHOICE, choices="TRANSLATIONAL ROTATIONAL", required=True)
    action_only: bool = arg("ACTIONONLY", FLAG, False)
    function: str | None = arg("FUNCTION", EXPRESSION, required=True)
    routine: str | None = arg("ROUTINE", TEXT)


@dataclass(frozen=True)
class Acting(Statement, read=False):
    """Where a force of several components acts, and along which axes."""

    i: int | None = arg("I", ID, required=True)
    jfloat: int | None = arg("JFLOAT", ID)
    rm: int | None = arg("RM", ID, required=True)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)


@dataclass(frozen=True)
class Vforce(Acting, entity="VForce", subroutine="VFOSUB", results="fx fy fz"):
    """VFORCE: three force components along the axes of RM."""

    fx: str | None = arg("FX", EXPRESSION)
    fy: str | None = arg("FY", EXPRESSION)
    fz: str | None = arg("FZ", EXPRESSION)


@dataclass(frozen=True)
class Vtorque(Acting, entity="VTorque", subroutine="VTOSUB", results="tx ty tz"):
    """VTORQUE: three torque components along the axes of RM."""

    tx: str | None = arg("TX", EXPRESSION)
    ty: str | None = arg("TY", EXPRESSION)
    tz: str | None = arg("TZ", EXPRESSION)


@dataclass(frozen=True)
class Gforce(Vtorque, Vforce, entity="GForce", subroutine="GFOSUB", results="fx fy fz tx ty tz"):
    """GFORCE: force and torque components along the axes of RM; ``gears`` is a pair in place of a gear force."""

    gears: GearPair | None = field(default=None, kw_only=True)


@dataclass(frozen=True)
class SpringDamper(Statement, entity="SpringDamper"):
    """SPRINGDAMPER: a linear spring and damper between two markers."""

    i: int | None = arg("I", ID, required=True)
    j: int | None = arg("J", ID, required=True)
    type: str | None = arg("type", CHOICE, choices="TRANSLATIONAL ROTATIONAL", required=True)
    k: float = arg("K", REAL, 0.0, dimension="stiffness")
    c: float = arg("C", REAL, 0.0, dimension="damping")
    length: float = arg("LENGTH", REAL, 0.0, dimension="length")
    force: float = arg("FORCE", REAL, 0.0, dimension="force")
    kt: float = arg("KT", REAL, 0.0, dimension="rotational_stiffness")
    ct: float = arg("CT", REAL, 0.0, dimension="rotational_damping")
    angle: float = arg("ANGLE", REAL, 0.0, dimension="angle")
    torque: float = arg("TORQUE", REAL, 0.0, dimension="torque")


@dataclass(frozen=True)
class Bushing(Statement, entity="Bushing"):
    """BUSHING: linear springs and dampers along and about the axes of J."""

    i: int | None = arg("I", ID, required=True)
    j: int | None = arg("J", ID, required=True)
    k: Vector = arg("K", REALS, (0.0, 0.0, 0.0), count=3, dimension="stiffness")
    kt: Vector = arg("KT", REALS, (0.0, 0.0, 0.0), count=3, dimension="rotational_stiffness")
    c: Vector = arg("C", REALS, (0.0, 0.0, 0.0), count=3, dimension="damping")
    ct: Vector = arg("CT", REALS, (0.0, 0.0, 0.0), count=3, dimension="rotational_damping")
    force: Vector = arg("FORCE", REALS, (0.0, 0.0, 0.0), count=3, dimension="force")
    torque: Vector = arg("TORQUE", REALS, (0.0, 0.0, 0.0), count=3, dimension="torque")


@dataclass(frozen=True)
class Field(Statement, entity="Field", subroutine="FIESUB"):
    """FIELD: a full 6x6 stiffness and damping between two markers, matrices by columns."""

    i: int | None = arg("I", ID, required=True)
    j: int | None = arg("J", ID, required=True)
    kmatrix: Vector | None = arg("KMATRIX", REALS, count=36)
    cmatrix: Vector | None = arg("CMATRIX", REALS, count=36)
    cratio: float | None = arg("CRATIO", REAL, unsigned=True)
    length: Vector | None = arg("LENGTH", REALS, count=6)
    force: Vector | None = arg("FORCE", REALS, count=6)
    function: str | None = arg("FUNCTION", TEXT, instead="USER with a routine, or KMATRIX and CMATRIX")
    routine: str | None = arg("ROUTINE", TEXT)
    components: tuple[str, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True)
class Beam(Statement, entity="Beam"):
    """BEAM: a massless Timoshenko beam from J to I along x of J."""

    i: int | None = arg("I", ID, required=True)
    j: int | None = arg("J", ID, required=True)
    length: float | None = arg("LENGTH", REAL, dimension="length", required=True, positive=True)
    ixx: float | None = arg("IXX", REAL, required=True, unsigned=True)
    iyy: float | None = arg("IYY", REAL, required=True, unsigned=True)
    izz: float | None = arg("IZZ", REAL, required=True, unsigned=True)
    area: float | None = arg("AREA", REAL, required=True, positive=True)
    asy: float = arg("ASY", REAL, 0.0, unsigned=True)
    asz: float = arg("ASZ", REAL, 0.0, unsigned=True)
    emodulus: float | None = arg("EMODULUS", REAL, required=True, positive=True)
    gmodulus: float | None = arg("GMODULUS", REAL, required=True, positive=True)
    cratio: float | None = arg("CRATIO", REAL, unsigned=True)
    cmatrix: Vector | None = arg("CMATRIX", REALS, count=21)
    formulation: str = arg("FORMULATION", WORD, "LINEAR", choices="LINEAR STRING NONLINEAR")


@dataclass(frozen=True)
class Accgrav(Statement, once=True, switch="acts"):
    """ACCGRAV: the acceleration of gravity."""

    igrav: float = arg("IGRAV", REAL, 0.0, dimension="acceleration")
    jgrav: float = arg("JGRAV", REAL, 0.0, dimension="acceleration")
    kgrav: float = arg("KGRAV", REAL, 0.0, dimension="acceleration")


@dataclass(frozen=True)
class Friction(Statement, entity="Friction"):
    """FRICTION: dry friction of a joint."""

    joint: int | None = arg("JOINT", ID, required=True)
    mu_static: float | None = arg("MU_STATIC", REAL, required=True)
    mu_dynamic: float | None = arg("MU_DYNAMIC", REAL, required=True)
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
    formulation: str | None = arg(
        "FORMULATION", WORD, choices="ORIGINAL LUGRE", idle="friction follows one law, see the documentation"
    )
    max_force: float | None = arg("MAX_FRICTION_FORCE", REAL, dimension="force")
    max_torque: float | None = arg("MAX_FRICTION_TORQUE", REAL, dimension="torque")


# Statements of a deck as typed records: contacts and the solids that touch.


SOLIDS = "BOX CYLINDER ELLIPSOID EXTERNAL EXTRUSION FRUSTUM PLANE POINT REVOLUTION TORUS"
"""Solids that can touch."""


@dataclass(frozen=True)
class Graphics(Statement, user="a CONTACT", changeable=False):
    """GRAPHICS: a solid, as far as a CONTACT names it."""

    type: str | None = arg("type", CHOICE, choices=SOLIDS, required=True)
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
    xmin: float | None = arg("XMIN", REAL, idle=LIMITS)
    xmax: float | None = arg("XMAX", REAL, idle=LIMITS)
    ymin: float | None = arg("YMIN", REAL, idle=LIMITS)
    ymax: float | None = arg("YMAX", REAL, idle=LIMITS)
    rangle: float | None = arg("RANGLE", REAL, dimension="angle")
    sides: int | None = arg("SIDES", INT)
    seg: int | None = arg("SEG", INT)
    data_file: str | None = arg("FILE", PATH)
    element: str | None = arg("ELEMENT", TEXT)
    faceting: float | None = arg(
        "FACETING_TOLERANCE", REAL, idle="the kind of the solid says into how many facets it is cut, if any"
    )

    @property
    def marker(self) -> int | None:
        """The marker whose frame holds the solid."""
        return next((ref for ref in (self.cm, self.corner, self.rm) if ref is not None), None)


@dataclass(frozen=True)
class Contact(Statement, entity="Contact"):
    """CONTACT: solids that touch and rub."""

    kind: str | None = arg("TYPE", WORD)
    igeom: tuple[int, ...] = arg("IGEOM", IDS, (), count=(1, 1000), required=True)
    jgeom: tuple[int, ...] = arg("JGEOM", IDS, (), count=(1, 1000), required=True)
    law: str | None = arg("law", CHOICE, choices="IMPACT POISSON", required=True)
    stiffness: float | None = arg("STIFFNESS", REAL)
    exponent: float = arg("EXPONENT", REAL, 1.0)
    damping: float = arg("DAMPING", REAL, 0.0, dimension="damping")
    dmax: float | None = arg("DMAX", REAL, dimension="length")
    penalty: float | None = arg("PENALTY", REAL, dimension="stiffness")
    restitution: float | None = arg("RESTITUTION_COEFFICIENT", REAL)
    augmented: bool = arg("AUGMENTED_LAGRANGIAN_FORMULATION", FLAG, False, idle=BY_DEPTH)
    coulomb: str = arg("COULOMB_FRICTION", WORD, "OFF", choices="ON OFF DYNAMICS_ONLY DYNAMICSONLY")
    no_friction: bool = arg("NO_FRICTION", FLAG, False)
    mu_static: float = arg("MU_STATIC", REAL, 0.0)
    mu_dynamic: float = arg("MU_DYNAMIC", REAL, 0.0)
    stiction: float | None = arg("STICTION_TRANSITION_VELOCITY", REAL, dimension="velocity")
    transition: float | None = arg("FRICTION_TRANSITION_VELOCITY", REAL, dimension="velocity")
    stiction_law: str | None = arg("STICTION", WORD, choices="ON OFF", idle=BY_DEPTH)
    max_deformation: float | None = arg("MAX_STICTION_DEFORMATION", REAL, dimension="length", idle=BY_DEPTH)
    normal_function: str | None = arg("NORMAL_FUNCTION", TEXT, instead="IMPACT or POISSON")
    friction_function: str | None = arg("FRICTION_FUNCTION", TEXT, instead="COULOMB_FRICTION")
    iflex: int | None = arg("IFLEX", ID, instead="a solid on a rigid PART")
    jflex: int | None = arg("JFLEX", ID, instead="a solid on a rigid PART")
    flip_i: bool = arg("I_FLIP_NORMAL", FLAG, False, idle=BY_DEPTH)
    flip_j: bool = arg("J_FLIP_NORMAL", FLAG, False, idle=BY_DEPTH)


# Statements of a deck as typed records: matrices, curves and what moves along them.


@dataclass(frozen=True)
class Matrix(Statement, changeable=False):
    """MATRIX of numbers."""

    full: str | None = arg("FULL", WORD, choices="RORDER CORDER")
    sparse: bool = arg("SPARSE", FLAG, False)
    rows: int | None = arg("ROWS", INT, required=True)
    columns: int | None = arg("COLUMNS", INT, required=True)
    values: Vector = arg("VALUES", REALS, (), count=(1, 1000000), required=True)
    data_file: str | None = arg("FILE", PATH)
    matrix_name: str | None = arg("NAME", TEXT)


@dataclass(frozen=True)
class CurveStatement(Statement, keyword="CURVE", read_by="CURVE", subroutine="CURSUB", changeable=False):
    """CURVE through, or by, the points of a MATRIX."""

    ends: str | None = arg("ends", CHOICE, choices="CLOSED OPEN")
    points: str | None = arg("points", CHOICE, choices="CURVE_POINTS CONTROL_POINTS")
    order: int = arg("ORDER", INT, 4)
    matrix: int | None = arg("MATRIX", ID, required=True)
    function: str | None = arg("FUNCTION", TEXT, instead="USER with a routine, or points in a MATRIX")
    routine: str | None = arg("ROUTINE", TEXT)
    sampled: tuple[Vector, ...] = field(default=(), kw_only=True)
    minpar: float | None = arg("MINPAR", REAL, idle="the points alone say how far the curve goes")
    maxpar: float | None = arg("MAXPAR", REAL, idle="the points alone say how far the curve goes")


@dataclass(frozen=True)
class Ptcv(Statement, entity="PTCV"):
    """PTCV: a point stays on a curve."""

    i: int | None = arg("I", ID, required=True)
    curve: int | None = arg("CURVE", ID, required=True)
    rm: int | None = arg("RM", ID, required=True)
    jfloat: int | None = arg("JFLOAT", ID)
    disp: Vector | None = arg("DISP", REALS, count=3, dimension="length")
    vel: float | None = arg("VEL", REAL, dimension="velocity")
    icm: int | None = arg("ICM", ID)


@dataclass(frozen=True)
class Cvcv(Statement, entity="CVCV"):
    """CVCV: two plane curves stay in touch."""

    icurve: int | None = arg("ICURVE", ID, required=True)
    jcurve: int | None = arg("JCURVE", ID, required=True)
    irm: int | None = arg("IRM", ID, required=True)
    jrm: int | None = arg("JRM", ID, required=True)
    ifloat: int | None = arg("IFLOAT", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    idisp: Vector | None = arg("IDISP", REALS, count=3, dimension="length")
    jdisp: Vector | None = arg("JDISP", REALS, count=3, dimension="length")
    ivel: float | None = arg("IVEL", REAL, dimension="velocity", idle="the speeds follow from those of the parts")
    jvel: float | None = arg("JVEL", REAL, dimension="velocity", idle="the speeds follow from those of the parts")
    iicm: int | None = arg("IICM", ID)
    jicm: int | None = arg("JICM", ID)
