"""UNITS: what one unit of a deck is in SI, with the unit-consistency factor."""

from __future__ import annotations

from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.language.syntax import Units

INCH = 0.0254
"""Metres; exact by definition, the international yard and pound agreement of 1959."""
POUND = 0.45359237
"""Kilograms; exact by the same agreement."""
STANDARD_GRAVITY = 9.80665
"""m/s^2; exact by definition (3rd CGPM, 1901)."""
POUND_FORCE = POUND * STANDARD_GRAVITY

FORCE = {
    "CENTINEWTON": 1e-2, "DYNE": 1e-5, "KILOGRAM_FORCE": STANDARD_GRAVITY, "KNEWTON": 1e3,
    "KPOUND_FORCE": 1e3 * POUND_FORCE, "MEGANEWTON": 1e6, "MICRONEWTON": 1e-6, "MILLINEWTON": 1e-3,
    "NANONEWTON": 1e-9, "NEWTON": 1.0, "OUNCE_FORCE": POUND_FORCE / 16.0, "POUND_FORCE": POUND_FORCE,
    "POUNDAL": POUND * 0.3048,
}  # fmt: skip
LENGTH = {
    "ANGSTROM": 1e-10, "CENTIMETER": 1e-2, "FOOT": 0.3048, "INCH": INCH, "KILOMETER": 1e3, "METER": 1.0,
    "MICROINCH": 1e-6 * INCH, "MICROMETER": 1e-6, "MILE": 1609.344, "MILLIMETER": 1e-3, "MILS": 1e-3 * INCH,
    "NANOMETER": 1e-9, "YARD": 0.9144,
}  # fmt: skip
MASS = {
    "GRAM": 1e-3, "KILOGRAM": 1.0, "KPOUND_MASS": 1e3 * POUND, "MICROGRAM": 1e-9, "MILLIGRAM": 1e-6,
    "NANOGRAM": 1e-12, "OUNCE_MASS": POUND / 16.0, "POUND_MASS": POUND, "SLINCH": POUND_FORCE / INCH,
    "SLUG": POUND_FORCE / 0.3048, "TONNE": 1e3, "US_TON": 2000.0 * POUND,
}  # fmt: skip
TIME = {
    "DAY": 86400.0, "HOUR": 3600.0, "MICROSECOND": 1e-6, "MILLISECONDS": 1e-3, "MINUTE": 60.0, "NANOSECOND": 1e-9,
    "SECOND": 1.0,
}  # fmt: skip
SYSTEMS = {
    "MKS": ("NEWTON", "KILOGRAM", "METER", "SECOND"),
    "CGS": ("DYNE", "GRAM", "CENTIMETER", "SECOND"),
    "FPS": ("POUND_FORCE", "POUND_MASS", "FOOT", "SECOND"),
    "IPS": ("POUND_FORCE", "POUND_MASS", "INCH", "SECOND"),
}
TABLES = {"force": FORCE, "mass": MASS, "length": LENGTH, "time": TIME}

RESULT_NAMES = {
    "NEWTON": "newton", "DYNE": "dyne", "POUND_FORCE": "pound_force", "KILOGRAM_FORCE": "kg_force",
    "KNEWTON": "knewton", "KILOGRAM": "kg", "GRAM": "gram", "POUND_MASS": "pound_mass", "SLUG": "slug",
    "METER": "meter", "MILLIMETER": "mm", "CENTIMETER": "cm", "INCH": "inch", "FOOT": "foot", "SECOND": "sec",
    "MILLISECONDS": "millisec", "MINUTE": "min", "HOUR": "hour",
}  # fmt: skip
"""How result files spell the units."""


def unit_names(statement: st.Units | None) -> dict[str, str]:
    """Return the full names of a deck's units of force, mass, length and time ("" where there is none).

    Raises
    ------
    ValueError
        For an unknown, ambiguous or missing unit.
    """
    if statement is None:
        return dict.fromkeys(TABLES, "")
    if statement.system and statement.system != "NONE":
        return dict(zip(TABLES, SYSTEMS[statement.system]))
    names = {}
    for quantity, table in TABLES.items():
        word = getattr(statement, quantity)
        if word is None:
            names[quantity] = ""
            continue
        found = [n for n in table if n == word] or [n for n in table if n.startswith(word)]
        if len(found) != 1:
            problem = "is ambiguous" if found else "is unknown"
            raise ValueError(f"{quantity.upper()} = {word} {problem}; choose one of {', '.join(found or table)}")
        names[quantity] = found[0]
    given = [q for q, n in names.items() if n]
    if given and len(given) < 4:
        missing = [q.upper() for q, n in names.items() if not n]
        raise ValueError(f"{', '.join(missing)} missing; FORCE, MASS, LENGTH and TIME go together")
    return names


def deck_units(statement: st.Units | None) -> Units:
    """Return the SI values of a deck's units.

    Without UNITS, or with SYSTEM = NONE, numbers are taken as a consistent system, that is as SI.
    UCF scales forces: force x UCF = mass x acceleration in the deck's own units.

    Raises
    ------
    ValueError
        For an unknown, ambiguous or missing unit or a UCF that is not positive.
    """
    names = unit_names(statement)
    values = {q: TABLES[q][n] if n else 1.0 for q, n in names.items()}
    if statement is not None and statement.ucf is not None:
        if not statement.ucf > 0.0:
            raise ValueError(f"UCF = {statement.ucf}; it must be positive")
        values["force"] = statement.ucf * values["mass"] * values["length"] / values["time"] ** 2
    return Units(**values)
