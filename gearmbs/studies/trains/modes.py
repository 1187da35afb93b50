"""Modes of a whole drivetrain under its load, and its Campbell diagram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Drivetrain, SpeedDrive, TorqueLoad
from gearmbs.drivetrain.torsional import warn_of_overdamped_meshes
from gearmbs.mechanism import linear_modes, static_equilibrium
from gearmbs.mechanism.parts.functions import constant

if TYPE_CHECKING:
    from gearmbs.dae.analyses.modes import Modes


def resting(train: Drivetrain) -> Drivetrain:
    """Return a drivetrain at rest under the loads of its operating point, without friction, its drives holding it."""
    drives = [
        SpeedDrive(name=drive.name, shaft=drive.shaft, speed=drive.speed, station=drive.station, on=drive.on,
                   function=constant(0.0))
        for drive in train.drives
    ]  # fmt: skip
    loads = [
        TorqueLoad(name=load.name, shaft=load.shaft, station=load.station, on=load.on,
                   torque=load.nominal(abs(train.speeds[load.shaft])))
        for load in train.loads
    ]  # fmt: skip
    # flanks that rest on each other would stick
    meshes = [replace(mesh, settings={**mesh.settings, "friction": False}) for mesh in train.meshes]
    return replace(train, drives=drives, loads=loads, meshes=meshes, running=False)


def train_modes(train: Drivetrain) -> Modes:
    """Return the modes of a whole drivetrain about its position of rest under the operating torques.

    Tooth contacts have the stiffness of the pairs that touch there, and no friction. Shafts of prescribed speed are
    held; other drives hold the train while it comes to rest, and then give way to the torque they held it with. Where a
    corner of a tooth touches, the ratio of torques is another at the next angle: rigid rotation then has a frequency.

    Parameters
    ----------
    train : Drivetrain

    Returns
    -------
    Modes
        See `gearmbs.mechanism.linear_modes`.

    Raises
    ------
    ModelError
        If no position of rest is found.

    Warns
    -----
    UserWarning
        Of meshes that are damped above critical: their modes do not oscillate.
    """
    warn_of_overdamped_meshes(train)
    still = resting(train)
    m = still.build()
    after = 2.0 * still.run_up
    rest = static_equilibrium(m, t=after, move=True)
    for drive in train.drives:
        if not isinstance(drive, SpeedDrive):
            held = m.joints.pop(drive.name)
            torque = float(rest.solution.reaction(drive.name)[1][-1] @ held.j.global_orientation()[:, 2])
            m.axis_torque(drive.name, held.i, held.j, torque)
    return linear_modes(m, t=after)


def mesh_orders(train: Drivetrain, harmonics: int = 2) -> dict[str, float]:
    """Return the mesh harmonics of a drivetrain as multiples of its first drive's speed, by name."""
    turns = train.kinematics.shaft_frequency(train.drives[0].shaft)
    return {
        f"{h} x {mesh.name}": h * train.kinematics.mesh_frequency(mesh.name) / turns
        for mesh in train.meshes
        for h in range(1, harmonics + 1)
    }


def train_campbell(
    train: Drivetrain, speeds: Sequence[Any] | None = None, *, harmonics: int = 2, maximum: float = 2000.0
) -> xr.Dataset:
    """Return the Campbell diagram of a drivetrain: its modes under load against the speed of its first drive.

    The modes are those at rest: of what turns slowly against its bending frequencies the gyroscopic moments count
    little.

    Parameters
    ----------
    train : Drivetrain
    speeds : sequence, optional
        Of the first drive, rad/s or text; default 0 to 1.2 of the operating speed.
    harmonics : int
        Mesh harmonics that excite.
    maximum : float
        Modes and crossings up to this frequency, Hz.

    Returns
    -------
    Dataset
        See `gearmbs.signals.campbell`; its attribute ``operating_speed`` is that of the first drive, rad/s. Draw it by
        `gearmbs.view.campbell_plot`.
    """
    from gearmbs.signals import campbell

    turned = np.linspace(0.0, 1.2 * abs(train.drives[0].speed), 13) if speeds is None else speeds
    found = campbell(train_modes(train), turned, mesh_orders(train, harmonics), maximum=maximum)
    return found.assign_attrs(operating_speed=abs(train.drives[0].speed))
