"""Remarks on mechanisms that may not be meant: bodies that joints lock, positions where degrees of freedom change."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.problem import ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.elements import ForceElement
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.parts.point_mass import PointMass
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.joints import Joint, Row

MOST_ROWS = 200
"""Constraint rows up to which it is looked for: the work grows with their third power."""

MOTIONS = ("rotation", "translation")
STILL = 1e-8
"""Motion of a body, as a part of the largest, that counts as rest."""

MOVED = 1e-7
"""Way (m) or turn (rad) by which a body has moved: locked ones stray within the tolerance of constraints, 1e-10."""

LONGEST = 80
"""Characters of a value that a message shows."""

NAMED = 3
"""Bodies and joints named in the remark at most."""


def check_mechanism(given: Any) -> None:
    """Raise a ModelError if something is no Mechanism, with what makes one of it."""
    if hasattr(given, "bodies") and hasattr(given, "compile"):
        return
    remedy = "give a Mechanism"
    if hasattr(given, "build"):
        remedy = "give what its build() returns"
    elif hasattr(given, "gears") and hasattr(given, "operation"):
        remedy = "give what gearmbs.studies.case_mechanism makes of it"
    told = repr(given).split("\n")[0]
    raise ModelError(f"mechanism is {told if len(told) <= LONGEST else f'a {type(given).__name__}'}; {remedy}")


def locked_bodies(mechanism: Mechanism, system: System) -> list[str]:
    """Return the bodies that joints lock where a mechanism starts, without those fixed to the ground on purpose.

    Prescribed motions are left out: what they move is not locked. The motions that the other rows allow are the null
    space of their Jacobian; a body with no part in any of them cannot move.
    """
    names = list(system.body_names)
    rows = [name.rsplit(": ", 1)[0] for name in system.row_names]
    if not rows or len(rows) > MOST_ROWS:
        return []
    kept = [k for k, name in enumerate(rows) if name in mechanism.joints and mechanism.joints[name].kind not in MOTIONS]
    jacobian = system.constraint_jacobian(system.configuration, system.t0)[0].toarray()[kept]
    scale = 1.0 / np.sqrt(system.coordinate_weights())
    _, values, right = np.linalg.svd(jacobian * scale)
    rank = int(np.sum(values > 1e-10 * values.max(initial=0.0))) if values.size else 0
    free = right[rank:].T
    if not np.all(np.isfinite(free)):
        return []
    still = [name for name, own in zip(names, _directions_of(system)) if not np.any(np.abs(free[own]) > STILL)]
    return [name for name in still if name not in _fixed_to_ground(mechanism)]


def _directions_of(system: System) -> list[np.ndarray]:
    """Return for each body which of all spatial displacements it has."""
    return [6 * k + np.array(kind.directions) for k, kind in enumerate(system.model.kinds[1:])]


def locking_remark(mechanism: Mechanism, system: System) -> str:
    """Return a remark for the message of a run on bodies that joints lock, or nothing."""
    bodies = locked_bodies(mechanism, system)
    if not bodies:
        return ""
    joints = [
        name for name, joint in mechanism.joints.items()
        if joint.kind not in MOTIONS and {joint.i.body.name, joint.j.body.name} & set(bodies)
    ]  # fmt: skip
    one = len(bodies) == 1
    return (
        f"{'Body' if one else 'Bodies'} {_listed(bodies)} cannot move: {_listed(joints)} together leave "
        f"{'it' if one else 'them'} no motion; fix {'it' if one else 'them'} to the ground if that is meant."
    )


def moves_after_all(mechanism: Mechanism, solution: Solution) -> bool:
    """Whether a body that joints lock at the start has moved: at a dead centre it has no velocity."""
    return any(
        np.ptp(values.reshape(len(values), -1), axis=0).max(initial=0.0) > MOVED
        for name in locked_bodies(mechanism, solution.system)
        for values in (solution.com_position(name), solution.orientation(name))
    )


def _listed(names: list[str]) -> str:
    shown = [f"'{name}'" for name in names[:NAMED]]
    if len(names) > NAMED:
        shown.append(f"{len(names) - NAMED} more")
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"


def _fixed_to_ground(mechanism: Mechanism) -> set[str]:
    """Return the bodies that fixed joints connect to the ground, also by way of others."""
    fixed = {mechanism.ground.name}
    pairs = [
        (joint.i.body.name, joint.j.body.name) for joint in mechanism.joints.values() if joint.kind == "fixed"
    ]  # fmt: skip
    for _ in pairs:
        for one, other in pairs:
            if one in fixed or other in fixed:
                fixed |= {one, other}
    return fixed


# Which of several constraint rows that say the same are kept.
#
# "declared" keeps what was added first. "adams" keeps, as far as published results show, what ADAMS does: places before
# orientations, orientations of planar joints after those of others, what couples joints after these, and motions last,
# a later one before an earlier. (A door on two pins with two motions loses all four rows of orientation, one of place
# along the axis, and its first motion; a delta robot keeps the orientations of its cylindrical joints and loses those
# of its planar ones.)


ORDERS = ("declared", "adams")
PLACE, ORIENTATION, PLANAR, COUPLING, MOTION = range(5)
"""Ranks, from what is kept first to what goes first."""
PLACES = (terms.POINT, terms.DOT2, terms.DISTANCE)


def row_order(mechanism: Mechanism) -> np.ndarray | None:
    """Return the numbers of all constraint rows in the order of preference, None for that of the mechanism.

    Raises
    ------
    ModelError
        If the mechanism asks for an order that is not known.
    """
    if mechanism.redundancy not in ORDERS:
        raise ModelError(f"redundancy = {mechanism.redundancy!r}; choose one of {', '.join(ORDERS)}")
    if mechanism.redundancy == "declared":
        return None
    ranks = [_rank(joint, row) for joint in mechanism.joints.values() for row in joint.rows]
    ranks += [COUPLING for constraint in mechanism.constraints.values() for _ in constraint.rows]
    within = [-k if rank == MOTION else k for k, rank in enumerate(ranks)]
    return np.lexsort((within, ranks))


def _rank(joint: Joint, row: Row) -> int:
    if joint.kind in MOTIONS:
        return MOTION
    if joint.kind == "coupler":
        return COUPLING
    if any(term.kind in PLACES for term in row.terms):
        return PLACE
    return PLANAR if joint.kind == "planar" else ORIENTATION


# Whether seats of modal bodies that are held against turning kept enough of their flexibility in the reduction.


MOST_LOST = 0.25
"""Share of the flexibility under torques that may be lacking: without a quarter a seat is a third too stiff."""

MESHES = ("gear contact", "ideal mesh")
"""Kinds of force elements that turn a marker about its z."""


def warn_of_stiff_seats(joints: Mapping[str, Joint], elements: Mapping[str, Any]) -> None:
    """Warn of each modal body of which a joint, or a mesh of teeth, turns a seat that the reduction made too stiff.

    Of a joint the directions count about which it holds the seat, of a mesh the axis of the wheel. Seats whose exact
    flexibility is not known, as of modal neutral files, are passed over.
    """
    worst: dict[ModalBody, dict[str, tuple[float, str, str]]] = {}
    for part, marker, axes in _held(joints, elements):
        body = marker.body
        assert isinstance(body, ModalBody)
        if body.lost_turning is None:
            continue
        turned = body.shape_at(marker)[1] if axes else None
        for axis in axes:
            seat, share = body.lost_turning(marker.position, marker.orientation @ axis, turned)
            kind = _kind(body, marker.orientation @ axis)
            if share > max(MOST_LOST, worst.get(body, {}).get(kind, (0.0,))[0]):
                worst.setdefault(body, {})[kind] = share, seat, part
    for body, kinds in worst.items():
        lost = ", ".join(
            f"{100 * share:.0f} % of the flexibility {kind} of seat '{seat}', which '{part}' holds or turns"
            for kind, (share, seat, part) in kinds.items()
        )
        meshes = any(part in elements for _, _, part in kinds.values())
        warn(
            f"body '{body.name}': its {body.modal.modes} modes lack {lost}; it is too stiff there. Keep more modes: "
            "all (leave modes= out), or, of all, those that matter (by_participation(torques=True))"
            + ("; or let the wheel be a Disc of its shaft, which needs fewer" if meshes else "")
        )


def _kind(body: ModalBody, axis: np.ndarray) -> str:
    """Return what a torque about an axis does to a body."""
    if body.long_axis is not None:
        return "in torsion" if abs(body.long_axis @ axis) > np.sqrt(0.5) else "in bending under torques"
    return f"under torques about {np.array2string(axis, precision=2, suppress_small=True)} of the body"


def _held(joints: Mapping[str, Joint], elements: Mapping[str, Any]) -> Iterator[tuple[str, Marker, list[np.ndarray]]]:
    """Yield what turns a marker of a modal body, the marker, and the axes about which, in its own components."""
    for joint in joints.values():
        for marker in (joint.i, joint.j):
            if isinstance(marker.body, ModalBody):
                yield joint.name, marker, _directions(joint)
    for element in elements.values():
        if getattr(element, "kind", "") in MESHES:
            for marker in (element.i, element.j):
                if isinstance(marker.body, ModalBody):
                    yield element.name, marker, [np.array([0.0, 0.0, 1.0])]


def _directions(joint: Joint) -> list[np.ndarray]:
    """Return the axes about which a joint holds its markers, whose axes are then parallel."""
    out = []
    for row in joint.rows:
        if len(row.terms) == 1 and row.terms[0].kind == terms.DOT1:
            first, second = divmod(row.terms[0].axes, 3)
            if first != second:
                out.append(np.cross(np.eye(3)[first], np.eye(3)[second]))
    return out


# Whether a slender modal body turned faster than modes without geometric stiffening allow.


def warn_of_spin(bodies: Mapping[str, Body], solution: Solution) -> None:
    """Warn where a slender modal body turned across its long axis faster than its ``spin_limit``."""
    for name, body in bodies.items():
        if not (isinstance(body, ModalBody) and body.long_axis is not None and np.isfinite(body.spin_limit)):
            continue
        turning = np.einsum("tij,ti->tj", solution.orientation(name), solution.angular_velocity(name))
        across = np.linalg.norm(turning - np.outer(turning @ body.long_axis, body.long_axis), axis=1)
        fastest = float(across.max(initial=0.0))
        if fastest > body.spin_limit:
            warn(
                f"body '{name}' turned at {fastest:.4g} rad/s across its long axis, more than {body.spin_limit:.4g}: "
                "its modes lack the stiffening by centrifugal force; reduce it with spin=, or take large beams "
                "(gearmbs.flexible.add_beam)"
            )


LEVER = 1e-9
"""m; a torque below the force's over this lever is the rounding of one that was to be zero."""


def warn_of_lost_torques(elements: Mapping[str, Any], solution: Solution) -> None:
    """Warn where a force of the user's own wrote a torque that acts, or whose reaction acts, on a point mass."""
    for name, element in elements.items():
        if element.kind != "force":
            continue
        # of more than two markers the first one's wrench alone is known by the force's name
        markers = element.markers[:2] if len(element.markers) <= 2 else element.markers[:1]
        massed = [m.body.name for m in markers if isinstance(m.body, PointMass)]
        if not massed:
            continue
        force, torque = (float(np.abs(part).max(initial=0.0)) for part in solution.load(name))
        if torque > LEVER * force:
            warn(
                f"force '{name}': its torque of up to {torque:.4g} N m on the point mass '{massed[0]}' did nothing, "
                f"for a point mass does not turn; leave it out, or give an inertia: m.body('{massed[0]}', mass=..., "
                "inertia=...)"
            )


# Positions passed in a run in which constraints depend on each other: a remark, since what follows is doubtful.


MOST_ROWS_SEARCHED = 150
"""Constraint rows up to which it is looked for: the work grows with their third power."""
SAMPLES = 200
"""Outputs that are looked at, at most."""
NEAR = 0.01
"""Smallest singular value of the constraints, of its initial one, below which a position counts as singular."""
BETWEEN = 0.2
"""The same, at one of two outputs between which it may have passed zero."""
ALIKE = 0.9
"""Cosine from which singular vectors of two outputs are the same one, but for its sign."""


def singular_passage(solution: Solution) -> tuple[float, str] | None:
    """Return when a run passed a position in which constraints depend on each other, s, and which; None without one.

    There the Jacobian of the constraints, in spatial displacements, loses rank: its smallest singular value falls to
    zero. If that is between two outputs, it shows by a sign: of a value that passes zero one singular vector is turned
    over and the other is not; and where all motion is prescribed, the determinant changes its sign.
    """
    system = solution.system
    names = system.row_names
    if not names or len(names) > MOST_ROWS_SEARCHED or solution.t.size < 2:
        return None
    scale = 1.0 / np.sqrt(system.coordinate_weights())
    bodies = [
        np.concatenate([part.reshape(solution.t.size, -1) for part in parts], axis=1)
        for parts in (
            (solution.com_position(n), solution.orientation(n), solution.com_velocity(n), solution.angular_velocity(n))
            for n in system.body_names
        )
    ]
    poses = np.stack(bodies, axis=1)
    if poses.shape[1] * 6 != scale.size:
        # bodies with modes have coordinates of their own
        return None
    own = np.concatenate(_directions_of(system))
    first = sign = 0.0
    before: tuple[float, float, np.ndarray, np.ndarray] | None = None
    looked_at = np.unique(np.linspace(0, solution.t.size - 1, SAMPLES).astype(int))
    times = solution.t[looked_at]
    for t, matrix in zip(times.tolist(), system.constraint_jacobians(poses[looked_at], times)):
        jacobian = (matrix.toarray() * scale)[:, own]
        left, values, right = np.linalg.svd(jacobian, full_matrices=False)
        here = (t, float(values[-1]), left[:, -1], right[-1])
        now = float(np.linalg.slogdet(jacobian)[0]) if jacobian.shape[0] == jacobian.shape[1] else 0.0
        if before is None:
            first, sign = here[1], now
        if here[1] < NEAR * first or now * sign < 0.0:
            return here[0], _largest_rows(here[2], names)
        if before is not None and min(before[1], here[1]) < BETWEEN * first and _turned_over(before, here):
            share = before[1] / (before[1] + here[1])
            return before[0] + share * (here[0] - before[0]), _largest_rows(here[2], names)
        before = here
    return None


def _turned_over(
    before: tuple[float, float, np.ndarray, np.ndarray], here: tuple[float, float, np.ndarray, np.ndarray]
) -> bool:
    """Return whether the product u v^T of the smallest singular value has changed its sign, and nothing but that."""
    left, right = float(before[2] @ here[2]), float(before[3] @ here[3])
    return min(abs(left), abs(right)) > ALIKE and left * right < 0.0


def _largest_rows(weights: np.ndarray, names: Sequence[str]) -> str:
    """Return the names of the three rows of the largest weights."""
    return ", ".join(names[row] for row in np.argsort(-np.abs(weights))[:3])


# Whether what touches at the start stands no deeper in each other than the loads there press it.


MOST_EXCESS = 2.0
"""Unbalanced part of a contact's force, over the part that the loads balance: a load that comes at once presses to
twice its static force, and some play is left to who estimates the deflection."""

SHOWN = 1e-3
"""Share of a force below which nothing is said to press against it."""


def refuse_overlaps(elements: Mapping[str, Any], compiled: Callable[[Collection[str]], System]) -> None:
    """Refuse a mechanism of which parts start deep in each other, though nothing presses them together.

    With the accelerations A of a mechanism as it is, B without the contacts in question and a contact's wrench W on
    its two bodies, ``-W B`` is the rate at which the loads press the parts together, and ``W (A - B)`` that at which
    the contact drives them apart. A start under load has ``W A`` near zero.

    Parameters
    ----------
    elements : mapping
        Of the mechanism, by name.
    compiled : callable
        Returns the mechanism compiled without the elements named.

    Raises
    ------
    ModelError
        Naming the first of the elements whose parts the loads do not press together so much.
    """
    forces = [e for e in elements.values() if isinstance(e, ForceElement)]
    deep = {e.name: found for e in forces if (found := e.start_overlap()) is not None}
    if not deep:
        return
    try:
        moving = _accelerations(compiled(())), _accelerations(compiled(deep))
    except ModelError:
        # something else depends on the contact, or nothing else holds a body: there is no load to ask for
        moving = None
    for name, overlap in deep.items():
        element = elements[name]
        share = 0.0
        if moving is not None:
            apart, pressed = (_power(overlap.wrench, element.i, element.j, a) for a in moving)
            if pressed < 0.0 and apart <= -MOST_EXCESS * pressed:
                continue
            share = max(0.0, -pressed / (apart - pressed)) if apart > pressed else 0.0
        pressing = f"{100 * share:.2g} % of that" if share > SHOWN else "nothing"
        label = f"{element.kind} '{name}'"
        raise ModelError(f"{label}: at the start {overlap.text}; the loads there explain {pressing}. {overlap.remedy}")


def _accelerations(system: System) -> dict[str, tuple[np.ndarray, ...]]:
    """Return place and acceleration of the centre of mass, and angular acceleration, of each body."""
    system.initialise()
    rows = system.accelerations(system.configuration, system.t0)[0]
    return {n: (pose[:3], row[:3], row[3:]) for n, pose, row in zip(system.body_names, system.pose, rows)}


def _power(wrench: np.ndarray, i: Marker, j: Marker, moving: dict[str, tuple[np.ndarray, ...]]) -> float:
    """Return the wrench on I's body, and its reaction on J's, times their accelerations."""
    origin = i.global_position()
    total = 0.0
    for sign, marker in ((1.0, i), (-1.0, j)):
        if marker.body.is_ground:
            continue
        place, linear, angular = moving[marker.body.name]
        total += sign * (wrench[:3] @ (linear + np.cross(angular, origin - place)) + wrench[3:] @ angular)
    return float(total)
