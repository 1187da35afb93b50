"""Which mechanisms consist of bodies that turn about fixed axes, each in one revolute joint on the ground."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.equations.rotation import POSE_A, POSE_V
from gearmbs.dae.model.fixed_axes import Axis
from gearmbs.dae.model.member_tables import TURN_COLUMNS, TURN_I, TURN_J, TURN_ROOT, TURN_ROWS, TURN_SIDE
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.parts import Body, Marker

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

Hinge = tuple[Joint, Joint | None]
"""The revolute joint of a body, and the motion that prescribes its angle."""


def hinges(bodies: Mapping[str, Body], joints: Collection[Joint], rows: Collection[str]) -> dict[str, Hinge] | None:
    """Return the hinge of each body, by its name, or None if some body moves in another way.

    Each body must have one revolute joint on the ground with all its rows, and at most a rotation of that joint; no
    other row may be kept.

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
    if sum(kept.values()) < len(rows) or any(type(body) is not Body for body in bodies.values()):
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
    by_markers = {(id(joint.i), id(joint.j)): name for name, (joint, _) in found.items()}
    for motion in motions:
        name = by_markers.pop((id(motion.i), id(motion.j)), None)
        if name is None:
            return None
        found[name] = (found[name][0], motion)
    return found if len(found) == len(bodies) else None


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
            row[TURN_ROOT] = _root(system, joint, start)
    return table


def _root(system: System, joint: Joint, start: float) -> int:
    """Return 1 if x_I starts where the motion has turned x_J to, -1 if it is opposite to it."""
    i, j = (_axes(system, marker) for marker in (joint.i, joint.j))
    return 1 if i[:, 0] @ (j[:, 0] * np.cos(start) + j[:, 1] * np.sin(start)) > 0.0 else -1


def _axes(system: System, marker: Marker) -> np.ndarray:
    """Return the axes of a marker at the start of an assembled system, as columns."""
    if marker.body.is_ground:
        return marker.orientation
    pose = system.pose[system.body_names.index(marker.body.name)]
    return pose[POSE_A:POSE_V].reshape(3, 3) @ marker.orientation
