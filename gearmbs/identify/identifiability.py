"""Which parameters measured numbers can tell, before anything is fitted.

With the Jacobian J of the predictions over their standard deviations, its singular values s_k and right singular
vectors v_k, the
combination v_k . z of the parameters (z = ln p) is known to 1 / s_k. What is larger than a limit is not determined; the
vector says which parameters only occur together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.identify.parameters import IdentifyError, errors_of

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.identify.parameters import Fit

LIMIT = 0.3
"""Standard deviation of a combination of logarithms from which it counts as undetermined: a third of the value."""

NOT_AT_ALL = 1e6
"""Standard deviation of a combination of logarithms that is rounding: columns alike but for differences by 1e-6."""

SHARE = 0.25
"""Smallest part of a direction that is named."""


@dataclass(frozen=True)
class Identifiability:
    """What measured numbers can tell of parameters.

    Attributes
    ----------
    names : list of str
    matrix : ndarray, shape (m, n)
        Derivatives of the predictions in z over their standard deviations.
    noise : ndarray, shape (n,)
        How far the norm of each column is uncertain from the noise of the simulation.
    limit : float
        Standard deviation from which a direction counts as undetermined.
    """

    names: list[str]
    matrix: np.ndarray
    noise: np.ndarray
    limit: float = LIMIT

    @property
    def singular_values(self) -> np.ndarray:
        """How many standard deviations the predictions move a unit along each direction, largest first."""
        return np.linalg.svd(self.matrix, compute_uv=False)

    @property
    def correlation(self) -> np.ndarray:
        """Correlations of the estimates."""
        return errors_of(self.matrix)[1]

    def table(self) -> pd.DataFrame:
        """Return influence, noise of the differences, standard deviations alone and together, and the worst partner."""
        import pandas as pd

        together, correlation, _ = errors_of(self.matrix)
        norm = np.linalg.norm(self.matrix, axis=0)
        partners, sizes = [], []
        c = np.abs(correlation) - np.eye(len(self.names))
        for k in range(len(self.names)):
            j = int(np.argmax(c[k]))
            partners.append(self.names[j] if len(self.names) > 1 else "")
            sizes.append(float(correlation[k, j]) if len(self.names) > 1 else 0.0)
        with np.errstate(all="ignore"):
            alone = np.where(norm > 0.0, 1.0 / norm, np.inf)
        return pd.DataFrame(
            {
                "influence": norm,
                "noise": self.noise,
                "alone": alone,
                "together": together,
                "partner": partners,
                "correlation": sizes,
            },
            index=pd.Index(self.names, name="parameter"),
        )

    def undetermined(self) -> list[tuple[float, dict[str, float]]]:
        """Return the directions that are not determined: their standard deviation and the parameters' parts in them."""
        _, singular, right = np.linalg.svd(self.matrix, full_matrices=True)
        singular = np.concatenate([singular, np.zeros(len(self.names) - singular.size)])
        found = []
        for s, v in zip(singular, right):
            deviation = float("inf") if s == 0.0 else 1.0 / s
            if deviation > self.limit:
                parts = {n: float(x) for n, x in zip(self.names, v) if abs(x) > SHARE}
                found.append((deviation, parts))
        return sorted(found, key=lambda item: -item[0])

    def remarks(self) -> list[str]:
        """Return in words what cannot be told."""
        lines = []
        for deviation, parts in self.undetermined():
            names = sorted(parts, key=lambda n: -abs(parts[n]))
            size = "not at all" if deviation > NOT_AT_ALL else f"to {100 * deviation:.0f} % only"
            if len(names) == 1:
                lines.append(f"{names[0]} has hardly any influence on what was measured: it is known {size}")
            else:
                powers = " * ".join(f"{n}^{parts[n]:.2g}" for n in names)
                lines.append(
                    f"{' and '.join(names)} can be told only as a combination: {powers} is known {size}; hold "
                    "all but one of them, or measure where they act differently"
                )
        for name, norm, noise in zip(self.names, np.linalg.norm(self.matrix, axis=0), self.noise):
            if noise > 0.3 * norm:
                lines.append(
                    f"{name}: its influence ({norm:.2g}) is hardly above the noise of the differences ({noise:.2g}); a "
                    "tighter tolerance or a larger step would tell more"
                )
        return lines

    def worth(self, others: Mapping[str, np.ndarray]) -> pd.DataFrame:
        """Rank further measurements by what they add.

        Parameters
        ----------
        others : mapping of str to ndarray, shape (k, n)
            Derivatives of what each would measure, over its standard deviations; see `CaseProblem.derivatives`.

        Returns
        -------
        DataFrame
            By measurement the smallest singular value with it, and the factor by which it grows; best first.
        """
        import pandas as pd

        before = self.singular_values[-1]
        rows = []
        for name, matrix in others.items():
            after = np.linalg.svd(np.vstack([self.matrix, matrix]), compute_uv=False)[-1]
            rows.append({"measurement": name, "smallest": after, "gain": after / before if before > 0.0 else np.inf})
        return pd.DataFrame(rows).sort_values("gain", ascending=False, ignore_index=True)


# A posterior by sampling, on a quadratic surrogate of the predictions.
#
# Simulations are too slow for the tens of thousands of evaluations a sampler wants. About the optimum the logarithms of
# the
# predictions are close to a quadratic in z, fitted to a central composite design over a few standard errors; how close,
# is said
# by its error at points that were not used. The sampler is the affine-invariant stretch move (J. Goodman, J. Weare,
# Comm. App. Math. Comp. Sci. 5 (2010) 65), which asks for no tuning.


STRETCH = 2.0
"""Largest stretch a of a move, whose density is 1/sqrt(g) between 1/a and a: the value of J. Goodman, J. Weare,
"Ensemble samplers with affine invariance", Comm. Appl. Math. Comput. Sci. 5 (2010) 65-80."""


@dataclass(frozen=True)
class Surrogate:
    """A quadratic of residuals over x = (z - z0) / scale.

    Attributes
    ----------
    centre, scale : ndarray, shape (n,)
    terms : ndarray, shape (t, m)
        Coefficients of 1, x_i and x_i x_j.
    error : float
        RMS error at the points left for the test, in standard deviations of the noise.
    """

    centre: np.ndarray
    scale: np.ndarray
    terms: np.ndarray
    error: float

    def residuals(self, z: np.ndarray) -> np.ndarray:
        """Return the residuals at z, shape (..., n)."""
        return monomials((z - self.centre) / self.scale) @ self.terms


def monomials(x: np.ndarray) -> np.ndarray:
    """Return 1, x_i and x_i x_j of points x, shape (..., n), along the last axis."""
    n = x.shape[-1]
    rows, columns = np.triu_indices(n)
    return np.concatenate([np.ones((*x.shape[:-1], 1)), x, x[..., rows] * x[..., columns]], axis=-1)


def make_surrogate(fit: Fit, *, reach: float = 3.0, tests: int = 4, seed: int = 0) -> Surrogate:
    """Fit a quadratic to the residuals over ``reach`` standard errors about the optimum.

    The points are a central composite along the principal axes of the covariance, so that they stay where the data are
    fitted even if parameters are strongly correlated.
    """
    problem, n = fit.problem, len(fit.z)
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * n)).reshape(n, -1).T
    axial = np.concatenate([np.eye(n), -np.eye(n)]) * np.sqrt(n)
    random = np.random.default_rng(seed).uniform(-1.0, 1.0, (tests, n))
    x = np.vstack([np.zeros(n), corners, axial, random]) * reach / np.sqrt(n)
    half = np.linalg.cholesky(fit.correlation + 1e-12 * np.eye(n)) * fit.z_errors[:, None]
    low, high = problem.scale.bounds()
    points = np.clip(fit.z + x @ half.T, low, high)
    values = np.array(problem.residuals(list(points)))
    u = (points - fit.z) / fit.z_errors
    used = len(points) - tests
    terms = np.linalg.lstsq(monomials(u[:used]), values[:used], rcond=1e-10)[0]
    error = float(np.sqrt(np.mean((monomials(u[used:]) @ terms - values[used:]) ** 2)))
    return Surrogate(fit.z, fit.z_errors, terms, error)


def posterior(fit: Fit, *, draws: int = 4000, reach: float = 3.0, seed: int = 0) -> pd.DataFrame:
    """Sample the posterior of a fit's parameters, flat in z between the bounds, on a surrogate.

    Returns
    -------
    DataFrame
        A draw a row, in the parameters; ``attrs`` holds the surrogate's error in standard deviations of the noise
        (``surrogate_error``: trust the draws if it is well below 1) and the share of accepted moves.

    Raises
    ------
    IdentifyError
        If the data do not determine a parameter: about it there is no posterior but its bounds.
    """
    import pandas as pd

    low, high = fit.problem.scale.bounds()
    lost = [name for name, error, wide in zip(fit.names, fit.z_errors, high - low) if not error < min(wide, NOT_AT_ALL)]
    if lost:
        raise IdentifyError(
            f"posterior: {', '.join(lost)}: not determined by the data, a standard error is wider than the bounds; "
            "hold all but one of those that act alike, or measure where they act differently"
        )
    surrogate = make_surrogate(fit, reach=reach, seed=seed)
    unit = 1.0 if fit.known_noise else fit.cost / max(1, fit.freedom)

    def log_density(z: np.ndarray) -> np.ndarray:
        r = surrogate.residuals(z)
        inside = ((z >= low) & (z <= high)).all(axis=-1)
        return np.where(inside, -0.5 * (r**2).sum(axis=-1) / unit, -np.inf)

    start = fit.z + 0.5 * fit.z_errors * np.random.default_rng(seed).standard_normal(
        (max(16, 4 * len(fit.z)), len(fit.z))
    )
    chain, accepted = stretch(log_density, np.clip(start, low, high), draws, seed)
    table = pd.DataFrame([fit.scale.p(z) for z in chain], columns=fit.names)
    table.attrs = {"surrogate_error": surrogate.error, "accepted": accepted}
    return table


def stretch(
    log_density: Callable[[np.ndarray], np.ndarray], walkers: np.ndarray, draws: int, seed: int
) -> tuple[np.ndarray, float]:
    """Return draws of a density by the stretch move, after as many that are thrown away, and the share of accepted
    moves.

    Parameters
    ----------
    log_density : callable
        Of points, shape (k, n), the logarithm of the density, shape (k,).
    walkers : ndarray, shape (k, n)
        Where they begin; an even number of them.
    """
    generator = np.random.default_rng([seed, 1])
    walkers = walkers[: len(walkers) // 2 * 2].copy()
    count, n = walkers.shape
    half = count // 2
    now = log_density(walkers)
    sweeps = -(-2 * draws // count)
    kept: list[np.ndarray] = []
    accepted = 0
    for sweep in range(sweeps):
        for mine, theirs in ((slice(0, half), slice(half, count)), (slice(half, count), slice(0, half))):
            g = (generator.random(half) * (np.sqrt(STRETCH) - 1.0 / np.sqrt(STRETCH)) + 1.0 / np.sqrt(STRETCH)) ** 2
            partners = walkers[theirs][generator.integers(half, size=half)]
            trial = partners + g[:, None] * (walkers[mine] - partners)
            value = log_density(trial)
            good = np.log(generator.random(half)) < (n - 1) * np.log(g) + value - now[mine]
            walkers[mine] = np.where(good[:, None], trial, walkers[mine])
            now[mine] = np.where(good, value, now[mine])
            accepted += int(good.sum())
        if sweep >= sweeps // 2:
            kept.append(walkers.copy())
    return np.concatenate(kept)[-draws:], accepted / (sweeps * count)
