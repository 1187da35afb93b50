"""Units of the samples of a signal: their dimension and factor to SI, and whether a text is a unit at all."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from gearmbs.signals.errors import SignalError
from gearmbs.wording import did_you_mean

Given = float | str
"""A quantity as callers give it: a number in SI, or text with a unit."""

# The dimension of a unit of vibration (displacement, velocity, acceleration or force) and its factor to SI.


DIMENSIONS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}
# In vibration work g is the standard acceleration of gravity; unit libraries read g and mg as masses.
ALIASES = {
    "g": "standard_gravity", "gn": "standard_gravity", "G": "standard_gravity", "mg": "millistandard_gravity",
}  # fmt: skip
REPLACEMENTS = (("²", "^2"), ("µ", "u"), ("μ", "u"), ("m/s2", "m/s^2"), ("ms^-2", "m/s^2"), ("·", "*"))


def unit_dimension(unit: str) -> tuple[str, float]:
    """Dimension of a unit ("displacement", "velocity", "acceleration" or "force") and its factor to SI.

    Raises
    ------
    SignalError
        If the unit is unknown or of another dimension.
    """
    from pint.errors import PintError

    try:
        return _dimension(unit)
    except (PintError, AttributeError, ValueError, TypeError, AssertionError) as exc:
        raise SignalError(
            f"units: {unit!r} is not a unit of displacement, velocity, acceleration or force; "
            "set the right one with with_metadata(signal, units=...)"
        ) from exc


@lru_cache(maxsize=128)
def _dimension(unit: str) -> tuple[str, float]:
    text = unit.strip()
    for old, new in REPLACEMENTS:
        text = text.replace(old, new)
    quantity = unit_registry().Quantity(1.0, ALIASES.get(text, text))
    for dimension, si in DIMENSIONS.items():
        if quantity.is_compatible_with(si):
            return dimension, float(quantity.to(si).magnitude)
    raise ValueError(unit)


@lru_cache(maxsize=1)
def unit_registry() -> Any:
    import pint

    return pint.UnitRegistry()


# Whether a text is a unit at all: what a caller writes is checked, what files say is kept.


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
            example = "write for example 'm/s^2' or 'g'"
            hint = did_you_mean(text, USUAL, otherwise=example, count=2, alike=0.5, shown=repr)
            raise SignalError(f"units: {text!r} is not a unit; {hint}")


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

    try:
        unit_registry().Unit(clean.replace("Nm", "N*m").replace("ips", "inch/s"))
    except Exception:
        return False
    return True
