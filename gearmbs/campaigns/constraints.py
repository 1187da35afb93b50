"""Constraints of a plan: comparisons of arithmetic expressions of its columns, as texts.

``"operation.torque * operation.speed <= 20e3"`` is in SI. Texts, since they are stored with the plan; they are parsed,
never executed.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gearmbs.campaigns.errors import CampaignError

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


def satisfied(text: str, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return which rows of a table satisfy a constraint.

    Raises
    ------
    CampaignError
        For a text that is no comparison of the columns.
    """
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise CampaignError(f"constraint {text!r}: {error.msg}; write for instance operation.torque <= 100") from None
    result = np.asarray(_value(tree, columns, text))
    if result.dtype != bool:
        raise CampaignError(f"constraint {text!r}: is no comparison; write for instance operation.torque <= 100")
    size = len(next(iter(columns.values())))
    return np.broadcast_to(result, (size,))


def _value(node: ast.AST, columns: Mapping[str, np.ndarray], text: str) -> Any:
    def sub(part: ast.AST) -> Any:
        return _value(part, columns, text)

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float, str)):
        return node.value
    if isinstance(node, (ast.Name, ast.Attribute)):
        name = ast.unparse(node)
        if name not in columns:
            raise CampaignError(f"constraint {text!r}: no column {name!r}; columns are {', '.join(columns)}")
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
