"""Response surfaces: a quadratic of the factors, with its error where it was not fitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.results import factor_names
from gearmbs.campaigns.sensitivity import coordinates, results_in_order
from gearmbs.campaigns.settings import whole

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    from matplotlib.figure import Figure

    from gearmbs.campaigns.campaign import Campaign


@dataclass(frozen=True)
class ResponseSurface:
    """A polynomial of degree one or two in the coded factors x = 2 u - 1, from -1 to 1.

    Attributes
    ----------
    names : list of str
    degree : int
    coefficients : ndarray
    standard_errors : ndarray
    r_squared : float
        Part of the variance it explains of the points it was fitted to.
    q_squared : float
        The same for each point by the surface fitted to all others: what it is worth elsewhere.
    error : float
        RMS of those left-out errors, in the unit of the result.
    count : int
        Points.
    """

    names: list[str]
    degree: int
    coefficients: np.ndarray
    standard_errors: np.ndarray
    r_squared: float
    q_squared: float
    error: float
    count: int

    def terms(self) -> list[str]:
        """Return the names of the terms."""
        pairs = np.triu_indices(len(self.names)) if self.degree == 2 else ((), ())
        squares = [
            f"{self.names[i]}^2" if i == j else f"{self.names[i]} x {self.names[j]}" for i, j in zip(pairs[0], pairs[1])
        ]
        return ["1", *self.names, *squares]

    def table(self) -> pd.DataFrame:
        """Return coefficients and standard errors by term."""
        import pandas as pd

        data = {"coefficient": self.coefficients, "standard_error": self.standard_errors}
        return pd.DataFrame(data, index=pd.Index(self.terms(), name="term"))

    def predict(self, u: np.ndarray) -> np.ndarray:
        """Return the surface at points of the unit cube, shape (n, d)."""
        return design_matrix(2.0 * np.atleast_2d(u) - 1.0, self.degree) @ self.coefficients


def design_matrix(x: np.ndarray, degree: int) -> np.ndarray:
    """Return the columns of the terms 1, x_i and, of degree two, x_i x_j."""
    columns = [np.ones(len(x)), *x.T]
    if degree == 2:
        rows, others = np.triu_indices(x.shape[1])
        columns += list((x[:, rows] * x[:, others]).T)
    return np.array(columns).T


def fit_surface(
    u: np.ndarray, values: Sequence[float] | np.ndarray, names: list[str], degree: int = 2
) -> ResponseSurface:
    """Fit a response surface by least squares.

    Parameters
    ----------
    u : ndarray, shape (n, d)
        Points in the unit cube.
    values : array_like, shape (n,)
        NaN are left out.
    names : list of str
    degree : {1, 2}

    Raises
    ------
    CampaignError
        If the points do not determine the coefficients.
    """
    if degree not in (1, 2):
        raise CampaignError(f"response surface: degree = {degree!r}; give 1 or 2, or fit_chaos for more")
    y = np.asarray(values, dtype=float)
    good = np.isfinite(y)
    x, y = design_matrix(2.0 * u[good] - 1.0, degree), y[good]
    n, t = x.shape
    if n < t or np.linalg.matrix_rank(x) < t:
        raise CampaignError(
            f"response surface: {n} points do not determine {t} coefficients; take a central composite, "
            f"more points of a "
            "sequence, or degree=1"
        )
    inverse = np.linalg.inv(x.T @ x)
    coefficients = inverse @ (x.T @ y)
    rest = y - x @ coefficients
    leverage = np.einsum("ij,jk,ik->i", x, inverse, x)
    with np.errstate(all="ignore"):
        out = np.where(leverage < 1.0 - 1e-9, rest / (1.0 - leverage), np.nan)
    spread = float(np.sum((y - y.mean()) ** 2))
    noise = float(rest @ rest) / (n - t) if n > t else np.nan
    return ResponseSurface(
        names,
        degree,
        coefficients,
        np.sqrt(np.diag(inverse) * noise),
        1.0 - float(rest @ rest) / spread if spread else 1.0,
        1.0 - float(np.sum(out**2)) / spread if spread else 1.0,
        float(np.sqrt(np.mean(out**2))),
        n,
    )


def response_surface(campaign: Campaign, result: str, degree: int = 2) -> ResponseSurface:
    """Return the response surface of a campaign's result over the coordinates of its plan."""
    if campaign.plan.variants > 1:
        raise CampaignError("response surface: not of crossed choices; fit each option's cases by fit_surface")
    names, points = coordinates(campaign)
    values = results_in_order(campaign, result)
    if len(values) != len(points):
        raise CampaignError(
            "response surface: constraints have left points out; fit the table's columns by fit_surface"
        )
    return fit_surface(points, values, names, degree)


def condition_map(
    campaign: Campaign, condition: str, across: str, along: str, bins: int = 8
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return over two factors in which part of the cases a condition holds.

    Parameters
    ----------
    condition : str
        A comparison of columns of the table, as a constraint is written; a column's name may hold what no name in an
        expression does, then write it with underscores: ``orders_line_of_action_2 > 10``.
    across, along : str
        Columns of the horizontal and the vertical axis.
    bins : int
        Of equal numbers of cases along each.

    Returns
    -------
    share, counts : ndarray, shape (bins, bins)
        Part of the cases and how many there are, rows along the vertical axis.
    edges_across, edges_along : ndarray, shape (bins + 1,)
    """
    from gearmbs.campaigns.constraints import satisfied

    table = campaign.table
    table = table[table["status"] == "done"]
    columns = {str(name): table[name].to_numpy() for name in table.columns}
    columns |= {str(name).replace(".", "_").replace(" ", "_"): table[name].to_numpy() for name in table.columns}
    held = satisfied(condition, columns)
    bins = whole(bins, "bins", 1)
    for name in (across, along):
        if name not in table.columns or table[name].dtype.kind not in "biuf":
            known = ", ".join(str(n) for n in factor_names(campaign.folder) if table[n].dtype.kind in "biuf")
            raise CampaignError(f"map: {name!r} is no column of numbers; factors that are one: {known}")
    x, y = (table[name].to_numpy(dtype=float) for name in (across, along))
    edges_x, edges_y = (np.quantile(v, np.linspace(0.0, 1.0, bins + 1)) for v in (x, y))
    i = np.clip(np.searchsorted(edges_y, y, side="right") - 1, 0, bins - 1)
    j = np.clip(np.searchsorted(edges_x, x, side="right") - 1, 0, bins - 1)
    counts, hits = np.zeros((bins, bins)), np.zeros((bins, bins))
    np.add.at(counts, (i, j), 1.0)
    np.add.at(hits, (i, j), held.astype(float))
    with np.errstate(all="ignore"):
        return hits / counts, counts, edges_x, edges_y


def condition_figure(campaign: Campaign, condition: str, across: str, along: str, bins: int = 8) -> Figure:
    """Draw a `condition_map`: in which part of the cases a condition holds, over two factors."""
    from gearmbs.view.figure_style import new_figure

    share, counts, edges_x, edges_y = condition_map(campaign, condition, across, along, bins)
    figure = new_figure(5.6, 4.2)
    ax = figure.subplots()
    mesh = ax.pcolormesh(edges_x, edges_y, share, vmin=0.0, vmax=1.0)
    figure.colorbar(mesh, ax=ax, label="part of the cases")
    ax.set_xlabel(across)
    ax.set_ylabel(along)
    ax.set_title(
        f"{condition}: {np.nansum(share * counts) / counts.sum():.0%} of {counts.sum():.0f} cases", fontsize=10
    )
    logarithmic = {f.name for f in campaign.plan.factors if getattr(f, "scale", "") == "log"}
    if across in logarithmic:
        ax.set_xscale("log")
    if along in logarithmic:
        ax.set_yscale("log")
    return figure
