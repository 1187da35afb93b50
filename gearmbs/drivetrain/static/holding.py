"""Whether bearings hold shafts in all motions but their rotation, and mounts a housing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.drivetrain.couplings.misaligned import roles
from gearmbs.drivetrain.housing import Housing
from gearmbs.drivetrain.on_shafts import check_thrust
from gearmbs.drivetrain.part import DrivetrainError, require
from gearmbs.drivetrain.placement import Seat
from gearmbs.drivetrain.shaft import Shaft

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

HELD = 1e-9
"""Part of the largest singular value below which a motion counts as free."""
SMALLEST = 1e-6
"""Least reach of mounts, m, by which turns are counted as displacements."""

WAYS = ("move across it", "move across it", "move along its axis", "tilt", "tilt", "turn")
"""Motions of a shaft."""


def check_held(train: Drivetrain, places: dict[str, Seat]) -> None:
    """Check that bearings hold the five motions of each shaft but its rotation, alone or through couplings.

    Raises
    ------
    DrivetrainError
    """
    centres = roles(train.couplings, {bearing.shaft for bearing in train.bearings})
    holding = {one.name: one.holds(centres.get(one.name, "")) for one in train.couplings}
    done: set[str] = set()
    for shaft in train.shafts:
        mine = [b for b in train.bearings if b.shaft == shaft.name]
        ideal = [b for b in mine if b.kind == "ideal"]
        require(
            len(ideal) <= 2,
            f"{shaft.label}: {len(ideal)} ideal bearings hold it more than once, so that their forces are not "
            "determined; give two of them, or elastic ones",
        )
        if shaft.name in done:
            continue
        group = _group(train, shaft.name, {name: len(rows) > 0 for name, rows in holding.items()})
        done |= group
        check_thrust(train, _group(train, shaft.name, {n: bool(rows[:, 2].any()) for n, rows in holding.items()}))
        if group == {shaft.name}:
            require(bool(mine), f"{shaft.label}: nothing holds it; give it a bearing")
        _check_group(train, [s for s in train.shafts if s.name in group], places, holding)


def _group(train: Drivetrain, shaft: str, holds: dict[str, bool]) -> set[str]:
    """Return the shafts that couplings which hold each other join to one."""
    group, size = {shaft}, 0
    while len(group) > size:
        size = len(group)
        for coupling in train.couplings:
            if holds[coupling.name] and group & {coupling.first, coupling.second}:
                group |= {coupling.first, coupling.second}
    return group


def _check_group(
    train: Drivetrain, shafts: list[Shaft], places: dict[str, Seat], holding: dict[str, np.ndarray]
) -> None:
    """Check that nothing leaves one of some shafts free."""
    at = {shaft.name: 6 * k for k, shaft in enumerate(shafts)}
    rows = []
    for shaft in shafts:
        # its own rotation is free
        turn = np.zeros((1, 6 * len(shafts)))
        turn[0, at[shaft.name] + 5] = 1.0
        rows.append(turn)
    for moved in _holding(train, shafts, places, holding):
        row = np.zeros((len(moved[0][1]), 6 * len(shafts)))
        for name, part in moved:
            row[:, at[name] : at[name] + 6] += part
        size = np.abs(row).max()
        rows.append(row / (size if size > 0.0 else 1.0))
    _, sizes, motions = np.linalg.svd(np.vstack(rows))
    sizes = np.concatenate([sizes, np.zeros(max(0, motions.shape[0] - sizes.size))])
    if sizes[-1] >= HELD * sizes[0]:
        return
    place = int(np.argmax(np.abs(motions[-1])))
    shaft, way = shafts[place // 6], WAYS[place % 6]
    names = {shaft.name for shaft in shafts}
    parts = [f"'{b.name}'" for b in train.bearings if b.shaft in names]
    parts += [f"'{c.name}'" for c in train.couplings if c.first in names and len(holding[c.name])]
    what = "bearings" if len(shafts) == 1 else "bearings and couplings"
    raise DrivetrainError(
        f"{shaft.label}: its {what} {', '.join(parts)} leave it free to {way}; "
        "add a bearing, or stiffness in that direction"
    )


def _holding(
    train: Drivetrain, shafts: list[Shaft], places: dict[str, Seat], holding: dict[str, np.ndarray]
) -> Iterator[list[tuple[str, np.ndarray]]]:
    """Yield what holds shafts: rows over the motions of the middles of shafts in their axes, by their names."""
    names = {shaft.name for shaft in shafts}
    for bearing in train.bearings:
        if bearing.shaft in names:
            count = sum(b.shaft == bearing.shaft and b.kind == "ideal" for b in train.bearings)
            shaft = train.part(bearing.shaft, Shaft)
            z = train.station(bearing) - 0.5 * shaft.length
            yield [(shaft.name, bearing.holds(count) @ _moved(np.eye(3), z)[:5])]
    for coupling in train.couplings:
        held = holding[coupling.name]
        if coupling.first not in names or len(held) == 0:
            continue
        first, second = (train.part(name, Shaft) for name in (coupling.first, coupling.second))
        ends = coupling.stations or (first.length, 0.0)
        seen = places[first.name].axes.T @ places[second.name].axes
        one = held @ _moved(np.eye(3), ends[0] - 0.5 * first.length)[:5]
        two = held @ _moved(seen, ends[1] - 0.5 * second.length)[:5]
        yield [(second.name, two), (first.name, -one)]


def _moved(seen: np.ndarray, z: float) -> np.ndarray:
    """Return displacements and turns at a station, in some axes, over the motion of a shaft's middle in its own.

    Parameters
    ----------
    seen : ndarray, shape (3, 3)
        Axes of the shaft in those.
    z : float
        Place of the station from the middle along the shaft, m.
    """
    arm = np.zeros((3, 3))
    # a tilt moves the point: x by tilt y times z, y by minus tilt x times z
    arm[0, 1], arm[1, 0] = z, -z
    return np.block([[seen, seen @ arm], [np.zeros((3, 3)), seen]])


def check_stands(housing: Housing) -> None:
    """Check that the mounts of a housing of finite elements hold its six motions, for nothing else does.

    Raises
    ------
    DrivetrainError
    """
    if housing.model is None:
        return
    places = np.array([mount.at for mount in housing.mounts], dtype=float)
    arms = places - places.mean(axis=0)
    reach = max(float(np.abs(arms).max()), SMALLEST)
    rows = []
    for arm, mount in zip(arms, housing.mounts):
        turned = np.cross(np.eye(3), arm / reach).T
        rows.append(np.sqrt(np.asarray(mount.stiffness, dtype=float))[:, None] * np.hstack([np.eye(3), turned]))
    _, sizes, motions = np.linalg.svd(np.vstack(rows))
    if sizes.size < 6 or sizes[-1] < np.sqrt(HELD) * sizes[0]:
        way = motions[-1]
        turning = np.linalg.norm(way[3:]) > np.linalg.norm(way[:3])
        axis = "xyz"[int(np.argmax(np.abs(way[3:] if turning else way[:3])))]
        raise DrivetrainError(
            f"{housing.label}: its mounts {', '.join(repr(m.name) for m in housing.mounts)} leave it free to "
            f"{'turn about' if turning else 'move along'} {axis}; give three or more that are not on one line, with "
            "stiffness in that direction"
        )
