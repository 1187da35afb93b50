"""Tables of measured harmonics, and fields of cases as parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.identify.parameters import Free, IdentifyError, Scale
from gearmbs.units import to_si

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.studies import Case

COLUMNS = ("case", "channel", "harmonic", "value", "sigma")
"""Columns of a table of harmonics: which case, channel or component, harmonic, RMS, relative standard deviation."""


def groups_of(table: pd.DataFrame, gains: str) -> np.ndarray | None:
    """Return which free gain each row has."""
    keys = {
        "none": None,
        "one": [],
        "channel": ["channel"],
        "case": ["case", "channel"],
        "line": ["channel", "harmonic"],
    }
    if gains not in keys:
        raise IdentifyError(f"gains is {gains!r}; choose one of {', '.join(keys)}")
    columns = keys[gains]
    if columns is None:
        return None
    rows = list(zip(*(table[c] for c in columns))) if columns else [()] * len(table)
    places = {row: k for k, row in enumerate(dict.fromkeys(rows))}
    return np.array([places[row] for row in rows])


def in_si(item: Free | str, cases: Mapping[str, Case]) -> Free:
    """Return a parameter with its start and bounds in SI; a path starts at its case's value."""
    path = item if isinstance(item, str) else item.name
    value, unit = field_of(path, cases)
    if isinstance(item, str):
        return Free(path, value, log=value > 0.0)
    for other in item.also:
        field_of(other, cases)

    def number(given: Any) -> Any:
        try:
            return None if given is None else to_si(given, unit, path)
        except (ValueError, TypeError) as error:
            raise IdentifyError(str(error)) from None

    found = replace(item, start=number(item.start), low=number(item.low), high=number(item.high))
    # refused here rather than after the simulations that come first
    Scale((found,)).bounds()
    return found


def field_of(path: str, cases: Mapping[str, Case]) -> tuple[float, str]:
    """Return the value and the SI unit of a number of a case, whose name may stand before the path."""
    from gearmbs.studies.case.sections import units_of_fields

    owner, _, place = path.rpartition(":")
    if owner and owner not in cases:
        raise IdentifyError(f"{path}: there is no case {owner!r}; the cases are {', '.join(cases)}")
    section, _, field = place.partition(".")
    holder = getattr(cases[owner] if owner else next(iter(cases.values())), section, None)
    if holder is None or field not in getattr(type(holder), "model_fields", {}):
        raise IdentifyError(f"{path}: a case has no such field; write section.field, for instance contact.depth")
    unit = units_of_fields(holder).get(field, "1")
    unit = "dimensionless" if unit == "1" else unit
    try:
        return to_si(getattr(holder, field), unit, path), unit
    except (ValueError, TypeError):
        raise IdentifyError(f"{path} is {getattr(holder, field)!r}, which is no number that could be fitted") from None


def check_table(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of harmonics with its columns checked; ``sigma`` is 2 % where it is missing.

    Raises
    ------
    IdentifyError
        For missing columns and values that have no logarithm.
    """
    import pandas as pd

    if not isinstance(table, pd.DataFrame):
        raise IdentifyError(f"measured is a {type(table).__name__}; give a DataFrame with {', '.join(COLUMNS)}")
    missing = [c for c in COLUMNS[:4] if c not in table.columns]
    if missing:
        raise IdentifyError(f"measured: columns {', '.join(missing)} are missing; give {', '.join(COLUMNS)}")
    if table.empty:
        raise IdentifyError("measured: the table has no rows")
    table = table.copy()
    for name in ("case", "channel"):
        if table[name].isna().any():
            raise IdentifyError(f"measured: {name} is missing in a row")
        table[name] = table[name].map(str)
    if "sigma" not in table.columns:
        table["sigma"] = 0.02
    for name in ("harmonic", "value", "sigma"):
        try:
            table[name] = pd.to_numeric(table[name])
        except (ValueError, TypeError) as error:
            raise IdentifyError(f"measured: column {name}: {error}") from None
    if not ((table["harmonic"] >= 1) & (table["harmonic"] % 1 == 0)).all():
        raise IdentifyError("measured: harmonic must be a whole number, 1 or more, in every row")
    finite = np.isfinite(table[["value", "sigma"]].to_numpy(dtype=float)).all()
    if not (finite and ((table["value"] > 0.0) & (table["sigma"] > 0.0)).all()):
        raise IdentifyError("measured: value and sigma must be positive and finite in every row; leave out the others")
    return table.reset_index(drop=True)
