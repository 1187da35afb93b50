"""Which row of a campaign's table is in which split."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.plans.factors import Choice
from gearmbs.campaigns.settings import CampaignError, CampaignWarning
from gearmbs.units import to_si

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.campaigns.plans.plan import Plan

TRAIN = "train"


def split_of_rows(
    plan: Plan, table: pd.DataFrame, split: Sequence[str] | np.ndarray | None, split_by: str | None, test: float
) -> np.ndarray:
    """Return the split of each row: as given, or all rows of equal value in a column in the same one.

    Rows that are not done are in no split, and their values not among those that are dealt out.

    Raises
    ------
    CampaignError
        If it is not a name for each row, or there is no such column.
    """
    import pandas as pd

    from gearmbs.campaigns.datasets.splits import split_by_group

    if split is not None:
        names = np.asarray(split)
        if names.shape != (len(table),):
            raise CampaignError(f"split: shape {names.shape}; give the name of each of the {len(table)} rows' split")
        odd = [
            name for name in dict.fromkeys(names.tolist()) if not (isinstance(name, str) and re.fullmatch(r"\w+", name))
        ]
        if odd:
            raise CampaignError(
                f"split: {odd[0]!r} is no name of a split; write letters and numbers, as train and test"
            )
        return names
    found = np.full(len(table), TRAIN, dtype=object)
    if split_by is None:
        return found
    if split_by not in table.columns:
        raise CampaignError(f"split by {split_by!r}: the table has no such column; it has {', '.join(table.columns)}")
    done = (table["status"] == "done").to_numpy()
    groups = pd.factorize(table[split_by][done], sort=True)[0]
    found[done] = split_by_group(groups, test=test, validation=0.0, seed=plan.seed)
    return found


def held_out_of_training(
    plan: Plan, table: pd.DataFrame, ranges: Mapping[str, Sequence[Any]], split: np.ndarray
) -> np.ndarray:
    """Return the split with training rows of some ranges of columns withheld.

    Raises
    ------
    CampaignError
        For what is no column of numbers, and no range; if nothing is left to train on.

    Warns
    -----
    CampaignWarning
        If a range takes no row, or all rows of an option.
    """
    from gearmbs.campaigns.datasets.splits import withhold

    if not isinstance(ranges, Mapping):
        raise CampaignError(f"held out: {ranges!r}; give a range by column, as {{'severity': (0.45, 0.6)}}")
    done = (table["status"] == "done").to_numpy()
    found = split
    for column, ends in ranges.items():
        if column not in table.columns or table[column].dtype.kind not in "biuf":
            raise CampaignError(f"held out: {column!r} is no column of numbers")
        low, high = _ends(column, ends, plan.unit_of(column))
        before = found
        found = withhold(found, sizes(plan, table, column), low, high)
        if not (done & (found != before)).any():
            told = f"held out: {column} = {ends!r}: no row to train on lies in it"
            warnings.warn(told, CampaignWarning, stacklevel=4)
    if not (done & (found == TRAIN)).any():
        raise CampaignError(f"held out: {dict(ranges)!r} leaves nothing to train on; give narrower ranges")
    for choice in (factor for factor in plan.factors if isinstance(factor, Choice)):
        options = table[choice.name].to_numpy()
        left = {name: set(options[done & (rows == TRAIN)]) for name, rows in (("before", split), ("now", found))}
        for option in sorted(left["before"] - left["now"]):
            told = f"held out: {dict(ranges)!r} leaves no row of {choice.name} = {option!r} to train on"
            warnings.warn(f"{told}; give narrower ranges unless that is meant", CampaignWarning, stacklevel=4)
    return found


def sizes(plan: Plan, table: pd.DataFrame, column: str) -> np.ndarray:
    """Return a column as numbers; of severities NaN for options that have none, which stand as 0 in the table."""
    values = table[column].to_numpy(dtype=float)
    for choice in (factor for factor in plan.factors if isinstance(factor, Choice)):
        if choice.severity == column:
            return np.where(np.isin(table[choice.name].to_numpy(dtype=str), choice.sized), values, np.nan)
    return values


def _ends(column: str, ends: Any, unit: str) -> tuple[float, float]:
    """Return both ends of a range in SI."""
    try:
        low, high = (float(to_si(end, "dimensionless" if unit in ("", "1") else unit, column)) for end in ends)
    except (TypeError, ValueError) as error:
        raise CampaignError(f"held out: {column} = {ends!r}; give its lower and upper end ({error})") from None
    if not low <= high:
        raise CampaignError(f"held out: {column} = {ends!r}; give its lower and upper end, in this order")
    return low, high
