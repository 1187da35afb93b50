"""Parameters before a fit and after it: start, bounds and scale, then values with what one must know of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

LEVEL = 0.95
"""Probability of intervals where none is given, the customary one."""
DOUBTFUL = 0.01
"""Probability of residuals as large as these below which the noise given cannot be all."""

CORRELATED = 0.95
"""Correlation from which two parameters are said to be told apart badly."""

POINTS = 9
"""Values of a profile whose ends stand in a table: they are interpolated in the root of its rise, almost a line."""

PART_OF_LOST = 1e-6
"""Part of a unit direction without influence below which a parameter has none in it: far above rounding, 1e-15."""


# The error of identification.


class IdentifyError(ValueError):
    """A fit that cannot be made; the message names what is wrong and the remedy."""


class NoValues(IdentifyError):
    """A fit whose model gives no values at any of its starts."""


@dataclass(frozen=True)
class Free:
    """A parameter that is to be found.

    Parameters
    ----------
    name : str
        For cases the path of a field, as "contact.depth".
    start : float or str
        Where the search begins; texts with units are read in SI where a model of one's own is fitted, and in the
        field's unit where a case is. `fit` takes numbers.
    low, high : float or str, optional
        Bounds; default none, and with ``log`` a hundredth and a hundred times the start.
    log : bool
        Fit the logarithm: for what is positive and known to a factor rather than to an amount.
    also : dict of str to float
        Further fields that go with it, as multiples: ``{"friction.static": 2.0}`` of "friction.dynamic".
    """

    name: str
    start: float
    low: float | None = None
    high: float | None = None
    log: bool = True
    also: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for path, factor in self.also.items():
            if not (isinstance(factor, (int, float)) and np.isfinite(factor)):
                raise IdentifyError(f"{self.name}: also: {path} = {factor!r}; give the multiple, a finite number")
        if self.log and not (isinstance(self.start, str) or self.start > 0.0):
            raise IdentifyError(
                f"{self.name}: start = {self.start:g} has no logarithm; give a positive one or log=False"
            )


def in_numbers(item: Free) -> Free:
    """Return a parameter whose texts are numbers in SI.

    Raises
    ------
    IdentifyError
        For texts that are no quantity, or whose number in SI hangs on what the model takes: turns or radians.
    """
    from gearmbs.units import readings

    def number(what: str, given: Any) -> Any:
        if not isinstance(given, str):
            return given
        found = readings(given)
        if len({*found.values()}) == 1:
            return next(iter(found.values()))
        meant = " or ".join(f"{value:g} in {unit}" for unit, value in found.items())
        raise IdentifyError(
            f"{item.name}: {what} = {given!r} "
            + (f"may be {meant}: give the number that the model takes" if found else "is no number with a unit of SI")
        )

    return replace(item, **{what: number(what, getattr(item, what)) for what in ("start", "low", "high")})


@dataclass(frozen=True)
class Scale:
    """The way between parameters p and what the search moves, z = ln p or p.

    Attributes
    ----------
    free : tuple of Free
        With numbers throughout.
    """

    free: tuple[Free, ...]

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [f.name for f in self.free]

    @property
    def logs(self) -> np.ndarray:
        """Which parameters are fitted by their logarithm."""
        return np.array([f.log for f in self.free])

    def z(self, p: Sequence[float]) -> np.ndarray:
        """Return z of parameters p."""
        return np.array([np.log(v) if f.log else v for f, v in zip(self.free, p)], dtype=float)

    def p(self, z: np.ndarray) -> np.ndarray:
        """Return the parameters p of z."""
        return np.where(self.logs, np.exp(np.where(self.logs, z, 0.0)), z)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds of z.

        Raises
        ------
        IdentifyError
            If a start is outside its bounds, or a text.
        """
        low, high = [], []
        for f in self.free:
            for what, given in (("start", f.start), ("low", f.low), ("high", f.high)):
                if isinstance(given, str):
                    raise IdentifyError(f"{f.name}: {what} = {given!r} is a text; give the number that the model takes")
            a = f.low if f.low is not None else (0.01 * f.start if f.log else -np.inf)
            b = f.high if f.high is not None else (100.0 * f.start if f.log else np.inf)
            if not a < f.start < b:
                raise IdentifyError(f"{f.name}: start = {f.start:g} is not between low = {a:g} and high = {b:g}")
            if f.log and a <= 0.0:
                raise IdentifyError(f"{f.name}: low = {a:g} has no logarithm; give a positive one or log=False")
            low.append(np.log(a) if f.log else a)
            high.append(np.log(b) if f.log else b)
        return np.array(low), np.array(high)


@dataclass(frozen=True)
class Fit:
    """Parameters found, with their uncertainty.

    Attributes
    ----------
    names : list of str
    values : ndarray, shape (n,)
    errors : ndarray, shape (n,)
        Standard errors; of parameters fitted by their logarithm the value times that of the logarithm.
    correlation : ndarray, shape (n, n)
        Of the estimates; one of 1 in absolute value are only known together.
    residuals : ndarray, shape (m,)
        (prediction - measured) / sigma.
    cost : float
        Sum of squares of the residuals.
    freedom : int
        Values less parameters.
    waterfall : list of float
        Half the costs at which the searches ended, best first: if several are lowest, it is found more than once.
    runs : int
        Evaluations of the model.
    notes : tuple of str
        How the predictions were made, where that needs a word.
    """

    names: list[str]
    values: np.ndarray
    errors: np.ndarray
    correlation: np.ndarray
    residuals: np.ndarray
    cost: float
    freedom: int
    known_noise: bool
    waterfall: list[float]
    runs: int
    scale: Scale
    z: np.ndarray
    z_errors: np.ndarray
    singular_values: np.ndarray
    problem: Any = field(repr=False, default=None)
    loss: str = "linear"
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, problem: Any, z: np.ndarray, r: np.ndarray, matrix: np.ndarray, *, waterfall: list, runs: int) -> Fit:
        """Return the result of a problem at z."""
        scale = problem.scale
        freedom = r.size - problem.lost - z.size
        cost = float(r @ r)
        z_errors, correlation, singular = errors_of(matrix)
        if not problem.known:
            z_errors = z_errors * (np.sqrt(cost / freedom) if freedom > 0 else np.nan)
        values = scale.p(z)
        return cls(
            scale.names,
            values,
            np.where(scale.logs, np.abs(values) * z_errors, z_errors),
            correlation,
            r,
            cost,
            freedom,
            problem.known,
            waterfall,
            runs,
            scale,
            z,
            z_errors,
            singular,
            problem,
        )

    def __getitem__(self, name: str) -> float:
        return float(self.values[self._place(name)])

    def _place(self, name: str) -> int:
        if name not in self.names:
            raise IdentifyError(f"{name!r} was not fitted; fitted are {', '.join(self.names)}")
        return self.names.index(name)

    def interval(self, name: str, level: float = LEVEL) -> tuple[float, float]:
        """Return the confidence interval of a parameter from its standard error (Wald).

        Student's t where the noise was estimated. For strongly correlated or bounded parameters see `profile`.
        """
        from scipy.stats import norm, t

        if not 0.0 < level < 1.0:
            raise IdentifyError(f"level = {level!r}; give the probability of the interval, as 0.95")
        k = self._place(name)
        q = norm.ppf(0.5 + 0.5 * level) if self.known_noise else t.ppf(0.5 + 0.5 * level, max(1, self.freedom))
        ends = np.tile(self.z, (2, 1))
        ends[:, k] += np.array([-q, q]) * self.z_errors[k]
        return float(self.scale.p(ends[0])[k]), float(self.scale.p(ends[1])[k])

    @property
    def chi_square(self) -> float:
        """Cost over degrees of freedom: about 1 where model and noise are right; NaN without degrees of freedom."""
        return self.cost / self.freedom if self.freedom > 0 else float("nan")

    @property
    def aic(self) -> float:
        """Akaike's criterion, for the comparison of models of the same data: the lower, the better."""
        return self._deviance + 2.0 * self._count

    @property
    def bic(self) -> float:
        """Schwarz's criterion, which asks more of further parameters."""
        return self._deviance + self._count * float(np.log(self.residuals.size))

    @property
    def _deviance(self) -> float:
        m = self.residuals.size
        return self.cost if self.known_noise else m * float(np.log(self.cost / m))

    @property
    def _count(self) -> int:
        return len(self.names) + (0 if self.known_noise else 1)

    def table(self, level: float = LEVEL, *, profiles: bool = False) -> pd.DataFrame:
        """Return value, standard error, relative error and interval by parameter.

        Parameters
        ----------
        level : float
            Probability of the intervals.
        profiles : bool
            Those of the profiles, too, ``profile_low`` and ``profile_high``: where they differ from the linear ones the
            predictions bend within the errors.
        """
        import pandas as pd

        ends = [self.interval(name, level) for name in self.names]
        columns = {
            "value": self.values,
            "error": self.errors,
            "relative": self.errors / np.abs(self.values),
            "low": [a for a, _ in ends],
            "high": [b for _, b in ends],
        }
        if profiles:
            ends = [self.profile_interval(name, level, points=POINTS) for name in self.names]
            columns |= {"profile_low": [a for a, _ in ends], "profile_high": [b for _, b in ends]}
        return pd.DataFrame(columns, index=pd.Index(self.names, name="parameter"))

    def profile(self, name: str, points: int = 9, reach: float = 3.0) -> pd.DataFrame:
        """Return the least cost over values of one parameter, all others fitted again at each.

        Parameters
        ----------
        name : str
        points : int
            Values, over ``reach`` standard errors to both sides.

        Returns
        -------
        DataFrame
            ``value``, ``rise`` of the cost over its least in units of the noise's variance, and the other parameters.
            The
            95 % interval is where the rise stays below 3.84.
        """
        import pandas as pd

        k = self._place(name)
        if self.loss != "linear":
            raise IdentifyError(
                f"{name}: a profile is one of least squares, the fit's loss is {self.loss!r}; fit without"
            )
        if not np.isfinite(self.z_errors[k]):
            raise IdentifyError(
                f"{name}: its standard error is {self.z_errors[k]}, so that it has no profile; hold others"
            )
        low, high = self.scale.bounds()
        at = np.linspace(-reach, reach, points) * self.z_errors[k] + self.z[k]
        unit = 1.0 if self.known_noise else self.cost / max(1, self.freedom)
        rows: list[dict[str, float]] = []
        for side in (at[at < self.z[k]][::-1], at[at >= self.z[k]]):
            z = self.z
            for value in side[(side >= low[k]) & (side <= high[k])]:
                z, cost = self.problem.refit(k, float(value), z)
                p = self.scale.p(z)
                rows.append({"value": float(p[k]), "rise": (cost - self.cost) / unit} | dict(zip(self.names, p)))
        return pd.DataFrame(rows).sort_values("value", ignore_index=True)

    def profile_interval(self, name: str, level: float = LEVEL, points: int = 25) -> tuple[float, float]:
        """Return the interval in which the profile stays below its threshold (F, or chi-square where the noise is
        known)."""
        from scipy.stats import chi2, f

        data = self.profile(name, points=points, reach=4.0)
        threshold = chi2.ppf(level, 1) if self.known_noise else f.ppf(level, 1, max(1, self.freedom))
        best = self.values[self._place(name)]
        ends = []
        for side in (data[data.value <= best][::-1], data[data.value >= best]):
            root = np.sqrt(np.maximum(side.rise.to_numpy(), 0.0))
            x = side.value.to_numpy()
            root, x = np.maximum.accumulate(np.concatenate([[0.0], root])), np.concatenate([[best], x])
            reached = root[-1] >= np.sqrt(threshold)
            ends.append(float(np.interp(np.sqrt(threshold), root, x)) if reached else float("nan"))
        return ends[0], ends[1]

    def report(self) -> str:
        """Return values, errors and correlations as Markdown."""
        from scipy.stats import chi2

        lines = ["| parameter | value | standard error | 95 % interval |", "|---|---|---|---|"]
        for name, row in self.table().iterrows():
            lines.append(
                f"| {name} | {row.value:.6g} | {row.error:.2g} ({100 * row.relative:.2g} %) | {row.low:.5g} "
                f"to {row.high:.5g} |"
            )
        lines += ["", f"{self.residuals.size} values, {self.freedom} degrees of freedom, {self.runs} evaluations."]
        lines += [*self._reservations(), *self.notes]
        if self.known_noise:
            lines.append(f"Chi-square over degrees of freedom: {self.chi_square:.3g}.")
            if self.freedom > 0 and chi2.sf(self.cost, self.freedom) < DOUBTFUL:
                lines.append(
                    "The residuals are larger than the noise that was given explains: the model does not describe all "
                    f"that was measured, and the errors above are too small, by a factor of {self.chi_square**0.5:.2g} "
                    "if what is missing acts like noise (absolute_sigma=False takes it so)."
                )
        else:
            lines.append(f"Standard deviation of the residuals: {np.sqrt(max(self.chi_square, 0.0)):.3g}.")
        close = [
            (abs(self.correlation[i, j]), i, j) for i in range(len(self.names)) for j in range(i)
            if abs(self.correlation[i, j]) > CORRELATED
        ]  # fmt: skip
        for size, i, j in sorted(close, reverse=True):
            lines.append(f"{self.names[j]} and {self.names[i]} are told apart badly: correlation {size:.3f}.")
        if len(self.waterfall) > 1:
            best = self.waterfall[0]
            again = sum(cost <= best * 1.01 + 1e-12 for cost in self.waterfall)
            lines.append(f"{again} of {len(self.waterfall)} searches ended at the best cost.")
        return "\n".join(lines) + "\n"

    def _reservations(self) -> list[str]:
        """Return what the standard errors do not know: bounds within reach, and simulations that failed."""
        lines = []
        low, high = self.scale.bounds()
        for k, name in enumerate(self.names):
            ends = self.interval(name)
            a, b = (float(self.scale.p(side)[k]) for side in (low, high))
            if ends[0] < a or ends[1] > b:
                lines.append(
                    f"The interval of {name} reaches beyond its bounds, {a:.5g} to {b:.5g}: its error and those of "
                    "others that depend on it do not hold there. Widen the bounds, or see the profile."
                )
        if self.problem is not None and self.problem.without:
            lines.append(
                f"{self.problem.without} of {self.runs} evaluations gave no values, and count as far away and without "
                "slope; beside the estimate that spoils its errors."
            )
        return lines


def errors_of(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return standard errors and correlations of (J'J)^-1 and the singular values of J.

    Columns are scaled first, so that units do not matter to what counts as rounding. Parameters that have a part in a
    direction without influence have infinite errors and the correlations of that direction; the others' are those they
    have without it.
    """
    size = np.linalg.norm(matrix, axis=0)
    size = np.where(size == 0.0, 1.0, size)
    # of many residuals the left vectors, as many as these, are not needed; of few all right ones are
    _, found, right = np.linalg.svd(matrix / size, full_matrices=len(matrix) < size.size)
    singular = np.zeros(size.size)
    singular[: found.size] = found
    known = singular > np.finfo(float).eps * max(matrix.shape) * singular[0]
    half = right[known].T / singular[known]
    covariance, lost = half @ half.T, right[~known].T
    lost[np.abs(lost) < PART_OF_LOST] = 0.0
    free = lost.any(axis=1)
    covariance[free, :] = covariance[:, free] = 0.0
    covariance += lost @ lost.T
    deviations = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(deviations, deviations)
    return np.where(free, np.inf, deviations / size), correlation, np.linalg.svd(matrix, compute_uv=False)
