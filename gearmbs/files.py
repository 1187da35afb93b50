"""Files that appear under their final name only when they are whole, and values as such files hold them."""

from __future__ import annotations

import os
import shutil
import tempfile
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from gearmbs.logs import logger
from gearmbs.system import rename_over

if TYPE_CHECKING:
    import pyarrow as pa


LONGEST_STEM = 40
"""Characters of a name that its temporary one shows."""


@contextmanager
def whole_file(path: str | Path, *, durable: Path | None = None) -> Iterator[Path]:
    """Yield a temporary path in the same folder; rename it to ``path`` on success, remove it on failure.

    Parameters
    ----------
    path : path-like
    durable : Path, optional
        A folder that holds it. The file then survives a power cut once this returns: it is written, brought to the
        disk, renamed, and the entries of its folders up to that one are brought to the disk, in this order, so that
        after a power cut at any moment the name stands for the former content or for all of the new one.

    Raises
    ------
    OSError
        If it cannot be written, with the name of the file to come.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # no longer than the name itself may be: names have 255 bytes at most
    part = path.with_name(f".{path.stem[:LONGEST_STEM]}.{uuid.uuid4().hex[:8]}{path.suffix}")
    try:
        yield part
        if durable is not None:
            to_disk(part)
        rename_over(part, path)
        logger("files").debug("wrote %s", path)
        if durable is not None:
            # those that are there already may have been made by a process that was killed before it came to this
            for folder in path.parents[: len(path.relative_to(durable).parts)]:
                to_disk(folder)
    except OSError as error:
        # a full disk is told without a file, anything else with one that nobody has asked for
        if error.errno is None or error.filename not in (None, str(part)):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def to_disk(path: Path) -> None:
    """Bring a file, or the entries of a folder, to the disk; folders only where the system opens them."""
    try:
        handle = os.open(path, os.O_RDWR if path.is_file() else os.O_RDONLY)
    except PermissionError:
        # Windows opens no folders, and keeps their entries itself
        if path.is_dir():
            return
        raise
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_whole(path: str | Path, content: str | bytes, *, durable: Path | None = None) -> Path:
    """Write a file as a whole and return its path; see `whole_file`."""
    with whole_file(path, durable=durable) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
    return Path(path)


# Places of results: looked at before the work; what cannot be written there after all is kept somewhere else.


T = TypeVar("T")


class KeptElsewhere(OSError):
    """A file could not be written where it was wanted; its content is in another place.

    Attributes
    ----------
    path : Path
        Where it is.
    """

    def __init__(self, message: str, path: Path) -> None:
        super().__init__(message)
        self.path = path


def keep(save: Callable[[Path], T], path: str | Path) -> T:
    """Return ``save(path)``; if that is impossible save somewhere else where it is possible.

    Raises
    ------
    KeptElsewhere
        If it had to be saved elsewhere: in the working folder or the one for temporary files.
    OSError
        If it cannot be saved anywhere.
    """
    path = Path(path)
    try:
        return save(path)
    except OSError as error:
        reason = error.strerror or str(error)
        for folder in (Path("."), Path(tempfile.gettempdir())):
            other = folder.absolute() / f"gearmbs-kept-{os.getpid()}" / path.name
            try:
                save(other)
            except OSError:
                shutil.rmtree(other.parent, ignore_errors=True)
                continue
            raise KeptElsewhere(f"{path}: cannot be written ({reason}); it is in {other} instead", other) from error
        raise OSError(error.errno, f"{path}: cannot be written ({reason}), nor anywhere else; it is lost") from error


def check_place(target: str | Path, needed: float, what: str = "the result", option: str = "--out") -> None:
    """Refuse a folder or file that cannot be written, or whose disk has not the room, before anything is computed.

    Parameters
    ----------
    target : path
        Folder or file to come; folders are not made yet.
    needed : float
        Bytes that will be written at least.
    what : str
        Named in the message.
    option : str
        Of the command line, by which another place is given.

    Raises
    ------
    OSError
        Naming the folder, why it will not do, and what would.
    """
    folder = Path(target).absolute()
    if folder.is_file():
        folder = folder.parent
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        raise NotADirectoryError(f"{target}: {folder} is a file; write elsewhere ({option})")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(
            f"{target}: {folder} cannot be written ({error.strerror or error}); write elsewhere ({option})"
        ) from None
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise OSError(
            f"{target}: {_size(free)} are free in {folder}, {what} takes about {_size(needed)}; make room or write "
            f"elsewhere ({option})"
        )


def _size(count: float) -> str:
    return f"{count / 1e6:.1f} MB" if count < 1e9 else f"{count / 1e9:.1f} GB"


def json_value(value: Any, other: Callable[[Any], Any] = str) -> Any:
    """Return a value as JSON knows it: made of tables, lists, numbers and texts.

    Parameters
    ----------
    value : object
        Tables and lists may hold others of their kind, and arrays and scalars of numpy.
    other : callable
        Turns anything else into something that JSON knows; default its text.
    """
    if isinstance(value, Mapping):
        return {str(key): json_value(item, other) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(item, other) for item in value]
    if isinstance(value, np.ndarray):
        return json_value(value.tolist(), other)
    value = python_scalar(value)
    return value if value is None or isinstance(value, str | int | float | bool) else other(value)


def python_scalar(value: Any) -> Any:
    """Return a scalar of numpy as Python's; anything else as it is."""
    return value.item() if isinstance(value, np.generic) else value


def arrow_column(values: Sequence[Any] | np.ndarray, kind: pa.DataType | None = None) -> pa.Array:
    """Return values as a column of a table of Arrow, the same as ``pyarrow.array(values, kind)``.

    That imports pandas before anything else, for which a process that only writes tables waits a third of a second; so
    columns of numbers and of texts are made of their memory.

    Parameters
    ----------
    values : sequence or ndarray
    kind : pyarrow.DataType, optional
        Default by the values.
    """
    import pyarrow as pa

    numbers = {float: (pa.float64(), np.float64), int: (pa.int64(), np.int64)}
    if isinstance(values, np.ndarray):
        for arrow, own in numbers.values():
            if values.dtype == own and values.ndim == 1 and kind in (None, arrow):
                memory = pa.py_buffer(np.ascontiguousarray(values))
                return pa.Array.from_buffers(arrow, len(values), [None, memory])
        if not (values.ndim == 1 and values.dtype.kind in "OU"):
            return pa.array(values, type=kind)
    listed = list(values) if not isinstance(values, np.ndarray) else values.tolist()
    there = [value for value in listed if value is not None]
    types = {type(value) for value in there}
    parts: list[Any] = []
    if types == {str} and kind in (None, pa.string()):
        texts = [b"" if value is None else value.encode() for value in listed]
        ends = np.cumsum([0, *map(len, texts)])
        # offsets of this kind of text have 32 bits
        if ends[-1] < 2**31:
            kind, parts = pa.string(), [ends.astype(np.int32), b"".join(texts)]
    elif len(types) == 1 and (found := numbers.get(types.pop())) and kind in (None, found[0]):
        with suppress(OverflowError):
            parts = [np.array([0 if value is None else value for value in listed], dtype=found[1])]
            kind = found[0]
    if not parts:
        return pa.array(values, type=kind)
    missing = len(there) < len(listed)
    known = pa.py_buffer(np.packbits([value is not None for value in listed], bitorder="little")) if missing else None
    return pa.Array.from_buffers(kind, len(listed), [known, *map(pa.py_buffer, parts)])
