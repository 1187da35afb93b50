"""Functions of numbers and of lists of numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from gearmbs.adams.view.expressions import Evaluator
from gearmbs.adams.view.functions.table import FUNCTIONS, Function, Values
from gearmbs.adams.view.model import Item


def _numeric(name: str, function: Callable[..., float], count: int = 1) -> None:
    FUNCTIONS[name] = Function(count, count, lambda values, ev, args, frame: ev.each(function, *args))


for _name, _math in {
    "ABS": abs, "SQRT": math.sqrt, "EXP": math.exp, "LOG": math.log, "LOG10": math.log10, "SINH": math.sinh,
    "COSH": math.cosh, "TANH": math.tanh, "INT": lambda x: int(x), "AINT": lambda x: float(int(x)),
    "NINT": lambda x: math.floor(abs(x) + 0.5) * (1 if x >= 0 else -1), "RTOI": lambda x: int(x),
    "ANINT": lambda x: float(math.floor(abs(x) + 0.5) * (1 if x >= 0 else -1)), "CEIL": math.ceil, "FLOOR": math.floor,
    "DTOR": math.radians, "RTOD": math.degrees,
}.items():  # fmt: skip
    _numeric(_name, _math)  # type: ignore[arg-type]
_numeric("MOD", math.fmod, 2)
_numeric("SIGN", lambda a, b: math.copysign(abs(a), b), 2)
_numeric("DIM", lambda a, b: max(a - b, 0.0), 2)


def _angular(name: str, function: Callable[..., float], count: int, inverse: bool) -> None:
    """Enter a trigonometric function: angles are in the model's unit of angle."""

    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
        radian = values.db.units.radian
        if inverse:
            return ev.each(lambda *x: function(*x) / radian, *args)
        return ev.each(lambda *x: function(*(one * radian for one in x)), *args)

    FUNCTIONS[name] = Function(count, count, run)


for _name in ("SIN", "COS", "TAN"):
    _angular(_name, getattr(math, _name.lower()), 1, inverse=False)
for _name in ("ASIN", "ACOS", "ATAN"):
    _angular(_name, getattr(math, _name.lower()), 1, inverse=True)
_angular("ATAN2", math.atan2, 2, inverse=True)


def _fold(names: str, fold: Callable[[list[float]], float]) -> None:
    def run(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
        return ev.each(lambda: fold(_some(ev, ev.numbers(args))))

    for name in names.split():
        FUNCTIONS[name] = Function(1, 50, run)


def _some(ev: Evaluator, numbers: list[float]) -> list[float]:
    if not numbers:
        raise ev.error("an empty list")
    return numbers


_fold("MIN", min)
_fold("MAX", max)
_fold("SUM", math.fsum)
_fold("PROD", math.prod)
_fold("MEAN", lambda x: math.fsum(x) / len(x))
_fold("NORM MAG", lambda x: math.sqrt(math.fsum(a * a for a in x)))
_fold("SSQ", lambda x: math.fsum(a * a for a in x))
_fold("RMS", lambda x: math.sqrt(math.fsum(a * a for a in x) / len(x)))


def _rows(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return len(args[0]) if isinstance(args[0], list) else 1


def _cols(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    first = args[0][0] if isinstance(args[0], list) and args[0] else args[0]
    return len(first) if isinstance(first, list) else 1


def _first(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return ev.member(args[0], [1])


def _last(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return ev.member(args[0], [len(args[0]) if isinstance(args[0], list) else 0])


def _stack(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[Any]:
    return [one for part in args for one in (part if isinstance(part, list) else [part])]


def _series(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[float]:
    start, step, count = (ev.number(one) for one in args)
    if not 0 <= count <= 10_000:
        raise ev.error(f"SERIES of {count} members")
    return [start + k * step for k in range(int(count))]


FUNCTIONS |= {
    "ROWS": Function(1, 1, _rows),
    "COUNT": Function(1, 1, _rows),
    "COLS": Function(1, 1, _cols),
    "FIRST": Function(1, 1, _first),
    "LAST": Function(1, 1, _last),
    "STACK": Function(2, 2, _stack),
    "APPEND": Function(2, 2, _stack),
    "SERIES": Function(3, 3, _series),
}
