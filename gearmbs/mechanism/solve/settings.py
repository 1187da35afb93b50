"""Inputs and parameters of a simulation that is held between calls: what is set, and when it takes effect."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.integrators.stepping.jumps import LED, ON_LINE
from gearmbs.dae.problem import INPUT, ModelError, Number, cells_of
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.wording import did_you_mean


class Change(NamedTuple):
    """What is to stand in the places of named numbers, and how that differs from what stands there."""

    values: np.ndarray
    loads: bool
    """Whether nothing changes but loads."""
    jumps: bool
    leads: bool
    """Whether rates jump."""
    prescribes: bool
    unsure: bool = False
    """Whether a rate jumps whose effect is not in proportion to it, or changes with the time."""
    bent: bool = False
    """Whether derivatives of the equations may change: elements, or expressions that more than one number stands in."""
    leaps: bool = False
    """Whether velocities jump: a rate that is prescribed does, or a position begins to change at another one."""


class Settings:
    """Inputs and parameters of a simulation.

    Parameters
    ----------
    numbers : mapping of str to Number
    aliases : mapping of str to str
        Further names, and what they stand for.
    parts : mapping of str to object
        What has numbers that cannot be set.

    Attributes
    ----------
    cells : ndarray of int
        All places in the table of numbers.
    held : ndarray
        What stands there from the last change on, a copy.
    led : dict of str to float
        Inputs on a line, and when it ends.
    waiting : dict of str to (float, int)
        What has been set and has not taken effect: value and hold.
    given : set of str
        What has been set since it was last looked at, though to the value that it had.
    places : dict of str to ndarray of int
        Inputs that stand nowhere as integrals, and all their places among the cells, see `jumps.steer`.
    plain : dict of str to (int, int)
        The first of their places among all of ``places``, and how many there are.
    bent : set of str
        Inputs that stand in expressions or elements, which may take them to a power or by a factor of the time: what
        a turn of their line would have done to the past is not known.
    """

    def __init__(self, numbers: Mapping[str, Number], aliases: Mapping[str, str], parts: Mapping[str, Any]) -> None:
        self.numbers, self.aliases, self.parts = numbers, aliases, parts
        self.cells = cells_of(numbers)
        # the same numbers where these cells alone are a table
        self._own = {name: number.moved_to(self.cells) for name, number in numbers.items()}
        self._inputs = [name for name, number in numbers.items() if number.kind == INPUT]
        self.places = {
            name: np.array([(place.at, place.size, place.bent) for place in self._own[name].places], dtype=np.int64)
            for name in self._inputs
            if not numbers[name].prescribes and all(p.size and p.order == 0 for p in numbers[name].places)
        }
        ends = np.cumsum([len(places) for places in self.places.values()]).tolist()
        self.plain = {
            name: (end - len(places), len(places))
            for (name, places), end in zip(self.places.items(), ends, strict=True)
        }
        self.bent = {name for name in self._inputs if any(p.bent for p in numbers[name].places)}
        self.waiting: dict[str, tuple[float, int]] = {}
        self.given: set[str] = set()
        self.led: dict[str, float] = {}
        self._numbers = np.empty(0)
        """The table of the run."""

    @property
    def held(self) -> np.ndarray:
        return self._numbers[self.cells]

    def begin(self, rdata: np.ndarray, t: float) -> None:
        """Take what stands in the table of a run, now and later; lines end at its time, ``t``."""
        self.waiting.clear()
        self._numbers = rdata
        if self.cells.size:
            held = self.held
            self.led = {name: t for name in self._inputs if self._own[name].line(held, t)[1] != 0.0}

    def go_back(self, led: tuple[str, ...], t: float) -> None:
        """Go back to an earlier time, at which the lines of some inputs end; the run has done so."""
        self.waiting.clear()
        self.given.clear()
        self.led = dict.fromkeys(led, t)

    def snapshot(self) -> tuple[Any, ...]:
        """Return what is set and what waits, for `put_back`."""
        return self._numbers, dict(self.waiting), dict(self.led), set(self.given)

    def put_back(self, snapshot: tuple[Any, ...]) -> None:
        """Let it be as it was."""
        self._numbers, waiting, self.led, given = snapshot
        self.waiting.update(waiting)
        self.given.update(given)

    def number(self, name: str) -> Number:
        """Return what is set under a name; raise a ModelError if there is nothing."""
        name = getattr(name, "name", name)
        known = self.aliases.get(name, name)
        if known in self.numbers:
            return self.numbers[known]
        element, _, field = str(known).partition(".")
        if hasattr(self.parts.get(element), field):
            raise ModelError(
                f"{known!r} cannot be changed while a simulation goes on: other numbers follow from it; make "
                "another mechanism with it and go on there from the state (initial=)"
            )
        names = [*self.aliases, *self.numbers]
        hint = did_you_mean(known, names, otherwise=did_you_mean(str(known).lower(), names))
        listed = f"there are {', '.join(names)}" if names else "the mechanism has none; add one with m.input(...)"
        raise ModelError(
            f"there is no input or parameter {known!r}{': ' + hint if hint else ''}; {listed}. What other numbers "
            "follow from, as masses, geometry and speeds of drives, takes another mechanism, which goes on from the "
            "state (initial=)"
        )

    def set(self, name: str, value: Any, hold: int = 0) -> None:
        """Let a number take another value from the next change on; see `Simulator.set`."""
        number = (self.numbers.get(name) if isinstance(name, str) else None) or self.number(name)
        if hold != 0 or isinstance(hold, bool):
            if isinstance(hold, bool) or hold != 1:
                raise ModelError(f"set: hold = {hold!r} of {name!r}; 0 holds the value, 1 goes there evenly")
            if number.kind != INPUT:
                raise ModelError(f"set: {name!r} is a {number.kind}, which jumps; hold=1 is for inputs")
        given = float(value if isinstance(value, float) else quantity(value, number.unit, f"set: {name!r}"))
        if not math.isfinite(given):
            raise ModelError(f"set: {name!r} = {given}; give a finite number")
        if wrong := number.allowed.wrong(given):
            raise ModelError(f"set: {name!r} = {given:g} {number.unit}; {wrong}")
        for row, order in number.prescribes if hold == 0 else ():
            if order == 0:
                raise ModelError(
                    f"set: {name!r} is the position of {row!r}, which cannot jump; give hold=1, or let it be the speed "
                    "of the motion (level='velocity')"
                )
        self.waiting[number.name] = given, int(hold)
        self.given.add(number.name)

    def value(self, t: float, name: str) -> float:
        """Return the present value of an input or a parameter, the one that was set last."""
        name = self.number(name).name
        value, hold = self.waiting.get(name, (0.0, 1))
        return self._own[name].value(self.held, t) if hold == 1 else value

    def on_the_way(self, t: float) -> str | None:
        """Return an input that is led to a value which it has not reached, None without one."""
        led = [name for name, (_, hold) in self.waiting.items() if hold]
        led += [name for name, end in self.led.items() if end > t and name not in self.waiting]
        return led[0] if led else None

    def steered(self) -> tuple[str, float, int, int, int] | None:
        """Return the one plain input that waits, and no line of another one may end: name, value, hold and places."""
        waiting, led = self.waiting, self.led
        if len(waiting) != 1:
            return None
        ((name, (value, hold)),) = waiting.items()
        places = self.plain.get(name)
        if places is None or (led and (len(led) > 1 or name not in led)) or (name in self.bent and (hold or led)):
            return None
        return name, value, hold, *places

    def take_steered(self, name: str, code: int, end: float) -> None:
        """Note that it has been steered, by what `jumps.steer` has returned."""
        self.waiting.clear()
        if code & LED:
            self.led[name] = end
        elif self.led:
            self.led.clear()

    def take(self, t: float, end: float) -> Change | None:
        """Return what changes at ``t``, None for nothing; lines that begin there end at ``end``."""
        waiting, before, after = self.waiting, self.held, self.held
        loads, jumps, leads, prescribes, unsure, bent, leaps = True, False, False, False, False, False, False
        ended = [name for name, last in self.led.items() if last <= t and name not in waiting] if self.led else ()
        for name in (*waiting, *ended):
            own = self._own[name]
            now, slope_before = own.line(before, t)
            value, hold = waiting.get(name, (now, 0))
            slope = (value - now) / (end - t) if hold else 0.0
            if hold and abs(slope - slope_before) * (end - t) <= ON_LINE * max(abs(now), abs(value)):
                # the line goes on
                slope = slope_before
            jumped, turned = not hold and value != now, slope != slope_before
            if jumped or turned:
                own.write(after, t, now if hold else value, slope)
                loads &= own.kind == INPUT or own.loads
                prescribes |= bool(own.prescribes)
                leaps |= any(jumped if order == 1 else turned and order == 0 for _, order in own.prescribes)
                jumps, leads, unsure = jumps or jumped, leads or turned, unsure or (turned and name in self.bent)
                bent |= name in self.bent
            self.led.pop(name, None)
            if slope:
                self.led[name] = end
        waiting.clear()
        if not (jumps or leads):
            return None
        return Change(after, loads, jumps, leads, prescribes, unsure, bent or not loads, leaps)
