"""Outputs of an exported model: names for numbers among the unknowns and records of an instant, or sums of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import FORCE_RECORD
from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.equations.expressions.tape import Tape
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.dae.model.model import Names
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.kernels.bound import NAMES
from gearmbs.mechanism.compile import scope_of
from gearmbs.mechanism.language.library import compile_expression
from gearmbs.native.teller import FORCE, LOADS, MOMENT, NUMBER, POSE, SOLUTION, UNKNOWN

AXES = ("x", "y", "z")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
OF_BODY = {
    "com_position": (POSE, POSE_R, "m"),
    "com_velocity": (POSE, POSE_V, "m/s"),
    "angular_velocity": (POSE, POSE_W, "rad/s"),
    "com_acceleration": (SOLUTION, 0, "m/s^2"),
    "angular_acceleration": (SOLUTION, 3, "rad/s^2"),
}
"""Quantities of bodies with three components: the record, the first place in that of a body, and the unit."""


class Told(NamedTuple):
    """An output.

    Attributes
    ----------
    name, unit : str
    places : tuple of (int, int)
        Records, and places in them, of the numbers that add up to it.
    tape : Tape, optional
        An expression instead of a sum.
    entries : tuple of tuple of (int, int)
        Of each unknown of the expression the numbers that add up to it.
    """

    name: str
    unit: str
    places: tuple[tuple[int, int], ...]
    tape: Tape | None = None
    entries: tuple[tuple[tuple[int, int], ...], ...] = ()


class Finder:
    """Finds where quantities of a solution stand in the records of an instant.

    Parameters
    ----------
    system : System
    problem : DAEProblem
    numbers : sequence of str
        What can be set.
    """

    def __init__(self, system: Any, problem: DAEProblem, numbers: Sequence[str]) -> None:
        self.model, self.problem, self.states = system.model, problem, list(system.state_names)
        self.mechanism, self.numbers = system.mechanism, list(numbers)
        self.most = max((len(d) for d in self.model.diagnostics), default=0)

    @property
    def columns(self) -> int:
        """Length of the record of an element's load."""
        return FORCE_RECORD + self.most

    def find(self, name: str, asked: Sequence[Any]) -> Told:
        """Return an output by what `Mechanism.output` takes: a quantity of a solution, what it is of, its component.

        Raises
        ------
        ModelError
            For one that is not among the numbers of an instant.
        """
        what, *rest = asked
        try:
            if what in OF_BODY:
                record, first, unit = OF_BODY[what]
                body, component = rest
                width = POSE_COLUMNS if record == POSE else 6
                place = self._index(self.model.names.bodies, body, "body") * width + first
                return Told(name, unit, ((record, place + _component(AXES, component)),))
            if what == "orientation":
                body, row, column = rest
                place = self._index(self.model.names.bodies, body, "body") * POSE_COLUMNS + POSE_A
                return Told(name, "1", ((POSE, place + 3 * int(row) + int(column)),))
            if what == "reaction":
                joint, component = rest
                return self._reaction(name, joint, _component(WRENCH, component))
            if what == "reaction_force":
                joint, component = rest
                return self._reaction(name, joint, _component(AXES, component))
            if what == "load":
                element, component = rest
                k, c = self._index(self.model.names.forces, element, "force element"), _component(WRENCH, component)
                return Told(name, "N" if c < 3 else "N m", ((LOADS, k * self.columns + c),))
            if what in ("diagnostics", "contact"):
                element, quantity = rest
                k = self._index(self.model.names.forces, element, "force element")
                told = self.model.diagnostics[k]
                c = self._index([d.name for d in told], quantity, f"diagnostic of {element}")
                return Told(name, told[c].unit, ((LOADS, k * self.columns + FORCE_RECORD + c),))
            if what == "state":
                (state,) = rest
                return Told(name, "1", ((UNKNOWN, int(self.problem.idata[T.H_Z]) + self.states.index(state)),))
        except (ValueError, TypeError) as error:
            raise ModelError(f"output {name!r}: {tuple(asked)!r} cannot be told: {error}") from None
        known = ", ".join([*OF_BODY, "orientation", "reaction", "reaction_force", "load", "diagnostics", "state"])
        raise ModelError(f"output {name!r}: a library does not tell {what!r}; it tells {known}")

    def evaluate(self, name: str, text: str) -> Told:
        """Return an output that is an expression; refused as `find` does."""
        scope, _, _ = scope_of(self.mechanism)
        try:
            tape = compile_expression(text, scope, accelerations=True)
            entries = tuple(self._unknown(name, key) for key in tape.algebraic)
        except (ExpressionError, ValueError) as error:
            raise ModelError(f"output {name!r}: {text!r} cannot be told: {error}") from None
        held = [
            *(["angles that are counted"] if tape.n_angles else []),
            *(["frames of bodies that deform"] if max(tape.bodies, default=0) > len(self.model.names.bodies) else []),
            *(["functions of Python"] if np.isin(tape.ints, np.fromiter(NAMES, dtype=np.int64)).any() else []),
        ]
        if held:
            raise ModelError(f"output {name!r}: a library does not tell {text!r}: it depends on {', '.join(held)}")
        return Told(name, "", (), tape.bind(tape.algebraic.index), entries)

    def _unknown(self, name: str, key: tuple) -> tuple[tuple[int, int], ...]:
        """Return the numbers that add up to an unknown of an expression, see `gearmbs.mechanism.solve.measures`."""
        kind, ref, *rest = key
        if kind in ("diff", "variable"):
            known = {state.upper(): state for state in self.states}
            return self.find(name, ("state", known[str(ref).upper()])).places
        if kind == "number":
            return ((NUMBER, self.numbers.index(str(ref))),)
        of_joint = kind in ("joint", "jprim", "motion", "coupler", "gear", "gcon")
        owners = self.model.rows_of_joint if of_joint or kind in ("mode", "mode1") else self.model.names.forces
        known = {owner.upper(): owner for owner in owners}
        if kind in ("mode", "mode1") or str(ref).upper() not in known:
            raise ValueError(f"it depends on {kind} {ref}")
        what = "reaction" if of_joint else "load"
        return self.find(name, (what, known[str(ref).upper()], WRENCH[int(rest[0])])).places

    def _reaction(self, name: str, joint: str, c: int) -> Told:
        rows = self.model.rows_of_joint.get(joint)
        if rows is None:
            raise ModelError(f"output {name!r}: joint {joint!r}; the joints are {', '.join(self.model.rows_of_joint)}")
        record, unit = (FORCE, "N") if c < 3 else (MOMENT, "N m")
        return Told(name, unit, tuple((record, 3 * row + c % 3) for row in rows))

    @staticmethod
    def _index(names: Sequence[str], name: str, what: str) -> int:
        if name not in names:
            raise ValueError(f"there is no {what} {name!r}; there are {', '.join(names) or 'none'}")
        return list(names).index(name)

    def everything(self) -> list[Told]:
        """Return motions of all bodies, loads and diagnostics of all elements, reactions of all joints, all states."""
        names = self.model.names
        asked: list[tuple[str, ...]] = []
        for body in names.bodies:
            asked += [(what, body, axis) for what in OF_BODY for axis in AXES]
        for k, element in enumerate(names.forces):
            asked += [("load", element, component) for component in WRENCH]
            asked += [("diagnostics", element, d.name) for d in self.model.diagnostics[k]]
        for joint in self.model.rows_of_joint:
            asked += [("reaction", joint, component) for component in WRENCH]
        asked += [("state", state) for state in self.states]
        return [self.find(f"{of}.{'.'.join((what, *rest))}", (what, of, *rest)) for what, of, *rest in asked]


def _component(names: Sequence[str], component: Any) -> int:
    if component not in names:
        raise ValueError(f"there is no component {component!r}; there are {', '.join(names)}")
    return list(names).index(component)


def chosen_outputs(
    system: Any, problem: DAEProblem, numbers: Sequence[str], outputs: Sequence[Any] | None
) -> tuple[list[Told], list[str]]:
    """Return the outputs of an export, and the names of those of the mechanism that are left out.

    Parameters
    ----------
    system, problem, numbers
        As of `Finder`.
    outputs : sequence, optional
        Names of outputs of the mechanism, and quantities as `Mechanism.output` takes them. Default: all outputs of the
        mechanism that can be told, or everything if it has none.

    Raises
    ------
    ModelError
        For one that is asked for and cannot be told.
    """
    finder, named, left = Finder(system, problem, numbers), system.mechanism.outputs, []
    if outputs is None and not named:
        return finder.everything(), []
    for name in named if outputs is None else outputs:
        if isinstance(name, str) and name in named:
            # sensors make their markers, which all expressions count along with theirs
            _ = named[name].text
    if outputs is not None:
        return [_asked(finder, named, item) for item in outputs], []
    found = []
    for name in named:
        try:
            found.append(_asked(finder, named, name))
        except ModelError:
            left.append(name)
    return found, left


def _asked(finder: Finder, named: Any, item: Any) -> Told:
    if not isinstance(item, str) and item[0] == "evaluate":
        return finder.evaluate(str(item[1]), str(item[1]))
    if not isinstance(item, str):
        return finder.find(".".join(map(str, item)), item)
    if item not in named:
        raise ModelError(f"output {item!r}; the outputs are {', '.join(named) or 'none'}")
    made = named[item]
    if made.text is not None:
        return finder.evaluate(item, made.text)
    return finder.find(item, made.what)


class Expressions(NamedTuple):
    """The expressions among the outputs of a model, one after the other, and what they look at.

    Attributes
    ----------
    ints, floats : ndarray
        Tables of all tapes.
    bounds : ndarray of int64, shape (5 expressions,)
        Of each its output, where its tables begin in both, where its unknowns begin in ``first``, and their number.
    first : ndarray of int64
        Where the numbers that add up to each unknown begin in ``kind`` and ``at``, and where the last ends.
    kind, at : ndarray of int64
        As of `gearmbs.native.teller.Teller`.
    marker_body, marker_frame : ndarray, shapes (markers,) and (markers, 12)
    work, unknowns, frames : int
        Scratch and unknowns that suffice for each; rows of the table of frames.
    """

    ints: np.ndarray
    floats: np.ndarray
    bounds: np.ndarray
    first: np.ndarray
    kind: np.ndarray
    at: np.ndarray
    marker_body: np.ndarray
    marker_frame: np.ndarray
    work: int
    unknowns: int
    frames: int


def expressions_of(system: Any, told: Sequence[Told]) -> Expressions:
    """Return the expressions among some outputs; with markers that they have made."""
    tapes = [(k, one.tape, one.entries) for k, one in enumerate(told) if one.tape is not None]
    bounds: list[int] = []
    places: list[tuple[int, int]] = []
    first, ints, floats = [0], 0, 0
    for k, tape, entries in tapes:
        bounds += [k, ints, floats, len(first) - 1, len(entries)]
        ints, floats = ints + tape.ints.size, floats + tape.floats.size
        for entry in entries:
            places += entry
            first.append(len(places))
    _, builder, _ = scope_of(system.mechanism)
    frames = np.array([np.ravel(m) for m in builder.marker_frame], dtype=float).reshape(-1, 12)
    model = builder.build(Names())
    return Expressions(
        np.concatenate([np.zeros(0, dtype=np.int64), *(tape.ints for _, tape, _ in tapes)]).astype(np.int64),
        np.concatenate([np.zeros(0), *(tape.floats for _, tape, _ in tapes)]),
        np.array(bounds, dtype=np.int64),
        np.array(first, dtype=np.int64),
        np.array([kind for kind, _ in places], dtype=np.int64),
        np.array([at for _, at in places], dtype=np.int64),
        np.array(builder.marker_body, dtype=np.int64),
        frames,
        max((tape.work_size for _, tape, _ in tapes), default=0),
        max((len(entries) for *_, entries in tapes), default=0),
        1 + len(system.model.names.bodies) + len(model.frame_body),
    )
