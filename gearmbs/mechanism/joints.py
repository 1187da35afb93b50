"""Joints: which constraint terms each one is made of.

A joint connects markers I and J. A row is a list of (term, axes or component, coefficient, swapped),
where *swapped* exchanges the roles of I and J.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearmbs.dae.equations import constraint_terms as terms
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.functions import TimeFunction
from gearmbs.mechanism.parts import Marker

X, Y, Z = 0, 1, 2
AXIS = "xyz"


@dataclass(frozen=True)
class Term:
    """One term of a row: its kind, the axes (3 * of I + of J) or component, coefficient, markers."""

    kind: int
    i: Marker
    j: Marker
    axes: int = 0
    coefficient: float = 1.0


@dataclass(frozen=True)
class Row:
    """One scalar constraint: what it enforces, its terms, and the function of time or constant subtracted."""

    label: str
    terms: tuple[Term, ...]
    function: TimeFunction | None = None
    rotation: TimeFunction | None = None


@dataclass(frozen=True)
class Prescribed:
    """What a motion was given by, where it is not its displacement: SI values.

    Attributes
    ----------
    level : {"velocity", "acceleration"}
    function : TimeFunction
    start, rate : float
        Displacement and its rate at the start.
    """

    level: str
    function: TimeFunction
    start: float
    rate: float


@dataclass(eq=False)
class Joint:
    """A joint, primitive, coupler or motion: a name and its constraint rows."""

    name: str
    kind: str
    i: Marker
    j: Marker
    rows: list[Row] = field(default_factory=list)
    prescribed: Prescribed | None = None

    def __repr__(self) -> str:
        return f"Joint({self.name!r}, {self.kind}, I={self.i.name!r}, J={self.j.name!r}, {len(self.rows)} rows)"


def at_point(i: Marker, j: Marker) -> list[Row]:
    return [Row(f"coincident {AXIS[c]}", (Term(terms.POINT, i, j, c),)) for c in range(3)]


def axes_normal(i: Marker, j: Marker, a: int, b: int) -> Row:
    return Row(f"{AXIS[a]}_I normal to {AXIS[b]}_J", (Term(terms.DOT1, i, j, 3 * a + b),))


def parallel_z(i: Marker, j: Marker) -> list[Row]:
    return [axes_normal(i, j, Z, X), axes_normal(i, j, Z, Y)]


def in_plane(i: Marker, j: Marker, axis: int = Z) -> Row:
    return Row(f"no offset along {AXIS[axis]}_J", (Term(terms.DOT2, i, j, axis),))


def in_line(i: Marker, j: Marker) -> list[Row]:
    return [in_plane(i, j, X), in_plane(i, j, Y)]


def same_orientation(i: Marker, j: Marker) -> list[Row]:
    return [*parallel_z(i, j), axes_normal(i, j, X, Y)]


def homokinetic(i: Marker, j: Marker) -> Row:
    turn = (Term(terms.DOT1, i, j, 3 * X + Y, 1.0), Term(terms.DOT1, i, j, 3 * Y + X, -1.0))
    return Row("equal rotation about both shafts", turn)


JOINTS = {
    "fixed": lambda i, j: [*at_point(i, j), *same_orientation(i, j)],
    "revolute": lambda i, j: [*at_point(i, j), *parallel_z(i, j)],
    "spherical": at_point,
    "cylindrical": lambda i, j: [*in_line(i, j), *parallel_z(i, j)],
    "translational": lambda i, j: [*in_line(i, j), *same_orientation(i, j)],
    "universal": lambda i, j: [*at_point(i, j), axes_normal(i, j, Z, Z)],
    "planar": lambda i, j: [in_plane(i, j), *parallel_z(i, j)],
    "constant_velocity": lambda i, j: [*at_point(i, j), homokinetic(i, j)],
    "at_point": at_point,
    "inline": in_line,
    "inplane": lambda i, j: [in_plane(i, j)],
    "orientation": same_orientation,
    "parallel_axes": parallel_z,
    "perpendicular": lambda i, j: [axes_normal(i, j, Z, Z)],
}
"""Rows of the joints that need nothing but their two markers."""

CROSSED = ("universal", "perpendicular")
"""Kinds whose z axes are at right angles."""

LARGEST_COSINE = 0.7
"""Of the angle between axes to be put at right angles; nearer to parallel, nothing says which way to turn them."""


def check_crossed(label: str, i: Marker, j: Marker) -> None:
    """Raise a ModelError unless z_I and z_J are at the start about at right angles."""
    cosine = float(i.global_orientation()[:, 2] @ j.global_orientation()[:, 2])
    if abs(cosine) > LARGEST_COSINE:
        angle = np.degrees(np.arccos(min(1.0, abs(cosine))))
        raise ModelError(
            f"{label}: the axes z of '{i.name}' and '{j.name}' must be at right angles, not at {angle:.3g} degrees; "
            "turn one of the markers"
        )


def screw_rows(i: Marker, j: Marker, pitch: float) -> list[Row]:
    """Return a cylindrical joint that advances ``pitch`` metres a turn of I about z_J."""
    advance = (Term(terms.DOT2, i, j, Z), Term(terms.ANGLE, i, j, 0, -pitch / (2.0 * np.pi)))
    return [*JOINTS["cylindrical"](i, j), Row(f"advance {pitch:g} m a turn", advance)]


def coordinate_term(joint: Joint, coefficient: float) -> Term:
    """Return the free coordinate of a revolute (angle) or translational (displacement) joint as a term."""
    if joint.kind == "translational":
        return Term(terms.DOT2, joint.i, joint.j, Z, coefficient)
    return Term(terms.ANGLE, joint.i, joint.j, 0, coefficient)


def initial_angle(row: Row, term: Term) -> float:
    """Return the angle an angle term starts with: of a screw with as many turns as its displacement says."""
    angle = initial_coordinate(term)
    if row.function is not None or term.coefficient == 0.0:
        return angle
    rest = sum(t.coefficient * initial_coordinate(t) for t in row.terms if t is not term)
    turns = (-rest / term.coefficient - angle) / (2.0 * np.pi)
    return angle + 2.0 * np.pi * float(np.round(turns))


def initial_coordinate(term: Term) -> float:
    """Return the value at the initial position of an angle (principal value) or displacement term."""
    ai, aj = term.i.global_orientation(), term.j.global_orientation()
    if term.kind == terms.ANGLE:
        return float(np.arctan2(ai[:, 0] @ aj[:, 1], ai[:, 0] @ aj[:, 0]))
    return float(aj[:, 2] @ (term.i.global_position() - term.j.global_position()))
