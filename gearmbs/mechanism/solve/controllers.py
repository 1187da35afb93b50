"""Functions that set inputs of a held simulation at sample times, and what they remember in its states."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from inspect import signature
from typing import Any

import numpy as np

from gearmbs.dae.problem import ModelError, Number
from gearmbs.dae.state import Memory, State
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.settings import Settings
from gearmbs.wording import warn

RESOLVED = 1e-12
"""Least sample time of a controller, and time between inputs that are set, as part of the end of the run: some thousand
times what tells two times apart there, 2e-16 of it, so that they lie where they are meant."""


def warn_of_unmet(names: Iterable[str]) -> None:
    """Warn that a state has controllers of inputs which nobody has given again, so that these are held."""
    listed = ", ".join(map(repr, names))
    warn(
        f"state: it has controllers of {listed}, and none is given: what they set stays as it is; give them again with "
        "control(...) before advance"
    )


def check_takes(label: str, function: Callable[..., Any], *wanted: str) -> None:
    """Raise a ModelError if a function that is to give an input its values does not take what it is called with."""
    try:
        takes = signature(function)
    except ValueError:
        # some functions in C do not tell
        return
    try:
        takes.bind(*wanted)
    except TypeError:
        raise ModelError(f"{label} takes {takes}; let it take ({', '.join(wanted)})") from None


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
        """Return when it samples, and what the function remembers: of one that cannot tell no numbers.

        Raises
        ------
        ModelError
            If that is no array of numbers.
        """
        schedule = np.array([self.start, self.period, self.count])
        if not self.remembers:
            return Memory(schedule, np.empty(0))
        told: Any = self.function.state()  # type: ignore[attr-defined]
        try:
            numbers = np.array(told, dtype=float)
        except (TypeError, ValueError):
            raise ModelError(
                f"control: state() of the controller of {self.name!r} returns {told!r}; let it return numbers"
            ) from None
        return Memory(schedule, numbers)

    def go_back(self, t: float, memory: Memory | None) -> None:
        """Go on as it was at a time; without a memory the next sample is the first that is not before.

        Warns
        -----
        UserWarning
            If it cannot take the memory.
        """
        knows = memory is not None and (self.remembers or not memory.numbers.size)
        if memory is not None and knows and memory.schedule[1] == self.period:
            self.start, self.count = float(memory.schedule[0]), int(memory.schedule[2])
            if memory.numbers.size:
                self.function.restore(memory.numbers.copy())  # type: ignore[attr-defined]
            return
        if memory is not None:
            theirs = float(memory.schedule[1])
            why, remedy = "it has no state() and restore(numbers)", "give it both"
            if knows:
                why = f"it samples each {self.period:g} s, in the state each {theirs:g} s"
                remedy = f"take sample_time={theirs:g}"
            warn(
                f"control: the controller of {self.name!r} does not go on as in the state: {why}; {remedy}, or set "
                "what it remembers yourself"
            )
        self.count = max(0, int((t - self.start) / self.period) - 1)
        while self.next < t:
            self.count += 1


class Sampled:
    """The part of a `gearmbs.Simulator` that lets functions set its inputs."""

    t: float
    t_end: float
    number: Callable[[str], Number]
    set: Callable[..., None]
    _settings: Settings
    _controls: list[Control]
    _unmet: list[str]
    _origin: State | None

    @property
    def awaited(self) -> list[str]:
        """Inputs that had controllers in the state gone on from, and that have none yet."""
        return list(self._unmet)

    def control(self, name: str, function: Callable[[float, Any], Any], sample_time: float) -> None:
        """Let a function give an input its value at sample times, which is held in between.

        Parameters
        ----------
        name : str
            An input or a parameter.
        function : callable
            ``function(t, simulator)`` returns the value. It is called at the present time and a sample time after the
            other, where the simulation then stands: :meth:`get` tells of that instant. With methods ``state()``, which
            returns numbers, and ``restore(numbers)``, which takes them as an array, what it remembers is in states of
            the simulator; else it is its own.
        sample_time : float
            s.

        Raises
        ------
        ModelError
            For a name that is not there or has a controller, the position of a motion, and a sample time that is not
            positive.

        Warns
        -----
        UserWarning
            If the state gone on from has a memory that the function cannot take.
        """
        number = self.number(name)
        name = getattr(name, "name", name)
        if not callable(function):
            raise ModelError(f"control: {function!r} for {name!r} cannot be called; give a function of t and simulator")
        check_takes(f"control: the controller of {name!r}", function, "t", "simulator")
        other = next((one.name for one in self._controls if self.number(one.name) is number), None)
        if other is not None:
            told = f", under its name {other!r}" if other != name else ""
            raise ModelError(f"control: {name!r} has a controller already{told}; let one function do what both are to")
        period = quantity(sample_time, "time", "control: sample_time")
        if not (np.isfinite(period) and period > 0.0):
            raise ModelError(f"control: sample_time = {period} s for {name!r}; it must be positive")
        if period < RESOLVED * self.t_end:
            raise ModelError(
                f"control: sample_time = {period:g} s for {name!r}: times up to t_end = {self.t_end:g} s are not told "
                f"apart by it; give {RESOLVED * self.t_end:.2g} s or more"
            )
        positions = [row for row, order in number.prescribes if order == 0]
        if positions:
            raise ModelError(
                f"control: {name!r} is the position of {positions[0]!r}, which cannot jump from sample to sample; let "
                "it be the speed of the motion (level='velocity') and control that"
            )
        made = Control(name, function, self.t, period)
        if self._origin is not None and self._origin.t == self.t and name in self._origin.controllers:
            made.go_back(self.t, self._origin.controllers[name])
        self._unmet = [other for other in self._unmet if other != name]
        self._controls.append(made)
        self.__dict__["_ready"] = None

    def _check_free(self, name: str) -> None:
        """Raise a ModelError if an input has a controller, which would write over what is set at its next sample."""
        number = self.number(name)
        if any(self.number(one.name) is number for one in self._controls):
            raise ModelError(
                f"set: {name!r} has a controller, which sets it at its samples; let that return the value, or make an "
                "input of your own beside it"
            )

    def _sample(self, t: float) -> float:
        """Call the controllers whose sample time has come; return the next one of any, or ``t`` if that is earlier."""
        own = self.__dict__
        for control in self._controls:
            if control.next <= self.t:
                # past the look at names, as in `_stand_at`
                own["_inside"] = control.name
                try:
                    value = control.function(self.t, self)
                finally:
                    own["_inside"] = ""
                try:
                    self._settings.set(control.name, value, 0)
                except ModelError as error:
                    raise ModelError(f"control: what the controller returns at t = {self.t:.6g} s: {error}") from None
                control.count += 1
        return min([t, *(control.next for control in self._controls)])
