"""Numbers, lists and long arguments as they are written in a deck."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.language.syntax import Units
from gearmbs.mechanism.parts.bodies import Body
from gearmbs.mechanism.parts.elements import State

WIDTH = 78
"""Characters in a line."""


def number(value: float) -> str:
    """Return a number with all the digits it needs to be read back."""
    return repr(float(value)).removesuffix(".0")


def listed(values: Iterable[float]) -> str:
    """Return numbers separated by commas."""
    return ", ".join(number(v) for v in values)


def wrapped(argument: str) -> list[str]:
    """Break an argument into continuation lines: lists at commas, expressions after operators."""
    lines, rest, lead = [], argument, ", "
    is_list = "(" not in argument
    while len(rest) > WIDTH - len(lead):
        cut = _break(rest, WIDTH - len(lead), is_list)
        if cut <= 0:
            break
        piece = rest[:cut].rstrip()
        # the comma that leads the next line separates the items of a list
        lines.append(lead + (piece.rstrip(",") if is_list else piece))
        rest, lead = rest[cut:].lstrip(), ",   "
    lines.append(lead + rest)
    return lines


def _break(text: str, limit: int, is_list: bool) -> int:
    """Return where to break, at most ``limit``: after a comma of a list, else after an operator between blanks.

    An expression without an operator in reach is broken after a comma between arguments.
    """
    operator = comma = 0
    for k in range(2, min(limit, len(text) - 1)):
        if text[k] != " ":
            continue
        if text[k - 1] == ",":
            comma = k
        elif text[k - 1] in "+-*/" and text[k - 2] == " ":
            operator = k
    return comma if is_list else operator or comma


def upper(key: Any) -> Any:
    """Return the name of a part as expressions have it, in capital letters; a number as it is."""
    return key.upper() if isinstance(key, str) else key


# What the parts of a deck's writer know of it.


COMPONENTS = ("FX", "FY", "FZ", "TX", "TY", "TZ")
COMPONENTS_OF = {"GFORCE": COMPONENTS, "VFORCE": COMPONENTS[:3], "VTORQUE": COMPONENTS[3:]}
"""Components of loads, by the statement that has them."""


@dataclass
class Plant:
    """What of a mechanism its deck has as a plant.

    Attributes
    ----------
    aliases : dict of key to str
        VARIABLEs that are an input under another name, as those that were read from a PINPUT: written once.
    inputs : list of str
        That are in no PINPUT yet.
    outputs : dict of str to str
        Expressions of outputs that are in no POUTPUT yet, by name.
    left_out : dict of str to str
        Outputs without an expression, and why.
    names : dict of key to str
        Outputs that VARIABLEs already are.
    """

    aliases: dict[Any, str] = field(default_factory=dict)
    inputs: list[str] = field(default_factory=list)
    outputs: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    names: dict[Any, str] = field(default_factory=dict)


class WriterContext(Protocol):
    """Ids of what a mechanism holds, and the statements written so far.

    Attributes
    ----------
    mechanism : Mechanism
    units : Units
        SI values of the units that are written.
    path : path or None
        Of the deck.
    markers, centers : dict of int to int
        Marker ids by ``id(marker)``, and of the marker at the centre of mass by ``id(body)``.
    elements : dict of (str, str) to int
        Ids by kind and name.
    kept : dict of str to str
        Kinds of the elements that are written as statements of their own.
    hidden : set
        Variables and states that such a statement stands for.
    all_states : dict of str to State
    variables, states, splines, arrays, plants : dict
        Ids by name.
    numbers : dict
        Inputs and parameters, for which variables stand, by name in capitals.
    gears : {"expressions", "solids"}
        How contacts of wheels are written.
    plant : Plant
        Inputs and outputs.
    """

    mechanism: Mechanism
    units: Units
    path: str | Path | None
    markers: dict[int, int]
    centers: dict[int, int]
    elements: dict[tuple[str, str], int]
    kept: dict[str, str]
    hidden: set[str]
    all_states: dict[str, State]
    variables: dict[Any, int]
    numbers: dict[Any, Any]
    states: dict[Any, int]
    splines: dict[Any, int]
    arrays: dict[Any, int]
    plant: Plant
    plants: dict[tuple[str, Any], int]
    gears: str

    def statement(self, head: str, arguments: Iterable[str], name: str | None = None) -> None:
        """Append a statement, one argument a line, with its name in a comment in front."""

    def comment(self, text: str) -> None:
        """Append a comment."""

    def new_marker(self, body: Body, position: np.ndarray, axes: np.ndarray, floating: bool = False) -> int:
        """Write a marker on a body and return its id."""

    def graphics(self, arguments: Iterable[str], name: str) -> int:
        """Write a GRAPHICS and return its id."""

    def expression(self, text: str) -> str:
        """Return an expression with names replaced by ids."""

    def gforce(self, name: str, i: int, jfloat: int, rm: int, given: dict[str, str], keyword: str = "GFORCE") -> None:
        """Write a GFORCE, VFORCE or VTORQUE with all its components."""
