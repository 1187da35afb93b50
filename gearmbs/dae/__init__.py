"""Differential-algebraic equations G(t, y, y') = 0: a solver for any, and the equations of mechanisms."""

from gearmbs._lazy import late

__all__ = late(__name__)
