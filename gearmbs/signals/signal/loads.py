"""Columns that say how a machine ran: torques, forces, currents, powers, pressures, told by unit, or else by name."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.units import COUNTS, unit_dimension
from gearmbs.signals.signal.words import words_of

Load = Literal["torque", "force", "current", "power", "pressure"]
LOAD_WORDS: dict[Load, str] = {
    "torque": "holds a torque", "force": "holds a force", "current": "holds a current", "power": "holds a power",
    "pressure": "holds a pressure",
}  # fmt: skip
SI: dict[Load, str] = {"torque": "N m", "force": "N", "current": "A", "power": "W", "pressure": "bar"}

_NEWTONS, _METRES = r"(?:k|M|m|da|c|u|µ|μ)?N", r"(?:m|mm|cm)"
_POUNDS, _FEET = r"(?:k?lbf?s?|ozf?|k?gf|kp)", r"(?:ft|in|m|cm)"
_BY = r"\s*[ *·.⋅×-]?\s*"
TORQUE_UNIT = re.compile(rf"^(?:{_NEWTONS}{_BY}{_METRES}|NM)$")
"""Of newtons with a capital, as nm is a nanometre."""
CUSTOMARY = re.compile(rf"^(?:{_POUNDS}{_BY}{_FEET}|(?:ft|in){_BY}(?:lbf?s?|ozf?))$", re.IGNORECASE)
_SPELLED: dict[Load, str] = {
    "current": "A mA kA uA µA Amp Amps amp Ampere",
    "power": "W kW MW mW VA kVA hp PS",
    "pressure": "bar mbar hPa kPa MPa psi psig bar(g) barg atm",
}
UNITS: dict[str, Load] = {unit: load for load, units in _SPELLED.items() for unit in units.split()}

NAMES: dict[Load, str] = {
    "torque": r"torque|moment|drehmoment|drehmom|couple|koppel|coppia|vridmoment",
    "force": r"force|kraft|effort|sila|fuerza|forza|kraftmessdose",
    "current": r"current|strom|courant|proud|corriente|corrente",
    "power": r"power|leistung|puissance|vykon|potencia|potenza",
    "pressure": r"pressure|druck|pression|tlak|presion|pressione",
}
"""Without case and accents."""
BESIDE = (
    r"in|inp|input|out|output|an|ab|antrieb|abtrieb|eingang|ausgang|entree|sortie|drive|driven|driver|motor|moteur|"
    r"engine|generator|shaft|welle|arbre|hridel|brake|brems|bremse|load|last|cell|kroutici|mean|mess|ist|soll|actual|"
    r"ref|electric|shear|hammer|radial|axial|tangential|normal|phase|ch|channel|sensor|signal|value|oil|ol|oleje|huile|"
    r"hydraulic|water|wasser|inlet|outlet|suction|discharge|supply|line|system"
)
"""What names of loads have besides: where it is, or how it was had."""
_PART = re.compile(rf"^(?:{BESIDE}|[a-z]|\d+)$")
_COMPOUND = {load: re.compile(rf"^(?:(?:{BESIDE})s?)*(?:{name})(?:{BESIDE})*$") for load, name in NAMES.items()}
_LOAD_CELL = ["load", "cell"]
_WORD = {load: re.compile(rf"^(?:{name})$") for load, name in NAMES.items()}
OF_VIBRATION = re.compile(
    r"^a$|acc|beschl|vib|schwing|kmit|disp|weg$|velo|micro|mikro|^mic|sound|schall|acoust|akust|^son"
)
"""Words of vibration, of a place that may be called by a load."""


def is_unit_of_load(text: str) -> bool:
    """Return whether a text is a unit of torque, which tables have in as many spellings as there are signs."""
    return TORQUE_UNIT.match(text) is not None or CUSTOMARY.match(text) is not None


def load_of(name: str, unit: str) -> Load | None:
    """Return which load a column holds, or None.

    The unit decides; where it is missing or that of a transducer's voltage, the name, if it says nothing else.

    Examples
    --------
    >>> load_of("M", "Nm"), load_of("Input torque", "unknown"), load_of("Torque side acc", "V")
    ('torque', 'torque', None)
    """
    unit, words = unit.strip(), words_of(name)
    if is_unit_of_load(unit):
        return "torque"
    if unit in UNITS:
        return UNITS[unit]
    if unit == "Pa":
        # of a microphone, unless it is called as nothing but a pressure
        return "pressure" if _called(words) == "pressure" else None
    if not _says_nothing(unit):
        try:
            return "force" if unit_dimension(unit)[0] == "force" else None
        except SignalError:
            return None
    return "force" if words[:2] == _LOAD_CELL else _called(words)


def is_slow_load(name: str, unit: str) -> bool:
    """Return whether a column holds a load that may have fewer samples than vibration; forces are measured as it is."""
    unit = unit.strip()
    if is_unit_of_load(unit) or unit in UNITS:
        return True
    return (_says_nothing(unit) or unit == "Pa") and load_of(name, unit) not in (None, "force")


def _called(words: Sequence[str]) -> Load | None:
    """Return which load the words of a name are, if they say nothing else."""
    for load, pattern in _COMPOUND.items():
        said = [pattern.match(word) is not None for word in words]
        if any(said) and all(found or _PART.match(word) for found, word in zip(said, words, strict=True)):
            return load
    return None


def perhaps(name: str, unit: str) -> tuple[Load, str] | tuple[None, None]:
    """Return which load a word of a name without a unit speaks of, where others speak of something else, and its unit.

    Examples
    --------
    >>> perhaps("Torque arm X", "unknown"), perhaps("Torque side acc", "unknown"), perhaps("Torque arm X", "g")
    (('torque', 'N m'), (None, None), (None, None))
    """
    words = words_of(name)
    if unit.strip().lower() not in COUNTS or any(OF_VIBRATION.search(word) for word in words):
        return None, None
    return next(((load, SI[load]) for load, pattern in _WORD.items() if any(map(pattern.match, words))), (None, None))


def _says_nothing(unit: str) -> bool:
    return unit.lower() in COUNTS or unit.lower() in ("v", "mv", "uv", "µv")
