"""The DAE linearised at one instant, in the motions its constraints leave free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import qr, solve_triangular

from gearmbs.dae.analyses.instant import Instant
from gearmbs.dae.analyses.turning import DIFFERENCED, turning
from gearmbs.dae.errors import ModelError

if TYPE_CHECKING:
    pass

DEPENDENT = 1e-10
"""Pivot, of the largest, below which constraints count as dependent."""


def allowed_motions(constraint: np.ndarray) -> np.ndarray:
    """Return a basis of the null space of the constraints: some coordinates move by one each, the others follow.

    Unlike an orthonormal one it keeps parts that have nothing to do with each other apart, exactly.
    """
    rows, n = constraint.shape
    if rows == 0:
        return np.eye(n)
    upper, order = qr(constraint, mode="r", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int(np.sum(pivots > DEPENDENT * pivots[0]))
    basis = np.zeros((n, n - rank))
    basis[order[rank:]] = np.eye(n - rank)
    basis[order[:rank]] = -solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    return basis


@dataclass
class Reduced:
    """M x'' + C x' + K x + H z = 0 and z' = P x + Q x' + S z in the motions the constraints allow.

    ``basis`` has a column of changes of (R, theta, q_f) for each entry of x; ``stiffness_terms`` and ``damping_terms``
    are the sums of the absolute values of the terms each coefficient is made of, against which rounding is to be held.
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


def reduce(instant: Instant) -> Reduced:
    """Linearise an I3 problem about an instant and project it on the motions allowed by its constraints.

    Raises
    ------
    ModelError
        If the applied loads depend on each other in a singular way, or have no derivatives here.
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

    def eliminate(target: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivative of the target rows with the loads following their definitions, and the size of its terms."""
        direct = full[np.ix_(target, columns)]
        if not loads.size:
            return direct, np.abs(direct)
        on = full[np.ix_(target, loads)]
        followed = np.linalg.solve(full[np.ix_(loads, loads)], full[np.ix_(loads, columns)])
        return direct - on @ followed, np.abs(direct) + np.abs(on) @ np.abs(followed)

    try:
        (stiffness, stiffness_terms), (damping, damping_terms) = eliminate(force, q), eliminate(force, v)
        state_force = eliminate(force, z)[0]
        state_q, state_v, state_z = (-eliminate(z, columns)[0] for columns in (q, v, z))
        force_reaction, state_reaction = eliminate(force, rows)[0], -eliminate(z, rows)[0]
    except np.linalg.LinAlgError as error:
        raise ModelError("the applied loads and variables depend on each other in a singular way") from error
    # delta p' = d/dt of -(dG_eps/d theta) delta theta - ...: its velocity part is a damping
    moved = full[np.ix_(eps, instant.block("theta", "lambda"))]
    constraint = full[np.ix_(rows, q)]
    turn = turning(instant)
    if turn is None:
        damping[half:, half:] -= moved
        damping_terms[half:, half:] += np.abs(moved)
    else:
        # see `turning`: T delta phi for delta theta, and what the coefficients' own change adds
        to, rate = turn.transform, turn.transform_rate
        mass = to.T @ turn.momentum_rate
        terms = np.abs(turn.momentum_place) + np.abs(turn.momentum_rate_change)
        damping_terms = np.abs(to.T) @ (damping_terms @ np.abs(to) + terms)
        stiffness_terms = np.abs(to.T) @ (
            stiffness_terms @ np.abs(to) + DIFFERENCED * np.abs(turn.momentum_place_change)
        )
        stiffness = to.T @ (turn.momentum_place_change + damping @ rate + stiffness @ to)
        damping = to.T @ (turn.momentum_rate_change + turn.momentum_place + damping @ to)
        state_force = to.T @ state_force
        state_q, state_v = state_q @ to + state_v @ rate, state_v @ to
        constraint = constraint @ to
        force_reaction = to.T @ force_reaction
    basis = _free(instant, constraint)
    absolute = np.abs(basis)
    projected = [basis.T @ force for force in (stiffness, damping, state_force)]
    # what constraints exert themselves does no work along the basis; loads that follow the reactions do
    felt = basis.T @ force_reaction
    felt[np.abs(felt) <= DEPENDENT * (absolute.T @ np.abs(force_reaction))] = 0.0
    if felt.any() or state_reaction.any():
        changes = _reactions(mass, constraint, force_reaction, (stiffness, damping, state_force))
        projected = [force + felt @ change for force, change in zip(projected, changes)]
        rates = zip((state_q, state_v, state_z), changes)
        state_q, state_v, state_z = (rate + state_reaction @ change for rate, change in rates)
    return Reduced(
        basis if turn is None else turn.transform @ basis,
        absolute.T @ stiffness_terms @ absolute,
        absolute.T @ damping_terms @ absolute,
        basis.T @ mass @ basis,
        projected[1] @ basis,
        projected[0] @ basis,
        projected[2],
        state_q @ basis,
        state_v @ basis,
        state_z,
    )


def _free(instant: Instant, constraint: np.ndarray) -> np.ndarray:
    """Return a basis of the motions that constraints allow, lengths and angles weighed against each other."""
    arm = max(min(instant.system.length, 1.0), 1e-3)
    sizes = instant.system.model.modal_sizes()[:, 0]
    half = (constraint.shape[1] - sizes.size) // 2
    weight = np.concatenate([np.ones(half), np.full(half, arm), arm / sizes])
    return allowed_motions(constraint / weight) / weight[:, None]


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
