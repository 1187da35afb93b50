"""Errors a modeller can act on."""

from __future__ import annotations

from typing import Any


class ModelError(ValueError):
    """The model cannot be what is meant: a field, a name or a value is wrong.

    Attributes
    ----------
    solution : Solution or None
        What an integration computed until a function of the user failed.
    """

    solution: Any = None


class AssemblyError(ModelError):
    """The constraints contradict each other, or no position satisfies them."""


class SingularModelError(ModelError):
    """A body can move without inertia, or the equations have no unique solution."""
