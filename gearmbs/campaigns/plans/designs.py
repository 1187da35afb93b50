"""Designs: points in the unit cube of all factors' coordinates.

Every random design is a function of its seed alone, and the first n points of a sequence are the same whatever n, so
that a plan can be extended and keep what was computed.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Sequence

import numpy as np

from gearmbs.campaigns.settings import CampaignError

SEQUENCES = ("sobol", "halton", "random")
"""Designs that go on where they stopped."""

ANALYSES = ("saltelli", "morris")
"""Designs made for an analysis, which go on as well."""

TWO_LEVELS = ("factorial", "plackett burman")
"""Designs that take the ends of what a factor has."""

MOST_LEVELS = dict.fromkeys(TWO_LEVELS, 2) | {"central composite": 3, "box behnken": 3}
"""Of how many places of a factor a design takes values."""

DESIGNS = (
    "grid",
    "list",
    "latin hypercube",
    *SEQUENCES,
    *ANALYSES,
    *TWO_LEVELS,
    "central composite",
    "box behnken",
    "one at a time",
)


def sequence(design: str, n: int, dimensions: int, seed: int, first: int = 0) -> np.ndarray:
    """Return n points of a design from the first on, shape (n, dimensions), in [0, 1).

    Parameters
    ----------
    design : {"sobol", "halton", "random", "latin hypercube"}
    first : int
        Number of the first point; 0 of a hypercube.
    """
    from scipy.stats import qmc

    if dimensions == 0:
        return np.empty((n, 0))
    if design == "random":
        generator = np.random.default_rng(seed)
        # one draw a number
        generator.bit_generator.advance(first * dimensions)  # type: ignore[attr-defined]
        return generator.random((n, dimensions))
    if design in ("sobol", "halton"):
        kind = qmc.Sobol if design == "sobol" else qmc.Halton
        sampler = kind(dimensions, scramble=True, rng=np.random.default_rng(seed))
        if first:
            sampler.fast_forward(first)
        with warnings.catch_warnings():
            # of a number of points that is no power of two
            warnings.filterwarnings("ignore", message="The balance properties of Sobol'", category=UserWarning)
            return sampler.random(n)
    if design == "latin hypercube":
        return qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed)).random(n)
    raise CampaignError(f"design {design!r} is unknown; choose one of {', '.join(DESIGNS)}")


def saltelli(n: int, dimensions: int, seed: int, first: int = 0) -> np.ndarray:
    """Return the points for Sobol' indices, shape (n (d + 2), d), from a base point on.

    For each of n base points the rows are A, then A with one coordinate of B for each of the d coordinates, then B
    (A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259).
    """
    both = sequence("sobol", n, 2 * dimensions, seed, first)
    a, b = both[:, :dimensions], both[:, dimensions:]
    points = np.repeat(a[:, None, :], dimensions + 2, axis=1)
    for k in range(dimensions):
        points[:, k + 1, k] = b[:, k]
    points[:, -1] = b
    return points.reshape(-1, dimensions)


def morris(n: int, dimensions: int, seed: int, levels: int = 4, first: int = 0) -> np.ndarray:
    """Return n trajectories of one-at-a-time steps, shape (n (d + 1), d), from a number on.

    M. D. Morris, Technometrics 33 (1991) 161: points on a grid of ``levels``, each step levels / (2 (levels - 1)),
    every
    coordinate once, in random order and direction.
    """
    starts, delta = morris_starts(levels)
    points = np.empty((n, dimensions + 1, dimensions))
    for k in range(n):
        generator = np.random.default_rng([seed, first + k])
        low = generator.choice(starts, dimensions)
        up = generator.random(dimensions) < 0.5
        at = np.where(up, low, low + delta)
        points[k, 0] = at
        for step, axis in enumerate(generator.permutation(dimensions)):
            at = at.copy()
            at[axis] += delta if up[axis] else -delta
            points[k, step + 1] = at
    return points.reshape(-1, dimensions)


def morris_starts(levels: int) -> tuple[np.ndarray, float]:
    """Return where the lower ends of a Morris design's steps are, and how long these are."""
    return np.arange(levels // 2) / (levels - 1.0), levels / (2.0 * (levels - 1.0))


def grid(counts: Sequence[int]) -> np.ndarray:
    """Return all combinations of so many values a coordinate, shape (product, d), the last running fastest.

    Two values or more of a range are spread from end to end; see `end_to_end`.
    """
    points = list(itertools.product(*(end_to_end(count) for count in counts)))
    return np.array(points, dtype=float).reshape(len(points), len(counts))


def end_to_end(count: int) -> np.ndarray:
    """Return count values from 0 to 1; the middle if it is one."""
    return np.array([0.5]) if count == 1 else np.linspace(0.0, 1.0, count)


def factorial(dimensions: int, generators: Sequence[str] = ()) -> np.ndarray:
    """Return a two-level design, full or fractional, as -1 and 1.

    Parameters
    ----------
    generators : sequence of str
        For a fraction: one text for each of the last factors, as ``"D=ABC"``, in capital letters in the order of the
        factors.
    """
    free = dimensions - len(generators)
    if free < 1:
        raise CampaignError(f"factorial: {len(generators)} generators for {dimensions} factors leave none free")
    runs = np.array(list(itertools.product((-1.0, 1.0), repeat=free)))
    columns = list(runs.T)
    for k, text in enumerate(generators):
        left, equals, right = text.replace(" ", "").partition("=")
        letters = [ord(c) - ord("A") for c in right]
        if not equals or left != chr(ord("A") + free + k) or not letters or not all(0 <= c < free for c in letters):
            last = chr(ord("A") + free - 1)
            raise CampaignError(f"generator {text!r}: write {chr(ord('A') + free + k)}= and a product of A to {last}")
        columns.append(np.prod([columns[c] for c in letters], axis=0))
    return np.array(columns).T


def plackett_burman(dimensions: int) -> np.ndarray:
    """Return a screening design of the next multiple of four runs above the number of factors, as -1 and 1.

    Columns of a Hadamard matrix: by doubling for 4, 8, 16, 32 runs, else by Paley's first construction where the number
    of runs less one is a prime (12, 20, 24, 44, 48).
    """
    from scipy.linalg import hadamard

    for runs in range(4, 100, 4):
        if runs <= dimensions:
            continue
        if runs & (runs - 1) == 0:
            return hadamard(runs)[:, 1 : dimensions + 1].astype(float)
        q = runs - 1
        if all(q % p for p in range(2, math.isqrt(q) + 1)):
            squares = {x * x % q for x in range(1, q)}
            row = np.array([1.0] + [1.0 if x in squares else -1.0 for x in range(1, q)])
            body = np.array([np.roll(row, k) for k in range(q)])
            return np.vstack([body, -np.ones(q)])[:, :dimensions]
    raise CampaignError(f"plackett burman: {dimensions} factors are too many; give at most 95")


def central_composite(dimensions: int, *, faced: bool = True, centre: int = 1) -> np.ndarray:
    """Return a central composite design: corners, axial points and centre, in -1 to 1.

    Parameters
    ----------
    faced : bool
        Axial points on the faces of the cube; else the design is rotatable and its corners lie inside, so that the
        axial
        points are at the ends of the ranges.
    centre : int
        Runs at the centre. Repeating a deterministic simulation tells nothing, so that one is the default.
    """
    corners = factorial(dimensions)
    reach = 1.0 if faced else 2.0 ** (dimensions / 4.0)
    axial = np.concatenate([np.eye(dimensions), -np.eye(dimensions)])
    return np.vstack([corners / reach, axial, np.zeros((centre, dimensions))])


def box_behnken(dimensions: int, centre: int = 1) -> np.ndarray:
    """Return a Box-Behnken design of three factors or more: edges' middles and centre, in -1 to 1."""
    if dimensions < 3:
        raise CampaignError(f"box behnken: {dimensions} factors; give three or more, or take a central composite")
    rows = []
    for pair in itertools.combinations(range(dimensions), 2):
        for signs in itertools.product((-1.0, 1.0), repeat=2):
            row = np.zeros(dimensions)
            row[list(pair)] = signs
            rows.append(row)
    return np.vstack([rows, np.zeros((centre, dimensions))])


def one_at_a_time(counts: Sequence[int], base: Sequence[float]) -> np.ndarray:
    """Return the base point, then each coordinate over so many values from end to end, the others at the base."""
    rows = [np.asarray(base, dtype=float)]
    for axis, count in enumerate(counts):
        for value in end_to_end(count) if count else ():
            row = rows[0].copy()
            row[axis] = value
            rows.append(row)
    return np.array(rows)
