"""Pages that stand alone: one HTML file with script and data inside, nothing fetched from anywhere."""

from __future__ import annotations

import base64
import html
import io
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gearmbs._display import draw
from gearmbs.files import write_whole
from gearmbs.view.figures.style import look

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
    title = html.escape(report.to_markdown().partition("\n")[0].lstrip("# "))
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"</head>\n<body>\n{report_body(report)}</body></html>\n"
    )


def report_body(report: Any) -> str:
    """Return what a notebook shows of a report: its figure and its text."""
    from markdown_it import MarkdownIt

    return _picture(report) + MarkdownIt("commonmark", {"html": False}).enable("table").render(report.to_markdown())


def write_report_page(report: Any, path: str | Path) -> Path:
    """Write a report as a web page that opens without a network."""
    return write_whole(path, report_html(report))


def _picture(report: Any) -> str:
    try:
        figure = draw(report)
    except TypeError:
        return ""
    content = io.BytesIO()
    with look():
        figure.savefig(content, format="svg", bbox_inches="tight")
    data = base64.b64encode(content.getvalue()).decode("ascii")
    return f'<p><img alt="" src="data:image/svg+xml;base64,{data}"></p>\n'
