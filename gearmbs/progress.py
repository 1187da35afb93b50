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

TICK = 1.0
"""Longest time between two pictures, s: the seconds go on where nothing is told."""

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
    """Bars by name, drawn where somebody watches, by themselves once a second.

    Parameters
    ----------
    names : sequence of str
    where : {"notebook", "terminal"}
    patience : float
        Seconds before they appear.
    known : bool
        Whether it is known from the beginning how far the jobs are; a job of which nothing was told shows its seconds.
    """

    def __init__(self, names: Sequence[str], where: str, patience: float = PATIENCE, known: bool = True) -> None:
        self.done: dict[str, float | None] = dict.fromkeys(names, 0.0 if known else None)
        self.begun = time.monotonic()
        self.patience = patience
        self.where = where
        self._last = 0.0
        self._lock = threading.Lock()
        self._picture: Any = None
        self._ended = threading.Event()
        threading.Thread(target=self._watch, name="progress", daemon=True).start()

    def move(self, name: str, fraction: float) -> None:
        """Note how far a job is, from 0 to 1; draw now and then."""
        self.done[name] = min(max(float(fraction), 0.0), 1.0)
        now = time.monotonic()
        if now - self.begun < self.patience or now - self._last < INTERVAL:
            return
        with self._lock:
            self._draw(now)

    def close(self) -> None:
        """Take the bars away."""
        self._ended.set()
        with self._lock:
            if self._picture is None:
                return
            if self.where == "notebook":
                from IPython.display import HTML

                self._picture.update(HTML(""))
            else:
                self._picture[0].stop()
            self._picture = None

    def _watch(self) -> None:
        """Draw now and then, also where the work says nothing."""
        wait = max(self.patience, INTERVAL)
        while not self._ended.wait(wait):
            with self._lock:
                if not self._ended.is_set():
                    self._draw(time.monotonic())
            wait = TICK

    def _draw(self, now: float) -> None:
        self._last = now
        if self.where == "notebook":
            from IPython.display import HTML, display

            page = HTML(self.to_html(now - self.begun))
            if self._picture is None:
                self._picture = display(page, display_id=True)
            else:
                self._picture.update(page)
            return
        if self._picture is None:
            self._picture = _terminal_bars(list(self.done))
        progress, tasks = self._picture
        for name, fraction in self.done.items():
            if fraction is not None:
                # a clock runs from the first report on: what comes before, as compiling, is not the job's
                if not progress.tasks[tasks[name]].started:
                    progress.start_task(tasks[name])
                progress.update(tasks[name], total=1.0, completed=fraction)

    def to_html(self, seconds: float) -> str:
        """Return the bars as a table; of many jobs those at work, and how many are done."""
        finished = sum(fraction is not None and fraction >= 1.0 for fraction in self.done.values())
        rows = list(self.done.items())
        if len(rows) > SHOWN_ROWS:
            at_work = [(name, fraction) for name, fraction in rows if fraction is None or 0.0 < fraction < 1.0]
            rows = [(f"{finished} of {len(self.done)} done", _share(self.done)), *at_work[: SHOWN_ROWS - 1]]
        cells = "".join(
            f'<tr><td style="text-align:right">{html.escape(name)}</td><td><progress max="1" {_value(fraction)}'
            f'style="width:18em"></progress></td><td style="text-align:right">{_percent(fraction)}</td></tr>'
            for name, fraction in rows
        )
        return f"<table>{cells}<tr><td></td><td>{seconds:.0f} s{_left(self.done, seconds)}</td><td></td></tr></table>"


def _share(done: dict[str, float | None]) -> float:
    return sum(fraction or 0.0 for fraction in done.values()) / max(len(done), 1)


def _value(fraction: float | None) -> str:
    """Return how far a bar is as an attribute; without one it moves to and fro."""
    return "" if fraction is None else f'value="{fraction:.4f}" '


def _percent(fraction: float | None) -> str:
    return "" if fraction is None else f"{100.0 * fraction:.0f} %"


def _left(done: dict[str, float | None], seconds: float) -> str:
    share = _share(done)
    return f", about {seconds * (1.0 - share) / share:.0f} s left" if 0.02 < share < 1.0 else ""


def _terminal_bars(names: list[str]) -> tuple[Any, dict[str, Any]]:
    """Return rich's bars, started, and their tasks by name."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>24}"), BarColumn(), TaskProgressColumn())
    console = Console(stderr=True)
    progress = Progress(*columns, TimeElapsedColumn(), console=console, refresh_per_second=4, transient=True)
    progress.start()
    return progress, {name: progress.add_task(name, start=False, total=None) for name in names}


@contextmanager
def alone() -> Iterator[bool]:
    """Let no other bars appear inside; yield whether there are none already: work inside other work is part of it."""
    global _open
    if _open:
        yield False
        return
    _open = True
    try:
        yield True
    finally:
        _open = False


@contextmanager
def bars(
    progress: bool | Callable[[str, float], None] | None, names: Sequence[str], *, known: bool = True
) -> Iterator[Any]:
    """Yield a function ``move(name, fraction)`` that follows jobs as ``progress`` asks, or None where nobody watches.

    Parameters
    ----------
    progress : bool or callable, optional
        None, True, False or a callable, see `gearmbs.progress`.
    names : sequence of str
        Of all jobs.
    known : bool
        Whether jobs that have told nothing are at their beginning; else it is not known how far they are.
    """
    if callable(progress):
        yield progress
        return
    where = watched()
    if progress is True and where is None:
        where = "terminal"
    if progress is False or where is None:
        yield None
        return
    with alone() as first:
        if not first:
            yield None
            return
        shown = Bars(names, where, 0.0 if progress is True else PATIENCE, known)
        try:
            yield shown.move
        finally:
            shown.close()


@contextmanager
def waiting(name: str) -> Iterator[Callable[[float], None]]:
    """Show that work goes on if it takes longer than two seconds, as a block or as a decorator.

    Yields a function that is told the fraction done, if it is known; until then the bar moves to and fro.
    """
    with bars(None, [name], known=False) as move:
        yield (lambda fraction: None) if move is None else (lambda fraction: move(name, fraction))


def staged(title: str) -> Callable[[F], F]:
    """Give a function that tells ``progress(fraction, stage)`` a bar of this title where it is called without one."""

    def with_bar(function: F) -> F:
        @functools.wraps(function)
        def called(*args: Any, progress: Any = None, **settings: Any) -> Any:
            if callable(progress):
                return function(*args, progress=progress, **settings)
            with bars(progress, [title], known=False) as move:
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
