"""Dataclasses whose annotations say what their fields may hold, and what is said of mistakes: place, value, remedy.

Descriptions come from TOML files, or tables in Python, and are written as TOML.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar, Union, get_args, get_origin, get_type_hints

from gearmbs._display import Written
from gearmbs.schema.quantities import Measure, NoQuantity, OutOfRange, counts, flag, no_truth
from gearmbs.wording import did_you_mean, of_adams

if TYPE_CHECKING:
    from pydantic import ValidationError

WORDS = {
    **dict.fromkeys(("int_type", "int_from_float", "int_parsing"), "give a whole number"),
    **dict.fromkeys(("float_type", "float_parsing"), "give a number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "give true or false"),
    **dict.fromkeys(("tuple_type", "list_type", "iterable_type"), "give a list"),
    **dict.fromkeys(("dict_type", "model_type", "model_attributes_type", "mapping_type"), "give a table of keys"),
    "string_type": "give a text",
    "finite_number": "give a finite number",
    "missing": "is missing",
    "is_instance_of": "give a {class}",
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

UNKNOWN = "unknown key {!r}"
OWN = ("value_error", "assertion_error")
WAYS = ("function-", "tuple[", "float", "constrained", "is-instance", "union[", "nullable")
"""How ways to read one value begin in the place of a fault; they name no field."""

T = TypeVar("T")


def faults(error: ValidationError) -> list[list[Any]]:
    """Return what is wrong, a list for each value, with what pydantic says of each way to read it."""
    found: dict[tuple[str, str], list[Any]] = {}
    for item in error.errors(include_url=False):
        # one value given for both wheels is one fault, and so is one that can be read in none of several ways
        place = [part for part in item["loc"] if not str(part).startswith(WAYS)]
        both = bool(place) and isinstance(place[-1], int)
        wide = ".".join(map(str, place[:-1] if both else place))
        found.setdefault((wide, repr(item["input"])), []).append({**item, "loc": tuple(place)})
    for items in found.values():
        if len({item["loc"] for item in items}) > 1:
            items[:] = [{**item, "loc": item["loc"][:-1]} for item in items]
    return list(found.values())


def path_of(parts: Iterable[Any]) -> str:
    """Return a place in nested tables and lists: ``fault.teeth[1].lost``."""
    return re.sub(r"\.(\d+)(?=\.|$)", r"[\1]", ".".join(map(str, parts)))


def remedy(items: Sequence[Any]) -> str:
    """Return what is said of a value that can be read in none of some ways."""
    return " or ".join(dict.fromkeys(_said(one) for one in items)).replace(" or give ", " or ")


def _said(item: Any) -> str:
    if item["type"] in OWN:
        return str(item["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return WORDS.get(item["type"], "cannot be read").format(**item.get("ctx", {}))


def line(field: str, value: Any, cause: Any) -> str:
    """Return what is wrong with a field of an object: "speed is -1 rad/s; it must be positive"."""
    if isinstance(cause, OutOfRange):
        return f"{field} is {cause.said}"
    return f"{field}: {cause}" if isinstance(cause, NoQuantity) else f"{field} is {value!r}; {cause}"


def unknown(
    key: object, known: Iterable[str], form: str = UNKNOWN, shown: Callable[[str], str] = str, listed: bool = False
) -> str:
    """Return what is said of an unknown key: what may be meant, else or if ``listed`` what there is.

    Parameters
    ----------
    key
    known : iterable of str
    form : str
        How the key is named, with a place for it.
    shown : callable
        How what may be meant is written.
    listed : bool

    Examples
    --------
    >>> unknown("x", ["speed", "torque"])
    "unknown key 'x'; known ones are speed, torque"
    """
    known = list(known)
    names = f"; known ones are {', '.join(known)}"
    meant = did_you_mean(key, known, before="; ", otherwise="" if listed else names, shown=shown)
    return f"{form.format(key)}{names if listed else ''}{meant}"


def check_keys(
    table: Iterable[str], known: Iterable[str], where: str, error: type[ValueError], **words: Any
) -> None:  # fmt: skip
    """Refuse keys that are not known; ``words`` are those of `unknown`."""
    known = list(known)
    for key in table:
        if key not in known:
            raise error(f"{where}{': ' if where else ''}{unknown(key, known, **words)}")


def chosen(
    kinds: Collection[str], name: str, where: str, error: type[ValueError], what: str = "kind", otherwise: str = ""
) -> Any:
    """Return what stands under a name in a table of kinds, of a list the name, or say which there are."""
    if name not in kinds:
        hint = did_you_mean(name, kinds, before="; ")
        raise error(f"{where}{what} {name!r} is unknown; choose one of {', '.join(kinds)}{otherwise}{hint}")
    return kinds[name] if isinstance(kinds, Mapping) else name


class Described(Written):
    """What dataclasses share whose fields are read by their annotations when they are made.

    Quantities become numbers in SI, with a `Measure` in the annotation; whatever else is annotated is read by
    pydantic, so that lists become tuples. A field whose default is None may be None.
    """

    error: ClassVar[type[ValueError]] = ValueError
    """Class of the error that wrong values raise."""
    section: ClassVar[str] = ""
    """What messages call it; default its class."""

    @property
    def place(self) -> str:
        """Prefix of a field's name in messages."""
        return f"{self.section or type(self).__name__}."

    def __post_init__(self) -> None:
        from pydantic import ValidationError

        kind: Any = type(self)
        wrong = []
        for name, reader in _readers(kind).items():
            value = getattr(self, name)
            try:
                read = reader.validate_python(value)
            except ValidationError as error:
                for items in faults(error):
                    cause = items[0].get("ctx", {}).get("error", remedy(items))
                    wrong.append(self.place + line(path_of((name, *items[0]["loc"])), items[0]["input"], cause))
            else:
                if read is not value:
                    object.__setattr__(self, name, read)
        if wrong:
            raise self.error("; ".join(wrong))

    # a number, or as many as the measure says
    def read(self, field: str, value: Any, measure: Measure) -> Any:
        """Return what a value of a field is in SI, where its annotation cannot say what it measures."""
        try:
            return measure.as_given(value)
        except ValueError as error:
            raise self.error(self.place + line(field, value, error)) from None


@cache
def _hints(kind: Any) -> dict[str, Any]:
    hints = get_type_hints(kind, include_extras=True)
    return {f.name: hints[f.name] for f in fields(kind) if f.init}


@cache
def _readers(kind: Any) -> dict[str, Any]:
    """Return what reads the fields of a class, by name."""
    from pydantic import BeforeValidator, ConfigDict, InstanceOf, TypeAdapter

    config = ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False)
    optional = {f.name for f in fields(kind) if f.default is None}
    measures = measures_of(kind)

    def taken(hint: Any) -> Any:
        """Let objects be taken as they are."""
        if get_origin(hint) in (Union, UnionType):
            return Union[tuple(map(taken, get_args(hint)))]  # noqa: UP007
        return InstanceOf[hint] if is_dataclass(hint) else hint  # type: ignore[misc, valid-type]

    def reader(name: str, hint: Any) -> Any:
        allowed = taken(hint | None if name in optional else hint)
        if name not in measures and counts(hint):
            allowed = Annotated[allowed, BeforeValidator(no_truth)]
        elif hint in (bool, bool | None):
            allowed = Annotated[allowed, BeforeValidator(flag)]
        # pydantic wants no settings for a class alone
        return TypeAdapter(allowed, config=None if is_dataclass(hint) and name not in optional else config)

    return {name: reader(name, hint) for name, hint in _hints(kind).items() if hint is not Any}


def measures_of(kind: Any) -> dict[str, Measure]:
    """Return what the fields of a class of descriptions measure, by name, in their order."""
    return {name: item for name, hint in _hints(kind).items() for item in get_args(hint) if isinstance(item, Measure)}


def make(
    kind: type[T], table: Mapping[str, Any], where: str, error: type[ValueError], form: str = UNKNOWN, **others: Any
) -> T:
    """Return an object of a class of descriptions from a table of a file and what else is known of it.

    Parameters
    ----------
    kind : type
    table : mapping
        Fields by name.
    where : str
        What messages about its keys begin with, such as "[run]".
    error : type
    form : str
        See `gearmbs.schema.described.unknown`.
    **others
        Fields that the table does not hold.

    Raises
    ------
    ValueError
        ``error``, for unknown and missing keys; the class's own for wrong values.
    """
    known = [f for f in fields(kind) if f.init and f.name not in others]  # type: ignore[arg-type]
    check_keys(table, [f.name for f in known], where, error, form=form, shown=repr)
    for field in known:
        if field.default is MISSING and field.default_factory is MISSING and field.name not in table:
            raise error(f"{where}: {field.name!r} is missing")
    return kind(**others, **table)


def read_toml(path: str | Path, error: type[ValueError] = ValueError) -> dict[str, Any]:
    """Return the tables of a TOML file, with or without a byte order mark.

    Parameters
    ----------
    path : path-like
    error : type
        What is raised if it cannot be read, is no text or no TOML, with the path in front.
    """
    try:
        return toml_tables(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as caught:
        raise error(f"{path}: cannot be read ({caught.strerror or caught})") from None
    except UnicodeDecodeError:
        raise error(
            f"{path}: not a text file, so no description in TOML; records are read by `gearmbs analyse`"
        ) from None
    except tomllib.TOMLDecodeError as caught:
        raise error(f"{path}: not a valid TOML file ({caught}){of_adams(path)}") from None


def toml_tables(text: str) -> dict[str, Any]:
    """Return the tables of a text in TOML."""
    return tomllib.loads(text)


def toml_value(value: Any) -> str:
    """Return a value as TOML writes it.

    Examples
    --------
    >>> toml_value(["20 mm", 0.5, True])
    '["20 mm", 0.5, true]'
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # TOML wants DEL escaped, too
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return repr(value)


def toml_table(header: str, values: Mapping[str, Any]) -> list[str]:
    """Return the lines of a table with its header, as ``[run]``, an empty line before; what is None is left out."""
    rows = [f"{name} = {toml_value(value)}" for name, value in values.items() if value is not None]
    return ["", header, *rows] if rows else []
