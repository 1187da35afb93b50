"""What the parts of a deck's writer know of it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.elements import State
from gearmbs.mechanism.expression_syntax import Units
from gearmbs.mechanism.parts import Body

COMPONENTS = ("FX", "FY", "FZ", "TX", "TY", "TZ")
COMPONENTS_OF = {"GFORCE": COMPONENTS, "VFORCE": COMPONENTS[:3], "VTORQUE": COMPONENTS[3:]}
"""Components of loads, by the statement that has them."""


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
    gears : {"expressions", "solids"}
        How contacts of wheels are written.
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
    states: dict[Any, int]
    splines: dict[Any, int]
    arrays: dict[Any, int]
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
