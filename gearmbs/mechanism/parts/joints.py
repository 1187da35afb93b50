"""Joints: which constraint terms each one is made of.

A joint connects markers I and J. A row is a list of (term, axes or component, coefficient, swapped),
where *swapped* exchanges the roles of I and J.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.attributes import OwnAttributes
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.functions import TimeFunction

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
class Joint(OwnAttributes):
    """A joint, primitive, coupler or motion: a name and its constraint rows."""

    name: str
    kind: str
    i: Marker
    j: Marker
    rows: list[Row] = field(default_factory=list)
    prescribed: Prescribed | None = None

    settled = ("name", "kind", "i", "j")

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


@dataclass(frozen=True)
class JointKind:
    """What there is to know of a kind of joint that needs nothing but its two markers.

    Attributes
    ----------
    rows : callable
        ``rows(i, j)`` returns the constraint rows.
    angle, displacement : bool
        Whether I turns about z_J, or moves along it, in a way that can be counted and measured.
    crossed : bool
        Whether z_I and z_J are at right angles.
    adams : tuple of str, optional
        Statement and type in an ADAMS deck, as ``("JOINT", "REVOLUTE")``.
    """

    rows: Callable[[Marker, Marker], list[Row]]
    angle: bool = False
    displacement: bool = False
    crossed: bool = False
    adams: tuple[str, str] | None = None


JOINTS: dict[str, JointKind] = {
    "fixed": JointKind(lambda i, j: [*at_point(i, j), *same_orientation(i, j)], adams=("JOINT", "FIXED")),
    "revolute": JointKind(lambda i, j: [*at_point(i, j), *parallel_z(i, j)], angle=True, adams=("JOINT", "REVOLUTE")),
    "spherical": JointKind(at_point, adams=("JOINT", "SPHERICAL")),
    "self_aligning": JointKind(at_point, angle=True),
    "cylindrical": JointKind(
        lambda i, j: [*in_line(i, j), *parallel_z(i, j)],
        angle=True,
        displacement=True,
        adams=("JOINT", "CYLINDRICAL"),
    ),
    "translational": JointKind(
        lambda i, j: [*in_line(i, j), *same_orientation(i, j)], displacement=True, adams=("JOINT", "TRANSLATIONAL")
    ),
    "universal": JointKind(
        lambda i, j: [*at_point(i, j), axes_normal(i, j, Z, Z)], crossed=True, adams=("JOINT", "UNIVERSAL")
    ),
    "planar": JointKind(lambda i, j: [in_plane(i, j), *parallel_z(i, j)], angle=True, adams=("JOINT", "PLANAR")),
    "constant_velocity": JointKind(lambda i, j: [*at_point(i, j), homokinetic(i, j)], adams=("JOINT", "CONVEL")),
    "pin_slot": JointKind(lambda i, j: [in_plane(i, j, Y), in_plane(i, j, Z), *parallel_z(i, j)], angle=True),
    "at_point": JointKind(at_point, adams=("JPRIM", "ATPOINT")),
    "inline": JointKind(in_line, displacement=True, adams=("JPRIM", "INLINE")),
    "inplane": JointKind(lambda i, j: [in_plane(i, j)], adams=("JPRIM", "INPLANE")),
    "orientation": JointKind(same_orientation, adams=("JPRIM", "ORIENTATION")),
    "parallel_axes": JointKind(parallel_z, angle=True, adams=("JPRIM", "PARALLEL_AXES")),
    "perpendicular": JointKind(lambda i, j: [axes_normal(i, j, Z, Z)], crossed=True, adams=("JPRIM", "PERPENDICULAR")),
}
"""The joints and primitives that need nothing but their two markers, by the name of their kind."""

LARGEST_COSINE = 0.7
"""Largest cosine of the angle between two axes that are to be turned to right angles.

Axes nearer to parallel do not define the plane to turn in."""


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
    return [*in_line(i, j), *parallel_z(i, j), Row(f"advance {pitch:g} m a turn", advance)]


def kinds_with_angle() -> list[str]:
    """Return the kinds of joints that have a rotation of I about z_J that can be counted."""
    return [*(kind for kind, known in JOINTS.items() if known.angle), "screw"]


def kinds_with_displacement() -> list[str]:
    """Return the kinds of joints whose coordinate is, or contains, the displacement of I along z_J."""
    return [kind for kind, known in JOINTS.items() if known.displacement]


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
