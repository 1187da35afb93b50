"""Runs whose inputs are given over time: held at values, led along lines, or by functions at their sample times."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.parts.quantities import quantities
from gearmbs.mechanism.solve.controllers import RESOLVED, check_takes
from gearmbs.mechanism.solve.simulator import REFUSED, Simulator
from gearmbs.progress import time_bar

if TYPE_CHECKING:
    from gearmbs.dae.state import State
    from gearmbs.mechanism.mechanism import Mechanism

REMEDY = "give a number, (times, values), (times, values, 1) for lines between them, or (function, sample_time)"


@dataclass(frozen=True)
class Table:
    """An input over time: values from each time on, or straight lines between them."""

    name: str
    times: np.ndarray
    values: np.ndarray
    hold: int

    def set(self, sim: Simulator, end: float) -> None:
        """Set the input for the way from the present time to another one, between which no time of it lies."""
        if self.hold == 1:
            sim.set(self.name, float(np.interp(end, self.times, self.values)), 1)
        else:
            sim.set(self.name, self.values[np.searchsorted(self.times, sim.t, side="right") - 1])


def simulate_led(
    mechanism: Mechanism, t_eval: np.ndarray, inputs: Mapping[str, Any], *, advice: Any = None, progress: Any = None,
    initial: State | None = None, **options: Any,
) -> Solution:  # fmt: skip
    """Return the solution of a run whose inputs are given, at some times; see `gearmbs.mechanism.simulate`.

    Raises
    ------
    ModelError
        For an input that is not there, values that cannot be its own, times that do not increase or begin after the
        run, and options that a `Simulator` does not have.
    """
    if not isinstance(inputs, Mapping):
        raise ModelError(f"inputs: {inputs!r}; give a mapping from names to values")
    for option in REFUSED:
        if option in options:
            raise ModelError(f"inputs: a run with inputs has no {option}; leave it away, or give rate or t_eval")
    start = float(t_eval[0]) if initial is None else 0.0
    sim = Simulator(mechanism, float(t_eval[-1]), t_start=start, advice=advice, initial=initial, **options)
    _check_once(sim, inputs)
    tables = [table for name, given in inputs.items() if (table := _begin(sim, name, given)) is not None]
    for table in tables:
        value = float(np.interp(sim.t, table.times, table.values))
        if table.hold == 1 and (now := sim.get("input", table.name)) != value:
            positions = [row for row, order in sim.number(table.name).prescribes if order == 0]
            if positions:
                raise ModelError(
                    f"inputs: {table.name!r} is {value:g} at {sim.t:g} s, and the position of {positions[0]!r}, which "
                    f"stands at {now:g} there and cannot jump; begin with {now:g}"
                )
            sim.set(table.name, value)
    sim.take_effect()
    stops = np.unique(np.concatenate([t_eval, *(table.times for table in tables)]))
    stops = stops[(stops > sim.t) & (stops <= t_eval[-1])].tolist()
    wanted, apart, begun = set(t_eval.tolist()), RESOLVED * sim.t_end, sim.t
    bar = time_bar(progress, mechanism.name, sim.t, sim.t_end)
    try:
        with bar as report:
            for t in stops:
                # times of several tables that are to be the same may differ by rounding
                if t - sim.t > apart:
                    for table in tables:
                        table.set(sim, t)
                sim.advance(t, record=t in wanted)
                if report is not None:
                    report(t)
    except ModelError:
        if not sim.failed:
            raise
    # outputs may begin after the state that it starts in
    return sim.solution(int(begun not in wanted and sim.t > begun))


def _check_once(sim: Simulator, inputs: Mapping[str, Any]) -> None:
    """Raise a ModelError if one number is there under two of its names."""
    known: dict[str, Any] = {}
    for name in inputs:
        number = sim.number(name).name
        if number in known:
            raise ModelError(f"inputs: {known[number]!r} and {name!r} are two names of one number; give one of them")
        known[number] = name


def _begin(sim: Simulator, name: str, given: Any) -> Table | None:
    """Set an input that is constant or has a function; return the table of another one."""
    if isinstance(given, Sequence) and not isinstance(given, str):
        if len(given) == 2 and callable(given[0]):
            check_takes(f"inputs: the function of {name!r}", given[0], "t")
            sim.control(name, _of_time(given[0]), given[1])
            return None
        if len(given) in (2, 3):
            return _table(sim, name, *given)
    if callable(given) or (isinstance(given, Sequence | np.ndarray | Mapping) and not isinstance(given, str)):
        raise ModelError(f"inputs: {name!r} is {given!r}; {REMEDY}")
    sim.set(name, given)
    return None


def _of_time(function: Callable[[float], Any]) -> Callable[[float, Simulator], Any]:
    """Return a controller that calls a function of t, with what it remembers if it has ``state`` and ``restore``."""

    def controller(t: float, _: Simulator) -> Any:
        return function(t)

    for name in ("state", "restore"):
        if hasattr(function, name):
            setattr(controller, name, getattr(function, name))
    return controller


def _table(sim: Simulator, name: str, times: Any, values: Any, hold: int = 0) -> Table:
    label = f"inputs: {name!r}"
    if hold not in (0, 1):
        raise ModelError(f"{label}: the third is {hold!r}; 0 holds values, 1 leads along lines")
    number = sim.number(name)
    t, u = quantities(times, "time", f"{label}: times"), quantities(values, number.unit, f"{label}: values")
    if t.ndim != 1 or t.shape != u.shape or not t.size:
        raise ModelError(f"{label}: {t.shape} times and {u.shape} values; give as many of both, in a row")
    if not (np.isfinite(t).all() and np.isfinite(u).all()):
        raise ModelError(f"{label}: times and values must be finite")
    late = np.flatnonzero(np.diff(t) <= 0.0)
    if late.size:
        raise ModelError(f"{label}: its times must increase; {t[late[0] + 1]:g} s follows {t[late[0]]:g} s")
    close = np.flatnonzero(np.diff(t) < RESOLVED * sim.t_end)
    if close.size:
        raise ModelError(
            f"{label}: {t[close[0]]:g} s is followed {t[close[0] + 1] - t[close[0]]:.2g} s later; up to "
            f"{sim.t_end:g} s times are not told apart by less than {RESOLVED * sim.t_end:.2g} s; leave one of them out"
        )
    if t[0] > sim.t:
        raise ModelError(f"{label}: its first time is {t[0]:g} s, the run starts at {sim.t:g} s; begin it there")
    return Table(number.name, t, u, int(hold))


__all__ = ["simulate_led"]
