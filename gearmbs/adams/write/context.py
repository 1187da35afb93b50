"""What the parts of a deck's writer know of it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

import numpy as np

from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.expression_syntax import Units
from gearmbs.mechanism.parts import Body


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
    """

    mechanism: Mechanism
    units: Units
    path: str | Path | None
    markers: dict[int, int]
    centers: dict[int, int]
    elements: dict[tuple[str, str], int]

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
