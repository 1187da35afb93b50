"""The dimension of a unit of vibration (displacement, velocity, acceleration or force) and its factor to SI."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from .errors import SignalError

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
