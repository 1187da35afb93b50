"""Numbers a modeller gives: SI, or texts with a unit, each with the name of its element and field."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

import numpy as np

from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.problem import ModelError
from gearmbs.units import NUMBER, to_si

# What a modeller wrote with units, kept by the names of bodies, joints and forces, for showing it again.


F = TypeVar("F", bound=Callable)

QUANTITY = re.compile(rf"\s*(?>{NUMBER.pattern})\s*[A-Za-zµμ°]")
"""Beginning of a number with a unit; an expression such as ``10*TIME`` has an operator there."""


def keeps_given(method: F) -> F:
    """Let a method that adds something by name note in ``self.given`` which settings were texts with units."""
    signature = inspect.signature(method)

    @functools.wraps(method)
    def called(self: Any, *args: Any, **settings: Any) -> Any:
        made = method(self, *args, **settings)
        arguments = dict(signature.bind(self, *args, **settings).arguments)
        arguments |= arguments.pop("where", {})
        texts = {key: value for key, value in arguments.items() if key not in ("self", "name") and has_quantity(value)}
        if texts:
            self.given[str(arguments["name"])] = texts
        return made

    return cast(F, called)


def has_quantity(value: Any) -> bool:
    """Whether a setting is a number with a unit, or a vector that holds one."""
    if isinstance(value, str):
        return QUANTITY.match(value) is not None
    return isinstance(value, Sequence) and any(has_quantity(item) for item in value)


VALUES = (
    "angle", "length", "angular speed", "speed", "rad/s^2", "acceleration", "torque", "force", "dimensionless",
)  # fmt: skip
"""What a function of time may give; tried in turn where nothing tells."""


def quantity(value: Any, unit: str, field: str, factor: float = 1.0) -> float:
    """Return a number: as it is, or from a text with a unit.

    Parameters
    ----------
    value : float or str
        ``2.5`` or ``"10 N/mm"``.
    unit : str
        SI unit or dimension of :mod:`gearmbs.units`.
    field : str
        Element and field, for messages.
    factor : float
        SI value of the unit the result is wanted in; plain numbers are in that unit already.

    Raises
    ------
    ModelError
        For anything else, text of another dimension, and NaN.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    try:
        number = to_si(value, unit, field)
    except (TypeError, ValueError) as error:
        raise ModelError(str(error)) from None
    return number / factor if isinstance(value, str) and factor != 1.0 else number


def quantities(value: Any, unit: str, field: str, factor: float = 1.0) -> np.ndarray:
    """Return an array of numbers given as an array, or as nested sequences with texts in them; see :func:`quantity`.

    Raises
    ------
    ModelError
        If an entry is not a number or a text with the unit expected.
    """
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        pass
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray):
        raise ModelError(f"{field}: {value!r} is not a vector; give numbers, or texts with units, in brackets")
    rows = [
        quantities(v, unit, field, factor) if isinstance(v, Sequence | np.ndarray) and not isinstance(v, str)
        else quantity(v, unit, field, factor)
        for v in value
    ]  # fmt: skip
    try:
        return np.array(rows, dtype=float)
    except ValueError:
        raise ModelError(f"{field}: {value!r} has rows of different lengths") from None


def any_quantity(value: Any, field: str, dimensions: Sequence[str] = VALUES) -> float:
    """Return a number given as it is, or as a text with a unit of one of several dimensions.

    Raises
    ------
    ModelError
        If it is neither.
    """
    if not isinstance(value, str):
        return quantity(value, dimensions[0], field)
    for dimension in dimensions:
        try:
            return to_si(value, dimension, field)
        except ValueError:
            continue
    raise ModelError(f"{field}: cannot read {value!r} as a quantity; give a number in SI or one with a unit, '30 deg'")


def expression_text(value: Any, unit: str, field: str, factor: float = 1.0) -> str:
    """Return an expression of the function language: the text itself, or the number a text with a unit stands for.

    Raises
    ------
    ModelError
        If it is neither an expression nor a quantity.
    """
    from gearmbs.mechanism.language.syntax import parse

    if not isinstance(value, str):
        return repr(quantity(value, unit, field, factor))
    try:
        parse(value)
    except ExpressionError as error:
        try:
            return repr(to_si(value, unit, field) / factor)
        except ValueError as other:
            plain = _is_plain(value)
            raise ModelError(str(other) if plain else f"{field}: {error}") from None
    return value


def _is_plain(text: str) -> bool:
    """Whether a text that is no expression looks like a number with a unit."""
    head = text.strip().split(" ", 1)
    try:
        float(head[0])
    except ValueError:
        return False
    return len(head) == 2 and not any(c in head[1] for c in "(),")
