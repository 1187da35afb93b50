"""A scene as a page to turn, zoom and play: own script over WebGL, nothing fetched."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import to_rgb

from gearmbs.view.figure_style import unit_text
from gearmbs.view.page import Page, packed, rounded
from gearmbs.view.scene_data import AZIMUTH, ELEVATION, Part, SceneData
from gearmbs.view.shading import corner_normals, feature_ends

ARROW = 0.22
"""Length of the largest force, as a part of the scene's size."""


def scene_page(scene: SceneData, *, azimuth: float = AZIMUTH, elevation: float = ELEVATION, height: int = 560) -> Page:
    """Return a scene as a self-contained page.

    Parameters
    ----------
    scene : SceneData
    azimuth, elevation : float
        First view, degrees.
    height : int
        Height in notebooks, pixels.

    Returns
    -------
    Page
        Shows itself in notebooks; ``save("view.html")`` writes the file.
    """
    points = [scene.corners(0), *(ends.reshape(-1, 3) for _, _, ends in scene.lines)]
    everything = np.concatenate(points)
    low, high = everything.min(axis=0), everything.max(axis=0)
    largest = max((float(np.linalg.norm(f[:, 1], axis=1).max(initial=0.0)) for f in scene.forces), default=0.0) or 1.0
    scale = np.array([1.0, ARROW * scene.size / largest])[:, None]
    data = {
        "parts": [_part(part) for part in scene.parts],
        "lines": [{"colour": to_rgb(colour), "ends": rounded(ends)} for _, colour, ends in scene.lines],
        "forces": [[rounded(row * scale) for row in rows] for rows in scene.forces],
        "values": rounded(scene.value, 9),
        "label": scene.label,
        "unit": unit_text(scene.unit),
        "up": list(scene.up),
        "centre": rounded(0.5 * (low + high)),
        "hull": [rounded(p) for p in _hull(everything - 0.5 * (low + high))],
        "span": float(np.linalg.norm(high - low)),
        "azimuth": azimuth,
        "elevation": elevation,
    }
    note = f"{len(scene)} instants" if len(scene) > 1 else ""
    return Page(scene.title, note, ("player.js", "viewer3d.js"), data, height)


def _hull(points: np.ndarray) -> np.ndarray:
    """Return points on the outside, enough to see how far a scene reaches from any direction."""
    k = np.arange(60)
    z = 1.0 - 2.0 * (k + 0.5) / k.size
    turn = np.pi * (3.0 - np.sqrt(5.0)) * k
    ways = np.column_stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z])
    return points[np.unique(np.argmax(points @ ways.T, axis=0))]


def _part(part: Part) -> dict:
    """Return a part with one vertex for each point and normal."""
    normals = np.rint(corner_normals(part.mesh).reshape(-1, 3) * 127.0).astype(np.int8)
    owners = part.mesh.triangles.reshape(-1, 1)
    rows, index = np.unique(np.hstack([owners, normals.astype(np.int64)]), axis=0, return_inverse=True)
    padded = np.zeros((len(rows), 4), dtype=np.int8)
    padded[:, :3] = rows[:, 1:]
    poses = np.concatenate([part.axes.reshape(-1, 9), part.origins], axis=1)
    ends = feature_ends(part.mesh)
    bending = {}
    if part.deflection is not None and len(part.deflection.shapes):
        bend = part.deflection.reduced()
        where = np.empty(len(part.mesh.vertices), dtype=np.int64)
        where[rows[:, 0]] = np.arange(len(rows))
        bending = {
            "shapes": packed(bend.shapes[:, rows[:, 0]]),
            "coordinates": packed(bend.coordinates),
            "ends": packed(where[ends], "<u4"),
        }
    return {
        "name": part.name,
        "colour": [round(c, 4) for c in to_rgb(part.colour)],
        "opacity": part.opacity,
        "points": packed(part.mesh.vertices[rows[:, 0]]),
        "normals": packed(padded, "i1"),
        "index": packed(index.reshape(-1), "<u4"),
        "edges": packed(part.mesh.vertices[ends]),
        "poses": packed(poses),
        **bending,
    }
