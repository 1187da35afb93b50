"""What every command of the command line does with errors."""

from __future__ import annotations

import errno
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

import typer

from gearmbs.progress import alone
from gearmbs.schema.described import read_toml
from gearmbs.system import ASKED_TO_END

UNWRITABLE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS}
"""What is wrong with the place and not with the file."""


def fail(message: str) -> None:
    """End with a message and exit status 1."""
    typer.secho(f"gearmbs: {message}", fg="red", err=True)
    raise typer.Exit(1)


ended_by = ASKED_TO_END
"""The signal that asked the program to end, as the handler of `gearmbs.cli` notes it."""


def end_interrupted(message: str) -> NoReturn:
    """End with a message and the exit status of the signal: 130 after Ctrl-C, 143 after SIGTERM."""
    typer.secho(f"gearmbs: {message}", err=True)
    raise typer.Exit(128 + ended_by)


COMMANDS = {
    "case": "`gearmbs run` simulates it, `gearmbs sweep` runs it over values of one setting",
    "planetary set": "`gearmbs run` simulates it",
    "drivetrain": "`gearmbs run` simulates it, `gearmbs campbell` draws its modes over its speed",
}
"""What is described in TOML, and the commands that take it."""


def kind_of(path: Path) -> str | None:
    """Return which of `COMMANDS` a file describes, None if none; what else is wrong is found by who reads it."""
    try:
        data = read_toml(path)
    except ValueError:
        return None
    if "planetary" in data:
        return "planetary set"
    # the shafts of a case are two, with one size; those of a drivetrain have tables of their own, wheels or not
    shafts = data.get("shafts")
    named = isinstance(shafts, dict) and any(isinstance(table, dict) for table in shafts.values())
    if named or "meshes" in data or "wheels" in data:
        return "drivetrain"
    return "case" if "gears" in data or "operation" in data else None


def check_kind(path: Path, wanted: str) -> None:
    """Refuse a file that describes something else than is wanted: a kind of `COMMANDS`, or a record.

    Raises
    ------
    ValueError
        Naming what the file is and the commands that take it.
    """
    if wanted == "record" and path.suffix.lower() != ".toml":
        return
    kind = kind_of(path)
    if kind not in (None, wanted):
        first = f"{path}: describes a {kind}, not a {wanted}"
        raise ValueError(f"{first}; {COMMANDS[kind]}")  # type: ignore[index]


@contextmanager
def guarded() -> Iterator[None]:
    """Turn the library's errors into messages, its warnings into notes, and Ctrl-C into exit status 130."""
    try:
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, *_: typer.secho(f"gearmbs: note: {message}", err=True)
            yield
    except typer.Exit:
        raise
    except KeyboardInterrupt:
        typer.secho("gearmbs: interrupted; finished cases are kept, nothing is half-written", err=True)
        raise typer.Exit(130) from None
    except BrokenPipeError:
        # whoever read the output has enough of it; typer ends quietly
        raise
    except (ValueError, RuntimeError, OSError) as error:
        # what a function asks for by keyword is asked for here by the option of that name
        asked = getattr(error, "name", None) if type(error).__name__ == "MissingMetadataError" else None
        text = str(error)
        if isinstance(error, OSError) and error.filename and error.strerror:
            text = f"{error.filename}: {error.strerror}"
            text += "; choose another place or make room" if error.errno in UNWRITABLE else ""
        told = asked is None or f"--{asked} " in text
        fail(text if told else f"{text} (on the command line: --{asked} ...)")


@contextmanager
def case_bars(names: list[str]) -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar a case; yield the function that moves them."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>24}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    console = Console(stderr=True)
    with alone(), Progress(*columns, TimeElapsedColumn(), console=console, refresh_per_second=4) as progress:
        tasks = {name: progress.add_task(name, total=1.0) for name in names}
        yield lambda name, fraction: progress.update(tasks[name], completed=fraction)


@contextmanager
def stage_bar(name: str) -> Iterator[Callable[[float, str], None]]:
    """Show one bar with the stage it is in, on a terminal; yield the function that moves it."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description:>24}"), BarColumn(), TextColumn("{task.fields[stage]}"))
    shown = Progress(*columns, TimeElapsedColumn(), console=console, transient=True, disable=not console.is_terminal)
    with alone(), shown as progress:
        task = progress.add_task(name, total=1.0, stage="reading")
        yield lambda fraction, stage: progress.update(task, completed=fraction, stage=stage)
