"""Constraints given by a function of where markers stand: it is traced, and becomes expressions that have to vanish.

The function is called once, with numbers that write down what is done to them (`gearmbs.kernels.derive`). What it says
is written in the function language, whose evaluation gives value, gradient, rates and Hessian of a constraint. So a
law of a constraint has no kernel of its own, and takes part in whatever expressions do.
"""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.kernels import derive
from gearmbs.kernels.derive import Value
from gearmbs.mechanism.language.syntax import Units
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.inputs import Parameter, make_parameter, unit_factor

tracing = threading.Lock()
"""Held while a law of any kind is traced: the graph is one."""
SHARED = 60
"""Characters of a part that is needed twice from which it becomes a variable: shorter ones are written again."""
FUNCTIONS = {
    "sqrt": "SQRT", "sin": "SIN", "cos": "COS", "tan": "TAN", "tanh": "TANH", "exp": "EXP", "log": "LOG",
    "arctan": "ATAN", "arctan2": "ATAN2",
}  # fmt: skip
"""Functions of the language by the operations of `gearmbs.kernels.derive`."""


@dataclass(frozen=True)
class GeneralConstraint:
    """What has to vanish.

    Attributes
    ----------
    rows : mapping of str to str
        Expressions by the labels of their rows.
    about : Marker, optional
        On whose body, and about whose origin, reactions are told; default: of each row the first that it names.
    """

    rows: Mapping[str, str]
    about: Marker | None = None

    def named(self, name: str) -> dict[str, str]:
        """Return its expressions by names of their own: that of the constraint where there is but one."""
        if len(self.rows) == 1:
            return {name: next(iter(self.rows.values()))}
        return {f"{name}: {label}": text for label, text in self.rows.items()}


class Place:
    """Where a marker stands, as the law of a constraint sees it: m and rad.

    Attributes
    ----------
    origin : ndarray, shape (3,)
        Global components.
    axes : ndarray, shape (3, 3)
        Columns are its axes, global components.
    """

    def __init__(self, name: str, leaf: Callable[[str, bool], Value]) -> None:
        self._name, self._leaf = f'"{name}"', leaf

    @property
    def origin(self) -> np.ndarray:
        return np.array([self._leaf(f"D{axis}({self._name})", True) for axis in "XYZ"])

    @property
    def axes(self) -> np.ndarray:
        return np.array([[self._cosine("0", row, column) for column in (1, 2, 3)] for row in (1, 2, 3)])

    def position(self, of: Place) -> np.ndarray:
        """Return its origin seen from another marker, in the axes of that one, shape (3,)."""
        other = self._other("position", of)
        return np.array([self._leaf(f"D{axis}({self._name}, {other}, {other})", True) for axis in "XYZ"])

    def distance(self, of: Place) -> Value:
        """Return how far its origin is from that of another marker; it must not vanish."""
        return self._leaf(f"DM({self._name}, {self._other('distance', of)})", True)

    def orientation(self, of: Place) -> np.ndarray:
        """Return its axes, the columns, in those of another marker, shape (3, 3)."""
        other = self._other("orientation", of)
        return np.array([[self._cosine(other, row, column) for column in (1, 2, 3)] for row in (1, 2, 3)])

    def angle(self, of: Place) -> Value:
        """Return its turn about the z axis of another marker, counted through full turns."""
        return self._leaf(f"AZ({self._name}, {self._other('angle', of)})", False)

    def _cosine(self, other: str, row: int, column: int) -> Value:
        return self._leaf(f"COSINE({self._name}, {column}, {other}, {row})", False)

    def _other(self, what: str, of: Any) -> str:
        if not isinstance(of, Place) or of is self:
            raise TypeError(
                f"{what}() is seen from another marker; give one that the law takes, not {type(of).__name__}"
            )
        return of._name

    def __getattr__(self, name: str) -> NoReturn:
        if name in ("velocity", "angular_velocity"):
            raise AttributeError(f"{name} cannot enter a constraint, which is one of positions and time")
        raise AttributeError(
            f"a marker has no {name}; there are origin, axes, position(j), orientation(j), angle(j) and distance(j)"
        )


def trace_constraint(
    name: str, law: Callable[..., Any], markers: Sequence[Marker], given: Mapping[str, Any], units: Units
) -> tuple[GeneralConstraint, dict[str, Parameter], dict[str, str]]:
    """Return what the law of a constraint demands.

    Parameters
    ----------
    name : str
        Of the constraint, for messages, and for the names of its parameters.
    law : callable
        See :meth:`gearmbs.mechanism.Mechanism.general_constraint`.
    markers : sequence of Marker
    given : mapping of str to float or Parameter
    units : Units
        Of the mechanism, in which expressions are; laws are in SI.

    Returns
    -------
    constraint : GeneralConstraint
    parameters : dict of str to Parameter
        New ones.
    variables : dict of str to str
        What several expressions, or several parts of one, have in common.

    Raises
    ------
    ModelError
        If it cannot be traced, or what it takes and gives does not fit.
    """
    label = f"general constraint '{name}'"
    taken = _parameters_of(label, law, len(markers), given)
    known = {key: _parameter(label, f"{name}.{key}", value) for key, value in taken.items()}
    with tracing:
        derive.start()
        writer = _Writer(name, units)
        try:
            with derive.watched():
                rows = _called(label, law, markers, known, writer)
            texts = writer.texts(rows)
        except RecursionError:
            raise ModelError(
                f"{label}: the law has too many operations in a row, some hundred terms of a sum; add them up in parts"
            ) from None
    new = {one.name: one for key, one in known.items() if one is not taken[key]}
    return GeneralConstraint(texts, markers[0]), new, writer.variables


def _parameters_of(label: str, law: Callable[..., Any], markers: int, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters that a law takes."""
    every = list(inspect.signature(law).parameters.values())
    if len(every) < markers or any(one.name == "t" for one in every[:markers]):
        raise ModelError(
            f"{label}: {markers} markers are given, its law takes ({', '.join(one.name for one in every)}); let it "
            "take each of them, then t and its parameters by name"
        )
    named = [one for one in every[markers:] if one.name != "t"]
    names = [one.name for one in named]
    unknown = next((one for one in given if one not in names), None)
    if unknown is not None:
        raise ModelError(f"{label}: its law has no parameter '{unknown}'; it has {', '.join(names) or 'none'}")
    lacking = next((one.name for one in named if one.name not in given and one.default is one.empty), None)
    if lacking is not None:
        raise ModelError(
            f"{label}: '{lacking}' of its law is missing; give another marker, or parameters={{'{lacking}': ...}}"
        )
    return {one.name: given.get(one.name, one.default) for one in named}


def _parameter(label: str, name: str, value: Any) -> Parameter:
    """Return a parameter of a law: one of the mechanism's, or a new one."""
    if isinstance(value, Parameter):
        return value
    try:
        return make_parameter(name, "dimensionless", value)
    except ModelError as error:
        raise ModelError(f"{label}: {error}; numbers of a law are in SI, without a unit") from None


def _called(
    label: str, law: Callable[..., Any], markers: Sequence[Marker], known: Mapping[str, Parameter], writer: _Writer
) -> dict[str, Value]:
    """Call a law with what is written down; return its rows by their labels."""
    values = {n: writer.leaf(f'"{p.name}"', unit_factor(writer.units, p.unit)) for n, p in known.items()}
    values["t"] = writer.leaf("TIME", writer.units.time)
    names = list(inspect.signature(law).parameters)[len(markers) :]
    try:
        found = law(*(Place(m.name, writer.measured) for m in markers), **{n: values[n] for n in names})
        if isinstance(found, Mapping):
            rows = {str(key): derive.value_of(_number(one)) for key, one in found.items()}
        else:
            several = list(np.asarray(found, dtype=object).ravel())
            labels = ["expression"] if len(several) == 1 else [f"expression {k + 1}" for k in range(len(several))]
            rows = {key: derive.value_of(_number(one)) for key, one in zip(labels, several, strict=True)}
    except RecursionError:
        raise
    except Exception as error:
        raise ModelError(
            f"{label}: its law cannot be traced, {type(error).__name__}: {error}; write it with arithmetic, functions "
            "of numpy and gm.choose, and let it return what has to vanish: a number, several, or a mapping of them"
        ) from error
    if not rows:
        raise ModelError(f"{label}: its law returns nothing; let it return what has to vanish")
    return rows


def _number(one: Any) -> Any:
    return one.item() if isinstance(one, np.ndarray) else one


class _Writer:
    """Writes traced numbers as expressions.

    Parameters
    ----------
    name : str
        Before the names of variables.
    units : Units
    """

    def __init__(self, name: str, units: Units) -> None:
        self.name, self.units = name, units
        self.variables: dict[str, str] = {}
        self._leaves: dict[str, Value] = {}
        self._texts: dict[Value, str] = {}
        self._uses: dict[Value, int] = {}
        self._measures: set[str] = set()

    def leaf(self, text: str, factor: float) -> Value:
        """Return the number that a text stands for, times a factor."""
        if text not in self._leaves:
            (self._leaves[text],) = derive.inputs(f"leaf{len(self._leaves)}")
        return factor * self._leaves[text]

    def measured(self, text: str, is_length: bool) -> Value:
        """Return a measure of markers in SI."""
        self._measures.add(text)
        return self.leaf(text, self.units.length if is_length else 1.0)

    def texts(self, rows: Mapping[str, Value]) -> dict[str, str]:
        """Return expressions of several numbers by their labels.

        Raises
        ------
        ModelError
            For one that no motion changes, and for numbers that are infinite.
        """
        self._texts = {value: text for text, value in self._leaves.items()}
        moving = {self._leaves[text] for text in self._measures}
        for label, row in rows.items():
            self._count(row)
            if not self._reaches(row, moving):
                raise ModelError(
                    f"general constraint '{self.name}': {label} does not depend on where the markers are; no motion "
                    "can make it vanish, leave it out"
                )
        return {label: self._told(row) for label, row in rows.items()}

    def _reaches(self, value: Value, ends: set[Value]) -> bool:
        todo, seen = [value], set[Value]()
        while todo:
            one = todo.pop()
            if one in ends:
                return True
            if one not in seen:
                seen.add(one)
                todo.extend(_operands(one))
        return False

    def _count(self, value: Value) -> None:
        self._uses[value] = self._uses.get(value, 0) + 1
        if self._uses[value] == 1:
            for operand in _operands(value):
                self._count(operand)

    def _told(self, value: Value) -> str:
        if value not in self._texts:
            text = self._written(value)
            if self._uses[value] > 1 and len(text) > SHARED:
                name = f"{self.name}.part {len(self.variables) + 1}"
                self.variables[name] = text
                text = f'VARVAL("{name}")'
            self._texts[value] = text
        return self._texts[value]

    def _written(self, value: Value) -> str:
        kind = value.operation
        if kind == "number":
            number = float(value.operands[0])
            if not np.isfinite(number):
                raise ModelError(f"general constraint '{self.name}': a number of its law is {number}; leave it out")
            return f"({number!r})" if number < 0.0 else repr(number)
        parts = [self._told(operand) for operand in _operands(value)]
        if kind in ("+", "-", "*"):
            return f"({parts[0]} {kind} {parts[1]})"
        if kind in ("**", "power"):
            return f"({parts[0]})**({parts[1]})"
        if kind == "-x":
            return f"(-{parts[0]})"
        if kind == "1/x":
            return f"(1.0/{parts[0]})"
        if kind == "norm":
            return f"SQRT({' + '.join(f'{p}*{p}' for p in parts)})"
        if kind == "choose":
            a, b, x, y = parts
            return f"IF({a} - {b}: {y}, {y}, {x})"
        return f"{FUNCTIONS[kind]}({', '.join(parts)})"


def _operands(value: Value) -> tuple[Value, ...]:
    """Return the numbers that an expression of a value is made of: of a power its base and its exponent."""
    if value.operation in ("number", "given"):
        return ()
    return (value.operands[0], value.operands[2]) if value.operation == "power" else value.operands


class ConstraintMethods:
    """The part of :class:`gearmbs.mechanism.Mechanism` that adds constraints by expressions."""

    ground: Body
    bodies: dict[str, Body]
    constraints: dict[str, GeneralConstraint]
    parameters: dict[str, Parameter]
    variables: dict[Any, str]
    units: Units
    _check_name: Callable[[str], None]
    _check_body: Callable[[str, Body], None]
    _check_number: Callable[[str, str], None]

    def general_constraint(
        self,
        name: str,
        expression: str | Callable[..., Any],
        *markers: Marker,
        parameters: Mapping[str, float | Parameter] | None = None,
    ) -> None:
        """Demand that an expression or a function of positions and time vanishes (ADAMS's GCON).

        `Solution.reaction` tells what it exerts on the body of the first marker, that the expression names or that is
        given, about its origin. Derivatives of motions and reactions by the parameters in it are exact.

        Parameters
        ----------
        name : str
        expression : str or callable
            In the function language, of displacements of markers, angles, parameters, functions and TIME, in the
            mechanism's units. Or a law, ``law(i, j, ...)``, which takes markers, then by name ``t`` and parameters,
            defaults allowed, and returns what has to vanish, in SI: a number, several, or a mapping from labels. Of
            markers it sees ``i.origin`` and ``i.axes`` in global components, ``i.position(j)`` and
            ``i.orientation(j)`` in the axes of j, ``i.angle(j)`` about z of j, with full turns, and ``i.distance(j)``.
            It is written as :func:`gearmbs.force_law` says.
        *markers : Marker
            Of a law.
        parameters : mapping of str to float or Parameter, optional
            Of a law, SI; they become parameters of the mechanism, ``name.parameter``, unless they are some.

        Raises
        ------
        ModelError
            For a name that is in use, and a law that cannot be traced or does not fit what is given; when the mechanism
            is compiled for an expression that cannot be read, or that asks for velocities, forces or states.

        Examples
        --------
        >>> from gearmbs.mechanism import Mechanism
        >>> m = Mechanism("bead")
        >>> bead = m.body("bead", mass=2.0, inertia=(1e-3, 1e-3, 1e-3), position=(0.3, 0, 0), velocity=(0, 1, 0))
        >>> place, centre = bead.marker(name="I"), m.ground.marker(name="G")
        >>> def hoop(i, g, radius):
        ...     x, y, z = i.position(g)
        ...     return x**2 + y**2 - radius**2
        >>> m.general_constraint("hoop", hoop, place, centre, parameters={"radius": 0.3})
        >>> print(m.simulate(0.1).reaction("hoop")[0][0].round(2) + 0.0)
        [-6.67  0.    0.  ]
        >>> m.general_constraint("plane", "DZ(I,G)")
        """
        self._check_name(name)
        if callable(expression):
            self._check_law_markers(f"general constraint '{name}'", markers)
            made, new, variables = trace_constraint(name, expression, markers, parameters or {}, self.units)
            for parameter in new.values():
                self._check_number(parameter.name, "parameter")
            self.parameters |= new
            self.variables |= variables
            self.constraints[name] = made
            return
        if markers or parameters:
            raise ModelError(
                f"general constraint '{name}': markers and parameters are given to a law; an expression names them"
            )
        self.constraints[name] = GeneralConstraint({"expression": str(expression)})

    def _check_law_markers(self, label: str, markers: Sequence[Marker]) -> None:
        """Refuse markers that a law of a constraint cannot be about: its expressions know them by their names."""
        for marker in markers:
            if not isinstance(marker, Marker):
                raise ModelError(f"{label}: {marker!r} is not a marker; make one with body.marker(...)")
            self._check_body(label, marker.body)
        if len({id(marker.body) for marker in markers}) < 2:
            raise ModelError(
                f"{label}: its law is about markers of two bodies or more; give them, the ground's included"
            )
        every = [marker.name.upper() for body in (self.ground, *self.bodies.values()) for marker in body.markers]
        for marker in markers:
            if every.count(marker.name.upper()) > 1 or '"' in marker.name:
                raise ModelError(
                    f"{label}: marker {marker.name!r}: another one has the name, in capitals or not, or it has a "
                    "quotation mark in it; give it a name of its own"
                )
