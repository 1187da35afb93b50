"""Statements of a deck as typed records: contacts and the solids that touch."""

# `arg` returns a dataclass field; the linter takes it for a default value

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.adams.parse.grammar import CHOICE, FLAG, ID, IDS, INT, PATH, REAL, TEXT, WORD, arg
from gearmbs.adams.parse.statement import Statement

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
