"""One content identity for everything that is simulated: equal physics, equal text, equal key.

A canonical form is a tree of dictionaries, lists, numbers, texts and truth values in SI with all defaults filled in
and no names. Numbers are rounded to twelve digits, since the same quantity written in two units may differ in the last
bit; minus zero is zero; tuples are lists. The key is the SHA-256 of that tree as JSON with sorted keys, of the kind of
subject and of `PHYSICS`.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

from gearmbs.campaigns.errors import CampaignError

PHYSICS = 1
"""Counted up by whoever changes what a simulation returns for the same case, so that no stored result is taken for
one of the new code. A test holds stored numbers against this code and asks for it."""

DIGITS = 12


def rounded(value: float) -> float:
    """Return a number to twelve significant digits, minus zero as zero."""
    number = float(value)
    if not math.isfinite(number):
        return number
    return float(f"{number:.{DIGITS - 1}e}") + 0.0


def canonical(value: Any) -> Any:
    """Return a value as a canonical tree.

    Raises
    ------
    CampaignError
        For a value that is none of dictionary, sequence, number, text, truth value or None.

    Examples
    --------
    >>> canonical({"b": (1, -0.0), "a": 1000 * 0.1})
    {'a': 100.0, 'b': [1, 0.0]}
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, Mapping):
        return {str(key): canonical(value[key]) for key in sorted(value, key=str)}
    if isinstance(value, (list, tuple)):
        return [canonical(item) for item in value]
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return rounded(float(value))
    if hasattr(value, "tolist"):
        return canonical(value.tolist())
    raise CampaignError(f"{value!r} of type {type(value).__name__} has no canonical form; give numbers and texts")


def content_key(kind: str, tree: Any) -> str:
    """Return the key of a canonical tree: 64 hexadecimal digits.

    Parameters
    ----------
    kind : str
        Name of the subject, as "pair".
    tree
        Anything `canonical` understands.
    """
    text = json.dumps(
        {"kind": kind, "physics": PHYSICS, "content": canonical(tree)}, sort_keys=True, separators=(",", ":")
    )
    return hashlib.sha256(text.encode()).hexdigest()
