"""The energy balance of a solution: work in and out, dissipation, and what is stored.

Powers are evaluated at the output times and integrated by a cubic spline; stored energies come from the
state alone. So the balance tests the integrated motion, not the algebra of one instant.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.force_elements import DISSIPATED, STORED

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution


def energy_balance(solution: Solution) -> xr.Dataset:
    """Return the energies and works of a solution over time, from its first output.

    Parameters
    ----------
    solution : Solution
        Sampled finely enough for its powers to be integrated: several outputs a step of the fastest force.

    Returns
    -------
    Dataset
        In J over ``time``: ``kinetic``, ``gravity`` (potential), ``elastic`` (stored in the force elements that tell
        it, such as contacts); ``work_motion`` (done by prescribed motions), ``work_applied`` (done by all other force
        elements, springs and expression loads among them), ``dissipated_damping``, ``dissipated_friction`` and what
        else elements dissipate (``dissipated_x`` of a diagnostic ``x_power``); ``imbalance``: work in less dissipation
        less change of stored energy; ``work``: sum of |power| over time. Attribute ``relative_imbalance``: the largest
        imbalance over all the work or, where more is exchanged than worked, over the largest change of a stored
        energy; NaN when there is neither.
    """
    t = solution.t
    powers = _powers(solution)
    works = {name: _integral(t, p) for name, p in powers.items()}
    stored = {
        "kinetic": solution.kinetic_energy,
        "gravity": _gravity(solution),
        "elastic": sum((v for _, v in _told(solution, STORED)), np.zeros(t.size)),
    }
    change = sum(e - e[0] for e in stored.values())
    net = works["work_motion"] + works["work_applied"]
    net = net - sum(work for name, work in works.items() if name.startswith("dissipated"))
    size = _integral(t, np.abs(powers["work_motion"])) + _integral(t, np.abs(powers["work_applied"]))
    data = {**stored, **works, "imbalance": net - change, "work": size}
    out = xr.Dataset({name: ("time", values, {"units": "J"}) for name, values in data.items()}, {"time": t})
    turned_over = max(float(size[-1]), *(float(np.ptp(e)) for e in stored.values()))
    largest = float(np.abs(out.imbalance).max())
    out.attrs["relative_imbalance"] = largest / turned_over if turned_over > 0.0 else float("nan")
    return out


def _integral(t: np.ndarray, power: np.ndarray) -> np.ndarray:
    if t.size < 2:
        return np.zeros_like(t)
    from scipy.interpolate import CubicSpline

    work = CubicSpline(t, power).antiderivative()(t)
    return work - work[0]


def _powers(solution: Solution) -> dict[str, np.ndarray]:
    motion = np.einsum("tr,tr->t", solution.multipliers, solution._phi[:, :, 2])
    applied = np.zeros(solution.t.size)
    for k, row in enumerate(solution.system.model.forces):
        if row[T.FORCE_KIND] != T.REACTION and not _accounts(solution, k - row[T.FORCE_PART]):
            applied += _load_power(solution, k, row)
    zero = np.zeros(solution.t.size)
    powers = {"work_motion": motion, "work_applied": applied, "dissipated_damping": zero, "dissipated_friction": zero}
    for name, power in _told(solution, DISSIPATED):
        key = f"dissipated_{name.removesuffix('_power')}"
        powers[key] = powers.get(key, zero) + power
    return powers


def _accounts(solution: Solution, k: int) -> bool:
    """Whether a force element tells what it stores and dissipates, so that the work of its wrench is known."""
    return any(d.role in (STORED, DISSIPATED) for d in solution.system.model.diagnostics[k])


def _told(solution: Solution, role: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the names and values of all diagnostics of a role."""
    for k, diagnostics in enumerate(solution.system.model.diagnostics):
        for c, d in enumerate(diagnostics):
            if d.role == role:
                yield d.name, solution._loads[:, k, 6 + c]


def _load_power(solution: Solution, k: int, row: np.ndarray) -> np.ndarray:
    """Power of a force element: F and N on I's body at marker I, the opposite on J's body at the same point."""
    model = solution.system.model
    force, torque = solution._loads[:, k, 0:3], solution._loads[:, k, 3:6]
    bi, bj = (model.marker_body[row[column]] for column in (T.FORCE_I, T.FORCE_J))
    local = model.marker_frame[row[T.FORCE_I]][:3]
    zero = np.zeros((solution.t.size, 3))
    point = local + zero
    if bi:
        pose_i = solution._pose[:, bi - 1]
        point = pose_i[:, 0:3] + pose_i[:, 3:12].reshape(-1, 3, 3) @ local
    power = np.zeros(solution.t.size)
    for body, sign in ((bi, 1.0), (bj, -1.0)):
        if body:
            pose = solution._pose[:, body - 1]
            velocity = pose[:, 12:15] + np.cross(pose[:, 15:18], point - pose[:, 0:3])
            power += sign * (np.sum(force * velocity, axis=1) + np.sum(torque * pose[:, 15:18], axis=1))
    return power


def _gravity(solution: Solution) -> np.ndarray:
    model = solution.system.model
    masses = model.bodies[1:, T.BODY_MASS]
    return -np.einsum("b,tbc,c->t", masses, solution._pose[:, :, 0:3], model.gravity)
