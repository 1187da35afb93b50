"""A pair over the mesh cycle: transmission error, stiffness, load sharing, contact pattern, and the teeth in motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.gears import GearPair, TransmissionError
from gearmbs.gears.pattern import ContactPattern
from gearmbs.progress import waiting
from gearmbs.view.figures.drawings import (
    ARROW,
    FILLS,
    LINES,
    MM,
    TOLERANCE,
    action_ends,
    force_text,
    mesh_view,
    pitch_point,
    projected,
)
from gearmbs.view.figures.style import (
    BLUE,
    COLOURS,
    ENDINGS,
    VERMILLION,
    drawing,
    label,
    png_bytes,
    write_film,
)
from gearmbs.view.motion import (
    ContactPoints,
    ContactProbe,
    PairMotion,
    chosen_times,
    gear_contact_of,
    marker_motion,
    mean_frame,
    solution_motion,
    static_motion,
)
from gearmbs.view.pages import Page, packed, rounded
from gearmbs.view.solid import pair_deviations, section_outline

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution

DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (7, 2, 1, 2)), (0, (1, 1)))


def transmission_error_plot(
    errors: TransmissionError | Mapping[str, TransmissionError],
    *,
    cycles: int = 2,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw transmission errors over the mesh cycle, in micrometres at the driven base circle.

    Parameters
    ----------
    errors : TransmissionError or mapping of name to TransmissionError
    cycles : int
        Mesh cycles shown.
    title : str, optional
    ax : matplotlib axes, optional
    """
    return _over_cycle(errors, "error", label("transmission error", "µm"), 1e6, cycles, title, ax)


def stiffness_plot(
    errors: TransmissionError | Mapping[str, TransmissionError],
    *,
    cycles: int = 2,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the tangent mesh stiffness over the mesh cycle; see `transmission_error_plot`."""
    figure = _over_cycle(errors, "stiffness", label("mesh stiffness", "N/µm"), 1e-6, cycles, title, ax)
    (ax if ax is not None else figure.axes[0]).set_ylim(bottom=0.0)
    return figure


def load_sharing_plot(
    patterns: ContactPattern | Mapping[str, ContactPattern], *, title: str | None = None, ax: Axes | None = None
) -> Figure:
    """Draw the part of the load one tooth carries while it passes through the mesh.

    Parameters
    ----------
    patterns : ContactPattern or mapping of name to ContactPattern
        From `gearmbs.gears.pattern.contact_pattern`.
    title : str, optional
    ax : matplotlib axes, optional
    """
    named = patterns if isinstance(patterns, Mapping) else {"": patterns}
    _some(named, "patterns")
    with drawing(ax, 6.4, 3.8, title=title, legend=3) as (figure, ax):
        for k, (name, pattern) in enumerate(named.items()):
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k % len(DASHES)]
            ax.plot(np.rad2deg(pattern.roll_angle), pattern.share, color=colour, linestyle=dashes, label=name or None)
        ax.set_ylim(-0.03, 1.08)
        ax.set_xlabel("driver angle from the pitch point, °")
        ax.set_ylabel("share of the load")
        ax.margins(x=0)
    return figure


def contact_pattern_plot(
    pattern: ContactPattern, *, pair: GearPair | None = None, title: str | None = None, ax: Axes | None = None
) -> Figure:
    """Draw the contact pattern: load per face width over face and roll angle.

    Parameters
    ----------
    pattern : ContactPattern
        From `gearmbs.gears.pattern.contact_pattern`.
    pair : GearPair, optional
        Marks where the flank begins and ceases to bear, section by section: the ends of the path of contact, which a
        helix turns by z tan(beta_b) / r_b, so that its zone of contact is a parallelogram.
    title : str, optional
    ax : matplotlib axes, optional
    """
    section, roll = np.asarray(pattern.section) * 1e3, np.rad2deg(pattern.roll_angle)
    pressure = np.ma.masked_less_equal(np.asarray(pattern.pressure, dtype=float) * 1e-3, 0.0)
    with drawing(ax, 6.6, 4.4, title=title) as (figure, ax):
        top = max(float(pressure.max()) if pressure.count() else 1.0, 1e-12)
        # as a picture: thousands of cells make files of a megabyte
        mesh = ax.pcolormesh(
            section, roll, pressure, cmap="cividis", vmin=0.0, vmax=top, shading="nearest", rasterized=True
        )
        ax.set_facecolor("#ECEDEF")
        ax.grid(visible=False)
        if pair is not None:
            _path_ends(ax, pattern, pair)
        if not pressure.count():
            ax.text(0.5, 0.5, "no load on this flank", transform=ax.transAxes, ha="center", color=VERMILLION)
        ax.set_xlabel("along the face, mm")
        ax.set_ylabel("driver angle from the pitch point, °")
        bar = figure.colorbar(mesh, ax=ax, label="load per face width, N/mm", pad=0.02)
        bar.outline.set_visible(False)  # type: ignore[operator]
    return figure


def path_ends(pattern: ContactPattern, pair: GearPair) -> np.ndarray | None:
    """Return the driver angles at which each section enters and leaves the path of contact, rad, shape (2, m).

    A flank touches at length of roll s = a + d (r_b phi + rho h z tan(beta_b)): phi the angle, z the section, rho the
    sense of rotation, h 1 for a right-hand driver and -1 for a left-hand one, d 1 for drive flanks and -1 for coast
    flanks, whose contact runs the other way. Of drive flanks a is r_b tan(alpha'); of coast flanks, which the backlash
    moves, it is what the pattern has. The wheels are taken as parallel. None where nothing bears.
    """
    driver, section = pair.driver, np.asarray(pattern.section)
    loaded = np.isfinite(pattern.roll_length)
    turned = driver.base_radius * pattern.roll_angle[:, None] + _lead(pair) * section
    middle = driver.base_radius * np.tan(pair.working_pressure_angle)
    if not loaded.any():
        return None
    away = [np.median(np.abs(pattern.roll_length - middle - turned)[loaded]), np.inf]
    coast = np.median((pattern.roll_length + turned)[loaded])
    away[1] = np.median(np.abs(pattern.roll_length - coast + turned)[loaded])
    start, way = (middle, 1.0) if away[0] <= away[1] else (coast, -1.0)
    ends = np.array([pair.geometry.first_roll_lengths[0], driver.tip_roll_length])
    return (way * (ends[:, None] - start) - _lead(pair) * section) / driver.base_radius


def _lead(pair: GearPair) -> float:
    """Return how far contact moves along the path for each metre of face: rho h tan(beta_b)."""
    return pair.operating_point.rotation * pair.driver.twist_tangent


def _path_ends(ax: Axes, pattern: ContactPattern, pair: GearPair) -> None:
    """Mark where each section enters and leaves the path of contact."""
    ends = path_ends(pattern, pair)
    if ends is None:
        return
    across = np.asarray(pattern.section) * 1e3
    for angles, text, where in zip(np.rad2deg(ends), ("start of path", "end of path"), ("top", "bottom")):
        ax.plot(across, angles, color=VERMILLION, linewidth=0.9, linestyle=(0, (5, 3)))
        right = int(np.argmax(across))
        ax.annotate(
            text,
            (across[right], angles[right]),
            xytext=(-4, -3 if where == "top" else 3),
            textcoords="offset points",
            ha="right",
            va=where,
            fontsize=8,
            color=VERMILLION,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "alpha": 0.85, "edgecolor": "none"},
        )


def _over_cycle(errors, attribute: str, ylabel: str, factor: float, cycles: int, title, ax) -> Figure:
    named = errors if isinstance(errors, Mapping) else {"": errors}
    _some(named, "errors")
    if cycles < 1:
        raise ValueError(f"cycles is {cycles}; give 1 or more")
    with drawing(ax, 6.4, 3.8, title=title, legend=3) as (figure, ax):
        for k, (name, error) in enumerate(named.items()):
            phase = np.concatenate([error.phase + c for c in range(cycles)])
            values = np.tile(getattr(error, attribute), cycles) * factor
            text = name or (f"{error.load:g} N m" if error.load else "no load")
            colour = COLOURS[k % len(COLOURS)] if len(named) > 1 else BLUE
            ax.plot(phase, values, color=colour, linestyle=DASHES[k % len(DASHES)], label=text)
        ax.set_xlim(0.0, cycles)
        ax.set_xlabel("driver angle over pitch angle")
        ax.set_ylabel(ylabel)
    return figure


def _some(named: Mapping, field: str) -> None:
    if not named:
        raise ValueError(f"{field}: empty; give at least one curve")


# The teeth in motion.


class MeshAnimation(Page):
    """The teeth in mesh, instant by instant: a page, or an animated GIF.

    Attributes
    ----------
    motion : PairMotion
    points : list of ContactPoints
        The contacts at each instant.
    """

    def __init__(
        self, motion: PairMotion, title: str = "Gear mesh", width: float | None = None, section: float = 0.0
    ) -> None:
        self.motion = motion
        self.span = 7.0 * motion.pair.driver.module if width is None else float(width)
        self.section = section
        if not self.span > 0.0:
            raise ValueError(f"width is {width} m; give a positive width of the detail")
        self.points = ContactProbe(motion.pair).over(motion)
        data = _page_data(motion, self.points, self.span, section)
        super().__init__(title, f"{len(motion)} instants", ("player.js", "transverse.js"), data)

    def save(self, path: str | Path) -> Path:
        """Write the animation as ``.html`` (stands alone), ``.gif``, or where ffmpeg is installed ``.mp4``."""
        ending = Path(path).suffix.lower()
        if ending in ENDINGS:
            return write_film(path, self._pictures(dpi=120 if ending == ".mp4" else 80), len(self.motion))
        return super().save(path)

    def _pictures(self, dpi: float) -> Iterator[bytes]:
        """Yield each instant as a PNG image."""
        for k in range(len(self.motion)):
            figure = mesh_view(
                self.motion.pair,
                place=self.motion.placement(k),
                points=self.points[k],
                width=self.span,
                section=self.section,
                title=f"{self.title}: {self.motion.label} {self.motion.value[k]:.5f} {self.motion.unit}",
            )
            yield png_bytes(figure, dpi=dpi)


def mesh_animation(
    source: Solution | GearPair,
    *,
    element: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    frames: int = 120,
    torque: float | None = None,
    width: float | None = None,
    section: float = 0.0,
    title: str | None = None,
) -> MeshAnimation:
    """Animate the teeth in mesh with their contact forces.

    Parameters
    ----------
    source : Solution or GearPair
        A simulation, or a pair that rolls through two pitches at rest under load.
    element : str, optional
        Gear contact of the simulated mechanism, when it has several.
    start, stop : float, optional
        Part of the simulation, s; default the time of three mesh cycles at its end.
    frames : int
        At most so many instants; a simulation has no more than its outputs.
    torque : float, optional
        Load on the driven wheel of a pair at rest, N m; default the pair's.
    width : float, optional
        Width of the detail, m; default seven modules.
    section : float
        Section along the face, m from mid-face.
    title : str, optional

    Returns
    -------
    MeshAnimation
        Shows itself in notebooks; ``save("mesh.html")``, ``save("mesh.gif")``, ``save("mesh.mp4")``.

    Examples
    --------
    >>> animation = mesh_animation(GearPair.paper(), frames=4)
    >>> len(animation.points)
    4
    """
    with waiting("finding contacts"):
        if isinstance(source, GearPair):
            motion = static_motion(source, torque=torque, pitches=2.0, frames=frames)
            return MeshAnimation(motion, title or "Gear mesh at rest under load", width, section)
        if start is None:
            start = _last_cycles(source, element, stop)
        motion = solution_motion(source, element=element, start=start, stop=stop, frames=frames)
        return MeshAnimation(motion, title or "Gear mesh, simulated", width, section)


def _last_cycles(solution: Solution, element: str | None, stop: float | None, cycles: float = 3.0) -> float:
    """Return the time so many mesh cycles before the end."""
    contact = gear_contact_of(solution, element)
    last = chosen_times(solution.t, float(solution.t[0]), stop, solution.t.size)[-1:]
    _, axes, _, spin = marker_motion(solution, contact.i, last)
    begin, end = float(solution.t[0]), float(solution.t[last[0]])
    speed = abs(float(spin[0] @ axes[0, :, 2]))
    if speed == 0.0:
        return begin
    return max(begin, end - cycles * 2.0 * math.pi / (speed * contact.pair.driver.teeth))


def _page_data(motion: PairMotion, points: list[ContactPoints], span: float, section: float) -> dict:
    """Return what the page draws: lengths in mm, in the mean frame of each instant."""
    pair = motion.pair
    means = [mean_frame(motion.placement(k)) for k in range(len(motion))]
    wheels = []
    for w, (wheel, deviation) in enumerate(zip(pair.wheels, pair_deviations(pair))):
        outline = section_outline(wheel, section, TOLERANCE, deviation)
        wheels.append(
            {
                "name": ("driver", "driven")[w],
                "fill": FILLS[w],
                "line": LINES[w],
                "outline": packed(outline * MM),
                # filled between outline and bore, or rim
                "bore": (wheel.outer_radius if wheel.internal else wheel.bore_radius) * MM,
                "base": wheel.base_radius * MM,
                "maps": [_affine(motion, w, k, means[k], section) for k in range(len(motion))],
            }
        )
    largest = max((float(np.linalg.norm(f)) for p in points for *_, f in p.pairs()), default=1.0)
    unit = ARROW * pair.driver.module * MM / largest
    heaviest = max((float(p.force.max(initial=0.0)) for p in points), default=0.0) or 1.0
    dots, arrows = [], []
    for k, found in enumerate(points):
        base, mean = motion.origins[0, k], means[k]
        flat = (found.point - base) @ mean * MM
        dots.append([rounded([x, y, f / heaviest]) for (x, y, _), f in zip(flat, found.force) if f > 0.0])
        rows = []
        for *_, centre, force in found.pairs():
            x, y, _ = (centre - base) @ mean * MM
            fx, fy, _ = force @ mean * unit
            rows.append([*rounded([x, y, fx, fy]), force_text(float(np.linalg.norm(force)))])
        arrows.append(rows)
    return {
        "wheels": wheels,
        "values": rounded(motion.value, 9),
        "label": motion.label,
        "unit": motion.unit,
        "span": span * MM,
        "centre": pitch_point(pair) * MM,
        "action": rounded(action_ends(pair, pair.rotation).ravel() * MM),
        "points": dots,
        "arrows": arrows,
        "force": rounded([float(p.force.sum()) for p in points]),
    }


def _affine(motion: PairMotion, wheel: int, k: int, mean: np.ndarray, section: float) -> list[float]:
    """Return the six numbers of the map from a wheel's section to the plane of the picture, mm."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    zero, x, y = projected(
        corners, motion.origins[wheel, k], motion.axes[wheel, k], motion.origins[0, k], mean, section
    )
    return rounded([*(x - zero), *(y - zero), *(zero * MM)], 9)
