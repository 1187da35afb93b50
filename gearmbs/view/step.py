"""A wheel as a STEP solid (AP214), external or internal, spur or helical, written directly.

The boundary representation needs nothing but the profile's exact edges, so no CAD kernel is called for: every edge of
profile and bore or rim sweeps one face of the solid; see `gearmbs.view.step`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from gearmbs.files import write_whole
from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.geometry import MM
from gearmbs.progress import waiting
from gearmbs.view.profile import DEGREE, SPLINE_POINTS, Arc, Edge, Line, Spline, backwards, bore_edges, profile_edges
from gearmbs.view.solid import title_of

# Faces of a wheel's solid as STEP entities: what an edge of the transverse profile sweeps along the axis or a helix.
#
# Where the sweep is straight, an arc gives a cylinder, a line a plane, an involute an extruded B-spline. Along a helix,
# arcs about the wheel's axis still give cylinders; every other edge gives a B-spline surface, whose control net is that
# of the edge, turned by cosines and sines that are splines of the place along the axis themselves. Neighbouring
# surfaces and edges share these splines, so that the shell closes without gaps.


UP = (0.0, 0.0, 1.0)
DOWN = (0.0, 0.0, -1.0)
STATIONS_PER_RADIAN = 12
"""Stations of the splines of sine and cosine along a helix: off by 1e-10 with degree 5."""


class Writer:
    """Numbers the entities of a STEP file."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, text: str) -> int:
        """Add an entity and return its number."""
        self.lines.append(f"#{len(self.lines) + 1}={text};")
        return len(self.lines)

    def point(self, xyz: Sequence[float] | np.ndarray) -> int:
        return self.add(f"CARTESIAN_POINT('',({','.join(real(v * MM) for v in xyz)}))")

    def direction(self, xyz: Sequence[float] | np.ndarray) -> int:
        return self.add(f"DIRECTION('',({','.join(real(v) for v in xyz)}))")

    def axes(self, origin: np.ndarray, z: np.ndarray, x: np.ndarray) -> int:
        return self.add(f"AXIS2_PLACEMENT_3D('',#{self.point(origin)},#{self.direction(z)},#{self.direction(x)})")

    def vector(self, direction: np.ndarray) -> int:
        return self.add(f"VECTOR('',#{self.direction(direction)},1.)")


def real(value: float) -> str:
    text = f"{float(value):.12g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.'}E{exponent}"
    return text if "." in text else text + "."


def refs(numbers: Sequence[int]) -> str:
    return "(" + ",".join(f"#{n}" for n in numbers) + ")"


class Frame:
    """Writes points and directions given in a wheel's frame."""

    def __init__(self, writer: Writer, origin: np.ndarray, axes: np.ndarray) -> None:
        self.writer, self.origin, self.matrix = writer, origin, axes

    def point(self, xyz: Sequence[float]) -> int:
        return self.writer.point(self.origin + self.matrix @ np.asarray(xyz))

    def axes(self, origin: Sequence[float], z: Sequence[float], x: Sequence[float]) -> int:
        turned = (self.matrix @ np.asarray(v) for v in (z, x))
        return self.writer.axes(self.origin + self.matrix @ np.asarray(origin), *turned)

    def vector(self, xyz: Sequence[float]) -> int:
        return self.writer.vector(self.matrix @ np.asarray(xyz))

    def curve(self, control: np.ndarray, knots: np.ndarray) -> int:
        """Write a B-spline curve through space."""
        repeats, values = _knots(knots)
        points = refs([self.point(p) for p in control])
        return self.writer.add(
            f"B_SPLINE_CURVE_WITH_KNOTS('',{DEGREE},{points},.UNSPECIFIED.,.F.,.F.,{repeats},{values},.UNSPECIFIED.)"
        )


def _knots(knots: np.ndarray) -> tuple[str, str]:
    """Multiplicities and values of a knot vector as STEP lists."""
    values, repeats = np.unique(knots, return_counts=True)
    return "(" + ",".join(str(int(r)) for r in repeats) + ")", "(" + ",".join(real(k) for k in values) + ")"


class Sweep:
    """The way of an edge through the wheel's width: a rise along the axis with a turn about it.

    Parameters
    ----------
    half : float
        Half the face width, m.
    lead : float
        Turn per length, rad/m; 0 for a straight sweep.
    """

    def __init__(self, half: float, lead: float) -> None:
        self.half, self.lead = half, lead
        count = 2 * DEGREE + math.ceil(STATIONS_PER_RADIAN * 2 * half * abs(lead))
        z = np.linspace(-half, half, count)
        spline = make_interp_spline(z, np.column_stack([np.cos(lead * z), np.sin(lead * z), z]), k=DEGREE)
        self.knots = spline.t
        self.turns = spline.c.copy()
        # the ends lie on the end faces to the last digit
        self.turns[0], self.turns[-1] = ((math.cos(lead * z), math.sin(lead * z), z) for z in (-half, half))

    def points(self, xy: np.ndarray) -> np.ndarray:
        """Control points along the sweep of points of the profile, shape (n, 2): shape (n, stations, 3)."""
        x, y = xy[:, :1], xy[:, 1:]
        cos, sin, z = self.turns.T
        return np.stack([cos * x - sin * y, sin * x + cos * y, np.broadcast_to(z, (len(xy), z.size))], axis=-1)

    def at(self, edge: Edge, z: float) -> Edge:
        """Return the edge where it passes the section ``z``."""
        return edge.turned(self.lead * z) if self.lead else edge


def swept_edges(edges: list[Edge], sweep: Sweep) -> list[Edge]:
    """Return the edges of which a sweep can be written: for a helix, arcs about the axis and splines."""
    if not sweep.lead:
        return edges
    return [edge if isinstance(edge, Spline) or _about_axis(edge) else _as_spline(edge) for edge in edges]


def _about_axis(edge: Edge) -> bool:
    return isinstance(edge, Arc) and not edge.centre.any()


def _as_spline(edge: Line | Arc) -> Spline:
    """Return an edge as a spline."""
    share = np.linspace(0.0, 1.0, SPLINE_POINTS)[:, None]
    if isinstance(edge, Line):
        points = (1 - share) * edge.start + share * edge.stop
    else:
        from_centre = edge.start - edge.centre
        angle = edge.sense * edge.opening * share
        across = np.array([-from_centre[1], from_centre[0]])
        points = edge.centre + np.cos(angle) * from_centre + np.sin(angle) * across
    spline = make_interp_spline(share[:, 0], points, k=DEGREE)
    control = spline.c.copy()
    control[0], control[-1] = edge.start, edge.stop
    return Spline(control, spline.t)


def walls(frame: Frame, profile: list[Edge], sweep: Sweep) -> tuple[list[int], int, int]:
    """Write a closed chain's faces; return them and the loops that bound the lower and the upper end."""
    writer, half = frame.writer, sweep.half
    edges = swept_edges(profile, sweep)
    ends = {z: [sweep.at(edge, z) for edge in edges] for z in (-half, half)}
    corners = {
        z: [writer.add(f"VERTEX_POINT('',#{frame.point((*e.start, z))})") for e in placed] for z, placed in ends.items()
    }
    uprights = []
    for k, edge in enumerate(edges):
        if sweep.lead:
            line = frame.curve(sweep.points(edge.start[None])[0], sweep.knots)
        else:
            line = writer.add(f"LINE('',#{frame.point((*edge.start, -half))},#{frame.vector(UP)})")
        uprights.append(writer.add(f"EDGE_CURVE('',#{corners[-half][k]},#{corners[half][k]},#{line},.T.)"))
    faces: list[int] = []
    rims: dict[float, list[int]] = {-half: [], half: []}
    for k, edge in enumerate(edges):
        follow = (k + 1) % len(edges)
        curve = {}
        for z in (-half, half):
            curve[z] = _curve(frame, ends[z][k], z)
            rims[z].append(writer.add(f"EDGE_CURVE('',#{corners[z][k]},#{corners[z][follow]},#{curve[z]},.T.)"))
        ways = [(rims[-half][k], "T"), (uprights[follow], "T"), (rims[half][k], "F"), (uprights[k], "F")]
        oriented = [writer.add(f"ORIENTED_EDGE('',*,*,#{number},.{way}.)") for number, way in ways]
        loop = writer.add(f"EDGE_LOOP('',{refs(oriented)})")
        bound = writer.add(f"FACE_OUTER_BOUND('',#{loop},.T.)")
        surface, sense = _surface(frame, edge, curve[-half], sweep)
        faces.append(writer.add(f"ADVANCED_FACE('',(#{bound}),#{surface},.{sense}.)"))
    low = [writer.add(f"ORIENTED_EDGE('',*,*,#{n},.F.)") for n in reversed(rims[-half])]
    high = [writer.add(f"ORIENTED_EDGE('',*,*,#{n},.T.)") for n in rims[half]]
    return faces, writer.add(f"EDGE_LOOP('',{refs(low)})"), writer.add(f"EDGE_LOOP('',{refs(high)})")


def _curve(frame: Frame, edge: Edge, z: float) -> int:
    writer = frame.writer
    if isinstance(edge, Arc):
        x = (edge.start - edge.centre) / edge.radius
        place = frame.axes((*edge.centre, z), UP if edge.sense > 0 else DOWN, (*x, 0.0))
        return writer.add(f"CIRCLE('',#{place},{real(edge.radius * MM)})")
    if isinstance(edge, Spline):
        return frame.curve(np.column_stack([edge.control, np.full(len(edge.control), z)]), edge.knots)
    along = (edge.stop - edge.start) / math.hypot(*(edge.stop - edge.start))
    return writer.add(f"LINE('',#{frame.point((*edge.start, z))},#{frame.vector((*along, 0.0))})")


def _surface(frame: Frame, edge: Edge, curve: int, sweep: Sweep) -> tuple[int, str]:
    """Write the surface over an edge; return it and whether its own normal points out of the solid."""
    writer = frame.writer
    if isinstance(edge, Arc):
        x = (edge.start - edge.centre) / edge.radius
        place = frame.axes((*edge.centre, 0.0), UP, (*x, 0.0))
        surface = writer.add(f"CYLINDRICAL_SURFACE('',#{place},{real(edge.radius * MM)})")
        return surface, "T" if edge.sense > 0 else "F"
    if isinstance(edge, Spline):
        if sweep.lead:
            return _twisted(frame, edge, sweep), "T"
        return writer.add(f"SURFACE_OF_LINEAR_EXTRUSION('',#{curve},#{frame.vector(UP)})"), "T"
    along = (edge.stop - edge.start) / math.hypot(*(edge.stop - edge.start))
    return writer.add(f"PLANE('',#{frame.axes((*edge.start, 0.0), (along[1], -along[0], 0.0), (*along, 0.0))})"), "T"


def _twisted(frame: Frame, edge: Spline, sweep: Sweep) -> int:
    """Write the B-spline surface that a spline sweeps along a helix."""
    net = ",".join(refs([frame.point(p) for p in row]) for row in sweep.points(edge.control))
    (many_u, knots_u), (many_v, knots_v) = _knots(edge.knots), _knots(sweep.knots)
    return frame.writer.add(
        f"B_SPLINE_SURFACE_WITH_KNOTS('',{DEGREE},{DEGREE},({net}),.UNSPECIFIED.,.F.,.F.,.F.,"
        f"{many_u},{many_v},{knots_u},{knots_v},.UNSPECIFIED.)"
    )


@waiting("writing the solids")
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
    """
    writer = Writer()
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
        "FILE_DESCRIPTION(('gears'),'2;1');",
        f"FILE_NAME('{name}','1970-01-01T00:00:00',(''),(''),'gearmbs','gearmbs','');",
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));",
        "ENDSEC;",
        "DATA;",
    ]
    return write_whole(path, "\n".join([*header, *writer.lines, "ENDSEC;", "END-ISO-10303-21;"]) + "\n")


def _solid(writer: Writer, gear: GearSpec, origin: np.ndarray, axes: np.ndarray) -> int:
    """Write what profile and bore (or rim) sweep in a frame; return the number of the solid."""
    half = 0.5 * gear.face_width
    frame = Frame(writer, origin, axes)
    faces: list[int] = []
    loops: dict[float, list[int]] = {-half: [], half: []}
    toothed = (profile_edges(gear), gear.twist_tangent / gear.base_radius)
    bore = (bore_edges(gear), 0.0)
    chains = [toothed, bore]
    if gear.internal:
        # material lies to the left of every chain, and the outer one comes first
        chains = [(backwards(edges), lead) for edges, lead in (bore, toothed)]
    for edges, lead in chains:
        if edges:
            made, low, high = walls(frame, edges, Sweep(half, lead))
            faces += made
            loops[-half].append(low)
            loops[half].append(high)
    for z, direction in ((-half, DOWN), (half, UP)):
        bounds = [
            writer.add(f"{'FACE_OUTER_BOUND' if k == 0 else 'FACE_BOUND'}('',#{loop},.T.)")
            for k, loop in enumerate(loops[z])
        ]
        plane = writer.add(f"PLANE('',#{frame.axes((0.0, 0.0, z), direction, (1.0, 0.0, 0.0))})")
        faces.append(writer.add(f"ADVANCED_FACE('',{refs(bounds)},#{plane},.T.)"))
    shell = writer.add(f"CLOSED_SHELL('',{refs(faces)})")
    return writer.add(f"MANIFOLD_SOLID_BREP('{gear.name}',#{shell})")


def _product(writer: Writer, solids: list[int], name: str) -> None:
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
    shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',{refs([origin, *solids])},#{context})")
    application = add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')")
    add(f"APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})")
    setting = add(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
    product = add(f"PRODUCT('{name}','{name}','',(#{setting}))")
    formation = add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
    stage = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')")
    definition = add(f"PRODUCT_DEFINITION('design','',#{formation},#{stage})")
    whole = add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
    add(f"SHAPE_DEFINITION_REPRESENTATION(#{whole},#{shape})")
