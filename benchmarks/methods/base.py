"""What a method under comparison offers, and how its runs are told."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from benchmarks.machine import version_of
from benchmarks.problems.reference import ReferenceProblem
from gearmbs.dae.problem import DAEProblem

UNCONTROLLED = 1e10
"""Absolute tolerance of unknowns that are to stay out of a peer's error test."""


class NotPossible(Exception):
    """A method cannot do a problem; the text says why, for the list of what was left out."""


@dataclass
class RunResult:
    """One run of one method.

    Attributes
    ----------
    values : ndarray, shape (m, k)
        Positions and velocities at the reference times, in the order of the reference.
    counts : dict of str to int
        Steps and evaluations, as far as the method tells.
    """

    values: np.ndarray
    counts: dict[str, int] = field(default_factory=dict)


def assign(target: Any, settings: Mapping[str, Any]) -> None:
    """Set attributes of somebody else's object by their names, ``"newton.useModifiedNewton"`` of one inside it."""
    for name, value in settings.items():
        *owners, last = name.split(".")
        setattr(functools.reduce(getattr, owners, target), last, value)


class RunFailed(Exception):
    """A run ended early; the text is the method's own message."""


@dataclass(frozen=True)
class Method:
    """An integrator in one formulation.

    Attributes
    ----------
    name : str
        Label, with the formulation.
    family : str
        Methods of a family compete for its best time.
    package : str or None
        Distribution that must be installed.
    prepare : callable
        ``prepare(reference)`` returns ``run(knob) -> RunResult``; it may raise `NotPossible`, and ``run`` `RunFailed`.
    knobs : tuple of float
        What is varied from coarse to fine: tolerances, or step counts.
    knob : str
        Its name.
    """

    name: str
    family: str
    package: str | None
    prepare: Callable[[ReferenceProblem], Callable[[float], RunResult]]
    knobs: tuple[float, ...]
    knob: str = "tolerance"

    @property
    def missing(self) -> str | None:
        """Why the method cannot be run here, or None."""
        if self.package is not None and version_of(self.package) is None:
            return f"{self.package} is not installed"
        return None


def tolerances(first: float, last: float, per_decade: int = 2) -> tuple[float, ...]:
    """Return tolerances from 10**first down to 10**last."""
    count = round((first - last) * per_decade) + 1
    return tuple(float(f"{t:.2g}") for t in np.logspace(first, last, count))


class Callbacks:
    """A problem as plain Python functions around its compiled residual and Jacobian, with as little between as can be.

    Peers hand over arrays that may be read-only or strided; the compiled functions want their own.
    """

    def __init__(self, problem: DAEProblem) -> None:
        self.problem = problem
        n = problem.n
        self.y, self.yp = np.empty(n), np.empty(n)
        self.work = np.zeros(problem.work_size)
        self.idata, self.rdata = problem.idata.copy(), problem.rdata.copy()
        self.vals = np.empty(problem.indices.size)
        self.columns = np.repeat(np.arange(n), np.diff(problem.indptr))
        self.flat = problem.indices * n + self.columns
        self.residuals = self.jacobians = 0

    def into(self, t: float, y: np.ndarray, yp: np.ndarray, out: np.ndarray) -> None:
        """Write the residual into a contiguous array."""
        self.residuals += 1
        self.y[:] = y
        self.yp[:] = yp
        self.problem.residual(t, self.y, self.yp, out, self.idata, self.rdata, self.work)

    def residual(self, t: float, y: np.ndarray, yp: np.ndarray) -> np.ndarray:
        """Return the residual as a new array."""
        out = np.empty(self.problem.n)
        self.into(t, y, yp, out)
        return out

    def values(self, t: float, y: np.ndarray, yp: np.ndarray, cj: float) -> np.ndarray:
        """Return dG/dy + cj dG/dy' in CSC order; overwritten by the next call."""
        self.jacobians += 1
        self.y[:] = y
        self.yp[:] = yp
        self.problem.jacobian(t, self.y, self.yp, cj, self.vals, self.idata, self.rdata, self.work)
        return self.vals

    def dense(self, t: float, y: np.ndarray, yp: np.ndarray, cj: float) -> np.ndarray:
        """Return the Newton matrix as a new dense array."""
        n = self.problem.n
        out = np.zeros(n * n)
        out[self.flat] = self.values(t, y, yp, cj)
        return out.reshape(n, n)

    def sparse(self, t: float, y: np.ndarray, yp: np.ndarray, cj: float) -> csc_array:
        """Return the Newton matrix as a new sparse matrix."""
        n = self.problem.n
        values = self.values(t, y, yp, cj).copy()
        return csc_array((values, self.problem.indices, self.problem.indptr), shape=(n, n))


def absolute_tolerances(problem: DAEProblem, tol: float, uncontrolled: float = UNCONTROLLED) -> np.ndarray:
    """Return one absolute tolerance for each unknown: ``tol`` times its scale where errors are controlled."""
    return np.where(problem.error_mask, tol * problem.atol_scale, uncontrolled)
