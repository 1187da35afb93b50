"""The solution of a mechanism: poses, velocities, accelerations, reactions, loads, energies, by name.

Accelerations and reactions come from the index-1 system solved at each output time, so they carry none
of the integrator's noise.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearmbs._display import Shown
from gearmbs._lazy import former_name
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model import evaluator as outputs
from gearmbs.dae.model.model import Configuration
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.result import DAEResult, SolverStats, Status
from gearmbs.dae.results.frames import Evaluated
from gearmbs.dae.results.measured import Measured
from gearmbs.dae.results.shared import Fills, Shared
from gearmbs.dae.state import State
from gearmbs.progress import waiting
from gearmbs.units import to_si

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.dae.model.members import Members


PART_SIZE = 2048
"""Output times whose records stay in the processor's cache, and outweigh what Python does for each part."""

SAME = 1e-6
"""Part of the largest acceleration, multiplier or load nearby within which those at an end of a run are those just
inside: far above rounding, and what a table or an expression jumps by where it ends is more."""
NEAR = 8
"""Outputs that are nearby."""

CONFLICT_SAMPLES = 50
"""Outputs at which constraints removed as redundant are looked at."""


def _sum_of_rows(records: np.ndarray, rows: list[int]) -> np.ndarray:
    """Return the sum over some constraint rows, (m, rows, 3) to (m, 3): fastest by single columns."""
    total = np.empty((len(records), 3))
    for c in range(3):
        total[:, c] = records[:, rows[0], c]
        for row in rows[1:]:
            total[:, c] += records[:, row, c]
    return total


class Solution(Measured, Shown):
    """Motion and forces of a mechanism over the output times.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Output times, s.
    result : DAEResult
        The integrator's own account: y, y', status, message, statistics.
    system : System
        Names and tables of all bodies and joints.
    members : Members or None
        Where bodies fixed to each other were integrated as one: what they are made of. ``problem`` and ``result`` are
        about the composites then, everything else about all bodies.
    remark : str
        What ``message`` says besides, for instance of an option without effect.
    inside : mapping of float
        Of the start and the end of a run, s, times next to them within it. A table or an expression may begin or end
        there: accelerations, reactions and loads that jump at an end are those of the inside.
    jumped : frozenset of float
        Output times at which velocities have jumped, s: those told there are the ones before.
    initial : State or None
        The state that the run started in, if it was given one.
    given : ndarray of int or None
        Places of numbers that were set in the run, which belong to its states.
    """

    other_words: ClassVar[Mapping[str, str]] = {
        "time": "t",
        "times": "t",
        "y": "result.y",
        "force": "load(name) of a load, reaction(name) of a joint",
        "forces": "load(name) of a load, reaction(name) of a joint",
        "torque": "load(name) of a load, reaction(name) of a joint",
        "data": "to_dataset()",
        "to_dataframe": "to_dataset().to_dataframe()",
    }

    inside: Mapping[float, float] = MappingProxyType({})
    jumped: frozenset[float] = frozenset()
    set_up: Mapping[str, Any] = MappingProxyType({})
    """Formulation, rate scale and lumping by which `simulate` has set up the equations, once it has."""
    at_steps: Mapping[tuple[str, str], Any] = MappingProxyType({})
    """What is read of the integrator's own steps instead of evaluated, by method and name; see `watched.Watch`."""

    def __init__(
        self,
        system: System,
        problem: DAEProblem,
        result: DAEResult,
        members: Members | None = None,
        remark: str = "",
    ) -> None:
        self.system = system
        self.problem = problem
        self.result = result
        self.members = members
        self.remark = remark
        self.initial: State | None = None
        self.given: np.ndarray | None = None
        self.t = result.t
        self._shared: Shared | None = None
        samples = np.linspace(0, self.t.size - 1, min(self.t.size, CONFLICT_SAMPLES))
        self._conflict = self.find_conflict(np.unique(samples.astype(int)))

    @property
    def success(self) -> bool:
        """True when the run reached its end and no constraint was found violated on the way."""
        return self.result.success and self._conflict is None

    @property
    def status(self) -> Status:
        """How the run ended."""
        return self.result.status if self._conflict is None else Status.CONFLICTING_CONSTRAINTS

    @property
    def message(self) -> str:
        """What happened, when, which unknown, what to try; what the assembly moved; redundant constraints; remarks."""
        if self._conflict is not None:
            return self._conflict
        parts = [self.result.message]
        if not self.result.success and self.t.size:
            parts.append(self.system.locking(self._last_configuration(), float(self.t[-1])) or "")
        report = self.system.report
        parts.append((report.correction() if report is not None else None) or "")
        aside = report.redundant if report is not None else []
        if aside:
            parts.append(f"Removed as redundant: {', '.join(aside)}.")
        parts.append(self.remark)
        return " ".join(part for part in parts if part)

    def _last_configuration(self) -> Configuration:
        """Return the configuration at the last output time, without evaluating the others."""
        if "_records" in self.__dict__:
            return self._configuration(-1)
        return next(self.parts(np.array([self.t.size - 1])))._configuration(-1)

    def _configuration(self, k: int) -> Configuration:
        """Return the positions and velocities at one output time."""
        return Configuration.of(self._records.pose[k], self._records.bodies)

    @property
    def stats(self) -> SolverStats:
        """Counts of steps, evaluations and times."""
        return self.result.stats

    @cached_property
    def _records(self) -> outputs.Records:
        """Everything at every output time, once somebody asks."""
        return self._evaluate()

    def _evaluate(self) -> outputs.Records:
        """Solve the index-1 system at every output time."""
        shared = self._shared
        evaluator = self._evaluator() if shared is None else shared.evaluator
        if shared is None or self.t.size > shared.size:
            records = self._new_records(self.t.size)
        else:
            records = shared.room.first(self.t.size)
        self._fill(evaluator, records)
        return records

    def _fill(self, evaluator: Fills, records: outputs.Records) -> None:
        """Fill ``records`` for all output times, in their order."""
        last = self.t.size - 1
        rows = [row for row in (0, last) if row >= 0 and float(self.t[row]) in self.inside]
        # the start comes before all others, for turns are counted
        limits = {0: self._just_inside(evaluator, 0)} if 0 in rows else {}
        self._fill_held(evaluator, records)
        if last in rows and last > 0:
            limits[last] = self._just_inside(evaluator, last)
        for row, limit in limits.items():
            near = slice(max(row - NEAR, 0), row + NEAR + 1)
            pairs = [(limit.solution[0], records.solution[near]), (limit.loads[0], records.loads[near])]
            off = [np.abs(there - here[row - near.start]).max(initial=0.0) for there, here in pairs]
            if not all(d <= SAME * np.abs(here).max(initial=0.0) for d, (_, here) in zip(off, pairs, strict=True)):
                for column, value in zip(records, limit):
                    column[row] = value[0]

    def _just_inside(self, evaluator: Fills, row: int) -> outputs.Records:
        """Return records of an output at an end of the run as they are next to it."""
        record, t, y = self._new_records(1), self.inside[float(self.t[row])], self.result.y[row : row + 1]
        if self.result.held is not None:
            cells, values = self.result.held
            evaluator.rdata[cells] = values[row]
        if self.result.counted is not None and self.problem.counted is not None:
            evaluator.rdata[self.problem.counted.places] = self.result.counted[row]
        evaluator.fill(np.array([t]), y, [(0, self.result.epoch_of(row))], record)
        return record

    def _fill_held(self, evaluator: Fills, records: outputs.Records) -> None:
        """Fill ``records`` with the numbers of the equations as they were at each output time.

        Turns are taken from the run where they cannot be counted from one output to the next, and go on from there.
        """
        result, angles = self.result, self.problem.counted
        if result.held is None and (result.counted is None or angles is None):
            evaluator.fill(self.t, result.y, result.epochs, records)
            return
        tables: list[tuple[np.ndarray, np.ndarray]] = []
        anew = np.zeros(self.t.size, dtype=bool)
        if result.held is not None:
            tables.append(result.held)
            anew[1:] = (result.held[1][1:] != result.held[1][:-1]).any(axis=1)
        if result.counted is not None and angles is not None:
            tables.append((angles.places, result.counted))
            anew |= angles.jumps(self.t, result.counted)
        for first, last in pairwise([0, *(1 + np.flatnonzero(anew[1:])).tolist(), self.t.size]):
            if last == first:
                continue
            for cells, values in tables:
                evaluator.rdata[cells] = values[first]
            epochs = [(max(row - first, 0), table) for row, table in result.epochs if row < last]
            own = [k for k, (row, _) in enumerate(epochs) if row == 0]
            part = outputs.Records(*(column[first:last] for column in records))
            evaluator.fill(self.t[first:last], result.y[first:last], epochs[own[-1] :], part)

    def over(
        self,
        t: np.ndarray,
        y: np.ndarray,
        epochs: list[tuple[int, np.ndarray]],
        held: np.ndarray | None = None,
        counted: np.ndarray | None = None,
    ) -> Solution:
        """Return a solution of the same equations over other times, with unknowns ``y`` and their ``epochs``.

        ``held`` and ``counted`` are what stands in the places of those of the result, a row for each time.
        """
        part = copy.copy(self)
        for name in ("_records", "kinetic_energy"):
            part.__dict__.pop(name, None)
        part.t = t
        part.at_steps = MappingProxyType({})
        kept = None if held is None or self.result.held is None else (self.result.held[0], held)
        part.result = replace(
            self.result, t=t, y=y, yp=np.empty((0, y.shape[1])), epochs=epochs, held=kept, counted=counted
        )
        return part

    def __copy__(self) -> Solution:
        made = type(self).__new__(type(self))
        made.__dict__.update(self.__dict__)
        return made

    def __deepcopy__(self, memo: dict[int, Any]) -> Solution:
        """Return a copy with numbers of its own; the model behind them, which it does not change, is the same."""
        made = copy.copy(self)
        memo[id(self)] = made
        made.at_steps = MappingProxyType({key: copy.deepcopy(value, memo) for key, value in self.at_steps.items()})
        made._shared = None
        for name in ("t", "result", "_records", "kinetic_energy"):
            if name in self.__dict__:
                made.__dict__[name] = copy.deepcopy(self.__dict__[name], memo)
        return made

    def __reduce__(self) -> tuple:
        raise ModelError(
            "a solution is not pickled: compiled equations are part of it; pass on its to_dataset(), write it with "
            "gearmbs.save(solution, 'run.nc'), or go on from its state_at(t), which can be saved"
        )

    def _evaluator(self) -> Fills:
        problem = self.problem
        if self.members is not None and len(self.members.turn):
            from gearmbs.dae.model.fixed_axes import AxisEvaluator

            return AxisEvaluator(problem, self.members)
        if self.members is not None:
            from gearmbs.dae.model.members import MemberEvaluator

            return MemberEvaluator(problem, self.members)
        return outputs.Evaluator(problem)

    def _new_records(self, m: int) -> outputs.Records:
        system = self.system
        diagnostics = max((len(d) for d in system.model.diagnostics), default=0)
        names, modes = system.model.names, sum(system.model.modes)
        return outputs.new_records(m, len(names.bodies), len(names.rows), len(names.forces), diagnostics, modes)

    @property
    def evaluated(self) -> Evaluated:
        """The output times, the model and all that was evaluated."""
        return Evaluated(self.t, self.system.model, self._records)

    @property
    def _pose(self) -> np.ndarray:
        poses, bodies = self._records.pose, len(self.system.model.names.bodies)
        return poses[:, : POSE_COLUMNS * bodies].reshape(len(poses), bodies, POSE_COLUMNS)

    @property
    def _acc(self) -> np.ndarray:
        return self._records.accelerations

    @property
    def _lam(self) -> np.ndarray:
        return self._records.multipliers

    @property
    def _loads(self) -> np.ndarray:
        return self._records.loads

    def parts(self, rows: np.ndarray | None = None, *, size: int = PART_SIZE) -> Iterator[Solution]:
        """Yield the solution piece by piece, for what is wanted of a long one to be collected in little memory.

        Forces and accelerations are evaluated for each part in turn, which is also faster than for all at once.

        Parameters
        ----------
        rows : ndarray of int, optional
            Increasing numbers of the output times wanted, the first ones included if angles are counted; default all.
        size : int
            Most output times in a part.

        Yields
        ------
        Solution
            Valid until the next one is asked for: they share their memory.
        """
        rows = np.arange(self.t.size) if rows is None else np.asarray(rows)
        known = self.__dict__.get("_records")
        evaluator: Fills | None = None
        room: outputs.Records | None = None
        if known is None:
            most = min(size, rows.size)
            if self._shared is not None and most <= self._shared.size:
                evaluator, room = self._shared.evaluator, self._shared.room
            else:
                evaluator, room = self._evaluator(), self._new_records(most)
        for k in range(0, rows.size, size):
            wanted = rows[k : k + size]
            places = [int(np.searchsorted(wanted, row)) for row, _ in self.result.epochs]
            epochs = [(place, table) for place, (_, table) in zip(places, self.result.epochs)]
            held = None if self.result.held is None else self.result.held[1][wanted]
            counted = None if self.result.counted is None else self.result.counted[wanted]
            part = self.over(self.t[wanted], self.result.y[wanted], epochs, held, counted)
            if len(self.result.yp):
                part.result.yp = self.result.yp[wanted]
            if evaluator is not None and room is not None:
                part._records = room.first(wanted.size)
                part._fill(evaluator, part._records)
            elif known is not None:
                part._records = outputs.Records(*(column[wanted] for column in known))
            yield part

    def find_conflict(self, rows: np.ndarray) -> str | None:
        """Return what is wrong if a row removed as redundant is violated at one of the output times ``rows``."""
        if rows.size == 0 or not self.system.has_dropped_rows:
            return None
        for part in self.parts(rows, size=1):
            found = self.system.conflict(part._configuration(0), float(part.t[0]))
            if found is not None:
                return f"at t = {part.t[0]:.6g} s: {found}"
        return None

    def note_conflict(self, found: str | None) -> None:
        """Let the run count as failed for a conflict found elsewhere than at its own output times."""
        self._conflict = self._conflict or found

    def share(self, size: int) -> None:
        """Let solutions made by `over` use one evaluator and, up to ``size`` output times, the memory of each other.

        They are to be asked in the order of time then.
        """
        # of a copy: the solution would hold itself otherwise
        alone = copy.copy(self)
        self._shared = Shared(alone._evaluator, alone._new_records, size)

    # --- access by name -----------------------------------------------------------------------------

    def input(self, name: str) -> np.ndarray:
        """Return an input or a parameter by its name, SI, shape (m,): up to each output time, where it may jump.

        Raises
        ------
        KeyError
            For a name that is not there.
        """
        numbers, aliases = self.problem.numbers, self.problem.aliases
        number = numbers.get(aliases.get(name, name))
        if number is None:
            raise KeyError(f"input {name!r}; there are {', '.join([*aliases, *numbers]) or 'none'}")
        table = self.problem.rdata.copy()
        if self.result.held is None:
            return np.array([number.value(table, float(t)) for t in self.t])
        found = np.empty(self.t.size)
        cells, values = self.result.held
        for k, t in enumerate(self.t.tolist()):
            table[cells] = values[k]
            found[k] = number.value(table, t)
        return found

    def _body(self, body) -> int:
        """Return the number of a body, given as such or by its name."""
        names, name = self.system.model.names.bodies, getattr(body, "name", body)
        try:
            return names.index(name)
        except ValueError:
            raise KeyError(f"body {name!r}; the bodies are {', '.join(names)}") from None

    def com_position(self, body: str) -> np.ndarray:
        """Return the position of the centre of mass over time, shape (m, 3), m, global.

        The origin of the body's own frame, which is what ``position=`` of ``Mechanism.body`` gives, is
        ``marker_position(body)``.
        """
        return self._pose[:, self._body(body), POSE_R:POSE_A]

    def orientation(self, body: str) -> np.ndarray:
        """Return the rotation matrices over time, shape (m, 3, 3)."""
        if ("orientation", body) in self.at_steps:
            return self.at_steps["orientation", body]
        return self._pose[:, self._body(body), POSE_A:POSE_V].reshape(-1, 3, 3)

    def com_velocity(self, body: str) -> np.ndarray:
        """Return the velocity of the centre of mass, shape (m, 3), m/s, global."""
        return self._pose[:, self._body(body), POSE_V:POSE_W]

    def angular_velocity(self, body: str) -> np.ndarray:
        """Return the angular velocity, global components, shape (m, 3), rad/s."""
        if ("angular_velocity", body) in self.at_steps:
            return self.at_steps["angular_velocity", body]
        return self._pose[:, self._body(body), POSE_W:POSE_COLUMNS]

    def com_acceleration(self, body: str) -> np.ndarray:
        """Return the acceleration of the centre of mass, shape (m, 3), m/s^2, global."""
        return self._acc[:, self._body(body), 0:3]

    def angular_acceleration(self, body: str) -> np.ndarray:
        """Return the angular acceleration, global components, shape (m, 3), rad/s^2."""
        return self._acc[:, self._body(body), 3:6]

    position = former_name(
        "position",
        com_position,
        "it is the centre of mass; write com_position, or marker_position for the body's frame",
    )
    velocity = former_name("velocity", com_velocity, "write com_velocity, or marker_velocity for the body's frame")
    acceleration = former_name("acceleration", com_acceleration, "write com_acceleration")

    def reaction(self, joint: str) -> tuple[np.ndarray, np.ndarray]:
        """Return force (N) and moment about marker I's origin (N m) of a joint on I's body, each (m, 3), global.

        I of a general constraint is the first marker that its expression names.
        """
        return self.reaction_force(joint), _sum_of_rows(self._records.moment, self._rows_of_joint(joint))

    def reaction_force(self, joint: str) -> np.ndarray:
        """Return the force of a joint on I's body, shape (m, 3), N, global, without its moment."""
        if ("reaction_force", joint) in self.at_steps:
            return self.at_steps["reaction_force", joint]
        return _sum_of_rows(self._records.force, self._rows_of_joint(joint))

    def _rows_of_joint(self, joint: str) -> list[int]:
        """Return the numbers of the constraint rows of a joint, given as such or by its name."""
        joint = getattr(joint, "name", joint)
        rows = self.system.model.rows_of_joint.get(joint)
        if rows is None:
            known = sorted(self.system.model.rows_of_joint)
            aside = self.system.report.redundant if self.system.report is not None else []
            if any(name.rsplit(": ", 1)[0] == joint for name in aside):
                raise KeyError(
                    f"joint {joint!r} was removed as redundant, so its share of the load is not determined: "
                    f"{', '.join(known)} carry all of it"
                )
            raise KeyError(f"joint {joint!r}; the joints are {', '.join(known) or 'none in this mechanism'}")
        return rows

    def load(self, element: str) -> tuple[np.ndarray, np.ndarray]:
        """Return force F (N) and torque N (N m) of a force element on I's body at marker I, each (m, 3), global."""
        k = self._element(element)
        return self._loads[:, k, 0:3], self._loads[:, k, 3:6]

    def diagnostics(self, element: str) -> dict[str, np.ndarray]:
        """Return what a force element tells beside its wrench, over time, by name; units are in :meth:`to_dataset`."""
        if ("diagnostics", element) in self.at_steps:
            return self.at_steps["diagnostics", element]
        k = self._element(element)
        return {d.name: self._loads[:, k, 6 + c] for c, d in enumerate(self.system.model.diagnostics[k])}

    def contact(self, element: str) -> dict[str, np.ndarray]:
        """Return the diagnostics of a contact, as :meth:`diagnostics`."""
        return self.diagnostics(element)

    def modal_coordinates(self, body: str) -> np.ndarray:
        """Return the modal coordinates of a body over time, shape (m, modes)."""
        return self.modal_motion(body)[0]

    def modal_velocities(self, body: str) -> np.ndarray:
        """Return the rates of the modal coordinates of a body over time, shape (m, modes), 1/s."""
        return self.modal_motion(body)[1]

    def modal_motion(self, body: str) -> np.ndarray:
        """Return the modal coordinates of a body, their rates (1/s) and accelerations (1/s^2), shape (3, m, modes)."""
        model, number = self.system.model, self._body(body) + 1
        if not model.modes[number]:
            raise KeyError(f"body {body!r} is rigid: it has no modal coordinates")
        return self.evaluated.modal(number)

    def _element(self, name: str) -> int:
        names = self.system.model.names.forces
        try:
            return names.index(name)
        except ValueError:
            known = ", ".join(names) or "none in this mechanism"
            raise KeyError(f"force element {name!r}; the force elements are {known}") from None

    def state_at(self, t: float) -> State:
        """Return the state at a time, s, to start another run from; it has no history of the integrator.

        Inputs and parameters are those up to that time, as `input` tells them; one on a line is held from there on.

        Parameters
        ----------
        t : float
            An output time, with ``dense_output`` any time of the run, or that of ``result.kept``.

        Raises
        ------
        ModelError
            For other times, for a solution without rates, and where turns cannot be told from the outputs.
        """
        from gearmbs.dae.results.frames import state_at

        try:
            instant = to_si(t, "time", "state_at: t")
        except (TypeError, ValueError) as error:
            raise ModelError(str(error)) from None
        return state_at(self, instant)

    @property
    def multipliers(self) -> np.ndarray:
        """Lagrange multipliers of the constraint rows, shape (m, rows)."""
        return self._lam

    @property
    def constraint_violation(self) -> np.ndarray:
        """Largest |Phi| of the integrator's solution over the rows at each output time, shape (m,), m or 1.

        Positions and all that follows from them are projected onto the constraints afterwards, to rounding.
        """
        return self._records.strayed

    # --- energy -------------------------------------------------------------------------------------

    @cached_property
    def kinetic_energy(self) -> np.ndarray:
        """Kinetic energy, shape (m,), J."""
        from gearmbs.dae.results.energy import kinetic_energy

        return kinetic_energy(self.evaluated)

    def energy_balance(self) -> xr.Dataset:
        """Return energies, works, dissipation and their imbalance; see `gearmbs.dae.results.energy.energy_balance`."""
        from gearmbs.dae.results.energy import energy_balance

        elements = getattr(getattr(self.system, "mechanism", None), "elements", {})
        frictions = [
            k for k, name in enumerate(self.system.force_names) if getattr(elements.get(name), "kind", "") == "friction"
        ]
        return energy_balance(self.evaluated, frictions)

    def __len__(self) -> int:
        return self.t.size

    def __repr__(self) -> str:
        name = getattr(getattr(self.system, "mechanism", None), "name", "mechanism")
        return (
            f"Solution({name!r}: {self.t.size} times from {self.t[0]:g} to {self.t[-1]:g} s, "
            f"{self.status.name}; {self.stats})" + (f"\n{self.remark}" if self.remark else "")
        )

    @waiting("gathering results")
    def to_dataset(self) -> xr.Dataset:
        """Return everything as an :class:`xarray.Dataset` with units in the attributes."""
        from gearmbs.dae.results.dataset import dataset

        return dataset(self)
