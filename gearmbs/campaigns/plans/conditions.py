"""Conditions: comparisons of arithmetic expressions of a table's columns, as texts.

``"operation.torque * operation.speed <= 20e3"`` is in SI; a quantity with its unit stands beside a column alone, as in
``"operation.torque > '100 N m'"``. Texts, since they are stored with the plan; they are parsed, never executed.
"""

from __future__ import annotations

import ast
import functools
import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from keyword import iskeyword
from typing import Any

import numpy as np

from gearmbs.campaigns.settings import CampaignError
from gearmbs.units import to_si
from gearmbs.wording import did_you_mean

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
SEVERAL: dict[str, Callable[..., Any]] = {
    "min": np.minimum,
    "max": np.maximum,
    "minimum": np.minimum,
    "maximum": np.maximum,
}
"""Functions of two or more values, of two of them at a time."""
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "abs")},
    **SEVERAL,
}


def satisfied(
    text: str,
    given: Mapping[str, np.ndarray],
    unit_of: Callable[[str], str] = lambda name: "",
    results: Iterable[str] = (),
    empty: Mapping[str, np.ndarray] | None = None,
) -> np.ndarray:
    """Return which rows of a table satisfy a constraint.

    Parameters
    ----------
    text : str
    given : mapping of str to ndarray
        The columns.
    unit_of : callable, optional
        Returns the unit of a column by its name, "" or "1" where it has none, in which quantities are read.
    results : iterable of str, optional
        Columns of which NaN stands for a number that is not known: what is compared with it is neither so nor not so.
    empty : mapping of str to ndarray, optional
        In which rows a column is empty, whatever stands there: the same is true of it.

    Raises
    ------
    CampaignError
        For a text that is no comparison of the columns.
    """
    if not isinstance(text, str):
        raise CampaignError(f"constraint {text!r}: give a text, as 'operation.torque <= 100'")
    written, columns = _as_names(text, given)
    names = {stand_in: name for stand_in, values in columns.items() for name in given if given[name] is values}
    results, empty = set(results), empty or {}
    try:
        tree = ast.parse(written, mode="eval").body
    except SyntaxError as error:
        raise CampaignError(
            f"constraint {text!r}: {error.msg}; write for instance operation.torque <= 100, with columns as the table "
            f"has them: {', '.join(map(str, given))}"
        ) from None
    try:
        missing = {
            stand_in: np.isnan(values.astype(float))
            for stand_in, values in columns.items()
            if names.get(stand_in) in results and _is_number(values)
        }
        missing |= {stand_in: empty[name] for stand_in, name in names.items() if name in empty}
        result = np.asarray(_value(_in_units(tree, columns, names, unit_of, text), columns, text, missing))
    except TypeError:
        about = ", ".join(f"{name} has {_kind(given[name]) or 'neither'}" for name in names_in(text, given))
        raise CampaignError(
            f"constraint {text!r}: compares or computes texts with numbers ({about}); write numbers in SI, or a "
            "quantity with its unit beside a column alone, as operation.torque > '100 N m'"
        ) from None
    if result.dtype != bool:
        raise CampaignError(f"constraint {text!r}: is no comparison; write for instance operation.torque <= 100")
    size = len(next(iter(columns.values())))
    return np.broadcast_to(result, (size,))


def names_in(text: str, columns: Iterable[str]) -> list[str]:
    """Return those of some columns that a condition names."""
    return [name for name in columns if re.search(_alone(name, r"\s*\.\s*"), text)]


def _alone(name: str, dot: str = r"\.") -> str:
    """Return the pattern of a name that is no part of a longer one, with that of the dots in it."""
    return rf"(?<![\w.]){dot.join(map(re.escape, name.split('.')))}(?![\w.])"


STAND_IN = "_column_"
"""What names in an expression begin with that stand for those that Python does not take."""


def _as_names(text: str, columns: Mapping[str, np.ndarray]) -> tuple[str, dict[str, np.ndarray]]:
    """Return a text with names that Python takes for those it does not, as orders.line_of_action.2, and the columns."""
    odd = [name for name in columns if not all(part.isidentifier() and not iskeyword(part) for part in name.split("."))]
    odd = sorted((name for name in odd if not _is_written_in_full(name)), key=len, reverse=True)
    stand_ins = {name: f"{STAND_IN}{k}" for k, name in enumerate(odd)}
    # a text in quotes is none of names, as in status == 'time limit'
    pattern = "|".join([*map(_alone, odd), "'[^']*'", '"[^"]*"'])
    written = re.sub(pattern, lambda match: stand_ins.get(match[0], match[0]), text)
    return written, {**columns, **{stand_in: columns[name] for name, stand_in in stand_ins.items()}}


def _is_written_in_full(name: str) -> bool:
    """Whether the name of a column is a word of conditions or a number, as 1 or -0.5, which stays one in them."""
    if iskeyword(name):
        return True
    try:
        tree = ast.parse(name, mode="eval")
    except SyntaxError:
        return False
    return not any(isinstance(node, ast.Name) for node in ast.walk(tree))


def _is_number(values: Any) -> bool:
    return np.asarray(values).dtype.kind in "biuf"


def _kind(values: Any) -> str:
    """Return whether values are numbers, truth values among them, or texts; nothing where all are missing."""
    if _is_number(values):
        return "numbers"
    first = next((v for v in np.ravel(values) if v is not None and v == v), None)
    return "texts" if isinstance(first, str) else "numbers" if np.isscalar(first) else ""


def _compared(op: ast.cmpop, left: Any, right: Any) -> Any:
    """Return what a comparison gives; as the others, == and != are none of texts with numbers.

    None is another than everything else, and neither less nor more.
    """
    if {_kind(left), _kind(right)} == {"texts", "numbers"}:
        raise TypeError
    if isinstance(op, ast.Eq | ast.NotEq):
        return OPERATORS[type(op)](left, right)
    both = np.broadcast_arrays(np.asarray(left), np.asarray(right))
    if all(values.dtype != object for values in both):
        return OPERATORS[type(op)](left, right)
    known = ~(_is_none(both[0]) | _is_none(both[1]))
    found = np.zeros(known.shape, dtype=bool)
    found[known] = OPERATORS[type(op)](both[0][known], both[1][known])
    return found


def _is_none(values: np.ndarray) -> np.ndarray:
    return np.frompyfunc(lambda value: value is None, 1, 1)(values).astype(bool)


def _real(values: Any) -> Any:
    """Return numbers to calculate with as floating point ones: products of whole ones would overflow, None is NaN."""
    values = np.asarray(values)
    return values if values.dtype.kind == "f" or _kind(values) == "texts" else values.astype(float)


def _in_units(
    tree: ast.AST,
    columns: Mapping[str, np.ndarray],
    names: Mapping[str, str],
    unit_of: Callable[[str], str],
    text: str,
) -> ast.AST:
    """Return a condition with numbers for quantities that are compared with a column of numbers alone."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Compare):
            continue
        sides = [node.left, *node.comparators]
        known = [n for side in sides if (n := ast.unparse(side)) in columns and _kind(columns[n]) == "numbers"]
        for side in sides if known else ():
            if isinstance(side, ast.Constant) and isinstance(side.value, str):
                name = names[known[0]]
                if (unit := unit_of(name)) in ("", "1", "dimensionless"):
                    raise CampaignError(f"constraint {text!r}: {name} has numbers without a unit; write one")
                try:
                    side.value = float(to_si(side.value, unit, name))
                except ValueError as error:
                    raise CampaignError(f"constraint {text!r}: {error}") from None
    return tree


def _called(node: ast.Call, name: str, values: list[Any], text: str) -> Any:
    """Return what a function gives of some values; what numpy takes besides, as a place for the result, is none."""
    wrong = "takes no names of arguments" if node.keywords else ""
    if name in SEVERAL:
        wrong = wrong or ("takes two values or more" if len(values) < 2 else "")
        found = wrong or functools.reduce(SEVERAL[name], values)
    else:
        wrong = wrong or (f"takes one value, not {len(values)}" if len(values) != 1 else "")
        found = wrong or FUNCTIONS[name](*values)
    if wrong:
        more = ", the natural logarithm; log(x) / log(10) has the base 10" if name == "log" else ""
        raise CampaignError(f"constraint {text!r}: {name} {wrong}{more}")
    return found


def _value(
    node: ast.AST,
    columns: Mapping[str, np.ndarray],
    text: str,
    missing: Mapping[str, np.ndarray],
    unknown: bool = False,
) -> Any:
    """Return the value of an expression; a comparison with what is missing has the value ``unknown``.

    True under a negation and false elsewhere: a whole condition then holds where it does whatever is missing may be.
    """

    def sub(part: ast.AST) -> Any:
        return _value(part, columns, text, missing, unknown)

    def truth(part: ast.AST, unknown: bool = unknown) -> Any:
        found = _value(part, columns, text, missing, unknown)
        if np.asarray(found).dtype != bool:
            raise CampaignError(f"constraint {text!r}: {ast.unparse(part)!r} is no comparison, as and, or, not take")
        return found

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float, str)):
        if isinstance(node.value, int) and node.value >= 2**63:
            # a whole number beyond 64 bits is compared as a real one
            return float(node.value) if node.value < 2**1023 else math.inf
        return node.value
    if isinstance(node, (ast.Name, ast.Attribute)):
        name = ast.unparse(node)
        if name not in columns:
            hint = did_you_mean(name, columns, before="; ")
            known = ", ".join(column for column in columns if not column.startswith(STAND_IN))
            raise CampaignError(f"constraint {text!r}: no column {name!r}; columns are {known}{hint}")
        return columns[name]
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return OPERATORS[type(node.op)](_real(sub(node.left)), _real(sub(node.right)))
    if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
        negated = truth(node.operand, not unknown) if isinstance(node.op, ast.Not) else _real(sub(node.operand))
        return OPERATORS[type(node.op)](negated)
    if isinstance(node, ast.BoolOp):
        result = truth(node.values[0])
        for part in node.values[1:]:
            result = OPERATORS[type(node.op)](result, truth(part))
        return result
    if isinstance(node, ast.Compare):
        left, result = sub(node.left), True
        for op, part in zip(node.ops, node.comparators):
            if type(op) not in OPERATORS:
                break
            right = sub(part)
            result = np.logical_and(result, _compared(op, left, right))
            left = right
        else:
            for name in {ast.unparse(n) for n in ast.walk(node) if isinstance(n, (ast.Name, ast.Attribute))}:
                result = np.where(missing[name], unknown, result) if name in missing else result
            return result
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS:
        return _called(node, node.func.id, [_real(sub(arg)) for arg in node.args], text)
    raise CampaignError(
        f"constraint {text!r}: {ast.unparse(node)!r} is not understood; it takes columns, numbers, + - * / **, "
        f"comparisons, and, or, not, and {', '.join(FUNCTIONS)}"
    )
