"""Pages that stand alone: one HTML file with script and data inside, nothing fetched from anywhere."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gearmbs._display import draw
from gearmbs.files import write_whole
from gearmbs.view.figures.style import look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


# Reports as web pages that stand alone: their text, tables and figure in one HTML file.


STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "table{border-collapse:collapse;margin:1rem 0;display:block;overflow-x:auto}"
    "th,td{border-bottom:1px solid #DADDE2;padding:.25rem .7rem;text-align:right;white-space:nowrap}"
    "th:first-child,td:first-child{text-align:left}img{max-width:100%}"
)


def report_html(report: Any) -> str:
    """Return a report as a page: its text, and the figure that says most where it has one."""
    return _page(report.to_markdown().partition("\n")[0].lstrip("# "), report_body(report))


def _page(title: str, body: str) -> str:
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{STYLE}</style></head>\n<body>\n{body}</body></html>\n"
    )


def report_body(report: Any) -> str:
    """Return what a notebook shows of a report: its figure and its text."""
    return _picture(report) + _rendered(report.to_markdown())


def _rendered(text: str) -> str:
    from markdown_it import MarkdownIt

    return MarkdownIt("commonmark", {"html": False}).enable("table").render(text)


def write_report_page(report: Any, path: str | Path) -> Path:
    """Write a report as a web page that opens without a network."""
    return write_whole(path, report_html(report))


def page_of(title: str, figures: Iterable[tuple[str, Figure]], text: str) -> str:
    """Return a page of figures with captions, and below them a text in Markdown."""
    return _page(title, "".join(_image(figure, caption) for caption, figure in figures) + _rendered(text))


def _picture(report: Any) -> str:
    try:
        figure = draw(report)
    except TypeError:
        return ""
    return _image(figure)


def _image(figure: Figure, caption: str = "") -> str:
    content = io.BytesIO()
    with look():
        figure.savefig(content, format="svg", bbox_inches="tight")
    data = base64.b64encode(content.getvalue()).decode("ascii")
    told = html.escape(caption)
    below = f"<br>{told}" if told else ""
    return f'<p><img alt="{told}" src="data:image/svg+xml;base64,{data}">{below}</p>\n'
