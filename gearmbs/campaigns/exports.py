"""Campaigns for others: CSV, NetCDF, MATLAB, and the layout of parquet files that data set libraries load."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.errors import CampaignError
from gearmbs.view.files import whole_file, write_whole

if TYPE_CHECKING:
    from gearmbs.campaigns.campaign import Campaign

FORMATS = ("csv", "netcdf", "matlab", "parquet")
ROWS_A_FILE = 2000


def export(
    campaign: Campaign,
    target: str | Path,
    format: str,
    *,
    split: np.ndarray | None = None,
    add: Mapping[str, Any] | None = None,
) -> list[Path]:
    """Write a campaign for others; return the files.

    Parameters
    ----------
    target : path-like
        File for CSV (the table alone), NetCDF and MATLAB; folder for parquet.
    format : {"csv", "netcdf", "matlab", "parquet"}
    split : ndarray of str, optional
        For parquet the name of each row's split, in the order of the table; default all are "train".
    add : mapping, optional
        Further columns for parquet, by row.

    Raises
    ------
    CampaignError
        For an unknown format.
    """
    target = Path(target)
    if format == "csv":
        return [write_whole(target, campaign.table.to_csv(index=False))]
    if format == "netcdf":
        data = campaign.open().load()
        with whole_file(target) as part:
            data.to_netcdf(part, engine="h5netcdf")
        return [target]
    if format == "matlab":
        return [_matlab(campaign, target)]
    if format == "parquet":
        return _parquet(campaign, target, split, add or {})
    raise CampaignError(f"format {format!r} is unknown; choose one of {', '.join(FORMATS)}")


def _matlab(campaign: Campaign, target: Path) -> Path:
    """Write table and signals as variables whose names MATLAB takes."""
    from scipy.io import savemat

    data = campaign.open().load()
    found: dict[str, Any] = {}
    for name in (*data.data_vars, *data.coords):
        values = data[name].values
        found[_plain(str(name))] = (
            np.array([str(v) for v in values], dtype=object) if values.dtype == object else values
        )
    with whole_file(target) as part, part.open("wb") as file:
        savemat(file, found, long_field_names=True, do_compression=True)
    return target


def _plain(name: str) -> str:
    text = "".join(c if c.isalnum() else "_" for c in name)
    return (text if text[0].isalpha() else f"v_{text}")[:60]


def _parquet(campaign: Campaign, target: Path, split: np.ndarray | None, add: Mapping[str, Any]) -> list[Path]:
    """Write rows with their signals as lists, some thousand a file, by split."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    data = campaign.open()
    table = campaign.table
    for name, values in add.items():
        table[name] = values
    done = (table["status"] == "done").to_numpy()
    names = np.full(len(table), "train") if split is None else np.asarray(split)
    rate = {spec.name: spec.rate for spec in campaign.folder.specs}
    written = []
    kept = [c for c in table.columns if c not in ("unit", "slot", "status", "message", "advice")]
    for part_name in sorted(set(names[done])):
        rows = np.flatnonzero(done & (names == part_name))
        count = -(-len(rows) // ROWS_A_FILE)
        for k in range(count):
            here = rows[k * ROWS_A_FILE : (k + 1) * ROWS_A_FILE]
            columns = {str(c): pa.array(table[c].iloc[here], from_pandas=True) for c in kept}
            for spec in campaign.folder.specs:
                values = data[spec.name].isel(case=here).values
                for c, channel in enumerate(spec.channels):
                    columns[f"signal.{channel}"] = pa.array(list(values[:, c, :]), type=pa.list_(pa.float32()))
                columns[f"sampling_rate.{spec.name}"] = pa.array(np.full(len(here), rate[spec.name]))
            path = target / "data" / f"{part_name}-{k:05d}-of-{count:05d}.parquet"
            with whole_file(path) as part:
                pq.write_table(pa.table(columns), part, compression="zstd")
            written.append(path)
    return written
