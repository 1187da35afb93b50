"""The solid of a wheel with exactly the simulated teeth, bore and faults, as a watertight mesh, and its STL files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Protocol

import numpy as np

from gearmbs.files import whole_file
from gearmbs.gears import GearPair, GearSpec
from gearmbs.progress import waiting
from gearmbs.view.mesh import Mesh, joined
from gearmbs.view.profile import TOLERANCE, arc_chords, half_tooth, land_angles

LENGTH_UNITS = {"mm": 1e3, "m": 1.0, "cm": 1e2, "in": 1.0 / 0.0254}


class Deviations(Protocol):
    """What single teeth do differently, tabulated over profile and face, as `gearmbs.gears` collects it."""

    roll_length: np.ndarray
    section: np.ndarray
    offset: np.ndarray
    shape: np.ndarray
    tip: np.ndarray


@dataclass(frozen=True)
class _Teeth:
    """Radii and angles of all teeth: arrays of shape (sections, teeth, n); side 0 is the anticlockwise flank."""

    section: np.ndarray
    radius: np.ndarray
    angle: tuple[np.ndarray, np.ndarray]


def title_of(solid: GearSpec | GearPair | Mesh) -> str:
    """Return what a geometry file calls a wheel, a pair or a mesh."""
    if isinstance(solid, GearPair):
        return f"gear pair {solid.driver.teeth}/{solid.driven.teeth}"
    return f"{solid.name} z={solid.teeth}" if isinstance(solid, GearSpec) else "mesh"


def pair_solids(pair: GearPair, tolerance: float = TOLERANCE, exaggeration: float = 1.0) -> tuple[Mesh, Mesh]:
    """Return driver and driven, each in its own frame, with backlash thinning and all faults of the pair.

    Parameters
    ----------
    pair : GearPair
    tolerance : float
        Largest distance of a chord from the profile, m.
    exaggeration : float
        Deviations of the flanks are drawn this many times larger (cut and broken teeth are not).
    """
    deviations = pair_deviations(pair)
    first, second = (
        gear_solid(wheel, tolerance, deviation, exaggeration) for wheel, deviation in zip(pair.wheels, deviations)
    )
    return first, second


def pair_deviations(pair: GearPair) -> tuple[Deviations | None, Deviations | None]:
    """Return the deviations of driver and driven, None for perfect wheels."""
    if not pair.faults:
        return None, None
    from gearmbs.gears.tables import tooth_deviations

    return tooth_deviations(pair)


def gear_solid(
    gear: GearSpec,
    tolerance: float = TOLERANCE,
    deviations: Deviations | None = None,
    exaggeration: float = 1.0,
) -> Mesh:
    """Return the solid of a wheel: mid-face at the origin, axis z, tooth 0 along +x.

    Parameters
    ----------
    gear : GearSpec
    tolerance : float
        Largest distance of a chord from the profile, m.
    deviations : Deviations, optional
        Of its teeth.
    exaggeration : float
        Factor on the deviations of the flanks.

    Returns
    -------
    Mesh
        Watertight; vertices in m.
    """
    teeth = _teeth(gear, tolerance, deviations, exaggeration)
    across = arc_chords(gear.tip_radius, 2.0 * gear.corner_half_angle, tolerance)
    between = land_angles(gear, tolerance).size - 1
    builder = _Builder()
    rims, grids = [], []
    last = teeth.section.size - 1
    for j, z in enumerate(teeth.section):
        cap = j in (0, last)
        rim, grid = _section(builder, teeth, j, float(z), across, between, gear, cap)
        rims.append(rim)
        grids.append(grid)
    for low, high in pairwise(rims):
        # the teeth of an internal wheel face its axis
        builder.wall(*((high, low) if gear.internal else (low, high)))
    inner = []
    for j, up in ((0, False), (last, True)):
        rows, ring = grids[j]
        for tooth in rows:
            builder.patch(tooth, up != gear.internal)
        inner.append(_hub(builder, ring, gear, float(teeth.section[j]), up))
    if gear.internal:
        builder.wall(inner[0], inner[1])
    elif gear.bore_radius > 0.0:
        builder.wall(inner[1], inner[0])
    return builder.mesh()


def _teeth(gear: GearSpec, tolerance: float, deviations: Deviations | None, exaggeration: float) -> _Teeth:
    teeth = _straight_teeth(gear, tolerance, deviations, exaggeration)
    if gear.helix_angle == 0:
        return teeth
    # enough sections that a chord of the tip's helix stays within the tolerance
    lead = gear.twist_tangent / gear.base_radius
    count = arc_chords(gear.outer_radius, lead * gear.face_width, tolerance, 2)
    section = np.linspace(teeth.section[0], teeth.section[-1], max(count + 1, teeth.section.size))
    place = np.interp(section, teeth.section, np.arange(teeth.section.size))
    low = np.minimum(place.astype(int), teeth.section.size - 2)
    share = (place - low)[:, None, None]

    def along(values: np.ndarray) -> np.ndarray:
        return values[low] + share * (values[low + 1] - values[low])

    turn = (lead * section)[:, None, None]
    one, two = along(teeth.angle[0]), along(teeth.angle[1])
    return _Teeth(section, along(teeth.radius), (one + turn, two - turn))


def _straight_teeth(gear: GearSpec, tolerance: float, deviations: Deviations | None, exaggeration: float) -> _Teeth:
    """Return the teeth without the turn of a helix."""
    half = half_tooth(gear, tolerance)
    n, rb = half.radius.size, gear.base_radius
    if deviations is None:
        section = np.array([-0.5, 0.5]) * gear.face_width
        shape = (section.size, gear.teeth, n)
        angle = np.broadcast_to(half.half_angle, shape)
        return _Teeth(section, np.broadcast_to(half.radius, shape), (angle, angle))
    section = np.asarray(deviations.section)
    radius = np.empty((section.size, gear.teeth, n))
    angles = (np.empty_like(radius), np.empty_like(radius))
    shorter = np.maximum if gear.internal else np.minimum
    tips = np.hypot(rb, shorter(deviations.tip[0], deviations.tip[1]))
    whole = math.hypot(rb, gear.tip_roll_length) * (1.0 - gear.sign * 1e-9)
    # tables along the profile are looked up from the smaller radius on
    order = slice(None, None, gear.sign)
    rise = (half.radius - gear.root_radius) / (gear.tip_radius - gear.root_radius)
    for j in range(section.size):
        for tooth in range(gear.teeth):
            top = tips[tooth, j]
            entire = gear.sign * (top - whole) >= 0
            here = half.radius if entire else gear.root_radius + rise * (top - gear.root_radius)
            angles_here = half.half_angle if entire else np.interp(here, half.radius[order], half.half_angle[order])
            roll_length = np.sqrt(np.maximum(here**2 - rb**2, 0.0))
            radius[j, tooth] = here
            for side in (0, 1):
                shape = deviations.shape[side, tooth, j]
                removed = np.interp(roll_length, deviations.roll_length[order], shape[order])
                removed = exaggeration * (removed + deviations.offset[side, tooth])
                angles[side][j, tooth] = angles_here - removed / rb
    if ((angles[0] + angles[1]) <= 0.0).any():
        raise ValueError(f"exaggeration is {exaggeration}: a tooth's flanks cross; reduce it")
    return _Teeth(section, radius, angles)


class _Builder:
    """Collects vertices and triangles."""

    def __init__(self) -> None:
        self.points: list[np.ndarray] = []
        self.faces: list[np.ndarray] = []
        self.count = 0

    def add(self, points: np.ndarray) -> np.ndarray:
        """Add points (..., 3) and return their numbers."""
        flat = points.reshape(-1, 3)
        numbers = np.arange(self.count, self.count + len(flat)).reshape(points.shape[:-1])
        self.points.append(flat)
        self.count += len(flat)
        return numbers

    def wall(self, low: np.ndarray, high: np.ndarray) -> None:
        """Close the surface between two closed chains, outside to the right of ``low`` seen along +z."""
        a, b = low, np.roll(low, -1)
        c, d = high, np.roll(high, -1)
        self.faces += [np.column_stack([a, b, d]), np.column_stack([a, d, c])]

    def patch(self, grid: np.ndarray, up: bool) -> None:
        """Fill a grid whose rows lead outward and columns anticlockwise."""
        a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
        c, d = grid[1:, :-1].ravel(), grid[1:, 1:].ravel()
        self.faces += self._facing([np.column_stack([a, c, d]), np.column_stack([a, d, b])], up)

    def fan(self, ring: np.ndarray, centre: int, up: bool) -> None:
        """Fill a closed anticlockwise chain from a centre."""
        self.faces += self._facing([np.column_stack([ring, np.roll(ring, -1), np.full(ring.size, centre)])], up)

    @staticmethod
    def _facing(faces: list[np.ndarray], up: bool) -> list[np.ndarray]:
        return faces if up else [f[:, ::-1] for f in faces]

    def mesh(self) -> Mesh:
        return Mesh(np.concatenate(self.points), np.concatenate(self.faces))


def _polar(radius: np.ndarray, angle: np.ndarray, z: float) -> np.ndarray:
    radius, angle = np.broadcast_arrays(radius, angle)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(radius.shape, z)], axis=-1)


def _section(
    builder: _Builder, teeth: _Teeth, j: int, z: float, across: int, between: int, gear: GearSpec, cap: bool
) -> tuple[np.ndarray, tuple[list[np.ndarray], np.ndarray]]:
    """Add the points of one section; return its outline and, for an end, the teeth's grids and the root ring."""
    step = 2.0 * math.pi / gear.teeth
    share = np.linspace(0.0, 1.0, across + 1)
    outline: list[np.ndarray] = []
    ring: list[np.ndarray] = []
    grids: list[np.ndarray] = []
    for tooth in range(gear.teeth):
        radius = teeth.radius[j, tooth]
        upper, lower = teeth.angle[0][j, tooth], -teeth.angle[1][j, tooth]
        if cap:
            angle = tooth * step + lower[:, None] + share * (upper - lower)[:, None]
            grid = builder.add(_polar(radius[:, None], angle, z))
            grids.append(grid)
            chain = [grid[:, 0], grid[-1, 1:-1], grid[::-1, -1]]
            ring.append(grid[0])
        else:
            angle = np.concatenate([lower, lower[-1] + share[1:-1] * (upper[-1] - lower[-1]), upper[::-1]])
            radii = np.concatenate([radius, np.full(across - 1, radius[-1]), radius[::-1]])
            chain = [builder.add(_polar(radii, tooth * step + angle, z))]
        follow = -teeth.angle[1][j, (tooth + 1) % gear.teeth, 0] + step
        gap = np.linspace(upper[0], follow, between + 1)[1:-1] + tooth * step
        land = builder.add(_polar(np.full(gap.size, gear.root_radius), gap, z))
        outline += [*chain, land]
        ring.append(land)
    return np.concatenate(outline), (grids, np.concatenate(ring) if cap else np.empty(0, dtype=int))


def _hub(builder: _Builder, ring: np.ndarray, gear: GearSpec, z: float, up: bool) -> np.ndarray:
    """Fill an end between root circle and bore (or centre); return the chain round the bore."""
    if gear.internal:
        points = np.concatenate(builder.points)[ring]
        rim = builder.add(_polar(np.full(ring.size, gear.outer_radius), np.arctan2(points[:, 1], points[:, 0]), z))
        builder.patch(np.stack([np.append(ring, ring[0]), np.append(rim, rim[0])]), up)
        return rim
    if gear.bore_radius == 0.0:
        centre = builder.add(np.array([[0.0, 0.0, z]]))
        builder.fan(ring, int(centre[0]), up)
        return centre
    points = np.concatenate(builder.points)[ring]
    bore = builder.add(_polar(np.full(ring.size, gear.bore_radius), np.arctan2(points[:, 1], points[:, 0]), z))
    closed = np.stack([np.append(bore, bore[0]), np.append(ring, ring[0])])
    builder.patch(closed, up)
    return bore


def section_outline(
    gear: GearSpec,
    section: float = 0.0,
    tolerance: float = TOLERANCE,
    deviations: Deviations | None = None,
    exaggeration: float = 1.0,
) -> np.ndarray:
    """Return the closed outline of a wheel in the section at ``section`` (m from mid-face), shape (n, 2), m."""
    teeth = _teeth(gear, tolerance, deviations, exaggeration)
    j = int(np.argmin(np.abs(teeth.section - section)))
    builder = _Builder()
    across = arc_chords(gear.tip_radius, 2.0 * gear.corner_half_angle, tolerance)
    between = land_angles(gear, tolerance).size - 1
    rim, _ = _section(builder, teeth, j, 0.0, across, between, gear, False)
    return np.concatenate(builder.points)[rim, :2]


# Solids as STL, the triangle format every mesher and printer reads.


RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@waiting("writing the mesh")
def write_stl(
    solid: GearSpec | GearPair | Mesh,
    path: str | Path,
    *,
    unit: str = "mm",
    tolerance: float = TOLERANCE,
    driver_angle: float = 0.0,
) -> Path:
    """Write a wheel, a placed pair or any mesh as binary STL.

    A pair is written with backlash, faults, misalignment and centre distance as simulated, the drive flanks touching.

    Parameters
    ----------
    solid : GearSpec, GearPair or Mesh
    path : path
        The file; its folder is made when missing.
    unit : {"mm", "m", "cm", "in"}
        Of the numbers in the file (the format itself knows none).
    tolerance : float
        Largest distance of a chord from the profile, m.
    driver_angle : float
        Position of a pair, rad.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        For an unknown unit or something that is no solid.
    """
    if unit not in LENGTH_UNITS:
        raise ValueError(f"unit is {unit!r}; choose one of {', '.join(LENGTH_UNITS)}")
    if isinstance(solid, GearPair):
        frames = solid.placement(driver_angle).frames
        mesh = joined([wheel.placed(*frame) for wheel, frame in zip(pair_solids(solid, tolerance), frames)])
    elif isinstance(solid, GearSpec):
        mesh = gear_solid(solid, tolerance)
    elif isinstance(solid, Mesh):
        mesh = solid
    else:
        raise ValueError(f"solid is a {type(solid).__name__}; give a GearSpec, a GearPair or a Mesh")
    records = np.zeros(len(mesh.triangles), dtype=RECORD)
    records["corners"] = mesh.corners * LENGTH_UNITS[unit]
    records["normal"] = mesh.normals
    header = f"{title_of(solid)}, {unit}".encode("ascii", "replace")[:80].ljust(80)
    path = Path(path)
    with whole_file(path) as part, part.open("wb") as file:
        file.write(header)
        file.write(np.uint32(records.size).astype("<u4").tobytes())
        file.write(records.tobytes())
    return path


def read_stl(path: str | Path, *, unit: str = "mm") -> Mesh:
    """Read a binary STL file; corners at the same place become one vertex.

    Raises
    ------
    ValueError
        If the file is shorter or longer than its triangle count says.
    """
    data = Path(path).read_bytes()
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if count < 0 or len(data) != 84 + count * RECORD.itemsize:
        raise ValueError(f"{path}: not a binary STL file ({len(data)} bytes, {max(count, 0)} triangles announced)")
    corners = np.frombuffer(data, RECORD, count, 84)["corners"].reshape(-1, 3)
    vertices, numbers = np.unique(corners, axis=0, return_inverse=True)
    return Mesh(vertices.astype(float) / LENGTH_UNITS[unit], numbers.reshape(-1, 3))
