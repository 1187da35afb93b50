"""From a linearisation to the matrices A, B, C, D of a plant.

Inputs of decks are states z of constant value, whose columns of H and S are U0 and V0; outputs are rates of states
without influence: their rows of P, Q, S and V are rows of C and D (the linearisation's letters, see
`gearmbs.dae.analyses.plant`).

An input that moves something, as a motion or a transmission error, acts with its rates. It is led over its highest rate
w = u^(h): u, u' .. are states of their own then, and b is the column of w in B. Of what is to be driven by a lower rate
r, r' = w, the new state is x - b r: (x - b r)' = A (x - b r) + A b r, y = C (x - b r) + C b r + d w, which needs d = 0.
The state that held r vanishes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from gearmbs.dae.analyses.linearisation import Driven, Reduced
from gearmbs.dae.problem import ModelError, SingularModelError

# From a linearisation to the matrices.


@dataclass
class Realised:
    """A plant in which inputs act by their highest rates; rows over the states x, then the inputs w = u^(h).

    Attributes
    ----------
    rows : ndarray, shape (n, n + inputs)
        [A B] of x = (q, q', z, then of each input u, u' .. up to its highest rate).
    places : tuple of ndarray, shape (coordinates, n + inputs)
        Changes of the coordinates (R, phi or theta, q_f), and of their first and second rates.
    outputs : ndarray, shape (outputs, n + inputs)
        [C D].
    chains : list of list of int
        Of each input the states u, u' ..
    """

    rows: np.ndarray
    places: tuple[np.ndarray, np.ndarray, np.ndarray]
    outputs: np.ndarray
    chains: list[list[int]]


def realised(reduced: Reduced, own: np.ndarray, rates_of: np.ndarray, inputs_of: np.ndarray) -> Realised:
    """Return the plant of a linearisation.

    Parameters
    ----------
    reduced : Reduced
        With what its inputs do, if it has some.
    own : ndarray of int
        Differential states that are states of the plant.
    rates_of : ndarray of int
        Differential states whose rates are the outputs.
    inputs_of : ndarray of int
        Differential states of constant value that are inputs, before all others.

    Raises
    ------
    SingularModelError
        If a motion left free by the constraints has no inertia.
    """
    n, m = len(reduced.mass), own.size
    driven, between = reduced.driven, reduced.state_state
    orders = [0] * inputs_of.size + ([] if driven is None else _orders(driven, own, rates_of))
    size = 2 * n + m
    chains: list[list[int]] = []
    for h in orders:
        chains.append(list(range(size, size + h)))
        size += h
    width = size + len(orders)

    def selected(columns: Sequence[int]) -> np.ndarray:
        """Return the rows that take these places of (x, w)."""
        out = np.zeros((len(columns), width))
        out[np.arange(len(columns)), columns] = 1.0
        return out

    position, velocity, inner = (selected(range(*ends)) for ends in ((0, n), (n, 2 * n), (2 * n, 2 * n + m)))
    of_given = selected(range(size, size + inputs_of.size))
    count = len(orders) - inputs_of.size
    # u, u' and u'' of the other inputs
    levels = [np.zeros((count, width)) for _ in range(3)]
    for k, (chain, h) in enumerate(zip(chains[inputs_of.size :], orders[inputs_of.size :], strict=True)):
        for level, place in enumerate([*chain, size + inputs_of.size + k][: h + 1]):
            levels[level][k, place] = 1.0
    force = reduced.stiffness @ position + reduced.damping @ velocity
    force = force + reduced.state_force[:, own] @ inner + reduced.state_force[:, inputs_of] @ of_given
    rates = reduced.state_position @ position + reduced.state_velocity @ velocity
    rates = rates + between[:, own] @ inner + between[:, inputs_of] @ of_given
    if driven is not None:
        for pushed, moved, rate in zip(driven.force, driven.state, levels, strict=True):
            force, rates = force + pushed @ rate, rates + moved @ rate
    rows = np.zeros((size, width))
    rows[:n], rows[n : 2 * n], rows[2 * n : 2 * n + m] = velocity, -_over_mass(reduced.mass, force), rates[own]
    for k, chain in enumerate(chains):
        for state, following in zip(chain, [*chain, size + k][1:], strict=True):
            rows[state, following] = 1.0
    motion = reduced.motion
    accelerated = rows[n : 2 * n]
    places = [
        motion.now @ position,
        motion.now @ velocity + motion.first @ position,
        motion.now @ accelerated + 2.0 * motion.first @ velocity + motion.second @ position,
    ]
    if driven is not None:
        put, put_first, put_second = driven.place
        places[0] = places[0] + put @ levels[0]
        places[1] = places[1] + put @ levels[1] + put_first @ levels[0]
        places[2] = places[2] + put @ levels[2] + 2.0 * put_first @ levels[1] + put_second @ levels[0]
    return Realised(rows, tuple(places), rates[rates_of], chains)  # type: ignore[arg-type]


def _orders(driven: Driven, own: np.ndarray, rates_of: np.ndarray) -> list[int]:
    """Return the highest rate with which each input acts."""
    count = driven.force[0].shape[1]
    orders = []
    for k in range(count):
        acts = [
            h
            for h in range(3)
            if driven.force[h][:, k].any() or driven.state[h][:, k].any() or (h == 2 and driven.place[0][:, k].any())
        ]
        orders.append(max(acts, default=0))
    return orders


def _over_mass(mass: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return M^-1 times forces."""
    if not len(mass):
        return force
    try:
        return cho_solve(cho_factor(0.5 * (mass + mass.T)), force)
    except np.linalg.LinAlgError as error:
        raise SingularModelError("a motion that the constraints leave free has no inertia") from error


IMPROPER = 1e-9
"""Direct effect of a rate, of the sum of its terms, above which an output follows it: rounding is 1e-13."""


@dataclass(frozen=True)
class Asked:
    """An input as it is wanted: its name and unit, and by which rate (0, 1, 2) it is given."""

    name: str
    unit: str
    level: int = 0
    value: float = 0.0
    remedy: str = ""


def lowered(
    found: Realised, asked: Sequence[Asked], outputs: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return A, B, C, D with inputs at the levels asked for.

    Raises
    ------
    ModelError
        If an output follows a rate that is higher than the one asked for.
    """
    n = len(found.rows)
    a, b = found.rows[:, :n].copy(), found.rows[:, n:].copy()
    c, d = found.outputs[:, :n].copy(), found.outputs[:, n:].copy()
    kept = np.ones(n, dtype=bool)
    for k, (want, chain) in enumerate(zip(asked, found.chains, strict=True)):
        for place in reversed(chain[want.level :]):
            terms = np.abs(found.outputs[:, :n]) @ np.abs(found.rows[:, n + k]) + np.abs(d).max(axis=1, initial=0.0)
            follows = np.abs(d[:, k]) > IMPROPER * terms
            if follows.any():
                raise ModelError(
                    f"output {outputs[int(np.argmax(follows))]!r} follows the rate of input {want.name!r}, so that no "
                    f"D is finite; {want.remedy}"
                )
            moved = b[:, k].copy()
            d[:, k] = c @ moved
            b[:, k] = a @ moved
            b[place, k] = 0.0
            kept[place] = False
    # inputs that are asked for by a rate that is higher than those that act: the states that integrate it
    for k, (want, chain) in enumerate(zip(asked, found.chains, strict=True)):
        for _ in range(want.level - len(chain)):
            size = len(a)
            a = np.block([[a, b[:, k : k + 1]], [np.zeros((1, size + 1))]])
            b = np.vstack([b, np.zeros((1, b.shape[1]))])
            b[:, k], b[size, k] = 0.0, 1.0
            c, d[:, k] = np.hstack([c, d[:, k : k + 1]]), 0.0
            kept = np.append(kept, True)
    return a[np.ix_(kept, kept)], b[kept], c[:, kept], d
