"""What is raised about expressions."""

from __future__ import annotations


class ExpressionError(ValueError):
    """A function expression that cannot be read or evaluated; says where and what to do."""


class NotEvaluatedError(ExpressionError):
    """A function of the language that is well written but not evaluated here, or not in this place."""
