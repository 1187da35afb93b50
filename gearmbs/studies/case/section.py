"""Sections of a case: validated, frozen, with one error of one line a fault, and the units that the user wrote."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError, model_validator

from gearmbs.schema.described import OWN, faults, path_of, remedy
from gearmbs.schema.quantities import Measure, no_truth
from gearmbs.units import NUMBER
from gearmbs.wording import did_you_mean, warn

# Quantities of a case: texts with units or plain numbers in SI, within a range that gears can have.
#
# The ranges are wide. They are there because a plain number is in SI: ``module = 3`` is three metres, and a pair of
# wheels of that size would be simulated without complaint.


Module = Annotated[float, Measure("length", 0.05, 100, "mm")]
FaceWidth = Annotated[float | tuple[float, float], Measure("length", 0.01, 2000, "mm", each=True)]
ToothLength = Annotated[float | tuple[float, float] | None, Measure("length", None, 300, "mm", each=True)]
WheelRadius = Annotated[float | tuple[float, float] | None, Measure("length", 0.1, 5000, "mm", each=True)]
BoreRadius = Annotated[float | tuple[float, float], Measure("length", 0, 5000, "mm", each=True)]
TipRounding = Annotated[float | tuple[float, float], Measure("length", 0, 100, "mm", each=True)]
ShaftRadius = Annotated[float, Measure("length", 0.1, 5000, "mm")]
ShaftLength = Annotated[float, Measure("length", 0.1, 50000, "mm")]
BearingDistance = Annotated[float | None, Measure("length", 0.1, 50000, "mm")]
HelixAngle = Annotated[float, Measure("angle", 0, 60, "deg")]
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
Duration = Annotated[float | Literal["auto"], Measure("time", 1e-5, 10000, word="auto")]
SamplingRate = Annotated[float | None, Measure("frequency", 1, 1e7)]
SlidingSpeed = Annotated[float, Measure("speed", 1e-6, 1000)]

NO_TRUTH = BeforeValidator(no_truth)
"""Of fields with numbers that measure nothing: pydantic takes true and false for 1 and 0."""

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
        with readable_errors(cls, cls.label(data)):
            return super().__call__(**data)


class Section(BaseModel, metaclass=_OneError):
    """What all sections of a case share."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    section: ClassVar[str] = ""

    @classmethod
    def label(cls, data: Any) -> str:
        """Return how messages name what is built from ``data``."""
        return "case"

    @classmethod
    def checked(cls, data: Any, source: str) -> Self:
        """Return the section made of ``data``, which comes from ``source``.

        Raises
        ------
        CaseError
            Naming every wrong field with its value, each in a line.
        """
        with readable_errors(cls, source):
            return cls.__pydantic_validator__.validate_python(data)

    # the options are those of pydantic, which has other ones in each version
    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """Return the section made of a mapping, as pydantic does but with the package's own error."""
        with readable_errors(cls, cls.label(obj)):
            return super().model_validate(obj, **options)

    @classmethod
    def model_validate_json(cls, json_data: Any, **options: Any) -> Self:
        """Return the section made of JSON, as pydantic does but with the package's own error."""
        with readable_errors(cls, cls.label({})):
            return super().model_validate_json(json_data, **options)

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
        if type(data) is cls and "checked" in vars(data):
            # a section taken over from another case, which does not change
            return data
        made = handler(data)
        made.__dict__["checked"] = True
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

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy as pydantic does, without what follows from values that the copy may have others of."""
        copy = super().model_copy(update=update, deep=deep)
        for name in copy.__dict__.keys() - type(self).model_fields.keys():
            del copy.__dict__[name]
        changed = update or ()
        copy.__dict__["given"] = {name: text for name, text in self.written.items() if name not in changed}
        return copy

    @property
    def written(self) -> dict[str, Any]:
        """The quantities that the user wrote with units, as written."""
        return self.__dict__.get("given", {})

    def settings(self) -> dict[str, Any]:
        """Return all settings, quantities as the user wrote them, else in SI."""
        return {**self.model_dump(), **self.written}

    def with_settings(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return all settings with some changed."""
        return {**self.settings(), **changes}


@cache
def measures_of(kind: type[BaseModel]) -> Mapping[str, Measure]:
    """Return what the fields of a section measure, by name."""
    items = ((name, item) for name, field in kind.model_fields.items() for item in field.metadata)
    return MappingProxyType({name: item for name, item in items if isinstance(item, Measure)})


def _has_text(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return any(_has_text(item) for item in value)
    return isinstance(value, str)


def _remark(field: str, value: Any, measure: Measure) -> None:
    """Warn of a plain number in SI, or a speed in Hz, that looks as if it were meant in the unit people use."""
    in_hertz = isinstance(value, str) and measure.dimension == "angular speed" and re.fullmatch(HERTZ, value.strip())
    if in_hertz and float(in_hertz[1]) >= TURNS:
        warn(
            f"{field} = {value!r} is {60.0 * float(in_hertz[1]):.6g} rpm; write '{in_hertz[1]} rpm' if that is meant, "
            f"'{60.0 * float(in_hertz[1]):.6g} rpm' if not",
            CaseWarning,
        )
    if isinstance(value, bool) or not isinstance(value, Real):
        return
    number, meant = float(value), ""
    if measure.dimension == "angular speed" and number >= ROUND and math.fmod(number, ROUND) == 0.0:
        meant, is_now = "rpm", f"rad/s, which is {number * 30.0 / math.pi:.6g} rpm"
    elif measure.dimension == "length" and abs(number) >= HALF_METRE:
        meant, is_now = "mm", f"m, which is {number * 1e3:.6g} mm"
    if meant:
        warn(
            f"{field} = {value!r} is a plain number and so in {is_now}; write '{value} {meant}' if that is meant, "
            f"'{value} {measure.unit}' if not",
            CaseWarning,
        )


@contextmanager
def readable_errors(kind: Any, source: str) -> Iterator[None]:
    """Turn what pydantic says into a CaseError, each fault in a line of its own that begins with ``source``."""
    try:
        yield
    except ValidationError as error:
        raise CaseError("\n".join(f"{source}: {_line(items, kind)}" for items in faults(error))) from None


def _line(items: list[Any], kind: Any) -> str:
    """Return what is wrong with one value, which may be read in several ways."""
    item = items[0]
    loc = item["loc"]
    field = path_of((kind.section, *loc) if kind.section else loc)
    if item["type"] == "extra_forbidden":
        return f"{field}: {_unknown(loc, kind)}"
    if item["type"] in ("model_type", "model_attributes_type"):
        return f"{field} = {item['input']!r}: give its keys, {', '.join(_owner(loc, kind).model_fields)}"
    message = remedy(items)
    if message.startswith("["):
        # one of several, named by its place
        return f"{field}{message}"
    # what is wrong with a section as a whole begins with the name of the field
    if isinstance(item["input"], (dict, BaseModel)) and item["type"] in OWN:
        return f"{field}.{message}" if field else message
    return f"{field} {message}" if item["type"] == "missing" else f"{field} = {item['input']!r}: {message}"


def _owner(loc: tuple, kind: Any) -> Any:
    """Return the section that holds what is at a place."""
    for part in loc:
        inner = sections_of(kind).get(part)
        if inner is None:
            break
        kind = inner
    return kind


def sections_of(kind: Any) -> dict[str, Any]:
    """Return the sections of a case by name."""
    kinds = {name: field.annotation for name, field in kind.model_fields.items()}
    return {name: one for name, one in kinds.items() if isinstance(one, type) and issubclass(one, BaseModel)}


def _unknown(loc: tuple, kind: Any) -> str:
    """Return what is known in place of an unknown key, with the nearest of them all."""
    key, owner = str(loc[-1]), _owner(loc[:-1], kind)
    elsewhere = getattr(owner, "elsewhere", {})
    if key in elsewhere:
        return f"unknown key; {elsewhere[key]}"
    known = list(owner.model_fields)
    places: dict[str, list[str]] = {}
    for name, section in sections_of(kind).items():
        for inner in section.model_fields:
            places.setdefault(inner, []).append(f"{name}.{inner}")
    other = did_you_mean(key, places, before="; ", shown=lambda inner: " or ".join(places[inner]))
    return f"unknown key; known ones are {', '.join(known)}{did_you_mean(key, known, before='; ', otherwise=other)}"
