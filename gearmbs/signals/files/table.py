"""The table of the formats of recordings: a row and a module each.

Reading, writing, `gearmbs.save`, the checks of contents, messages, the help of the command line and the documentation
follow from it. It is light: a module is loaded when files are read or written, not when its row is.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearmbs.signals.files.format import Format


@dataclass(frozen=True)
class Row:
    """One format by name.

    Parameters
    ----------
    title : str
        What people call it, in help texts and the documentation.
    module : str
        Module of this folder, whose ``FORMATS`` hold the rest under the format's name.
    endings : str
        Endings of files, separated by blanks; none for a format that is only asked for by name.
    """

    title: str
    module: str
    endings: str = ""

    def __post_init__(self) -> None:
        wrong = [ending for ending in self.endings.split() if not ending.startswith(".") or ending != ending.lower()]
        if wrong:
            raise ValueError(f"endings of {self.title}: {wrong[0]!r} is not of the form '.abc'")


TABLE: dict[str, Row] = {
    "csv": Row("CSV", "csv", ".csv .txt .tsv .dat .asc .prn"),
    "csv.gz": Row("gzip CSV", "csv", ".csv.gz .txt.gz .tsv.gz"),
    "mat5": Row("MATLAB", "matlab", ".mat"),
    "mat7.3": Row("MATLAB 7.3", "matlab"),
    "uff58": Row("UFF 58", "uff", ".uff .unv .uf"),
    "wav": Row("WAV", "wav", ".wav"),
    "netcdf": Row("NetCDF", "hdf", ".nc .nc4 .cdf"),
    "hdf5": Row("HDF5", "hdf", ".h5 .hdf5 .hdf"),
    "tdms": Row("TDMS", "tdms", ".tdms"),
    "npy": Row("numpy", "arrays", ".npy .npz"),
    "parquet": Row("Parquet", "frames", ".parquet .pq"),
    "feather": Row("Feather", "frames", ".feather"),
    "lvm": Row("LabVIEW", "lvm", ".lvm"),
}


def format_of(name: str) -> Format:
    """Return what the module of a format says of it."""
    return importlib.import_module(f"gearmbs.signals.files.{TABLE[name].module}").FORMATS[name]


def known_endings() -> dict[str, str]:
    """Return the format that each ending stands for."""
    return {ending: name for name, row in TABLE.items() for ending in row.endings.split()}


def titles() -> str:
    """Return what people call the formats that endings stand for, for help texts."""
    return ", ".join(row.title for row in TABLE.values() if row.endings)


def formats_table() -> str:
    """Return the formats with their endings, libraries and what they keep, as a Markdown table."""
    rows = ["| format | `format=` | endings | through | written |", "|---|---|---|---|---|"]
    for name, row in TABLE.items():
        known = format_of(name)
        endings = ", ".join(f"`{ending}`" for ending in row.endings.split()) or "by `format=` only"
        kept = "everything" if known.keeps_attributes else "all but further attributes"
        but = ", ".join(f"`{ending}`" for ending in known.not_written)
        written = "read only" if known.write is None else f"{kept}; {but} is read only" if but else kept
        rows.append(f"| {row.title} | `{name}` | {endings} | {known.through} | {written} |")
    return "\n".join(rows)
