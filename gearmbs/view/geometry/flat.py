"""The transverse profile as a DXF drawing: arcs as arcs, involutes as fine chains, circles on layers of their own."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from gearmbs.files import whole_file, write_whole
from gearmbs.gears import GearPair, GearSpec
from gearmbs.progress import waiting
from gearmbs.view.geometry.mesh import Mesh, joined
from gearmbs.view.geometry.profile import TOLERANCE, Arc, Edge, Spline, profile_edges, turn
from gearmbs.view.geometry.solid import gear_solid, pair_solids, title_of

MM = 1e3
"""Millimetres a metre, the unit of the file."""
CHORD_TOLERANCE = 1e-7
"""Distance between a profile and its chords, m, where none is given: a tenth of a micrometre, finer than wheels are
made."""
LAYERS = {"PROFILE": 7, "BORE": 7, "PITCH": 4, "BASE": 3, "LINE_OF_ACTION": 1}
"""Layers and their colour numbers."""


@waiting("writing the drawing")
def write_dxf(gears: GearSpec | GearPair, path: str | Path, *, tolerance: float = CHORD_TOLERANCE) -> Path:
    """Write the profile of a wheel, or of a pair in mesh, as DXF (release 12, millimetres).

    Root circle, root arcs, tip roundings and tip circle are exact arcs, the involute a chain of chords. Layers:
    PROFILE, BORE, PITCH, BASE, and LINE_OF_ACTION for a pair. A pair is drawn in the plane across the driver's axis,
    drive flanks touching, with its centre distance and backlash; tilt and faults of single teeth belong to solids.

    Parameters
    ----------
    gears : GearSpec or GearPair
    path : path
    tolerance : float
        Largest distance of a chord from the involute, m.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        If the pair is tilted or has faults, or the tolerance is not positive.
    """
    if not tolerance > 0.0:
        raise ValueError(f"tolerance is {tolerance} m; give a positive length such as 1e-7")
    body: list[str] = []
    if isinstance(gears, GearPair):
        if gears.misalignment != 0.0 or gears.faults:
            raise ValueError(
                "gears: a plane drawing cannot show misalignment or faults of single teeth; use write_stl, or "
                "with_changes(misalignment=0, faults=())"
            )
        place = gears.placement()
        for wheel, origin, axes in zip(gears.wheels, (place.origin_1, place.origin_2), (place.axes_1, place.axes_2)):
            body += _wheel(wheel, origin[:2], math.atan2(axes[1, 0], axes[0, 0]), tolerance)
        body += _line_of_action(gears)
    elif isinstance(gears, GearSpec):
        body += _wheel(gears, np.zeros(2), 0.0, tolerance)
    else:
        raise ValueError(f"gears is a {type(gears).__name__}; give a GearSpec or a GearPair")
    lines = ["999", "unit: millimetre", *_section("HEADER", ["9", "$ACADVER", "1", "AC1009"])]
    lines += [*_section("TABLES", _tables()), *_section("ENTITIES", body), "0", "EOF"]
    return write_whole(path, "\n".join(lines) + "\n")


def _section(name: str, body: list[str]) -> list[str]:
    return ["0", "SECTION", "2", name, *body, "0", "ENDSEC"]


def _tables() -> list[str]:
    styles = ["0", "TABLE", "2", "LTYPE", "70", "1", "0", "LTYPE", "2", "CONTINUOUS", "70", "0", "3", "Solid line"]
    styles += ["72", "65", "73", "0", "40", "0.0", "0", "ENDTAB"]
    layers = ["0", "TABLE", "2", "LAYER", "70", str(len(LAYERS))]
    for name, colour in LAYERS.items():
        layers += ["0", "LAYER", "2", name, "70", "0", "62", str(colour), "6", "CONTINUOUS"]
    return [*styles, *layers, "0", "ENDTAB"]


def _wheel(gear: GearSpec, centre: np.ndarray, angle: float, tolerance: float) -> list[str]:
    out = ["0", "POLYLINE", "8", "PROFILE", "66", "1", "70", "1", *_point(np.zeros(2))]
    for edge in profile_edges(gear):
        out += _vertices(edge.turned(angle), centre, tolerance)
    out += ["0", "SEQEND", "8", "PROFILE"]
    circles = [
        ("PITCH", gear.pitch_radius),
        ("BASE", gear.base_radius),
        ("BORE", gear.outer_radius if gear.internal else gear.bore_radius),
    ]
    for layer, radius in circles:
        if radius > 0.0:
            out += ["0", "CIRCLE", "8", layer, *_point(centre), "40", _number(radius)]
    return out


def _vertices(edge: Edge, centre: np.ndarray, tolerance: float) -> list[str]:
    """Vertices of an edge without its last point; group 42 is the tangent of a quarter of an arc's opening."""
    if isinstance(edge, Spline):
        span = float(np.linalg.norm(edge.stop - edge.start))
        tightest = min(np.hypot(*edge.start), np.hypot(*edge.stop))
        count = max(8, math.ceil(span / math.sqrt(8.0 * tolerance * 0.05 * tightest)))
        return [t for p in edge.points(count + 1)[:-1] for t in _vertex(p + centre, 0.0)]
    bulge = edge.sense * math.tan(0.25 * edge.opening) if isinstance(edge, Arc) else 0.0
    return _vertex(edge.start + centre, bulge)


def _vertex(point: np.ndarray, bulge: float) -> list[str]:
    return ["0", "VERTEX", "8", "PROFILE", *_point(point), *(["42", f"{bulge:.12g}"] if bulge else [])]


def _line_of_action(pair: GearPair) -> list[str]:
    alpha = pair.working_pressure_angle
    one, two = pair.wheels
    # the common tangent of the base circles that the drive flanks press along
    direction = turn(np.array([1.0, 0.0]), -pair.rotation * alpha)
    start = one.base_radius * direction
    stop = np.array([pair.centre_distance, 0.0]) - two.base_radius * direction
    return ["0", "LINE", "8", "LINE_OF_ACTION", *_point(start), *_point(stop, 1)]


def _point(point: np.ndarray, index: int = 0) -> list[str]:
    return [str(10 + index), _number(point[0]), str(20 + index), _number(point[1]), str(30 + index), "0.0"]


def _number(metres: float) -> str:
    return f"{metres * MM:.10g}"


# Solids as STL, the triangle format every mesher and printer reads.


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
