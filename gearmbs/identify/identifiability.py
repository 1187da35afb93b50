"""Which parameters measured numbers can tell, before anything is fitted.

With the Jacobian J of the predictions over their standard deviations, its singular values s_k and right singular
vectors v_k, the
combination v_k . z of the parameters (z = ln p) is known to 1 / s_k. What is larger than a limit is not determined; the
vector says which parameters only occur together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.identify.result import covariance_of

if TYPE_CHECKING:
    import pandas as pd

LIMIT = 0.3
"""Standard deviation of a combination of logarithms from which it counts as undetermined: a third of the value."""

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
        covariance, _ = covariance_of(self.matrix)
        error = np.sqrt(np.diag(covariance))
        with np.errstate(all="ignore"):
            return covariance / np.outer(error, error)

    def table(self) -> pd.DataFrame:
        """Return influence, noise of the differences, standard deviations alone and together, and the worst partner."""
        import pandas as pd

        covariance, _ = covariance_of(self.matrix)
        norm = np.linalg.norm(self.matrix, axis=0)
        partners, sizes = [], []
        c = np.abs(self.correlation) - np.eye(len(self.names))
        for k in range(len(self.names)):
            j = int(np.argmax(c[k]))
            partners.append(self.names[j] if len(self.names) > 1 else "")
            sizes.append(float(self.correlation[k, j]) if len(self.names) > 1 else 0.0)
        with np.errstate(all="ignore"):
            alone = np.where(norm > 0.0, 1.0 / norm, np.inf)
        return pd.DataFrame(
            {
                "influence": norm,
                "noise": self.noise,
                "alone": alone,
                "together": np.sqrt(np.diag(covariance)),
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
            size = "not at all" if deviation > 1e6 else f"to {100 * deviation:.0f} % only"
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
