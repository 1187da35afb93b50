"""Functions that set inputs of a held simulation at sample times, and what they remember in its states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.dae.state import Memory


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
        """Go on as it was at a time; without a memory the next sample is the first that is not before."""
        if memory is not None and self.remembers and memory.schedule[1] == self.period:
            self.start, self.count = float(memory.schedule[0]), int(memory.schedule[2])
            self.function.restore(memory.numbers.copy())  # type: ignore[attr-defined]
            return
        self.count = max(0, int((t - self.start) / self.period) - 1)
        while self.next < t:
            self.count += 1
