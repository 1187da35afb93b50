"""What a plan varies: quantities over a range or a list, choices among alternatives, specimens.

A factor takes some coordinates in the unit cube and turns them into columns of the plan's table, then a row of that
table into changes of the nested data of a case. Columns hold numbers in SI or texts.
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from gearmbs.campaigns.plans.paths import entries_of, entry_of, get_path, holds_several, set_entry, set_path
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.settings import whole as whole_number
from gearmbs.campaigns.subjects.base import Subject
from gearmbs.files import python_scalar
from gearmbs.schema.described import chosen, make
from gearmbs.units import to_si

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Factor:
    """A field over a range, or one of several values.

    Parameters
    ----------
    path : str
        Field of the subject, as "operation.torque".
    low, high : float or str
        Range, in SI or with units.
    scale : {"linear", "log"}
    values : sequence, optional
        Takes the place of the range: these values, equally likely.
    whole : bool
        Whole numbers, both ends included; with ``scale="log"`` k comes in proportion to log((k + 1)/k).
    levels : int, optional
        How many values of the range a grid takes; default 2.
    name : str, optional
        Of the column; default the path.

    Examples
    --------
    >>> Factor("operation.torque", "20 N m", "200 N m", scale="log").path
    'operation.torque'
    """

    path: str
    low: Any = None
    high: Any = None
    scale: Literal["linear", "log"] = "linear"
    values: tuple[Any, ...] = ()
    whole: bool = False
    levels: int | None = None
    name: str = ""

    def __post_init__(self) -> None:
        if not (isinstance(self.path, str) and isinstance(self.name, str) and isinstance(self.whole, bool)):
            raise CampaignError(f"factor {self.path!r}: path and name are texts, whole is true or false")
        if isinstance(self.values, str) or not isinstance(self.values, Sequence | np.ndarray):
            raise CampaignError(f"factor {self.path!r}: values = {self.values!r}; give a list of them")
        object.__setattr__(self, "values", tuple(python_scalar(v) for v in self.values))
        object.__setattr__(self, "name", self.name or self.path)
        if self.levels is not None:
            object.__setattr__(self, "levels", whole_number(self.levels, f"factor {self.path!r}: levels", 1))
        if bool(self.values) == (self.low is not None or self.high is not None):
            raise CampaignError(f"factor {self.path!r}: give low and high, or values")
        if self.values and (self.levels is not None or self.scale != "linear"):
            raise CampaignError(f"factor {self.path!r}: levels and scale are of a range; leave them out beside values")
        if not self.values and (self.low is None or self.high is None):
            raise CampaignError(f"factor {self.path!r}: low = {self.low!r}, high = {self.high!r}; give both")
        if self.scale not in ("linear", "log"):
            raise CampaignError(f"factor {self.path!r}: scale is {self.scale!r}; choose linear or log")

    @property
    def width(self) -> int:
        """Coordinates of the unit cube it takes."""
        return 1

    @property
    def count(self) -> int:
        """Values of a grid."""
        return len(self.values) or self.levels or 2

    def in_si(self, subject: Subject) -> Factor:
        """Return the factor with its texts in the subject's units.

        Raises
        ------
        CampaignError
            For unknown fields, wrong units, or a range that is empty.
        """
        unit = subject.unit_of(self.path)
        if self.values:
            values = tuple(number_in_si(v, unit, self.path) for v in self.values)
            if any(isinstance(v, (list, dict)) for v in values):
                raise CampaignError(
                    f"factor {self.path!r}: values are numbers, texts, truth values or None; take lists and tables by "
                    f"name, choose({self.path!r}, a=[...], b=[...])"
                )
            check_kinds(values, f"factor {self.path!r}: values")
            return Factor(self.path, values=values, whole=self.whole, name=self.name)
        low, high = (_real(v, unit, self.path) for v in (self.low, self.high))
        if not low < high:
            raise CampaignError(f"factor {self.path!r}: low = {low:g} is not below high = {high:g}")
        if self.whole and not (low.is_integer() and high.is_integer()):
            raise CampaignError(f"factor {self.path!r}: {low:g} to {high:g} is no range of whole numbers")
        if self.scale == "log" and low <= 0.0:
            raise CampaignError(f"factor {self.path!r}: low = {low:g} has no logarithm; give a positive one")
        return Factor(self.path, low, high, self.scale, whole=self.whole, levels=self.levels, name=self.name)

    def columns(self, u: np.ndarray) -> Columns:
        """Return the column for coordinates u, shape (n, 1), in [0, 1]."""
        x = u[:, 0]
        if self.values:
            place = np.minimum((x * len(self.values)).astype(int), len(self.values) - 1)
            return {self.name: np.array(self.values)[place]}
        low, high = float(self.low), float(self.high)
        if self.whole:
            drawn = low * ((high + 1.0) / low) ** x if self.scale == "log" else low + x * (high - low + 1.0)
            # a base may lie outside of the range
            found = np.where((x >= 0.0) & (x <= 1.0), np.minimum(np.floor(drawn), high), np.floor(drawn))
            return {self.name: found.astype(np.int64)}
        if self.scale == "log":
            return {self.name: _within(low * np.exp(x * math.log(high / low)), x, low, high)}
        return {self.name: _within(low + x * (high - low), x, low, high)}

    def places(self, u: np.ndarray) -> np.ndarray:
        """Return where the values lie in the range, 0 to 1, for coordinates u, (n, 1); NaN for those without order."""
        values = self.columns(u)[self.name]
        if values.dtype.kind not in "biuf":
            return np.full(u.shape, np.nan)
        ends = np.array(self.values or (self.low, self.high), dtype=float)
        found, low, high = values.astype(float), ends.min(), ends.max()
        if not self.values and self.scale == "log":
            found, low, high = np.log(found), math.log(low), math.log(high)
        return ((found - low) / (high - low or 1.0))[:, None]

    def coordinate(self, value: Any, unit: str) -> float:
        """Return where a value lies in the range, between 0 and 1."""
        if self.values:
            number = number_in_si(value, unit, self.path)
            if number not in self.values:
                raise CampaignError(f"{self.path}: {value!r} is none of {self.values}")
            return (self.values.index(number) + 0.5) / len(self.values)
        number = _real(value, unit, self.path)
        if self.scale == "log" and number <= 0.0:
            raise CampaignError(f"{self.path}: the base has {number:g}, which has no place on a logarithmic range")
        low, high = self.low, self.high
        if self.whole:
            if not float(number).is_integer():
                raise CampaignError(
                    f"{self.path}: the base has {number:g}, which is no whole number, as its range is of"
                )
            # the middle of its part of the coordinate
            number, high = number + 0.5, high + 1.0
        if self.scale == "log":
            return math.log(number / low) / math.log(high / low)
        return (number - low) / (high - low)

    def apply(self, data: dict[str, Any], row: Mapping[str, Any]) -> None:
        """Set the field in nested data."""
        set_path(data, self.path, python_scalar(row[self.name]))


@dataclass(frozen=True)
class Choice:
    """One of several alternatives of a field, each with ranges of its own.

    Parameters
    ----------
    path : str
        Field, as "fault.teeth", or a section, as "fault", of which each option sets some fields and leaves the others.
    options : dict
        Value or table by name. Two numbers or texts with units as an entry of a table, or of a table within, are its
        range, drawn uniformly, whole numbers as such:
        ``{"kind": "broken tooth", "lost": (0.1, 0.9), "tooth": (0, 28)}``; of a section
        ``{"misalignment": ("0.2 deg", "1 deg")}``.
    crossed : bool
        Take every point of the plan with each of the options, instead of choosing one: the same specimen and the same
        operating point in all states.
    name : str, optional
        Of the column with the option's name; default the path. Its ranges are in ``NAME.ENTRY``; ``severity`` is
        where in its range the first of an option lies, between 0 and 1.
    section : bool
        Whether the path is that of a section; a plan finds out.

    Examples
    --------
    >>> states = Choice(
    ...     "fault",
    ...     {
    ...         "healthy": {},
    ...         "broken": {"teeth": {"kind": "broken tooth", "lost": (0.2, 0.8)}},
    ...         "misaligned": {"misalignment": ("0.2 deg", "1 deg")},
    ...     },
    ...     crossed=True,
    ...     name="state",
    ... )
    >>> states.ranges
    {'healthy': [], 'broken': ['teeth.lost'], 'misaligned': ['misalignment']}
    """

    path: str
    options: dict[str, Any]
    crossed: bool = False
    name: str = ""
    section: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.name or self.path)
        if not (isinstance(self.options, Mapping) and self.options):
            raise CampaignError(f"choice {self.path!r}: give at least one option by name")

    @property
    def ranges(self) -> dict[str, list[str]]:
        """Names of the entries of each option that are ranges."""
        return {
            name: [k for k, v in entries_of(table) if _is_range(v) and not _are_words(v)]
            if isinstance(table, Mapping)
            else []
            for name, table in self.options.items()
        }

    @property
    def sets(self) -> list[str]:
        """Paths of the fields that it sets."""
        if not self.section:
            return [self.path]
        return [f"{self.path}.{key}" for key in dict.fromkeys(key for table in self.options.values() for key in table)]

    @property
    def width(self) -> int:
        """Coordinates of the unit cube it takes: which, and where in the ranges."""
        return (0 if self.crossed else 1) + max(len(names) for names in self.ranges.values())

    @property
    def severity(self) -> str:
        """Name of the column that says where in its range the first number of an option lies."""
        return "severity" if self.name == self.path else f"{self.name}.severity"

    @property
    def sized(self) -> list[str]:
        """Names of the options that have a range, and so a severity; it is 0 in the rows of the others."""
        return [name for name, keys in self.ranges.items() if keys]

    @property
    def count(self) -> int:
        """Values of a grid."""
        return len(self.options)

    def in_si(self, subject: Subject) -> Choice:
        """Return the choice with the ranges of its tables in SI."""
        section = subject.is_section(self.path)
        if not section:
            subject.unit_of(self.path)
        options = {}
        for name, table in self.options.items():
            if section and not isinstance(table, Mapping):
                raise CampaignError(
                    f"choice {self.path!r}: {name} = {table!r:.60}; give a table of fields of {self.path}"
                )
            if isinstance(table, Mapping):
                table = copy.deepcopy(dict(table))
                for key, value in entries_of(table):
                    if section:
                        subject.unit_of(f"{self.path}.{key.partition('.')[0]}")
                    if _is_range(value):
                        unit = self.unit_of_entry(subject, table, key)
                        if unit == "1" and any(isinstance(v, str) for v in value) and not _are_words(value):
                            raise CampaignError(
                                f"{self.path}.{name}.{key} = {value!r}: it has no unit here; give two numbers"
                            )
                        set_entry(table, key, _range_in_si(value, unit, f"{self.path}.{name}.{key}"))
            options[name] = list(table) if isinstance(table, tuple) else table
        made = Choice(self.path, options, self.crossed, self.name, section)
        made.check_severity()
        return made

    def check_severity(self) -> None:
        """Refuse a choice of which another column has the name of that of the severity.

        Raises
        ------
        CampaignError
        """
        mine = {self.name, *(f"{self.name}.{key}" for keys in self.ranges.values() for key in keys)}
        if self.severity in mine:
            which = "its own" if self.severity == self.name else f"that of its range {self.severity!r}"
            remedy = "give it another name, name='...'" if self.name == self.path else "leave its name out"
            raise CampaignError(
                f"choice {self.name!r}: its column {self.severity!r}, where in its range the first of an option lies, "
                f"has the name of {which}; {remedy}, or rename what is called severity"
            )

    def unit_of_entry(self, subject: Subject, table: Mapping[str, Any], key: str) -> str:
        """Return the SI unit of an entry of an option's table, by its key, or by the path to it in tables within."""
        outer, dot, inner = key.rpartition(".")
        if dot:
            return subject.table_unit(f"{self.path}.{outer}", get_path(table, outer), inner)
        return (
            subject.unit_of(f"{self.path}.{key}")
            if subject.is_section(self.path)
            else subject.table_unit(self.path, table, key)
        )

    def columns(self, u: np.ndarray, variant: np.ndarray | None = None) -> Columns:
        """Return the columns for coordinates u, shape (n, width), and the options' numbers if they are crossed."""
        names, ranges = list(self.options), self.ranges
        if self.crossed:
            which, rest = variant, u
        else:
            which, rest = np.minimum((u[:, 0] * len(names)).astype(int), len(names) - 1), u[:, 1:]
        assert which is not None
        found: Columns = {self.name: np.array(names)[which]}
        entries = dict.fromkeys(key for keys in ranges.values() for key in keys)
        for key in entries:
            found[f"{self.name}.{key}"] = np.full(which.size, np.nan)
        severity = np.zeros(which.size)
        for k, name in enumerate(names):
            here = which == k
            for place, key in enumerate(ranges[name]):
                low, high = get_path(self.options[name], key)
                x = rest[here, place]
                if isinstance(low, int) and isinstance(high, int):
                    found[f"{self.name}.{key}"][here] = np.minimum(np.floor(low + x * (high - low + 1)), high)
                else:
                    found[f"{self.name}.{key}"][here] = _within(low + x * (high - low), x, low, high)
                if place == 0:
                    severity[here] = x
        found[self.severity] = severity
        return found

    def places(self, u: np.ndarray) -> np.ndarray:
        """Return where the values lie in the ranges of what is chosen; NaN for the choice, which has no order."""
        columns = self.columns(u)
        found = u.copy()
        found[:, 0] = np.nan
        for name, keys in self.ranges.items():
            here = columns[self.name] == name
            for place, key in enumerate(keys, 1):
                low, high = get_path(self.options[name], key)
                found[here, place] = (columns[f"{self.name}.{key}"][here] - low) / (high - low or 1.0)
        return found

    def candidates(self, value: Any) -> Iterator[list[float]]:
        """Yield the coordinates of each option that may give a value; the middle of ranges that the option has not."""
        table = value[0] if isinstance(value, (list, tuple)) and len(value) == 1 else value
        for k, (name, keys) in enumerate(self.ranges.items()):
            places = [0.5] * (self.width - 1)
            for place, key in enumerate(keys):
                low, high = get_path(self.options[name], key)
                given = entry_of(table, key)
                if not (all(isinstance(v, (int, float)) for v in (given, low, high)) and low <= given <= high):
                    break
                whole = isinstance(low, int) and isinstance(high, int)
                # a whole number has a part of the range, whose middle is taken
                places[place] = (given - low + 0.5) / (high - low + 1) if whole else (given - low) / (high - low or 1.0)
            else:
                yield [(k + 0.5) / len(self.options), *places]

    def apply(self, data: dict[str, Any], row: Mapping[str, Any]) -> None:
        """Set the field in nested data to the chosen option with its values."""
        name = str(row[self.name])
        table = self.options[name]
        if isinstance(table, Mapping):
            chosen = copy.deepcopy(dict(table))
            for key in self.ranges[name]:
                value = float(row[f"{self.name}.{key}"])
                low, high = get_path(table, key)
                set_entry(chosen, key, int(value) if isinstance(low, int) and isinstance(high, int) else value)
            for path, found in {f"{self.path}.{k}": v for k, v in chosen.items()}.items() if self.section else ():
                several = isinstance(found, Mapping) and holds_several(data, path)
                set_path(data, path, [found] if several else found)
            if not self.section:
                set_path(data, self.path, [chosen] if holds_several(data, self.path) else chosen)
        else:
            set_path(data, self.path, table)


TEETH = "fault.teeth"
"""Field of a case that holds the faults of its teeth."""


@dataclass(frozen=True)
class Specimens:
    """Seeded draws of manufacturing errors: the physical individuals of a plan, and the groups of every split.

    Parameters
    ----------
    draws : int
        How many specimens.
    errors : dict
        Range by field, as ``{"fault.backlash": ("60 um", "140 um")}``, drawn uniformly for each specimen.
    faults : sequence of dict
        Tables added to ``fault.teeth``, or to the field that an entry ``path`` names, as "meshes.stage.faults"; entries
        that are ranges are drawn, and an entry ``"seed": "drawn"`` gets a seed of the specimen's own:
        ``{"kind": "manufacturing grade", "grade": 6, "wheel": "driver", "seed": "drawn"}``.
    seed : int
    name : str
        Of the column with the specimen's number.
    """

    draws: int
    errors: dict[str, Any] = field(default_factory=dict)
    faults: tuple[dict[str, Any], ...] = ()
    seed: int = 0
    name: str = "specimen"

    def __post_init__(self) -> None:
        if not isinstance(self.errors, Mapping):
            raise CampaignError(f"specimens: errors = {self.errors!r:.60}; give ranges by the paths of fields")
        if isinstance(self.faults, str | Mapping) or not all(isinstance(fault, Mapping) for fault in self.faults):
            raise CampaignError(f"specimens: faults = {self.faults!r:.60}; give a list of tables")
        object.__setattr__(self, "faults", tuple(self.faults))
        object.__setattr__(self, "draws", whole_number(self.draws, "specimens: draws", 1))
        object.__setattr__(self, "seed", whole_number(self.seed, "specimens: seed", 0))
        for path, given in self.errors.items():
            if not _is_range(given):
                raise CampaignError(f"specimens: {path} = {given!r}; give its two ends")

    @property
    def width(self) -> int:
        """Coordinates of the unit cube it takes."""
        return 1

    @property
    def count(self) -> int:
        """Values of a grid."""
        return self.draws

    def in_si(self, subject: Subject) -> Specimens:
        """Return the specimens with their ranges in SI."""
        errors = {path: _range_in_si(r, subject.unit_of(path), path) for path, r in self.errors.items()}
        if words := next((path for path, ends in errors.items() if _are_words(ends)), None):
            raise CampaignError(f"specimens: {words} = {self.errors[words]!r}; give the two ends as numbers")
        faults = []
        for table in self.faults:
            table = dict(table)
            for key, value in table.items():
                if _is_range(value):
                    unit = subject.table_unit(table.get("path", TEETH), table, key)
                    table[key] = _range_in_si(value, unit, f"specimens.{key}")
            faults.append(table)
        return Specimens(self.draws, errors, tuple(faults), self.seed, self.name)

    def columns(self, u: np.ndarray) -> Columns:
        """Return the specimens' numbers for coordinates u, shape (n, 1)."""
        return {self.name: np.minimum((u[:, 0] * self.draws).astype(np.int64), self.draws - 1)}

    def places(self, u: np.ndarray) -> np.ndarray:
        """Return NaN for coordinates u, shape (n, 1): specimens have no order."""
        return np.full(u.shape, np.nan)

    def apply(self, data: dict[str, Any], row: Mapping[str, Any]) -> None:
        """Set the specimen's errors in nested data."""
        generator = np.random.default_rng([self.seed, int(row[self.name])])
        for path, (low, high) in self.errors.items():
            set_path(data, path, float(generator.uniform(low, high)))
        for table in self.faults:
            drawn = dict(table)
            for key, value in table.items():
                if value == "drawn":
                    drawn[key] = int(generator.integers(1 << 31))
                elif _is_range(value):
                    low, high = value
                    if isinstance(low, int) and isinstance(high, int):
                        drawn[key] = min(math.floor(generator.uniform(low, high + 1)), high)
                    else:
                        drawn[key] = float(generator.uniform(low, high))
            path = drawn.pop("path", TEETH)
            set_path(data, path, [*(get_path(data, path) or ()), drawn])


AnyFactor = Factor | Choice | Specimens
FACTORS = {"factor": Factor, "choice": Choice, "specimens": Specimens}


def factor_table(factor: AnyFactor) -> dict[str, Any]:
    """Return a factor as a table of numbers and texts, from which `factor_from` makes it again."""
    kind = next(name for name, cls in FACTORS.items() if isinstance(factor, cls))
    table = {"type": kind, **asdict(factor)}
    if not table.get("section", True):
        # as plans have it whose choices are of fields
        del table["section"]
    return table


def factor_from(table: Mapping[str, Any]) -> AnyFactor:
    """Return the factor that a table describes.

    Raises
    ------
    CampaignError
        For unknown types and keys.
    """
    settings = dict(table)
    default = "choice" if "options" in settings else "specimens" if "draws" in settings else "factor"
    kind = settings.pop("type", default)
    cls = chosen(FACTORS, kind, "factor: ", CampaignError, "type")
    return make(cls, settings, f"{kind} {settings.get('path', '')}", CampaignError)


# options have names and values of the user's own
def choose(path: str, *, crossed: bool = False, name: str = "", **options: Any) -> Choice:
    """Return a choice among the options named; ``name`` is that of its column, the path by default. See `Choice`.

    Examples
    --------
    >>> choose("fault.teeth", none=(), broken={"kind": "broken tooth", "lost": (0.1, 0.9)}).width
    2
    """
    return Choice(path, options, crossed, name)


def check_kinds(values: Sequence[Any], where: str) -> None:
    """Refuse values that do not fit in one column of a table as what they are.

    Raises
    ------
    CampaignError
        For texts beside numbers, which would become texts, for truth values beside either, for numbers that are none,
        which stand for what is not given, and for whole ones beyond 64 bits.
    """
    kinds = {
        "texts" if isinstance(v, str) else "truth values" if isinstance(v, bool) else "numbers"
        for v in values
        if v is not None
    }
    if len(kinds) > 1:
        raise CampaignError(f"{where}: {' and '.join(sorted(kinds))} in one column; give values of one kind")
    if "numbers" in kinds:
        for v in values:
            if v is not None and not (abs(v) < 2**63 if isinstance(v, int) else v == v):
                raise CampaignError(f"{where}: {v!r} is no number, or a whole one beyond 64 bits")


def _within(values: np.ndarray, u: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return values of a range without what rounding adds to its ends; a base may lie outside of it."""
    inside = np.where(u == 1.0, high, np.clip(values, low, high))
    return np.where((u >= 0.0) & (u <= 1.0), inside, values)


def _is_range(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str) and len(value) == 2


def _are_words(ends: Sequence[Any]) -> bool:
    """Whether two values are texts that begin with no number, and so no range."""
    return all(isinstance(v, str) and not re.match(r"\s*[-+.]?\d", v) for v in ends)


def _range_in_si(ends: Sequence[Any], unit: str, where: str) -> list[Any]:
    """Return both ends of a range in SI; two texts without a unit are none, and stay as they are."""
    low, high = (number_in_si(v, unit, where) for v in ends)
    if not (_are_words(ends) or all(isinstance(v, int | float) and math.isfinite(v) for v in (low, high))):
        raise CampaignError(f"{where} = {ends!r}: two values are the ends of a range; give two numbers")
    if not _are_words(ends) and low > high:
        raise CampaignError(f"{where}: {ends[0]} is above {ends[1]}; give the lower end first")
    return [low, high]


def number_in_si(value: Any, unit: str, where: str) -> Any:
    """Return a value of a field in SI; texts of fields without a unit stay as they are, and so does None."""
    if unit == "1" or value is None or isinstance(value, (bool, list, tuple, dict)):
        return list(value) if isinstance(value, tuple) else value
    return _real(value, unit, where)


def _real(value: Any, unit: str, where: str) -> float:
    try:
        number = to_si(value, "dimensionless" if unit == "1" else unit, where)
    except (ValueError, TypeError) as error:
        raise CampaignError(str(error)) from None
    if not math.isfinite(number):
        raise CampaignError(f"{where}: {value!r} is not finite")
    return number
