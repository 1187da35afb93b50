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
    "ug": "microstandard_gravity", "g's": "standard_gravity", "G's": "standard_gravity",
}  # fmt: skip
REPLACEMENTS = (
    ("²", "^2"), ("µ", "u"), ("μ", "u"), ("m/s2", "m/s^2"), ("in/s2", "in/s^2"), ("ms^-2", "m/s^2"), ("·", "*"),
    ("m s-2", "m/s^2"), ("m s^-2", "m/s^2"), ("m s-1", "m/s"), ("m s^-1", "m/s"),
)  # fmt: skip
AMERICAN = (
    (re.compile(r"(?<![A-Za-z])mils?(?![A-Za-z])"), "thou"),
    (re.compile(r"(?<![A-Za-z])ips(?![A-Za-z])"), "inch/s"),
)
"""Of proximity probes and velocity pickups; to unit libraries a mil is an angle."""
IN_CAPITALS = frozenset(("m/s", "mm/s", "m/s^2", "mm/s^2", "in/s", "in/s^2", "ips", "mil", "mils", "um", "mm", "mg"))
"""Units that instruments without small letters write, of which S alone would be siemens and M a molar."""
DETECTED = re.compile(
    r"^(?P<unit>.+?)(?:[\s_(]*(?:true\s*)?(?:pk|peak|pp|rms|p-p|pk-pk|pkpk|peak[\s-]*(?:to[\s-]*)?peak)"
    r"|[\s_(]+(?:eff|ss|s-s|0-pk?|o-pk?|0p|op|p))\)?$",
    re.IGNORECASE,
)
"""A unit with how a level was had of the samples: RMS, peak, peak-to-peak (in German eff, SS)."""


def unit_dimension(unit: str) -> tuple[str, float]:
    """Dimension of a unit ("displacement", "velocity", "acceleration" or "force") and its factor to SI.

    Raises
    ------
    SignalError
        If the unit is unknown, of another dimension, or that of a level, as "mm/s RMS".
    """
    from pint.errors import PintError

    if (bare := detected_unit(unit)) is not None:
        raise SignalError(
            f"units: {unit!r} is that of a level, not of samples; if these are the samples of a waveform, set "
            f"with_metadata(signal, units={bare!r})"
        )

    try:
        return _dimension(unit)
    except (PintError, AttributeError, ValueError, TypeError, AssertionError) as exc:
        raise SignalError(
            f"units: {unit!r} is not a unit of displacement, velocity, acceleration or force; "
            "set the right one with with_metadata(signal, units=...)"
        ) from exc


@lru_cache(maxsize=128)
def _dimension(unit: str) -> tuple[str, float]:
    parts = scaled(unit)
    if parts is not None:
        dimension, factor = _dimension(parts[1])
        return dimension, parts[0] * factor
    quantity = unit_registry().Quantity(1.0, _as_written(unit))
    for dimension, si in DIMENSIONS.items():
        if quantity.is_compatible_with(si):
            return dimension, float(quantity.to(si).magnitude)
    raise ValueError(unit)


NUMBER = r"10(?:\^|\*\*)\(?[-+]?\d+\)?|\d+(?:[.,]\d+)?(?:e[-+]?\d+)?"
SCALED = (
    re.compile(rf"^[x×*·]?\s*(?P<factor>{NUMBER})\s*[x×*·]?\s*(?P<unit>(?:[^\W\d]|1/).*)$", re.IGNORECASE),
    re.compile(rf"^(?P<unit>[^\W\d].*?)\s*[x×*]\s*(?P<factor>{NUMBER})$", re.IGNORECASE),
)


def scaled(unit: str) -> tuple[float, str] | None:
    """Return factor and unit of one that is a multiple, or None; 50 g may be a range.

    Examples
    --------
    >>> scaled("0.1 rpm"), scaled("10^-3 g"), scaled("rpm x 100"), scaled("1/min"), scaled("50 g")
    ((0.1, 'rpm'), (0.001, 'g'), (100.0, 'rpm'), None, None)
    """
    found = next((match for pattern in SCALED if (match := pattern.match(unit.strip()))), None)
    if found is None:
        return None
    power = re.match(r"10(?:\^|\*\*)\(?([-+]?\d+)", found["factor"])
    factor = 10.0 ** int(power[1]) if power else float(found["factor"].replace(",", "."))
    signed = power is not None or re.search(r"[x×*·]", unit.replace(found["unit"], "")) is not None
    return (factor, found["unit"].strip()) if factor <= 1.0 or signed else None


def detected_unit(unit: str) -> str | None:
    """Return the unit of the samples of which one of a level tells RMS, peak or peak-to-peak; None of any other.

    Examples
    --------
    >>> detected_unit("mil pp"), detected_unit("mm/s RMS"), detected_unit("grms"), detected_unit("rpm")
    ('mil', 'mm/s', 'g', None)
    """
    found = DETECTED.match(unit.strip())
    bare = "" if found is None else found["unit"].strip()
    return bare if is_usual(bare) or bare in DISPLACEMENTS else None


def _spelled(unit: str) -> str:
    """Return a unit without signs of print, in small letters where only capitals are at hand."""
    text = _without_signs(unit.strip())
    low = _without_signs(text.lower())
    named = text.isupper() or low in ("mil", "mils") or _without_signs(text.replace("S", "s")) == low
    return low if low in IN_CAPITALS and named else text


def _without_signs(text: str) -> str:
    for old, new in REPLACEMENTS:
        text = text.replace(old, new)
    return text


def _as_written(unit: str) -> str:
    """Return a unit as the library of units has it."""
    text = _spelled(unit)
    for pattern, new in AMERICAN:
        text = pattern.sub(new, text)
    return ALIASES.get(text, text)


@lru_cache(maxsize=1)
def unit_registry() -> Any:
    import pint

    return pint.UnitRegistry()


# Whether a text is a unit at all: what a caller writes is checked, what files say is kept.


USUAL = (
    "m", "mm", "um", "m/s", "mm/s", "in/s", "m/s^2", "mm/s^2", "g", "mg", "N", "kN", "N*m", "V", "mV", "A", "mA", "Pa",
    "kPa", "bar", "rpm", "Hz", "rad/s", "deg/s", "rad", "deg", "degC", "K", "s", "ms", "W", "kW", "%", "1", "dB", "ips",
    "mil", "mils",
)  # fmt: skip
DISPLACEMENTS = frozenset(("thou", "in", "cm", "ft", "in/s^2", "ft/s", "ft/s^2", "cm/s", "cm/s^2", "nm", "um/s"))
"""Further units of vibration, of which levels are told."""
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
        if (bare := detected_unit(text)) is not None:
            raise SignalError(
                f"units: {text!r} is that of a level, not of samples; give units={bare!r} if these are the samples of "
                "a waveform; of levels no spectrum can be had"
            )
        if not is_unit(text):
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
    text = _spelled(text)
    return text in USUAL or text in ALIASES


def is_unit(text: str) -> bool:
    """Return whether a text is a unit of anything."""
    clean = text.strip()
    if clean in USUAL or clean in ALIASES or clean in DIMENSIONS.values() or clean.lower() in COUNTS:
        return True
    clean = _as_written(clean)
    for old, new in (("°", "deg"), ("%", "percent"), ("Nm", "N*m")):
        clean = clean.replace(old, new)
    try:
        unit_registry().Unit(clean)
    except Exception:
        return False
    return True
