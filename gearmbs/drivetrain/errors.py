"""The error of a drivetrain that cannot be built."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class DrivetrainError(ValueError):
    """A drivetrain that cannot be built or simulated; the message names the part, the value and the remedy."""


@contextmanager
def told_of(part: str) -> Iterator[None]:
    """Turn errors of what a part is made of into a `DrivetrainError` that names the part."""
    try:
        yield
    except DrivetrainError:
        raise
    except (TypeError, ValueError) as error:
        text = str(error).replace("\n", " ")
        raise DrivetrainError(text if text.startswith(part) else f"{part}: {text}") from None


def require(condition: bool, message: str) -> None:
    """Raise a DrivetrainError with the message unless the condition holds."""
    if not condition:
        raise DrivetrainError(message)
