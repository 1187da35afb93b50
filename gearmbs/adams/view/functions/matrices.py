"""Functions of vectors and matrices: lists of numbers, and lists of rows."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.adams.view.expressions import LARGEST_ARRAY, Evaluator, text_of
from gearmbs.adams.view.functions.table import FUNCTIONS, Function, Values
from gearmbs.adams.view.model import Item


def _vector(ev: Evaluator, value: Any, what: str, count: int | None = None) -> np.ndarray:
    numbers = ev.numbers(value)
    if not numbers or (count is not None and len(numbers) != count):
        raise ev.error(f"{what}: {len(numbers)} numbers; give {count or 'some'}")
    return np.array(numbers, float)


def _matrix(ev: Evaluator, value: Any, what: str, square: bool = False) -> np.ndarray:
    rows = [ev.numbers(row) for row in value] if isinstance(value, list) else []
    if not rows or not rows[0] or len({len(row) for row in rows}) != 1 or not isinstance(value[0], list):
        raise ev.error(f"{what}: give a matrix by its rows, such as {{[1, 2], [3, 4]}}")
    if square and len(rows) != len(rows[0]):
        raise ev.error(f"{what}: {len(rows)} rows of {len(rows[0])} numbers; give a square matrix")
    return np.array(rows, float)


def _checked(ev: Evaluator, found: np.ndarray, what: str) -> Any:
    if not np.all(np.isfinite(found)):
        raise ev.error(f"{what}: the result is no finite number")
    return found.tolist()


def _cross(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    one, other = (_vector(ev, given, "CROSS", 3) for given in args)
    return _checked(ev, np.cross(one, other), "CROSS")


def _dot(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    one = _vector(ev, args[0], "DOT")
    return _checked(ev, one @ _vector(ev, args[1], "DOT", one.size), "DOT")


def _det(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return _checked(ev, np.linalg.det(_matrix(ev, args[0], "DET", square=True)), "DET")


def _transpose(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return _matrix(ev, args[0], "TRANSPOSE").T.tolist()


SINGULAR = 1e15
"""Condition of a matrix of which no digit of the inverse is left in double precision."""


def _inverse(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    given = _matrix(ev, args[0], "INVERSE", square=True)
    if not np.linalg.cond(given) < SINGULAR:
        raise ev.error("INVERSE: the matrix is singular")
    return _checked(ev, np.linalg.inv(given), "INVERSE")


def _normalize(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    size = float(np.linalg.norm(_vector(ev, args[0], "NORMALIZE")))
    if not size > 0.0:
        raise ev.error("NORMALIZE: a list of zeros has no direction")
    return ev.each(lambda x: x / size, args[0])


def _reshape(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    """Return numbers in rows, from the first again where there are too few, as in the example of View's manual."""
    given, shape = _vector(ev, args[0], "RESHAPE"), [int(n) for n in ev.numbers(args[1])]
    if not 1 <= len(shape) <= 2 or min(shape) < 1 or np.prod(shape, dtype=float) > LARGEST_ARRAY:
        raise ev.error(f"RESHAPE: {shape}; give one or two numbers of members")
    return np.resize(given, shape).tolist()


def _down(ev: Evaluator, value: Any, what: str) -> bool:
    word = text_of(value).strip().lower()
    if word[:1] not in ("a", "d"):
        raise ev.error(f"{what}: {word[:20]!r}; give 'a' for ascending or 'd' for descending")
    return word[0] == "d"


def _order(ev: Evaluator, args: list[Any], what: str) -> tuple[np.ndarray, np.ndarray]:
    given = _vector(ev, args[0], what)
    return given, np.argsort(-given if _down(ev, args[1], what) else given, kind="stable")


def _sort(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    given, order = _order(ev, args, "SORT")
    return given[order].tolist()


def _sort_index(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return (1 + _order(ev, args, "SORT_INDEX")[1]).tolist()


def _reverse(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return args[0][::-1] if isinstance(args[0], list) else args[0]


def _element(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return int(ev.number(args[1]) in ev.numbers(args[0]))


def _series2(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    start, end, count = (ev.number(one) for one in args)
    if not 2 <= count <= LARGEST_ARRAY:
        raise ev.error(f"SERIES2 of {count:g} members; give two or more")
    return np.linspace(start, end, int(count)).tolist()


def _valat(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    """Return y at x between points by a line, and beyond them by the line of the last two."""
    x, at = _vector(ev, args[0], "VALAT"), ev.number(args[2])
    y = _vector(ev, args[1], "VALAT", x.size)
    if x.size < 2 or not np.all(np.diff(x) > 0.0):
        raise ev.error("VALAT: give two or more values of x in ascending order")
    k = int(np.clip(np.searchsorted(x, at) - 1, 0, x.size - 2))
    return _checked(ev, y[k] + (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * (at - x[k]), "VALAT")


FUNCTIONS |= {
    "CROSS": Function(2, 2, _cross),
    "DOT": Function(2, 2, _dot),
    "DET": Function(1, 1, _det),
    "TRANSPOSE": Function(1, 1, _transpose),
    "INVERSE": Function(1, 1, _inverse),
    "NORMALIZE": Function(1, 1, _normalize),
    "RESHAPE": Function(2, 2, _reshape),
    "SORT": Function(2, 2, _sort),
    "SORT_INDEX": Function(2, 2, _sort_index),
    "REVERSE": Function(1, 1, _reverse),
    "ELEMENT": Function(2, 2, _element),
    "SERIES2": Function(3, 3, _series2),
    "VALAT": Function(3, 3, _valat),
}
