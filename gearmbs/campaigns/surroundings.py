"""What goes wrong about a worker and not in a case: other code, a file server that has lost a file, a module that is
missing.

A module may be missing to a worker, which then refuses to work, or to a case, which alone needs it. All workers of a
campaign have equal code, and with it the same packages; what is broken beside is broken for whatever a worker does. So
the case is to blame where its worker, looked at once more, carries out another one.
"""

from __future__ import annotations

import errno
import itertools
import os
import socket
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from gearmbs.campaigns.codes import OtherCode
from gearmbs.campaigns.subjects.base import DONE, FAILED, NotImportable, Outcome
from gearmbs.studies.run.code import CodeChanged
from gearmbs.studies.run.engine import Refused

if TYPE_CHECKING:
    from gearmbs.campaigns.folder import Folder

DISK = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO}
"""Errors of the disk and not of the case: they end the run, and the case is done again."""

OWN = {getattr(errno, n) for n in "ENOENT EEXIST EISDIR ENOTDIR EINVAL ENAMETOOLONG EDOM ERANGE".split()}
"""Errors of the operating system that are the case's: it asked for what is not there, or for what cannot be."""

LACKING = "Install it for all workers and retry, or leave such cases out; the worker does others without it."

MOST_TRIED = 8
"""Cases that a worker tries to find one that it can carry out. Of two options that a plan chooses among as often, all
eight have the one that lacks a module in one of 256 draws."""


class Lacking(Refused):
    """A case cannot import something, which is its own affair if the worker carries out others.

    Attributes
    ----------
    what : str
        The error.
    """

    what = ""

    @property
    def outcome(self) -> Outcome:
        """How the case has ended if it is its own affair."""
        return Outcome(FAILED, self.what[:2000], LACKING)


def refusal(error: BaseException) -> Refused | None:
    """Return the refusal of a worker whose surroundings an error comes from; None for an error of the case."""
    lasting = isinstance(error, (ImportError, NotImportable, CodeChanged, OtherCode))
    odd = isinstance(error, OSError) and error.errno is not None and error.errno not in OWN
    if not (lasting or odd):
        return refusal(error.__cause__) if error.__cause__ is not None else None
    what = f"{type(error).__name__}: {error}"
    told = f"host {socket.gethostname()}, process {os.getpid()} cannot work: {what}"
    if not isinstance(error, ImportError):
        return Refused(told, lasting)
    lacking = Lacking(told, lasting)
    lacking.what = what
    return lacking


def carries_out(
    folder: Folder, unit: int, attempt: Callable[[dict[str, Any]], Outcome], done: dict[str, Any] | None
) -> bool:
    """Return whether this process, as it is now, carries out a case of a campaign.

    Parameters
    ----------
    folder : Folder
    unit : int
        That it is at work on.
    attempt : callable
        Carries out the case of a row, and returns how it ended.
    done : dict or None
        Row of a case of the unit that it has carried out; without one, cases from all over the campaign are tried.
    """
    step = max(1, folder.unit_count // MOST_TRIED)
    elsewhere = (folder.cases(other)[0] for other in range(0, folder.unit_count, step) if other != unit)
    for row in itertools.islice(elsewhere, MOST_TRIED) if done is None else (done,):
        try:
            if attempt(row).status == DONE:
                return True
        except Lacking:
            continue
    return False
