"""Sections of a case: validated, frozen, with one error of one line a fault, and the units that the user wrote."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError, model_validator
from pydantic_core import CoreSchema, core_schema

from gearmbs.units import DIMENSIONS, NUMBER, to_si
from gearmbs.wording import closest

# Quantities of a case: texts with units or plain numbers in SI, within a range that gears can have.
#
# The ranges are wide. They are there because a plain number is in SI: ``module = 3`` is three metres, and a pair of
# wheels of that size would be simulated without complaint.


SHOWN = {"mm": 1e-3, "deg": math.pi / 180.0, "rpm": math.pi / 30.0, "GPa": 1e9}
"""Units of messages that are not SI, and what they are in SI."""


@dataclass(frozen=True)
class Measure:
    """What a field of a case measures, between which limits.

    Attributes
    ----------
    dimension : str
        One of `gearmbs.units.DIMENSIONS`.
    low, high : float, optional
        Limits, included, in ``shown``.
    shown : str
        Unit of the limits and of messages; default the SI unit.
    each : bool
        Whether driver and driven may have values of their own, as a list of two.
    curve : bool
        Whether the value may be a curve, as a list of points (time, value); zero is possible there.
    """

    dimension: str
    low: float | None = None
    high: float | None = None
    shown: str = ""
    each: bool = False
    curve: bool = False

    @property
    def unit(self) -> str:
        """The SI unit the field holds."""
        return "1" if self.dimension == "dimensionless" else DIMENSIONS[self.dimension].replace("*", " ")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def read(self, value: Any) -> Any:
        """Return the value in SI, or for a list of two both.

        Raises
        ------
        ValueError
            For a wrong unit or a value outside the limits.
        """
        if value is None:
            return None
        if self.each and isinstance(value, Sequence) and not isinstance(value, str):
            if len(value) != 2:
                raise ValueError(f"{len(value)} values; give one for both wheels, or those of driver and driven")
            return tuple(self._one(item) for item in value)
        if self.curve and isinstance(value, Sequence) and not isinstance(value, str):
            return self._points(value)
        return self._one(value)

    def _points(self, value: Sequence) -> tuple[tuple[float, float], ...]:
        """Return the points of a curve in s and SI."""
        points: list[tuple[float, float]] = []
        for place, point in enumerate(value, 1):
            if isinstance(point, str) or not isinstance(point, Sequence) or len(point) != 2:
                raise ValueError(
                    f"a curve is a list of points [time, value] such as [['0 s', '0 {self.shown or self.unit}'], "
                    f"['2 s', ...]]; point {place} is {point!r}"
                )
            try:
                time = to_si(point[0], "time", "value")
                zero = to_si(point[1], self.dimension, "value") == 0.0
            except (TypeError, ValueError) as error:
                raise ValueError(f"point {place}: {str(error).removeprefix('value: ')}") from None
            if (
                not math.isfinite(time)
                or time < (points[-1][0] if points else 0.0)
                or (points and time == points[-1][0])
            ):
                raise ValueError(f"point {place} is at {time:g} s; give times from 0 on that increase")
            try:
                points.append((time, 0.0 if zero else self._one(point[1])))
            except ValueError as error:
                raise ValueError(f"point {place}: {error}") from None
        if len(points) < 2 or not any(number for _, number in points):
            raise ValueError("a curve needs two points at least, and one that is not zero")
        return tuple(points)

    def _one(self, value: Any) -> float:
        try:
            number = to_si(value, self.dimension, "value")
        except (TypeError, ValueError) as error:
            raise ValueError(str(error).removeprefix("value: ")) from None
        shown = self.shown or self.unit
        factor = SHOWN.get(shown, 1.0)
        low, high = (None if limit is None else limit * factor for limit in (self.low, self.high))
        if (low is None or number >= low * (1.0 - 1e-12)) and (high is None or number <= high * (1.0 + 1e-12)):
            return float(number)
        span = (
            f"{_number(self.low)} to {_number(self.high)}" if self.high is not None else f"{_number(self.low)} or more"
        )
        if self.low is None:
            span = f"up to {_number(self.high)}"
        if shown == "1":
            raise ValueError(f"give {span}")
        text = f"this is {number / factor:.6g} {shown}; give {span} {shown}"
        if isinstance(value, str):
            raise ValueError(text)
        meant = float(value) * factor
        if shown == self.unit or (low is not None and meant < low) or (high is not None and meant > high):
            raise ValueError(f"{text} (a plain number is in {self.unit})")
        raise ValueError(f"{text} (a plain number is in {self.unit}; write '{value} {shown}' if that is meant)")


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


Module = Annotated[float, Measure("length", 0.05, 100, "mm")]
FaceWidth = Annotated[float | tuple[float, float], Measure("length", 0.01, 2000, "mm", each=True)]
ToothLength = Annotated[float | tuple[float, float] | None, Measure("length", None, 300, "mm", each=True)]
WheelRadius = Annotated[float | tuple[float, float] | None, Measure("length", 0.1, 5000, "mm", each=True)]
BoreRadius = Annotated[float | tuple[float, float], Measure("length", 0, 5000, "mm", each=True)]
TipRounding = Annotated[float | tuple[float, float], Measure("length", 0, 100, "mm", each=True)]
ShaftRadius = Annotated[float, Measure("length", 0.1, 5000, "mm")]
ShaftLength = Annotated[float, Measure("length", 0.1, 50000, "mm")]
Shift = Annotated[float, Measure("length", -2000, 2000, "mm")]
DistanceError = Annotated[float, Measure("length", -100, 100, "mm")]
Backlash = Annotated[float, Measure("length", None, 20, "mm")]
Depth = Annotated[float, Measure("length", 1e-6, 10, "mm")]
PressureAngle = Annotated[float, Measure("angle", 5, 40, "deg")]
Misalignment = Annotated[float, Measure("angle", -10, 10, "deg")]
Density = Annotated[float, Measure("density", 10, 30000)]
WheelDensity = Annotated[float | tuple[float, float], Measure("density", 10, 30000, each=True)]
Modulus = Annotated[float | tuple[float, float], Measure("pressure", 0.001, 2000, "GPa", each=True)]
PoissonRatio = Annotated[float | tuple[float, float], Measure("dimensionless", 0, 0.499, each=True)]
Points = tuple[tuple[float, float], ...]
AngularSpeed = Annotated[float | Points, Measure("angular speed", 0.01, 1e6, "rpm", curve=True)]
TorqueValue = Annotated[float | Points, Measure("torque", 1e-6, 1e8, curve=True)]
RunUp = Annotated[float, Measure("time", 1e-5, 1000)]
Settling = Annotated[float, Measure("time", 0, 1000)]
Duration = Annotated[float, Measure("time", 1e-5, 10000)]
SamplingRate = Annotated[float | None, Measure("frequency", 1, 1e7)]
SlidingSpeed = Annotated[float, Measure("speed", 1e-6, 1000)]

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)

ROUND = 10.0
"""Plain speeds that are whole multiples of so many rad/s, and as many at least, look like rpm."""

TURNS = 300.0
"""Speeds of so many turns a second and more that are written in Hz look like rpm; hardly a gear turns as fast."""

HALF_METRE = 0.5
"""Plain lengths from here on, m, look like millimetres."""

HERTZ = re.compile(rf"({NUMBER.pattern})\s*Hz")


class CaseError(ValueError):
    """A case that cannot be simulated; the message names the field, the value and the remedy."""


class CaseWarning(UserWarning):
    """A value of a case that is possible but looks like a slip, such as a plain number meant in rpm."""


class _OneError(ModelMetaclass):
    """Let a section raise a CaseError wherever it is built."""

    def __call__(cls: Any, *args: Any, **data: Any) -> Any:
        if args:
            raise CaseError(f"{cls.label(data)}: give its fields by name, not by place")
        try:
            return super().__call__(**data)
        except ValidationError as error:
            raise CaseError(explained(error, cls, cls.label(data))) from None


class Section(BaseModel, metaclass=_OneError):
    """What all sections of a case share."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    section: ClassVar[str] = ""

    @classmethod
    def label(cls, data: Any) -> str:
        """Return how messages name what is built from ``data``."""
        return "case"

    @classmethod
    def checked(cls, data: Any, source: str) -> Any:
        """Return the section made of ``data``, which comes from ``source``.

        Raises
        ------
        CaseError
            Naming every wrong field with its value, each in a line.
        """
        try:
            return cls.__pydantic_validator__.validate_python(data)
        except ValidationError as error:
            raise CaseError(explained(error, cls, source)) from None

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Any:
        """Return the section made of a mapping, as pydantic does but with the package's own error."""
        try:
            return super().model_validate(obj, **options)
        except ValidationError as error:
            raise CaseError(explained(error, cls, cls.label(obj))) from None

    @classmethod
    def model_validate_json(cls, json_data: Any, **options: Any) -> Any:
        """Return the section made of JSON, as pydantic does but with the package's own error."""
        try:
            return super().model_validate_json(json_data, **options)
        except ValidationError as error:
            raise CaseError(explained(error, cls, cls.label({}))) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuse to set a field, in the package's own words.

        Raises
        ------
        CaseError
            For fields, which do not change, and for names that are none.
        """
        fields = type(self).model_fields
        if name in fields:
            raise CaseError(
                f"{self.section or 'case'}.{name}: a case does not change once it is made; "
                "case.changed(...) makes another one"
            )
        if not name.startswith("_"):
            raise CaseError(f"{self.section or 'case'}.{name}: {_unknown((name,), type(self))}")
        super().__setattr__(name, value)

    @model_validator(mode="wrap")
    @classmethod
    def _remember(cls, data: Any, handler: Any) -> Any:
        """Keep what the user wrote of quantities, and remark plain numbers that look like another unit."""
        made = handler(data)
        if isinstance(data, dict):
            measures = measures_of(cls)
            made.__dict__["given"] = {k: v for k, v in data.items() if k in measures and _has_text(v)}
            for name, measure in measures.items():
                if name in data:
                    _remark(f"{cls.section}.{name}", data[name], measure)
        return made

    def __repr_args__(self) -> Any:
        """What differs from the defaults, quantities as they were written; pydantic makes the text of it."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if name in self.model_fields_set and value != field.get_default(call_default_factory=True):
                yield name, self.written.get(name, value)

    @property
    def written(self) -> dict[str, Any]:
        """The quantities that the user wrote with units, as written."""
        return self.__dict__.get("given", {})


def measures_of(kind: type[BaseModel]) -> dict[str, Measure]:
    """Return what the fields of a section measure, by name."""
    return {
        name: item for name, field in kind.model_fields.items() for item in field.metadata if isinstance(item, Measure)
    }


def _has_text(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return any(_has_text(item) for item in value)
    return isinstance(value, str)


def _remark(field: str, value: Any, measure: Measure) -> None:
    """Warn of a plain number in SI, or a speed in Hz, that looks as if it were meant in the unit people use."""
    in_hertz = isinstance(value, str) and measure.dimension == "angular speed" and re.fullmatch(HERTZ, value.strip())
    if in_hertz and float(in_hertz[1]) >= TURNS:
        warnings.warn(
            f"{field} = {value!r} is {60.0 * float(in_hertz[1]):.6g} rpm; write '{in_hertz[1]} rpm' if that is meant, "
            f"'{60.0 * float(in_hertz[1]):.6g} rpm' if not",
            CaseWarning,
            stacklevel=6,
        )
    if isinstance(value, bool) or not isinstance(value, Real):
        return
    number, meant = float(value), ""
    if measure.dimension == "angular speed" and number >= ROUND and math.fmod(number, ROUND) == 0.0:
        meant, is_now = "rpm", f"rad/s, which is {number * 30.0 / math.pi:.6g} rpm"
    elif measure.dimension == "length" and abs(number) >= HALF_METRE:
        meant, is_now = "mm", f"m, which is {number * 1e3:.6g} mm"
    if meant:
        warnings.warn(
            f"{field} = {value!r} is a plain number and so in {is_now}; write '{value} {meant}' if that is meant, "
            f"'{value} {measure.unit}' if not",
            CaseWarning,
            stacklevel=6,
        )


WORDS = {
    **dict.fromkeys(("int_type", "int_from_float", "int_parsing"), "give a whole number"),
    **dict.fromkeys(("float_type", "float_parsing"), "give a number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "give true or false"),
    **dict.fromkeys(("tuple_type", "list_type"), "give a list"),
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type", "dataclass_type"), "give a table of keys"),
    "string_type": "give a text",
    "finite_number": "give a finite number",
    "missing": "is missing",
    "literal_error": "choose {expected}",
    "enum": "choose {expected}",
    "greater_than": "give more than {gt}",
    "greater_than_equal": "give {ge} or more",
    "less_than": "give less than {lt}",
    "less_than_equal": "give {le} or less",
    "too_short": "give {min_length} or more values",
    "too_long": "give {max_length} values at most",
}
"""What is said of kinds of faults; all others are told in the words of our own checks."""

OWN = ("value_error", "assertion_error")
WAYS = ("function-", "tuple[", "float", "constrained", "is-instance", "union[")
"""How ways to read one value begin in the place of a fault; they name no field."""


def explained(error: ValidationError, kind: Any, source: str) -> str:
    """Return what is wrong, each fault in a line of its own that begins with ``source``."""
    found: dict[tuple[str, str], list[Any]] = {}
    for item in error.errors(include_url=False):
        # one value given for both wheels is one fault, and so is one that can be read in none of several ways
        place = [part for part in item["loc"] if not str(part).startswith(WAYS)]
        both = bool(place) and isinstance(place[-1], int)
        wide = ".".join(map(str, place[:-1] if both else place))
        found.setdefault((wide, repr(item["input"])), []).append({**item, "loc": tuple(place)})
    lines = []
    for items in found.values():
        if len({item["loc"] for item in items}) > 1:
            items = [{**item, "loc": item["loc"][:-1]} for item in items]
        lines.append(_line(items, kind, source))
    return "\n".join(lines)


def _line(items: list[Any], kind: Any, source: str) -> str:
    """Return what is wrong with one value, which may be read in several ways."""
    item = items[0]
    loc = item["loc"]
    parts = [str(part) for part in loc]
    field = re.sub(r"\.(\d+)(?=\.|$)", r"[\1]", ".".join([*([kind.section] if kind.section else []), *parts]))
    if item["type"] == "extra_forbidden":
        return f"{source}: {field}: {_unknown(loc, kind)}"
    if item["type"] in ("model_type", "model_attributes_type", "dataclass_type"):
        return f"{source}: {field} = {item['input']!r}: give its keys, {', '.join(_owner(loc, kind).model_fields)}"
    message = " or ".join(dict.fromkeys(_said(one) for one in items)).replace(" or give ", " or ")
    if message.startswith("["):
        # one of several, named by its place
        return f"{source}: {field}{message}"
    # what is wrong with a section as a whole begins with the name of the field
    if isinstance(item["input"], (dict, BaseModel)) and item["type"] in OWN:
        return f"{source}: {field}.{message}" if field else f"{source}: {message}"
    if item["type"] == "missing":
        return f"{source}: {field} {message}"
    return f"{source}: {field} = {item['input']!r}: {message}"


def _said(item: Any) -> str:
    """Return what is wrong in our words."""
    if item["type"] in OWN:
        return str(item["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return WORDS.get(item["type"], "cannot be read").format(**item.get("ctx", {}))


def _owner(loc: tuple, kind: Any) -> Any:
    """Return the section that holds what is at a place."""
    for part in loc:
        inner = getattr(kind.model_fields.get(part), "annotation", None)
        if not (isinstance(inner, type) and issubclass(inner, BaseModel)):
            break
        kind = inner
    return kind


def _unknown(loc: tuple, kind: Any) -> str:
    """Return what is known in place of an unknown key, with the nearest of them all."""
    key, owner = str(loc[-1]), _owner(loc[:-1], kind)
    elsewhere = getattr(owner, "elsewhere", {})
    if key in elsewhere:
        return f"unknown key; {elsewhere[key]}"
    known = list(owner.model_fields)
    text = f"unknown key; known ones are {', '.join(known)}"
    near = closest(key, known)
    if not near:
        sections = {
            name: field.annotation.model_fields
            for name, field in kind.model_fields.items()
            if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)
        }
        places = {f"{name}.{inner}": inner for name, fields in sections.items() for inner in fields}
        close = closest(key, places.values())
        near = [place for place, inner in places.items() if close and inner == close[0]]
    return f"{text}; did you mean {' or '.join(near)}?" if near else text
