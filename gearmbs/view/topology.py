"""A mechanism as a graph: bodies in layers above the ground, joints and forces between them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from gearmbs.view.figure_style import BLACK, BLUE, GREEN, ORANGE, PURPLE, look, new_figure

if TYPE_CHECKING:
    from gearmbs.mechanism import Mechanism

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
        _legend(ax, {edge.style for edge in edges})
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


def _legend(ax: Axes, styles: set[str]) -> None:
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
