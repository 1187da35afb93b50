"""Accelerations of markers as outputs of a plant: their values at the operating point, and how they change.

A marker of a body that deforms stands at s = A (s_0 + Phi q) from the centre of mass, with A the axes of the body. With
d' = A Phi q' and d'' = A Phi q''

    a = a_0 + alpha x s + omega x (omega x s) + 2 omega x d' + d'',

and its angular acceleration is alpha + omega x w + A (Y beta'' + Y' beta'), w = A Y beta', where beta = Psi q are three
successive rotations and Y their axes (`gearmbs.dae.equations.bodies.frames`). Of rigid bodies there are no modal
coordinates q. With a small rotation phi of the body what is fixed in it changes by phi x, and

    delta omega = phi' + phi x omega,  delta alpha = phi'' + phi' x omega + phi x alpha.

q'' and alpha change as the plant has it: where modes move at the operating point with its own reservation, see
`gearmbs.dae.analyses.turning`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.dae.analyses.coordinates import spatial
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.linearisation import Reduced
from gearmbs.dae.analyses.realisation import Realised
from gearmbs.dae.analyses.turning import skew
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model.system import accelerations
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.modal import ModalBody

STEP = 1e-30
"""Imaginary step of derivatives: nothing is subtracted, so any that is not lost beside one."""


@dataclass(frozen=True)
class Acceleration:
    """An acceleration that an output asks for, by the names of the states that stand for its components."""

    marker: Marker
    angular: bool
    labels: tuple[str, str, str]


@dataclass
class Frame:
    """Where a marker of a body is at an instant, global components; the ground has the body -1.

    Attributes
    ----------
    body : int
    place, arm : ndarray, shape (3,)
        Origin, and origin from the centre of mass, m; of a body that deforms where it is undeformed.
    axes : ndarray, shape (3, 3)
    """

    body: int
    place: np.ndarray
    arm: np.ndarray
    axes: np.ndarray


def frame_of(instant: Instant, marker: Marker | None) -> Frame:
    """Return where a marker is."""
    assert marker is not None
    body = marker.body
    if body.is_ground:
        return Frame(-1, marker.position, np.zeros(3), marker.orientation)
    number = instant.system.body_names.index(body.name)
    row = instant.pose()[number]
    axes = row[POSE_A:POSE_V].reshape(3, 3)
    arm = axes @ (marker.position - body.com)
    return Frame(number, row[POSE_R:POSE_A] + arm, arm, axes @ marker.orientation)


@dataclass
class _Bent:
    """How a marker moves at an instant, global components.

    Attributes
    ----------
    body : int
    modes : slice
        Of its body among all modal coordinates.
    moved : ndarray, shape (3, modes)
        A Phi.
    spins, twists : tuple of ndarray, shape (3, modes)
        How w changes with q and q', and what follows it above with q, q' and q''.
    arm, moving, bending : ndarray, shape (3,)
        s, d' and d''.
    spinning, twisting : ndarray, shape (3,)
        w, and what follows it.
    spin, start, angular : ndarray, shape (3,)
        omega, a_0 and alpha of the body.
    """

    body: int
    modes: slice
    moved: np.ndarray
    spins: tuple[np.ndarray, ...]
    twists: tuple[np.ndarray, ...]
    arm: np.ndarray
    moving: np.ndarray
    bending: np.ndarray
    spinning: np.ndarray
    twisting: np.ndarray
    spin: np.ndarray
    start: np.ndarray
    angular: np.ndarray


def _bent(bodies: Iterable[Body], instant: Instant, marker: Marker) -> _Bent:
    configuration = instant.configuration()
    acc, bending = configuration.parts(accelerations(instant.system, configuration, instant.t)[0])
    frame, body = frame_of(instant, marker), marker.body
    first = 0
    for other in bodies:
        if other is body:
            break
        first += other.modal.modes if isinstance(other, ModalBody) else 0
    count = body.modal.modes if isinstance(body, ModalBody) else 0
    modes, row = slice(first, first + count), instant.pose()[frame.body]
    axes = row[POSE_A:POSE_V].reshape(3, 3)
    phi, psi = body.shape_at(marker) if isinstance(body, ModalBody) else (np.zeros((0, 3)), np.zeros((0, 3)))
    q, rate, second = configuration.q_f[modes], configuration.v_f[modes], bending[modes]
    moved, angles = axes @ phi.T, tuple(psi.T @ each for each in (q, rate, second))
    (spinning, twisting), slopes = _turning(angles)
    spins = tuple(axes @ slope[0] @ psi.T for slope in slopes[:2])
    twists = tuple(axes @ slope[1] @ psi.T for slope in slopes)
    return _Bent(
        frame.body, modes, moved, spins, twists, frame.arm + moved @ q, moved @ rate, moved @ second, axes @ spinning,
        axes @ twisting, row[POSE_W:], acc[frame.body, 0:3], acc[frame.body, 3:6],
    )  # fmt: skip


def _turned(angles: Sequence[np.ndarray]) -> np.ndarray:
    """Return Y beta' and Y beta'' + Y' beta' in the body's axes, shape (2, 3), of beta, beta' and beta''."""
    (x, y, _), rates, seconds = angles
    first = np.array([1.0, 0.0, 0.0])
    second = np.array([0.0 * x, np.cos(x), np.sin(x)])
    third = np.array([np.sin(y), -np.sin(x) * np.cos(y), np.cos(x) * np.cos(y)])
    axes = np.array([first + 0.0 * x, second, third])
    # each axis turns with the rotations before it
    carried = np.cross(rates[0] * axes[0], axes[1]) * rates[1]
    carried = carried + np.cross(rates[0] * axes[0] + rates[1] * axes[1], axes[2]) * rates[2]
    return np.array([rates @ axes, seconds @ axes + carried])


def _turning(angles: Sequence[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return the same, and how it changes with each of beta, beta' and beta'', shape (2, 3, 3), by complex steps."""
    slopes = []
    for level in range(3):
        slope = np.empty((2, 3, 3))
        for c in range(3):
            moved = [each.astype(complex) for each in angles]
            moved[level][c] += STEP * 1j
            slope[:, :, c] = _turned(moved).imag / STEP
        slopes.append(slope)
    return _turned(angles), slopes


def told_accelerations(bodies: Iterable[Body], instant: Instant, asked: Iterable[Acceleration]) -> dict[str, float]:
    """Return the accelerations that outputs ask for, by the names of the states that stand for them."""
    found: dict[str, float] = {}
    for one in asked:
        at = _bent(bodies, instant, one.marker)
        if one.angular:
            vector = at.angular + np.cross(at.spin, at.spinning) + at.twisting
        else:
            vector = at.start + np.cross(at.angular, at.arm) + np.cross(at.spin, np.cross(at.spin, at.arm))
            vector = vector + 2.0 * np.cross(at.spin, at.moving) + at.bending
        found.update(zip(one.labels, vector.tolist(), strict=True))
    return found


def changed_acceleration(
    bodies: Iterable[Body], instant: Instant, reduced: Reduced, found: Realised, asked: Acceleration
) -> np.ndarray:
    """Return the rows (3, n + inputs) of the change of an acceleration, see the equations of this module."""
    at, count = _bent(bodies, instant, asked.marker), len(instant.system.body_names)
    parts = []
    for rows in found.places:
        all_of = spatial(instant, reduced.turning, rows)
        moved, turned = np.split(all_of[: 6 * count].reshape(2 * count, 3, -1), 2)
        parts.append((moved[at.body], turned[at.body], all_of[6 * count :][at.modes]))
    (_, turn, bent), (_, rate, bent_rate), (moved, second, bent_second) = parts
    spin = skew(at.spin)
    by_rate = rate - spin @ turn
    by_acceleration = second - spin @ rate - skew(at.angular) @ turn
    if asked.angular:
        twisted = at.spins[0] @ bent + at.spins[1] @ bent_rate - skew(at.spinning) @ turn
        twisting = at.twists[0] @ bent + at.twists[1] @ bent_rate + at.twists[2] @ bent_second
        twisting = twisting - skew(at.twisting) @ turn
        return by_acceleration + spin @ twisted - skew(at.spinning) @ by_rate + twisting
    arm = skew(at.arm)
    shift = at.moved @ bent - arm @ turn
    moving = at.moved @ bent_rate - skew(at.moving) @ turn
    bending = at.moved @ bent_second - skew(at.bending) @ turn
    out = moved - arm @ by_acceleration + skew(at.angular) @ shift
    out = out - skew(spin @ at.arm) @ by_rate - spin @ arm @ by_rate + spin @ spin @ shift
    return out - 2.0 * skew(at.moving) @ by_rate + 2.0 * spin @ moving + bending
