"""Sequences of static equilibria, each followed from the one before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.analyses.equilibrium_solution import EquilibriumSolution, Snapshot
from gearmbs.dae.analyses.instant import Instant
from gearmbs.dae.analyses.load_steps import equilibrium
from gearmbs.dae.analyses.relaxation import Relaxation
from gearmbs.dae.analyses.statics import static_equilibrium
from gearmbs.dae.errors import ModelError
from gearmbs.dae.results.solution import Solution

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

SMALLEST_STEP = 1e-4
"""Part of the span of a sequence of equilibria below which a step of time is not halved any more."""


def initial_conditions(system: System) -> Solution:
    """Return a system's consistent start, with accelerations and reactions, as a solution of one time."""
    snapshot = Snapshot.of(Instant(system, "SI2"))
    message = "positions, velocities and accelerations are consistent"
    return Solution(system, snapshot.problem, snapshot.result(message, 0, [snapshot]))


def quasi_static(system: System, times: np.ndarray, *, tol: float = 1e-10, max_iterations: int = 200) -> Solution:
    """Follow the equilibrium over a sequence of times, each reached from the one before.

    Newton's method follows it; where one step of time leads too far it is halved, and where the equilibrium ends the
    next one is sought as from afar.

    Parameters
    ----------
    system : System
        Compiled for the first time.
    times : ndarray, shape (m,)
        Increasing times at which functions of time are frozen, s.
    tol, max_iterations
        As in :func:`static_equilibrium`, for each time.

    Raises
    ------
    ModelError, SingularModelError
        As :func:`static_equilibrium`; the time is named.
    """
    if times.size == 0 or not np.all(np.diff(times) > 0.0):
        raise ModelError("times: give increasing times")
    static_equilibrium(system, tol=tol, max_iterations=max_iterations)
    instant = Instant(system, "I3")
    instant.y = instant.settle(instant.stop(instant.y))
    rows, total = [], 0
    for target in times:
        step = float(target) - instant.t
        while True:
            kept = instant.t, instant.y.copy(), instant.idata.copy(), instant.rdata.copy()
            last = instant.t + step >= float(target) - 1e-12 * abs(step)
            instant.t = float(target) if last else instant.t + step
            iterations = Relaxation(instant, tol).newton()
            if iterations is None:
                instant.t, instant.y, instant.idata, instant.rdata = kept
                step *= 0.5
                if abs(step) >= SMALLEST_STEP * float(times[-1] - times[0]) and step != 0.0:
                    continue
                # no equilibrium nearby: let it fall to the next one
                instant.t = float(target)
                try:
                    iterations, _ = equilibrium(Relaxation(instant, tol), max_iterations)
                except ModelError as error:
                    raise type(error)(f"at t = {instant.t:.6g} s: {error}") from error
                last = True
            total += iterations
            if last:
                break
        rows.append(Snapshot.of(instant))
    return EquilibriumSolution.of(rows, f"{times.size} static equilibria found in {total} iterations", total)
