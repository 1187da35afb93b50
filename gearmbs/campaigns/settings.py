"""What a plan's settings may be: checked and brought into one form before a plan is made of them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeAlias

from gearmbs.schema.described import check_keys
from gearmbs.schema.quantities import Measure

# The error of campaigns.


class CampaignWarning(UserWarning):
    """Something about a campaign that its results do not suffer from, but that somebody should know."""


class CampaignError(ValueError):
    """A plan or a campaign that cannot be worked on; the message names what is wrong and the remedy."""


OPTIONS = {
    "grid": ("levels",),
    "one at a time": ("levels",),
    "factorial": ("generators",),
    "central composite": ("faced", "centre"),
    "box behnken": ("centre",),
    "morris": ("levels",),
    "list": ("rows",),
}
"""What ``options`` may hold by design, besides ``corners``."""


def check_settings(given: Mapping[str, Any], cls: type, design: str) -> dict[str, Any]:
    """Return the settings of a plan, ``cls``, in one form.

    Raises
    ------
    CampaignError
        For unknown names and values that cannot be meant.
    """
    check_keys(given, [f.name for f in dataclasses.fields(cls)], "plan", CampaignError, form="unknown setting {!r}")
    found = dict(given)
    for name in ("constraints", "reuse"):
        if name in found:
            found[name] = texts(found[name], name)
    if "reuse" in found:
        # workers may run in other folders than this process
        found["reuse"] = tuple(os.path.abspath(local(path)) for path in found["reuse"])
    for name, least in (("unit", 1), ("seed", 0)):
        if name in found and not (name == "unit" and found[name] is None):
            found[name] = whole(found[name], name, least)
    for name in ("time_limit", "wall_limit"):
        if found.get(name) is not None:
            found[name] = limit(found[name], name, "60 s")
    if found.get("memory_limit") is not None:
        found["memory_limit"] = limit(found["memory_limit"], "memory_limit", "2 GB")
    options = found.get("options", {})
    if not isinstance(options, Mapping):
        raise CampaignError(f"options = {options!r}; give a dictionary of the design's options")
    if not isinstance(options.get("faced", True), bool):
        raise CampaignError(f"options: faced = {options['faced']!r}; give true or false")
    if "centre" in options:
        options = found["options"] = {**options, "centre": whole(options["centre"], "options: centre", 0)}
    if "generators" in options:
        given = options["generators"]
        if isinstance(given, str) or not isinstance(given, Sequence) or not all(isinstance(g, str) for g in given):
            raise CampaignError(f"options: generators = {given!r}; give a list of texts such as 'D=ABC'")
    if "levels" in options:
        levels = whole(options["levels"], "options: levels", 1)
        if design == "morris" and levels % 2:
            raise CampaignError(f"options: levels = {levels}; a morris design needs an even number of them")
        found["options"] = {**options, "levels": levels}
    check_keys(options, (*OPTIONS.get(design, ()), "corners"), f"options of a {design} design", CampaignError)
    return found


def texts(value: Any, name: str) -> tuple[str, ...]:
    """Return one text or several as several."""
    if isinstance(value, str):
        return (value,)
    try:
        return tuple(str(item) for item in value)
    except TypeError:
        raise CampaignError(f"{name} = {value!r}; give a text or a list of texts") from None


def by_name(value: Any, name: str) -> dict[str, Any]:
    """Return a table, an empty one where none is given."""
    if not (value is None or isinstance(value, Mapping)):
        raise CampaignError(f"{name} = {value!r:.60}; give a table, values by their names")
    return {str(key): item for key, item in (value or {}).items()}


def whole(value: Any, name: str, least: int) -> int:
    """Return a whole number that is not below the least."""
    try:
        return Measure(low=least, whole=True).as_given(value)
    except ValueError as error:
        raise CampaignError(f"{name} = {value!r}; {error}") from None


def local(path: str | Path) -> Path:
    """Return a path, which must not be the address of an object store.

    Raises
    ------
    CampaignError
    """
    if not isinstance(path, (str, os.PathLike)):
        raise CampaignError(f"path = {path!r}; give the path of a file or folder")
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]+:/", str(path)):
        raise CampaignError(
            f"{path}: an object store cannot hold a campaign, whose files are renamed in one piece; give a folder of a "
            "disk or of a shared file system, and copy what is done to the store"
        )
    return Path(path)


def limit(value: Any, name: str, example: str) -> float:
    """Return a limit of time in seconds or of memory in bytes, given as a number or as a text with its unit."""
    try:
        return float(Measure("byte" if name == "memory_limit" else "time", above=0).as_given(value))
    except ValueError:
        raise CampaignError(f"{name} = {value!r}; give a positive number or text such as {example!r}") from None


# One content identity for everything that is simulated: equal physics, equal text, equal key.
#
# A canonical form is a tree of dictionaries, lists, numbers, texts and truth values in SI with all defaults filled in
# and no names. Numbers are rounded to twelve digits, since the same quantity written in two units may differ in the
# last bit; minus zero is zero; tuples are lists. The key is the SHA-256 of that tree as JSON with sorted keys, of the
# kind of subject and of the code that simulates it.


DIGITS = 12

Tree: TypeAlias = "bool | int | float | str | list[Tree] | dict[str, Tree] | None"
"""A canonical form."""


def rounded(value: float) -> float:
    """Return a number to twelve significant digits, minus zero as zero."""
    number = float(value)
    if not math.isfinite(number):
        return number
    return float(f"{number:.{DIGITS - 1}e}") + 0.0


def canonical(value: Any) -> Tree:
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


def content_key(kind: str, tree: Any, code: str = "") -> str:
    """Return the key of a canonical tree: 64 hexadecimal digits.

    Parameters
    ----------
    kind : str
        Name of the subject, as "pair".
    tree
        Anything `canonical` understands.
    code : str
        Digest of what simulates it, see `gearmbs.studies.run.code`; without it the key is that of the content alone.
    """
    text = json.dumps({"kind": kind, "code": code, "content": canonical(tree)}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
