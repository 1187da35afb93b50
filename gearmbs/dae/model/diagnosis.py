"""What is wrong with a model, in the modeller's words: locking positions, values that are not finite, no inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints.terms import ANGLE
from gearmbs.dae.model import initial
from gearmbs.dae.problem import AssemblyError, ModelError

if TYPE_CHECKING:
    from gearmbs.dae.model.base_system import BaseSystem
    from gearmbs.dae.model.columns import Columns
    from gearmbs.dae.model.model import Configuration, Model

LARGEST_LOCK = 600
"""Constraint rows up to which the cause of a failure is sought in a locking position."""
LOCKED = 0.25
"""Smallest singular value of the constraints, of its initial one, below which a position counts as near a lock."""
DENSE_COORDINATES = 600
"""Coordinates up to which motions without inertia are looked for by dense decompositions."""
INVERSE_ITERATIONS = 3


def locking(system: BaseSystem, configuration: Configuration, t: float) -> str | None:
    """Return which constraint rows are about to depend on each other at a position, None when they are not.

    At a position where a mechanism locks the constraint Jacobian loses rank; near it, its smallest singular value
    is well below that of the initial position.
    """
    names = system.row_names
    if not names or len(names) > LARGEST_LOCK:
        return None
    scale = 1.0 / np.sqrt(system.coordinate_weights())

    def smallest(configuration: Configuration, time: float) -> tuple[float, np.ndarray]:
        left, values, _ = np.linalg.svd(system.constraint_jacobian(configuration, time)[0].toarray() * scale)
        return float(values[-1]), left[:, -1]

    value, direction = smallest(configuration, t)
    if not np.isfinite(value) or value > LOCKED * smallest(system.configuration, system.t0)[0]:
        return None
    rows = np.argsort(-np.abs(direction))[:3]
    named = ", ".join(names[r] for r in rows if abs(direction[r]) > 0.1 * np.abs(direction).max())
    return (
        f"The mechanism is near a position where it locks, or can branch: {named} come to depend on each other. "
        "Check the lengths, and whether the motions ask for more than the mechanism can reach."
    )


def check_finite(system: BaseSystem, rhs: np.ndarray, loads: np.ndarray, t: float) -> None:
    """Raise a ModelError that names the load, constraint or body whose terms of the equations are not finite."""
    names = system.model.names
    bad = ~np.all(np.isfinite(loads[:, :6]), axis=1)
    if np.any(bad[: len(names.forces)]):
        name = names.forces[int(np.argmax(bad))]
        element = system.mechanism.elements.get(name) if system.mechanism is not None else None
        raise ModelError(
            f"{getattr(element, 'kind', 'load')} '{name}': its value at t = {t:.6g} s is not finite; look for a "
            f"division by zero, a root or logarithm of a negative number or coinciding markers in {element!r}"
        )
    base = rhs.size - len(names.rows)
    wrong = np.flatnonzero(~np.isfinite(rhs))
    if wrong.size and wrong[-1] >= base:
        raise ModelError(
            f"{names.rows[wrong[-1] - base]}: the derivatives of its function of time at t = {t:.6g} s are not "
            "finite; let the motion begin smoothly"
        )
    if wrong.size:
        body = body_of(system.model, int(wrong[0]))
        raise ModelError(f"body '{body}': its forces at t = {t:.6g} s are not finite")


def check_states(system: BaseSystem, rest: np.ndarray, t: float) -> None:
    """Raise a ModelError that names the state whose equation, with ``rest`` its residual, is not finite."""
    for name, value in zip(system.state_names, rest):
        if not np.isfinite(value):
            raise ModelError(
                f"state '{name}': its rate at t = {t:.6g} s is not finite; look for a division by zero, or a root or "
                "logarithm of a negative number"
            )


def body_of(model: Model, coordinate: int) -> str:
    """Return the name of the body a spatial displacement or modal coordinate belongs to."""
    bodies = len(model.names.bodies)
    if coordinate < 6 * bodies:
        return model.names.bodies[coordinate // 6]
    owners = np.repeat(np.arange(bodies), model.modes[1:])
    return model.names.bodies[owners[coordinate - 6 * bodies]]


def is_massless(model: Model, matrix: Columns) -> bool:
    """Return whether some motion allowed by the constraints has no inertia."""
    inertia = model.bodies[1:, T.BODY_INERTIA :].reshape(-1, 3, 3)
    if np.all(model.bodies[1:, T.BODY_MASS] > 0.0) and np.all(np.linalg.eigvalsh(inertia)[:, 0] > 0.0):
        return False
    return free_massless_body(model, matrix) is not None


def free_massless_body(model: Model, columns: Columns) -> str | None:
    """Return a body that the constraints let move without any inertia, None when there is none."""
    from scipy.linalg import null_space

    base = model.counts.spatial
    matrix = _by_own_inertia(columns.sparse(), base)
    if base > DENSE_COORDINATES:
        return _free_massless_body_of_many(model, matrix)
    constraint = matrix[base:, :base].toarray()
    free = null_space(constraint) if constraint.shape[0] else np.eye(base)
    mass = matrix[:base, :base].toarray()
    values, vectors = np.linalg.eigh(free.T @ mass @ free)
    if values.size and values[0] <= 1e-14 * max(values[-1], 1e-300):
        motion = np.abs(free @ vectors[:, 0])
        return body_of(model, int(np.argmax(motion)))
    return None


def _by_own_inertia(matrix: scipy.sparse.csc_array, base: int) -> scipy.sparse.csc_array:
    """Return masses and constraints in coordinates in which every inertia that a body has itself is 1.

    So a light body beside a heavy one is not taken for one without mass. Rows of constraints have the largest entry 1.
    """
    own = matrix.diagonal()[:base]
    has = own > 0.0
    scale = np.ones(matrix.shape[0])
    scale[:base] = np.where(has, own, np.median(own[has]) if has.any() else 1.0) ** -0.5
    scaled = scipy.sparse.csr_array(scipy.sparse.diags_array(scale) @ matrix @ scipy.sparse.diags_array(scale))
    largest = abs(scaled[base:, :base]).max(axis=1).toarray().ravel() if scaled.shape[0] > base else np.zeros(0)
    rows = np.ones(matrix.shape[0])
    rows[base:] = 1.0 / np.where(largest > 0.0, largest, 1.0)
    rows = scipy.sparse.diags_array(rows)
    return scipy.sparse.csc_array(rows @ scaled @ rows)


def _free_massless_body_of_many(model: Model, matrix: scipy.sparse.csc_array) -> str | None:
    """Look for a motion without inertia by inverse iteration, on masses raised by a trace that keeps it regular."""
    base = model.counts.spatial
    heaviest = abs(matrix[:base, :base]).max()
    raised = np.zeros(matrix.shape[0])
    raised[:base] = 1e-15 * heaviest
    try:
        factors = scipy.sparse.linalg.splu(scipy.sparse.csc_array(matrix + scipy.sparse.diags_array(raised)))
    except RuntimeError:
        return None
    motion = np.zeros(matrix.shape[0])
    motion[:base] = np.random.default_rng(0).standard_normal(base)
    answer = 1.0
    for _ in range(INVERSE_ITERATIONS):
        motion[base:] = 0.0
        motion /= np.linalg.norm(motion)
        motion = factors.solve(motion)
        answer = float(np.linalg.norm(motion[:base]))
    if not answer * heaviest >= 1e14:
        return None
    return body_of(model, int(np.argmax(np.abs(motion[:base]))))


def singular_message(model: Model, matrix: Columns) -> str:
    """Say why the accelerations are not determined."""
    name = free_massless_body(model, matrix)
    if name is not None:
        return (
            f"body '{name}' can move without any inertia resisting it: check whether a massless part is "
            "under-constrained, give it mass and inertia, or fix it with a joint"
        )
    return "the equations of motion have no unique solution: check for bodies without inertia and locked joints"


# Constraint rows dropped as redundant: do they contradict the motion the others leave?
#
# An integrator's positions and velocities are off the constraints by its tolerance, and so are redundant rows, without
# any contradiction. Where one looks violated, the bodies are first put onto the other constraints, to rounding: what is
# left then is a contradiction.


CONFLICT_SHARE = 1e-5
"""Rate of a redundant constraint, of the sum of its terms, from which it is not redundant but in conflict."""

ON_CONSTRAINTS = 1e-12
"""Violation, of the mechanism's length, at which bodies count as being on their constraints."""

MAX_PASSES = 12
FARTHEST = 0.1
"""Step in m or rad from which bodies are not being put onto constraints nearby: the constraints are dependent."""

FARTHEST_COUNTED = 1e-3
"""Violation from which a counted angle is taken to be off by turns nobody counted; its row is then left alone."""


def conflict(system: BaseSystem, configuration: Configuration, t: float) -> str | None:
    """Return which row dropped as redundant contradicts the motion at a configuration, or None.

    The rates are compared, which do not depend on counted turns.
    """
    if _violated(system, configuration, t) is None:
        return None
    on_constraints = projected(system, configuration, t)
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


def _violated(system: BaseSystem, configuration: Configuration, t: float) -> tuple[str, float] | None:
    """Return the name and rate of the redundant row most violated, None when none is."""
    rows, rate, names = system.dropped_rates(configuration, t)
    jacobian = rows.sparse()
    velocities = configuration.velocities
    speeds = np.abs(velocities)
    moving = jacobian @ velocities
    size = abs(jacobian) @ speeds + np.abs(rate - moving)
    # a row whose own rate is rounding, as across the plane of a planar linkage, is held against all speeds
    floor = max(1e-3 * float(speeds.max(initial=0.0)), 1e-9)
    share = np.abs(rate) / np.maximum(size, floor)
    worst = int(np.argmax(share))
    return None if share[worst] <= CONFLICT_SHARE else (names[worst], float(abs(rate[worst])))


def projected(system: BaseSystem, configuration: Configuration, t: float) -> Configuration | None:
    """Return the configuration put onto the constraints with velocities that keep it there, None where impossible."""
    weights = system.coordinate_weights()
    counted = _counted_rows(system)
    try:
        for _ in range(MAX_PASSES):
            jacobian, phi, _ = system.constraint_jacobian(configuration, t)
            phi[counted & (np.abs(phi) > FARTHEST_COUNTED)] = 0.0
            if np.abs(phi).max(initial=0.0) <= ON_CONSTRAINTS * max(1.0, system.length):
                return initial.consistent_velocity(system, configuration, t)
            step = initial.least_correction(jacobian, weights, phi)
            if not np.abs(step).max() <= FARTHEST:
                return None
            configuration = configuration.displaced(step)
    except AssemblyError:
        pass
    return None


def _counted_rows(system: BaseSystem) -> np.ndarray:
    """Mark the rows with an angle whose full turns are counted."""
    model = system.model
    kinds = model.terms[:, T.TERM_TYPE]
    return np.array([np.any(kinds[span] == ANGLE) for span in model.spans], dtype=bool)
