"""Whether a text is a unit at all: what a caller writes is checked, what files say is kept."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from typing import Any

from .dimensions import ALIASES, DIMENSIONS, REPLACEMENTS, unit_dimension
from .errors import SignalError

USUAL = (
    "m", "mm", "um", "m/s", "mm/s", "in/s", "m/s^2", "mm/s^2", "g", "mg", "N", "kN", "N*m", "V", "mV", "A", "mA", "Pa",
    "kPa", "bar", "rpm", "Hz", "rad/s", "deg/s", "rad", "deg", "degC", "K", "s", "ms", "W", "kW", "%", "1", "dB", "ips",
)  # fmt: skip
VIBRATION = ("'m/s^2'", "'g'", "'mg'", "'mm/s'", "'um'", "'N'")
ELECTRICAL = frozenset({"V", "mV", "uV", "µV", "A", "mA", "C", "pC", "nC"})
COUNTS = frozenset(
    {"", "unknown", "mixed", "counts", "count", "lsb", "digits", "digit", "adc", "eu", "a.u.", "au", "raw", "-"}
)
"""Texts that say that nothing is known of the unit, or that it is the converter's own."""


def check_units(units: Any) -> None:
    """Raise a SignalError for the first text among `units` (text, sequence or mapping of texts) that is no unit."""
    if units is None:
        return
    texts = [units] if isinstance(units, str) else list(units.values() if isinstance(units, Mapping) else units)
    for text in texts:
        if not isinstance(text, str):
            raise SignalError(f"units: must be text such as 'm/s^2', got {text!r}")
        if _is_level(text):
            raise SignalError(
                f"units: {text!r} is a level, of which no RMS or spectrum can be had; give the samples as they were "
                f"before the logarithm, in one of {', '.join(VIBRATION)}"
            )
        if (ratio := _sensitivity(text)) is not None:
            raise SignalError(
                f"units: {text!r} is a sensitivity or a scale, not a unit of samples; give units={ratio[0]!r} as they "
                f"are, or scale them and give units={ratio[1]!r}"
            )
        if not _is_unit(text):
            near = difflib.get_close_matches(text, USUAL, 2, 0.5)
            hint = (
                f"; did you mean {' or '.join(repr(n) for n in near)}?"
                if near
                else "; write for example 'm/s^2' or 'g'"
            )
            raise SignalError(f"units: {text!r} is not a unit{hint}")


def _is_level(text: str) -> bool:
    return re.fullmatch(r"\s*dB\W?(?:[A-Za-z].*)?\s*", text) is not None


def _sensitivity(text: str) -> tuple[str, str] | None:
    """Return the electrical and the mechanical unit of "mV/g", or of "g/V"; None for what is no such ratio."""
    first, last = text.partition("/"), text.rpartition("/")
    electrical, mechanical = (first[0], first[2]) if first[0].strip() in ELECTRICAL else (last[2], last[0])
    electrical, mechanical = electrical.strip(), mechanical.strip(" ()")
    # V/m is the strength of a field
    if electrical not in ELECTRICAL or mechanical in ("", "m"):
        return None
    try:
        unit_dimension(mechanical)
    except SignalError:
        return None
    return electrical, mechanical


def is_usual(text: str) -> bool:
    """True for the units of measured signals themselves, in any of their spellings; not for all that could be one."""
    for old, new in REPLACEMENTS:
        text = text.replace(old, new)
    return text in USUAL or text in ALIASES


def _is_unit(text: str) -> bool:
    clean = text.strip()
    if clean in USUAL or clean in ALIASES or clean in DIMENSIONS.values() or clean.lower() in COUNTS:
        return True
    for old, new in (*REPLACEMENTS, ("°", "deg"), ("%", "percent")):
        clean = clean.replace(old, new)
    from .dimensions import unit_registry

    try:
        unit_registry().Unit(clean.replace("Nm", "N*m").replace("ips", "inch/s"))
    except Exception:
        return False
    return True
