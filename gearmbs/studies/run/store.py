"""Results of studies as files that appear under their final name only when they are whole, and are found again.

A dataset becomes a file in memory first: the library that writes the format ends the whole program where a disk is
full. Where a file cannot be written, the record is kept elsewhere, and the message says where.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from gearmbs.files import keep, whole_file, write_whole
from gearmbs.studies.case.case import Case
from gearmbs.studies.run.code import code_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BYTES, COLUMNS, PACKED = 8, 13, 0.6
"""Bytes of a number, numbers that an output time holds, and the share that compression leaves of them at best."""


def write_dataset(path: str | Path, dataset: xr.Dataset, *, durable: Path | None = None) -> Path:
    """Write a dataset as compressed NetCDF with checksums, as a whole, and return its path; see `whole_file`.

    Raises
    ------
    OSError
        If the folder cannot be written or the disk is full; nothing is left behind.
    """
    encoding = {
        name: {"zlib": True, "complevel": 1, "shuffle": True, "fletcher32": True}
        for name, variable in dataset.data_vars.items()
        if variable.dtype.kind == "f" and variable.size > 1000
    }
    content = dataset.to_netcdf(engine="h5netcdf", encoding=encoding)
    with whole_file(path, durable=durable) as part:
        part.write_bytes(content)
    return Path(path)


def save_study(
    folder: str | Path,
    datasets: Mapping[str, xr.Dataset],
    texts: Mapping[str, Callable[[], str]],
    figures: Callable[[], Mapping[str, Figure]],
) -> list[Path]:
    """Write what came of a study to a folder, each by its name; return the paths.

    Datasets come first: what was computed is there whatever becomes of the texts and figures, which are made then.
    Names of figures have no ending.
    """
    from gearmbs.view import save_figure

    folder = Path(folder)
    paths = [write_dataset(folder / name, dataset) for name, dataset in datasets.items()]
    paths += [write_whole(folder / name, text()) for name, text in texts.items()]
    return [*paths, *(path for name, figure in figures().items() for path in save_figure(figure, folder / name))]


def keep_dataset(path: str | Path, dataset: xr.Dataset) -> Path:
    """Write a dataset, and if that is impossible somewhere else where it is possible; see `keep`."""
    return keep(lambda place: write_dataset(place, dataset), path)


def record_size(case: Case) -> float:
    """Return about how many bytes the record of a case takes as a file, rather less than more."""
    samples = COLUMNS * case.output_rate + 5.0 * case.signal_rate
    return PACKED * BYTES * samples * case.operation.longest + 2e4


def file_stem(name: str) -> str:
    """Return the name of a case as part of a file's name."""
    return name.replace(", ", "_").replace("/", "_")


def stored_record(folder: str | Path, case: Case, accuracy: float | None = None) -> xr.Dataset | None:
    """Return the record of exactly this case on joints from a folder, None if there is none made by this code.

    It is one to the accuracy that is asked for, and of no accuracy if none is.
    """
    path = Path(folder) / f"{file_stem(case.name)}.nc"
    if not path.is_file():
        return None
    try:
        with xr.open_dataset(path, engine="h5netcdf") as found:
            known = found.attrs.get("case_json"), found.attrs.get("code"), found.attrs.get("accuracy_asked")
            wanted = case.model_dump_json(), code_of().digest, accuracy
            # the case says nothing of rolling bearings, so a record on them is not that of the case alone
            on_joints = "bearings" not in found.attrs
            return found.load() if on_joints and known == wanted else None
    except (OSError, ValueError, KeyError):
        # damaged, or not one of ours: the case is computed again
        return None


@dataclass(frozen=True)
class RecordFolder:
    """Records of cases in a folder, as the ledger of a run: a case is done if its record is there.

    Attributes
    ----------
    path : Path
    accuracy : float or None
        Of the records' mesh harmonics, if one is asked for.
    """

    path: Path
    accuracy: float | None = None

    def result(self, case: Case) -> tuple[xr.Dataset, str] | None:
        """Return the record of a case that is done to the accuracy asked for, as `enter` left it."""
        record = stored_record(self.path, case, self.accuracy)
        return None if record is None else (record, "")

    def claim(self, case: Case) -> Path:
        """Return the path of a case's claim."""
        return self.path / f".{file_stem(case.name)}.claim"

    def enter(self, case: Case, record: xr.Dataset) -> str:
        """Write a case's record with its code; return what is to be said if it had to be kept elsewhere, or nowhere."""
        record.attrs["code"] = code_of().digest
        try:
            keep_dataset(self.path / f"{file_stem(case.name)}.nc", record)
        except OSError as error:
            return str(error)
        return ""
