"""Planetary sets: the scene, and the energy over a turn of each part that tells faulty teeth."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from gearmbs.gears import PlanetarySet
from gearmbs.signals import PlanetaryReport
from gearmbs.view.figure_style import BLUE, GREEN, GREY, ORANGE, VERMILLION, label, look, new_figure
from gearmbs.view.mesh import Mesh, box, cylinder, joined
from gearmbs.view.scene import Scene
from gearmbs.view.scenes import SHAFT, mechanism_scene, solution_scene

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism import Mechanism

COLOURS = {"sun": BLUE, "planet": ORANGE, "ring": GREEN, "carrier": SHAFT}
PIN, ARM, GAP = 0.45, 0.25, 0.1
"""Radius of pins by that of the planets' roots, thickness of arms and their distance by the face width."""


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
        replace(part, colour=COLOURS[part.name.split()[0]]) if part.name.split()[0] in COLOURS else part
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


def planetary_plot(report: PlanetaryReport, channel: str | None = None, *, title: str | None = None) -> Figure:
    """Draw the energy over a turn of sun, planet and ring, tooth by tooth; the parts that are named stand out.

    Parameters
    ----------
    report : PlanetaryReport
        From `gearmbs.signals.diagnose_planetary`.
    channel : str, optional
        Default the first.
    title : str, optional

    Raises
    ------
    ValueError
        If there is no such channel.
    """
    names = list(dict.fromkeys(f.channel for f in report.findings))
    if channel is not None and channel not in names:
        raise ValueError(f"channel: there is no {channel!r}; choose one of {', '.join(names)}")
    kept = [f for f in report.findings if f.channel == (channel or names[0])]
    with look():
        figure = new_figure(7.0, 2.0 * len(kept))
        axes = figure.subplots(len(kept), 1)
        for ax, finding in zip(np.ravel(axes), kept):
            teeth = np.arange(finding.profile.size) * _teeth(report, finding.part) / finding.profile.size
            colour = BLUE if finding.grade == "none" else VERMILLION
            ax.bar(teeth, finding.profile, width=0.9 * (teeth[1] - teeth[0]), align="edge", color=colour)
            ax.axhline(1.0, color=GREY, linewidth=0.8)
            ax.set_title(f"{finding.part}: {finding.found:.2f} Hz, {finding.grade}", loc="left")
            ax.set_ylabel("energy by mean")
        np.ravel(axes)[-1].set_xlabel(label("tooth of the part, from where the record begins", ""))
        figure.suptitle(title or report.source)
    return figure


def _teeth(report: PlanetaryReport, part: str) -> int:
    return dict(zip(("sun", "planet", "ring"), report.lines.teeth))[part]
