"""Results that cannot be written where they were wanted are kept somewhere else, and the message says where."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

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
