"""The mesh in motion, seen along the axis, with contact points and forces."""

from __future__ import annotations

import io
import math
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.files import whole_file
from gearmbs.gears import GearPair
from gearmbs.progress import waiting
from gearmbs.view.figures.style import png_bytes
from gearmbs.view.figures.transverse import (
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
from gearmbs.view.geometry.solid import pair_deviations, section_outline
from gearmbs.view.scenes.motion import (
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
from gearmbs.view.scenes.pages import Page, packed, rounded

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution

# Films of pictures, by ffmpeg where it is installed, and moving pictures.


RATE = 20
"""Pictures a second."""


ENDINGS = (".gif", ".mp4")


def write_film(path: str | Path, pictures: Iterable[bytes], count: int, rate: int = RATE) -> Path:
    """Write PNG pictures of one size as an H.264 film or as a moving picture, with a bar where somebody watches.

    Parameters
    ----------
    path : path
        Ends in ``.mp4`` or ``.gif``.
    pictures : iterable of bytes
        Drawn one by one as they are written.
    count : int
        How many there are.
    rate : int
        Pictures a second.

    Raises
    ------
    ValueError
        For another ending, or if ffmpeg is not installed; the message says what to do instead.
    RuntimeError
        If ffmpeg fails.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(f"path is {str(path)!r}; a film ends in {' or '.join(ENDINGS)}")
    with waiting(f"saving {path.name}") as tell:
        drawn = _counted(pictures, count, tell)
        return _write_gif(path, drawn, rate) if ending == ".gif" else _write_mp4(path, drawn, rate)


def _counted(pictures: Iterable[bytes], count: int, tell: Callable[[float], None]) -> Iterator[bytes]:
    for k, picture in enumerate(pictures):
        tell((k + 1) / (count + 1))
        yield picture


def _write_gif(path: Path, pictures: Iterable[bytes], rate: int) -> Path:
    from PIL import Image

    images = [Image.open(io.BytesIO(p)).convert("P", palette=Image.Palette.ADAPTIVE) for p in pictures]
    with whole_file(path) as part:
        images[0].save(part, format="GIF", save_all=True, append_images=images[1:], duration=round(1000 / rate), loop=0)
    return path


def _write_mp4(path: Path, pictures: Iterable[bytes], rate: int) -> Path:
    program = shutil.which("ffmpeg")
    if program is None:
        raise ValueError(
            f"path is {str(path)!r}; films need the program ffmpeg, which is not installed here (apt install ffmpeg, "
            "conda install ffmpeg, or ffmpeg.org); save as .html or .gif instead"
        )
    even = "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"
    with whole_file(path) as part:
        command = [program, "-loglevel", "error", "-y", "-f", "image2pipe", "-framerate", str(rate), "-c:v", "png"]
        command += ["-i", "-", "-vf", even, "-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
        process = subprocess.Popen([*command, str(part)], stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        assert process.stdin is not None
        try:
            for picture in pictures:
                process.stdin.write(picture)
        except BrokenPipeError:
            # what ffmpeg says is told below
            pass
        _, said = process.communicate()
        if process.returncode != 0:
            raise RuntimeError(f"{path}: ffmpeg failed: {said.decode(errors='replace').strip()[:300]}")
    return path


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
