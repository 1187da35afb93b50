"""Variables of a command file as factors of studies: which there are, and which values they may take."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gearmbs.adams.errors import ERROR, WARNING, DeckError, Diagnostic
from gearmbs.adams.view.interpreter import Interpreter
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item

ROUNDING = 1e-9
"""Of a limit: a value that misses it by less is on it, since files have some ten digits."""


def checked(variables: Mapping[str, Any] | None, file: str) -> dict[str, float]:
    """Return the values of factors as numbers.

    Raises
    ------
    DeckError
        Naming each that is none.
    """
    found, wrong = {}, []
    for name, value in (variables or {}).items():
        try:
            found[name] = float(value)
        except (TypeError, ValueError):
            found[name] = math.nan
        if not math.isfinite(found[name]):
            what = f"variables: {name} = {value!r:.60} is no number"
            wrong.append(Diagnostic(ERROR, f"{what}; give one in the unit of the model, without its name", file, 0))
    if wrong:
        raise DeckError(wrong)
    return found


def listed(run: Interpreter, file: str) -> tuple[dict[str, float], list[Diagnostic]]:
    """Return the variables of one number each, real or whole, by their full names, and a remark on each without one.

    A variable whose expression has no value may stand in a file: it is refused where something of the model needs it.
    """
    values: dict[str, float] = {}
    remarks = []
    for item in run.database.of("variable"):
        key = next((key for key in ("real_value", "integer_value") if key in item.fields), None)
        if not item.line or key is None:
            continue
        try:
            value = run.values.variable(item)
        except ViewError as error:
            line = error.line or item.fields[key].line
            remarks.append(Diagnostic(WARNING, f"variable {item.path} has no value: {error}", file, line))
            continue
        if isinstance(value, (int, float)):
            values[item.path] = float(value)
    return values, remarks


def outside(run: Interpreter, file: str) -> list[Diagnostic]:
    """Return a remark on each factor whose value is not among those that the file allows."""
    found = []
    for name, paths in run.overridden.items():
        for path in sorted(paths):
            item, value = run.database.items.get(path.lower()), run.overrides[name]
            try:
                limits = "" if item is None else _limits(run, item, value)
            except ViewError as error:
                limits = f"taken without its limits, which have no value: {error}"
            if item is not None and limits:
                found.append(Diagnostic(WARNING, f"variables: {path} = {value:g} is {limits}", file, item.line))
    return found


def _limits(run: Interpreter, item: Item, value: float) -> str:
    """Return which limit a value does not keep, "" if it keeps all.

    Limits are as they are given (absolute, the default), differences from the file's own value (relative), or percent
    of it (percent_relative).
    """
    kind = run.values.word(item, "delta_type", "absolute")
    own = run.nominal.get(item.path)
    if own is None and not kind.startswith("a"):
        return ""

    def meant(key: str) -> list[float]:
        if run.values.word(item, f"use_{key}") in ("no", "off", "false", "0"):
            return []
        given = run.values.numbers(item, key) or []
        if own is None or kind.startswith("a"):
            return given
        return [own + (x / 100.0 * abs(own) if kind.startswith("p") else x) for x in given]

    near = ROUNDING * max(abs(value), abs(own or 0.0))
    limits, allowed = meant("range"), meant("allowed_values")
    if len(limits) == 2 and not limits[0] - near <= value <= limits[1] + near:
        return f"outside its range of {limits[0]:g} to {limits[1]:g}"
    if allowed and all(abs(value - x) > near for x in allowed):
        return f"none of its allowed values {', '.join(f'{x:g}' for x in allowed[:10])}"
    return ""
