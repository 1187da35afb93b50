"""Figures without global state: colours everyone can tell apart, one look for all plots, whole files and films only."""

from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearmbs.files import whole_file
from gearmbs.progress import waiting

BLUE, ORANGE, GREEN, VERMILLION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, YELLOW, BLACK = "#56B4E9", "#CC79A7", "#F0E442", "#222222"
GREY = "#8A8F98"
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION, BLACK, YELLOW)
"""Palette of Okabe and Ito, distinguishable under the common forms of colour blindness."""

DPI = 200

LOOK: Any = {
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.labelsize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#DADDE2",
    "grid.linewidth": 0.7,
    "axes.edgecolor": "#555555",
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "lines.linewidth": 1.3,
    "svg.hashsalt": "gearmbs",
    "svg.fonttype": "path",
}

LEGEND_LETTERS, LEGEND_HANDLE = 84, 8
"""Letters that fit side by side under axes of the usual width, and the space taken by the line before each name."""

UNITS = {
    "m/s^2": "m/s²",
    "m s^-2": "m/s²",
    "m/s": "m/s",
    "N m": "N m",
    "m^2*kg/s^2": "N m",
    "m^2*kg/s^2/rad": "N m/rad",
    "m^2*kg/s/rad": "N m s/rad",
    "m^2*kg": "kg m²",
    "m*kg/s^2": "N",
    "kg/m/s^2": "Pa",
    "kg/s^2": "N/m",
    "kg/s": "N s/m",
    "um": "µm",
    "dimensionless": "",
    "1": "",
    "mixed": "",
    "unknown": "unknown unit",
}


STATE_COLOURS = {"healthy": BLUE, "misaligned": ORANGE, "distance": GREEN}


class Picture(Figure):
    """A matplotlib figure that shows itself in notebooks without any backend being chosen."""

    def _repr_png_(self) -> bytes:
        return png_bytes(self, dpi=110)


@contextmanager
def look() -> Iterator[None]:
    """Apply the common look while a figure is made, and nothing of it afterwards."""
    with matplotlib.rc_context(LOOK):
        yield


def new_figure(width: float = 6.4, height: float = 4.0) -> Picture:
    """Return an empty figure, size in inches, that lays itself out."""
    return Picture(figsize=(width, height), layout="constrained")


def drawn_on(ax: Axes | None, width: float = 6.4, height: float = 4.0) -> tuple[Figure, Axes]:
    """Return the figure and axes to draw on: the caller's, or new ones."""
    if ax is None:
        figure = new_figure(width, height)
        return figure, figure.subplots()
    owner = ax.get_figure(root=True)
    if owner is None:
        raise ValueError("ax: these axes belong to no figure; make them with Figure.subplots()")
    return owner, ax


@contextmanager
def drawing(
    ax: Axes | None, width: float = 6.4, height: float = 4.0, *, title: str | None = None, legend: int = 0
) -> Iterator[tuple[Figure, Axes]]:
    """Draw on the caller's axes or on new ones, in the common look; a title and a legend of so many columns follow."""
    with look():
        figure, panel = drawn_on(ax, width, height)
        yield figure, panel
        if legend:
            legend_below(panel, legend)
        if title:
            panel.set_title(title, wrap=True)


def unit_text(unit: object) -> str:
    """Return a unit as it is written in a label."""
    text = str(unit or "").strip()
    return UNITS.get(text, text.replace("^2", "²").replace("^3", "³"))


def label(quantity: str, unit: object = "") -> str:
    """Return an axis label, quantity and unit."""
    text = unit_text(unit)
    return f"{quantity}, {text}" if text else quantity


SCALINGS = {"amplitude": "peak amplitude", "rms": "RMS", "power": "mean square", "density": "power density"}


def scaling_name(scaling: object) -> str:
    """Return what the values of a spectrum are, by its attribute ``scaling``: of a sine its peak, its RMS and so on."""
    return SCALINGS.get(str(scaling or "amplitude"), str(scaling))


def legend_below(ax: Axes, columns: int = 3) -> None:
    """Put the legend under the axes where it hides no data."""
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        longest = max(len(str(text)) for text in labels) + LEGEND_HANDLE
        fitting = max(1, min(columns, LEGEND_LETTERS // longest))
        ax.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=fitting)


def state_colour(state: str, index: int) -> str:
    """Return the colour of a state, the same in every figure."""
    return STATE_COLOURS.get(state, COLOURS[index % len(COLOURS)])


def png_bytes(figure: Figure, dpi: float = DPI) -> bytes:
    """Return a figure as a PNG image."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def save_figure(figure: Figure, stem: str | Path, *, dpi: float = DPI) -> list[Path]:
    """Write a figure as PNG and SVG; a file appears under its name only when it is whole.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    stem : path
        Path without the ending.
    dpi : float
        Resolution of the PNG, dots per inch.

    Returns
    -------
    list of Path
        The PNG and the SVG.
    """
    paths = [Path(f"{stem}.png"), Path(f"{stem}.svg")]
    with look():
        with whole_file(paths[0]) as part:
            figure.savefig(part, format="png", dpi=dpi)
        with whole_file(paths[1]) as part:
            figure.savefig(part, format="svg", metadata={"Date": None})
    return paths


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
