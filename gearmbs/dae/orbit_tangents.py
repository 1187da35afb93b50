"""How a periodic orbit changes with parameters.

An orbit is a fixed point x = P(x, p) of the period map. With a parameter p that leaves the period as it is

    dx/dp = M dx/dp + dP/dp   or   (I - M) dx/dp = dP/dp,

with the monodromy matrix M and the sensitivity dP/dp of the end of a period whose start does not move. With dx/dp for
their start the variational equations give the sensitivities of the whole period (`gearmbs.dae.tangents`): no run beside
the orbit is made.

References
----------
.. [1] R. Seydel, "Practical Bifurcation and Stability Analysis", Springer 2010, chapter 7.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearmbs.dae.orbits import INDEPENDENT, LEAST_STEPS, Directions, Orbit, algebraic_rows, moved_at_start
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.tangent_track import MOST
from gearmbs.dae.tangents import Direction, Followed, follow

SINGULAR = 1e-6
"""Singular value of I - M, of the largest, below which it counts as none: M itself is right to that."""
LEFT = 1e-4
"""Part of the largest sensitivity over the period that its end may be off where I - M is singular: what turns freely
has a multiplier of 1 and may have any start, but an orbit that drifts with the parameter is none any more."""


def orbit_sensitivities(orbit: Orbit, parameters: list[Direction]) -> Followed:
    """Return the sensitivities of an orbit at the outputs of its period.

    Parameters
    ----------
    orbit : Orbit
    parameters : list of Direction
        What each changes in the table of numbers; how it moves the start follows from the orbit.

    Raises
    ------
    ModelError
        If equations jump at a time that depends on a parameter, see `gearmbs.dae.tangents.follow`; if with another
        value there is no orbit beside this one.
    """
    problem, result, directions = orbit.problem, orbit.result, orbit.directions
    fixed = [replace(one, start=_start_beside(problem, directions, one)) for one in parameters]
    longest = orbit.period / LEAST_STEPS
    # each unknown in its own magnitude, so that what is left can be compared
    unit = np.asarray(problem.scale, dtype=float)[directions.places]
    gone = follow(problem, result, fixed, longest).s[:, :, directions.places] / unit
    matrix = (np.eye(len(unit)) - orbit.monodromy) / unit[:, None] * unit
    wanted = gone[:, -1].T
    moved = np.linalg.lstsq(matrix, wanted, rcond=SINGULAR)[0]
    left = np.abs(matrix @ moved - wanted).max(axis=0, initial=0.0)
    for one, rest, most in zip(parameters, left, np.abs(gone).max(axis=(1, 2), initial=0.0), strict=True):
        if rest > LEFT * most:
            raise ModelError(
                f"parameter {one.name!r}: with another value there is no orbit beside this one, for what has a "
                "multiplier of 1 drifts; hold it by a motion or a load that depends on where it is"
            )
    starts = directions.basis @ (moved * unit[:, None])
    whole = [replace(one, start=one.start + start) for one, start in zip(fixed, starts.T, strict=True)]
    return follow(problem, result, whole, longest)


def _start_beside(problem: DAEProblem, directions: Directions, parameter: Direction) -> np.ndarray:
    """Return how a consistent start changes with a parameter while its independent unknowns stay, shape (n,).

    The equations without rates hold at each value: dG_a/dy dy/dp = -dG_a/dp.
    """
    places, rows, sizes = algebraic_rows(problem)
    found = np.zeros(problem.n)
    if not places.size:
        return found
    sides = []
    for by in (MOST, -MOST):
        numbers, out = problem.rdata.copy(), np.zeros(problem.n)
        numbers[parameter.places] += by * parameter.weights
        problem.residual(
            problem.t0, problem.y0, problem.yp0, out, problem.idata.copy(), numbers, np.zeros(problem.work_size)
        )
        sides.append(out[places])
    change = (sides[0] - sides[1]) / (2.0 * MOST) / sizes
    found = np.linalg.lstsq(rows, -change, rcond=INDEPENDENT)[0] * np.asarray(problem.scale, dtype=float)
    found = np.where(moved_at_start(problem), found, 0.0)
    return found - directions.basis @ found[directions.places]
