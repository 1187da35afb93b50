"""Small rotations in axes that do not turn with the bodies, for the modes of what spins.

Changes of Euler angles, delta theta, have coefficients that change while a body turns, also where the motion is
steady. Small rotations delta phi in global axes do not: with omega = B zeta, the axes of the angles as columns of B,

    delta theta = T delta phi,  T = B^-1,      delta zeta = T delta phi' + T' delta phi,

and the changes of the momenta are delta p = M delta zeta + N delta theta = A1 delta phi' + A0 delta phi with

    A1 = M T,   A0 = M T' + N T.

Virtual work of small rotations puts T^T before the equations, which become

    T^T A1 delta phi'' + T^T (A1' + A0 + D T) delta phi' + T^T (A0' + D T' + S T) delta phi = 0,

D and S the derivatives of the loads and constraint forces with respect to the velocities and the coordinates. The
rates T', A1' and A0' are taken along the present rotation of each body, its modal coordinates at rest in it. Where all
that turns is alike about its axis the coefficients are constant, and the eigenvalues are those of the whirl.

No difference quotients are needed. The axes turn each other, T' = -T B' T, and of the angular momentum L = J omega + C
v_f, whose conjugate to the angles is B^T L, the change is delta L = J delta phi' - L~ delta phi + C delta v_f + G
delta q_f, with a~ b = a x b. All of its coefficients turn with the body,

    J' = omega~ J - J omega~,   C' = omega~ C,   L' = omega x L + J omega',   G' = omega~ G + G_omega',

and what moves the axes in B^T L is W, (b_j x b_i) . L for j < i.

Modal coordinates of a body that is alike about its axis are described likewise, delta q_f = exp(-Omega t G) delta r
with the generator G of `gearmbs.dae.analyses.turning`, which is a further block of T.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.equations import layout as tables
from gearmbs.dae.equations.bodies.inertia import ModalInertia
from gearmbs.dae.equations.rotation import KIN_ADOT, KIN_AXES, POSE_A, POSE_V, POSE_W

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

RESTS = 1e-6
"""Angular velocity, rad/s, and speed by the size of the mechanism, 1/s, up to which a body is at rest: its square,
which counts, is rounding."""

UNBALANCED = 1e-6
"""Rate of a momentum, N and N m, and acceleration, m/s^2, up to which a mechanism at rest is in balance."""

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
    turn = skew(axis)
    return turn @ values - values @ turn


def _crossed(axis: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.cross(axis, values)


@dataclass
class Turning:
    """The transformation at one instant, and the inertial part of the equations in axes that do not turn.

    Attributes
    ----------
    transform, transform_rate : ndarray, shape (n, n)
        T and T', for all coordinates (R, theta, q_f).
    mass, damping, stiffness : ndarray, shape (n, n)
        T^T A1, T^T (A1' + A0) and T^T A0'.
    rate_terms, damping_terms, stiffness_terms : ndarray, shape (n, n)
        Sums of the absolute values of the terms of T', ``damping`` and ``stiffness``.
    """

    transform: np.ndarray
    transform_rate: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    rate_terms: np.ndarray
    damping_terms: np.ndarray
    stiffness_terms: np.ndarray


def turning(instant: Instant) -> Turning | None:
    """Return the transformation at an instant; None where no body turns, or begins to by joints."""
    velocities = angular_velocities(instant)
    if not velocities.any() and not leaves_rest(instant):
        return None
    y, eps = instant.y.copy(), instant.block("eps", "v_f")
    mass, place = _momenta(instant, y)
    kin = tables.kinematics_in(instant.idata, instant.work)[1:].copy()
    angles, modes = (instant.at[name] - instant.at["R"] for name in ("theta", "q_f"))
    momenta = (mass[:, angles:] @ y[instant.block("eps", "R")])[angles:modes].reshape(-1, 3)
    euler = instant.problem.yp0[eps].reshape(-1, 3)
    to, turned, spin, couple, couple_rate, own, own_rate = (np.zeros_like(mass) for _ in range(7))
    to[:] = np.eye(len(mass))
    change = y.copy()
    change[instant.block("u", "R")] = 0.0
    for k, body in enumerate(instant.system.model.counts.turning):
        three = slice(angles + 3 * k, angles + 3 * k + 3)
        axes, rates = (kin[body, at : at + 9].reshape(3, 3) for at in (KIN_AXES, KIN_ADOT))
        inverse = np.linalg.inv(axes.T)
        momentum, acceleration = inverse.T @ momenta[k], axes.T @ euler[k] + rates.T @ y[eps].reshape(-1, 3)[k]
        change[eps[3 * k : 3 * k + 3]] = inverse @ acceleration
        driven = inverse.T @ mass[three, three] @ inverse @ acceleration
        momentum_rate = np.cross(velocities[body], momentum) + driven
        to[three, three], turned[three, three] = inverse, (rates.T @ inverse).T
        spin[three, three] = skew(velocities[body])
        couple[three, three], couple_rate[three, three] = -skew(momentum), -skew(driven)
        # each axis is turned by the angles before it
        across = np.cross(axes[:, None], axes)
        across_rate = np.cross(rates[:, None], axes) + np.cross(axes[:, None], rates)
        own[three, three] = np.tril((across @ momentum).T, -1)
        own_rate[three, three] = np.tril((across_rate @ momentum + across @ momentum_rate).T, -1)
    mass = to.T @ mass @ to
    couple[:, modes:] = (to.T @ place)[:, modes:]
    couple_rate[:, modes:] = (to.T @ _momenta(instant, change)[1])[:, modes:]
    modal, modal_change = _modal_rates(instant, velocities, len(mass))
    rate, rate_terms = _added((-to, turned.T), (to, modal))
    damping, damping_terms = _added(
        (turned, mass), (spin, mass), (mass, spin.T), (2.0 * mass, modal), (couple,), (to.T, own, to)
    )
    stiffness, stiffness_terms = _added(
        (turned, mass, modal),
        (turned, couple),
        (spin, mass, modal),
        (mass, spin.T, modal),
        (mass, modal_change),
        (spin, couple),
        (couple, spin.T),
        (couple_rate,),
        (couple, modal),
        (to.T, own_rate, to),
        (-to.T, own, to, turned.T),
    )
    return Turning(to, rate, mass, damping, stiffness, rate_terms, damping_terms, stiffness_terms)


def leaves_rest(instant: Instant) -> bool:
    """Return whether nothing moves yet in a motion that constraints guide."""
    if not instant.released or instant.at["lambda"] == instant.at["F"]:
        return False
    pose = instant.pose()
    moving = max(np.abs(pose[:, POSE_W:]).max(), np.abs(pose[:, POSE_V:POSE_W]).max() / instant.system.length)
    if moving > RESTS or np.abs(instant.y[instant.block("v_f", "R")]).max(initial=0.0) > RESTS:
        return False
    rates = instant.problem.yp0[instant.block("u", "eps")]
    return bool(np.abs(rates).max(initial=0.0) > UNBALANCED)


def _added(*products: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return a sum of products of matrices, and that of the absolute values of its terms."""
    values = [reduce(np.matmul, one) for one in products]
    sizes = [reduce(np.matmul, map(np.abs, one)) for one in products]
    return np.sum(values, axis=0), np.sum(sizes, axis=0)


def skew(vector: np.ndarray) -> np.ndarray:
    """Return the matrix a~ with a~ b = a x b."""
    return np.cross(vector, np.eye(3)).T


def angular_velocities(instant: Instant) -> np.ndarray:
    """Return the global angular velocities, rad/s, shape (bodies, 3)."""
    return instant.pose()[:, POSE_W:]


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


def _modal_rates(instant: Instant, velocities: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return F' and F'', shape (n, n), of modal coordinates F r, F = exp(-Omega t G)."""
    first, second = np.zeros((n, n)), np.zeros((n, n))
    ends = n - sum(instant.system.model.modes[1:]) + np.cumsum([0, *instant.system.model.modes[1:]])
    for k, speed, found in spinning_modes(instant, velocities):
        if found is not None:
            own = slice(int(ends[k]), int(ends[k + 1]))
            first[own, own] = -speed * found.matrix
            second[own, own] = first[own, own] @ first[own, own]
    return first, second


def _momenta(instant: Instant, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return M and N of delta p = M delta v + N delta q at y."""
    matrix = instant.matrix(y)
    mass = instant.mass_matrix(matrix).toarray()
    place = np.zeros_like(mass)
    eps = instant.block("eps", "R")
    half = mass.shape[0] - eps.size
    place[half:, half:] = -matrix[eps][:, instant.block("theta", "lambda")].toarray()
    return mass, place
