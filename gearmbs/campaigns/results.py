"""Results of a campaign as a table and as a dataset."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.folder import REMEDY, Folder
from gearmbs.campaigns.plans.conditions import names_in, satisfied
from gearmbs.campaigns.plans.plan import ABOUT
from gearmbs.campaigns.settings import CampaignError, CampaignWarning, local, texts
from gearmbs.campaigns.subjects.base import ABOUT_RECORD
from gearmbs.files import whole_file, write_whole

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa
    import xarray as xr

    from gearmbs.campaigns.campaign import Campaign


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
        asked = names_in(where, known)
        # names that are none are told with all that there are
        satisfied(where, _with_missing(folder.unit_table(chosen_units[0]), known), folder.plan.unit_of)
    # of what is not wanted nothing is read
    read = None if wanted is None else ["index", *wanted, *asked]
    tables = []
    for unit in chosen_units:
        table = folder.unit_table(unit, read)
        if where is not None:
            columns_here = _with_missing(table, known if read is None else ["index", *asked])
            table = table.filter(pa.array(satisfied(where, columns_here, folder.plan.unit_of)))
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


def column_units(folder: Folder) -> dict[str, str]:
    """Return the units of the columns of factors and results that have one."""
    names = read_table(folder).columns if folder.done() else folder.cases(0)[0]
    found = {str(name): folder.plan.unit_of(str(name)) for name in names if name not in ABOUT}
    return {name: unit for name, unit in found.items() if unit not in ("", "1", "dimensionless")}


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
    from gearmbs.campaigns.signals import check_store, signal_variable

    try:
        check_store(folder.signals, folder.specs, folder.unit_size, folder.unit_count)
    except CampaignError as error:
        raise CampaignError(f"{error}; {REMEDY}") from None
    for spec in folder.specs:
        data[spec.name] = signal_variable(spec, folder.stored_signals(spec, table["slot"].to_numpy()))
        places = {f"{spec.name}_channel": list(spec.channels), f"{spec.name}_time": np.arange(spec.samples) / spec.rate}
        data = data.assign_coords(places)
    return data


# Campaigns for others: CSV, NetCDF, MATLAB, and the layout of parquet files that data set libraries load.


FORMATS = ("csv", "netcdf", "matlab", "parquet", "hf")
ROWS_A_FILE = 2000


def export(
    campaign: Campaign,
    target: str | Path,
    format: str,
    *,
    split: np.ndarray | None = None,
    split_by: str | None = None,
    test: float = 0.2,
    held_out: Mapping[str, Sequence[float]] | None = None,
    add: Mapping[str, Any] | None = None,
) -> list[Path]:
    """Write a campaign for others; return the files.

    Parameters
    ----------
    target : path-like
        File for CSV (the table alone), NetCDF and MATLAB; folder for parquet.
    format : {"csv", "netcdf", "matlab", "parquet", "hf"}
        "hf" is parquet with the README.md by which Hugging Face's hub and `datasets` find the splits.
    split : ndarray of str, optional
        For parquet the name of each row's split, in the order of the table; default all are "train".
    split_by : str, optional
        Instead the column, as "specimen", whose values each are in one split only: "train" or "test".
    test : float
        Part of its values that is for the test.
    held_out : mapping of str to (low, high), optional
        Ranges of columns, as ``{"severity": (0.45, 0.6)}``: training rows inside any of them are the split "withheld".
    add : mapping, optional
        Further columns for parquet, by row.

    Raises
    ------
    CampaignError
        For an unknown format.
    """
    target = local(target)
    if format == "csv":
        return [write_whole(target, campaign.table.to_csv(index=False))]
    if format == "netcdf":
        data = campaign.open().load()
        with whole_file(target) as part:
            data.to_netcdf(part, engine="h5netcdf")
        return [target]
    if format == "matlab":
        return [_matlab(campaign, target)]
    if format in ("parquet", "hf"):
        if split_by is not None:
            split = _split_by(campaign, split_by, test)
        if held_out:
            split = _held_out(campaign, held_out, split)
        files = _parquet(campaign, target, split, add or {})
        return files if format == "parquet" else [*files, _readme(campaign, target, files)]
    raise CampaignError(f"format {format!r} is unknown; choose one of {', '.join(FORMATS)}")


def _matlab(campaign: Campaign, target: Path) -> Path:
    """Write table and signals as variables whose names MATLAB takes."""
    from scipy.io import savemat

    data = campaign.open().load()
    found: dict[str, Any] = {}
    for name, variable in _variable_names([str(name) for name in (*data.data_vars, *data.coords)]).items():
        values = data[name].values
        found[variable] = np.array([str(v) for v in values], dtype=object) if values.dtype == object else values
    with whole_file(target) as part, part.open("wb") as file:
        savemat(file, found, long_field_names=True, do_compression=True)
    return target


VARIABLE_LENGTH = 63
"""Characters of a name in MATLAB, its ``namelengthmax``."""


def _variable_names(names: Sequence[str]) -> dict[str, str]:
    """Return a name that MATLAB takes for each: those that would be one are numbered, and told."""
    found: dict[str, str] = {}
    for name in names:
        text = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        text = variable = (text if text[:1].isalpha() else f"v_{text}")[:VARIABLE_LENGTH]
        number = 1
        while variable in found.values():
            number += 1
            variable = f"{text[: VARIABLE_LENGTH - len(str(number)) - 1]}_{number}"
        found[name] = variable
        if number > 1:
            warnings.warn(
                f"matlab: {name} is the variable {variable}, since {text} is that of another column",
                CampaignWarning,
                stacklevel=5,
            )
    return found


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
    if not done.any():
        raise CampaignError("export: none of the cases has results; see failed()")
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
    remove_former(target / "data", written)
    return written


def remove_former(folder: Path, written: Sequence[Path]) -> None:
    """Remove the rows of a former writing, whose files had other names: they would be read beside those of this one."""
    for path in folder.glob("*.parquet"):
        if path not in written and re.fullmatch(r"[a-z]+-\d{5}-of-\d{5}\.parquet", path.name):
            path.unlink()


def _split_by(campaign: Campaign, column: str, test: float) -> np.ndarray:
    """Return the split of each row, all rows of equal value in a column being in the same."""
    from gearmbs.campaigns.datasets.splits import split_by_group

    table = campaign.table
    if column not in table.columns:
        raise CampaignError(f"split by {column!r}: the table has no such column; it has {', '.join(table.columns)}")
    groups = np.unique(table[column].to_numpy(), return_inverse=True)[1]
    return split_by_group(groups, test=test, validation=0.0, seed=campaign.plan.seed)


def _held_out(campaign: Campaign, ranges: Mapping[str, Sequence[float]], split: np.ndarray | None) -> np.ndarray:
    """Return the split with training rows of some ranges withheld."""
    from gearmbs.campaigns.datasets.splits import withhold

    table = campaign.table
    found = np.full(len(table), "train") if split is None else np.asarray(split)
    for column, ends in ranges.items():
        if column not in table.columns or table[column].dtype.kind not in "biuf":
            raise CampaignError(f"held out: {column!r} is no column of numbers")
        if len(ends) != 2 or not float(ends[0]) <= float(ends[1]):
            raise CampaignError(f"held out: {column} = {ends!r}; give its lower and upper end")
        found = withhold(found, table[column].to_numpy(), float(ends[0]), float(ends[1]))
    return found


def front_matter(files: Sequence[Path], rows: int) -> list[str]:
    """Return the lines by which a hub finds the splits of a folder of parquet files, and how large it is."""
    limits = ((1000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))
    size = next((name for limit, name in limits if rows < limit), "n>1M")
    lines = [f"size_categories:\n- {size}", "configs:", "- config_name: default", "  data_files:"]
    splits = dict.fromkeys(path.name.split("-")[0] for path in files)
    return [*lines, *(f"  - split: {name}\n    path: data/{name}-*.parquet" for name in splits)]


def _readme(campaign: Campaign, target: Path, files: Sequence[Path]) -> Path:
    """Write what the hub shows of a campaign: its splits and what its columns are."""
    plan, table = campaign.plan, campaign.table
    done = int((table["status"] == "done").sum())
    lines = ["---", *front_matter(files, done), "---", "", f"# {campaign.path.stem}", ""]
    lines += [
        f"{done} cases simulated by gearmbs, subject {plan.subject.kind}, design {plan.design}, seed {plan.seed}; a "
        "row is a case with its settings, results in SI units, and signals as lists.",
        "",
    ]
    if (codes := campaign.status().codes) > 1:
        lines += [
            f"The results come from {codes} different codes; `gearmbs campaign check` says in what they differ.",
            "",
        ]
    lines += [f"* `{factor.name}`: varied" for factor in plan.factors]
    for spec in campaign.folder.specs:
        lines.append(f"* `signal.*` of {spec.name}: {spec.rate:g} Hz, {spec.units}, {', '.join(spec.channels)}")
    return write_whole(target / "README.md", "\n".join(lines) + "\n")
