"""What a plan's settings may be: checked and brought into one form before a plan is made of them."""

from __future__ import annotations

import dataclasses
import difflib
import math
import os
from collections.abc import Iterable, Mapping
from typing import Any

from gearmbs.campaigns.errors import CampaignError
from gearmbs.units import to_si

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

BYTES = {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "KiB": 2.0**10, "MiB": 2.0**20, "GiB": 2.0**30}


def check_settings(given: Mapping[str, Any], cls: type, design: str) -> dict[str, Any]:
    """Return the settings of a plan, ``cls``, in one form.

    Raises
    ------
    CampaignError
        For unknown names and values that cannot be meant.
    """
    known = [f.name for f in dataclasses.fields(cls)]
    for name in given:
        if name not in known:
            raise CampaignError(f"plan: unknown setting {name!r}{near(name, known)}")
    found = dict(given)
    for name in ("constraints", "reuse"):
        if name in found:
            found[name] = texts(found[name], name)
    if "reuse" in found:
        # workers may run in other folders than this process
        found["reuse"] = tuple(os.path.abspath(path) for path in found["reuse"])
    for name, least in (("unit", 1), ("seed", 0)):
        if name in found:
            found[name] = whole(found[name], name, least)
    if found.get("time_limit") is not None:
        found["time_limit"] = limit(found["time_limit"], "time_limit", "60 s")
    if found.get("memory_limit") is not None:
        found["memory_limit"] = limit(found["memory_limit"], "memory_limit", "2 GB")
    options = found.get("options", {})
    if not isinstance(options, Mapping):
        raise CampaignError(f"options = {options!r}; give a dictionary of the design's options")
    if "levels" in options:
        levels = whole(options["levels"], "options: levels", 1)
        if design == "morris" and levels % 2:
            raise CampaignError(f"options: levels = {levels}; a morris design needs an even number of them")
        found["options"] = {**options, "levels": levels}
    for name in options:
        allowed = (*OPTIONS.get(design, ()), "corners")
        if name not in allowed:
            raise CampaignError(f"options: a {design} design has no {name!r}{near(name, allowed)}")
    return found


def near(name: str, known: Iterable[str]) -> str:
    """Return the end of a message about an unknown name: what may be meant, or what there is."""
    known = list(known)
    close = difflib.get_close_matches(str(name), known, 1)
    return f"; did you mean {close[0]}?" if close else f"; known are {', '.join(known)}"


def texts(value: Any, name: str) -> tuple[str, ...]:
    """Return one text or several as several."""
    if isinstance(value, str):
        return (value,)
    try:
        return tuple(str(item) for item in value)
    except TypeError:
        raise CampaignError(f"{name} = {value!r}; give a text or a list of texts") from None


def whole(value: Any, name: str, least: int) -> int:
    """Return a whole number that is not below the least."""
    try:
        number = int(value)
        good = not isinstance(value, (str, bool)) and number == value and number >= least
    except (TypeError, ValueError, OverflowError):
        good = False
    if not good:
        raise CampaignError(f"{name} = {value!r}; give a whole number, {least} or more")
    return number


def limit(value: Any, name: str, example: str) -> float:
    """Return a limit of time in seconds or of memory in bytes, given as a number or as a text with its unit."""
    try:
        if name == "memory_limit" and isinstance(value, str):
            size, _, unit = value.strip().partition(" ")
            number = float(size) * BYTES[unit]
        else:
            number = to_si(value, "time", name) if isinstance(value, str) else float(value)
    except (KeyError, TypeError, ValueError):
        number = math.nan
    if not 0.0 < number < math.inf:
        raise CampaignError(f"{name} = {value!r}; give a positive number or text such as {example!r}")
    return number


def fields_error(cls: type, error: TypeError) -> str:
    """Return what is wrong with the names of arguments, in the words of a file."""
    known = [f.name for f in dataclasses.fields(cls)]
    word = str(error).rpartition("argument ")[2].strip("'")
    return f"unknown key {word!r}{near(word, known)}" if "unexpected keyword" in str(error) else str(error)
