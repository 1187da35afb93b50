"""What all fits have in common: measured numbers, predictions of them, and derivatives of these.

Derivatives are either the model's own, then one evaluation gives residuals and Jacobian, or central differences.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np

from gearmbs.identify.fit import SIMULATION_STEP, FitKeywords, central, fit, noise_of_columns
from gearmbs.identify.identifiability import LIMIT, Identifiability
from gearmbs.identify.parameters import Fit, Free, IdentifyError, NoValues, Scale
from gearmbs.identify.tables import groups_of

if TYPE_CHECKING:
    import pandas as pd

Gains = Literal["none", "one", "channel", "case", "line"]

COARSER = 10.0
"""By what the tolerance is larger at which own derivatives are taken once more, for their noise."""


class Problem(ABC):
    """Measured numbers and a model that predicts them.

    Attributes
    ----------
    free : list of Free
        In SI.
    notes : list of str
        What a report of a fit has to say of how the predictions were made.
    """

    free: list[Free]
    notes: list[str]

    @property
    @abstractmethod
    def measured(self) -> np.ndarray:
        """What was measured, shape (m,), as it is predicted."""

    @property
    @abstractmethod
    def sigma(self) -> np.ndarray:
        """Its standard deviations."""

    @property
    def lost(self) -> int:
        """Degrees of freedom that the model itself uses up."""
        return 0

    @abstractmethod
    def predictions(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return predictions, shape (m,), for several parameter vectors; NaN where they fail."""

    def jacobian(self, p: np.ndarray) -> np.ndarray | None:
        """Return the derivatives of the predictions by the parameters, shape (m, n); None if there are none of its
        own."""
        return None

    def coarser(self) -> Problem | None:
        """Return the same at a tolerance `COARSER` times as large."""
        return None

    def derivatives(self, p: Sequence[float] | None = None) -> np.ndarray:
        """Return the derivatives of the predictions over their standard deviations, shape (m, n).

        They are those by the logarithm of each parameter; of one fitted as it is, times its magnitude, which is the
        same, or where that is zero half the distance of its bounds, if it has any.
        """
        return self._derivatives(p)[0]

    def _derivatives(self, p: Sequence[float] | None) -> tuple[np.ndarray, bool]:
        """Return the derivatives, and whether they are the model's own."""
        z = self._z(p)
        scale, sizes = Scale(tuple(self.free)), self._magnitudes(z)
        at = scale.p(z)
        own = self.jacobian(at)
        if own is None:
            matrix = central(self._many, z, SIMULATION_STEP * sizes) * sizes
        else:
            matrix = own / self.sigma[:, None] * np.where(scale.logs, at, sizes)
        if not np.isfinite(matrix).all():
            raise IdentifyError(f"the simulations fail about the start; give another one{self._causes()}")
        return matrix, own is not None

    def _causes(self) -> str:
        """Return what is known of why there are no predictions, to follow a sentence that says so."""
        return "".join(f". {note[:1].upper()}{note[1:]}" for note in self.notes)

    def _many(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return predictions at several z over their standard deviations."""
        scale = Scale(tuple(self.free))
        return [f / self.sigma for f in self.predictions([scale.p(q) for q in points])]

    def _z(self, p: Sequence[float] | None) -> np.ndarray:
        return Scale(tuple(self.free)).z([f.start for f in self.free] if p is None else p)

    def _magnitudes(self, z: np.ndarray) -> np.ndarray:
        """Return by what derivatives in z become those by logarithms."""
        low, high = Scale(tuple(self.free)).bounds()
        reach = np.where(np.isfinite(high - low), 0.5 * (high - low), 1.0)
        return np.where([f.log for f in self.free], 1.0, np.where(z == 0.0, reach, np.abs(z)))

    def identifiability(
        self, p: Sequence[float] | None = None, *, noise: bool = True, limit: float = LIMIT
    ) -> Identifiability:
        """Return what the measured numbers can tell at p, default the starts.

        Parameters
        ----------
        p : sequence of float, optional
        noise : bool
            Judge the noise of the derivatives, too: own ones are taken once more at ten times the tolerance,
            differences at half the step, with four simulations a parameter and case instead of two.
        limit : float
            Standard deviation of a combination of logarithms from which it counts as undetermined.
        """
        matrix, own = self._derivatives(p)
        names = [f.name for f in self.free]
        if not noise:
            floor = np.zeros(len(names))
        elif own:
            other = self.coarser()
            again = matrix if other is None else other.derivatives(p)
            floor = np.linalg.norm(matrix - again, axis=0)
        else:
            z = self._z(p)
            sizes = self._magnitudes(z)
            floor = sizes * noise_of_columns(self._many, z, SIMULATION_STEP * sizes, matrix / sizes)
        return Identifiability(names, matrix, floor, limit)

    def fit(self, **settings: Unpack[FitKeywords]) -> Fit:
        """Find the parameters; see `gearmbs.identify.fit` for the settings.

        The step of differences and the end of the search are those that fit the integrator's noise.
        """
        chosen: FitKeywords = {"step": SIMULATION_STEP, "tolerance": 1e-4, **settings}
        try:
            found = fit(
                lambda p: self.predictions([p])[0],
                self.measured,
                self.free,
                sigma=self.sigma,
                many=self.predictions,
                jacobian=self.jacobian,
                lost=self.lost,
                **chosen,
            )
        except NoValues as error:
            raise NoValues(f"{error}{self._causes()}") from None
        return replace(found, notes=tuple(self.notes))


class LevelProblem(Problem):
    """A table of measured levels, held against logarithms of predicted ones, with free gains.

    Parameters
    ----------
    table : DataFrame
        As `gearmbs.identify.tables.check_table` returns it.
    gains : str
        See `CaseProblem`.
    """

    def __init__(self, table: pd.DataFrame, gains: Gains) -> None:
        self.table, self.gains = table, gains
        self.groups = groups_of(table, gains)
        self.notes = []

    @property
    def lost(self) -> int:
        """Degrees of freedom that the gains use up."""
        return 0 if self.groups is None else int(self.groups.max()) + 1

    @property
    def measured(self) -> np.ndarray:
        """Logarithms of the measured values, gains left out."""
        return self.without_gains(np.log(self.table["value"].to_numpy()))

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations of the logarithms."""
        return self.table["sigma"].to_numpy()

    def without_gains(self, logs: np.ndarray) -> np.ndarray:
        """Return logarithms, shape (m, ...), less the weighted mean of their group."""
        if self.groups is None:
            return logs
        columns: Any = logs.reshape(len(self.table), -1)
        weight = 1.0 / self.table["sigma"].to_numpy() ** 2
        total = np.bincount(self.groups, weight)
        means = [np.bincount(self.groups, weight * column) / total for column in columns.T]
        return logs - np.stack(means, axis=-1)[self.groups].reshape(logs.shape)
