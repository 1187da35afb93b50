"""The transverse profile of a wheel exactly as simulated: root circle, root arc, involute, tip rounding, tip circle.

One half of a tooth is a chain of rising radius, given by its radius and its half angle from the tooth's middle; the
rest of the wheel follows by symmetry. Plane coordinates: the wheel's axis is the origin, tooth 0 points along +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from gearmbs.files import write_whole
from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.geometry import MM
from gearmbs.gears.spec import involute
from gearmbs.progress import waiting

TOLERANCE = 1e-6
"""Default largest distance of a chord from its curve, m."""

FEWEST = 4
"""Least number of chords a curved piece is cut into."""

CHORD_TOLERANCE = 1e-7
"""Distance between a profile and its chords, m, where none is given: a tenth of a micrometre, finer than wheels are
made."""
LAYERS = {"PROFILE": 7, "BORE": 7, "PITCH": 4, "BASE": 3, "LINE_OF_ACTION": 1}
"""Layers and their colour numbers."""


@dataclass(frozen=True)
class HalfTooth:
    """One flank of a tooth from the root circle to the tip circle.

    Attributes
    ----------
    radius : ndarray, shape (n,)
        Rising (falling for an internal wheel), m; the first on the root circle, the last on the tip circle.
    half_angle : ndarray, shape (n,)
        Angle from the tooth's middle, rad.
    """

    radius: np.ndarray
    half_angle: np.ndarray


def half_tooth(gear: GearSpec, tolerance: float = TOLERANCE) -> HalfTooth:
    """Return the flank of a tooth as a chain of points.

    Parameters
    ----------
    gear : GearSpec
    tolerance : float
        Largest distance of a chord from the curve, m.

    Raises
    ------
    ValueError
        If the tolerance is not positive.
    """
    if not (math.isfinite(tolerance) and tolerance > 0.0):
        raise ValueError(f"tolerance is {tolerance} m; give a positive length such as 1e-6")
    pieces = [_root_arc(gear, tolerance), _flank(gear, tolerance)]
    if gear.tip_rounding > 0.0:
        pieces.append(_tip_arc(gear, tolerance))
    radius, angle = pieces[0]
    for next_radius, next_angle in pieces[1:]:
        joined = int(abs(next_radius[0] - radius[-1]) < 1e-12 and abs(next_angle[0] - angle[-1]) < 1e-9)
        radius = np.concatenate([radius, next_radius[joined:]])
        angle = np.concatenate([angle, next_angle[joined:]])
    return HalfTooth(radius, angle)


def tooth_points(gear: GearSpec, tooth: int = 0, tolerance: float = TOLERANCE) -> np.ndarray:
    """Return one tooth from root to root, anticlockwise, shape (n, 2), m."""
    half = half_tooth(gear, tolerance)
    count = arc_chords(gear.tip_radius, 2.0 * half.half_angle[-1], tolerance)
    tip = np.linspace(-half.half_angle[-1], half.half_angle[-1], count + 1)[1:-1]
    radius = np.concatenate([half.radius, np.full(tip.size, gear.tip_radius), half.radius[::-1]])
    angle = np.concatenate([-half.half_angle, tip, half.half_angle[::-1]]) + 2.0 * math.pi * tooth / gear.teeth
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def gear_outline(gear: GearSpec, tolerance: float = TOLERANCE) -> np.ndarray:
    """Return the closed profile of a wheel, anticlockwise, without repeating the first point.

    Parameters
    ----------
    gear : GearSpec
    tolerance : float
        Largest distance of a chord from the curve, m.

    Returns
    -------
    ndarray, shape (n, 2)
        m; tooth 0 points along +x.
    """
    tooth = tooth_points(gear, 0, tolerance)
    land = land_angles(gear, tolerance)[1:-1]
    chain = np.vstack([tooth, gear.root_radius * np.column_stack([np.cos(land), np.sin(land)])])
    turns = 2.0 * math.pi * np.arange(gear.teeth) / gear.teeth
    c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
    x, y = chain[:, 0], chain[:, 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1).reshape(-1, 2)


def land_angles(gear: GearSpec, tolerance: float = TOLERANCE) -> np.ndarray:
    """Return the angles along the root circle from tooth 0 to tooth 1, both ends included, rad."""
    start, stop = gear.fillet_half_angle, 2.0 * math.pi / gear.teeth - gear.fillet_half_angle
    return np.linspace(start, stop, arc_chords(gear.root_radius, stop - start, tolerance, 1) + 1)


def circle(radius: float, tolerance: float = TOLERANCE) -> np.ndarray:
    """Return a circle about the origin as a closed chain without its last point, shape (n, 2)."""
    angle = np.linspace(0.0, 2.0 * math.pi, arc_chords(radius, 2.0 * math.pi, tolerance, 24) + 1)[:-1]
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def arc_chords(radius: float, angle: float, tolerance: float, fewest: int = FEWEST) -> int:
    """Return how many chords keep an arc of that opening within the tolerance."""
    step = 2.0 * math.acos(max(0.0, 1.0 - tolerance / radius)) if radius > 0.0 else math.pi
    return max(fewest, math.ceil(abs(angle) / step))


def profile_area(gear: GearSpec) -> float:
    """Return the area of the transverse profile in closed form, bore removed, m^2; of an internal wheel by its outline.

    Half of the closed integral of r^2 d(angle) over root circle, root arc, involute, tip rounding and tip circle. The
    mass of the simulated wheel is that of a disc of the pitch radius (`GearSpec.mass`); this is the true profile's.
    """
    if gear.internal:
        outline = gear_outline(gear)
        x, y = outline[:, 0], outline[:, 1]
        inside = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        return math.pi * gear.outer_radius**2 - inside
    start = max(gear.form_radius, gear.base_radius)
    tip_form = math.hypot(gear.base_radius, gear.tip_roll_length)
    root = gear.root_radius**2 * (math.pi / gear.teeth - gear.fillet_half_angle)
    low, high = _root_arc_span(gear)
    arm = gear.fillet_centre_radius * (math.sin(low) - math.sin(high))
    fillet = gear.fillet_radius * (arm - gear.fillet_radius * (high - low))
    tangents = [math.tan(math.acos(min(1.0, gear.base_radius / r))) for r in (start, tip_form)]
    flank = gear.base_radius**2 * (tangents[1] ** 3 - tangents[0] ** 3) / 3.0
    low, high = _tip_arc_span(gear)
    rounding = gear.tip_rounding * (gear.tip_rounding * low + gear.corner_radius * math.sin(low))
    tip = gear.tip_radius**2 * gear.corner_half_angle
    return gear.teeth * (root + fillet + flank + rounding + tip) - math.pi * gear.bore_radius**2


def _root_arc_span(gear: GearSpec) -> tuple[float, float]:
    """Directions from the arc's centre, against the radial direction, of its ends on root circle and flank, rad."""
    if gear.internal:
        return 0.0, math.acos(gear.fillet_radius / gear.fillet_centre_radius) - math.pi
    return math.pi, math.pi + math.acos(gear.fillet_radius / gear.fillet_centre_radius)


def _root_arc(gear: GearSpec, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    low, high = _root_arc_span(gear)
    turn = np.linspace(low, high, arc_chords(gear.fillet_radius, high - low, tolerance) + 1)
    along = gear.fillet_centre_radius + gear.fillet_radius * np.cos(turn)
    across = gear.fillet_radius * np.sin(turn)
    radius = np.hypot(along, across)
    radius[0] = gear.root_radius
    return radius, gear.fillet_half_angle + np.arctan2(across, along)


def _flank(gear: GearSpec, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Involute from where it begins to the tip (or its rounding), by equal steps of the root of the length of roll."""
    low, high = gear.form_roll_length, gear.tip_roll_length
    # a chord of roll angle du on an involute at length of roll s departs by s du^2 r_b / (8 r_b) = s du^2 / 8
    roll = abs(high - low) / gear.base_radius
    count = max(FEWEST, math.ceil(roll * math.sqrt(max(low, high) / (8.0 * tolerance))))
    roll_length = np.linspace(low, high, count + 1)
    radius = np.hypot(gear.base_radius, roll_length)
    turns = [gear.sign * involute(math.atan2(s, gear.base_radius)) for s in roll_length]
    angle = gear.base_half_angle - np.array(turns)
    if gear.tip_rounding == 0.0:
        radius[-1] = gear.tip_radius
    if gear.form_radius < gear.base_radius * (1.0 - 1e-12):
        radius = np.concatenate([[gear.form_radius], radius])
        angle = np.concatenate([[gear.base_half_angle], angle])
    return radius, angle


def _tip_arc_span(gear: GearSpec) -> tuple[float, float]:
    """Directions from the rounding's centre, against the radial direction, of its ends on flank and tip circle, rad."""
    form = math.hypot(gear.base_radius, gear.tip_roll_length)
    polar = gear.half_angle(form) - gear.corner_half_angle
    along, across = form * math.cos(polar) - gear.corner_radius, form * math.sin(polar)
    end = math.pi if gear.internal else 0.0
    return (math.atan2(across, along) if gear.tip_rounding > 0.0 else end), end


def _tip_arc(gear: GearSpec, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    low, high = _tip_arc_span(gear)
    turn = np.linspace(low, high, arc_chords(gear.tip_rounding, high - low, tolerance) + 1)
    along = gear.corner_radius + gear.tip_rounding * np.cos(turn)
    across = gear.tip_rounding * np.sin(turn)
    radius = np.hypot(along, across)
    radius[-1] = gear.tip_radius
    return radius, gear.corner_half_angle + np.arctan2(across, along)


# The transverse profile as exact curves (arcs, lines, involutes), for drawings and solids of other programs.


SPLINE_POINTS = 25
DEGREE = 5
"""An involute through 25 points by a spline of degree 5 is off by less than 1e-11 of the base radius."""


@dataclass(frozen=True)
class Line:
    """A straight edge; points in m."""

    start: np.ndarray
    stop: np.ndarray

    def turned(self, angle: float) -> Line:
        """Return the edge turned about the origin."""
        return Line(turn(self.start, angle), turn(self.stop, angle))


@dataclass(frozen=True)
class Arc:
    """A circular edge from ``start`` to ``stop`` about ``centre``, anticlockwise if ``sense`` is 1, else -1."""

    start: np.ndarray
    stop: np.ndarray
    centre: np.ndarray
    sense: int

    @property
    def radius(self) -> float:
        """Radius, m."""
        return float(np.hypot(*(self.start - self.centre)))

    @property
    def opening(self) -> float:
        """Angle run through, positive, rad."""
        a, b = self.start - self.centre, self.stop - self.centre
        return float(math.atan2(self.sense * (a[0] * b[1] - a[1] * b[0]), a @ b) % (2.0 * math.pi))

    def turned(self, angle: float) -> Arc:
        """Return the edge turned about the origin."""
        return Arc(turn(self.start, angle), turn(self.stop, angle), turn(self.centre, angle), self.sense)


@dataclass(frozen=True)
class Spline:
    """A B-spline edge of degree 5: control points (n, 2), m, and knots with repetitions."""

    control: np.ndarray
    knots: np.ndarray

    @property
    def start(self) -> np.ndarray:
        """First point, m."""
        return self.control[0]

    @property
    def stop(self) -> np.ndarray:
        """Last point, m."""
        return self.control[-1]

    def turned(self, angle: float) -> Spline:
        """Return the edge turned about the origin."""
        return Spline(turn(self.control, angle), self.knots)

    def points(self, count: int) -> np.ndarray:
        """Return points along the edge, both ends included, shape (count, 2)."""
        from scipy.interpolate import BSpline

        return BSpline(self.knots, self.control, DEGREE)(np.linspace(self.knots[0], self.knots[-1], count))


Edge = Line | Arc | Spline


def turn(points: np.ndarray, angle: float) -> np.ndarray:
    """Return points (..., 2) turned anticlockwise about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def polar(radius: float, angle: float) -> np.ndarray:
    """Return the point at a radius and an angle, m."""
    return radius * np.array([math.cos(angle), math.sin(angle)])


def profile_edges(gear: GearSpec) -> list[Edge]:
    """Return the closed profile of a perfect wheel, anticlockwise, tooth 0 along +x, from the foot of tooth 0 on."""
    flank = _flank_edges(gear)
    mirrored = [_mirrored(e) for e in reversed(flank)]
    corner = flank[-1].stop
    tip = Arc(corner, corner * [1.0, -1.0], np.zeros(2), 1)
    foot = mirrored[-1].stop
    pitch = 2.0 * math.pi / gear.teeth
    land = Arc(foot, turn(flank[0].start, pitch), np.zeros(2), 1)
    tooth: list[Edge] = [*flank, tip, *mirrored, land]
    return [e.turned(k * pitch) for k in range(gear.teeth) for e in tooth]


def bore_edges(gear: GearSpec) -> list[Edge]:
    """Return the bore (of an internal wheel the rim) as two half circles run clockwise; empty without one."""
    radius = gear.outer_radius if gear.internal else gear.bore_radius
    if radius == 0.0:
        return []
    east, west = polar(radius, 0.0), polar(-radius, 0.0)
    return [Arc(east, west, np.zeros(2), -1), Arc(west, east, np.zeros(2), -1)]


def backwards(edges: list[Edge]) -> list[Edge]:
    """Return a chain of edges run the other way."""
    return [_backwards(edge) for edge in reversed(edges)]


def _backwards(edge: Edge) -> Edge:
    if isinstance(edge, Line):
        return Line(edge.stop, edge.start)
    if isinstance(edge, Arc):
        return Arc(edge.stop, edge.start, edge.centre, -edge.sense)
    return Spline(edge.control[::-1], edge.knots[0] + edge.knots[-1] - edge.knots[::-1])


def _flank_edges(gear: GearSpec) -> list[Edge]:
    """Edges of the clockwise flank of tooth 0 from the root circle outward."""
    begin = max(gear.form_radius, gear.base_radius)
    centre = polar(gear.fillet_centre_radius, -gear.fillet_half_angle)
    foot = polar(gear.root_radius, -gear.fillet_half_angle)
    form = polar(gear.form_radius, -gear.half_angle(begin))
    edges: list[Edge] = [Arc(foot, form, centre, -gear.sign)]
    if gear.form_radius < gear.base_radius * (1.0 - 1e-12):
        edges.append(Line(form, polar(gear.base_radius, -gear.base_half_angle)))
    roll_length = np.linspace(gear.form_roll_length, gear.tip_roll_length, SPLINE_POINTS)
    radius = np.hypot(gear.base_radius, roll_length)
    angle = (
        np.array([gear.sign * involute(math.atan2(s, gear.base_radius)) for s in roll_length]) - gear.base_half_angle
    )
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    points[0] = edges[-1].stop
    places = np.linspace(0.0, 1.0, SPLINE_POINTS) if gear.internal else roll_length / roll_length[-1]
    spline = make_interp_spline(places, points, k=DEGREE)
    control = spline.c.copy()
    control[0], control[-1] = points[0], points[-1]
    edges.append(Spline(control, spline.t))
    if gear.tip_rounding > 0.0:
        corner = polar(gear.corner_radius, -gear.corner_half_angle)
        edges.append(Arc(points[-1], polar(gear.tip_radius, -gear.corner_half_angle), corner, gear.sign))
    return edges


def _mirrored(edge: Edge) -> Edge:
    """Return an edge reflected in the x axis and run backwards."""
    flip = np.array([1.0, -1.0])
    if isinstance(edge, Line):
        return Line(edge.stop * flip, edge.start * flip)
    if isinstance(edge, Arc):
        return Arc(edge.stop * flip, edge.start * flip, edge.centre * flip, edge.sense)
    knots = edge.knots[0] + edge.knots[-1] - edge.knots[::-1]
    return Spline(edge.control[::-1] * flip, knots)


# The profile as a DXF drawing: arcs as arcs, involutes as fine chains, circles on layers of their own.


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
