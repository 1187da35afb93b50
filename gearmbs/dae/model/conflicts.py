"""Constraint rows dropped as redundant: do they contradict the motion the others leave?

An integrator's positions and velocities are off the constraints by its tolerance, and so are redundant rows, without
any contradiction. Where one looks violated, the bodies are first put onto the other constraints, to rounding: what is
left then is a contradiction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import ANGLE
from gearmbs.dae.errors import AssemblyError
from gearmbs.dae.model import initial

if TYPE_CHECKING:
    from gearmbs.dae.model.configuration import Configuration
    from gearmbs.dae.model.posed import PosedModel

CONFLICT_SHARE = 1e-5
"""Rate of a redundant constraint, of the sum of its terms, from which it is not redundant but in conflict."""

ON_CONSTRAINTS = 1e-12
"""Violation, of the mechanism's length, at which bodies count as being on their constraints."""

MAX_PASSES = 12
FARTHEST = 0.1
"""Step in m or rad from which bodies are not being put onto constraints nearby: the constraints are dependent."""

FARTHEST_COUNTED = 1e-3
"""Violation from which a counted angle is taken to be off by turns nobody counted; its row is then left alone."""


def conflict(system: PosedModel, place: Configuration, t: float) -> str | None:
    """Return which row dropped as redundant contradicts the motion at a configuration, or None.

    The rates are compared, which do not depend on counted turns.
    """
    if _violated(system, place, t) is None:
        return None
    on_constraints = projected(system, place, t)
    if on_constraints is None:
        return None
    found = _violated(system, on_constraints, t)
    if found is None:
        return None
    name, rate = found
    return (
        f"conflicting constraints: {name} is implied by the other joints and motions, but they leave it "
        f"violated at a rate of {rate:.3g} per second; remove it or correct its motion"
    )


def _violated(system: PosedModel, place: Configuration, t: float) -> tuple[str, float] | None:
    """Return the name and rate of the redundant row most violated, None when none is."""
    jacobian, rate, names = system.dropped_rates(place, t)
    velocities = place.velocities
    speeds = np.abs(velocities)
    moving = jacobian @ velocities
    size = abs(jacobian) @ speeds + np.abs(rate - moving)
    # a row whose own rate is rounding, as across the plane of a planar linkage, is held against all speeds
    floor = max(1e-3 * float(speeds.max(initial=0.0)), 1e-9)
    share = np.abs(rate) / np.maximum(size, floor)
    worst = int(np.argmax(share))
    return None if share[worst] <= CONFLICT_SHARE else (names[worst], float(abs(rate[worst])))


def projected(system: PosedModel, place: Configuration, t: float) -> Configuration | None:
    """Return the configuration put onto the constraints with velocities that keep it there, None where impossible."""
    weights = system.coordinate_weights()
    counted = _counted_rows(system)
    try:
        for _ in range(MAX_PASSES):
            jacobian, phi, _ = system.constraint_jacobian(place, t)
            phi[counted & (np.abs(phi) > FARTHEST_COUNTED)] = 0.0
            if np.abs(phi).max(initial=0.0) <= ON_CONSTRAINTS * max(1.0, system.length):
                return initial.consistent_velocity(system, place, t)
            step = initial.least_correction(jacobian, weights, phi)
            if not np.abs(step).max() <= FARTHEST:
                return None
            place = place.displaced(step)
    except AssemblyError:
        pass
    return None


def _counted_rows(system: PosedModel) -> np.ndarray:
    """Mark the rows with an angle whose full turns are counted."""
    model = system.model
    kinds = model.terms[:, T.TERM_TYPE]
    return np.array([np.any(kinds[model.span(r)] == ANGLE) for r in range(len(model.rows))], dtype=bool)
