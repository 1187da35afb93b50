"""Campaigns for others: CSV, NetCDF, MATLAB, and the layout of parquet files that data set libraries load."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from gearmbs.campaigns.results import open_dataset, say_left_out
from gearmbs.campaigns.settings import CampaignError, CampaignWarning, local
from gearmbs.campaigns.stored.rows import held_out_of_training, split_of_rows
from gearmbs.campaigns.subjects.base import SignalSpec
from gearmbs.files import whole_file, write_whole

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearmbs.campaigns.campaign import Campaign

FILES = {"csv": ".csv", "netcdf": ".nc", "matlab": ".mat"}
"""Formats of one file, and how its name ends by custom."""

FORMATS = (*FILES, "parquet", "hf")
ROWS_A_FILE = 2000


class ExportKeywords(TypedDict, total=False):
    """Keywords of `export`, for type checkers."""

    split: Sequence[str] | np.ndarray | None
    split_by: str | None
    test: float | None
    held_out: Mapping[str, Sequence[Any]] | None
    add: Mapping[str, Any] | None


def export(
    campaign: Campaign,
    target: str | Path,
    format: str,
    *,
    split: Sequence[str] | np.ndarray | None = None,
    split_by: str | None = None,
    test: float | None = None,
    held_out: Mapping[str, Sequence[Any]] | None = None,
    add: Mapping[str, Any] | None = None,
) -> list[Path]:
    """Write a campaign for others; return the files.

    Parameters
    ----------
    target : path-like
        File for CSV (the table alone), NetCDF and MATLAB; folder for parquet.
    format : {"csv", "netcdf", "matlab", "parquet", "hf"}
        "hf" is parquet with the README.md by which Hugging Face's hub and `datasets` find the splits.
    split : sequence of str, optional
        For parquet the name of each row's split, in the order of the table; default all are "train".
    split_by : str, optional
        Instead the column, as "specimen", whose values each are in one split only: "train" or "test".
    test : float
        Part of its values that is for the test; default a fifth.
    held_out : mapping of str to (low, high), optional
        Ranges of columns, as ``{"severity": (0.45, 0.6)}`` or ``{"operation.torque": ("50 N m", "60 N m")}``: training
        rows inside any of them are the split "withheld". What has no severity, as a sound gear, is in none of them.
    add : mapping, optional
        Further columns for parquet, by row.

    Raises
    ------
    CampaignError
        For an unknown format, a place that will not do, and settings that the format or the table does not have.

    Warns
    -----
    CampaignWarning
        If cases are left out, since they are not done or failed, columns have other names in the file, or what is held
        out leaves an option of a choice without training rows.
    """
    if format not in FORMATS:
        raise CampaignError(f"format {format!r} is unknown; choose one of {', '.join(FORMATS)}")
    given = {"split": split, "split_by": split_by, "held_out": held_out or None, "add": add or None}
    asked = [name for name, value in given.items() if value is not None]
    if asked and format in FILES:
        raise CampaignError(
            f"export: {', '.join(asked)}: {format} knows no splits and further columns; take parquet or hf"
        )
    if split is not None and split_by is not None:
        raise CampaignError("export: split and split_by both say how rows are split; give one")
    if test is not None and split_by is None:
        raise CampaignError(f"export: test = {test!r} is a part of the values of a column; give it as split_by")
    target = place(target, FILES.get(format), campaign.path.stem)
    # one reading: cases that are done meanwhile would put signals beside the numbers of others
    table = campaign.table
    # files of one table have the cases that failed with their status
    say_left_out(campaign.folder, table, "export", failed=format not in FILES, stacklevel=4)
    if format == "csv":
        return [write_whole(target, table.to_csv(index=False))]
    if format in FILES:
        data = open_dataset(campaign.folder, table).load()
        return [(_netcdf if format == "netcdf" else _matlab)(data, target)]
    if format == "hf":
        check_card(target)
    rows = split_of_rows(campaign.plan, table, split, split_by, 0.2 if test is None else test)
    if held_out:
        rows = held_out_of_training(campaign.plan, table, held_out, rows)
    files = _parquet(campaign, table, target, rows, add or {})
    return files if format == "parquet" else [*files, _readme(campaign, table, target, files)]


def place(target: str | Path, ending: str | None, name: str) -> Path:
    """Return where what is written goes, a file with an ending, or a folder.

    Raises
    ------
    CampaignError
        If a folder is where the file is to be, or a file where a folder is.
    """
    path = local(target)
    if ending is not None and path.is_dir():
        raise CampaignError(f"{path} is a folder; give the name of a file, as {path / f'{name}{ending}'}")
    for folder in (path, *path.parents) if ending is None else path.parents:
        if folder.exists() and not folder.is_dir():
            raise CampaignError(f"{folder} is a file, where a folder is needed for {path}; choose another place")
    return path


def _netcdf(data: xr.Dataset, target: Path) -> Path:
    """Write table and signals under names that netCDF takes, each with its own beside it where that is another one."""
    names = _told("netcdf", [str(name) for name in (*data.data_vars, *data.coords)], _for_netcdf)
    for name, values in data.variables.items():
        if values.dtype == object:
            data[name] = (values.dims, _as_texts(values.values), values.attrs)
    data = data.rename({name: new for name, new in names.items() if name != new})
    for name, new in names.items():
        if name != new:
            data[new].attrs["long_name"] = name
    with whole_file(target) as part:
        data.to_netcdf(part, engine="h5netcdf")
    return target


def _matlab(data: xr.Dataset, target: Path) -> Path:
    """Write table and signals as variables whose names MATLAB takes."""
    from scipy.io import savemat

    found: dict[str, Any] = {}
    for name, new in _told("matlab", [str(n) for n in (*data.data_vars, *data.coords)], _for_matlab).items():
        values = data[name].values
        found[new] = _as_texts(values) if values.dtype == object else values
    with whole_file(target) as part, part.open("wb") as file:
        savemat(file, found, long_field_names=True, do_compression=True)
    return target


def _as_texts(values: np.ndarray) -> np.ndarray:
    """Return texts as such, empty ones where none is given."""
    return np.array(["" if v is None or v != v else str(v) for v in values], dtype=object)


VARIABLE_LENGTH = 63
"""Characters of a name in MATLAB, its ``namelengthmax``."""


def _for_matlab(name: str) -> str:
    text = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
    return (text if text[:1].isalpha() else f"v_{text}")[:VARIABLE_LENGTH]


def _for_netcdf(name: str) -> str:
    """Return a name without what netCDF's may not have: a slash, which parts groups, what is not printed, an odd
    beginning, a blank at the end."""
    text = re.sub(r"[/\x00-\x1f\x7f]", "_", name).rstrip()
    return text if re.match(r"\w", text) else f"v_{text}"


def _told(form: str, names: Sequence[str], written: Callable[[str], str]) -> dict[str, str]:
    """Return the names that a format takes: what it takes as it is stays, others that would be one are numbered.

    Numbers are told by a warning, and what netCDF does not take; that MATLAB has no dots everybody knows.
    """
    found: dict[str, str] = {}
    for name in sorted(names, key=lambda name: written(name) != name):
        text = new = written(name)
        number = 1
        while new in found.values():
            number += 1
            new = f"{text[: VARIABLE_LENGTH - len(str(number)) - 1]}_{number}"
        found[name] = new
        if number > 1 or (form == "netcdf" and new != name):
            why = f", since {text} is that of another column" if number > 1 else ""
            warnings.warn(f"{form}: {name} is the variable {new}{why}", CampaignWarning, stacklevel=5)
    return found


def _parquet(
    campaign: Campaign, table: pd.DataFrame, target: Path, split: np.ndarray, add: Mapping[str, Any]
) -> list[Path]:
    """Write rows with their signals as lists, some thousand a file, by split."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    data, specs = open_dataset(campaign.folder, table), campaign.folder.specs
    table, done = _with_more(table, add), (table["status"] == "done").to_numpy()
    if not done.any():
        raise CampaignError("export: none of the cases has results; see failed()")
    names = signal_columns(specs)
    taken = {*names.values(), *(f"sampling_rate.{spec.name}" for spec in specs)} & {*map(str, table.columns)}
    if taken:
        raise CampaignError(f"export: {', '.join(sorted(taken))} would be a column twice, of signals and of the table")
    written = []
    kept = [c for c in table.columns if c not in ("unit", "slot", "status", "message", "advice")]
    for part_name in sorted(set(split[done])):
        rows = np.flatnonzero(done & (split == part_name))
        count = -(-len(rows) // ROWS_A_FILE)
        for k in range(count):
            here = rows[k * ROWS_A_FILE : (k + 1) * ROWS_A_FILE]
            columns = {str(c): _column(str(c), table[c].iloc[here]) for c in kept}
            for spec in specs:
                values = data[spec.name].isel(case=here).values
                for c, channel in enumerate(spec.channels):
                    columns[names[spec.name, channel]] = pa.array(list(values[:, c, :]), type=pa.list_(pa.float32()))
                columns[f"sampling_rate.{spec.name}"] = pa.array(np.full(len(here), spec.rate))
            path = target / "data" / f"{part_name}-{k:05d}-of-{count:05d}.parquet"
            with whole_file(path) as part:
                pq.write_table(pa.table(columns), part, compression="zstd", write_page_checksum=True)
            written.append(path)
    remove_former(target / "data", written)
    return written


def _with_more(table: pd.DataFrame, add: Mapping[str, Any]) -> pd.DataFrame:
    """Return a table with further columns."""
    table = table.copy(deep=False)
    for name, values in add.items():
        if name in table.columns:
            raise CampaignError(f"add: {name!r} is a column of the table already; give another name")
        if np.ndim(values) and len(values) != len(table):
            raise CampaignError(f"add: {name!r} has {len(values)} values for {len(table)} rows; give one a row")
        table[name] = values
    return table


def _column(name: str, values: pd.Series) -> Any:
    import pyarrow as pa

    try:
        return pa.array(values, from_pandas=True)
    except pa.ArrowException as error:
        raise CampaignError(f"export: column {name!r} is nothing that parquet holds ({error}); leave it out") from None


def signal_columns(specs: Sequence[SignalSpec]) -> dict[tuple[str, str], str]:
    """Return the columns of signals by array and channel: ``signal.CHANNEL``, ``signal.ARRAY.CHANNEL`` where several
    arrays have channels of one name."""
    channels = [channel for spec in specs for channel in spec.channels]
    return {
        (spec.name, c): f"signal.{c}" if channels.count(c) == 1 else f"signal.{spec.name}.{c}"
        for spec in specs
        for c in spec.channels
    }


def remove_former(folder: Path, written: Sequence[Path]) -> None:
    """Remove the rows of a former writing, whose files had other names: they would be read beside those of this one."""
    for path in folder.glob("*.parquet"):
        if path not in written and re.fullmatch(r"\w+-\d{5}-of-\d{5}\.parquet", path.name):
            path.unlink()


def check_card(folder: Path) -> None:
    """Refuse a folder whose README.md is not the card of a former writing, which would be lost.

    Raises
    ------
    CampaignError
    """
    card = folder / "README.md"
    if card.exists() and not (card.is_file() and re.match(rb"---\r?\n(.*\n)*configs:", card.read_bytes())):
        raise CampaignError(f"{card} is there already, and no card of a data set; choose another folder")


def front_matter(files: Sequence[Path], rows: int) -> list[str]:
    """Return the lines by which a hub finds the splits of a folder of parquet files, and how large it is."""
    limits = ((1000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))
    size = next((name for limit, name in limits if rows < limit), "n>1M")
    lines = [f"size_categories:\n- {size}", "configs:", "- config_name: default", "  data_files:"]
    splits = dict.fromkeys(path.name.split("-")[0] for path in files)
    return [*lines, *(f"  - split: {name}\n    path: data/{name}-*.parquet" for name in splits)]


def _readme(campaign: Campaign, table: pd.DataFrame, target: Path, files: Sequence[Path]) -> Path:
    """Write what the hub shows of a campaign: its splits and what its columns are."""
    plan = campaign.plan
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
    names = signal_columns(campaign.folder.specs)
    for spec in campaign.folder.specs:
        columns = ", ".join(f"`{names[spec.name, channel]}`" for channel in spec.channels)
        lines.append(f"* {columns} of {spec.name}: {spec.rate:g} Hz, {spec.units}")
    return write_whole(target / "README.md", "\n".join(lines) + "\n")
