"""What a plan's settings may be: checked and brought into one form before a plan is made of them."""

from __future__ import annotations

import ast
import dataclasses
import hashlib
import json
import math
import operator
import os
import re
from collections.abc import Callable, Iterable, Mapping
from keyword import iskeyword
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.schema.described import check_keys
from gearmbs.schema.quantities import Measure
from gearmbs.wording import did_you_mean

# The error of campaigns.


class CampaignWarning(UserWarning):
    """Something about a campaign that its results do not suffer from, but that somebody should know."""


class CampaignError(ValueError):
    """A plan or a campaign that cannot be worked on; the message names what is wrong and the remedy."""


OPTIONS = {
    "grid": ("levels",),
    "one at a time": ("levels",),
    "factorial": ("generators",),
    "central composite": ("faced", "centre"),
    "box behnken": ("centre",),
    "morris": ("levels",),
    "list": ("rows",),
}
"""What ``options`` may hold by design, besides ``corners``."""


def check_settings(given: Mapping[str, Any], cls: type, design: str) -> dict[str, Any]:
    """Return the settings of a plan, ``cls``, in one form.

    Raises
    ------
    CampaignError
        For unknown names and values that cannot be meant.
    """
    check_keys(given, [f.name for f in dataclasses.fields(cls)], "plan", CampaignError, form="unknown setting {!r}")
    found = dict(given)
    for name in ("constraints", "reuse"):
        if name in found:
            found[name] = texts(found[name], name)
    if "reuse" in found:
        # workers may run in other folders than this process
        found["reuse"] = tuple(os.path.abspath(local(path)) for path in found["reuse"])
    for name, least in (("unit", 1), ("seed", 0)):
        if name in found and not (name == "unit" and found[name] is None):
            found[name] = whole(found[name], name, least)
    for name in ("time_limit", "wall_limit"):
        if found.get(name) is not None:
            found[name] = limit(found[name], name, "60 s")
    if found.get("memory_limit") is not None:
        found["memory_limit"] = limit(found["memory_limit"], "memory_limit", "2 GB")
    options = found.get("options", {})
    if not isinstance(options, Mapping):
        raise CampaignError(f"options = {options!r}; give a dictionary of the design's options")
    if "levels" in options:
        levels = whole(options["levels"], "options: levels", 1)
        if design == "morris" and levels % 2:
            raise CampaignError(f"options: levels = {levels}; a morris design needs an even number of them")
        found["options"] = {**options, "levels": levels}
    check_keys(options, (*OPTIONS.get(design, ()), "corners"), f"options of a {design} design", CampaignError)
    return found


def texts(value: Any, name: str) -> tuple[str, ...]:
    """Return one text or several as several."""
    if isinstance(value, str):
        return (value,)
    try:
        return tuple(str(item) for item in value)
    except TypeError:
        raise CampaignError(f"{name} = {value!r}; give a text or a list of texts") from None


def whole(value: Any, name: str, least: int) -> int:
    """Return a whole number that is not below the least."""
    try:
        return Measure(low=least, whole=True).as_given(value)
    except ValueError as error:
        raise CampaignError(f"{name} = {value!r}; {error}") from None


def local(path: str | Path) -> Path:
    """Return a path, which must not be the address of an object store.

    Raises
    ------
    CampaignError
    """
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]+:/", str(path)):
        raise CampaignError(
            f"{path}: an object store cannot hold a campaign, whose files are renamed in one piece; give a folder of a "
            "disk or of a shared file system, and copy what is done to the store"
        )
    return Path(path)


def limit(value: Any, name: str, example: str) -> float:
    """Return a limit of time in seconds or of memory in bytes, given as a number or as a text with its unit."""
    try:
        return float(Measure("byte" if name == "memory_limit" else "time", above=0).as_given(value))
    except ValueError:
        raise CampaignError(f"{name} = {value!r}; give a positive number or text such as {example!r}") from None


# Constraints of a plan: comparisons of arithmetic expressions of its columns, as texts.
#
# ``"operation.torque * operation.speed <= 20e3"`` is in SI. Texts, since they are stored with the plan; they are
# parsed, never executed.


OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.And: np.logical_and,
    ast.Or: np.logical_or,
    ast.Not: np.logical_not,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: getattr(np, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "abs", "minimum", "maximum")
}


def satisfied(text: str, given: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return which rows of a table satisfy a constraint.

    Raises
    ------
    CampaignError
        For a text that is no comparison of the columns.
    """
    written, columns = _as_names(text, given)
    try:
        tree = ast.parse(written, mode="eval").body
    except SyntaxError as error:
        raise CampaignError(
            f"constraint {text!r}: {error.msg}; write for instance operation.torque <= 100, with columns as the table "
            f"has them: {', '.join(map(str, given))}"
        ) from None
    result = np.asarray(_value(tree, columns, text))
    if result.dtype != bool:
        raise CampaignError(f"constraint {text!r}: is no comparison; write for instance operation.torque <= 100")
    size = len(next(iter(columns.values())))
    return np.broadcast_to(result, (size,))


def names_in(text: str, columns: Iterable[str]) -> list[str]:
    """Return those of some columns that a condition names."""
    return [name for name in columns if re.search(_alone(name), text)]


def _alone(name: str) -> str:
    """Return the pattern of a name that is no part of a longer one."""
    return rf"(?<![\w.]){re.escape(name)}(?![\w.])"


STAND_IN = "_column_"
"""What names in an expression begin with that stand for those that Python does not take."""


def _as_names(text: str, columns: Mapping[str, np.ndarray]) -> tuple[str, dict[str, np.ndarray]]:
    """Return a text with names that Python takes for those it does not, as orders.line_of_action.2, and the columns."""
    found = dict(columns)
    odd = [name for name in columns if not all(part.isidentifier() and not iskeyword(part) for part in name.split("."))]
    for k, name in enumerate(sorted(odd, key=len, reverse=True)):
        text, count = re.subn(_alone(name), f"{STAND_IN}{k}", text)
        if count:
            found[f"{STAND_IN}{k}"] = columns[name]
    return text, found


def _value(node: ast.AST, columns: Mapping[str, np.ndarray], text: str) -> Any:
    def sub(part: ast.AST) -> Any:
        return _value(part, columns, text)

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float, str)):
        return node.value
    if isinstance(node, (ast.Name, ast.Attribute)):
        name = ast.unparse(node)
        if name not in columns:
            hint = did_you_mean(name, columns, before="; ")
            known = ", ".join(column for column in columns if not column.startswith(STAND_IN))
            raise CampaignError(f"constraint {text!r}: no column {name!r}; columns are {known}{hint}")
        return columns[name]
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](sub(node.left), sub(node.right))
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](sub(node.operand))
    if isinstance(node, ast.BoolOp):
        result = sub(node.values[0])
        for part in node.values[1:]:
            result = OPERATORS[type(node.op)](result, sub(part))
        return result
    if isinstance(node, ast.Compare):
        left, result = sub(node.left), True
        for op, part in zip(node.ops, node.comparators):
            if type(op) not in OPERATORS:
                break
            right = sub(part)
            result = np.logical_and(result, OPERATORS[type(op)](left, right))
            left = right
        else:
            return result
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS:
        return FUNCTIONS[node.func.id](*(sub(arg) for arg in node.args))
    raise CampaignError(
        f"constraint {text!r}: {ast.unparse(node)!r} is not understood; it takes columns, numbers, + - * / **, "
        f"comparisons, and, or, not, and {', '.join(FUNCTIONS)}"
    )


# One content identity for everything that is simulated: equal physics, equal text, equal key.
#
# A canonical form is a tree of dictionaries, lists, numbers, texts and truth values in SI with all defaults filled in
# and no names. Numbers are rounded to twelve digits, since the same quantity written in two units may differ in the
# last bit; minus zero is zero; tuples are lists. The key is the SHA-256 of that tree as JSON with sorted keys, of the
# kind of subject and of the code that simulates it.


DIGITS = 12


def rounded(value: float) -> float:
    """Return a number to twelve significant digits, minus zero as zero."""
    number = float(value)
    if not math.isfinite(number):
        return number
    return float(f"{number:.{DIGITS - 1}e}") + 0.0


def canonical(value: Any) -> Any:
    """Return a value as a canonical tree.

    Raises
    ------
    CampaignError
        For a value that is none of dictionary, sequence, number, text, truth value or None.

    Examples
    --------
    >>> canonical({"b": (1, -0.0), "a": 1000 * 0.1})
    {'a': 100.0, 'b': [1, 0.0]}
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, Mapping):
        return {str(key): canonical(value[key]) for key in sorted(value, key=str)}
    if isinstance(value, (list, tuple)):
        return [canonical(item) for item in value]
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return rounded(float(value))
    if hasattr(value, "tolist"):
        return canonical(value.tolist())
    raise CampaignError(f"{value!r} of type {type(value).__name__} has no canonical form; give numbers and texts")


def content_key(kind: str, tree: Any, code: str = "") -> str:
    """Return the key of a canonical tree: 64 hexadecimal digits.

    Parameters
    ----------
    kind : str
        Name of the subject, as "pair".
    tree
        Anything `canonical` understands.
    code : str
        Digest of what simulates it, see `gearmbs.studies.run.code`; without it the key is that of the content alone.
    """
    text = json.dumps({"kind": kind, "code": code, "content": canonical(tree)}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()
