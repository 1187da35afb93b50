"""Labels of columns as people write them: a name and its unit, times among them, no two alike."""

from __future__ import annotations

import re
from collections.abc import Sequence

from .metadata import key_of
from .signal import UNKNOWN_UNITS

NAME_UNIT = re.compile(r"^(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*$")
SUFFIX = re.compile(r"[_\s](s|sec|ms|us|µs|ns|min)$", re.IGNORECASE)
CLOCK_NAMES = frozenset(
    "time t times timesec timeseconds timestamp timestamps zeit zeitpunkt datetime elapsedtime relativetime "
    "xvalue sampletime tempo temps timems timeus".split()
)


def name_and_unit(label: str) -> tuple[str, str]:
    """The name and the unit of a label such as "acc [m/s^2]" or "acc (g)"; the unit is "unknown" without one."""
    found = NAME_UNIT.match(label)
    if found and found.group(1):
        return found.group(1), found.group(2).strip() or UNKNOWN_UNITS
    return label, UNKNOWN_UNITS


def is_clock(name: str) -> bool:
    """True for the names that columns of times have."""
    return key_of(SUFFIX.sub("", name))[0] in CLOCK_NAMES


def unique_names(names: Sequence[str]) -> list[str]:
    """Names made different by a number where they are not; empty ones become ch1, ch2 ..."""
    named = [name or f"ch{i + 1}" for i, name in enumerate(names)]
    return [n if named.count(n) == 1 else f"{n}_{named[:i].count(n) + 1}" for i, n in enumerate(named)]
