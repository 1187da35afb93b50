"""Solids as STL, the triangle format every mesher and printer reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearmbs.gears import GearPair, GearSpec
from gearmbs.progress import waiting
from gearmbs.view.files import whole_file
from gearmbs.view.mesh import Mesh, joined
from gearmbs.view.outline import TOLERANCE
from gearmbs.view.solid import gear_solid, pair_solids, title_of

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
LENGTH_UNITS = {"mm": 1e3, "m": 1.0, "cm": 1e2, "in": 1.0 / 0.0254}


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
