"""Initial conditions: position, velocity, then acceleration and multipliers; redundant rows set aside.

Positions and velocities are corrected as little as possible in the norm sum |dR|^2 + L^2 |dpi|^2 with a
length L of the mechanism, by Newton's method on the constraints with the exact Jacobian.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import qr
from scipy.sparse import block_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from gearmbs.dae.errors import AssemblyError, SingularModelError

if TYPE_CHECKING:
    from gearmbs.dae.system import System

POSITION_TOLERANCE = 1e-12
RANK_TOLERANCE = 1e-9
MAX_POSITION_ITERATIONS = 50
DENSE_RANK_LIMIT = 3000
"""Rows above which only the sparse factorisation looks for redundancy."""


@dataclass
class InitialReport:
    """What the initial-condition analysis found.

    Attributes
    ----------
    degrees_of_freedom : int
        Coordinates less independent constraint rows.
    redundant : list of str
        Names of the constraint rows set aside because the others imply them.
    position_iterations : int
        Newton iterations of the assembly.
    largest_correction : float
        Largest displacement (m) or rotation (rad) made to assemble the mechanism.
    violation : float
        Largest remaining constraint violation (m or 1).
    """

    degrees_of_freedom: int
    redundant: list[str] = field(default_factory=list)
    position_iterations: int = 0
    largest_correction: float = 0.0
    violation: float = 0.0

    def __str__(self) -> str:
        lines = [f"degrees of freedom: {self.degrees_of_freedom}"]
        if self.redundant:
            lines.append("redundant constraints set aside:")
            lines.extend(f"  {name}" for name in self.redundant)
        lines.append(
            f"assembled in {self.position_iterations} iterations, largest correction "
            f"{self.largest_correction:.3g}, violation {self.violation:.3g}"
        )
        return "\n".join(lines)


def independent_rows(jacobian: csc_array, weights: np.ndarray) -> np.ndarray:
    """Return the indices of a largest set of independent rows of the constraint Jacobian, in order.

    Earlier rows are preferred, so that a redundancy is blamed on the joint added last.
    """
    m = jacobian.shape[0]
    if m == 0:
        return np.zeros(0, dtype=np.int64)
    scaled = csc_array(jacobian @ diags_array(1.0 / np.sqrt(weights)))
    norms = np.sqrt(np.asarray((scaled.multiply(scaled)).sum(axis=1)).ravel())
    norms[norms == 0.0] = 1.0
    scaled = csc_array(diags_array(1.0 / norms) @ scaled)
    if m > DENSE_RANK_LIMIT or m > 400:
        gram = csc_array(scaled @ scaled.T)
        try:
            pivots = np.abs(splu(gram, diag_pivot_thresh=0.0, options={"SymmetricMode": True}).U.diagonal())
            if pivots.min() > RANK_TOLERANCE:
                return np.arange(m)
        except RuntimeError:
            pass
    dense = scaled.toarray()
    r_diagonal = np.abs(np.diag(qr(dense.T, mode="r", pivoting=True)[0]))
    rank = int(np.sum(r_diagonal > RANK_TOLERANCE * max(1.0, r_diagonal[0])))
    if rank == m:
        return np.arange(m)
    return _greedy_rows(dense, rank)


def _greedy_rows(dense: np.ndarray, rank: int) -> np.ndarray:
    """Gram-Schmidt through the rows in order, keeping those that add a direction."""
    basis = np.zeros((rank, dense.shape[1]))
    kept: list[int] = []
    for i, row in enumerate(dense):
        rest = row - basis[: len(kept)].T @ (basis[: len(kept)] @ row)
        rest -= basis[: len(kept)].T @ (basis[: len(kept)] @ rest)
        size = np.linalg.norm(rest)
        if size > 1e3 * RANK_TOLERANCE and len(kept) < rank:
            basis[len(kept)] = rest / size
            kept.append(i)
    return np.array(kept, dtype=np.int64)


def least_correction(jacobian: csc_array, weights: np.ndarray, violation: np.ndarray) -> np.ndarray:
    """Solve min |x|_W subject to jacobian x = -violation."""
    n = jacobian.shape[1]
    kkt = csc_array(block_array([[diags_array(weights), jacobian.T], [jacobian, None]]))
    rhs = np.concatenate([np.zeros(n), -violation])
    try:
        return splu(kkt).solve(rhs)[:n]
    except RuntimeError as error:
        raise AssemblyError(
            "the constraints became dependent while the mechanism was being assembled: "
            "it is near a position where it locks; move the bodies closer to a position that satisfies the joints"
        ) from error


def assemble_position(system: System, pose: np.ndarray, t: float) -> tuple[np.ndarray, InitialReport]:
    """Move the bodies as little as possible onto the constraints; set redundant rows of ``system`` aside.

    Parameters
    ----------
    pose : ndarray, shape (bodies, 18)
        R, A (row-major), v, omega of each moving body.
    """
    weights = system.coordinate_weights()
    jacobian, phi, _ = system.constraint_jacobian(pose, t)
    kept = independent_rows(jacobian, weights)
    report = InitialReport(degrees_of_freedom=jacobian.shape[1] - kept.size)
    dropped = np.setdiff1d(np.arange(jacobian.shape[0]), kept)
    report.redundant = [system.row_names[i] for i in dropped]
    start = pose.copy()
    length = np.sqrt(weights[3]) if weights.size else 1.0
    for iteration in range(MAX_POSITION_ITERATIONS):
        size = np.abs(phi[kept]).max(initial=0.0)
        if not np.isfinite(size):
            raise AssemblyError("the constraint values are not finite: check the markers' positions for NaN")
        if size <= POSITION_TOLERANCE * max(1.0, length):
            break
        step = least_correction(csc_array(jacobian[kept]), weights, phi[kept])
        turn = np.abs(step.reshape(-1, 6)[:, 3:]).max(initial=0.0)
        pose = system.displaced(pose, step * min(1.0, 0.5 / max(turn, 1e-300)))
        jacobian, phi, _ = system.constraint_jacobian(pose, t)
        report.position_iterations = iteration + 1
    else:
        if size > 1e-9 * max(1.0, length):
            worst = kept[np.argmax(np.abs(phi[kept]))]
            raise AssemblyError(
                f"the mechanism cannot be assembled: after {MAX_POSITION_ITERATIONS} iterations "
                f"{system.row_names[worst]} is still violated by {abs(phi[worst]):.3g}; "
                "check the lengths and the markers of that joint"
            )
    if dropped.size and np.abs(phi[dropped]).max() > 1e-7 * max(1.0, length):
        worst = dropped[np.argmax(np.abs(phi[dropped]))]
        raise AssemblyError(
            f"conflicting constraints: {system.row_names[worst]} is implied by the other joints but they leave it "
            f"violated by {abs(phi[worst]):.3g}; correct the markers or remove one of the joints"
        )
    report.violation = float(np.abs(phi).max(initial=0.0))
    report.largest_correction = float(np.abs(pose - start)[:, :12].max(initial=0.0))
    system.keep_rows(kept)
    return pose, report


def consistent_velocity(system: System, pose: np.ndarray, t: float) -> np.ndarray:
    """Correct v and omega as little as possible so that Phi_q v + Phi_t = 0."""
    weights = system.coordinate_weights()
    jacobian, _, rate = system.constraint_jacobian(pose, t)
    if jacobian.shape[0] == 0:
        return pose
    step = least_correction(jacobian, weights, rate)
    pose = pose.copy()
    pose[:, 12:18] += step.reshape(-1, 6)
    return pose


def check_inertia(system: System) -> None:
    """Raise if a body that can move freely in some direction has no inertia there."""
    for name, row in zip(system.body_names, np.asarray(system.builder.bodies)[1:]):
        if not np.all(np.isfinite(row)):
            raise SingularModelError(f"body '{name}': mass or inertia is not finite")
