"""What a type checker is told of the public names: what each returns, and which keywords it takes.

`tests/test_keywords.py` holds the tables of keywords to what they stand for, `tests/test_typed_calls.py` has a type
checker judge calls.
"""

from __future__ import annotations

import importlib
import inspect
import re
import typing
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import gearmbs as gm

ROOT = Path(gm.__file__).parent
FRONTS = sorted(
    ".".join(("gearmbs", *stub.parent.relative_to(ROOT).parts))
    for stub in ROOT.rglob("__init__.pyi")
    if "subjects" not in stub.parts and "expressions" not in stub.parts
)

ANYTHING = {
    "Campaign.case": "what a campaign simulates: a case, a train, a deck, an object of one's own",
    "Drivetrain.changed": "fields of whatever part has the name",
    "GearMesh.make": "a pair of contact, an ideal mesh, or one of a kind of one's own",
    "Measured.output": "an output of the mechanism is what its function returns",
    "Section.model_validate": "options of pydantic",
    "Section.model_validate_json": "options of pydantic",
    "Described.read": "a field as it was given",
    "choose": "options of a choice, by names of one's own",
    "dask_client": "options of dask-jobqueue",
    "with_metadata": "attributes of a signal, by names of one's own",
}
"""Public functions of which a type cannot say what they return or take, and why."""

OWN_SUBJECTS = re.compile(r"\w*Subject\.")
"""What a campaign asks of whatever it simulates, which its own class knows alone."""

HEADS = ("self", "cls")


def signatures() -> Iterator[tuple[str, Any]]:
    """Yield every public function and method once, by the name that a page would give it."""
    seen: set[Any] = set()
    for front in FRONTS:
        package = importlib.import_module(front)
        for name in package.__all__:
            value = getattr(package, name)
            if isinstance(value, ModuleType) or not callable(value) or value in seen:
                continue
            seen.add(value)
            if not isinstance(value, type):
                yield name, value
                continue
            for owner in value.__mro__:
                if owner.__module__.partition(".")[0] != "gearmbs":
                    continue
                for key, member in vars(owner).items():
                    function = getattr(member, "fget", getattr(member, "func", getattr(member, "__func__", member)))
                    if key.startswith("_") or not inspect.isfunction(function) or function in seen:
                        continue
                    seen.add(function)
                    yield f"{owner.__name__}.{key}", function


PUBLIC = dict(signatures())


def text(annotation: Any) -> str:
    """Return an annotation as it is written; nothing for one that is not there."""
    if annotation is inspect.Signature.empty:
        return ""
    return annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))


def told(function: Any) -> inspect.Signature:
    return inspect.signature(getattr(function, "py_func", function))


def overloaded(function: Any) -> bool:
    return bool(typing.get_overloads(inspect.unwrap(function)))


def open_ends(name: str, function: Any) -> list[str]:
    """Return what a type checker is not told of a function."""
    signature, found = told(function), []
    returned = text(signature.return_annotation)
    if not returned or (returned == "Any" and not overloaded(function)):
        found.append(f"{name} returns {returned or 'nobody knows what'}")
    for key, p in signature.parameters.items():
        if key in HEADS:
            continue
        kind = text(p.annotation)
        if not kind:
            found.append(f"{name}({key}) has no type")
        if p.kind is p.VAR_KEYWORD and kind == "Any" and not overloaded(function):
            found.append(f"{name}(**{key}) takes anything")
    return found


def is_compiled(function: Any) -> bool:
    """Kernels have the types of their signatures."""
    return hasattr(function, "py_func")


def test_public_functions_tell_what_they_return_and_take():
    assert len(PUBLIC) > 1000
    found = [
        line
        for name, function in PUBLIC.items()
        if name not in ANYTHING and not OWN_SUBJECTS.match(name) and not is_compiled(function)
        for line in open_ends(name, function)
    ]
    assert found == []


def test_no_exception_is_listed_in_vain():
    assert [name for name in ANYTHING if not open_ends(name, PUBLIC[name])] == []


def dimensions() -> Iterator[tuple[str, str, str]]:
    """Yield function, argument and type of whatever `takes_data` reads as text with a unit."""
    for name, function in PUBLIC.items():
        if "takes_data" in getattr(getattr(function, "__code__", None), "co_qualname", ""):
            closure = inspect.getclosurevars(function).nonlocals
            for key in closure.get("dimensions", {}):
                yield name, key, text(told(function).parameters[key].annotation)


@pytest.mark.parametrize(("name", "key", "kind"), list(dimensions()))
def test_arguments_that_are_read_as_texts_with_units_may_be_texts(name, key, kind):
    assert re.search(r"\b(Given|str|QuantityLike)\b", kind), kind
