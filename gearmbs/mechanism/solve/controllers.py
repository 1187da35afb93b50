"""Functions that set inputs of a held simulation at sample times, and what they remember in its states."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from inspect import signature
from typing import Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.dae.state import Memory


def warn_of_unmet(names: Iterable[str], stacklevel: int = 3) -> None:
    """Warn that a state has controllers of inputs which nobody has given again, so that these are held."""
    listed = ", ".join(map(repr, names))
    warnings.warn(
        f"state: it has the memory of controllers of {listed}, and none is given: what they set stays as it is; give "
        "them again with control(...) before advance",
        stacklevel=stacklevel,
    )


def check_takes(name: str, function: Callable[..., Any]) -> None:
    """Raise a ModelError if a function that is to control an input does not take a time and a simulator."""
    try:
        takes = signature(function)
    except ValueError:
        # some functions in C do not tell
        return
    try:
        takes.bind(0.0, None)
    except TypeError:
        raise ModelError(f"control: the controller of {name!r} takes {takes}; let it take (t, simulator)") from None


@dataclass
class Control:
    """A function that gives an input its value a sample time after the other."""

    name: str
    function: Callable[[float, Any], Any]
    start: float
    period: float
    count: int = 0

    @property
    def next(self) -> float:
        """Time of the next sample, s."""
        return self.start + self.count * self.period

    @property
    def remembers(self) -> bool:
        """Whether the function can tell what it remembers, and be told."""
        return all(callable(getattr(self.function, name, None)) for name in ("state", "restore"))

    def memory(self) -> Memory:
        """Return when it samples, and what the function remembers.

        Raises
        ------
        ModelError
            If that is no array of numbers.
        """
        told: Any = self.function.state()  # type: ignore[attr-defined]
        try:
            numbers = np.array(told, dtype=float)
        except (TypeError, ValueError):
            raise ModelError(
                f"control: state() of the controller of {self.name!r} returns {told!r}; let it return numbers"
            ) from None
        return Memory(np.array([self.start, self.period, self.count]), numbers)

    def go_back(self, t: float, memory: Memory | None) -> None:
        """Go on as it was at a time; without a memory the next sample is the first that is not before.

        Warns
        -----
        UserWarning
            If it cannot take the memory.
        """
        if memory is not None and self.remembers and memory.schedule[1] == self.period:
            self.start, self.count = float(memory.schedule[0]), int(memory.schedule[2])
            self.function.restore(memory.numbers.copy())  # type: ignore[attr-defined]
            return
        if memory is not None:
            theirs = float(memory.schedule[1])
            why, remedy = "it has no state() and restore(numbers)", "give it both"
            if self.remembers:
                why = f"it samples each {self.period:g} s, in the state each {theirs:g} s"
                remedy = f"take sample_time={theirs:g}"
            warnings.warn(
                f"control: the controller of {self.name!r} does not go on as in the state: {why}; {remedy}, or set "
                "what it remembers yourself",
                stacklevel=4,
            )
        self.count = max(0, int((t - self.start) / self.period) - 1)
        while self.next < t:
            self.count += 1
