"""Functions of the user in expressions: Python functions of numbers, with derivatives by differences."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.dae.equations.expressions.opcodes import external_results
from gearmbs.dae.problem import ModelError
from gearmbs.kernels.pointers import PythonCallback

STEP = 6e-6
"""Relative step of first differences, the cube root of the rounding error."""
SECOND_STEP = 1e-4
"""Relative step of second differences, the fourth root of the rounding error."""
WIDE_STEP = 0.02
"""Step where all second derivatives are asked for, as for a constraint, of the size of an argument."""
SIZE = 0.1
"""Such a size, unless it is given or the argument is larger."""
FIRST = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
SECOND = (8 / 5, -1 / 5, 8 / 315, -1 / 560)
"""Central differences of eighth order, of one to four steps to either side; the second ones have -205/72 between."""
MIXED = (3 / 2, -3 / 5, 1 / 10)
"""Mixed differences of one to three steps, together of sixth order."""
LEAST = 1e-3
"""Arguments below it are differenced as if they were so large."""


class UserFunction:
    """A Python function that expressions may call by its name.

    Parameters
    ----------
    name : str
    function : callable
        Takes numbers, in the units of the expression that calls it, and returns one.
    partials : callable, optional
        Takes the same numbers and returns the derivatives by each of them; else they are made by differences.
    count : int, optional
        Of the arguments; default: those of the function.
    sizes : sequence of float, optional
        Sizes of the arguments over which the function changes much; second differences take steps of 2 % of them.

    Raises
    ------
    ModelError
        If it cannot be seen how many arguments it takes.
    """

    def __init__(
        self,
        name: str,
        function: Callable,
        partials: Callable | None = None,
        count: int | None = None,
        sizes: Sequence[float] | None = None,
    ) -> None:
        self.name, self.function, self.partials, self.sizes = name, function, partials, sizes
        self.count = _arguments(name, function) if count is None else count
        self.errors: list[BaseException] = []
        self._callback: Any = None

    @property
    def address(self) -> int:
        """Address by which compiled code calls it in this process."""
        if self._callback is None:
            self._callback = PythonCallback(self._call, self.count, external_results(self.count), self.errors)
        return int(self._callback.address)

    def _call(self, t: float, arguments: np.ndarray, _: np.ndarray, order: float, out: np.ndarray) -> None:
        x = arguments.tolist()
        out[0] = self.function(*x)
        if order == 1.0 and self.partials is not None:
            out[1 : 1 + self.count] = self.partials(*x)
        elif order == 1.0:
            for k in range(self.count):
                h = STEP * max(abs(x[k]), LEAST)
                out[1 + k] = (self._moved(x, k, h) - self._moved(x, k, -h)) / (2.0 * h)
        elif order == 2.0:
            h = SECOND_STEP * max(abs(x[0]), LEAST)
            after, before = self._moved(x, 0, h), self._moved(x, 0, -h)
            out[1], out[2] = (after - before) / (2.0 * h), (after - 2.0 * out[0] + before) / h**2
        elif order == 3.0:
            self._all_second(x, out)

    def _all_second(self, x: list[float], out: np.ndarray) -> None:
        """Write first partials and the matrix of second ones behind the value."""
        n = self.count
        sizes = self.sizes if self.sizes is not None else [SIZE] * n
        steps = [WIDE_STEP * max(abs(v), size) for v, size in zip(x, sizes)]
        second = out[1 + n :].reshape(n, n)
        if self.partials is not None:
            out[1 : 1 + n] = self.partials(*x)
            for k, h in enumerate(steps):
                around = [[np.array(self.partials(*_at(x, {k: m * h}))) for m in (i, -i)] for i in range(1, 5)]
                second[k] = sum(w * (after - before) for w, (after, before) in zip(FIRST, around)) / h
            second[:] = 0.5 * (second + second.T)
            return

        def value(moves: dict[int, float]) -> float:
            return float(self.function(*_at(x, moves)))

        for k, h in enumerate(steps):
            pairs = [(value({k: m * h}), value({k: -m * h})) for m in range(1, 5)]
            out[1 + k] = sum(w * (after - before) for w, (after, before) in zip(FIRST, pairs)) / h
            whole = sum(w * (after + before) for w, (after, before) in zip(SECOND, pairs)) - 205 / 72 * out[0]
            second[k, k] = whole / h**2
            for j, g in enumerate(steps[:k]):
                corners = [
                    (value({k: m * h, j: m * g}) + value({k: -m * h, j: -m * g})
                     - value({k: m * h, j: -m * g}) - value({k: -m * h, j: m * g})) / (4.0 * m**2 * h * g)
                    for m in range(1, 4)
                ]  # fmt: skip
                second[k, j] = second[j, k] = sum(w * corner for w, corner in zip(MIXED, corners))

    def _moved(self, x: list[float], k: int, h: float) -> float:
        return float(self.function(*x[:k], x[k] + h, *x[k + 1 :]))

    def raise_error(self) -> None:
        """Raise what went wrong in the function while compiled code called it.

        Raises
        ------
        ModelError
            With the error as its cause.
        """
        if self.errors:
            error = self.errors[0]
            self.errors.clear()
            if not isinstance(error, Exception):
                raise error
            where = "; ".join(filter(None, [place_of(error), *getattr(error, "__notes__", ())]))
            reason = f"{type(error).__name__}: {error}" + (f" ({where})" if where else "")
            raise ModelError(f"function '{self.name}': {reason}") from error

    def __getstate__(self) -> dict[str, Any]:
        # an address means nothing in another process
        return {**self.__dict__, "_callback": None, "errors": []}


def place_of(error: BaseException) -> str:
    """Return file and line of the user's code in which an error arose, "" if it arose in none."""
    own = str(Path(__file__).parents[2])
    frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith((own, "<"))]
    return f"{frames[-1].filename}, line {frames[-1].lineno}" if frames else ""


def _at(x: list[float], moves: dict[int, float]) -> list[float]:
    return [v + moves.get(k, 0.0) for k, v in enumerate(x)]


def _arguments(name: str, function: Callable) -> int:
    try:
        found = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        found = None  # type: ignore[assignment]
    if found is None or any(p.kind in (p.VAR_POSITIONAL, p.KEYWORD_ONLY) for p in found):
        raise ModelError(f"function '{name}': it cannot be seen how many numbers it takes; give count=")
    taken = [p for p in found if p.default is p.empty]
    if not taken:
        raise ModelError(f"function '{name}': it takes no numbers; a constant needs no function")
    return len(taken)


NOTHING = nullcontext()


def raised_errors(functions: Iterable[UserFunction]) -> AbstractContextManager[None]:
    """Raise what went wrong in functions of the user inside, instead of what followed from it."""
    called = list(functions)
    return _raised_errors(called) if called else NOTHING


@contextmanager
def _raised_errors(called: Sequence[UserFunction]) -> Iterator[None]:
    try:
        yield
    except Exception:
        for function in called:
            function.raise_error()
        raise
    for function in called:
        function.raise_error()
