"""Derivatives of a steady motion by parameters of its model: of one period, without a run beside it.

How the orbit moves with a parameter is told by `gearmbs.dae.orbit_tangents`; results are derived as those of runs are
(`gearmbs.mechanism.solve.sensitivities`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gearmbs.dae.orbit_tangents import orbit_sensitivities
from gearmbs.dae.orbits import check_repeats
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.dae.state import State
from gearmbs.dae.tangent_track import MOST
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.accuracy import chosen_accuracy
from gearmbs.mechanism.solve.orbits import SteadyMotion, harmonics_of, steady_motion
from gearmbs.mechanism.solve.sensitivities import (
    Sensitivities,
    beside_each_other,
    built,
    check_functions,
    direction_of,
    values_and_scales,
)
from gearmbs.mechanism.solve.simulate import prepared, start_time
from gearmbs.units import QuantityLike

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members
    from gearmbs.dae.model.system import System
    from gearmbs.mechanism.solve.keywords import OrbitOptions

    Made = tuple[System, DAEProblem, Members | None, str]


@dataclass(frozen=True)
class SteadySensitivities(Sensitivities):
    """A steady motion and its derivatives by parameters; ``solution`` is its period.

    Attributes
    ----------
    motion : SteadyMotion
    """

    motion: SteadyMotion

    def harmonics(
        self, parameter: str, result: str | Callable[[Solution], Any], count: int = 3, every: int = 1
    ) -> np.ndarray:
        """Return the derivatives of complex amplitudes by a parameter.

        Parameters
        ----------
        parameter : str
        result, count, every
            As of `SteadyMotion.harmonics`.

        Returns
        -------
        ndarray of complex, shape (count + 1, ...)
            That of an amplitude itself is ``Re(conj(c) dc/dp) / |c|``.
        """

        def parts(solution: Solution) -> np.ndarray:
            lines = harmonics_of(solution, self.motion.period, result, count, every)
            return np.stack([lines.real, lines.imag])

        real, imaginary = self.derivative(parameter, parts)
        return real + 1j * imaginary


def steady_sensitivities(
    build: Callable[..., Mechanism],
    parameters: Mapping[str, Any],
    period: QuantityLike,
    *,
    t_start: QuantityLike = 0.0,
    initial: State | None = None,
    formulation: str = "SI2",
    tol: float | None = None,
    rate_scale: float | None = None,
    lump: bool | None = None,
    **settings: Unpack[OrbitOptions],
) -> SteadySensitivities:
    """Find the steady motion of a mechanism and differentiate it by parameters.

    Parameters
    ----------
    build, parameters
        As of `forward_sensitivities`.
    period : float or str
        s; it is the same whatever the parameters.
    t_start, initial, formulation, tol, rate_scale, lump, **settings
        As of `gearmbs.mechanism.steady_motion`.

    Returns
    -------
    SteadySensitivities

    Raises
    ------
    NoOrbit
        If there is no such motion.
    ModelError
        If a parameter changes the period, as a speed does, or what the model is made of; if forces jump at a time that
        depends on it; if beside the motion there is none with another value.

    Notes
    -----
    Of S parameters the cost beside the motion is that of following 2 S directions over one period.
    """
    values, scales = values_and_scales(parameters)
    mechanism = built(build, values)
    start = start_time(quantity(t_start, "time", "t_start"), initial)
    end = start + quantity(period, "time", "period")
    _, rate_scale = chosen_accuracy(mechanism, (start, end), tol, rate_scale)
    motion = steady_motion(
        mechanism, period, t_start=t_start, initial=initial, formulation=formulation, tol=tol, rate_scale=rate_scale,
        lump=lump, **settings,
    )  # fmt: skip
    lumped = True if lump is None else lump
    assembled_at = 0.0 if initial is None else initial.t_model

    def made(key: str, value: float) -> Made:
        other = built(build, values | {key: value})
        check_functions(key, mechanism, other)
        return prepared(other, assembled_at, lumped, formulation, rate_scale, initial is not None)

    own = prepared(mechanism, assembled_at, lumped, formulation, rate_scale, initial is not None)[1]
    return derived_motion(motion, values, scales, made, own)


def derived_motion(
    motion: SteadyMotion,
    values: dict[str, float],
    scales: dict[str, float],
    made: Callable[[str, float], Made],
    own: DAEProblem,
) -> SteadySensitivities:
    """Return a steady motion with its derivatives by parameters; see `steady_sensitivities`.

    Parameters
    ----------
    motion : SteadyMotion
    values, scales : dict of float
        Of the parameters, by name.
    made : callable
        ``made(name, value)`` returns system, problem, members and advice of the model with another value of one.
    own : DAEProblem
        As assembled with these values.
    """
    orbit = motion.orbit
    # what the motion has changed of the tables on its way to the orbit: turns that are counted, numbers that are set
    gone, there = orbit.problem.rdata - own.rdata, orbit.problem.idata != own.idata

    def placed(problem: DAEProblem) -> DAEProblem:
        """Return equations of another value on the orbit."""
        idata = np.where(there, orbit.problem.idata, problem.idata)
        at = orbit.problem
        return replace(problem, rdata=problem.rdata + gone, idata=idata, t0=at.t0, y0=at.y0, yp0=at.yp0)

    directions = []
    for key, value in values.items():
        scales[key], plus, minus = beside_each_other(key, value, scales[key], made)
        by = MOST * scales[key]
        directions.append(direction_of(key, own, plus, minus, 2.0 * MOST))
        try:
            check_repeats(placed(plus), orbit.period, orbit.advance, orbit.result)
        except ModelError as error:
            raise ModelError(
                f"parameter {key!r}: it changes the period, over which derivatives are taken: with {value + by:g} "
                f"{error}; compare steady motions with two values"
            ) from None
    followed = orbit_sensitivities(orbit, directions)
    unknowns = {key: followed.s[p] / scales[key] for p, key in enumerate(values)}
    rates = {key: followed.sp[p] / scales[key] for p, key in enumerate(values)}

    def beside(key: str, by: float) -> Solution:
        system, problem, members, _ = made(key, values[key] + by)
        result = orbit.result
        moved = replace(result, y=result.y + by * unknowns[key], yp=result.yp + by * rates[key], sol=None)
        found = Solution(system, placed(problem), moved, members)
        found.inside = motion.solution.inside
        return found

    errors = {key: float(followed.error[p]) for p, key in enumerate(values)}
    return SteadySensitivities(motion.solution, values, unknowns, rates, errors, beside, scales, motion)
