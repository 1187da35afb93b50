"""The energy balance of a solution: work in and out, dissipation, and what is stored.

Powers are evaluated at the output times and integrated by a cubic spline; stored energies come from the
state alone. So the balance tests the integrated motion, not the algebra of one instant. Outputs that are too far apart
for the powers are found by integrating over every second of them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.loads.forces import DISSIPATED, STORED
from gearmbs.dae.equations.rotation import KIN_A, KIN_R, KIN_V, KIN_W
from gearmbs.dae.model.kinetic import kinetic_energy as energy_of_poses
from gearmbs.dae.results.frames import Evaluated, frame_motion
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.dae.equations.bodies.inertia import ModalInertia

JOINT_FRICTION = "dissipated_joint_friction"
COARSE = 0.01
"""Share of the work by which works may differ between all outputs and every second of them. Where outputs follow the
powers, a cubic spline errs 16 times less with all of them, so that works are right to about a thousandth."""


def energy_balance(found: Evaluated, frictions: Collection[int] = ()) -> xr.Dataset:
    """Return the energies and works of a solution over time, from its first output.

    Parameters
    ----------
    found : Evaluated
        Sampled finely enough for its powers to be integrated: several outputs a period of the fastest force.
    frictions : collection of int
        Numbers of the force elements that are friction of joints.

    Returns
    -------
    Dataset
        In J over ``time``: ``kinetic``, ``gravity`` (potential), ``elastic`` (strain energy of modal bodies, and what
        force elements tell, such as contacts); ``work_motion`` (done by prescribed motions), ``work_applied`` (done by
        all other force elements, springs and expression loads among them), ``dissipated_damping``,
        ``dissipated_friction`` and what else elements dissipate (``dissipated_x`` of a diagnostic ``x_power``), with
        friction in joints ``dissipated_joint_friction`` (less what its stiction gives back);
        ``imbalance``: work in less dissipation less change of stored energy; ``work``: sum of |power| over time.
        Attributes: ``relative_imbalance``, the largest imbalance over all the work or, where more is exchanged than
        worked, over the largest change of a stored energy; NaN when there is neither. ``relative_coarseness``, the
        largest difference of a work from that over every second output, over the same.

    Warns
    -----
    UserWarning
        If ``relative_coarseness`` is more than 1 %: works may then not be those of the run.
    """
    t = found.t
    powers = _powers(found, frictions)
    works = {name: _integral(t, p) for name, p in powers.items()}
    stored = {
        "kinetic": kinetic_energy(found),
        "gravity": _gravity(found),
        "elastic": sum((v for _, v in _diagnostics_of(found, STORED)), _strain(found)),
    }
    change = sum(e - e[0] for e in stored.values())
    net = works["work_motion"] + works["work_applied"]
    net = net - sum(work for name, work in works.items() if name.startswith("dissipated"))
    working = [powers[name] for name in ("work_motion", "work_applied", JOINT_FRICTION) if name in powers]
    size = sum((_integral(t, np.abs(power)) for power in working), np.zeros_like(t))
    data = {**stored, **works, "imbalance": net - change, "work": size}
    out = xr.Dataset({name: ("time", values, {"units": "J"}) for name, values in data.items()}, {"time": t})
    turned_over = max(float(size[-1]), *(float(np.ptp(e)) for e in stored.values()))
    largest = float(np.abs(out.imbalance).max())
    if turned_over == 0.0:
        out.attrs |= {"relative_imbalance": float("nan"), "relative_coarseness": float("nan")}
        return out
    coarse = max(_coarseness(t, power, works[name]) for name, power in powers.items()) / turned_over
    out.attrs |= {"relative_imbalance": largest / turned_over, "relative_coarseness": coarse}
    if coarse > COARSE:
        warn(
            f"energy balance: works over every second output differ by {100.0 * coarse:.3g} % of the work from those "
            f"over all {t.size}: the outputs are too far apart for the powers to be integrated; do not trust works, "
            "dissipation and imbalance, and give simulate a higher rate, or every_step=True"
        )
    return out


def _coarseness(t: np.ndarray, power: np.ndarray, work: np.ndarray) -> float:
    """Return the largest difference of a work from that over the even or the odd outputs, J."""
    found = 0.0
    for first in (0, 1):
        if t[first::2].size > 1:
            rest = _integral(t[first::2], power[first::2]) - (work[first::2] - work[first])
            found = max(found, float(np.abs(rest).max()))
    return found


def _integral(t: np.ndarray, power: np.ndarray) -> np.ndarray:
    if t.size < 2:
        return np.zeros_like(t)
    from scipy.interpolate import CubicSpline

    work = CubicSpline(t, power).antiderivative()(t)
    return work - work[0]


def _powers(found: Evaluated, frictions: Collection[int]) -> dict[str, np.ndarray]:
    motion = np.einsum("tr,tr->t", found.records.multipliers, found.records.by_row[:, :, 2])
    applied, slipping = np.zeros(found.t.size), np.zeros(found.t.size)
    kin, _ = frame_motion(found)
    for k, row in enumerate(found.model.forces):
        if row[T.FORCE_KIND] != T.REACTION and not _accounts(found, k - row[T.FORCE_PART]):
            power = _load_power(found, kin, k, row)
            if k - row[T.FORCE_PART] in frictions:
                slipping -= power
            else:
                applied += power
    zero = np.zeros(found.t.size)
    powers = {"work_motion": motion, "work_applied": applied, "dissipated_friction": zero}
    powers["dissipated_damping"] = _modal_damping(found)
    if frictions:
        powers[JOINT_FRICTION] = slipping
    for name, power in _diagnostics_of(found, DISSIPATED):
        key = f"dissipated_{name.removesuffix('_power')}"
        powers[key] = powers.get(key, zero) + power
    return powers


def _accounts(found: Evaluated, k: int) -> bool:
    """Whether a force element tells what it stores and dissipates, so that the work of its wrench is known."""
    return any(d.role in (STORED, DISSIPATED) for d in found.model.diagnostics[k])


def _diagnostics_of(found: Evaluated, role: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the names and values of all diagnostics of a role."""
    for k, diagnostics in enumerate(found.model.diagnostics):
        for c, d in enumerate(diagnostics):
            if d.role == role:
                yield d.name, found.records.loads[:, k, 6 + c]


def _load_power(found: Evaluated, kin: np.ndarray, k: int, row: np.ndarray) -> np.ndarray:
    """Power of a force element: F and N on I's body at marker I, the opposite on J's body at the same point.

    ``kin`` holds the motion of all frames, see `gearmbs.dae.results.frames`.
    """
    model = found.model
    force, torque = found.records.loads[:, k, 0:3], found.records.loads[:, k, 3:6]
    bi, bj = (int(model.marker_body[row[column]]) for column in (T.FORCE_I, T.FORCE_J))
    local = model.marker_frame[row[T.FORCE_I]][:3]
    point = kin[:, bi, KIN_R : KIN_R + 3] + kin[:, bi, KIN_A : KIN_A + 9].reshape(-1, 3, 3) @ local
    power = np.zeros(found.t.size)
    for body, sign in ((bi, 1.0), (bj, -1.0)):
        if body:
            place, spin = kin[:, body, KIN_R : KIN_R + 3], kin[:, body, KIN_W : KIN_W + 3]
            velocity = kin[:, body, KIN_V : KIN_V + 3] + np.cross(spin, point - place)
            power += sign * (np.sum(force * velocity, axis=1) + np.sum(torque * spin, axis=1))
    return power


def _modal_damping(found: Evaluated) -> np.ndarray:
    """Power dissipated by the damping of modal bodies."""
    return _over_modal_bodies(found, lambda modal, q_f, v_f: modal.damping_power(v_f))


def _strain(found: Evaluated) -> np.ndarray:
    """Strain energy of modal bodies."""
    return _over_modal_bodies(found, lambda modal, q_f, v_f: modal.strain_energy(q_f))


def _over_modal_bodies(
    found: Evaluated, of_body: Callable[[ModalInertia, np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    model, total = found.model, np.zeros(found.t.size)
    for b, modal in enumerate(model.modal_inertia):
        if modal is not None:
            q_f, v_f, _ = found.modal(b)
            total = total + of_body(modal, q_f, v_f)
    return total


def kinetic_energy(found: Evaluated) -> np.ndarray:
    """Return the kinetic energy over time, shape (m,), J."""
    return energy_of_poses(found.records.pose, found.model)


def _gravity(found: Evaluated) -> np.ndarray:
    model = found.model
    masses = model.bodies[1:, T.BODY_MASS]
    return -np.einsum("b,tbc,c->t", masses, found.records.by_body[:, :, 0:3], model.gravity)
