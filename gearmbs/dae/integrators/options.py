"""What an integration is asked for: one frozen object, checked once, for every integrator."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, TypedDict

import numpy as np

from gearmbs.dae.methods import DEFAULT, INTEGRATORS, Integrator
from gearmbs.dae.problem import EPS
from gearmbs.dae.state import History

CORRECTORS = ("original", "modified")

CROWDED = 1e-3
"""Ratio of neighbouring steps up to which differences over both say something: over steps of 1 and 1e-9 they are
differences of rounding and of what Newton's method left, and errors were 1e4 to 1e6 tolerances."""

ROUNDED_STEP = 16.0 * EPS
"""Shortest step in units of the time: fewer of its last digits say nothing of a rate."""

BESIDE = 64.0 * EPS
"""How far beside a breakpoint, in units of the time, equations may switch that compute the time of it in another way: a
sum of some hundred periods is off by as much as that."""
BESIDE_OF_PIECE = 1e-9
"""That as part of the way to the next breakpoint, at most: in times of 1e9 s the last digits are no rounding."""

Consumer = Callable[[np.ndarray, np.ndarray, np.ndarray], None]
"""Takes t, y of some accepted steps and the integer table valid there; the arrays are valid during the call only."""

Pause = Callable[[float], float | None]
"""Takes the time that a run has reached; returns when it is to be asked again, or None to end the run."""


def beside(t: float, length: float) -> float:
    """Return how far beside a breakpoint equations that may switch there are looked at, in a piece of ``length``."""
    return max(min(BESIDE * abs(t), BESIDE_OF_PIECE * length), float(np.spacing(abs(t))))


@dataclass(frozen=True, kw_only=True)
class Options:
    """Tolerances, limits and outputs of an integration.

    Parameters
    ----------
    method : str
        One of `gearmbs.dae.methods.INTEGRATORS`; default "WSTIFF".
    tol : float
        Local error per step in units of the problem's ``atol_scale`` (ADAMS: ERROR).
    rtol : float
        Relative part: the tolerance of unknown i is ``tol * atol_scale[i] + rtol * |y[i]|``. IDA takes no less than
        1e-14, and applies it to all unknowns.
    corrector : {"original", "modified"}
        Whether the corrector test looks at all unknowns or only at those under error control.
    max_order : int, optional
        KMAX; default 6, for IDA 5.
    max_step, first_step, min_step : float, optional
        HMAX, HINIT and HMIN; default no limit, and steps from the problem's own scale.
    max_iterations : int, optional
        MAXIT: iterations of the corrector; default 10, for IDA 4.
    max_steps : int, optional
        Limit on accepted steps; default none. For IDA the limit between two outputs, default 100 000.
    interpolate : bool
        INTERPOLATE: outputs from the interpolating polynomial (True) or by steps that land on them (False). Where two
        outputs, or one and a breakpoint, are nearer than `CROWDED` of their mean distance, all are interpolated.
    breakpoints : sequence of float
        Possible discontinuities: the run lands on each, and starts afresh if the step beyond shows that it is one; IDA
        starts afresh at each. The jump itself may be `BESIDE` it. At one that is the end of the run the equations are
        those before it.
    event_direction, event_action : sequence of int, optional
        For each event function: crossings that count (-1 falling, 1 rising, 0 both), and what they do (0 record,
        1 stop, 2 land on the crossing as on a breakpoint).
    event_count : sequence of int, optional
        For each event function that stops the run: at which of its crossings; default the first.
    dense_output : bool
        Keep every step, for ``result.sol``.
    slopes : bool
        With outputs at every step: whether y' is wanted too; it costs as much memory as y.
    check_start : bool
        Refuse initial values that do not satisfy the equations.
    repairs : float
        Those that are off by no more than this as a tolerance are moved onto the equations instead, as by
        ``check_start=False``; default 0, none.
    progress : callable, optional
        Called now and then as ``progress(t)``.
    consumer : callable, optional
        With outputs at every step: called as ``consumer(t, y, idata)`` with some accepted steps at a time and the
        integer table valid there, instead of keeping them; the arrays are valid during the call only. The result then
        holds nothing but the last step.
    pause : callable, optional
        With a consumer: called as ``pause(t)`` at the start, and when the consumer has all steps up to the time that it
        returned last; with None the run ends there, as at its end. Steps do not depend on it.
    keep_at : float
        With a consumer: time, s; the result holds the state at the end of the first step there or later, from which
        another run can start, as ``result.kept``. Default: none is kept. Steps do not depend on it.
    errors : list of BaseException, optional
        Where callbacks in Python leave the exceptions they raise.
    fixed_pivots : bool
        Whether pivots follow from the matrix that they are chosen for alone, with all of its entries, and not from
        which entries have counted in matrices before as well; and those of outputs of mechanisms from the start of the
        model, so that it makes no difference where one has looked before. Default False: entries that have not counted
        so far are left out, which is faster.
    history : History, optional
        Of the `gearmbs.dae.State` that the problem starts in: the run goes on with it, by the same method, instead of
        starting afresh.

    Raises
    ------
    ValueError
        For a value that makes no sense; the message names the option, the value and what is allowed.
    """

    method: str = DEFAULT
    tol: float = 1e-6
    rtol: float = 0.0
    corrector: str = "original"
    max_order: int | None = None
    max_step: float | None = None
    first_step: float | None = None
    min_step: float | None = None
    max_iterations: int | None = None
    max_steps: int | None = None
    interpolate: bool = True
    breakpoints: Sequence[float] = ()
    event_direction: Sequence[int] | None = None
    event_action: Sequence[int] | None = None
    event_count: Sequence[int] | None = None
    dense_output: bool = False
    slopes: bool = True
    check_start: bool = True
    repairs: float = 0.0
    progress: Callable[[float], None] | None = None
    consumer: Consumer | None = None
    pause: Pause | None = None
    keep_at: float = math.inf
    errors: list[BaseException] | None = None
    fixed_pivots: bool = False
    history: History | None = None

    def __post_init__(self) -> None:
        _check_choice("method", self.method, INTEGRATORS)
        _check_choice("corrector", self.corrector, CORRECTORS)
        if not (math.isfinite(self.tol) and self.tol > 0):
            raise ValueError(f"tol (ERROR) must be positive, is {self.tol!r}")
        if not (math.isfinite(self.rtol) and self.rtol >= 0):
            raise ValueError(f"rtol must not be negative, is {self.rtol!r}")
        if self.max_order is not None and not 1 <= self.max_order <= self.highest_order:
            kind = "" if self.integrator.compiled else f" for {self.method}"
            raise ValueError(f"max_order (KMAX) must be 1 to {self.highest_order}{kind}, is {self.max_order!r}")
        if not isinstance(self.fixed_pivots, bool | np.bool_):
            raise ValueError(f"fixed_pivots is {self.fixed_pivots!r}; give True or False")
        if isinstance(self.breakpoints, str) or not isinstance(self.breakpoints, Iterable):
            raise ValueError(f"breakpoints is {self.breakpoints!r}; give a list of times")
        for b in self.breakpoints:
            if isinstance(b, str) or math.isnan(b):
                raise ValueError(f"breakpoints has {b!r} among its times; leave it away")
        self._check_steps()
        most = self.integrator.most_iterations
        if self.max_iterations is not None and not 1 <= self.max_iterations <= most:
            allowed = "at least 1" if math.isinf(most) else f"1 to {most:g}"
            raise ValueError(f"max_iterations (MAXIT) must be {allowed}, is {self.max_iterations!r}")
        if self.max_steps is not None and not self.max_steps >= (0 if self.integrator.compiled else 1):
            raise ValueError(f"max_steps must be at least 1, is {self.max_steps!r}")

    def interpolates(self, outputs: np.ndarray, stops: Sequence[float]) -> bool:
        """Return whether outputs are interpolated, as asked for or because steps to all of them would be too unlike."""
        times = np.unique(np.concatenate([np.asarray(outputs, dtype=float), stops]))
        if self.interpolate or times.size < 3:
            return self.interpolate
        distances = np.diff(times)
        return bool(distances.min() < CROWDED * distances.mean())

    def stops(self, t0: float, t_end: float) -> list[float]:
        """Return the breakpoints of a run, in order; of several within the shortest step the first.

        One at the end of the run, or within the shortest step of it, is the end: there, too, the equations are those
        before it.
        """
        found: list[float] = []
        for b in sorted(float(b) for b in self.breakpoints if b > t0):
            least = ROUNDED_STEP * abs(b)
            if b - t_end > least:
                break
            if t_end - b <= least:
                b = t_end
            if b - (found[-1] if found else t0) > least:
                found.append(b)
        return found

    def _check_steps(self) -> None:
        sizes = {
            "max_step (HMAX)": self.max_step,
            "first_step (HINIT)": self.first_step,
            "min_step (HMIN)": self.min_step,
        }
        for name, value in sizes.items():
            if value is None:
                continue
            # a step of size zero is one that such an integrator may choose
            if not self.integrator.compiled or "HMIN" in name:
                if not value >= 0:
                    raise ValueError(f"{name} must not be negative, is {value!r}")
            elif not value > 0:
                raise ValueError(f"{name} must be positive, is {value!r}")

    @property
    def integrator(self) -> Integrator:
        """The row of the table of integrators."""
        return INTEGRATORS[self.method]

    @property
    def highest_order(self) -> int:
        """Order the method goes up to."""
        return self.integrator.highest_order

    @staticmethod
    @cache
    def names(method: str) -> tuple[str, ...]:
        """Return the options that a method takes, without ``method`` itself."""
        return tuple(f.name for f in fields(Options) if f.name != "method" and INTEGRATORS[method].can(f.name))

    @classmethod
    def gather(cls, method: str | None, base: Options | None, settings: Mapping[str, Any], more: str = "") -> Options:
        """Return options from an object and single settings, which count before it.

        Parameters
        ----------
        method : str or None
            Counts before that of ``base``; default "WSTIFF".
        base : Options or None
        settings : mapping
            Options by name.
        more : str
            What to say of arguments beside the options in a message.

        Raises
        ------
        ValueError
            For a setting that the method does not have.
        """
        chosen = method if method is not None else base.method if base is not None else DEFAULT
        _check_choice("method", chosen, INTEGRATORS)
        known = cls.names(chosen)
        unknown = sorted(name for name in settings if name not in known)
        if unknown:
            raise ValueError(f"method={chosen!r} does not know {', '.join(unknown)}; {more}it takes {', '.join(known)}")
        return cls(method=chosen, **settings) if base is None else replace(base, method=chosen, **settings)


class StepKeywords(TypedDict, total=False):
    """Options of any run, for type checkers: those of `Options` about steps, the corrector and the start."""

    corrector: str
    max_order: int | None
    max_step: float | None
    first_step: float | None
    min_step: float | None
    max_iterations: int | None
    max_steps: int | None
    interpolate: bool
    breakpoints: Sequence[float]
    slopes: bool
    check_start: bool
    repairs: float
    pause: Pause | None
    keep_at: float
    fixed_pivots: bool


class OptionKeywords(StepKeywords, total=False):
    """Options that `gearmbs.dae.solve_dae` takes one by one; it has ``method`` and ``rtol`` among its own arguments."""

    tol: float
    dense_output: bool
    event_direction: Sequence[int] | None
    event_action: Sequence[int] | None
    event_count: Sequence[int] | None
    progress: Callable[[float], None] | None
    consumer: Consumer | None
    errors: list[BaseException] | None
    history: History | None


def _check_choice(name: str, value: str, choices: Iterable[str]) -> None:
    if value not in choices:
        raise ValueError(f"{name} is {value!r}; choose one of {', '.join(choices)}")


def output_times(t_eval: np.ndarray | None, t0: float, t_end: float | None) -> tuple[np.ndarray, float]:
    """Return the output times, none for outputs at every step, and the end of the run.

    Raises
    ------
    ValueError
        For times that do not increase, or that lie outside the run.
    """
    if t_eval is None:
        if t_end is None:
            raise ValueError("give t_eval, or t_end for output at every step")
        outputs = np.empty(0)
    else:
        outputs = np.array(t_eval, dtype=float).ravel()
        # what increases between finite ends is finite
        finite = len(outputs) and math.isfinite(outputs[0]) and math.isfinite(outputs[-1])
        if not finite or not (outputs[1:] > outputs[:-1]).all():
            raise ValueError("t_eval must be finite and strictly increasing, with at least one time")
        if outputs[0] < t0:
            raise ValueError(f"t_eval starts at {outputs[0]:g}, before the problem's t0 = {t0:g}")
        if t_end is None:
            t_end = float(outputs[-1])
        elif outputs[-1] > t_end:
            raise ValueError(f"t_eval ends at {outputs[-1]:g}, after t_end = {t_end:g}")
    if not (math.isfinite(t_end) and t_end > t0):
        raise ValueError(f"the end time {t_end:g} must lie after the start {t0:g}")
    return outputs, float(t_end)


def event_rules(n_events: int, options: Options) -> dict[str, Sequence[int]]:
    """Return the rules of events that are given, checked, by the fields of the state that they belong to.

    Raises
    ------
    ValueError
        For a list of the wrong length or with a value that means nothing.
    """
    given = {
        "event_direction": (options.event_direction, (-1, 0, 1)),
        "event_action": (options.event_action, (0, 1, 2)),
        "event_left": (options.event_count, None),
    }
    rules = {}
    for field, (values, allowed) in given.items():
        if values is None:
            continue
        name = "event_count" if allowed is None else field
        if len(values) != n_events:
            raise ValueError(f"{name} has {len(values)} entries for {n_events} event functions")
        for value in values:
            if allowed is not None and value not in allowed:
                raise ValueError(f"{name} may hold {allowed}, has {value!r}")
            if allowed is None and (value != int(value) or value < 1):
                raise ValueError(f"{name} may hold whole numbers from 1 on, has {value!r}")
        rules[field] = values
    return rules
