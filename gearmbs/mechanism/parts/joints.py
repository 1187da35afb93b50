"""Joints: which constraint terms each one is made of, and the methods of a Mechanism that add joints and motions.

A joint connects markers I and J. A row is a list of (term, axes or component, coefficient, swapped),
where *swapped* exchanges the roles of I and J.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Never

import numpy as np

from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Body, Marker, OwnAttributes
from gearmbs.mechanism.parts.functions import TimeFunction, as_function, constant
from gearmbs.mechanism.parts.quantities import Vector, frame_along, keeps_given, quantity, vector
from gearmbs.units import QuantityLike

if TYPE_CHECKING:
    from gearmbs.mechanism.parts.constraint_laws import GeneralConstraint
    from gearmbs.mechanism.parts.elements import ForceElement, Load

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
    """What there is to know of a kind of joint that needs nothing but its two markers, and numbers.

    Attributes
    ----------
    rows : callable
        ``rows(i, j, **numbers)`` returns the constraint rows.
    angle, displacement : bool
        Whether I turns about z_J, or moves along it, in a way that can be counted and measured.
    crossed : bool
        Whether z_I and z_J are at right angles.
    adams : tuple of str, optional
        Statement and type in an ADAMS deck, as ``("JOINT", "REVOLUTE")``.
    numbers : mapping of str to str
        Units of the numbers that the rows take by name, as ``{"radius": "m"}``.
    """

    rows: Callable[..., list[Row]]
    angle: bool = False
    displacement: bool = False
    crossed: bool = False
    adams: tuple[str, str] | None = None
    numbers: Mapping[str, str] = field(default_factory=dict)

    def read(self, label: str, given: Mapping[str, QuantityLike]) -> dict[str, float]:
        """Return the numbers of a joint in SI; raise a ModelError for one that is missing or unknown."""
        if given.keys() != self.numbers.keys():
            takes = ", ".join(f"{name} ({unit})" for name, unit in self.numbers.items()) or "none"
            raise ModelError(f"{label}: numbers = {dict(given)}; it takes {takes}, as numbers={{name: value}}")
        return {name: quantity(given[name], unit, f"{label}: {name}") for name, unit in self.numbers.items()}


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
    "forks": JointKind(lambda i, j: [axes_normal(i, j, X, Y)]),
    "perpendicular": JointKind(lambda i, j: [axes_normal(i, j, Z, Z)], crossed=True, adams=("JPRIM", "PERPENDICULAR")),
}
"""The joints and primitives that need nothing but their two markers, and numbers, by the name of their kind."""

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


class JointMethods:
    """The part of :class:`gearmbs.mechanism.Mechanism` that adds joints and motions."""

    name: str
    ground: Body
    bodies: dict[str, Body]
    joints: dict[str, Joint]
    elements: dict[str, ForceElement | Load]
    constraints: dict[str, GeneralConstraint]
    _take_inputs: Callable[..., None]

    @keeps_given
    def joint(
        self,
        kind: str,
        name: str,
        i: Body | Marker,
        j: Body | Marker,
        *,
        at: Vector | None = None,
        axis: Vector | None = None,
        axis_j: Vector | None = None,
        numbers: Mapping[str, QuantityLike] | None = None,
    ) -> Joint:
        """Add a joint of one of the kinds in :data:`gearmbs.mechanism.parts.joints.JOINTS`.

        Parameters
        ----------
        i, j : Body or Marker
            What the joint connects. With bodies, ``at`` (default: the origin of ``i``) and ``axis`` (default: z)
            place a marker on each, in global components at the initial position. If one is a marker and the other a
            body, a marker that coincides with the given one is placed on the body.
        axis_j : array_like, optional
            Axis on ``j`` at the initial position, at a right angle to ``axis``: for universal joints and the
            perpendicular primitive between bodies, which need two.
        numbers : mapping, optional
            Of a kind that takes some, as a radius: values by name, in SI or as text with a unit.

        Raises
        ------
        ModelError
            For an unknown kind, a name in use, foreign bodies, a joint of a body with itself, axes that should be at
            right angles and are nearly parallel, or numbers that are missing or unknown.
        """
        if kind not in JOINTS:
            raise ModelError(f"joint '{name}': kind {kind!r} is unknown; choose one of {', '.join(JOINTS)}")
        label = f"{kind.replace('_', ' ')} joint '{name}'"
        crossed = JOINTS[kind].crossed
        if crossed and axis_j is None and not (isinstance(i, Marker) and isinstance(j, Marker)):
            raise ModelError(
                f"{label}: it needs two axes at right angles, one on each body; give axis=... (on I) and axis_j=... "
                "(on J), or two markers with such z axes"
            )
        if axis_j is not None and not crossed:
            kinds = " and ".join(k for k, v in JOINTS.items() if v.crossed)
            raise ModelError(f"{label}: axis_j is for {kinds} joints; others have one axis")
        mi, mj = self._markers(label, name, i, j, at, axis, axis_j)
        with _markers_kept_if_added((mi, mj), (i, j)):
            if crossed:
                check_crossed(label, mi, mj)
            read = JOINTS[kind].read(label, numbers or {})
            try:
                rows = JOINTS[kind].rows(mi, mj, **read)
            except ModelError:
                raise
            except Exception as error:
                reason = f"{type(error).__name__}: {error}"
                raise ModelError(f"{label}: the rows of JOINTS[{kind!r}] fail with {reason}") from error
            return self._add_joint(name, kind, mi, mj, rows)

    def fixed(
        self, name: str, i: Body | Marker, j: Body | Marker, *, at: Vector | None = None, axis: Vector | None = None,
        **more: Never,
    ) -> Joint:  # fmt: skip
        """Add a fixed joint: no relative motion. See :meth:`joint`."""
        return self.joint("fixed", name, i, j, at=at, axis=axis, **more)

    def revolute(
        self, name: str, i: Body | Marker, j: Body | Marker, *, at: Vector | None = None, axis: Vector | None = None,
        **more: Never,
    ) -> Joint:  # fmt: skip
        """Add a revolute joint: rotation about the common z axis. See :meth:`joint`."""
        return self.joint("revolute", name, i, j, at=at, axis=axis, **more)

    def spherical(
        self, name: str, i: Body | Marker, j: Body | Marker, *, at: Vector | None = None, axis: Vector | None = None,
        **more: Never,
    ) -> Joint:  # fmt: skip
        """Add a spherical joint: a common point. See :meth:`joint`."""
        return self.joint("spherical", name, i, j, at=at, axis=axis, **more)

    def cylindrical(
        self, name: str, i: Body | Marker, j: Body | Marker, *, at: Vector | None = None, axis: Vector | None = None,
        **more: Never,
    ) -> Joint:  # fmt: skip
        """Add a cylindrical joint: rotation about and translation along z_J. See :meth:`joint`."""
        return self.joint("cylindrical", name, i, j, at=at, axis=axis, **more)

    def translational(
        self, name: str, i: Body | Marker, j: Body | Marker, *, at: Vector | None = None, axis: Vector | None = None,
        **more: Never,
    ) -> Joint:  # fmt: skip
        """Add a translational joint along z_J. See :meth:`joint`."""
        return self.joint("translational", name, i, j, at=at, axis=axis, **more)

    def universal(
        self, name: str, i: Body | Marker, j: Body | Marker, *, at: Vector | None = None, axis: Vector | None = None,
        axis_j: Vector | None = None,
    ) -> Joint:  # fmt: skip
        """Add a universal joint whose cross arms are z_I and z_J: ``axis`` and ``axis_j``. See :meth:`joint`."""
        return self.joint("universal", name, i, j, at=at, axis=axis, axis_j=axis_j)

    def planar(
        self, name: str, i: Body | Marker, j: Body | Marker, *, at: Vector | None = None, axis: Vector | None = None,
        **more: Never,
    ) -> Joint:  # fmt: skip
        """Add a planar joint: motion in the xy plane of J. See :meth:`joint`."""
        return self.joint("planar", name, i, j, at=at, axis=axis, **more)

    @keeps_given
    def screw(
        self, name: str, i: Body | Marker, j: Body | Marker, *, pitch: QuantityLike, at: Vector | None = None,
        axis: Vector | None = None,
    ) -> Joint:  # fmt: skip
        """Add a screw joint: I advances ``pitch`` metres along z_J a turn."""
        pitch = quantity(pitch, "length", f"joint '{name}': pitch")
        mi, mj = self._markers(f"joint '{name}'", name, i, j, at, axis)
        with _markers_kept_if_added((mi, mj), (i, j)):
            return self._add_joint(name, "screw", mi, mj, screw_rows(mi, mj, pitch))

    @keeps_given
    def distance(self, name: str, i: Marker, j: Marker, length: QuantityLike | None = None) -> Joint:
        """Keep the origins of two markers ``length`` metres apart (default: as they are)."""
        self._check_name(name)
        if length is None:
            length = float(np.linalg.norm(i.global_position() - j.global_position()))
        length = quantity(length, "length", f"joint '{name}': length")
        if not length > 0.0:
            raise ModelError(f"joint '{name}': length = {length} m; a distance joint needs a positive length")
        row = Row(f"distance {length:g} m", (Term(terms.DISTANCE, i, j),), constant(length))
        return self._add_joint(name, "distance", i, j, [row])

    def coupler(self, name: str, parts: list[tuple[Joint, float]], offset: QuantityLike | None = None) -> Joint:
        """Couple joint coordinates linearly: sum of coefficient x coordinate stays at its initial value.

        A coordinate is the angle (rad) of a revolute or cylindrical joint or the displacement (m) of a
        translational one. Gears are couplers of two angles; a rack and pinion couples an angle (coefficient: pitch
        radius) and a displacement.

        Parameters
        ----------
        parts : list of (Joint, float)
            Two or more joints with their coefficients.
        offset : float, optional
            Value of the sum; default: the one at the initial position.
        """
        if len(parts) < 2:
            raise ModelError(f"coupler '{name}': it needs at least two joints")
        row_terms = tuple(coordinate_term(joint, coefficient) for joint, coefficient in parts)
        if offset is None:
            offset = sum(t.coefficient * initial_coordinate(t) for t in row_terms)
        row = Row("coupled coordinates", row_terms, constant(offset))
        return self._add_joint(name, "coupler", parts[0][0].i, parts[0][0].j, [row])

    def gear(self, name: str, first: Joint, second: Joint, ratio: float) -> Joint:
        """Let the second joint turn ``ratio`` times as fast as the first, both about their own z_J (see coupler).

        Two outside gears on parallel axes of one direction have ratio = -z1/z2.
        """
        return self.coupler(name, [(first, quantity(ratio, "dimensionless", f"gear '{name}': ratio")), (second, -1.0)])

    @keeps_given
    def rack_pinion(self, name: str, pinion: Joint, rack: Joint, radius: QuantityLike) -> Joint:
        """Let the rack's joint move ``radius`` metres along its z_J for each radian of the pinion's.

        The radius is negative where a positive turn drives the rack against its z axis.
        """
        if rack.kind != "translational":
            raise ModelError(f"rack and pinion '{name}': joint '{rack.name}' is {rack.kind}; it must be translational")
        size = quantity(radius, "length", f"rack and pinion '{name}': radius")
        return self.coupler(name, [(pinion, size), (rack, -1.0)])

    @keeps_given
    def rotation(
        self, name: str, joint: Joint, function: QuantityLike | TimeFunction, *, level: str = "displacement",
        start: QuantityLike | None = None, rate: QuantityLike = 0.0,
    ) -> Joint:  # fmt: skip
        """Prescribe the rotation of I about z_J of a joint as a function of time.

        Parameters
        ----------
        function : float, str or TimeFunction
            rad, or rad/s, rad/s^2 for the other levels.
        level : {"displacement", "velocity", "acceleration"}
            What the function gives.
        start : float, optional
            Angle at time 0 for velocities and accelerations, rad; default: as the bodies are.
        rate : float
            Angular velocity at time 0 for accelerations, rad/s.
        """
        self._check_joint(name, joint, ("revolute", "cylindrical", "self_aligning"))
        given = self._prescribed(name, function, level, start, rate, coordinate_term(joint, 1.0), "rad")
        moved = _displacement(name, function, given, "rad")
        row = Row("angle", (Term(terms.ROTATION, joint.i, joint.j),), None, moved)
        self._take_inputs(moved if given is None else given.function)
        return self._add_joint(name, "rotation", joint.i, joint.j, [row], given)

    @keeps_given
    def translation(
        self, name: str, joint: Joint, function: QuantityLike | TimeFunction, *, level: str = "displacement",
        start: QuantityLike | None = None, rate: QuantityLike = 0.0,
    ) -> Joint:  # fmt: skip
        """Prescribe the displacement of I along z_J of a joint; as :meth:`rotation`, in m, m/s or m/s^2."""
        self._check_joint(name, joint, ("translational", "cylindrical"))
        along = Term(terms.DOT2, joint.i, joint.j, Z)
        given = self._prescribed(name, function, level, start, rate, along, "m")
        row = Row("displacement", (along,), _displacement(name, function, given, "m"))
        self._take_inputs(row.function if given is None else given.function)
        return self._add_joint(name, "translation", joint.i, joint.j, [row], given)

    # --- checks -----------------------------------------------------------------------------------

    def _markers(self, label, name, i, j, at, axis, axis_j=None) -> tuple[Marker, Marker]:
        self._check_name(name)
        for part in (i, j):
            self._check_body(label, part.body if isinstance(part, Marker) else part)
        given = [part for part in (i, j) if isinstance(part, Marker)]
        if given and not (at is None and axis is None and axis_j is None):
            raise ModelError(f"{label}: give either markers or bodies with `at` and `axis`, not both")
        if given:
            # a body gets a marker that lies on the other's
            where = given[0].global_position(), given[0].global_orientation()
            mi = i if isinstance(i, Marker) else i.placed_marker(*where, name=f"{name}.I")
            mj = j if isinstance(j, Marker) else j.placed_marker(*where, name=f"{name}.J")
        else:
            at = (j if i.is_ground else i).position if at is None else vector(at, f"{label}: at", "length")
            frame = frame_along((0.0, 0.0, 1.0) if axis is None else axis, f"{label}: axis")
            frame_j = frame if axis_j is None else frame_along(axis_j, f"{label}: axis_j")
            mi = i.placed_marker(at, frame, name=f"{name}.I")
            mj = j.placed_marker(at, frame_j, name=f"{name}.J")
        if mi.body is mj.body:
            raise ModelError(f"{label}: both markers are on body '{mi.body.name}'; a joint connects two bodies")
        return mi, mj

    def _prescribed(
        self, name: str, function: QuantityLike | TimeFunction, level: str, start: QuantityLike | None,
        rate: QuantityLike, term: Term, unit: str,
    ) -> Prescribed | None:  # fmt: skip
        """Return what a motion is given by, None for its displacement."""
        if level == "displacement":
            return None
        if level not in ("velocity", "acceleration"):
            raise ModelError(f"motion '{name}': level {level!r}; choose displacement, velocity or acceleration")
        label = f"motion '{name}'"
        first = initial_coordinate(term) if start is None else quantity(start, unit, f"{label}: start")
        given = as_function(function, f"{unit}/s" if level == "velocity" else f"{unit}/s^2", label)
        return Prescribed(level, given, first, quantity(rate, f"{unit}/s", f"{label}: rate"))

    def _check_joint(self, name: str, joint: Joint, kinds: tuple[str, ...]) -> None:
        self._check_name(name)
        if self.joints.get(getattr(joint, "name", "")) is not joint:
            raise ModelError(f"motion '{name}': {joint!r} is not a joint of mechanism '{self.name}'")
        if joint.kind not in kinds:
            raise ModelError(f"motion '{name}': joint '{joint.name}' is {joint.kind}; it must be {' or '.join(kinds)}")

    def _own_marker(self, label: str, part: Body | Marker, name: str) -> Marker:
        """Return a marker of this mechanism; a body gets one at its own frame."""
        self._check_body(label, part.body if isinstance(part, Marker) else part)
        return part if isinstance(part, Marker) else part.marker(name=name)

    def _check_body(self, label: str, body: Body) -> None:
        if not isinstance(body, Body):
            named = f"; its name stands for bodies[{body!r}]" if isinstance(body, str) and body in self.bodies else ""
            raise ModelError(f"{label}: {body!r} is not a body or a marker{named}")
        if body is not self.ground and self.bodies.get(body.name) is not body:
            raise ModelError(f"{label}: body '{body.name}' does not belong to mechanism '{self.name}'")

    def _check_name(self, name: str) -> None:
        if not isinstance(name, str) or not name:
            raise ModelError(f"name {name!r}: give a text that is not empty")
        for title, table in (("joint", self.joints), ("load", self.elements), ("constraint", self.constraints)):
            if name in table:
                kind = getattr(table[name], "kind", title)
                raise ModelError(f"name {name!r}: it is in use by a {title} ({kind}); choose another")

    def _add_joint(
        self, name: str, kind: str, i: Marker, j: Marker, rows: list[Row], prescribed: Prescribed | None = None
    ) -> Joint:
        self._check_name(name)
        bodies = i.body, j.body
        for body in bodies:
            self._check_body(f"joint '{name}'", body)
        joint = Joint(name, kind, i, j, rows, prescribed)
        for body in bodies:
            body.check(joint)
        self.joints[name] = joint
        return joint


@contextmanager
def _markers_kept_if_added(used: tuple[Marker, ...], given: tuple[Body | Marker, ...]) -> Iterator[None]:
    """Remove the markers made for a joint if it is refused: they would be in the way of the next attempt."""
    try:
        yield
    except ModelError:
        for marker in used:
            if not any(marker is part for part in given):
                marker.body.markers.remove(marker)
        raise


def _displacement(
    name: str, function: QuantityLike | TimeFunction, given: Prescribed | None, unit: str
) -> TimeFunction:
    """Return the displacement of a motion, whatever its function gives."""
    if given is None:
        return as_function(function, unit, f"motion '{name}'")
    return given.function.integral(given.start, None if given.level == "velocity" else given.rate)
