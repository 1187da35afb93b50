"""Units at the border: text with a unit, or a float in SI, becomes a float in SI.

Floats and integers pass through as SI values. Text with common units is read here; all other text, and all that is
wrong with it, is left to pint, whose registry of units takes a quarter of a second to set up.
"""

from __future__ import annotations

import functools
import math
import re
from contextlib import suppress
from numbers import Real
from typing import TYPE_CHECKING, Any

from gearmbs.wording import closest

# What is taken for a quantity: a number in SI, text with a unit, or a quantity of pint, which those load who use it.
if TYPE_CHECKING:
    from pint import Quantity as _PintQuantity

    QuantityLike = float | str | _PintQuantity
else:
    QuantityLike = Any

# A field that takes a float in SI or text with a unit, and holds the float once its object is built.
Quantity = Any

DIMENSIONS = {
    "length": "m",
    "area": "m^2",
    "angle": "rad",
    "time": "s",
    "mass": "kg",
    "inertia": "kg*m^2",
    "density": "kg/m^3",
    "force": "N",
    "torque": "N*m",
    "speed": "m/s",
    "angular speed": "rad/s",
    "acceleration": "m/s^2",
    "frequency": "Hz",
    "pressure": "Pa",
    "stiffness": "N/m",
    "damping": "N*s/m",
    "power": "W",
    "energy": "J",
    "dimensionless": "dimensionless",
}


USUAL = {"m": "mm", "rad": "deg", "rad/s": "rpm"}
"""Units that hints show instead of SI's, which hardly anybody means who leaves the unit away."""

SPELLINGS = (
    (r"\b([kM]?)Nm\b", r"\1N*m"),
    (r"\bNmm\b", "N*mm"),
    (r"\b(?:RPM|[Uu]/min)\b", "rpm"),
    (r"(?<![A-Za-z_])mils?\b", "thou"),
    (r"(?<![A-Za-z_])revs?\b", "turn"),
)
"""Usual ways of writing that the parser of units does not know; a mil, 0.001 inch, it takes for an angle."""


COMMON = {
    "m": (1.0, {"m": 1}),
    "cm": (1e-2, {"m": 1}),
    "mm": (1e-3, {"m": 1}),
    "um": (1e-6, {"m": 1}),
    "kg": (1.0, {"kg": 1}),
    "g": (1e-3, {"kg": 1}),
    "s": (1.0, {"s": 1}),
    "ms": (1e-3, {"s": 1}),
    "min": (60.0, {"s": 1}),
    "rad": (1.0, {"rad": 1}),
    "deg": (math.pi / 180.0, {"rad": 1}),
    "rpm": (math.tau / 60.0, {"rad": 1, "s": -1}),
    "Hz": (1.0, {"s": -1}),
    "kHz": (1e3, {"s": -1}),
    "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "kN": (1e3, {"kg": 1, "m": 1, "s": -2}),
    "J": (1.0, {"kg": 1, "m": 2, "s": -2}),
    "W": (1.0, {"kg": 1, "m": 2, "s": -3}),
    "kW": (1e3, {"kg": 1, "m": 2, "s": -3}),
    "Pa": (1.0, {"kg": 1, "m": -1, "s": -2}),
    "MPa": (1e6, {"kg": 1, "m": -1, "s": -2}),
    "GPa": (1e9, {"kg": 1, "m": -1, "s": -2}),
}
"""Common units: factor to SI, and powers of m, kg, s and rad."""

BEYOND = ("[current]", "[temperature]", "[substance]", "[luminosity]")
"""Dimensions besides those of mechanics, as the library of units names them."""

ANGULAR = re.compile("radian|degree(?!_)|turn|revolution|rpm|rps|arcminute|arcsecond|grade")
WITHOUT_ANGLE = ("m", "m^2", "m^3", "s", "kg", "kg/m^3", "N", "Pa", "N/m", "N*s/m", "N*m", "dimensionless")
"""Units of quantities that are none for an angle, of which a library takes the radian for 1; a torque is also J/rad."""
FOREIGN = re.compile(r"[^\w\s.+*/^()%°‰×⁻-]")
SIDE_BY_SIDE = re.compile(r"[\w.)%‰]\s+(?!1\s*/\s*[^\W\d])[.\d]")
"""A number behind something else without an operator between them, but for 5 1/s."""

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
FACTOR = re.compile(r"\s*([*/]?)\s*([A-Za-z]+)(?:(?:\^|\*\*)(-?\d+(?:\.\d+)?))?\s*")


class Given(float):
    """A number in SI that was given as a text with a unit and keeps that text for showing; a float in all else.

    Whatever is computed from it is a plain float.

    Examples
    --------
    >>> module = to_si("2 mm", "length")
    >>> module, shown(module, "mm"), shown(2.0 * module, "mm")
    (0.002, '2 mm', '4 mm')
    """

    __slots__ = ("text",)
    text: str

    def __new__(cls, value: float, text: str) -> Given:
        made = super().__new__(cls, value)
        made.text = text
        return made

    def __getnewargs__(self) -> tuple[float, str]:  # type: ignore[override]
        return float(self), self.text


def shown(value: float, unit: str, form: str = ".6g") -> str:
    """Return a quantity as a user reads it: as it was given, else in a unit of `COMMON` or a product of these."""
    if isinstance(value, Given):
        return value.text
    known = _common(unit)
    if known is None:
        raise ValueError(f"unit is {unit!r}; give one made of {', '.join(COMMON)}")
    return f"{value / known[0]:{form}} {unit}"


@functools.lru_cache(maxsize=256)
def _common(unit: str) -> tuple[float, tuple] | None:
    """Return factor and powers of a product of common units; None for anything else."""
    factor, powers, place = 1.0, dict.fromkeys(("m", "kg", "s", "rad"), 0.0), 0
    while place < len(unit):
        found = FACTOR.match(unit, place)
        if found is None or found[2] not in COMMON:
            return None
        size, bases = COMMON[found[2]]
        power = float(found[3] or 1.0) * (-1.0 if found[1] == "/" else 1.0)
        factor *= size**power
        for base, exponent in bases.items():
            powers[base] += power * exponent
        place = found.end()
    return (factor, tuple(round(p, 9) for p in powers.values())) if place else None


def powers_of(unit: str) -> tuple[float, tuple] | None:
    """Return the SI value of a unit or dimension and its powers of m, kg, s and rad; None for anything else.

    Examples
    --------
    >>> powers_of("Nm") == powers_of("torque"), powers_of("rpm")[1], powers_of("pump")
    (True, (0.0, 0.0, -1.0, 1.0), None)
    """
    clean = DIMENSIONS.get(unit, unit)
    for pattern, written in SPELLINGS:
        clean = re.sub(pattern, written, clean)
    return _common(clean)


@functools.lru_cache(maxsize=256)
def beyond_mechanics(unit: str) -> bool:
    """Whether this is a unit of SI of what has a current, a temperature, a substance or a light in it.

    Examples
    --------
    >>> [beyond_mechanics(unit) for unit in ("V", "N*m/A", "K", "mV", "degC", "m", "volts per hour")]
    [True, True, True, False, False, False, False]
    """
    registry = _registry()
    try:
        one = registry.Quantity(1.0, registry.Unit(unit)).to_base_units()
    except Exception:
        return False
    return bool(one.magnitude == 1.0 and {*BEYOND} & {*one.dimensionality})


def _quick(text: str, target: str) -> float | None:
    """Return the value of a number with common units in a target of the very same powers; else None."""
    number = NUMBER.match(text)
    if number is None:
        return None
    unit, wanted = _common(text[number.end() :]), _common(target)
    if unit is None or wanted is None or unit[1] != wanted[1]:
        return None
    return float(number[0]) * (unit[0] / wanted[0])


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def to_si(value: Any, unit: str, field: str = "value") -> float:
    """Value in SI units.

    Parameters
    ----------
    value : float or str
        A number, taken as SI, or text with a unit: ``"0.1 mm"``, ``"1000 rpm"``, ``"2.9852e5 N/mm^1.3"``.
    unit : str
        The SI unit wanted (``"N/m^1.3"``), or a dimension by name (``"length"``, ``"angle"``, ``"torque"`` ...).
    field : str
        Name used in error messages.

    Returns
    -------
    float
        From a text a `Given`, which keeps the text.

    Raises
    ------
    ValueError
        For text that is not a finite number with a unit, unknown units, units of another dimension, and NaN.
    TypeError
        For anything that is neither a number nor text.

    Examples
    --------
    >>> to_si("0.1 mm", "length")
    0.0001
    >>> to_si(20.0, "length")
    20.0
    >>> round(to_si("1 N/mm^1.3", "N/m^1.3"), 3)
    7943.282
    """
    target = DIMENSIONS.get(unit, unit)
    if isinstance(value, bool):
        raise TypeError(f"{field}: got {value!r}; give a number in {target} or text with a unit")
    if isinstance(value, Real):
        number = value if isinstance(value, Given) else float(value)
    elif isinstance(value, str):
        number = Given(_parse(value, target, field), value.strip())
        if math.isinf(number):
            raise ValueError(f"{field}: {value!r} is not finite; give a finite number in {target}")
    elif hasattr(value, "to") and hasattr(value, "magnitude"):
        number = _parse(f"{float(value.magnitude)!r} {value.units!s}", target, field)
    else:
        raise TypeError(f"{field}: got {value!r}; give a number in {target} or text with a unit, such as '1 {target}'")
    if math.isnan(number):
        raise ValueError(f"{field}: got NaN; give a finite number in {target}")
    return number


def truth(value: Any, field: str = "value") -> bool:
    """Return a truth value, of Python or numpy, as ``bool``.

    Raises
    ------
    ValueError
        For anything else, of which Python takes the text "false" for true; the message names the field.
    """
    if not (isinstance(value, bool) or (getattr(value, "shape", None) == () and str(value.dtype) == "bool")):
        raise ValueError(f"{field} is {value!r}; give true or false")
    return bool(value)


NAMED = {
    (1.0, 1.0, -2.0): "N",
    (2.0, 1.0, -2.0): "N m",
    (0.0, 1.0, -2.0): "N/m",
    (0.0, 1.0, -1.0): "N s/m",
    (2.0, 1.0, -1.0): "N m s",
    (-1.0, 1.0, -2.0): "Pa",
    (2.0, 1.0, -3.0): "W",
}
"""Usual names of products of powers of m, kg and s. Of torque and energy, which have the same, torque is meant here."""


def si_unit(text: Any) -> str | None:
    """Return the SI unit of a text that is a number with a unit, for `to_si`; None for anything else.

    Examples
    --------
    >>> si_unit("0.1 mm"), si_unit("1500 rpm"), si_unit("20 N m"), si_unit("3 kgf"), si_unit("pump"), si_unit(3.0)
    ('m', 'rad/s', 'N m', 'N', None, None)
    """
    if not isinstance(text, str):
        return None
    clean = text.strip().replace("·", "*").replace("µ", "u").replace("μ", "u")
    for pattern, written in SPELLINGS:
        clean = re.sub(pattern, written, clean)
    number = NUMBER.match(clean)
    unit = "" if number is None else clean[number.end() :].strip()
    if not unit:
        return None
    known = _common(unit)
    if known is None:
        try:
            units = _registry().Quantity(1.0, unit).to_base_units().units
        except Exception:
            return None
        # those of mechanics have the same names however they are written: kgf as N, 1/s as Hz
        known = _common(re.sub(r"^1(?=/)", "", f"{units:~C}"))
        if known is None:
            return f"{units}"
    *others, angle = known[1]
    named = NAMED.get(tuple(others))
    if named is not None and angle in (0.0, -1.0):
        return named + ("/rad" if angle else "")
    return _named(known[1])


def readings(text: Any) -> dict[str, float]:
    """Return a text's number by each unit of SI in which a field that takes it may have its plain numbers.

    The first is that of `si_unit`. Others differ by powers of the radian: 25 Hz are 157 rad/s where angles count.

    Examples
    --------
    >>> {unit: round(number, 1) for unit, number in readings("25 Hz").items()}, readings("10 N m"), readings("pump")
    ({'Hz': 25.0, 'rad/s': 157.1}, {'N m': 10.0}, {})
    """
    unit = si_unit(text)
    if unit is None:
        return {}
    found = {unit: float(to_si(text, unit))}
    if (known := _common(unit)) is None:
        return found
    *others, angle = known[1]
    for power in (-2.0, -1.0, 1.0, 2.0):
        with suppress(ValueError):
            name = _named((*others, angle + power))
            number = float(to_si(text, name))
            if not any(math.isclose(number, other) for other in found.values()):
                found[name] = number
    return found


def _named(powers: tuple[float, ...]) -> str:
    """Return the unit of powers of m, kg, s and rad."""
    bases = dict(zip(("m", "kg", "s", "rad"), powers))
    above = "*".join(_power(base, p) for base, p in bases.items() if p > 0.0)
    below = "".join(f"/{_power(base, -p)}" for base, p in bases.items() if p < 0.0)
    return "Hz" if above + below == "/s" else (above or "1") + below


def _power(base: str, power: float) -> str:
    return base if power == 1.0 else f"{base}^{power:g}"


@functools.lru_cache(maxsize=1024)
def _parse(text: str, target: str, field: str) -> float:
    if re.search(r"\d,\d", text):
        # a library would drop it: "3,5 mm" would be 35 mm
        raise ValueError(
            f"{field}: {text!r} has a comma in its number; write a point before decimals, and nothing between thousands"
        )
    clean = re.sub(r"(?<=\d)\s*°", " deg", text.strip()).replace("·", "*").replace("µ", "u").replace("μ", "u")
    clean = clean.replace("\N{MINUS SIGN}", "-")
    for pattern, written in SPELLINGS:
        clean = re.sub(pattern, written, clean)
    quick = _quick(clean, target)
    if quick is not None:
        return quick
    fault = _fault(clean)
    if fault:
        raise ValueError(f"{field}: {text!r} {fault}; write for example '1 {USUAL.get(target, target)}'")

    import pint

    registry = _registry()
    try:
        quantity = registry.Quantity(clean)
    except Exception as error:
        raise ValueError(
            f"{field}: cannot read {text!r} as a number with a unit ({error}); {_remedy(clean, target)}"
        ) from None
    example = USUAL.get(target, target)
    if not re.match(r"[+-]?\s*\(*[+-]?\s*(\.?\d|inf|nan)", clean, re.IGNORECASE):
        # a library takes a unit alone for one of it
        raise ValueError(f"{field}: {text!r} has no number; write for example '1 {example}'")
    if not isinstance(quantity, registry.Quantity):
        quantity = registry.Quantity(quantity, "dimensionless")
    if not isinstance(quantity.magnitude, Real):
        raise ValueError(f"{field}: cannot read {text!r} as a number with a unit; write for example '1 {example}'")
    try:
        wanted = registry.Quantity(1.0, target)
    except Exception:
        raise ValueError(
            f"{field}: {target!r} is no unit; give one such as 'm^3', or a dimension: {', '.join(DIMENSIONS)}"
        ) from None
    if quantity.unitless and not wanted.dimensionless:
        raise ValueError(f"{field}: {text!r} has no unit; write for example '{quantity.magnitude:g} {example}'")
    if wanted.units == registry.radian and quantity.dimensionless and quantity.unitless:
        raise ValueError(f"{field}: {text!r} has no unit; write 'deg' or 'rad'")
    names = str(quantity.units)
    per_energy = target == "N*m" and "radian" in names and ("joule" in names or "watt" in names)
    if target in WITHOUT_ANGLE and ANGULAR.search(names) and not per_energy:
        hint = "; of a whole turn it is 2 pi times what it is per radian" if "/ radian" in names else ""
        raise ValueError(
            f"{field}: {text!r} has an angle in its unit where a quantity in {target} is expected{hint}; write for "
            f"example '1 {example}'"
        )
    try:
        number = float(quantity.to(target).magnitude)
    except pint.DimensionalityError:
        raise ValueError(
            f"{field}: {text!r} is in {quantity.units:~} where a quantity in {target} is expected; write for example "
            f"'1 {example}'"
        ) from None
    return _in_radians(number, quantity, wanted, text, target, field)


def _fault(text: str) -> str:
    """Return what is wrong with a text that a library would make something of; empty if nothing is.

    It leaves out signs that it does not know, so that 1'000 is 0, and multiplies what stands side by side, so that
    1 000 is 0 as well.
    """
    unknown = FOREIGN.search(text)
    number = NUMBER.match(text)
    if unknown:
        return f"has {unknown[0]!r} in it, which is no part of a number or a unit"
    if re.match(r"[+-]\s*[+-]", text):
        return "has two signs"
    if number is not None and re.match(r"\s*\(\s*[.\d]", text[number.end() :]):
        return "has a number in brackets behind another, as an uncertainty is printed"
    if SIDE_BY_SIDE.search(text) or (number is not None and re.match(r"[.\d]", text[number.end() :])):
        return "has two numbers side by side"
    return ""


def _remedy(text: str, target: str) -> str:
    """Return what may have been meant by a text that cannot be read."""
    number, wanted = NUMBER.match(text), _common(target)
    unit = "" if number is None else text[number.end() :].strip()
    known = [
        name
        for name in dict.fromkeys((*COMMON, target))
        if (found := _common(name)) and wanted and found[1] == wanted[1]
    ]
    near = closest(unit, known, 3, 0.5) if unit else []
    if number is not None and near:
        # of a unit of two letters one slip is as likely left out as exchanged
        likely = near if len(unit) <= 2 else near[:1]
        return "did you mean " + " or ".join(f"'{number[0]} {name}'" for name in likely) + "?"
    return f"write for example '1 {USUAL.get(target, target)}'"


def _in_radians(number: float, quantity: Any, wanted: Any, text: str, target: str, field: str) -> float:
    """Tell turns from radians, which the parser takes for the same: 30 Hz are 30 turns a second, not 30 rad/s.

    Units in Hz count turns where radians are wanted, and angles are turns where Hz are: with the same power of the
    angle, else neither is told from the other. Energy is also torque times angle: J/rad^2 is N m/rad.
    """
    (hertz, angle), (in_hertz, in_angle) = _angles(quantity), _angles(wanted)
    names = str(quantity.units)
    if in_angle and (hertz or angle):
        energy = "joule" in names or "watt" in names
        if hertz + angle in (in_angle, in_angle - 1.0 if energy else in_angle):
            return number * math.tau**hertz
    elif in_hertz and angle:
        if hertz + angle == in_hertz:
            return number / math.tau**angle
    elif target == "rad/s" and "minute" in names:
        return number * math.tau
    elif target != "rad/s" and not (in_angle and "minute" in names):
        return number
    if target == "rad/s" and not angle:
        raise ValueError(f"{field}: {text!r} may be turns or radians; write 'rpm', 'Hz' or 'rad/s'")
    raise ValueError(
        f"{field}: {text!r} has another power of the angle, in turns or radians, than {target}; write for example "
        f"'1 {USUAL.get(target, target)}'"
    )


def _angles(quantity: Any) -> tuple[float, float]:
    """Return the powers of Hz and of angles in a unit."""
    powers = dict(quantity.unit_items())
    hertz = sum(power for name, power in powers.items() if "hertz" in name)
    return hertz, sum(power for name, power in powers.items() if ANGULAR.search(name))


SLOWEST_WAVE, FASTEST_WAVE = 20.0, 2e4
"""Speed of waves along a bar of any solid, sqrt(E / rho), m/s: soft rubber has 30, steel 5200, diamond 17 500."""
METAL_DENSITY, METAL_WAVE = 5000.0, 800.0
"""Density above which a solid is a metal, kg/m^3, and the speed of waves in any metal at least: lead has 1200."""
LIGHTEST, HEAVIEST = 25.0, 3e4
"""Densities of solids, kg/m^3: light foams have 30, osmium 22 600; in g/cm^3 all solids are below the first."""


def doubt_of_material(youngs_modulus: float, density: float) -> str | None:
    """Return why no solid has this modulus (Pa) and density (kg/m^3), with what may be meant; None if some has.

    Units that are wrong by a thousand or a million show in the density, or in the speed of waves along a bar. A
    density of zero, that of parts whose mass is elsewhere, is not doubted.

    Examples
    --------
    >>> doubt_of_material(2.1e11, 7850.0)
    >>> doubt_of_material(210.0, 7850.0)
    "E = 210 Pa with 7850 kg/m^3: waves would run at 0.164 m/s, in steel at 5200; is 2.1e+11 Pa meant ('210 GPa')?"
    """
    doubt = doubt_of_density(density)
    if doubt or density == 0.0:
        return doubt
    wave = math.sqrt(youngs_modulus / density)
    least = METAL_WAVE if density > METAL_DENSITY else SLOWEST_WAVE
    if least <= wave <= FASTEST_WAVE:
        return None
    units = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1e-3, "mPa"), (1e-6, "uPa"))
    meant = [
        f"; is {youngs_modulus * f:.4g} Pa meant ('{youngs_modulus:.4g} {u}')?"
        for f, u in units
        if 1e3 <= math.sqrt(youngs_modulus * f / density) <= FASTEST_WAVE
    ]
    said = f"E = {youngs_modulus:.4g} Pa with {density:.4g} kg/m^3: waves would run at {wave:.3g} m/s, in steel at 5200"
    return said + "".join(meant[:1])


def doubt_of_density(density: float) -> str | None:
    """Return why no solid has this density (kg/m^3), with what may be meant; None if some has, and of zero."""
    if density == 0.0:
        return None
    if not LIGHTEST <= density <= HEAVIEST:
        factor = next((f for f in (1e3, 1e12, 1e9, 1e6, 1e-3, 1e-6) if 500.0 <= density * f <= HEAVIEST), None)
        meant = "" if factor is None else f"; is {density * factor:.4g} kg/m^3 meant"
        text = {1e3: " ('g/cm^3')", 1e12: " ('t/mm^3')", 1e9: " ('kg/mm^3')"}.get(factor or 0.0, "")
        return f"{density:.4g} kg/m^3 is the density of no solid{meant}{text}{'?' if meant else ''}"
    return None
