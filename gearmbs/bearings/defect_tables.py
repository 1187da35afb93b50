"""Defects as they are given: objects, or tables of files with a kind and its fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gearmbs.bearings.defects import DEFECTS, Defect
from gearmbs.bearings.errors import BearingError, require_fields


def as_defects(given: Any) -> tuple[Defect, ...]:
    """Return defects given as one or several objects or tables.

    Parameters
    ----------
    given : Defect, mapping, or sequence of them
        A table has the ``kind`` of `gearmbs.bearings.DEFECTS` and the fields of its class.

    Raises
    ------
    BearingError
        For anything else, an unknown kind, and fields that a kind does not have.

    Examples
    --------
    >>> as_defects({"kind": "spall", "part": "inner", "width": "2 mm"})
    (Spall(part='inner', width='2 mm', edge=0.0001),)
    """
    single = not isinstance(given, Sequence) or isinstance(given, str)
    return tuple(_one(item) for item in ((given,) if single else given))


def _one(given: Any) -> Defect:
    if isinstance(given, Defect):
        return given
    if not isinstance(given, Mapping):
        raise BearingError(f"defects holds {given!r}; give defects of gearmbs.bearings, or tables with their kind")
    fields = dict(given)
    kind = str(fields.pop("kind", ""))
    if kind not in DEFECTS:
        raise BearingError(f"defects: kind {kind!r} is unknown; choose one of {', '.join(DEFECTS)}")
    require_fields(fields, DEFECTS[kind], f"defects: {kind}")
    try:
        return DEFECTS[kind](**fields)
    except TypeError as error:
        raise BearingError(f"defects: {kind}: {error}") from None
