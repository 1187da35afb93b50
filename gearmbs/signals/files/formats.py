"""Signals in and out of files: one reader and one writer for every format, chosen by name and checked by content."""

from __future__ import annotations

import os
import re
import struct
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr

from gearmbs.progress import staged
from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.files.arrays import read_npy, write_npy
from gearmbs.signals.files.csv import CUT, read_csv, write_csv
from gearmbs.signals.files.frames import read_parquet, write_parquet
from gearmbs.signals.files.hdf import read_hdf, read_netcdf3, write_netcdf
from gearmbs.signals.files.lvm import read_lvm
from gearmbs.signals.files.matlab import read_mat, write_mat
from gearmbs.signals.files.tdms import read_tdms, write_tdms
from gearmbs.signals.files.uff import read_uff, write_uff
from gearmbs.signals.files.wav import read_wav, write_wav
from gearmbs.signals.signal.given import contradictions, given_rate, given_speed, is_curve, with_speed
from gearmbs.signals.signal.record import Progress, Record, checked_gaps, record_of, signal_from
from gearmbs.signals.signal.signal import as_signal, check_units

FORMATS = (
    "csv",
    "csv.gz",
    "mat5",
    "mat7.3",
    "uff58",
    "wav",
    "netcdf",
    "hdf5",
    "tdms",
    "npy",
    "parquet",
    "feather",
    "lvm",
)
"""Formats of files that are read; all but feather and lvm are written, too, npy as .npz."""
READ_ONLY = ("feather", "lvm")
SUFFIXES = {
    ".csv": "csv",
    ".txt": "csv",
    ".tsv": "csv",
    ".dat": "csv",
    ".csv.gz": "csv.gz",
    ".txt.gz": "csv.gz",
    ".tsv.gz": "csv.gz",
    ".mat": "mat5",
    ".uff": "uff58",
    ".unv": "uff58",
    ".uf": "uff58",
    ".wav": "wav",
    ".nc": "netcdf",
    ".nc4": "netcdf",
    ".cdf": "netcdf",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".hdf": "hdf5",
    ".tdms": "tdms",
    ".npy": "npy",
    ".npz": "npy",
    ".parquet": "parquet",
    ".pq": "parquet",
    ".feather": "feather",
    ".lvm": "lvm",
    ".asc": "csv",
    ".prn": "csv",
}
# Which contents a name may stand for: version 7.3 of .mat is HDF5, and so is NetCDF-4.
ACCEPTED = {
    "csv": {"text", "utf16", "lvm"},
    "csv.gz": {"gzip"},
    "mat5": {"mat5", "hdf5", "mat4"},
    "mat7.3": {"hdf5"},
    "uff58": {"uff58"},
    "wav": {"wav"},
    "netcdf": {"hdf5", "netcdf3"},
    "hdf5": {"hdf5"},
    "tdms": {"tdms"},
    "npy": {"npy", "zip"},
    "parquet": {"parquet"},
    "feather": {"feather"},
    "lvm": {"lvm", "text", "utf16"},
}
CONTENT_NAMES = {
    "text": "plain text",
    "gzip": "gzip data",
    "mat5": "a MATLAB 5 file",
    "hdf5": "HDF5",
    "uff58": "a universal file",
    "wav": "a WAV file",
    "netcdf3": "classic NetCDF",
    "tdms": "a TDMS file",
    "utf16": "text in UTF-16",
    "npy": "an array of numpy",
    "zip": "a zip archive, as .npz files are",
    "parquet": "Parquet",
    "feather": "Feather",
    "lvm": "a LabVIEW measurement",
    "mat4": "a MATLAB 4 file",
    "binary": "binary data of an unknown kind",
}
BY_CONTENT = {
    "text": "csv", "gzip": "csv.gz", "mat5": "mat5", "hdf5": "hdf5", "uff58": "uff58", "wav": "wav",
    "netcdf3": "netcdf", "tdms": "tdms", "npy": "npy", "parquet": "parquet", "lvm": "lvm", "utf16": "csv",
}  # fmt: skip
"""Formats of files whose names end in something else, as many recorders' do."""
UFF_START = re.compile(rb"^\s*-1[ \t]*\r?\n[ \t]*\d+[a-z]?\b")
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
HEAD_BYTES = 4096


@staged("reading")
def read_signal(
    path: str | Path,
    *,
    rate: float | str | None = None,
    units: str | Sequence[str] | Mapping[str, str] | None = None,
    speed: Any = None,
    teeth: int | Sequence[int] | None = None,
    channels: Sequence[str] | None = None,
    gaps: str | None = None,
    format: str | None = None,
    progress: Progress | None = None,
) -> xr.DataArray:
    """Read a signal from a CSV, gzip CSV, MATLAB (5 to 7.3), UFF 58, WAV, NetCDF, HDF5 or TDMS file.

    Parameters
    ----------
    path : path-like
        The file; its format follows from its name and is checked against its content.
    rate : float, optional
        Sampling rate in Hz, needed if the file does not say. If both do, they must agree. It also stands in for the
        times of a text file that are so rounded that they look uneven.
    units : str, sequence or mapping, optional
        Units of the channels; wins over the file's. A mapping leaves channels that it does not name their own.
    speed, teeth : optional
        Speed in rad/s and tooth counts; win over the file's.
    channels : sequence of str, optional
        Only these channels.
    gaps : {"refuse", "interpolate", "longest"}, optional
        What to do with samples that are missing or not finite: an error, straight lines across them, or the longest
        stretch without any.
    format : str, optional
        One of `FORMATS`, for files with other names.
    progress : callable, optional
        Called as progress(fraction, "reading") where reading takes a while.

    Returns
    -------
    xarray.DataArray
        Dimensions (time, channel); see `gearmbs.signals.signal.signal`.

    Raises
    ------
    SignalFileError
        If the file is missing, empty, damaged, holds another format than its name says, or has no such channel.
    MissingMetadataError
        If the sampling rate is known neither to the file nor to the caller.
    """
    path = Path(path)
    hertz, constant = given_rate(rate), given_speed(speed)
    check_units(units)
    checked_gaps(gaps)
    format, content = checked_format(path, format)
    with damage_named(path, format):
        record = _read(path, format, content, channels, progress, hertz, gaps)
    for words in record.notes:
        if words.startswith(CUT):
            warnings.warn(words, UserWarning, stacklevel=3)
    for words in contradictions(record.teeth, record.speed, teeth, constant, path.name):
        record.notes = [*record.notes, words]
    with damage_named(path, format):
        signal = signal_from(
            record, path, rate=hertz, units=units, speed=constant, teeth=teeth, channels=channels, gaps=gaps
        )
    return with_speed(signal, speed) if is_curve(speed) else signal


@contextmanager
def damage_named(path: Path, format: str) -> Iterator[None]:
    """Keep other packages' warnings to themselves, and turn whatever fails while reading into an error of this one."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (SignalError, MemoryError):
        raise
    except Exception as exc:
        said = " ".join(str(exc).split())[:200]
        raise SignalFileError(
            path,
            f"cannot be read as {format}: it is damaged, or of an unknown dialect ({type(exc).__name__}: {said})",
        ) from exc


@staged("writing")
def write_signal(
    signal: xr.DataArray | xr.Dataset, path: str | Path, *, format: str | None = None, progress: Progress | None = None
) -> Path:
    """Write a signal so that samples, rate, units, speed and tooth counts read back the same.

    The file appears under its name only when it is complete.

    Parameters
    ----------
    signal : xarray.DataArray or xarray.Dataset
        See `as_signal`.
    path : path-like
        Where to.
    format : str, optional
        One of `FORMATS`; default by the name (".mat" means version 5).
    progress : callable, optional
        Called as progress(fraction, "writing").

    Returns
    -------
    pathlib.Path

    Raises
    ------
    SignalFileError
        If the format cannot hold the signal or the folder is missing.
    """
    path = Path(path)
    format = _format(path, format)
    if format in READ_ONLY:
        raise SignalFileError(path, f"{format} files are read, not written; write for instance .csv, .mat or .tdms")
    if format == "npy" and path.suffix.lower() == ".npy":
        raise SignalFileError(path, "an .npy file holds one array without rate and units; write .npz, which holds all")
    record = record_of(as_signal(signal))
    if not path.parent.is_dir():
        raise SignalFileError(path, f"there is no folder {path.parent}; make it first")
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    os.close(handle)
    part = Path(name)
    try:
        _write(record, part, format, progress)
        mask = os.umask(0)
        os.umask(mask)
        part.chmod(0o666 & ~mask)
        part.replace(path)
    except SignalFileError as exc:
        raise SignalFileError(path, exc.fault) from exc
    finally:
        part.unlink(missing_ok=True)
    return path


def written_endings() -> tuple[str, ...]:
    """Return the endings that `write_signal` takes."""
    return tuple(e for e, format in SUFFIXES.items() if format not in READ_ONLY and e != ".npy")


def checked_format(path: Path, format: str | None) -> tuple[str, str]:
    """The format a file's name or the caller says, and what the file holds; SignalFileError if they do not agree."""
    content = _content(path)
    format = _format(path, format, content)
    if content not in ACCEPTED[format]:
        raise SignalFileError(
            path,
            f"is named as {format} but holds {CONTENT_NAMES[content]}; rename it or pass format=... "
            f"(one of {', '.join(FORMATS)})",
        )
    return format, content


def _read(
    path: Path,
    format: str,
    content: str,
    channels: Sequence[str] | None,
    progress: Progress | None,
    rate: float | None,
    gaps: str | None = None,
) -> Record:
    if content == "lvm" or format == "lvm":
        return read_lvm(path, rate)
    if format in ("csv", "csv.gz"):
        return read_csv(path, format == "csv.gz", progress, rate, gaps)
    if format in ("mat5", "mat7.3"):
        return read_mat(path, channels, rate)
    if format == "uff58":
        return read_uff(path, channels)
    if format == "wav":
        return read_wav(path)
    if format == "tdms":
        return read_tdms(path, channels, rate)
    if format == "npy":
        return read_npy(path, channels, rate)
    if format in ("parquet", "feather"):
        return read_parquet(path, format, rate)
    return read_netcdf3(path, channels, rate) if content == "netcdf3" else read_hdf(path, channels, rate)


def _write(record: Record, part: Path, format: str, progress: Progress | None) -> None:
    if format in ("csv", "csv.gz"):
        write_csv(record, part, format == "csv.gz", progress)
    elif format in ("mat5", "mat7.3"):
        write_mat(record, part, format)
    elif format == "uff58":
        write_uff(record, part)
    elif format == "wav":
        write_wav(record, part)
    elif format == "tdms":
        write_tdms(record, part)
    elif format == "npy":
        write_npy(record, part)
    elif format == "parquet":
        write_parquet(record, part)
    else:
        write_netcdf(record, part)


def _format(path: Path, format: str | None, content: str | None = None) -> str:
    if format is not None:
        if format not in FORMATS:
            raise SignalError(f"format: must be one of {', '.join(FORMATS)}, got {format!r}")
        return format
    suffixes = [s.lower() for s in path.suffixes]
    for suffix in ("".join(suffixes[-2:]), "".join(suffixes[-1:])):
        if suffix in SUFFIXES:
            return SUFFIXES[suffix]
    if content in BY_CONTENT:
        return BY_CONTENT[content]
    raise SignalFileError(
        path, f"its ending {path.suffix!r} determines no format; use one of {', '.join(SUFFIXES)} or pass format=..."
    )


def _content(path: Path) -> str:
    """What the first bytes are, whatever the name says."""
    try:
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as exc:
        raise SignalFileError(path, f"cannot be opened ({exc.strerror})") from exc
    if not head:
        raise SignalFileError(path, "is empty")
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf16"
    if head.startswith(b"\x1f\x8b"):
        return "gzip"
    if head.startswith(HDF5_MAGIC) or head[512:520] == HDF5_MAGIC:
        return "hdf5"
    if head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE":
        return "wav"
    if head.startswith(b"TDSm"):
        return "tdms"
    if head.startswith((b"CDF\x01", b"CDF\x02", b"CDF\x05")):
        return "netcdf3"
    if head.startswith(b"MATLAB 5.0"):
        return "mat5"
    if UFF_START.match(head.removeprefix(b"\xef\xbb\xbf")):
        return "uff58"
    if head.startswith(b"\x93NUMPY"):
        return "npy"
    if head.startswith(b"PK\x03\x04"):
        return "zip"
    if head.startswith(b"PAR1"):
        return "parquet"
    if head.startswith((b"ARROW1", b"FEA1")):
        return "feather"
    if head.removeprefix(b"\xef\xbb\xbf").startswith(b"LabVIEW Measurement"):
        return "lvm"
    if _is_mat4(head):
        return "mat4"
    # A MATLAB 7.3 header in front of nothing is a cut-off file, still one of HDF5's kind.
    if head.startswith(b"MATLAB 7.3"):
        return "hdf5"
    text = head.decode("utf-8", errors="replace")
    odd = sum(1 for c in text if (ord(c) < 32 and c not in "\t\r\n\f\x1a") or c == "\ufffd")
    return "binary" if "\x00" in text or odd > 0.05 * len(text) else "text"


def _is_mat4(head: bytes) -> bool:
    """True for the header of a MATLAB 4 matrix: type, rows, columns, imaginary flag and length of the name."""
    if len(head) < 21:
        return False
    for order in ("<", ">"):
        kind, rows, columns, imaginary, letters = struct.unpack(f"{order}5i", head[:20])
        sane = 0 <= kind < 5000 and kind % 10 <= 2 and (kind // 10) % 10 <= 5 and imaginary in (0, 1)
        if sane and 0 < rows < 1 << 30 and 0 < columns < 1 << 30 and 1 < letters < 64:
            name = head[20 : 20 + letters - 1]
            if name[:1].isalpha() and name.replace(b"_", b"").isalnum():
                return True
    return False
