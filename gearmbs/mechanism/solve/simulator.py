"""A mechanism that is simulated in steps of its user: to a time, a look at it, on to the next."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from typing import Any

import numpy as np

from gearmbs._lazy import uncollected
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.stepping.held_run import HeldRun
from gearmbs.dae.methods import DEFAULT, INTEGRATORS, those_that
from gearmbs.dae.problem import ModelError
from gearmbs.dae.result import DAEResult, Status
from gearmbs.dae.results.solution import CONFLICT_SAMPLES, Solution
from gearmbs.dae.state import State, equations_of
from gearmbs.mechanism.language.user_functions import raised_errors
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.attributes import OwnAttributes
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.simulate import ADVICE, checked, just_inside, prepared, start_time
from gearmbs.wording import any_of, did_you_mean

AT_AN_INSTANT = (
    "com_position", "orientation", "com_velocity", "angular_velocity", "com_acceleration", "angular_acceleration",
    "reaction", "reaction_force", "load", "diagnostics", "contact", "modal_coordinates", "modal_velocities",
    "joint_displacement", "marker_position", "marker_velocity", "deflection", "state", "multipliers", "kinetic_energy",
    "constraint_violation",
)  # fmt: skip
"""What `Solution` tells of one instant alone."""
COUNTED = ("joint_angle", "evaluate")
"""What it tells with full turns counted from the first point on."""
COUNTED_FUNCTION = re.compile(r"\bA[XYZ]\s*\(", re.IGNORECASE)
"""AX, AY and AZ of the function language."""
REFUSED = ("dense_output", "consumer", "slopes", "event_direction", "event_action", "event_count", "history")
"""Options of integrators that are about outputs and events of a run that is told its end."""


class Simulator(OwnAttributes):
    """A simulation that goes from one communication point to the next.

    The run behind it is that of `gearmbs.mechanism.simulate` with the same arguments: its steps pass the points, where
    values are interpolated, so that they are those of one run with these points as ``t_eval``, bit for bit.

    Parameters
    ----------
    mechanism : Mechanism
        The model; it is not changed.
    t_end : float
        Latest time that can be asked for, s. First and smallest steps depend on it as in `simulate`.
    t_start : float
        Start, s.
    integrator : str
        One that can be held between calls: "WSTIFF" or "GSTIFF".
    formulation, tol, rate_scale, lump
        As of `simulate`.
    initial : State, optional
        Start from this state, at its time.
    records : bool
        Whether all points are kept for :meth:`solution`.
    **options
        Handed to the integrator.

    Attributes
    ----------
    t : float
        Present time, s.
    t_end : float

    Raises
    ------
    ModelError
        As `simulate` does.

    Examples
    --------
    >>> import gearmbs as gm
    >>> m = gm.Mechanism("pendulum", gravity=(0, 0, -9.81))
    >>> rod = m.body("rod", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.5, 0, 0))
    >>> pin = m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    >>> sim = gm.Simulator(m, t_end=1.0)
    >>> sim.advance(0.1)
    >>> round(float(sim.get("com_position", "rod")[2]), 4)
    -0.0471
    """

    def __init__(
        self,
        mechanism: Mechanism,
        t_end: float,
        *,
        t_start: float = 0.0,
        integrator: str = DEFAULT,
        formulation: str = "SI2",
        tol: float = 1e-6,
        rate_scale: float = 1.0,
        lump: bool | None = None,
        initial: State | None = None,
        records: bool = True,
        **options: Any,
    ) -> None:
        t_start = start_time(quantity(t_start, "time", "t_start"), initial)
        self.t_end = quantity(t_end, "time", "t_end")
        if not (np.isfinite(self.t_end) and self.t_end > t_start):
            raise ModelError(f"t_end = {self.t_end} s; it must be later than the start {t_start} s")
        name = checked(integrator, tol, options)
        if not INTEGRATORS[name].compiled:
            raise ModelError(f"integrator: {name} cannot be held between calls; take {any_of(those_that('history'))}")
        for option in REFUSED:
            if option in options:
                raise ModelError(f"Simulator has no option {option!r}; simulate() and initial= have what it is for")
        INTEGRATORS[name].load()
        lump = mechanism.lump if lump is None else lump
        t_model = t_start if initial is None else initial.t_model
        self._system, self._base, self._members, self._remark = prepared(
            mechanism, t_model, lump, formulation, rate_scale, initial is not None
        )
        self._base.advice = ADVICE
        self._functions = list(mechanism.functions.values())
        self._options = Options.gather(name, None, {"corrector": "modified", "tol": tol, **options})
        self._records = records
        self._wall_time = self._simulated = 0.0
        self._begin(initial)
        self._t_start = self.t

    def _begin(self, state: State | None) -> None:
        """Make a run that starts in a state, by default in that which the model was assembled in."""
        problem, history = self._base, None
        if state is not None:
            problem, history = state.problem(problem), state.history_for(problem, self._options.method)
        self._problem, self._origin = problem, state
        with uncollected():
            self._run = HeldRun(problem, self.t_end, replace(self._options, history=history))
        nothing = np.empty((0, problem.n))
        empty = DAEResult(np.empty(0), nothing, nothing, Status.SUCCESS, "")
        self._row = Solution(self._system, problem, empty, self._members)
        self._row.inside = just_inside(np.array([problem.t0, self.t_end]))
        self._row.share(1)
        self._next_look = problem.t0
        self._points: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []
        self._counted: dict[tuple, tuple[int, float]] = {}
        self._failed: str | None = None
        self._stand_at(float(problem.t0), problem.y0, problem.yp0, problem.idata)

    def _stand_at(self, t: float, y: np.ndarray, yp: np.ndarray, idata: np.ndarray) -> None:
        self.t = t
        self._point = t, y, yp, idata
        self._present: Solution | None = None
        if self._records:
            self._points.append(self._point)

    # --- going on -----------------------------------------------------------------------------------

    def advance(self, t: float) -> None:
        """Go on to time ``t``, s.

        Raises
        ------
        ModelError
            For a time that is no number, that lies behind or after the end, and where the integration fails: the
            simulator then stands where it stood, and can only be restored to an earlier state.
        """
        t = quantity(t, "time", "t")
        if self._failed is not None:
            raise ModelError(f"the simulation has failed: {self._failed} Go back with restore(state)")
        if not np.isfinite(t):
            raise ModelError(f"t = {t} s; advance takes a finite time")
        if t < self.t:
            raise ModelError(f"t = {t:.9g} s lies before the present time {self.t:.9g} s; go back with restore(state)")
        if t > self.t_end:
            raise ModelError(
                f"t = {t:.9g} s lies after t_end = {self.t_end:.9g} s; make the simulator with a later t_end"
            )
        if t == self.t:
            return
        started = time.perf_counter()
        with raised_errors(self._functions):
            status, message = self._run.go_to(t)
        if status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if status < 0:
            self._failed = message
            raise ModelError(message)
        y, yp, idata = self._run.values_at(t)
        self._simulated += t - self.t
        self._wall_time += time.perf_counter() - started
        self._stand_at(t, y, yp, idata)
        if self._system.has_dropped_rows and t >= self._next_look:
            self._next_look = t + (self.t_end - self._problem.t0) / CONFLICT_SAMPLES
            found = self._now().find_conflict(np.array([0]))
            if found is not None:
                self._failed = found
                raise ModelError(found)

    @property
    def real_time_factor(self) -> float:
        """Seconds simulated in a second of the clock, in all calls of :meth:`advance`; 0 before the first."""
        return self._simulated / self._wall_time if self._wall_time > 0.0 else 0.0

    # --- looking at it ------------------------------------------------------------------------------

    def get(self, what: str, *names: Any) -> Any:
        """Return a quantity at the present time.

        Parameters
        ----------
        what : str
            A method or property of `Solution`: "com_position", "angular_velocity", "com_acceleration", "reaction",
            "load", "diagnostics", "marker_position", "joint_angle", "state", "evaluate" and others.
        *names
            What the method takes: the name of a body, joint, element, marker or state, or an expression. "joint_angle"
            and expressions with AX, AY or AZ count full turns from the first point on, which needs ``records``.

        Returns
        -------
        float, ndarray, tuple or dict
            What `Solution` returns, without the axis of time; a copy.

        Raises
        ------
        ModelError
            For a quantity that is not there.
        KeyError
            For a name that is not there; the message lists those that are.
        """
        if what not in AT_AN_INSTANT + COUNTED:
            known = [*AT_AN_INSTANT, *COUNTED]
            hint = did_you_mean(what, known)
            raise ModelError(f"get: there is no {what!r}{': ' + hint if hint else ''}; there are {', '.join(known)}")
        if what == "joint_angle":
            return self._joint_angle(*names)
        if what == "evaluate" and COUNTED_FUNCTION.search(str(names[:1])):
            return float(self.solution().evaluate(*names)[-1])
        found = getattr(self._now(), what)
        return _last(found(*names) if callable(found) else found)

    def _now(self) -> Solution:
        """Return the solution at the present time alone, valid until the next."""
        if self._present is None:
            t, y, _, idata = self._point
            self._present = self._row.over(np.array([t]), y[None, :], [(0, idata)])
            # turns as the run counts them at every step
            evaluator: Any = self._row._shared
            evaluator[0].rdata[:] = self._run.state.rdata
        return self._present

    def _joint_angle(self, joint: Any) -> float:
        """Return the angle of a joint, counted from the point on at which it was last asked for."""
        self._check_records("joint_angle")
        first, value = self._counted.get(joint, (0, None))
        angle = self._over(first).joint_angle(joint)
        last = float(angle[-1] if value is None else value + (angle[-1] - angle[0]))
        self._counted[joint] = len(self._points) - 1, last
        return last

    def solution(self) -> Solution:
        """Return the motion and forces over all points so far, from the start on.

        Raises
        ------
        ModelError
            If no records are kept.
        """
        self._check_records("solution")
        return self._over(0)

    def _check_records(self, what: str) -> None:
        if not self._records:
            raise ModelError(f"{what}: it needs the points so far; make the simulator with records=True")

    def _over(self, first: int) -> Solution:
        """Return the solution over the points from one on."""
        t, y, yp, tables = zip(*self._points[first:], strict=True)
        epochs: list[tuple[int, np.ndarray]] = []
        for row, table in enumerate(tables):
            if not epochs or not (table is epochs[-1][1] or np.array_equal(table, epochs[-1][1])):
                epochs.append((row, table))
        stats = self._run._stats()
        told = Status.SUCCESS if self._failed is None else Status.SOLVER_FAILURE
        result = DAEResult(
            np.array(t), np.array(y), np.array(yp), told, self._failed or f"Advanced to t = {self.t:.9g} s.", stats,
            epochs=epochs, t_last=self.t,
        )  # fmt: skip
        solution = Solution(self._system, self._problem, result, self._members, self._remark)
        solution.initial = self._origin
        solution.inside = just_inside(np.array([self._problem.t0, self.t_end]))
        return solution

    # --- state --------------------------------------------------------------------------------------

    def state(self) -> State:
        """Return the present state with the integrator's history: what follows from it is the same, bit for bit."""
        if self._failed is not None:
            raise ModelError(f"the simulation has failed: {self._failed} Go back with restore(state)")
        t, y, yp, idata = self._point
        run = self._run
        history = replace(run.history(), equations=equations_of(self._base)) if run.started else None
        return State.of(self._base, t, y, yp, (idata, run.state.rdata), history)

    def restore(self, state: State) -> None:
        """Go back, or on, to a state of the same mechanism.

        Of the points those before it are kept if it is one of them, as a state of this simulator is, else none.

        Raises
        ------
        ModelError
            If the state is one of another model, or lies outside the span of this simulator.
        """
        if not self._t_start <= state.t < self.t_end:
            remedy = "pass it as initial=" if state.t < self._t_start else "make it with a later t_end"
            raise ModelError(
                f"state: it is at t = {state.t:.9g} s, the simulator goes from {self._t_start:.9g} to "
                f"{self.t_end:.9g} s; {remedy}"
            )
        if state.t_model != self._base.t0:
            raise ModelError(
                f"state: its model was assembled for t = {state.t_model:g} s, this one for {self._base.t0:g} s; "
                "start both simulators at the same time"
            )
        own = [k for k, (t, y, *_) in enumerate(self._points) if t == state.t and np.array_equal(y, state.y)]
        kept = self._points[: own[0]] if own else []
        first = self._problem, self._origin
        self._begin(state)
        if kept:
            self._problem, self._origin = first
            self._points[:0] = kept

    def __repr__(self) -> str:
        name = self._system.mechanism.name if self._system.mechanism is not None else "mechanism"
        return f"Simulator({name!r}: t = {self.t:.9g} of {self.t_end:.9g} s, {len(self._points)} points)"


def _last(value: Any) -> Any:
    """Return the last row of what a solution tells over time, as a copy."""
    if isinstance(value, tuple):
        return tuple(_last(part) for part in value)
    if isinstance(value, dict):
        return {name: _last(part) for name, part in value.items()}
    row = np.array(value[-1])
    return float(row) if row.ndim == 0 else row
