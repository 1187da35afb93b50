"""A scene as a plotly figure, for notebooks that use plotly (extra ``view``)."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.view.figures.style import VERMILLION
from gearmbs.view.geometry.mesh import feature_edges
from gearmbs.view.scenes.solids import SceneData

ARROW = 0.22
"""Length of the arrow of the largest force, in sizes of the scene."""
LIGHT = {"ambient": 0.55, "diffuse": 0.75, "specular": 0.15, "roughness": 0.6}


def plotly_figure(scene: SceneData, frames: int = 24) -> Any:
    """Return a plotly figure of a scene, animated over at most ``frames`` of its instants.

    Raises
    ------
    ImportError
        If plotly is not installed; the message says how to get it.
    """
    try:
        import plotly.graph_objects as go
    except ImportError as error:
        raise ImportError("plotly is not installed; pip install 'gearmbs[view]', or use Scene.page()") from error
    if frames < 1:
        raise ValueError(f"frames is {frames}; give 1 or more")
    chosen = np.unique(np.linspace(0, len(scene) - 1, min(frames, len(scene))).round().astype(int))
    fixed = [_line(go, name, colour, ends) for name, colour, ends in scene.lines]
    figure = go.Figure(data=[*_moving(go, scene, int(chosen[0])), *fixed])
    every = np.concatenate([scene.corners(int(k)) for k in chosen] + [e.reshape(-1, 3) for _, _, e in scene.lines])
    spans = np.ptp(every, axis=0)
    axes = {
        f"{a}axis": {"visible": False, "range": [float(every[:, i].min()), float(every[:, i].max())]}
        for i, a in enumerate("xyz")
    }
    x, y, z = scene.up
    figure.update_layout(
        title=scene.title,
        height=620,
        scene={
            **axes,
            "aspectmode": "manual",
            "aspectratio": {a: float(s / spans.max()) + 1e-3 for a, s in zip("xyz", spans)},
            "camera": {"up": {"x": x, "y": y, "z": z}, "eye": {"x": 0.7, "y": 0.4, "z": 0.9}},
        },
        margin={"l": 10, "r": 30, "t": 80, "b": 40},
        legend={"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom"},
    )
    if chosen.size > 1:
        moving = list(range(len(figure.data) - len(fixed)))
        figure.frames = [
            go.Frame(data=_moving(go, scene, int(k)), traces=moving, name=f"{scene.value[k]:.5g}") for k in chosen
        ]
        _controls(figure, scene)
    return figure


def _moving(go: Any, scene: SceneData, instant: int) -> list:
    traces = []
    for part in scene.parts:
        mesh = part.placed(instant)
        x, y, z = mesh.vertices.T
        i, j, k = mesh.triangles.T
        shape = {"x": x, "y": y, "z": z, "i": i, "j": j, "k": k, "flatshading": True, "lighting": LIGHT}
        shape["opacity"] = part.opacity
        traces.append(go.Mesh3d(**shape, color=part.colour, name=part.name, showlegend=True, hoverinfo="name"))
        traces.append(_line(go, part.name, "#222222", feature_edges(mesh), legend=False))
    if scene.forces:
        largest = max(float(np.linalg.norm(f[:, 1], axis=1).max(initial=0.0)) for f in scene.forces) or 1.0
        rows = scene.forces[instant]
        ends = np.stack([rows[:, 0], rows[:, 0] + ARROW * scene.size / largest * rows[:, 1]], axis=1)
        traces.append(_line(go, "force on driven", VERMILLION, ends, width=6))
    return traces


def _line(go: Any, name: str, colour: str, ends: np.ndarray, width: float = 2.0, legend: bool = True) -> Any:
    """Return separate strokes as one trace; rows of NaN part them."""
    broken = np.concatenate([ends, np.full((len(ends), 1, 3), np.nan)], axis=1).reshape(-1, 3)
    x, y, z = broken.T
    style = {"color": colour, "width": width}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", line=style, name=name, showlegend=legend, hoverinfo="name")


def _controls(figure: Any, scene: SceneData) -> None:
    timing = {"frame": {"duration": 60, "redraw": True}, "transition": {"duration": 0}, "fromcurrent": True}
    pause = {"frame": {"duration": 0, "redraw": False}, "mode": "immediate", "transition": {"duration": 0}}
    steps = [
        {"label": f.name, "method": "animate", "args": [[f.name], {**pause, "frame": {"duration": 0, "redraw": True}}]}
        for f in figure.frames
    ]
    shown = {"prefix": f"{scene.label} ", "suffix": f" {scene.unit}"}
    figure.update_layout(
        updatemenus=[
            {
                "type": "buttons",
                "direction": "left",
                "x": 0.0,
                "y": 0.0,
                "buttons": [
                    {"label": "Play", "method": "animate", "args": [None, timing]},
                    {"label": "Pause", "method": "animate", "args": [[None], pause]},
                ],
            }
        ],
        sliders=[{"steps": steps, "currentvalue": shown, "x": 0.15, "len": 0.85}],
    )
