"""The one linearisation of a mechanism, about any of its states, that modes, plants and equilibria are made from.

With changes x of the coordinates (R, theta, q_f), states z of elements, multipliers lambda and inputs u of a plant the
exact Jacobian of the I3 residual G gives

    M x'' + C x' + K x + H z + L lambda + F0 u + F1 u' = 0,    J x + Phi_u u = 0,
    z' = P x + Q x' + S z + S0 u + S1 u' + (by reactions),

applied loads and algebraic states put in. Constraints are eliminated by independent coordinates: x = T q + T_u u with
J T = 0 and J T_u = -Phi_u, where T has the identity in the rows of the independent ones. T^T L = 0 unless loads follow
reactions, and

    T^T (M T q'' + (C T + 2 M T') q' + (K T + C T' + M T'') q + H z) + U0 u + U1 u' + U2 u'' = 0

is what is left, with U2 = T^T M T_u and so on: T', T_u' of axes that turn, see `gearmbs.dae.analyses.steady`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr, solve_triangular

from gearmbs.dae.analyses.coordinates import (
    Chosen,
    JointCoordinate,
    Triple,
    chosen,
    departure,
    in_coordinates,
    put_back,
)
from gearmbs.dae.analyses.kinematics import ROUNDING, Instant
from gearmbs.dae.analyses.steady import Basis, GivenInputs, Linearised, turning_basis, weights
from gearmbs.dae.analyses.turning import Turning, leaves_rest, turning
from gearmbs.dae.problem import ModelError
from gearmbs.wording import warn

DEPENDENT = 1e-10
"""Pivot, of the largest, below which constraints count as dependent."""


def allowed_motions(constraint: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a basis of the null space of the constraints: some coordinates move by one each, the others follow.

    The second array has the former, one for each column, shape (dof,). Unlike an orthonormal basis it keeps parts that
    have nothing to do with each other apart, exactly.
    """
    rows, n = constraint.shape
    if rows == 0:
        return np.eye(n), np.arange(n)
    upper, order = qr(constraint, mode="r", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int(np.sum(pivots > DEPENDENT * pivots[0]))
    basis = np.zeros((n, n - rank))
    basis[order[rank:]] = np.eye(n - rank)
    basis[order[:rank]] = -solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    return basis, order[rank:]


NAMED = 6
"""Bodies of a chain that a remark names; more would hide what it says."""

NEIGHBOURS = 3
"""Points at which rounding is tried: with one, changes of some coefficients would vanish by chance."""

LAST_DIGITS = 8.0 * float(np.finfo(float).eps)
"""Change of coordinates that is lost in the sums that lead to the length of a spring."""

JUMP = 1e-9
"""Change of a coefficient, of the largest, by changes of `LAST_DIGITS` above which it is no rounding: that of a spring
is 2e-15 times its distance from the origin over its length."""


@dataclass(frozen=True)
class Inputs:
    """What inputs u do to the residual: its derivatives.

    Attributes
    ----------
    value, rate : ndarray, shape (unknowns, inputs)
        By u and by u', in the rows of G of the I3 formulation.
    """

    value: np.ndarray
    rate: np.ndarray


@dataclass(frozen=True)
class Driven:
    """What inputs do in the motions that the constraints allow; an entry for u, u' and u''.

    Attributes
    ----------
    force : tuple of ndarray, shape (dof, inputs)
        U0, U1 and U2 of M q'' + C q' + K q + H z + U0 u + U1 u' + U2 u'' = 0.
    state : tuple of ndarray, shape (states, inputs)
        V0, V1 and V2 of z' = P q + Q q' + S z + V0 u + V1 u' + V2 u''.
    place : tuple of ndarray, shape (n, inputs)
        T_u, T_u' and T_u'': where the coordinates are put by inputs that prescribe them.
    """

    force: tuple[np.ndarray, ...]
    state: tuple[np.ndarray, ...]
    place: tuple[np.ndarray, ...]


@dataclass
class Reduced:
    """M x'' + C x' + K x + H z = 0 and z' = P x + Q x' + S z in the motions the constraints allow.

    ``basis`` has a column of changes of (R, theta, q_f) for each entry of x; ``stiffness_terms`` and ``damping_terms``
    are the sums of the absolute values of the terms each coefficient is made of, against which rounding is to be held.
    ``motion`` is T with its rates, in coordinates with small rotations in axes at rest where something is ``turning``,
    and ``driven`` what inputs do. ``coordinates`` are x where the motion is not steady and joints were given, and
    ``unbalanced`` tells which of them is pushed, of a mechanism at rest.
    """

    basis: np.ndarray
    stiffness_terms: np.ndarray
    damping_terms: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    state_force: np.ndarray
    state_position: np.ndarray
    state_velocity: np.ndarray
    state_state: np.ndarray
    motion: Basis
    turning: bool
    driven: Driven | None = None
    coordinates: Chosen | None = None
    unbalanced: str = ""

    @property
    def axes(self) -> np.ndarray:
        """How fast the axes turn in which each body's motions are described, rad/s, shape (bodies, 3)."""
        return self.motion.axes

    @property
    def varying(self) -> list[list[str]]:
        """Bodies of each chain whose coefficients are constant in no axes; see `gearmbs.dae.analyses.steady`."""
        return self.motion.varying


def reduce(
    instant: Instant,
    inputs: Inputs | None = None,
    joints: Sequence[JointCoordinate] | None = None,
    balance: bool = False,
) -> Reduced:
    """Linearise an I3 problem about an instant and project it on the motions allowed by its constraints.

    Parameters
    ----------
    instant : Instant
    inputs : Inputs, optional
        Of a plant.
    joints : sequence of JointCoordinate, optional
        Where the motion is not steady, so that what follows depends on the coordinates, these are taken, as far as they
        go; with inputs also at rest.
    balance : bool
        Whether what is at rest is to be looked at for what pushes it.

    Raises
    ------
    ModelError
        If the applied loads depend on each other in a singular way, or have no derivatives here.
    """
    lin = linearised(instant, inputs)
    free, anchors = _free(instant, lin.constraint)
    found = turning_basis(instant, free, anchors, lin, linearised)
    place = _placed(lin, found, anchors)
    small, coordinates, unbalanced = lin.transform is not None, None, ""
    moves = small and not leaves_rest(instant)
    if joints is not None and (found.along is not None or not (inputs is None or moves)):
        coordinates = chosen(instant, found, small, joints)
        found = in_coordinates(found, coordinates)
        place = put_back(instant, small, place, found, coordinates) if place else None
        if balance and leaves_rest(instant):
            unbalanced = departure(instant, lin, found, anchors, coordinates, linearised)
    basis, first, second = found.now, found.first, found.second
    pushed, into_states = _driven(lin, place)
    absolute = np.abs(basis)
    forces = (lin.stiffness, lin.damping, lin.state_force, lin.mass, *pushed)
    projected = [basis.T @ force for force in forces]
    rates = [lin.state_position, lin.state_velocity, lin.state_state, np.zeros_like(lin.state_position), *into_states]
    # what constraints exert themselves does no work along the basis; loads that follow the reactions do
    following = lin.force_reaction - lin.own_reaction
    felt = basis.T @ following
    felt[np.abs(felt) <= DEPENDENT * (absolute.T @ np.abs(following))] = 0.0
    if felt.any() or lin.state_reaction.any():
        # M q'' of the motions themselves is in the reactions' own equations
        changes = _reactions(lin.mass, lin.constraint, lin.force_reaction, forces)
        projected = [force + felt @ change for force, change in zip(projected, changes)]
        rates = [rate + lin.state_reaction @ change for rate, change in zip(rates, changes)]
    stiffness, damping, state_force, mass, *force = projected
    reduced = Reduced(
        basis if lin.transform is None else lin.transform @ basis,
        absolute.T @ lin.stiffness_terms @ absolute,
        absolute.T @ lin.damping_terms @ absolute,
        basis.T @ lin.mass @ basis,
        damping @ basis,
        stiffness @ basis,
        state_force,
        rates[0] @ basis,
        rates[1] @ basis,
        rates[2],
        found,
        small,
        Driven(tuple(force), tuple(rates[4:]), place) if place else None,
        coordinates,
        unbalanced,
    )
    if first.any() or second.any():
        # x' = T z' + T' z and x'' = T z'' + 2 T' z' + T'' z
        sizes = absolute.T @ np.abs(lin.mass), absolute.T @ lin.damping_terms
        reduced.stiffness += damping @ first + mass @ second
        reduced.damping += 2.0 * mass @ first
        reduced.stiffness_terms += sizes[1] @ np.abs(first) + sizes[0] @ np.abs(second)
        reduced.damping_terms += 2.0 * sizes[0] @ np.abs(first)
        reduced.state_position = reduced.state_position + rates[1] @ first + rates[3] @ second
        reduced.state_velocity = reduced.state_velocity + 2.0 * rates[3] @ first
    return reduced


def _placed(lin: Linearised, found: Basis, anchors: np.ndarray) -> Triple | None:
    """Return T_u, T_u' and T_u'', None without inputs."""
    if lin.inputs is None:
        return None
    dependent = np.setdiff1d(np.arange(len(lin.mass)), anchors)
    now = np.zeros((len(lin.mass), lin.inputs.place.shape[1]))
    if lin.inputs.place.any():
        now[dependent] = np.linalg.lstsq(lin.constraint[:, dependent], -lin.inputs.place, rcond=None)[0]
    first = found.turn @ now
    second = found.turn @ first
    if found.along is not None:
        more = found.along.rates(now)
        first, second = first + more[0], second + more[1]
    return now, first, second


def _driven(lin: Linearised, place: Triple | None) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return by u, u' and u'' the forces and the rates of states that belong to inputs."""
    if lin.inputs is None or place is None:
        return [], []
    now, first, second = place
    value, rate = lin.inputs.force
    pushed = [
        value + lin.stiffness @ now + lin.damping @ first + lin.mass @ second,
        rate + lin.damping @ now + 2.0 * lin.mass @ first,
        lin.mass @ now,
    ]
    value, rate = lin.inputs.state
    moved, sped = lin.state_position, lin.state_velocity
    return pushed, [value + moved @ now + sped @ first, rate + sped @ now, np.zeros_like(value)]


def warn_of_varying(reduced: Reduced) -> None:
    """Warn of bodies whose linearised equations have coefficients that vary with time, or are going to."""
    if reduced.unbalanced:
        warn(
            f"{reduced.unbalanced}: it is not in balance here and moves off, and its equations change on the way. The "
            "eigenvalues are those of this instant, and depend on the coordinates, which are joints' own where they "
            "can be; take the equilibrium (at='equilibrium'), or add the load that holds it"
        )
    for names in reduced.varying:
        shown = ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")
        warn(
            f"{shown}: in this motion the coefficients of the linearised equations vary with time, also in axes that "
            "turn with a body; the eigenvalues are those of this instant and no modes of the motion. Take a position "
            "of rest, or speeds and positions at which it turns steadily, and supports alike all round; or simulate"
        )


def linearised(instant: Instant, inputs: Inputs | None = None) -> Linearised:
    """Linearise an I3 problem about an instant, in all coordinates.

    Raises
    ------
    ModelError
        As `reduce`.
    """
    y = instant.y
    matrix = instant.matrix(y)
    mass = instant.mass_matrix(matrix).toarray()
    full = matrix.toarray()
    if not np.all(np.isfinite(matrix.data)):
        row = int(np.argmin(np.isfinite(full).all(axis=1)))
        raise ModelError(
            f"{instant.problem.names[row]}: its derivatives are not finite in this position; look for a division by "
            "zero, coinciding markers, or angles about axes at right angles to each other"
        )
    q, v = instant.block("R", "lambda"), np.concatenate([instant.block("u", "p"), instant.block("eps", "R")])
    force = instant.block("u", "eps")
    half = instant.at["p"] - instant.at["u"]
    rows, eps = instant.block("lambda", "F"), instant.block("eps", "R")
    inner = instant.block("F", "mu")
    kept = np.zeros(inner.size, dtype=bool)
    kept[inner.size - instant.differential.size :] = instant.differential
    loads, z = inner[~kept], inner[kept]

    def eliminate(target: np.ndarray, columns: np.ndarray, full: np.ndarray = full) -> tuple[np.ndarray, np.ndarray]:
        """Derivative of the target rows with the loads following their definitions, and the size of its terms."""
        direct = full[np.ix_(target, columns)]
        if not loads.size:
            return direct, np.abs(direct)
        on = full[np.ix_(target, loads)]
        followed = np.linalg.solve(full[np.ix_(loads, loads)], full[np.ix_(loads, columns)])
        return direct - on @ followed, np.abs(direct) + np.abs(on) @ np.abs(followed)

    try:
        (stiffness, stiffness_terms), (damping, damping_terms) = eliminate(force, q), eliminate(force, v)
        nearby = [eliminate(force, q, instant.matrix(near).toarray())[0] for near in _neighbours(instant)]
        stiffness_terms = stiffness_terms + _uncertain(stiffness, stiffness_terms, nearby)
        state_force = eliminate(force, z)[0]
        state_q, state_v, state_z = (-eliminate(z, columns)[0] for columns in (q, v, z))
        force_reaction, state_reaction = eliminate(force, rows)[0], -eliminate(z, rows)[0]
        given = None
        if inputs is not None:
            # further columns of the residual
            whole = np.hstack([full, inputs.value, inputs.rate])
            both = np.split(np.arange(full.shape[1], whole.shape[1]), 2)
            pushed, into_states = ([eliminate(target, one, whole)[0] for one in both] for target in (force, z))
            given = GivenInputs(pushed, [-one for one in into_states], inputs.value[rows])
    except np.linalg.LinAlgError as error:
        raise ModelError("the applied loads and variables depend on each other in a singular way") from error
    # delta p' = d/dt of -(dG_eps/d theta) delta theta - ...: its velocity part is a damping
    moved = full[np.ix_(eps, instant.block("theta", "lambda"))]
    constraint, own_reaction = full[np.ix_(rows, q)], full[np.ix_(force, rows)]
    turn = turning(instant)
    if turn is None:
        damping[half:, half:] -= moved
        damping_terms[half:, half:] += np.abs(moved)
    found = Linearised(
        mass, damping, stiffness, damping_terms, stiffness_terms, constraint, state_force, state_q, state_v, state_z,
        force_reaction, own_reaction, state_reaction, None, given,
    )  # fmt: skip
    return found if turn is None else _in_axes_at_rest(found, turn)


def _in_axes_at_rest(one: Linearised, turn: Turning) -> Linearised:
    """Return the equations with T delta phi for delta theta; see `turning`."""
    to, rate = turn.transform, turn.transform_rate
    stiffness_terms = one.stiffness_terms @ np.abs(to) + one.damping_terms @ turn.rate_terms
    given = one.inputs
    return replace(
        one,
        mass=turn.mass,
        damping=to.T @ one.damping @ to + turn.damping,
        stiffness=to.T @ (one.damping @ rate + one.stiffness @ to) + turn.stiffness,
        damping_terms=np.abs(to.T) @ one.damping_terms @ np.abs(to) + turn.damping_terms,
        stiffness_terms=np.abs(to.T) @ stiffness_terms + turn.stiffness_terms,
        constraint=one.constraint @ to,
        state_force=to.T @ one.state_force,
        state_position=one.state_position @ to + one.state_velocity @ rate,
        state_velocity=one.state_velocity @ to,
        force_reaction=to.T @ one.force_reaction,
        own_reaction=to.T @ one.own_reaction,
        transform=to,
        inputs=None if given is None else replace(given, force=[to.T @ each for each in given.force]),
    )


def _neighbours(instant: Instant) -> list[np.ndarray]:
    """Return points y that rounding cannot tell from the present one: lengths and angles differ by the last digits."""
    moves, turns, end = (instant.at[name] for name in ("R", "theta", "q_f"))
    size = np.zeros(instant.y.size)
    size[moves:turns] = max(instant.system.length, float(np.abs(instant.y[moves:turns]).max(initial=0.0)))
    size[turns:end] = 1.0
    # coordinates that differ one by one in their signs, so that no motion of the whole is among the changes
    signs = np.random.default_rng(1).uniform(-1.0, 1.0, (NEIGHBOURS, size.size))
    return [instant.y + LAST_DIGITS * row * size for row in signs]


def _uncertain(stiffness: np.ndarray, terms: np.ndarray, nearby: list[np.ndarray]) -> np.ndarray:
    """Return what its differences from those nearby add to the terms of a stiffness.

    The force in a spring as long as when it is free, k (l - l0), is the rounding of l, and its stiffness sideways
    k (l - l0) / l has no terms that tell how large this may be.
    """
    change = np.max([np.abs(one - stiffness) for one in nearby], axis=0)
    # a contact that just touches comes and goes; this is no rounding
    change[~(change <= JUMP * terms.max(initial=0.0))] = 0.0
    return change / ROUNDING


def _free(instant: Instant, constraint: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a basis of the motions that constraints allow, lengths and angles weighed against each other."""
    weight = weights(instant)
    basis, anchors = allowed_motions(constraint / weight)
    return basis / weight[:, None], anchors


def _reactions(
    mass: np.ndarray, constraint: np.ndarray, force_reaction: np.ndarray, forces: tuple[np.ndarray, ...]
) -> list[np.ndarray]:
    """Return how the multipliers change with positions, velocities and states.

    Of M q'' + f + L lambda = 0 and Phi_q q'' = 0 they are what q'' leaves of f, at a position of equilibrium; f are
    the forces' derivatives and L those by the multipliers, Phi_q^T and what loads make of reactions.
    """
    m, n = constraint.shape
    if m == 0:
        return [np.zeros((0, force.shape[1])) for force in forces]
    whole = np.block([[mass, force_reaction], [constraint, np.zeros((m, m))]])
    size = np.sqrt(np.maximum(np.abs(whole).max(axis=1), np.finfo(float).tiny))
    scaled = whole / size[:, None] / size
    given = np.zeros((n + m, sum(force.shape[1] for force in forces)))
    given[:n] = -np.hstack(forces)
    solved = np.linalg.lstsq(scaled, given / size[:, None], rcond=None)[0] / size[:, None]
    return np.split(solved[n:], np.cumsum([force.shape[1] for force in forces])[:-1], axis=1)
