"""Reports as web pages that stand alone: their text, tables and figure in one HTML file."""

from __future__ import annotations

import base64
import html
import io
from pathlib import Path
from typing import Any

from gearmbs._shown import draw
from gearmbs.view.figure_style import look
from gearmbs.view.files import write_whole

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
