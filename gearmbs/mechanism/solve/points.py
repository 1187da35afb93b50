"""Operating points: a mechanism, with expressions added to it, at one of its states."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.analyses.coordinates import Frame, JointCoordinate
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.statics import StaticResult
from gearmbs.dae.analyses.statics import static_equilibrium as _static_equilibrium
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.unknowns import FORMULATIONS
from gearmbs.dae.model.model import Configuration, Model
from gearmbs.dae.problem import Counted, ModelError, Number
from gearmbs.dae.result import DAEResult, Status
from gearmbs.dae.results.solution import Solution
from gearmbs.dae.state import State
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.simulate import prepared

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System
    from gearmbs.mechanism.mechanism import Mechanism

ANGLES = ("revolute", "cylindrical", "planar", "screw")
"""Kinds of joints that keep both axes z parallel and let I turn about them."""
WAYS = ("translational", "cylindrical")
"""Kinds of joints that let I move along z_J and nothing else but turn about it."""
CHOICES = "choose 'initial', 'equilibrium', or give a StaticResult, a State or a Solution"


@dataclass(frozen=True)
class Point:
    """Where a mechanism stands.

    Attributes
    ----------
    t : float
        Time at which functions of time are frozen, s.
    configuration : Configuration or None
        Positions and velocities; None: as the mechanism starts.
    states : dict of str to float
        User-defined states and those of elements.
    system : System or None
        What ``idata`` and ``rdata`` are the tables of: rows kept, turns counted.
    idata, rdata : ndarray or None
    unknowns : dict of str to float
        Of an equilibrium, in which nothing moves whatever its motions do: all unknowns of the I3 formulation.
    numbers : dict of str to list of ndarray
        What stands in the places of inputs and parameters.
    turns : dict
        Angles through full turns, rad, by what `Mechanism.turns` has them by.
    state : State or None
        The state it was made from.
    """

    t: float
    configuration: Configuration | None = None
    states: dict[str, float] | None = None
    system: System | None = None
    idata: np.ndarray | None = None
    rdata: np.ndarray | None = None
    unknowns: dict[str, float] | None = None
    numbers: dict[str, list[np.ndarray]] = field(default_factory=dict)
    turns: dict[tuple[str, str, str], float] = field(default_factory=dict)
    state: State | None = None


def point_of(mechanism: Mechanism, at: Any, t: float | None) -> Point:
    """Return the operating point that is asked for.

    Parameters
    ----------
    mechanism : Mechanism
    at : {"initial", "equilibrium"}, StaticResult, State, Solution or Point
    t : float, optional
        Time of functions of time, s; of a Solution the output time, default its last.

    Raises
    ------
    ModelError
        For anything else, for a time that a State or an equilibrium has of its own, and for a state of another model.
    """
    if isinstance(at, Point):
        return at
    if t is not None:
        t = quantity(t, "time", "t")
    if isinstance(at, Solution):
        bodies = at.system.body_names
        if list(mechanism.bodies) != bodies:
            raise ModelError(
                f"at: a solution with the bodies {', '.join(bodies)}; mechanism '{mechanism.name}' has "
                f"{', '.join(mechanism.bodies)}; take a solution of this one"
            )
        state = at.state_at(float(at.t[-1]) if t is None else t)
        return _of_solution(at.system, at.problem, at.members, state)
    if isinstance(at, State):
        if t is not None and t != at.t:
            raise ModelError(f"t = {t:g} s; the state is one at t = {at.t:g} s; leave t away")
        return _of_state(mechanism, at)
    if isinstance(at, str) and at in ("initial", "equilibrium"):
        time = 0.0 if t is None else t
        if at == "initial":
            return Point(time)
        at = _static_equilibrium(mechanism.compile(time))
    if not isinstance(at, StaticResult):
        raise ModelError(f"at = {at!r}; {CHOICES}")
    return _of_equilibrium(mechanism, at)


def _of_equilibrium(mechanism: Mechanism, at: StaticResult) -> Point:
    if list(mechanism.bodies) != list(at.body_names):
        raise ModelError(f"the equilibrium is not one of mechanism '{mechanism.name}': its bodies differ")
    instant = at.solution.instant()
    names = instant.problem.names
    unknowns = dict(zip(names, instant.y.tolist(), strict=True))
    z = slice(instant.at["z"], instant.at["mu"])
    states = dict(zip(instant.system.state_names, instant.y[z].tolist(), strict=True))
    numbers = _numbers(instant.problem.numbers, instant.rdata)
    tables = instant.system, instant.idata, instant.rdata
    turns = _turns(instant.problem.counted, instant.rdata, instant.t)
    return Point(instant.t, instant.configuration(), states, *tables, unknowns, numbers, turns)


def _of_state(mechanism: Mechanism, state: State) -> Point:
    """Return the point of a state: of the model it belongs to, whatever of it was integrated, and how."""
    refusal: ModelError | None = None
    for lump in dict.fromkeys([mechanism.lump, False, True]):
        for formulation in FORMULATIONS:
            with suppress(KeyError):
                system, problem, members, _ = prepared(mechanism, state.t_model, lump, formulation, 1.0, True)
                try:
                    state.check(problem)
                except ModelError as error:
                    # what differs from the model with as many unknowns says most
                    if refusal is None or len(state.y) == problem.n:
                        refusal = error
                    continue
                return _of_solution(system, problem, members, state)
    assert refusal is not None
    raise refusal


def _of_solution(system: System, problem: Any, members: Any, state: State) -> Point:
    idata, rdata = state.tables(problem)
    nothing = np.empty((0, problem.n))
    row = Solution(system, problem, DAEResult(np.empty(0), nothing, nothing, Status.SUCCESS, ""), members)
    now = row.over(np.array([state.t]), state.y[None, :], [(0, idata)])
    places = int(idata[T.H_Z]) + np.arange(len(system.state_names))
    states = dict(zip(system.state_names, state.y[places].tolist(), strict=True))
    # what was not changed on the way is the mechanism's own, which may be another one than that of the run
    changed = {name: one for name, one in problem.numbers.items() if np.isin(one.cells(), state.reals[0]).any()}
    numbers = _numbers(changed, rdata)
    turns = _turns(problem.counted, rdata, state.t)
    point = Point(state.t, now._configuration(0), states, numbers=numbers, turns=turns, state=state)
    return point if members is not None else replace(point, system=system, idata=idata, rdata=rdata)


def _turns(counted: Counted | None, rdata: np.ndarray, t: float) -> dict[tuple[str, str, str], float]:
    """Return the angles that a table of numbers counts, at a time."""
    if counted is None:
        return {}
    angles = counted.values(np.array([t]), rdata[counted.places][None, :])[0].tolist()
    return dict(zip(counted.angles, angles, strict=True))


def turns_of(solution: Solution, point: Point, instant: Instant) -> dict[tuple[str, str, str], float]:
    """Return angles that an instant counts and its point does not know, as a solution counts them from its start on."""
    counted, t, found = instant.problem.counted, solution.t, {}
    for function, i, j in counted.angles if counted is not None and point.t <= t[-1] else ():
        if (function, i, j) not in point.turns:
            # not markers made for the outputs of the plant
            with suppress(ModelError):
                # between outputs a line tells full turns: the next one may be more than half a turn ahead
                found[function, i, j] = float(np.interp(point.t, t, solution.evaluate(f'{function}("{i}", "{j}")')))
    return found


def _numbers(known: Mapping[str, Number], rdata: np.ndarray) -> dict[str, list[np.ndarray]]:
    """Return what stands in the places of inputs and parameters."""
    return {name: [rdata[p.at : p.at + 1 + p.size].copy() for p in one.places] for name, one in known.items()}


def _with_numbers(model: Model, numbers: Mapping[str, list[np.ndarray]], t: float) -> Model:
    """Return a model whose inputs and parameters have the values of another one at a time.

    It has the other's places, and behind them those in expressions of its own.
    """
    tables = {T.H_R_EXTRA: model.extra_r.copy(), T.H_R_FUNCTION: model.function_r.copy()}
    for name, number in model.numbers.items():
        if (known := numbers.get(name)) is None:
            continue
        for place, values in zip(number.places, known, strict=False):
            tables[place.table][place.at : place.at + values.size] = values
        first = tables[number.places[0].table]
        for place in number.places[len(known) :]:
            place.write(tables[place.table], t, number.value(first, t), number.slope(first))
    return replace(model, extra_r=tables[T.H_R_EXTRA], function_r=tables[T.H_R_FUNCTION])


def joint_coordinates(mechanism: Mechanism) -> list[JointCoordinate]:
    """Return what the joints of a mechanism leave free between rigid bodies."""
    numbers = {id(body): k for k, body in enumerate(mechanism.bodies.values())}
    numbers[id(mechanism.ground)] = -1
    found = []
    for joint in mechanism.joints.values():
        sides = (joint.i, joint.j)
        if any(isinstance(side.body, ModalBody) for side in sides):
            continue
        i, j = (
            Frame(
                numbers[id(side.body)],
                side.position - (0.0 if side.body.is_ground else side.body.com),
                side.orientation,
            )
            for side in sides
        )
        if joint.kind in ANGLES:
            found.append(JointCoordinate(f"{joint.name}: angle", True, i, j))
        if joint.kind in WAYS:
            found.append(JointCoordinate(f"{joint.name}: displacement", False, i, j))
    return found


def instant_at(mechanism: Mechanism, point: Point) -> Instant:
    """Return the unknowns of a mechanism at a point; it may have more states than that which the point was made of."""
    system = mechanism.compile(point.t)
    if point.configuration is None:
        return _settled(Instant(system, "I3"), True)
    system.configuration = point.configuration
    known = point.states or {}
    system.state_start = np.array(
        [known.get(name, start) for name, start in zip(system.state_names, system.state_start, strict=True)]
    )
    if point.system is not None and point.idata is not None and point.rdata is not None:
        names = system.row_names
        system.keep_rows(np.array([names.index(name) for name in point.system.row_names], dtype=np.int64))
        system.model = _counted(system.model, point.system.model, point.idata, point.rdata, point.t)
    if point.numbers:
        system.model = _with_numbers(system.model, point.numbers, point.t)
    system.assembler = type(system.assembler)(system.model)
    instant = Instant(system, "I3")
    if point.unknowns is not None and point.idata is not None:
        codes = int(point.idata[T.H_I_CODE]) + np.arange(int(point.idata[T.H_BODIES]))
        own = int(instant.idata[T.H_I_CODE]) + np.arange(codes.size)
        instant.idata[own] = point.idata[codes]
        instant.y = np.array(
            [point.unknowns.get(name, value) for name, value in zip(instant.problem.names, instant.y, strict=True)]
        )
    return _settled(instant, point.unknowns is None)


def _settled(instant: Instant, released: bool) -> Instant:
    instant.y = instant.settle(instant.y)
    instant.released = released
    return instant


def _counted(model: Model, source: Model, idata: np.ndarray, rdata: np.ndarray, t: float) -> Model:
    """Return a model whose counted angles start where those of the tables of another one are.

    It has the other's constraint rows, and its expressions and elements before those of its own.
    """
    reference, n = int(idata[T.H_R_REFERENCE]), len(source.reference)
    past = t - rdata[reference + n]
    values = rdata[reference + n + 1 : reference + 2 * n + 1] + past * rdata[reference + 2 * n + 1 :][:n]
    extra, first = model.extra_r.copy(), int(idata[T.H_R_EXTRA])
    for own, other, tape in zip(model.tape_rows, source.tape_rows, source.tapes, strict=False):
        m, at = tape.n_angles, first + int(other[T.TAPE_REFERENCE])
        now = rdata[at + m : at + 2 * m] + past * rdata[at + 2 * m : at + 3 * m]
        start = int(own[T.TAPE_REFERENCE])
        extra[start : start + m] = extra[start + m : start + 2 * m] = now
    for own, other in zip(model.angles, source.angles, strict=False):
        at = first + int(other[T.ANGLE_AT])
        extra[int(own[T.ANGLE_AT]) : int(own[T.ANGLE_AT]) + 2] = rdata[at + 1] + past * rdata[at + 2]
    return replace(model, reference=values, extra_r=extra)
