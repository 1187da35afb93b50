"""Errors a modeller can act on."""

from __future__ import annotations


class ModelError(ValueError):
    """The model cannot be what is meant: a field, a name or a value is wrong."""


class AssemblyError(ModelError):
    """The constraints contradict each other, or no position satisfies them."""


class SingularModelError(ModelError):
    """A body can move without inertia, or the equations have no unique solution."""
