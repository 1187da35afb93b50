"""Speeds of all shafts from the drives, torques of meshes and couplings from the loads, who pushes, and weak drives."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from gearmbs.drivetrain.drives import Drive, SpeedDrive
from gearmbs.drivetrain.errors import DrivetrainError, require
from gearmbs.drivetrain.loads import Drag, Load
from gearmbs.drivetrain.parts import Shaft

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

RPM = 9.549296585513721
SAME_SPEED = 1e-9
"""Relative difference of speeds that are one."""
BALANCED = 0.99
"""Part of the load's torque that a drive must reach: a drive that just balances its load is given in round numbers."""


class Link(NamedTuple):
    """A mesh or coupling between two shafts: the second turns ``ratio`` times as fast as the first."""

    name: str
    first: str
    second: str
    ratio: float

    def reversed(self) -> Link:
        """The same seen from the second shaft."""
        return Link(self.name, self.second, self.first, 1.0 / self.ratio)


def links(train: Drivetrain) -> list[Link]:
    """Return what ties the speeds of shafts together."""
    out = []
    for coupling in train.couplings:
        for shaft in (coupling.first, coupling.second):
            train.part(shaft, Shaft, coupling.label)
        out.append(Link(coupling.name, coupling.first, coupling.second, 1.0))
    for mesh in train.meshes:
        driver, driven = train.wheels_of(mesh)
        sign = driver.gear.sign * driven.gear.sign
        out.append(Link(mesh.name, driver.shaft, driven.shaft, -sign * driver.gear.teeth / driven.gear.teeth))
    return out


def walk(train: Drivetrain, start: str) -> Iterator[tuple[Link, bool]]:
    """Yield the links reachable from a shaft, outwards, and whether each leads to a shaft not met before."""
    around: dict[str, list[Link]] = {shaft.name: [] for shaft in train.shafts}
    for link in links(train):
        around[link.first].append(link)
        around[link.second].append(link.reversed())
    met, used, waiting = {start}, set(), deque([start])
    while waiting:
        for link in around[waiting.popleft()]:
            if link.name in used:
                continue
            used.add(link.name)
            new = link.second not in met
            if new:
                met.add(link.second)
                waiting.append(link.second)
            yield link, new


def operating_speeds(train: Drivetrain) -> dict[str, float]:
    """Return the speed of each shaft, rad/s.

    Raises
    ------
    DrivetrainError
        If drives or closed chains give one shaft two speeds.
    """
    speeds: dict[str, float] = {}
    given_by: dict[str, str] = {}
    prescribed: dict[str, str] = {}
    for drive in train.drives:
        train.part(drive.shaft, Shaft, drive.label)
        _agree(train, drive.shaft, drive.speed, speeds, given_by, drive.label)
        new = drive.shaft not in speeds
        speeds[drive.shaft] = drive.speed
        given_by.setdefault(drive.shaft, drive.label)
        if isinstance(drive, SpeedDrive):
            require(
                drive.shaft not in prescribed,
                f"{drive.label}: {prescribed.get(drive.shaft)} prescribes the speed of shaft '{drive.shaft}' too; "
                "leave one of them out, or make one a motor",
            )
            prescribed[drive.shaft] = drive.label
        for link, first_time in walk(train, drive.shaft):
            speed = speeds[link.first] * link.ratio
            if first_time and (new or link.second not in speeds):
                speeds.setdefault(link.second, speed)
                given_by.setdefault(link.second, drive.label)
            _agree(train, link.second, speed, speeds, given_by, f"'{link.name}'")
            if isinstance(drive, SpeedDrive) and first_time:
                other = prescribed.setdefault(link.second, drive.label)
                require(other == drive.label, f"{drive.label} and {other} both prescribe the speed of one train; "
                        "make one of them a motor")  # fmt: skip
    return {shaft.name: speeds.get(shaft.name, 0.0) for shaft in train.shafts}


def _agree(
    train: Drivetrain, shaft: str, speed: float, speeds: dict[str, float], given_by: dict[str, str], label: str
) -> None:
    known = speeds.get(shaft)
    if known is None or abs(known - speed) <= SAME_SPEED * max(abs(known), abs(speed)):
        return
    raise DrivetrainError(
        f"{label}: shaft '{shaft}' would have two speeds, {speed * RPM:.6g} rpm and {known * RPM:.6g} rpm from "
        f"{given_by[shaft]}; change the teeth, or leave one of them out"
    )


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
    """

    torques: dict[str, tuple[float, float]]
    pushing: dict[str, str]
    senses: dict[str, int]
    drivers: dict[str, str]
    drive: dict[str, float]

    def rotation(self, mesh: str) -> int:
        """Return the ``rotation`` of a mesh's pair: the driver's sense, or its opposite if the driven wheel pushes."""
        return self.senses[mesh] * (1 if self.pushing[mesh] == self.drivers[mesh] else -1)

    def on_driven(self, mesh: str) -> float:
        """Return the size of the torque on the driven wheel of a mesh, N m."""
        return abs(self.torques[mesh][1])


def power_flow(train: Drivetrain) -> PowerFlow:
    """Return the torques of a drivetrain at its operating point.

    Trees are exact. Of a closed chain the last link found carries nothing here.
    """
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
    drivers = {mesh.name: train.wheels_of(mesh)[0].shaft for mesh in train.meshes}
    senses = {name: -1 if speeds[shaft] < 0.0 else 1 for name, shaft in drivers.items()}
    return PowerFlow(torques, pushing, senses, drivers, driven_by)


def warn_of_weak_drives(train: Drivetrain, stacklevel: int = 3) -> None:
    """Warn of drives whose largest torque is less than that of the loads on their shaft, at speed or from rest.

    Torques are those of the operating point without losses, see `PowerFlow`. Nothing is said
    where a drive prescribes the speed, or a torque is a function of time.

    Warns
    -----
    UserWarning
        With the drive, both torques and the remedy.
    """
    done: set[str] = set()
    for first in train.drives:
        if first.shaft in done:
            continue
        reached = {first.shaft}
        for link, _ in walk(train, first.shaft):
            reached |= {link.first, link.second}
        done |= reached
        drives = [drive for drive in train.drives if drive.shaft in reached]
        sense = -1.0 if first.speed < 0.0 else 1.0
        needed = sense * train.power.drive.get(first.name, 0.0)
        message = _too_weak(train, drives, needed) or _never_starts(train, drives, reached)
        if message is not None:
            warnings.warn(message, stacklevel=stacklevel)


def _too_weak(train: Drivetrain, drives: list[Drive], needed: float) -> str | None:
    """Return what is said of drives that cannot hold their loads at the operating speed, as torques on the first."""
    first = drives[0]
    torques = [drive.largest_torque() for drive in drives]
    if first.speed == 0.0 or any(torque is None for torque in torques):
        return None
    # at one power, torques of other shafts are as their speeds
    reached = sum(t * abs(drive.speed / first.speed) for t, drive in zip(torques, drives) if t is not None)
    if reached >= BALANCED * needed:
        return None
    others = "" if len(drives) == 1 else f" and {', '.join(repr(d.name) for d in drives[1:])} together"
    return (
        f"{first.label}{others}: the largest torque is {reached:.5g} N m, but the loads need {needed:.5g} N m on shaft "
        f"'{first.shaft}' at {abs(first.speed) * RPM:.5g} rpm: the speed will fall away; give a stronger drive, or "
        "less load"
    )


def _never_starts(train: Drivetrain, drives: list[Drive], reached: set[str]) -> str | None:
    """Return what is said of a drive whose torque at standstill is less than that of the loads there."""
    first = drives[0]
    torque = first.starting_torque()
    if train.running or len(drives) > 1 or first.speed == 0.0 or torque is None:
        return None
    needed = sum(
        load.nominal(0.0) * abs(train.speeds[load.shaft] / first.speed)
        for load in train.loads
        if load.shaft in reached and load.on not in reached
    )
    if torque >= BALANCED * needed:
        return None
    return (
        f"{first.label}: its torque at standstill is {torque:.5g} N m, but the loads need {needed:.5g} N m on shaft "
        f"'{first.shaft}': it will not start; give running=True, a stronger drive, or a load that grows with the speed"
    )


def warn_of_lost_torques(train: Drivetrain, stacklevel: int = 3) -> None:
    """Warn of torques on shafts whose speed is prescribed, which change nothing but the torque of that drive.

    Nothing is said of drag, whose place is there, and of shafts that meshes and elastic couplings lead to.

    Warns
    -----
    UserWarning
        With the drive or load, its torque and the remedy.
    """
    for holder in (drive for drive in train.drives if isinstance(drive, SpeedDrive)):
        fixed = {holder.shaft}
        for link, _ in walk(train, holder.shaft):
            if link.first in fixed and getattr(train.parts[link.name], "kind", "") == "rigid":
                fixed.add(link.second)
        parts: list[tuple[Drive | Load, float | None]] = [
            *((drive, drive.largest_torque()) for drive in train.drives if not isinstance(drive, SpeedDrive)),
            *((load, load.nominal(abs(train.speeds[load.shaft]))) for load in train.loads),
        ]
        for part, torque in parts:
            if part.shaft not in fixed or torque == 0.0 or isinstance(part, Drag):
                continue
            size = "" if torque is None else f" of {torque:.5g} N m"
            warnings.warn(
                f"{part.label}: its torque{size} is on shaft '{part.shaft}', whose speed {holder.label} prescribes: no "
                "mesh and no motion feels it; put it on a shaft that meshes or couplings drive, or leave it out",
                stacklevel=stacklevel,
            )
