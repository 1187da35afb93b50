"""Flat drawings: teeth in mesh seen along the axis, with contact points and forces; a wheel; a mechanism as a graph."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch, PathPatch, Polygon
from matplotlib.path import Path

from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.geometry import MM, Placement
from gearmbs.units import shown
from gearmbs.view.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    drawing,
    look,
    new_figure,
)
from gearmbs.view.motion import ContactPoints, ContactProbe, mean_frame, static_motion
from gearmbs.view.profile import circle, gear_outline
from gearmbs.view.solid import pair_deviations, section_outline

if TYPE_CHECKING:
    from gearmbs.mechanism import Mechanism

TOLERANCE = 2e-6
"""Distance, m, between an outline and its chords: below the width of a drawn line at any size of a page."""
ARROW = 1.6
"""Length of the arrow of the largest force, modules."""

FILLS = ("#C9DDF0", "#FBE3B5")
LINES = (BLUE, "#B57900")


def mesh_view(
    pair: GearPair,
    *,
    driver_angle: float | None = None,
    torque: float | None = None,
    place: Placement | None = None,
    points: ContactPoints | None = None,
    width: float | None = None,
    section: float = 0.0,
    exaggeration: float = 1.0,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the teeth in mesh, their contact points and the forces of the driver on the driven wheel.

    Parameters
    ----------
    pair : GearPair
    driver_angle : float, optional
        Position, rad; default 0.
    torque : float, optional
        Load on the driven wheel, N m, at rest; default the pair's; 0 for touching without load.
    place : Placement, optional
        Poses of the wheels instead of those at rest under load, e.g. of one instant of a simulation.
    points : ContactPoints, optional
        Contacts at that pose; default found at rest.
    width : float, optional
        Width of the detail, m; default seven modules.
    section : float
        Section along the face that is drawn, m from mid-face.
    exaggeration : float
        Deviations of the flanks are drawn this many times larger.
    title : str, optional
    ax : matplotlib axes, optional

    Returns
    -------
    matplotlib.figure.Figure
        Lengths in mm; x along the line of centres, from the driver's axis.
    """
    probe = ContactProbe(pair)
    if place is None:
        place = _at_rest(pair, driver_angle or 0.0, torque)
        points = None
    if points is None:
        points = probe.at(place)
    span = 7.0 * pair.driver.module if width is None else float(width)
    if not span > 0.0:
        raise ValueError(f"width is {width} m; give a positive width of the detail")
    with drawing(ax, 7.0, 6.6, title=title) as (figure, ax):
        mean = mean_frame(place)
        draw_wheels(ax, pair, place, mean, section, exaggeration)
        draw_lines(ax, pair)
        draw_contacts(ax, pair, points, place, mean)
        centre = pitch_point(pair)
        ax.set_xlim((centre - 0.5 * span) * MM, (centre + 0.5 * span) * MM)
        ax.set_ylim(-0.5 * span * MM, 0.5 * span * MM)
        ax.set_aspect("equal")
        ax.set_xlabel("along the line of centres, mm")
        ax.set_ylabel("across, mm")
        _legend(ax, exaggeration)
    return figure


def draw_wheels(
    ax: Axes, pair: GearPair, place: Placement, mean: np.ndarray, section: float = 0.0, exaggeration: float = 1.0
) -> None:
    """Draw both wheels' sections, their bores and base circles."""
    poses = ((place.origin_1, place.axes_1), (place.origin_2, place.axes_2))
    for k, (wheel, deviation, pose) in enumerate(zip(pair.wheels, pair_deviations(pair), poses)):
        outline = section_outline(wheel, section, TOLERANCE, deviation, exaggeration)
        shape = projected(outline, *pose, place.origin_1, mean, section)
        if wheel.internal:
            rim = projected(circle(wheel.outer_radius, 1e-5), *pose, place.origin_1, mean, section)
            # run the other way, the rim leaves the space within the teeth open
            body = Path.make_compound_path(*(Path(_closed(p) * MM, closed=True) for p in (shape, rim[::-1])))
            ax.add_patch(PathPatch(body, facecolor=FILLS[k], edgecolor=LINES[k], linewidth=1.1, zorder=2))
        else:
            look = {"facecolor": FILLS[k], "edgecolor": LINES[k], "linewidth": 1.1}
            ax.add_patch(Polygon(shape * MM, closed=True, zorder=2, **look))
        for radius, style in ((wheel.base_radius, (0, (5, 3))), (wheel.pitch_radius, (0, (1, 2)))):
            ring = projected(_closed(circle(radius, 1e-5)), *pose, place.origin_1, mean, section)
            ax.plot(*(ring.T * MM), color=GREY, linewidth=0.8, linestyle=style, zorder=2.5)
        if wheel.bore_radius > 0.0:
            hole = projected(circle(wheel.bore_radius, 1e-5), *pose, place.origin_1, mean, section)
            ax.add_patch(Polygon(hole * MM, closed=True, facecolor="white", edgecolor=LINES[k], zorder=2.2))


def projected(
    points: np.ndarray, origin: np.ndarray, axes: np.ndarray, base: np.ndarray, mean: np.ndarray, section: float
) -> np.ndarray:
    """Return where a wheel's generatrices through plane points (n, 2) cut the plane at ``section`` of the mean axis.

    The result, shape (n, 2), is in the mean frame at ``base``.
    """
    local = mean.T @ axes
    start = points @ local[:, :2].T + mean.T @ (np.asarray(origin) - base)
    reach = (section - start[:, 2]) / local[2, 2]
    return start[:, :2] + reach[:, None] * local[:2, 2]


def draw_lines(ax: Axes, pair: GearPair) -> None:
    """Draw the lines of action of drive and back flanks and the line of centres."""
    for side, colour in ((pair.rotation, PURPLE), (-pair.rotation, GREY)):
        ax.plot(*(action_ends(pair, side).T * MM), color=colour, linewidth=0.9, linestyle=(0, (7, 2, 1, 2)), zorder=3)
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=1)


def draw_contacts(ax: Axes, pair: GearPair, points: ContactPoints, place: Placement, mean: np.ndarray) -> None:
    """Draw contact points, larger where more load is, and one arrow a tooth pair with the size of its force."""
    if points.force.size == 0 or points.force.max() <= 0.0:
        ax.annotate("no contact", (0.5, 0.03), xycoords="axes fraction", ha="center", color=VERMILLION)
        return
    flat = (points.point - place.origin_1) @ mean
    size = 6.0 + 34.0 * points.force / points.force.max()
    ax.scatter(flat[:, 0] * MM, flat[:, 1] * MM, s=size, color=VERMILLION, edgecolor="white", linewidth=0.4, zorder=5)
    pairs = points.pairs()
    largest = max(float(np.linalg.norm(force)) for *_, force in pairs)
    unit = ARROW * pair.driver.module / largest
    for _, first, second, centre, force in pairs:
        at = ((centre - place.origin_1) @ mean)[:2] * MM
        tip = at + (force @ mean)[:2] * unit * MM
        ax.annotate(
            "",
            tip,
            at,
            arrowprops={"arrowstyle": "-|>", "color": VERMILLION, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0},
            zorder=6,
        )
        ax.annotate(
            f"{force_text(float(np.linalg.norm(force)))}\nteeth {first}/{second}",
            at,
            xytext=(9, -4),
            textcoords="offset points",
            va="top",
            fontsize=8.5,
            color="#7A2E00",
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "alpha": 0.75, "edgecolor": "none"},
            zorder=7,
            annotation_clip=True,
        )


def force_text(newton: float) -> str:
    """Return a force with a readable unit."""
    return f"{newton / 1e3:.2f} kN" if newton >= 1e3 else f"{newton:.0f} N"


def _at_rest(pair: GearPair, driver_angle: float, torque: float | None) -> Placement:
    from gearmbs.gears.transmission import StaticMesh

    load = float(pair.torque if torque is None else torque)
    if driver_angle == 0.0 or load < 0.0:
        return static_motion(pair, torque=torque, frames=1).placement(0)
    if load == 0.0:
        return pair.placement(driver_angle)
    mesh = StaticMesh(pair)
    lag = mesh.turning * pair.penetration(load) / pair.driven.base_radius
    return pair.frames(driver_angle, mesh.loaded_angle(driver_angle, load, mesh.ideal_angle(driver_angle) + lag))


def pitch_point(pair: GearPair) -> float:
    """Return where the pitch circles touch on the line of centres, m from the driver's axis.

    Towards the driven wheel it counts positive; the mesh of an internal one is on the other side.
    """
    return pair.centre_distance * pair.driver.base_radius / pair.base_radius_sum


def action_ends(pair: GearPair, side: int) -> np.ndarray:
    """Return both ends of a side's line of action, shape (2, 2), m from the driver's axis.

    From the driver's base circle to that of its mate, in an internal pair to the driver's tip circle.
    """
    alpha, gear = pair.working_pressure_angle, pair.wheels[0]
    begin = gear.base_radius * np.array([math.cos(alpha), -side * math.sin(alpha)])
    reach = pair.line_of_action if pair.sign > 0 else gear.tip_roll_length
    return pair.sign * np.array([begin, begin + reach * np.array([math.sin(alpha), side * math.cos(alpha)])])


def _closed(points: np.ndarray) -> np.ndarray:
    return np.vstack([points, points[:1]])


def _legend(ax: Axes, exaggeration: float) -> None:
    entries = [
        (Polygon([[0, 0]], facecolor=FILLS[0], edgecolor=LINES[0]), "driver"),
        (Polygon([[0, 0]], facecolor=FILLS[1], edgecolor=LINES[1]), "driven"),
        (Line2D([], [], color=VERMILLION, marker="o", linewidth=1.8, markersize=4), "contact, force on driven"),
        (Line2D([], [], color=PURPLE, linewidth=0.9, linestyle=(0, (7, 2, 1, 2))), "line of action"),
        (Line2D([], [], color=GREY, linewidth=0.8, linestyle=(0, (5, 3))), "base circle"),
        (Line2D([], [], color=GREY, linewidth=0.8, linestyle=(0, (1, 2))), "pitch circle"),
    ]
    if exaggeration != 1.0:
        entries.append((Line2D([], [], linewidth=0), f"deviations × {exaggeration:g}"))
    handles, labels = zip(*entries)
    ax.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)


# A single wheel seen along its axis, with its circles.


def wheel_plot(gear: GearSpec, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Draw a wheel across its axis, with its bore and its pitch, base and root circles.

    Parameters
    ----------
    gear : GearSpec
    title : str, optional
    ax : matplotlib axes, optional

    Examples
    --------
    >>> figure = wheel_plot(GearSpec(20, "2 mm"))
    >>> figure.axes[0].get_title(loc="left")
    'gear: 20 teeth, module 2 mm, face 20 mm'
    """
    with drawing(ax, 5.2, 5.6, legend=2) as (figure, ax):
        turn = np.linspace(0.0, 2.0 * np.pi, 361)
        outline = gear_outline(gear) * MM
        body, empty = "#DCE8F3", "white"
        if gear.internal:
            rim = gear.outer_radius * MM
            ax.fill(rim * np.cos(turn), rim * np.sin(turn), facecolor=body, edgecolor=BLUE, linewidth=1.1)
        inside = empty if gear.internal else body
        ax.fill(*np.vstack([outline, outline[:1]]).T, facecolor=inside, edgecolor=BLUE, linewidth=1.1)
        circles = (
            ("pitch circle", gear.pitch_radius, VERMILLION, (0, (8, 3, 2, 3))),
            ("base circle", gear.base_radius, GREEN, (0, (4, 3))),
            ("root circle", gear.root_radius, GREY, (0, (1, 2))),
        )
        for name, radius, colour, dashes in circles:
            label = f"{name}, {2 * radius * MM:.4g} mm"
            ax.plot(radius * MM * np.cos(turn), radius * MM * np.sin(turn), color=colour, linestyle=dashes, label=label)
        if gear.bore_radius:
            bore = gear.bore_radius * MM
            ax.fill(bore * np.cos(turn), bore * np.sin(turn), facecolor="white", edgecolor=BLUE, linewidth=1.1)
        ax.set_aspect("equal")
        ax.set_xlabel("mm")
        ax.set_ylabel("mm")
        helix = f", helix {shown(gear.helix_angle, 'deg', '.4g')}" if gear.helix_angle else ""
        sizes = f"module {shown(gear.module, 'mm', '.4g')}, face {shown(gear.face_width, 'mm', '.4g')}{helix}"
        ax.set_title(title or f"{gear.name}: {abs(gear.teeth)} teeth, {sizes}")
    return figure


# A mechanism as a graph: bodies in layers above the ground, joints and forces between them.


GROUND = "ground"
SWEEPS = 8
"""Times the order within the layers is improved."""

LETTERS = 16
"""Letters of a name in one line."""

BEND = 0.34
"""Sideways way of an edge beside others between the same bodies, in distances of the layers."""

STYLES = {
    "joint": (BLUE, "-"),
    "motion": (ORANGE, "-"),
    "constraint": (PURPLE, "-"),
    "force": (GREEN, (0, (4, 2))),
}
"""Colour and line of each kind of edge."""


class Edge(NamedTuple):
    """What connects two bodies."""

    first: str
    second: str
    name: str
    text: str
    style: str


def mechanism_plot(mechanism: Mechanism, *, title: str | None = None) -> Figure:
    """Draw the topology of a mechanism: which bodies joints, motions and forces connect.

    The ground is at the bottom, above it in layers the bodies that are one, two ... joints away.

    Parameters
    ----------
    mechanism : Mechanism
    title : str, optional

    Examples
    --------
    >>> from gearmbs.mechanism import Mechanism
    >>> m = Mechanism("pendulum")
    >>> pin = m.revolute("pin", m.body("rod", 1.0, (0.1, 0.1, 0.1)), m.ground)
    >>> mechanism_plot(m).axes[0].get_title(loc="left")
    'pendulum: 1 body, 1 degree of freedom'
    """
    edges = edges_of(mechanism)
    places = layers([GROUND, *mechanism.bodies], edges)
    widest = max(sum(y == row for _, y in places.values()) for row in {y for _, y in places.values()})
    height = 1 + max(y for _, y in places.values())
    with look():
        figure = new_figure(max(5.0, min(2.3 * widest + 1.2, 16.0)), max(2.8, min(1.75 * height + 0.9, 12.0)))
        ax = figure.subplots()
        ax.axis("off")
        groups: dict[frozenset[str], list[Edge]] = {}
        for edge in edges:
            groups.setdefault(frozenset((edge.first, edge.second)), []).append(edge)
        for group in groups.values():
            _draw_edges(ax, group, places)
        for name, place in places.items():
            _draw_body(ax, name, place, name == GROUND)
        _face_legend(ax, {edge.style for edge in edges})
        xs, ys = np.array(list(places.values())).T
        ax.set_xlim(xs.min() - 0.75, xs.max() + 0.75)
        ax.set_ylim(ys.min() - 0.45, ys.max() + 0.5)
        ax.set_title(title or _title(mechanism))
    return figure


def edges_of(mechanism: Mechanism) -> list[Edge]:
    """Return what connects the bodies of a mechanism: motions on a joint by the side of it, couplers, forces."""
    found = []
    for name, joint in mechanism.joints.items():
        between = joint.i.body.name, joint.j.body.name
        if joint.kind == "coupler":
            bodies = _several(term.i.body.name for row in joint.rows for term in row.terms)
            bodies = bodies if len(bodies) > 1 else _several(between)
            found += [Edge(a, b, name, f"{name}\ncoupler", "constraint") for a, b in pairwise(bodies)]
            continue
        moved = joint.kind in ("rotation", "translation", "motion") or any(
            row.function is not None and not _is_constant(row.function) for row in joint.rows
        )
        kind = joint.kind.replace("_", " ")
        found.append(Edge(*between, name, f"{name}\n{kind}", "motion" if moved else "joint"))
    for name, element in mechanism.elements.items():
        kind = str(getattr(element, "kind", "force")).replace("_", " ")
        markers = getattr(element, "markers", None) or (element.i, element.j)
        bodies = _several(m.body.name for m in markers)
        if kind == "friction":
            # on a joint that is drawn already
            continue
        if len(bodies) == 1:
            bodies = [*bodies, GROUND] if bodies[0] != GROUND else bodies
        found += [Edge(bodies[0], other, name, f"{name}\n{kind}", "force") for other in bodies[1:]]
    return found


def _is_constant(function: object) -> bool:
    return getattr(function, "kind", None) == 0


def _several(names: Iterable[str]) -> list[str]:
    """Return names in order, each once."""
    return list(dict.fromkeys(names))


def layers(names: list[str], edges: list[Edge]) -> dict[str, tuple[float, float]]:
    """Return a place for each body: its layer is its distance from the ground along joints, else along forces.

    Within the layers the bodies are ordered by the mean place of their neighbours.
    """
    depth = {GROUND: 0}
    for styles in (("joint", "motion", "constraint"), ("force",)):
        reached = list(depth)
        for name in reached:
            for edge in edges:
                if edge.style in styles and name in (edge.first, edge.second):
                    other = edge.second if edge.first == name else edge.first
                    if other not in depth:
                        depth[other] = depth[name] + 1
                        reached.append(other)
    for name in names:
        depth.setdefault(name, 1)
    rows: dict[int, list[str]] = {}
    for name in names:
        rows.setdefault(depth[name], []).append(name)
    x = {name: k - 0.5 * (len(row) - 1) for row in rows.values() for k, name in enumerate(row)}
    near = {
        name: [e.second if e.first == name else e.first for e in edges if name in (e.first, e.second)] for name in names
    }
    for _ in range(SWEEPS):
        for level in sorted(rows):
            row = rows[level]
            row.sort(key=lambda name: float(np.mean([x[o] for o in near[name]])) if near[name] else x[name])
            for k, name in enumerate(row):
                x[name] = k - 0.5 * (len(row) - 1)
    x[GROUND] = 0.0
    return {name: (1.25 * x[name], float(depth[name])) for name in names}


def _draw_edges(ax: Axes, group: list[Edge], places: dict[str, tuple[float, float]]) -> None:
    """Draw what connects two bodies, side by side, each with its name on a white ground."""
    for k, edge in enumerate(group):
        (x1, y1), (x2, y2) = places[edge.first], places[edge.second]
        colour, line = STYLES[edge.style]
        way = np.array([x2 - x1, y2 - y1])
        length = float(np.hypot(*way)) or 1.0
        aside = np.array([-way[1], way[0]]) / length
        if aside[0] < 0.0 or (aside[0] == 0.0 and aside[1] < 0.0):
            aside = -aside
        bend = 2.6 * BEND * (k - 0.5 * (len(group) - 1))
        if not bend and (abs(y1 - y2) > 1.0 or (y1 == y2 and abs(x1 - x2) > 1.3)):
            # past the bodies between
            bend = 0.55 * length * 0.5
        s = np.linspace(0.0, 1.0, 31)[:, None]
        bow = np.array([x1, y1]) + s * way + 4.0 * s * (1.0 - s) * bend * aside * 0.5
        ax.plot(*bow.T, color=colour, linestyle=line, linewidth=1.6, zorder=1)
        ax.annotate(
            edge.text, bow[15], ha="center", va="center", fontsize=7.5, color=colour, zorder=3, linespacing=1.05,
            bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none", "alpha": 0.92},
        )  # fmt: skip


def _draw_body(ax: Axes, name: str, place: tuple[float, float], ground: bool) -> None:
    x, y = place
    if ground:
        ax.plot([x - 0.5, x + 0.5], [y, y], color=BLACK, linewidth=2.0, zorder=4)
        for k in np.linspace(-0.46, 0.42, 9):
            ax.plot([x + k, x + k - 0.07], [y, y - 0.1], color=BLACK, linewidth=1.0, zorder=4)
        ax.annotate(name, (x, y - 0.16), ha="center", va="top", fontsize=9)
        return
    width, height = 0.86, 0.3
    ax.add_patch(
        FancyBboxPatch(
            (x - 0.5 * width, y - 0.5 * height),
            width,
            height,
            boxstyle="round,pad=0.02,rounding_size=0.06",
            facecolor="#EAF1F8",
            edgecolor=BLACK,
            linewidth=1.2,
            zorder=4,
        )
    )
    ax.annotate(_wrapped(name), (x, y), ha="center", va="center", fontsize=9, zorder=5, linespacing=1.0)


def _wrapped(name: str) -> str:
    """Return a name in two lines if it is long."""
    if len(name) <= LETTERS:
        return name
    words = name.split(" ")
    if len(words) == 1:
        return name[: LETTERS - 1] + "…"
    half = min(range(1, len(words)), key=lambda k: abs(len(" ".join(words[:k])) - len(name) / 2))
    return "\n".join(line if len(line) <= LETTERS + 2 else line[: LETTERS + 1] + "…"
                     for line in (" ".join(words[:half]), " ".join(words[half:])))  # fmt: skip


def _face_legend(ax: Axes, styles: set[str]) -> None:
    for style, (colour, line) in STYLES.items():
        if style in styles:
            ax.plot([], [], color=colour, linestyle=line, linewidth=1.6, label=style)
    if styles:
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=len(styles))


def _title(mechanism: Mechanism) -> str:
    """Return name, number of bodies and, of a mechanism that can be assembled, degrees of freedom."""
    count = len(mechanism.bodies)
    text = f"{mechanism.name}: {count} {'body' if count == 1 else 'bodies'}"
    freedom = degrees_of_freedom(mechanism)
    if math.isnan(freedom):
        return text
    return f"{text}, {freedom:.0f} {'degree' if freedom == 1 else 'degrees'} of freedom"


def degrees_of_freedom(mechanism: Mechanism) -> float:
    """Return the degrees of freedom where a mechanism is, NaN if it cannot be assembled."""
    try:
        return float(mechanism.compile().initialise().degrees_of_freedom)
    except (ValueError, RuntimeError, AttributeError):
        return math.nan
