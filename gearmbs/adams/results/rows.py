"""Constraint rows in the words of ADAMS's message files."""

from __future__ import annotations

import re

from gearmbs.adams.builders.model import AdamsModel
from gearmbs.adams.parse import statements as st

TYPES = {st.Joint: "Joint", st.Jprim: "Primitive Joint", st.Motion: "Motion"}
PATTERNS = (
    (re.compile(r"coincident (\w)"), "Translation of I Marker Along {0}g"),
    (re.compile(r"no offset along (\w)_J"), "Translation of I Marker Along {0}j"),
    (re.compile(r"(\w)_I normal to (\w)_J"), "Rotation Between {0}i & {1}j"),
    (re.compile(r"angle"), "Rotation About Zj"),
    (re.compile(r"displacement"), "Translation Along Zj"),
)


def row_text(model: AdamsModel, name: str) -> str:
    """Return a row, named ``joint: what it enforces``, as ADAMS names it: element, its type, its motion."""
    element, _, label = name.rpartition(": ")
    statement = model.sources.get(element)
    where = element
    if statement is not None:
        kind = getattr(statement, "type", None) or ""
        words = f"{str(kind).title()} {TYPES.get(type(statement), '')}".strip()
        where = f"{statement.label()} {element}" + (f" ({words})" if words else "")
    for pattern, text in PATTERNS:
        found = pattern.fullmatch(label)
        if found is not None:
            return f"{where}    {text.format(*(axis.upper() for axis in found.groups()))}"
    return f"{where}    {label}"
