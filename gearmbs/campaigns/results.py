"""Results of a campaign as a table and as a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.folder import Folder
from gearmbs.campaigns.status import REMEDY

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

ABOUT = ("index", "unit", "point", "slot", "id", "status", "message", "advice")
"""Columns of a table that are neither factors nor results."""


def read_table(folder: Folder) -> pd.DataFrame:
    """Return the tables of all finished units as one, in the order of the cases.

    Raises
    ------
    CampaignError
        If nothing is finished, or what is stored is damaged.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    done = folder.done()
    if not done:
        raise CampaignError(f"{folder.path}: no unit is finished yet; run the campaign")
    tables = []
    for unit in done:
        try:
            tables.append(pq.ParquetFile(folder.table(unit)).read())
        except (OSError, pa.ArrowInvalid) as error:
            raise CampaignError(f"{folder.table(unit)}: missing or damaged ({error}); {REMEDY}") from None
    table = pa.concat_tables(tables, promote_options="permissive").to_pandas()
    return table.sort_values("index", ignore_index=True)


def factor_names(folder: Folder) -> list[str]:
    """Return the names of the columns that the plan varies."""
    row = folder.cases(0)[0]
    return [name for name in row if name not in ABOUT]


def result_names(folder: Folder, table: pd.DataFrame) -> list[str]:
    """Return the names of the columns that simulations gave."""
    known = {*ABOUT, *factor_names(folder)}
    return [str(name) for name in table.columns if name not in known]


def open_dataset(folder: Folder) -> xr.Dataset:
    """Return table and signals along ``case`` as one Dataset; signals are read when they are asked for.

    Factors, status and identity are coordinates of ``case``. Signals have dimensions (case, channel, time), NaN
    beyond the
    end of a shorter one and for cases that failed.
    """
    import xarray as xr

    table = read_table(folder)
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
    try:
        stored = xr.open_zarr(folder.signals, consolidated=False, chunks=None)
    except OSError as error:
        raise CampaignError(f"{folder.signals}: missing or damaged ({error}); {REMEDY}") from None
    stored = stored.isel(slot=table["slot"].to_numpy()).rename(slot="case")
    for spec in folder.specs:
        signal = stored[spec.name]
        signal = signal.assign_coords({f"{spec.name}_channel": list(spec.channels)})
        signal = signal.assign_coords({f"{spec.name}_time": np.arange(spec.samples) / spec.rate})
        data[spec.name] = signal.drop_vars("case", errors="ignore")
    return data
