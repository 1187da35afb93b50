"""Labels of columns as laboratories write them: names, units, and what a column is if it is no vibration.

Labels hold a name and a unit in one of the ways of standards and instruments: ``a [m/s^2]``, ``a (g)``, DIN 461's
``a / (m/s²)`` and ``a in m/s²``, ``t_ms``; in English, German, French, Czech and, of speeds, some more languages.
Names, units and values tell which columns hold times, speeds, angles, pulses of a tacho, temperatures or counts: what
is no vibration is not analysed as one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
import xarray as xr

from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.signal.loads import LOAD_WORDS, is_slow_load, is_unit_of_load, load_of, perhaps
from gearmbs.signals.signal.shapes import goes_on, steps_between_two_levels
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, shaft_coords, units_of, with_metadata
from gearmbs.signals.signal.times import SECONDS, SUFFIX
from gearmbs.signals.signal.units import detected_unit, is_usual, scaled, unit_dimension
from gearmbs.signals.signal.words import folded, words_of

BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]")
NAME_UNIT = re.compile(r"^(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*$")
QUOTIENT = re.compile(r"^(.*?\S)\s*/\s*(?:\((.+)\)|(\S.*?))\s*$")
"""DIN 461: a quantity by its unit."""
IN_WORDS = re.compile(r"^(.*?\S)\s+(?:in|en|v)\s+(?:\((.+)\)|(\S+))\s*$", re.IGNORECASE)
"""``t in ms``, in French and Czech ``en`` and ``v``."""
CLOCK_NAMES = frozenset(
    "time t times timesec timeseconds timestamp timestamps zeit zeitpunkt datetime elapsedtime relativetime "
    "xvalue sampletime tempo temps timems timeus cas".split()
)
RPM_UNITS = frozenset(
    "rpm 1/min min-1 min^-1 min⁻¹ u/min umin r/min rev/min tr/min t/min tpm ot/min ot./min otmin 1/minute giri/min "
    "obr/min obr./min varv/min omw/min rev./min об/мин".split()
)
THOUSANDS = frozenset(("krpm", "rpm x1000", "rpm x 1000", "rpm*1000", "x1000 rpm", "1000 rpm", "1000/min"))
"""Of turns a minute."""
TURNS = frozenset("rps u/s rev/s r/s tr/s ot/s".split())
HERTZ = frozenset("hz 1/s s-1 s^-1 s⁻¹".split()) | TURNS
OF_ROTATION = HERTZ | THOUSANDS | {"rad/s", "deg/s", "°/s"}
ANGULAR_COLUMN = re.compile(
    r"^omega\d*$|winkelgeschw|kreisgeschw|angularvel|angularspeed|angvel|vitesseangul|uhlov\w*rychlost|velocidadangular"
)
SPEED_COLUMN = re.compile(
    r"speed|rpm|drehzahl|drehfreq|drehgeschw|umdrehung|otack|otacek|otacen|vitesse(?!vib)|regimemoteur|^n$|^n\d$|"
    r"shaftfreq|rotation(al)?freq|rotfreq|^f_?rot$|frequencederotation|wellenfreq|" + ANGULAR_COLUMN.pattern
)
TRAVEL = frozenset(("km/h", "kmh", "kph", "mph"))
TRAVEL_COLUMN = re.compile(
    r"^v?wind\d*$|(wind|vehicle|fahr|vozid|vehicul|belt|band|conveyor|air|luft|flow|strom|fluid|gas|water)\w*"
    r"(speed|geschw|velocit|vitesse|rychlost)|(speed|geschw|velocit|vitesse|rychlost)\w*(wind|vent|vehic|fahr|vozid|belt|air|flow)"
)
"""Speeds of what is no shaft."""
NO_TRAVEL = re.compile(
    r"schwing|vib|kmit|lager|bearing|rotor|rotat|shaft|welle|hridel|turbin|generat|motor|engine|spind|pump|press|fan|"
    r"blow|ventil|gear|getriebe|wheel|pulley|scheibe"
)
SPEEDS_OF_TRAVEL = TRAVEL | {"m/s", "ft/s", "m/min", "kn", "kt", "knots"}
SHAFT_COLUMN = re.compile(r"shaft|welle|hridel|arbre|spindle|spindel|rotor|motor")
ANGLE_UNITS = frozenset(("deg", "°", "rad", "grad"))
FORWARD = 0.9
"""Share of the steps of a column of angles that go on: of a vibration half do, and each turn may have one step back."""
TACHO_COLUMN = re.compile(
    r"tach|keyph|trigger|pulse|impuls|encoder|drehgeber|zeroindex|indexpuls|toptour|otackomer|znacka|codeur|^tac$"
)
TEMPERATURE_COLUMN = re.compile(r"^temp(?!s$|o$|s\d)|temperatur|teplota|^oil$|^t(oil|amb|lager|lozisk)")
TEMPERATURE_UNITS = frozenset(("degc", "°c", "°f", "degf", "celsius", "deg c", "° c", "℃"))
COUNT_COLUMN = re.compile(r"^(index|idx|samples?|nr|no|row|cislo|vzorek|echantillon|point|punkt|count(er)?)$")
EVEN = 1e-3
"""Part of its span by which a column that counts or tells time may leave a straight line."""
FEWEST_EVEN = 16
STEADY = 0.2
"""Standard deviation by mean up to which a column named n, without a unit, is a speed."""
SLOW = 0.05
"""Standard deviation of its steps by its own up to which such a column is a run-up: of a vibration in its band they
are as large."""

SHARES = frozenset(("%", "percent"))
ANGLE_WORDS = ANGLE_UNITS | frozenset(
    "rev revs revolution revolutions turn turns u umdr umdrehung umdrehungen tr tour tours ot count counts tick ticks "
    "inc increments pulses lines v mv 1 - -- unknown".split()
    + [""]
)
"""Units, of none too, of columns that are angles or counts if they rise so, and of no vibration then."""
Role = Literal[
    "time", "speed", "tacho", "pulses", "temperature", "count", "angle", "turns", "share", "frequency", "travel"
]
SLOW_ROLES = ("speed", "temperature", "share", "frequency", "travel")
"""Columns of these may have fewer samples than the others, and are interpolated."""
UNIT_ASKED = "The unit of the speed in "
"""Begin of what is said of a speed that cannot be used as its unit is not known."""
WORDS: dict[str, str] = {
    "time": "holds times",
    "speed": "holds the speed",
    "tacho": "holds the pulses of a tacho",
    "pulses": "steps between two levels, as the pulses of a tacho do,",
    "temperature": "holds a temperature",
    "count": "counts or tells time: it rises evenly",
    "angle": "holds the angle of a shaft",
    "turns": "rises throughout, or again and again from end to end, as angles and counts do,",
    "share": "holds percents, as of a load,",
    "frequency": "holds a frequency",
    "travel": "holds the speed of something that is no shaft",
}


CONDITIONS = "conditions"
"""Attribute of a signal: means of the columns that say how the machine ran, by name."""
TOLD_RANGES = ("temperature", "travel")
"""Of these, as of loads, the report says between what they were."""


def key_of(name: str) -> tuple[str, str]:
    """A header's name without case, accents, blanks and path, and the unit in its brackets ("" without one)."""
    last = re.split(r"[./\\]", name.strip().rstrip(":."))[-1] if not BRACKETS.search(name) else name
    unit = BRACKETS.search(last)
    bare = re.sub(r"[^a-z0-9]", "", folded(BRACKETS.sub("", last)))
    return bare, unit.group(1).strip() if unit else ""


def name_and_unit(label: str) -> tuple[str, str]:
    """The name and the unit of a label; the unit is "unknown" without one.

    Examples
    --------
    >>> name_and_unit("acc [m/s^2]"), name_and_unit("a / (m/s²)"), name_and_unit("Drehzahl in 1/min")
    (('acc', 'm/s^2'), ('a', 'm/s²'), ('Drehzahl', '1/min'))
    >>> name_and_unit("left/right"), name_and_unit("Y[0]")
    (('left/right', 'unknown'), ('Y[0]', 'unknown'))
    """
    bare = label.strip()
    if bare.lower() in TURNS or ("/" in bare and is_unit_of_column(bare)):
        return bare, bare
    for pattern in (IN_WORDS, QUOTIENT):
        found = pattern.match(label)
        unit = (found.group(2) or found.group(3) or "").strip() if found else ""
        if found and is_unit_of_column(unit):
            return found.group(1).strip(), unit
    found = NAME_UNIT.match(label)
    if found and found.group(1) and not found.group(2).strip().isdigit():
        return found.group(1), found.group(2).strip() or UNKNOWN_UNITS
    return label, UNKNOWN_UNITS


def is_unit_of_column(text: str) -> bool:
    """Return whether a text is a unit that columns of recordings have."""
    low = text.lower()
    rotates = low in RPM_UNITS or low in OF_ROTATION
    told = low in TEMPERATURE_UNITS or low in TRAVEL or low in ("us", "µs")
    return told or rotates or is_usual(text) or is_unit_of_load(text)


def may_be_slow(name: str, unit: str) -> bool:
    """Return whether a column may have fewer samples than vibration beside it, and is interpolated then."""
    return role_of(name, unit) in SLOW_ROLES or is_slow_load(name, unit)


def is_clock(name: str) -> bool:
    """True for the names that columns of times have."""
    return key_of(SUFFIX.sub("", name))[0] in CLOCK_NAMES


def may_be_times(name: str, unit: str) -> bool:
    """Return whether a word of a name is one of times, as in "Time 2" or "t_acc", and its unit of nothing else."""
    low = unit.strip().lower()
    return not CLOCK_NAMES.isdisjoint(words_of(name)) and (low in ("", UNKNOWN_UNITS) or low in SECONDS)


def tells_time(name: str, unit: str) -> bool:
    """Return whether a column is called as times are and has no unit of something else, as a temperature T has."""
    low = unit.strip().lower()
    return is_clock(name) and (low in ("", UNKNOWN_UNITS) or low in SECONDS or not is_unit_of_column(unit))


def unique_names(names: Sequence[str]) -> list[str]:
    """Names made different by a number where they are not; empty ones become ch1, ch2 ..."""
    named = [name or f"ch{i + 1}" for i, name in enumerate(names)]
    return [n if named.count(n) == 1 else f"{n}_{named[:i].count(n) + 1}" for i, n in enumerate(named)]


LOW_LEVEL = 0.1
"""Part of the range within which the lower level of pulses is zero."""


def rises_evenly(values: np.ndarray) -> bool:
    """Return whether a column is a straight line up, as times are, also rounded ones, and counts of rows."""
    if values.size < FEWEST_EVEN or not np.isfinite(values[[0, -1]]).all():
        return False
    span = float(values[-1] - values[0])
    if not span > 0.0 or not np.all(np.diff(values) >= 0.0):
        return False
    straight = values[0] + span * np.linspace(0.0, 1.0, values.size)
    return float(np.abs(values - straight).max()) <= max(EVEN, 1.0 / values.size) * span


def role_of(name: str, unit: str, values: np.ndarray | None = None) -> Role | None:
    """Return what a column is, if it is no vibration.

    Parameters
    ----------
    name, unit : str
    values : ndarray, optional
        Where they are known, columns that rise evenly are counts or times, angles that go on are a shaft's, one that is
        called n and has no unit is a speed only if it keeps its sign and is nearly constant or changes slowly, and
        what stands at one of two levels or goes on from end to end is no vibration whatever it is called
        (`gearmbs.signals.signal.shapes`).
    """
    key, low = key_of(name)[0], unit.strip().lower()
    unknown = low in ("", UNKNOWN_UNITS, "-")
    timed = low in ("s", "ms", "us", "µs", "sec")
    named, electric = SPEED_COLUMN.search(key) is not None, low in ("v", "mv", "a", "ma")
    if (
        _turns(low)
        or (named and unit_of_rotation(name, unit) is not None)
        or (SHAFT_COLUMN.search(key) and low in HERTZ)
    ):
        return "speed"
    if TRAVEL_COLUMN.search(key) and not NO_TRAVEL.search(key) and (unknown or low in SPEEDS_OF_TRAVEL):
        return "travel"
    if low in TRAVEL:
        return "speed"
    if low in SHARES:
        return "share"
    if low in ("hz", "khz"):
        return "speed" if named else "frequency"
    if low in ANGLE_UNITS and values is not None and np.mean(np.diff(values) > 0.0) >= FORWARD:
        return "angle"
    if is_clock(name) and (unknown or timed):
        return "time"
    if low in TEMPERATURE_UNITS or (TEMPERATURE_COLUMN.search(key) and (unknown or low in ("k", "c", "f"))):
        return "temperature"
    if TACHO_COLUMN.search(key) and (unknown or low in ("v", "mv", "1")):
        return "tacho"
    if named and unknown:
        return _speed_or_count(key, values)
    if values is not None and rises_evenly(values) and (unknown or timed or COUNT_COLUMN.match(key)):
        return "count"
    # of no vibration either, as a voltage for the speed, or a unit that nobody knows
    if named and ((electric and len(key) > 1) or not _of_vibration(unit)):
        return "speed"
    return None if values is None else _by_shape(low, values)


def _by_shape(low: str, values: np.ndarray) -> Role | None:
    """Return what a column is by its values alone, whatever its name: pulses, and angles where no unit is told."""
    if steps_between_two_levels(values) and _may_be_pulses(low, values):
        return "pulses"
    return "turns" if low in ANGLE_WORDS and goes_on(values) else None


def _may_be_pulses(low: str, values: np.ndarray) -> bool:
    """Return whether what stands at two levels may be a tacho's pulses, by its unit.

    Teeth that rattle, and an accelerometer that is overloaded or shows its last digit, stand at two levels, too, and
    have their units. A unit that is told of all columns alike says less: pulses go from zero to some volts.
    """
    try:
        motion = unit_dimension(low)[0]
    except SignalError:
        return True
    least, span = float(values.min()), float(np.ptp(values))
    return motion not in ("displacement", "velocity", "acceleration") or (
        motion != "displacement" and span >= 1.0 and abs(least) <= LOW_LEVEL * span
    )


def _turns(low: str) -> bool:
    """Return whether a unit is one of turns, whatever has it."""
    parts = scaled(low)
    low = low if parts is None else parts[1]
    return low in RPM_UNITS or low in THOUSANDS or low in TURNS


def _of_vibration(unit: str) -> bool:
    try:
        return is_unit_of_column(unit) or bool(unit_dimension(unit))
    except SignalError:
        return detected_unit(unit) is not None


def _speed_or_count(key: str, values: np.ndarray | None) -> Role | None:
    """Return what a column named as speeds are is, without a unit; one called n may be anything that is no speed."""
    if values is None or len(key) > 2:
        return "speed"
    if rises_evenly(values):
        return "count" if np.all(np.diff(values) == 1.0) else "speed"
    mean, spread = float(values.mean()), float(values.std())
    steps = float(np.diff(values).std()) if values.size > 1 else spread
    one_way = values.min() >= 0.0 or values.max() <= 0.0
    return "speed" if one_way and (spread <= STEADY * abs(mean) or steps <= SLOW * spread) else None


def unit_of_rotation(name: str, unit: str) -> str | None:
    """Return the unit in which a column holds a speed, or None if it is none of rotation.

    A reciprocal second is a turn a second of a speed n, and a radian a second of an angular velocity; of the latter in
    Hz nobody knows.

    Examples
    --------
    >>> unit_of_rotation("Drehzahl", "1/s"), unit_of_rotation("omega", "1/s"), unit_of_rotation("n", "0.1 rpm")
    ('1/s', 'rad/s', '0.1 rpm')
    >>> unit_of_rotation("omega", "Hz"), unit_of_rotation("speed", "V")
    (None, None)
    """
    low, angular = unit.strip().lower(), ANGULAR_COLUMN.search(key_of(name)[0]) is not None
    if angular and low in HERTZ - TURNS:
        return None if low == "hz" else "rad/s"
    parts = scaled(low)
    base = low if parts is None else parts[1]
    return unit if base in RPM_UNITS or base in OF_ROTATION else None


def _in_rpm(name: str, unit: str) -> bool:
    return unit == UNKNOWN_UNITS and "rpm" in name.lower()


def _range_of(values: np.ndarray, unit: str) -> str:
    """Return in words between which values a column stays."""
    low, high = (f"{limit:.4g}" for limit in (np.nanmin(values), np.nanmax(values)))
    return f", {low if low == high else f'{low} to {high}'}{'' if unit == UNKNOWN_UNITS else f' {unit}'},"


def measured(
    signal: xr.DataArray, named: Iterable[str] = (), used: Iterable[str] = (), speed_known: bool = False
) -> tuple[xr.DataArray, str | None]:
    """Return a signal without the channels that are no vibration, noting them, and the one that holds the speed.

    Torques, currents, powers and forces beside others are left out as well: they say how the machine was loaded.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    named : iterable of str
        Channels that the caller asks for; they stay.
    used : iterable of str
        Channels that the caller uses otherwise, as tacho or speed; they stay, and nothing is said of them.
    speed_known : bool
        Whether the caller knows the speed; if neither he nor the signal does, the channel of it stays, too.

    Returns
    -------
    signal : xarray.DataArray
        With what says how the machine was loaded, or all of it, if nothing else would be left, which is noted.
    speed : str or None
        Channel of the speed, if it is to be used.

    Raises
    ------
    MissingMetadataError
        If several channels hold speeds and nothing else tells the shaft's.
    """
    names = [str(name) for name in signal["channel"].values]
    stay = {*named, *used}
    units = dict(zip(names, units_of(signal), strict=True))
    columns = [(n, units[n], v) for n, v in zip(names, signal.values.T, strict=True) if n not in stay]
    told = {n: role for n, unit, v in columns if (role := role_of(n, unit, v)) is not None}
    loads = {n: load for n, unit, _ in columns if n not in told and (load := load_of(n, unit)) is not None}
    words = {n: WORDS[role] for n, role in told.items()} | {n: LOAD_WORDS[load] for n, load in loads.items()}
    if {*names} - {*used} <= {*words}:
        # nothing else is there: of loads these are what was measured, else all
        kept = list(loads) or list(told)
        notes = [
            f"{n!r} {words[n].rstrip(',')}, as nothing else in the record is vibration: levels and lines are of that."
            for n in kept
            if loads.get(n) != "force"
        ]
    else:
        kept = []
        notes = [
            f"{n!r} is analysed as vibration; if it holds a {load}, say its unit, such as units={{{n!r}: {unit!r}}} "
            f"(--units '{n}={unit}')."
            for n, (load, unit) in ((n, perhaps(n, unit)) for n, unit, _ in columns if n not in words)
            if load is not None
        ]
    left_out = [n for n in words if n not in kept]
    if not notes and not left_out:
        return signal, None
    if kept and not loads:
        return with_metadata(signal, notes=[*signal.attrs.get("notes", ()), *notes]), None
    known = speed_known or signal.attrs.get("speed") is not None or bool(shaft_coords(signal))
    speeds = [name for name, role in told.items() if role == "speed"]
    usable = [name for name in speeds if unit_of_rotation(name, units[name]) is not None or _in_rpm(name, units[name])]
    used_speed = None
    if not known and len(usable) > 1:
        say = f"say which: speed_channel={usable[0]!r} (--speed-channel {usable[0]!r})"
        raise MissingMetadataError("speed", "the analysis", f"the columns {usable} hold speeds; {say}")
    if not known and usable:
        used_speed = usable[0]
        notes.append(f"The speed is that of the column {used_speed!r}; speed=... (--speed) says another.")
        unit = unit_of_rotation(used_speed, units[used_speed])
        if unit == "rad/s" != units[used_speed]:
            notes.append(
                f"{used_speed!r} is an angular velocity, its {units[used_speed]} is rad/s; if it holds turns a second, "
                f"say units={{{used_speed!r}: 'rps'}} (--units '{used_speed}=rps')."
            )
    elif not known and speeds:
        column = speeds[0]
        unit = units[column]
        what = "is missing" if unit.lower() in ("", UNKNOWN_UNITS, "-") else f"is {unit!r}, none of rotation"
        notes.append(
            f"{UNIT_ASKED}{column!r} {what}; say it to use it: units={{{column!r}: 'rpm'}} (--units '{column}=rpm')."
        )
    elif not known:
        pulses = sorted(
            (n for n, role in told.items() if role in ("tacho", "pulses")), key=lambda n: told[n] != "tacho"
        )[:1]
        notes += [
            f"If {name!r} is the frequency of the shaft, say so: speed_channel={name!r} (--speed-channel '{name}')."
            for name, role in told.items()
            if role == "frequency"
        ]
        notes += [f"{p!r} gives the speed: tacho={p!r} and pulses_per_rev (--tacho, --pulses)." for p in pulses]
    ranges = {n: _range_of(values, unit) for n, unit, values in columns if n in loads or told.get(n) in TOLD_RANGES}
    notes += [
        f"{n!r} {words[n]}{ranges.get(n, '')} and is not analysed as vibration." for n in left_out if n != used_speed
    ]
    left = signal.sel(channel=[name for name in names if name not in left_out or name == used_speed])
    told_by = {
        n: float(np.nanmean(v)) for n, _, v in columns if n in left_out and (n in ranges or told.get(n) == "share")
    }
    means = {CONDITIONS: told_by} if told_by else {}
    return with_metadata(left, notes=[*left.attrs.get("notes", ()), *notes], **means), used_speed
