"""Shafts that are a finite-element model or a body with modes: their place, their outline, the seats of their parts.

All of it is in the shaft's frame: z along its axis, the origin at its left end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from gearmbs.drivetrain.members.sources import ALL, MODES, ROUND
from gearmbs.drivetrain.part import require
from gearmbs.flexible import FiniteElementModel, Interface, ModalModel, Seat, reduce_model
from gearmbs.flexible.modal_model import shapes_at
from gearmbs.gears.geometry import MM
from gearmbs.schema.quantities import Measure

LEVELS = 64
"""Most sections of an outline: those of irregular meshes are rounded to so many places."""

ENOUGH = 8
"""Nodes of a seat: a section of a coarse mesh of hexahedra has as many on its circumference."""

SHARES = (0.125, 0.25, 0.5, 1.0)
"""Widths tried for what tells none, as a coupling, by the diameter there: what a load does to a section fades out
within a diameter (Saint-Venant), so that any of them stands for the station."""

OFF_AXIS = 0.2
"""Distance of the centre of mass from the axis, by the largest radius, from which on the axes are taken for wrong: a
crank has more, a shaft with a keyway less than a hundredth."""

_LENGTHS = Measure("length", above=0, several=2)


class Width(NamedTuple):
    """What is known of the seat of a part on a shaft: diameter and width, m, each None if it is not."""

    diameter: float | None
    width: float | None


def placed_model(shaft: Any) -> FiniteElementModel | ModalModel:
    """Return the model of a shaft in the shaft's frame.

    Raises
    ------
    DrivetrainError
        If the shaft's axis does not pass near its centre of mass.
    """
    model, axes = shaft.model, np.eye(3) if shaft.axes is None else np.array(shaft.axes)
    at = np.zeros(3) if shaft.at is None else np.array(shaft.at, dtype=float)
    if shaft.at is None:
        at[2] = -float((model.positions @ axes[2]).min())
    found = model if np.array_equal(axes, np.eye(3)) and not at.any() else model.placed(axes, at)
    reach = float(np.hypot(*found.positions[:, :2].T).max())
    com = found.properties.com if isinstance(found, ModalModel) else found.mass_properties().com
    off = float(np.hypot(*com[:2]))
    require(
        off <= OFF_AXIS * reach,
        f"{shaft.label}: the centre of mass of its model is {MM * off:.4g} mm off the axis, z; check axes and at, the "
        "frame of its nodes in that of the shaft",
    )
    return found


def cylinders_of(positions: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Return lengths and radii from left to right, m, of cylinders that are not outside of some nodes.

    Parameters
    ----------
    positions : ndarray, shape (n, 3)
        m.
    """
    z, radius = positions[:, 2], np.hypot(positions[:, 0], positions[:, 1])
    low, high = float(z.min()), float(z.max())
    unit = 1e-6 * (high - low)
    if np.unique(np.round((z - low) / unit)).size > LEVELS:
        unit = (high - low) / LEVELS
    level, number = np.unique(np.round((z - low) / unit), return_inverse=True)
    largest = np.zeros(level.size)
    np.maximum.at(largest, number, radius)
    places = low + unit * level
    # at a shoulder there are nodes on both radii
    found = [(b - a, min(r, s)) for (a, r), (b, s) in pairwise(zip(places, largest))]
    return tuple((float(length), float(r)) for length, r in found)


def shaft_body(shaft: Any, seats: Mapping[str, tuple[float, Width]]) -> ModalModel:
    """Return a shaft with a model as a body with modes.

    Parameters
    ----------
    shaft : gearmbs.drivetrain.Shaft
    seats : mapping
        Station (m) and size of each seat, by the names of the parts there.

    Raises
    ------
    DrivetrainError
        Where no nodes are at a part, or two parts have the same.
    """
    model, parts = shaft.body_model, {name for names in seats for name in names.split(", ")}
    unknown = sorted(set(shaft.seats or {}) - parts)
    require(not unknown, f"{shaft.label}: seats has '{', '.join(unknown)}'; its parts are {', '.join(sorted(parts))}")
    if isinstance(model, ModalModel):
        found = {name: _carried(shaft, model, name, station) for name, (station, _) in seats.items()}
        whole = replace(model, seats=found, name=shaft.name)
        return whole.slowest(shaft.modes) if isinstance(shaft.modes, int) else whole
    faces = [_face(shaft, model, name, station, size) for name, (station, size) in seats.items()]
    for k, one in enumerate(faces):
        for other in faces[:k]:
            require(
                set(one.nodes) != set(other.nodes),
                f"{shaft.label}: '{other.name}' and '{one.name}' have the same nodes of its model; give "
                f"seats = {{'{one.name}': (diameter, width)}}, or both one station",
            )
    if shaft.modes == ALL:
        return reduce_model(model, faces, max_frequency=np.inf, name=shaft.name)
    return reduce_model(model, faces, modes=shaft.modes or MODES, name=shaft.name)


def _given(shaft: Any, seat: str) -> Any:
    """Return what the shaft says of the seat of a part; parts at one station have one."""
    told = shaft.seats or {}
    return next((told[name] for name in seat.split(", ") if name in told), None)


def _face(shaft: Any, model: FiniteElementModel, name: str, station: float, size: Width) -> Interface:
    """Return the nodes that carry a part."""
    given = _given(shaft, name)
    diameter, width = size if given is None else shaft.read(f"seats.{name}", given, _LENGTHS)
    along = np.abs(model.positions[:, 2] - station)
    across = np.hypot(*model.positions[:, :2].T)
    near = across <= (np.inf if diameter is None else 0.5 * ROUND * diameter)
    # of the section that is nearest
    local = 2.0 * float(across[along <= along.min() + 1e-3 * shaft.length].max())
    inside = near
    for wide in [share * local for share in SHARES] if width is None else [width]:
        inside = near & (along <= 0.5 * ROUND * wide)
        if inside.sum() >= ENOUGH:
            break
    if inside.sum() < 3 or np.linalg.matrix_rank(model.positions[inside] - [0.0, 0.0, station]) < 2:
        size_told = "any diameter" if diameter is None else f"{MM * diameter:.4g} mm in diameter"
        apart = f"the nearest nodes are {MM * float(along[near].min(initial=np.inf)):.4g} mm along the axis away"
        require(
            False,
            f"{shaft.label}: {int(inside.sum())} nodes of its model are at '{name}', station {MM * station:.4g} mm, "
            f"{size_told} and {MM * wide:.4g} mm wide; {apart}: check at and axes of the shaft, or give "
            f"seats = {{'{name.split(', ')[0]}': (diameter, width)}}",
        )
    return Interface(name, [int(k) for k in model.ids[inside]], shaft.faces, at=(0.0, 0.0, station))


def _carried(shaft: Any, model: ModalModel, name: str, station: float) -> Seat:
    """Return the seat of a part on a body with modes: the nearest of its own, with a rigid arm."""
    place, asked = np.array([0.0, 0.0, station]), _given(shaft, name)
    if asked is not None:
        position = model.place(asked)
    else:
        points = np.vstack([*(seat.position for seat in model.seats.values()), model.positions])
        position = points[int(np.argmin(np.linalg.norm(points - place, axis=1)))]
    arm = place - position
    reach = 0.5 * max(2.0 * r for _, r in shaft.cylinders)
    require(
        asked is not None or float(np.linalg.norm(arm)) <= max(reach, 1e-3 * shaft.length),
        f"{shaft.label}: the nearest node of its model to '{name}', at station {MM * station:.4g} mm, is "
        f"{MM * float(np.linalg.norm(arm)):.4g} mm away; check at and axes, or name its node by "
        f"seats = {{'{name.split(', ')[0]}': ...}}",
    )
    moved, turned = shapes_at(model, position)
    return Seat(place, moved + np.cross(turned, arm), turned)
