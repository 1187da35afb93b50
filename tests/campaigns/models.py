"""Cheap things to simulate, found by workers under their module's name."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import time
from typing import ClassVar

import numpy as np

from gearmbs.campaigns import Kept, Subject
from gearmbs.campaigns.subjects.base import SignalSpec

PI = 3.141592653589793
PLACES = {"x1": 0.0, "x2": 0.0, "x3": 0.0}


def ishigami(x1: float, x2: float, x3: float, a: float = 7.0, b: float = 0.1) -> dict:
    """Return Ishigami's function and a signal."""
    y = np.sin(x1) + a * np.sin(x2) ** 2 + b * x3**4 * np.sin(x1)
    return {"y": y, "wave": np.sin(x1 * np.arange(50))}


def burning(x1: float, x2: float, x3: float) -> dict:
    """Return the same after twenty milliseconds of processor time."""
    end = time.process_time() + 0.02
    while time.process_time() < end:
        pass
    return ishigami(x1, x2, x3)


def leaning(x1: float, x2: float, x3: float) -> dict:
    """Return the same with the help of a module that is imported late."""
    import colorsys

    return ishigami(x1, x2, x3) | {"hue": colorsys.rgb_to_hsv(0.2, 0.4, 0.6)[0]}


def moody(x1: float, x2: float, x3: float, mood: str = "good") -> dict:
    """Return the same, or go wrong in the way that ``mood`` says."""
    if mood == "impossible":
        raise ValueError("x1: no such thing")
    if mood == "fails":
        raise RuntimeError("did not converge")
    if mood == "endless":
        while True:
            pass
    if mood == "asleep":
        time.sleep(1e6)
    while mood == "deaf":
        with contextlib.suppress(BaseException):
            time.sleep(1e6)
    if mood == "hungry":
        return {"y": float(np.ones(1 << 31).sum())}
    if mood == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    return ishigami(x1, x2, x3)


def needy(x1: float, x2: float, x3: float) -> dict:
    """Return the same; beyond a bound only with a module that nobody has."""
    if x1 > 3.0:
        import a_module_that_nobody_has  # noqa: F401
    return ishigami(x1, x2, x3)


def picky(x1: float, x2: float, x3: float) -> dict:
    """Return the same for half of the values of the first."""
    if x1 > 0.0:
        raise ValueError(f"x1 = {x1} is beyond 0; give less")
    return ishigami(x1, x2, x3)


def silent(x1: float, x2: float, x3: float) -> dict:
    """Return the same for half of the values of the first, and no number for the others."""
    return ishigami(x1, x2, x3) | ({"y": np.nan} if x1 > 0.0 else {})


def several(x1: float, x2: float, x3: float) -> dict[str, float]:
    """Return a result, what tells the same, what tells something else, and what hardly varies."""
    y = x1 + 0.3 * x2 + 0.2 * x3
    return {"steady": 100.0 + x1 - 0.5 * x2 * x3, "y": y, "double": 2.0 * y + 1e-3, "square": x2 * x2}


class Ringing(Subject):
    """Something with teeth that rings for a tenth of a second, louder with a fault."""

    kind: ClassVar[str] = "tests.campaigns.models:Ringing"
    keeps: ClassVar[tuple[str, ...]] = ("numbers",)

    def settings(self):
        return {}

    @classmethod
    def from_settings(cls, settings):
        return cls()

    def base(self):
        return {"gears": {"teeth": [20, 40]}, "operation": {"speed": 100.0, "torque": 10.0}, "size": 0.0}

    def unit_of(self, path):
        return "1"

    def check(self, data, name):
        return data

    def canonical(self, thing):
        return thing

    def run(self, thing, progress, keep):
        t = np.arange(4000) / 10000.0
        size = thing["fault"]["teeth"][0]["size"] if thing["fault"]["teeth"] else 0.0
        return (1.0 + size) * np.sin(900.0 * t * thing["operation"]["speed"] / 100.0)

    def reduce(self, thing, record, keep):
        return Kept({"size": float(np.std(record))}, {"housing": record[None, :]})

    def signals(self, keep, things):
        return [SignalSpec("housing", ("housing",), 4000, 10000.0, "m/s^2")]


def adding(a: float = 1.0, b: float = 2.0, c: float = 3.0) -> dict[str, float]:
    """Return a sum."""
    return {"s": a + b + c}


def told(p: float | None = 5.0, i: int = 3) -> dict[str, float]:
    """Return what kind of things the arguments are."""
    return {"pp": -1.0 if p is None else p, "is_whole": float(isinstance(i, int)), "ii": i}


def tenfold(function):
    """Return a function that returns ten times as much under the same name."""

    @functools.wraps(function)
    def inner(**given: float) -> dict[str, float]:
        return {name: 10.0 * value for name, value in function(**given).items()}

    return inner


adding_tenfold = tenfold(adding)


@tenfold
def doubling(a: float = 1.0) -> dict[str, float]:
    """Return twice as much."""
    return {"s": 2.0 * a}
