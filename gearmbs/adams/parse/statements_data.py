"""Statements of a deck as typed records: data, requests, settings and output."""

# `arg` returns a dataclass field; the linter takes it for a default value
# ruff: noqa: RUF009

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.adams.parse.grammar import (
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
from gearmbs.adams.parse.statement import Statement, Vector


@dataclass(frozen=True)
class Variable(Statement):
    """VARIABLE: an algebraic variable given by an expression."""

    ic: float | None = arg("IC", REAL)
    function: str | None = arg("FUNCTION", EXPRESSION)
    routine: str | None = arg("ROUTINE", TEXT)


@dataclass(frozen=True)
class Diff(Statement):
    """DIFF: a first-order differential equation."""

    ic: Vector = arg("IC", REALS, (0.0,), count=(1, 2))
    function: str | None = arg("FUNCTION", EXPRESSION)
    implicit: bool = arg("IMPLICIT", FLAG, False)
    static_hold: bool = arg("STATIC_HOLD", FLAG, False)
    routine: str | None = arg("ROUTINE", TEXT)


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
class PlantInput(Plant, keyword="PINPUT"):
    """PINPUT."""


@dataclass(frozen=True)
class PlantOutput(Plant, keyword="POUTPUT"):
    """POUTPUT."""


@dataclass(frozen=True)
class RequestType:
    """A standard type of REQUEST.

    Attributes
    ----------
    number : int
        In request files.
    functions : tuple of str
        Functions behind the eight columns.
    dimensions : tuple of str
        Of the first four columns and of the others.
    """

    number: int
    functions: tuple[str, str, str, str, str, str, str, str]
    dimensions: tuple[str, str]


REQUEST_TYPES = {
    "DISPLACEMENT": RequestType(1, ("DM", "DX", "DY", "DZ", "", "PSI", "THETA", "PHI"), ("length", "angle")),
    "VELOCITY": RequestType(2, ("VM", "VX", "VY", "VZ", "WM", "WX", "WY", "WZ"), ("velocity", "angular_velocity")),
    "ACCELERATION": RequestType(
        3, ("ACCM", "ACCX", "ACCY", "ACCZ", "WDTM", "WDTX", "WDTY", "WDTZ"), ("acceleration", "angular_acceleration")
    ),
    "FORCE": RequestType(4, ("FM", "FX", "FY", "FZ", "TM", "TX", "TY", "TZ"), ("force", "torque")),
}
"""All that reads, checks, evaluates or writes a REQUEST takes its type from here."""


@dataclass(frozen=True)
class Request(Statement):
    """REQUEST: what the request file holds."""

    type: str | None = arg(
        "type",
        CHOICE,
        choices=" ".join(REQUEST_TYPES),
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
class InitialConditions(Statement, keyword="IC"):
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
    gr521sav: bool = arg("GR521SAV", FLAG, False)
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
    nofloatingmarkers: bool = arg("NOFLOATINGMARKERS", FLAG, False)
    nocontacts: bool = arg("NOCONTACTS", FLAG, False)
    notires: bool = arg("NOTIRES", FLAG, False)
    norequests: bool = arg("NOREQUESTS", FLAG, False)
    comment: str | None = arg("COMMENT", TEXT)
