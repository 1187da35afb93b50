"""Axes that turn with the directions in which joints let bodies move, for the modes of what turns steadily.

In axes at rest the changes x of (R, phi, q_f) obey M x'' + C x' + K x + J^T lambda = 0 and J x = 0 (see
`gearmbs.dae.analyses.turning`). Where J turns, x = T z with J T = 0 at all times has a basis T that turns, too, and

    T^T (M T z'' + (2 M T' + C T) z' + (M T'' + C T' + K T) z) = 0.

In a steady motion a chain of bodies turns as a whole, at an angular velocity w: its centrifugal accelerations are those
of M T''. With W, which has w~ for each three components of R and phi and the generator of modal coordinates that are
described in axes at rest, and the rates Z at which the coordinates z are turned back,

    T' = W T - T Z,    T'' = W T' - T' Z.

Z is zero for coordinates that turn with the chain. Those that are components of the same vector are taken in axes at
rest where this leaves the coefficients constant, as for all that whirls. Whether they are is looked at, a hundredth of
a radian before and after: J T = 0, and the same masses, damping and stiffness. Chains of which J and M stand still in
axes at rest stay there, and need neither W nor Z; changes of their stiffness, as in a mesh, are not looked at.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import expm
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.turning import leaves_rest, skew, spinning_modes
from gearmbs.dae.equations.rotation import POSE_V, POSE_W
from gearmbs.dae.model.model import Configuration
from gearmbs.dae.model.system import accelerations
from gearmbs.dae.problem import ModelError

LOOK = 1e-2
"""Angle, rad, before and after at which is looked: a step of the motion's integration leaves out 1e-10, and 1e-7 where
axes of rotation turn."""

STILL = 2e-6
"""Change of J T, of masses, stiffness and damping that counts as none, of their terms: what turns the wrong way has
1e-2, and weight at the bottom of a swing 9e-6."""

FREE_BODIES = 20
"""Bodies, the first of all, whose axes are tried at rest: carriers come before what they carry."""

RUNGE_KUTTA = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0

SLOWEST = 1e-6
"""Angular velocity, rad/s, up to which nothing turns: its square is rounding."""

SLOW = 1e-9
"""Speed, of the largest, that is rounding."""


@dataclass
class GivenInputs:
    """What inputs do in all coordinates.

    Attributes
    ----------
    force, state : list of ndarray, shapes (n, inputs), (states, inputs)
        Forces on the left-hand side, and rates of states, by u and u'.
    place : ndarray, shape (rows, inputs)
        Phi_u.
    """

    force: list[np.ndarray]
    state: list[np.ndarray]
    place: np.ndarray


@dataclass
class Linearised:
    """M x'' + C x' + K x + H z + J^T lambda = 0, J x = 0 and z' = P x + Q x' + S z in all coordinates x.

    Where bodies turn x has small rotations in axes at rest; see `gearmbs.dae.analyses.turning`.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    damping_terms: np.ndarray
    stiffness_terms: np.ndarray
    constraint: np.ndarray
    state_force: np.ndarray
    state_position: np.ndarray
    state_velocity: np.ndarray
    state_state: np.ndarray
    force_reaction: np.ndarray
    own_reaction: np.ndarray
    state_reaction: np.ndarray
    transform: np.ndarray | None
    inputs: GivenInputs | None = None

    def within(self, rows: np.ndarray) -> Linearised:
        """Return the equations of some coordinates alone."""
        names = ("mass", "damping", "stiffness", "damping_terms", "stiffness_terms")
        own = {name: getattr(self, name)[np.ix_(rows, rows)] for name in names}
        return replace(self, constraint=self.constraint[:, rows], **own)


@dataclass(frozen=True)
class Basis:
    """T with its rates.

    Attributes
    ----------
    now, first, second : ndarray, shape (n, dof)
        T, T' and T''.
    axes : ndarray, shape (bodies, 3)
        w of the chain that each body belongs to, rad/s.
    varying : list of list of str
        Bodies of each chain whose coefficients are constant in no axes.
    turn : ndarray, shape (n, n)
        W.
    along : Along or None
        How J changes along a motion that is not steady.
    """

    now: np.ndarray
    first: np.ndarray
    second: np.ndarray
    axes: np.ndarray
    varying: list[list[str]]
    turn: np.ndarray
    along: Along | None = None


@dataclass(frozen=True)
class Along:
    """Rates of the constraints along a motion, for bases whose independent coordinates stay what they are.

    From J T = 0 at all times J T' = -J' T and J T'' = -J'' T - 2 J' T', and so for T_u, for J T_u is constant.

    Attributes
    ----------
    constraint, first, second : ndarray, shape (rows, n)
        J, J' and J''.
    anchors : ndarray of int
        Independent coordinates.
    rows : ndarray of bool, shape (n,)
        Coordinates of the bodies whose motion is not steady.
    """

    constraint: np.ndarray
    first: np.ndarray
    second: np.ndarray
    anchors: np.ndarray
    rows: np.ndarray

    def rates(self, now: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first and second rates of columns such as T, those of other bodies zero."""
        dependent = np.setdiff1d(np.arange(self.constraint.shape[1]), self.anchors)
        inverse = np.linalg.pinv(self.constraint[:, dependent])
        first, second = np.zeros_like(now), np.zeros_like(now)
        first[dependent] = -inverse @ (self.first @ now)
        second[dependent] = -inverse @ (self.second @ now + 2.0 * self.first @ first)
        return first * self.rows[:, None], second * self.rows[:, None]


def weights(instant: Instant) -> np.ndarray:
    """Return what makes lengths of the changes of coordinates (R, theta, q_f), m, shape (n,)."""
    arm = max(min(instant.system.length, 1.0), 1e-3)
    moves, turns, modes = (instant.at[name] for name in ("R", "theta", "q_f"))
    sizes = instant.system.model.modal_sizes[:, 0]
    return np.concatenate([np.ones(turns - moves), np.full(modes - turns, arm), arm / sizes])


def turning_basis(
    instant: Instant, basis: np.ndarray, anchors: np.ndarray, here: Linearised, linearised: Callable
) -> Basis:
    """Return a basis of the allowed motions with its rates.

    Parameters
    ----------
    instant : Instant
    basis : ndarray, shape (n, dof)
        T at the instant.
    anchors : ndarray of int, shape (dof,)
        The coordinate that each column moves and no other column does.
    here : Linearised
        The equations of the instant.
    linearised : callable
        Makes them of an instant.
    """
    velocity = instant.configuration().pose[:, POSE_V:]
    axes = np.zeros((len(velocity), 3))
    none = Basis(basis, np.zeros_like(basis), np.zeros_like(basis), axes, [], np.zeros((len(basis),) * 2))
    if not basis.shape[1]:
        return none
    leaves = leaves_rest(instant)
    if leaves or not velocity.any():
        owner = _owners(instant)
        way = along(instant, here, anchors, np.ones(len(owner), dtype=bool)) if leaves else None
        return none if way is None else replace(none, second=way.rates(basis)[1], along=way)
    acceleration = instant.system.accelerations(instant.configuration(), instant.t)[0]
    owner = _owners(instant)
    label = _chains(here.constraint, owner, len(velocity))
    fastest = np.abs(velocity[:, :3]).max() + instant.system.length * np.abs(velocity[:, 3:]).max()
    chains = [label == k for k in range(label.max() + 1)]
    length = instant.system.length
    rates = [_rates(velocity[one], acceleration[one], SLOW * fastest, length) for one in chains]
    largest = max((float(np.linalg.norm(w)) for own in rates for w in own), default=0.0)
    if largest <= SLOWEST:
        return none
    # what turns slowly, and is braked or driven hard, is looked at where its acceleration has turned it
    driven = np.sqrt(np.linalg.norm(acceleration[:, 3:], axis=1).max())
    step = LOOK / max(largest, float(driven))
    try:
        near = [(h, linearised(_later(instant, h))) for h in (-step, step)]
    except ModelError:
        return replace(none, varying=[list(instant.system.body_names)])
    generators, weight = _generators(instant), weights(instant)
    turn, back, varying = np.zeros((len(basis),) * 2), np.zeros((basis.shape[1],) * 2), []
    changing = np.zeros(len(velocity), dtype=bool)
    seen_turn = np.zeros_like(turn)
    for k, own in enumerate(rates):
        rows = np.flatnonzero(label[owner] == k)
        columns = np.flatnonzero(label[owner[anchors]] == k)
        if not columns.size or not own:
            continue
        places = np.searchsorted(rows, anchors[columns])
        parts = [(h, there.within(rows)) for h, there in near]
        chain = _Chain(
            basis[np.ix_(rows, columns)], places, here.within(rows), parts, largest, weight[rows], owner[rows]
        )
        speeds = (np.zeros(3), *(w for w in own if np.linalg.norm(w) > SLOW * largest))
        least, kept = _best_axes(
            chain, speeds, partial(_turned, instant, rows=rows, owner=owner, generators=generators)
        )
        if least > 1.0:
            varying.append([instant.system.body_names[b] for b in np.flatnonzero(label == k)])
            changing |= label == k
        elif kept is not None:
            within = np.ix_(rows, rows)
            axes[label == k], turn[within], seen_turn[within], back[np.ix_(columns, columns)] = kept
    if axes.any() and not varying and len(chains) > 1:
        # loads between chains that turn differently
        every = _Chain(basis, anchors, here, near, largest, weight, owner)
        if not every.change(turn, seen_turn, back, forces=True) <= 1.0:
            varying.append([instant.system.body_names[b] for b in np.flatnonzero(axes.any(axis=1))])
    first = turn @ basis - basis @ back
    second = turn @ first - first @ back
    way = along(instant, here, anchors, changing[owner]) if changing.any() else None
    if way is not None:
        more = way.rates(basis)
        first, second = first + more[0], second + more[1]
    return Basis(basis, first, second, axes, varying, turn, way)


def _best_axes(
    chain: _Chain, speeds: Sequence[np.ndarray], turned: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
) -> tuple[float, tuple[np.ndarray, ...] | None]:
    """Return by how much a chain's coefficients change in the axes that serve, of those at some speeds, and w, W, Z."""
    least, kept = np.inf, None
    for w in speeds:
        whole, seen = turned(w)
        for z in chain.choices(whole):
            change = chain.change(whole, seen, z, forces=bool(w.any()))
            if change < least:
                least, kept = change, (w, whole, seen, z)
            # the first that serves: which of several has less rounding would differ between machines
            if least <= 1.0:
                return least, kept
    return least, kept


STENCIL = np.array([[4 / 5, -1 / 5, 4 / 105, -1 / 280], [8 / 5, -1 / 5, 8 / 315, -1 / 560]])
"""Weights of central differences of eighth order, of J(h) - J(-h) for J' and of J(h) + J(-h) for J'', at h to 4 h."""
SPREAD = 0.04
"""Angle, rad, by which bodies turn in h: what is left out of J'' is 1e-13 of it, and rounding, 1e-16/h^2, as much."""


def along(instant: Instant, here: Linearised, anchors: np.ndarray, rows: np.ndarray) -> Along | None:
    """Return the rates of the constraints along the motion; None where modes of deformation are among the coordinates.

    J depends on positions and time alone, so that the path with the same velocities and accelerations has its rates.
    """
    if here.transform is None or instant.at["q_f"] < instant.at["lambda"]:
        return None
    system = instant.system
    bodies, turning = len(system.body_names), system.model.counts.turning
    moves = (6 * np.arange(bodies)[:, None] + np.arange(3)).ravel()
    turns = (6 * turning[:, None] + np.arange(3, 6)).ravel()

    def constraint(there: Configuration, time: float) -> np.ndarray:
        return system.constraint_jacobian(there, time)[0].toarray()[:, np.concatenate([moves, turns])]

    return Along(here.constraint, *path_rates(instant, constraint), anchors, rows)


def path_rates(
    instant: Instant, rows: Callable[[Configuration, float], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return the first and second rates of a function of configuration and time along the motion."""
    now, t = instant.configuration(), instant.t
    speeds, changes = now.velocities, accelerations(instant.system, now, t)[0]
    size = max(float(np.abs(speeds).max()), float(np.sqrt(np.abs(changes).max())), SLOWEST)
    h = SPREAD / size

    def at(time: float) -> np.ndarray:
        return rows(now.displaced(time * speeds + 0.5 * time**2 * changes), t + time)

    ahead = [at(k * h) for k in range(1, 5)]
    behind = [at(-k * h) for k in range(1, 5)]
    middle = at(0.0)
    first = sum(w * (a - b) for w, a, b in zip(STENCIL[0], ahead, behind, strict=True)) / h
    second = sum(w * (a + b - 2.0 * middle) for w, a, b in zip(STENCIL[1], ahead, behind, strict=True)) / h**2
    return first, second


@dataclass
class _Chain:
    """What joints connect: its columns of T, and how its coefficients change."""

    basis: np.ndarray
    anchors: np.ndarray
    here: Linearised
    near: list[tuple[float, Linearised]]
    rate: float
    weight: np.ndarray
    bodies: np.ndarray

    def choices(self, turn: np.ndarray) -> Iterator[np.ndarray]:
        """Yield Z: components of the same vectors in axes at rest, then all that turns with the chain."""
        own = self.basis[self.anchors].diagonal()
        components = turn[np.ix_(self.anchors, self.anchors)] * own / own[:, None]
        # of vectors that are whole: which components of others are independent is an accident of pivots
        whole = not np.delete(turn[self.anchors], self.anchors, axis=1).any()
        if whole:
            yield components
        if turn.any():
            # a body that joints to others leave free, as a carrier on springs
            for first in range(0, min(FREE_BODIES, self.bodies.max(initial=-1) + 1)):
                rows = np.flatnonzero(self.bodies == first)[:6]
                part = self.basis[rows] * self.weight[rows, None]
                if rows.size == 6 and np.linalg.matrix_rank(part) == 6:
                    yield np.linalg.pinv(part) @ turn[np.ix_(rows, rows)] @ part
        if not whole:
            yield components
        if turn.any():
            yield np.zeros((own.size, own.size))

    def change(self, turn: np.ndarray, seen: np.ndarray, back: np.ndarray, forces: bool) -> float:
        """Return the largest change of a coefficient over what counts as none; ``seen`` is W in the axes of near."""
        t0, t1 = self.basis, turn @ self.basis - self.basis @ back
        t2 = turn @ t1 - t1 @ back
        mass0, damping0, stiffness0 = self._reduced(self.here, t0, t1, t2)
        inertia = np.sqrt(np.abs(np.diag(mass0)))
        resisted = np.sqrt(np.abs(t0).T @ self.here.stiffness_terms @ np.abs(t0)).diagonal() + self.rate * inertia
        damped = np.sqrt(inertia * resisted + (np.abs(t0).T @ self.here.damping_terms @ np.abs(t0)).diagonal())
        worst = 0.0
        for h, there in self.near:
            across, undone = expm(h * seen), expm(-h * back)
            now = across @ t0 @ undone
            moved = there.constraint @ now
            if moved.size:
                rows = np.abs(there.constraint / self.weight).max(axis=1)[:, None]
                sizes = rows * np.abs(now * self.weight[:, None]).max(axis=0)
                worst = max(worst, float((np.abs(moved) / np.maximum(sizes, 1e-300)).max()) / STILL)
            mass, damping, stiffness = self._reduced(there, now, across @ t1 @ undone, across @ t2 @ undone)
            worst = max(worst, largest(mass - mass0, inertia) / STILL)
            if forces:
                worst = max(worst, largest(damping - damping0, damped) / STILL)
                worst = max(worst, largest(stiffness - stiffness0, resisted) / STILL)
        return worst

    @staticmethod
    def _reduced(lin: Linearised, t0: np.ndarray, t1: np.ndarray, t2: np.ndarray) -> tuple[np.ndarray, ...]:
        mass, damping = lin.mass @ t0, lin.damping @ t0 + 2.0 * lin.mass @ t1
        return t0.T @ mass, t0.T @ damping, t0.T @ (lin.stiffness @ t0 + lin.damping @ t1 + lin.mass @ t2)


def largest(change: np.ndarray, size: np.ndarray) -> float:
    """Return the largest entry of a matrix over the products of the sizes of its row and its column."""
    return float(np.max(np.abs(change) / np.maximum(np.outer(size, size), 1e-300)))


def _owners(instant: Instant) -> np.ndarray:
    """Return the body of each coordinate (R, theta, q_f)."""
    model = instant.system.model
    bodies = np.arange(len(instant.system.body_names))
    return np.concatenate(
        [np.repeat(bodies, 3), np.repeat(model.counts.turning, 3), np.repeat(bodies, model.modes[1:])]
    )


def _chains(constraint: np.ndarray, owner: np.ndarray, bodies: int) -> np.ndarray:
    """Return for each body the number of the chain that constraints make of it and others."""
    rows, columns = np.nonzero(constraint)
    shape = (bodies + len(constraint),) * 2
    links = coo_array((np.ones(rows.size), (bodies + rows, owner[columns])), shape=shape)
    label = connected_components(links, directed=False)[1][:bodies]
    return np.unique(label, return_inverse=True)[1]


def _rates(velocity: np.ndarray, acceleration: np.ndarray, still: float, length: float) -> list[np.ndarray]:
    """Return the angular velocities at which bodies, and the directions of their paths, turn: each once.

    Speeds up to ``still``, m/s, are rounding. Paths of what is at rest a hundredth of the mechanism's ``length``
    away, before or after, turn fast, and nothing with them.
    """
    found: list[np.ndarray] = []
    paths = np.cross(velocity[:, :3], acceleration[:, :3])
    squares = np.square(velocity[:, :3]).sum(axis=1)[:, None]
    least = np.maximum(LOOK * length * np.linalg.norm(acceleration[:, :3], axis=1)[:, None], still**2)
    paths = np.divide(paths, squares, out=np.zeros_like(paths), where=squares > least)
    for w in (*velocity[:, 3:], *paths):
        size = float(np.linalg.norm(w))
        if size > 0.0 and all(np.linalg.norm(w - other) > 1e-9 * size for other in found):
            found.append(w)
    return found


def _later(instant: Instant, h: float) -> Instant:
    """Return the instant that is the time h after another, by a step of the classical Runge-Kutta method."""
    system, now = copy.copy(instant.system), instant.configuration()
    speeds: list[np.ndarray] = []
    changes: list[np.ndarray] = []
    for share in (0.0, 0.5, 0.5, 1.0):
        there = now.displaced(share * h * speeds[-1]).pushed(share * h * changes[-1]) if speeds else now
        speeds.append(there.velocities)
        changes.append(accelerations(system, there, instant.t + share * h)[0])
    moved, pushed = (h * np.tensordot(RUNGE_KUTTA, rates, axes=1) for rates in (speeds, changes))
    system.configuration = now.displaced(moved).pushed(pushed)
    system.t0 = instant.t + h
    out = Instant(system, "I3")
    out.y = out.settle(out.y)
    return out


def _generators(instant: Instant) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Return of bodies whose modal coordinates are described in axes at rest the angular velocity and G."""
    velocities = instant.pose()[:, POSE_W:]
    found = spinning_modes(instant, velocities)
    return {k: (velocities[k], one.matrix) for k, _, one in found if one is not None}


def _turned(
    instant: Instant, w: np.ndarray, rows: np.ndarray, owner: np.ndarray, generators: dict
) -> tuple[np.ndarray, np.ndarray]:
    """Return W of a chain, and W as seen in coordinates whose modal part turns with the bodies."""
    modes = instant.at["q_f"] - instant.at["R"]
    whole = np.zeros((rows.size, rows.size))
    for first in range(0, int(np.sum(rows < modes)), 3):
        whole[first : first + 3, first : first + 3] = skew(w)
    seen = whole.copy()
    for body, (spin, matrix) in generators.items():
        own = np.flatnonzero((rows >= modes) & (owner[rows] == body))
        if own.size:
            speed = float(np.linalg.norm(spin))
            share = float(w @ spin) / speed
            whole[np.ix_(own, own)], seen[np.ix_(own, own)] = share * matrix, (share - speed) * matrix
    return whole, seen
