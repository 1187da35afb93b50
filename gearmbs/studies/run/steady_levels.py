"""Mesh harmonics of the steady motion of a case, with their derivatives by fields of the case.

The motion is found once; how it moves with a field is told by the variational equations along it
(`gearmbs.mechanism.solve.orbit_sensitivities`), so that derivatives cost no further motion. See docs/theory/orbits.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from gearmbs.dae.orbits import NoOrbit
from gearmbs.dae.problem import ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.solve.orbit_sensitivities import derived_motion
from gearmbs.mechanism.solve.sensitivities import values_and_scales
from gearmbs.mechanism.solve.simulate import prepared
from gearmbs.signals.conversion import COMPONENTS
from gearmbs.studies.case.case import Case
from gearmbs.studies.run.levels import WAYS
from gearmbs.studies.run.simulation import SimulationFailed, case_mechanism
from gearmbs.studies.run.steady import SteadyCase, period_recorder, posed_case, steady_case


@dataclass(frozen=True, eq=False)
class SteadyLevels:
    """Mesh harmonics of a steady motion.

    Attributes
    ----------
    motion : SteadyCase
        Without its record's variables over time.
    values : ndarray, shape (2, harmonics, components)
        RMS of the acceleration, by band and by orders, m/s^2, as ``gmf_rms`` of `gearmbs.studies.run_case`.
    """

    motion: SteadyCase
    values: np.ndarray
    _case: Case = field(repr=False)

    def levels(self, way: str) -> dict[tuple[str, int], float]:
        """Return the levels of one way, "band" or "orders", by component and harmonic."""
        return self._by_name(way, self.values)

    def slopes(self, way: str, derivative: np.ndarray) -> dict[tuple[str, int], float]:
        """Return derivatives of the logarithms of the levels of one way from those of all levels."""
        with np.errstate(all="ignore"):
            return self._by_name(way, derivative / self.values)

    def _by_name(self, way: str, values: np.ndarray) -> dict[tuple[str, int], float]:
        of = values[WAYS.index(way)]
        return {(c, h + 1): float(of[h, k]) for k, c in enumerate(COMPONENTS) for h in range(len(of))}

    def derivatives(
        self, changed: Callable[..., Case], parameters: Mapping[str, float | tuple[float, float]]
    ) -> tuple[dict[str, np.ndarray], dict[str, str]]:
        """Return the derivatives by parameters, and why there are none by others.

        Parameters
        ----------
        changed : callable
            ``changed(**values)`` returns the case with these values of all parameters.
        parameters : mapping
            Names and values, or pairs of value and scale, as of `gearmbs.mechanism.forward_sensitivities`.

        Returns
        -------
        found : dict of ndarray
            By name, of the shape of ``values``.
        refused : dict of str
            By name what stands against it: it changes the period, as a speed does, or tables of the model.
        """
        values, scales = values_and_scales(parameters)
        if not values:
            return {}, {}
        try:
            return self._derived(changed, values, scales, list(values)), {}
        except ModelError:
            pass
        found: dict[str, np.ndarray] = {}
        refused: dict[str, str] = {}
        # one refuses for all: the others are found one by one
        for name in values:
            try:
                found |= self._derived(changed, values, scales, [name])
            except ModelError as error:
                refused[name] = str(error)
        return found, refused

    def _derived(
        self, changed: Callable[..., Case], values: dict[str, float], scales: dict[str, float], names: list[str]
    ) -> dict[str, np.ndarray]:
        """Return the derivatives by some of the parameters."""
        at = posed_case(self._case)[2]
        rate_scale = self._case.operation.top_speed * self._case.gears.teeth[0]

        def case_of(name: str, value: float) -> Case:
            return changed(**(values | {name: value})).changed(operation={"duration": "auto"})

        @cache
        def made(name: str, value: float):
            return prepared(case_mechanism(case_of(name, value)), 0.0, True, "SI2", rate_scale, False)

        motion, asked = self.motion, {name: values[name] for name in names}
        derived = derived_motion(motion, asked, scales, made, at.problem)
        found = {}
        for name in names:
            sides, by = derived.beside(name)
            above, below = (
                self._levels_of(case_of(name, values[name] + way * by), solution)
                for way, solution in zip((1.0, -1.0), sides, strict=True)
            )
            found[name] = (above - below) / (2.0 * by)
        return found

    def _levels_of(self, case: Case, solution: Solution) -> np.ndarray:
        meshes = round(self.motion.period * case.mesh_frequency)
        return period_recorder(case, solution, meshes, 0.0).levels()


def levels_or_reason(case: Case) -> SteadyLevels | str:
    """Return what `steady_levels` does, or why the case has no steady motion."""
    try:
        return steady_levels(case)
    except (NoOrbit, ModelError, SimulationFailed, ValueError) as error:
        return str(error)


def steady_levels(case: Case, most: int = 200) -> SteadyLevels:
    """Find the steady motion of a case, and its mesh harmonics.

    Parameters
    ----------
    case : Case
    most : int
        As of `gearmbs.studies.steady`.

    Raises
    ------
    NoOrbit, CaseError
        See `gearmbs.studies.steady`.
    """
    motion = steady_case(case, variables=["gmf_rms"], most=most)
    levels = motion.record["gmf_rms"].transpose("way", "harmonic", "component")
    levels = levels.sel(way=list(WAYS), component=list(COMPONENTS))
    return SteadyLevels(motion, levels.values, case.changed(operation={"duration": "auto"}))
