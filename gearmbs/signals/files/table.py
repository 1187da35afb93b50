"""The table of the formats of recordings, a row and a module each, and what such a module says of a format.

Reading, writing, `gearmbs.save`, the checks of contents, messages, the help of the command line and the documentation
follow from it. It is light: a module is loaded when files are read or written, not when its row is.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from gearmbs.signals.signal.record import Progress, Record


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
    "netcdf": Row("NetCDF", "arrays", ".nc .nc4 .cdf"),
    "hdf5": Row("HDF5", "arrays", ".h5 .hdf5 .hdf"),
    "tdms": Row("TDMS", "labview", ".tdms"),
    "mdf": Row("MDF", "mdf", ".mf4 .mdf"),
    "npy": Row("numpy", "arrays", ".npy .npz"),
    "parquet": Row("Parquet", "frames", ".parquet .pq"),
    "feather": Row("Feather", "frames", ".feather"),
    "lvm": Row("LabVIEW", "labview", ".lvm"),
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


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What a caller wants of a file, and what its first bytes say it holds.

    Parameters
    ----------
    content : str
        Name of the `Content` found in the file.
    channels : sequence of str, optional
        Only these channels; formats that are read as a whole may leave the choice to the caller.
    rate : float, optional
        Known sampling rate in Hz.
    gaps : str, optional
        "refuse", "interpolate" or "longest"; see `read_signal`.
    progress : callable, optional
        Called as progress(fraction, "reading").
    pulses : bool
        Whether columns hold times of pulses: then one that rises evenly is no time of the others.
    """

    content: str
    channels: Sequence[str] | None = None
    rate: float | None = None
    gaps: str | None = None
    progress: Progress | None = None
    pulses: bool = False


@dataclass(frozen=True)
class Content:
    """One kind of bytes that files hold, told by how they begin.

    Parameters
    ----------
    words : str
        What messages call it: the file "holds a WAV file".
    begins : callable
        Whether the first 4096 bytes of a file are of this kind.
    tells : bool
        Whether a file of an unknown ending that begins so is taken for one of this format.
    rest : bool
        Asked only where no other kind fits, as any bytes may be text.
    """

    words: str
    begins: Callable[[bytes], bool]
    tells: bool = True
    rest: bool = False


@dataclass(frozen=True, kw_only=True)
class Format:
    """One format of files with recordings.

    Parameters
    ----------
    read : callable
        ``read(path, asked)`` returns the record of a file. Whatever it raises is reported as damage to the file.
    write : callable, optional
        ``write(record, path, progress)``; without it files are only read.
    pieces : callable, optional
        ``pieces(path, asked)`` yields records in the order of the file, each with the fraction read by then, or
        returns None for files that are read as a whole, as all are without it.
    contents : mapping of str to Content
        Kinds of bytes that are this format's own, by name.
    also : tuple of str
        Kinds of other formats that files of this name may hold, too.
    not_written : mapping of str to str
        Endings that are read but not written, and what to say of it.
    through : str
        The library that does the work, for the documentation.
    keeps_attributes : bool
        Whether attributes other than samples, names, units, rate, start, speed and teeth are read back as written.
    """

    read: Callable[[Path, Asked], Record]
    write: Callable[[Record, Path, Progress | None], None] | None = None
    pieces: Callable[[Path, Asked], Iterator[tuple[Record, float]] | None] | None = None
    contents: Mapping[str, Content] = field(default_factory=dict)
    also: tuple[str, ...] = ()
    not_written: Mapping[str, str] = field(default_factory=dict)
    through: str
    keeps_attributes: bool = True

    def accepts(self, content: str) -> bool:
        """Return whether a file named as of this format may hold this kind of bytes."""
        return content in self.contents or content in self.also


def begins_with(*starts: bytes) -> Callable[[bytes], bool]:
    """Return a test for bytes that begin with one of these."""
    return lambda head: head.startswith(starts)
