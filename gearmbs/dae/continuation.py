"""Branches of periodic orbits: from one to the next along a parameter, through turning points.

With x the independent unknowns and p the parameter, orbits are the curve P(x, p) = x. It is followed by its arc length:
z = (x, p) in units of its own sizes, a step ds along t, the secant of its last two points, and back onto it by Newton's
method in the hyperplane across t (Keller's pseudo-arclength),

    [ M - 1   dP/dp ] [ dx ]     [ P - x                ]
    [   t_x     t_p ] [ dp ] = - [ t . (z - z_0) - ds   ].

So p may turn back, where one orbit of three that exist at a time, the unstable one, passes into another. M is the
monodromy matrix (`gearmbs.dae.orbits`); dP/dp is a difference of two runs, in which x stays.

References
----------
.. [1] H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", in: P. Rabinowitz (ed.),
       Applications of Bifurcation Theory, Academic Press 1977, 359-384.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from gearmbs.dae.orbits import CLOSED, IN_TOLERANCES, Orbit, Search, directions_at
from gearmbs.dae.problem import DAEProblem

BY = 1e-3
"""Part of the parameter's span by which it is moved for dP/dp: of an orbit that doubles within a hundredth of the span,
differences are off by 1 %, which Newton's method bears."""
NOISE = 0.02
"""Part of dP/dp that the runs' tolerance may leave of it: a tighter one is taken where orbits are that small."""
LEAST_TOLERANCE = 1e-12
"""Tolerance below which rounding would be larger."""
CORRECTIONS = 6
"""Newton steps that a point may take; a shorter step along the curve takes fewer."""
EASY = 3
"""Newton steps up to which the next step along the curve is longer."""
LONGER, SHORTER = 1.5, 0.5
"""Factors of the next step along the curve behind an easy one, and behind one that did not come back to it."""
GROWN = 2.0
"""Growth of a defect from one Newton step to the next from which a shorter step along the curve is taken."""
FINE = 0.02
"""Step along the curve with which turning points are passed: a parabola through three points then has them to 1e-3."""
PASSED = 1.5
"""Step, of that, up to which a turning point counts as passed in short ones."""
ASTRAY = 2.0
"""Distance from the last point, in steps, beyond which Newton's method has gone to another part of the curve."""
ON_CURVE = 3e-4
"""Correction, as part of the first orbit's size and of the span, below which a point is on the curve: runs of light
oscillations leave 1e-4."""
SEARCHED = 200
"""Periods in which the first orbit is looked for."""
SMALLEST = 1e-4
"""Step along the curve, of the span of the parameter, below which it is not followed."""


@dataclass(frozen=True)
class AtValue:
    """The equations at a value of the parameter.

    Attributes
    ----------
    problem : DAEProblem
        Where an orbit is looked for from.
    period : float
        s.
    advance, origin : ndarray, shape (n,)
        What unknowns advance by in a period, and what they are counted from.
    """

    problem: DAEProblem
    period: float
    advance: np.ndarray
    origin: np.ndarray


@dataclass(frozen=True)
class Branch:
    """Orbits along a curve.

    Attributes
    ----------
    values : ndarray, shape (m,)
        Of the parameter.
    orbits : list of Orbit
    turns : ndarray, shape (k,)
        Values at which the parameter turns back: orbits next to them are among the others.
    why : str
        Why the curve ends: "left the span", "lost" where no step along it was short enough, or the number of points.
    """

    values: np.ndarray
    orbits: list[Orbit]
    turns: np.ndarray
    why: str

    @property
    def stable(self) -> np.ndarray:
        """Whether each orbit is stable, shape (m,)."""
        return np.array([orbit.stable for orbit in self.orbits])


def follow_branch(
    posed: Callable[[float], AtValue],
    start: float,
    stop: float,
    *,
    tol: float,
    step: float = 0.02,
    largest: float = 0.05,
    most: int = 400,
    method: str = "WSTIFF",
    first: Orbit | None = None,
) -> Branch:
    """Follow the orbits of a problem from one value of a parameter until another is passed, or the first again.

    Parameters
    ----------
    posed : callable
        Makes an `AtValue` of a value.
    start, stop : float
        Values; the curve is left where it leaves their span.
    tol : float
        Of the runs.
    step, largest : float
        First and largest step along the curve, as part of the span and of the orbit's size.
    most : int
        Points.
    method : str
        Integrator.
    first : Orbit, optional
        The orbit at ``start``; default the one that its motion leads to.

    Raises
    ------
    NoOrbit
        If there is none at the start.
    """
    curve = _Curve(posed, start, stop, tol, method)
    points = [curve.begin(first)]
    tangent = np.append(np.zeros(len(points[0]) - 1), np.sign(stop - start))
    low, high = sorted((start, stop))
    ds, limit, turns, why = step, largest, [], f"{most} points"
    while len(points) < most:
        found = curve.corrected(points[-1], tangent, ds)
        if found is None:
            ds *= SHORTER
            if ds < SMALLEST:
                why = "lost"
                break
            continue
        z, orbit, steps = found
        curve.take(float(z[-1] * curve.span), orbit)
        points.append(z)
        if len(points) > 2 and (z[-1] - points[-2][-1]) * (points[-2][-1] - points[-3][-1]) < 0.0:
            steps_there = [float(np.linalg.norm(b - a)) for a, b in pairwise(points[-3:])]
            if max(steps_there) > PASSED * FINE and len(points) > 3:
                # a turning point is passed in short steps, from ahead of it
                for _ in range(2):
                    curve.drop()
                    points.pop()
                tangent = (points[-1] - points[-2]) / np.linalg.norm(points[-1] - points[-2])
                ds = limit = FINE
                continue
            turns.append(curve.turn(points))
            limit = largest
        tangent = (points[-1] - points[-2]) / np.linalg.norm(points[-1] - points[-2])
        if not low <= curve.values[-1] <= high:
            why = "left the span"
            curve.end_at(low if curve.values[-1] < low else high, points)
            break
        if steps <= EASY:
            # where orbits have grown the curve is as much longer
            grown = max(1.0, orbit.size / curve.orbits[0].size) if limit == largest else 1.0
            ds = min(LONGER * ds, limit * grown)
    return Branch(np.array(curve.values), curve.orbits, np.array(turns), why)


class _Curve:
    """Where the curve is followed: its points so far, and the units of z."""

    def __init__(self, posed: Callable[[float], AtValue], start: float, stop: float, tol: float, method: str) -> None:
        self.posed = lru_cache(8)(posed)
        self.start, self.span, self.tol, self.method = start, abs(stop - start), tol, method
        self.values: list[float] = []
        self.orbits: list[Orbit] = []
        self.places: np.ndarray | None = None

    def search(self, p: float) -> tuple[Search, AtValue]:
        """Return a search for orbits at a value."""
        at = self.posed(p)
        search = Search(at.problem, at.period, at.advance, self.tol, self.method, SEARCHED, CLOSED)
        if self.places is not None:
            # x is of the same unknowns all along the curve
            search.directions = directions_at(at.problem, self.places)
        return search, at

    def begin(self, first: Orbit | None) -> np.ndarray:
        """Take the first orbit; return z of it."""
        search, at = self.search(self.start)
        if first is None:
            search.follow(2)
            first = search.found()
            allowed = NOISE * BY * first.size / IN_TOLERANCES
            if allowed < self.tol:
                self.tol = max(allowed, LEAST_TOLERANCE)
                search, at = self.search(self.start)
                search.problem = first.problem
                first = search.found()
        self.places = first.directions.places
        # x in units of the orbit's own size
        weights = np.abs(search.weights).max(axis=0)
        self.unit = first.size / np.where(weights > 0.0, weights, 1.0)
        self.take(self.start, first)
        x = (first.problem.y0 - at.origin)[self.places] / self.unit
        return np.append(x, self.start / self.span)

    def take(self, value: float, orbit: Orbit) -> None:
        """Add a point."""
        self.values.append(value)
        self.orbits.append(orbit)

    def drop(self) -> None:
        """Forget the last point."""
        self.values.pop()
        self.orbits.pop()

    def tried(self, z: np.ndarray, matrix: np.ndarray | None) -> tuple[Orbit, np.ndarray]:
        """Return the motion over a period from z, and by what it misses itself, in units of x."""
        search, at = self.search(float(z[-1] * self.span))
        last, basis = self.orbits[-1].problem, self.orbits[-1].directions.basis
        # all other unknowns move with the origin, and with x
        y = last.y0 + at.origin - self.posed(self.values[-1]).origin
        y = y + basis @ (at.origin[self.places] + z[:-1] * self.unit - y[self.places])
        orbit = search.tried(replace(at.problem, y0=y, yp0=last.yp0), matrix)
        return orbit, search.missing(orbit) / self.unit

    def jacobian(self, z: np.ndarray, orbit: Orbit) -> np.ndarray:
        """Return d(P - x)/dz at a motion from z, shape (m, m + 1)."""
        m = len(z) - 1
        by = BY
        ends = [self.tried(z + sign * by * np.eye(m + 1)[-1], orbit.near)[1] for sign in (1.0, -1.0)]
        own = orbit.near * self.unit[None, :] / self.unit[:, None]
        return np.column_stack([own - np.eye(m), (ends[0] - ends[1]) / (2.0 * by)])

    def turn(self, points: list[np.ndarray]) -> float:
        """Return the value at which the parameter turns back: the vertex of a parabola through the last points."""
        s = np.cumsum([0.0, *(np.linalg.norm(b - a) for a, b in pairwise(points[-3:]))])
        c = np.polyfit(s - s[1], [z[-1] for z in points[-3:]], 2)
        return float((c[2] - c[1] ** 2 / (4.0 * c[0])) * self.span)

    def end_at(self, value: float, points: list[np.ndarray]) -> None:
        """Put the last point, which is beyond the span, onto its end."""
        share = (value / self.span - points[-2][-1]) / (points[-1][-1] - points[-2][-1])
        guess = points[-2] + share * (points[-1] - points[-2])
        along = np.append(np.zeros(len(guess) - 1), np.sign(points[-1][-1] - points[-2][-1]))
        ds = abs(value / self.span - points[-2][-1])
        found = self.corrected(points[-2], along, ds, guess)
        if found is not None:
            self.values[-1], self.orbits[-1] = value, found[1]

    def corrected(
        self, last: np.ndarray, tangent: np.ndarray, ds: float, guess: np.ndarray | None = None
    ) -> tuple[np.ndarray, Orbit, int] | None:
        """Return z and orbit of the next point, and how many corrections it took; None if there are too many."""
        z, before = last + ds * tangent if guess is None else guess, np.inf
        farthest = ASTRAY * (abs(ds) if guess is None else float(np.linalg.norm(guess - last))) + ON_CURVE
        for count in range(1, CORRECTIONS + 1):
            orbit, missing = self.tried(z, None)
            matrix = np.vstack([self.jacobian(z, orbit), tangent])
            step = np.linalg.solve(matrix, -np.append(missing, tangent @ (z - last) - ds))
            if np.abs(step).max() < ON_CURVE:
                return z, orbit, count
            z, size = z + step, float(np.abs(missing).max())
            if size > GROWN * before or np.linalg.norm(z - last) > farthest:
                return None
            before = size
        return None
