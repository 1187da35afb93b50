"""Bodies fixed to each other as one: a mechanism with fewer bodies, and the way back to all of them.

The members of a group are moved by the same six coordinates. Their composite has their mass, their centre of mass and,
by Steiner's theorem, their inertia about it; markers, joints and loads keep their place on it. Where all that is left
turns about fixed axes, the angles alone are integrated; see `gearmbs.dae.equations.fixed_axes`.
"""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model.fixed_axes import ON_AXIS, Axis, fixed_axis_problem, starting_values
from gearmbs.dae.model.members import TURN_COLUMNS, TURN_I, TURN_J, TURN_ROOT, TURN_ROWS, TURN_SIDE
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.joints import Joint, Row
from gearmbs.mechanism.parts.modal import ModalBody

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members
    from gearmbs.dae.model.system import System
    from gearmbs.dae.problem import DAEProblem
    from gearmbs.mechanism.mechanism import Mechanism

# Which mechanisms consist of bodies that turn about fixed axes, each in one revolute joint on the ground.


Hinge = tuple[Joint, Joint | None]
"""The revolute joint of a body, and the motion that prescribes its angle."""


def hinges(bodies: Mapping[str, Body], joints: Collection[Joint], rows: Collection[str]) -> dict[str, Hinge] | None:
    """Return the hinge of each body, by its name, or None if some body moves in another way.

    Each body must have one revolute joint on the ground with all its rows, and at most a rotation about its axis, of
    that joint or between markers of its own; no other row may be kept.

    Parameters
    ----------
    bodies : mapping of str to Body
    joints : collection of Joint
        Motions among them.
    rows : collection of str
        Names of all constraint rows that are not redundant.
    """
    kept = {joint.name: sum(f"{joint.name}: {row.label}" in rows for row in joint.rows) for joint in joints}
    acting = [joint for joint in joints if kept[joint.name]]
    if sum(kept.values()) < len(rows) or any(not body.kind.lumps for body in bodies.values()):
        # a general constraint has rows, too
        return None
    found: dict[str, Hinge] = {}
    motions = []
    for joint in acting:
        moving = [body for body in (joint.i.body, joint.j.body) if not body.is_ground]
        if joint.kind == "rotation":
            motions.append(joint)
        elif joint.kind == "revolute" and kept[joint.name] == 5 and len(moving) == 1 and moving[0].name not in found:
            found[moving[0].name] = (joint, None)
        else:
            return None
    for motion in motions:
        name = motion.j.body.name if motion.i.body.is_ground else motion.i.body.name
        hinge = found.get(name)
        if hinge is None or hinge[1] is not None or not _turns_about(motion, hinge[0]):
            return None
        found[name] = (hinge[0], motion)
    return found if len(found) == len(bodies) else None


def _turns_about(motion: Joint, joint: Joint) -> bool:
    """Return whether a rotation is one of I about z_J of a joint: between the same bodies, with axes along its own.

    A rotation exerts a moment and no force, so that its markers may be anywhere.
    """
    pairs = ((motion.i, joint.i), (motion.j, joint.j))
    return all(
        a.body is b.body and np.abs(a.orientation[:, 2] - b.orientation[:, 2]).max() <= ON_AXIS for a, b in pairs
    )


def axes_of(system: System, found: dict[str, Hinge]) -> list[Axis]:
    """Return the axes of a system's bodies in their order."""
    at = {name: k for k, name in enumerate(system.row_names)}
    index = system.marker_index
    axes = []
    for name in system.body_names:
        joint, motion = found[name]
        row = None if motion is None else at[f"{motion.name}: {motion.rows[0].label}"]
        axes.append(Axis(index[id(joint.i)], index[id(joint.j)], not joint.i.body.is_ground, row))
    return axes


def turn_table(whole: System, system: System, found: dict[str, Hinge], starts: np.ndarray) -> np.ndarray:
    """Return the table of the joints by which records of all bodies are told; see `Members.turn`.

    ``starts`` has what the motions prescribe at the start.
    """
    at = {name: k for k, name in enumerate(whole.row_names)}
    table = np.full((len(found), TURN_COLUMNS), -1, dtype=np.int64)
    for row, axis, name, start in zip(table, axes_of(system, found), system.body_names, starts, strict=True):
        joint, motion = found[name]
        row[TURN_I], row[TURN_J], row[TURN_SIDE] = axis.i, axis.j, 1 if axis.turns_i else -1
        places = [at[f"{joint.name}: {r.label}"] for r in joint.rows]
        row[TURN_ROWS : TURN_ROWS + len(places)] = places
        if motion is not None:
            row[TURN_ROWS + 5] = at[f"{motion.name}: {motion.rows[0].label}"]
            row[TURN_ROOT] = _root(system, motion, start)
    return table


def _root(system: System, motion: Joint, start: float) -> int:
    """Return 1 if x_I starts where the motion has turned x_J to, -1 if it is opposite to it."""
    i, j = (_axes(system, marker) for marker in (motion.i, motion.j))
    return 1 if i[:, 0] @ (j[:, 0] * np.cos(start) + j[:, 1] * np.sin(start)) > 0.0 else -1


def _axes(system: System, marker: Marker) -> np.ndarray:
    """Return the axes of a marker at the start of an assembled system, as columns."""
    if marker.body.is_ground:
        return marker.orientation
    pose = system.pose[system.body_names.index(marker.body.name)]
    return pose[POSE_A:POSE_V].reshape(3, 3) @ marker.orientation


@dataclass(frozen=True)
class Lumped:
    """A mechanism whose bodies fixed to each other are integrated as one.

    Attributes
    ----------
    whole : System
        All bodies and joints, assembled: what results are about.
    system : System
        What is integrated.
    members : Members
        How the motions and reactions of the whole follow from those of the system.
    """

    whole: System
    system: System
    members: Members
    hinges: dict[str, Hinge] | None = None
    """Those of the integrated bodies, where each of them can only turn about a fixed axis."""

    def problem(self, formulation: str, rate_scale: float) -> tuple[DAEProblem, Members]:
        """Return what is integrated, and how the whole follows from it.

        Bodies that turn about fixed axes are integrated by their angles alone in the formulation SI2.
        """
        if self.hinges is not None and formulation == "SI2":
            problem = fixed_axis_problem(self.system, axes_of(self.system, self.hinges), rate_scale)
            if problem is not None:
                starts = starting_values(problem, len(self.hinges))
                table = turn_table(self.whole, self.system, self.hinges, starts)
                return problem, self.members._replace(turn=table)
        return self.system.problem(formulation, rate_scale), self.members

    def remark(self, formulation: str) -> str:
        """Return a remark for the message of a run if another formulation would leave less to integrate."""
        if self.hinges is None or formulation == "SI2":
            return ""
        return (
            f"lump: with {formulation} bodies that turn about fixed axes keep six coordinates; formulation SI2 "
            "integrates their angles alone."
        )


def lumped(mechanism: Mechanism, t0: float = 0.0) -> Lumped | None:
    """Return a mechanism with the bodies that fixed joints connect as one, or None if that leaves no less to integrate.

    What is left is less, too, where each body can only turn about a fixed axis: in one revolute joint on the ground,
    driven by a rotation about it or not, see `gearmbs.dae.equations.fixed_axes`.

    All bodies are assembled first, so that errors, remarks and redundant rows are those of the whole mechanism. A fixed
    joint stays as it is

    * if some of its rows are redundant: of two joints that carry the same load the shares would not be determined;
    * if its reaction enters an expression;
    * if a general constraint names a marker of one of its bodies: what it exerts is known of the composite only.

    A mechanism with modal bodies stays as it is. `why_not_lumped` gives the reason for None.

    Raises
    ------
    ModelError
        As `Mechanism.compile` and its assembly.
    """
    whole = mechanism.compile(t0)
    whole.initialise()
    joints = [] if any(whole.model.modes) else _joints_inside(mechanism, whole)
    if not joints and _hinges(mechanism, whole) is None:
        return None
    return _Lumping(mechanism, whole, joints).run(t0)


def why_not_lumped(mechanism: Mechanism) -> str:
    """Return a remark for the message of a run on why `lumped` found nothing to integrate as one."""
    modal = [f"'{name}'" for name, body in mechanism.bodies.items() if isinstance(body, ModalBody)]
    if modal:
        why = f"the mechanism has bodies that deform: {', '.join(modal)}"
    elif not any(joint.kind == "fixed" for joint in mechanism.joints.values()):
        why = "there is no fixed joint"
    else:
        why = "the fixed joints share loads, enter expressions or constraints, or leave nothing that moves"
    return f"lump: no bodies are integrated as one, since {why}."


def _hinges(mechanism: Mechanism, system: System) -> dict[str, Hinge] | None:
    return hinges(mechanism.bodies, mechanism.joints.values(), set(system.row_names))


def _joints_inside(mechanism: Mechanism, whole: System) -> list[Joint]:
    """Return the fixed joints that vanish inside groups."""
    kept = set(whole.row_names)
    model = whole.model
    names = ["", *whole.body_names]
    names += [names[b] for b in model.frame_body]
    tapes = [k for k in model.rows[:, T.ROW_TAPE] if k >= 0]
    constrained = {names[b] for k in tapes for b in model.tapes[k].bodies}
    found = []
    for joint in mechanism.joints.values():
        bodies = (joint.i.body, joint.j.body)
        if (
            joint.kind == "fixed"
            and all(f"{joint.name}: {row.label}" in kept for row in joint.rows)
            and f"reaction of {joint.name}" not in whole.force_names
            and all(body.kind.lumps and body.name not in constrained for body in bodies)
        ):
            found.append(joint)
    return found


class _Lumping:
    def __init__(self, mechanism: Mechanism, whole: System, joints: list[Joint]) -> None:
        self.mechanism = mechanism
        self.whole = whole
        self.inside = joints
        self.bodies = list(mechanism.bodies.values())
        self.number = {id(body): k for k, body in enumerate(self.bodies)} | {id(mechanism.ground): -1}
        self.pose = {k: whole.pose[k] for k in range(len(self.bodies))}
        self.composite: dict[int, Body] = {}
        """By the number of a member."""
        self.markers: dict[int, Marker] = {}
        """New markers by the identity of the old."""

    def run(self, t0: float) -> Lumped | None:
        groups, edges = self._groups()
        if len(groups) == 1:
            # nothing moves
            return None
        model = self._mechanism(groups)
        system = model.compile(t0)
        system.typical_length = self.whole.length
        system.initialise()
        return Lumped(self.whole, system, self._members(system, edges), _hinges(model, system))

    # --- groups -------------------------------------------------------------------------------------

    def _groups(self) -> tuple[list[list[int]], list[tuple[int, int, Joint]]]:
        """Return the members of each group, the ground's first, and (child, parent, joint), inner ones first."""
        neighbours: dict[int, list[tuple[int, Joint]]] = {k: [] for k in (-1, *range(len(self.bodies)))}
        for joint in self.inside:
            i, j = self.number[id(joint.i.body)], self.number[id(joint.j.body)]
            neighbours[i].append((j, joint))
            neighbours[j].append((i, joint))
        groups, edges, seen = [], [], set()
        for root in (-1, *range(len(self.bodies))):
            if root in seen:
                continue
            seen.add(root)
            group, queue = [root], [root]
            while queue:
                parent = queue.pop(0)
                for child, joint in neighbours[parent]:
                    if child not in seen:
                        seen.add(child)
                        group.append(child)
                        queue.append(child)
                        edges.append((child, parent, joint))
            groups.append(group)
        return groups, edges

    # --- the mechanism that is integrated ------------------------------------------------------------

    def _mechanism(self, groups: list[list[int]]) -> Mechanism:
        old = self.mechanism
        new = copy.copy(old)
        new.ground = Body("ground", is_ground=True)
        new.bodies = {}
        for group in groups:
            body = new.ground if group[0] == -1 else self._composite(group)
            self.composite.update(dict.fromkeys(group, body))
            if body is not new.ground:
                new.bodies[body.name] = body
        for body in (old.ground, *self.bodies):
            for marker in body.markers:
                self._move(marker)
        kept = set(self.whole.row_names)
        inside = {joint.name for joint in self.inside}
        new.joints = {
            name: self._joint(joint, [row for row in joint.rows if f"{name}: {row.label}" in kept])
            for name, joint in old.joints.items()
            if name not in inside
        }
        new.constraints = {}
        for name, constraint in old.constraints.items():
            rows = {label: text for label, text in constraint.rows.items() if f"{name}: {label}" in kept}
            if rows:
                about = None if constraint.about is None else self.markers[id(constraint.about)]
                new.constraints[name] = replace(constraint, rows=rows, about=about)
        new.elements = {name: self._element(element, new.joints) for name, element in old.elements.items()}
        return new

    def _composite(self, group: list[int]) -> Body:
        """Return the composite of bodies: its frame has the axes of the first and its origin in the centre of mass."""
        alone = self.bodies[group[0]]
        if not alone.kind.lumps:
            place, velocity = alone.centre_of_mass()
            return replace(alone, com=np.zeros(3), position=place, velocity=velocity, markers=[])
        first = self.pose[group[0]]
        axes = first[POSE_A:POSE_V].reshape(3, 3)
        masses = np.array([self.bodies[k].mass for k in group])
        places = np.array([self.pose[k][POSE_R:POSE_A] for k in group])
        mass = float(masses.sum())
        com = masses @ places / mass if mass > 0.0 else places.mean(axis=0)
        inertia = np.zeros((3, 3))
        for k, place in zip(group, places, strict=True):
            turned = axes.T @ self.pose[k][POSE_A:POSE_V].reshape(3, 3)
            arm = axes.T @ (place - com)
            inertia += turned @ self.bodies[k].inertia @ turned.T
            inertia += self.bodies[k].mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        rate = first[POSE_W:]
        return Body(
            name=" + ".join(self.bodies[k].name for k in group),
            mass=mass,
            inertia=0.5 * (inertia + inertia.T),
            position=com,
            orientation=axes.copy(),
            velocity=first[POSE_V:POSE_W] + np.cross(rate, com - first[POSE_R:POSE_A]),
            angular_velocity=rate.copy(),
        )

    def _move(self, marker: Marker) -> None:
        """Make a marker of a composite from one of its members'."""
        k = self.number[id(marker.body)]
        point, axes = marker.position, marker.orientation
        if k >= 0:
            turned = self.pose[k][POSE_A:POSE_V].reshape(3, 3)
            point = self.pose[k][POSE_R:POSE_A] + turned @ (marker.position - marker.body.com)
            axes = turned @ marker.orientation
        body = self.composite[k]
        if not body.is_ground:
            point, axes = body.orientation.T @ (point - body.position), body.orientation.T @ axes
        new = Marker(marker.name, body, point, axes, marker.number)
        body.markers.append(new)
        self.markers[id(marker)] = new

    def _joint(self, joint: Joint, rows: list[Row]) -> Joint:
        at = self.markers
        moved = [replace(r, terms=tuple(replace(t, i=at[id(t.i)], j=at[id(t.j)]) for t in r.terms)) for r in rows]
        return replace(joint, rows=moved, i=at[id(joint.i)], j=at[id(joint.j)])

    def _element(self, element: Any, joints: Mapping[str, Joint]) -> Any:
        """Return a copy of a force element with the markers of the composites."""
        new = copy.copy(element)
        for name, value in vars(element).items():
            new.__dict__[name] = self._mapped(value, joints)
        return new

    def _mapped(self, value: Any, joints: Mapping[str, Joint]) -> Any:
        """Return what stands for a marker or joint, alone or in a list, tuple or mapping; other values as they are."""
        if isinstance(value, Marker):
            return self.markers[id(value)]
        if isinstance(value, Joint):
            return joints.get(value.name, value)
        if isinstance(value, (list, tuple)) and any(isinstance(item, (Marker, Joint)) for item in value):
            return type(value)(self._mapped(item, joints) for item in value)
        if isinstance(value, Mapping) and any(isinstance(item, (Marker, Joint)) for item in value.values()):
            return {key: self._mapped(item, joints) for key, item in value.items()}
        return value

    # --- the way back --------------------------------------------------------------------------------

    def _members(self, system: System, edges: list[tuple[int, int, Joint]]) -> Members:
        from gearmbs.dae.model import members as mb

        n = len(self.bodies)
        names = {name: k + 1 for k, name in enumerate(system.body_names)}
        group = np.zeros(n, dtype=np.int64)
        place = np.zeros((n, mb.PLACE_COLUMNS))
        for k, body in enumerate(self.bodies):
            composite = self.composite[k]
            group[k] = 0 if composite.is_ground else names[composite.name]
            turned, point = self.pose[k][POSE_A:POSE_V].reshape(3, 3), self.pose[k][POSE_R:POSE_A]
            if group[k]:
                pose = system.pose[group[k] - 1]
                axes = pose[POSE_A:POSE_V].reshape(3, 3)
                turned, point = axes.T @ turned, axes.T @ (point - pose[POSE_R:POSE_A])
            place[k, mb.PLACE_R : mb.PLACE_A] = point
            place[k, mb.PLACE_A : mb.PLACE_MASS] = turned.ravel()
            place[k, mb.PLACE_MASS] = body.mass
            place[k, mb.PLACE_INERTIA :] = body.inertia.ravel()
        of_marker = np.full(len(system.model.marker_body), -1, dtype=np.int64)
        index = {}
        for body in (self.mechanism.ground, *self.bodies):
            for marker in body.markers:
                index[id(marker)] = system.marker_index[id(self.markers[id(marker)])]
                of_marker[index[id(marker)]] = self.number[id(body)]
        at = {name: k for k, name in enumerate(self.whole.row_names)}
        edge = np.zeros((len(edges), mb.EDGE_COLUMNS), dtype=np.int64)
        for row, (child, parent, joint) in zip(edge, reversed(edges), strict=True):
            row[: mb.EDGE_AXES] = (
                child,
                parent,
                index[id(joint.i)],
                index[id(joint.j)],
                self.number[id(joint.i.body)] == child,
            )
            row[mb.EDGE_AXES : mb.EDGE_ROWS] = [r.terms[0].axes for r in joint.rows[3:]]
            row[mb.EDGE_ROWS :] = [at[f"{joint.name}: {r.label}"] for r in joint.rows]
        return mb.Members(
            group,
            place,
            of_marker,
            np.array([at[name] for name in system.row_names], dtype=np.int64),
            edge,
            mb.no_turns(),
        )
