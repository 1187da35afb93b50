"""Curves over a mesh cycle: transmission error, stiffness, load sharing, contact pattern."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.gears import GearPair, TransmissionError
from gearmbs.gears.pattern import ContactPattern
from gearmbs.view.figures.style import BLUE, COLOURS, VERMILLION, drawn_on, label, legend_below, look

SEQUENTIAL, DIVERGING = "cividis", "PuOr_r"
SHOWN_UNITS = {"m": ("mm", 1e3), "rad": ("°", 180.0 / np.pi), "rad/s": ("rpm", 30.0 / np.pi), "N/m": ("N/µm", 1e-6)}


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
    with look():
        figure, ax = drawn_on(ax, 6.4, 3.8)
        for k, (name, pattern) in enumerate(named.items()):
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[k % len(DASHES)]
            ax.plot(np.rad2deg(pattern.roll_angle), pattern.share, color=colour, linestyle=dashes, label=name or None)
        ax.set_ylim(-0.03, 1.08)
        ax.set_xlabel("driver angle from the pitch point, °")
        ax.set_ylabel("share of the load")
        ax.margins(x=0)
        if title:
            ax.set_title(title, wrap=True)
        legend_below(ax)
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
    with look():
        figure, ax = drawn_on(ax, 6.6, 4.4)
        top = max(float(pressure.max()) if pressure.count() else 1.0, 1e-12)
        mesh = ax.pcolormesh(section, roll, pressure, cmap="cividis", vmin=0.0, vmax=top, shading="nearest")
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
        if title:
            ax.set_title(title, wrap=True)
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
    with look():
        figure, ax = drawn_on(ax, 6.4, 3.8)
        for k, (name, error) in enumerate(named.items()):
            phase = np.concatenate([error.phase + c for c in range(cycles)])
            values = np.tile(getattr(error, attribute), cycles) * factor
            text = name or (f"{error.load:g} N m" if error.load else "no load")
            colour = COLOURS[k % len(COLOURS)] if len(named) > 1 else BLUE
            ax.plot(phase, values, color=colour, linestyle=DASHES[k % len(DASHES)], label=text)
        ax.set_xlim(0.0, cycles)
        ax.set_xlabel("driver angle over pitch angle")
        ax.set_ylabel(ylabel)
        if title:
            ax.set_title(title, wrap=True)
        legend_below(ax)
    return figure


def _some(named: Mapping, field: str) -> None:
    if not named:
        raise ValueError(f"{field}: empty; give at least one curve")
