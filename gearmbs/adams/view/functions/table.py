"""What a function of View's design-time expressions is, and the table that holds them all by their names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gearmbs.adams.view.expressions import Evaluator, text_of
from gearmbs.adams.view.model import Database, Item


class Values(Protocol):
    """What functions ask of a model: its objects, and where they are."""

    db: Database

    def point(self, item: Item) -> np.ndarray:
        """Return an object's position in the global frame."""

    def rotation(self, item: Item | None) -> np.ndarray:
        """Return the rotation of an object's frame in the global one."""

    def pose(self, item: Item | None) -> tuple[np.ndarray, np.ndarray]:
        """Return the rotation and the position of an object's frame in the global one."""


Run = Callable[[Values, Evaluator, list[Any], Item | None], Any]


@dataclass(frozen=True)
class Function:
    """A function: how many arguments it has, what it does, and whether it is one of places.

    ``placing`` says that its arguments are evaluated in the global frame.
    """

    least: int
    most: int
    run: Run
    placing: bool = False


FUNCTIONS: dict[str, Function] = {}


def item_of(values: Values, ev: Evaluator, value: Any) -> Item:
    """Return the object that a value is or names.

    Raises
    ------
    ViewError
        If there is none.
    """
    found = value if isinstance(value, Item) else values.db.find(text_of(value)) if isinstance(value, str) else None
    if found is None:
        raise ev.error(f"an object is wanted, not {text_of(value)[:60]}")
    return found
