"""Signals in and out of files: one reader and one writer for every format, chosen by name and checked by content."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import xarray as xr

from .errors import SignalError, SignalFileError
from .io_csv import read_csv, write_csv
from .io_hdf import read_hdf, read_netcdf3, write_netcdf
from .io_mat import read_mat, write_mat
from .io_tdms import read_tdms, write_tdms
from .io_uff import read_uff, write_uff
from .io_wav import read_wav, write_wav
from .record import Progress, Record, record_of, signal_from
from .signal import as_signal

FORMATS = ("csv", "csv.gz", "mat5", "mat7.3", "uff58", "wav", "netcdf", "hdf5", "tdms")
"""Formats of files that are read and written."""
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
}
# Which contents a name may stand for: version 7.3 of .mat is HDF5, and so is NetCDF-4.
ACCEPTED = {
    "csv": {"text"},
    "csv.gz": {"gzip"},
    "mat5": {"mat5", "hdf5"},
    "mat7.3": {"hdf5"},
    "uff58": {"uff58"},
    "wav": {"wav"},
    "netcdf": {"hdf5", "netcdf3"},
    "hdf5": {"hdf5"},
    "tdms": {"tdms"},
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
    "utf16": "text in UTF-16 (save it as UTF-8)",
    "binary": "binary data of an unknown kind",
}
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
HEAD_BYTES = 4096


def read_signal(
    path: str | Path,
    *,
    rate: float | None = None,
    units: str | Sequence[str] | Mapping[str, str] | None = None,
    speed: float | None = None,
    teeth: int | Sequence[int] | None = None,
    channels: Sequence[str] | None = None,
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
        Units of the channels; wins over the file's.
    speed, teeth : optional
        Speed in rad/s and tooth counts; win over the file's.
    channels : sequence of str, optional
        Only these channels.
    format : str, optional
        One of `FORMATS`, for files with other names.
    progress : callable, optional
        Called as progress(fraction, "reading") where reading takes a while.

    Returns
    -------
    xarray.DataArray
        Dimensions (time, channel); see `gearmbs.signals.signal`.

    Raises
    ------
    SignalFileError
        If the file is missing, empty, damaged, holds another format than its name says, or has no such channel.
    MissingMetadataError
        If the sampling rate is known neither to the file nor to the caller.
    """
    path = Path(path)
    format, content = checked_format(path, format)
    record = _read(path, format, content, channels, progress, rate)
    return signal_from(record, path, rate=rate, units=units, speed=speed, teeth=teeth, channels=channels)


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


def checked_format(path: Path, format: str | None) -> tuple[str, str]:
    """The format a file's name or the caller says, and what the file holds; SignalFileError if they do not agree."""
    format = _format(path, format)
    content = _content(path)
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
) -> Record:
    if format in ("csv", "csv.gz"):
        return read_csv(path, format == "csv.gz", progress, rate)
    if format in ("mat5", "mat7.3"):
        return read_mat(path, channels)
    if format == "uff58":
        return read_uff(path, channels)
    if format == "wav":
        return read_wav(path)
    if format == "tdms":
        return read_tdms(path, channels)
    return read_netcdf3(path, channels) if content == "netcdf3" else read_hdf(path, channels)


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
    else:
        write_netcdf(record, part)


def _format(path: Path, format: str | None) -> str:
    if format is not None:
        if format not in FORMATS:
            raise SignalError(f"format: must be one of {', '.join(FORMATS)}, got {format!r}")
        return format
    suffixes = [s.lower() for s in path.suffixes]
    for suffix in ("".join(suffixes[-2:]), "".join(suffixes[-1:])):
        if suffix in SUFFIXES:
            return SUFFIXES[suffix]
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
    if head.lstrip().startswith(b"-1\n") or head.lstrip().startswith(b"-1\r"):
        return "uff58"
    # A MATLAB 7.3 header in front of nothing is a cut-off file, still one of HDF5's kind.
    if head.startswith(b"MATLAB 7.3"):
        return "hdf5"
    text = head.decode("utf-8", errors="replace")
    odd = sum(1 for c in text if (ord(c) < 32 and c not in "\t\r\n\f\x1a") or c == "\ufffd")
    return "binary" if "\x00" in text or odd > 0.05 * len(text) else "text"
