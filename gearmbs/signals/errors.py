"""Errors of the signals package: what is wrong, where, and what to do about it."""

from __future__ import annotations

from pathlib import Path


class SignalError(ValueError):
    """A signal or a parameter that an operation cannot work with."""


class MissingMetadataError(SignalError):
    """A quantity the operation needs is neither in the signal nor in the call.

    Parameters
    ----------
    name : str
        Name of the missing quantity, which is also the keyword to pass it by.
    needed_for : str
        What needs it.
    remedy : str
        What to do.
    """

    def __init__(self, name: str, needed_for: str, remedy: str) -> None:
        self.name = name
        super().__init__(f"{name} is missing: {needed_for} needs it; {remedy}")


class SignalFileError(SignalError):
    """A file that cannot be read as a signal; names the file and the fault.

    Parameters
    ----------
    path : path-like
        The file.
    fault : str
        What is wrong with it and what to do.
    """

    def __init__(self, path: str | Path, fault: str) -> None:
        # other packages' messages that are quoted may have several lines
        fault = " ".join(line.strip() for line in str(fault).splitlines() if line.strip())
        self.path = Path(path)
        self.fault = fault
        super().__init__(f"{path}: {fault}")
