"""Functions that a file defines itself, as expressions of their arguments, by ``function create``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from gearmbs.adams.view.expressions import Evaluator, Tree, parse, text_of
from gearmbs.adams.view.functions.known import FUNCTIONS
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item, Units

TYPES = ("array", "integer", "location_orientation", "object", "real", "string")
DEEPEST = 20
"""Functions of a file within each other, as macros."""
MOST_CALLS = 10_000
"""Calls of such functions for one value: each calls others, so that forty of them could ask for 2**40."""


@dataclass(frozen=True)
class Defined:
    """A function of a file.

    Attributes
    ----------
    name : str
    text : str
        As it was written, to be read anew when its arguments get other names.
    arguments : tuple of str
        Names of what it is called with, in small letters.
    body : tuple
    type : str
        One of `TYPES`.
    """

    name: str
    text: str
    arguments: tuple[str, ...]
    body: Tree
    type: str


def defined(what: str, now: Mapping[str, list[str]], before: Defined | None, units: Units, line: int) -> Defined:
    """Return the function that a command makes, or makes of another one.

    Parameters
    ----------
    what : str
        The words of the command, for messages.
    now : mapping of str to list of str
        Its arguments; those that are not there stay as before.
    before : Defined or None

    Raises
    ------
    ViewError
    """
    text = "".join(now.get("text_of_expression", [before.text if before else ""]))
    if not text.strip():
        raise ViewError(f"{what} needs text_of_expression", line)
    arguments = tuple(one.lower() for one in now.get("argument_names", before.arguments if before else ()) if one)
    for one in arguments:
        if not one.isidentifier() or arguments.count(one) > 1:
            raise ViewError(f"{what}: argument_names = {one[:40]}; give each a name of its own, of letters", line)
    kind = now.get("type", [before.type if before else "real"])[0].lower()
    kinds = [one for one in TYPES if one.startswith(kind)]
    if len(kinds) != 1:
        raise ViewError(f"{what}: type = {kind[:40]}; give one of {', '.join(TYPES)}", line)
    name = (now.get("new_function_name") or now["function_name"])[0].rpartition(".")[2]
    if name.upper() in FUNCTIONS or not name.isidentifier():
        why = "is one of View's own functions" if name.upper() in FUNCTIONS else "is no name of letters and digits"
        raise ViewError(f"{what}: function_name = {name[:80]} {why}; give another name", line)
    return Defined(name, text, arguments, parse(text, units, line), kinds[0])


class Scope:
    """What a function is called with, by names; each is evaluated once in each frame that it is asked in.

    Parameters
    ----------
    given : mapping of str to tree
    evaluator : callable
        From a frame to what evaluates expressions of the caller.
    elsewhere : callable
        From the name of no argument to what it stands for.
    """

    def __init__(
        self,
        given: Mapping[str, Tree],
        evaluator: Callable[[Item | None], Evaluator],
        elsewhere: Callable[[str], Any],
    ) -> None:
        self.given, self.evaluator, self.elsewhere = given, evaluator, elsewhere
        self.known: dict[tuple[str, int], Any] = {}

    def lookup(self, name: str, frame: Item | None) -> Any:
        """Return what a name stands for in the function.

        Raises
        ------
        ViewError
        """
        head, dot, rest = name.partition(".")
        tree = self.given.get(head.lower())
        if tree is None:
            return self.elsewhere(name)
        key = (head.lower(), id(frame))
        if key not in self.known:
            self.known[key] = self.evaluator(frame)(tree)
        value = self.known[key]
        if not dot:
            return value
        if not isinstance(value, Item):
            raise ViewError(f"{name[:80]}: {head[:40]} is {text_of(value)[:40]}, no object")
        return self.elsewhere(f"{value.path}.{rest}")


def checked(function: Defined, value: Any, evaluator: Evaluator) -> Any:
    """Return what a function gives, if it is of the type that it promises.

    Raises
    ------
    ViewError
    """
    number = isinstance(value, (int, float))
    fits = {
        "real": number,
        "integer": number and float(value).is_integer(),
        "string": isinstance(value, str),
        "object": isinstance(value, (Item, str, list)),
        "array": isinstance(value, list) or number,
        "location_orientation": isinstance(value, list) and len(value) == 3,
    }[function.type]
    if fits:
        return value
    shown = f"a list of {len(value)}" if isinstance(value, list) else text_of(value)[:40]
    raise evaluator.error(f"{function.name} gives {shown}; its type is {function.type}")
