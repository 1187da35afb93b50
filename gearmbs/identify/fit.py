"""Least squares of any model, with what one must know of the answer: errors, correlations, residuals, profiles.

In terms of the weighted residuals r = (f(p) - y) / sigma and their Jacobian J the estimate minimises r.r, its
covariance is (J'J)^-1, times s^2 = r.r / (m - n) where the noise is not known (G. A. F. Seber, C. J. Wild, Nonlinear
Regression, Wiley, 1989, chapters 2 and 5).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from gearmbs.identify.parameters import Fit, Free, IdentifyError, NoValues, Scale
from gearmbs.progress import staged

# Derivatives of a noisy simulation by central differences, with a step that fits its noise, and what noise is left
# in them.
#
# A default step of a general-purpose optimiser, 1e-8 of the parameter, drowns in the integrator's local errors.
# Measured on mesh
# harmonics: at a tolerance of 1e-8 a step of 1e-2 in ln p is right to a few percent, and so are half of it and twice
# it.


SIMULATION_STEP = 1e-2
"""Step in ln p, or part of the parameter, for simulations."""

SMOOTH_STEP = float(np.finfo(float).eps) ** (1.0 / 3.0)
"""The same for functions exact to rounding: balances rounding against the third derivative."""

Many = Callable[[Sequence[np.ndarray]], list[np.ndarray]]


def steps(z: np.ndarray, logs: np.ndarray, step: float) -> np.ndarray:
    """Return the step of each coordinate: absolute for logarithms, else a part of its magnitude."""
    size = np.where(logs, 1.0, np.where(z == 0.0, 1.0, np.abs(z)))
    return step * size


def central(
    many: Many, z: np.ndarray, h: np.ndarray, low: np.ndarray | None = None, high: np.ndarray | None = None
) -> np.ndarray:
    """Return the matrix of central differences, shape (m, n); at a bound the points are moved inside.

    Parameters
    ----------
    many : callable
        Values of the function, each of shape (m,), for several points at once, so that they may be computed side by
        side.
    z, h : ndarray, shape (n,)
        Point and steps.
    low, high : ndarray, optional
        Bounds.
    """
    points, widths = [], []
    for k, width in enumerate(h):
        up, down = z.copy(), z.copy()
        up[k] = z[k] + width if high is None else min(z[k] + width, high[k])
        down[k] = z[k] - width if low is None else max(z[k] - width, low[k])
        points += [up, down]
        widths.append(up[k] - down[k])
    values = many(points)
    return np.array([(values[2 * k] - values[2 * k + 1]) / widths[k] for k in range(len(h))]).T


def noise_of_columns(many: Many, z: np.ndarray, h: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return how far the norm of each column is uncertain: its difference from that at half the step.

    Parameters
    ----------
    matrix : ndarray, shape (m, n)
        Differences at the step h.
    """
    half = central(many, z, 0.5 * h)
    return np.linalg.norm(matrix - half, axis=0)


Model = Callable[[np.ndarray], np.ndarray]
Progress = Callable[[float, str], None]
USUAL_STEPS = 10
"""Steps that a search usually takes, each with a Jacobian by central differences."""
LOSSES = ("linear", "soft_l1", "huber", "cauchy")
POLISH = 50
"""Gauss-Newton steps at most after the search."""
PROFILED = 1e-8
"""Least tolerance at which searches of a profile end: its thresholds are read to a thousandth."""


class FitKeywords(TypedDict, total=False):
    """How a model is fitted: keywords of `fit` but for the scatter of what is measured, for type checkers."""

    absolute_sigma: bool
    step: float
    starts: int
    loss: str
    tolerance: float
    most_runs: int
    seed: int
    progress: Progress | None


@staged("fitting")
def fit(
    model: Model,
    measured: ArrayLike,
    free: Sequence[Free],
    *,
    sigma: ArrayLike | None = None,
    absolute_sigma: bool = True,
    many: Callable[[Sequence[np.ndarray]], list[np.ndarray]] | None = None,
    jacobian: Callable[[np.ndarray], np.ndarray | None] | None = None,
    step: float = SMOOTH_STEP,
    starts: int = 1,
    loss: str = "linear",
    tolerance: float = 1e-12,
    most_runs: int = 2000,
    seed: int = 0,
    lost: int = 0,
    progress: Progress | None = None,
) -> Fit:
    """Find the parameters of a model that fit measured values best.

    Parameters
    ----------
    model : callable
        ``model(p)`` returns the prediction, shape (m,), for parameters p in the order of ``free``.
    measured : array_like, shape (m,)
    free : sequence of Free
    sigma : float or array_like, optional
        Standard deviation of the measured values. Without it all weigh the same and the noise is estimated.
    absolute_sigma : bool
        Whether ``sigma`` is the noise itself, or known up to a common factor only, which is then estimated from the
        residuals: for a model that does not describe everything measured.
    many : callable, optional
        Predictions for several parameter vectors at once; default one after the other.
    jacobian : callable, optional
        ``jacobian(p)`` returns the derivatives of the prediction by the parameters, shape (m, n), or None where there
        are none; default central differences.
    step : float
        Of the differences, in ln p or as a part of p; `gearmbs.identify.fit.SIMULATION_STEP` for simulations.
    starts : int
        Searches: the first from ``start``, further ones from a Sobol' sequence between the bounds.
    loss : {"linear", "soft_l1", "huber", "cauchy"}
        Robust against outliers if not linear; standard errors are those of the weighted problem then.
    tolerance : float
        Relative change of cost and parameters at which a search ends; above the noise of the model.
    most_runs : int
        Evaluations of the model in one search.
    seed : int
        Of the starts.
    lost : int
        Degrees of freedom that the model itself has used up, as by gains it fits.
    progress : callable, optional
        Called as progress(fraction, stage), the fraction of as many evaluations as searches usually take; without it a
        bar is shown where somebody watches, see `gearmbs.progress`.

    Returns
    -------
    Fit

    Raises
    ------
    IdentifyError
        If there are fewer values than parameters, or the model fails at every start.

    Examples
    --------
    >>> x = np.linspace(0.0, 1.0, 20)
    >>> free = [Free("a", 1.0), Free("b", -1.0, log=False)]
    >>> found = fit(lambda p: p[0] * np.exp(p[1] * x), 2.0 * np.exp(-0.5 * x), free)
    >>> found.values.round(6).tolist()
    [2.0, -0.5]
    """
    if loss not in LOSSES:
        raise IdentifyError(f"fit: loss is {loss!r}; choose one of {', '.join(LOSSES)}")
    if not (isinstance(starts, int) and starts >= 1):
        raise IdentifyError(f"fit: starts = {starts!r}; give a whole number, 1 or more")
    problem = _Problem(model, measured, free, sigma, many, step, lost, absolute_sigma, jacobian)
    problem.end = max(tolerance, PROFILED)
    if progress is not None:
        each = 1 if jacobian is not None else 2 * len(free) + 1
        problem.tell = progress_of_runs(progress, starts * USUAL_STEPS * each)
    low, high = problem.scale.bounds()
    attempts = []
    for z0 in _starts(problem.scale, low, high, starts, seed):
        problem.runs = 0
        found = _search(problem, z0, low, high, loss, tolerance, most_runs)
        if found is not None:
            attempts.append(found)
    if not attempts:
        raise NoValues("fit: the model gives no finite values at any of the starts; give others, or narrower bounds")
    attempts.sort(key=lambda a: a[1])
    z = attempts[0][0]
    if loss == "linear":
        z = _polished(problem, z, low, high, tolerance)
    best = problem.result(z, waterfall=[cost for _, cost in attempts], runs=problem.total)
    return replace(best, loss=loss)


def progress_of_runs(progress: Progress, usual: int) -> Callable[[int], None]:
    """Return what tells how many evaluations are done, as a part of a usual number and never all of them."""
    return lambda done: progress(min(done / usual, 0.99), f"{done} evaluations")


def _real(values: ArrayLike) -> np.ndarray:
    """Return what a model gave as real numbers."""
    if np.iscomplexobj(values):
        raise IdentifyError("fit: the model returned complex values; return real and imaginary parts side by side")
    return np.asarray(values, dtype=float)


class _Problem:
    """Weighted residuals of a model over z."""

    def __init__(self, model, measured, free, sigma, many, step, lost, absolute_sigma, jacobian) -> None:
        self.scale = Scale(tuple(free))
        names = self.scale.names
        if len(set(names)) < len(names):
            raise IdentifyError(f"fit: free has a name twice: {', '.join(names)}; give each its own")
        if np.iscomplexobj(measured):
            raise IdentifyError(
                "fit: measured is complex; give real and imaginary parts side by side, as the model does"
            )
        self.measured = np.asarray(measured, dtype=float)
        if self.measured.ndim != 1:
            raise IdentifyError(
                f"fit: measured has shape {self.measured.shape}; give it and the model flat, by ravel()"
            )
        size, count = self.measured.size, len(self.scale.free)
        if not np.isfinite(self.measured).all():
            raise IdentifyError("fit: every measured value must be finite")
        if count == 0:
            raise IdentifyError("fit: free is empty; give a parameter")
        if size - lost < count:
            raise IdentifyError(
                f"fit: {size - lost} independent values for {count} parameters; measure more or free fewer"
            )
        self.known = sigma is not None and absolute_sigma
        given = np.asarray(1.0 if sigma is None else sigma, dtype=float)
        if given.shape not in ((), (1,), (size,)):
            raise IdentifyError(f"fit: sigma has shape {given.shape} for {size} measured values; give one, or one each")
        self.sigma = np.broadcast_to(given, (size,))
        if not ((self.sigma > 0.0) & (self.sigma < np.inf)).all():
            raise IdentifyError("fit: every sigma must be positive and finite; leave out values that say nothing")
        self._many = many or (lambda points: [_real(model(p)) for p in points])
        self.step, self.lost, self._own = step, lost, jacobian
        self.end = PROFILED
        self.runs = self.total = self.without = 0
        self.tell: Callable[[int], None] = lambda done: None

    def residuals(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the residuals at several z."""
        self.runs += len(points)
        self.total += len(points)
        with np.errstate(all="ignore"):
            found = self._many([self.scale.p(np.asarray(z)) for z in points])
        self.tell(self.total)
        self.without += sum(not np.isfinite(f).all() for f in found)
        for f in found:
            if np.shape(f) != self.measured.shape:
                raise IdentifyError(f"fit: the model returned shape {np.shape(f)} for {self.measured.shape} values")
        return [(np.asarray(f, dtype=float) - self.measured) / self.sigma for f in found]

    def residual(self, z: np.ndarray) -> np.ndarray:
        """Return the residuals at z, large where the model has no value."""
        r = self.residuals([z])[0]
        return np.where(np.isfinite(r), r, 1e10)

    def jacobian(self, z: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return their derivatives, the model's own or central differences."""
        p = self.scale.p(z)
        own = None if self._own is None else self._own(p)
        if own is not None:
            if np.shape(own) != (self.measured.size, z.size):
                raise IdentifyError(
                    f"fit: jacobian returned shape {np.shape(own)} for {self.measured.size} values and {z.size} "
                    "parameters; give the derivative of each value by each parameter"
                )
            slopes = np.asarray(own, dtype=float) / self.sigma[:, None] * np.where(self.scale.logs, p, 1.0)
            return np.where(np.isfinite(slopes), slopes, 0.0)
        matrix = central(self.residuals, z, steps(z, self.scale.logs, self.step), low, high)
        return np.where(np.isfinite(matrix), matrix, 0.0)

    def result(self, z: np.ndarray, waterfall: list[float], runs: int) -> Fit:
        low, high = self.scale.bounds()
        r, matrix = self.residual(z), self.jacobian(z, low, high)
        return Fit.of(self, z, r, matrix, waterfall=waterfall, runs=runs)

    def refit(self, fixed: int, value: float, z: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the other parameters' best z and the cost r.r with one held at a value."""
        from scipy.optimize import least_squares

        tolerance = self.end
        low, high = self.scale.bounds()
        others = [k for k in range(len(z)) if k != fixed]

        def whole(part: np.ndarray) -> np.ndarray:
            full = z.copy()
            full[fixed] = value
            full[others] = part
            return full

        if not others:
            r = self.residual(whole(np.empty(0)))
            return whole(np.empty(0)), float(r @ r)
        found = least_squares(
            lambda part: self.residual(whole(part)),
            np.clip(z[others], low[others], high[others]),
            jac=lambda part: self.jacobian(whole(part), low, high)[:, others],
            bounds=(low[others], high[others]),
            x_scale="jac",
            ftol=tolerance,
            xtol=tolerance,
            gtol=None if tolerance > 1e-6 else 1e-15,
            max_nfev=100,
        )
        return whole(found.x), 2.0 * float(found.cost)


def _starts(scale: Scale, low: np.ndarray, high: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """Return the given start and further ones of a Sobol' sequence between the bounds."""
    from scipy.stats import qmc

    first = scale.z([f.start for f in scale.free])
    if count <= 1:
        return [first]
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise IdentifyError("fit: several starts need bounds, low and high, of every parameter")
    exponent = int(np.ceil(np.log2(count)))
    points = qmc.Sobol(len(first), rng=np.random.default_rng(seed)).random_base2(exponent)[: count - 1]
    return [first, *(low + points * (high - low))]


def _search(problem: _Problem, z0, low, high, loss, tolerance, most_runs) -> tuple[np.ndarray, float] | None:
    """Return where the searches from one start end, the better of two methods where both apply."""
    from scipy.optimize import least_squares

    if not np.isfinite(problem.residuals([z0])[0]).all():
        return None
    free = not (np.isfinite(low).any() or np.isfinite(high).any())
    n = len(z0)
    best: tuple[np.ndarray, float] | None = None
    settings: dict[str, Any] = {"x_scale": "jac", "ftol": tolerance, "xtol": tolerance, "gtol": 1e-15}
    if tolerance > 1e-6:
        settings["gtol"] = None
    for method in ("lm", "trf") if free and loss == "linear" else ("trf",):
        most = max(10, most_runs // (2 * n + 1))
        try:
            found = least_squares(
                problem.residual,
                z0,
                jac=lambda z: problem.jacobian(z, low, high),
                method=method,  # type: ignore[arg-type]
                max_nfev=most,
                **({"bounds": (low, high), "loss": loss} if method == "trf" else {}),
                **settings,
            )
        except IdentifyError:
            raise
        except (ValueError, np.linalg.LinAlgError):
            continue
        if best is None or found.cost < best[1] * (1.0 - 1e-10):
            best = found.x, float(found.cost)
    return best


def _polished(problem: _Problem, z: np.ndarray, low, high, tolerance: float) -> np.ndarray:
    """Return z after Gauss-Newton steps, as long as they lower the cost: the last digits, which a trust region
    leaves."""
    if tolerance > 1e-9:
        return z
    r = problem.residual(z)
    for _ in range(POLISH):
        matrix = problem.jacobian(z, low, high)
        size = np.linalg.norm(matrix, axis=0)
        size[size == 0.0] = 1.0
        move = np.linalg.lstsq(matrix / size, -r, rcond=1e-14)[0] / size
        trial = np.clip(z + move, low, high)
        after = problem.residual(trial)
        if not after @ after < r @ r:
            break
        z, r = trial, after
    return z
