"""Locks among processes that keep kernels in the same folder."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from gearmbs.system import WINDOWS, lock


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """Hold a lock that stands at a path; where there are no locks or the path cannot be written, go on without."""
    try:
        stream = _locked(path)
    except OSError:
        # two processes may then compile the same; both results are right
        stream = None
    try:
        yield
    finally:
        if stream is not None:
            # removed while it is held: who waits for it will see that it is gone
            with contextlib.suppress(OSError):
                path.unlink()
            stream.close()
            if WINDOWS:
                # where a file that is open is not removed
                with contextlib.suppress(OSError):
                    path.unlink()


def _locked(path: Path) -> IO:
    """Return a file, held by this process alone, that stands at a path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    while True:
        with contextlib.ExitStack() as unless_held:
            stream = unless_held.enter_context(open(path, "wb"))
            lock(stream)
            # its last holder may have removed it meanwhile; what is locked then is a file that nobody else finds
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(stream.fileno()), path.stat()):
                    unless_held.pop_all()
                    return stream
