"""The error of rolling bearings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields


class BearingError(ValueError):
    """A bearing cannot be what is meant: a field, a name or a value is wrong; the message says what would do."""


def require(condition: bool, message: str) -> None:
    """Raise BearingError with the message unless the condition holds."""
    if not condition:
        raise BearingError(message)


def require_fields(names: Iterable[str], kind: type, label: str) -> None:
    """Raise BearingError, with what is known, for a name that is no field of a dataclass."""
    known = [field.name for field in fields(kind)]
    for name in names:
        require(name in known, f"{label}: {name!r} is unknown; known ones are {', '.join(known)}")
