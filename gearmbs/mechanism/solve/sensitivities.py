"""Derivatives of everything a simulation gives by parameters of its model: forward sensitivities.

The variational equations are followed along the run (`gearmbs.dae.tangents`). The parameters are arguments of whatever
builds the mechanism; how tables and start depend on each is seen by building it at p + d and p - d. A result
R(t, y, y', p) then has

    dR/dp = (R(y + e s, y' + e s', p + e) - R(y - e s, y' - e s', p - e)) / 2 e,

with the sensitivities s of the unknowns: solutions are made of both sides, and anything can be asked of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gearmbs.dae.methods import DEFAULT, INTEGRATORS, those_that
from gearmbs.dae.problem import EPS, DAEProblem, ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.dae.tangent_track import MOST, MOVED
from gearmbs.dae.tangents import Direction, Followed, follow
from gearmbs.mechanism.forces.functions import FunctionForce
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.accuracy import chosen_accuracy
from gearmbs.mechanism.solve.simulate import prepared, simulate
from gearmbs.units import QuantityLike
from gearmbs.wording import any_of, did_you_mean, warn

if TYPE_CHECKING:
    from gearmbs.mechanism.solve.keywords import SensitivityOptions

TIGHTER = 0.1
"""Part of the usual tolerance at which a run is differentiated where none is given. Derivatives bend where the rates of
the run do, and are as accurate as the unknowns at ten times the tolerance (docs/theory/tangents.md)."""
RESOLVED = 2e10
"""Roundings by which what a parameter moves is moved at least where the models beside each other are made: `BY` moves
it by 2e4 times less, whose error is a millionth then."""
SURELY = 16.0
"""Roundings of a number up to which it may have been moved by nothing else."""
LESS_OF_SCALE = 0.1
"""Part of a given scale by which numbers that are zero are moved at most."""
WIDENINGS, FARTHEST = 4, 1e6
"""How often, and by how much at a time, models are made farther apart."""
LARGEST_COUNT = 2**32
"""Above it integers of the tables are addresses; counts and places stay far below."""
WITHOUT = ("every_step", "consumer", "watch", "stops", "initial", "assembled", "inputs", "continued", "dense_output")
"""Options of `simulate` that belong to runs of another kind."""


@dataclass(frozen=True)
class Sensitivities:
    """A run and its derivatives by parameters.

    Attributes
    ----------
    solution : Solution
    values : dict of float
        The parameters, at which the run was made.
    unknowns, rates : dict of ndarray, shape (m, n)
        By parameter: dy/dp and dy'/dp at the outputs, in the order of the problem's unknowns.
    local_error : dict of float
        By parameter: the largest local error of a step of the variational equations, as part of the largest
        value of the unknown, 0 where none under error control depends on the parameter; that of what is derived is
        larger by what steps add up to.
    """

    solution: Solution
    values: dict[str, float]
    unknowns: dict[str, np.ndarray]
    rates: dict[str, np.ndarray]
    local_error: dict[str, float]
    _beside: Callable[[str, float], Solution]
    _scales: dict[str, float]

    def derivative(self, parameter: str, result: str | Callable[[Solution], Any]) -> np.ndarray:
        """Return the derivative of a result by a parameter.

        Parameters
        ----------
        parameter : str
        result : str or callable
            An expression in the function language of ADAMS, or what makes numbers of a solution, as
            ``lambda s: s.diagnostics("mesh")["normal_force"]``; also those of a whole record, as its RMS.

        Returns
        -------
        ndarray
            Of the shape of the result.

        Raises
        ------
        ModelError
            For a parameter that was not asked for.
        """
        (above, below), by = self.beside(parameter)

        def of(solution: Solution) -> np.ndarray:
            found = solution.evaluate(result) if isinstance(result, str) else result(solution)
            return np.asarray(found, dtype=float)

        return (of(above) - of(below)) / (2.0 * by)

    def beside(self, parameter: str) -> tuple[tuple[Solution, Solution], float]:
        """Return the solutions at p + e and p - e, and e: what is asked of both is differentiated by their difference.

        Raises
        ------
        ModelError
            For a parameter that was not asked for.
        """
        if parameter not in self.values:
            there = list(self.values)
            hint = did_you_mean(parameter, there, shown=repr, otherwise=f"there is {', '.join(there)}")
            raise ModelError(f"derivative by {parameter!r}: it is no parameter of this run; {hint}")
        problem = self.solution.problem
        # positions and rates, of which forces are functions; reactions and accelerations are linear in what they follow
        moved = np.abs(self.unknowns[parameter]) * problem.error_mask / problem.scale
        most = float(moved.max(initial=0.0))
        by = MOST * self._scales[parameter]
        if most > 0.0:
            by = min(by, MOVED / most)
        return (self._beside(parameter, by), self._beside(parameter, -by)), by

    def __repr__(self) -> str:
        by = ", ".join(f"{name} = {value:g}" for name, value in self.values.items())
        return f"Sensitivities({self.solution.t.size} outputs by {by})"


def forward_sensitivities(
    build: Callable[..., Mechanism],
    parameters: Mapping[str, Any],
    t_end: QuantityLike,
    *,
    t_start: QuantityLike = 0.0,
    formulation: str = "SI2",
    tol: float | None = None,
    rate_scale: float | None = None,
    lump: bool | None = None,
    local_error: float | None = None,
    **options: Unpack[SensitivityOptions],
) -> Sensitivities:
    """Simulate a mechanism and differentiate the run by parameters of it.

    Parameters
    ----------
    build : callable
        ``build(**parameters)`` returns the mechanism; it has to have the same parts whatever the values.
    parameters : mapping
        Names and values, numbers in SI. A pair ``(value, scale)`` where the value is zero, or says nothing of its size;
        a scale below the roundings of what the parameter is added to is made larger.
    t_end : float
        End of the simulation, s.
    t_start, formulation, rate_scale, lump, **options
        As of `gearmbs.mechanism.simulate`, with an integrator that has dense output.
    tol : float, optional
        Of the run; default a tenth of that of `gearmbs.mechanism.simulate`: derivatives are less smooth than the run.
    local_error : float, optional
        Local error of a step of the derivatives that is allowed, as in `Sensitivities`: steps of the run that leave
        more are divided. Default: what they leave, which is told.

    Returns
    -------
    Sensitivities

    Raises
    ------
    ModelError
        If the run fails; if a parameter changes what the model is made of; if forces jump at a time that depends on it,
        so that derivatives do; if an option is of another kind of run; if ``local_error`` is not positive.

    Notes
    -----
    The cost beside the run is, for each step, that of a Jacobian, a factorisation and some two residuals, and for each
    parameter that of what of the residual it enters and an eighth of some substitutions. With ``local_error`` it is
    that once more but for the jumps, and what is divided. Contact and friction here are continuous.
    """
    for option in WITHOUT:
        if option in options:
            raise ModelError(f"forward_sensitivities has no option {option!r}: it belongs to other runs; leave it out")
    name = str(options.get("integrator", DEFAULT)).upper()
    if not INTEGRATORS.get(name, INTEGRATORS[DEFAULT]).can("dense_output"):
        able = any_of(those_that("dense_output"))
        raise ModelError(f"integrator: {name!r} does not keep its steps for sensitivities; choose {able}")
    values, scales = values_and_scales(parameters)
    start, end = quantity(t_start, "time", "t_start"), quantity(t_end, "time", "t_end")
    if local_error is not None and not local_error > 0.0:
        raise ModelError(f"local_error = {local_error:g}: it must be positive, a part of the largest value as 1e-4")
    mechanism = built(build, values)
    usual, rate_scale = chosen_accuracy(mechanism, (start, end), tol, rate_scale)
    tol = TIGHTER * usual if tol is None else usual
    solution = simulate(
        mechanism, end, t_start=start, formulation=formulation, tol=tol, rate_scale=rate_scale, lump=lump,
        dense_output=True, **options,
    )  # fmt: skip
    if not solution.result.success:
        raise ModelError(f"forward_sensitivities: the run itself fails: {solution.message}")
    lumped = mechanism.lump if lump is None else lump

    def made(key: str, value: float):
        other = built(build, values | {key: value})
        check_functions(key, mechanism, other)
        return prepared(other, start, lumped, formulation, rate_scale, True)

    directions = []
    for key, value in values.items():
        scales[key], plus, minus = beside_each_other(key, value, scales[key], made)
        directions.append(direction_of(key, solution.problem, plus, minus, 2.0 * MOST))
    followed: Followed = follow(solution.problem, solution.result, directions, local_error=local_error)
    unknowns = {key: followed.s[p] / scales[key] for p, key in enumerate(values)}
    rates = {key: followed.sp[p] / scales[key] for p, key in enumerate(values)}

    def beside(key: str, by: float) -> Solution:
        system, problem, members, _ = made(key, values[key] + by)
        result = solution.result
        moved = replace(
            result, y=result.y + by * unknowns[key], yp=result.yp + by * rates[key] if result.yp.size else result.yp,
            sol=None,
        )  # fmt: skip
        found = Solution(system, problem, moved, members)
        found.inside = solution.inside
        return found

    errors = {key: float(followed.error[p]) for p, key in enumerate(values)}
    return Sensitivities(solution, values, unknowns, rates, errors, beside, scales)


def values_and_scales(parameters: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, float]]:
    """Return values and scales of parameters by name."""
    if not parameters:
        raise ModelError("parameters: there is none; give names and values, as {'stiffness': 2e8}")
    pairs = {name: _value_and_scale(name, given) for name, given in parameters.items()}
    return {name: value for name, (value, _) in pairs.items()}, {name: scale for name, (_, scale) in pairs.items()}


def _value_and_scale(name: str, given: Any) -> tuple[float, float]:
    """Return value and scale of a parameter."""
    pair = given if isinstance(given, tuple) else (given, None)
    try:
        value = float(pair[0])
        scale = abs(value) if pair[1] is None else float(pair[1])
    except (TypeError, ValueError, IndexError):
        raise ModelError(f"parameter {name!r}: {given!r} is no number in SI, or pair of value and scale") from None
    if not (np.isfinite(value) and np.isfinite(scale) and scale > 0.0):
        raise ModelError(f"parameter {name!r}: {given!r} says nothing of its size; give ({value:g}, scale), scale > 0")
    return value, scale


def built(build: Callable[..., Mechanism], values: Mapping[str, float]) -> Mechanism:
    made = build(**values)
    if not isinstance(made, Mechanism):
        raise ModelError(f"build: it returned {made!r}; it has to return the Mechanism of these parameters")
    return made


def check_functions(name: str, mechanism: Mechanism, other: Mechanism) -> None:
    """Refuse functions of Python and laws that are other ones each time: what of a parameter is in them is not seen."""
    for key, known in mechanism.functions.items():
        found = other.functions.get(key)
        if found is not None and (found.function, found.partials) != (known.function, known.partials):
            raise ModelError(
                f"parameter {name!r}: function {known.name!r} is another object in each mechanism that build returns, "
                "and what it takes of the parameter is not seen; define it outside build, with parameters as arguments"
            )
    for key, element in mechanism.elements.items():
        if _inside(element) != _inside(other.elements.get(key, element)):
            raise ModelError(
                f"parameter {name!r}: numbers inside the function of force {element.name!r} change with it, and are "
                f"not seen; let it take them as its own, and give parameters={{{name!r}: ...}} to the force"
            )


def _inside(element: Any) -> Any:
    """Return what has the numbers that stand inside the function of a force: the texts of a law, those of a closure."""
    if not isinstance(element, FunctionForce):
        return None
    if element.law is not None:
        return element.law.texts
    function = getattr(element.function, "py_func", element.function)
    cells = [cell.cell_contents for cell in getattr(function, "__closure__", None) or ()]
    plain = [cell.tolist() if isinstance(cell, (np.ndarray, np.number)) else cell for cell in cells]
    return [repr(cell) for cell in plain if isinstance(cell, (int, float, list, tuple))]


def beside_each_other(
    name: str, value: float, scale: float, made: Callable[[str, float], tuple[Any, DAEProblem, Any, str]]
) -> tuple[float, DAEProblem, DAEProblem]:
    """Return the scale of a parameter, and the problems a part of it above and below the value.

    The scale is the given one, or a larger one by which numbers of the model, or the start, are moved by more than
    roundings of themselves: a place at 1 m that an offset of a micrometre is added to.
    """
    for _ in range(WIDENINGS):
        plus, minus = made(name, value + MOST * scale)[1], made(name, value - MOST * scale)[1]
        factor = _wider(plus, minus)
        if factor <= 1.0:
            break
        scale *= factor
    return scale, plus, minus


def _wider(plus: DAEProblem, minus: DAEProblem) -> float:
    """Return by how much farther apart two problems have to be so that what differs does by more than roundings."""
    if plus.rdata.shape != minus.rdata.shape or plus.n != minus.n:
        return 1.0
    size = np.maximum(np.abs(plus.rdata), np.abs(minus.rdata))
    moved = np.isfinite(size)
    moved[moved] = np.abs(plus.rdata[moved] - minus.rdata[moved]) > SURELY * EPS * size[moved]
    change = np.abs(plus.rdata[moved] - minus.rdata[moved])
    if not moved.any():
        change = np.abs(plus.y0 - minus.y0)
        size = np.maximum(np.maximum(np.abs(plus.y0), np.abs(minus.y0)), plus.scale)
        factor = RESOLVED * EPS / np.max(change / size, initial=0.0) if change.any() else 1.0
        return float(min(factor, FARTHEST))
    size = size[moved]
    # what is zero at the value itself says nothing of how far it may go
    least = np.min(np.where(2.0 * size > 1.5 * change, 2.0 * MOST * size / change, LESS_OF_SCALE / MOST))
    return float(min(RESOLVED * EPS * np.max(size / change), least, FARTHEST))


def direction_of(name: str, problem: DAEProblem, plus: DAEProblem, minus: DAEProblem, width: float) -> Direction:
    """Return how tables and start change by the scale of a parameter; refuse one that changes what there is."""
    for side in (plus, minus):
        same = side.n == problem.n and side.idata.shape == problem.idata.shape
        if same:
            # functions of Python have another address in each model
            moved = side.idata != problem.idata
            same = bool((np.minimum(side.idata, problem.idata)[moved] > LARGEST_COUNT).all())
        if not same or side.rdata.shape != problem.rdata.shape:
            raise ModelError(
                f"parameter {name!r}: with another value the model has other parts or other tables, so that nothing "
                "can be differentiated by it; take one that changes numbers only (in an expression 0 and 1 may vanish: "
                "give m.parameter there)"
            )
    differ = plus.rdata != minus.rdata
    if not np.isfinite(plus.rdata[differ] - minus.rdata[differ]).all():
        raise ModelError(f"parameter {name!r}: with it a number of the model becomes infinite, as a limit that goes")
    change = np.zeros(differ.size)
    change[differ] = (plus.rdata[differ] - minus.rdata[differ]) / width
    places = np.flatnonzero(change)
    start = (plus.y0 - minus.y0) / width
    if not places.size and not start.any():
        warn(f"parameter {name!r} changes no number of the model, nor its start: all derivatives by it are zero")
    return Direction(name, start, places, change[places])
