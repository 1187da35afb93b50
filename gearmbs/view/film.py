"""Films of pictures, by ffmpeg where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

from gearmbs.view.files import whole_file

RATE = 20
"""Pictures a second."""


def write_film(path: str | Path, pictures: Iterable[bytes], rate: int = RATE) -> Path:
    """Write PNG pictures of one size as an H.264 film.

    Parameters
    ----------
    path : path
        Ends in ``.mp4``.
    pictures : iterable of bytes
    rate : int
        Pictures a second.

    Raises
    ------
    ValueError
        If ffmpeg is not installed; the message says what to do instead.
    RuntimeError
        If ffmpeg fails.
    """
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
    return Path(path)
