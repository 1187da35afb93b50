"""Sections of a case: validated, frozen, with one error of one line a fault, and the units that the user wrote."""

from __future__ import annotations

import difflib
import math
import re
import warnings
from numbers import Real
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from gearmbs.studies.quantities import Measure
from gearmbs.units import NUMBER

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
    near = difflib.get_close_matches(key, known, n=1)
    if not near:
        sections = {
            name: field.annotation.model_fields
            for name, field in kind.model_fields.items()
            if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)
        }
        places = {f"{name}.{inner}": inner for name, fields in sections.items() for inner in fields}
        close = difflib.get_close_matches(key, places.values(), n=1)
        near = [place for place, inner in places.items() if close and inner == close[0]]
    return f"{text}; did you mean {' or '.join(near)}?" if near else text
