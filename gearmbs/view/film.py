"""Films of pictures, by ffmpeg where it is installed, and moving pictures."""

from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from gearmbs.progress import waiting
from gearmbs.view.files import whole_file

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
