"""Numbers of a model by name: where they stand in its tables, and how they are changed while a run is held.

An input is u(t) = u_0 + u_1 (t - t_0). Wherever it stands the tables hold t_0 and the coefficients of a polynomial
about it: of the input itself, or of its first or second integral where it is the speed or the acceleration of a motion.
To set it is to write t_0, u_0 and u_1; integrals go on from their value and rate. So no kernel knows of inputs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Table = Any
"""An array of numbers, or a list of them, which Python reads and writes one by one in a third of the time."""

INPUT = "input"
"""A number that is set while a run goes on, held or led along a line."""
PARAMETER = "parameter"
"""One that is constant until it is set, of the mechanism or of one of its elements."""


@dataclass(frozen=True)
class Place:
    """Where a number stands in a table of numbers.

    Attributes
    ----------
    at : int
        The number itself, or the time t_0 before its coefficients.
    size : int
        Number of coefficients; 0: the number alone stands there.
    order : int
        How often it is integrated there.
    factor : float
        What stands there for a unit of the number; of places without coefficients.
    table : int
        Which part of the table ``at`` counts in, as whoever makes the table knows; -1: the whole one.
    """

    at: int
    size: int = 0
    order: int = 0
    factor: float = 1.0
    table: int = -1

    def polynomial(self, table: Table, t: float) -> tuple[float, ...]:
        """Return the value at a time and all derivatives."""
        if self.size == 0:
            return (float(table[self.at]) / self.factor,)
        c = list(map(float, table[self.at + 1 : self.at + 1 + self.size]))
        x = t - float(table[self.at])
        found = []
        for order in range(self.size):
            value = 0.0
            for k in range(self.size - 1, order - 1, -1):
                value = value * x + c[k] * math.perm(k, order)
            found.append(value)
        return tuple(found)

    def write(self, table: Table, t: float, value: float, slope: float) -> None:
        """Let the number be ``value + slope (t' - t)`` from ``t`` on; its integrals go on from where they are."""
        if self.order == 0:
            # the coefficients behind stay zero
            table[self.at : self.at + 1 + min(self.size, 2)] = (
                (t, value, slope) if self.size else (self.factor * value,)
            )
            return
        known = self.polynomial(table, t)[: self.order]
        derivatives = [*known, value, slope]
        table[self.at] = t
        table[self.at + 1 : self.at + 1 + self.size] = [0.0] * self.size
        for k, derivative in enumerate(derivatives):
            table[self.at + 1 + k] = derivative / math.factorial(k)


@dataclass(frozen=True)
class Number:
    """A number of a model that can be changed by its name.

    Attributes
    ----------
    name : str
    unit : str
        Of SI.
    kind : {"input", "parameter"}
    places : tuple of Place
        An input's first place is its own, whatever uses it.
    prescribes : tuple of (str, int)
        Constraint rows whose function it is, and how often it is integrated there: 0 where it is a position itself.
    """

    name: str
    unit: str
    kind: str
    places: tuple[Place, ...]
    prescribes: tuple[tuple[str, int], ...] = ()

    def value(self, table: Table, t: float) -> float:
        """Return the value at a time."""
        place = self.places[0]
        at = place.at
        if self.kind == INPUT:
            return float(table[at + 1] + table[at + 2] * (t - table[at]))
        return float(table[at]) / place.factor

    def slope(self, table: Table) -> float:
        """Return the rate, zero of what is held."""
        return float(table[self.places[0].at + 2]) if self.kind == INPUT else 0.0

    def write(self, table: Table, t: float, value: float, slope: float = 0.0) -> None:
        """Let it be ``value + slope (t' - t)`` from ``t`` on, in all its places."""
        for place in self.places:
            place.write(table, t, value, slope)

    def placed(self, first: Callable[[int], int]) -> Number:
        """Return the number with all places counted in the whole table, in which a part begins at ``first(part)``."""
        return replace(self, places=tuple(replace(p, at=p.at + first(p.table), table=-1) for p in self.places))

    def moved_to(self, cells: np.ndarray) -> Number:
        """Return the number with its places in a table that holds those in ``cells``, which increase, alone."""
        return replace(self, places=tuple(replace(p, at=int(np.searchsorted(cells, p.at))) for p in self.places))

    def cells(self) -> np.ndarray:
        """Return all places in the table that :meth:`write` may write to."""
        return np.concatenate([np.arange(place.at, place.at + 1 + place.size) for place in self.places])


def cells_of(numbers: Mapping[str, Number]) -> np.ndarray:
    """Return all places in the table that any of some numbers may be written to, in their order."""
    return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(n.cells() for n in numbers.values())]))


__all__ = ["INPUT", "PARAMETER", "Number", "Place", "cells_of"]
