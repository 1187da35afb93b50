"""Run a deck, by its script or for a given time: ``run_deck``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.adams.builders.control import hold_states
from gearmbs.adams.builders.functions import MODES, Present
from gearmbs.adams.builders.mechanism import build_model, part_states, with_initial_motions
from gearmbs.adams.builders.routines import bound
from gearmbs.adams.builders.scopes import AdamsModel
from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Change, Command, Linear, Script, Simulate, Stop, Switch, read_script
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.reader import read_deck
from gearmbs.adams.results.record import NEWTON, Segment
from gearmbs.adams.results.remarks import faceted_touches
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.adams.results.result import AdamsResult
from gearmbs.adams.run.convergence import Doubt, doubt
from gearmbs.adams.run.plant import plant_of
from gearmbs.adams.run.script_check import check_linear, check_script, is_sequence
from gearmbs.adams.run.sensors import (
    Watch,
    act,
    after,
    equilibria_to_passage,
    in_unit,
    parts,
    renew,
    take_samples,
    up_to,
)
from gearmbs.adams.run.session import Session, active_sensors, change, kept_until, output_times, segment_of, switch
from gearmbs.dae.analyses.kinematics import kinematic
from gearmbs.dae.analyses.modes import Modes
from gearmbs.dae.analyses.plant import LinearPlant
from gearmbs.dae.analyses.statics import StaticResult, initial_conditions, quasi_static, static_equilibrium
from gearmbs.dae.methods import DEFAULT, INTEGRATORS
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import ModelError
from gearmbs.dae.result import Status
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.checks import singular_passage
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.solve.analyses import frozen_friction, linear_modes
from gearmbs.mechanism.solve.simulate import StopAt

DEFAULT_TOLERANCE = 1e-8
"""Local error where a deck gives no ERROR, tighter than ADAMS's 1e-3 so that results do not depend on it."""

FIRST_STEP = 0.05
"""ADAMS's default HINIT, in output steps."""

STATIC_TOLERANCE = 1e-10
"""Unbalanced load allowed at an equilibrium, relative to the heaviest weight or largest load."""

WATCHED = (None, "DYNAMICS", "TRANSIENT", "KINEMATICS", "STATICS")
"""Analyses in which sensors watch, where they go through a span of time."""

METHODS = {adams: name for name, known in INTEGRATORS.items() for adams in known.adams}
"""Integrators by what ADAMS calls them."""


def run_deck(
    adm: str | Path | Deck,
    acf: str | Path | Script | None = None,
    out: str | Path | None = None,
    *,
    end: float | None = None,
    steps: int | None = None,
    dtout: float | None = None,
    tol: float | None = None,
    allow_unsupported: bool = False,
    progress: bool | Callable[[float], None] | None = None,
    redundancy: str = "adams",
    routines: Mapping[str, Callable] | None = None,
    check: bool | None = None,
) -> AdamsResult:
    """Run an ADAMS deck.

    Parameters
    ----------
    adm : path or Deck
        The model.
    acf : path or Script, optional
        Commands; without them one dynamic analysis is run up to ``end``.
    out : path, optional
        Prefix of the files to write (.req, .res, .msg, .nc).
    end : float, optional
        End time in the deck's unit, when there is no script.
    steps, dtout : int or float, optional
        Number of output steps or their size in the deck's unit; default 100 steps.
    tol : float, optional
        Local error instead of INTEGRATOR's ERROR.
    allow_unsupported : bool
        Leave out what is not supported instead of refusing to run.
    progress : bool or callable
        As in :func:`gearmbs.mechanism.simulate`.
    redundancy : {"adams", "declared"}
        Which of redundant constraint rows are kept: as in ADAMS, as far as that is known, or those that stand first.
    routines : mapping, optional
        Python functions for the deck's USER(...), by statement ("SFORCE/3"), the name in ROUTINE=, or ADAMS's name
        (SFOSUB, ...); each takes a `gearmbs.adams.RoutineCall`.
    check : bool, optional
        Whether dynamic analyses are solved again at a hundredth of their error, and remarked if parts then go other
        ways; without it those are for which this takes about a second, see `gearmbs.adams.run.convergence.CHEAP`.

    Returns
    -------
    AdamsResult
        Also when an integration failed or was interrupted by Ctrl-C: see its ``success`` and ``messages``. A
        KeyboardInterrupt elsewhere, as between two analyses, goes on to the caller and has it as its ``result``.

    Raises
    ------
    DeckError
        Naming file and line of what is wrong or not supported. Most of it is found before anything is run; what only
        a run can tell (a position without equilibrium, for instance) comes with the ``result`` of the commands before,
        whose files are written.
    """
    deck = bound(adm if isinstance(adm, Deck) else read_deck(adm), routines, allow_unsupported)
    script = _script(acf, end, steps, dtout)
    if script.unsupported and not allow_unsupported:
        raise DeckError(script.unsupported)
    result = AdamsResult(deck, script)
    session = Session.of(deck)
    session.redundancy, session.check = redundancy, check
    command = Command(script.file)
    try:
        unasked = check_script(deck, script, allow_unsupported)
        if unasked:
            requests = {n: request for n, request in deck.of(st.Request).items() if n not in unasked}
            result.deck = replace(deck, items={**deck.items, st.Request: requests})
            session.deck = Session.of(result.deck).deck
        for command in script:
            if isinstance(command, Stop):
                break
            if not _carry_out(command, session, result, tol, allow_unsupported, progress):
                break
        if result.segments and result.segments[-1].interrupted:
            result.interrupted = _interruption(deck, result, command)
    except DeckError as error:
        result.errors.extend(error.diagnostics)
        if error.kept is not None:
            result.log[-1] = (command, error.kept)
        error.result = result
        raise
    except ModelError as error:
        # what only shows when results are made
        failed = _failed(session, command, None, error)
        result.errors.extend(failed.diagnostics)
        failed.result = result
        raise failed from error
    except KeyboardInterrupt as interrupt:
        result.interrupted = _interruption(deck, result, command)
        interrupt.result = result  # type: ignore[attr-defined]
        raise
    except BaseException as error:
        message = str(error) or type(error).__name__
        result.errors.append(Diagnostic(ERROR, message, command.file, command.line))
        raise
    finally:
        # whatever ends a script, what it has computed is kept
        if out is not None:
            result.write(out)
    return result


def _interruption(deck: Deck, result: AdamsResult, command: Command) -> str:
    """Return a sentence on where a run was interrupted."""
    times = [segment.solution.t for segment in result.segments if segment.solution.t.size]
    reached = f"at TIME = {times[-1][-1] / deck.units.time:.6g}" if times else "before its first output"
    where = f", in command {command.text or type(command).__name__.lower()}" if command.line else ""
    end = command.end if isinstance(command, Simulate) else None
    asked = f" of {end:.6g}" if times and end is not None else ""
    return (
        f"the simulation of {deck.file} was interrupted {reached}{asked}{where}; what was computed until then is kept"
    )


def _carry_out(
    command: Command,
    session: Session,
    result: AdamsResult,
    tol: float | None,
    allow_unsupported: bool,
    progress: bool | Callable[[float], None] | None,
) -> bool:
    """Carry out one command of a script; return whether the next may follow."""
    result.log.append((command, None))
    if isinstance(command, Change):
        change(session, command, allow_unsupported)
    elif isinstance(command, Switch):
        switch(session, command)
    elif isinstance(command, Linear):
        result.log[-1] = (command, _linear(session, command, allow_unsupported))
    elif isinstance(command, Simulate):
        try:
            return _simulate(session, command, result, tol, allow_unsupported, progress)
        except ModelError as error:
            # a routine of the user that only results ask for
            raise _failed(session, command, None, error) from error
    return True


def _script(acf: str | Path | Script | None, end: float | None, steps: int | None, dtout: float | None) -> Script:
    if acf is not None and (end, steps, dtout) != (None, None, None):
        message = "a script has its own end times and steps; give either the script or end, steps and dtout"
        raise DeckError([Diagnostic(ERROR, message, "", 0)])
    if isinstance(acf, Script):
        return acf
    if acf is not None:
        return read_script(acf)
    if end is None:
        message = "there is no script and no end time; give an .acf file, or end= and steps= (or dtout=)"
        raise DeckError([Diagnostic(ERROR, message, "", 0)])
    if not end > 0.0 or (dtout is not None and not dtout > 0.0) or (steps is not None and steps < 1):
        message = f"end = {end}, steps = {steps}, dtout = {dtout}; they must be positive"
        raise DeckError([Diagnostic(ERROR, message, "", 0)])
    if steps is None and dtout is None:
        steps = 100
    return Script(commands=[Simulate(kind="DYNAMICS", end=end, steps=steps, dtout=dtout)])


def _settings(session: Session, tol: float | None) -> tuple[dict[str, Any], str | None]:
    """Return the integrator options and a remark when the method is another than asked for."""
    integrator = session.deck.only(st.Integrator) or st.Integrator()
    options: dict[str, Any] = {
        "integrator": DEFAULT,
        "formulation": "SI2",
        "tol": DEFAULT_TOLERANCE,
        "corrector": "modified",
    }
    note = None
    if integrator.method is not None:
        options["integrator"] = METHODS.get(integrator.method, DEFAULT)
        if integrator.method not in METHODS:
            note = f"{integrator.method} is not available; {DEFAULT} is used"
        elif integrator.formulation is None and integrator.method != "SI2_GSTIFF":
            options["formulation"] = "I3"
    if integrator.formulation is not None:
        options["formulation"] = integrator.formulation
    if integrator.error is not None:
        options["tol"] = integrator.error
    if tol is not None:
        options["tol"] = tol
    scale = session.deck.units.time
    for key, value in (("max_step", integrator.hmax), ("first_step", integrator.hinit), ("min_step", integrator.hmin)):
        if value is not None:
            options[key] = scale * value
    if integrator.maxit is not None:
        options["max_iterations"] = max(integrator.maxit, 1)
    if integrator.interpolate is not None:
        options["interpolate"] = integrator.interpolate in ("ON", "TRUE", "YES")
    if integrator.kmax is not None:
        options["max_order"] = min(max(integrator.kmax, 1), 6)
    if integrator.corrector is not None:
        options["corrector"] = "modified" if integrator.corrector.startswith("MOD") else "original"
    return options, note


def _simulate(
    session: Session,
    command: Simulate,
    result: AdamsResult,
    tol: float | None,
    allow_unsupported: bool,
    progress: bool | Callable[[float], None] | None,
) -> bool:
    """Carry out one SIMULATE, in parts where sensors fire; return whether the next command may follow."""
    times = output_times(session, command) if is_sequence(command) else np.array([session.time])
    watch = Watch(active_sensors(session) if command.kind in WATCHED and times.size > 1 else [])
    for span in parts(session, times) if command.kind in WATCHED and times.size > 1 else (times,):
        success, ended = _span(session, command, watch, span, result, tol, allow_unsupported, progress)
        if not success or ended:
            return success
        renew(session)
    return True


def _span(
    session: Session,
    command: Simulate,
    watch: Watch,
    times: np.ndarray,
    result: AdamsResult,
    tol: float | None,
    allow_unsupported: bool,
    progress: bool | Callable[[float], None] | None,
) -> tuple[bool, bool]:
    """Carry out an analysis between samples of discrete states.

    Returns
    -------
    success, ended : bool
        Whether the next command may follow, and whether a sensor has ended this one.
    """
    while True:
        segment, fired = _part(session, command, watch, times, tol, allow_unsupported, progress)
        if result.log[-1][1] is None:
            # the command stands there already, for what may go wrong
            result.log.pop()
        result.log.append((command, segment))
        if session.interrupted:
            raise KeyboardInterrupt
        if not segment.success:
            return False, True
        loud = [s for s in fired if not watch.silent(s)]
        for sensor in fired:
            watch.note_passage(sensor, RequestEvaluator(segment.model, segment.solution))
        if any(s.halt for s in loud):
            return False, True
        whole, times = times, after(times, session.time, loud)
        if not fired or times.size < 2 or any(s.back for s in loud):
            return True, any(s.back for s in loud)
        endless = watch.endless(whole, session.time)
        if endless:
            message = f"{fired[0].label()}: {endless}"
            raise DeckError([Diagnostic(ERROR, message, session.deck.file, fired[0].line)])


def _part(
    session: Session,
    command: Simulate,
    watch: Watch,
    times: np.ndarray,
    tol: float | None,
    allow_unsupported: bool,
    progress: bool | Callable[[float], None] | None,
) -> tuple[Segment, list[st.Sensor]]:
    """Carry out an analysis up to its end or to where sensors fire; return also these."""
    kind = command.kind or "DYNAMICS"
    if kind in ("DISPLACEMENT", "VELOCITY", "ACCELERATION"):
        # parts of the analysis of initial conditions, which is always done to the end
        kind = "INITIAL_CONDITIONS"
    model = None
    fired: list[st.Sensor] = []
    options: dict[str, Any] = {}
    try:
        model = _model(session, allow_unsupported, (session.time, float(times[-1])), _mode(kind, times))
        options, note = _settings(session, tol)
        if kind == "STATICS":
            note = _frozen(session, model)
            hold_states(model)
        if watch.first_step is not None:
            options["first_step"] = watch.first_step * session.deck.units.time
        solution, equilibrium = _solve(session, command, kind, model, times, options, progress, watch.stops())
        if watch.turned_round(RequestEvaluator(model, solution)):
            solution, equilibrium = _solve(session, command, kind, model, times, options, False, watch.stops())
        if watch.sensors:
            solution, fired = _to_passage(session, command, watch, model, times, options, solution)
    except (ModelError, ArithmeticError) as error:
        failed = _failed(session, command, model, error)
        failed.kept = kept_until(session, command, kind, model, error, options)
        raise failed from error

    segment, evaluator = segment_of(session, command, kind, model, solution, options, note, equilibrium)
    if kind not in ("STATICS", "INITIAL_CONDITIONS"):
        segment.passage = singular_passage(solution)
    if kind in ("DYNAMICS", "TRANSIENT"):
        segment.facets = faceted_touches(model, segment.tracks)
        segment.doubt = _doubt(session, segment)
    _remember(session, model, segment, evaluator)
    act(session, watch, segment, fired, evaluator)
    if kind not in ("STATICS", "INITIAL_CONDITIONS"):
        take_samples(session, evaluator, float(times[0]))
    return segment, fired


def _doubt(session: Session, segment: Segment) -> Doubt | None:
    """Return what a smaller error changes in a motion, where it is looked at."""
    solution = segment.solution
    times = solution.t / session.deck.units.time

    def again(options: dict[str, Any]) -> Solution:
        second = _solve(session, segment.command, segment.kind, segment.model, times, options, False)[0]
        session.interrupted |= second.status is Status.INTERRUPTED
        return second

    return doubt(segment.model, solution, segment.options, again, session.check)


def _to_passage(
    session: Session,
    command: Simulate,
    watch: Watch,
    model: AdamsModel,
    times: np.ndarray,
    options: dict[str, Any],
    solution: Solution,
) -> tuple[Solution, list[st.Sensor]]:
    """Return a solution that ends where sensors fire, and these; the given one if none does."""
    scale = session.deck.units.time
    met = watch.true_at_start(solution, RequestEvaluator(model, solution))
    if met:
        return initial_conditions(model.mechanism.compile(float(times[0]) * scale)), met
    if command.kind == "STATICS":
        return equilibria_to_passage(watch, model, times * scale, solution, STATIC_TOLERANCE)
    if solution.result.status != Status.TERMINAL_EVENT:
        return solution, []
    passage, fired = watch.passed(solution)
    reached = up_to(times, in_unit(passage, scale))
    if reached.size < 2:
        # at once, as where two sensors fire together
        return initial_conditions(model.mechanism.compile(float(times[0]) * scale)), fired
    # again, to end at the very time: the steps up to it are the same
    again = _solve(session, command, "DYNAMICS", model, reached, options, False)[0]
    return again, [] if again.status is Status.INTERRUPTED else fired


def _frozen(session: Session, model: AdamsModel) -> str | None:
    """Return a remark on friction in a static analysis, unless the deck itself leaves it out there."""
    active = [f for f in session.deck.of(st.Friction).values() if ("friction", f.id) in model.names]
    return (
        frozen_friction(model.mechanism) if not all((f.inactive or "").startswith("STATIC") for f in active) else None
    )


def _solve(
    session: Session,
    command: Simulate,
    kind: str,
    model: AdamsModel,
    times: np.ndarray,
    options: dict[str, Any],
    progress: bool | Callable[[float], None] | None,
    stops: Sequence[StopAt] = (),
) -> tuple[Solution, StaticResult | None]:
    """Solve one analysis at the output times, given in the deck's unit; of a single equilibrium return it, too."""
    scale = session.deck.units.time
    times = times * scale
    options_without = {"integrator": NEWTON, "formulation": "I3"}
    if kind == "INITIAL_CONDITIONS":
        options.update(options_without)
        return initial_conditions(model.mechanism.compile(float(times[0]))), None
    if kind == "STATICS":
        options.update(options_without, tol=STATIC_TOLERANCE)
        system = model.mechanism.compile(float(times[0]))
        if times.size > 1:
            return quasi_static(system, times, tol=STATIC_TOLERANCE), None
        equilibrium = static_equilibrium(system, tol=STATIC_TOLERANCE)
        return equilibrium.solution, equilibrium
    if kind == "KINEMATICS":
        system = model.mechanism.compile(float(times[0]))
        report = system.initialise()
        if report.degrees_of_freedom > 0:
            message = f"a kinematic analysis needs zero degrees of freedom; the model has {report.degrees_of_freedom}"
            raise DeckError([Diagnostic(ERROR, message, command.file, command.line)])
        if not system.model.differential_states.any() and not stops:
            options.update(options_without)
            return kinematic(system, times), None
    output_step = float(np.diff(times).max())
    options.setdefault("first_step", FIRST_STEP * output_step)
    options.setdefault("max_step", output_step)
    solution = model.mechanism.simulate(
        float(times[-1]),
        t_start=session.time * scale,
        t_eval=times,
        progress=progress,
        stops=stops,
        continued=session.time > 0.0,
        **options,
    )
    return solution, None


def _linear(session: Session, command: Linear, allow_unsupported: bool) -> Modes | LinearPlant:
    """Carry out LINEAR at the present position."""
    check_linear(command)
    model = None
    time = session.time * session.deck.units.time

    def build(given: Session) -> tuple[AdamsModel, System]:
        made = _model(given, allow_unsupported, (session.time, session.time), MODES["LINEAR"])
        return made, made.mechanism.compile(time)

    try:
        if command.statemat:
            return plant_of(session, command, build)
        model = _model(session, allow_unsupported, (session.time, session.time), MODES["LINEAR"])
        return linear_modes(model.mechanism, t=time)
    except (ModelError, ArithmeticError) as error:
        raise _failed(session, command, model, error) from error


def _failed(session: Session, command: Command, model: AdamsModel | None, error: Exception) -> DeckError:
    """Return an error with the line of the statement it names and the command it happened in."""
    text = str(error)
    where = f" (in {command.file}:{command.line})" if command.line else ""
    return DeckError([Diagnostic(ERROR, text + where, session.deck.file, _line(session.deck, model, text))])


def _line(deck: Deck, model: AdamsModel | None, message: str) -> int:
    """Return the line of the first statement a message names, 0 when it names none."""
    called = next((s for s in deck if f"'{s.label()}: USER'" in message), None)
    if called is not None:
        return called.line
    sources = model.sources if model is not None else {}
    places = []
    for name, statement in sources.items():
        found = [at for at in (message.find(f"'{name}'"), message.find(f"{name}:")) if at >= 0]
        if found:
            places.append((min(found), statement.line))
    return min(places, default=(0, 0))[1]


def _mode(kind: str, times: np.ndarray) -> int:
    """Return the MODE of an analysis."""
    return MODES["QUASI_STATICS" if kind == "STATICS" and times.size > 1 else kind]


def _model(session: Session, allow_unsupported: bool, span: tuple[float, float], mode: int) -> AdamsModel:
    """Build the mechanism of the session's present state."""
    present = Present(mode, session.sensed)
    inactive = frozenset(session.inactive)
    if session.state is None:
        session.state = {}
        model = build_model(session.deck, allow_unsupported, inactive, span=span, present=present)
        model.mechanism.redundancy = session.redundancy
        if not model.initial_motions:
            return model
        session.state = with_initial_motions(model)
    model = build_model(session.deck, allow_unsupported, inactive, session.state, span, present)
    model.mechanism.redundancy = session.redundancy
    model.mechanism.turns.update(session.turns)
    for name, state in zip(model.mechanism.state_names, model.mechanism.every_state):
        state.start = session.states.get(name, state.start)
    return model


def _remember(session: Session, model: AdamsModel, segment: Segment, evaluator: RequestEvaluator) -> None:
    """Keep the final state as the start of the next analysis."""
    s = segment.solution
    names = s.system.body_names
    last = [
        np.concatenate(
            [s.com_position(n)[-1], s.orientation(n)[-1].ravel(), s.com_velocity(n)[-1], s.angular_velocity(n)[-1]]
        )
        for n in names
    ]
    modal = {
        b.name: (s.modal_coordinates(b.name)[-1].copy(), s.modal_velocities(b.name)[-1].copy())
        for b in model.mechanism.bodies.values()
        if isinstance(b, ModalBody)
    }
    session.state = part_states(model, np.array(last), modal)
    session.turns = evaluator.turns()
    for name in model.mechanism.state_names:
        session.states[name] = float(evaluator.state(name)[-1])
    session.time = float(s.t[-1]) / session.deck.units.time
