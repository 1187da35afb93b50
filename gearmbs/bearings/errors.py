"""The error of rolling bearings."""

from __future__ import annotations


class BearingError(ValueError):
    """A bearing cannot be what is meant: a field, a name or a value is wrong; the message says what would do."""


def require(condition: bool, message: str) -> None:
    """Raise BearingError with the message unless the condition holds."""
    if not condition:
        raise BearingError(message)
