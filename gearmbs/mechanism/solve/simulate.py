"""From a mechanism to a solution in one call."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from gearmbs._lazy import uncollected
from gearmbs.dae.equations import layout as tables
from gearmbs.dae.equations.kinematics import update_tables
from gearmbs.dae.equations.loads.expressions import value
from gearmbs.dae.integrators.events import STOP
from gearmbs.dae.integrators.options import Options, beside
from gearmbs.dae.methods import DEFAULT, INTEGRATORS, those_that
from gearmbs.dae.model.brief import brief_changes
from gearmbs.dae.problem import EVENTS_SIG, DAEProblem, ModelError
from gearmbs.dae.result import DAEResult, Status
from gearmbs.dae.results.solution import Solution
from gearmbs.dae.results.watched import Stream, Watch
from gearmbs.dae.state import History, State, check_state
from gearmbs.kernels.jit import njit
from gearmbs.logs import log_run
from gearmbs.mechanism.checks import (
    check_mechanism,
    locking_remark,
    moves_after_all,
    refuse_overlaps,
    warn_of_lost_torques,
    warn_of_spin,
    warn_of_stiff_seats,
)
from gearmbs.mechanism.language.user_functions import raised_errors
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.quantities import quantities, quantity
from gearmbs.mechanism.solve.accuracy import chosen_accuracy
from gearmbs.mechanism.solve.controllers import warn_of_unmet
from gearmbs.mechanism.solve.keywords import IntegratorOptions, StopAt
from gearmbs.progress import time_bar
from gearmbs.units import QuantityLike
from gearmbs.wording import any_of, did_you_mean

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members
    from gearmbs.dae.model.system import System

# Ends of a simulation where an expression passes a value.


@njit(EVENTS_SIG, cache=True, nogil=True, error_model="numpy")
def passes(t, y, yp, out, idata, rdata, work):
    """Write by how much states exceed their values: both stand at the ends of the tables, their number last.

    An algebraic state is taken from its expression. Between the ends of a step the polynomial through its values would
    pass where its function jumps later.
    """
    count = idata[idata.size - 1]
    tab = tables.unpack(idata, rdata, work)
    update_tables(t, y, tab, False)
    for k in range(count):
        place = idata[idata.size - 1 - count + k]
        state = tab.state[place - idata[tables.H_Z]]
        given = state[tables.STATE_KIND] != tables.STATE_DIFFERENTIAL and state[tables.STATE_TAPE] >= 0
        now = value(state[tables.STATE_TAPE], t, y, tab) if given else y[place]
        out[k] = now - rdata[rdata.size - count + k]


def with_stops(problem: DAEProblem, names: Sequence[str], first: int, stops: Sequence[StopAt]) -> DAEProblem:
    """Return a problem that ends where states pass values.

    Parameters
    ----------
    problem : DAEProblem
    names : sequence of str
        Of all states, in the order of the unknowns.
    first : int
        Place of the first among the unknowns.
    stops : sequence of StopAt

    Raises
    ------
    ModelError
        For a state that is not there.
    """
    places = []
    for stop in stops:
        if stop.state not in names:
            raise ModelError(f"stops: there is no state {stop.state!r}; the mechanism has {', '.join(names) or 'none'}")
        places.append(first + names.index(stop.state))
    idata = np.concatenate([problem.idata, places, [len(stops)]]).astype(np.int64)
    rdata = np.concatenate([problem.rdata, [float(stop.value) for stop in stops]])
    return replace(problem, idata=idata, rdata=rdata, events=passes, n_events=len(stops))


def check_stops(stops: Any) -> None:
    """Raise a ModelError if something is no sequence of ends, or one of them cannot be meant."""
    remedy = "give [StopAt('state', 1.0)], from gearmbs.mechanism.solve.simulate"
    if not isinstance(stops, Sequence) or isinstance(stops, str):
        raise ModelError(f"stops: {stops!r} is no list; {remedy}")
    for stop in stops:
        if not isinstance(stop, StopAt):
            raise ModelError(f"stops: {stop!r} is no StopAt; {remedy}")
        if isinstance(stop.value, bool) or not isinstance(stop.value, Real) or not np.isfinite(stop.value):
            raise ModelError(f"stops: value = {stop.value!r} of {stop.state!r}; give a finite number, as the state is")
        if stop.direction not in (-1, 0, 1):
            raise ModelError(f"stops: direction = {stop.direction!r} of {stop.state!r}; 1 rises, -1 falls, 0 is either")


def stop_options(stops: Sequence[StopAt]) -> dict[str, Any]:
    """Return the options of the integrator that go with `with_stops`."""
    return {"event_direction": [stop.direction for stop in stops], "event_action": [STOP] * len(stops)}


LOOSEST = 1e-3
"""Tolerance of runs whose states others go on from: a looser one leaves constraints visibly open."""

ADVICE = {
    Status.NOT_FINITE: (
        "Look at the forces and functions of time acting there: a division by zero, a root of a negative number, a "
        "table that ends, a load without limit."
    ),
    Status.STEP_TOO_SMALL: (
        "Look for a force or motion that jumps there and smooth it (STEP) or give its time in breakpoints; loosen tol."
    ),
    Status.NEWTON_FAILURE: (
        "Look for a force or motion that jumps there and smooth it (STEP) or give its time in breakpoints; try another "
        "formulation or integrator."
    ),
    Status.TOO_MANY_REJECTIONS: (
        "Something jumps there: smooth the force or motion (STEP), give its time in breakpoints, or loosen tol."
    ),
    Status.TOO_MANY_STEPS: "Raise max_steps or loosen tol.",
    Status.STALLED: (
        "The motion may have no continuation there, as where friction jams a joint; look at the forces just before, or "
        "end the run before."
    ),
    Status.INCONSISTENT_START: (
        "Joints, motions or centres of mass are elsewhere than in the model that the state is from, or some of its "
        "unknowns were changed and not those that move with them: make them as there, change these, too, or start "
        "this mechanism without the state, from its own position and velocity."
    ),
    Status.SOLVER_FAILURE: ("Loosen tol, let motions and torques start more smoothly, or take the WSTIFF integrator."),
}
"""Advice for the modeller of a mechanism whose integration fails."""


def simulate(
    mechanism: Mechanism,
    t_end: QuantityLike,
    *,
    rate: QuantityLike | None = None,
    t_eval: npt.ArrayLike | None = None,
    every_step: bool = False,
    t_start: QuantityLike = 0.0,
    integrator: str = DEFAULT,
    formulation: str = "SI2",
    tol: float | None = None,
    rate_scale: float | None = None,
    progress: bool | Callable[[float], None] | None = None,
    advice: Mapping[Status, str] | None = None,
    consumer: Callable[[Solution], None] | None = None,
    watch: Sequence[tuple[str, str]] = (),
    lump: bool | None = None,
    stops: Sequence[StopAt] = (),
    continued: bool = False,
    initial: State | None = None,
    assembled: Solution | None = None,
    inputs: Mapping[str, Any] | None = None,
    **options: Unpack[IntegratorOptions],
) -> Solution:
    """Integrate a mechanism and return its motion and forces.

    Parameters
    ----------
    mechanism : Mechanism
        The model; it is not changed.
    t_end : float
        End of the simulation, s.
    rate : float, optional
        Outputs a second from the start on, and one at the end; default: 500 outputs over the span.
    t_eval : ndarray, optional
        Output times instead of ``rate``; the first is the start, the last the end, whatever ``t_end`` is.
    every_step : bool
        Outputs at the end of every accepted step instead: uneven times, dense where much happens.
    t_start : float
        Start of the simulation, s.
    integrator : str
        One of `gearmbs.dae.methods.INTEGRATORS`; default "WSTIFF".
    formulation : {"SI2", "SI1", "I3"}
    tol : float
        Local error allowed a step: in metres or radians and their rates for lengths of the order of 1 m; lengths are
        scaled by the size of the mechanism. Default 1e-6, with wheels in mesh whose speed is known 1e-7, with
        several meshes or bodies that deform 3e-8.
    rate_scale : float
        Velocities are allowed an error this many times larger (1/s) than positions: the angular frequency of the
        motion one is interested in; 1 is ADAMS's practice. Default the mechanism's, or that of its fastest mesh as far
        as motions and initial speeds tell it, else 1; see `gearmbs.mechanism.solve.accuracy`.
    progress : bool or callable, optional
        A bar, see `gearmbs.progress`: by default after two seconds where somebody watches, with True at once, with
        False never; a callable is given the time reached.
    advice : mapping, optional
        What messages of failures recommend, by status, where it should be something else than for a mechanism.
    consumer : callable, optional
        With ``every_step``: called as ``consumer(part)`` with solutions of some steps at a time, in the order of time
        and each valid during the call only, instead of keeping all steps in memory; see
        `gearmbs.dae.results.watched.Stream`. The solution returned then holds nothing but the last step.
    watch : sequence of (str, str)
        With a ``consumer``: methods of the solution, ``"reaction_force"``, ``"orientation"``, ``"angular_velocity"`` or
        ``"diagnostics"``, with the names they will be called with. The parts handed to it then return what the
        integrator has of them at its own steps, off by what the corrector leaves, where everything else is evaluated
        anew for each step, which takes about as long as the step. What an integrator or a formulation does not have at
        hand is evaluated as without it.
    lump : bool, optional
        Integrate bodies that fixed joints connect, or fix to the ground, as one, and if all that is left turns about
        fixed axes, its angles alone; default the mechanism's ``lump``, which only some presets set, and not with
        ``stops``. Results are about all bodies and joints as without it; reactions inside are recovered exactly. Where
        that is not possible, as with any body that deforms, all bodies are integrated, and the solution's ``message``
        says why. See `gearmbs.mechanism.lumping.lumped`.
    stops : sequence of StopAt
        The run ends where a state of the mechanism passes a value; times are in the result's ``t_events``, one array a
        stop. Not with integrators without events, as IDA, and not with ``lump``.
    continued : bool
        Whether the start is a state in which an earlier run ended: teeth may then be deep in an impact, which else is
        refused.
    initial : State, optional
        Start from a state of this mechanism, at its time; see `Solution.state_at` and `gearmbs.Simulator`. With the
        history of the same integrator the run goes on as if it had never stopped, otherwise it starts afresh.
    assembled : Solution, optional
        Of an earlier run of the same, unchanged mechanism with the same ``formulation``, ``rate_scale`` and ``lump``:
        its equations are taken instead of assembled again, which takes as long as some thousand steps.
    inputs : mapping, optional
        Of names of inputs and parameters: a value, ``(times, values)`` that hold from each time on, ``(times, values,
        1)`` for straight lines between them, or ``(function, sample_time)`` for a function of t that is asked at its
        sample times. Not with ``every_step``, ``stops`` and other integrators than WSTIFF and GSTIFF.
    **options
        Handed to the integrator.

    Returns
    -------
    Solution
        Also when the integration failed: see its ``status`` and ``message``; what was computed is kept.

    Raises
    ------
    ModelError
        If the model or an option is wrong, or the mechanism cannot be assembled; if teeth start deeper in each other
        than the loads press them; if a function of the user fails, its
        ``solution`` has what was computed until then.
    """
    # 1. what is asked for
    settings: dict[str, Any] = {**options}
    if watch and consumer is None:
        raise ModelError("watch: what it names is handed to a consumer; give consumer=, too")
    if consumer is not None and not every_step:
        raise ModelError("consumer: it takes the integrator's own steps; give every_step=True, too")
    check_mechanism(mechanism)
    t_start = start_time(quantity(t_start, "time", "t_start"), initial)
    t_eval = _output_times(t_start, quantity(t_end, "time", "t_end"), rate, t_eval, every_step, initial is not None)
    tol, rate_scale = chosen_accuracy(mechanism, (float(t_eval[0]), float(t_eval[-1])), tol, rate_scale)
    if inputs:
        from gearmbs.mechanism.solve.led import simulate_led

        if every_step or stops or consumer is not None:
            raise ModelError("inputs: a run with inputs has no every_step, consumer or stops; give rate or t_eval")
        checked(integrator, tol, settings)
        return simulate_led(
            mechanism, t_eval, inputs, integrator=integrator, formulation=formulation, tol=tol, rate_scale=rate_scale,
            lump=lump, initial=initial, advice=advice, progress=progress, **settings,
        )  # fmt: skip
    name = checked(integrator, tol, settings)
    check_stops(stops)
    # its kernels are loaded before the first one is called, so that all that lack are compiled in one round
    INTEGRATORS[name].load()
    # 2. the equations, and where they start and end
    asked, lump = bool(lump) or assembled is not None, mechanism.lump and not stops if lump is None else lump
    t_model = t_start if initial is None else initial.t_model
    set_up = {"formulation": formulation, "rate_scale": rate_scale, "lump": lump}
    if assembled is None:
        system, problem, members, lumping = prepared(
            mechanism, t_model, lump, formulation, rate_scale, continued or initial is not None
        )
    else:
        system, problem, members, lumping = _taken_over(assembled, mechanism, set_up, t_model)
    problem = problem.with_fixed_pivots(settings.get("fixed_pivots", False))
    if initial is not None:
        # events in what is left of the last step would be missed
        problem = _from_state(
            initial, problem, None if stops else initial.history_for(problem, name, tol), settings, name
        )
    if stops:
        if lump or not INTEGRATORS[name].can("event_action"):
            able = any_of(those_that("event_action"))
            raise ModelError(f"stops: they need the integrator {able}, and lump=False")
        problem = with_stops(problem, mechanism.state_names, int(problem.idata[tables.H_Z]), stops)
        settings.update(stop_options(stops))
    settings |= with_brief_changes(system, t_model, float(t_eval[-1]), settings)
    problem.advice = {**ADVICE, **(advice or {})}
    # 3. who is told of the steps, and the steps
    held, lumping = locking_remark(mechanism, system), lumping if asked else ""
    remark = " ".join(text for text in (held, lumping) if text)
    watched = Watch(system, problem, members, watch) if watch and INTEGRATORS[name].can("consumer") else None
    problem = problem if watched is None else watched.problem
    stream = None if consumer is None else Stream(system, problem, float(t_eval[-1]), consumer, members, watched)
    if stream is not None:
        stream.whole.inside = just_inside(t_eval)
    warn_of_stiff_seats(mechanism.joints, mechanism.elements)
    bar = time_bar(progress, mechanism.name, float(t_eval[0]), float(t_eval[-1]))
    result = None
    try:
        with bar as report, raised_errors(mechanism.functions.values()):
            result = _integrated(name, problem, t_eval, every_step, stream, tol=tol, progress=report, **settings)
        log_run("mechanism", f"{mechanism.name} by {name}", result)
    except ModelError as error:
        if result is not None and stream is None:
            cut = replace(result, status=Status.USER_ERROR, message=str(error))
            error.solution = Solution(system, problem, cut, members, remark)
        raise
    # 4. what they say
    solution = Solution(system, problem, result, members, remark)
    solution.inside = just_inside(t_eval)
    solution.initial, solution.set_up = initial, set_up
    if stream is not None:
        return _closed(stream, solution, name)
    if held and moves_after_all(mechanism, solution):
        solution.remark = lumping
    warn_of_spin(mechanism.bodies, solution)
    warn_of_lost_torques(mechanism.elements, solution)
    return solution


def _taken_over(
    run: Solution, mechanism: Mechanism, set_up: Mapping[str, Any], t_model: float
) -> tuple[System, DAEProblem, Members | None, str]:
    """Return what `_prepared` has returned for an earlier run of this mechanism, which began as it was assembled."""
    if run.system.mechanism is not mechanism:
        raise ModelError(
            f"assembled: its run is of another mechanism, {getattr(run.system.mechanism, 'name', None)!r}; give a run "
            f"of this very one, {mechanism.name!r}, or leave assembled away"
        )
    if run.initial is not None or run.problem.t0 != t_model:
        raise ModelError(
            f"assembled: its run starts at {run.problem.t0:g} s{' in a state' if run.initial is not None else ''}, the "
            f"model is one for {t_model:g} s; give a run from the time at which this one, or its state's, started"
        )
    for name, asked in set_up.items():
        if run.set_up.get(name) != asked:
            raise ModelError(
                f"assembled: its run has {name} = {run.set_up.get(name)!r}, this one {asked!r}; give both the same"
            )
    return run.system, run.problem, run.members, run.remark


def _from_state(
    initial: State, problem: DAEProblem, history: History | None, settings: dict[str, Any], integrator: str
) -> DAEProblem:
    """Return the problem that starts in a state, with its history if there is one; complete the settings for it."""
    if initial.controllers:
        warn_of_unmet(initial.controllers)
    settings |= starting_options(integrator, history)
    problem = initial.problem(problem, history)
    # as in a `Simulator`, a line ends where the state is, and what it prescribes jumps to another rate there
    led = [number for number in problem.numbers.values() if number.slope(problem.rdata) != 0.0]
    for number in led:
        number.write(problem.rdata, initial.t, number.value(problem.rdata, initial.t))
    if led:
        settings.pop("history", None)
    if any(number.prescribes for number in led):
        settings["check_start"] = False
    return problem


def starting_options(integrator: str, history: History | None) -> dict[str, Any]:
    """Return the options of a run from a state: its history, or that a looser run may have left it off constraints."""
    if history is not None:
        return {"history": history}
    return {"repairs": LOOSEST} if INTEGRATORS[integrator].can("repairs") else {}


def with_brief_changes(system: System, start: float, end: float, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the breakpoints of a run with those added between which tables of the model change briefly, if any do.

    A run that goes on from a state has those of the run that the state is from, which began at ``start``.
    """
    found = brief_changes(system.model, start, end)
    return {"breakpoints": [*options.get("breakpoints", ()), *found]} if found else {}


def start_time(t_start: float, initial: State | None) -> float:
    """Return the time at which a run starts, that of its initial state if it has one."""
    if initial is None:
        return t_start
    check_state("initial", initial)
    if t_start not in (0.0, initial.t):
        raise ModelError(f"initial: it is a state at t = {initial.t:g} s, t_start is {t_start:g} s; leave t_start away")
    return initial.t


def prepared(
    mechanism: Mechanism, t_model: float, lump: bool, formulation: str, rate_scale: float, continued: bool
) -> tuple[System, DAEProblem, Members | None, str]:
    """Return what `_prepared` does; refuse teeth that start deep in each other unless the run is ``continued``."""
    with uncollected(), raised_errors(mechanism.functions.values()):
        if not continued:
            refuse_overlaps(mechanism.elements, lambda names: _without(mechanism, names).compile(t_model))
        return _prepared(mechanism, t_model, lump, formulation, rate_scale)


def _without(mechanism: Mechanism, names: Collection[str]) -> Mechanism:
    """Return the mechanism without some of its force elements."""
    part = copy.copy(mechanism)
    part.elements = {name: element for name, element in mechanism.elements.items() if name not in names}
    return part


def just_inside(times: np.ndarray) -> dict[float, float]:
    """Return times next to the ends of a run with outputs at ``times``, within it, by these ends."""
    start, end = float(times[0]), float(times[-1])
    return {start: start + beside(start, end - start), end: end - beside(end, end - start)} if start < end else {}


def _closed(stream: Stream, solution: Solution, name: str) -> Solution:
    """Return the solution of a run whose steps were handed on; those of some integrators are so only now."""
    if not INTEGRATORS[name].can("consumer"):
        for part in solution.parts():
            stream.consumer(part)
    return stream.close(solution)


def checked(
    integrator: str, tol: float, options: Mapping[str, Any], caller: Mapping[str, Sequence[str]] | None = None
) -> str:
    """Return the integrator's name in capitals; raise a ModelError for a setting or an option that it cannot have.

    ``caller`` is the name of who is called, with its settings beside those of integrators; default `simulate`.
    """
    if isinstance(tol, bool) or not isinstance(tol, Real) or not np.isfinite(tol) or tol <= 0.0:
        raise ModelError(f"tol = {tol!r}; it must be a positive number")
    name = str(integrator).upper()
    if name not in INTEGRATORS:
        raise ModelError(f"integrator: {integrator!r} is unknown; choose one of {', '.join(INTEGRATORS)}")
    ((who, own),) = (caller or {"simulate": SETTINGS}).items()
    _check_options(name, options, who, own)
    return name


def _prepared(
    mechanism: Mechanism, t_start: float, lump: bool, formulation: str, rate_scale: float
) -> tuple[System, DAEProblem, Members | None, str]:
    """Return the system of all bodies, what is integrated, how the first follows from it if it is less, and a remark.

    The remark tells why not less is integrated.
    """
    one, why = None, ""
    if lump:
        # kernels of bodies that turn about fixed axes are compiled by those alone who ask for it
        from gearmbs.mechanism.lumping import lumped, why_not_lumped

        one = lumped(mechanism, t_start)
        why = "" if one else why_not_lumped(mechanism)
    if one is None:
        system = mechanism.compile(t_start)
        return system, system.problem(formulation, rate_scale), None, why
    return one.whole, *one.problem(formulation, rate_scale), one.remark(formulation)


def _output_times(
    start: float, end: float, rate: QuantityLike | None, given: npt.ArrayLike | None, every_step: bool, held: bool
) -> np.ndarray:
    """Return the output times; see `simulate`."""
    if every_step and (rate is not None or given is not None):
        raise ModelError("every_step: outputs are at the integrator's own steps; leave rate and t_eval away")
    if given is not None:
        # a column of a table is taken apart from it, for the kernels
        times = np.ascontiguousarray(quantities(given, "time", "t_eval"))
        if times.ndim != 1 or not times.size or not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
            raise ModelError("t_eval: give finite times in a row, each later than the one before")
        if held and times[0] < start:
            raise ModelError(
                f"t_eval: it begins at {times[0]:.9g} s, the initial state is at {start:.9g} s; begin there or later"
            )
        if held and times[-1] == start:
            raise ModelError(f"t_eval: it ends at {start:.9g} s, where the initial state is; go on to a later time")
        return times
    if not np.isfinite(end) or end <= start:
        raise ModelError(f"t_end = {end} s; it must be later than the start {start} s")
    if rate is None:
        return np.linspace(start, end, 501)
    rate = quantity(rate, "frequency", "rate")
    if not rate > 0.0:
        raise ModelError(f"rate = {rate} 1/s; it must be positive")
    return _sampled(start, end, rate)


def _integrated(
    name: str, problem: DAEProblem, t_eval: np.ndarray, every_step: bool, stream: Stream | None, **options
) -> DAEResult:
    """Run an integrator to the last of the output times, with outputs there or at its own steps."""
    times, last = None if every_step else t_eval, float(t_eval[-1])
    # errors are controlled on positions and velocities, and so is the corrector
    wanted = {"corrector": "modified", "slopes": times is not None, "consumer": stream}
    settings = {option: value for option, value in wanted.items() if INTEGRATORS[name].can(option)} | options
    return INTEGRATORS[name].load()(problem, times, Options.gather(name, None, settings), t_end=last)


def _sampled(start: float, end: float, rate: float) -> np.ndarray:
    """Return the times at a rate from the start on; the end is always one of them."""
    span = (end - start) * rate
    count = int(np.floor(span + 1e-6))
    times = start + np.arange(count + 1) / rate
    return np.append(times, end) if span > count + 1e-6 else times


def _check_options(name: str, options: Mapping[str, Any], who: str, own: Sequence[str]) -> None:
    """Raise a ModelError for an option the integrator does not have."""
    known = Options.names(name)
    for option in options:
        if option in known:
            continue
        times = ", ".join(key for key in OUTPUTS if key in own)
        about_times = option in OUTPUTS or "step" in option or "out" in option
        remark = f"outputs are set by {times}" if times else "its points are the times that advance is called with"
        if not about_times:
            elsewhere = option in SETTINGS and option not in own
            remark = "simulate() has it" if elsewhere else did_you_mean(option, [*known, *own])
        raise ModelError(
            f"{who} has no option {option!r}{': ' + remark if remark else ''}; besides {', '.join(own)} the "
            f"integrator {name} takes {', '.join(k for k in known if k not in own)}"
        )


OUTPUTS = ("rate", "t_eval", "every_step")
"""Settings that say at which times there are outputs."""


SETTINGS = (
    "rate",
    "t_eval",
    "every_step",
    "t_start",
    "integrator",
    "formulation",
    "tol",
    "rate_scale",
    "progress",
    "consumer",
    "watch",
    "lump",
    "stops",
    "continued",
    "initial",
    "assembled",
    "inputs",
)
