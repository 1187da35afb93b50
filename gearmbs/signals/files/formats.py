"""Signals in and out of files: formats are chosen by name and checked by content; `table` lists them."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr

from gearmbs.files import LONGEST_STEM
from gearmbs.logs import logger
from gearmbs.progress import staged
from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.files.csv import CUT
from gearmbs.signals.files.table import TABLE, Asked, Content, format_of, known_endings
from gearmbs.signals.signal.given import contradictions, given_rate, given_speed, is_curve, with_speed
from gearmbs.signals.signal.record import Progress, Record, checked_gaps, columns_asked, record_of, signal_from
from gearmbs.signals.signal.signal import as_signal
from gearmbs.signals.signal.units import check_units
from gearmbs.system import rename_over, umask
from gearmbs.wording import warn

FORMATS = tuple(TABLE)
"""Names of the formats that are read; most are written, too (`gearmbs.signals.files.table`)."""
HEAD_BYTES = 4096
"""Bytes at the begin of a file by which its content is told."""


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
    """Read a signal from a file of any of the `FORMATS`.

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
        record = format_of(format).read(
            path, Asked(content=content, channels=columns_asked(channels), rate=hertz, gaps=gaps, progress=progress)
        )
    for words in record.notes:
        if words.startswith(CUT):
            warn(words, UserWarning)
    for words in contradictions(record.teeth, record.speed, teeth, constant, path.name):
        record.notes = [*record.notes, words]
    with damage_named(path, format):
        signal = signal_from(
            record, path, rate=hertz, units=units, speed=constant, teeth=teeth, channels=channels, gaps=gaps
        )
    sizes = signal.sizes
    logger("signals").debug("read %s as %s: %d channels of %d samples", path, format, sizes["channel"], sizes["time"])
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

    A speed or angle over time (`with_speed`) stands beside the channels as a column "speed over time" (rad/s) or "angle
    over time" (rad), of which `read_signal` makes the coordinate again.

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
    return write_record(record_of(as_signal(signal)), Path(path), format, progress)


def write_record(record: Record, path: Path, format: str | None = None, progress: Progress | None = None) -> Path:
    """Write a record as `write_signal` does a signal; samples that are missing are NaN."""
    format = _format(path, format)
    known = format_of(format)
    if known.write is None:
        raise SignalFileError(
            path, f"{format} files are read, not written; write one of {', '.join(written_endings())}"
        )
    if path.suffix.lower() in known.not_written:
        raise SignalFileError(path, known.not_written[path.suffix.lower()])
    if not path.parent.is_dir():
        raise SignalFileError(path, f"there is no folder {path.parent}; make it first")
    handle, name = tempfile.mkstemp(prefix=f".{path.stem[:LONGEST_STEM]}.", suffix=".part", dir=path.parent)
    os.close(handle)
    part = Path(name)
    try:
        known.write(record, part, progress)
        part.chmod(0o666 & ~umask())
        rename_over(part, path)
        logger("files").debug("wrote %s", path)
    except SignalFileError as exc:
        raise SignalFileError(path, exc.fault) from exc
    finally:
        part.unlink(missing_ok=True)
    return path


def written_endings() -> tuple[str, ...]:
    """Return the endings that `write_signal` takes."""
    known = {name: format_of(name) for name in TABLE}
    return tuple(
        ending
        for ending, name in known_endings().items()
        if known[name].write is not None and ending not in known[name].not_written
    )


def checked_format(path: Path, format: str | None) -> tuple[str, str]:
    """The format a file's name or the caller says, and what the file holds; SignalFileError if they do not agree."""
    content = _content(path)
    format = _format(path, format, content)
    if not format_of(format).accepts(content):
        fits = [name for name in TABLE if format_of(name).accepts(content)]
        given = " or ".join(f"format={name!r}" for name in fits) or f"format=... (one of {', '.join(TABLE)})"
        raise SignalFileError(path, f"is named as {format} but holds {_words(content)}; rename it or pass {given}")
    return format, content


def _contents() -> dict[str, tuple[str, Content]]:
    """Return the kinds of bytes that formats know, each with the format whose own it is."""
    return {content: (name, about) for name in TABLE for content, about in format_of(name).contents.items()}


def _words(content: str) -> str:
    found = _contents().get(content)
    return "binary data of an unknown kind" if found is None else found[1].words


def _format(path: Path, format: str | None, content: str | None = None) -> str:
    if format is not None:
        if format not in TABLE:
            raise SignalError(f"format: must be one of {', '.join(TABLE)}, got {format!r}")
        return format
    suffixes = [s.lower() for s in path.suffixes]
    endings = known_endings()
    for suffix in ("".join(suffixes[-2:]), "".join(suffixes[-1:])):
        if suffix in endings:
            return endings[suffix]
    if content is not None:
        name, about = _contents().get(content, (None, None))
        if name is not None and about is not None and about.tells:
            return name
    raise SignalFileError(
        path, f"its ending {path.suffix!r} determines no format; use one of {', '.join(endings)} or pass format=..."
    )


def format_to_write(path: Path) -> str:
    """Return the format that the ending of a file stands for; SignalFileError of one that stands for none."""
    return _format(path, None)


def _content(path: Path) -> str:
    """Return what the first bytes are, whatever the name says."""
    try:
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as exc:
        raise SignalFileError(path, f"cannot be opened ({exc.strerror})") from exc
    if not head:
        raise SignalFileError(path, "is empty")
    kinds = {content: about for content, (_, about) in _contents().items()}
    for content in sorted(kinds, key=lambda content: kinds[content].rest):
        if kinds[content].begins(head):
            return content
    return "binary"
