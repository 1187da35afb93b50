"""A wheel as a STEP solid (AP214): planes, cylinders and extruded involutes, written directly.

The boundary representation needs nothing but the profile's exact edges, so no CAD kernel is called for: every edge of
profile and bore becomes one face of the prism, an arc a cylinder, a line a plane, an involute an extruded B-spline.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gearmbs.gears import GearPair, GearSpec
from gearmbs.view.edges import DEGREE, Arc, Edge, Spline, bore_edges, profile_edges
from gearmbs.view.files import write_whole
from gearmbs.view.solid import title_of

MM = 1e3
UP = (0.0, 0.0, 1.0)
DOWN = (0.0, 0.0, -1.0)


def write_step(gears: GearSpec | GearPair, path: str | Path, *, driver_angle: float = 0.0) -> Path:
    """Write a wheel, or a placed pair as two solids, as a STEP file (AP214, millimetres).

    Parameters
    ----------
    gears : GearSpec or GearPair
        A pair is written with its backlash, centre distance and misalignment, drive flanks touching.
    path : path
    driver_angle : float
        Position of a pair, rad.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        If the pair has faults of single teeth: those are tabulated, not curves; write them with `write_stl`.
        For internal and helical wheels.
    """
    writer = _Writer()
    if isinstance(gears, GearPair):
        if gears.faults:
            raise ValueError(
                "gears: the pair has faults of single teeth, which STEP curves cannot follow; use write_stl, or "
                "with_changes(faults=())"
            )
        placed = zip(gears.wheels, gears.placement(driver_angle).frames)
        solids = [_solid(writer, wheel, *frame) for wheel, frame in placed]
    elif isinstance(gears, GearSpec):
        solids = [_solid(writer, gears, np.zeros(3), np.eye(3))]
    else:
        raise ValueError(f"gears is a {type(gears).__name__}; give a GearSpec or a GearPair")
    name = title_of(gears)
    _product(writer, solids, name)
    header = [
        "ISO-10303-21;",
        "HEADER;",
        "FILE_DESCRIPTION(('spur gears'),'2;1');",
        f"FILE_NAME('{name}','1970-01-01T00:00:00',(''),(''),'gearmbs','gearmbs','');",
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));",
        "ENDSEC;",
        "DATA;",
    ]
    return write_whole(path, "\n".join([*header, *writer.lines, "ENDSEC;", "END-ISO-10303-21;"]) + "\n")


class _Writer:
    """Numbers the entities of a STEP file."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, text: str) -> int:
        """Add an entity and return its number."""
        self.lines.append(f"#{len(self.lines) + 1}={text};")
        return len(self.lines)

    def point(self, xyz: Sequence[float] | np.ndarray) -> int:
        return self.add(f"CARTESIAN_POINT('',({','.join(_real(v * MM) for v in xyz)}))")

    def direction(self, xyz: Sequence[float] | np.ndarray) -> int:
        return self.add(f"DIRECTION('',({','.join(_real(v) for v in xyz)}))")

    def axes(self, origin: np.ndarray, z: np.ndarray, x: np.ndarray) -> int:
        return self.add(f"AXIS2_PLACEMENT_3D('',#{self.point(origin)},#{self.direction(z)},#{self.direction(x)})")

    def vector(self, direction: np.ndarray) -> int:
        return self.add(f"VECTOR('',#{self.direction(direction)},1.)")


def _real(value: float) -> str:
    text = f"{float(value):.12g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.'}E{exponent}"
    return text if "." in text else text + "."


def _refs(numbers: Sequence[int]) -> str:
    return "(" + ",".join(f"#{n}" for n in numbers) + ")"


def _check(gear: GearSpec) -> None:
    if gear.internal or gear.helix_angle:
        kind = "internal" if gear.internal else "helical"
        raise ValueError(
            f"{gear.name} is {kind}: STEP files hold external spur wheels; write_stl writes its solid, write_dxf its "
            "transverse section"
        )


def _solid(writer: _Writer, gear: GearSpec, origin: np.ndarray, axes: np.ndarray) -> int:
    """Write the prism over profile and bore in a frame; return the number of the solid."""
    _check(gear)
    half = 0.5 * gear.face_width
    frame = _Frame(writer, origin, axes)
    faces: list[int] = []
    loops: dict[float, list[int]] = {-half: [], half: []}
    for edges in (profile_edges(gear), bore_edges(gear)):
        if edges:
            walls, low, high = _walls(frame, edges, half)
            faces += walls
            loops[-half].append(low)
            loops[half].append(high)
    for z, direction in ((-half, DOWN), (half, UP)):
        bounds = [
            writer.add(f"{'FACE_OUTER_BOUND' if k == 0 else 'FACE_BOUND'}('',#{loop},.T.)")
            for k, loop in enumerate(loops[z])
        ]
        plane = writer.add(f"PLANE('',#{frame.axes((0.0, 0.0, z), direction, (1.0, 0.0, 0.0))})")
        faces.append(writer.add(f"ADVANCED_FACE('',{_refs(bounds)},#{plane},.T.)"))
    shell = writer.add(f"CLOSED_SHELL('',{_refs(faces)})")
    return writer.add(f"MANIFOLD_SOLID_BREP('{gear.name}',#{shell})")


class _Frame:
    """Writes points and directions given in a wheel's frame."""

    def __init__(self, writer: _Writer, origin: np.ndarray, axes: np.ndarray) -> None:
        self.writer, self.origin, self.matrix = writer, origin, axes

    def point(self, xyz: Sequence[float]) -> int:
        return self.writer.point(self.origin + self.matrix @ np.asarray(xyz))

    def axes(self, origin: Sequence[float], z: Sequence[float], x: Sequence[float]) -> int:
        turned = (self.matrix @ np.asarray(v) for v in (z, x))
        return self.writer.axes(self.origin + self.matrix @ np.asarray(origin), *turned)

    def vector(self, xyz: Sequence[float]) -> int:
        return self.writer.vector(self.matrix @ np.asarray(xyz))


def _walls(frame: _Frame, edges: list[Edge], half: float) -> tuple[list[int], int, int]:
    """Write a closed chain's faces; return them and the loops that bound the lower and the upper end."""
    writer = frame.writer
    count = len(edges)
    corners = {z: [writer.add(f"VERTEX_POINT('',#{frame.point((*e.start, z))})") for e in edges] for z in (-half, half)}
    uprights = []
    for k, edge in enumerate(edges):
        line = writer.add(f"LINE('',#{frame.point((*edge.start, -half))},#{frame.vector(UP)})")
        uprights.append(writer.add(f"EDGE_CURVE('',#{corners[-half][k]},#{corners[half][k]},#{line},.T.)"))
    faces: list[int] = []
    rims: dict[float, list[int]] = {-half: [], half: []}
    for k, edge in enumerate(edges):
        follow = (k + 1) % count
        curve = {}
        for z in (-half, half):
            curve[z] = _curve(frame, edge, z)
            rims[z].append(writer.add(f"EDGE_CURVE('',#{corners[z][k]},#{corners[z][follow]},#{curve[z]},.T.)"))
        ways = [(rims[-half][k], "T"), (uprights[follow], "T"), (rims[half][k], "F"), (uprights[k], "F")]
        oriented = [writer.add(f"ORIENTED_EDGE('',*,*,#{number},.{way}.)") for number, way in ways]
        loop = writer.add(f"EDGE_LOOP('',{_refs(oriented)})")
        bound = writer.add(f"FACE_OUTER_BOUND('',#{loop},.T.)")
        surface, sense = _surface(frame, edge, curve[-half])
        faces.append(writer.add(f"ADVANCED_FACE('',(#{bound}),#{surface},.{sense}.)"))
    low = [writer.add(f"ORIENTED_EDGE('',*,*,#{n},.F.)") for n in reversed(rims[-half])]
    high = [writer.add(f"ORIENTED_EDGE('',*,*,#{n},.T.)") for n in rims[half]]
    return faces, writer.add(f"EDGE_LOOP('',{_refs(low)})"), writer.add(f"EDGE_LOOP('',{_refs(high)})")


def _curve(frame: _Frame, edge: Edge, z: float) -> int:
    writer = frame.writer
    if isinstance(edge, Arc):
        x = (edge.start - edge.centre) / edge.radius
        place = frame.axes((*edge.centre, z), UP if edge.sense > 0 else DOWN, (*x, 0.0))
        return writer.add(f"CIRCLE('',#{place},{_real(edge.radius * MM)})")
    if isinstance(edge, Spline):
        control = [frame.point((*p, z)) for p in edge.control]
        knots, repeats = np.unique(edge.knots, return_counts=True)
        return writer.add(
            f"B_SPLINE_CURVE_WITH_KNOTS('',{DEGREE},{_refs(control)},.UNSPECIFIED.,.F.,.F.,"
            f"({','.join(str(int(r)) for r in repeats)}),({','.join(_real(k) for k in knots)}),.UNSPECIFIED.)"
        )
    along = (edge.stop - edge.start) / math.hypot(*(edge.stop - edge.start))
    return writer.add(f"LINE('',#{frame.point((*edge.start, z))},#{frame.vector((*along, 0.0))})")


def _surface(frame: _Frame, edge: Edge, curve: int) -> tuple[int, str]:
    """Write the surface over an edge; return it and whether its own normal points out of the solid."""
    writer = frame.writer
    if isinstance(edge, Arc):
        x = (edge.start - edge.centre) / edge.radius
        place = frame.axes((*edge.centre, 0.0), UP, (*x, 0.0))
        surface = writer.add(f"CYLINDRICAL_SURFACE('',#{place},{_real(edge.radius * MM)})")
        return surface, "T" if edge.sense > 0 else "F"
    if isinstance(edge, Spline):
        return writer.add(f"SURFACE_OF_LINEAR_EXTRUSION('',#{curve},#{frame.vector(UP)})"), "T"
    along = (edge.stop - edge.start) / math.hypot(*(edge.stop - edge.start))
    return writer.add(f"PLANE('',#{frame.axes((*edge.start, 0.0), (along[1], -along[0], 0.0), (*along, 0.0))})"), "T"


def _product(writer: _Writer, solids: list[int], name: str) -> None:
    """Write what makes the solids a product with units."""
    add = writer.add
    length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    steradian = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    accuracy = add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-06),#{length},'distance_accuracy_value','')")
    context = add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{accuracy}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{steradian}))REPRESENTATION_CONTEXT('',''))"
    )
    origin = writer.axes(np.zeros(3), np.array(UP), np.array([1.0, 0.0, 0.0]))
    shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',{_refs([origin, *solids])},#{context})")
    application = add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')")
    add(f"APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})")
    setting = add(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
    product = add(f"PRODUCT('{name}','{name}','',(#{setting}))")
    formation = add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
    stage = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')")
    definition = add(f"PRODUCT_DEFINITION('design','',#{formation},#{stage})")
    whole = add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
    add(f"SHAPE_DEFINITION_REPRESENTATION(#{whole},#{shape})")
