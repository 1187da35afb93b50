"""Pages that stand alone: one HTML file with script and data inside, nothing fetched from anywhere."""

from __future__ import annotations

import base64
import html
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gearmbs.view.files import write_whole

FILMS = ", which plays in any browser; films (.mp4, .gif) are made of mesh animations and scenes that move"


class Page:
    """A self-contained HTML page that shows itself in notebooks.

    Parameters
    ----------
    title, note : str
        Heading and the remark beside it.
    scripts : tuple of str
        Names of the scripts of the page.
    data : dict
        What the scripts draw, serialisable as JSON.
    height : int
        Height in notebooks, pixels.
    """

    def __init__(
        self, title: str, note: str, scripts: tuple[str, ...], data: dict[str, Any], height: int = 560
    ) -> None:
        self.title, self.note, self.scripts, self.data, self.height = title, note, scripts, data, height

    def to_html(self) -> str:
        """Return the page as text."""
        assets = files("gearmbs.view") / "assets"
        script = "\n".join((assets / name).read_text(encoding="utf-8") for name in self.scripts)
        values = {
            "@TITLE@": html.escape(self.title),
            "@NOTE@": html.escape(self.note),
            "@DATA@": json.dumps(self.data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
            "@SCRIPT@": script,
        }
        text = (assets / "page.html").read_text(encoding="utf-8")
        for key, value in values.items():
            text = text.replace(key, value)
        return text

    def save(self, path: str | Path) -> Path:
        """Write the page as an HTML file that opens in any browser without a network."""
        if Path(path).suffix.lower() not in (".html", ".htm"):
            raise ValueError(f"path is {str(path)!r}; a page is an .html file{FILMS}")
        return write_whole(path, self.to_html())

    def _repr_html_(self) -> str:
        page = html.escape(self.to_html(), quote=True)
        return (
            f'<iframe srcdoc="{page}" style="width:100%;height:{self.height}px;border:0" title="{self.title}"></iframe>'
        )


def packed(values: np.ndarray, kind: str = "<f4") -> str:
    """Return numbers as base64 text for a script."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def rounded(values: npt.ArrayLike, digits: int = 7) -> list:
    """Return numbers as lists with so many significant digits, to keep pages small."""
    return json.loads("[" + ",".join(f"{v:.{digits}g}" for v in np.ravel(np.asarray(values, dtype=float))) + "]")
