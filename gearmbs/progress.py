"""Progress of everything that takes longer than two seconds: bars in notebooks and terminals, nothing elsewhere.

Functions of the package take ``progress``: None shows bars where somebody watches and once two seconds have passed,
True at once, False never; a callable is told instead. ``GEARMBS_PROGRESS=0`` in the environment turns all bars off.
"""

from __future__ import annotations

import functools
import html
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar, cast

PATIENCE = 2.0
"""Seconds before bars appear."""

INTERVAL = 0.2
"""Shortest time between two pictures, s."""

F = TypeVar("F", bound=Callable)

SHOWN_ROWS = 8
"""Bars shown at most in a notebook; of more cases those at work."""


def watched() -> str | None:
    """Return "notebook" or "terminal" where somebody watches, else None."""
    if os.environ.get("GEARMBS_PROGRESS", "") == "0":
        return None
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is not None and hasattr(shell, "kernel"):
        return "notebook"
    return "terminal" if sys.stderr is not None and sys.stderr.isatty() else None


_open = False


class Bars:
    """Bars by name, drawn where somebody watches.

    Parameters
    ----------
    names : sequence of str
    where : {"notebook", "terminal"}
    patience : float
        Seconds before they appear.
    """

    def __init__(self, names: Sequence[str], where: str, patience: float = PATIENCE) -> None:
        self.done = dict.fromkeys(names, 0.0)
        self.begun = time.monotonic()
        self.patience = patience
        self.where = where
        self._last = 0.0
        self._lock = threading.Lock()
        self._picture: Any = None

    def move(self, name: str, fraction: float) -> None:
        """Note how far a job is, from 0 to 1; draw now and then."""
        self.done[name] = min(max(float(fraction), 0.0), 1.0)
        now = time.monotonic()
        if now - self.begun < self.patience or now - self._last < INTERVAL:
            return
        with self._lock:
            self._last = now
            self._draw(now - self.begun)

    def close(self) -> None:
        """Take the bars away."""
        with self._lock:
            if self._picture is None:
                return
            if self.where == "notebook":
                from IPython.display import HTML

                self._picture.update(HTML(""))
            else:
                self._picture[0].stop()
            self._picture = None

    def _draw(self, seconds: float) -> None:
        if self.where == "notebook":
            from IPython.display import HTML, display

            page = HTML(self.to_html(seconds))
            if self._picture is None:
                self._picture = display(page, display_id=True)
            else:
                self._picture.update(page)
            return
        if self._picture is None:
            self._picture = _terminal_bars(list(self.done))
        progress, tasks = self._picture
        for name, fraction in self.done.items():
            progress.update(tasks[name], completed=fraction)

    def to_html(self, seconds: float) -> str:
        """Return the bars as a table; of many jobs those at work, and how many are done."""
        finished = sum(fraction >= 1.0 for fraction in self.done.values())
        rows = list(self.done.items())
        if len(rows) > SHOWN_ROWS:
            rows = [(name, fraction) for name, fraction in rows if 0.0 < fraction < 1.0][: SHOWN_ROWS - 1]
            rows.insert(0, (f"{finished} of {len(self.done)} done", sum(self.done.values()) / len(self.done)))
        cells = "".join(
            f'<tr><td style="text-align:right">{html.escape(name)}</td><td><progress max="1" value="{fraction:.4f}" '
            f'style="width:18em"></progress></td><td style="text-align:right">{100.0 * fraction:.0f} %</td></tr>'
            for name, fraction in rows
        )
        return f"<table>{cells}<tr><td></td><td>{seconds:.0f} s{_left(self.done, seconds)}</td><td></td></tr></table>"


def _left(done: dict[str, float], seconds: float) -> str:
    share = sum(done.values()) / max(len(done), 1)
    return f", about {seconds * (1.0 - share) / share:.0f} s left" if 0.02 < share < 1.0 else ""


def _terminal_bars(names: list[str]) -> tuple[Any, dict[str, Any]]:
    """Return rich's bars, started, and their tasks by name."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>24}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    console = Console(stderr=True)
    progress = Progress(*columns, TimeElapsedColumn(), console=console, refresh_per_second=4, transient=True)
    progress.start()
    return progress, {name: progress.add_task(name, total=1.0) for name in names}


@contextmanager
def bars(progress: bool | Callable[[str, float], None] | None, names: Sequence[str]) -> Iterator[Any]:
    """Yield a function ``move(name, fraction)`` that follows jobs as ``progress`` asks, or None where nobody watches.

    Parameters
    ----------
    progress : bool or callable, optional
        None, True, False or a callable, see `gearmbs.progress`.
    names : sequence of str
        Of all jobs.
    """
    global _open
    if callable(progress):
        yield progress
        return
    where = watched()
    if progress is True and where is None:
        where = "terminal"
    # work inside other work is part of its bar
    if progress is False or where is None or _open:
        yield None
        return
    shown = Bars(names, where, 0.0 if progress is True else PATIENCE)
    _open = True
    try:
        yield shown.move
    finally:
        _open = False
        shown.close()


def staged(title: str) -> Callable[[F], F]:
    """Give a function that tells ``progress(fraction, stage)`` a bar of this title where it is called without one."""

    def with_bar(function: F) -> F:
        @functools.wraps(function)
        def called(*args: Any, progress: Any = None, **settings: Any) -> Any:
            if callable(progress):
                return function(*args, progress=progress, **settings)
            with bars(progress, [title]) as move:
                report = None if move is None else lambda fraction, stage: move(title, fraction)
                return function(*args, progress=report, **settings)

        return cast(F, called)

    return with_bar


@contextmanager
def time_bar(
    progress: bool | Callable[[float], None] | None, name: str, start: float, end: float
) -> Iterator[Callable[[float], None] | None]:
    """Yield a function of the time reached that follows one run from ``start`` to ``end``, or None; see `bars`."""
    if callable(progress):
        yield progress
        return
    with bars(progress, [name]) as move:
        yield None if move is None else lambda t: move(name, (t - start) / (end - start))


def told_of_span(
    progress: Callable[[str, float], None] | None, name: str, span: float
) -> Callable[[float], None] | bool:
    """Return what tells the progress of a named run that it has reached a time of its span (s); False for nobody."""
    if progress is None:
        return False
    return lambda t: progress(name, min(t / span, 1.0))
