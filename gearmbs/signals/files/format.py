"""What a module says of a format of files: how it is told, read and written, and what it keeps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gearmbs.signals.signal.record import Progress, Record


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
    """

    content: str
    channels: Sequence[str] | None = None
    rate: float | None = None
    gaps: str | None = None
    progress: Progress | None = None


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
