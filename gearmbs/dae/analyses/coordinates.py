"""Coordinates that are those of joints: the angle or the displacement that a joint leaves free.

Where a motion is in balance, or steady, the poles of its linearisation are the same in all coordinates. Elsewhere they
are not: with delta eta = S delta q of eta = h(q)

    delta eta' = S delta q' + S' delta q,   delta eta'' = S delta q'' + 2 S' delta q' + S'' delta q,

and h_qq q'' in S'' is there at rest, too. So coordinates are taken that a person would: with x = T q and the rows j of
joints, S = j T, the new basis is T S^-1, all with their rates. The frames of a joint are led along the path with the
present velocities and accelerations for the rates of j, as the constraints are in `gearmbs.dae.analyses.steady`.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr

from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.steady import LOOK, Basis, Linearised, along, largest, path_rates
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model.model import Configuration
from gearmbs.dae.model.system import accelerations
from gearmbs.dae.problem import ModelError

Triple = tuple[np.ndarray, np.ndarray, np.ndarray]
"""A matrix with its first and second rate."""

CLEAR = 1e-2
"""Part of the largest by which a joint has to move by itself to be a coordinate: what follows others that closely
is better told by these."""
EVEN = 0.1
"""The same of one that is taken because it comes first, so that coordinates stay what they are along a path: beside a
dead centre its rates would be ten times those of others, and their squares are in A."""
STILL = 1e-6
"""Speed, rad/s, up to which a body counts as one at rest, whose joints are the same in axes that turn with it."""
SAME = 1e-9
"""Difference of two coordinates, of their size, that is rounding: that of second rates is 1e-13 of it."""
AS_BEFORE = 1e-4
"""Change of a coefficient, a hundredth of a radian on, of its terms, that counts as none: a pendulum as far from its
rest has as much."""


@dataclass(frozen=True)
class Frame:
    """A marker: the number of its body, -1 of the ground, its place from the centre of mass, m, and its axes."""

    body: int
    arm: np.ndarray
    axes: np.ndarray

    def at(self, configuration: Configuration) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return its global place, the arm from the centre of mass, and its axes."""
        if self.body < 0:
            return self.arm, np.zeros(3), self.axes
        row = configuration.pose[self.body]
        turned = row[POSE_A:POSE_V].reshape(3, 3)
        arm = turned @ self.arm
        return row[POSE_R:POSE_A] + arm, arm, turned @ self.axes


@dataclass(frozen=True)
class JointCoordinate:
    """What a joint leaves free: the rotation of I about z_J, or its way along z_J.

    Attributes
    ----------
    title : str
    rotation : bool
    i, j : Frame
    """

    title: str
    rotation: bool
    i: Frame
    j: Frame

    @property
    def between_bodies(self) -> bool:
        """Whether neither side is the ground."""
        return min(self.i.body, self.j.body) >= 0

    def row(self, configuration: Configuration) -> np.ndarray:
        """Return how it changes with displacements and small rotations of the bodies, shape (2, bodies, 3).

        Of z . (p_I - p_J), p = R + s, it is z . (delta R + phi x s) of both and (phi_J x z) . (p_I - p_J).
        """
        out = np.zeros((2, configuration.bodies, 3))
        (place, arm, _), (origin, lever, axes) = self.i.at(configuration), self.j.at(configuration)
        z = axes[:, 2]
        for frame, sign, s in ((self.i, 1.0, arm), (self.j, -1.0, lever)):
            if frame.body < 0:
                continue
            if self.rotation:
                out[1, frame.body] += sign * z
            else:
                out[0, frame.body] += sign * z
                out[1, frame.body] += sign * np.cross(s, z)
        if not self.rotation and self.j.body >= 0:
            out[1, self.j.body] += np.cross(z, place - origin)
        return out


@dataclass(frozen=True)
class Chosen:
    """Coordinates of a linearisation.

    Attributes
    ----------
    rows : Triple
        S with its rates, shape (dof, dof).
    titles, units : list of str
    picks : list of JointCoordinate or int
        What they are: coordinates of joints, or rows of `spatial`.
    """

    rows: Triple
    titles: list[str]
    units: list[str]
    picks: list[JointCoordinate | int]


def product(a: Triple, b: Triple) -> Triple:
    """Return a b with its rates."""
    return a[0] @ b[0], a[1] @ b[0] + a[0] @ b[1], a[2] @ b[0] + 2.0 * a[1] @ b[1] + a[0] @ b[2]


def inverse(a: Triple) -> Triple:
    """Return a^-1 with its rates."""
    now = np.linalg.inv(a[0])
    first = -now @ a[1] @ now
    return now, first, -now @ (a[2] @ now + 2.0 * a[1] @ first)


def spatial(instant: Instant, small: bool, changes: np.ndarray) -> np.ndarray:
    """Return displacements and small rotations in global components of all bodies, then changes of modal coordinates.

    Parameters
    ----------
    instant : Instant
    small : bool
        Whether the coordinates have small rotations, and not Euler angles.
    changes : ndarray, shape (n, k)
        Of the coordinates (R, phi or theta, q_f).

    Returns
    -------
    ndarray, shape (6 bodies + modes, k)
    """
    bodies, first, k = len(instant.system.body_names), instant.at["R"], changes.shape[1]
    angle, mode = instant.at["theta"] - first, instant.at["q_f"] - first
    turned = np.zeros((bodies, 3, k))
    rotating = instant.system.model.counts.turning
    turned[rotating] = changes[angle:mode].reshape(rotating.size, 3, k)
    if not small:
        turned = np.einsum("bmc,bmk->bck", instant.axes(), turned)
    return np.concatenate([changes[:angle], turned.reshape(-1, k), changes[mode:]])


def chosen(instant: Instant, motion: Basis, small: bool, joints: Sequence[JointCoordinate]) -> Chosen:
    """Return coordinates that describe a motion: those of joints, then displacements and small rotations of bodies.

    Of joints angles come first, and of these those against the ground, in the order of the joints; of bodies rotations.
    Each is taken that moves clearly beside those taken, so that along a path they are the same but where one comes
    close to a dead centre. If these do not do, those are taken that others follow best. Chains that turn steadily, in
    axes that may turn with them, have none of joints, and beside others that are not steady the independent ones.

    Parameters
    ----------
    instant : Instant
    motion : Basis
        T with its rates.
    small : bool
        See `spatial`.
    joints : sequence of JointCoordinate
    """
    n = motion.now.shape[1]
    picks: list[JointCoordinate | int] = []
    if not n:
        return Chosen((np.zeros((0, 0)),) * 3, [], [], [])
    bodies, arm = len(instant.system.body_names), max(min(instant.system.length, 1.0), 1e-3)
    sizes = arm / instant.system.model.modal_sizes[:, 0]
    weight = np.concatenate([np.ones(3 * bodies), np.full(3 * bodies, arm), sizes])
    own, varies = _of_bodies(instant, motion, small), _varying(instant, motion)
    still = np.linalg.norm(instant.pose()[:, POSE_W:], axis=1) <= STILL
    free = np.full(bodies, True) if not small else varies | still
    if motion.along is not None:
        anchors = np.zeros((len(motion.now), 1))
        anchors[motion.along.anchors] = 1.0
        weight = weight * (np.tile(np.repeat(varies, 3), 2) | (spatial(instant, True, anchors)[:, 0] != 0.0))
    scaled = weight[:, None] * own[0]
    taken, largest_row = np.zeros((n, 0)), np.abs(scaled).max()
    joints = [one for one in joints if all(frame.body < 0 or free[frame.body] for frame in (one.i, one.j))]
    if joints:
        rows = _of_joints(instant, motion, small, joints)
        lengths = np.where([one.rotation for one in joints], arm, 1.0)
        first = sorted(range(len(joints)), key=lambda k: (not joints[k].rotation, joints[k].between_bodies))
        numbers, taken = _independent(lengths[:, None] * rows[0], first, taken, CLEAR * largest_row)
        for k in numbers:
            same = _of_its_body(joints[k], tuple(each[k] for each in rows), own, bodies)
            picks.append(joints[k] if same is None else same)
    order = [*range(3 * bodies, 6 * bodies), *range(3 * bodies), *range(6 * bodies, len(scaled))]
    picks += _independent(scaled, order, taken, 0.0)[0]
    return _read(instant, motion, small, picks)


def _independent(
    rows: np.ndarray, order: Sequence[int], taken: np.ndarray, least: float
) -> tuple[list[int], np.ndarray]:
    """Return numbers of rows that are independent of each other and of directions, and the directions with theirs.

    Parameters
    ----------
    rows : ndarray, shape (k, n)
        Scaled to one length.
    order : sequence of int
        In which those that are clearly independent are taken.
    taken : ndarray, shape (n, m)
        Orthonormal directions.
    least : float
        Length of what a row has to have beside the others.
    """
    n, found = rows.shape[1], []
    clear = max(EVEN * np.linalg.norm(rows, axis=1).max(), least)
    for k in order:
        if taken.shape[1] == n:
            break
        beside = rows[k] - taken @ (taken.T @ rows[k])
        size = np.linalg.norm(beside)
        if size > clear:
            beside -= taken @ (taken.T @ beside)
            taken = np.column_stack([taken, beside / np.linalg.norm(beside)])
            found.append(int(k))
    if taken.shape[1] < n:
        upper, rest = qr((rows - rows @ taken @ taken.T).T, mode="r", pivoting=True)
        count = min(int(np.sum(np.abs(np.diag(upper)) > least)), n - taken.shape[1])
        found += rest[:count].tolist()
        taken = np.linalg.qr(np.column_stack([taken, rows[rest[:count]].T]))[0]
    return sorted(found), taken


def _read(instant: Instant, motion: Basis, small: bool, picks: Sequence[JointCoordinate | int]) -> Chosen:
    """Return coordinates that have been chosen, at an instant."""
    own = _of_bodies(instant, motion, small)
    labels = _labels(instant)
    joints = [one for one in picks if isinstance(one, JointCoordinate)]
    of_joints = _of_joints(instant, motion, small, joints)
    found, titles, units = [], [], []
    for one in picks:
        if isinstance(one, JointCoordinate):
            found.append([each[joints.index(one)] for each in of_joints])
            title, unit = one.title, "rad" if one.rotation else "m"
        else:
            found.append([each[one] for each in own])
            title, unit = labels[one]
        titles.append(title)
        units.append(unit)
    now, first, second = (np.array([row[level] for row in found]) for level in range(3))
    return Chosen((now, first, second), titles, units, list(picks))


def _labels(instant: Instant) -> list[tuple[str, str]]:
    """Return the names and units of the rows of `spatial`."""
    bodies = instant.system.body_names
    out = [(f"{name}: {c}", "m") for name in bodies for c in "xyz"]
    out += [(f"{name}: rotation about {c}", "rad") for name in bodies for c in "xyz"]
    for name, count in zip(bodies, instant.system.model.modes[1:], strict=True):
        out += [(f"{name}: mode {k + 1}", "1") for k in range(count)]
    return out


def _varying(instant: Instant, motion: Basis) -> np.ndarray:
    """Return which bodies are in a motion that is not steady."""
    bodies = len(instant.system.body_names)
    return np.zeros(bodies, dtype=bool) if motion.along is None else motion.along.rows[: 3 * bodies : 3]


def _of_bodies(instant: Instant, motion: Basis, small: bool) -> Triple:
    """Return displacements, rotations and modal coordinates by q, with the rates of what is not steady."""
    now, first, second = (spatial(instant, small, each) for each in (motion.now, motion.first, motion.second))
    modes = np.zeros(sum(instant.system.model.modes[1:]), dtype=bool)
    varies = np.concatenate([np.tile(np.repeat(_varying(instant, motion), 3), 2), modes])[:, None]
    return now, first * varies, second * varies


def _of_joints(instant: Instant, motion: Basis, small: bool, joints: Sequence[JointCoordinate]) -> Triple:
    """Return the coordinates of joints by q, with their rates."""
    bodies, n = len(instant.system.body_names), motion.now.shape[1]
    if not joints:
        return (np.zeros((0, n)),) * 3

    def rows(there: Configuration, _: float) -> np.ndarray:
        return np.array([one.row(there).ravel() for one in joints])

    now = rows(instant.configuration(), instant.t)
    # what does not turn, nor begins to, has no rates
    rates = path_rates(instant, rows) if small else (np.zeros_like(now),) * 2
    basis = tuple(spatial(instant, small, each)[: 6 * bodies] for each in (motion.now, motion.first, motion.second))
    return product((now, *rates), basis)  # type: ignore[arg-type]


def _of_its_body(joint: JointCoordinate, row: Triple, own: Triple, bodies: int) -> int | None:
    """Return the row of a body that is the same coordinate, or the opposite one; its name tells more."""
    for frame in (joint.i, joint.j):
        first = 3 * frame.body + 3 * bodies * joint.rotation
        for place in range(first, first + 3) if frame.body >= 0 else ():
            for sign in (1.0, -1.0):
                pairs = [(each[place], sign * other) for each, other in zip(own, row, strict=True)]
                if all(np.abs(a - b).max() <= SAME * max(np.abs(b).max(), np.abs(row[0]).max()) for a, b in pairs):
                    return place
    return None


def departure(
    instant: Instant, lin: Linearised, motion: Basis, anchors: np.ndarray, coordinates: Chosen,
    linearise: Callable[[Instant], Linearised],
) -> str:  # fmt: skip
    """Return what pushes a mechanism that is not in balance; "" where its equations stay the same as it moves off.

    Parameters
    ----------
    instant : Instant
        At rest.
    lin : Linearised
    motion : Basis
        T with its rates, in the coordinates.
    anchors : ndarray of int
        Entries of (R, phi, q_f) that no constraints make dependent.
    coordinates : Chosen
    linearise : callable
        Makes the equations of another instant.
    """
    system, now = copy.copy(instant.system), instant.configuration()
    pushed = accelerations(system, now, instant.t)[0]
    moved, bent = now.parts(pushed)
    turning = system.model.counts.turning
    start = np.linalg.lstsq(
        motion.now, np.concatenate([moved[:, :3].ravel(), moved[turning, 3:].ravel(), bent]), rcond=None
    )[0]
    mass, damping, stiffness = _coefficients(lin, motion)
    force = mass @ start
    # how far it is to where it rests, if the stiffness stays what it is
    size = max(np.abs(moved[:, 3:]).max(), np.abs(moved[:, :3]).max() / system.length)
    if size * float(start @ force) <= LOOK * abs(float(start @ stiffness @ start)):
        return ""
    system.configuration = now.displaced(LOOK / size * pushed)
    there = Instant(system, "I3")
    there.released, there.y = True, there.settle(there.y)
    try:
        further = linearise(there)
    except ModelError:
        return ""
    later = _coefficients(further, _led(there, further, motion, anchors, coordinates))
    inertia = np.sqrt(np.abs(np.diag(mass)))
    resisted = np.sqrt((np.abs(motion.now).T @ lin.stiffness_terms @ np.abs(motion.now)).diagonal())
    resisted = resisted + np.sqrt(size) * inertia
    damped = np.sqrt(inertia * resisted + np.abs(damping).diagonal())
    sizes = (inertia, damped, resisted)
    if all(largest(a - b, c) <= AS_BEFORE for a, b, c in zip(later, (mass, damping, stiffness), sizes, strict=True)):
        return ""
    k = int(np.argmax(force * start))
    unit = {"rad": " N m", "m": " N"}.get(coordinates.units[k], "")
    return f"{coordinates.titles[k]} is pushed by {force[k]:.4g}{unit}"


def _led(there: Instant, lin: Linearised, motion: Basis, anchors: np.ndarray, coordinates: Chosen) -> Basis:
    """Return T with its rates in the same coordinates at another instant, at rest."""
    dependent = np.setdiff1d(np.arange(len(motion.now)), anchors)
    basis = np.zeros_like(motion.now)
    basis[anchors] = np.eye(anchors.size)
    basis[dependent] = -np.linalg.lstsq(lin.constraint[:, dependent], lin.constraint[:, anchors], rcond=None)[0]
    way = along(there, lin, anchors, np.ones(len(basis), dtype=bool))
    none = np.zeros_like(basis)
    now = replace(motion, now=basis, first=none, second=none if way is None else way.rates(basis)[1], along=way)
    return in_coordinates(now, _read(there, now, lin.transform is not None, coordinates.picks))


def _coefficients(lin: Linearised, motion: Basis) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mass, damping and stiffness by q at rest."""
    t = motion.now
    return t.T @ lin.mass @ t, t.T @ lin.damping @ t, t.T @ (lin.stiffness @ t + lin.mass @ motion.second)


def in_coordinates(motion: Basis, coordinates: Chosen) -> Basis:
    """Return T with its rates by other coordinates, T S^-1."""
    now, first, second = product((motion.now, motion.first, motion.second), inverse(coordinates.rows))
    return replace(motion, now=now, first=first, second=second)


def put_back(instant: Instant, small: bool, place: Triple, motion: Basis, coordinates: Chosen) -> Triple:
    """Return T_u with its rates, so that inputs leave the coordinates where they are.

    Parameters
    ----------
    instant : Instant
    small : bool
        See `spatial`.
    place : Triple
        T_u with its rates, whatever it does to the coordinates.
    motion : Basis
        T in these coordinates.
    coordinates : Chosen
    """
    if not place[0].any():
        return place
    of_inputs = replace(motion, now=place[0], first=place[1], second=place[2])
    moved = _read(instant, of_inputs, small, coordinates.picks).rows
    back = product((motion.now, motion.first, motion.second), moved)
    return tuple(a - b for a, b in zip(place, back, strict=True))  # type: ignore[return-value]
