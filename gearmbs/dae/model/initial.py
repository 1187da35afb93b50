"""Initial conditions: position, velocity, then acceleration and multipliers; redundant rows removed.

Positions and velocities are corrected as little as possible in the norm sum |dR|^2 + L^2 |dpi|^2 with a
length L of the mechanism, by Newton's method on the constraints with the exact Jacobian.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints.terms import ROTATION
from gearmbs.dae.equations.loads.time_functions import CONSTANT
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V
from gearmbs.dae.model.columns import DENSE_SYSTEM, Columns
from gearmbs.dae.model.evaluator import POSE_PLACES, Assembler
from gearmbs.dae.model.model import Model, frozen
from gearmbs.dae.problem import AssemblyError, SingularModelError

if TYPE_CHECKING:
    from gearmbs.dae.model.base_system import BaseSystem
    from gearmbs.dae.model.model import Configuration

POSITION_TOLERANCE = 1e-12
"""Part of the mechanism's length, or of 1 m, within which constraints hold: some thousand times the rounding of their
terms."""
RANK_TOLERANCE = 1e-9
"""Distance of a row of length one from the rows before it, in a QR decomposition with pivots, below which it depends on
them: rounding of the rows is 1e-16, and positions are known to 1e-12."""
LEAST = 1e-6
"""Distance of a constraint row of length 1 from the others above which it is independent."""
NEARLY = 1e-4
"""The same where an assembly has stopped short of its end."""
CONFLICT = 1e-6
"""Violation of a redundant row, in m or of 1, above which it contradicts the others: models are often written with nine
decimals, and a mechanism of many parts multiplies their error."""
MAX_POSITION_ITERATIONS = 50
VISIBLE = 1e-3
"""Displacement, relative to the mechanism's length, above which the report mentions a correction of positions."""

VISIBLE_TURN = np.radians(0.1)
DENSE_ROWS = 400
"""Rows up to which redundancy is looked for by a dense factorisation."""
SURE = 1e-12
"""Squared distance of a row from the others, all of length 1, above which it is independent beyond rounding."""
DOUBTFUL = (1e-6, 1e-3)
"""Squared distance of a row from those before it below which it is looked at again; then the second."""
BLURRED = 1e-8
"""Squared distance of a kept row from the others up to which rounding may hide that it depends on them."""
MOST_DOUBTFUL = 2000
"""Rows up to which the second distance is tried: they are looked at densely."""
CHUNK = 200
"""Doubtful rows that are looked at together."""
SELECTIONS = 3
"""Most choices of redundant rows that are tried where those removed first turn out to be violated."""

LONGEST_STEP = 0.5
"""rad, far from the quarter turn at which the nearest solution is another one."""


@dataclass
class InitialReport:
    """What the initial-condition analysis found.

    Attributes
    ----------
    degrees_of_freedom : int
        Coordinates less independent constraint rows.
    redundant : list of str
        Names of the constraint rows removed because the others imply them.
    position_iterations : int
        Newton iterations of the assembly.
    largest_correction : float
        Largest displacement (m) or rotation (rad) made to assemble the mechanism.
    moved, turned : tuple of (str, float)
        The body moved farthest by the assembly and how far, m; the one turned most and how far, rad.
    length : float
        Length of the mechanism, m.
    violation : float
        Largest remaining constraint violation (m or 1).
    """

    degrees_of_freedom: int
    redundant: list[str] = field(default_factory=list)
    position_iterations: int = 0
    largest_correction: float = 0.0
    violation: float = 0.0
    moved: tuple[str, float] = ("", 0.0)
    turned: tuple[str, float] = ("", 0.0)
    length: float = 1.0

    def correction(self) -> str | None:
        """Return a sentence about a correction of the positions one can see, None when there was none."""
        parts = []
        if self.moved[1] > VISIBLE * self.length:
            parts.append(f"moved body '{self.moved[0]}' by {self.moved[1]:.3g} m")
        if self.turned[1] > VISIBLE_TURN:
            parts.append(f"turned body '{self.turned[0]}' by {np.degrees(self.turned[1]):.3g} degrees")
        return f"To satisfy joints and motions the assembly {' and '.join(parts)} before the start." if parts else None

    def __str__(self) -> str:
        lines = [f"degrees of freedom: {self.degrees_of_freedom}"]
        if self.redundant:
            lines.append("redundant constraints removed:")
            lines.extend(f"  {name}" for name in self.redundant)
        lines.append(
            f"assembled in {self.position_iterations} iterations, largest correction "
            f"{self.largest_correction:.3g}, violation {self.violation:.3g}"
        )
        lines.extend(line for line in (self.correction(),) if line)
        return "\n".join(lines)


def independent_rows(
    jacobian: Columns, weights: np.ndarray, least: float = LEAST, order: np.ndarray | None = None
) -> np.ndarray:
    """Return the indices of a largest set of independent rows of the constraint Jacobian, in order.

    Earlier rows are preferred, so that a redundancy is blamed on the joint added last. ``least`` is the distance of a
    row of length 1 from those before below which it counts as redundant; ``order`` names all rows in another order of
    preference.
    """
    m = jacobian.shape[0]
    order = np.arange(m) if order is None else order
    if m == 0:
        return np.zeros(0, dtype=np.int64)
    if m > DENSE_ROWS:
        scaled = scipy.sparse.csr_array(jacobian.sparse() @ scipy.sparse.diags_array(1.0 / np.sqrt(weights)))[order]
        norms = np.sqrt(np.asarray((scaled.multiply(scaled)).sum(axis=1)).ravel())
        norms[norms == 0.0] = 1.0
        kept = _sparse_rows(scipy.sparse.csc_array(scipy.sparse.diags_array(1.0 / norms) @ scaled), least)
    else:
        dense = jacobian.toarray()[order] / np.sqrt(weights)
        norms = np.linalg.norm(dense, axis=1, keepdims=True)
        norms[norms == 0.0] = 1.0
        kept = _dense_rows(dense / norms, least)
    return np.sort(order[kept])


def _dense_rows(dense: np.ndarray, least: float) -> np.ndarray:
    """Independent rows of a matrix whose rows have length 1, earlier ones preferred."""
    m = len(dense)
    if least <= LEAST and _are_sure(dense):
        return np.arange(m)
    r_diagonal = np.abs(np.diag(scipy.linalg.qr(dense.T, mode="r", pivoting=True)[0]))
    rank = int(np.sum(r_diagonal > RANK_TOLERANCE * max(1.0, r_diagonal[0])))
    if rank == m and least <= LEAST:
        return np.arange(m)
    return _greedy_rows(dense, rank, least)


def _are_sure(dense: np.ndarray) -> bool:
    """Return whether each row is farther from the others than rounding can hide: R R^T - SURE 1 is positive definite.

    The least singular value, squared, is then above `SURE`, and none of a QR decomposition's diagonal below its root.
    """
    try:
        np.linalg.cholesky(dense @ dense.T - SURE * np.eye(len(dense)))
    except np.linalg.LinAlgError:
        return False
    return True


def _pivots(gram: scipy.sparse.csc_array, order: str) -> np.ndarray | None:
    """Return the pivots of a symmetric factorisation: in the order NATURAL, squared distances to the rows before."""
    try:
        factors = scipy.sparse.linalg.splu(
            gram, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:
        return None
    return np.abs(factors.U.diagonal())


def _sparse_rows(scaled: scipy.sparse.csc_array, least: float = LEAST) -> np.ndarray:
    """Independent rows of a large sparse matrix whose rows have length 1, earlier ones preferred."""
    m = scaled.shape[0]
    gram = scipy.sparse.csc_array(scaled @ scaled.T)
    pivots = _pivots(gram, "MMD_AT_PLUS_A")
    if pivots is not None and least <= LEAST and pivots.min() > SURE:
        return np.arange(m)
    # a little on the diagonal keeps the elimination going past dependent rows
    pivots = _pivots(scipy.sparse.csc_array(gram + scipy.sparse.diags_array(np.full(m, SURE))), "NATURAL")
    if pivots is None:
        return _greedy_rows(scaled.toarray(), min(scaled.shape), least)
    kept = _looked_at_again(scaled, np.flatnonzero(pivots < DOUBTFUL[0]), least)
    among = _pivots(scipy.sparse.csc_array(gram[kept][:, kept]), "MMD_AT_PLUS_A")
    doubtful = np.flatnonzero(pivots < DOUBTFUL[1])
    if (among is None or among.min() <= BLURRED) and doubtful.size <= MOST_DOUBTFUL:
        kept = _looked_at_again(scaled, doubtful, least)
    return kept


def _looked_at_again(scaled: scipy.sparse.csc_array, doubtful: np.ndarray, least: float) -> np.ndarray:
    """Return all rows but the doubtful ones, and of these those that are farther than ``least`` from the rest."""
    sure = np.setdiff1d(np.arange(scaled.shape[0]), doubtful)
    rows = scipy.sparse.csc_array(scaled[sure])
    factors = scipy.sparse.linalg.splu(
        scipy.sparse.csc_array(rows @ rows.T), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
    )
    added: list[int] = []
    directions = np.zeros((0, scaled.shape[1]))
    for first in range(0, doubtful.size, CHUNK):
        part = doubtful[first : first + CHUNK]
        rest = scaled[part].toarray()
        for _ in range(2):
            rest -= (rows.T @ factors.solve(rows @ rest.T)).T
            rest -= (rest @ directions.T) @ directions
        for k, row in zip(part, rest):
            row = row - directions.T @ (directions @ row)
            size = np.linalg.norm(row)
            if size > least:
                added.append(int(k))
                directions = np.vstack([directions, row / size])
    return np.sort(np.concatenate([sure, np.array(added, dtype=np.int64)]))


def _greedy_rows(dense: np.ndarray, rank: int, least: float = LEAST) -> np.ndarray:
    """Gram-Schmidt through the rows in order, keeping those that add a direction."""
    basis = np.zeros((rank, dense.shape[1]))
    kept: list[int] = []
    for i, row in enumerate(dense):
        rest = row - basis[: len(kept)].T @ (basis[: len(kept)] @ row)
        rest -= basis[: len(kept)].T @ (basis[: len(kept)] @ rest)
        size = np.linalg.norm(rest)
        if size > least and len(kept) < rank:
            basis[len(kept)] = rest / size
            kept.append(i)
    return np.array(kept, dtype=np.int64)


def least_correction(jacobian: Columns, weights: np.ndarray, violation: np.ndarray) -> np.ndarray:
    """Solve min |x|_W subject to jacobian x = -violation."""
    m, n = jacobian.shape
    rhs = np.concatenate([np.zeros(n), -violation])
    try:
        if m + n <= DENSE_SYSTEM:
            full, dense = np.zeros((n + m, n + m)), jacobian.toarray()
            full[np.arange(n), np.arange(n)] = weights
            full[n:, :n], full[:n, n:] = dense, dense.T
            return np.linalg.solve(full, rhs)[:n]
        rows = jacobian.sparse()
        kkt = scipy.sparse.block_array([[scipy.sparse.diags_array(weights), rows.T], [rows, None]])
        return scipy.sparse.linalg.splu(scipy.sparse.csc_array(kkt)).solve(rhs)[:n]
    except (RuntimeError, np.linalg.LinAlgError) as error:
        raise AssemblyError(
            "the constraints became dependent while the mechanism was being assembled: "
            "it is near a position where it locks; move the bodies closer to a position that satisfies the joints"
        ) from error


class _Constrained(NamedTuple):
    """A configuration with the constraints there: Phi_q in spatial displacements, and Phi."""

    configuration: Configuration
    jacobian: Columns
    phi: np.ndarray


def _constrained(system: BaseSystem, configuration: Configuration, t: float) -> _Constrained:
    """Evaluate the constraints at a configuration."""
    jacobian, phi, _ = system.constraint_jacobian(configuration, t)
    return _Constrained(configuration, jacobian, phi)


def assemble_position(
    system: BaseSystem, configuration: Configuration, t: float
) -> tuple[Configuration, np.ndarray, InitialReport]:
    """Move the bodies as little as possible onto the constraints.

    Returns
    -------
    configuration : Configuration
        With the velocities it had.
    kept : ndarray of int
        Independent constraint rows; the others follow from them.
    report : InitialReport
    """
    weights = system.coordinate_weights()
    start = _constrained(system, configuration, t)
    if not np.all(np.isfinite(start.phi)):
        raise _not_finite(system, start.phi, t)
    drawn = prescribed_turns(system, *start)
    kept = independent_rows(start.jacobian, weights, order=system.row_order)
    report = InitialReport(degrees_of_freedom=system.model.counts.coordinates - kept.size)
    found, kept = _assembled(system, start, t, kept, weights, report)
    off = {turn.row for turn in _half_turned(system, found, drawn)}
    if off:
        turned = _turned(system, configuration, t, kept, weights, [turn for turn in drawn if turn.row in off])
        found, kept = _assembled(system, _constrained(system, turned, t), t, kept, weights, report)
        still = _half_turned(system, found, drawn)
        if still:
            raise AssemblyError(
                f"{system.row_names[still[0].row]}: the mechanism can be assembled with this angle half a turn off; "
                "draw its bodies nearer to the angle prescribed"
            )
    dropped = np.setdiff1d(np.arange(found.jacobian.shape[0]), kept)
    report.redundant = [system.row_names[i] for i in dropped]
    report.violation = float(np.abs(found.phi).max(initial=0.0))
    _note_correction(system, report, configuration.pose, found.configuration.pose)
    return found.configuration, kept, report


def _assembled(
    system: BaseSystem, here: _Constrained, t: float, kept: np.ndarray, weights: np.ndarray, report: InitialReport
) -> tuple[_Constrained, np.ndarray]:
    """Solve all rows for the nearest position; return it with the independent rows."""
    length = np.sqrt(weights[3]) if weights.size else 1.0
    dropped = np.zeros(0, dtype=np.int64)
    for _ in range(SELECTIONS):
        here, iterations = _closed(system, here, t, kept, weights)
        report.position_iterations += iterations
        rows = here.jacobian.shape[0]
        dropped = np.setdiff1d(np.arange(rows), kept)
        if not dropped.size or np.abs(here.phi[dropped]).max() <= CONFLICT * max(1.0, length):
            return here, kept
        # rows that are redundant where the assembly began need not be so where it ends
        others = independent_rows(here.jacobian, weights, NEARLY, system.row_order)
        if np.array_equal(others, kept):
            raise _conflict(system, dropped, here.phi)
        kept = others
        report.degrees_of_freedom = system.model.counts.coordinates - kept.size
    raise _conflict(system, dropped, here.phi)


def _half_turned(system: BaseSystem, here: _Constrained, drawn: list[Turn]) -> list[Turn]:
    """Return the prescribed rotations that are half a turn off, but those whose axes are drawn so."""
    if not drawn:
        return []
    now = prescribed_turns(system, *here)
    return [b for a, b in zip(drawn, now) if abs(b.missing) > 0.5 * np.pi and not a.opposite]


def _turned(
    system: BaseSystem,
    configuration: Configuration,
    t: float,
    kept: np.ndarray,
    weights: np.ndarray,
    turns: list[Turn],
) -> Configuration:
    """Bring prescribed rotations to their angles in steps."""
    own = system.assembler
    try:
        for held in stages(system, turns):
            system.assembler = held
            here, _ = _closed(system, _constrained(system, configuration, t), t, kept, weights)
            configuration = here.configuration
    finally:
        system.assembler = own
    return configuration


def _note_correction(system: BaseSystem, report: InitialReport, before: np.ndarray, pose: np.ndarray) -> None:
    report.length = system.length
    if not len(pose):
        return
    shift = np.linalg.norm(pose[:, POSE_R : POSE_R + 3] - before[:, POSE_R : POSE_R + 3], axis=1)
    # |A - A0| = 2 sqrt(2) |sin(angle / 2)|
    apart = np.linalg.norm(pose[:, POSE_A:POSE_V] - before[:, POSE_A:POSE_V], axis=1)
    turn = 2.0 * np.arcsin(np.minimum(apart / np.sqrt(8.0), 1.0))
    far, most = int(np.argmax(shift)), int(np.argmax(turn))
    report.moved = (system.body_names[far], float(shift[far]))
    report.turned = (system.body_names[most], float(turn[most]))
    report.largest_correction = max(report.moved[1], report.turned[1])


def _closed(
    system: BaseSystem, here: _Constrained, t: float, kept: np.ndarray, weights: np.ndarray
) -> tuple[_Constrained, int]:
    """Solve the kept rows for the nearest position; return it with the iterations taken."""
    length = np.sqrt(weights[3]) if weights.size else 1.0
    size = 0.0
    for iteration in range(MAX_POSITION_ITERATIONS):
        configuration, jacobian, phi = here
        size = float(np.abs(phi[kept]).max(initial=0.0))
        if not np.isfinite(size):
            raise _not_finite(system, phi, t)
        if size <= POSITION_TOLERANCE * max(1.0, length):
            return here, iteration
        step = least_correction(jacobian.chosen(kept), weights, phi[kept])
        turn = np.abs(configuration.parts(step)[0][:, 3:]).max(initial=0.0)
        here = _constrained(system, configuration.displaced(step * min(1.0, 0.5 / max(turn, 1e-300))), t)
    if size > 1e-9 * max(1.0, length):
        worst = kept[np.argmax(np.abs(here.phi[kept]))]
        raise AssemblyError(
            f"the mechanism cannot be assembled: after {MAX_POSITION_ITERATIONS} iterations "
            f"{system.row_names[worst]} is still violated by {abs(here.phi[worst]):.3g}; "
            "check the lengths and the markers of that joint"
        )
    return here, MAX_POSITION_ITERATIONS


def _not_finite(system: BaseSystem, phi: np.ndarray, t: float) -> AssemblyError:
    """Say which row has no value."""
    name = system.row_names[int(np.argmin(np.isfinite(phi)))]
    return AssemblyError(
        f"{name}: its value at t = {t:.6g} s is not finite; check its function of time and the markers' positions"
    )


def _conflict(system: BaseSystem, dropped: np.ndarray, phi: np.ndarray) -> AssemblyError:
    """Say which redundant row contradicts the others most."""
    worst = dropped[np.argmax(np.abs(phi[dropped]))]
    return AssemblyError(
        f"conflicting constraints: {system.row_names[worst]} is implied by the other joints but they leave it "
        f"violated by {abs(phi[worst]):.3g}; correct the markers or remove one of the joints"
    )


def consistent_velocity(system: BaseSystem, configuration: Configuration, t: float) -> Configuration:
    """Correct the velocities as little as possible so that Phi_q v + Phi_t = 0."""
    weights = system.coordinate_weights()
    jacobian, _, rate = system.constraint_jacobian(configuration, t)
    if jacobian.shape[0] == 0:
        return configuration
    return configuration.pushed(least_correction(jacobian, weights, rate))


def check_inertia(system: BaseSystem) -> None:
    """Raise if the mass or inertia of a body is not finite."""
    for name, row in zip(system.body_names, system.model.bodies[1:]):
        if not np.all(np.isfinite(row)):
            raise SingularModelError(f"body '{name}': mass or inertia is not finite")


# Rotations prescribed far from where their joints are drawn.
#
# The equation of a prescribed rotation is the sine of what the joint's angle lacks. It vanishes half a turn off, too,
# and from a quarter of a turn on the nearest position that satisfies it is that one. Bodies are then turned in steps.


@dataclass(frozen=True)
class Turn:
    """A prescribed rotation: its row, the joint's angle as it is and what it lacks, -pi to pi, rad."""

    row: int
    angle: float
    missing: float

    @property
    def opposite(self) -> bool:
        """Whether the x axes are nearer to opposite than to each other.

        Where they are drawn so, a motion holds them opposite: the markers' axes were chosen without regard to it.
        """
        return abs(self.angle) > 0.5 * np.pi


def prescribed_turns(
    system: BaseSystem, configuration: Configuration, jacobian: Columns, phi: np.ndarray
) -> list[Turn]:
    """Return the prescribed rotations at a configuration whose constraint Jacobian and Phi are given."""
    model = system.model
    found = []
    for row, span in enumerate(model.spans):
        first = span.start
        # rows given by an expression have no terms
        if span.stop == first or model.terms[first, T.TERM_TYPE] != ROTATION:
            continue
        (i, body_i), (j, body_j) = (
            _axes(model, configuration, int(model.terms[first, m])) for m in (T.TERM_I, T.TERM_J)
        )
        # one of the bodies moves: its rotation about the axis changes the sine by the cosine
        body, sense = (body_i, 1.0) if body_i > 0 else (body_j, -1.0)
        columns = POSE_PLACES * (body - 1) + 3 + np.arange(3)
        cosine = sense * float(jacobian.entries(row, columns) @ j[:, 2])
        angle = float(np.arctan2(i[:, 0] @ j[:, 1], i[:, 0] @ j[:, 0]))
        found.append(Turn(row, angle, float(np.arctan2(-phi[row], cosine))))
    return found


def _axes(model: Model, configuration: Configuration, marker: int) -> tuple[np.ndarray, int]:
    """Return the axes of a marker in global components, as columns, and its body; of a modal body the undeformed."""
    body = int(model.marker_body[marker])
    if body >= len(model.bodies):
        body = model.frame_body[body - len(model.bodies)]
    axes = model.marker_frame[marker, 3:].reshape(3, 3)
    return (axes if body == 0 else configuration.pose[body - 1, POSE_A:POSE_V].reshape(3, 3) @ axes), body


def stages(system: BaseSystem, turns: list[Turn]) -> Iterator[Assembler]:
    """Yield the equations with these rotations held at angles from the drawn ones to those prescribed, in steps."""
    count = int(np.ceil(max(abs(turn.missing) for turn in turns) / LONGEST_STEP))
    for share in np.linspace(0.0, 1.0, count + 1):
        yield Assembler(_held(system.model, {turn.row: turn.angle + share * turn.missing for turn in turns}))


def _held(model: Model, angles: dict[int, float]) -> Model:
    """Return the model with constant angles (rad) in place of the prescribed ones, by row."""
    terms = model.terms.copy()
    functions = [np.array(model.functions)]
    for k, row in enumerate(angles):
        terms[model.spans[row].start, T.TERM_FUNCTION] = len(model.functions) + k
        functions.append(np.array([[CONSTANT, len(model.function_r) + k]], dtype=np.int64))
    return replace(
        model,
        terms=frozen(terms),
        functions=frozen(np.concatenate(functions)),
        function_r=frozen(np.concatenate([model.function_r, list(angles.values())])),
    )
