"""The meshing teeth seen along the axis, with contact points and forces."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path

from gearmbs.gears import GearPair
from gearmbs.gears.pair import Placement
from gearmbs.view.contacts import ContactPoints, ContactProbe, mean_frame
from gearmbs.view.figure_style import BLUE, GREY, PURPLE, VERMILLION, drawn_on, look
from gearmbs.view.motion import static_motion
from gearmbs.view.outline import circle
from gearmbs.view.solid import pair_deviations, section_outline

MM = 1e3
TOLERANCE = 2e-6
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
    with look():
        figure, ax = drawn_on(ax, 7.0, 6.6)
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
        if title:
            ax.set_title(title, wrap=True)
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
