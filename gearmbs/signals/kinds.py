"""What a unit of vibration measures, and its factor to SI."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from .errors import SignalError

KINDS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}
# Vibration people write g for the acceleration of gravity; unit libraries read grams.
ALIASES = {"g": "standard_gravity", "gn": "standard_gravity", "G": "standard_gravity"}
REPLACEMENTS = (("²", "^2"), ("µ", "u"), ("μ", "u"), ("m/s2", "m/s^2"), ("ms^-2", "m/s^2"), ("·", "*"))


def unit_kind(unit: str) -> tuple[str, float]:
    """Kind ("displacement", "velocity", "acceleration" or "force") of a unit, and its factor to SI.

    Raises
    ------
    SignalError
        If the unit is unknown or of another kind.
    """
    from pint.errors import PintError

    try:
        return _kind(unit)
    except (PintError, AttributeError, ValueError, TypeError, AssertionError) as exc:
        raise SignalError(
            f"units: {unit!r} is not a unit of displacement, velocity, acceleration or force; "
            "set the right one with with_metadata(signal, units=...)"
        ) from exc


@lru_cache(maxsize=128)
def _kind(unit: str) -> tuple[str, float]:
    text = unit.strip()
    for old, new in REPLACEMENTS:
        text = text.replace(old, new)
    quantity = _registry().Quantity(1.0, ALIASES.get(text, text))
    for kind, si in KINDS.items():
        if quantity.is_compatible_with(si):
            return kind, float(quantity.to(si).magnitude)
    raise ValueError(unit)


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()
