"""What a plant answers at a complex frequency, with motions that nothing resists held apart.

A of a shaft that turns freely has rounding in place of zeros, 1e-16 of its stiffest entry, and C (s - A)^-1 B is what
that makes of it where s^2 is less. Of the equations themselves, with w = (x, z) and u^(k) the rates of the inputs,

    (s^2 M + s D + A) w + (F0 + s F1 + s^2 F2) u = 0,    A = [K H; -P -S],   D = [C 0; -Q 1],   M = [M 0; 0 0],

the directions are known in which A is rounding, on the right and on the left (`gearmbs.dae.analyses.eigenvalues`): with
A = U diag(sigma) V^T these sigma are zeros, and so is what is rounding of the forces and couples on U there, as those
between two bodies are on what turns both, and what outputs see of V there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearmbs.dae.analyses.eigenvalues import balance
from gearmbs.dae.analyses.linearisation import Reduced

UNSEEN = 1e-10
"""Part of its terms up to which a sum is zero: rounding is 1e-13 of them, with directions that are known as well."""

NEAR_REST = 1e-6
"""Part of the slowest pole that is at rest: of the mean of both signs 1e-12 is left out."""


@dataclass(frozen=True)
class Response:
    """Equations and outputs in the coordinates of V and the rows of U; the free ones stand last.

    Attributes
    ----------
    free : int
        Directions in which A is zero.
    mass, first, static : ndarray, shape (k, k)
    forces : tuple of ndarray, shape (k, inputs)
        F0, F1 and F2.
    seen, seen_rates : ndarray, shape (outputs, k)
        What outputs see of w and w'.
    direct : tuple of ndarray, shape (outputs, inputs)
        And of u, u' and u''.
    levels : ndarray of int, shape (inputs,)
        By which of its rates each input is given.
    time_unit : float
        In which s is counted, s.
    """

    free: int
    mass: np.ndarray
    first: np.ndarray
    static: np.ndarray
    forces: tuple[np.ndarray, ...]
    seen: np.ndarray
    seen_rates: np.ndarray
    direct: tuple[np.ndarray, ...]
    levels: np.ndarray
    time_unit: float = 1.0

    def at(self, s: complex) -> np.ndarray:
        """Return the outputs over the inputs, shape (outputs, inputs), at s other than 0."""
        s = s / self.time_unit
        powers = [s ** (k - self.levels.astype(float)) for k in range(3)]
        given = -sum(force * power for force, power in zip(self.forces, powers, strict=True))
        matrix = s**2 * self.mass + s * self.first + self.static
        # free coordinates by their accelerations, and all rows by their largest entry, so that nothing is lost
        held = len(matrix) - self.free
        size = np.concatenate([np.ones(held), np.full(self.free, s**-2.0)])
        matrix = matrix * size
        rows = np.abs(matrix).max(axis=1, initial=0.0)[:, None]
        rows[rows == 0.0] = 1.0
        try:
            moved = size[:, None] * np.linalg.solve(matrix / rows, given / rows)
        except np.linalg.LinAlgError:
            return np.full((len(self.seen), self.levels.size), np.inf, dtype=complex)
        through = sum(seen * power for seen, power in zip(self.direct, powers, strict=True))
        return (self.seen + s * self.seen_rates) @ moved + through

    def towards_rest(self, slowest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return with which power of 1/s the outputs grow towards s = 0, and what is left of them times s to that.

        Parameters
        ----------
        slowest : float
            Magnitude of the slowest pole beside those at 0.

        Returns
        -------
        ndarray of int, ndarray, shape (outputs, inputs)
            An output that an input does not move has the least integer, and 0.
        """
        s = NEAR_REST * slowest
        now, back, further = (self.at(complex(k * s)).real for k in (1.0, -1.0, 2.0))
        moved = (now != 0.0) & (further != 0.0)
        ratio = np.divide(np.abs(now), np.abs(further), out=np.ones_like(now), where=moved)
        power = np.where(moved, np.round(np.log2(ratio)), np.iinfo(np.int64).min).astype(np.int64)
        shown = np.where(moved, power, 0).astype(float)
        return power, np.where(moved, 0.5 * (s**shown * now + (-s) ** shown * back), 0.0)


def response_of(
    reduced: Reduced,
    own: np.ndarray,
    inputs_of: np.ndarray,
    outputs: np.ndarray,
    chains: Sequence[Sequence[int]],
    levels: Sequence[int],
) -> Response | None:
    """Return how a plant with free motions answers; None without such.

    Parameters
    ----------
    reduced : Reduced
    own, inputs_of : ndarray of int
        Differential states that are states of the plant, and such of constant value that are its first inputs.
    outputs, chains
        As of `gearmbs.dae.analyses.plant.Realised`.
    levels : sequence of int
        By which of its rates each input is given.
    """
    n, m = len(reduced.mass), own.size
    part = replace(
        reduced, state_force=reduced.state_force[:, own], state_position=reduced.state_position[own],
        state_velocity=reduced.state_velocity[own], state_state=reduced.state_state[np.ix_(own, own)],
    )  # fmt: skip
    balanced = balance(part)
    if not balanced.static.size:
        return None
    left, sizes, right = np.linalg.svd(balanced.static)
    right = right.T
    rank = int(np.sum(sizes > balanced.tolerance))
    free = n + m - rank
    if not free:
        return None
    rows = np.concatenate([balanced.scale, 1.0 / balanced.rows])
    columns = np.concatenate([balanced.scale, 1.0 / balanced.columns])
    mass, terms = np.zeros((n + m, n + m)), np.abs(balanced.first)
    mass[:n, :n] = balanced.mass
    terms[:n, :n] = balanced.damping_terms
    last, sides = np.arange(n + m) >= rank, (np.abs(left), np.abs(right))
    # as where it is counted which of them go on at constant speed
    damped = 10.0 * balanced.tolerance
    first = _cleared(left.T @ balanced.first @ right, sides[0].T @ terms @ sides[1], damped, last, last)
    forces = [
        _cleared(left.T @ force, sides[0].T @ np.abs(force), UNSEEN, last, False)
        for force in (rows[:, None] * each for each in _forces(reduced, own, inputs_of))
    ]
    size, count = 2 * n + m + sum(len(chain) for chain in chains), len(chains)
    places, rates = np.zeros((len(outputs), n + m)), np.zeros((len(outputs), n + m))
    places[:, :n], places[:, n:], rates[:, :n] = outputs[:, :n], outputs[:, 2 * n : 2 * n + m], outputs[:, n : 2 * n]
    none = np.zeros(len(outputs), dtype=bool)
    seen = [
        _cleared(each @ right, np.abs(each) @ sides[1], UNSEEN, none, last)
        for each in (places * columns, rates * columns)
    ]
    direct = [np.zeros((len(outputs), count)) for _ in range(3)]
    for k, chain in enumerate(chains):
        for level, place in enumerate([*chain, size + k]):
            direct[level][:, k] = outputs[:, place]
    return Response(
        free, left.T @ mass @ right, first, np.diag(np.where(last, 0.0, sizes)), tuple(forces),
        seen[0], seen[1], tuple(direct), np.array(levels, dtype=int),
    )  # fmt: skip


def _forces(reduced: Reduced, own: np.ndarray, inputs_of: np.ndarray) -> list[np.ndarray]:
    """Return F0, F1 and F2 of the inputs."""
    of_states = np.vstack([reduced.state_force[:, inputs_of], -reduced.state_state[np.ix_(own, inputs_of)]])
    driven = reduced.driven
    if driven is None:
        return [of_states, np.zeros_like(of_states), np.zeros_like(of_states)]
    others = [np.vstack([f, -v[own]]) for f, v in zip(driven.force, driven.state, strict=True)]
    none = np.zeros_like(of_states)
    return [np.hstack([given, other]) for given, other in zip((of_states, none, none), others, strict=True)]


def _cleared(values: np.ndarray, terms: np.ndarray, rounding: float, rows: np.ndarray, columns: Any) -> np.ndarray:
    """Return a matrix with zeros for what is rounding in some rows and some columns."""
    there = rows[:, None] | columns if rows.size else np.zeros(values.shape, dtype=bool)
    return np.where(there & (np.abs(values) <= rounding * terms), 0.0, values)
