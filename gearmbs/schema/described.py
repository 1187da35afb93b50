"""Dataclasses whose annotations say what their fields may hold, made in Python or from a table of a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from types import UnionType
from typing import Annotated, Any, ClassVar, TypeVar, Union, get_args, get_origin, get_type_hints

from gearmbs._shown import Written
from gearmbs.schema.messages import UNKNOWN, check_keys, faults, line, path_of, remedy
from gearmbs.schema.quantities import Measure, counts, flag, no_truth

T = TypeVar("T")


class Described(Written):
    """What dataclasses share whose fields are read by their annotations when they are made.

    Quantities become numbers in SI, with a `Measure` in the annotation; whatever else is annotated is read by
    pydantic, so that lists become tuples. A field whose default is None may be None.
    """

    error: ClassVar[type[ValueError]] = ValueError
    """What is raised of wrong values."""
    section: ClassVar[str] = ""
    """What messages call it; default its class."""

    @property
    def place(self) -> str:
        """What messages put in front of a field's name."""
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
        See `gearmbs.schema.messages.unknown`.
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
