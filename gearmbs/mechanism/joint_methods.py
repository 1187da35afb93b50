"""Joints and motions of a Mechanism."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts import joints as jt
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.functions import TimeFunction, as_function, constant
from gearmbs.mechanism.parts.quantities import Vector, frame_along, keeps_given, quantity, vector

if TYPE_CHECKING:
    from gearmbs.mechanism.parts.elements import ForceElement, Load


class JointMethods:
    """The part of :class:`gearmbs.mechanism.Mechanism` that adds joints and motions."""

    name: str
    ground: Body
    bodies: dict[str, Body]
    joints: dict[str, jt.Joint]
    elements: dict[str, ForceElement | Load]
    constraints: dict[str, str]

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
    ) -> jt.Joint:
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

        Raises
        ------
        ModelError
            For an unknown kind, a name in use, foreign bodies, a joint of a body with itself, or axes that should be at
            right angles and are nearly parallel.
        """
        if kind not in jt.JOINTS:
            raise ModelError(f"joint '{name}': kind {kind!r} is unknown; choose one of {', '.join(jt.JOINTS)}")
        label = f"{kind.replace('_', ' ')} joint '{name}'"
        crossed = jt.JOINTS[kind].crossed
        if crossed and axis_j is None and not (isinstance(i, Marker) and isinstance(j, Marker)):
            raise ModelError(
                f"{label}: it needs two axes at right angles, one on each body; give axis=... (on I) and axis_j=... "
                "(on J), or two markers with such z axes"
            )
        if axis_j is not None and not crossed:
            kinds = " and ".join(k for k, v in jt.JOINTS.items() if v.crossed)
            raise ModelError(f"{label}: axis_j is for {kinds} joints; others have one axis")
        mi, mj = self._markers(label, name, i, j, at, axis, axis_j)
        with _markers_kept_if_added((mi, mj), (i, j)):
            if crossed:
                jt.check_crossed(label, mi, mj)
            try:
                rows = jt.JOINTS[kind].rows(mi, mj)
            except ModelError:
                raise
            except Exception as error:
                reason = f"{type(error).__name__}: {error}"
                raise ModelError(f"{label}: the rows of JOINTS[{kind!r}] fail with {reason}") from error
            return self._add_joint(jt.Joint(name, kind, mi, mj, rows))

    def fixed(self, name, i, j, **where) -> jt.Joint:
        """Add a fixed joint: no relative motion. See :meth:`joint`."""
        return self.joint("fixed", name, i, j, **where)

    def revolute(self, name, i, j, **where) -> jt.Joint:
        """Add a revolute joint: rotation about the common z axis. See :meth:`joint`."""
        return self.joint("revolute", name, i, j, **where)

    def spherical(self, name, i, j, **where) -> jt.Joint:
        """Add a spherical joint: a common point. See :meth:`joint`."""
        return self.joint("spherical", name, i, j, **where)

    def cylindrical(self, name, i, j, **where) -> jt.Joint:
        """Add a cylindrical joint: rotation about and translation along z_J. See :meth:`joint`."""
        return self.joint("cylindrical", name, i, j, **where)

    def translational(self, name, i, j, **where) -> jt.Joint:
        """Add a translational joint along z_J. See :meth:`joint`."""
        return self.joint("translational", name, i, j, **where)

    def universal(self, name, i, j, **where) -> jt.Joint:
        """Add a universal joint whose cross arms are z_I and z_J: ``axis`` and ``axis_j``. See :meth:`joint`."""
        return self.joint("universal", name, i, j, **where)

    def planar(self, name, i, j, **where) -> jt.Joint:
        """Add a planar joint: motion in the xy plane of J. See :meth:`joint`."""
        return self.joint("planar", name, i, j, **where)

    @keeps_given
    def screw(self, name, i, j, *, pitch: float, at: Vector | None = None, axis: Vector | None = None) -> jt.Joint:
        """Add a screw joint: I advances ``pitch`` metres along z_J a turn."""
        pitch = quantity(pitch, "length", f"joint '{name}': pitch")
        mi, mj = self._markers(f"joint '{name}'", name, i, j, at, axis)
        with _markers_kept_if_added((mi, mj), (i, j)):
            return self._add_joint(jt.Joint(name, "screw", mi, mj, jt.screw_rows(mi, mj, pitch)))

    @keeps_given
    def distance(self, name: str, i: Marker, j: Marker, length: float | None = None) -> jt.Joint:
        """Keep the origins of two markers ``length`` metres apart (default: as they are)."""
        self._check_name(name)
        if length is None:
            length = float(np.linalg.norm(i.global_position() - j.global_position()))
        length = quantity(length, "length", f"joint '{name}': length")
        if not length > 0.0:
            raise ModelError(f"joint '{name}': length = {length} m; a distance joint needs a positive length")
        row = jt.Row(f"distance {length:g} m", (jt.Term(terms.DISTANCE, i, j),), constant(length))
        return self._add_joint(jt.Joint(name, "distance", i, j, [row]))

    def coupler(self, name: str, parts: list[tuple[jt.Joint, float]], offset: float | None = None) -> jt.Joint:
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
        row_terms = tuple(jt.coordinate_term(joint, coefficient) for joint, coefficient in parts)
        if offset is None:
            offset = sum(t.coefficient * jt.initial_coordinate(t) for t in row_terms)
        row = jt.Row("coupled coordinates", row_terms, constant(offset))
        return self._add_joint(jt.Joint(name, "coupler", parts[0][0].i, parts[0][0].j, [row]))

    def gear(self, name: str, first: jt.Joint, second: jt.Joint, ratio: float) -> jt.Joint:
        """Let the second joint turn ``ratio`` times as fast as the first, both about their own z_J (see coupler).

        Two outside gears on parallel axes of one direction have ratio = -z1/z2.
        """
        return self.coupler(name, [(first, quantity(ratio, "dimensionless", f"gear '{name}': ratio")), (second, -1.0)])

    @keeps_given
    def rack_pinion(self, name: str, pinion: jt.Joint, rack: jt.Joint, radius: float) -> jt.Joint:
        """Let the rack's joint move ``radius`` metres along its z_J for each radian of the pinion's.

        The radius is negative where a positive turn drives the rack against its z axis.
        """
        if rack.kind != "translational":
            raise ModelError(f"rack and pinion '{name}': joint '{rack.name}' is {rack.kind}; it must be translational")
        size = quantity(radius, "length", f"rack and pinion '{name}': radius")
        return self.coupler(name, [(pinion, size), (rack, -1.0)])

    @keeps_given
    def rotation(
        self, name: str, joint: jt.Joint, function: float | str | TimeFunction, *, level: str = "displacement",
        start: float | None = None, rate: float = 0.0,
    ) -> jt.Joint:  # fmt: skip
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
        given = self._prescribed(name, function, level, start, rate, jt.coordinate_term(joint, 1.0), "rad")
        moved = _displacement(name, function, given, "rad")
        row = jt.Row("angle", (jt.Term(terms.ROTATION, joint.i, joint.j),), None, moved)
        return self._add_joint(jt.Joint(name, "rotation", joint.i, joint.j, [row], given))

    @keeps_given
    def translation(
        self, name: str, joint: jt.Joint, function: float | str | TimeFunction, *, level: str = "displacement",
        start: float | None = None, rate: float = 0.0,
    ) -> jt.Joint:  # fmt: skip
        """Prescribe the displacement of I along z_J of a joint; as :meth:`rotation`, in m, m/s or m/s^2."""
        self._check_joint(name, joint, ("translational", "cylindrical"))
        along = jt.Term(terms.DOT2, joint.i, joint.j, jt.Z)
        given = self._prescribed(name, function, level, start, rate, along, "m")
        row = jt.Row("displacement", (along,), _displacement(name, function, given, "m"))
        return self._add_joint(jt.Joint(name, "translation", joint.i, joint.j, [row], given))

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
            mi = i if isinstance(i, Marker) else i.marker_at(*where, name=f"{name}.I")
            mj = j if isinstance(j, Marker) else j.marker_at(*where, name=f"{name}.J")
        else:
            at = (j if i.is_ground else i).position if at is None else vector(at, f"{label}: at", "length")
            frame = frame_along((0.0, 0.0, 1.0) if axis is None else axis, f"{label}: axis")
            mi = i.marker_at(at, frame, name=f"{name}.I")
            mj = j.marker_at(at, frame if axis_j is None else frame_along(axis_j, f"{label}: axis_j"), name=f"{name}.J")
        if mi.body is mj.body:
            raise ModelError(f"{label}: both markers are on body '{mi.body.name}'; a joint connects two bodies")
        return mi, mj

    def _prescribed(
        self, name: str, function: float | str | TimeFunction, level: str, start: float | None, rate: float,
        term: jt.Term, unit: str,
    ) -> jt.Prescribed | None:  # fmt: skip
        """Return what a motion is given by, None for its displacement."""
        if level == "displacement":
            return None
        if level not in ("velocity", "acceleration"):
            raise ModelError(f"motion '{name}': level {level!r}; choose displacement, velocity or acceleration")
        label = f"motion '{name}'"
        first = jt.initial_coordinate(term) if start is None else quantity(start, unit, f"{label}: start")
        given = as_function(function, f"{unit}/s" if level == "velocity" else f"{unit}/s^2", label)
        return jt.Prescribed(level, given, first, quantity(rate, f"{unit}/s", f"{label}: rate"))

    def _check_joint(self, name: str, joint: jt.Joint, kinds: tuple[str, ...]) -> None:
        self._check_name(name)
        if self.joints.get(getattr(joint, "name", "")) is not joint:
            raise ModelError(f"motion '{name}': {joint!r} is not a joint of mechanism '{self.name}'")
        if joint.kind not in kinds:
            raise ModelError(f"motion '{name}': joint '{joint.name}' is {joint.kind}; it must be {' or '.join(kinds)}")

    def _check_body(self, label: str, body: Body) -> None:
        if not isinstance(body, Body):
            raise ModelError(f"{label}: {body!r} is not a body or a marker")
        if body is not self.ground and self.bodies.get(body.name) is not body:
            raise ModelError(f"{label}: body '{body.name}' does not belong to mechanism '{self.name}'")

    def _check_name(self, name: str) -> None:
        if not isinstance(name, str) or not name:
            raise ModelError(f"name {name!r}: give a text that is not empty")
        for title, table in (("joint", self.joints), ("load", self.elements), ("constraint", self.constraints)):
            if name in table:
                kind = getattr(table[name], "kind", title)
                raise ModelError(f"name {name!r}: it is in use by a {title} ({kind}); choose another")

    def _add_joint(self, joint: jt.Joint) -> jt.Joint:
        self._check_name(joint.name)
        bodies = joint.i.body, joint.j.body
        for body in bodies:
            self._check_body(f"joint '{joint.name}'", body)
        for body in bodies:
            body.check(joint)
        self.joints[joint.name] = joint
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
    name: str, function: float | str | TimeFunction, given: jt.Prescribed | None, unit: str
) -> TimeFunction:
    """Return the displacement of a motion, whatever its function gives."""
    if given is None:
        return as_function(function, unit, f"motion '{name}'")
    return given.function.integral(given.start, None if given.level == "velocity" else given.rate)
