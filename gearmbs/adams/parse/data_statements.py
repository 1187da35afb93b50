"""Statements of a deck as typed records: data, requests, settings and output."""

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
    LINE,
    PATH,
    REAL,
    REALS,
    STRINGS,
    TABLE,
    TEXT,
    WORD,
    WORDS,
    Statement,
    arg,
)
from gearmbs.adams.parse.model_statements import Turning, Vector
from gearmbs.dae.methods import FORMULATIONS

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

# why arguments that stand in several places have no effect
TIGHT = "the program's own settings are tight enough"
AS_THEY_ARE = "values are written as they are"
ALL_WRITTEN = "everything is written"
DIFFERENCES = "derivatives are made by differences"
LAST_DIGITS = "the time is found to the last digits"


@dataclass(frozen=True)
class Variable(Statement, read_by="VARVAL", subroutine="VARSUB", moves=False, switch="on"):
    """VARIABLE: an algebraic variable given by an expression."""

    ic: float | None = arg("IC", REAL, idle="variables need no starting value")
    function: str | None = arg("FUNCTION", EXPRESSION, required=True)
    routine: str | None = arg("ROUTINE", TEXT)


@dataclass(frozen=True)
class Diff(Statement, read_by="DIF DIF1", subroutine="DIFSUB", switch="acts"):
    """DIFF: a first-order differential equation."""

    ic: Vector = arg("IC", REALS, (0.0,), count=(1, 2), start=True)
    function: str | None = arg("FUNCTION", EXPRESSION, required=True)
    implicit: bool = arg("IMPLICIT", FLAG, False)
    static_hold: bool = arg("STATIC_HOLD", FLAG, False)
    routine: str | None = arg("ROUTINE", TEXT)


@dataclass(frozen=True)
class Spline(Statement):
    """SPLINE: points of a curve or a family of curves."""

    x: Vector | None = arg("X", REALS, count=(4, 100000))
    y: tuple[Vector, ...] = arg("Y", TABLE, (), count=(4, 100000))
    linear_extrapolate: bool = arg("LINEAR_EXTRAPOLATE", FLAG, False)
    data_file: str | None = arg("FILE", TEXT, instead="X and Y in the deck")
    block: str | None = arg("BLOCK", TEXT)


@dataclass(frozen=True)
class Array(Statement, read_by="ARYVAL", moves=False):
    """ARRAY of numbers."""

    type: str | None = arg("type", CHOICE, choices="IC X Y U")
    size: int | None = arg("SIZE", INT)
    numbers: Vector = arg("NUMBERS", REALS, (), count=(1, 100000))
    variables: tuple[int, ...] = arg("VARIABLES", IDS, (), count=(1, 100000))


@dataclass(frozen=True)
class Plant(Statement, read=False):
    """PINPUT or POUTPUT: a list of variables."""

    variables: tuple[int, ...] = arg("VARIABLES", IDS, (), count=(1, 100000))


@dataclass(frozen=True)
class PlantInput(Plant, keyword="PINPUT", moves=False, changeable=False):
    """PINPUT."""


@dataclass(frozen=True)
class PlantOutput(Plant, keyword="POUTPUT", moves=False, changeable=False):
    """POUTPUT."""


@dataclass(frozen=True)
class RequestType:
    """A standard type of REQUEST.

    Attributes
    ----------
    number : int
        In request files.
    columns : str
        Functions behind the eight columns, with blanks, of the markers I, J and RM as i, j and k; "-" for a column that
        stays empty.
    dimensions : tuple of str
        Of the first four columns and of the others.
    """

    number: int
    columns: str
    dimensions: tuple[str, str]

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functions behind the columns, "" for an empty one."""
        return tuple(column.partition("(")[0].strip("-") for column in self.columns.split())


REQUEST_TYPES = {
    "DISPLACEMENT": RequestType(
        1, "DM(i,j) DX(i,j,k) DY(i,j,k) DZ(i,j,k) - PSI(i,j) THETA(i,j) PHI(i,j)", ("length", "angle")
    ),
    "VELOCITY": RequestType(
        2,
        "VM(i,j) VX(i,j,k) VY(i,j,k) VZ(i,j,k) WM(i,j) WX(i,j,k) WY(i,j,k) WZ(i,j,k)",
        ("velocity", "angular_velocity"),
    ),
    "ACCELERATION": RequestType(
        3,
        "ACCM(i,j) ACCX(i,j,k) ACCY(i,j,k) ACCZ(i,j,k) WDTM(i,j) WDTX(i,j,k) WDTY(i,j,k) WDTZ(i,j,k)",
        ("acceleration", "angular_acceleration"),
    ),
    "FORCE": RequestType(
        4, "FM(i,j) FX(i,j,k) FY(i,j,k) FZ(i,j,k) TM(i,j) TX(i,j,k) TY(i,j,k) TZ(i,j,k)", ("force", "torque")
    ),
}
"""All that reads, checks, evaluates or writes a REQUEST takes its type from here."""


@dataclass(frozen=True)
class Request(Statement, subroutine="REQSUB", results="f1 f2 f3 f4 f5 f6 f7 f8", moves=False, switch="on"):
    """REQUEST: what the request file holds."""

    type: str | None = arg(
        "type",
        CHOICE,
        choices=" ".join(REQUEST_TYPES),
        aliases=" ".join(f"{name[0]}:{name}" for name in REQUEST_TYPES),
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
    function: str | None = arg("FUNCTION", TEXT, instead="USER with a routine, or F1 to F8")
    routine: str | None = arg("ROUTINE", TEXT)
    title: tuple[str, ...] = arg("TITLE", STRINGS, ())
    cnames: tuple[str, ...] = arg("CNAMES", STRINGS, ())
    cunits: tuple[str, ...] = arg("CUNITS", STRINGS, ())
    clabels: tuple[str, ...] = arg("CLABELS", STRINGS, ())
    results_name: str | None = arg("RESULTS_NAME", TEXT)

    def functions(self) -> tuple[str | None, ...]:
        """Return F1 to F8."""
        return (self.f1, self.f2, self.f3, self.f4, self.f5, self.f6, self.f7, self.f8)


@dataclass(frozen=True)
class Integrator(Statement, once=True):
    """INTEGRATOR: method, formulation and its settings."""

    method: str | None = arg(
        "method",
        CHOICE,
        choices="GSTIFF WSTIFF CONSTANT_BDF HHT NEWMARK HASTIFF ABAM RKF45 SI2_GSTIFF DSTIFF",
    )
    formulation: str | None = arg("formulation", CHOICE, choices=" ".join(FORMULATIONS))
    error: float | None = arg("ERROR", REAL, positive=True)
    hinit: float | None = arg("HINIT", REAL, dimension="time", positive=True)
    hmax: float | None = arg("HMAX", REAL, dimension="time", positive=True)
    hmin: float | None = arg("HMIN", REAL, dimension="time", positive=True)
    hratio: int | None = arg("HRATIO", INT, idle=TIGHT)
    kmax: int | None = arg("KMAX", INT)
    maxit: int | None = arg("MAXIT", INT)
    pattern: tuple[str, ...] = arg("PATTERN", WORDS, (), idle=TIGHT)
    interpolate: str | None = arg("INTERPOLATE", WORD)
    corrector: str | None = arg("CORRECTOR", WORD)
    fixit: int | None = arg("FIXIT", INT, idle=TIGHT)
    adaptivity: float | None = arg("ADAPTIVITY", REAL, idle=TIGHT)
    beta: float | None = arg("BETA", REAL, idle=TIGHT)
    gamma: float | None = arg("GAMMA", REAL, idle=TIGHT)
    alpha: float | None = arg("ALPHA", REAL, idle=TIGHT)
    scale: Vector | None = arg("SCALE", REALS, count=(1, 3), idle=TIGHT)


@dataclass(frozen=True)
class InitialConditions(Statement, keyword="IC", once=True):
    """IC: control of the initial conditions analysis."""

    error: float | None = arg("ERROR", REAL, idle=TIGHT)
    aerror: float | None = arg("AERROR", REAL, idle=TIGHT)
    verror: float | None = arg("VERROR", REAL, idle=TIGHT)
    maxit: int | None = arg("MAXIT", INT, idle=TIGHT)
    amaxit: int | None = arg("AMAXIT", INT, idle=TIGHT)
    tlimit: float | None = arg("TLIMIT", REAL, idle=TIGHT)
    alimit: float | None = arg("ALIMIT", REAL, idle=TIGHT)
    pattern: tuple[str, ...] = arg("PATTERN", WORDS, (), idle=TIGHT)
    apattern: tuple[str, ...] = arg("APATTERN", WORDS, (), idle=TIGHT)


@dataclass(frozen=True)
class Kinematics(InitialConditions, once=True):
    """KINEMATICS: control of kinematic analyses."""

    hmax: float | None = arg("HMAX", REAL, dimension="time", idle=TIGHT)


@dataclass(frozen=True)
class Equilibrium(InitialConditions, once=True):
    """EQUILIBRIUM: control of static analyses."""

    stability: float | None = arg("STABILITY", REAL, idle=TIGHT)
    imbalance: float | None = arg("IMBALANCE", REAL, idle=TIGHT)
    static_method: str | None = arg("METHOD", WORD, idle=TIGHT)


@dataclass(frozen=True)
class Output(Statement, once=True):
    """OUTPUT: which files are written and how."""

    reqsave: bool = arg("REQSAVE", FLAG, False)
    grsave: bool = arg("GRSAVE", FLAG, False)
    gr521sav: bool = arg("GR521SAV", FLAG, False)
    separator: str | None = arg("separator", CHOICE, choices="SEPARATOR NOSEPARATOR")
    teletype: bool = arg("TELETYPE", FLAG, False)
    osformat: bool = arg("OSFORMAT", FLAG, False)
    fixed: bool = arg("FIXED", FLAG, False)
    ypr: bool = arg("YPR", FLAG, False)
    chart: str | None = arg("CHART", TEXT, idle=AS_THEY_ARE)
    noprint: bool = arg("NOPRINT", FLAG, False)
    dscale: Vector | None = arg("DSCALE", REALS, count=(1, 2), idle=AS_THEY_ARE)
    vscale: Vector | None = arg("VSCALE", REALS, count=(1, 2), idle=AS_THEY_ARE)
    ascale: Vector | None = arg("ASCALE", REALS, count=(1, 2), idle=AS_THEY_ARE)
    fscale: Vector | None = arg("FSCALE", REALS, count=(1, 2), idle=AS_THEY_ARE)
    dzero: float | None = arg("DZERO", REAL, idle=AS_THEY_ARE)
    vzero: float | None = arg("VZERO", REAL, idle=AS_THEY_ARE)
    azero: float | None = arg("AZERO", REAL, idle=AS_THEY_ARE)
    fzero: float | None = arg("FZERO", REAL, idle=AS_THEY_ARE)


@dataclass(frozen=True)
class Results(Statement, once=True):
    """RESULTS: whether and what the results file holds."""

    formatted: bool = arg("FORMATTED", FLAG, False)
    unformatted: bool = arg("UNFORMATTED", FLAG, False)
    xrf: bool = arg("XRF", FLAG, False)
    nodisplacements: bool = arg("NODISPLACEMENTS", FLAG, False, idle=ALL_WRITTEN)
    novelocities: bool = arg("NOVELOCITIES", FLAG, False, idle=ALL_WRITTEN)
    noaccelerations: bool = arg("NOACCELERATIONS", FLAG, False, idle=ALL_WRITTEN)
    noreactionforces: bool = arg("NOREACTIONFORCES", FLAG, False, idle=ALL_WRITTEN)
    noappliedforces: bool = arg("NOAPPLIEDFORCES", FLAG, False, idle=ALL_WRITTEN)
    nodatastructures: bool = arg("NODATASTRUCTURES", FLAG, False, idle=ALL_WRITTEN)
    nosystemelements: bool = arg("NOSYSTEMELEMENTS", FLAG, False, idle=ALL_WRITTEN)
    nolinear: bool = arg("NOLINEAR", FLAG, False, idle=ALL_WRITTEN)
    nofloatingmarkers: bool = arg("NOFLOATINGMARKERS", FLAG, False, idle=ALL_WRITTEN)
    nocontacts: bool = arg("NOCONTACTS", FLAG, False, idle=ALL_WRITTEN)
    notires: bool = arg("NOTIRES", FLAG, False, idle=ALL_WRITTEN)
    norequests: bool = arg("NOREQUESTS", FLAG, False, idle=ALL_WRITTEN)
    comment: str | None = arg("COMMENT", TEXT)


# Statements of a deck as typed records: linear systems of a control loop.


@dataclass(frozen=True)
class System(Statement, read=False):
    """States, inputs and outputs, each an ARRAY."""

    x: int | None = arg("X", ID)
    u: int | None = arg("U", ID)
    y: int | None = arg("Y", ID)
    static_hold: bool = arg("STATIC_HOLD", FLAG, False)


@dataclass(frozen=True)
class Lse(System, changeable=False, switch="on"):
    """LSE: x' = A x + B u, y = C x + D u."""

    a: int | None = arg("A", ID)
    b: int | None = arg("B", ID)
    c: int | None = arg("C", ID)
    d: int | None = arg("D", ID)
    ic: int | None = arg("IC", ID)


@dataclass(frozen=True)
class Tfsiso(System, changeable=False, switch="on"):
    """TFSISO: y(s)/u(s) = (b0 + b1 s + ...)/(a0 + a1 s + ...)."""

    numerator: Vector = arg("NUMERATOR", REALS, (), count=(1, 30))
    denominator: Vector = arg("DENOMINATOR", REALS, (), count=(1, 30))


@dataclass(frozen=True)
class Gse(System, subroutine="GSE_DERIV", changeable=False, switch="on"):
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
    function: str | None = arg("FUNCTION", EXPRESSION, required=True)
    routine: str | None = arg("ROUTINE", TEXT)
    interface: str | None = arg("INTERFACE", TEXT)
    implicit: bool = arg("IMPLICIT", FLAG, False)
    xxflag: str | None = arg("XXFLAG", WORD, idle=DIFFERENCES)
    xuflag: str | None = arg("XUFLAG", WORD, idle=DIFFERENCES)
    yxflag: str | None = arg("YXFLAG", WORD, idle=DIFFERENCES)
    yuflag: str | None = arg("YUFLAG", WORD, idle=DIFFERENCES)
    callers: Any = field(default=None, kw_only=True, compare=False)
    held: Vector = field(default=(), kw_only=True)
    rated: tuple[bool, ...] = field(default=(), kw_only=True)


# Statements of a deck as typed records: sensors, texts.


@dataclass(frozen=True)
class Sensor(Statement, read_by="SENVAL", subroutine="SENSUB", switch="acts"):
    """SENSOR: what happens when an expression passes a value."""

    relation: str = arg("relation", CHOICE, "EQ", choices="EQ GE LE")
    value: float = arg("VALUE", REAL, 0.0)
    error: float = arg("ERROR", REAL, 1e-3)
    function: str | None = arg("FUNCTION", EXPRESSION, required=True)
    routine: str | None = arg("ROUTINE", TEXT)
    evaluate: str | None = arg("EVALUATE", EXPRESSION, aliases="EVAL")
    evaluate_routine: str | None = arg("EVALUATE_ROUTINE", TEXT)
    angular: bool = arg("ANGULAR", FLAG, False, idle=LAST_DIGITS)
    bisection: bool = arg("BISECTION", FLAG, False, idle=LAST_DIGITS)
    codgen: bool = arg("CODGEN", FLAG, False, idle="every analysis chooses its pivots anew")
    dt: float | None = arg("DT", REAL, dimension="time", positive=True)
    halt: bool = arg("HALT", FLAG, False)
    print_: bool = arg("PRINT", FLAG, False)
    restart: bool = arg("RESTART", FLAG, False)
    back: bool = arg("RETURN", FLAG, False)
    stepsize: float | None = arg("STEPSIZE", REAL, dimension="time", positive=True)
    yydump: bool = arg("YYDUMP", FLAG, False)


@dataclass(frozen=True)
class String(Statement):
    """STRING: a text, which routines of a user may ask for."""

    text: str | None = arg("STRING", LINE)


# Statements of a deck as typed records: flexible bodies.


NODES = 100_000
"""More than an FE_PART has nodes: the number of a node is that of its part times this, and its own."""


@dataclass(frozen=True)
class FlexBody(Turning, keyword="FLEX_BODY", changeable=False, switch="on"):
    """FLEX_BODY: a body with modes, from a modal neutral file."""

    mnf_file: str | None = arg("MNF_FILE", PATH)
    db_file: str | None = arg("DB_FILE", PATH, instead="MNF_FILE, a modal neutral file")
    bdf_file: str | None = arg(
        "BDF_FILE", PATH, instead="MNF_FILE; beams of large motion in Python (`gearmbs.flexible.add_beam`)"
    )
    index_in_database: int | None = arg("INDEX_IN_DATABASE", INT, instead="MNF_FILE, a modal neutral file")
    matrices: tuple[int, ...] = arg("MATRICES", IDS, (), count=(1, 100))
    exact: tuple[str, ...] = arg(
        "EXACT",
        WORDS,
        (),
        choices="X Y Z PSI THETA PHI",
        start=True,
        idle="bodies are moved as little as the joints allow, and deform linearly",
    )
    invariants: tuple[str, ...] = arg("INVARIANTS", WORDS, (), choices="TRUE FALSE")
    dmode: Vector = arg("DMODE", REALS, (), count=(1, 10000))
    vmode: Vector = arg("VMODE", REALS, (), count=(1, 10000))
    char_len: float | None = arg(
        "CHAR_LEN", REAL, dimension="length", idle="bodies are moved as little as the joints allow, and deform linearly"
    )
    cratio: str | None = arg("CRATIO", EXPRESSION)


@dataclass(frozen=True)
class Material(Statement, user="an FE_PART"):
    """MATERIAL of an FE_PART."""

    label_name: str | None = arg("NAME", TEXT)
    density: float | None = arg("DENSITY", REAL)
    youngs_modulus: float | None = arg("YOUNGS_MODULUS", REAL)
    poissons_ratio: float | None = arg("POISSONS_RATIO", REAL)


@dataclass(frozen=True)
class FePart(Statement, keyword="FE_PART", switch="on"):
    """FE_PART: a beam of large motion through nodes."""

    type: str | None = arg("TYPE", TEXT, required=True)
    qg: Vector = arg("QG", REALS, (0.0, 0.0, 0.0), count=3, dimension="length")
    reuler: Vector | None = arg("REULER", REALS, count=3, dimension="angle")
    node_labels: tuple[int, ...] = arg("NODE_LABELS", IDS, (), count=(1, 1000), required=True)
    coordinates: Vector = arg("COORDINATES", REALS, (), count=(1, 7000), dimension="angle", required=True)
    section: Vector = arg("SECTION", REALS, (), count=(1, 6000), required=True)
    material: int | None = arg("MATERIAL", ID, required=True)
    cratiok: float = arg("CRATIOK", REAL, 0.0, dimension="time", unsigned=True)
    cratiom: float = arg("CRATIOM", REAL, 0.0, instead="CRATIOK, or forces against the velocity at markers on nodes")
    preload: str | None = arg("PRELOAD", TEXT, instead="a GFORCE at its ends")

    zg: ClassVar[None] = None
    xg: ClassVar[None] = None


@dataclass(frozen=True)
class FeNode(Statement, keyword="FE_NODE", read=False):
    """A node of an FE_PART that has been built; the FE_NODE statements of a deck repeat what its FE_PART says."""

    part: str = ""

    def label(self) -> str:
        """Return the part and the number of the node."""
        return f"{self.part}, node {self.id % NODES}"


@dataclass(frozen=True)
class FeLoad(Statement, keyword="FE_LOAD", switch="acts"):
    """FE_LOAD: force and torque a length on an FE_PART."""

    fe_part: int | None = arg("FE_PART", ID, required=True)
    rm: int | None = arg("RM", ID)
    function: str | None = arg("FUNCTION", EXPRESSION, instead="FX to TZ with expressions, which may contain S")
    routine: str | None = arg("ROUTINE", TEXT)
    fx: str | None = arg("FX", EXPRESSION)
    fy: str | None = arg("FY", EXPRESSION)
    fz: str | None = arg("FZ", EXPRESSION)
    tx: str | None = arg("TX", EXPRESSION)
    ty: str | None = arg("TY", EXPRESSION)
    tz: str | None = arg("TZ", EXPRESSION)


@dataclass(frozen=True)
class Mforce(Statement, subroutine="MFOSUB", switch="acts"):
    """MFORCE: a distribution of forces on a FLEX_BODY."""

    flex_body: int | None = arg("FLEX_BODY", ID, required=True)
    jfloat: int | None = arg("JFLOAT", ID)
    case_index: int | None = arg("CASE_INDEX", INT)
    scale: str | None = arg("SCALE", EXPRESSION)
    force: str | None = arg("FORCE", EXPRESSION)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)
    shares: tuple[str, ...] = field(default=(), kw_only=True)
