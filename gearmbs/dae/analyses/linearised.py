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
        If the applied loads depend on each other in a singular way.
    """
    y = instant.y
    matrix = instant.matrix(y)
    mass = instant.mass_matrix(matrix).toarray()
    full = matrix.toarray()
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
    arm = max(min(instant.system.length, 1.0), 1e-3)
    sizes = instant.system.model.modal_sizes()[:, 0]
    weight = np.concatenate([np.ones(half), np.full(half, arm), arm / sizes])
    basis = allowed_motions(constraint / weight) / weight[:, None]
    absolute = np.abs(basis)
    return Reduced(
        basis if turn is None else turn.transform @ basis,
        absolute.T @ stiffness_terms @ absolute,
        absolute.T @ damping_terms @ absolute,
        basis.T @ mass @ basis,
        basis.T @ damping @ basis,
        basis.T @ stiffness @ basis,
        basis.T @ state_force,
        state_q @ basis,
        state_v @ basis,
        state_z,
    )
