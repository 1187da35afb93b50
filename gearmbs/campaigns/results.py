"""Results of a campaign as a table and as a dataset."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.folder import REMEDY, Folder
from gearmbs.campaigns.plans.conditions import names_in, satisfied
from gearmbs.campaigns.plans.plan import ABOUT
from gearmbs.campaigns.settings import CampaignError, CampaignWarning, texts
from gearmbs.campaigns.subjects.base import ABOUT_RECORD

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa
    import xarray as xr


def read_table(
    folder: Folder, columns: Sequence[str] | None = None, where: str | None = None, units: Sequence[int] | None = None
) -> pd.DataFrame:
    """Return the tables of finished units as one, in the order of the cases; see `Campaign.read`.

    Parameters
    ----------
    units : sequence of int, optional
        Of those that are done; default all.

    Raises
    ------
    CampaignError
        If nothing is finished, there is no such column, or what is stored is damaged.
    """
    import pyarrow as pa

    done = folder.done()
    if not done:
        raise CampaignError(f"{folder.path}: no unit is finished yet; run the campaign")
    wanted = None if columns is None else list(dict.fromkeys(texts(columns, "columns")))
    asked, known = [], []
    chosen_units = done[:1] if units is not None and not units else done if units is None else list(units)
    if where is not None:
        known = _known_columns(folder, chosen_units)
        # names that are none are told with all that there are
        satisfied(where, _with_missing(folder.unit_table(chosen_units[0]), known), folder.plan.unit_of)
        results = set(known) - {*ABOUT, *factor_names(folder)}
        asked = [*names_in(where, known), "point"]
    # of what is not wanted nothing is read
    read = None if wanted is None else ["index", *wanted, *asked]
    tables = []
    for unit in chosen_units:
        table = folder.unit_table(unit, read)
        if where is not None:
            columns_here = _with_missing(table, known if read is None else ["index", *asked])
            empty = folder.plan.empty(columns_here)
            table = table.filter(pa.array(satisfied(where, columns_here, folder.plan.unit_of, results, empty)))
        tables.append(table)
    table = pa.concat_tables(tables, promote_options="permissive")
    missing = [name for name in wanted or () if name not in table.column_names]
    if missing:
        told = ", ".join(_known_columns(folder, chosen_units))
        raise CampaignError(f"columns: {', '.join(missing)} unknown; the table has {told}")
    found = table.to_pandas(self_destruct=True).sort_values("index", ignore_index=True)
    if where is not None and units is None:
        # rows go by the numbers of their cases, so that they join with those of other columns
        found = found.set_axis(found["index"].to_numpy(), axis=0)
    return found if wanted is None else found[wanted]


def _known_columns(folder: Folder, units: Sequence[int]) -> list[str]:
    """Return the names of the columns of some units: one whose cases all failed has none of results."""
    return list(dict.fromkeys(name for unit in units for name in folder.unit_columns(unit)))


def _with_missing(table: pa.Table, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Return some columns of a unit, NaN for results that none of its cases has."""
    none = np.full(len(table), np.nan)
    return {name: table[name].to_numpy() if name in table.column_names else none for name in names}


def read_record(folder: Folder, unit: int, index: int) -> xr.Dataset:
    """Return the record of a case, or what a failed one had computed; see `Campaign.record`."""
    import xarray as xr

    with xr.open_dataset(io.BytesIO(folder.record(unit, index)), engine="h5netcdf") as found:
        return found.load()


def left_out(folder: Folder, table: pd.DataFrame, failed: bool = True, unknown: int = 0) -> str:
    """Return in words how many cases are left out of what is made of a table: of which nothing is done yet, those that
    failed unless these are in it, and those that are done without the number that is asked for. Nothing if none is."""
    without = int((table["status"] != "done").sum()) if failed else 0
    waiting = folder.case_count - len(table)
    counts = ((waiting, "not done yet"), (without, "failed"), (unknown, "without a number"))
    told = ", ".join(f"{count} {word}" for count, word in counts if count)
    return f"{len(table) - without - unknown} of {folder.case_count} cases; left out: {told}" if told else ""


def say_left_out(
    folder: Folder, table: pd.DataFrame, what: str, failed: bool = True, unknown: int = 0, stacklevel: int = 3
) -> str:
    """Warn that something is made of a part of a campaign alone; return the words."""
    if told := left_out(folder, table, failed, unknown):
        warnings.warn(f"{what} of {told}", CampaignWarning, stacklevel=stacklevel)
    return told


def factor_names(folder: Folder) -> list[str]:
    """Return the names of the columns that the plan varies."""
    row = folder.cases(0)[0]
    return [name for name in row if name not in ABOUT]


def result_names(folder: Folder, table: pd.DataFrame) -> list[str]:
    """Return the names of the columns that simulations gave."""
    known = {*ABOUT, *factor_names(folder)}
    return [str(name) for name in table.columns if name not in known]


def numeric_results(folder: Folder, table: pd.DataFrame) -> list[str]:
    """Return the names of the results that are numbers and say something of what was simulated."""
    names = [name for name in result_names(folder, table) if not name.startswith(ABOUT_RECORD)]
    return [name for name in names if table[name].dtype.kind in "biuf"]


def only_numbers(folder: Folder, table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose results that are infinite are missing: they have no mean and no place in a figure."""
    names = numeric_results(folder, table)
    return table.assign(**{name: table[name].where(np.isfinite(table[name].to_numpy(dtype=float))) for name in names})


def column_units(folder: Folder) -> dict[str, str]:
    """Return the units of the columns of factors and results that have one."""
    names = read_table(folder).columns if folder.done() else folder.cases(0)[0]
    found = {str(name): folder.plan.unit_of(str(name)) for name in names if name not in ABOUT}
    return {name: unit for name, unit in found.items() if unit not in ("", "1", "dimensionless")}


def open_dataset(folder: Folder, table: pd.DataFrame | None = None) -> xr.Dataset:
    """Return table and signals along ``case`` as one Dataset; signals are read when they are asked for.

    Factors, status and identity are coordinates of ``case``. Signals have dimensions (case, channel, time), NaN
    beyond the end of a shorter one and for cases that failed.

    Parameters
    ----------
    folder : Folder
    table : DataFrame, optional
        All that `read_table` has returned, where both are put beside each other: more may have been done since.
    """
    import xarray as xr

    table = read_table(folder) if table is None else table
    results = result_names(folder, table)
    coords = {
        str(name): ("case", table[name].to_numpy())
        for name in table.columns
        if name not in results and name not in ("index", "message", "advice")
    }
    data = xr.Dataset(
        {name: ("case", table[name].to_numpy(dtype=float)) for name in results},
        coords={"case": table["index"].to_numpy(), **coords},
        attrs={"campaign": str(folder.path.name), "design": folder.plan.design, "seed": folder.plan.seed},
    )
    if not folder.specs:
        return data
    from gearmbs.campaigns.signals import check_store
    from gearmbs.campaigns.stored.variables import signal_variable

    try:
        check_store(folder.signals, folder.specs, folder.unit_size, folder.unit_count)
    except CampaignError as error:
        raise CampaignError(f"{error}; {REMEDY}") from None
    for spec in folder.specs:
        data[spec.name] = signal_variable(spec, folder.stored_signals(spec, table["slot"].to_numpy()))
        places = {f"{spec.name}_channel": list(spec.channels), f"{spec.name}_time": np.arange(spec.samples) / spec.rate}
        data = data.assign_coords(places)
    return data
