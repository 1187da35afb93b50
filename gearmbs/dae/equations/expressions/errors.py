"""What is raised about expressions."""

from __future__ import annotations


class ExpressionError(ValueError):
    """A function expression that cannot be read or evaluated; says where and what to do."""
