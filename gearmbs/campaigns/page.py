"""The page of a campaign that is carried out: a file of HTML, written whole again and again, that a browser refreshes.

There is no server: the file is opened from the disk, or from wherever the folder is shared.
"""

from __future__ import annotations

import html
import re
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from gearmbs.campaigns.folder import Folder
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.status import CampaignStatus, duration, read_status
from gearmbs.campaigns.subjects.base import DONE
from gearmbs.files import write_whole

EVERY = 5.0
"""Seconds between two writings: as long as a glance takes, and long beside the reading of ten thousand ledgers."""

SILENT = 6
"""Times these seconds after which the page itself says that nobody writes it any more, as after a kill."""

MOST_CAUSES, MOST_CLAIMS = 12, 40
"""Rows shown of failures and of claims."""

Cause = tuple[str, str, str]
Known = dict[tuple[int, int], Counter[Cause]]
"""Of each unit and each writing of its ledger how many cases failed for which cause."""

STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}
progress{width:100%;height:1.4em}table{border-collapse:collapse;margin:1em 0}
td,th{border-bottom:1px solid #ddd;padding:3px 10px;text-align:left}
.old{color:#a00}small{color:#666}"""

OLD = """<script>setInterval(function(){var n=document.getElementById("old");
n.hidden=Date.now()/1e3-%.0f<%.0f},1e3)</script>"""


class LivePage:
    """Writes the page of a campaign at the beginning, at intervals, and at the end.

    Parameters
    ----------
    folder : callable
        Returns the folder as it is now.
    path : path-like
        Of the page.
    every : float
        Seconds between two writings.
    """

    def __init__(self, folder: Callable[[], Folder], path: str | Path, every: float = EVERY) -> None:
        self._folder, self.path, self._every = folder, Path(path), every
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._go_on, name="live page", daemon=True)
        self._causes: Known = {}

    def __enter__(self) -> LivePage:
        try:
            self.write(live=True)
        except OSError as error:
            raise CampaignError(
                f"page = {str(self.path)!r}: {error.strerror}; give a file in another folder"
            ) from error
        self._thread.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._over.set()
        self._thread.join()
        with suppress(OSError, CampaignError):
            self.write(live=False)

    def _go_on(self) -> None:
        while not self._over.wait(self._every):
            # a disk that is full, or a ledger that is damaged, is told by the run
            with suppress(OSError, CampaignError):
                self.write(live=True)

    def write(self, *, live: bool) -> None:
        """Write the page as things stand; a live one refreshes itself until all is done."""
        folder = self._folder()
        write_whole(self.path, page_text(folder, self._causes, self._every if live else None))


def page_text(folder: Folder, causes: Known | None = None, every: float | None = None) -> str:
    """Return the page of a campaign as it stands.

    Parameters
    ----------
    folder : Folder
    causes : dict, optional
        What is known of the failures of units that are done, and is kept for the next time.
    every : float, optional
        Seconds after which a browser loads it again, unless all is done.
    """
    status, now = read_status(folder), time.time()
    refreshed = every is not None and not status.complete
    head = f"<meta charset='utf-8'><title>{status.fraction:.0%} {html.escape(folder.path.name)}</title>"
    parts = [f"<h1>{html.escape(folder.path.name)}</h1>"]
    if refreshed:
        head += f"<meta http-equiv='refresh' content='{every:g}'>"
        parts.append(
            "<p id='old' class='old' hidden>Nobody writes this page any more: the run has ended or was killed; "
            "run again, and it goes on.</p>" + OLD % (now, SILENT * (every or 0.0))
        )
    parts.append(status._repr_html_().replace("</progress>", "</progress><br>"))
    parts.append(_rows(_counts(status)))
    failures = _causes(folder, {} if causes is None else causes)
    if failures:
        rows = [(str(count), *cause) for cause, count in failures.most_common(MOST_CAUSES)]
        parts += ["<h2>Failures by cause</h2>", _rows(rows, ("cases", "status", "message", "what to do"))]
        parts.append(_more(len(failures) - MOST_CAUSES, "causes"))
    if status.at_work:
        parts += ["<h2>At work</h2>", _rows([(who,) for who in status.at_work[:MOST_CLAIMS]])]
        parts.append(_more(len(status.at_work) - MOST_CLAIMS, "units"))
    written = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(now))
    parts.append(f"<small>written {written}{f', again every {every:g} s' if refreshed else ''}</small>")
    return f"<!doctype html><html><head>{head}<style>{STYLE}</style></head><body>{''.join(parts)}</body></html>\n"


def _counts(status: CampaignStatus) -> list[tuple[str, str]]:
    """Return what is counted, in words."""
    rows = [
        ("cases done", f"{status.done} of {status.cases}"),
        ("units done", f"{status.units_done} of {status.units}"),
        ("failed", str(status.failed)),
        ("with results that are no numbers", str(status.not_numbers)),
        ("taken over from other campaigns", str(status.reused)),
        ("in work", str(status.running)),
        ("codes", str(status.codes)),
        ("processor time", f"{duration(status.processor_seconds)}, {status.overhead:.1%} outside of simulations"),
    ]
    if status.rate is not None:
        rows.append(("pace", f"{60.0 * status.rate:.3g} cases a minute"))
    if status.eta:
        rows.append(("remaining time", f"about {duration(status.eta)}"))
    return rows


def _causes(folder: Folder, known: Known) -> Counter[Cause]:
    """Return how many cases failed, by status, message without its numbers, and advice."""
    found: Counter[Cause] = Counter()
    for unit in folder.done():
        # one may be taken away and done again
        key = unit, folder.ledger(unit).stat().st_mtime_ns
        if key not in known:
            known[key] = Counter()
            if folder.entry(unit)["failed"]:
                rows = folder.unit_table(unit, ["status", "message", "advice"]).to_pylist()
                told = ((row["status"], _alike(row["message"]), row["advice"]) for row in rows if row["status"] != DONE)
                known[key].update(told)
        found += known[key]
    return found


def _alike(message: str) -> str:
    """Return a message without the numbers by which those of one cause differ."""
    return re.sub(r"(?<![\w.])[-+]?\d[\d.]*(?:[eE][-+]?\d+)?", "#", message)


def _more(count: int, what: str) -> str:
    return f"<p>and {count} more {what}</p>" if count > 0 else ""


def _rows(rows: list[Any], heads: tuple[str, ...] = ()) -> str:
    first = f"<tr>{''.join(f'<th>{head}</th>' for head in heads)}</tr>" if heads else ""
    cells = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{first}{cells}</table>"
