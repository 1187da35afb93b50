"""What is said of mistakes in descriptions: place, field, value, remedy."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from gearmbs.schema.quantities import NoQuantity, OutOfRange
from gearmbs.wording import did_you_mean

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
