"""The statements of a deck that this program understands, as typed records.

Every field carries the keyword and kind it is read from; values stay in the deck's units (angles in
radians).  ``given`` says which arguments stood in the deck.
"""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass, field

from gearmbs.adams.grammar import (
    CHOICE,
    EXPRESSION,
    FLAG,
    ID,
    IDS,
    INT,
    REAL,
    REALS,
    STRINGS,
    TABLE,
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
    """

    id: int = 0
    file: str = ""
    line: int = 0
    name: str | None = None
    given: dict[str, int] = field(default_factory=dict, compare=False)

    def label(self) -> str:
        """Return the statement as a modeller names it, for instance JOINT/3."""
        return f"{KEYWORD_OF[type(self)]}/{self.id}" if self.id else KEYWORD_OF[type(self)]


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
    node_id: int | None = arg("NODE_ID", ID)
    curve: int | None = arg("CURVE", ID)


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
    delta_v: float | None = arg("DELTA_V", REAL)
    max_friction: float | None = arg("MAX_FRICTION", REAL)
    mu_dyn_rot: float | None = arg("MU_DYN_ROT", REAL)
    mu_dyn_trans: float | None = arg("MU_DYN_TRANS", REAL)
    mu_stat_rot: float | None = arg("MU_STAT_ROT", REAL)
    mu_stat_trans: float | None = arg("MU_STAT_TRANS", REAL)
    pin_radius: float | None = arg("PIN_RADIUS", REAL)


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
    icdisp: float | None = arg("ICDISP", REAL)
    icvel: float | None = arg("ICVEL", REAL)


@dataclass(frozen=True)
class Sforce(Statement):
    """SFORCE: a single-component force or torque."""

    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    type: str | None = arg("type", CHOICE, choices="TRANSLATIONAL ROTATIONAL")
    action_only: bool = arg("ACTIONONLY", FLAG, False)
    function: str | None = arg("FUNCTION", EXPRESSION)


@dataclass(frozen=True)
class Vforce(Statement):
    """VFORCE: three force components along the axes of RM."""

    i: int | None = arg("I", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    rm: int | None = arg("RM", ID)
    fx: str | None = arg("FX", EXPRESSION)
    fy: str | None = arg("FY", EXPRESSION)
    fz: str | None = arg("FZ", EXPRESSION)


@dataclass(frozen=True)
class Vtorque(Statement):
    """VTORQUE: three torque components along the axes of RM."""

    i: int | None = arg("I", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    rm: int | None = arg("RM", ID)
    tx: str | None = arg("TX", EXPRESSION)
    ty: str | None = arg("TY", EXPRESSION)
    tz: str | None = arg("TZ", EXPRESSION)


@dataclass(frozen=True)
class Gforce(Statement):
    """GFORCE: force and torque components along the axes of RM."""

    i: int | None = arg("I", ID)
    jfloat: int | None = arg("JFLOAT", ID)
    rm: int | None = arg("RM", ID)
    fx: str | None = arg("FX", EXPRESSION)
    fy: str | None = arg("FY", EXPRESSION)
    fz: str | None = arg("FZ", EXPRESSION)
    tx: str | None = arg("TX", EXPRESSION)
    ty: str | None = arg("TY", EXPRESSION)
    tz: str | None = arg("TZ", EXPRESSION)


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


@dataclass(frozen=True)
class Accgrav(Statement):
    """ACCGRAV: the acceleration of gravity."""

    igrav: float = arg("IGRAV", REAL, 0.0, dimension="acceleration")
    jgrav: float = arg("JGRAV", REAL, 0.0, dimension="acceleration")
    kgrav: float = arg("KGRAV", REAL, 0.0, dimension="acceleration")


@dataclass(frozen=True)
class Variable(Statement):
    """VARIABLE: an algebraic variable given by an expression."""

    ic: float | None = arg("IC", REAL)
    function: str | None = arg("FUNCTION", EXPRESSION)


@dataclass(frozen=True)
class Diff(Statement):
    """DIFF: a first-order differential equation."""

    ic: Vector = arg("IC", REALS, (0.0,), count=(1, 2))
    function: str | None = arg("FUNCTION", EXPRESSION)
    implicit: bool = arg("IMPLICIT", FLAG, False)


@dataclass(frozen=True)
class Spline(Statement):
    """SPLINE: points of a curve or a family of curves."""

    x: Vector | None = arg("X", REALS, count=(4, 100000))
    y: tuple[Vector, ...] = arg("Y", TABLE, (), count=(4, 100000))
    linear_extrapolate: bool = arg("LINEAR_EXTRAPOLATE", FLAG, False)
    data_file: str | None = arg("FILE", TEXT)
    block: str | None = arg("BLOCK", TEXT)


@dataclass(frozen=True)
class Array(Statement):
    """ARRAY of numbers."""

    type: str | None = arg("type", CHOICE, choices="IC X Y U")
    size: int | None = arg("SIZE", INT)
    numbers: Vector = arg("NUMBERS", REALS, (), count=(1, 100000))
    variables: tuple[int, ...] = arg("VARIABLES", IDS, (), count=(1, 100000))


@dataclass(frozen=True)
class Plant(Statement):
    """PINPUT or POUTPUT: a list of variables."""

    variables: tuple[int, ...] = arg("VARIABLES", IDS, (), count=(1, 100000))


@dataclass(frozen=True)
class PlantInput(Plant):
    """PINPUT."""


@dataclass(frozen=True)
class PlantOutput(Plant):
    """POUTPUT."""


@dataclass(frozen=True)
class Request(Statement):
    """REQUEST: what the request file holds."""

    type: str | None = arg(
        "type",
        CHOICE,
        choices="DISPLACEMENT VELOCITY ACCELERATION FORCE",
        aliases="D:DISPLACEMENT V:VELOCITY A:ACCELERATION F:FORCE",
    )
    i: int | None = arg("I", ID)
    j: int | None = arg("J", ID)
    rm: int | None = arg("RM", ID)
    comment: str | None = arg("COMMENT", TEXT, aliases="C")
    f1: str | None = arg("F1", EXPRESSION)
    f2: str | None = arg("F2", EXPRESSION)
    f3: str | None = arg("F3", EXPRESSION)
    f4: str | None = arg("F4", EXPRESSION)
    f5: str | None = arg("F5", EXPRESSION)
    f6: str | None = arg("F6", EXPRESSION)
    f7: str | None = arg("F7", EXPRESSION)
    f8: str | None = arg("F8", EXPRESSION)
    function: str | None = arg("FUNCTION", TEXT)
    title: tuple[str, ...] = arg("TITLE", STRINGS, ())
    cnames: tuple[str, ...] = arg("CNAMES", STRINGS, ())
    cunits: tuple[str, ...] = arg("CUNITS", STRINGS, ())
    results_name: str | None = arg("RESULTS_NAME", TEXT)

    def functions(self) -> tuple[str | None, ...]:
        """Return F1 to F8."""
        return (self.f1, self.f2, self.f3, self.f4, self.f5, self.f6, self.f7, self.f8)


@dataclass(frozen=True)
class Integrator(Statement):
    """INTEGRATOR: method, formulation and its settings."""

    method: str | None = arg(
        "method",
        CHOICE,
        choices="GSTIFF WSTIFF CONSTANT_BDF HHT NEWMARK HASTIFF ABAM RKF45 SI2_GSTIFF DSTIFF",
    )
    formulation: str | None = arg("formulation", CHOICE, choices="I3 SI2 SI1")
    error: float | None = arg("ERROR", REAL)
    hinit: float | None = arg("HINIT", REAL, dimension="time")
    hmax: float | None = arg("HMAX", REAL, dimension="time")
    hmin: float | None = arg("HMIN", REAL, dimension="time")
    hratio: int | None = arg("HRATIO", INT)
    kmax: int | None = arg("KMAX", INT)
    maxit: int | None = arg("MAXIT", INT)
    pattern: tuple[str, ...] = arg("PATTERN", WORDS, ())
    interpolate: str | None = arg("INTERPOLATE", WORD)
    corrector: str | None = arg("CORRECTOR", WORD)
    fixit: int | None = arg("FIXIT", INT)
    adaptivity: float | None = arg("ADAPTIVITY", REAL)
    beta: float | None = arg("BETA", REAL)
    gamma: float | None = arg("GAMMA", REAL)
    alpha: float | None = arg("ALPHA", REAL)
    scale: Vector | None = arg("SCALE", REALS, count=(1, 3))


@dataclass(frozen=True)
class InitialConditions(Statement):
    """IC: control of the initial conditions analysis."""

    error: float | None = arg("ERROR", REAL)
    aerror: float | None = arg("AERROR", REAL)
    verror: float | None = arg("VERROR", REAL)
    maxit: int | None = arg("MAXIT", INT)
    amaxit: int | None = arg("AMAXIT", INT)
    tlimit: float | None = arg("TLIMIT", REAL)
    alimit: float | None = arg("ALIMIT", REAL)
    pattern: tuple[str, ...] = arg("PATTERN", WORDS, ())
    apattern: tuple[str, ...] = arg("APATTERN", WORDS, ())


@dataclass(frozen=True)
class Kinematics(InitialConditions):
    """KINEMATICS: control of kinematic analyses."""

    hmax: float | None = arg("HMAX", REAL, dimension="time")


@dataclass(frozen=True)
class Equilibrium(InitialConditions):
    """EQUILIBRIUM: control of static analyses."""

    stability: float | None = arg("STABILITY", REAL)
    imbalance: float | None = arg("IMBALANCE", REAL)
    static_method: str | None = arg("METHOD", WORD)


@dataclass(frozen=True)
class Output(Statement):
    """OUTPUT: which files are written and how."""

    reqsave: bool = arg("REQSAVE", FLAG, False)
    grsave: bool = arg("GRSAVE", FLAG, False)
    separator: str | None = arg("separator", CHOICE, choices="SEPARATOR NOSEPARATOR")
    teletype: bool = arg("TELETYPE", FLAG, False)
    osformat: bool = arg("OSFORMAT", FLAG, False)
    fixed: bool = arg("FIXED", FLAG, False)
    ypr: bool = arg("YPR", FLAG, False)
    chart: str | None = arg("CHART", TEXT)
    noprint: bool = arg("NOPRINT", FLAG, False)
    dscale: Vector | None = arg("DSCALE", REALS, count=(1, 2))
    vscale: Vector | None = arg("VSCALE", REALS, count=(1, 2))
    ascale: Vector | None = arg("ASCALE", REALS, count=(1, 2))
    fscale: Vector | None = arg("FSCALE", REALS, count=(1, 2))
    dzero: float | None = arg("DZERO", REAL)
    vzero: float | None = arg("VZERO", REAL)
    azero: float | None = arg("AZERO", REAL)
    fzero: float | None = arg("FZERO", REAL)


@dataclass(frozen=True)
class Results(Statement):
    """RESULTS: whether and what the results file holds."""

    formatted: bool = arg("FORMATTED", FLAG, False)
    unformatted: bool = arg("UNFORMATTED", FLAG, False)
    xrf: bool = arg("XRF", FLAG, False)
    nodisplacements: bool = arg("NODISPLACEMENTS", FLAG, False)
    novelocities: bool = arg("NOVELOCITIES", FLAG, False)
    noaccelerations: bool = arg("NOACCELERATIONS", FLAG, False)
    noreactionforces: bool = arg("NOREACTIONFORCES", FLAG, False)
    noappliedforces: bool = arg("NOAPPLIEDFORCES", FLAG, False)
    nodatastructures: bool = arg("NODATASTRUCTURES", FLAG, False)
    nosystemelements: bool = arg("NOSYSTEMELEMENTS", FLAG, False)
    nolinear: bool = arg("NOLINEAR", FLAG, False)
    norequests: bool = arg("NOREQUESTS", FLAG, False)
    comment: str | None = arg("COMMENT", TEXT)


STATEMENTS: dict[str, type[Statement]] = {
    "ACCGRAV": Accgrav,
    "ARRAY": Array,
    "BUSHING": Bushing,
    "COUPLER": Coupler,
    "DIFF": Diff,
    "EQUILIBRIUM": Equilibrium,
    "FIELD": Field,
    "GCON": Gcon,
    "GEAR": Gear,
    "GFORCE": Gforce,
    "IC": InitialConditions,
    "INTEGRATOR": Integrator,
    "JOINT": Joint,
    "JPRIM": Jprim,
    "KINEMATICS": Kinematics,
    "MARKER": Marker,
    "MOTION": Motion,
    "OUTPUT": Output,
    "PART": Part,
    "PINPUT": PlantInput,
    "POUTPUT": PlantOutput,
    "REQUEST": Request,
    "RESULTS": Results,
    "SFORCE": Sforce,
    "SPLINE": Spline,
    "SPRINGDAMPER": SpringDamper,
    "UNITS": Units,
    "VARIABLE": Variable,
    "VFORCE": Vforce,
    "VTORQUE": Vtorque,
}
KEYWORD_OF = {cls: keyword for keyword, cls in STATEMENTS.items()}

WITHOUT_ID = frozenset("ACCGRAV EQUILIBRIUM IC INTEGRATOR KINEMATICS OUTPUT RESULTS UNITS".split())
"""Statements that stand once and have no id."""

IGNORED = frozenset("GRAPHICS MATERIAL PREFERENCES DEBUG LSOLVER STRING".split())
"""Statements without effect on the numbers computed here."""

UNSUPPORTED = frozenset(
    """BEAM CONTACT CURVE CVCV FE_LOAD FE_PART FLEX_BODY FRICTION GSE LSE MATRIX MFORCE MREQUEST NFORCE POINT_MASS
    PSTATE PTCV SENSOR SURFACE TFSISO TIRE UCON""".split()
)
"""Statements of ADAMS that change the motion and are not modelled here."""
