"""The power flow of a drivetrain: torques of meshes, couplings and planetary stages at the operating point.

Of a chain without branches they follow from equilibrium alone. With x the torques of all links, each column of A the
torques of one of them on all shafts, and b the loads, A x = -b; a closed chain leaves the null space N of A open,
x = x_0 + N y. There y is that of the least energy of equally stiff teeth, min sum x_k^2 / k_k (Castigliano), or what
comes nearest to the torques of the meshes in the loaded position of rest, which knows backlash, phases, the twist and
bending of shafts and the give of bearings.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg

from gearmbs.drivetrain.couplings.aligned import is_rigid
from gearmbs.drivetrain.kinematics import Link, links, walk
from gearmbs.drivetrain.parts import GearMesh
from gearmbs.drivetrain.planetary import (
    PlanetaryStage,
    balanced_torques,
    columns_of,
    differentials,
    member_torques,
)
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

MEAN_TEETH = 20e9
"""Mesh stiffness c_gamma of steel wheels, N/m per m of face, where nothing else is known: 20 N/(mm um), ISO 6336-1."""
STIFF = 1e12
"""Torsional stiffness of a rigid coupling beside that of teeth, N m/rad: far above any of theirs."""
OPEN = 1e-9
"""Part of a unit vector above which a link belongs to a closed chain: rounding of the null space is far below."""


@dataclass(frozen=True)
class PowerFlow:
    """Torques at the operating point, from the loads to the drives, without losses.

    Attributes
    ----------
    torques : dict of str to (float, float)
        On the first and on the second shaft of each mesh (the driver's and the driven's) and coupling, about their z
        axes, N m.
    pushing : dict of str to str
        Of each mesh, the shaft whose wheel pushes.
    senses : dict of str to int
        Of each mesh, the sense in which the driver turns about z.
    drivers : dict of str to str
        Of each mesh, the driver's shaft.
    drive : dict of str to float
        Torque of the drive of each train about its shaft, N m, by the drive's name.
    members : dict of str to dict of str to float
        Of each planetary stage, the torques of its planets on sun, carrier and ring about the axis, N m.
    shared : tuple of str
        Links of closed chains, whose torques equilibrium alone does not tell.
    shared_by : str
        Where those are from: ``"rest"``, the loaded position of rest, or ``"equal teeth"``; ``""`` without any.
    """

    torques: dict[str, tuple[float, float]]
    pushing: dict[str, str]
    senses: dict[str, int]
    drivers: dict[str, str]
    drive: dict[str, float]
    members: dict[str, dict[str, float]] = field(default_factory=dict)
    shared: tuple[str, ...] = ()
    shared_by: str = ""

    def rotation(self, mesh: str) -> int:
        """Return the ``rotation`` of a mesh's pair: the driver's sense, or its opposite if the driven wheel pushes."""
        return self.senses[mesh] * (1 if self.pushing[mesh] == self.drivers[mesh] else -1)

    def on_driven(self, mesh: str) -> float:
        """Return the size of the torque on the driven wheel of a mesh, N m."""
        return abs(self.torques[mesh][1])


def power_flow(train: Drivetrain) -> PowerFlow:
    """Return the torques of a drivetrain at its operating point; branches of closed chains share as equal teeth do."""
    speeds = train.speeds
    first_of = {link.name: link.first for link in links(train)}
    applied = dict.fromkeys(speeds, 0.0)
    for load in train.loads:
        sense = -1.0 if speeds[load.shaft] < 0.0 else 1.0
        resisting = sense * load.nominal(abs(speeds[load.shaft]))
        applied[load.shaft] -= resisting
        if load.on in applied:
            applied[load.on] += resisting
    torques: dict[str, tuple[float, float]] = {}
    pushing: dict[str, str] = {}
    driven_by: dict[str, float] = {}
    done: set[str] = set()
    roots = [drive.shaft for drive in train.drives] + [shaft.name for shaft in train.shafts]
    for root in roots:
        if root in done:
            continue
        done.add(root)
        found = list(walk(train, root))
        rest = dict(applied)
        for link, new in reversed(found):
            done.add(link.second)
            on_second = -rest[link.second] if new else 0.0
            on_first = -on_second * link.ratio
            rest[link.first] += on_first
            forward = first_of[link.name] == link.first
            torques[link.name] = (on_first, on_second) if forward else (on_second, on_first)
            pushing[link.name] = link.first if on_second * speeds[link.second] >= 0.0 else link.second
        for drive in train.drives:
            if drive.shaft == root:
                driven_by.setdefault(drive.name, -rest[root])
    members: dict[str, dict[str, float]] = {}
    if differentials(train):
        torques, members, driven_by = balanced_torques(train, links(train), applied)
        for link in links(train):
            drives = torques[link.name][1] * speeds[link.second] >= 0.0
            pushing[link.name] = link.first if drives else link.second
    members |= member_torques(train, torques)
    drivers = {mesh.name: train.wheels_of(mesh)[0].shaft for mesh in train.meshes}
    senses = {name: -1 if speeds[shaft] < 0.0 else 1 for name, shaft in drivers.items()}
    flow = PowerFlow(torques, pushing, senses, drivers, driven_by, members)
    return _with_shares(train, flow, None)


def loaded_flow(train: Drivetrain) -> PowerFlow:
    """Return the torques at the operating point; branches of closed chains share as in the loaded position of rest.

    Warns
    -----
    UserWarning
        Where there is none, so that they share as equal teeth do.
    """
    flow = train.nominal_power
    if not flow.shared:
        return flow
    # positions of rest need the contact kernels
    from gearmbs.drivetrain.static.rest import mean_torques

    measured, trouble = mean_torques(train)
    if trouble:
        warn(
            f"drivetrain '{train.name}': equilibrium alone does not tell how {', '.join(map(repr, flow.shared))} share "
            f"the load of a closed chain, and no position of rest was found ({trouble}): their torques are those "
            "of equally stiff teeth without backlash"
        )
        return flow
    return _with_shares(train, flow, measured)


def _with_shares(train: Drivetrain, flow: PowerFlow, measured: dict[str, float] | None) -> PowerFlow:
    """Return a power flow with other torques of what closes chains.

    Parameters
    ----------
    measured : dict of str to float, optional
        Torques on the driven wheels of meshes about their axes, N m; without it those of equal teeth.
    """
    ties, stages = links(train), differentials(train)
    columns = columns_of(train, ties)
    if not columns:
        return flow
    names = [link.name for link in ties] + [stage.name for stage in stages]
    # columns of one size: of ratios far from 1 rounding would be taken for a closed chain
    sizes = np.array([np.linalg.norm(column) for column in columns])
    open_ways = scipy.linalg.null_space(np.array(columns).T / sizes) / sizes[:, None]
    reach = np.abs(open_ways * sizes[:, None]).max(axis=1, initial=0.0)
    if open_ways.shape[1] == 0 or not np.any(reach > OPEN):
        return flow
    shared = tuple(name for name, part in zip(names, reach) if part > OPEN)
    units = {stage.name: stage.gears.torques(sun=1.0)["sun"] for stage in stages}
    known = np.array([flow.torques[link.name][1] for link in ties]
                     + [flow.members[stage.name]["sun"] / units[stage.name] for stage in stages])  # fmt: skip
    if measured is None:
        root = np.array([_softness(train, link) for link in ties] + [_softness(train, stage) for stage in stages])
        wanted, rows = -root * known, root[:, None] * open_ways
    else:
        told = np.array([name in measured for name in names])
        wanted = np.array([measured[name] for name in names if name in measured]) - known[told]
        rows = open_ways[told]
    found = known + open_ways @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
    torques = {link.name: (float(-link.ratio * x), float(x)) for link, x in zip(ties, found)}
    pushing = dict(flow.pushing)
    for link, x in zip(ties, found):
        if link.name in shared and x != 0.0:
            pushing[link.name] = link.first if x * train.speeds[link.second] >= 0.0 else link.second
    members = {
        stage.name: {m: float(x) * t for m, t in stage.gears.torques(sun=1.0).items()}
        for stage, x in zip(stages, found[len(ties) :])
    }
    return replace(
        flow, torques=torques, pushing=pushing, members=members | member_torques(train, torques), shared=shared,
        shared_by="equal teeth" if measured is None else "rest",
    )  # fmt: skip


def _softness(train: Drivetrain, link: Link | PlanetaryStage) -> float:
    """Return the square root of the compliance of a link by its torque on the second shaft, (N m/rad)^(-1/2)."""
    part = train.parts[link.name]
    if isinstance(part, GearMesh):
        one, two = (wheel.gear for wheel in train.wheels_of(part))
        return float((MEAN_TEETH * min(one.face_width, two.face_width)) ** -0.5 / two.base_radius)
    if isinstance(part, PlanetaryStage):
        gears = part.gears
        teeth = MEAN_TEETH * gears.planets * min(gears.sun.face_width, gears.planet.face_width)
        return float(teeth**-0.5 / gears.sun.base_radius)
    stiffness = STIFF if is_rigid(part) else getattr(part, "tangent", STIFF)
    return float(max(stiffness, 1e-12 * STIFF) ** -0.5)
