"""Small rotations in axes that do not turn with the bodies, for the modes of what spins.

Changes of Euler angles, delta theta, have coefficients that change while a body turns, also where the motion is
steady. Small rotations delta phi in global axes do not: with omega = B zeta, the axes of the angles as columns of B,

    delta theta = T delta phi,  T = B^-1,      delta zeta = T delta phi' + T' delta phi,

and the changes of the momenta are delta p = M delta zeta + N delta theta = A1 delta phi' + A0 delta phi with

    A1 = M T,   A0 = M T' + N T.

Virtual work of small rotations puts T^T before the equations, which become

    T^T A1 delta phi'' + T^T (A1' + A0 + D T) delta phi' + T^T (A0' + D T' + S T) delta phi = 0,

D and S the derivatives of the loads and constraint forces with respect to the velocities and the coordinates. The
rates T', A1' and A0' are taken along a steady rotation, each body about its present angular velocity. Where all that
turns is alike about its axis the coefficients are constant, and the eigenvalues are those of the whirl.

Modal coordinates of a body that is alike about its axis are described likewise, delta q_f = exp(-Omega t G) delta r
with the generator G of `gearmbs.dae.analyses.turning`, which is a further block of T.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from gearmbs.dae.analyses.kinematics import ROUNDING, Instant
from gearmbs.dae.equations.bodies.inertia import ModalInertia
from gearmbs.dae.equations.kinematics.rotation import POSE_A, POSE_V

# How the modes of a body that is alike about an axis turn with it, for the whirl of flexible bodies.
#
# Turned about the axis a by the angle phi, a deformation with the modal coordinates q is one with exp(phi G) q, where
# the generator G is antisymmetric and links modes of equal frequency: by 1 the two planes in which a shaft bends, by n
# those of n waves round about. It follows from the integrals of the shapes, which turn as tensors of the body do:
#
#     J1(G q) = [a~, J1(q)],   J2(G q, p) + J2(q, G p) = [a~, J2(q, p)],   C1(G q, p) + C1(q, G p) = a x C1(q, p),
#
# C1 without its symmetric part, which is a total derivative and depends on the order of small rotations. The
# coordinates r = exp(Omega t G) q of a body that spins do not turn with it: as displacements of a shaft in axes at
# rest.


EQUAL = 1e-6
"""Relative distance of squared frequencies, and of damping, of modes that may turn into each other."""

ALIKE = 1e-5
"""Largest part of the integrals that may change when a body is turned that counts as alike all round."""


@dataclass(frozen=True, eq=False)
class Generator:
    """How modal coordinates turn about an axis.

    Attributes
    ----------
    matrix : ndarray, shape (n, n)
        G; the smallest one where the integrals do not tell.
    known : bool
        False if there are pairs of equal frequency of which they do not tell, as of three waves and more.
    gyroscopic : bool
        False if there are pairs that turn, and the body's coupling leaves their gyroscopic terms out.
    """

    matrix: np.ndarray
    known: bool
    gyroscopic: bool


def generator(modal: ModalInertia, axis: np.ndarray) -> Generator | None:
    """Return the generator of a body's modes about an axis, None if the body is not alike about it.

    Parameters
    ----------
    modal : ModalInertia
    axis : ndarray, shape (3,)
        Of length 1, in body components.
    """
    pairs = _pairs(modal)
    length = np.sqrt(np.diag(modal.mass))
    tensors = [
        (modal.j1 / length[:, None, None], 1, _commuted),
        (modal.j2 / np.multiply.outer(length, length)[:, :, None, None], 2, _commuted),
        (0.5 * (modal.c1 - np.swapaxes(modal.c1, 0, 1)) / np.multiply.outer(length, length)[:, :, None], 2, _crossed),
    ]
    columns: list[list[np.ndarray]] = [[] for _ in pairs]
    wanted = []
    for values, modes, turned in tensors:
        size = max(float(np.abs(values).max(initial=0.0)), 1e-300)
        wanted.append(turned(axis, values / size).ravel())
        for column, (k, m) in zip(columns, pairs):
            column.append(_changed(values / size, k, m, modes).ravel())
    target = np.concatenate(wanted)
    matrix = np.zeros((modal.modes, modal.modes))
    if not pairs:
        return Generator(matrix, True, True) if np.abs(target).max(initial=0.0) <= ALIKE else None
    system = np.column_stack([np.concatenate(column) for column in columns])
    left, sizes, right = np.linalg.svd(system, full_matrices=False)
    rank = int(np.sum(sizes > ALIKE * max(1.0, sizes[0])))
    speeds = right[:rank].T @ ((left.T @ target)[:rank] / sizes[:rank])
    # integrals may tell how two pairs turn against each other, and not how either does
    known = bool(np.allclose(np.square(right[:rank]).sum(axis=0), 1.0, atol=ALIKE))
    if np.abs(system @ speeds - target).max() > ALIKE:
        return None
    for speed, (k, m) in zip(speeds, pairs):
        matrix[k, m], matrix[m, k] = -speed * length[m] / length[k], speed * length[k] / length[m]
    for form in (modal.mass, modal.stiffness, modal.damping):
        if np.abs(form @ matrix + matrix.T @ form).max() > ALIKE * np.abs(form).max():
            return None
    return Generator(matrix, known, bool(modal.c1.any()) or not matrix.any())


def _pairs(modal: ModalInertia) -> list[tuple[int, int]]:
    """Return the pairs of modes that have the same frequency and damping."""
    mass = np.diag(modal.mass)
    stiffness, damping = np.diag(modal.stiffness) / mass, np.diag(modal.damping) / mass
    return [
        (k, m)
        for k in range(modal.modes)
        for m in range(k + 1, modal.modes)
        if abs(stiffness[k] - stiffness[m]) <= EQUAL * stiffness[m]
        and abs(damping[k] - damping[m]) <= EQUAL * np.sqrt(stiffness[m]) + EQUAL * damping[m]
    ]


def _changed(values: np.ndarray, k: int, m: int, modes: int) -> np.ndarray:
    """Return the rate of integrals while mode k becomes m and m becomes -k, at one radian a unit of time."""
    out = np.zeros_like(values)
    out[k] += values[m]
    out[m] -= values[k]
    if modes == 2:
        out[:, k] += values[:, m]
        out[:, m] -= values[:, k]
    return out


def _commuted(axis: np.ndarray, values: np.ndarray) -> np.ndarray:
    turn = np.cross(axis, np.eye(3)).T
    return turn @ values - values @ turn


def _crossed(axis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.cross(axis, values)


EPS = float(np.finfo(float).eps)

WEIGHTS = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
"""Of five values, for their rate in the middle to fourth order."""
REACH = 4

TRUNCATION = 2.0 * math.factorial(5) / 30.0
"""Error of a rate of rates, by the fourth power of the angle between the places: each rate has 1/30 of the fifth
derivative, which of T, singular about one radian away, is about 5!."""
ROUNDING_OF_RATES = float(np.abs(WEIGHTS).sum()) ** 2 * EPS
"""The same from rounding, by the inverse square of that angle."""
TURN = (0.5 * ROUNDING_OF_RATES / TRUNCATION) ** (1.0 / 6.0)
"""Angle, rad, between the places at which rates are differenced: where the sum of both errors is least."""
OTHER_TURN = 1.4 * TURN
"""A second such angle: what rates differ by is their error, as rounding falls by half and truncation grows fourfold."""
MISSED = 10.0
"""Ratio of an error to this difference, at most: of entries that happen to differ by less than others."""


@dataclass
class Turning:
    """The transformation and its rates at one instant.

    Attributes
    ----------
    transform, transform_rate : ndarray, shape (n, n)
        T and T', for all coordinates (R, theta, q_f).
    momentum_rate, momentum_place : ndarray, shape (n, n)
        A1 and A0.
    momentum_rate_change, momentum_place_change : ndarray, shape (n, n)
        A1' and A0'.
    steps : ndarray, shape (n,)
        Times between the places they are differenced over, of the body of each coordinate, s.
    """

    transform: np.ndarray
    transform_rate: np.ndarray
    momentum_rate: np.ndarray
    momentum_place: np.ndarray
    momentum_rate_change: np.ndarray
    momentum_place_change: np.ndarray
    steps: np.ndarray

    def terms(self, other: Turning) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the sizes of the terms of the rates T', A1' and A0', from those with `OTHER_TURN`.

        Of them errors are the part that is rounding in coefficients that are not differenced.
        """
        of_both = [
            (turn.transform_rate, turn.momentum_rate_change, turn.momentum_place_change) for turn in (self, other)
        ]
        t, a1, a0 = (np.abs(one) + MISSED / ROUNDING * np.abs(one - two) for one, two in zip(*of_both, strict=True))
        # both may be off alike by what the last digits are worth
        digits = np.abs(WEIGHTS).sum() * EPS / ROUNDING / self.steps[:, None]
        return t + digits * np.abs(self.transform), a1 + digits * np.abs(self.momentum_rate), a0


def turning(instant: Instant, angle: float = TURN) -> Turning | None:
    """Return the transformation at an instant, its rates from places ``angle`` apart; None where no body turns."""
    y = instant.y.copy()
    velocities = angular_velocities(instant)
    fastest = float(np.abs(velocities).max(initial=0.0))
    if not fastest > 0.0:
        return None
    accelerations = _angular_accelerations(instant, velocities)
    own = np.maximum(np.abs(velocities).max(axis=1), np.sqrt(np.abs(accelerations).max(axis=1)))
    own = np.where(own > 0.0, own, fastest)
    step = angle / own
    # a row for each coordinate, as that of its body
    modes = instant.system.model.modes[1:]
    turn = instant.system.model.counts.turning
    rows = np.concatenate([np.repeat(step, 3), np.repeat(step[turn], 3), np.repeat(step, modes)])
    spins = spinning_modes(instant, velocities)
    places = [_moved(instant, y, velocities, accelerations, k * step) for k in range(-REACH, REACH + 1)]
    transforms = np.array(
        [_transform(instant, place, spins, k * step) for k, place in zip(range(-REACH, REACH + 1), places, strict=True)]
    )
    middle = range(REACH - 2, REACH + 3)
    rates = np.array([_rate(transforms[k - 2 : k + 3], rows) for k in middle])
    momenta = [_momenta(instant, places[k]) for k in middle]
    first = np.array([mass @ transforms[k] for k, (mass, _) in zip(middle, momenta, strict=True)])
    zeroth = np.array(
        [mass @ rate + moved @ transforms[k] for k, rate, (mass, moved) in zip(middle, rates, momenta, strict=True)]
    )
    instant.y = y
    return Turning(transforms[REACH], rates[2], first[2], zeroth[2], _rate(first, rows), _rate(zeroth, rows), rows)


def _rate(values: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the rate in the middle of five values, in each row a step of its own apart."""
    return np.tensordot(WEIGHTS, values, 1) / steps[:, None]


def _axes(instant: Instant, y: np.ndarray) -> np.ndarray:
    """Return B of each body with angles, shape (turning, 3, 3): its columns are the axes of the angles."""
    instant.y = y
    return np.swapaxes(instant.axes()[instant.system.model.counts.turning], 1, 2)


def angular_velocities(instant: Instant) -> np.ndarray:
    """Return the global angular velocities, rad/s, shape (bodies, 3)."""
    counts, y = instant.system.model.counts, instant.y
    zeta = y[instant.block("eps", "v_f")].reshape(-1, 3)
    velocities = np.zeros((counts.bodies, 3))
    velocities[counts.turning] = np.einsum("bck,bk->bc", _axes(instant, y), zeta)
    return velocities


def _angular_accelerations(instant: Instant, velocities: np.ndarray) -> np.ndarray:
    """Return the global angular accelerations, rad/s^2, shape (bodies, 3): B zeta' and what B changes along omega."""
    y, eps, turn = instant.y.copy(), instant.block("eps", "v_f"), instant.system.model.counts.turning
    axes = _axes(instant, y)
    rates = instant.problem.yp0[eps].reshape(-1, 3)
    size = np.abs(velocities).max(axis=1)
    steps = TURN / np.where(size > 0.0, size, size.max())
    still = np.zeros_like(velocities)
    places = [_moved(instant, y, velocities, still, k * steps) for k in range(-2, 3)]
    changed = _rate(np.array([place[eps].reshape(-1, 3) for place in places]), steps[turn])
    instant.y = y
    accelerations = np.zeros_like(velocities)
    accelerations[turn] = np.einsum("bck,bk->bc", axes, rates - changed)
    return accelerations


def _moved(
    instant: Instant, y: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Return y after every body has turned for a time of its own with its angular velocity, by a Runge-Kutta step."""
    turn = instant.system.model.counts.turning
    velocities, accelerations, times = velocities[turn], accelerations[turn], times[turn]
    time = np.repeat(times, 3)
    angles = slice(instant.at["theta"], instant.at["q_f"])
    rates = slice(instant.at["eps"], instant.at["v_f"])
    start = y[angles].copy()

    def rate(theta: np.ndarray, part: float) -> np.ndarray:
        place = y.copy()
        place[angles] = theta
        omega = velocities + part * times[:, None] * accelerations
        return np.linalg.solve(_axes(instant, place), omega[:, :, None])[:, :, 0].ravel()

    k1 = rate(start, 0.0)
    k2 = rate(start + 0.5 * time * k1, 0.5)
    k3 = rate(start + 0.5 * time * k2, 0.5)
    k4 = rate(start + time * k3, 1.0)
    out = y.copy()
    out[angles] = start + time / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    out[rates] = rate(out[angles], 1.0)
    return out


def spinning_modes(instant: Instant, velocities: np.ndarray) -> list[tuple[int, float, Generator | None]]:
    """Return of each body with modes that turns its number, its angular speed, and how its modes turn with it."""
    inertia = instant.system.model.modal_inertia[1:]
    axes = instant.pose()[:, POSE_A:POSE_V].reshape(-1, 3, 3)
    out = []
    for k, (modal, velocity) in enumerate(zip(inertia, velocities, strict=True)):
        speed = float(np.linalg.norm(velocity))
        if modal is not None and speed > 0.0:
            out.append((k, speed, generator(modal, axes[k].T @ velocity / speed)))
    return out


def _transform(
    instant: Instant, y: np.ndarray, spins: list[tuple[int, float, Generator | None]], times: np.ndarray
) -> np.ndarray:
    """Return T for all coordinates after a time of each body."""
    first = instant.at["R"]
    n = instant.at["lambda"] - first
    out = np.eye(n)
    inverses = np.linalg.inv(_axes(instant, y))
    for k, inverse in enumerate(inverses):
        at = instant.at["theta"] - first + 3 * k
        out[at : at + 3, at : at + 3] = inverse
    starts = np.concatenate([[0], np.cumsum(instant.system.model.modes[1:])]) + instant.at["q_f"] - first
    for k, speed, found in spins:
        if found is not None:
            own = slice(int(starts[k]), int(starts[k + 1]))
            out[own, own] = expm(-speed * times[k] * found.matrix)
    return out


def _momenta(instant: Instant, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return M and N of delta p = M delta v + N delta q at y."""
    matrix = instant.matrix(y)
    mass = instant.mass_matrix(matrix).toarray()
    place = np.zeros_like(mass)
    eps = instant.block("eps", "R")
    half = mass.shape[0] - eps.size
    place[half:, half:] = -matrix[eps][:, instant.block("theta", "lambda")].toarray()
    return mass, place
