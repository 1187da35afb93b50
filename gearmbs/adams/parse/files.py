"""Which files a deck, a script or a command file may name: those of its folder, and of folders that the caller adds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

LONGEST_NAME = 400
"""Characters of a file's name that a message shows: whole paths of real files."""
_ADDED: ContextVar[tuple[Path, ...]] = ContextVar("added", default=())


@contextmanager
def reading_from(*folders: str | Path) -> Iterator[None]:
    """Let decks, scripts and command files read files of these folders, too, besides their own.

    Parameters
    ----------
    *folders : str or Path
        What is below them may be read as well.
    """
    before = _ADDED.set((*_ADDED.get(), *(Path(folder).resolve() for folder in folders)))
    try:
        yield
    finally:
        _ADDED.reset(before)


def named_file(word: str, name: str, file: str | Path) -> Path:
    """Return the path of a file that another one names in an argument.

    Raises
    ------
    ValueError
        If it is neither in that one's folder, or below it, nor in a folder that was added.
    """
    home = Path(file).parent
    path = home / name.replace("\\", "/")
    if not any(folder in path.resolve().parents for folder in (home.resolve(), *_ADDED.get())):
        raise ValueError(
            f"{word} = {name[:LONGEST_NAME]} is outside the folder of {Path(file).name}; copy it there, or allow its "
            "folder with --read-from, in Python with gearmbs.adams.reading_from"
        )
    return path
