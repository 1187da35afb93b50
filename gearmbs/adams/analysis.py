"""One analysis of a deck: SIMULATE in parts between sensors, and LINEAR; and what its results show of it."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gearmbs.adams.builders.mechanism import build_model, part_states, with_initial_motions
from gearmbs.adams.builders.scopes import MODES, AdamsModel, Present, hold_states
from gearmbs.adams.errors import ERROR, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Command, Linear, Simulate
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.results.record import NEWTON, Segment
from gearmbs.adams.results.remarks import Doubt, assembly_of, doubt, faceted_touches, off_the_end, tracks_of
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.adams.results.result import AdamsResult
from gearmbs.adams.sensors import Watch, act, after, equilibria_to_passage, in_unit, parts, renew, take_samples, up_to
from gearmbs.adams.session import (
    Session,
    active_sensors,
    check_linear,
    is_sequence,
    output_times,
    plant_variables,
    remark,
)
from gearmbs.dae.analyses import plant as _plant
from gearmbs.dae.analyses.kinematics import kinematic
from gearmbs.dae.analyses.modes import Modes
from gearmbs.dae.analyses.plant import LinearPlant
from gearmbs.dae.analyses.statics import StaticResult, initial_conditions, quasi_static, static_equilibrium
from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.methods import DEFAULT, INTEGRATORS
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import ModelError
from gearmbs.dae.result import Status
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.checks import singular_passage
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.solve.analyses import frozen_friction, linear_modes
from gearmbs.mechanism.solve.points import joint_coordinates
from gearmbs.mechanism.solve.simulate import StopAt

DEFAULT_TOLERANCE = 1e-8
"""Local error where a deck gives no ERROR, tighter than ADAMS's 1e-3 so that results do not depend on it."""

COARSER = 100.0
"""Times as large an error where a deck gives none and its positions have no digits left for it, as often as needed."""
COARSEST = 1e-4
"""The largest error that is taken so, a tenth of ADAMS's default."""

FIRST_STEP = 0.05
"""ADAMS's default HINIT, in output steps."""

STATIC_TOLERANCE = 1e-10
"""Unbalanced load allowed at an equilibrium, relative to the heaviest weight or largest load."""

WATCHED = (None, "DYNAMICS", "TRANSIENT", "KINEMATICS", "STATICS")
"""Analyses in which sensors watch, where they go through a span of time."""

METHODS = {adams: name for name, known in INTEGRATORS.items() for adams in known.adams}
"""Integrators by what ADAMS calls them."""


def _settings(session: Session) -> tuple[dict[str, Any], str | None]:
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
    if session.tol is not None:
        options["tol"] = session.tol
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


def simulate(session: Session, command: Simulate, result: AdamsResult) -> bool:
    """Carry out one SIMULATE, in parts where sensors fire; return whether the next command may follow."""
    times = output_times(session, command) if is_sequence(command) else np.array([session.time])
    watch = Watch(active_sensors(session) if command.kind in WATCHED and times.size > 1 else [])
    for span in parts(session, times) if command.kind in WATCHED and times.size > 1 else (times,):
        success, ended = _span(session, command, watch, span, result)
        if not success or ended:
            return success
        renew(session)
    return True


def _span(
    session: Session, command: Simulate, watch: Watch, times: np.ndarray, result: AdamsResult
) -> tuple[bool, bool]:
    """Carry out an analysis between samples of discrete states.

    Returns
    -------
    success, ended : bool
        Whether the next command may follow, and whether a sensor has ended this one.
    """
    while True:
        segment, fired = _part(session, command, watch, times)
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


def _part(session: Session, command: Simulate, watch: Watch, times: np.ndarray) -> tuple[Segment, list[st.Sensor]]:
    """Carry out an analysis up to its end or to where sensors fire; return also these."""
    kind = command.kind or "DYNAMICS"
    if kind in ("DISPLACEMENT", "VELOCITY", "ACCELERATION"):
        # parts of the analysis of initial conditions, which is always done to the end
        kind = "INITIAL_CONDITIONS"
    model = None
    fired: list[st.Sensor] = []
    options: dict[str, Any] = {}
    try:
        model = _model(session, (session.time, float(times[-1])), _mode(kind, times))
        options, note = _settings(session)
        if kind == "STATICS":
            note = _frozen(session, model)
            hold_states(model)
        if watch.first_step is not None:
            options["first_step"] = watch.first_step * session.deck.units.time
        solution, equilibrium = _solve(session, command, kind, model, times, options, session.progress, watch.stops())
        while solution.status is Status.BELOW_ROUNDING and _goes_coarser(session, options):
            options["tol"] *= COARSER
            note = (
                f"the deck gives no ERROR, and in double precision what moves so far has no digits left for "
                f"{DEFAULT_TOLERANCE:g}; ERROR = {options['tol']:g} is used"
            )
            solution, equilibrium = _solve(session, command, kind, model, times, options, False, watch.stops())
        evaluator = RequestEvaluator(model, solution)
        if watch.turned_round(evaluator):
            solution, equilibrium = _solve(session, command, kind, model, times, options, False, watch.stops())
        if watch.sensors:
            solution, fired = _to_passage(session, command, watch, model, times, options, solution)
    except (ModelError, ArithmeticError) as error:
        told = failed(session, command, model, error)
        told.kept = kept_until(session, command, kind, model, error, options)
        raise told from error

    if evaluator.solution is not solution:
        evaluator = RequestEvaluator(model, solution)
    segment = segment_of(session, command, kind, evaluator, options, note, equilibrium)
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


def _goes_coarser(session: Session, options: dict[str, Any]) -> bool:
    """Return whether a larger error may be taken: where nobody has asked for one."""
    integrator = session.deck.only(st.Integrator)
    asked = session.tol is not None or (integrator is not None and integrator.error is not None)
    return not asked and options["tol"] * COARSER <= COARSEST * 1.001


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
    # ERROR is that of positions and velocities alike
    options.setdefault("rate_scale", 1.0)
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


def linear(session: Session, command: Linear) -> Modes | LinearPlant:
    """Carry out LINEAR at the present position."""
    check_linear(command)
    model = None
    time = session.time * session.deck.units.time

    def build(given: Session) -> tuple[AdamsModel, System]:
        made = _model(given, (session.time, session.time), MODES["LINEAR"])
        return made, made.mechanism.compile(time)

    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            found: Modes | LinearPlant
            if command.statemat:
                found = plant_of(session, command, build)
            else:
                model = _model(session, (session.time, session.time), MODES["LINEAR"])
                found = linear_modes(model.mechanism, t=time)
        for warning in warned:
            remark(session, Diagnostic(WARNING, f"LINEAR: {warning.message}", command.file, command.line))
        return found
    except (ModelError, ArithmeticError) as error:
        raise failed(session, command, model, error) from error


def failed(session: Session, command: Command, model: AdamsModel | None, error: Exception) -> DeckError:
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


def _model(session: Session, span: tuple[float, float], mode: int) -> AdamsModel:
    """Build the mechanism of the session's present state."""
    present = Present(mode, session.sensed)
    inactive = frozenset(session.inactive)
    if session.state is None:
        session.state = {}
        model = build_model(session.deck, session.allow_unsupported, inactive, span=span, present=present)
        model.mechanism.redundancy = session.redundancy
        if not model.initial_motions:
            return model
        session.state = with_initial_motions(model)
    model = build_model(session.deck, session.allow_unsupported, inactive, session.state, span, present)
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


# The linear plant between a deck's PINPUT and POUTPUT, as LINEAR/STATEMAT asks for it.
#
# The VARIABLEs of the PINPUT become states that keep their values, those of the POUTPUT the rates of further states, so
# that the matrices are parts of one exact linearisation; see `gearmbs.dae.analyses.plant`.


def plant_of(session: Session, command: Linear, build: Callable[[Session], tuple[AdamsModel, System]]) -> LinearPlant:
    """Carry out LINEAR/STATEMAT at the session's present state; ``build`` makes a session's model and system."""
    deck = session.deck
    inputs = plant_variables(deck, st.PlantInput, command.pinput, command)
    outputs = plant_variables(deck, st.PlantOutput, command.poutput, command)
    model, system = build(session)
    evaluator = RequestEvaluator(model, initial_conditions(system))
    values = [float(evaluator.expression(f"VARVAL({v.id})")[-1]) for v in inputs]
    first = 1 + max(deck.of(st.Diff), default=0)
    items = {kind: dict(group) for kind, group in deck.items.items()}
    variables, diffs = items.setdefault(st.Variable, {}), items.setdefault(st.Diff, {})
    ids = range(first, first + len(inputs) + len(outputs))
    for k, (variable, value) in enumerate(zip(inputs, values)):
        variables[variable.id] = replace(variable, function=f"DIF({first + k})")
        diffs[first + k] = st.Diff(id=first + k, function="0", ic=(value,))
    for k, variable in enumerate(outputs, len(inputs)):
        diffs[first + k] = st.Diff(id=first + k, function=f"VARVAL({variable.id})")
    _, system = build(replace(session, deck=replace(deck, items=items)))
    # the names of the differential states, in their order among the unknowns
    kinds = system.model.differential_states
    names = [name for name, differential in zip(system.state_names, kinds) if differential]
    places = [names.index(str(number)) for number in ids]
    labels = {str(n): v.name or v.label() for n, v in zip(ids, [*inputs, *outputs])}
    shown = [labels.get(name, f"DIFF_{name}" if name.isdigit() else name) for name in names]
    count = len(inputs)
    joints = joint_coordinates(model.mechanism)
    return _plant.linear_plant(system, places[:count], places[count:], shown, deck.units.time, joints)


# From the solution of an analysis to what its results show: ``segment_of``, ``kept_until``.


def segment_of(
    session: Session,
    command: Simulate,
    kind: str,
    evaluator: RequestEvaluator,
    options: dict[str, Any],
    note: str | None,
    equilibrium: StaticResult | None = None,
) -> Segment:
    """Return an analysis with its requests, forces, tracks and variables.

    Raises
    ------
    DeckError
        If a REQUEST cannot be evaluated.
    """
    model, solution = evaluator.model, evaluator.solution
    segment = Segment(command, kind, model, solution, options, note, equilibrium=equilibrium)
    if kind != "STATICS":
        segment.assembly = assembly_of(model, solution)
    for request in session.deck.of(st.Request).values():
        try:
            segment.requests[request.id] = evaluator.request(request)
        except ExpressionError as error:
            raise DeckError([Diagnostic(ERROR, str(error), session.deck.file, request.line)]) from error
    for kind_id in model.pairs:
        segment.wrenches[kind_id] = evaluator.wrench(*kind_id)[:, :6]
    segment.tracks = tracks_of(model, solution)
    segment.variables = evaluator.variables()
    segment.note = "\n".join(filter(None, [note, *off_the_end(model, solution)])) or None
    return segment


def kept_until(
    session: Session, command: Simulate, kind: str, model: AdamsModel | None, error: Exception, options: dict[str, Any]
) -> Segment | None:
    """Return what an analysis computed before a routine of the user failed in it, None where there is nothing."""
    solution = getattr(error, "solution", None)
    if model is None or solution is None or solution.t.size == 0:
        return None
    with contextlib.suppress(ModelError, DeckError, ArithmeticError):
        return segment_of(session, command, kind, RequestEvaluator(model, solution), options, None)
    return None
