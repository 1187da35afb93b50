"""Scenes of gear pairs, mechanisms and simulations, from the geometry and inertia that are simulated."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypedDict, Unpack, overload

import numpy as np

from gearmbs.gears import GearPair, PlanetarySet
from gearmbs.mechanism import Mechanism, ModalBody
from gearmbs.progress import waiting
from gearmbs.view.figures.style import BLUE, COLOURS, GREEN, GREY, ORANGE
from gearmbs.view.mesh import Mesh, ball, body_mesh, box, cylinder, joined
from gearmbs.view.motion import ContactProbe, PairMotion, chosen_times, marker_motion, mechanism_of, static_motion
from gearmbs.view.scene import UP, Deflection, Part, Scene
from gearmbs.view.solid import pair_solids

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution


TOLERANCE = 8e-6
"""Chords of the drawn profile, m; finer than a pixel."""

SHAFT = "#A9B0BA"
GEARS = (BLUE, ORANGE)
OTHERS = tuple(c for c in COLOURS if c not in GEARS)
SEEN_THROUGH = 0.22
"""Opacity of a body that is seen through: its faces behind each other still let the wheels stand out."""
ROD = 0.012
"""Radius of rods between markers, as a part of the mechanism's size."""


def gear_scene(
    pair: GearPair,
    *,
    torque: float | None = None,
    pitches: float = 1.0,
    frames: int = 1,
    shaft_radius: float = 0.015,
    shaft_length: float = 0.200,
    forces: bool = True,
    exaggeration: float = 1.0,
    title: str | None = None,
) -> Scene:
    """Return both wheels on their shafts, at rest under load: the paper's Fig. 1 from the simulated geometry.

    The axes are drawn as lines and, for a misaligned pair, the place where the driven axis ought to be.

    Parameters
    ----------
    pair : GearPair
    torque : float, optional
        On the driven wheel, N m; default the pair's, 0 for touching without load.
    pitches, frames : float, int
        How far the driver turns, in how many instants.
    shaft_radius, shaft_length : float
        m; no shaft with radius 0.
    forces : bool
        Draw the forces of the driver on the driven wheel.
    exaggeration : float
        Deviations of the flanks are drawn this many times larger.
    title : str, optional

    Examples
    --------
    >>> scene = gear_scene(GearPair.paper(misalignment="1 deg", backlash="0.4 mm"))
    >>> [part.name for part in scene.parts]
    ['driver', 'driven', 'driver shaft', 'driven shaft']
    """
    if shaft_radius < 0.0 or shaft_length <= 0.0:
        raise ValueError(f"shaft_radius {shaft_radius} m and shaft_length {shaft_length} m; give positive sizes")
    motion = static_motion(pair, torque=torque, pitches=pitches, frames=frames)
    names = ("driver", "driven")
    solids = pair_solids(pair, TOLERANCE, exaggeration)
    parts = [Part(names[w], solids[w], GEARS[w], motion.origins[w], motion.axes[w]) for w in (0, 1)]
    if shaft_radius > 0.0:
        shaft = cylinder(shaft_radius, shaft_length, 72)
        parts += [Part(f"{names[w]} shaft", shaft, SHAFT, motion.origins[w], motion.axes[w]) for w in (0, 1)]
    return Scene(
        parts,
        title or pair_title(pair),
        motion.label,
        motion.unit,
        motion.value,
        pair_forces(motion) if forces and (torque is None or torque > 0.0) else [],
        axis_lines(pair, motion, 1.3 * max(shaft_length, pair.driver.face_width)),
    )


def pair_title(pair: GearPair) -> str:
    """Return a heading that names the pair and its faults."""
    parts = [f"gear pair {pair.driver.teeth}/{pair.driven.teeth}"]
    if pair.misalignment:
        parts.append(f"axes {math.degrees(pair.misalignment):.3g}° apart ({pair.plane})")
    if pair.centre_distance_error:
        parts.append(f"centre distance {pair.centre_distance_error * 1e3:+.3g} mm")
    parts += [fault.label for fault in pair.faults]
    return ", ".join(parts)


def axis_lines(pair: GearPair, motion: PairMotion, length: float) -> list[tuple[str, str, np.ndarray]]:
    """Return the wheels' axes at the start, and where a misaligned one ought to be."""
    ways = motion.axes[:, 0, :, 2]
    half = 0.5 * length
    ends = np.stack([motion.origins[:, 0] - half * ways, motion.origins[:, 0] + half * ways], axis=1)
    out = [("axes", "#333333", ends)]
    if pair.misalignment:
        way = motion.axes[0, 0, :, 2]
        centre = motion.origins[1, 0]
        out.append(("aligned axis", GREY, np.array([[centre - half * way, centre + half * way]])))
    return out


def pair_forces(motion: PairMotion) -> list[np.ndarray]:
    """Return point and vector of the driver's force on the driven wheel, for each tooth pair and instant."""
    found = ContactProbe(motion.pair).over(motion)
    rows = [[np.stack([centre, force]) for *_, centre, force in points.pairs()] for points in found]
    return [np.array(r).reshape(-1, 2, 3) for r in rows]


@waiting("drawing the scene")
def mechanism_scene(
    mechanism: Mechanism,
    *,
    shapes: Mapping[str, Mesh] | None = None,
    joints: bool = True,
    factor: float | None = None,
    through: Collection[str] = (),
    title: str | None = None,
) -> Scene:
    """Return a mechanism at its initial position.

    Wheels of a gear contact are drawn from their geometry. Any other body is the cylinder or box that has its mass
    moments, and rods lead to its markers; a body without mass is its markers and the rods between them. Bodies that
    deform are drawn with their surface, bent as they are at the start.

    Parameters
    ----------
    mechanism : Mechanism
    shapes : mapping of body name to Mesh, optional
        Meshes in the bodies' frames instead.
    joints : bool
        Mark joints with small balls.
    factor : float, optional
        Bodies are drawn bent that many times as far as they are; default such that it can be seen.
    through : collection of body names
        Bodies that are seen through, as housings.
    title : str, optional

    Raises
    ------
    ValueError
        For names of bodies that there are not.
    """
    strange = [name for name in through if name not in mechanism.bodies]
    if strange:
        raise ValueError(f"through: no body {strange[0]!r}; the bodies are {', '.join(mechanism.bodies)}")
    poses, bent = {}, {}
    for name, body in mechanism.bodies.items():
        turned = body.orientation
        poses[name] = ((body.centre_of_mass()[0] - turned @ body.com)[None], turned[None])
        if isinstance(body, ModalBody):
            bent[name] = body.start[None]
    balls = _joint_parts(mechanism, None, np.zeros(1, dtype=int)) if joints else []
    bending = bodies_bent(mechanism, bent, factor)
    parts = [*_body_parts(mechanism, poses, shapes or {}, bending), *balls]
    parts = [replace(part, opacity=SEEN_THROUGH) if part.name in through else part for part in parts]
    scene = Scene(parts, title or mechanism.name + bending.remark, up=_up(mechanism))
    scene.lines = _lines(mechanism, scene.size)
    return scene


@waiting("drawing the scene")
def solution_scene(
    solution: Solution,
    *,
    start: float | None = None,
    stop: float | None = None,
    frames: int = 120,
    shapes: Mapping[str, Mesh] | None = None,
    joints: bool = False,
    forces: bool = True,
    factor: float | None = None,
    title: str | None = None,
) -> Scene:
    """Return a simulated mechanism in motion; see `mechanism_scene` for how its bodies are drawn.

    Parameters
    ----------
    solution : Solution
    start, stop : float, optional
        Span, s; default the last tenth of the simulation.
    frames : int
        At most so many instants, taken from the outputs.
    shapes, joints
        See `mechanism_scene`.
    forces : bool
        Draw the forces between the teeth of gear contacts.
    factor : float, optional
        Bodies that deform are drawn bent that many times as far as they are; default such that it can be seen. The
        title says how many times.
    title : str, optional
    """
    mechanism = mechanism_of(solution)
    chosen = chosen_times(solution.t, start, stop, frames)
    poses, bent = {}, {}
    for name, body in mechanism.bodies.items():
        turned = solution.orientation(name)[chosen]
        poses[name] = (solution.com_position(name)[chosen] - turned @ body.com, turned)
        if isinstance(body, ModalBody):
            bent[name] = solution.modal_coordinates(name)[chosen]
    bending = bodies_bent(mechanism, bent, factor)
    balls = _joint_parts(mechanism, solution, chosen) if joints else []
    parts = [*_body_parts(mechanism, poses, shapes or {}, bending), *balls]
    arrows = _contact_forces(solution, chosen) if forces else []
    heading = title or mechanism.name + bending.remark
    scene = Scene(parts, heading, "time", "s", solution.t[chosen], arrows, [], _up(mechanism))
    scene.lines = _lines(mechanism, scene.size)
    return scene


def _body_parts(mechanism: Mechanism, poses: dict, shapes: Mapping[str, Mesh], bending: Bending) -> list[Part]:
    unknown = [name for name in shapes if name not in poses]
    if unknown:
        raise ValueError(f"shapes: no body {unknown[0]!r}; the bodies are {', '.join(poses)}")
    wheels = _wheels(mechanism)
    reach = ROD * _size(mechanism)
    parts = []
    other = 0
    for name, (origins, axes) in poses.items():
        if name in wheels and name not in shapes:
            mesh, marker, colour = wheels[name]
            parts.append(Part(name, mesh.placed(marker.position, marker.orientation), colour, origins, axes))
            continue
        body = mechanism.bodies[name]
        mesh, deflection = bending.parts.get(name, (None, None)) if name not in shapes else (None, None)
        own = shapes.get(name) or mesh or body_mesh(body, 0.0 if wheels else reach)
        if own is not None:
            colour = SHAFT if wheels else OTHERS[other % len(OTHERS)]
            other += 1
            parts.append(Part(name, own, colour, origins, axes, deflection))
    return parts


def _wheels(mechanism: Mechanism) -> dict[str, tuple]:
    """Return mesh, marker and colour of every body that carries a wheel."""
    from gearmbs.gears.contact_element import GearContact

    out: dict[str, tuple] = {}
    for element in mechanism.elements.values():
        if isinstance(element, GearContact) and isinstance(element.pair, GearPair):
            solids = pair_solids(element.pair, TOLERANCE)
            for marker, mesh, colour in zip((element.i, element.j), solids, GEARS):
                out.setdefault(marker.body.name, (mesh, marker, colour))
    return out


def _size(mechanism: Mechanism) -> float:
    """Return the extent of centres and markers at the start, m."""
    points = [m.global_position() for b in (mechanism.ground, *mechanism.bodies.values()) for m in b.markers]
    points += [b.position + b.orientation @ b.com for b in mechanism.bodies.values()]
    return float(np.ptp(np.array(points), axis=0).max()) if points else 1.0


def _up(mechanism: Mechanism) -> tuple[float, float, float]:
    gravity = np.asarray(mechanism.gravity, dtype=float)
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return UP
    x, y, z = -gravity / size
    return float(x), float(y), float(z)


def _lines(mechanism: Mechanism, size: float) -> list[tuple[str, str, np.ndarray]]:
    """Return the axes of revolute joints on the ground of a geared mechanism."""
    if not _wheels(mechanism):
        return []
    half = 0.62 * size
    ends = []
    for joint in mechanism.joints.values():
        if joint.kind == "revolute" and (joint.i.body.is_ground or joint.j.body.is_ground):
            marker = joint.j if joint.j.body.is_ground else joint.i
            way, point = marker.global_orientation()[:, 2], marker.global_position()
            ends.append([point - half * way, point + half * way])
    return [("axes", "#333333", np.array(ends))] if ends else []


def _joint_parts(mechanism: Mechanism, solution: Solution | None, chosen: np.ndarray) -> list[Part]:
    mesh = ball(2.6 * ROD * _size(mechanism), 8)
    parts = []
    for name, joint in mechanism.joints.items():
        if not joint.rows or joint.kind in ("motion", "rotation", "translation", "coupler"):
            continue
        marker = joint.i
        if solution is None:
            origins, axes = marker.global_position()[None], marker.global_orientation()[None]
        else:
            origins, axes, _, _ = marker_motion(solution, marker, chosen)
        parts.append(Part(f"{name} ({joint.kind})", mesh, "#444B55", origins, axes))
    return parts


def _contact_forces(solution: Solution, chosen: np.ndarray) -> list[np.ndarray]:
    from gearmbs.gears.contact_element import GearContact

    total: list[list[np.ndarray]] = [[] for _ in range(chosen.size)]
    for element in mechanism_of(solution).elements.values():
        if isinstance(element, GearContact) and isinstance(element.pair, GearPair):
            poses = [marker_motion(solution, marker, chosen) for marker in (element.i, element.j)]
            motion = PairMotion(element.pair, "time", "s", solution.t[chosen], *(np.array(p) for p in zip(*poses)))
            for rows, found in zip(total, pair_forces(motion)):
                rows.extend(found)
    return [np.array(rows).reshape(-1, 2, 3) for rows in total] if any(total) else []


# Planetary sets.


PART_COLOURS = {"sun": BLUE, "planet": ORANGE, "ring": GREEN, "carrier": SHAFT}
PIN, ARM, GAP = 0.45, 0.25, 0.1
"""Radius of pins by that of the planets' roots, thickness of arms and their distance by the face width."""


class SceneKeywords(TypedDict, total=False):
    """Keywords that `mechanism_scene` and `solution_scene` share, for type checkers."""

    shapes: Mapping[str, Mesh] | None
    joints: bool
    factor: float | None
    title: str | None


class MechanismSceneKeywords(SceneKeywords, total=False):
    """Keywords of `mechanism_scene`."""

    through: Collection[str]


class SolutionSceneKeywords(SceneKeywords, total=False):
    """Keywords of `solution_scene`."""

    start: float | None
    stop: float | None
    frames: int
    forces: bool


@overload
def planetary_scene(gears: PlanetarySet, source: Mechanism, **options: Unpack[MechanismSceneKeywords]) -> Scene: ...


@overload
def planetary_scene(gears: PlanetarySet, source: Solution, **options: Unpack[SolutionSceneKeywords]) -> Scene: ...


def planetary_scene(gears: PlanetarySet, source: Mechanism | Solution, **options: Any) -> Scene:
    """Return a planetary set in three dimensions, its carrier as arms behind the wheels and pins through the planets.

    Parameters
    ----------
    gears : PlanetarySet
    source : Mechanism or Solution
        From `gearmbs.gears.planetary_mechanism`, at its start, or simulated, in motion.
    **options
        Of `mechanism_scene` or `solution_scene`.
    """
    make: Any = solution_scene if hasattr(source, "t") else mechanism_scene
    shapes = {"carrier": carrier_mesh(gears), **options.pop("shapes", {})}
    scene: Scene = make(source, shapes=shapes, **{"joints": False, "title": gears.name, **options})
    scene.parts = [
        replace(part, colour=PART_COLOURS[part.name.split()[0]]) if part.name.split()[0] in PART_COLOURS else part
        for part in scene.parts
    ]
    return scene


def carrier_mesh(gears: PlanetarySet) -> Mesh:
    """Return a carrier: a hub and arms behind the wheels, pins through the planets, in the frame of the set."""
    width = max(gears.planet.face_width, gears.sun.face_width)
    thick, radius = ARM * width, float(gears.carrier_radius)
    pin = PIN * gears.planet.root_radius
    behind = -(0.5 * width + GAP * width + 0.5 * thick)
    through = 0.5 * width + GAP * width - (behind - 0.5 * thick)
    pieces = [cylinder(2.0 * pin, thick).placed(np.array([0.0, 0.0, behind]), np.eye(3))]
    for angle in gears.angles or ():
        c, s = math.cos(float(angle)), math.sin(float(angle))
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        pieces.append(box(radius, 2.0 * pin, thick).placed(turned @ [0.5 * radius, 0.0, behind], turned))
        pieces.append(cylinder(1.5 * pin, thick).placed(turned @ [radius, 0.0, behind], turned))
        middle = behind - 0.5 * thick + 0.5 * through
        pieces.append(cylinder(pin, through).placed(turned @ [radius, 0.0, middle], turned))
    return joined(pieces)


# Bodies that deform as parts of a scene: their surfaces, bent by modal coordinates and a factor.


SHOWN = 0.1
"""Largest deflection drawn by default, as a part of the body's size."""


@dataclass(frozen=True)
class Bending:
    """Meshes and deflections of bodies by name, and what the title of a scene says of them."""

    parts: dict[str, tuple[Mesh, Deflection]] = field(default_factory=dict)
    remark: str = ""


def bodies_bent(mechanism: Mechanism, coordinates: Mapping[str, np.ndarray], factor: float | None) -> Bending:
    """Return what is drawn of the modal bodies of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    coordinates : mapping of body name to ndarray, shape (instants, n)
        Modal coordinates.
    factor : float, optional
        Deflections are drawn that many times as large; default such that the largest is a tenth of its body's size. All
        bodies have the same, so that what touches keeps touching as far as it can.

    Raises
    ------
    ValueError
        If the factor is not a finite number from 0 on.
    """
    if factor is not None and not (np.isfinite(factor) and factor >= 0.0):
        raise ValueError(f"factor is {factor}; give a finite number, 1 for deflections as they are, or None")
    found: dict[str, tuple[Mesh, Deflection]] = {}
    largest = 0.0
    for name, q in coordinates.items():
        body = mechanism.bodies[name]
        assert isinstance(body, ModalBody)
        surface = body.surface() if body.surface is not None else None
        if surface is None:
            continue
        bend = Deflection(surface.moved - body.mean[:, None], np.asarray(q, dtype=float))
        found[name] = (Mesh(surface.vertices, surface.triangles), bend)
        size = float(np.ptp(surface.vertices, axis=0).max())
        least = bend.reduced()
        far = max((float(np.linalg.norm(least.at(k), axis=1).max()) for k in range(len(q))), default=0.0)
        largest = max(largest, far / size)
    if not found or largest == 0.0:
        return Bending(found)
    times = SHOWN / largest if factor is None else factor
    scaled = {n: (mesh, Deflection(b.shapes, times * b.coordinates)) for n, (mesh, b) in found.items()}
    return Bending(scaled, "" if times == 1.0 else f", deflections {times:.3g} times")
