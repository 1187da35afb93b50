"""Checks of the settings of faults that are no quantities: numbers of teeth, counts, choices and switches."""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

import numpy as np


def whole(value: Any, field: str, least: int | None = None) -> int:
    """Return a whole number as ``int``.

    Raises
    ------
    ValueError
        For fractions, text and truth values, and for numbers below ``least``; the message names the field.
    """
    wanted = "a whole number" if least is None else f"a whole number from {least} up"
    good = isinstance(value, Integral) and not isinstance(value, (bool, np.bool_))
    if not good or (least is not None and value < least):
        raise ValueError(f"{field} is {value!r}; give {wanted}")
    return int(value)


def real(value: Any, field: str) -> float:
    """Return a finite number as ``float``.

    Raises
    ------
    ValueError
        For anything else; the message names the field.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real) or not math.isfinite(value):
        raise ValueError(f"{field} is {value!r}; give a finite number")
    return float(value)


def switch(value: Any, field: str) -> bool:
    """Return a truth value as ``bool``.

    Raises
    ------
    ValueError
        For anything else; the message names the field.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{field} is {value!r}; give true or false")
    return bool(value)


def choice(value: Any, field: str, choices: tuple[Any, ...]) -> Any:
    """Return a value that is one of the choices.

    Raises
    ------
    ValueError
        For anything else; the message names the field and the choices.
    """
    if isinstance(value, Integral) and not isinstance(value, (bool, np.bool_)):
        value = int(value)
    known = isinstance(value, (str, int)) and not isinstance(value, bool) and value in choices
    if not known:
        names = [repr(item) for item in choices]
        raise ValueError(f"{field} is {value!r}; choose {', '.join(names[:-1])} or {names[-1]}")
    return value


def tooth_numbers(value: Any, field: str) -> Any:
    """Return ``"all"``, a tooth number, or several, as plain integers.

    Raises
    ------
    ValueError
        For anything else and for no tooth at all; the message names the field.
    """
    remedy = "give 'all', a tooth number or several"
    if isinstance(value, str):
        if value != "all":
            raise ValueError(f"{field} is {value!r}; {remedy}")
        return value
    if not isinstance(value, Iterable):
        try:
            return whole(value, field)
        except ValueError:
            raise ValueError(f"{field} is {value!r}; {remedy}") from None
    try:
        numbers = [whole(item, field) for item in value]
    except ValueError as error:
        raise ValueError(f"{error} or several, or 'all'") from None
    if not numbers:
        raise ValueError(f"{field} is empty; {remedy}")
    return tuple(numbers) if isinstance(value, tuple) else numbers
