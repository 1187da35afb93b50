"""Inputs and parameters of a mechanism: numbers with a name that are set from outside."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.equations.loads import time_functions as tf
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.language.syntax import DIMENSIONS as LANGUAGE
from gearmbs.mechanism.language.syntax import Name, Units, parse
from gearmbs.mechanism.parts.functions import TimeFunction, function_text
from gearmbs.mechanism.parts.quantities import NoNumber, quantity
from gearmbs.units import DIMENSIONS, beyond_mechanics, powers_of

COEFFICIENTS = tf.PIECE_SIZE - 1
"""Number of coefficients of the polynomial that an input is as a function of time."""
RESERVED = ("TIME", "PI", "DTOR", "RTOD")
"""Names that mean something else in expressions."""


@dataclass(frozen=True)
class Input(NoNumber, TimeFunction):
    """A function of time whose value is set from outside, see `gearmbs.mechanism.Mechanism.input`.

    Attributes
    ----------
    name : str
    unit : str
        Of SI.
    order : int
        How often it is integrated: 1 as the speed of a motion, 2 as its acceleration.
    """

    name: str = ""
    unit: str = ""
    order: int = 0

    @property
    def start(self) -> float:
        """Value until it is set; integrated n times it stands before t^n / n!."""
        return float(self.parameters[2 + self.order]) * math.factorial(self.order)

    def integral(self, start: float, rate: float | None = None) -> Input:
        """Return start + int u, or with a rate start + rate t + int int u, from time 0."""
        known = (start,) if rate is None else (start, rate)
        value = self.start / (2.0 if rate is not None else 1.0)
        return replace(self, parameters=_piece((*known, value)), order=len(known))

    def check_unit(self, unit: str, field: str) -> None:
        """Raise a ModelError if it is no function of a unit or dimension."""
        _check_unit(self, "input", unit, field)

    def __repr__(self) -> str:
        return f"Input({self.name!r}, {self.start:g} {self.unit})"


@dataclass(frozen=True)
class Parameter(NoNumber):
    """A number with a name that expressions use, see `gearmbs.mechanism.Mechanism.parameter`."""

    name: str
    unit: str
    start: float
    """Value until it is set."""


def _check_unit(made: Input | Parameter, kind: str, unit: str, field: str) -> None:
    own, wanted = powers_of(made.unit), powers_of(unit)
    if (own and own[1]) != (wanted and wanted[1]):
        raise ModelError(f"{field}: {kind} {made.name!r} is in {made.unit}, not in {DIMENSIONS.get(unit, unit)}")


AXES = ("x", "y", "z")
WRENCHES = ("fx", "fy", "fz", "tx", "ty", "tz")


@dataclass(frozen=True)
class Output:
    """A name for something that a solution tells, see `gearmbs.mechanism.Mechanism.output`.

    Attributes
    ----------
    name : str
    what : str, tuple or callable
        An expression, or a method of solutions, what it is asked for, and a component; or what returns an expression
        when it is first asked for, and makes the markers in it.
    """

    name: str
    what: str | tuple[Any, ...] | Callable[[], str]

    @property
    def asked(self) -> tuple[Any, ...]:
        """Method of solutions, and what it is asked for."""
        if (text := self.text) is not None:
            return ("evaluate", text)
        assert isinstance(self.what, tuple)
        return self.what if self.component is None else self.what[:-1]

    @property
    def text(self) -> str | None:
        """The expression, if it is one."""
        made = self.what() if callable(self.what) else self.what
        return made if isinstance(made, str) else None

    @property
    def component(self) -> str | None:
        """Component of it that is asked for, None for all."""
        if callable(self.what) or isinstance(self.what, str):
            return None
        last = self.what[-1]
        return last if len(self.what) > 2 and last in AXES + WRENCHES else None

    def of(self, measured: Any) -> Any:
        """Return the component of what was measured, over time or at an instant.

        Raises
        ------
        ModelError
            If it has none of this name.
        """
        name = self.component
        if name is None:
            return measured
        pair, single = isinstance(measured, tuple), isinstance(measured, np.ndarray) and measured.shape[-1:] == (3,)
        if pair and name in WRENCHES:
            place = WRENCHES.index(name)
            return measured[place // 3][..., place % 3]
        if single and name in AXES:
            return measured[..., AXES.index(name)]
        known = ", ".join(WRENCHES if pair else AXES) if pair or single else "no components"
        raise ModelError(f"output {self.name!r}: {self.asked[0]} has no component {name!r}; it has {known}")

    def __repr__(self) -> str:
        return f"Output({self.name!r}, {'a sensor' if callable(self.what) else repr(self.what)})"


_FACTOR = r"\d*\.?\d+(?:[eE][-+]?\d+)?"


def is_multiple(text: str, name: str) -> bool:
    """Return whether an expression is plainly a constant times a number of the model, "2*load" or "-load".

    Of other forms nothing is said: they may be multiples, too.

    Examples
    --------
    >>> is_multiple("-0.5 * load", "load"), is_multiple("load*load", "load")
    (True, False)
    """
    form = rf"\(*[-+]?(?:{_FACTOR}\*)?{re.escape(name)}(?:[*/]{_FACTOR})?\)*"
    return re.fullmatch(form, text.replace(" ", ""), re.IGNORECASE) is not None


def make_output(name: str, what: Any) -> Output:
    """Return an output.

    Raises
    ------
    ModelError
        For a name that means something else, and what is neither an expression nor a sequence that begins with a text.
    """
    checked_name(name, "output")
    if isinstance(what, str):
        try:
            parse(what)
        except ExpressionError as error:
            raise ModelError(f"output '{name}': {error}") from None
        return Output(name, what)
    if not isinstance(what, Sequence) or not what or not isinstance(what[0], str):
        raise ModelError(
            f"output '{name}': {what!r} is no output; give an expression or ('angular_velocity', 'disc', 'z')"
        )
    return Output(name, tuple(getattr(part, "name", part) for part in what))


def make_input(name: str, unit: str, value: Any = 0.0) -> Input:
    """Return an input for a part that becomes one of a mechanism later, as a load of a drivetrain.

    For what its arguments are see `gearmbs.mechanism.Mechanism.input`.

    Raises
    ------
    ModelError
        For a name that means something else, or a unit that is none of SI.
    """
    field = f"input '{name}'"
    checked_name(name, "input")
    unit = checked_unit(unit, field)
    start = quantity(value, unit, field)
    return Input(tf.PIECEWISE, _piece((start,)), name, name, unit)


def make_parameter(name: str, unit: str, value: Any) -> Parameter:
    """Return a parameter; refused as an input is."""
    field = f"parameter '{name}'"
    checked_name(name, "parameter")
    unit = checked_unit(unit, field)
    return Parameter(name, unit, quantity(value, unit, field))


def checked_name(name: Any, what: str) -> None:
    """Raise a ModelError for a name that cannot be given to an input, a parameter or an output."""
    if not isinstance(name, str) or not name.strip() or any(mark in name for mark in "\"'"):
        raise ModelError(f"{what} {name!r}: give a name, a text without quotation marks")
    if name.upper() in RESERVED:
        raise ModelError(f"{what} {name!r}: the name means something else in expressions; choose another")
    if name != name.strip() or not name.isprintable():
        raise ModelError(f"{what} {name!r}: a blank at an end, or a line break, would not be seen; leave it out")
    if what != "output" and _calculates(name):
        plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
        if not plain or _calculates(plain):
            plain = f"u_{plain}"
        raise ModelError(f"{what} {name!r}: expressions take that for a calculation, or nothing; call it {plain!r}")


def _calculates(name: str) -> bool:
    """Whether a name, where it stands in an expression without quotation marks, is a number or a calculation.

    Or neither, and begins as a number, as 2x. Others that are neither need the marks, as several words do.
    """
    try:
        return not isinstance(parse(name), Name)
    except ExpressionError:
        return name[0].isdigit() and " " not in name


def checked_unit(unit: Any, field: str) -> str:
    """Return a unit, or that of a dimension; raise a ModelError if it is none of SI."""
    if unit in ("", "1", "dimensionless"):
        return "dimensionless"
    found = powers_of(unit) if isinstance(unit, str) else None
    if (found is None or found[0] != 1.0) and not (isinstance(unit, str) and beyond_mechanics(unit)):
        raise ModelError(f"{field}: unit {unit!r} is none of SI; give one such as 'N m', 'rad/s', 'm', 'V' or '1'")
    return DIMENSIONS.get(unit, unit)


def unit_factor(units: Units, unit: str) -> float:
    """Return the SI value of the unit that a quantity of an SI unit has in a mechanism's own units.

    Raises
    ------
    ModelError
        If these are not SI, and have none for it.
    """
    if units == Units() or unit in ("dimensionless", "rad"):
        return 1.0
    wanted = powers_of(unit)
    if wanted is None:
        # a voltage or a temperature: no set of units has another one for it
        return 1.0
    for dimension, (mass, length, time, force) in LANGUAGE.items():
        powers = (length + force, mass + force, time - 2 * force)
        if wanted[1][:3] == powers:
            return units.factor(dimension)
    raise ModelError(f"unit {unit!r} has no counterpart in the mechanism's units; give one of a force, length or time")


def text_of(function: TimeFunction, units: Units, value: float) -> str:
    """Return a function of time as an expression, an input by its name.

    Parameters
    ----------
    function : TimeFunction
    units : Units
        Of the mechanism, in which the text is.
    value : float
        SI value of the unit of the function's value in the text.

    Raises
    ------
    ModelError
        For a kind without such an expression.
    """
    if isinstance(function, Input) and function.order == 0:
        return number_text(function, function.unit, units, value, function.name)
    return function_text(function, units.time, value)


def number_text(made: Input | Parameter, unit: str, units: Units, value: float, field: str) -> str:
    """Return the expression that an input or a parameter of a unit is; the other parameters are those of `text_of`.

    Raises
    ------
    ModelError
        If it has another unit.
    """
    _check_unit(made, "input" if isinstance(made, Input) else "parameter", unit, field)
    factor = unit_factor(units, made.unit) / value
    return f'"{made.name}"' if factor == 1.0 else f'{factor!r}*"{made.name}"'


def _piece(coefficients: Sequence[float]) -> tuple[float, ...]:
    """Return the parameters of a single polynomial about time 0."""
    return (1.0, 0.0, *coefficients, *([0.0] * (COEFFICIENTS - len(coefficients))))


__all__ = ["Input", "Output", "Parameter", "make_input", "make_output", "make_parameter", "number_text", "text_of"]
