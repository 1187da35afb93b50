"""Times of repeated calls: medians of processor time, the first call apart."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Timing:
    """Times of a call that was repeated.

    Attributes
    ----------
    cpu, wall : float
        Medians in seconds of processor time (all threads of this process) and of the clock on the wall.
    fastest : float
        Smallest processor time, s.
    repeats : int
        Calls behind these numbers.
    """

    cpu: float
    wall: float
    fastest: float
    repeats: int

    def as_dict(self) -> dict[str, float]:
        """Return the fields for JSON."""
        return asdict(self)


def measure(call: Callable[[], Any], repeats: int = 7, budget: float = 1.0) -> tuple[Timing, Any]:
    """Call up to ``repeats`` times, fewer once ``budget`` seconds are spent, and return the times and the last result.

    The caller warms up: compilation and caches are not part of these numbers.
    """
    cpu, wall, result = [], [], None
    begin = time.perf_counter()
    for _ in range(repeats):
        c, w = time.process_time(), time.perf_counter()
        result = call()
        cpu.append(time.process_time() - c)
        wall.append(time.perf_counter() - w)
        if time.perf_counter() - begin > budget:
            break
    return Timing(float(np.median(cpu)), float(np.median(wall)), min(cpu), len(cpu)), result


def seconds_per_call(call: Callable[[int], Any], calls: int = 1000, batches: int = 5) -> float:
    """Return the median over batches of the processor seconds one of ``calls`` repetitions inside ``call(n)`` takes."""
    call(1)
    times = []
    for _ in range(batches):
        start = time.process_time()
        call(calls)
        times.append((time.process_time() - start) / calls)
    return float(np.median(times))
